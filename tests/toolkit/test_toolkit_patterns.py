from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toolkit_paths import amounts, modest, paths, paths_and_masks, points

import ovita as ov
from ovita.paths.geometry import turning_angles
from ovita.paths.scene import Frame, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.toolkit import (
    Recorder,
    circle,
    corkscrew,
    expect_side,
    figure_eight,
    hop,
    hover,
    judge,
    noise,
    spiral,
    wave,
    zigzag,
)

BALL = SceneObject("ball", [0.5, 0.02, 0.0], [0.1, 0.1, 0.1])

INSERTING = {
    "spiral": lambda t: spiral(t, radius=0.2, height=0.1),
    "inner spiral": lambda t: spiral(t, 0.4, radius=0.1, turns=1.5, clockwise=True),
    "circle": lambda t: circle(t, BALL),
    "wide circle": lambda t: circle(t, BALL, radius=0.5, turns=0.5, clockwise=False),
    "figure_eight": lambda t: figure_eight(t, BALL, size=0.3),
}
BENDING = {
    "zigzag": lambda t: zigzag(t, 0.1),
    "wave": lambda t: wave(t, 0.1, direction="up"),
    "hop": lambda t: hop(t, BALL, 0.1),
    "hover": lambda t: hover(t, BALL, 0.2),
    "noise": lambda t: noise(t, 0.05),
}


def sharpest(rows):
    return float(np.degrees(turning_angles(rows[:, :3]).max()))


def winding(xy):
    """Turns of a path (M, 2) around the origin, counter-clockwise."""
    angle = np.unwrap(np.arctan2(xy[:, 1], xy[:, 0]))
    return (angle[-1] - angle[0]) / (2 * np.pi)


@modest
@given(paths(extra=2, smallest=4), st.sampled_from(sorted({**INSERTING, **BENDING})))
def test_every_pattern_is_finite_and_carries_extra_columns(rows, name):
    before = rows.copy()
    rows.flags.writeable = False
    out = {**INSERTING, **BENDING}[name](rows)
    assert np.array_equal(rows, before) and not np.shares_memory(out, rows)
    assert np.isfinite(out).all() and out.shape[1] == 6
    Trajectory.from_array(out[:, :4])
    if name in INSERTING:
        kept, new = inserted(out, rows)
        assert (new[:, 4:] == rows[kept, 4:]).all()
        assert new[:, 3].max() <= rows[:, 3].max() + 1e-12
    elif name != "noise":
        assert np.array_equal(out[[0, -1]], rows[[0, -1]])


def inserted(out, rows):
    """The index after which a pattern put waypoints into a path that is otherwise as before, and these waypoints."""
    count = len(out) - len(rows)
    for i in reversed(range(len(rows))):
        if np.array_equal(out[: i + 1], rows[: i + 1]) and np.array_equal(out[i + 1 + count :], rows[i + 1 :]):
            return i, out[i + 1 : i + 1 + count]
    raise AssertionError("the old waypoints are not all there")


@modest
@given(paths(), st.floats(0.5, 5).map(lambda v: round(v, 2)), st.floats(0.01, 1.0), st.booleans(), st.floats(-0.5, 0.5))
def test_a_spiral_at_the_goal_is_archimedean(rows, turns, radius, clockwise, height):
    out = spiral(rows, radius=radius, turns=turns, height=height, clockwise=clockwise)
    assert np.array_equal(out[: len(rows), [0, 1, 2, 4]], rows[:, [0, 1, 2, 4]])
    new = out[len(rows) :, :3] - rows[-1, :3]
    distance = np.linalg.norm(new[:, :2], axis=1)
    assert (np.diff(distance) > 0).all()
    assert distance[-1] == pytest.approx(radius) and new[-1, 2] == pytest.approx(height)
    assert np.allclose(new[:, 2], height * distance / radius)
    first = distance[0] / radius * turns
    assert winding(new) == pytest.approx((-1 if clockwise else 1) * (turns - first))
    assert len(new) >= 24 * turns
    assert out[-1, 3] == rows[-1, 3]


def test_a_spiral_on_the_way_goes_on_with_the_path(line):
    out = spiral(line, 10, radius=0.2, turns=2)
    assert np.array_equal(out[:11], line[:11]) and np.array_equal(out[-10:], line[11:])
    new = out[11:-10, :3] - line[10, :3]
    drawn = np.linalg.norm(new, axis=1)
    end = int(np.flatnonzero(np.isclose(drawn, 0.2))[0])
    assert (np.diff(drawn[: end + 1]) > 0).all() and winding(new[: end + 1]) == pytest.approx(2, abs=0.15)
    assert abs(new[:, 2]).max() == 0
    assert sharpest(out) < 45  # it came back in a straight line, and turned by 170 degrees
    assert new[0, 0] > 0
    assert np.linalg.norm(np.diff(out[:, :3], axis=0), axis=1).max() < 0.051
    assert (out[:, 3] == 0.5).all()


