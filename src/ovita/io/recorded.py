"""What robots record: odometry, poses, transforms and joint states, message by message, as one motion.

A recording is all messages of a topic. Its samples are put in order, what cannot be used is left out with a word, and
the rest is smoothed and thinned (`ovita.io.smoothing`), unless the poses are wanted as they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.errors import RequestError, TrajectoryError
from ovita.io.cameras import Transforms, named
from ovita.io.documents import NONE, Choices, brief, listing
from ovita.io.messages import JointMotion, frame_of, stamp_ns
from ovita.io.smoothing import FEWEST, Smoothed, noise_of, smoothed
from ovita.io.waypoints import from_columns, pose_columns
from ovita.paths.geometry import Mask
from ovita.paths.scene import quaternion
from ovita.paths.trajectory import Array, Trajectory

JOINT_STATE = "sensor_msgs/msg/JointState"
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
_PLACES: dict[str, tuple[str, ...]] = {
    "nav_msgs/msg/Odometry": ("pose", "pose"),
    "geometry_msgs/msg/PoseStamped": ("pose",),
    "geometry_msgs/msg/PoseWithCovarianceStamped": ("pose", "pose"),
    "geometry_msgs/msg/TransformStamped": ("transform",),
    "geometry_msgs/msg/PointStamped": ("point",),
}

RECORDED = (*_PLACES, *TRANSFORMS)
"""Messages of which a whole recording is one path."""

_AS_RECORDED = 0.05
_EVEN = 0.3


@dataclass(frozen=True)
class StampedMessage:
    """A message of a recording, and when it was logged or came [ns]."""

    logged: int
    message: Any


@dataclass(frozen=True, eq=False)
class PoseSeries:
    """Poses over time: stamps (N,) [ns], positions (N, 3) [m], quaternions (N, 4) wxyz or None, and their frames.

    The states of J joints are told so, too: positions (N, J) [rad or m].
    """

    stamps: NDArray[np.int64]
    positions: Array
    turns: Array | None
    frame_id: str
    child: str
    notes: tuple[str, ...] = ()

    @property
    def times(self) -> Array:
        """Times (N,) from the first stamp on [s]."""
        return np.asarray((self.stamps - self.stamps[0]) / 1e9)


def path_of(
    kind: str, samples: Sequence[StampedMessage], choices: Choices = NONE
) -> tuple[Trajectory, str, str, tuple[str, ...]]:
    """The path of a recording, its frame_id, the frame or body that moves, and notes.

    The choices say which transforms are meant, which part is wanted, and whether every pose is, as it was recorded.

    Raises:
        TrajectoryError: If there are too few samples, they are in different frames, or nothing moves.
        RequestError: If several frames move, and none is chosen.
    """
    if kind in TRANSFORMS or kind.endswith("/TransformStamped"):
        series = _of_transforms(samples, choices.frames, single=kind not in TRANSFORMS)
    else:
        series = _of_poses(samples, _PLACES[kind])
    series = _usable(series)
    notes = list(series.notes)
    series = _picked(series, choices.during(series.times), notes, "lie outside the time that was asked for")
    times = series.times
    if choices.raw or len(times) < FEWEST:
        kept, _ = from_columns(pose_columns(series.positions, series.turns) | {"t": times}, key="poses", timestep=None)
        return kept, series.frame_id, series.child, tuple(notes)
    found = smoothed(times, series.positions, series.turns)
    return found.trajectory, series.frame_id, series.child, (*notes, *told(found, len(times)))


def told(found: Smoothed, count: int) -> tuple[str, ...]:
    """What was made of a recording, for a person."""
    said = f"smoothed a recording of {count} samples (noise {found.noise * 1e3:.2g} mm) and kept"
    notes = [f"{said} {len(found.trajectory)} waypoints, within {found.off * 1e3:.2g} mm; --raw keeps every sample"]
    if found.still:
        times = listing(f"{time:.3g}" for time in found.still)
        notes.append(f"it stands still {len(found.still)} times, for {times} s; these are kept as dwells")
    return tuple(notes)


def looks_recorded(times: Array, positions: Array) -> bool:
    """Whether stamped poses were sampled at a rate and are noisy, so that they are a recording and no plan."""
    if len(times) < FEWEST:
        return False
    steps = np.diff(times)
    spacing = float(np.median(np.linalg.norm(np.diff(positions, axis=0), axis=1)))
    even = float(steps.std()) < _EVEN * float(steps.mean())
    return even and noise_of(positions) > _AS_RECORDED * spacing > 0.0


def _of_poses(samples: Sequence[StampedMessage], fields: Sequence[str]) -> PoseSeries:
    rows, turns, frames, children = [], [], Counter[str](), Counter[str]()
    for sample in samples:
        place = reduce(getattr, fields, sample.message)
        position = getattr(place, "position", place)
        turn = getattr(place, "orientation", None)
        rows.append((position.x, position.y, position.z))
        turns.append((0.0,) * 4 if turn is None else (turn.w, turn.x, turn.y, turn.z))
        frames[named(sample.message.header.frame_id)] += 1
        children[named(getattr(sample.message, "child_frame_id", ""))] += 1
    for key, found in (("header.frame_id", frames), ("child_frame_id", children)):
        if len(found) > 1:
            problem = f"changes in the recording ({listing(sorted(found))}); record one frame, or transform it to one"
            raise TrajectoryError(problem, key=key)
    stamps, notes = _stamps(samples)
    table = np.array(rows, dtype=float).reshape(-1, 3)
    quaternions = np.array(turns, dtype=float).reshape(-1, 4) if "point" not in fields else None
    return PoseSeries(stamps, table, quaternions, next(iter(frames), ""), next(iter(children), ""), notes)


def _stamps(samples: Sequence[StampedMessage]) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """The stamps [ns] of messages: their own, or when they were logged where those are not set."""
    own = np.array([stamp_ns(sample.message.header.stamp) for sample in samples], dtype=np.int64)
    if len(own) < 2 or len(set(own.tolist())) > 1:
        return own, ()
    notes = ("the stamps are not set; the times of logging count",)
    return np.array([s.logged for s in samples], dtype=np.int64), notes


def _of_transforms(samples: Sequence[StampedMessage], frames: str | None, *, single: bool) -> PoseSeries:
    """How one frame moves in another, by all transforms between the two, at each change of the moving one."""
    flat = [(s.logged, one) for s in samples for one in ([s.message] if single else s.message.transforms)]
    edges: dict[tuple[str, str], set[Any]] = {}
    for _, one in flat:
        place = one.transform.translation
        edge = named(one.header.frame_id), named(one.child_frame_id)
        edges.setdefault(edge, set()).add((place.x, place.y, place.z))
    parent, child = _frames(edges, frames)
    below = _moved_by(child, edges)
    tree, times, rows, turns = Transforms(), [], [], []
    for at, one in flat:
        tree.add([one])
        found = tree.between(child, parent) if named(one.child_frame_id) == below else None
        if found is not None:
            turn = one.transform.rotation
            unset = turn.w == turn.x == turn.y == turn.z == 0
            rows.append(found[0][:3, 3])
            turns.append(np.zeros(4) if unset else quaternion(found[0][:3, :3]))
            times.append((stamp_ns(one.header.stamp), at))
    notes = (f"the path of {child} in {parent}, by the transforms between them",) if len(edges) > 1 else ()
    own, logged = np.array(times, dtype=np.int64).reshape(-1, 2).T
    stamps = own if len(set(own.tolist())) > 1 else logged
    return PoseSeries(stamps, np.array(rows).reshape(-1, 3), np.array(turns).reshape(-1, 4), parent, child, notes)


def _moved_by(frame: str, edges: dict[tuple[str, str], set[Any]]) -> str:
    """The first frame, going up from one, that moves in its parent; the root where none does."""
    moves = {end for (_, end), seen in edges.items() if len(seen) > 1}
    parents = {end: start for start, end in edges}
    while frame not in moves and frame in parents:
        frame = parents[frame]
    return frame


def _frames(edges: dict[tuple[str, str], set[Any]], wanted: str | None) -> tuple[str, str]:
    """Which frame's motion in which other is read."""
    known = {frame for edge in edges for frame in edge}
    moving = [edge for edge, seen in edges.items() if len(seen) > 1]
    there = listing(f"{parent}:{child}" for parent, child in sorted(moving))
    if wanted is not None:
        parent, _, child = wanted.partition(":")
        if not {parent, child} <= known or parent == child:
            problem = f"{wanted!r} names no two frames of this recording as FIXED:MOVING"
            raise RequestError(f"{problem}; its frames are {listing(sorted(known))}")
        return parent, child
    if not moving:
        raise TrajectoryError(f"holds no frame that moves, only {listing(sorted(known))}", key="transforms")
    if len(moving) > 1:
        raise RequestError(f"several frames move ({there}); choose one as FIXED:MOVING, such as --moving map:base_link")
    return moving[0]


