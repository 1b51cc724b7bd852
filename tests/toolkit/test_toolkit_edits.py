import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from toolkit_paths import amounts, bending, distances, modest, paths, paths_and_masks, points, shares, words

from ovita.paths.geometry import closest_to_point, is_level, turning_angles
from ovita.paths.robot import Robot
from ovita.paths.scene import RFU, Frame, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.toolkit import (
    closer,
    continue_to,
    extend,
    farther,
    go_through,
    keep_distance,
    midpoint,
    move,
    move_goal,
    move_start,
    pass_at,
    resample,
    smooth,
    stop_before,
)
from ovita.toolkit.approach import passes_at

BALL = SceneObject("ball", [0.5, 0.02, 0.0], [0.1, 0.1, 0.1])

SAME_COUNT = {
    "move": lambda t: move(t, left=0.2, up=-0.1, keep="both"),
    "move_start": lambda t: move_start(t, BALL),
    "move_goal": lambda t: move_goal(t, up=0.3),
    "closer": lambda t: closer(t, BALL, 0.1),
    "farther": lambda t: farther(t, BALL, 0.1),
    "times": lambda t: farther(t, BALL, times=2),
    "keep_distance": lambda t: keep_distance(t, BALL, 0.2, 2.0),
    "smooth": lambda t: smooth(t, 2.0),
}
LONGER = {
    "extend": lambda t: extend(t, left=0.4),
    "continue_to": lambda t: continue_to(t, BALL),
}


@modest
@given(paths(extra=2), st.sampled_from(sorted({**SAME_COUNT, **LONGER})))
def test_every_edit_returns_a_finite_new_array_and_carries_extra_columns(rows, name):
    before = rows.copy()
    rows.flags.writeable = False
    out = {**SAME_COUNT, **LONGER}[name](rows)
    assert np.array_equal(rows, before)
    assert not np.shares_memory(out, rows)
    assert np.isfinite(out).all()
    assert out.shape[1] == 6
    assert np.array_equal(out[: len(rows), 4:], rows[:, 4:])
    assert np.array_equal(out[: len(rows), 3], rows[:, 3])
    Trajectory.from_array(out[:, :4])
    if name in SAME_COUNT:
        assert len(out) == len(rows)
    else:
        assert np.array_equal(out[: len(rows)], rows)


@modest
@given(paths_and_masks(), words, amounts, shares)
def test_move_leaves_the_rest_bit_identical_and_never_overshoots(drawn, word, amount, ease):
    rows, mask = drawn
    out = move(rows, **{word: amount}, where=mask, ease=ease)
    assert np.array_equal(out[~mask], rows[~mask])
    along = (out - rows)[:, :3] @ RFU.direction(word)
    assert (along >= 0).all() and (along <= amount + 1e-9).all()
    if ease == 0:
        assert np.array_equal(out[mask, :3], rows[mask, :3] + amount * RFU.direction(word))


@pytest.mark.parametrize(("keep", "fixed"), [("start", [0]), ("goal", [20]), ("both", [0, 20]), (None, [])])
def test_move_keeps_ends(line, keep, fixed):
    out = move(line, left=0.2, keep=keep)
    moved = [i for i in (0, 20) if i not in fixed]
    assert np.array_equal(out[fixed], line[fixed])
    assert (out[moved, 0] == line[moved, 0] - 0.2).all()
    assert out[10, 0] == line[10, 0] - 0.2


def test_the_ramp_of_move_lies_inside_the_mask_and_reaches_the_full_shift(line):
    mask = np.zeros(21, dtype=bool)
    mask[5:16] = True
    lift = move(line, up=1.0, where=mask, ease=0.2)[:, 2]
    assert (lift[~mask] == 0).all()
    assert 0 < lift[5] < lift[6] < lift[7] < 1 and lift[10] == 1
    mask[:] = False
    mask[7] = True
    assert move(line, up=1.0, where=mask, ease=0.5)[7, 2] == 1
    mask[:8] = True
    assert (move(line, up=1.0, where=mask, ease=0.1)[:4, 2] == 1).all()


