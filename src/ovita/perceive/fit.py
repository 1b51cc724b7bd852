"""Fits: the box, cylinder or ball that explains the pixels of one thing best.

Every candidate is judged by one measure: how far the measured points are from its surface, and how far the lines of
sight along the outline are from touching it, each in units of its own noise, with a Cauchy loss. Nothing else is
needed for one view or several, for hidden sides, or to choose between the shapes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from ovita.paths.trajectory import Array
from ovita.perceive.evidence import Evidence
from ovita.perceive.segment import SEED
from ovita.perceive.solids import CAUCHY, Kind, Solid, losses, misfits, undersides
from ovita.perceive.view import Mask

ROUNDS = 20
"""Steps of a fit at most."""

HEAT = 3
"""Steps after which a family whose loss is `HOPELESS` times the best is given up."""

HOPELESS = 3.0
"""See `HEAT`."""

RIVALLING = 1.5
"""Loss on a part of the evidence, in times the best one's, up to which another kind is tried on all of it."""

THIN = 90
"""Points, and lines of sight, on which the families of shapes are compared first."""

POOR = 0.45
"""Mean loss above which a shape that stands upright does not explain the pixels; Gaussian noise gives 0.4."""

BETTER = 0.8
"""A tilted shape must have at most this share of the loss of the upright ones."""

LEANING = np.cos(np.radians(5.0))
"""Cosine of the angle from which a thing leans."""

SHEET, BOARD = 0.02, 0.12
"""Thinness, thickness over length, below which no leaning solid is believed, and below which one has to fit well."""

ON_EDGE = 0.06
"""Thickness over width of a disc below which it is hardly ever found to stand on its edge."""

IRREGULAR = 1.0
"""Mean loss from which no shape explains the pixels."""

SMALLEST = 0.004
"""Least edge of a solid [m]."""


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
    resting: bool = False
    """Whether its lowest point is likely to be on the support."""

    @property
    def on_edge(self) -> bool:
        """Whether it starts as a disc that stands on its edge, as what is seen of a thin upright thing looks like."""
        return self.kind == "cylinder" and not self.grounded and bool(self.start[8] < ON_EDGE * self.start[6])

    @cached_property
    def steps(self) -> Array:
        """By how much each direction is varied for its slope (K,) [m or rad]."""
        return np.where(np.abs(self.basis[3:6]).max(axis=0) > 0, 1e-3, 1e-4)

    @cached_property
    def around(self) -> Array:
        """No change, and one step in each direction, (1 + K, 9)."""
        return np.vstack([np.zeros(len(self.steps)), np.diag(self.steps)]) @ self.basis.T


def fit(evidence: Evidence, *, supported: bool, hints: Sequence[Solid] = (), rough: bool = False) -> Solid:
    """The solid that explains the evidence best; where none does, the upright box around the points.

    Args:
        evidence: In axes whose z points up, zero on the support where there is one.
        supported: Whether there is a support, z = 0.
        hints: Solids that explain parts of the evidence.
        rough: Whether the part of the evidence on which families are compared is enough, as for a first guess.
    """
    quick = _as_hinted(evidence, hints, rough=rough) if supported else None
    if quick is not None:
        return quick
    standing = _best(_standing(evidence), evidence, supported=True, rough=rough) if supported else None
    if standing is not None and standing.loss <= POOR:
        return standing
    floating = _best([*_floating(evidence), *_resumed(hints)], evidence, supported=supported, rough=rough)
    if standing is None:
        best = floating
    else:
        best = floating if not _flimsy(floating) and floating.loss < _share(floating) * standing.loss else standing
    return best if best.loss <= IRREGULAR else _enclosing(evidence, best.loss, supported=supported)


def _as_hinted(evidence: Evidence, hints: Sequence[Solid], *, rough: bool) -> Solid | None:
    """The standing solid of the kind that all hints have, where that explains the evidence."""
    agreed = {one.kind for one in hints if one.regular and not one.tilted}
    if len(agreed) != 1 or len(hints) < 2:
        return None
    likely = [model for model in _standing(evidence) if model.kind in agreed]
    quick = _best(likely, evidence, supported=True, rough=rough)
    return quick if quick.loss <= POOR else None


