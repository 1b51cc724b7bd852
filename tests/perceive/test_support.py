"""The table or floor that things stand on is an object that every stage knows, and that nobody trips over."""

from dataclasses import replace

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita import Request, Robot, Scene, SceneObject, Trajectory, adapt
from ovita.gate import review
from ovita.limits import ConstraintOptions, constrain
from ovita.limits.problem import top_of
from ovita.paths.scene import Frame
from ovita.perceive import View, perceive
from ovita.perceive.segment import name_of
from ovita.sources.planner import plan

CUP = Thing("cylinder", (0.0, 0.12, 0.05), (0.08, 0.08, 0.1), colour="red")
ARM = Robot.preset("arm")
TABLE = SceneObject("table", [0.0, 0.0, -0.015], [1.2, 0.8, 0.03], extra={"kind": "support", "assumed": "thickness"})
SCENE = Scene((SceneObject("cup", [0.0, 0.12, 0.05], [0.08, 0.08, 0.1]), TABLE))


def above(heights, x=(-0.3, 0.3), y=-0.15):
    """A straight path whose heights run through some values."""
    n = 40
    z = np.interp(np.linspace(0, 1, n), np.linspace(0, 1, len(heights)), heights)
    return Trajectory(np.column_stack([np.linspace(*x, n), np.full(n, y), z]), np.full(n, 0.1))


@pytest.fixture(scope="module")
def seen():
    return perceive([picture([CUP], noise=0.002)], names=["red cup"])


def test_a_support_is_an_object_with_the_extent_that_was_seen(seen):
    (support,) = [item for item in seen.scene if item not in seen.things]
    assert support.extra["kind"] == "support" and support.extra["assumed"] == "thickness"
    assert np.allclose(top_of(support)[2], 0.0, atol=2e-3) and seen.scene.objects[-1] is support
    assert seen.scene["red cup"].clearance(support.position[None])[0] > 0.0
    assert support.clearance(np.array([[0.3, 0.3, 0.0]]))[0] < 2e-3, "the visible part of it is covered"
    assert "on the table" in seen.environment


@pytest.mark.parametrize(
    "height, length, name", [(0.74, 0.8, "table"), (0.74, 3.0, "table"), (0.0, 3.0, "floor"), (0.0, 0.9, "table")]
)
def test_a_support_is_called_by_its_height_and_extent(height, length, name):
    assert name_of(height, length) == name


@pytest.mark.parametrize(
    "names, called", [(["desk=floor"], "desk"), (["ground"], "ground"), (["work table"], "work table")]
)
def test_a_support_is_called_as_the_person_says(names, called):
    found = perceive([picture([CUP])], names=names)
    assert found.scene.objects[-1].name == called
    assert not found.missing


@pytest.mark.parametrize("frame, turn", [("rfu", [[0, -1, 0], [1, 0, 0], [0, 0, 1]]), ("ned", np.diag([1, -1, -1]))])
def test_its_own_z_axis_points_up_in_any_frame(frame, turn):
    view, move = picture([CUP]), np.eye(4)
    move[:3, :3] = turn
    scene = perceive([View(view.depth, view.intrinsics, move @ view.pose, view.rgb)], frame=frame).scene
    for one in (scene, scene.in_frame(Frame("flu"))):
        assert one.objects[-1].rotation[:, 2] @ one.frame.direction("up") > 0.999
        assert abs(top_of(one.objects[-1])[2]) < 2e-3


def test_an_adapted_path_does_not_go_through_the_table():
    request = Request("Go down by 0.3", above([0.2, 0.2]), SCENE, ARM)
    result = adapt(request, writer="builtin")
    assert result.status == "limited"
    assert result.adapted.positions[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    without = adapt(Request("Go down by 0.3", above([0.2, 0.2]), Scene(SCENE.objects[:1]), ARM), writer="builtin")
    assert without.adapted.positions[:, 2].min() < -0.05


@pytest.mark.parametrize("low", [0.02, 0.0, -0.004], ids=["2 cm above it", "on it", "as cameras err"])
def test_a_path_may_begin_and_end_at_the_table(low):
    path = above([low, 0.2, 0.2, low])
    result = adapt(Request("Go left by 0.1", path, SCENE, ARM), writer="builtin")
    assert result.status == "done"
    assert np.allclose(result.adapted.positions[:, 2], path.positions[:, 2], atol=1e-9)


def test_from_beside_and_below_a_support_is_kept_at_a_distance_as_any_object():
    known = replace(TABLE, extra={"kind": "support"})
    for y, z in ((-0.42, -0.06), (0.0, -0.06)):
        path = above([z, z], y=y)
        moved = path.with_(positions=path.positions + np.array([0.0, 0.0, 1e-3]))
        found = constrain(moved, Scene((known,)), ARM, original=above([0.3, 0.3]), options=ConstraintOptions())
        kept = TABLE.cuboid.closest(found.trajectory.positions)[0]
        assert found.verdict.status == "repaired" and kept > ARM.radius + ARM.obstacle_margin - 2e-6


def test_a_rover_drives_on_the_floor_that_it_is_on():
    floor = SceneObject("floor", [0.0, 0.0, -0.047], [4.0, 4.0, 0.1], extra={"kind": "support"})
    path = above([0.0, 0.0], x=(-1.0, 1.0))
    result = adapt(Request("Go left by 0.2", path, Scene((floor,)), Robot.preset("ground")), writer="builtin")
    assert result.status == "done" and np.allclose(result.adapted.positions[:, 2], 0.0)


def test_a_plan_starts_and_ends_2_cm_above_the_table_and_none_goes_through_it():
    found = plan(SCENE, start=[-0.2, -0.1, 0.02], goal=[0.2, -0.1, 0.02], robot=ARM)
    assert found.ok and found.trajectory.positions[:, 2].min() > -1e-6
    beside = plan(SCENE, start=[0.0, -0.1, 0.1], goal=[0.0, -0.5, -0.2], robot=ARM)
    assert beside.ok and TABLE.cuboid.closest(beside.trajectory.positions)[0] > 0.0
    assert "inside 'table'" in plan(SCENE, start=[0, -0.1, 0.1], goal=[0, -0.1, -0.01], robot=ARM).problems[0]


def test_places_at_a_table_are_where_they_are_said_to_be():
    found = plan(SCENE, start="2 cm above the table", goal="0.3,0.1,0.2", robot=ARM)
    assert found.trajectory.positions[0][2] == pytest.approx(0.02, abs=1e-6)


def test_the_gate_refuses_a_path_through_the_table(tmp_path):
    path = above([0.2, -0.2, 0.2])
    result = adapt(
        Request("Go left by 0.01", path, SCENE, ARM), writer="builtin", constraints=ConstraintOptions(enabled=False)
    )
    result.save(str(tmp_path / "result.json"))
    assert any("table" in each for each in review(str(tmp_path / "result.json")).refusals)


def test_the_simulated_arm_stands_on_the_table_and_touches_it_only_where_the_path_does():
    for package in ("mujoco", "mink", "toppra", "daqp"):
        pytest.importorskip(package, reason="the simulated arm needs the extra `sim`")
    from ovita import sim

    model = sim.load_model("iiwa")
    path = above([0.25, 0.2, 0.25], x=(-0.2, 0.2))
    base = sim.place([path], SCENE, model, None)
    assert sim.simulate(path, SCENE, model, base=base).report.status == "followed"
