"""What is asked for on a ground, drawn at random from meanings with slots, and the ways to say it.

The meanings and the sentences are in wordings.toml; what people wrote may be added, as sentences with slots. A folder
of such voices holds a file for each person, in the layout of `training/corpus`: lines `# scene: OBJECTS`, and lines
`sentence | reading` with the reading in the notation of frames. Only what can be said of any scene is taken: sentences
of one frame whose objects and numbers all stand in them as the reading has them, and that name nothing else.
"""

from __future__ import annotations

import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.resources import files
from pathlib import Path
from random import Random
from typing import TypeVar

from ovita.augment.ground import Ground
from ovita.errors import InputError, RequestError
from ovita.instruct import notation
from ovita.instruct.frames import SemanticFrame
from ovita.io.files import read_text
from ovita.paths.scene import SceneObject

T = TypeVar("T")

SEVERAL = "several"
"""The family of two meanings in one sentence."""

SIDES = ("left", "right", "front", "back", "up", "down")
_AXIS = {"left": 0, "right": 0, "front": 1, "back": 1, "up": 2, "down": 2}


class NotOffered(Exception):
    """A meaning that this ground cannot offer, such as an object where there is none."""


@dataclass(frozen=True)
class Meaning:
    """A meaning with slots, and sentences for it.

    Args:
        means: In the notation of frames, with slots in braces.
        changes: "path", "speed", "end" or "count".
        say: Sentences with the same slots.
    """

    family: str
    means: str
    changes: str
    say: tuple[str, ...]

    @property
    def lifts(self) -> bool:
        """Whether it is about up and down, in so many words."""
        return any(word in self.means for word in (" up=", " down=", " over="))


Filled = tuple[str, tuple[str, ...]]
"""A slot's text in the notation, and its phrases."""

Slots = Mapping[str, Filled]


@dataclass(frozen=True)
class Wordings:
    """Meanings and the words around them.

    Args:
        openers, closers, joins: What stands before, behind and between clauses; "" is a word, too.
        parts: Parts of the path in the notation, each with its phrases.
        directions: The phrases of each direction word.
        voices: Sentences of people, by the shape of what they mean (see `shape_of`).
    """

    meanings: Mapping[str, tuple[Meaning, ...]]
    openers: tuple[str, ...] = ("",)
    closers: tuple[str, ...] = ("",)
    joins: tuple[str, ...] = (" and ",)
    parts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    directions: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    voices: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def families(self) -> tuple[str, ...]:
        """Every family, that of two meanings last."""
        return (*self.meanings, SEVERAL)


@cache
def grammar() -> Wordings:
    """The wordings of wordings.toml."""
    table = tomllib.loads((files("ovita.augment") / "wordings.toml").read_text(encoding="utf-8"))
    meanings = {
        family: tuple(Meaning(family, m["means"], m["changes"], tuple(m["say"])) for m in entries)
        for family, entries in table.items()
        if isinstance(entries, list)
    }
    openers, closers, joins = (tuple(table[key]["say"]) for key in ("openers", "closers", "joins"))
    phrases = {key: {name: tuple(said) for name, said in table[key].items()} for key in ("parts", "dir")}
    return Wordings(meanings, openers, closers, joins, phrases["parts"], phrases["dir"])


def families_from(names: Sequence[str]) -> tuple[str, ...]:
    """The families of these names, all of them where there is no name.

    Raises:
        RequestError: If there is no such family.
    """
    known = grammar().families
    unknown = [name for name in names if name not in known]
    if unknown:
        raise RequestError(f"there is no family {unknown[0]!r}; choose from {', '.join(known)}")
    return tuple(dict.fromkeys(names)) or known


@dataclass(frozen=True)
class FilledMeaning:
    """A meaning whose slots are filled; `template` is what it means with its part of the path, slots left open."""

    meaning: Meaning
    slots: Slots
    template: str

    @property
    def means(self) -> str:
        """In the notation."""
        return self.meaning.means.format_map({name: text for name, (text, _) in self.slots.items()})


@dataclass(frozen=True)
class Drawing:
    """What is asked for: its family, its clauses, and their frames."""

    family: str
    clauses: tuple[FilledMeaning, ...]
    frames: tuple[SemanticFrame, ...]


def draw(rng: Random, ground: Ground, family: str, wordings: Wordings) -> Drawing:
    """Draw what is asked for on a ground.

    Raises:
        NotOffered: If the ground does not offer what was drawn.
    """
    if family == SEVERAL:
        chosen = _several(rng, wordings)
    else:
        offered = [meaning for meaning in wordings.meanings[family] if not (ground.flat and meaning.lifts)]
        if not offered:
            raise NotOffered("it stays on its plane")
        chosen = [one(rng, offered)]
    filled = tuple(_filled(rng, ground, meaning, wordings) for meaning in chosen)
    frames = notation.parse("; ".join(clause.means for clause in filled), ground.task.scene.names)
    return Drawing(family, filled, frames)


_TOGETHER = (("path", "speed"), ("path", "end"))


