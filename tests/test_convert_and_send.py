"""`ovita convert` and `ovita send` as a user runs them."""

import io
import json
import random
import sys
from pathlib import Path

import numpy as np
import pytest

from ovita.chain import adapt
from ovita.cli.main import main
from ovita.errors import ConstraintDefinitionError, RequestError
from ovita.gate import release, review
from ovita.io import Choices, load_task, save_trajectory
from ovita.io.geodesy import Home
from ovita.limits import ConstraintOptions
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.request import Request
from ovita.result import seal

TABLETOP = Path(__file__).parents[1] / "src" / "ovita" / "data" / "tabletop.json"
HOME = "47.3977,8.5456,488"


@pytest.fixture
def ovita(monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))

    def run(*arguments, stdin=""):
        monkeypatch.setattr(sys, "argv", ["ovita", *map(str, arguments)])
        monkeypatch.setattr(sys, "stdin", stdin if isinstance(stdin, io.StringIO) else io.StringIO(stdin))
        try:
            main()
            code = 0
        except SystemExit as stopped:
            code = stopped.code or 0
        said = capsys.readouterr()
        assert "Traceback" not in said.err
        return code, said.out, said.err

    return run


@pytest.fixture
def result(ovita):
    code, out, err = ovita(
        "adapt", TABLETOP, "Go left by 0.2 and slow down near the cup", "--robot", "drone", "--out", "r.json"
    )
    assert code == 0, out + err
    return "r.json"


@pytest.mark.parametrize("ending", ["csv", "tum", "plan", "waypoints", "mcap", "db3", "json", "pose.csv", "txt"])
def test_convert_there_and_back(ovita, ending):
    if ending in ("mcap", "db3"):
        pytest.importorskip("rosbags")
    code, out, err = ovita("convert", TABLETOP, f"a.{ending}", "--home", HOME)
    assert code == 0 and f"wrote a.{ending}: " in out, err
    assert ending == "json" or "note: " in err
    code, out, err = ovita("convert", f"a.{ending}", "b.json", "--scene", TABLETOP)
    assert code == 0, err
    before, after = load_task(TABLETOP), load_task("b.json")
    assert len(after.trajectory) == len(before.trajectory)
    np.testing.assert_allclose(after.trajectory.positions, before.trajectory.positions, atol=1e-7)
    assert after.scene.names == before.scene.names and after.scene.frame == before.scene.frame


def test_frames_of_convert(ovita, tmp_path):
    pytest.importorskip("rosbags")
    path = Trajectory([[0, 0, 0], [1, 2, 3]], [0.5, 0.5])
    save_trajectory("a.mcap", path, Scene(frame=Frame("flu")))
    assert ovita("convert", "a.mcap", "b.csv", "--to-frame", "rfu")[0] == 0
    assert load_task("b.csv").trajectory.positions[1].tolist() == [-2, 1, 3]
    code, out, err = ovita("convert", "b.csv", "c.json", "--frame", "ned", "--to-frame", "flu")
    assert code == 0 and "frame flu" in out
    assert load_task("c.json").trajectory.positions[1].tolist() == [-2, -1, -3]
    Path("objects.json").write_text(json.dumps({"objects": [{"name": "cup", "x": 1, "y": 2, "z": 3}]}))
    code, out, err = ovita("convert", "a.mcap", "d.json", "--scene", "objects.json")
    assert "the scene file states no frame; its objects were taken to be in flu" in err
    task = load_task("d.json")
    assert (task.trajectory.positions == path.positions).all() and task.scene.frame == Frame("flu")
    assert task.scene.names == ("cup",)
    Path("objects.json").write_text(json.dumps({"frame": "ned", "objects": [{"name": "cup", "x": 1, "y": 2, "z": 3}]}))
    ovita("convert", "a.mcap", "e.json", "--scene", "objects.json")
    assert load_task("e.json").trajectory.positions[1].tolist() == [1, -2, -3]
    code, out, err = ovita("convert", "a.mcap", "f.json", "--scene", "objects.json", "--frame", "rfu")
    task = load_task("f.json")
    assert task.trajectory.positions[1].tolist() == [-2, 1, 3] and task.scene["cup"].position.tolist() == [2, 1, -3]


