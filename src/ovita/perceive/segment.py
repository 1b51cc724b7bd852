"""Segments: the plane that things rest on, and the clusters of pixels that stand above it.

The plane becomes the table or floor of the scene, which is told in one sentence.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, QhullError

from ovita.limits.problem import SUPPORT, is_support, top_of
from ovita.paths.scene import Scene, SceneObject, quaternion
from ovita.paths.trajectory import Array
from ovita.perceive.view import Mask, View
from ovita.text import listed

Labels = NDArray[np.intp]

SEED = 7
"""Of the random samples; the same picture always gives the same planes."""

HYPOTHESES = 400
SAMPLE = 2500
"""Planes that are tried on so many points."""

TILT = np.cos(np.radians(12.0))
"""A support's normal is at most this far from the direction up (cosine)."""

LEAST_SHARE = 0.04
"""Share of the picture that a support needs at least."""

RIVAL = 0.3
"""Share of the largest level plane's pixels from which a higher one is taken for the support instead."""

LOWEST = 0.006
"""Least height over the support of what counts as standing on it [m]."""

LEAST_JUMP = 0.012
"""Least step in depth between neighbouring pixels that parts two things [m]."""

MARGIN = 0.03
"""How far things may stand over the edge of the support [m]."""

STEP = 5
"""Distance at which what surrounds a cluster is compared with it [pixels]."""

LEAST_REPORTED = 400
"""Fewest pixels of what is left out that a person is told of."""

