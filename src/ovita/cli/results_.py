"""`ovita plot`, `ovita explain` and `ovita demo`: results as pictures and in plain words."""

from __future__ import annotations

import os
import webbrowser
from importlib.resources import as_file, files
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

import click

from ovita.chain import adapt
from ovita.cli.options import choices_from, own_robot, source
from ovita.cli.report import plain, show
from ovita.errors import FormatError
from ovita.io import atomic_write, is_adaptation, is_address, load_robot, load_task, open_task, save_task
from ovita.paths.robot import Robot
from ovita.request import Request
from ovita.result import Adaptation

SUFFIXES = (".png", ".svg", ".pdf", ".html")

View = Literal["auto", "3d", "top"]


@click.command()
@click.argument("file", metavar="FILE")
@click.option("--out", "-o", metavar="FILE", help=".png, .svg, .pdf or .html. [FILE with .png]")
@click.option("--robot", metavar="NAME|FILE", help="Whose workspace to draw. [the result's]")
@click.option("--view", type=click.Choice(["auto", "3d", "top"]), default="auto", show_default=True)
@source
def plot(file: str, out: str | None, robot: str | None, view: View, **options: Any) -> None:
    """Draw FILE: a result of `ovita adapt --out` (before and after), or a trajectory in any format with its scene."""
    out = out or os.path.splitext(file)[0] + ".png"
    drawn = load_robot(robot) if robot else None
    if not is_address(file) and is_adaptation(file):
        draw(Adaptation.load(file), out, robot=drawn, view=view)
    else:
        task = open_task(file, scene_file=options["scene_file"], frame=options["frame"], choices=choices_from(options))
        shown = Adaptation(task.instruction, "done", task.trajectory, task.trajectory, scene=task.scene)
        named, notes = own_robot(task)
        draw(shown, out, robot=drawn or named, view=view)
        for note in notes if drawn is None else ():
            click.echo(f"note: {plain(note)}", err=True)
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


@click.command()
@click.argument("file", metavar="RESULT.json")
@click.option("--code", is_flag=True, help="Also print the policy.")
def explain(file: str, code: bool) -> None:
    """Explain RESULT.json, a result of `ovita adapt --out`, in plain words."""
    result = Adaptation.load(file)
    click.echo(plain(result.explanation or result.message))
    if code and result.code:
        click.echo("\n" + plain(result.code))


INSTRUCTIONS = (
    "Go left by 0.2 and slow down near the cup",
    "Keep a distance of at least 0.25 from the bottle and wait for 10 timesteps near the plate",
    "Start a little higher, end 0.15 above the box and move at a constant speed of 0.25",
)


@click.command()
@click.option("--out", "-o", default="ovita-demo", show_default=True, metavar="FOLDER", help="Where to save.")
@click.option("--open", "open_page", is_flag=True, help="Open the last interactive page in the browser.")
def demo(out: str, open_page: bool) -> None:
    """Adapt a shipped table-top scene to three instructions with the built-in writer; no key, no network."""
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(out, f"cannot be made a folder: {os.strerror(error.errno or 0).lower()}") from None
    with as_file(files("ovita") / "data" / "tabletop.json") as path:
        task = load_task(str(path))
    save_task(str(folder / "scene.json"), task)
    pictures = ("png", "html") if find_spec("matplotlib") and find_spec("plotly") else ()
    for i, instruction in enumerate(INSTRUCTIONS, start=1):
        click.secho(f"\n[{i}/{len(INSTRUCTIONS)}] {instruction}", bold=True)
        result = adapt(Request(instruction, task.trajectory, task.scene, Robot.preset("none")), writer="builtin")
        show(result)
        result.save(str(folder / f"{i}.json"))
        for suffix in pictures:
            draw(result, str(folder / f"{i}.{suffix}"))
        click.echo(f"wrote {folder / str(i)}.json" + (", .png and .html" if pictures else ""))
    if not pictures:
        click.echo("\nFor the pictures: pip install 'ovita[plot]'")
    click.echo(f'\nNow your turn: ovita adapt {folder / "scene.json"} "Go a little higher over the box"')
    if open_page and pictures:
        webbrowser.open((folder / f"{len(INSTRUCTIONS)}.html").resolve().as_uri())