def test_adapt_opens_and_writes_the_other_formats(ovita):
    pytest.importorskip("rosbags")
    ovita("convert", TABLETOP, "a.mcap", "--type", "multidof")
    common = ("--scene", TABLETOP, "--writer", "builtin")
    code, _, err = ovita("adapt", "a.mcap", "go left by 0.2", *common, "--trajectory", "b.mcap", "--out", "r.json")
    assert code == 0, err
    before, after = load_task("a.mcap"), load_task("b.mcap")
    np.testing.assert_allclose(
        after.trajectory.positions - before.trajectory.positions, [[0, 0.2, 0]] * len(before.trajectory), atol=1e-9
    )
    assert after.scene.extra == before.scene.extra
    assert ovita("plot", "a.mcap", "--scene", TABLETOP, "--out", "a.png")[0] == 0
    assert Path("a.png").stat().st_size > 1000
    code, _, err = ovita("adapt", TABLETOP, "go left by 0.2", "--trajectory", "m.plan", "--out", "m.json")
    assert code == 2 and "there is no home position" in err and not Path("m.json").exists()


@pytest.mark.parametrize(
    ("arguments", "problem"),
    [
        (("convert", "no.mcap", "b.json"), "no.mcap: there is no such file"),
        (("convert", TABLETOP, "b.xyz"), "the ending .xyz says nothing about the format"),
        (("convert", TABLETOP, "b.plan"), "there is no home position"),
        (("convert", TABLETOP, "b.plan", "--home", "here"), "is not latitude,longitude,altitude"),
        (("convert", TABLETOP, "ros2:/plan"), "nothing is sent to a robot unverified"),
        (("convert", "ros2:plan", "b.json"), "is no topic"),
        (("convert", "mavlink:tcp:127.0.0.1:1", "b.json"), "cannot be connected to: connection refused"),
        (("convert", TABLETOP, "no/b.json"), "does not exist; create it first"),
        (("convert", TABLETOP, "b.json", "--scene", "no.json"), "no.json: there is no such file"),
        (("convert", TABLETOP, "b.json", "--scene", "a.csv"), "there is no such file"),
        (("convert", TABLETOP), "Missing argument 'OUT'"),
        (
            ("convert", TABLETOP, "b.csv", "--type", "multidof"),
            "--type multidof is about ROS messages, and b.csv is no",
        ),
        (("convert", TABLETOP, "b.csv", "--base", "0,0,0"), "name the arm as well: --arm iiwa"),
        (("convert", TABLETOP, "b.mcap", "--to-frame", "ned"), "b.mcap has axes of its own"),
        (("convert", TABLETOP, "b.mcap", "--to-topic", "a b"), "'a b' is no name for a topic"),
        (("convert", TABLETOP, "b.json", "--arm", "iiwa"), "this is no bag; those end in .mcap, .db3, .bag"),
        (("send", TABLETOP, "--to", "b.csv", "--frame-id", "map"), "--frame-id map is about ROS messages"),
        (("convert", TABLETOP, "b.mcap", "--type", "joints"), "joints need an arm and its place: --arm iiwa --base"),
        (("send", TABLETOP, "--to", "x.csv"), "this is a task, not a saved adaptation"),
        (("send", "a.mcap", "--to", "x.csv"), "only a result can be sent"),
    ],
)
def test_mistakes_are_one_sentence(ovita, arguments, problem):
    code, out, err = ovita(*arguments)
    assert (code, out) == (2, "") and problem in err and len(err.strip().splitlines()) == 1
    assert not list(Path().glob("b.*"))


