import json
import sys

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.cli.main import main
from ovita.errors import FormatError
from ovita.io import load_scene
from ovita.perceive.pictures import load_view, views_from

CUP = Thing("cylinder", (0.0, 0.12, 0.05), (0.08, 0.08, 0.1), colour="red")
BOX = Thing("box", (0.1, -0.12, 0.04), (0.1, 0.14, 0.08), 0.4, "blue")


@pytest.fixture(scope="module")
def seen():
    return picture([CUP, BOX], noise=0.001)


@pytest.fixture
def folder(tmp_path, seen):
    Image = pytest.importorskip("PIL.Image")
    place = tmp_path / "look"
    place.mkdir()
    Image.fromarray(seen.rgb).save(place / "rgb.png")
    Image.fromarray(np.nan_to_num(1000 * seen.depth).round().astype(np.uint16)).save(place / "depth.png")
    camera = {"intrinsics": seen.intrinsics.tolist(), "pose": seen.pose.tolist()}
    (place / "camera.json").write_text(json.dumps(camera))
    return place


def run(monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["ovita", "perceive", *map(str, arguments)])
    with pytest.raises(SystemExit) as stopped:
        main()
    return stopped.value.code


def test_a_folder_an_archive_and_loose_files_hold_the_same_view(folder, seen, tmp_path):
    (one,) = views_from([str(folder)])
    assert np.nanmax(np.abs(one.depth - seen.depth)) < 0.0006
    assert np.array_equal(one.rgb, seen.rgb)
    np.savez(tmp_path / "v.npz", depth=seen.depth, rgb=seen.rgb, intrinsics=seen.intrinsics, pose=seen.pose)
    (two,) = views_from([str(tmp_path / "v.npz")])
    assert np.array_equal(two.depth, seen.depth, equal_nan=True)
    np.save(tmp_path / "d.npy", seen.depth)
    (three,) = views_from([str(folder / "rgb.png"), str(tmp_path / "d.npy")], str(folder / "camera.json"))
    assert np.allclose(three.pose, seen.pose) and np.array_equal(three.rgb, seen.rgb)


def test_a_grey_picture_is_a_picture(folder, seen):
    Image = pytest.importorskip("PIL.Image")
    Image.fromarray(seen.rgb).convert("L").save(folder / "rgb.png")
    (view,) = views_from([str(folder)])
    assert view.rgb.shape == seen.rgb.shape and np.ptp(view.rgb, axis=2).max() == 0


def test_numbers_alone_need_no_picture_reader(tmp_path, seen, monkeypatch):
    monkeypatch.setitem(sys.modules, "PIL", None)
    np.save(tmp_path / "depth.npy", seen.depth)
    camera = {"fx": 152, "fy": 152, "cx": 79.5, "cy": 59.5, "position": [-0.7, 0, 0.6], "orientation": [1, 0, 0, 0]}
    (tmp_path / "camera.json").write_text(json.dumps(camera))
    (one,) = views_from([str(tmp_path)])
    assert one.rgb is None and one.intrinsics == pytest.approx(seen.intrinsics)


def test_axes_of_opengl_are_turned(folder, seen):
    flipped = seen.pose @ np.diag([1.0, -1.0, -1.0, 1.0])
    camera = {"intrinsics": seen.intrinsics.tolist(), "pose": flipped.tolist(), "axes": "opengl"}
    (folder / "camera.json").write_text(json.dumps(camera))
    assert np.allclose(views_from([str(folder)])[0].pose, seen.pose)


def test_pictures_become_a_scene_that_adapt_takes(folder, tmp_path, monkeypatch, capsys):
    out, boxes = tmp_path / "scene.json", tmp_path / "boxes.png"
    assert run(monkeypatch, folder, "--names", "red cup, carton=blue", "--out", out, "--picture", boxes) == 0
    scene, stated = load_scene(out)
    assert stated and scene.frame.name == "flu"
    assert np.linalg.norm(scene["red cup"].position - CUP.position) < 0.006
    assert scene["carton"].extra["shape"] == "box"
    assert boxes.read_bytes().startswith(b"\x89PNG")
    assert "red cup: at (" in capsys.readouterr().out


def test_an_empty_table_is_said(tmp_path, monkeypatch, capsys):
    view = picture([])
    np.savez(tmp_path / "v.npz", depth=view.depth, intrinsics=view.intrinsics, pose=view.pose)
    assert run(monkeypatch, tmp_path / "v.npz") == 3
    assert "Nothing was found" in capsys.readouterr().out


