"""Places above, below or beside a thing are outside of it, and those of a robot on the ground are on the ground."""

from dataclasses import replace

import numpy as np
import pytest

from ovita import Request, Robot, Scene, SceneObject, Trajectory, adapt
from ovita.paths.scene import Frame
from ovita.policy.environment import scene_from_json, scene_to_json
from ovita.result import Adaptation, Postcondition, judged_status
from ovita.toolkit import judge
from ovita.toolkit.approach import closer
from ovita.toolkit.catalogue import Expectation
from ovita.toolkit.moves import midpoint

S = np.linspace(0.0, 1.0, 60)
FLIGHT = Trajectory(np.column_stack([2 * S - 1, 0.15 * np.sin(3 * S), 0.5 + 0.1 * np.sin(2 * S)]), np.full(60, 0.3))
TOWER = SceneObject("tower", [0.9, 0.5, 0.5], [0.3, 0.3, 1.0])
CUP = SceneObject("cup", [0.2, 0.4, 0.25], [0.08, 0.08, 0.1])
SHELF = SceneObject("shelf", [-0.3, -0.6, 1.0], [0.6, 0.3, 0.04])
ROOM = Scene((TOWER, CUP, SHELF))

DRIVE = Trajectory(np.column_stack([4 * S - 2, 0.4 * np.sin(3 * S), np.zeros(60)]), np.full(60, 0.4))
NURSE = SceneObject("nurse", [0.2, 1.4, 0.85], [0.5, 0.4, 1.7])
DOG = SceneObject("dog", [0.3, -1.0, 0.3], [0.7, 0.3, 0.6])
CRATE = SceneObject("crate", [1.6, 1.0, 0.25], [0.5, 0.5, 0.5])
LAMP = SceneObject("lamp", [-1.0, -0.9, 1.4], [0.1, 0.1, 0.1])
WARD = Scene((NURSE, DOG, CRATE, LAMP))


def shown(sentence, path=FLIGHT, scene=ROOM, robot="drone"):
    """A result, or what waits for a yes."""
    result = adapt(Request(sentence, path, scene, Robot.preset(robot)), writer="builtin")
    return result.proposal or result


def gap(item, points):
    """Distance of points to an upright box [m], by code of its own; negative inside."""
    beyond = np.abs(points - item.position) - np.asarray(item.dimensions) / 2
    return np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0)


@pytest.mark.parametrize(
    ("sentence", "item", "axis", "sign"),
    [
        ("end above the tower", TOWER, 2, 1),
        ("finish over the tower", TOWER, 2, 1),
        ("the goal should be above the tower", TOWER, 2, 1),
        ("end just above the tower", TOWER, 2, 1),
        ("start above the cup", CUP, 2, 1),
        ("put the goal below the shelf", SHELF, 2, -1),
        ("end behind the tower", TOWER, 1, -1),
        ("end next to the tower", TOWER, None, 0),
        ("end by the cup", CUP, None, 0),
    ],
)
def test_an_end_beside_a_thing_is_outside_of_it(sentence, item, axis, sign):
    result = shown(sentence)
    assert result.status in ("done", "limited") and all(p.held for p in result.postconditions)
    end = result.adapted.positions[0 if "start" in sentence else -1]
    assert 0.05 < gap(item, end) < 0.3
    assert item.name not in result.contacts
    if axis is not None:
        assert sign * (end - item.position)[axis] > item.dimensions[axis] / 2
        assert np.delete(np.abs(end - item.position), axis).max() < 0.05


@pytest.mark.parametrize("sentence", ["end 10 cm from the tower", "finish 10 cm short of the tower"])
def test_an_end_so_far_from_a_thing_is_not_moved_by_so_much(sentence):
    assert gap(TOWER, shown(sentence).adapted.positions[-1]) == pytest.approx(0.1, abs=0.02)


def test_an_end_that_is_named_is_moved_by_so_much():
    moved = shown("move the end 10 cm away from the tower")
    before, after = (gap(TOWER, path.positions[-1]) for path in (FLIGHT, moved.adapted))
    assert after - before == pytest.approx(0.1, abs=0.03)


def test_a_way_by_a_thing_is_no_way_through_it():
    for sentence in ("go by the tower", "swing by the cup"):
        result = shown(sentence)
        item = TOWER if "tower" in sentence else CUP
        assert not result.contacts and 0.05 < gap(item, result.adapted.positions).min() < 0.15


@pytest.mark.parametrize(
    "sentence",
    [
        "go between the nurse and the dog",
        "end at the crate",
        "end between the nurse and the crate",
        "go on to the crate",
        "start at the lamp",
        "visit the dog, then the crate",
        "end toward the nurse",
        "scale it by 0.5 about the crate",
        "move closer to the lamp",
    ],
)
@pytest.mark.parametrize("robot", ["ground", "none"])
def test_a_robot_on_the_ground_goes_to_places_on_the_ground(sentence, robot):
    result = shown(sentence, DRIVE, WARD, robot)
    assert np.abs(result.proposed.positions[:, 2]).max() < 1e-9
    assert all(p.held_before for p in result.postconditions)