def events():
    log = Path("state/ovita/sent.jsonl")
    return [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []


def test_send_shows_asks_sends_and_logs(ovita, result):
    code, out, err = ovita("send", result, "--to", "x.csv")
    assert code == 2 and "there is no terminal to ask" in err and not Path("x.csv").exists() and not events()
    for part in ("Limits", "robot drone", "Verdict", "limits hold", "Changes", "at most"):
        assert part in out
    code, out, err = ovita("send", result, "--to", "x.csv", "--dry-run")
    assert code == 0 and "nothing was" in out and not Path("x.csv").exists()
    code, out, err = ovita("send", result, "--to", "x.csv", "--yes")
    assert code == 0 and "SHA-256" in out
    sending, sent = events()
    assert (sending["event"], sent["event"], sent["robot"]) == ("sending", "sent", "drone")
    assert sent["to"] == str(Path("x.csv").resolve())
    from hashlib import sha256

    assert sent["sha256"] == sha256(Path("x.csv").read_bytes()).hexdigest() and sent["bytes"] > 100
    assert load_task("x.csv").trajectory == load_task(result).trajectory

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    for answer, code in (("n\n", 130), ("y\n", 0)):
        assert ovita("send", result, "--to", f"{code}.csv", "--log", "own.jsonl", stdin=Terminal(answer))[0] == code
    assert Path("0.csv").exists() and not Path("130.csv").exists()


def test_send_refuses_and_says_why(ovita, result):
    document = json.loads(Path(result).read_text())
    document["adapted"][3][0] += 0.01
    Path("edited.json").write_text(json.dumps(document))
    code, out, _ = ovita("send", "edited.json", "--to", "x.csv", "--yes")
    assert code == 4 and "It was edited after it was saved" in out and not Path("x.csv").exists()
    assert events()[-1]["event"] == "refused" and "seal" in events()[-1]["why"][0]


def test_convert_says_what_the_gate_would_refuse(ovita, result):
    code, _, err = ovita("convert", result, "fine.csv")
    assert code == 0 and "would refuse" not in err
    document = json.loads(Path(result).read_text())
    document["adapted"][3][3] = 9.0
    Path("fast.json").write_text(json.dumps(document))
    code, _, err = ovita("convert", "fast.json", "fast.csv")
    assert code == 0 and Path("fast.csv").exists()
    for text in ("its seal does not fit", "the speed limit is broken", "the acceleration limit is broken"):
        assert any("ovita send would refuse it" in line and text in line for line in err.splitlines()), (text, err)


def test_a_mission_that_would_not_fly_as_verified_is_told_and_refused(ovita, result):
    code, out, err = ovita("convert", result, "a.plan", "--home", HOME)
    flown, told = load_task("a.plan").trajectory.duration, load_task(result).trajectory.duration
    assert code == 0 and flown < 0.9 * told
    assert f"m in {flown:.3f} s" in out and f"it flies {flown:.1f} s" in err and f"NOT the path's {told:.1f} s" in err
    assert len(err.splitlines()) == 4 and "ovita send would refuse it: As a mission it flies" in err
    code, out, _ = ovita("send", result, "--to", "b.plan", "--home", HOME, "--yes")
    assert code == 4 and f"As a mission it flies {flown:.1f} s, not {told:.1f} s" in out and not Path("b.plan").exists()
    assert "the mission: BROKEN (it flies" in out and events()[-1]["event"] == "refused"


def test_what_a_mission_makes_of_it_is_shown_before_anybody_is_asked(ovita):
    Path("field.toml").write_text('name = "field"\nmax_speed = 8\n')
    Path("s.json").write_text(json.dumps({"trajectory": [[0, 1.5 * i, 20, 2.0] for i in range(4)]}))
    assert ovita("adapt", "s.json", "go up by 1", "--robot", "field.toml", "--out", "r.json")[0] == 0
    code, out, err = ovita("send", "r.json", "--to", "a.plan", "--home", HOME, "--dry-run")
    mind = out.partition("Mind")[2]
    assert code == 0 and "not as the path: corners are cut" in mind and "to do: fly a path as small as this" in mind
    code, out, err = ovita("send", "r.json", "--to", "a.plan", "--home", HOME, "--yes")
    assert code == 0 and out.count("corners are cut") == 1 and "corners" not in err


def test_what_goes_to_a_mission_is_judged_at_the_last_moment_too(ovita, result):
    found = review(result)
    choices = Choices(home=Home.parse(HOME))
    assert found.released, "nobody said where it goes"
    with pytest.raises(RequestError, match=r"it does not go to b\.plan: As a mission it flies"):
        release(found, "b.plan", "own.jsonl", {}, choices=choices)
    assert not Path("b.plan").exists() and json.loads(Path("own.jsonl").read_text())["event"] == "refused"


def test_a_heading_is_for_what_has_a_north(ovita, result):
    for command in (("convert", result, "a.csv"), ("send", result, "--to", "a.csv", "--yes")):
        code, _, err = ovita(*command, "--heading", "90")
        assert code == 2 and "--heading is about missions and setpoints, and a.csv is neither" in err
    assert not Path("a.csv").exists()
    Path("far.csv").write_text("x,y,z,speed\n0,0,20,5\n0,40,20,5\n")
    assert ovita("convert", "far.csv", "a.plan", "--home", HOME, "--heading", "90")[0] == 0
    code, _, err = ovita("convert", "a.plan", "back.csv", "--heading", "90")
    assert code == 0 and "front is 90 degrees clockwise from north" in err
    np.testing.assert_allclose(load_task("back.csv").trajectory.positions[1], [0, 40, 20], atol=1e-6)


def test_the_speeds_of_a_mission_are_judged_by_the_robots(ovita):
    Path("slow.toml").write_text('name = "slow"\nmax_speed = 0.15\n')
    rows = [[0.0, 3.0 * i, 20.0, 0.15] for i in range(3)]
    Path("s.json").write_text(json.dumps({"trajectory": rows}))
    assert ovita("adapt", "s.json", "go up by 1", "--robot", "slow.toml", "--out", "r.json")[0] == 0
    assert ovita("send", "r.json", "--to", "fine.csv", "--yes")[0] == 0
    code, out, _ = ovita("send", "r.json", "--to", "a.plan", "--home", HOME, "--yes")
    assert code == 4 and "The mission commands 0.2 m/s to waypoint 1, 2, 3 (at most 0.15 m/s)" in out
    Path("s.json").write_text(json.dumps({"trajectory": [[0, 9.0 * i, 20, 3.0] for i in range(3)], "robot": "drone"}))
    err = ovita("convert", "s.json", "b.plan", "--home", HOME)[2]
    assert "would refuse it" in err and "The mission commands 3 m/s to waypoint 1, 2, 3 (at most 1 m/s)" in err


def test_send_lets_the_robot_follow_it_in_simulation_first(ovita):
    pytest.importorskip("mujoco")
    Path("wild.toml").write_text('name = "wild"\nmax_speed = 90.0')
    for name, gap in (("near", 0.03), ("far", 0.5)):
        box = {"name": "box", "x": 0.15, "y": 0.1 + gap, "z": 0.55, "dimensions": [0.2, 0.2, 0.2]}
        rows = [[0.1 * i, 0.0, 0.5, 0.3] for i in range(4)]
        Path("s.json").write_text(json.dumps({"trajectory": rows, "objects": [box]}))
        assert ovita("adapt", "s.json", "go up by 0.05", "--robot", "wild.toml", "--out", f"{name}.json")[0] == 0
    code, out, err = ovita("send", "far.json", "--to", "x.csv", "--yes", "--simulate", "--arm", "crazyflie")
    assert code == 0 and "the dynamics: holds (simulated; Tracking error" in out, out + err
    # 3 cm beside the box there is room for a point, and none for the drone.
    assert ovita("send", "near.json", "--to", "y.csv", "--yes")[0] == 0
    code, out, err = ovita("send", "near.json", "--to", "w.csv", "--yes", "--simulate", "--arm", "crazyflie")
    assert code == 4 and "Simulated, the robot does not follow it" in out and "Contact with box" in out, out + err
    assert not Path("w.csv").exists() and "Simulated" in events()[-1]["why"][0]
    code, out, err = ovita("send", "near.json", "--to", "w.csv", "--yes", "--simulate")
    assert code == 2 and "--simulate needs a model of 'wild'" in err


def test_send_fails_cleanly(ovita, result):
    pytest.importorskip("pymavlink")
    code, _, err = ovita("send", result, "--to", "mavlink:tcp:127.0.0.1:1?type=setpoints", "--yes")
    assert code == 2 and "cannot be connected to: connection refused" in err
    assert [event["event"] for event in events()] == ["sending", "failed"]
    Path("state/ovita").rename("elsewhere")
    Path("state/ovita").write_text("")
    code, _, err = ovita("send", result, "--to", "x.csv", "--yes")
    assert code == 2 and "so nothing is sent" in err and not Path("x.csv").exists()


def test_a_mission_keeps_its_items_on_the_whole_way(ovita):
    items = [
        {"type": "SimpleItem", "command": c, "frame": 3, "autoContinue": True, "doJumpId": i, "params": p}
        for i, (c, p) in enumerate(
            [
                (22, [0, 0, 0, None, 47.1, 8.5, 30]),
                (16, [0, 0, 0, None, 47.1001, 8.5, 30]),
                (205, [-90, 0, 0, 0, 0, 0, 2]),
                (16, [0, 0, 0, None, 47.1005, 8.5, 30]),
                (20, [0] * 7),
            ]
        )
    ]
    mission = {"version": 2, "hoverSpeed": 5, "plannedHomePosition": [47.1, 8.5, 400], "items": items}
    Path("a.plan").write_text(json.dumps({"fileType": "Plan", "version": 1, "mission": mission}))
    Path("field.toml").write_text("max_speed = 8\n[workspace]\nlower = [-100, -100, 1]\nupper = [100, 100, 60]\n")
    common = ("--writer", "builtin", "--robot", "field.toml", "--out", "r.json")
    assert ovita("adapt", "a.plan", "go up by 5", *common)[0] == 0
    code, out, err = ovita("send", "r.json", "--to", "b.plan", "--yes")
    assert code == 0, out + err
    after = json.loads(Path("b.plan").read_text())["mission"]["items"]
    assert [after[i] for i in (0, 2, 4)] == [items[i] for i in (0, 2, 4)]
    assert after[1]["params"][6] == pytest.approx(35, abs=1e-6)


WILD = (None, True, -1, 0, 1e308, 10**400, "", "x" * 50, [], {}, [[]], [None], {"x": 1}, "\x00", "../x")


def _places(value, path=()):
    yield path
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in inner:
        yield from _places(item, (*path, key))


@pytest.mark.parametrize("seed", range(40))
def test_a_mangled_result_is_used_or_refused_in_a_sentence(ovita, tmp_path, seed):
    path = Trajectory(np.column_stack([np.linspace(0, 1, 6), np.zeros((6, 2))]), np.full(6, 0.2))
    cup = Scene((SceneObject("cup", [0.5, 0.3, 0]),))
    document = adapt(Request("go left by 0.1 and slow down near the cup", path, cup), writer="builtin").to_document()
    rng = random.Random(seed)
    top = rng.choice(sorted(document))
    *way, last = rng.choice([place for place in _places(document) if place[:1] == (top,)])
    holder = document
    for key in way:
        holder = holder[key]
    holder[last] = rng.choice(WILD)
    if top != "sha256":
        document["sha256"] = seal(document)
    (tmp_path / "r.json").write_text(json.dumps(document))
    for command in (
        ["send", "r.json", "--to", "x.csv", "--robot", "drone", "--yes", "--log", "x.log"],
        ["explain", "--code", "r.json"],
        ["convert", "r.json", "y.csv"],
        ["plot", "r.json", "--out", "x.html"],
    ):
        code, _, said = ovita(*command)
        assert code in (0, 2, 4) and len(said.strip().splitlines()) <= 3, (command, top, way, last, said)


def test_a_huge_number_among_the_limits_is_no_traceback():
    with pytest.raises(ConstraintDefinitionError, match="max_acceleration"):
        ConstraintOptions(max_acceleration=10**400)
