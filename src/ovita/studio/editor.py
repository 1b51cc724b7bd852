"""Editing by hand: what is dragged, pinned, inserted, deleted or drawn becomes a turn, mostly by a small policy."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.paths.correspondence import carried_over
from ovita.paths.part import PathPart
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Array, Trajectory, interpolate, source_indices
from ovita.studio import html
from ovita.studio.scene_view import SceneView
from ovita.studio.sessions import Desk, Latest
from ovita.text import waypoints
from ovita.toolkit import CATALOGUE

MOST_POINTS = 24
"""Points of a stroke that go into the policy; a hand draws no finer."""


@dataclass(frozen=True)
class HandEdit:
    """What a hand did: its name in the history, the policy that does it, and the plan as a sentence."""

    said: str
    code: str
    plan: str

    def do(self, session: Session) -> None:
        """Do it, as a turn of a session."""
        session.draw(self.said, self.code, self.plan)


def pulled(index: int, by: Array, frame: Frame, count: int) -> HandEdit:
    """A waypoint (counted from 0) of `count` was pulled by (3,) [m]; two neighbours on either side follow it."""
    words = {word: round(amount, 4) for word, amount in frame.words(by).items() if amount >= 5e-4}
    if not words:
        raise RequestError(f"waypoint {index + 1} was moved by less than 1 mm; drag it further")
    told = ", ".join(f"{amount:.2f} m {word}" for word, amount in words.items())
    knobs = "".join(f"    {word}={amount!r},  # [m] {word}\n" for word, amount in words.items())
    width = round(min(3.0 / (count - 1), 0.5), 4)
    knobs += f"    width={width!r},  # share of the path on either side that follows\n"
    passed, name = ", ".join(f"{word}={word}" for word in words), f"waypoint {index + 1}"
    body = f"    return pull_waypoint(traj, {index}, width=width, {passed})\n"
    return HandEdit(f"moved {name} {told}", _policy(knobs, body), f"Pull {name} {told}, as by hand.")


def inserted(after: int) -> HandEdit:
    """A waypoint was put behind one (counted from 0)."""
    between = f"between waypoints {after + 1} and {after + 2}"
    body = f"    return insert_waypoint(traj, {after})\n"
    return HandEdit(f"inserted a waypoint {between}", _policy("", body), f"Put a waypoint {between}.")


def deleted(first: int, last: int) -> HandEdit:
    """The waypoints from one to another (counted from 0) were taken out."""
    which = waypoints(first, last)
    body = f"    return delete_waypoints(traj, {first}, {last})\n"
    return HandEdit(f"deleted {which}", _policy("", body), f"Take out {which}.")


def sketched(line: Array, first: int, last: int) -> HandEdit:
    """The part from one waypoint to another (counted from 0) shall follow a line (M, 3) [m].

    Raises:
        RequestError: If the line is none, or the part is too short to follow it.
    """
    if line.ndim != 2 or line.shape[1] != 3 or len(line) < 2 or not np.isfinite(line).all():
        raise RequestError(
            "the stroke is too short; draw along the path, from where it should leave to where it returns"
        )
    if last - first < 2:
        raise RequestError(
            "the stroke is along less than 3 waypoints; draw along more of the path, or insert waypoints"
        )
    points = interpolate(line, source_indices(line, min(len(line), MOST_POINTS), "arc_length")).round(4)
    part = PathPart("range", amount=first, until=last).words()
    rows = ",\n".join(f"        {row}" for row in points.tolist())
    knobs = "    stiffness=0.2,  # 0 follows the drawn line exactly, 1 keeps the shape of the path\n"
    body = (
        f"    drawn = [\n{rows},\n    ]\n    part = between(traj, {first}, {last})\n"
        "    return follow_stroke(traj, drawn, stiffness=stiffness, where=part, keep_ends=True)\n"
    )
    return HandEdit(f"sketched a new way {part}", _policy(knobs, body), f"Follow the drawn line {part}.")


def _policy(knobs: str, body: str) -> str:
    arguments = f"\n    traj,\n    scene,\n    *,\n{knobs}" if knobs else "traj, scene"
    return f"def adapt({arguments}):\n{body}"


_NOTHING, _START, _GOAL = "nothing", "the start", "the goal"


class DragEditor:
    """What a person moves with the mouse.

    `peek` shows the lines of a session that does not count yet, `told` hears which number the picked waypoint has now.
    """

    def __init__(
        self, desk: Desk, space: SceneView, peek: Callable[[Session], None], told: Callable[[int | None], None]
    ) -> None:
        self.desk, self._space, self._peek, self._told = desk, space, peek, told
        self._waypoint: int | None = None
        self._on = desk.controller.session.current  # the path that the waypoint is counted on
        self._previews = Latest(self._preview, "ovita-preview")
        self.dragging = False
        self._gizmo: Any = None
        gui = desk.client.gui
        about = "Choose what to move, or click an object; then drag its arrows. The program runs again when you let go."
        gui.add_html(html.section("Move", about))
        self.what = gui.add_dropdown("move", (_NOTHING,))
        gui.add_html(html.section("Pin", "The limits may not move a pinned waypoint from where the program puts it."))
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
        session, held = self.desk.controller.session, str(self.what.value) in self._picked
        self._count_anew(session.current)
        names = (_NOTHING, _START, _GOAL, *self._picked, *session.scene.names)
        if self.what.options != names:
            self.what.options = names
            if held:
                self.what.value = self._picked[0] if self._picked else _NOTHING
            self._grip()
        count = len(session.current)
        if self.index.max != count:
            self.index.value, self.index.max = min(self.index.value, count), count
        pinned = [i for i in session.constraints.pinned if -count <= i < count]
        self.unpin.visible = bool(session.constraints.pinned)
        self._space.pins(session.current.positions[pinned])
        self._space.mark(None)
        if self._gizmo is not None and not self.dragging:
            self._gizmo.position = self._place(session, str(self.what.value))

    def _count_anew(self, path: Trajectory) -> None:
        """Find the picked waypoint on a path that may be another; once it is gone, nothing is picked."""
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
        self._waypoint, self._on = waypoint, self.desk.controller.session.current
        self.what.value = _NOTHING
        self.refresh()
        self.what.value = self._picked[0] if self._picked else _NOTHING
        self._grip()

    def move(self, what: str, place: Array) -> bool:
        """Move an object, the start, the goal or the picked waypoint to a place (3,) [m], as one turn."""
        return self.desk.controller.act(lambda session: self._moved(session, what, place))

    def _moved(self, session: Session, what: str, place: Array) -> None:
        by = np.asarray(place, dtype=float) - self._place(session, what)
        said = f"moved {what} {_words(by, session.scene.frame)}"
        if what in self._picked and self._waypoint is not None:
            pulled(self._waypoint, by, session.scene.frame, len(session.current)).do(session)
        elif what in (_START, _GOAL):
            session.change(said, original=with_end(session.original, place, goal=what == _GOAL))
        else:
            session.change(said, scene=with_object_at(session.scene, what, place))

    def _preview(self, wanted: tuple[str, Array]) -> None:
        controller = self.desk.controller
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
        if self._gizmo is not None:
            self._gizmo.remove()
            self._gizmo = None
        what = str(self.what.value)
        if what not in self.what.options or what == _NOTHING or self._space.stage is None:
            return
        self._gizmo = self._space.api.add_transform_controls(
            "/gizmo", 0.17 * self._space.stage.size, disable_rotations=True, depth_test=False, line_width=3.0,
            position=self._place(self.desk.controller.session, what),
        )  # fmt: skip
        self._gizmo.on_update(self._dragged)

    async def _dragged(self, event: Any) -> None:
        what, place = str(self.what.value), np.array(event.target.position, dtype=float)
        holder = self._space.objects.get(what)
        self.dragging = event.phase != "end"
        if self.dragging:
            if holder is not None:
                holder.position = place
            self._previews.want((what, place))
            return
        self._previews.forget()
        threading.Thread(target=self._drop, args=(what, place), daemon=True).start()

    def _drop(self, what: str, place: Array) -> None:
        session = self.desk.controller.session
        there = self._place(session, what)
        if np.linalg.norm(place - there) < 1e-6:
            self._peek(session)
            return
        if not self.move(what, place) and self._gizmo is not None:
            for node in filter(None, (self._gizmo, self._space.objects.get(what))):
                node.position = there
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
            path = self.desk.controller.session.current
            self._space.mark(path.positions[min(int(self.index.value), len(path)) - 1])

    def _pin(self) -> None:
        session = self.desk.controller.session
        index = min(int(self.index.value), len(session.current)) - 1
        self._change_pins(tuple(sorted({*session.constraints.pinned, index})))

    def _change_pins(self, pins: tuple[int, ...]) -> None:
        session = self.desk.controller.session
        if pins == session.constraints.pinned:
            return
        new = [str(i + 1) for i in pins if i not in session.constraints.pinned]
        said = f"pinned waypoint {', '.join(new)}" if new else "took all pins out"
        options = replace(session.constraints, pinned=pins)
        self.desk.controller.act(lambda s: s.change(said, constraints=options))


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
