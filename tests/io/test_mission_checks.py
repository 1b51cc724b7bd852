"""What a mission is commanded to do against what the path says, and what is pointed out before it is flown."""

import json

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.io import Choices, load_task, save_trajectory
from ovita.io.geodesy import Home
from ovita.io.mission_checks import commanded_duration
from ovita.io.mission_files import dumps_plan, parse_plan
from ovita.io.missions import Item, Mission, mission_from, moved
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

HOME = Home(47.3977419, 8.5455938, 488.2)


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
    assert commanded_duration(mission) == pytest.approx(path.duration, rel=0.05)
    back = parse_plan(dumps_plan(mission, "f"), "f")
    assert back.trajectory.duration == pytest.approx(commanded_duration(mission), rel=0.05)
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
    assert task.trajectory.duration == pytest.approx(commanded_duration(mission), rel=0.01)


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


def test_a_hold_before_a_limit_on_acceleration_is_no_warning_of_numpy():
    task = parse_plan(dumps_plan(mission_of((0, 20, 0), (80, 20, 2.5), (120, 20, 0)), "f"), "f")
    field = Robot("field", max_speed=10.0, max_acceleration=3.0)
    result = adapt(Request("go higher by 2", task.trajectory, task.scene, field), writer="builtin")
    assert "already breaks the acceleration limit" in " ".join(result.warnings)


def notes_on(path, **choices):
    from ovita.io.mission_files import dumps

    return dumps("f.plan", path, Scene(), Choices(home=HOME, **choices), plan=True)


def test_what_an_autopilot_makes_of_it_is_said_in_a_sentence_each():
    crawl = Trajectory([[0, 0, 20], [0, 30, 20], [0, 60, 20]], [5, 0.001, 0.0012])
    text, notes = notes_on(crawl)
    speeds = [i["params"][1] for i in json.loads(text)["mission"]["items"] if i["command"] == 178]
    assert min(speeds) == 0.2
    said = " ".join(notes)
    assert "the path says" in said and "the way to waypoint 3 is commanded at 0.2 m/s" in said
    low = " ".join(notes_on(Trajectory([[0, 0, 0], [0, 30, 0.2], [0, 60, 20]], [5, 5, 5]))[1])
    assert "waypoint 1, 2 is lower than 1 m (0.00 m above home)" in low and "fly it as setpoints" in low
    close = " ".join(notes_on(Trajectory([[0, i, 20] for i in range(8)], [1] * 8))[1])
    assert "7 of 7 legs are shorter than the 2 m" in close
    quick = " ".join(notes_on(Trajectory([[0, 0, 20], [0, 20, 20], [0, 40, 20]], [8, 8, 8]))[1])
    assert "commanded: 5.0 s" in quick and "at 2.5 m/s^2 adds about 3.2 s" in quick
    calm = notes_on(Trajectory([[0, 0, 20], [0, 400, 20], [0, 800, 20]], [5, 5, 5]))[1]
    assert not any(word in " ".join(calm) for word in ("the path says", "shorter", "slowest", "coarse", "speeding up"))


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
