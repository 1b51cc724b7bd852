"""What a language model is asked to answer with, and reading whatever it answered instead.

Models that follow a JSON schema answer with an `Answer`. All others answer in the paper's own format, a plan and a
fenced block of code in prose, or with JSON somewhere in prose; `read_answer` makes an `Answer` of these too.
"""

from __future__ import annotations

import json
import re
from itertools import islice
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, ValidationError, WithJsonSchema, field_validator
from pydantic_core import from_json

from ovita.writers.base import Reply, WriterInfo

_KEYS = ("code", "plan", "question", "not_understood")
_PYTHON = ("", "python", "py", "python3")
_NOTHING = frozenset({"", "none", "null", "nothing", "no", "n/a", "na", "-", "[]"})
_FENCE = re.compile(r"[ \t]*(?:```|~~~)[ \t]*([\w+-]*)")
_THOUGHTS = re.compile(r"<(think|thinking|reasoning)>.*?</\1>", re.DOTALL | re.IGNORECASE)
_MARKER = re.compile(r"^\s*(?:(?:step\s*)?\d+\s*[.):]|[-*•])\s+", re.IGNORECASE)
_LABEL = re.compile(
    r"^[\s#*_]*(high[- ]level plan|plan|code|policy|assumptions?|contacts?|questions?|not understood|explanation)"
    r"[\s*_]*(?::[\s*_]*(.*))?$",
    re.IGNORECASE,
)
_POLICY_START = re.compile(r"^(?:def adapt\(|(?:\w+\s*=\s*)?(?:get_trajectory|detect_objects)\()", re.MULTILINE)
_TOP_LEVEL_CODE = re.compile(
    r"^(?:\s|$|[)\]}@#]|(?:def|for|if|elif|else|while|return|import|from|with)\b|\w[\w., ]*=|\w+\()"
)


# Without a bound a small model whose output is held to the schema can add list items until it is cut off. It is part
# of the schema only: a longer list that comes anyway is welcome.
_AT_MOST_EIGHT = WithJsonSchema({"type": "array", "items": {"type": "string"}, "maxItems": 8})


class Answer(BaseModel):
    """The answer to a request for a trajectory change."""

    model_config = ConfigDict(use_attribute_docstrings=True, extra="ignore", frozen=True)

    plan: Annotated[list[str], _AT_MOST_EIGHT]
    """The high-level plan: a few short steps."""
    code: str
    """The whole Python source of the policy, without fences; empty if you ask back or did not understand."""
    assumptions: Annotated[list[str], _AT_MOST_EIGHT]
    """What you assumed because the instruction leaves it open."""
    contacts: Annotated[list[str], _AT_MOST_EIGHT]
    """Names of the objects that are to be touched or passed through."""
    question: str | None
    """One question back, only if the instruction has two readings that matter."""
    not_understood: Annotated[list[str], _AT_MOST_EIGHT]
    """The words of the instruction that cannot be placed."""

    @field_validator("plan", "assumptions", "contacts", "not_understood", mode="before")
    @classmethod
    def _as_lines(cls, value: object) -> list[str]:
        items = value if isinstance(value, list) else [] if value is None else str(value).split("\n")
        lines = (_MARKER.sub("", item if isinstance(item, str) else _plain(item)).strip() for item in items)
        said = [line for line in lines if line.lower().rstrip(".") not in _NOTHING]
        return [line for i, line in enumerate(said) if i == 0 or line != said[i - 1]]

    @field_validator("code", mode="before")
    @classmethod
    def _without_fences(cls, value: object) -> str:
        text = "\n".join(map(str, value)) if isinstance(value, list) else str(value or "")
        return (_fenced(text) or text).strip("\n").rstrip() if text.strip().lower() not in _NOTHING else ""

    @field_validator("question", mode="before")
    @classmethod
    def _asked(cls, value: object) -> str | None:
        text = " ".join(str(value or "").split())
        return None if text.lower().rstrip(".") in _NOTHING else text

    def reply(self, writer: WriterInfo) -> Reply | None:
        """Return the reply that this answer amounts to, or None if it has neither code nor question nor words.

        Code outweighs a question: the question is then kept as an open assumption, so that nothing is hidden.
        """
        plan, unplaced = tuple(self.plan), tuple(self.not_understood)
        assumptions, contacts = tuple(self.assumptions), tuple(self.contacts)
        if self.code:
            if self.question:
                assumptions += (f"left open: {self.question}",)
            return Reply("policy", plan, self.code, assumptions, "", unplaced, contacts, writer)
        if self.question:
            return Reply("question", plan, "", assumptions, self.question, unplaced, contacts, writer)
        return Reply("not_understood", plan, unplaced=unplaced, writer=writer) if unplaced else None


