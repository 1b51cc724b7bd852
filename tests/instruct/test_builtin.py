"""The built-in writer: sentences to frames, frames to policies, and honesty about what it cannot place."""

import ast

import numpy as np
import pytest
from unusual_requests import UNUSUAL

from ovita.instruct.meaning import same
from ovita.instruct.notation import parse, show
from ovita.instruct.understanding import understand
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.reading import parse as parse_policy
from ovita.policy.sandbox import run
from ovita.request import Request
from ovita.toolkit import judge
from ovita.writers.base import ground
from ovita.writers.generate import BuiltinWriter

SCENE = Scene(
    (
        SceneObject("cup", [0.1, 0.2, 0.3]),
        SceneObject("Yellow Plate", [0.5, 0.2, 0.0], [0.2, 0.2, 0.02]),
        SceneObject("fan", [0.9, -0.1, 0.0]),
        SceneObject("red wine", [0.3, 0.9, 0.0]),
    )
)
ROWS = np.column_stack([np.linspace(0, 1, 40), np.linspace(0, 0.3, 40), np.linspace(0.2, 0.3, 40), np.full(40, 0.4)])


MOVES = [
    ("go left", "move left"),
    ("Please shift the path slightly to the right", "move right deg=slight"),
    ("fly much higher", "move up deg=large"),
    ("go lower", "move down"),
    ("move 30 cm forwards", "move front=30cm"),
    ("translate everything backward by two metres", "move back=2m"),
    ("go up by .25 and 0.5 m to the left", "move up=0.25m left=0.5m"),
    ("increase the altitude by 150 mm", "move up=150mm"),
    ("raise the arm by 0.1", "move up=0.1m"),
    ("shift the start 0.1 to the left", "end start left=0.1"),
    ("the goal position should be a bit lower", "end goal down deg=slight"),
    ("after reaching the goal go up by 0.3", "extend up=0.3m"),
]
OBJECTS = [
    ("go closer to the cup", "closer cup"),
    ("get much nearer to the yellow plate", "closer Yellow_Plate deg=large"),
    ("hold a smaller distance from the fan", "closer fan"),
    ("go 0.1 m closer to the cup", "closer cup by=0.1m"),
    ("stay a little further off from the fan", "farther fan deg=slight"),
    ("increase the distance to the cup", "farther cup"),
    ("avoid the red wine", "farther red_wine"),
    ("keep at least 0.3 away from the cup", "clearance cup at_least=0.3m"),
    ("maintain a minimum distance of 20 cm from the cup and the fan", "clearance cup+fan at_least=20cm"),
    ("pass through the cup", "via cup"),
    ("go over the plate", "via over=Yellow_Plate"),
    ("pass between the cup and the fan", "via between=cup+fan"),
    ("start at the fan", "end start to=fan"),
    ("end at the midpoint of the cup and the fan", "end goal to=cup+fan"),
    ("continue to the fan", "extend to=fan"),
    ("wait at the cup for 12 timesteps", "wait at=cup for=12timesteps"),
    ("pause near the cup for 3 seconds", "wait at=cup for=3seconds"),
    ("stop near the fan", "stop at=fan"),
]
SPEEDS = [
    ("slow down", "pace slower"),
    ("go faster near the fan", "pace faster @near=fan"),
    ("reduce the speed by 20 % within 0.3 m of the cup", "pace slower by=20% @near=cup,0.3m"),
    ("double the speed when passing the cup", "pace faster by=2x @near=cup"),
    ("halve the velocity in the first half", "pace set to=0.5x @first=50%"),
    ("go three times faster", "pace faster by=3x"),
    ("increase the speed by 0.1 m/s", "pace faster by=0.1m/s"),
    ("lower the speed at the end", "pace slower @last"),
    ("drive at a constant speed of 0.3", "pace constant to=0.3m/s"),
    ("keep a constant speed after the cup", "pace constant @after=cup"),
    ("set the speed to 0.2 for the last 10 waypoints", "pace set to=0.2m/s @last=10wp"),
    ("slow down when going up", "pace slower @rising"),
    ("accelerate gradually", "pace rampup"),
    ("decelerate to a stop", "pace rampdown"),
    ("go slower between the cup and the fan while passing", "pace slower @between=cup+fan"),
    ("slow down in the middle of the path", "pace slower @middle"),
    ("slow down in the first 0.5 m", "pace slower @first=0.5m"),
    ("slow down in the last 2 seconds", "pace slower @last=2s"),
    ("go faster between waypoint 10 and 30", "pace faster @range=10-30"),
    ("go slower from the cup onwards", "pace slower @after=cup"),
    ("slow down until the midpoint", "pace slower @first=50%"),
    ("don't exceed 0.3 m/s", "pace at_most=0.3m/s"),
    ("go no slower than 0.1 m/s", "pace at_least=0.1m/s"),
    ("take twice as long", "pace set to=0.5x"),
    ("go 0.1 m/s slower", "pace slower by=0.1m/s"),
    ("don't change the speed along the way", "keep speed"),
]
SHAPES = [
    ("make a small spiral of 2 turns at the end", "spiral at=goal turns=2 deg=slight"),
    ("draw a spiral with a radius of 0.1 near the cup", "spiral at=cup radius=0.1m"),
    ("orbit the fan twice with a radius of 0.3", "circle fan radius=0.3m turns=2"),
    ("circle once around the cup", "circle cup turns=1"),
    ("do a loop at the cup", "circle cup"),
    ("fly a figure eight at the goal", "eight at=goal"),
    ("follow the path in a zig-zag with an amplitude of 0.05", "zigzag size=0.05m"),
    ("move in a sinusoidal pattern in the last half", "wave @last=50%"),
    ("hop over the cup", "hop cup"),
    ("hover 0.2 above the plate for 2 seconds", "hover Yellow_Plate by=0.2m for=2seconds"),
    ("rotate the path clockwise by 45 degrees", "rotate 45degrees cw"),
    ("scale the path by 1.5", "resize by=1.5x"),
    ("make the path much more curved", "curve more deg=large"),
    ("go straight from the cup to the fan", "straighten @between=cup+fan"),
    ("replace each group of 4 waypoints by its mean", "waypoints merge=4"),
    ("never go higher than 0.3", "height at_most=0.3"),
    ("always stay left of the fan", "side fan left along"),
    ("stay in the second quadrant", "quadrant 2"),
]
CHANGES = [
    ("slow down to 30 % near the cup", "pace slower to=30% @near=cup"),
    ("reduce the speed by 30 %", "pace slower by=30%"),
    ("raise the speed to 150 %", "pace faster to=150%"),
    ("increase the speed by half", "pace faster by=50%"),
    ("move at 50 % speed", "pace slower by=50%"),
    ("enlarge the path by 20 %", "resize larger by=20%"),
    ("scale the path down by 10 %", "resize smaller by=10%"),
]
LAWS = [
    ("slow down before the turns", "pace turns"),
]
CLAUSES = [
    ("go left by 0.2 and slow down near the cup", "move left=0.2m; pace slower @near=cup"),
    ("go up, then closer to the fan but slower near the plate", "move up; closer fan; pace slower @near=Yellow_Plate"),
    ("Go left by 0.1. Wait at the fan for 5 steps.", "move left=0.1m; wait at=fan for=5steps"),
    ("go faster near the cup and slower near the fan", "pace faster @near=cup; pace slower @near=fan"),
    ("when passing the cup, slow down", "pace slower @near=cup"),
    ("double the number of waypoints and smooth the path", "waypoints by=2x; smooth"),
    (
        "go left by 0.2 for the first half and right by 0.2 for the second half",
        "move left=0.2m @first=50%; move right=0.2m @last=50%",
    ),
    ("finish 5 cm above the plate", "end goal up=5cm to=Yellow_Plate"),
    ("hop the plate and from there on go faster", "hop Yellow_Plate; pace faster @after=Yellow_Plate"),
    ("circle the cup twice and after that slow down", "circle cup turns=2; pace slower @after=cup"),
    ("set the pace to 0.1 m/s between the cup and the fan", "pace set to=0.1m/s @between=cup+fan"),
    ("keep 0.2 m distance from the cup while moving at 0.5 m/s", "clearance cup at_least=0.2m; pace set to=0.5m/s"),
    ("first go left, second go up, finally slow down", "move left up; pace slower"),
    ("keep the goal fixed and go left", "keep goal; move left"),
    ("go left without changing the speed", "move left; keep speed"),
    ("raise the start by 4 cm and shift it 2 cm left", "end start up=4cm left=2cm"),
    ("follow the same path but faster", "pace faster"),
    ("wait at the cup for 5 steps and then carry on", "wait at=cup for=5steps"),
]