STEEP = 6.0
"""Change of depth between neighbouring pixels, in widths of a pixel, that one surface seen at a slant may have."""


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane n . x = offset.

    Args:
        normal: Unit vector (3,), pointing up.
        offset: [m].
    """

    normal: Array
    offset: float

    def heights(self, points: Array) -> Array:
        """Signed heights of points (..., 3) [m] above it."""
        return np.asarray(points @ self.normal - self.offset)


@dataclass(frozen=True, eq=False)
class Footing:
    """What was seen of a support.

    Args:
        rim: Corners of the convex hull of its pixels (K, 3) [m].
        cut: Whether the border of a picture cuts it.
    """

    rim: Array
    pixels: int
    cut: bool = False

    @classmethod
    def of(cls, points: Array, plane: Plane, pixels: int, *, cut: bool = False) -> Footing | None:
        """Around points (N, 3) [m] of a plane; None where they span no surface."""
        flat = points @ sides_of(plane.normal).T
        if len(points) < 3 or min(np.ptp(flat, axis=0)) < 1e-3:
            return None
        try:
            return cls(points[ConvexHull(flat).vertices], pixels, cut)
        except QhullError:
            return None

    def holds(self, points: Array, plane: Plane) -> Mask:
        """Which points (N, 3) [m] lie over it, or at most `MARGIN` beside it, (N,)."""
        sides = sides_of(plane.normal)
        edges = ConvexHull(self.rim @ sides.T).equations
        return np.asarray((points @ sides.T @ edges[:, :2].T + edges[:, 2]).max(axis=1) <= MARGIN)


def sides_of(normal: Array) -> Array:
    """Two unit vectors along a plane, (2, 3)."""
    return np.asarray(np.linalg.svd(normal[None])[2][1:])


@dataclass(frozen=True, eq=False)
class Segments:
    """A view taken apart.

    Args:
        labels: Cluster of each pixel (H, W), from 1; 0 for none.
        depth: Smoothed depth without flying pixels (H, W) [m].
        noise: Standard deviation of the measured depth at each pixel (H, W) [m].
        beyond: How many clusters were left out since they stand beside the support.
        backdrops: How many were left out since they are walls.
    """

    labels: Labels
    depth: Array
    noise: Array
    support: Plane | None
    footing: Footing | None = None
    beyond: int = 0
    backdrops: int = 0

    @property
    def count(self) -> int:
        """How many clusters there are."""
        return int(self.labels.max())


def noise_of(view: View) -> Array:
    """Standard deviation of the depth at each pixel (H, W) [m], measured on the picture itself.

    Stereo and structured light err by k z^2; k is the median of the second differences along the rows, which are
    free of the slope of what is seen.
    """
    z = view.depth[::3]
    bend = np.abs(z[:, 2:] - 2.0 * z[:, 1:-1] + z[:, :-2]) / z[:, 1:-1] ** 2
    known = bend[np.isfinite(bend)]
    k = float(np.median(known)) / (0.6745 * np.sqrt(6.0)) if len(known) else 0.0
    squares = k * np.where(view.seen, view.depth, 1.0) ** 2
    return np.asarray(np.sqrt(2.5e-7 + squares * squares))


def segment(view: View, up: Array, plane: Plane | None = None, *, find_plane: bool = True) -> Segments:
    """Take a view apart into the support and the things above it.

    `up` is a unit vector (3,) in the world. A support is looked for where none is given, unless `find_plane` is off;
    without one, clusters are parted by depth alone.
    """
    noise = noise_of(view)
    depth, jumps = _smooth(view, noise)
    if plane is None and find_plane:
        plane = _support(view, depth, noise, up)
    standing, footing = np.isfinite(depth), None
    if plane is not None:
        slant = view.along(plane.normal)
        thick = np.maximum(LOWEST, 1.75 * noise * np.abs(slant))
        heights = slant * depth + plane.heights(view.center)
        standing &= heights > thick
        footing = _footing(view, depth, np.abs(heights) < thick, plane)
    labels = _components(depth, standing, jumps)
    beyond = _beyond(view, depth, labels, footing, plane)
    backdrop = _backdrop(depth, labels, jumps) & ~beyond
    gone = beyond | backdrop
    kept = np.where(gone, 0, np.cumsum(~gone) - 1)
    large = np.bincount(labels.ravel()) >= LEAST_REPORTED
    left_out = (int((beyond & large).sum()), int((backdrop & large).sum()))
    return Segments(kept[labels], depth, noise, plane, footing, *left_out)


def _located(view: View, depth: Array, pixels: NDArray[np.intp]) -> Array:
    """Where some pixels, counted row by row, hit something, (N, 3) [m]."""
    return view.located(*np.divmod(pixels, view.shape[1]), depth.ravel()[pixels])


def _support(view: View, depth: Array, noise: Array, up: Array) -> Plane | None:
    known = np.flatnonzero(np.isfinite(depth))
    chosen = np.random.default_rng(SEED).choice(known, min(SAMPLE, len(known)), replace=False)
    spread = np.abs(view.along(up)).ravel()[chosen] * noise.ravel()[chosen]
    return support_of(_located(view, depth, chosen), spread, up, share=len(known) / depth.size)


def _footing(view: View, depth: Array, on: Mask, plane: Plane) -> Footing | None:
    """What was seen of the support: the larger patches of its pixels (H, W), by the first and last of each row."""
    patches, count = ndimage.label(on)
    sizes = np.bincount(patches.ravel(), minlength=count + 1)
    sizes[0] = 0
    wide = (sizes >= max(0.05 * sizes.sum(), 1.0))[patches]
    border = view.frame.copy()
    border[1:-1, 1:-1] &= ~(view.frame[2:, 1:-1] & view.frame[:-2, 1:-1] & view.frame[1:-1, 2:] & view.frame[1:-1, :-2])
    cut = (wide & border).any()
    rows, last = np.flatnonzero(wide.any(axis=1)), wide.shape[1] - 1
    ends = np.concatenate([wide[rows].argmax(axis=1), last - wide[rows, ::-1].argmax(axis=1)])
    pixels = np.concatenate([rows, rows]) * wide.shape[1] + ends
    return Footing.of(_located(view, depth, pixels), plane, int(wide.sum()), cut=bool(cut))


def _beyond(view: View, depth: Array, labels: Labels, footing: Footing | None, plane: Plane | None) -> Mask:
    """Which clusters (from 0, the first never) stand beside the support."""
    count = int(labels.max()) + 1
    if footing is None or plane is None:
        return np.zeros(count, dtype=bool)
    some = np.flatnonzero(labels)[::6]
    owner = labels.ravel()[some]
    outside = ~footing.holds(_located(view, depth, some), plane)
    out = np.bincount(owner, weights=outside, minlength=count)
    return np.asarray(out > 0.5 * np.maximum(np.bincount(owner, minlength=count), 1))


def _backdrop(depth: Array, labels: Labels, jump: Array) -> Mask:
    """Which clusters (from 0, the first never) are walls: at the border of the picture, with nothing behind them."""
    count = int(labels.max()) + 1
    border = np.zeros(count, dtype=bool)
    for line in (labels[0], labels[-1], labels[:, 0], labels[:, -1]):
        border[line] = True
    border[0] = False
    rims, deeper = np.zeros(count), np.zeros(count)
    if border.any():
        for mine, behind in _rims(depth, labels, jump):
            rims += np.bincount(mine, minlength=count)
            deeper += np.bincount(mine, weights=behind, minlength=count)
    return border & (deeper < 0.05 * np.maximum(rims, 1.0))


def _rims(depth: Array, labels: Labels, jump: Array) -> Iterator[tuple[Labels, Mask]]:
    """For each of four sides, the clusters of the pixels at a rim, and whether what is `STEP` pixels on lies behind."""
    some, rest, whole = slice(None, -STEP), slice(STEP, None), slice(None)
    for here, there in ((some, rest), (rest, some)):
        for a, b in (((here, whole), (there, whole)), ((whole, here), (whole, there))):
            rim = (labels[a] != labels[b]) & (labels[a] > 0)
            rim[rim] = np.isfinite(depth[b][rim])
            yield labels[a][rim], depth[b][rim] > depth[a][rim] + jump[a][rim]


def _smooth(view: View, noise: Array) -> tuple[Array, Array]:
    """The depth, each pixel the median of its surroundings, nan at flying pixels; and the step that parts things."""
    z = np.where(view.seen, view.depth, 0.0)
    median = _median(z)
    jump = np.maximum(np.maximum(LEAST_JUMP, 5.0 * noise), z * (STEEP / view.focal))
    median[~(np.abs(z - median) <= jump) | (z <= 0.0) | (median <= 0.0)] = np.nan
    return median, jump


def _median(values: Array) -> Array:
    """The median of the 3 x 3 pixels around each pixel (H, W), by a network of exchanges over the whole picture."""
    wide = np.pad(values.astype(np.float32), 1, mode="symmetric")
    high, across = values.shape
    v = [wide[dy : dy + high, dx : dx + across].copy() for dy in range(3) for dx in range(3)]
    spare = np.empty_like(v[0])
    for i, j in _MEDIAN_OF_NINE:
        np.minimum(v[i], v[j], out=spare)
        np.maximum(v[i], v[j], out=v[j])
        v[i], spare = spare, v[i]
    return v[4].astype(np.float64)


_MEDIAN_OF_NINE = (
    *((1, 2), (4, 5), (7, 8), (0, 1), (3, 4), (6, 7), (1, 2), (4, 5), (7, 8), (0, 3)),
    *((5, 8), (4, 7), (3, 6), (1, 4), (2, 5), (4, 7), (4, 2), (6, 4), (4, 2)),
)
"""Exchanges after which the fifth of nine values is their median (Devillard, 1998, after Paeth)."""


def support_of(points: Array, spread: Array, up: Array, *, share: float = 1.0) -> Plane | None:
    """The level plane that things stand on, by RANSAC and least squares, or None.

    Of several, such as a floor and a table, the highest of those that are at least `RIVAL` times as large in the
    picture as the largest.

    Args:
        points: (N, 3) [m]; of more than `SAMPLE` some are looked at.
        spread: Standard deviation of their heights (N,) [m].
        up: Unit vector (3,).
        share: Of the picture that the points were drawn from.
    """
    if len(points) < 3:
        return None
    rng = np.random.default_rng(SEED)
    some = rng.choice(len(points), min(SAMPLE, len(points)), replace=False)
    cloud, band = points[some], 2.0 * spread[some] + 0.002
    planes: list[tuple[Plane, int]] = []
    left = np.ones(len(cloud), dtype=bool)
    least = max(LEAST_SHARE * len(cloud) / share, 3)
    while len(planes) < 3 and left.sum() >= least:
        plane = _level(cloud[left], band[left], up, rng)
        on = left & (np.abs(plane.heights(cloud)) < 1.5 * band) if plane is not None else ~left
        if plane is None or on.sum() < least:
            break
        planes.append((plane, int(on.sum())))
        left &= ~on
    most = max((count for _, count in planes), default=0)
    return max((plane for plane, count in planes if count >= RIVAL * most), key=lambda one: one.offset, default=None)


def _level(cloud: Array, band: Array, up: Array, rng: np.random.Generator) -> Plane | None:
    """The level plane through most of the points (N, 3), each with its half width (N,) [m]; None if there is none."""
    corners = cloud[rng.integers(0, len(cloud), (HYPOTHESES, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(lengths, 1e-12)[:, None]
    normals *= np.sign(normals @ up)[:, None]
    level = (lengths > 1e-8) & (normals @ up > TILT)
    if not level.any():
        return None
    normals, corners = normals[level], corners[level]
    offsets = np.einsum("ij,ij->i", normals, corners[:, 0])
    best = int((np.abs(cloud[::2] @ normals.T - offsets) < band[::2, None]).sum(axis=0).argmax())
    plane = Plane(normals[best], float(offsets[best]))
    for _ in range(4):
        near = np.abs(plane.heights(cloud)) < band
        if near.sum() < 3:
            return None
        plane = _through(cloud[near], 1.0 / band[near], up)
    return plane


def _through(points: Array, weights: Array, up: Array) -> Plane:
    """The plane of least squares through points (N, 3) with weights (N,)."""
    center = np.average(points, axis=0, weights=weights**2)
    normal = np.linalg.svd((points - center) * weights[:, None], full_matrices=False)[2][2]
    normal = normal * np.sign(normal @ up)
    return Plane(normal, float(normal @ center))


def _components(depth: Array, standing: Mask, jump: Array) -> Labels:
    """Connected pixels without a step in depth between them, (H, W) from 1."""
    index: Labels = np.cumsum(standing.ravel(), dtype=np.intp).reshape(depth.shape) - 1
    joined: list[tuple[Labels, Labels]] = []
    for here, there in (
        ((slice(None), slice(None, -1)), (slice(None), slice(1, None))),
        ((slice(None, -1), slice(None)), (slice(1, None), slice(None))),
    ):
        link = standing[here] & standing[there]
        link[link] = np.abs(depth[here][link] - depth[there][link]) < jump[here][link]
        joined.append((index[here][link], index[there][link]))
    rows, columns = (np.concatenate(ends) for ends in zip(*joined, strict=True))
    count = int(index[-1, -1]) + 1
    labels = np.zeros(depth.shape, dtype=np.intp)
    labels[standing] = connected(count, rows, columns) + 1
    return labels


def connected(count: int, rows: Labels, columns: Labels) -> Labels:
    """Number of the part of a graph (count,) that each of its nodes belongs to, by the ends of its links."""
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1] if count else [], dtype=np.intp)


THICKNESS = {"table": 0.03, "floor": 0.1}
"""What is assumed of a support by its name, since nobody sees it [m]."""

HIGH = 0.3
"""A support that is higher than this above zero is a table [m]."""

WIDE = 1.8
"""Of the others, one that was seen to be longer than this is a floor [m]."""

LEVEL = np.cos(np.radians(0.6))
"""Cosine of the angle up to which a support is taken to be level."""


def support_object(plane: Plane, up: Array, footings: Sequence[Footing]) -> SceneObject | None:
    """The support as a box: the rectangle around what was seen of it, its own z axis up, its thickness assumed.

    `plane` is its upper side, `up` a unit vector (3,) in the world, `footings` what each view saw of it.

    Returns:
        An object of the kind "support", named "table" or "floor"; None where no view saw it.
    """
    if not footings:
        return None
    rim = np.concatenate([one.rim for one in footings])
    middle, size, turn = _rectangle(rim, plane.normal)
    away = up if plane.normal @ up > LEVEL else plane.normal
    turn = _axes(turn[:, 0], away)
    middle = middle - plane.heights(middle) / (plane.normal @ away) * away
    name = name_of(float(middle @ up), float(size.max()))
    thick = THICKNESS[name]
    extra: dict[str, object] = {"kind": SUPPORT, "shape": "box", "seen_by": len(footings)}
    extra |= {"points": sum(one.pixels for one in footings), "assumed": "thickness"}
    extra |= {"cut": True} if any(one.cut for one in footings) else {}
    center = np.round(middle - 0.5 * thick * turn[:, 2], 4) + 0.0
    return SceneObject(name, center, np.round([*size, thick], 4), quaternion(turn), extra)


def name_of(height: float, length: float) -> str:
    """Whether a support at a height [m] that was seen to be so long [m] is a "table" or a "floor"."""
    return "floor" if height < HIGH and length > WIDE else "table"


def _rectangle(points: Array, normal: Array) -> tuple[Array, Array, Array]:
    """The smallest rectangle around points (N, 3) along a plane: middle (3,), size (2,), axes (3, 3) as columns."""
    sides = sides_of(normal)
    flat = points @ sides.T
    corners = flat[ConvexHull(flat).vertices]
    edges = np.roll(corners, -1, axis=0) - corners
    edges = edges / np.maximum(np.linalg.norm(edges, axis=1), 1e-12)[:, None]
    frames = np.stack([edges, edges[:, ::-1] * (-1.0, 1.0)], axis=1)  # (E, 2, 2), rows are axes
    spread = np.einsum("eij,nj->eni", frames, corners)
    low, high = spread.min(axis=1), spread.max(axis=1)
    best = int(np.prod(high - low, axis=1).argmin())
    axis, size = frames[best], (high - low)[best]
    middle = 0.5 * (high + low)[best] @ axis
    along, across = axis @ sides
    turn = _upright(along, normal)
    swapped = abs(turn[:, 0] @ across) > abs(turn[:, 0] @ along)
    return middle @ sides, size[::-1] if swapped else size, turn


def _upright(along: Array, up: Array) -> Array:
    """As `_axes`, x the one of the four level directions at right angles nearest to +x."""
    turn = _axes(along, up)
    first, other = turn[:, 0], turn[:, 1]
    return _axes(max((first, -first, other, -other), key=lambda one: float(one[0])), up)


def _axes(along: Array, up: Array) -> Array:
    """Axes (3, 3) as columns: z is `up`, x the level direction nearest to `along` (3,)."""
    first = along - (along @ up) * up
    first = first / np.linalg.norm(first)
    return np.column_stack([first, np.cross(up, first), up])


def description(scene: Scene) -> str:
    """One sentence on what a scene holds, from its objects alone; "" for none."""
    things = [item.name for item in scene if not is_support(item)]
    support = next((item for item in scene if is_support(item)), None)
    if not things:
        return ""
    there = f"Seen by a camera: {listed(things)}"
    if support is None:
        return f"{there}."
    height = float(top_of(support) @ scene.frame.direction("up"))
    return f"{there}, on the {support.name}, whose upper side is at height {height:.3f} m."


def with_objects(scene: Scene, objects: Sequence[SceneObject]) -> Scene:
    """The scene with other objects; a description that ovita made of the ones before is made anew."""
    new = replace(scene, objects=tuple(objects))
    return replace(new, environment=description(new)) if scene.environment == description(scene) else new
