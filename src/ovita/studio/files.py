"""Files in and out of one tab. What is uploaded is data: it is read and checked, and nothing in it is run."""

from __future__ import annotations

import io
import os
import tempfile
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ovita.dialogue.history import SCHEMA
from ovita.dialogue.session import Session
from ovita.errors import FormatError, OvitaError, RobotError
from ovita.io import Task, is_adaptation, is_skill, load_bare, load_robot, load_task, save_trajectory, with_scene
from ovita.io.files import read_text
from ovita.io.json_ import parse_object
from ovita.io.waypoints import covariance_rows
from ovita.paths.robot import PRESETS, Robot, preset_name
from ovita.paths.trajectory import Array, Trajectory
from ovita.result import Adaptation
from ovita.studio import html
from ovita.studio.sessions import Desk

MAX_UPLOAD = 8 * 1024 * 1024
"""Largest file that is taken from a browser [bytes]."""

MAX_WAYPOINTS = 20_000
"""Longest trajectory that the studio opens."""

MAX_TURNS = 1_000
"""Longest session that is taken from a browser."""

SUFFIXES = (".json", ".csv", ".tum", ".txt", ".plan", ".waypoints", ".wpl")


@dataclass(frozen=True)
class Opened:
    """A session made of a file, the file's name, and what a person should know, each a sentence.

    `covariance` is that of the original's positions (N, 6) [m2], where the file holds it.
    """

    session: Session
    title: str
    notes: tuple[str, ...] = ()
    covariance: Array | None = None


def open_file(path: str, template: Session, *, limits: Robot | None = None, upload: bool = False) -> Opened:
    """Open a task, a saved adaptation or a session file; no program in it is run.

    Args:
        path: Of the file.
        template: Whose writer and isolation, and for a bare trajectory whose scene and limits, the session gets.
        limits: What a scene whose file names no robot is limited to; the template's limits where left out.
        upload: Whether it came from a browser; then it may not name files of this machine.
    """
    name, as_json = Path(path).name, path.lower().endswith(".json")
    if as_json and parse_object(read_text(path), path).get("schema") == SCHEMA:
        return _loaded(path, template)
    if as_json and is_adaptation(path):
        result = Adaptation.load(path)
        _check_length(path, result.original, result.adapted)
        return Opened(Session.of(result, writer=template.writer, isolation=template.isolation), name, (_PROGRAM,))
    task = _generated(path) if is_skill(path) else _task_or_scene(path)
    _check_length(path, task.trajectory)
    if upload and task.robot and preset_name(task.robot) not in PRESETS:
        raise FormatError(path, f"{task.robot!r} is no robot of ovita; choose one under Constraints", key="robot")
    held = task.extra.get("covariance")
    covariance = None if held is None else covariance_rows(held, path, len(task.trajectory))
    session, note = _begun(task, path, template, limits) if as_json else _continued(task, path, template)
    return Opened(session, name, (*task.notes, *note), covariance)


def _loaded(path: str, template: Session) -> Opened:
    """A session as its file holds it."""
    session = Session.load(path, writer=template.writer, isolation=template.isolation)
    steps = session.history.steps
    if len(steps) > MAX_TURNS:
        raise FormatError(path, f"has {len(steps)} turns; the studio takes up to {MAX_TURNS}")
    _check_length(path, session.original, *(step.adaptation.adapted for step in steps))
    return Opened(session, Path(path).name, (_PROGRAM,) if steps else ())


def _begun(task: Task, path: str, template: Session, limits: Robot | None) -> tuple[Session, tuple[str, ...]]:
    """The session of a task with its own scene and limits, and what to say of these."""
    robot = _robot_of(task, path) or limits or template.robot
    said = f"limits now: {html.limits_of(robot)} Those of the file before do not go along"
    session = Session(task.trajectory, task.scene, robot, template.writer, isolation=template.isolation)
    return session, (said,) if robot != template.robot else ()


def _continued(task: Task, path: str, template: Session) -> tuple[Session, tuple[str, ...]]:
    """The session of bare waypoints in the scene, and within the limits, of the one before."""
    robot, placed = _robot_of(task, path) or template.robot, with_scene(task, template.scene)
    options = replace(template.constraints, pinned=())
    session = Session(placed.trajectory, placed.scene, robot, template.writer, options, template.isolation)
    notes = placed.notes[len(task.notes) :]
    return session, (*notes, "the file holds waypoints only; the scene and the limits stay as they were")


def _robot_of(task: Task, path: str) -> Robot | None:
    try:
        return load_robot(task.robot) if task.robot else None
    except RobotError as error:
        raise FormatError(path, str(error), key="robot") from None


