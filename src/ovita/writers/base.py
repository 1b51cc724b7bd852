"""Policy writers: what they are asked and answer, writers in line, and choosing them by name.

Phase one, grounding, makes a `Prompt` of a request; its text (`writers.prompt`) is made when a model reads it.
"""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from enum import IntEnum
from functools import cached_property
from importlib.util import find_spec
from threading import Event, Thread
from typing import Literal, Protocol, TypeVar, runtime_checkable

import ovita.plugins as plugins
from ovita.errors import MissingExtra, RequestError, WriterError, WriterFailure
from ovita.instruct.frames import SemanticFrame
from ovita.policy import Policy
from ovita.policy.sandbox import Rollout
from ovita.request import Request
from ovita.text import as_data, called_as, quoted
from ovita.toolkit import Outcome

MODEL_VARIABLE = "OVITA_MODEL"
"""Environment variable that names the configured model, such as "openai:gpt-5", or a line of them with commas."""

MAX_TOLD = 200
"""Longest step, or run of words, passed from one writer to the next [characters]."""

PROVIDERS = ("llamacpp", "openai", "anthropic", "google", "ollama")


@dataclass(frozen=True)
class WriterInfo:
    """Which writer answered, and what it cost.

    Args:
        kind: "builtin", "llm", or another writer's kind.
        model: Model name, or "".
        temperature: Sampling temperature, or None where there is none.
        input_tokens: Tokens read over all attempts.
        output_tokens: Tokens written over all attempts.
        reason: Why this writer was chosen.
        tried: Every writer tried, in order, with its outcome.
    """

    kind: str
    model: str = ""
    temperature: float | None = None
    input_tokens: int = 0
    output_tokens: int = 0
    reason: str = ""
    tried: tuple[str, ...] = ()


@dataclass(frozen=True)
class Reply:
    """What a policy writer answers: a policy, a question back, or that it did not understand.

    Args:
        kind: "policy", "question", "answer" or "not_understood".
        plan: The high-level plan, one step a line.
        code: Python source of the policy; "" unless kind is "policy".
        assumptions: What was assumed because the instruction leaves it open.
        question: The question back; "" unless kind is "question".
        answer: What was asked about the path, answered; "" unless kind is "answer".
        unplaced: The words that could not be placed.
        contacts: Names of objects that the instruction asks to touch or pass through.
        confirm: Whether a person has to agree to the policy first, because the reading is not certain.
        doubts: Why, or why it is declined, as sentences; `unplaced` are the words that the policy does not use.
        holds: What the instruction asks for and the trajectory does already, where that is all of it.
        writer: Who answered.
        policy: The policy, where its writer has it ready with its parameters; else it is read from `code`.
        frames: What the instruction was read to ask for, where the writer reads it so.
    """

    kind: Literal["policy", "question", "answer", "not_understood"]
    plan: tuple[str, ...] = ()
    code: str = ""
    assumptions: tuple[str, ...] = ()
    question: str = ""
    unplaced: tuple[str, ...] = ()
    contacts: tuple[str, ...] = ()
    writer: WriterInfo = field(default_factory=lambda: WriterInfo("unknown"))
    policy: Policy | None = None
    holds: tuple[str, ...] = ()
    confirm: bool = False
    doubts: tuple[str, ...] = ()
    frames: tuple[SemanticFrame, ...] = ()
    answer: str = ""


Failure = Literal["", "unusable", "failed", "idle", "broken", "unused"]
"""What is wrong with an attempt.

"unusable": no answer of use. "failed": the policy was refused or failed. "idle": it changed nothing. "broken": it broke
a postcondition. "unused": it does not use a number of the instruction.
"""


class Rank(IntEnum):
    """How good an attempt is, the best last: by its rank one of several writers' attempts is taken."""

    FAILED = 0
    REFUSED = 1
    QUESTION = 2
    BROKEN = 3
    """A policy that ran, but not as meant."""
    TO_CONFIRM = 4
    AS_MEANT = 5


