"""An utterance about what was just done: what its words name of the changes before it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk, chunks
from ovita.instruct.editing import directions_of, name_among
from ovita.instruct.facts import UNKNOWN
from ovita.instruct.frames import name_of
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array

SENSES = {
    "faster": "faster", "slower": "slower", "closer": "closer", "farther": "farther", "withdraw": "farther",
    "up": "up", "raise": "up", "down": "down", "lower": "down", "left": "left", "right": "right", "front": "front",
    "back": "back", "larger": "larger", "smaller": "smaller",
}  # fmt: skip
"""The direction or the sense that a class of words has."""

DIRECTIONS = ("left", "right", "front", "back", "up", "down")

NOUNS: dict[str, tuple[str, ...]] = {
    "of_pace": ("pace",), "of_move": ("move", "end"), "of_farther": ("farther", "closer", "clearance"),
    "of_wait": ("wait", "hover", "stop"), "of_smooth": ("smooth",), "of_return": ("return",),
    "of_circle": ("circle",), "of_rotation": ("rotate",),
    "faster": ("pace",), "slower": ("pace",), "speed": ("pace",), "constant": ("pace",), "wait": ("wait",),
    "hop": ("hop",), "hover": ("hover",), "mirror": ("mirror",), "rotate": ("rotate",), "tilt": ("tilt",),
    "spiral": ("spiral",),
    "circle": ("circle",), "eight": ("eight",), "zigzag": ("zigzag",), "wave": ("wave",), "extend": ("extend",),
    "straight": ("straighten",), "resize": ("resize",), "curvature": ("curve",), "smooth": ("smooth",),
    "reverse": ("reverse",), "height": ("height", "move", "hover"), "distance": ("farther", "closer", "clearance"),
    "farther": ("farther", "clearance"), "closer": ("closer",), "waypoints": ("waypoints",),
    "shake": ("shake",),
}  # fmt: skip
"""The frames that a class of words, or of feedback, can mean."""


def words_in(pieces: Iterable[Chunk]) -> list[str]:
    """The words of some pieces, in order."""
    return [word for piece in pieces for word in piece.text.lower().split()]


@dataclass(frozen=True)
class Remark:
    """What was said, in chunks, against the frames before it."""

    pieces: tuple[Chunk, ...]
    before: tuple[F.SemanticFrame, ...]

    @cached_property
    def clauses(self) -> list[list[Chunk]]:
        """Its pieces between signs, and from each "but" on."""
        found: list[list[Chunk]] = [[]]
        for piece in self.pieces:
            found += [[]] if piece.kind in ("comma", "dot") or piece.text.lower() in CONTRASTS else []
            found[-1].append(piece)
        return found

    @property
    def says_nothing(self) -> bool:
        """Whether it has no word that is known."""
        return all(piece.kind in UNKNOWN and not piece.cue for piece in self.pieces)

    @cached_property
    def elsewhere(self) -> bool:
        """Whether it names kinds of change, and none of those before."""
        vague = ("move", "longer")  # as a wait may be, too
        plain = [p for p in self.pieces if p.text.lower() not in vague and p.kind not in ("farther", "closer")]
        naming = any(NOUNS.get(word) for p in plain for word in (p.cue, p.kind))
        return naming and not self.meant(self.pieces)

    @property
    def adds(self) -> bool:
        """Whether something further is asked for: "and near the bottle too"."""
        return bool(self.cued("also")) or any(p.text.lower() in ("and", "now", "n") for p in self.pieces[:1])

    def cued(self, *names: str) -> list[Chunk]:
        """The pieces with one of these cues."""
        return [p for p in self.pieces if p.cue in names]

    def meant(self, pieces: Iterable[Chunk]) -> list[int]:
        """Numbers of the frames that pieces name by a noun, a direction or an object; by all of these if one fits."""
        named = [{i for i, frame in enumerate(self.before) if names(p, frame)} for p in pieces]
        found = [frames for frames in named if frames]
        return sorted(set.intersection(*found) or set.union(*found)) if found else []

    def on(self, i: int) -> str:
        """How an edit names a frame: by its kind, or a direction or object of its own; "" where there is only one."""
        return "" if len(self.before) == 1 else name_among(self.before, i)


CONTRASTS = ("but", "although", "though")


def remark(text: str, scene: Scene, before: Sequence[F.SemanticFrame], positions: Array | None = None) -> Remark:
    """An utterance in pieces, against the frames before it."""
    return Remark(chunks(text, scene, positions), tuple(before))


def named_frames(text: str, scene: Scene, before: Sequence[F.SemanticFrame]) -> list[int]:
    """Numbers of the frames that an answer such as "the shift" names."""
    said = remark(text, scene, before)
    return said.meant(said.pieces)


def named_objects(text: str, scene: Scene) -> tuple[SceneObject, ...]:
    """The objects that an answer such as "the blue one" names."""
    names_ = {name for piece in chunks(text, scene) for name in piece.names}
    return tuple(item for item in scene if item.name in names_)


def vaguely_where(text: str, scene: Scene) -> tuple[str, ...]:
    """The vague words of an utterance that says only where: "somewhere between the cup and the bottle only"; or ()."""
    said = remark(text, scene, ())
    vague = said.cued("vague") if said.cued("only") else []
    return tuple(piece.text for piece in vague)


def stated(text: str, scene: Scene) -> tuple[F.Quantity | None, set[str]]:
    """The one quantity of an utterance, or None, and its words."""
    pieces = chunks(text, scene)
    numbers = [piece.q for piece in pieces if piece.q]
    return (numbers[0] if len(numbers) == 1 else None), {*words_in(pieces)}


def names(piece: Chunk, frame: F.SemanticFrame) -> bool:
    """Whether a piece names a frame, by its kind, a direction or an object."""
    kinds = {kind for word in (piece.cue, piece.kind) for kind in NOUNS.get(word, ())}
    called = {name_of(frame), frame.NAME} & kinds or {*piece.names} & {*frame.named}
    return bool(called) or SENSES.get(piece.kind) in directions_of(frame)


def heading(piece: Chunk) -> str:
    """The direction that a piece names, or ""."""
    sense = SENSES.get(piece.kind, "")
    return sense if sense in DIRECTIONS and not piece.text.endswith("er") else ""
