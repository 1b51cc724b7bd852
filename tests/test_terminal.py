"""The terminal: the tour, and `ovita chat` as a person types into it."""

import io
import os
import pty
import select
import shlex
import subprocess
import sys
import time

import pytest

import command_line
from command_line import ovita
from ovita.cli.common import called
from ovita.cli.sessions_ import completed
from ovita.dialogue.session import Session
from ovita.io import load_task
from ovita.result import Adaptation

SCENE = (
    '{"trajectory": [[0, 0, 0, 0.5], [0.5, 0, 0, 0.5], [1, 0, 0, 0.5]],'
    ' "objects": [{"name": "flower vase", "x": 0.5, "y": 0.3, "z": 0}, {"name": "cup", "x": 0.2, "y": 0.3, "z": 0}]}'
)


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def talk(tmp_path, monkeypatch):
    """Types lines into a chat about one file, as at a terminal."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    path = tmp_path / "scene.json"
    path.write_text(SCENE)

    def typed(*lines, options=()):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(command_line.io, "StringIO", Terminal)
            return ovita("chat", path, "--writer", "builtin", *options, stdin="\n".join(lines) + "\n")

    return typed


def test_the_tour_shows_five_steps_and_ends_with_commands_on_files_that_exist(tmp_path):
    done = ovita("tour", "--out", "there", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert [f"[{i}/5]" in done.stdout for i in range(1, 6)] == [True] * 5
    for said in ("Plan", "Limits", "left = 0.2 m", "left = 0.3 m"):
        assert said in done.stdout
    assert load_task(tmp_path / "there" / "scene.json").scene.names
    kept = Adaptation.load(str(tmp_path / "there" / "result.json"))
    assert kept.status == "done" and {p.name: p.value for p in kept.parameters}["left"] == 0.2
    for line in done.stdout.splitlines()[-2:]:
        words = shlex.split(line)
        again = ovita(*words[words.index("adapt" if "adapt" in words else "chat") :], cwd=tmp_path)
        assert again.returncode == 0, (line, again.stderr)


def test_the_demo_ends_with_a_command_that_the_shell_finds(tmp_path, monkeypatch):
    path = tmp_path / "bin" / "ovita"
    path.parent.mkdir()
    path.write_text("#!/bin/sh\n")
    path.chmod(0o755)
    monkeypatch.setattr(sys, "argv", [str(path)])
    assert called() == str(path)
    monkeypatch.setenv("PATH", str(path.parent))
    assert called() == "ovita"


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("/un", ["/undo "]),
        (":un", [":undo "]),
        ("/set le", ["left="]),
        ("stay away from the flo", ["flower vase"]),
        ("stay away from the flower va", ["vase"]),
        ("go near the Cu", ["Cup"]),
        ("go left", []),
        ("recu", []),
    ],
)
def test_the_tab_key_completes_commands_knobs_and_names_of_several_words(line, found):
    assert completed(line, ("redo", "save", "set", "undo"), ("flower vase", "cup"), ("left", "right")) == found


def test_files_are_completed_for_save_and_plot(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "a.json").write_text("{}")
    assert completed("/save re", ("save",), (), ()) == ["results/"]
    assert completed("/plot results/", ("save",), (), ()) == ["results/a.json"]


def test_a_talk_is_kept_at_a_terminal_and_goes_on(talk, tmp_path):
    first = talk("go left by 0.1", "go up by 0.1", "/quit")
    assert "2 turns" not in first.stdout and "earlier talk" not in first.stdout and "--resume" in first.stdout
    second = talk("/resume", "/history", "/set up=0.2", "/quit")
    assert "An earlier talk" in second.stdout and "2. on current: go up by 0.1" in second.stdout, second.stdout
    third = talk(":history", options=["--resume"])
    assert "3 turns so far" in third.stdout
    kept = list((tmp_path / "state" / "ovita" / "chat").iterdir())
    assert len(kept) == 1 and kept[0].stat().st_mode & 0o077 == 0


def test_a_talk_that_has_begun_is_not_replaced_and_nothing_kept_is_said(talk):
    assert "error: no earlier talk" in talk("/resume").stdout
    talk("go left by 0.1")
    assert "error: this talk has begun" in talk("go up by 0.1", "/resume").stdout


def test_without_a_terminal_nothing_is_kept(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    (tmp_path / "scene.json").write_text(SCENE)
    assert ovita("chat", tmp_path / "scene.json", stdin="go left by 0.1\n").returncode == 0
    assert not (tmp_path / "state").exists()


def test_a_mistyped_command_is_guessed(talk):
    said = talk("/hsitory", "/objcts", "/zzz").stdout
    assert "did you mean /history?" in said and "did you mean /objects?" in said and "/help lists them" in said


def test_a_talk_outlives_a_defect_of_the_program(talk, monkeypatch):
    say = Session.say

    def failing(self, said, *options, **named):
        if said == "break":
            raise ZeroDivisionError("division by zero")
        return say(self, said, *options, **named)

    monkeypatch.setattr(Session, "say", failing)
    done = talk("break", "go up by 0.1")
    assert "a defect in ovita (ZeroDivisionError: division by zero; test_terminal.py" in done.stdout
    assert "nothing changed" in done.stdout and "0.10 m up" in done.stdout


def test_keys_at_a_real_terminal(tmp_path):
    """The arrow brings the last line of an earlier process back, and tab completes."""
    pytest.importorskip("readline")
    (tmp_path / "scene.json").write_text(SCENE)

    def session(*typed):
        master, slave = pty.openpty()
        environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state"), "TERM": "dumb"}
        command = [sys.executable, "-m", "ovita", "chat", "scene.json", "--writer", "builtin"]
        shell = subprocess.Popen(command, cwd=tmp_path, env=environment, stdin=slave, stdout=slave, stderr=slave)
        os.close(slave)
        seen, waiting, end = "", list(typed), time.monotonic() + 90
        while shell.poll() is None and time.monotonic() < end:
            if select.select([master], [], [], 0.1)[0]:
                try:
                    seen += os.read(master, 4096).decode()
                except OSError:
                    break
            if waiting and seen.count("> ") > len(typed) - len(waiting):
                os.write(master, waiting.pop(0).encode())
        shell.kill()
        shell.wait()
        os.close(master)
        return seen

    assert "cup at" in session("/obj\t\n", "/quit\n")
    assert "cup at" in session("\x1b[A\x1b[A\n", "/quit\n")
