"""Proven policies run in this process: what may be in one, what they may not grow to, and that nothing else gets in."""

import inspect
import re
import resource
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ovita.errors import IsolationUnavailable, PolicyCrashed, PolicyOutputInvalid, RequestError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Policy, sandbox
from ovita.policy.policy import MAX_WAYPOINTS, TooMuch, run_proven
from ovita.policy.sandbox import Isolation, SandboxLimits, run
from ovita.toolkit import CATALOGUE
from ovita.toolkit.catalogue import public_signature
from ovita.writers.examples import examples

linux = pytest.mark.skipif(sys.platform != "linux", reason="strict isolation needs Linux")


def adapt(body: str, knobs: str = "") -> Policy:
    lines = "".join(f"    {line}\n" for line in body.split("\n"))
    return Policy(f"def adapt(traj, scene{knobs}):\n{lines}")


@pytest.fixture
def no_process(monkeypatch):
    """Any attempt to run a policy in a process of its own fails the test."""
    monkeypatch.setattr(sandbox, "_in_a_process", lambda *_: pytest.fail("a process was asked"))


PROVEN = [
    "return move(traj, left=0.2)",
    "cup = scene['red cup']\nexpect_closer(cup)\nreturn closer(traj, cup, by=0.05)",
    "if 'sofa' in scene:\n    traj = move(traj, up=0.1)\nelse:\n    traj = move(traj, up=-0.02)\nreturn traj",
    "part = near(traj, scene['laptop'], within=0.3) | first(traj, 3)\nreturn move(traj, up=0.1, where=~part)",
    "return move(traj, up=0.1, where=-traj[:, 0] > -0.5)",
    "return scale_speed(traj, max(0.5, min(2, abs(-0.7))), where=last(traj, len(traj) // 2))",
    "top = scene['red cup'].position[2] + scene['red cup'].size[2] / 2\nreturn move(traj, up=2 * top)",
    "return traj + [0, 0, 0.1, 0]",
    "return dwell(resample(traj, 60), 'goal', steps=5)",
    "expect_moved(left=0.1, where=first(traj, 5))\nreturn move(traj, left=0.1)",
]


@linux
@pytest.mark.parametrize("body", PROVEN)
def test_both_ways_of_running_agree_to_the_bit(body, line, table):
    here, there = (run(adapt(body), line, table, isolation=how) for how in ("auto", "strict"))
    assert (here.isolation, there.isolation) == ("in process", "strict")
    assert here.trajectory.to_array().tobytes() == there.trajectory.to_array().tobytes()
    assert (here.contacts, here.expectations, here.prints) == (there.contacts, there.expectations, there.prints)


@linux
@pytest.mark.parametrize(
    "body",
    [
        "return move(traj, sideways=1)",
        "x = 1\nreturn move(traj, up=x / 0)",
        "return traj + scene['sofa'].position",
        "return closer(\n    traj,\n    'cup',\n)",
        "return traj[:, :2]",
        "return traj[:1]",
        "expect_closer(scene['red cup'])",
        "return traj * -1",
        "if traj > 0:\n    pass\nreturn traj",
        "return first(traj, 3)",
        "return move(traj, up=traj)",
        "return len(traj) + 1",
    ],
)
def test_both_ways_of_running_fail_alike(body, line, table):
    problems = []
    for how in ("auto", "strict"):
        with pytest.raises((PolicyCrashed, PolicyOutputInvalid)) as caught:
            run(adapt(body), line, table, isolation=how)
        problems.append((type(caught.value), str(caught.value)))
    assert problems[0] == problems[1]


def test_most_examples_need_no_process():
    answers = [Policy(e.code) for e in examples() if e.code]
    assert sum(policy.toolkit_only for policy in answers) >= 0.75 * len(answers)


