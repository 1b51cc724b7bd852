"""Figures for print and for a first look, from above or in 3-D, drawn with matplotlib without pyplot."""

from __future__ import annotations

import io
import os
import textwrap
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from itertools import cycle, islice
from types import MappingProxyType
from typing import Any

import numpy as np

from ovita.errors import FormatError, needs
from ovita.io import atomic_write
from ovita.limits import ConstraintCheck
from ovita.measure import compare
from ovita.paths.robot import Box, Robot, Shell
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots import geometry
from ovita.plots.geometry import COLOURS, FACES, OBJECT_COLOURS, Extent, View, axis_of, axis_word, workspace_lines

with needs("matplotlib", "plot"):
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import PolyCollection
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties, findfont, get_font
    from matplotlib.lines import Line2D
    from matplotlib.ticker import MaxNLocator
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # type: ignore[import-untyped]

_SUFFIXES = (".png", ".svg", ".pdf")
_SIZE = (10.0, 9.0)


def figure(
    original: Trajectory,
    adapted: Trajectory,
    scene: Scene,
    *,
    robot: Robot | None = None,
    proposed: Trajectory | None = None,
    title: str = "",
    violations: Sequence[ConstraintCheck] | None = None,
    view: View = "auto",
    tube: Array | None = None,
) -> Figure:
    """Draw a trajectory before and after in its scene, with its speeds over time and over the distance below.

    Args:
        original: Before (blue).
        adapted: After (red).
        scene: Objects are drawn as cuboids with their names, the frame names the axes.
        robot: Whose workspace to outline, where it lies in the picture.
        proposed: The policy's proposal before the limits were enforced (grey, dotted).
        title: Written above, such as the instruction.
        violations: Limits that do not hold are marked where the adapted trajectory breaks them most.
        view: "3d", "top" (from above), or "auto": from above if the paths lie in one horizontal plane.
        tube: Covariance of the adapted positions, rows xx, xy, xz, yy, yz, zz (N, 6) [m2], drawn to two standard
            deviations; None for none.

    Raises:
        MissingExtra: If matplotlib is not installed.
    """
    drawing = Figure(figsize=_SIZE, facecolor="white")
    FigureCanvasAgg(drawing)
    paths = [original, adapted, *([] if proposed is None else [proposed])]
    shown = geometry.extent(paths, scene)
    flat = view == "top" or (view == "auto" and geometry.planar(paths))
    canvas: Canvas = TopCanvas(drawing, shown, scene.frame) if flat else SpaceCanvas(drawing, shown, scene.frame)
    drawn = _workspace(canvas, robot, shown)
    least = 0.012 * float(shown.size.max())
    colours = list(islice(cycle(OBJECT_COLOURS), len(shown.shown)))
    boxes = [geometry.corners(item) for item in shown.shown]
    for item, colour in zip(shown.shown, colours, strict=True):
        canvas.cuboid(geometry.corners(item, least), colour)
    if tube is not None:
        canvas.tube(geometry.walls(geometry.tube(adapted.positions, tube)))
    _paths(canvas, original, adapted, proposed, scene)
    _broken(canvas, adapted, violations or ())
    canvas.labels([printable(_short(item.name)) for item in shown.shown], colours, boxes, geometry.busy(paths))
    _speeds(drawing, original, adapted, proposed, robot)
    _captions(drawing, canvas, title, _remarks(robot, drawn, shown))
    return drawing


