"""A policy: the small program that adapts a trajectory, and the parameters it offers."""

from __future__ import annotations

import ast
import io
import math
import re
import tokenize
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal

from ovita.errors import PolicyRejected
from ovita.policy.direct import carries_columns, proven
from ovita.policy.syntax import EntryPoint, Form, Value, bound_names, entry_of, find_function, literal, parse_tree
from ovita.text import clean_text
from ovita.units import find

MAX_NOTE = 300
"""Most characters of a comment or a docstring line that are read; patterns on longer ones would take their time."""

Role = Literal["by", "to", "at", "at_least", "at_most", "of", "factor", "radius", "count", "share", "other"]
"""What a parameter's value is to its operation: an amount to change by, a value to reach, a place, a bound, ..."""


@dataclass(frozen=True)
class Parameter:
    """A number or word of a policy that a person may change.

    The comment behind it in the policy is its print-out; of a policy that a model wrote, name, value, unit and meaning
    are all that is known.

    Args:
        name: As in the source.
        value: Its present value.
        unit: Such as "m", or "".
        meaning: One phrase for a person, or "".
        role: What the value is to its operation, or None where that is not known.
        about: Name of the object that it concerns, or "".
        direction: The word for what more of it does, such as "left", "closer", "slower" or "longer", or "".
        slot: The slot of the instruction's frames that it stands for, such as "0.by" of the first frame, or "".
    """

    name: str
    value: Value
    unit: str = ""
    meaning: str = ""
    role: Role | None = None
    about: str = ""
    direction: str = ""
    slot: str = ""

    @property
    def counts(self) -> bool:
        """Whether it is the number of a waypoint, which programs count from 0 and people from 1."""
        return self.role == "at" and not self.unit and type(self.value) is int

    @property
    def called(self) -> str:
        """Its name for a person."""
        return self.name.replace("_index", "_waypoint" if self.counts else "_index").replace("_", " ")

    @property
    def shown(self) -> Value:
        """Its value as a person counts."""
        return int(self.value) + 1 if self.counts and isinstance(self.value, int) else self.value

    def meant(self, shown: Any) -> Any:
        """The value of what a person counts as `shown`."""
        return shown - 1 if self.counts and isinstance(shown, int) else shown

    @property
    def comment(self) -> str:
        """How it is printed in a policy: "[m] shift to the left"."""
        return f"[{self.unit}] {self.meaning}".strip() if self.unit else self.meaning

    @property
    def line(self) -> str:
        """How it is shown to a person: "left = 0.2 m: shift to the left"."""
        value = f"{self.value:g}" if isinstance(self.value, float) else str(self.value)
        unit, meaning = f" {self.unit}" if self.unit else "", f": {self.meaning}" if self.meaning else ""
        return f"{self.name} = {value}{unit}{meaning}"


def find_parameters(source: str, tree: ast.Module, entry: EntryPoint) -> tuple[Parameter, ...]:
    """Read the parameters off a policy that a model or a person wrote.

    In a function they are the arguments with a literal default, other than traj and scene; in a script, the
    top-level names that are assigned a literal exactly once. Unit and meaning come from the comment at the end of
    the line, or from a docstring line such as `distance: how far to shift [m]`.
    """
    held = _literals(tree, entry)
    lines = Counter(node.end_lineno for _, node in held.values())
    comments = _comments(source)
    notes = _notes(ast.get_docstring(find_function(tree, entry.name) if entry.form == "function" else tree) or "")
    parameters = []
    for name, (value, node) in held.items():
        comment = comments.get(node.end_lineno or node.lineno, "")
        named = _notes(comment)
        own = comment if lines[node.end_lineno] == 1 and not named.keys() & held.keys() else ""
        text = named.get(name) or own or notes.get(name, "")
        parameters.append(Parameter(name, value, *_unit(clean_text(text, MAX_NOTE))))
    return tuple(parameters)


