"""Local models: the folder, the register, and pulling from a hub that misbehaves on command."""

from __future__ import annotations

import hashlib
import json
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import Any

import click.testing
import pytest

from ovita.cli.main import cli
from ovita.errors import DownloadError, MissingExtra, RequestError
from ovita.writers.models import catalogue as models

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
    halves: bool = True
    """Whether an answer that breaks off sends half of it, or nothing."""
    ranges: bool = True
    asked: list[tuple[str, str]] = field(default_factory=list)


def _handler(hub: Hub) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        def do_HEAD(self) -> None:
            self.do_GET()

        def do_GET(self) -> None:
            wanted = self.headers.get("Range", "")
            hub.asked.append((f"{self.command} {self.path}", wanted))
            if hub.status != 200:
                return self._answer(hub.status, b"", {})
            if not self.path.startswith("/storage/"):
                about = {"X-Linked-ETag": f'"{hub.tag}"', "X-Linked-Size": str(len(hub.content))}
                storage = hub.url.replace("127.0.0.1", "localhost")  # another host, as with the public hub
                return self._answer(302, b"", {"Location": f"{storage}/storage{self.path}", **about})
            start = int(wanted.removeprefix("bytes=").rstrip("-")) if wanted and hub.ranges else 0
            span = {"Content-Range": f"bytes {start}-{len(hub.content) - 1}/{len(hub.content)}"} if start else {}
            self._answer(206 if start else 200, hub.content[start:], span)

        def _answer(self, status: int, body: bytes, headers: dict[str, str]) -> None:
            self.send_response(status)
            for name, value in {"Content-Length": str(len(body)), **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            if hub.cuts and body and self.command == "GET":
                hub.cuts -= 1
                body = body[: len(body) // 2 if hub.halves else 0]
            if self.command == "GET" and body:
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
    monkeypatch.setenv("no_proxy", "127.0.0.1,localhost")
    monkeypatch.setattr("huggingface_hub.constants.DOWNLOAD_CHUNK_SIZE", 4096)
    monkeypatch.setattr("huggingface_hub.file_download.time.sleep", lambda seconds: None)
    known = models.Known("toy-0.1b", "toys/toy", "toy.gguf", len(CONTENT), SHA, "Apache-2.0", "a toy")
    monkeypatch.setattr(models, "KNOWN", (known, *models.KNOWN))
    yield hub
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.fixture
def target() -> Path:
    return models.models_dir() / "toy.gguf"


def ask(*arguments: str) -> click.testing.Result:
    return click.testing.CliRunner().invoke(cli, ["models", *arguments])


# Pulling


def storage(hub: Hub) -> list[str]:
    """The ranges that were asked of the storage."""
    return [wanted for path, wanted in hub.asked if path.startswith("GET /storage/")]


def test_a_file_is_pulled_whole(hub: Hub, target: Path) -> None:
    assert models.pull("toy-0.1b") == (target, SHA)
    assert target.read_bytes() == CONTENT and storage(hub) == [""]
    assert {path.rpartition("/toys/")[2] for path, _ in hub.asked} == {"toy/resolve/main/toy.gguf"}, "nothing else"
    assert models.checksum("toy.gguf") == SHA


def test_a_broken_connection_is_taken_up_where_it_broke(hub: Hub, target: Path) -> None:
    hub.cuts = 3
    models.pull("toy-0.1b")
    assert target.read_bytes() == CONTENT
    assert storage(hub)[0] == "" and len(set(storage(hub))) == 4


def test_what_an_earlier_command_left_is_taken_up(hub: Hub, target: Path) -> None:
    target.parent.mkdir(parents=True)
    target.with_name("toy.gguf.part").write_bytes(CONTENT[:1000])
    models.pull("toy-0.1b")
    assert target.read_bytes() == CONTENT and storage(hub) == ["bytes=1000-"]


def test_leftovers_of_another_file_do_no_harm(hub: Hub, target: Path) -> None:
    target.parent.mkdir(parents=True)
    target.with_name("toy.gguf.part").write_bytes(b"x" * (len(CONTENT) + 10))
    models.pull("toy-0.1b")
    assert target.read_bytes() == CONTENT
    target.unlink()
    target.with_name("toy.gguf.part").write_bytes(b"x" * 50)
    with pytest.raises(DownloadError, match="wrong checksum"):
        models.pull("toy-0.1b")
    models.pull("toy-0.1b")
    assert target.read_bytes() == CONTENT


def test_a_server_without_ranges_starts_again(hub: Hub, target: Path) -> None:
    hub.ranges, hub.cuts = False, 1
    models.pull("toy-0.1b")
    assert target.read_bytes() == CONTENT


def test_a_connection_that_keeps_breaking_is_given_up_and_kept(hub: Hub, target: Path) -> None:
    hub.cuts, hub.halves = 1000, False
    target.parent.mkdir(parents=True)
    target.with_name("toy.gguf.part").write_bytes(CONTENT[:2_000_000])
    with pytest.raises(DownloadError, match=r"broke after 2 MB; run the command again to go on from there"):
        models.pull("toy-0.1b")
    assert not target.exists()
    hub.cuts = 0
    models.pull("toy-0.1b")
    assert target.read_bytes() == CONTENT


def test_a_wrong_checksum_leaves_no_model_behind(hub: Hub, target: Path) -> None:
    hub.content = b"GGUF" + bytes(len(CONTENT) - 4)
    with pytest.raises(DownloadError, match=r"127\.0\.0\.1 sent for toy\.gguf has the wrong checksum"):
        models.pull("toy-0.1b")
    assert not target.exists() and models.present() == {}


def test_another_file_than_the_known_one_is_not_downloaded(hub: Hub, target: Path) -> None:
    hub.tag = "1" * 64
    with pytest.raises(DownloadError, match="now has another file there than the one that is known to be good"):
        models.pull("toy-0.1b")
    assert not target.exists() and storage(hub) == []


@pytest.mark.parametrize(
    ("status", "message"),
    [
        (404, "has no such file"),
        (401, "does not hand the file out"),
        (503, r"127\.0\.0\.1 fails \(503\); try again later"),
    ],
)
def test_refusals(hub: Hub, status: int, message: str) -> None:
    hub.status = status
    with pytest.raises(DownloadError, match=message):
        models.pull("toy-0.1b")


def test_no_network(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    monkeypatch.setenv("HF_ENDPOINT", f"http://127.0.0.1:{port}")
    with pytest.raises(DownloadError) as caught:
        models.pull("toy-0.1b")
    assert str(caught.value) == (
        "127.0.0.1 cannot be reached; without it, use --writer builtin, which needs no model, or bring a .gguf file"
        " here by other means and name it: ovita models add NAME FILE"
    )


def test_no_space(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(models, "SPARE", 10**18)
    with pytest.raises(DownloadError, match=r"GB free, and 0\.0 GB are missing; make room, or set OVITA_MODELS"):
        models.pull("toy-0.1b")


def test_a_folder_that_cannot_be_written(hub: Hub, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("OVITA_MODELS", str(tmp_path / "file" / "models"))
    with pytest.raises(DownloadError, match="cannot be written"):
        models.pull("toy-0.1b")


def test_the_library_is_an_extra(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "huggingface_hub", None)
    with pytest.raises(MissingExtra, match=r"ovita\[local\]"):
        models.pull("toy-0.1b")


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
    monkeypatch.setenv("OVITA_MODELS", str(tmp_path / "models"))
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
