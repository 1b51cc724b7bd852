"""What "there", "it" and "both of them" point at in a dialogue, in words that can be read by themselves."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ovita.instruct.frames import Approach, Clearance, SemanticFrame, Visit, frame_objects
from ovita.instruct.objects import head_of, singular
from ovita.instruct.remarks import named_objects
from ovita.paths.part import PathPart
from ovita.paths.scene import Scene, SceneObject, canonical

WORDED = ("near", "first", "last", "middle", "after", "before", "between", "turns")
"""Kinds of parts of which the words are those that a person would say."""


def spelt_out(text: str, before: str, turns: Sequence[Sequence[SemanticFrame]], scene: Scene) -> str:
    """An utterance with names for what "it", "there" and "both of them" point at.

    Args:
        text: What is said.
        before: What was said last.
        turns: The frames of each turn in force, oldest first.
        scene: Whose objects it may name.
    """
    if not turns:
        return text
    text = with_other(text, [frame for frames in turns for frame in frames], scene)
    text = _with_its_place(text, before, turns[-1], scene)
    everything = dict.fromkeys(name for frames in turns for frame in frames for name in frame_objects(frame))
    text = with_both(text, [*everything][-2:], scene)
    named = {name for frame in turns[-1] for name in frame.named}
    text = with_name(text, named.pop(), scene) if len(named) == 1 else text
    about = {name for frame in turns[-1] for name in frame_objects(frame)}
    nearing = any(isinstance(frame, Approach | Clearance | Visit) for frame in turns[-1])
    return too_near(text, about.pop(), scene) if len(about) == 1 and not nearing else text


def _with_its_place(text: str, before: str, frames: Sequence[SemanticFrame], scene: Scene) -> str:
    """An utterance with the one part of the path, or the one object, of the last turn for its "there"."""
    there, parts = _things(before, frames, scene), list[PathPart]()
    parts += [part for frame in frames if (part := frame.part) and part not in parts]
    told = [part for part in parts if part.kind in WORDED and (part.kind != "near" or not there)]
    if len(parts) == len(told) == 1:
        return with_place(text, told[0].words(), scene)
    return with_place(text, f"at the {there[0].name}", scene) if len(there) == 1 else text


def _things(before: str, frames: Sequence[SemanticFrame], scene: Scene) -> tuple[SceneObject, ...]:
    """The objects that were named last; where that was several, or none, those that the last turn is about."""
    there = named_objects(before, scene)
    about = {name for frame in frames for name in frame_objects(frame)}
    if len(there) == 1:
        return there
    return tuple(item for item in there or scene if item.name in about)


_THERE = re.compile(
    r"(?P<do>\b(?:wait|stop|pause|hover|hold|stay|linger|dwell|rest|remain|hang"
    r"|slower|faster|higher|lower|slow down|speed up|closer|speed|pace|shift|move|raise|lift"
    r"|slow|slowly|fast|quick|quickly|gently|careful|carefully)\b[^.,;!?]*?) "
    r"there\b(?! (?:is|are|was|were)\b)",
    re.IGNORECASE,
)
_ONLY_THERE = re.compile(r",? ?\b(?:but|and) only there\b", re.IGNORECASE)  # where it is said before
_THAT_PART = re.compile(
    r"\b(?:over|on|in|along|for|through|during) (?:that|this) (?:same )?(?:bit|part|stretch|piece|section|leg)\b",
    re.IGNORECASE,
)
_OWN_PLACE = re.compile(r"\b(?:end|goal|finish|start|beginning|middle)\b[^.;!?]*\bthere\b", re.IGNORECASE)
_ELSE = re.compile(
    r"\b(?:everywhere|anywhere) else\b|\belsewhere\b"
    r"|(?:\b(?:on|for)|(?:^|(?<=[.!] ))(?:(?:and|now|then|but),? )*) ?the rest\b"
    r"(?: of (?:the|its|your) (?:way|path|route|trip|run|flight)\b)?(?! of\b| is\b| was\b| are\b| were\b| looks?\b)",
    re.IGNORECASE,
)
_ON_THE_WAY = re.compile(r"\b(?:on|along|during) (?:the|its|your) way there\b", re.IGNORECASE)
_HOVER = re.compile(r"\bhover(?=[^.,;!?]*\bthere\b)", re.IGNORECASE)  # where it is, not so high over the thing
_FROM_THERE = re.compile(r"\bfrom there (?P<on>on(?:wards?)?\b|(?=to\b))", re.IGNORECASE)


def with_place(text: str, place: str, scene: Scene) -> str:
    """An utterance with a place for its "there", unless it names an object itself: "wait there for 3 seconds"."""
    text = _ONLY_THERE.sub("", _THAT_PART.sub("there", text))
    if any(word.lower() in text.lower() for word in (*scene.names, "instead", "not ", "only")):
        return text
    if _OWN_PLACE.search(text):
        return text
    text = _HOVER.sub("wait", _ELSE.sub(f" everywhere except {place}", text)).strip()
    if place.startswith("at the "):
        thing = place.removeprefix("at ")
        text = _ON_THE_WAY.sub(f"on the way to {thing}", text)
        text = _FROM_THERE.sub(lambda found: f"after {thing}" if found["on"] else f"from {thing} ", text)
    return _THERE.sub(lambda found: f"{found['do']} {place}", text)


_THING = re.compile(r"\b(?:(?:the|that|this) (?:thing|object|one)|that|it)\b", re.IGNORECASE)


def with_thing(text: str, name: str) -> tuple[str, ...]:
    """An utterance with the name of the thing that it left open, in its place and at its end."""
    asked = text.rstrip(" .!?")
    return (_THING.sub(f"the {name}", asked, count=1), f"{asked} the {name}", f"{asked} from the {name}")


_OTHER = re.compile(r"\b(?:(?:the|that|this|a) )?(other|wrong) (\w+)\b", re.IGNORECASE)
INSTEAD = frozenset("no no, not please one oops sorry sorry, wait i mean meant, meant".split())
"""Words beside "the other one" with which it is meant instead of what was said, not besides."""


def with_other(text: str, before: Sequence[SemanticFrame], scene: Scene) -> str:
    """An utterance with the name of the one thing for "the other cup", "the wrong cup" that was not meant before."""
    found = _OTHER.search(text)
    meant = {name for frame in before for name in frame.named}
    if found is None or not meant:
        return text
    noun, words = singular(found[2].lower()), {*text.lower().split()}
    instead = words <= {*found[0].lower().split(), *INSTEAD} or found[1].lower() == "wrong"
    kinds = {*map(_kind, meant)}
    kinds &= kinds if noun == "one" else {noun}
    others = [item.name for item in scene if _kind(item.name) in kinds and item.name not in meant]
    if len(others) != 1:
        return text
    return f"{text[: found.start()]}{'I meant ' * instead}the {others[0]}{text[found.end() :]}"


def _kind(name: str) -> str:
    """The noun in an object's name."""
    return head_of(canonical(name).split())


