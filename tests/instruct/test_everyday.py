"""What strangers asked for in scenes of their own: objects by what they are, what is lost, and what stays."""

import itertools

import numpy as np
import pytest

from ovita import Scene, SceneObject, Session, Trajectory, adapt
from ovita.instruct.notation import show
from ovita.instruct.understanding import understand
from ovita.toolkit import keep_distance, ramp_speed, slow_turns


def scene(**places):
    """Objects of 10 cm with these names at these places [m]."""
    return Scene(tuple(SceneObject(name.replace("_", " "), at, [0.1, 0.1, 0.1]) for name, at in places.items()))


LINE = Trajectory(np.column_stack([np.linspace(0, 2, 41), np.zeros(41), np.full(41, 0.3)]), np.full(41, 0.3))
CLIMB = LINE.with_(positions=LINE.positions + np.linspace(0, 1, 41)[:, None] * [0.0, 0.0, 0.4])
TABLE = scene(cup=[0.5, 0.15, 0.3], plate=[0.7, -0.15, 0.3], vase=[1.5, 0.2, 0.3])


def frames(said, objects=TABLE, path=LINE):
    return show(understand(said, objects, path).reading.frames)


def test_the_only_person_is_called_many_things():
    alone = scene(cup=[0.5, 0.1, 0.3], Person=[1.5, 0.4, 0.3])
    for said in ("stay 50 cm away from my son", "stay 50 cm away from the kid"):
        assert frames(said, alone).startswith("clearance Person")
    two = scene(child=[0.5, 0.1, 0.3], nurse=[1.5, 0.4, 0.3])
    assert "clearance" not in frames("stay 50 cm away from my son", two)


@pytest.mark.parametrize(
    "said",
    [
        "skip the last two rows",
    ],
)
def test_what_would_be_lost_is_shown_first(said):
    assert understand(said, TABLE, LINE).outcome != "do"


def test_unused_words_are_ones_that_were_said():
    mow = np.array([[0, 0, 0], [4, 0, 0], [4, 1, 0], [0, 1, 0], [0, 2, 0], [4, 2, 0]], dtype=float)
    path = Trajectory(
        np.concatenate([np.linspace(a, b, 11)[:-1] for a, b in itertools.pairwise(mow)]), np.full(50, 0.5)
    )
    found = understand("slower on the last row, it looks thin", Scene(()), path)
    assert not any(word.isdigit() for word in found.unused)


def test_slower_near_two_things_that_overlap_is_slower_once():
    slow = adapt(LINE, "slow down near the cup, and slow down near the plate", scene=TABLE, writer="builtin").adapted
    assert slow.speeds.min() == pytest.approx(0.15)


def test_after_a_thing_it_is_faster_only_beyond_where_it_is_slower():
    result = adapt(LINE, "slow down near the cup, then faster after the cup", scene=TABLE, writer="builtin")
    speeds = (result.proposal or result).adapted.speeds
    assert set(np.round(speeds, 3)) <= {0.15, 0.3, 0.45} and speeds.min() == pytest.approx(0.15)


def test_a_size_with_a_start_that_stays_is_about_the_start():
    curve = Trajectory(
        np.column_stack([np.linspace(0, 1, 30), np.sin(np.linspace(0, 3, 30)), np.full(30, 0.4)]), np.full(30, 0.2)
    )
    result = adapt(
        curve, "shrink the path to 80 percent, keep the start where it is", scene=Scene(()), writer="builtin"
    )
    expected = curve.positions[0] + 0.8 * (curve.positions - curve.positions[0])
    assert np.allclose((result.proposal or result).adapted.positions, expected, atol=1e-6)


def test_higher_on_the_way_home_leaves_the_landing():
    out = np.linspace([0, 0, 0.2], [10, 0, 3], 40)
    there = Trajectory(np.concatenate([out, out[::-1] + np.array([0, 0.5, 0])]), np.full(80, 1.0))
    higher = adapt(there, "on the way home go 1 m higher", scene=Scene(()), writer="builtin").adapted
    assert (
        np.allclose(higher.positions[-1], there.positions[-1])
        and higher.positions[60, 2] > there.positions[60, 2] + 0.9
    )


def test_keep_away_does_not_draw_the_path_straight():
    """A band drawn taut around a body had taken out all turns that the path had of its own."""
    t = np.linspace(0, 1, 60)
    rows = np.column_stack([t, 0.12 * np.sin(18 * t), 0.1 * np.cos(11 * t), np.full(60, 0.2)])
    out = keep_distance(rows, [0.55, 0.35, 0.0], 0.4)
    longs = [np.linalg.norm(np.diff(r[:, :3], axis=0), axis=1).sum() for r in (rows, out)]
    assert longs[1] > 0.85 * longs[0]


def test_a_ramp_to_rest_does_not_creep():
    rows = np.column_stack([np.linspace(0, 4, 81), np.zeros((81, 2)), np.full(81, 0.4)])
    out = ramp_speed(rows, 0.4, 0.0)
    seconds = (2 * 0.05 / (out[:-1, 3] + out[1:, 3])).sum()
    assert seconds == pytest.approx(2 * 4 / 0.4, rel=0.05)  # constant deceleration


def test_turns_of_a_long_path_slow_no_more_than_what_is_near():
    legs = np.array([[0, 0, 0], [100, 0, 0], [100, 3, 0], [0, 3, 0]], dtype=float)
    path = np.concatenate([np.linspace(a, b, 101)[:-1] for a, b in itertools.pairwise(legs)])
    rows = np.column_stack([path, np.ones(len(path))])
    slow = slow_turns(rows, 0.5)[:, 3]
    assert slow.min() == pytest.approx(0.5) and (slow[:90] == 1.0).all()


