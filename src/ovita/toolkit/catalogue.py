"""Every operation that a policy may call: registered, bound to a scene's frame, described for prompt and page.

An operation is a function with the decorator `operation`; the sandbox, the allowlist, the prompt and docs/toolkit.md
know it from here, by its signature and its docstring. Those of plug-ins enter once `extended` was called.
"""

from __future__ import annotations

import functools
import inspect
import re
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeVar

import ovita.plugins as plugins
from ovita.errors import OvitaError
from ovita.paths.scene import DIRECTIONS, Frame, SceneObject
from ovita.paths.trajectory import Array
from ovita.toolkit.arguments import HIDDEN, Target, invoked, is_shipped, public, written

GROUPS = (
    "Choose waypoints",
    "Shift the path and its ends",
    "Objects: come closer, stay away, pass",
    "Go on, or go straight",
    "Reshape the whole",
    "Draw figures",
    "Keep to a region",
    "Speed",
    "Waypoints",
    "State what is meant",
)
"""What operations are for, in the order in which a prompt and the page show them."""

NOTES = {
    "OFFSET": f"{', '.join(f'{word}=' for word in DIRECTIONS)} in metres, such as left=0.2, up=0.1",
    "PLACE": 'object, point, index (int), share of the path (float), "start" or "goal"',
}
"""The meaning of the words in capitals."""

MEANINGS = {
    "traj": "(N, 4).",
    "obj": "Object or point (3,) [m].",
    "to": "Object or point (3,) [m], or None to move by the offset alone.",
    "at": "The place of a waypoint; an object or point (3,) [m] means the waypoint nearest to it.",
    "aim": '"centre"; "top": right above the centre; "surface": where it is nearest to the path; or "level": at the '
    "path's own height. Without dimensions top and surface are the centre.",
    "offset": "Direction words and metres, such as left=0.2.",
    "where": "Mask (N,), or None for all waypoints.",
    "where (Draw figures)": "Mask (N,), or None for all waypoints; the others stay as they are. It blends, as the "
    "swing begins at 0.",
    "where (Speed)": "Mask (N,), or None for all waypoints, ends included; at its edges the speed jumps from one "
    "waypoint to the next.",
    "where (State what is meant)": "Mask (N,) over the original waypoints, or None.",
    "ease": "Length of the soft edge outside a part as a fraction (0..1) of the path's length; 0 for a jump.",
    "ease (Reshape the whole)": "Length of the soft edge inside a part as a fraction (0..1) of the path's length; 0 "
    "for a jump.",
    "blend": "Fraction (0..1) of the path's length over which the shift fades; 0 moves one waypoint.",
    "hold": 'Direction word or words along which nothing moves, such as "up" after an exact shift upwards.',
    "degrees": "Counter-clockwise as seen from the tip of the axis; negative: clockwise.",
    "start": "[m/s], >= 0, or None for the present speed at the first selected waypoint.",
    "end": "[m/s], >= 0, or None for the present speed at the last selected waypoint.",
    "amplitude": "[m], >= 0, to either side.",
    "waves": "Number of whole waves, > 0, on each unbroken run of the mask; its ends stay if this is a multiple of one "
    "half.",
    "direction": 'A direction word, such as "up" to go up first and then down; None for sideways.',
}
"""Parameters of which an operation's docstring says nothing; "name (group)" goes before "name"."""

_Function = TypeVar("_Function", bound=Callable[..., Any])
_registry: dict[str, Callable[..., Any]] = {}
_group: dict[str, str] = {}
_core: set[str] = set()

CATALOGUE: Mapping[str, Callable[..., Any]] = MappingProxyType(_registry)
"""The operations by name, group by group."""


def operation(group: str, *, core: bool = False) -> Callable[[_Function], _Function]:
    """Enter a function in the catalogue.

    Args:
        group: One of GROUPS.
        core: Show it in every prompt, not only where the instruction seems to need it.

    Raises:
        ValueError: If there is no such group, or another operation has the name.
    """
    if group not in GROUPS:
        raise ValueError(f"unknown group {group!r}; groups are {', '.join(GROUPS)}")

    def enter(function: _Function) -> _Function:
        name = function.__name__
        if name in _registry:
            raise ValueError(f"the toolkit already has an operation {name!r}")
        _registry[name], _group[name] = function, group
        if core:
            _core.add(name)
        in_order = sorted(_registry.items(), key=lambda item: GROUPS.index(_group[item[0]]))
        _registry.clear()
        _registry.update(in_order)
        return function

    return enter