def _several(rng: Random, wordings: Wordings) -> list[Meaning]:
    """Two meanings that do not get into each other's way, in either order where the second is not an end."""
    left, right = one(rng, _TOGETHER)
    joined = [meaning for family in wordings.meanings.values() for meaning in family if meaning.family in _JOINED]
    pair = [one(rng, [meaning for meaning in joined if meaning.changes == change]) for change in (left, right)]
    return pair[::-1] if right == "speed" and rng.random() < 0.4 else pair


_JOINED = ("shift", "distance", "clearance", "speed", "ends", "wait")
"""Families that go together with others."""


def one(rng: Random, options: Sequence[T]) -> T:
    """One of several, each as likely; written so that no release of Python draws another."""
    return options[int(rng.random() * len(options))]


def between(rng: Random, low: float, high: float) -> float:
    """A number between two others."""
    return low + rng.random() * (high - low)


# Slots


def _filled(rng: Random, ground: Ground, meaning: Meaning, wordings: Wordings) -> FilledMeaning:
    slots: dict[str, Filled] = {}
    template, part = meaning.means, ""
    if "part" in slots_of(template):
        part = one(rng, tuple(wordings.parts))
        template, slots["part"] = template.replace("{part}", part), (part, wordings.parts[part])
    for name in dict.fromkeys((*slots_of(meaning.means), *slots_of(part))):
        if name != "part":
            slots[name] = _SLOTS[name](rng, ground, slots, wordings)
    if part:  # with its own slots filled; its phrases keep theirs
        slots["part"] = part.format_map({name: text for name, (text, _) in slots.items()}), wordings.parts[part]
    return FilledMeaning(meaning, slots, template)


@cache
def slots_of(text: str) -> tuple[str, ...]:
    """The names of the slots of a text, each once, in their order."""
    return tuple(dict.fromkeys(piece.partition("}")[0] for piece in text.split("{")[1:]))


Fill = Callable[[Random, Ground, "Slots", Wordings], Filled]


