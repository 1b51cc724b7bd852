import numpy as np
import pytest

from ovita.paths.scene import Frame, Scene
from ovita.toolkit import (
    Expectation,
    at_height,
    bound,
    bound_speed,
    closer,
    continue_to,
    dwell,
    expect_closer,
    expect_distance,
    expect_farther,
    expect_faster,
    expect_goal,
    expect_moved,
    expect_no_stop,
    expect_same_path,
    expect_same_speed,
    expect_side,
    expect_slower,
    expect_speed,
    expect_start,
    expect_stop,
    expect_visits,
    extend,
    farther,
    go_through,
    hop,
    hover,
    judge,
    keep_distance,
    keep_moving,
    keep_unchanged,
    last,
    move,
    move_goal,
    move_start,
    near,
    pass_at,
    resample,
    scale_speed,
    set_speed,
    stay_on,
    stop_at,
    wait_before,
)

SPOT = [0.5, 0.3, 0.0]


def first_ten(rows):
    return np.arange(len(rows)) < 10


KEPT = {
    "closer": (lambda t, cup: closer(t, cup, 0.1), lambda t, cup: expect_closer(cup)),
    "closer by": (lambda t, cup: closer(t, cup, 0.1), lambda t, cup: expect_closer(cup, 0.1)),
    "closer, arrived": (lambda t, cup: closer(t, cup, 9.0), lambda t, cup: expect_closer(cup, 9.0)),
    "closer, resampled": (lambda t, cup: resample(closer(t, cup, 0.1), 50), lambda t, cup: expect_closer(cup)),
    "closer by arriving": (lambda t, cup: continue_to(t, cup), lambda t, cup: expect_closer(cup)),
    "farther": (lambda t, cup: farther(t, cup, 0.1), lambda t, cup: expect_farther(cup, 0.1)),
    "farther times": (lambda t, cup: farther(t, cup, times=2), lambda t, cup: expect_farther(cup)),
    "distance": (lambda t, cup: keep_distance(t, cup, 0.4), lambda t, cup: expect_distance(cup, 0.4)),
    "at most": (lambda t, cup: keep_distance(t, cup, at_most=0.4), lambda t, cup: expect_distance(cup, at_most=0.4)),
    "passed": (lambda t, cup: pass_at(t, cup, 0.1), lambda t, cup: expect_distance(cup, nearest=0.1)),
    "passed farther": (lambda t, cup: pass_at(t, cup, 0.5), lambda t, cup: expect_distance(cup, nearest=0.5)),
    "moved": (lambda t, cup: move(t, left=0.2, up=0.1), lambda t, cup: expect_moved(left=0.2, up=0.1)),
    "moved and extended": (lambda t, cup: extend(move(t, up=0.2), 0.5), lambda t, cup: expect_moved(up=0.2)),
    "moved and stopped": (lambda t, cup: stop_at(move(t, up=0.2), 0.5), lambda t, cup: expect_moved(up=0.2)),
    "moved and waiting": (lambda t, cup: dwell(move(t, up=0.2), 0.5, 9), lambda t, cup: expect_moved(up=0.2)),
    "moved, resampled": (lambda t, cup: resample(move(t, up=0.2), 13), lambda t, cup: expect_moved(up=0.2)),
    "moved with ends": (lambda t, cup: move(t, up=0.2, keep="both"), lambda t, cup: expect_moved(up=0.2)),
    "moved a part": (
        lambda t, cup: move(t, up=0.2, where=first_ten(t)),
        lambda t, cup: expect_moved(up=0.2, where=first_ten(t)),
    ),
    "same path": (lambda t, cup: scale_speed(t, 0.5), lambda t, cup: expect_same_path()),
    "same path, resampled": (lambda t, cup: resample(t, 33), lambda t, cup: expect_same_path()),
    "same path there": (
        lambda t, cup: keep_unchanged(move(t, up=0.1), t, first_ten(t)),
        lambda t, cup: expect_same_path(where=first_ten(t)),
    ),
    "same speed": (lambda t, cup: move(t, up=0.1), lambda t, cup: expect_same_speed()),
    "same speed there": (
        lambda t, cup: keep_unchanged(scale_speed(t, 0.5), t, first_ten(t)),
        lambda t, cup: expect_same_speed(first_ten(t)),
    ),
    "start": (lambda t, cup: move_start(t, cup, up=0.1), lambda t, cup: expect_start(cup, up=0.1)),
    "start stays": (lambda t, cup: move_goal(t, cup), lambda t, cup: expect_start()),
    "goal": (lambda t, cup: move_goal(t, cup), lambda t, cup: expect_goal(cup)),
    "goal by": (lambda t, cup: move_goal(t, up=0.1), lambda t, cup: expect_goal(up=0.1)),
    "visits": (lambda t, cup: go_through(t, SPOT), lambda t, cup: expect_visits(SPOT, within=0.01)),
    "hover over": (lambda t, cup: hover(t, cup, 0.2), lambda t, cup: expect_visits(cup, up=0.2)),
    "way under": (lambda t, cup: go_through(t, cup, down=0.2), lambda t, cup: expect_visits(cup, 0.02, down=0.2)),
    "hop": (lambda t, cup: hop(t, cup, 0.1), lambda t, cup: expect_side("above", 0.1, of=cup, within=0.02)),
    "side": (lambda t, cup: stay_on(t, cup, "left"), lambda t, cup: expect_side("left", 0.05, of=cup)),
    "bound": (lambda t, cup: bound(t, right=0.4), lambda t, cup: expect_side("right", at_most=0.4)),
    "bound beside": (
        lambda t, cup: bound(t, right=-0.1, of=cup),
        lambda t, cup: expect_side("right", None, -0.1, of=cup),
    ),
    "height": (lambda t, cup: at_height(t, 0.2), lambda t, cup: expect_side("up", 0.2, 0.2)),
    "height there": (
        lambda t, cup: at_height(t, at_least=0.2, where=first_ten(t)),
        lambda t, cup: expect_side("up", 0.2, where=first_ten(t)),
    ),
    "cap": (lambda t, cup: bound_speed(t, 0.4), lambda t, cup: expect_speed(at_most=0.4)),
    "floor": (lambda t, cup: bound_speed(t, at_least=0.6), lambda t, cup: expect_speed(at_least=0.6)),
    "floor with a stop": (
        lambda t, cup: stop_at(bound_speed(t, at_least=0.6), 0.5, resume=True),
        lambda t, cup: expect_speed(at_least=0.6),
    ),
    "slower": (
        lambda t, cup: scale_speed(t, 0.5, where=near(t, cup, 0.4)),
        lambda t, cup: expect_slower(near(t, cup, 0.4)),
    ),
    "slower after a wait": (
        lambda t, cup: dwell(scale_speed(t, 0.5, where=last(t, 5)), "start", 6),
        lambda t, cup: expect_slower(last(t, 5)),
    ),
    "faster": (lambda t, cup: scale_speed(t, 2), lambda t, cup: expect_faster()),
    "speed": (lambda t, cup: set_speed(t, 0.2), lambda t, cup: expect_speed(0.2)),
    "speed of the new end": (
        lambda t, cup: set_speed(extend(t, 0.5), 0.2, where=last(extend(t, 0.5), 5)),
        lambda t, cup: expect_speed(0.2, last(extend(t, 0.5), 5)),
    ),
    "stop": (lambda t, cup: stop_at(t, cup), lambda t, cup: expect_stop(near=cup)),
    "stop and go": (lambda t, cup: stop_at(t, cup, resume=True), lambda t, cup: expect_stop(near=cup)),
    "stop beside": (lambda t, cup: stop_at(move(t, back=0.5), cup), lambda t, cup: expect_stop(near=cup)),
    "stop at the end": (lambda t, cup: stop_at(t, "goal"), lambda t, cup: expect_stop()),
}


