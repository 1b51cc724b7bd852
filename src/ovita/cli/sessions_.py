"""`ovita chat` and `ovita studio`: conversations about one trajectory, on a terminal and in the browser."""

from __future__ import annotations

import hashlib
import os
import shlex
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import click
from click import option

from ovita.cli import common
from ovita.dialogue.session import Session
from ovita.errors import OvitaError, RequestError
from ovita.io import WRITTEN, Task, load_robot, save_trajectory, writable
from ovita.io.files import make_folder, state_folder
from ovita.paths.trajectory import Trajectory
from ovita.policy.sandbox import known_isolation
from ovita.request import FeedbackOn
from ovita.sources.words import begun
from ovita.text import counted, point

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
@option("--journal", metavar="FILE", help="Keep every turn in FILE (.jsonl), and go on from it if it exists.")
@option("--resume", is_flag=True, help="Go on with the last talk about FILE that was kept.")
@common.shared
def chat(file: str, journal: str | None, resume: bool, **options: Any) -> None:
    """Adapt the trajectory in FILE in a conversation; type /help for what you can say.

    At a terminal every talk is kept in ~/.local/state/ovita/chat, the last 20 about a file.

    Where FILE holds objects and no trajectory, the first sentence makes one: "from the box to the plate, slowly".
    """
    task = common.bare_task(file, options) or common.task_at(file, options)
    session = _opened(task, journal, options)
    keeper = Keeper(file) if not journal and (resume or at_a_terminal()) else None
    if resume:
        session = _resumed(session, keeper)
    names = ", ".join(task.scene.names) or "none"
    held, what = f"{len(task.trajectory)} waypoints", "what should change"
    if session.bare:
        held, what = "no trajectory yet", "from where to where"
    common.say(f"{file}: {held}; objects: {names}.")
    common.show_notes((*common.notes_on(task, options["robot"]), *common.notes_on_writer(session.writer)))
    click.echo(f"Say {what}, or /help.")
    if keeper is not None and keeper.earlier is not None and not resume:
        click.echo("An earlier talk about this file is kept; /resume goes on with it.")
    session = _talked(session, keeper)
    if keeper is not None and session.kept:
        common.say(f"Kept; go on with: ovita chat {shlex.quote(file)} --resume")


def _opened(task: Task, journal: str | None, options: dict[str, Any]) -> Session:
    """A conversation about a task, or the one that a journal holds."""
    robot, writer = common.robot_from(task, options["robot"], options["max_speed"]), common.writer_from(options)
    limits = common.constraints_from(options)
    session = Session(task.trajectory, task.scene, robot, writer, limits, options["isolation"])
    if journal and os.path.exists(journal):
        session = Session.resume(journal, writer=session.writer, isolation=session.isolation)
        common.say(f"{journal}: {counted(len(session.steps), 'turn')} so far; /history lists them.")
        _say_what_waits(session)
    elif journal:
        session.keep(journal)
    return session


def _say_what_waits(session: Session) -> None:
    """Say again what was proposed last, if it waits for a yes."""
    if session.pending is not None:
        common.say(f"This waits for a yes: {session.pending.explanation}")


def _talked(session: Session, keeper: Keeper | None) -> Session:
    """The conversation after all lines that were typed; another one where an earlier talk was resumed."""
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
            click.echo(f"error: {common.plain(str(error))}")
        except KeyboardInterrupt:
            click.echo("\nStopped; nothing changed.")
        except Exception as error:  # a talk outlives a defect of the program
            click.echo(f"error: {_defect(error)}")
    return session


def _defect(error: Exception) -> str:
    """What went wrong in the program itself, in one sentence, with where."""
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{os.path.basename(frame.filename)}, line {frame.lineno}"
    return f"a defect in ovita ({type(error).__name__}: {error}; {where}); nothing changed. Please report it."


_MARKS = ("/", ":")
"""What a command begins with."""


def _resumed(session: Session, keeper: Keeper | None) -> Session:
    """The kept talk about the same file, with the writer of this one."""
    if keeper is None or keeper.earlier is None:
        raise RequestError("no earlier talk about this file is kept; say what should change")
    if session.steps:
        raise RequestError("this talk has begun; end it with /quit, and go on with the last one by --resume")
    found = Session.resume(str(keeper.earlier), writer=session.writer, isolation=session.isolation)
    common.say(f"{counted(len(found.steps), 'turn')} so far; /history lists them.")
    _say_what_waits(found)
    return found


def _candidates(session: Session, begun: str) -> list[str]:
    """What the end of a line may become."""
    knobs = [parameter.name for parameter in session.adaptation.parameters] if session.adaptation else []
    return completed(begun, COMMANDS, session.scene.names, knobs)


LEAVING = frozenset(("quit", "exit", "bye", "q"))


