"""The panel of figures A to G of the paper (OVITA, arXiv 2508.17260, Fig. "quant"), from records."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal

from ovita.bench.records import Record
from ovita.bench.tables import By, Column, Interval, Tally, columns, named, rounds, tallies
from ovita.errors import MissingExtra

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLORS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#d55e00", "#56b4e9", "#999999", "#000000")
"""Colours that people with colour blindness tell apart [Okabe2008]."""


def panel(records: Sequence[Record], ratings: Mapping[str, Sequence[float]] | None = None) -> Figure:
    """Draw the panel: A writers, B subsets, C executability, D feedback, E interpretability, F examples, G temperature.

    Bars and points carry 95 % Wilson intervals. A part that was not run says how to run it.

    Raises:
        MissingExtra: If matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ImportError:
        raise MissingExtra("matplotlib", "plot") from None
    figure = Figure(figsize=(15, 7.4), layout="constrained")
    axes = figure.subplots(2, 4).ravel()
    mine = [line for line in tallies(records) if line.condition == "default"]
    color = {column[0]: COLORS[i % len(COLORS)] for i, column in enumerate(dict.fromkeys(_defaults(records)))}
    _bars(axes[0], "A  success by writer", [(x.writer, x.success, color[x.writer]) for x in mine])
    _grouped(axes[1], "B  success by subset", records, "subset", color)
    _bars(axes[2], "C  executable", [(x.writer, x.executable, color[x.writer]) for x in mine])
    _feedback(axes[3], records, color)
    _ratings(axes[4], ratings or {}, color)
    _examples(axes[5], tallies(records), color)
    _temperature(axes[6], tallies(records), color)
    _grouped(axes[7], "success by kind of instruction", records, "kind", color)
    return figure


def image(figure: Figure, kind: Literal["png", "svg"]) -> bytes:
    """The figure as a file's content, the same for the same records."""
    import matplotlib

    data = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "ovita", "svg.fonttype": "path"}):
        metadata: dict[str, Any] = {"Date": None} if kind == "svg" else {}
        figure.savefig(data, format=kind, dpi=130, metadata=metadata)
    return data.getvalue()


def _defaults(records: Sequence[Record]) -> list[Column]:
    return [column for column in columns(records) if column[1] == "default"]


def _bars(axes: Axes, title: str, bars: Sequence[tuple[str, Interval, str]]) -> None:
    frame(axes, title)
    for i, (_, share, color) in enumerate(bars):
        bar(axes, i, share, 0.6, color)
        axes.text(i, 0.02, f"{share.successes}/{share.n}", ha="center", va="bottom", fontsize=8, color="white")
    axes.set_xlim(-0.8, max(len(bars), 3) - 0.2)
    axes.set_xticks(range(len(bars)), [short(name) for name, _, _ in bars], fontsize=8)


def bar(axes: Axes, x: float, share: Interval, width: float, color: str) -> None:
    """Draw a share as a bar with its interval; nothing of no samples."""
    if share.n == 0:
        return
    error = [[max(share.rate - share.low, 0.0)], [max(share.high - share.rate, 0.0)]]
    axes.bar(x, share.rate, width, color=color, yerr=error, capsize=2.5, ecolor="#333333", error_kw={"lw": 0.9})


def _grouped(axes: Axes, title: str, records: Sequence[Record], by: By, color: Mapping[str, str]) -> None:
    frame(axes, title)
    mine = [line for line in tallies(records, by) if line.condition == "default"]
    groups = list(dict.fromkeys(line.group for line in mine))
    width = 0.8 / max(1, len(color))
    for k, writer in enumerate(color):
        for line in (x for x in mine if x.writer == writer):
            bar(axes, groups.index(line.group) + (k - (len(color) - 1) / 2) * width, line.success, width, color[writer])
    axes.set_xticks(range(len(groups)), [short(g) for g in groups], fontsize=7.5, rotation=30, ha="right")


