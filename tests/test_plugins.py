"""Plug-ins: the example package adds one of each kind; a broken one is said in a sentence and harms nothing."""

import json
import shutil
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import command_line
import ovita as ov
from ovita import plugins
from ovita.errors import FormatError, RequestError, RobotError, WriterError
from ovita.paths.scene import RFU
from ovita.perceive.detect import detector_named
from ovita.policy import sandbox
from ovita.toolkit import catalogue
from ovita.writers import examples, prompt
from ovita.writers.base import writer_named

EXAMPLE = Path(__file__).parent / "plugin_example"
SCENE = {
    "trajectory": [[x / 10, 0.0, 0.3, 0.2] for x in range(11)],
    "objects": [{"name": "cup", "x": 0.5, "y": 0.3, "z": 0.3, "dimensions": [0.1, 0.1, 0.1]}],
}


def install(folder, name, points):
    """What an installer leaves behind for a package with entry points."""
    info = folder / f"{name}-0.1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 0.1.0\n")
    groups = (f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in entries.items()) for group, entries in points.items())
    (info / "entry_points.txt").write_text("\n".join(groups))


def seen(monkeypatch, folder):
    """Put a folder on the import path and forget what plug-ins were found."""
    monkeypatch.syspath_prepend(folder)
    _forget()


def _forget():
    for cached in (plugins.entries, catalogue.extended, examples._descriptions, prompt._fixed):
        cached.cache_clear()
    sandbox.close()


@pytest.fixture(autouse=True)
def _as_before():
    yield
    catalogue._withdraw({name for name in catalogue.CATALOGUE if not catalogue.is_shipped(catalogue.CATALOGUE[name])})
    for module in [name for name in sys.modules if name.startswith(("acme_ovita", "sour_"))]:
        del sys.modules[module]
    _forget()


@pytest.fixture
def example(tmp_path, monkeypatch):
    """The example package, installed; and a scene to use it on."""
    site = tmp_path / "site"
    shutil.copytree(EXAMPLE / "acme_ovita", site / "acme_ovita", ignore=shutil.ignore_patterns("__pycache__"))
    project = tomllib.loads((EXAMPLE / "pyproject.toml").read_text())["project"]
    install(site, "acme_ovita", project["entry-points"])
    seen(monkeypatch, site)
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    return tmp_path


@pytest.fixture
def sour(tmp_path, monkeypatch):
    """A package of which nothing can be used."""
    site = tmp_path / "site"
    install(site, "sour", {f"ovita.{kind}": {"sour": "sour_nothing:thing"} for kind in plugins.KINDS})
    seen(monkeypatch, site)


def test_the_example_adds_one_of_each_kind(example):
    assert [kind for kind in plugins.KINDS if plugins.entries(kind)] == list(plugins.KINDS)
    assert not [name for name in sys.modules if name.startswith("acme_ovita")], "nothing is imported to find it"
    listed = command_line.ovita("plugins")
    assert listed.returncode == 0 and listed.stdout.count("from acme_ovita 0.1.0") == 6


def test_a_writer_and_an_operation_that_runs_in_the_sandbox(example):
    task = ov.load(example / "scene.json")
    result = ov.adapt(task, "bow to the audience", writer="acme:0.25")
    assert result.status == "done" and result.writer.kind == "acme", result.message
    assert result.adapted.positions[:, 2].max() == pytest.approx(0.55, abs=1e-6)
    assert result.timings_ms and [p.name for p in result.parameters] == ["height"]
    assert ov.rerun(result, {"height": 0.1}).adapted.positions[:, 2].max() == pytest.approx(0.4, abs=1e-6)
    chain = ov.adapt(task, "go left by 0.1", writer=writer_named("acme,builtin"))
    assert chain.usable and chain.writer.kind == "builtin"


def test_an_operation_is_known_to_prompts_to_the_check_and_to_the_catalogue(example):
    from ovita.toolkit import acme_bow
    from ovita.writers.examples import functions_like

    assert acme_bow(np.array(SCENE["trajectory"]), 0.1)[:, 2].max() == pytest.approx(0.4)
    assert "acme_bow" in functions_like("bow upwards, metres in the middle", 5)
    shown = command_line.ovita("policy", "catalogue", "acme_bow")
    assert shown.returncode == 0 and "metres in its middle" in shown.stdout
    assert "acme_bow" not in command_line.process("policy", "catalogue", "--markdown").stdout


