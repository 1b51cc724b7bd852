"""Input and output of the constraint solver.

The problem is that of the paper (OVITA, arXiv 2508.17260): with the waypoints x_i = (x, y, z, v) stacked
waypoint-major and x_ref what the policy proposed,

    minimise    lambda_dev |x - x_ref|^2 + lambda_smooth |D1 x|^2,        D1 x = (x_1 - x_0, x_2 - x_1, ...)
    subject to  x_i in the workspace, shrunk by a margin                  (box or spherical shell)
                dist(x_i, object) >= margin for every object              (paper: its bounding sphere)
                0 <= v_i <= v_max
                x_0, x_{N-1} as proposed                                  (if fixed)

ovita asks more: the limits hold along whole segments, not only at waypoints, and the result is measured by
`verify`, which knows nothing of how it was found.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from ovita.errors import ConstraintDefinitionError
from ovita.paths.trajectory import Trajectory, is_real
from ovita.text import counted, listed, sentence

_WANTED: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "method": (lambda value: value in ("verified", "paper"), "one of verified, paper"),
    "lambda_dev": (lambda value: is_real(value) and value >= 1e-12, "a weight > 0"),
    "lambda_smooth": (lambda value: value == "auto" or (is_real(value) and value >= 0), "a weight >= 0"),
    "lambda_shape": (lambda value: is_real(value) and value >= 0, "a weight >= 0"),
    "obstacle_shape": (lambda value: value in ("box", "sphere"), "one of box, sphere"),
    **dict.fromkeys(
        ("max_acceleration", "max_lateral_acceleration"),
        (lambda value: value is None or (is_real(value) and value > 0), "> 0 m/s^2; leave it out for no limit"),
    ),
    "steps": (lambda value: is_real(value) and value >= 1, "a number >= 1"),
}
"""What each option has to be."""

TOLERANCE = 1e-6
"""A violation up to this counts as none [m, m/s, ...]."""

Status = Literal["satisfied", "repaired", "infeasible", "preexisting", "off"]
Place = Literal["waypoint", "segment"]


@dataclass(frozen=True)
class ConstraintOptions:
    """How limits are enforced; the limits themselves belong to the `Robot`.

    Args:
        method: "verified" (sequential convex, whole segments) or "paper" (the published module: one linearised
            QP, weights searched by Optuna).
        lambda_dev: Weight of the distance to the proposed trajectory, > 0.
        lambda_smooth: Weight of the squared differences of neighbouring waypoints, >= 0; 0 asks for no smoothing
            and then leaves a legal trajectory bit by bit as it is. "auto" chooses it (see `solve.choose_smoothing`).
        lambda_shape: Weight of the squared differences of neighbouring *displacements*, >= 0: spreads a repair
            over its surroundings so that the shape of the path survives. It is zero wherever nothing is moved.
        fix_start: Whether the first waypoint must stay where it was proposed.
        fix_goal: Whether the last waypoint must stay where it was proposed.
        pinned: Waypoints that must stay where they were proposed, counted from 0; negative from the end.
        obstacles: Whether the objects of the scene are obstacles.
        obstacle_shape: "box" (the oriented cuboid) or "sphere" (its bounding sphere, as in the paper).
        repair_original: Whether to move a path that the policy left untouched but that breaks a limit.
        enabled: False only measures.
        max_acceleration: Along the path [m/s^2], or None for no limit.
        max_lateral_acceleration: Across the path, v^2 times curvature [m/s^2], or None for no limit.
        custom: Further constraints, see `custom.Constraint`.
        steps: Most linearisations in a row, >= 1; every one of them gives a legal path, more give a nearer one.
        trials: Trials of any search for weights; with method "paper" 0 takes the weights as they are.
        seed: Of that search.

    Raises:
        ConstraintDefinitionError: On weights or limits that make no sense.
    """

    method: Literal["verified", "paper"] = "verified"
    lambda_dev: float = 1.0
    lambda_smooth: float | Literal["auto"] = 0.0
    lambda_shape: float = 16.0
    fix_start: bool = False
    fix_goal: bool = False
    pinned: tuple[int, ...] = ()
    obstacles: bool = True
    obstacle_shape: Literal["box", "sphere"] = "box"
    repair_original: bool = False
    enabled: bool = True
    max_acceleration: float | None = None
    max_lateral_acceleration: float | None = None
    custom: tuple[Any, ...] = ()
    steps: int = 12
    trials: int = 50
    seed: int = 0

    def __post_init__(self) -> None:
        for key, (fits, what) in _WANTED.items():
            if not fits(getattr(self, key)):
                raise ConstraintDefinitionError(f"{key} {getattr(self, key)!r} is not {what}")

    def pins(self, n: int) -> tuple[int, ...]:
        """The waypoints of a trajectory with n waypoints that must not move, ascending.

        Raises:
            ConstraintDefinitionError: If a pinned waypoint does not exist.
        """
        chosen = set()
        for i in self.pinned:
            if not -n <= i < n:
                which = f"{i + 1} (index {i})" if i >= 0 else f"{i}"
                raise ConstraintDefinitionError(f"pinned waypoint {which} does not exist; there are {n} waypoints")
            chosen.add(i % n)
        return tuple(sorted(chosen | ({0} if self.fix_start else set()) | ({n - 1} if self.fix_goal else set())))


def about_path(unit: str) -> bool:
    """Whether a limit in this unit is about the path rather than about speed."""
    return "/s" not in unit


@dataclass(frozen=True)
class ConstraintCheck:
    """One limit, measured on the trajectory before and after the constraint module.

    Args:
        name: "workspace", "plane", "obstacle", "speed", "least speed", "acceleration", "lateral acceleration", "start",
            "goal", "pinned" or the name of a custom constraint.
        subject: The object's name, or "".
        limit: The limit in words.
        violation_before: Worst violation of the proposed trajectory, >= 0.
        violation_after: Worst violation of the result, >= 0.
        unit: Of both, such as "m".
        where_before: Waypoint or segment of the former, or None.
        where_after: Waypoint or segment of the latter, or None.
        place: Whether the two count waypoints or segments.
        violation_original: Worst violation of the trajectory before any change, >= 0; None where neither the
            proposal nor the result breaks the limit: then it is not measured.
    """

    name: str
    subject: str
    limit: str
    violation_before: float
    violation_after: float
    unit: str = "m"
    where_before: int | None = None
    where_after: int | None = None
    place: Place = "waypoint"
    violation_original: float | None = None

    @property
    def held_before(self) -> bool:
        """Whether the proposed trajectory kept the limit."""
        return self.violation_before <= TOLERANCE

    @property
    def held(self) -> bool:
        """Whether the result keeps the limit."""
        return self.violation_after <= TOLERANCE

    @property
    def geometric(self) -> bool:
        """Whether the limit is about the path rather than about speed."""
        return about_path(self.unit)


@dataclass(frozen=True)
class Verdict:
    """The outcome of every limit check.

    Args:
        status: "satisfied" (every limit held as proposed), "repaired" (every limit holds now), "preexisting" (only
            limits are broken that the original path already broke, and no worse), "infeasible" (a limit is broken; the
            result is the best effort) or "off" (only measured).
        checks: One per limit.
        exempt: Objects that the change is meant to touch, which are therefore no obstacles.
        conflicts: Sentences that name the limits that cannot hold together, and what to relax.
        max_shift: Largest distance between a proposed waypoint and its result [m].
        waypoints_changed: Waypoints whose position or speed differs from what was proposed.
        undone: Share of the requested displacement that the limits took back (0 none, 1 all), or None if no
            displacement was requested or the number of waypoints changed.
        notes: Further sentences, such as a choice of weights.
    """

    status: Status
    checks: tuple[ConstraintCheck, ...] = ()
    exempt: tuple[str, ...] = ()
    conflicts: tuple[str, ...] = ()
    max_shift: float = 0.0
    waypoints_changed: int = 0
    undone: float | None = None
    notes: tuple[str, ...] = field(default=())

    @property
    def ok(self) -> bool:
        """Whether every limit holds."""
        return all(check.held for check in self.checks)

    @property
    def did(self) -> tuple[str, ...]:
        """What was done to the proposal for the limits, as phrases such as "moved the path by up to 0.010 m"."""
        if self.max_shift > 0:
            return (f"moved the path by up to {amount(self.max_shift)} m",)
        return (f"changed the speed at {counted(self.waypoints_changed, 'waypoint')}",) * bool(self.waypoints_changed)

    def sentences(self) -> list[str]:
        """The verdict in plain words."""
        said: list[str] = []
        if self.status == "off":
            said.append("The limits were measured, not enforced.")
        elif self.status == "satisfied":
            said += self._satisfied()
        elif self.status == "infeasible":
            said.append("Not every limit can hold; this is the best effort.")
        said += [f"The limits {what}." for what in self.did]
        said += [line for check in self.checks for line in _tell(check, self.status, self.max_shift > 0)]
        said += [f"'{name}' is meant to be touched and was no obstacle." for name in self.exempt]
        return said + list(self.conflicts) + list(self.notes)

    def _satisfied(self) -> list[str]:
        """That every limit holds, which ones there are, and whether the robot's are among them."""
        own = list(dict.fromkeys(check.name for check in self.checks if check.name != "obstacle"))
        near = [check.subject for check in self.checks if check.name == "obstacle"]
        objects = listed(f"'{name}'" for name in near) if len(near) < 4 else f"{len(near)} objects"
        checked = [*own, *([f"the distance to {objects}"] if near else [])]
        said = [f"Every limit holds as proposed: {listed(checked)}."] if checked else []
        if not {"workspace", "speed", "acceleration"} & set(own):
            said.append("No limits of a robot are known, so workspace, speed and acceleration were not checked.")
        return said


