"""Checks: predicates over (original, adapted, scene) that decide whether an adaptation follows its instruction.

Every predicate is an attribute of this package and builds a `Check`, which is JSON-able data with `judge`; `all_of`,
`any_of` and `not_` combine them. The functions near, first, last, middle, after, before, between, turns, outside and
both build the `where` of a check.
"""

# ruff: noqa: F401
from collections.abc import Callable

from ovita.measure.predicates import asked, places, shape, speed  # their predicates enter the table of all
from ovita.measure.predicates.check import (
    BUILDERS,
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
from ovita.paths.part import after, before, between, both, first, last, middle, near, outside, turns


def __getattr__(name: str) -> Callable[..., Check]:
    if name in BUILDERS:
        return BUILDERS[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
