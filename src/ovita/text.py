"""Text for people: numbers, lists, plurals and quotes, written the same way everywhere; text of others made harmless.

Where a call does not fit a function of the public interface, `called_as` says so in one sentence.
"""

from __future__ import annotations

import functools
import re
import sys
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from numbers import Real
from types import UnionType
from typing import Any, Literal, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

from ovita.errors import RequestError

P = ParamSpec("P")
R = TypeVar("R")


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
    kept = "".join(c for c in short if c in "\n\t" or not _hidden(c))
    return kept if len(text) <= limit else kept + " …"


CUT = "…"
"""What shows that a text was cut."""

_SPECIAL = frozenset("<>[]`")
_TURN = re.compile(r"<(?=[|/!a-zA-Z\uff5c])|```|~~~")


def as_data(text: str, limit: int) -> str:
    """Whatever a file says as one string as Python writes it, cut after `limit` characters with a mark."""
    text = " ".join(text.split())
    if len(text) > limit:
        head = text[:limit]
        text = (head.rpartition(" ")[0] or head) + CUT
    return '"' + "".join(_escaped(character) for character in text) + '"'


def one_line(text: str) -> str:
    """Text of the person at the keyboard: on one line, and harmless."""
    return harmless(" ".join(text.split()))


def harmless(text: str) -> str:
    """Text without hidden characters, fences and the words of chat templates; line breaks stay."""
    return _TURN.sub(lambda found: " ".join(found[0]) + " ", "".join(c for c in text if c == "\n" or not _hidden(c)))


def _escaped(character: str) -> str:
    if character in _SPECIAL or _hidden(character):
        code = ord(character)
        return f"\\u{code:04x}" if code < 0x10000 else f"\\U{code:08x}"
    return "\\" + character if character in '"\\' else character


def _hidden(character: str) -> bool:
    return unicodedata.category(character).startswith(("C", "Zl", "Zp"))


def called_as(example: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Decorate a function of the public interface, so that arguments that do not fit it are one sentence."""

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        import inspect  # not needed by a command that only prints its help

        signature = inspect.signature(function)

        @functools.wraps(function)
        def call(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                given = signature.bind(*args, **kwargs).arguments
            except TypeError as error:
                raise RequestError(f"{function.__name__}: {error}; call it like this: {example}") from None
            try:
                return function(*args, **kwargs)
            except (TypeError, AttributeError, ValueError, LookupError):
                names = sys.modules[function.__module__].__dict__
                for name, value in given.items():
                    hint = signature.parameters[name].annotation
                    if not _fits(value, hint, names):
                        wrong = f"{name} is to be {hint}, not {_short(value)}"
                        raise RequestError(f"{function.__name__}: {wrong}; call it like this: {example}") from None
                raise  # what fits is a fault of ours

        return call

    return decorate


def _fits(value: object, annotation: object, names: dict[str, Any]) -> bool:
    """Whether a value may be of a type; True where that cannot be told."""
    try:
        named = type("Named", (), {"__annotations__": {"hint": annotation}})
        hint = get_type_hints(named, names)["hint"]
    except NameError:  # of a type checker alone
        return True
    parts = get_args(hint)
    kind = get_origin(hint) or hint
    if kind in (Union, UnionType):
        return any(_fits(value, part, names) for part in parts)
    if kind is Literal:
        return isinstance(value, str | int) and value in parts
    if kind is Callable or hint is float:
        return callable(value) if kind is Callable else isinstance(value, Real)
    if not isinstance(kind, type):
        return True
    if getattr(kind, "_is_protocol", False):
        return all(hasattr(value, name) for name in vars(kind) if not name.startswith("_"))
    if kind in (tuple, Sequence) and isinstance(value, list | tuple):
        return all(_fits(item, parts[0], names) for item in value) if parts else True
    return isinstance(value, kind) and not (kind is Sequence and isinstance(value, str | bytes))


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 40 and "\n" not in text else f"a {type(value).__name__}"
