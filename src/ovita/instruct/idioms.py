"""Turns of phrase that no reader takes word by word, put in words that mean the same: "down the middle"."""

from __future__ import annotations

import re

from ovita.paths.scene import Scene

_ENDS = r"(?:start|begin)(?:ing)? and (?:stop|end|finish)(?:ing)?"
_ON = r"(?:through|on|past|by|going|moving|driving|flying|rolling)"

_SAID: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(said, re.IGNORECASE), meant)
    for said, meant in (
        (rf"\b{_ENDS} (?:at|in|on) the same (?:place|spot|point|position)s?\b", "keep the start and the end"),
        (r"\b(?:normal|usual|regular) speed (?=till|until|up to)", "keep the speed "),
        (r"\bdown the middle\b", "through the middle"),
        (
            r"\bcome in (?:(?:a (?:bit|little)|more|nice and|very) )?(?:gently|softly|slowly|slower|gentler|easy)"
            r"(?=\s*(?:$|[.,;!]|and\b))",
            "slow down at the end",
        ),
        (
            # what follows a stop that is denied says no more than that
            r"(?P<no>\b(?:no|not|don'?t|doesn'?t|never|without|skip)\b(?:(?!\b(?:and|but)\b)[^.;!?,]){0,25}"
            r"\b(?:stop|wait|paus|halt)[^.;!?,]*),?"
            rf"\s+(?:and\s+)?(?:just\s+|simply\s+)?(?:drive|go|fly|carry|keep|pass|roll|move|run)\s+(?:straight\s+|right\s+)?{_ON}"
            r"(?:\s+it)?(?=\s*(?:$|[.!,;]))",
            r"\g<no>",
        ),
    )
)


def plainer(text: str, scene: Scene) -> str:
    """An utterance with plain words for turns of phrase, and "and" for an "or" between two objects.

    Args:
        text: As it was said or typed.
        scene: With the names of objects.
    """
    for said, meant in _SAID:
        text = said.sub(meant, text)
    names = "|".join(sorted(map(re.escape, scene.names), key=len, reverse=True))
    if " or " not in text or not names:
        return text
    return re.sub(
        rf"\b({names}) or (?=(?:the )?(?:{names})\s*(?:$|[.,;!]|and\b))", r"\1 and ", text, flags=re.IGNORECASE
    )


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
