"""What was meant instead: the other way, another direction or object, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import apply, directions_of
from ovita.instruct.remarks import ADJECTIVES, Candidate, Phrase, Remark, heading
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


def drops(said: Remark) -> Iterator[Candidate]:
    """Without some of the frames: "forget the shift", "no waiting"."""
    pieces = said.cued("undo") or [p for p in said.of("original") if p.text != "now"]
    yield from _ordinals(said, pieces)
    denied = [] if said.cued("less", "weak", "enough") else _denied(said)
    words = denied or (said.naming if pieces else [])
    used = (*pieces, *words, *said.cued("not", "except", "keep"), *(said.cued("only") if pieces else ()))
    yield from _without(said, said.meant(words), words, used)


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
