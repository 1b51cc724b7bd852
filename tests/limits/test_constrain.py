"""The rules of `constrain`: what it leaves alone, what it repairs, and that whole segments are legal."""

import numpy as np
import pytest
from constraint_scenes import faults, segment_distances

from ovita.errors import ConstraintDefinitionError, UnknownObject
from ovita.limits import ConstraintOptions, constrain
from ovita.limits.problem import obstacles_of
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

OPEN = Robot("open", None, max_speed=None)
ROOM = Robot("room", Box((-1, -1, -1), (1, 1, 1)))


def line(n=41, y=0.0, z=0.0, speed=0.5):
    x = np.column_stack([np.linspace(-0.5, 0.5, n), np.full(n, y), np.full(n, z)])
    return Trajectory(x, np.full(n, speed))


def moved(trajectory):
    """An original that differs, so that the path counts as changed."""
    return trajectory.with_(positions=trajectory.positions + 0.01)


def scene(*objects):
    return Scene(tuple(SceneObject(*o) for o in objects))


CUP = ("cup", [0.0, 0.02, 0.0], [0.2, 0.2, 0.2])


def clearance(solution, scene_, robot=OPEN, shape="box"):
    x = solution.trajectory.positions
    return min(segment_distances(body, x).min() for body in obstacles_of(scene_, robot, shape=shape))


def test_a_legal_trajectory_is_returned_bit_by_bit():
    t = line(y=0.5)
    found = constrain(t, scene(CUP), ROOM, original=moved(t))
    assert found.trajectory is t
    assert found.verdict.status == "satisfied"
    assert found.verdict.max_shift == 0
    assert found.verdict.waypoints_changed == 0
    assert found.verdict.ok


def test_a_speed_edit_never_moves_the_path():
    original = line()
    proposed = original.with_(speeds=np.full(41, 3.0))
    found = constrain(proposed, scene(CUP), ROOM, original=original)
    assert np.array_equal(found.trajectory.positions, original.positions)
    assert (found.trajectory.speeds == 1.0).all()
    assert found.verdict.status == "preexisting"
    assert any("already passes" in s and "too close to 'cup'" in s and "leaves" in s for s in found.verdict.sentences())
    repaired = constrain(proposed, scene(CUP), ROOM, original=original, options=ConstraintOptions(repair_original=True))
    assert repaired.verdict.status == "repaired"


def test_an_obstacle_is_cleared_between_waypoints_too():
    t = line(n=9)
    plate = scene(("plate", [0.06, 0.0, 0.0], [0.01, 0.4, 0.4]))
    assert min(obstacles_of(plate, OPEN)[0].signed(t.positions)[0]) > 0, "no waypoint is inside the plate"
    found = constrain(t, plate, OPEN, original=moved(t))
    assert found.verdict.status == "repaired"
    assert clearance(found, plate) > -1e-6
    assert len(found.trajectory) == 9


@pytest.mark.parametrize("offset", [0.0, 1e-9, 1e-3, 0.03, 0.1])
@pytest.mark.parametrize("shape", ["box", "sphere"])
def test_near_the_centre_of_an_obstacle_the_push_stays_small(offset, shape):
    t = line()
    where = scene(("ball", [0.0, offset, 0.0], [0.2, 0.2, 0.2]))
    found = constrain(t, where, OPEN, original=moved(t), options=ConstraintOptions(obstacle_shape=shape))
    body = obstacles_of(where, OPEN, shape=shape)[0]
    assert found.verdict.status == "repaired"
    assert clearance(found, where, shape=shape) > -1e-6
    assert found.verdict.max_shift < body.reach * 1.3


def test_untouched_far_from_the_obstacle():
    t = line(n=401)
    found = constrain(t, scene(("pin", [0.0, 0.0, 0.0], [0.02, 0.02, 0.02])), OPEN, original=moved(t))
    same = (found.trajectory.positions == t.positions).all(axis=1)
    assert same[:90].all()
    assert same[-90:].all()


def test_contacts_are_exempt_and_named():
    t = line()
    found = constrain(t, scene(CUP), OPEN, original=moved(t), contacts=["cup", "the cup"])
    assert found.trajectory is t
    assert found.verdict.exempt == ("cup",)
    assert "'cup' is meant to be touched and was no obstacle." in found.verdict.sentences()
    with pytest.raises(UnknownObject):
        constrain(t, scene(CUP), OPEN, original=t, contacts=["plate"])


