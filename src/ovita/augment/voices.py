"""Wordings from what people wrote: sentences with their readings become sentences with slots.

A folder of voices holds a file for each person, in the layout of `training/corpus`: lines `# scene: OBJECTS`, and lines
`sentence | reading` with the reading in the notation of frames. Only what can be said of any scene is taken: sentences
of one frame whose objects and numbers all stand in them as the reading has them, and that name nothing else.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from ovita.augment.wording import Wordings, grammar, ordered
from ovita.errors import InputError, RequestError
from ovita.instruct import notation
from ovita.io.files import read_text

_UNITS = {
    "cm": (r"(?:cm|centimet(?:re|er)s?)", "m"),
    "m": (r"(?:m|met(?:re|er)s?)", "m"),
    "%": (r"(?:%|per ?cent)", "pc"),
    "s": (r"(?:s|sec|seconds?)", "s"),
    "m/s": (r"(?:m/s|met(?:re|er)s? per second)", "v"),
    "deg": (r"(?:°|deg|degrees?)", "deg"),
    "wp": (r"(?=(?:way)?points)", "k"),
}
"""How people write the units of the notation, and the slot that such a number fills."""

_OWNED = re.compile(
    r"\b(?:my|your|our|his|her|its|their|a|an|this|that|these|those|each|every|no|one) \{obj\}", re.IGNORECASE
)
"""Before "the cup" no other word may say which."""

_QUANTITY = re.compile(r"(\d*\.?\d+)(cm|m/s|m|%|s|deg|wp)(?![\w/])")


def with_voices(folder: str | os.PathLike[str]) -> Wordings:
    """The grammar with the wordings of a folder of voices.

    Raises:
        RequestError: If no sentence in it can be used.
        FormatError: If a file cannot be read.
    """
    found: dict[str, dict[str, None]] = {}
    files = sorted(Path(folder).glob("*.txt"))
    for file in files:
        for shape, sentence in _of_file(read_text(file)):
            found.setdefault(shape, {})[sentence] = None
    if not found:
        raise RequestError(f"{folder}: none of its {len(files)} .txt files has a sentence with a reading")
    return replace(grammar(), voices={shape: tuple(found[shape]) for shape in sorted(found)})


def _of_file(text: str) -> Iterator[tuple[str, str]]:
    objects: tuple[str, ...] = ()
    for line in text.splitlines():
        if line.startswith("# scene:"):
            objects = tuple(name.strip() for name in line.removeprefix("# scene:").split(",") if name.strip())
        sentence, bar, reading = line.rpartition(" | ")
        if bar and not line.startswith("#") and "=>" not in sentence:
            pair = slotted(sentence.strip(), reading.strip(), objects)
            if pair is not None:
                yield pair


def slotted(sentence: str, reading: str, objects: Sequence[str]) -> tuple[str, str] | None:
    """The shape of a reading and its sentence, both with slots; None where the sentence cannot be said elsewhere.

    Args:
        sentence: As a person wrote it.
        reading: In the notation.
        objects: Names of the scene's objects.
    """
    try:
        frames = notation.parse(reading, objects) if reading[:1] not in "?!" else ()
    except InputError:
        return None
    if len(frames) != 1 or "{" in sentence or len(frames[0].named) > 1:
        return None
    shape = reading
    for name in frames[0].named:
        sentence, count = re.subn(rf"\b(?:the )?{re.escape(name)}\b", "{obj}", sentence, flags=re.IGNORECASE)
        shape = shape.replace(name.replace(" ", "_"), "{obj}")
        if count != 1:
            return None
    for number, unit in _QUANTITY.findall(reading):
        said, slot = _UNITS[unit]
        ending, filled = ("", "{k} ") if unit == "wp" else (r"(?![\w/])", f"{{{slot}}}")
        sentence, count = re.subn(rf"(?<![\d.]){re.escape(number)} ?{said}{ending}", filled, sentence)
        shape = shape.replace(f"{number}{unit}", f"{{{slot}}}wp" if unit == "wp" else f"{{{slot}}}", 1)
        if count != 1:
            return None
    return None if _elsewhere(sentence, shape, objects) else (ordered(shape), sentence)


def _elsewhere(sentence: str, shape: str, objects: Sequence[str]) -> bool:
    """Whether a sentence still speaks of its own scene, or has a number or a slot that its reading has not once."""
    slots = re.findall(r"\{\w+\}", sentence)
    if sorted(slots) != sorted(re.findall(r"\{\w+\}", shape)) or len(set(slots)) != len(slots):
        return True
    words = {word for name in objects for word in name.casefold().split()}
    if _OWNED.search(sentence):
        return True
    plain = re.sub(r"\{\w+\}", " ", sentence).casefold()
    return any(c.isdigit() for c in plain) or bool(words & set(re.findall(r"\w+", plain)))
