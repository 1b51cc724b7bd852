"""What commands share: options, the objects made from them, short reports, and progress on what takes a second."""

from __future__ import annotations

import ast
import math
import os
import re
import shlex
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import fields, replace
from functools import partial, reduce
from importlib.resources import as_file, files
from typing import Any

import click
from click import option

from ovita.errors import FormatError, RequestError, RobotError
from ovita.io import Choices, Task, load_bare, load_robot, load_task, open_task
from ovita.io.geodesy import Home
from ovita.limits import ConstraintOptions, parse_text
from ovita.measure import sentences
from ovita.paths.robot import UNLIMITED, Robot
from ovita.paths.scene import Frame, Scene
from ovita.result import Adaptation, Status
from ovita.writers.base import MODEL_VARIABLE, PolicyWriter, Progress, UnavailableWriter, flatten, writer_named

EXIT_NOTHING, EXIT_REFUSED = 3, 4
"""Exit codes of a command that came to nothing, and of one that found what must not be used."""

EVERY = 5.0
"""Pause between two lines of progress where standard error is no terminal [s]."""

Decorator = Callable[[Any], Any]


def together(*options: Decorator) -> Decorator:
    """One decorator that adds several options to a command, in their order."""

    def add(function: Any) -> Any:
        return reduce(lambda made, added: added(made), reversed(options), function)

    return add


shown = partial(option, show_default=True)
"""An option whose default --help shows."""


def pick(flag: str, words: str, help: str | None = None) -> Decorator:
    """An option with one of several words, the first of which is the default and is shown."""
    return shown(flag, type=click.Choice(words.split()), default=words.split()[0], help=help)


WRITER = shown(
    "--writer",
    "--llm",
    "writer",
    default="auto",
    metavar="NAME",
    help="auto, builtin, llamacpp:NAME, PROVIDER:MODEL (openai, anthropic, google, ollama), or several: A,B.",
)
BASE_URL = option("--base-url", metavar="URL", help="An OpenAI-compatible server; --writer then names its model.")
ISOLATION = pick("--isolation", "auto strict degraded", "How policies are isolated.")

ENGINE = pick(
    "--engine", "processes ray", help="Who works where there are several jobs; ray also on a cluster (extra ray)."
)

HEADING = option(
    "--heading",
    type=click.FloatRange(-360, 360),
    metavar="DEGREES",
    help="Where the front of a mission or of setpoints points, clockwise from north. [0; of a ROS path, x is east]",
)

FRAMES = click.Choice(["rfu", "flu", "ned"])
FRAME = option("--frame", type=FRAMES, help="Which way is left. [default: the scene's, else rfu]")

source = together(
    option("--scene", "scene_file", metavar="FILE", help="Scene file with the objects, for a bare trajectory."),
    FRAME,
    option("--topic", metavar="NAME", help="Topic of a ROS bag. [the only one with a path]"),
    option(
        "--message",
        type=int,
        metavar="N",
        help="Which message on that topic, or which episode of a LeRobot data set, from 0. [the last]",
    ),
    option("--home", metavar="LAT,LON,ALT", help="Home of a mission in degrees and metres. [the file's]"),
    HEADING,
    option(
        "--moving", "frames", metavar="FIXED:MOVING", help="Whose motion is read of recorded transforms: map:base_link."
    ),
    option(
        "--from", "first", type=click.FloatRange(0), metavar="S", help="First second of a recording that is read. [0]"
    ),
    option("--to", "last", type=click.FloatRange(0), metavar="S", help="Last second of it. [its end]"),
    option("--raw", is_flag=True, help="Keep every sample of a recording: neither smooth nor thin it."),
)
"""The options that say how to read a trajectory from a file or an address."""

shared = together(
    source,
    option(
        "--robot",
        metavar="NAME|FILE",
        help="Limits: drone (crazyflie), arm (iiwa), ground (jackal, rover), none, a .toml or .json file, or 'scene' "
        "for those that FILE states in words. "
        "[the robot that FILE names, else none]",
    ),
    WRITER,
    BASE_URL,
    shown("--temperature", type=click.FloatRange(0, 2), default=0.1, help="Of a model."),
    option("--max-speed", type=float, metavar="M/S", help="Speed limit, instead of the robot's."),
    option("--max-acceleration", type=float, metavar="M/S2", help="Limit along the path. [no limit]"),
    option("--max-lateral-acceleration", type=float, metavar="M/S2", help="Limit across the path. [no limit]"),
    pick("--method", "verified paper", "Constraint module: ours, or the paper's single QP."),
    option(
        "--pin", "pinned", type=int, multiple=True, metavar="N", help="Waypoint N, from 1, must stay; -1 is the last."
    ),
    option("--fix-start", is_flag=True, help="The first waypoint must stay where the policy put it."),
    option("--fix-goal", is_flag=True, help="The last waypoint must stay where the policy put it."),
    option("--smooth", type=click.FloatRange(0), default=0.0, metavar="WEIGHT", help="Smoothing weight. [0]"),
    option("--no-obstacles", is_flag=True, help="Objects are no obstacles."),
    option("--no-constraints", is_flag=True, help="Measure the limits, but do not enforce them."),
    option("--repair", is_flag=True, help="Also repair a path that the change leaves as it was."),
    ISOLATION,
)
"""The options on source, scene, robot, writer and limits."""


