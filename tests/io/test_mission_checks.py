"""What a mission is commanded to do against what the path says, and what is pointed out before it is flown."""

import json
from dataclasses import replace

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.errors import FormatError, TrajectoryError
from ovita.io import Choices, load_task, save_trajectory
from ovita.io.geodesy import Home, on_earth
from ovita.io.mission_checks import Flight
from ovita.io.mission_files import dumps, dumps_plan, parse_plan
from ovita.io.missions import Item, Mission, mission_from, moved
from ovita.io.setpoints import Course
from ovita.paths.robot import Robot
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

HOME = Home(47.3977419, 8.5455938, 488.2)


def commanded(mission):
    return Flight.of(mission, 1.0).duration


def generated(seed):
    """An outdoor path with legs of 5 to 40 m, speeds from rest to 8 m/s, and stops."""
    chance = np.random.default_rng(seed)
    n = int(chance.integers(4, 30))
    turn = np.cumsum(chance.normal(0, 0.7, n))
    steps = chance.uniform(5, 40, n)[:, None] * np.column_stack([np.cos(turn), np.sin(turn), chance.normal(0, 0.05, n)])
    places = np.cumsum(steps, axis=0) + np.array([0, 0, 30])
    speeds = np.clip(chance.uniform(0.5, 8, n), 0, None)
    speeds[[0, -1]] *= chance.integers(0, 2, 2)
    stops = np.where(chance.random(n) < 0.2, chance.integers(1, 40, n), 0)
    stops[[0, -2, -1]] = 0
    rows = np.repeat(places, stops + 1, axis=0)
    return Trajectory(rows, np.concatenate([[v, *[0.0] * k] for v, k in zip(speeds, stops, strict=True)]))


@pytest.mark.parametrize("seed", range(10))
def test_told_and_commanded_durations_agree(seed):
    path = generated(seed)
    mission, _ = mission_from(path, Scene(), HOME)
    assert commanded(mission) == pytest.approx(path.duration, rel=0.05)
    back = parse_plan(dumps_plan(mission, "f"), "f")
    assert back.trajectory.duration == pytest.approx(commanded(mission), rel=0.05)
    assert back.trajectory.speeds.max() <= path.speeds.max() * 1.01


def mission_of(*stops, speeds=(4.0,)):
    """A mission along a line: (metres, height, hold), and a speed item before the first waypoints."""
    items = []
    for i, (along, height, hold) in enumerate(stops):
        if i < len(speeds):
            items.append(Item(178, 2, (1.0, speeds[i], -1.0, 0.0, 0.0, 0.0, 0.0)))
        place = np.array([0.0, along, height])
        items.append(moved(Item(16, 3, (hold, 0.0, 0.0, None, 0.0, 0.0, 0.0)), place, HOME))
    return Mission(HOME, tuple(items))


@pytest.mark.parametrize(
    "mission",
    [
        mission_of((0, 20, 0), (50, 20, 3), (100, 20, 0), (130, 25, 0)),
        mission_of((0, 20, 0), (50, 20, 0), (100, 20, 0), (150, 20, 0), speeds=(5.0, 5.0, 10.0, 2.0)),
        mission_of((0, 20, 2), (50, 20, 2.5), (100, 20, 1), speeds=(3.0, 6.0, 1.5)),
    ],
)
def test_a_mission_is_read_as_lasting_what_it_commands(mission):
    task = parse_plan(dumps_plan(mission, "f"), "f")
    assert task.trajectory.duration == pytest.approx(commanded(mission), rel=0.01)


@pytest.mark.parametrize(
    "words", ["slow down in the last third", "slow down in the second half", "fly at half the speed"]
)
def test_a_hold_stays_one_item_when_its_part_is_slowed(words, tmp_path):
    task = parse_plan(dumps_plan(mission_of((0, 20, 0), (40, 20, 0), (80, 20, 2.5), (120, 20, 0)), "f"), "f")
    result = adapt(Request(words, task.trajectory, task.scene), writer="builtin")
    save_trajectory(tmp_path / "b.plan", result.adapted, result.scene)
    items = [i for i in json.loads((tmp_path / "b.plan").read_text())["mission"]["items"] if i["command"] == 16]
    assert [i["params"][0] for i in items] == [0, 0, 2.5, 0]
    again = load_task(tmp_path / "b.plan").trajectory
    assert again.duration == pytest.approx(result.adapted.duration, rel=0.05)


@pytest.mark.parametrize("words", ["wait 5 seconds at the middle", "speed up in the second half", "go up by 5"])
@pytest.mark.parametrize("seed", [1, 7])
def test_an_adapted_mission_lasts_as_long_as_its_path(words, seed):
    task = parse_plan(dumps_plan(mission_from(generated(seed), Scene(), HOME)[0], "f"), "f")
    result = adapt(Request(words, task.trajectory, task.scene), writer="builtin")
    mission, _ = mission_from(result.adapted, result.scene, None)
    assert commanded(mission) == pytest.approx(result.adapted.duration, rel=0.021)


def test_a_hold_before_a_limit_on_acceleration_is_no_warning_of_numpy():
    task = parse_plan(dumps_plan(mission_of((0, 20, 0), (80, 20, 2.5), (120, 20, 0)), "f"), "f")
    field = Robot("field", max_speed=10.0, max_acceleration=3.0)
    result = adapt(Request("go higher by 2", task.trajectory, task.scene, field), writer="builtin")
    assert "already breaks the acceleration limit" in " ".join(result.warnings)


PATH_OF_TWO = Trajectory([[0, 0, 20], [0, 30, 20]], [5, 5])


