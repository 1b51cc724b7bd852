"""What phrases of a sentence without a trajectory ask for besides its way: read as any instruction is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

from ovita.instruct.frames import (
    Approach,
    Clearance,
    Extend,
    Figure,
    Height,
    Hover,
    Keep,
    Pace,
    Quantity,
    Reading,
    Role,
    SemanticFrame,
    Shift,
    Smooth,
    StopAt,
    Wait,
)
from ovita.instruct.lexicon import term_at
from ovita.instruct.meaning import same
from ovita.instruct.referee import Outcome
from ovita.instruct.understanding import understand
from ovita.paths.part import WHOLE, PathPart
from ovita.paths.scene import Scene
from ovita.sources.heights import HeightTold, height_in
from ovita.sources.laps import Lap, lap_in
from ovita.sources.places import Location, mentioned_in, phrase_at, way_words

TIES, ONWARD, COURTESIES, MOVED = map(way_words, ("tie", "onward", "courtesy", "moved"))
STARTING, FINISHING, HOLDING = map(way_words, ("set off", "come in", "holding"))


@dataclass(frozen=True)
class Wish:
    """What is asked for besides the way.

    Args:
        text: In the words of the sentence.
        outcome: What is to be done about it: do it, show it first, ask back, or decline.
        reading: The frames that it comes to, or its question.
        unused: Words that ask for something and that the reading leaves out.
        doubts: What speaks against the reading, as sentences.
        stretch: The place that the way comes to, if shares of the way are shares of the stretch to it; else None.
        height: The height over the ground that it is about, or None.
        lap: The circle that it is, as it was told, or None.
    """

    text: str
    outcome: Outcome
    reading: Reading
    unused: tuple[str, ...] = ()
    doubts: tuple[str, ...] = ()
    stretch: Location | None = None
    height: HeightTold | None = None
    lap: Lap | None = None

    @property
    def frames(self) -> tuple[SemanticFrame, ...]:
        """What it comes to."""
        return self.reading.frames

    def without(self, frames: Sequence[SemanticFrame]) -> Wish:
        """The wish but for some frames, which are seen to otherwise."""
        return self.with_frames(frame for frame in self.frames if frame not in frames)

    def with_frames(self, frames: Iterable[SemanticFrame]) -> Wish:
        """The wish with other frames."""
        return replace(self, reading=replace(self.reading, frames=tuple(frames)))


@dataclass(frozen=True)
class Level:
    """A height to go at between the ends of the way.

    Args:
        height: Over the ground, or what the way is to be higher or lower by [m]; None where that is left open.
        least: Whether higher is as good.
        beyond: Whether it is higher than both ends, or lower, by the height; "" for a height over the ground.
        halfway: Whether it is that of the middle of the way only.
    """

    height: float | None
    least: bool = False
    beyond: Literal["", "up", "down"] = ""
    halfway: bool = False


def bare(said: str) -> str:
    """A wish without the words that tie it to what is before."""
    said = said.strip(" ,;.:!?")
    before, _, last = said.rpartition(" ")
    if before and last.lower() in COURTESIES:
        return bare(before)
    first, _, rest = said.partition(" ")
    return bare(rest) if first.lower().strip(",") in TIES and rest else said


def wishes_of(said: str, scene: Scene) -> list[Wish]:
    """What a phrase of wishes comes to; a height over the ground that stands in it is a wish of its own."""
    told = height_in(said, lambda words: bool(mentioned_in(words, scene)))
    if told is None:
        return _around(said, scene) or _above(said, _apart(said, scene), scene)
    role: Role = "at_least" if told.least else "to"
    level = Wish(told.words, "do", Reading(frames=(Height(level=Quantity(told.height, "m", role)),)), height=told)
    rest = "" if HOLDING.issuperset(told.rest.lower().split()) else bare(told.rest)
    others = wishes_of(rest, scene) if rest else []
    others = [] if all(map(_lies_low, others)) else others
    sure = all(wish.outcome == "do" and wish.frames for wish in others)
    return [*others, level] if sure else _apart(said, scene)


def _around(said: str, scene: Scene) -> list[Wish]:
    """The circle that a phrase tells, and what else it asks for; else nothing."""
    lap = lap_in(said, scene)
    if lap is None:
        return []
    left = bare(lap.left)
    others = _apart(left, scene) if left else []
    doing = [wish for wish in others if wish.outcome == "do" and wish.frames]
    unused = () if len(doing) == len(others) else (left,)
    circle = Wish(said, "needs_confirmation" if unused else "do", Reading(frames=(lap.figure,)), unused, lap=lap)
    return [circle, *(doing if not unused else [])]


def _lies_low(wish: Wish) -> bool:
    """Whether it only goes lower or higher by no amount, which a height tells that is told beside it."""
    shifts = [f.offset for f in wish.frames if isinstance(f, Shift) and f.part == WHOLE]
    return len(shifts) == len(wish.frames) == 1 and shifts[0] in ((("down", None),), (("up", None),))


def _above(said: str, heard: list[Wish], scene: Scene) -> list[Wish]:
    """What was heard, with a figure that is told over a thing as one at it: "a small spiral over the bin"."""
    shapes = [frame.shape for wish in heard for frame in wish.frames if isinstance(frame, Figure)]
    if not shapes or all(wish.outcome == "do" for wish in heard):
        return heard
    again = _apart(" ".join("at" if word.lower() in MADE_AT else word for word in said.split()), scene)
    return again if all(wish.outcome == "do" and wish.frames for wish in again) else heard


MADE_AT = frozenset(("over", "above", "around", "round"))
"""With a figure, these tell where it is made and not what it leads over."""


def _apart(said: str, scene: Scene) -> list[Wish]:
    """What a phrase comes to as a whole, or part by part where only that is certain."""
    whole = read_wish(said, scene)
    texts = map(bare, said.replace(";", ",").replace(" and ", ", ").split(", "))
    parts = [read_wish(part, scene) for part in texts if part]
    sure = [part for part in parts if part.outcome == "do"]
    told = [len(frame.quantities) for frame in whole.frames if isinstance(frame, Clearance)]
    if whole.outcome == "do" and 0 < sum(len(f.quantities) for part in parts for f in part.frames) <= sum(told):
        return [whole]  # "not near the bottle, minimum one metre"
    if 1 < len(parts) == len(sure) and (whole.outcome != "do" or len(whole.frames) < len(parts)):
        return parts
    if whole.outcome == "needs_confirmation" and _say_all(sure, parts, whole):
        return sure  # "a metre from the nest, she sits on six eggs"
    kinds = {type(frame) for frame in whole.frames}
    lost = (part for part in sure if kinds and kinds.isdisjoint(map(type, part.frames)))
    return [whole, *lost]


def _say_all(sure: Sequence[Wish], parts: Sequence[Wish], whole: Wish) -> bool:
    """Whether the parts that are certain say what the whole does, and the others nothing."""
    if not sure or any(part.frames for part in parts if part not in sure):
        return False
    return same(tuple(frame for part in sure for frame in part.frames), whole.frames)


def read_wish(said: str, scene: Scene) -> Wish:
    """What a phrase comes to as a whole: a word too many that asks for nothing does not put it in doubt."""
    verdict = understand(said, scene)
    verdict = replace(verdict, unused=tuple(word for word in verdict.unused if not _told(word, verdict.reading)))
    open_words = [word for word in verdict.unused if not _paced(word, verdict.reading)]
    upright = all(isinstance(frame, Figure | Smooth | Clearance | Pace) for frame in verdict.reading.frames)
    enough = LEARNED if upright else HEARD
    sure = verdict.confidence >= enough and not open_words and not verdict.doubts
    outcome: Outcome = "do" if sure and verdict.outcome == "needs_confirmation" else verdict.outcome
    return _at_an_end(_with_pace(_rising(Wish(said, outcome, verdict.reading, verdict.unused, verdict.doubts))))


def _rising(wish: Wish) -> Wish:
    """A spiral that its words say to rise, by no amount yet: "let it rise in a spiral"."""
    rising = [word for word in wish.unused if term_at([word.lower()], 0)[0] == "up"]
    spiral = len(wish.frames) == 1 and isinstance(wish.frames[0], Figure) and wish.frames[0].shape == "spiral"
    if not (rising and spiral) or wish.doubts:
        return wish
    unused = tuple(word for word in wish.unused if word not in rising)
    outcome: Outcome = wish.outcome if unused else "do"
    risen = (replace(frame, rise=Quantity(1.0)) for frame in wish.frames if isinstance(frame, Figure))
    return replace(wish.with_frames(risen), unused=unused, outcome=outcome)


def _told(word: str, reading: Reading) -> bool:
    """Whether a word that a reader leaves out tells what is read, or only what is moved: "let the camera wave"."""
    shapes = {frame.shape for frame in reading.frames if isinstance(frame, Figure)}
    kind = term_at([word.lower()], 0)[0]
    along = {direction for frame in reading.frames if isinstance(frame, Shift) for direction, _ in frame.offset}
    parts = {frame.part.kind for frame in reading.frames}
    degrees = {frame.degree for frame in reading.frames}
    if HEIGHTS.get(word.lower(), "") in along or ENDS.get(word.lower(), "") in parts:
        return True
    if kind == term_at(["very"], 0)[0] and "large" in degrees:
        return True
    return word.lower() in MOVED or kind in shapes or (kind in WAVY and not WAVY.isdisjoint(shapes))


HEIGHTS = {"high": "up", "up": "up", "low": "down", "down": "down"}
"""Words that tell to go higher or lower once more: "stay up high"."""

ENDS = {"first": "first", "start": "first", "beginning": "first", "last": "last", "end": "last", "finish": "last"}
"""Words that tell a part of the way by its end."""

WAVY = frozenset(("wave", "waves", "zigzag"))
"""Classes of words, and figures, that go from side to side."""


def _paced(word: str, reading: Reading) -> bool:
    """Whether a word that a reader leaves out tells a speed where none is read, see `_with_pace`."""
    return term_at([word.lower()], 0)[0] in ("slower", "faster") and not any(
        isinstance(frame, Pace) for frame in reading.frames
    )


def _with_pace(wish: Wish) -> Wish:
    """A wish with the speed of a word that its reading leaves out: "in slow gentle waves"."""
    if not wish.frames or any(isinstance(frame, Pace) for frame in wish.frames):
        return wish
    told = {kind for word in wish.unused if (kind := term_at([word], 0)[0]) in ("slower", "faster")}
    if len(told) != 1:
        return wish
    change: Literal["slower", "faster"] = "slower" if "slower" in told else "faster"
    unused = tuple(word for word in wish.unused if term_at([word], 0)[0] != change)
    return replace(wish, reading=replace(wish.reading, frames=(*wish.frames, Pace(change=change))), unused=unused)


def _at_an_end(wish: Wish) -> Wish:
    """A wish with a change of speed at that end of the way which its first words are about: "start slowly"."""
    words = wish.text.lower().split()
    begins, ends = (phrase_at(words, 0, phrases)[1] for phrases in (STARTING, FINISHING))
    (frame, *more) = wish.frames or (None,)
    if more or not isinstance(frame, Pace) or frame.part != WHOLE or frame.amount is not None or not (begins or ends):
        return wish
    if len(words) > max(begins, ends) + MANNER:
        return wish
    there = replace(frame, part=PathPart("first" if begins else "last", unit="share"))
    return replace(wish, reading=replace(wish.reading, frames=(there,)), unused=())


MANNER = 3
"""Words that tell how an end of the way is left or come to: "nice and slowly"."""


LEARNED = 0.4
"""How likely a phrase has to be meant to be done without asking, of a kind that cannot be taken the wrong way round, as
a bound can."""

HEARD = 0.49
"""The same of any other kind; of nine sentences of strangers to the network that were as likely, it read nine right."""


def level_of(heard: Sequence[Wish]) -> Level | None:
    """The height over the ground at which the whole way is to go, if that is all that is asked for."""
    if len(heard) != 1 or len(heard[0].frames) != 1:
        return None
    (frame,), plain = heard[0].frames, not (heard[0].doubts or heard[0].unused)
    if isinstance(frame, Shift) and frame.part == WHOLE and len(frame.offset) == 1 and plain:
        (direction, far), *_ = frame.offset
        if direction not in ("up", "down") or (far is not None and far.unit != "m"):
            return None
        return Level(None if far is None else far.value, beyond="up" if direction == "up" else "down")
    if heard[0].outcome != "do":
        return None
    if not isinstance(frame, Height) or frame.of or frame.part != WHOLE or frame.level.role not in ("to", "at_least"):
        return None
    told = heard[0].height
    return Level(frame.level.value, frame.level.role == "at_least", halfway=told is not None and told.halfway)


def level_apart(wish: Wish) -> list[Wish]:
    """A wish with the height of the whole way that it holds besides as one of its own."""
    alone = [wish.with_frames((frame,)) for frame in wish.frames]
    levels = [one for one in alone if level_of([one]) is not None]
    return [wish.without(levels[0].frames), *levels] if len(levels) == 1 < len(alone) else [wish]


def open_ended(frame: SemanticFrame) -> bool:
    """Whether it only goes on, neither so far nor to anywhere."""
    return isinstance(frame, Extend) and not (frame.by or frame.offset or frame.place)


def without_going_on(wish: Wish) -> Wish:
    """A wish without what only goes on."""
    return wish.with_frames(frame for frame in wish.frames if not open_ended(frame))


def on_part(wish: Wish, kind: Literal["before", "after"], place: str) -> Wish:
    """A wish whose speed counts before or behind an object: "wait at the cup, then move on, faster"."""
    part = PathPart(kind, places=(place,))
    varied = (isinstance(f, Pace) and f.part == WHOLE and f.change in ("faster", "slower", "set") for f in wish.frames)
    frames = (replace(f, part=part) if here else f for f, here in zip(wish.frames, varied, strict=True))
    return wish.with_frames(frames)


def without_twins(wishes: Sequence[Wish]) -> list[Wish]:
    """Wishes but for what another one tells as well, as exactly or by an amount: "take it easy, half speed"."""
    told = [_subject(frame) for wish in wishes for frame in wish.frames if frame.quantities]
    found, known = list[Wish](), list[SemanticFrame]()
    for wish in wishes:
        kept = [frame for frame in wish.frames if frame not in known and not _twin(frame, told)]
        known += kept
        found += [wish.with_frames(kept)] if kept or not wish.frames else []
    return found


def _twin(frame: SemanticFrame, told: Sequence[object]) -> bool:
    """Whether a frame tells by no amount what another one tells: a speed, a stop where there is a wait, a distance."""
    if isinstance(frame, StopAt):
        return ("wait", frame.place) in told
    if isinstance(frame, Hover):  # "hang about above the cup for 3 s"
        return not frame.quantities and all(("wait", name) in told for name in frame.named)
    if isinstance(frame, Keep):  # "a constant speed of 0.15 m/s, the speed must not change"
        return frame.what == "speed" and ("constant", frame.part) in told
    if isinstance(frame, Approach):
        return frame.sense == "farther" and ("clear", frame.objects) in told
    if isinstance(frame, Pace) and frame.change == "slower" and ("set", frame.part) in told:
        return not frame.quantities  # "easy, half the speed"
    return isinstance(frame, Pace | Wait) and not frame.quantities and _subject(frame) in told


def _subject(frame: SemanticFrame) -> object:
    """What a change of speed, a wait or a distance is about, whatever its amount."""
    if isinstance(frame, Pace):
        return frame.change, frame.part
    if isinstance(frame, Clearance):
        return "clear", frame.objects
    return ("wait", frame.place) if isinstance(frame, Wait) else None
