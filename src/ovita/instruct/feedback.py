"""Reading feedback: an utterance about what was just done, as edits on the frames of the turns before it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.amounts import amounts, numbers
from ovita.instruct.corrections import contraries, directions, drops, ends, flips, objects
from ovita.instruct.editing import OPPOSITE, directions_of
from ovita.instruct.notation import name_of
from ovita.instruct.remarks import (
    ACTING,
    DIRECTIONS,
    SENSES,
    SKIPPED,
    Candidate,
    Phrase,
    Remark,
    pieces_of,
    steps_of,
)  # fmt: skip
from ovita.instruct.whereabouts import everywhere, parts_in, places
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array

Reader: TypeAlias = Callable[[str, Sequence[F.SemanticFrame]], F.Reading]

NOTHING = F.Reading()
"""What is read where nothing is."""


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
    reader: Reader | None = None,
) -> F.Reading | None:
    """Read an utterance as edits on the frames before it; None if it says nothing about them.

    Args:
        text: What the person said.
        scene: The surroundings.
        before: The frames of the turns that it may be about, oldest first.
        positions: The path (N, 3) [m], for phrases such as "the object nearest to the goal".
        reader: Reads words as an instruction, by themselves or after the frames before; it is needed for "wait there
            too", and to tell instructions that say nothing about the frames before.
    """
    said = Remark(pieces_of(text, scene, before, positions), tuple(before), scene.names)
    fresh = NOTHING if reader is None else reader(said.request or text, ())
    further = fresh if reader is None else reader(said.request or text, before)
    found = [
        *_further_frames(said, fresh, further),
        *_kept(said, fresh),
        *(candidate for row in ROWS for candidate in row(said)),
    ]
    if not found:
        return None
    best = max(found, key=lambda c: _score(c, said))
    used = {id(p) for p in best.used}
    unread = tuple(p.text for p in said.active if p.content and id(p) not in used and _weight(p) >= 1.5)
    if (_misses(best, said) or _strange(best, said)) and not any(
        isinstance(edit, E.Command | E.Also) for edit in best.edits
    ):
        return None
    if _whole(fresh) and reader is not None and not _looks_back(best, said, unread, fresh, reader):
        return None
    return F.Reading(edits=best.edits, unread=unread, question=best.question, asked=best.asked)


def _whole(reading: F.Reading) -> bool:
    """Whether all words of an instruction were read."""
    return bool(reading.frames) and not (reading.unread or reading.question or reading.improper)


LOOKING_BACK = frozenset(
    """undo redo restart accept explain again flip more less weak twice treble halve third quarter sesqui meant except
    also same not enough whole left right""".split()
)
"""Cues that speak of what was done."""


def _looks_back(best: Candidate, said: Remark, unread: Sequence[str], fresh: F.Reading, reader: Reader) -> bool:
    """Whether a sentence that would do as an instruction is feedback: it speaks of what was done, or compares."""
    if any(isinstance(edit, E.Also | E.Drop) for edit in best.edits) or not said.before or _says_where(best, said):
        return True
    if all(isinstance(edit, E.Set) and not edit.step for edit in best.edits) and not _corrects(said):
        return False
    clauses = {p.clause for p in best.used}
    words = [p for p in said.active if p.content and p.clause in clauses]
    cues = {cue for p in best.used for cue in p.cues} & LOOKING_BACK
    slight = said.cued("slight") and "more" in cues
    if said.active[0].text in OPENING and not cues & (SETTLED | {"weak", "not", "enough"}) and not slight:
        return False
    if cues and not unread and not reader(said.text_of(clauses), ()).frames:
        return True  # the frames are of other clauses, which tell why
    kin = any(_kin(frame, known) for frame in fresh.frames for known in said.before)
    if not kin and not cues & SETTLED and (len(words) > 3 or said.elsewhere):
        return False
    compared = any(p.text.split()[0].endswith("er") for p in words) and len(words) <= 3
    judged = any(p.text.split()[0] in ("too", "so", "less") or said.judged(p) for p in said.active)
    detailed = unread and any(p.number or p.items for p in said.active)
    sided = any(isinstance(edit, E.Replace) and edit.direction for edit in best.edits) and said.beside
    return (bool(cues) or compared or judged or sided or bool(said.praised)) and not detailed


def _corrects(said: Remark) -> bool:
    """Whether it says that something else was meant or is enough: "left by 0.3 instead", "no, make it 0.3"."""
    opened = said.pieces[0].text in ("no", "nope", "nah", "make")
    return opened or bool(said.cued("meant", "enough", "also", "same", "only", "not"))


def _misses(best: Candidate, said: Remark) -> bool:
    """Whether a number or a further object of the clauses that it is read from has no part in it."""
    used, clauses = {id(p) for p in best.used}, {p.clause for p in best.used}
    known = {name for frame in said.before for name in frame.named}
    left = [p for p in said.active if id(p) not in used and p.clause in clauses]
    return any(p.number or not set(p.items) <= known for p in left)


def _strange(best: Candidate, said: Remark) -> bool:
    """Whether words of an instruction surround a mere place: "finish on the cup" restricts nothing."""
    mere = [edit for edit in best.edits if isinstance(edit, E.Restrict | E.Except)]
    if len(mere) != len(best.edits) or not mere or _corrects(said) or said.cued("except", "undo", "whole"):
        return False
    clauses = {p.clause for p in best.used}
    return any(
        p.clause in clauses and id(p) not in {id(u) for u in best.used} and p.text.split()[0] not in LEADING
        for p in said.active
    )


LEADING = SKIPPED | frozenset(
    "in on at near by over from of to around during while and just for with , . ! ? but".split()
)
"""Words that stand before a place."""


def _says_where(best: Candidate, said: Remark) -> bool:
    """Whether an utterance says nothing but where: "not by the cup"."""
    placed = {id(p) for part in parts_in(said) for p in part[2]}
    rest = [
        p
        for p in said.active
        if p.content and id(p) not in placed and not p.cues & {"only", "not", "except", "whole", "but"}
    ]
    return not rest and all(isinstance(edit, E.Restrict | E.Except) for edit in best.edits)


OPENING = frozenset(
    "go move shift drive fly raise lift run proceed be keep stay get hold veer boost do halve cut".split()
)
"""Verbs that open an instruction: "go at a slower rate" is one, "slower" is none."""

SETTLED = frozenset("undo redo restart accept explain again flip meant except also same".split())
"""Cues that no instruction of its own has."""


def _kin(frame: F.SemanticFrame, known: F.SemanticFrame) -> bool:
    """Whether two frames are about the same: of one kind, and along the same axis if they have one."""
    ways, others = directions_of(frame), directions_of(known)
    along = not ways or not others or any(w in (o, OPPOSITE[o]) for w in ways for o in others)
    return frame.NAME == known.NAME and along


def _further_frames(said: Remark, fresh: F.Reading, further: F.Reading) -> Iterator[Candidate]:
    """Frames beside those before: "and wait there too"."""
    also = [p for p in said.cued("also") if p.text != "then" or p not in said.active[-2:]]
    opened = [p for p in said.pieces[:1] if p.text in ("and", "now", "n")]
    asked = bool(fresh.question) and all(isinstance(frame, F.Wait | F.StopAt) for frame in further.frames)
    new = [frame for frame in further.frames if also or not any(_kin(frame, known) for known in said.before)]
    likened = [p for p in said.active if "same" in p.text.split() or "except" in p.cues]
    likened = [p for p in likened if "also" in p.cues or all(isinstance(frame, F.Keep) for frame in new)]
    if new and not (further.question or further.improper or likened) and (also or opened or asked):
        edits = tuple(E.Also(frame=frame) for frame in new)
        yield Candidate(edits, said.active if not further.unread else (*also, *opened), 1.0)


def _kept(said: Remark, fresh: F.Reading) -> Iterator[Candidate]:
    """What is to stay as it was: without the frames that changed it."""
    kinds: dict[str, tuple[type[F.SemanticFrame], ...]] = {"speed": (F.Pace,), "height": (F.Height,)}
    kinds |= {"goal": (F.MoveEnd,), "start": (F.MoveEnd,), "path": (F.Shift,)}
    whats = [frame.what for frame in fresh.frames if isinstance(frame, F.Keep)]
    gone = [f for what in whats for f in said.before if isinstance(f, kinds.get(what, ()))]
    if gone and len(whats) == len(fresh.frames) and not any(isinstance(f, F.Keep) for f in said.before):
        yield Candidate(tuple(E.Drop(on=name_of(f)) for f in gone), said.active, 2.0)


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
            counts = [p for p in said.active if steps_of(p)] if command in ("undo", "redo") else []
            edit = E.Command(command=command, steps=steps_of(counts[0]) if counts else 1)  # type: ignore[arg-type]
            yield Candidate((edit,), (*pieces, *counts, *said.cued("again", "keep")), prior + extra)


def _repeats(said: Remark) -> Iterator[Candidate]:
    pieces = said.cued("again")
    if pieces and said.before:
        yield Candidate((E.Again(),), (*pieces, *said.cued("same", "also", "meant", "weak")), 0.3)


ROWS = (
    _commands, _repeats, drops, ends, flips, contraries, directions, objects, places, everywhere, numbers, amounts,
)  # fmt: skip
"""The kinds of edits, in no order: the reading that leaves the least unread wins."""
