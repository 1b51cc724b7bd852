"""A view: what one RGB-D camera saw from where it stood, and the geometry of its pixels."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.errors import SceneError
from ovita.paths.trajectory import Array

Mask = NDArray[np.bool_]
Picture = NDArray[np.uint8]

FARTHEST = 50.0
"""Median depth from which a picture is taken to be in millimetres [m]."""

NEAREST = 0.03
"""Median depth below which a picture is taken to be in another unit than metres [m]."""

SMALLEST = 16
"""Fewest pixels that a picture may have along either side."""


@dataclass(frozen=True, eq=False)
class View:
    """A depth picture, perhaps with colours, and the camera that took it.

    The camera's axes are those of OpenCV: x to the right, y down, z forward. Pixel (0, 0) is centred on the corner that
    the principal point is counted from.

    Args:
        depth: Distance along the camera's z axis (H, W) [m]; nan, 0 and infinity mean that there is none.
        intrinsics: Camera matrix (3, 3) [pixels].
        pose: Camera to world (4, 4), a rigid transform [m].
        rgb: Colours (H, W, 3), registered to the depth, or None.

    Raises:
        SceneError: On shapes that do not fit, a camera that cannot be, or depth that is empty or in another unit.
    """

    depth: Array
    intrinsics: Array
    pose: Array = field(default_factory=lambda: np.eye(4))
    rgb: Picture | None = None
    name: str = "the view"

    def __post_init__(self) -> None:
        for key, value in (
            ("depth", _depth(self.depth)),
            ("intrinsics", _numbers("intrinsics", self.intrinsics, (3, 3))),
            ("pose", _rigid(_numbers("pose", self.pose, (4, 4)))),
        ):
            value.flags.writeable = False
            object.__setattr__(self, key, value)
        _check_camera(self.intrinsics, self.depth.shape)
        if self.rgb is not None:
            object.__setattr__(self, "rgb", _colours(self.rgb, self.depth.shape))

    @property
    def center(self) -> Array:
        """Where the camera stands, (3,) [m] in the world."""
        return self.pose[:3, 3]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.depth.shape[0], self.depth.shape[1]

    @property
    def focal(self) -> float:
        """Mean focal length [pixels]; an object at z metres has pixels of z / focal metres."""
        return float(0.5 * (self.intrinsics[0, 0] + self.intrinsics[1, 1]))

    @cached_property
    def seen(self) -> Mask:
        """Which pixels have depth, (H, W)."""
        return np.isfinite(self.depth)

    @cached_property
    def frame(self) -> Mask:
        """Which pixels lie in the rectangle around those with depth (H, W): what it cuts may go on beyond it."""
        rows, columns = (np.flatnonzero(self.seen.any(axis=axis)) for axis in (1, 0))
        inside = np.zeros(self.shape, dtype=bool)
        inside[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] = True
        return inside

    def along(self, direction: Array) -> Array:
        """How far each pixel's line of sight goes in a direction (3,) of the world, per metre of depth (H, W)."""
        column, row, one = self.pose[:3, :3].T @ direction @ np.linalg.inv(self.intrinsics)
        return np.asarray(row * np.arange(self.shape[0])[:, None] + (column * np.arange(self.shape[1]) + one))

    def located(self, rows: Any, columns: Any, depth: Array) -> Array:
        """Where pixels of a depth hit something, in the world (..., 3) [m]; nan without depth.

        Rows, columns and depth [m] are broadcast to one shape.
        """
        x, y, z = (np.linalg.inv(self.intrinsics).T @ self.pose[:3, :3].T)[:, None]
        rays = np.asarray(rows)[..., None] * y + (np.asarray(columns)[..., None] * x + z)
        return np.asarray(rays * depth[..., None] + self.center)

    @cached_property
    def points(self) -> Array:
        """Where each pixel hits something, in the world (H, W, 3) [m]; nan without depth."""
        return self.located(np.arange(self.shape[0])[:, None], np.arange(self.shape[1]), self.depth)

    def project(self, points: Array) -> Array:
        """Pixels (N, 2) as column and row of points (N, 3) [m] in the world; nan behind the camera."""
        local = (points - self.center) @ self.pose[:3, :3]
        ahead = np.where(local[:, 2:] > 1e-6, local[:, 2:], np.nan)
        return np.asarray((local @ self.intrinsics.T)[:, :2] / ahead)


