"""What words call by name, for the frames of both readers: a loop is no eight, and to creep is to be much slower."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence, Set
from dataclasses import replace
from itertools import pairwise
from typing import Any

from ovita.instruct import frames as F
from ovita.instruct.chunks import Chunk
from ovita.paths.part import WHOLE, PathPart, any_of, outside


def as_named(frames: tuple[F.SemanticFrame, ...], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Frames with what words call by name.

    A loop is no figure eight, to creep past the cup is much slower, and what comes down at the end is low there alone.
    """
    kinds, text = {chunk.kind for chunk in said}, f" {' '.join(chunk.text.lower() for chunk in said)} "
    for called, change in CALLED:
        if called(kinds, text):
            frames = tuple(made for frame in frames if (made := change(frame, said)) is not None)
    frames = _stops_at_its_end(_ends_once(frames))
    frames = _only_there(frames) if " again " in text else frames
    return _rest_kept(_but_for_ends(_crawling(frames, said), kinds))


def _ends_once(frames: tuple[F.SemanticFrame, ...]) -> tuple[F.SemanticFrame, ...]:
    """Frames in which both ends that are to stay are one wish, not three."""
    if not any(isinstance(frame, F.Keep) and frame.what == "ends" for frame in frames):
        return frames
    return tuple(f for f in frames if not (isinstance(f, F.Keep) and f.what in ("start", "goal")))


def _but_for_ends(frames: tuple[F.SemanticFrame, ...], kinds: Set[str]) -> tuple[F.SemanticFrame, ...]:
    """A shift of all but the start, or the goal, which is a point: the path bends towards it."""
    made: list[F.SemanticFrame] = []
    for frame in frames:
        end = next((end for end, part in ENDS.items() if frame.part == part and end in kinds), None)
        if isinstance(frame, F.Shift) and end is not None:
            kept = F.Keep(what=end, words=frame.words)
            made += [*([] if any(_keeps(one, end) for one in frames) else [kept]), replace(frame, part=WHOLE)]
        else:
            made.append(frame)
    return tuple(made)


def _keeps(frame: F.SemanticFrame, end: str) -> bool:
    """Whether a frame keeps an end."""
    return isinstance(frame, F.Keep) and frame.what in (end, "ends")


ENDS: Mapping[F.End, PathPart] = {"start": outside(PathPart("first")), "goal": outside(PathPart("last"))}
"""All but what is at an end."""


def _stops_at_its_end(frames: tuple[F.SemanticFrame, ...]) -> tuple[F.SemanticFrame, ...]:
    """Without a stop where the path is said to end anyway: "finish above the cup and stop there"."""
    ends = {frame.place for frame in frames if isinstance(frame, F.MoveEnd) and frame.end == "goal" and frame.place}
    return tuple(frame for frame in frames if not (isinstance(frame, F.StopAt) and frame.place in ends))


def _only_there(frames: tuple[F.SemanticFrame, ...]) -> tuple[F.SemanticFrame, ...]:
    """Slower near a thing where it is to be faster again after it: "slow down towards it, and speed up again after"."""
    match frames:
        case [F.Pace(change="slower", amount=None) as slow, F.Pace(change="faster", amount=None, part=then)]:
            if then.kind == "after" and slow.part.kind in ("before", "near") and slow.part.places == then.places:
                return (replace(slow, part=PathPart("near", then.places)),)
    return frames


def _rest_kept(frames: tuple[F.SemanticFrame, ...]) -> tuple[F.SemanticFrame, ...]:
    """Nothing changes beside what else is asked for: "seam 5 mm higher, approach unchanged"."""
    alone = all(isinstance(frame, F.Keep) for frame in frames)
    return tuple(
        replace(one, what="rest") if isinstance(one, F.Keep) and one.what == "part" and not (one.part or alone) else one
        for one in frames
    )


def _more_room(frame: F.SemanticFrame, said: Sequence[Chunk]) -> F.SemanticFrame:
    """A distance that is to be there besides: "give it another ten centimetres at least"."""
    if not isinstance(frame, F.Clearance) or frame.distance.role != "at_least":
        return frame
    more = [q.number.value for word, q in pairwise(said) if word.text.lower() in FURTHER and q.kind == "Qm"]
    if not any(abs(value - abs(frame.distance.value)) < 1e-9 for value in more):
        return frame
    return F.Approach(sense="farther", objects=frame.objects, by=replace(frame.distance, role="by"), words=frame.words)


