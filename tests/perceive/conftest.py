"""A chat server for the detectors that ask a model, and no key of the person who runs the tests."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from chat_server import KEY_VARIABLES, Stub, chat_server


@pytest.fixture(autouse=True)
def _no_keys(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in KEY_VARIABLES:
        monkeypatch.delenv(variable, raising=False)


@pytest.fixture
def stub() -> Iterator[Stub]:
    with chat_server() as server:
        yield server