def rewrite(
    source: str, tree: ast.Module, entry: EntryPoint, values: Mapping[str, Value], units: Mapping[str, str]
) -> tuple[str, dict[str, Value]]:
    """Write values into the source at the literals that hold them, leaving everything else as it is.

    Returns:
        The new source, and the values in the types of those that they replace.

    Raises:
        PolicyRejected: If there is no such parameter, or a value has another type than the one it replaces.
    """
    held = _literals(tree, entry)
    unknown = [name for name in values if name not in held]
    if unknown:
        known = ", ".join(held) or "none"
        raise PolicyRejected(f"the policy has no parameter {unknown[0]!r}; its parameters are: {known}")
    lines = source.split("\n")  # as the parser counts them; splitlines knows more line ends
    written = {name: _fitting(name, held[name][0], value, units.get(name, "")) for name, value in values.items()}
    for name in sorted(values, key=lambda n: (held[n][1].lineno, held[n][1].col_offset), reverse=True):
        node = held[name][1]
        assert node.end_lineno is not None and node.end_col_offset is not None
        head = lines[node.lineno - 1].encode()[: node.col_offset].decode()
        tail = lines[node.end_lineno - 1].encode()[node.end_col_offset :].decode()
        lines[node.lineno - 1 : node.end_lineno] = [f"{head}{written[name]!r}{tail}"]
    return "\n".join(lines), written


def _literals(tree: ast.Module, entry: EntryPoint) -> dict[str, tuple[Value, ast.expr]]:
    """The parameters' values by name, and the literals in the source that hold them."""
    found: dict[str, tuple[Value, ast.expr]] = {}
    for name, node in _defaults(tree, entry) if entry.form == "function" else _assignments(tree):
        with suppress(ValueError, OverflowError, RecursionError):
            value = literal(node)
            if not isinstance(value, float) or math.isfinite(value):
                found[name] = value, node
    return found


def _defaults(tree: ast.Module, entry: EntryPoint) -> Iterator[tuple[str, ast.expr]]:
    arguments = find_function(tree, entry.name).args
    positional = [*arguments.posonlyargs, *arguments.args]
    first = len(positional) - len(arguments.defaults)
    for i, default in enumerate(arguments.defaults, start=first):
        if i >= entry.arguments:
            yield positional[i].arg, default
    for argument, keyword_default in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True):
        if keyword_default is not None:
            yield argument.arg, keyword_default


def _assignments(tree: ast.Module) -> Iterator[tuple[str, ast.expr]]:
    count = Counter(name for statement in tree.body for name in bound_names(statement))
    count.update(name for node in ast.walk(tree) if isinstance(node, ast.Global) for name in node.names)
    for statement in tree.body:
        match statement:
            case (
                ast.Assign(targets=[ast.Name(id=name)], value=value)
                | ast.AnnAssign(target=ast.Name(id=name), value=ast.expr() as value)
            ):
                is_none = isinstance(value, ast.Constant) and value.value is None
                if count[name] == 1 and not is_none and not name.startswith("_"):
                    yield name, value


def _comments(source: str) -> dict[int, str]:
    """Text of the comment at the end of each line that has one."""
    found = {}
    try:
        for token in tokenize.generate_tokens(io.StringIO(source).readline):
            if token.type == tokenize.COMMENT:
                found[token.start[0]] = token.string[:MAX_NOTE].lstrip("#: ").strip()
    except (tokenize.TokenError, SyntaxError):
        return {}
    return found


_NOTE = re.compile(r"^\s*(?:[-*]\s+)?[`*]{0,2}(\w+)[`*]{0,2}\s*(?:\([^()]*\))?\s*(?::|=|–|—|--)\s*(\S.*)$")
_BRACKETS = re.compile(r"\s*\[([^\[\]]{1,16})\]")
_PARENTHESES = re.compile(r"\s*\(([^()]{1,16})\)")
_COUNTS = frozenset("1/m waypoints points steps index factor ratio fraction unitless - 0-1 0..1".split())
"""What stands where a unit would, besides those that `units` knows."""


def _notes(text: str) -> dict[str, str]:
    """Lines such as `name: text` or `name (float): text`."""
    notes: dict[str, str] = {}
    for line in text.split("\n"):
        found = _NOTE.match(line[:MAX_NOTE])
        if found:
            notes.setdefault(found[1], found[2].strip())
    return notes


