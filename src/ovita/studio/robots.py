"""The robot that follows the line: shown in the scene, reported on after a simulation, and sent to through the gate."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.gate import Review, default_log, refuse, release, review
from ovita.io import is_address, rendered
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.studio import html
from ovita.studio.playback import NOBODY, ROBOTS, RobotView, floor
from ovita.studio.sessions import Desk
from ovita.text import length, sentence

_NO_LIMITS = (
    "no robot's limits are in force, so nothing can be verified; choose the robot above and press 'Use its limits'"
)
_HIGH = 0.05  # above the floor [m]; what is less is level for a rover


class RobotPanel:
    """The robot of one tab. Only where `local` may anything be sent.

    `chosen` hears which robot's limits belong to the one that is shown. One whose limits are
    applied, or that a file names, is shown, too.
    """

    def __init__(self, desk: Desk, puppet: RobotView, chosen: Callable[[str], None], *, local: bool) -> None:
        self.desk, self._puppet, self._chosen = desk, puppet, chosen
        gui = desk.client.gui
        self._about: tuple[Any, ...] = ()
        self._limits: Robot | None = None
        self._found: Review | None = None
        self.which = gui.add_dropdown("robot", tuple(ROBOTS), hint="A simulated robot that follows the line")
        self.note = gui.add_html("")
        self.use = gui.add_button("Use its limits", color=html.QUIET, icon="shield-check", visible=False)
        self.check = gui.add_button("Let it follow, and report", icon="robot", disabled=True)
        self.report = gui.add_html("")
        gui.add_html(html.block("<h4>Send</h4>"), visible=local)
        self.gate = gui.add_html("")
        self.to = gui.add_text("send to", "", hint="ros2:/topic, mavlink:udp:HOST:PORT, or a file", visible=local)
        self.ask = gui.add_button("Show what the gate says", color=html.QUIET, icon="shield-check", visible=local)
        self.send = gui.add_button("Send it", icon="send", visible=False)
        self.which.on_update(self._take)
        self.use.on_click(lambda _: self._use())
        self.check.on_click(lambda _: self._simulate())
        self.ask.on_click(lambda _: self._review())
        self.send.on_click(lambda _: self._send())

    def refresh(self) -> None:
        """Have the robot follow the line as it is; what was said of another line is taken away."""
        session = self.desk.controller.session
        before, self._limits, name = self._limits, session.robot, session.robot.name
        applied = before is not session.robot and find_spec("mujoco") is not None
        if applied and name in ROBOTS and name not in (NOBODY, self.which.value):
            self.which.value = name
            self._puppet.choose(name)
        about = (session.current, session.scene, session.robot, self.which.value)
        if about == self._about:
            return
        self._about = about
        self._puppet.follow(session.current, session.scene, session.robot)
        self.note.content = html.soft(_remark(session, str(self.which.value)))
        self.check.disabled = self.which.value == NOBODY
        self.use.visible = self.which.value not in (NOBODY, session.robot.name)
        self._found, self.send.visible = None, False
        self.report.content = self.gate.content = ""

    async def _take(self, event: Any) -> None:
        if event.client is not None:
            self._puppet.choose(str(self.which.value))
            self._chosen(str(self.which.value))
            self.refresh()

    def _use(self) -> None:
        name = str(self.which.value)
        self.desk.controller.act(lambda session: session.change(f"limits: {name}", robot=Robot.preset(name)))

    def _simulate(self) -> None:
        about = self._about
        with self.desk.complaining(), html.busy(self.check, "It follows\u2026"):
            told = reported(self.desk.controller.session, ROBOTS[str(self.which.value)])
            if about == self._about:
                self.report.content = told
        self.check.disabled = self.which.value == NOBODY

    def _review(self) -> None:
        session = self.desk.controller.session
        try:
            if session.robot.workspace is None and session.robot.max_speed is None:
                raise RequestError(_NO_LIMITS)
            self._found = reviewed(session)
        except OvitaError as error:
            self._refuse(error)
            return
        self.gate.content = gate_said(self._found)
        self.send.visible = self._found.released

    def _refuse(self, error: OvitaError) -> None:
        self.gate.content = html.block(f'<p class="bad" data-show>{html.e(sentence(str(error)))}</p>')
        self.desk.complain(str(error))

    def _send(self) -> None:
        found, place = self._found, self.to.value.strip()
        try:
            if found is None or found.result is not self.desk.controller.session.adaptation:
                found = self._found = reviewed(self.desk.controller.session)
            self.gate.content = sent(found, place, self.desk.controller.title)
        except OvitaError as error:
            self._refuse(error)


def reviewed(session: Session) -> Review:
    """What the gate says of the line in force.

    Raises:
        RequestError: If nothing was adapted yet.
    """
    if session.adaptation is None:
        raise RequestError("there is no result to send; say what should change first")
    with tempfile.TemporaryDirectory(prefix="ovita-gate-") as folder:
        path = str(Path(folder) / "result.json")
        session.adaptation.save(path)
        return review(path)


def gate_said(found: Review) -> str:
    """What the gate measured, and whether the result may be sent."""
    state = '<span class="chip good">may be sent</span>' if found.released else '<span class="chip bad">refused</span>'
    parts = [f"<p data-show>{state}</p>", html.listed(found.refusals)]
    told = {title: html.listed(lines) for title, lines in found.sections(terminal=False).items() if lines}
    held, unknown = (sum(check.held is state for check in found.looked) for state in (True, None))
    seen = f"<summary>{held} of {len(found.looked)} checks hold, {unknown} could not be made</summary>"
    parts += [f"<details>{seen}", *(f"<h4>{html.e(title)}</h4>{lines}" for title, lines in told.items()), "</details>"]
    return html.block("".join(parts))


def sent(found: Review, place: str, title: str) -> str:
    """Send what the gate released to an address or a file, log that, and say so.

    Raises:
        OvitaError: If no place is given, the gate refuses, or the other side does not answer.
    """
    if not place:
        raise RequestError("say where to send it: ros2:/topic, mavlink:udp:HOST:PORT, or a file such as path.csv")
    about = {"result": f"studio: {title}"}
    if not found.released:
        refuse(found, place, str(default_log()), about)
    elif not is_address(place):
        rendered(place, found.result.adapted, found.result.scene, found.result.instruction)  # refuses unknown endings
    receipt = release(found, place, str(default_log()), about)
    told = f"Sent to {place}: {receipt.size} bytes, SHA-256 {receipt.sha256[:16]}\u2026; logged in {default_log()}."
    return html.block(f'<p data-show><span class="chip good">sent</span> {html.e(told)}</p>')


def reported(session: Session, model: str) -> str:
    """Let a robot follow the line in physical simulation, and tell reach, tracking, limits and contacts.

    Raises:
        OvitaError: If the simulator is not installed, or the robot reaches nothing of the line.
    """
    from ovita import sim

    sim.require()
    contacts = session.adaptation.contacts if session.adaptation is not None else ()
    report = sim.simulate(session.current, session.scene, model, limits=session.robot, contacts=contacts).report
    colour = "bad" if report.status in sim.FAILED else "warn" if report.status == "slowed" else "good"
    chip = f'<span class="chip {colour}">{html.e(report.status)}</span>'
    return html.block(f"<p data-show>{chip} {html.e(model)}, simulated</p>{html.listed(report.sentences())}")


def _remark(session: Session, robot: str) -> str:
    if robot == NOBODY:
        limits = f"The limits in force are those of {session.robot.name!r}, see Constraints. "
        return f"{limits}Choose a robot: it follows the line as you play, and is reported on."
    high = _above(session.current, session)
    if ROBOTS[robot] == "jackal" and high > _HIGH:
        return f"The line is up to {length(high)} above the floor; a rover stays on the floor and drives below it."
    if session.robot.name == robot:
        return "Its limits are in force."
    return f"It is only shown: the limits in force are those of {session.robot.name!r}, see Constraints."


def _above(path: Trajectory, session: Session) -> float:
    up = session.scene.frame.direction("up")
    return float(((path.positions - floor(path, session.scene) * abs(up)) @ up).max())
