"""Running policies: inputs, results, failures, limits, determinism."""

import sys

import numpy as np
import pytest

from ovita.errors import (
    IsolationUnavailable,
    PolicyCrashed,
    PolicyOutputInvalid,
    PolicyRejected,
    PolicyTimeout,
    RequestError,
)
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Policy, sandbox
from ovita.policy.reading import parse
from ovita.policy.sandbox import SandboxLimits, run

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="strict isolation needs Linux")


def adapt(body: str) -> Policy:
    return Policy("def adapt(traj, scene):\n" + "".join(f"    {line}\n" for line in body.split("\n")))


def script(body: str) -> Policy:
    return Policy(body, "script")


def test_a_rollout_says_what_happened(line, table):
    policy = parse(
        "def adapt(traj, scene, *, distance=0.2):\n"
        "    cup = scene['the red cups']\n"
        "    expect_closer(cup)\n"
        "    print_ = print\n"
        "    print_('hello', len(traj), sep='|')\n"
        "    return go_through(move(traj, left=distance), cup)\n"
    )
    rollout = run(policy.with_parameters(distance=0.1), line, table)
    assert rollout.contacts == ("Red Cup",)
    assert [e.kind for e in rollout.expectations] == ["closer"]
    assert rollout.expectations[0].arguments["object"] == "Red Cup"
    assert rollout.prints == "hello|100\n"
    assert rollout.isolation == "strict"
    assert 0 < rollout.elapsed_ms < 60_000
    assert rollout.trajectory.positions[0, 0] == pytest.approx(-0.1)


def test_the_scene_is_all_there(line):
    scene = Scene((SceneObject("Mug", [1, 2, 3], [0.1, 0.2, 0.3], [0, 1, 0, 0]),), Frame("flu"), environment="desk")
    policy = adapt(
        "mug = scene['mug']\n"
        "assert scene.names == ('Mug',) and len(scene) == 1 and 'mug' in scene and 'cup' not in scene\n"
        "assert scene.frame.name == 'flu' and scene.environment == 'desk'\n"
        "assert mug.dimensions.tolist() == [0.1, 0.2, 0.3] and mug.orientation.tolist() == [0, 1, 0, 0]\n"
        "assert [o.name for o in scene] == ['Mug']\n"
        "return move(traj, left=mug.position[1] / 10)"
    )
    assert run(policy, line, scene).trajectory.positions[0] == pytest.approx([0, 0.2, 0])


def test_the_script_form_sees_all_waypoints_and_objects(line, table):
    policy = script(
        "t = get_trajectory()\n"
        "assert len(t) == 100 and set(t[0]) == {'x', 'y', 'z', 'velocity'} and t[5]['speed'] == t[5]['velocity']\n"
        "o = detect_objects()\n"
        "assert [i['name'] for i in o] == ['red cup', 'laptop'] and o[0]['dimensions'] == [0.1, 0.1, 0.2]\n"
        "assert o[1]['dimensions'] == [0.05] * 3 and detect_objects('cup') == [o[0]] and detect_objects('sofa') == []\n"
        "t[3]['velocity'] = 0.7\n"
        "t[4]['speed'] = 0.9\n"
        "modified_trajectory = t\n"
    )
    speeds = run(policy, line, table).trajectory.speeds
    assert speeds[3:5].tolist() == [0.7, 0.9]


def test_the_input_is_not_shared(line, table):
    before = line.to_array()
    run(adapt("traj[:] = 0.5\nreturn traj"), line, table)
    assert np.array_equal(line.to_array(), before)


