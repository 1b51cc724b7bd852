"""Fits: the box, cylinder or ball that explains the pixels of one thing best.

Every candidate is judged by one measure: how far the measured points are from its surface, and how far the lines of
sight along the outline are from touching it, each in units of its own noise, with a Cauchy loss. Nothing else is
needed for one view or several, for hidden sides, or to choose between the shapes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from ovita.paths.trajectory import Array
from ovita.perceive.evidence import Evidence
from ovita.perceive.segment import SEED
from ovita.perceive.view import Mask

Kind = Literal["box", "cylinder", "sphere"]

CAUCHY = 2.5
"""Residual, in standard deviations, from which a pixel counts for less and less."""

ROUNDS = 20
"""Steps of a fit at most."""

HEAT = 4
"""Steps after which a family whose loss is `HOPELESS` times the best is given up."""

HOPELESS = 3.0
"""See `HEAT`."""

THIN = 90
"""Points, and lines of sight, on which the families of shapes are compared first."""

POOR = 0.45
"""Mean loss above which a shape that stands upright does not explain the pixels; Gaussian noise gives 0.4."""

BETTER = 0.8
"""A tilted shape must have at most this share of the loss of the upright ones."""

LEANING = np.cos(np.radians(5.0))
"""Cosine of the angle from which a thing leans."""

IRREGULAR = 1.0
"""Mean loss from which no shape explains the pixels."""

SMALLEST = 0.004
"""Least edge of a solid [m]."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A primitive shape.

    Args:
        kind: A box; a cylinder along its own z axis; a sphere.
        center: (3,) [m].
        rotation: (3, 3), columns are its axes.
        size: Full edge lengths of the cuboid around it (3,) [m].
        loss: Mean loss of the pixels, and a little for every number of the shape; 0.4 is noise alone.
        spread: Median distance of the measured points to its surface [m].
        tilted: Whether it stands on none of its faces.
        regular: Whether it explains the pixels; if not, it is the box around them.
    """

    kind: Kind
    center: Array
    rotation: Array
    size: Array
    loss: float = float("nan")
    spread: float = float("nan")
    tilted: bool = False
    regular: bool = True

    def turned(self, axes: Array, origin: Array) -> Solid:
        """Back from axes whose rows are (3, 3) and whose zero is `origin` (3,) in the world."""
        center, rotation = axes.T @ self.center + origin, axes.T @ self.rotation
        rotation, size = _plainest(self.kind, rotation, self.size)
        return replace(self, center=center, rotation=rotation, size=size)


@dataclass(frozen=True, eq=False)
class _Model:
    """A family of solids: where it starts, and in which directions its nine numbers may change.

    The nine are the centre (3), a rotation vector in the solid's own axes (3), and the full size (3).
    """

    kind: Kind
    start: Array
    turn: Array
    basis: Array
    grounded: bool = False
    """Whether it reaches down to the support, so that its underside is never seen."""
    tilted: bool = False


def fit(evidence: Evidence, *, supported: bool, hints: Sequence[Solid] = (), rough: bool = False) -> Solid:
    """The solid that explains the evidence best; where none does, the upright box around the points.

    Args:
        evidence: In axes whose z points up, zero on the support where there is one.
        supported: Whether there is a support, z = 0.
        hints: Solids that explain parts of the evidence.
        rough: Whether the part of the evidence on which families are compared is enough, as for a first guess.
    """
    agreed = {one.kind for one in hints if one.regular and not one.tilted}
    if supported and len(agreed) == 1 and len(hints) > 1:
        likely = [model for model in _standing(evidence) if model.kind in agreed]
        quick = _best(likely, evidence, supported=True, rough=rough)
        if quick.loss <= POOR:
            return quick
    standing = _best(_standing(evidence), evidence, supported=True, rough=rough) if supported else None
    if standing is not None and standing.loss <= POOR:
        return standing
    floating = _best([*_floating(evidence), *_resumed(hints)], evidence, supported=supported, rough=rough)
    best = floating if standing is None or floating.loss < _share(floating) * standing.loss else standing
    return best if best.loss <= IRREGULAR else _enclosing(evidence, best.loss, supported=supported)


def _share(one: Solid) -> float:
    """Share of an upright shape's loss that a floating one may have at most: little, if it hardly leans."""
    leaning = float(np.abs(one.rotation[2]).max() if one.kind == "box" else abs(one.rotation[2, 2]))
    return BETTER if leaning < LEANING or one.kind == "sphere" else 0.5 * BETTER


