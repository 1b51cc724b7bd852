"""What speaks against a reading: plain facts of the utterance that the frames do not bear out.

Numbers, objects and negations that are said have to be found in what is read, and no frame can hold a condition, or a
wish of which no word is known. Each check says, as a sentence, what is lost; what any of
them speaks against is shown first.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise, takewhile

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.editing import OPPOSITE
from ovita.instruct.facts import BOUNDS, OPPOSED, UNKNOWN, Facts, among, clauses, elsewhere, senses
from ovita.instruct.frames import OPPOSITES, held_by
from ovita.instruct.lexicon import DETERMINERS
from ovita.instruct.numerals import CENTI, FAR, FRACTIONS
from ovita.instruct.selfrepair import kept
from ovita.instruct.together import MEASURED, UNMEASURED, unit_of
from ovita.instruct.whereabouts import EXCEPT, OTHER_THAN
from ovita.paths.part import PathPart
from ovita.paths.scene import DIRECTIONS

EXCLUDED = {
    **dict.fromkeys("up raise over farther faster larger inc at_least".split(), "at_most"),
    **dict.fromkeys("down lower under closer slower smaller dec at_most within".split(), "at_least"),
}
"""The bound that is never meant by a comparison: "higher than" is no greatest height, "never higher" no least one."""

NOT = frozenset("clear avoid too max limit vmax ceiling".split())
"""What may turn a comparison round, but for a "never" right before it."""

Check = Callable[[Facts], str]
"""A check of a reading: a sentence that says what is against it, or "" where nothing is."""


def contradictions(
    said: Sequence[Chunk], frames: Iterable[F.SemanticFrame], checks: Sequence[Check] = (), *, certain: bool = False
) -> tuple[str, ...]:
    """What the words say and a reading does not account for, or says otherwise, as sentences for people.

    Args:
        said: The utterance in chunks.
        frames: What was read.
        checks: Those to be made; by default all.
        certain: Whether the reader is so sure that only what it never sees counts.
    """
    said = kept(said)
    facts = Facts(said, tuple(frames))
    checks = checks or CHECKS + IN_SHORT * (len(said) <= SHORT)
    checks = [check for check in checks if not (certain and check in MINDED and "than" not in facts.words)]
    return tuple(text for check in checks if (text := check(facts)))


def _turned(it: Facts) -> str:
    """Left is read where only right is said."""
    for sense in sorted(it.senses & {*DIRECTIONS}):
        other = OPPOSITE[sense]
        said_otherwise = it.kinds & OPPOSED[other] - OPPOSED[sense] and not it.kinds & OPPOSED[sense]
        if said_otherwise and other not in it.senses:
            return f"It is read as {sense!r}, but says {it.word(OPPOSED[other])}."
    return ""


def _negated(it: Facts) -> str:
    """A "not" that no frame comes from."""
    denials = {"never", "clear"}
    if not it.plain & denials or any(OPPOSED[sense] & it.flipped for sense in it.senses):
        return ""
    denied = [clause for clause in clauses(it.said) if {c.kind for c in clause} & denials]
    if _borne_out(it, denied):
        return ""
    return f"{it.word({'never'} & it.plain or {'keep'})} may belong to something else."


def _stopped(it: Facts) -> str:
    """A "stop" that ends what comes behind it: "stop slowing down"."""
    for word, what in pairwise(it.said):
        if word.text.lower() in ("stop", "quit", "cease") and what.kind in {"slower", "faster"} & it.senses:
            return f"{word.text!r} may be about {what.text!r}."
    return ""


def _borne_out(it: Facts, denied: Sequence[Sequence[Chunk]]) -> bool:
    """Whether a frame is what the clauses that deny something ask for, or all frames come from other ones."""
    limits = any(_limits(frame, it.plain) for frame in it.frames)
    return limits or (bool(it.frames) and all(elsewhere(frame, denied) for frame in it.frames))


def _number_left(it: Facts) -> str:
    """A number that no slot took; "one" alone may be somebody, and the eight a figure."""
    shapes = {getattr(frame, "shape", "") for frame in it.frames}
    names = {"one", *shapes, "8" if "eight" in shapes else ""}
    held = set[float]().union(*map(held_by, it.frames))
    units = {"Qn": (1.0, CENTI, *(f for kind in ("Qm", "Qs") for c in it.said if (f := unit_of(c, kind))))}
    ends = _range_ends(it.said, held)
    for k, chunk in enumerate(it.said):
        if chunk.q is None or chunk.text.lower() in names or chunk in ends:
            continue
        amounts = _amounts(chunk.q.value, it.said[k + 1 : k + 5])
        if not any(among(held, value * unit) for value in amounts for unit in units.get(chunk.kind, (1.0,))):
            return f"{chunk.text!r} has no place in it."
    return ""


def _sign_left(it: Facts) -> str:
    """A minus that no frame holds, of what has no sign: "scale by -2", "rotate by -30 degrees"."""
    below = [then for chunk, then in pairwise(it.said) if chunk.kind == "minus" and then.q is not None]
    holders = [frame for frame in it.frames if any(among(held_by(frame), then.q.value) for then in below if then.q)]
    unsigned = holders and all(isinstance(frame, UNSIGNED) for frame in holders)
    return f"The minus of {below[0].text!r} has no place in it." if unsigned else ""


UNSIGNED = (F.Resize, F.Rotate, F.Tilt, F.Wait, F.Clearance, F.Approach, F.Height)
"""Frames that hold no sign that a reader passed over."""


def _amounts(value: float, behind: Sequence[Chunk]) -> tuple[float, ...]:
    """What a number may come to with the words behind it: "three-quarter", "seven tenths"."""
    words = " ".join(chunk.text.lower() for chunk in behind).replace("-", " ").split()
    share = FRACTIONS.get(words[0], FRACTIONS.get(words[0].removesuffix("s"), 1.0)) if words else 1.0
    return value, value * share


def _range_ends(said: Sequence[Chunk], held: Iterable[float]) -> list[Chunk]:
    """Both numbers of ranges whose mean is held; the first may be in the unit of the second: "30-32 cm"."""
    found: list[Chunk] = []
    for one, link, other in zip(said, said[1:], said[2:], strict=False):
        if one.q and other.q and link.kind in ("to", "and"):
            means = [(one.q.value * scale + other.q.value) / 2 for scale in (1.0, 0.01, 0.001)]
            found += [one, other] if any(among(held, mean) for mean in means) else []
    return found


SPARED = (*sorted(EXCEPT), *(" ".join(words) for words in OTHER_THAN))
"""Words before an object that is not meant."""


def _object_left(it: Facts) -> str:
    """An object that no frame is about."""
    named = {name for frame in it.frames for name in frame.named}
    reason = next((i for i, chunk in enumerate(it.row) if chunk.kind == "because"), len(it.row))
    for i, chunk in enumerate(it.row):
        meant = i < reason or any(name.lower() in chunk.text.lower() for name in chunk.names)
        before = " ".join(one.text.lower() for one in it.row[max(i - 2, 0) : i])
        spared = before.endswith(SPARED) and any(map(_of_several, it.frames))
        if chunk.kind == "OBJ" and meant and not spared and not named.intersection(chunk.names):
            return f"{chunk.text!r} has no part in it."
    return ""


def _limits(frame: F.SemanticFrame, kinds: frozenset[str]) -> bool:
    """Whether a negation asks for a frame: it keeps, bounds, excepts, or is the opposite of what is said."""
    if isinstance(frame, F.Keep | F.Clearance | F.Bound | F.Avoid | F.NoStop) or frame.part.kind == "outside":
        return True
    if getattr(frame, "change", "") == "constant" or any(q.role in BOUNDS for q in frame.quantities.values()):
        return True
    turned = {"farther", "slower", "less", "smaller"} & {*senses(frame)}
    return any(kinds & OPPOSED[OPPOSITE[sense]] or not kinds & OPPOSED[sense] for sense in turned)


def _part_left(it: Facts) -> str:
    """A part of the path that is named as one, where all frames are about the whole: "mirror the last part"."""
    if any(frame.part or isinstance(frame, ABOUT_PARTS) for frame in it.frames):
        return ""
    named = [c for c in it.said if c.kind in ("first", "last", "middle") and c.text.lower().split()[-1] in STRETCHES]
    return f"{named[0].text!r} has no place in it." if named else ""


ABOUT_PARTS = (F.MoveEnd, F.Keep, F.Extend, F.Trim, F.StopAt, F.Return, F.Wait, F.Figure, F.Arrive)
"""Frames about a part of the path without one of their own."""

STRETCHES = frozenset("part phase section stretch portion segment half third quarter".split())
"""What a part of the path is called."""


def _compared(it: Facts) -> str:
    """A bound on the other side than a comparison puts it: "higher than 30 cm" as at most 30 cm."""
    if it.kinds & NOT:
        return ""
    bounds = [(one.role, one.value) for frame in it.frames for one in frame.quantities.values()]
    row = [chunk for chunk in it.row if chunk.kind != "than"]
    denied = False
    for word, amount in pairwise(row):
        denied = word.kind == "never" or (denied and word.kind not in ("comma", "dot", "and"))
        excluded = EXCLUDED.get(word.kind, "")
        excluded = OTHER_BOUND[excluded] if denied and excluded else excluded
        wrong = [value for role, value in bounds if role == excluded]
        if amount.q is not None and among(wrong, amount.q.value):
            return f"{word.text!r} {amount.q.said or amount.text} is a bound on the other side."
    return ""


OTHER_BOUND = {"at_least": "at_most", "at_most": "at_least"}


def _more_of_it(it: Facts) -> str:
    """More of what there is too much of, or is to be avoided: "too far to the left" as left, "avoid the left side"."""
    for i, chunk in enumerate(it.row):
        behind = it.row[i + 1 : i + 1 + {"too": 3, "avoid": 1}.get(chunk.kind, 0)]
        for word in behind:
            if any(word.kind == sense and word.kind in WAYS for sense in it.senses):
                return f"{chunk.text!r} {word.text} is read as more of it."
    return ""


WAYS = frozenset("left right front back up down closer farther faster slower larger smaller".split())
"""Senses that are classes of words, too."""


def _one_of_two(it: Facts) -> str:
    """One of two opposite sides that are both asked for: "go left and right"."""
    one_side = any(len({*senses(frame)} & {"left", "right"}) == 1 for frame in it.frames)
    swapped = "mirror" not in it.plain and any(isinstance(frame, F.Mirror) for frame in it.frames)
    return f"{it.word({'sideways'})} is both sides." if (one_side or swapped) and "sideways" in it.plain else ""


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
    somebody = behind[0] in ("you", "i", "we", "one")
    return behind[0] in COURTESY or behind[1] == "pleases" or (somebody and behind[1] in ABLE)


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


def _wish_left(it: Facts) -> str:
    """A wish after an "and" of which no word is known: "and frobnicate it"."""
    for clause in clauses(it.said):
        strange = any(map(_is_strange, clause)) and all(
            c.kind in UNKNOWN | {"OBJ", "path", "slight", "approx"} for c in clause
        )
        if strange and clause[0].kind == "and":
            return f"{' '.join(chunk.text for chunk in clause[1:])!r} has no place in it."
        if [chunk.kind for chunk in clause[:2]] == ["and", "unknown"]:  # "and moonwalk near the cup"
            return f"{clause[1].text!r} has no place in it."
    return ""


def _thing_unknown(it: Facts) -> str:
    """A thing that nobody knows beside one of the scene: "over the bees and the truck"."""
    for one, link, other in zip(it.row, it.row[1:], it.row[2:], strict=False):
        if one.kind == "unknown" and link.kind in ("and", "or") and other.kind == "OBJ":
            return f"{one.text!r} has no place in it."
    return ""


def _is_strange(chunk: Chunk) -> bool:
    """Whether a word may ask for something that no frame holds: one that is unknown, or "dance"."""
    return chunk.kind == "unknown" or (chunk.kind == "path" and chunk.text.lower().split()[-1] not in OWN_NAMES)


OWN_NAMES = frozenset("path trajectory route way track line course motion movement it waypoints points".split())
"""What the path is called, which asks for nothing by itself."""


def _without_unit(it: Facts) -> str:
    """A length without a unit that is taken for centimetres, or for many metres: "no nearer than 60"."""
    if any(map(unit_of, it.said)):
        return ""  # it is in the unit of the other one
    amounts = [q for frame in it.frames for q in _lengths(frame)]
    stated = [chunk.number.value for chunk in it.said if chunk.q is not None]
    guessed = [abs(q.value) for q in amounts if not among(stated, abs(q.value))]
    bare = [abs(q.value) for q in amounts if q.unit == ""]
    told = (_as_taken(chunk.number.value, guessed, bare) for chunk in it.said if chunk.kind == "Qn")
    return next(filter(None, told), "")


def _as_taken(number: float, guessed: Sequence[float], bare: Sequence[float]) -> str:
    """What a bare number is taken for."""
    if number >= 1.0 and among(guessed, number * CENTI):
        return f"{number:g} has no unit; it is taken as {number:g} cm."
    return f"{number:g} has no unit; it would be {number:g} m." if number >= FAR and number in bare else ""


def _lengths(frame: F.SemanticFrame) -> list[F.Quantity]:
    """The lengths of a frame, also those without a unit."""
    amounts = frame.quantities if isinstance(frame, MEASURED) else {}
    return [q for slot, q in amounts.items() if slot not in UNMEASURED and q.unit in ("", "m")]


def _exception_left(it: Facts) -> str:
    """An exception of which nothing is left out: "over the whole route apart from takeoff and landing"."""
    words = [chunk.text for chunk in it.said if chunk.kind == "except" and SPARING & {*chunk.text.lower().split()}]
    whole = {type(frame) for frame in it.frames if not frame.part}
    apart = any(frame.part and type(frame) in whole for frame in it.frames)  # "2 m/s, except near the goal, there 1"
    return "" if not words or apart or any(map(_spares, it.frames)) else f"{words[0]!r} leaves something out."


def _spares(frame: F.SemanticFrame) -> bool:
    """Whether a frame leaves something as it is."""
    return isinstance(frame, F.Keep | F.Avoid | F.NoStop) or _leaves_out(frame.part) or _of_several(frame)


def _of_several(frame: F.SemanticFrame) -> bool:
    """Whether a frame is about distances to several objects, as to all but one."""
    return isinstance(frame, F.Approach | F.Clearance) and len(frame.objects) > 1


SPARING = frozenset("apart except excepting excluding exception aside".split())
"""Words of an exception that are nothing else, as "but" and "outside" may be."""


def _leaves_out(part: PathPart) -> bool:
    """Whether a part of the path, or one of those that it is made of, is what is outside another."""
    return part.kind == "outside" or any(map(_leaves_out, part.parts))


def _unsaid(it: Facts) -> str:
    """A part of the path that no word says: all but a place, where nothing is left out, or the way up."""
    kinds = {frame.part.kind for frame in it.frames}
    if "outside" in kinds and LEAVING_OUT.isdisjoint(it.words) and "except" not in it.plain:
        return "Nothing says that a part is left out."
    for part, way in (("rising", "up"), ("falling", "down")):
        if part in kinds and not it.plain & OPPOSED[way]:
            return f"Nothing says that it is about the way {way}."
    return ""


LEAVING_OUT = frozenset(
    """but besides apart other than outside else elsewhere otherwise rest excluding save bar barring beyond away without
    not don't never unless remaining remainder leave keep leaving keeping untouched only just unchanged alone
    out exempt spare sparing skip skipping stays remains until till before after from then same normal again""".split()
)
"""Words by which a part of the path may be left out."""


def _half_left(it: Facts) -> str:
    """A half of the path that no frame is about."""
    held = set[float]().union(*map(held_by, it.frames))
    said = next((chunk.text for chunk in it.said if chunk.kind in ("firsthalf", "secondhalf")), "")
    return f"{said!r} has no place in it." if said and not among(held, 0.5) else ""


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


def _way_left(it: Facts) -> str:
    """One of two directions that are said together: "the start up and left"."""
    for one, link, other in zip(it.row, it.row[1:], it.row[2:], strict=False):
        ways = {one.kind, other.kind}
        if link.kind == "and" and len(ways) == 2 and ways <= OPPOSITES.keys() and len(ways & it.senses) == 1:
            left = one if one.kind not in it.senses else other
            return f"{left.text!r} has no part in it."
    return ""


def _each_by_the_other(it: Facts) -> str:
    """A comparison of two things as two wishes: "the closer to the cup, the slower"."""
    compared = {"the closer", "the nearer", "the farther"} & {f"{one} {other}" for one, other in pairwise(it.words)}
    if compared and it.frames_of(F.Approach) and it.frames_of(F.Pace):
        return f"{compared.pop()!r} may only say where it is to be so."
    return ""


def _two_points(it: Facts) -> str:
    """A range of waypoints where two of them are named: "waypoint 5 and waypoint 10"."""
    ranges = [f.part for f in it.frames if f.part.kind == "range" and f.part.unit == "waypoints"]
    apart = [part for part in ranges if part.until is not None and part.until - (part.amount or 0.0) > 1.0]
    between = {chunk.kind for chunk in it.said} & {"between", "from", "to"}
    for one, link, other in zip(it.row, it.row[1:], it.row[2:], strict=False):
        if apart and not between and one.q and link.kind == "and" and (other.q or other.kind == "waypoints"):
            return "Two waypoints are named, and what is between them would count, too."
    return ""


CHECKS: tuple[Check, ...] = (
    _number_left, _object_left, asked, _sign_left, _part_left, _compared, _more_of_it, _one_of_two, _way_left,
    _two_points, _thing_unknown, _each_by_the_other, _conditional, _thing_moved, _other_deed, _without_unit,
    _exception_left, _unsaid, _half_left,
)  # fmt: skip
IN_SHORT: tuple[Check, ...] = (_turned, _negated, _stopped, _wish_left)
"""Checks of short utterances: in long ones, such words mostly belong to what is told besides."""

MINDED = (_object_left,)
"""Checks of what the network sees, too: where it is certain, it was right in 33 of 35 sentences that they doubted (by
earlier weights); they count for comparisons ("5 cm farther from the cup than from the lamp")."""

SHORT = 10
"""Chunks of a short utterance."""
