"""`ovita chat` and `ovita studio`: conversations about one trajectory, on a terminal and in the browser."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click

from ovita.cli.common import (
    BASE_URL,
    ISOLATION,
    LABELS,
    WRITER,
    choices_from,
    constraints_from,
    literal,
    notes_on,
    notes_on_writer,
    plain,
    robot_from,
    shared,
    show,
    show_notes,
    waiting,
)
from ovita.cli.line import Keeper, at_a_terminal, completed, lines
from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.io import WRITTEN, Task, load_bare, load_robot, open_task, save_trajectory, writable
from ovita.limits import ConstraintOptions
from ovita.paths.frame import Frame
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory, standing_still
from ovita.policy.sandbox import known_isolation
from ovita.request import FeedbackOn
from ovita.sources.words import begun
from ovita.text import counted, point
from ovita.writers.base import writer_named

HELP = """Say what should change, then what is not right yet: "a bit more", "no, only near the cup", "undo the speed",
"the other cup", "make it 0.3", "again", "start over". What you say is about the current trajectory; begin with a slash
for more:
  /original TEXT   add TEXT to what you said and apply all of it to the original again
  /current TEXT    apply TEXT to the current trajectory (the same as saying it)
  /accept          do what was understood, as "yes" does
  /set NAME=VALUE  turn a knob of the last policy and run it again
  /undo  /redo     take the last turn back; bring it back again
  /history         what was said so far
  /knobs /objects  what can be turned; what is in the scene
  /why             the explanation in plain words
  /code            the last policy
  /plot FILE       draw original and current (.png, .svg, .pdf, .html)
  /save FILE       save the last result (.json) or the current trajectory (.csv, .mcap, .plan, ...)
  /resume          go on with the talk about this file that was kept before
  /quit            leave
