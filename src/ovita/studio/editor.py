"""Dragging by hand: an object, the start, the goal or a waypoint; pinning. Each becomes a turn of the session."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ovita.dialogue.session import Session
from ovita.errors import OvitaError
from ovita.paths.correspondence import carried_over
from ovita.paths.frame import Frame
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Array, Trajectory
from ovita.studio import html
from ovita.studio.hands import drawn, pulled
from ovita.studio.scene_view import SceneView
from ovita.studio.sessions import SessionController
from ovita.toolkit import CATALOGUE

_NOTHING, _START, _GOAL = "nothing", "the start", "the goal"


class DragEditor:
    """What a person moves with the mouse.

    `peek` shows the lines of a session that does not count yet, `told` hears which number the picked waypoint has now.
    """

    def __init__(
        self,
        gui: Any,
        space: SceneView,
        controller: Callable[[], SessionController],
        peek: Callable[[Session], None],
        told: Callable[[int | None], None],
    ) -> None:
        self._space, self._controller, self._peek, self._told = space, controller, peek, told
        self._wanted: tuple[str, Array] | None = None
        self._waypoint: int | None = None
        self._on = controller().session.current  # the path that the waypoint is counted on
        self._peeking, self.dragging = False, False
        self._lock = threading.Lock()
        self._gizmo: Any = None
        gui.add_html(
            html.block(
                "<h4>Move</h4><p class='soft'>Choose what to move, or click an object; then drag its arrows."
                " The program runs again when you let go.</p>"
            )
        )
        self.what = gui.add_dropdown("move", (_NOTHING,))
        gui.add_html(
            html.block(
                "<h4>Pin</h4><p class='soft'>The limits may not move a pinned waypoint from where the program puts it."
                "</p>"
            )
        )
        self.index = gui.add_slider("waypoint", 1, 2, 1, 1)
        self.pin = gui.add_button("Pin this waypoint", icon="pin")
        self.unpin = gui.add_button("Take all pins out", color=html.QUIET, icon="pinned-off")
        space.picked = self._choose
        self.what.on_update(self._chosen)
        self.index.on_update(self._ring)
        self.pin.on_click(lambda _: self._pin())
        self.unpin.on_click(lambda _: self._change_pins(()))

    def refresh(self) -> None:
        """Fit the controls to the session."""
        session, held = self._controller().session, str(self.what.value) in self._picked
        self._follow(session.current)
        names = (_NOTHING, _START, _GOAL, *self._picked, *session.scene.names)
        if self.what.options != names:
            self.what.options = names
            if held:
                self.what.value = self._picked[0] if self._picked else _NOTHING
            self._grip()
        last = len(session.current) - 1
        if self.index.max != last + 1:
            self.index.value = min(self.index.value, last + 1)
            self.index.max = last + 1
        pinned = [i for i in session.constraints.pinned if -len(session.current) <= i <= last]
        self.unpin.visible = bool(session.constraints.pinned)
        self._space.pins(session.current.positions[pinned])
        self._space.mark(None)
        if self._gizmo is not None and not self.dragging:
            self._gizmo.position = self._place(session, str(self.what.value))

    def _follow(self, path: Trajectory) -> None:
        """Count the picked waypoint on a path anew; once it is gone, nothing is picked."""
        if self._waypoint is not None and path is not self._on:
            found = carried_over(self._on.positions, path.positions, self._waypoint, self._waypoint)
            self._waypoint = None if found is None else found[0]
            self._told(self._waypoint)
        self._on = path

    def let_go(self) -> None:
        """Take the arrows away."""
        self.what.value, self._waypoint = _NOTHING, None
        self._grip()

    @property
    def _picked(self) -> tuple[str, ...]:
        return () if self._waypoint is None else (f"waypoint {self._waypoint + 1}",)

    def pick(self, waypoint: int | None) -> None:
        """Put the arrows to a waypoint of the current path, counted from 0; None takes them away."""
        self._waypoint, self._on = waypoint, self._controller().session.current
        self.what.value = _NOTHING
        self.refresh()
        self.what.value = self._picked[0] if self._picked else _NOTHING
        self._grip()

    def move(self, what: str, place: Array) -> bool:
        """Move an object, the start, the goal or the picked waypoint to a place (3,) [m], as one turn."""
        return self._controller().act(lambda session: self._moved(session, what, place))

    def _moved(self, session: Session, what: str, place: Array) -> None:
        by = np.asarray(place, dtype=float) - self._place(session, what)
        said = f"moved {what} {_words(by, session.scene.frame)}"
        if what in self._picked and self._waypoint is not None:
            drawn(session, pulled(self._waypoint, by, session.scene.frame, len(session.current)))
        elif what in (_START, _GOAL):
            session.change(said, original=with_end(session.original, place, goal=what == _GOAL))
        else:
            session.change(said, scene=with_object_at(session.scene, what, place))

    def _preview(self) -> None:
        """Preview a drag; of several positions only the last counts."""
        while True:
            with self._lock:
                wanted, self._wanted = self._wanted, None
                if wanted is None:
                    self._peeking = False
                    return
            controller = self._controller()
            with controller.lock:
                draft = None if controller.busy is not None else controller.session.draft()
            if draft is not None:
                with contextlib.suppress(OvitaError):
                    self._moved(draft, *wanted)
                    self._peek(draft)

    def _choose(self, name: str) -> None:
        self.what.value = _NOTHING if self.what.value == name else name
        self._grip()

    async def _chosen(self, event: Any) -> None:
        if event.client is not None:
            self._grip()

    def _grip(self) -> None:
        """Attach the drag arrows to the selection."""
        if self._gizmo is not None:
            self._gizmo.remove()
            self._gizmo = None
        what = str(self.what.value)
        if what not in self.what.options or what == _NOTHING or self._space.stage is None:
            return
        self._gizmo = self._space.api.add_transform_controls(
            "/gizmo", 0.17 * self._space.stage.size, disable_rotations=True, depth_test=False, line_width=3.0,
            position=self._place(self._controller().session, what),
        )  # fmt: skip
        self._gizmo.on_update(self._dragged)

    async def _dragged(self, event: Any) -> None:
        what, place = str(self.what.value), np.array(event.target.position, dtype=float)
        holder = self._space.objects.get(what)
        self.dragging = event.phase != "end"
        if self.dragging:
            if holder is not None:
                holder.position = place
            with self._lock:
                self._wanted = (what, place)
                if self._peeking:
                    return
                self._peeking = True
            threading.Thread(target=self._preview, name="ovita-preview", daemon=True).start()
            return
        with self._lock:
            self._wanted = None
        threading.Thread(target=self._drop, args=(what, place), daemon=True).start()

    def _drop(self, what: str, place: Array) -> None:
        session = self._controller().session
        there = self._place(session, what)
        if np.linalg.norm(place - there) < 1e-6:
            self._peek(session)
            return
        if not self.move(what, place) and self._gizmo is not None:
            self._gizmo.position = there
            holder = self._space.objects.get(what)
            if holder is not None:
                holder.position = there
            self._peek(session)

    def _place(self, session: Session, what: str) -> Array:
        if what == _NOTHING:
            return np.zeros(3)
        if what in self._picked and self._waypoint is not None:
            return np.array(session.current.positions[self._waypoint])
        if what in (_START, _GOAL):
            return np.array(session.original.positions[0 if what == _START else -1])
        return np.array(session.scene[what].position)

    async def _ring(self, event: Any) -> None:
        if event.client is not None:
            path = self._controller().session.current
            self._space.mark(path.positions[min(int(self.index.value), len(path)) - 1])

    def _pin(self) -> None:
        session = self._controller().session
        index = min(int(self.index.value), len(session.current)) - 1
        self._change_pins(tuple(sorted({*session.constraints.pinned, index})))

    def _change_pins(self, pins: tuple[int, ...]) -> None:
        session = self._controller().session
        if pins == session.constraints.pinned:
            return
        new = [str(i + 1) for i in pins if i not in session.constraints.pinned]
        said = f"pinned waypoint {', '.join(new)}" if new else "took all pins out"
        options = replace(session.constraints, pinned=pins)
        self._controller().act(lambda s: s.change(said, constraints=options))


def with_object_at(scene: Scene, name: str, place: Array) -> Scene:
    """The scene with an object's centre at another place (3,) [m]."""
    item = scene[name]
    return replace(scene, objects=tuple(replace(o, position=place) if o is item else o for o in scene))


def with_end(path: Trajectory, place: Array, *, goal: bool) -> Trajectory:
    """The path with its start or goal at another place (3,) [m]; the half of the path next to it follows."""
    move = CATALOGUE["move_goal" if goal else "move_start"]
    rows = move(path.to_array(), tuple(float(v) for v in place))
    return path.with_(positions=np.asarray(rows)[:, :3])


def _words(by: Array, frame: Frame) -> str:
    parts = [f"{amount:.2f} m {word}" for word, amount in frame.words(by).items() if amount >= 0.005]
    return ", ".join(parts) or "a little"
