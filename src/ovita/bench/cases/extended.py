"""The extended subset: numbers, several clauses, spirals, mirrors, waypoints."""

from __future__ import annotations

from ovita.bench.cases.case import Case, case
from ovita.measure.predicates import (
    Check,
    all_of,
    any_of,
    both,
    closer,
    constant_speed,
    ends_at,
    extended,
    farther,
    faster,
    fewer_waypoints,
    first,
    goal_moved,
    gradual,
    group_averages,
    growing,
    kept,
    last,
    min_distance,
    mirrored,
    monotone_speed,
    more_waypoints,
    moved,
    near,
    never_beyond,
    no_jumps,
    outside,
    passes_over,
    rotated,
    same_path,
    slower,
    smoother,
    speeds_kept,
    spiral,
    start_moved,
    starts_at,
    stops,
    turns,
    zigzags,
)

MOST = first(fraction=0.6)
"""The part of a path that a moved goal leaves alone."""

LATE = last(fraction=0.5)
"""The part of a path that a moved start leaves alone."""


def _case(number: int, kind: str, *checks: Check, void: tuple[str, ...] = ()) -> Case:
    return case(f"extended_subset/extended_{number}", "extended", kind, *checks, void=void)


def _beginning_mirrored(*directions: str) -> Check:
    """Some beginning of the path is mirrored; the end of a longer one may be blurred, so shorter ones count too."""
    return any_of(*(mirrored(list(directions), where=first(fraction=share)) for share in (0.25, 0.2, 0.15, 0.3, 0.5)))


_ANANAS, _MARACA = near("ananas", 0.3), near("maraca", 0.3)

_CLUSTERS: tuple[list[float] | dict[str, list[str]], ...] = (
    {"between": ["tripod", "French horn"]},
    {"between": ["beaver", "French horn"]},
    {"between": ["beaver", "tripod"]},
    {"between": ["Polaroid Land camera", "French horn"]},
    {"between": ["Polaroid Land camera", "beaver"]},
)
"""Where the most objects are: the two nearest neighbours, or the middle of the four that stand together."""

CASES: tuple[Case, ...] = (
    _case(2, "several", moved("up", where=MOST, amount="little", only=False), goal_moved("down", only=False)),
    _case(4, "several", faster(where=near("ear", 0.3), only=True), closer("tin opener")),
    _case(6, "several", moved(down=0.1, tolerance=0.4, only=False), closer("panda", after={"down": 0.1})),
    _case(8, "stop", stops(near="stinkhorn"), same_path(partly=True)),
    _case(11, "ends", extended(left=0.2)),
    _case(13, "several", slower(where=near("rugby ball"), only=True), farther("redbone")),
    _case(
        15,
        "several",
        faster(where=both(_ANANAS, outside(_MARACA))),
        slower(where=both(_MARACA, outside(_ANANAS))),
        speeds_kept(both(outside(_ANANAS), outside(_MARACA))),
        same_path(),
    ),
    _case(17, "several", farther("cassette"), constant_speed(1.0)),
    _case(19, "shape", spiral(), extended()),
    _case(20, "several", farther("ptarmigan"), slower(factor=0.5)),
    _case(21, "speed", faster(where=near("potpie", 0.3), factor=2.0, only=True), same_path()),
    _case(23, "waypoints", more_waypoints(), same_path()),
    _case(24, "several", moved("left", where=MOST, amount="little", only=False), ends_at("digital clock"), no_jumps()),
    _case(26, "several", slower(where=near("rocker"), only=True), moved("up", amount="little")),
    _case(28, "several", moved("down", only=False), spiral(turns=3)),
    _case(29, "distance", min_distance("lampshade", 0.2), min_distance("sock", 0.2)),
    _case(
        30, "ends", ends_at({"between": ["Mergus serrator", "Japanese spaniel"]}), gradual(), no_jumps(), kept(first(1))
    ),
    _case(31, "shape", smoother()),
    _case(37, "ends", starts_at("butternut squash"), kept(last(1))),
    _case(
        39,
        "several",
        any_of(start_moved("up"), moved("up", where=first(fraction=0.2), amount="little")),
        stops(near="lab coat"),
    ),
    _case(42, "several", moved("up", where=LATE, amount="little"), start_moved(right=0.2, only=False)),
    _case(44, "ends", start_moved("down"), kept(last(1))),
    _case(45, "shape", zigzags()),
    _case(
        48,
        "several",
        any_of(moved("front"), goal_moved("front")),
        any_of(monotone_speed("falling", to=0.0), monotone_speed("falling", to=0.0, final=0.1)),
    ),
    _case(50, "waypoints", fewer_waypoints(), same_path(tolerance=0.08)),
    _case(
        52,
        "several",
        any_of(
            moved(up=0.1, tolerance=0.4, only=False),
            moved(up=0.1, tolerance=0.2, where=outside(near("hautbois")), only=False),
        ),
        farther("hautbois", aimed=False),
    ),
    _case(53, "ends", ends_at({"between": ["Yorkshire terrier", "milk can"]}, within=0.08), kept(first(fraction=0.8))),
    _case(57, "shape", zigzags(3)),
    _case(
        58,
        "shape",
        any_of(
            _beginning_mirrored("front", "up"),
            _beginning_mirrored("front"),
            _beginning_mirrored("up"),
        ),
        kept(last(fraction=0.3)),
    ),
    _case(60, "distance", closer("ringlet butterfly")),
    _case(64, "shape", passes_over("Gordon setter"), passes_over("ribbed toad")),
    _case(
        66,
        "shape",
        any_of(
            growing("up", "left", exponential=True),
            all_of(growing("up", exponential=True), any_of(moved("left", only=False), goal_moved("left", only=False))),
        ),
    ),
    _case(69, "waypoints", group_averages(6)),
    _case(71, "speed", slower(where=turns(0.25), only=True), same_path()),
    _case(72, "several", any_of(*(closer(place) for place in _CLUSTERS)), kept(first(1)), kept(last(1))),
    _case(73, "bounds", never_beyond(left=0.0, back=0.0)),
    _case(
        74,
        "shape",
        any_of(
            rotated(-90.0, "up"),
            rotated(90.0, "front"),
            rotated(-90.0, "front"),
            rotated(90.0, "right"),
            rotated(-90.0, "right"),
        ),
    ),
)
