"""Small line charts as SVG text, for the panels: speed over time and clearance over the path, before and after."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots.geometry import COLOURS

_WIDTH, _HEIGHT = 360.0, 126.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 38.0, 8.0, 8.0, 30.0
_POINTS = 300


@dataclass(frozen=True)
class Series:
    """One line of a chart.

    Args:
        name: For the legend and for reading devices.
        colour: As in CSS.
        x: (N,).
        y: (N,).
        dashed: Whether to draw it dashed.
    """

    name: str
    colour: str
    x: Array
    y: Array
    dashed: bool = False


def speed_chart(original: Trajectory, adapted: Trajectory | None) -> str:
    """Speed over time [m/s over s]."""
    lines = [Series("before", COLOURS["before"], original.times, original.speeds)]
    if adapted is not None:
        lines.append(Series("after", COLOURS["after"], adapted.times, adapted.speeds))
    return chart(lines, "time [s]", "speed [m/s]", floor=0.0)


def clearance_chart(original: Trajectory, adapted: Trajectory | None, scene: Scene, margin: float) -> str:
    """Distance to the nearest object over the distance travelled [m over m], with the margin; "" without objects."""
    if not len(scene):
        return ""
    lines = [Series("before", COLOURS["before"], original.arc_length, clearance(original.positions, scene))]
    if adapted is not None:
        lines.append(Series("after", COLOURS["after"], adapted.arc_length, clearance(adapted.positions, scene)))
    far = max(float(line.x[-1]) for line in lines)
    lines.append(
        Series(f"margin {margin:g} m", "#8a97a3", np.array([0.0, far]), np.array([margin, margin]), dashed=True)
    )
    return chart(lines, "distance travelled [m]", "clearance [m]")


def clearance(points: Array, scene: Scene) -> Array:
    """Distance of points (N, 3) [m] to the nearest object's surface, (N,) [m]; negative inside."""
    return np.asarray(np.min([item.clearance(points) for item in scene], axis=0))


def chart(lines: Sequence[Series], x_label: str, y_label: str, *, floor: float | None = None) -> str:
    """Lines as one SVG picture with axes and a legend.

    Args:
        lines: What to draw, the last on top.
        x_label: With the unit.
        y_label: With the unit.
        floor: Where the vertical axis begins, or None for the lowest value.
    """
    x_high = max(max(float(line.x.max()) for line in lines), 1e-9)
    y_low = min(float(line.y.min()) for line in lines) if floor is None else floor
    y_high = max(max(float(line.y.max()) for line in lines), y_low + 1e-6)
    y_high += 0.06 * (y_high - y_low)
    y_low -= 0.0 if floor is not None else 0.06 * (y_high - y_low)

    def place(x: Array, y: Array) -> Array:
        across = _LEFT + x / x_high * (_WIDTH - _LEFT - _RIGHT)
        return np.stack([across, _HEIGHT - _BOTTOM - (y - y_low) / (y_high - y_low) * _inner()], axis=1)

    parts = [f'<svg viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{html.escape(y_label)}">']
    style = 'font-size="9.5" fill="#5b6b7a" font-family="system-ui,sans-serif"'
    for value in ticks(y_low, y_high, 4):
        y = float(place(np.zeros(1), np.array([value]))[0, 1])
        parts.append(f'<path d="M{_LEFT:g} {y:.1f}H{_WIDTH - _RIGHT:g}" stroke="#e3e9ee"/>')
        parts.append(f'<text x="{_LEFT - 5:g}" y="{y + 3:.1f}" text-anchor="end" {style}>{_short(value)}</text>')
    base = _HEIGHT - _BOTTOM
    for value in ticks(0.0, x_high, 6):
        x = float(place(np.array([value]), np.zeros(1))[0, 0])
        parts.append(f'<text x="{x:.1f}" y="{base + 12:g}" text-anchor="middle" {style}>{_short(value)}</text>')
    parts.append(f'<path d="M{_LEFT:g} {base:g}H{_WIDTH - _RIGHT:g}" stroke="#b9c5cf"/>')
    for i, line in enumerate(lines):
        kept = thinned(line.y)
        points = place(line.x[kept], line.y[kept])
        path = "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        dash = ' stroke-dasharray="4 3"' if line.dashed else ""
        width = 1.0 if line.dashed else 2.8 if i == 0 and len(lines) > 1 and not lines[1].dashed else 1.6
        parts.append(
            f'<path d="{path}" fill="none" stroke="{line.colour}" stroke-width="{width:g}"'
            f' stroke-linejoin="round"{dash}><title>{html.escape(line.name)}</title></path>'
        )
    middle = _HEIGHT - 4
    parts.append(
        f'<text x="{_WIDTH - _RIGHT:g}" y="{middle:g}" text-anchor="end" {style}>{html.escape(x_label)}</text>'
    )
    at = _LEFT
    for line in lines:
        parts.append(f'<path d="M{at:g} {middle - 3:g}h12" stroke="{line.colour}" stroke-width="2"/>')
        parts.append(f'<text x="{at + 16:g}" y="{middle:g}" {style}>{html.escape(line.name)}</text>')
        at += 26 + 5.2 * len(line.name)
    return "".join(parts) + "</svg>"


def ticks(low: float, high: float, most: int) -> list[float]:
    """At most `most` round values from `low` to `high`."""
    rough = (high - low) / most
    if not rough > 0:
        return [low]
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(float(s * power) for s in (1, 2, 2.5, 5, 10, 20) if s * power >= rough)
    first = int(np.ceil(low / step - 1e-9))
    return [k * step for k in range(first, int(np.floor(high / step + 1e-9)) + 1)]


def thinned(values: Array) -> NDArray[np.int_]:
    """Indices of at most some hundred values, with the first, the last, the lowest and the highest."""
    if len(values) <= _POINTS:
        return np.arange(len(values))
    even = np.linspace(0, len(values) - 1, _POINTS).round().astype(int)
    return np.unique(np.concatenate([even, [int(values.argmin()), int(values.argmax())]]))


def _inner() -> float:
    return _HEIGHT - _TOP - _BOTTOM


def _short(value: float) -> str:
    return f"{value:.4g}" if abs(value) > 1e-12 else "0"
