"""From a model's reply to a policy: finding the code, cleaning it, checking it, reading its parameters."""

from __future__ import annotations

import ast
import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass

from ovita.errors import PolicyRejected
from ovita.policy.check import check
from ovita.policy.clean import clean
from ovita.policy.parameters import find_parameters
from ovita.policy.policy import Policy
from ovita.policy.syntax import MAX_SOURCE, NO_POLICY, Entry, entry_of, find_function, parse_tree

_FENCE = re.compile(r"^[ \t]*(```+|~~~+)[ \t]*([\w+-]*)[^\n]*\n(.*?)(?:^[ \t]*\1[ \t]*$|\Z)", re.MULTILINE | re.DOTALL)
_CODE = re.compile(r"(import |from [\w.]+ import|def \w+|class \w+|@\w|#|\"\"\"|[A-Za-z_][\w.,\[\] ]*=[^=]|for |if )")
_PROSE = re.compile(r"[A-Z*-][^=\[\]{}]*\s[^=\[\]{}]*\s[^=\[\]{}]*$")
_PYTHON = ("python", "py", "python3", "")


@dataclass(frozen=True)
class Reading:
    """A policy and where its lines came from.

    Args:
        policy: The policy.
        lines: For each line of its source, its number in the code that was read, counted from 1.
    """

    policy: Policy
    lines: tuple[int, ...]

    def line(self, number: int | None) -> int | None:
        """Number in the code that was read of a line of the policy's source."""
        return self.lines[number - 1] if number is not None and 1 <= number <= len(self.lines) else None


def parse(text: str) -> Policy:
    """Read a policy from a model's reply or from plain code.

    Args:
        text: Code, or prose with code between ``` fences. The last block that holds a policy counts.

    Raises:
        PolicyRejected: If there is no policy, it is not Python, or it contains what a policy may not. Lines count
            within the code.
    """
    return read(text).policy


def read(text: str) -> Reading:
    """Read a policy as `parse` does, and remember which line came from where.

    Raises:
        PolicyRejected: As `parse` does.
    """
    reading = _read_unchecked(text)
    try:
        check(reading.policy.source)
    except PolicyRejected as rejected:
        raise PolicyRejected(rejected.problem, line=reading.line(rejected.line)) from None
    return reading


def _read_unchecked(text: str) -> Reading:
    cleaned = clean(extract(text))
    tree = parse_tree(cleaned.source)
    entry = entry_of(tree)
    policy = Policy(
        cleaned.source,
        entry.form,
        find_parameters(cleaned.source, tree, entry),
        _summary(cleaned.source, tree, entry),
    )
    return Reading(policy, cleaned.lines)


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
    for code in _candidates(text):
        try:
            entry_of(parse_tree(code))
            return code
        except PolicyRejected as rejected:
            if problem is None or (problem.problem == NO_POLICY and rejected.problem != NO_POLICY):
                problem = rejected
    raise problem or PolicyRejected(NO_POLICY)


def _candidates(text: str) -> Iterator[str]:
    blocks = [(match[2].lower(), _dedented(match[3])) for match in _FENCE.finditer(text)]
    python = [code for language, code in blocks if language in _PYTHON]
    yield from reversed(python)
    if len(python) > 1:
        yield "\n\n".join(python)
    if not blocks:
        code = _dedented(text)
        yield code
        yield _without_prose(code)
    yield from (code for language, code in blocks if language not in _PYTHON)


def _dedented(code: str) -> str:
    first = next((line for line in code.split("\n") if line.strip()), "")
    return textwrap.dedent(code) if first[:1].isspace() else code


def _without_prose(text: str) -> str:
    """Leave out sentences before and after code that came without fences."""
    lines = text.split("\n")
    start = next((i for i, line in enumerate(lines) if _CODE.match(line)), 0)
    end = len(lines)
    while end > start and (not lines[end - 1].strip() or _PROSE.match(lines[end - 1])):
        end -= 1
    return "\n".join(lines[start:end])


def _summary(source: str, tree: ast.Module, entry: Entry) -> str:
    """What the author says that the policy does: the first line of its docstring or its first comment."""
    texts = [ast.get_docstring(tree)]
    if entry.form == "function":
        texts.insert(0, ast.get_docstring(find_function(tree, entry.name)))
    for text in texts:
        if text and text.strip():
            return text.strip().split("\n")[0].strip()
    first = source.lstrip().split("\n")[0]
    return first.lstrip("# ").strip() if first.startswith("#") else ""