def test_a_robot_a_format_and_a_planner(example):
    out = example / "out.acme"
    command = ("--robot", "acme-cart", "--trajectory", out)
    done = command_line.ovita("adapt", example / "scene.json", "go left by 0.1 and speed up to 2 m/s", *command)
    assert done.returncode in (0, 5), done.stderr
    back = ov.load(out)
    assert len(back.trajectory) >= 11 and back.trajectory.speeds.max() <= 0.4 + 1e-9
    planned = command_line.ovita(
        "plan", example / "scene.json", "--from", "0,0,0.3", "--to", "1,0,0.3", "--planner", "acme"
    )
    assert planned.returncode == 0 and ", 1.00 m," in planned.stdout, planned.stderr
    out.write_text("0 0 0 0.1\n1 nothing\n")
    with pytest.raises(FormatError, match=r"out\.acme: the plug-in acme_ovita 0\.1\.0 \(format 'acme'\) fails with"):
        ov.load(out)


def test_a_detector(example):
    found = detector_named("acme:x", frame="flu")
    assert found.name == "acme" and found.up.tolist() == [0.0, 0.0, 1.0]


FAIL = r"the plug-in sour 0\.1\.0 \(\w+ 'sour'\) fails with ModuleNotFoundError: No module named 'sour_nothing'; mend"


@pytest.mark.parametrize(
    ("error", "use"),
    [
        (WriterError, lambda tmp: writer_named("sour:x")),
        (RobotError, lambda tmp: ov.Robot.preset("sour")),
        (FormatError, lambda tmp: ov.load(tmp / "path.sour")),
        (RequestError, lambda tmp: ov.plan(ov.Scene(), start=(0, 0, 0), goal=(1, 0, 0), planner="sour")),
        (RequestError, lambda tmp: detector_named("sour", frame=RFU)),
    ],
)
def test_one_that_fails_is_one_sentence(sour, tmp_path, error, use):
    (tmp_path / "path.sour").write_text("x")
    with pytest.raises(error, match=FAIL):
        use(tmp_path)


def test_a_broken_operation_is_warned_of_and_the_rest_goes_on(sour, tmp_path):
    with pytest.warns(plugins.PluginWarning, match=FAIL):
        assert catalogue.extended() == frozenset()
    policy = tmp_path / "policy.py"
    policy.write_text(
        "def adapt(traj, scene):\n    for i in range(2):\n        traj = move(traj, up=0.1)\n    return traj\n"
    )
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    ran = command_line.ovita("policy", "run", policy, "--scene", tmp_path / "scene.json")
    assert ran.returncode == 0, ran.stderr
    listed = command_line.ovita("plugins")
    assert listed.returncode == 2 and listed.stdout.count("No module named 'sour_nothing'") == 6


def test_a_writer_that_raises_is_a_writer_that_failed(tmp_path, monkeypatch):
    site = tmp_path / "site"
    install(site, "sour", {"ovita.writers": {"sour": "sour_writer:Sour"}})
    (site / "sour_writer.py").write_text(
        "class Sour:\n    name = 'sour'\n    def __init__(self, model): pass\n"
        "    def write(self, prompt): raise KeyError('lemon')\n"
    )
    seen(monkeypatch, site)
    result = ov.adapt(np.array(SCENE["trajectory"]), "go left by 0.1", writer="sour")
    assert result.status == "failed" and "(writer 'sour') fails with KeyError: 'lemon'" in result.message


def test_entry_points_are_not_looked_for_where_no_plugin_is_meant():
    code = (
        "import importlib.metadata as m, sys\n"
        "old, asked = m.entry_points, []\n"
        "m.entry_points = lambda **k: asked.append(k.get('group')) or old(**k)\n"
        "import ovita as ov\n"
        "ov.adapt([[0, 0, 0, 1], [1, 0, 0, 1]], 'go left by 0.1', robot='drone', writer='builtin')\n"
        "sys.exit(any('ovita' in str(g) for g in asked))\n"
    )
    import subprocess

    assert subprocess.run([sys.executable, "-c", code], check=False, timeout=60).returncode == 0