def read_answer(text: str, *, truncated: bool = False) -> Answer | None:
    """Read a model's answer from text: JSON, JSON in prose, or a plan and a fenced block of code.

    Args:
        text: What the model wrote.
        truncated: Whether it was cut off; then only what is complete in it counts.

    Returns:
        The answer, or None if there is no code, no question and no word that could not be placed.
    """
    text = _THOUGHTS.sub("", text).replace("\r\n", "\n").strip()
    data = _json_in(text, truncated=truncated)
    answer = answer_from(data) if data is not None else _from_prose(text, truncated=truncated)
    return answer if answer is not None and answer.reply(WriterInfo("")) is not None else None


def answer_from(data: dict[str, Any]) -> Answer | None:
    """Read an answer from a JSON object, forgiving missing keys and texts in place of lists."""
    empty = dict.fromkeys(("plan", "code", "assumptions", "contacts", "question", "not_understood"))
    try:
        return Answer.model_validate({**empty, **data})
    except ValidationError:
        return None


def _plain(item: object) -> str:
    if isinstance(item, dict):
        return " ".join(str(value) for value in item.values() if isinstance(value, str | int | float))
    return str(item)


def _json_in(text: str, *, truncated: bool) -> dict[str, Any] | None:
    decoder = json.JSONDecoder(strict=False)
    for start in (match.start() for match in islice(re.finditer(r"\{\s*\"", text), 100)):
        try:
            found = decoder.raw_decode(text, start)[0]
        except (json.JSONDecodeError, RecursionError):
            continue
        if isinstance(found, dict) and any(key in found for key in _KEYS):
            return found
    if truncated and text.startswith("{"):
        try:
            found = from_json(text, allow_partial=True)
        except ValueError:
            return None
        if isinstance(found, dict) and isinstance(found.get("code"), list) and next(reversed(found)) == "code":
            del found["code"]  # the list of its lines may lack some
        return found if isinstance(found, dict) else None
    return None


def _from_prose(text: str, *, truncated: bool) -> Answer | None:
    code = _fenced(text, truncated=truncated) or ("" if truncated else _unfenced(text))
    prose = _blocks(text)[1]
    if truncated:
        prose = prose.rpartition("\n")[0]
    if code:
        prose = prose.replace(code, "\nCode:\n")
    sections = _sections(prose)
    lead = [line for line in sections.get("", []) if _MARKER.match(line)]
    question = " ".join(sections.get("question", []))
    if not code and not question:
        asked = [said for said in re.split(r"(?<=[.?!])\s|\n", prose) if said.endswith("?")]
        question = asked[-1].strip() if asked else ""
    return answer_from(
        {
            "plan": sections.get("plan") or lead,
            "code": code,
            "assumptions": _split(sections.get("assumption", []), ";"),
            "contacts": _split(sections.get("contact", []), ","),
            "question": question,
            "not_understood": _split(sections.get("not understood", []), ","),
        }
    )


def _fenced(text: str, *, truncated: bool = False) -> str:
    """Return the block of code that looks most like a policy, or ""."""
    blocks = [body for language, body in _blocks(text, truncated=truncated)[0] if language in _PYTHON]
    policies = [body for body in blocks if "def adapt" in body or "modified_trajectory" in body]
    return max(policies or blocks, key=len, default="").strip("\n").rstrip()


def _blocks(text: str, *, truncated: bool = False) -> tuple[list[tuple[str, str]], str]:
    """Split a text into its fenced blocks, each with its language, and the prose around them.

    A last block that is never closed counts too, unless the text was cut off.
    """
    blocks: list[tuple[str, str]] = []
    prose: list[str] = []
    body: list[str] | None = None
    language = ""
    for line in text.split("\n"):
        fence = _FENCE.match(line)
        if body is None and fence:
            body, language = [], fence[1].lower()
            prose.append("Code:")
        elif body is not None and fence and not fence[1]:
            blocks.append((language, "\n".join(body)))
            body = None
        else:
            (prose if body is None else body).append(line)
    if body is not None and not truncated:
        blocks.append((language, "\n".join(body)))
    return blocks, "\n".join(prose)


def _unfenced(text: str) -> str:
    match = _POLICY_START.search(text)
    if match is None:
        return ""
    lines: list[str] = []
    for line in text[match.start() :].split("\n"):
        if _LABEL.match(line) or not _TOP_LEVEL_CODE.match(line):
            break
        lines.append(line)
    return "\n".join(lines).rstrip()


def _sections(prose: str) -> dict[str, list[str]]:
    sections: dict[str, list[str]] = {"": []}
    title = ""
    for line in prose.split("\n"):
        label = _LABEL.match(line) if len(line) < 1000 else None
        if label:
            title = label[1].lower().rstrip("s").replace("high-level ", "").replace("high level ", "")
            line = label[2] or ""
        if line.strip():
            sections.setdefault(title, []).append(line.strip())
    return sections


def _split(lines: list[str], separator: str) -> list[str]:
    return [part.strip() for line in lines for part in _MARKER.sub("", line).split(separator)]