@pytest.mark.parametrize(
    ("frame", "left", "front", "up"),
    [
        ("rfu", [-1, 0, 0], [0, 1, 0], [0, 0, 1]),
        ("flu", [0, 1, 0], [1, 0, 0], [0, 0, 1]),
        ("ned", [0, -1, 0], [1, 0, 0], [0, 0, -1]),
    ],
)
def test_direction_words_follow_the_frame_in_every_function(line, frame, left, front, up):
    line[:, 1] = np.linspace(0.0, 0.3, 21)
    shift = 0.1 * np.array(left) + 0.2 * np.array(front) + 0.3 * np.array(up)
    words = {"left": 0.1, "back": -0.2, "up": 0.3, "frame": Frame(frame)}
    assert np.allclose((move(line, **words) - line)[:, :3], shift)
    assert np.allclose((move_start(line, **words) - line)[0, :3], shift)
    assert np.allclose((move_goal(line, **words) - line)[-1, :3], shift)
    assert np.allclose(extend(line, **words)[-1, :3] - line[-1, :3], shift)
    assert np.allclose(continue_to(line, [2, 0, 0], **words)[-1, :3], np.add([2, 0, 0], shift))
    out = go_through(line, [0.5, 0, 0], **words)
    assert distances(out, np.add([0.5, 0, 0], shift)).min() < 1e-12


@modest
@given(paths(), points, shares)
def test_an_end_moves_exactly_and_the_other_stays(rows, point, blend):
    out = move_goal(rows, point, blend=blend)
    assert np.array_equal(out[-1, :3], point)
    assert np.array_equal(out[0], rows[0])
    if blend == 0:
        assert np.array_equal(out[:-1], rows[:-1])
    mirrored = move_start(rows[::-1], point, blend=blend)
    assert np.allclose(mirrored[::-1], out)
    assert np.array_equal(mirrored[-1], rows[0])


def test_an_end_moves_to_an_object_plus_an_offset(line, cup):
    assert np.array_equal(move_goal(line, cup)[-1, :3], cup.position)
    assert np.allclose(move_goal(line, cup, up=0.1, right=0.2)[-1, :3], np.add(cup.position, [0.2, 0, 0.1]))
    assert np.allclose(move_start(line, cup, up=0.1)[0, :3], np.add(cup.position, [0, 0, 0.1]))
    share = move_goal(line, back=1.0, blend=0.5)[:, 1]
    assert (share[:11] == 0).all() and (np.diff(share) <= 0).all()


@modest
@given(paths_and_masks(), points, amounts, amounts)
def test_closer_never_goes_away_and_more_is_more(drawn, point, a, b):
    rows, mask = drawn
    d = distances(rows, point)
    less, more = (distances(closer(rows, point, by, where=mask, ease=0), point) for by in sorted((a, b)))
    assert (less <= d + 1e-12).all() and (more <= less + 1e-12).all()
    assert np.array_equal(closer(rows, point, a, where=mask, ease=0)[~mask], rows[~mask])
    assert np.array_equal(closer(rows, point, 0.0), rows)
    if mask.any():
        nearest = np.flatnonzero(mask)[np.argmin(d[mask])]
        assert more[nearest] == pytest.approx(max(d[nearest] - max(a, b), 0.0), abs=1e-9)


@modest
@given(paths_and_masks(), points, amounts, amounts)
def test_farther_never_comes_near_and_more_is_more(drawn, point, a, b):
    rows, mask = drawn
    d = distances(rows, point)
    far = distances(farther(rows, point, a, where=mask, ease=0), point)
    assert (far >= d - 1e-9).all()
    assert np.array_equal(farther(rows, point, a, where=mask, ease=0)[~mask], rows[~mask])
    assert np.allclose(distances(farther(rows, point, times=1 + a), point), (1 + a) * d)


