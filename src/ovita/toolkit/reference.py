"""The catalogue for people: every function with its parameters, from its docstring, as data and as a page."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from ovita.paths.scene import DIRECTIONS
from ovita.toolkit.catalogue import CATALOGUE, GROUPS, HIDDEN, NOTES, in_order, signature, summary

_INTRODUCTION = """# Toolkit: what a policy may call

This page is made of the functions' docstrings: `ovita policy catalogue --markdown > docs/toolkit.md`.
There are {count} functions. `ovita policy catalogue NAME` shows one of them in the terminal.

A trajectory `traj` is an array with one waypoint a row: x, y, z in metres, the speed in m/s, and perhaps further
columns, which travel along. Every function that changes it returns a new array. Lengths are in metres, times in
seconds, angles in degrees. A mask is an array of booleans, one for each waypoint, made by the first functions or
by a comparison; `~mask` is all others."""

_ENTRY = re.compile(r"(\w+): (.*)", re.DOTALL)


@dataclass(frozen=True)
class Entry:
    """A function as the page shows it.

    Args:
        name: As a policy calls it.
        group: What it is for.
        signature: The call with its defaults; OFFSET stands for the direction words.
        summary: One sentence, without its full stop.
        details: Further paragraphs, or "".
        parameters: Each parameter with its meaning.
    """

    name: str
    group: str
    signature: str
    summary: str
    details: str
    parameters: Mapping[str, str]

    def to_dict(self) -> dict[str, Any]:
        """As JSON values."""
        return {**vars(self), "parameters": dict(self.parameters)}


def reference(names: Iterable[str] | None = None) -> tuple[Entry, ...]:
    """The functions of those names, in catalogue order; None for all.

    Raises:
        ValueError: If a name is not in the catalogue.
    """
    groups = {function.__name__: group for group, functions in GROUPS.items() for function in functions}
    return tuple(_entry(name, groups[name]) for name in in_order(names))


def as_text(entry: Entry) -> str:
    """An entry for a terminal."""
    parts = [f"{entry.signature}\n  {entry.summary}."]
    parts += [f"  {line}" for line in entry.details.splitlines()]
    parts += [f"    {name}: {meaning}" for name, meaning in entry.parameters.items()]
    return "\n".join(parts)


def as_markdown(entry: Entry, use: tuple[str, str] | None = None) -> str:
    """An entry as a section of the page.

    Args:
        entry: The function.
        use: An instruction, and the line of a policy that calls the function for it.
    """
    parts = [f"### `{entry.name}`", f"```python\n{entry.signature}\n```", f"{_shown(entry.summary)}."]
    parts += [_shown(entry.details)] if entry.details else []
    parts += ["\n".join(f"- `{name}`: {_shown(meaning)}" for name, meaning in entry.parameters.items())]
    parts += [f"For “{use[0]}”: `{use[1]}`"] if use else []
    return "\n\n".join(part for part in parts if part)


def page(uses: Mapping[str, tuple[str, str]]) -> str:
    """The whole catalogue as a Markdown page.

    Args:
        uses: For a function's name an instruction, and the line of a policy that calls it.
    """
    words = "\n".join(f"- **{word}**: {meaning}." for word, meaning in NOTES.items())
    parts = [_INTRODUCTION.format(count=len(CATALOGUE)), words]
    group = ""
    for entry in reference():
        if entry.group != group:
            group = entry.group
            parts.append(f"## {group}")
        parts.append(as_markdown(entry, uses.get(entry.name)))
    return "\n\n".join(parts) + "\n"


def _entry(name: str, group: str) -> Entry:
    text = inspect.cleandoc(CATALOGUE[name].__doc__ or "")
    body, _, arguments = text.partition("\nArgs:\n")
    details = body.partition("\n")[2].strip()
    return Entry(name, group, signature(name), summary(name), details, _parameters(arguments))


def _parameters(text: str) -> dict[str, str]:
    """The meanings by parameter; the six direction words, which mean the same everywhere, are one."""
    found: dict[str, str] = {}
    for chunk in re.split(r"\n(?=    \w)", "\n" + text.rstrip()):
        match = _ENTRY.match(" ".join(chunk.split()))
        if match is None or match[1] in HIDDEN:
            continue
        if match[1] not in DIRECTIONS:
            found[match[1]] = match[2]
        elif "OFFSET" not in found:
            meaning = match[2].partition(";")[0].rstrip(".")
            found["OFFSET"] = f"{meaning}; {', '.join(DIRECTIONS[1:])} likewise."
    return found


def _shown(text: str) -> str:
    """Text that Markdown does not read as markup."""
    return re.sub(r"([*_<>])", r"\\\1", text)
