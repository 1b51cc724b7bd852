"""Planning from place to place: legal by the independent verifier, deterministic, and plain about what cannot be."""

from importlib.util import find_spec

import numpy as np
import pytest

from ovita import Robot, Scene, SceneObject, load_task, plan, verify
from ovita.errors import RequestError
from ovita.limits import ConstraintOptions
from ovita.sources.places import locate, read_place
from ovita.sources.planner import spread

SAMPLED = pytest.mark.skipif(find_spec("ompl") is None, reason="ompl is not installed (extra planning)")
PLANNERS = ["limits", pytest.param("rrt_connect", marks=SAMPLED), pytest.param("rrt_star", marks=SAMPLED)]

TABLE = Scene(
    (
        SceneObject("box", [0.3, -0.3, 0.05], [0.12, 0.1, 0.1]),
        SceneObject("plate", [0.3, 0.3, 0.01], [0.22, 0.22, 0.02]),
        SceneObject("bottle", [0.3, 0.0, 0.13], [0.07, 0.07, 0.26]),
    )
)
WALL = Scene(
    (
        SceneObject("wall", [0.0, 0.0, 0.0], [0.2, 3.0, 1.0]),
        SceneObject("crate", [-1.5, 0.0, 0.0], [0.2, 0.2, 0.2]),
        SceneObject("door", [1.5, 0.0, 0.0], [0.2, 0.2, 0.2]),
    )
)


def legal(found, start=None, goal=None):
    path, request = found.trajectory, found.request
    checks = verify(
        path,
        request.scene,
        request.robot,
        proposed=path,
        original=path,
        options=ConstraintOptions(repair_original=True),
    )
    assert [check.name for check in checks if not check.held] == []
    assert np.allclose(path.positions[0], request.start.position, atol=1e-9)
    assert np.allclose(path.positions[-1], request.goal.position, atol=1e-9)
    assert path.stall is None and path.speeds[0] == path.speeds[-1] == 0.0
    return path


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize(
    ("scene", "robot", "start", "goal", "via"),
    [
        (TABLE, "arm", "box", "plate", ()),
        (TABLE, "drone", "0.3,-0.3,0.2", "plate", ("above the bottle",)),
        (WALL, "ground", "crate", "door", ()),
    ],
)
def test_a_plan_is_legal_and_the_same_again(planner, scene, robot, start, goal, via):
    found, again = (
        plan(scene, start=start, goal=goal, via=via, robot=robot, planner=planner, seed=3, time_limit=60) for _ in "ab"
    )
    assert found.ok, found.problems
    path = legal(found)
    assert path == again.trajectory
    for anchor in found.request.via:
        assert np.linalg.norm(path.positions - anchor.position, axis=1).min() < 1e-9


@SAMPLED
def test_seeds_matter_to_planners_that_sample():
    one, two = (plan(WALL, start="crate", goal="door", robot="ground", planner="rrt_connect", seed=s) for s in (1, 2))
    assert one.trajectory != two.trajectory


@pytest.mark.parametrize(
    ("start", "goal", "robot", "words"),
    [
        ("0.3,-0.3,0.05", "plate", "drone", ("The start", "inside 'box'", "choose another place")),
        ("box", "9,0,0.5", "drone", ("The goal", "outside the workspace")),
        ("box", "box", "drone", ("same place",)),
    ],
)
def test_places_that_cannot_be_are_explained(start, goal, robot, words):
    found = plan(TABLE, start=start, goal=goal, robot=robot)
    assert not found.ok and found.trajectory is None
    assert all(word in " ".join(found.problems) for word in words)
    with pytest.raises(RequestError):
        found.task()


@pytest.mark.parametrize("planner", ["limits", pytest.param("rrt_connect", marks=SAMPLED)])
def test_no_way_is_explained(planner):
    closed = Scene((SceneObject("fence", [0.0, 0.0, 0.0], [0.2, 8.0, 1.0]), *WALL.objects[1:]))
    found = plan(closed, start="crate", goal="door", robot="ground", planner=planner, time_limit=0.3)
    assert not found.ok
    assert "fence" in found.problems[0] if planner == "limits" else "allow more time" in found.problems[0]


def test_few_waypoints_still_go_around():
    found = plan(WALL, start="crate", goal="door", robot="ground", waypoints=4)
    assert found.ok
    legal(found)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.1, -0.2, 0.3", [0.1, -0.2, 0.3]),
        ("10 cm above the box", [0.3, -0.3, 0.2]),
        ("0.1 m left of the bottle", [0.165, 0.0, 0.13]),
        ("20 cm behind the bottle", [0.3, -0.235, 0.13]),
        ("between the box and the plate", [0.3, 0.0, 0.03]),
    ],
)
def test_places_in_words(text, expected):
    anchor = locate(read_place(text, TABLE), TABLE, Robot.preset("arm"))
    assert np.allclose(anchor.position, expected, atol=1e-9)


