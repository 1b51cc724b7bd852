"""The allowlist check: early, readable errors about what a policy may not contain.

On Linux this is a courtesy to the writer of a policy, and the kernel is the wall (`ovita.policy.sandbox`). Elsewhere
it is part of the wall, together with the reduced modules and builtins that `ovita.policy.modules` hands out.
"""

from __future__ import annotations

import ast
import builtins
import difflib

from ovita.errors import PolicyRejected
from ovita.policy.allowed import (
    ALLOWED_DUNDERS,
    BUILTINS,
    MODULES,
    NAMEDTUPLE,
    ONLY,
    REASONS,
    is_dunder,
    opens_objects,
    refusal,
)
from ovita.policy.syntax import all_bindings, own_bindings, parse_tree
from ovita.toolkit import CATALOGUE

SCRIPT_CALLS = ("get_trajectory", "detect_objects")
"""What the script form of the paper calls."""

PROVIDED = frozenset({*CATALOGUE, *SCRIPT_CALLS, "np", "math"})
"""Names at hand in every policy."""

_LONGEST_HINT = 40
_INSTEAD = "numpy (as np), math and parts of scipy are at hand"


def check(source: str | ast.Module) -> None:
    """Check that a policy contains only what it may.

    Args:
        source: The policy's source, or its syntax tree.

    Raises:
        PolicyRejected: With the line and what to do instead.
    """
    tree = parse_tree(source) if isinstance(source, str) else source
    try:
        _Check(tree).visit(tree)
    except RecursionError:
        raise PolicyRejected("an expression is nested too deeply; split it into several statements") from None


