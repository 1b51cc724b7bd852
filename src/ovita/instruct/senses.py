"""Word-sense disambiguation by context: "lower the speed" and "go lower"."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ovita.instruct.tokens import Token

DIRECTIONS = frozenset({"left", "right", "front", "back", "up", "down"})

UNKNOWN = "?"
"""The sense of a word that is meant in a way that has nothing to do with paths."""

PLAIN = ""
"""The sense of a word that asks for nothing here."""

ARTICLES = ("the", "a", "an", "its", "your", "that", "this", "both")

ASIDE = ("further", "farther", "sidestep", "swerve away", "veer away", "turn away", "steer away", "dodge")
"""Words of distance that only accompany a direction."""

BESIDE = frozenset(
    {"beside", "next to", "at", "by", "near", "alongside", "before", "after", "above", "over", "close to"}
)

AT_PLACES = frozenset("near start goal middle first last half third quarter waypoints before after over under".split())

TAKES = frozenset({"take", "takes", "taking", "need", "needs", "last"})

COMPARED = DIRECTIONS | {"closer", "slower", "faster", "fewer", "more", "away"}

COUNTED = frozenset({"speed", "distance", "count", "height", "waypoints", "goal"})


@dataclass(frozen=True)
class TokenContext:
    """A word of a clause with its surroundings.

    Args:
        clause: All tokens.
        i: Which one.
        present: The concepts and units of the clause, and "object".
    """

    clause: Sequence[Token]
    i: int
    present: frozenset[str]

    @property
    def text(self) -> str:
        """The word as written, lower case."""
        return self.clause[self.i].text.lower()

    @property
    def following(self) -> Token:
        """The next token that is no filler."""
        return next((t for t in self.clause[self.i + 1 :] if t.kind != "filler"), Token("filler", ""))

    @property
    def preceding(self) -> Token:
        """The token before that is no filler."""
        return next((t for t in reversed(self.clause[: self.i]) if t.kind != "filler"), Token("filler", ""))

    @property
    def behind(self) -> str:
        """The next word, articles left out."""
        return next((t.text.lower() for t in self.clause[self.i + 1 :] if t.text.lower() not in ARTICLES), "")

    @property
    def before(self) -> str:
        """The word right before, fillers included."""
        return self.clause[self.i - 1].text.lower() if self.i else ""

    @property
    def next_to_object(self) -> bool:
        """Whether an object follows at once, at most an article between."""
        rest = [t for t in self.clause[self.i + 1 : self.i + 3] if t.text.lower() not in ARTICLES]
        return bool(rest) and bool(rest[0].items)

    @property
    def counts(self) -> bool:
        """Whether the clause has a number without a unit."""
        return any(t.kind == "number" and not t.unit for t in self.clause)

    def has(self, *concepts: str) -> bool:
        """Whether the clause has one of these concepts or units."""
        return bool(self.present & set(concepts))

    @property
    def directed(self) -> bool:
        """Whether the clause has a direction and names no object."""
        return bool(DIRECTIONS & self.present) and not self.has("object")


def _numbered(p: TokenContext) -> bool:
    return any(t.kind == "number" for t in p.clause)


def _denied_degree(p: TokenContext) -> bool:
    """Whether a phrase such as "so fast" follows, which holds its negation already."""
    near = [t.text.lower() for t in p.clause[p.i + 1 : p.i + 5] if t.kind == "concept"]
    return any(text.startswith(("so ", "too ", "that ")) for text in near)


def _single(p: TokenContext) -> bool:
    """Whether one waypoint follows at once: "the last node"."""
    right = p.clause[p.i + 1] if p.i + 1 < len(p.clause) else None
    return right is not None and right.value == "waypoints" and not right.text.lower().endswith("s")


def _beside_place(p: TokenContext) -> bool:
    """Whether a place follows: "right beside the cup", "wait right at the goal", but not "right by 0.2"."""
    rest = [t for t in p.clause[p.i + 1 : p.i + 5] if t.text.lower() not in ARTICLES]
    measured = p.preceding.unit == "m"  # "5 cm right after the cup"
    if p.text != "right" or measured or p.behind not in BESIDE or len(rest) < 2:
        return False
    return bool(rest[1].items) or (rest[1].kind == "concept" and bool(p.present - {"right", *AT_PLACES}))


RUNNING = frozenset("fly drive run play follow traverse execute perform do travel trace walk".split())
"""Verbs of going along a path as a whole."""


def _run_through(p: TokenContext) -> bool:
    """Whether "backwards" is how a whole path is gone along: "fly it backwards", but not "shift it backwards"."""
    words = [t.text.lower() for t in p.clause[: p.i]]
    whole = p.before in ("it", "path", "trajectory", "route", "course")
    return whole and p.text.startswith("backward") and words[0] in RUNNING and not _numbered(p)


Sense = tuple[str, Callable[[TokenContext], bool], str]

NEIGHBOURS: tuple[Sense, ...] = (
    # "stop slowing down" takes something back
    ("stop", lambda p: p.i + 1 < len(p.clause) and p.clause[p.i + 1].text.lower().split()[0].endswith("ing"), UNKNOWN),
    # "up to the halfway point, go left"
    ("up", lambda p: p.i == 0 and p.text == "up" and p.behind == "to", "before"),
    # "continue straight ahead", "directly above the cup"
    ("front", lambda p: p.text == "ahead" and p.preceding.text.lower() == "straight" and p.has("extend"), PLAIN),
    ("straight", lambda p: p.following.value in ("over", "under", "near", "through"), PLAIN),
    # "fly it backwards"
    ("back", lambda p: _run_through(p), "reverse"),
    # "stop in front of the shelf"
    ("front", lambda p: p.before == "in" and p.behind == "of" and p.has("stop", "wait", "hold"), "near"),
    # "from waypoint 30 onwards"
    (
        "front",
        lambda p: p.text in ("onwards", "onward") and p.has("waypoints") and p.preceding.kind == "number",
        "onwards",
    ),
    # "reduce the top speed to 0.3 m/s"
    ("faster", lambda p: p.text in ("top speed", "high speed") and p.has("decrease", "lower"), "peak"),
    # "bring the speed down", "up to 0.4", "up the speed"
    ("up", lambda p: p.preceding.value == "speed" or p.following.value == "speed", "increase"),
    ("down", lambda p: p.preceding.value == "speed" or p.following.value == "speed", "decrease"),
    ("up", lambda p: p.behind == "to" and p.i + 2 < len(p.clause) and p.clause[p.i + 2].kind == "number", PLAIN),
    # "about 10 cm"
    ("around", lambda p: p.following.kind == "number", PLAIN),
    # "boost it up by 0.1"
    ("increase", lambda p: bool(DIRECTIONS & p.present) and not p.present & COUNTED, PLAIN),
    # "far slower"
    ("away", lambda p: p.text == "far" and p.following.value in COMPARED, "large"),
    # "not so fast"
    ("never", _denied_degree, PLAIN),
    # "over the last quarter", "over to the left", "go over"
    ("over", lambda p: p.following.value in DIRECTIONS | {"first", "last", "second", "whole"}, PLAIN),
    ("over", lambda p: p.text == "over" and not p.following.text, PLAIN),
    # "close the toolbox", "point the gripper down", "make the path half as long"
    ("near", lambda p: p.text == "close" and p.next_to_object, UNKNOWN),
    ("waypoints", lambda p: p.text == "point" and not p.preceding.text, UNKNOWN),
    ("duration", lambda p: p.text == "as long" and not TAKES & {t.text.lower() for t in p.clause[: p.i]}, UNKNOWN),
    # "0.1 further left", "hug the left", "stick to 0.3 m/s"
    ("away", lambda p: p.directed and p.text in ASIDE, PLAIN),
    ("closer", lambda p: not p.has("object") and p.has("speed", "m/s", *DIRECTIONS), PLAIN),
    # "the last node", "the 10 last waypoints"
    ("first", _single, "start"),
    ("last", _single, "goal"),
    ("start", lambda p: p.text.endswith(("points", "samples", "nodes")) and p.counts, "first"),
    ("goal", lambda p: p.text.endswith(("points", "samples", "nodes")) and p.counts, "last"),
    # "stay on the ground"
    ("ground", lambda p: not p.has("height", "over", "under", "distance", "m", "object", *DIRECTIONS), "down"),
    # "proceed to the left", "keep within the left", "go straight up"
    (
        "extend",
        lambda p: p.text in ("proceed", "proceeding", "go further") and p.directed and not p.has("goal", "after"),
        PLAIN,
    ),
    ("limit", lambda p: bool(DIRECTIONS & p.present) and not _numbered(p), PLAIN),
    (
        "straight",
        lambda p: (
            p.text == "straight" and p.following.value in DIRECTIONS and not (p.behind == "ahead" and p.has("extend"))
        ),
        PLAIN,
    ),
    # "between the ends", but "between waypoints 3 and 9"
    (
        "between",
        lambda p: not p.has("object") and not p.counts and not (p.text == "between" and p.has("m", "m/s")),
        "middle",
    ),
    # "the middle of the path", but "the middle of the cup and the plate"
    ("between", lambda p: p.text in ("middle of", "midpoint of") and not p.next_to_object, "middle"),
    # "right beside the cup", "twice as dense", "further than the goal"
    ("right", _beside_place, PLAIN),
    ("when", lambda p: p.text == "as" and p.preceding.value in ("double", "half"), PLAIN),
    ("no_closer", lambda p: p.following.value == "goal" and p.text.startswith(("further", "farther")), "beyond"),
    # "turn it by 30 degrees"
    ("turn", lambda p: p.has("deg"), "rotate"),
    # "past the cup, go faster", "crawl past the cup"
    ("pass", lambda p: p.text == "past" and (not p.preceding.text or p.preceding.value in ("after", "when")), "after"),
    # "hover for 3 s at waypoint 30", "end the motion above the plate"
    ("hover", lambda p: not p.has("object") and p.has("s", "step"), "wait"),
    ("stop", lambda p: p.text.startswith("end ") and p.has("over"), "goal"),
    # "next, go left"
    ("near", lambda p: p.text == "next" and not p.following.items, PLAIN),
)
"""Concept, when it has another sense, and the concept that it then is. The first that fits counts."""

PATIENT = frozenset(
    "move shift push pull put bring place carry transport drag haul slide transfer translate displace turn lay".split()
)
"""Verbs that, right before an object, ask to handle it, which no path does."""

HANDLED = frozenset("rotate tilt mirror resize noise raise lower drop shrink stretch reverse up turn".split())
"""Concepts that, said as a verb right before an object, ask the same."""

LIFTING = ("lift", "raise", "hoist", "elevate", "lift up", "heave")

BODY = frozenset("gripper hand tool camera wrist effector head nose body".split())
"""Parts of a robot that a path does not turn."""


def by_neighbours(place: TokenContext) -> str | None:
    """The sense of a token given its neighbours, or None."""
    token = place.clause[place.i]
    if token.kind == "object":
        return UNKNOWN if is_handled(place.clause, place.i) else None
    if token.kind != "concept":
        return None
    if token.value in ("rotate", "tilt", "turn") and place.behind in BODY:
        return UNKNOWN
    return next((becomes for concept, test, becomes in NEIGHBOURS if concept == token.value and test(place)), None)


def is_handled(clause: Sequence[Token], i: int) -> bool:
    """Whether the object at i is a verb's direct object: "move the cup", "rotate the box"."""
    j = i - 1
    while j >= 0 and clause[j].text.lower() in ARTICLES:
        j -= 1
    if j < 0 or any(t.kind != "filler" for t in clause[:j]):
        return False
    word, verb = clause[j].text.lower(), clause[j]
    if verb.kind == "filler":
        return word in PATIENT
    return verb.kind == "concept" and verb.value in HANDLED and (verb.value != "up" or word in LIFTING)


