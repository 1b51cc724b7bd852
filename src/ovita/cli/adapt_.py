"""`ovita adapt`, and its result as pictures and words: `ovita plot`, `ovita explain`, `ovita demo`, `ovita tour`."""

from __future__ import annotations

import json
import os
import sys
import webbrowser
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from importlib.util import find_spec
from typing import Any, NoReturn

import click
from click import option
from click.core import ParameterSource

from ovita import io
from ovita.chain import REPAIRS, TIME_LIMIT, Isolation, adapt, another
from ovita.cli import common
from ovita.cli.common import shown, source
from ovita.errors import FormatError, RequestError
from ovita.gate import explained
from ovita.io.files import make_folder
from ovita.io.waypoints import covariance_rows
from ovita.paths.robot import UNLIMITED, Robot
from ovita.plots.geometry import View
from ovita.request import FeedbackOn, Request
from ovita.result import PICTURES, Adaptation, accept
from ovita.text import listed
from ovita.writers.base import PolicyWriter


@dataclass(frozen=True)
class Outputs:
    """What is wanted of a result.

    Args:
        result, trajectory, picture: Names of files to write.
        code: Whether the report shows the policy.
        as_json: Whether JSON is printed instead of a report.
        accepting: Whether a proposal is done without asking.
    """

    result: str | None
    trajectory: str | None
    picture: str | None
    code: bool
    as_json: bool
    accepting: bool

    @property
    def files(self) -> list[str]:
        """The files to write."""
        return [path for path in (self.result, self.trajectory, self.picture) if path]

    def check(self, source: str) -> None:
        """Refuse what cannot be written, or over its source, before anything is, so that no half is left behind."""
        if self.picture:
            check_picture(self.picture)
        if self.trajectory and not io.writable(self.trajectory):
            raise FormatError(self.trajectory, f"trajectories are written as {', '.join(io.WRITTEN)}")
        if self.result and not self.result.lower().endswith(".json"):
            problem = "a result is JSON; name a .json file, or use --trajectory for the adapted trajectory alone"
            raise FormatError(self.result, problem)
        named = Counter(os.path.realpath(path) for path in (source, *self.files))
        for twice in [path for path, count in named.items() if count > 1]:
            raise FormatError(twice, "is named twice, so one would overwrite the other; name another file")
        for path in self.files:
            common.check_writable(path)


_ABOUT_OUTPUT = [item.name for item in fields(Outputs)]


