"""What one tab shows in space: lines, objects, limits, axes and playheads, as arrays and as viser's nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovita.dialogue.session import Session
from ovita.limits.problem import TOLERANCE
from ovita.paths.robot import Robot
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Array, Trajectory, interpolate
from ovita.plots import geometry
from ovita.plots.geometry import COLOURS, OBJECT_COLOURS
from ovita.result import Adaptation

GHOST = "#eeb1ab"
STROKE = "#7b1fa2"
RULER = "#00897b"
VIOLATION = "#7a3cff"  # the crimson of printed figures is too close to the red line
SELECTED = "#ffb300"
DARK = COLOURS | {"before": "#6fa5f5", "after": "#ff7b72", "goal": "#e3eaf0"}
"""Colours before a dark background: what is blue, red and black in print is lighter."""

_WIDE, _THIN = 4.5, 2.0
_OLD = ""  # what the original's ends are called beyond "start" and "goal"
_FOV = 0.75
VIEW_DIRECTIONS = {
    "fit": (-1.0, 0.36, 0.68),
    "top": (-0.02, 0.0, 1.0),
    "front": (1.0, 0.0, 0.12),
    "side": (0.0, 1.0, 0.12),
}
"""From where the camera looks: shares of front, right and up."""

_NONE = np.zeros((0, 2, 3), dtype=np.float32)  # no segments
_CUBE = np.array(list(product((-1, 1), repeat=3)), dtype=np.float32)
_EDGES = [(i, j) for i, j in combinations(range(8), 2) if np.abs(_CUBE[i] - _CUBE[j]).sum() == 2]


class SceneView:
    """The scene of one tab, in viser's handle of it.

    What is going to cover the window on both sides is `covered` [pixels] wide; later the browser's own word for the
    size of the picture counts.
    """

    def __init__(self, client: Any, covered: float = 0.0) -> None:
        self.client, self.api, self.covered = client, client.scene, covered
        self.shown = Shown()
        self.dark, self.following, self._view = False, False, "fit"
        self.stage: ViewBounds | None = None
        self.objects: dict[str, Any] = {}
        self._drawn: tuple[Any, ...] = ()
        self._looked: tuple[Array, float] | None = None
        self._arrived = False
        self._seen: ViewBounds | None = None
        self._lines: dict[str, Any] = {}
        self._labels: list[Any] = []
        self._end_labels: dict[str, Any] = {}
        self._last: dict[str, tuple[Any, ...]] = {}  # what each line was drawn from
        self._margins: list[Any] = []
        self._ruler_labels: list[Any] = []
        self.picked: Callable[[str], None] = lambda name: None

    def draw(self, session: Session) -> None:
        """Show a session; objects and axes are made anew only where the scene or the limits changed."""
        paths = [session.original, session.current]
        situation = (session.scene, session.robot, session.original)
        with self.client.atomic():
            if not self._drawn or any(a is not b for a, b in zip(situation, self._drawn, strict=True)):
                fresh = not self._drawn
                self._drawn = situation
                self._build(paths, session.scene, session.robot, fresh=fresh)
            self.draw_lines(session)

    def reset(self) -> None:
        """Forget everything, for a session of another size."""
        self.api.reset()
        shown, picked, dark = self.shown, self.picked, self.dark
        self.__init__(self.client, self.covered)  # type: ignore[misc]
        self.shown, self.picked, self.dark = shown, picked, dark

    @property
    def palette(self) -> dict[str, str]:
        """Colours by name, for the background as it is."""
        return DARK if self.dark else COLOURS

    def draw_lines(self, session: Session) -> None:
        """Show the lines as they are now."""
        assert self.stage is not None
        colours = self.palette
        result, original = session.adaptation, session.original
        adapted = None if result is None else session.current
        pace = self.pace(session) if self.shown.speeds else None
        self._line("original", original, colours["before"], pace if adapted is None else None)
        self._line("adapted", adapted, colours["after"], pace)
        self._other_lines(session)
        pending = session.pending.proposal if session.pending is not None else None
        waiting = None if pending is None else pending.adapted
        self._line("proposal", waiting, colours["waiting"])
        bad = violated(result) if result is not None else _NONE
        self._segments("violated", bad, plain_colours(len(bad), VIOLATION), 7.0)
        self._arrows("original", original, colours["before"])
        self._arrows("adapted", adapted, colours["after"])
        self._points("waypoints", session.current.positions if self.shown.waypoints else None)
        self._ends(original, adapted, waiting)

    def _other_lines(self, session: Session) -> None:
        """The line one turn ago, and as the program proposed it."""
        result, steps = session.adaptation, session.steps
        before = steps[-2].adaptation.adapted if self.shown.ghost and len(steps) > 1 else None
        self._line("ghost", before, GHOST, width=_THIN)
        proposed = result.proposed if result is not None and result.proposed != result.adapted else None
        self._line("proposed", proposed, self.palette["proposed"], width=_THIN)

    @staticmethod
    def pace(session: Session) -> tuple[float, float]:
        """The lowest and the highest speed [m/s], between which the colours of speeds lie."""
        speeds = np.concatenate([session.original.speeds, session.current.speeds])
        return float(speeds.min()), float(speeds.max())

    def redraw(self, session: Session) -> None:
        """Draw objects, floor and lines anew, such as for another background."""
        self._last = {}
        with self.client.atomic():
            for key in [key for key in self._lines if key in self._end_labels or key.startswith("arrows ")]:
                self._lines.pop(key).remove()
            self._end_labels = {}
            self._build([session.original, session.current], session.scene, session.robot, fresh=False)
            self.draw_lines(session)

    def follow(self, on: bool) -> None:
        """Have the camera go along with what moves, or stay."""
        self.following = on

    def keep_in_view(self, place: Array) -> None:
        """Move the camera so that it looks at a place (3,) [m] from where it is to that, if it follows."""
        camera = self.client.camera
        if self.following and self.stage is not None:
            by = place - camera.look_at
            if float(np.linalg.norm(by)) > 0.01 * self.stage.size:
                self._looked = None
                camera.position, camera.look_at = camera.position + by, place

    def look(self, session: Session, view: str = "fit") -> None:
        """Frame everything with the camera, from one of `VIEW_DIRECTIONS`."""
        self._view = view
        self._seen = stage = ViewBounds.of([session.original, session.current], session.scene)
        camera, frame, aspect = self.client.camera, session.scene.frame, self._aspect()
        position, target = stage.camera(frame, aspect, _FOV, view)
        self._looked, self._arrived = (position, aspect), False
        camera.fov = _FOV
        camera.position, camera.look_at = position, target
        camera.up_direction = frame.direction("up")

    def look_again(self, session: Session) -> None:
        """Look anew where the picture or what is in it got another shape, unless the person moved the camera."""
        if self._looked is None or self._seen is None:
            return
        position, aspect = self._looked
        there = bool(np.linalg.norm(self.client.camera.position - position) <= 1e-2 * self._seen.size)
        if self._arrived and not there:
            self._looked = None
            return
        self._arrived = self._arrived or there  # until then the browser tells of the camera as it was before
        now = ViewBounds.of([session.original, session.current], session.scene)
        grown = np.abs(np.stack([now.lower - self._seen.lower, now.upper - self._seen.upper])).max()
        if abs(self._aspect() / aspect - 1.0) > 0.02 or grown > 0.08 * self._seen.size:
            self.look(session, self._view)

    def mark(self, place: Array | None) -> None:
        """Ring a waypoint, such as the one that is going to be pinned."""
        node = self._lines.get("mark")
        if node is None:
            radius = 0.018 * (self.stage.size if self.stage else 1.0)
            node = self._lines["mark"] = self.api.add_icosphere("/mark", radius, (255, 170, 0), subdivisions=2)
        node.visible = place is not None
        if place is not None:
            node.position = place

    def pins(self, places: Array) -> None:
        """Show where waypoints are pinned, (K, 3) [m]."""
        self._points("pins", places if len(places) else None, colour=(255, 140, 0), scale=2.4)

    def draw_selected(self, path: Array) -> None:
        """Mark a part (N, 3) [m] of the line that a person selected; none where it has no segment."""
        self._plain("selected", path, SELECTED, 2.2 * _WIDE)

    def draw_stroke(self, path: Array) -> None:
        """Show a line (N, 3) [m] that is drawn by hand; none where it has no segment."""
        self._plain("pen", path, STROKE, _WIDE)

    def draw_ruler(self, ends: Array | None, names: Sequence[str] = ()) -> None:
        """Show a line between two places (2, 3) [m] with their names and its length; None takes it away."""
        self._plain("ruler", np.zeros((0, 3)) if ends is None else ends, RULER, _WIDE)
        for node in self._ruler_labels:
            node.remove()
        places = [] if ends is None else [*ends, ends.mean(axis=0)]
        self._ruler_labels = [
            self.api.add_label(f"/ruler/{i}", name, position=place, anchor="top-center", font_screen_scale=0.9)
            for i, (name, place) in enumerate(zip(names, places, strict=False))
        ]

    def draw_tube(self, path: Array, covariance: Array | None) -> None:
        """Show two standard deviations around a path (N, 3) [m]; covariance as in `geometry.tube`, None for none."""
        node = self._lines.pop("tube", None)
        if node is not None:
            node.remove()
        if covariance is not None:
            vertices, faces = mesh(geometry.tube(path, covariance))
            self._lines["tube"] = self.api.add_mesh_simple(
                "/tube", vertices, faces, color=rgb(COLOURS["tube"]), opacity=0.3, side="double", cast_shadow=False
            )

    def update_shown(self, session: Session) -> None:
        """Apply the visibility switches."""
        for node in self._labels:
            node.visible = self.shown.labels
        for node in self._margins:
            node.visible = self.shown.margins
        if "workspace" in self._lines:
            self._lines["workspace"].visible = self.shown.workspace and session.robot.workspace is not None
        self.draw_lines(session)

    def _aspect(self) -> float:
        """Width by height of the picture, before the browser knows of the panels without what they cover."""
        camera = self.client.camera
        try:
            free = max(float(camera.image_width) - self.covered, 0.3 * float(camera.image_width))
            return max(free / float(camera.image_height), 0.2)
        except (AssertionError, ZeroDivisionError):
            return 0.8

    def _build(self, paths: list[Trajectory], scene: Scene, robot: Robot, *, fresh: bool) -> None:
        self.stage = stage = ViewBounds.of(paths, scene)
        up = scene.frame.direction("up")
        if fresh:
            self.api.set_up_direction(tuple(up))
        for node in (*self._labels, *self.objects.values()):
            node.remove()
        self.objects, self._labels, self._margins = {}, [], []
        step = grid_step(stage.size)
        middle, extent = stage.middle, stage.size * 2.4
        self.api.add_grid(
            "/grid", extent, extent, plane="xy", cell_size=step, section_size=5 * step,
            cell_color=(62, 72, 82) if self.dark else (226, 231, 236),
            section_color=(98, 112, 125) if self.dark else (203, 211, 219),
            position=(middle[0], middle[1], stage.ground - 0.002 * stage.size * up[2]), shadow_opacity=0.12,
        )  # fmt: skip
        self._axes(scene, stage)
        for i, item in enumerate(scene):
            self._object(i, item, robot)
        self._workspace(robot, stage)

    def _object(self, i: int, item: Any, robot: Robot) -> None:
        colour = rgb(OBJECT_COLOURS[i % len(OBJECT_COLOURS)])
        name = f"/objects/{i}"
        holder = self.api.add_frame(name, show_axes=False, position=item.position, wxyz=item.orientation)
        size = np.maximum(item.size, 1e-3)
        body = self.api.add_box(f"{name}/body", colour, tuple(size), opacity=0.62)
        body.on_click(lambda _: self.picked(item.name))
        edge = tuple(int(c + 0.45 * (255 - c) if self.dark else c * 0.62) for c in colour)
        self.api.add_line_segments(
            f"{name}/edges", edges(size), np.array(edge, dtype=np.uint8), thickness=1.5, thickness_units="screen"
        )
        if robot.obstacle_margin > 0:
            around = self.api.add_line_segments(
                f"{name}/margin", edges(size + 2 * robot.obstacle_margin), np.array((255, 152, 0), np.uint8),
                thickness=1.0, thickness_units="screen", visible=self.shown.margins,
            )  # fmt: skip
            self._margins.append(around)
        assert self.stage is not None
        top = float((np.abs(item.rotation) @ size)[2]) / 2.0 + 0.02 * self.stage.size
        self._labels.append(self._label(f"/names/{i}", item.name, item.position + top * self.stage.up))
        self.objects[item.name] = holder

    def _label(self, name: str, text: str, place: Array) -> Any:
        short = text if len(text) <= 32 else text[:31] + "\u2026"
        return self.api.add_label(
            name, short, position=place, anchor="bottom-center", font_screen_scale=1.0, visible=self.shown.labels
        )

    def _axes(self, scene: Scene, stage: ViewBounds) -> None:
        corner = stage.corner(scene.frame)
        length = 0.14 * stage.size
        for word, colour in (("right", (198, 40, 40)), ("front", (46, 125, 50)), ("up", (21, 101, 192))):
            tip = corner + length * scene.frame.direction(word)
            self.api.add_arrows(
                f"/axes/{word}", np.array([[corner, tip]]), np.array(colour, dtype=np.uint8),
                shaft_radius=0.03 * length, head_radius=0.08 * length, head_length=0.22 * length,
            )  # fmt: skip
            beyond = tip + 0.03 * stage.size * scene.frame.direction(word)
            self._labels.append(self._label(f"/axis-names/{word}", word, beyond))
        told = f"grid {grid_step(stage.size):g} m"
        aside = corner - 0.6 * length * scene.frame.direction("front")
        self._labels.append(self._label("/grid-scale", told, aside))

    def _workspace(self, robot: Robot, stage: ViewBounds) -> None:
        ends, lines = (stage.middle - 8.0 * stage.size, stage.middle + 8.0 * stage.size), robot.workspace
        found = [] if lines is None else [segments(line) for line in geometry.workspace_lines(lines, *ends)]
        pairs = np.concatenate([_NONE, *found])
        pairs = pairs[np.isfinite(pairs).all(axis=(1, 2))]
        colours = plain_colours(len(pairs), COLOURS["workspace"])
        self._segments("workspace", pairs, colours, 1.2, visible=self.shown.workspace)

    def _line(
        self,
        name: str,
        path: Trajectory | None,
        colour: str,
        pace: tuple[float, float] | None = None,
        *,
        width: float = _WIDE,
    ) -> None:
        if not self._another(name, path, colour, pace):
            return
        pairs = _NONE if path is None else segments(path.positions)
        colours = speed_colours(path.speeds, *pace) if path is not None and pace else plain_colours(len(pairs), colour)
        self._segments(name, pairs, colours, width)

    def _another(self, name: str, path: Trajectory | None, *looks: Any) -> bool:
        """Whether a line is not drawn like this already: one that stays is not sent again while a knob turns."""
        last = self._last.get(name, (None,))
        self._last[name] = (path, *looks)
        return path is None or last[0] is not path or last[1:] != looks

    def _plain(self, name: str, path: Array, colour: str, width: float) -> None:
        """A line (N, 3) of one colour; none where it has no segment."""
        pairs = segments(path)
        self._segments(name, pairs, plain_colours(len(pairs), colour), width)

    def _segments(self, name: str, pairs: Array | Any, colours: Any, width: float, *, visible: bool = True) -> None:
        node = self._lines.get(name)
        if not len(pairs):
            if node is not None:
                node.visible = False
            return
        if node is None:
            self._lines[name] = self.api.add_line_segments(
                f"/lines/{name}", pairs, colours, thickness=width, thickness_units="screen", visible=visible
            )
            return
        node.points, node.colors = np.asarray(pairs, dtype=np.float32), np.asarray(colours, dtype=np.uint8)
        node.visible = visible

    def _arrows(self, name: str, path: Trajectory | None, colour: str) -> None:
        assert self.stage is not None
        if not self._another(f"arrows {name}", path, colour):
            return
        size, key = self.stage.size, f"arrows {name}"
        pairs = arrows(path, 0.05 * size) if path is not None else _NONE
        node = self._lines.pop(key, None)
        if node is not None and len(node.points) == len(pairs):
            node.points, node.visible = pairs, True
            self._lines[key] = node
            return
        if node is not None:
            node.remove()
        if len(pairs):
            self._lines[key] = self.api.add_arrows(
                f"/arrows/{name}", pairs, plain_colours(1, colour)[0, 0],
                shaft_radius=0.003 * size, head_radius=0.014 * size, head_length=0.035 * size,
            )  # fmt: skip

    def _points(self, name: str, places: Array | None, colour: Any = (60, 60, 60), scale: float = 1.0) -> None:
        node = self._lines.pop(name, None)
        if node is not None:
            node.remove()
        if places is not None and self.stage is not None:
            gaps = np.linalg.norm(np.diff(places, axis=0), axis=1)
            most = 0.5 * float(np.median(gaps)) if len(gaps) and scale == 1 else 1.0
            size = scale * min(0.007 * self.stage.size, most)
            self._lines[name] = self.api.add_point_cloud(
                f"/points/{name}", np.asarray(places, dtype=np.float32), np.array(colour, dtype=np.uint8),
                point_size=size, point_shape="circle", precision="float32",
            )  # fmt: skip

    def _ends(self, original: Trajectory, adapted: Trajectory | None, proposal: Trajectory | None) -> None:
        assert self.stage is not None
        size = 0.016 * self.stage.size
        for owner, path in ((_OLD, original), ("new ", adapted), ("proposed ", proposal)):
            for which, index in (("start", 0), ("goal", -1)):
                key = f"{owner}{which}"
                if path is not None:
                    if key not in self._lines:
                        self._end(key, which, size, path.positions[index])
                    apart = float(np.linalg.norm(path.positions[index] - original.positions[index]))
                    self._end_labels[key].visible = self.shown.labels and (owner == _OLD or apart > 1e-3)
                    self._lines[key].position = path.positions[index]
                if key in self._lines:
                    self._lines[key].visible = path is not None and path.length > 0.0  # there may be no trajectory yet

    def _end(self, key: str, which: str, size: float, place: Array) -> None:
        """Make the ball of a start or the box of a goal, with its name."""
        assert self.stage is not None
        colour = rgb(self.palette[which])
        if which == "start":
            self._lines[key] = self.api.add_icosphere(f"/ends/{key}", size, colour, subdivisions=2, position=place)
        else:
            self._lines[key] = self.api.add_box(f"/ends/{key}", colour, (1.7 * size,) * 3, position=place)
        self._end_labels[key] = self._label(f"/ends/{key}/name", key, 1.4 * size * self.stage.up)


Colours = NDArray[np.uint8]

_RAMP = np.array([[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 200, 37]], dtype=float)
_FILL = 0.9
RAMP_CSS = "linear-gradient(90deg," + ",".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in _RAMP) + ")"
"""The colours of speeds, slow to fast."""


def rgb(colour: str) -> tuple[int, int, int]:
    """A colour such as "#1f5fbf" as three numbers."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def segments(points: Array) -> NDArray[np.float32]:
    """A polyline (N, 3) as segments (N-1, 2, 3)."""
    return np.asarray(np.stack([points[:-1], points[1:]], axis=1), dtype=np.float32)


