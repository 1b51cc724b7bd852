"""What was meant instead: the other way, another direction or object, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, Literal

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, apply, directions_of
from ovita.instruct.remarks import ADJECTIVES, SENSES, Candidate, Phrase, Remark, heading, senses_of
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene

NEAR = ("near", "around", "over")

STRETCH_AT: Mapping[str, Literal["first", "last"]] = {"start": "first", "goal": "last"}
"""The part of the path at each of its ends."""

ORDINALS = {"first": 1, "second": 2, "third": 3}


def flips(said: Remark) -> Iterator[Candidate]:
    """The other way: "the opposite direction", "anticlockwise"."""
    turning = any(isinstance(frame, F.Figure | F.Rotate) for frame in said.before)
    if pieces := said.cued("flip", "ccw", "cw") if turning else said.cued("flip"):
        ways = _turnable(said)
        yield Candidate((E.Flip(on=said.on(ways[-1]) if ways else ""),), (*pieces, *said.naming, *said.others))


def _turnable(said: Remark) -> list[int]:
    """Numbers of the frames that the other way may be of: those with a direction, else figures, else any."""
    turns = [i for i in said.targets if isinstance(said.before[i], F.Figure | F.Rotate)]
    return [i for i in said.targets if directions_of(said.before[i])] or turns or said.targets


def contraries(said: Remark) -> Iterator[Candidate]:
    """The other way round, by a word for it: "no, speed up", "faster instead"."""
    denied = [p for p in said.active if p.text.endswith("er") and said.negated(p)]
    for i in reversed(said.targets if said.corrects or denied else []):
        against = {*map(OPPOSITE.get, senses_of(said.before[i]))} - {None, "less"}
        if pieces := [p for p in said.wanted if SENSES.get(p.concept) in against]:
            yield Candidate((E.Flip(on=said.on(i)),), (*pieces, *denied, *said.cued("not")))


def directions(said: Remark) -> Iterator[Candidate]:
    """Another direction than was said: "right, not left"."""
    for i in reversed(said.targets):
        frame = said.before[i]
        known = directions_of(frame)
        new = [p for p in said.headed if heading(p) in _other_ways(frame) and not said.negated(p)]
        old = [p for p in said.headed if heading(p) in known] + _passed(said, frame)
        if new and (old or said.corrects):
            direction: Any = heading(new[-1])
            yield Candidate((E.Replace(on=said.on(i), direction=direction),), (*new, *old, *said.cued("not")))
            return


def _other_ways(frame: F.SemanticFrame) -> set[str]:
    """The directions that a frame could have instead of its own; none where it has none."""
    known = set(directions_of(frame))
    ways = {"left", "right", "front", "back"} if isinstance(frame, F.Side | F.Tilt) else {*F.OPPOSITES}
    return ways - known if known else set()


def _passed(said: Remark, frame: F.SemanticFrame) -> list[Phrase]:
    """The pieces that name what is passed on a side."""
    return [p for p in said.active if isinstance(frame, F.Side) and {*p.items} & {*frame.objects}]


def objects(said: Remark) -> Iterator[Candidate]:
    """Another object than was said."""
    i = _about_objects(said)
    new = [p for p in said.wanted if {*p.items} - said.known]
    if i is None or _is_besides(said) or not (new or said.others):
        return
    near = said.of(*NEAR) if said.corrects else []
    used = (*new, *said.others, *near, *said.naming, *said.cued("not", "flip"))
    items = _new_items(said, new, said.before[i])
    if len(items) == 1 or _several(new):
        yield Candidate((E.Replace(on=said.on(i), objects=items),), used)
    elif items:
        yield Candidate((), used, "Which one: " + " or ".join(map(repr, items)) + "?", items)


def _new_items(said: Remark, new: Sequence[Phrase], frame: F.SemanticFrame) -> tuple[str, ...]:
    """The objects that are meant instead: those named, of one kind only the new ones; else what the old is like."""
    named = _items(new) or said.alike(frame)
    return named if _several(new) else tuple(name for name in named if name not in said.known)


def _is_besides(said: Remark) -> bool:
    """Whether an object is named besides, not instead: "the same for the bottle"."""
    return said.adds or bool(said.cued("same") and not (said.corrects or said.cued("not")))


def _about_objects(said: Remark) -> int | None:
    """Number of the last frame about objects, of those that are meant."""
    return next((i for i in reversed(said.targets) if said.before[i].named), None)


def _items(pieces: Sequence[Phrase]) -> tuple[str, ...]:
    """The objects that some pieces name."""
    return tuple(dict.fromkeys(name for p in pieces for name in p.items))


def _several(pieces: Sequence[Phrase]) -> bool:
    """Whether pieces mean all of several objects: "both cups"."""
    return len(pieces) > 1 or any(p.text.endswith("s") or "both" in p.text.split() for p in pieces)


def copies(said: Remark) -> Iterator[Candidate]:
    """The same for another object besides: "the same for the bottle"."""
    i = _about_objects(said)
    if i is None or not (said.adds or said.cued("same")):
        return
    names, naming = _besides(said, said.before[i])
    all_of = [p for p in said.active if p.text.split()[0] in ALL_OF]
    meant = _alike(said, i) if all_of else [i]
    if not names or (all_of and len(meant) == 1):
        return
    made = (apply((E.Replace(objects=names),), (said.before[k],), Scene())[0] for k in meant)
    used = (*naming, *all_of, *said.of(*NEAR), *said.cued("also"))
    sure = bool(all_of) or not any(p.items for p in naming)
    yield Candidate(tuple(E.Also(frame=frame) for frame in made), used, sure=sure)


def _besides(said: Remark, frame: F.SemanticFrame) -> tuple[tuple[str, ...], list[Phrase]]:
    """The objects that a remark names besides a frame's, and the pieces that name them: "the other one" is one, too."""
    new = [p for p in said.active if p.items]
    if names := tuple(name for name in _items(new) if name not in frame.named):
        return names, new
    other = [] if new else _other_one(said)
    alike = said.alike(frame) if other else ()
    return (alike, other) if len(alike) == 1 else ((), [])