def _lower_down(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    """Where the path is lower than a height: "once you are lower than 1 m, no faster than 3"."""
    part = frame.part
    if part.kind != "beyond" or part.direction != "up" or not part.amount:
        return frame
    return replace(frame, part=replace(part, direction="down", amount=-part.amount))


def _beside_both(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    """Near each of two things of which nothing says between: "slow down around the switch and the socket"."""
    part = frame.part
    if part.kind != "between" or not all(isinstance(place, str) for place in part.places):
        return frame
    return replace(frame, part=any_of([PathPart("near", (place,)) for place in part.places]))


def _at_a_share(frame: F.SemanticFrame, said: Sequence[Chunk]) -> F.SemanticFrame:
    """A speed that is a share of what it is: "the climb at 60 % of the speed"."""
    match frame:
        case F.Pace(change="slower", amount=F.Quantity(unit="%", role="by") as q):
            rows = zip(said, said[1:], said[2:], strict=False)
            shares = [amount.number.value for at, amount, of in rows if (at.kind, amount.kind, of.kind) == AT_SHARE]
            if any(abs(value - q.value) < 1e-9 for value in shares):
                return replace(frame, change="set", amount=replace(q, role="to"))
    return frame


AT_SHARE = ("at", "Qpc", "of")
"""Classes of the words for a share of the speed."""


def _underneath(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    """To hover under a thing is to wait where the path passes it."""
    if not isinstance(frame, F.Hover) or len(frame.objects) != 1:
        return frame
    return F.Wait(place=frame.objects[0], duration=frame.duration, words=frame.words)


def _backwards(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame | None:
    """Nothing more, where a path that is run backwards is said to end where it started."""
    ends = isinstance(frame, F.Return) or (isinstance(frame, F.MoveEnd) and frame.place in ("start", "goal"))
    return None if ends else frame


FURTHER = ("another", "an extra", "an additional", "extra", "a further")


def _crawling(frames: tuple[F.SemanticFrame, ...], said: Sequence[Chunk]) -> tuple[F.SemanticFrame, ...]:
    """Much slower, where one frame is slower by no amount and a word such as "crawl" says it."""
    slower = [frame for frame in frames if isinstance(frame, F.Pace) and frame.change == "slower"]
    if len(slower) != 1 or slower[0].amount or slower[0].degree or not _crawls(said):
        return frames
    return tuple(replace(frame, degree="large") if frame is slower[0] else frame for frame in frames)


def _reached_last(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    """What comes down or up to a height at the end has it there, and not before."""
    at_the_end = frame.part.kind == "last" and frame.part.amount is None
    if not (at_the_end and isinstance(frame, F.Height) and frame.level.role == "to" and not frame.of):
        return frame
    return F.MoveEnd(end="goal", level=frame.level, words=frame.words)


def _below_zero(frame: F.SemanticFrame, said: Sequence[Chunk]) -> F.SemanticFrame:
    """A height with the sign that stands before it: "don't go lower than z = -0.2"."""
    level = getattr(frame, "level", None)
    below = {chunk.q.value for sign, chunk in pairwise(said) if sign.kind == "minus" and chunk.q}
    if level is None or level.value not in below:
        return frame
    return replace(frame, level=replace(level, value=-level.value, said=""))  # type: ignore[call-arg]


def _multiplied(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    """A distance that is multiplied, or the waypoints', is every waypoint's; else "twice as far" is the path's."""
    if not isinstance(frame, F.Approach) or frame.by is None or frame.by.unit != "x":
        return frame
    return replace(frame, by=replace(frame.by, role="to"))


def _upright(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    swings = isinstance(frame, F.Figure) and frame.shape in ("wave", "zigzag")
    return replace(frame, upright=True) if swings else frame  # type: ignore[call-arg]


UPRIGHT = (
    "up and down", "down and up", "vertical", "vertically", "in height", "in z", "bob", "bobbing", "porpoise", "humps",
    "rollercoaster", "roller coaster",
)  # fmt: skip
"""Words for swinging up and down."""


def _no_eight(frame: F.SemanticFrame, _: Sequence[Chunk]) -> F.SemanticFrame:
    eight = isinstance(frame, F.Figure) and frame.shape == "eight"
    return replace(frame, shape="circle") if eight else frame  # type: ignore[call-arg]


BETWEEN = ("between", "gap", "thru", "from", "to", "before", "after", "pair")
"""Classes of words for what is between two things."""

HIGHER = ("up", "over", "raise", "rising")
"""Classes of words for what is high."""

CALLED: tuple[tuple[Callable[[set[str], str], bool], Callable[[Any, Sequence[Chunk]], F.SemanticFrame | None]], ...] = (
    (lambda kinds, _: "eight" not in kinds and not kinds.isdisjoint(("circle", "laps")), _no_eight),
    (lambda _, text: any(f" {words} " in text for words in UPRIGHT), _upright),
    (lambda kinds, _: "keep" not in kinds and not kinds.isdisjoint(("down", "up", "lower", "raise")), _reached_last),
    (lambda kinds, _: "minus" in kinds, _below_zero),
    (lambda kinds, _: not kinds.isdisjoint(("lower", "under")) and kinds.isdisjoint(HIGHER), _lower_down),
    (lambda kinds, _: "reverse" in kinds, _backwards),
    (lambda kinds, _: kinds.issuperset(AT_SHARE), _at_a_share),
    (lambda kinds, _: "under" in kinds and kinds.isdisjoint(HIGHER), _underneath),
    (lambda kinds, _: "around" in kinds and kinds.isdisjoint(BETWEEN), _beside_both),
    (lambda _, text: any(f" {word} " in text for word in FURTHER), _more_room),
    (lambda kinds, _: not kinds.isdisjoint(("multiply", "waypoints")), _multiplied),
)
"""Which classes of words, or which words, call for which change of frames."""


def _crawls(said: Sequence[Chunk]) -> bool:
    slower = [chunk.text.lower() for chunk in said if chunk.kind in ("slower", "creep")]
    return not CRAWLING.isdisjoint(" ".join(slower).split())


CRAWLING = frozenset("crawl crawls crawling creep creeps creeping snail snail's inch tortoise dawdle tiptoe".split())
"""Words for being much slower."""
