"""Looks: what colour a thing has, what its shape is called, and which thing a person's name means."""

from __future__ import annotations

import tomllib
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import chain, count
from typing import Any

import numpy as np

from ovita.errors import SceneError
from ovita.paths.scene import canonical
from ovita.paths.trajectory import Array

COLOURED = 0.28
"""Saturation from which a pixel has a hue."""

DARK, BRIGHT = 0.16, 0.62
"""Value below which a thing without a hue is black, and from which it is white."""


@dataclass(frozen=True)
class Look:
    """How a thing looks: a colour's word, or "" without colours; and its shape: box, cylinder, sphere or irregular."""

    colour: str
    shape: str

    @property
    def words(self) -> str:
        """Such as "red box"."""
        return f"{self.colour} {_words()['shapes'].get(self.shape, self.shape)}".strip()


@cache
def _words() -> Mapping[str, Mapping[str, Any]]:
    return tomllib.loads((files("ovita") / "perceive" / "words.toml").read_text(encoding="utf-8"))


def colour_of(pixels: Array) -> str:
    """The word for the colour of pixels (N, 3), red, green and blue in 0..255; "" without pixels.

    The most frequent hue among those that have one, each counted by its saturation, so that shade and gloss, which
    change the brightness, do not change the word.
    """
    if not len(pixels):
        return ""
    rgb = np.asarray(pixels, dtype=float) / 255.0
    value, low = rgb.max(axis=1), rgb.min(axis=1)
    chroma = value - low
    saturation = chroma / np.maximum(value, 1e-6)
    hued = (saturation > COLOURED) & (chroma > 0.06)
    if hued.mean() < 0.4:
        brightness = float(np.median(value))
        return "black" if brightness < DARK else "white" if brightness > BRIGHT else "grey"
    hue = _hue(rgb[hued], value[hued], chroma[hued])
    hues, weights = _words()["hues"], saturation[hued]
    return max(
        hues, key=lambda word: weights[(hue - hues[word][0]) % 360 < (hues[word][1] - hues[word][0]) % 360].sum()
    )


def _hue(rgb: Array, value: Array, chroma: Array) -> Array:
    """Hue (N,) in degrees of pixels that have one."""
    red, green, blue = rgb.T
    sector = np.select(
        [value == red, value == green],
        [(green - blue) / chroma, 2.0 + (blue - red) / chroma],
        4.0 + (red - green) / chroma,
    )
    return np.asarray(60.0 * sector % 360.0)


@dataclass(frozen=True)
class Wanted:
    """A name that a person gave, and the colours and shapes that it asks for; empty for any."""

    name: str
    colours: tuple[str, ...]
    shapes: tuple[str, ...]

    @classmethod
    def parse(cls, text: str) -> Wanted:
        """From "red cup", or "cup=red box" where the name and the look differ.

        Raises:
            SceneError: If there is no name.
        """
        name, _, look = (part.strip() for part in text.partition("="))
        if not name:
            raise SceneError(f"{text!r} names nothing; write 'red cup', or 'cup=red'", key="names")
        words = (look or name).lower().split()
        known = _words()
        hues = {*known["hues"], "black", "white", "grey"}
        synonyms = {word: known["colours"].get(word, word) for word in words}
        last = words[-1]
        fruit = last in known["nouns"] and not (look and synonyms[last] in hues)  # an "orange"; "carton=orange" is none
        colours = [synonyms[w] for w in words if synonyms[w] in hues and not (w == last and fruit)]
        return cls(name, tuple(colours), tuple(known["nouns"][last]) if fruit else ())

    def fits(self, look: Look) -> bool:
        """Whether a thing that looks so may bear the name."""
        right = not self.colours or not look.colour or look.colour in self.colours
        return right and (not self.shapes or look.shape in (*self.shapes, "irregular"))


def support_word(text: str) -> str:
    """Whether a name, or the look that it asks for, is that of a support: "table", "floor", or "" for neither."""
    words = text.rpartition("=")[2].lower().split() or [""]
    return str(_words()["supports"].get(words[-1], ""))


def names_of_support(names: Sequence[str], kind: str) -> tuple[str, tuple[str, ...]]:
    """What a person calls the support, and the names that are left for things.

    Args:
        names: As given.
        kind: "table", "floor", or "" where there is no support; a floor may be called one whatever it looks like, but
            a table beside the camera's own support is a thing.

    Returns:
        The name, or `kind` where nobody gave one.
    """
    for text in names:
        if kind and support_word(text) in (kind, "floor"):
            return text.partition("=")[0].strip() or kind, tuple(other for other in names if other != text)
    return kind, tuple(names)


def assign(names: Sequence[str], looks: Sequence[Look]) -> tuple[dict[int, str], tuple[str, ...]]:
    """Which thing each name means, and why a name means none.

    A name goes to a thing only if no other fits it; names that fit one thing only come first, so that "the cup" may
    be what "the red cup" leaves. A name that fits several things, or none, is not guessed.

    Returns:
        The name by the number of the thing, and a sentence for each name that is left.
    """
    left = [Wanted.parse(text) for text in names]
    given: dict[int, str] = {}
    while True:
        free = [i for i in range(len(looks)) if i not in given]
        fits = [(one, _fitting(one, free, looks)) for one in left]
        chosen = _certain(fits)
        if not chosen:
            return given, tuple(_unplaced(one, where, looks) for one, where in fits)
        given |= {i: one.name for one, i in chosen}
        left = [one for one in left if all(one is not other for other, _ in chosen)]


def _fitting(one: Wanted, free: Sequence[int], looks: Sequence[Look]) -> list[int]:
    """Which of the things that bear no name yet a name fits; nothing that is no ball is called one beside a ball."""
    where = [i for i in free if one.fits(looks[i])]
    balls = [i for i in where if looks[i].shape == "sphere"]
    return balls if balls and one.shapes == ("sphere",) else where


def _certain(fits: Sequence[tuple[Wanted, list[int]]]) -> list[tuple[Wanted, int]]:
    """The names that fit one thing only, where no other such name fits the same."""
    single = [(one, where[0]) for one, where in fits if len(where) == 1]
    rivals = Counter(i for _, i in single)
    return [(one, i) for one, i in single if rivals[i] == 1]


def _unplaced(one: Wanted, where: Sequence[int], looks: Sequence[Look]) -> str:
    if not where:
        there = ", ".join(sorted({look.words for look in looks})) or "nothing"
        return f"{one.name}: nothing seen fits this name; there is {there}"
    if len(where) == 1:
        return f"{one.name}: another name fits {looks[where[0]].words} as well; say which of them it is"
    several = ", ".join(looks[i].words for i in where)
    return f"{one.name}: it may be any of {several}; say more, as in '{one.name}=COLOUR SHAPE'"


def distinct(names: Sequence[str], taken: Iterable[str] = ()) -> tuple[str, ...]:
    """The names, numbered from the second of a kind on, so that no two are alike, and none is one that is taken."""
    used = set(map(canonical, taken))
    out = []
    for name in names:
        numbered = chain([name], (f"{name} {number}" for number in count(2)))
        out.append(next(one for one in numbered if canonical(one) not in used))
        used.add(canonical(out[-1]))
    return tuple(out)
