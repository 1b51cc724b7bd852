"""A policy: the small program that adapts a trajectory, and the knobs it offers."""

from __future__ import annotations

from dataclasses import dataclass, replace

from ovita.policy.parameters import Parameter, Value, find_parameters, rewrite
from ovita.policy.simple import carries_columns, only_toolkit
from ovita.policy.syntax import Form, entry_of, parse_tree


@dataclass(frozen=True)
class Policy:
    """A program that turns one trajectory into another.

    Args:
        source: Python source as it will run.
        form: "function" (`adapt(traj, scene, *, knob=1.0)`) or "script" (leaves `modified_trajectory`).
        parameters: The knobs, in the order of the source.
        summary: What it does, in one sentence of its author, or "".
    """

    source: str
    form: Form = "function"
    parameters: tuple[Parameter, ...] = ()
    summary: str = ""

    def with_parameters(self, **values: Value) -> Policy:
        """Return the policy with other values written into its source, so that the source stays the truth.

        Raises:
            PolicyRejected: If it has no such parameter, or a value is of another type.
        """
        if not values:
            return self
        tree = parse_tree(self.source)
        source = rewrite(self.source, tree, entry_of(tree), values)
        tree = parse_tree(source)
        return replace(self, source=source, parameters=find_parameters(source, tree, entry_of(tree)))

    @property
    def toolkit_only(self) -> bool:
        """Whether it consists of nothing but toolkit calls, scene look-ups and arithmetic."""
        return only_toolkit(parse_tree(self.source))

    @property
    def carries_columns(self) -> bool:
        """Whether further columns of its trajectory, such as orientations, come through it unspoilt."""
        return carries_columns(parse_tree(self.source))