def choices_from(options: dict[str, Any]) -> Choices:
    """What was chosen of topic, message and home, and for writing, of message type and ROS frame."""
    given = {item.name: options[item.name] for item in fields(Choices) if options.get(item.name) not in (None, "")}
    if given.get("kind") == "joints":
        del given["kind"]
    if "home" in given:
        given["home"] = Home.parse(given["home"])
    first, last = options.get("first"), options.get("last")
    if (first, last) == (None, None):
        return Choices(**given)
    span = first or 0.0, math.inf if last is None else last
    if span[0] >= span[1]:
        raise RequestError(f"--from {span[0]:g} --to {span[1]:g}: the first second must come before the last")
    return Choices(**given, span=span)


def task_at(place: str, options: dict[str, Any]) -> Task:
    """The task of a file or an address, read as the options of `source` say."""
    return open_task(place, scene_file=options["scene_file"], frame=options["frame"], choices=choices_from(options))


def bare_task(file: str, options: dict[str, Any]) -> Task | None:
    """The task of a file with objects and no trajectory; None for any other, or where --scene names the objects."""
    bare = load_bare(file) if options["scene_file"] is None else None
    return bare and replace(bare, scene=in_frame(bare.scene, options["frame"]))


def in_frame(scene: Scene, frame: str | None) -> Scene:
    """The scene, read in another frame where one is named."""
    return scene if frame is None else replace(scene, frame=Frame(frame))


def check_writable(path: str) -> None:
    """Refuse the name of a file that is a folder, or whose folder is missing, before anything is written."""
    if os.path.isdir(path):
        raise FormatError(path, "is a directory; name a file in it")
    if not os.path.isdir(os.path.dirname(path) or "."):
        raise FormatError(path, "its folder does not exist; make it first")


def shipped_task() -> Task:
    """The table-top scene that comes with ovita."""
    with as_file(files("ovita") / "data" / "tabletop.json") as path:
        return load_task(str(path))


def writer_from(options: dict[str, Any]) -> PolicyWriter:
    """The writer that the options name."""
    return writer_named(options["writer"], base_url=options["base_url"], temperature=options.get("temperature", 0.1))


def names_in(text: str | None) -> tuple[str, ...]:
    """The names in a list with commas."""
    return tuple(name.strip() for name in (text or "").split(",") if name.strip())


def robot_from(task: Task, robot: str | None, max_speed: float | None) -> Robot:
    """The robot chosen on the command line, else the scene's, else none."""
    if robot != "scene":
        return slowed(load_robot(robot) if robot else own_robot(task)[0], max_speed)
    limits = parse_text(task.scene.constraints_text)
    if not limits.understood:
        raise RobotError(f"{task.path} states no limits that are understood; name a robot: --robot drone")
    return slowed(limits.apply(own_robot(task)[0]), max_speed)


def slowed(robot: Robot, max_speed: float | None) -> Robot:
    """The robot with another highest speed [m/s], where one is given."""
    return robot if max_speed is None else replace(robot, max_speed=max_speed)


def own_robot(task: Task) -> tuple[Robot, tuple[str, ...]]:
    """The robot that a file names; one that is not known sets no limits, and a note says so."""
    try:
        return load_robot(task.robot) if task.robot else UNLIMITED, ()
    except RobotError as error:
        return UNLIMITED, (f"the file names an {error}; no limits of a robot are enforced",)


def notes_on_writer(writer: PolicyWriter | str) -> list[str]:
    """What a person should know about the writers: which configured model cannot be used."""
    line = () if isinstance(writer, str) else flatten(writer)
    absent = [one for one in line if isinstance(one, UnavailableWriter)]
    return [f"{MODEL_VARIABLE} names {one.name!r}, which cannot be used: {one.problem}" for one in absent]


def notes_on(task: Task, robot: str | None) -> list[str]:
    """What a person should know about the file: what was assumed, and which limits it states."""
    said = [*task.notes, *(own_robot(task)[1] if robot in (None, "scene") else ())]
    if not task.scene.constraints_text:
        return said
    limits = parse_text(task.scene.constraints_text)
    if robot == "scene":
        said += [f"limit of the file: {text}" for text in limits.understood]
        said += [f"limit of the file that is not understood and not enforced: {text}" for text in limits.ignored]
    elif limits.understood:
        said.append("the file states limits of its own; they are enforced with --robot scene")
    return said


_LIMITS = ("method", "max_acceleration", "max_lateral_acceleration", "fix_start", "fix_goal")


def constraints_from(options: dict[str, Any]) -> ConstraintOptions:
    """How limits are enforced."""
    if 0 in options["pinned"]:
        raise RequestError("--pin 0: waypoints are counted from 1; the first is --pin 1, the last --pin -1")
    return ConstraintOptions(
        lambda_smooth=options["smooth"],
        pinned=tuple(n - 1 if n > 0 else n for n in options["pinned"]),
        obstacles=not options["no_obstacles"],
        repair_original=options["repair"],
        enabled=not options["no_constraints"],
        **{name: options[name] for name in _LIMITS},
    )


