"""The limits as controls: robot, workspace, margins, speed, what must stay, and what became of each limit."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.limits import ConstraintOptions, parse_text
from ovita.paths.robot import PRESETS, Box, Robot, Shell
from ovita.paths.scene import Scene
from ovita.studio import words
from ovita.studio.desk import Desk

_SPACES = ("anywhere", "box", "reach")
_STATED = "as the scene states"


class Limits:
    """The limits of one tab, applied when a person says so.

    Args:
        gui: viser's GUI of the tab; the controls are added to the container that is open.
        desk: Gives the desk.
        complain: Shows a sentence to the person.
    """

    def __init__(self, gui: Any, desk: Callable[[], Desk], complain: Callable[[str], None]) -> None:
        self._desk, self._complain = desk, complain
        self._filled: tuple[Robot, ConstraintOptions] | None = None
        self.verdict = gui.add_html("")
        self.apply = gui.add_button("Apply the limits below", icon="check")
        self.preset = gui.add_dropdown("robot", tuple(PRESETS), hint="Takes over all limits of a robot")
        self.on = gui.add_checkbox("enforce", True, hint="Off only measures the limits")
        self.objects = gui.add_checkbox("objects", True, hint="Objects are obstacles")
        self.margin = gui.add_number("from objects [m]", 0.01, min=0.0, step=0.005)
        self.speed_on = gui.add_checkbox("limit speed", False)
        self.speed = gui.add_number("top speed [m/s]", 1.0, min=0.01, step=0.05)
        self.start = gui.add_checkbox("keep start", False, hint="The limits may not move the first waypoint")
        self.goal = gui.add_checkbox("keep goal", False, hint="The limits may not move the last waypoint")
        self.smooth = gui.add_slider("smoothing", 0.0, 10.0, 0.1, 0.0, hint="Weight of smoothing; 0 changes nothing")
        self.space = gui.add_dropdown("workspace", _SPACES, hint="Where the path must stay")
        self.lower = gui.add_vector3("from xyz [m]", (-1.0, -1.0, 0.0), step=0.05)
        self.upper = gui.add_vector3("to xyz [m]", (1.0, 1.0, 1.0), step=0.05)
        self.centre = gui.add_vector3("centre [m]", (0.0, 0.0, 0.0), step=0.05)
        self.radii = gui.add_vector2("radii [m]", (0.0, 1.0), min=(0.0, 0.0), step=0.05)
        self.edge = gui.add_number("from border [m]", 0.01, min=0.0, step=0.005)
        self.preset.on_update(self._preset)
        self.space.on_update(lambda _: self._show_space())
        self.speed_on.on_update(lambda _: self._show_space())
        self.apply.on_click(lambda _: self._apply())

    def refresh(self) -> None:
        """Show the limits of the session and what became of each."""
        session = self._desk().session
        self.verdict.content = words.verdict(session)
        if self._filled == (session.robot, session.constraints):
            return
        self._filled = (session.robot, session.constraints)
        stated = (_STATED,) if parse_text(session.scene.constraints_text).understood else ()
        names = (*PRESETS, *stated)
        own = () if session.robot.name in names else (session.robot.name,)
        self.preset.options = (*own, *names)
        self.preset.value = session.robot.name
        self._fill(session.robot, session.constraints)

    def _fill(self, robot: Robot, options: ConstraintOptions) -> None:
        self.on.value, self.objects.value = options.enabled, options.obstacles
        self.start.value, self.goal.value = options.fix_start, options.fix_goal
        self.smooth.value = 0.0 if options.lambda_smooth == "auto" else min(float(options.lambda_smooth), 10.0)
        self.margin.value, self.edge.value = robot.obstacle_margin, robot.margin
        self.speed_on.value = robot.max_speed is not None
        self.speed.value = robot.max_speed or 1.0
        space = robot.workspace
        self.space.value = _SPACES[0] if space is None else _SPACES[1] if isinstance(space, Box) else _SPACES[2]
        if isinstance(space, Box):
            self.lower.value, self.upper.value = space.lower, space.upper
        elif isinstance(space, Shell):
            self.centre.value, self.radii.value = space.center, (space.r_min, space.r_max)
        self._show_space()

    def _show_space(self) -> None:
        for node in (self.lower, self.upper):
            node.visible = self.space.value == "box"
        for node in (self.centre, self.radii):
            node.visible = self.space.value == "reach"
        self.edge.visible = self.space.value != "anywhere"
        self.speed.visible = self.speed_on.value

    async def _preset(self, event: Any) -> None:
        if event.client is None:
            return
        name = str(self.preset.value)
        threading.Thread(target=self._take, args=(name,), daemon=True).start()

    def _take(self, name: str) -> None:
        session = self._desk().session
        if name == session.robot.name:
            return
        self._filled = None
        self._desk().act(lambda s: s.change(f"limits: {name}", robot=_limits(name, s.scene)))

    def _apply(self) -> None:
        try:
            robot, options = self._read(self._desk().session)
        except OvitaError as error:
            self._complain(str(error))
            return
        self._desk().act(lambda s: s.change("changed the limits", robot=robot, constraints=options))

    def _read(self, session: Session) -> tuple[Robot, ConstraintOptions]:
        space: Box | Shell | None = None
        if self.space.value == "box":
            space = Box(self.lower.value, self.upper.value)
        elif self.space.value == "reach":
            space = Shell(self.centre.value, *self.radii.value)
        robot = replace(
            session.robot,
            workspace=space,
            margin=float(self.edge.value),
            obstacle_margin=float(self.margin.value),
            max_speed=float(self.speed.value) if self.speed_on.value else None,
        )
        options = replace(
            session.constraints,
            enabled=self.on.value,
            obstacles=self.objects.value,
            fix_start=self.start.value,
            fix_goal=self.goal.value,
            lambda_smooth=float(self.smooth.value),
        )
        if (robot, options) == (session.robot, session.constraints):
            raise RequestError("these limits are in force already")
        return robot, options


def _limits(name: str, scene: Scene) -> Robot:
    """The limits of a preset, or those that a scene states in words."""
    if name != _STATED:
        return Robot.preset(name)
    return replace(parse_text(scene.constraints_text).apply(Robot.preset("none")), name="scene")
