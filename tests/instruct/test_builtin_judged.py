"""The built-in writer judged by what comes out: what clauses leave out, parts of the path, ends, amounts, honesty."""

import numpy as np
import pytest

from ovita import adapt
from ovita.instruct.understanding import read
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.result import accept

T = np.linspace(0.0, 1.0, 50)
PATH = Trajectory(np.column_stack([0.8 * T, 0.2 * np.sin(3 * T), 0.2 + 0.1 * T]), 0.2 + 0.1 * np.sin(np.pi * T))
OBJECTS = (
    SceneObject("red cup", [0.25, 0.42, 0.22], [0.06, 0.06, 0.08]),
    SceneObject("vase", [0.6, -0.15, 0.26], [0.06, 0.06, 0.1]),
    SceneObject("plate", [0.45, 0.6, 0.2], [0.2, 0.2, 0.02]),
)
SCENE = Scene(OBJECTS)


def said(sentence, frame="rfu"):
    result = adapt(Request(sentence, PATH, Scene(OBJECTS, Frame(frame))), writer="builtin")
    result = accept(result) if result.proposal is not None else result
    assert result.status in ("done", "limited"), f"{sentence}: {result.unplaced} {result.question} {result.error}"
    return result.adapted


def shift(sentence, frame="rfu"):
    return said(sentence, frame).positions - PATH.positions


def pace(sentence):
    return said(sentence).speeds / PATH.speeds


@pytest.mark.parametrize(
    ("sentence", "inside", "outside", "offset"),
    [
        ("Move waypoints 10 to 20 up by 5 cm and left by 3 cm", slice(10, 19), slice(28, 50), (-0.03, 0, 0.05)),
        ("In the last third, go 4 cm up and 2 cm forward", slice(40, 50), slice(0, 25), (0, 0.02, 0.04)),
        ("Shift it 3 cm up but leave the first 10 waypoints untouched", slice(18, 50), slice(0, 7), (0, 0, 0.03)),
        ("Go 3 cm up, but not in the last half", slice(0, 18), slice(30, 50), (0, 0, 0.03)),
        ("Move every waypoint from 12 to 18 left by 2 cm", slice(12, 17), slice(26, 50), (-0.02, 0, 0)),
        ("Raise the 12th waypoint by 2 cm", slice(11, 12), slice(20, 50), (0, 0, 0.02)),
        ("Go 2 cm lower until the red cup, then 3 cm up", slice(26, 49), slice(0, 0), (0, 0, 0.03)),
    ],
)
def test_a_shift_is_about_the_part_that_the_sentence_names(sentence, inside, outside, offset):
    moved = shift(sentence)
    np.testing.assert_allclose(np.median(moved[inside], axis=0), offset, atol=1e-3)
    np.testing.assert_allclose(moved[outside], 0.0, atol=1e-3)


@pytest.mark.parametrize(
    ("sentence", "start", "goal"),
    [
        ("Move the goal 6 cm forward and 2 cm to the right", (0, 0, 0), (0.02, 0.06, 0)),
        ("Move both endpoints up by 5 cm", (0, 0, 0.05), (0, 0, 0.05)),
        ("Lift everything by 5 cm but keep the endpoints fixed", (0, 0, 0), (0, 0, 0)),
        ("The goal should be at a height of 0.5 m", (0, 0, 0), (0, 0, 0.2)),
        ("Descend to 10 cm above the ground at the end", (0, 0, 0), (0, 0, -0.2)),
    ],
)
def test_ends(sentence, start, goal):
    moved = shift(sentence)
    np.testing.assert_allclose(moved[[0, -1]], [start, goal], atol=1e-3)


def test_an_end_comes_closer_by_what_is_said():
    goal = said("Finish 10 cm closer to the plate").positions[-1]
    before, after = (np.linalg.norm(p - OBJECTS[2].position) for p in (PATH.positions[-1], goal))
    assert before - after == pytest.approx(0.1, abs=1e-3)


@pytest.mark.parametrize(
    ("sentence", "frame", "offset"),
    [
        ("Shift the path by 5 cm in y", "rfu", (0, 0.05, 0)),
        ("Translate it by -5 cm along x", "flu", (-0.05, 0, 0)),
        ("Move it 4 cm in the -y direction", "ned", (0, -0.04, 0)),
        ("Add 0.1 to the z coordinate of all waypoints", "ned", (0, 0, 0.1)),
        ("Dive 10 cm deeper", "ned", (0, 0, 0.1)),
        ("mvoe it lefft by 4 cm", "rfu", (-0.04, 0, 0)),
    ],
)
def test_whole_path(sentence, frame, offset):
    np.testing.assert_allclose(np.median(shift(sentence, frame), axis=0), offset, atol=1e-3)