NOT_PROVEN = [
    "import math\nreturn traj",
    "for i in first(traj, 3):\n    traj = move(traj, up=0.1)\nreturn traj",
    "while True:\n    pass",
    "traj[0] = 1\nreturn traj",
    "traj += 1\nreturn traj",
    "return [p for p in traj]",
    "return (lambda: traj)()",
    "return (n := traj)",
    "return traj.copy()",
    "return traj.T",
    "return traj.base",
    "return traj.tofile('x')",
    "return traj.__class__",
    "return scene.__class__",
    "return scene.frame",
    "return scene.objects",
    "return np.array(traj)",
    "return math.pi",
    "return move",
    "f = move\nreturn f(traj)",
    "return move(traj)(traj)",
    "return scene['cup'](traj)",
    "return (move)(*traj)",
    "return move(**scene)",
    "return max(traj, key=len)",
    "return min(traj, default=move)",
    "return getattr(traj, 'shape')",
    "return str(traj)",
    "return print(traj)",
    "return f'{traj}'",
    "return '{0.__class__}'.format(traj)",
    "return 'a' % traj",
    "return 2 ** 9 ** 9",
    "return 1 << 9 ** 9",
    "return traj % 2",
    "return traj @ traj",
    "return 1j * traj",
    "return b'abc'",
    "return ...",
    "return {'a': traj}",
    "return {1, 2}",
    "return traj if scene else traj",
    "a, b = traj\nreturn a",
    "a = b = traj\nreturn a",
    "scene.x = 1\nreturn traj",
    "global x\nx = 1\nreturn traj",
    "del traj",
    "assert traj\nreturn traj",
    "raise ValueError",
    "try:\n    pass\nexcept ValueError:\n    pass\nreturn traj",
    "with scene:\n    pass",
    "yield traj",
    "def inner():\n    pass\nreturn traj",
    "class A:\n    pass\nreturn traj",
    "match traj:\n    case _:\n        pass",
    "len = move\nreturn traj",
    "move = 1\nreturn traj",
    "_x = 1\nreturn traj",
    "x: int = 1\nreturn traj",
    "return undefined",
    "return __import__('os')",
    "return open('x')",
    "return eval('1')",
    "return get_trajectory()",
    "return near(traj, *scene)",
    "return not_a_function(traj)",
]


@pytest.mark.parametrize("body", NOT_PROVEN)
def test_nothing_else_is_proven(body, line, table):
    policy = adapt(body)
    assert not policy.toolkit_only
    with pytest.raises(TooMuch):
        run_proven(policy.tree, line.to_array(), table)


@pytest.mark.parametrize(
    "source",
    [
        "import os\ndef adapt(traj, scene):\n    return traj\n",
        "x = 1\ndef adapt(traj, scene):\n    return traj\n",
        "def adapt(traj, scene):\n    return traj\ndef other(traj):\n    return traj\n",
        "@near\ndef adapt(traj, scene):\n    return traj\n",
        "def adapt(traj, scene, *, x=open('f')):\n    return traj\n",
        "def adapt(traj, scene, *, x=move):\n    return traj\n",
        "def adapt(traj, scene, *, x=9**9):\n    return traj\n",
        "def adapt(*traj):\n    return traj\n",
        "def adapt(traj, scene, **more):\n    return traj\n",
        "def adapt(traj, scene, *, np=1):\n    return traj\n",
        "def adapt(traj, scene, *, move=1):\n    return traj\n",
        "async def adapt(traj, scene):\n    return traj\n",
        "adapt = lambda traj, scene: traj\n",
        "modified_trajectory = get_trajectory()\n",
    ],
)
def test_a_proven_policy_is_one_plain_function(source):
    assert not Policy(source).toolkit_only


GROWING = {
    "a list of a billion": "x = [0] * 1000000000\nreturn traj",
    "a billion lists": "x = 1000000000 * [0]\nreturn traj",
    "a long text": "x = 'a' * 1000000000\nreturn traj",
    "a text and a text": "x = 'a' + 'b'\nreturn traj",
    "a tuple that doubles": "x = (1, 2)\n" + "x = x + x\n" * 40 + "return traj",
    "a number that squares": "x = 9.5\n" + "x = x * x\n" * 40 + "return traj",
    "a whole number that squares": "x = 9\n" + "x = x * x\n" * 40 + "return traj",
    "a large number": "x = 10000000000000000000\nreturn traj",
    "an outer product": "x = traj[:, 0:1] * traj[:, 0]\nx = x * x\nreturn traj" + " " * 0,
    "three axes": "x = traj[:, None, None, 0] + traj[:, None, 0] + traj[:, 0]\nreturn traj",
    "an index list": "x = traj[[0, 0, 0, 0, 0, 0]]\nreturn traj",
    "an index array": "x = traj[1 * (traj[:, 0] > 0)]\nreturn traj",
    "a comparison of many": "x = traj[:, 0:1] > traj[:, 0]\nreturn x",
    "many calls": "traj = move(traj, up=0.0001)\n" * 80 + "return traj",
    "much arithmetic": "traj = traj + 0.0\n" * 2000 + "return traj",
    "many waypoints": "traj = resample(traj, 9000)\ntraj = move(traj, up=0.1)\nreturn traj",
    "deep": "x = " + "-" * 140 + "1\nreturn traj",
}


