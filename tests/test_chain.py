"""The chain: from a request to a result that can be trusted."""

import json

import numpy as np
import pytest

from ovita.chain import adapt, rerun
from ovita.errors import PolicyError, WriterError
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import sandbox
from ovita.request import Request
from ovita.result import Adaptation
from ovita.writers.base import Reply, WriterInfo

PATH = Trajectory.from_array(
    np.column_stack([np.linspace(0, 1, 30), np.zeros(30), np.zeros(30), np.full(30, 0.4)]), timestep=0.2
)
SCENE = Scene((SceneObject("cup", [0.5, 0.3, 0.0], [0.06, 0.06, 0.1]), SceneObject("box", [1.2, 0.5, 0])))


class Scripted:
    """A writer that gives its answers one after the other, and keeps the prompts."""

    name = "scripted"

    def __init__(self, *answers):
        self.answers, self.prompts = list(answers), []

    def write(self, prompt):
        self.prompts.append(prompt)
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer


def policy(body, **kwargs):
    info = WriterInfo("scripted", "m", 0.1, 100, 10)
    return Reply("policy", plan=("A step.",), code=f"def adapt(traj, scene):\n    {body}\n", writer=info, **kwargs)


GOOD = policy("return move(traj, left=0.1)")


def request(instruction="go left", **kwargs):
    return Request(instruction, PATH, SCENE, **kwargs)


def test_the_builtin_writer_end_to_end():
    result = adapt(request("go up by 0.1 and slow down near the cup"), writer="builtin")
    assert result.status == "done" and result.attempts == 1 and result.isolation
    assert result.adapted.positions[:, 2] == pytest.approx(0.1)
    assert all(p.held for p in result.postconditions) and len(result.postconditions) == 2
    assert {p.name for p in result.parameters} == {"up", "cup_radius", "slowdown"}
    assert set(result.timings_ms) == {"ground", "write", "run", "constrain", "report"}
    assert result.adapted.timestep == 0.2


def test_documents_round_trip(tmp_path):
    for instruction in ("go up by 0.1", "moonwalk", "wait at the cup for 3 steps"):
        result = adapt(request(instruction, robot=Robot.preset("drone")), writer="builtin")
        path = tmp_path / "r.json"
        result.save(str(path))
        loaded = Adaptation.load(str(path))
        assert loaded == result
        assert json.loads(path.read_text()) == result.to_document()


def test_a_crashing_policy_goes_back_with_its_error_and_tokens_add_up():
    writer = Scripted(policy("return traj / nothing"), GOOD)
    result = adapt(request(), writer=writer)
    assert result.status == "done" and result.attempts == 2
    assert "nothing" in writer.prompts[1].attempts[0].error and "line 2" in writer.prompts[1].attempts[0].error
    assert (result.writer.input_tokens, result.writer.output_tokens) == (200, 20)


def test_after_two_repairs_it_gives_up_with_the_last_error():
    writer = Scripted(*[policy("return traj[:1]")] * 3, GOOD)
    result = adapt(request(), writer=writer)
    assert result.status == "failed" and result.attempts == 3 and result.adapted == PATH
    assert "waypoint" in result.error and len(writer.answers) == 1
    assert adapt(request(), writer=Scripted(policy("import os")), repairs=0).status == "failed"


@pytest.mark.parametrize(
    "body",
    [
        "return traj * float('nan')",
        "return 'hello'",
        "return traj * 1e9",
        "open('/etc/passwd')",
        "import socket",
        "return (",
    ],
)
def test_what_a_policy_must_not_do_or_return_is_never_a_result(body):
    result = adapt(request(), writer=Scripted(policy(body)), repairs=0)
    assert result.status == "failed" and result.error and result.adapted == PATH


def test_a_policy_without_end_is_never_a_result(monkeypatch):
    monkeypatch.setitem(sandbox.run.__kwdefaults__, "limits", sandbox.SandboxLimits(wall_s=0.3))
    result = adapt(request(), writer=Scripted(policy("while True: pass")), repairs=0)
    assert result.status == "failed" and "longer than 0.3 s" in result.error and result.adapted == PATH


