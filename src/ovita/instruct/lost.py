"""What an utterance says that no frame could hold: conditions, other deeds, places that nothing names.

Each check says, as a sentence, what would be lost; what one of them finds is shown before it is done.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, takewhile

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.facts import OPPOSED, UNKNOWN, Facts, among, clauses, elsewhere
from ovita.instruct.frames import held_by
from ovita.instruct.lexicon import DETERMINERS
from ovita.instruct.numerals import CENTI, FAR
from ovita.instruct.together import MEASURED, UNMEASURED


def _list_left(it: Facts) -> str:
    """A word that nobody knows beside an object, where it names another one: "the pie and the cup"."""
    for one, link, other in zip(it.row, it.row[1:], it.row[2:], strict=False):
        if link.kind == "and" and {one.kind, other.kind} == {"OBJ", "unknown"}:
            word = one if one.kind == "unknown" else other
            if it.said[max(it.said.index(word) - 1, 0)].text.lower() in DETERMINERS:
                return f"There is no {word.text!r} in the scene."
    return ""


def _one_way_only(it: Facts) -> str:
    """A size in one direction alone: "80 percent in width"; the whole path is resized."""
    word = next((word for word in it.words if word in ("width", "breadth", "depth")), "")
    return f"It would be resized in all directions, not in {word} alone." if word and it.frames_of(F.Resize) else ""


def _conditional(it: Facts) -> str:
    """A condition, which no frame can hold but as a part of the path: "if you come near the cup"."""
    told = [(word, chunk.kind) for chunk in it.said for word in chunk.text.lower().split()]
    words = [word for word, _ in told]
    for i, word in enumerate(words):
        if word != "unless" and (word != "if" or _wishes(words[:i]) or _polite([*words[i + 1 : i + 3], "", ""])):
            continue
        clause = {kind for _, kind in takewhile(lambda pair: pair[1] not in ("comma", "dot"), told[i + 1 :])}
        if not (clause & PLACING and all(frame.part for frame in it.frames)):
            return f"{word!r} sets a condition, and it would be done always."
    return ""


PLACING = frozenset("near within after before over under beyond rising falling closer distance between touch".split())
"""Classes of words by which a condition is a place on the path."""


def _polite(behind: Sequence[str]) -> bool:
    """Whether the words behind an "if" are mere politeness: "if you could", not "if you smell smoke"."""
    return behind[0] in COURTESY or (behind[0] in ("you", "i", "we", "one") and behind[1] in ABLE)


def _wishes(before: Sequence[str]) -> bool:
    """Whether the words before an "if" are a wish: "I'd feel safer if", not "I'd like it to turn if"."""
    sentence = list(takewhile(lambda word: word not in (".", "!", "?", ";"), reversed(before)))
    would = any(word in ("would", "wouldn't") or word.endswith("'d") for word in sentence)
    return not WISHING.isdisjoint(sentence[:2]) or (would and WANTING.isdisjoint(sentence))


COURTESY = frozenset("you'd i'd we'd possible need needed necessary anything at so that's it's".split())
"""What follows an "if" that is mere politeness."""

ABLE = frozenset("can could would will may might must like want wish please don't do have had need".split())
"""What follows an "if" and somebody in one."""

WANTING = frozenset("like want you".split())
"""What is behind a "would" that asks for something itself: "would you wait if"."""

WISHING = frozenset(
    "what glad happy happier better obliged grateful nice nicer lovely great good as see even mind".split()
)
"""What is right before an "if" that is one: "I would be glad if"."""


def _thing_moved(it: Facts) -> str:
    """Something that is to be moved itself: "push the cup to the left", "turn the gripper"."""
    before = ""
    for chunk in it.said:
        thing = chunk.kind == "OBJ"
        for word in [chunk.text] if thing else chunk.text.lower().split():
            if (thing and before in HANDLING) or (word in TOOLS and before in TURNING):
                return f"{before!r} asks for {chunk.text!r} itself to be moved; only the path can be."
            before = before if word in DETERMINERS else word
    return ""


TURNING = frozenset("rotate turn tilt spin flip open close point".split())

HANDLING = TURNING | frozenset(
    "move shift push pull put place bring take carry lift raise lower drop throw grab pick paint clean fill".split()
)
"""Verbs whose object is what is moved; the tool goes with the path unless it is to be turned."""

TOOLS = frozenset("gripper hand wrist camera tool head".split())


def _wish_left(it: Facts) -> str:
    """A wish after an "and" of which no word is known: "and frobnicate it"."""
    for clause in clauses(it.said):
        strange = any(map(_is_strange, clause)) and all(
            c.kind in UNKNOWN | {"OBJ", "path", "slight", "approx"} for c in clause
        )
        if strange and clause[0].kind == "and":
            return f"{' '.join(chunk.text for chunk in clause[1:])!r} has no place in it."
    return ""


def _share_lost(it: Facts) -> str:
    """A share of a thing's height, which no frame can hold: "no higher than half the mast"."""
    halves = frozenset(("half", "halve"))
    lost = any(isinstance(frame, F.Height) and frame.of for frame in it.frames) and it.plain & halves
    held = set[float]().union(*map(held_by, it.frames))
    return f"{it.word(halves)} has no place in it." if lost and not among(held, 0.5) else ""


