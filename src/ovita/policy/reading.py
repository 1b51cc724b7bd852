"""From a model's reply to a policy: finding the code, cleaning it, checking it, reading its parameters."""

from __future__ import annotations

import ast
import io
import re
import symtable
import sys
import textwrap
import tokenize
from collections import Counter
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import dropwhile
from typing import NamedTuple

from ovita.errors import PolicyRejected
from ovita.policy.check import MODULES, PROVIDED, REASONS, SCRIPT_CALLS, check, refusal
from ovita.policy.policy import Policy
from ovita.policy.source import (
    MAX_NOTE,
    MAX_SOURCE,
    NO_POLICY,
    RESULT,
    EntryPoint,
    Parameter,
    bound_names,
    entry_of,
    find_function,
    literals,
    names_in,
    own_bindings,
    parse_tree,
    reached,
    root_name,
    top_level_names,
)
from ovita.policy.wire import MAX_MESSAGE
from ovita.text import clean_text
from ovita.units import find

_CODE = re.compile(r"(import |from [\w.]+ import|def \w+|class \w+|@\w|#|\"\"\"|[A-Za-z_][\w.,\[\] ]*=[^=]|for |if )")
MAX_SUMMARY = 300
"""Most characters of a summary."""

PYTHON = ("python", "py", "python3", "")
"""Languages by which a fenced block is Python."""


@lru_cache(maxsize=16)  # a knob runs the same program again and again
def parse(text: str, *, checked: bool = True) -> Policy:
    """Read a policy from a model's reply or from plain code.

    Args:
        text: Code, or prose with code between ``` fences. The last block that holds a policy counts.
        checked: Whether it must pass the allowlist check, without which only the sandbox's tests read one.

    Raises:
        PolicyRejected: If there is no policy, it is not Python, or it contains what a policy may not. Lines count
            within the code.
    """
    try:
        source, lines = clean(extract(text))
        tree = parse_tree(source)
        entry = entry_of(tree)
        parameters = find_parameters(source, tree, entry)
    except PolicyRejected as rejected:
        raise _printable(rejected, rejected.line) from None
    policy = Policy(source, entry.form, parameters, _summary(source, tree, entry), lines)
    try:
        if checked:
            check(tree)
    except PolicyRejected as rejected:
        raise _printable(rejected, policy.written_line(rejected.line)) from None
    return policy


def _printable(rejected: PolicyRejected, line: int | None) -> PolicyRejected:
    """The refusal in words that are fit for a terminal, however the source was written."""
    return PolicyRejected(clean_text(rejected.problem, MAX_MESSAGE), line=line)


def extract(text: str) -> str:
    """Find the code in a reply.

    Raises:
        PolicyRejected: If there is none that could be a policy.
    """
    if len(text) > 4 * MAX_SOURCE:
        raise PolicyRejected(f"the reply is longer than {4 * MAX_SOURCE // 1024} KiB; answer with the policy alone")
    text = text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    if not text.strip():
        raise PolicyRejected("the reply is empty; answer with a policy")
    problem: PolicyRejected | None = None
    for code in map(_with_result, _candidates(text)):
        try:
            entry_of(parse_tree(code))
            return code
        except PolicyRejected as rejected:
            if problem is None or (problem.problem == NO_POLICY and rejected.problem != NO_POLICY):
                problem = rejected
    raise problem or PolicyRejected(NO_POLICY)


def _with_result(code: str) -> str:
    """Have a script whose main function keeps or returns the result leave it outside; lines stay where they are."""
    try:
        tree = parse_tree(code)
    except PolicyRejected:
        return code
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    if "adapt" in functions or RESULT in top_level_names(tree):
        return code
    for name, call in _bare_calls(tree, functions):
        place, text = _leaving(functions[name], call)
        if place is not None and not (place is call and _enters(tree, name)):
            lines = code.split("\n")
            line = lines[place.lineno - 1].encode()
            head, tail = line[: place.col_offset].decode(), line[place.col_offset :].decode()
            lines[place.lineno - 1] = f"{head}{text}{tail}"
            return "\n".join(lines)
    return code


def _bare_calls(tree: ast.Module, functions: Container[str]) -> Iterator[tuple[str, ast.Expr]]:
    """Statements of a script, its main guard included, that only call one of its functions, with its name."""
    for statement in tree.body:
        for inner in statement.body if isinstance(statement, ast.If) and _is_main_guard(statement) else [statement]:
            match inner:
                case ast.Expr(value=ast.Call(func=ast.Name(id=name))) if name in functions:
                    yield name, inner


