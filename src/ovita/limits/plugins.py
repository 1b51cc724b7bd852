"""Your own constraints: a margin function, and its linearisation.

    @dataclass(frozen=True)
    class BelowShelf:
        height: float
        name = "below the shelf"
        unit = "m"
        limit = "under the shelf"

        def margin(self, trajectory):           # (N,), >= 0 where the limit holds
            return self.height - trajectory.positions[:, 2]

        def rows(self, path):                   # normals . x_i >= offsets, near this path (N, 3)
            n = len(path)
            return Rows(np.arange(n), np.tile([0.0, 0.0, -1.0], (n, 1)), np.full(n, -self.height))

    constrain(..., options=ConstraintOptions(custom=(BelowShelf(0.8),)))

The solver linearises `rows` again at every iterate; `verify` uses `margin` alone. A constraint that cannot be helped
by moving the path (say, on orientations) returns `Rows.none()` and is then only measured. Packages offer constraints
by name through the entry point group "ovita.limits".
"""

from __future__ import annotations

from importlib.metadata import entry_points
from typing import Any, Protocol, runtime_checkable

from ovita.errors import ConstraintDefinitionError
from ovita.limits.qp import Rows
from ovita.paths.trajectory import Array, Trajectory

GROUP = "ovita.limits"
"""Entry point group; each entry is a constraint or a callable that returns one."""


@runtime_checkable
class Constraint(Protocol):
    """A limit of your own.

    Attributes:
        name: For reports.
        unit: Of the margin.
        limit: The limit in words.
    """

    @property
    def name(self) -> str:
        """For reports."""

    @property
    def unit(self) -> str:
        """Of the margin, such as "m"."""

    @property
    def limit(self) -> str:
        """The limit in words."""

    def margin(self, trajectory: Trajectory) -> Array:
        """By how much each waypoint (N,) or each segment (N-1,) keeps the limit; negative where it does not."""

    def rows(self, path: Array) -> Rows:
        """Linear limits that stand for it near a path (N, 3) [m]."""


def load(name: str, **values: Any) -> Constraint:
    """The constraint that an installed package offers under this name.

    Args:
        name: Of the entry point in the group "ovita.limits".
        values: Handed to it, if it is callable.

    Raises:
        ConstraintDefinitionError: If there is none, or it is not a constraint.
    """
    offered = {entry.name: entry for entry in entry_points(group=GROUP)}
    if name not in offered:
        known = ", ".join(sorted(offered)) or "none at all"
        raise ConstraintDefinitionError(f"no installed package offers the constraint {name!r}; on offer: {known}")
    found = offered[name].load()
    return check(found(**values) if callable(found) else found)


def check(candidate: object) -> Constraint:
    """The candidate itself, if it is a constraint.

    Raises:
        ConstraintDefinitionError: If it lacks name, unit, limit, margin or rows.
    """
    if not isinstance(candidate, Constraint):
        raise ConstraintDefinitionError(
            f"{candidate!r} is not a constraint: it needs name, unit, limit, margin(trajectory) and rows(path)"
        )
    return candidate