ALL_OF = ("both", "all", "everything")
"""Words for all that was done to a thing."""


def _alike(said: Remark, i: int) -> list[int]:
    """Numbers of the frames about the same things as one of them."""
    return [k for k, frame in enumerate(said.before) if frame.named == said.before[i].named]


def _other_one(said: Remark) -> list[Phrase]:
    """The pieces of "the other one"; none where that is not said."""
    return [p for p in said.active if p.text in ("other", "one")] if "other" in said.texts else []


def other_halves(said: Remark) -> Iterator[Candidate]:
    """The other half of the path than was said: "no, the other half"."""
    pieces = [p for pair in pairwise(said.active) if [one.text for one in pair] in OTHER_PARTS for p in pair]
    for i, frame in enumerate(said.before if pieces else ()):
        if frame.part.kind in OTHER_KIND:
            part = replace(frame.part, kind=OTHER_KIND[frame.part.kind])
            yield Candidate((E.Restrict(on=said.on(i), part=part),), pieces, sure=True)


OTHER_KIND = {"first": "last", "last": "first", "before": "after", "after": "before"}
OTHER_PARTS = (["other", "half"], ["other", "third"], ["other", "end"])


def places_instead(said: Remark) -> Iterator[Candidate]:
    """Near a thing instead of where it was: "not there, at the fan", "not at the start, at the fan"."""
    things, no = [p for p in said.active if p.items], said.cued("not", "except")
    denied, names = [p for p in said.active if p.text == "there" or p.concept in ENDED], _items(things)
    i = _last_in_part(said)
    if i is None or len(names) != 1 or not denied or not no or any(p.number or heading(p) for p in said.active):
        return
    if said.active.index(denied[0]) < said.active.index(things[0]):
        used = (*things, *denied, *no, *said.cued("meant", "only"), *said.of("near", "at", "around"))
        yield Candidate((E.Restrict(on=said.on(i), part=PathPart("near", names)),), used, sure=True)