@dataclass(frozen=True)
class Attempt:
    """One reply of a writer and its outcome.

    Args:
        reply: The answer.
        policy: The policy, if it ran.
        rollout: What it returned.
        outcomes: How its postconditions came out on what it returned, in their order.
        failure: The kind of what is wrong; "" if nothing is.
        error: The same in words, for the writer that repairs it.
        count: How many answers were asked for so far.
        by: The writer.
    """

    reply: Reply
    policy: Policy | None = None
    rollout: Rollout | None = None
    outcomes: tuple[Outcome, ...] = ()
    failure: Failure = ""
    error: str = ""
    count: int = 0
    by: PolicyWriter | None = None

    @property
    def code(self) -> str:
        """The policy's source, as it ran or as it was written."""
        return self.reply.code if self.policy is None else self.policy.source

    @property
    def rank(self) -> Rank:
        """How good what came of it is."""
        if self.policy is not None:
            return Rank.TO_CONFIRM if self.reply.confirm else Rank.BROKEN if self.failure else Rank.AS_MEANT
        if self.failure:
            return Rank.FAILED
        return Rank.QUESTION if self.reply.kind in ("question", "answer") else Rank.REFUSED

    @property
    def summary(self) -> str:
        """The outcome in a few words."""
        unplaced, expectations = quoted(self.reply.unplaced), self.rollout.expectations if self.rollout else ()
        if not self.failure and self.policy is None:
            asks = self.reply.kind == "question"
            if self.reply.answer:
                return "answers what is asked about the path"
            return f"asks: {self.reply.question}" if asks else f"could not place {unplaced or 'the instruction'}"
        ran = "its policy ran as meant"
        if self.reply.confirm:
            ran = f"asks whether it is meant without {unplaced}" if unplaced else "asks whether it is meant"
        pairs = zip(expectations, self.outcomes, strict=True) if self.outcomes else ()
        broken = [broken_promise(e.text, outcome) for e, outcome in pairs if not outcome.held]
        return " ".join([(self.error or ran).splitlines()[0], *broken])


def broken_promise(text: str, outcome: Outcome) -> str:
    """A postcondition with its measurement."""
    return f"promised: {text}; {'kept' if outcome.held else 'broken'}, measured: {outcome.sentence}"


@runtime_checkable
class PolicyWriter(Protocol):
    """Anything that answers a prompt with a plan and a policy."""

    @property
    def name(self) -> str:
        """How the writer is named on the command line, such as "builtin" or "openai:gpt-5"."""
        ...

    def write(self, prompt: Prompt) -> Reply:
        """Answer a prompt.

        Raises:
            WriterError: If no answer could be had: no key, no connection, an unusable reply.
        """
        ...


@dataclass(frozen=True)
class _Chosen:
    """A writer together with the reason for its choice, which its replies then state."""

    writer: PolicyWriter
    reason: str
    otherwise: str = ""
    """The reason for a reply without a policy, where it differs."""

    @property
    def name(self) -> str:
        return self.writer.name

    def write(self, prompt: Prompt) -> Reply:
        reply = self.writer.write(prompt)
        certain = reply.kind == "policy" and not reply.confirm
        reason = self.reason if certain else self.otherwise or self.reason
        return replace(reply, writer=replace(reply.writer, reason=reason))


@dataclass(frozen=True)
class WriterChain:
    """A named chain of writers, such as "auto", each tried when those before it had no answer.

    Generation calls the members itself, since it also sees whether a policy runs and meets its postconditions.
    """

    writers: tuple[PolicyWriter, ...]
    name: str

    def write(self, prompt: Prompt) -> Reply:
        """Answer as the first writer that has a certain policy or a question; else as the first that understood most.

        Raises:
            WriterError: If none of them could answer.
        """
        refusal: Reply | None = None
        tried: list[str] = []
        failure: WriterFailure = "other"
        for writer in self.writers:
            try:
                reply = writer.write(prompt)
            except WriterError as error:
                tried.append(f"{writer.name}: {error}")
                failure = error.failure
                continue
            tried.append(f"{writer.name}: {reply.kind.replace('_', ' ')}")
            reply = replace(reply, writer=replace(reply.writer, tried=tuple(tried)))
            if reply.kind != "not_understood" and not reply.confirm:
                return reply
            refusal = reply if refusal is None or (reply.confirm and not refusal.confirm) else refusal
            prompt = prompt if prompt.attempts else with_hint(prompt, reply)
        if refusal is None:
            raise WriterError(" ".join(f"{said.rstrip('.')}." for said in tried), failure)
        return replace(refusal, writer=replace(refusal.writer, tried=tuple(tried)))


