"""Figures for print and for a first look, drawn with matplotlib (object-oriented, without pyplot)."""

from __future__ import annotations

import io
import os
import textwrap
from collections.abc import Sequence
from typing import Any

import numpy as np

from ovita.errors import FormatError, MissingExtra
from ovita.io import atomic_write
from ovita.limits import ConstraintCheck
from ovita.measure import compare
from ovita.paths.robot import Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots import geometry
from ovita.plots.canvas import Canvas, SpaceCanvas, TopCanvas
from ovita.plots.geometry import COLOURS, OBJECT_COLOURS, Extent, View

try:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties, findfont, get_font
    from matplotlib.lines import Line2D
except ImportError:
    raise MissingExtra("matplotlib", "plot") from None

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
    _objects(canvas, shown)
    _paths(canvas, original, adapted, proposed, scene)
    _broken(canvas, adapted, violations or ())
    _names(canvas, shown, paths)
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
    for i, line in enumerate(lines):
        canvas.line(line, color=COLOURS["workspace"], lw=0.8, alpha=0.55, label="" if i else "workspace")
    return bool(lines)


def _objects(canvas: Canvas, shown: Extent) -> None:
    least = 0.012 * float(shown.size.max())
    for i, item in enumerate(shown.shown):
        canvas.cuboid(geometry.corners(item, least), OBJECT_COLOURS[i % len(OBJECT_COLOURS)])


def _paths(
    canvas: Canvas, original: Trajectory, adapted: Trajectory, proposed: Trajectory | None, scene: Scene
) -> None:
    changes = compare(original, adapted, scene)
    told = set()
    for stretch in [] if changes.speed.everywhere else changes.speed.ranges:
        word = "slower" if stretch.speed.change < 0 else "faster"
        span = slice(max(stretch.first - 1, 0), stretch.last + 2)
        label = "" if word in told else word
        told.add(word)
        canvas.line(adapted.positions[span], color=COLOURS[word], lw=9, alpha=0.4, label=label, cap="butt")
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


def _names(canvas: Canvas, shown: Extent, paths: Sequence[Trajectory]) -> None:
    busy = np.concatenate([path.resample(150).positions for path in paths])
    ends = np.concatenate([np.repeat(path.positions[[0, -1]], 4, axis=0) for path in paths])
    texts = [printable(_short(item.name)) for item in shown.shown]
    boxes = [geometry.corners(item) for item in shown.shown]
    colours = [OBJECT_COLOURS[i % len(OBJECT_COLOURS)] for i in range(len(texts))]
    canvas.labels(texts, colours, boxes, np.concatenate([busy, ends]))


def _speeds(
    drawing: Figure, original: Trajectory, adapted: Trajectory, proposed: Trajectory | None, robot: Robot | None
) -> None:
    panels = (
        ("time [s]", "times", (0.075, 0.065, 0.39, 0.20)),
        ("distance [m]", "arc_length", (0.565, 0.065, 0.39, 0.20)),
    )
    highest = max(float(path.speeds.max()) for path in (original, adapted))
    limit = robot.max_speed if robot is not None else None
    for label, quantity, place in panels:
        axes = drawing.add_axes(place)
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
    lines = textwrap.wrap(printable(title), 88, max_lines=2, placeholder=" ...")
    top = 0.985
    for line in lines:
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
