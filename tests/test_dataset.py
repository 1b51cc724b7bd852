"""Every file of the public dataset's half that lies beside the checkout goes through the whole chain."""

from pathlib import Path

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.io import load_task
from ovita.paths.robot import Robot
from ovita.request import Request
from ovita.result import Adaptation

FOLDER = Path(__file__).parents[1].parent / "shared" / "data" / "ovita-dev"
FILES = sorted(FOLDER.rglob("*.json"))

pytestmark = pytest.mark.skipif(not FILES, reason=f"the dataset is not at {FOLDER}; its licence keeps it out of here")


def preset_for(path):
    return {"Drone": "drone", "Manipulator": "arm", "Ground_robot": "ground"}.get(path.parent.name, "none")


@pytest.mark.parametrize("path", FILES, ids=[str(p.relative_to(FOLDER)) for p in FILES])
def test_every_file_gives_a_result_that_loads_again(path, tmp_path):
    task = load_task(path)
    for robot in dict.fromkeys(["none", preset_for(path)]):
        result = adapt(Request(task.instruction, task.trajectory, task.scene, Robot.preset(robot)), writer="builtin")
        refused = ("not_understood", "needs_clarification", "needs_confirmation", "answered")
        assert result.status in ("done", "limited", "not_as_meant", *refused), result.error
        assert result.message
        if result.status in ("done", "limited", "not_as_meant"):
            assert np.isfinite(result.adapted.to_array()).all()
            assert result.constraints.status != "infeasible"
        else:
            assert result.adapted == task.trajectory
        result.save(str(tmp_path / "r.json"))
        assert Adaptation.load(str(tmp_path / "r.json")) == result
