"""What the words of an utterance say of frames that both readers miss: signs, beside a thing, until it is past."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.instruct.edits import Also
from ovita.instruct.facts import clauses
from ovita.instruct.together import unit_of
from ovita.paths.part import WHOLE, PathPart, any_of, near


def as_said(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames with what neither reader sees.

    A height below zero; a wait beside or under a thing, not above it; that the distance of every waypoint is
    multiplied, not the path's; an amount that holds all along; that "back" is back to the path.
    """
    kinds = {chunk.kind for chunk in said}
    below = {then.q.value for sign, then in pairwise(said) if sign.kind == "minus" and then.q}
    led = _led_by(said)
    if kinds.isdisjoint(("up", "over", "raise", "rising")):
        frames = [_at_its_height(frame, led) for frame in frames]
    if not kinds.isdisjoint(("multiply", "waypoints")):
        frames = [_multiplied(frame) for frame in frames]
    frames = _onto_the_path(frames, said)
    return tuple(_below_zero(frame, below) for frame in _all_along(frames, said))


def in_places(reading: F.Reading, said: Sequence[Chunk]) -> F.Reading:
    """A reading with places that the network has no word for.

    That is a figure after a thing and not around it, what holds until a thing is past, and waits at several things.
    """
    led, kinds = _led_by(said), {chunk.kind for chunk in said}
    frames = tuple(_until_past(_figure_after(frame, led, kinds), said) for frame in reading.frames)
    return at_each(replace(reading, frames=frames), said)


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


def _figure_after(frame: F.SemanticFrame, led: Mapping[str, str], kinds: Container[str]) -> F.SemanticFrame:
    """A figure at a thing as one after it, where that is said: "a little circle once it's past the barrel".

    A spiral of what comes after a thing would wind around all of that, so that it stays at the thing.
    """
    after = isinstance(frame, F.Figure) and frame.shape != "spiral" and led.get(str(frame.place)) == "after"
    if not isinstance(frame, F.Figure) or not after or "around" in kinds:
        return frame
    return replace(frame, place="", part=PathPart("after", (frame.place,)))


UNTIL = frozenset(("until", "till", "til", "'til"))
"""Words for how long something holds."""


def _until_past(frame: F.SemanticFrame, said: Sequence[Chunk]) -> F.SemanticFrame:
    """What holds before a thing as what holds beside it too: "slower until it is past the bed"."""
    if frame.part.kind != "before":
        return frame
    row = _without_fillers(said)
    for until, past, thing in zip(row, row[1:], row[2:], strict=False):
        passed = past.kind in ("past", "pass", "after", "farther") and thing.names == frame.part.places
        if passed and until.text.lower() in UNTIL:
            return replace(frame, part=any_of((frame.part, near(thing.names[0]))))
    return frame


def _all_along(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> Sequence[F.SemanticFrame]:
    """The one frame of an utterance as all along the path, where its amount stands beside "the whole way"."""
    if len(frames) != 1 or frames[0].part.kind not in ("middle", "first", "last"):
        return frames
    values = {q.value for q in frames[0].quantities.values()}
    whole = any(_says_all_along(clause, values) for clause in clauses(said))
    return [replace(frames[0], part=WHOLE)] if whole else frames


def _says_all_along(clause: Sequence[Chunk], values: Container[float]) -> bool:
    """Whether a clause says an amount for the whole way, and no place."""
    kinds = {chunk.kind for chunk in clause}
    amount = any(chunk.q is not None and chunk.q.value in values for chunk in clause)
    return amount and "whole" in kinds and kinds.isdisjoint(SAYING_WHERE)


SAYING_WHERE = ("middle", "start", "goal", "nth", "half", "third", "quarter", "near", "after", "before", "between")
"""Classes of words that say where on the path something is to be."""


def _onto_the_path(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> Sequence[F.SemanticFrame]:
    """Frames without the way back to the start where what is meant is back to the path: "left, then back on course"."""
    returns = [frame for frame in frames if isinstance(frame, F.Return)]
    words = " ".join(chunk.text.lower() for chunk in said).split()
    homewards = not HOME.isdisjoint(words) or "start" in {chunk.kind for chunk in said}
    if not returns or homewards or not any(map(_is_on_course, _behind_back(words))):
        return frames
    return [frame for frame in frames if frame not in returns]


def _behind_back(words: Sequence[str]) -> list[list[str]]:
    """What is behind each word for going back, without words that say nothing more."""
    return [[w for w in words[i + 1 :] if w not in LINKING] for i, word in enumerate(words) if word in BACK]


def _is_on_course(words: Sequence[str]) -> bool:
    """Whether words begin with what is no place to come home to: "course", "how it was"."""
    return not ON_COURSE.isdisjoint(words[:1]) or [*words[:2]] == ["how", "it"]


BACK = frozenset("back return returns rejoin rejoins".split())
"""Words for going back, to the start or to the path."""

LINKING = frozenset("on onto in to for the its your our my usual normal original planned".split())
"""Words behind them that say nothing more."""

ON_COURSE = frozenset("course track line path route lane plan ending".split())
"""What is no place to come home to."""

HOME = frozenset("home start beginning origin".split())
"""What is one."""


def _multiplied(frame: F.SemanticFrame) -> F.SemanticFrame:
    """A distance that is multiplied, or the waypoints', is every waypoint's; else "twice as far" is the path's."""
    if not isinstance(frame, F.Approach) or frame.by is None or frame.by.unit != "x":
        return frame
    return replace(frame, by=replace(frame.by, role="to"))


def _below_zero(frame: F.SemanticFrame, below: Container[float]) -> F.SemanticFrame:
    """A height with the sign that stands before it: "don't go lower than z = -0.2"."""
    level = getattr(frame, "level", None)
    if level is None or level.value not in below:
        return frame
    return replace(frame, level=replace(level, value=-level.value, said=""))  # type: ignore[call-arg]


def halted(frames: Sequence[F.SemanticFrame], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames with a stop short of an object as a wait there, where it lasts or the path goes on after it.

    "Stop 20 cm before the cup and wait 5 seconds", "stop 20 cm before the cup, then continue".
    """
    made: list[F.SemanticFrame] = []
    on = any(chunk.kind == "then_on" for chunk in said)
    for frame in frames:
        if isinstance(frame, F.StopAt) and frame.by and on and len(frames) == 1:
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
    return replace(_with_frames(reading, {wait: _longer(wait) for wait in waits}), unread=unread)


def _with_frames(reading: F.Reading, changed: Mapping[F.SemanticFrame, F.SemanticFrame]) -> F.Reading:
    """A reading with other frames for some of it, also for those that feedback adds."""
    frames = tuple(changed.get(frame, frame) for frame in reading.frames)
    edits = tuple(replace(e, frame=changed.get(e.frame, e.frame)) if isinstance(e, Also) else e for e in reading.edits)
    return replace(reading, frames=frames, edits=edits)


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