COUNTS = [
    ("rest for 2 s at the seventeenth waypoint", "wait at=17wp for=2s"),
    ("pause at point thirteen for one second", "wait at=13wp for=1s"),
    ("slow down to point thirteen metres per second", "pace slower to=0.13m/s"),
    ("raise the fourth waypoint by 3 cm", "move up=3cm @range=4-4"),
    ("merge the waypoints in threes", "waypoints merge=3"),
    ("one could go slower near the cup", "pace slower @near=cup"),
    ("a figure of eight at the fan", "eight at=fan"),
    ("go left by a good metre", "move left=1m"),
    ("stay a metre and a half away from the cup", "clearance cup at_least=1.5m"),
    ("never go above a metre twenty", "height at_most=1.2m"),
    ("end point two inches lower", "end goal down=2in"),
    ("closer to the cup by 2 1/2 inches", "closer cup by=6.35cm"),
    ("v *= 0.5 near the cup", "pace set to=0.5x @near=cup"),
    ("first 2 s: v*0.5", "pace set to=0.5x @first=2s"),
    ("come to a halt one foot shy of the fan", "stop at=fan by=1ft"),
    ("stop 15 cm before the cup", "stop at=cup by=15cm"),
    ("a spiral of max radius 10 cm at the fan", "spiral at=fan radius=10cm"),
]
DENIED = [
    ("you shall not pass within 12 cm of the cup", "clearance cup at_least=12cm"),
    ("it must not pass below 25 cm", "height at_least=25cm"),
    ("pass under the cup and not over the cup", "via under=cup"),
    ("I would be happy if it went slower near the fan", "pace slower @near=fan"),
]


