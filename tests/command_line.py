"""The command line, run as a person runs it: in this process, or in one of its own where that matters."""

import io
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout

import pytest

from ovita.cli.main import main


def ovita(*arguments, cwd=None, stdin=""):
    """What a command prints and its exit code, without a new Python; an error that is no sentence is raised."""
    words = ["ovita", *map(str, arguments)]
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    code = 0
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(out), redirect_stderr(err):
        patch.setattr(sys, "argv", words)
        patch.setattr(sys, "stdin", io.StringIO(stdin))
        for name in _of_a_person():
            patch.delenv(name)
        if cwd is not None:
            patch.chdir(cwd)
        try:
            main()
        except SystemExit as end:
            code = end.code or 0
    said = []
    for stream in (out, err):
        stream.flush()
        said.append(stream.buffer.getvalue().decode("utf-8"))
    return subprocess.CompletedProcess(words, code, *said)


def process(*arguments, cwd=None, stdin=""):
    """The same in a process of its own."""
    hidden = _of_a_person()
    return subprocess.run(
        [sys.executable, "-m", "ovita", *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=cwd,
        input=stdin,
        timeout=120,
        env={name: value for name, value in os.environ.items() if name not in hidden},
    )


def _of_a_person():
    return [name for name in os.environ if name.endswith("_API_KEY") or name == "OVITA_MODEL"]
