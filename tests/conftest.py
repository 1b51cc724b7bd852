"""What every test needs: no model of the person who runs the tests is ever used, and no test depends on the clock."""

from __future__ import annotations

import os
import sys
from itertools import count

import pytest

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does it, before numpy is imported

# Tests start Python some hundred times, and each time would compile the whole package anew; so would pytest with
# Hypothesis, whose assertions it rewrites.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

from hypothesis import HealthCheck, settings  # noqa: E402
from hypothesis.internal.conjecture import providers  # noqa: E402

settings.register_profile(
    "ovita", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow], max_examples=40
)
settings.load_profile("ovita")

# Hypothesis also draws numbers that stand in the modules imported so far, which hang on what this worker ran before:
# one run failed at an example that no other met. There is no setting for it.
providers._get_local_constants = lambda: providers._local_constants

_numbers = count()


def _on_its_way(descriptor: int) -> None:
    os.fstat(descriptor)  # raises as fsync does where there is no such file


os.fsync = _on_its_way  # no test pulls the plug: what was written outlives a process that is killed without it


@pytest.fixture(autouse=True)
def _no_models(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    monkeypatch.delenv("OVITA_MODEL", raising=False)
    # Each test has its own, and only a name: thousands of folders cost more than most tests do.
    monkeypatch.setenv("OVITA_MODELS", str(tmp_path_factory.getbasetemp() / f"models-of-test-{next(_numbers)}"))
