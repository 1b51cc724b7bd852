"""Disturbed robots: noise, delay, lag, payload and wind, the same by the same seed; and whole folders in a table."""

import csv
import json

import numpy as np
import pytest

from ovita import sim
from ovita.errors import RequestError
from ovita.io import save_trajectory
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the extra sim is not installed")

from ovita.cli.simulate_ import Simulated, command, table

LINE = Trajectory(np.linspace([0.5, -0.1, 0.5], [0.5, 0.1, 0.5], 8), np.full(8, 0.2))
GROUND = Trajectory(np.linspace([0, 0, 0], [1, 0.5, 0], 8), np.full(8, 0.5))
SCENE = Scene(frame=Frame("flu"))
BASE = {"iiwa": sim.Base()}


def report(robot, path=LINE, scene=SCENE, **what):
    wanted = sim.Disturbances(**what)
    return sim.simulate(path, scene, robot, base=BASE.get(robot), disturbances=wanted).report


@pytest.fixture(scope="module")
def calm():
    return {robot: report(robot, GROUND if robot == "jackal" else LINE) for robot in ("iiwa", "jackal", "crazyflie")}


@pytest.mark.parametrize(
    ("robot", "what"),
    [
        ("crazyflie", {"noise": 0.01}),
        ("crazyflie", {"rate_noise": 0.2}),
        ("crazyflie", {"delay": 0.02}),
        ("crazyflie", {"lag": 0.02}),
        ("crazyflie", {"payload": 0.005}),
        ("crazyflie", {"wind": (3.0, 0.0, 0.0)}),
        ("crazyflie", {"gust": 2.0}),
        ("iiwa", {"noise": 0.001}),
        ("iiwa", {"delay": 0.01}),
        ("iiwa", {"payload": 3.0}),
        ("jackal", {"noise": 0.02}),
        ("jackal", {"lag": 0.1}),
    ],
)
def test_each_disturbance_makes_it_worse_and_is_told(calm, robot, what):
    found = report(robot, GROUND if robot == "jackal" else LINE, **what)
    assert found.tracking.rms > 1.02 * calm[robot].tracking.rms
    name = next(iter(what)).replace("rate_noise", "noise of speeds").replace("gust", "gusts")
    assert f"Disturbed by {name}" in found.notes[0]


def test_a_payload_that_the_controller_does_not_know_of_pulls_the_arm_down_by_its_weight():
    """Computed torque holds it where M kp e = tau: for a load at rest the tip sinks by about g m / (kp m_eff)."""
    known, laden = report("iiwa"), report("iiwa", payload=2.0)
    sunk = sim.simulate(LINE, SCENE, "iiwa", base=sim.Base(), disturbances=sim.Disturbances(payload=2.0)).motion.tip
    assert laden.tracking.rms > 5 * known.tracking.rms
    assert (sunk[5:, 2] < 0.5).all()


def test_wind_blows_where_it_blows_in_the_scenes_axes():
    up = LINE.with_(positions=LINE.positions * [1, -1, -1])
    blown = sim.Disturbances(wind=(0.0, 0.0, 4.0))
    lifted = sim.simulate(LINE, SCENE, "crazyflie", disturbances=blown).motion.tip
    lowered = sim.simulate(up, Scene(frame=Frame("ned")), "crazyflie", disturbances=blown).motion.tip
    still = sim.simulate(LINE, SCENE, "crazyflie").motion.tip
    assert (lifted[20:, 2] > still[20:, 2]).all()
    assert (lowered[20:, 2] > -still[20:, 2]).all(), "+z is down in ned, and so blows the wind"


def test_the_same_seed_gives_the_same_and_another_does_not():
    one, same, other = (report("crazyflie", noise=0.01, gust=1.0, seed=seed).tracking for seed in (1, 1, 2))
    assert one == same != other


def test_no_disturbance_is_the_simulation_as_it_was(calm):
    assert report("crazyflie", seed=5) == calm["crazyflie"]


@pytest.mark.parametrize(
    "what", [{"noise": -1.0}, {"payload": float("nan")}, {"delay": 2.0}, {"wind": (0.0, 0.0, float("inf"))}]
)
def test_disturbances_that_make_no_sense_are_refused(what):
    with pytest.raises(RequestError):
        sim.Disturbances(**what)


@pytest.fixture
def folder(tmp_path):
    root = tmp_path / "many"
    root.mkdir()
    for name, up in (("a", 0.0), ("b", 0.02), ("far", 9.0)):
        save_trajectory(root / f"{name}.json", LINE.with_(positions=LINE.positions + np.array([0, 0, up])), SCENE)
    (root / "broken.json").write_text("{")
    (root / "notes.txt~").write_text("not a trajectory")
    return root


def run(*arguments):
    with pytest.raises(SystemExit) as ended:
        command.main([str(a) for a in arguments], standalone_mode=False)
    return ended.value.code


def test_a_folder_is_simulated_into_a_table(folder, tmp_path, capsys):
    out = tmp_path / "table.csv"
    code = run(folder, "--robot", "iiwa", "--base", "0,0,0,0", "--report", out)
    said = capsys.readouterr().out
    assert code == 4 and "4 simulations of 4 files, 2 failed" in said and "broken.json" in said
    rows = list(csv.DictReader(out.read_text().splitlines()))
    status = {row["file"]: row["status"] for row in rows}
    assert status == {
        "a.json": "followed",
        "b.json": "followed",
        "broken.json": "not simulated",
        "far.json": "not simulated",
    }
    assert float(rows[0]["rms"]) < 0.002 and "no waypoint is within reach" in rows[3]["problem"]


def test_a_table_is_written_as_its_ending_says():
    rows = [Simulated("a.json", "original", "iiwa", "contact", 0.001, 0.002, 1.0, 1.5, 0, "cup|saucer")]
    assert table(rows, ".md").splitlines()[2].startswith("| a.json | original | iiwa | contact | 0.001 |")
    assert "cup\\|saucer" in table(rows, ".md") and rows[0].failed
    assert json.loads(table(rows, ".json"))[0]["peak"] == 0.002


def test_a_folder_where_all_follow_ends_well_and_workers_say_the_same(folder, tmp_path, capsys):
    for name in ("broken", "far"):
        (folder / f"{name}.json").unlink()
    tables = []
    for jobs in ("1", "2"):
        asked = [folder, "--robot", "crazyflie", "--noise", "0.005", "--report", tmp_path / "t.csv", "--jobs", jobs]
        assert run(*asked) == 0
        tables.append((tmp_path / "t.csv").read_text())
    assert tables[0] == tables[1]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--report", "t.xlsx"], "tables are written as .csv, .md, .json"),
        (["--report", "t.csv", "--json"], "leave --video and --json out"),
        (["--wind", "3"], "is not x,y,z"),
    ],
)
def test_wrong_options_are_one_sentence(folder, options, said):
    import click

    with pytest.raises((RequestError, click.UsageError)) as error:
        command.main([str(folder), "--robot", "iiwa", *options], standalone_mode=False)
    assert said in str(error.value)


def test_an_empty_folder_and_a_file_have_no_table(tmp_path):
    for place in (tmp_path, tmp_path / "none.json"):
        with pytest.raises(RequestError, match=r"holds no file of a known format|is none"):
            command.main([str(place), "--report", str(tmp_path / "t.csv")], standalone_mode=False)
