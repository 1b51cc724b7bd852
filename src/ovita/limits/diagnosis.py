"""Why a problem has no solution: the smallest set of limits that contradict each other, and what to relax."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from ovita.limits.path import PathProblem
from ovita.limits.problem import TOLERANCE, ConstraintCheck, ConstraintOptions, Obstacle, amount, at
from ovita.limits.route import Blocked, find_route, nearest_legal
from ovita.paths.robot import Box, Robot
from ovita.text import sentence, waypoints


def explain(
    problem: PathProblem,
    robot: Robot,
    checks: Sequence[ConstraintCheck],
    blocked: Sequence[Blocked],
    options: ConstraintOptions,
) -> tuple[str, ...]:
    """Sentences on the limits that cannot hold together, by the checks of the best effort and the blocked stretches."""
    said = list(_empty_workspace(robot))
    illegal = set()
    for pin in problem.pins:
        found = list(_illegal_pin(problem, robot, pin, options))
        if found:
            illegal.add(pin)
        said += found
    for first, second in pairwise(problem.pins):
        if second == first + 1 and not {first, second} & illegal:
            said += _blocked_pair(problem, robot, first, second, options)
    for stretch in blocked:
        if stretch.last > stretch.first + 1 and not {stretch.first, stretch.last} & illegal:
            said += _blocked_stretch(problem, robot, stretch, options)
    if not said:
        said = [_unexplained(check) for check in checks if not check.held]
    return tuple(dict.fromkeys(said))


def pin_name(problem: PathProblem, pin: int, options: ConstraintOptions) -> str:
    """What to call a pinned waypoint."""
    if pin == 0 and options.fix_start:
        return "the fixed start"
    if pin == len(problem.reference) - 1 and options.fix_goal:
        return "the fixed goal"
    return f"the pinned waypoint {pin + 1}"


def _empty_workspace(robot: Robot) -> list[str]:
    box = robot.workspace
    if not isinstance(box, Box):
        return []
    return [
        f"The workspace is {high - low:g} m wide along {axis}, less than twice its margin of {robot.margin:g} m; "
        f"reduce the margin or widen the workspace."
        for axis, low, high in zip("xyz", box.lower, box.upper, strict=True)
        if high - low < 2.0 * robot.margin - 1e-12
    ]


def _illegal_pin(problem: PathProblem, robot: Robot, pin: int, options: ConstraintOptions) -> list[str]:
    who = pin_name(problem, pin, options)
    point = problem.reference[pin][None]
    said = []
    beyond = [float(np.max(np.concatenate([problem.lower - point[0], point[0] - problem.upper])))]
    beyond += [float(region.excess(point)[0]) for region in problem.regions]
    if max(beyond) > 10.0 * TOLERANCE:
        where = "" if robot.workspace is None else f" ({robot.workspace.describe()}, margin {robot.margin:g} m)"
        said.append(
            f"{who} lies {amount(max(beyond))} m outside the workspace{where}; free it, move it, or widen the workspace"
        )
    for body in problem.bodies:
        depth = -float(body.signed(point)[0][0])
        if depth > TOLERANCE:
            said.append(
                f"{who} lies {amount(depth)} m inside {_name(body, robot)}; {_remedy(body, 'free it, move it')}"
            )
    return [sentence(text) for text in said]


def _blocked_pair(problem: PathProblem, robot: Robot, first: int, second: int, options: ConstraintOptions) -> list[str]:
    start, end = problem.reference[first][None], problem.reference[second][None]
    names = f"{pin_name(problem, first, options)} and {pin_name(problem, second, options)}"
    said = []
    for body in problem.bodies:
        depth = -float(body.along(start, end)[0][0])
        if depth > TOLERANCE:
            said.append(
                f"The straight line between {names} passes {amount(depth)} m inside {_name(body, robot)} and there is "
                f"no waypoint between them; {_remedy(body, 'free one of them, add waypoints')}."
            )
    return said


def _blocked_stretch(problem: PathProblem, robot: Robot, stretch: Blocked, options: ConstraintOptions) -> list[str]:
    first, last = (
        pin_name(problem, i, options) if i in problem.pins else f"waypoint {i + 1}"
        for i in (stretch.first, stretch.last)
    )
    culprits = _minimal(problem, stretch)
    names = " and ".join(_name(body, robot) for body in culprits) or "the obstacles"
    between = stretch.last - stretch.first - 1
    if stretch.why == "too few waypoints":
        return [
            f"The {between} waypoint{'s' * (between > 1)} between {first} and {last} are too few to go around {names}; "
            f"resample the trajectory to more waypoints or free an end."
        ]
    if stretch.why == "no legal point":
        return [f"There is no legal place for {waypoints(stretch.first, stretch.last)} beside {names}; reduce margins."]
    return [
        f"No way was found from {first} to {last} around {names} within the workspace; free an end, "
        f"reduce the obstacle margin, or move the obstacle."
    ]


def _minimal(problem: PathProblem, stretch: Blocked) -> tuple[Obstacle, ...]:
    """A minimal set of bodies that together block a stretch (deletion filter)."""
    start, goal = problem.reference[stretch.first], problem.reference[stretch.last]
    room = stretch.last - stretch.first - 1 if stretch.why == "too few waypoints" else None
    kept = list(problem.bodies)

    def free(bodies: list[Obstacle]) -> bool:
        trial = replace(problem, bodies=tuple(bodies))
        if stretch.why == "no legal point":
            return len(nearest_legal(trial, start)) > 0
        return not isinstance(find_route(trial, start, goal, room=room), str)

    if len(kept) > 12:
        line = start[None], goal[None]
        kept.sort(key=lambda body: -float(body.along(*line)[0][0]))
        kept = kept[-12:]
    if free(kept):
        return ()
    for body in list(kept):
        rest = [other for other in kept if other is not body]
        if not free(rest):
            kept = rest
    return tuple(kept)


def _unexplained(check: ConstraintCheck) -> str:
    subject = f" '{check.subject}'" if check.subject else ""
    where = at(check.place, check.where_after)
    return (
        f"The {check.name} limit{subject} ({check.limit}) stays broken by {amount(check.violation_after)} "
        f"{check.unit}{where}; relax it or ask for another path."
    )


def _name(body: Obstacle, robot: Robot) -> str:
    if body.what == "workspace":
        return "the inner radius of the workspace (with its margin)"
    body_of = f" for a body of {robot.radius:g} m radius" if robot.radius > 0.0 else ""
    return f"'{body.name}' (with its margin of {body.keep - robot.radius:g} m{body_of})"


def _remedy(body: Obstacle, first: str) -> str:
    if body.what == "workspace":
        return f"{first}, or reduce the inner radius"
    return f"{first}, reduce the margin, or say that '{body.name}' is to be touched"
