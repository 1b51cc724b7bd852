"""A clause being read: which of its tokens have been placed, and which words are left over."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from ovita.instruct.clauses import Clause
from ovita.instruct.neighbours import DIRECTIONS
from ovita.instruct.scale import Degree
from ovita.instruct.tokens import Token
from ovita.paths.scene import SceneObject

T = TypeVar("T")


class Reader:
    """Hands out a clause's tokens one meaning at a time and remembers what was taken."""

    def __init__(self, clause: Clause) -> None:
        self.tokens = clause
        self.taken = [t.kind in ("filler", "join", "break") for t in clause]

    def attempt(self, rule: Callable[[Reader], list[T]]) -> list[T]:
        """What a rule reads; a rule that reads nothing gives back every token that it took."""
        before = list(self.taken)
        found = rule(self)
        if not found:
            self.taken = before
        return found

    @property
    def text(self) -> str:
        """The clause as written."""
        return " ".join(t.text for t in self.tokens)

    def has(self, *concepts: str) -> bool:
        """Whether one of these concepts is in the clause and not yet taken."""
        return any(self.find(c) is not None for c in concepts)

    def find(self, concept: str) -> int | None:
        """Index of the first free token of that concept."""
        for i, token in enumerate(self.tokens):
            if token.kind == "concept" and token.value == concept and not self.taken[i]:
                return i
        return None

    def take(self, *concepts: str) -> bool:
        """Take every free token of these concepts; say whether there was one."""
        found = False
        for i, token in enumerate(self.tokens):
            if token.kind == "concept" and token.value in concepts and not self.taken[i]:
                self.taken[i] = found = True
        return found

    def untake(self, concept: str) -> None:
        """Give back the tokens of a concept."""
        for i, token in enumerate(self.tokens):
            self.taken[i] = self.taken[i] and token.value != concept

    def take_at(self, i: int) -> Token:
        """Take the token at i."""
        self.taken[i] = True
        return self.tokens[i]

    def after(self, i: int) -> int | None:
        """Index of the next token behind i that is not a filler, taken or not."""
        return next((j for j in range(i + 1, len(self.tokens)) if self.tokens[j].kind not in ("filler", "join")), None)

    def before(self, i: int) -> int | None:
        """Index of the token before i that is not a filler, taken or not."""
        return next((j for j in range(i - 1, -1, -1) if self.tokens[j].kind not in ("filler", "join")), None)

    def says(self, *texts: str) -> bool:
        """Whether one of these words stands in the clause as written, not yet taken."""
        return any(t.text.lower() in texts and not self.taken[i] for i, t in enumerate(self.tokens))

    def hears(self, *texts: str) -> bool:
        """Whether one of these words stands in the clause as written, taken or not."""
        return any(t.text.lower() in texts for t in self.tokens)

    def says_phrase(self, opening: str) -> bool:
        """Whether a phrase of the clause, taken or not, begins with this word: "twice around"."""
        return any(t.text.lower().split()[:1] == [opening] for t in self.tokens)

    def sided(self) -> bool:
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
                return self.take_at(i).number
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
            items += self.take_at(i).items
            i = self.after(i)
        return tuple(items)

    def objects(self) -> tuple[SceneObject, ...]:
        """Take all free objects of the clause."""
        found = [self.take_at(i).items for i, t in enumerate(self.tokens) if t.items and not self.taken[i]]
        return tuple(item for items in found for item in items)

    def numbers(self, units: Iterable[str]) -> list[int]:
        """Indices of the free numbers with one of these units."""
        allowed = tuple(units)
        return [i for i, t in enumerate(self.tokens) if t.kind == "number" and t.unit in allowed and not self.taken[i]]

    def number(self, *units: str) -> float | None:
        """Take the first free number with one of these units ("" is a bare number)."""
        found = self.numbers(units)
        return self.take_at(found[0]).number if found else None

    def share(self, *, smaller: bool) -> float | None:
        """Take a percentage as a factor on a size: "by 20 %" adds or takes it away, "to 20 %" is what is left."""
        for i in self.numbers(("%",)):
            kept = self.word_before(i) == "to"
            value = self.take_at(i).number
            return value if kept else max(1.0 - value, 0.01) if smaller else 1.0 + value
        return None

    def letter(self) -> str:
        """Take the name of a coordinate axis, x, y or z, or return ""."""
        for i, token in enumerate(self.tokens):
            if token.text.lower() in ("x", "y", "z") and not self.taken[i]:
                return self.take_at(i).text.lower()
        return ""

    def degree(self) -> Degree:
        """Take the words of degree and return what they say."""
        slight, large = self.take("slight"), self.take("large")
        return "slight" if slight else "large" if large else "moderate"

    def directions(self) -> tuple[tuple[str, float | None], ...]:
        """Take the direction words, each with the length that stands next to it."""
        found: list[tuple[str, float | None]] = []
        for i, token in enumerate(self.tokens):
            if token.kind != "concept" or token.value not in DIRECTIONS or self.taken[i]:
                continue
            self.taken[i] = True
            amount: float | None = None
            for j in (self.after(i), self.before(i)):
                if j is not None and not self.taken[j] and self.tokens[j].unit in ("", "m"):
                    if self.tokens[j].kind == "number" and self.word_before(j) != "to":
                        amount = self.take_at(j).number
                        break
            if not any(word == token.value for word, _ in found):
                found.append((token.value, amount))
        return tuple(found)

    def left_over(self) -> tuple[str, ...]:
        """The words that no meaning was found for, in their order."""
        return tuple(t.text for t, taken in zip(self.tokens, self.taken, strict=True) if not taken)
