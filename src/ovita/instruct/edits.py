"""Feedback as edits: what an utterance changes about the frames of the turns before it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ovita.instruct.degrees import Degree
from ovita.instruct.frames import Direction, Quantity, SemanticFrame
from ovita.paths.part import PathPart


@dataclass(frozen=True, kw_only=True)
class Edit:
    """A change of the frames before.

    Args:
        on: The notation's name of the frame that it is about, such as "pace", where several stood before; or "".
    """

    NAME: ClassVar[str] = ""
    on: str = ""


@dataclass(frozen=True, kw_only=True)
class Rescale(Edit):
    """More or less of what was done, or a factor on it."""

    NAME = "scale"
    change: Literal["", "more", "less"] = ""
    factor: float | None = None
    degree: Degree | None = None


@dataclass(frozen=True, kw_only=True)
class Set(Edit):
    """Another value for one slot: a role ("by", "to", "at_least", "at_most"), a field, or a direction.

    `step` says that the quantity is more (1) or less (-1) than before, not the new value (0).
    """

    NAME = "set"
    slot: str
    quantity: Quantity
    step: Literal[-1, 0, 1] = 0


@dataclass(frozen=True, kw_only=True)
class Flip(Edit):
    """The other way round: left for right, faster for slower, closer for farther, clockwise for counterclockwise."""

    NAME = "flip"


@dataclass(frozen=True, kw_only=True)
class Replace(Edit):
    """Another direction, object or end than was said."""

    NAME = "replace"
    direction: Direction | None = None
    objects: tuple[str, ...] = ()
    end: Literal["", "start", "goal"] = ""


@dataclass(frozen=True, kw_only=True)
class Restrict(Edit):
    """Only in a part of the path."""

    NAME = "restrict"
    part: PathPart


@dataclass(frozen=True, kw_only=True)
class Except(Edit):
    """Everywhere but in a part of the path."""

    NAME = "except"
    part: PathPart


@dataclass(frozen=True, kw_only=True)
class Drop(Edit):
    """Without it (all of it, or the frame that `on` names)."""

    NAME = "drop"


@dataclass(frozen=True, kw_only=True)
class Again(Edit):
    """The same once more."""

    NAME = "again"


@dataclass(frozen=True, kw_only=True)
class Also(Edit):
    """Further frames beside those before; slots that they leave open are taken from the frame before."""

    NAME = "also"
    frame: SemanticFrame


@dataclass(frozen=True, kw_only=True)
class Command(Edit):
    """A turn of the dialogue itself; `steps` counts the turns of undo and redo."""

    NAME = "undo"
    command: Literal["undo", "redo", "restart", "accept", "explain"]
    steps: int = 1
