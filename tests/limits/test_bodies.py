"""The robot has a body and dynamics; people are kept at a larger distance; planar robots stay on their plane."""

import numpy as np
import pytest

from ovita.limits import ConstraintOptions, constrain
from ovita.limits.problem import kind_of
from ovita.paths.robot import UNLIMITED, Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory

OPEN = Robot("open", None, max_speed=None)


def line(n=41, y=0.0, z=0.0, speed=0.5):
    x = np.column_stack([np.linspace(-1, 1, n), np.full(n, y), np.full(n, z)])
    return Trajectory(x, np.full(n, speed))


def scene(name="cup", at=(0, 0, 0), size=(0.1, 0.1, 0.1), **extra):
    return Scene((SceneObject(name, list(at), None if size is None else list(size), extra=extra),))


def nearest(trajectory, item, samples=300):
    """Distance of the densely sampled path to an object's surface [m]."""
    p, t = trajectory.positions, np.linspace(0, 1, samples)[:, None, None]
    return float(item.clearance((p[:-1] + t * np.diff(p, axis=0)).reshape(-1, 3)).min())


@pytest.mark.parametrize("radius", [0.0, 0.07, 0.33])
def test_margins_count_from_the_body(radius):
    robot = Robot("body", None, radius=radius)
    things = scene()
    found = constrain(line(y=0.02), things, robot, original=line(y=0.7))
    assert found.verdict.status == "repaired"
    assert nearest(found.trajectory, things["cup"]) >= radius + 0.01 - 1e-6


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("person", "person"),
        ("Person 2", "person"),
        ("old man with a hat", "person"),
        ("two women", "person"),
        ("Siamese cat", "animal"),
        ("dog house", None),
        ("person's chair", None),
        ("mannequin", None),
        ("cup", None),
    ],
)
def test_kinds_are_told_by_the_head_noun(name, kind):
    assert getattr(kind_of(name), "name", None) == kind


def test_a_scene_file_can_name_the_kind():
    assert kind_of("Bob", {"kind": "person"}).name == "person" and kind_of("cat", {"kind": "thing"}) is None


def test_people_are_kept_at_a_larger_distance():
    far, near = line(y=1.0), line(y=0.2)
    for name, least in (("person", 0.3), ("dog", 0.09999), ("cup", 0.01)):
        things = scene(name)
        found = constrain(near.with_(positions=near.positions - np.array([0, 0.1, 0])), things, OPEN, original=far)
        assert nearest(found.trajectory, things[name]) >= least - 1e-6, name
    check = constrain(far, scene("person"), OPEN, original=far).verdict.checks[0]
    assert check.limit.startswith("keep 0.3 m from it (person)")


def test_a_path_that_already_passes_a_person_nearer_may_come_no_nearer():
    things, original = scene("person"), line(y=0.2)
    same = constrain(original.with_(speeds=original.speeds / 2), things, OPEN, original=original)
    assert same.verdict.status == "preexisting" and np.array_equal(same.trajectory.positions, original.positions)
    aside = constrain(line(y=0.22), things, OPEN, original=original)
    assert aside.verdict.status == "preexisting" and aside.trajectory == line(y=0.22)
    assert any("The original path already passes" in text for text in aside.verdict.sentences())
    nearer = constrain(line(y=0.1), things, OPEN, original=original)
    assert nearest(nearer.trajectory, things["person"]) >= 0.15 - 1e-6
    strict = constrain(line(y=0.22), things, OPEN, original=original, options=ConstraintOptions(repair_original=True))
    assert strict.verdict.status == "repaired" and nearest(strict.trajectory, things["person"]) >= 0.3 - 1e-6


def test_an_assumed_size_is_named():
    for name, said, least in (("cup", "its size was assumed: 0.05 m", 0.035), ("person", "assumed: 0.5 m", 0.55)):
        things = scene(name, size=None)
        found = constrain(line(y=0.01), things, OPEN, original=line(y=2.0))
        assert said in found.verdict.checks[0].limit
        t = np.linspace(0, 1, 200)[:, None, None]
        p = found.trajectory.positions
        assert np.linalg.norm(p[:-1] + t * np.diff(p, axis=0), axis=-1).min() >= least - 1e-6


@pytest.mark.parametrize("shape", ["box", "sphere"])
@pytest.mark.parametrize("aside", [0.012, 0.023, 0.034, 0.054])
def test_an_assumed_size_does_not_push_away_a_path_that_passes_inside_it(aside, shape):
    things, original = scene("cup", size=None), line(y=aside)
    slightly = line(y=0.01 + 0.6 * (aside - 0.01))
    found = constrain(slightly, things, OPEN, original=original, options=ConstraintOptions(obstacle_shape=shape))
    assert found.verdict.status == "satisfied"
    assert "as the path passes so near" in found.verdict.checks[0].limit
    into = constrain(line(y=0.001), things, OPEN, original=original, options=ConstraintOptions(obstacle_shape=shape))
    assert into.verdict.status == "repaired"
    t, p = np.linspace(0, 1, 200)[:, None, None], into.trajectory.positions
    assert np.linalg.norm(p[:-1] + t * np.diff(p, axis=0), axis=-1).min() > 0.01
    strict = ConstraintOptions(obstacle_shape=shape, repair_original=True)
    assert constrain(original, things, OPEN, original=original, options=strict).verdict.checks[0].limit.count("0.05 m")