def _feedback(axes: Axes, records: Sequence[Record], color: Mapping[str, str]) -> None:
    from matplotlib.ticker import MaxNLocator

    frame(axes, "D  success with feedback")
    drawn = False
    for column in _defaults(records):
        shares = rounds(records, column)
        if len(shares) > 1:
            drawn = True
            _line(axes, range(len(shares)), shares, color[column[0]], named(column))
    axes.set_xlabel("turns of feedback", fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    _legend_or(axes, drawn, "not run: --feedback 1")


def _ratings(axes: Axes, ratings: Mapping[str, Sequence[float]], color: Mapping[str, str]) -> None:
    frame(axes, "E  interpretability (1 to 5)", share=False)
    axes.set_ylim(1, 5)
    for i, (writer, values) in enumerate(ratings.items()):
        mean = sum(values) / len(values)
        spread = math.sqrt(sum((v - mean) ** 2 for v in values) / max(1, len(values) - 1))
        axes.bar(i, mean - 1, 0.6, bottom=1, color=color.get(writer, COLORS[6]), yerr=spread, capsize=2.5)
    axes.set_xticks(range(len(ratings)), [short(name) for name in ratings], fontsize=8)
    _legend_or(axes, bool(ratings), "no ratings: put ratings.csv\ninto the run's folder", legend=False)


def _examples(axes: Axes, found: Sequence[Tally], color: Mapping[str, str]) -> None:
    frame(axes, "F  examples: retrieved, the paper's, none")
    by = {(line.writer, line.condition): line for line in found}
    writers = [w for w in color if (w, "default") in by and {(w, "paper examples"), (w, "no examples")} & by.keys()]
    for i, writer in enumerate(writers):
        shades = {"default": color[writer], "paper examples": "#8a8a8a", "no examples": "#cccccc"}
        for place, (condition, shade) in enumerate(shades.items()):
            if (writer, condition) in by:
                bar(axes, i + 0.27 * (place - 1), by[writer, condition].success, 0.25, shade)
    axes.set_xticks(range(len(writers)), [short(writer) for writer in writers], fontsize=8)
    _legend_or(axes, bool(writers), "not run: --ablate examples\n(needs a model)", legend=False)


def _temperature(axes: Axes, found: Sequence[Tally], color: Mapping[str, str]) -> None:
    frame(axes, "G  success by temperature")
    drawn = False
    for writer in color:
        points = [
            (float(x.condition.split()[1]), x.success)
            for x in found
            if x.writer == writer and x.condition.startswith("temperature ")
        ]
        if points:
            drawn = True
            points.sort(key=lambda point: point[0])
            _line(axes, [t for t, _ in points], [share for _, share in points], color[writer], writer)
    axes.set_xlabel("temperature", fontsize=8)
    _legend_or(axes, drawn, "not run:\n--ablate temperature=0,0.2,0.5,0.7\n(needs a model)")


def _line(axes: Axes, x: Sequence[float], shares: Sequence[Interval], color: str, label: str) -> None:
    rates = [share.rate for share in shares]
    error = [
        [max(s.rate - s.low, 0.0) for s in shares],
        [max(s.high - s.rate, 0.0) for s in shares],
    ]
    axes.errorbar(list(x), rates, yerr=error, color=color, marker="o", ms=4, lw=1.4, capsize=2.5, label=short(label))


def frame(axes: Axes, title: str, *, share: bool = True) -> None:
    """Give axes their title and grid, and the range 0 to 1 if they show a share."""
    axes.set_title(title, fontsize=10, loc="left")
    axes.tick_params(labelsize=8)
    axes.grid(axis="y", alpha=0.25)
    axes.set_axisbelow(True)
    if share:
        axes.set_ylim(0, 1.02)


def _legend_or(axes: Axes, drawn: bool, otherwise: str, *, legend: bool = True) -> None:
    if drawn and legend:
        axes.legend(fontsize=7, loc="lower right")
    elif not drawn:
        axes.set_xticks([])
        axes.text(0.5, 0.5, otherwise, transform=axes.transAxes, ha="center", va="center", fontsize=8, color="#666666")


def short(name: str) -> str:
    """A name that fits under a bar."""
    # matplotlib would read a pair of dollar signs as mathematics
    return (name if len(name) <= 22 else name[:21] + "…").replace("$", r"\$")
