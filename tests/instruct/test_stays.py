"""Stops, starts and goals at one thing stay where a change is about another one, or about a part of the path."""

from importlib.resources import files
from itertools import pairwise

import numpy as np
import pytest

from ovita import Scene, SceneObject, Session, Trajectory, accept, adapt
from ovita.io import load_task
from ovita.paths.geometry import runs

PLATE = SceneObject("plate", np.array([0.5, 0.0, 0.0]), [0.2, 0.2, 0.05])
BIN = SceneObject("bin", np.array([1.0, 0.0, 0.0]), [0.1, 0.1, 0.05])
RACK = SceneObject("rack", np.array([0.0, 0.0, 0.0]), [0.1, 0.1, 0.05])
TABLE = Scene((PLATE, BIN, RACK))


def way(*places, stops=(), speed=0.2, spacing=0.02):
    """A path through places [m] that stands for 20 waypoints at those of some numbers."""
    rows = [np.array([places[0]], dtype=float)]
    for k, (a, b) in enumerate(pairwise(places), 1):
        n = max(int(np.linalg.norm(np.subtract(b, a)) / spacing), 1)
        rows.append(np.linspace(a, b, n + 1)[1:])
        rows += [np.repeat([np.array(b, dtype=float)], 20, axis=0)] if k in stops else []
    path = np.concatenate(rows)
    speeds = np.full(len(path), speed)
    still = (np.diff(path, axis=0) == 0.0).all(axis=1)
    speeds[:-1][still] = speeds[1:][still] = 0.0
    return Trajectory(path, speeds)


CARRY = way((0, 0, 0.06), (0, 0, 0.2), (1, 0, 0.2), (1, 0, 0.06))
SERVED = way((-0.4, 0, 0.2), (0.0, 0.0, 0.1), (0.5, 0.06, 0.15), (1.0, 0.0, 0.1), stops=(1, 3))


def stands(trajectory):
    positions = trajectory.positions
    return [positions[a] for a, _ in runs((np.diff(positions, axis=0) == 0.0).all(axis=1))]


def lowest(trajectory, x):
    positions = trajectory.positions
    return float(positions[np.argmin(np.abs(positions[:, 0] - x)), 2])


def test_higher_over_a_thing_leaves_the_goal_beside_it_alone():
    near = way((0, 0, 0.06), (0, 0, 0.2), (0.64, 0, 0.2), (0.64, 0, 0.06))
    result = adapt(near, "5 cm higher over the plate", scene=Scene((PLATE, RACK)), writer="builtin")
    assert result.status == "done"
    assert lowest(result.adapted, 0.5) == pytest.approx(0.25, abs=0.003)
    assert result.adapted.positions[-1] == pytest.approx(near.positions[-1])


@pytest.mark.parametrize("sentence", ["farther from the plate", "10 cm farther from the plate"])
def test_farther_from_a_thing_leaves_stops_at_others(sentence):
    result = adapt(SERVED, sentence, scene=TABLE, writer="builtin")
    assert result.status == "done"
    away = [np.linalg.norm(t.positions - PLATE.position, axis=1).min() for t in (SERVED, result.adapted)]
    assert away[1] > away[0] + 0.02
    assert np.allclose(stands(result.adapted), stands(SERVED))
    assert np.allclose(result.adapted.positions[[0, -1]], SERVED.positions[[0, -1]])


def test_closer_to_a_thing_leaves_the_ends_that_are_not_about_it():
    vase = SceneObject("vase", np.array([0.5, 0.4, 0.2]), [0.1] * 3)
    result = adapt(CARRY, "closer to the vase", scene=Scene((vase,)), writer="builtin")
    assert result.status == "done"
    assert np.allclose(result.adapted.positions[[0, -1]], CARRY.positions[[0, -1]])
    assert 0.05 < vase.cuboid.closest(result.adapted.positions)[0] < 0.3