@pytest.mark.parametrize(
    ("body", "error", "sentence"),
    [
        ("import os\nreturn traj", PolicyRejected, "line 2: a policy may not open files"),
        ("x = 1\nreturn traj / [1, 2]", PolicyCrashed, "line 3: ValueError: operands could not be broadcast"),
        ("return move(traj, sideways=1)", PolicyCrashed, "line 2: ValueError: move: got an unexpected"),
        ("return traj + scene['sofa'].position", PolicyCrashed, "line 2: UnknownObject: the scene has no"),
        ("raise SystemExit", PolicyCrashed, "line 2: it ended with SystemExit; a policy returns its trajectory"),
        ("x: int = 'a'\nreturn 1 +", PolicyRejected, "line 3: this is not valid Python"),
        ("class E(Exception):\n    pass\nraise E", PolicyCrashed, "line 4: E"),
        ("return", PolicyOutputInvalid, "the result of adapt is None; it must be an array (N, 4) of x, y, z, speed"),
        ("return 3", PolicyOutputInvalid, "the result of adapt is a int, not an array"),
        ("return traj[:1]", PolicyOutputInvalid, "the policy returned 1 waypoints"),
        ("return traj[:, :2]", PolicyOutputInvalid, "the result of adapt has shape (100, 2)"),
        ("return traj[:50, :3]", PolicyOutputInvalid, "the result of adapt has no speeds and 50 waypoints"),
        ("return [['a', 1, 2, 3]] * 3", PolicyOutputInvalid, "the result of adapt is not a table of numbers"),
        ("return traj * 1j", PolicyOutputInvalid, "the result of adapt is not a table of numbers"),
        ("traj[7, 1] = np.nan\nreturn traj", PolicyOutputInvalid, "waypoint 7 of the result is [0.07"),
        ("traj[9, 3] = -0.5\nreturn traj", PolicyOutputInvalid, "waypoint 9 of the result has the negative speed -0.5"),
        ("traj[9, 3] = 1e4\nreturn traj", PolicyOutputInvalid, "waypoint 9 of the result has the speed 10000 m/s; 400"),
        ("traj[9, 0] = 1e4\nreturn traj", PolicyOutputInvalid, "waypoint 9 of the result is 9999.5 m from the middle"),
        ("return np.zeros((1000001, 4))", PolicyOutputInvalid, "the result of adapt has 1000001 waypoints; 1000000"),
        ("return [{'x': 1, 'y': 2}]", PolicyOutputInvalid, "waypoint 0 of the result of adapt has no 'z'"),
        ("return [{'x': 1, 'y': 2, 'z': 3}] * 2", PolicyOutputInvalid, "waypoint 0 of the result of adapt has no"),
        ("x = [1] * (1 << 40)", PolicyTimeout, "line 2: it used too much memory"),
    ],
)  # fmt: skip
def test_failures_are_sentences_with_a_line(body, error, sentence, line, table):
    with pytest.raises(error) as caught:
        run(adapt(body), line, table)
    assert str(caught.value).startswith(sentence)


@pytest.mark.parametrize(
    "body",
    [
        "    t = get_trajectory()\n    modified_trajectory = t[1:]\n",
        '    """Text."""\n    t = get_trajectory()\n    modified_trajectory = t\n    modified_trajectory.pop()\n',
        "    t = get_trajectory()\n    if t:\n        modified_trajectory = t[1:]\n    else:\n        return\n",
        "    global modified_trajectory\n    modified_trajectory = get_trajectory()[1:]\n",
        "    modified_trajectory = get_trajectory()\n    return modified_trajectory[1:]\n",
    ],
)
@pytest.mark.parametrize("call", ["if __name__ == '__main__':\n    main()\n", "main()\n"])
def test_a_main_function_may_set_or_return_the_result(body, call, line, table):
    policy = parse(f"def helper(x):\n    return x\n\n\ndef main():\n{body}\n\n{call}")
    assert len(run(policy, line, table).trajectory) == 99


def test_a_script_without_result_says_so(line, table):
    with pytest.raises(PolicyOutputInvalid, match="modified_trajectory is None"):
        run(script("modified_trajectory = None\n"), line, table)
    with pytest.raises(PolicyCrashed, match="line 2: ZeroDivisionError"):
        run(script("modified_trajectory = get_trajectory()\n1 / 0\n"), line, table)


def test_tiny_negative_speeds_are_rounding(line, table):
    rollout = run(adapt("traj[3, 3] = -1e-12\nreturn traj"), line, table)
    assert rollout.trajectory.speeds[3] == 0.0


def test_time_is_limited(line, table):
    limits = SandboxLimits(wall_s=0.2)
    for body in (
        "while True:\n    pass",
        "try:\n    while True:\n        pass\nexcept BaseException:\n    while True:\n        pass",
    ):
        with pytest.raises(PolicyTimeout, match=r"it ran longer than 0.2 s"):
            run(adapt(body), line, table, limits=limits)


def test_memory_is_limited(line, table):
    grow = adapt("x = []\nfor _ in range(60):\n    x.append(np.ones(1 << 20))\nreturn traj")
    with pytest.raises(PolicyTimeout, match="too much memory"):
        run(grow, line, table, limits=SandboxLimits(wall_s=60.0, memory_mb=100))
    run(grow, line, table, limits=SandboxLimits(wall_s=60.0, memory_mb=1000))


