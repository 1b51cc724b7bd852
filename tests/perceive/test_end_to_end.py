"""From a picture to an arm that does what was said."""

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita import Request, Robot, SceneObject, Trajectory, adapt
from ovita.perceive import perceive

CUP = Thing("cylinder", (0.0, 0.1, 0.05), (0.08, 0.08, 0.1), colour="red")
CARTON = Thing("box", (0.1, -0.12, 0.04), (0.1, 0.14, 0.08), 0.4, "blue")


def test_a_picture_becomes_a_verified_path_that_the_arm_follows():
    scene = perceive([picture([CUP, CARTON], noise=0.002, size=(240, 180))], names=["red cup"]).scene
    t = np.linspace(0.0, 1.0, 30)
    points = np.column_stack([-0.25 + 0.5 * t, 0.3 - 0.12 * np.sin(np.pi * t), np.full(30, 0.12)])
    path = Trajectory(points, np.where((t > 0) & (t < 1), 0.2, 0.0))
    result = adapt(Request("Keep 10 cm away from the red cup", path, scene, Robot.preset("arm")), writer="builtin")
    assert result.status == "done"
    truth = SceneObject("cup", np.array(CUP.position), np.array(CUP.size))
    assert truth.clearance(path.positions).min() < 0.08
    assert truth.cuboid.closest(result.adapted.positions)[0] > 0.094

    for package in ("mujoco", "mink", "toppra", "daqp"):
        pytest.importorskip(package, reason="the simulated arm needs the extra `sim`")
    from ovita import sim

    model, limits = sim.load_model("iiwa"), Robot.preset("arm")
    base = sim.place([result.adapted], scene, model, limits)
    report = sim.simulate(result.adapted, scene, model, base=base, limits=limits).report
    assert report.status == "followed"
