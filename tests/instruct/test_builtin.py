"""The built-in writer: sentences to intents, intents to policies, and honesty about what it cannot place."""

import ast

import numpy as np
import pytest

from ovita.instruct.reading import read_instruction
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy.reading import parse as parse_policy
from ovita.policy.sandbox import run
from ovita.request import Request
from ovita.toolkit import judge
from ovita.writers.builtin import BuiltinWriter
from ovita.writers.prompt import ground

SCENE = Scene(
    (
        SceneObject("cup", [0.1, 0.2, 0.3]),
        SceneObject("Yellow Plate", [0.5, 0.2, 0.0], [0.2, 0.2, 0.02]),
        SceneObject("fan", [0.9, -0.1, 0.0]),
        SceneObject("red wine", [0.3, 0.9, 0.0]),
    )
)
ROWS = np.column_stack([np.linspace(0, 1, 40), np.linspace(0, 0.3, 40), np.linspace(0.2, 0.3, 40), np.full(40, 0.4)])


def intents(sentence):
    understood = read_instruction(sentence, SCENE)
    assert understood.unplaced == (), f"{sentence}: {understood.unplaced}"
    return understood.intents


def short(sentence):
    """Intents as tuples: action, directions, objects, amount with unit and mode, degree, region."""
    found = []
    for i in intents(sentence):
        r = i.region
        region = () if r.kind == "whole" else (r.kind, *(o.name for o in r.items), r.amount)
        found.append((i.action, dict(i.directions), [o.name for o in i.items], i.amount, i.mode, i.degree, region))
    return found


MOVES = [
    ("go left", "move", {"left": None}, "moderate"),
    ("Please shift the path slightly to the right", "move", {"right": None}, "slight"),
    ("fly much higher", "move", {"up": None}, "large"),
    ("go lower", "move", {"down": None}, "moderate"),
    ("move 30 cm forwards", "move", {"front": 0.3}, "moderate"),
    ("translate everything backward by two metres", "move", {"back": 2.0}, "moderate"),
    ("go up by .25 and 0.5 m to the left", "move", {"up": 0.25}, "moderate"),
    ("increase the altitude by 150 mm", "move", {"up": 0.15}, "moderate"),
    ("raise the arm by 0.1", "move", {"up": 0.1}, "moderate"),
    ("shift the start 0.1 to the left", "move_start", {"left": 0.1}, "moderate"),
    ("the goal position should be a bit lower", "move_goal", {"down": None}, "slight"),
    ("after reaching the goal go up by 0.3", "extend", {"up": 0.3}, "moderate"),
]


@pytest.mark.parametrize(("sentence", "action", "directions", "degree"), MOVES, ids=[m[0] for m in MOVES])
def test_directions(sentence, action, directions, degree):
    found = short(sentence)[0]
    assert (found[0], found[1], found[5]) == (action, directions, degree)


OBJECTS = [
    ("go closer to the cup", "closer", ["cup"], None, "moderate"),
    ("get much nearer to the yellow plate", "closer", ["Yellow Plate"], None, "large"),
    ("hold a smaller distance from the fan", "closer", ["fan"], None, "moderate"),
    ("head towards the plate", "closer", ["Yellow Plate"], None, "moderate"),
    ("go 0.1 m closer to the cup", "closer", ["cup"], 0.1, "moderate"),
    ("stay a little further off from the fan", "farther", ["fan"], None, "slight"),
    ("increase the distance to the cup", "farther", ["cup"], None, "moderate"),
    ("avoid the red wine", "farther", ["red wine"], None, "moderate"),
    ("keep at least 0.3 away from the cup", "keep_distance", ["cup"], 0.3, "moderate"),
    ("maintain a minimum distance of 20 cm from the cup and the fan", "keep_distance", ["cup", "fan"], 0.2, "moderate"),
    ("pass through the cup", "through", ["cup"], None, "moderate"),
    ("go over the plate", "through", ["Yellow Plate"], None, "moderate"),
    ("pass between the cup and the fan", "through", ["cup", "fan"], None, "moderate"),
    ("start at the fan", "move_start", ["fan"], None, "moderate"),
    ("end at the midpoint of the cup and the fan", "move_goal", ["cup", "fan"], None, "moderate"),
    ("continue to the fan", "extend", ["fan"], None, "moderate"),
    ("wait at the cup for 12 timesteps", "wait", ["cup"], 12.0, "moderate"),
    ("pause near the cup for 3 seconds", "wait", ["cup"], 3.0, "moderate"),
    ("stop near the fan", "stop", ["fan"], None, "moderate"),
]