def landing(pixels: Array, shape: tuple[int, int]) -> tuple[Mask, NDArray[np.intp], NDArray[np.intp]]:
    """Which pixels (..., 2), as column and row, lie in a picture, and the row and column of each; 0, 0 for others."""
    known = np.asarray(np.isfinite(pixels).all(axis=-1))
    columns, rows = np.moveaxis(np.round(np.where(known[..., None], pixels, -1.0)).astype(np.intp), -1, 0)
    known &= (rows >= 0) & (rows < shape[0]) & (columns >= 0) & (columns < shape[1])
    return known, np.where(known, rows, 0), np.where(known, columns, 0)


def _numbers(key: str, value: Any, shape: tuple[int, ...]) -> Array:
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.shape != shape or not np.isfinite(array).all():
        rows, columns = shape
        raise SceneError(f"must be a {rows}x{columns} matrix of finite numbers", key=key)
    return array


def _depth(value: Any) -> Array:
    array = np.array(value, dtype=np.float64) if np.ndim(value) == 2 else np.zeros(0)
    if array.ndim != 2 or min(array.shape) < SMALLEST:
        shape = "x".join(map(str, np.shape(value)))
        raise SceneError(f"is {shape}, expected rows x columns of at least {SMALLEST} pixels", key="depth")
    array[~(np.isfinite(array) & (array > 0.0))] = np.nan
    if np.isnan(array).all():
        raise SceneError("holds no distance at all; was the depth stream switched on?", key="depth")
    median = float(np.nanmedian(array))
    if median > FARTHEST:
        hint = "that looks like millimetres; divide by 1000, or give depth_scale 0.001 with the camera"
        raise SceneError(f"has a median of {median:.0f} m; {hint}", key="depth")
    if median < NEAREST:
        raise SceneError(f"has a median of {median:.2g} m; give its unit as depth_scale with the camera", key="depth")
    return array


def _rigid(pose: Array) -> Array:
    turn = pose[:3, :3]
    if not np.allclose(pose[3], (0.0, 0.0, 0.0, 1.0), atol=1e-6):
        raise SceneError("must end in the row 0, 0, 0, 1; is it transposed?", key="pose")
    if not np.allclose(turn @ turn.T, np.eye(3), atol=2e-3):
        raise SceneError("is not rigid: its rotation stretches or skews; give rotation and position only", key="pose")
    if np.linalg.det(turn) < 0:
        raise SceneError("mirrors: the camera's axes must be x right, y down, z forward", key="pose")
    left, _, right = np.linalg.svd(turn)
    rigid = pose.copy()
    rigid[:3, :3] = left @ right
    return rigid


def _check_camera(intrinsics: Array, shape: tuple[int, ...]) -> None:
    fx, fy, cx, cy = intrinsics[0, 0], intrinsics[1, 1], intrinsics[0, 2], intrinsics[1, 2]
    if fx <= 0 or fy <= 0:
        raise SceneError(f"have focal lengths of {fx:g} and {fy:g}, which must be positive", key="intrinsics")
    if not np.allclose(intrinsics[2], (0.0, 0.0, 1.0)) or abs(intrinsics[1, 0]) > 1e-9:
        raise SceneError("must be [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]; is it transposed?", key="intrinsics")
    rows, columns = shape
    if not (0 <= cx <= columns and 0 <= cy <= rows):
        where = f"have a principal point ({cx:g}, {cy:g}) outside of the {columns}x{rows} picture"
        raise SceneError(f"{where}; are they of another resolution?", key="intrinsics")


def _colours(value: Any, shape: tuple[int, ...]) -> Picture:
    array = np.asarray(value)
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype != np.uint8:
        raise SceneError(f"is {array.dtype} of shape {array.shape}, expected 8-bit red, green, blue", key="rgb")
    if array.shape[:2] != shape:
        (rows, columns), (high, wide) = array.shape[:2], shape
        what = f"is {columns}x{rows} pixels and the depth {wide}x{high}"
        raise SceneError(f"{what}; register the depth to the colours first", key="rgb")
    kept = array.copy()
    kept.flags.writeable = False
    return kept
