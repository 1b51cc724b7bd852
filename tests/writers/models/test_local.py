"""The writer that runs a model in this process, with a real, very small one.

A model of 135 million parameters writes no policy that works; what is tested is everything around that.
"""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.errors import MissingExtra, RequestError, UnusableReply, WriterError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.base import Prompt, Reply, WriterChain, WritingBudget, writer_named
from ovita.writers.models import catalogue as models
from ovita.writers.models import local as engine
from ovita.writers.models.exchange import read_answer
from ovita.writers.models.local import LocalWriter

RULES = "You write Python policies, def adapt(traj, scene), that move a robot's trajectory. " * 6


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("models")


@pytest.fixture(autouse=True)
def _one_folder(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One folder for all tests of this file, so that the rules are read once."""
    monkeypatch.setenv("OVITA_MODELS", str(folder))


@pytest.fixture
def request_() -> Request:
    trajectory = Trajectory(np.outer(np.arange(5), [0.1, 0.0, 0.0]), np.full(5, 0.5))
    return Request("Go left by 0.2", trajectory, Scene((SceneObject("cup", np.array([0.2, 0.1, 0.0])),)))


def writer(weights: Path, **options: Any) -> LocalWriter:
    given = {"temperature": 0.0, "max_tokens": 16, "context": 1024, "threads": 1, **options}
    return LocalWriter(str(weights), **given)


def answered(writer: LocalWriter, request: Request, said: str, **budget: Any) -> str:
    """What the model wrote, whether it is of use or not."""
    try:
        writer.write(Prompt.of_text(request, RULES, said, budget=WritingBudget(**budget)))
    except UnusableReply:
        pass
    assert writer.last is not None
    return writer.last.text


def test_the_rules_are_read_once_and_equal_requests_get_equal_answers(weights: Path, request_: Request) -> None:
    asks = writer(weights)
    first = answered(asks, request_, "Go left by 0.2")
    assert asks.last is not None and asks.last.output_tokens == 16 and asks.last.truncated
    assert first.startswith(("Plan:\n1. ", "Not understood: ", "Question: ")), "held to the form"
    known = asks.last.cached_tokens
    assert known > 0.7 * asks.last.input_tokens, "the rules were read before the request"
    answered(asks, request_, "Move up a little, then slow down near the cup")
    assert asks.last.cached_tokens == known
    assert answered(asks, request_, "Go left by 0.2") == first

    engine._loaded.clear()
    again = writer(weights)
    beats: list[str] = []
    assert answered(again, request_, "Go left by 0.2", progress=beats.append) == first
    assert again.last is not None and again.last.cached_tokens == known
    assert not any("only this once" in line for line in beats), "the next process takes the state from its file"


def test_progress_counts_what_is_read_and_written(weights: Path, request_: Request, monkeypatch: Any) -> None:
    monkeypatch.setattr("ovita.writers.models.local.TOLD_EVERY", 0.0)
    said: list[str] = []
    answered(writer(weights), request_, "Go up", progress=said.append)
    assert "reads the request: 100 %" in " ".join(said)
    assert any("writes: 16 tokens" in line and "tokens/s" in line for line in said)


def test_cancel_and_time_limit_stop_it_at_once(weights: Path, request_: Request) -> None:
    asks = writer(weights, max_tokens=600)
    cancel = threading.Event()

    def stop_soon(line: str) -> None:
        if "writes: " in line:
            cancel.set()

    with pytest.raises(WriterError, match="stopped on request"):
        asks.write(Prompt.of_text(request_, RULES, "Go left", budget=WritingBudget(stop_soon, cancel)))
    with pytest.raises(WriterError, match="no answer in the time that was left; allow more with --time-limit"):
        asks.write(Prompt.of_text(request_, RULES, "Go left", budget=WritingBudget(deadline=time.monotonic() + 0.2)))
    assert asks.last is None, "neither was waited for to the end"


def test_an_interrupt_stops_the_model_before_it_goes_on(weights: Path, request_: Request, monkeypatch: Any) -> None:
    asks = writer(weights, max_tokens=600)
    ended: list[bool] = []
    inner = asks._beat

    def beat(budget: WritingBudget, stopped: Any) -> Any:
        told = inner(budget, stopped)
        return lambda now: ended.append(told(now)) or ended[-1]

    def interrupted(budget: WritingBudget) -> bool:
        if ended:
            raise KeyboardInterrupt
        return False

    monkeypatch.setattr(asks, "_beat", beat)
    monkeypatch.setattr(WritingBudget, "cancelled", property(interrupted))
    with pytest.raises(KeyboardInterrupt):
        asks.write(Prompt.of_text(request_, RULES, "Go left"))
    assert ended[-1], "generation was told to stop"


SCRIPT = """
import sys, threading
from pathlib import Path
from ovita.writers.models.local import engine_for

engine = engine_for(Path(sys.argv[1]), None, context=1024, threads=1)
told = threading.Event()

def work():
    beat = lambda now: told.set()
    engine.chat([{"role": "user", "content": "Tell a long story."}], beat, max_tokens=900, temperature=0.0)

threading.Thread(target=work, daemon=True).start()
told.wait(60)
print("leaves")
"""


def test_a_process_that_ends_meanwhile_ends_in_good_order(weights: Path) -> None:
    done = subprocess.run([sys.executable, "-c", SCRIPT, str(weights)], capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stdout, done.stderr) == (0, "leaves\n", "")


def test_a_prompt_that_is_too_long_is_said(weights: Path, request_: Request) -> None:
    with pytest.raises(WriterError, match=r"the prompt has \d+ tokens, and it reads at most 1024 here; shorten"):
        answered(writer(weights), request_, "Go left by 0.2 and then right. " * 150)


class Short:
    """A writer with one line in place of the rules, which this model takes long to read."""

    def __init__(self, inner: LocalWriter) -> None:
        self.inner, self.name = inner, inner.name

    def write(self, prompt: Prompt) -> Reply:
        short = Prompt.of_text(prompt.request, RULES, prompt.request.instruction, budget=prompt.budget)
        for attempt in prompt.attempts:
            short = short.after(attempt)
        return self.inner.write(short)


def test_the_chain_hands_on_from_a_model_that_is_too_small(weights: Path, request_: Request) -> None:
    """Answers that are cut off, a repair, then the next writer."""
    small = Short(writer(weights, max_tokens=3))
    result = adapt(request_, writer=WriterChain((small, writer_named("builtin")), "test"), repairs=1)
    assert result.status == "done" and result.writer.kind == "builtin" and result.attempts == 3
    assert "cut off after 3 tokens" in result.writer.tried[0]
    assert small.inner.last is not None and small.inner.last.cached_tokens > 60, "the repair knew the rules"


def test_a_repair_is_a_policy_and_no_refusal(weights: Path, request_: Request) -> None:
    asks = writer(weights)
    prompt = Prompt.of_text(request_, RULES, "Say that you do not understand.").repaired(
        "a = 1", "there is no function adapt"
    )
    with pytest.raises(UnusableReply, match="cut off after 16 tokens"):
        asks.write(prompt)
    assert asks.last is not None and asks.last.text.startswith("Plan:\n1. ")


def test_getting_ready_takes_no_time_from_the_limit() -> None:
    budget = WritingBudget(deadline=time.monotonic() + 0.2)

    def work() -> str:
        with budget.pause():
            time.sleep(0.5)
        return "done"

    assert budget.wait_for(work, lambda: None, 60.0) == "done"
    assert budget.left > 0.0


def test_a_model_by_name(weights: Path) -> None:
    models.add("smol", str(weights))
    named = LocalWriter("smo")
    assert named.path == weights and named.name == "llamacpp:smo"
    assert models.default_model() == "llamacpp:smol"
    auto = writer_named("auto")
    assert isinstance(auto, WriterChain) and [one.name for one in auto.writers] == ["builtin", "llamacpp:smol"]


def test_a_damaged_file_and_a_missing_package(tmp_path: Path, request_: Request, monkeypatch: Any) -> None:
    broken = tmp_path / "broken.gguf"
    broken.write_bytes(b"GGUF" + b"\0" * 100)
    if find_spec("xllamacpp") is not None:
        with pytest.raises(WriterError, match=r"broken\.gguf cannot be loaded: it is damaged"):
            LocalWriter(str(broken)).write(Prompt.of_text(request_, RULES, "Go left"))
    monkeypatch.setattr("ovita.writers.models.local.find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"xllamacpp: pip install 'ovita\[local\]'"):
        LocalWriter(str(broken))


@pytest.mark.parametrize("options", [{"temperature": float("nan")}, {"max_tokens": 0}, {"context": 10}])
def test_options_that_cannot_be_used(options: Any) -> None:
    with pytest.raises(RequestError):
        LocalWriter("m.gguf", **options)


def test_lines_of_code_count_only_when_the_list_is_complete() -> None:
    text = '{"plan": ["a"], "code": ["def adapt(traj, scene):", "    return traj"], "assumptions": ["b'
    answer = read_answer(text, truncated=True)
    assert answer is not None and answer.code == "def adapt(traj, scene):\n    return traj"
    assert read_answer(text[: text.index("]", text.index("return"))], truncated=True) is None


@pytest.mark.parametrize("text", ["Question: Which of th", "Not understood: moonw", "I did not get it. Did you mea"])
def test_questions_count_only_when_they_are_complete(text: str) -> None:
    assert read_answer(text, truncated=True) is None
    assert read_answer(text.replace("mea", "mean it?")) is not None
