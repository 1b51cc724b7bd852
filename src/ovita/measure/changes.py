"""What changed from one trajectory to another, measured in a scene: plain immutable data.

Waypoints count from 0, both ends included, and are those of the adapted trajectory unless said otherwise.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ovita.paths.correspondence import Correspondence, Method, correspond
from ovita.paths.geometry import (
    Mask,
    closest_to_point,
    extent,
    fractions,
    lengths,
    path_distances,
    runs,
    spacing,
    turning_angles,
    within,
)
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, nlerp
from ovita.text import called_as

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Span:
    """One quantity before and after."""

    before: float
    after: float

    @property
    def change(self) -> float:
        """After minus before."""
        return self.after - self.before

    @classmethod
    def of(cls, measure: Callable[[Array], float], before: Array, after: Array) -> Span:
        """What a function measures on both."""
        return cls(float(measure(before)), float(measure(after)))


@dataclass(frozen=True)
class Displacement:
    """Displacement of the corresponding waypoints.

    Args:
        max: Largest displacement [m], at waypoint `index` and share `fraction` (0..1) of the path length.
        mean: Mean length of the displacements [m].
        vector: Mean displacement (world frame) [m]; `words` splits it into direction words with metres > 0.
        max_words: Direction words of the largest displacement [m].
        spread: Largest deviation of a displacement from `vector` [m]; 0 for a pure translation.
        count: Number of displaced waypoints, the first and last of which are `first` and `last` (None without any).
    """

    max: float
    mean: float
    index: int
    fraction: float
    vector: Vector
    words: dict[str, float]
    max_words: dict[str, float]
    spread: float
    count: int
    first: int | None
    last: int | None


@dataclass(frozen=True)
class Insertion:
    """Inserted waypoints `first` to `last`, up to `off` [m] from the original path."""

    first: int
    last: int
    off: float


@dataclass(frozen=True)
class Kink:
    """A turn at `waypoint` by `degrees` that the original does not have there; it turned by `before` at most [deg]."""

    waypoint: int
    degrees: float
    before: float


@dataclass(frozen=True)
class Jump:
    """A step of `step` [m] from `waypoint` to the next, far above the original's longest step `before` [m]."""

    waypoint: int
    step: float
    before: float


@dataclass(frozen=True)
class ShapeChange:
    """How sharply the path turns and how evenly it is sampled.

    Args:
        sharpest: Sharpest turn at a waypoint [deg], at waypoint `sharpest_at` of either trajectory.
        reversals: Number of turns by more than 150 degrees.
        step: Longest step between neighbouring waypoints [m].
        kinks: Turns by 60 degrees or more that the adaptation brought to waypoints that were there before, also where
            something put in leaves them and comes back.
        jumps: Steps more than four times the original's longest, allowing for another number of waypoints.
    """

    sharpest: Span
    sharpest_at: Span
    reversals: Span
    step: Span
    kinks: tuple[Kink, ...] = ()
    jumps: tuple[Jump, ...] = ()


@dataclass(frozen=True)
class Endpoint:
    """Start or goal: positions before and after [m], the distance between them [m] and its direction words."""

    before: Vector
    after: Vector
    shift: float
    words: dict[str, float]


@dataclass(frozen=True)
class SpeedRange:
    """Neighbouring waypoints `first` to `last` that all became slower, or all faster.

    Args:
        speed: Their mean speed [m/s].
        near: Names of the objects, two at most, that the path passes here.
    """

    first: int
    last: int
    speed: Span
    near: tuple[str, ...]


@dataclass(frozen=True)
class Stop:
    """A stop of the adapted trajectory.

    Args:
        first, last: Waypoints at speed 0.
        seconds: How long it waits [s].
        near: The object that is nearest, if one is near.
        words: How a stop of the original moved, as direction words [m]; empty where it did not, or is new.
    """

    first: int
    last: int
    seconds: float
    near: tuple[str, ...]
    words: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class SpeedChange:
    """Speeds over the waypoints, dwells left out.

    Args:
        mean, min, max: [m/s].
        ratio_min, ratio_max: Of the speed after to that before, over waypoints that moved before; None without any.
        count: Number of waypoints whose speed changed; `everywhere` if these are all that moved before.
        first, last: Of the waypoints whose speed changed, or None.
        ranges: The changed waypoints as runs of one direction; one run over all if there are very many.
        stops: Number of stops on the way, and at the ends if the robot waits there.
        stopped: The stops of the adapted trajectory.
        dwell_steps: Number of dwell waypoints (repeated at speed 0); each lasts one timestep.
        dwell: Time spent in dwells [s].
    """

    mean: Span
    min: Span
    max: Span
    ratio_min: float | None
    ratio_max: float | None
    count: int
    everywhere: bool
    first: int | None
    last: int | None
    ranges: tuple[SpeedRange, ...]
    stops: Span
    stopped: tuple[Stop, ...]
    dwell_steps: Span
    dwell: Span