def left_out(said: Remark) -> Iterator[Candidate]:
    """Without one of the things that it is near: "not at the piano" of what is slower at the piano and the table."""
    things, no = [p for p in said.active if p.items], said.cued("not", "except")
    names = {*_items(things)}
    if len(names) != 1 or not no or not all(map(said.negated, things)):
        return
    for i, frame in enumerate(said.before):
        if names < _near_any_of(frame.part):
            used = (*things, *no, *said.of("near", "at", "around", "by"))
            part = PathPart("near", tuple(names))
            yield Candidate((E.Except(on=said.on(i), part=part),), used, sure=True)


def _near_any_of(part: PathPart) -> set[Any]:
    """The places near any of which a part is."""
    return {place for inner in part.parts for place in inner.places} if part.kind == "either" else set()


def _last_in_part(said: Remark) -> int | None:
    """The number of the last frame about a part of the path; None for none."""
    return next((i for i in reversed(range(len(said.before))) if said.before[i].part), None)


ENDED = ("start", "goal", "first", "last", "middle")
"""Concepts of places on a path that no thing names."""


def ends_kept(said: Remark) -> Iterator[Candidate]:
    """An end where it was before all turns: "put the start back where it was", "but the goal should not move"."""
    pieces = [p for p in said.pieces if p.concept in ("start", "goal")]
    stay = [p for p in said.pieces if p.cues & {"keep", "where_it_was"} or p.concept == "original"]
    stay += said.of("never") if said.cued("of_move") else []
    if pieces and stay and said.before and not any(map(_tells_more, said.pieces)):
        named: list[Any] = list(dict.fromkeys(p.concept for p in pieces))
        both = any(p.text in ("ends", "both ends", "endpoints") for p in pieces)
        edits = tuple(edit for end in (("start", "goal") if both else named) for edit in _back_at(said, end))
        used = (*pieces, *stay, *said.cued("not", "also", "restart", "undo", "keep", "of_move"))
        yield Candidate(edits, (*used, *said.of("rest", "back", "waypoints")), sure=True)


def _tells_more(piece: Phrase) -> bool:
    """Whether a piece says how far, which way or of which thing."""
    return bool(piece.number or piece.items or (heading(piece) and piece.text != "back"))


def _back_at(said: Remark, end: F.End) -> Sequence[E.Edit]:
    """What puts an end back: without what moved it alone, or with it kept where all else moved it."""
    moved = [i for i, frame in enumerate(said.before) if isinstance(frame, F.MoveEnd) and frame.end == end]
    return [E.Drop(on=said.on(i)) for i in moved] or [E.Also(frame=F.Keep(what=end))]


def ends(said: Remark) -> Iterator[Candidate]:
    """The other end of the path than was said: "I meant the goal"; or that one besides: "the goal as well"."""
    pieces = said.of("start", "goal")
    meant: list[Any] = [p.concept for p in pieces if p in said.wanted]
    instead = said.corrects or {"start", "goal"} == {p.concept for p in pieces}
    used = (*pieces, *said.cued("also", "not"))
    for i, frame in enumerate(said.before if meant else ()):
        end = meant[-1]
        if isinstance(frame, F.MoveEnd) and frame.end != end:
            edit = E.Also(frame=replace(frame, end=end)) if said.adds else E.Replace(end=end)
            yield Candidate((edit,), used)
        elif instead and {frame.part.kind, STRETCH_AT[end]} == {"first", "last"}:
            yield Candidate((E.Restrict(on=said.on(i), part=replace(frame.part, kind=STRETCH_AT[end])),), used)


def everywhere(said: Remark) -> Iterator[Candidate]:
    """On the whole path, where a part was said before."""
    whole = said.cued("whole")
    if whole and said.before and said.before[said.targets[-1]].part != WHOLE:
        yield Candidate((E.Restrict(on=said.on(said.targets[-1]), part=WHOLE),), whole)


def drops(said: Remark) -> Iterator[Candidate]:
    """Without some of the frames: "forget the shift", "no waiting"."""
    pieces = said.cued("undo") or [p for p in said.of("original") if p.text != "now"]
    yield from _ordinals(said, pieces)
    denied = [] if said.cued("less", "weak", "enough") else _denied(said)
    words = denied or (said.naming if pieces else [])
    used = (*pieces, *words, *said.cued("not", "except", "keep"), *(said.cued("only") if pieces else ()))
    yield from _without(said, said.meant(words), words, used)


