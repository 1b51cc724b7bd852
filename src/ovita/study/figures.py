"""The figures of a study's report: success, ratings, interpretability, phases, factors, preferences, questionnaires."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

from ovita.bench.figures import COLORS, frame, image, short
from ovita.errors import needs
from ovita.study.analysis import OVERALL, Analysis, Contrast, Summary
from ovita.study.ratings import LIKERT
from ovita.study.statistics import Estimate

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["image", "study_panel"]

SCALE = ("#b2182b", "#ef8a62", "#dddddd", "#67a9cf", "#2166ac")
"""From 1 to 5, which people with colour blindness tell apart."""


def study_panel(found: Analysis, watermark: str = "") -> Figure:
    """Draw the study's panel; what was not asked is said to be missing, and a watermark lies across every part.

    Intervals are 95 %, from resampling people.

    Raises:
        MissingExtra: If matplotlib is not installed.
    """
    with needs("matplotlib", "plot"):
        from matplotlib.figure import Figure
    figure = Figure(figsize=(16, 8.4), layout="constrained")
    axes = figure.subplots(2, 4).ravel()
    rated = [s for s in found.summaries if (s.group, s.phase) == (OVERALL, "rate")]
    color = dict(zip(sorted({s.condition for s in rated}), cycle(COLORS), strict=False))
    success, clear = ([s for s in rated if s.question == question] for question in LIKERT)
    _points(axes[0], "A  success (4 or 5)", [(s.condition, s.success, color[s.condition]) for s in success], (0, 1))
    _stacks(axes[1], "B  correctness: share of 1 to 5", success)
    _points(axes[2], "C  interpretability (1 to 5)", [(s.condition, s.mean, color[s.condition]) for s in clear], (1, 5))
    _levels(axes[3], "D  correctness by group", found, color)
    pairs, factors = ([c for c in found.contrasts if (c.factor == "condition") == alike] for alike in (True, False))
    _differences(axes[4], "E  pairs: b minus a", pairs, "one condition")
    _differences(axes[5], "F  explanation, phase, group", factors, "one level of each")
    _worth(axes[6], "G  preference: worth", found, color)
    _questionnaires(axes[7], "H  questionnaires (0 to 100)", found)
    if watermark:
        _marked(figure, axes, watermark)
    return figure


def _marked(figure: Figure, axes: Sequence[Axes], watermark: str) -> None:
    for part in axes:
        part.text(0.5, 0.5, watermark.split(":")[0], transform=part.transAxes, ha="center", va="center", rotation=30,
                  fontsize=44, color="#d00000", alpha=0.22, zorder=10, weight="bold")  # fmt: skip
    figure.suptitle(watermark, color="#d00000", fontsize=13)


def _points(axes: Axes, title: str, points: Sequence[tuple[str, Estimate, str]], span: tuple[float, float]) -> None:
    frame(axes, title, share=span == (0, 1))
    room = 0.03 * (span[1] - span[0])
    axes.set_ylim(span[0] - room, span[1] + room)
    for i, (_, estimate, color) in enumerate(points):
        _spread(axes, i, estimate, color)
    axes.set_xlim(-0.6, max(len(points), 2) - 0.4)
    _names(axes, [name for name, _, _ in points])
    _or_missing(axes, bool(points))


def _spread(axes: Axes, x: float, estimate: Estimate, color: str, marker: str = "o", label: str = "") -> None:
    looks: dict[str, Any] = {"fmt": marker, "ms": 7, "lw": 1.6, "capsize": 4, "color": color, "label": label or None}
    axes.errorbar([x], [estimate.value], yerr=estimate.error, **looks)


def _names(axes: Axes, names: Sequence[str]) -> None:
    axes.set_xticks(range(len(names)), [short(name) for name in names], fontsize=8)
    if sum(map(len, names)) > 34:
        axes.tick_params(axis="x", labelrotation=25)
        for label in axes.get_xticklabels():
            label.set_horizontalalignment("right")


def _stacks(axes: Axes, title: str, rows: Sequence[Summary]) -> None:
    frame(axes, title)
    for i, s in enumerate(rows):
        bottom = 0.0
        for point, (n, color) in enumerate(zip(s.counts, SCALE, strict=True), 1):
            share = n / max(1, sum(s.counts))
            axes.bar(i, share, 0.6, bottom=bottom, color=color, label=str(point) if i == 0 else None)
            if share > 0.06:
                ink = "white" if point in (1, 5) else "black"
                axes.text(i, bottom + share / 2, f"{share:.0%}", ha="center", va="center", fontsize=7.5, color=ink)
            bottom += share
    axes.set_xlim(-0.6, max(len(rows), 2) - 0.4)
    _names(axes, [s.condition for s in rows])
    if rows:
        axes.set_ylim(0, 1.16)
        axes.legend(fontsize=7, ncols=5, loc="upper center", handlelength=1, columnspacing=0.9)
    _or_missing(axes, bool(rows))


def _levels(axes: Axes, title: str, found: Analysis, color: dict[str, str]) -> None:
    frame(axes, title, share=False)
    axes.set_ylim(0.9, 5.3 + 0.28 * len(color))
    axes.set_yticks(range(1, 6))
    parts = [s for s in found.summaries if (s.question, s.phase) == ("correctness", "rate") and s.group != OVERALL]
    groups = sorted({s.group for s in parts})
    names = list(color)
    for s in sorted(parts, key=lambda s: names.index(s.condition)):
        x = groups.index(s.group) + 0.7 * (names.index(s.condition) - (len(color) - 1) / 2) / max(1, len(color))
        _spread(axes, x, s.mean, color[s.condition], label=short(s.condition) if s.group == groups[0] else "")
    axes.set_xticks(range(len(groups)), [short(group) for group in groups], fontsize=8)
    if parts:
        axes.set_xlim(-0.6, len(groups) - 0.4)
        axes.legend(fontsize=7, loc="upper left")
    _or_missing(axes, bool(parts), "one group")


def _differences(axes: Axes, title: str, rows: Sequence[Contrast], otherwise: str) -> None:
    """Differences with their intervals, one line a pair, both questions on it; a filled mark is p (Holm) < 0.05."""
    frame(axes, title, share=False)
    names = {(c.a, c.b): f"{short(c.b)}\n- {short(c.a)}" for c in rows}
    pairs = list(dict.fromkeys(names.values()))
    looks = {"correctness": (COLORS[0], -0.16), "interpretability": (COLORS[4], 0.16)}
    for c in rows:
        estimate, (color, shift) = c.difference, looks[c.question]
        line: dict[str, Any] = {"fmt": "o", "ms": 6, "capsize": 3, "lw": 1.4, "color": color}
        line["mfc"] = color if c.holm < 0.05 else "white"
        axes.errorbar([estimate.value], [pairs.index(names[c.a, c.b]) + shift], xerr=estimate.error, **line)
    axes.axvline(0, color="#888888", lw=0.8)
    axes.set_yticks(range(len(pairs)), pairs, fontsize=6.5 if len(pairs) > 8 else 7.5)
    axes.set_ylim(len(pairs) - 0.5, -1.1)
    axes.set_xlabel("points of 1 to 5; filled: p (Holm) < 0.05", fontsize=8)
    for question in dict.fromkeys(c.question for c in rows):
        axes.plot([], [], "o", color=looks[question][0], label=question)
    if rows:
        axes.legend(fontsize=7, loc="upper center", ncols=2, handletextpad=0.2)
    _or_missing(axes, bool(rows), otherwise)


def _worth(axes: Axes, title: str, found: Analysis, color: dict[str, str]) -> None:
    preferred = found.preferred
    named = zip(preferred.strengths.names, preferred.worth, strict=True) if preferred else ()
    _points(axes, title, [(name, worth, color.get(name, COLORS[6])) for name, worth in named], (0, 1))


def _questionnaires(axes: Axes, title: str, found: Analysis) -> None:
    points = [(f"{s.instrument}{' ' + s.condition if s.condition else ''}", s.mean, COLORS[5]) for s in found.scores]
    _points(axes, title, points, (0, 100))
    if points:
        names = [short(name) for name, _, _ in points]
        axes.set_xticks(range(len(points)), names, fontsize=7.5, rotation=40, ha="right")


def _or_missing(axes: Axes, drawn: bool, otherwise: str = "not asked") -> None:
    if not drawn:
        axes.set_xticks([])
        axes.set_yticks([])
        axes.text(0.5, 0.5, otherwise, transform=axes.transAxes, ha="center", va="center", fontsize=9, color="#666666")
