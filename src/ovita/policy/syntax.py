"""Reading a policy as a syntax tree: its form, its entry, the names it binds."""

from __future__ import annotations

import ast
import threading
import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from ovita.errors import PolicyRejected

Form = Literal["function", "script"]

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
    """Where a policy starts.

    Args:
        form: "function" or "script".
        name: The function to call, or "" for a script.
        arguments: How many of (traj, scene) the function takes: 0, 1 or 2.
    """

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
