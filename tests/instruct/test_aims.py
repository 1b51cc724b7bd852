"""What of an object is meant: on it is its top, touching it its surface, in it and at it its centre."""

from itertools import pairwise

import numpy as np
import pytest

from ovita import Request, Robot, Scene, SceneObject, Trajectory, adapt
from ovita.instruct import frames as F
from ovita.instruct.learned import LearnedReader
from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.result import accept

N = 40
X = np.linspace(0.0, 1.0, N)
PATH = Trajectory.from_array(np.column_stack([X, 0.3 * X, np.full(N, 0.3), np.full(N, 0.2)]))
BOX = SceneObject("box", [0.5, -0.3, 0.1], [0.2, 0.1, 0.2])
SCENE = Scene((BOX, SceneObject("table", [1.0, -0.4, 0.1], [0.4, 0.4, 0.2]), SceneObject("ball", [0.8, 0.6, 0.2])))
TOPS = {"box": [0.5, -0.3, 0.2], "table": [1.0, -0.4, 0.2]}


def done(sentence, scene=SCENE, **options):
    result = adapt(Request(sentence, PATH, scene, **options), writer="builtin")
    result = accept(result) if result.proposal is not None else result
    assert result.status == "done", (result.status, result.explanation)
    return result


def depth(result, item):
    """How deep the path goes into an object [m], sampled densely, by code of its own."""
    rows = result.adapted.positions
    fine = np.concatenate([a + np.linspace(0, 1, 30)[:, None] * (b - a) for a, b in pairwise(rows)])
    return float((item.dimensions / 2 - np.abs(fine - item.position)).min(axis=1).max())


@pytest.mark.parametrize(
    ("sentence", "name"),
    [
        ("end on the box", "box"),
        ("end on top of the box", "box"),
        ("finish on top of the table", "table"),
        ("land on the table", "table"),
        ("touch down on the table", "table"),
        ("set down on the box", "box"),
        ("set it down on the box", "box"),
        ("put the goal on the box", "box"),
        ("come to rest on the box", "box"),
        ("move the goal onto the box", "box"),
        ("continue onto the table", "table"),
        ("let the last waypoint lie on the box", "box"),
        ("go through the box and end on the table", "table"),
    ],
)
def test_an_end_on_an_object_is_on_its_top(sentence, name):
    result = done(sentence)
    np.testing.assert_allclose(result.adapted.positions[-1], TOPS[name], atol=1e-9)
    if "through" not in sentence:
        assert depth(result, SCENE[name]) < 1e-6  # from above, not through its side


def test_a_start_on_an_object_is_on_its_top():
    np.testing.assert_allclose(done("start on the box").adapted.positions[0], TOPS["box"], atol=1e-9)


def test_at_and_in_stay_its_centre():
    for sentence in ("end at the box", "end in the box"):
        np.testing.assert_allclose(done(sentence).adapted.positions[-1], BOX.position, atol=1e-9)


def test_to_rest_on_an_object_is_to_wait_on_its_top():
    rows = done("rest on the box").adapted
    still = rows.positions[rows.speeds < 1e-3]
    np.testing.assert_allclose(still, np.tile(TOPS["box"], (len(still), 1)), atol=1e-9)


@pytest.mark.parametrize("sentence", ["touch the box", "tap the box on the way", "touch the box and go on"])
def test_touching_is_at_the_nearest_point_of_the_surface(sentence):
    result = adapt(Request(sentence, PATH, SCENE), writer="builtin")
    assert abs(depth(result, BOX)) < 1e-6, result.status


def test_objects_that_are_touched_together_are_all_touched():
    code = done("touch the table and the box").code
    assert code.count("aim='surface'") == 4


def test_a_robot_with_a_body_lands_with_the_point_that_its_path_is_of():
    result = done("land on the table", robot=Robot.preset("drone"))
    np.testing.assert_allclose(result.adapted.positions[-1], TOPS["table"], atol=1e-9)
    assert "table" not in result.constraints.exempt
    beside = result.adapted.positions[:-1]
    low = beside[(np.abs(beside[:, 0] - 1.0) > 0.2) & (beside[:, 2] < 0.2)]
    assert not len(low)  # it does not come in beside the table and through its edge


def test_where_a_size_is_not_known_the_position_stands_for_the_top():
    result = done("end on the ball")
    np.testing.assert_allclose(result.adapted.positions[-1], [0.8, 0.6, 0.2])
    assert any("size of ball is not known" in line for line in result.assumptions)


def test_frames_have_the_aim_that_is_said():
    at = LearnedReader().read
    (frame,) = at("end on the box", SCENE, PATH.positions).frames
    assert isinstance(frame, F.MoveEnd) and frame.aim == "top"
    (frame,) = at("touch the box", SCENE, PATH.positions).frames
    assert isinstance(frame, F.Visit) and frame.aim == "surface"
    (frame,) = at("end at the box", SCENE, PATH.positions).frames
    assert isinstance(frame, F.MoveEnd) and not frame.aim


@pytest.mark.parametrize(
    ("said", "plain"),
    [
        ("end goal on=box", "end goal to=box"),
        ("via touch=box+table", "via box+table"),
        ("extend on=table", "extend to=table"),
        ("wait on=box", "wait at=box"),
        ("stop on=box", "stop at=box"),
    ],
)
def test_an_aim_is_written_and_read_in_the_notation(said, plain):
    frames = parse(said, SCENE.names)
    assert frames[0].aim and show(frames) == said
    assert F.from_json(F.to_json(frames)) == frames
    assert same(frames, parse(plain, SCENE.names))


def test_a_promise_of_the_top_is_broken_by_the_centre():
    from ovita.toolkit.catalogue import Recorder
    from ovita.toolkit.judging import judge
    from ovita.toolkit.moves import move_goal
    from ovita.toolkit.postconditions import expect_goal, expect_visits

    rows = PATH.to_array()
    top, touch = expect_goal(BOX, aim="top"), expect_visits(BOX, 0.02, aim="surface")
    right, wrong = move_goal(rows, BOX, aim="top"), move_goal(rows, BOX)
    assert judge(top, rows, right, SCENE).held and not judge(top, rows, wrong, SCENE).held
    assert judge(touch, rows, move_goal(rows, BOX, aim="surface"), SCENE).held
    assert not judge(touch, rows, rows, SCENE).held and not judge(touch, rows, wrong, SCENE).held
    with pytest.raises(ValueError, match="aim must be"):
        move_goal(rows, BOX, aim="bottom")
    recorder = Recorder()
    move_goal(rows, BOX, aim="top", up=0.1, recorder=recorder)
    assert not recorder.contacts  # an offset keeps away from it
