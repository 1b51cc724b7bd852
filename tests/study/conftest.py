"""A small study whose participants are simulated: their answers are test data and say nothing about anything."""

import pytest
from made_study import write_design, write_run


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