def _resumed(hints: Sequence[Solid]) -> list[_Model]:
    """Families of any attitude that start where earlier fits ended."""
    bases = {"box": np.eye(9), "cylinder": _FREE_CYLINDER, "sphere": _FREE_BALL}
    return [
        _Model(one.kind, np.array([*one.center, 0.0, 0.0, 0.0, *one.size]), one.rotation, bases[one.kind], tilted=True)
        for one in hints
        if one.tilted and one.regular
    ]


def _enclosing(evidence: Evidence, loss: float, *, supported: bool) -> Solid:
    """The upright box of least footprint around all points, down to the support if there is one."""
    boxes = _upright_boxes(evidence.points, 0.5)
    best = boxes[int((boxes[:, 6] * boxes[:, 7]).argmin())]
    center, size = best[:3].copy(), best[6:].copy()
    if not supported:
        low, high = np.percentile(evidence.points[:, 2], [0.5, 99.5])
        center[2], size[2] = 0.5 * (low + high), max(float(high - low), SMALLEST)
    turn = Rotation.from_euler("z", best[5]).as_matrix()
    return Solid("box", center, turn, size, loss, float("nan"), regular=False)


def _standing(evidence: Evidence) -> list[_Model]:
    """Upright boxes and cylinders, cylinders that lie, and balls."""
    boxes = _upright_boxes(evidence.points)
    order = _losses("box", boxes, np.eye(3), evidence, grounded=True).argsort()
    first = boxes[order[0]]
    others = [boxes[i] for i in order[1:] if 0.2 < abs(boxes[i][5] - first[5]) < np.pi / 2 - 0.2]
    models = [_Model("box", start, np.eye(3), _UPRIGHT_BOX, grounded=True) for start in [first, *others[:1]]]
    round_ = first.copy()
    round_[5] = 0.0
    across = 0.5 * (first[6] + first[7])
    round_[6:8] = across
    models.append(_Model("cylinder", round_, np.eye(3), _UPRIGHT_CYLINDER, grounded=True))
    ball = first.copy()
    ball[2], ball[3:6], ball[6:] = 0.5 * first[8], 0.0, first[8]
    models.append(_Model("sphere", ball, np.eye(3), _RESTING_BALL))
    models += [_lying(first, quarter) for quarter in (0.0, np.pi / 2)]
    return models


def _lying(box: Array, quarter: float) -> _Model:
    """A cylinder on its side in the place of an upright box, along one of its level edges."""
    yaw = box[5] + quarter
    turn = Rotation.from_euler("zy", [yaw, np.pi / 2]).as_matrix()
    along = box[6] if quarter == 0.0 else box[7]
    start = np.array([*box[:2], 0.5 * box[8], 0.0, 0.0, 0.0, box[8], box[8], along])
    basis = np.zeros((9, 5))
    basis[0, 0] = basis[1, 1] = basis[8, 4] = 1.0
    basis[3:6, 2] = turn.T @ (0.0, 0.0, 1.0)
    basis[2, 3], basis[6, 3], basis[7, 3] = 0.5, 1.0, 1.0
    return _Model("cylinder", start, turn, basis)


