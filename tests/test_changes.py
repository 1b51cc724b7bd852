import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ovita.errors import FormatError
from ovita.io.documents import plain, validated
from ovita.measure import Changes, compare, sentences, shape_warnings
from ovita.measure.changes import Insertion, Kink, Span
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

CUP = SceneObject("cup", (0.5, 0.3, 0.0), (0.1, 0.1, 0.1))
SCENE = Scene((CUP,))


def line(n: int = 41, length: float = 1.0, speed: float = 0.3) -> Trajectory:
    positions = np.zeros((n, 3))
    positions[:, 0] = np.linspace(0.0, length, n)
    return Trajectory(positions, np.full(n, speed))


def changed(original: Trajectory, rows: np.ndarray, scene: Scene = SCENE) -> Changes:
    return compare(original, Trajectory.from_array(rows), scene)


def test_nothing_changed_says_so() -> None:
    changes = compare(line(), line(), SCENE)
    assert changes.nothing_changed and changes.path_unchanged and changes.speeds_unchanged
    assert changes.displacement.max == changes.displacement.count == 0
    assert changes.speed.ranges == () and changes.displacement.first is None
    assert sentences(changes) == ["Nothing changed: the path and the speeds are exactly as before."]


@pytest.mark.parametrize(("frame", "word"), [("rfu", "left"), ("flu", "back"), ("ned", "back")])
def test_a_translation_is_told_in_the_words_of_the_frame(frame: str, word: str) -> None:
    rows = line().to_array()
    rows[:, 0] -= 0.2
    changes = changed(line(), rows, Scene((CUP,), Frame(frame)))
    assert changes.displacement.words == {word: pytest.approx(0.2)}
    assert changes.goal.shift == pytest.approx(0.2) and changes.goal.words == {word: pytest.approx(0.2)}
    assert sentences(changes)[0] == f"The whole path moved 0.20 m {'left' if word == 'left' else 'backward'}."
    assert sentences(changes)[-1] == "The speed along the path is exactly as before."


def test_slowing_near_an_object_names_the_object_the_range_and_the_speeds() -> None:
    rows = line().to_array()
    rows[16:25, 3] = 0.15
    changes = changed(line(), rows)
    (stretch,) = changes.speed.ranges
    assert (stretch.first, stretch.last, stretch.near) == (16, 24, ("cup",))
    assert (changes.speed.first, changes.speed.last, changes.speed.count) == (16, 24, 9)
    assert changes.speed.ratio_min == pytest.approx(0.5) and changes.speed.ratio_max == pytest.approx(1.0)
    assert changes.path_unchanged and not changes.speeds_unchanged
    told = sentences(changes)
    assert told[0] == (
        "Speed is lower near the cup: 0.30 -> 0.15 m/s between waypoints 17 and 25; unchanged elsewhere."
    )
    assert told[-1] == "The path is exactly as before."
    assert any(s.startswith("It takes") and "longer" in s for s in told)


def test_speed_everywhere_keeps_the_standing_start_out_of_it() -> None:
    start = line().to_array()
    start[0, 3] = 0.0
    rows = start.copy()
    rows[:, 3] *= 2
    changes = changed(Trajectory.from_array(start), rows)
    assert changes.speed.everywhere and changes.speed.count == 40
    assert sentences(changes)[0].startswith("Speed is higher everywhere: 0.293 -> 0.585 m/s")
    assert "2.00 times" in sentences(changes)[0]


def test_a_constant_speed_is_told_as_one() -> None:
    rows = line().to_array()
    start = rows.copy()
    start[:, 3] = np.linspace(0.1, 0.5, len(rows))
    assert sentences(changed(Trajectory.from_array(start), rows))[0] == (
        "Speed is now 0.30 m/s everywhere (before: 0.10 to 0.50 m/s)."
    )


def test_many_alternating_changes_become_one_sentence() -> None:
    rows = line().to_array()
    rows[:, 3] *= np.where(np.arange(len(rows)) % 2, 1.2, 0.8)
    changes = changed(line(), rows)
    assert len(changes.speed.ranges) == 1
    assert sentences(changes)[0] == "Speed changes at 41 waypoints, to 0.80 ... 1.20 times that before."


