"""An interactive figure as one HTML page, drawn with plotly, that loads nothing from anywhere."""

from __future__ import annotations

import html
import json
import textwrap
from collections.abc import Callable, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from ovita.errors import needs
from ovita.paths.robot import Robot
from ovita.paths.scene import Frame, Scene, SceneObject
from ovita.paths.trajectory import Array, Trajectory
from ovita.plots import geometry
from ovita.plots.geometry import COLOURS, OBJECT_COLOURS, TRIANGLES, Extent, View

with needs("plotly", "plot"):
    import plotly.graph_objects as go
    from plotly.subplots import make_subplots

_CONFIG = {"displaylogo": False, "responsive": True, "modeBarButtonsToRemove": ["sendChartToCloud"]}

_PIXELS = 256.0, 616.0
"""About how many pixels a unit of the scene takes as the page opens: from above, and in space at depth 1."""

_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval';
 style-src 'unsafe-inline'; img-src data: blob:; font-src data:; form-action 'none'; base-uri 'none'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>
body {{ font-family: system-ui, sans-serif; color: #222; max-width: 1200px; margin: 0 auto; padding: 0.6rem 1rem; }}
h1 {{ font-size: 1.25rem; margin: 0.3rem 0; overflow-wrap: anywhere; }}
li, p {{ line-height: 1.4; overflow-wrap: anywhere; }}
p {{ color: #5f6b76; font-size: 0.9rem; }}
</style>
</head>
<body>
<h1>{title}</h1>
{figure}
{remarks}{notes}
</body>
</html>
"""


def interactive(
    original: Trajectory,
    adapted: Trajectory,
    scene: Scene,
    *,
    robot: Robot | None = None,
    proposed: Trajectory | None = None,
    title: str = "",
    notes: Sequence[str] = (),
    view: View = "auto",
    tube: Array | None = None,
) -> str:
    """Return an HTML page with a scene to turn, zoom and point at, and the speeds over time and distance below.

    Everything is inside the page; a content security policy forbids it to load anything. Title, notes and names
    are shown as plain text, whatever they contain. Notes are lines listed below, such as the plan or the explanation;
    the other arguments are those of `figure`.

    Raises:
        MissingExtra: If plotly is not installed.
    """
    paths = {"before": original, "after": adapted}
    if proposed is not None:
        paths["proposed"] = proposed
    figure: Any = make_subplots(
        rows=2,
        cols=2,
        specs=[[{"type": "scene", "colspan": 2}, None], [{"type": "xy"}, {"type": "xy"}]],
        row_heights=[0.72, 0.28],
        vertical_spacing=0.06,
    )
    shown = _draw(figure, paths, scene, list(paths.values()), view, ("time", "distance"))
    if tube is not None:
        rings = geometry.tube(adapted.positions, tube)
        x, y, z = np.moveaxis(rings, 2, 0)
        pale = {"colorscale": [[0.0, COLOURS["tube"]], [1.0, COLOURS["tube"]]], "showscale": False, "opacity": 0.35}
        told = {"hoverinfo": "skip", "name": "2 standard deviations", "showlegend": True}
        figure.add_trace(go.Surface(x=x, y=y, z=z, **pale, **told), 1, 1)
    if robot is not None and robot.workspace is not None:
        for i, line in enumerate(geometry.workspace_lines(robot.workspace, shown.lower, shown.upper)):
            style = {"color": COLOURS["workspace"], "width": 1.5}
            figure.add_trace(_line(line, style, name="workspace", legendgroup="workspace", showlegend=i == 0), 1, 1)
    figure.update_layout(height=860, margin={"l": 60, "r": 20, "t": 50, "b": 50}, updatemenus=[_buttons(figure)])
    drawing = figure.to_html(full_html=False, include_plotlyjs=True, config=_CONFIG)
    far = html.escape(", ".join(shown.left_out))
    items = "\n".join(f"<li>{html.escape(note)}</li>" for note in notes if note.strip())
    remarks = f"<p>Too far away to be shown: {far}.</p>\n" if far else ""
    listed = f"<ul>\n{items}\n</ul>" if items else ""
    return _PAGE.format(title=html.escape(title or "Before and after"), figure=drawing, remarks=remarks, notes=listed)


PLAYED = 160
"""Moments between which a page that plays a path draws straight lines."""

_COMPACT = 400.0 / 616.0
"""Size of the picture of `playable` against that of a whole page."""


def playable(
    original: Trajectory, adapted: Trajectory, scene: Scene, *, beside: Sequence[Trajectory] = ()
) -> dict[str, Any]:
    """Return what a page needs to draw both paths in their scene, the speeds over time below, and to play them.

    With the paths of other pictures of the same scene `beside`, all show the same part of it, the same way.

    Returns:
        JSON values: "figure" for plotly, "times" (M,) [s], "before" and "after" (M, 4), where the robot is then (x, y,
        z [m]) and its speed [m/s], and "dots", the numbers of the four traces that show it: before and after in the
        scene, then in the chart. "left_out" names objects too far away to be shown.
    """
    paths = {"before": original, "after": adapted}
    together = [*paths.values(), *beside]
    figure: Any = make_subplots(
        rows=2, cols=1, specs=[[{"type": "scene"}], [{"type": "xy"}]], row_heights=[0.76, 0.24], vertical_spacing=0.04
    )
    shown = _draw(figure, paths, scene, together, "auto", ("time",), _COMPACT)
    times = np.linspace(0.0, max(path.duration for path in paths.values()), PLAYED)
    states = {word: path.at(times) for word, path in paths.items()}
    played = {word: np.column_stack([at.positions, at.speeds]).round(5) for word, at in states.items()}
    dots = _add_dots(figure, {word: rows[0] for word, rows in played.items()})
    figure.update_layout(autosize=True, margin={"l": 48, "r": 8, "t": 26, "b": 36})
    moving = {"times": times.tolist(), **{word: rows.tolist() for word, rows in played.items()}, "dots": dots}
    return {"figure": json.loads(figure.to_json()), **moving, "left_out": list(shown.left_out)}


def _draw(
    figure: Any,
    paths: dict[str, Trajectory],
    scene: Scene,
    together: Sequence[Trajectory],
    view: View,
    charts: Sequence[str],
    size: float = 1.0,
) -> Extent:
    """Draw paths in their scene and their speeds in charts, over what is named; what is shown so that all fit."""
    shown = geometry.extent(together, scene)
    for word, path in paths.items():
        _add_path(figure, word, path, charts)
    for item, colour in zip(shown.shown, cycle(OBJECT_COLOURS), strict=False):
        _add_object(figure, item, colour, 0.012 * float(shown.size.max()))
    flat = view == "top" or (view == "auto" and geometry.planar(together))
    figure.update_layout(
        template="plotly_white",
        legend={"orientation": "h", "x": 0.5, "xanchor": "center", "y": 1.0, "yanchor": "bottom"},
        scene=_axes(shown, scene.frame, flat, list(paths.values()), size),
        hoverlabel={"namelength": -1},
    )
    for column, chart in enumerate(charts, 1):
        unit = {"time": "s", "distance": "m"}[chart]
        figure.update_xaxes(title_text=f"{chart} [{unit}]", row=2, col=column)
        figure.update_yaxes(title_text="speed [m/s]", rangemode="tozero", row=2, col=column)
    return shown


def _add_dots(figure: Any, rows: dict[str, Array]) -> list[int]:
    """The robot in the scene and in the chart, before and after; return the numbers of the traces."""
    first = len(figure.data)
    quiet = {"mode": "markers", "showlegend": False, "hoverinfo": "skip"}
    for word, (x, y, z, _) in rows.items():
        marker = {"size": 6, "color": COLOURS[word], "line": {"color": "#222", "width": 2}}
        figure.add_trace(go.Scatter3d(x=[x], y=[y], z=[z], marker=marker, **quiet), 1, 1)
    for word, (*_, speed) in rows.items():
        marker = {"size": 10, "color": COLOURS[word], "line": {"color": "#222", "width": 1}}
        figure.add_trace(go.Scatter(x=[0.0], y=[speed], marker=marker, **quiet), 2, 1)
    return list(range(first, len(figure.data)))


def plain(text: str) -> str:
    """Text for plotly, which takes <b> and <a> for markup: angle brackets become look-alikes."""
    return text.replace("<", "\u2039").replace(">", "\u203a").replace("&", "\uff06")


def _add_path(figure: Any, word: str, path: Trajectory, charts: Sequence[str]) -> None:
    times, distance = path.times, path.arc_length
    data = np.column_stack([np.arange(len(path)), path.speeds, times, distance])
    told = (
        f"{word}: waypoint %{{customdata[0]:.0f}}<br>speed %{{customdata[1]:.3g}} m/s"
        "<br>time %{customdata[2]:.3g} s<br>distance %{customdata[3]:.3g} m"
    )
    name, wide, thin, opacity, size, dash = _LOOKS[word]
    style = {"color": COLOURS[word], "width": wide, **dash}
    common = {"customdata": data, "legendgroup": word, "meta": word, "opacity": opacity}
    dots = {"size": size, "color": COLOURS[word]}
    place = "<br>x %{x:.3f}, y %{y:.3f}, z %{z:.3f} m<extra></extra>"
    shown: dict[str, Any] = {
        "mode": "lines+markers",
        "name": name,
        "marker": dots,
        "hovertemplate": told + place,
        **common,
    }
    figure.add_trace(_line(path.positions, style, **shown), 1, 1)
    shown = {"mode": "lines", "line": {**style, "width": thin}, "showlegend": False, **common}
    for column, chart in enumerate(charts, 1):
        across = times if chart == "time" else distance
        speeds = go.Scatter(x=across, y=path.speeds, hovertemplate=told + "<extra></extra>", **shown)
        figure.add_trace(speeds, 2, column)
    if word != "proposed":
        _add_ends(figure, word, path, data, told + place)


_LOOKS: dict[str, tuple[str, int, int, float, float, dict[str, str]]] = {
    "before": ("before", 7, 4, 0.6, 3.5, {}),
    "after": ("after", 4, 2, 1.0, 2.5, {}),
    "proposed": ("proposed (before limits)", 3, 2, 1.0, 3.5, {"dash": "dot"}),
}
"""Of each path its name, widths in the scene and in a chart, opacity, size of its dots, and dashes."""


def _add_ends(figure: Any, word: str, path: Trajectory, data: Array, told: str) -> None:
    for end, index, symbol in (("start", 0, "circle"), ("goal", -1, "diamond")):
        x, y, z = path.positions[index]
        marker = {"color": COLOURS[end], "size": 6 if word == "after" else 4, "symbol": symbol}
        shown = {"name": end, "meta": word, "showlegend": word == "after", "legendgroup": end, "marker": marker}
        told_of = {"customdata": data[[index]], "hovertemplate": f"{end} {told}"}
        figure.add_trace(go.Scatter3d(x=[x], y=[y], z=[z], mode="markers", **shown, **told_of), 1, 1)


def _add_object(figure: Any, item: SceneObject, colour: str, least: float) -> None:
    points = geometry.corners(item, least)
    size = " x ".join(f"{edge:.3g}" for edge in item.size)
    name = plain(item.name)
    told = f"{name}<br>centre %{{customdata}}<br>{size} m<extra></extra>"
    centre = ", ".join(f"{v:.3f}" for v in item.position)
    (i, j, k), (x, y, z) = TRIANGLES.T, points.T
    mesh = go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color=colour, opacity=0.4, flatshading=True, meta="object",
        customdata=[centre + " m"] * 8, hovertemplate=told,
    )  # fmt: skip
    figure.add_trace(mesh, 1, 1)
    around = np.pad(points[geometry.FACES[:, [0, 1, 2, 3, 0]]], ((0, 0), (0, 1), (0, 0)), constant_values=np.nan)
    edges = around.reshape(-1, 3)
    figure.add_trace(_line(edges, {"color": colour, "width": 2}, showlegend=False, hoverinfo="skip"), 1, 1)


def _line(points: Array, style: dict[str, Any], *, mode: str = "lines", **more: Any) -> Any:
    x, y, z = points.T
    if "hovertemplate" not in more:
        more["hoverinfo"] = "skip"
    return go.Scatter3d(x=x, y=y, z=z, mode=mode, line=style, **more)


def _axes(shown: Extent, frame: Frame, flat: bool, paths: Sequence[Trajectory], size: float = 1.0) -> dict[str, Any]:
    down = frame.direction("up")[2] < 0
    across, along = geometry.axis_of(frame, "right")[0], geometry.axis_of(frame, "front")[0]
    axes: dict[str, Any] = {}
    for axis, name in enumerate("xyz"):
        limits = [float(shown.lower[axis]), float(shown.upper[axis])]
        # turned upside down about x, so that it stays right-handed with z pointing down
        axes[f"{name}axis"] = {
            "title": {"text": f"{name} [m] ({geometry.axis_word(frame, axis)})"},
            "range": limits[::-1] if down and axis > 0 else limits,
            "visible": not (flat and axis == 2),
        }
    ratio = shown.size / shown.size.max()
    if flat:
        ratio = ratio * min(1.55 / ratio[along], 3.6 / ratio[across])
    ratio = ratio * (1.0 if size == 1.0 else 0.86)  # the names of axes need room in a small picture
    eye, up = np.array([0.8, -1.45, 0.75] if along == 1 else [-1.45, -0.8, 0.75]), np.array([0.0, 0.0, 1.0])
    if flat:
        eye, up = np.array([0.0, 0.0, 1.6]), np.eye(3)[along]
    axes["aspectmode"], axes["aspectratio"] = "manual", _xyz(ratio)
    center = np.array([0.0, 0.0, 0.0 if flat else -0.1])
    axes["camera"] = {"eye": _xyz(eye), "up": _xyz(up), "center": _xyz(center)}
    if flat:
        axes["camera"]["projection"] = {"type": "orthographic"}
    mirrored = np.array([1.0, -1.0, -1.0]) if down else np.ones(3)
    middle, scale = (shown.lower + shown.upper) / 2.0, ratio / shown.size * mirrored
    ahead = (center - eye) / np.linalg.norm(center - eye)
    right = np.cross(ahead, up) / np.linalg.norm(np.cross(ahead, up))
    screen = np.stack([right, np.cross(right, ahead)])

    def seen(points: Array) -> Array:
        from_eye = (points - middle) * scale - eye
        near = _PIXELS[0] if flat else _PIXELS[1] / (from_eye @ ahead)[:, None]
        return np.asarray(size * (from_eye @ screen.T) * near)

    axes["annotations"] = _names(shown, seen, paths, size)
    return axes


def _names(
    shown: Extent, seen: Callable[[Array], Array], paths: Sequence[Trajectory], size: float = 1.0
) -> list[dict[str, Any]]:
    """Names of the objects, placed so that they do not cover each other as the page opens.

    Points (K, 3) [m] are `seen` then at (K, 2) [pixels] from the middle.
    """
    texts = [
        plain(textwrap.shorten(item.name, 40, placeholder="...") or item.name[:37] + "...") for item in shown.shown
    ]
    projected = [seen(geometry.corners(item)) for item in shown.shown]
    boxes = [(p.min(axis=0), p.max(axis=0)) for p in projected]
    sizes = [(7.0 * len(text) + 8.0, 18.0) for text in texts]
    area = size * np.array([-500.0, -230.0]), size * np.array([500.0, 230.0])
    placed = geometry.place_labels(boxes, sizes, seen(geometry.busy(paths)), area)
    told = []
    for item, text, spot, colour in zip(shown.shown, texts, placed, cycle(OBJECT_COLOURS), strict=False):
        x, y = spot.middle - seen(item.position[None])[0]
        place = {**_xyz(item.position), "ax": float(x), "ay": float(-y)}
        told.append({**_NAME, **place, "text": text, "arrowcolor": colour, "bordercolor": colour})
    return told


_NAME: dict[str, Any] = {
    "xanchor": "center",
    "yanchor": "middle",
    "arrowhead": 0,
    "arrowwidth": 1,
    "borderpad": 1,
    "bgcolor": "rgba(255,255,255,0.8)",
    "font": {"size": 12, "color": "#222"},
}


def _xyz(values: Array) -> dict[str, float]:
    return dict(zip("xyz", values.tolist(), strict=True))


def _buttons(figure: Any) -> dict[str, Any]:
    def button(label: str, hidden: tuple[str, ...]) -> dict[str, Any]:
        return {"label": label, "method": "restyle", "args": ["visible", [t.meta not in hidden for t in figure.data]]}

    buttons = [button("both", ()), button("before", ("after", "proposed")), button("after", ("before", "proposed"))]
    place = {"x": 0.0, "xanchor": "left", "y": 1.0, "yanchor": "top"}
    return {"type": "buttons", "direction": "right", **place, "buttons": buttons}
