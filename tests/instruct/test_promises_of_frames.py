"""What a policy written from a frame promises is broken by a path that stayed as it was, or went the other way."""

import numpy as np
import pytest

from ovita import Request, Robot, Scene, SceneObject, Trajectory, adapt
from ovita.instruct.notation import parse
from ovita.paths.scene import Frame
from ovita.toolkit.catalogue import Expectation
from ovita.toolkit.judging import judge
from ovita.writers.generate import FramesWriter

N = 60
T = np.linspace(0, 1, N)
PATH = Trajectory.from_array(np.column_stack([0.2 * np.sin(6 * T), 2 * T, np.full(N, 0.5), np.full(N, 0.4)]))
SCENE = Scene(
    (
        SceneObject("mug", [0.1, 1.0, 0.2], [0.08, 0.08, 0.1]),
        SceneObject("laptop", [0.05, 0.5, 0.2], [0.3, 0.25, 0.02]),
        SceneObject("cup", [0.5, 1.0, 0.5]),
        SceneObject("vase", [0.4, 1.7, 0.5], [0.1, 0.1, 0.3]),
    )
)
FRAMES = """move left=0.1 | move up=0.1 @near=mug | closer laptop by=0.05 | closer cup | farther laptop | via mug
clearance mug at_least=0.4m | clearance cup at_most=0.2m | clearance vase at=0.1m | via over=mug by=0.1 | via under=mug
via between=cup+mug | avoid over=laptop | avoid between=mug+laptop | side laptop other | side mug other
hop mug | hop laptop | hop over=laptop by=0.4m | hover mug | hover laptop for=2s | side mug left
side mug right | side cup right | pace faster | pace slower @near=mug | pace set to=0.2m/s | pace at_most=0.3m/s
pace rampdown | pace rampup | end goal up=0.1 | end goal to=cup | end start toward=cup by=0.1 | stop at=mug
wait at=mug for=2s | extend by=0.3 | extend to=vase | circle mug | circle cup radius=0.2m turns=2 | spiral at=mug
eight at=mug | zigzag | wave | shake at=mug | mirror left | rotate 30 | tilt front 10 | resize larger | resize by=0.5x
curve more | curve less | straighten | height to=0.8 | height at_least=0.6m | height at_most=0.4m | bound left=0.02m
smooth | waypoints to=30 | waypoints merge=3 | pace accelerate by=0.05m/s2
pace accelerate by=-0.02m/s2 @last=50% | reverse | return | trim last=20% | trim after=mug | quadrant 1"""


def realised(frame, path=PATH, **request):
    frames = parse(frame, [item.name for item in SCENE])
    return adapt(Request(frame, path, SCENE, **request), writer=FramesWriter(tuple(frames)))


def holds(result, rows):
    """Whether all that the policy promised holds for an array of waypoints."""
    stated = [Expectation(p.kind, dict(p.arguments), p.text) for p in result.postconditions]
    return all(judge(one, PATH.to_array(), rows, SCENE).held for one in stated)


@pytest.mark.parametrize("frame", [frame.strip() for line in FRAMES.splitlines() for frame in line.split("|")])
def test_a_promise_is_kept_by_the_result_and_broken_by_a_wrong_one(frame):
    result = realised(frame)
    assert result.status == "done", result.warnings
    old, new = PATH.to_array(), result.adapted.to_array()
    assert holds(result, new) and not holds(result, old)
    if len(old) == len(new) and frame.split()[0] not in ("zigzag", "wave", "shake"):
        assert not holds(result, np.maximum(2 * old - new, [-np.inf, -np.inf, -np.inf, 0]))


@pytest.mark.parametrize("jitter", [0.0, 0.006])
def test_a_part_that_is_smoothed_is_smoother_and_promises_so(jitter):
    """Smoothing the middle of a smooth path blended it worse than it was, and said done."""
    rows = PATH.to_array()
    rows[1:-1, :3] += np.random.default_rng(3).normal(0.0, jitter, (N - 2, 3))
    result = realised("smooth @middle", Trajectory.from_array(rows))
    assert result.status == "done", result.warnings
    promise = next(p for p in result.postconditions if p.kind == "smoother")
    stated = Expectation(promise.kind, dict(promise.arguments), promise.text)
    assert not judge(stated, rows, rows, SCENE).held


def test_a_jump_over_what_the_path_passes_over_already_is_seen():
    """ "Hop over the cup" did nothing where the path was above the usual height of a jump."""
    result = realised("hop laptop")
    nearest = int(np.linalg.norm(PATH.positions - SCENE["laptop"].position, axis=1).argmin())
    assert result.adapted.positions[nearest, 2] > PATH.positions[nearest, 2] + 0.05


def test_a_wait_is_where_the_path_was_nearest_though_it_comes_back_and_passes_nearer():
    """A wait at the cup was not as meant because the way back to the start led past the cup."""
    x = np.linspace(0, 2, N)
    bow = Trajectory.from_array(np.column_stack([0.5 * np.sin(np.pi * x / 2), x, np.full(N, 0.5), np.full(N, 0.4)]))
    cup = Scene((SceneObject("cup", [0.1, 1.0, 0.5]),))
    frames = parse("wait at=cup for=3s; return", ["cup"])
    result = adapt(Request("wait, return", bow, cup), writer=FramesWriter(tuple(frames)))
    assert result.status == "done", result.warnings


@pytest.mark.parametrize(("frame", "robot"), [("side dog right", "ground"), ("via over=dog", "ground")])
def test_what_the_limits_take_to_the_other_side_is_not_as_meant(frame, robot):
    """A rover that was to pass right of a dog passed left of it, or beside it instead of over it: "limited"."""
    x = np.linspace(-2, 2, 40)
    rows = np.column_stack([x, 0.3 * np.sin(np.pi * (x + 2) / 4), 0 * x, np.full(40, 0.5)])
    blocked = (SceneObject("dog", [0, -0.5, 0.2], [0.6, 0.3, 0.4]), SceneObject("wall", [0, -1.9, 0.2], [9, 2, 0.4]))
    task = Scene(blocked, Frame("flu"))
    frames = parse(frame, ["dog", "wall"])
    request = Request(frame, Trajectory.from_array(rows), task, Robot.preset(robot))
    result = adapt(request, writer=FramesWriter(tuple(frames)))
    assert result.status in ("not_as_meant", "infeasible"), result.postconditions
