"""Writers for the benchmark's tests; `--writer python:bench_writers:NAME` makes one."""

from __future__ import annotations

import threading
from dataclasses import replace

from ovita.errors import MissingKey, WriterError
from ovita.writers.base import Prompt, Reply, WriterInfo

LEFT = "def adapt(traj, scene, *, left=0.2):\n    return move(traj, left=left)\n"
NOTHING = "def adapt(traj, scene):\n    expect_same_path()\n    return traj\n"
CRASH = "def adapt(traj, scene):\n    return traj / scene\n"


class Scripted:
    """Answers with a function of the prompt, and keeps the prompts; all instances of a class share them."""

    name = "scripted"
    prompts: list[Prompt] = []  # noqa: RUF012
    lock = threading.Lock()

    def code(self, prompt: Prompt) -> str:
        return LEFT

    def write(self, prompt: Prompt) -> Reply:
        with self.lock:
            type(self).prompts.append(prompt)
        return Reply(
            "policy", plan=("Go left.",), code=self.code(prompt), writer=WriterInfo("toy", "toy", 0.1, 100, 10)
        )


class Lefty(Scripted):
    prompts: list[Prompt] = []  # noqa: RUF012


class Learner(Scripted):
    """Does nothing at first, and what was asked once it hears feedback."""

    prompts: list[Prompt] = []  # noqa: RUF012

    def code(self, prompt: Prompt) -> str:
        return LEFT if "Please" in prompt.request.instruction else NOTHING


class Unsure(Scripted):
    """Always goes left, and asks whether that is meant."""

    prompts: list[Prompt] = []  # noqa: RUF012

    def write(self, prompt: Prompt) -> Reply:
        return replace(super().write(prompt), confirm=True, unplaced=("feed",))


class Crasher(Scripted):
    prompts: list[Prompt] = []  # noqa: RUF012

    def code(self, prompt: Prompt) -> str:
        return LEFT if prompt.attempts else CRASH


class Flaky(Scripted):
    """Every first request fails as an overloaded server does."""

    prompts: list[Prompt] = []  # noqa: RUF012

    def write(self, prompt: Prompt) -> Reply:
        reply = super().write(prompt)
        if len(self.prompts) % 2:
            raise WriterError("flaky: too much to do", "overloaded")
        return reply


class Down(Scripted):
    prompts: list[Prompt] = []  # noqa: RUF012

    def write(self, prompt: Prompt) -> Reply:
        super().write(prompt)
        raise MissingKey("down", "SOME_KEY")


class Confused(Scripted):
    prompts: list[Prompt] = []  # noqa: RUF012

    def write(self, prompt: Prompt) -> Reply:
        super().write(prompt)
        raise WriterError("confused: the answer has neither a policy nor a question")


NOT_A_WRITER = dict