def test_closer_stops_before_the_surface_and_keeps_what_is_out_of_reach(line, cup):
    out = closer(line, cup, 5.0, reach=0.05)
    assert cup.cuboid.closest(out[:, :3])[0] == pytest.approx(Robot().obstacle_margin, abs=1e-3)
    assert cup.cuboid.closest(closer(line, cup, 5.0, gap=0.1)[:, :3])[0] >= 0.1 - 1e-9
    assert np.array_equal(out[:4], line[:4])
    assert np.allclose(closer(out, cup, 1.0, reach=1e-6)[10], out[10], atol=1e-9)


@pytest.mark.parametrize("aside", [0.015, 0.023, 0.04, 0.054, 0.2])
def test_an_assumed_size_leaves_room_to_come_closer(line, aside):
    thing = SceneObject("panda", np.array([0.5, aside, 0.0]))
    for _ in range(3):
        before = closest_to_point(line[:, :3], thing.position)[0]
        line = closer(line, thing, 0.3)
        assert Robot().obstacle_margin < closest_to_point(line[:, :3], thing.position)[0] < before - (before - 0.01) / 3


@modest
@given(paths(smallest=3), points, st.floats(0.02, 1.0), st.floats(0.0, 1.0))
def test_closer_never_comes_into_an_object_between_waypoints(rows, point, size, by):
    table = SceneObject("table", point, [size, size, 0.05], [0.9, 0.1, 0.3, 0.2])
    before, after = (table.cuboid.along(r[:-1, :3], r[1:, :3])[0] for r in (rows, closer(rows, table, by)))
    assert (after >= np.minimum(before, Robot().obstacle_margin) - 1e-6).all()


@modest
@given(paths(), points, st.floats(0.05, 0.6), st.sampled_from(["closer", "farther", "times", "keep", "both"]))
def test_a_level_path_stays_level(rows, point, amount, name):
    """Keeping away from a chair once lifted a rover off the floor."""
    rows[:, 2] = 0.0
    out = {
        "closer": lambda: closer(rows, point, amount),
        "farther": lambda: farther(rows, point, amount),
        "times": lambda: farther(rows, point, times=1 + amount),
        "keep": lambda: keep_distance(rows, point, amount),
        "both": lambda: keep_distance(rows, [point, [0.5, 0.4, 0.1]], amount),
    }[name]()
    if name != "closer" or distances(rows, point).min() - amount >= abs(point[2]):
        assert np.abs(out[:, 2]).max() < 1e-12
    if name in ("keep", "both"):
        assert closest_to_point(out[:, :3], point)[0] >= amount * (1 - 1e-6)


def test_a_waypoint_at_the_centre_is_pushed_sideways(line):
    push = farther(line, line[10, :3], 0.2, reach=0.01)[10, :3] - line[10, :3]
    assert 0.2 <= np.linalg.norm(push) < 0.26
    assert push[2] == 0 and abs(push[1]) > 5 * abs(push[0])


@modest
@given(paths_and_masks(), points, st.floats(0.05, 0.4), st.floats(0.01, 0.3))
def test_keep_distance_keeps_it_from_the_surface(drawn, point, at_least, size):
    rows, mask = drawn
    repeats = (rows[1:, :3] == rows[:-1, :3]).all(axis=1)
    for i in np.flatnonzero(repeats):  # of a dwell, all or nothing moves
        mask[i + 1] = mask[i]
    ball = SceneObject("ball", point, [size] * 3)
    out = keep_distance(rows, ball, at_least, where=mask, ease=0)
    if not mask.any() or passes_at(ball, rows[:, :3], mask) >= at_least:
        assert np.array_equal(out, rows)
        return
    assert passes_at(ball, out[:, :3], mask) >= at_least - 1e-6


BOXES = {
    "cube": ([0.5, 0.03, 0.0], [0.1, 0.1, 0.1], 0.15),
    "long": ([0.5, 0.05, 0.0], [0.5, 0.1, 0.1], 0.08),
    "high": ([0.5, -0.02, 0.1], [0.1, 0.1, 0.6], 0.1),
    "flat": ([0.5, 0.0, -0.05], [0.2, 0.2, 0.02], 0.1),
    "not reached": ([0.5, 0.15, 0.0], [0.1, 0.1, 0.1], 0.2),
    "a point": ([0.5, 0.02, 0.0], None, 0.15),
}