_VERDICTS: dict[Status, tuple[int, str]] = {
    "done": (0, "done"),
    "limited": (5, "done, but see the limits"),
    "not_as_meant": (6, "not as meant"),
    "infeasible": (EXIT_REFUSED, "infeasible"),
    "needs_confirmation": (EXIT_NOTHING, "not done: is that meant?"),
    "needs_clarification": (EXIT_NOTHING, "not done: a question"),
    "answered": (EXIT_NOTHING, "not done: a question, answered"),
    "not_understood": (EXIT_NOTHING, "not done: not understood"),
    "failed": (EXIT_NOTHING, "not done: failed"),
}
EXIT_OF = {status: code for status, (code, _) in _VERDICTS.items()}
LABELS = {status: words for status, (_, words) in _VERDICTS.items()}
"""The verdict in words."""

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def called() -> str:
    """How a person at this shell calls ovita: by its name where that is found, else by the path that was just used."""
    used = sys.argv[0]
    found = shutil.which("ovita")
    if os.path.basename(used) != "ovita":
        return "ovita" if found else f"{shlex.quote(os.path.relpath(sys.executable))} -m ovita"
    same = found is not None and os.path.realpath(found) == os.path.realpath(used)
    return "ovita" if same else shlex.quote(used)


def literal(text: str) -> Any:
    """The value of a Python literal; anything else is text."""
    text = text.strip()
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError, MemoryError, RecursionError):
        return {"true": True, "false": False}.get(text.lower(), text)


def plain(text: str) -> str:
    """Text that is safe on a terminal: without control characters."""
    return _CONTROL.sub("", text)


def say(*lines: str, err: bool = False) -> None:
    """Print lines that are safe on a terminal."""
    for line in lines:
        click.echo(plain(line), err=err)


def show_notes(notes: Iterable[str]) -> None:
    """Print what a person should know on standard error."""
    say(*(f"note: {note}" for note in notes), err=True)


def show(result: Adaptation, *, code: bool = False) -> None:
    """Print an adaptation as a short report."""
    lost = result.lost and result.status == "done"
    label = "done, but not all that was asked before" if lost else LABELS[result.status]
    by = ":".join(filter(None, (result.writer.kind, result.writer.model)))
    total = sum(result.timings_ms.values())
    click.echo(wrapped(plain(f"{result.message}  [{label}; writer {by}; {total:.0f} ms]")))
    for title, lines in _sections(result):
        section(title, lines)
    if code and result.usable:
        click.echo("\nPolicy")
        say(result.code)


def _sections(result: Adaptation) -> Iterator[tuple[str, Sequence[str]]]:
    if len(result.writer.tried) > 1:
        yield "Writers", [line for line in (*result.writer.tried, result.writer.reason) if line]
    if result.proposal is not None:
        would = result.proposal
        yield "It would change", _changes(would)
        yield "It would assume", would.assumed
        yield "It would warn", would.cautions
    if not result.usable:
        return
    yield "Plan", [f"{i}. {step}" for i, step in enumerate(result.plan, start=1)]
    yield "Changes", _changes(result)
    if result.constraints and result.constraints.status == "satisfied":
        yield "Limits", result.constraints.sentences()
    yield "Assumed", result.assumed
    yield "Knobs", [p.line for p in result.parameters]
    yield "Warnings", result.cautions


def _changes(result: Adaptation) -> list[str]:
    return sentences(result.changes) if result.changes else []


def section(title: str, lines: Sequence[str]) -> None:
    """Print lines under a title; nothing where there are none."""
    if lines:
        click.echo(f"\n{plain(title)}")
        for line in lines:
            click.echo(wrapped(plain(line), "  "))


def wrapped(text: str, indent: str = "") -> str:
    """Text with line breaks between words where a terminal is too narrow; as it is where the output is no terminal."""
    if not sys.stdout.isatty():
        return indent + text
    width = max(shutil.get_terminal_size().columns, 40)
    further = indent and f"{indent}   "
    filled = textwrap.TextWrapper(width, indent, further, break_long_words=False, break_on_hyphens=False)
    return "\n".join(filled.fill(line) for line in text.split("\n"))


@contextmanager
def waiting(what: str, *, quiet: bool = False) -> Iterator[Progress]:
    """Show a spinner on standard error while the block runs, if that is a terminal.

    Yields:
        A function that puts another text next to the spinner; any thread may call it.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(what)) as status:
        yield lambda text: status.update(Text(text))


def counting() -> Callable[[str, bool], None]:
    """A function that shows how far something is: on one line of a terminal, else on a line now and then.

    It is told so in words, and whether this is the last word, which is always shown.
    """
    live, shown = sys.stderr.isatty(), time.monotonic()

    def show(text: str, last: bool) -> None:
        nonlocal shown
        if live:
            click.echo(f"\r\x1b[K{text}", err=True, nl=last)
        elif last or time.monotonic() - shown >= EVERY:
            shown = time.monotonic()
            click.echo(text, err=True)

    return show