@pytest.mark.parametrize("text", ["", "the moon", "above", "0.1, 0.2", "box plate", "nan,0,0"])
def test_what_is_no_place_is_refused(text):
    with pytest.raises(RequestError, match="is no place"):
        read_place(text, TABLE)


def test_a_place_that_fits_two_objects_is_asked_about():
    two = Scene((SceneObject("red cup", [0, 0, 0]), SceneObject("blue cup", [1, 0, 0])))
    with pytest.raises(RequestError, match=r"red cup.*blue cup"):
        read_place("the cup", two)


def test_a_rover_cannot_be_above_anything():
    with pytest.raises(RequestError, match="stays on the ground"):
        plan(WALL, start="above the crate", goal="door", robot="ground")


@pytest.mark.parametrize("bad", [{"waypoints": 1}, {"speed": -1.0}, {"time_limit": 0.0}, {"seed": -1}])
def test_numbers_that_make_no_sense_are_refused(bad):
    with pytest.raises(RequestError):
        plan(TABLE, start="box", goal="plate", **bad)


def test_vertices_are_waypoints():
    corners = np.array([[0.0, 0, 0], [1.0, 0, 0], [1.0, 0.1, 0]])
    line, at = spread(corners, 12, 0.5)
    assert len(line) == 12 and at[0] == 0 and at[-1] == 11
    assert np.array_equal(line.positions[at], corners)


def test_a_plan_is_saved_and_adapted(tmp_path):
    from click.testing import CliRunner

    from ovita.cli.main import cli
    from ovita.io import save_task

    task = plan(TABLE, start="box", goal="plate", robot="arm").task()
    scene, out = tmp_path / "scene.json", tmp_path / "planned.json"
    save_task(scene, task)
    done = CliRunner().invoke(
        cli, ["plan", str(scene), "--from", "box", "--to", "plate", "--robot", "arm", "-o", str(out)]
    )
    assert done.exit_code == 0, done.output
    saved = load_task(out)
    assert saved.trajectory == task.trajectory and saved.robot == "arm"
    assert saved.extra["planned"]["from"] == "above the box"
    refused = CliRunner().invoke(cli, ["plan", str(scene), "--from", "9,9,9", "--to", "plate", "--robot", "arm"])
    assert refused.exit_code == 4 and "outside the workspace" in refused.output


def test_a_controlled_vehicle_keeps_the_limits_and_its_timestep():
    """A drone here; a rover drives in examples/plan_vehicles.py."""
    scene, robot, start, goal = TABLE, "drone", "0.5,-0.3,0.3", "left of the bottle"
    found = plan(scene, start=start, goal=goal, robot=robot, planner="mpc", time_limit=120)
    assert found.ok, found.problems
    path = legal(found)
    careful = plan(scene, start=start, goal=goal, robot=robot)
    assert path.length < 1.3 * careful.trajectory.length
    assert found.notes[0].startswith("The rollout stays within")
    assert np.allclose(path.durations[2:-3], path.timestep, rtol=0.25)


def test_a_model_predicts_what_it_does():
    from ovita.sources.mpc import DoubleIntegrator, Unicycle

    for vehicle, z in (
        (DoubleIntegrator(4.0, 1.0), np.array([0.1, 0.2, 0.3, 0.4, 0.1, 0.0])),
        (Unicycle(0.5, 1.0, 2.0, 0.0), np.array([0.1, 0.2, 0.7, 0.5])),
    ):
        a, b, c = vehicle.linear(z)
        for u in (np.zeros(len(vehicle.most)), 0.2 * vehicle.most):
            assert np.abs(a @ z + b @ u + c - vehicle.step(z, u)).max() < 3e-3


def test_a_controller_that_runs_out_of_time_says_so():
    found = plan(WALL, start="crate", goal="door", robot="ground", planner="mpc", time_limit=0.05)
    assert not found.ok and "allow more" in found.problems[0]


def test_a_speed_above_the_robots_highest_is_said_to_be_lowered():
    found = plan(Scene(), start=(0.0, 0.0, 0.5), goal=(0.3, 0.3, 0.5), robot="arm", speed=100.0)
    top = Robot.preset("arm").max_speed
    assert found.trajectory.speeds.max() <= top
    assert any(f"The speed is {top:g}" in text and "not 100" in text for text in found.sentences())
    assert not plan(Scene(), start=(0.0, 0.0, 0.5), goal=(0.3, 0.3, 0.5), robot="arm", speed=0.1).request.lowered


@pytest.mark.parametrize(
    ("place", "says"),
    [("above the cup", "the scene holds no objects"), ("1,2", "give x,y,z in metres"), ("1,nan,2", "is no place")],
)
def test_a_place_in_a_scene_without_objects_is_coordinates(place, says):
    with pytest.raises(RequestError, match=says):
        read_place(place, Scene())


def test_coordinates_may_have_exponents():
    assert read_place("1e-1,-2.5E-2,3", Scene()).point == (0.1, -0.025, 3.0)