@dataclass(frozen=True)
class Solution:
    """A trajectory with the same number of waypoints as proposed, and its verdict."""

    trajectory: Trajectory
    verdict: Verdict


def at(place: Place, where: int | None) -> str:
    """Where a limit is broken, as a person counts: " at waypoint 3", " between waypoints 3 and 4", or ""."""
    if where is None:
        return ""
    return f" at waypoint {where + 1}" if place == "waypoint" else f" between waypoints {where + 1} and {where + 2}"


def _tell(check: ConstraintCheck, status: Status, moved: bool) -> list[str]:
    """A sentence on a limit that was broken, before or after."""
    if check.held and check.held_before:
        return []
    subject = f"'{check.subject}'" if check.subject else f"the {check.name} limit ({check.limit})"
    if check.held:
        text = f"{amount(check.violation_before)} {check.unit}{at(check.place, check.where_before)}"
        if check.name == "obstacle":
            return [f"It had passed {text} too close to {subject}; now it keeps its distance."]
        return [sentence(f"{subject} holds now; the proposal had exceeded it by {text}")]
    text = f"{amount(check.violation_after)} {check.unit}"
    where = at(check.place, check.where_after)
    if status == "preexisting":
        how = f"passes {text} too close to {subject}" if check.name == "obstacle" else f"breaks {subject} by {text}"
        kept = "no worse than before" if moved or not check.geometric else "the path as it was"
        return [f"The original path already {how}{where}; this change leaves {kept}."]
    if check.name == "obstacle":
        return [f"The path passes {text} too close to {subject}{where}."]
    return [sentence(f"{subject} is exceeded by {text}{where}")]


def amount(value: float) -> str:
    """A violation for people: to the millimetre, smaller ones by their first digit."""
    return f"{value:.3f}" if value >= 0.001 else f"{value:.1g}"
