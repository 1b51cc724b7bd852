"""The panel of figures A to G of the paper (OVITA, arXiv 2508.17260, Fig. "quant"), from records."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from ovita.baselines.catalogue import is_baseline, labelled
from ovita.bench.records import Record
from ovita.bench.tables import Interval, Tally, by_column, percentile, rounds, tallies
from ovita.errors import needs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#999999", "#000000")
"""Colours that people with colour blindness tell apart [Okabe2008]."""


def panel(records: Sequence[Record], ratings: Mapping[str, Sequence[float]] | None = None) -> Figure:
    """Draw the panel: A writers, B subsets, C executability, D feedback, E interpretability, F examples, G temperature.

    Two more show success by kind of instruction and times. Shares carry 95 % Wilson intervals. Writers come first,
    baselines after them, in the same colour everywhere. A part that was not run says how to run it.

    Raises:
        MissingExtra: If matplotlib is not installed.
    """
    with needs("matplotlib", "plot"):
        from matplotlib.figure import Figure
        from matplotlib.patches import Patch
    figure = Figure(figsize=(16, 11), layout="constrained")
    grid = figure.add_gridspec(3, 4)
    places = (
        grid[0, 0],
        grid[0, 1:3],
        grid[0, 3],
        grid[1, 3],
        *(grid[2, i] for i in range(3)),
        grid[1, :3],
        grid[2, 3],
    )
    axes = [figure.add_subplot(place) for place in places]
    found, standard = tallies(records), [r for r in records if r.condition == "default"]
    mine = sorted((x for x in found if x.condition == "default"), key=lambda x: is_baseline(x.writer))
    color = dict(zip((x.writer for x in mine), cycle(COLORS), strict=False))
    _bars(axes[0], "A  success by writer", [(x.writer, x.success, color[x.writer]) for x in mine])
    _grouped(axes[1], "B  success by subset", tallies(standard, "subset"), color)
    _bars(axes[2], "C  executable", [(x.writer, x.executable, color[x.writer]) for x in mine])
    _feedback(axes[3], standard, color)
    _ratings(axes[4], ratings or {}, color)
    _examples(axes[5], found, color)
    _temperature(axes[6], found, color)
    _grouped(axes[7], "success by kind of instruction", tallies(standard, "kind"), color)
    _times(axes[8], standard, color)
    handles = [Patch(color=color[writer], label=_full(labelled(writer))) for writer in color]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6) or 1, fontsize=9)
    return figure


def image(figure: Figure, kind: Literal["png", "svg"]) -> bytes:
    """The figure as a file's content, the same for the same records."""
    import matplotlib

    data = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "ovita", "svg.fonttype": "path"}):
        metadata: dict[str, Any] = {"Date": None} if kind == "svg" else {}
        figure.savefig(data, format=kind, dpi=130, metadata=metadata)
        figure.set_layout_engine("none")  # laid out once, for all formats
    return data.getvalue()


def _bars(axes: Axes, title: str, bars: Sequence[tuple[str, Interval, str]]) -> None:
    frame(axes, title)
    for i, (_, share, color) in enumerate(bars):
        bar(axes, i, share, 0.6, color)
        axes.text(i, 1.09, f"{share.successes}\nof {share.n}", ha="center", va="center", fontsize=7.5, linespacing=0.95)
    axes.set_ylim(0, 1.16)
    axes.set_yticks([0, 0.2, 0.4, 0.6, 0.8, 1])
    axes.set_xlim(-0.8, max(len(bars), 3) - 0.2)
    label(axes, [name for name, _, _ in bars])


def bar(axes: Axes, x: float, share: Interval, width: float, color: str) -> None:
    """Draw a share as a bar with its interval; nothing of no samples."""
    if share.n == 0:
        return
    error = [[reach] for reach in share.error]
    axes.bar(x, share.rate, width, color=color, yerr=error, capsize=2.5, ecolor="#333333", error_kw={"lw": 0.9})
    axes.plot([x], [share.rate], "o", ms=4, color=color, mec="#333333", mew=0.7, clip_on=False)  # whose bar of 0 it is


def label(axes: Axes, names: Sequence[str]) -> None:
    """Write names below the axis at 0, 1, ..., slanted where they would run into each other."""
    axes.set_xticks(range(len(names)), [short(name) for name in names], fontsize=8)
    if len(names) > 1 and max(map(len, names)) * len(names) > 34:
        axes.tick_params(axis="x", labelrotation=30)
        for text in axes.get_xticklabels():
            text.set_horizontalalignment("right")
            text.set_rotation_mode("anchor")


def _grouped(axes: Axes, title: str, mine: Sequence[Tally], color: Mapping[str, str]) -> None:
    frame(axes, title)
    groups = list(dict.fromkeys(line.group for line in mine))
    width = 0.84 / max(1, len(color))
    writers, most = list(color), dict.fromkeys(groups, 0)
    for line in mine:
        middle = groups.index(line.group) + (writers.index(line.writer) - (len(color) - 1) / 2) * width
        bar(axes, middle, line.success, 0.9 * width, color[line.writer])
        most[line.group] = max(most[line.group], line.success.n)
    for i in range(1, len(groups)):
        axes.axvline(i - 0.5, color="#cccccc", lw=0.7)
    axes.set_xlim(-0.5, len(groups) - 0.5)
    axes.set_xticks(range(len(groups)), [f"{short(group)}\nn = {most[group]}" for group in groups], fontsize=8)


