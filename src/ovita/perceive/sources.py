"""Where pictures come from: files and folders of views, recordings, live topics and point clouds, told apart."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np

from ovita.errors import FormatError, RequestError
from ovita.io.clouds import CLOUDS, load_cloud
from ovita.io.files import examine, file_name, is_address, is_bag, suffix
from ovita.perceive.pictures import CAMERA, views_from
from ovita.perceive.recordings import Recorded, RecordingChoices, read_live, read_recording
from ovita.text import listed


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
    kinds: dict[str, list[str]] = {"recording": [], "cloud": [], "picture": []}
    for place in places:
        kinds[_kind(place)].append(place)
    recorded = [(read_live if is_address(place) else read_recording)(place, choices) for place in kinds["recording"]]
    clouds = [load_cloud(place) for place in kinds["cloud"]]
    if choices.options and not recorded:
        raise RequestError(f"{listed(choices.options)}: for a bag or a live camera; there is none among the pictures")
    if camera is not None and not kinds["picture"]:
        raise RequestError("--camera goes with pictures; a recording holds its own, and --pose says where it stood")
    views = [*views_from(kinds["picture"], camera), *(view for one in recorded for view in one.views)]
    clouds += [cloud for one in recorded for cloud in one.clouds]
    if views and clouds:
        raise RequestError("pictures and point clouds cannot be looked at together; make a scene of one, --update it")
    return Recorded(tuple(views), tuple(clouds), tuple(dict.fromkeys(n for one in recorded for n in one.notes)))


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
