"""What was meant instead: the other way, another direction, object, end or part of the path, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, apply, directions_of
from ovita.instruct.remarks import DIRECTIONS, FACTORS, SENSES, Candidate, Phrase, Remark, heading, senses_of, steps_of
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene
from ovita.units import find


def flips(said: Remark) -> Iterator[Candidate]:
    """The other way: "the opposite direction", "anticlockwise"."""
    pieces = said.cued("flip", "ccw", "cw")
    turned = [p for p in pieces if p.cues & {"ccw", "cw"}]
    if pieces and (not turned or any(isinstance(f, F.Figure | F.Rotate) for f in said.before)):
        ways = [i for i in said.targets if directions_of(said.before[i])]
        i = said.targets[-1] if len(said.targets) == 1 else ways[-1] if ways else None
        on = "" if i is None else said.on(i)
        yield Candidate((E.Flip(on=on),), (*pieces, *said.cued("meant")), 1.0)


def contraries(said: Remark) -> Iterator[Candidate]:
    """The other way round, by a word for it: "no, speed up", "I said away from it"."""
    no = [p for p in said.pieces[:1] if p.text in ("no", "nope", "nah")]
    meant = said.cued("meant")
    denied = [p for p in said.active if p.text.endswith("er") and said.negated(p)]
    if not (no or meant or denied):
        return
    for i in reversed(said.targets):
        against = {OPPOSITE.get(sense) for sense in senses_of(said.before[i])} - {None, "less"}
        pieces = [p for p in _brief(said) if SENSES.get(p.concept) in against]
        if pieces:
            yield Candidate((E.Flip(on=said.on(i)),), (*pieces, *no, *meant, *denied, *said.cued("not")), 0.5)


def _brief(said: Remark) -> list[Phrase]:
    """The pieces of one or two words that no "not" stands before."""
    return [p for p in said.active if len(p.text.split()) < 3 and not said.negated(p)]


def directions(said: Remark) -> Iterator[Candidate]:
    """Another direction or end than was said."""
    named = [p for p in said.active if heading(p)]
    for i in reversed(said.targets):
        frame = said.before[i]
        known = directions_of(frame)
        ways = ("left", "right", "front", "back") if isinstance(frame, F.Side | F.Tilt) else DIRECTIONS
        others = set(ways).difference(known) if known else set()
        new = [p for p in named if heading(p) in others and not said.negated(p)]
        if new:
            old = [p for p in named if heading(p) in known]
            old += [p for p in said.active if isinstance(frame, F.Side) and {*p.items} & {*frame.objects}]
            direction: Any = heading(new[-1])
            edit = E.Replace(on=said.on(i), direction=direction)
            yield Candidate((edit,), (*new, *old, *said.cued("meant", "not", "flip")), 1.0 if old else 0.3)
            return


def objects(said: Remark) -> Iterator[Candidate]:
    """Another object than was said, or the same for another one."""
    about = [i for i in said.targets if said.before[i].named] or [i for i, f in enumerate(said.before) if f.named]
    known = {name for frame in said.before for name in frame.named}
    new = [p for p in said.active if p.items and not {*p.items} <= known and not said.negated(p)]
    others = [*(p for p in said.active if p.text in OTHERS), *filter(_is_another, new)]
    if not about or not (new or others):
        return
    items = _meant_instead(said, about[-1], new, others, known)
    if len(items) == 1 or (new and not others):
        old = [p for p in said.active if {*p.items} & known]
        yield from _instead(said, about[-1], items, [*new, *others], old)
    elif items:
        question = "Which one: " + " or ".join(map(repr, items)) + "?"
        yield Candidate((), (*others, *said.cued("meant")), 1.0, question, items)


def _is_another(piece: Phrase) -> bool:
    """Whether a piece means one of several objects, without saying which: "the other cup"."""
    return len(piece.items) > 1 and "other" in piece.text.split() and not piece.text.endswith("s")


def _meant_instead(
    said: Remark, i: int, new: Sequence[Phrase], others: Sequence[Phrase], known: Set[str]
) -> tuple[str, ...]:
    """The objects that are named instead, or what the one before can be mistaken for."""
    items = tuple(dict.fromkeys(name for p in new for name in p.items)) or said.alike(said.before[i])
    several = len(new) > 1 or any(p.text.endswith("s") or "both" in p.text.split() for p in new)
    return items if several and not others else tuple(name for name in items if name not in known)


def _instead(
    said: Remark, i: int, items: tuple[str, ...], pieces: Sequence[Phrase], old: Sequence[Phrase]
) -> Iterator[Candidate]:
    """A frame about other objects; and besides, where "also" or "the same" says so."""
    edit = E.Replace(on=said.on(i), objects=items)
    yield Candidate((edit,), (*pieces, *old, *said.cued("meant", "not", "flip", "except")), 0.4)
    also = [*said.cued("also", "same"), *(p for p in said.pieces[:1] if p.text == "and")]
    if also and not said.cued("except"):  # "and the same exception around the boat" is none
        (copy,) = apply((replace(edit, on=""),), (said.before[i],), Scene())
        yield Candidate((E.Also(frame=copy),), (*pieces, *also), 1.0)


OTHERS = ("other", "wrong", "the other", "wrong one", "other one")


def ends(said: Remark) -> Iterator[Candidate]:
    """The other end of the path than was said."""
    for frame in said.before:
        pieces = [p for p in said.active if p.concept in ("start", "goal")]
        end: Any = pieces[-1].concept if pieces else ""
        if isinstance(frame, F.MoveEnd) and pieces and end != frame.end:
            yield Candidate((E.Replace(end=end),), (*pieces, *said.cued("meant", "not")), 1.0)
            if also := said.cued("also", "same"):
                yield Candidate((E.Also(frame=replace(frame, end=end)),), (*pieces, *also), 1.5)


def drops(said: Remark) -> Iterator[Candidate]:
    """Without some of the frames: "forget the shift", "no waiting", "only the slowing down"."""
    pieces = said.cued("undo") or [p for p in said.active if p.concept == "original"]
    softened = said.cued("less", "weak")
    if softened or said.cued("enough"):  # "the tempo should drop less than that"
        pieces = [p for p in pieces if len(p.text.split()) > 1]
    denied = [] if softened else _denied(said)
    yield from _ordinals(said, pieces)
    if pieces or denied:
        yield from _named(said, pieces, denied)
    named = said.meant(said.active)
    if named and said.cued("keep") and any(p.text == "alone" for p in said.active):  # "leave the speed alone"
        yield from _without(said, named, (), said.active)
    elif said.cued("only") and not _measures(said):
        yield from _rest(said, named)


def _measures(said: Remark) -> bool:
    """Whether an utterance says how much or where."""
    return any(p.number for p in said.active) or bool(said.cued(*FACTORS)) or any(True for _ in parts_in(said))


def _named(said: Remark, pieces: Sequence[Phrase], denied: Sequence[Phrase]) -> Iterator[Candidate]:
    """Without the frames that are named by what is denied, or beside a word that takes away."""
    clauses = {p.clause for p in pieces}
    words = denied or [p for p in said.active if p.clause in clauses]
    meant = said.meant([p for p in words if not p.items]) or said.meant(words)
    meant = meant or (said.meant(said.active) if pieces else [])
    whole = [p for p in said.active if p.concept == "whole"]
    used = (*pieces, *words, *said.cued("not", "except", "keep", "but"), *whole)
    if meant:
        yield from _without(said, meant, [heading(p) for p in words if heading(p)], used)


def _denied(said: Remark) -> list[Phrase]:
    """The pieces that name what is not wanted: "not the shift", "everything but the shift"."""
    excepted = said.cued("except")
    if excepted:
        behind = said.active[said.active.index(excepted[-1]) + 1 :]
        return [] if any(p.items for p in behind) else [p for p in behind if said.meant([p])]
    denied = [p for p in said.active if said.denies(p) and said.meant([p])]
    return [] if any(heading(p) and not said.denies(p) for p in said.active) else denied


def _without(said: Remark, meant: Sequence[int], ways: Sequence[str], used: tuple[Phrase, ...]) -> Iterator[Candidate]:
    """Without what is named: directions of a frame, some of the frames, or the only one."""
    known = directions_of(said.before[meant[0]])
    if len(meant) == 1 and ways and len(known) > 1:
        yield Candidate(tuple(E.Drop(on=way) for way in ways if way in known), used, 1.2)
    elif len(meant) < len(said.before):
        yield Candidate(tuple(E.Drop(on=said.on(i)) for i in meant), used, 1.0)
    elif len(said.before) == 1:
        yield Candidate((E.Drop(),), used, 0.3)


def _rest(said: Remark, only: Sequence[int]) -> Iterator[Candidate]:
    """Without all but what is named."""
    if only and len(only) < len(said.before):
        rest = tuple(E.Drop(on=said.on(i)) for i in range(len(said.before)) if i not in only)
        yield Candidate(rest, said.active, 0.6)
    kept = {heading(p) for p in said.active} - {""}
    known = directions_of(said.before[only[0]]) if len(only) == 1 and kept else ()
    gone = [way for way in known if way not in kept]
    if gone and len(gone) < len(known):
        yield Candidate(tuple(E.Drop(on=way) for way in gone), said.active, 0.6)


def _ordinals(said: Remark, pieces: Sequence[Phrase]) -> Iterator[Candidate]:
    """Without one of the turns: "forget the first one"."""
    counted = {"first": 1, "second": 2, "third": 3}
    for i, piece in enumerate(said.active[:-1] if pieces else ()):
        if piece.text.split()[-1] in counted and said.active[i + 1].text in ("one", "turn", "step", "change"):
            edit = E.Drop(on=f"turn {counted[piece.text.split()[-1]]}")
            yield Candidate((edit,), (*pieces, piece, said.active[i + 1]), 3.0)


# Where: the parts of the path that are named, and what is restricted to them

SHARES = {"half": 0.5, "third": 1 / 3, "quarter": 0.25, "fifth": 0.2, "tenth": 0.1}

TURNS = frozenset("change changes turn step edit one instruction modification".split())

STRETCHES = {"first": "first", "start": "first", "last": "last", "goal": "last", "middle": "middle"}
"""Words for a stretch of the path, and the part that they mean."""


class Where(NamedTuple):
    """A part of the path that is named, whether "not" stands before it, and its pieces."""

    part: PathPart
    denied: bool
    pieces: tuple[Phrase, ...]


def places(said: Remark) -> Iterator[Candidate]:
    """Only in a part of the path, or everywhere but there."""
    known = {name for frame in said.before for name in frame.named}
    cued = said.cued("only", "except")
    parts = [where for where in parts_in(said) if cued or not {*where.pieces[0].items} & known]
    if parts and said.before and not said.cued("vague"):
        yield from _confined(said, parts)


def _confined(said: Remark, parts: Sequence[Where]) -> Iterator[Candidate]:
    only, but = said.cued("only"), said.cued("except")
    pieces = tuple(piece for where in parts for piece in where.pieces)
    frame, on = said.before[said.targets[-1]], said.on(said.targets[-1]) if len(said.targets) == 1 else ""
    also = [] if only or any(p.items for p in pieces) else said.cued("also")
    if also:  # "over the last part too"
        yield Candidate((E.Also(frame=replace(frame, part=parts[-1].part)),), (*pieces, *also), 0.8)
    meant, drops = _meant_parts(said, parts), _taken(said, pieces)
    if but or drops or not (meant or only):
        edits = tuple(E.Except(on=on, part=part) for part in dict.fromkeys(where.part for where in parts))
        yield Candidate(edits, (*pieces, *but, *drops, *said.cued("not")), 0.6)
    corrects = len(parts) > len(meant) or frame.part != WHOLE
    if meant and (only or corrects or not but):
        used = (*pieces, *only, *said.cued("meant", "not"))
        yield Candidate((E.Restrict(on=on, part=meant[-1]),), used, 0.8 if only else 0.0 if corrects else -1.5)


def _meant_parts(said: Remark, parts: Sequence[Where]) -> list[PathPart]:
    """The parts that no "not" stands before; none behind a leading "but not"."""
    leading = any(p.text == "but" for p in said.active[:1]) and said.cued("not")
    return [] if leading else [where.part for where in parts if not where.denied]


def _taken(said: Remark, pieces: Sequence[Phrase]) -> list[Phrase]:
    """The words that take the one frame away from a part: "no shift at the end"."""
    clauses = {p.clause for p in pieces}
    if len(said.before) != 1 or any(map(steps_of, pieces)):
        return []
    return [p for p in said.cued("undo") if p.clause in clauses]


def everywhere(said: Remark) -> Iterator[Candidate]:
    """On the whole path, where a part was said before."""
    whole = said.cued("whole")
    if whole and said.before and said.before[said.targets[-1]].part != WHOLE:
        yield Candidate((E.Restrict(on=said.on(said.targets[-1]), part=WHOLE),), tuple(whole), 0.0)


def parts_in(said: Remark) -> Iterator[Where]:
    """The parts of the path that are named."""
    for i, piece in enumerate(said.active):
        before, behind = said.active[max(i - 3, 0) : i], said.active[i + 1 : i + 4]
        denied = said.negated(piece) or any("not" in p.text.split() for p in before[-1:])
        found = next((f for read in _PARTS if (f := read(piece, before, behind)) is not None), None)
        if found is not None:
            yield Where(found[0], denied, (piece, *found[1]))
            if found[0].kind == "between":
                return


Part: TypeAlias = tuple[PathPart, Sequence[Phrase]] | None
"""A part of the path, and the pieces beside the first one that it is read from."""


def _at_objects(piece: Phrase, before: Sequence[Phrase], behind: Sequence[Phrase]) -> Part:
    """Near, after, before or between objects."""
    words = {p.concept for p in before}
    if not piece.items:
        return None
    if "between" in words:
        other = next((p for p in behind if p.items), None)
        return None if other is None else (PathPart("between", (piece.items[0], other.items[0])), (other, *before))
    kind = next((k for k in ("after", "before") if k in words), "near")
    kind = "before" if "up to" in " ".join(p.text for p in before) else kind
    parts = tuple(PathPart(kind, (name,)) for name in piece.items)
    lead = [p for p in before if p.concept in ("after", "before", "near", "around", "when", "pass")]
    return parts[0] if len(parts) == 1 else PathPart("either", parts=parts), lead


def _stretch(piece: Phrase, before: Sequence[Phrase], behind: Sequence[Phrase]) -> Part:
    """The first 10 cm, the last third, the second half, the end."""
    after = behind[0] if behind else Phrase("", 0)
    kind, used = STRETCHES.get(piece.concept, ""), behind[:1]
    if piece.concept == "second":
        halves = {"half": PathPart("last", amount=0.5, unit="share"), "third": PathPart("middle")}
        return (halves[after.concept], used) if after.concept in halves else None
    if not kind or after.text in TURNS:
        return None
    if after.concept in SHARES:
        return PathPart(kind, amount=SHARES[after.concept], unit="share"), used
    if after.number is not None:
        units: dict[str, Any] = {"%": "share", "m": "m", "s": "s"}
        return PathPart(kind, amount=after.number.value, unit=units.get(after.number.unit, "waypoints")), behind
    unit = None if after.concept else find(after.text)
    if unit is not None and unit.dimension == "m":
        return PathPart(kind, amount=unit.factor, unit="m"), used
    return PathPart("middle") if kind == "middle" else PathPart(kind, unit="share"), ()


def _waypoints(piece: Phrase, before: Sequence[Phrase], behind: Sequence[Phrase]) -> Part:
    """From one waypoint to another."""
    ends = [p for p in behind[:3] if p.number is not None]
    if piece.concept != "waypoints" or len(ends) < 2 or ends[0] is not behind[0]:
        return None
    low, high = (p.number.value - 1 for p in ends[:2] if p.number is not None)
    return PathPart("range", amount=low, until=high), ends[:2]


def _heading(piece: Phrase, before: Sequence[Phrase], behind: Sequence[Phrase]) -> Part:
    """Where it heads up or down."""
    if piece.concept in ("up", "down") and any(p.concept in ("when", "only") for p in before):
        return PathPart("heading", direction=piece.concept), before
    return None


_PARTS = (_at_objects, _stretch, _waypoints, _heading)