_BOTH = re.compile(r"\b(?:both of them|them both|the two of them|these two|those two|both)\b", re.IGNORECASE)


def with_both(text: str, names: Sequence[str], scene: Scene) -> str:
    """An utterance with the names of two things for "both of them", unless it names an object itself."""
    if len(names) != 2 or any(known.lower() in text.lower() for known in scene.names):
        return text
    return _BOTH.sub(f"the {names[0]} and the {names[1]}", text, count=1)


_PASSED_IT = re.compile(
    r"\b(pass|passing|past|near|by|around|over|under|beside|behind|next to|close to) it\b", re.IGNORECASE
)


def with_name(text: str, name: str, scene: Scene) -> str:
    """An utterance with a name for an "it" that is a thing, not the path: "slower while you pass it".

    It stays as it is where it names an object itself.
    """
    if any(known.lower() in text.lower() for known in scene.names):
        return text
    return _PASSED_IT.sub(rf"\1 the {name}", text)


_TOO_NEAR = re.compile(
    r"\btoo (?:close|near)\b(?= *(?:$|[.,;!?]|as well\b|too\b|again\b|now\b|still\b))", re.IGNORECASE
)


def too_near(text: str, name: str, scene: Scene) -> str:
    """An utterance with a name for what the path is too close to, where it is about another change than that."""
    if any(known.lower() in text.lower() for known in scene.names):
        return text
    return _TOO_NEAR.sub(rf"\g<0> to the {name}", text)