def test_an_end_that_moves_takes_no_stop_with_it_and_little_of_the_path():
    result = adapt(SERVED, "end 5 cm further left", scene=TABLE, writer="builtin")
    moved = np.linalg.norm(result.adapted.positions - SERVED.positions, axis=1)
    assert result.status == "done" and moved[-1] == pytest.approx(0.05)
    assert (moved[: len(moved) // 2] == 0.0).all()


def test_between_two_rows_is_all_of_the_lane():
    rows = [
        SceneObject(f"{name} row", np.array([5.0, y, 0.5]), [10.0, 0.4, 1.0])
        for name, y in (("red", 1.5), ("white", -1.5))
    ]
    lane = way((-3, 0, 0.2), (13, 0, 0.2), spacing=0.2, speed=0.5)
    result = adapt(lane, "half speed between the red row and the white row", scene=Scene(tuple(rows)), writer="builtin")
    result = accept(result) if result.proposal is not None else result
    slow = result.adapted.positions[result.adapted.speeds < 0.3, 0]
    assert result.status == "done" and slow.min() < 0.5 and slow.max() > 9.5


def test_to_hover_where_it_stands_already_is_to_wait_there():
    result = adapt(SERVED, "hover 5 seconds at the rack", scene=TABLE, writer="builtin")
    result = accept(result) if result.proposal is not None else result
    assert result.status == "done" and np.allclose(stands(result.adapted)[0], stands(SERVED)[0])
    assert len(result.adapted) - len(SERVED) == 30  # 5 s in all, where it stood for 2


def test_the_whole_of_it_takes_so_long_with_its_stops():
    result = adapt(SERVED, "do the whole thing in 20 seconds", scene=TABLE, writer="builtin")
    assert result.status == "done" and result.adapted.duration == pytest.approx(20.0, abs=0.3)


def test_what_is_large_is_passed_beside():
    ferry = SceneObject("ferry", np.array([5.0, 4.0, 0.5]), [4.0, 2.0, 2.0])
    lane = way((0, 0, 0.5), (10, 0, 0.5), spacing=0.2, speed=0.5)
    result = adapt(lane, "go to the ferry first", scene=Scene((ferry,)), writer="builtin")
    gap = ferry.cuboid.closest(result.adapted.positions)[0]
    assert 0.0 < gap < 1.5


def test_no_stop_and_faster_in_a_part_go_together():
    result = adapt(
        SERVED, "skip the stop at the rack and go a little faster on the way to the bin", scene=TABLE, writer="builtin"
    )
    assert result.usable and len(stands(result.adapted)) == 1


def test_it_stands_longer_where_it_stands_for_an_object():
    desk = SceneObject("desk", np.array([5.0, 1.5, 0.5]), [4.0, 0.6, 1.0])
    door = SceneObject("door", np.array([9.0, 1.0, 0.5]), [0.2, 1.0, 1.0])
    drive = way((0, 0, 0.3), (3.6, 0, 0.3), (10, 0, 0.3), stops=(1,), speed=0.5, spacing=0.2)
    result = adapt(drive, "wait two seconds longer at the desk", scene=Scene((desk, door)), writer="builtin")
    assert result.status == "done" and np.allclose(stands(result.adapted), stands(drive))
    assert len(result.adapted) == len(drive) + 20


def test_near_a_thing_is_no_other_pass_of_the_path():
    lines = [(x, y, 2.0) for y in (0, 12, 24, 36) for x in ((0, 30) if y % 24 == 0 else (30, 0))]
    survey = way(*lines, speed=1.6, spacing=1.5)
    wreck = SceneObject("wreck", np.array([15.0, 24.0, -4.0]), [5.0, 3.0, 2.0])
    result = adapt(survey, "slower over the wreck", scene=Scene((wreck,)), writer="builtin")
    slow = result.adapted.positions[result.adapted.speeds < 1.0]
    assert len(slow) > 3 and (slow[:, 1] == 24.0).all()


def test_near_a_long_thing_is_along_it():
    beam = SceneObject("beam", np.array([10.0, 3.0, 1.0]), [12.0, 0.4, 0.4])
    lane = way((0, 0, 1), (20, 0, 1), speed=1.0, spacing=0.25)
    result = adapt(lane, "slower along the beam", scene=Scene((beam,)), writer="builtin")
    slow = result.adapted.positions[result.adapted.speeds < 0.7, 0]
    assert slow.min() == pytest.approx(3.5, abs=1.5) and slow.max() == pytest.approx(16.5, abs=1.5)


def test_nothing_goes_underground_where_the_path_is_lowered():
    flight = way((0, 0, 0.2), (0, 0, 8), (20, 0, 8), (20, 0, 0.2), spacing=0.5, speed=2.0)
    result = adapt(flight, "2 metres lower", scene=TABLE, writer="builtin")
    assert result.status == "done" and result.adapted.positions[:, 2].min() >= 0.2
    assert np.allclose(result.adapted.positions[30:45, 2], 6.0)


def test_a_wider_berth_leaves_room_beside_another_thing():
    chair, table = (SceneObject(n, np.array([5.0, y, 0.4]), [0.6] * 3) for n, y in (("chair", -1.2), ("table", 1.0)))
    lane = way((0, 0, 0.4), (10, 0, 0.4), spacing=0.2, speed=0.5)
    result = adapt(lane, "more room around the chair", scene=Scene((chair, table)), writer="builtin")
    room = [thing.cuboid.closest(result.adapted.positions)[0] for thing in (chair, table)]
    assert result.status == "done" and room[0] > 0.95 and room[1] >= 0.34


def test_a_wait_that_feedback_adds_to_gets_longer():
    session = Session(SERVED, TABLE, writer="builtin")
    session.say("slower near the plate")
    result = session.say("Also wait two seconds longer at the rack")
    assert result.status == "done" and len(result.adapted) == len(SERVED) + 20


def test_undo_takes_back_an_open_proposal_first():
    session = Session(SERVED, TABLE, writer="builtin")
    session.say("slower near the plate")
    before = session.current
    assert session.say("closer to the plate by 5 cm if it is hot").proposal is not None
    session.say("undo that")
    assert session.current == before and session.pending is None


PLACED = way((-0.4, 0, 0.2), (0.0, 0.0, 0.1), (0.5, 0.06, 0.2), (1.0, 0.0, 0.1), (1.0, 0.0, 0.18), stops=(1, 3))
"""It picks at the rack, sets down at the bin, and draws back."""


def test_the_way_to_a_stop_begins_behind_the_last_one():
    up = adapt(PLACED, "go 5 cm higher on the way to the bin", scene=TABLE, writer="builtin").adapted
    assert np.allclose(stands(up), stands(PLACED)) and np.allclose(up.positions[0], PLACED.positions[0])
    assert lowest(up, 0.5) == pytest.approx(lowest(PLACED, 0.5) + 0.05, abs=0.003)


def test_farther_from_a_thing_moves_the_stop_that_is_nearest_to_it():
    lamp = SceneObject("lamp", np.array([0.2, 0.5, 0.3]), [0.1] * 3)
    camera = SceneObject("vase", np.array([0.0, -0.6, 0.1]), [0.1] * 3)
    result = adapt(SERVED, "5 cm farther from the vase", scene=Scene((lamp, camera)), writer="builtin")
    gap = [camera.cuboid.closest(t.positions)[0] for t in (SERVED, result.adapted)]
    assert result.status == "done" and gap[1] == pytest.approx(gap[0] + 0.05, abs=0.003)


def test_a_word_shifts_a_part_no_nearer_to_a_thing_than_leaves_room():
    walls = [SceneObject(n, np.array([5.0, y, 0.5]), [1.0] * 3) for n, y in (("visitor", -1.6), ("cabinet", 1.4))]
    lane = way((0, 0, 0.5), (10, 0, 0.5), spacing=0.2, speed=0.5)
    result = adapt(lane, "further left when you pass the visitor", scene=Scene(tuple(walls)), writer="builtin")
    assert result.usable and walls[1].cuboid.closest(result.adapted.positions)[0] > 0.25


def test_the_nearest_pass_is_the_one_that_changes_side():
    fan = SceneObject("fan", np.array([0.0, 0.0, 0.5]), [0.2] * 3)
    twice = way((-1.0, 3.0, 0.5), (-1.0, -3.0, 0.5), (0.5, -3.0, 0.5), (0.5, 3.0, 0.5), spacing=0.1)
    result = adapt(twice, "pass the fan on its other side", scene=Scene((fan,)), writer="builtin")
    back = result.adapted.positions[len(twice) * 5 // 8 :]
    assert result.status == "done" and back[np.argmin(np.abs(back[:, 1])), 0] < -0.1


def test_no_way_around_goes_underground():
    person = SceneObject("person", np.array([1.0, 0.0, 0.4]))
    low = way((0, 0, 0.6), (1, 0.02, 0.15), (2, 0, 0.6), spacing=0.05)
    result = adapt(low, "keep half a metre away from the person", scene=Scene((person,)), writer="builtin")
    assert result.usable and result.adapted.positions[:, 2].min() >= 0.0


def test_what_has_no_known_size_is_not_passed_over_by_a_hand():
    mat = SceneObject("mat", np.array([1.0, 0.08, 0.0]))
    result = adapt(way((0, 0, 0.3), (2, 0, 0.3)), "don't fly right over the mat", scene=Scene((mat,)), writer="builtin")
    path = (accept(result) if result.proposal else result).adapted.positions
    assert np.linalg.norm((path - mat.position)[:, :2], axis=1).min() > 0.15


def test_a_question_about_a_contradiction_is_in_plain_words():
    result = adapt(SERVED, "faster near the plate and slower near the plate", scene=TABLE, writer="builtin")
    assert result.status in ("needs_clarification", "not_understood") and "pace" not in result.message


@pytest.mark.parametrize("back", ["undo that", "forget everything"])
def test_a_step_back_and_another_wish_are_two_steps(back):
    session = Session(SERVED, TABLE, writer="builtin")
    session.say("5 cm higher near the plate")
    result = session.say(f"{back} and go 10 cm to the left")
    assert result.status == "done"
    assert np.allclose(result.adapted.positions - SERVED.positions, [-0.1, 0.0, 0.0])


def test_what_draws_back_from_a_rim_follows_its_end_alone():
    turn = np.linspace(0, 2 * np.pi, 60)
    rim = [(0.1 * np.cos(a), 0.1 * np.sin(a), 0.12) for a in turn]
    path = np.array([(0.1, 0.0, 0.15), (0.1, 0.0, 0.135), *rim, (0.1, 0.0, 0.13), (0.1, 0.0, 0.14), (0.1, 0.0, 0.15)])
    result = adapt(Trajectory(path, np.full(len(path), 0.05)), "finish 3 cm higher", scene=Scene(()), writer="builtin")
    assert result.status == "done" and np.allclose(result.adapted.positions[:62], path[:62])
    assert result.adapted.positions[-1] == pytest.approx([0.1, 0.0, 0.18])


def test_between_all_of_several_is_from_the_first_to_the_last():
    piers = Scene(tuple(SceneObject(f"pier {n}", np.array([10.0 * n, 2.0, 0.0]), [1.0] * 3) for n in (1, 2, 3)))
    flight = way((0, 0, 2), (40, 0, 2), spacing=0.5, speed=1.0)
    result = adapt(flight, "20 percent faster between the piers", scene=piers, writer="builtin")
    result = accept(result) if result.proposal is not None else result
    x = flight.positions[result.adapted.speeds > 1.1, 0]
    assert x.min() == pytest.approx(10.0, abs=1.0) and x.max() == pytest.approx(30.0, abs=1.0)


@pytest.mark.parametrize(("said", "at"), [("wait 3 s at the highest point", 8.0), ("wait 3 s at the lowest spot", 0.0)])
def test_the_highest_point_is_a_place(said, at):
    hill = way((0, 0, 0.1), (8, 0, 2.0), (12, 0, 0.5), spacing=0.25, speed=0.5)
    assert stands(adapt(hill, said, scene=TABLE, writer="builtin").adapted)[0][0] == pytest.approx(at, abs=0.3)


def test_too_much_is_what_was_added_last():
    session = Session(SERVED, TABLE, writer="builtin")
    session.say("wait 2 seconds longer at the rack")
    session.say("and slow down near the plate")
    session.say("now 10 cm higher, but only between the plate and the bin")
    result = session.say("that's too much, half of it")
    assert result.status == "done" and lowest(result.adapted, 0.75) == pytest.approx(
        lowest(SERVED, 0.75) + 0.05, abs=0.005
    )


def test_the_man_is_the_only_person_there_is():
    scene = Scene((SceneObject("worker", np.array([0.5, 0.6, 0.2]), [0.3] * 3), PLATE))
    result = adapt(CARRY, "don't go so near to the man", scene=scene, writer="builtin")
    assert result.status == "done" and result.frames[0].named == ("worker",)


def test_stops_that_moved_are_told():
    near = Scene((SceneObject("box", np.array([0.0, 0.15, 0.1]), [0.1] * 3),))
    result = adapt(SERVED, "keep at least 15 cm from the box", scene=near, writer="builtin")
    assert result.usable and any(
        "The stop at waypoint" in line and "moved" in line for line in result.explanation.split("\n")
    )


def test_a_constant_speed_is_as_meant_beside_a_wait():
    result = adapt(
        CARRY, "wait 20 seconds at the start and then drive at a constant 0.1 m/s", scene=TABLE, writer="builtin"
    )
    assert result.status == "done" and np.median(result.adapted.speeds[result.adapted.speeds > 0]) == pytest.approx(0.1)


def test_a_circle_on_the_way_lies_beside_it():
    result = adapt(
        CARRY, "draw a circle with a radius of 10 cm in the middle of the path", scene=TABLE, writer="builtin"
    )
    made = result if result.usable else result.proposal  # the network knows a circle around an object only
    assert made.adapted.length - CARRY.length == pytest.approx(2 * np.pi * 0.1, rel=0.05)


def test_there_is_the_part_that_was_changed():
    session = Session(CARRY, TABLE, writer="builtin")
    session.say("raise the middle part by 10 cm")
    moved = session.say("now also shift it to the left there").adapted.positions - CARRY.positions
    assert (moved[[0, -1]] == 0.0).all() and moved[:, 0].min() < -0.05


def test_an_end_by_a_door_is_on_the_side_of_the_path():
    door = SceneObject("door", np.array([4.0, 0.5, 1.0]), [0.1, 1.6, 2.0])
    drive = way((0, -2, 0), (3, -2, 0), (3, 2, 0), (0, 2, 0), spacing=0.2)
    end = adapt(drive, "end by the door", scene=Scene((door,)), writer="builtin").adapted.positions[-1]
    assert end[0] < 3.95


@pytest.mark.parametrize(("said", "at"), [("pause 1.5 s over the scale", -1), ("wait 2 s above the tray", 0)])
def test_a_wait_over_what_an_end_is_over_is_at_that_end(said, at):
    task = load_task(str(files("ovita") / "data" / "arm-bench.json"))
    result = adapt(task.trajectory, said, scene=task.scene, writer="builtin")
    result = accept(result) if result.proposal is not None else result
    assert result.status == "done" and not result.warnings
    assert np.allclose(stands(result.adapted)[0], task.trajectory.positions[at])
