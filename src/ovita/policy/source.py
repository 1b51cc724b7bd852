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
from ovita.policy.frames import MAX_MESSAGE, clean_text
from ovita.policy.parameters import find_parameters
from ovita.policy.policy import Policy
from ovita.policy.syntax import MAX_SOURCE, NO_POLICY, Entry, entry_of, find_function, parse_tree

_CODE = re.compile(r"(import |from [\w.]+ import|def \w+|class \w+|@\w|#|\"\"\"|[A-Za-z_][\w.,\[\] ]*=[^=]|for |if )")
MAX_SUMMARY = 300
"""Most characters of a summary."""

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
    reading = read_unchecked(text)
    try:
        check(reading.policy.source)
    except PolicyRejected as rejected:
        raise _told(rejected, reading.line(rejected.line)) from None
    return reading


def read_unchecked(text: str) -> Reading:
    """Read a policy without the allowlist check, for tests of the sandbox.

    Raises:
        PolicyRejected: If there is none, or it is not Python.
    """
    try:
        cleaned = clean(extract(text))
        tree = parse_tree(cleaned.source)
        entry = entry_of(tree)
        parameters = find_parameters(cleaned.source, tree, entry)
    except PolicyRejected as rejected:
        raise _told(rejected, rejected.line) from None
    policy = Policy(cleaned.source, entry.form, parameters, _summary(cleaned.source, tree, entry))
    return Reading(policy, cleaned.lines)


def _told(rejected: PolicyRejected, line: int | None) -> PolicyRejected:
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
    for code in _candidates(text):
        try:
            entry_of(parse_tree(code))
            return code
        except PolicyRejected as rejected:
            if problem is None or (problem.problem == NO_POLICY and rejected.problem != NO_POLICY):
                problem = rejected
    raise problem or PolicyRejected(NO_POLICY)


def _candidates(text: str) -> Iterator[str]:
    blocks = [(language, _dedented(code)) for language, code in _blocks(text)]
    python = [code for language, code in blocks if language in _PYTHON]
    yield from reversed(python)
    if len(python) > 1:
        yield "\n\n".join(python)
    if not blocks:
        code = _dedented(text)
        yield code
        yield _without_prose(code)
    yield from (code for language, code in blocks if language not in _PYTHON)


def _blocks(text: str) -> Iterator[tuple[str, str]]:
    """The blocks between fences of ``` or ~~~, with their language in lower case; the last need not be closed."""
    fence, language, code = "", "", list[str]()
    for line in text.split("\n"):
        mark = line.strip()
        if not fence:
            if mark.startswith(("```", "~~~")):
                rest = mark.lstrip(mark[0])
                fence, language, code = mark[: len(mark) - len(rest)], rest.strip().lower()[:20], []
        elif mark.startswith(fence) and not mark.strip(fence[0]):
            yield language.split(" ")[0], "\n".join(code) + "\n"
            fence = ""
        else:
            code.append(line)
    if fence:
        yield language.split(" ")[0], "\n".join(code)


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


def _summary(source: str, tree: ast.Module, entry: Entry) -> str:
    """What the author says that the policy does: the first line of its docstring or its first comment."""
    texts = [ast.get_docstring(tree)]
    if entry.form == "function":
        texts.insert(0, ast.get_docstring(find_function(tree, entry.name)))
    for text in texts:
        if text and text.strip():
            return clean_text(text.strip().split("\n")[0].strip(), MAX_SUMMARY)
    first = source.lstrip().split("\n")[0]
    return clean_text(first.lstrip("# ").strip(), MAX_SUMMARY) if first.startswith("#") else ""