def _measures(text: str) -> bool:
    """Whether a text is a unit of measure, or says that there is none."""
    unit = find(text)
    return text.strip().lower() in _COUNTS or (unit is not None and unit.dimension not in ("step", "x"))


def _unit(text: str) -> tuple[str, str]:
    """Split `how far to shift [m]` or `how far to shift (m)` into unit and meaning."""
    found = [*(f for f in _PARENTHESES.finditer(text) if _measures(f[1])), *_BRACKETS.finditer(text)][-1:]
    if not found:
        return (text.strip(), "") if _measures(text) else ("", text.strip())
    return found[0][1].strip(), (text[: found[0].start()] + text[found[0].end() :]).strip(" ,;")


def _fitting(name: str, old: Value, value: Value, unit: str) -> Value:
    """The value in the type that the parameter has; a whole number with a unit may become any number.

    Raises:
        PolicyRejected: If it has another type.
    """
    if value is None and old is None:
        return None
    if isinstance(old, tuple):
        kind = f"a group of {len(old)} values"
        if isinstance(value, tuple | list) and len(value) == len(old):
            return tuple(_fitting(name, a, b, unit or "-") for a, b in zip(old, value, strict=True))
    else:
        number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
        kind, fitting = _alike(old, value, number if number is not None and math.isfinite(number) else None, bool(unit))
        if fitting is not None:
            return fitting
    raise PolicyRejected(f"parameter {name} is {kind}, such as {old!r}; {value!r} is not")


def _alike(old: Value, value: Value, number: float | None, any_number: bool) -> tuple[str, Value]:
    """What is expected in place of an old value, and the new one in its type, or None."""
    match old:
        case bool():
            return "True or False", value if isinstance(value, bool) else None
        case int():
            if number is not None and number == int(number):
                return "a number", int(number)
            return ("a number", number) if any_number else ("a whole number", None)
        case float():
            return "a number", number
        case str():
            return "a text", value if isinstance(value, str) else None
    return "a plain value", value if number is not None or isinstance(value, bool | str | tuple) else None


@dataclass(frozen=True)
class Policy:
    """A program that turns one trajectory into another.

    Args:
        source: Python source as it will run.
        form: "function" (`adapt(traj, scene, *, distance=1.0)`) or "script" (leaves `modified_trajectory`).
        parameters: In the order of the source.
        summary: What it does, in one sentence of its author, or "".
        lines: For each line of the source, its number in the code that was read, counted from 1; () if it was not read.
    """

    source: str
    form: Form = "function"
    parameters: tuple[Parameter, ...] = ()
    summary: str = ""
    lines: tuple[int, ...] = field(default=(), compare=False, repr=False)

    def written_line(self, number: int | None) -> int | None:
        """The number in the code that was read of a line of the source, or None."""
        return self.lines[number - 1] if number is not None and 1 <= number <= len(self.lines) else None

    def with_parameters(self, **values: Value) -> Policy:
        """Return the policy with other values written into its source, so that the source stays the truth.

        Raises:
            PolicyRejected: If it has no such parameter, or a value is of another type.
        """
        if not values:
            return self
        units = {p.name: p.unit for p in self.parameters}
        source, written = rewrite(self.source, self.tree, entry_of(self.tree), values, units)
        parameters = tuple(replace(p, value=written.get(p.name, p.value)) for p in self.parameters)
        return replace(self, source=source, parameters=parameters)

    def described_by(self, parameters: Iterable[Parameter]) -> Policy:
        """Return the policy with the descriptions of equally named parameters; values stay as in the source."""
        known = {p.name: p for p in parameters}
        return replace(
            self,
            parameters=tuple(replace(known[p.name], value=p.value) if p.name in known else p for p in self.parameters),
        )

    @cached_property
    def tree(self) -> ast.Module:
        """The syntax tree of the source.

        Raises:
            PolicyRejected: If it is not Python, too long or nested too deeply.
        """
        return parse_tree(self.source)

    @cached_property
    def toolkit_only(self) -> bool:
        """Whether it is proven to contain only toolkit calls, scene look-ups and arithmetic."""
        return proven(self.tree)

    @property
    def carries_columns(self) -> bool:
        """Whether further columns of its trajectory, such as orientations, come through it unspoilt."""
        return carries_columns(self.tree)
