"""Frames become policies that do what the frames say, whatever the words were."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

from ovita.instruct.frames import Quantity, Trim
from ovita.instruct.notation import parse
from ovita.instruct.realise import realise
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.policy import proven, run_proven
from ovita.policy.source import parse_tree
from ovita.toolkit.judging import judge
from ovita.toolkit.speed import travel_time

T = np.linspace(0.0, 1.0, 61)
PATH = Trajectory(
    np.column_stack([2.0 * T - 1.0, 0.25 * np.sin(3.0 * T), 0.5 + 0.1 * np.sin(5.0 * T)]), 0.2 + 0.2 * np.sin(np.pi * T)
)
BOX = np.array([0.1, 0.1, 0.1])
SCENE = Scene(
    (
        SceneObject("cup", [-0.3, 0.35, 0.5], BOX),
        SceneObject("box", [0.4, -0.1, 0.4], BOX),
        SceneObject("post", [0, 1, 0]),
    )
)


def done(text, scene=SCENE, path=PATH):
    """The builder, the rows that its policy makes, and its broken promises."""
    d = realise(parse(text, scene.names), path, scene)
    assert not d.question, d.question
    tree = parse_tree(d.source(" ".join(d.plan)))
    assert proven(tree)
    rows, recorder = run_proven(tree, path.to_array(), scene)
    outcomes = [judge(e, path.to_array(), rows, scene) for e in recorder.expectations]
    return d, rows, [o.sentence for o in outcomes if not o.held]


def heights_over(rows, item, aside):
    away = rows[:, :3] - item.position
    return away[np.linalg.norm(away[:, :2], axis=1) <= aside, 2]


def test_over_an_object_is_above_its_column():
    for text, low in [("via over=box by=15cm", 0.2), ("via over=box", 0.05), ("hop box by=10cm", 0.15)]:
        _, rows, broken = done(text)
        assert heights_over(rows, SCENE["box"], 0.03).min() >= low - 0.01 and not broken, text
    _, rows, broken = done("via under=box by=5cm")
    assert heights_over(rows, SCENE["box"], 0.03).max() <= -0.1 + 0.01 and not broken


def test_a_part_may_begin_at_a_midpoint():
    _, rows, broken = done("pace slower @after=cup+box")
    slower = rows[:, 3] < PATH.speeds - 1e-9
    assert slower[-5:].all() and not slower[:20].any() and not broken


def test_a_path_that_passes_over_already_is_not_lowered():
    scene = Scene((SceneObject("mat", [0.0, 0.25, 0.1], BOX),))
    _, rows, broken = done("via over=mat", scene)
    assert np.abs(rows[:, :3] - PATH.positions).max() < 0.03 and not broken


def test_reverse_runs_backwards():
    _, rows, broken = done("reverse")
    assert np.allclose(rows[:, :3], PATH.positions[::-1]) and not broken


@pytest.mark.parametrize("side", ["left", "right", "front", "back", "up"])
def test_an_end_beside_an_object_is_outside_of_it(side):
    _, rows, broken = done(f"end goal to=cup {side}")
    assert SCENE["cup"].clearance(rows[-1:, :3])[0] > 0.01 and not broken
    assert (rows[-1, :3] - SCENE["cup"].position) @ SCENE.frame.direction(side) > 0.05


def test_closer_never_goes_through_the_surface():
    d, rows, broken = done("closer cup by=2m")
    assert SCENE["cup"].clearance(rows[:, :3]).min() > 0 and not broken
    assert any("surface" in a for a in d.assumptions)


def test_within_a_distance_moves_the_closest_stretch_only():
    _, rows, broken = done("clearance cup at_most=5cm")
    assert abs(SCENE["cup"].cuboid.closest(rows[:, :3])[0] - 0.05) < 0.005 and not broken
    assert np.allclose(rows[[0, -1]], PATH.to_array()[[0, -1]])
    d, rows, _ = done("clearance cup at_most=1m")
    assert d.held and np.array_equal(rows, PATH.to_array())


@pytest.mark.parametrize(
    ("text", "left"),
    [("trim last=10wp", 51), ("trim first=25%", 46), ("trim last=0.5m", None), ("trim after=box", None)],
)
def test_what_is_cut_off(text, left):
    _, rows, broken = done(text)
    assert not broken and len(rows) < len(PATH) and (left is None or len(rows) == left)
    if "0.5m" in text:
        cut = PATH.length - Trajectory.from_array(rows).length
        assert abs(cut - 0.5) < 2 * PATH.length / len(PATH)


def test_axes_are_those_of_the_frame():
    _, rows, broken = done("move y=10cm -x=5cm @range=10-40")
    assert np.allclose((rows - PATH.to_array())[25, :3], [-0.05, 0.1, 0.0]) and not broken


@pytest.mark.parametrize(
    "text",
    [
        "move left=10cm; move right=5cm",
        "height at_least=50cm; height at_most=30cm",
        "clearance cup at_least=30cm; clearance cup at_most=10cm",
        "keep start; end start up=10cm",
        "keep speed; pace slower",
        "pace at_most=0.1m/s; pace at_least=0.3m/s",
        "pace slower by=100%",
        "pace faster to=80%",
        "move up @selection",
        "move up @range=90-95",
        "closer cup by=2steps",
        "circle",
        "waypoints fewer by=70wp",
    ],
)
def test_contradictions_and_gaps_become_questions(text):
    assert realise(parse(text, SCENE.names), PATH, SCENE).question


def test_what_is_to_stay_stays():
    rows = done("keep @first=10wp; move up=10cm; pace slower")[1]
    assert np.allclose(rows[:10], PATH.to_array()[:10]) and rows[30, 2] > PATH.positions[30, 2] + 0.09
    rows = done("smooth; keep @last=20wp")[1]
    assert np.allclose(rows[-20:], PATH.to_array()[-20:])
    rows = done("keep ends; move left=20cm")[1]
    assert np.allclose(rows[[0, -1]], PATH.to_array()[[0, -1]])


@pytest.mark.parametrize(
    "text",
    [
        "side cup right; side box left",
        "side box left; clearance box at_least=15cm",
        "side cup right; closer box",
        "stop at=box; pace slower @last",
        "stop at=box by=10cm; pace slower @last",
        "pace at_most=0.25m/s @before=box; pace faster by=40% @after=box",
        "spiral at=goal turns=2 rise=30cm; keep @first",
        "trim last=5wp; pace slower @last",
    ],
)
def test_wishes_that_touch_each_other_all_keep_their_promise(text):
    assert not done(text)[2]


def test_slower_at_the_end_is_about_the_path_that_is_left():
    stopped, slower = (done(text)[1] for text in ("stop at=box", "stop at=box; pace slower @last"))
    assert len(stopped) == len(slower) < len(PATH)
    assert slower[-4, 3] < 0.6 * stopped[-4, 3]
    assert np.allclose(slower[: len(slower) // 2], stopped[: len(slower) // 2])


def test_a_cut_before_or_after_so_much_is_asked_about():
    frame = Trim(cut="after", amount=Quantity(5.0, "waypoints"))
    assert "How much should be cut off at the end?" in realise((frame,), PATH, SCENE).question


def test_parameters_know_their_slot():
    d, _, _ = done("closer cup by=5cm; pace slower by=30% @near=box; move y=10cm")
    slots = {p.slot: (p.value, p.role) for p in d.parameters.values()}
    assert slots["0.by"] == (0.05, "by") and slots["1.amount"] == (0.7, "factor") and slots["2.y"] == (0.1, "by")
    assert slots["1.part"][1] == "radius"


CORPUS = Path(__file__).parents[2] / "training" / "corpus"


@pytest.fixture(scope="module")
def realised():
    sys.path.insert(0, str(CORPUS))
    spec = importlib.util.spec_from_file_location("corpus_realised", CORPUS / "realised.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["corpus_realised"] = module
    spec.loader.exec_module(module)
    yield module
    sys.path.remove(str(CORPUS))


def test_lines_of_the_corpus_are_carried_out(realised):
    """An eightieth of them, over all voices; `training/corpus/realised.py` does all."""
    lines = list(realised.sentences())[::80]
    failed = [line for line in lines if realised.tried(line.frames, line.objects).outcome == "failed"]
    assert len(lines) > 80 and len(failed) <= 0.055 * len(lines), [f"{f.voice}:{f.number}" for f in failed]


def test_a_flipped_frame_is_told_from_the_right_one(realised):
    told = seen = 0
    for line in list(realised.sentences())[20::80]:
        other = realised.flipped(line.frames, line.objects)
        if other is None:
            continue
        trajectory, scene = realised.setting(line.frames, line.objects)
        _, adapted = realised.carried_out(other, trajectory, scene)
        if adapted is not None:
            seen += 1
            told += not realised.expected(line.frames, trajectory, scene).judge(trajectory, adapted, scene).passed
    assert seen > 60 and told >= 0.95 * seen, (told, seen)


def test_what_is_left_of_a_path_that_is_cut_is_what_is_straightened():
    _, rows, broken = done("trim last=10wp; straighten")
    assert not broken
    assert rows[-1, :3] == pytest.approx(PATH.positions[-11])


@pytest.mark.parametrize(
    ("text", "lasts"),
    [
        ("pace to=20s", 20.0),
        ("pace faster by=2s", 5.0),
        ("pace slower by=3s", 10.0),
        ("pace at_most=4s", 4.0),
        ("pace at_most=30s", 7.0),
        ("move up=10cm; pace to=5s; pace slower @near=cup; wait at=box for=2s", 5.0),
    ],
)
def test_the_way_takes_so_long(text, lasts):
    path = Trajectory(PATH.positions, PATH.speeds * PATH.duration / 7.0)
    _, rows, broken = done(text, path=path)
    assert not broken
    assert travel_time(rows, np.ones(len(rows), dtype=bool)) == pytest.approx(lasts, rel=1e-3)


def test_a_part_takes_so_long():
    _, rows, broken = done("pace to=5s @last=50%")
    assert not broken and (rows[:30, 3] == PATH.speeds[:30]).all()
    assert travel_time(rows, np.arange(len(rows)) >= 31) == pytest.approx(5.0, rel=0.05)


def test_a_time_that_is_none_is_asked_about():
    assert "how long" in realise(parse("pace faster by=60s"), PATH, SCENE).question


@pytest.mark.parametrize(
    "text",
    [
        "move up=10cm; via over=box",
        "move right=5cm @last; mirror left",
        "extend up=10cm; rotate 30deg",
        "extend by=20cm; resize by=0.8x",
        "move up=5cm @near=box; straighten",
        "circle cup; end goal to=box",
    ],
)
def test_a_change_that_later_steps_change_again_is_told_and_not_broken(text):
    d, _, broken = done(text)
    assert not broken
    assert text.startswith("extend by") or any("by its own step" in said for said in d.assumptions)


@pytest.mark.parametrize(
    "text", ["end goal to=box; clearance box at_least=20cm", "hop box by=40cm; height at_most=55cm"]
)
def test_what_cannot_hold_beside_another_stays_a_broken_promise(text):
    assert done(text)[2]


def test_so_much_quicker_counts_from_the_path_before_all_other_steps():
    _, rows, broken = done("pace faster by=1s; move up=30cm @near=box")
    assert not broken
    assert Trajectory.from_array(rows).duration == pytest.approx(PATH.duration - 1.0, rel=0.01)


@pytest.mark.parametrize("text", ["end start to=post; via box", "end goal to=post; side box left"])
def test_what_is_passed_on_the_way_is_passed_though_an_end_moves(text):
    _, rows, broken = done(text)
    assert not broken
    assert min(np.linalg.norm(rows[[0, -1], :3] - SCENE["post"].position, axis=1)) < 1e-6


def test_between_two_things_goes_at_the_height_that_is_told():
    low, high = (done(f"via between=box+cup; height to={height}")[1] for height in ("30cm", "60cm"))
    middle = (SCENE["box"].position + SCENE["cup"].position)[:2] / 2
    for rows, height in ((low, 0.3), (high, 0.6)):
        assert rows[:, 2] == pytest.approx(height, abs=0.01)
        assert np.linalg.norm(rows[:, :2] - middle, axis=1).min() < 0.06


def test_over_a_thing_keeps_the_distance_that_is_asked_for():
    _, rows, broken = done("via over=box; clearance box at_least=25cm")
    assert not broken
    assert SCENE["box"].clearance(rows[:, :3]).min() >= 0.24


def test_a_stop_at_the_end_of_a_path_that_is_cut_is_at_its_new_end():
    _, rows, broken = done("trim last=3wp; stop at=goal")
    assert not broken and rows[-1, 3] == 0.0 and len(rows) == len(PATH) - 3


def test_braking_takes_a_part_of_the_way_to_an_early_stop():
    early = Scene((SceneObject("bin", PATH.positions[12] + [0.0, 0.2, 0.0], BOX),))
    _, rows, broken = done("pace set to=0.5m/s; stop at=bin", early)
    assert not broken and rows[-1, 3] == 0.0 and (rows[:, 3] == 0.5).mean() > 0.6
