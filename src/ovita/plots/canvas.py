"""The two matplotlib views of a scene, from above and in 3-D, with the same drawing operations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from ovita.errors import MissingExtra
from ovita.paths.frame import Frame
from ovita.paths.robot import Box, Shell
from ovita.paths.trajectory import Array
from ovita.plots import geometry
from ovita.plots.geometry import FACES, Extent, axis_of, axis_word, workspace_lines

try:
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]
except ImportError:
    raise MissingExtra("matplotlib", "plot") from None


_HEAD = np.array([[1.0, 0.0], [-0.8, 0.6], [-0.4, 0.0], [-0.8, -0.6]])
"""Outline of an arrow head that points to the right."""


class Canvas(Protocol):
    """What can be drawn; points are (K, 3) [m] in the world frame, labels feed the legend."""

    handles: dict[str, Line2D]

    def line(self, points: Array, *, label: str = "", cap: str = "round", **style: Any) -> None:
        """Draw a line."""

    def points(self, points: Array, *, marker: str, s: float, color: str, label: str = "") -> None:
        """Draw markers."""

    def arrows(self, points: Array, directions: Array, color: str) -> None:
        """Draw arrow heads at points, along unit directions (both (K, 3))."""

    def cuboid(self, corners: Array, color: str) -> None:
        """Draw a cuboid (8, 3)."""

    def workspace_lines(self, workspace: Box | Shell) -> list[Array]:
        """The lines of a workspace that can be seen."""

    def labels(self, texts: Sequence[str], colors: Sequence[str], boxes: Sequence[Array], busy: Array) -> None:
        """Write names beside cuboids, clear of each other and of the points `busy`."""


class _Canvas:
    def __init__(self, figure: Figure, shown: Extent, frame: Frame) -> None:
        self.figure, self.shown, self.frame = figure, shown, frame
        self.handles: dict[str, Line2D] = {}

    def _remember(self, label: str, **style: Any) -> None:
        if label:
            self.handles[label] = Line2D([], [], **{**style, "lw": min(style.get("lw", 1.0), 6.0)})

    def pixels(self, points: Array) -> Array:
        """Image coordinates (K, 2) of points (K, 3) [m]."""
        raise NotImplementedError

    def _scatter(self, points: Array, **style: Any) -> None:
        raise NotImplementedError

    def points(self, points: Array, *, marker: str, s: float, color: str, label: str = "") -> None:
        """Draw markers."""
        self._scatter(points, s=s, marker=marker, c=color, ec="white", lw=0.8, zorder=5)
        self._remember(label, marker=marker, color=color, ls="", ms=s**0.5)

    def arrows(self, points: Array, directions: Array, color: str) -> None:
        """Draw arrow heads at points, along unit directions."""
        if not len(points):
            return
        self.figure.draw_without_rendering()
        step = 1e-3 * float(self.shown.size.max())
        across, along = (self.pixels(points + step * directions) - self.pixels(points)).T
        for point, angle in zip(points, np.arctan2(along, across), strict=True):
            turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
            self._scatter(point[None], s=190, marker=_HEAD @ turn, c=color, ec="white", lw=0.6, zorder=4)

    def _label(self, texts: Sequence[str], colors: Sequence[str], pixels: list[Array], busy: Array, area: Any) -> None:
        """Write texts beside boxes of projected corners (8, 2), all in pixels."""
        width, height = self.figure.bbox.width, self.figure.bbox.height
        written = [
            self.figure.text(
                0.5,
                0.5,
                text,
                fontsize=9.5,
                ha="center",
                va="center",
                color="#222222",
                parse_math=False,
                bbox={"boxstyle": "round,pad=0.15", "fc": "white", "ec": color, "lw": 0.8, "alpha": 0.85},
            )
            for text, color in zip(texts, colors, strict=True)
        ]
        scale = self.figure.dpi / 72.0
        sizes = []
        for text in written:
            box = text.get_window_extent()
            sizes.append((box.width + 4.0 * scale, box.height + 3.0 * scale))
        boxes = [(p.min(axis=0), p.max(axis=0)) for p in pixels]
        for text, spot, corner, color in zip(
            written, geometry.place_labels(boxes, sizes, busy, area, scale=scale), boxes, colors, strict=True
        ):
            text.set_position((spot.middle[0] / width, spot.middle[1] / height))
            if spot.joined:
                middle = (corner[0] + corner[1]) / 2.0
                x, y = [spot.middle[0] / width, middle[0] / width], [spot.middle[1] / height, middle[1] / height]
                self.figure.add_artist(Line2D(x, y, color=color, lw=0.9, zorder=0.5))


class TopCanvas(_Canvas):
    """Top view of the scene, right to the right and front up, for any frame."""

    def __init__(self, figure: Figure, shown: Extent, frame: Frame) -> None:
        super().__init__(figure, shown, frame)
        self.axes = figure.add_axes((0.075, 0.37, 0.905, 0.535))
        (self.across, right), (self.along, front) = axis_of(frame, "right"), axis_of(frame, "front")
        middle, size = (shown.lower + shown.upper) / 2.0, shown.size
        box = self.axes.get_window_extent()
        metres = max(size[self.across] / box.width, size[self.along] / box.height)  # one pixel, the same both ways
        for setter, axis, sign, length in (
            (self.axes.set_xlim, self.across, right, box.width),
            (self.axes.set_ylim, self.along, front, box.height),
        ):
            half = sign * metres * length / 2.0
            setter(middle[axis] - half, middle[axis] + half)
        self.axes.set_aspect("equal", adjustable="box")
        self.axes.set_xlabel(f"{'xyz'[self.across]} [m] ({axis_word(frame, self.across)})")
        self.axes.set_ylabel(f"{'xyz'[self.along]} [m] ({axis_word(frame, self.along)})")
        self.axes.grid(alpha=0.25)
        self.axes.set_axisbelow(True)

    def _flat(self, points: Array) -> Array:
        return points[:, [self.across, self.along]]

    def line(self, points: Array, *, label: str = "", cap: str = "round", **style: Any) -> None:
        """Draw a line."""
        flat = self._flat(points)
        self.axes.plot(flat[:, 0], flat[:, 1], solid_capstyle=cap, **style)
        self._remember(label, **style)

    def pixels(self, points: Array) -> Array:
        """Image coordinates (K, 2) of points (K, 3) [m]."""
        return np.asarray(self.axes.transData.transform(self._flat(points)))

    def _scatter(self, points: Array, **style: Any) -> None:
        self.axes.scatter(*self._flat(points).T, **style)

    def cuboid(self, corners: Array, color: str) -> None:
        """Draw a cuboid (8, 3) as its outline from above."""
        faces = [self._flat(corners[face]) for face in FACES]
        self.axes.add_collection(PolyCollection(faces, facecolors=color, edgecolors=color, alpha=0.22, lw=1.0))

    def workspace_lines(self, workspace: Box | Shell) -> list[Array]:
        """The lines of a workspace that can be seen."""
        self.figure.draw_without_rendering()
        lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
        for axis, (low, high) in ((self.across, self.axes.get_xlim()), (self.along, self.axes.get_ylim())):
            lower[axis], upper[axis] = min(low, high), max(low, high)
        return workspace_lines(workspace, lower, upper)

    def labels(self, texts: Sequence[str], colors: Sequence[str], boxes: Sequence[Array], busy: Array) -> None:
        """Write names beside cuboids, clear of each other and of the points `busy`."""
        self.figure.draw_without_rendering()
        window = self.axes.get_window_extent()
        area = np.array([window.x0, window.y0]), np.array([window.x1, window.y1])
        self._label(texts, colors, [self.pixels(box) for box in boxes], self.pixels(busy), area)


class SpaceCanvas(_Canvas):
    """3-D view of the scene from behind, right and above, for any frame."""

    def __init__(self, figure: Figure, shown: Extent, frame: Frame) -> None:
        super().__init__(figure, shown, frame)
        axes: Any = figure.add_axes((0.02, 0.325, 0.96, 0.605), projection="3d")
        self.axes = axes
        down = frame.direction("up")[2] < 0
        for axis, name in enumerate("xyz"):
            limits = (shown.lower[axis], shown.upper[axis])
            # turned upside down about x, so that it stays right-handed with z pointing down
            getattr(axes, f"set_{name}lim")(*(limits[::-1] if down and axis > 0 else limits))
            getattr(axes, f"set_{name}label")(f"{name} [m] ({axis_word(frame, axis)})", labelpad=8)
            getattr(axes, f"{name}axis").set_major_locator(MaxNLocator(5, prune="both"))
            getattr(axes, f"{name}axis").set_pane_color((0.97, 0.97, 0.97, 1.0))
        axes.tick_params(labelsize=8.5, pad=2)
        axes.set_box_aspect(shown.size / shown.size.max(), zoom=0.98)
        axes.view_init(elev=24, azim=-60 if axis_of(frame, "front")[0] == 1 else 210)
        axes.computed_zorder = False

    def line(self, points: Array, *, label: str = "", cap: str = "round", **style: Any) -> None:
        """Draw a line."""
        self.axes.plot(*points.T, solid_capstyle=cap, zorder=3, **style)
        self._remember(label, **style)

    def pixels(self, points: Array) -> Array:
        """Image coordinates (K, 2) of points (K, 3) [m]; valid once the figure was laid out."""
        seen = np.column_stack([points, np.ones(len(points))]) @ self.axes.get_proj().T
        return np.asarray(self.axes.transData.transform(seen[:, :2] / seen[:, 3:]))

    def _scatter(self, points: Array, **style: Any) -> None:
        self.axes.scatter(*points.T, depthshade=False, **style)

    def cuboid(self, corners: Array, color: str) -> None:
        """Draw a cuboid (8, 3)."""
        faces = [corners[face] for face in FACES]
        self.axes.add_collection3d(
            Poly3DCollection(faces, facecolors=color, edgecolors=color, alpha=0.28, lw=0.8, zorder=2)
        )

    def workspace_lines(self, workspace: Box | Shell) -> list[Array]:
        """The lines of a workspace that can be seen."""
        return workspace_lines(workspace, self.shown.lower, self.shown.upper)

    def labels(self, texts: Sequence[str], colors: Sequence[str], boxes: Sequence[Array], busy: Array) -> None:
        """Write names beside cuboids, clear of each other and of the points `busy`."""
        self.figure.draw_without_rendering()
        window = self.axes.get_window_extent()
        margin = 0.03 * window.width
        area = (
            np.array([window.x0 + margin, window.y0]),
            np.array([window.x1 - margin, window.y1 - 0.06 * window.height]),
        )
        self._label(texts, colors, [self.pixels(box) for box in boxes], self.pixels(busy), area)