def _usable(series: PoseSeries) -> PoseSeries:
    """The samples in order of time, without those that cannot be used; the notes say which."""
    count, notes = len(series.stamps), list(series.notes)
    finite: Mask = np.asarray(np.isfinite(series.positions).all(axis=1))
    if series.turns is not None:
        finite &= np.isfinite(series.turns).all(axis=1)
    series = _picked(series, finite, notes, "hold numbers that are not finite")
    order = np.argsort(series.stamps, kind="stable")
    late = int((np.diff(series.stamps) < 0).sum())
    if late:
        odd = f"{late} of {count} samples are stamped before the one that came before them"
        notes.append(f"{odd}; put in order of time")
        series = _taken(series, order)
    fresh = np.diff(series.stamps, prepend=series.stamps[:1] - 1) > 0
    series = _picked(series, fresh, notes, "repeat the stamp before them")
    series = _turned(series, notes)
    if len(series.stamps) < 2:
        problem = f"has {len(series.stamps)} usable of {count} samples; a path needs at least 2"
        raise TrajectoryError(problem, key="poses")
    return replace(series, notes=tuple(notes))


def _turned(series: PoseSeries, notes: list[str]) -> PoseSeries:
    """The samples whose quaternion has a length, which becomes 1; no orientations where none has."""
    if series.turns is None or not len(series.turns):
        return series
    whole = np.linalg.norm(series.turns, axis=1) >= 1e-9
    if not whole.any():
        notes.append("every quaternion has length zero, so the orientations were left out")
        return replace(series, turns=None)
    unit = series.turns / np.maximum(np.linalg.norm(series.turns, axis=1, keepdims=True), 1e-9)
    return _picked(replace(series, turns=unit), whole, notes, "have a quaternion of length zero")


