"""Views and clouds from ROS bags."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rosbags", reason="needs rosbags (extra ros)")

from camera_bags import ROS1, Camera, Said, millimetres, png, write
from depth_pictures import Thing, camera, picture
from PIL import Image

from ovita.errors import FormatError
from ovita.perceive import View, perceive
from ovita.perceive.recordings import Mount, RecordingChoices, load_mount, read_recording

CUP = Thing("box", (0.0, 0.1, 0.06), (0.08, 0.08, 0.12), colour="red")
DEPTH, RGB = "/camera/depth/image_rect_raw", "/camera/color/image_raw"
INFO, RGB_INFO = "/camera/depth/camera_info", "/camera/color/camera_info"


@pytest.fixture(scope="module")
def view() -> View:
    return picture([CUP])


def recording(view: View, cam: Camera, **other: Said) -> list[Said]:
    """Depth, colours and the camera's place, at 0 s; `other` replaces or adds streams."""
    static = cam.tf(("world", "cam_link", view.pose), ("cam_link", "cam_optical", np.eye(4)))
    said = {
        "tf": ("/tf_static", 0.0, static),
        "info": (INFO, 0.0, cam.info(view.intrinsics, view.shape)),
        "depth": (DEPTH, 0.0, cam.image(millimetres(view), "16UC1")),
        "rgb": (RGB, 0.01, cam.image(view.rgb, "rgb8", at=0.01)),
    }
    return [one for one in {**said, **other}.values() if one is not None]


def same(view: View, read: View, colours: bool = True) -> bool:
    close = np.nanmax(np.abs(view.depth - read.depth)) < 6e-4
    poses = np.allclose(view.pose, read.pose) and np.allclose(view.intrinsics, read.intrinsics)
    return bool(close and poses and (not colours or (read.rgb == view.rgb).all()))


@pytest.mark.parametrize("name", ["a", "a_db3", "a.bag"])
def test_every_kind_of_bag(tmp_path: Path, view: View, name: str) -> None:
    cam = Camera(ROS1) if name.endswith(".bag") else Camera()
    read = read_recording(write(tmp_path / name, recording(view, cam), cam.store))
    assert len(read.views) == 1 and same(view, read.views[0])
    assert any("frame 'world'" in note for note in read.notes)
    seen = perceive(read.views)
    assert np.linalg.norm(seen.scene.objects[0].position - CUP.position) < 0.02


def inverted(view: View) -> bytes:
    """Depth in metres as compressedDepth stores it."""
    a, b = 100.0, 20.0
    raw = np.nan_to_num(a / view.depth + b).round().astype(np.uint16)
    return np.array([0], "<i4").tobytes() + np.array([a, b], "<f4").tobytes() + png(raw)


def depths(view: View, cam: Camera) -> dict[str, Said]:
    metres = view.depth.astype(np.float32)
    return {
        "padded rows": (DEPTH, 0.0, cam.image(millimetres(view), "16UC1", pad=6)),
        "big endian": (DEPTH, 0.0, cam.image(millimetres(view), "mono16", big=True)),
        "metres": (DEPTH, 0.0, cam.image(metres, "32FC1")),
        "compressed": (f"{DEPTH}/compressedDepth", 0.0,
                       cam.compressed(bytes(12) + png(millimetres(view)), "16UC1; compressedDepth")),
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["padded rows", "big endian", "metres", "compressed"])
def test_depth_encodings(tmp_path: Path, view: View, kind: str) -> None:
    cam = Camera()
    read = read_recording(write(tmp_path / "a", recording(view, cam, depth=depths(view, cam)[kind])))
    assert same(view, read.views[0])


def test_compressed_depth_in_metres(tmp_path: Path, view: View) -> None:
    cam = Camera()
    said = (f"{DEPTH}/compressedDepth", 0.0, cam.compressed(inverted(view), "32FC1; compressedDepth png"))
    (read,) = read_recording(write(tmp_path / "a", recording(view, cam, depth=said))).views
    assert np.nanmax(np.abs(read.depth / view.depth - 1.0)) < 0.02, "its steps grow with the distance"


def jpeg(view: View) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(view.rgb).save(stream, "JPEG", quality=95)
    return stream.getvalue()


@pytest.mark.parametrize("kind", ["bgr8", "rgba8", "mono8", "png", "jpeg"])
def test_colour_encodings(tmp_path: Path, view: View, kind: str) -> None:
    cam = Camera()
    said = {
        "bgr8": lambda: (RGB, 0.0, cam.image(view.rgb[..., ::-1], "bgr8")),
        "rgba8": lambda: (RGB, 0.0, cam.image(np.dstack([view.rgb, view.rgb[..., :1]]), "rgba8")),
        "mono8": lambda: (RGB, 0.0, cam.image(view.rgb[..., :1], "mono8")),
        "png": lambda: (f"{RGB}/compressed", 0.0, cam.compressed(png(view.rgb), "rgb8; png compressed rgb8")),
        "jpeg": lambda: (f"{RGB}/compressed", 0.0, cam.compressed(jpeg(view), "rgb8; jpeg compressed bgr8")),
    }[kind]()
    rgb = read_recording(write(tmp_path / "a", recording(view, cam, rgb=said))).views[0].rgb
    assert rgb is not None
    if kind == "mono8":
        assert (rgb == view.rgb[..., :1]).all()
    elif kind == "jpeg":
        assert np.abs(rgb.astype(int) - view.rgb).mean() < 4.0
    else:
        assert (rgb == view.rgb).all()


