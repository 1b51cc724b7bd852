"""Reading feedback against the last turns."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ovita.dialogue.feedback.amounts import amounts
from ovita.dialogue.feedback.context import Context, all_parts, named_objects
from ovita.dialogue.feedback.corrections import corrected
from ovita.dialogue.feedback.resolution import Resolution
from ovita.dialogue.feedback.rewording import Wording, worded, words_as_parts
from ovita.dialogue.feedback.taking_back import brought_back, dropped, taken_back
from ovita.dialogue.feedback.utterance import Utterance, plain
from ovita.paths.scene import Scene, canonical
from ovita.paths.trajectory import Trajectory
from ovita.request import Turn

_BUT = re.compile(
    r"^(?:(?:that is |it is )?(?:almost|good|great|nice|fine|perfect|better|not bad|okay|ok)(?: already| so far)?"
    r"(?:[,.]? (?:but|only|just|and now|and|now)|[,.]) )(?=\S)"
)
LONGEST = 14
"""Words in the longest sentence that is read as feedback."""


def resolve(said: str, history: Sequence[Turn], scene: Scene, current: Trajectory) -> Resolution | None:
    """Read a sentence as feedback on the turns before it.

    Args:
        said: What the person said.
        history: The turns in force, oldest first; where all were taken back, they can only be brought back.
        scene: The surroundings.
        current: The trajectory as it stands.

    Returns:
        What it comes to, or None if it is an instruction of its own.
    """
    if len(said.split()) > LONGEST:
        return None
    read = plain(said, scene)
    if not history:
        return brought_back(read, said)
    return _resolved(read, Context(said, tuple(history), scene, current))


def answer(asked: str, said: str, history: Sequence[Turn], scene: Scene, current: Trajectory) -> Resolution | None:
    """Read a sentence as the answer to a question that feedback led to.

    Args:
        asked: The feedback that led to the question.
        said: The answer, such as "the shift".
        history: The turns in force, oldest first.
        scene: The surroundings.
        current: The trajectory as it stands.
    """
    if not history or len(said.split()) > LONGEST:
        return None
    context = Context(f"{asked} / {said}", tuple(history), scene, current)
    reference = context.reference(plain(said, scene).text)
    if not reference:
        return None
    found = _resolved(plain(asked, scene), Context(context.said, context.history, scene, current, reference))
    return None if found is None or found.kind == "ask" else found


def clarified(asked: str, said: str, scene: Scene) -> str:
    """Put the answer to "which cup?" into the instruction that led to the question.

    Args:
        asked: The instruction, such as "slow down near the cup".
        said: The answer, such as "the blue one".
        scene: The surroundings.

    Returns:
        The instruction with the object's full name, or "" if the answer names no one object that it speaks of.
    """
    if len(said.split()) > LONGEST:
        return ""
    meant = named_objects(plain(said, scene).text, scene)
    if len(meant) != 1:
        return ""
    head = canonical(meant[0].name).split()[-1]
    text = re.sub(rf"\b{re.escape(head)}\b", lambda _: meant[0].name, asked, count=1, flags=re.IGNORECASE)
    return text if text != asked and words_as_parts(text, scene) is not None else ""


def together(history: Sequence[Turn], instruction: str, scene: Scene, original: Trajectory) -> Wording | None:
    """All utterances so far plus a new instruction as one instruction on the original, keeping tuned parameters.

    Returns:
        The instruction; or None where it would not be read as its parts were, such as "left" and then "right".
    """
    before, added = all_parts(history, scene), words_as_parts(instruction, scene)
    if before is not None and added is not None:
        return worded((*before, *added), original, scene, between=". ")
    texts = [*(past.instruction for past in history), instruction]
    return Wording(". ".join(text.strip().rstrip(".!?;, ") for text in texts), {})


def _resolved(read: Utterance, context: Context) -> Resolution | None:
    text = _BUT.sub("", read.text)
    read = Utterance(text, read.corrects, read.denied)
    readings = (taken_back, dropped, amounts, corrected) if read.denied else (taken_back, amounts, corrected, dropped)
    for reading in readings:
        found = reading(read, context)
        if found is not None:
            return found
    return _plainly(text, context)


def _plainly(text: str, c: Context) -> Resolution | None:
    """An instruction that is understood once what says nothing is left out: "nice, and slow down near the cup"."""
    if text == " ".join(c.said.lower().split()).strip(" ,.!?;:"):
        return None
    if words_as_parts(c.said, c.scene) is not None or words_as_parts(text, c.scene) is None:
        return None
    return Resolution("rewrite", c.took(text), instruction=text, begins="current")
