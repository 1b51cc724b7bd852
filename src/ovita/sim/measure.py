"""Measuring a simulated motion: how well the trajectory was followed, what was touched, how long it took."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ovita.paths.trajectory import Array, Trajectory, interpolate
from ovita.sim.controller import Intent, stretches
from ovita.sim.models import RobotModel
from ovita.sim.placement import Base
from ovita.sim.report import Contact, Report, Status, Tracking, Unreachable

LATE = 1.05
LATE_BY = 0.5
"""A motion that takes longer than asked by more than the factor LATE and by more than LATE_BY [s] is slowed down; less
is what starting from rest and coming to rest takes."""


@dataclass
class Log:
    """What is recorded while a simulation runs.

    Args:
        tips: (K, 3) where the tip was at each step [m].
        turns: (K, 9) its rotation matrix.
        weak: (K,) whether the actuators could not give what the controller wanted.
        frames: Steps of the recorded frames.
        states: MuJoCo's positions at the frames.
        poses: Positions (B, 3) and quaternions (B, 4) of the robot's bodies at the frames.
        contacts: First step, last step and depth [m] by name.
    """

    tips: Array
    turns: Array
    weak: Array
    frames: list[int] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    poses: list[tuple[Array, Array]] = field(default_factory=list)
    contacts: dict[str, tuple[int, int, float]] = field(default_factory=dict)


def measure(
    model: RobotModel,
    intent: Intent,
    log: Log,
    path: Trajectory,
    base: Base,
    *,
    oriented: bool,
    meant: set[str],
) -> Report:
    """Compare what was recorded with what the trajectory asks for.

    Args:
        model: The robot.
        intent: What its controller meant to do.
        log: What it did.
        path: The trajectory, in the simulator's coordinates; a rover is measured along the ground.
        base: In the scene's coordinates.
        oriented: Whether the trajectory's orientations were asked for.
        meant: Names of objects that are meant to be touched.
    """
    plan = intent.plan
    due = interpolate(path.positions, plan.where)
    tips = log.tips
    if model.controller == "rover":
        flat = np.array([1.0, 1.0, 0.0])
        due, tips = due * flat, tips * flat
    error = np.linalg.norm(tips - due, axis=1)
    reached = _reached(plan.where, intent.unreachable, len(path))
    if not reached.any():
        reached[:] = True
    shown = error[reached]
    worst = int(np.nonzero(reached)[0][np.argmax(shown)])
    tracking = Tracking(float(np.sqrt(np.mean(shown**2))), float(shown.max()), round(float(plan.where[worst])))
    asked, achieved = path.duration, float(plan.times[-1])
    return Report(
        robot=model.name,
        status=_status(intent.unreachable, tracking, model.tolerance, asked, achieved),
        base=base,
        tolerance=model.tolerance,
        tracking=tracking,
        orientation_error=_orientation_error(path, plan.where, log.turns) if oriented else None,
        unreachable=intent.unreachable,
        limits=(*intent.limits, *stretches("actuators", log.weak, plan.where)),
        contacts=tuple(
            Contact(
                name,
                round(float(plan.where[first : last + 1].min())),
                round(float(plan.where[first : last + 1].max())),
                float(plan.times[first]),
                depth,
                name in meant,
            )
            for name, (first, last, depth) in log.contacts.items()
        ),
        asked=asked,
        achieved=achieved,
        notes=intent.notes,
    )


def _status(
    unreachable: tuple[Unreachable, ...], tracking: Tracking, tolerance: float, asked: float, achieved: float
) -> Status:
    if unreachable:
        return "unreachable"
    if tracking.rms > tolerance:
        return "off course"
    return "slowed" if achieved > LATE * asked and achieved - asked > LATE_BY else "followed"


def _reached(where: Array, unreachable: tuple[Unreachable, ...], n: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(K,) whether both waypoints around each place can be reached."""
    good = np.ones(n, dtype=bool)
    good[[item.waypoint for item in unreachable]] = False
    low = np.clip(np.floor(where).astype(int), 0, n - 1)
    return np.asarray(good[low] & good[np.minimum(np.ceil(where).astype(int), n - 1)])


def _orientation_error(path: Trajectory, where: Array, turns: Array) -> float | None:
    """Largest angle between the orientations asked for and the rotation matrices (K, 9) of the tip [rad]."""
    asked = path.orientations_at(where)
    if asked is None:
        return None
    w, x, y, z = asked.T
    rows = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    trace = (rows.transpose(2, 0, 1) * turns.reshape(-1, 3, 3)).sum(axis=(1, 2))
    return float(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)).max())
