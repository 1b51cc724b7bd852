"""`ovita adapt`: one trajectory, one instruction, one result."""

from __future__ import annotations

import json
import os
from typing import Any

import click

from ovita.chain import REPAIRS, TIME_LIMIT, adapt
from ovita.cli.options import choices_from, constraints_from, notes_on, notes_on_writer, robot_from, shared
from ovita.cli.report import EXIT_OF, plain, show, waiting
from ovita.cli.results_ import check_picture, draw
from ovita.errors import FormatError, RequestError
from ovita.io import WRITTEN, Choices, Task, open_task, rendered, save_trajectory
from ovita.request import Request
from ovita.result import Adaptation
from ovita.writers.base import writer_named


@click.command()
@click.argument("file", metavar="FILE")
@click.argument("instruction", required=False)
@click.option("--out", "-o", metavar="FILE", help="Write the whole result (JSON).")
@click.option(
    "--trajectory",
    "trajectory_out",
    metavar="FILE",
    help="Write the adapted trajectory, in any format that ovita convert writes.",
)
@click.option("--plot", "plot_out", metavar="FILE", help="Draw before and after (.png, .svg, .pdf or .html).")
@click.option("--code", is_flag=True, help="Also print the policy.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON instead of a report.")
@click.option(
    "--time-limit",
    type=float,
    default=TIME_LIMIT,
    show_default=True,
    metavar="SECONDS",
    help="For writing the policy, all writers and repairs together.",
)
@click.option("--repairs", type=int, default=REPAIRS, show_default=True, help="How often a failing policy goes back.")
@click.option("--explain-with-model", is_flag=True, help="Let a model that wrote the policy also word the explanation.")
@click.option("--no-examples", is_flag=True, help="Leave the examples out of a model's prompt (ablation).")
@shared
def command(
    file: str,
    instruction: str | None,
    out: str | None,
    trajectory_out: str | None,
    plot_out: str | None,
    code: bool,
    as_json: bool,
    time_limit: float,
    repairs: int,
    explain_with_model: bool,
    no_examples: bool,
    **options: Any,
) -> None:
    """Adapt the trajectory in FILE (see ovita convert for the formats) to INSTRUCTION (default: the one in FILE)."""
    _check_outputs(file, out, trajectory_out, plot_out)
    choices = choices_from(options)
    task = open_task(file, scene_file=options["scene_file"], frame=options["frame"], choices=choices)
    if trajectory_out:
        rendered(trajectory_out, task.trajectory, task.scene, choices=choices)
    text = instruction if instruction is not None else task.instruction
    if instruction is None and not text.strip():
        raise RequestError(f"{file} holds no instruction; add one: ovita adapt {file} 'slow down near the cup'")
    writer = writer_named(options["writer"], base_url=options["base_url"], temperature=options["temperature"])
    request = Request(text, task.trajectory, task.scene, robot_from(task, options["robot"], options["max_speed"]))
    with waiting(f"{writer.name} writes a policy", quiet=as_json) as tell:
        result = adapt(
            request,
            writer=writer,
            constraints=constraints_from(options),
            isolation=options["isolation"],
            repairs=repairs,
            examples=not no_examples,
            time_limit=time_limit,
            explain_with_model=explain_with_model,
            progress=tell,
        )
    written, lost = _write(result, out, trajectory_out, plot_out, task, choices)
    if as_json:
        click.echo(json.dumps(result.to_document(), ensure_ascii=False))
    else:
        show(result, code=code)
        for note in (*notes_on(task, options["robot"]), *notes_on_writer(writer)):
            click.echo(f"note: {plain(note)}", err=True)
        for path in written:
            click.echo(f"wrote {path}")
        for note in lost:
            click.echo(f"note: {plain(note)}", err=True)
    raise SystemExit(EXIT_OF[result.status])


def _check_outputs(file: str, out: str | None, trajectory_out: str | None, plot_out: str | None) -> None:
    """Refuse outputs that cannot be written before anything is, so that no half of them is left behind."""
    if plot_out:
        check_picture(plot_out)
    if trajectory_out and os.path.splitext(trajectory_out)[1].lower() not in WRITTEN:
        raise FormatError(trajectory_out, f"trajectories are written as {', '.join(WRITTEN)}")
    if out and not out.lower().endswith(".json"):
        raise FormatError(
            out, "a result is JSON; name a .json file, or use --trajectory for the adapted trajectory alone"
        )
    named = [os.path.realpath(path) for path in (file, out, trajectory_out, plot_out) if path]
    for each in named:
        if named.count(each) > 1:
            raise FormatError(each, "is named twice, so one would overwrite the other; name another file")
    for path in (out, trajectory_out, plot_out):
        if path and os.path.isdir(path):
            raise FormatError(path, "is a directory; name a file in it")
        if path and not os.path.isdir(os.path.dirname(path) or "."):
            raise FormatError(path, "its folder does not exist; make it first")


def _write(
    result: Adaptation,
    out: str | None,
    trajectory_out: str | None,
    plot_out: str | None,
    task: Task,
    choices: Choices,
) -> tuple[list[str], tuple[str, ...]]:
    """Write the requested files; return their names and notes on what the trajectory's format cannot hold."""
    written: list[str] = []
    lost: tuple[str, ...] = ()
    if out:
        result.save(out)
        written.append(out)
    if not result.usable:
        return written, lost
    if trajectory_out:
        lost = save_trajectory(
            trajectory_out,
            result.adapted,
            result.scene,
            result.instruction,
            task.extra,
            choices=choices,
            verdict=result.verdict,
        )
        written.append(trajectory_out)
    if plot_out:
        draw(result, plot_out)
        written.append(plot_out)
    return written, lost
