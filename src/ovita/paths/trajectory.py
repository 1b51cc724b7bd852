"""Trajectories: waypoints with speeds, their time law and their resampling."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovita.errors import TrajectoryError
from ovita.text import point

Array = NDArray[np.float64]

REST = 1e-12
"""Speeds up to this count as no speed in the time law [m/s]."""

TIMESTEP = 0.1
"""Default duration of one dwell waypoint [s]."""


@dataclass(frozen=True, eq=False)
class PathState:
    """What a trajectory asks for at M moments.

    Args:
        where: Fractional waypoints (M,), counted from 0: 2.5 is midway between waypoints 2 and 3.
        positions: (M, 3) [m].
        speeds: (M,) [m/s].
        orientations: (M, 4) unit quaternions wxyz, or None.
    """

    where: Array
    positions: Array
    speeds: Array
    orientations: Array | None = None


@dataclass(frozen=True, eq=False, repr=False)
class Trajectory:
    """A sequence of N >= 2 waypoints in the world frame.

    Args:
        positions: (N, 3) [m].
        speeds: (N,) [m/s], each >= 0.
        orientations: (N, 4) unit quaternions wxyz, or None.
        timestep: Duration of one dwell waypoint [s].

    The arrays are copied, checked and made read-only.

    Raises:
        TrajectoryError: On a wrong shape, a value that is not finite, or a negative speed; names the waypoint.
    """

    positions: Array
    speeds: Array
    orientations: Array | None = None
    timestep: float = TIMESTEP

    if TYPE_CHECKING:  # what may be given is wider than what is held

        def __init__(
            self,
            positions: ArrayLike,
            speeds: ArrayLike,
            orientations: ArrayLike | None = None,
            timestep: float = TIMESTEP,
        ) -> None: ...

    def __post_init__(self) -> None:
        positions = _checked(self.positions, "positions", 3)
        speeds = _checked(self.speeds, "speeds", None)
        if len(positions) < 2:
            raise TrajectoryError(
                f"a trajectory needs at least 2 waypoints, this one has {len(positions)}", key="positions"
            )
        if len(speeds) != len(positions):
            raise TrajectoryError(
                f"{len(positions)} positions but {len(speeds)} speeds; give one speed per waypoint", key="speeds"
            )
        if (speeds < 0).any():
            i = int(np.argmax(speeds < 0))
            raise TrajectoryError(f"speed {speeds[i]:g} is negative; speeds are >= 0 m/s", key="speeds", index=i)
        if self.orientations is not None:
            quaternions = _checked(self.orientations, "orientations", 4)
            if len(quaternions) != len(positions):
                raise TrajectoryError(
                    f"{len(positions)} positions but {len(quaternions)} orientations", key="orientations"
                )
            norms = np.linalg.norm(quaternions, axis=1)
            if (norms < 1e-9).any():
                i = int(np.argmin(norms))
                raise TrajectoryError("the quaternion (wxyz) has length zero", key="orientations", index=i)
            off = np.abs(norms - 1.0) > 1e-12
            if off.any():
                quaternions = np.where(off[:, None], quaternions / norms[:, None], quaternions)
            object.__setattr__(self, "orientations", _frozen(quaternions))
        if not (isinstance(self.timestep, Real) and np.isfinite(self.timestep) and self.timestep > 0):
            raise TrajectoryError(f"timestep {self.timestep!r} is not a positive time in seconds", key="timestep")
        object.__setattr__(self, "positions", _frozen(positions))
        object.__setattr__(self, "speeds", _frozen(speeds))

    @classmethod
    def from_array(cls, waypoints: ArrayLike, *, speed: float | None = None, timestep: float = TIMESTEP) -> Trajectory:
        """Build a trajectory from rows x, y, z, speed[, qw, qx, qy, qz].

        Args:
            waypoints: (N, 4) or (N, 8) [m, m/s]; (N, 3) where `speed` is given.
            speed: Of every waypoint of bare positions [m/s].
            timestep: Duration of one dwell waypoint [s].

        Raises:
            TrajectoryError: If the array has another shape or illegal values.
        """
        try:
            rows = np.asarray(waypoints, dtype=float)
        except (TypeError, ValueError):
            raise TrajectoryError("waypoints are not rows of numbers of one length", key="waypoints") from None
        bare = rows.ndim == 2 and rows.shape[1] == 3
        if bare and speed is not None:
            rows = np.column_stack([rows, np.full(len(rows), speed)])
        elif rows.ndim != 2 or rows.shape[1] not in (4, 8):
            hint = "; bare positions need a speed: from_array(waypoints, speed=0.1)" if bare else ""
            raise TrajectoryError(
                f"waypoints have shape {rows.shape}, expected (N, 4): x, y, z, speed{hint}", key="waypoints"
            )
        return cls(rows[:, :3], rows[:, 3], rows[:, 4:] if rows.shape[1] == 8 else None, timestep)

    def to_array(self) -> Array:
        """Return a new array (N, 4): x, y, z [m], speed [m/s]."""
        return np.column_stack([self.positions, self.speeds])

    def to_numpy(self) -> Array:
        """Return a new array that `from_array` reads back: (N, 4), or (N, 8) where there are orientations."""
        rows = self.to_array()
        return rows if self.orientations is None else np.column_stack([rows, self.orientations])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:
        if copy is False:
            raise ValueError("a trajectory keeps positions and speeds apart, so an array of both is a copy")
        return self.to_numpy().astype(dtype or np.float64, copy=False)

    def __len__(self) -> int:
        return len(self.positions)

    def __iter__(self) -> Iterator[Array]:
        return iter(self.to_numpy())

    @overload
    def __getitem__(self, at: slice) -> Trajectory: ...
    @overload
    def __getitem__(self, at: int) -> Array: ...
    def __getitem__(self, at: int | slice) -> Array | Trajectory:
        """One waypoint as a row of `to_numpy`, or a part as a trajectory of its own.

        Raises:
            IndexError: If there is no such waypoint.
            TrajectoryError: If the part has fewer than 2 waypoints, or `at` is neither an index nor a slice.
        """
        if isinstance(at, slice):
            turns = None if self.orientations is None else self.orientations[at]
            return Trajectory(self.positions[at], self.speeds[at], turns, self.timestep)
        if not isinstance(at, int | np.integer):
            raise TrajectoryError("waypoints are taken by an index or a slice; for more, index to_numpy()")
        turn = () if self.orientations is None else self.orientations[at]
        return np.array([*self.positions[at], self.speeds[at], *turn])

    def __repr__(self) -> str:
        ends = f"from {point(self.positions[0])} to {point(self.positions[-1])}"
        return f"<Trajectory: {len(self)} waypoints, {self.length:.3g} m, {self.duration:.3g} s, {ends}>"

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Trajectory):
            return NotImplemented
        arrays = ("positions", "speeds", "orientations")
        same = all(np.array_equal(getattr(self, name), getattr(other, name)) for name in arrays)
        return same and self.timestep == other.timestep

    __hash__ = None  # type: ignore[assignment]

    def with_(self, *, positions: ArrayLike | None = None, speeds: ArrayLike | None = None) -> Trajectory:
        """Return a copy with other positions (N, 3) [m] or speeds (N,) [m/s]."""
        return replace(
            self,
            positions=self.positions if positions is None else np.asarray(positions, dtype=float),
            speeds=self.speeds if speeds is None else np.asarray(speeds, dtype=float),
        )

    @property
    def arc_length(self) -> Array:
        """Distance travelled up to each waypoint, (N,) [m]."""
        return arc_length(self.positions)

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        return float(self.arc_length[-1])

    @property
    def durations(self) -> Array:
        """Duration of each segment, (N-1,) [s].

        Segment i lasts 2 ds / (v_i + v_i+1), the time of a constant acceleration between its end speeds.
        A waypoint that repeats the one before it at speed 0 is a dwell and lasts one `timestep`. A segment with
        length but no speed at either end is given one `timestep` too, so that time stays finite.
        """
        ds = np.diff(self.arc_length)
        total = self.speeds[:-1] + self.speeds[1:]
        moving = total > REST
        times = np.divide(2.0 * ds, total, out=np.full_like(ds, self.timestep), where=moving)
        dwell = (ds == 0) & (self.speeds[1:] == 0)
        return np.where(dwell | (~moving & (ds > 0)), self.timestep, times)

    @property
    def times(self) -> Array:
        """Time at which each waypoint is reached, (N,) [s], starting at 0."""
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    @property
    def duration(self) -> float:
        """Time from start to goal [s]."""
        return float(self.durations.sum())

    def at(self, t: ArrayLike) -> PathState:
        """The place, pose and speed that the time law asks for at some moments; it rests at the goal afterwards.

        Args:
            t: (M,) or one moment [s]; moments before 0 mean the start.
        """
        moments = np.atleast_1d(np.asarray(t, dtype=float))
        times, durations = self.times, self.durations
        i = np.clip(np.searchsorted(times, moments, side="right") - 1, 0, len(self) - 2)
        lasts = durations[i]
        since = np.clip(np.divide(moments - times[i], lasts, out=np.ones_like(moments), where=lasts > 0), 0.0, 1.0)
        start, end = self.speeds[i], self.speeds[i + 1]
        total = start + end
        moving = total > REST
        # With constant acceleration, the share of the length is (v0 t + (v1 - v0) t^2 / 2) / ((v0 + v1) / 2).
        share = np.divide(since * (2.0 * start + since * (end - start)), total, out=since.copy(), where=moving)
        where = i + np.clip(share, 0.0, 1.0)
        speeds = start + since * (end - start)
        return PathState(where, interpolate(self.positions, where), speeds, self.orientations_at(where))

    def time_at(self, where: ArrayLike) -> Array:
        """The times (M,) [s] at which fractional waypoints (M,) are reached: the inverse of `at(t).where`."""
        places = np.clip(np.atleast_1d(np.asarray(where, dtype=float)), 0.0, len(self) - 1.0)
        i = np.minimum(places.astype(int), len(self) - 2)
        share = places - i
        start, end = self.speeds[i], self.speeds[i + 1]
        total = start + np.sqrt(start**2 + share * (end**2 - start**2))
        since = np.divide(share * (start + end), total, out=share.copy(), where=total > REST)
        return np.asarray(self.times[i] + since * self.durations[i])

    def orientations_at(self, where: ArrayLike) -> Array | None:
        """Unit quaternions (M, 4) wxyz at fractional waypoints (M,), or None if the trajectory has none."""
        places = np.atleast_1d(np.asarray(where, dtype=float))
        return None if self.orientations is None else nlerp(self.orientations, places)

    @property
    def dwells(self) -> NDArray[np.bool_]:
        """Which waypoints are dwells: they repeat the one before them at speed 0, (N,)."""
        repeated = (np.diff(self.positions, axis=0) == 0).all(axis=1) & (self.speeds[1:] == 0)
        return np.concatenate([np.zeros(1, dtype=bool), repeated])

    @property
    def stall(self) -> int | None:
        """The first waypoint from which the path goes on at speed 0, which no robot can follow, or None."""
        stuck = (np.diff(self.arc_length) > 0) & (self.speeds[:-1] == 0) & (self.speeds[1:] == 0)
        return int(np.argmax(stuck)) if stuck.any() else None

    def resample(self, n: int, *, by: Literal["arc_length", "index"] = "arc_length") -> Trajectory:
        """Return the same path with n waypoints, linearly interpolated; start and goal are kept exactly.

        Args:
            n: Number of waypoints, >= 2.
            by: "arc_length" spaces them evenly along the path (a dwell, which has no length, is lost);
                "index" spaces them evenly in waypoint count (dwells keep their share).

        Raises:
            TrajectoryError: If n < 2.
        """
        if n < 2:
            raise TrajectoryError(f"cannot resample to {n} waypoints; at least 2 are needed", key="n")
        source = source_indices(self.positions, n, by)
        speeds = interpolate(self.speeds[:, None], source)[:, 0]
        return Trajectory(interpolate(self.positions, source), speeds, self.orientations_at(source), self.timestep)


def standing_still() -> Trajectory:
    """The path of something that has no trajectory yet: two waypoints at the origin."""
    return Trajectory(np.zeros((2, 3)), np.zeros(2))


def arc_length(positions: Array) -> Array:
    """Cumulative length of a polyline: (N, D) [m] to (N,) [m]."""
    steps = positions[1:] - positions[:-1]
    travelled = np.zeros(len(positions))
    np.sqrt((steps * steps).sum(axis=1)).cumsum(out=travelled[1:])
    return travelled


def source_indices(positions: Array, n: int, by: Literal["arc_length", "index"]) -> Array:
    """Fractional waypoint indices (n,) at which a path is sampled evenly, from 0 to N-1."""
    last = len(positions) - 1
    if by == "index":
        return np.linspace(0.0, last, n)
    s = arc_length(positions)
    if s[-1] == 0.0:
        return np.linspace(0.0, last, n)
    keep = np.ones(len(s), dtype=bool)
    np.greater(s[1:], s[:-1], out=keep[1:])
    source: Array = np.interp(np.linspace(0.0, s[-1], n), s[keep], np.flatnonzero(keep))
    source[0], source[-1] = 0.0, last
    return source


def interpolate(rows: Array, source: Array) -> Array:
    """Rows (N, D) at fractional indices (M,), linearly; integer indices return the rows bit by bit."""
    if len(source) == len(rows) and np.array_equal(source, np.arange(len(rows))):
        return np.array(rows)
    low = np.minimum(np.maximum(np.floor(source).astype(int), 0), len(rows) - 1)
    high = np.minimum(low + 1, len(rows) - 1)
    t = (source - low)[:, None]
    return np.asarray(np.where(t == 0.0, rows[low], rows[low] * (1.0 - t) + rows[high] * t))


def nlerp(quaternions: Array, source: Array) -> Array:
    """Unit quaternions (N, 4) wxyz at fractional indices (M,), by normalised linear interpolation."""
    signs = np.cumprod(
        np.concatenate([[1.0], np.where((quaternions[1:] * quaternions[:-1]).sum(axis=1) < 0, -1.0, 1.0)])
    )
    mixed = interpolate(quaternions * signs[:, None], source)
    norms = np.linalg.norm(mixed, axis=1, keepdims=True)
    return np.asarray(np.where(norms > 1e-9, mixed / np.maximum(norms, 1e-9), np.array([1.0, 0.0, 0.0, 0.0])))


_LARGEST = sys.float_info.max


def is_real(value: object) -> bool:
    """Whether a value is a finite number, other than True and False."""
    number: Any = value
    return isinstance(value, Real) and not isinstance(value, bool) and bool(-_LARGEST <= number <= _LARGEST)


def first_bad(rows: Array) -> int | None:
    """Index of the first row with a value that is not finite, or None."""
    finite = np.isfinite(rows)
    return None if finite.all() else int(np.argmin(finite.reshape(len(rows), -1).all(axis=1)))


def _checked(values: ArrayLike | Iterable[float], key: str, width: int | None) -> Array:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise TrajectoryError(f"{key} are not numbers of one shape", key=key) from None
    expected = 1 if width is None else 2
    if array.ndim != expected or (width is not None and array.shape[1] != width):
        shape = "(N,)" if width is None else f"(N, {width})"
        raise TrajectoryError(f"{key} have shape {array.shape}, expected {shape}", key=key)
    bad = first_bad(array) if len(array) else None
    if bad is not None:
        raise TrajectoryError(f"{key} {array[bad].tolist()} contain a value that is not finite", key=key, index=bad)
    return array


def _frozen(array: Array) -> Array:
    array.flags.writeable = False
    return array