def _other_deed(it: Facts) -> str:
    """A wish after an "and" for what is no matter of the path: "and open it", "and say hello"."""
    for clause in clauses(it.said):
        words = [word for chunk in clause for word in chunk.text.lower().split() if word not in LINKS]
        beside = clause[0].kind == "and" and all(chunk.kind in BESIDE for chunk in clause)
        if beside and words[:1] and words[0] in DEEDS:
            return f"{' '.join(chunk.text for chunk in clause[1:])!r} is no matter of the path."
    return ""


BESIDE = UNKNOWN | {"OBJ", "path", "approx", "slight", "turns", "on", "at", "near", "there"}
"""Classes of words in a clause that is about nothing of the path."""

LINKS = ("and", "then", "also", "please")

DEEDS = frozenset(
    """open close shut say sing play press push ring grab grip pick pour photograph film record scan snap shoot beep
    honk wave call text tell ask send turn switch light fire""".split()
)
"""Verbs for what else a robot may do."""


def _is_strange(chunk: Chunk) -> bool:
    """Whether a word may ask for something that no frame holds: one that is unknown, or "dance"."""
    return chunk.kind == "unknown" or (chunk.kind == "path" and chunk.text.lower().split()[-1] not in OWN_NAMES)


OWN_NAMES = frozenset("path trajectory route way track line course motion movement it waypoints points".split())
"""What the path is called, which asks for nothing by itself."""


def _above_lost(it: Facts) -> str:
    """A place above or below something, where what is read is about the thing itself."""
    for word, thing in pairwise(it.row):
        about = [frame for frame in it.frames if {*thing.names} & {*frame.named}]
        level = about and all(isinstance(frame, F.Figure | F.Clearance) for frame in about)
        if word.kind in ("over", "under") and level:
            return f"{word.text!r} {thing.text} has no place in it."
    return ""


def _pointed(it: Facts) -> str:
    """A place that is only pointed at, or unknown, where the whole path is changed: "speed up in the hallway"."""
    if any(map(F.says_where, it.frames)):
        return ""
    clause = next((clause for clause in clauses(it.said) if "there" in [chunk.kind for chunk in clause]), None)
    if clause is not None and not all(elsewhere(frame, [clause]) for frame in it.frames):
        return f"{it.word({'there'})} points at a place that nothing names."
    strange = (word.text for at, word in pairwise(it.row) if at.kind in PLACED_AT and _is_place(word))
    return next((f"{where!r} is no place that is known." for where in strange), "")


def _is_place(word: Chunk) -> bool:
    """Whether a word may be a part of the path that nobody knows: the "seam"."""
    return word.kind == "unknown" or (word.kind == "path" and word.text.lower() in WORKED)


WORKED = frozenset("seam weld bead joint".split())
"""Words for the part of a path on which the work is done."""

PLACED_AT = ("in", "at", "on", "along", "inside")
"""Classes of words before a place."""


def _counted(it: Facts) -> str:
    """A number of things that nobody knows: "skip the last two rows"."""
    held = {q.unit: q.value for frame in it.frames for q in frame.quantities.values()}
    held |= {frame.part.unit: frame.part.amount for frame in it.frames if frame.part.amount is not None}
    for number, what in pairwise(it.said):
        bare = number.kind == "Qn" and what.kind == "unknown" and what.text.lower().endswith("s")
        if bare and number.number.value in (held.get("waypoints"), held.get("m"), held.get("")):
            return f"{number.text!r} {what.text} are not known."
    return ""


def _each_left(it: Facts) -> str:
    """Each corner of a thing, or every row, of which only the thing is read."""
    parts = {one.kind for frame in it.frames for one in (frame.part, *frame.part.parts)}
    for each, what in pairwise(it.row):
        many = each.kind == "every" and (what.kind in ("turns", "unknown") or _is_strange(what))
        if many and parts.isdisjoint(("every", "turns")) and len({n for f in it.frames for n in f.named}) < 2:
            return f"{each.text!r} {what.text} has no place in it."
    return ""


