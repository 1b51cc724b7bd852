"""The panels on the right: parameters, plan, explanation, changes, code and limits.

Every panel takes the desk of its tab, and adds its controls to the container that is open.
"""

from __future__ import annotations

import ast
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ovita.dialogue.session import Session
from ovita.errors import OvitaError, PolicyError, RequestError
from ovita.limits import ConstraintOptions, parse_text
from ovita.paths.robot import PRESETS, UNLIMITED, Box, Robot, Shell
from ovita.paths.scene import Scene
from ovita.policy import Parameter
from ovita.studio import html
from ovita.studio.sessions import Desk

_AGAINST = ("the original", "the turn before")


class ChangesPanel:
    """The measured difference in sentences; the charts are in the timeline."""

    def __init__(self, desk: Desk) -> None:
        self.desk, gui = desk, desk.client.gui
        self.against = gui.add_dropdown("compared with", _AGAINST, hint="What the sentences measure from")
        self.text = gui.add_html("")
        self.against.on_update(lambda _: self.refresh())

    def refresh(self) -> None:
        """Show the session."""
        session = self.desk.controller.session
        earlier = self.against.value == _AGAINST[1] and len(session.steps) > 1
        self.text.content = html.changes(session.steps[-2].adaptation.adapted if earlier else session.original, session)


class CodePanel:
    """The program, to read, to edit and to run again in the sandbox."""

    def __init__(self, desk: Desk) -> None:
        self.desk, gui = desk, desk.client.gui
        self._shown = ""
        self.note = gui.add_html("")
        self.listing = gui.add_html("")
        with gui.add_folder("Edit", expand_by_default=False):
            self.text = gui.add_text("", "", multiline=True)
            self.run = gui.add_button("Run in the sandbox", icon="player-play")
            self.reset = gui.add_button("Discard edits", color=html.QUIET, icon="arrow-back-up")
        self.run.on_click(lambda _: self._run())
        self.reset.on_click(lambda _: self._fill())

    def refresh(self) -> None:
        """Show the program in force; edits that were not run stay as long as it is the same program."""
        result = self.desk.controller.session.adaptation
        source = result.code if result is not None else ""
        if source == self._shown and source:
            return
        if result is None:
            text = "The program that changes the trajectory is shown here. It runs in a sandbox that can only compute."
        else:
            where = f"isolation: {result.isolation}" if result.isolation else "not run on this machine yet"
            text = f"This program made the red line. It runs in a sandbox that can only compute ({where})."
        self.note.content = html.soft(text)
        self._shown = source
        self.listing.content = html.code(source) if source else ""
        self._fill()

    def _fill(self) -> None:
        self.text.value = self._shown
        self.listing.content = html.code(self._shown) if self._shown else ""

    def _run(self) -> None:
        source = self.text.value
        if not source.strip():
            self.desk.complain("There is no code to run; write a program, or discard the edits.")
            return
        failed: list[OvitaError] = []

        def work(session: Any) -> None:
            try:
                session.recode(source)
            except OvitaError as error:
                failed.append(error)
                raise

        with html.busy(self.run, "Running\u2026"):
            if self.desk.controller.act(work):
                return
        error = failed[0] if failed else None
        line = error.line if isinstance(error, PolicyError) else None
        note = f'<p class="bad">{html.e(error)}</p>' if error else ""
        self.listing.content = html.block(note) + html.code(source, line)


def reach(value: float, unit: str) -> tuple[float, float, float]:
    """Lowest and highest value of a slider for a parameter, and its step: round numbers around the value."""
    size = abs(value) if value else 0.25 if unit in ("m", "m/s", "") else 1.0
    power = 10.0 ** np.floor(np.log10(2.5 * size))
    high = float(next(s * power for s in (1, 2, 3, 5, 10) if s * power >= 2.5 * size * (1 - 1e-9)))
    high = high if unit else max(high, 1.0)  # a share goes up to all
    low = -high if value < 0 or (value == 0 and unit == "m") else 0.0
    return low, high, float(f"{(high - low) / 200.0:.1g}")