@pytest.mark.parametrize(
    ("sentence", "inside", "outside"),
    [
        ("Slow down when higher than 0.26 m", slice(32, 50), slice(0, 29)),
        ("If you are below 0.22 m, slow down", slice(0, 9), slice(11, 50)),
        ("Slow down on the way up", slice(0, 50), slice(0, 0)),
        ("Slow down everywhere except in the first half", slice(26, 50), slice(0, 24)),
        ("Slow down near the red cup and then resume the original speed", slice(15, 19), slice(35, 50)),
        ("Lift the last half by 1 cm and go slower there", slice(27, 50), slice(0, 24)),
        ("Lower the last 10 waypoints by 1 cm and slow them down", slice(40, 50), slice(0, 38)),
        ("Slow down from waypoint 30 onwards", slice(29, 50), slice(0, 29)),
        ("In the first 1 second, go slower", slice(0, 12), slice(14, 50)),
    ],
)
def test_slower_where_it_is_said(sentence, inside, outside):
    factor = pace(sentence)
    assert (factor[inside] < 0.9).all()
    np.testing.assert_allclose(factor[outside], 1.0)


def test_speeds():
    assert said("Keep the speed at 0.22 m/s at least").speeds.min() == pytest.approx(0.22)
    assert said("Keep the speed at 0.26 m/s at most").speeds.max() == pytest.approx(0.26)
    capped = said("Reduce the top speed to 0.25 m/s").speeds
    np.testing.assert_allclose(capped, np.minimum(PATH.speeds, 0.25))
    np.testing.assert_allclose(pace("Double the speed"), 2.0)
    np.testing.assert_allclose(pace("Pass closer to the red cup without slowing down"), 1.0)
    two = said("Go at 0.3 m/s until the red cup and at 0.1 m/s afterwards").speeds
    assert two[5] == pytest.approx(0.3) and two[-5] == pytest.approx(0.1)


def test_beyond_the_goal():
    heading = PATH.positions[-1] - PATH.positions[-2]
    gone = said("Continue straight ahead for another 10 cm").positions[-1] - PATH.positions[-1]
    np.testing.assert_allclose(gone, 0.1 * heading / np.linalg.norm(heading), atol=1e-3)
    back = said("Return to the start after reaching the goal").positions
    np.testing.assert_allclose(back[-1], PATH.positions[0], atol=1e-6)
    assert len(back) > len(PATH)
    np.testing.assert_allclose(said("Fly it backwards").positions, PATH.positions[::-1], atol=1e-6)


@pytest.mark.parametrize(
    ("sentence", "near", "least", "most"),
    [
        ("Stay 10 cm from the red cup and 25 cm from the vase", "vase", 0.25, 0.5),
        ("Keep 30-32 cm away from the red cup", "red cup", 0.34, 0.375),
        ("Come within 12 cm of the vase", "vase", 0.0, 0.165),
        ("Get as close as 12 cm to the vase", "vase", 0.0, 0.165),
        ("Don't touch the vase", "vase", 0.2, 0.6),
    ],
)
def test_distances(sentence, near, least, most):
    distance = next(o for o in OBJECTS if o.name == near).distance(said(sentence).positions).min()
    assert least - 1e-3 <= distance <= most


def test_waits_of_one_sentence():
    adapted = said("Stop for 2 s at the red cup and 1 s at the goal")
    assert (adapted.speeds[1:] == 0).sum() == pytest.approx(30, abs=2)
    halted = said("Hover for 1 s at waypoint 20").positions
    assert (np.abs(halted - PATH.positions[19]).max(axis=1) < 1e-9).sum() == 11
    (loops,) = read("Do two clockwise loops around the vase", SCENE).frames
    assert (loops.shape, loops.turns.value, loops.sense) == ("circle", 2.0, "cw")


@pytest.mark.parametrize(
    "sentence",
    [
        "Begin from rest and go at 0.3 m/s in the first 10 cm",
        "Go left, but twice as loud near the cup",
        "Move waypoint 5 and waypoint 10 up by 3 cm",
        "Continue past the goal for 10 cm, rising 5 cm",
        "Keep 5 cm more distance from the plate than from the vase",
    ],
)
def test_what_is_unclear_changes_nothing(sentence):
    result = adapt(Request(sentence, PATH, SCENE), writer="builtin")
    assert result.status in ("needs_confirmation", "needs_clarification", "not_understood")
    np.testing.assert_array_equal(result.adapted.positions, PATH.positions)


def test_passing_on_a_side_leaves_the_ends_where_they_are():
    path = said("Pass the red cup on the front side").positions
    abreast = path[np.argmin(np.abs(path[:, 0] - 0.25))]
    assert abreast[1] > 0.45
    np.testing.assert_allclose(path[[0, -1]], PATH.positions[[0, -1]], atol=1e-3)


def test_how_far_closer_goes_is_said():
    near = Scene((SceneObject("plate", [0.45, 0.36, 0.2], [0.2, 0.2, 0.02]),))
    result = adapt(Request("Go 0.4 m closer to the plate", PATH, near), writer="builtin")
    assert any("ends at its surface" in assumption for assumption in result.assumptions)


@pytest.mark.parametrize("size", [None, [0.06, 0.06, 0.1]])
def test_near_an_object_that_is_kept_at_a_distance_still_means_some_of_the_path(size):
    scene = Scene((SceneObject("vase", [0.4, 0.2, 0.26], size),))
    sentence = "Keep at least 0.35 m from the vase, and go faster near the vase."
    result = adapt(Request(sentence, PATH, scene), writer="builtin")
    assert result.status == "done"
    assert (result.adapted.speeds > 1.2 * PATH.speeds).any()