def test_what_is_to_be_touched_is_no_obstacle_even_for_a_body():
    found = constrain(line(), scene(), Robot("b", None, radius=0.2), original=line(y=1), contacts=["cup"])
    assert found.verdict.status == "satisfied" and found.verdict.exempt == ("cup",)


def test_a_planar_robot_stays_on_its_plane():
    flat = scene(size=(0.1, 0.8, 0.02))
    rover = Robot("rover", None, radius=0.1, planar=True)
    found = constrain(line(y=0.01, z=0.3), scene(at=(0, 0, 0.3), size=(0.1, 0.8, 0.02)), rover, original=line(z=0.3))
    assert found.verdict.status == "repaired" and (found.trajectory.positions[:, 2] == 0.3).all()
    lifted = constrain(line(z=0.2), Scene(), rover, original=line())
    assert lifted.verdict.status == "repaired" and (lifted.trajectory.positions[:, 2] == 0.0).all()
    assert any("plane" in text for text in lifted.verdict.sentences())
    ends = ConstraintOptions(fix_start=True, fix_goal=True)
    for wide in (2.0, 0.3):  # off the plane only where there is no way on it
        arm = Robot("arm", Box((-2, -wide, -1), (2, wide, 1)), max_speed=None)
        found = constrain(line(y=0.01), flat, arm, original=line(), options=ends)
        assert found.verdict.status == "repaired"
        assert (np.ptp(found.trajectory.positions[:, 2]) == 0) == (wide == 2.0)


def test_the_robots_accelerations_are_limits_that_the_original_may_exceed():
    robot = Robot("slow", None, max_acceleration=0.5, max_lateral_acceleration=0.5)
    calm, hasty = line(), line()
    speeds = np.full(41, 0.1)
    speeds[20:] = 0.9
    hasty = hasty.with_(speeds=speeds)
    found = constrain(hasty, Scene(), robot, original=calm)
    assert found.verdict.status == "repaired"
    v, ds = found.trajectory.speeds, 0.05
    assert (np.abs(np.diff(v**2)) / (2 * ds) <= 0.5 + 1e-6).all()
    shifted = hasty.with_(positions=hasty.positions + np.array([0, 0.1, 0]))
    kept = constrain(shifted, Scene(), robot, original=hasty)
    assert kept.verdict.status == "preexisting" and kept.trajectory == shifted
    harder = constrain(hasty.with_(speeds=np.where(speeds > 0.5, 1.8, 0.1)), Scene(), robot, original=hasty)
    assert harder.verdict.status == "preexisting" and harder.verdict.waypoints_changed
    asked = ConstraintOptions(max_acceleration=0.5)
    assert constrain(shifted, Scene(), robot, original=hasty, options=asked).verdict.status == "repaired"


def test_a_least_speed_is_kept_while_moving():
    robot = Robot("plane", None, min_speed=0.2, max_acceleration=1.0)
    speeds = np.full(41, 0.05)
    speeds[[0, 20, -1]] = 0.0
    found = constrain(line().with_(speeds=speeds), Scene(), robot, original=line())
    assert found.verdict.status == "repaired"
    v = found.trajectory.speeds
    assert (v[[0, 20, -1]] == 0).all() and (np.delete(v, [0, 20, -1]) >= 0.2 - 1e-9).all()
    t = np.linspace(0, 3, 41)
    bent = Trajectory(np.column_stack([np.cos(9 * t), np.sin(9 * t), t]) * 0.02, np.full(41, 0.3))
    tight = Robot("plane", None, min_speed=0.2, max_lateral_acceleration=0.1)
    found = constrain(bent, Scene(), tight, original=line())
    assert found.verdict.status == "infeasible" and "least speed" in found.verdict.conflicts[0]


def test_a_margin_that_a_robot_states_is_kept_where_no_robot_asks_for_none():
    """Nearer than the margin already: without a robot it may stay so, a robot that states one goes off."""
    near = Scene((SceneObject("post", [0.0, 0.056, 0.0], [0.1, 0.1, 0.1]),))
    path = line()
    lifted = path.with_(positions=path.positions + np.array([0.0, 0.0, 0.001]))
    free = constrain(lifted, near, UNLIMITED, original=path)
    assert np.allclose(free.trajectory.positions, lifted.positions)
    kept = constrain(lifted, near, Robot("arm of ours", None, max_speed=None, obstacle_margin=0.03), original=path)
    assert near["post"].cuboid.closest(kept.trajectory.positions)[0] > 0.02