def camera(**changes):
    good = {"intrinsics": [[152, 0, 79.5], [0, 152, 59.5], [0, 0, 1]], "pose": np.eye(4).tolist()}
    return {key: value for key, value in {**good, **changes}.items() if value is not None}


SHEARED = np.eye(4) + np.diag([0.2, 0.0], 2)


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"intrinsics": None}, "has no intrinsics"),
        ({"pose": None}, "has no pose"),
        ({"pose": [[1, 0], [0, 1]]}, "4x4 matrix"),
        ({"pose": (2 * np.eye(4)).tolist()}, "0, 0, 0, 1"),
        ({"pose": SHEARED.tolist()}, "not rigid"),
        ({"pose": np.diag([1.0, 1.0, -1.0, 1.0]).tolist()}, "mirrors"),
        ({"intrinsics": [[0, 0, 79], [0, 152, 59], [0, 0, 1]]}, "must be positive"),
        ({"intrinsics": [[152, 0, 0], [0, 152, 0], [79, 59, 1]]}, "transposed"),
        ({"intrinsics": [[600, 0, 640], [0, 600, 360], [0, 0, 1]]}, "another resolution"),
        ({"intrinsics": [[1, 2], [3]]}, "3x3 matrix"),
        ({"intrinsics": "none"}, "expected a list"),
        ({"focal": 3}, "unknown key|unexpected"),
        ({"depth_scale": 1.0}, "looks like millimetres"),
        ({"depth_scale": 1e-6}, "unit as depth_scale"),
        ({"depth_scale": 0}, "depth_scale must be above 0"),
        ({"axes": "ros"}, "expected 'opencv' or 'opengl'"),
    ],
)
def test_a_wrong_camera_is_refused_in_one_sentence(folder, changes, says):
    (folder / "camera.json").write_text(json.dumps(camera(**changes)))
    with pytest.raises(FormatError, match=says) as refused:
        views_from([str(folder)])
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize(
    "depth, says",
    [
        (np.full((120, 160), np.nan), "no distance at all"),
        (np.zeros((120, 160), dtype=np.uint16), "no distance at all"),
        (np.full((120, 160), 812.0), "looks like millimetres"),
        (np.full((60, 80), 0.8), "register the depth"),
        (np.ones((4, 4)), "at least 16 pixels"),
        (np.ones((120, 160, 2)), "no depth picture"),
        (np.ones((120, 160), dtype=np.uint8), "too coarse"),
        (np.array(["a"] * 20), "not numbers"),
    ],
)
def test_a_wrong_depth_picture_is_refused_in_one_sentence(folder, depth, says):
    (folder / "depth.png").unlink()
    np.save(folder / "depth.npy", depth)
    with pytest.raises(FormatError, match=says) as refused:
        views_from([str(folder)])
    assert "\n" not in str(refused.value)


def test_missing_and_damaged_files_are_named(folder, tmp_path):
    with pytest.raises(FormatError, match="needs its camera"):
        views_from([str(folder / "depth.png")])
    with pytest.raises(FormatError, match="no such file"):
        views_from([str(tmp_path / "none.png")], "camera.json")
    with pytest.raises(FormatError, match="one depth picture"):
        views_from([str(folder / "rgb.png")], str(folder / "camera.json"))
    (folder / "rgb.png").write_bytes(b"not a picture")
    with pytest.raises(FormatError, match=r"rgb.png.*is no PNG"):
        views_from([str(folder)])
    (folder / "depth.png").unlink()
    with pytest.raises(FormatError, match="has no depth picture"):
        views_from([str(folder)])
    (tmp_path / "v.npz").write_bytes(b"PK\x03\x04 broken")
    with pytest.raises(FormatError, match=r"v.npz.*NPZ"):
        views_from([str(tmp_path / "v.npz")])
    (tmp_path / "v.txt").write_text("1")
    with pytest.raises(FormatError, match="views are read from"):
        views_from([str(tmp_path / "v.txt")])
    with pytest.raises(FormatError, match="no such file"):
        load_view(str(tmp_path / "depth.npy"), None, str(folder / "camera.json"))


def test_the_command_line_fails_in_one_sentence(folder, tmp_path, monkeypatch, capsys):
    assert run(monkeypatch, folder, "--out", tmp_path / "scene.csv") == 2
    assert run(monkeypatch, folder, "--plane", "low") == 2
    assert run(monkeypatch, folder, "--picture", tmp_path / "none" / "x.png") == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 3 and all(line.startswith("error: ") for line in said)
