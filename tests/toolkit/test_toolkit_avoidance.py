"""Ways that are not to be taken: over or under an object, or between two."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ovita.paths.geometry import path_distances
from ovita.paths.scene import RFU, SceneObject
from ovita.toolkit import avoid, dwell, go_round, keep_distance
from ovita.toolkit.avoidance import shut

S = np.linspace(0.0, 1.0, 80)
places = st.tuples(
    *[st.floats(low, high).map(lambda v: round(v, 3)) for low, high in ((-0.5, 0.5), (-0.3, 0.3), (0.0, 1.0))]
)
sizes = st.tuples(*[st.floats(0.05, 0.3)] * 3)


def path(bend, rise):
    """From (-2, 0) to (2, 0), with room at both ends."""
    xyz = np.column_stack([4.0 * S - 2.0, bend * np.sin(2.0 * np.pi * S), 0.5 + rise * np.sin(np.pi * S)])
    return np.column_stack([xyz, np.full(len(S), 0.3)])


def inside(bodies, rows):
    return min(body.closest(rows[:, :3])[0] for body in bodies)


@given(
    places, sizes, st.floats(-0.4, 0.4), st.floats(0.0, 0.4), st.sampled_from(["over", "under"]), st.floats(0.0, 0.2)
)
def test_nothing_of_the_path_is_over_or_under_an_object_any_more(place, size, bend, rise, way, gap):
    rows, item = path(bend, rise), SceneObject("box", place, size)
    moved = avoid(rows, way, item, gap=gap)
    assert inside(shut(way, item, None, gap, rows[:, :3], RFU), moved) > -1e-4
    assert np.allclose(moved[[0, -1]], rows[[0, -1]]) and moved[:, 2].max() <= rows[:, 2].max() + 1e-9
    assert rise or np.allclose(moved[:, 2:], rows[:, 2:])


@given(places, places, st.floats(-0.4, 0.4))
def test_the_path_does_not_cross_the_line_between_two_objects(first, second, bend):
    a, b = (SceneObject(name, place, [0.1, 0.1, 0.1]) for name, place in (("a", first), ("b", second)))
    away = np.subtract(second, first)[:2]
    if np.linalg.norm(away) < 0.3:
        return
    rows = path(bend, 0.0)
    moved = avoid(rows, "between", a, b)
    side = (moved[:, :2] - first[:2]) @ np.array([-away[1], away[0]])
    share = (moved[:, :2] - first[:2]) @ away / (away @ away)
    crossed = np.flatnonzero(side[:-1] * side[1:] < 0)
    assert all(share[i : i + 2].max() < 0.0 or share[i : i + 2].min() > 1.0 for i in crossed)
    assert np.allclose(moved[:, 2:], rows[:, 2:])


def test_a_path_that_keeps_out_already_stays():
    rows, item = path(0.0, 0.0), SceneObject("box", [0.0, 1.0, 0.2], [0.1, 0.1, 0.1])
    assert np.array_equal(avoid(rows, "over", item), rows)


@pytest.mark.parametrize(
    ("way", "other", "said"),
    [("above", None, "'over', 'under' or 'between'"), ("between", None, "other object"), ("over", [1, 0, 0], "other")],
)
def test_bad_ways_are_refused(way, other, said):
    with pytest.raises(ValueError, match=said):
        avoid(path(0.0, 0.0), way, [0.0, 0.0, 0.0], other)


def test_a_way_around_cuts_off_no_turn_of_the_path():
    lane = [(12.0, 10.0), (14.2, 10.0), (16.4, 10.0), (18.5, 10.0), (15.7, 8.3), (12.8, 6.5), (10.0, 4.8)]
    rows = np.column_stack([np.array([(2.0 * i, 10.0) for i in range(6)] + lane), np.zeros(13), np.full(13, 0.6)])
    piano = SceneObject("piano", [16.0, 11.0, 0.6], [1.5, 1.5, 1.2])
    kept = keep_distance(rows, piano, at_least=0.5)
    assert piano.cuboid.closest(kept[:, :3])[0] == pytest.approx(0.5, abs=0.01)
    assert path_distances(kept[:, :3], rows[:, :3]).max() < 0.35  # the turn at (18.5, 10) stays


def test_a_way_around_leaves_out_no_rows_of_a_survey():
    turns = [(80, 130), (80, 10), (100, 10), (100, 130), (120, 130), (120, 10), (0, 0)]
    line = np.concatenate([np.linspace(a, b, 7)[:-1] for a, b in pairwise(turns)] + [[turns[-1]]])
    rows = np.column_stack([line, np.full(len(line), 50.0), np.full(len(line), 6.0)])
    pylon = SceneObject("pylon", [130.0, 60.0, 22.0], [6.0, 6.0, 44.0])
    kept = keep_distance(rows, pylon, at_least=30.0)
    assert pylon.cuboid.closest(kept[:, :3])[0] == pytest.approx(30.0, abs=0.1)
    assert path_distances(kept[:, :3], rows[:, :3]).max() < 30.0 and kept[:, 1].max() == pytest.approx(130.0, abs=5.0)


@given(
    places, sizes, st.floats(-0.4, 0.4), st.floats(0.0, 0.4), st.sampled_from(["front", "back"]), st.floats(0.0, 0.2)
)
def test_a_way_around_passes_on_its_side_and_keeps_its_gap(place, size, bend, rise, side, gap):
    rows, item = path(bend, rise), SceneObject("box", place, size)
    moved = go_round(rows, item, side, gap=gap)
    assert np.allclose(moved[[0, -1]], rows[[0, -1]]) and np.allclose(moved[:, 3], rows[:, 3])
    x, beyond = moved[:, 0] - place[0], (moved[:, 1] - place[1]) * (1.0 if side == "front" else -1.0)
    if inside(shut("over", item, None, gap, rows[:, :3], RFU), rows[[0, -1]]) > 0.0:
        abreast = np.flatnonzero((x[:-1] <= 0.0) != (x[1:] <= 0.0))
        assert (beyond[abreast] * x[abreast + 1] - beyond[abreast + 1] * x[abreast] > 0.0).all() == (len(abreast) > 0)
    assert abs(moved[:, 2].max() - rows[:, 2].max()) < 0.02
    way = moved[(moved[:, :2] != rows[:, :2]).any(axis=1)]
    if len(way) > 1:
        column = SceneObject("box", place, [*size[:2], 10.0]).cuboid  # as seen from above
        assert column.closest(way[:, :3])[0] >= gap - 0.02 * (max(size) + 2.0 * gap) - 2e-3


@pytest.mark.parametrize("count", [2, 3, 4, 5, 7, 9, 15])
def test_a_way_around_with_few_waypoints_cuts_no_corner(count):
    rows = np.column_stack([np.linspace(-1.0, 1.0, count), *np.zeros((2, count)), np.full(count, 0.3)])
    box = SceneObject("box", [0.0, 0.0, 0.0], [0.3, 0.3, 1.0])
    moved = go_round(rows, box, "front", gap=0.1)
    assert np.array_equal(moved, rows) if count == 2 else box.cuboid.closest(moved[:, :3])[0] > 0.09


def test_the_other_side_of_a_thing_at_a_corner_is_one_way_around_it():
    corner = np.concatenate([np.linspace((-1.4, -1.0), (0.8, -0.9), 30), np.linspace((0.8, -0.8), (0.9, 0.9), 25)])
    rows = np.column_stack([corner, np.zeros(len(corner)), np.full(len(corner), 0.4)])
    pallet = SceneObject("pallet", [-0.35, 0.1, 0.07], [0.8, 0.6, 0.14])
    moved = go_round(rows, pallet, "front", gap=0.3)
    assert pallet.cuboid.closest(moved[:, :3])[0] > 0.29
    assert np.linalg.norm(np.diff(moved[:, :3], axis=0), axis=1).sum() < 4.1  # and no hook
    assert np.array_equal(go_round(moved, pallet, "front", gap=0.25), moved)
    with pytest.raises(ValueError, match="level"):
        go_round(rows, pallet, "up")


def test_a_way_around_leads_from_stop_to_stop():
    rows, item = path(0.0, 0.0), SceneObject("box", [0.5, -0.1, 0.5], [0.3, 0.3, 0.3])
    waiting = dwell(rows, [-0.5, 0.0, 0.5], steps=5)
    moved = go_round(waiting, item, "back", gap=0.1)
    assert np.array_equal(moved[:36], waiting[:36]) and moved[:, 1].min() < -0.3
