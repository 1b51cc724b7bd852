"""Single values of a document: showing them in a message, and checking that they are numbers and vectors."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

LARGEST = 1e9
"""Largest magnitude that a number of a trajectory or scene may have [m, m/s, s]."""


def show(value: object) -> str:
    """A value in a few words, for a message; never long, whatever the value is."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (list, tuple)):
        return "an empty list" if not value else f"a list of {len(value)}"
    if isinstance(value, Mapping):
        return "an object"
    if isinstance(value, int) and abs(value) >= 10**20:
        return "a huge integer"
    text = repr(value)
    return text if len(text) <= 40 else text[:30] + "..." + text[-7:]


def brief(name: str) -> str:
    """A name of any length and content as one short printable line."""
    cut = name if len(name) <= 30 else name[:27] + "..."
    return cut if cut.isprintable() else repr(cut)[1:-1]


def listing(names: Iterable[str], limit: int = 8) -> str:
    """Names joined by commas, cut after `limit`; "none" if there are none."""
    shown = [brief(name) for name in names]
    more = f" and {len(shown) - limit} more" if len(shown) > limit else ""
    return (", ".join(shown[:limit]) + more) or "none"


def nearest(name: str, known: Sequence[str]) -> str | None:
    """The known name that is spelled most like `name`, or None if none is close."""
    found = difflib.get_close_matches(name.lower()[:60], [k.lower() for k in known], 1, 0.6)
    return next((k for k in known if k.lower() == found[0]), None) if found else None


def number(value: object, what: str) -> float:
    """Check that a value is one finite number of at most `LARGEST`.

    Args:
        value: As parsed from a file.
        what: How to call it in a message, such as "x".

    Raises:
        ValueError: With a sentence for a person, if it is not.
    """
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{what} is {show(value)}, not a number")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{what} is {value}, not a finite number")
    if abs(value) > LARGEST:
        raise ValueError(f"{what} is {show(value)}, beyond the largest magnitude {LARGEST:g}")
    return float(value)


def vector(value: object, what: str, *layouts: Sequence[str]) -> list[float]:
    """Check that a value is a list of numbers, or an object that holds them under the names of one layout.

    Args:
        value: As parsed from a file.
        what: How to call it in a message, such as "dimensions".
        layouts: Names of the components, such as ("x", "y", "z"), all layouts of the same length.

    Raises:
        ValueError: With a sentence for a person, if it is neither.
    """
    names = layouts[0]
    if isinstance(value, Mapping):
        for layout in layouts:
            if set(value) == set(layout):
                return [number(value[name], f"{what}.{name}") for name in layout]
        wanted = " or ".join("{" + ", ".join(layout) + "}" for layout in layouts)
        raise ValueError(f"{what} has the keys {listing(map(str, value))}, expected {wanted}")
    if not isinstance(value, (list, tuple)):
        raise ValueError(f"{what} is {show(value)}, expected {len(names)} numbers {', '.join(names)}")
    if len(value) != len(names):
        raise ValueError(f"{what} holds {len(value)} values, expected {len(names)}: {', '.join(names)}")
    return [number(item, f"{what} {name}") for item, name in zip(value, names, strict=True)]


def text(value: object, what: str) -> str:
    """Check that a value is text; null counts as none.

    Raises:
        ValueError: With a sentence for a person, if it is something else.
    """
    if value is None:
        return ""
    if not isinstance(value, str):
        raise ValueError(f"{what} is {show(value)}, expected text")
    return value


def plain(value: Any) -> Any:
    """A copy of a value in lists, dicts and scalars that JSON knows: tuples and arrays become lists.

    Raises:
        TypeError: If something in it has no place in JSON.
    """
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, (int, float)):
        return float(value) if isinstance(value, float) else int(value)
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise TypeError(f"the key {show(key)} is not text")
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    raise TypeError(f"a {type(value).__name__} cannot be written to JSON")
