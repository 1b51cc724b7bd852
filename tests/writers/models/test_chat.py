from __future__ import annotations

import asyncio
import json
import logging
import socket
import sys
import time
from typing import Any

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.errors import MissingExtra, MissingKey, OvitaError, RequestError, WriterError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.base import PolicyWriter, Prompt
from ovita.writers.explain import reworded
from ovita.writers.models.chat import LLMWriter, ollama_url
from ovita.writers.models.exchange import read_answer

KEY = "sk-secret-0123456789abcdef"
CODE = 'def adapt(traj, scene, *, left=0.2):\n    """Shift left."""\n    return move(traj, left=left)'


@pytest.fixture(autouse=True)
def _quick_retries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ovita.writers.models.chat.BACKOFF", 0.01)


@pytest.fixture
def prompt() -> Prompt:
    trajectory = Trajectory(np.outer(np.arange(5), [0.1, 0.0, 0.0]), np.full(5, 0.5))
    cup = SceneObject("cup", np.array([0.2, 0.1, 0.0]))
    request = Request("Go left by 0.2", trajectory, Scene((cup,)))
    return Prompt.of_text(request, "You write policies.", "Objects: cup\n# Instruction\nGo left by 0.2")


def writer(stub: Any, **options: Any) -> LLMWriter:
    return LLMWriter("stub-1", base_url=stub.url, **{"api_key": KEY, "timeout": 10.0, **options})


# Replies


def test_structured_reply(stub: Any, prompt: Prompt) -> None:
    stub.script(
        stub.answers(plan=["1. Shift left by 0.2 m."], code=CODE, assumptions=["left is -x"], contacts=["Cup", "moon"])
    )
    reply = writer(stub).write(prompt)
    assert (reply.kind, reply.code, reply.plan) == ("policy", CODE, ("Shift left by 0.2 m.",))
    assert reply.assumptions == ("left is -x",)
    assert reply.contacts == ("Cup",), "an object that the scene does not have cannot be touched"
    assert (reply.writer.kind, reply.writer.model, reply.writer.temperature) == ("llm", "stub-1", 0.1)
    assert (reply.writer.input_tokens, reply.writer.output_tokens) == (11, 7)


def test_what_is_sent(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.answers(code=CODE))
    writer(stub, max_tokens=321).write(prompt)
    (sent,) = stub.requests
    body = sent["body"]
    assert sent["path"] == "/v1/chat/completions"
    assert sent["headers"]["authorization"] == f"Bearer {KEY}"
    assert (body["model"], body["temperature"], body["max_tokens"]) == ("stub-1", 0.1, 321)
    assert "max_completion_tokens" not in body, "older servers do not know it"
    system, user = body["messages"]
    assert system["role"] == "system" and system["content"].startswith("You write policies.\n")
    assert user == {"role": "user", "content": prompt.situation}
    schema = body["response_format"]["json_schema"]["schema"]
    assert list(schema["properties"]) == ["plan", "code", "assumptions", "contacts", "question", "not_understood"]
    assert sorted(schema["required"]) == sorted(schema["properties"])


def test_attempts_are_shown_with_their_errors(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.answers(code=CODE))
    writer(stub).write(prompt.repaired("a = 1", "line 1: no function adapt").repaired("b = 2", "it ran too long"))
    roles = [(m["role"], m["content"]) for m in stub.requests[0]["body"]["messages"][1:]]
    assert [role for role, _ in roles] == ["user", "assistant", "user", "assistant", "user"]
    assert "a = 1" in roles[1][1] and "b = 2" in roles[3][1]
    assert roles[2][1].startswith("Your policy failed: line 1: no function adapt\n")
    assert "Answer again with the whole corrected policy." in roles[4][1]


FENCED_CODE = f"```python\n{CODE}\n```"

FENCED = f"""Here is what I would do.

**Plan:**
1. Shift the path.
2. Nothing else.

Code:
```python
{CODE}
```
Assumptions: "left" is -x; the cup stays
Contacts: cup
"""


