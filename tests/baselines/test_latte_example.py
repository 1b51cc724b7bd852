"""The worked adapter for LaTTe, with a stand-in for the checkout: the scaling there and back, and the protocol."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ovita.baselines.command import question
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

SCRIPT = Path(__file__).parents[2] / "examples" / "latte_baseline.py"
REFINER = """
class Motion_refiner:
    def __init__(self, **options):
        print("loading BERT model...")
    def apply_interaction(self, model, d, text, label=False):
        path, objects = d["input_traj"], d["obj_poses"]
        assert path.shape == (40, 4) and abs(path).max() <= 0.275 + 1e-9 and abs(objects).max() <= 0.275 + 1e-9
        assert d["locality_factor"] == 0.5 and text == d["text"] == "go up" and model == "weights model.h5"
        return (path + [0.0, 0.0, 0.055, -0.11])[None], path
"""


def asked(tmp_path, *requests):
    (tmp_path / "src").mkdir()
    (tmp_path / "src" / "motion_refiner_4D.py").write_text(REFINER)
    (tmp_path / "src" / "TF4D_mult_features.py").write_text(
        "def load_model(f, delimiter):\n    return 'weights ' + f\n"
    )
    lines = "".join(json.dumps(question(request)) + "\n" for request in requests)
    command = [sys.executable, str(SCRIPT), str(tmp_path), "model.h5"]
    done = subprocess.run(command, input=lines, capture_output=True, text=True, timeout=60, check=True)
    assert "loading BERT" in done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


def test_an_answer_is_scaled_back_to_the_scene(tmp_path):
    rows = np.column_stack([np.linspace(1, 3, 81), np.zeros(81), np.full(81, 0.5), np.linspace(0.1, 0.3, 81)])
    cup = SceneObject("cup", [2.0, 1.0, 0.5])
    seven = Scene(tuple(SceneObject(f"cup {i}", [0.0, 0.0, 0.0]) for i in range(7)))
    path = Trajectory.from_array(rows)
    got, refused = asked(tmp_path, Request("go up", path, Scene((cup,))), Request("go up", path, seven))
    new = np.array(got["trajectory"])
    # The scene's 2 m fill 0.55 of the box, so 0.055 there is 0.2 m; so do speeds' 0.2 m/s, so -0.11 is -0.04 m/s.
    assert new[:, :3] == pytest.approx(np.column_stack([np.linspace(1, 3, 40), np.zeros(40), np.full(40, 0.7)]))
    assert new[:, 3] == pytest.approx(np.linspace(0.06, 0.26, 40))
    assert refused == {"error": "LaTTe takes 1 to 6 objects, not 7"}
