"""Showing a movement by hand: a pen is dragged through the scene; each stroke is a demonstration."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ovita.errors import RequestError
from ovita.io import Task, rendered
from ovita.io.json_ import dumps
from ovita.io.waypoints import from_columns
from ovita.paths.geometry import extent
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array
from ovita.sources.skills import KINDS, packed
from ovita.studio import html
from ovita.studio.scene_view import STROKE, SceneView, rgb
from ovita.studio.sessions import Desk
from ovita.text import counted, length

SHORTEST = 0.02
"""A stroke that leads less far is a slip of the hand [m]."""

_LEVEL, _FACING = "level, at the pen's height", "in the plane that faces you"


@dataclass(frozen=True)
class PenSample:
    """Where the pen was at a moment [s]."""

    moment: float
    position: tuple[float, ...]


class PenRecorder:
    """The panel with the pen, and the strokes that it drew in the tab's scene."""

    def __init__(self, desk: Desk, space: SceneView) -> None:
        self.desk, self._space = desk, space
        self.strokes: list[Task] = []
        self._samples: list[PenSample] = []
        self._pen: Any = None
        self._home = np.zeros(3)
        self._lock = threading.Lock()
        gui = desk.client.gui
        about = (
            "Take the pen, drag the ball from its place to where the movement ends, and let go: that is one"
            " demonstration. Three or more make a skill."
        )
        gui.add_html(html.section("Show", about))
        self.plane = gui.add_dropdown("the pen moves", (_LEVEL, _FACING))
        self.take = gui.add_button("Take the pen", icon="pencil")
        self.kept = gui.add_html("")
        self.kind = gui.add_dropdown("skill", KINDS, hint="What is learned from the demonstrations")
        self.learn = gui.add_button("Learn a skill and save it", icon="school", disabled=True)
        self.save = gui.add_button("Save the demonstrations", color=html.QUIET, icon="download", disabled=True)
        self.discard = gui.add_button("Discard the last", color=html.QUIET, icon="eraser", disabled=True)
        self.take.on_click(lambda _: self.toggle())
        self.learn.on_click(lambda _: self._learn())
        self.save.on_click(lambda _: self._save())
        self.discard.on_click(lambda _: self._discard())

    def toggle(self) -> None:
        """Put the pen into the scene, where the path starts, or away."""
        if self._pen is not None:
            self.let_go()
            return
        self._home = np.array(self.desk.controller.session.original.positions[0])
        size = 0.025 * (self._space.stage.size if self._space.stage is not None else 1.0)
        self._pen = self._space.api.add_icosphere("/pen", size, rgb(STROKE), position=self._home, subdivisions=2)
        self._pen.on_drag(self._dragged)
        self.take.label = "Put the pen away"

    def let_go(self) -> None:
        """Put the pen away; what it drew is kept."""
        if self._pen is not None:
            self._pen.remove()
            self._pen = None
        self._draw(())
        self.take.label = "Take the pen"

    async def _dragged(self, event: Any) -> None:
        place = np.array(event.end_position, dtype=float)
        if self.plane.value == _LEVEL:
            up = self.desk.controller.session.scene.frame.direction("up")
            place = level(place, np.array(event.client.camera.position), self._home, up)
        with self._lock:
            if event.phase == "start":
                self._samples = [PenSample(time.monotonic(), tuple(self._home.tolist()))]
            self._samples.append(PenSample(time.monotonic(), tuple(place.tolist())))
            samples = tuple(self._samples)
        if self._pen is not None:
            self._pen.position = place if event.phase != "end" else self._home
        self._draw(samples)
        if event.phase == "end":
            with self.desk.complaining():
                self.strokes.append(stroke(samples, self.desk.controller.session.scene))
            self._count()

    def _count(self) -> None:
        count = len(self.strokes)
        self.kept.content = html.block(f"<p>{counted(count, 'demonstration')}</p>" if count else "")
        for button in (self.learn, self.save, self.discard):
            button.disabled = count == 0

    def _discard(self) -> None:
        self.strokes.pop()
        self._draw(())
        self._count()

    def _save(self) -> None:
        for i, task in enumerate(self.strokes, start=1):
            content, _ = rendered(f"demonstration-{i}.json", task.trajectory, task.scene)
            text = content.encode() if isinstance(content, str) else content
            self.desk.client.send_file_download(f"demonstration-{i}.json", text, save_immediately=True)

    def _learn(self) -> None:
        from ovita.sources.learning import learn  # what it needs takes longer to read than the page
        from ovita.sources.skill_files import document_of

        with self.desk.complaining():
            skill = learn(self.strokes, self.kind.value)
            made = skill.generate()
            content = dumps(document_of(skill), "skill.json").encode()
            self.desk.client.send_file_download("skill.json", content, save_immediately=True)
            path = made.trajectory.positions
            self._space.draw_stroke(path)
            self._space.draw_tube(path, None if made.covariance is None else packed(made.covariance))
            said = f"A {skill.kind} of {counted(skill.shown, 'demonstration')}, {length(skill.size)} across, was saved"
            self.desk.tell(". ".join([f"{said} as skill.json", *skill.notes]))

    def _draw(self, samples: Sequence[PenSample]) -> None:
        self._space.draw_stroke(np.array([sample.position for sample in samples]).reshape(-1, 3))


def level(place: Array, camera: Array, home: Array, up: Array) -> Array:
    """Where the ray from a camera (3,) through a place (3,) meets the level plane through the pen's home (3,) [m].

    A ray that does not come down on the plane in front of the camera gives the place itself, brought to that height.
    """
    ray = place - camera
    down, needed = float(ray @ up), float((home - camera) @ up)
    share = needed / down if abs(down) > 1e-9 else 0.0
    if not 0.05 < share < 20.0:
        return np.asarray(place + float((home - place) @ up) * up)
    return np.asarray(camera + share * ray)


def stroke(samples: Sequence[PenSample], scene: Scene) -> Task:
    """A stroke of the pen as a demonstration in a scene; speeds follow from the moments.

    Raises:
        RequestError: If it leads nowhere.
    """
    moments = np.array([sample.moment for sample in samples])
    positions = np.array([sample.position for sample in samples], dtype=float).reshape(-1, 3)
    new = np.concatenate([[True], (np.diff(moments) > 0) & (np.diff(positions, axis=0) != 0).any(axis=1)])
    moments, positions = moments[new], positions[new]
    if len(positions) < 3 or extent(positions) < SHORTEST:
        raise RequestError(
            f"the pen moved less than {length(SHORTEST)}; drag it from the start to the end of a movement"
        )
    columns = dict(zip("xyz", positions.T, strict=True)) | {"t": moments - moments[0]}
    trajectory, notes = from_columns(columns, timestep=None)
    return Task(trajectory, scene, notes=notes)