@pytest.mark.parametrize(("at", "size", "asked"), BOXES.values(), ids=BOXES)
@pytest.mark.parametrize("level", [True, False])
def test_no_more_than_the_distance_is_kept_and_without_a_corner(at, size, asked, level):
    """15 cm from a cup came out as 22 cm, as a bounding sphere was passed, and with a corner at either end."""
    x = np.linspace(-1.0, 2.0, 121)
    rows = np.column_stack([x, 0.02 * x, 0.0 * x if level else 0.1 * x - 0.05, 0.0 * x + 0.5])
    item = SceneObject("item", at, size)
    out = keep_distance(rows, item, asked)
    assert passes_at(item, out[:, :3], np.ones(len(x), dtype=bool)) == pytest.approx(asked, abs=1e-3)
    assert np.degrees(turning_angles(out[:, :3]).max()) < 15
    assert np.array_equal(out[[0, -1]], rows[[0, -1]]) and np.array_equal(out[:, 3], rows[:, 3])
    assert not level or np.array_equal(out[:, 2], rows[:, 2])


@pytest.mark.parametrize("length", [4.3, 4.6, 5.0])
@pytest.mark.parametrize("count", [25, 50])
def test_a_long_way_around_between_near_ends_has_no_corner_and_throws_no_end_away(length, count):
    """Two metres from a box turned by up to 180 degrees where the ends are near; one 5 cm too near went 6 m off."""
    x = np.linspace(-length / 2, length / 2, count)
    rows = np.column_stack([x, 0.02 * x, 0.0 * x, 0.0 * x + 0.5])
    item = SceneObject("item", [0.1, 0.05, 0.0], [0.2, 0.2, 0.2])
    out = keep_distance(rows, item, 2.0)
    assert passes_at(item, out[:, :3], np.ones(count, dtype=bool)) == pytest.approx(2.0, abs=2e-3)
    assert np.degrees(turning_angles(out[:, :3]).max()) < 20
    assert np.linalg.norm(out[[0, -1], :3] - rows[[0, -1], :3], axis=1).max() < 0.11
    assert not out[:, 2].any() and np.array_equal(out[:, 3], rows[:, 3])


def test_a_distance_that_is_kept_already_moves_nothing(line):
    """A long table's bounding sphere reached the path, which was bent although it kept the distance."""
    table = SceneObject("table", [0.5, 0.6, 0.0], [2.0, 0.4, 0.1])
    assert np.array_equal(keep_distance(line, table, 0.35), line)
    assert np.array_equal(keep_distance(line, [table, SceneObject("far", [9, 9, 9], [1, 1, 1])], 0.35), line)
    assert keep_distance(line, table, 0.45)[:, 1].min() < 0


@modest
@given(paths(smallest=4), points, st.floats(0.03, 1.0), st.one_of(st.none(), st.floats(0.02, 0.3)))
def test_an_object_is_passed_at_just_the_distance_asked_for(rows, point, distance, size):
    ball = SceneObject("ball", point, None if size is None else [size, 2 * size, size])
    everywhere = np.ones(len(rows), dtype=bool)
    now = passes_at(ball, rows[:, :3], everywhere)
    out = pass_at(rows, ball, distance)
    if is_level(rows[:, :3], np.array([0.0, 0.0, 1.0])) or (size is None and now > distance):
        return  # a level path stays level; without dimensions a cube is kept out of
    assert passes_at(ball, out[:, :3], everywhere) == pytest.approx(distance, abs=2e-3)
    assert np.array_equal(pass_at(out, ball, float(passes_at(ball, out[:, :3], everywhere))), out)


