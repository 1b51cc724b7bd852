"""What a simulation measured: tracking, contacts, limits reached and duration, as numbers, a status and sentences."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np

from ovita.paths.scene import matrix
from ovita.paths.trajectory import Array, Trajectory, interpolate
from ovita.sim.models import RobotModel
from ovita.sim.placement import Base
from ovita.sim.timing import ControlPlan, Touched, Unreachable, stretches
from ovita.text import counted, length, listed, waypoints

Status = Literal["followed", "slowed", "contact", "off course", "unreachable"]
FAILED: tuple[Status, ...] = ("contact", "off course", "unreachable")
"""Statuses of a motion that nobody should run on a robot."""


@dataclass(frozen=True)
class Tracking:
    """Distance of the robot from where it was due [m], over time, and the waypoint nearest to its maximum."""

    rms: float
    max: float
    waypoint: int


@dataclass(frozen=True)
class Contact:
    """Touching an object, or running through it where objects do not push back.

    Args:
        name: The object's; "floor" for the ground and "itself" for two links of the robot.
        first, last: Waypoints of the first and of the last contact.
        start: Of the first contact [s].
        depth: Deepest penetration [m].
        meant: Whether the adaptation means to touch it.
        links: The two links, where the robot touches itself.
    """

    name: str
    first: int
    last: int
    start: float
    depth: float
    meant: bool = False
    links: tuple[str, ...] = ()

    @property
    def told(self) -> str:
        """What is touched, in words."""
        return f"{self.name} ({listed(self.links)})" if self.links else self.name

    @property
    def sentence(self) -> str:
        """What is touched, where, when and how deep."""
        meant, where = ", as meant" if self.meant else "", waypoints(self.first, self.last)
        return f"Contact with {self.told}{meant}: {where}, from {self.start:.2f} s, {length(self.depth)} deep."


@dataclass(frozen=True)
class Report:
    """The numbers of one simulation.

    Args:
        status: "followed" (within both tolerances and in the time asked), "slowed" (within them, but later), "contact"
            (something was touched that is not meant to be), "off course" (beyond a tolerance), "unreachable" (some
            waypoints cannot be reached).
        base: Where the robot stood, in the scene's coordinates.
        tolerance: Tracking error, root mean square over time, that counts as followed [m].
        peak_tolerance: Largest tracking error that counts as followed [m].
        tracking: On the part of the trajectory that can be reached.
        orientation_error: Largest [rad], or None without reference orientations.
        asked: Duration by the trajectory's time law [s].
        achieved: Duration of the simulated motion [s].
    """

    robot: str
    status: Status
    base: Base
    tolerance: float
    peak_tolerance: float
    tracking: Tracking
    orientation_error: float | None
    unreachable: tuple[Unreachable, ...]
    limits: tuple[Touched, ...]
    contacts: tuple[Contact, ...]
    asked: float
    achieved: float
    notes: tuple[str, ...] = ()

    @property
    def slowdown(self) -> float:
        """Ratio of achieved to planned duration; 1 if none was planned."""
        return self.achieved / self.asked if self.asked > 0 else 1.0

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {**asdict(self), "slowdown": self.slowdown, "sentences": list(self.sentences())}

    def sentences(self) -> tuple[str, ...]:
        """The report in plain words, the most important first."""
        said = [f"Base at {self.base.describe()} ({self.base.how})."]
        if self.unreachable:
            said.append(_unreachable(self.unreachable))
        t = self.tracking
        where = " where it can be reached" if self.unreachable else ""
        usual = f"{length(t.rms)} rms{where} ({_within(t.rms, self.tolerance)})"
        most = f"{length(t.max)} near waypoint {t.waypoint + 1} ({_within(t.max, self.peak_tolerance)})"
        said.append(f"Tracking error {usual}, at most {most}.")
        if self.orientation_error is not None:
            said.append(f"The orientation is off by at most {np.degrees(self.orientation_error):.1f} degrees.")
        late = f": {self.slowdown:.3g} times as long, because of the robot's limits" if self.slowdown > 1.05 else ""
        said.append(f"Took {self.achieved:.2f} s, {self.asked:.2f} s asked{late}.")
        said += [limit.sentence for limit in self.limits] or ["No limit of the robot itself was reached."]
        said += [contact.sentence for contact in self.contacts] or ["It touches nothing."]
        return (*said, *self.notes)


def _within(error: float, tolerance: float) -> str:
    return f"{'within' if error <= tolerance else 'beyond'} the tolerance of {length(tolerance)}"


def _unreachable(items: tuple[Unreachable, ...]) -> str:
    worst = max(items, key=lambda item: item.distance)
    numbers = np.array([item.waypoint + 1 for item in items])
    runs = np.split(numbers, np.flatnonzero(np.diff(numbers) != 1) + 1)
    which = ", ".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
    far = f"waypoint {worst.waypoint + 1}, {length(worst.distance)} away: {worst.reason}"
    return f"{counted(len(items), 'waypoint')} cannot be reached ({which}); the worst is {far}."


LATE = 1.05
LATE_BY = 0.5
"""A motion that takes longer than asked by more than the factor LATE and by more than LATE_BY [s] is slowed down; less
is what starting from rest and coming to rest takes."""


@dataclass
class Log:
    """What is recorded while a simulation runs.

    At each of K steps: the tip (K, 3) [m], its rotation matrix (K, 9), whether the actuators were too weak (K,). At the
    recorded frames: the step, MuJoCo's positions, positions (B, 3) and quaternions (B, 4) of the robot's bodies. By
    name of what was touched, and the robot's links where that is itself: first step, last step and depth [m].
    """

    tips: Array
    turns: Array
    weak: Array
    frames: list[int] = field(default_factory=list)
    states: list[Array] = field(default_factory=list)
    poses: list[tuple[Array, Array]] = field(default_factory=list)
    contacts: dict[tuple[str, ...], tuple[int, int, float]] = field(default_factory=dict)


def assess(
    model: RobotModel, intent: ControlPlan, log: Log, path: Trajectory, base: Base, *, oriented: bool, meant: set[str]
) -> Report:
    """Compare the recorded motion with the trajectory, which is in the simulator's coordinates.

    A rover is measured along the ground; `oriented`: orientations were to be tracked; objects that are `meant` may be
    touched. The base is in the scene's coordinates.
    """
    plan = intent.plan
    off = log.tips - interpolate(path.positions, plan.where)
    error = np.linalg.norm(off[:, :2] if model.controller == "rover" else off, axis=1)
    reached = _reached(plan.where, intent.unreachable, len(path))
    if not reached.any():
        reached[:] = True
    shown = error[reached]
    worst = int(np.nonzero(reached)[0][np.argmax(shown)])
    tracking = Tracking(float(np.sqrt(np.mean(shown**2))), float(shown.max()), round(float(plan.where[worst])))
    asked, achieved = path.duration, float(plan.times[-1])
    contacts: list[Contact] = []
    for (name, *links), (first, last, depth) in log.contacts.items():
        places, start = plan.where[first : last + 1], float(plan.times[first])
        ends = round(float(places.min())), round(float(places.max()))
        contacts.append(Contact(name, *ends, start, depth, name in meant, tuple(links)))
    late = achieved > LATE * asked and achieved - asked > LATE_BY
    lost: tuple[tuple[Status, bool], ...] = (
        ("unreachable", bool(intent.unreachable)),
        ("off course", tracking.rms > model.tolerance or tracking.max > model.peak_tolerance),
        ("contact", not all(contact.meant for contact in contacts)),
        ("slowed", late),
    )
    return Report(
        robot=model.name,
        status=next((status for status, holds in lost if holds), "followed"),
        base=base,
        tolerance=model.tolerance,
        peak_tolerance=model.peak_tolerance,
        tracking=tracking,
        orientation_error=_orientation_error(path, plan.where, log.turns) if oriented else None,
        unreachable=intent.unreachable,
        limits=(*intent.limits, *stretches("actuators", log.weak, plan.where)),
        contacts=tuple(contacts),
        asked=asked,
        achieved=achieved,
        notes=(*model.notes, *intent.notes),
    )


def _reached(where: Array, unreachable: tuple[Unreachable, ...], n: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(K,) whether both waypoints around each place can be reached."""
    good = np.ones(n, dtype=bool)
    good[[item.waypoint for item in unreachable]] = False
    low = np.clip(np.floor(where).astype(int), 0, n - 1)
    return np.asarray(good[low] & good[np.minimum(np.ceil(where).astype(int), n - 1)])


def _orientation_error(path: Trajectory, where: Array, turns: Array) -> float | None:
    """Largest angle between the reference orientations and the tool's rotation matrices (K, 9) [rad]."""
    asked = path.orientations_at(where)
    if asked is None:
        return None
    trace = (matrix(asked.T).transpose(2, 0, 1) * turns.reshape(-1, 3, 3)).sum(axis=(1, 2))
    return float(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)).max())