@dataclass(frozen=True)
class UnavailableWriter:
    """A configured model, by its name, that cannot be used; it says why whenever it is asked."""

    name: str
    problem: str

    def write(self, prompt: Prompt) -> Reply:
        """Refuse, with a WriterError."""
        raise WriterError(self.problem, "no_access")


def flatten(writer: PolicyWriter) -> tuple[PolicyWriter, ...]:
    """Return the members of a chain, or the one writer."""
    return writer.writers if isinstance(writer, WriterChain) else (writer,)


def with_hint(prompt: Prompt, reply: Reply) -> Prompt:
    """Return the prompt for the next writer, ending with what the last one did and did not understand."""
    if (reply.kind != "not_understood" and not reply.confirm) or not (reply.plan or reply.unplaced):
        return prompt
    placed = ", ".join(as_data(step, MAX_TOLD) for step in reply.plan) or "nothing"
    words = ", ".join(as_data(word, MAX_TOLD) for word in reply.unplaced) or "nothing in particular"
    hint = (
        "# What a simpler reader made of the instruction\n"
        f"Understood: {placed}\nNot understood: {words}\n"
        "It may be wrong. Write one policy for the whole instruction.\n"
    )
    return replace(prompt, hints=(*prompt.hints, hint))


@called_as('writer_named("builtin")')
def writer_named(name: str = "auto", *, base_url: str | None = None, temperature: float = 0.1) -> PolicyWriter:
    """Return the writer of that name.

    Args:
        name: "auto" (the built-in writer, and where it did not understand every clause the model named by OVITA_MODEL,
            else a local model that is present), "builtin", "llamacpp:FILE.gguf" or "llamacpp:NAME", "PROVIDER:MODEL"
            with provider openai, anthropic, google or ollama, or several of them in line, with commas.
        base_url: Address of an OpenAI-compatible server; then `name` is that server's model.
        temperature: Sampling temperature of a model.

    Raises:
        RequestError: If the name is none of these, or the temperature is not between 0 and 2.
        MissingExtra: If the model's packages are not installed.
    """
    if not 0.0 <= temperature <= 2.0:
        raise RequestError(f"the temperature {temperature:g} is out of range; use 0 to 2")
    if name == "auto" and base_url is None:
        return WriterChain(_auto(temperature), "auto")
    names = [part.strip() for part in name.split(",")]
    writers = [_Chosen(_one(part, base_url, temperature), "asked for by name") for part in names]
    return writers[0] if len(writers) == 1 else WriterChain(tuple(writers), ",".join(names))


def _auto(temperature: float) -> tuple[PolicyWriter, ...]:
    """The built-in writer first, then the configured models, or else a local model that is present."""
    configured, present = configured_model()
    if configured:
        reason = f"{MODEL_VARIABLE} names it, for what the built-in writer does not understand"
    elif present:
        reason = "a local model that is present, for what the built-in writer does not understand"
    else:
        reason = f"no model is configured ({MODEL_VARIABLE} is not set) and no local one is present (ovita models)"
    names = [part.strip() for part in (configured or present).split(",") if part.strip()]
    models = [_model(part, temperature, reason) for part in names if part != "builtin"]
    builtin = _one("builtin", None, temperature)
    if not models:
        return (_Chosen(builtin, reason),)
    return (_Chosen(builtin, "it understood every clause", "no model had a better answer"), *models)


def configured_model() -> tuple[str, str]:
    """The model that OVITA_MODEL names, or "", and the local one that is present where it names none, or ""."""
    configured = os.environ.get(MODEL_VARIABLE, "").strip()
    if configured or find_spec("xllamacpp") is None:
        return configured, ""
    from ovita.writers.models.catalogue import default_model

    return "", default_model()