def test_coming_within_a_distance_moves_the_nearest_stretch_only(line):
    out = pass_at(np.repeat(line, 1, axis=0), [0.5, 0.4, 0.0], 0.15)
    assert np.array_equal(out[[0, -1]], line[[0, -1]]) and out[10, 1] == pytest.approx(0.25)
    assert pass_at(line, [0.5, 0.1, 0.0], 0.3)[:, 1].min() < -0.15


def test_keep_distance_bulges_to_the_side_where_the_path_already_is(line):
    centre = np.array([0.5, 0.01, 0.0])
    out = keep_distance(line, centre, 0.3)
    assert (out[:, 1] <= 0).all() and -0.292 < out[10, 1] <= -0.29
    assert np.array_equal(out[:, 2:], line[:, 2:])
    straight = keep_distance(line, [0.5, 0, 0], 0.3)
    assert np.abs(straight[:, 2]).max() == 0 and np.ptp(np.sign(straight[:, 1])) == 1


def test_keep_distance_from_several_objects_leaves_all_their_spheres(line):
    centres = [[0.4, 0.05, 0.0], [0.6, -0.05, 0.0], [0.5, 0.1, 0.1]]
    out = keep_distance(line, centres, 0.2)
    for centre in centres:
        assert closest_to_point(out[:, :3], centre)[0] >= 0.2 - 1e-6
    assert np.array_equal(out[[0, -1]], line[[0, -1]])
    assert np.array_equal(keep_distance(line, [centres[0]], 0.2), keep_distance(line, centres[0], 0.2))


def test_keep_distance_clears_a_segment_that_jumps_across(line):
    sparse = line[::10]
    out = keep_distance(sparse, [0.25, 0.05, 0.0], 0.1)
    assert closest_to_point(out[:, :3], [0.25, 0.05, 0.0])[0] >= 0.1 - 1e-6
    assert np.array_equal(out[[0, 2]], sparse[[0, 2]])


@modest
@given(paths(), points, st.floats(0.1, 1.0))
def test_at_most_pulls_in(rows, point, at_most):
    d = distances(rows, point)
    out = keep_distance(rows, point, at_most=at_most)
    assert np.allclose(distances(out, point), np.minimum(d, at_most))
    assert np.array_equal(out[d <= at_most], rows[d <= at_most])


@modest
@given(paths(smallest=3), points, shares)
def test_go_through_visits_and_keeps_the_ends(rows, point, width):
    assume(len(np.unique(rows[:, :3], axis=0)) != 2)
    out = go_through(rows, point, width=width)
    assert distances(out, point).min() == 0
    assert np.array_equal(out[[0, -1]], rows[[0, -1]])


def test_go_through_leaves_what_is_outside_the_window(line):
    out = go_through(line, [0.5, 0.2, 0.0], width=0.2)
    assert np.array_equal(out[:7], line[:7]) and np.array_equal(out[14:], line[14:])
    assert np.array_equal(out[10, :3], [0.5, 0.2, 0.0])


def test_extend_goes_on_in_the_final_heading(line):
    line[-1, 3] = 0.0
    out = extend(line, 0.5)
    assert np.allclose(out[-1, :3], [1.5, 0, 0])
    assert len(out) == 31
    assert np.allclose(np.diff(out[:, 0]), 0.05)
    assert out[-1, 3] == 0 and out[25, 3] == 0.5
    assert np.array_equal(extend(line, 0.0), line)


@modest
@given(paths(), points, st.booleans())
def test_continue_to_arrives(rows, point, smoothly):
    out = continue_to(rows, point, smooth=smoothly)
    assert np.allclose(out[-1, :3], point, atol=1e-12)
    assert out[-1, 3] == rows[-1, 3]
    assert (out[:, 3] >= 0).all()


def test_continue_to_starts_with_the_final_heading(line):
    out = continue_to(line, [1.5, 0.5, 0.0])
    first = out[21, :3] - out[20, :3]
    assert first[0] > 5 * abs(first[1])
    straight = continue_to(line, [1.5, 0.5, 0.0], smooth=False)
    assert np.allclose(straight[21:, 0] - 1.0, straight[21:, 1])


