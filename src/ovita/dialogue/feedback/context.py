"""What a sentence is resolved against: the turns in force, their clauses and knobs, and the scene."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

from ovita.dialogue.feedback.knobs import Knob, knobs_of
from ovita.dialogue.feedback.reference import Reference, read_reference
from ovita.dialogue.feedback.resolution import Past, Resolution
from ovita.dialogue.feedback.rewording import Part, Wording, parts_of, worded
from ovita.instruct.tokens import tokenize
from ovita.paths.scene import Scene, SceneObject, canonical
from ovita.paths.trajectory import Trajectory


@dataclass(frozen=True)
class Context:
    """Where a conversation stands.

    Args:
        said: The sentence as the person wrote it.
        history: The turns in force, oldest first; at least one.
        scene: The surroundings.
        current: The trajectory as it stands.
        named: What the answer to a question named; it narrows every reference down.
    """

    said: str
    history: tuple[Past, ...]
    scene: Scene
    current: Trajectory
    named: Reference = field(default_factory=Reference)
    _parts: dict[int, tuple[Part, ...] | None] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def last(self) -> Past:
        """The last turn."""
        return self.history[-1]

    @cached_property
    def knobs(self) -> list[Knob]:
        """The knobs of the last turn."""
        return self.knobs_at(-1)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        """The clauses of the last turn; none where they are not known."""
        return self.parts_at(-1) or ()

    def knobs_at(self, turn: int) -> list[Knob]:
        """The knobs of a turn."""
        return knobs_of(self.history[turn], self.parts_at(turn), self.scene)

    def parts_at(self, turn: int) -> tuple[Part, ...] | None:
        """The clauses of a turn, or None where they are not known."""
        turn %= len(self.history)
        if turn not in self._parts:
            self._parts[turn] = parts_of(self.history[turn], self.scene)
        return self._parts[turn]

    @cached_property
    def known(self) -> frozenset[str]:
        """Words that the last turn's knobs are named by."""
        return frozenset(word for knob in self.knobs for word in knob.name.lower().split("_") if len(word) > 2)

    def reference(self, words: str) -> Reference | None:
        """What some words refer to, or None if one of them has no place."""
        tokens, notes = tokenize(words, self.scene)
        if notes:
            return None
        return read_reference(tokens, self.known)

    def objects(self, words: str) -> tuple[SceneObject, ...]:
        """The objects that words can name, such as "blue one" or "cups"; none if a word fits no object."""
        return named_objects(words, self.scene)

    def took(self, meaning: str) -> str:
        """The sentence that says what the words were taken to mean."""
        return f"took {' '.join(self.said.split())!r} as: {meaning}"

    def rewritten(
        self, parts: Sequence[Part], *, meaning: str = "", on_current: bool = False, turn: int = -1
    ) -> Resolution | None:
        """A turn with other clauses: in its place, or as a further turn on the current trajectory.

        Args:
            parts: The clauses.
            meaning: What the words were taken to mean; by default the new instruction.
            on_current: Whether it is a further turn.
            turn: Which turn the clauses replace.
        """
        if on_current or turn in (-1, len(self.history) - 1):
            start = self.current if on_current else self.last.start
            wording = worded(parts, start, self.scene)
            return self._resolved(wording, meaning, "current" if on_current else "start")
        everything = all_parts(self.history, self.scene, {turn: tuple(parts)})
        if everything is None:
            return None
        return self._resolved(worded(everything, self.history[0].start, self.scene), meaning, "original")

    def _resolved(self, wording: Wording | None, meaning: str, begins: str) -> Resolution | None:
        if wording is None:
            return None
        return Resolution(
            "rewrite",
            self.took(meaning or f"{wording.instruction}"),
            wording.values,
            wording.instruction,
            begins,  # type: ignore[arg-type]
        )


def named_objects(words: str, scene: Scene) -> tuple[SceneObject, ...]:
    """The objects that words can name, such as "blue one" or "cups"; none if a word fits no object."""
    wanted = [w for w in re.findall(r"[^\W_]+", words) if w not in ("the", "a", "an", "one", "at", "near", "to")]
    if not wanted:
        return ()
    names = {item.name: canonical(item.name).split() for item in scene}
    return tuple(
        item
        for item in scene
        if all(word in names[item.name] or word.removesuffix("s") in names[item.name] for word in wanted)
    )


def all_parts(
    history: Sequence[Past], scene: Scene, replaced: dict[int, tuple[Part, ...]] | None = None
) -> tuple[Part, ...] | None:
    """The clauses of all turns, some replaced; None where those of one are not known."""
    found: list[Part] = []
    for i, past in enumerate(history):
        parts = (replaced or {}).get(i)
        if parts is None:
            parts = parts_of(past, scene)
        if parts is None:
            return None
        found += parts
    return tuple(found)
