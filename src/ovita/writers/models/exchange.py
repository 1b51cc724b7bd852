"""One exchange with a language model: the request, the parser of its reply, and the base writer.

Models that follow a JSON schema answer with an `Answer`. All others answer in the paper's own format, a plan and a
fenced block of code in prose, or with JSON somewhere in prose; `read_answer` makes an `Answer` of these too.
"""

from __future__ import annotations

import json
import re
from abc import ABC, abstractmethod
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import islice, takewhile
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError, WithJsonSchema, field_validator
from pydantic_core import from_json

from ovita.errors import RequestError, UnusableReply, WriterError
from ovita.policy.reading import PYTHON, fenced
from ovita.text import harmless
from ovita.writers.base import Prompt, Reply, WriterInfo, WritingBudget

Form = Literal["native", "tool", "text"]
"""How an answer is asked for: JSON that follows a schema, the arguments of a tool, or plain text."""


_FORM_NOTES: dict[Form, str] = {
    "native": (
        "Give the answer as one JSON object with the keys plan (list of steps), code (the whole Python source as one"
        " string, without fences), assumptions (list), contacts (list of object names), question (text or null) and"
        " not_understood (list of words). The examples show these contents one below the other."
    ),
    "tool": (
        "Give the answer by calling the tool `answer` once; `code` is the whole Python source, without fences."
        " The examples show its arguments one below the other."
    ),
    "text": (
        "Give the answer in the form of the examples: Plan, Code in one fenced block, Assumptions, Contacts."
        ' Instead of code you may write one line "Question: ..." or "Not understood: the words".'
    ),
}


@dataclass(frozen=True)
class ModelRequest:
    """One request to a model.

    Args:
        instructions: The system prompt.
        turns: Person, model, person, ...; the last one is the person's.
        form: The requested form of the answer.
        structured: Whether an `Answer` is wanted, not plain text.
        temperature: Sampling temperature, or None for the model's own.
        max_tokens: Longest answer [tokens].
        functions: Whether the policy is to call the toolkit's functions, not the paper's script.
        pictures: PNG files that go with the last turn, for models that see.
    """

    instructions: str
    turns: tuple[str, ...]
    form: Form
    structured: bool
    temperature: float | None
    max_tokens: int
    functions: bool = False
    pictures: tuple[bytes, ...] = ()

    @property
    def system(self) -> str:
        """The instructions, with the notes for the form of the answer."""
        notes = (self.instructions, _FORM_NOTES[self.form]) if self.structured else (self.instructions,)
        return "\n".join(note.rstrip() for note in notes)


@dataclass(frozen=True)
class Exchange:
    """A model's raw answer, with the request that was finally sent."""

    ask: ModelRequest
    model: str
    text: str
    arguments: dict[str, Any] | None
    truncated: bool
    refusal: str | None
    input_tokens: int
    output_tokens: int


LARGE_FROM = 7.0
"""From so many parameters on a model is shown the whole toolkit; smaller ones read long rules slowly [10^9]."""

_SIZE = re.compile(r"(?<![A-Za-z0-9.])(?:(\d+)x)?(\d+(?:\.\d+)?)b(?![A-Za-z0-9])", re.IGNORECASE)


def billions(name: str) -> float | None:
    """How many parameters a model's name says [10^9], such as 7.6 of "qwen-7.6b" and 56 of "8x7B"; None if none."""
    sizes = [float(count or 1) * float(size) for count, size in _SIZE.findall(name)]
    return max(sizes, default=None)


def on_one_line(text: str) -> str:
    """A text on one line, cut to 200 characters."""
    line = " ".join(text.split())
    return line if len(line) <= 200 else line[:197] + "..."


