"""What frames must bring about: right outcomes pass, those of other frames and the unchanged path do not."""

import numpy as np
import pytest

from ovita.bench.expected import expected
from ovita.instruct.notation import parse
from ovita.instruct.realise import realise
from ovita.measure.predicates import asked, kinds
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.policy import run_proven
from ovita.policy.source import parse_tree

T = np.linspace(0.0, 1.0, 61)
PATH = Trajectory(
    np.column_stack([2.0 * T - 1.0, 0.25 * np.sin(3.0 * T), 0.5 + 0.1 * np.sin(5.0 * T)]), 0.2 + 0.2 * np.sin(np.pi * T)
)
BOX = np.array([0.1, 0.1, 0.1])
SCENE = Scene((SceneObject("cup", [-0.3, 0.45, 0.5], BOX), SceneObject("box", [0.4, -0.1, 0.4], BOX)))

PAIRS = [
    ("clearance cup at_most=5cm", "clearance cup at_least=15cm"),
    ("clearance box at_least=30cm", "closer box"),
    ("via over=box by=15cm", "via under=box"),
    ("side cup front", "side cup back"),
    ("side cup other", "side cup back"),
    ("avoid between=cup+box", "via between=cup+box"),
    ("end goal to=cup left", "end goal to=cup right"),
    ("end goal toward=cup by=10cm", "end goal away=cup by=10cm"),
    ("height at_most=45cm", "height to=60cm"),
    ("level", "move up=5cm"),
    ("keep height; move left=10cm", "move left=10cm up=10cm"),
    ("pace at_most=0.25m/s", "pace set to=0.3m/s"),
    ("pace set to=0.3m/s; wait at=cup for=1s", "pace set to=0.35m/s; wait at=cup for=1s"),
    ("pace faster by=0.1m/s", "pace slower by=0.1m/s"),
    ("pace to=20s; wait at=cup for=1s", "pace to=16s; wait at=cup for=1s"),
    ("pace faster by=2s", "pace slower by=2s"),
    ("pace at_most=4s", "pace to=5s"),
    ("pace accelerate by=0.02m/s2", "pace accelerate by=-0.02m/s2"),
    ("resize by=1.5x", "resize by=0.7x"),
    ("trim last=10wp", "trim first=10wp"),
    ("waypoints to=50", "waypoints to=40"),
    ("circle cup turns=2", "circle box turns=2"),
    ("circle cup cw radius=25cm", "circle cup ccw radius=25cm"),
    ("eight at=middle size=20cm", "circle cup"),
    ("curve more", "curve less"),
    ("zigzag size=5cm", "wave size=15cm waves=1"),
    ("spiral @last=50% turns=3", "zigzag @last=50%"),
    ("shake at=cup", "shake at=goal"),
    ("wait at=cup for=2s", "wait at=box for=2s"),
    ("arrive up by=20cm", "extend down=20cm"),
    ("wait at=cup by=30cm for=2s", "wait at=cup for=2s"),
    ("stop at=cup", "stop at=box"),
    ("tilt left 20deg", "tilt right 20deg"),
    ("mirror left; move up=10cm", "mirror front; move up=10cm"),
    ("closer cup by=10cm @middle", "farther cup by=10cm @middle"),
]


def outcome(text):
    frames = parse(text, SCENE.names)
    d = realise(frames, PATH, SCENE)
    assert not d.question, d.question
    return frames, Trajectory.from_array(run_proven(parse_tree(d.source("")), PATH.to_array(), SCENE)[0])


@pytest.mark.parametrize(("right", "wrong"), PAIRS)
def test_right_outcomes_pass_and_others_do_not(right, wrong):
    frames, adapted = outcome(right)
    check = expected(frames, PATH, SCENE)
    assert check.judge(PATH, adapted, SCENE).passed, check.judge(PATH, adapted, SCENE).sentence
    assert not check.judge(PATH, outcome(wrong)[1], SCENE).passed
    assert not check.judge(PATH, PATH, SCENE).passed


@pytest.mark.parametrize("way", ["over", "under"])
def test_what_passes_over_or_under_is_seen_and_led_around(way):
    """`PATH` is beside the box; led over it, it is to be led around it again."""
    _, past = outcome(f"via {way}=box by=15cm")
    frames = parse(f"avoid {way}=box", SCENE.names)
    check = expected(frames, past, SCENE)
    assert not check.judge(past, past, SCENE).passed
    d = realise(frames, past, SCENE)
    around = Trajectory.from_array(run_proven(parse_tree(d.source("")), past.to_array(), SCENE)[0])
    assert check.judge(past, around, SCENE).passed
    assert np.allclose(around.positions[[0, -1]], past.positions[[0, -1]])
    assert np.allclose(around.positions[:, 2], past.positions[:, 2])


def test_every_kind_is_in_the_table():
    def used(check):
        return {check.kind}.union(*map(used, check.children))

    found = {"not_beyond"}.union(*(used(expected(parse(right, SCENE.names), PATH, SCENE)) for right, _ in PAIRS))
    missing = {kind for kind in kinds() if kind in vars(asked) and asked.__dict__[kind].__module__ == asked.__name__}
    assert missing <= found, missing - found