@pytest.mark.parametrize(("sentence", "action", "items", "amount", "degree"), OBJECTS, ids=[o[0] for o in OBJECTS])
def test_relations_to_objects(sentence, action, items, amount, degree):
    found = short(sentence)[0]
    assert (found[0], found[2], found[3], found[5]) == (action, items, amount, degree)


SPEEDS = [
    ("slow down", "slower", None, ()),
    ("go faster near the fan", "faster", None, ("near", "fan", None)),
    ("reduce the speed by 20 % within 0.3 m of the cup", "factor", 0.8, ("near", "cup", 0.3)),
    ("double the speed when passing the cup", "factor", 2.0, ("near", "cup", None)),
    ("halve the velocity in the first half", "factor", 0.5, ("first", 0.5)),
    ("go three times faster", "factor", 3.0, ()),
    ("increase the speed by 0.1 m/s", "add", 0.1, ()),
    ("lower the speed at the end", "slower", None, ("last", None)),
    ("drive at a constant speed of 0.3", "set", 0.3, ()),
    ("keep a constant speed after the cup", "constant", None, ("after", "cup", None)),
    ("set the speed to 0.2 for the last 10 waypoints", "set", 0.2, ("last", 10.0)),
    ("slow down when going up", "slower", None, ("heading", None)),
    ("accelerate gradually", "ramp_up", None, ()),
    ("decelerate to a stop", "ramp", 0.0, ()),
    ("go slower between the cup and the fan while passing", "slower", None, ("between", "cup", "fan", None)),
    ("slow down in the middle of the path", "slower", None, ("middle", None)),
    ("slow down in the first 0.5 m", "slower", None, ("first", 0.5)),
    ("slow down in the last 2 seconds", "slower", None, ("last", 2.0)),
    ("go faster between waypoint 10 and 30", "faster", None, ("range", 10.0)),
    ("go slower from the cup onwards", "slower", None, ("after", "cup", None)),
    ("slow down until the midpoint", "slower", None, ("first", 0.5)),
    ("don't exceed 0.3 m/s", "cap", 0.3, ()),
    ("go no slower than 0.1 m/s", "floor", 0.1, ()),
    ("go from 0.1 to 0.5 m/s", "ramp", 0.5, ()),
    ("take twice as long", "factor", 0.5, ()),
    ("go 0.1 m/s slower", "add", -0.1, ()),
    ("don't change the speed along the way", "constant", None, ()),
]


@pytest.mark.parametrize(("sentence", "mode", "amount", "region"), SPEEDS, ids=[s[0] for s in SPEEDS])
def test_speeds(sentence, mode, amount, region):
    found = short(sentence)[-1]
    assert found[0] == "speed"
    assert (found[4], found[6]) == (mode, region)
    assert found[3] == pytest.approx(amount) if amount is not None else found[3] is None