def test_a_spiral_after_rest_takes_the_usual_speed_and_comes_to_rest(line):
    line[-1, 3] = 0.0
    out = spiral(line, radius=0.2)
    assert out[20, 3] == 0 and out[-1, 3] == 0
    assert out[45, 3] == 0.5 and (out[21:-1, 3] > 0).all()


@modest
@given(paths(), points, st.integers(1, 3), st.sampled_from([None, 0.05, 0.6]), st.sampled_from([None, True, False]))
def test_a_circle_winds_around_the_object_and_comes_back(rows, point, turns, radius, clockwise):
    ball = SceneObject("ball", point, [0.05, 0.05, 0.05])
    out = circle(rows, ball, radius=radius, turns=turns, clockwise=clockwise)
    nearest = int(np.argmin(ball.distance(rows[:, :3])))
    i, new = inserted(out, rows)
    if i != nearest:  # inside the ring: it begins where the path comes out
        assert np.linalg.norm(rows[nearest, :2] - point[:2]) < (ball.radius + 0.05 if radius is None else radius)
    new = np.concatenate([rows[i : i + 1, :3], new[:, :3]])
    assert np.array_equal(new[-1], rows[i, :3])
    assert np.allclose(new[:, 2], rows[i, 2])
    flat = new[:, :2] - point[:2]
    own = np.linalg.norm(rows[i, :2] - point[:2])
    near = np.linalg.norm(rows[nearest, :2] - point[:2])
    expected = max(near, ball.radius + 0.05) if radius is None else radius
    on_ring = np.isclose(np.linalg.norm(flat, axis=1), expected)
    if own < 1e-6 or np.isclose(own, expected):
        flat = flat[on_ring]
    sign = winding(flat)
    assert abs(sign) == pytest.approx(turns, abs=0.15 if own < 1e-6 else 0.05)
    assert on_ring.sum() >= 0.45 * 24 * turns
    if clockwise is not None:
        assert (sign < 0) == clockwise


def test_a_circle_goes_with_the_heading(line, cup):
    out = circle(line, cup)
    assert out[11, 0] > out[10, 0]
    assert np.linalg.norm(out[10:35, :2] - cup.position[:2], axis=1) == pytest.approx(0.3)
    backwards = circle(line[::-1], cup)
    assert backwards[11, 0] < backwards[10, 0]
    half = circle(line, cup, turns=0.5)
    assert np.array_equal(half[-10:], line[11:]) and sharpest(half) < 45
    assert np.linalg.norm(half[:, :3] - [0.5, 0.6, 0.0], axis=1).min() < 1e-9


def smooth_path(rng, level=True):
    """A path (80, 4) that bends gently, and rises by up to 25 degrees unless it is to be level."""
    u = np.linspace(0.0, 1.0, 80)
    bends = sum(np.outer(np.sin(np.pi * (k + 1) * u + k), rng.normal(0.0, 0.1 / (k + 1), 3)) for k in range(3))
    path = np.outer(u, [np.cos(angle := rng.uniform(0, 7)), np.sin(angle), 0.0]) + bends
    path[:, 2] *= 0.0 if level else 0.3
    return np.column_stack([path * rng.uniform(0.5, 4.0), np.full(80, 0.4)])


def figures(rng, rows):
    """A circle or a spiral somewhere beside a path or on it, as large as it may be."""
    size = float(np.ptp(rows[:, :3], axis=0).max())
    spot = rows[rng.integers(80), :3] + rng.normal(0.0, 0.3 * size, 3) * (rng.random() < 0.8) * [1, 1, 0.2]
    if rng.random() < 0.6:
        radius = None if rng.random() < 0.3 else size * rng.uniform(0.03, 0.4)
        turns = rng.choice([1, 2, 3, 0.5, 1.5, 2.25])
        return circle(rows, spot, radius=radius, turns=float(turns), clockwise=rng.choice([None, True, False]))
    at = rng.choice(["start", "goal", 0.3, 0.7])
    at = at if at in ("start", "goal") else float(at)
    return spiral(
        rows, at, radius=size * rng.uniform(0.03, 0.3), turns=rng.uniform(0.5, 4), clockwise=rng.random() < 0.5
    )


