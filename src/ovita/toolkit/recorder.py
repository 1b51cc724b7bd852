"""What a policy says about itself while it runs: what it means to touch and what it promises."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array
from ovita.toolkit.arguments import Target


@dataclass(frozen=True)
class Expectation:
    """A postcondition that a policy states.

    Args:
        kind: Name of the call without "expect_", such as "closer".
        arguments: JSON values; an object by its name, a point as [x, y, z] [m], a mask as
            {"count": N, "ranges": [[first, last], ...]} over waypoint indices.
        text: The promise as a sentence for people.
    """

    kind: str
    arguments: Mapping[str, Any]
    text: str


@dataclass
class Recorder:
    """Collects what a running policy states.

    Args:
        contacts: Names of the objects that it means to touch or to pass through, each once.
        expectations: Its postconditions, in order.
    """

    contacts: list[str] = field(default_factory=list)
    expectations: list[Expectation] = field(default_factory=list)


def note_contact(recorder: Recorder | None, target: Target | None, shift: Array) -> None:
    """Record that the policy means to touch a target, if that is an object and no offset keeps away from it."""
    if recorder is None or not isinstance(target, SceneObject) or shift.any():
        return
    if target.name not in recorder.contacts:
        recorder.contacts.append(target.name)
