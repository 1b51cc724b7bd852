"""A policy; the proof that one is made of toolkit calls only, and running it here without running it as code.

A proven policy is one function whose statements are assignments, conditions, toolkit calls, scene look-ups and
arithmetic. It is not compiled: `run_proven` walks its syntax tree and does those few things itself. What it computes on
is bounded in number, size and work; where a policy needs more, the sandbox runs it.
"""

from __future__ import annotations

import ast
import contextlib
import math
import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.errors import PolicyCrashed
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Array
from ovita.policy.source import (
    Form,
    Parameter,
    Value,
    all_bindings,
    entry_of,
    literal,
    names_in,
    own_bindings,
    parse_tree,
    reached,
    rewrite,
)
from ovita.policy.wire import MAX_MESSAGE
from ovita.text import clean_text
from ovita.toolkit import CATALOGUE, Expectation, Recorder
from ovita.toolkit.arguments import invoked, is_shipped


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


MAX_WAYPOINTS = 5_000
"""Most rows of an array that is handed to the toolkit in this process."""

MAX_ELEMENTS = 40_000
"""Most elements of an array or a text that arithmetic may bring about in this process."""

MAX_NUMBER = 1e6
"""Largest magnitude of a number that a proven policy may state or compute; whole numbers do not grow beyond it."""

MAX_CALLS = 64
"""Most toolkit calls in this process."""

MAX_WORK = 2_000_000
"""Most elements that arithmetic may touch in all in this process."""

_FUNCTIONS: Mapping[str, Callable[..., Any]] = MappingProxyType(
    {"len": len, "abs": abs, "min": min, "max": max, "float": float}
)
_ATTRIBUTES: Mapping[type, frozenset[str]] = MappingProxyType(
    {
        SceneObject: frozenset({"position", "size", "dimensions", "radius", "name"}),
        Scene: frozenset({"names"}),
        np.ndarray: frozenset({"shape"}),
    }
)
_ALL_ATTRIBUTES = frozenset().union(*_ATTRIBUTES.values())
_BINARY: Mapping[type[ast.operator], Callable[[Any, Any], Any]] = MappingProxyType(
    {
        ast.Add: operator.add,
        ast.Sub: operator.sub,
        ast.Mult: operator.mul,
        ast.Div: operator.truediv,
        ast.FloorDiv: operator.floordiv,
        ast.BitAnd: operator.and_,
        ast.BitOr: operator.or_,
        ast.BitXor: operator.xor,
    }
)
_UNARY: Mapping[type[ast.unaryop], Callable[[Any], Any]] = MappingProxyType(
    {ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Invert: operator.invert, ast.Not: operator.not_}
)
_COMPARE: Mapping[type[ast.cmpop], Callable[[Any, Any], Any]] = MappingProxyType(
    {
        ast.Lt: operator.lt,
        ast.LtE: operator.le,
        ast.Gt: operator.gt,
        ast.GtE: operator.ge,
        ast.Eq: operator.eq,
        ast.NotEq: operator.ne,
        ast.Is: operator.is_,
        ast.IsNot: operator.is_not,
        ast.In: lambda a, b: a in b,
        ast.NotIn: lambda a, b: a not in b,
    }
)
_RESERVED = frozenset({*CATALOGUE, *_FUNCTIONS, "np", "math", "get_trajectory", "detect_objects"})


class TooMuch(Exception):
    """A proven policy needs more than this process gives it; it belongs into the sandbox."""


def proven(tree: ast.Module) -> bool:
    """Whether a policy is one function made of toolkit calls, scene look-ups and arithmetic, and nothing else."""
    return _proven_function(tree) is not None


