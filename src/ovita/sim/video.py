"""Videos of simulations, several side by side, with the trajectory drawn, captions and an inset of a small robot."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise
from typing import Any

import numpy as np

from ovita.errors import FormatError
from ovita.io.files import atomic_write
from ovita.paths.trajectory import Array, Trajectory
from ovita.sim import render
from ovita.sim.models import mujoco
from ovita.sim.placement import WorldTransform
from ovita.sim.simulate import Simulation, require
from ovita.sim.world import BOX_GROUP, SimWorld

SMALL = 0.08
"""A robot smaller than this share of the camera's distance is also shown from near, in an inset."""

INSET = 0.3
"""Size of the inset, as a share of the pane."""

_HALF_VIEW = np.tan(np.radians(22.5))
"""Of MuJoCo's camera, whose field of view is 45 degrees high."""


def close_up(camera: Any, extent: float) -> Any:
    """A camera that looks the same way from near."""
    near = mujoco.MjvCamera()
    near.type, near.azimuth, near.elevation = camera.type, camera.azimuth, camera.elevation
    near.distance = 2.2 * extent
    return near


def corner(camera: Any, points: Array, size: tuple[int, int]) -> tuple[int, int]:
    """The corner in which an inset hides the fewest points: 1 or -1 for right or left, and for top or bottom.

    The camera is a free one, the points (N, 3) [m] are in the simulator's coordinates, the size is width and height.
    """
    turn, tilt = np.radians([camera.azimuth, camera.elevation])
    ahead = np.array([np.cos(tilt) * np.cos(turn), np.cos(tilt) * np.sin(turn), np.sin(tilt)])
    right = np.array([np.sin(turn), -np.cos(turn), 0.0])
    away = points - (camera.lookat - camera.distance * ahead)
    scale = (away @ ahead) * _HALF_VIEW
    x, y = (away @ right) / scale * size[1] / size[0], (away @ np.cross(right, ahead)) / scale
    edge = 1.0 - 2.0 * INSET - 0.05
    corners = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    return min(corners, key=lambda at: int(((at[0] * x > edge) & (at[1] * y > edge)).sum()))


Image = np.ndarray[Any, np.dtype[np.uint8]]

SUFFIXES = (".mp4", ".gif")
LONGEST = 20.0
"""Length of a video at most [s]; a longer motion is played faster, and the caption says so."""

PACES = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1024)
PANE = (640, 480)
TITLE = 44
FOOT = 52
INK, PAPER, FAINT = (28, 32, 38), (255, 255, 255), (105, 112, 122)
BLUE, RED, MISSED = (0.1, 0.35, 0.85, 1.0), (0.85, 0.15, 0.1, 1.0), (0.76, 0.09, 0.36, 1.0)


@dataclass(frozen=True)
class Pane:
    """One view of a video.

    Args:
        label: Such as "original"; that of the path that is drawn in red is "adapted", all others are blue.
        trajectory: In the scene's coordinates.
    """

    label: str
    trajectory: Trajectory
    simulation: Simulation

    @property
    def colour(self) -> tuple[float, ...]:
        """Of its path, as in every other picture of ovita."""
        return RED if self.label == "adapted" else BLUE


def check_video(path: str) -> None:
    """Check that a video can be made, before anything is simulated for it.

    Raises:
        FormatError: If the name ends in none of .mp4 and .gif, or it cannot be written there.
        MissingExtra: If the video packages are not installed.
        NoRenderer: If no offscreen OpenGL works.
    """
    folder = os.path.dirname(os.path.abspath(path))
    wrong = {
        f"videos are written as {', '.join(SUFFIXES)}": os.path.splitext(path)[1].lower() not in SUFFIXES,
        "cannot be written: its folder does not exist": not os.path.isdir(folder),
        "this is a folder; name a file in it": os.path.isdir(path),
        "no permission to write here; choose another folder": not os.access(folder, os.W_OK),
    }
    for problem in [problem for problem, holds in wrong.items() if holds]:
        raise FormatError(path, problem)
    require("PIL", "matplotlib", "imageio_ffmpeg")
    if render.backend() == "disable":
        raise render.NoRenderer


