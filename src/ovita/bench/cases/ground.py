"""The robot subset's ground robot."""

from __future__ import annotations

from ovita.bench.cases.case import Case, case
from ovita.measure.predicates import (
    Check,
    after,
    any_of,
    between,
    circles,
    closer,
    constant_speed,
    dwells,
    farther,
    faster,
    first,
    kept,
    last,
    moved,
    near,
    outside,
    same_path,
    shape_kept,
    speeds_kept,
    straight,
    uniform_acceleration,
)


def _case(number: int, kind: str, *checks: Check) -> Case:
    return case(f"robot_subset/Ground_robot/trajectory_{number}", "ground", kind, *checks)


CASES: tuple[Case, ...] = (
    _case(0, "cartesian", moved(back=3.0)),
    _case(1, "cartesian", moved(right=0.4, front=0.2)),
    _case(
        4,
        "speed",
        constant_speed(0.34, where=near("bottle", 2.0)),
        speeds_kept(outside(near("bottle", 2.0))),
        same_path(),
    ),
    _case(
        5,
        "several",
        closer("piano"),
        any_of(shape_kept(), closer("piano", where=first(fraction=1.0))),
        uniform_acceleration("rising"),
    ),
    _case(6, "distance", farther("table", times=2.0)),
    _case(12, "several", farther("bottle"), dwells(10, near="fan")),
    _case(13, "shape", straight(between("fan", "chair")), kept(last(fraction=0.5))),
    _case(15, "several", closer("fan", amount="little"), faster(where=near("sofa"), only=True)),
    _case(17, "cartesian", moved(left=1.0, front=1.0)),
    _case(20, "shape", circles("piano", turns=1.0), kept(last(1))),
    _case(22, "distance", closer("chair", where=first(6)), kept(last(fraction=0.6))),
    _case(
        23,
        "speed",
        any_of(constant_speed(where=after("bed")), constant_speed(where=last(fraction=0.7))),
        speeds_kept(outside(after("bed"))),
        same_path(),
    ),
)