@pytest.mark.parametrize(("limits"), [{"wall_s": 0}, {"wall_s": float("nan")}, {"wall_s": 1e9}, {"memory_mb": 0}])
def test_limits_are_sane(limits):
    with pytest.raises(RequestError, match="limit must be"):
        SandboxLimits(**limits)


def test_text_comes_back_clean_and_short(line, table):
    rollout = run(adapt("print('\\x1b[31mred\\u202e\\x07ok')\nprint('y' * 10**6)\nreturn traj"), line, table)
    assert rollout.prints.startswith("[31mredok\nyyy")
    assert len(rollout.prints) <= 16 * 1024 + 3
    with pytest.raises(PolicyCrashed) as caught:
        run(adapt("raise ValueError('\\x1b]0;title\\x07' + 'z' * 10**6)"), line, table)
    assert str(caught.value).startswith("line 2: ValueError: ]0;titlezzz")
    assert len(str(caught.value)) < 2100


def test_the_same_input_gives_the_same_bytes(line, table):
    policy = adapt(
        "import random\n"
        "r = random.random() + random.Random().random() + np.random.rand() + np.random.default_rng().random()\n"
        "r += np.random.RandomState().rand() + np.random.Generator(np.random.PCG64()).random()\n"
        "order = list({'cup', 'box', 'laptop', 'bottle', 'chair'})\n"
        "print(order, r)\n"
        "return traj + r"
    )
    first = run(policy, line, table)
    again = run(policy, line, table)
    sandbox.close()
    fresh = run(policy, line, table)
    degraded = run(policy, line, table, isolation="degraded")
    for other in (again, fresh, degraded):
        assert other.trajectory.to_array().tobytes() == first.trajectory.to_array().tobytes()
        assert other.prints == first.prints


def quaternions(n: int) -> np.ndarray:
    angles = np.linspace(0, 1, n)
    return np.column_stack([np.cos(angles / 2), np.zeros(n), np.zeros(n), np.sin(angles / 2)])


def test_orientations_are_carried(line, table):
    turning = Trajectory(line.positions, line.speeds, quaternions(100), timestep=0.05)
    moved = run(
        parse("def adapt(traj, scene):\n    return dwell(move(traj, up=0.1), scene['laptop'])\n"), turning, table
    )
    assert len(moved.trajectory) == 110
    rows = {row.tobytes() for row in moved.trajectory.orientations}
    assert rows == {row.tobytes() for row in turning.orientations}
    assert moved.trajectory.timestep == 0.05
    for body in ("return traj + 0.1", "t = move(traj, up=1)\nu = t * 0.5\nreturn u", "traj[:, 0] += 1\nreturn traj"):
        same_count = run(adapt(body), turning, table).trajectory
        assert np.array_equal(same_count.orientations, turning.orientations)
    halved = run(adapt("return traj[::3]"), turning, table).trajectory
    assert halved.orientations[-1] == pytest.approx(turning.orientations[-1])
    assert halved.orientations[11] == pytest.approx(turning.orientations[33], abs=1e-3)
    still = run(adapt("return np.ones((5, 4))"), turning, table).trajectory
    assert still.orientations[2] == pytest.approx(turning.orientations[50], abs=0.02)


def test_a_function_may_take_fewer_arguments(line, table):
    assert (
        len(run(parse("def adapt(traj, distance=0.3):\n    return traj + distance\n"), line, table).trajectory) == 100
    )
    assert len(run(parse("def change():\n    return get_trajectory()\n"), line, table).trajectory) == 100


def test_big_trajectories_pass(table):
    n = 50_000
    big = Trajectory(np.linspace([0.0, 0, 0], [1, 1, 1], n), np.full(n, 0.2))
    rollout = run(adapt("return np.repeat(traj, 4, axis=0)"), big, table)
    assert len(rollout.trajectory) == 200_000


def test_strict_isolation_is_refused_where_the_kernel_lacks_it(line, table, monkeypatch):
    monkeypatch.setattr(sandbox, "missing", lambda: ("Landlock (Linux 5.13 or later)", "seccomp filters"))
    with pytest.raises(IsolationUnavailable, match=r"it lacks Landlock .* and seccomp filters; isolation='degraded'"):
        run(adapt("return np.array(traj)"), line, table)
    assert run(adapt("return move(traj, up=0.1)"), line, table).isolation == "in process"
    with pytest.raises(IsolationUnavailable, match="it lacks Landlock"):
        run(adapt("return move(traj, up=0.1)"), line, table, isolation="strict")
    assert run(adapt("return np.array(traj)"), line, table, isolation="degraded").isolation == "degraded"
