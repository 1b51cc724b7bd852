"""The examples of planners and words run."""

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(
    ("name", "prints"),
    [
        ("plan_places.py", "inside 'box'"),
        ("plan_vehicles.py", "The rollout stays within"),
        ("from_words.py", "Where does it start?"),
    ],
)
def test_an_example_runs(name, prints, capsys):
    runpy.run_path(str(EXAMPLES / name))
    assert prints in capsys.readouterr().out