@functools.cache
def extended() -> frozenset[str]:
    """Enter the operations of plug-ins, once a process, and return their names; a warning names one that fails.

    Promises, whose names begin with "expect_", are left out too, since only ovita's own can be judged.
    """
    shipped = set(_registry)
    for name in plugins.entries("operations"):
        before = set(_registry)
        try:
            plugins.load("operations", name)
        except OvitaError as problem:
            _withdraw(set(_registry) - before)
            warnings.warn(str(problem), plugins.PluginWarning, stacklevel=2)
    _withdraw({name for name in set(_registry) - shipped if name.startswith("expect_")})
    return frozenset(name for name in _registry if not is_shipped(_registry[name]))


def _withdraw(names: set[str]) -> None:
    for name in names:
        del _registry[name], _group[name]
    _core.difference_update(names)


@dataclass(frozen=True)
class Expectation:
    """A postcondition that a policy states.

    Args:
        kind: Name of the call without "expect_", such as "closer".
        arguments: JSON values; an object by its name, a point as [x, y, z] [m], a mask as
            {"count": N, "ranges": [[first, last], ...]} over waypoint indices from 0, both ends included.
        text: As a sentence for people.
    """

    kind: str
    arguments: Mapping[str, Any]
    text: str


@dataclass
class Recorder:
    """Collects a running policy's postconditions.

    Args:
        contacts: Names of the objects that it means to touch or to pass through, each once.
        expectations: Its postconditions, in order.
        corners: Whether it draws a figure that has corners, so that these are no mishap.
    """

    contacts: list[str] = field(default_factory=list)
    expectations: list[Expectation] = field(default_factory=list)
    corners: bool = False


def note_contact(recorder: Recorder | None, target: Target | None, shift: Array) -> None:
    """Record that the policy means to touch a target, if that is an object and no offset keeps away from it."""
    if recorder is None or not isinstance(target, SceneObject) or shift.any():
        return
    if target.name not in recorder.contacts:
        recorder.contacts.append(target.name)


def namespace(frame: Frame, recorder: Recorder) -> dict[str, Callable[..., Any]]:
    """The catalogue for one run of a policy: each operation knows the frame and the recorder.

    A call that does not fit an operation's signature raises a ValueError that shows the signature.
    """
    return {name: _bound(operation, frame, recorder) for name, operation in CATALOGUE.items()}


def core_names() -> tuple[str, ...]:
    """The operations that every prompt shows, in catalogue order."""
    return tuple(name for name in CATALOGUE if name in _core)


def describe(names: Iterable[str] | None = None, *, known_notes: Iterable[str] = (), defaults: bool = False) -> str:
    """The catalogue as text for a prompt: for each operation its signature and first sentence, in catalogue order.

    Optional parameters are marked with "?". The postconditions, whose names say it all, share a line.

    Args:
        names: Only these operations; None for all.
        known_notes: The words in capitals, OFFSET and PLACE, that were explained before; others are explained first.
        defaults: Show what optional parameters are if they are left out, and rare ones too.

    Raises:
        ValueError: If a name is not in the catalogue.
    """
    wanted = in_order(names)
    calls = {name: written(CATALOGUE[name], brief=not defaults, short=True) for name in wanted}
    lines = [f"{call}: {summary(name)}" for name, call in calls.items() if not name.startswith("expect_")]
    expectations = [call for name, call in calls.items() if name.startswith("expect_")]
    lines += [", ".join(expectations)] if expectations else []
    for word, meaning in reversed(NOTES.items()):
        if word not in known_notes and any(word in line for line in lines):
            lines.insert(0, f"{word}: {meaning}")
    return "\n".join(lines)


def in_order(names: Iterable[str] | None = None) -> list[str]:
    """The names in catalogue order; None for all.

    Raises:
        ValueError: If one is not in the catalogue.
    """
    wanted = list(CATALOGUE) if names is None else list(names)
    unknown = [name for name in wanted if name not in CATALOGUE]
    if unknown:
        raise ValueError(f"the toolkit has no {', '.join(unknown)}; it has {', '.join(CATALOGUE)}")
    return [name for name in CATALOGUE if name in wanted]


