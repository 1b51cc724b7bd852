"""Doubts: evidence that a picture, its camera or its unit is not what it is said to be.

Each is one sentence with what was seen and what may be wrong; nothing is corrected, since a strange scene may be true.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import ndimage

from ovita.paths.scene import SceneObject
from ovita.paths.trajectory import Array
from ovita.perceive.segment import Plane, Segments, support_of
from ovita.perceive.view import View
from ovita.text import length, number

NEAR, FAR = 0.15, 7.0
"""Median depth that no usual camera measures below, and none measures well beyond [m]."""

ASTRAY = 30.0
"""A camera that stands farther from the world's zero may have its pose in millimetres [m]."""

LEANING = 3.0
"""Angle from which a support that ought to be level is doubted [degrees]."""

OFF, ON = 0.5, 0.05
"""A support farther from height 0 than the first is doubted where another unit puts it nearer than the second [m]."""

SMALL, LARGE = 0.012, 3.0
"""Longest edges beyond which a thing is not believed [m]."""

STEP = 0.04
"""Step of depth between neighbouring pixels that shows in the colours, as a share of the depth."""

FEWEST = 0.25
"""Such steps that are needed to compare depth and colours, as a share of the picture's rows and columns."""

MATCHING = 1.4
"""Contrast of the colours at steps of the depth, relative to that a little beside them, below which the two do not
match: it was 1.7 to 12 for 80 pairs of pictures of one view, and below 1.6 for 95 % of those of different views."""


def doubts(views: Sequence[View], parts: Sequence[Segments], up: Array, *, level: bool) -> list[str]:
    """What is strange about pictures and cameras, each a sentence.

    `parts` are what each view was taken apart into, `up` is a unit vector (3,) in the world, and `level` whether a
    level support was looked for.
    """
    said: list[str] = []
    for view, part in zip(views, parts, strict=True):
        said += [*_range(view), *_place(view), *_colours(view, part)]
        if level:
            said += list(_other_poses(view, part.support, up)) or list(_standing(view, part.support, up))
        if not level and part.support is not None and part.footing is None:
            said.append(f"{view.name} shows nothing at the height that was given for the support")
    return said


def strange_sizes(things: Sequence[SceneObject]) -> list[str]:
    """Things that are too large or too small to be believed, in a sentence each."""
    said = []
    for item in things:
        longest = float(item.size.max())
        if not SMALL <= longest <= LARGE:
            said.append(f"{item.name} is {length(longest)} long; is the unit of the depth right (depth_scale)?")
    return said


def _range(view: View) -> Iterator[str]:
    median = float(np.nanmedian(view.depth))
    if not NEAR <= median <= FAR:
        what = "nearer than usual cameras measure" if median < NEAR else "farther than usual cameras measure well"
        yield f"{view.name} has a median depth of {length(median)}, {what}; is its unit right (depth_scale)?"


def _place(view: View) -> Iterator[str]:
    away = float(np.linalg.norm(view.center))
    if away > max(ASTRAY, 20.0 * float(np.nanmedian(view.depth))):
        yield (
            f"the camera of {view.name} stands {number(away)} m from the world's zero; is its pose in millimetres?"
            " It must be in metres"
        )


def _standing(view: View, support: Plane | None, up: Array) -> Iterator[str]:
    """A support that leans, that the camera is beneath, or that another unit would put at height 0."""
    if support is None:
        return
    above, lean = _above(view, support), _lean(support, up)
    if above <= 0.0:
        yield f"the camera of {view.name} would be {length(-above)} below the support that it sees; is its pose right?"
    elif lean > LEANING:
        yield (
            f"the support in {view.name} leans by {lean:.1f} degrees; if it is level, the camera's pose is off by that"
        )
    height = support.offset / float(support.normal @ up)
    if abs(height) <= OFF:
        return
    for factor in (0.001, 0.01, 0.1, 10.0, 100.0, 1000.0):
        if abs(height + (1.0 - factor) * above) < ON:
            yield (
                f"the support in {view.name} is at height {number(height)} m, and would be at 0 if the depth were"
                f" {factor:g} times as large; is its unit right (depth_scale)?"
            )


