"""The robot of docs/robots.md works as written."""

import os
import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from ovita import sim
from ovita.cli.main import cli
from ovita.paths.trajectory import Trajectory

pytest.importorskip("mujoco", reason="the extra sim is not installed")

TEXT = (Path(__file__).parents[2] / "docs" / "robots.md").read_text(encoding="utf-8")


@pytest.fixture
def twolink(tmp_path):
    for name, kind in (("twolink.urdf", "xml"), ("twolink.toml", "toml")):
        content = re.search(rf"`{name}`\n\n```{kind}\n(.*?)```", TEXT, re.DOTALL)[1]
        (tmp_path / name).write_text(content, encoding="utf-8")
    return tmp_path / "twolink.toml"


def test_the_own_robot_follows_a_line_in_its_plane(twolink):
    line = Trajectory(np.linspace([0.5, -0.2, 0.1], [0.5, 0.3, 0.1], 20), np.full(20, 0.2))
    run = sim.simulate(line, robot=twolink, base=sim.Base(0, 0, 0, 0.4))
    assert run.report.status == "followed" and run.report.robot == "twolink"
    assert run.motion.bodies[-2:] == ("upper", "lower")
    assert {shape.kind for shape in run.motion.shapes} == {"box"}


def test_the_own_robot_cannot_leave_its_plane_and_says_so(twolink):
    line = Trajectory(np.linspace([0.5, -0.2, 0.1], [0.5, 0.3, 0.3], 20), np.full(20, 0.2))
    report = sim.simulate(line, robot=twolink, base=sim.Base()).report
    assert report.status == "unreachable" and report.unreachable[0].waypoint == 1


def test_every_file_that_the_page_names_exists():
    root = Path(__file__).parents[2] / "src"
    for name in re.findall(r"`(ovita/sim/[\w/.]+)`", TEXT):
        assert (root / name).exists(), name


MODELS = os.environ.get("OVITA_ROBOT_MODELS", "")


@pytest.mark.skipif(not MODELS, reason="OVITA_ROBOT_MODELS names no folder with the robots of PyPI's packages")
def test_robots_from_packages_follow_as_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("path.csv").write_text(re.search(r"`path.csv`\n\n```csv\n(.*?)```", TEXT, re.DOTALL)[1])
    Path("robots").symlink_to(MODELS)
    commands = re.findall(r"^ovita (simulate path\.csv (?:.*\\\n)?.*)$", TEXT, re.MULTILINE)
    for command in commands:
        done = CliRunner().invoke(cli, shlex.split(command.replace("\\\n", " ")))
        assert done.exit_code == 0 and "original: followed" in done.output, done.output
    assert len(commands) == 3


def test_the_tests_that_stand_for_the_findings_exist():
    root = Path(__file__).parents[1]
    there = set(re.findall(r"def (test_\w+)", "\n".join(p.read_text("utf-8") for p in root.rglob("test_*.py"))))
    named = set(re.findall(r"`(test_\w+)`", TEXT))
    assert len(named) > 30 and named <= there