def _model(name: str, temperature: float, reason: str) -> PolicyWriter:
    """A configured model, or why it cannot be used: the built-in writer serves all the same."""
    try:
        return _Chosen(_one(name, None, temperature), reason)
    except (MissingExtra, RequestError) as problem:
        return UnavailableWriter(name, str(problem))


def _one(name: str, base_url: str | None, temperature: float) -> PolicyWriter:
    if name == "builtin":
        from ovita.writers.generate import BuiltinWriter

        return BuiltinWriter()
    provider, _, model = name.partition(":")
    if base_url is None and (provider not in PROVIDERS or not model):
        return _of_a_plugin(name, provider, model)
    if base_url is None and provider == "llamacpp":
        from ovita.writers.models.local import LocalWriter

        return LocalWriter(model, temperature=temperature)
    from ovita.writers.models.chat import LLMWriter

    return LLMWriter(name, base_url=base_url, temperature=temperature)


def _of_a_plugin(name: str, provider: str, model: str) -> PolicyWriter:
    found: PolicyWriter | None = plugins.make("writers", provider, "write", model, error=WriterError)
    if found is None:
        others = "".join(f", {known}" for known in plugins.entries("writers"))
        raise RequestError(
            f"unknown writer {name!r}; use auto, builtin{others}, llamacpp:FILE.gguf, or PROVIDER:MODEL with provider"
            f" {', '.join(PROVIDERS[1:])} (or --base-url for an OpenAI-compatible server), with commas for several"
        )
    return found


T = TypeVar("T")

Progress = Callable[[str], None]
"""Called with one short line, such as "llamacpp:qwen writes: 40 tokens"; it may be called from another thread."""


@dataclass
class WritingBudget:
    """Deadline, cancellation and progress.

    Progress lines go to `progress`; once `cancel` is set, writers stop as soon as they can; the time for writing is
    over at `deadline`, on the clock of `time.monotonic` [s].
    """

    progress: Progress | None = None
    cancel: Event | None = None
    deadline: float = math.inf
    _paused: bool = field(default=False, init=False)

    @classmethod
    def lasting(
        cls, seconds: float | None, progress: Progress | None = None, cancel: Event | None = None
    ) -> WritingBudget:
        """Return a budget with a deadline in so many seconds; None for no deadline."""
        return cls(progress, cancel, math.inf if seconds is None else time.monotonic() + seconds)

    def say(self, text: str) -> None:
        """Report progress."""
        if self.progress is not None:
            self.progress(text)

    @property
    def cancelled(self) -> bool:
        """Whether writing was cancelled."""
        return self.cancel is not None and self.cancel.is_set()

    @property
    def left(self) -> float:
        """Seconds until the time for writing is over, at least 0."""
        return max(0.0, self.deadline - time.monotonic())

    @contextmanager
    def pause(self) -> Iterator[None]:
        """Stop the clock during one-time preparation: extend the deadline by the time spent in this context."""
        started = time.monotonic()
        self._paused = True
        try:
            yield
        finally:
            self.deadline += time.monotonic() - started
            self._paused = False

    def over(self) -> str:
        """Return why writing must end now, or ""."""
        if self.cancelled:
            return "stopped on request"
        return "" if self.left > 0.0 else "no time was left"

    def wait_for(self, work: Callable[[], T], stop: Callable[[], None], seconds: float, waiting: str = "") -> T | None:
        """Run `work` in its own thread and return its result, or None once it was stopped.

        It is stopped when the time [s] is up or writing is cancelled: `stop` makes it end soon, and is called from
        another thread. `waiting` is reported each second with the elapsed time.
        """
        outcome: Future[T] = Future()

        def run() -> None:
            try:
                outcome.set_result(work())
            except BaseException as error:
                outcome.set_exception(error)

        started = time.monotonic()
        Thread(target=run, name="ovita-writer", daemon=True).start()
        said = 0
        try:
            while not wait([outcome], timeout=0.05).done:
                now = time.monotonic()
                if self.cancelled or (now >= min(started + seconds, self.deadline) and not self._paused):
                    stop()
                    return None
                if waiting and int(now - started) > said:
                    said = int(now - started)
                    self.say(f"{waiting}, {said} s")
        except KeyboardInterrupt:
            stop()
            wait([outcome], timeout=2.0)
            raise
        return outcome.result()


