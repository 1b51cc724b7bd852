"""Joints that a real arm could take: the controller's names, accelerations, and a start from where the arm is."""

import json

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("mink")
pytest.importorskip("toppra")
pytest.importorskip("rosbags")

from ovita.chain import adapt
from ovita.cli.transfer_ import convert, send
from ovita.errors import FormatError, LinkError, RequestError, RobotError
from ovita.io import controllers, load_task, save_trajectory
from ovita.io.bags import bag_maker, bag_of, load_joint_motion, save_joint_motion
from ovita.io.controllers import JOINT_STATE, joint_state
from ovita.io.links import Address
from ovita.io.messages import TopicMessage
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Frame, Scene, SceneObject, transformed
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.sim import Base, load_model
from ovita.sim.joints import arm_joints, joint_motion, start_problem, tool_path

PATH = Trajectory([[0.45, 0.1 * i - 0.1, 0.5] for i in range(3)], [0.1, 0.2, 0.1])
SCENE = Scene(frame=Frame("flu"))
KUKA = tuple(f"lbr_iiwa_joint_{i}" for i in range(1, 8))


@pytest.fixture(scope="module")
def motion():
    return joint_motion(PATH, SCENE, "iiwa", base=Base(), names="lbr_iiwa_joint_N")[0]


def test_the_controllers_names_are_written_and_read(motion):
    assert motion.names == KUKA
    path = tool_path(motion, "iiwa")
    np.testing.assert_allclose(path.positions[[0, -1]], PATH.positions[[0, -1]], atol=1e-3)
    assert arm_joints("iiwa", "left_*").sent[0] == "left_a1"
    assert arm_joints("iiwa", "q,w,e,r,t,z,u").sent == tuple("qwertzu")
    for wrong in ("a,b", "joint", "a,a,a,a,a,a,a", ""):
        if wrong:
            with pytest.raises(RobotError, match="do not fit the 7 joints a1, a2"):
                arm_joints("iiwa", wrong)


def test_states_with_more_joints_are_read_by_name():
    joints = arm_joints("iiwa")
    state = {"gripper": 9.0} | {name: i / 10 for i, name in reversed(list(enumerate(KUKA)))}
    assert joints.state(state).tolist() == [i / 10 for i in range(7)]
    with pytest.raises(RobotError, match="say how they are named: --joint-names"):
        joints.state({"gripper": 1.0})


def test_accelerations_are_those_of_the_motion_and_within_the_limits(motion):
    middle = motion.times[1:-1]
    by_rates = np.gradient(motion.velocities, motion.times, axis=0)[1:-1]
    assert len(middle) > 20 and np.abs(motion.accelerations[1:-1] - by_rates).mean() < 0.1
    limits = load_model("iiwa").limits
    assert (np.abs(motion.velocities) <= np.array(limits.velocity) * 1.01).all()
    assert (np.abs(motion.accelerations) <= np.array(limits.acceleration) * 1.05).all()
    assert not motion.accelerations[[0, -1]].any() and not motion.velocities[[0, -1]].any()


@pytest.mark.parametrize(("q", "said"), [(57.6, "is it in degrees"), (2.2, "goes from -2.094 to 2.094")])
def test_a_state_that_the_joint_cannot_be_in_is_one_sentence(q, said):
    with pytest.raises(RobotError, match=f"a2 is {q:.3f} rad, .*{said}"):
        arm_joints("iiwa").state(dict(zip((f"a{i}" for i in range(1, 8)), (0, q, 0, 0, 0, 0, 0), strict=True)))


def test_accelerations_survive_a_bag(motion, tmp_path):
    save_joint_motion(tmp_path / "j.mcap", motion)
    np.testing.assert_array_equal(load_joint_motion(tmp_path / "j.mcap").accelerations, motion.accelerations)


def test_a_gap_at_the_start_is_a_problem_beyond_the_tolerance(motion):
    start = motion.positions[0]
    assert start_problem(motion, start + 0.009) is None
    assert start_problem(motion, start + 0.009, 0.005) is not None
    far = start.copy()
    far[3] += 0.3
    assert start_problem(motion, far).startswith("lbr_iiwa_joint_4 is 0.300 rad from where the motion starts")


