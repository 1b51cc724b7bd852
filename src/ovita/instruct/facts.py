"""An utterance beside what was read from it: the facts by which a reading is held against its words."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk

PAUSES = frozenset(("comma", "dot", "and", "because", "correct"))
"""Classes of chunks between which clauses stand."""

UNKNOWN = frozenset("unknown filler comma dot and".split())
"""Classes of chunks that say nothing: what a reader sees in them alone is a guess."""

OPPOSED = {
    "left": {"left"}, "right": {"right"}, "front": {"front"}, "back": {"back"},
    "up": {"up", "raise", "over", "rising", "height"}, "down": {"down", "lower", "under", "falling", "height"},
    "closer": {"closer", "near", "toward", "touch", "at_most", "within", "distance", "gap"},
    "farther": {"farther", "from", "at_least", "distance", "gap", "avoid", "withdraw"},
    "faster": {"faster", "inc", "double", "triple", "faster_time"},
    "slower": {"slower", "dec", "halve", "half", "brake", "slower_time"},
    "larger": {"larger", "inc", "double", "triple"}, "smaller": {"smaller", "dec", "halve", "half"},
    "more": {"more_curve", "larger", "inc"}, "less": {"less_curve", "smaller", "straight", "dec"},
    "cw": {"clockwise", "right"}, "ccw": {"anticlockwise", "left"},
}  # fmt: skip
"""What a frame may hold, and the classes of words that ask for it."""

BOUNDS = ("at_least", "at_most")


@dataclass(frozen=True)
class Facts:
    """An utterance beside what was read from it.

    Args:
        said: The utterance in chunks.
        frames: What was read.
    """

    said: Sequence[Chunk]
    frames: tuple[F.SemanticFrame, ...]

    @cached_property
    def kinds(self) -> frozenset[str]:
        """The classes of its words, also of what they come to: "too fast" counts as fast and as slower."""
        return self.plain | self.flipped

    @cached_property
    def plain(self) -> frozenset[str]:
        """The classes of its words as they stand."""
        return frozenset(chunk.kind for chunk in self.said)

    @cached_property
    def flipped(self) -> frozenset[str]:
        """The classes of words that others turn round, as what they come to: "too close" as farther."""
        row = [chunk.kind for chunk in self.row]
        denied = (kind for i, kind in enumerate(row) if not TURNING.isdisjoint(row[max(i - 2, 0) : i]))
        return frozenset(FLIPPED[kind] for kind in denied if kind in FLIPPED)

    @cached_property
    def senses(self) -> set[str]:
        """The senses with an opposite that were read."""
        return {sense for frame in self.frames for sense in senses(frame)}

    @cached_property
    def words(self) -> list[str]:
        """The words as they were said, in small letters."""
        return [word for chunk in self.said for word in chunk.text.lower().split()]

    @cached_property
    def row(self) -> list[Chunk]:
        """The chunks without fillers."""
        return [chunk for chunk in self.said if chunk.kind not in ("filler", "approx")]


TURNING = frozenset("too never so less dec pass clear".split())
"""Classes of words that turn round what stands right behind them."""

FLIPPED = {
    **F.OPPOSITES, "closer": "farther", "farther": "closer", "faster": "slower", "slower": "faster",
    "larger": "smaller", "smaller": "larger", "raise": "lower", "lower": "raise", "inc": "dec", "dec": "inc",
    "more_curve": "less_curve", "less_curve": "more_curve", "near": "farther", "touch": "farther", "avoid": "touch",
}  # fmt: skip
"""What words come to that are turned round."""


def clauses(said: Sequence[Chunk]) -> list[list[Chunk]]:
    """The chunks between pauses, each clause with the pause before it."""
    found: list[list[Chunk]] = [[]]
    for chunk in said:
        if chunk.kind in PAUSES or chunk.text.lower() in INSTEAD:
            found.append([])
        found[-1].append(chunk)
    return [clause for clause in found if clause]


INSTEAD = ("instead of", "rather than")
"""Denials of something beside what is meant."""


def among(held: Iterable[float], value: float) -> bool:
    """Whether one of some numbers is a value, give or take 2 %."""
    return any(abs(one - value) <= 1e-6 + 0.02 * abs(one) for one in held)


def senses(frame: F.SemanticFrame) -> list[str]:
    """The senses of a frame that have an opposite; a multiple of the speed is slower or faster: "speed x0.5"."""
    if isinstance(frame, F.Arrive):  # from above is downwards
        return []
    found = [direction for direction, _ in getattr(frame, "offset", ())]
    found += [str(getattr(frame, slot, "")) for slot in ("direction", "sense", "change")]
    factor = (frame.factor if isinstance(frame, F.Pace) else None) or 1.0
    if factor != 1.0:
        found.append("slower" if factor < 1.0 else "faster")
    return [sense for sense in found if sense in OPPOSED]
