"""Real servers for the tests of `ovita serve`, as processes of their own."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from mcp import StdioServerParameters

TOKEN = "token-of-the-tests-0123456789"
OTHER = "token-of-another-owner-98765"
ROWS = [[0.1 * i, 0.0, 0.3, 0.3] for i in range(8)]
CUP = {"name": "cup", "x": 0.3, "y": 0.5, "z": 0.3, "dimensions": [0.08, 0.08, 0.1]}
TASK = {"trajectory": ROWS, "objects": [CUP], "robot": "drone"}


@dataclass(frozen=True)
class ServerProcess:
    """A server that listens, and the folder that all of it is in."""

    process: subprocess.Popen[str]
    address: str
    folder: Path


def environment(folder: Path) -> dict[str, str]:
    kept = {key: value for key, value in os.environ.items() if key in ("PATH", "HOME", "PYTHONPATH", "VIRTUAL_ENV")}
    return {**kept, "XDG_STATE_HOME": str(folder / "state"), "PYTHONWARNINGS": "error::ResourceWarning"}


def started(folder: Path, *options: str) -> ServerProcess:
    command = [sys.executable, "-m", "ovita", "serve", "http", "--port", "0", "--writer", "builtin", *options]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment(folder))
    assert process.stdout is not None
    address = process.stdout.readline().partition(" at ")[2].split(" ")[0]
    return ServerProcess(process, address, folder)


def stopped(server: ServerProcess) -> None:
    server.process.kill()
    server.process.communicate()


def over_stdio(folder: Path, *options: str) -> StdioServerParameters:
    arguments = ["-m", "ovita", "serve", "mcp", "--writer", "builtin", *options]
    return StdioServerParameters(command=sys.executable, args=arguments, env=environment(folder))
