"""The language-model writer with a real, very small model on a real llama.cpp server.

A model of 135 million parameters follows a JSON schema when it is held to one, and writes no policy that works. That
is what these tests need: real replies, bad policies, and a chain that gives up in good order.
"""

from __future__ import annotations

import numpy as np
import pytest

from ovita.adapt import adapt
from ovita.errors import WriterError
from ovita.language.llm import LLMWriter, explain
from ovita.language.request import Prompt, Reply, Request
from ovita.scene import Scene, SceneObject
from ovita.trajectory import Trajectory

FIXED = "You write Python policies that move a robot's trajectory."


@pytest.fixture
def request_() -> Request:
    trajectory = Trajectory(np.outer(np.arange(5), [0.1, 0.0, 0.0]), np.full(5, 0.5))
    return Request("Go left by 0.2", trajectory, Scene((SceneObject("cup", np.array([0.2, 0.1, 0.0])),)))


@pytest.fixture
def prompt(request_: Request) -> Prompt:
    return Prompt(request_, FIXED, "Objects: cup\n# Instruction\nGo left by 0.2\n")


class Listening:
    """A writer that keeps the prompts it passes on."""

    def __init__(self, writer: LLMWriter) -> None:
        self.writer, self.name = writer, writer.name
        self.prompts: list[Prompt] = []

    def write(self, prompt: Prompt) -> Reply:
        self.prompts.append(prompt)
        return self.writer.write(prompt)


def local_writer(address: str, max_tokens: int = 400) -> LLMWriter:
    return LLMWriter("auto", base_url=address, temperature=0.0, max_tokens=max_tokens, timeout=120.0)


def test_a_real_model_is_held_to_the_schema(local_model: str, prompt: Prompt) -> None:
    reply = local_writer(local_model).write(prompt)
    assert reply.kind == "policy" and reply.code
    assert reply.plan and len(reply.plan) <= 8
    assert reply.writer.kind == "llm" and reply.writer.model == "smollm2"
    assert reply.writer.input_tokens > 50 and 0 < reply.writer.output_tokens <= 400


def test_a_real_model_reads_the_error_of_its_policy(local_model: str, prompt: Prompt) -> None:
    asks = local_writer(local_model)
    first = asks.write(prompt)
    second = asks.write(prompt.repaired(first.code, "line 1: there is no function adapt"))
    assert second.writer.input_tokens > first.writer.input_tokens + 20


def test_a_real_reply_that_is_cut_off(local_model: str, prompt: Prompt) -> None:
    with pytest.raises(WriterError, match="cut off after 8 tokens"):
        local_writer(local_model, 8).write(prompt)


def test_a_real_explanation_is_used_only_with_numbers_from_the_facts(local_model: str) -> None:
    facts = {"Plan": "Shift the path left.", "What changed": "Every waypoint moved by 0.2 m."}
    try:
        text = explain(local_writer(local_model), facts)
    except WriterError as error:
        assert "explanation" in str(error) or "cut off" in str(error)
    else:
        assert text and "\n" not in text


def test_the_chain_with_a_real_model_ends_in_good_order(local_model: str, request_: Request) -> None:
    """The real prompt goes out, bad policies come back with their errors, and after two repairs it is over."""
    listening = Listening(local_writer(local_model))
    result = adapt(request_, writer=listening, examples=False)
    prompts = listening.prompts
    assert 1 <= len(prompts) <= 3
    assert [len(prompt.attempts) for prompt in prompts] == list(range(len(prompts)))
    assert result.writer.kind == "llm" and result.writer.model == "smollm2"
    assert result.attempts == len(prompts)
    if result.status == "failed":
        assert result.error and "\n" not in result.error
        assert result.adapted == request_.trajectory
        assert len(prompts) == 3 and prompts[-1].attempts[-1].error
    else:
        assert result.status in ("ok", "infeasible")
