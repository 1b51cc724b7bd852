"""Planning for all joints of an arm, judged by the contacts of a simulated one."""

from pathlib import Path

import numpy as np
import pytest

from ovita import Robot, Scene, SceneObject, plan, verify
from ovita.limits import ConstraintOptions

for package in ("ompl", "mujoco", "mink", "toppra", "daqp"):
    pytest.importorskip(package, reason=f"{package} is not installed (extras planning and sim)")

from ovita.sim import Base  # noqa: E402
from ovita.sources.joints import JointPlanner, touched  # noqa: E402

TABLE = Scene(
    (
        SceneObject("box", [0.3, -0.3, 0.05], [0.12, 0.1, 0.1]),
        SceneObject("plate", [0.3, 0.3, 0.01], [0.22, 0.22, 0.02]),
        SceneObject("bottle", [0.3, 0.0, 0.13], [0.07, 0.07, 0.26]),
    )
)


def planned():
    ends = {"start": "0.3,-0.15,0.1", "goal": "0.3,0.15,0.1"}
    return plan(TABLE, **ends, robot="arm", planner="joint", seed=2, time_limit=120)


@pytest.fixture(scope="module")
def found():
    return planned()


def test_the_arm_goes_around_and_touches_nothing_in_physics(found):
    assert found.ok, found.problems
    contacts, worst = touched(found)
    assert contacts == {} and worst < 0.05


def test_the_contacts_of_a_bad_motion_are_found(found):
    """The straight motion of the joints between the ends is through the bottle, or the test would prove nothing."""
    from dataclasses import replace

    from ovita.io.messages import JointMotion

    ends = found.motion.positions[[0, -1]]
    shares = np.linspace(0.0, 1.0, 40)[:, None]
    rows = ends[0] + shares * (ends[1] - ends[0])
    bad = JointMotion(found.motion.names, rows, np.linspace(0.0, 4.0, 40))
    assert "bottle" in touched(replace(found, motion=bad))[0]


def test_path_and_joints_belong_together(found):
    path, motion = found.trajectory, found.motion
    assert len(path) == len(motion.positions) == len(motion.times)
    assert np.allclose(path.positions[[0, -1]], found.request.corners, atol=1e-9)
    options = ConstraintOptions(repair_original=True)
    checks = verify(path, TABLE, Robot.preset("arm"), proposed=path, original=path, options=options)
    assert all(check.held for check in checks)
    assert found.task().extra["planned"]["joints"]["names"][0] == motion.names[0]


def test_equal_seeds_give_equal_motions(found):
    again = plan(
        TABLE, start="0.3,-0.15,0.1", goal="0.3,0.15,0.1", robot="arm", planner="joint", seed=2, time_limit=120
    )
    assert np.array_equal(found.motion.positions, again.motion.positions)


def test_a_place_out_of_reach_is_explained():
    away = JointPlanner(base=Base(5.0, 5.0, 0.0))
    away = plan(TABLE, start="box", goal="plate", robot="arm", planner=away)
    assert not away.ok and "no posture of the arm reaches the start" in away.problems[0].lower()


def test_the_example_runs(capsys):
    import runpy

    runpy.run_path(str(Path(__file__).parents[2] / "examples" / "plan_arm.py"))
    assert "nothing is touched" in capsys.readouterr().out