ExampleMode = Literal["retrieved", "paper", "none"]
"""Which examples a prompt shows: the most similar ones of the bank, the paper's way of two fixed ones, or none."""


@dataclass(frozen=True)
class PromptStyle:
    """What a prompt shows.

    Args:
        examples: Which examples.
        toolkit: Whether the policy is to be a function made of toolkit calls; else the prompt asks for the paper's
            scripts, and the examples are scripts as well.
        scene: Whether the scene is described; else only the objects' names are given, as in the paper.
        whole: Whether every function is listed, with its defaults and with what signatures leave open: for models in
            the cloud and those above some 7 billion parameters. Smaller ones get the core and what is retrieved.
    """

    examples: ExampleMode = "retrieved"
    toolkit: bool = True
    scene: bool = True
    whole: bool = False


@dataclass(frozen=True)
class Sections:
    """The text of a prompt by its sections: rules that are the same for every request, so that prefix caches work.

    Then `help` (functions and examples that are like the instruction), the scene with trajectory and limits, earlier
    turns, and the instruction.
    """

    rules: str
    help: str = ""
    scene: str = ""
    history: str = ""
    instruction: str = ""


@dataclass(frozen=True)
class Prompt:
    """What a policy writer is given; the text for a language model is made when it is first read.

    Args:
        request: The request.
        style: What the text shows.
        hints: What earlier writers in line made of the instruction.
        attempts: Failed attempts so far, oldest first.
        budget: Deadline, cancellation and progress reports.
        own: Text instead of what `style` would show, or None.
    """

    request: Request
    style: PromptStyle = PromptStyle()
    hints: tuple[str, ...] = ()
    attempts: tuple[Attempt, ...] = ()
    budget: WritingBudget = field(default_factory=WritingBudget, compare=False, repr=False)
    own: Sections | None = field(default=None, repr=False)

    @classmethod
    def of_text(cls, request: Request, rules: str, situation: str, *, budget: WritingBudget | None = None) -> Prompt:
        """Return a prompt with text of one's own instead of what `style` would show."""
        return cls(request, budget=budget or WritingBudget(), own=Sections(rules, instruction=situation))

    @cached_property
    def sections(self) -> Sections:
        """The text by section."""
        if self.own is not None:
            return self.own
        from ovita.writers.prompt import sections_of

        return sections_of(self.request, self.style)

    @property
    def fixed(self) -> str:
        """The text that is the same for every request, to be read first."""
        return self.sections.rules

    @property
    def situation(self) -> str:
        """The text that depends on the request."""
        s = self.sections
        return "".join([s.help, s.scene, s.history, s.instruction, *self.hints])

    def for_model(self, large: bool) -> Prompt:
        """Return the prompt as a large or a small model is shown it; one with text of its own stays."""
        return self if self.style.whole == large else replace(self, style=replace(self.style, whole=large))

    def repaired(self, code: str, error: str, failure: Failure = "failed") -> Prompt:
        """Return the prompt that follows when `code` failed with `error`."""
        return self.after(Attempt(Reply("policy", code=code), failure=failure, error=error))

    def after(self, attempt: Attempt) -> Prompt:
        """Return the prompt that follows a failed attempt."""
        return replace(self, attempts=(*self.attempts, attempt))


@called_as('ground(Request("go left by 0.1", trajectory))')
def ground(
    request: Request, *, examples: ExampleMode | bool = "retrieved", toolkit: bool = True, scene: bool = True
) -> Prompt:
    """Ground a request: a prompt that says everything a policy writer needs to know.

    Args:
        request: Instruction, trajectory, scene, robot and history.
        examples: Which examples are shown; True is "retrieved", False is "none".
        toolkit: As in `PromptStyle`.
        scene: As in `PromptStyle`.
    """
    mode: ExampleMode = examples if isinstance(examples, str) else "retrieved" if examples else "none"
    return Prompt(request, PromptStyle(mode, toolkit, scene))
