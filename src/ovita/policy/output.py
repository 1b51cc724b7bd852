"""Convert a policy's result to rows of numbers (in the sandbox), and rows to a trajectory (outside)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.errors import PolicyOutputInvalid, TrajectoryError
from ovita.paths.geometry import lengths
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory, arc_length, nlerp
from ovita.policy.wire import MAX_ROWS

MAX_EXTENT = 100.0
"""How many times the size of the scene a policy's path may reach."""

MIN_REACH = 10.0
"""What a policy's path may always reach from the middle of the scene [m]."""

MAX_SPEED_FACTOR = 1000.0
"""How many times the original's highest speed a policy may ask for."""

MIN_TOP_SPEED = 100.0
"""Speed that a policy may always ask for [m/s]."""

_SPEED_KEYS = ("speed", "velocity", "v", "vel")


def to_rows(result: Any, original: Array, what: str) -> Array:
    """Turn a policy's result into rows x, y, z, speed (and a quaternion if they have one).

    Args:
        result: Array (M, 4), (M, 3) or (M, 8), a list of rows, or a list of dicts with x, y, z and speed or velocity.
        original: The original's rows (N, 4); its speeds serve if the result has none and M equals N.
        what: Name of the result for messages.

    Raises:
        PolicyOutputInvalid: If it cannot be read so.
    """
    wanted = "an array (N, 4) of x, y, z, speed"
    if result is None:
        raise PolicyOutputInvalid(f"{what} is None; it must be {wanted}")
    if isinstance(result, Mapping | str | bytes) or not hasattr(result, "__len__"):
        raise PolicyOutputInvalid(f"{what} is a {type(result).__name__}, not {wanted}")
    if len(result) > MAX_ROWS:
        raise PolicyOutputInvalid(f"{what} has {len(result)} waypoints; {MAX_ROWS} are the most")
    if len(result) and all(isinstance(row, Mapping) for row in result):
        result = [_row(waypoint, i, original, len(result), what) for i, waypoint in enumerate(result)]
    rows = _numbers(result, what)
    if rows.shape[1] == 3:
        if len(rows) != len(original):
            raise PolicyOutputInvalid(
                f"{what} has no speeds and {len(rows)} waypoints instead of {len(original)}; "
                "give each waypoint a speed as its fourth value"
            )
        rows = np.column_stack([rows, original[:, 3]])
    return rows


def _numbers(result: Any, what: str) -> Array:
    """A result as real numbers (N, 3), (N, 4) or (N, 8)."""
    try:
        if np.iscomplexobj(result):
            raise TypeError
        rows = np.asarray(result, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PolicyOutputInvalid(f"{what} is not a table of numbers; it must be (N, 4): x, y, z, speed") from None
    if rows.ndim != 2 or rows.shape[1] not in (3, 4, 8):
        raise PolicyOutputInvalid(f"{what} has shape {rows.shape}; it must be (N, 4): x, y, z, speed")
    return rows


def _row(waypoint: Mapping[str, Any], i: int, original: Array, count: int, what: str) -> list[float]:
    missing = [key for key in "xyz" if key not in waypoint]
    if missing:
        raise PolicyOutputInvalid(f"waypoint {i} of {what} has no {missing[0]!r}; each needs x, y, z and velocity")
    speed = next((waypoint[key] for key in _SPEED_KEYS if key in waypoint), None)
    if speed is None:
        if count != len(original):
            raise PolicyOutputInvalid(f"waypoint {i} of {what} has no 'velocity'; each needs x, y, z and velocity")
        speed = original[i, 3]
    return [waypoint["x"], waypoint["y"], waypoint["z"], speed]


def to_trajectory(
    rows: Array, original: Trajectory, scene: Scene, within: tuple[Array, float] | None = None
) -> Trajectory:
    """Turn rows that nobody vouches for into a trajectory.

    Positions may lie at most 100 times the size of the scene from its middle (the diagonal and the centre of the box
    around the original path and all objects), and always up to 10 m; speeds may be 1000 times the original's highest,
    and always up to 100 m/s.

    Args:
        rows: (M, 4) or (M, 8).
        original: Gives orientations and the time step: row by row if the counts agree, else along the path.
        scene: Its objects count for the size of the scene.
        within: What `reach` says of both, where that is known.

    Raises:
        PolicyOutputInvalid: Naming the first waypoint that is wrong.
    """
    if rows.ndim != 2 or rows.shape[1] not in (4, 8) or not 2 <= len(rows) <= MAX_ROWS:
        raise PolicyOutputInvalid(
            f"the policy returned {len(rows)} waypoints of {rows.shape[-1]} values; "
            f"it must return 2 to {MAX_ROWS} of x, y, z, speed"
        )
    speeds = np.where((rows[:, 3] < 0) & (rows[:, 3] > -1e-9), 0.0, rows[:, 3])
    top = max(MIN_TOP_SPEED, MAX_SPEED_FACTOR * float(original.speeds.max()))
    centre, farthest = within or reach(original, scene)
    away = lengths(rows[:, :3] - centre)
    _refuse(np.asarray(~np.isfinite(rows).all(axis=1)), lambda i: f"is {rows[i, :4].tolist()}, which is not finite")
    _refuse(speeds < 0, lambda i: f"has the negative speed {speeds[i]:g} m/s")
    _refuse(speeds > top, lambda i: f"has the speed {speeds[i]:g} m/s; {top:g} is the most")
    _refuse(away > farthest, lambda i: f"is {away[i]:g} m from the middle of the scene; {farthest:g} m is the most")
    try:
        return Trajectory(rows[:, :3], speeds, _orientations(rows, original), original.timestep)
    except TrajectoryError as error:
        raise PolicyOutputInvalid(str(error)) from None


def _refuse(bad: NDArray[np.bool_], problem: Callable[[int], str]) -> None:
    if bad.any():
        i = int(np.argmax(bad))
        raise PolicyOutputInvalid(f"waypoint {i} of the result {problem(i)}")


def reach(original: Trajectory, scene: Scene) -> tuple[Array, float]:
    """The middle of the scene (3,) [m], and how far from it a policy's path may lie [m]."""
    corners = [original.positions, *(item.position[None] + sign * item.radius for item in scene for sign in (-1, 1))]
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2.0, max(MIN_REACH, MAX_EXTENT * float(np.linalg.norm(high - low)))


def _orientations(rows: Array, original: Trajectory) -> Array | None:
    if original.orientations is None:
        return None
    if rows.shape[1] == 8:
        return rows[:, 4:]
    if len(rows) == len(original):
        return original.orientations
    return nlerp(original.orientations, _source(rows[:, :3], original))


def _source(positions: Array, original: Trajectory) -> Array:
    """Fractional indices into the original that lie equally far along the path, as a share of its length."""
    s, old = arc_length(positions), original.arc_length
    if s[-1] <= 0 or old[-1] <= 0:
        return np.linspace(0.0, len(original) - 1.0, len(positions))
    keep = np.concatenate([[True], np.diff(old) > 0])
    indices = np.arange(len(old), dtype=float)[keep]
    return np.asarray(np.interp(s / s[-1], old[keep] / old[-1], indices))
