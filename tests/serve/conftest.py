"""A server that most tests of `ovita serve` share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

pytest.importorskip("mcp")

from served import OTHER, TOKEN, ServerProcess, started, stopped


@pytest.fixture(scope="package")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    folder = tmp_path_factory.mktemp("serve")
    (folder / "in").mkdir()
    (folder / "out").mkdir()
    running = started(
        folder, "--token", f"tests={TOKEN}", "--token", f"other={OTHER}", "--folder", str(folder / "in"),
        "--save-to", str(folder / "out"), "--allow-send", str(folder / "robot.csv"), "--rate", "100000",
        "--max-request", "20000", "--max-waypoints", "500",
    )  # fmt: skip
    try:
        yield running
    finally:
        stopped(running)