class KnobsPanel:
    """The parameters of the policy in force, as sliders, boxes and fields."""

    def __init__(self, desk: Desk) -> None:
        self.desk, self.gui = desk, desk.client.gui
        self.note = self.gui.add_html("")
        self.box = self.gui.add_folder(None)
        self.handles: dict[str, Any] = {}
        self._others: list[Any] = []
        self._made: tuple[tuple[str, type, str], ...] | None = None

    def refresh(self, *, turned: bool) -> None:
        """Show the parameters; where they were just `turned`, those under the hand are left alone."""
        result = self.desk.controller.session.adaptation
        knobs = result.parameters if result is not None else ()
        made = tuple((p.name, type(p.value), p.meaning) for p in knobs)
        same, self._made = made == self._made, made
        if turned and same:
            return
        if made and same and all(_reaches(self.handles[knob.name], knob.value) for knob in knobs):
            self._set(knobs)
            return
        for handle in (*self.handles.values(), *self._others):
            handle.remove()
        self.handles, self._others = {}, []
        none = "The numbers in what you say become knobs here." if result is None else "This program has no parameters."
        turn = "Turn a knob: the program and the limits run again at once, no model is asked."
        self.note.content = html.soft(turn if knobs else none)
        with self.box:
            for knob in knobs:
                self._make(knob)

    def _set(self, knobs: Sequence[Parameter]) -> None:
        for knob in knobs:
            handle, value = self.handles[knob.name], _shown(knob.shown)
            if handle.value != value:
                handle.value = value

    def _make(self, knob: Parameter) -> None:
        unit = f" [{knob.unit}]" if knob.unit else ""
        meaning = f"{knob.called}, counted from 1" if knob.counts else knob.meaning
        label, hint = f"{knob.called}{unit}", f"{meaning or knob.called}{unit}"
        if meaning:
            self._others.append(self.gui.add_html(html.block(f'<div class="soft">{html.e(meaning)}</div>')))
        value = knob.shown
        if isinstance(value, bool):
            handle = self.gui.add_checkbox(label, value, hint=hint)
        elif isinstance(value, int) and not knob.unit:
            handle = self.gui.add_number(label, value, step=1, hint=hint)
        elif isinstance(value, int | float):
            low, high, step = reach(float(value), knob.unit)
            handle = self.gui.add_slider(label, low, high, step, float(value), hint=hint)
        else:
            handle = self.gui.add_text(label, _shown(value), hint=hint)

        async def turned(event: Any) -> None:
            if event.client is not None:
                _widen(handle)
                self.desk.controller.turn(knob.name, knob.meant(_read(handle.value, value)))

        handle.on_update(turned)
        self.handles[knob.name] = handle


def _widen(slider: Any) -> None:
    """Have a slider reach a value that was typed beyond its end, which the page would set back to the end."""
    if not _reaches(slider, slider.value):
        lowest, highest, _ = reach(float(slider.value), "m")
        slider.min, slider.max = min(slider.min, lowest), max(slider.max, highest)


def _reaches(control: Any, value: Any) -> bool:
    """Whether a value is within the ends of a control; what has no ends takes any."""
    low, high = getattr(control, "min", None), getattr(control, "max", None)
    return low is None or high is None or not isinstance(value, int | float) or low <= value <= high


def _shown(value: Any) -> Any:
    return value if isinstance(value, bool | int | float | str) else repr(value)


def _read(value: Any, like: Any) -> Any:
    """A value as its parameter wants it: groups and None are typed as Python writes them."""
    if not isinstance(value, str) or isinstance(like, str):
        return value
    try:
        return ast.literal_eval(value.strip())
    except (ValueError, SyntaxError):
        return value


_SPACES = ("anywhere", "box", "reach")
_STATED = "as the scene states"


class LimitsPanel:
    """The limits, applied when a person says so."""

    def __init__(self, desk: Desk) -> None:
        self.desk, gui = desk, desk.client.gui
        self._filled: tuple[Robot, ConstraintOptions] | None = None
        self._base = desk.controller.session.robot  # whose limits the fields change
        self.verdict = gui.add_html("")
        self.apply = gui.add_button("Apply the limits below", icon="check")
        self.preset = gui.add_dropdown(
            "limits of", tuple(PRESETS), hint="Fills in all limits of a robot, to be applied"
        )
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
        """Show the session's limits and whether each holds."""
        session = self.desk.controller.session
        self.verdict.content = html.verdict(session)
        if self._filled == (session.robot, session.constraints):
            return
        self._filled, self._base = (session.robot, session.constraints), session.robot
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
        if event.client is not None:
            self._take(str(self.preset.value))

    def offer(self, name: str) -> None:
        """Fill in the limits of a robot that was chosen elsewhere, to be applied."""
        if name in self.preset.options and name in PRESETS and name != "none":
            self.preset.value = name
            self._take(name)

    def _take(self, name: str) -> None:
        session = self.desk.controller.session
        self._base = session.robot if name == session.robot.name else _limits(name, session.scene)
        self._fill(self._base, session.constraints)
        note = html.soft(f"{name}: filled in below, not applied yet.")
        self.verdict.content = html.verdict(session) + note * (self._base != session.robot)

    def _apply(self) -> None:
        with self.desk.complaining():
            robot, options = self._read(self.desk.controller.session)
            known = robot.name != self.desk.controller.session.robot.name
            said = f"limits: {robot.name}" if known else "changed the limits"
            self.desk.controller.act(lambda s: s.change(said, robot=robot, constraints=options))

    def _read(self, session: Session) -> tuple[Robot, ConstraintOptions]:
        space: Box | Shell | None = None
        if self.space.value == "box":
            space = Box(self.lower.value, self.upper.value)
        elif self.space.value == "reach":
            space = Shell(self.centre.value, *self.radii.value)
        robot = replace(
            self._base,
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
    return replace(parse_text(scene.constraints_text).apply(UNLIMITED), name="scene")
