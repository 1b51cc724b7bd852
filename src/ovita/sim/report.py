"""What came of a simulation: numbers, a status and sentences."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np

from ovita.sim.placement import Base

Status = Literal["followed", "slowed", "off course", "unreachable"]


@dataclass(frozen=True)
class Tracking:
    """Distance between the robot and the place on the trajectory where it was due.

    Args:
        rms: Over time [m].
        max: [m].
        waypoint: Nearest to where it was largest.
    """

    rms: float
    max: float
    waypoint: int


@dataclass(frozen=True)
class Unreachable:
    """A waypoint that the robot cannot reach.

    Args:
        waypoint: Counted from 0.
        distance: That is left at best [m].
        reason: In words.
    """

    waypoint: int
    distance: float
    reason: str


@dataclass(frozen=True)
class Touched:
    """A limit of the robot that was reached.

    Args:
        limit: In words, such as "a4 position".
        first: Waypoint where it was first reached.
        last: Waypoint where it was last reached.
        share: Of the time, 0..1.
    """

    limit: str
    first: int
    last: int
    share: float


@dataclass(frozen=True)
class Contact:
    """Touching an object, or running through it where objects do not push back.

    Args:
        name: The object's; "floor" for the ground and "itself" for two links of the robot.
        first: Waypoint of the first contact.
        last: Waypoint of the last contact.
        start: Of the first contact [s].
        depth: Deepest penetration [m].
        meant: Whether the adaptation means to touch it.
    """

    name: str
    first: int
    last: int
    start: float
    depth: float
    meant: bool = False


@dataclass(frozen=True)
class Report:
    """The numbers of one simulation.

    Args:
        robot: Name of the robot model.
        status: "followed" (within tolerance and in the time asked), "slowed" (within tolerance, but later),
            "off course" (beyond tolerance), "unreachable" (some waypoints cannot be reached).
        base: Where the robot stood, in the scene's coordinates.
        tolerance: Tracking error that counts as followed [m].
        tracking: On the part of the trajectory that can be reached.
        orientation_error: Largest [rad], or None where no orientation was asked for.
        unreachable: By waypoint.
        limits: That were reached.
        contacts: By object.
        asked: Duration by the trajectory's time law [s].
        achieved: Duration of the simulated motion [s].
        notes: What else a person should know.
    """

    robot: str
    status: Status
    base: Base
    tolerance: float
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
        """Duration achieved by duration asked; 1 where nothing was asked."""
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
        said.append(
            f"Tracking error {_length(t.rms)} rms{where}, at most {_length(t.max)} near waypoint {t.waypoint} "
            f"({'within' if t.rms <= self.tolerance else 'beyond'} the tolerance of {_length(self.tolerance)})."
        )
        if self.orientation_error is not None:
            said.append(f"The orientation is off by at most {np.degrees(self.orientation_error):.1f} degrees.")
        said.append(_duration(self))
        said += [
            f"Limit reached: {t.limit}, {_waypoints(t.first, t.last)}, {100 * t.share:.0f} % of the time."
            for t in self.limits
        ]
        for c in self.contacts:
            meant = ", as meant" if c.meant else ""
            said.append(
                f"Contact with {c.name}{meant}: {_waypoints(c.first, c.last)}, from {c.start:.2f} s, "
                f"{_length(c.depth)} deep."
            )
        return (*said, *self.notes)


def _unreachable(items: tuple[Unreachable, ...]) -> str:
    worst = max(items, key=lambda item: item.distance)
    indices = [item.waypoint for item in items]
    return (
        f"{len(items)} waypoint{'s' if len(items) > 1 else ''} cannot be reached ({_ranges(indices)}); the worst is "
        f"waypoint {worst.waypoint}, {_length(worst.distance)} away: {worst.reason}."
    )


def _duration(report: Report) -> str:
    took = f"Took {report.achieved:.2f} s, {report.asked:.2f} s asked"
    if report.slowdown > 1.05:
        return f"{took}: {report.slowdown:.3g} times as long, because of the robot's limits."
    return f"{took}."


def _ranges(indices: list[int]) -> str:
    """Runs of indices, such as "3-7, 9"."""
    parts: list[list[int]] = []
    for i in indices:
        if parts and i == parts[-1][1] + 1:
            parts[-1][1] = i
        else:
            parts.append([i, i])
    return ", ".join(str(a) if a == b else f"{a}-{b}" for a, b in parts)


def _waypoints(first: int, last: int) -> str:
    return f"waypoint {first}" if first == last else f"waypoints {first} to {last}"


def _length(metres: float) -> str:
    return f"{metres * 1e3:.2g} mm" if metres < 0.01 else f"{metres * 1e2:.1f} cm" if metres < 1 else f"{metres:.2f} m"