def test_the_same_picture_in_two_transports_is_one_and_the_raw_one_is_read(tmp_path: Path, view: View) -> None:
    cam = Camera()
    twice = (f"{RGB}/compressed", 0.0, cam.compressed(b"never decoded", "jpeg"))
    assert same(view, read_recording(write(tmp_path / "a", recording(view, cam, again=twice))).views[0])


def test_times(tmp_path: Path, view: View) -> None:
    cam, said = Camera(), []
    for i in range(3):
        pose = view.pose.copy()
        pose[0, 3] += 0.1 * i
        said += [("/tf", i, cam.tf(("world", "cam_optical", pose), at=i))]
        said += [(INFO, i, cam.info(view.intrinsics, view.shape, at=i))]
        said += [(DEPTH, i, cam.image(millimetres(view) + np.uint16(10 * i), "16UC1", at=i))]
    bag = write(tmp_path / "a", said)
    (last,) = read_recording(bag).views
    first, middle = read_recording(bag, RecordingChoices(at=(0.0, 1.2))).views
    for beyond in (-1.0, 500.0):
        with pytest.raises(FormatError, match="so there is nothing --at"):
            read_recording(bag, RecordingChoices(at=(beyond,)))
    for i, read in enumerate((first, middle, last)):
        assert read.pose[0, 3] == pytest.approx(view.pose[0, 3] + 0.1 * i)
        assert np.nanmedian(read.depth - view.depth) == pytest.approx(0.01 * i, abs=1e-3)
    assert read_recording(bag).views[0].rgb is None


def test_a_place_that_is_old_is_said(tmp_path: Path, view: View) -> None:
    cam = Camera()
    late = ("/tf", 0.4, cam.tf(("world", "cam_optical", view.pose), at=0.4))
    read = read_recording(write(tmp_path / "a", recording(view, cam, tf=late)))
    assert any("0.4 s off" in note for note in read.notes)


def test_a_picture_of_another_moment_is_left_out(tmp_path: Path, view: View) -> None:
    cam = Camera()
    late = (RGB, 2.0, cam.image(view.rgb, "rgb8", at=2.0))
    read = read_recording(write(tmp_path / "a", recording(view, cam, rgb=late)))
    assert read.views[0].rgb is None and any("moment" in note for note in read.notes)


def test_colours_of_another_camera_are_carried_over(tmp_path: Path) -> None:
    depth = picture([CUP], (-0.7, 0.0, 0.6))
    beside = picture([CUP], (-0.7, 0.05, 0.6), (0.0, 0.05, 0.0), size=(240, 180))
    cam = Camera()
    tree = cam.tf(("world", "cam_optical", depth.pose), ("world", "rgb_optical", beside.pose))
    said = recording(
        depth, cam, tf=("/tf_static", 0.0, tree),
        rgb=(RGB, 0.0, cam.image(beside.rgb, "rgb8", "rgb_optical")),
        more=(RGB_INFO, 0.0, cam.info(beside.intrinsics, beside.shape, "rgb_optical")),
    )  # fmt: skip
    read = read_recording(write(tmp_path / "a", said))
    rgb = read.views[0].rgb
    assert rgb is not None and any("carried over" in note for note in read.notes)
    red = lambda picture: picture[..., 0].astype(int) - picture[..., 2] > 60  # noqa: E731
    both, either = red(rgb) & red(depth.rgb), red(rgb) | red(depth.rgb)
    assert both.sum() / either.sum() > 0.8


def test_a_rectified_picture_uses_the_projection_and_a_raw_one_says_that_it_bends(tmp_path: Path, view: View) -> None:
    cam, other = Camera(), view.intrinsics * [[1.1, 1, 1], [1, 1.1, 1], [1, 1, 1]]
    bent = (INFO, 0.0, cam.info(other, view.shape, bend=0.1, p=view.intrinsics))
    assert same(view, read_recording(write(tmp_path / "a", recording(view, cam, info=bent))).views[0])
    raw = "/camera/depth/image_raw"
    said = recording(view, cam, info=bent, depth=(raw, 0.0, cam.image(millimetres(view), "16UC1")))
    read = read_recording(write(tmp_path / "b", said))
    assert np.allclose(read.views[0].intrinsics, other) and any("not rectified" in note for note in read.notes)


