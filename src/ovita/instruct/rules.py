# ruff: noqa: E501
"""The rules reader: every clause is matched against the table of frames; the reading that leaves the fewest words wins.

Text becomes chunks, chunks become constituents, constituents become clauses. A clause may end at any pause or
conjunction; over all ways to cut the sentence the one with the least cost wins, where a word that nobody took costs
most. What a clause leaves open is taken from the clauses before it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from typing import Any

from ovita.instruct import frames as F
from ovita.instruct.chunks import Build, Chunk, chunks, kinds, spoken
from ovita.instruct.degrees import extent_of
from ovita.instruct.fillers import FREE, LIMITING, Constituents, parts, weight
from ovita.instruct.frames import Quantity
from ovita.instruct.numerals import bare_unit
from ovita.instruct.patterns import NEARBY, PATTERNS, QUANTITIES
from ovita.instruct.senses import COMPARED, DOING, SIDEWAYS
from ovita.instruct.table import ROWS, Match, frame_of, match
from ovita.instruct.together import (
    added,
    afterwards,
    aimed,
    goes_on,
    improper,
    of_the_end,
    placed,
    settled,
    shared,
    unit_of,
    within,
)
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array

GROUPS = {
    "LENGTH": "Qm", "ANYQ": "Qm|Qv|Qa|Qs|Qdeg|Qpc|Qx|Qstep|Qn", "SHARE": "Qpc|half|third|quarter|tenth|fifth",
    "SPAN": "Qm|Qs|Qpc|Qstep|half|third|quarter|tenth|fifth", "AT": "at|by|on|in|near|around|over|within|along",
    "HIGHER": "up|raise|over|height", "LOWER": "down|lower|under", "FIRST": "first|1st", "LAST": "last|nth", "END": "start|goal|ends", "LINK": "to|thru|before",
    "DIR": "left|right|front|back|up|down", "BEFORE_OBJ": "at|by|on|in|near|around|over|within|along|to|toward|from|of|off|than|under|thru|with|for",
    "FLIPS": "touch|avoid|left|right|front|back|up|down|closer|near|farther|faster|slower|larger|smaller|raise|lower|wait|"
             "more_curve|less_curve|inc|dec",
}  # fmt: skip


@dataclass(frozen=True)
class Pattern:
    """A row of classes, what must follow it if it ends in "(?=...)" or "(?!...)", and what it becomes."""

    build: Build
    regex: re.Pattern[str]


def _pattern(classes: str, build: Build) -> Pattern:
    pieces = []
    named, _, ahead = classes.partition(" (?")
    for piece in named.split():
        repeat = piece[-1] if piece[-1] in "?*+" else ""
        names = "|".join(GROUPS.get(name, name) for name in piece.removesuffix(repeat).split("|"))
        pieces.append(f"(?:(?:{names}) ){repeat}")
    return Pattern(build, re.compile(r"(?<!\S)" + "".join(pieces) + ("(?" + ahead if ahead else "")))


_PATTERNS = tuple(_pattern(classes, build) for classes, build in PATTERNS)


def constituents(found: Sequence[Chunk], extent: float | None = None) -> list[Chunk]:
    """Chunks put together by the patterns, without the words that ask for nothing.

    Args:
        found: The chunks of an utterance.
        extent: Diagonal of the path's bounding box [m], or None.
    """
    row = typed([c for c in found if c.kind not in ("filler", "approx")], extent)
    row = [replace(c, kind=_preposition_of_past(row[:i])) if c.kind == "past" else c for i, c in enumerate(row)]
    text = _classes(row)
    for pattern in _PATTERNS:
        made = _rewritten(row, text, pattern)
        if made is not row:
            row, text = made, _classes(made)
    return row


def _classes(row: Sequence[Chunk]) -> str:
    return "".join([c.kind + " " for c in row])


def turned(found: Sequence[Chunk]) -> list[Chunk]:
    """The words that others turn round, as what they come to: "too close" as farther, "no rush" as slower."""
    row = [c for c in constituents(found) if c.value in ("flipped", "denied")]
    return [c for c in row if c.value == "flipped" or (c.kind == "slower" and c.text.lower().split()[-1] in HASTE)]


HASTE = frozenset(
    "fast quick quickly rapid rapidly swift swiftly hasty hastily rush rushing hurry hurrying race racing".split()
)
"""Manners whose denial asks for less speed; "do not speed up" and "never faster" ask for no change."""


def _preposition_of_past(before: Sequence[Chunk]) -> str:
    """What "past" means behind some constituents.

    "Hurry past it" and "half speed past it" are by it, "left past it" a side on which to pass it; any other "past it" is what comes after it.
    """
    if not {"faster", "slower", "creep", "speed", "Qv", "pass", "keep", "constant"}.isdisjoint(kinds(before[-2:])):
        return "by"
    sided = bool(before) and before[-1].kind in ("left", "right")
    return "pass" if sided and "path" not in kinds(before) else "after"


def _counted_unit(before: Sequence[Chunk], behind: Sequence[Chunk]) -> str:
    """The class of a bare number by what stands before and behind it."""
    early, late = (" ".join(["", *kinds(part), ""]) for part in (before, behind))
    return next((kind for kind, b, a in COUNTED_UNITS if b.match(early) and a.match(late.lstrip())), "Qn")


def _rewritten(row: list[Chunk], text: str, pattern: Pattern) -> list[Chunk]:
    """Chunks with what a pattern finds in the text of their classes put together; the same list where it is nothing."""
    if pattern.regex.search(text) is None:
        return row
    made: list[Chunk] = []
    at = 0
    for hit in pattern.regex.finditer(text):
        begin, end = (text.count(" ", 0, place) for place in hit.span())
        chunk = pattern.build(row[begin:end]) if end > begin >= at else None
        if chunk is not None:
            made += [*row[at:begin], *(chunk if isinstance(chunk, list) else [chunk])]
            at = end
    return made + row[at:]


LENGTHS = (
    "within|left|right|front|back|up|down|raise|lower|closer|"
    "farther|distance|gap|threshold|extend|hop|hover|height|radius|size|plus|minus"
)
NO_COUNT = "(?!waypoints|times|turns|laps|waves|double)"
COUNTED_UNITS = tuple(
    (kind, re.compile(rf"(?:.* )?(?:{before}) $"), re.compile(after))
    for kind, before, after in (
        ("Qn", r"first|1st|last|nth|every|waypoints|(?:waypoints|from|between) Qn (?:to|and|thru|before)", ""),
        ("Qx", r"(?:multiply|resize)(?: \S+){0,4} by", ""),
        ("Qm", r"(?:keep|never|wait) (?:over|under|up|down)", NO_COUNT),
        ("Qv", r"(?:speed|vmax|vmin|constant)(?: (?:of|to|at|max|min|at_most|at_least|limit))*", NO_COUNT),
        ("Qm", rf"(?:{LENGTHS})(?: (?:of|by|to|at|with|in|path|whole|max|min|at_most|at_least|distance))*", NO_COUNT),
        ("Qv", ".*", "speed"),
        ("Qm", ".*", rf"(?:from|off|ground|{LENGTHS})"),
    )
)
"""What a number without a unit counts, by what stands before and behind it: "left by 0.2", "0.3 away from it"."""


def typed(row: list[Chunk], extent: float | None) -> list[Chunk]:
    """Give bare numbers the kind that what stands beside them calls for, and its unit where that is a length.

    Args:
        row: A clause in chunks.
        extent: Diagonal of the path's bounding box [m], or None.
    """
    known = next((factor for chunk in row if (factor := unit_of(chunk))), None)
    made = list(row)
    for i, item in enumerate(row):
        if item.kind != "Qn" or item.q is None or not (item.q.said or known):
            continue
        kind = _counted_unit(made[:i], row[i + 1 :])
        factor = bare_unit(item.q.value, known, extent)
        q = {
            "Qm": Quantity(item.q.value * factor, "m", "by", item.q.said + "m" if factor == 1.0 else ""),
            "Qv": replace(item.q, unit="m/s", said=item.q.said + "m/s"),
            "Qx": replace(item.q, unit="x", said=item.q.said + "x"),
        }
        made[i] = replace(item, kind=kind, q=q.get(kind, item.q))
    return made


PAUSES = frozenset({"comma", "dot", "and", "because", "correct"})
STRENGTH = {"": -1, "comma": 0, "and": 1, "correct": 1, "dot": 2, "because": 3}
LONGEST = 5
"""Pieces between pauses that one clause may hold."""


JOINT, VERB = 0.4, 1.2
"""What it costs to take a further piece into a clause, and one that begins with a verb or could stand alone."""


@dataclass(frozen=True)
class Stretch:
    """What stands between two pauses.

    Args:
        items: Its constituents.
        opening: The pause before it.
        words: Everything that was said in it.
        first: The word that it begins with.
    """

    items: tuple[Chunk, ...]
    opening: str
    words: frozenset[str] = frozenset()
    first: str = ""

    @cached_property
    def kinds(self) -> frozenset[str]:
        """The classes of its constituents."""
        return frozenset(kinds(self.items))


@dataclass(frozen=True)
class ReadClause:
    """What stands in a sentence for one frame.

    Args:
        match: The row that reads it, and its slots; None where nothing reads it.
        items: Its constituents.
        cost: Of this reading.
        opening: The pause before it.
        words: Everything that was said in its first piece, and a colon behind that.
    """

    match: Match | None
    items: tuple[Chunk, ...]
    cost: float
    opening: str = ""
    words: frozenset[str] = frozenset()


def read(text: str, scene: Scene, positions: Array | None = None, earlier: Sequence[F.SemanticFrame] = ()) -> F.Reading:
    """What an utterance asks for.

    Args:
        text: As it was said or typed.
        scene: Whose objects it may name.
        positions: The path (N, 3) [m], for phrases such as "the object nearest to the goal".
        earlier: Frames of the turns before, for "there" and for what the utterance leaves open.
    """
    return reader(scene, positions)(text, earlier)


def reader(scene: Scene, positions: Array | None) -> Callable[[str, Sequence[F.SemanticFrame]], F.Reading]:
    """What reads utterances, alone and after earlier frames; what these do not change is worked out once for both.

    Args:
        scene: As for `read`.
        positions: As for `read`.
    """

    @cache
    def cut(text: str) -> tuple[Sequence[Chunk], tuple[str, ...], Sequence[ReadClause]]:
        found, notes = chunks(text, scene, positions)
        row = constituents(_arriving(_with_pauses(found)), extent_of(positions))
        pieces = _pieces(row, found)
        clauses = _cut(pieces)
        if not any(clause.match for clause in clauses):
            clauses = _cut([replace(piece, opening="") for piece in pieces])
        return found, notes, clauses

    def read_after(text: str, earlier: Sequence[F.SemanticFrame]) -> F.Reading:
        found, notes, clauses = cut(text)
        reading = _reading(clauses, notes, earlier)
        named = [(c.names, c.span) for c in found if c.kind == "OBJ"]
        return replace(reading, frames=aimed(reading.frames, spoken(text), named))

    return read_after


def _arriving(found: list[Chunk]) -> list[Chunk]:
    """Get to the shelf without coming near the dog: where to end, and what to keep away from on the way."""
    row = [c for c in found if c.kind not in ("filler", "approx", "path")]
    if len(row) < 4 or row[1].kind != "OBJ":
        return found
    going = row[0].kind == "to" or row[0].text.lower().startswith(("reach", "arrive"))
    behind = [c for c in row[2:] if c.kind not in ("and", "comma", "where")]
    if going and behind[0].kind in ("never", "avoid", "farther", "clear", "keep"):
        return [replace(row[0], kind="endup"), row[1], Chunk("and", "", row[1].span), *behind]
    return found


SETTLED = QUANTITIES | frozenset("OBJ left right front back up down start goal ends path".split())
"""Classes after which a participle begins something new: "to the left keeping the speed"."""


def _with_pauses(found: Sequence[Chunk]) -> list[Chunk]:
    """Chunks with a pause before a participle, and before the speed at which something is done."""
    row: list[Chunk] = []
    run = not WORDS_OF_RUNNING.isdisjoint(w for c in found for w in c.text.lower().split())
    for i, chunk in enumerate(found):
        ahead = found[i + 1 : i + 4]
        if chunk.kind == "backwards":
            chunk = replace(chunk, kind="reverse" if run else "back")
        if row and row[-1].kind in SETTLED and _begins(chunk, ahead):
            row.append(Chunk("and", "", (chunk.span[0], chunk.span[0])))
        row.append(chunk)
    return row


def _begins(chunk: Chunk, ahead: Sequence[Chunk]) -> bool:
    """Whether a chunk begins something new: "keeping the speed", "at a constant speed"."""
    if chunk.kind in ("at", "with"):
        return not {"constant", "speed", "Qv"}.isdisjoint(kinds(ahead))
    return _first(chunk).endswith("ing") and chunk.kind in PARTICIPLES


def _first(chunk: Chunk) -> str:
    return chunk.text.lower().partition(" ")[0]


WORDS_OF_RUNNING = frozenset("run do play same whole lot".split())
"""With these words "backwards" is an order, not a direction."""

PARTICIPLES = frozenset(
    "filler faster slower brake accel keep up down raise lower closer farther smooth constant".split()
)


def _pieces(row: Sequence[Chunk], spoken: Sequence[Chunk]) -> list[Stretch]:
    """What stands between the pauses, each with the pause before it and the words that were said in it."""
    found: list[tuple[list[Chunk], str, int]] = []
    opening, items, begin = "", list[Chunk](), 0
    for chunk in row:
        pause = chunk.kind in PAUSES
        if items and (pause or _stands_apart(chunk)):
            found.append((items, opening, begin))
            opening, items, begin = "" if pause else "dot", [], chunk.span[0]
        if pause:
            opening = max(opening, chunk.kind, key=lambda kind: STRENGTH[kind])
        else:
            items.append(chunk)
    found += [(items, opening, begin)] if items else []
    ends: list[float] = [*(begin for _, _, begin in found[1:]), float("inf")]
    return [_stretch(spoken, *piece, end) for piece, end in zip(found, ends, strict=False)]


def _stands_apart(chunk: Chunk) -> bool:
    """Whether something new begins without a pause: "go left without touching the cup"."""
    return chunk.kind in ("keep", "clear", "farther") and chunk.text.lower().startswith(("without", "not "))


def _stretch(spoken: Sequence[Chunk], items: Sequence[Chunk], opening: str, begin: int, end: float) -> Stretch:
    """Some constituents with the words that were said from one place to another."""
    said = [(w, c.kind) for c in spoken if begin <= c.span[0] < end for w in c.text.lower().split()]
    first = next((word for word, kind in said if kind not in PAUSES), "")
    items = [replace(items[0], apart=bool(opening)), *items[1:]]
    return Stretch(tuple(items), opening, frozenset(word for word, _ in said), first)


def _cut(pieces: Sequence[Stretch]) -> list[ReadClause]:
    """The cheapest way to cut the pieces into clauses."""
    best: list[tuple[float, list[ReadClause]]] = [(0.0, [])]
    for end in range(1, len(pieces) + 1):
        options = []
        for begin in range(max(0, end - LONGEST), end):
            span = pieces[begin:end]
            if not any(piece.opening in ("dot", "because") or _tells(piece) for piece in span[1:]):
                clause = _clause(tuple(item for piece in span for item in piece.items), span)
                cost, before = best[begin]
                options.append((cost + clause.cost + _joint(span), [*before, clause]))
        best.append(min(options, key=lambda option: option[0]))
    return best[-1][1]


def _joint(span: Sequence[Stretch]) -> float:
    """What it costs to take several pieces as one clause."""
    if len(span) == 1:
        return 0.0
    asks = not span[0].kinds <= PLACING | FREE
    verbs = sum(asks and piece.first in VERBS for piece in span[1:])
    return JOINT * (len(span) - 1) + VERB * (verbs + _apart(span))


def _apart(span: Sequence[Stretch]) -> bool:
    """Whether several pieces are several wishes: of two places, of their own things, or each complete."""
    places = sum(not piece.kinds.isdisjoint(PLACING | {"turns"}) for piece in span)
    own = any(map(_names_its_own, span[1:])) or any(map(_is_a_limit, span))
    again = COMPARED.intersection(*(piece.kinds for piece in span))
    return places > 1 or own or (not again and all(map(_complete, span)))


def _complete(piece: Stretch) -> bool:
    """Whether a piece says by itself all that it is about; "and left by 3 cm" goes on with what was said."""
    if piece.first in WHEN or (piece.first not in VERBS and piece.kinds <= BARE):
        return False
    clause = _clause(piece.items, [piece])
    return clause.match is not None and not (clause.match.unread or clause.match.missing)


def _clause(items: tuple[Chunk, ...], span: Sequence[Stretch]) -> ReadClause:
    """The best reading of a clause, or that nothing reads it."""
    said = frozenset(kinds(items))
    found = [] if _tells(span[0]) else [m for row in ROWS if (m := match(row, items, said)) is not None]
    best = min(found, key=lambda m: m.cost, default=None)
    nothing = sum(map(weight, items))
    cost = nothing if best is None else best.cost
    if best is not None and sum(map(_placed_by_itself, span)) > 1:
        cost += nothing  # "left at the start and right at the end" is said of two places
    listing = {":"} & {word for piece in span[1:] for word in piece.words}
    return ReadClause(best, items, cost, span[0].opening, span[0].words | listing)


STATED = frozenset(
    "it's its it’s that's thats you're youre they're theyre he's she's we're i'm im there's theres".split()
)
"""Words that begin how something is."""


def _tells(piece: Stretch) -> bool:
    """Whether a piece says how something is, and not that it is too much: "you're crowding her, give her room"."""
    ending = {"it": "s", "this": "s"}.get(piece.first, "ing" if piece.first in STATED else "")
    complains = ending and any(c.kind in SUFFERED and c.text.lower().endswith(ending) for c in piece.items)
    plain = all(c.kind not in QUANTITIES | PLACING and c.value != "flipped" for c in piece.items)
    return bool(complains) or (piece.first in STATED and plain)


SUFFERED = frozenset("faster slower closer shake wave".split())
"""Classes of verbs that say what is wrong where somebody says it of the path: "you're dawdling", "it hugs the wall"."""


def _is_a_limit(piece: Stretch) -> bool:
    """Whether a piece is a bound on the height, and not where something else is to be: "never above 30 cm"."""
    return kinds(piece.items) == ["Hq"] and not LIMITING.isdisjoint(piece.words)


def _names_its_own(piece: Stretch) -> bool:
    """Whether a piece first says of what, or where: "and near the cup raise it", "and the goal up by 5 cm"."""
    first, said = piece.items[0], piece.kinds
    about = bool(said & {"whole", "rest"}) and said.isdisjoint(PLACING | {"obj"})
    opens = about or _places(piece.items) or (first.kind == "end" and not first.value[1])
    return opens and not said.isdisjoint(DOING | SIDEWAYS)


def _placed_by_itself(piece: Stretch) -> bool:
    """Whether a piece says both what is to be done and where."""
    where = [c for c in piece.items if c.kind in PLACING or (c.kind in ("end", "obj") and c.value in WHERE)]
    return bool(where) and not piece.kinds.isdisjoint(DOING)


WHEN = frozenset("if when where while whenever wherever once as".split())
BARE = frozenset("left right front back up down raise lower by to Qm Qn slight large".split())
"""Words with which a piece begins that says where, and classes that say a direction and how far."""

VERBS = frozenset(
    """go move shift walk drive fly travel bring put push pull take make set get let translate displace relocate offset
    finish begin end start come head run keep maintain leave stop wait remain raise lower lift drop slow speed""".split()
)
"""Words with which a piece begins a sentence of its own."""

PLACING = frozenset("part point within_of pair here Hq".split())
"""Classes that say where."""

WHERE = (*NEARBY, *((end, by) for end in ("start", "goal") for by in NEARBY))
"""Prepositions with which an object or an end says where."""


class _ClauseReader:
    """Reads clauses one after the other; what one leaves open is taken from those before it."""

    def __init__(self, earlier: Sequence[F.SemanticFrame]) -> None:
        self.earlier = earlier
        self.made: list[F.SemanticFrame] = []
        self.unread: list[str] = []
        self.question = ""
        self.asked: tuple[str, ...] = ()
        self.before: ReadClause | None = None
        self.lead: ReadClause | None = None

    def take(self, clause: ReadClause) -> None:
        """Read a clause."""
        if choice := next((c for c in clause.items if c.kind == "CHOICE"), None):
            self.question, self.asked = _which(choice), choice.names
        if only := _only(clause, self.made):
            self.made[-1] = replace(self.made[-1], part=only)
            return
        left = clause.match.unread if clause.match else clause.items
        self.unread += [c.text for c in left if c.kind not in FREE | {"threshold"}]
        if clause.match is not None:
            self.fill(clause, clause.match)

    def fill(self, clause: ReadClause, match: Match) -> None:
        """Add the frame of a clause, or ask for what it leaves open."""
        slots, open_ = _inherited(match, [*self.earlier, *self.made])
        if open_:
            self.question = self.question or _question(open_[0])
            return
        frame = frame_of(match, slots, clause.items)
        if frame is None:
            self.unread += [c.text for c in clause.items]
            return
        led = self.lead is not None and _is_led(clause, self.lead)
        frame = placed([*self.earlier, *self.made], _after(frame, clause, self.before, self.made, led))
        self.lead = clause if _places(clause.items) else self.lead if led else None
        self.made, self.before = added(self.made, frame), clause


def _reading(clauses: Sequence[ReadClause], notes: tuple[str, ...], earlier: Sequence[F.SemanticFrame]) -> F.Reading:
    """What clauses ask for."""
    it = _ClauseReader(earlier)
    for clause in clauses:
        it.take(clause)
    radius = next((c.number.value for clause in clauses for c in clause.items if c.kind == "threshold" and c.q), None)
    frames = tuple(within(frame, radius) for frame in settled(it.made))
    return F.Reading(
        frames, unread=tuple(it.unread), question=it.question, asked=it.asked, notes=notes,
        improper=improper(frames),
    )  # fmt: skip


def _after(
    frame: F.SemanticFrame, clause: ReadClause, before: ReadClause | None, made: Sequence[F.SemanticFrame], led: bool
) -> F.SemanticFrame:
    """A frame with what its clause takes from the one before: its part of the path, its end, or where it waits."""
    if before is None or not made:
        return frame
    if led or (clause.opening == "and" and "them" in clause.words):
        frame = shared(made, frame)
    if clause.opening == "and" and "it" in clause.words:
        frame = of_the_end(made[-1], frame)
    then = not frame.part and (goes_on(clause.words) or "onward" in kinds(clause.items))
    return afterwards(made[-1], frame) if then else frame


def _only(clause: ReadClause, made: Sequence[F.SemanticFrame]) -> PathPart:
    """The part to which a clause confines what was asked for before it: "only between the cup and the box"."""
    said = {*kinds(clause.items)}
    if "only" not in said or not made or made[-1].part or not said <= PLACING | FREE | {"obj", "only", "end"}:
        return WHOLE
    return parts(Constituents(clause.items))


def _which(choice: Chunk) -> str:
    """The question which of some objects is meant."""
    what = choice.text.lower().removeprefix("the ")
    names = [repr(name) for name in choice.names]
    return f"Which {what}: {', '.join(names[:-1])} or {names[-1]}?" if names else f"Which {what} is meant?"


def _is_led(clause: ReadClause, lead: ReadClause) -> bool:
    """Whether a clause is about the part that an earlier one opened with: "near the cup: slower, and higher"."""
    if "whole" in kinds(clause.items) or not ALONG.isdisjoint(clause.words):
        return False
    return clause.opening == "and" or (clause.opening == "comma" and ":" in lead.words)


ALONG = frozenset("ever never always throughout anywhere everywhere".split())
"""Words of a clause that is about all of the path, whatever was said before."""


def _places(items: Sequence[Chunk]) -> bool:
    """Whether constituents begin with a part of the path, an object or an end that says where."""
    first = next((c for c in items if c.kind not in ("at", "in", "on", "for", "from")), items[0])
    return first.kind in PLACING | {"halfway"} or (first.kind in ("end", "obj") and first.value in WHERE)


QUESTIONS = {
    "offset": "In which direction?", "objects": "From or to what?", "place": "Where?", "amount": "How much?",
    "direction": "On which side?", "axis": "Left and right, or front and back?", "end": "Start or goal?",
}  # fmt: skip
"""What is asked for a slot that stays open."""


def _question(slot: str) -> str:
    return QUESTIONS.get(slot, f"Which {slot}?")


def _inherited(match: Match, made: Sequence[F.SemanticFrame]) -> tuple[dict[str, Any], list[str]]:
    """The slots with what the clauses before give for those left open; and what is still open."""
    found = {name: _from_before(name, made) for name in match.missing}
    return {**match.slots, **{n: v for n, v in found.items() if v}}, [n for n, v in found.items() if not v]


def _from_before(name: str, made: Sequence[F.SemanticFrame]) -> Any:
    for frame in reversed(made):
        if name == "objects" and frame.named:
            return frame.named[:1]
        if name == "place" and isinstance(frame, F.MoveEnd | F.Extend):
            return getattr(frame, "end", "goal")
        if name == "place" and frame.named:
            return frame.named[-1]
    return None