def plain_colours(count: int, colour: str) -> Colours:
    """One colour for segments, (count, 2, 3)."""
    return np.broadcast_to(_linear(np.array(rgb(colour), dtype=float)), (count, 2, 3)).copy()


def speed_colours(speeds: Array, lowest: float, highest: float) -> Colours:
    """Colours of segments by the speeds (N,) of their ends, (N-1, 2, 3)."""
    share = np.clip((speeds - lowest) / max(highest - lowest, 1e-9), 0.0, 1.0)
    colours = _linear(interpolate(_RAMP, share * (len(_RAMP) - 1)))
    return np.stack([colours[:-1], colours[1:]], axis=1)


def _linear(colours: Array) -> Colours:
    """Colours as the page's renderer takes them at the ends of lines: as amounts of light."""
    return np.asarray(np.round((colours / 255.0) ** 2.2 * 255.0), dtype=np.uint8)


def arrows(path: Trajectory, length: float, count: int = 6) -> NDArray[np.float32]:
    """Short arrows (K, 2, 3) along a path, spread evenly over its length; none where it has no length."""
    if path.length <= 0.0:
        return _NONE
    s = path.arc_length
    middle = (np.arange(count) + 0.5) / count * s[-1]
    ahead = np.minimum(middle + min(length, 0.5 * s[-1] / count), s[-1])
    places = [np.interp(at, s, np.arange(len(s))) for at in (middle, ahead)]
    pairs = np.stack([interpolate(path.positions, place) for place in places], axis=1)
    return np.asarray(pairs[np.linalg.norm(pairs[:, 1] - pairs[:, 0], axis=1) > 1e-9], dtype=np.float32)


