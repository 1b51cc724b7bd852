"""Reading feedback: an utterance about what was just done, as edits on the frames of the turns before it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.editing import OPPOSITE, apply, scale_of, slots
from ovita.instruct.notation import name_of, quantity
from ovita.instruct.remarks import (
    ACTING,
    ADJECTIVES,
    DIRECTIONS,
    JUDGING,
    SENSES,
    SKIPPED,
    Phrase,
    Remark,
    directions_of,
    heading,
    names,
    pieces_of,
    senses_of,
)
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array
from ovita.units import find

NOTHING = F.Reading()
"""What is read where nothing is."""

SHARES = {"half": 0.5, "third": 1 / 3, "quarter": 0.25, "fifth": 0.2, "tenth": 0.1}
FACTORS = {"twice": 2.0, "treble": 3.0, "halve": 0.5, "third": 1 / 3, "quarter": 0.25, "sesqui": 1.5}


@dataclass(frozen=True)
class Candidate:
    """One way to read an utterance.

    Args:
        edits: What it changes.
        used: The pieces that it is read from.
        prior: How much more, or less, likely it is than another with as many pieces.
        question: What has to be asked back.
        asked: What could be meant.
    """

    edits: tuple[E.Edit, ...]
    used: tuple[Phrase, ...]
    prior: float = 0.0
    question: str = ""
    asked: tuple[str, ...] = ()


def _weight(piece: Phrase) -> float:
    if piece.items or piece.number:
        return 3.0
    if piece.cues & {"accept", "keep", "not", "enough", "same", "weak"} and not piece.cues & ACTING:
        return 0.5
    size = len([w for w in piece.text.split() if w not in SKIPPED])
    return 1.0 + size if piece.cues else 1.5 if SENSES.get(piece.concept) in DIRECTIONS else 0.3


def _score(c: Candidate, said: Remark) -> float:
    used = {id(p) for p in c.used}
    read = sum(_weight(p) for p in said.active if id(p) in used)
    left = sum(_weight(p) for p in said.active if id(p) not in used and p.content)
    return read - 0.6 * left + c.prior


def read_feedback(
    text: str,
    scene: Scene,
    before: Sequence[F.SemanticFrame],
    positions: Array | None = None,
    fresh: F.Reading = NOTHING,
) -> F.Reading | None:
    """Read an utterance as edits on the frames before it; None if it says nothing about them.

    Args:
        text: What the person said.
        scene: The surroundings.
        before: The frames of the turns that it may be about, oldest first.
        positions: The path (N, 3) [m], for phrases such as "the object nearest to the goal".
        fresh: What a reader of instructions makes of the same words; it is needed for "and wait there too", and to tell
            instructions that say nothing about the frames before.
    """
    said = Remark(pieces_of(text, scene, before, positions), tuple(before), scene.names)
    found = [
        *_further_frames(said, fresh),
        *_kept(said, fresh),
        *(candidate for row in ROWS for candidate in row(said)),
    ]
    if not found:
        return None
    best = max(found, key=lambda c: _score(c, said))
    used = {id(p) for p in best.used}
    unread = tuple(p.text for p in said.active if p.content and id(p) not in used and _weight(p) >= 1.5)
    if (
        fresh.frames
        and not (fresh.unread or fresh.question or fresh.improper)
        and not _looks_back(best, said, unread, fresh)
    ):
        return None
    return F.Reading(edits=best.edits, unread=unread, question=best.question, asked=best.asked)


LOOKING_BACK = frozenset(
    """undo redo restart accept explain again flip more less weak twice treble halve third quarter sesqui meant except
    also same not enough whole left right""".split()
)
"""Cues that speak of what was done."""


def _looks_back(best: Candidate, said: Remark, unread: Sequence[str], fresh: F.Reading) -> bool:
    """Whether a sentence that would do as an instruction is feedback: it speaks of what was done, or compares."""
    if any(isinstance(edit, E.Also | E.Drop) for edit in best.edits) or not said.before:
        return True
    cues = {cue for p in best.used for cue in p.cues} & LOOKING_BACK
    words = [p for p in said.active if p.content]
    kin = any(_kin(frame, known) for frame in fresh.frames for known in said.before)
    if not kin and not cues & SETTLED and (len(words) > 3 or said.elsewhere):
        return False
    compared = any(p.text.split()[0].endswith("er") for p in words) and len(words) <= 3
    judged = any(p.text.split()[0] in ("too", "so") or said.judged(p) for p in said.active)
    detailed = unread and any(p.number or p.items for p in said.active)
    return (bool(cues) or compared or judged or bool(said.praised)) and not detailed


SETTLED = frozenset("undo redo restart accept explain again flip meant except also same".split())
"""Cues that no instruction of its own has."""


def _kin(frame: F.SemanticFrame, known: F.SemanticFrame) -> bool:
    """Whether two frames are about the same: of one kind, and along the same axis if they have one."""
    ways, others = directions_of(frame), directions_of(known)
    along = not ways or not others or any(w in (o, OPPOSITE[o]) for w in ways for o in others)
    return frame.NAME == known.NAME and along


def _further_frames(said: Remark, fresh: F.Reading) -> Iterator[Candidate]:
    """Frames beside those before: "and wait there too"."""
    also = said.cued("also")
    opened = [p for p in said.pieces[:1] if p.text in ("and", "now", "n")]
    if fresh.frames and not (fresh.question or fresh.improper) and (also or opened):
        edits = tuple(E.Also(frame=_placed(frame, said, fresh)) for frame in fresh.frames)
        yield Candidate(edits, said.active if not fresh.unread else (*also, *opened), 1.0)


def _kept(said: Remark, fresh: F.Reading) -> Iterator[Candidate]:
    """What is to stay as it was: without the frames that changed it."""
    kinds: dict[str, tuple[type[F.SemanticFrame], ...]] = {"speed": (F.Pace,), "height": (F.Height,)}
    kinds |= {"goal": (F.MoveEnd,), "start": (F.MoveEnd,), "path": (F.Shift,)}
    whats = [frame.what for frame in fresh.frames if isinstance(frame, F.Keep)]
    gone = [f for what in whats for f in said.before if isinstance(f, kinds.get(what, ()))]
    if gone and len(whats) == len(fresh.frames) and not any(isinstance(f, F.Keep) for f in said.before):
        yield Candidate(tuple(E.Drop(on=name_of(f)) for f in gone), said.active, 2.0)


def _placed(frame: F.SemanticFrame, said: Remark, fresh: F.Reading) -> F.SemanticFrame:
    """A further frame at the place of the frames before, where it says "there"."""
    there = any(p.concept == "there" or p.text == "there" for p in said.active)
    if not there or not said.before:
        return frame
    last = said.before[-1]
    place = getattr(last, "place", "") or next(iter(last.named), "")
    place = "goal" if isinstance(last, F.MoveEnd) and last.end == "goal" else place
    if isinstance(frame, F.Wait | F.StopAt) and not frame.place:
        return replace(frame, place=place)
    if frame.part == WHOLE and isinstance(place, str) and place:
        part = PathPart("last", unit="share") if place == "goal" else PathPart("near", (place,))
        return replace(frame, part=last.part if last.part != WHOLE else part)
    return frame


def named_frames(text: str, scene: Scene, before: Sequence[F.SemanticFrame]) -> list[int]:
    """Numbers of the frames that an answer such as "the shift" names."""
    said = Remark(pieces_of(text, scene, before, None), tuple(before))
    return said.meant(said.pieces)


def named_objects(text: str, scene: Scene) -> tuple[SceneObject, ...]:
    """The objects that an answer such as "the blue one" names."""
    names_ = {name for piece in pieces_of(text, scene, (), None) for name in piece.items}
    return tuple(item for item in scene if item.name in names_)


def only_where(text: str, scene: Scene) -> tuple[str, ...]:
    """The words of an utterance that says nothing but where: "somewhere between the cup and the bottle only"; or ()."""
    said = Remark(pieces_of(text, scene, (), None), ())
    placed = {id(p) for part in parts_in(said) for p in part[2]}
    narrow = said.cued("only", "except")
    rest = [p for p in said.active if p.content and id(p) not in placed and p not in narrow]
    vague = [p for p in rest if "vague" in p.cues]
    return tuple(p.text for p in vague or narrow) if placed and narrow and len(rest) == len(vague) else ()


def stated(text: str, scene: Scene) -> tuple[F.Quantity | None, set[str]]:
    """The one quantity of an utterance, or None, and its words."""
    pieces = pieces_of(text, scene, (), None)
    numbers = [piece.number for piece in pieces if piece.number]
    return (numbers[0] if len(numbers) == 1 else None), {word for p in pieces for word in p.text.split()}


# Rows: each reads one kind of edit.

COMMANDS: dict[str, Any] = {"redo": 0.6, "restart": 0.4, "undo": 0.0, "explain": 1.5, "accept": -0.5}


def _commands(said: Remark) -> Iterator[Candidate]:
    for command, prior in COMMANDS.items():
        pieces = said.cued(command) or [p for p in said.pieces if command == "accept" and p.cues & {"accept"}]
        pieces = said.cued("redo", "undo") if command == "redo" and not said.before else pieces
        if pieces and not (command == "accept" and said.asks):
            extra = 2.0 if command == "redo" and not said.before else 0.0
            counts = [p for p in said.active if _steps(p)] if command in ("undo", "redo") else []
            edit = E.Command(command=command, steps=_steps(counts[0]) if counts else 1)  # type: ignore[arg-type]
            yield Candidate((edit,), (*pieces, *counts, *said.cued("again", "keep")), prior + extra)


def _steps(piece: Phrase) -> int:
    """How many turns a piece counts: "the last two", "both"."""
    q = piece.number
    return 2 if piece.text == "both" else int(q.value) if q and q.unit in ("", "step") and 1 < q.value <= 50 else 0


def _drops(said: Remark) -> Iterator[Candidate]:
    """Without some of the frames: "forget the shift", "no waiting", "only the slowing down"."""
    pieces = said.cued("undo") or [p for p in said.active if p.concept == "original"]
    denied = [p for p in said.active if said.denies(p) and any(names(p, f) for f in said.before)]
    denied = [] if any(heading(p) and not said.denies(p) for p in said.active) else denied
    clauses = {p.clause for p in (*pieces, *denied)}
    words = denied or [p for p in said.active if p.clause in clauses]
    yield from _ordinals(said, pieces)
    meant = said.meant(words) or (said.meant(said.active) if pieces else [])
    ways = [heading(p) for p in words if heading(p)]
    used = (*pieces, *words, *said.cued("not", "except", "keep"))
    if meant and (pieces or denied):
        frame = said.before[meant[0]]
        if len(meant) == 1 and ways and len(directions_of(frame)) > 1:
            yield Candidate(tuple(E.Drop(on=way) for way in ways if way in directions_of(frame)), used, 1.2)
        elif len(meant) < len(said.before):
            yield Candidate(tuple(E.Drop(on=name_of(said.before[i])) for i in meant), used, 1.0)
        elif len(said.before) == 1:
            yield Candidate((E.Drop(),), used, 0.3)
    only = said.meant(said.active) if said.cued("only") and not list(parts_in(said)) else []
    if only and len(only) < len(said.before):
        rest = tuple(E.Drop(on=name_of(f)) for i, f in enumerate(said.before) if i not in only)
        yield Candidate(rest, said.active, 0.6)
    elif len(only) == 1 and (kept := {heading(p) for p in said.active} - {""}):
        gone = [way for way in directions_of(said.before[only[0]]) if way not in kept]
        if gone and len(gone) < len(directions_of(said.before[only[0]])):
            yield Candidate(tuple(E.Drop(on=way) for way in gone), said.active, 0.6)


def _ordinals(said: Remark, pieces: Sequence[Phrase]) -> Iterator[Candidate]:
    """Without one of the turns: "forget the first one"."""
    counted = {"first": 1, "second": 2, "third": 3}
    for i, piece in enumerate(said.active[:-1] if pieces else ()):
        if piece.text.split()[-1] in counted and said.active[i + 1].text in ("one", "turn", "step", "change"):
            edit = E.Drop(on=f"turn {counted[piece.text.split()[-1]]}")
            yield Candidate((edit,), (*pieces, piece, said.active[i + 1]), 3.0)


def _flips(said: Remark) -> Iterator[Candidate]:
    pieces = said.cued("flip", "ccw", "cw")
    turned = [p for p in pieces if p.cues & {"ccw", "cw"}]
    if pieces and (not turned or any(isinstance(f, F.Figure | F.Rotate) for f in said.before)):
        ways = [i for i in said.targets if directions_of(said.before[i])]
        i = said.targets[-1] if len(said.targets) == 1 else ways[-1] if ways else None
        on = "" if i is None else said.on(i)
        yield Candidate((E.Flip(on=on),), (*pieces, *said.cued("meant")), 1.0)


def _contraries(said: Remark) -> Iterator[Candidate]:
    """The other way round, by a word for it: "no, speed up", "I said away from it"."""
    no = [p for p in said.pieces[:1] if p.text in ("no", "nope", "nah")]
    meant = said.cued("meant")
    denied = [p for p in said.active if p.text.endswith("er") and said.negated(p)]
    for i in reversed(said.targets if no or meant or denied else []):
        against = {OPPOSITE.get(sense) for sense in senses_of(said.before[i])} - {None, "less"}
        pieces = [p for p in said.active if SENSES.get(p.concept) in against and len(p.text.split()) < 3]
        pieces = [p for p in pieces if not said.negated(p)]
        if pieces:
            yield Candidate((E.Flip(on=said.on(i)),), (*pieces, *no, *meant, *denied), 0.5)


def _directions(said: Remark) -> Iterator[Candidate]:
    """Another direction or end than was said."""
    for i in reversed(said.targets):
        frame = said.before[i]
        known = directions_of(frame)
        if not known:
            continue
        named = [p for p in said.active if heading(p)]
        new = [p for p in named if heading(p) not in known and not said.negated(p)]
        if new:
            old = [p for p in named if heading(p) in known]
            direction: Any = heading(new[-1])
            edit = E.Replace(on=said.on(i), direction=direction)
            yield Candidate((edit,), (*new, *old, *said.cued("meant", "not", "flip")), 1.0 if old else 0.3)
            return


def _objects(said: Remark) -> Iterator[Candidate]:
    """Another object than was said, or the same for another one."""
    known = {name for frame in said.before for name in frame.named}
    new = [p for p in said.active if p.items and not set(p.items) <= known and not said.negated(p)]
    about = [i for i in said.targets if said.before[i].named] or [i for i, f in enumerate(said.before) if f.named]
    others = [p for p in said.active if p.text in ("other", "wrong", "the other", "wrong one", "other one")]
    if not about or not (new or others):
        return
    frame, on = said.before[about[-1]], said.on(about[-1])
    items = tuple(dict.fromkeys(name for p in new for name in p.items)) or said.alike(frame)
    if not new and len(items) != 1:
        if items:
            question = "Which one: " + " or ".join(repr(name) for name in items) + "?"
            yield Candidate((), (*others, *said.cued("meant")), 1.0, question, items)
        return
    old = [p for p in said.active if set(p.items) & known]
    edit = E.Replace(on=on, objects=items)
    yield Candidate((edit,), (*new, *others, *old, *said.cued("meant", "not", "flip")), 0.4)
    also = [*said.cued("also", "same"), *(p for p in said.pieces[:1] if p.text == "and")]
    if also:
        (copy,) = apply((replace(edit, on=""),), (frame,), Scene())
        yield Candidate((E.Also(frame=copy),), (*new, *others, *also), 1.0)


def _ends(said: Remark) -> Iterator[Candidate]:
    """The other end of the path than was said."""
    for frame in said.before:
        pieces = [p for p in said.active if p.concept in ("start", "goal")]
        end: Any = pieces[-1].concept if pieces else ""
        if isinstance(frame, F.MoveEnd) and pieces and end != frame.end:
            yield Candidate((E.Replace(end=end),), (*pieces, *said.cued("meant", "not")), 1.0)
            if also := said.cued("also", "same"):
                yield Candidate((E.Also(frame=replace(frame, end=end)),), (*pieces, *also), 1.5)


def _places(said: Remark) -> Iterator[Candidate]:
    """Only in a part of the path, or everywhere but there."""
    only, but = said.cued("only"), said.cued("except")
    known = {name for frame in said.before for name in frame.named}
    parts = [part for part in parts_in(said) if only or but or not set(part[2][0].items) & known]
    if not parts or not said.before or said.cued("vague"):
        return
    leading = any(p.text == "but" for p in said.active[:1]) and said.cued("not")
    open_ = [] if leading else [p for p in parts if not p[1]]
    pieces = tuple(piece for part in parts for piece in part[2])
    i = said.targets[-1]
    on = said.on(i) if len(said.targets) == 1 else ""
    clauses = {p.clause for p in pieces}
    drops = [p for p in said.cued("undo") if len(said.before) == 1 and p.clause in clauses]
    drops = [] if any(_steps(p) for p in pieces) else drops
    if but or drops or (not open_ and not only):
        edits = tuple(E.Except(on=on, part=part) for part in dict.fromkeys(part[0] for part in parts))
        yield Candidate(edits, (*pieces, *but, *drops, *said.cued("not")), 0.6)
    corrects = len(parts) > len(open_) or said.before[i].part != WHOLE
    if open_ and (only or corrects or not but):
        edit = E.Restrict(on=on, part=open_[-1][0])
        used = (*pieces, *only, *said.cued("meant", "not"))
        yield Candidate((edit,), used, 0.8 if only else 0.0 if corrects else -1.5)


def _whole(said: Remark) -> Iterator[Candidate]:
    whole = said.cued("whole")
    if whole and said.before and said.before[said.targets[-1]].part != WHOLE:
        yield Candidate((E.Restrict(on=said.on(said.targets[-1]), part=WHOLE),), tuple(whole), 0.0)


def _numbers(said: Remark) -> Iterator[Candidate]:
    """Other values for slots."""
    found: dict[tuple[int, str], tuple[E.Edit, list[Phrase]]] = {}
    spent: list[Phrase] = []
    held = [(i, s, q) for i, f in enumerate(said.before) for s, q in f.quantities.items()]
    placed = {id(p) for part in parts_in(said) for p in part[2]}
    stated = [p for p in said.active if p.number and id(p) not in placed]
    for piece in stated or _turn_words(said):
        q = piece.number or quantity("1")
        old = [(i, s) for i, s, had in held if _alike(q, had)]
        if old and (len(stated) > 1 or said.negated(piece)):
            spent.append(piece)
            continue
        where = _slot_of(piece, said)
        if where is None or any(
            heading(p) not in directions_of(said.before[where[0]]) for p in said.active if heading(p)
        ):
            continue
        i, slot = where
        step: Any = _step(piece, said)
        had = said.before[i].quantities.get(slot)
        if slot == "turns":
            q = replace(q, unit="")
        elif q.unit == "m" and had is not None and had.unit == "m/s":
            q = replace(q, unit="m/s", said="")
        edit = E.Set(on=said.on(i), slot=slot, quantity=q, step=step)
        found[where] = edit, [piece, *_around(piece, said)]
    if found:
        pieces = [p for _, used in found.values() for p in used]
        extra = said.cued("more", "less", "enough", "meant", "not", "only", "radius", "turns", "size", "duration")
        yield Candidate(tuple(edit for edit, _ in found.values()), (*pieces, *spent, *extra, *stated), 0.5)


def _alike(q: F.Quantity, had: F.Quantity) -> bool:
    values = (had.value,) if q.unit else (had.value / scale_of(had), had.value, had.value * 100)
    return any(abs(q.value - v) <= 1e-6 * max(1.0, abs(v)) for v in values) and q.unit in ("", had.unit)


def _turn_words(said: Remark) -> list[Phrase]:
    """Once and twice as numbers of turns."""
    if not any(isinstance(f, F.Figure) and f.turns for f in said.before):
        return []
    counts = {"once": 1.0, "twice": 2.0, "thrice": 3.0}
    bare = [p for p in said.active if p.text in counts and not any(q.text in ("as", "of") for q in said.active)]
    return [replace(p, number=F.Quantity(counts[p.text], "turns")) for p in bare]


NAMED = {"radius": "radius", "turns": "turns", "size": "size", "duration": "duration"}


def _slot_of(piece: Phrase, said: Remark) -> tuple[int, str] | None:
    """The frame and slot that a number fits best: named, of its unit, already filled, in the last frame."""
    assert piece.number is not None
    unit = piece.number.unit
    around = [p for p in said.active if p.clause == piece.clause] if unit else said.active
    cues = {NAMED[c] for p in around for c in p.cues if c in NAMED}
    senses = {SENSES.get(p.concept, "") for p in around}
    best: tuple[float, int, str] | None = None
    for i in said.targets:
        frame = said.before[i]
        for rank, (slot, units) in enumerate(slots(frame).items()):
            had = frame.quantities.get(slot)
            if unit == "m" and had is not None and had.unit == "m/s":
                return i, slot
            if unit == "x" and slot == "turns":
                return i, slot
            if unit not in units or (unit in ("%", "x") and had is not None and had.unit not in ("%", "x")):
                continue
            score = 3.0 * (slot in cues or slot in senses) + 2.0 * (slot in frame.quantities) - 0.1 * rank + 0.01 * i
            if best is None or score > best[0]:
                best = score, i, slot
    return None if best is None else best[1:]


def _around(piece: Phrase, said: Remark) -> list[Phrase]:
    return [
        p for p in said.active if p.clause == piece.clause and not p.items and not p.number and not p.cues & {"undo"}
    ]


def _step(piece: Phrase, said: Remark) -> int:
    """1 or -1 if a number is more or less than before ("5 cm higher", "increase it by 0.1"), 0 if it is the value."""
    pieces = said.active
    i = pieces.index(piece) if piece in pieces else 0
    before = [p for p in pieces[:i] if p.clause == piece.clause]
    behind = [p for p in pieces[i + 1 : i + 3] if "turns" not in p.cues][:1]
    if {p.text for p in before[-1:]} & {"another", "extra"}:
        return 1
    if {p.text for p in before[-1:]} == {"by"} and (by := {c for p in before for c in p.cues} & {"more", "less"}):
        return 1 if "more" in by else -1
    for p in behind:
        if p.text in ("more", "further", "extra", "farther"):
            return 1
        if p.text in ("less", "fewer"):
            return -1
        sense = SENSES.get(p.concept, "") if p.text.endswith("er") else ""
        known = [senses_of(said.before[k]) for k in said.targets]
        if sense and any(sense in senses for senses in known):
            return 1
        if sense and any(OPPOSITE.get(sense) in senses for senses in known):
            return -1
    return 0


def _amounts(said: Remark) -> Iterator[Candidate]:
    """More, less, or a factor on it."""
    sized = [i for i in said.targets if slots(said.before[i]) or isinstance(said.before[i], F.Smooth | F.Curve)]
    if not sized:
        return
    degrees = {d: [p for p in said.cued(d) if not said.judged(p)] for d in ("slight", "large")}
    degree: Any = next((d for d, found in degrees.items() if found), None)
    named = [p for p in said.active if p.cues and any(names(p, said.before[i]) for i in sized)]
    used = (*said.cued("more", "less", "weak", "slight", "large", "enough", "not", "same"), *named)
    factor, pieces = _factor(said)
    if factor is not None:
        yield from _scaled(said, sized, lambda on: E.Rescale(on=on, factor=factor), (*used, *pieces), 1.0)
        return
    signs = {i: sensed for i in sized if (sensed := _sensed(said, said.before[i]))}
    generic = -1 if said.cued("less") else 1 if said.cued("more", "weak") else 0
    if not signs and generic:
        signs = {i: (generic, ()) for i in sized}
    if signs:
        last = list(signs)[-1]
        change: Any = "more" if signs[last][0] > 0 else "less"
        pieces = (*used, *signs[last][1])
        yield from _scaled(said, list(signs), lambda on: E.Rescale(on=on, change=change, degree=degree), pieces, 0.0)


def _scaled(
    said: Remark, where: list[int], edit: Callable[[str], E.Edit], used: tuple[Phrase, ...], prior: float
) -> Iterator[Candidate]:
    kinds = list(dict.fromkeys(name_of(said.before[i]) for i in where))
    if len(kinds) > 1:
        yield Candidate((), used, prior, "Which do you mean: " + " or ".join(kinds) + "?", tuple(kinds))
    else:
        yield Candidate((edit(said.on(where[-1])),), used, prior)


def _factor(said: Remark) -> tuple[float | None, tuple[Phrase, ...]]:
    """A factor on what was done: half of that, three times as much, 50 % more."""
    for i, piece in enumerate(said.active):
        before, behind = said.active[max(i - 1, 0) : i], said.active[i + 1 : i + 2]
        ordinal = any(p.concept in ORDINALS for p in before)
        word = next((cue for cue in FACTORS if cue in piece.cues), "")
        if word and not ordinal and not (word == "twice" and _turn_words(said)):
            return FACTORS[word], (piece,)
        near = {cue for p in (*before, *behind) for cue in p.cues}
        q = piece.number
        by = said.active[max(i - 3, 0) : i] if any(p.text == "by" for p in before) else ()
        near |= {cue for p in by for cue in p.cues}
        if q is not None and q.unit == "%" and near & {"more", "less"}:
            return 1 - q.value if "less" in near else 1 + q.value, (piece, *before, *behind, *by)
        if q is not None and q.unit == "x" and not said.counted(q):
            return q.value, (piece, *behind)
    return None, ()


ORDINALS = ("first", "last", "middle", "second")


def _sensed(said: Remark, frame: F.SemanticFrame) -> tuple[int, tuple[Phrase, ...]] | None:
    """1 if more of a frame is wanted, -1 if less, by words that say which way: "slower", "too close", "not so high"."""
    senses = senses_of(frame)
    for i, piece in enumerate(said.active):
        words = piece.text.split()
        adjective = ADJECTIVES.get(words[0], "") if len(words) == 1 else ""
        sense = adjective or SENSES.get(piece.concept, "")
        along = 1 if sense in senses else -1 if OPPOSITE.get(sense) in senses else 0
        if not along or piece.text in ("further", "farther"):
            continue
        before = [p for p in said.active[max(i - 2, 0) : i] if p.clause == piece.clause]
        behind = said.active[i + 1 : i + 3]
        enough = any("enough" in p.cues for p in behind[:1])
        judged = not enough and any(p.text in JUDGING or p.cues & {"less", "not"} for p in before)
        judged = judged or any("less" in p.cues for p in behind)
        if piece.cues & {"slight", "large"} and not judged:
            continue
        resolved = len(words) > 1 and words[0] in ("too", "so", "less", "that")
        if resolved or words[0].endswith("er") or (adjective and (judged or enough or said.cued("more", "weak"))):
            return (-along if judged and not resolved else along), (piece, *before)
        if said.cued("less"):
            return -1, (piece,)
        if said.cued("more", "weak") or (sense not in DIRECTIONS and said.cued("slight", "large")):
            return along, (piece,)
    return None


def _repeats(said: Remark) -> Iterator[Candidate]:
    pieces = said.cued("again")
    if pieces and said.before:
        yield Candidate((E.Again(),), (*pieces, *said.cued("same", "also", "meant", "weak")), 0.3)


def parts_in(said: Remark) -> Iterator[tuple[PathPart, bool, tuple[Phrase, ...]]]:
    """The parts of the path that are named, whether "not" stands before them, and their pieces."""
    pieces = said.active
    for i, piece in enumerate(pieces):
        before = pieces[max(i - 3, 0) : i]
        said_not = said.negated(piece) or any("not" in p.text.split() for p in before[-1:])
        words = {p.concept for p in before}
        behind = pieces[i + 1 : i + 4]
        if piece.items:
            kind = next((k for k in ("after", "before") if k in words), "near")
            kind = "before" if "up to" in " ".join(p.text for p in before) else kind
            lead = tuple(p for p in before if p.concept in ("after", "before", "near", "around", "when", "pass"))
            two = [p for p in behind if p.items]
            if "between" in words and two:
                yield PathPart("between", (piece.items[0], two[0].items[0])), said_not, (piece, two[0], *before)
                return
            if "between" not in words:
                yield _at(kind, piece.items), said_not, (piece, *lead)
        elif _stretches(piece, behind):
            part, used = _stretch(piece, behind)
            yield part, said_not, (piece, *used)
        elif piece.concept == "waypoints" and behind and behind[0].number and i + 2 < len(pieces):
            last = next((p for p in pieces[i + 2 : i + 4] if p.number), None)
            if last is not None and last.number is not None:
                low, high = behind[0].number.value - 1, last.number.value - 1
                yield PathPart("range", amount=low, until=high), said_not, (piece, behind[0], last)
        elif piece.concept in ("up", "down") and any(p.concept in ("when", "only") for p in before):
            yield PathPart("heading", direction=piece.concept), said_not, (piece, *before)


def _stretches(piece: Phrase, behind: Sequence[Phrase]) -> bool:
    """Whether a stretch of the path begins there: "the last third", "the second half"."""
    if piece.concept == "second":
        return any(p.concept in ("half", "third") for p in behind[:1])
    return piece.concept in ("first", "last", "middle", "start", "goal") and not {p.text for p in behind[:1]} & TURNS


TURNS = frozenset("change changes turn step edit one instruction modification".split())


def _at(kind: str, items: Sequence[str]) -> PathPart:
    parts = tuple(PathPart(kind, (name,)) for name in items)
    return parts[0] if len(parts) == 1 else PathPart("either", parts=parts)


def _stretch(piece: Phrase, behind: Sequence[Phrase]) -> tuple[PathPart, tuple[Phrase, ...]]:
    kind = {"start": "first", "goal": "last"}.get(piece.concept, piece.concept)
    if kind == "second":
        return (PathPart("last", amount=0.5, unit="share") if behind[0].concept == "half" else PathPart("middle")), (
            behind[0],
        )
    share = next((p for p in behind[:1] if p.concept in SHARES), None)
    number = next((p for p in behind[:1] if p.number), None)
    if share is not None:
        return PathPart(kind, amount=SHARES[share.concept], unit="share"), (share,)
    if number is not None and number.number is not None:
        units: dict[str, Any] = {"%": "share", "m": "m", "s": "s"}
        return PathPart(kind, amount=number.number.value, unit=units.get(number.number.unit, "waypoints")), tuple(
            behind
        )
    unit = find(behind[0].text) if behind else None
    if unit is not None and unit.dimension == "m" and not behind[0].concept:
        return PathPart(kind, amount=unit.factor, unit="m"), (behind[0],)
    return (PathPart("middle") if kind == "middle" else PathPart(kind, unit="share")), ()


ROWS = (
    _commands, _drops, _ends, _flips, _contraries, _directions, _objects, _places, _whole, _numbers, _amounts, _repeats,
)  # fmt: skip
"""The kinds of edits, in no order: the reading that leaves the least unread wins."""
