"""A trajectory from words alone: ends and via points are resolved and planned, the rest of the sentence adapts it.

The planned trajectory is the original of an ordinary adaptation, so promises, limits and verdict are as always. This is
a call of its own rather than a `Request` without a trajectory: every reader, prompt and check of a request measures its
trajectory, and a question about the way has to be answered before there is one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from ovita.chain import adapt, enforced, to_confirm
from ovita.dialogue.session import Session
from ovita.errors import RequestError
from ovita.instruct.frames import Pace
from ovita.limits import ConstraintOptions, verify
from ovita.paths.part import WHOLE
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.request import MAX_INSTRUCTION, Request
from ovita.result import Adaptation, Status, explain
from ovita.sources.fitting import fitted
from ovita.sources.places import APPROACH, SIDES, Anchor, Location, Text
from ovita.sources.planner import TIME_LIMIT, WAYPOINTS, Plan, Planner, PlanRequest, planned, planner_named
from ovita.sources.room import around_passed, beneath_barred, capped, enlarged, leveled
from ovita.sources.route import Route, read_route
from ovita.sources.wishes import Wish
from ovita.text import called_as, length, number, sentence, the
from ovita.writers.base import PolicyWriter, Progress, Prompt, Reply, WriterChain, writer_named
from ovita.writers.generate import BuiltinWriter, FramesWriter


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


@called_as('from_words("from the box to the plate", scene, robot)')
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
    wanted = robot.max_speed if speed is None and route.fastest else speed
    if route.fastest and wanted is None:
        route = replace(route, doubts=(*route.doubts, NO_HIGHEST))
    route, wanted = _at_a_speed(route, robot, wanted)
    chosen = planner_named(planner) if isinstance(planner, str) else planner
    told = route
    for body in dict.fromkeys((capped(robot, told.ceiling), robot)):
        route, places = _placed(told, scene, body)
        room = _sides_kept(route, scene, robot)
        more = sum(here.label == before.label for before, here in pairwise(places))
        request = PlanRequest(scene, body, places[0], places[-1], tuple(places[1:-1]), waypoints + more, wanted, seed,
                              search_limit)  # fmt: skip
        found = _roomy(request, chosen, room, progress) or planned(request, chosen, progress)
        if found.ok:
            break
    request = replace(request, robot=robot)
    made = Generation(instruction, route, plan=found)
    if found.trajectory is None or not found.ok:
        return made
    stages = {"writer": writer, "constraints": constraints, "progress": progress, **options}
    made = replace(made, adaptation=_adapted(instruction, route, request, found.trajectory, stages))
    return _with_distance(made, request, chosen, stages)


def _at_a_speed(route: Route, robot: Robot, wanted: float | None) -> tuple[Route, float | None]:
    """The route without the speed [m/s] that it asks for all along, and that speed, which is planned."""
    paces = [frame for wish in route.wishes for frame in wish.frames if isinstance(frame, Pace) and frame.part == WHOLE]
    told = [frame for frame in paces if frame.change == "set" and frame.amount is not None]
    amount = told[0].amount if len(paces) == len(told) == 1 else None
    top = np.inf if robot.max_speed is None else robot.max_speed
    if amount is None or amount.unit != "m/s" or amount.role not in ("to", "at") or not 0.0 < amount.value <= top:
        return route, wanted
    wishes = (wish.without(told) for wish in route.wishes)
    return replace(route, wishes=tuple(w for w in wishes if w.frames or w.outcome != "do")), amount.value


def _placed(route: Route, scene: Scene, robot: Robot) -> tuple[Route, list[Anchor]]:
    """The places of a way, and what else is asked for; rings are among the places where they can be."""
    planned_rings = route.with_rings()
    if route.rings and planned_rings.start is not None and planned_rings.goal is not None:
        told = [planned_rings.start, *planned_rings.via, planned_rings.goal]
        found = leveled(told, route.level, scene, robot, route.rings)
        if found is not None:
            return planned_rings, found
    places = [place for place in (route.start, *route.via, route.goal) if place is not None]
    doubts = ("There is no room for the circle as it was told.",) if route.rings else ()
    return replace(route, doubts=(*route.doubts, *doubts)), leveled(places, route.level, scene, robot) or []


def _roomy(request: PlanRequest, planner: Planner, room: Mapping[str, Array], progress: Progress | None) -> Plan | None:
    """The plan around objects that are made larger by some room [m] on each side, or None if there is none."""
    if not room:
        return None
    found = planned(replace(request, scene=enlarged(request.scene, request.robot, room)), planner, progress)
    if found.trajectory is None or not found.ok:
        return None
    path = found.trajectory
    checks = verify(path, request.scene, request.robot, proposed=path, original=path)
    return replace(found, request=request, checks=checks) if all(check.held for check in checks) else None


def _with_distance(made: Generation, request: PlanRequest, planner: Planner, stages: dict[str, Any]) -> Generation:
    """Planned again with the distances that the rest of the sentence asks for, if that serves better.

    The ends stay where they were said this way, which an adaptation that makes room would move.
    """
    result = made.adaptation
    if result is None or (RANK.get(result.status, 9) > RANK["not_as_meant"]):
        return made
    keep = request.robot.radius + request.robot.obstacle_margin
    kept = [promise.arguments for promise in result.postconditions if promise.kind == "distance"]
    asked = [(promise.get("object"), promise.get("at_least")) for promise in kept]
    room = {str(name): np.full(3, least - keep + SPARE) for name, least in asked if name and least and least > keep}
    room |= {
        name: np.maximum(more, room.get(name, 0.0))
        for name, more in _sides_kept(made.route, request.scene, request.robot).items()
    }
    found = _roomy(request, planner, room, stages["progress"])
    if found is None or found.trajectory is None:
        return made
    again = _adapted(made.instruction, made.route, request, found.trajectory, stages)
    return replace(made, plan=found, adaptation=again) if RANK.get(again.status, 9) <= RANK[result.status] else made


def _sides_kept(route: Route, scene: Scene, robot: Robot) -> dict[str, Array]:
    """The room (3,) [m] around objects so that a path passes them on the side that was said."""
    return beneath_barred(route, scene) | around_passed(route, scene, robot)


NO_HIGHEST = "No robot is named, so its highest speed is not known; say a speed, such as 1 m/s."

RANK: dict[Status, int] = {"done": 0, "limited": 1, "not_as_meant": 2}
"""The better of two results has the lower one."""

SPARE = 0.005
"""How much more than the distance that is asked for a plan keeps [m]."""


def begun(session: Session, said: str, **options: Any) -> Adaptation:
    """Make the trajectory of a session that has none from words; a question waits for its answer, as in a conversation.

    Args:
        session: Whose scene, robot, writer and limits count; it begins with the result.
        said: The sentence, or the answer to the question before.
        options: Of `from_words`, such as `progress` and `cancel`.

    Raises:
        InputError: As `from_words` does.
    """
    text = restated(session.asked, said, session.scene)
    stages = {"writer": session.writer, "constraints": session.constraints, "isolation": session.isolation, **options}
    made = from_words(text, session.scene, session.robot, **stages)
    if made.adaptation is None:
        session.ask_about(text if made.question else "")
        problem = "" if made.question else made.message
        standing = session.original
        return Adaptation(text, made.status, standing, standing, scene=session.scene, robot=session.robot,
                          question=made.question, error=problem, explanation=made.message)  # fmt: skip
    if made.adaptation.usable or made.adaptation.proposal is not None:
        session.begin(made.adaptation)
    return made.adaptation


def restated(before: str, answer: str, scene: Scene) -> str:
    """A sentence with the answer to what was asked about it; the answer alone where that tells a whole way."""
    told, whole = read_route(before, scene), read_route(answer, scene)
    if not before or (whole.start is not None and whole.goal is not None):
        return answer
    said = Text(answer, scene)
    place = said.place_at(0) if len(said) else None
    if place is not None and place[1] == len(said):  # "the box"
        answer = f"{'to' if told.goal is None and told.start is not None else 'from'} {answer}"
    return f"{before.rstrip(' .,?!')}, {answer}"


def _adapted(
    instruction: str, route: Route, request: PlanRequest, path: Trajectory, stages: dict[str, Any]
) -> Adaptation:
    """A planned path adapted to what the sentence asks for besides the way."""
    scene, robot = request.scene, request.robot
    if route.rest:
        wishes = tuple(fitted(wish, route, request, path) for wish in route.wishes)
        asked = Request(route.rest, path, scene, robot, origin=f"planned {request.told}")
        result = adapt(asked, **(stages | {"writer": _with_wishes(stages["writer"], wishes)}))
        doubts = (*route.doubts, *_moved_ends(path, result))
    else:
        limits = stages["constraints"] or ConstraintOptions()
        result, doubts = enforced(instruction, path, scene, robot, constraints=limits), route.doubts
    doubts = (*doubts, *_otherwise(route, result.adapted or path, scene))
    result = to_confirm(result, doubts=doubts) if result.usable and doubts else result
    way = f"{length(path.length)} at up to {number(float(path.speeds.max()))} m/s"
    told = sentence(f"Plan the way {request.told}: {way}")
    return _whole(result, instruction, told, (*route.notes, *_near(route, robot)))


@dataclass(frozen=True)
class WishWriter:
    """The built-in writer for wishes that were read together with the way: it realises their frames.

    Args:
        wishes: What is asked for besides the way.
        name: How it is named.
    """

    wishes: tuple[Wish, ...]
    name: str = "builtin"

    def write(self, prompt: Prompt) -> Reply:
        """Answer with one policy for all wishes; where one of them is not understood, as to their words."""
        if any(wish.outcome == "ask" for wish in self.wishes):
            return BuiltinWriter().write(prompt)
        frames = tuple(frame for wish in self.wishes for frame in wish.frames)
        reply = FramesWriter(frames).write(prompt)
        unused = tuple(word for wish in self.wishes for word in wish.unused)
        doubts = tuple(doubt for wish in self.wishes for doubt in wish.doubts)
        shown = any(wish.outcome == "needs_confirmation" for wish in self.wishes)
        return replace(reply, confirm=True, unplaced=unused, doubts=doubts) if shown else reply


def _with_wishes(writer: PolicyWriter | str, wishes: tuple[Wish, ...]) -> PolicyWriter:
    """A writer that takes what was read of wishes where the built-in writer would be asked."""
    named = writer_named(writer) if isinstance(writer, str) else writer
    if isinstance(named, WriterChain):
        return replace(named, writers=tuple(_with_wishes(one, wishes) for one in named.writers))
    return WishWriter(wishes) if named.name == "builtin" else named


def _moved_ends(path: Trajectory, result: Adaptation) -> tuple[str, ...]:
    """What an adaptation does to the ends of the way, which were said and are not to move, as sentences."""
    if result.adapted is None:
        return ()
    dense = result.adapted.resample(500, by="arc_length").positions
    ends = {"start": (path.positions[0], dense[:1]), "goal": (path.positions[-1], dense)}
    away = {end: float(np.linalg.norm(there - said, axis=1).min()) for end, (said, there) in ends.items()}
    return tuple(
        f"The {end} would lie {number(far)} m from where it was said." for end, far in away.items() if far > OFF
    )


def _otherwise(route: Route, path: Trajectory, scene: Scene) -> tuple[str, ...]:
    """What a path passes on another side than was said, or leads over against what was said, as sentences."""
    dense = path.resample(500, by="arc_length").positions
    up = scene.frame.direction("up")
    found = []
    for place in (place for place in route.via if place.relation in SIDES):
        if not _beside(place, dense, scene):
            found.append(f"It would also pass {the(place.objects[0].name)} on another side.")
    found += [f"It would not pass {place.label}." for place in route.via if _missed(place, dense, up)]
    for item in (scene[name] for name in route.barred):
        above = dense[(dense - item.position) @ up > 0.0]
        shadow = above - np.outer((above - item.position) @ up, up)
        if len(shadow) and float(item.clearance(shadow).min()) <= 0.0:
            found.append(f"It would lead over {the(item.name)}.")
    return tuple(found)


def _beside(place: Location, dense: Array, scene: Scene) -> bool:
    """Whether a path (N, 3) is on the side of an object that was said where it is level with it, or nearest to it."""
    item, up = place.objects[0], scene.frame.direction("up")
    side = scene.frame.direction(str(place.relation)) if place.away is None else np.array(place.away)
    away = dense - item.position
    away -= np.outer(away @ up, up)
    along = np.cross(up, side)
    reach = float(np.abs(item.rotation.T @ along) @ item.size) / 2.0
    level, far = (away @ side)[np.abs(away @ along) <= max(reach, OFF)], np.linalg.norm(away, axis=1)
    nearest = int(far.argmin())
    return (len(level) > 0 and float(level.min()) > 0.0) or float(away[nearest] @ side) >= 0.5 * float(
        far[nearest]
    ) > 0.0


def _missed(place: Location, dense: Array, up: Array) -> bool:
    """Whether a path (N, 3) does not lead over an object, or between two, as was said."""
    if place.relation == "over":
        item = place.objects[0]
        above = dense[(dense - item.position) @ up > 0.0]
        shadow = above - np.outer((above - item.position) @ up, up)
        return not len(shadow) or float(item.clearance(shadow).min()) > OFF
    if place.relation != "between":
        return False
    one, other = (item.position - (item.position @ up) * up for item in place.objects)
    along, length = (other - one) / np.linalg.norm(other - one), float(np.linalg.norm(other - one))
    away = dense - np.outer(dense @ up, up) - one
    across = np.linalg.norm(away - np.outer(away @ along, along), axis=1)
    inside = (away @ along > 0.0) & (away @ along < length)
    return not inside.any() or float(across[inside].min()) > OFF


OFF = 0.04
"""How far an end may be moved without asking [m]."""


def _near(route: Route, robot: Robot) -> tuple[str, ...]:
    """How far from an object a place at it is, where no distance was said."""
    places = (place for place in (route.start, *route.via, route.goal) if place is not None)
    if not any(place.objects and place.distance is None and place.relation != "between" for place in places):
        return ()
    keep = robot.radius + robot.obstacle_margin
    parts = f"{robot.radius:g} m of body, {robot.obstacle_margin:g} m of margin and {APPROACH:g} m"
    return (f"a place at an object is {keep + APPROACH:.3g} m from its surface: {parts}",)


def _whole(result: Adaptation, instruction: str, told: str, notes: tuple[str, ...]) -> Adaptation:
    """The adaptation of the rest as that of the whole sentence, with the planning as its first step."""
    proposal = None if result.proposal is None else _whole(result.proposal, instruction, told, notes)
    whole = replace(
        result,
        instruction=instruction,
        plan=(told, *result.plan),
        assumptions=(*notes, *result.assumptions),
        proposal=proposal,
    )
    return replace(whole, explanation=explain(whole)) if result.explanation == explain(result) else whole