A colon does for the slash. At a terminal the tab key completes commands and names, and every talk is kept.
Where a reading is not certain, it is shown first; answer "yes", "no", or what is different: "no, 10 cm".
Where a later turn loses what an earlier one asked for, it says so; answer "keep it" to have it again."""


@click.command()
@click.argument("file", metavar="FILE")
@click.option("--journal", metavar="FILE", help="Keep every turn in FILE (.jsonl), and go on from it if it exists.")
@click.option("--resume", is_flag=True, help="Go on with the last talk about FILE that was kept.")
@shared
def chat(file: str, journal: str | None, resume: bool, **options: Any) -> None:
    """Adapt the trajectory in FILE in a conversation; type /help for what you can say.

    At a terminal every talk is kept in ~/.local/state/ovita/chat, the last 20 about a file.

    Where FILE holds objects and no trajectory, the first sentence makes one: "from the box to the plate, slowly".
    """
    task = _task_or_scene(file, options)
    session = Session(
        task.trajectory,
        task.scene,
        robot_from(task, options["robot"], options["max_speed"]),
        writer_named(options["writer"], base_url=options["base_url"], temperature=options["temperature"]),
        constraints_from(options),
        options["isolation"],
    )
    if journal and os.path.exists(journal):
        session = Session.resume(journal, writer=session.writer, isolation=session.isolation)
        click.echo(plain(f"{journal}: {counted(len(session.steps), 'turn')} so far; /history lists them."))
    elif journal:
        session.keep(journal)
    keeper = Keeper(file) if not journal and (resume or at_a_terminal()) else None
    if resume:
        session = _resumed(session, keeper)
    names = ", ".join(task.scene.names) or "none"
    held = "no trajectory yet" if session.bare else f"{len(task.trajectory)} waypoints"
    click.echo(plain(f"{file}: {held}; objects: {names}."))
    show_notes((*notes_on(task, options["robot"]), *notes_on_writer(session.writer)))
    click.echo("Say from where to where, or /help." if session.bare else "Say what should change, or /help.")
    if keeper is not None and keeper.earlier is not None and not resume:
        click.echo("An earlier talk about this file is kept; /resume goes on with it.")
    typed = lines(lambda begun: _candidates(session, begun))
    for line in typed:
        try:
            if line[1:] == "resume" and line[0] in _MARKS:
                session = _resumed(session, keeper)
            elif not _obey(session, line):
                break
            if keeper is not None:
                keeper.keep(session)
        except OvitaError as error:
            click.echo(f"error: {plain(str(error))}")
        except KeyboardInterrupt:
            click.echo("\nStopped; nothing changed.")
    if keeper is not None and session.kept:
        click.echo(plain(f"Kept; go on with: ovita chat {shlex.quote(file)} --resume"))


_MARKS = ("/", ":")
"""What a command begins with."""


def _resumed(session: Session, keeper: Keeper | None) -> Session:
    """The kept talk about the same file, with the writer of this one."""
    if keeper is None or keeper.earlier is None:
        raise RequestError("no earlier talk about this file is kept; say what should change")
    if session.steps:
        raise RequestError("this talk has begun; end it with /quit, and go on with the last one by --resume")
    found = Session.resume(str(keeper.earlier), writer=session.writer, isolation=session.isolation)
    click.echo(plain(f"{counted(len(found.steps), 'turn')} so far; /history lists them."))
    return found


def _candidates(session: Session, begun: str) -> list[str]:
    """What the end of a line may become."""
    knobs = [parameter.name for parameter in session.adaptation.parameters] if session.adaptation else []
    return completed(begun, COMMANDS, session.scene.names, knobs)


def _task_or_scene(file: str, options: dict[str, Any]) -> Task:
    """The task of a file; of one with objects and no trajectory, its scene with a path that stands still."""
    bare = load_bare(file) if options["scene_file"] is None else None
    if bare is None:
        return open_task(file, scene_file=options["scene_file"], frame=options["frame"], choices=choices_from(options))
    scene, robot, instruction = bare
    if options["frame"] is not None:
        scene = replace(scene, frame=Frame(options["frame"]))
    return Task(standing_still(), scene, instruction, path=file, robot=robot)


def _obey(session: Session, line: str) -> bool:
    """Do one line; False ends the conversation."""
    if line[0] not in _MARKS:
        _say(session, line, "current")
        return True
    word, _, rest = line[1:].partition(" ")
    rest = rest.strip()
    if word in ("quit", "exit", "q"):
        return False
    if word in ("original", "current"):
        _say(session, rest, "original" if word == "original" else "current")
    elif word in _WORDS:
        click.echo(plain(_WORDS[word](session)))
    elif word in _DEEDS:
        _DEEDS[word](session, rest)
    else:
        near = get_close_matches(word, COMMANDS, n=1)
        hint = f"did you mean /{near[0]}?" if near else "/help lists them"
        raise RequestError(f"unknown command '/{word}'; {hint}")
    return True


def _say(session: Session, text: str, on: FeedbackOn) -> None:
    with waiting("writing a policy") as tell:
        result = begun(session, text, progress=tell) if session.bare else session.say(text, on=on, progress=tell)
    if result.writer.kind == "feedback":
        click.echo(plain(result.message))
    else:
        show(result)
    if session.pending is not None:
        click.echo('Say "yes" to do it, "no", or what is different, such as "no, 10 cm".')


def _set(session: Session, rest: str) -> None:
    name, equals, value = rest.partition("=")
    if not equals:
        raise RequestError("turn a knob like this: /set left=0.3")
    show(session.tune({name.strip(): literal(value)}))


def _undo(session: Session) -> str:
    last = session.steps[-1].said if session.steps else ""
    return f"Took back: {last} (/redo brings it back)." if session.undo() else "There is nothing to undo."


def _redo(session: Session) -> str:
    return f"Brought back: {session.steps[-1].said}." if session.redo() else "There is nothing to redo."


def _history(session: Session) -> str:
    turns = enumerate(session.steps, start=1)
    lines = [f"{i}. on {t.feedback_on}: {t.said}  [{LABELS[t.adaptation.status]}]" for i, t in turns]
    return "\n".join(lines) or "Nothing was said yet."


def _objects(session: Session) -> str:
    lines = [f"  {item.name} at {point(item.position.tolist())} m" for item in session.scene]
    return "\n".join(lines) or "The scene holds no objects."


def _last(session: Session) -> Any:
    if session.adaptation is None:
        raise RequestError("there is no result yet; say what should change first")
    return session.adaptation


def _plot(session: Session, rest: str) -> None:
    from dataclasses import replace

    from ovita.cli.adapt_ import draw

    path = rest or "ovita.png"
    draw(replace(_last(session), original=session.original), path)
    click.echo(f"wrote {path}")


def _save(session: Session, rest: str) -> None:
    path = rest or f"result{session.adaptation.mark if session.adaptation else ''}.json"
    if path.lower().endswith(".json"):
        _last(session).save(path)
    elif writable(path):
        verdict = session.adaptation.verdict if session.adaptation else ""
        for note in save_trajectory(path, session.current, session.scene, verdict=verdict):
            click.echo(f"note: {plain(note)}")
    else:
        raise RequestError(f"{path}: results are saved as .json, trajectories as {', '.join(WRITTEN[1:])}")
    click.echo(f"wrote {path}")


_WORDS: dict[str, Callable[[Session], str]] = {
    "undo": _undo,
    "redo": _redo,
    "history": _history,
    "knobs": lambda session: "\n".join(f"  {parameter.line}" for parameter in _last(session).parameters),
    "objects": _objects,
    "why": lambda session: _last(session).explanation,
    "code": lambda session: _last(session).code,
    "help": lambda session: HELP,
}
"""What is answered in words."""

_DEEDS: dict[str, Callable[[Session, str], None]] = {
    "accept": lambda session, rest: show(session.accept()),
    "set": _set,
    "plot": _plot,
    "save": _save,
}

COMMANDS = tuple(sorted({"quit", "original", "current", "resume", *_WORDS, *_DEEDS}))
"""What may follow a slash."""


@click.command()
@click.argument("files", metavar="[FILE|FOLDER]...", nargs=-1)
@click.option("--host", default="127.0.0.1", show_default=True, help="Address to listen on.")
@click.option("--port", type=click.IntRange(0, 65535), default=8765, show_default=True, help="0 takes any free one.")
@click.option(
    "--token",
    default="",
    envvar="OVITA_STUDIO_TOKEN",
    metavar="TEXT",
    help="What a browser must bring; 'auto' makes one. Needed where other machines can reach the studio.",
)
@WRITER
@BASE_URL
@click.option(
    "--robot",
    metavar="NAME|FILE",
    help="Limits to begin with: a name as for adapt, or a file. [scene's]",
)
@click.option("--sessions", type=click.Path(path_type=Path), help="Folder where sessions are kept.")
@ISOLATION
def studio(
    files: tuple[str, ...],
    host: str,
    port: int,
    token: str,
    writer: str,
    base_url: str | None,
    robot: str | None,
    sessions: Path | None,
    isolation: str,
) -> None:
    """Adapt trajectories in the browser; begins with the first FILE, or with a shipped scene."""
    from ovita.studio import Studio, StudioSettings
    from ovita.studio.sessions import default_folder

    limits = load_robot(robot) if robot else Robot.preset("none")
    template = Session(
        Trajectory([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [0.1, 0.1]),
        robot=limits,
        writer=writer_named(writer, base_url=base_url, temperature=0.1),
        constraints=ConstraintOptions(),
        isolation=known_isolation(isolation),
    )
    server = Studio(StudioSettings(template, files, host, port, token, sessions or default_folder()))
    made = token == "auto"
    told = "" if made or not token else "; it asks for the token"
    click.echo(f"The studio is open at {server.url if made else server.url.partition('?')[0]}{told}")
    click.echo("Ctrl-C ends it; every session is kept and goes on when it starts again.")
    try:
        server.wait()
    finally:
        server.stop()
