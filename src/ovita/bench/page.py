"""The HTML page of a report, from report.html.j2, and the small pictures in it: from above, height, speed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cache
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from ovita.bench.records import Record, Rows
from ovita.errors import OvitaError, needs
from ovita.paths.scene import Frame
from ovita.paths.trajectory import Array, arc_length

if TYPE_CHECKING:
    from jinja2 import Template

WIDTH, HEIGHT, PAD = 230.0, 150.0, 14.0
BEFORE, AFTER, THING = "#8a8a8a", "#0072b2", "#d55e00"


def html(
    title: str, tables: Sequence[tuple[str, Sequence[Sequence[str]]]], panel: str, records: Sequence[Record]
) -> str:
    """Build the page; all values from the data are escaped, samples that fail come first.

    A table's first row holds its columns' names; `panel` are the figures as SVG text, or "".

    Raises:
        MissingExtra: If Jinja2 is not installed.
    """
    groups: dict[tuple[str, str, str], list[Record]] = defaultdict(list)
    for r in records:
        groups[*r.column, r.subset].append(r)
    found = {key: sorted(group, key=lambda r: r.last.passed) for key, group in groups.items()}
    drawn = panel[panel.index("<svg") :] if panel else ""
    page = template_of("ovita.bench", "report.html.j2")
    return page.render(
        title=title, tables=tables, panel=drawn, groups=found.items(), numeric=tuple("-+0123456789"), sketch=sketch
    )


@cache
def template_of(package: str, name: str) -> Template:
    """A template among the files of a package; all values that are no markup are escaped.

    Raises:
        MissingExtra: If Jinja2 is not installed.
    """
    with needs("jinja2", "plot"):
        from jinja2 import Environment
    environment = Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True)
    return environment.from_string((files(package) / name).read_text(encoding="utf-8"))


def sketch(original: Rows, adapted: Rows, scene: Mapping[str, Any]) -> str:
    """Draw rows x, y, z [m], speed [m/s] before (grey, dashed) and after (blue), with the scene's objects."""
    before, after = np.array(original, dtype=float), np.array(adapted or original, dtype=float)
    try:
        frame = Frame(str(scene.get("frame", "rfu")))
    except OvitaError:
        frame = Frame()
    right, front, up = (frame.direction(word) for word in ("right", "front", "up"))
    axes = np.stack([right, front])
    places = [(str(o["name"]), np.array([o["x"], o["y"], o["z"]], dtype=float)) for o in scene.get("objects", [])]
    things = [(name, axes @ place) for name, place in places]
    parts = [
        _above(before[:, :3] @ axes.T, after[:, :3] @ axes.T, things),
        _along("height [m]", (before, before[:, :3] @ up), (after, after[:, :3] @ up)),
        _along("speed [m/s]", (before, before[:, 3]), (after, after[:, 3])),
    ]
    inner = "".join(f'<g transform="translate({i * (WIDTH + 10):.0f} 0)">{part}</g>' for i, part in enumerate(parts))
    whole = 3 * WIDTH + 20
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {whole:.0f} {HEIGHT:.0f}" width="{whole:.0f}"'
        f' height="{HEIGHT:.0f}" role="img" aria-label="path before and after">{inner}</svg>'
    )


def _above(before: Array, after: Array, things: Sequence[tuple[str, Array]]) -> str:
    points = np.concatenate([before, after, *(place[None] for _, place in things)])
    low, high = points.min(axis=0), points.max(axis=0)
    # the title stands above the picture
    room, centre = HEIGHT - 2.6 * PAD, HEIGHT / 2 + 0.3 * PAD
    scale = min((WIDTH - 2 * PAD) / max(high[0] - low[0], 1e-9), room / max(high[1] - low[1], 1e-9))
    middle = (low + high) / 2.0

    def place(p: Array) -> Array:
        return np.stack([WIDTH / 2 + scale * (p[:, 0] - middle[0]), centre - scale * (p[:, 1] - middle[1])], axis=1)

    out = [_box("from above: right →, front ↑"), _line(place(before), BEFORE, True), _line(place(after), AFTER, False)]
    for p, color in ((place(before)[0], BEFORE), (place(after)[0], AFTER)):
        out.append(f'<circle cx="{p[0]:.1f}" cy="{p[1]:.1f}" r="3" fill="{color}"/>')
    for name, spot in things:
        x, y = place(spot[None])[0]
        side, shift = ("end", -5) if x > 0.65 * WIDTH else ("start", 5)
        out.append(
            f'<rect x="{x - 3:.1f}" y="{y - 3:.1f}" width="6" height="6" fill="{THING}" fill-opacity="0.7"/>'
            f'<text x="{x + shift:.1f}" y="{y + 3:.1f}" text-anchor="{side}">{escape(name)}</text>'
        )
    return "".join(out)


def _along(title: str, *drawn: tuple[Array, Array]) -> str:
    """Two paths, rows and a value for each, over their arc length."""
    both = np.concatenate([values for _, values in drawn])
    low, high = float(both.min()), float(both.max())
    span = max(high - low, 1e-3 * max(abs(high), 1.0))
    low, high = (low + high - span) / 2, (low + high + span) / 2
    along = [arc_length(rows[:, :3]) for rows, _ in drawn]
    longest = max(float(along[0][-1]), float(along[1][-1]), 1e-9)
    out = [_box(title)]
    for s, (_, values), color in zip(along, drawn, (BEFORE, AFTER), strict=True):
        x, y = PAD + (WIDTH - 2 * PAD) * s / longest, HEIGHT - PAD - (HEIGHT - 2.6 * PAD) * (values - low) / span
        out.append(_line(np.stack([x, y], axis=1), color, color == BEFORE))
    labels = f'<text x="3" y="{HEIGHT - 3:.0f}">{low:.3g}</text><text x="3" y="{1.7 * PAD:.0f}">{high:.3g}</text>'
    return "".join(out) + labels


def _box(title: str) -> str:
    return (
        f'<rect x="0.5" y="0.5" width="{WIDTH - 1:.0f}" height="{HEIGHT - 1:.0f}" fill="white" stroke="#ccc"/>'
        f'<text x="{WIDTH / 2:.0f}" y="11" text-anchor="middle">{escape(title)}</text>'
    )


def _line(points: Array, color: str, dashed: bool) -> str:
    text = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    dash = ' stroke-dasharray="4 3"' if dashed else ""
    return f'<polyline points="{text}" fill="none" stroke="{color}" stroke-width="1.6"{dash}/>'
