"""Measure the difference of two trajectories in a scene."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ovita.measure.report import (
    Changes,
    Displacement,
    Endpoint,
    Insertion,
    Jump,
    Kink,
    ObjectChange,
    ShapeChange,
    Span,
    SpeedChange,
    SpeedRange,
    Stop,
    Vector,
)
from ovita.paths.correspondence import Correspondence, correspond
from ovita.paths.frame import Frame
from ovita.paths.geometry import (
    Mask,
    closest_to_point,
    extent,
    fractions,
    lengths,
    path_distances,
    spacing,
    turning_angles,
    within,
)
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory, nlerp

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


def compare(original: Trajectory, adapted: Trajectory, scene: Scene) -> Changes:
    """Measure what changed from one trajectory to another.

    Args:
        original: The trajectory before, N waypoints.
        adapted: The trajectory after, M waypoints.
        scene: Gives the direction words and the objects.
    """
    found = correspond(original.positions, adapted.positions)
    before = found.of_adapted(original.to_array())
    compared = found.old if found.method == "index" else found.old & ~adapted.dwells
    objects = tuple(_object_change(item, original, adapted) for item in scene)
    return Changes(
        matching=found.method,
        removed=found.removed,
        added=_insertions(original, adapted, found),
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
        speed=_speed_change(original, adapted, before[:, 3], compared, scene, objects),
        objects=objects,
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


def _insertions(original: Trajectory, adapted: Trajectory, found: Correspondence) -> tuple[Insertion, ...]:
    off = path_distances(original.positions, adapted.positions) if found.added else np.zeros(0)
    return tuple(Insertion(a, b, float(off[a : b + 1].max())) for a, b in found.added)


def _shape(original: Array, adapted: Array, found: Correspondence) -> ShapeChange:
    """Turns and steps of both paths, and the kinks and jumps that only the adapted one has."""
    turns = [np.degrees(turning_angles(path, 0.02 * spacing(path))) for path in (original, adapted)]
    steps = [lengths(np.diff(path, axis=0)) for path in (original, adapted)]
    at = [int(angles.argmax()) for angles in turns]
    longest = float(steps[0].max()) * max(1.0, len(original) / len(adapted))
    kinks = []
    for i in np.flatnonzero(turns[1] >= KINK):
        origin = found.backward[i]
        if not found.old[i - 1 : i + 2].all():  # the shape of what was put in was asked for
            continue
        usual = float(turns[0][max(int(origin) - 2, 0) : int(origin) + 4].max())
        if turns[1][i] >= usual + SHARPER:
            kinks.append(Kink(int(i), float(turns[1][i]), usual))
    jumps = [Jump(int(i), float(steps[1][i]), longest) for i in np.flatnonzero(steps[1] > JUMP * longest + TOLERANCE)]
    return ShapeChange(
        sharpest=Span(float(turns[0].max()), float(turns[1].max())),
        sharpest_at=Span(*at),
        reversals=Span(*(int((angles > REVERSAL).sum()) for angles in turns)),
        step=Span(float(steps[0].max()), float(steps[1].max())),
        kinks=tuple(kinks),
        jumps=tuple(jumps),
    )


def _object_change(item: SceneObject, original: Trajectory, adapted: Trajectory) -> ObjectChange:
    """How both paths pass one object, along their segments."""
    neighbourhood = item.radius + NEIGHBOURHOOD * extent(original.positions)
    (d0, i0), (d1, i1) = (closest_to_point(t.positions, item.position) for t in (original, adapted))
    (c0, j0), (c1, j1) = (item.body(original.positions).closest(t.positions) for t in (original, adapted))
    speeds: list[float | None] = []
    for trajectory in (original, adapted):
        near = within(trajectory.positions, item.position, neighbourhood) & ~trajectory.dwells
        speeds.append(float(trajectory.speeds[near].mean()) if near.any() else None)
    return ObjectChange(item.name, Span(d0, d1), Span(i0, i1), Span(c0, c1), Span(j0, j1), neighbourhood, *speeds)


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
    old, new = before[index], adapted.speeds[index]
    sign = np.where(np.abs(new - old) > TOLERANCE, np.sign(new - old), 0).astype(int)
    changed = sign != 0
    moving = old > TOLERANCE
    ratios = new[moving] / old[moving]
    own = original.speeds[~original.dwells] if len(original) != len(adapted) else original.speeds
    cuts = np.flatnonzero(np.diff(sign)) + 1
    runs = [run for run in np.split(np.arange(len(index)), cuts) if sign[run[0]]]
    if len(runs) > _MANY_RANGES:
        runs = [np.arange(runs[0][0], runs[-1][-1] + 1)]
    steps = Span(int(original.dwells.sum()), int(adapted.dwells.sum()))
    where = index[changed]
    radii = {item.name: item.neighbourhood for item in objects}
    stopped = _stops(adapted, scene, radii)
    return SpeedChange(
        mean=Span(float(own.mean()), float(new.mean())),
        min=Span(float(own.min()), float(new.min())),
        max=Span(float(own.max()), float(new.max())),
        ratio_min=float(ratios.min()) if len(ratios) else None,
        ratio_max=float(ratios.max()) if len(ratios) else None,
        count=len(where),
        everywhere=bool(changed.any() and changed[moving].all()),
        first=int(where[0]) if len(where) else None,
        last=int(where[-1]) if len(where) else None,
        ranges=tuple(_speed_range(index[run], old[run], new[run], objects) for run in runs),
        stops=Span(len(_stops(original, scene, radii)), len(stopped)),
        stopped=stopped,
        dwell_steps=steps,
        dwell=Span(steps.before * original.timestep, steps.after * adapted.timestep),
    )


def _speed_range(index: NDArray[np.intp], old: Array, new: Array, objects: tuple[ObjectChange, ...]) -> SpeedRange:
    first, last = int(index[0]), int(index[-1])
    return SpeedRange(first, last, Span(float(old.mean()), float(new.mean())), _near(first, last, objects))


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
    still = trajectory.speeds == 0
    runs = np.split(np.arange(len(still)), np.flatnonzero(np.diff(still)) + 1)
    waits, last = trajectory.dwells, len(still) - 1
    stops = []
    for run in runs:
        if still[run[0]] and (waits[run].any() or (run[0] > 0 and run[-1] < last)):
            away = {o.name: float(o.distance(trajectory.positions[run]).min()) for o in scene}
            near = sorted((name for name in away if away[name] <= radii[name]), key=away.__getitem__)
            seconds = int(waits[run].sum()) * trajectory.timestep
            stops.append(Stop(int(run[0]), int(run[-1]), seconds, tuple(near[:1])))
    return tuple(stops)


def _vector(values: Array) -> Vector:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _words(frame: Frame, vector: Array) -> dict[str, float]:
    return {word: amount for word, amount in frame.words(vector).items() if amount > TOLERANCE}
