"""Drone missions: plans and QGC WPL text, what is kept untouched, and what is refused."""

import copy
import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from ovita.errors import FormatError, TrajectoryError
from ovita.io import Choices, load_task, mission_files, missions, save_task, save_trajectory
from ovita.io.geodesy import Home, on_earth, to_geodetic, to_local
from ovita.io.missions import Item, Mission, mission_from, numbered
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory

HOME = Home(47.3977419, 8.5455938, 488.2)


def simple(command, jump, params, frame=3, **more):
    item = {"type": "SimpleItem", "command": command, "frame": frame, "autoContinue": True, "doJumpId": jump}
    if frame != 2:
        mode = {3: 1, 0: 2, 10: 4}[frame]
        item |= {"Altitude": params[6], "AltitudeMode": mode, "AMSLAltAboveTerrain": None}
    return item | {"params": params} | more


def waypoint(jump, east, north, up, hold=0, above_sea=False, **more):
    lat, lon, _ = to_geodetic(np.array([[east, north, up]]), HOME)[0]
    height = round(HOME.altitude + up, 6) if above_sea else up
    return simple(16, jump, [hold, 0, 0, None, round(lat, 9), round(lon, 9), height], 0 if above_sea else 3, **more)


PLAN = {
    "fileType": "Plan",
    "geoFence": {
        "circles": [],
        "polygons": [{"inclusion": True, "polygon": [[47.3, 8.5]], "version": 1}],
        "version": 2,
    },
    "groundStation": "QGroundControl",
    "mission": {
        "cruiseSpeed": 15,
        "firmwareType": 12,
        "globalPlanAltitudeMode": 1,
        "hoverSpeed": 4,
        "items": [
            simple(22, 1, [15, 0, 0, None, 47.3977419, 8.5455938, 20]),
            waypoint(2, 10, 0, 20),
            simple(178, 3, [1, 6.5, -1, 0, 0, 0, 0], frame=2),
            waypoint(4, 40, 10, 25, hold=2.5, vendorKey={"kept": [1, 2]}),
            simple(205, 5, [-90, 0, 0, 0, 0, 0, 2], frame=2),
            simple(2000, 6, [0, 0, 1, None, None, None, None], frame=2),
            waypoint(7, 60, 40, 25),
            {"type": "ComplexItem", "complexItemType": "survey", "version": 5, "any": [1, {"thing": None}]},
            simple(177, 8, [4, 2, 0, 0, 0, 0, 0], frame=2),
            waypoint(9, 80, 40, 20, above_sea=True),
            simple(20, 10, [0, 0, 0, 0, 0, 0, 0], frame=2),
        ],
        "plannedHomePosition": [47.3977419, 8.5455938, 488.2],
        "vehicleType": 2,
        "version": 2,
    },
    "rallyPoints": {"points": [[47.4, 8.55, 50]], "version": 2},
    "version": 1,
}
WPL = """QGC WPL 110
0\t1\t0\t16\t0.15\t0\t0\t0\t47.3977419\t8.5455938\t488.2\t1
1\t0\t3\t22\t0.0\t0.0\t0.0\t0.0\t0\t0\t20.0\t1
2\t0\t3\t16\t1.5\t2\t0\t0\t47.398\t8.546\t20\t1
3\t0\t3\t178\t0\t3.5\t0\t0\t0\t0\t0\t1
4\t0\t0\t19\t4\t0\t0\t0\t47.3985\t8.546\t508.5\t1
5\t0\t3\t177\t2\t1\t0\t0\t0\t0\t0\t1
6\t0\t3\t82\t0\t0\t0\t0\t47.3985\t8.547\t20\t1
7\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


@pytest.fixture
def task(tmp_path):
    (tmp_path / "a.plan").write_text(json.dumps(PLAN))
    return load_task(tmp_path / "a.plan")


def items_of(path):
    return json.loads(path.read_text())["mission"]["items"]


def test_a_plan_becomes_local_metres_with_its_speeds_and_holds(task):
    path = task.trajectory
    assert len(path) == 4 + 25 + 1 and path.timestep == 0.1
    stations = [0, 1, 28, 29]
    expected = [[10, 0, 20], [40, 10, 25], [60, 40, 25], [80, 40, 20]]
    np.testing.assert_allclose(path.positions[stations], expected, atol=2e-3)
    np.testing.assert_allclose(path.positions[stations][:3, 2], [20, 25, 25], atol=1e-3)
    assert (path.speeds[[0, 1, 27, 28, 29]] == 6.5).all() and (path.speeds[2:27] == 0).all()
    assert task.scene.frame == Frame("rfu") and task.fixed_frame
    kept = next(note for note in task.notes if note.startswith("kept untouched"))
    for name in ("NAV_TAKEOFF (item 1)", "DO_MOUNT_CONTROL (item 5)", "pattern (item 8)", "NAV_RETURN_TO_LAUNCH"):
        assert name in kept


def test_an_unchanged_plan_is_written_back_to_the_letter(task, tmp_path):
    save_task(tmp_path / "b.plan", task)
    assert json.loads((tmp_path / "b.plan").read_text()) == PLAN
    assert list(json.loads((tmp_path / "b.plan").read_text())) == list(PLAN)
    save_task(tmp_path / "c.json", task)
    again = load_task(tmp_path / "c.json")
    assert again.fixed_frame and again.scene == task.scene and again.trajectory == task.trajectory
    save_task(tmp_path / "d.plan", again)
    assert json.loads((tmp_path / "d.plan").read_text()) == PLAN


def test_only_what_changed_is_written_anew(task, tmp_path):
    positions, speeds = task.trajectory.positions.copy(), task.trajectory.speeds.copy()
    positions[28] += [0, 0, 3]
    speeds[29] = 2.25
    save_task(tmp_path / "b.plan", replace(task, trajectory=task.trajectory.with_(positions=positions, speeds=speeds)))
    items, before = items_of(tmp_path / "b.plan"), PLAN["mission"]["items"]
    assert items[:6] == before[:6] and items[7:9] == before[7:9] and items[11] == before[10]
    assert items[6]["params"][6] == pytest.approx(28, abs=1e-6) == items[6]["Altitude"]
    assert items[6]["params"][:4] == [0, 0, 0, None] and items[6]["doJumpId"] == 7
    np.testing.assert_allclose(items[6]["params"][4:6], before[6]["params"][4:6], atol=1e-9)
    assert (
        items[9]["command"] == 178
        and items[9]["params"][:3] == [1, (6.5 + 2.25) / 2, -1]
        and items[9]["doJumpId"] == 11
    )
    assert items[10] == before[9]
    back = load_task(tmp_path / "b.plan").trajectory
    np.testing.assert_allclose(back.positions, positions, atol=1e-6)
    assert back.duration == pytest.approx(task.trajectory.with_(positions=positions, speeds=speeds).duration)


def test_speed_commands_and_holds_are_changed_in_place(task, tmp_path):
    path = task.trajectory
    keep = np.r_[0:2, 7:30]
    shorter = Trajectory(path.positions[keep], np.where(path.speeds == 6.5, 3.0, path.speeds)[keep], None, 0.1)
    save_task(tmp_path / "b.plan", replace(task, trajectory=shorter))
    items, before = items_of(tmp_path / "b.plan"), copy.deepcopy(PLAN["mission"]["items"])
    before[2]["params"][1] = 3
    before[3]["params"][0] = 2
    assert items == before
    assert load_task(tmp_path / "b.plan").trajectory == shorter


def test_inserted_and_removed_waypoints_carry_other_items_along(task, tmp_path):
    path = task.trajectory
    middle = (path.positions[0] + path.positions[1]) / 2
    longer = Trajectory(np.insert(path.positions, 1, middle, axis=0), np.insert(path.speeds, 1, 6.5))
    notes = save_task(tmp_path / "b.plan", replace(task, trajectory=longer))
    assert any("5 waypoints instead of 4" in note for note in notes)
    items = items_of(tmp_path / "b.plan")
    assert [i.get("command") for i in items] == [22, 16, 178, 16, 178, 16, 205, 2000, 16, None, 177, 16, 20]
    assert items[:2] == PLAN["mission"]["items"][:2] and items[5:] == PLAN["mission"]["items"][3:]
    assert items[3]["doJumpId"] == 12 and items[3]["params"][0] == 0
    fewer = Trajectory(path.positions[[0, 28, 29]], path.speeds[[0, 28, 29]])
    save_task(tmp_path / "c.plan", replace(task, trajectory=fewer))
    items = items_of(tmp_path / "c.plan")
    assert [i.get("command") for i in items if i.get("command") != 178] == [22, 16, 205, 2000, 16, None, 177, 16, 20]
    assert len(load_task(tmp_path / "c.plan").trajectory) == 3


def test_waypoint_text_both_ways(tmp_path):
    (tmp_path / "a.waypoints").write_text(WPL)
    task = load_task(tmp_path / "a.waypoints")
    assert len(task.trajectory) == 3 + 15 + 40 + 2
    assert task.trajectory.speeds[[0, 16, -1]].tolist() == [3.5, 3.5, 3.5]
    save_task(tmp_path / "b.txt", task)
    written = [[float(c) for c in line.split()] for line in (tmp_path / "b.txt").read_text().splitlines()[1:]]
    assert written == [[float(c) for c in line.split()] for line in WPL.splitlines()[1:]]
    assert load_task(tmp_path / "b.txt").trajectory == task.trajectory
    save_task(tmp_path / "c.plan", task)
    assert load_task(tmp_path / "c.plan").trajectory == task.trajectory
    positions = task.trajectory.positions.copy()
    positions[17:59] += [1, 2, 3]
    save_task(tmp_path / "d.wpl", replace(task, trajectory=task.trajectory.with_(positions=positions)))
    back = load_task(tmp_path / "d.wpl").trajectory
    np.testing.assert_allclose(back.positions, positions, atol=1e-7)
    assert (tmp_path / "d.wpl").read_text().splitlines()[:5] == (tmp_path / "b.txt").read_text().splitlines()[:5]


def test_jumps_point_at_sequence_numbers_in_text(task, tmp_path):
    items = tuple(item for item in Mission.from_dict(task.scene.extra["mission"]).items if item.command != -1)
    mission = replace(Mission.from_dict(task.scene.extra["mission"]), items=items)
    jump = next(item for item in numbered(mission, with_home=True) if item.command == 177)
    assert jump.params[0] == 4 and numbered(mission, with_home=True)[4].params[0] == 2.5
    bare = next(item for item in numbered(mission, with_home=False) if item.command == 177)
    assert bare.params[0] == 3 and numbered(mission, with_home=False)[3].params[0] == 2.5
    with pytest.raises(FormatError, match=r"item 8 is a pattern \(survey\) that only QGroundControl unfolds"):
        save_task(tmp_path / "x.waypoints", task)
    assert not (tmp_path / "x.waypoints").exists()


def test_text_without_home_as_its_first_item(tmp_path):
    lines = ["QGC WPL 110", "0\t1\t3\t22\t0\t0\t0\t0\t47.398\t8.546\t20\t1"]
    lines += [f"{i}\t0\t3\t16\t0\t0\t0\t0\t47.39{i}\t8.546\t20\t1" for i in (1, 2)]
    (tmp_path / "a.wpl").write_text("\n".join(lines))
    with pytest.raises(FormatError, match=r"there is no home position.*--home"):
        load_task(tmp_path / "a.wpl")
    task = load_task(tmp_path / "a.wpl", Choices(home=HOME))
    save_task(tmp_path / "b.wpl", task)
    assert (tmp_path / "b.wpl").read_text().split() == "\n".join(lines).split()


def test_a_new_mission_needs_a_home(tmp_path):
    path = Trajectory([[0, 0, 5], [3, 4, 5], [3, 4, 5], [3, 4, 5], [3, 8, 6]], [2, 2, 0, 0, 1.5], None, 0.5)
    scene = Scene((SceneObject("tree", [9, 9, 9]),), Frame("flu"))
    with pytest.raises(FormatError, match=r"there is no home position.*--home"):
        save_trajectory(tmp_path / "a.plan", path, scene)
    assert not (tmp_path / "a.plan").exists()
    notes = save_trajectory(tmp_path / "a.plan", path, scene, choices=Choices(home=HOME))
    said = " ".join(notes)
    assert "takeoff (or say --takeoff) and landing" in said and "it holds no objects" in said
    items = items_of(tmp_path / "a.plan")
    assert [item["command"] for item in items] == [178, 16, 16, 178, 16] and items[2]["params"][0] == 1.0
    back = load_task(tmp_path / "a.plan").trajectory
    east_north = path.positions[[0, 1, -1]] @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(back.positions[[0, 1, -1]], east_north, atol=1e-8)
    assert back.duration == pytest.approx(path.duration)
    save_trajectory(tmp_path / "a.waypoints", path, scene, choices=Choices(home=HOME))
    text = load_task(tmp_path / "a.waypoints").trajectory
    np.testing.assert_allclose(text.positions, back.positions, atol=1e-9)


def test_rest_is_no_speed_that_can_be_commanded(tmp_path):
    path = Trajectory([[0, 0, 5], [4, 0, 5], [8, 0, 5]], [0, 2, 0])
    notes = save_trajectory(tmp_path / "a.plan", path, choices=Choices(home=HOME))
    assert any("each leg has its mean speed" in note for note in notes)
    speeds = [item["params"][1] for item in items_of(tmp_path / "a.plan") if item["command"] == 178]
    assert speeds == [1.0]
    still = Trajectory([[0, 0, 5], [4, 0, 5], [8, 0, 5], [9, 0, 5]], [0, 0, 0, 2])
    notes = save_trajectory(tmp_path / "b.plan", still, choices=Choices(home=HOME))
    assert any("no mission can command a speed of 0" in note for note in notes)
    speeds = [item["params"][1] for item in items_of(tmp_path / "b.plan") if item["command"] == 178]
    assert speeds == [5.0, 1.0]


@given(
    st.lists(
        st.tuples(*[st.floats(-2000, 2000)] * 2, st.floats(0, 120), st.floats(0.5, 15), st.integers(0, 30)),
        min_size=2,
        max_size=12,
    ),
    st.booleans(),
)
@example([(0.0, 0.0, 1e-175, 1.0, 1), (0.0, 0.0, 0.0, 1.0, 0)], False)  # waypoints that fall into one
@settings(derandomize=True, deadline=None, max_examples=60)
def test_round_trips(stations, text):
    positions = np.repeat([s[:3] for s in stations], [1 + s[4] for s in stations], axis=0)
    if (np.diff([s[:3] for s in stations], axis=0) == 0).all(axis=1).any():
        return
    speeds = np.concatenate([[s[3], *[0.0] * s[4]] for s in stations])
    path = Trajectory(positions, speeds)
    mission, _ = mission_from(path, Scene(), HOME)
    before = missions.gathered(on_earth(path, Scene()))
    if len(before) < 2:
        return
    back = (
        mission_files.parse_wpl(mission_files.dumps_wpl(mission), "f")
        if text
        else mission_files.parse_plan(mission_files.dumps_plan(mission, "f"), "f")
    )
    after = missions.gathered(back.trajectory)
    np.testing.assert_allclose([w.position for w in after], [w.position for w in before], atol=1e-6)
    np.testing.assert_allclose([w.hold for w in after], [w.hold for w in before])
    assert back.trajectory.duration == pytest.approx(path.duration, rel=0.02)


@given(st.data())
@settings(derandomize=True, deadline=None, max_examples=60)
def test_whatever_is_edited_comes_out_and_the_rest_stays(data):
    task = mission_files.parse_plan(json.dumps(PLAN), "f")
    stations = [list(s) for s in zip(*_stations(task.trajectory), strict=True)]
    for _ in range(data.draw(st.integers(1, 5))):
        k = data.draw(st.integers(0, len(stations) - 1))
        edit = data.draw(st.sampled_from(["move", "speed", "hold", "insert", "remove"]))
        if edit == "insert":
            stations.insert(k, [stations[k][0] + [data.draw(st.floats(0.5, 20)), 0, 1], 3.0, 0])
        elif edit == "remove" and len(stations) > 2:
            stations.pop(k)
        elif edit == "move":
            stations[k][0] = stations[k][0] + data.draw(st.integers(1, 9))
        elif edit == "speed":
            stations[k][1] = data.draw(st.floats(0.5, 9))
        elif edit == "hold":
            stations[k][2] = data.draw(st.integers(0, 12))
    repeats = [1 + hold for _, _, hold in stations]
    speeds = np.concatenate([[speed, *[0.0] * hold] for _, speed, hold in stations])
    path = Trajectory(np.repeat([p for p, _, _ in stations], repeats, axis=0), speeds)
    if (np.diff([p for p, _, _ in stations], axis=0) == 0).all(axis=1).any():
        return
    written = json.loads(mission_files.dumps_plan(mission_from(path, task.scene, None)[0], "f"))
    back = mission_files.parse_plan(json.dumps(written), "f").trajectory
    before, after = missions.gathered(path), missions.gathered(back)
    np.testing.assert_allclose([w.position for w in after], [w.position for w in before], atol=1e-6)
    assert [w.hold for w in after] == pytest.approx([w.hold for w in before]) and back.timestep == 0.1
    assert back.duration == pytest.approx(path.duration, rel=0.05)
    others = [[i for i in d["mission"]["items"] if i.get("command") not in (16, 178)] for d in (PLAN, written)]
    assert others[0] == others[1]
    jumps = [item["doJumpId"] for item in written["mission"]["items"] if "doJumpId" in item]
    assert len(set(jumps)) == len(jumps)
    assert {key: written[key] for key in ("geoFence", "rallyPoints")} == {
        k: PLAN[k] for k in ("geoFence", "rallyPoints")
    }


def _stations(path):
    """Positions, speeds and dwell counts of the waypoints that are no dwells."""
    stays = (np.diff(path.positions, axis=0) == 0).all(axis=1)
    starts = np.flatnonzero(~np.concatenate([[False], stays]))
    return path.positions[starts], path.speeds[starts], np.diff([*starts, len(path)]) - 1


def test_heights_in_every_frame():
    lat, lon, _ = to_geodetic(np.array([[30.0, 40.0, 0.0]]), HOME)[0]
    frames = {
        0: (lat, lon, 500.0),
        5: (lat, lon, 500.0),
        3: (lat, lon, 11.8),
        6: (lat, lon, 11.8),
        1: (40.0, 30.0, -11.8),
        4: (30.0, 40.0, 11.8),
    }
    for frame, place in frames.items():
        items = (Item(16, frame, (0.0, 0.0, 0.0, None, *place)), Item(16, 4, (0.0, 0.0, 0.0, None, 1.0, 2.0, 3.0)))
        kept = {"mission": Mission(HOME, items).to_dict()}
        path = Trajectory([[30.0, 40.0, 20.0], [1.0, 2.0, 3.0]], [5, 5])
        item = mission_from(path, Scene(extra=kept), None)[0].items[0]
        at = to_local(np.array([[*item.params[4:6], 500 + 8.2]]), HOME)[0]
        if frame in (1, 4):
            assert item.params[4:] == ((40.0, 30.0, -20.0) if frame == 1 else (30.0, 40.0, 20.0))
        else:
            np.testing.assert_allclose(at, [30, 40, 20], atol=1e-3)
            assert item.params[6] == pytest.approx(508.2 if frame in (0, 5) else 20.0, abs=1e-3)


def broken(change):
    document = copy.deepcopy(PLAN)
    change(document)
    return json.dumps(document)


def set_at(*path_and_value):
    *path, last, value = path_and_value

    def change(document):
        for key in path:
            document = document[key]
        document[last] = value

    return change


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("{", "this is not JSON"),
        (broken(set_at("fileType", "Fence")), "fileType is 'Fence', expected 'Plan'"),
        (broken(set_at("mission", [])), "there is no mission with a list of items"),
        (broken(set_at("mission", "plannedHomePosition", [0, 0, 0])), "there is no home position.*--home"),
        (broken(set_at("mission", "plannedHomePosition", [0, None, 0])), "there is no home|not a number"),
        (broken(set_at("mission", "plannedHomePosition", [95, 8, 0])), "latitude 95"),
        (broken(set_at("mission", "hoverSpeed", 0)), "expected a speed > 0"),
        (broken(set_at("mission", "items", 1, 7)), r"items\[1\] is 7"),
        (broken(set_at("mission", "items", 1, "params", [1])), r"items\[1\].params holds 1 values, expected 7"),
        (broken(set_at("mission", "items", 1, "params", 4, "x")), r"items\[1\].params\[4\] is 'x', not a number"),
        (broken(set_at("mission", "items", 1, "command", "go")), r"items\[1\].command is 'go'"),
        (broken(set_at("mission", "items", 1, "params", 4, None)), r"item 2 \(NAV_WAYPOINT\) has no position"),
        (broken(set_at("mission", "items", 1, "params", 4, 91.5)), "no place on earth"),
        (broken(set_at("mission", "items", 1, "frame", 10)), "height above the terrain"),
        (broken(set_at("mission", "items", 1, "AltitudeMode", 3)), "height above the terrain"),
        (broken(set_at("mission", "items", 1, "frame", 8)), "has the frame 8"),
        (broken(set_at("mission", "items", PLAN["mission"]["items"][:2])), "holds 1 waypoint .*at least 2"),
        (json.dumps(PLAN).replace("488.2", "NaN"), "not a finite number"),
    ],
)
def test_plans_that_cannot_be_read(content, problem):
    with pytest.raises(FormatError, match=problem) as caught:
        mission_files.parse_plan(content, "f.plan")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("QGC WPL 99\n", "the first line is not 'QGC WPL 110'"),
        ("QGC WPL 110\n", "there is no home position"),
        ("QGC WPL 110\n0\t1\t0\n", "line 2 holds 3 values, expected 12"),
        (WPL.replace("47.398\t", "north\t"), "line 4: 'north' is not a number"),
        (WPL.replace("2\t0\t3\t16", "2\t0\t3.5\t16"), "line 4: index, current, frame"),
        (WPL.replace("47.398\t", "nan\t"), r"item 2 \(NAV_WAYPOINT\) has no position"),
        (WPL.replace("47.398\t", "1e40\t"), "line 4 holds a number beyond"),
        (WPL.replace("2\t0\t3\t16", "2\t0\t10\t16"), "height above the terrain"),
        (WPL.replace("47.3977419", "147.39"), "latitude 147.39"),
    ],
)
def test_waypoint_text_that_cannot_be_read(content, problem):
    with pytest.raises(FormatError, match=problem):
        mission_files.parse_wpl(content, "f.wpl")


@given(st.data())
@settings(derandomize=True, deadline=None, max_examples=60)
def test_nothing_but_a_format_error_comes_out_of_a_changed_file(data):
    document = copy.deepcopy(PLAN)
    spot = document["mission"]
    for _ in range(data.draw(st.integers(1, 4))):
        keys = list(spot) if isinstance(spot, dict) else list(range(len(spot)))
        if not keys:
            break
        key = data.draw(st.sampled_from(keys))
        if isinstance(spot[key], dict | list) and spot[key]:
            spot = spot[key]
            continue
        spot[key] = data.draw(
            st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=4) | st.just([])
        )
        break
    cells = data.draw(st.integers(0, len(WPL)))
    text = WPL[:cells] + data.draw(st.text(alphabet="0.9e-\tn\n", max_size=4)) + WPL[cells:]
    for parse, content in ((mission_files.parse_plan, json.dumps(document)), (mission_files.parse_wpl, text)):
        try:
            parse(content, "f")
        except FormatError as error:
            assert "\n" not in str(error) and len(str(error)) < 400


NOTHING = {"home": [1, 2, 3], "items": [], "home_item": None, "speed": 5, "rest": {}}


@pytest.mark.parametrize("kept", ["x", 3, {}, {"home": [1, 2, 3]}, {"home": [1, 2, 3], "items": [{}]}, NOTHING])
def test_a_damaged_mission_in_a_scene_is_named(kept, tmp_path):
    path = Trajectory([[0, 0, 5], [4, 0, 5]], [1, 1])
    with pytest.raises(TrajectoryError, match="is not a mission that ovita kept"):
        mission_from(path, Scene(extra={"mission": kept}), HOME)
    with pytest.raises(FormatError, match="is not a mission that ovita kept"):
        save_trajectory(tmp_path / "a.plan", path, Scene(extra={"mission": kept}))