@pytest.mark.parametrize(
    ("text", "plan", "assumptions", "contacts"),
    [
        (FENCED, ("Shift the path.", "Nothing else."), ('"left" is -x', "the cup stays"), ("cup",)),
        (f"<think>```python\nx = 1\n```</think>\n```\n{CODE}\n```", (), (), ()),
        (f"1. Shift.\n\n{CODE}\n\nContacts: none", ("Shift.",), (), ()),
        (f"Sure! {json.dumps({'plan': '1. Shift.', 'code': CODE})} Enjoy.", ("Shift.",), (), ()),
        (f"```json\n{json.dumps({'plan': ['Shift.'], 'code': FENCED_CODE})}\n```", ("Shift.",), (), ()),
        (f"First a helper:\n```python\nimport numpy\n```\nThen:\n```python\n{CODE}\n```\n", (), (), ()),
    ],
    ids=["paper's format", "thoughts and a bare fence", "no fence", "json in prose", "fences in json", "two blocks"],
)
def test_replies_that_ignore_the_schema(
    stub: Any, prompt: Prompt, text: str, plan: Any, assumptions: Any, contacts: Any
) -> None:
    stub.script(stub.says(text))
    reply = writer(stub).write(prompt)
    assert (reply.kind, reply.code) == ("policy", CODE)
    assert (reply.plan, reply.assumptions, reply.contacts) == (plan, assumptions, contacts)


def test_script_form_without_a_fence() -> None:
    script = "points = get_trajectory()\nfor p in points:\n    p['x'] += 0.1\nmodified_trajectory = points"
    answer = read_answer(f"Plan:\n- Shift it.\n\n{script}\n\nThat is all.")
    assert answer is not None and (answer.code, answer.plan) == (script, ["Shift it."])


def test_a_last_fence_that_is_not_closed_counts_unless_the_reply_was_cut_off() -> None:
    text = f"Plan:\n1. Shift.\n```python\n{CODE}"
    answer = read_answer(text)
    assert answer is not None and (answer.code, answer.plan) == (CODE, ["Shift."])
    assert read_answer(text, truncated=True) is None