def _exception_left(it: Facts) -> str:
    """An exception that no frame holds: "not below 10 cm, except for the take-off"."""
    held = any(frame.part for frame in it.frames) or it.frames_of(F.Keep | F.Clearance)
    return "" if held or "except" not in it.plain else f"What comes behind {it.word({'except'})} has no place in it."


def _corner_left(it: Facts) -> str:
    """A corner that is said to be there, and has no part in what is read: "it drives a big corner; cut that off"."""
    used = {one.kind for frame in it.frames for one in (frame.part, *frame.part.parts)} | {"turns"} & {
        getattr(frame, "change", "") for frame in it.frames
    }
    trims = it.frames_of(F.Trim)
    word = next(
        (chunk.text for chunk in it.said if chunk.kind == "turns" and chunk.text.lower().endswith("corner")), ""
    )
    return f"{word!r} has no place in it." if word and trims and "turns" not in used else ""


def _over_unsaid(it: Facts) -> str:
    """A way over or under something of which no word tells: "pass the cup with 10 cm to spare"."""
    told = any(word.startswith(("over", "ov", "ab", "und", "ben", "top")) for word in it.words)  # also misspelt
    for frame in () if told else it.frames_of(F.Visit | F.Hop):
        relation = getattr(frame, "relation", "over")
        if relation in ("over", "under") and it.kinds.isdisjoint(CROSSING[relation]):
            return f"No word says that it is to go {relation} it."
    return ""


CROSSING = {
    "over": frozenset("over up raise hop rising height clear touch farther hover skim".split()),
    "under": frozenset("under down lower falling height drop".split()),
}
"""Classes of words that may tell of a way over or under something."""


def _without_unit(it: Facts) -> str:
    """A length without a unit that is taken for centimetres, or for many metres: "no nearer than 60"."""
    amounts = [q for frame in it.frames for q in _lengths(frame)]
    stated = [chunk.number.value for chunk in it.said if chunk.q is not None]
    guessed = [abs(q.value) for q in amounts if not among(stated, abs(q.value))]
    bare = [abs(q.value) for q in amounts if q.unit == ""]
    told = (_as_taken(chunk.number.value, guessed, bare) for chunk in it.said if chunk.kind == "Qn")
    return next(filter(None, told), "")


def _height_or_speed(it: Facts) -> str:
    """A number without a unit that may be a height or a speed: "keep it under 0.5"."""
    bare = any(isinstance(frame, F.Height) and frame.level.unit == "" for frame in it.frames)
    number = next((chunk.text for chunk in it.said if chunk.kind == "Qn"), "")
    return f"{number} may be a height or a speed." if bare and number and it.kinds.isdisjoint(HIGH) else ""


HIGH = frozenset("height up down raise lower level ceiling floorlimit ground over axis rising falling".split())
"""Classes of words with which a number is a height."""


def _as_taken(number: float, guessed: Sequence[float], bare: Sequence[float]) -> str:
    """What a bare number is taken for."""
    if number >= 1.0 and among(guessed, number * CENTI):
        return f"{number:g} has no unit; it is taken as {number:g} cm."
    return f"{number:g} has no unit; it would be {number:g} m." if number >= FAR and number in bare else ""


def _lengths(frame: F.SemanticFrame) -> list[F.Quantity]:
    """The lengths of a frame, also those without a unit."""
    amounts = frame.quantities if isinstance(frame, MEASURED) else {}
    return [q for slot, q in amounts.items() if slot not in UNMEASURED and q.unit in ("", "m")]


def _goes_on(it: Facts) -> str:
    """A mere "keep going" that is read as a way beyond the goal, which nothing names."""
    far = any(isinstance(frame, F.Extend) and not frame.quantities for frame in it.frames)
    said = next((chunk.text.lower() for chunk in it.said if chunk.kind == "extend"), "")
    mere = {*said.split()} <= GOING_ON and it.plain.isdisjoint(("goal", "to", "over"))
    return f"{said!r} names no way beyond the goal." if far and said and mere else ""


GOING_ON = frozenset("keep on going go carry continue moving proceed still press push move travelling flying".split())
"""Words that say no more than that the robot goes on."""