def test_a_broken_promise_goes_back_and_the_last_policy_counts():
    bad = policy("expect_moved(left=0.1); return move(traj, right=0.1)")
    writer = Scripted(bad, policy("expect_moved(left=0.1); return move(traj, left=0.1)"))
    result = adapt(request(), writer=writer)
    assert result.attempts == 2 and not result.warnings
    assert "does not do what it promises" in writer.prompts[1].attempts[0].error
    stubborn = adapt(request(), writer=Scripted(bad, bad, bad))
    assert stubborn.status == "not_as_meant" and any("Not as meant" in w for w in stubborn.warnings)
    assert not stubborn.postconditions[0].held


@pytest.mark.parametrize(("end", "row"), [("start", 0), ("goal", -1)])
def test_an_end_that_is_to_stay_is_brought_back_from_where_a_policy_moved_it(end, row):
    stubborn = policy(f"expect_{end}(); return move(traj, left=0.2)")
    result = adapt(request(), writer=Scripted(*[stubborn] * 3))
    assert result.adapted.positions[row] == pytest.approx(PATH.positions[row], abs=1e-9)
    assert result.adapted.positions[-1 - row, 0] == pytest.approx(PATH.positions[-1 - row, 0] - 0.2)
    assert result.status == "done" and any("it was brought back" in text for text in result.warnings)


@pytest.mark.parametrize("said", ["stay away from the kettle", "avoid the kettle", "end at the kettle"])
def test_what_the_scene_lacks_is_named_in_the_question(said):
    result = adapt(Request(said, PATH, SCENE), writer="builtin")
    assert result.status == "needs_clarification"
    assert "'kettle'" in result.question and "'cup'" in result.question


def test_a_question_and_a_refusal_are_statuses():
    asked = adapt(request(), writer=Scripted(Reply("question", question="Which one?")))
    assert (asked.status, asked.message) == ("needs_clarification", "Which one?")
    refused = adapt(request(), writer=Scripted(Reply("not_understood", unplaced=("moonwalk",))))
    assert refused.status == "not_understood" and "'moonwalk'" in refused.message
    broken = adapt(request(), writer=Scripted(WriterError("the server is down")))
    assert broken.status == "failed" and broken.error == "the server is down"


def test_objects_to_be_touched_are_no_obstacles():
    through = "go through the cup"
    touched = adapt(request(through), writer="builtin")
    assert touched.contacts == ("cup",) and touched.constraints.exempt == ("cup",)
    assert SCENE["cup"].distance(touched.adapted.positions).min() == pytest.approx(0, abs=1e-9)
    named = adapt(request(), writer=Scripted(policy("return go_through(traj, [0.5, 0.3, 0.0])", contacts=("the cup",))))
    assert named.contacts == ("cup",)
    kept = adapt(request(), writer=Scripted(policy("return go_through(traj, [0.5, 0.3, 0.0])")))
    assert SCENE["cup"].clearance(kept.adapted.positions).min() >= 0.01 - 1e-6


def test_limits_that_cannot_hold_are_a_status_with_the_best_effort():
    far = Trajectory.from_array([[9, 0, 0, 0.1], [1, 0, 0, 0.1]])
    result = adapt(
        Request("go up by 0.1", far, robot=Robot.preset("drone")),
        writer="builtin",
        constraints=ConstraintOptions(fix_start=True),
    )
    assert result.status == "infeasible" and "best effort" in result.message
    assert result.adapted.positions[-1] == pytest.approx([1, 0, 0.1], abs=1e-6)


def test_nothing_changed_is_said():
    result = adapt(request(), writer=Scripted(*[policy("return traj")] * 3))
    assert any("Nothing changed" in w for w in result.warnings)
    assert result.status == "not_as_meant" and "Nothing changed" in result.message