def save_video(
    path: str,
    panes: Sequence[Pane],
    world: WorldTransform,
    *,
    title: str = "",
    robot: str = "",
    fps: int = 20,
    scale: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Render simulations side by side into a video, atomically: H.264 in .mp4, or a .gif.

    Panes go from left to right, the shorter ones hold their last frame; `progress` is called with the share done, 0..1.

    Raises:
        FormatError, MissingExtra, NoRenderer: As `check_video` does, and if the file cannot be written.
    """
    check_video(path)
    pictures = frames(panes, world, title=title, robot=robot, fps=fps, scale=scale, progress=progress)
    suffix = os.path.splitext(path)[1].lower()
    with tempfile.TemporaryDirectory(prefix="ovita-") as folder:
        part = os.path.join(folder, f"video{suffix}")
        (_write_gif if suffix == ".gif" else _write_mp4)(part, pictures, fps)
        with open(part, "rb") as video:
            atomic_write(path, video.read())


def frames(
    panes: Sequence[Pane],
    world: WorldTransform,
    *,
    title: str = "",
    robot: str = "",
    fps: int = 20,
    scale: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> Iterator[Image]:
    """The pictures (H, W, 3) of a video, one after another; see `save_video`."""
    longest = max(pane.simulation.motion.duration for pane in panes)
    pace = next((p for p in PACES if longest / p <= LONGEST), PACES[-1])
    count = int(np.ceil(longest / pace * fps)) + fps // 2
    width, height = (int(2 * round(0.5 * v * scale)) for v in PANE)
    paths = [world.trajectory(pane.trajectory).positions for pane in panes]
    camera = _camera(panes, paths, world)
    free = corner(camera, np.concatenate(paths), (width, height))
    views = [_View(pane, path, camera, world, (width, height), free) for pane, path in zip(panes, paths, strict=True)]
    letters = _Letters(scale)
    try:
        for i in range(count):
            time = min(i / fps * pace, longest)
            yield letters.sheet([view.picture(time) for view in views], panes, time, title, robot, pace)
            if progress is not None:
                progress((i + 1) / count)
    finally:
        for view in views:
            view.close()


class _View:
    def __init__(
        self, pane: Pane, path: Array, camera: Any, world: WorldTransform, size: tuple[int, int], free: tuple[int, int]
    ) -> None:
        self.pane, self.camera, self.size, self.free = pane, camera, size, free
        self.ahead = (*(0.5 * (1.0 + c) for c in pane.colour[:3]), 1.0)
        stage, motion = pane.simulation.stage, pane.simulation.motion
        above = 0.012 * camera.distance if stage.rolls else 0.0
        lift = np.array([0.0, 0.0, above])
        self.path, self.trace = path + lift, motion.tip * world.signs + lift
        self.center = (motion.positions * world.signs).mean(axis=1)
        self.model = render.visual_model(stage)
        self.data = mujoco.MjData(self.model)
        self.renderer = render.Renderer(self.model, size[0], size[1])
        self.dot = 0.007 * camera.distance
        step = max(1, int(np.ceil(len(path) / 400)))
        self.marks = np.append(np.arange(0, len(path) - 1, step), len(path) - 1)
        self.labels = _labels(stage)
        self.edges = _edges(self.model, 1.5 * camera.distance)
        extent = float(np.ptp(motion.positions[0], axis=0).max()) + 0.1
        self.near = None if extent > SMALL * camera.distance else close_up(camera, extent)

    def picture(self, time: float) -> Image:
        simulation = self.pane.simulation
        motion = simulation.motion
        now = int(np.clip(np.searchsorted(motion.times, time, side="right") - 1, 0, len(motion.times) - 1))
        self.data.qpos[:] = render.visual_state(self.model, simulation.stage, simulation.states[now])
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        self.renderer.update(self.data, self.camera)
        for a, b in self.edges:
            self._line(a, b, (0.45, 0.6, 0.85, 1.0), 1.5)
        ahead = self.marks[self.marks > motion.waypoints[now]]
        for a, b in pairwise([self.trace[now], *self.path[ahead]]):
            self._line(a, b, self.ahead, 2.0)
        trail = np.unique(np.linspace(0, now, min(now + 1, 300)).astype(int))
        for a, b in pairwise(self.trace[trail]):
            self._line(a, b, self.pane.colour, 4.0)
        for item in simulation.report.unreachable[:200]:
            self._dot(self.path[item.waypoint], MISSED, 0.8 * self.dot)
        self._dot(self.path[0], (0.1, 0.6, 0.3, 1.0), self.dot)
        self._dot(self.path[-1], (0.1, 0.1, 0.1, 1.0), self.dot)
        for name, top in self.labels:
            self._dot(top, (0.0, 0.0, 0.0, 0.0), 1e-4, name)
        picture = self.renderer.render()
        if self.near is not None:
            self._inset(picture, self.near, now)
        return picture

    def _inset(self, picture: Image, near: Any, now: int) -> None:
        """Put the robot from near into the corner that is free."""
        near.lookat[:] = self.center[now]
        self.renderer.update(self.data, near)
        width, height = (int(INSET * v) for v in self.size)
        left = picture.shape[1] - width - 6 if self.free[0] > 0 else 6
        top = 6 if self.free[1] > 0 else picture.shape[0] - height - 6
        picture[top - 2 : top + height + 2, left - 2 : left + width + 2] = 255
        picture[top : top + height, left : left + width] = self.renderer.render((width, height))

    def close(self) -> None:
        self.renderer.close()

    def _line(self, start: Array, end: Array, rgba: tuple[float, ...], width: float) -> None:
        if np.linalg.norm(end - start) < 1e-6:
            return
        geom = self._next(mujoco.mjtGeom.mjGEOM_LINE, np.zeros(3), rgba)
        if geom is not None:
            mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_LINE, width, start, end)

    def _dot(self, place: Array, rgba: tuple[float, ...], radius: float, label: str = "") -> None:
        geom = self._next(mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, radius), rgba)
        if geom is not None:
            geom.pos[:] = place
            geom.label = label

    def _next(self, kind: Any, size: Array, rgba: tuple[float, ...]) -> Any:
        scene = self.renderer.scene
        if scene.ngeom >= scene.maxgeom:
            return None
        geom = scene.geoms[scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, size, np.zeros(3), np.eye(3).ravel(), np.array(rgba, dtype=np.float32))
        scene.ngeom += 1
        return geom


class _Letters:
    """Puts panes and captions on one sheet."""

    def __init__(self, scale: float) -> None:
        import matplotlib
        from PIL import Image as Pictures
        from PIL import ImageDraw, ImageFont

        self.pictures, self.drawing, self.scale = Pictures, ImageDraw, scale
        fonts = os.path.join(matplotlib.get_data_path(), "fonts", "ttf")
        self.bold = ImageFont.truetype(os.path.join(fonts, "DejaVuSans-Bold.ttf"), round(18 * scale))
        self.plain = ImageFont.truetype(os.path.join(fonts, "DejaVuSans.ttf"), round(15 * scale))

    def sheet(self, views: list[Image], panes: Sequence[Pane], time: float, title: str, robot: str, pace: int) -> Image:
        top, foot = (int(2 * round(0.5 * v * self.scale)) for v in (TITLE, FOOT))
        picture = np.concatenate(views, axis=1)
        sheet = self.pictures.new("RGB", (picture.shape[1], picture.shape[0] + top + foot), PAPER)
        sheet.paste(self.pictures.fromarray(picture), (0, top))
        draw = self.drawing.Draw(sheet)
        pad = round(12 * self.scale)
        right = f"{robot}{f'   {pace}x speed' if pace > 1 else ''}"
        room = sheet.width - 3 * pad - draw.textlength(right, font=self.plain)
        draw.text((pad, top // 2), self._fit(draw, title, room), fill=INK, font=self.bold, anchor="lm")
        draw.text((sheet.width - pad, top // 2), right, fill=FAINT, font=self.plain, anchor="rm")
        for i, (pane, view) in enumerate(zip(panes, views, strict=True)):
            left, below = i * view.shape[1], top + view.shape[0]
            motion, report = pane.simulation.motion, pane.simulation.report
            clock = f"{min(time, motion.duration):.1f} / {motion.duration:.1f} s"
            ink = tuple(round(255 * c) for c in pane.colour[:3])
            draw.text((left + pad, below + foot // 4 + 2), pane.label, fill=ink, font=self.bold, anchor="lm")
            edge = left + view.shape[1] - pad
            draw.text((edge, below + foot // 4 + 2), clock, fill=INK, font=self.plain, anchor="rm")
            error = f"error {1e3 * report.tracking.rms:.1f} mm rms, {1e3 * report.tracking.max:.1f} mm at most"
            draw.text((left + pad, below + 3 * foot // 4 - 2), error, fill=FAINT, font=self.plain, anchor="lm")
            draw.text((edge, below + 3 * foot // 4 - 2), report.status, fill=FAINT, font=self.plain, anchor="rm")
            if i:
                draw.line([(left, top), (left, sheet.height)], fill=(200, 204, 210), width=1)
        return np.asarray(sheet, dtype=np.uint8)

    def _fit(self, draw: Any, text: str, room: float) -> str:
        text = " ".join(text.split())
        if draw.textlength(text, font=self.bold) <= room:
            return text
        while text and draw.textlength(text + "…", font=self.bold) > room:
            text = text[:-1]
        return text.rstrip() + "…"


def _camera(panes: Sequence[Pane], paths: list[Array], world: WorldTransform) -> Any:
    """One camera for all panes: around the paths, everywhere the robots go, and the objects that are near."""
    spots = [*paths, *(pane.simulation.motion.positions.reshape(-1, 3) * world.signs for pane in panes)]
    low = np.min([p.min(axis=0) for p in spots], axis=0)
    high = np.max([p.max(axis=0) for p in spots], axis=0)
    stage = panes[0].simulation.stage
    things = stage.model.geom_size[list(stage.objects)]
    places = stage.model.body_pos[stage.model.geom_bodyid[list(stage.objects)]]
    around = np.abs(places - 0.5 * (low + high)).max(axis=1) < 0.7 * float(np.linalg.norm(high - low))
    low = np.min([low, *(places - things)[around]], axis=0)
    high = np.max([high, *(places + things)[around]], axis=0)
    camera = mujoco.MjvCamera()
    camera.type = mujoco.mjtCamera.mjCAMERA_FREE
    camera.lookat[:] = 0.5 * (low + high)
    size = float(np.linalg.norm(high - low))
    camera.distance = 1.0 * size + 0.15
    flat = (high - low)[2] < 0.15 * size
    w, z = stage.stand[3], stage.stand[6]
    heading = float(np.degrees(2.0 * np.arctan2(z, w)))
    camera.azimuth = 130.0 if stage.rolls or not stage.model.jnt_limited.any() else heading - 50.0
    camera.elevation = -52.0 if flat else -28.0
    return camera


def _labels(stage: SimWorld) -> list[tuple[str, Array]]:
    """The objects' names, in letters that MuJoCo can draw, and the middle of their tops (3,) [m]."""
    data = mujoco.MjData(stage.model)
    mujoco.mj_kinematics(stage.model, data)
    found = []
    for geom, name in stage.objects.items():
        tall = float(np.abs(data.geom_xmat[geom].reshape(3, 3)[2]) @ stage.model.geom_size[geom])
        found.append((name.encode("ascii", "replace").decode()[:30], data.geom_xpos[geom] + np.array([0, 0, tall])))
    return found


def _edges(model: Any, longest: float) -> list[tuple[Array, Array]]:
    """The edges of a workspace that is a box, from end to end, unless the box is too large to be seen."""
    box = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, "workspace")
    if box < 0 or model.geom_group[box] != BOX_GROUP or 2.0 * np.linalg.norm(model.geom_size[box]) > longest:
        return []
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    corners = model.geom_pos[box] + signs * model.geom_size[box]
    pairs = [(a, b) for a in range(8) for b in range(a) if np.abs(signs[a] - signs[b]).sum() == 2]
    return [(corners[a], corners[b]) for a, b in pairs]


def _write_mp4(path: str, pictures: Iterator[Image], fps: int) -> None:
    import imageio_ffmpeg

    first = next(pictures)
    size = (first.shape[1], first.shape[0])
    coded = {"codec": "libx264", "pix_fmt_in": "rgb24", "pix_fmt_out": "yuv420p", "macro_block_size": 2}
    told = {"output_params": "-crf 23 -preset veryfast -movflags +faststart".split(), "ffmpeg_log_level": "error"}
    writer = imageio_ffmpeg.write_frames(path, size, fps=fps, **coded, **told)
    writer.send(None)
    try:
        for picture in chain([first], pictures):
            writer.send(np.ascontiguousarray(picture))
    finally:
        writer.close()


def _write_gif(path: str, pictures: Iterator[Image], fps: int) -> None:
    from PIL import Image as Pictures

    sheets = [Pictures.fromarray(picture).quantize(96, dither=Pictures.Dither.NONE) for picture in pictures]
    sheets[0].save(path, save_all=True, append_images=sheets[1:], duration=round(1000 / fps), loop=0, optimize=True)
