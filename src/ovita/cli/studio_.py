"""`ovita studio`: see it, say it, turn the knobs, in the browser."""

from __future__ import annotations

from pathlib import Path

import click

from ovita.dialogue.session import Session
from ovita.io import load_robot
from ovita.limits import ConstraintOptions
from ovita.paths.robot import Robot
from ovita.paths.trajectory import Trajectory
from ovita.policy.sandbox import known_isolation
from ovita.writers.base import writer_named


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
@click.option("--writer", "--llm", "writer", default="auto", show_default=True, metavar="NAME", help="As for adapt.")
@click.option("--base-url", metavar="URL", help="An OpenAI-compatible server; --writer then names its model.")
@click.option(
    "--robot", metavar="NAME|FILE", help="Limits to begin with: drone, arm, ground, none, or a file. [scene's]"
)
@click.option("--sessions", type=click.Path(path_type=Path), help="Folder where sessions are kept.")
@click.option(
    "--isolation",
    type=click.Choice(["auto", "strict", "degraded"]),
    default="auto",
    show_default=True,
    help="How policies are isolated.",
)
def command(
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
        Trajectory([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]], [0.1, 0.1]),  # type: ignore[arg-type]
        robot=limits,
        writer=writer_named(writer, base_url=base_url, temperature=0.1),
        constraints=ConstraintOptions(),
        isolation=known_isolation(isolation),
    )
    studio = Studio(StudioSettings(template, files, host, port, token, sessions or default_folder()))
    made = token == "auto"
    told = "" if made or not token else "; it asks for the token"
    click.echo(f"The studio is open at {studio.url if made else studio.url.partition('?')[0]}{told}")
    click.echo("Ctrl-C ends it; every session is kept and goes on when it starts again.")
    try:
        studio.wait()
    finally:
        studio.stop()
