"""Local models: the folder, the register, and fetching a file from a server that misbehaves on command."""

from __future__ import annotations

import hashlib
import json
import socket
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import click.testing
import pytest

from ovita.cli.main import cli
from ovita.errors import DownloadError, OvitaError, RequestError
from ovita.writers.models import catalogue as models
from ovita.writers.models.download import fetch

CONTENT = b"GGUF" + bytes(range(256)) * 9000
SHA = hashlib.sha256(CONTENT).hexdigest()


@dataclass
class Hub:
    """A hub on this machine that redirects to its storage, as the public one does."""

    url: str = ""
    content: bytes = CONTENT
    tag: str = SHA
    status: int = 200
    cuts: int = 0
    """How many of the next answers break off in the middle."""
    ranges: bool = True
    asked: list[tuple[str, str]] = field(default_factory=list)


def _handler(hub: Hub) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            wanted = self.headers.get("Range", "")
            hub.asked.append((self.path, wanted))
            if hub.status != 200:
                return self._answer(hub.status, b"", {})
            if not self.path.startswith("/storage/"):
                linked = {"X-Linked-ETag": f'"{hub.tag}"', "X-Linked-Size": str(len(hub.content))}
                return self._answer(302, b"", {"Location": f"/storage{self.path}", **(linked if hub.tag else {})})
            start = int(wanted.removeprefix("bytes=").rstrip("-")) if wanted and hub.ranges else 0
            if start >= len(hub.content):
                return self._answer(416, b"", {"Content-Range": f"bytes */{len(hub.content)}"})
            span = {"Content-Range": f"bytes {start}-{len(hub.content) - 1}/{len(hub.content)}"} if start else {}
            self._answer(206 if start else 200, hub.content[start:], span)

        def _answer(self, status: int, body: bytes, headers: dict[str, str]) -> None:
            self.send_response(status)
            for name, value in {"Content-Length": str(len(body)), **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            if hub.cuts and body:
                hub.cuts -= 1
                body = body[: len(body) // 2]
            self.wfile.write(body)

        def log_message(self, *args: object) -> None:
            pass

    return Handler


@pytest.fixture
def hub(monkeypatch: pytest.MonkeyPatch) -> Iterator[Hub]:
    hub = Hub()
    server = ThreadingHTTPServer(("127.0.0.1", 0), _handler(hub))
    hub.url = f"http://127.0.0.1:{server.server_address[1]}"
    thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    monkeypatch.setenv("HF_ENDPOINT", hub.url)
    monkeypatch.setenv("no_proxy", "127.0.0.1")
    monkeypatch.setattr("ovita.writers.models.download.PAUSE", 0.01)
    known = models.Known("toy-0.1b", "toys/toy", "toy.gguf", len(CONTENT), SHA, "Apache-2.0", "a toy")
    monkeypatch.setattr(models, "KNOWN", (known, *models.KNOWN))
    yield hub
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture
def target(tmp_path: Path) -> Path:
    return tmp_path / "models" / "toy.gguf"


def ask(*arguments: str) -> click.testing.Result:
    return click.testing.CliRunner().invoke(cli, ["models", *arguments])


# Fetching


def test_a_file_is_fetched_whole(hub: Hub, target: Path) -> None:
    told: list[tuple[int, int]] = []
    assert fetch(f"{hub.url}/a", target, tell=lambda here, total: told.append((here, total))) == SHA
    assert target.read_bytes() == CONTENT and told[-1] == (len(CONTENT), len(CONTENT))
    assert [file.name for file in target.parent.iterdir()] == ["toy.gguf"]


def test_a_broken_connection_is_taken_up_where_it_broke(hub: Hub, target: Path) -> None:
    hub.cuts = 3
    assert fetch(f"{hub.url}/a", target, sha256=SHA) == SHA
    starts = [wanted for path, wanted in hub.asked if path.startswith("/storage/")]
    assert starts[0] == "" and len(starts) == 4 and len(set(starts)) == 4
    assert target.read_bytes() == CONTENT


def test_what_an_earlier_run_left_is_taken_up(hub: Hub, target: Path) -> None:
    target.parent.mkdir(parents=True)
    part = target.with_name("toy.gguf.part")
    part.write_bytes(CONTENT[:1000])
    fetch(f"{hub.url}/a", target, sha256=SHA)
    assert target.read_bytes() == CONTENT and ("/storage/a", "bytes=1000-") in hub.asked
    target.unlink()
    part.write_bytes(CONTENT)
    assert fetch(f"{hub.url}/a", target, sha256=SHA) == SHA, "all of it was there already"


@pytest.mark.parametrize("left", [b"x" * 50, b"x" * (len(CONTENT) + 10)], ids=["other bytes", "too many bytes"])
def test_leftovers_of_another_file_do_no_harm(hub: Hub, target: Path, left: bytes) -> None:
    target.parent.mkdir(parents=True)
    target.with_name("toy.gguf.part").write_bytes(left)
    if len(left) < len(CONTENT):
        with pytest.raises(DownloadError, match="wrong checksum"):
            fetch(f"{hub.url}/a", target, sha256=SHA)
    assert fetch(f"{hub.url}/a", target, sha256=SHA) == SHA


def test_a_server_without_ranges_starts_again(hub: Hub, target: Path) -> None:
    hub.ranges = False
    hub.cuts = 1
    assert fetch(f"{hub.url}/a", target, sha256=SHA) == SHA
    assert target.read_bytes() == CONTENT


def test_a_connection_that_keeps_breaking_is_given_up_and_kept(hub: Hub, target: Path) -> None:
    hub.ranges = False
    hub.cuts = 1000
    with pytest.raises(DownloadError, match=r"broke after 1 MB; run the command again to go on from there"):
        fetch(f"{hub.url}/a", target, sha256=SHA)
    assert not target.exists() and target.with_name("toy.gguf.part").exists()
    hub.ranges, hub.cuts = True, 0
    assert fetch(f"{hub.url}/a", target, sha256=SHA) == SHA


def test_a_wrong_checksum_leaves_nothing_behind(hub: Hub, target: Path) -> None:
    hub.tag = ""
    with pytest.raises(DownloadError, match=r"127\.0\.0\.1 sent for toy\.gguf has the wrong checksum"):
        fetch(f"{hub.url}/a", target, sha256="0" * 64)
    assert not list(target.parent.iterdir())


def test_the_checksum_that_the_hub_states_counts_too(hub: Hub, target: Path) -> None:
    hub.tag = "1" * 64
    with pytest.raises(DownloadError, match="wrong checksum"):
        fetch(f"{hub.url}/a", target)
    with pytest.raises(DownloadError, match="now has another file there than the one that is known to be good"):
        fetch(f"{hub.url}/a", target, sha256=SHA)
    assert not target.exists()


@pytest.mark.parametrize(
    ("status", "message"),
    [
        (404, "has no such file"),
        (401, "does not hand the file out"),
        (503, r"127\.0\.0\.1 fails \(503\); try again later"),
    ],
)
def test_refusals(hub: Hub, target: Path, status: int, message: str) -> None:
    hub.status = status
    with pytest.raises(DownloadError, match=message):
        fetch(f"{hub.url}/a", target)
    assert len(hub.asked) == (5 if status == 503 else 1)


def test_no_network(target: Path) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(DownloadError) as caught:
        fetch(f"http://127.0.0.1:{port}/a", target)
    assert str(caught.value) == (
        "127.0.0.1 cannot be reached; without it, use --writer builtin, which needs no model, or bring a .gguf file"
        " here by other means and name it: ovita models add NAME FILE"
    )


def test_no_space(hub: Hub, target: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ovita.writers.models.download.SPARE", 10**18)
    with pytest.raises(DownloadError, match=r"GB free, and 0\.0 GB are missing; make room, or set OVITA_MODELS"):
        fetch(f"{hub.url}/a", target)


def test_a_folder_that_cannot_be_written(hub: Hub, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DownloadError, match="cannot be written"):
        fetch(f"{hub.url}/a", tmp_path / "file" / "toy.gguf")


# The command line


def test_pull_list_and_the_default(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    before = ask("list")
    assert before.exit_code == 0 and "None is here" in before.output and models.default_model() == ""
    pulled = ask("pull", "toy-0.1b")
    assert pulled.exit_code == 0, pulled.output
    assert SHA in pulled.output and "Apache-2.0" in pulled.output
    assert models.checksum("toy.gguf") == SHA
    assert models.model_file("toy-0.1b").read_bytes() == CONTENT == models.model_file("toy").read_bytes()
    assert "is here already" in ask("pull", "toy-0.1b").output
    monkeypatch.setattr("ovita.writers.models.catalogue.find_spec", lambda name: object())
    listed = ask("list").output
    assert "checked" in listed and "llamacpp:toy-0.1b" in listed
    assert models.default_model() == "llamacpp:toy-0.1b"
    monkeypatch.setattr("ovita.writers.models.catalogue.find_spec", lambda name: None)
    assert models.default_model() == "" and "pip install 'ovita[local]'" in ask("list").output


def test_pull_of_an_unknown_name(hub: Hub) -> None:
    with pytest.raises(RequestError, match=r"no model 'gpt' is known; known are toy-0\.1b, qwen"):
        models.known_named("gpt")
    assert isinstance(ask("pull", "gpt").exception, RequestError)


def test_add(tmp_path: Path) -> None:
    file = tmp_path / "mine.gguf"
    file.write_bytes(CONTENT)
    added = ask("add", "mine", str(file))
    assert added.exit_code == 0 and models.present() == {"mine": file} and "mine" in ask("list").output
    file.unlink()
    assert models.present() == {}, "a file that is gone is no model that is here"


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("Big Name", CONTENT, "cannot be a model's name"),
        ("../x", CONTENT, "cannot be a model's name"),
        ("qwen3-4b", CONTENT, "is the name of a known model"),
        ("mine", b"PK\x03\x04", "is no GGUF model file"),
        ("mine", None, "there is no model file"),
    ],
)
def test_what_cannot_be_added(tmp_path: Path, name: str, content: bytes | None, message: str) -> None:
    file = tmp_path / "mine.gguf"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(RequestError, match=message):
        models.add(name, str(file))
    assert models.present() == {}


def test_a_register_that_cannot_be_read() -> None:
    folder = models.models_dir()
    folder.mkdir(parents=True)
    (folder / "models.json").write_text("{")
    with pytest.raises(RequestError, match=r"models\.json cannot be read; remove it"):
        models.present()


def test_two_names_with_the_same_beginning(tmp_path: Path) -> None:
    file = tmp_path / "m.gguf"
    file.write_bytes(CONTENT)
    models.add("mine-a", str(file))
    models.add("mine-b", str(file))
    with pytest.raises(RequestError, match="'mine' may be mine-a or mine-b; name one of them"):
        models.model_file("mine")


@pytest.mark.parametrize("known", models.KNOWN, ids=lambda known: known.name)
def test_known_models_are_described(known: Any) -> None:
    assert known.url.startswith("https://huggingface.co/") and known.url.endswith(".gguf")
    assert len(known.sha256) == 64 and int(known.sha256, 16) and known.size > 4e8
    assert known.licence == "Apache-2.0", "free to use, change and pass on"


def test_the_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    assert models.models_dir() == tmp_path / "models"
    monkeypatch.delenv("OVITA_MODELS")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert models.models_dir() == tmp_path / "ovita" / "models"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert models.models_dir() == Path.home() / ".cache" / "ovita" / "models"


def test_what_was_pulled_is_recorded(hub: Hub) -> None:
    ask("pull", "toy-0.1b")
    register = json.loads((models.models_dir() / "models.json").read_text())
    assert register["sha256"] == {"toy.gguf": SHA}
    assert issubclass(DownloadError, OvitaError)