@pytest.mark.parametrize("unit", ["```py\n", '{"', '{"a":', "<think>", "def adapt(\n", "?", "*", "# ", "plan:"])
def test_odd_text_is_read_in_little_time(unit: str) -> None:
    text = unit * (20_000 // len(unit))
    started = time.process_time()
    for truncated in (False, True):
        read_answer(text, truncated=truncated)
    assert time.process_time() - started < 4.0


def test_question_and_not_understood(stub: Any, prompt: Prompt) -> None:
    stub.script(
        stub.answers(question="Left of the cup, or to the left?"),
        stub.answers(not_understood=["frobnicate"]),
        stub.says("I am not sure. Do you mean the red cup?"),
        stub.answers(code=CODE, question="Is 0.2 right?"),
    )
    asks = writer(stub)
    first, second, third, fourth = (asks.write(prompt) for _ in range(4))
    assert (first.kind, first.question, first.code) == ("question", "Left of the cup, or to the left?", "")
    assert (second.kind, second.unplaced) == ("not_understood", ("frobnicate",))
    assert (third.kind, third.question) == ("question", "Do you mean the red cup?")
    assert (fourth.kind, fourth.assumptions) == ("policy", ("left open: Is 0.2 right?",))


def test_a_cut_off_reply_counts_only_when_its_code_is_complete(stub: Any, prompt: Prompt) -> None:
    whole = json.dumps({"plan": ["Shift."], "code": CODE, "assumptions": ["one", "two"]})
    stub.script(
        stub.says(whole[:-8], finish="length"),
        stub.says(whole[: whole.index("return")], finish="length"),
        stub.says(f"```python\n{CODE[:-10]}", finish="length"),
    )
    assert writer(stub).write(prompt).code == CODE
    for _ in range(2):
        with pytest.raises(WriterError, match=r"stub-1: the answer was cut off after 7 tokens; raise max_tokens"):
            writer(stub).write(prompt)


# Failures

FAILURES: list[tuple[str, Any, str]] = [
    (
        "401",
        lambda s: s.fails(401, f"Incorrect API key provided: {KEY}"),
        r"refused the API key \(401\): check OPENAI_",
    ),
    ("403", lambda s: s.fails(403), r"refused the API key \(403\)"),
    ("404", lambda s: s.fails(404, "model not found"), r"knows no such model \(404\): check the model's name"),
    ("400", lambda s: s.fails(400, f"bad thing {KEY} here"), r"refused the request \(400\): bad thing \*\*\* here;"),
    ("429", lambda s: s.fails(429, retry_after="0"), r"limits the rate of requests \(429\) 3 times: try again later"),
    ("429 for long", lambda s: s.fails(429, retry_after="120"), r"asks to wait 120 s: try again later"),
    ("500", lambda s: s.fails(500), r"failed 3 times with status 500: try again later, or use --writer builtin"),
    ("503", lambda s: s.fails(503), r"failed 3 times with status 503"),
    ("not json", lambda s: s.sends(b"<html>hello</html>"), r"answered with something that no chat model answers with"),
    ("other json", lambda s: s.sends({"ok": True}), r"answered with something that no chat model answers with"),
    (
        "no choices",
        lambda s: s.sends({"choices": [], "id": "1", "object": "chat.completion", "model": "m"}),
        "stub-1: ",
    ),
    (
        "broken json",
        lambda s: s.says('{"plan": ["a"], "co'),
        r"has neither a policy nor a question.*began: '\{\"plan\"",
    ),
    ("empty", lambda s: s.says(""), r"the model gave an empty answer; try again"),
    ("null", lambda s: s.says(None), r"the model gave an empty answer"),
    ("empty fields", lambda s: s.answers(), r"has neither a policy nor a question"),
    ("prose", lambda s: s.says("Robots are nice."), r"neither a policy nor a question.*'Robots are nice.'"),
    (
        "refusal",
        lambda s: s.says(None, refusal="I can't do that."),
        r"refused to answer \(I can't do that.\); rephrase",
    ),
    ("filtered", lambda s: s.says("", finish="content_filter"), r"refused to answer; rephrase the instruction"),
]


@pytest.mark.parametrize(("_name", "answer", "message"), FAILURES, ids=[name for name, _, _ in FAILURES])
def test_failures_are_one_sentence(
    stub: Any,
    prompt: Prompt,
    _name: str,
    answer: Any,
    message: str,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    caplog.set_level(logging.DEBUG)
    stub.script(answer(stub))
    with pytest.raises(WriterError, match=message) as caught:
        writer(stub).write(prompt)
    text = str(caught.value)
    assert text.startswith("stub-1: ") and "\n" not in text and len(text) < 400
    shown = (
        text + repr(caught.value.__cause__) + repr(caught.value.__context__) + caplog.text + "".join(capfd.readouterr())
    )
    assert KEY not in shown


def test_retries_until_it_works(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.fails(429, retry_after="0"), stub.fails(502), stub.answers(code=CODE))
    assert writer(stub).write(prompt).code == CODE
    assert len(stub.requests) == 3
    stub.script(stub.fails(500))
    with pytest.raises(WriterError, match="failed with status 500"):
        writer(stub, retries=0).write(prompt)
    assert len(stub.requests) == 4


def test_a_used_up_quota_is_not_retried(stub: Any, prompt: Prompt) -> None:
    body = {"error": {"message": "You exceeded your quota", "type": "insufficient_quota", "code": "insufficient_quota"}}
    stub.script(type(stub.fails(429))(429, json.dumps(body).encode()))
    with pytest.raises(WriterError, match="has no quota left"):
        writer(stub).write(prompt)
    assert len(stub.requests) == 1


def test_slow_server(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.sends(b"{}", delay=600.0))
    with pytest.raises(WriterError, match=r"stub-1: no answer within 0\.3 s; allow more time or use a faster model"):
        writer(stub, timeout=0.3).write(prompt)


def test_waiting_for_a_retry_counts_as_waiting(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.fails(429, retry_after="600"))
    with pytest.raises(WriterError, match="asks to wait 600 s"):
        writer(stub, timeout=60.0).write(prompt)
    assert len(stub.requests) == 1


def test_nobody_listens(prompt: Prompt) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    asks = LLMWriter("m", base_url=f"http://user:{KEY}@127.0.0.1:{port}/v1?key={KEY}")
    with pytest.raises(WriterError, match=f"no answer from http://127.0.0.1:{port}/v1: start the server") as caught:
        asks.write(prompt)
    assert KEY not in str(caught.value)


def test_a_server_that_wants_a_key(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.fails(401))
    with pytest.raises(WriterError, match=r"wants an API key \(401\): set OPENAI_API_KEY"):
        writer(stub, api_key=None).write(prompt)


# What servers and models reject


def test_temperature_is_left_out_where_it_is_rejected(stub: Any, prompt: Prompt) -> None:
    refusal = "Unsupported value: 'temperature' does not support 0.1 with this model."
    stub.script(stub.fails(400, refusal), stub.answers(code=CODE))
    reply = writer(stub, retries=0).write(prompt)
    assert reply.writer.temperature is None
    assert ["temperature" in request["body"] for request in stub.requests] == [True, False]


def test_schema_is_left_out_where_it_is_rejected(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.fails(400, "response_format json_schema is not supported"), stub.says(FENCED))
    assert writer(stub, retries=0).write(prompt).code == CODE
    last = stub.requests[1]["body"]
    assert "response_format" not in last
    assert "one fenced block" in last["messages"][0]["content"]


def test_models_that_think_get_room_and_no_temperature(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.answers(code=CODE))
    reply = LLMWriter("openai:o3", base_url=stub.url).write(prompt)
    body = stub.requests[0]["body"]
    assert reply.writer.temperature is None
    assert "temperature" not in body and body["max_tokens"] > 10_000


# Providers


def test_anthropic_answers_through_a_tool(stub: Any, prompt: Prompt) -> None:
    content = [{"type": "tool_use", "id": "t1", "name": "answer", "input": {"plan": ["Shift."], "code": CODE}}]
    message = {"id": "m1", "type": "message", "role": "assistant", "model": "claude-x", "content": content}
    message |= {"stop_reason": "tool_use", "stop_sequence": None, "usage": {"input_tokens": 5, "output_tokens": 6}}
    stub.script(stub.fails(529, "overloaded"), stub.sends(message))
    asks = LLMWriter("anthropic:claude-sonnet-5", base_url=stub.url.removesuffix("/v1"), api_key=KEY)
    reply = asks.write(prompt.repaired("a = 1", "no"))
    assert (reply.code, reply.plan, reply.writer.output_tokens) == (CODE, ("Shift.",), 6)
    body = stub.requests[-1]["body"]
    assert [tool["name"] for tool in body["tools"]] == ["answer"]
    assert [m["role"] for m in body["messages"]] == ["user", "assistant", "user"]
    assert KEY in str(stub.requests[-1]["headers"])


def test_google_answers_in_the_schema(stub: Any, prompt: Prompt) -> None:
    part = {"text": json.dumps({"plan": ["Shift."], "code": CODE, "question": None})}
    answer = {"candidates": [{"content": {"role": "model", "parts": [part]}, "finishReason": "STOP"}]}
    answer |= {"usageMetadata": {"promptTokenCount": 5, "candidatesTokenCount": 6}, "modelVersion": "gemini-x"}
    stub.script(stub.fails(503, "overloaded"), stub.sends(answer))
    asks = LLMWriter("google:gemini-2.5-flash", base_url=stub.url.removesuffix("/v1"), api_key=KEY)
    reply = asks.write(prompt)
    assert (reply.code, reply.writer.model, reply.writer.input_tokens) == (CODE, "gemini-x", 5)
    assert stub.requests[-1]["body"]["generationConfig"]["responseMimeType"] == "application/json"


def test_ollama_needs_no_key_and_is_found_by_its_variable(
    stub: Any, prompt: Prompt, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OLLAMA_HOST", stub.url.removeprefix("http://").removesuffix("/v1"))
    stub.script(stub.answers(code=CODE))
    assert LLMWriter("ollama:qwen3:4b").write(prompt).code == CODE
    assert stub.requests[0]["body"]["model"] == "qwen3:4b"


@pytest.mark.parametrize(
    ("host", "url"),
    [
        ("", "http://127.0.0.1:11434/v1"),
        ("0.0.0.0", "http://127.0.0.1:11434/v1"),
        (":8000", "http://127.0.0.1:8000/v1"),
        ("box:9", "http://box:9/v1"),
        ("https://models.example/", "https://models.example/v1"),
    ],
)
def test_ollama_hosts(host: str, url: str) -> None:
    assert ollama_url(host) == url


def test_auto_takes_the_first_model_of_the_server(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.sends({"data": [{"id": "the-only-one"}]}), stub.answers(code=CODE))
    LLMWriter("auto", base_url=stub.url).write(prompt)
    assert [r["path"] for r in stub.requests] == ["/v1/models", "/v1/chat/completions"]
    assert stub.requests[1]["body"]["model"] == "the-only-one"


def test_base_url_needs_no_key_and_uses_a_set_one(stub: Any, prompt: Prompt, monkeypatch: pytest.MonkeyPatch) -> None:
    stub.script(stub.answers(code=CODE))
    LLMWriter("openai:mine", base_url=stub.url).write(prompt)
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    LLMWriter("mine", base_url=stub.url).write(prompt)
    assert [r["body"]["model"] for r in stub.requests] == ["mine", "mine"]
    assert KEY not in stub.requests[0]["headers"]["authorization"]
    assert stub.requests[1]["headers"]["authorization"] == f"Bearer {KEY}"


def test_proxies_do_not_stand_before_this_machine(stub: Any, prompt: Prompt, monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.setenv(variable, "http://127.0.0.1:9")
    stub.script(stub.answers(code=CODE))
    assert writer(stub).write(prompt).kind == "policy"


@pytest.mark.parametrize(
    ("name", "variable"),
    [
        ("openai:gpt-5", "OPENAI_API_KEY"),
        ("anthropic:claude-sonnet-4-5", "ANTHROPIC_API_KEY"),
        ("google:gemini-2.5-pro", "GOOGLE_API_KEY"),
    ],
)
def test_missing_key_is_said_before_any_request(
    prompt: Prompt, name: str, variable: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LLMWriter, "_within_time", lambda *_: pytest.fail("a request was sent"))
    with pytest.raises(MissingKey, match=f"{name} needs an API key: set {variable}"):
        LLMWriter(name).write(prompt)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("openai:", {}, "names no model"),
        ("gpt-5", {}, "names no model; write PROVIDER:MODEL"),
        ("m", {"base_url": "localhost:8080"}, "write it as http://HOST:PORT/v1"),
        ("m", {"base_url": "ftp://host/v1"}, "write it as http://HOST:PORT/v1"),
        ("openai:m", {"temperature": 3.0}, "use 0 to 2"),
        ("openai:m", {"timeout": 0.0}, "positive number of seconds"),
        ("openai:m", {"timeout": float("nan")}, "positive number of seconds"),
        ("openai:m", {"retries": -1}, "0 or more"),
        ("openai:m", {"max_tokens": 0}, "1 or more"),
    ],
)
def test_options_that_cannot_be_used(name: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(RequestError, match=message):
        LLMWriter(name, **options)


def test_missing_package_names_the_extra(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ovita.writers.models.chat.find_spec", lambda name: None)
    with pytest.raises(MissingExtra, match=r"pydantic-ai-slim: pip install 'ovita\[llm\]'"):
        LLMWriter("openai:gpt-5")


def test_importing_the_writer_does_not_import_pydantic_ai() -> None:
    import subprocess

    code = "import sys, ovita.writers.models.chat as l; l.LLMWriter('openai:m'); print('pydantic_ai' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_it_is_a_policy_writer_and_never_shows_its_key() -> None:
    asks = LLMWriter("openai:gpt-5", api_key=KEY)
    assert isinstance(asks, PolicyWriter)
    assert asks.name == "openai:gpt-5"
    assert KEY not in repr(asks) + repr(vars(asks))


def test_called_from_inside_a_running_loop(stub: Any, prompt: Prompt) -> None:
    async def studio() -> str:
        return writer(stub).write(prompt).code

    stub.script(stub.answers(code=CODE))
    assert asyncio.run(studio()) == CODE


def test_errors_of_a_writer_are_ours(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.fails(418))
    with pytest.raises(OvitaError, match=r"refused the request \(418\)"):
        writer(stub).write(prompt)


# Explanations

FACTS = {
    "Plan": "Shift the path left.",
    "Parameters": "left = 0.2 m",
    "What changed": "Every waypoint moved by 0.200 m; the path is 1.35 m long, as before.",
}


def test_explanation(stub: Any) -> None:
    stub.script(stub.says("- The whole path was moved 0.2 m to the left.\n- It is still 1.35 m long."))
    text = reworded(writer(stub), FACTS)
    assert text == "The whole path was moved 0.2 m to the left. It is still 1.35 m long."
    body = stub.requests[0]["body"]
    assert body["temperature"] == 0.3
    assert "response_format" not in body
    assert "left = 0.2 m" in body["messages"][1]["content"]


@pytest.mark.parametrize(
    ("said", "message"),
    [
        ("It moved 20 cm.", "the number 20, which is in no fact"),
        ("It moved by ½ m.", "is in no fact"),
        ("It moved 0.2 cm.", "0.2 cm, which is in no fact"),
        ("It moved twice as far.", "the word 'twice', which is in no fact"),
        ("It moved 0.2 m to the right.", "the word 'right' where the facts say 'left'"),
        ("", "empty answer"),
        ("1.", "no text"),
    ],
)
def test_explanations_that_are_not_used(stub: Any, said: str, message: str) -> None:
    stub.script(stub.says(said))
    with pytest.raises(WriterError, match=message):
        reworded(writer(stub), FACTS)


def test_explanation_by_a_wrapped_writer_or_by_none(stub: Any) -> None:
    class Wrapper:
        name = "auto"

        def __init__(self, inner: Any = None) -> None:
            if inner is not None:
                self.writer = inner

        def write(self, prompt: Prompt) -> Any:
            raise AssertionError("an explanation writes no policy")

    stub.script(stub.says("It moved 0.2 m."))
    assert reworded(Wrapper(writer(stub)), FACTS) == "It moved 0.2 m."
    with pytest.raises(WriterError, match="auto writes no explanations"):
        reworded(Wrapper(), FACTS)


# The chain

WORKS = '''def adapt(traj, scene, *, left=0.2):
    """Shift left."""
    traj = move(traj, left=left)
    expect_moved(left=left)
    return traj'''


def test_a_bad_policy_is_shown_its_error_and_repaired(stub: Any, prompt: Prompt) -> None:
    stub.script(
        stub.answers(code="def adapt(traj, scene):\n    return nonsense(traj)"),
        stub.answers(plan=["Shift left."], code=WORKS),
        stub.says("Everything moved 0.2 m to the left."),
    )
    result = adapt(prompt.request, writer=writer(stub), explain_with_model=True)
    assert result.status == "done"
    assert result.attempts == 2
    assert np.allclose(result.adapted.positions[:, 0], prompt.request.trajectory.positions[:, 0] - 0.2)
    shown = [message["content"] for message in stub.requests[1]["body"]["messages"]]
    assert "nonsense(traj)" in shown[2]
    assert "Your policy failed" in shown[3] and "nonsense" in shown[3]
    assert result.explanation == "Everything moved 0.2 m to the left."
    assert (result.writer.kind, result.writer.input_tokens) == ("llm", 22)


def test_the_chain_gives_up_after_two_repairs(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.answers(code="def adapt(traj, scene):\n    return nonsense(traj)"))
    result = adapt(prompt.request, writer=writer(stub))
    assert (result.status, result.attempts, len(stub.requests)) == ("failed", 3, 3)
    assert "nonsense" in result.error
    assert result.adapted == prompt.request.trajectory


def test_a_writer_that_fails_is_a_status(stub: Any, prompt: Prompt) -> None:
    stub.script(stub.fails(401))
    result = adapt(prompt.request, writer=writer(stub))
    assert result.status == "failed"
    assert "refused the API key" in result.explanation


def test_pictures_go_with_the_last_turn(stub: Any) -> None:
    from ovita.writers.base import WritingBudget
    from ovita.writers.models.exchange import ModelRequest

    stub.script(stub.says("a cup"))
    ask = ModelRequest("Look.", ("one", "two", "three"), "text", False, 0.0, 100, pictures=(b"\x89PNG...",))
    assert writer(stub).exchange(ask, WritingBudget()).text == "a cup"
    _, first, _, last = stub.requests[0]["body"]["messages"]
    assert first["content"] == [{"type": "text", "text": "one"}] or first["content"] == "one"
    kinds = [part["type"] for part in last["content"]]
    assert kinds == ["image_url", "text"] and last["content"][0]["image_url"]["url"].startswith(
        "data:image/png;base64,"
    )
