"""A small study whose participants are simulated: their answers are test data and say nothing about anything."""

import pytest
from made_study import write_design, write_run

from ovita.study import pages


@pytest.fixture
def make_study(tmp_path):
    """Makes a study's folder; keywords change its design."""
    from ovita.study.folder import found_study

    def make(run=None, **changes):
        runs = [run or write_run(tmp_path / "run")]
        return found_study(write_design(tmp_path / "design", **changes), runs, str(tmp_path / "study"))

    return make


@pytest.fixture
def run_folder(tmp_path):
    """Writes a bench run; keywords change its records."""
    return lambda **more: write_run(tmp_path / "run", **more)


@pytest.fixture
def real_pictures():
    """Asks for pictures that are really drawn."""


@pytest.fixture(autouse=True)
def quick_pictures(request, monkeypatch):
    """Leaves pictures out where a test does not ask for them, since they take most of a page's time."""
    if "real_pictures" not in request.fixturenames:
        monkeypatch.setattr(pages, "drawing", lambda *_: {"json": "{}", "left_out": ""})
