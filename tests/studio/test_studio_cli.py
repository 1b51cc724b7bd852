"""`ovita studio` from the terminal."""

import signal
import subprocess
import sys
import urllib.request

import pytest
from click.testing import CliRunner

from ovita.cli.main import main
from ovita.cli.sessions_ import studio


def error_of(monkeypatch, capsys, *arguments):
    monkeypatch.setattr("sys.argv", ["ovita", "studio", *map(str, arguments)])
    with pytest.raises(SystemExit) as ended:
        main()
    told = capsys.readouterr()
    assert ended.value.code == 2 and told.out == "" and told.err.startswith("error: ") and told.err.count("\n") == 1
    return told.err


def test_mistakes_are_told_in_one_sentence(monkeypatch, capsys, tmp_path):
    here = ("--sessions", tmp_path / "s", "--port", 0)
    assert "no such file" in error_of(monkeypatch, capsys, tmp_path / "nothing.json", *here)
    assert "--token" in error_of(monkeypatch, capsys, "--host", "0.0.0.0", *here)
    assert "12 or more" in error_of(monkeypatch, capsys, "--token", "short", *here)
    assert "unknown writer" in error_of(monkeypatch, capsys, "--writer", "nonsense", *here)
    assert "unknown robot" in error_of(monkeypatch, capsys, "--robot", "nonsense", *here)
    (tmp_path / "file").write_text("")
    assert "--sessions" in error_of(monkeypatch, capsys, "--sessions", tmp_path / "file" / "s", "--port", 0)
    (tmp_path / "bad.json").write_text("{oops")
    assert "this is not JSON" in error_of(monkeypatch, capsys, tmp_path / "bad.json", *here)


def test_without_viser_the_extra_is_named(monkeypatch, capsys, tmp_path):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert "ovita[studio]" in error_of(monkeypatch, capsys, "--sessions", tmp_path / "s", "--port", 0)


def test_help_names_the_token():
    told = CliRunner().invoke(studio, ["--help"]).output
    assert "--token" in told and "makes one" in told


@pytest.mark.parametrize("token, shown", [("auto", True), ("a-token-of-mine", False)])
def test_only_a_token_that_was_made_is_told(monkeypatch, tmp_path, token, shown):
    from ovita.studio import Studio

    monkeypatch.setattr(Studio, "wait", lambda self: None)
    asked = ["--port", "0", "--sessions", str(tmp_path), "--writer", "builtin", "--token", token]
    told = CliRunner().invoke(studio, asked).output
    assert ("?token=" in told) == shown and "a-token-of-mine" not in told


def test_it_starts_serves_and_ends(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-m", "ovita", "studio", "--port", "0", "--sessions", str(tmp_path), "--writer", "builtin"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        line = process.stdout.readline()
        assert line.startswith("The studio is open at http://127.0.0.1:")
        with urllib.request.urlopen(line.split()[-1], timeout=60) as page:
            assert b"ovita studio" in page.read()
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130 and err.strip() == "stopped" and "viser" not in out
