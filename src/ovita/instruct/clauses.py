"""From tokens to clauses, and a clause being read: which of its tokens have been placed, and which are left over."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from ovita.instruct.scale import Degree
from ovita.instruct.senses import DIRECTIONS, SPEED, settle
from ovita.instruct.tokens import Token
from ovita.paths.scene import SceneObject

ACTIONS = DIRECTIONS | frozenset(
    """faster slower constant steady closer creep away withdraw stop wait hold extend smooth through over keep increase
    decrease double half lower raise drop toward more fewer longer multiply spiral circle eight zigzag wave hop hover
    mirror rotate tilt resize stretch shrink curvature straight average reverse noise quadrant trapezoid exponential
    never denser sparser ramp_up ramp_down limit no_closer sideways duration""".split()
)
"""Concepts that ask for something; a piece of a sentence without one belongs to its neighbour."""

PARTS = frozenset("part section portion phase segment stretch bit few leg piece of waypoint".split())
"""Words that make a part of the path of "first" and "last" rather than an order of doing."""

KEEPING = ("keeping", "leaving", "maintaining", "preserving", "while keeping", "holding")
CHANGED = frozenset("changing altering modifying touching affecting moving".split())

LOWEST = ("no lower than", "not below", "never below", "not under", "never under")

PLACED = frozenset("over first last second middle half third quarter waypoints when before after".split())
"""Concepts of which a piece only says where."""

Clause = tuple[Token, ...]

Piece = tuple[Clause, bool, bool]
"""Tokens, and whether a full stop or semicolon, or a "but", precedes them."""


def split(tokens: tuple[Token, ...]) -> list[Clause]:
    """Split a sentence's tokens into clauses at connectives and punctuation.

    A piece that asks for nothing itself ("when passing the cup", the second object of a list) is joined to the
    piece before it, or to the one after it if it comes first.
    """
    clauses: list[Clause] = []
    pending: Clause = ()
    for piece, hard, apart in _pieces(_without_order(tokens)):
        piece = _with_object(piece, clauses)
        if _asks(piece) or (hard and clauses and _is_statement(piece)):
            clauses.append(pending + piece)
            pending = ()
        elif clauses and not pending and _as_before(piece, clauses[-1]):
            clauses.append(tuple(t for t in clauses[-1] if t.value in TAKEN_OVER) + piece)
        elif clauses and not pending and not (apart or _bare_endpoint(piece)):
            clauses[-1] = clauses[-1] + piece
        elif clauses and not pending:
            clauses.append(piece)
        else:
            pending = pending + piece
    if pending:
        clauses.append(pending)
    return [tuple(settle(c)) for c in clauses]


def _without_order(tokens: tuple[Token, ...]) -> tuple[Token, ...]:
    """Take "first" and "second" at the head of a piece as the order of doing things, not as a part of the path."""
    kept = []
    for i, token in enumerate(tokens):
        heads = i == 0 or tokens[i - 1].kind in ("break", "join")
        if token.kind == "concept" and token.text.lower() in ("first", "second", "third", "last") and heads:
            behind = tokens[i + 1] if i + 1 < len(tokens) else None
            word = behind.text.lower().split()[0] if behind is not None else ""
            named = behind is not None and (
                behind.kind == "number" or behind.value in ("half", "quarter", "waypoints", "third")
            )
            orders = behind is not None and not named and word not in PARTS
            token = Token("filler", token.text) if orders else token
        kept.append(token)
    return tuple(kept)


def _pieces(tokens: tuple[Token, ...]) -> list[Piece]:
    pieces: list[Piece] = []
    current: list[Token] = []
    hard = apart = False
    for i, token in enumerate(tokens):
        separates = token.kind == "break" or (token.kind == "join" and not _lists(tokens, i))
        separates = separates or (token.text.lower() in ("while", "whilst") and _about_speed(tokens[i + 1 :]))
        separates = separates or _before_deed(tokens, i) or _before_kept(tokens, i)
        if token.value == "but" and i > 0 and tokens[i - 1].value == "whole" and _is_place(tokens[i + 1 :]):
            current.append(Token("concept", token.text, value="except"))  # "everywhere but near the goal"
            continue
        if not separates:
            if token.kind != "join":
                current.append(token)
            continue
        opens = token.value in ("keep", "never")
        if any(t.kind != "filler" for t in current):
            pieces.append((tuple(current), hard, apart))
            hard = apart = False
        current = [token] if opens else []
        hard = hard or token.value in (".", ";")
        apart = apart or token.value == "but"
    if any(t.kind != "filler" for t in current):
        pieces.append((tuple(current), hard, apart))
    return pieces


def _lists(tokens: tuple[Token, ...], i: int) -> bool:
    """Whether the connective at i joins two objects or two numbers: "the cup and the plate", "waypoints 3 and 9"."""
    before = next((t for t in reversed(tokens[:i]) if t.kind != "filler"), None)
    after = next((t for t in tokens[i + 1 :] if t.kind != "filler"), None)
    if before is None or after is None:
        return False
    if before.kind == "object" == after.kind or {before.value, after.value} == {"start", "goal"}:
        return True
    ranged = any(t.value == "between" for t in tokens[:i])
    return ranged and before.kind == "number" == after.kind and before.unit == after.unit


def _is_place(rest: Clause) -> bool:
    """Whether a place follows, rather than something to do."""
    following = next((t for t in rest if t.kind != "filler"), None)
    return following is not None and (
        bool(following.items) or following.value in ("goal", "start", "near", "first", "last")
    )


def _about_speed(rest: Clause) -> bool:
    """Whether what follows "while", up to the next mark, changes the speed rather than naming a part of the path."""
    until = next((i for i, t in enumerate(rest) if t.kind in ("break", "join")), len(rest))
    return any(t.value in SPEED or t.unit == "m/s" for t in rest[:until])


def _before_deed(tokens: tuple[Token, ...], i: int) -> bool:
    """Whether an "after" or "before" opens a deed of its own: "after moving everything left by 0.2"."""
    if tokens[i].value not in ("after", "before") or i + 1 >= len(tokens):
        return False
    rest = tokens[i + 1 :]
    until = next((k for k, t in enumerate(rest) if t.kind in ("break", "join")), len(rest))
    deed = rest[0].kind in ("filler", "concept") and rest[0].text.lower().endswith("ing")
    values = {t.value for t in rest[:until]}
    return deed and bool(values & DIRECTIONS) and not values & {"reach", "pass", "goal"} and i > 0


def _before_kept(tokens: tuple[Token, ...], i: int) -> bool:
    """Whether a "keeping" or "without" introduces an invariant: "keeping the start and the goal fixed"."""
    if i == 0 or tokens[i].text.lower() not in (*KEEPING, "without"):
        return False
    rest = tokens[i + 1 :]
    until = next((k for k, t in enumerate(rest) if t.kind == "break"), len(rest))
    words = {t.text.lower() for t in rest[:until]}
    paced = tokens[i].text.lower() == "without" and any(t.value in ("slower", "faster") for t in rest[:3])
    stays = {"same", "fixed", "unchanged", "untouched", "intact", "where", "place"}
    return paced or bool(words & stays or words & CHANGED)


def _asks(piece: Clause) -> bool:
    concepts = {t.value for t in piece if t.kind == "concept"}
    kept = "same" in concepts and concepts & {"keep", "start", "goal"}
    if kept or {t.text.lower() for t in piece} >= {"same", "path"}:
        return True
    if concepts <= PLACED and concepts & {"first", "last", "second", "middle"}:
        return False
    if _is_condition(piece):
        return False
    placed = any(t.items for t in piece) or concepts & {"over", "under"}
    if concepts & {"stay", "keep", "remain"} and placed and any(t.unit == "m" for t in piece):
        return True
    if concepts & ACTIONS:
        conditional = next((t for t in piece if t.kind != "filler"), None)
        alone = concepts & (ACTIONS - DIRECTIONS)
        return not (
            conditional is not None
            and conditional.value in ("when", "after", "before")
            and (not alone or (alone <= {"closer"} and concepts <= {conditional.value, "closer", "near"}))
            and not any(t.kind == "number" for t in piece)
            and len([t for t in piece if t.kind != "filler"]) <= 3
        )
    if {"after", "goal"} <= concepts:
        return any(t.kind != "filler" and t.value not in ("after", "goal", "reach") for t in piece)
    if "remain" in concepts and any(t.unit in ("s", "step") for t in piece):
        return True
    endpoint = bool(concepts & {"start", "goal"})
    if any(t.unit == "m/s" for t in piece) or any(t.text.lower() in LOWEST for t in piece):
        return True
    return (endpoint and (any(t.kind == "object" for t in piece) or "between" in concepts)) or (
        "speed" in concepts and any(t.kind == "number" for t in piece)
    )


def _is_condition(piece: Clause) -> bool:
    """Whether a piece only says when, by a place along a direction: "when higher than 1 m"."""
    said = [t for t in piece if t.kind != "filler"]
    compared = [t.value for t in said if t.kind == "concept"]
    where = set(compared) & {*DIRECTIONS, "over", "under"}
    return bool(
        compared[:1] == ["when"]
        and where
        and any(t.kind == "number" for t in said)
        and set(compared) <= {"when", "than", "at_least", "height", "more", "ground", "over", "under", *DIRECTIONS}
        and (set(compared) & {"than", "over", "under", "at_least"})
    )


def _with_object(piece: Clause, clauses: list[Clause]) -> Clause:
    """Add the object that "but never closer than 8 cm" leaves to the clause before."""
    near = any(t.value == "no_closer" for t in piece) and not any(t.items or t.unit == "m/s" for t in piece)
    named = [t for t in clauses[-1] if t.items] if clauses and near else []
    return (*piece, named[0]) if len(named) == 1 and any(t.kind == "number" for t in piece) else piece


TAKEN_OVER = ACTIONS | {"stay", "remain", "at_least", "at_most", "distance", "within", "no_closer", "speed"}
"""Concepts that a clause may leave to the one before: "stop 4 s at the cup and 2 s at the plate"."""


def _as_before(piece: Clause, last: Clause) -> bool:
    """Whether a piece has an amount and a place of its own, and asks for the same as the clause before it."""
    return any(t.value in TAKEN_OVER for t in last) and _measured(piece) == _measured(last) != ()


def _measured(piece: Clause) -> tuple[str, ...]:
    """The kind of the one amount of a piece that has one place too, or ()."""
    places = [t for t in piece if t.items or t.value in ("start", "goal")]
    amounts = [t.unit or "1" for t in piece if t.kind == "number"]
    amounts += ["degree" for t in piece if t.value in ("slight", "large")]
    return tuple(amounts) if len(places) == len(amounts) == 1 else ()


def _bare_endpoint(piece: Clause) -> bool:
    """A bare "and end there", which is no part of the clause before it."""
    concepts = {t.value for t in piece if t.kind == "concept"}
    related = concepts & {"near", "when", "reach", "before", "after", "within", "toward", "between"}
    return bool(concepts & {"start", "goal"}) and not related


def _is_statement(piece: Clause) -> bool:
    """A sentence of its own that only states a number, such as "Threshold is 0.3"."""
    return any(t.value == "threshold" for t in piece) and any(t.kind == "number" for t in piece)


T = TypeVar("T")


class Reader:
    """A cursor over a clause's tokens that records which ones were consumed."""

    def __init__(self, clause: Clause) -> None:
        self.tokens = clause
        self.taken = [t.kind in ("filler", "join", "break") for t in clause]

    def attempt(self, rule: Callable[[Reader], list[T]]) -> list[T]:
        """The result of a rule; a rule that finds nothing releases every token it consumed."""
        before = list(self.taken)
        found = rule(self)
        if not found:
            self.taken = before
        return found

    @property
    def text(self) -> str:
        """The clause as written."""
        return " ".join(t.text for t in self.tokens)

    def peek(self, *concepts: str) -> bool:
        """Whether one of these concepts is in the clause and not yet consumed."""
        return any(self.find(c) is not None for c in concepts)

    def find(self, concept: str) -> int | None:
        """Index of the first free token of that concept."""
        for i, token in enumerate(self.tokens):
            if token.kind == "concept" and token.value == concept and not self.taken[i]:
                return i
        return None

    def consume(self, *concepts: str) -> bool:
        """Consume every free token of these concepts; return whether there was one."""
        found = False
        for i, token in enumerate(self.tokens):
            if token.kind == "concept" and token.value in concepts and not self.taken[i]:
                self.taken[i] = found = True
        return found

    def release(self, concept: str) -> None:
        """Release the tokens of a concept."""
        for i, token in enumerate(self.tokens):
            self.taken[i] = self.taken[i] and token.value != concept

    def consume_at(self, i: int) -> Token:
        """Consume the token at i."""
        self.taken[i] = True
        return self.tokens[i]

    def after(self, i: int) -> int | None:
        """Index of the next token behind i that is not a filler, taken or not."""
        return next((j for j in range(i + 1, len(self.tokens)) if self.tokens[j].kind not in ("filler", "join")), None)

    def before(self, i: int) -> int | None:
        """Index of the token before i that is not a filler, taken or not."""
        return next((j for j in range(i - 1, -1, -1) if self.tokens[j].kind not in ("filler", "join")), None)

    def peek_word(self, *texts: str) -> bool:
        """Whether one of these words is in the clause, as written, and not yet consumed."""
        return any(t.text.lower() in texts and not self.taken[i] for i, t in enumerate(self.tokens))

    def any_word(self, *texts: str) -> bool:
        """Whether one of these words is in the clause, as written, consumed or not."""
        return any(t.text.lower() in texts for t in self.tokens)

    def peek_phrase(self, opening: str) -> bool:
        """Whether a phrase of the clause, taken or not, begins with this word: "twice around"."""
        return any(t.text.lower().split()[:1] == [opening] for t in self.tokens)

    def names_a_side(self) -> bool:
        """Whether a direction only names a side: "from the left", "the right side of the plate"."""
        for i, token in enumerate(self.tokens):
            if token.kind == "concept" and token.value in DIRECTIONS and not self.taken[i]:
                before = [t.text.lower() for t in self.tokens[max(i - 2, 0) : i]]
                noun = token.text.lower() in ("descent", "ascent", "climb")  # "on the descent"
                if not noun and ("side" in token.text.lower() or before[:1] in (["from"], ["on"])):
                    return True
        return False

    def target(self) -> float | None:
        """Take a length to reach, "to 0.5"; not "by 0.5"."""
        for i in self.numbers(("", "m")):
            if self.word_before(i) == "to":
                return self.consume_at(i).number
        return None

    def word_before(self, i: int) -> str:
        """The word right before token i, lower case, fillers included."""
        return self.tokens[i - 1].text.lower() if i > 0 else ""

    def target_ahead(self) -> bool:
        """Whether a free length is one to reach, "to 0.5"."""
        return any(self.word_before(i) == "to" for i in self.numbers(("", "m")))

    def objects_from(self, i: int | None) -> tuple[SceneObject, ...]:
        """Take the list of free objects that begins at token i ("the cup and the plate")."""
        items: list[SceneObject] = []
        while i is not None and self.tokens[i].items and not self.taken[i]:
            items += self.consume_at(i).items
            i = self.after(i)
        return tuple(items)

    def objects(self) -> tuple[SceneObject, ...]:
        """Take all free objects of the clause."""
        found = [self.consume_at(i).items for i, t in enumerate(self.tokens) if t.items and not self.taken[i]]
        return tuple(item for items in found for item in items)

    def numbers(self, units: Iterable[str]) -> list[int]:
        """Indices of the free numbers with one of these units."""
        allowed = tuple(units)
        return [i for i, t in enumerate(self.tokens) if t.kind == "number" and t.unit in allowed and not self.taken[i]]

    def number(self, *units: str) -> float | None:
        """Take the first free number with one of these units ("" is a bare number)."""
        found = self.numbers(units)
        return self.consume_at(found[0]).number if found else None

    def share(self, *, smaller: bool) -> float | None:
        """Take a percentage as a factor on a size: "by 20 %" adds or takes it away, "to 20 %" is what is left."""
        for i in self.numbers(("%",)):
            kept = self.word_before(i) == "to"
            value = self.consume_at(i).number
            return value if kept else max(1.0 - value, 0.01) if smaller else 1.0 + value
        return None

    def letter(self) -> str:
        """Take the name of a coordinate axis, x, y or z, or return ""."""
        for i, token in enumerate(self.tokens):
            if token.text.lower() in ("x", "y", "z") and not self.taken[i]:
                return self.consume_at(i).text.lower()
        return ""

    def degree(self) -> Degree:
        """Take the words of degree and return what they say."""
        slight, large = self.consume("slight"), self.consume("large")
        return "slight" if slight else "large" if large else "moderate"

    def directions(self) -> tuple[tuple[str, float | None], ...]:
        """Consume the direction words, each with the length next to it."""
        found: dict[str, float | None] = {}
        for i, token in enumerate(self.tokens):
            if token.kind != "concept" or token.value not in DIRECTIONS or self.taken[i]:
                continue
            self.taken[i] = True
            amount = found.get(token.value)
            for j in (self.after(i), self.before(i)) if amount is None else ():  # a second amount is left over
                if j is not None and not self.taken[j] and self.tokens[j].unit in ("", "m"):
                    if self.tokens[j].kind == "number" and self.word_before(j) != "to":
                        amount = self.consume_at(j).number
                        break
            found[token.value] = amount
        return tuple(found.items())

    def left_over(self) -> tuple[str, ...]:
        """The words that no meaning was found for, in their order."""
        return tuple(t.text for t, taken in zip(self.tokens, self.taken, strict=True) if not taken)
