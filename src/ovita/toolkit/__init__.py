"""The toolkit: what a policy may call to select waypoints, edit a trajectory and state what it expects.

Every edit takes an array (N, 4+k) with rows x, y, z [m], speed [m/s] and extra columns, and returns a new one; the
extra columns travel along. Wherever an object is asked for, a point (3,) [m] will do; a mask (N,) of booleans says
which waypoints, and None means all. Only numpy is needed, so that the toolkit can run inside the sandbox.
"""

from ovita.toolkit.approach import closer, farther, keep_distance
from ovita.toolkit.catalogue import CATALOGUE, describe, namespace
from ovita.toolkit.edit import resample, smooth
from ovita.toolkit.ends import continue_to, extend, go_through, move_goal, move_start
from ovita.toolkit.expect import (
    expect_closer,
    expect_distance,
    expect_farther,
    expect_faster,
    expect_goal,
    expect_moved,
    expect_same_path,
    expect_slower,
    expect_speed,
    expect_start,
    expect_stop,
    expect_visits,
)
from ovita.toolkit.judging import Outcome, judge
from ovita.toolkit.loops import circle, figure_eight, spiral
from ovita.toolkit.overhead import hop, hover
from ovita.toolkit.recorder import Expectation, Recorder
from ovita.toolkit.regions import at_height, bound, quadrant, stay_on
from ovita.toolkit.ripples import noise, wave, zigzag
from ovita.toolkit.routes import average, reverse, shortcut, straighten
from ovita.toolkit.select import between, every, first, last, near, where_rising
from ovita.toolkit.shift import midpoint, move
from ovita.toolkit.speed import dwell, ramp_speed, scale_speed, set_speed, shift_speed, stop_at
from ovita.toolkit.speedlaws import accelerate, exponential_speed, slow_turns, trapezoid_speed
from ovita.toolkit.transforms import curve, mirror, rotate, scale, tilt

__all__ = [
    "CATALOGUE",
    "Expectation",
    "Outcome",
    "Recorder",
    "accelerate",
    "at_height",
    "average",
    "between",
    "bound",
    "circle",
    "closer",
    "continue_to",
    "curve",
    "describe",
    "dwell",
    "every",
    "expect_closer",
    "expect_distance",
    "expect_farther",
    "expect_faster",
    "expect_goal",
    "expect_moved",
    "expect_same_path",
    "expect_slower",
    "expect_speed",
    "expect_start",
    "expect_stop",
    "expect_visits",
    "exponential_speed",
    "extend",
    "farther",
    "figure_eight",
    "first",
    "go_through",
    "hop",
    "hover",
    "judge",
    "keep_distance",
    "last",
    "midpoint",
    "mirror",
    "move",
    "move_goal",
    "move_start",
    "namespace",
    "near",
    "noise",
    "quadrant",
    "ramp_speed",
    "resample",
    "reverse",
    "rotate",
    "scale",
    "scale_speed",
    "set_speed",
    "shift_speed",
    "shortcut",
    "slow_turns",
    "smooth",
    "spiral",
    "stay_on",
    "stop_at",
    "straighten",
    "tilt",
    "trapezoid_speed",
    "wave",
    "where_rising",
    "zigzag",
]
