"""`ovita plot`: pictures of results and scenes."""

from __future__ import annotations

import os
from typing import Any, Literal

import click

from ovita.cli.options import choices_from, source, task_from
from ovita.errors import FormatError
from ovita.io import atomic_write, is_adaptation, load_robot
from ovita.io.links import is_address
from ovita.paths.robot import Robot
from ovita.result import Adaptation

SUFFIXES = (".png", ".svg", ".pdf", ".html")

View = Literal["auto", "3d", "top"]


@click.command()
@click.argument("file", metavar="FILE")
@click.option("--out", "-o", metavar="FILE", help=".png, .svg, .pdf or .html. [FILE with .png]")
@click.option("--robot", metavar="NAME|FILE", help="Whose workspace to draw. [the result's]")
@click.option("--view", type=click.Choice(["auto", "3d", "top"]), default="auto", show_default=True)
@source
def command(file: str, out: str | None, robot: str | None, view: View, **options: Any) -> None:
    """Draw FILE: a result of `ovita adapt --out` (before and after), or a trajectory in any format with its scene."""
    out = out or os.path.splitext(file)[0] + ".png"
    drawn = load_robot(robot) if robot else None
    if not is_address(file) and is_adaptation(file):
        draw(Adaptation.load(file), out, robot=drawn, view=view)
    else:
        task = task_from(file, options["scene_file"], options["frame"], choices_from(options))
        shown = Adaptation(task.instruction, "done", task.trajectory, task.trajectory, scene=task.scene)
        draw(shown, out, robot=drawn or load_robot(task.robot or "none"), view=view)
    click.echo(f"wrote {out}")


def check_picture(out: str) -> None:
    """Refuse a file name that says no picture format.

    Raises:
        FormatError: If it ends in none of .png, .svg, .pdf and .html.
    """
    if os.path.splitext(out)[1].lower() not in SUFFIXES:
        raise FormatError(out, f"pictures are written as {', '.join(SUFFIXES)}")


def draw(result: Adaptation, out: str, *, robot: Robot | None = None, view: View = "auto") -> None:
    """Draw an adaptation into a file, by its suffix.

    Raises:
        FormatError: If the suffix is unknown or the file cannot be written.
        MissingExtra: If the plotting packages are not installed.
    """
    from ovita import plots

    check_picture(out)
    proposed = None if result.proposed == result.adapted else result.proposed
    if out.lower().endswith(".html"):
        page = plots.interactive(
            result.original,
            result.adapted,
            result.scene,
            robot=robot or result.robot,
            proposed=proposed,
            title=result.instruction,
            notes=result.explanation.split("\n"),
            view=view,
        )
        atomic_write(out, page)
        return
    figure = plots.figure(
        result.original,
        result.adapted,
        result.scene,
        robot=robot or result.robot,
        proposed=proposed,
        title=result.instruction,
        violations=result.constraints.checks if result.constraints else None,
        view=view,
    )
    plots.save(out, figure)
