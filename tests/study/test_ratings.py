"""Answers survive a trip through CSV, and a bad line is named."""

from dataclasses import replace

import pytest

from ovita.errors import FormatError
from ovita.study.ratings import COLUMNS, Rating, allowed, answers_csv, read_answers

ONE = Rating("p1", "expert", "rate", "cup", "A", True, "correctness", 4.0, 3, 12.5, "2026-01-01T10:00:00Z", False, "p2")
OTHERS = (
    replace(ONE, question="preference", condition="A|B", value="none", explanation=False),
    replace(ONE, question="comment", value='said "no",\nand left'),
    replace(ONE, question="comment", value=""),
    replace(ONE, question="tlx_effort", value=62.5, pilot=True, adapter=""),
)


def test_answers_come_back_as_they_went(tmp_path):
    (tmp_path / "ratings.csv").write_text(answers_csv((ONE, *OTHERS)))
    assert read_answers(tmp_path / "ratings.csv") == (ONE, *OTHERS)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"value": "6"}, "line 2 has the value '6', expected a number from 1 to 5"),
        ({"value": "nan"}, "line 2 has the value 'nan', expected a number from 1 to 5"),
        ({"value": ""}, "line 2 has no value"),
        ({"phase": "later"}, "line 2 has the phase 'later'"),
        ({"pilot": "maybe"}, "line 2 has the pilot 'maybe'; it is 1 or 0"),
        ({"seconds": "-1"}, "line 2 has the seconds '-1', expected a number"),
        ({"participant": ""}, "line 2 has no participant"),
    ],
)
def test_a_bad_line_is_named(tmp_path, change, said):
    row = dict(zip(COLUMNS, answers_csv([ONE]).splitlines()[1].split(","), strict=True)) | change
    file = tmp_path / "ratings.csv"
    file.write_text(",".join(row) + "\n" + ",".join(row.values()) + "\n")
    with pytest.raises(FormatError) as error:
        read_answers(file)
    assert said in str(error.value)


def test_a_missing_column_is_named(tmp_path):
    file = tmp_path / "ratings.csv"
    file.write_text("participant,value\np1,3\n")
    with pytest.raises(FormatError, match="the column 'group' is missing"):
        read_answers(file)


def test_ranges_go_by_the_question():
    assert allowed("sus_10") == (1.0, 5.0) and allowed("umux_2") == (1.0, 7.0) and allowed("tlx_effort") == (0.0, 100.0)
