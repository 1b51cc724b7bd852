"""What the limits leave of a change, promise by promise."""

import json

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.result import Adaptation, Postcondition
from ovita.writers.base import Reply, WriterInfo

PATH = Trajectory.from_array(
    np.column_stack([np.linspace(-0.5, 0.5, 41), np.zeros(41), np.zeros(41), np.full(41, 0.5)])
)
ROOM = Robot("room", Box((-1.0, -0.14, -1.0), (1.0, 1.0, 1.0)), max_speed=0.8)


class Fixed:
    """A writer that always gives the same policy."""

    name = "fixed"

    def __init__(self, *lines):
        self.code = "def adapt(traj, scene):\n" + "".join(f"    {line}\n" for line in lines)

    def write(self, prompt):
        return Reply("policy", plan=("A step.",), code=self.code, writer=WriterInfo("fixed"))


def adapted(*lines, scene=None, robot=ROOM):
    return adapt(Request("do it", PATH, scene or Scene(), robot=robot), writer=Fixed(*lines))


def test_a_move_that_the_workspace_cuts_short_says_how_much_is_left():
    result = adapted("traj = move(traj, back=0.2)", "expect_moved(back=0.2)", "return traj")
    promise = result.postconditions[0]
    assert promise.held_before and not promise.held
    assert (promise.change_before, promise.change, promise.unit) == (pytest.approx(0.2), pytest.approx(0.13), "m")
    assert promise.undone == pytest.approx(0.35)
    said = promise.sentences()[0]
    assert "35%" in said and "0.200 m without" in said and "0.130 m with" in said and promise.text in said
    assert said in result.warnings and said in result.explanation
    assert result.status == "limited" and "35%" in result.message and promise.text in result.message


def test_a_change_that_the_limits_take_back_entirely_is_not_as_meant():
    result = adapted(
        "traj = move(traj, up=0.2)",
        "expect_moved(up=0.2)",
        "return traj",
        robot=Robot("flat", Box((-1, -1, -0.5), (1, 1, 0.001)), margin=0.0),
    )
    assert result.postconditions[0].lost and result.status == "not_as_meant", result.postconditions


def test_closer_to_a_person_who_is_as_near_as_allowed_is_not_as_meant():
    """The limits leave a millimetre of it, which is closer, but nothing of what was meant."""
    scene = Scene((SceneObject("person", [0.0, 0.31, 0.0], [0.1, 0.1, 0.1]),))
    result = adapted(
        "traj = closer(traj, scene['person'], 0.1)", "expect_closer(scene['person'])", "return traj", scene=scene
    )
    assert result.postconditions[0].undone > 0.95
    assert result.status == "not_as_meant" and result.message.startswith("Not as meant"), result.message


def test_a_distance_that_holds_after_the_limits_took_most_of_the_change_back_is_as_meant():
    kept = Postcondition("it keeps 0.2 m", True, True, "it is 0.2 m away", 0.5, 0.01, kind="distance")
    assert kept.undone > 0.95 and not kept.lost
    assert Postcondition("it moves", True, True, "it moved", 0.5, 0.01, kind="moved").lost


def test_each_promise_has_its_own_share():
    result = adapted(
        "traj = scale_speed(move(traj, back=0.1), 2.0)", "expect_moved(back=0.1)", "expect_faster()", "return traj"
    )
    moved, faster = result.postconditions
    assert moved.undone == 0 and moved.sentences() == []
    assert (faster.change_before, faster.change, faster.unit) == (pytest.approx(0.5), pytest.approx(0.3), "m/s")
    assert faster.held and faster.undone == pytest.approx(0.4)


def test_an_obstacle_takes_back_what_comes_too_close():
    cup = SceneObject("cup", [0.0, 0.3, 0.0], [0.2, 0.2, 0.2])
    result = adapted(
        "traj = move(traj, front=0.25)",
        "expect_closer(scene['cup'], 0.25)",
        "return traj",
        scene=Scene((cup,)),
        robot=Robot("open", None, max_speed=None),
    )
    promise = result.postconditions[0]
    assert result.constraints.status == "repaired"
    assert promise.change < promise.change_before and 0 < promise.undone < 1


def test_the_limits_leave_an_end_that_is_to_stay_or_say_that_they_cannot():
    near = SceneObject("cup", [-0.47, 0.1, 0.0], [0.06, 0.06, 0.06])
    lines = ("traj = move(traj, front=0.1, keep='start')", "expect_start()", "return traj")
    stays = adapted(*lines, scene=Scene((near,)), robot=Robot("open", None, obstacle_margin=0.05))
    assert np.array_equal(stays.adapted.positions[0], PATH.positions[0]) and stays.postconditions[0].held
    inside = SceneObject("cup", [-0.5, 0.0, 0.0], [0.1, 0.1, 0.1])
    moved = adapted(*lines, scene=Scene((inside,)), robot=Robot("open", None, obstacle_margin=0.05))
    assert moved.status in ("limited", "not_as_meant", "infeasible"), moved.message
    assert moved.postconditions[0].held or any("the start is" in text for text in moved.warnings)


def test_where_nothing_was_limited_or_can_be_measured_nothing_is_said():
    result = adapted("traj = move(traj, front=0.2)", "expect_moved(front=0.2)", "expect_same_path()", "return traj")
    assert result.postconditions[0].undone == 0
    assert result.postconditions[1].undone is None and result.postconditions[1].change is None
    assert not any(p.sentences() for p in result.postconditions)


def test_results_saved_before_amounts_were_kept_still_load(tmp_path):
    result = adapted("traj = move(traj, back=0.2)", "expect_moved(back=0.2)", "return traj")
    document = json.loads(json.dumps(result.to_document()))
    assert Adaptation.from_document(document) == result
    for promise in document["postconditions"]:
        for key in ("change_before", "change", "unit", "kind", "arguments"):
            del promise[key]
    for check in document["constraints"]["checks"]:
        check["violation_original"] = 0.0
    document["status"] = "ok"  # as it was before there was a ladder of verdicts
    del document["options"]
    old = Adaptation.from_document(document).postconditions[0]
    assert Adaptation.from_document(document).status == "limited"
    assert old == Postcondition(old.text, True, False, result.postconditions[0].outcome)
    assert old.undone is None and old.sentences() == []