def test_box_workspace_and_margin():
    t = line(y=1.4)
    found = constrain(t, Scene(), ROOM, original=moved(t))
    assert found.trajectory.positions[:, 1] == pytest.approx(0.99)
    assert found.verdict.status == "repaired"
    assert found.verdict.checks[0].violation_before == pytest.approx(0.41)


@pytest.mark.parametrize("factor", [1.2, 5.0, 0.02])
def test_shell_holds_exactly_however_far_the_path(factor):
    robot = Robot("arm", Shell((0.1, 0.0, 0.2), 0.15, 1.2))
    t = np.linspace(0, 2, 60)
    x = np.array([0.1, 0.0, 0.2]) + factor * np.column_stack([np.cos(t), np.sin(t), 0.1 * t])
    found = constrain(Trajectory(x, np.ones(60)), Scene(), robot, original=line())
    assert found.verdict.status == "repaired"
    r = np.linalg.norm(found.trajectory.positions - [0.1, 0.0, 0.2], axis=1)
    assert (r <= 1.19 + 1e-6).all()
    assert (r >= 0.16 - 1e-6).all()


def test_a_ground_robot_stays_on_the_ground():
    robot = Robot.preset("ground")
    t = line(z=0.3)
    where = scene(("crate", [0.0, 0.0, 0.1], [0.2, 0.2, 0.4]), ("lamp", [0.0, 0.0, 2.0], [0.2, 0.2, 0.2]))
    for shape in ("box", "sphere"):
        found = constrain(t, where, robot, original=moved(t), options=ConstraintOptions(obstacle_shape=shape))
        assert found.verdict.status == "repaired"
        assert (found.trajectory.positions[:, 2] == 0).all()
        assert clearance(found, where, robot, shape) > -1e-6


def test_overlapping_obstacles_and_a_narrow_gap():
    t = line(n=60)
    wall = [(f"brick {i}", [0.0, y, 0.0], [0.1, 0.5, 3.0]) for i, y in enumerate((-0.28, 0.0, 0.5))]
    gap = scene(*wall[:1], ("right", [0.0, 0.35, 0.0], [0.1, 0.7, 3.0]))
    room = Robot("r", Box((-1, -0.5, -1), (1, 0.6, 1)), max_speed=None)
    assert clearance(constrain(t, scene(*wall), OPEN, original=moved(t)), scene(*wall)) > -1e-6
    through = constrain(t, gap, room, original=moved(t), options=ConstraintOptions(fix_start=True, fix_goal=True))
    assert through.verdict.status == "repaired", through.verdict.sentences()
    assert clearance(through, gap) > -1e-6


def test_fixed_ends_and_pins_stay():
    t = line()
    options = ConstraintOptions(fix_start=True, fix_goal=True, pinned=(5, -6), lambda_smooth=2.0)
    found = constrain(t, scene(CUP), OPEN, original=moved(t), options=options)
    assert found.verdict.status == "repaired"
    for i in (0, 5, -6, -1):
        assert np.array_equal(found.trajectory.positions[i], t.positions[i])
    assert {"start", "goal", "pinned"} <= {c.name for c in found.verdict.checks}
    with pytest.raises(ConstraintDefinitionError, match="pinned waypoint 42"):
        constrain(t, Scene(), OPEN, original=t, options=ConstraintOptions(pinned=(41,)))


def test_off_only_measures():
    t = line()
    found = constrain(t, scene(CUP), OPEN, original=moved(t), options=ConstraintOptions(enabled=False))
    assert found.trajectory is t
    assert found.verdict.status == "off"
    assert not found.verdict.ok


def test_smoothing_smooths_and_keeps_extras():
    rng = np.random.default_rng(0)
    t = Trajectory(
        line().positions + rng.normal(size=(41, 3)) * 0.01, np.abs(rng.normal(size=41)), np.ones((41, 4)), 0.2
    )
    found = constrain(t, Scene(), OPEN, original=t, options=ConstraintOptions(lambda_smooth=2.0))
    bends = [float((np.diff(x.positions, 2, axis=0) ** 2).sum()) for x in (t, found.trajectory)]
    assert bends[1] < 0.2 * bends[0]
    assert found.verdict.status == "satisfied"
    assert np.array_equal(found.trajectory.orientations, t.orientations)
    assert found.trajectory.timestep == 0.2
    assert np.diff(found.trajectory.speeds).std() < np.diff(t.speeds).std()