_COMPOUND = ast.FunctionDef | ast.ClassDef | ast.If | ast.For | ast.While | ast.With | ast.Try | ast.Match


def _enters(tree: ast.Module, name: str) -> bool:
    """Whether a policy is already read as the function of that name."""
    try:
        return entry_of(tree).name == name
    except PolicyRejected:
        return False


def _leaving(function: ast.FunctionDef, call: ast.stmt) -> tuple[ast.stmt | None, str]:
    """What to write before which statement, so that a function that sets or returns the result leaves it outside."""
    nodes = [node for statement in function.body for node in ast.walk(statement)]
    if RESULT not in {name for s in function.body for name in bound_names(s)}:
        return None, ""
    if any(isinstance(node, ast.Return) and node.value is not None for node in nodes):
        return call, f"{RESULT} = "
    if any(isinstance(node, ast.Global) and RESULT in node.names for node in nodes):
        return None, ""
    return _before_result(function), f"global {RESULT}; "


def _before_result(function: ast.FunctionDef) -> ast.stmt | None:
    """A simple statement of a function before the first that mentions the result, or None."""
    for statement in function.body:
        is_text = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
        if not is_text and not isinstance(statement, _COMPOUND):
            return statement
        if any(isinstance(node, ast.Name) and node.id == RESULT for node in ast.walk(statement)):
            return None
    return None


def _candidates(text: str) -> Iterator[str]:
    blocks = [(block.language, _dedented(block.code)) for block in fenced(text)[0]]
    python = [code for language, code in blocks if language in PYTHON]
    yield from reversed(python)
    if len(python) > 1:
        yield "\n\n".join(python)
    if not blocks:
        code = _dedented(text)
        yield code
        yield _without_prose(code)
    yield from (code for language, code in blocks if language not in PYTHON)


class Block(NamedTuple):
    """A fenced block: its language in lower case, its text, and whether it is closed, as the last need not be."""

    language: str
    code: str
    closed: bool


def fenced(text: str) -> tuple[list[Block], str]:
    """The blocks between fences of ``` or ~~~, and the prose around them with "Code:" in their places."""
    blocks, prose = list[Block](), list[str]()
    fence, language, code = "", "", list[str]()
    for line in text.split("\n"):
        mark = line.strip()
        if not fence and mark.startswith(("```", "~~~")):
            rest = mark.lstrip(mark[0])
            fence, language, code = mark[: len(mark) - len(rest)], rest.strip().lower()[:20].split(" ")[0], []
            prose.append("Code:")
        elif not fence:
            prose.append(line)
        elif mark.startswith(fence) and not mark.strip(fence[0]):
            blocks.append(Block(language, "\n".join(code) + "\n", True))
            fence = ""
        else:
            code.append(line)
    if fence:
        blocks.append(Block(language, "\n".join(code), False))
    return blocks, "\n".join(prose)


def _dedented(code: str) -> str:
    first = next((line for line in code.split("\n") if line.strip()), "")
    return textwrap.dedent(code) if first[:1].isspace() else code


def _without_prose(text: str) -> str:
    """Leave out sentences before and after code that came without fences."""
    lines = text.split("\n")
    start = next((i for i, line in enumerate(lines) if _CODE.match(line)), 0)
    end = len(lines)
    while end > start and (not lines[end - 1].strip() or _is_prose(lines[end - 1])):
        end -= 1
    return "\n".join(lines[start:end])


def _is_prose(line: str) -> bool:
    first = line[:1]
    return (first.isupper() or first in "*-") and not set(line) & set("=[]{}") and len(line.split()) > 2


def _summary(source: str, tree: ast.Module, entry: EntryPoint) -> str:
    """What the author says that the policy does: the first line of its docstring or its first comment."""
    own = ast.get_docstring(find_function(tree, entry.name)) if entry.form == "function" else None
    texts = [(text or "").strip() for text in (own, ast.get_docstring(tree))]
    comment = source.lstrip().split("\n")[0]
    texts.append(comment.lstrip("# ") if comment.startswith("#") else "")
    return clean_text(next(filter(None, texts), "").split("\n")[0].strip(), MAX_SUMMARY)


def find_parameters(source: str, tree: ast.Module, entry: EntryPoint) -> tuple[Parameter, ...]:
    """Read the parameters off a policy that a model or a person wrote.

    In a function they are the arguments with a literal default, other than traj and scene; in a script, the
    top-level names that are assigned a literal exactly once. Unit and meaning come from the comment at the end of
    the line, or from a docstring line such as `distance: how far to shift [m]`.
    """
    held = literals(tree, entry)
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


