"""What was meant instead: the other way, another direction, object or end, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, apply, directions_of
from ovita.instruct.remarks import DIRECTIONS, FACTORS, SENSES, Candidate, Phrase, Remark, heading, senses_of
from ovita.instruct.whereabouts import parts_in
from ovita.paths.scene import Scene


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
    for i in reversed(said.targets if no or meant or denied else []):
        against = {OPPOSITE.get(sense) for sense in senses_of(said.before[i])} - {None, "less"}
        pieces = [p for p in said.active if SENSES.get(p.concept) in against and len(p.text.split()) < 3]
        pieces = [p for p in pieces if not said.negated(p)]
        if pieces:
            yield Candidate((E.Flip(on=said.on(i)),), (*pieces, *no, *meant, *denied, *said.cued("not")), 0.5)


def directions(said: Remark) -> Iterator[Candidate]:
    """Another direction or end than was said."""
    for i in reversed(said.targets):
        frame = said.before[i]
        known = directions_of(frame)
        if not known:
            continue
        named = [p for p in said.active if heading(p)]
        ways = ("left", "right", "front", "back") if isinstance(frame, F.Side | F.Tilt) else DIRECTIONS
        new = [p for p in named if heading(p) in ways and heading(p) not in known and not said.negated(p)]
        if new:
            old = [p for p in named if heading(p) in known]
            old += [p for p in said.active if isinstance(frame, F.Side) and {*p.items} & {*frame.objects}]
            direction: Any = heading(new[-1])
            edit = E.Replace(on=said.on(i), direction=direction)
            yield Candidate((edit,), (*new, *old, *said.cued("meant", "not", "flip")), 1.0 if old else 0.3)
            return


def objects(said: Remark) -> Iterator[Candidate]:
    """Another object than was said, or the same for another one."""
    known = {name for frame in said.before for name in frame.named}
    new = [p for p in said.active if p.items and not set(p.items) <= known and not said.negated(p)]
    about = [i for i in said.targets if said.before[i].named] or [i for i, f in enumerate(said.before) if f.named]
    others = [p for p in said.active if p.text in ("other", "wrong", "the other", "wrong one", "other one")]
    others += [p for p in new if len(p.items) > 1 and "other" in p.text.split() and not p.text.endswith("s")]
    if not about or not (new or others):
        return
    frame, on = said.before[about[-1]], said.on(about[-1])
    items = tuple(dict.fromkeys(name for p in new for name in p.items)) or said.alike(frame)
    one = not any(p.text.endswith("s") or "both" in p.text.split() or len(new) > 1 for p in new)
    items = tuple(name for name in items if name not in known) if others or one else items
    if (others or not new) and len(items) != 1:
        if items:
            question = "Which one: " + " or ".join(repr(name) for name in items) + "?"
            yield Candidate((), (*others, *said.cued("meant")), 1.0, question, items)
        return
    old = [p for p in said.active if set(p.items) & known]
    edit = E.Replace(on=on, objects=items)
    yield Candidate((edit,), (*new, *others, *old, *said.cued("meant", "not", "flip", "except")), 0.4)
    if said.cued("except"):  # "and the same exception around the boat"
        return
    also = [*said.cued("also", "same"), *(p for p in said.pieces[:1] if p.text == "and")]
    if also:
        (copy,) = apply((replace(edit, on=""),), (frame,), Scene())
        yield Candidate((E.Also(frame=copy),), (*new, *others, *also), 1.0)


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
    if said.cued("less", "weak", "enough"):  # "the tempo should drop less than that"
        pieces = [p for p in pieces if len(p.text.split()) > 1]
    denied = [] if said.cued("less", "weak") else _denied(said)
    clauses = {p.clause for p in pieces}
    words = denied or [p for p in said.active if p.clause in clauses]
    yield from _ordinals(said, pieces)
    kinds = [p for p in words if not p.items]
    meant = said.meant(kinds) or said.meant(words) or (said.meant(said.active) if pieces else [])
    used = (
        *pieces,
        *words,
        *said.cued("not", "except", "keep", "but"),
        *(p for p in said.active if p.concept == "whole"),
    )
    if meant and (pieces or denied):
        ways = [heading(p) for p in words if heading(p)]
        yield from _without(said, meant, ways, used)
    alone = [p for p in said.active if p.text == "alone"] if said.cued("keep") else []
    named = said.meant(said.active)
    if alone and named:  # "leave the speed alone"
        yield from _without(said, named, (), (*said.active,))
    elif said.cued("only") and not (
        list(parts_in(said)) or any(p.number or p.cues & set(FACTORS) for p in said.active)
    ):
        yield from _rest(said, said.meant(said.active))


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