def _direction(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
    taken = {_AXIS[text] for name, (text, _) in slots.items() if name.startswith("dir")}
    side = one(rng, [side for side in SIDES if _AXIS[side] not in taken and not (ground.flat and _AXIS[side] == 2)])
    return side, wordings.directions[side]


def _object(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
    taken = {text for name, (text, _) in slots.items() if name.startswith("obj")}
    names = [name for name in ground.task.scene.names if name.replace(" ", "_") not in taken]
    if not names:
        raise NotOffered("no object is left")
    name = one(rng, names)
    return name.replace(" ", "_"), (f"the {name}",)


def _share(low: float, high: float) -> Fill:
    """A length between two shares of the extent."""
    return lambda rng, ground, slots, wordings: _length(between(rng, low, high) * ground.extent)


def _gap(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
    """A distance from the object that the path does not keep yet."""
    item = _item(ground, slots)
    if item.dimensions is None:
        raise NotOffered("its surface is not known")
    return _length(1.12 * max(ground.closest[item.name], 0.0) + between(rng, 0.02, 0.09) * ground.extent)


def _radius(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
    """A distance from the object's centre within which some of the waypoints lie."""
    distances = ground.distances[_item(ground, slots).name]
    return _length(float(distances[int(between(rng, 0.15, 0.4) * len(distances))]) * 1.05)


def _item(ground: Ground, slots: Slots) -> SceneObject:
    name = slots["obj"][0]
    return next(item for item in ground.task.scene if item.name.replace(" ", "_") == name)


def _length(metres: float) -> Filled:
    """A length to two digits, in centimetres and metres."""
    value = float(f"{metres:.2g}")
    if value >= 1.0:
        return f"{value:g}m", (f"{value:g} m", f"{value:g} metres", f"{value:g} meters", f"{100 * value:g} cm")
    centi = float(f"{100 * value:.2g}")
    said = (f"{centi:g} cm", f"{centi:g} cm", f"{centi:g} centimetres", f"{centi:g} centimeters", f"{value:g} m")
    return f"{centi:g}cm", said


def _speed(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
    value = float(f"{float(ground.task.trajectory.speeds.mean()) * between(rng, 0.6, 1.4):.2g}")
    return f"{value:g}m/s", (f"{value:g} m/s", f"{value:g} m/s", f"{value:g} metres per second")


def _number(unit: str, values: Sequence[int], *endings: str) -> Fill:
    """One of some numbers, with its unit in the notation and what people write behind it."""

    def fill(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
        value = one(rng, values)
        return f"{value}{unit}", tuple(f"{value}{ending}" for ending in endings)

    return fill


def _count(low: float, high: float) -> Fill:
    """A number of waypoints between two shares of those there are."""

    def fill(rng: Random, ground: Ground, slots: Slots, wordings: Wordings) -> Filled:
        value = max(2, round(between(rng, low, high) * len(ground.task.trajectory)))
        return str(value), (str(value),)

    return fill


_percent = _number("%", (10, 15, 20, 25, 30, 35, 40, 50, 60), "%", " %", " percent", " per cent")

_SLOTS: Mapping[str, Fill] = {
    "dir": _direction,
    "dir2": _direction,
    "obj": _object,
    "obj2": _object,
    "m": _share(0.06, 0.2),
    "small": _share(0.03, 0.08),
    "gap": _gap,
    "r": _radius,
    "pc": _percent,
    "share": _percent,
    "v": _speed,
    "s": _number("s", (2, 3, 4, 5, 6), " s", " seconds", " sec"),
    "deg": _number("deg", range(10, 65, 5), " degrees", "°", " deg"),
    "k": _count(0.12, 0.4),
    "k2": _count(0.5, 1.8),
}


# Sentences


def sentences(rng: Random, drawing: Drawing, wordings: Wordings, count: int) -> Iterator[str]:
    """Sentences for a drawing, each another one, the most varied first; fewer than `count` where words run out."""
    said: set[str] = set()
    for _ in range(3 * count):
        if len(said) == count:
            return
        text = _sentence(rng, drawing, wordings)
        if text.casefold() not in said:
            said.add(text.casefold())
            yield text


def _sentence(rng: Random, drawing: Drawing, wordings: Wordings) -> str:
    heard = _heard(drawing, wordings)
    if heard and rng.random() < 0.5:
        slots = drawing.clauses[0].slots
        return _inserted(rng, one(rng, heard), {_KIND.get(name, name): filled for name, filled in slots.items()})
    clauses = [_inserted(rng, one(rng, clause.meaning.say), clause.slots) for clause in drawing.clauses]
    text = clauses[0] + "".join(one(rng, wordings.joins) + clause for clause in clauses[1:])
    opener, closer = one(rng, wordings.openers), one(rng, wordings.closers)
    text = f"{opener}{text}{closer}"
    end = "?" if opener.startswith("Could") else one(rng, (".", ".", ""))
    return text[:1].upper() + text[1:] + end


def _inserted(rng: Random, text: str, slots: Slots) -> str:
    """A sentence with phrases in its slots; a part of the path has slots of its own."""
    while "{" in text:
        text = text.format_map({name: one(rng, phrases) for name, (_, phrases) in slots.items()})
    return text


_KIND = {"small": "m", "gap": "m", "r": "m", "share": "pc"}
"""Slots of the same kind have one name in the sentences of people."""


def _heard(drawing: Drawing, wordings: Wordings) -> tuple[str, ...]:
    """What people said who meant the like."""
    if not wordings.voices or len(drawing.clauses) != 1:
        return ()
    clause = drawing.clauses[0]
    kinds = {name: "{" + _KIND.get(name, name) + "}" for name in clause.slots}
    words = {name: text for name, (text, _) in clause.slots.items() if name.startswith("dir")}
    return wordings.voices.get(ordered(clause.template.format_map({**kinds, **words})), ())


def ordered(means: str) -> str:
    """A meaning in the notation with its slots in one order."""
    name, *slots = means.split()
    return " ".join([name, *sorted(slots)])


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
    """The shape of a reading and its sentence, both with slots; None where the sentence cannot be said elsewhere."""
    try:
        frames = notation.parse(reading, objects) if reading[:1] not in "?!" else ()
    except InputError:
        return None
    if len(frames) != 1 or "{" in sentence or len(frames[0].named) > 1:
        return None
    shape = reading
    for pattern, filled, written, slot in (*map(_named, frames[0].named), *map(_stated, _QUANTITY.findall(reading))):
        sentence, count = re.subn(pattern, filled, sentence)
        shape = shape.replace(written, slot, -1 if slot == "{obj}" else 1)
        if count != 1:
            return None
    return None if _elsewhere(sentence, shape, objects) else (ordered(shape), sentence)


def _named(name: str) -> tuple[str, str, str, str]:
    """How an object is said, the slot for it, how it stands in a reading, and the slot there."""
    return rf"(?i)\b(?:the )?{re.escape(name)}\b", "{obj}", name.replace(" ", "_"), "{obj}"


def _stated(quantity: tuple[str, str]) -> tuple[str, str, str, str]:
    """The same of a number and its unit."""
    (number, unit), (said, slot) = quantity, _UNITS[quantity[1]]
    pattern = rf"(?<![\d.]){re.escape(number)} ?{said}"
    if unit == "wp":
        return pattern, "{k} ", f"{number}{unit}", "{k}wp"
    return rf"{pattern}(?![\w/])", f"{{{slot}}}", f"{number}{unit}", f"{{{slot}}}"


def _elsewhere(sentence: str, shape: str, objects: Sequence[str]) -> bool:
    """Whether a sentence still speaks of its own scene, or has a number or a slot that its reading has not once."""
    slots = re.findall(r"\{\w+\}", sentence)
    if sorted(slots) != sorted(re.findall(r"\{\w+\}", shape)) or len(set(slots)) != len(slots):
        return True
    words = set(" ".join(objects).casefold().split())
    plain = re.sub(r"\{\w+\}", " ", sentence).casefold()
    numbered = any(c.isdigit() for c in plain)
    return numbered or bool(_OWNED.search(sentence) or words & set(re.findall(r"\w+", plain)))
