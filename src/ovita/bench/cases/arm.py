"""The robot subset's arm."""

from __future__ import annotations

from ovita.bench.cases.case import Case, case
from ovita.measure.predicates import (
    Check,
    any_of,
    closer,
    dwells,
    extended,
    faster,
    first,
    goal_moved,
    kept,
    last,
    middle,
    moved,
    near,
    passes_over,
    passes_through,
    same_path,
    slower,
    start_moved,
    stops,
)


def _case(number: int, kind: str, *checks: Check) -> Case:
    return case(f"robot_subset/Manipulator/trajectory_{number}", "arm", kind, *checks)


CASES: tuple[Case, ...] = (
    _case(0, "cartesian", any_of(moved("up"), goal_moved("up"))),
    _case(2, "cartesian", any_of(moved("left"), goal_moved("left"))),
    _case(5, "speed", slower(where=middle(0.2), only=True), same_path()),
    _case(6, "cartesian", any_of(moved("up"), goal_moved("up"))),
    _case(8, "ends", extended()),
    _case(10, "ends", goal_moved(right=0.1), kept(first(1))),
    _case(11, "speed", faster(where=near("banana"), only=True), same_path()),
    _case(13, "distance", closer("orange")),
    _case(16, "shape", passes_through({"between": ["banana", "glue"]})),
    _case(18, "stop", stops(near="scissors"), same_path(partly=True)),
    _case(20, "stop", dwells(7, near="mug"), same_path()),
    _case(21, "ends", start_moved(down=0.2), kept(last(1))),
    _case(24, "shape", passes_over("red marker"), passes_over("remote_controller")),
    _case(
        25,
        "several",
        moved(left=0.2, where=first(fraction=0.4)),
        moved(right=0.2, where=last(fraction=0.4)),
    ),
    _case(27, "distance", closer("apple")),
)
