"""Edits on a part blend at its edges, and figures take the speed of the path that they are put into."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toolkit_paths import modest, paths_and_masks

from ovita.paths.geometry import runs, turning_angles
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.toolkit import (
    at_height,
    bound,
    circle,
    dwell,
    expect_moved,
    expect_same_path,
    expect_same_speed,
    extend,
    figure_eight,
    hover,
    judge,
    keep_unchanged,
    mirror,
    move,
    resample,
    rotate,
    scale,
    spiral,
)

INSIDE = {
    "move": lambda t, m: move(t, left=0.1, where=m),
    "rotate": lambda t, m: rotate(t, 40, where=m),
    "mirror": lambda t, m: mirror(t, "y", about="start", where=m),
    "scale": lambda t, m: scale(t, 1.3, where=m),
}
OUTSIDE = {
    "bound": lambda t, m: bound(t, left=-0.05, up=-0.02, where=m),
    "at_height": lambda t, m: at_height(t, 0.3, where=m),
}


def sharpest(rows):
    return float(np.degrees(turning_angles(rows[:, :3]).max()))


@pytest.fixture
def leftward():
    """A straight level path of 41 waypoints, 1 m to the left, so that a shift to the right turns it back."""
    rows = np.zeros((41, 4))
    rows[:, 0], rows[:, 3] = -np.linspace(0.0, 1.0, 41), 0.5
    return rows


@pytest.mark.parametrize("word", ["left", "right", "up", "front"])
def test_a_shift_of_a_part_makes_no_kink_and_is_reached_in_full(leftward, word):
    half = np.arange(41) >= 20
    out = move(leftward, **{word: 0.1}, where=half)
    assert sharpest(out) < 30
    assert np.array_equal(out[:20], leftward[:20])
    assert np.allclose(np.linalg.norm((out - leftward)[31:, :3], axis=1), 0.1)
    assert judge(expect_moved(**{word: 0.1}, where=half), leftward, out, Scene()).held
    jump = move(leftward, **{word: 0.1}, where=half, ease=0)
    assert word == "left" or sharpest(jump) > 60
    assert np.allclose(np.linalg.norm((jump - leftward)[20:, :3], axis=1), 0.1)


@modest
@given(paths_and_masks(), st.sampled_from(sorted(INSIDE)))
def test_inside_blends_leave_the_rest_alone_and_reach_the_amount_in_each_run(drawn, name):
    rows, mask = drawn
    out = INSIDE[name](rows, mask)
    if name == "move":
        for a, b in runs(mask):
            assert np.abs((out - rows)[a : b + 1, 0]).max() == pytest.approx(0.1)
    assert np.array_equal(out[~mask], rows[~mask]) and np.array_equal(out[:, 3:], rows[:, 3:])


@modest
@given(paths_and_masks(), st.sampled_from(sorted(OUTSIDE)))
def test_outside_blends_keep_the_limit_on_the_whole_part_and_hold_ends_outside_it(drawn, name):
    rows, mask = drawn
    out = OUTSIDE[name](rows, mask)
    full = OUTSIDE[name](rows, None)
    assert np.array_equal(out[mask], full[mask])
    ends = [i for i in (0, len(rows) - 1) if not mask[i]]
    assert np.array_equal(out[ends], rows[ends])


def test_what_a_limit_moves_is_followed_without_a_kink(leftward):
    middle = (np.arange(41) > 15) & (np.arange(41) < 25)
    out = at_height(leftward, 0.1, where=middle)
    assert (out[middle, 2] == 0.1).all() and sharpest(out) < 30
    assert sharpest(at_height(leftward, 0.1, where=middle, ease=0)) > 60


FIGURES = {
    "circle": lambda t, o, at: circle(t, o, radius=0.2),
    "spiral": lambda t, o, at: spiral(t, at, radius=0.2),
    "eight": lambda t, o, at: figure_eight(t, at, size=0.4),
    "extension": lambda t, o, at: extend(t, 0.8),
}


@pytest.mark.parametrize("at", ["start", 0.5, "goal"])
@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_is_as_fast_as_the_path(name, at):
    """A circle at the goal once crept at millimetres per second: it took the speed of the braking path."""
    rows = np.zeros((61, 4))
    rows[:, 0] = np.linspace(0.0, 1.0, 61)
    rows[:, 3] = np.minimum(0.35, 3.5 * np.minimum(rows[:, 0], 1.0 - rows[:, 0]))
    place = {"start": 0.0, 0.5: 0.5, "goal": 1.0}[at]
    out = FIGURES[name](rows, SceneObject("box", [place, 0.1, 0.0], [0.05] * 3), at)
    old, new = (Trajectory.from_array(r[:, :4]) for r in (rows, out))
    added = new.length - old.length
    assert new.duration - old.duration < 1.8 * added / 0.35
    assert out[:, 3].max() <= 0.35 + 1e-12


def test_hovering_brakes_and_speeds_up_again(line, cup):
    out = hover(line, cup, 0.2, steps=5)
    rest = np.flatnonzero(out[:, 3] == 0.0)
    assert len(rest) == 6 and np.ptp(rest) == 5
    assert out[rest[0] - 3, 3] == out[rest[-1] + 3, 3] == 0.5


@modest
@given(paths_and_masks(smallest=4, extra=2))
def test_a_part_that_is_kept_is_as_it_was_and_the_rest_keeps_the_edit(drawn):
    rows, mask = drawn
    edited = scale(rows, 1.2)
    out = keep_unchanged(edited, rows, mask, ease=0)
    assert np.array_equal(out[mask], rows[mask]) and np.array_equal(out[~mask], edited[~mask])
    assert np.array_equal(keep_unchanged(edited, rows), rows)


def long_line(n):
    """A straight level path, 3 m along x."""
    return np.column_stack([np.linspace(0.0, 3.0, n), np.zeros((n, 2)), np.full(n, 0.5)])


def test_the_rest_of_an_edit_blends_into_the_part_that_is_kept():
    rows = long_line(101)
    kept = np.arange(101) >= 70
    out = keep_unchanged(move(rows, left=0.1), rows, kept)
    assert np.array_equal(out[kept], rows[kept])
    assert sharpest(out) < 30 and np.allclose((out - rows)[:30, :3], [-0.1, 0.0, 0.0])


@pytest.mark.parametrize(
    "edit",
    [
        lambda t: dwell(move(t, up=0.2), 0.2, 8),
        lambda t: circle(move(t, up=0.2), [1.5, 0.3, 0.2], radius=0.2),
        lambda t: extend(move(t, up=0.2), 0.5),
        lambda t: resample(move(t, up=0.2), 57),
        lambda t: move(t, up=0.2)[:-30],
    ],
)
def test_a_part_is_kept_where_an_edit_puts_waypoints_in_or_takes_them_out(edit):
    rows = long_line(101)
    kept = (np.arange(101) >= 40) & (np.arange(101) <= 60)
    out = keep_unchanged(edit(rows), rows, kept)
    begin = next(i for i in range(len(out)) if np.array_equal(out[i], rows[40]))
    assert np.array_equal(out[begin : begin + 21], rows[40:61])
    steps = np.linalg.norm(np.diff(out[:, :3], axis=0), axis=1)
    assert steps.max() < 0.2 and sharpest(out) < 30
    for promise in (expect_same_path(where=kept), expect_same_speed(where=kept)):
        outcome = judge(promise, rows, out, Scene())
        assert outcome.held, outcome.sentence