@pytest.mark.parametrize("name", GROWING)
def test_what_grows_is_left_to_the_sandbox(name, table):
    many = Trajectory(np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], 2000), np.full(2000, 0.1))
    policy = adapt(GROWING[name])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = time.process_time()
    try:
        run_proven(policy.tree, many.to_array(), table)
        assert name == "deep"
    except TooMuch:
        assert name != "deep"
    assert time.process_time() - started < 1.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200 << 10


def test_a_long_path_is_left_to_the_sandbox(table):
    rows = np.zeros((MAX_WAYPOINTS + 1, 4))
    with pytest.raises(TooMuch):
        run_proven(adapt("return move(traj, up=0.1)").tree, rows, table)


EXTREMES = (0, 1, -1, 1e-9, 1e6, -1e6, 1000000, 0.5, "left", True, None, (1e6, 0.0, 1e-9))


@pytest.mark.parametrize("name", CATALOGUE)
def test_no_call_takes_long_or_much_whatever_it_is_given(name, table):
    rows = np.column_stack([np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], 300), np.full(300, 0.1)])
    known = list(public_signature(name).parameters)
    before, started, tried = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time(), 0
    for extreme in EXTREMES:
        for parameter in known[0 if name.startswith("expect") else 1 :]:
            given = {"obj": "scene['red cup']", "traj": "traj", "amount": "0.1", "n": "5", "k": "2", "by": "0.1"}
            given |= {"radius": "0.1", "amplitude": "0.1", "factor": "0.5", "fraction": "0.3", parameter: repr(extreme)}
            signature = public_signature(name).parameters.values()
            needed = [p.name for p in signature if p.default is p.empty or p.name == parameter]
            call = f"{name}({', '.join(f'{p}={given.get(p, 0.1)}' for p in needed)})"
            tried += 1
            try:
                run_proven(adapt(f"return {call}").tree, rows, table)
            except (PolicyCrashed, TooMuch):
                pass
    assert time.process_time() - started <= 0.25 * (tried + 1)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300 << 10


def test_the_input_and_the_scene_stay_as_they_were(line, table, no_process):
    before, policy = line.to_array(), adapt("return move(traj, up=0.1)")
    assert run(policy, line, table).trajectory != line
    assert np.array_equal(line.to_array(), before)


def test_nothing_is_compiled():
    text = Path(inspect.getfile(run_proven)).read_text()
    assert not re.search(r"\b(exec|eval|compile|globals|__import__|import_module)\b\(", text)


@linux
def test_strict_degraded_and_limits_force_a_process(line, table, monkeypatch):
    policy = adapt("return move(traj, up=0.1)")
    monkeypatch.setattr("ovita.policy.policy.run_proven", lambda *_: pytest.fail("ran in process"))
    monkeypatch.setattr(sandbox, "run_proven", lambda *_: pytest.fail("ran in process"))
    assert run(policy, line, table, isolation="strict").isolation == "strict"
    assert run(policy, line, table, isolation="degraded").isolation == "degraded"
    assert run(policy, line, table, limits=SandboxLimits(wall_s=9.0)).isolation == "strict"


@linux
def test_what_is_not_proven_runs_locked_in(line, table, monkeypatch):
    assert run(adapt("return np.array(traj)"), line, table).isolation == "strict"
    assert run(adapt("x = [0] * 2\nreturn traj"), line, table).isolation == "strict"
    monkeypatch.setattr(sandbox, "missing", lambda: ("Landlock",))
    with pytest.raises(IsolationUnavailable, match="lacks Landlock"):
        run(adapt("x = [0] * 2\nreturn traj"), line, table)


@pytest.mark.parametrize("isolation", [None, "", "Strict", "none", "in process", 1, True, ["strict"], b"strict"])
def test_an_unknown_isolation_is_refused(isolation: Isolation, line, table, no_process):
    with pytest.raises(RequestError, match="is unknown; use 'auto', 'strict' or 'degraded'"):
        run(adapt("return move(traj, up=0.1)"), line, table, isolation=isolation)


def test_a_scene_object_has_no_other_attributes(line):
    scene = Scene((SceneObject("cup", np.zeros(3)),))
    with pytest.raises(PolicyCrashed, match="line 2: AttributeError"):
        run_proven(adapt("return scene['cup'].names").tree, line.to_array(), scene)
