"""The language-model writer with a real, very small model on a real llama.cpp server.

A model of 135 million parameters follows a JSON schema when it is held to one, and writes no policy that works. That
is what these tests need: real replies, bad policies, and a chain that gives up in good order.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.errors import WriterError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.base import Prompt, Reply
from ovita.writers.explain import reworded
from ovita.writers.models.chat import LLMWriter

FIXED = "You write Python policies that move a robot's trajectory."
SITUATION = (
    "# Example\nGo up by 0.1\nPlan:\n1. Shift the path up by 0.1 m.\n"
    "Code:\n```python\ndef adapt(traj, scene, *, up=0.1):\n"
    "    return move(traj, up=up)\n```\n# Instruction\nGo left by 0.2\n"
)


@pytest.fixture
def request_() -> Request:
    trajectory = Trajectory(np.outer(np.arange(5), [0.1, 0.0, 0.0]), np.full(5, 0.5))
    return Request("Go left by 0.2", trajectory, Scene((SceneObject("cup", np.array([0.2, 0.1, 0.0])),)))


class Short:
    """A writer that passes prompts on with one line in place of rules and scene, which take this model long to read."""

    def __init__(self, writer: LLMWriter) -> None:
        self.writer, self.name = writer, writer.name
        self.prompts: list[Prompt] = []
        self.replies: list[Reply] = []

    def write(self, prompt: Prompt) -> Reply:
        self.prompts.append(prompt)
        short = Prompt.of_text(prompt.request, FIXED, SITUATION)
        for attempt in prompt.attempts:
            short = short.after(attempt)
        self.replies.append(self.writer.write(short))
        return self.replies[-1]


def local_writer(address: str, max_tokens: int = 400) -> LLMWriter:
    return LLMWriter("auto", base_url=address, temperature=0.0, max_tokens=max_tokens, timeout=120.0)


def test_a_real_reply_that_is_cut_off(local_model: str, request_: Request) -> None:
    with pytest.raises(WriterError, match="cut off after 8 tokens"):
        local_writer(local_model, 8).write(Prompt.of_text(request_, FIXED, "Go left by 0.2"))


def test_a_real_explanation_is_used_only_with_numbers_from_the_facts(
    local_model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ovita.writers.explain.MAX_TOKENS", 100)
    facts = {"Plan": "Shift the path left.", "What changed": "Every waypoint moved by 0.2 m."}
    try:
        text = reworded(local_writer(local_model), facts)
    except WriterError as error:
        assert "explanation" in str(error) or "cut off" in str(error)
    else:
        assert text and "\n" not in text


def test_the_chain_with_a_real_model_ends_in_good_order(local_model: str, request_: Request) -> None:
    """Replies held to the schema, bad policies sent back with their errors, and after one repair it is over."""
    writer = Short(local_writer(local_model))
    result = adapt(request_, writer=writer, repairs=1)
    prompts, replies = writer.prompts, writer.replies
    assert 1 <= len(prompts) <= 2
    assert result.attempts == len(prompts)
    assert [len(prompt.attempts) for prompt in prompts] == list(range(len(prompts)))
    assert replies, f"this machine's arithmetic made the model ramble: {result.error}"
    for reply in replies:
        assert reply.code and len(reply.plan) <= 8
        assert (reply.writer.kind, reply.writer.model) == ("llm", "smollm2")
        assert 0 < reply.writer.output_tokens <= 400
    for before, after in pairwise(prompts):
        assert after.attempts[-1].error, "a repair shows the error"
        assert before.situation == after.situation
    assert result.writer.input_tokens == sum(reply.writer.input_tokens for reply in replies)
    if result.status == "failed":
        assert len(prompts) == 2 or "cut off" in result.error
        assert result.error and "\n" not in result.error
        assert result.adapted == request_.trajectory
    else:
        assert result.usable
