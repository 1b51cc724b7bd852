"""Split turns into clauses, drop, move or reverse these, and join them into one instruction."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from ovita.dialogue.feedback.resolution import FAMILY_OF_ACTION
from ovita.instruct.clauses import Reader, split
from ovita.instruct.draft import IntentDraft
from ovita.instruct.intents import WHOLE, Intent, Understood
from ovita.instruct.reading import read_instruction
from ovita.instruct.regions import read_region
from ovita.instruct.steps import RANK, STEPS, intents_once
from ovita.instruct.tokens import Token, tokenize
from ovita.paths.frame import OPPOSITE
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Turn

Number = float | int


@dataclass(frozen=True)
class TunedIntent:
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
class SpokenClause:
    """A clause: its words and its intents."""

    text: str
    pieces: tuple[TunedIntent, ...] = ()

    def turned(self, values: Mapping[str, Number]) -> SpokenClause:
        """The clause with knobs turned, by their names in its policy."""
        pieces = []
        for piece in self.pieces:
            new = {i: values[name] for i, name in enumerate(piece.knobs) if name in values}
            pieces.append(replace(piece, turned=tuple({**dict(piece.turned), **new}.items())))
        return SpokenClause(self.text, tuple(pieces))


@dataclass(frozen=True)
class Wording:
    """A composed instruction, and the parameter values tuned earlier."""

    instruction: str
    values: dict[str, Number]


def understood_as(text: str, scene: Scene) -> Understood | None:
    """What the built-in writer reads in a text, or None unless it understands every word and asks nothing back."""
    understood = read_instruction(text, scene)
    return understood if understood.intents and not (understood.unplaced or understood.question) else None


def parts_of(past: Turn, scene: Scene) -> tuple[SpokenClause, ...] | None:
    """The clauses of a turn, or None if the built-in writer would not write this policy for them."""
    return _parts(past.instruction, past, scene)


def words_as_parts(instruction: str, scene: Scene) -> tuple[SpokenClause, ...] | None:
    """The clauses of an instruction of which there is no policy yet, or None if a word has no place."""
    return _parts(instruction, None, scene)


def _parts(instruction: str, past: Turn | None, scene: Scene) -> tuple[SpokenClause, ...] | None:
    understood = understood_as(instruction, scene)
    if understood is None:
        return None
    pieces = [TunedIntent(intent) for intent in understood.intents]
    if past is not None:
        written = _knobs(understood.intents, past.start, scene, understood.radius)
        present = {p.name: p.value for p in past.parameters}
        if set(written[1]) != set(present):
            return None
        pieces = [_turned(piece, names, written[1], present) for piece, names in zip(pieces, written[0], strict=True)]
    tokens = tokenize(instruction, scene)[0]
    clauses = split(tokens)
    if len(clauses) == 1:
        return (SpokenClause(instruction.strip(), tuple(pieces)),)
    texts = spans(instruction, clauses)
    counts = [len(read_instruction(text, scene).intents) for text in texts]
    if sum(counts) != len(pieces):
        return (SpokenClause(instruction, tuple(pieces)),)
    parts = []
    for text, count in zip(texts, counts, strict=True):
        parts.append(SpokenClause(text, tuple(pieces[:count])))
        pieces = pieces[count:]
    return tuple(parts)


def worded(parts: Sequence[SpokenClause], start: Trajectory, scene: Scene, *, between: str = ", ") -> Wording | None:
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


def following(past: Turn, scene: Scene, values: Mapping[str, Number]) -> dict[str, Number]:
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
    """A shift with its current amounts."""
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
    """The span of each of some consecutive tokens in a text, searched from an offset; empty if one is missing."""
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
    draft = IntentDraft.of(start, scene)
    once = {id(intent) for intent in intents_once(tuple(intents))}
    names: list[list[str]] = [[] for _ in intents]
    order = sorted((i for i, intent in enumerate(intents) if id(intent) in once), key=lambda i: RANK[intents[i].action])
    for i in order:
        intent, before = intents[i], set(draft.parameters)
        if radius is not None and intent.region.kind == "near" and intent.region.amount is None:
            intent = replace(intent, region=replace(intent.region, amount=radius))
        STEPS[intent.action](draft, intent)
        names[i] = [name for name in draft.parameters if name not in before]
    return names, {p.name: p.value for p in draft.parameters.values()}


def _turned(
    piece: TunedIntent, names: list[str], written: Mapping[str, object], present: Mapping[str, object]
) -> TunedIntent:
    turned = [
        (i, value)
        for i, name in enumerate(names)
        if isinstance(value := present.get(name), int | float) and value != written[name]
    ]
    return replace(piece, knobs=tuple(names), turned=tuple(turned))


_REGION_LEADS = ("", "near ", "near the ", "when passing ", "in ", "in the ", "for ", "at ", "at the ")
_REGION_ENDS = (
    (re.compile(r"(?:(?:at|near|towards) )?(?:the )?(?:very )?(?:end|goal)(?: of .*)?"), "in the last quarter"),
    (re.compile(r"(?:(?:at|near) )?(?:the )?(?:very )?(?:start|beginning)(?: of .*)?"), "in the first quarter"),
)
_WORD_OF = {"front": "forward", "back": "backward"}


def moved(part: SpokenClause, words: str, scene: Scene) -> SpokenClause | None:
    """A clause moved to another part of the path, or None if it has no such wording."""
    if len(part.pieces) != 1:
        return None
    piece = part.pieces[0]
    action = _without_region(part, piece, scene)
    phrases = [lead + words for lead in _REGION_LEADS] if words else [""]
    phrases += [phrase for pattern, phrase in _REGION_ENDS if words and pattern.fullmatch(words)]
    for phrase in phrases:
        text = f"{action} {phrase}".strip()
        understood = understood_as(text, scene)
        if understood is None or len(understood.intents) != 1:
            continue
        intent = understood.intents[0]
        placed = intent.region != WHOLE if words else intent.region == WHOLE
        rest = replace(intent, region=piece.intent.region, text=piece.intent.text) == piece.intent
        if placed and rest and intent.region != piece.intent.region:
            return SpokenClause(text, (replace(piece, intent=intent),))
    return None


def _without_region(part: SpokenClause, piece: TunedIntent, scene: Scene) -> str:
    """The words of a clause without those that name a part of the path."""
    text = part.text
    for begin, end in reversed(_region_places(part, piece, scene)):
        text = text[:begin] + text[end:]
    return " ".join(text.split())


def region_words(part: SpokenClause, piece: TunedIntent, scene: Scene) -> str:
    """The words of a clause that name a part of the path."""
    return " ".join(part.text[begin:end] for begin, end in _region_places(part, piece, scene))


def _region_places(part: SpokenClause, piece: TunedIntent, scene: Scene) -> list[tuple[int, int]]:
    """Where those words stand."""
    clauses = split(tokenize(part.text, scene)[0])
    if piece.intent.region == WHOLE or len(clauses) != 1:
        return []
    clause = clauses[0]
    reader = Reader(clause)
    before = list(reader.taken)
    read_region(reader, speed=piece.intent.action == "speed")
    gone = [i for i, taken in enumerate(reader.taken) if taken and not before[i]]
    for i in list(gone):
        while i > 0 and clause[i - 1].kind == "filler" and clause[i - 1].text.lower() not in ("it", "go", "move"):
            i -= 1
            gone.append(i)
    places = places_of(part.text, clause)
    return [places[i] for i in sorted(set(gone))] if places else []


def replaced(part: SpokenClause, scene: Scene, word_for: Callable[[Token], str | None]) -> SpokenClause | None:
    """A clause with other words in place of some tokens; None if there is none, or it would not be understood."""
    text = part.text
    tokens = tokenize(text, scene)[0]
    places = places_of(text, tokens)
    done = False
    for token, (begin, end) in reversed(list(zip(tokens, places, strict=False))):
        word = word_for(token)
        if word is None:
            continue
        head, tail = text[:begin], text[end:]
        if word in OPPOSITE:
            if word not in ("left", "right"):
                head = re.sub(r"\b(?:to|towards|toward) the $", "", head)
            word = _WORD_OF.get(word, word)
        elif word.endswith((" to", " from")):
            tail = re.sub(r"^ (?:to|from|of)\b", "", tail)
        text, done = head + word + tail, True
    understood = understood_as(text, scene)
    if not done or understood is None or len(understood.intents) != len(part.pieces):
        return None
    pieces = [replace(piece, intent=intent) for piece, intent in zip(part.pieces, understood.intents, strict=True)]
    return SpokenClause(text, tuple(pieces))


def direction_of(token: Token) -> str:
    """The direction that a token names, or ""."""
    value = {"lower": "down", "raise": "up"}.get(token.value, token.value)
    return value if token.kind == "concept" and value in OPPOSITE else ""
