"""How far a trajectory went in the sense that was asked for."""

import numpy as np
import pytest

from ovita.paths.scene import Scene, SceneObject
from ovita.toolkit import (
    closer,
    expect_closer,
    expect_distance,
    expect_farther,
    expect_faster,
    expect_goal,
    expect_moved,
    expect_same_path,
    expect_slower,
    expect_speed,
    expect_stop,
    expect_visits,
    judge,
)

CUP = SceneObject("cup", [0.0, 0.3, 0.0])
SCENE = Scene((CUP,))
PATH = np.column_stack([np.linspace(-0.5, 0.5, 41), np.zeros(41), np.zeros(41), np.full(41, 0.5)])
HALF = np.arange(41) < 20


def moved(by=(0.0, 0.0, 0.0), speed=0.0):
    return PATH + np.array([*by, speed])


FRONT, BACK = moved([0, 0.1, 0]), moved([0, -0.1, 0])


@pytest.mark.parametrize(
    ("expectation", "adapted", "change", "unit"),
    [
        (expect_moved(front=0.2), FRONT, 0.1, "m"),
        (expect_moved(back=0.2), FRONT, -0.1, "m"),
        (expect_moved(front=0.3, left=0.4), FRONT, 0.06, "m"),
        (expect_moved(front=0.2, where=HALF), FRONT, 0.1, "m"),
        (expect_closer(CUP), FRONT, 0.1, "m"),
        (expect_farther(CUP), FRONT, -0.1, "m"),
        (expect_farther(CUP), BACK, 0.1, "m"),
        (expect_distance(CUP, 0.35), BACK, 0.05, "m"),
        (expect_distance(CUP, 0.2), FRONT, 0.0, "m"),
        (expect_distance(CUP, at_most=0.1), FRONT, np.hypot(0.5, 0.3) - np.hypot(0.5, 0.2), "m"),
        (expect_visits(CUP, within=0.1), FRONT, 0.1, "m"),
        (expect_visits(CUP, within=0.25), FRONT, 0.05, "m"),
        (expect_goal(CUP), moved([-0.5, 0.3, 0.0]), np.hypot(0.5, 0.3), "m"),
        (expect_faster(), moved(speed=0.2), 0.2, "m/s"),
        (expect_slower(), moved(speed=0.2), -0.2, "m/s"),
        (expect_speed(0.1), moved(speed=-0.3), 0.3, "m/s"),
        (expect_speed(0.9), moved(speed=0.3), 0.3, "m/s"),
    ],
    ids=lambda value: getattr(value, "text", None),
)
def test_the_change_counts_in_the_sense_of_the_promise(expectation, adapted, change, unit):
    outcome = judge(expectation, PATH, adapted, SCENE)
    assert outcome.change == pytest.approx(change, abs=1e-9)
    assert outcome.unit == unit
    assert type(outcome.change) is float
    assert judge(expectation, PATH, PATH, SCENE).change == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    "expectation", [expect_same_path(), expect_stop(CUP), expect_moved(up=0.1, where=HALF & ~HALF)]
)
def test_some_promises_have_no_amount(expectation):
    assert judge(expectation, PATH, FRONT, SCENE).change is None


def test_closer_to_a_wide_thing_is_so_all_along_it():
    """A path around a shed, of which only the nearest corner had come closer."""
    angle = np.linspace(np.pi, 0.0, 81)
    path = np.column_stack([7.0 * np.cos(angle), 6.0 * np.sin(angle), np.full(81, 2.0), np.ones(81)])
    shed = SceneObject("shed", [0.0, 0.0, 1.75], [6.0, 5.0, 3.5])
    nearer = np.hypot(*path[:, :2].T) - np.hypot(*closer(path, shed, 1.0)[:, :2].T)
    assert nearer[[0, -1]] == pytest.approx(0.0) and nearer.max() == pytest.approx(1.0, abs=0.02)
    assert (nearer[20:61] > 0.7).all()