def spares(said: Remark) -> Iterator[Candidate]:
    """Without all but what is to stay: "forget the rest, keep the lift", "undo everything except the lift"."""
    told = [p for p in said.pieces if p.cues & {*STAYING, *GOING} and p.text != "alone"]
    rest = [p for p in said.pieces if not REST.isdisjoint(p.text.split()) and p not in told]
    named = [p for p in said.pieces if said.meant([p])]
    kept = said.meant(named)
    if 0 < len(kept) < len(said.before) and _tells_all(told, rest) and all(_stays(said, p) for p in named):
        yield Candidate(_all_but(said, kept), (*named, *told, *rest), sure=True)


def _tells_all(told: Sequence[Phrase], rest: Sequence[Phrase]) -> bool:
    """Whether words of what stays and what goes are about all that was done, not about what is named alone."""
    cues = {cue for p in told for cue in p.cues}
    return bool(rest) or "restart" in cues or {"keep", "only"} <= cues or {"undo", "except"} <= cues


REST = frozenset("rest others else everything all".split())
"""Words for all that is not named."""

STAYING, GOING = frozenset(("keep", "except", "only", "but")), frozenset(("undo", "restart"))
"""Cues of what stays, and of what goes."""


def _stays(said: Remark, piece: Phrase) -> bool:
    """Whether the last that is said before a piece, of what stays and what goes, is what stays."""
    before = reversed(said.pieces[: said.pieces.index(piece) + 1])
    return next((bool(p.cues & STAYING) for p in before if p.cues & {*STAYING, *GOING}), False)


def only(said: Remark) -> Iterator[Candidate]:
    """Without all but what is named: "only the slowing down"."""
    kept = said.meant(said.naming) if said.cued("only") else []
    used = (*said.naming, *said.cued("only"))
    if {p.clause for p in said.cued("keep")} & {p.clause for p in said.naming}:  # "leave the speed alone"
        yield from _without(said, kept, (), used)
    elif 0 < len(kept) < len(said.before):
        yield Candidate(_all_but(said, kept), used)
    elif len(kept) == 1:
        ways = {heading(p) for p in said.naming}
        yield Candidate(tuple(E.Drop(on=way) for way in directions_of(said.before[0]) if way not in ways), used)


def _all_but(said: Remark, kept: Sequence[int]) -> tuple[E.Drop, ...]:
    """Without all frames but some."""
    return tuple(E.Drop(on=said.on(i)) for i in range(len(said.before)) if i not in kept)


def _denied(said: Remark) -> list[Phrase]:
    """The pieces that name what is not wanted: "not the shift", "everything but the shift"."""
    nouns = [p for p in said.naming if p.text not in ADJECTIVES]  # "not as slow" wants less of it
    if excepted := said.cued("except"):
        behind = said.active[said.active.index(excepted[-1]) + 1 :]
        return [] if _items(behind) else [p for p in nouns if p in behind]
    return [p for p in nouns if said.denies(p)] if all(map(said.denies, said.headed)) else []


def _without(
    said: Remark, meant: Sequence[int], words: Sequence[Phrase], used: tuple[Phrase, ...]
) -> Iterator[Candidate]:
    """Without what is named: directions of a frame, some of the frames, or the only one."""
    known = directions_of(said.before[meant[0]]) if len(meant) == 1 else ()
    ways = [heading(p) for p in words if heading(p) in known]
    if ways and len(known) > 1:
        yield Candidate(tuple(E.Drop(on=way) for way in ways), used)
    elif 0 < len(meant) < len(said.before):
        yield Candidate(tuple(E.Drop(on=said.on(i)) for i in meant), used)
    elif len(meant) == 1:
        yield Candidate((E.Drop(),), used)


def _ordinals(said: Remark, pieces: Sequence[Phrase]) -> Iterator[Candidate]:
    """Without one of the turns: "forget the first one"."""
    for i, piece in enumerate(said.active[:-1] if pieces else ()):
        which, behind = ORDINALS.get(piece.text.split()[-1]), said.active[i + 1]
        if which is not None and behind.text in ("one", "turn", "step", "change"):
            yield Candidate((E.Drop(on=f"turn {which}"),), (*pieces, piece, behind))