__all__ = ["CHANGES", "DIRECTIONS", "SENSES", "SPEED", "settle"]

SPEED = frozenset({"speed", "faster", "slower", "constant", "m/s", "duration"})
"""Concepts, and the unit, that make a clause one about speed."""

CHANGES = frozenset({"increase", "decrease", "more", "fewer", "faster", "slower", "lower", "raise", "acceleration"})

SENSES: tuple[tuple[str, frozenset[str], str], ...] = (
    ("lower", frozenset({"speed", "m/s", "count", "distance"}), "decrease"),
    ("lower", frozenset(), "down"),
    ("raise", frozenset({"speed", "m/s", "count"}), "increase"),
    ("raise", frozenset(), "up"),
    ("drop", frozenset({"m"}), "down"),
    ("drop", frozenset({"speed", "m/s", "count", "distance", "waypoints"}), "decrease"),
    ("drop", frozenset(), "down"),
    ("shrink", frozenset({"distance", "speed", "count"}), "decrease"),
    ("shrink", frozenset(), "resize"),
    ("stretch", frozenset({"distance", "object"}), "increase"),
    ("stretch", frozenset({"goal", "m"}), "extend"),
    ("stretch", frozenset(), "resize"),
    ("longer", frozenset({"distance"}), "more"),
    ("longer", frozenset({"m", "whole"}), "extend"),
    ("longer", frozenset(), "more"),
    ("resize", frozenset({"speed", "m/s"}), "multiply"),
    ("withdraw", frozenset({"object"}), "away"),
    ("withdraw", frozenset(), "back"),
    ("hold", frozenset({"s", "step"}), "wait"),
    ("hold", frozenset({*DIRECTIONS}), "stay"),
    ("hold", frozenset({"speed", "constant", "steady", "distance", "height", "m/s", "away", "near", "closer"}), "keep"),
    ("hold", frozenset(), "wait"),
    ("remain", frozenset({"step", "s"}), "wait"),
    ("remain", frozenset(), "stay"),
    ("steady", CHANGES | {"gradual"}, "gradual"),
    ("steady", frozenset(), "constant"),
    ("advance", frozenset({"goal", "closer", "object", "near", *DIRECTIONS}), ""),
    ("advance", frozenset(), "front"),
    ("creep", frozenset({"closer", "away", "toward", *DIRECTIONS}), "slight"),
    ("creep", frozenset(), "slower"),
    ("around", SPEED, "near"),
    ("count", frozenset({"speed", "m/s"}), ""),
)
"""Concept, what must stand in its clause (any of these concepts, units or "object"; nothing: in all other cases), and
the concept that it then is ("": a filler). The first that fits counts."""