@dataclass(frozen=True)
class ObjectChange:
    """How the path passes one object, measured along the segments too.

    Args:
        name: As in the scene.
        distance: Closest approach to the centre [m], at fractional waypoint `distance_at` of either trajectory.
        clearance: Closest approach to the cuboid's surface [m], negative inside, at `clearance_at`.
        neighbourhood: Distance from the centre that counts as near [m].
        speed_before, speed_after: Mean speed of the waypoints in the neighbourhood [m/s]; None without any.
        sized: Whether the scene says how large the object is.
    """

    name: str
    distance: Span
    distance_at: Span
    clearance: Span
    clearance_at: Span
    neighbourhood: float
    speed_before: float | None
    speed_after: float | None
    sized: bool = True


@dataclass(frozen=True)
class Changes:
    """The measured difference of two trajectories in a scene.

    Args:
        matching: How waypoints were paired, as in `paths.correspondence`.
        removed: Runs (first, last) of original waypoints that were taken out.
        added: Runs of waypoints that were put in.
        path_unchanged: Whether the positions are the same bit by bit.
        speeds_unchanged: Whether the speeds are.
        orientations_unchanged: Whether the orientations are.
        waypoints: Their number.
        length: Of the path [m].
        duration: Time from start to goal [s].
        objects: How each object is passed, in the scene's order.
        stalled: Whether the adapted path goes on at speed 0 from some waypoint, so that its duration is none.
    """

    matching: Method
    removed: tuple[tuple[int, int], ...]
    added: tuple[Insertion, ...]
    path_unchanged: bool
    speeds_unchanged: bool
    orientations_unchanged: bool
    waypoints: Span
    length: Span
    duration: Span
    displacement: Displacement
    shape: ShapeChange
    start: Endpoint
    goal: Endpoint
    speed: SpeedChange
    objects: tuple[ObjectChange, ...]
    stalled: bool = False

    @property
    def nothing_changed(self) -> bool:
        """Whether the adapted trajectory is the original, bit by bit."""
        return self.path_unchanged and self.speeds_unchanged and self.orientations_unchanged


TOLERANCE = 1e-6
"""Differences up to this count as none [m, m/s]."""

NEIGHBOURHOOD = 0.25
"""What counts as near an object: its bounding radius plus this share of the original path's diagonal."""

KINK, SHARPER = 60.0, 30.0
"""A turn is a kink from this on, if the original turns there by so much less [deg]."""

REVERSAL = 150.0
"""A turn by more than this is a reversal [deg]."""

JUMP = 4.0
"""A step that is so many times the original's longest is a jump."""

_MANY_RANGES = 12


@called_as("compare(before, after, scene)")
def compare(original: Trajectory, adapted: Trajectory, scene: Scene) -> Changes:
    """Measure what changed from one trajectory to another; the scene gives the direction words and the objects."""
    found = correspond(original.positions, adapted.positions)
    before = found.of_adapted(original.to_array())
    compared = found.old if found.method == "index" else found.old & ~adapted.dwells
    objects = tuple(_object_change(item, original, adapted) for item in scene)
    off = path_distances(original.positions, adapted.positions) if found.added else np.zeros(0)
    return Changes(
        matching=found.method,
        removed=found.removed,
        added=tuple(Insertion(a, b, float(off[a : b + 1].max())) for a, b in found.added),
        path_unchanged=np.array_equal(original.positions, adapted.positions),
        speeds_unchanged=np.array_equal(original.speeds, adapted.speeds),
        orientations_unchanged=_same_turns(original, adapted),
        waypoints=Span(len(original), len(adapted)),
        length=Span(original.length, adapted.length),
        duration=Span(original.duration, adapted.duration),
        displacement=_displacement(before[:, :3], adapted, compared, scene.frame),
        shape=_shape(original.positions, adapted.positions, found),
        start=_endpoint(original.positions[0], adapted.positions[0], scene.frame),
        goal=_endpoint(original.positions[-1], adapted.positions[-1], scene.frame),
        speed=_speed_change(original, adapted, before, compared, scene, objects),
        objects=objects,
        stalled=adapted.stall is not None,
    )