def _task_or_scene(path: str) -> Task:
    """A task; of a file with objects and no trajectory, its scene with a path that stands still."""
    bare = load_bare(path)
    note = "the file holds no trajectory; say from where to where"
    return load_task(path) if bare is None else replace(bare, notes=(note,))


def _generated(path: str) -> Task:
    from ovita.sources.skills import Skill

    skill = Skill.load(path)
    return replace(
        skill.generate().task(),
        notes=(f"this is what the skill generates as it was shown ({skill.kind})", *skill.notes),
    )


def open_upload(name: str, content: bytes, template: Session, *, limits: Robot | None = None) -> Opened:
    """Open what a browser sent, as `open_file` does."""
    suffix = Path(name).suffix.lower()
    shown = Path(name).name or "upload"
    shown = shown if len(shown) <= 80 else f"{shown[:70]}\u2026{suffix[:9]}"
    if len(content) > MAX_UPLOAD:
        raise FormatError(shown, too_large(len(content)))
    if suffix not in SUFFIXES:
        raise FormatError(shown, "the studio opens .json and .csv files, TUM text and drone missions")
    with tempfile.TemporaryDirectory(prefix="ovita-upload-") as folder:
        path = Path(folder) / f"upload{suffix}"
        path.write_bytes(content)
        try:
            opened = open_file(str(path), template, limits=limits, upload=True)
        except FormatError as error:
            raise FormatError(shown, error.problem, key=error.key, index=error.index) from None
        except OvitaError as error:
            raise FormatError(shown, str(error).replace(str(path), shown)) from None
    return replace(opened, title=shown)


def too_large(size: int) -> str:
    """Why a file of that size is not taken."""
    return f"has {size / 2**20:.0f} MB; the studio takes files of up to {MAX_UPLOAD // 2**20} MB"


def exported(kind: str, session: Session, title: str = "") -> tuple[str, bytes]:
    """The name and content of a file to download: "adaptation", "json", "csv", "html" or "session".

    The name begins with that of the scene, and a result that is not simply done bears its verdict in it.
    """
    if kind == "html":
        return export_name("page", ".html", session, title), _page(session).encode()
    if kind == "adaptation" and session.adaptation is None:
        raise FormatError("adaptation", "there is no result yet; say what should change first")
    result = session.adaptation
    what, ending = {"json": ("trajectory", ".json"), "csv": ("trajectory", ".csv")}.get(kind, (kind, ".json"))
    name = export_name(what, ending, session, title)
    said, verdict = ("", "") if result is None else (result.instruction, result.verdict)
    with tempfile.TemporaryDirectory(prefix="ovita-export-") as folder:
        path = str(Path(folder) / name)
        if what == "trajectory":
            save_trajectory(path, session.current, session.scene, said, verdict=verdict)
        elif kind == "session" or result is None:
            session.save(path)
        else:
            result.save(path)
        return name, Path(path).read_bytes()


def export_name(what: str, ending: str, session: Session, title: str) -> str:
    """Such as "tabletop-trajectory-limited.csv": scene, what it is, and the verdict where it is not simply done."""
    plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in Path(title).stem)
    scene = plain.strip("-")[:40].removesuffix(f"-{what}")
    mark = session.adaptation.mark if session.adaptation is not None and what != "session" else ""
    return "-".join(part for part in (scene, what) if part) + mark + ending


def _page(session: Session) -> str:
    from ovita import plots

    result = session.adaptation
    notes = [] if result is None else [*filter(None, [result.verdict]), *result.explanation.split("\n")]
    return plots.interactive(
        session.original,
        session.current,
        session.scene,
        robot=session.robot,
        title="; ".join(step.said for step in session.steps) or "Trajectory",
        notes=notes,
    )


def _check_length(path: str, *trajectories: Trajectory) -> None:
    most = max(map(len, trajectories))
    if most > MAX_WAYPOINTS:
        raise FormatError(path, f"has {most} waypoints; the studio opens up to {MAX_WAYPOINTS}")


_PROGRAM = (
    "This file holds a program that made the red line. None of it was run; it runs in the sandbox once you turn a knob"
)


_KINDS = {
    "adaptation": ("Result (JSON)", "What was adapted, with its program, its verdict and its explanation"),
    "json": ("Trajectory (JSON)", "The red line with its scene, to adapt again"),
    "csv": ("Trajectory (CSV)", "The red line's waypoints"),
    "html": ("Interactive page (HTML)", "A page to turn and zoom, for people without ovita"),
    "session": ("Whole session", "Every turn, to go on elsewhere; no keys are in it"),
}


