"""What a policy is made of: its syntax tree, the literals that are its parameters, and what it returns and states."""

from __future__ import annotations

import ast
import math
import threading
import warnings
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal, TypeVar

import numpy as np

from ovita.errors import PolicyOutputInvalid, PolicyRejected
from ovita.paths.trajectory import Array
from ovita.policy.wire import MAX_EXPECTATIONS, MAX_ROWS
from ovita.toolkit import Recorder

Form = Literal["function", "script"]

T = TypeVar("T")

MAX_SOURCE = 64 * 1024
"""Longest source of a policy [bytes]; the parser's worst case grows with it."""

MAX_DEPTH = 160
"""Deepest syntax tree of a policy; Python's own recursion limit allows visitors a little more."""

RESULT = "modified_trajectory"
"""The variable in which a script leaves its trajectory."""

NO_POLICY = (
    "there is no policy here: define adapt(traj, scene, *, ...) that returns the new trajectory, "
    f"or leave the new trajectory in {RESULT}"
)

_TOO_DEEP = "an expression is nested too deeply; split it into several statements"
_ROLES = (("traj", "path", "waypoint", "points"), ("scene", "object", "env", "world", "obstacle"))
_quiet = threading.Lock()  # catch_warnings swaps a global, and CPython 3.11 fails where two threads parse (gh-106905)


Value = float | int | bool | str | None | tuple[Any, ...]


@dataclass(frozen=True)
class EntryPoint:
    """Where a policy starts: at a function, which takes 0, 1 or 2 of (traj, scene), or at the top of a script."""

    form: Form
    name: str = ""
    arguments: int = 0


def parse_tree(source: str) -> ast.Module:
    """Parse Python source.

    Raises:
        PolicyRejected: If it is not Python, longer than 64 KiB, or nested too deeply to be read.
    """
    if len(source.encode("utf-8", "surrogatepass")) > MAX_SOURCE:
        raise PolicyRejected(f"the policy is longer than {MAX_SOURCE // 1024} KiB; write a shorter one")
    with _quiet, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            tree = ast.parse(source)
        except SyntaxError as error:
            raise PolicyRejected(f"this is not valid Python: {error.msg}", line=error.lineno) from None
        except ValueError as error:
            raise PolicyRejected(f"this is not valid Python: {error}") from None
        except (MemoryError, RecursionError):
            raise PolicyRejected(_TOO_DEEP) from None
    _refuse_depth(tree)
    return tree


def _refuse_depth(tree: ast.Module) -> None:
    """Refuse what recursive visitors could not walk."""
    level: list[ast.AST] = [tree]
    for _ in range(MAX_DEPTH):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return
    raise PolicyRejected(_TOO_DEEP, line=getattr(level[0], "lineno", None))


def entry_of(tree: ast.Module) -> EntryPoint:
    """Find where a policy starts.

    The function `adapt` if there is one; else a script that leaves `modified_trajectory`; else the one function
    that no other function calls.

    Raises:
        PolicyRejected: If there is nothing of the kind, or the function cannot be called with (traj, scene).
    """
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    if "adapt" in functions:
        return _function_entry(functions["adapt"])
    if RESULT in top_level_names(tree) or any(RESULT in n.names for n in ast.walk(tree) if isinstance(n, ast.Global)):
        return EntryPoint("script")
    takers = _uncalled(functions)
    if not takers:
        raise PolicyRejected(NO_POLICY)
    if len(takers) > 1:
        names = ", ".join(f.name for f in takers)
        raise PolicyRejected(f"it is not clear which function is the policy ({names}); name it adapt(traj, scene)")
    return _function_entry(takers[0])


def _uncalled(functions: Mapping[str, ast.FunctionDef]) -> list[ast.FunctionDef]:
    """The functions that no other one calls and that take a trajectory; failing that, those that take nothing."""
    used = {name for own, function in functions.items() for name in names_in(function) - {own}}
    roots = {name: f for name, f in functions.items() if name not in used and _takes(f) is not None}
    return [f for f in roots.values() if _takes(f)] or list(roots.values())


def names_in(node: ast.AST) -> set[str]:
    """Every name that is read or bound in a piece of source."""
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}


def _takes(function: ast.FunctionDef) -> int | None:
    """How many of (traj, scene) a function takes, or None if it demands more."""
    arguments = function.args
    positional = [*arguments.posonlyargs, *arguments.args]
    required = len(positional) - len(arguments.defaults)
    if required > 2 or any(default is None for default in arguments.kw_defaults):
        return None
    if arguments.vararg is not None:
        return 2
    taken = max(required, 0)
    while taken < min(len(positional), 2) and any(word in positional[taken].arg.lower() for word in _ROLES[taken]):
        taken += 1
    return taken