def test_near_and_at_the_end_are_no_stretch_of_a_field():
    field = Trajectory(np.column_stack([np.linspace(0, 200, 201), np.zeros((201, 2))]), np.full(201, 2.0))
    oak = scene(oak=[100, 4, 0])
    near = adapt(field, "slow down near the oak", scene=oak, writer="builtin").adapted
    end = adapt(field, "slow down at the end", scene=oak, writer="builtin").adapted
    assert 3 <= (near.speeds < 2.0).sum() <= 30 and 5 <= (end.speeds < 2.0).sum() <= 30


STOPS = np.concatenate(
    [
        np.linspace([0, 0, 0.3], [1, 0, 0.3], 20),
        np.tile([1, 0, 0.3], (10, 1)),
        np.linspace([1, 0, 0.3], [2, 0.5, 0.3], 20),
    ]
)
STANDS = Trajectory(STOPS, np.where(np.r_[False, (np.diff(STOPS, axis=0) == 0).all(axis=1)], 0.0, 0.3))
RACK = scene(rack=[1.0, 0.12, 0.3], bin=[2.0, 0.7, 0.3])


def test_to_finish_where_it_stops_anyway_is_to_end_there():
    result = adapt(STANDS, "finish at the rack", scene=RACK, writer="builtin")
    assert np.allclose((result.proposal or result).adapted.positions[-1], [1, 0, 0.3], atol=0.06)


def test_to_stop_short_of_where_it_stops_on_the_way_goes_on():
    result = adapt(STANDS, "stop 15 cm short of the rack", scene=RACK, writer="builtin")
    out = (result.proposal or result).adapted.positions
    assert np.allclose(out[-1], STANDS.positions[-1]) and np.abs(out[25] - STANDS.positions[25]).max() > 0.05


def talk(*said, path=STANDS, objects=RACK):
    session = Session(path, objects, writer="builtin")
    for one in said:
        result = session.say(one)
        if session.pending is not None:
            result = session.say("yes")
    return session, result


def test_a_wait_there_is_where_the_last_change_was():
    session, _ = talk("go up by 5 cm near the cup", "and hover there for 2 seconds", path=LINE, objects=TABLE)
    still = (np.diff(session.current.positions, axis=0) == 0).all(axis=1)
    assert still.sum() == 20 and abs(session.current.positions[np.flatnonzero(still)[0], 0] - 0.5) < 0.15
    assert session.current.positions[:, 2].max() < 0.36


def test_another_length_is_so_much_more_than_what_was_guessed():
    session, first = talk("stay a bit farther from the cup", path=LINE, objects=TABLE)
    guessed = next(iter(first.parameters)).value
    result = session.say("another 3 cm")
    assert result.usable and next(iter(result.parameters)).value == pytest.approx(guessed + 0.03)


def test_how_long_is_about_the_wait_and_not_about_a_later_shift():
    session, _ = talk("wait 1 s at the cup", "10 cm higher", "stay there twice as long", path=LINE, objects=TABLE)
    still = (np.diff(session.current.positions, axis=0) == 0).all(axis=1)
    assert still.sum() == 20 and session.current.positions[0, 2] == pytest.approx(0.4)


def test_an_amount_for_a_part_is_not_silently_for_the_whole():
    session, _ = talk("drive at 0.2 m/s", path=LINE, objects=TABLE)
    before = session.current
    assert (
        session.say("make that 0.25 for the second half").status == "needs_confirmation" and session.current is before
    )


def test_on_the_way_in_is_before_the_thing_that_was_meant_or_asked_about():
    session, result = talk("slow down near the cup", "only on the way in", path=LINE, objects=TABLE)
    speeds = session.current.speeds
    assert result.status != "done" or (speeds[9] < 0.3 and np.allclose(speeds[11:], 0.3))


def test_the_rest_is_all_but_where_it_was_changed():
    session, _ = talk("slow down near the cup", "a bit faster on the rest", path=LINE, objects=TABLE)
    assert session.current.speeds[10] < 0.3 < session.current.speeds[30]


def test_only_what_is_near_a_thing_is_put_back():
    session, _ = talk("go up by 5 cm", "leave it as it was near the vase", path=LINE, objects=TABLE)
    heights = session.current.positions[:, 2]
    assert heights[0] == pytest.approx(heights[5]) and heights[30] == pytest.approx(LINE.positions[30, 2])


def test_a_path_scaled_at_its_height():
    session, _ = talk("make it twice as large, keep the height", path=CLIMB, objects=TABLE)
    size = np.ptp(session.current.positions, axis=0)
    assert size[2] == pytest.approx(0.4) and size[0] == pytest.approx(4.0)


def test_backwards_begins_where_it_ended_and_needs_no_other_start():
    ends = scene(door=[0.0, 0.15, 0.3], dock=[2.0, 0.15, 0.3])
    _, result = talk("go the other way round, begin at the dock and finish at the door", path=LINE, objects=ends)
    assert np.allclose(result.adapted.positions, LINE.positions[::-1])


@pytest.mark.parametrize("said", ["scale by -2", "scale by a factor of -0.5", "rotate by -30 degrees"])
def test_no_minus_is_dropped_unseen(said):
    assert adapt(LINE, said, scene=TABLE, writer="builtin").status == "needs_confirmation"
