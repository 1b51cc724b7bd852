"""The robot subset's drone."""

from __future__ import annotations

from ovita.bench.cases.case import Case, case
from ovita.measure.predicates import (
    Check,
    all_of,
    any_of,
    closer,
    constant_speed,
    extended,
    finer,
    first,
    goal_moved,
    last,
    level,
    min_distance,
    monotone_speed,
    more_waypoints,
    moved,
    near,
    same_path,
    slower,
    smoother,
    spiral,
)


def _case(number: int, kind: str, *checks: Check, void: tuple[str, ...] = ()) -> Case:
    return case(f"robot_subset/Drone/drone_trajectory_{number}", "drone", kind, *checks, void=void)


_END = last(fraction=0.25)

CASES: tuple[Case, ...] = (
    _case(
        1,
        "several",
        moved("up", where=first(fraction=0.6), amount="little", only=False),
        goal_moved("down", only=False),
    ),
    _case(2, "several", closer("Person"), void=("going on to the bow: the scene has none",)),
    _case(8, "speed", slower(where=_END), monotone_speed("falling", where=last(fraction=0.2)), same_path()),
    _case(9, "waypoints", more_waypoints(factor=2.0), same_path()),
    _case(11, "ends", extended(by=0.4)),
    _case(12, "distance", closer("wall lamp", amount="little")),
    _case(14, "shape", spiral(near="wall lamp", max_radius=0.1)),
    _case(16, "bounds", level(0.1)),
    _case(17, "distance", closer("Cycle", amount="little")),
    _case(18, "several", moved("up", amount="little"), constant_speed(0.1)),
    _case(19, "speed", slower(where=near("Box", 0.2), only=True), same_path()),
    _case(21, "several", closer("Fan"), min_distance("Dustbin", 0.2)),
    _case(24, "shape", any_of(smoother(), all_of(finer(), same_path(tolerance=0.05)))),
)
