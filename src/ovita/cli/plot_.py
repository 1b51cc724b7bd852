"""`ovita plot`: pictures of results and scenes."""

from __future__ import annotations

import os

import click

from ovita.adaptation import Adaptation
from ovita.errors import FormatError
from ovita.formats import is_adaptation, load_robot, load_task
from ovita.robot import Robot
from ovita.scene import Scene
from ovita.trajectory import Trajectory


@click.command()
@click.argument("file", metavar="FILE")
@click.option("--out", "-o", metavar="FILE", help=".png, .svg, .pdf or .html. [FILE with .png]")
@click.option("--robot", metavar="NAME|FILE", help="Whose workspace to draw. [the result's]")
@click.option("--view", type=click.Choice(["auto", "3d", "top"]), default="auto", show_default=True)
def command(file: str, out: str | None, robot: str | None, view: str) -> None:
    """Draw FILE, a result of `ovita adapt --out` (before and after) or a scene (its trajectory)."""
    out = out or os.path.splitext(file)[0] + ".png"
    drawn = load_robot(robot) if robot else None
    if is_adaptation(file):
        draw(Adaptation.load(file), out, robot=drawn, view=view)
    else:
        task = load_task(file)
        _draw(task.trajectory, task.trajectory, task.scene, drawn, task.instruction, (), out, view)
    click.echo(f"wrote {out}")


def draw(result: Adaptation, out: str, *, robot: Robot | None = None, view: str = "auto") -> None:
    """Draw an adaptation into a file, by its suffix."""
    notes = [*result.plan, *result.explanation.split("\n")]
    drawn = robot or result.robot
    _draw(result.original, result.adapted, result.scene, drawn, result.instruction, notes, out, view)


def _draw(
    original: Trajectory,
    adapted: Trajectory,
    scene: Scene,
    robot: Robot | None,
    title: str,
    notes: tuple[str, ...] | list[str],
    out: str,
    view: str,
) -> None:
    from ovita import plots
    from ovita.formats import atomic_write

    suffix = os.path.splitext(out)[1].lower()
    if suffix in (".html", ".htm"):
        atomic_write(out, plots.interactive(original, adapted, scene, robot=robot, title=title, notes=notes))
    elif suffix in (".png", ".svg", ".pdf"):
        plots.save(out, plots.figure(original, adapted, scene, robot=robot, title=title, view=view))  # type: ignore[arg-type]
    else:
        raise FormatError(out, "pictures are written as .png, .svg, .pdf or .html")
