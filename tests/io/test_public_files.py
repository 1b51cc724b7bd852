import json
from pathlib import Path

import numpy as np
import pytest

from ovita.io import load_task, save_task, scene_dict, scene_from_dict

FOLDER = Path(__file__).parents[3] / "shared" / "data" / "ovita-dev"
FILES = sorted(FOLDER.rglob("*.json"))

pytestmark = pytest.mark.skipif(not FILES, reason="needs the public OVITA files, which are not part of the project")


def test_every_file_is_there():
    assert len(FILES) == 114


def test_every_file_loads_and_round_trips(tmp_path):
    for path in FILES:
        task = load_task(path)
        document = json.loads(path.read_text(encoding="utf-8"))
        assert np.array_equal(task.trajectory.to_array(), np.array(document["trajectory"])), path
        assert task.instruction == document["instruction"]
        assert len(task.scene) == len(document["objects"])
        assert (task.extra, task.notes, task.robot) == ({}, (), None)
        assert scene_from_dict(scene_dict(task.scene)) == task.scene
        copy = tmp_path / "copy.json"
        save_task(copy, task)
        assert json.loads(copy.read_text(encoding="utf-8")) == document, path
        again = load_task(copy)
        assert (again.trajectory, again.scene, again.instruction) == (task.trajectory, task.scene, task.instruction)
