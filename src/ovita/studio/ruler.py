"""Measuring in the scene: a line between two things, with its length in the scene's own directions."""

from __future__ import annotations

import threading
from dataclasses import dataclass

import numpy as np

from ovita.dialogue.session import Session
from ovita.paths.geometry import closest_to_point
from ovita.paths.trajectory import Array, interpolate
from ovita.studio import html
from ovita.studio.scene_view import SceneView
from ovita.studio.sessions import Desk
from ovita.text import length, listed

NOTHING, START, GOAL, LINE = "nothing", "the start", "the goal", "the line"
OLD_START, OLD_GOAL = "the original start", "the original goal"


@dataclass(frozen=True)
class Measured:
    """A distance: both ends (2, 3) [m], and what is said of it."""

    ends: Array
    said: str


class Ruler:
    """What is measured in one tab."""

    def __init__(self, desk: Desk, space: SceneView) -> None:
        self.desk, self._space, gui = desk, space, desk.client.gui
        self._lock = threading.RLock()
        gui.add_html(html.block("<h4>Measure</h4>"))
        self.ends = [gui.add_dropdown(name, (NOTHING,)) for name in ("from", "to")]
        self.told = gui.add_html("")
        for end in self.ends:
            end.on_update(lambda _: self.refresh())

    def refresh(self) -> None:
        """Measure anew, in the session as it is."""
        with self._lock:  # both ends may be chosen at once
            self._measure(self.desk.controller.session)

    def _measure(self, session: Session) -> None:
        names = (NOTHING, START, GOAL, LINE, OLD_START, OLD_GOAL, *session.scene.names)
        for end in self.ends:
            if end.options != names:
                end.options = names
        chosen = [str(end.value) for end in self.ends]
        found = None if NOTHING in chosen or chosen[0] == chosen[1] else measured(session, *chosen)
        names = () if found is None else (*chosen, length(float(np.linalg.norm(np.diff(found.ends, axis=0)))))
        self._space.draw_ruler(None if found is None else found.ends, names)
        self.told.content = html.block(f"<p>{html.e(found.said)}</p>") if found else ""


def measured(session: Session, one: str, other: str) -> Measured:
    """The distance between two of: an end of the line in force or of the original, the line, an object's centre."""
    points = [_place(session, name) for name in (one, other)]
    for i, (name, to) in enumerate(((one, other), (other, one))):
        if name == LINE:
            points[i] = _nearest(session, to, points[1 - i])
    by = points[1] - points[0]
    parts = [f"{length(amount)} {word}" for word, amount in session.scene.frame.words(by).items() if amount >= 5e-4]
    said = f"{length(float(np.linalg.norm(by)))} from {one} to {other}"
    said += f": {listed(parts)}." if parts else "."
    for item, place in ((one, points[1]), (other, points[0])):
        if item in session.scene.names:
            gap = float(session.scene[item].clearance(place[None])[0])
            said += f" {length(gap)} to the surface of {item}." if gap >= 0 else f" That is inside {item}."
    return Measured(np.stack(points), said)


def _place(session: Session, name: str) -> Array:
    if name in (OLD_START, OLD_GOAL):
        return np.asarray(session.original.positions[-1 if name == OLD_GOAL else 0])
    if name in (START, GOAL, LINE):
        return np.asarray(session.current.positions[-1 if name == GOAL else 0])
    return np.asarray(session.scene[name].position, dtype=float)


def _nearest(session: Session, to: str, place: Array) -> Array:
    """The point of the line that is nearest to the surface of an object, or to another place (3,) [m]."""
    path = session.current.positions
    known = to in session.scene.names
    at = session.scene[to].cuboid.closest(path)[1] if known else closest_to_point(path, place)[1]
    return np.asarray(interpolate(path, np.array([at]))[0])
