"""The answers of docs/howto.md do what they say: every snippet runs as printed."""

import json
import re
import shlex
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import ovita as ov
from ovita.cli.main import cli

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "howto.md").read_text(encoding="utf-8")
ANSWERS = dict(part.split("\n", 1) for part in PAGE.split("\n## ")[1:])
BLOCK = re.compile(r"```(python|sh)\n(.*?)```", re.DOTALL)


@pytest.fixture
def bench(tmp_path, monkeypatch):
    """A folder with the files that the page takes for granted."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("OVITA_MODEL", raising=False)
    shutil.copy(ROOT / "src" / "ovita" / "data" / "tabletop.json", "scene.json")
    Path("scenes").mkdir()
    s = np.linspace(0.0, 1.0, 30)
    for name, bend in zip("abc", (0.10, 0.12, 0.14), strict=True):
        shutil.copy("scene.json", f"scenes/{name}.json")
        rows = np.column_stack([s, bend * np.sin(3 * s), 0.3 + 0 * s, 3 * s])
        np.savetxt(f"{name}.csv", rows, delimiter=",", header="x,y,z,t", comments="")
    shutil.copy("a.csv", "path.csv")
    return tmp_path


def looked(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tests" / "perceive"))
    from depth_pictures import Thing, picture

    view = picture([Thing("cylinder", (0.0, 0.1, 0.05), (0.08, 0.08, 0.1), colour="red")], size=(240, 180))
    np.savez("look.npz", depth=view.depth, rgb=view.rgb, intrinsics=view.intrinsics, pose=view.pose)


def run(command):
    done = CliRunner().invoke(cli, shlex.split(command)[1:], catch_exceptions=False)
    assert done.exit_code in (0, 5), f"{command}\n{done.output}"


def answered(title):
    """Run the snippets under a title, in order, and return what they leave behind."""
    names = {}
    for language, text in BLOCK.findall(ANSWERS[title]):
        if language == "python":
            exec(compile(text, f"howto.md: {title}", "exec"), names)
        else:
            for line in text.splitlines():
                run(line)
    return names


def ros_path():
    def stamped(i):
        place = SimpleNamespace(x=0.1 * i, y=0.0, z=0.5)
        return SimpleNamespace(
            header=SimpleNamespace(stamp=SimpleNamespace(sec=100 + i, nanosec=500_000_000)),
            pose=SimpleNamespace(position=place),
        )

    return SimpleNamespace(poses=[stamped(i) for i in range(12)])


def test_every_question_of_a_newcomer_has_an_answer():
    assert len(ANSWERS) == 15
    assert all(BLOCK.search(text) for text in ANSWERS.values())
    tests = dict(re.findall(r"^\| \[(.*?)\]\(#.*?\) \| `(test_\w+)` \|$", PAGE, re.MULTILINE))
    assert list(tests) == list(ANSWERS)
    source = Path(__file__).read_text(encoding="utf-8")
    for title, test in tests.items():
        body = re.search(rf"^def {test}\(.*?(?=^def |\Z)", source, re.MULTILINE | re.DOTALL)
        assert body and f'answered("{title}")' in body[0], f"{test} does not run the snippets of {title!r}"


def test_numpy(bench):
    left = answered("Get the adapted trajectory as a numpy array")
    assert left["result"].usable and left["rows"].shape == (len(left["task"].trajectory), 4)
    assert np.array_equal(left["same"], left["rows"]) and len(left["part"]) == 10
    assert np.array_equal(np.column_stack([left["positions"], left["speeds"]]), left["rows"])


def test_own_planner(bench):
    left = answered("Adapt what my own planner made")
    assert left["result"].usable and any("0.1 m/s" in text for text in left["result"].assumptions)


def test_notebook(bench):
    pytest.importorskip("matplotlib", reason="pictures need the extra plot")
    left = answered("Use it in a notebook")
    assert left["figure"] is not None and left["talk"].current != left["result"].original
    assert np.ptp(left["higher"].to_numpy()[:, 0] - left["result"].original.positions[:, 0]) == pytest.approx(0)


def test_batch(bench):
    left = answered("Adapt many files")
    assert len(left["results"]) == 3 and all(Path(f"{name}-result.json").exists() for name in "abc")


def test_planner_and_demonstrations(bench):
    left = answered("Start from a planner or from demonstrations")
    assert left["planned"].ok and left["result"].status == "done"


def test_camera(bench, monkeypatch):
    looked(monkeypatch)
    left = answered("Find the objects with a camera")
    assert left["result"].usable and "red cup" in left["result"].scene and Path("result.json").exists()


def test_own_model(bench):
    left = answered("Add my own language model")
    assert left["result"].status == "done" and left["result"].parameters[0].name == "up"


def test_own_robot(bench):
    assert answered("Add my own robot")["result"].robot.max_speed == 0.25


def test_own_operation(bench):
    answered("Add an operation of my own")
    waved = np.array(json.loads(Path("waved.json").read_text())["adapted"])
    moved = waved[:, 2] - ov.load("scene.json").trajectory.positions[:, 2]
    assert 0.04 < np.abs(moved).max() <= 0.05 + 1e-9


def test_own_policy(bench):
    (outcome,) = answered("Run a policy that I wrote")["outcomes"]
    assert outcome.held, outcome.sentence


def test_ros_node(bench):
    message, cup = ros_path(), ov.SceneObject("cup", [1, 1, 1])
    result = answered("Call it from a ROS 2 node")["adapted"](message, "go left by 0.1", [cup])
    assert result.status == "done"
    assert [pose.pose.position.y for pose in message.poses] == pytest.approx([0.1] * 12)


def test_tables(bench):
    Path("scenes").rename("others")
    answered("Reproduce the paper's tables")
    assert "builtin" in Path("run/report.md").read_text(encoding="utf-8")


def test_another_method(bench):
    left = answered("Compare with another method")
    assert left["result"].status == "done" and left["result"].writer is not None
    assert np.allclose(left["result"].adapted.positions[:, 2] - left["result"].original.positions[:, 2], 0.1, atol=1e-4)


def test_user_study(bench):
    from ovita.bench.records import read_ratings

    answered("Run a user study")
    assert read_ratings("ratings.csv") == {"builtin": (4.0,)}
    assert ov.Adaptation.load("p01-1.json").status == "done"


def test_dataset(bench):
    answered("Make a dataset of language and motion")
    rows = [json.loads(line) for line in Path("rows.jsonl").read_text().splitlines()]
    said = ["go left by 0.1", "slow down near the cup", "go up by 0.05 in the second half"]
    assert [row["language"] for row in rows] == said