def _feedback(axes: Axes, records: Sequence[Record], color: Mapping[str, str]) -> None:
    from matplotlib.ticker import MaxNLocator

    frame(axes, "D  success with feedback")
    found = {writer: rounds(mine) for (writer, _), mine in by_column(records).items()}
    drawn = {writer: shares for writer, shares in found.items() if len(shares) > 1}
    for k, (writer, shares) in enumerate(drawn.items()):
        apart = 0.02 * (k - (len(drawn) - 1) / 2)
        _line(axes, [i + apart for i in range(len(shares))], shares, color[writer], labelled(writer))
    axes.set_xlabel("turns of feedback", fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _or_not_run(axes, bool(drawn), "not run: --feedback 1")


def _ratings(axes: Axes, ratings: Mapping[str, Sequence[float]], color: Mapping[str, str]) -> None:
    """Means with 95 % intervals as if all ratings were independent; the study's report has them by person."""
    frame(axes, "E  interpretability (1 to 5)", share=False)
    axes.set_ylim(0.9, 5.1)
    axes.set_yticks(range(1, 6))
    for i, (writer, values) in enumerate(ratings.items()):
        error = 1.96 * np.std(values, ddof=len(values) > 1) / math.sqrt(len(values))
        own = color.get(writer, COLORS[6])
        axes.errorbar([i], [np.mean(values)], yerr=[error], fmt="o", ms=7, lw=1.6, capsize=4, color=own)
    axes.set_xlim(-0.6, max(len(ratings), 2) - 0.4)
    label(axes, list(ratings))
    _or_not_run(
        axes, bool(ratings), "no ratings: put ratings.csv\ninto the run's folder, or\novita bench report --ratings"
    )


def _examples(axes: Axes, found: Sequence[Tally], color: Mapping[str, str]) -> None:
    frame(axes, "F  examples: retrieved, the paper's, none")
    by = {(line.writer, line.condition): line for line in found}
    writers = [w for w in color if (w, "default") in by and {(w, "paper examples"), (w, "no examples")} & by.keys()]
    for i, writer in enumerate(writers):
        shades = {"default": color[writer], "paper examples": "#8a8a8a", "no examples": "#cccccc"}
        for place, (condition, shade) in enumerate(shades.items()):
            if (writer, condition) in by:
                bar(axes, i + 0.27 * (place - 1), by[writer, condition].success, 0.25, shade)
    label(axes, writers)
    _or_not_run(axes, bool(writers), "not run: --ablate examples\n(needs a model)")


def _temperature(axes: Axes, found: Sequence[Tally], color: Mapping[str, str]) -> None:
    frame(axes, "G  success by temperature")
    drawn = sorted(
        ((float(x.condition.split()[1]), x) for x in found if x.condition.startswith("temperature ")),
        key=lambda y: y[0],
    )
    for writer in color:
        points = [(t, x.success) for t, x in drawn if x.writer == writer]
        if points:
            _line(axes, [t for t, _ in points], [share for _, share in points], color[writer], writer)
    axes.set_xlabel("temperature", fontsize=8)
    _or_not_run(axes, bool(drawn), "not run:\n--ablate temperature=0,0.2,0.5,0.7\n(needs a model)")


def _times(axes: Axes, records: Sequence[Record], color: Mapping[str, str]) -> None:
    """The middle half of the times to the first answer, with the median, and whiskers from 5 % to 95 %."""
    frame(axes, "time to the first answer [s]", share=False)
    axes.set_yscale("log")
    for i, writer in enumerate(color):
        times = [r.first.ms / 1000 for r in records if r.writer == writer]
        low, first, middle, third, high = (max(percentile(times, q), 1e-4) for q in (0.05, 0.25, 0.5, 0.75, 0.95))
        axes.vlines(i, low, high, color=color[writer], lw=1.4)
        axes.bar(i, third - first, 0.5, bottom=first, color=color[writer], alpha=0.55)
        axes.hlines(middle, i - 0.25, i + 0.25, color="black", lw=1.6)
    axes.set_xlim(-0.6, max(len(color), 3) - 0.4)
    axes.yaxis.set_major_formatter("{x:g}")
    label(axes, list(color))


def _line(axes: Axes, x: Sequence[float], shares: Sequence[Interval], color: str, name: str) -> None:
    rates, error = [share.rate for share in shares], np.transpose([share.error for share in shares])
    axes.errorbar(list(x), rates, yerr=error, color=color, marker="o", ms=4, lw=1.4, capsize=2.5, label=short(name))


def frame(axes: Axes, title: str, *, share: bool = True) -> None:
    """Give axes their title and grid, and the range 0 to 1 if they show a share."""
    axes.set_title(title, fontsize=10, loc="left")
    axes.tick_params(labelsize=8)
    axes.grid(axis="y", alpha=0.25)
    axes.set_axisbelow(True)
    if share:
        axes.set_ylim(0, 1.02)


def _or_not_run(axes: Axes, drawn: bool, otherwise: str) -> None:
    if not drawn:
        axes.set_xticks([])
        axes.text(0.5, 0.5, otherwise, transform=axes.transAxes, ha="center", va="center", fontsize=8, color="#666666")


def short(name: str) -> str:
    """A name that fits under a bar."""
    brief = name.removeprefix("baseline:")
    return _full(brief if len(brief) <= 20 else brief[:19] + "…")


def _full(name: str) -> str:
    # matplotlib would read a pair of dollar signs as mathematics
    return name.replace("$", r"\$")