def _extreme(it: Facts) -> str:
    """The highest or lowest point of the path, which no frame is about."""
    found = (word for word, point in pairwise(it.row) if word.kind in ("max", "min") and point.kind == "waypoints")
    return next((f"{word.text!r} point has no place in it." for word in found), "")


def _by_or_to(it: Facts) -> str:
    """A length that may be how much nearer, or how near: "closer to the cup, say 5 cm"."""
    by = [q.value for frame in it.frames_of(F.Approach) for q in frame.quantities.values()]
    row = [chunk for chunk in it.said if chunk.kind != "approx"]
    for before, amount, after in zip(row, row[1:], [*row[2:], *row[-1:]], strict=False):
        apart = before.kind in ("comma", "dot") or before.text.lower() in ("say", "like")
        compared = after.kind in COMPARING[: 2 if before.kind == "dot" else None]
        if apart and amount.kind == "Qm" and not compared and among(by, amount.number.value):
            return f"{amount.text!r} may be how much nearer or farther, or how near."
    return ""


COMPARING = ("closer", "farther", "inc", "dec")
"""Classes of words behind a length with which it is how much nearer or farther, the last two in one sentence only."""


def _regretted(it: Facts) -> str:
    """A way over, under or between that may only be told with regret: "it goes over the tray, this I do not want"."""
    ways = any(frame.relation != "at" for frame in it.frames_of(F.Visit)) and not it.frames_of(F.Avoid)
    kinds = [*(chunk.kind for chunk in it.row), "dot"]
    denied = any(no == "never" and after in ENDING for no, after in pairwise(kinds))
    return f"{it.word({'never'})} may deny that way." if ways and denied else ""


ENDING = ("comma", "dot", "and", "because", "unknown", "large")
"""Classes of what is behind a denial of what was said before it: "this I do not want.", "I do not much like that"."""


def _told(it: Facts) -> str:
    """What is said to be so, and read as what is asked for: "it whizzes past the terrace"."""
    for who, what in pairwise(it.said):
        third = who.text.lower() in ("it", "he", "she") and what.text.lower().split()[0].endswith("s")
        paces = any(what.kind in OPPOSED[sense] for sense in it.senses & {"faster", "slower"})
        if third and (paces or any(what.kind == frame.shape for frame in it.frames_of(F.Figure))):
            return f"{what.text!r} tells how it is."
    return ""


def _away_lost(it: Facts) -> str:
    """Something to stay away from, of which only a side is read."""
    lost = it.names(F.Side) - it.names(F.Approach | F.Clearance)
    rows = (it.row[k:] for k, chunk in enumerate(it.row) if chunk.kind == "farther")
    first = (next((chunk for chunk in row if chunk.kind == "OBJ"), row[0]) for row in rows)
    return next((f"What to stay away from, {thing.text}, is lost." for thing in first if lost & {*thing.names}), "")


def _until_told(it: Facts) -> str:
    """A wait whose end somebody is to tell: "wait there till I wave"."""
    waits = any(frame.duration is None for frame in it.frames_of(F.Wait))
    told = any(one in ("until", "till", "til") and two in SOMEBODY for one, two in pairwise(it.words))
    return "It is not said how long to wait." if waits and told else ""


SOMEBODY = frozenset("i i'm i've we you he she they someone somebody".split())


def asked(it: Facts) -> str:
    """A question of what the path is like: "does it go over the box?"; "does it have to ...?" is a wish."""
    first, second, *more = [*it.words, "", ""]
    asks = second in ASKED.get(first, ()) and WISHED.isdisjoint(more[:3])
    return "This may only ask what the path is like." if asks else ""


_STATES = ("it", "this", "that", "the", "there")

ASKED = {
    **dict.fromkeys(("is", "does", "will", "has"), _STATES),
    "how": ("close", "near", "high", "low", "far", "long", "fast", "quick", "quickly", "slow", "many", "much"),
    "what": ("is", "speed", "height", "distance"),
    "what's": _STATES,
}
"""The two words that begin a question."""

WISHED = frozenset("have need possible ok okay any way chance alright supposed about if".split())
"""Words that make a question a wish."""

LOST = (
    asked,
    _list_left,
    _one_way_only,
    _by_or_to,
    _regretted,
    _told,
    _away_lost,
    _until_told,
    _conditional,
    _thing_moved,
    _wish_left,
    _other_deed,
    _share_lost,
    _above_lost,
    _pointed,
    _counted,
    _each_left,
    _corner_left,
    _exception_left,
    _over_unsaid,
    _without_unit,
    _height_or_speed,
    _goes_on,
    _extreme,
)
"""All of these checks."""
