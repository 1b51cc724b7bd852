"""Routes and time laws: a path with rounded corners, passed within a robot's limits; what controllers plan with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ovita.errors import TrajectoryError
from ovita.paths.trajectory import REST, Array, Trajectory
from ovita.text import waypoints

SAMPLES = 2000
"""Most samples of a whole route that even spacing adds."""


@dataclass(frozen=True)
class Hold:
    """A dwell [s] from the first to the last of some waypoints that share one position."""

    where: tuple[int, int]
    duration: float


@dataclass(frozen=True)
class Move:
    """A stretch of the path that begins and ends at rest.

    Args:
        arc: (M,) distance along the path without rounding, ascending from 0 [m].
        points: (M, 3) samples of the rounded path [m].
        where: (M,) the place of each sample, counted in waypoints: 2.5 is midway between waypoints 2 and 3.
        speeds: (M,) what the time law allows there [m/s].
    """

    arc: Array
    points: Array
    where: Array
    speeds: Array

    @property
    def tangents(self) -> Array:
        """(M, 3) direction of the path at each sample, not normalised."""
        return np.asarray(np.gradient(self.points, self.arc, axis=0, edge_order=2))


def route(trajectory: Trajectory, *, corner: float, stop_angle: float, spacing: float) -> list[Move | Hold]:
    """Split a trajectory into moves and dwells.

    A robot rests at the start, at the goal, at waypoints with speed 0 and where the path turns by more than
    `stop_angle` [rad]. Every other corner is rounded so that the path stays within about `corner` [m] of it. Samples
    are at most `spacing` [m] apart, more on paths that are very long.
    """
    positions, speeds, durations = trajectory.positions, trajectory.speeds, trajectory.durations
    lengths = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    even = max(spacing, float(lengths.sum()) / SAMPLES)
    pieces: list[Move | Hold] = []
    legs: list[int] = []

    def close() -> None:
        if legs:
            pieces.append(_move(trajectory, legs, corner, even, 0.1 * spacing))
            legs.clear()

    for i in np.flatnonzero((lengths > 0.0) | (durations > 0.0)).tolist():
        if lengths[i] == 0.0:
            close()
            last = pieces.pop() if pieces and isinstance(pieces[-1], Hold) and pieces[-1].where[1] == i else None
            first, before = (last.where[0], last.duration) if isinstance(last, Hold) else (i, 0.0)
            pieces.append(Hold((first, i + 1), before + float(durations[i])))
            continue
        if legs and (speeds[i] <= REST or _turn(positions, legs[-1], i) > stop_angle):
            close()
        legs.append(i)
    close()
    return pieces


def _spread(knots: Array, wished: Array, gap: float) -> Array:
    """All knots (K,) and those of the other values (M,) that keep `gap` from the knots and from one another, sorted."""
    after = np.searchsorted(knots, wished).clip(1, len(knots) - 1)
    free = np.minimum(np.abs(wished - knots[after - 1]), np.abs(knots[after] - wished)) >= gap
    kept: list[float] = []
    for value in wished[free].tolist():
        if not kept or value - kept[-1] >= gap:
            kept.append(value)
    return np.sort(np.concatenate([knots, kept]))


def _turn(positions: Array, before: int, after: int) -> float:
    a, b = positions[before + 1] - positions[before], positions[after + 1] - positions[after]
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def _move(trajectory: Trajectory, legs: list[int], corner: float, spacing: float, gap: float) -> Move:
    """Sample the legs (segments that have a length) between two rests, with rounded corners.

    A corner that turns the direction by d is rounded over a width w on both sides of it: at the distance x along the
    path from the corner, the path is shifted by d (w - |x|)^3 / (6 w^2). This is the mean of the path under a triangle,
    and its curvature has no jumps; at the corner itself the shift is |d| w / 6.
    """
    positions, speeds = trajectory.positions, trajectory.speeds
    starts, ends = positions[legs], positions[np.array(legs) + 1]
    lengths = np.linalg.norm(ends - starts, axis=1)
    directions = (ends - starts) / lengths[:, None]
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    bends = np.diff(directions, axis=0)
    sharp = np.linalg.norm(bends, axis=1)
    widths = np.minimum(6.0 * corner / np.maximum(sharp, 1e-9), np.minimum(lengths[:-1], lengths[1:]))

    near = (knots[1:-1, None] + widths[:, None] * np.linspace(-1.5, 1.5, 13)).clip(0.0, knots[-1])
    even = np.linspace(0.0, knots[-1], max(8, int(np.ceil(knots[-1] / spacing))) + 1)
    arc = _spread(knots, np.sort(np.concatenate([even, near.ravel()])), min(gap, knots[-1] / 10.0))
    leg = np.clip(np.searchsorted(knots, arc, side="right") - 1, 0, len(legs) - 1)
    share = np.clip((arc - knots[leg]) / lengths[leg], 0.0, 1.0)
    points = starts[leg] + (arc - knots[leg])[:, None] * directions[leg]
    for knot, width, bend in zip(knots[1:-1], widths, bends, strict=True):
        inside = slice(*np.searchsorted(arc, [knot - width, knot + width]))
        points[inside] += ((width - np.abs(arc[inside] - knot)).clip(0.0) ** 3 / (6.0 * width**2))[:, None] * bend
    first = np.array(legs)[leg]
    allowed = np.sqrt(speeds[first] ** 2 * (1 - share) + speeds[first + 1] ** 2 * share)
    if len(legs) == 1 and speeds[legs[0]] + speeds[legs[0] + 1] <= REST:
        allowed = np.full(len(arc), lengths[0] / trajectory.timestep)
    return Move(arc, points, first + share, allowed)


LONGEST = 7200.0
"""Longest motion that is simulated [s]."""


@dataclass(frozen=True)
class MotionPlan:
    """The planned motion, sampled at uniform times.

    Args:
        step: Between two times [s].
        where: (K,) place on the trajectory, counted in waypoints.
        coordinates: (K, D) in the robot's own coordinates.
        rates: (K, D) their first derivatives.
        accelerations: (K, D) their second derivatives.
    """

    step: float
    where: Array
    coordinates: Array
    rates: Array
    accelerations: Array

    def __len__(self) -> int:
        return len(self.where)

    @property
    def times(self) -> Array:
        """(K,) [s], starting at 0."""
        return np.asarray(self.step * np.arange(len(self), dtype=float), dtype=np.float64)


@dataclass(frozen=True)
class Piece:
    """A part of a plan that begins and ends at rest, by its own M samples.

    Times [s] and path parameter start at 0; `speeds` are the parameter's first derivative, `where` (M,) is the place on
    the trajectory, counted in waypoints; coordinates (M, D).
    """

    times: Array
    arc: Array
    speeds: Array
    where: Array
    coordinates: Array

    @property
    def duration(self) -> float:
        """[s]."""
        return float(self.times[-1])


def still(duration: float, where: tuple[float, float], coordinates: Array) -> Piece:
    """A stationary piece at `coordinates` (D,) whose path parameter runs from where[0] to where[1]."""
    ends = np.array([0.0, duration])
    return Piece(ends, np.zeros(2), np.zeros(2), np.array(where, dtype=float), np.tile(coordinates, (2, 1)))


def timed(arc: Array, where: Array, coordinates: Array, allowed: Array, velocity: Array, acceleration: Array) -> Piece:
    """Go along coordinates as fast as the time law allows, but no faster than the limits.

    The law is a bound on the speed along the path, the limits are bounds on every coordinate; the fastest motion under
    both, from rest to rest, is found by TOPP-RA (Pham and Pham, IEEE T-RO 34(3), 2018).

    At path lengths `arc` (M,) [m], ascending, are places on the trajectory `where` (M,), coordinates (M, D) and speeds
    along the path that the law allows (M,) [m/s]; velocity and acceleration (D,) limit the coordinates' derivatives.
    """
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("CRITICAL")
    path = toppra.SplineInterpolator(arc, np.column_stack([coordinates, arc]))
    bounds = np.column_stack([np.tile(velocity, (len(arc), 1)), np.maximum(allowed, 1e-6)])
    cap = {float(s): np.column_stack([-b, b]) for s, b in zip(arc, bounds, strict=True)}
    limit = np.append(acceleration, 1e3)
    rates = constraint.JointVelocityConstraintVarying(lambda s: cap[float(s)])
    pushes = constraint.JointAccelerationConstraint(np.column_stack([-limit, limit]))
    problem = algorithm.TOPPRA([rates, pushes], path, gridpoints=arc, solver_wrapper="seidel")
    problem.compute_parameterization(0.0, 0.0)
    speeds = np.asarray(problem.problem_data.sd_vec, dtype=float)
    if not np.isfinite(speeds).all():
        speeds = _cautious(arc, path, bounds, limit)
    pairs = np.maximum(speeds[:-1] + speeds[1:], 1e-9)
    times = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(arc) / pairs)])
    return Piece(times, arc, speeds, where, coordinates)


def _cautious(arc: Array, path: Any, bounds: Array, limit: Array) -> Array:
    """Speeds along the path (M,) [m/s] where TOPP-RA finds none: one slow constant speed, with ramps at both ends."""
    first, second = (np.maximum(np.abs(path(arc, order)), 1e-12) for order in (1, 2))
    steady = min(float((bounds / first).min()), float(np.sqrt((0.5 * limit / second).min())))
    left = np.minimum(arc - arc[0], arc[-1] - arc)
    return np.asarray(np.minimum(steady, np.sqrt(2.0 * float((0.5 * limit / first).min()) * left)))


def joined(pieces: list[Piece], step: float) -> MotionPlan:
    """Put pieces one after another and sample them every `step` seconds, up to the end of the last.

    Raises:
        TrajectoryError: If they take too long.
    """
    starts = np.concatenate([[0.0], np.cumsum([piece.duration for piece in pieces])])
    if starts[-1] > LONGEST:
        long = f"would take {starts[-1] / 3600:.3g} h, and at most {LONGEST / 3600:g} h can be simulated"
        raise TrajectoryError(f"the motion {long}; raise the lowest speeds or cut the trajectory")
    times = step * np.arange(int(np.ceil(starts[-1] / step)) + 1)
    width = pieces[0].coordinates.shape[1]
    where = np.empty(len(times))
    states = np.zeros((3, len(times), width))
    for piece, start, end in zip(pieces, starts[:-1], starts[1:], strict=True):
        inside = slice(int(np.searchsorted(times, start)), int(np.searchsorted(times, end, side="right")))
        _sample(piece, times[inside] - start, where, states, inside)
    beyond = times > starts[-1]
    where[beyond], states[0, beyond] = pieces[-1].where[-1], pieces[-1].coordinates[-1]
    return MotionPlan(step, where, states[0], states[1], states[2])


def _sample(piece: Piece, times: Array, where: Array, states: Array, inside: slice) -> None:
    """Write the state of a piece at its own times into the rows `inside`."""
    from scipy.interpolate import CubicSpline

    if piece.arc[-1] == 0.0:
        where[inside] = np.interp(times, piece.times, piece.where)
        states[0, inside], states[1, inside], states[2, inside] = piece.coordinates[0], 0.0, 0.0
        return
    i = np.clip(np.searchsorted(piece.times, times, side="right") - 1, 0, len(piece.times) - 2)
    passed = times - piece.times[i]
    push = np.diff(piece.speeds**2) / (2.0 * np.diff(piece.arc))
    speed = piece.speeds[i] + push[i] * passed
    arc = np.clip(piece.arc[i] + passed * (piece.speeds[i] + 0.5 * push[i] * passed), piece.arc[i], piece.arc[i + 1])
    spline = CubicSpline(piece.arc, piece.coordinates)
    bend = spline(arc, 1)
    where[inside] = np.interp(arc, piece.arc, piece.where)
    states[0, inside] = spline(arc)
    states[1, inside] = bend * speed[:, None]
    states[2, inside] = bend * push[i][:, None] + spline(arc, 2) * (speed**2)[:, None]


@dataclass(frozen=True)
class Unreachable:
    """A waypoint, counted from 0, that the robot cannot reach, the distance that is left at best [m], and why."""

    waypoint: int
    distance: float
    reason: str


@dataclass(frozen=True)
class Touched:
    """A limit of the robot that was reached.

    Args:
        limit: In words, such as "a4 position".
        first, last: Waypoints where it was first and last reached.
        share: Of the time, 0..1.
    """

    limit: str
    first: int
    last: int
    share: float

    @property
    def sentence(self) -> str:
        """Which limit, where, and for how long."""
        return f"Limit reached: {self.limit}, {waypoints(self.first, self.last)}, {100 * self.share:.0f} % of the time."


@dataclass(frozen=True)
class ControlPlan:
    """What a controller plans to track: the plan, waypoints and limits that it cannot keep, and notes for a person."""

    plan: MotionPlan
    unreachable: tuple[Unreachable, ...] = ()
    limits: tuple[Touched, ...] = ()
    notes: tuple[str, ...] = ()


class Controller(Protocol):
    """Drives one kind of robot; a fresh one is made for every simulation."""

    @property
    def intent(self) -> ControlPlan:
        """The plan, made when the controller is made."""

    def pose(self, data: Any, step: int) -> None:
        """Put the simulated robot (MuJoCo's data) where the plan has it at one step, at rest."""

    def act(self, data: Any, step: int) -> bool:
        """Write the actuators' values for one step; positions, velocities and forces of `data` are up to date.

        Returns:
            Whether the actuators can give what the controller wants.
        """


def stretches(name: str, at_limit: np.ndarray[Any, Any], where: Array) -> tuple[Touched, ...]:
    """A limit as `Touched`, or nothing where it is reached at no step (K,); `where` (K,) is the place, in waypoints."""
    if not at_limit.any():
        return ()
    places = where[at_limit]
    return (Touched(name, round(float(places.min())), round(float(places.max())), float(at_limit.mean())),)