def test_a_dwell_leaves_the_path_unmoved_and_is_told_as_a_wait() -> None:
    rows = np.insert(line().to_array(), [21] * 30, line().to_array()[20], axis=0)
    rows[20:51, 3] = 0.0
    changes = changed(line(), rows)
    assert changes.matching == "index without dwells"
    assert changes.displacement.max == 0.0 and changes.displacement.count == 0
    assert changes.speed.dwell_steps == Span(0, 30) and changes.speed.stops == Span(0, 1)
    assert changes.speed.dwell.after == pytest.approx(3.0)
    (stop,) = changes.speed.stopped
    assert (stop.first, stop.last, stop.near) == (20, 50, ("cup",))
    told = sentences(changes)
    assert told[0] == "It stops at waypoint 21 near the cup and waits 3.00 s."
    assert "The path is exactly as before." in told
    back = compare(Trajectory.from_array(rows), line(), SCENE)
    assert back.displacement.max == 0.0
    assert "It no longer stops on the way." in sentences(back)


def test_a_stop_inside_other_waypoints_is_found_without_a_dwell() -> None:
    rows = line().to_array()
    rows[[0, 20, -1], 3] = 0.0
    assert changed(line(), rows).speed.stops == Span(0, 1)
    assert not Trajectory.from_array(rows).dwells.any()


def test_a_continued_path_is_not_taken_for_a_moved_one() -> None:
    rows = line().to_array()
    tail = np.repeat(rows[-1:], 10, axis=0)
    tail[:, 1] = np.linspace(0.03, 0.3, 10)
    changes = changed(line(), np.vstack([rows, tail]))
    assert changes.matching == "kept waypoints" and changes.displacement.count == 0
    assert changes.added == (Insertion(41, 50, pytest.approx(0.3)),)
    assert sentences(changes)[0] == "The path goes on beyond its old goal: the goal moved 0.30 m forward."


def test_an_inserted_waypoint_moves_nothing_else() -> None:
    rows = np.insert(line().to_array(), 21, [0.5125, 0.2, 0.0, 0.3], axis=0)
    changes = changed(line(), rows)
    assert changes.displacement.count == 0 and changes.added == (Insertion(21, 21, pytest.approx(0.2)),)
    assert sentences(changes)[0] == "1 waypoint was put in as waypoint 22, up to 0.20 m off the old path."
    assert "The rest of the path is exactly as before." in sentences(changes)


def test_a_moved_and_continued_path_keeps_its_translation() -> None:
    rows = line().to_array()
    tail = np.repeat(rows[-1:], 5, axis=0)
    tail[:, 0] += np.linspace(0.1, 0.5, 5)
    rows = np.vstack([rows, tail])
    rows[:, 2] += 0.1
    changes = changed(line(), rows)
    moved = changes.displacement
    assert moved.max == pytest.approx(0.1) and moved.words == {"up": pytest.approx(0.1)}
    assert sentences(changes)[0] == "The whole path moved 0.10 m up."
    assert sentences(changes)[1].startswith("The path goes on beyond its old goal: the goal moved 0.50 m right")


def test_the_same_path_with_other_waypoints_is_as_good_as_unmoved() -> None:
    changes = compare(line(), line().resample(97), SCENE)
    assert changes.matching == "arc length" and not changes.path_unchanged
    assert changes.displacement.max == pytest.approx(0.0, abs=1e-12)
    assert changes.duration.change == pytest.approx(0.0, abs=1e-9)


def test_removing_the_first_waypoints_moves_nothing_and_quickens_nothing() -> None:
    rows = line().to_array()
    rows[:10, 3] = np.linspace(0.0, 0.27, 10)
    changes = compare(Trajectory.from_array(rows), Trajectory.from_array(rows[10:]), SCENE)
    assert changes.displacement.max == 0.0 and changes.removed == ((0, 9),) and changes.added == ()
    assert changes.speed.count == 0 and changes.speed.ranges == ()
    told = sentences(changes)
    assert told[0] == "The first 10 waypoints were taken out: the start moved 0.25 m right."
    assert not any("moved by up to" in s or "Speed is" in s for s in told)
    assert "The rest of the path is exactly as before." in told
    assert "The speed along the path is exactly as before." in told


def test_kinks_reversals_and_jumps_that_an_edit_brings_are_found() -> None:
    rows = line().to_array()
    rows[15:25, 2] += 0.2
    changes = changed(line(), rows)
    assert changes.shape.kinks[0] == Kink(14, pytest.approx(82.9, abs=0.1), 0.0)
    assert changes.shape.sharpest == Span(0.0, pytest.approx(82.9, abs=0.1))
    assert [j.waypoint for j in changes.shape.jumps] == [14, 24]
    assert shape_warnings(changes)[0] == "The path now turns sharply at 4 waypoints, by up to 83 degrees."
    assert shape_warnings(changes)[-1].startswith("The path jumps by 0.202 m between waypoints 25 and 26 (at most 0.0")
    back = line().to_array()
    back[20, 0] = back[18, 0]
    changes = changed(line(), back)
    assert changes.shape.reversals == Span(0, 2)
    assert "The path now turns back on itself at waypoint 20 (0 degrees there before)." in shape_warnings(changes)