@pytest.mark.parametrize("level", [True, False])
def test_a_figure_is_entered_and_left_without_a_corner(level):
    """Straight lines led to circles and from spirals: 88 to 180 degrees at their ends."""
    turned = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        rows = smooth_path(rng, level)
        turned.append(sharpest(figures(rng, rows)) - sharpest(rows))
    assert max(turned) < (30 if level else 45), int(np.argmax(turned))


def test_a_way_onto_a_circle_from_outside_does_not_cut_into_it():
    for seed in range(60):
        rng = np.random.default_rng(seed)
        rows = smooth_path(rng)
        spot = rows[rng.integers(80), :3] + rng.normal(0.0, 1.0, 3)
        radius = float(np.linalg.norm(rows[:, :2] - spot[:2], axis=1).min() * rng.uniform(0.2, 0.95))
        out = circle(rows, spot, radius=radius, clockwise=rng.choice([None, True, False]))
        assert np.linalg.norm(out[:, :2] - spot[:2], axis=1).min() > 0.96 * radius


def test_a_circle_keeps_clear_of_an_object_on_the_path(line):
    ball = SceneObject("ball", [0.5, 0.0, 0.0], [0.1, 0.1, 0.1])
    _, new = inserted(circle(line, ball, clockwise=True), line)
    away = np.linalg.norm(new[:, :3] - ball.position, axis=1)
    assert away.min() > ball.radius and np.median(away) == pytest.approx(ball.radius + 0.05, abs=0.01)
    # It begins where the path comes out, and draws no loops from the middle to the ring and back.
    assert np.linalg.norm(np.diff(new[:, :3], axis=0), axis=1).sum() < 2.6 * np.pi * (ball.radius + 0.05)
    assert circle(line, [0.5, 0.0, 0.0]).shape[0] > 40


@modest
@given(paths(), st.floats(0, 1), st.floats(0.05, 1.0))
def test_a_figure_eight_has_two_lobes_and_ends_where_it_began(rows, at, size):
    out = figure_eight(rows, at, size=size)
    i, new = inserted(out, rows)
    new = np.concatenate([rows[i : i + 1], new])[:, :3]
    assert np.array_equal(new[-1], new[0])
    assert abs(new[:, 2] - new[0, 2]).max() < 1e-12
    flat = new[:, :2] - new[0, :2]
    half = len(flat) // 2 + 1
    area = [cross(lobe[:-1], lobe[1:]).sum() / 2 for lobe in (flat[:half], flat[half - 1 :])]
    assert area[0] == pytest.approx(-area[1], rel=0.02) and abs(area[0]) > 0.1 * size**2
    assert np.linalg.norm(flat, axis=1).max() == pytest.approx(size / 2, rel=0.01)


def cross(a, b):
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def test_a_figure_eight_keeps_the_heading(line):
    out = figure_eight(line, 10, size=0.4)
    for a, b in ((10, 11), (-12, -11)):
        step = out[b, :3] - out[a, :3]
        assert step[0] > 5 * abs(step[1])


def swings(offset):
    """Number of extrema of a displacement."""
    turning = np.sign(np.diff(offset))
    turning = turning[turning != 0]
    return int((np.diff(turning) != 0).sum())


@pytest.mark.parametrize("operation", [zigzag, wave])
@pytest.mark.parametrize("waves", [0.5, 1, 3, 6, 11])
@pytest.mark.parametrize("n", [3, 21, 200])
def test_a_ripple_swings_exactly_to_both_sides(operation, waves, n):
    rows = np.column_stack([np.linspace(0, 2, n), np.zeros((n, 2)), np.full(n, 0.5), np.arange(n)])
    out = operation(rows, 0.1, waves=waves)
    assert np.array_equal(out[[0, -1]], rows[[0, -1]])
    assert np.allclose(out[:, 2], 0)
    assert swings(out[:, 1]) == 2 * waves
    assert out[:, 1].min() == pytest.approx(-0.1)
    if waves > 0.5:
        assert out[:, 1].max() == pytest.approx(0.1)
    assert out[1, 1] < 0
    if n == 200:
        assert np.array_equal(np.delete(out, 1, 1), np.delete(rows, 1, 1))
    assert set(rows[:, 0]) <= set(out[:, 0])


@modest
@given(paths_and_masks(extra=2), amounts, amounts, st.sampled_from([zigzag, wave]))
def test_ripples_leave_the_rest_and_grow_with_the_amplitude(drawn, a, b, operation):
    rows, mask = drawn
    small, large = (operation(rows, amplitude, where=mask, waves=1.5) for amplitude in sorted((a, b)))
    kept = {tuple(row) for row in large}
    assert all(tuple(row) in kept for row in rows[~mask])
    if len(small) == len(large) == len(rows):
        for out, amplitude in ((small, min(a, b)), (large, max(a, b))):
            away = np.linalg.norm((out - rows)[:, :3], axis=1)
            assert (away <= amplitude + 1e-9).all() and not away[~mask].any()
        assert (
            np.linalg.norm((small - rows)[:, :3], axis=1) <= np.linalg.norm((large - rows)[:, :3], axis=1) + 1e-9
        ).all()