SHAPES = [
    ("make a small spiral of 2 turns at the end", "spiral", None, 2.0, "slight"),
    ("draw a spiral with a radius of 0.1 near the cup", "spiral", 0.1, None, "moderate"),
    ("orbit the fan twice with a radius of 0.3", "circle", 0.3, 2.0, "moderate"),
    ("circle once around the cup", "circle", None, 1.0, "moderate"),
    ("fly a figure eight at the goal", "eight", None, None, "moderate"),
    ("follow the path in a zig-zag with an amplitude of 0.05", "zigzag", 0.05, None, "moderate"),
    ("move in a sinusoidal pattern in the last half", "wave", None, None, "moderate"),
    ("hop over the cup", "hop", None, None, "moderate"),
    ("hover 0.2 above the plate for 2 seconds", "hover", 0.2, 2.0, "moderate"),
    ("rotate the path clockwise by 45 degrees", "rotate", -45.0, -1.0, "moderate"),
    ("tilt it slightly", "tilt", None, 1.0, "slight"),
    ("mirror the first half about the y axis", "mirror", None, None, "moderate"),
    ("scale the path by 1.5", "resize", 1.5, None, "moderate"),
    ("make the path much more curved", "curve", None, None, "large"),
    ("go straight from the cup to the fan", "straighten", None, None, "moderate"),
    ("follow the path until the cup and then go straight to the fan", "shortcut", None, None, "moderate"),
    ("replace each group of 4 waypoints by its mean", "average", 4.0, None, "moderate"),
    ("reverse the second half", "reverse", None, None, "moderate"),
    ("add some noise", "noise", None, None, "moderate"),
    ("never go higher than 0.3", "bound", None, None, "moderate"),
    ("always stay left of the fan", "side", None, None, "moderate"),
    ("stay in the second quadrant", "quadrant", 2.0, None, "moderate"),
    ("keep a height of 0.2 above the floor", "height", 0.2, None, "moderate"),
]


@pytest.mark.parametrize(("sentence", "action", "amount", "count", "degree"), SHAPES, ids=[s[0] for s in SHAPES])
def test_shapes_and_bounds(sentence, action, amount, count, degree):
    (found,) = intents(sentence)
    assert (found.action, found.amount, found.count, found.degree) == (action, amount, count, degree)
    answer = reply(sentence)
    assert answer.kind == "policy"
    run(parse_policy(answer.code), Trajectory.from_array(ROWS), SCENE)


CHANGES = [
    ("slow down to 30 % near the cup", 0.3),
    ("reduce the speed by 30 %", 0.7),
    ("raise the speed to 150 %", 1.5),
    ("increase the speed by half", 1.5),
    ("move at 50 % speed", 0.5),
    ("enlarge the path by 20 %", 1.2),
    ("scale the path down by 10 %", 0.9),
]


@pytest.mark.parametrize(("sentence", "factor"), CHANGES, ids=[c[0] for c in CHANGES])
def test_by_and_to_are_told_apart(sentence, factor):
    assert intents(sentence)[0].amount == pytest.approx(factor)


LAWS = [
    ("use a trapezoidal speed profile", "trapezoid"),
    ("accelerate exponentially", "exponential"),
    ("slow down before the turns", "turns"),
    ("move with a constant acceleration", "acceleration"),
]


@pytest.mark.parametrize(("sentence", "mode"), LAWS, ids=[law[0] for law in LAWS])
def test_speed_laws(sentence, mode):
    assert intents(sentence)[0].mode == mode
    run(parse_policy(reply(sentence).code), Trajectory.from_array(ROWS), SCENE)


@pytest.mark.parametrize("sentence", [m[0] for m in MOVES] + [o[0] for o in OBJECTS] + [s[0] for s in SPEEDS])
def test_every_policy_runs_and_keeps_its_promises(sentence):
    rollout = run(parse_policy(reply(sentence).code), Trajectory.from_array(ROWS), SCENE)
    for expectation in rollout.expectations:
        outcome = judge(expectation, ROWS, rollout.trajectory.to_array(), SCENE)
        assert outcome.held, outcome.sentence