def test_the_shape_of_what_was_put_in_is_no_kink() -> None:
    rows = line().to_array()
    tail = np.repeat(rows[-1:], 10, axis=0)
    tail[:, 1] = np.linspace(0.03, 0.3, 10)
    changes = changed(line(), np.vstack([rows, tail]))
    assert changes.shape.sharpest.after == pytest.approx(90.0) and shape_warnings(changes) == []


def test_a_corner_where_a_detour_leaves_the_path_and_joins_it_is_a_kink() -> None:
    rows = line().to_array()
    away = np.repeat(rows[20:21], 20, axis=0)
    away[:, 1] += 0.05 * np.append(np.arange(1, 11), np.arange(9, -1, -1))
    changes = changed(line(), np.vstack([rows[:21], away, rows[21:]]))
    assert [kink.waypoint for kink in changes.shape.kinks] == [20], shape_warnings(changes)
    back = np.vstack([rows[:21], away[:-1], rows[21:]])
    assert [kink.waypoint for kink in changed(line(), back).shape.kinks] == [20, 40]


def test_what_was_sharp_before_and_what_is_sampled_anew_is_no_kink_and_no_jump() -> None:
    corner = Trajectory([[x / 20, 0, 0] for x in range(21)] + [[1, y / 20, 0] for y in range(1, 21)], np.full(41, 0.3))
    smooth = line().to_array()
    smooth[:, 2] += 0.2 * np.sin(np.linspace(0, np.pi, 41)) ** 2
    for original, adapted in [
        (corner, corner.with_(positions=corner.positions + 0.1)),
        (corner, corner.resample(11)),
        (line(), line().resample(7)),
        (line(), Trajectory.from_array(smooth)),
    ]:
        changes = compare(original, adapted, SCENE)
        assert shape_warnings(changes) == [] and changes.shape.kinks == changes.shape.jumps == ()


def test_closest_approach_counts_what_lies_between_waypoints() -> None:
    two = Trajectory(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]), np.ones(2))
    (item,) = compare(two, two, SCENE).objects
    assert item.distance.before == pytest.approx(0.3, abs=1e-12)
    assert item.distance_at.before == pytest.approx(0.5)
    assert item.clearance.before == pytest.approx(0.25, abs=1e-9)


def test_an_oriented_cuboid_is_measured_at_its_surface() -> None:
    half = np.pi / 8
    bar = SceneObject("bar", (0.5, 0.5, 0.0), (0.4, 0.02, 0.02), (np.cos(half), 0.0, 0.0, np.sin(half)))
    changes = compare(line(3), line(3), Scene((bar,)))
    expected = 0.5 - (0.2 + 0.01) * np.sin(np.pi / 4)
    assert changes.objects[0].clearance.before == pytest.approx(expected, abs=1e-6)


def test_clearance_agrees_with_dense_sampling() -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        path = Trajectory(rng.normal(size=(12, 3)), np.ones(12))
        item = SceneObject("box", rng.normal(size=3), rng.uniform(0.05, 1.0, 3), rng.normal(size=4))
        dense = item.clearance(path.resample(20001).positions).min()
        found = compare(path, path, Scene((item,))).objects[0].clearance.before
        assert found <= dense + 1e-9 and found == pytest.approx(dense, abs=2e-3)


def test_passing_closer_is_told_with_both_distances() -> None:
    rows = line().to_array()
    rows[:, 1] += 0.05
    told = sentences(changed(line(), rows))
    assert "It now passes 0.05 m closer to the cup (0.25 -> 0.20 m to its surface)." in told


def test_an_object_of_unknown_size_is_told_to_its_centre() -> None:
    rows = line().to_array()
    rows[:, 1] += 0.05
    told = sentences(compare(line(), Trajectory.from_array(rows), Scene((SceneObject("lamp", (0.5, 0.3, 0.0)),))))
    assert "It now passes 0.05 m closer to the lamp (0.30 -> 0.25 m to its centre)." in told


def test_running_into_an_object_is_told() -> None:
    rows = line().to_array()
    rows[:, 1] += 0.3
    told = sentences(changed(line(), rows))
    assert "It now runs into the cup, 0.05 m deep." in told
    back = sentences(compare(Trajectory.from_array(rows), line(), SCENE))
    assert "It no longer runs into the cup; 0.25 m are left." in back