def settle(clause: Sequence[Token]) -> list[Token]:
    """Give each word of a clause the sense that it has there."""
    present = {t.value for t in clause if t.kind == "concept"}
    present |= {t.unit for t in clause if t.kind == "number" and t.unit} | {"object" for t in clause if t.items}
    settled = []
    for i, token in enumerate(clause):
        sense = by_neighbours(TokenContext(clause, i, frozenset(present)))
        token = token if sense is None else _as(token, sense)
        for concept, company, becomes in SENSES:
            if token.kind == "concept" and token.value == concept and (not company or company & present):
                token = _as(token, becomes)
        settled.append(token)
    return _with_height(settled)


def _as(token: Token, concept: str) -> Token:
    if concept in (UNKNOWN, PLAIN):
        return Token("unknown" if concept == UNKNOWN else "filler", token.text)
    return replace(token, value=concept)


def _with_height(clause: list[Token]) -> list[Token]:
    """Turn "increase the altitude" into up; the word height itself says nothing more."""
    turned = {"increase": "up", "decrease": "down", "more": "up", "fewer": "down"}
    concepts = {t.value for t in clause if t.kind == "concept"}
    if "height" not in concepts or not concepts & {*turned, "up", "down"}:
        return clause
    return [
        Token("filler", t.text)
        if t.value == "height"
        else _as(t, turned[t.value])
        if t.kind == "concept" and t.value in turned
        else t
        for t in clause
    ]
