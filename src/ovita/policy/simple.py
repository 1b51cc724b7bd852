"""Policies of toolkit calls only: safe to run anywhere, and blind to the extra columns of what they move."""

from __future__ import annotations

import ast

from ovita.policy.check import PROVIDED
from ovita.policy.syntax import all_bindings
from ovita.toolkit import CATALOGUE


def only_toolkit(tree: ast.Module) -> bool:
    """Whether a policy is one function made of toolkit calls, scene look-ups and arithmetic, and nothing else."""
    body = [s for s in tree.body if not _is_text(s)]
    if len(body) != 1 or not isinstance(body[0], ast.FunctionDef):
        return False
    function = body[0]
    bound = all_bindings(function)
    if function.decorator_list or bound & PROVIDED or any(name.startswith("_") for name in bound):
        return False
    arguments = function.args
    defaults = [*arguments.defaults, *(d for d in arguments.kw_defaults if d is not None)]
    return all(_simple(d, bound) for d in defaults) and all(_simple_statement(s, bound) for s in function.body)


_SIMPLE_ATTRIBUTES = frozenset({"position", "size", "dimensions", "radius", "name", "shape", "names"})
_SIMPLE_NODES = (
    ast.Constant, ast.Tuple, ast.List, ast.BinOp, ast.UnaryOp, ast.Compare, ast.BoolOp, ast.operator, ast.unaryop,
    ast.cmpop, ast.boolop, ast.expr_context, ast.keyword, ast.Slice,
)  # fmt: skip


def _simple_statement(node: ast.stmt, bound: set[str]) -> bool:
    match node:
        case ast.Expr(value=value) | ast.Return(value=ast.expr() as value):
            return _simple(value, bound)
        case ast.Assign(targets=[ast.Name()], value=value):
            return _simple(value, bound)
        case ast.If(test=test, body=body, orelse=orelse):
            return _simple(test, bound) and all(_simple_statement(s, bound) for s in [*body, *orelse])
    return False


def _simple(node: ast.AST, bound: set[str]) -> bool:
    match node:
        case ast.Name(id=name):
            return name in bound
        case ast.Call(func=ast.Name(id=name), args=args, keywords=keywords):
            callable_ = (name in CATALOGUE or name in ("len", "abs", "min", "max", "float")) and name not in bound
            plain = all(k.arg is not None for k in keywords) and not any(isinstance(a, ast.Starred) for a in args)
            return callable_ and plain and all(_simple(a, bound) for a in [*args, *(k.value for k in keywords)])
        case ast.Attribute(value=value, attr=attribute):
            return attribute in _SIMPLE_ATTRIBUTES and _simple(value, bound)
        case ast.Subscript(value=value, slice=index, ctx=ast.Load()):
            return _simple(value, bound) and _simple(index, bound)
        case ast.BinOp(op=ast.Pow() | ast.LShift() | ast.Mod()):
            return False
        case _ if isinstance(node, _SIMPLE_NODES):
            return all(_simple(child, bound) for child in ast.iter_child_nodes(node))
    return False


def _is_text(node: ast.stmt) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def carries_columns(tree: ast.Module) -> bool:
    """Whether a policy of toolkit calls only leaves the arithmetic on its trajectory to the toolkit as well.

    If it does, further columns such as a quaternion may ride along: the toolkit repeats and interpolates them, but
    `traj + 0.1` would spoil them.
    """
    if not only_toolkit(tree):
        return False
    function = next(s for s in tree.body if isinstance(s, ast.FunctionDef))
    follows: dict[str, list[str]] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Assign | ast.AnnAssign) and node.value is not None:
            targets = [t.id for t in _targets(node) if isinstance(t, ast.Name)]
            for name in _names(node.value):
                follows.setdefault(name, []).extend(targets)
    fresh = [a.arg for a in [*function.args.posonlyargs, *function.args.args][:1]]
    tainted = set[str]()
    while fresh:
        name = fresh.pop()
        if name not in tainted:
            tainted.add(name)
            fresh += follows.get(name, [])
    return not any(_names(operand) & tainted for node in ast.walk(function) for operand in _operands(node))


_ARITHMETIC = ast.Add | ast.Sub | ast.Mult | ast.Div | ast.FloorDiv | ast.MatMult


def _operands(node: ast.AST) -> list[ast.expr]:
    match node:
        case ast.BinOp(left=left, op=op, right=right) if isinstance(op, _ARITHMETIC):
            return [left, right]
        case ast.UnaryOp(op=ast.USub() | ast.UAdd(), operand=operand):
            return [operand]
        case ast.Subscript(value=value):
            return [value]
        case ast.Return(value=value) if not isinstance(value, ast.Call | ast.Name):
            return [value] if value is not None else []
    return []


def _targets(node: ast.Assign | ast.AnnAssign) -> list[ast.expr]:
    return node.targets if isinstance(node, ast.Assign) else [node.target]


def _names(node: ast.AST) -> set[str]:
    return {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