@click.command()
@click.argument("file", metavar="FILE")
@click.argument("instruction", required=False)
@option("--out", "-o", "result", metavar="FILE", help="Write the whole result (JSON).")
@option("--trajectory", metavar="FILE", help="Write the adapted trajectory, in any format that ovita convert writes.")
@option("--plot", "picture", metavar="FILE", help="Draw before and after (.png, .svg, .pdf or .html).")
@option("--code", is_flag=True, help="Also print the policy.")
@option("--json", "as_json", is_flag=True, help="Print the result as JSON instead of a report.")
@shown(
    "--time-limit",
    type=float,
    default=TIME_LIMIT,
    metavar="SECONDS",
    help="For writing the policy, all writers and repairs together.",
)
@shown("--repairs", type=int, default=REPAIRS, help="How often a failing policy goes back.")
@option("--explain-with-model", is_flag=True, help="Let a model that wrote the policy also word the explanation.")
@option("--accept", "accepting", is_flag=True, help="Do what was understood without asking; see below.")
@option("--on", type=click.Choice(["current", "original"]), help="Of a skill: as it is now, or as it was shown.")
@option("--no-examples", is_flag=True, help="Leave the examples out of a model's prompt (ablation).")
@shown("--planner", default="limits", help="Where FILE has no trajectory: see ovita plan.")
@common.shared
def command(file: str, instruction: str | None, on: FeedbackOn | None, planner: str, **options: Any) -> None:
    """Adapt the trajectory in FILE (see ovita convert for the formats) to INSTRUCTION (default: the one in FILE).

    If FILE is a skill of `ovita learn`, its mean is adapted and --out is the skill there, with its variance.
    Where FILE holds objects and no trajectory, one is planned: ovita adapt SCENE "from the box to the plate, slowly".

    Where the reading is not certain, it is shown and asked about. Without a terminal to ask on, the exit code is 3 and
    --out holds the finished proposal; `ovita adapt RESULT --accept` takes the one that a saved result holds.
    """
    outputs = Outputs(**{name: options.pop(name) for name in _ABOUT_OUTPUT})
    outputs.check(file)
    if io.is_skill(file):
        from ovita.cli.sources_ import adapt_file

        adapt_file(file, instruction or "", on or "current", outputs, options)
    if on is not None:
        raise RequestError(f"--on is for skills; in a conversation say it: ovita chat {file}")
    bare = common.bare_task(file, options)
    stages: dict[str, Any] = {name: options[name] for name in _STAGES}
    stages |= {"writer": common.writer_from(options), "constraints": common.constraints_from(options)}
    stages["examples"] = not options["no_examples"]
    if bare is not None:
        from ovita.cli.sources_ import generated

        made = generated(bare, instruction, planner, options, stages, as_json=outputs.as_json)
        _finish(*made, options, outputs, otherwise=False)  # the words told the way, too
    task = common.task_at(file, options)
    if outputs.trajectory:
        io.rendered(outputs.trajectory, task.trajectory, task.scene, choices=common.choices_from(options))
    if outputs.accepting and instruction is None and io.is_adaptation(file):
        result = _accepted(file)
        report(result, outputs, *_write(result, outputs, task, common.choices_from(options)))
    if instruction is None and not task.instruction.strip():
        raise RequestError(f"{file} holds no instruction; add one: ovita adapt {file} 'slow down near the cup'")
    text = task.instruction if instruction is None else instruction
    robot = common.robot_from(task, options["robot"], options["max_speed"])
    with common.waiting(f"{stages['writer'].name} writes a policy", quiet=outputs.as_json) as tell:
        result = adapt(Request(text, task.trajectory, task.scene, robot), progress=tell, **stages)
    _finish(result, task, stages["writer"], options, outputs)


_STAGES = ("isolation", "repairs", "time_limit", "explain_with_model")


def _finish(
    result: Adaptation,
    task: io.Task,
    writer: PolicyWriter,
    options: dict[str, Any],
    outputs: Outputs,
    *,
    otherwise: bool = True,
) -> NoReturn:
    """Ask about a proposal, and perhaps another reading of the words, write what was asked for and report."""
    if result.proposal is not None and outputs.accepting:
        result = accept(result)
    elif result.proposal is not None and not outputs.as_json and _on_a_terminal():
        result = _asked_about(result, options["isolation"] if otherwise else None)
    notes = (*common.notes_on(task, options["robot"]), *common.notes_on_writer(writer))
    report(result, outputs, *_write(result, outputs, task, common.choices_from(options)), notes)


def report(
    result: Adaptation, outputs: Outputs, written: Sequence[str], lost: Sequence[str] = (), notes: Sequence[str] = ()
) -> NoReturn:
    """Print a result, what was written and what its formats lost, and end with the exit code."""
    if outputs.as_json:
        click.echo(json.dumps(result.to_document(), ensure_ascii=False))
    else:
        common.show(result, code=outputs.code)
        common.show_notes(notes)
        for path in written:
            click.echo(f"wrote {path}")
        common.show_notes(lost)
        if result.proposal is not None:
            held = outputs.result in written
            saved = f"ovita adapt {outputs.result} --accept" if held else "the same command with --accept"
            click.echo(f"If that is what you mean: {common.plain(saved)}")
    raise SystemExit(common.EXIT_OF[result.status])


def _asked_about(result: Adaptation, isolation: Isolation | None) -> Adaptation:
    """What a person on the terminal agrees to: the proposal, or another reading unless `isolation` is None."""
    if _agrees(result.message):
        return accept(result)
    other = None if isolation is None else another([result], isolation=isolation)
    return accept(other) if other is not None and _agrees(other.explanation) else result


def _agrees(told: str) -> bool:
    return click.confirm(f"{common.plain(told)} Do this?", default=False)


def _on_a_terminal() -> bool:
    return sys.stdin.isatty() and sys.stdout.isatty()