def _same_turns(original: Trajectory, adapted: Trajectory) -> bool:
    """Whether the tool turns as before: waypoint by waypoint, or, with another count, along the path."""
    before, after = original.orientations, adapted.orientations
    if before is None or after is None:
        return before is after
    if len(before) == len(after):
        return bool(np.array_equal(before, after))
    spots = np.linspace(0.0, 1.0, max(len(before), len(after)))
    mixed = [nlerp(q, spots * (len(q) - 1)) for q in (before, after)]
    return bool((np.abs((mixed[0] * mixed[1]).sum(axis=1)) > 1.0 - 1e-6).all())


def _displacement(before: Array, adapted: Trajectory, compared: Mask, frame: Frame) -> Displacement:
    index = np.flatnonzero(compared)
    vectors = (adapted.positions - before)[index]
    lengths = np.linalg.norm(vectors, axis=1)
    worst = int(np.argmax(lengths))
    mean = vectors.mean(axis=0)
    moved = index[lengths > TOLERANCE]
    return Displacement(
        max=float(lengths[worst]),
        mean=float(lengths.mean()),
        index=int(index[worst]),
        fraction=float(fractions(adapted.positions)[index[worst]]),
        vector=_vector(mean),
        words=_words(frame, mean),
        max_words=_words(frame, vectors[worst]),
        spread=float(np.linalg.norm(vectors - mean, axis=1).max()),
        count=len(moved),
        first=int(moved[0]) if len(moved) else None,
        last=int(moved[-1]) if len(moved) else None,
    )


def _shape(original: Array, adapted: Array, found: Correspondence) -> ShapeChange:
    """Turns and steps of both paths, and the kinks and jumps that only the adapted one has."""
    turns = [np.degrees(turning_angles(path, 0.02 * spacing(path))) for path in (original, adapted)]
    steps = [lengths(np.diff(path, axis=0)) for path in (original, adapted)]
    longest = float(steps[0].max()) * max(1.0, len(original) / len(adapted))
    kinks = []
    for i in map(int, np.flatnonzero(turns[1] >= KINK)):
        origin = found.backward[i]
        if not found.old[i] or not _inner(found, i):  # the shape of what was put in was asked for
            continue
        usual = float(turns[0][max(int(origin) - 2, 0) : int(origin) + 4].max())
        if turns[1][i] >= usual + SHARPER:
            kinks.append(Kink(i, float(turns[1][i]), usual))
    jumps = [Jump(int(i), float(steps[1][i]), longest) for i in np.flatnonzero(steps[1] > JUMP * longest + TOLERANCE)]
    return ShapeChange(
        sharpest=Span.of(np.max, *turns),
        sharpest_at=Span(*(int(angles.argmax()) for angles in turns)),
        reversals=Span(*(int((angles > REVERSAL).sum()) for angles in turns)),
        step=Span.of(np.max, *steps),
        kinks=tuple(kinks),
        jumps=tuple(jumps),
    )


def _inner(found: Correspondence, i: int) -> bool:
    """Whether what was put in beside waypoint i, if anything, joins the path again, as nothing beyond an end does."""
    beyond = [put for put in found.added if put[0] == 0 or put[1] == len(found.old) - 1]
    return not any(a - 1 <= i <= b + 1 for a, b in beyond)


def _object_change(item: SceneObject, original: Trajectory, adapted: Trajectory) -> ObjectChange:
    """How both paths pass one object, along their segments."""
    neighbourhood = item.radius + NEIGHBOURHOOD * extent(original.positions)
    (d0, i0), (d1, i1) = (closest_to_point(t.positions, item.position) for t in (original, adapted))
    (c0, j0), (c1, j1) = (item.body(original.positions).closest(t.positions) for t in (original, adapted))
    before, after = (_speed_near(t, item, neighbourhood) for t in (original, adapted))
    passes = Span(d0, d1), Span(i0, i1), Span(c0, c1), Span(j0, j1)
    return ObjectChange(item.name, *passes, neighbourhood, before, after, item.dimensions is not None)


def _speed_near(trajectory: Trajectory, item: SceneObject, radius: float) -> float | None:
    near = within(trajectory.positions, item.position, radius) & ~trajectory.dwells
    return float(trajectory.speeds[near].mean()) if near.any() else None


def _endpoint(before: Array, after: Array, frame: Frame) -> Endpoint:
    shift = after - before
    return Endpoint(_vector(before), _vector(after), float(np.linalg.norm(shift)), _words(frame, shift))