class ModelWriter(ABC):
    """A chat model as a policy writer.

    Args:
        name: As on the command line, such as "openai:gpt-5".
        form: The form of answers requested first.
        temperature: Sampling temperature.
        max_tokens: Longest answer [tokens].
    """

    def __init__(self, name: str, form: Form, temperature: float, max_tokens: int) -> None:
        if not 0.0 <= temperature <= 2.0:
            raise RequestError(f"the temperature {temperature:g} is out of range; use 0 to 2")
        self.name, self._form, self._temperature, self._max_tokens = name, form, temperature, max_tokens
        self._large = True

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self.name!r})"

    @abstractmethod
    def exchange(self, ask: ModelRequest, budget: WritingBudget) -> Exchange:
        """Send a request to the model and return its raw answer.

        Raises:
            WriterError: If there was no answer, for example because the time was up.
        """

    def write(self, prompt: Prompt) -> Reply:
        """Answer a prompt; earlier attempts are shown to the model as its own, each with its error.

        Raises:
            MissingKey: If the provider needs a key and none is set; nothing was sent.
            UnusableReply: If the answer is empty, cut off, or has neither a policy nor a question.
            WriterError: If no answer could be had.
        """
        prompt = prompt.for_model(self._large)
        turns = [prompt.situation]
        for attempt in prompt.attempts:
            error = harmless(attempt.error)
            if attempt.code.strip():
                turns.append(f"```python\n{attempt.code.strip()}\n```")
                turns.append(f"Your policy failed: {error}\nAnswer again with the whole corrected policy.")
            else:
                turns[-1] += f"\nYour last answer could not be used: {error}"
        asked = prompt.fixed, tuple(turns), self._form, True, self._temperature, self._max_tokens, prompt.style.toolkit
        ask = ModelRequest(*asked)
        done = self.exchange(ask, prompt.budget)
        info = WriterInfo("llm", done.model, done.ask.temperature, done.input_tokens, done.output_tokens)
        answer = None if done.refusal is not None else _read(done)
        reply = answer.reply(info) if answer is not None else None
        if reply is None:
            raise self._unusable(done)
        scene = prompt.request.scene
        return replace(reply, contacts=tuple(name for name in reply.contacts if name in scene))

    def complete(
        self,
        instructions: str,
        question: str,
        *,
        temperature: float,
        max_tokens: int,
        budget: WritingBudget | None = None,
    ) -> str:
        """Return the model's plain-text answer to one question.

        Raises:
            MissingKey: If the provider needs a key and none is set.
            WriterError: If no complete answer could be had.
        """
        done = self.exchange(
            ModelRequest(instructions, (question,), "text", False, temperature, max_tokens), budget or WritingBudget()
        )
        if done.text.strip() and not done.truncated and done.refusal is None:
            return done.text.strip()
        raise self._unusable(done)

    def shown(self, text: str) -> str:
        """Return a model's text on one line and shortened, for a message."""
        return on_one_line(text)

    def _no_answer(self, why: str, budget: WritingBudget) -> WriterError:
        """The error for an exchange that timed out or was cancelled."""
        if budget.cancelled:
            return WriterError(f"{self.name}: stopped on request")
        return WriterError(f"{self.name}: {why}", "no_answer")

    def _unusable(self, done: Exchange) -> WriterError:
        if done.refusal is not None:
            said = self.shown(done.refusal)
            why = f"the model refused to answer{f' ({said})' if said else ''}; rephrase the instruction"
            return WriterError(f"{self.name}: {why}")
        if done.truncated:
            why = f"the answer was cut off after {done.output_tokens} tokens; raise max_tokens or use another model"
        elif not done.text.strip():
            why = "the model gave an empty answer; try again or use another model"
        else:
            said = self.shown(done.text)
            why = f"the answer has neither a policy nor a question; try again or use another model (it began: {said!r})"
        return UnusableReply(f"{self.name}: {why}")


def _read(done: Exchange) -> Answer | None:
    arguments = None if done.truncated else done.arguments
    answer = None if arguments is None else _useful(answer_from(arguments))
    return answer or read_answer(done.text, truncated=done.truncated)


# Reading answers

_KEYS = {"code", "plan", "question", "not_understood"}
_NOTHING = frozenset({"", "none", "null", "nothing", "no", "n/a", "na", "-", "[]"})
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

    If the text was cut off, only what is complete in it counts. None if there is no code, no question and no word that
    could not be placed.
    """
    text = _THOUGHTS.sub("", text).replace("\r\n", "\n").strip()
    data = _json_in(text, truncated=truncated)
    return _useful(answer_from(data) if data is not None else _from_prose(text, truncated=truncated))


def _useful(answer: Answer | None) -> Answer | None:
    """The answer, if it has code, a question or words that could not be placed."""
    return answer if answer is not None and answer.reply(WriterInfo("")) is not None else None


def answer_from(data: dict[str, Any]) -> Answer | None:
    """Read an answer from a JSON object, forgiving missing keys and texts in place of lists."""
    try:
        return Answer.model_validate({**dict.fromkeys(Answer.model_fields), **data})
    except ValidationError:
        return None


def _plain(item: object) -> str:
    if isinstance(item, dict):
        return " ".join(str(value) for value in item.values() if isinstance(value, str | int | float))
    return str(item)


def _json_in(text: str, *, truncated: bool) -> dict[str, Any] | None:
    found: dict[str, Any]
    decoder = json.JSONDecoder(strict=False)
    for match in islice(re.finditer(r"\{\s*\"", text), 100):
        with suppress(json.JSONDecodeError, RecursionError):
            found = decoder.raw_decode(text, match.start())[0]
            if _KEYS & found.keys():
                return found
    if not truncated or not text.startswith("{"):
        return None
    try:
        found = from_json(text, allow_partial=True)
    except ValueError:
        return None
    if isinstance(found.get("code"), list) and next(reversed(found)) == "code":
        del found["code"]  # the list of its lines may lack some
    return found


def _from_prose(text: str, *, truncated: bool) -> Answer | None:
    code = _fenced(text, truncated=truncated) or ("" if truncated else _unfenced(text))
    prose = fenced(text)[1]
    if truncated:
        prose = prose.rpartition("\n")[0]
    if code:
        prose = prose.replace(code, "\nCode:\n")
    sections = _sections(prose)
    lead = [line for line in sections.get("", []) if _MARKER.match(line)]
    question = " ".join(sections.get("question", []))
    if not code and not question:
        asked = [sentence.strip() for sentence in re.split(r"(?<=[.?!])\s|\n", prose) if sentence.endswith("?")]
        question = "".join(asked[-1:])
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
    """Return the block of code that looks most like a policy, or ""; an open one counts unless the text was cut off."""
    found = [block for block in fenced(text)[0] if block.closed or not truncated]
    blocks = [block.code for block in found if block.language in PYTHON]
    policies = [body for body in blocks if "def adapt" in body or "modified_trajectory" in body]
    return max(policies or blocks, key=len, default="").strip("\n").rstrip()


def _unfenced(text: str) -> str:
    match = _POLICY_START.search(text)
    if match is None:
        return ""
    lines = text[match.start() :].split("\n")
    return "\n".join(takewhile(lambda line: _TOP_LEVEL_CODE.match(line) and not _LABEL.match(line), lines)).rstrip()


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
