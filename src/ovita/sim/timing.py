"""When a robot is where: the time law of the trajectory, slowed down only where a limit of the robot asks for it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ovita.errors import TrajectoryError
from ovita.paths.trajectory import Array

LONGEST = 7200.0
"""Longest motion that is simulated [s]."""


@dataclass(frozen=True)
class Plan:
    """What a robot means to do, at times that are evenly spaced.

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
    """A part of a plan that begins and ends at rest, by its own samples.

    Args:
        times: (M,) [s], starting at 0.
        arc: (M,) path parameter.
        speeds: (M,) its first derivative.
        where: (M,) place on the trajectory, counted in waypoints.
        coordinates: (M, D).
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
    """A piece that stands still at `coordinates` (D,) while the place moves on from where[0] to where[1]."""
    ends = np.array([0.0, duration])
    return Piece(ends, np.zeros(2), np.zeros(2), np.array(where, dtype=float), np.tile(coordinates, (2, 1)))


def timed(arc: Array, where: Array, coordinates: Array, allowed: Array, velocity: Array, acceleration: Array) -> Piece:
    """Go along coordinates as fast as the time law allows, but no faster than the limits.

    The law is a bound on the speed along the path, the limits are bounds on every coordinate; the fastest motion under
    both, from rest to rest, is found by TOPP-RA (Pham and Pham, IEEE T-RO 34(3), 2018).

    Args:
        arc: (M,) path length, ascending [m].
        where: (M,) place on the trajectory.
        coordinates: (M, D).
        allowed: (M,) speed along the path that the law asks for [m/s].
        velocity: (D,) limits on the rates of the coordinates.
        acceleration: (D,) limits on their second derivatives.
    """
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("CRITICAL")
    path = toppra.SplineInterpolator(arc, np.column_stack([coordinates, arc]))
    bounds = np.column_stack([np.tile(velocity, (len(arc), 1)), np.maximum(allowed, 1e-6)])
    cap = {float(s): np.column_stack([-b, b]) for s, b in zip(arc, bounds, strict=True)}
    limit = np.append(acceleration, 1e3)
    problem = algorithm.TOPPRA(
        [
            constraint.JointVelocityConstraintVarying(lambda s: cap[float(s)]),
            constraint.JointAccelerationConstraint(np.column_stack([-limit, limit])),
        ],
        path,
        gridpoints=arc,
        solver_wrapper="seidel",
    )
    problem.compute_parameterization(0.0, 0.0)
    speeds = np.asarray(problem.problem_data.sd_vec, dtype=float)
    if not np.isfinite(speeds).all():
        speeds = _cautious(arc, path, bounds, limit)
    pairs = np.maximum(speeds[:-1] + speeds[1:], 1e-9)
    times = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(arc) / pairs)])
    return Piece(times, arc, speeds, where, coordinates)


def _cautious(arc: Array, path: object, bounds: Array, limit: Array) -> Array:
    """Speeds along the path (M,) [m/s] where TOPP-RA finds none: one slow constant speed, with ramps at both ends."""
    first = np.abs(path(arc, 1))  # type: ignore[operator]
    second = np.abs(path(arc, 2))  # type: ignore[operator]
    top = np.min(np.divide(bounds, first, out=np.full_like(bounds, np.inf), where=first > 1e-12))
    bend = np.divide(0.5 * limit, second, out=np.full_like(second, np.inf), where=second > 1e-12)
    ramp = np.min(np.divide(0.5 * limit, first, out=np.full_like(first, np.inf), where=first > 1e-12))
    steady = min(float(top), float(np.sqrt(bend.min())))
    left = np.minimum(arc - arc[0], arc[-1] - arc)
    return np.asarray(np.minimum(steady, np.sqrt(2.0 * float(ramp) * left)))


def joined(pieces: list[Piece], step: float) -> Plan:
    """Put pieces one after another and sample them every `step` seconds, up to the end of the last.

    Raises:
        TrajectoryError: If they take too long.
    """
    starts = np.concatenate([[0.0], np.cumsum([piece.duration for piece in pieces])])
    if starts[-1] > LONGEST:
        raise TrajectoryError(
            f"the motion would take {starts[-1] / 3600:.3g} h, and at most {LONGEST / 3600:g} h can be simulated; "
            "raise the lowest speeds or cut the trajectory"
        )
    times = step * np.arange(int(np.ceil(starts[-1] / step)) + 1)
    width = pieces[0].coordinates.shape[1]
    where = np.empty(len(times))
    states = np.zeros((3, len(times), width))
    for piece, start, end in zip(pieces, starts[:-1], starts[1:], strict=True):
        inside = slice(int(np.searchsorted(times, start)), int(np.searchsorted(times, end, side="right")))
        _sample(piece, times[inside] - start, where, states, inside)
    beyond = times > starts[-1]
    where[beyond], states[0, beyond] = pieces[-1].where[-1], pieces[-1].coordinates[-1]
    return Plan(step, where, states[0], states[1], states[2])


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
