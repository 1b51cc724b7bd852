"""Conditions change the prompt and nothing behind it."""

from dataclasses import replace

import numpy as np
import pytest

from ovita.bench.evaluate import ABLATIONS, DEFAULT, PAPER_EXAMPLES, Condition, conditions_from
from ovita.chain import REPAIRS
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.writers.base import ground

PATH = Trajectory.from_array(np.column_stack([np.linspace(0, 2, 30), np.zeros((30, 2)), np.full(30, 0.4)]))
REQUEST = Request("circle the cup", PATH, Scene((SceneObject("cup", [0.5, 0.3, 0.0]),)))


def by_name():
    return {condition.name: condition for condition in conditions_from(",".join(ABLATIONS))}


def test_examples_are_compared_three_ways():
    modes = {name: condition.examples for name, condition in by_name().items()}
    assert modes["default"] == "retrieved" and modes["no examples"] == "none" and modes[PAPER_EXAMPLES] == "paper"


def test_without_repair_nothing_goes_back():
    assert by_name()["no repair"].repairs == 0 and DEFAULT.repairs == REPAIRS


@pytest.mark.parametrize("without", ["toolkit", "grounding"])
def test_what_was_added_behind_the_situation_stays(without):
    condition = Condition(f"no {without}", without=without)
    prompt = ground(REQUEST, examples=condition.examples)
    told = replace(prompt, hints=("# Note\nIt may be wrong.\n",)).repaired("code", "line 1: no")
    changed = condition.rewrite(told)
    assert changed.situation.endswith("circle the cup\n# Note\nIt may be wrong.\n")
    assert changed.attempts == told.attempts
    assert (changed.fixed == told.fixed) == (without == "grounding")


def test_other_conditions_leave_the_prompt_alone():
    prompt = ground(REQUEST)
    for name in ("default", "no examples", PAPER_EXAMPLES, "no repair", "no constraints"):
        assert by_name()[name].rewrite(prompt) is prompt