def notes_on(path, **choices):
    return dumps("f.plan", path, Scene(), Choices(home=HOME, **choices), plan=True)


def test_what_an_autopilot_makes_of_it_is_said_in_a_sentence_each():
    crawl = Trajectory([[0, 0, 20], [0, 30, 20], [0, 60, 20]], [5, 0.001, 0.0012])
    text, notes = notes_on(crawl)
    speeds = [i["params"][1] for i in json.loads(text)["mission"]["items"] if i["command"] == 178]
    assert min(speeds) == 0.2
    said = " ".join(notes)
    assert "NOT the path's" in said and "or less is commanded on 1 leg (to waypoint 3)" in said
    assert len(notes) == 3, "how it flies, what is otherwise, what is to do"
    low = " ".join(notes_on(Trajectory([[0, 0, 0], [0, 30, 0.2], [0, 60, 20]], [5, 5, 5]))[1])
    assert "as low as 0.00 m above home (waypoint 1, 2)" in low and "too coarse" in low and "setpoints" not in low
    close = " ".join(notes_on(Trajectory([[0, i, 20] for i in range(8)], [1] * 8))[1])
    assert (
        "7 of 7 legs are shorter than the 2 m" in close and "to do: fly a path as small as this as setpoints" in close
    )
    quick = " ".join(notes_on(Trajectory([[0, 0, 20], [0, 20, 20], [0, 40, 20]], [8, 8, 8]))[1])
    assert "it flies 5.0 s at 8 m/s (and about 3.2 s for speeding up" in quick
    calm = notes_on(Trajectory([[0, 0, 20], [0, 400, 20], [0, 800, 20]], [5, 5, 5]))[1]
    assert not any(word in " ".join(calm) for word in ("the path", "shorter", "slowest", "coarse", "speeding up"))


def test_a_takeoff_is_offered():
    path = Trajectory([[0, 0, 20], [0, 30, 20], [0, 60, 20]], [5, 5, 5])
    text, notes = notes_on(path, takeoff=True)
    items = json.loads(text)["mission"]["items"]
    assert [i["command"] for i in items] == [22, 178, 16, 16, 16] and items[0]["params"][6] == pytest.approx(20)
    home = json.loads(text)["mission"]["plannedHomePosition"]
    assert items[0]["params"][4:6] == pytest.approx(home[:2], abs=1e-7), "not at latitude 0"
    assert any("add landing in" in note for note in notes)
    task = parse_plan(text, "f")
    mission, _ = mission_from(task.trajectory, task.scene, None, takeoff=True)
    assert [item.command for item in mission.items].count(22) == 1


def test_front_points_where_the_heading_says():
    path = Trajectory([[0, 0, 20], [0, 30, 20], [10, 30, 25]], [5, 5, 5])
    text, notes = notes_on(path, heading=90.0)
    assert "front is 90 degrees clockwise from north" in notes[0]
    places = parse_plan(text, "f").trajectory.positions
    np.testing.assert_allclose(places, [[0, 0, 20], [30, 0, 20], [30, -10, 25]], atol=1e-6)
    task = parse_plan(text, "f", heading=90.0)
    np.testing.assert_allclose(task.trajectory.positions, path.positions, atol=1e-6)
    assert dumps_plan(mission_from(task.trajectory, task.scene, None)[0], "f") == text, "unchanged, to the letter"
    with pytest.raises(TrajectoryError, match="where front points is said in the mission it came from"):
        mission_from(task.trajectory, task.scene, None, heading=10.0)
    np.testing.assert_allclose(on_earth(task.trajectory, task.scene).positions, places, atol=1e-6)
    course = Course.of(path, Scene(), Robot("any"), 20.0, heading=90.0)
    np.testing.assert_allclose(course.path.positions, [[0, 0, -20], [0, 30, -20], [-10, 30, -25]], atol=1e-9)


def test_x_of_a_ros_frame_is_east_unless_a_heading_says_where_front_is():
    path, scene = Trajectory([[0, 0, 20], [30, 0, 20]], [5, 5]), Scene(frame=Frame("flu"), extra={"ros": {}})
    for heading, there in ((None, [30, 0, 20]), (0.0, [0, 30, 20]), (90.0, [30, 0, 20])):
        np.testing.assert_allclose(on_earth(path, scene, heading).positions[1], there, atol=1e-9)
        mission, _ = mission_from(path, scene, HOME, heading=heading)
        text = dumps_plan(mission, "f")
        np.testing.assert_allclose(parse_plan(text, "f").trajectory.positions[1], there, atol=1e-6)


def test_a_home_without_altitude_serves_heights_above_home_only():
    home = Home.parse("47.3977,8.5456")
    text, notes = dumps("f.plan", PATH_OF_TWO, Scene(), Choices(home=home), plan=True)
    assert "nobody said home's altitude, so the file says 0 m" in notes[-1] and "no altitude given" in notes[0]
    assert json.loads(text)["mission"]["plannedHomePosition"] == [47.3977, 8.5456, 0]
    task = parse_plan(text, "f", home)
    np.testing.assert_allclose(task.trajectory.positions, PATH_OF_TWO.positions, atol=1e-6)
    above_sea = text.replace('"frame":3', '"frame":0').replace('"frame": 3', '"frame": 0')
    assert above_sea != text and parse_plan(above_sea, "f", replace(home, altitude=5.0))
    with pytest.raises(FormatError, match=r"the home has no altitude; .*--home latitude,longitude,altitude"):
        parse_plan(above_sea, "f", home)
