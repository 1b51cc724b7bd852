"""`ovita demo`: a shipped scene, three instructions, three pictures."""

from __future__ import annotations

import os
import webbrowser
from importlib.resources import as_file, files
from pathlib import Path

import click

from ovita.chain import adapt
from ovita.cli.plot_ import draw
from ovita.cli.report import show
from ovita.errors import FormatError
from ovita.io import load_task
from ovita.paths.robot import Robot
from ovita.request import Request

INSTRUCTIONS = (
    "Go left by 0.2 and slow down near the cup",
    "Keep a distance of at least 0.25 from the bottle and wait for 10 timesteps near the plate",
    "Start a little higher, end 0.15 above the box and move at a constant speed of 0.25",
)


@click.command()
@click.option("--out", "-o", default="ovita-demo", show_default=True, metavar="FOLDER", help="Where to save.")
@click.option("--open", "open_page", is_flag=True, help="Open the last interactive page in the browser.")
def command(out: str, open_page: bool) -> None:
    """Adapt a shipped table-top scene to three instructions with the built-in writer; no key, no network."""
    folder = Path(out)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FormatError(out, f"cannot be made a folder: {os.strerror(error.errno or 0).lower()}") from None
    with as_file(files("ovita") / "data" / "tabletop.json") as path:
        task = load_task(str(path))
    for i, instruction in enumerate(INSTRUCTIONS, start=1):
        click.secho(f"\n[{i}/{len(INSTRUCTIONS)}] {instruction}", bold=True)
        result = adapt(Request(instruction, task.trajectory, task.scene, Robot.preset("none")), writer="builtin")
        show(result)
        result.save(str(folder / f"{i}.json"))
        for suffix in ("png", "html"):
            draw(result, str(folder / f"{i}.{suffix}"))
        click.echo(f"wrote {folder / str(i)}.json, .png and .html")
    if open_page:
        webbrowser.open((folder / f"{len(INSTRUCTIONS)}.html").resolve().as_uri())