@pytest.mark.parametrize(
    ("frame", "up", "right"),
    [("rfu", [0, 0, 1], [0, -1, 0]), ("flu", [0, 0, 1], [0, -1, 0]), ("ned", [0, 0, -1], [0, 1, 0])],
)
def test_ripples_follow_the_words_of_the_scene(line, frame, up, right):
    lifted = zigzag(line, 0.1, waves=1, direction="up", frame=Frame(frame)) - line
    assert np.allclose(lifted[5, :3], 0.1 * np.array(up))
    aside = wave(line, 0.1, waves=1, frame=Frame(frame)) - line
    assert np.allclose(aside[5, :3], 0.1 * np.array(right))


def test_a_dwell_stays_a_dwell(line):
    rows = np.insert(line, 7, np.repeat(line[7:8], 5, axis=0), axis=0)
    for out in (zigzag(rows, 0.1, waves=2), wave(rows, 0.1, waves=1), noise(rows, 0.1)):
        assert len(np.unique(out[7:13, :3], axis=0)) == 1


@modest
@given(paths(smallest=4), st.floats(0, 0.5), st.floats(0, 0.5), st.sampled_from([0.0, 0.1, 0.4]))
def test_a_jump_reaches_its_height_and_never_goes_below(rows, a, b, width):
    low, high = (hop(rows, BALL, height, width=width) for height in sorted((a, b)))
    for out, height in ((low, min(a, b)), (high, max(a, b))):
        above = np.linalg.norm(out[:, :2] - BALL.position[:2], axis=1) < 1e-9
        if np.unique(rows[:, :3], axis=0).shape[0] > 2:
            assert above.any()
            assert out[above, 2].max() >= 0.05 + height - 1e-9
    assert (high[:, 2] >= low[:, 2] - 1e-9).all()


def test_a_jump_is_highest_above_the_object_and_local(line, cup):
    out = hop(line, cup, 0.1, width=0.2)
    assert len(out) == 21
    assert out[:, 2].max() == pytest.approx(0.15) and np.allclose(out[10, :3], [0.5, 0.3, 0.15])
    assert np.allclose(out[:, 2], out[::-1, 2]) and (np.diff(out[:11, 2]) >= 0).all()
    assert np.array_equal(out[:5], line[:5]) and np.array_equal(out[-5:], line[-5:])
    assert hop(line, cup.position, 0.1)[:, 2].max() == pytest.approx(0.1)
    level = np.linalg.norm(out[:, :2] - cup.position[:2], axis=1) <= cup.radius + 1e-9
    assert np.allclose(out[level, 2], 0.15)
    above = np.add(line, [0, 0, 1, 0])
    assert (hop(above, cup, 0.1)[:, 2] == 1).all()
    assert hop(line, cup, 0.1, frame=Frame("ned"))[10, 2] == pytest.approx(-0.15)


@pytest.mark.parametrize("name", ["cup", "bottle", "box"])
@pytest.mark.parametrize("height", [0.05, 0.1, 0.2])
def test_a_jump_beside_an_end_of_the_path_clears_its_height(name, height):
    """Over the cup of the shipped scene, beside the path's start, it had cleared 0.085 of 0.1 m."""
    task = ov.load(files("ovita") / "data" / "tabletop.json")
    rows, item = task.trajectory.to_array(), task.scene[name]
    out = hop(rows, item, height, frame=task.scene.frame)
    outcome = judge(expect_side("above", height, of=item, within=0.02), rows, out, task.scene)
    assert outcome.held, outcome.sentence
    assert np.array_equal(out[[0, -1]], rows[[0, -1]])


def test_a_jump_of_sparse_waypoints_inserts_some(line, cup):
    out = hop(line[[0, 20]], cup, 0.1)
    assert len(out) > 10 and out[:, 2].max() == pytest.approx(0.15)
    assert np.array_equal(out[[0, -1]], line[[0, 20]])


@modest
@given(paths(smallest=5), points, st.floats(-0.5, 0.5), st.integers(1, 20))
def test_hovering_waits_exactly_there(rows, point, height, steps):
    out = hover(rows, point, height, steps=steps)
    there = (np.abs(out[:, :3] - np.add(point, [0, 0, height])) < 1e-12).all(axis=1) & (out[:, 3] == 0)
    assert there.sum() >= steps + 1
    assert len(out) == len(rows) + steps


