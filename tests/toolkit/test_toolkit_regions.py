import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toolkit_paths import modest, paths, paths_and_masks, points, words

from ovita.paths.scene import Frame, SceneObject
from ovita.toolkit import at_height, bound, quadrant, stay_on

frames = st.sampled_from(["rfu", "flu", "ned"]).map(Frame)
limits = st.floats(-1, 1).map(lambda v: round(v, 3))
sides = st.sampled_from(["left", "right", "front", "back", "up", "down", "above", "below", "behind"])
WORD = {"above": "up", "below": "down", "behind": "back"}


@modest
@given(paths_and_masks(extra=2), words, limits, st.one_of(st.none(), points, st.just("start")), frames)
def test_no_selected_waypoint_is_beyond_a_bound(drawn, word, limit, of, frame):
    rows, mask = drawn
    before = rows.copy()
    out = bound(rows, **{word: limit}, of=of, where=mask, ease=0, frame=frame)
    assert np.array_equal(rows, before) and not np.shares_memory(out, rows)
    origin = {type(None): np.zeros(3), str: rows[0, :3]}.get(type(of), of)
    old, new = ((r[:, :3] - origin) @ frame.direction(word) for r in (rows, out))
    assert (new[mask] <= limit + 1e-12).all()
    assert np.allclose(new[mask], np.minimum(old, limit)[mask])
    fine = ~mask | (old <= limit - 1e-9)
    assert np.array_equal(out[fine], rows[fine])
    assert np.array_equal(bound(out, **{word: limit}, of=of if of is None else origin, where=mask, frame=frame), out)


@modest
@given(paths_and_masks(extra=2), st.floats(0, 0.5), st.floats(0, 0.5), frames)
def test_heights_are_kept_at_least_and_at_most_on_a_part(drawn, low, more, frame):
    rows, mask = drawn
    out = at_height(rows, at_least=low, at_most=low + more, where=mask, ease=0, frame=frame)
    old, new = (r[:, :3] @ frame.direction("up") for r in (rows, out))
    assert np.allclose(new[mask], np.clip(old, low, low + more)[mask], atol=1e-12)
    assert np.array_equal(out[~mask], rows[~mask])


@modest
@given(paths_and_masks(), points, sides, st.floats(0, 0.5))
def test_a_part_stays_on_a_side_and_the_others_stay(drawn, point, side, gap):
    rows, mask = drawn
    out = stay_on(rows, point, side, gap=gap, where=mask, ease=0)
    assert np.array_equal(out[mask], stay_on(rows, point, side, gap=gap)[mask])
    assert np.array_equal(out[~mask], rows[~mask])


def test_bounds_combine_and_count_from_an_object(line, cup):
    line[:, 1:3] = np.random.default_rng(0).normal(size=(21, 2))
    out = bound(line, up=0.3, down=-0.1, right=0.6)
    assert out[:, 2].min() == 0.1 and out[:, 2].max() == 0.3 and out[:, 0].max() == 0.6
    assert bound(line, right=-0.1, of=cup)[:, 0].max() == 0.4
    assert bound(line, left=-0.1, of=cup)[:, 0].min() == 0.6
    assert bound(line, up=0.2, frame=Frame("ned"))[:, 2].min() == -0.2
    assert (bound(line, up=0.1, down=-0.1)[:, 2] == 0.1).all()


@modest
@given(paths(extra=2), points, sides, st.floats(0, 0.5), st.floats(0.01, 0.3), frames)
def test_the_path_stays_on_its_side(rows, point, side, gap, size, frame):
    before = rows.copy()
    ball = SceneObject("ball", point, [size, 2 * size, 3 * size])
    out = stay_on(rows, ball, side, gap=gap, frame=frame)
    assert np.array_equal(rows, before) and not np.shares_memory(out, rows)
    axis = frame.direction(WORD.get(side, side))
    limit = point @ axis + abs(axis) @ ball.size / 2 + gap
    old, new = (r[:, :3] @ axis for r in (rows, out))
    assert (new >= limit - 1e-12).all() and (new >= old).all()
    margin = max(gap, 0.02)
    assert (new <= np.maximum(old, limit) + margin / 4 + 1e-12).all()
    safe = old > limit + margin
    assert np.array_equal(out[safe], rows[safe])
    other = (out - rows)[:, :3] * (1 - abs(axis))
    assert not other.any() and np.array_equal(out[:, 3:], rows[:, 3:])
    if (old >= limit).all():
        assert np.array_equal(out, rows)
    for end in (0, -1):
        if old[end] >= limit:
            assert np.array_equal(out[end], rows[end])
    assert np.array_equal(stay_on(out, ball, side, gap=gap, frame=frame), out)


def test_a_path_gives_way_without_a_corner(cup):
    rows = np.column_stack([np.linspace(0, 1, 201), np.zeros((201, 2)), np.ones(201)])
    rows[:, 2] = 0.3 * np.cos(2 * np.pi * rows[:, 0])
    out = stay_on(rows, cup, "above", gap=0.05)
    assert out[:, 2].min() == pytest.approx(0.1, abs=1e-12)
    clipped = np.maximum(rows[:, 2], 0.1)
    assert np.abs(np.diff(out[:, 2], 2)).max() < 0.5 * np.abs(np.diff(clipped, 2)).max()


def test_a_wider_gap_pushes_farther(line, cup):
    near, far = (stay_on(line, cup, "right", gap=gap)[:, 0] for gap in (0.05, 0.2))
    assert near.min() == pytest.approx(0.58) and far.min() == pytest.approx(0.73)
    assert (far >= near).all()
    assert stay_on(line, cup.position, "right", gap=0.05)[:, 0].min() == pytest.approx(0.55)


@modest
@given(paths(extra=2), st.integers(1, 4), frames)
def test_a_quadrant_is_reached_by_the_smallest_shift(rows, which, frame):
    out = quadrant(rows, which, frame=frame)
    shift = (out - rows)[:, :3]
    assert np.allclose(shift, shift[0])
    for word in (("right", "left", "left", "right")[which - 1], ("front", "front", "back", "back")[which - 1]):
        axis = frame.direction(word)
        new, old = out[:, :3] @ axis, rows[:, :3] @ axis
        assert new.min() >= 0 and np.isclose(new.min(), max(old.min(), 0))
    assert np.array_equal(out[:, 2:], rows[:, 2:])
    assert np.array_equal(quadrant(out, which, frame=frame), out)


@modest
@given(paths_and_masks(extra=2), limits, frames)
def test_a_height_is_set_exactly(drawn, height, frame):
    rows, mask = drawn
    out = at_height(rows, height, where=mask, ease=0, frame=frame)
    assert (out[mask, :3] @ frame.direction("up") == height).all()
    assert np.array_equal(out[~mask], rows[~mask])
    assert np.array_equal(np.delete(out, 2, axis=1), np.delete(rows, 2, axis=1))
