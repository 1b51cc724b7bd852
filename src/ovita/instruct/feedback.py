"""Reading feedback: an utterance about what was just done, as edits on the frames of the turns before it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from ovita.instruct import corrections as C
from ovita.instruct import edits as E
from ovita.instruct import frames as F
from ovita.instruct.amounts import amounts, numbers
from ovita.instruct.looking_back import Retrospect, looks_back
from ovita.instruct.remarks import NOES, Candidate, Phrase, Remark, pieces_of, steps_of, words_in
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array


def read_feedback(
    text: str,
    scene: Scene,
    before: Sequence[F.SemanticFrame],
    positions: Array | None = None,
    fresh: F.Reading | None = None,
) -> F.Reading | None:
    """Read an utterance as edits on the frames before it; None if it says nothing about them, or something is unread.

    Args:
        text: What the person said.
        scene: The surroundings.
        before: The frames of the turns that it may be about, oldest first.
        positions: The path (N, 3) [m], for phrases such as "the object nearest to the goal".
        fresh: What it is as an instruction, to tell instructions that say nothing about the frames before.
    """
    found = retrospect(text, scene, before, positions, fresh)
    return found.reading if looks_back(found) else None


def retrospect(
    text: str,
    scene: Scene,
    before: Sequence[F.SemanticFrame],
    positions: Array | None = None,
    fresh: F.Reading | None = None,
) -> Retrospect:
    """The first way to read all of an utterance as feedback, beside the instruction that it would be."""
    said = Remark(pieces_of(text, scene, before, positions), tuple(before), scene.names)
    whole = (found for row in ROWS for found in row(said) if not said.unread(found.used))
    return Retrospect(said, next(whole, Candidate((), ())), fresh or F.Reading())


def named_frames(text: str, scene: Scene, before: Sequence[F.SemanticFrame]) -> list[int]:
    """Numbers of the frames that an answer such as "the shift" names."""
    said = Remark(pieces_of(text, scene, before, None), tuple(before))
    return said.meant(said.pieces)


def named_objects(text: str, scene: Scene) -> tuple[SceneObject, ...]:
    """The objects that an answer such as "the blue one" names."""
    names_ = {name for piece in pieces_of(text, scene, (), None) for name in piece.items}
    return tuple(item for item in scene if item.name in names_)


def vaguely_where(text: str, scene: Scene) -> tuple[str, ...]:
    """The vague words of an utterance that says only where: "somewhere between the cup and the bottle only"; or ()."""
    said = Remark(pieces_of(text, scene, (), None), ())
    vague = said.cued("vague") if said.cued("only") else []
    return tuple(piece.text for piece in vague)


def stated(text: str, scene: Scene) -> tuple[F.Quantity | None, set[str]]:
    """The one quantity of an utterance, or None, and its words."""
    pieces = pieces_of(text, scene, (), None)
    numbers = [piece.number for piece in pieces if piece.number]
    return (numbers[0] if len(numbers) == 1 else None), {*words_in(pieces)}


def _commands(said: Remark) -> Iterator[Candidate]:
    """Turns of the dialogue itself: undo, redo, start over, explain, accept."""
    counts = [p for p in said.active if steps_of(p) or p.text == "last"]
    steps = max(map(steps_of, counts), default=0) or 1
    if _asks_a_fact(said):
        yield Candidate((E.Command(command="explain"),), said.active)
    words = {*words_in(p for p in said.active if p.number or p.text[0].isalpha())}
    if words and words <= DENYING:
        yield Candidate((E.Command(command="undo"),), said.active)
    undo = said.cued("undo")
    rows: tuple[tuple[Any, int, Sequence[Phrase]], ...] = (
        ("restart", 1, undo),
        ("redo", steps, (*undo, *counts)),
        ("undo", steps, counts),
        ("explain", 1, _asking_why(said)),
        ("accept", 1, said.cued("enough")),
    )
    for command, times, besides in rows:
        if pieces := said.cued(command):
            yield Candidate((E.Command(command=command, steps=times),), (*pieces, *besides))


def _asks_a_fact(said: Remark) -> bool:
    """Whether it is a question about what there is, which never changes anything: "what changed so far?"."""
    words = words_in(said.pieces)
    proposes = words[1:2] and (words[1] in PROPOSING or "possible" in words)
    return words[-1:] == ["?"] and words[0] in ASKING and not proposes


DENYING = frozenset((*NOES, "do", "not", "please"))
"""All words of an utterance that only says no."""

ASKING = frozenset("what how where is are was were does did do has when which who".split())
PROPOSING = frozenset("about if you there".split())
"""Words that begin a question of fact, and those behind them that begin a proposal: "how about", "what if"."""


def _asking_why(said: Remark) -> list[Phrase]:
    """The pieces of the clauses that ask why: "why did you slow down?"."""
    asking = {p.clause for p in said.cued("explain") if "why" in p.text.split()}
    return [p for p in said.active if p.clause in asking]


def _repeats(said: Remark) -> Iterator[Candidate]:
    """The same once more."""
    pieces = said.cued("again")
    if pieces and said.before:
        yield Candidate((E.Again(),), (*pieces, *said.cued("same", "also")))


ROWS = (
    C.spares, C.ends_kept, _commands, _repeats, C.drops, C.only, C.other_halves, C.places_instead, C.left_out, C.flips,
    C.contraries, C.directions, C.objects, C.copies, C.ends, C.everywhere, numbers, amounts,
)  # fmt: skip
"""The kinds of edits: the first reading that leaves nothing unread is taken."""
