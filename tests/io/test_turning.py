import numpy as np
import pytest

from ovita.io.geodesy import on_earth
from ovita.paths.scene import Frame, Scene, SceneObject, rotation, transformed
from ovita.paths.trajectory import Trajectory

FRAMES = [Frame(name) for name in ("rfu", "flu", "ned")]
RNG = np.random.default_rng(3)
PATH = Trajectory(RNG.normal(size=(9, 3)), RNG.uniform(size=9), RNG.normal(size=(9, 4)), 0.2)


@pytest.mark.parametrize("source", FRAMES, ids=lambda f: f.name)
@pytest.mark.parametrize("target", FRAMES, ids=lambda f: f.name)
def test_words_keep_their_meaning_and_numbers_come_back_exactly(source, target):
    for word in ("left", "right", "front", "back", "up", "down"):
        assert (rotation(source, target) @ source.direction(word) == target.direction(word)).all()
    there = transformed(PATH, source, target)
    back = transformed(there, target, source)
    assert (back.positions == PATH.positions).all() and (back.speeds == PATH.speeds).all()
    assert np.abs((back.orientations * PATH.orientations).sum(axis=1)) == pytest.approx(1.0)
    np.testing.assert_allclose(there.durations, PATH.durations, rtol=1e-12)


@pytest.mark.parametrize("target", FRAMES, ids=lambda f: f.name)
def test_orientations_turn_with_the_positions(target):
    turn = rotation(Frame("rfu"), target)
    for before, after in zip(PATH.orientations, transformed(PATH, Frame("rfu"), target).orientations, strict=True):
        matrix = [SceneObject("x", [0, 0, 0], orientation=q).rotation for q in (before, after)]
        np.testing.assert_allclose(matrix[1], turn @ matrix[0], atol=1e-12)


def test_a_scene_turns_with_its_objects():
    scene = Scene((SceneObject("box", [1, 2, 3], [1, 2, 3]),), Frame("rfu"), extra={"kept": 1})
    moved = scene.in_frame(Frame("flu"))
    assert (moved["box"].position == [2, -1, 3]).all() and moved.frame == Frame("flu") and moved.extra == {"kept": 1}
    corner = np.array([[1.4, 3.0, 4.4]])
    assert moved["box"].clearance(corner @ rotation(Frame("rfu"), Frame("flu")).T) == pytest.approx(
        scene["box"].clearance(corner)
    )


def test_front_is_north_but_in_ros_x_is_east():
    path = Trajectory([[0, 0, 0], [1.0, 2.0, 3.0]], [1, 1])
    ros = {"ros": {"frame_id": "map"}}
    assert on_earth(path, Scene(frame=Frame("rfu"))).positions[1].tolist() == [1, 2, 3]
    assert on_earth(path, Scene(frame=Frame("flu"))).positions[1].tolist() == [-2, 1, 3]
    assert on_earth(path, Scene(frame=Frame("ned"))).positions[1].tolist() == [2, 1, -3]
    assert on_earth(path, Scene(frame=Frame("flu"), extra=ros)).positions[1].tolist() == [1, 2, 3]
    in_words = transformed(path, Frame("flu"), Frame("rfu"))
    assert on_earth(in_words, Scene(frame=Frame("rfu"), extra=ros)).positions[1].tolist() == [1, 2, 3]
    ned = {"ros": {"frame_id": "odom_ned"}}
    assert on_earth(path, Scene(frame=Frame("ned"), extra=ned)).positions[1].tolist() == [2, 1, -3]
