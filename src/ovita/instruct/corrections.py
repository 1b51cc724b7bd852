"""What was meant instead: the other way, another direction or object, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, apply, directions_of
from ovita.instruct.remarks import ADJECTIVES, SENSES, Candidate, Phrase, Remark, heading, senses_of, words_in
from ovita.instruct.together import STRETCH_AT
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene

NEAR = ("near", "around", "over")

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


def other_sides(said: Remark) -> Iterator[Candidate]:
    """The thing that was named last on its other side, where no side or direction was said: "no, the other side"."""
    sided = any(isinstance(f, F.Side | F.Figure | F.Rotate) or directions_of(f) for f in said.before)
    names = _items(said.active) or next((f.named for f in reversed(said.before) if f.named), ())
    if "side" in words_in(said.cued("flip")) and not sided and len(names) == 1:
        used = [p for p in said.active if p.cues or p.items or p.concept in ("pass", "around", "of", "at")]
        yield Candidate((E.Also(frame=F.Side(direction="other", objects=names)),), used, sure=True)


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

VERY = 0.1
"""The share of a path that is its very end."""


def very_ends(said: Remark) -> Iterator[Candidate]:
    """Less of an end of the path than was taken: "only the very last bit"."""
    ends = [p for p in said.active if p.concept in ("first", "last", "start", "goal")]
    if "very" not in words_in(said.pieces) or not ends or any(map(_tells_more, said.active)):
        return
    for i, frame in enumerate(said.before):
        if frame.part.kind in ("first", "last"):
            part = PathPart(frame.part.kind, amount=VERY, unit="share")
            rest = [*said.cued("only", "slight", "meant", "not"), *said.of("part", "slight", "large")]
            yield Candidate((E.Restrict(on=said.on(i), part=part),), (*ends, *rest), sure=True)


def places_instead(said: Remark) -> Iterator[Candidate]:
    """Near a thing instead of where it was: "not there, at the fan", "not at the start, at the fan"."""
    things, no = [p for p in said.active if p.items], said.cued("not", "except")
    denied, names = [p for p in said.active if p.text == "there" or p.concept in ENDED], _items(things)
    i = next((i for i in reversed(range(len(said.before))) if said.before[i].part), None)
    if i is None or len(names) != 1 or not denied or not no or any(p.number or heading(p) for p in said.active):
        return
    if said.active.index(denied[0]) < said.active.index(things[0]):
        used = (*things, *denied, *no, *said.cued("meant", "only"), *said.of("near", "at", "around"))
        yield Candidate((E.Restrict(on=said.on(i), part=PathPart("near", names)),), used, sure=True)


def old_paces(said: Remark) -> Iterator[Candidate]:
    """The speed as it was at some thing: "normal speed at the station again", "no need to slow down at the door"."""
    things, paced = [p for p in said.active if p.items], [*said.cued("of_pace"), *said.of("speed", "slower", "faster")]
    names, before = _items(things), [*said.of("original"), *said.cued("not")]
    if len(names) != 1 or not (paced and before) or any(map(_graded, said.pieces)):
        return
    paces = _paces(said)
    there = [i for i in paces if names[0] in said.before[i].part.places]
    used = (*things, *paced, *before, *said.cued("restart", "again", "redo", "undo"), *said.of(*NEAR, "pass"))
    if there:
        yield Candidate(tuple(E.Drop(on=said.on(i)) for i in there), used, sure=True)
    elif paces and said.of("original"):
        yield Candidate((E.Except(on=said.on(paces[-1]), part=PathPart("near", names)),), used, sure=True)


def speed_back(said: Remark) -> Iterator[Candidate]:
    """The speed as it was, and nothing else: "put the speed back to what it was, but leave the path as it is"."""
    given_up = {p.clause for p in said.cued("undo", "restart")} - {p.clause for p in said.cued("keep")}
    about = said.cued("keep") and any(p.clause in given_up for p in said.cued("of_pace"))
    drop = _paces(said) if about and not any(p.items for p in said.active) else []
    if 0 < len(drop) < len(said.before):
        yield Candidate(tuple(E.Drop(on=said.on(i)) for i in drop), said.active, sure=True)


def _paces(said: Remark) -> list[int]:
    """Numbers of the frames about speed."""
    return [i for i, frame in enumerate(said.before) if isinstance(frame, F.Pace)]


def _graded(piece: Phrase) -> bool:
    """Whether a piece says how much, so that a speed which is denied is to be less of it."""
    return piece.number is not None or piece.text.split()[0] in DEGREES


DEGREES = ("so", "as", "too", "that", "quite", "less", "more")
"""Words with which a speed that is denied is to be less of it, not gone."""

ENDED = ("start", "goal", "first", "last", "middle")
"""Concepts of places on a path that no thing names."""

OTHER_PARTS = (["other", "half"], ["other", "third"], ["other", "end"])


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


def ends_left_out(said: Remark) -> Iterator[Candidate]:
    """Everywhere but at the ends: "but not the start and the goal"."""
    ends, no = said.of("start", "goal"), said.cued("not", "except")
    parted = any(frame.part or isinstance(frame, F.MoveEnd) for frame in said.before)
    if ends and no and said.before and not parted:
        kinds = dict.fromkeys(STRETCH_AT[p.concept] for p in ends)
        yield Candidate(tuple(E.Except(part=PathPart(kind)) for kind in kinds), (*ends, *no))


def ends_kept(said: Remark) -> Iterator[Candidate]:
    """An end where it was before all turns: "leave the start where it was"; "same for the end", as the start stays."""
    pieces = [p for p in said.pieces if p.concept in ("start", "goal")]
    ends: list[Any] = list(dict.fromkeys(p.concept for p in pieces))
    words = _staying(said, ends)
    if ends and words and said.before and not any(map(_tells_more, said.pieces)):
        edits = tuple(edit for end in ends for edit in _back_at(said, end))
        yield Candidate(
            edits, (*pieces, *words, *said.cued("not", "also", "restart", "undo", "keep"), *said.of("rest")), sure=True
        )


def _back_at(said: Remark, end: F.End) -> Sequence[E.Edit]:
    """What puts an end back: without what moved it alone, or with it kept where all else moved it."""
    moved = [i for i, frame in enumerate(said.before) if isinstance(frame, F.MoveEnd) and frame.end == end]
    return [E.Drop(on=said.on(i)) for i in moved] or [E.Also(frame=F.Keep(what=end))]


def _staying(said: Remark, ends: Sequence[str]) -> list[Phrase]:
    """The pieces that say that ends stay, or that the one is the same as the other, which stays."""
    if stay := [p for p in said.pieces if "keep" in p.cues]:
        return [*stay, *(p for p in said.pieces if p.concept == "original")]
    kept = any(_stays_at(frame, *(F.OTHER_END[end] for end in ends)) for frame in said.before)
    return [p for p in said.active if "same" in p.text.split()] if kept and len(ends) == 1 else []


def _tells_more(piece: Phrase) -> bool:
    """Whether a piece says how far, which way or of which thing."""
    return bool(piece.number or piece.items or heading(piece))


def _stays_at(frame: F.SemanticFrame, *ends: str) -> bool:
    """Whether a frame leaves the path as it is at some end."""
    parts = (frame.part, *frame.part.parts) if frame.part else ()
    left = {part.parts[0].kind for part in parts if part.kind == "outside"}
    return any(STRETCH_AT[end] in left or (isinstance(frame, F.Keep) and frame.what == end) for end in ends)


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
    kept, left = _kept_and_left(said)
    meant = said.meant(kept)
    if not meant or any(_is_strange(p) for p in (*kept, *left)) or not (left or len(meant) < len(said.before)):
        return
    edits = _all_but(said, meant)
    question = "" if edits else "Nothing else was changed; what should be different?"
    yield Candidate(edits, (*kept, *left), question, sure=True)


def _all_but(said: Remark, kept: Sequence[int]) -> tuple[E.Drop, ...]:
    """Without all frames but some."""
    return tuple(E.Drop(on=said.on(i)) for i in range(len(said.before)) if i not in kept)


def _kept_and_left(said: Remark) -> tuple[list[Phrase], list[Phrase]]:
    """The pieces that name what is to stay, and those that say that the rest is to go; none where that is not said."""
    spans = _spans(said.pieces)
    gone = [i for i, span in enumerate(spans) if _is_given_up(span, before=spans[i + 1 :])]
    left = [p for i in gone for p in spans[i]]
    stays = (span for i, span in enumerate(spans) if i not in gone and _stays(span, gone, i))
    return _excepted(left) or [p for span in stays if said.meant(span) for p in span], left


def _excepted(pieces: Sequence[Phrase]) -> list[Phrase]:
    """What stands behind an "except"; nothing where there is none."""
    at = next((i for i, p in enumerate(pieces) if "except" in p.cues), len(pieces))
    return [*pieces[at + 1 :]]


def _is_strange(piece: Phrase) -> bool:
    return piece.number is not None or (piece.unknown and piece.text not in ("else", "other"))


def _cued(span: Sequence[Phrase], *cues: str) -> bool:
    """Whether a piece of a span has one of these cues."""
    return any(not piece.cues.isdisjoint(cues) for piece in span)


def _spans(pieces: Sequence[Phrase]) -> list[list[Phrase]]:
    """Pieces between commas, stops and conjunctions; "but" stays at the head of its span."""
    spans: list[list[Phrase]] = [[]]
    for piece in pieces:
        if piece.text in JOINTS:
            spans.append([piece] if piece.text == "but" else [])
        else:
            spans[-1].append(piece)
    return [span for span in spans if span]


JOINTS = frozenset((",", ".", ";", ":", "!", "-", "and", "but", "though", "although", "then"))


def _is_given_up(span: Sequence[Phrase], before: Sequence[Sequence[Phrase]]) -> bool:
    """Whether all, or all the rest, is to go: "undo everything", "the rest can go", or "reset" before something."""
    words = {*words_in(span)}
    rest = not words.isdisjoint(("rest", "others", "else"))
    going = _cued(span, "undo", "restart") or (rest and not words.isdisjoint(("go", "goes")))
    if not going or _cued(span, "keep", "not"):
        return False
    bare = (bool(before) or "everything" in words) and not any(map(_is_asked_besides, span))
    return rest or bare or _cued(span, "except")


def _is_asked_besides(piece: Phrase) -> bool:
    """Whether a piece of what is given up asks for anything else."""
    return piece.content and piece.concept != "whole" and piece.cues.isdisjoint(("undo", "restart", "only"))


def _stays(span: Sequence[Phrase], gone: Sequence[int], at: int) -> bool:
    """Whether what is named is to stay: "keep the lift"; where nothing else is said to go, "keep only the lift"."""
    if _cued(span, "undo", "restart", "not", "except") or any(p.text == "alone" for p in span):
        return False
    keep, just = _cued(span, "keep"), _cued(span, "only")
    but = span[0].text == "but" and at - 1 in gone
    return keep or just or but if gone else keep and just


def only_clauses(said: Remark) -> tuple[set[int], set[int]]:
    """The clauses that say what alone is wanted, and those beside them that say what is to stay."""
    keeping = {p.clause for p in said.cued("keep")}
    return {p.clause for p in said.cued("only") if p.text.startswith(("only", "just"))} - keeping, keeping


def only_and_keep(said: Remark) -> Iterator[Candidate]:
    """Without all but what is named, as the rest is to stay: "only the slowing down, leave the path alone"."""
    alone, keeping = only_clauses(said)
    kept = said.meant([p for p in said.naming if p.clause in alone]) if keeping else []
    if 0 < len(kept) < len(said.before):
        yield Candidate(_all_but(said, kept), [p for p in said.active if p.clause in alone | keeping], sure=True)


def only(said: Remark) -> Iterator[Candidate]:
    """Without all but what is named: "only the slowing down"."""
    kept = said.meant(said.naming) if said.cued("only") else []
    used = (*said.naming, *said.cued("only"))
    if said.cued("keep"):  # "leave the speed alone"
        yield from _without(said, kept, (), used)
    elif 0 < len(kept) < len(said.before):
        yield Candidate(_all_but(said, kept), used)
    elif len(kept) == 1:
        ways = {heading(p) for p in said.naming}
        yield Candidate(tuple(E.Drop(on=way) for way in directions_of(said.before[0]) if way not in ways), used)


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