def test_how_much_of_the_change_was_undone():
    original = line(y=0.5)
    proposed = original.with_(positions=original.positions + np.array([0.0, 1.0, 0.0]))
    verdict = constrain(proposed, Scene(), ROOM, original=original).verdict
    assert verdict.undone == pytest.approx(0.51)


def test_every_step_is_legal_and_more_steps_are_nearer():
    t = line(n=100)
    far = []
    for steps in (1, 3, 12):
        found = constrain(t, scene(CUP), OPEN, original=moved(t), options=ConstraintOptions(steps=steps))
        assert found.verdict.status == "repaired"
        assert clearance(found, scene(CUP)) > -1e-6
        far.append(float(((found.trajectory.positions - t.positions) ** 2).sum()))
    assert far[2] <= far[1] * 1.05 <= far[0] * 1.1


def test_it_is_deterministic_and_settles():
    t = line()
    first = constrain(t, scene(CUP), OPEN, original=moved(t))
    assert constrain(t, scene(CUP), OPEN, original=moved(t)).trajectory == first.trajectory
    again = constrain(first.trajectory, scene(CUP), OPEN, original=moved(t))
    assert again.verdict.status == "satisfied"
    assert again.trajectory is first.trajectory


@pytest.mark.parametrize("seed", range(4))
def test_moving_and_turning_everything_moves_and_turns_the_result(seed):
    rng = np.random.default_rng(seed)
    q = rng.normal(size=4)
    q = q / np.linalg.norm(q)
    turn = SceneObject("frame", [0, 0, 0], orientation=q).rotation
    shift = rng.normal(size=3)
    path = Trajectory(rng.normal(size=(50, 3)).cumsum(axis=0) * 0.05, np.ones(50))
    objects = [(f"o{i}", path.positions[15 + 10 * i] + rng.normal(size=3) * 0.05, [0.2, 0.1, 0.15]) for i in range(3)]
    there = [SceneObject(n, turn @ np.asarray(p) + shift, d, q) for n, p, d in objects]
    turned = path.with_(positions=path.positions @ turn.T + shift)
    original = moved(path)
    as_turned = original.with_(positions=original.positions @ turn.T + shift)
    a = constrain(path, scene(*objects), OPEN, original=original)
    b = constrain(turned, Scene(tuple(there)), OPEN, original=as_turned)
    assert a.verdict.status == b.verdict.status != "satisfied"
    assert b.trajectory.positions == pytest.approx(a.trajectory.positions @ turn.T + shift, abs=1e-4)


@pytest.mark.parametrize("block", range(4))
def test_random_problems(block):
    for seed in range(10 * block, 10 * block + 10):
        wrong, _ = faults(seed)
        assert not wrong, f"seed {seed}: {wrong}"


def test_a_flat_robot_keeps_no_more_from_a_tilted_box_than_asked():
    """The box is met as the robot's plane cuts it, not as its shadow: that would be 0.15 m wide here."""
    t = line(n=61)
    beam = scene(("beam", [0.0, 0.0, 0.08], [0.3, 0.2, 0.2], [np.cos(np.pi / 8), np.sin(np.pi / 8), 0.0, 0.0]))
    ground = Robot("ground", Box((-1, -1, -0.01), (1, 1, 0.01)), max_speed=None)
    found = constrain(t, beam, ground, original=moved(t))
    assert found.verdict.status == "repaired"
    assert (found.trajectory.positions[:, 2] == 0).all()
    assert -1e-6 < clearance(found, beam, ground) < 1e-4
    cut = 0.1 * np.sqrt(2.0) - 0.08 + 0.01 * np.sqrt(2.0)
    assert np.abs(found.trajectory.positions[:, 1]).max() == pytest.approx(cut, abs=2e-3)


def test_a_path_that_works_along_an_object_may_go_on_to_do_so_but_no_nearer():
    bench = scene(("housing", [0.0, 0.0, 0.05], [0.8, 0.4, 0.1]))
    bead, beside = line(n=60, z=0.103), line(n=60, y=0.02, z=0.103)
    robot = Robot("nozzle", obstacle_margin=0.01)
    found = constrain(beside, bench, robot, original=bead)
    assert found.trajectory.positions == pytest.approx(beside.positions) and found.verdict.status == "preexisting"
    found = constrain(line(n=60, z=0.101), bench, robot, original=bead)
    assert bench["housing"].clearance(found.trajectory.positions).min() > 0.0029