def violated(result: Adaptation) -> NDArray[np.float32]:
    """Segments (K, 2, 3) of the proposal that broke a limit before the constraints had their say."""
    path = result.proposed
    if path is None:
        return _NONE
    exempt = set(result.constraints.exempt) if result.constraints else set()
    bad = broken(path, result.scene, result.robot, exempt)
    return segments(path.positions)[bad[:-1] | bad[1:]]


def broken(path: Trajectory, scene: Scene, robot: Robot, exempt: set[str]) -> NDArray[np.bool_]:
    """Which waypoints (N,) break a limit of the robot."""
    bad = np.zeros(len(path), dtype=bool)
    if robot.workspace is not None:
        bad |= robot.workspace.inside(path.positions) < robot.margin - TOLERANCE
    if robot.max_speed is not None:
        bad |= path.speeds > robot.max_speed + TOLERANCE
    for item in scene:
        if item.name not in exempt:
            bad |= item.clearance(path.positions) < robot.obstacle_margin - TOLERANCE
    return bad


@dataclass
class Shown:
    """What is shown."""

    speeds: bool = False
    waypoints: bool = False
    ghost: bool = True
    margins: bool = False
    workspace: bool = True
    labels: bool = True


@dataclass(frozen=True)
class ViewBounds:
    """The part of the world that the page shows: its lower and upper corner (3,) [m] and the direction up (3,)."""

    lower: Array
    upper: Array
    up: Array

    @classmethod
    def of(cls, paths: list[Trajectory], scene: Scene) -> ViewBounds:
        """The paths, and the objects that are not far away from them; all objects where no path leads anywhere."""
        still = len(scene) and not any(path.length for path in paths)
        items = scene if still else geometry.extent(paths, scene).shown
        points = [] if still else [path.positions for path in paths]
        everything = np.concatenate([*points, *map(geometry.corners, items)])
        return cls(everything.min(axis=0), everything.max(axis=0), scene.frame.direction("up"))

    @property
    def middle(self) -> Array:
        """Centre (3,) [m]."""
        return np.asarray((self.lower + self.upper) / 2.0)

    @property
    def size(self) -> float:
        """Longest edge [m], at least 0.2."""
        return max(float((self.upper - self.lower).max()), 0.2)

    @property
    def ground(self) -> float:
        """Height of the floor [m]: that of the lowest object, or 0 if that is just below."""
        lowest = float(self.lower[2]) if self.up[2] > 0 else float(self.upper[2])
        return 0.0 if 0.0 < lowest * float(self.up[2]) < 0.3 * self.size else lowest

    def corner(self, frame: Frame) -> Array:
        """Position (3,) [m] of the axes: on the floor, behind and left of everything."""
        front, right = frame.direction("front"), frame.direction("right")
        back = min(float(self.lower @ front), float(self.upper @ front))
        left = min(float(self.lower @ right), float(self.upper @ right))
        place = (back - 0.16 * self.size) * front + (left - 0.16 * self.size) * right
        place[2] = self.ground
        return np.asarray(place)

    def camera(self, frame: Frame, aspect: float, fov: float, view: str = "fit") -> tuple[Array, Array]:
        """Position and target of a camera that sees everything from one of `VIEW_DIRECTIONS`.

        `aspect` is width by height of the free part of the picture, `fov` the vertical field of view [rad].
        """
        up = frame.direction("up")
        words = ("front", "right", "up")
        towards = sum(a * frame.direction(word) for a, word in zip(VIEW_DIRECTIONS[view], words, strict=True))
        away = np.asarray(towards / np.linalg.norm(towards))
        right = np.cross(up, away) / np.linalg.norm(np.cross(up, away))
        lower, upper = np.minimum(self.lower, self.corner(frame)), np.maximum(self.upper, self.corner(frame))
        middle = (lower + upper) / 2.0
        points = _CUBE * np.maximum(upper - lower, 0.1 * self.size) / 2.0
        across, high, near = points @ right, points @ np.cross(away, right), points @ away
        tall = float(np.tan(fov / 2.0))
        wide = tall * aspect * _FILL
        needed = near + np.maximum(np.abs(across) / wide, np.where(high > 0, high / 0.85, -high / 0.6) / tall)
        return middle + away * float(needed.max()), middle


def mesh(rings: Array) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Vertices (V, 3) and triangles (F, 3) of a tube of rings (N, sides, 3)."""
    count, sides = rings.shape[:2]
    i = np.arange(count * sides).reshape(count, sides)
    a, b, c, d = i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]
    faces = np.stack([np.stack([a, b, c], axis=2), np.stack([a, c, d], axis=2)]).reshape(-1, 3)
    return rings.reshape(-1, 3).astype(np.float32), faces.astype(np.uint32)


def grid_step(size: float) -> float:
    """A round edge length for the cells of the ground grid [m]."""
    power = 10.0 ** np.floor(np.log10(size / 8.0))
    return float(next(s * power for s in (1, 2, 5, 10) if s * power >= size / 12.0))


def edges(size: Any) -> NDArray[np.float32]:
    """The 12 edges (12, 2, 3) of a cuboid with edge lengths (3,) around the origin."""
    return np.asarray((_CUBE * np.asarray(size, dtype=np.float32) / 2.0)[np.array(_EDGES)])
