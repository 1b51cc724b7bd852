"""Shapes that both kinds of figure draw: cuboids, workspaces, what part of the world to show, where names go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ovita.paths.robot import Box, Shell
from ovita.paths.scene import DIRECTIONS, Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory

View = Literal["auto", "3d", "top"]

COLOURS = {
    "before": "#1f5fbf",
    "after": "#d62728",
    "proposed": "#8a8a8a",
    "waiting": "#ffb300",
    "start": "#2ca02c",
    "goal": "#111111",
    "workspace": "#9aa5b1",
    "violation": "#c2185b",
    "tube": "#f3b0ad",
    "slower": "#f2a900",
    "faster": "#17becf",
}
"""Colour of each part of a figure."""

OBJECT_COLOURS = ("#e69f00", "#009e73", "#9467bd", "#8c564b", "#56b4e9", "#e377c2", "#7f7f7f", "#bcbd22")
"""Colours of the objects, in turn."""

FACES: NDArray[np.int_] = np.array([[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]])
"""Corner numbers of a cuboid's 6 faces, each in order around the face."""

TRIANGLES: NDArray[np.int_] = np.concatenate([FACES[:, [0, 1, 2]], FACES[:, [0, 2, 3]]])
"""Corner numbers of the 12 triangles that make up a cuboid."""

_CORNERS = np.array(list(product((-1.0, 1.0), repeat=3)))
_FAR = 2.0
_FLAT = 0.01


@dataclass(frozen=True)
class Extent:
    """The part of the world that a figure shows.

    Args:
        lower, upper: Its corners (3,) [m].
        left_out: Names of objects so far away that showing them would shrink everything else to a dot.
    """

    lower: Array
    upper: Array
    shown: tuple[SceneObject, ...]
    left_out: tuple[str, ...]

    @property
    def size(self) -> Array:
        """Edge lengths (3,) [m]."""
        return self.upper - self.lower


def corners(item: SceneObject, least: float = 0.0) -> Array:
    """The 8 corners (8, 3) [m] of an object's cuboid; edges shorter than `least` [m] are drawn that long."""
    return np.asarray(item.position + (_CORNERS * np.maximum(item.size, least) / 2.0) @ item.rotation.T)


def extent(paths: Sequence[Trajectory], scene: Scene) -> Extent:
    """What to show: the paths and the objects, except objects much farther away than the paths are large."""
    points = np.concatenate([path.positions for path in paths])
    lower, upper = points.min(axis=0), points.max(axis=0)
    reach = _FAR * max(float(np.linalg.norm(upper - lower)), 0.1)
    near = [item for item in scene if _gap(item, lower, upper) <= reach]
    for item in near:
        box = corners(item)
        lower, upper = np.minimum(lower, box.min(axis=0)), np.maximum(upper, box.max(axis=0))
    longest = max(float((upper - lower).max()), 1e-3)
    least = np.maximum(upper - lower, 0.35 * longest) * 1.08
    middle = (lower + upper) / 2.0
    left_out = tuple(item.name for item in scene if item not in near)
    return Extent(middle - least / 2.0, middle + least / 2.0, tuple(near), left_out)


def _gap(item: SceneObject, lower: Array, upper: Array) -> float:
    outside = np.maximum(np.maximum(lower - item.position, item.position - upper), 0.0)
    return float(np.linalg.norm(outside))


def planar(paths: Sequence[Trajectory]) -> bool:
    """Whether all paths lie in one horizontal plane, so that a view from above shows everything."""
    spread = np.ptp(np.concatenate([path.positions for path in paths]), axis=0)
    return bool(spread[2] <= _FLAT * max(float(spread[0]), float(spread[1])))


def tube(path: Array, covariance: Array) -> Array:
    """Rings (N, 24, 3) [m] around a path (N, 3) [m]: what lies within two standard deviations across its direction.

    The covariance has rows xx, xy, xz, yy, yz, zz (N, 6) [m2].
    """
    along = np.gradient(path, axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-12)
    aside = np.eye(3)[np.abs(along).argmin(axis=1)]
    first = np.cross(along, aside)
    first /= np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-12)
    across = np.stack([first, np.cross(along, first)], axis=2)
    full = covariance[:, [0, 1, 2, 1, 3, 4, 2, 4, 5]].reshape(-1, 3, 3)
    values, axes = np.linalg.eigh(across.transpose(0, 2, 1) @ full @ across)
    roots = (axes * np.sqrt(np.maximum(values, 0.0))[:, None, :]) @ axes.transpose(0, 2, 1)
    turn = np.linspace(0.0, 2.0 * np.pi, 24)
    ring = np.stack([np.cos(turn), np.sin(turn)])
    return np.asarray(path[:, None] + 2.0 * (across @ roots @ ring).transpose(0, 2, 1))


def walls(rings: Array) -> Array:
    """The quadrilaterals (M, 4, 3) between neighbouring rings (N, sides, 3) of a tube."""
    a, b = rings[:-1], rings[1:]
    return np.stack([a[:, :-1], a[:, 1:], b[:, 1:], b[:, :-1]], axis=2).reshape(-1, 4, 3)


def axis_word(frame: Frame, axis: int) -> str:
    """Direction word of a world axis (0, 1, 2), such as "right" for x in the frame "rfu"."""
    return next(word for word in DIRECTIONS if frame.direction(word)[axis] > 0.5)


def axis_of(frame: Frame, word: str) -> tuple[int, float]:
    """World axis (0, 1, 2) along which a direction word points, and its sign."""
    direction = frame.direction(word)
    axis = int(np.argmax(np.abs(direction)))
    return axis, float(direction[axis])


