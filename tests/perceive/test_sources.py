"""Where pictures come from, told apart; and detectors by name."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from depth_pictures import Thing, picture

from ovita.errors import FormatError, RequestError
from ovita.perceive import perceive
from ovita.perceive.detect import ClusterDetector, detector_named
from ovita.perceive.pictures import gathered
from ovita.perceive.recordings import Mount, RecordingChoices
from ovita.perceive.vlm import VlmDetector

CUP = Thing("box", (0.0, 0.1, 0.06), (0.08, 0.08, 0.12), colour="red")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    view = picture([CUP])
    held = {"depth": view.depth, "rgb": view.rgb, "intrinsics": view.intrinsics, "pose": view.pose}
    np.savez(tmp_path / "view.npz", **held)
    np.save(tmp_path / "cloud.npy", view.points.reshape(-1, 3))
    np.save(tmp_path / "depth.npy", view.depth)
    (tmp_path / "damaged.npy").write_bytes(b"no numbers")
    return tmp_path


def test_pictures_and_clouds_are_told_apart(folder: Path) -> None:
    assert len(gathered([str(folder / "view.npz")]).views) == 1
    read = gathered([str(folder / "cloud.npy")])
    assert read.views == () and len(read.clouds) == 1


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (["view.npz", "cloud.npy"], "cannot be looked at together"),
        (["depth.npy"], "--camera camera.json"),
        (["damaged.npy"], "no NPY file"),
        (["none.npy"], "no such file"),
        (["none.ply"], "no such file"),
    ],
)
def test_what_cannot_be_looked_at(folder: Path, names: list[str], says: str) -> None:
    with pytest.raises((FormatError, RequestError)) as error:
        gathered([str(folder / name) for name in names])
    assert says in str(error.value) and "\n" not in str(error.value)


def test_a_bag_is_read_beside_views(folder: Path) -> None:
    pytest.importorskip("rosbags", reason="needs rosbags (extra ros)")
    from camera_bags import Camera, millimetres, write

    view, cam = picture([CUP], (0.6, 0.4, 0.6)), Camera()
    said = [
        ("/tf_static", 0.0, cam.tf(("world", "cam_optical", view.pose))),
        ("/camera/depth/camera_info", 0.0, cam.info(view.intrinsics, view.shape)),
        ("/camera/depth/image_rect_raw", 0.0, cam.image(millimetres(view), "16UC1")),
    ]
    read = gathered([str(folder / "view.npz"), str(write(folder / "bag", said))])
    assert len(read.views) == 2 and any("frame 'world'" in note for note in read.notes)
    assert perceive(read.views).scene.objects[0].extra["seen_by"] == 2


def test_detectors_by_name() -> None:
    assert detector_named("clusters") is None
    assert isinstance(detector_named("vlm:my-model", base_url="http://127.0.0.1:9/v1", boxes="gemini"), VlmDetector)
    view = picture([CUP])
    assert len(ClusterDetector(perceive([view]).scene.frame).find(view, (), "")) == 1


@pytest.mark.parametrize(
    ("name", "options", "says"),
    [
        ("yolo", {}, "unknown detector 'yolo'; use clusters, vlm:PROVIDER:MODEL"),
        ("vlm:", {}, "unknown detector"),
        ("vlm:nobody", {}, "names no model"),
        ("clusters+sam", {}, "unknown detector"),
        ("onnx:", {}, "unknown detector"),
        ("clusters", {"boxes": "gemini"}, "go with a vlm: detector"),
        ("onnx:none.onnx,none.onnx", {}, "no such file"),
    ],
)
def test_detectors_that_are_none(name: str, options: dict[str, str], says: str) -> None:
    with pytest.raises((RequestError, FormatError), match=says):
        detector_named(name, **options)


def test_masks_of_clusters(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime", reason="needs ONNX Runtime (extra perceive-onnx)")
    pytest.importorskip("onnx", reason="needs the package onnx, which writes the tests' tiny models")
    from sam_models import sam2

    detector = detector_named(f"onnx:{','.join(sam2(tmp_path))}")
    assert detector is not None
    seen = perceive([picture([CUP])], names=["cup=red"], detector=detector)
    assert seen.scene.names == ("cup", "table")
    assert np.linalg.norm(seen.scene["cup"].position - CUP.position) < 0.02


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"choices": RecordingChoices(at=(3.0,))}, "--at: for a bag or a live camera"),
        ({"choices": RecordingChoices(rgb="/a", world_frame="map")}, "--rgb and --world-frame: for a bag"),
        ({"choices": RecordingChoices(mount=Mount(np.eye(4)))}, "--pose: for a bag"),
    ],
)
def test_options_of_recordings_are_refused_beside_pictures_alone(folder: Path, options: Any, says: str) -> None:
    with pytest.raises(RequestError, match=says):
        gathered([str(folder / "view.npz")], **options)


def test_a_camera_file_is_refused_where_no_picture_needs_it(folder: Path) -> None:
    with pytest.raises(RequestError, match="--camera goes with pictures"):
        gathered([str(folder / "cloud.npy")], camera="camera.json")