def _comments(source: str) -> dict[int, str]:
    """Text of the comment at the end of each line that has one."""
    try:
        tokens = [t for t in tokenize.generate_tokens(io.StringIO(source).readline) if t.type == tokenize.COMMENT]
    except (tokenize.TokenError, SyntaxError):
        return {}
    return {token.start[0]: token.string[:MAX_NOTE].lstrip("#: ").strip() for token in tokens}


_NOTE = re.compile(r"^\s*(?:[-*]\s+)?[`*]{0,2}(\w+)[`*]{0,2}\s*(?:\([^()]*\))?\s*(?::|=|–|—|--)\s*(\S.*)$")
_BRACKETS = re.compile(r"\s*\[([^\[\]]{1,16})\]")
_PARENTHESES = re.compile(r"\s*\(([^()]{1,16})\)")
_COUNTS = frozenset("1/m waypoints points steps index factor ratio fraction unitless - 0-1 0..1".split())
"""What stands where a unit would, besides those that `units` knows."""


def _notes(text: str) -> dict[str, str]:
    """Lines such as `name: text` or `name (float): text`."""
    found = filter(None, (_NOTE.match(line[:MAX_NOTE]) for line in reversed(text.split("\n"))))
    return {match[1]: match[2].strip() for match in found}  # of several, the first counts


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


_HARMLESS = MODULES | {"time", "datetime", "logging", "pprint"}
_MUTATORS = frozenset({"pop", "append", "extend", "insert", "remove", "update", "sort", "popleft", "add", "clear"})
_GIVEN_MODULES = {"numpy": "np", "math": "math"}
_INDENTED_COMMENT = re.compile(r"\s+#")


def clean(source: str) -> tuple[str, tuple[int, ...]]:
    """Remove what a policy does not need.

    That is: imports of what is provided anyway, dummies of `get_trajectory` and `detect_objects`, the demo of a
    function, prints, and code that is never reached.

    Returns:
        What is left, and for each line of it its number in the source, counted from 1.

    Raises:
        PolicyRejected: If the source is not Python or holds no policy.
    """
    tree = parse_tree(source)
    entry = entry_of(tree)
    page = _Page(source, tree)
    surplus = _surplus(source, tree, entry)
    _drop(tree.body, surplus, page, is_module=True)
    cleaned = page.rest()
    try:
        if entry_of(parse_tree(cleaned[0])).form == entry.form:
            return cleaned
    except PolicyRejected:
        pass
    return _Page(source, tree).rest()


def _drop(body: list[ast.stmt], surplus: set[ast.stmt], page: _Page, *, is_module: bool) -> None:
    """Take the surplus statements of a body, and of the bodies in it, off the page."""
    dead = set(_unreachable(body))
    going = {s for s in body if (s in surplus or s in dead or _is_idle_print(s)) and page.owns(s)}
    empty = len(going) == len(body) and not is_module
    for statement in body:
        if statement in going:
            page.remove(statement, instead="pass" if empty and statement is body[0] else None)
        else:
            for inner in _bodies(statement):
                _drop(inner, surplus, page, is_module=False)


def _bodies(statement: ast.stmt) -> Iterator[list[ast.stmt]]:
    for part in (statement, *getattr(statement, "handlers", ()), *getattr(statement, "cases", ())):
        lists = (value for _, value in ast.iter_fields(part) if isinstance(value, list))
        yield from (inner for inner in lists if inner and isinstance(inner[0], ast.stmt))


def _unreachable(body: list[ast.stmt]) -> list[ast.stmt]:
    tail = [*dropwhile(lambda s: not isinstance(s, ast.Return | ast.Raise | ast.Break | ast.Continue), body)][1:]
    generator = any(isinstance(n, ast.Yield | ast.YieldFrom) for s in tail for n in ast.walk(s))
    return [] if generator else tail


def _is_idle_print(statement: ast.stmt) -> bool:
    """Whether a statement is a print whose arguments do nothing."""
    match statement:
        case ast.Expr(value=ast.Call(func=ast.Name(id="print")) as call):
            return not any(map(_acts, ast.walk(call)))
    return False


def _acts(node: ast.AST) -> bool:
    """Whether an expression may do more than have a value."""
    match node:
        case ast.NamedExpr() | ast.Await() | ast.Yield() | ast.YieldFrom():
            return True
        case ast.Name(id=name):
            return name in REASONS or name == "next"
        case ast.Attribute(attr=name):
            return name in _MUTATORS or refusal(name) is not None
    return False


