"""Wishes for parts of the path that meet at a waypoint: each holds in its own part."""

import numpy as np
import pytest

from ovita.instruct.notation import parse
from ovita.instruct.realise import realise
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.policy import run_proven
from ovita.policy.source import parse_tree
from ovita.toolkit import judge

T = np.linspace(0.0, 1.0, 61)
PATH = Trajectory(np.column_stack([2 * T - 1, 0.2 * np.sin(4 * T), 0.3 + 0.1 * np.sin(5 * T)]), 0.2 + 0.1 * T)
SCENE = Scene((SceneObject("cup", (-0.2, 0.3, 0.3), (0.1, 0.1, 0.1)), SceneObject("box", (0.5, 0.1, 0.2))))


def adapted(frames):
    builder = realise(parse(frames, SCENE.names), PATH, SCENE)
    assert not builder.question
    rows, recorder = run_proven(parse_tree(builder.source("")), PATH.to_array(), SCENE)
    outcomes = [judge(promise, PATH, Trajectory.from_array(rows), SCENE) for promise in recorder.expectations]
    return Trajectory.from_array(rows), [outcome.sentence for outcome in outcomes if not outcome.held]


@pytest.mark.parametrize(
    "frames",
    [
        "pace at_most=0.2m/s @before=cup; pace at_least=0.3m/s @after=cup",
        "pace slower @before=cup; pace set to=0.4m/s @between=cup+box; pace faster @after=box",
        "wait at=cup for=3s; nonstop @after=cup",
        "trim last=15wp; end goal to=box",
        "trim first=10wp; end start to=cup",
        "keep @before=cup; pace faster @after=cup",
        "height to=0.2m @before=cup; height to=0.6m @after=cup",
        "height to=0.6m @after=cup; height to=0.2m @before=cup",
        "height at_least=0.5m @between=cup+box; height at_most=0.2m @after=box",
        "height at_most=0.15m @near=cup; height at_least=0.6m @near=box",
        "height to=0.1m @near=cup; height to=0.5m @!near=cup",
        "move up=0.1m @before=cup; move down=0.1m @after=cup",
        "pace set to=0.1m/s @near=cup; pace set to=0.6m/s @after=cup",
        "keep @before=cup; side cup left",
        "keep @before=cup; wait at=cup for=2s",
        "pace to=20s @before=cup; return",
        "side cup left; hover box for=2s",
        "via cup; hover box for=2s; return",
        "hover cup for=2s; height at_most=0.42m",
        "hop cup; height at_most=0.42m",
    ],
)
def test_each_wish_holds_where_another_begins(frames):
    assert adapted(frames)[1] == []


def test_a_speed_until_a_place_and_another_one_from_there_share_no_waypoint():
    path, _ = adapted("pace at_most=0.2m/s @before=cup; pace at_least=0.3m/s @after=cup")
    at = int(np.linalg.norm(PATH.positions - np.array(SCENE["cup"].position), axis=1).argmin())
    assert path.speeds[:at].max() <= 0.2 + 1e-9 and path.speeds[at:].min() >= 0.3 - 1e-9


def test_what_is_near_two_things_belongs_to_the_nearer_one():
    path, _ = adapted("pace set to=0.1m/s @near=cup,0.6m; pace set to=0.6m/s @near=box,0.6m")
    cup, box = (SCENE[name].distance(PATH.positions) for name in ("cup", "box"))
    shared = (cup < 0.6) & (box < 0.6)
    assert shared.any() and path.speeds[shared] == pytest.approx(np.where(cup < box, 0.1, 0.6)[shared])


def test_a_height_reaches_into_no_other_wishs_part():
    path, _ = adapted("height to=0.2m @before=cup; height to=0.6m @after=cup")
    at = int(np.linalg.norm(PATH.positions - np.array(SCENE["cup"].position), axis=1).argmin())
    assert path.positions[:at, 2] == pytest.approx(0.2) and path.positions[at:, 2] == pytest.approx(0.6)


def test_a_stop_at_what_is_circled_comes_after_the_circle():
    path, broken = adapted("circle cup; stop at=cup")
    away = path.positions[:, :2] - np.array(SCENE["cup"].position[:2])
    angles = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    assert broken == [] and np.ptp(angles) > 2 * np.pi and path.speeds[-1] == 0.0


def test_the_goal_is_placed_on_what_is_left_of_a_path():
    path, _ = adapted("end goal to=box; trim last=15wp")
    assert len(path) == 46 and np.allclose(path.positions[-1], SCENE["box"].position, atol=1e-6)