def near(motion, gap=0.2):
    return dict(zip(motion.names, (motion.positions[0] + gap * np.array([1, -1, 1, 0, 0, 1, 1])).tolist(), strict=True))


@pytest.fixture
def files(tmp_path, motion):
    robot = Robot("cell", Box((-2, -2, -2), (2, 2, 2)), max_speed=0.5)
    adapt(Request("go up by 0.02", PATH, SCENE, robot), writer="builtin").save(str(tmp_path / "r.json"))
    (tmp_path / "now.json").write_text(json.dumps(near(motion)))
    arm = ["--arm", "iiwa", "--base", "0,0,0,0", "--joint-names", "lbr_iiwa_joint_N"]
    sent = [str(tmp_path / "r.json"), "--type", "joints", *arm, "--yes", "--log", str(tmp_path / "log")]
    return tmp_path, sent


def test_a_jump_is_refused_and_an_approach_bridges_it(files, capsys, motion):
    folder, sent = files
    out = str(folder / "j.mcap")
    asked = [*sent, "--to", out, "--joint-state", str(folder / "now.json")]
    with pytest.raises(SystemExit) as stopped:
        send.main(asked, standalone_mode=False)
    said = capsys.readouterr().out
    assert stopped.value.code == 4 and "the arm would jump; --approach plans a way there" in said
    send.main([*asked, "--approach"], standalone_mode=False)
    assert "Approach:" in capsys.readouterr().out
    whole = load_joint_motion(out)
    assert whole.names == KUKA
    np.testing.assert_allclose(whole.positions[0], list(near(motion).values()), atol=1e-9)
    steps = np.abs(np.diff(whole.positions, axis=0)) / np.diff(whole.times)[:, None]
    assert (steps <= np.array(load_model("iiwa").limits.velocity) * 1.02).all()
    tips = tool_path(whole, "iiwa", base=Base())
    assert tips.speeds.max() < 0.5
    events = [json.loads(line)["event"] for line in (folder / "log").read_text().splitlines()]
    assert events == ["refused", "sending", "sent"]


def test_without_a_state_it_is_said_that_the_start_was_not_checked(files, capsys):
    folder, sent = files
    send.main([*sent, "--to", str(folder / "j.mcap")], standalone_mode=False)
    assert "Start not checked" in capsys.readouterr().out


def test_a_live_arm_is_asked_where_it_is_and_asked_again_before_it_moves(files, monkeypatch, capsys, motion):
    _, sent = files
    asked = []

    def state(place, *_):
        asked.append(place)
        return dict(zip(KUKA, (np.zeros(7) if len(asked) > 1 else states[-1]), strict=True))

    robot_at = joint_motion(load_task_adapted(files), SCENE, "iiwa", base=Base())[0].positions[0]
    states = [robot_at]
    monkeypatch.setattr("ovita.cli.joints_.joint_state", state)
    with pytest.raises(RequestError, match="the arm has moved since it was asked"):
        send.main([*sent, "--to", "ros2:/arm/follow_joint_trajectory?domain=7&frame_id=x"], standalone_mode=False)
    assert asked == ["ros2:/joint_states?domain=7"] * 2
    assert "Start checked: every joint is within" in capsys.readouterr().out


def load_task_adapted(files):
    from ovita.result import Adaptation

    return Adaptation.load(str(files[0] / "r.json")).adapted