def save(path: str | os.PathLike[str], drawing: Figure) -> None:
    """Write a figure to a .png, .svg or .pdf file in one step.

    Raises:
        FormatError: On any other suffix, or if the file cannot be written.
    """
    suffix = os.path.splitext(os.fspath(path))[1].lower()
    if suffix not in _SUFFIXES:
        raise FormatError(os.fspath(path), f"figures are written as {', '.join(_SUFFIXES)}; choose one of these")
    stream = io.BytesIO()
    undated: dict[str, dict[str, Any]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
    drawing.savefig(stream, format=suffix[1:], dpi=150, metadata=undated.get(suffix))
    atomic_write(path, stream.getvalue())


def _workspace(canvas: Canvas, robot: Robot | None, shown: Extent) -> bool:
    if robot is None or robot.workspace is None:
        return False
    lines = canvas.workspace_lines(robot.workspace)
    for line in lines:
        canvas.line(line, color=COLOURS["workspace"], lw=0.8, alpha=0.55, label="workspace")
    return bool(lines)


def _paths(
    canvas: Canvas, original: Trajectory, adapted: Trajectory, proposed: Trajectory | None, scene: Scene
) -> None:
    changes = compare(original, adapted, scene)
    for stretch in [] if changes.speed.everywhere else changes.speed.ranges:
        word = "slower" if stretch.speed.change < 0 else "faster"
        span = slice(max(stretch.first - 1, 0), stretch.last + 2)
        canvas.line(adapted.positions[span], color=COLOURS[word], lw=9, alpha=0.4, label=word, cap="butt")
    dots: dict[str, Any] = {"marker": "o", "ms": 2.5} if len(original) <= 150 else {}
    canvas.line(original.positions, color=COLOURS["before"], lw=3.2, alpha=0.55, label="before", **dots)
    if proposed is not None:
        canvas.line(proposed.positions, color=COLOURS["proposed"], lw=1.5, ls=":", label="proposed (before limits)")
    dots = {"marker": "o", "ms": 2.0} if len(adapted) <= 150 else {}
    canvas.line(adapted.positions, color=COLOURS["after"], lw=1.4, label="after", **dots)
    if not changes.path_unchanged:
        canvas.arrows(*_arrows(original), COLOURS["before"])
    canvas.arrows(*_arrows(adapted), COLOURS["after"])
    for path, share in ((original, 0.5), (adapted, 1.0)):
        names = ("start", "goal") if path is adapted else ("", "")
        canvas.points(path.positions[:1], marker="o", s=80 * share, color=COLOURS["start"], label=names[0])
        canvas.points(path.positions[-1:], marker="*", s=170 * share, color=COLOURS["goal"], label=names[1])
    halts = [stop.first for stop in changes.speed.stopped if stop.seconds > 0 or changes.speed.stops.change > 0]
    if halts:
        canvas.points(adapted.positions[halts], marker="8", s=90, color=COLOURS["after"], label="stop")


def _arrows(path: Trajectory) -> tuple[Array, Array]:
    """Three points spread along a path and the unit directions there; fewer on a path without length."""
    s = path.arc_length
    if s[-1] == 0:
        return np.zeros((0, 3)), np.zeros((0, 3))
    steps = np.diff(path.positions, axis=0)
    moving = np.flatnonzero(np.diff(s) > 0)
    chosen = moving[np.minimum(np.searchsorted(s[moving], np.array([0.25, 0.5, 0.75]) * s[-1]), len(moving) - 1)]
    directions = steps[chosen] / np.linalg.norm(steps[chosen], axis=1, keepdims=True)
    return path.positions[chosen] + steps[chosen] / 2.0, directions


def _broken(canvas: Canvas, adapted: Trajectory, checks: Sequence[ConstraintCheck]) -> None:
    where = sorted({c.where_after for c in checks if not c.held and c.where_after is not None})
    inside = [i for i in where if i < len(adapted)]
    if inside:
        points = adapted.positions[inside]
        canvas.points(points, marker="X", s=110, color=COLOURS["violation"], label="limit broken")


def _speeds(
    drawing: Figure, original: Trajectory, adapted: Trajectory, proposed: Trajectory | None, robot: Robot | None
) -> None:
    highest = max(float(path.speeds.max()) for path in (original, adapted))
    limit = robot.max_speed if robot is not None else None
    for label, quantity, left in (("time [s]", "times", 0.075), ("distance [m]", "arc_length", 0.565)):
        axes = drawing.add_axes((left, 0.065, 0.39, 0.20))
        axes.plot(getattr(original, quantity), original.speeds, color=COLOURS["before"], lw=3.2, alpha=0.55)
        if proposed is not None:
            axes.plot(getattr(proposed, quantity), proposed.speeds, color=COLOURS["proposed"], lw=1.5, ls=":")
        axes.plot(getattr(adapted, quantity), adapted.speeds, color=COLOURS["after"], lw=1.6)
        if limit is not None and limit <= 1.6 * highest:
            axes.axhline(limit, color=COLOURS["workspace"], lw=1.0, ls="--")
            across = axes.get_yaxis_transform()
            axes.text(1.01, limit, "limit", va="center", fontsize=8, color="#5f6b76", transform=across)
            highest = max(highest, limit)
        axes.set_xlabel(label)
        axes.set_ylabel("speed [m/s]")
        axes.set_ylim(*np.array([-0.03, 1.12]) * (highest if highest > 0 else 1.0))
        axes.grid(alpha=0.3)
        axes.spines[["top", "right"]].set_visible(False)


def _remarks(robot: Robot | None, drawn: bool, shown: Extent) -> str:
    told = []
    if robot is not None and robot.workspace is not None and not drawn:
        told.append(f"No border of the workspace ({robot.workspace.describe()}) lies in this picture.")
    if shown.left_out:
        told.append(f"Too far away to be shown: {', '.join(_short(name) for name in shown.left_out)}.")
    return textwrap.shorten(printable(" ".join(told)), 150, placeholder=" ...")


def _captions(drawing: Figure, canvas: Canvas, title: str, remarks: str) -> None:
    top = 0.985
    for line in textwrap.wrap(printable(title), 88, max_lines=2, placeholder=" ..."):
        drawing.text(0.5, top, line, ha="center", va="top", fontsize=12.5, weight="bold", parse_math=False)
        top -= 0.027
    handles: dict[str, Line2D] = canvas.handles
    drawing.legend(
        handles.values(), handles.keys(), loc="upper center", bbox_to_anchor=(0.5, top), ncols=min(len(handles), 9),
        frameon=False, fontsize=9.5, handletextpad=0.5, columnspacing=1.4, markerscale=0.9,
    )  # fmt: skip
    if remarks:
        drawing.text(0.5, 0.3, remarks, ha="center", va="top", fontsize=8.5, color="#5f6b76", parse_math=False)


def _short(name: str) -> str:
    return textwrap.shorten(name, 28, placeholder="...") or name[:25] + "..."


def printable(text: str) -> str:
    """The text without control characters; letters that the font lacks become question marks."""
    known = get_font(findfont(FontProperties())).get_charmap()
    return "".join(" " if c.isspace() or not c.isprintable() else c if ord(c) in known else "?" for c in text)


_HEAD = np.array([[1.0, 0.0], [-0.8, 0.6], [-0.4, 0.0], [-0.8, -0.6]])
"""Outline of an arrow head that points to the right."""


_LABEL: dict[str, Any] = {"fontsize": 9.5, "ha": "center", "va": "center", "color": "#222222", "parse_math": False}
_LABEL_BOX = {"boxstyle": "round,pad=0.15", "fc": "white", "lw": 0.8, "alpha": 0.85}


class Canvas(ABC):
    """What can be drawn on a view of a scene; points are (K, 3) [m] in the world frame, labels feed the legend."""

    axes: Any
    line_style: Mapping[str, Any] = MappingProxyType({})
    marker_style: Mapping[str, Any] = MappingProxyType({})
    inset = 0.0, 0.0
    """What labels leave free of the axes: at either side and at the top, as shares of their width and height."""

    def __init__(self, figure: Figure, shown: Extent, frame: Frame) -> None:
        self.figure, self.shown, self.frame = figure, shown, frame
        self.handles: dict[str, Line2D] = {}

    def _remember(self, label: str, **style: Any) -> None:
        if label:
            self.handles[label] = Line2D([], [], **{**style, "lw": min(style.get("lw", 1.0), 6.0)})

    @abstractmethod
    def cuboid(self, corners: Array, color: str) -> None:
        """Draw a cuboid (8, 3)."""

    @abstractmethod
    def tube(self, walls: Array) -> None:
        """Draw the walls (M, 4, 3) of a tube of two standard deviations."""
        self._remember("2 standard deviations", color=COLOURS["tube"], lw=6.0)

    @abstractmethod
    def workspace_lines(self, workspace: Box | Shell) -> list[Array]:
        """The lines of a workspace that can be seen."""

    @abstractmethod
    def pixels(self, points: Array) -> Array:
        """Image coordinates (K, 2) of points (K, 3) [m]; valid once the figure was laid out."""

    def seen(self, points: Array) -> Array:
        """What the axes draw of points (K, 3) [m]."""
        return points

    def line(self, points: Array, *, label: str = "", cap: str = "round", **style: Any) -> None:
        """Draw a line."""
        self.axes.plot(*self.seen(points).T, solid_capstyle=cap, **self.line_style, **style)
        self._remember(label, **style)

    def _scatter(self, points: Array, **style: Any) -> None:
        self.axes.scatter(*self.seen(points).T, **self.marker_style, **style)

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

    def labels(self, texts: Sequence[str], colors: Sequence[str], boxes: Sequence[Array], busy: Array) -> None:
        """Write names beside cuboids (8, 3), clear of each other and of the points `busy`."""
        self.figure.draw_without_rendering()
        window = self.axes.get_window_extent()
        side, top = self.inset[0] * window.width, self.inset[1] * window.height
        area = np.array([window.x0 + side, window.y0]), np.array([window.x1 - side, window.y1 - top])
        self._label(texts, colors, [self.pixels(box) for box in boxes], self.pixels(busy), area)

    def _label(self, texts: Sequence[str], colors: Sequence[str], pixels: list[Array], busy: Array, area: Any) -> None:
        """Write texts beside boxes of projected corners (8, 2), all in pixels."""
        width, height = self.figure.bbox.width, self.figure.bbox.height
        pairs = [(text, {**_LABEL_BOX, "ec": color}) for text, color in zip(texts, colors, strict=True)]
        written = [self.figure.text(0.5, 0.5, text, bbox=box, **_LABEL) for text, box in pairs]
        scale, extents = self.figure.dpi / 72.0, [text.get_window_extent() for text in written]
        sizes = [(box.width + 4.0 * scale, box.height + 3.0 * scale) for box in extents]
        boxes = [(p.min(axis=0), p.max(axis=0)) for p in pixels]
        spots = geometry.place_labels(boxes, sizes, busy, area, scale=scale)
        for text, spot, corner, color in zip(written, spots, boxes, colors, strict=True):
            text.set_position((spot.middle[0] / width, spot.middle[1] / height))
            if spot.joined:
                middle = (corner[0] + corner[1]) / 2.0
                x, y = [spot.middle[0] / width, middle[0] / width], [spot.middle[1] / height, middle[1] / height]
                self.figure.add_artist(Line2D(x, y, color=color, lw=0.9, zorder=0.5))


class TopCanvas(Canvas):
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

    def seen(self, points: Array) -> Array:
        """Points (K, 2) [m] from above."""
        return points[:, [self.across, self.along]]

    def pixels(self, points: Array) -> Array:
        """Image coordinates (K, 2) of points (K, 3) [m]."""
        return np.asarray(self.axes.transData.transform(self.seen(points)))

    def cuboid(self, corners: Array, color: str) -> None:
        """Draw a cuboid (8, 3) as its outline from above."""
        faces = [self.seen(corners[face]) for face in FACES]
        self.axes.add_collection(PolyCollection(faces, facecolors=color, edgecolors=color, alpha=0.22, lw=1.0))

    def tube(self, walls: Array) -> None:
        """Draw the walls (M, 4, 3) of a tube, from above as one pale area."""
        super().tube(walls)
        faces = [self.seen(wall) for wall in walls]
        pale = COLOURS["tube"]
        self.axes.add_collection(PolyCollection(faces, facecolors=pale, edgecolors=pale, zorder=0.6))

    def workspace_lines(self, workspace: Box | Shell) -> list[Array]:
        """The lines of a workspace that can be seen."""
        self.figure.draw_without_rendering()
        lower, upper = np.full(3, -np.inf), np.full(3, np.inf)
        for axis, (low, high) in ((self.across, self.axes.get_xlim()), (self.along, self.axes.get_ylim())):
            lower[axis], upper[axis] = min(low, high), max(low, high)
        return workspace_lines(workspace, lower, upper)


class SpaceCanvas(Canvas):
    """3-D view of the scene from behind, right and above, for any frame."""

    inset = 0.03, 0.06
    line_style = MappingProxyType({"zorder": 3})
    marker_style = MappingProxyType({"depthshade": False})

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

    def pixels(self, points: Array) -> Array:
        """Image coordinates (K, 2) of points (K, 3) [m]; valid once the figure was laid out."""
        flat = np.column_stack([points, np.ones(len(points))]) @ self.axes.get_proj().T
        return np.asarray(self.axes.transData.transform(flat[:, :2] / flat[:, 3:]))

    def cuboid(self, corners: Array, color: str) -> None:
        """Draw a cuboid (8, 3)."""
        faces = [corners[face] for face in FACES]
        look = {"facecolors": color, "edgecolors": color, "alpha": 0.28, "lw": 0.8, "zorder": 2}
        self.axes.add_collection3d(Poly3DCollection(faces, **look))

    def tube(self, walls: Array) -> None:
        """Draw the walls (M, 4, 3) of a tube."""
        super().tube(walls)
        self.axes.add_collection3d(Poly3DCollection(walls, facecolors=COLOURS["tube"], alpha=0.1, lw=0, zorder=2))

    def workspace_lines(self, workspace: Box | Shell) -> list[Array]:
        """The lines of a workspace that can be seen."""
        return workspace_lines(workspace, self.shown.lower, self.shown.upper)
