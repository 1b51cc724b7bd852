"""The soak of benchmarks/ros.py, small: nothing is lost or comes twice, though the node is killed in between."""

import os
import runpy
from pathlib import Path

import pytest

pytest.importorskip("cyclonedds")
pytest.importorskip("rosbags")

BENCHMARK = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "ros.py"))


def test_a_node_that_is_killed_loses_and_doubles_nothing():
    said = BENCHMARK["killed"](4, 1, 120 + os.getpid() % 80)
    assert "killed 1 times" in said and "all of 20 poses: True, 0 lost, 0 doubled" in said, said
