"""`ovita tour`: what ovita does, in five steps on the shipped scene."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from importlib.resources import as_file, files

import click

from ovita.cli.common import called, plain, show
from ovita.dialogue.session import Session
from ovita.io import load_task, save_task
from ovita.io.files import make_folder
from ovita.text import listed

SAID, KNOB = "Go left by 0.2 and slow down near the cup", ("left", 0.3)


@click.command()
@click.option("--out", "-o", default="ovita-tour", show_default=True, metavar="FOLDER", help="Where to save.")
@click.option("--yes", is_flag=True, help="Go on without waiting for the Enter key.")
def command(out: str, yes: bool) -> None:
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
    with as_file(files("ovita") / "data" / "tabletop.json") as path:
        task = load_task(str(path))
    session = Session(task.trajectory, task.scene, writer="builtin")
    yield "Something to change: a trajectory and what surrounds it"
    path_now = task.trajectory
    click.echo(f"{len(path_now)} waypoints, {path_now.length:.2f} m in {path_now.duration:.1f} s over a table.")
    click.echo(plain(f"On it: {listed(task.scene.names)}."))
    yield f'Say what should change: "{SAID}"'
    show(session.say(SAID))
    click.echo("\nThe plan is how it was understood; the first line and the limits are the verdict.")
    yield f"Turn a knob: {KNOB[0]} = {KNOB[1]}"
    result = session.tune(dict([KNOB]))
    show(result)
    click.echo("\nThe same policy ran again with another number; nobody wrote a new one.")
    yield "Take it back"
    session.undo()
    kept = session.adaptation
    assert kept is not None
    click.echo("\n".join(f"  {parameter.line}" for parameter in kept.parameters))
    click.echo("Every turn can be taken back and brought back.")
    yield "Save, and go on by yourself"
    folder = make_folder(out)
    save_task(str(folder / "scene.json"), task)
    kept.save(str(folder / "result.json"))
    click.echo(f"wrote {folder / 'scene.json'} and {folder / 'result.json'}\n")
    click.echo(f"{called()} explain {folder / 'result.json'}")
    click.echo(f'{called()} adapt {folder / "result.json"} "Keep at least 0.25 from the bottle" --robot arm')
    click.echo(f"{called()} chat {folder / 'scene.json'}")