def _floating(evidence: Evidence) -> list[_Model]:
    """Boxes, cylinders and balls of any attitude."""
    turns = _attitudes(evidence)
    starts = np.zeros((len(turns), 9))
    for start, turn in zip(starts, turns, strict=True):
        start[:3], start[6:] = _extent(evidence.points, turn)
        start[3:6] = Rotation.from_matrix(turn).as_rotvec()
    order = _losses("box", starts, np.eye(3), evidence, grounded=False).argsort()
    models = []
    for i in _apart(turns, order, 3):
        level = np.where(np.arange(9) // 3 == 1, 0.0, starts[i])
        models.append(_Model("box", level, turns[i], np.eye(9), tilted=True))
    center, size = starts[order[0], :3], starts[order[0], 6:]
    for along in np.argsort(size)[[0, 2]]:
        turn = np.roll(turns[order[0]], 2 - along, axis=1)
        across = float(np.mean(np.delete(size, along)))
        start = np.array([*center, 0.0, 0.0, 0.0, across, across, size[along]])
        models.append(_Model("cylinder", start, turn, _FREE_CYLINDER, tilted=True))
    ball = np.array([*center, 0.0, 0.0, 0.0, *[float(size.mean())] * 3])
    models.append(_Model("sphere", ball, np.eye(3), _FREE_BALL))
    return models


def _apart(turns: Sequence[Array], order: Iterable[int], count: int) -> list[int]:
    """The first so many rotations in an order that differ by more than 15 degrees, whatever their axes are called."""
    chosen: list[int] = []
    for i in order:
        near = (np.sort(np.abs(turns[i].T @ turns[j]).max(axis=0))[0] > 0.966 for j in chosen)
        if not any(near):
            chosen.append(int(i))
        if len(chosen) == count:
            break
    return chosen


def _attitudes(evidence: Evidence) -> list[Array]:
    """Rotations (3, 3) with one axis normal to one of the two largest flat faces, and the others turned about it."""
    points, noise = evidence.points, evidence.point_noise
    turns = []
    for _ in range(2):
        normal, on = _flat(points, noise)
        side = np.linalg.svd(normal[None])[2][1:]
        for angle in np.radians(np.arange(0.0, 90.0, 6.0)):
            level = np.cos(angle) * side[0] + np.sin(angle) * side[1]
            turns.append(np.column_stack([level, np.cross(normal, level), normal]))
        points, noise = points[~on], noise[~on]
        if len(points) < 0.15 * len(evidence.points):
            break
    return turns


def _flat(points: Array, noise: Array) -> tuple[Array, Mask]:
    """Normal (3,) of the plane through most points, by RANSAC and least squares, and which points lie on it."""
    rng = np.random.default_rng(SEED)
    corners = points[rng.integers(0, len(points), (200, 3))]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    offsets = np.einsum("ij,ij->i", normals, corners[:, 0])
    band = 1.5 * noise + 0.001
    found = np.abs(points @ normals.T - offsets) < band[:, None]
    on = found[:, int(found.sum(axis=0).argmax())]
    normal = normals[0]
    for _ in range(3):
        if on.sum() < 4:
            break
        center = points[on].mean(axis=0)
        normal = np.linalg.svd(points[on] - center, full_matrices=False)[2][2]
        on = np.abs((points - center) @ normal) < band
    return normal, on


def _extent(points: Array, turn: Array) -> tuple[Array, Array]:
    """Centre and size of points in the axes of a rotation."""
    low, high = np.percentile(points @ turn, [1.5, 98.5], axis=0)
    return turn @ (0.5 * (low + high)), np.maximum(high - low, SMALLEST)


def _upright_boxes(points: Array, rest: float = 1.5) -> Array:
    """Nine numbers of the upright box around points, but for `rest` percent, for each of many yaws, (Y, 9)."""
    yaws = np.radians(np.arange(0.0, 90.0, 5.0))
    c, s = np.cos(yaws), np.sin(yaws)
    u = points[:, :1] * c + points[:, 1:2] * s
    v = points[:, 1:2] * c - points[:, :1] * s
    low, high = np.percentile([u, v], [rest, 100.0 - rest], axis=1)
    middle, size = 0.5 * (low + high), np.maximum(high - low, SMALLEST)
    top = max(float(np.percentile(points[:, 2], 100.0 - 2.0 * rest)), SMALLEST)
    starts = np.zeros((len(yaws), 9))
    starts[:, 0], starts[:, 1] = c * middle[0] - s * middle[1], s * middle[0] + c * middle[1]
    starts[:, 2], starts[:, 5], starts[:, 8] = 0.5 * top, yaws, top
    starts[:, 6:8] = size.T
    return starts


def _basis(*columns: dict[int, float]) -> Array:
    basis = np.zeros((9, len(columns)))
    for j, column in enumerate(columns):
        for i, value in column.items():
            basis[i, j] = value
    return basis


_TOP = {2: 0.5, 8: 1.0}
_UPRIGHT_BOX = _basis({0: 1.0}, {1: 1.0}, {5: 1.0}, {6: 1.0}, {7: 1.0}, _TOP)
_UPRIGHT_CYLINDER = _basis({0: 1.0}, {1: 1.0}, {6: 1.0, 7: 1.0}, _TOP)
_RESTING_BALL = _basis({0: 1.0}, {1: 1.0}, {2: 0.5, 6: 1.0, 7: 1.0, 8: 1.0})
_FREE_BALL = _basis({0: 1.0}, {1: 1.0}, {2: 1.0}, {6: 1.0, 7: 1.0, 8: 1.0})
_FREE_CYLINDER = _basis({0: 1.0}, {1: 1.0}, {2: 1.0}, {3: 1.0}, {4: 1.0}, {6: 1.0, 7: 1.0}, {8: 1.0})


def _best(models: Sequence[_Model], evidence: Evidence, *, supported: bool, rough: bool = False) -> Solid:
    """The solid of several families that fits best.

    All are tried on a part of the evidence, the hopeless ones for a few steps only; then on all of it the best, the
    best of another kind, and while none explains the pixels, the next two.
    """
    part = evidence.thinned(THIN)

    def improved(i: int, start: Array, seen: Evidence, rounds: int = ROUNDS) -> tuple[Array, float]:
        model = replace(models[i], start=start)
        return _improved(model, seen, resting=supported and not model.grounded, rounds=rounds)

    heats = [improved(i, model.start, part, HEAT) for i, model in enumerate(models)]
    limit = max(HOPELESS * min(loss for _, loss in heats), POOR)
    raced = {i: improved(i, start, part) for i, (start, loss) in enumerate(heats) if loss <= limit}
    order = sorted(raced, key=lambda i: raced[i][1])
    rivals = [i for i in order if models[i].kind != models[order[0]].kind][:1]
    solids: list[Solid] = []
    for i in dict.fromkeys([order[0], *rivals, *order[1:4]]):
        state = raced[i][0] if rough else improved(i, raced[i][0], evidence)[0]
        solids.append(_solid(models[i], state, evidence))
        if len(solids) > len(rivals) and min(one.loss for one in solids) <= POOR:
            break
    return min(solids, key=lambda one: one.loss)


def _improved(model: _Model, evidence: Evidence, *, resting: bool, rounds: int) -> tuple[Array, float]:
    """The numbers (9,) of a family's member that fits best, and its loss with priors.

    Damped Gauss-Newton steps with weights of the Cauchy loss; each step is tried together with the neighbours that
    give the slopes of the next one.
    """
    count, scale = model.basis.shape[1], np.maximum(model.start[6:], SMALLEST)
    steps = np.where(np.abs(model.basis[3:6]).max(axis=0) > 0, 1e-3, 1e-4)
    around = np.vstack([np.zeros(count), np.eye(count) * steps]) @ model.basis.T
    state, loss, damping = model.start, np.inf, 1e-2
    move = np.zeros(9)
    for _ in range(rounds):
        ahead = state + move
        ahead[6:] = np.maximum(ahead[6:], SMALLEST)
        batch = _residuals(
            model.kind, ahead + around, model.turn, evidence, scale, grounded=model.grounded, resting=resting
        )
        now = _loss(batch[0])
        if now < loss:
            gained = loss - now
            state, loss, damping = ahead, now, max(0.2 * damping, 1e-6)
            r, slopes = batch[0], (batch[1:] - batch[0]) / steps[:, None]
            weighted = slopes / (1.0 + (r / CAUCHY) ** 2)
            hessian, gradient = weighted @ slopes.T, weighted @ r
            if gained < 1e-3 * loss:
                break
        else:
            damping *= 10.0
            if damping > 1e4:
                break
        damped = hessian + damping * np.diag(np.diag(hessian) + 1e-9)
        move = model.basis @ np.linalg.solve(damped, -gradient)
    return state, loss


def _solid(model: _Model, state: Array, evidence: Evidence) -> Solid:
    """A member of a family with how well it fits."""
    r = _residuals(model.kind, state[None], model.turn, evidence, np.ones(3), grounded=model.grounded, resting=False)[
        0, : len(evidence.points) + len(evidence.rays)
    ]
    off = np.abs(r[: len(evidence.points)] * np.hypot(evidence.point_noise, 5e-4))
    turn = model.turn @ Rotation.from_rotvec(state[3:6]).as_matrix()
    loss = _loss(r) + 0.5 * model.basis.shape[1] * float(np.log(len(r))) / len(r)
    return Solid(model.kind, state[:3], turn, state[6:], loss, float(np.median(off)), model.tilted)


def _loss(residuals: Array) -> float:
    return float(0.5 * CAUCHY**2 * np.log1p((residuals / CAUCHY) ** 2).mean())


def _losses(kind: Kind, numbers: Array, turn: Array, evidence: Evidence, *, grounded: bool) -> Array:
    found = _residuals(kind, numbers, turn, evidence, np.ones(3), grounded=grounded, resting=False)
    return np.array([_loss(one) for one in found])


def _residuals(
    kind: Kind, numbers: Array, turn: Array, evidence: Evidence, scale: Array, *, grounded: bool, resting: bool
) -> Array:
    """Residuals of many solids at once (P, N + E + priors), in standard deviations.

    Args:
        kind: Of the solids.
        numbers: (P, 9), see `_Model`.
        turn: Rotation that the rotation vectors start from (3, 3).
        evidence: Points and touching lines.
        scale: Size that the prior on sizes is relative to (3,) [m]: what is hidden is taken to be small.
        grounded: Whether the solids have no underside.
        resting: Whether the lowest point of each is to be near z = 0.
    """
    turns = turn @ Rotation.from_rotvec(numbers[:, 3:6]).as_matrix()
    half = 0.5 * numbers[:, None, 6:]
    local = (evidence.points - numbers[:, None, :3]) @ turns
    near = _signed(kind, local, half, grounded) / np.hypot(evidence.point_noise, 5e-4)
    eyes, rays = (evidence.eyes - numbers[:, None, :3]) @ turns, evidence.rays @ turns
    at = _deepest(kind, eyes, rays, half, grounded)
    touch = _signed(kind, eyes + at[..., None] * rays, half, grounded) / evidence.ray_noise
    priors = [0.3 * numbers[:, 6:] / scale]
    if resting:
        lowest = numbers[:, 2] - (np.abs(turns[:, 2]) * half[:, 0]).sum(axis=1)
        if kind != "box":
            level = np.sqrt(np.maximum(1.0 - turns[:, 2, 2] ** 2, 0.0))
            lowest = numbers[:, 2] - half[:, 0, 0] * level - half[:, 0, 2] * np.abs(turns[:, 2, 2])
        if kind == "sphere":
            lowest = numbers[:, 2] - half[:, 0, 0]
        priors.append((10.0 * np.where(lowest < 0, lowest / 0.002, lowest / 0.02))[:, None])
    return np.concatenate([near, touch, *priors], axis=1)


def _signed(kind: Kind, local: Array, half: Array, grounded: bool) -> Array:
    """Signed distance of points (P, N, 3) in the solids' own axes to their surfaces, (P, N), negative inside."""
    if kind == "sphere":
        return np.asarray(np.sqrt((local**2).sum(axis=2)) - half[..., 0])
    up = local[..., 2] if grounded else np.abs(local[..., 2])
    beyond_z = up - half[..., 2]
    if kind == "cylinder":
        beyond = [np.sqrt(local[..., 0] ** 2 + local[..., 1] ** 2) - half[..., 0], beyond_z]
    else:
        beyond = [np.abs(local[..., 0]) - half[..., 0], np.abs(local[..., 1]) - half[..., 1], beyond_z]
    inner = beyond[0]
    outer = np.maximum(beyond[0], 0.0) ** 2
    for each in beyond[1:]:
        inner = np.maximum(inner, each)
        outer = outer + np.maximum(each, 0.0) ** 2
    return np.asarray(np.sqrt(outer) + np.minimum(inner, 0.0))


def _deepest(kind: Kind, eyes: Array, rays: Array, half: Array, grounded: bool) -> Array:
    """Where lines are deepest inside the solids, or pass them nearest, as distances along them (P, E).

    Midway between the last entry into and the first exit out of the slabs (for a cylinder: the tube and the slab) that
    the solid is the intersection of; exact where the line just touches, which is where it counts.
    """
    nearest = -(eyes * rays).sum(axis=2)
    if kind == "sphere":
        return np.asarray(nearest)
    reach = 2.0 * np.linalg.norm(half, axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (-half - eyes) / rays, (half - eyes) / rays
    enter, leave = np.minimum(one, two), np.maximum(one, two)
    if grounded:
        down = rays[..., 2] < 0
        enter[..., 2] = np.where(down, two[..., 2], -np.inf)
        leave[..., 2] = np.where(down, np.inf, two[..., 2])
    if kind == "cylinder":
        aa = np.maximum(rays[..., 0] ** 2 + rays[..., 1] ** 2, 1e-12)
        ab = eyes[..., 0] * rays[..., 0] + eyes[..., 1] * rays[..., 1]
        under = ab**2 - aa * (eyes[..., 0] ** 2 + eyes[..., 1] ** 2 - half[..., 0] ** 2)
        root = np.sqrt(np.maximum(under, 0.0))
        into, out = np.maximum((-ab - root) / aa, enter[..., 2]), np.minimum((-ab + root) / aa, leave[..., 2])
    else:
        into, out = enter.max(axis=2), leave.min(axis=2)
    low, high = nearest - reach, nearest + reach
    return np.asarray(0.5 * (np.clip(into, low, high) + np.clip(out, low, high)))


def _plainest(kind: Kind, rotation: Array, size: Array) -> tuple[Array, Array]:
    """The same solid with its axes named so that its rotation is as small as can be."""
    if kind == "sphere":
        return np.eye(3), size
    if kind == "cylinder":
        axis = rotation[:, 2] * (1.0 if rotation[2, 2] >= 0 else -1.0)
        turn = np.cross((0.0, 0.0, 1.0), axis)
        sine, cosine = float(np.linalg.norm(turn)), float(axis[2])
        if sine < 1e-9:
            return np.eye(3), size
        return Rotation.from_rotvec(turn / sine * np.arctan2(sine, cosine)).as_matrix(), size
    best = max(_QUARTERS, key=lambda quarter: float(np.trace(rotation @ quarter)))
    return rotation @ best, np.abs(best.T) @ size


_QUARTERS = tuple(np.round(Rotation.create_group("O").as_matrix()))