def test_a_hand_eye_pose_from_a_file(tmp_path: Path, view: View) -> None:
    hand = camera((0.2, 0.3, 0.9))
    (tmp_path / "mount.json").write_text(
        json.dumps({"frame": "tool0", "pose": (np.linalg.inv(hand) @ view.pose).tolist()})
    )
    cam = Camera()
    said = recording(view, cam, tf=("/tf", 0.0, cam.tf(("base_link", "tool0", hand))))
    mount = load_mount(tmp_path / "mount.json")
    assert mount.frame == "tool0"
    bag = write(tmp_path / "a", said)
    assert np.allclose(read_recording(bag, RecordingChoices(mount=mount)).views[0].pose, view.pose)
    alone = Mount(view.pose)
    assert np.allclose(read_recording(bag, RecordingChoices(mount=alone)).views[0].pose, view.pose)


@pytest.mark.parametrize(
    "content",
    ["{}", '{"pose": [[1, 0], [0, 1]]}', '{"pose": [[2,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}', '{"pose": 3}'],
)
def test_mounts_that_are_none(tmp_path: Path, content: str) -> None:
    (tmp_path / "mount.json").write_text(content)
    with pytest.raises(FormatError, match="pose") as error:
        load_mount(tmp_path / "mount.json")
    assert "\n" not in str(error.value)


def test_point_clouds(tmp_path: Path, view: View) -> None:
    cam = Camera()
    points = ((view.points.reshape(-1, 3) - view.center) @ view.pose[:3, :3])[::3]
    colours = view.rgb.reshape(-1, 3)[::3]
    said = [
        ("/tf_static", 0.0, cam.tf(("world", "cam_optical", view.pose))),
        ("/points", 0.0, cam.cloud(points, colours)),
    ]
    (cloud,) = read_recording(write(tmp_path / "a", said)).clouds
    finite = np.isfinite(points).all(axis=1)
    assert np.allclose(cloud.points, view.points.reshape(-1, 3)[::3][finite], atol=1e-5)
    assert cloud.colours is not None and (cloud.colours == colours[finite]).all()
    alone = read_recording(write(tmp_path / "b", said[1:]))
    assert any("own frame 'cam_optical'" in note for note in alone.notes)


def broken(view: View, cam: Camera) -> dict[str, tuple[list[Said], RecordingChoices, str]]:
    whole, none = recording(view, cam), RecordingChoices()
    other = ("/other/depth", 0.0, cam.image(millimetres(view), "16UC1"))
    short = cam.image(millimetres(view), "16UC1")
    short.data = short.data[:-10]
    rvl = (f"{DEPTH}/compressedDepth", 0.0, cam.compressed(bytes(20), "16UC1; compressedDepth rvl"))
    junk = (f"{DEPTH}/compressedDepth", 0.0, cam.compressed(bytes(40), "16UC1; compressedDepth"))
    bayer = (RGB, 0.0, cam.image(view.rgb[..., :1], "bayer_rggb8"))
    small = (INFO, 0.0, cam.info(view.intrinsics, (10, 20)))
    return {
        "no depth": ([one for one in whole if one[0] != DEPTH], none, "no topic holds depth pictures or a point cloud"),
        "two depths": ([*whole, other], none, "several topics with depth, choose one with --depth: "),
        "unknown topic": (whole, RecordingChoices(depth="/x"), "/x is not in this bag; --depth may be /camera"),
        "wrong kind": (whole, RecordingChoices(depth=RGB), "holds no depth"),
        "no camera": ([one for one in whole if one[0] != INFO], none, "there is no CameraInfo at all"),
        "other size": (recording(view, cam, info=small), none, "no CameraInfo beside .* is of 160x120 pixels"),
        "no place": ([one for one in whole if one[0] != "/tf_static"], none, "it holds no transforms.*--pose FILE"),
        "other world": (whole, RecordingChoices(world_frame="mars"), "the frames are cam_link, cam_optical, world"),
        "other camera": (whole, RecordingChoices(camera_frame="mars"), "nothing says where 'mars' is"),
        "cut off": (recording(view, cam, depth=(DEPTH, 0.0, short)), none, "do not hold"),
        "rvl": (recording(view, cam, depth=rvl), none, "compressed by RVL"),
        "junk": (recording(view, cam, depth=junk), none, "no PNG or JPEG"),
        "bayer": (recording(view, cam, rgb=bayer), none, "bayer_rggb8; colours are read from"),
    }  # fmt: skip


@pytest.mark.parametrize("case", list(broken(picture([CUP]), Camera())))
def test_what_is_wrong_is_one_sentence(tmp_path: Path, view: View, case: str) -> None:
    said, choices, says = broken(view, Camera())[case]
    with pytest.raises(FormatError, match=says) as error:
        read_recording(write(tmp_path / "a", said), choices)
    assert "\n" not in str(error.value) and str(tmp_path / "a") in str(error.value)
