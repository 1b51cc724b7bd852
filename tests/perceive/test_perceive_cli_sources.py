"""`ovita perceive` on recordings and point clouds, with detectors, and looking again."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from depth_pictures import Thing, picture

from ovita.chain import adapt
from ovita.cli.perceive_ import command
from ovita.errors import OvitaError
from ovita.io import load_scene
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.perceive import View
from ovita.request import Request

CUP = Thing("box", (0.0, 0.15, 0.06), (0.08, 0.08, 0.12), colour="red")
BOOK = Thing("box", (0.05, -0.15, 0.03), (0.16, 0.1, 0.06), 0.4, "blue")


def saved(path: Path, view: View) -> str:
    np.savez(path, depth=view.depth, rgb=view.rgb, intrinsics=view.intrinsics, pose=view.pose)
    return str(path)


def run(*arguments: object, code: int = 0) -> str:
    done = CliRunner().invoke(command, [str(one) for one in arguments])
    if isinstance(done.exception, OvitaError):
        return f"error: {done.exception}"
    assert done.exit_code == code, done.output
    return done.output


@pytest.fixture
def look(tmp_path: Path) -> str:
    return saved(tmp_path / "a.npz", picture([CUP, BOOK]))


def test_looking_again_at_a_path(tmp_path: Path, look: str) -> None:
    first, second, adapted = tmp_path / "a.json", tmp_path / "b.json", tmp_path / "r.json"
    run(look, "--names", "cup=red", "--out", first)
    xyz = np.column_stack([np.linspace(-0.3, 0.3, 20), np.zeros(20), np.full(20, 0.06)])
    robot = replace(Robot.preset("none"), obstacle_margin=0.02)
    scene = load_scene(first)[0]
    request = Request("keep at least 0.05 away from the cup", Trajectory(xyz, np.full(20, 0.2)), scene, robot)
    adapt(request, writer="builtin").save(str(adapted))
    moved = saved(tmp_path / "b.npz", picture([replace(CUP, position=(0.1, 0.0, 0.06)), BOOK]))
    said = run(moved, "--update", first, "--result", adapted, "--out", second)
    assert "The cup moved" in said and "The blue box did not move." in said
    assert "The path no longer holds" in said and "Clearance to the cup is" in said
    assert load_scene(second)[0].names == scene.names


def test_a_file_without_objects_is_no_earlier_look(tmp_path: Path, look: str) -> None:
    (tmp_path / "other.json").write_text('{"a": 1}')
    assert "holds no objects to compare with" in run(look, "--update", tmp_path / "other.json")


def test_a_point_cloud(tmp_path: Path) -> None:
    np.save(tmp_path / "cloud.npy", picture([CUP, BOOK]).points.reshape(-1, 3))
    said = json.loads(run(tmp_path / "cloud.npy", "--json"))
    assert [one["name"] for one in said["objects"]] == ["box", "box 2", "table"]
    assert "no picture to draw over" in run(tmp_path / "cloud.npy", "--picture", tmp_path / "a.png")
    model = ("--detector", "vlm:my-model", "--base-url", "http://127.0.0.1:9/v1")
    assert "use clusters" in run(tmp_path / "cloud.npy", *model)


def test_a_bag(tmp_path: Path) -> None:
    pytest.importorskip("rosbags", reason="needs rosbags (extra ros)")
    from camera_bags import Camera, millimetres, write

    view, cam = picture([CUP, BOOK]), Camera()
    depth, info = "/camera/depth/image_rect_raw", "/camera/depth/camera_info"
    said = [(info, 0.0, cam.info(view.intrinsics, view.shape)), (depth, 0.0, cam.image(millimetres(view), "16UC1"))]
    said += [("/camera/color/image_raw", 0.0, cam.image(view.rgb, "rgb8"))]
    bag = write(tmp_path / "bag", said)
    (tmp_path / "mount.json").write_text(json.dumps({"pose": view.pose.tolist()}))
    assert "--pose FILE" in run(bag)
    shown = run(bag, "--pose", tmp_path / "mount.json", "--depth", depth, "--at", "0", "--names", "cup=red,book=blue")
    assert "  cup: at (" in shown and "  book: at (0.05" in shown


def test_a_vision_language_model(tmp_path: Path, look: str, stub) -> None:
    entry = {"label": "cup", "box": [0.1, 0.2, 0.5, 0.9]}
    stub.script(stub.says(json.dumps({"description": "One cup.", "objects": [entry]})))
    said = run(look, "--detector", "vlm:my-model", "--base-url", stub.url, "--json")
    document = json.loads(said[said.index("{") : said.rindex("}") + 1])
    assert document["environment"] == "One cup." and [one["name"] for one in document["objects"]] == ["cup", "table"]


def test_what_is_not_to_be_in_the_scene_is_left_out(tmp_path: Path, look: str) -> None:
    out = tmp_path / "a.json"
    book = [str(round(float(each))) for each in picture([CUP, BOOK]).project(np.array([BOOK.position]))[0]]
    column, row = map(int, book)
    for option in (
        ("--without", "blue box"),
        ("--without", f"{column - 30},{row - 25},{column + 30},{row + 25}"),
        ("--without", "-0.1,-0.3,0.005,0.2,-0.05,0.2"),
        ("--crop", f"0,0,{column - 35},119"),
    ):
        run(look, "--names", "cup=red", *option, "--out", out)
        assert load_scene(out)[0].names == ("cup", "table"), option
    assert "nothing of this name to leave out" in run(look, "--without", "gripper", code=3)
    np.save(tmp_path / "cloud.npy", picture([CUP, BOOK]).points.reshape(-1, 3))
    run(tmp_path / "cloud.npy", "--without", "-0.1,-0.3,0.005,0.2,-0.05,0.2", "--out", out)
    assert load_scene(out)[0].names == ("box", "table")
    assert "no pixels" in run(tmp_path / "cloud.npy", "--without", "1,1,5,5")


def test_a_name_that_nothing_bears_is_said_and_ends_in_its_own_exit_code(tmp_path: Path, look: str, stub) -> None:
    assert "lamp: nothing seen fits this name" in run(look, "--names", "cup=red, lamp=green", code=3)
    entry = {"label": "cup", "box": [0.1, 0.2, 0.5, 0.9]}
    stub.script(stub.says(json.dumps({"description": "One cup.", "objects": [entry]})))
    model = ("--detector", "vlm:my-model", "--base-url", stub.url)
    said = run(look, *model, "--names", "cup, lamp", "--out", tmp_path / "a.json", code=3)
    assert "lamp: not found" in said and "cup" in load_scene(tmp_path / "a.json")[0].names


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("--result", "r.json"), "--result goes with --update"),
        (("--update", "none.json"), "no such file"),
        (("--detector", "yolo"), "unknown detector 'yolo'"),
        (("--boxes", "gemini"), "go with a vlm: detector"),
        (("--detector", "vlm:google:gemini-x"), "set GOOGLE_API_KEY, or use --detector clusters"),
        (("--pose", "none.json"), "no such file"),
        (("--without", "1,2,3"), "four numbers"),
        (("--without", "5,5,1,9"), "second corner must be beyond the first"),
        (("--crop", "left"), "four numbers"),
        (("--crop", "0,0,2,2", "--without", "0,0,9,9"), "nothing of a is left"),
    ],
)
def test_mistakes_are_one_sentence(look: str, arguments: tuple[str, ...], says: str) -> None:
    said = run(look, *arguments)
    assert says in said and "\n" not in said
