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
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array
from ovita.units import find

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
    text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None = None
) -> F.Reading | None:
    """Read an utterance as edits on the frames before it; None if it says nothing about them.

    Args:
        text: What the person said.
        scene: The surroundings.
        before: The frames of the turns that it may be about, oldest first.
        positions: The path (N, 3) [m], for phrases such as "the object nearest to the goal".
    """
    said = Remark(pieces_of(text, scene, before, positions), tuple(before))
    found = [candidate for row in ROWS for candidate in row(said)]
    if not found:
        return None
    best = max(found, key=lambda c: _score(c, said))
    used = {id(p) for p in best.used}
    unread = tuple(p.text for p in said.active if p.content and id(p) not in used and _weight(p) >= 1.5)
    return F.Reading(edits=best.edits, unread=unread, question=best.question, asked=best.asked)


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
    return 2 if piece.text == "both" else int(q.value) if q and not q.unit and 1 < q.value <= 50 else 0


def _drops(said: Remark) -> Iterator[Candidate]:
    """Without some of the frames: "forget the shift", "no waiting"."""
    pieces = said.cued("undo")
    denied = [p for p in said.active if said.denies(p) and any(names(p, f) for f in said.before)]
    denied = [] if any(heading(p) and not said.denies(p) for p in said.active) else denied
    clauses = {p.clause for p in (*pieces, *denied)}
    words = [p for p in said.active if p.clause in clauses]
    meant = said.meant(words) or said.meant(said.active)
    meant = [i for i in meant if i in said.targets]
    if not meant or not (pieces or denied):
        return
    if len(meant) < len(said.before):
        edits = tuple(E.Drop(on=name_of(said.before[i])) for i in meant)
        yield Candidate(edits, (*pieces, *words), 1.0)
    elif len(said.before) == 1:
        yield Candidate((E.Drop(),), (*pieces, *denied, *said.cued("not")), 0.3)


def _flips(said: Remark) -> Iterator[Candidate]:
    pieces = said.cued("flip", "ccw", "cw")
    turned = [p for p in pieces if p.cues & {"ccw", "cw"}]
    if pieces and (not turned or any(isinstance(f, F.Figure | F.Rotate) for f in said.before)):
        on = said.on(said.targets[-1]) if len(said.targets) == 1 else ""
        yield Candidate((E.Flip(on=on),), (*pieces, *said.cued("meant")), 1.0)


def _contraries(said: Remark) -> Iterator[Candidate]:
    """The other way round, by a word for it: "no, speed up", "I said away from it"."""
    no = [p for p in said.pieces[:1] if p.text in ("no", "nope", "nah")]
    meant = said.cued("meant")
    for i in reversed(said.targets if no or meant else []):
        against = {OPPOSITE.get(sense) for sense in senses_of(said.before[i])} - {None, "less"}
        pieces = [p for p in said.active if SENSES.get(p.concept) in against and len(p.text.split()) < 3]
        if pieces:
            yield Candidate((E.Flip(on=said.on(i)),), (*pieces, *no, *meant), 0.0)


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
    new = [p for p in said.active if p.items and not set(p.items) & known and not said.negated(p)]
    about = [i for i in said.targets if said.before[i].named] or [i for i, f in enumerate(said.before) if f.named]
    if not new or not about:
        return
    old = [p for p in said.active if set(p.items) & known]
    items = tuple(dict.fromkeys(name for p in new for name in p.items))
    frame, on = said.before[about[-1]], said.on(about[-1])
    edit = E.Replace(on=on, objects=items)
    yield Candidate((edit,), (*new, *old, *said.cued("meant", "not")), 0.4)
    also = said.cued("also", "same")
    if also:
        (copy,) = apply((replace(edit, on=""),), (frame,), Scene())
        yield Candidate((E.Also(frame=copy),), (*new, *also), 0.5)


def _places(said: Remark) -> Iterator[Candidate]:
    """Only in a part of the path, or everywhere but there."""
    only, but = said.cued("only"), said.cued("except")
    known = {name for frame in said.before for name in frame.named}
    parts = [part for part in parts_in(said) if only or but or not set(part[2][0].items) & known]
    if not parts or not said.before:
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
        if where is None:
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
    """Whether a number is more or less than before, rather than the new value."""
    pieces = said.active
    i = pieces.index(piece) if piece in pieces else 0
    behind = [p for p in pieces[i + 1 : i + 3] if "turns" not in p.cues][:1]
    if i and pieces[i - 1].text in ("another", "extra"):
        return 1
    if behind and behind[0].text in ("more", "further", "extra", "farther"):
        return 1
    return -1 if behind and behind[0].text in ("less", "fewer") else 0


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
        if q is not None and q.unit == "%" and near & {"more", "less"}:
            return 1 - q.value if "less" in near else 1 + q.value, (piece, *before, *behind)
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
        elif piece.concept in ("first", "last", "middle", "start", "goal") and not piece.items:
            part, used = _stretch(piece, behind)
            yield part, said_not, (piece, *used)
        elif piece.concept == "waypoints" and behind and behind[0].number and i + 2 < len(pieces):
            last = next((p for p in pieces[i + 2 : i + 4] if p.number), None)
            if last is not None and last.number is not None:
                low, high = behind[0].number.value - 1, last.number.value - 1
                yield PathPart("range", amount=low, until=high), said_not, (piece, behind[0], last)
        elif piece.concept in ("up", "down") and any(p.concept in ("when", "only") for p in before):
            yield PathPart("heading", direction=piece.concept), said_not, (piece, *before)


def _at(kind: str, items: Sequence[str]) -> PathPart:
    parts = tuple(PathPart(kind, (name,)) for name in items)
    return parts[0] if len(parts) == 1 else PathPart("either", parts=parts)


def _stretch(piece: Phrase, behind: Sequence[Phrase]) -> tuple[PathPart, tuple[Phrase, ...]]:
    kind = {"start": "first", "goal": "last"}.get(piece.concept, piece.concept)
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
    _commands, _drops, _flips, _contraries, _directions, _objects, _places, _whole, _numbers, _amounts, _repeats,
)  # fmt: skip
"""The kinds of edits, in no order: the reading that leaves the least unread wins."""
