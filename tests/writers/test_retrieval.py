"""Retrieval: other words for the same wish find the function and an example that shows its use."""

import time

import numpy as np
import pytest

from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.toolkit import CATALOGUE
from ovita.writers.base import ground
from ovita.writers.examples import Index, examples, functions_like, similar, terms, use_of
from ovita.writers.prompt import ROOM

PATH = Trajectory.from_array(np.column_stack([np.linspace(0, 2, 30), np.zeros((30, 2)), np.full(30, 0.4)]))
NAMES = ("kettle", "traffic cone", "shelf", "water bottle")
SCENE = Scene(tuple(SceneObject(name, [i, 1, 0]) for i, name in enumerate(NAMES)))

SAID = {
    "get nearer to the kettle": "closer",
    "the path ought to run tighter along the shelf": "closer",
    "leave some more space around the traffic cone": "farther",
    "shy away from the kettle": "farther",
    "there must always be 40 cm of air between you and the cone": "keep_distance",
    "at no point be within 0.3 m of the bottle": "keep_distance",
    "come as near as 0.3 m to the shelf": "pass_at",
    "everything a hand's breadth to the right, say 10 cm": "move",
    "the first third should be 5 cm lower": "move",
    "halfway through, rise by 0.2": "move",
    "creep past the shelf": "scale_speed",
    "three times as quick please": "scale_speed",
    "crawl along the last 12 waypoints": "scale_speed",
    "0.4 m/s from beginning to end": "set_speed",
    "ease off little by little until the goal": "ramp_speed",
    "pick up speed steadily": "ramp_speed",
    "speed: up, plateau, down, like a trapezoid": "trapezoid_speed",
    "exponentially increasing velocity": "exponential_speed",
    "a constant acceleration of 0.1 m/s2": "accelerate",
    "corner slowly": "slow_turns",
    "halt by the shelf": "stop_at",
    "finish at zero velocity": "stop_at",
    "linger for 12 timesteps next to the kettle": "dwell",
    "take a 3 second break at the cone": "dwell",
    "the destination becomes the shelf": "move_goal",
    "set the end point 20 cm higher": "move_goal",
    "depart from the kettle": "move_start",
    "when finished, carry on to the shelf": "continue_to",
    "prolong the path by 30 cm": "extend",
    "beeline from start to goal": "straighten",
    "run it backwards": "reverse",
    "two laps around the cone": "circle",
    "orbit the kettle anticlockwise": "circle",
    "a helix at the end": "spiral",
    "trace an eight in the middle": "figure_eight",
    "slalom from side to side": "zigzag",
    "oscillate up and down": "wave",
    "leap over the shelf": "hop",
    "hover above the kettle for 10 steps": "hover",
    "iron out the kinks": "smooth",
    "bend the path more strongly": "curve",
    "turn the whole thing by 45 degrees": "rotate",
    "tilt it 15 degrees": "tilt",
    "swap left and right in the path": "mirror",
    "blow the path up by 1.5": "scale",
    "jitter the points a little": "noise",
    "never exceed a height of 0.5": "bound",
    "pass the cone on its left side": "stay_on",
    "stay in the first quadrant": "quadrant",
    "at no time quicker than 0.2 m/s": "bound_speed",
    "the speed must not drop below 0.1 m/s": "bound_speed",
    "everything up 5 cm, but leave the first third unchanged": "keep_unchanged",
    "fly level at 0.6 m": "at_height",
    "resample to 200 points": "resample",
    "average groups of 4 waypoints": "average",
    "touch the kettle on the way": "go_through",
    "pass between the cone and the shelf": "go_through",
    "follow the path to the kettle, then head straight for the shelf": "shortcut",
}


def in_prompt(instruction, function):
    prompt = ground(Request(instruction, PATH, SCENE))
    return f"\n{function}(" in prompt.fixed + prompt.situation


def test_the_function_that_other_words_ask_for_is_in_the_prompt():
    missing = [(said, name) for said, name in SAID.items() if not in_prompt(said, name)]
    assert len(missing) <= 0.05 * len(SAID), missing


def test_an_example_shows_its_use():
    without = [s for s, name in SAID.items() if not any(name in e.calls for e in similar(s, 2, NAMES))]
    assert len(without) <= 0.15 * len(SAID), without


@pytest.mark.parametrize("example", examples(), ids=lambda e: e.say)
def test_an_example_is_found_by_its_own_words_about_other_objects(example):
    others = dict(zip(example.objects, NAMES, strict=False))
    said = example.say
    for old, new in others.items():
        said = said.replace(old, new)
    assert example in similar(said, 2, NAMES)


def test_a_second_example_is_about_what_the_first_leaves_open():
    found = similar("keep 20 cm away from the kettle and then circle the cone twice", 2, NAMES)
    calls = {name for example in found for name in example.calls}
    assert {"keep_distance", "circle"} <= calls


def test_the_answer_depends_on_nothing_but_the_words():
    said = "approach the shelf and wait there"
    assert similar(said, 3, NAMES) == similar(said, 3, NAMES)
    swapped = similar(said.replace("shelf", "kettle"), 3, NAMES)
    assert swapped == similar(said, 3, NAMES)


@pytest.mark.parametrize("said", ["", "!!!", "the of a", "日本語", "x" * 2000, "go " * 600])
def test_strange_instructions_find_something_or_nothing(said):
    assert len(similar(said, 2)) <= 2 and len(functions_like(said, 3)) <= 3


def test_helpful_text_keeps_its_room():
    longest = "; then ".join(SAID)[:1900]
    situation = ground(Request(longest, PATH, SCENE)).situation
    assert len(situation[: situation.index("# This scene")]) < ROOM + 600


def test_an_answer_without_a_policy_is_shown_only_where_it_fits_best():
    assert similar("sing a song while you are moving", 2)[0].not_understood
    assert "Not understood" not in ground(Request("slow down near the kettle", PATH, SCENE)).situation


def test_every_function_has_an_example():
    without = [name for name in CATALOGUE if use_of(name) is None]
    assert not without, f"show a language model when to call it, in writers/bank/*.toml: {without}"
    said, line = use_of("hop")
    assert said and "hop(" in line
    assert use_of("fly") is None


def test_there_are_many_examples_of_every_kind():
    assert len([e for e in examples() if e.code]) >= 130
    assert sum(1 + len(e.also) for e in examples()) >= 500
    said = [e.say for e in examples()]
    assert len(set(said)) == len(said)


def test_terms_know_concepts_numbers_objects_and_directions():
    found = terms("Go 20 cm to the left of the traffic cone", NAMES)
    assert "<number>" in found and "<object>" in found and "<direction>" in found and "cm" not in found
    assert "=slower" in terms("reduce speed") or "=decrease" in terms("reduce speed")


def test_the_index_prefers_rare_terms_and_short_texts():
    index = Index([["a", "b"], ["a", "c", "d", "e"], ["a", "c"]])
    assert list(np.argsort(-index.scores(["c"]))) == [2, 1, 0]
    assert index.scores(["z"]).tolist() == [0, 0, 0]


def test_it_takes_milliseconds():
    ground(Request("go left", PATH, SCENE))
    best = min(_seconds() for _ in range(5))
    assert best < 0.05


def _seconds():
    started = time.process_time()
    ground(Request("go left, wait at the kettle and circle the cone", PATH, SCENE))
    return time.process_time() - started