@pytest.mark.parametrize("case", KEPT)
def test_a_promise_kept_is_held_and_the_unchanged_trajectory_breaks_it(case, line, cup, scene):
    edit, promise = KEPT[case]
    expectation = promise(line, cup)
    outcome = judge(expectation, line, edit(line, cup), scene)
    assert outcome.held, outcome.sentence
    assert any(c.isdigit() for c in outcome.sentence)
    if not case.startswith(("same", "start stays")):
        assert not judge(expectation, line, line, scene).held


BROKEN = {
    "too little": (lambda t, cup: move(t, left=0.1), lambda t, cup: expect_moved(left=0.2)),
    "wrong way": (lambda t, cup: move(t, right=0.2), lambda t, cup: expect_moved(left=0.2)),
    "only a few": (lambda t, cup: move(t, left=0.2, where=first_ten(t)), lambda t, cup: expect_moved(left=0.2)),
    "closer but less": (lambda t, cup: closer(t, cup, 0.05), lambda t, cup: expect_closer(cup, 0.2)),
    "farther instead": (lambda t, cup: farther(t, cup, 0.05), lambda t, cup: expect_closer(cup)),
    "elsewhere": (lambda t, cup: move(t, up=0.1), lambda t, cup: expect_same_path()),
    "cut short": (lambda t, cup: stop_at(t, 0.5), lambda t, cup: expect_same_path()),
    "goal missed": (lambda t, cup: move_goal(t, cup, up=0.05), lambda t, cup: expect_goal(cup)),
    "no such waypoint": (lambda t, cup: t, lambda t, cup: expect_slower(near(t, cup, 0.01))),
    "slow elsewhere": (
        lambda t, cup: scale_speed(t, 0.5, where=last(t, 5)),
        lambda t, cup: expect_slower(first_ten(t)),
    ),
    "cut off": (lambda t, cup: stop_at(t, 0.5), lambda t, cup: expect_slower(last(t, 5))),
    "stopped too early": (lambda t, cup: stop_at(t, 0.1), lambda t, cup: expect_stop(near=cup)),
    "hop too low": (
        lambda t, cup: hop(t, cup, 0.05),
        lambda t, cup: expect_side("above", 0.1, of=cup, within=0.02),
    ),
    "hop beside": (
        lambda t, cup: move(hop(t, cup, 0.1), back=0.2),
        lambda t, cup: expect_side("above", 0.1, of=cup, within=0.02),
    ),
    "over instead of under": (
        lambda t, cup: go_through(t, cup, up=0.2),
        lambda t, cup: expect_visits(cup, down=0.2),
    ),
    "too low at one waypoint": (
        lambda t, cup: at_height(t, 0.2, where=~near(t, [0.5, 0, 0], 0.01), ease=0),
        lambda t, cup: expect_side("up", 0.2),
    ),
    "too fast at one waypoint": (
        lambda t, cup: bound_speed(t, 0.4, where=~near(t, [0.5, 0, 0], 0.01)),
        lambda t, cup: expect_speed(at_most=0.4),
    ),
    "creeping between stops": (
        lambda t, cup: np.column_stack([t[:, :3], 0.1 + np.abs(np.sin(np.arange(21)))]),
        lambda t, cup: expect_speed(at_least=0.6),
    ),
    "path there": (
        lambda t, cup: move(t, up=0.1, where=first_ten(t)),
        lambda t, cup: expect_same_path(where=first_ten(t)),
    ),
    "speed there": (lambda t, cup: scale_speed(t, 0.8), lambda t, cup: expect_same_speed(where=first_ten(t))),
    "between waypoints": (lambda t, cup: t[::10], lambda t, cup: expect_distance([0.25, 0.0, 0.0], 0.2)),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_broken_promise_is_not_held(case, line, cup, scene):
    edit, promise = BROKEN[case]
    outcome = judge(promise(line, cup), line, edit(line, cup), scene)
    assert not outcome.held, outcome.sentence


def test_a_path_that_comes_closer_may_be_farther_on_average(line, cup, scene):
    """It came 0.16 m closer and was flagged, since the average distance grew."""
    closer_here = move(go_through(line, [0.5, 0.16, 0.0], width=0.1), back=0.16, where=first_ten(line))
    assert judge(expect_closer(cup), line, closer_here, scene).held
    outcome = judge(expect_farther(cup), line, closer_here, scene)
    assert not outcome.held, outcome.sentence


def test_a_goal_that_limits_moved_by_a_centimetre_is_where_it_was(line, cup, scene):
    assert judge(expect_goal(), line, move_goal(line, up=0.014), scene).held
    assert not judge(expect_goal(), line, move_goal(line, up=0.03), scene).held


def test_a_distance_kept_at_waypoints_only_is_not_kept(line):
    sparse = line[[0, 8, 12, 20]]
    spot = [0.5, 0.5, 0.0]
    off = np.linalg.norm(sparse[1, :3] - spot)
    outcome = judge(expect_distance(spot, float(off)), line, sparse, Scene())
    assert not outcome.held, outcome.sentence
    assert judge(expect_distance(spot, 0.5), line, sparse, Scene()).held


def test_the_sentence_gives_the_numbers(line, scene):
    outcome = judge(expect_moved(left=0.2), line, move(line, left=0.2), scene)
    assert outcome.sentence == "the path moved 0.200 m left on average (asked 0.2 m)"


@pytest.mark.parametrize(
    ("promise", "text"),
    [
        (lambda cup: expect_side("up", 0.3), "the path stays at least 0.3 m above the ground"),
        (lambda cup: expect_side("right", at_most=-0.1), "the path stays at least 0.1 m left of the origin"),
        (lambda cup: expect_side("behind", 0.1, of=cup), "the path stays at least 0.1 m behind cup"),
        (lambda cup: expect_side("up", 0.2, 0.2), "the path stays 0.2 m above the ground"),
        (
            lambda cup: expect_side("above", 0.1, of=cup, within=0.05),
            "the path stays at least 0.1 m above cup where it passes within 0.05 m of it",
        ),
        (lambda cup: expect_distance(cup, nearest=0.15), "the path comes as near as 0.15 m to cup"),
        (lambda cup: expect_visits(cup, up=0.2), "the path comes within 0.05 m of the place 0.2 m up of cup"),
        (lambda cup: expect_speed(at_least=0.1, at_most=0.4), "the speed is at least 0.1 m/s and at most 0.4 m/s"),
    ],
)
def test_a_promise_of_a_side_or_a_bound_reads_as_it_is_meant(promise, text, cup):
    assert promise(cup).text == text


def test_directions_are_those_of_the_scene(line):
    for name in ("rfu", "flu", "ned"):
        frame = Frame(name)
        moved = move(line, left=0.2, down=0.1, frame=frame)
        assert judge(expect_moved(left=0.2, down=0.1, frame=frame), line, moved, Scene(frame=frame)).held


def test_a_repair_within_ten_percent_is_accepted(line, scene):
    assert judge(expect_moved(left=0.2), line, move(line, left=0.185), scene).held
    assert judge(expect_moved(left=0.02), line, move(line, left=0.012), scene).held


def test_unknown_objects_and_kinds(line, scene):
    outcome = judge(Expectation("closer", {"object": "vase"}, ""), line, line, scene)
    assert not outcome.held and "vase" in outcome.sentence
    with pytest.raises(ValueError, match="unknown expectation 'prettier'"):
        judge(Expectation("prettier", {}, ""), line, line, scene)


def test_braking_in_a_part_for_a_stop_beyond_it_breaks_no_least_speed(line):
    out, part = line.copy(), np.arange(len(line)) < 10
    out[7:12, 3] = [0.3, 0.2, 0.1, 0.0, 0.2]
    assert judge(expect_speed(at_least=0.4, where=part), line, out, Scene()).held
    out[5, 3] = 0.3
    assert not judge(expect_speed(at_least=0.4, where=part), line, out, Scene()).held


def test_a_stop_between_the_ends_breaks_the_promise_of_none_there(line, scene):
    stopped = stop_at(line, 0.5, resume=True)
    first = np.arange(len(line)) < 5
    ends = line.copy()
    ends[[0, -1], 3] = 0.0
    assert not judge(expect_no_stop(), line, stopped, scene).held
    assert judge(expect_no_stop(where=first), line, stopped, scene).held
    assert judge(expect_no_stop(), stopped, keep_moving(stopped), scene).held
    assert judge(expect_no_stop(), line, ends, scene).held


def test_a_wait_before_an_object_is_where_it_is_promised(line, scene):
    box = scene["cup"]
    waiting = wait_before(line, box, 0.3, 5)
    assert judge(expect_stop(box, before=0.3), line, waiting, scene).held
    assert not judge(expect_stop(box, before=0.35), line, waiting, scene).held
    assert not judge(expect_stop(box, before=0.3), line, line, scene).held
    assert len(waiting) == len(line) + 6 and np.array_equal(waiting[[0, -1]], line[[0, -1]])
