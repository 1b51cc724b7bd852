"""Turns as clauses that can be dropped, moved and turned round, and put together again into one instruction."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ovita.dialogue.feedback.reference import FAMILY_OF_ACTION
from ovita.dialogue.feedback.resolution import Past
from ovita.instruct.clauses import split
from ovita.instruct.compose import RANK, intents_once
from ovita.instruct.draft import OPPOSITE, Draft
from ovita.instruct.intents import Intent, Understood
from ovita.instruct.parse import parse
from ovita.instruct.steps import STEPS
from ovita.instruct.tokens import Token, tokenize
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

Number = float | int


@dataclass(frozen=True)
class Piece:
    """One intent of a clause with the knobs it has in the policy.

    Args:
        intent: What is asked for.
        knobs: Names of its knobs, in order.
        turned: Those of them that do not have the value they were written with.
    """

    intent: Intent
    knobs: tuple[str, ...] = ()
    turned: tuple[tuple[int, Number], ...] = ()

    @property
    def family(self) -> str:
        """The family of changes that it belongs to."""
        return FAMILY_OF_ACTION.get(self.intent.action, self.intent.action)

    @property
    def sense(self) -> str:
        """Which way it goes, "slower", "faster", "closer" or "away", where it says so."""
        action, mode, amount = self.intent.action, self.intent.mode, self.intent.amount
        if action in ("closer", "farther"):
            return "closer" if action == "closer" else "away"
        if action != "speed":
            return ""
        if mode in ("factor", "add") and amount is not None:
            return "slower" if amount < (1 if mode == "factor" else 0) else "faster"
        return {"slower": "slower", "ramp_down": "slower", "turns": "slower"}.get(
            mode, "faster" if "faster" in mode else ""
        )

    @property
    def directions(self) -> frozenset[str]:
        """The directions that it names."""
        return frozenset(word for word, _ in self.intent.directions)

    @property
    def items(self) -> tuple[SceneObject, ...]:
        """The objects that it names."""
        return (*self.intent.items, *self.intent.region.items)


@dataclass(frozen=True)
class Part:
    """A clause: its words, and what was read in them."""

    text: str
    pieces: tuple[Piece, ...] = ()

    def turned(self, values: Mapping[str, Number]) -> Part:
        """The clause with knobs turned, by their names in its policy."""
        pieces = []
        for piece in self.pieces:
            new = {i: values[name] for i, name in enumerate(piece.knobs) if name in values}
            pieces.append(replace(piece, turned=tuple({**dict(piece.turned), **new}.items())))
        return Part(self.text, tuple(pieces))


@dataclass(frozen=True)
class Wording:
    """An instruction put together from parts, and the values of knobs that were turned before."""

    instruction: str
    values: dict[str, Number]


def understood_as(text: str, scene: Scene) -> Understood | None:
    """What the built-in writer reads in a text, or None unless it understands every word and asks nothing back."""
    understood = parse(text, scene)
    return understood if understood.intents and not (understood.unplaced or understood.question) else None


def parts_of(past: Past, scene: Scene) -> tuple[Part, ...] | None:
    """The clauses of a turn, or None if the built-in writer would not write this policy for them."""
    return _parts(past.instruction, past, scene)


def words_as_parts(instruction: str, scene: Scene) -> tuple[Part, ...] | None:
    """The clauses of an instruction of which there is no policy yet, or None if a word has no place."""
    return _parts(instruction, None, scene)


def _parts(instruction: str, past: Past | None, scene: Scene) -> tuple[Part, ...] | None:
    understood = understood_as(instruction, scene)
    if understood is None:
        return None
    pieces = [Piece(intent) for intent in understood.intents]
    if past is not None:
        written = _knobs(understood.intents, past.start, scene, understood.radius)
        present = {p.name: p.value for p in past.parameters}
        if set(written[1]) != set(present):
            return None
        pieces = [_turned(piece, names, written[1], present) for piece, names in zip(pieces, written[0], strict=True)]
    tokens = tokenize(instruction, scene)[0]
    clauses = split(tokens)
    if len(clauses) == 1:
        return (Part(instruction.strip(), tuple(pieces)),)
    texts = spans(instruction, clauses)
    counts = [len(parse(text, scene).intents) for text in texts]
    if sum(counts) != len(pieces):
        return (Part(instruction, tuple(pieces)),)
    parts = []
    for text, count in zip(texts, counts, strict=True):
        parts.append(Part(text, tuple(pieces[:count])))
        pieces = pieces[count:]
    return tuple(parts)


def worded(parts: Sequence[Part], start: Trajectory, scene: Scene, *, between: str = ", ") -> Wording | None:
    """Put parts together; None if the whole would not be read as its parts were.

    Knobs that were turned keep their values where the clause still has them.
    """
    text = between.join(part.text.strip(" .,;!?") for part in parts)
    understood = understood_as(text, scene)
    wanted = [piece for part in parts for piece in part.pieces]
    if understood is None or len(understood.intents) != len(wanted):
        return None
    if any(_bare(a) != _bare(b.intent) for a, b in zip(understood.intents, wanted, strict=True)):
        return None
    written = _knobs(understood.intents, start, scene, understood.radius)
    values: dict[str, Number] = {}
    for names, piece in zip(written[0], wanted, strict=True):
        for i, value in piece.turned:
            if i < len(names) and _kin(names[i], piece.knobs[i]):
                values[names[i]] = value
    return Wording(text, values)


def following(past: Past, scene: Scene, values: Mapping[str, Number]) -> dict[str, Number]:
    """The knobs that follow from others: their values when some are turned.

    What is near an object depends on how far the path is shifted; so the radius moves along, unless it
    was turned itself.
    """
    understood = understood_as(past.instruction, scene)
    if understood is None:
        return {}
    names, written = _knobs(understood.intents, past.start, scene, understood.radius)
    present = {p.name: p.value for p in past.parameters}
    if set(written) != set(present):
        return {}
    before, after = (
        _knobs(
            [_with_amounts(i, n, v) for i, n in zip(understood.intents, names, strict=True)],
            past.start,
            scene,
            understood.radius,
        )
        for v in (present, {**present, **values})
    )
    found: dict[str, Number] = {}
    for name, value in after[1].items():
        known = present.get(name) == before[1].get(name) or present.get(name) == written.get(name)
        if name not in values and isinstance(value, int | float) and known and value != present.get(name):
            found[name] = value
    return found


def _with_amounts(intent: Intent, names: Sequence[str], values: Mapping[str, object]) -> Intent:
    """A shift by what its knobs say."""
    present = [values.get(name) for name in names]
    if intent.action != "move" or len(names) < len(intent.directions):
        return intent
    amounts = [float(v) if isinstance(v, int | float) else None for v in present]
    return replace(intent, directions=tuple((word, amounts[i]) for i, (word, _) in enumerate(intent.directions)))


def spans(text: str, clauses: Sequence[Sequence[Token]]) -> list[str]:
    """The stretches of a text that clauses cover, as they were written."""
    found: list[str] = []
    at = 0
    for clause in clauses:
        places = places_of(text, clause, at)
        if places:
            at = places[-1][1]
        found.append(text[places[0][0] : at] if places else " ".join(t.text for t in clause))
    return found


def places_of(text: str, tokens: Sequence[Token], at: int = 0) -> list[tuple[int, int]]:
    """Where each of some consecutive tokens stands in a text, from a place on; empty if one cannot be found."""
    places: list[tuple[int, int]] = []
    for token in tokens:
        words = [re.escape(word) for word in token.text.split()]
        start = r"(?<![^\W_])" if token.text[:1].isalnum() else ""
        found = re.compile(start + r"[^\w]*".join(words), re.IGNORECASE).search(text, at)
        if found is None:
            return []
        places.append(found.span())
        at = found.end()
    return places


def _bare(intent: Intent) -> Intent:
    return replace(intent, text="")


def _kin(a: str, b: str) -> bool:
    """Whether two knobs mean the same: but for their number, the direction, or the object."""
    plain_a, plain_b = re.sub(r"_\d+$", "", a), re.sub(r"_\d+$", "", b)
    both = {plain_a.rsplit("_", 1)[-1], plain_b.rsplit("_", 1)[-1]}
    return plain_a == plain_b or both <= OPPOSITE.keys() or both == {"by"}


def _knobs(
    intents: Sequence[Intent], start: Trajectory, scene: Scene, radius: float | None
) -> tuple[list[list[str]], dict[str, object]]:
    """The names of the knobs that each intent gets, and what all are written with."""
    draft = Draft.of(Request("-", start, scene))
    once = {id(intent) for intent in intents_once(tuple(intents))}
    names: list[list[str]] = [[] for _ in intents]
    order = sorted((i for i, intent in enumerate(intents) if id(intent) in once), key=lambda i: RANK[intents[i].action])
    for i in order:
        intent, before = intents[i], set(draft.parameters)
        if radius is not None and intent.region.kind == "near" and intent.region.amount is None:
            intent = replace(intent, region=replace(intent.region, amount=radius))
        STEPS[intent.action](draft, intent)
        names[i] = [name for name in draft.parameters if name not in before]
    return names, {name: value for name, (value, _) in draft.parameters.items()}


def _turned(piece: Piece, names: list[str], written: Mapping[str, object], present: Mapping[str, object]) -> Piece:
    turned = [
        (i, value)
        for i, name in enumerate(names)
        if isinstance(value := present.get(name), int | float) and value != written[name]
    ]
    return replace(piece, knobs=tuple(names), turned=tuple(turned))