def _function_entry(function: ast.FunctionDef) -> EntryPoint:
    taken = _takes(function)
    if taken is None:
        raise PolicyRejected(
            f"{function.name} must be callable as {function.name}(traj, scene); give every further argument a default",
            line=function.lineno,
        )
    return EntryPoint("function", function.name, taken)


def reached(start: Iterable[T], follow: Callable[[T], Iterable[T]]) -> set[T]:
    """All that a start leads to, itself included, where each thing leads to what follows it."""
    found, fresh = set[T](), [*start]
    while fresh:
        one = fresh.pop()
        if one not in found:
            found.add(one)
            fresh += follow(one)
    return found


def find_function(tree: ast.Module, name: str) -> ast.FunctionDef:
    """The last top-level function of that name (the one that a call would reach)."""
    return [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == name][-1]


def top_level_names(tree: ast.Module) -> set[str]:
    """Names that the module's own statements bind, not those inside its functions and classes."""
    return {name for statement in tree.body for name in bound_names(statement)}


def bound_names(node: ast.AST) -> Iterator[str]:
    """Names that running a statement binds in its own scope; `x[0] = 1` and `x.a = 1` count as binding x."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
        yield node.name
        return
    if isinstance(node, ast.Lambda | ast.ListComp | ast.SetComp | ast.DictComp | ast.GeneratorExp):
        yield from (inner.target.id for inner in ast.walk(node) if isinstance(inner, ast.NamedExpr))
        return
    yield from own_bindings(node)
    if isinstance(node, ast.Subscript | ast.Attribute) and not isinstance(node.ctx, ast.Load):
        base = root_name(node)
        if base is not None:
            yield base
    for child in ast.iter_child_nodes(node):
        yield from bound_names(child)


_NAMED_BY = {
    "Name": "id",
    "arg": "arg",
    "MatchMapping": "rest",
    **dict.fromkeys("FunctionDef AsyncFunctionDef ClassDef ExceptHandler MatchAs MatchStar".split(), "name"),
    **dict.fromkeys("TypeVar ParamSpec TypeVarTuple".split(), "name"),
}
"""The attribute of a node that holds the name which it binds."""


def own_bindings(node: ast.AST) -> Iterator[str]:
    """Names that this node itself binds, its children left aside."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        yield from (alias.asname or alias.name.split(".")[0] for alias in node.names)
    elif isinstance(node, ast.Global | ast.Nonlocal):
        yield from node.names
    elif not isinstance(getattr(node, "ctx", None), ast.Load):
        name = getattr(node, _NAMED_BY.get(type(node).__name__, ""), None)
        if name:
            yield name


def all_bindings(tree: ast.AST) -> set[str]:
    """Every name that is bound anywhere, in any scope."""
    return {name for node in ast.walk(tree) for name in own_bindings(node)}


def root_name(node: ast.AST) -> str | None:
    """The name at the left of `a.b[c].d`, or None."""
    while isinstance(node, ast.Attribute | ast.Subscript | ast.Call):
        node = node.func if isinstance(node, ast.Call) else node.value
    return node.id if isinstance(node, ast.Name) else None


def literal(node: ast.expr) -> Value:
    """The value of a literal or of + - * / on number literals.

    Raises:
        ValueError: If it is anything else.
    """
    match node:
        case ast.Constant(value=bool() | int() | float() | str() | None as value):
            return value
        case ast.Tuple(elts=items):
            return tuple(literal(item) for item in items)
        case ast.UnaryOp(op=ast.USub() | ast.UAdd() as sign, operand=operand):
            value = _number(literal(operand))
            return -value if isinstance(sign, ast.USub) else value
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() as op, right=right):
            a, b = _number(literal(left)), _number(literal(right))
            if isinstance(op, ast.Div):
                if b == 0:
                    raise ValueError("division by zero")
                return a / b
            return a + b if isinstance(op, ast.Add) else a - b if isinstance(op, ast.Sub) else a * b
    raise ValueError("not a literal")


def _number(value: Value) -> float | int:
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e15:
        return value
    raise ValueError("not a number")


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


def rewrite(
    source: str, tree: ast.Module, entry: EntryPoint, values: Mapping[str, Value], units: Mapping[str, str]
) -> tuple[str, dict[str, Value]]:
    """Write values into the source at the literals that hold them, leaving everything else as it is.

    Returns:
        The new source, and the values in the types of those that they replace.

    Raises:
        PolicyRejected: If there is no such parameter, or a value has another type than the one it replaces.
    """
    held = literals(tree, entry)
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


