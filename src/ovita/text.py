"""Text for people: numbers, lists, plurals and quotes, written the same way everywhere."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable


def number(value: float) -> str:
    """A number with about three significant digits and at least two decimals below 10: 0.2 to "0.20"."""
    size = abs(value)
    if size >= 1e5 or 0 < size < 1e-3:
        return f"{value:.3g}"
    if size >= 100:
        return f"{value:.0f}"
    if size >= 10:
        return f"{value:.1f}"
    text = f"{value:.2f}" if size >= 1 else f"{value:.3f}"
    return text[:-1] if size < 1 and text.endswith("0") else text


def length(metres: float) -> str:
    """A length in the unit that suits it: "4 mm", "3.5 cm", "1.20 m"."""
    size = abs(metres)
    return f"{metres * 1e3:.2g} mm" if size < 0.01 else f"{metres * 1e2:.1f} cm" if size < 1 else f"{metres:.2f} m"


def listed(parts: Iterable[str], word: str = "and") -> str:
    """Parts as a list in a sentence: "a", "a and b", "a, b and c"; "" for none."""
    *most, last = [*parts] or [""]
    return f"{', '.join(most)} {word} {last}" if most else last


def the(name: str) -> str:
    """A thing's name with its article: "the cup"; one that has an article keeps it."""
    return name if name.lower().startswith(("the ", "a ", "an ")) else f"the {name}"


def counted(count: float, noun: str, plural: str = "") -> str:
    """A count with its noun: "1 waypoint", "3 waypoints"."""
    return f"{count:g} {noun if count == 1 else plural or noun + 's'}"


def quoted(words: Iterable[str]) -> str:
    """Words in quotes, separated by commas: 'one', 'two'."""
    return ", ".join(repr(word) for word in words)


def shortened(value: object, limit: int = 60) -> str:
    """What Python prints for a value, cut to a length."""
    text = repr(value)
    return text if len(text) <= limit else f"{text[: limit - 3]}..."


def sentence(text: str) -> str:
    """Text with a capital first letter and a full stop."""
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def point(coordinates: Iterable[float]) -> str:
    """Coordinates as [x, y, z]."""
    return "[" + ", ".join(f"{value:g}" for value in coordinates) + "]"


def waypoints(first: int, last: int) -> str:
    """A range of waypoint indices (from 0, both included) as a person counts them, from 1."""
    return f"waypoint {first + 1}" if first == last else f"waypoints {first + 1} to {last + 1}"


def clean_text(text: object, limit: int) -> str:
    """Text for a terminal and for a prompt: no control, format or private characters, and not longer than limit."""
    if not isinstance(text, str):
        return ""
    short = text[:limit]
    kept = "".join(c for c in short if c in "\n\t" or unicodedata.category(c) not in _HIDDEN_CATEGORIES)
    return kept if len(text) <= limit else kept + " …"


_HIDDEN_CATEGORIES = frozenset({"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"})