class _Check(ast.NodeVisitor):
    """Visits every node; each visitor looks at one kind."""

    def __init__(self, tree: ast.Module) -> None:
        self.bound = all_bindings(tree)
        self.private = _own_attributes(tree) | NAMEDTUPLE
        self.star = any(isinstance(n, ast.ImportFrom) and any(a.name == "*" for a in n.names) for n in ast.walk(tree))

    def generic_visit(self, node: ast.AST) -> None:
        for name in own_bindings(node):
            self.binding(name, node)
        super().generic_visit(node)

    def binding(self, name: str, node: ast.AST) -> None:
        if is_dunder(name) and name not in ALLOWED_DUNDERS and name != "__all__":
            raise _reject(node, REASONS.get(name, f"a policy may not define {name}"))

    def visit_Import(self, node: ast.Import) -> None:
        for alias in node.names:
            self.module(alias.name, node)
        self.generic_visit(node)

    def visit_ImportFrom(self, node: ast.ImportFrom) -> None:
        if node.level:
            raise _reject(node, f"a policy has no package around it, so it cannot import relatively; {_INSTEAD}")
        module = node.module or ""
        self.module(module, node)
        for alias in node.names:
            if f"{module}.{alias.name}" in MODULES or alias.name == "*":
                continue
            only = ONLY.get(module)
            reason = refusal(alias.name)
            if module == "scipy":
                raise _reject(node, f"scipy.{alias.name} is not available in a policy; {_INSTEAD}")
            if reason or (only is not None and alias.name not in only) or alias.name.startswith("_"):
                why = reason or REASONS.get(alias.name) or f"a policy may not import {alias.name} from {module}"
                raise _reject(node, why)
        self.generic_visit(node)

    def module(self, name: str, node: ast.AST) -> None:
        if name in MODULES:
            return
        root = name.split(".")[0]
        why = REASONS.get(name) or REASONS.get(root) or REASONS.get(name.split(".")[-1])
        why = why or f"{name} is not available in a policy"
        raise _reject(node, f"{why} (import {name}); {_INSTEAD}" if root in REASONS else f"{why}; {_INSTEAD}")

    def visit_Name(self, node: ast.Name) -> None:
        name = node.id
        if not isinstance(node.ctx, ast.Load):
            self.binding(name, node)
            return
        if name in self.bound or name in PROVIDED:
            self.binding(name, node)
            return
        if name == "type":
            raise _reject(node, "a policy may call type(value) with one value, and nothing else with type")
        if name in BUILTINS:
            return
        if name in REASONS and (hasattr(builtins, name) or is_dunder(name)):
            raise _reject(node, f"{REASONS[name]} ({name})" if "open files" not in REASONS[name] else REASONS[name])
        if hasattr(builtins, name) or is_dunder(name):
            raise _reject(node, f"a policy may not use {name}")
        if self.star:
            return
        if name in REASONS:
            raise _reject(node, f"{REASONS[name]} ({name})")
        known = [n for n in sorted(PROVIDED | BUILTINS | self.bound) if len(n) <= _LONGEST_HINT][:2000]
        near = difflib.get_close_matches(name[:_LONGEST_HINT], known, 1, 0.75)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise _reject(node, f"{name} is not defined{hint}")

    def visit_Attribute(self, node: ast.Attribute) -> None:
        name = node.attr
        reason = refusal(name)
        if reason:
            raise _reject(node, reason)
        if name == "format" and name not in self.private:
            if not (isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)):
                raise _reject(node, "a policy may call .format only on a literal text; use an f-string")
            if opens_objects(node.value.value):
                raise _reject(node, "a policy may not reach attributes through .format; use an f-string")
        if name.startswith("_") and not is_dunder(name) and name not in self.private:
            raise _reject(node, f"a policy may not touch the private {name}")
        if not isinstance(node.ctx, ast.Load) and is_dunder(name):
            raise _reject(node, f"a policy may not set {name}")
        self.visit(node.value)

    def visit_Call(self, node: ast.Call) -> None:
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        if called == "type" and "type" not in self.bound:
            if len(node.args) != 1 or node.keywords or isinstance(node.args[0], ast.Starred):
                raise _reject(node, "a policy may call type(value) with one value, and nothing else with type")
            self.visit(node.args[0])
            return
        if called in ("getattr", "setattr", "hasattr") and len(node.args) > 1:
            second = node.args[1]
            if isinstance(second, ast.Constant) and isinstance(second.value, str):
                reason = refusal(second.value)
                if reason:
                    raise _reject(node, reason)
        self.generic_visit(node)

    def visit_keyword(self, node: ast.keyword) -> None:
        if node.arg == "refcheck":
            raise _reject(node, "a policy may not reach into memory; use np.resize or np.concatenate")
        if node.arg is not None and is_dunder(node.arg):
            raise _reject(node, f"a policy may not pass {node.arg}")
        self.generic_visit(node)

    def visit_ClassDef(self, node: ast.ClassDef) -> None:
        for keyword in node.keywords:
            plain = isinstance(keyword.value, ast.Name | ast.Attribute)
            if keyword.arg == "metaclass" and not (plain and ast.unparse(keyword.value).endswith("ABCMeta")):
                raise _reject(node, "a policy may not use metaclasses; write a plain class")
        self.generic_visit(node)

    def visit_MatchClass(self, node: ast.MatchClass) -> None:
        for name in node.kwd_attrs:
            reason = refusal(name)
            if reason or name == "format" or (name.startswith("_") and name not in self.private):
                raise _reject(node, reason or f"a policy may not match the attribute {name}")
        self.generic_visit(node)

    def visit_arg(self, node: ast.arg) -> None:
        self.binding(node.arg, node)  # and not its annotation, which is never evaluated

    def visit_AnnAssign(self, node: ast.AnnAssign) -> None:
        self.visit(node.target)
        if node.value is not None:
            self.visit(node.value)

    def visit_FunctionDef(self, node: ast.FunctionDef) -> None:
        self.binding(node.name, node)
        for part in (*node.decorator_list, node.args, *node.body):
            self.visit(part)

    def visit_AsyncFunctionDef(self, node: ast.AsyncFunctionDef) -> None:
        raise _reject(node, "a policy may not be asynchronous; write plain functions")

    def visit_Await(self, node: ast.Await) -> None:
        raise _reject(node, "a policy may not be asynchronous; write plain functions")


def _own_attributes(tree: ast.Module) -> set[str]:
    """Attributes that the policy's own classes define: methods, class variables, and what they set on self."""
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef):
            for inner in ast.walk(node):
                names.update(own_bindings(inner) if isinstance(inner, ast.FunctionDef | ast.Name) else ())
                if isinstance(inner, ast.Attribute) and not isinstance(inner.ctx, ast.Load):
                    names.add(inner.attr)
    return {name for name in names if not is_dunder(name)}


def _reject(node: ast.AST, problem: str) -> PolicyRejected:
    return PolicyRejected(problem, line=getattr(node, "lineno", None))