def _proven_function(tree: ast.Module) -> ast.FunctionDef | None:
    body = [s for s in tree.body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
    if len(body) != 1 or not isinstance(body[0], ast.FunctionDef) or not _is_plain(body[0]):
        return None
    bound = {body[0].name, *all_bindings(body[0].args)}
    return body[0] if _fit([_statements(tuple(body[0].body))], bound) else None


@dataclass(frozen=True)
class _Statements:
    """Statements with what a proof needs of them.

    `simple` says that all in them is of the kinds that a proven policy may contain; `read` are the names that they read
    or bind, what they call left out; `bound` are those that they bind.
    """

    body: tuple[ast.stmt, ...]
    simple: bool
    read: frozenset[str]
    bound: frozenset[str]


def _statements(body: tuple[ast.stmt, ...]) -> _Statements:
    nodes = [node for statement in body for node in ast.walk(statement)]
    functions = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
    own = [node for node in nodes if id(node) not in functions]
    return _Statements(
        body,
        all(isinstance(node, ast.Name) or _is_simple(node) for node in own),
        frozenset(node.id for node in own if isinstance(node, ast.Name)),
        frozenset(name for node in nodes for name in own_bindings(node)),
    )


def _fit(parts: Sequence[_Statements], given: Iterable[str]) -> bool:
    """Whether statements are simple together, where some names have values from the start."""
    bound = frozenset(given).union(*(part.bound for part in parts))
    if bound & _RESERVED or any(name.startswith("_") for name in bound):
        return False
    return all(part.simple and part.read <= bound for part in parts)


@lru_cache(maxsize=8192)
def _read(statement: str) -> _Statements:
    return _statements(tuple(parse_tree(statement).body))


def prove_statements(parameters: Sequence[str], statements: Sequence[str]) -> Proof | None:
    """The proof of adapt(traj, scene, *, parameters) whose body is some statements, or None where there is none.

    Each statement is read once and kept, since the policies that ovita writes have most of them in common. The
    parameters have no values; `run_proof` takes them.

    Raises:
        PolicyRejected: If a statement is not Python.
    """
    parts = [_read(statement) for statement in statements]
    if not _fit(parts, ("adapt", "traj", "scene", *parameters)):
        return None
    inputs, knobs = ([ast.arg(name) for name in names] for names in (("traj", "scene"), parameters))
    none: list[ast.expr | None] = [None] * len(knobs)
    arguments = ast.arguments(posonlyargs=[], args=inputs, kwonlyargs=knobs, kw_defaults=none, defaults=[])
    body = [statement for part in parts for statement in part.body]
    return Proof(ast.FunctionDef("adapt", arguments, body, decorator_list=[]), 2)


def _is_plain(function: ast.FunctionDef) -> bool:
    """Whether a function has neither decorators nor type parameters, takes no *args, and its defaults are literals."""
    arguments = function.args
    if function.decorator_list or arguments.vararg or arguments.kwarg or getattr(function, "type_params", None):
        return False
    return all(_is_literal(d) for d in (*arguments.defaults, *arguments.kw_defaults) if d is not None)


_PLAIN_NODES = (
    *(ast.Expr, ast.If, ast.Pass, ast.Tuple, ast.List, ast.Slice, ast.Load, ast.Store),
    *(ast.BinOp, ast.UnaryOp, ast.Compare, ast.BoolOp, ast.And, ast.Or, *_BINARY, *_UNARY, *_COMPARE),
)
"""Kinds of nodes that a proven policy may contain as they are."""


def _is_simple(node: ast.AST) -> bool:
    """Whether a node may be in a proven policy, if all that is inside it may; what a call calls is judged with it."""
    match node:
        case ast.Constant(value=value):
            return value is None or type(value) in (bool, int, float, str)
        case ast.Return(value=value):
            return value is not None
        case ast.Assign(targets=[ast.Name()]):
            return True
        case ast.Assign(targets=[ast.Tuple(elts=names)], value=ast.Tuple(elts=values)):
            return len(names) == len(values) and all(isinstance(name, ast.Name) for name in names)
        case ast.Call(func=ast.Name(id=name), keywords=keywords):
            return (name in CATALOGUE and is_shipped(CATALOGUE[name])) or (name in _FUNCTIONS and not keywords)
        case ast.keyword(arg=name):
            return name is not None
        case ast.Attribute(attr=attribute, ctx=ast.Load()):
            return attribute in _ALL_ATTRIBUTES
        case ast.Subscript(ctx=ast.Load()):
            return True
    return isinstance(node, _PLAIN_NODES)


def _is_literal(node: ast.expr) -> bool:
    try:
        literal(node)
    except (ValueError, OverflowError, RecursionError):
        return False
    return True


@dataclass(frozen=True)
class Proof:
    """A proven policy's function, and how many of (traj, scene) it takes: it is proven once and run often."""

    function: ast.FunctionDef
    arguments: int


def prove(tree: ast.Module) -> Proof | None:
    """The proof of a policy, or None where there is none."""
    function = _proven_function(tree)
    return None if function is None else Proof(function, entry_of(tree).arguments)


def run_proven(tree: ast.Module, given: Array, scene: Scene) -> tuple[Any, Recorder]:
    """Run a proven policy on rows (N, 4+k); return its unchecked result and its postconditions.

    Raises:
        TooMuch: If it is not proven, or takes more than this process gives; nothing of it is left then.
        PolicyCrashed: If it fails, with the line.
    """
    proof = prove(tree) if len(given) <= MAX_WAYPOINTS else None
    if proof is None:
        raise TooMuch
    return run_proof(proof, given, scene)


def run_proof(
    proof: Proof, given: Array, scene: Scene, values: Mapping[str, Any] = MappingProxyType({})
) -> tuple[Any, Recorder]:
    """As `run_proven`, with a proof at hand and values of some parameters."""
    if len(given) > MAX_WAYPOINTS:
        raise TooMuch
    run = _Run(proof, scene)
    try:
        with np.errstate(all="ignore"):
            return run.function(proof, given, values), run.recorder
    except (TooMuch, RecursionError, MemoryError):
        raise TooMuch from None
    except Exception as error:
        said = f"{type(error).__name__}: {error}".removesuffix(": ")
        raise PolicyCrashed(clean_text(said[:MAX_MESSAGE], MAX_MESSAGE), line=run.line) from None


class _Return(Exception):
    """Ends the function with a value."""

    def __init__(self, value: Any) -> None:
        self.value = value


class _Run(ast.NodeVisitor):
    """Walks the tree of one proven policy; visiting an expression gives its value."""

    def __init__(self, proof: Proof, scene: Scene) -> None:
        self.scene, self.recorder = scene, Recorder()
        self.calls, self.work, self.line = 0, 0, 0
        self.values: dict[str, Any] = {}

    def function(self, proof: Proof, given: Array, values: Mapping[str, Any]) -> Any:
        """Call the policy's function with the trajectory and the scene."""
        arguments = proof.function.args
        positional = [*arguments.posonlyargs, *arguments.args]
        first = len(positional) - len(arguments.defaults)
        defaults = {a.arg: d for a, d in zip(positional[first:], arguments.defaults, strict=True)}
        defaults |= {a.arg: d for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults, strict=True) if d}
        literals = {name: literal(node) for name, node in defaults.items() if name not in values}
        self.values = {name: self.bounded(value) for name, value in {**literals, **values}.items()}
        inputs = (given, self.scene)[: proof.arguments]
        self.values |= {a.arg: value for a, value in zip(positional, inputs, strict=False)}
        try:
            self.block(proof.function.body)
        except _Return as ended:
            return ended.value
        return None

    def block(self, body: list[ast.stmt]) -> None:
        for statement in body:
            self.line = statement.lineno
            self.visit(statement)

    def generic_visit(self, node: ast.AST) -> Any:
        raise TooMuch

    def visit_Return(self, node: ast.Return) -> None:
        raise _Return(self.visit(node.value or ast.Constant(None)))

    def visit_Assign(self, node: ast.Assign) -> None:
        match node.targets[0], node.value:
            case ast.Name(id=name), value:
                self.values[name] = self.visit(value)
            case ast.Tuple(elts=names), ast.Tuple(elts=parts):
                values = [self.visit(part) for part in parts]
                self.values |= {n.id: v for n, v in zip(names, values, strict=True) if isinstance(n, ast.Name)}

    def visit_If(self, node: ast.If) -> None:
        self.block(node.body if self.visit(node.test) else node.orelse)

    def visit_Expr(self, node: ast.Expr) -> None:
        self.visit(node.value)

    def visit_Pass(self, node: ast.Pass) -> None:
        pass

    def visit_Constant(self, node: ast.Constant) -> Any:
        return self.bounded(node.value)

    def visit_Name(self, node: ast.Name) -> Any:
        if node.id not in self.values:
            raise UnboundLocalError(f"{node.id} is used before it has a value")
        return self.values[node.id]

    def visit_Tuple(self, node: ast.Tuple) -> Any:
        return tuple(self.visit(item) for item in node.elts)

    def visit_List(self, node: ast.List) -> Any:
        return [self.visit(item) for item in node.elts]

    def visit_BoolOp(self, node: ast.BoolOp) -> Any:
        until, result = isinstance(node.op, ast.Or), None
        for value in node.values:
            result = self.visit(value)
            if bool(result) is until:
                break
        return result

    def visit_Compare(self, node: ast.Compare) -> Any:
        left, result = self.visit(node.left), None
        for op, right_node in zip(node.ops, node.comparators, strict=True):
            right = self.visit(right_node)
            self.line = node.lineno
            if not isinstance(op, ast.Is | ast.IsNot | ast.In | ast.NotIn):
                self.refuse_growth(left, right, arithmetic=False)
            result = self.bounded(_COMPARE[type(op)](left, right))
            if len(node.ops) > 1 and not result:
                break
            left = right
        return result

    def visit_BinOp(self, node: ast.BinOp) -> Any:
        a, b = self.visit(node.left), self.visit(node.right)
        self.line = node.lineno
        self.refuse_growth(a, b)
        return self.bounded(_BINARY[type(node.op)](a, b))

    def visit_UnaryOp(self, node: ast.UnaryOp) -> Any:
        return self.bounded(_UNARY[type(node.op)](self.visit(node.operand)))

    def visit_Attribute(self, node: ast.Attribute) -> Any:
        owner, name = self.visit(node.value), node.attr
        self.line = node.lineno
        if name not in _ATTRIBUTES.get(type(owner), ()):
            raise AttributeError(f"{type(owner).__name__} has no {name} in a policy")
        return self.bounded(getattr(owner, name))

    def visit_Subscript(self, node: ast.Subscript) -> Any:
        owner, key = self.visit(node.value), self.index(node.slice)
        self.line = node.lineno
        return self.bounded(owner[key])

    def visit_Call(self, node: ast.Call) -> Any:
        assert isinstance(node.func, ast.Name)
        name = node.func.id
        arguments = [self.visit(a) for a in node.args]
        named = {k.arg: self.visit(k.value) for k in node.keywords if k.arg is not None}
        self.line = node.lineno
        if name not in CATALOGUE:
            return self.bounded(_FUNCTIONS[name](*arguments))
        self.calls += 1
        if self.calls > MAX_CALLS or any(len(a) > MAX_WAYPOINTS for a in (*arguments, *named.values()) if _is_array(a)):
            raise TooMuch
        return self.bounded(invoked(CATALOGUE[name], arguments, named, self.scene.frame, self.recorder))

    def index(self, node: ast.expr) -> Any:
        """An index that takes a part and never more than there is: numbers, slices, one mask, a name."""
        match node:
            case ast.Slice(lower=lower, upper=upper, step=step):
                return slice(*(None if part is None else self.visit(part) for part in (lower, upper, step)))
            case ast.Tuple(elts=parts):
                return tuple(self.part(self.index(part)) for part in parts)
        key = self.visit(node)
        return key if isinstance(key, str) else self.part(key)

    def part(self, key: Any) -> Any:
        mask = _is_array(key) and key.dtype == np.bool_ and key.ndim == 1
        if mask or isinstance(key, slice) or (isinstance(key, int | np.integer) and not isinstance(key, bool)):
            return key
        raise TooMuch

    def refuse_growth(self, a: Any, b: Any, *, arithmetic: bool = True) -> None:
        """Let arithmetic pass on numbers and arrays of numbers only, and where the result is not large."""
        if not (_is_array(a) or _is_array(b)):
            if arithmetic and not (_is_number(a) and _is_number(b)):
                raise TooMuch  # such as a text or a list times a number
            return
        shapes = [np.shape(v) for v in (a, b) if _is_array(v) or isinstance(v, list | tuple)]
        try:
            shape = np.broadcast_shapes(*shapes)
        except ValueError:
            return  # numpy says it better
        self.spend(int(np.prod(shape)))

    def spend(self, elements: int) -> None:
        self.work += elements
        if elements > MAX_ELEMENTS or self.work > MAX_WORK:
            raise TooMuch

    def bounded(self, value: Any) -> Any:
        """The value, if it is of a kind and a size that is computed on here."""
        if isinstance(value, int | float | np.number):
            size = abs(int(value)) if isinstance(value, int | np.integer) else abs(float(value))
            too_much = MAX_NUMBER < size < math.inf
        elif _is_array(value):
            too_much = value.dtype.kind not in "fiub" or value.size > 8 * 2 * MAX_ELEMENTS
            self.spend(value.size // 16)
        elif isinstance(value, str | list | tuple):
            too_much = False
            self.spend(len(value))
        else:
            too_much = not isinstance(value, SceneObject | Scene | Expectation | np.bool_ | None)
        if too_much:
            raise TooMuch
        return value


def _is_array(value: Any) -> bool:
    return type(value) is np.ndarray


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number | np.bool_)