def test_hovering_waits_its_time_and_touches_only_at_no_height(line, cup):
    recorder = Recorder()
    assert Trajectory.from_array(hover(line, cup, 0.2, steps=8, recorder=recorder)).durations[
        10:18
    ].sum() == pytest.approx(0.8)
    assert recorder.contacts == []
    hover(line, cup, 0, recorder=recorder)
    assert recorder.contacts == ["cup"]


@modest
@given(paths_and_masks(), amounts, amounts, st.integers(0, 5))
def test_noise_is_bounded_repeatable_and_linear(drawn, a, b, seed):
    rows, mask = drawn
    out = noise(rows, a, seed=seed, where=mask)
    shift = (out - rows)[:, :3]
    assert np.array_equal(out[~mask], rows[~mask]) and np.array_equal(out[:, 3:], rows[:, 3:])
    assert (np.linalg.norm(shift, axis=1) <= a + 1e-9).all()
    assert np.array_equal(out, noise(rows, a, seed=seed, where=mask))
    assert np.allclose(b * shift, a * (noise(rows, b, seed=seed, where=mask) - rows)[:, :3])


def test_noise_differs_by_seed_and_is_no_bias(line):
    assert not np.array_equal(noise(line, 0.1), noise(line, 0.1, seed=1))
    many = np.column_stack([np.linspace(0, 1, 3000), np.zeros((3000, 2)), np.ones(3000)])
    shift = (noise(many, 0.1) - many)[:, :3]
    assert np.abs(shift.mean(axis=0)).max() < 0.005
    assert np.linalg.norm(shift, axis=1).mean() == pytest.approx(0.075, rel=0.05)


def test_a_path_without_length_still_has_patterns():
    rows = np.tile([0.1, 0.2, 0.3, 0.0], (4, 1))
    assert len(circle(rows, BALL)) >= 28
    assert np.linalg.norm(spiral(rows, radius=0.2)[-1, :3] - rows[0, :3]) == pytest.approx(0.2)
    assert np.array_equal(zigzag(rows, 0.1), rows)


def test_the_height_of_a_jump_is_measured_from_a_turned_top(line):
    s = np.sqrt(0.5)
    lying = SceneObject("bar", [0.5, 0, 0], [0.4, 0.02, 0.02], [s, 0, s, 0])
    assert hop(line, lying, 0.1)[:, 2].max() == pytest.approx(0.3)


@pytest.mark.parametrize("clockwise", [False, True])
def test_a_corkscrew_winds_around_its_part_of_the_path_alone(line, clockwise):
    half = np.arange(len(line)) >= len(line) // 2
    out = corkscrew(line, 0.05, turns=3, where=half, clockwise=clockwise)
    old = line[:, :3]
    assert np.array_equal(out[: len(line) // 2], line[: len(line) // 2]) and np.allclose(out[-1, :3], old[-1])
    along = (old[-1] - old[0]) / np.linalg.norm(old[-1] - old[0])
    off = (out[:, :3] - old[0]) - ((out[:, :3] - old[0]) @ along)[:, None] * along
    assert np.linalg.norm(off, axis=1).max() == pytest.approx(0.05, rel=0.02)
    wound = np.flatnonzero(np.linalg.norm(off, axis=1) > 1e-3)
    a, b = off[wound][:-1], off[wound][1:]
    angle = np.arctan2(np.cross(a, b) @ along, (a * b).sum(axis=1)).sum() / (2 * np.pi)
    assert abs(angle) == pytest.approx(3.0, abs=0.5) and (angle > 0) == clockwise


def test_a_corkscrew_goes_round_what_goes_straight_down():
    drop = np.column_stack([np.zeros(20), np.zeros(20), np.linspace(1.0, 0.0, 20), np.full(20, 0.1)])
    out = corkscrew(drop, 0.1, turns=2)
    assert np.linalg.norm(out[:, :2], axis=1).max() == pytest.approx(0.1, rel=0.02)
    assert np.allclose(out[[0, -1]], drop[[0, -1]]) and (np.diff(out[:, 2]) < 0).all()


def test_a_circle_before_the_goal_comes_to_rest_at_the_goal_alone():
    rows = np.column_stack([np.linspace(0.0, 1.0, 11), np.zeros(11), np.zeros(11), np.full(11, 0.3)])
    rows[-2:, 3] = 0.1, 0.0
    around = circle(rows, SceneObject("dome", [0.9, 0.2, 0.0]))
    assert around[-1, 3] == 0.0 and (around[:-1, 3] > 0.0).all()
