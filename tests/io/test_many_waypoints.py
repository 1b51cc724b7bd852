"""Many waypoints are read and written at once, not row by row, and come out as they do row by row."""

import cProfile
import json
import pstats

import numpy as np
import pytest

import ovita as ov
from ovita.io.documents import Table
from ovita.io.json_ import _compact, dumps, seal
from ovita.io.tables import dumps_csv, parse_csv

ROWS = np.column_stack([np.random.default_rng(1).normal(size=(3000, 3)), np.linspace(0.1, 0.9, 3000)])
PATH = ov.Trajectory.from_array(ROWS)
CSV, _ = dumps_csv(PATH)


def calls(function, *arguments):
    """How many calls a call makes."""
    profile = cProfile.Profile()
    profile.runcall(function, *arguments)
    return pstats.Stats(profile).total_calls


@pytest.mark.parametrize("text", [CSV, CSV.replace("\n", "\r\n"), CSV.replace(",", ";"), CSV.replace(",", ", ")])
def test_numbers_are_read_at_once_and_as_cell_by_cell(text):
    assert parse_csv(text, "p.csv").trajectory == PATH
    closely = text.replace("x", '"x"', 1)  # a quoted header calls for the closer look
    assert parse_csv(closely, "p.csv").trajectory == PATH
    assert calls(parse_csv, text, "p.csv") < 1500 < calls(parse_csv, closely, "p.csv")


def test_waypoints_are_written_at_once_and_as_row_by_row():
    document = {
        "trajectory": ROWS.tolist(),
        "objects": [{"name": "], ["}],
        "odd": [[1.0], [[2.0]]],
        "empty": [[], [1.0]],
    }
    text = dumps(document, "p.json")
    assert json.loads(text) == document
    line_by_line = ",\n".join(f"  {_compact(row)}" for row in document["trajectory"])
    assert text.startswith(f'{{\n "trajectory": [\n{line_by_line}\n ],\n "objects": [')
    assert calls(dumps, document, "p.json") < 1000


def test_a_table_is_written_to_the_letter_as_python_writes_it():
    """Seals of saved results are sums over this text, and another writer makes it."""
    random = np.random.default_rng(3)
    spread = random.normal(size=(3000, 4)) * 10.0 ** random.integers(-320, 300, size=(3000, 4))
    odd = [0.0, -0.0, 1e-4, 9.999e-5, 1e-5, 5e-324, 1e15, 1e16, -1e16, 123456789012345680.0, 0.1, 1 / 3]
    for rows in (ROWS, spread, np.array([odd, odd[::-1]]), np.full((5000, 3), 1e-7), np.array([[1e22]])):
        assert Table(rows).text == json.dumps(rows.tolist())


def test_a_saved_result_is_its_document_and_its_seal_holds(tmp_path):
    result = ov.adapt(ROWS[:60], "go left by 0.1", writer="builtin")
    result.save(str(tmp_path / "r.json"))
    document = json.loads((tmp_path / "r.json").read_text())
    assert document == json.loads(json.dumps(result.to_document())) and document["sha256"] == seal(document)
    assert type(result.to_document()["adapted"]) is list
    document["adapted"][3][0] += 1.0
    assert document["sha256"] != seal(document)
    result.to_document()["adapted"][3][0] = 9.0
    assert result.to_document() == json.loads((tmp_path / "r.json").read_text())


def test_200_001_waypoints_are_adapted():
    rows = np.column_stack([np.linspace(0.0, 5.0, 200_001), np.zeros((200_001, 2)), np.full(200_001, 0.1)])
    result = ov.adapt(rows, "go left by 0.1", writer="builtin")
    assert result.status == "done" and np.ptp(result.adapted.positions[:, 0] - rows[:, 0]) < 1e-9


@pytest.mark.parametrize("cell", ["nan", "1e400", "1_0", "", "x", "2e9"])
def test_a_cell_that_is_no_number_is_still_named_with_its_line(cell):
    lines = CSV.splitlines()
    lines[1500] = f"{cell},0,0,1"
    with pytest.raises(ov.OvitaError, match=r"p\.csv: x\[1499\].*line 1501"):
        parse_csv("\n".join(lines), "p.csv")