@modest
@given(paths(smallest=3), st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_more_smoothing_bends_less(rows, a, b):
    less, more = (smooth(rows, s) for s in sorted((a, b)))
    dwell = (np.diff(rows[:, :3], axis=0) == 0).all(axis=1)
    if not dwell.any():
        assert bending(more) <= bending(less) + 1e-12
    assert (np.diff(more[:, :3], axis=0)[dwell] == 0).all()
    assert np.array_equal(more[[0, -1]], rows[[0, -1]])
    assert np.array_equal(smooth(rows, 0), rows)


@modest
@given(paths(smallest=3), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.1, 100.0))
def test_smoothing_a_part_bends_no_more_anywhere_and_leaves_the_rest(rows, a, b, strength):
    rows = rows[np.r_[True, (np.diff(rows[:, :3], axis=0) != 0.0).any(axis=1)]]
    n = len(rows)
    first, last = sorted((round(a * (n - 1)), round(b * (n - 1))))
    part = (np.arange(n) >= first) & (np.arange(n) <= last)
    assume(n >= 3 and not part.all())
    smoothed = smooth(rows, strength, where=part)
    beside = max((last - first + 1) // 4, 2)
    rest = (np.arange(n) < first - beside) | (np.arange(n) > last + beside)
    assert np.array_equal(smoothed[rest], rows[rest])
    assert np.array_equal(smoothed[[0, -1]], rows[[0, -1]])
    before, after = (float((np.diff(p[:, :3], 2, axis=0) ** 2).sum()) for p in (rows, smoothed))
    assert after <= before * (1.0 + 1e-9) + 1e-9


@modest
@given(paths(), st.integers(2, 60), st.sampled_from(["arc_length", "index"]))
def test_resample_keeps_ends_and_counts(rows, n, by):
    out = resample(rows, n, by)
    assert out.shape == (n, rows.shape[1])
    assert np.array_equal(out[[0, -1]], rows[[0, -1]])


def test_midpoint(cup):
    assert np.allclose(midpoint(cup, [0.0, 0.0, 1.0]), [0.25, 0.15, 0.5])


def test_keep_distance_does_not_jump_across_when_the_path_turns_inside_the_sphere():
    along = np.linspace(-0.5, 0.0, 26)[:, None]
    corner = np.concatenate([along * [1, 0, 0], along[-2::-1] * [0, 1, 0]])
    corner += [0.02, 0.05, 0]
    rows = np.column_stack([corner, np.ones(len(corner))])
    out = keep_distance(rows, [0.0, 0.0, 0.0], 0.2)
    assert distances((out[1:] + out[:-1]) / 2, np.zeros(3)).min() > 0.19
    assert np.linalg.norm(np.diff(out[:, :3], axis=0), axis=1).max() < 0.15


@modest
@given(paths(), points, amounts)
def test_farther_moves_the_nearest_distance_by_the_full_amount(rows, point, by):
    before, after = (closest_to_point(r[:, :3], point)[0] for r in (rows, farther(rows, point, by)))
    assert after >= (before + by) * (1 - 1e-6)


@pytest.mark.parametrize(
    "operation", [lambda t, o, **k: closer(t, o, 0.1, **k), lambda t, o, **k: farther(t, o, 0.1, **k)]
)
def test_approach_can_hold_a_direction(line, operation):
    above = [0.5, 0.3, 0.4]
    out = operation(line, above, hold="up")
    assert np.array_equal(out[:, 2], line[:, 2]) and not np.array_equal(out, line)
    assert np.array_equal(operation(line, above, hold=["up", "front", "left"]), line)
    before, after = distances(line, above), distances(out, above)
    toward = operation(line, above)
    assert (np.sign((after - before).round(12)) == np.sign((distances(toward, above) - before).round(12))).all()
    with pytest.raises(ValueError, match="direction"):
        operation(line, above, hold="sideways")


@given(paths(), st.floats(0.05, 0.4))
def test_stop_before_ends_where_the_path_first_comes_so_near(rows, distance):
    thing = SceneObject("thing", rows[-1, :3] + [0.3, 0.1, 0.0], [0.1, 0.1, 0.1])
    assume(np.linalg.norm(rows[0, :3] - thing.position) > distance + 0.1)
    stopped = stop_before(rows, thing, distance)
    everywhere = np.ones(len(stopped), dtype=bool)
    assert passes_at(thing, stopped[:, :3], everywhere) == pytest.approx(distance, abs=2e-3)
    assert passes_at(thing, stopped[-1:, :3], np.ones(1, dtype=bool)) == pytest.approx(distance, abs=2e-3)
    assert stopped[-1, 3] == 0.0


def test_stop_before_a_thing_that_the_path_leads_to_keeps_the_path(line):
    thing = SceneObject("thing", line[-1, :3], [0.1, 0.1, 0.1])
    stopped = stop_before(line, thing, 0.2)
    np.testing.assert_allclose(stopped[:-1, :3], line[: len(stopped) - 1, :3])
    with pytest.raises(ValueError, match="starts within"):
        stop_before(line, SceneObject("here", line[0, :3], [0.1, 0.1, 0.1]), 0.2)


@given(st.floats(0.01, 0.5))
def test_extend_by_less_than_nothing_goes_back_along_the_path(share):
    bend = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [1, 1, 0, 1]], dtype=float)
    back = extend(resample(bend, 21), -2.0 * share)
    ends = [1.0, 1.0 - 2.0 * share, 0.0] if share <= 0.5 else None
    np.testing.assert_allclose(back[-1, :3], ends, atol=1e-9)
    np.testing.assert_allclose(back[20, :], [1, 1, 0, 0], atol=1e-9)
    assert back[-1, 3] == 0.0