def _surplus(source: str, tree: ast.Module, entry: EntryPoint) -> set[ast.stmt]:
    """Statements that a policy can do without, other than prints and dead code."""
    guards = [s for s in tree.body if _is_main_guard(s)]
    outside = {name for s in tree.body if s not in guards for name in bound_names(s)}
    surplus: set[ast.stmt] = set(guards if entry.form == "function" or RESULT in outside else [])
    surplus |= {s for s in tree.body if _is_dummy(s)}
    if entry.form == "function":
        surplus |= _demo(source, tree, entry, surplus)
    return surplus | _surplus_imports(tree, surplus)


def _surplus_imports(tree: ast.Module, gone: set[ast.stmt]) -> set[ast.stmt]:
    """The imports of what is given, and at the top level those that nothing left of the policy uses."""
    used = set[str]().union(*(names_in(s) for s in tree.body if s not in gone))
    rebound, top = _rebound(tree), set(tree.body)
    imports = [node for node in ast.walk(tree) if isinstance(node, ast.Import | ast.ImportFrom)]
    return {node for node in imports if _is_given(node, rebound) or (node in top and _is_idle_import(node, used))}


def _is_main_guard(statement: ast.stmt) -> bool:
    return (
        isinstance(statement, ast.If)
        and not statement.orelse
        and any(isinstance(n, ast.Name) and n.id == "__name__" for n in ast.walk(statement.test))
    )


def _is_dummy(statement: ast.stmt) -> bool:
    match statement:
        case ast.FunctionDef(name=name) | ast.Assign(targets=[ast.Name(id=name)], value=ast.Lambda()):
            return name in SCRIPT_CALLS
    return False


def _demo(source: str, tree: ast.Module, entry: EntryPoint, gone: set[ast.stmt]) -> set[ast.stmt]:
    """Top-level statements that the entry of a function-form policy does not depend on."""
    statements = [s for s in tree.body if s not in gone]
    scopes = _scopes(source)
    binders: dict[str, list[ast.stmt]] = {}
    for statement in statements:
        for name in _touched(statement):
            binders.setdefault(name, []).append(statement)
    start: list[ast.stmt | str] = [entry.name, *(s for s in statements if _must_stay(s))]

    def follow(node: ast.stmt | str) -> Iterable[ast.stmt | str]:
        return binders.get(node, ()) if isinstance(node, str) else _reads(node, scopes)

    kept = reached(start, follow)
    return {s for s in statements if s not in kept and not isinstance(s, ast.Import | ast.ImportFrom)}


_Scopes = dict[tuple[str, int], symtable.SymbolTable]


def _scopes(source: str) -> _Scopes:
    """The symbol tables of the top-level functions and classes, by name and line."""
    try:
        table = symtable.symtable(source, "<policy>", "exec")
    except SyntaxError as error:
        raise PolicyRejected(f"this is not valid Python: {error.msg}", line=error.lineno) from None
    except (RecursionError, MemoryError, ValueError):
        raise PolicyRejected("this is nested too deeply; write it simpler") from None
    return {(scope.get_name(), scope.get_lineno()): scope for scope in table.get_children()}