CLAUSES = [
    ("go left by 0.2 and slow down near the cup", ["move", "speed"]),
    ("go up, then closer to the fan but slower near the plate", ["move", "closer", "speed"]),
    ("Go left by 0.1. Wait at the fan for 5 steps.", ["move", "wait"]),
    ("go faster near the cup and slower near the fan", ["speed", "speed"]),
    ("when passing the cup, slow down", ["speed"]),
    ("double the number of waypoints and smooth the path", ["resample", "smooth"]),
    ("go left by 0.2 for the first half and right by 0.2 for the second half", ["move", "move"]),
    ("double the speed but halve it near the cup", ["speed", "speed"]),
    ("speed up while going left", ["speed"]),
    ("finish 5 cm above the plate", ["move_goal"]),
    ("set the pace to 0.1 m/s between the cup and the fan", ["speed"]),
    ("keep 0.2 m distance from the cup while moving at 0.5 m/s", ["keep_distance", "speed"]),
    ("first go left, second go up, finally slow down", ["move", "move", "speed"]),
    ("slow down near the cup after moving everything left by 0.2", ["speed", "move"]),
    ("keep the goal fixed and go left", ["same", "move"]),
    ("go left without changing the speed", ["move", "same"]),
    ("follow the same path but faster", ["same", "speed"]),
    ("wait at the cup for 5 steps and then carry on", ["wait"]),
]


@pytest.mark.parametrize(("sentence", "actions"), CLAUSES, ids=[c[0] for c in CLAUSES])
def test_several_clauses(sentence, actions):
    assert [i.action for i in intents(sentence)] == actions


def test_a_distance_stated_once_holds_for_every_near():
    understood = read_instruction("go faster near the cup and slower near the fan. The threshold is 0.25", SCENE)
    assert understood.radius == 0.25 and understood.unplaced == ()


def test_there_is_near_what_was_named_last():
    found = short("stay further from the fan and go slower there")
    assert found[1][6] == ("near", "fan", None)


def test_all_objects_can_be_meant_at_once():
    assert [i.items[0].name for i in intents("stay away from all the obstacles")] == list(SCENE.names)
    assert intents("slow down near every object")[0].region.items == SCENE.objects
    assert "object" in read_instruction("go to the round object", SCENE).unplaced


def test_misspelt_words_are_read_and_said():
    understood = read_instruction("go slighlty upwrads and acelerate near the cup", SCENE)
    assert [i.action for i in understood.intents] == ["move", "speed"]
    assert understood.unplaced == () and len(understood.notes) == 3


UNKNOWN = [
    ("do a barrel roll", "barrel"),
    ("go closer to the vase", "vase"),
    ("move left unless it rains", "unless"),
    ("paint the cup blue", "paint"),
    ("xyzzy", "xyzzy"),
    ("three spirals near the cup", "three"),
    ("slow down within 0.3 m", "within"),
    ("go left by 0.1 and keep at least a distance of 0.3", "distance"),
    ("raise the path to 0.3", "0.3"),
    ("push the cup to the left", "cup"),
    ("rotate the cup by 30 degrees", "cup"),
    ("close the fan", "close"),
    ("point the gripper down", "point"),
    ("turn the gripper by 20 degrees", "turn"),
    ("go back to the original path", "go back to the original"),
    ("stay as far from the fan as from the cup", "far"),
    ("make the path half as long", "as long"),
    ("avoid the left side", "avoid"),
    ("don't go left", "don't"),
    ("make a figure eight around the cup and the fan", "figure eight"),
    ("approach the cup from the left", "Approach"),
    ("go left and end there", "there"),
    ("stop slowing down", "stop"),
    ("go around the fan", "around"),
    ("don't slow down", "don't"),
]


@pytest.mark.parametrize(("sentence", "word"), UNKNOWN, ids=[u[0] for u in UNKNOWN])
def test_what_has_no_place_is_named_not_guessed(sentence, word):
    assert word.lower() in [w.lower() for w in read_instruction(sentence, SCENE).unplaced]


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
    assert answer.question == "Which cup: 'red cup' or 'blue cup'?"


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
    code = reply("wait at the cup for 5 steps, slow down near the fan, go left by 0.1, smooth the path").code
    order = [code.index(word) for word in ("= smooth(", "= move(", "= scale_speed(", "= dwell(")]
    assert order == sorted(order)


def test_near_is_never_empty_and_never_everything():
    from ovita.instruct.scale import Scale

    trajectory = Trajectory.from_array(ROWS)
    scale = Scale.of(trajectory)
    for item in SCENE:
        within = item.distance(trajectory.positions) <= scale.near(trajectory.positions, item)
        assert 0 < within.sum() < len(trajectory)