def _speed_change(
    original: Trajectory,
    adapted: Trajectory,
    before: Array,
    compared: Mask,
    scene: Scene,
    objects: tuple[ObjectChange, ...],
) -> SpeedChange:
    index = np.flatnonzero(compared)
    old, new = before[index, 3], adapted.speeds[index]
    sign = np.where(np.abs(new - old) > TOLERANCE, np.sign(new - old), 0).astype(int)
    changed, moving = sign != 0, old > TOLERANCE
    ratios, where = new[moving] / old[moving], index[changed]
    own = original.speeds[~original.dwells] if len(original) != len(adapted) else original.speeds
    steps = Span(int(original.dwells.sum()), int(adapted.dwells.sum()))
    radii = {item.name: item.neighbourhood for item in objects}
    stopped = tuple(_from(stop, before, adapted, scene.frame) for stop in _stops(adapted, scene, radii))
    return SpeedChange(
        mean=Span.of(np.mean, own, new),
        min=Span.of(np.min, own, new),
        max=Span.of(np.max, own, new),
        ratio_min=float(ratios.min()) if len(ratios) else None,
        ratio_max=float(ratios.max()) if len(ratios) else None,
        count=len(where),
        everywhere=bool(changed.any() and changed[moving].all()),
        first=int(where[0]) if len(where) else None,
        last=int(where[-1]) if len(where) else None,
        ranges=tuple(_speed_range(index[part], old[part], new[part], objects) for part in _one_way(sign)),
        stops=Span(len(_stops(original, scene, radii)), len(stopped)),
        stopped=stopped,
        dwell_steps=steps,
        dwell=Span(steps.before * original.timestep, steps.after * adapted.timestep),
    )


def _one_way(sign: NDArray[np.int_]) -> list[NDArray[np.intp]]:
    """Unbroken stretches of one sign other than 0; one over all if there are very many."""
    stretches = np.split(np.arange(len(sign)), np.flatnonzero(np.diff(sign)) + 1)
    parts = [part for part in stretches if sign[part[0]]]
    return parts if len(parts) <= _MANY_RANGES else [np.arange(parts[0][0], parts[-1][-1] + 1)]


def _speed_range(index: NDArray[np.intp], old: Array, new: Array, objects: tuple[ObjectChange, ...]) -> SpeedRange:
    first, last = int(index[0]), int(index[-1])
    return SpeedRange(first, last, Span.of(np.mean, old, new), _near(first, last, objects))


def _near(first: int, last: int, objects: tuple[ObjectChange, ...]) -> tuple[str, ...]:
    """The objects, two at most, that these waypoints pass within their neighbourhood, nearest the middle first."""
    middle, half = (first + last) / 2, max(1.0, (last - first) / 2)
    scores = {
        o.name: abs(o.distance_at.after - middle) / half + o.distance.after / o.neighbourhood
        for o in objects
        if first - 0.5 <= o.distance_at.after <= last + 0.5 and o.distance.after <= o.neighbourhood
    }
    ranked = sorted(scores, key=scores.__getitem__)[:2]
    return tuple(name for name in ranked if scores[name] <= scores[ranked[0]] + 0.35)


def _stops(trajectory: Trajectory, scene: Scene, radii: Mapping[str, float]) -> tuple[Stop, ...]:
    """Runs of waypoints at speed 0 that lie on the way or hold a dwell."""
    stops = []
    for a, b in runs(trajectory.speeds == 0):
        waits = int(trajectory.dwells[a : b + 1].sum())
        if waits or 0 < a <= b < len(trajectory) - 1:
            place = trajectory.positions[a : b + 1]
            away = {o.name: float(o.distance(place).min()) for o in scene}
            gaps = {o.name: float(o.cuboid.signed(place)[0].min()) for o in scene}
            near = sorted((name for name in away if away[name] <= radii[name]), key=gaps.__getitem__)
            stops.append(Stop(a, b, waits * trajectory.timestep, tuple(near[:1])))
    return tuple(stops)


def _from(stop: Stop, before: Array, adapted: Trajectory, frame: Frame) -> Stop:
    """A stop with how it moved from where the original (N, 4), waypoint by waypoint, stands too."""
    was = before[stop.first]
    return replace(stop, words=_words(frame, adapted.positions[stop.first] - was[:3])) if was[3] == 0.0 else stop


def _vector(values: Array) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _words(frame: Frame, vector: Array) -> dict[str, float]:
    return {word: amount for word, amount in frame.words(vector).items() if amount > TOLERANCE}