def literals(tree: ast.Module, entry: EntryPoint) -> dict[str, tuple[Value, ast.expr]]:
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


def _fitting(name: str, old: Value, value: Value, unit: str) -> Value:
    """The value in the type that the parameter has; a whole number with a unit may become any number.

    Raises:
        PolicyRejected: If it has another type.
    """
    if value is None and old is None:
        return None
    if isinstance(old, tuple) and isinstance(value, tuple | list) and len(value) == len(old):
        return tuple(_fitting(name, a, b, unit or "-") for a, b in zip(old, value, strict=True))
    number = float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
    kind, fitting = _alike(old, value, number if math.isfinite(number) else None, bool(unit))
    if fitting is None:
        raise PolicyRejected(f"parameter {name} is {kind}, such as {old!r}; {value!r} is not")
    return fitting


def _alike(old: Value, value: Value, number: float | None, any_number: bool) -> tuple[str, Value]:
    """What is expected in place of an old value, and the new one in its type, or None."""
    match old:
        case tuple():
            return f"a group of {len(old)} values", None
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


_SPEED_KEYS = ("speed", "velocity", "v", "vel")


def to_rows(result: Any, original: Array, what: str) -> Array:
    """Turn a policy's result into rows x, y, z, speed (and a quaternion if they have one).

    Args:
        result: Array (M, 4), (M, 3) or (M, 8), a list of rows, or a list of dicts with x, y, z and speed or velocity.
        original: The original's rows (N, 4); its speeds serve if the result has none and M equals N.
        what: Name of the result for messages.

    Raises:
        PolicyOutputInvalid: If it cannot be read so.
    """
    wanted = "an array (N, 4) of x, y, z, speed"
    if result is None:
        raise PolicyOutputInvalid(f"{what} is None; it must be {wanted}")
    if isinstance(result, Mapping | str | bytes) or not hasattr(result, "__len__"):
        raise PolicyOutputInvalid(f"{what} is a {type(result).__name__}, not {wanted}")
    if len(result) > MAX_ROWS:
        raise PolicyOutputInvalid(f"{what} has {len(result)} waypoints; {MAX_ROWS} are the most")
    if len(result) and all(isinstance(row, Mapping) for row in result):
        result = [_row(waypoint, i, original, len(result), what) for i, waypoint in enumerate(result)]
    rows = _numbers(result, what)
    if rows.shape[1] == 3:
        if len(rows) != len(original):
            raise PolicyOutputInvalid(
                f"{what} has no speeds and {len(rows)} waypoints instead of {len(original)}; "
                "give each waypoint a speed as its fourth value"
            )
        rows = np.column_stack([rows, original[:, 3]])
    return rows


def stated(recorder: Recorder) -> dict[str, Any]:
    """What a policy stated while it ran, as values that JSON knows if it kept to them."""
    promises = recorder.expectations[:MAX_EXPECTATIONS]
    return {
        "contacts": [str(name) for name in recorder.contacts[:MAX_EXPECTATIONS]],
        "corners": bool(recorder.corners),
        "expectations": [{"kind": e.kind, "arguments": dict(e.arguments), "text": e.text} for e in promises],
    }


def _numbers(result: Any, what: str) -> Array:
    """A result as real numbers (N, 3), (N, 4) or (N, 8)."""
    try:
        if np.iscomplexobj(result):
            raise TypeError
        rows = np.asarray(result, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise PolicyOutputInvalid(f"{what} is not a table of numbers; it must be (N, 4): x, y, z, speed") from None
    if rows.ndim != 2 or rows.shape[1] not in (3, 4, 8):
        raise PolicyOutputInvalid(f"{what} has shape {rows.shape}; it must be (N, 4): x, y, z, speed")
    return rows


def _row(waypoint: Mapping[str, Any], i: int, original: Array, count: int, what: str) -> list[float]:
    missing = [key for key in "xyz" if key not in waypoint]
    if missing:
        raise PolicyOutputInvalid(f"waypoint {i} of {what} has no {missing[0]!r}; each needs x, y, z and velocity")
    speed = next((waypoint[key] for key in _SPEED_KEYS if key in waypoint), None)
    if speed is None:
        if count != len(original):
            raise PolicyOutputInvalid(f"waypoint {i} of {what} has no 'velocity'; each needs x, y, z and velocity")
        speed = original[i, 3]
    return [waypoint["x"], waypoint["y"], waypoint["z"], speed]