def _obey(session: Session, line: str) -> bool:
    """Do one line; False ends the conversation."""
    word, _, rest = line[1:].partition(" ") if line[0] in _MARKS else ("current", "", line)
    if word in LEAVING or line.lower() in LEAVING - {"q"}:
        return False
    if word in _WORDS:
        common.say(_WORDS[word](session))
    elif word in _DEEDS:
        _DEEDS[word](session, rest.strip())
    else:
        near = get_close_matches(word, COMMANDS, n=1)
        hint = f"did you mean /{near[0]}?" if near else "/help lists them"
        raise RequestError(f"unknown command '/{word}'; {hint}")
    return True


def _say(session: Session, text: str, on: FeedbackOn) -> None:
    with common.waiting("writing a policy") as tell:
        result = begun(session, text, progress=tell) if session.bare else session.say(text, on=on, progress=tell)
    if result.writer.kind == "feedback":
        common.say(result.message)
    else:
        common.show(result)
    if session.pending is not None:
        click.echo('Say "yes" to do it, "no", or what is different, such as "no, 10 cm".')


def _set(session: Session, rest: str) -> None:
    name, equals, value = rest.partition("=")
    if not equals:
        raise RequestError("turn a knob like this: /set left=0.3")
    common.show(session.tune({name.strip(): common.literal(value)}))


def _undo(session: Session) -> str:
    last = session.steps[-1].said if session.steps else ""
    return f"Took back: {last} (/redo brings it back)." if session.undo() else "There is nothing to undo."


def _history(session: Session) -> str:
    turns = enumerate(session.steps, start=1)
    lines = [f"{i}. on {t.feedback_on}: {t.said}  [{common.LABELS[t.adaptation.status]}]" for i, t in turns]
    return "\n".join(lines) or "Nothing was said yet."


def _objects(session: Session) -> str:
    lines = [f"  {item.name} at {point(item.position.tolist())} m" for item in session.scene]
    return "\n".join(lines) or "The scene holds no objects."


def _last(session: Session) -> Any:
    if session.adaptation is None:
        undone = "the path is as it was at first: say what should change, or /redo" if session.history.steps else ""
        raise RequestError(undone or "there is no result yet; say what should change first")
    return session.adaptation


def _plot(session: Session, rest: str) -> None:
    from ovita.cli.adapt_ import draw

    path = rest or "ovita.png"
    draw(replace(_last(session), original=session.original), path)
    click.echo(f"wrote {path}")


def _save(session: Session, rest: str) -> None:
    path = rest or f"result{getattr(session.adaptation, 'mark', '')}.json"
    if path.lower().endswith(".json"):
        _last(session).save(path)
    elif writable(path):
        verdict = getattr(session.adaptation, "verdict", "")
        lost = save_trajectory(path, session.current, session.scene, verdict=verdict)
        common.say(*(f"note: {note}" for note in lost))
    else:
        raise RequestError(f"{path}: results are saved as .json, trajectories as {', '.join(WRITTEN[1:])}")
    click.echo(f"wrote {path}")


_WORDS: dict[str, Callable[[Session], str]] = {
    "undo": _undo,
    "redo": lambda s: f"Brought back: {s.steps[-1].said}." if s.redo() else "There is nothing to redo.",
    "history": _history,
    "knobs": lambda session: "\n".join(f"  {parameter.line}" for parameter in _last(session).parameters),
    "objects": _objects,
    "why": lambda session: _last(session).explanation,
    "code": lambda session: _last(session).code,
    "help": lambda session: HELP,
}
"""What is answered in words."""

_DEEDS: dict[str, Callable[[Session, str], None]] = {
    "original": lambda session, rest: _say(session, rest, "original"),
    "current": lambda session, rest: _say(session, rest, "current"),
    "accept": lambda session, rest: common.show(session.accept()),
    "set": _set,
    "plot": _plot,
    "save": _save,
}

COMMANDS = tuple(sorted({"quit", "resume", *_WORDS, *_DEEDS}))
"""What may follow a slash."""


MOST_LINES = 1000
"""Lines of history that are kept."""

MOST_TALKS = 20
"""Talks about one file that are kept."""

Candidates = Callable[[str], Sequence[str]]
"""What the end of a line may become: given the line, whole replacements for its last word."""


def at_a_terminal() -> bool:
    """Whether a person types: only then is there a history, and every talk kept."""
    return sys.stdin.isatty()


def lines(candidates: Candidates) -> Iterator[str]:
    """The lines that are typed or piped in, without blank ones."""
    with _edited(candidates):
        while True:
            try:
                line = input("> ").strip()
            except EOFError:
                click.echo()
                return
            except KeyboardInterrupt:
                click.echo("\n/save FILE keeps the result, /quit leaves.")
                continue
            if line:
                yield line


@contextmanager
def _edited(candidates: Candidates) -> Iterator[None]:
    """Arrows, history and completion while the block runs, where there is a terminal and readline."""
    history = _prepared(candidates) if at_a_terminal() else None
    try:
        yield
    finally:
        if history is not None:
            _write_history(history)