@pytest.mark.parametrize(("sentence", "frames"), [*COUNTS, *DENIED])
def test_counts_and_denials_are_read(sentence, frames):
    verdict = understand(sentence, SCENE, Trajectory.from_array(ROWS))
    assert same(verdict.reading.frames, parse(frames, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


def test_a_condition_is_never_done_always():
    assert understand("if the cup is hot, go left", SCENE, Trajectory.from_array(ROWS)).outcome != "do"


@pytest.mark.parametrize(("sentence", "frames"), [*MOVES, *OBJECTS, *SPEEDS, *SHAPES, *CHANGES, *LAWS, *CLAUSES])
def test_what_a_sentence_asks_for_is_read(sentence, frames):
    verdict = understand(sentence, SCENE, Trajectory.from_array(ROWS))
    assert same(verdict.reading.frames, parse(frames, SCENE.names)), show(verdict.reading.frames)
    assert verdict.outcome in ("do", "needs_confirmation")


@pytest.mark.parametrize("sentence", [row[0] for row in [*MOVES, *OBJECTS, *SPEEDS, *SHAPES, *LAWS]])
def test_every_policy_runs_and_keeps_its_promises(sentence):
    rollout = run(parse_policy(reply(sentence).code), Trajectory.from_array(ROWS), SCENE)
    for expectation in rollout.expectations:
        outcome = judge(expectation, ROWS, rollout.trajectory.to_array(), SCENE)
        assert outcome.held, outcome.sentence


def test_a_distance_stated_once_holds_for_every_near():
    found = understand("go faster near the cup and slower near the fan. The threshold is 0.25", SCENE).reading
    assert [frame.part.amount for frame in found.frames] == [0.25, 0.25] and found.unread == ()


def test_there_is_near_what_was_named_last():
    found = understand("stay further from the fan and go slower there", SCENE).reading
    assert same(found.frames, parse("farther fan; pace slower @near=fan", SCENE.names))


def test_all_objects_can_be_meant_at_once():
    assert understand("stay away from all the obstacles", SCENE).reading.frames[0].named == SCENE.names
    assert understand("slow down near every object", SCENE).reading.frames[0].named == SCENE.names
    assert understand("go to the round object", SCENE).outcome != "do"


def test_misspelt_words_are_read_and_said():
    found = understand("go slighlty upwrads and acelerate near the cup", SCENE).reading
    assert same(found.frames, parse("move up deg=slight; pace faster @near=cup", SCENE.names))
    assert found.unread == () and len(found.notes) == 3


@pytest.mark.parametrize("sentence", UNUSUAL)
def test_what_is_not_read_in_full_is_not_done(sentence):
    answer = reply(sentence)
    assert answer.kind != "policy" or answer.confirm


def reply(sentence, scene=SCENE, rows=ROWS):
    return BuiltinWriter().write(ground(Request(sentence, Trajectory.from_array(rows), scene)))


def test_policy_has_plan_knobs_and_expectations():
    answer = reply("Go left by 0.2 and slow down near the cup")
    assert answer.kind == "policy" and len(answer.plan) == 2
    assert "left=0.2,  # [m]" in answer.code and "expect_moved(left=left)" in answer.code
    assert any("near cup" in a for a in answer.assumptions)
    compile(answer.code, "policy", "exec")


def test_not_understood_names_the_words_and_keeps_what_was_placed():
    answer = reply("go left and moonwalk near the cup")
    assert answer.confirm and answer.plan  # shown before anything is done
    answer = reply("moonwalk")
    assert answer.kind == "not_understood" and answer.unplaced == ("moonwalk",) and not answer.code


def test_a_word_for_two_objects_gives_a_question():
    scene = Scene((SceneObject("red cup", [0, 0, 0]), SceneObject("blue cup", [1, 0, 0])))
    answer = reply("go closer to the cup", scene)
    assert answer.kind == "question"
    assert "red cup" in answer.question and "blue cup" in answer.question


def test_objects_whose_names_are_words_of_the_lexicon_or_of_python():
    scene = Scene(tuple(SceneObject(n, [i, 0, 0]) for i, n in enumerate(["wall lamp", "lambda", "move", "3d printer"])))
    for name in scene.names:
        answer = reply(f"slow down near the {name}", scene)
        assert answer.kind == "policy", answer.unplaced
        compile(answer.code, "policy", "exec")
        assert f"scene[{name!r}]" in answer.code


def test_hostile_names_stay_data():
    hostile = 'cup"""); import os; ("""'
    scene = Scene((SceneObject(hostile, [0.5, 0, 0]), SceneObject("it's\\", [1, 0, 0]), SceneObject("a\nb", [0, 1, 0])))
    answers = [reply(f"go closer to {item.name}", scene) for item in scene]
    assert any(answer.kind == "policy" for answer in answers)
    for answer in answers:
        if answer.kind == "policy":
            body = ast.parse(answer.code).body
            assert len(body) == 1 and isinstance(body[0], ast.FunctionDef)
            assert not any(isinstance(node, ast.Import) for node in ast.walk(body[0]))


def test_a_failed_policy_is_not_offered_again():
    prompt = ground(Request("go left", Trajectory.from_array(ROWS), SCENE)).repaired("code", "it crashed")
    assert BuiltinWriter().write(prompt).kind == "not_understood"


def test_path_steps_come_before_speed_and_before_what_changes_the_count():
    code = reply("wait at the cup for 5 steps, slow down near the fan and smooth the path, then go left by 0.1").code
    order = [code.index(word) for word in ("= smooth(", "= move(", "= scale_speed(", "= dwell(")]
    assert order == sorted(order)


def test_near_is_never_empty_and_never_everything():
    from ovita.instruct.degrees import Scale

    trajectory = Trajectory.from_array(ROWS)
    scale = Scale.of(trajectory)
    for item in SCENE:
        within = item.distance(trajectory.positions) <= scale.near(trajectory.positions, item)
        assert 0 < within.sum() < len(trajectory)
