"""Reading feedback: an utterance about what was just done, as edits on the frames of the turns before it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeAlias

from ovita.instruct import corrections as C
from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.amounts import amounts, numbers
from ovita.instruct.frames import name_of
from ovita.instruct.looking_back import Retrospect, kin, looks_back
from ovita.instruct.remarks import ACTING, DIRECTIONS, SENSES, SKIPPED, Candidate, Phrase, Remark, pieces_of, steps_of
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
    found = retrospect(text, scene, before, positions, reader)
    return found.reading if looks_back(found) else None


def retrospect(
    text: str,
    scene: Scene,
    before: Sequence[F.SemanticFrame],
    positions: Array | None = None,
    reader: Reader | None = None,
) -> Retrospect:
    """The likeliest way to read an utterance as feedback, beside the instruction that it would be."""
    said = Remark(pieces_of(text, scene, before, positions), tuple(before), scene.names)
    fresh = NOTHING if reader is None else reader(said.request or text, ())
    further = fresh if reader is None else reader(said.request or text, before)
    found = [
        *_further_frames(said, fresh, further),
        *_kept(said, fresh),
        *(candidate for row in ROWS for candidate in row(said)),
    ]
    best = max(found, key=lambda c: _score(c, said), default=Candidate((), ()))
    return Retrospect(said, best, fresh, _score(best, said), _weight)


def _further_frames(said: Remark, fresh: F.Reading, further: F.Reading) -> Iterator[Candidate]:
    """Frames beside those before: "and wait there too"."""
    also = [p for p in said.cued("also") if p.text != "then" or p not in said.active[-2:]]
    opened = [p for p in said.pieces[:1] if p.text in ("and", "now", "n")]
    asked = bool(fresh.question) and all(isinstance(frame, F.Wait | F.StopAt) for frame in further.frames)
    new = [frame for frame in further.frames if also or not _is_kin(frame, said.before)]
    if not new or further.question or further.improper or _likened(said, new):
        return
    if also or opened or asked:
        edits = tuple(E.Also(frame=frame) for frame in new)
        yield Candidate(edits, said.active if not further.unread else (*also, *opened), 1.0)


def _is_kin(frame: F.SemanticFrame, before: Sequence[F.SemanticFrame]) -> bool:
    return any(kin(frame, known) for known in before)


def _likened(said: Remark, new: Sequence[F.SemanticFrame]) -> bool:
    """Whether what is said is to be the same as, or an exception from, what was done."""
    kept = all(isinstance(frame, F.Keep) for frame in new)
    likened = [p for p in said.active if "same" in p.text.split() or "except" in p.cues]
    return any(kept or "also" in p.cues for p in likened)


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
    placed = {id(p) for part in C.parts_in(said) for p in part.pieces}
    narrow = said.cued("only", "except")
    if not (placed and narrow):
        return ()
    rest = [p for p in said.active if p.content and id(p) not in placed and p not in narrow]
    vague = [p for p in rest if "vague" in p.cues]
    return tuple(p.text for p in vague or narrow) if len(rest) == len(vague) else ()


def stated(text: str, scene: Scene) -> tuple[F.Quantity | None, set[str]]:
    """The one quantity of an utterance, or None, and its words."""
    pieces = pieces_of(text, scene, (), None)
    numbers = [piece.number for piece in pieces if piece.number]
    return (numbers[0] if len(numbers) == 1 else None), {word for p in pieces for word in p.text.split()}


# Rows: each reads one kind of edit.

COMMANDS: dict[str, Any] = {"redo": 0.6, "restart": 0.4, "undo": 0.0, "explain": 1.5, "accept": -0.5}


def _commands(said: Remark) -> Iterator[Candidate]:
    for command, prior in COMMANDS.items():
        pieces: Sequence[Phrase] = said.cued(command)
        if command == "redo" and not said.before:
            pieces, prior = said.cued("redo", "undo"), prior + 2.0
        elif command in _FOR:
            pieces = _FOR[command](said, pieces)
        counts = [p for p in said.active if steps_of(p)] if command in ("undo", "redo") else []
        if pieces:
            edit = E.Command(command=command, steps=steps_of(counts[0]) if counts else 1)  # type: ignore[arg-type]
            yield Candidate((edit,), (*pieces, *counts, *said.cued("again", "keep")), prior)


def _accepting(said: Remark, pieces: Sequence[Phrase]) -> Sequence[Phrase]:
    """What says yes: in all clauses, where nothing else is asked for."""
    return () if said.asks else pieces or [p for p in said.pieces if "accept" in p.cues]


def _explaining(said: Remark, pieces: Sequence[Phrase]) -> Sequence[Phrase]:
    """What asks for reasons: all of it, where it asks why."""
    return said.active if pieces and any("why" in p.text.split() for p in said.active) else pieces


_FOR: dict[str, Callable[[Remark, Sequence[Phrase]], Sequence[Phrase]]] = {
    "accept": _accepting,
    "explain": _explaining,
    "restart": lambda said, pieces: [*pieces, *said.cued("undo")] if pieces else (),
}
"""The pieces that a command is read from, given those with its cue."""


def _repeats(said: Remark) -> Iterator[Candidate]:
    pieces = said.cued("again")
    if pieces and said.before:
        yield Candidate((E.Again(),), (*pieces, *said.cued("same", "also", "meant", "weak")), 0.3)


ROWS = (
    _commands, _repeats, C.drops, C.ends, C.flips, C.contraries, C.directions, C.objects, C.places, C.everywhere,
    numbers, amounts,
)  # fmt: skip
"""The kinds of edits, in no order: the reading that leaves the least unread wins."""
