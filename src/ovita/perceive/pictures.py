"""Views from files: PNG, JPEG or NPY pictures with a camera.json, folders of these, and NPZ files of all in one.

Everything there is to look at, recordings, live topics and point clouds too, is told apart by `gathered`.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import chain
from pathlib import Path
from typing import Any, Literal
from zipfile import BadZipFile

import numpy as np

from ovita.errors import FormatError, RequestError, SceneError
from ovita.io.cameras import decode_picture
from ovita.io.clouds import CLOUDS, load_cloud
from ovita.io.documents import check_keys, validated
from ovita.io.files import examine, file_name, is_address, is_bag, read_text, suffix
from ovita.io.json_ import parse_object
from ovita.paths.scene import matrix
from ovita.paths.trajectory import Array
from ovita.perceive.recordings import Recorded, RecordingChoices, read_live, read_recording
from ovita.perceive.view import View
from ovita.text import listed

PICTURES = (".png", ".jpg", ".jpeg", ".npy")
"""Endings of pictures."""

CAMERA = "camera.json"


@dataclass(frozen=True)
class CameraFile:
    """What a camera.json holds.

    Args:
        intrinsics: Camera matrix (3, 3) [pixels].
        pose: Camera to world (4, 4) [m].
        depth_scale: Metres per unit of the depth picture; None is millimetres for whole numbers, metres for others.
        axes: "opencv" (x right, y down, z forward) or "opengl" (x right, y up, z backward).
    """

    intrinsics: list[list[float]]
    pose: list[list[float]]
    depth_scale: float | None = None
    axes: Literal["opencv", "opengl"] = "opencv"


def views_from(places: Sequence[str], camera: str | None = None) -> tuple[View, ...]:
    """Views from files and folders as they are named on a command line.

    Args:
        places: Folders, each with a depth picture, perhaps a colour picture, and a camera.json; NPZ files; or one
            depth picture, with or without one colour picture, in any order.
        camera: The camera.json of loose pictures, and of folders that have none.

    Raises:
        FormatError: If something is missing or cannot be read, or pictures and camera do not fit.
        MissingExtra: If a PNG or JPEG is to be read without pillow.
    """
    views, loose = [], []
    for place in places:
        if os.path.isdir(place):
            views.append(_folder(place, camera))
        elif suffix(place) == ".npz":
            views.append(_archive(place, camera))
        elif suffix(place) in PICTURES:
            loose.append(place)
        else:
            examine(place)
            raise FormatError(file_name(place), f"views are read from folders, .npz, and {', '.join(PICTURES)} files")
    if loose:
        views.append(_loose(loose, camera))
    return tuple(views)


def load_view(depth: str, rgb: str | None, camera: str) -> View:
    """A view from a depth picture, a colour picture or None, and a camera.json."""
    raw, colours = _read(depth), None if rgb is None else _read(rgb)
    return _view(raw, colours, load_camera(camera), depth, rgb or depth, camera)


def load_camera(path: str) -> CameraFile:
    """Read a camera.json.

    Its intrinsics are a matrix, or fx, fy, cx, cy; its pose a matrix (4, 4), or position and orientation (wxyz).
    """
    file = file_name(path)
    return camera_from(parse_object(read_text(path), file), file)


def camera_from(document: Mapping[str, Any], file: str) -> CameraFile:
    """A camera from a parsed camera.json."""
    given = {key: value for key, value in document.items() if key not in ("width", "height", "name", "frame")}
    if "fx" in given:
        fx, fy, cx, cy = (validated(float, given.pop(key, None), file, key) for key in ("fx", "fy", "cx", "cy"))
        given["intrinsics"] = [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]]
    if "position" in given or "orientation" in given:
        given["pose"] = _posed(given.pop("position", None), given.pop("orientation", None), file)
    check_keys(given, [item.name for item in fields(CameraFile)], file)
    missing = next((key for key in _NEEDED if key not in given), "")
    if missing:
        raise FormatError(file, f"has no {missing}; give {_NEEDED[missing]}")
    camera = validated(CameraFile, given, file)
    if camera.depth_scale is not None and not 0.0 < camera.depth_scale < np.inf:
        raise FormatError(file, "must be above 0: metres a unit of the depth picture", key="depth_scale")
    return camera


_NEEDED = {
    "intrinsics": "a 3x3 matrix, or fx, fy, cx and cy",
    "pose": "the camera-to-world matrix 4x4, or position and orientation (wxyz)",
}


def _posed(position: Any, orientation: Any, file: str) -> list[list[float]]:
    place = validated(tuple[float, float, float], position, file, "position")
    turn = np.array(validated(tuple[float, float, float, float], orientation, file, "orientation"))
    if abs(np.linalg.norm(turn) - 1.0) > 1e-2:
        raise FormatError(file, "must be a unit quaternion w, x, y, z", key="orientation")
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = matrix(turn / np.linalg.norm(turn)), place
    return [list(row) for row in pose.tolist()]


def _view(raw: Array, colours: Any, camera: CameraFile, depth: str, rgb: str, where: str) -> View:
    """A view, each of its mistakes said of the file that made it."""
    if raw.ndim != 2:
        raise FormatError(file_name(depth), "is no depth picture: it has colours; give 16-bit grey, or NPY metres")
    if raw.dtype == np.uint8:
        raise FormatError(file_name(depth), "is an 8-bit picture, which is too coarse for depth; give 16-bit, or NPY")
    try:
        unit = 0.001 if np.issubdtype(raw.dtype, np.integer) else 1.0
        seen = raw.astype(float) * (unit if camera.depth_scale is None else camera.depth_scale)
        square = np.shape(camera.pose) == (4, 4)
        pose = np.array(camera.pose, dtype=float) @ np.diag(_AXES[camera.axes]) if square else np.zeros((4, 0))
        if isinstance(colours, np.ndarray) and colours.ndim == 2 and colours.dtype == np.uint8:
            colours = np.repeat(colours[..., None], 3, axis=2)
        return View(seen, np.array(camera.intrinsics), pose, colours, _name(depth))
    except SceneError as error:
        of_picture = {"depth": depth, "rgb": rgb}
        key = None if error.key in of_picture else error.key
        raise FormatError(file_name(of_picture.get(error.key or "", where)), error.problem, key=key) from None
    except ValueError:
        raise FormatError(file_name(where), "must be a 3x3 matrix of numbers", key="intrinsics") from None


_AXES = {"opencv": [1.0, 1.0, 1.0, 1.0], "opengl": [1.0, -1.0, -1.0, 1.0]}


def _name(depth: str) -> str:
    """What to call a view: its folder, or the file where that says more."""
    path = Path(depth)
    return (path.resolve().parent.name or path.stem) if path.stem.lower() == "depth" else path.stem


def _folder(place: str, camera: str | None) -> View:
    """The view in a folder: depth.png or depth.npy, rgb.png or rgb.jpg, camera.json."""
    depth, rgb = _only(place, "depth", ("depth",)), _only(place, "colour", ("rgb", "color", "colour"))
    if depth is None:
        raise FormatError(file_name(place), "has no depth picture; name it depth.png (16-bit) or depth.npy (metres)")
    own = os.path.join(place, CAMERA)
    if not os.path.exists(own) and camera is None:
        raise FormatError(file_name(place), f"has no {CAMERA}; add it, or name one with --camera")
    return load_view(depth, rgb, own if os.path.exists(own) else str(camera))


def _only(place: str, what: str, stems: Sequence[str]) -> str | None:
    """The one picture in a folder with one of these names, or None."""
    pictures = [name for name in sorted(os.listdir(place)) if suffix(name) in PICTURES]
    files = [name for name in pictures if Path(name).stem.lower() in stems]
    if len(files) > 1:
        raise FormatError(file_name(place), f"has several {what} pictures: {', '.join(files)}; keep one")
    return os.path.join(place, files[0]) if files else None


def _archive(place: str, camera: str | None) -> View:
    """The view in an NPZ file: depth, intrinsics, pose, and perhaps rgb and depth_scale."""
    examine(place)
    file = file_name(place)
    try:
        with open(place, "rb") as stream, np.load(stream, allow_pickle=False) as opened:
            held = {key: opened[key] for key in opened.files}
    except (OSError, ValueError, EOFError, KeyError, BadZipFile) as error:
        raise FormatError(file, f"cannot be read as NPZ: {str(error).splitlines()[0]}") from None
    if "depth" not in held:
        raise FormatError(file, f"holds no depth, only {', '.join(sorted(held)) or 'nothing'}")
    if camera is not None and "pose" not in held:
        return _view(held["depth"], held.get("rgb"), load_camera(camera), place, place, camera)
    keys = ("intrinsics", "pose", "depth_scale")
    own = camera_from({key: held[key].tolist() for key in keys if key in held}, file)
    return _view(held["depth"], held.get("rgb"), own, place, place, place)


def _loose(pictures: Sequence[str], camera: str | None) -> View:
    for path in pictures:
        examine(path)
    if camera is None:
        raise FormatError(file_name(pictures[0]), "needs its camera; name it: --camera camera.json")
    if len(pictures) > 2:
        raise FormatError(file_name(pictures[2]), "is a third picture; give one depth and one colour picture a view")
    read = {path: _read(path) for path in pictures}
    kinds = {path: _kind_of(one) for path, one in read.items()}
    if sorted(kinds.values()) not in (["depth"], ["colour", "depth"]):
        seen = ", ".join(f"{file_name(path)} is {_described(one)}" for path, one in read.items())
        raise FormatError(file_name(pictures[0]), f"one depth picture (16-bit or NPY) is needed; {seen}")
    depth, *rgb = sorted(kinds, key=lambda path: kinds[path] != "depth")
    colour = read[rgb[0]] if rgb else None
    return _view(read[depth], colour, load_camera(camera), depth, rgb[0] if rgb else depth, camera)


def _kind_of(picture: Array) -> str:
    if picture.ndim not in (2, 3):
        return ""
    return "colour" if picture.ndim == 3 else "depth" if picture.dtype != np.uint8 else "8-bit grey"


def _described(picture: Array) -> str:
    kind = _kind_of(picture)
    return f"{kind} of {picture.shape[1]}x{picture.shape[0]} pixels" if kind else "no picture"


def _read(path: str) -> Any:
    """A picture as an array: (H, W) for depth, (H, W, 3) uint8 for colours."""
    examine(path)
    file = file_name(path)
    if suffix(path) == ".npy":
        try:
            array = np.load(path, allow_pickle=False)
        except (OSError, ValueError, EOFError) as error:
            raise FormatError(file, f"cannot be read as NPY: {str(error).splitlines()[0]}") from None
        if array.dtype.kind not in "fiu":
            raise FormatError(file, f"holds {array.dtype}, not numbers")
        return array
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise FormatError(file, f"cannot be read: {error.strerror}") from None
    picture = decode_picture(content, file)
    grey = picture.mode.startswith("I") or picture.mode in ("F", "L")
    return np.asarray(picture if grey else picture.convert("RGB"))


def gathered(places: Sequence[str], *, camera: str | None = None, choices: RecordingChoices | None = None) -> Recorded:
    """Everything there is to look at in files, folders, recordings and live topics.

    Args:
        places: What `views_from` takes; a bag; a point cloud; an address such as ros2:/camera/depth/image_raw.
        camera: The camera's file of pictures that are named one by one.
        choices: What recordings leave open.

    Raises:
        FormatError: If a file cannot be read or does not go with the others.
        RequestError: If there are pictures and point clouds at once, or choices that nothing here leaves open.
        LinkError: If nobody publishes on a live topic.
        MissingExtra: If a package is not installed.
    """
    choices = choices or RecordingChoices()
    recordings, clouds, pictures = (
        [p for p in places if _kind(p) == kind] for kind in ("recording", "cloud", "picture")
    )
    recorded = [(read_live if is_address(place) else read_recording)(place, choices) for place in recordings]
    read = tuple(map(load_cloud, clouds))
    if choices.options and not recorded:
        raise RequestError(f"{listed(choices.options)}: for a bag or a live camera; there is none among the pictures")
    if camera is not None and not pictures:
        raise RequestError("--camera goes with pictures; a recording holds its own, and --pose says where it stood")
    parts = [Recorded(views_from(pictures, camera), read), *recorded]
    found = Recorded(*(tuple(chain.from_iterable(getattr(p, item.name) for p in parts)) for item in fields(Recorded)))
    if found.views and found.clouds:
        raise RequestError("pictures and point clouds cannot be looked at together; make a scene of one, --update it")
    return replace(found, notes=tuple(dict.fromkeys(found.notes)))


def is_view(path: str) -> bool:
    """Whether a file or folder is something to look at: a folder with a camera.json, a view in one file, or a bag."""
    return os.path.isfile(os.path.join(path, CAMERA)) or suffix(path) == ".npz" or is_bag(path) or _is_cloud(path)


def _kind(place: str) -> str:
    if is_address(place) or is_bag(place):
        return "recording"
    return "cloud" if _is_cloud(place) else "picture"


def _is_cloud(place: str) -> bool:
    """Whether a place is the file of a point cloud; of NPY files, those with rows of three or six numbers."""
    if is_address(place) or suffix(place) not in CLOUDS:
        return False
    if suffix(place) != ".npy":
        return True
    examine(place)
    try:
        shape = np.load(place, mmap_mode="r", allow_pickle=False).shape
    except (ValueError, OSError, EOFError):
        raise FormatError(file_name(place), "this is no NPY file of numbers, or it is cut off") from None
    return len(shape) == 2 and shape[1] in (3, 6)