class _Watched(_Run):
    """A run that notes which waypoints each toolkit call changes."""

    def __init__(self, proof: Proof, scene: Scene) -> None:
        super().__init__(proof, scene)
        self.found: list[tuple[int, NDArray[np.bool_]]] = []

    def visit_Call(self, node: ast.Call) -> Any:
        result = super().visit_Call(node)
        before: Any = self.visit(node.args[0]) if node.args and isinstance(node.args[0], ast.Name) else ()
        if _is_array(before) and _is_array(result) and before.ndim == result.ndim == 2:
            same = before.shape == result.shape
            changed = (np.abs(before - result) > 1e-9).any(axis=1) if same else np.ones(len(result), dtype=bool)
            self.found.append((node.lineno, changed))
        return result


def changed_by_line(tree: ast.Module, given: Array, scene: Scene) -> list[tuple[int, NDArray[np.bool_]]]:
    """Which rows (M,) of its result each toolkit call of a proven policy changes, with its line; [] of any other."""
    proof = prove(tree)
    if proof is None:
        return []
    run = _Watched(proof, scene)
    with contextlib.suppress(Exception), np.errstate(all="ignore"):
        run.function(proof, given, {})
    return run.found


def carries_columns(tree: ast.Module) -> bool:
    """Whether a proven policy leaves the arithmetic on its trajectory to the toolkit as well.

    If it does, further columns such as a quaternion may ride along: the toolkit repeats and interpolates them, but
    `traj + 0.1` would spoil them.
    """
    function = _proven_function(tree)
    if function is None:
        return False
    follows: dict[str, list[str]] = {}
    for node in (node for node in ast.walk(function) if isinstance(node, ast.Assign)):
        for name in names_in(node.value):
            follows.setdefault(name, []).extend(t.id for t in node.targets if isinstance(t, ast.Name))
    first = [a.arg for a in [*function.args.posonlyargs, *function.args.args][:1]]
    tainted = reached(first, lambda name: follows.get(name, ()))
    return not any(names_in(operand) & tainted for node in ast.walk(function) for operand in _operands(node))


def _operands(node: ast.AST) -> list[ast.expr]:
    match node:
        case ast.BinOp(left=left, op=ast.Add() | ast.Sub() | ast.Mult() | ast.Div() | ast.FloorDiv(), right=right):
            return [left, right]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            return [operand]
        case ast.Subscript(value=value):
            return [value]
        case ast.Return(value=value) if not isinstance(value, ast.Call | ast.Name):
            return [value] if value is not None else []
    return []