def test_what_is_pushed_away_is_the_nearest_part_and_the_ends_stay():
    x = np.linspace(0.0, 10.0, 101)
    rows = np.column_stack([x, np.zeros(101), np.ones(101), np.full(101, 0.5)])
    out = farther(rows, [4.0, 0.5, 1.0], 0.3)
    shift = np.linalg.norm(out[:, :3] - rows[:, :3], axis=1)
    assert np.isclose(shift.max(), 0.3, atol=0.01) and shift[0] == shift[-1] == 0.0
    assert (shift[x > 7.0] == 0.0).all() and 3.5 < x[shift.argmax()] < 4.5


def test_an_end_that_is_the_nearest_part_goes_away_too():
    x = np.linspace(0.0, 1.0, 21)
    rows = np.column_stack([x, np.zeros(21), np.zeros(21), np.full(21, 0.5)])
    assert np.isclose(farther(rows, [1.1, 0.0, 0.0], 0.1)[-1, 0], 0.9)


@pytest.mark.parametrize("operation", [lambda t, o: keep_distance(t, o, at_least=0.3), lambda t, o: farther(t, o, 0.2)])
def test_the_repeats_of_a_stop_stay_together_where_the_path_is_bent_away(operation):
    x = np.linspace(0.0, 1.0, 41)
    rows = np.insert(np.column_stack([x, 0 * x, 0 * x, np.full(41, 0.5)]), 20, [[0.5, 0.0, 0.0, 0.0]] * 3, axis=0)
    out = operation(rows, SceneObject("cup", [0.52, 0.05, 0.0], [0.1] * 3))
    assert (out[20:24, :3] == out[20, :3]).all() and not np.allclose(out[20, :3], rows[20, :3])


def test_a_path_on_the_floor_passes_a_tall_thing_at_its_own_height():
    door = SceneObject("door", [2.0, 1.5, 1.0], [0.9, 0.1, 2.0])
    x = np.linspace(0.0, 4.0, 41)
    floor = np.column_stack([x, np.full(41, 0.6), np.zeros(41), np.full(41, 0.5)])
    assert closer(floor, door, 0.2)[20, 1] == pytest.approx(0.8, abs=1e-3)