def _accepted(file: str) -> Adaptation:
    """The proposal of a saved result, as it is; options that would change it are refused."""
    context, saved = click.get_current_context(), Adaptation.load(file)
    same = "writer" if context.params.get("writer") in (saved.writer.kind, saved.writer.model) else ""
    for parameter in context.command.params:
        name = parameter.name or ""
        given = context.get_parameter_source(name) == ParameterSource.COMMANDLINE
        if given and name not in ("file", same, *_ABOUT_OUTPUT):
            raise RequestError(
                f"{parameter.opts[0]} cannot change the proposal that {file} holds; say the instruction again with it,"
                f" or accept without it"
            )
    if saved.proposal is None:
        raise RequestError(f"{file} holds no proposal to accept; its status is {saved.status!r}")
    return accept(saved)


def _write(
    result: Adaptation, outputs: Outputs, task: io.Task, choices: io.Choices
) -> tuple[list[str], tuple[str, ...]]:
    """Write the requested files; return their names and notes on what the trajectory's format cannot hold."""
    lost: tuple[str, ...] = ()
    if outputs.result:
        result.save(outputs.result)
    if not result.usable:
        return [outputs.result] if outputs.result else [], lost
    if outputs.trajectory:
        same = len(result.adapted) == len(task.trajectory)
        extra = {key: value for key, value in task.extra.items() if same or key != "covariance"}
        adapted = io.Task(result.adapted, result.scene, result.instruction, extra, verdict=result.verdict)
        lost = io.save_task(outputs.trajectory, adapted, choices)
    if outputs.picture:
        draw(result, outputs.picture)
    return outputs.files, lost


@click.command()
@click.argument("file", metavar="FILE")
@option("--out", "-o", metavar="FILE", help=".png, .svg, .pdf or .html. [FILE with .png]")
@option("--robot", metavar="NAME|FILE", help="Whose workspace to draw. [the result's]")
@common.pick("--view", "auto 3d top")
@source
def plot(file: str, out: str | None, robot: str | None, view: View, **options: Any) -> None:
    """Draw FILE: a result of `ovita adapt --out` (before and after), or a trajectory in any format with its scene.

    The covariance that a task of `ovita generate` holds is drawn as a tube of two standard deviations; of a skill, what
    it generates as it was shown.
    """
    out = out or os.path.splitext(file)[0] + ".png"
    drawn = io.load_robot(robot) if robot else None
    if io.is_adaptation(file):
        draw(Adaptation.load(file), out, robot=drawn, view=view)
    else:
        task = _task_of_a_skill(file) if io.is_skill(file) else common.task_at(file, options)
        named, notes = (drawn, ()) if drawn or io.is_skill(file) else common.own_robot(task)
        shown = Adaptation(task.instruction, "done", task.trajectory, task.trajectory, scene=task.scene)
        draw(shown, out, robot=named, view=view, tube=task.extra.get("covariance"))
        common.show_notes(notes)
    click.echo(f"wrote {out}")


def _task_of_a_skill(file: str) -> io.Task:
    from ovita.sources.skills import Skill

    return Skill.load(file).generate().task()


def check_picture(out: str) -> None:
    """Refuse a file name that says no picture format."""
    if os.path.splitext(out)[1].lower() not in PICTURES:
        raise FormatError(out, f"pictures are written as {', '.join(PICTURES)}")


def draw(result: Adaptation, out: str, *, robot: Robot | None = None, view: View = "auto", tube: object = None) -> None:
    """Draw an adaptation into a file, by its suffix; `tube` is the covariance that a generated path's file holds."""
    check_picture(out)
    around = None if tube is None else covariance_rows(tube, out, len(result.adapted))
    result.plot(out, robot=robot, view=view, tube=around)


@click.command()
@click.argument("file", metavar="RESULT.json")
@option("--code", is_flag=True, help="Also print the policy.")
def explain(file: str, code: bool) -> None:
    """Explain RESULT.json, a result of `ovita adapt --out`, in plain words."""
    result = Adaptation.load(file)
    common.say(explained(file))
    if result.proposal is not None:
        click.echo(f"It is not done yet; if that is what you mean: ovita adapt {common.plain(file)} --accept")
    shown = result.proposal or result
    if code and shown.code:
        click.echo("\n" + common.plain(shown.code))