def _above(view: View, support: Plane) -> float:
    return float(support.heights(view.center))


def _lean(support: Plane, up: Array) -> float:
    return float(np.degrees(np.arccos(np.clip(support.normal @ up, -1.0, 1.0))))


def _other_poses(view: View, support: Plane | None, up: Array) -> Iterator[str]:
    """Another reading of the camera's pose, where only that has a level support beneath the camera."""
    if support is not None and _lean(support, up) <= LEANING and _above(view, support) > 0.0:
        return
    if np.array_equal(view.pose, np.eye(4)):
        yield f"the pose of {view.name} is the identity, so the camera's line of sight counts as up; give its true pose"
        return
    gl = np.diag([1.0, -1.0, -1.0, 1.0])
    inverse: Array = np.asarray(np.linalg.inv(view.pose), dtype=np.float64)
    readings: dict[str, Array] = {
        'was inverted; "pose" is camera to world': inverse,
        'had "axes": "opengl"': view.pose @ gl,
        'was inverted and had "axes": "opengl"': inverse @ gl,
        "were in a world whose z axis points the other way (--frame)": gl @ view.pose,
    }
    least = _share(view, view.pose, support) if support is not None and _above(view, support) > 0.0 else 0.0
    shares = {words: _level_share(view, pose, up) for words, pose in readings.items()}
    most = max(shares.values())
    if most > max(0.15, 1.2 * least):
        fitting = ", or ".join(words for words, share in shares.items() if share > 0.95 * most)
        yield f"the pose of {view.name} shows no level support, but would if it {fitting}"


def _level_share(view: View, pose: Array, up: Array) -> float:
    """Share of the pixels on a level support beneath the camera, if it had this pose (4, 4); 0 without one."""
    points = _some_points(view, pose)
    plane = support_of(points, np.full(len(points), 0.003), up)
    if plane is None or plane.heights(pose[:3, 3]) <= 0.0 or _lean(plane, up) > LEANING:
        return 0.0
    return _share(view, pose, plane)


def _share(view: View, pose: Array, plane: Plane) -> float:
    return float((np.abs(plane.heights(_some_points(view, pose))) < 0.01).mean())


def _some_points(view: View, pose: Array) -> Array:
    """Every fourth pixel along both sides, in the world of a pose, (N, 3) [m]."""
    local = (view.points[::4, ::4].reshape(-1, 3) - view.center) @ view.pose[:3, :3]
    return np.asarray(local[np.isfinite(local[:, 0])] @ pose[:3, :3].T + pose[:3, 3])


def _colours(view: View, part: Segments) -> Iterator[str]:
    """Colours whose edges are not where those of the depth are."""
    if view.rgb is None:
        return
    grey, depth = view.rgb[::2, ::2].astype(np.float32).sum(axis=2), part.depth[::2, ::2]
    steps = np.zeros(depth.shape, dtype=bool)
    with np.errstate(invalid="ignore"):
        steps[:-1] |= np.abs(np.diff(depth, axis=0)) > STEP * depth[1:]
        steps[:, :-1] |= np.abs(np.diff(depth, axis=1)) > STEP * depth[:, 1:]
    if steps.sum() < FEWEST * sum(steps.shape):
        return
    slope = np.abs(ndimage.sobel(grey, 0)) + np.abs(ndimage.sobel(grey, 1))
    contrast = ndimage.maximum_filter(slope, 3)
    away = max(depth.shape[1] // 27, 4)
    beside = np.mean([contrast[np.roll(steps, s, axis)].mean() for s in (away, -away) for axis in (0, 1)])
    if contrast[steps].mean() < MATCHING * max(float(beside), 1.0):
        yield (
            f"the colours of {view.name} have no edges where its depth has steps; are they of the same moment and view,"
            " and registered?"
        )
