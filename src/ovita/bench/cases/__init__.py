"""Cases for the samples of the public OVITA dataset: ids and predicates, never its sentences or trajectories."""

from __future__ import annotations

from ovita.bench.cases import arm, drone, extended, ground, latte
from ovita.bench.cases.case import Case, case

__all__ = ["Case", "all_cases", "case", "case_for"]

_CASES = {one.id: one for table in (latte, extended, drone, ground, arm) for one in table.CASES}


def all_cases() -> tuple[Case, ...]:
    """Every case, by subset and number."""
    return tuple(_CASES.values())


def case_for(sample_id: str) -> Case | None:
    """The case of a sample such as "latte_subset/latte_0", or None if there is none."""
    return _CASES.get(sample_id)