INSTRUCTIONS = (
    "Go left by 0.2 and slow down near the cup",
    "Keep a distance of at least 0.25 from the bottle and wait for 10 timesteps near the plate",
    "Start a little higher, end 0.15 above the box and move at a constant speed of 0.25",
)


@click.command()
@shown("--out", "-o", default="ovita-demo", metavar="FOLDER", help="Where to save.")
@option("--open", "open_page", is_flag=True, help="Open the last interactive page in the browser.")
def demo(out: str, open_page: bool) -> None:
    """Adapt a shipped table-top scene to three instructions with the built-in writer; no key, no network."""
    folder = make_folder(out)
    task = common.shipped_task()
    io.save_task(str(folder / "scene.json"), task)
    pictures = ("png", "html") if find_spec("matplotlib") and find_spec("plotly") else ()
    for i, instruction in enumerate(INSTRUCTIONS, start=1):
        click.secho(f"\n[{i}/{len(INSTRUCTIONS)}] {instruction}", bold=True)
        result = adapt(Request(instruction, task.trajectory, task.scene, UNLIMITED), writer="builtin")
        common.show(result)
        result.save(str(folder / f"{i}.json"))
        for suffix in pictures:
            draw(result, str(folder / f"{i}.{suffix}"))
        click.echo(f"wrote {folder / str(i)}.json" + (", .png and .html" if pictures else ""))
    if not pictures:
        click.echo("\nFor the pictures: pip install 'ovita[plot]'")
    click.echo(f'\nNow your turn: {common.called()} adapt {folder / "scene.json"} "Go a little higher over the box"')
    if open_page and pictures:
        webbrowser.open((folder / f"{len(INSTRUCTIONS)}.html").resolve().as_uri())


SAID, KNOB = "Go left by 0.2 and slow down near the cup", ("left", 0.3)


@click.command()
@shown("--out", "-o", default="ovita-tour", metavar="FOLDER", help="Where to save.")
@option("--yes", is_flag=True, help="Go on without waiting for the Enter key.")
def tour(out: str, yes: bool) -> None:
    """Show in five steps what ovita does: say, read, turn a knob, undo, save. No key, no network; a minute.

    Without a terminal it does not wait between steps.
    """
    waits = not yes and sys.stdin.isatty() and sys.stdout.isatty()
    for i, title in enumerate(_steps(out), start=1):
        if i > 1 and waits:
            click.prompt("\nEnter goes on, Ctrl-C ends", default="", show_default=False, prompt_suffix=" ")
        click.secho(f"\n[{i}/5] {title}", bold=True)


def _steps(out: str) -> Iterator[str]:
    """The steps: each yields its title, then prints itself when it is asked for the next."""
    from ovita.dialogue.session import Session

    task = common.shipped_task()
    session = Session(task.trajectory, task.scene, writer="builtin")
    yield "Something to change: a trajectory and what surrounds it"
    path_now = task.trajectory
    click.echo(f"{len(path_now)} waypoints, {path_now.length:.2f} m in {path_now.duration:.1f} s over a table.")
    common.say(f"On it: {listed(task.scene.names)}.")
    yield f'Say what should change: "{SAID}"'
    common.show(session.say(SAID))
    click.echo("\nThe plan is how it was understood; the first line and the limits are the verdict.")
    yield f"Turn a knob: {KNOB[0]} = {KNOB[1]}"
    result = session.tune(dict([KNOB]))
    common.show(result)
    click.echo("\nThe same policy ran again with another number; nobody wrote a new one.")
    yield "Take it back"
    session.undo()
    kept = session.adaptation
    assert kept is not None
    click.echo("\n".join(f"  {parameter.line}" for parameter in kept.parameters))
    click.echo("Every turn can be taken back and brought back.")
    yield "Save, and go on by yourself"
    folder = make_folder(out)
    io.save_task(str(folder / "scene.json"), task)
    kept.save(str(folder / "result.json"))
    click.echo(f"wrote {folder / 'scene.json'} and {folder / 'result.json'}\n")
    click.echo(f"{common.called()} explain {folder / 'result.json'}")
    click.echo(f'{common.called()} adapt {folder / "result.json"} "Keep at least 0.25 from the bottle" --robot arm')
    click.echo(f"{common.called()} chat {folder / 'scene.json'}")
