"""What the words of an utterance say of waits that the reader misses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk


def amended(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading with what the reader does not see.

    That is a wait beside or under a thing and not above it, and one short of a thing before it goes on.
    """
    frames, kinds = _halted(reading.frames, said), {chunk.kind for chunk in said}
    if kinds.isdisjoint(("up", "over", "raise", "rising")):
        led = _led_by(said)
        frames = tuple(_at_its_height(frame, led) for frame in frames)
    return replace(reading, frames=frames)


def _led_by(said: Sequence[Chunk]) -> dict[str, str]:
    """The class of the word before each object that is named once."""
    often = Counter(name for chunk in said for name in chunk.names)
    led = ((word.kind, thing) for word, thing in pairwise(_without_fillers(said)) if thing.kind == "OBJ")
    return {name: kind for kind, thing in led for name in thing.names if often[name] == 1}


def _without_fillers(said: Sequence[Chunk]) -> list[Chunk]:
    """The chunks that say something."""
    return [chunk for chunk in said if chunk.kind not in ("filler", "unknown")]


def _at_its_height(frame: F.SemanticFrame, led: Mapping[str, str]) -> F.SemanticFrame:
    """To hover under a thing, or beside it, is to wait where the path passes it."""
    if not isinstance(frame, F.Hover) or len(frame.objects) != 1 or frame.by is not None:
        return frame
    if led.get(frame.objects[0]) not in ("under", "near", "by"):
        return frame
    return F.Wait(place=frame.objects[0], duration=frame.duration, words=frame.words)


def _halted(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames with a stop as a wait, where the path goes on after it, or short of an object where it lasts.

    "Stop 20 cm before the cup and wait 5 seconds", "stop 20 cm before the cup, then continue".
    """
    made: list[F.SemanticFrame] = []
    on = any(chunk.kind == "then_on" for chunk in said)
    for frame in frames:
        if isinstance(frame, F.StopAt) and on and len(frames) == 1:
            return (F.Wait(place=frame.place, by=frame.by, words=frame.words),)
        last = made[-1] if made else None
        if isinstance(frame, F.Wait) and frame.duration and isinstance(last, F.StopAt) and last.by:
            if frame.place in ("", "goal", last.place):
                made[-1] = replace(frame, place=last.place, by=last.by, words=(*last.words, *frame.words))
                continue
        made.append(frame)
    return tuple(made)
