"""A sheet of samples: a small picture of each motion before and after, under its sentence."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ovita.augment.shards import AugmentedSample
from ovita.errors import needs
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.plots.geometry import COLOURS, OBJECT_COLOURS, axis_word, corners, extent

with needs("matplotlib", "plot"):
    from matplotlib.axes import Axes
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

COLUMNS = 4
"""Pictures in a row."""

_PICTURE = (3.4, 3.3)
_STILL = 1e-6
_ENDS = {"start": "o", "goal": "s"}


def sheet(samples: Sequence[AugmentedSample]) -> Figure:
    """Draw samples on one sheet: blue before, red after; speeds where the path itself stays as it was.

    A path is shown from above, or from the side where the change is mostly up or down.
    """
    columns = min(COLUMNS, max(len(samples), 1))
    rows = -(-len(samples) // columns)
    drawing = Figure(figsize=(_PICTURE[0] * columns, _PICTURE[1] * rows), facecolor="white", layout="constrained")
    FigureCanvasAgg(drawing)
    for place, sample in enumerate(samples, start=1):
        axes = drawing.add_subplot(rows, columns, place)
        original, adapted = sample.task.trajectory, sample.adapted
        if _same_path(original, adapted):
            _speeds(axes, original, adapted)
        else:
            _paths(axes, original, adapted, sample.task.scene)
        title = textwrap.fill(sample.instruction, 40, max_lines=3)
        axes.set_title(f"{title}\n[{sample.index}] {sample.family}, {sample.split}, {sample.verdict}", fontsize=7)
        axes.tick_params(labelsize=6)
    handles = [Line2D([], [], color=COLOURS[name], label=name) for name in ("before", "after")]
    handles += [Line2D([], [], color=COLOURS[name], marker=mark, ls="", label=name) for name, mark in _ENDS.items()]
    drawing.legend(handles=handles, loc="outside lower center", ncols=4, fontsize=7, frameon=False)
    return drawing


def _same_path(original: Trajectory, adapted: Trajectory) -> bool:
    same = original.positions.shape == adapted.positions.shape
    return same and bool(np.abs(original.positions - adapted.positions).max() < _STILL)


def _paths(axes: Axes, original: Trajectory, adapted: Trajectory, scene: Scene) -> None:
    across, up = _view(original, adapted)
    shown = extent([original, adapted], scene)
    for item, colour in zip(shown.shown, OBJECT_COLOURS * 8, strict=False):
        box = corners(item, 0.02 * float(shown.size.max()))[:, [across, up]]
        low, high = box.min(axis=0), box.max(axis=0)
        axes.fill([low[0], high[0], high[0], low[0]], [low[1], low[1], high[1], high[1]], color=colour, alpha=0.35)
        axes.annotate(item.name, (low + high) / 2.0, fontsize=6, ha="center", va="center")
    for path, looks in _lines(original, adapted):
        places = path.positions[:, [across, up]]
        axes.plot(*places.T, **looks)
        for place, (end, mark) in zip((places[0], places[-1]), _ENDS.items(), strict=True):
            axes.plot(*place, mark, color=COLOURS[end], ms=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel(f"{'xyz'[across]} [m], + is {axis_word(scene.frame, across)}", fontsize=6)
    axes.set_ylabel(f"{'xyz'[up]} [m], + is {axis_word(scene.frame, up)}", fontsize=6)


def _lines(original: Trajectory, adapted: Trajectory) -> Iterator[tuple[Trajectory, dict[str, Any]]]:
    yield original, {"color": COLOURS["before"], "lw": 2.5, "alpha": 0.6}
    yield adapted, {"color": COLOURS["after"], "lw": 1.2}


def _view(original: Trajectory, adapted: Trajectory) -> tuple[int, int]:
    """The axes to the right and upwards in the picture."""
    moved = np.ptp(adapted.positions, axis=0) + np.abs(adapted.positions.mean(axis=0) - original.positions.mean(axis=0))
    if len(original) == len(adapted):
        moved = np.abs(adapted.positions - original.positions).max(axis=0)
    if moved[2] <= max(moved[0], moved[1]):
        return 0, 1
    spread = np.ptp(original.positions, axis=0)
    return (0, 2) if spread[0] >= spread[1] else (1, 2)


def _speeds(axes: Axes, original: Trajectory, adapted: Trajectory) -> None:
    for path, looks in _lines(original, adapted):
        axes.plot(path.arc_length, path.speeds, **looks)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("way [m]", fontsize=6)
    axes.set_ylabel("speed [m/s]; the path stays", fontsize=6)
