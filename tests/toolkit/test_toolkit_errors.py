"""What a policy's writer reads after a wrong call."""

import numpy as np
import pytest

from ovita.scene import RFU
from ovita.toolkit import Recorder, namespace

WRONG = {
    "near(t, 'cup', 0.2)": r"pass scene\['cup'\], not 'cup'",
    "near(t, [1, 2], 0.2)": "object of the scene or a point",
    "near(t, [1, 2, np.nan], 0.2)": "not finite",
    "near(t, cup, -1)": "within must be >= 0, not -1",
    "near(t, cup, None)": "within must be a number",
    "near(cup, t, 0.2)": "pass the trajectory as first argument",
    "near(t[:, :3], cup, 0.2)": r"shape \(21, 3\)",
    "near(t[:1], cup, 0.2)": "at least 2",
    "near(t * np.nan, cup, 0.2)": "waypoint 0 of traj is not finite",
    "first(t)": "exactly one of n",
    "first(t, 3, fraction=0.1)": "exactly one of n",
    "first(t, 0.5)": "did you mean fraction=0.5",
    "first(t, 22)": "n must be from 1 to 21, not 22",
    "last(t, fraction=1.5)": "fraction must be from 0 to 1",
    "between(t, 'cup', 3)": "pass scene\\['cup'\\]",
    "between(t, 0, 21)": "b must be from -21 to 20",
    "between(t, 0, 1.5)": "b must be from 0 to 1",
    "between(t, True, 3)": "a must be a place",
    "where_rising(t, 'upwards')": "unknown direction 'upwards'; directions are left",
    "where_rising(t, 3)": "must be a word",
    "every(t, 0)": "k must be from 1",
    "every(t, 1.5)": "whole number",
    "move(t, forward=0.2)": r"'forward'; call it as move\(traj, \*, left=0, right=0",
    "move(t, 0.2)": "too many positional",
    "move(t, left=np.inf)": "left must be finite",
    "move(t, left='far')": "left must be a number, not 'far'",
    "move(t, left=True)": "left must be a number",
    "move(t, left=1, where=[True])": "the mask has 1 entries but the trajectory has 21 waypoints",
    "move(t, left=1, where=[1, 2])": "where must be a mask",
    "move(t, left=1, where=cup)": "where=near",
    "move(t, left=1, ease=2)": "ease must be from 0 to 1",
    "move(t, left=1, keep='end')": "keep must be None",
    "move_goal(t, 'cup')": "to is the text 'cup'",
    "closer(t, cup, -0.1)": "by must be >= 0",
    "closer(t, cup, 0.1, reach=0)": "reach must be > 0",
    "farther(t, cup)": "exactly one of by",
    "farther(t, cup, times=0.5)": "times must be >= 1",
    "keep_distance(t, cup)": "give at_least or at_most",
    "keep_distance(t, cup, 0.5, 0.1)": "contradicts at_least",
    "go_through(t[:2], cup)": "resample",
    "extend(t)": "give either by",
    "extend(t, 0.1, up=0.1)": "give either by",
    "extend(t * 0, 0.1)": "no heading",
    "scale_speed(t, -1)": "factor must be >= 0",
    "scale_speed(t)": "missing a required argument: 'factor'; call it as",
    "set_speed(t, -1)": "speed must be >= 0",
    "ramp_speed(t)": "give start, end or both",
    "stop_at(t, 'cup')": "pass scene\\['cup'\\], 'start' or 'goal'",
    "dwell(t, cup, 0)": "steps must be from 1",
    "dwell(t, cup, 10**9)": "steps must be from 1 to 10000",
    "smooth(t, -1)": "strength must be >= 0",
    "resample(t, 1)": "n must be from 2",
    "resample(t, 10, by='time')": "by must be 'arc_length' or 'index'",
    "midpoint(cup, 'box')": "b is the text 'box'",
    "expect_moved()": "give a direction",
    "expect_distance(cup)": "give at_least or at_most",
    "expect_closer('cup')": "pass scene\\['cup'\\]",
    "expect_slower(where=cup)": "where is an object",
    "expect_slower(where=0.2)": "where must be a mask",
}


@pytest.mark.parametrize("call", WRONG)
def test_a_wrong_call_says_what_to_do(call, line, cup):
    with pytest.raises(ValueError, match=WRONG[call]) as caught:
        eval(call, {**namespace(RFU, Recorder()), "t": line, "cup": cup, "np": np})
    assert "\n" not in str(caught.value)