def _flimsy(one: Solid) -> bool:
    """Whether a leaning solid is a sheet: the side that was seen of a thing that it does not explain."""
    thin = float(one.size.min() / one.size.max())
    return thin < SHEET or (thin < BOARD and one.loss > POOR)


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
    order = losses(misfits("box", boxes, np.eye(3), evidence, grounded=True)).argsort()
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
    turns = _attitudes(evidence)
    starts = np.zeros((len(turns), 9))
    for start, turn in zip(starts, turns, strict=True):
        start[:3], start[6:] = _extent(evidence.points, turn)
        start[3:6] = Rotation.from_matrix(turn).as_rotvec()
    order = losses(misfits("box", starts, np.eye(3), evidence, grounded=False)).argsort()
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
    best of another kind unless it is far worse, and while none explains the pixels, the next two.
    """
    ready = [replace(one, resting=supported and not one.grounded) for one in models]
    (first, least), *rest = _raced(ready, evidence.thinned(THIN))
    rivals = [one for one, loss in rest if one.kind != first.kind and loss < RIVALLING * least][:1]
    others = [one for one, _ in rest[:3] if one not in rivals]
    solids: list[Solid] = []
    for model in (first, *rivals, *others):
        solids.append(_solid(model if rough else _improved(model, evidence, ROUNDS)[0], evidence))
        if len(solids) > len(rivals) and min(one.loss for one in solids) <= POOR:
            break
    return min(solids, key=lambda one: one.loss)


def _raced(models: Sequence[_Model], part: Evidence) -> list[tuple[_Model, float]]:
    """The families that are not hopeless where they fit best, with their losses, the best first."""
    heats = [_improved(one, part, HEAT) for one in models]
    limit = max(HOPELESS * min(loss for _, loss in heats), POOR)
    runs = [_improved(one, part, ROUNDS) for one, loss in heats if loss <= limit]
    return sorted([run for run in runs if not run[0].on_edge] or runs, key=lambda run: run[1])


def _improved(model: _Model, evidence: Evidence, rounds: int) -> tuple[_Model, float]:
    """A family at its member that fits best, and the loss of that with priors.

    Damped Gauss-Newton steps with weights of the Cauchy loss; each step is tried together with the neighbours that
    give the slopes of the next one.
    """
    state, loss, damping = model.start, np.inf, 1e-2
    move = np.zeros(9)
    for _ in range(rounds):
        ahead = state + move
        ahead[6:] = np.maximum(ahead[6:], SMALLEST)
        batch = _residuals(model, ahead + model.around, evidence)
        now = float(losses(batch[0]))
        if now >= loss:
            damping *= 10.0
        else:
            gained = loss - now
            state, loss, damping = ahead, now, max(0.2 * damping, 1e-6)
            hessian, gradient = _slopes(batch, model.steps)
            if gained < 1e-3 * loss:
                break
        if damping > 1e4:
            break
        damped = hessian.copy()
        damped.flat[:: len(damped) + 1] *= 1.0 + damping
        move = model.basis @ np.linalg.solve(damped, -gradient)
    return replace(model, start=state), loss


def _slopes(batch: Array, steps: Array) -> tuple[Array, Array]:
    """Of the loss, from residuals of one member of a family and its neighbours (1 + K, R): (K, K) and (K,)."""
    r, slopes = batch[0], (batch[1:] - batch[0]) / steps[:, None]
    weighted = slopes / (1.0 + (r * (1.0 / CAUCHY)) ** 2)
    hessian = weighted @ slopes.T
    hessian.flat[:: len(hessian) + 1] += 1e-12
    return hessian, weighted @ r


def _solid(model: _Model, evidence: Evidence) -> Solid:
    """The member of a family that it starts with, and how well it fits."""
    state = model.start
    r = misfits(model.kind, state[None], model.turn, evidence, grounded=model.grounded)[0]
    off = np.abs(r[: len(evidence.points)] / evidence.point_weights)
    turn = model.turn @ Rotation.from_rotvec(state[3:6]).as_matrix()
    loss = float(losses(r)) + 0.5 * len(model.steps) * float(np.log(len(r))) / len(r)
    return Solid(model.kind, state[:3], turn, state[6:], loss, float(np.median(off)), model.tilted)


def _residuals(model: _Model, numbers: Array, evidence: Evidence) -> Array:
    """Misfits of members of a family, with priors (P, R): what is hidden is taken to be small, and to rest at z = 0."""
    found = [misfits(model.kind, numbers, model.turn, evidence, grounded=model.grounded)]
    found.append(0.3 * numbers[:, 6:] / np.maximum(model.start[6:], SMALLEST))
    if model.resting:
        lowest = undersides(model.kind, numbers, model.turn)[:, None]
        found.append(10.0 * np.where(lowest < 0, lowest / 0.002, lowest / 0.02))
    return np.concatenate(found, axis=1)
