"""A trajectory from words alone: ends and via points are resolved and planned, the rest of the sentence adapts it.

The planned trajectory is the original of an ordinary adaptation, so promises, limits and verdict are as always. This is
a call of its own rather than a `Request` without a trajectory: every reader, prompt and check of a request measures its
trajectory, and a question about the way has to be answered before there is one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from ovita.chain import adapt, enforced
from ovita.errors import RequestError
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import MAX_INSTRUCTION, Request
from ovita.result import Adaptation, Status
from ovita.sources.places import Location
from ovita.sources.planner import TIME_LIMIT, WAYPOINTS, Plan, Planner, PlanRequest, anchored, planned, planner_named
from ovita.sources.route import Route, read_route
from ovita.text import sentence
from ovita.writers.base import PolicyWriter, Progress


@dataclass(frozen=True, eq=False)
class Generation:
    """What came of a sentence without a trajectory.

    Args:
        instruction: The sentence.
        route: What it says of the way.
        question: What has to be known first, or "".
        plan: The planned way, or None after a question.
        adaptation: The plan adapted to the rest of the sentence, or None where there is no legal plan.
    """

    instruction: str
    route: Route
    question: str = ""
    plan: Plan | None = None
    adaptation: Adaptation | None = None

    @property
    def status(self) -> Status:
        """The adaptation's status; without one "needs_clarification" after a question, else "infeasible"."""
        if self.adaptation is not None:
            return self.adaptation.status
        return "needs_clarification" if self.question else "infeasible"

    @property
    def message(self) -> str:
        """What to tell a person who got no trajectory, or the adaptation's own message."""
        if self.adaptation is not None:
            return self.adaptation.message
        return self.question or " ".join(self.plan.sentences() if self.plan else ())


def from_words(
    instruction: str,
    scene: Scene,
    robot: Robot,
    *,
    here: Location | None = None,
    writer: PolicyWriter | str = "auto",
    planner: Planner | str = "limits",
    waypoints: int = WAYPOINTS,
    speed: float | None = None,
    seed: int = 0,
    search_limit: float = TIME_LIMIT,
    constraints: ConstraintOptions | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Generation:
    """Make a trajectory from a sentence alone, such as "from the box to the plate over the bottle, slowly".

    Args:
        instruction: Names where to start and to end, perhaps what to pass, and what else is asked for.
        scene: With the objects that it names.
        robot: The limits.
        here: Where the robot is, for sentences that do not say where to start.
        writer: Of the policy for the rest of the sentence, see `adapt`.
        planner: Of the way, see `plan`.
        waypoints: How many the plan gets.
        speed: On the way [m/s], see `plan`.
        seed: Of planners that sample.
        search_limit: For planning [s].
        constraints: How limits are enforced.
        progress: Called with a short line at every stage.
        options: Of `adapt`, such as `isolation`, `repairs` and `time_limit`.

    Raises:
        RequestError: If the instruction is empty or too long, or a place cannot be used.
        InputError: As `adapt` does.
    """
    if not instruction.strip() or len(instruction) > MAX_INSTRUCTION:
        raise RequestError(f"say in 1 to {MAX_INSTRUCTION} characters where to go, such as 'from the box to the plate'")
    route = read_route(instruction, scene)
    route = replace(route, start=route.start or here)
    if route.question or route.start is None or route.goal is None:
        return Generation(instruction, route, route.question)
    first, *passed, last = anchored([route.start, *route.via, route.goal], scene, robot)
    request = PlanRequest(scene, robot, first, last, tuple(passed), waypoints, speed, seed, search_limit)
    found = planned(request, planner_named(planner) if isinstance(planner, str) else planner, progress)
    made = Generation(instruction, route, plan=found)
    if found.trajectory is None or not found.ok:
        return made
    stages = {"writer": writer, "constraints": constraints, "progress": progress, **options}
    return replace(made, adaptation=_adapted(instruction, route, request, found.trajectory, stages))


def _adapted(
    instruction: str, route: Route, request: PlanRequest, path: Trajectory, stages: dict[str, Any]
) -> Adaptation:
    """A planned path adapted to what the sentence asks for besides the way."""
    scene, robot = request.scene, request.robot
    if route.rest:
        result = adapt(Request(route.rest, path, scene, robot, origin=f"planned {request.told}"), **stages)
    else:
        limits = stages["constraints"] or ConstraintOptions()
        result = enforced(instruction, path, scene, robot, constraints=limits)
    return _whole(result, instruction, sentence(f"Plan the way {request.told}"), route.notes)


def _whole(result: Adaptation, instruction: str, told: str, notes: tuple[str, ...]) -> Adaptation:
    """The adaptation of the rest as that of the whole sentence, with the planning as its first step."""
    proposal = None if result.proposal is None else _whole(result.proposal, instruction, told, notes)
    return replace(
        result,
        instruction=instruction,
        plan=(told, *result.plan),
        assumptions=(*notes, *result.assumptions),
        proposal=proposal,
    )
