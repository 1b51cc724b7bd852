"""What an utterance is resolved against: the turns in force, their clauses and knobs, and the scene."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

from ovita.dialogue.feedback.resolution import Reference, Resolution, read_reference
from ovita.dialogue.feedback.rewording import SpokenClause, Wording, parts_of, worded
from ovita.dialogue.parameters import described
from ovita.instruct.tokens import tokenize
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import Scene, SceneObject, canonical
from ovita.paths.trajectory import Trajectory
from ovita.policy import Parameter
from ovita.request import Turn
from ovita.units import dimension

SLOWEST = 0.05
"""Factor on the speed below which "more" slows nothing down any further."""

PLACING = ("at", "radius", "share", "of", "other")
"""Roles of knobs that say where or how smoothly, not how much."""

_FAMILY = {
    **dict.fromkeys(OPPOSITE, "shift"),
    "slower": "speed",
    "faster": "speed",
    "closer": "distance",
    "away": "distance",
    "longer": "wait",
}
"""Directions of knobs to the families of changes that they belong to."""


@dataclass(frozen=True)
class Knob:
    """A numeric knob of a policy.

    Args:
        parameter: The knob.
        family: "shift", "speed", "distance", or the name of another action, or "".
        directions: The direction that it acts in.
        items: The objects it is about.
        group: Number of the clause it belongs to; knobs of one clause go together.
        primary: Whether it says how much.
    """

    parameter: Parameter
    family: str = ""
    directions: frozenset[str] = frozenset()
    items: tuple[SceneObject, ...] = ()
    group: int = 0
    primary: bool = True

    @property
    def name(self) -> str:
        """Its name in the policy."""
        return self.parameter.name

    @property
    def value(self) -> float:
        """Its present value."""
        value = self.parameter.value
        assert isinstance(value, int | float)
        return value

    @property
    def is_factor(self) -> bool:
        """Whether it multiplies something, so that 1 changes nothing."""
        return self.parameter.role == "factor"

    @property
    def slows(self) -> bool:
        """Whether more of it is slower."""
        return self.value < 1 if self.is_factor else self.value < 0

    @property
    def sense(self) -> str:
        """Which way more of it goes: "slower", "faster", "closer", "away", or ""."""
        if self.family == "speed":
            return "slower" if self.slows else "faster"
        if self.family == "distance":
            return "closer" if self.parameter.direction == "closer" else "away"
        return ""

    @property
    def neutral(self) -> float | None:
        """The value with which it does nothing, or None where there is none."""
        if self.is_factor:
            return 1.0
        return None if self.family == "speed" and self.parameter.role != "by" and self.value > 0 else 0.0

    def fits(self, reference: Reference) -> bool:
        """Whether a reference can mean it."""
        if reference.names:
            named = reference.names <= set(self.name.lower().split("_"))
            return named and (not reference.items or self._about(reference))
        return self.primary and (not reference or reference.fits(self.family, self.directions, self.items))

    def _about(self, reference: Reference) -> bool:
        return any(item is mine for item in self.items for mine in reference.items)

    def times(self, k: float) -> float | int:
        """The value for k times the effect: a slowdown never reaches a standstill by it."""
        value = self.value
        if self.is_factor and value < 1:
            new = max(value**k, min(value, SLOWEST)) if k > 1 else 1 - (1 - value) * k
        elif self.is_factor:
            new = 1 + (value - 1) * k
        else:
            new = value * k
        return self.rounded(new)

    def rounded(self, new: float) -> float | int:
        """A value as a person would write it, in the type of the knob, and never the old one."""
        old = self.parameter.value
        if isinstance(old, int):
            whole = round(new)
            whole = whole if whole != old or new == old else old + (1 if new > old else -1)
            return max(whole, 1) if old > 0 else whole
        short = float(f"{new:.2g}")
        return short if abs(short - new) <= 0.02 * abs(new) else float(f"{new:.3g}")

    def shown(self, value: float | int) -> str:
        """A value of it with its unit."""
        unit = f" {self.parameter.unit}" if self.parameter.unit else ""
        return f"{value:g}{unit}"


def knobs_of(past: Turn, parts: Sequence[SpokenClause] | None, scene: Scene) -> list[Knob]:
    """The numeric knobs of a turn, with what each is about.

    Where the built-in writer wrote the policy, the clauses of the instruction tell which knobs go together.
    """
    numeric = [p for p in past.parameters if isinstance(p.value, int | float) and not isinstance(p.value, bool)]
    if parts is None:
        return [_alone(p, i, scene) for i, p in enumerate(numeric)]
    found = {p.name: p if p.role is not None else described(p, scene) for p in numeric}
    knobs: list[Knob] = []
    group = 0
    for part in parts:
        for piece in part.pieces:
            group += 1
            names = [n for n in piece.knobs if n in found]
            main = [n for n in names if found[n].role not in PLACING]
            if piece.family not in ("shift", "start", "goal", "extend"):
                main = main[-1:] if piece.family == "speed" else main[:1]
            for name in names:
                about = _headings(found[name]) or piece.directions
                knobs.append(Knob(found[name], piece.family, about, piece.items, group, name in main))
    return knobs


def _headings(parameter: Parameter) -> frozenset[str]:
    return frozenset({parameter.direction} & OPPOSITE.keys())


def _alone(parameter: Parameter, group: int, scene: Scene) -> Knob:
    """A knob of a policy whose clauses are not known."""
    heading = ""
    if parameter.role is None:
        heading = _direction_in(_words(parameter))
        parameter = described(parameter, scene)
    family, measured = _FAMILY.get(parameter.direction, ""), dimension(parameter.unit)
    if measured == "m/s":
        family = "speed"
    elif parameter.role in ("at_least", "at_most") and parameter.about:
        family = "distance"
    elif parameter.role == "by" and measured in ("", "m"):
        family = family or "shift"
    return Knob(
        parameter,
        family,
        _headings(parameter) or _headings(replace(parameter, direction=heading)),
        tuple(item for item in scene if item.name == parameter.about),
        0 if family == "shift" else group + 1,
        parameter.role not in PLACING,
    )


def _words(parameter: Parameter) -> list[str]:
    return re.findall(r"[a-z]+", f"{parameter.name.replace('_', ' ')} {parameter.meaning}".lower())


_TURNED = {"forward": "front", "backward": "back", "upward": "up", "downward": "down", "height": "up", "lift": "up"}


def _direction_in(words: Sequence[str]) -> str:
    found = [_TURNED.get(word, word) for word in words]
    return next((word for word in found if word in OPPOSITE), "")


@dataclass(frozen=True)
class Context:
    """The state of a conversation.

    Args:
        said: The sentence as the person wrote it.
        history: The turns in force, oldest first; at least one.
        scene: The surroundings.
        current: The trajectory as it stands.
        named: What the answer to a question named; it narrows every reference down.
    """

    said: str
    history: tuple[Turn, ...]
    scene: Scene
    current: Trajectory
    named: Reference = field(default_factory=Reference)
    _parts: dict[int, tuple[SpokenClause, ...] | None] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def last(self) -> Turn:
        """The last turn."""
        return self.history[-1]

    @cached_property
    def knobs(self) -> list[Knob]:
        """The knobs of the last turn."""
        return self.knobs_at(-1)

    @cached_property
    def parts(self) -> tuple[SpokenClause, ...]:
        """The clauses of the last turn; none where they are not known."""
        return self.parts_at(-1) or ()

    def knobs_at(self, turn: int) -> list[Knob]:
        """The knobs of a turn."""
        return knobs_of(self.history[turn], self.parts_at(turn), self.scene)

    def parts_at(self, turn: int) -> tuple[SpokenClause, ...] | None:
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
        """The sentence that states an interpretation."""
        return f"took {' '.join(self.said.split())!r} as: {meaning}"

    def rewritten(
        self, parts: Sequence[SpokenClause], *, meaning: str = "", on_current: bool = False, turn: int = -1
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
    history: Sequence[Turn], scene: Scene, replaced: dict[int, tuple[SpokenClause, ...]] | None = None
) -> tuple[SpokenClause, ...] | None:
    """The clauses of all turns, some replaced; None where those of one are not known."""
    found: list[SpokenClause] = []
    for i, past in enumerate(history):
        parts = (replaced or {}).get(i)
        if parts is None:
            parts = parts_of(past, scene)
        if parts is None:
            return None
        found += parts
    return tuple(found)