class FilesPanel:
    """Opening and saving in one tab.

    Args:
        opened, again, returned: Called with an opened session, to begin again, and with the name of an earlier session.
        offered, earlier: What can be opened without an upload: shown name to path, and to a session's name.
        limits: Of scenes whose file names no robot.
    """

    def __init__(
        self,
        desk: Desk,
        *,
        opened: Callable[[Opened], None],
        again: Callable[[], None],
        offered: dict[str, str],
        earlier: Callable[[], dict[str, str]],
        returned: Callable[[str], None],
        limits: Robot,
    ) -> None:
        self.desk, self._opened, self._limits, self._earlier = desk, opened, limits, earlier
        gui = desk.client.gui
        size = MAX_UPLOAD // 2**20
        taken = "A scene, a result or a session (.json), or waypoints (.csv)"
        gui.add_html(html.section("Open", f"{taken}, up to {size} MB and {MAX_WAYPOINTS} waypoints."))
        self.upload = gui.add_upload_button("Upload a file", icon="upload", mime_type=",".join(SUFFIXES))
        self.upload.on_upload(lambda _: self._uploaded())
        if offered:
            self.which = gui.add_dropdown("at hand", tuple(offered), hint="Files of the folder, and shipped scenes")
            gui.add_button("Open", icon="folder-open").on_click(lambda _: self._open(offered.get(self.which.value)))
        gui.add_button("Begin again", color=html.QUIET, icon="refresh").on_click(lambda _: again())
        self.before = gui.add_dropdown("earlier", ("",), hint="Sessions that this browser had before")
        self.back = gui.add_button("Go back to it", color=html.QUIET, icon="history")
        self.back.on_click(lambda _: returned(earlier().get(self.before.value, "")))
        self.refresh()
        gui.add_html(html.block("<h4>Save</h4>"))
        for kind, (label, hint) in _KINDS.items():
            button = gui.add_button(label, color=(228, 236, 243), icon="download", hint=hint)
            button.on_click(lambda _, kind=kind: self._export(kind))
        picture = gui.add_button("Picture (PNG)", color=(228, 236, 243), icon="photo", hint="The scene as you see it")
        picture.on_click(lambda _: self._picture())

    def refresh(self) -> None:
        """Show the sessions that this browser had before."""
        names = tuple(self._earlier())
        self.before.visible = self.back.visible = bool(names)
        if names and names != self.before.options:
            self.before.options, self.before.value = names, names[0]

    def _uploaded(self) -> None:
        file = self.upload.value
        with self.desk.complaining():
            self._opened(open_upload(file.name, file.content, self.desk.controller.session, limits=self._limits))

    def _open(self, path: str | None) -> None:
        with self.desk.complaining():
            if path:
                self._opened(open_file(path, self.desk.controller.session, limits=self._limits))

    def _export(self, kind: str) -> None:
        with self.desk.complaining():
            name, content = exported(kind, self.desk.controller.session, self.desk.controller.title)
            self.desk.client.send_file_download(name, content, save_immediately=True)
            result = self.desk.controller.session.adaptation
            if result is not None and result.status != "done" and kind != "session":
                self.desk.tell(f"Saved as {name}: {result.message}")

    def _picture(self) -> None:
        import imageio.v3 as images

        client = self.desk.client
        name = export_name("picture", ".png", self.desk.controller.session, self.desk.controller.title)
        try:
            height, width = client.camera.image_height, client.camera.image_width
            seen = client.get_render(height, width, transport_format="png", timeout=20.0)
        except (RuntimeError, TimeoutError, AssertionError):
            self.desk.complain("The browser gave no picture; try again with the tab in front.")
            return
        alpha = seen[..., 3:4] / 255.0
        flat = (seen[..., :3] * alpha + 255.0 * (1.0 - alpha)).astype("uint8")
        stream = io.BytesIO()
        images.imwrite(stream, flat, extension=".png")
        client.send_file_download(name, stream.getvalue(), save_immediately=True)


def offered_files(paths: Sequence[str]) -> dict[str, str]:
    """The files that a studio offers, from the files and folders it was started with: shown name to path.

    What a camera saw is none of them: that is for the Look panel.
    """
    from ovita.perceive.pictures import is_view

    files: list[str] = []
    for path in paths:
        try:
            inside = sorted(Path(path).iterdir()) if os.path.isdir(path) else []
        except OSError as error:
            raise FormatError(path, f"cannot be read: {error.strerror}") from None
        if not is_view(path):
            known = [str(p) for p in inside if p.suffix.lower() in SUFFIXES and p.is_file()]
            files += known if os.path.isdir(path) else [path]
    return by_name(files)


def by_name(paths: Iterable[str]) -> dict[str, str]:
    """Paths by their last part, or by the whole of what another has the last part of."""
    found: dict[str, str] = {}
    for path in paths:
        name = os.path.basename(os.path.normpath(path))
        found[name if name not in found else path] = path
    return found