def _picked(series: PoseSeries, mask: Mask, notes: list[str], why: str) -> PoseSeries:
    if mask.all():
        return series
    left = f"left out {int((~mask).sum())} of {len(mask)} samples, which {why}"
    notes.append(f"{left}; the first is sample {int(np.argmin(mask))}")
    return _taken(series, np.flatnonzero(mask))


def _taken(series: PoseSeries, index: NDArray[np.intp]) -> PoseSeries:
    turns = None if series.turns is None else series.turns[index]
    return replace(series, stamps=series.stamps[index], positions=series.positions[index], turns=turns)


def joints_of(samples: Iterable[StampedMessage], choices: Choices = NONE) -> tuple[JointMotion, tuple[str, ...]]:
    """The motion of joints in a recording of JointState messages as it is: neither smoothed nor thinned.

    Where publishers of several robots or grippers share the topic, the set of joints with most messages counts.

    Raises:
        TrajectoryError: If there are no two usable states.
    """
    by_names: dict[tuple[str, ...], list[StampedMessage]] = {}
    for sample in samples:
        by_names.setdefault(tuple(str(name) for name in sample.message.name), []).append(sample)
    if not by_names:
        raise TrajectoryError("holds no joint states", key="name")
    names, chosen = max(by_names.items(), key=lambda item: len(item[1]))
    others = [listing(other) for other in by_names if other != names]
    notes = [f"there are states of other joints too, left out: {brief('; '.join(others))}"] if others else []
    stamps, said = _stamps(chosen)
    whole = [len(sample.message.position) == len(names) for sample in chosen]
    if not all(whole):
        i = whole.index(False)
        problem = f"holds {len(chosen[i].message.position)} positions for {len(names)} joints"
        raise TrajectoryError(problem, key="position", index=i)
    table = np.array([np.asarray(sample.message.position, dtype=float) for sample in chosen])
    kept = _usable(PoseSeries(stamps, table, None, "", ""))
    kept = _taken(kept, np.flatnonzero(choices.during(kept.times)))
    frame = frame_of(str(chosen[0].message.header.frame_id))
    return JointMotion(names, kept.positions, kept.times, frame=frame), (*notes, *said, *kept.notes)
