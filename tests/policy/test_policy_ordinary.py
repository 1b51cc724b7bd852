"""Ordinary policies run in the sandbox exactly as they run in plain Python."""

import math
import sys

import numpy as np
import pytest
from ordinary import FUNCTIONS, SCRIPTS

from ovita.policy.check import check
from ovita.policy.reading import parse
from ovita.policy.sandbox import run
from ovita.toolkit import Recorder, namespace

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="strict isolation needs Linux")


def plain(source, line, table):
    """What the policy gives when nothing is around it, with the functions of the script form written anew."""

    def get_trajectory():
        return [dict(zip(("x", "y", "z", "velocity"), row, strict=True)) for row in line.to_array().tolist()]

    def detect_objects(name=None):
        return [
            {
                "name": o.name.lower(),
                "x": float(o.position[0]),
                "y": float(o.position[1]),
                "z": float(o.position[2]),
                "dimensions": list(o.size),
            }
            for o in table
            if name is None or name in o.name.lower()
        ]

    names = {
        **namespace(table.frame, Recorder()),
        "np": np,
        "math": math,
        "get_trajectory": get_trajectory,
        "detect_objects": detect_objects,
        "__name__": "__main__",
    }
    code = compile("from __future__ import annotations\n" + source.replace("from __future__", "# "), "p", "exec")
    exec(code, names)
    result = names["adapt"](line.to_array(), table) if "adapt" in names else names["modified_trajectory"]
    if isinstance(result[0], dict):
        result = [[w["x"], w["y"], w["z"], w.get("speed", w.get("velocity", np.nan))] for w in result]
    rows = np.array([list(r) for r in result], dtype=float)
    if rows.shape[1] == 3:
        rows = np.column_stack([rows, line.speeds])
    lost = np.isnan(rows[:, 3])
    rows[lost, 3] = line.speeds[: len(rows)][lost] if lost.any() else 0.0
    return rows


@pytest.mark.parametrize("name", [f"function/{n}" for n in FUNCTIONS] + [f"script/{n}" for n in SCRIPTS])
def test_as_in_plain_python(name, line, table):
    form, _, key = name.partition("/")
    source = (FUNCTIONS if form == "function" else SCRIPTS)[key]
    check(source)
    policy = parse(source)
    assert policy.form == form
    expected = plain(source, line, table)
    rollout = run(policy, line, table)
    np.testing.assert_allclose(rollout.trajectory.to_array(), expected, rtol=0, atol=1e-12)
    assert not np.array_equal(expected, line.to_array())


def test_there_are_enough():
    assert len(FUNCTIONS) + len(SCRIPTS) >= 40