def _reads(statement: ast.stmt, scopes: _Scopes) -> set[str]:
    """Top-level names that a statement may read when it runs, or its function when it is called."""
    parts: list[ast.AST] = [statement]
    found = set[str]()
    scope = scopes.get((getattr(statement, "name", ""), statement.lineno))
    if scope is not None and isinstance(statement, ast.FunctionDef | ast.ClassDef):
        parts = [part for part in ast.iter_child_nodes(statement) if part not in statement.body]
        tables = [scope]
        for table in tables:
            tables += table.get_children()
            found |= {s.get_name() for s in table.get_symbols() if s.is_referenced() and s.is_global()}
    found |= {n.id for p in parts for n in ast.walk(p) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
    return found


def _touched(statement: ast.stmt) -> set[str]:
    """Names that a top-level statement binds or, short of an assignment, may change by calling their methods."""
    bound = set(bound_names(statement))
    if isinstance(statement, ast.Assign | ast.AnnAssign | ast.FunctionDef | ast.ClassDef):
        return bound
    called = [node.func for node in ast.walk(statement) if isinstance(node, ast.Call)]
    owners = {root_name(function) or "" for function in called if isinstance(function, ast.Attribute)}
    return bound | (owners - {"", *_GIVEN_MODULES.values()})


def _must_stay(statement: ast.stmt) -> bool:
    """Docstrings, errors raised on purpose, and seeds."""
    match statement:
        case ast.Expr(value=ast.Constant()) | ast.Raise():
            return True
        case ast.Expr(value=ast.Call(func=function)):
            return ast.unparse(function) in ("np.random.seed", "random.seed", "np.seterr", "numpy.random.seed")
    return False


def _rebound(tree: ast.Module) -> set[str]:
    """Names that something other than an import binds, or that an import binds to something unusual."""
    kinds = ast.Name | ast.FunctionDef | ast.ClassDef | ast.arg
    return {name for node in ast.walk(tree) if isinstance(node, kinds) for name in own_bindings(node)}


def _is_given(node: ast.Import | ast.ImportFrom, rebound: set[str]) -> bool:
    """Whether an import only repeats what every policy is given."""
    if isinstance(node, ast.Import):
        given = {(alias.name, alias.asname or alias.name) for alias in node.names}
        return given <= _GIVEN_MODULES.items() and rebound.isdisjoint(name for _, name in given)
    root, names = (node.module or "").split(".")[0], [alias.name for alias in node.names]
    if root == "__future__":
        return set(names) == {"annotations"}
    if node.level == 0 and (root in sys.stdlib_module_names or root in ("numpy", "scipy")):
        return False
    if root in ("ovita", "toolkit") and names == ["*"]:
        return True
    renamed = any(alias.asname not in (None, alias.name) for alias in node.names)
    return not renamed and PROVIDED.issuperset(names) and rebound.isdisjoint(names)


def _is_idle_import(node: ast.Import | ast.ImportFrom, used: set[str]) -> bool:
    """Whether an import is of something harmless that nothing uses."""
    if any((alias.asname or alias.name.split(".")[0]) in used or alias.name == "*" for alias in node.names):
        return False
    names = [a.name for a in node.names] if isinstance(node, ast.Import) else [node.module or ""]
    roots = [name.split(".")[0] for name in names]
    return all(root in _HARMLESS or root not in sys.stdlib_module_names for root in roots)


@dataclass
class _Page:
    """The lines of a source, some of them struck out."""

    source: str
    tree: ast.Module
    gone: set[int] = field(default_factory=set)
    instead: dict[int, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.lines = self.source.split("\n")
        spans = {
            (node.lineno, node.end_lineno or node.lineno)
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Constant | ast.JoinedStr) and isinstance(getattr(node, "value", ""), str | bytes)
        }
        self.text = {number for first, last in spans for number in range(first, last)}

    def owns(self, statement: ast.stmt) -> bool:
        """Whether no other statement shares the statement's lines."""
        first, last = _span(statement)
        before = self.lines[first - 1].encode()[: statement.col_offset]
        after = self.lines[last - 1].encode()[statement.end_col_offset :].strip()
        return not before.strip() and (not after or after.startswith(b"#"))

    def remove(self, statement: ast.stmt, *, instead: str | None) -> None:
        """Strike a statement out, with the comments that introduce it or trail in it."""
        first, last = _span(statement)
        if instead is not None:
            self.instead[first] = " " * statement.col_offset + instead
        if isinstance(statement, ast.If | ast.FunctionDef) and statement.col_offset == 0:
            while last < len(self.lines) and _INDENTED_COMMENT.match(self.lines[last]):
                last += 1
            while first > 1 and self.lines[first - 2].startswith("#"):
                first -= 1
        self.gone |= set(range(first, last + 1)) - self.instead.keys()

    def rest(self) -> tuple[str, tuple[int, ...]]:
        """What is left, without runs of more than two blank lines, and the numbers of its lines."""
        kept: list[tuple[int, str]] = []
        blanks, most = 0, 2
        for number, line in enumerate(self.lines, start=1):
            if number in self.gone:
                most = 1 if blanks else most
                continue
            line = self.instead.get(number, line if number in self.text else line.rstrip())
            if line or number in self.text:
                blanks, most = 0, 2
            elif not kept or blanks >= most:
                continue
            else:
                blanks += 1
            kept.append((number, line))
        while kept and not kept[-1][1]:
            kept.pop()
        return "\n".join(line for _, line in kept) + "\n", tuple(number for number, _ in kept)


def _span(statement: ast.stmt) -> tuple[int, int]:
    """First and last line of a statement, its decorators included."""
    decorators = getattr(statement, "decorator_list", [])
    return min([statement.lineno, *(d.lineno for d in decorators)]), statement.end_lineno or statement.lineno