def summary(name: str) -> str:
    """The first sentence of an operation's description, without its full stop."""
    return (CATALOGUE[name].__doc__ or "").strip().splitlines()[0].rstrip(".")


def signature(name: str, *, brief: bool = False) -> str:
    """A call as a policy writes it, see `arguments.written`."""
    return written(CATALOGUE[name], brief=brief)


def public_signature(name: str) -> inspect.Signature:
    """An operation's signature with the direction words spelled out, and without what the runtime fills in."""
    return public(CATALOGUE[name])


def _bound(function: Callable[..., Any], frame: Frame, recorder: Recorder) -> Callable[..., Any]:
    def call(*args: Any, **kwargs: Any) -> Any:
        return invoked(function, args, kwargs, frame, recorder)

    call.__name__, call.__doc__ = function.__name__, function.__doc__
    vars(call)["__signature__"] = public(function)
    return call


_INTRODUCTION = """# Toolkit: what a policy may call

This page is made of the operations' docstrings: `ovita policy catalogue --markdown > docs/toolkit.md`.
There are {count} operations. `ovita policy catalogue NAME` shows one of them in the terminal.

A trajectory `traj` is an array with one waypoint a row: x, y, z in metres, the speed in m/s, and perhaps further
columns, which travel along. Every operation that changes it returns a new array. Lengths are in metres, times in
seconds, angles in degrees. A mask is an array of booleans, one for each waypoint, made by the first operations or
by a comparison; `~mask` is all others.

A policy counts waypoints from 0, as numpy does: index 0 is the start, -1 the goal, and a range such as `traj[2:5]`
leaves its end out. What people read counts from 1, both ends included."""

_ENTRY = re.compile(r"(\w+): (.*)", re.DOTALL)


@dataclass(frozen=True)
class OperationDoc:
    """An operation as the page shows it.

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


def reference(names: Iterable[str] | None = None) -> tuple[OperationDoc, ...]:
    """The operations of those names, in catalogue order; None for all.

    Raises:
        ValueError: If a name is not in the catalogue.
    """
    return tuple(_entry(name) for name in in_order(names))


def as_text(entry: OperationDoc) -> str:
    """An entry for a terminal."""
    parts = [f"{entry.signature}\n  {entry.summary}."]
    parts += [f"  {line}" for line in entry.details.splitlines()]
    parts += [f"    {name}: {meaning}" for name, meaning in entry.parameters.items()]
    return "\n".join(parts)


def as_markdown(entry: OperationDoc, use: tuple[str, str] | None = None) -> str:
    """An entry as a section of the page.

    Args:
        entry: The operation.
        use: An instruction, and the line of a policy that calls the operation for it.
    """
    parts = [f"### `{entry.name}`", f"```python\n{entry.signature}\n```", f"{_shown(entry.summary)}."]
    parts += [_shown(entry.details)] if entry.details else []
    parts += ["\n".join(f"- `{name}`: {_shown(meaning)}" for name, meaning in entry.parameters.items())]
    parts += [f"For “{use[0]}”: `{use[1]}`"] if use else []
    return "\n\n".join(part for part in parts if part)


def page(uses: Mapping[str, tuple[str, str]]) -> str:
    """The whole catalogue as a Markdown page.

    Args:
        uses: For an operation's name an instruction, and the line of a policy that calls it.
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


def _entry(name: str) -> OperationDoc:
    text = inspect.cleandoc(CATALOGUE[name].__doc__ or "")
    body, _, arguments = text.partition("\nArgs:\n")
    details = body.partition("\n")[2].strip()
    chunks = re.split(r"\n(?=    \w)", "\n" + arguments.rstrip())
    own = {match[1]: match[2] for chunk in chunks if (match := _ENTRY.match(" ".join(chunk.split())))}
    all_of_them = inspect.signature(CATALOGUE[name]).parameters.values()
    parameters = {}
    for key in [p.name for p in sorted(all_of_them, key=lambda p: p.kind is p.KEYWORD_ONLY) if p.name not in HIDDEN]:
        meaning = own.get(key) or MEANINGS.get(f"{key} ({_group[name]})") or MEANINGS.get(key, "")
        parameters["OFFSET" if key == "offset" else key] = meaning
    return OperationDoc(name, _group[name], signature(name), summary(name), details, parameters)


def _shown(text: str) -> str:
    """Text that Markdown does not read as markup."""
    return re.sub(r"([*_<>])", r"\\\1", text)
