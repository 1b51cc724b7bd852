"""Files in and out. What is uploaded is data: it is read and checked, and nothing in it is run."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from ovita.dialogue.history import SCHEMA
from ovita.dialogue.session import Session
from ovita.errors import FormatError, OvitaError, RobotError
from ovita.io import is_adaptation, load_robot, load_task, save_trajectory
from ovita.io.files import read_text
from ovita.io.json_ import parse_object
from ovita.io.links import with_scene
from ovita.paths.robot import PRESETS
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation

MAX_UPLOAD = 8 * 1024 * 1024
"""Largest file that is taken from a browser [bytes]."""

MAX_WAYPOINTS = 20_000
"""Longest trajectory that the studio opens."""

MAX_TURNS = 1_000
"""Longest session that is taken from a browser."""

SUFFIXES = (".json", ".csv", ".tum", ".txt", ".plan", ".waypoints", ".wpl")


@dataclass(frozen=True)
class Opened:
    """A session made of a file.

    Args:
        session: Ready to go on with.
        title: The file's name.
        notes: What a person should know, each a sentence.
    """

    session: Session
    title: str
    notes: tuple[str, ...] = ()


def open_file(path: str, template: Session, *, upload: bool = False) -> Opened:
    """Open a task, a saved adaptation or a session file; no program in it is run.

    Args:
        path: Of the file.
        template: Whose writer and isolation, and for a bare trajectory whose scene and limits, the session gets.
        upload: Whether it came from a browser; then it may not name files of this machine.

    Raises:
        FormatError: If the file is none of these, or longer than the studio takes.
    """
    name = Path(path).name
    if path.lower().endswith(".json") and parse_object(read_text(path), path).get("schema") == SCHEMA:
        session = Session.load(path, writer=template.writer, isolation=template.isolation)
        if len(session.history.steps) > MAX_TURNS:
            raise FormatError(path, f"has {len(session.history.steps)} turns; the studio takes up to {MAX_TURNS}")
        for step in session.history.steps:
            _check_length(path, step.adaptation.adapted)
        _check_length(path, session.original)
        return Opened(session, name, (_PROGRAM,) if session.history.steps else ())
    if path.lower().endswith(".json") and is_adaptation(path):
        result = Adaptation.load(path)
        _check_length(path, result.original)
        _check_length(path, result.adapted)
        return Opened(Session.of(result, writer=template.writer, isolation=template.isolation), name, (_PROGRAM,))
    task = load_task(path)
    _check_length(path, task.trajectory)
    bare = not path.lower().endswith(".json")
    if bare:
        task = with_scene(task, template.scene)
    notes = list(task.notes)
    if upload and task.robot and task.robot.lower() not in PRESETS:
        raise FormatError(path, f"{task.robot!r} is no robot of ovita; choose one under Constraints", key="robot")
    try:
        robot = load_robot(task.robot) if task.robot else template.robot
    except RobotError as error:
        raise FormatError(path, str(error), key="robot") from None
    if bare:
        notes.append("the file holds waypoints only; the scene stays as it was")
    options = replace(template.constraints, pinned=())
    session = Session(task.trajectory, task.scene, robot, template.writer, options, template.isolation)
    return Opened(session, name, tuple(notes))


def open_upload(name: str, content: bytes, template: Session) -> Opened:
    """Open what a browser sent, as `open_file` does.

    Raises:
        FormatError: Also if the file is too large or of another kind.
    """
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
            opened = open_file(str(path), template, upload=True)
        except FormatError as error:
            raise FormatError(shown, error.problem, key=error.key, index=error.index) from None
        except OvitaError as error:
            raise FormatError(shown, str(error).replace(str(path), shown)) from None
    return replace(opened, title=shown)


def too_large(size: int) -> str:
    """Why a file of that size is not taken."""
    return f"has {size / 2**20:.0f} MB; the studio takes files of up to {MAX_UPLOAD // 2**20} MB"


def in_folder(folder: str) -> list[str]:
    """The files of a folder that the studio can open, by name.

    Raises:
        FormatError: If the folder cannot be read.
    """
    try:
        names = sorted(p.name for p in Path(folder).iterdir() if p.suffix.lower() in SUFFIXES and p.is_file())
    except OSError as error:
        raise FormatError(folder, f"cannot be read: {error.strerror}") from None
    return names


def exported(kind: str, session: Session) -> tuple[str, bytes]:
    """A file to download: its name and its content.

    Args:
        kind: "adaptation", "json", "csv", "html" or "session".
        session: What to write.

    Raises:
        FormatError: If there is nothing of that kind yet.
        MissingExtra: If "html" is asked for and plotly is not installed.
    """
    if kind == "html":
        return "ovita.html", _page(session).encode()
    if kind == "adaptation" and session.adaptation is None:
        raise FormatError("adaptation", "there is no result yet; say what should change first")
    name = {"adaptation": "adaptation.json", "json": "trajectory.json", "csv": "trajectory.csv"}.get(
        kind, "session.json"
    )
    with tempfile.TemporaryDirectory(prefix="ovita-export-") as folder:
        path = str(Path(folder) / name)
        if kind == "adaptation" and session.adaptation is not None:
            session.adaptation.save(path)
        elif kind == "session":
            session.save(path)
        else:
            said = session.adaptation.instruction if session.adaptation is not None else ""
            save_trajectory(path, session.current, session.scene, said)
        return name, Path(path).read_bytes()


def _page(session: Session) -> str:
    from ovita import plots

    result = session.adaptation
    return plots.interactive(
        session.original,
        session.current,
        session.scene,
        robot=session.robot,
        title="; ".join(step.said for step in session.steps) or "Trajectory",
        notes=_lines(result),
    )


def _lines(result: Adaptation | None) -> Sequence[str]:
    return result.explanation.split("\n") if result is not None else ()


def _check_length(path: str, trajectory: Trajectory) -> None:
    if len(trajectory) > MAX_WAYPOINTS:
        raise FormatError(path, f"has {len(trajectory)} waypoints; the studio opens up to {MAX_WAYPOINTS}")


_PROGRAM = (
    "This file holds a program that made the red line. None of it was run; it runs in the sandbox once you turn a knob"
)