def test_an_approach_through_an_object_goes_around_it_or_is_refused(motion):
    from ovita.sources.approach import approach

    model, robot = load_model("iiwa"), Robot("cell", Box((-2, -2, -2), (2, 2, 2)), max_speed=0.5)
    now = motion.positions[0].copy()
    now[0] -= 0.9
    free = approach(motion, now, model, SCENE, Base(), robot)
    between = tool_path(free, model, base=Base()).positions[: -len(motion.times)]
    wall = Scene((SceneObject("post", between[len(between) // 2], [0.04, 0.04, 0.3]),), SCENE.frame)
    around = approach(motion, now, model, wall, Base(), robot)
    tips = tool_path(around, model, base=Base()).positions
    assert wall["post"].clearance(tips).min() >= 0.01 - 1e-6 and around.duration > free.duration
    inside = Scene((SceneObject("box", between[0], [0.1, 0.1, 0.1]),), SCENE.frame)
    with pytest.raises(
        RequestError, match=r"no approach: at where the arm is, its tip at \[.*\] is .*too near to box \("
    ):
        approach(motion, now, model, inside, Base(), robot)


def test_an_approach_that_fails_names_what_is_in_the_way(motion, monkeypatch):
    """A link against an object where the arm is, and what blocks the straight way where no other is found in time."""
    from ovita.sources.approach import approach

    model, robot = load_model("iiwa"), Robot("cell", Box((-2, -2, -2), (2, 2, 2)), max_speed=0.5)
    now = motion.positions[0].copy()
    now[0] -= 0.9
    post = Scene((SceneObject("post", [0.0, 0.0, 0.7], [0.2, 0.2, 0.2]),), SCENE.frame)
    with pytest.raises(
        RequestError, match=r"where the arm is, (post and \w+|\w+ and post) are too near to each other at \["
    ):
        approach(motion, now, model, post, Base(), robot)
    path = tool_path(approach(motion, now, model, SCENE, Base(), robot), model, base=Base()).positions
    wall = Scene((SceneObject("wall", path[len(path) // 4], [0.04, 0.04, 0.6]),), SCENE.frame)
    monkeypatch.setattr("ovita.sources.joints.solve", lambda *_, **__: None)
    with pytest.raises(RequestError, match=r"found in 20 s; on the straight way .* wall"):
        approach(motion, now, model, wall, Base(), robot)


def test_joint_states_come_from_files_and_bags(tmp_path):
    (tmp_path / "a.json").write_text('{"a1": 0.5, "a2": -1}')
    (tmp_path / "b.yaml").write_text("header: {frame_id: ''}\nname: [a1, a2]\nposition: [0.5, -1.0]\n---\n")
    maker = bag_maker()

    def message(names, values):
        columns = dict.fromkeys(("velocity", "effort"), maker.floats(np.zeros(0)))
        floats = maker.floats(np.array(values, dtype=float))
        return maker.new(JOINT_STATE, header=maker.header("", 0), name=list(names), position=floats, **columns)

    logged = [
        TopicMessage("/joint_states", JOINT_STATE, message(names, values), at)
        for at, (names, values) in enumerate([(("a1", "a2"), (9, 9)), (("a2",), (-1,)), (("a1",), (0.5,))])
    ]
    (tmp_path / "c.mcap").write_bytes(bag_of(tmp_path / "c.mcap", logged))
    for name in ("a.json", "b.yaml", "c.mcap"):
        assert joint_state(str(tmp_path / name)) == {"a1": 0.5, "a2": -1.0}, name


@pytest.mark.parametrize(
    ("name", "text", "said"),
    [
        ("a.json", "[1]", "holds no joint state"),
        ("a.json", '{"a1": "x"}', "a1"),
        ("a.json", '{"a1": NaN}', "a1"),
        ("a.json", "{", "this is not JSON"),
        ("a.json", '{"name": ["a"], "position": []}', "holds 1 joint names and 0 positions"),
        ("a.json", '{"name": ["a", "a"], "position": [1, 2]}', "names a joint twice"),
        ("a.yaml", "a: [", "this is not YAML"),
    ],
)
def test_a_wrong_joint_state_is_one_sentence(tmp_path, name, text, said):
    (tmp_path / name).write_text(text)
    with pytest.raises(FormatError) as error:
        joint_state(str(tmp_path / name))
    assert said in str(error.value) and name in str(error.value) and "\n" not in str(error.value)


@pytest.mark.parametrize("frame", ["rfu", "flu", "ned"])
def test_the_frame_of_the_scene_survives_joints_and_back(tmp_path, frame, capsys):
    """Left must not change its meaning: what comes back has the axes in which the base was given."""
    moved = transformed(PATH, Frame("flu"), Frame(frame))
    task, bag, back = (str(tmp_path / name) for name in ("a.json", "j.mcap", "b.json"))
    save_trajectory(task, moved, Scene(frame=Frame(frame)))
    arm = ["--arm", "iiwa", "--base", {"rfu": "0,0,0,1.5707963", "flu": "0,0,0,0", "ned": "0,0,0,0"}[frame]]
    convert.main([task, bag, "--type", "joints", *arm], standalone_mode=False)
    convert.main([bag, back, *arm], standalone_mode=False)
    there = load_task(back)
    assert there.scene.frame == Frame(frame)
    np.testing.assert_allclose(there.trajectory.positions[[0, -1]], moved.positions[[0, -1]], atol=2e-3)


def test_options_on_an_arm_that_is_not_named_are_refused(tmp_path):
    with pytest.raises(RequestError, match="--joint-names x_N is about an arm; name the arm as well"):
        convert.main([str(tmp_path / "a.json"), "b.json", "--joint-names", "x_N"], standalone_mode=False)


class Future:
    def __init__(self, value=None, done=True):
        self.value, self.ready = value, done

    def done(self):
        return self.ready

    def result(self):
        return self.value


class Goal:
    """What rclpy gives for a goal: a result that comes or not, and an answer to a cancel."""

    def __init__(self, status=4, code=0, done=True, after_cancel=5, confirms=True):
        result = type("Result", (), {"error_code": code, "error_string": ""})
        self.response = type("Response", (), {"status": status, "result": result})
        self.future, self.after, self.confirms, self.cancelled = Future(self.response, done), after_cancel, confirms, 0

    def get_result_async(self):
        return self.future

    def cancel_goal_async(self):
        self.cancelled += 1
        self.future.ready = self.confirms
        self.response.status = self.after
        return Future(done=self.confirms)


def interrupt():
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("goal", "said"),
    [
        (Goal(status=6, code=-4), "was aborted: path tolerance violated"),
        (Goal(status=6, code=-2), "give them with --joint-names"),
        (Goal(status=4, code=-5), "ended: goal tolerance violated"),
        (Goal(status=5, code=0), "was cancelled by the controller"),
        (Goal(status=6, code=-77), "error code -77, which the action does not define"),
        (Goal(done=False), "cancelled by Ctrl-C; the controller confirmed it and holds the arm"),
        (Goal(done=False, after_cancel=4), "had ended before: the arm is at the last point"),
        (Goal(done=False, confirms=False), "THE CONTROLLER DID NOT CONFIRM"),
    ],
)
def test_how_a_goal_ends_is_explained(goal, said):
    address = Address.parse("ros2:/arm/follow_joint_trajectory?timeout=0.01")
    with pytest.raises(LinkError) as error:
        controllers._await(address, goal, 1.0, interrupt if not goal.future.ready else lambda: None)
    assert said in str(error.value)
    assert goal.cancelled == int("ancelled by Ctrl-C" in str(error.value))


def test_a_goal_that_succeeds_and_its_feedback(motion):
    controllers._await(Address.parse("ros2:/a"), Goal(), 1.0, lambda: None)
    line = controllers.progress_line(motion, 1.25, ["a1", "a2"], [0.001, -0.02])
    assert line == f"1.2 of {motion.duration:.1f} s, off by at most 0.0200 rad (a2)"


def test_an_action_needs_rclpy(motion, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "rclpy", None)
    with pytest.raises(LinkError, match="or send a JointTrajectory to the controller's topic"):
        controllers.follow(Address.parse("ros2:/arm/follow_joint_trajectory"), motion)


def test_a_base_in_degrees_is_refused():
    with pytest.raises(RequestError, match=r"the yaw 90 is more than a turn; give radians \(90 degrees are 1.571\)"):
        Base.parse("0.5,0,0,90")


def test_joints_without_a_base_are_told_to_be_in_the_arms_own_axes(files, capsys):
    from ovita.cli.transfer_ import convert

    folder, sent = files
    send.main([*sent, "--to", str(folder / "j.mcap")], standalone_mode=False)
    command = [str(folder / "j.mcap"), str(folder / "back.csv"), "--arm", "iiwa", "--joint-names", "lbr_iiwa_joint_N"]
    convert.main(command, standalone_mode=False)
    assert "they begin at the arm's own base, since --base does not say" in capsys.readouterr().err
    convert.main([*command, "--base", "0,0,0,0"], standalone_mode=False)
    assert "own base" not in capsys.readouterr().err