def workspace_lines(workspace: Box | Shell, lower: Array, upper: Array) -> list[Array]:
    """Lines (K, 3) [m] that outline a workspace; what lies outside the shown part is cut away with NaN rows.

    A box gives its 12 edges, a shell circles of both of its spheres. Lines that are outside throughout are dropped.
    """
    lines = _box_lines(workspace) if isinstance(workspace, Box) else _shell_lines(workspace)
    clipped = []
    for line in lines:
        outside = np.any((line < lower - 1e-9) | (line > upper + 1e-9), axis=1, keepdims=True)
        if len(line) - np.count_nonzero(outside) > 1:
            clipped.append(np.where(outside, np.nan, line))
    return clipped


def _box_lines(box: Box) -> list[Array]:
    item = (_CORNERS + 1.0) / 2.0
    points = np.asarray(box.lower) + item * (np.asarray(box.upper) - box.lower)
    edges = [(i, j) for i in range(8) for j in range(i + 1, 8) if np.abs(item[i] - item[j]).sum() == 1]
    share = np.linspace(0.0, 1.0, 201)[:, None]
    return [points[i] * (1.0 - share) + points[j] * share for i, j in edges]


def _shell_lines(shell: Shell) -> list[Array]:
    turn = np.linspace(0.0, 2.0 * np.pi, 181)
    x, y, one = np.cos(turn), np.sin(turn), np.ones_like(turn)
    meridians = [np.stack([x * np.cos(a), x * np.sin(a), y], axis=1) for a in np.arange(6) * np.pi / 6.0]
    tilts = np.array([-60.0, -30.0, 0.0, 30.0, 60.0]) * np.pi / 180.0
    circles = [*meridians, *(np.stack([x, y, one * np.tan(a)], axis=1) * np.cos(a) for a in tilts)]
    radii = [radius for radius in (shell.r_min, shell.r_max) if radius > 0.0]
    return [circle * radius + np.asarray(shell.center) for radius in radii for circle in circles]


_ANGLES = np.deg2rad([90, -90, 0, 180, 45, 135, -45, -135, 67, 113, -67, -113, 22, 158, -22, -158])
_GAPS = (4.0, 12.0, 24.0, 40.0, 60.0, 85.0)


def busy(paths: Sequence[Trajectory]) -> Array:
    """Points (K, 3) [m] of paths that labels should not cover; the ends count four times."""
    lines = [path.resample(150).positions for path in paths]
    return np.concatenate([*lines, *(np.repeat(path.positions[[0, -1]], 4, axis=0) for path in paths)])


@dataclass(frozen=True)
class Placed:
    """A label's middle (2,) and whether it lies so far from its object that a line should join them."""

    middle: Array
    joined: bool


def place_labels(
    boxes: Sequence[tuple[Array, Array]],
    sizes: Sequence[tuple[float, float]],
    busy: Array,
    area: tuple[Array, Array],
    *,
    scale: float = 1.0,
) -> list[Placed]:
    """Choose a place for each label, one after the other, where it covers least; all in pixels.

    Boxes are the lower and upper corner (2,) of each object, sizes width and height of each label. Labels should not
    cover `busy` points (K, 2), and stay in the corners of an area. Gaps grow by the scale, pixels per point.
    """
    placed: list[Placed] = []
    taken: list[tuple[float, tuple[Array, Array]]] = []
    for own, (box, size) in enumerate(zip(boxes, sizes, strict=True)):
        half = np.asarray(size) / 2.0
        middles, costs = _candidates(box, half, scale)
        lower, upper = middles - half - 2.0 * scale, middles + half + 2.0 * scale
        hits = ((busy >= lower[:, None]) & (busy <= upper[:, None])).all(axis=2).sum(axis=1)
        costs = costs + 6.0 * np.minimum(hits, 20)
        for price, other in (*taken, *((15.0 if i == own else 60.0, other) for i, other in enumerate(boxes))):
            costs = costs + price * _overlap(lower, upper, *other)
        outside = np.maximum(area[0] - lower, 0.0).sum(axis=1) + np.maximum(upper - area[1], 0.0).sum(axis=1)
        costs = costs + 20.0 * outside / scale
        best = int(np.argmin(costs))
        taken.append((400.0, (lower[best], upper[best])))
        gap = np.maximum(np.maximum(box[0] - upper[best], lower[best] - box[1]), 0.0)
        placed.append(Placed(middles[best], bool(np.linalg.norm(gap) > 9.0 * scale)))
    return placed


def _candidates(box: tuple[Array, Array], half: Array, scale: float) -> tuple[Array, Array]:
    middle, reach = (box[0] + box[1]) / 2.0, (box[1] - box[0]) / 2.0 + half
    spots = [middle]
    costs = [30.0]
    for gap in _GAPS:
        for k, angle in enumerate(_ANGLES):
            direction = np.array([np.cos(angle), np.sin(angle)])
            stretch = direction / np.abs(direction).max() if k < 4 else np.sign(direction) * np.sqrt(np.abs(direction))
            spots.append(middle + stretch * reach + direction * gap * scale)
            costs.append(0.35 * gap + (0.0 if k < 2 else 1.5))
    return np.array(spots), np.array(costs)


def _overlap(lower: Array, upper: Array, other_lower: Array, other_upper: Array) -> Array:
    """Share of the smaller rectangle that two rectangles have in common, for rows of the first pair."""
    common = np.maximum(np.minimum(upper, other_upper) - np.maximum(lower, other_lower), 0.0).prod(axis=1)
    smaller = np.minimum((upper - lower).prod(axis=1), float((other_upper - other_lower).prod()))
    return np.asarray(common / np.maximum(smaller, 1.0))
