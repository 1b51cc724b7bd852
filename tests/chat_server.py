"""A chat server on this machine that answers what it is told to, for the tests of whatever asks a language model."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread
from typing import Any

import pytest

KEY_VARIABLES = (
    "OPENAI_API_KEY",
    "OPENAI_BASE_URL",
    "ANTHROPIC_API_KEY",
    "GOOGLE_API_KEY",
    "GEMINI_API_KEY",
    "OLLAMA_API_KEY",
    "OLLAMA_HOST",
    "OVITA_MODEL",
)


@dataclass(frozen=True)
class Scripted:
    """One answer of the stub server."""

    status: int = 200
    body: bytes = b""
    headers: dict[str, str] = field(default_factory=dict)
    delay: float = 0.0


@dataclass
class Stub:
    """A chat server on this machine that answers what it is told to, one answer a request; the last one repeats."""

    url: str = ""
    requests: list[dict[str, Any]] = field(default_factory=list)
    _script: list[Scripted] = field(default_factory=list)
    _over: Event = field(default_factory=Event)

    def script(self, *answers: Scripted) -> None:
        self._script = list(answers)

    def says(self, text: str | None, *, finish: str = "stop", refusal: str | None = None) -> Scripted:
        """A chat completion with this text."""
        message = {"role": "assistant", "content": text, **({"refusal": refusal} if refusal else {})}
        completion = {
            "id": "chat-1",
            "object": "chat.completion",
            "created": 1,
            "model": "stub-1",
            "choices": [{"index": 0, "message": message, "finish_reason": finish}],
            "usage": {"prompt_tokens": 11, "completion_tokens": 7, "total_tokens": 18},
        }
        return Scripted(body=json.dumps(completion).encode())

    def answers(self, **fields: Any) -> Scripted:
        """A chat completion that follows the schema."""
        empty = {"plan": [], "code": "", "assumptions": [], "contacts": [], "question": None, "not_understood": []}
        return self.says(json.dumps({**empty, **fields}))

    def fails(self, status: int, message: str = "no", **headers: str) -> Scripted:
        body = {"error": {"message": message, "type": "error", "code": None}}
        return Scripted(status, json.dumps(body).encode(), {k.replace("_", "-"): v for k, v in headers.items()})

    def sends(self, body: bytes | dict[str, Any], *, delay: float = 0.0) -> Scripted:
        return Scripted(body=body if isinstance(body, bytes) else json.dumps(body).encode(), delay=delay)

    def _next(self) -> Scripted:
        return self._script.pop(0) if len(self._script) > 1 else self._script[0]


def _handler(stub: Stub) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            self._answer(json.loads(self.rfile.read(int(self.headers.get("Content-Length", 0))) or b"{}"))

        def do_GET(self) -> None:
            self._answer({})

        def _answer(self, body: dict[str, Any]) -> None:
            stub.requests.append(
                {"path": self.path, "headers": {k.lower(): v for k, v in self.headers.items()}, "body": body}
            )
            scripted = stub._next()
            if stub._over.wait(scripted.delay):
                return
            try:
                self.send_response(scripted.status)
                headers = {"Content-Type": "application/json", "Content-Length": str(len(scripted.body))}
                for name, value in {**headers, **scripted.headers}.items():
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(scripted.body)
            except (BrokenPipeError, ConnectionResetError):
                pass  # the client gave up waiting, as it should

        def log_message(self, *args: object) -> None:
            pass

    return Handler


@contextmanager
def chat_server() -> Iterator[Stub]:
    """A server that misbehaves on command."""
    stub = Stub()
    server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(stub))
    stub.url = f"http://127.0.0.1:{server.server_address[1]}/v1"
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    yield stub
    stub._over.set()
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture(autouse=True)
def no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    """No key of the person who runs the tests is used."""
    for variable in KEY_VARIABLES:
        monkeypatch.delenv(variable, raising=False)


@pytest.fixture
def stub() -> Iterator[Stub]:
    """A server that misbehaves on command."""
    with chat_server() as server:
        yield server
