"""One case: a sample of a dataset, by its id, and the check that its adaptation has to pass."""

from __future__ import annotations

from dataclasses import dataclass

from ovita.measure.predicates import Check, all_of, finite


@dataclass(frozen=True)
class Case:
    """A sample and what an adaptation of it must do.

    Args:
        id: The sample's path relative to the dataset's folder, with / and without .json.
        subset: "latte", "extended", "drone", "ground" or "arm"; a dataset may have others.
        kind: What the instruction is about: "distance", "speed", "cartesian", "ends", "shape", "waypoints", "stop",
            "bounds", or "several" if it has several clauses.
        check: What an adaptation has to pass.
        void: Clauses that are not checked because the scene lacks the object they name.
    """

    id: str
    subset: str
    kind: str
    check: Check
    void: tuple[str, ...] = ()


def case(id: str, subset: str, kind: str, *checks: Check, void: tuple[str, ...] = ()) -> Case:
    """A case whose adaptation passes every check, is finite and stays near the scene."""
    return Case(id, subset, kind, all_of(*checks, finite()), void)
