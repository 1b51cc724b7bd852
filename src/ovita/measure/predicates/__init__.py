"""Checks: predicates over (original, adapted, scene) that decide whether an adaptation follows its instruction.

Each name builds a `Check`, which is JSON-able data with `judge`; `all_of`, `any_of` and `not_` combine them. The
functions near, first, last, middle, after, before, between, turns, outside and both build the `where` of a check.
"""

# ruff: noqa: F401
from ovita.measure.predicates import asked  # known by their names alone, so that a file with such a check is read
from ovita.measure.predicates.check import (
    Check,
    CheckResult,
    Pair,
    Where,
    all_of,
    any_of,
    kinds,
    not_,
    predicate,
    say,
    selected,
)
from ovita.measure.predicates.places import (
    closer,
    ends_at,
    farther,
    goal_moved,
    growing,
    kept,
    level,
    max_distance,
    min_distance,
    moved,
    never_beyond,
    passes_between,
    passes_over,
    passes_through,
    start_moved,
    starts_at,
)
from ovita.measure.predicates.shape import (
    circles,
    curvier,
    extended,
    fewer_waypoints,
    finer,
    finite,
    gradual,
    group_averages,
    mirrored,
    more_waypoints,
    no_jumps,
    reversed_part,
    rotated,
    same_path,
    shape_kept,
    smoother,
    spiral,
    straight,
    zigzags,
)
from ovita.measure.predicates.speed import (
    constant_speed,
    dwells,
    exponential_speed,
    faster,
    monotone_speed,
    slower,
    speeds_kept,
    stops,
    trapezoidal_speed,
    uniform_acceleration,
)
from ovita.paths.part import after, before, between, both, first, last, middle, near, outside, turns
