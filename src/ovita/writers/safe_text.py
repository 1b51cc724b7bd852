r"""Text that others wrote, made safe to stand in a prompt: quoted, on one line, cut, and unable to end its quotes.

Scene files come from anywhere. A name may hold line breaks that pose as a new section, fences, the special words by
which chat templates tell who speaks, or characters that draw nothing. As `\uXXXX` they are visible and harmless, and a
name that a model copies into Python is still the object's name.
"""

from __future__ import annotations

import re
import unicodedata

CUT = "…"
"""What shows that a text was cut."""

_SPECIAL = frozenset("<>[]`")
_HIDDEN = ("C", "Zl", "Zp")
_TURN = re.compile(r"<(?=[|/!a-zA-Z\uff5c])|```|~~~")


def quoted(text: str, limit: int) -> str:
    """Text as one string as Python writes it.

    Args:
        text: Whatever a file says.
        limit: Longest text that is shown [characters]; the mark that it was cut comes on top.
    """
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
    return unicodedata.category(character).startswith(_HIDDEN)