def test_what_holds_already_is_done_and_says_so():
    result = adapt(request("keep at least 0.1 from the cup"), writer="builtin")
    assert result.status == "done" and result.warnings[0].startswith("Nothing had to change: the path is at least")
    vague = adapt(request(), writer=Scripted(*[policy("expect_same_path(); return traj")] * 3))
    assert vague.status == "not_as_meant"


def test_a_path_that_comes_to_a_standstill_is_not_done():
    result = adapt(request(), writer=Scripted(policy("return scale_speed(traj, 0.0)")), repairs=0)
    assert result.status != "done" and (result.error or "speed 0" in result.message)


def test_a_limit_that_the_original_broke_already_is_never_done():
    fast = Robot("slow", max_speed=None, workspace=Box((0.0, -1.0, -0.1), (0.5, 1.0, 1.0)))
    result = adapt(request("slow down", robot=fast), writer="builtin")
    assert result.status == "limited" and "original path broke already" in result.message
    measured = adapt(
        request("go up by 0.1", robot=fast), writer="builtin", constraints=ConstraintOptions(enabled=False)
    )
    assert measured.status == "limited" and "only measured" in measured.message


def test_the_result_keeps_how_limits_were_enforced_and_a_rerun_takes_it():
    options = ConstraintOptions(fix_goal=True, max_acceleration=2.0)
    result = adapt(request("go left by 0.1"), writer="builtin", constraints=options)
    assert result.options == options == rerun(result, {"left": 0.2}).options
    assert Adaptation.from_document(json.loads(json.dumps(result.to_document()))).options == options


def test_a_speed_edit_leaves_the_path_bit_by_bit():
    for robot in ("none", "drone", "ground"):
        result = adapt(request("slow down", robot=Robot.preset(robot)), writer="builtin")
        assert np.array_equal(result.adapted.positions, PATH.positions)


def test_the_explanation_holds_plan_numbers_and_knobs():
    text = adapt(request("go left by 0.2 and slow down near the cup"), writer="builtin").explanation
    for part in ("You asked", "0.2 m", "left", "cup", "What you can turn", "slowdown = 0.5"):
        assert part in text


def test_rerun_turns_a_knob_without_a_writer():
    result = adapt(request("go left by 0.2"), writer="builtin")
    again = rerun(result, {"left": 0.3})
    assert again.adapted.positions[:, 0] - PATH.positions[:, 0] == pytest.approx(-0.3)
    assert {p.name: p.value for p in again.parameters}["left"] == 0.3
    assert "0.3" in again.code and again.writer == result.writer
    with pytest.raises(PolicyError, match="left"):
        rerun(result, {"leftt": 0.3})


def test_orientations_travel_along():
    turned = Trajectory(PATH.positions, PATH.speeds, np.tile([0.0, 0, 0, 1], (30, 1)))
    for instruction in ("go left by 0.1", "wait at the cup for 5 steps", "double the number of waypoints"):
        result = adapt(Request(instruction, turned, SCENE), writer="builtin")
        assert len(result.adapted.orientations) == len(result.adapted)
        assert np.abs(result.adapted.orientations) == pytest.approx(np.tile([0.0, 0, 0, 1], (len(result.adapted), 1)))


def test_the_corners_of_a_zigzag_are_asked_for_and_those_of_a_short_part_are_not():
    assert not adapt(request(), writer=Scripted(policy("return zigzag(traj, 0.2, waves=3)"))).warnings
    short = "part = between(traj, 0.45, 0.55); return move(traj, left=0.4, where=part)"
    warnings = adapt(request(), writer=Scripted(policy(short))).warnings
    assert any(text.startswith("The path now turns") for text in warnings), warnings


def test_a_kink_that_an_edit_brings_is_warned_of():
    result = adapt(request(), writer=Scripted(policy("traj[5, 2] += 0.3\n    return traj")))
    assert any(text.startswith("The path now turns") and "waypoint 6" in text for text in result.warnings)