def _prepared(candidates: Candidates) -> Path | None:
    """Set readline up; the file that its history goes to, if there can be one."""
    try:
        import readline
    except ImportError:
        return None

    def offer(text: str, i: int) -> str | None:
        found = candidates(readline.get_line_buffer()[: readline.get_endidx()])
        return found[i] if i < len(found) else None

    readline.set_completer(offer)
    readline.set_completer_delims(" \t")
    editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if editline else "tab: complete")
    readline.set_history_length(MOST_LINES)
    readline.clear_history()
    with suppress(OvitaError, OSError):
        history = make_folder(state_folder(), mode=0o700) / "chat_history"
        with suppress(FileNotFoundError):
            readline.read_history_file(history)
        return history
    return None


def _write_history(history: Path) -> None:
    import readline

    readline.set_completer(None)
    with suppress(OSError):
        history.touch(mode=0o600)  # so that it is never anybody else's to read
        readline.write_history_file(history)


def completed(line: str, commands: Sequence[str], names: Sequence[str], knobs: Sequence[str]) -> list[str]:
    """What the last word of a line may become: a command, a knob to set, a file, or the rest of an object's name.

    The line goes up to the cursor, commands come without their slash, and an object's name may have several words.
    """
    _, space, last = line.rpartition(" ")
    command = line[1:].partition(" ")[0] if line.startswith(_MARKS) else ""
    if line.startswith(_MARKS) and not space:
        return [f"{line[0]}{word} " for word in commands if word.startswith(command)]
    if command == "set":
        return [f"{name}=" for name in knobs if name.startswith(last)]
    if command in ("save", "plot"):
        return _files(last)
    return [found for name in names if (found := _rest(line, name, last))]


def _rest(line: str, name: str, last: str) -> str:
    """The last word of a line with what is missing of a name that the line ends with the beginning of; else ""."""
    sizes = (n for n in range(len(name) - 1, 0, -1) if f" {line}".lower().endswith(f" {name[:n]}".lower()))
    return next((last + name[size:] for size in sizes), "")


def _files(text: str) -> list[str]:
    folder, name = os.path.split(text)
    with suppress(OSError):
        found = [entry for entry in os.scandir(folder or ".") if entry.name.startswith(name)]
        return sorted(os.path.join(folder, entry.name) + os.sep * entry.is_dir() for entry in found)
    return []


class Keeper:
    """Keeps the talk about a file in a journal of its own from its first turn on, and knows the talk before it."""

    def __init__(self, file: str) -> None:
        place = os.path.realpath(file)
        stem = "".join(c if c.isalnum() else "-" for c in Path(file).stem)[:40]
        self.mark = f"{stem}-{hashlib.sha256(place.encode('utf-8', 'surrogateescape')).hexdigest()[:12]}"
        self.folder = make_folder(state_folder() / "chat", mode=0o700)
        self.path = self.folder / f"{self.mark}-{time.time_ns()}.jsonl"
        self.earlier = self._earlier()

    def _earlier(self) -> Path | None:
        """The last talk about the file; the oldest of many are deleted."""
        found = sorted(self.folder.glob(f"{self.mark}-*.jsonl"))
        for old in found[:-MOST_TALKS]:
            old.unlink(missing_ok=True)
        return found[-1] if found else None

    def keep(self, session: Session) -> None:
        """Begin the journal once something was said."""
        if session.steps and not session.kept:
            session.keep(str(self.path))


@click.command()
@click.argument("files", metavar="[FILE|FOLDER]...", nargs=-1)
@common.shown("--host", default="127.0.0.1", help="Address to listen on.")
@common.shown("--port", type=click.IntRange(0, 65535), default=8765, help="0 takes any free one.")
@option(
    "--token",
    default="",
    envvar="OVITA_STUDIO_TOKEN",
    metavar="TEXT",
    help="What a browser must bring; 'auto' makes one. Needed where other machines can reach the studio.",
)
@common.WRITER
@common.BASE_URL
@option("--robot", metavar="NAME|FILE", help="Limits to begin with: a name as for adapt, or a file. [scene's]")
@option("--sessions", type=click.Path(path_type=Path), help="Folder where sessions are kept.")
@common.ISOLATION
def studio(
    files: tuple[str, ...], host: str, port: int, token: str, robot: str | None, sessions: Path | None, **options: Any
) -> None:
    """Adapt trajectories in the browser; begins with the first FILE, or with a shipped scene."""
    import rich

    from ovita.studio import Studio, StudioSettings
    from ovita.studio.sessions import default_folder

    limits, writer, isolation = load_robot(robot or "none"), common.writer_from(options), options["isolation"]
    begun = Trajectory([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [0.1, 0.1])
    template = Session(begun, robot=limits, writer=writer, isolation=known_isolation(isolation))
    server = Studio(StudioSettings(template, files, host, port, token, sessions or default_folder()))
    made = token == "auto"
    told = "" if made or not token else "; it asks for the token"
    try:
        click.echo(f"The studio is open at {server.url if made else server.url.partition('?')[0]}{told}")
        click.echo("Ctrl-C ends it; every session is kept and goes on when it starts again.")
        server.wait()
    finally:
        rich.get_console().quiet = True  # viser's thread may say that it stopped when all is over
        server.stop()
