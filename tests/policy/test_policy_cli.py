"""`ovita policy check` and `ovita policy run`."""

import json
import sys

import pytest
from click.testing import CliRunner

from ovita.cli.policy_ import group
from ovita.io import Task, save_task

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="strict isolation needs Linux")

GOOD = '''import numpy as np

def adapt(traj, scene, *, distance=0.2):  # how far [m]
    """Shift left."""
    print_ = print
    print_("moved")
    expect_moved(left=distance)
    return move(traj, left=distance)
'''
BAD = "import numpy as np\n\ndef adapt(traj, scene):\n    open('x')\n    return traj\n"
CRASH = "import numpy as np\n\ndef adapt(traj, scene):\n    print(traj)\n    return traj / 'a'\n"


@pytest.fixture
def files(tmp_path, line, table):
    for name, source in {"good": GOOD, "bad": BAD, "crash": CRASH}.items():
        (tmp_path / f"{name}.py").write_text(source)
    save_task(tmp_path / "scene.json", Task(line, table))
    return tmp_path


def invoke(*arguments):
    return CliRunner().invoke(group, [str(a) for a in arguments])


def test_check(files):
    result = invoke("check", files / "good.py")
    assert result.exit_code == 0
    assert "good.py: ok (function): Shift left." in result.output
    assert "  distance = 0.2 m  how far" in result.output
    result = invoke("check", files / "good.py", files / "bad.py")
    assert result.exit_code == 3
    assert "bad.py: line 4: a policy may not open files; the trajectory is already in `traj`" in result.output


def test_run_writes_the_result(files):
    out = files / "out.json"
    result = invoke("run", files / "good.py", "--scene", files / "scene.json", "--out", out, "--param", "distance=0.5")
    assert result.exit_code == 0, result.output
    document = json.loads(out.read_text())
    assert document["adapted"][0][:3] == [-0.5, 0.0, 0.0]
    assert document["isolation"] == "strict", "it prints"
    assert set(document["timings_ms"]) == {"read", "run", "total"}
    assert document["parameters"] == [{"name": "distance", "value": 0.5, "unit": "m"}]
    assert "100 waypoints" in result.output and "| moved" in result.output
    assert "error" not in document


def test_several_files_go_in_one_call(files):
    out = files / "out.json"
    names = [files / f"{n}.py" for n in ("good", "bad", "crash")]
    result = invoke("run", *names, "--scene", files / "scene.json", "--out", out)
    assert result.exit_code == 3
    good, bad, crash = json.loads(out.read_text())
    assert "adapted" in good
    assert (bad["error"]["kind"], bad["error"]["line"]) == ("rejected", 4)
    assert (crash["error"]["kind"], crash["error"]["line"]) == ("crashed", 5)
    assert "crash.py: crashed: line 5: " in result.output


def test_degraded_isolation_is_reported(files):
    out = files / "out.json"
    arguments = ["run", files / "good.py", "--scene", files / "scene.json", "--out", out, "--isolation", "degraded"]
    assert invoke(*arguments).exit_code == 0
    assert json.loads(out.read_text())["isolation"] == "degraded"


def test_wrong_parameters_are_named(files):
    result = invoke("run", files / "good.py", "--scene", files / "scene.json", "--param", "speed=1")
    assert result.exit_code == 3
    assert "the policy has no parameter 'speed'; its parameters are: distance" in result.output
    assert invoke("run", files / "good.py", "--scene", files / "scene.json", "--param", "speed").exit_code == 2


def test_the_kernel_holds_alone(files):
    out = files / "out.json"
    result = invoke("run", files / "bad.py", "--scene", files / "scene.json", "--out", out, "--kernel-alone")
    assert result.exit_code == 3
    error = json.loads(out.read_text())["error"]
    assert (error["kind"], error["line"]) == ("crashed", 4)
    assert "PermissionError" in error["message"]
    result = invoke(
        "run", files / "bad.py", "--scene", files / "scene.json", "--kernel-alone", "--isolation", "degraded"
    )
    assert "only where the kernel holds" in str(result.exception)


def test_run_says_which_promises_hold(files):
    source = (
        "def adapt(traj, scene):\n    expect_moved(left=0.2)\n    expect_start()\n    return move(traj, left=0.2)\n"
    )
    (files / "two.py").write_text(source)
    result = invoke("run", files / "two.py", "--scene", files / "scene.json", "--out", files / "out.json")
    assert result.exit_code == 6, "a promise that does not hold is not as meant"
    assert "  held: the path moves 0.2 m left (" in result.output
    assert "  NOT held: the start stays where it was (the start is 0.200 m from the old start)" in result.output
    assert [e["held"] for e in json.loads((files / "out.json").read_text())["expectations"]] == [True, False]
