"""Scenes: frames, forgiving names, cuboids."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ovita.errors import SceneError, UnknownObject
from ovita.paths.scene import DIRECTIONS, Frame, Scene, SceneObject


def scene(*names):
    return Scene(tuple(SceneObject(name, [i, 0, 0]) for i, name in enumerate(names)))


@pytest.mark.parametrize(
    ("frame", "left", "front", "up"),
    [
        ("rfu", (-1, 0, 0), (0, 1, 0), (0, 0, 1)),
        ("flu", (0, 1, 0), (1, 0, 0), (0, 0, 1)),
        ("ned", (0, -1, 0), (1, 0, 0), (0, 0, -1)),
    ],
)
def test_frames_say_which_way_is_left(frame, left, front, up):
    f = Frame(frame)
    assert f.direction("left") == pytest.approx(left)
    assert f.direction("front") == pytest.approx(front)
    assert f.direction("up") == pytest.approx(up)


@given(st.sampled_from(["rfu", "flu", "ned"]), st.lists(st.floats(-5, 5), min_size=3, max_size=3))
def test_words_of_a_vector_add_up_to_it(name, vector):
    frame = Frame(name)
    assert frame.offset(**frame.words(np.array(vector))) == pytest.approx(vector)


def test_opposite_words_cancel():
    for word in DIRECTIONS:
        assert abs(Frame("flu").direction(word)).sum() == 1
    assert Frame().offset(left=0.2, right=0.2) == pytest.approx(0)


def test_unknown_frame_and_direction_are_refused():
    with pytest.raises(SceneError, match=r"unknown frame 'enu'; known frames are rfu, flu, ned"):
        Frame("enu")
    with pytest.raises(SceneError, match="unknown direction 'north'"):
        Frame().direction("north")


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ("cup", "Cup"),
        ("the CUP", "Cup"),
        ("cups", "Cup"),
        ("remote controller", "remote_controller"),
        ("bowl", "yellow bowl"),
        ("yellow bowls", "yellow bowl"),
        ("remote_contoller", "remote_controller"),
    ],
)
def test_names_are_forgiven(asked, found):
    assert scene("Cup", "yellow bowl", "remote_controller")[asked].name == found


def test_ambiguous_and_unknown_names_are_not_guessed():
    s = scene("red cup", "blue cup")
    assert "cup" not in s and "red cup" in s
    with pytest.raises(UnknownObject, match=r"no object 'vase'; its objects are 'red cup', 'blue cup'"):
        s["vase"]


def test_a_point_goes_by_its_coordinates():
    there = scene("cup")["(0.3, -0.2,.1)"]
    assert there.position.tolist() == [0.3, -0.2, 0.1] and there.name == "(0.3, -0.2, 0.1)"
    assert scene("box")["(0.30, -0.2, 0.1)"] is there and there.dimensions is None
    with pytest.raises(UnknownObject):
        scene("cup")["(0.3, -0.2)"]


def test_duplicate_names_are_refused():
    with pytest.raises(SceneError, match=r"two objects are named 'CUP' \(numbers 0 and 2\)"):
        scene("cup", "box", "CUP")


def test_object_without_dimensions_is_a_5_cm_cube():
    item = SceneObject("cup", [0, 0, 0])
    assert item.size == pytest.approx([0.05] * 3)
    assert item.radius == pytest.approx(0.05 * 3**0.5 / 2)


def test_clearance_of_a_turned_cuboid():
    quarter = [np.cos(np.pi / 4), 0, 0, np.sin(np.pi / 4)]
    item = SceneObject("bar", [1, 0, 0], [2, 0.2, 0.2], quarter)
    points = np.array([[1, 1.5, 0], [1, 0, 0], [1.5, 0, 0]])
    assert item.clearance(points) == pytest.approx([0.5, -0.1, 0.4])


@pytest.mark.parametrize(
    ("kwargs", "said"),
    [
        ({"name": " ", "position": [0, 0, 0]}, "has no name"),
        ({"name": "a", "position": [0, 0]}, "position must be 3 finite numbers"),
        ({"name": "a", "position": [0, 0, np.inf]}, "position must be 3 finite numbers"),
        ({"name": "a", "position": [0, 0, 0], "dimensions": [1, 1, -1]}, "negative"),
        ({"name": "a", "position": [0, 0, 0], "orientation": [0, 0, 0, 0]}, "length zero"),
    ],
)
def test_malformed_objects_are_refused(kwargs, said):
    with pytest.raises(SceneError, match=said):
        SceneObject(**kwargs)
