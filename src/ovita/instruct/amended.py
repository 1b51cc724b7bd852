"""What the words of an utterance say of waits and bounds that the reader misses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.edits import Also
from ovita.instruct.together import unit_of


def amended(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading with what the reader does not see.

    That is a wait beside or under a thing and not above it, one at each of several things, one that lasts longer than
    the path stands there already, or short of a thing before it goes on, both bounds of "between 20 and 60 cm", and a
    distance of all waypoints.
    """
    frames, kinds = _halted(spread(reading.frames, said), said), {chunk.kind for chunk in said}
    if kinds.isdisjoint(("up", "over", "raise", "rising")):
        led = _led_by(said)
        frames = tuple(_at_its_height(frame, led) for frame in frames)
    if not kinds.isdisjoint(("multiply", "waypoints")):
        frames = tuple(_multiplied(frame) for frame in frames)
    return prolonged(at_each(replace(reading, frames=frames), said), said)


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


def _multiplied(frame: F.SemanticFrame) -> F.SemanticFrame:
    """A distance that is multiplied, or the waypoints', is every waypoint's; else "twice as far" is the path's."""
    if not isinstance(frame, F.Approach) or frame.by is None or frame.by.unit != "x":
        return frame
    return replace(frame, by=replace(frame.by, role="to"))


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


def at_each(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading whose waits are at all of several things: "wait 2 seconds at each room", "at the cup and the box"."""
    made: list[F.SemanticFrame] = []
    for frame in reading.frames:
        made += _at_each_of(frame, _listed_with(frame, reading, said)) if isinstance(frame, F.Wait) else [frame]
    if len(made) == len(reading.frames):
        return reading
    places = {frame.place for frame in made if isinstance(frame, F.Wait)}
    read = {chunk.text for chunk in said if chunk.kind == "OBJ" and places.issuperset(chunk.names)}
    return replace(reading, frames=tuple(made), unread=tuple(word for word in reading.unread if word not in read))


def _at_each_of(wait: F.Wait, names: Sequence[str]) -> list[F.Wait]:
    """A wait at each of some things; of none, the wait as it is."""
    return [replace(wait, place=name) for name in names] or [wait]


def _listed_with(wait: F.Wait, reading: F.Reading, said: Sequence[Chunk]) -> tuple[str, ...]:
    """The objects of the list in which a wait's place is named; none of which another frame is about."""
    elsewhere = {name for frame in reading.frames if frame is not wait for name in frame.named}
    names = next((names for names in _listed(said) if wait.place in names), ())
    return names if elsewhere.isdisjoint(names) else ()


def _listed(said: Sequence[Chunk]) -> list[tuple[str, ...]]:
    """The objects that are named in one list, each list's names."""
    lists: list[tuple[str, ...]] = [()]
    row = [chunk for chunk in said if chunk.kind != "filler"]
    for before, chunk in pairwise([None, *row]):
        if chunk is None or chunk.kind not in ("OBJ", "and", "comma"):
            lists.append(())
        elif chunk.kind == "OBJ":
            lists[-1] = (*lists[-1], *chunk.names) if before and before.kind in ("and", "comma") else chunk.names
    return lists


def prolonged(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading whose one wait is to last longer than the path stands there already: "wait 2 seconds longer"."""
    also = [edit.frame for edit in reading.edits if isinstance(edit, Also)]
    waits = [frame for frame in (*reading.frames, *also) if isinstance(frame, F.Wait) or _hovers_at(frame)]
    words = _for_longer(said) if len(waits) == 1 else []
    if not words:
        return reading
    unread = tuple(word for word in reading.unread if word not in words)
    return replace(_with_frames(reading, lambda frame: _longer(frame) if frame in waits else frame), unread=unread)


def _with_frames(reading: F.Reading, changed: Callable[[F.SemanticFrame], F.SemanticFrame]) -> F.Reading:
    """A reading with its frames changed, also those that feedback adds."""
    edits = tuple(replace(e, frame=changed(e.frame)) if isinstance(e, Also) else e for e in reading.edits)
    return replace(reading, frames=tuple(map(changed, reading.frames)), edits=edits)


def _hovers_at(frame: F.SemanticFrame) -> bool:
    """Whether a frame hovers at one object, so high as it does already."""
    return isinstance(frame, F.Hover) and len(frame.objects) == 1 and frame.by is None


def _longer(frame: F.SemanticFrame) -> F.SemanticFrame:
    """A wait, or a stay above an object, as a wait that is to last longer than it does."""
    if isinstance(frame, F.Hover):
        return F.Wait(place=frame.objects[0], duration=frame.duration, longer=True, words=frame.words)
    return replace(frame, longer=True)  # type: ignore[call-arg]


def _for_longer(said: Sequence[Chunk]) -> list[str]:
    """The words beside a wait or its duration that ask for more of it: "longer", "another", "more"."""
    waiting = _where(said, "wait", "hover", "Qs", "Qstep", "keep")
    denied = {i + 1 for i in _where(said, "never", "max", "at_least", "at_most")}
    found = [i for i, chunk in enumerate(said) if chunk.text.lower() in LONGER and i not in denied]
    found += [
        i for i, chunk in enumerate(said) if chunk.text.lower().split()[-1] in MORE and {i - 1, i + 1} & {*waiting}
    ]
    return [said[i].text for i in found]


def _where(said: Sequence[Chunk], *kinds: str) -> list[int]:
    """The numbers of the chunks of some classes."""
    return [i for i, chunk in enumerate(said) if chunk.kind in kinds]


LONGER, MORE = frozenset(("longer", "another", "an extra", "an additional")), frozenset(("more", "extra", "additional"))
"""Words for more time than there is, anywhere in an utterance about one wait, and beside its duration."""


def spread(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames in which "between 20 and 60 cm" is two bounds, and not what lies in the middle.

    Args:
        frames: As read; a height, a distance or a speed that is the mean of the two becomes a pair.
        said: The utterance in chunks.
    """
    found = tuple(frames)
    for word, one, link, other in zip(said, said[1:], said[2:], said[3:], strict=False):
        match word.kind, one.q, link.kind, other.q:
            case "between", F.Quantity(value=first, unit=unit), "and" | "to", F.Quantity(value=high):
                low = first if unit else first * (unit_of(other, other.kind) or 1.0)
                found = tuple(two for frame in found for two in _pair(frame, *sorted((low, high))))
    return found


def _pair(frame: F.SemanticFrame, low: float, high: float) -> tuple[F.SemanticFrame, ...]:
    """A frame about the middle of two values as the two bounds; any other as it is."""
    slot = {F.Height: "level", F.Clearance: "distance", F.Pace: "amount"}.get(type(frame), "")
    q = frame.quantities.get(slot)
    if q is None or abs(q.value - (low + high) / 2.0) > 0.02 * high or not high > low > 0.0:
        return (frame,)
    least, most = replace(q, value=low, role="at_least", said=""), replace(q, value=high, role="at_most", said="")
    if isinstance(frame, F.Pace):
        return replace(frame, change="floor", amount=least), replace(frame, change="cap", amount=most)
    if isinstance(frame, F.Clearance):
        return replace(frame, distance=least, along=False), replace(frame, distance=most, along=True)
    return replace(frame, level=least), replace(frame, level=most)  # type: ignore[call-arg]