def test_a_rover_between_two_things_is_between_them():
    result = shown("go between the nurse and the dog", DRIVE, WARD, "ground")
    assert result.status == "done"
    assert np.linalg.norm(result.adapted.positions - [0.25, 0.2, 0.0], axis=1).min() < 0.09


@pytest.mark.parametrize("sentence", ["end 20 cm above the crate", "end on the crate", "pass over the dog"])
def test_what_a_rover_cannot_do_is_not_as_meant(sentence):
    assert shown(sentence, DRIVE, WARD, "ground").status == "not_as_meant"


def test_a_robot_that_flies_leaves_the_ground_for_a_place_above_it():
    result = adapt(Request("end at the lamp", DRIVE, WARD, Robot("bird")), writer="builtin")
    assert result.adapted.positions[-1, 2] == pytest.approx(1.4, abs=0.02)


def test_a_promise_in_the_plane_is_judged_there_when_it_is_read_again(tmp_path):
    result = shown("start at the lamp", DRIVE, Scene((LAMP,)), "ground")
    assert result.status == "done"
    result.save(tmp_path / "result.json")
    again = Adaptation.load(tmp_path / "result.json")
    paths = again.original.to_array(), again.adapted.to_array()
    told = [Expectation(p.kind, p.arguments, p.text) for p in again.postconditions]
    assert again.scene.frame.level is None and told and all(judge(one, *paths, again.scene).held for one in told)


def test_the_plane_goes_along_into_the_sandbox_and_leaves_frames_equal():
    kept = Frame("flu", level=0.4)
    assert scene_from_json(scene_to_json(Scene((CRATE,), kept))).frame.level == 0.4
    assert kept == Frame("flu") and midpoint(NURSE, DOG, frame=kept)[2] == 0.4


def test_a_path_under_a_thing_is_pulled_closer_without_a_jump():
    rows = closer(DRIVE.to_array(), LAMP, 0.4)
    steps = np.linalg.norm(np.diff(rows[:, :3], axis=0), axis=1)
    assert steps.max() < 0.2 and np.abs(rows[:, 2]).max() == 0.0


@pytest.mark.parametrize(
    "sentence",
    [
        "stay lower than 0.8 and stay above 1.2",
        "stay above 1.2 m and never higher than 0.8 m",
        "end at the cup and end at the tower",
        "stay at the same height but rise by 10 cm",
    ],
)
def test_what_contradicts_itself_or_is_lost_is_never_done_at_once(sentence):
    result = adapt(Request(sentence, FLIGHT, ROOM, Robot.preset("drone")), writer="builtin")
    assert result.status in ("needs_clarification", "needs_confirmation", "not_understood")


@pytest.mark.parametrize(
    ("by", "undone", "status"), [(0.006, 0.0, "done"), (0.03, 0.0, "limited"), (0.006, 0.5, "limited")]
)
def test_what_nobody_sees_of_the_limits_is_done(by, undone, status):
    result = shown("end 20 cm above the tower")
    (check, *rest) = result.constraints.checks
    checks = (replace(check, violation_before=by, violation_after=0.0), *rest)
    verdict = replace(result.constraints, status="repaired", checks=checks, max_shift=by)
    promise = Postcondition("the path moves", True, True, "it moved", 0.02, 0.02 * (1 - undone))
    assert judged_status(verdict, [promise]) == status


@pytest.mark.parametrize("low", [0.2, 0.55])
def test_a_height_between_two_is_no_height_in_the_middle(low):
    result = shown(f"keep the height between {100 * low:g} and 90 cm")
    heights = result.adapted.positions[:, 2]
    assert result.status == "done" and heights.min() > low - 0.01 and np.ptp(heights) > 0.04


def test_a_distance_between_two_holds_both():
    result = shown("stay between 10 and 90 cm from the cup")
    away = np.linalg.norm(result.adapted.positions - CUP.position, axis=1)
    assert result.status in ("done", "limited") and away.max() < 0.92 and gap(CUP, result.adapted.positions).min() > 0.1


def test_a_way_that_is_denied_and_not_taken_is_left_as_it_is():
    result = adapt(Request("never fly over the cup", FLIGHT, ROOM), writer="builtin")
    assert result.status == "done" and np.array_equal(result.adapted.positions, FLIGHT.positions)


def test_what_rolls_on_the_floor_ends_beside_what_stands_there():
    tank = SceneObject("aquarium", [5.0, 1.5, 0.6], [0.4, 0.4, 1.2])
    drive = Trajectory(np.column_stack([np.linspace(0, 10, 51), np.zeros(51), np.zeros(51)]), np.full(51, 0.5))
    result = adapt(Request("end at the aquarium", drive, Scene((tank,))), writer="builtin")
    path = (result.proposal or result).adapted.positions
    assert 0.02 < tank.cuboid.closest(path)[0] < 0.3