def test_speed_near_an_object_is_measured_before_and_after() -> None:
    far = SceneObject("far tree", (50.0, 0.0, 0.0))
    rows = line().to_array()
    rows[:, 3] = 0.6
    near, away = changed(line(), rows, Scene((CUP, far))).objects
    assert (near.speed_before, near.speed_after) == (pytest.approx(0.3), pytest.approx(0.6))
    assert (away.speed_before, away.speed_after) == (None, None)


def test_a_change_of_orientation_alone_is_not_silent() -> None:
    turned = Trajectory(line().positions, line().speeds, np.tile([1.0, 0.0, 0.0, 0.0], (41, 1)))
    changes = compare(line(), turned, SCENE)
    assert not changes.nothing_changed
    assert sentences(changes) == ["The path is exactly as before.", "The orientation along the path changed."]


def test_a_path_without_length_is_measured() -> None:
    still = Trajectory(np.zeros((3, 3)), np.zeros(3))
    moved = Trajectory(np.ones((5, 3)), np.zeros(5))
    changes = compare(still, moved, SCENE)
    assert changes.displacement.max == pytest.approx(np.sqrt(3.0))
    assert sentences(changes)[0] == "The whole path moved 1.00 m right, 1.00 m forward and 1.00 m up."
    json.dumps(plain(changes), allow_nan=False)


@pytest.mark.parametrize("spoil", ["displacement", "speed", "objects"])
def test_a_report_that_lacks_keys_is_refused(spoil: str) -> None:
    data = plain(compare(line(), line(), SCENE))
    del data[spoil]
    with pytest.raises(FormatError, match=f"has no {spoil}"):
        validated(Changes, data, "r.json")


speeds = st.just(0.0) | st.floats(0.01, 2.0)
coordinates = st.floats(-5, 5, allow_nan=False, width=32)
paths = st.integers(2, 12).flatmap(
    lambda n: st.builds(
        Trajectory, arrays(np.float64, (n, 3), elements=coordinates), arrays(np.float64, n, elements=speeds)
    )
)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(paths)
def test_identical_trajectories_differ_nowhere(path: Trajectory) -> None:
    changes = compare(path, path, SCENE)
    moved = changes.displacement
    assert (moved.max, moved.mean, moved.spread, moved.count) == (0.0, 0.0, 0.0, 0)
    assert changes.start.shift == changes.goal.shift == changes.speed.count == 0
    assert all(o.distance.change == o.clearance.change == 0 for o in changes.objects)
    assert len(sentences(changes)) == 1


@settings(max_examples=40, deadline=None, derandomize=True)
@given(paths, arrays(np.float64, 3, elements=st.floats(-2, 2, width=32)))
def test_a_translation_measures_as_itself(path: Trajectory, offset: np.ndarray) -> None:
    changes = compare(path, path.with_(positions=path.positions + offset), SCENE)
    np.testing.assert_allclose(changes.displacement.vector, offset, atol=1e-9)
    assert changes.displacement.max == pytest.approx(np.linalg.norm(offset), abs=1e-9)
    assert changes.displacement.spread < 1e-9
    assert changes.length.change == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(paths, paths)
def test_any_pair_is_measured_told_and_goes_through_json(one: Trajectory, other: Trajectory) -> None:
    changes = compare(one, other, SCENE)
    assert validated(Changes, json.loads(json.dumps(plain(changes))), "r.json") == changes
    told = sentences(changes)
    assert told and all(s.endswith(".") and "nan" not in s for s in told)


def test_a_constant_orientation_is_unchanged_with_another_number_of_waypoints():
    turned = np.tile([0.0, 0.0, 0.0, 1.0], (10, 1))
    path = Trajectory(np.column_stack([np.linspace(0, 1, 10), np.zeros((10, 2))]), np.full(10, 0.3), turned)
    assert compare(path, path.resample(5), Scene()).orientations_unchanged
    tilted = Trajectory(path.resample(5).positions, path.resample(5).speeds, np.tile([1.0, 0, 0, 0], (5, 1)))
    assert not compare(path, tilted, Scene()).orientations_unchanged


def test_a_path_that_stands_still_is_not_said_to_be_quicker() -> None:
    rows = line().to_array()
    rows[2:, 3] = 0.0
    told = sentences(changed(line(), rows))
    assert "It does not arrive: the speed is 0 on the way." in told
    assert not any("It takes" in text for text in told)
