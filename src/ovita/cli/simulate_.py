"""`ovita simulate`: a robot follows the trajectories of a result, or of a scene."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import click

from ovita import sim
from ovita.cli.common import ENGINE, EXIT_OF, choices_from, plain, show_notes, source, waiting
from ovita.cli.joints_ import IGNORED, TIP
from ovita.errors import FormatError
from ovita.io import is_adaptation, is_address, open_task
from ovita.paths.robot import Robot, preset_name
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation
from ovita.workers import Engine

_DISTURBED = (
    click.option("--noise", type=float, default=0.0, metavar="M|RAD", help="Of measured places, standard deviation."),
    click.option("--rate-noise", type=float, default=0.0, metavar="M/S", help="Of measured speeds; rad/s of joints."),
    click.option("--delay", type=float, default=0.0, metavar="S", help="From the sensors to the actuators."),
    click.option("--lag", type=float, default=0.0, metavar="S", help="Time constant of rotors and motors."),
    click.option("--payload", type=float, default=0.0, metavar="KG", help="At the tip, unknown to the controller."),
    click.option("--wind", metavar="X,Y,Z", help="Velocity of the air in the scene's coordinates, in m/s."),
    click.option("--gust", type=float, default=0.0, metavar="M/S", help="Standard deviation of the wind's changes."),
    click.option("--seed", type=int, default=0, metavar="N", help="Of noise and gusts."),
)


def disturbed(function: Any) -> Any:
    """Add the options on what disturbs a simulated robot."""
    for option in reversed(_DISTURBED):
        function = option(function)
    return function


def disturbances_of(options: dict[str, Any]) -> sim.Disturbances:
    """What disturbs a robot by a command's options."""
    text = options["wind"] or "0,0,0"
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise click.UsageError(f"--wind {text!r} is not x,y,z; give metres per second, such as --wind 2,0,0") from None
    named = ("noise", "rate_noise", "delay", "lag", "payload", "gust", "seed")
    return sim.Disturbances(wind=(x, y, z), **{name: options[name] for name in named})


@click.command()
@click.argument("file", metavar="FILE")
@click.option(
    "--robot",
    metavar="NAME|FILE",
    help="arm (iiwa), drone (crazyflie), ground (jackal, rover), or a .toml, model or folder. [FILE's]",
)
@click.option(
    "--which",
    type=click.Choice(["both", "original", "adapted"]),
    default="both",
    show_default=True,
    help="Of a result.",
)
@click.option("--video", metavar="FILE", help="Also render a video: .mp4 or .gif.")
@click.option(
    "--base", metavar="X,Y,Z,YAW", help="Where the robot stands, in metres and radians. [an arm: where it reaches most]"
)
@click.option(
    "--orientation",
    type=click.Choice(["auto", "free", "keep"]),
    default="auto",
    show_default=True,
    help="Of an arm's tip: as the trajectory says if it does, free, or kept as at the start.",
)
@TIP
@IGNORED
@click.option("--solid", is_flag=True, help="Objects push back; otherwise contact is only reported.")
@disturbed
@click.option("--json", "as_json", is_flag=True, help="Print the reports as JSON.")
@click.option("--report", metavar="FILE", help="FILE is a folder: a table of all in it, as .csv, .md or .json.")
@click.option("--jobs", type=click.IntRange(1), default=1, show_default=True, help="Workers, with --report.")
@ENGINE
@source
def command(
    file: str, video: str | None, as_json: bool, report: str | None, jobs: int, engine: Engine, **options: Any
) -> None:
    """Let a robot follow FILE in physical simulation: a result of `ovita adapt --out`, or a trajectory in any format.

    Reports how well and how fast the robot follows, what it cannot reach and what it touches. Exit code 4 where it is
    off course, cannot reach a waypoint, or touches something that it is not meant to touch.

    With --report, FILE is a folder; every trajectory and result in it is simulated, and the table says how each went.
    """
    if report is not None:
        from ovita.cli.simulate_batch_ import simulate_all

        if video is not None or as_json:
            raise click.UsageError("--report simulates a whole folder; leave --video and --json out")
        sys.exit(simulate_all(file, report, jobs, engine, options))
    if video is not None:
        sim.check_video(video)
    panes, scene, title, model = simulated(file, options, quiet=as_json)
    if as_json:
        click.echo(json.dumps({pane.label: pane.simulation.report.to_dict() for pane in panes}, indent=2))
    else:
        for pane in panes:
            click.echo(f"\n{pane.label}: {pane.simulation.report.status}")
            for sentence in pane.simulation.report.sentences():
                click.echo(plain(f"  {sentence}"))
    if video is not None:
        with _bar("rendering", quiet=as_json) as progress:
            sim.save_video(
                video, panes, sim.WorldTransform(scene.frame), title=plain(title), robot=model.title, progress=progress
            )
        if not as_json:
            click.echo(f"\nwrote {video}")
    if any(pane.simulation.report.status in sim.FAILED for pane in panes):
        sys.exit(EXIT_OF["infeasible"])


def simulated(
    file: str, options: dict[str, Any], *, quiet: bool = True
) -> tuple[list[sim.Pane], Scene, str, sim.RobotModel]:
    """The simulations of a file's trajectories by a command's options, the scene, a title, and the robot."""
    disturbances = disturbances_of(options)
    stood = None if options["base"] is None else sim.Base.parse(options["base"])
    paths, scene, limits, title, contacts = _read(file, options["which"], options)
    name = options["robot"] or _robot_for(limits, file)
    with waiting("loading the simulator and placing the robot", quiet=quiet):
        sim.require()
        model = sim.load_model(name, tip=options["tip"], ignore_contacts=options["ignored"])
        if stood is None:
            stood = sim.place([path for _, path in paths], scene, model, limits)
    panes = []
    for label, path in paths:
        with _bar(f"simulating {label}", quiet=quiet) as progress:
            done = sim.simulate(
                path,
                scene,
                model,
                base=stood,
                limits=limits,
                orientation=options["orientation"],
                solid=options["solid"],
                contacts=contacts,
                disturbances=disturbances,
                progress=progress,
            )
        panes.append(sim.Pane(label, path, done))
    return panes, scene, title, model


def _read(
    file: str, which: str, options: dict[str, Any]
) -> tuple[list[tuple[str, Trajectory]], Scene, Robot | None, str, tuple[str, ...]]:
    """The labelled trajectories, the scene, the limits, a title, and the objects that are meant to be touched."""
    if not is_address(file) and is_adaptation(file):
        for name in ("scene_file", "frame", "topic", "message", "home", "heading"):
            if options[name] is not None:
                flag = name.removesuffix("_file")
                raise FormatError(file, f"is a result, which has its own scene; leave --{flag} out")
        result = Adaptation.load(file)
        both = [("original", result.original), ("adapted", result.adapted)]
        chosen = [item for item in both if which in ("both", item[0])]
        return chosen, result.scene, result.robot, result.instruction, result.contacts
    if which == "adapted":
        raise FormatError(file, "is no result, so it has no adapted trajectory; adapt it first: ovita adapt ... --out")
    task = open_task(file, scene_file=options["scene_file"], frame=options["frame"], choices=choices_from(options))
    show_notes(task.notes)
    limits = Robot.preset(task.robot) if task.robot and preset_name(task.robot) in sim.STAND_INS else None
    return [("original", task.trajectory)], task.scene, limits, task.instruction, ()


def _robot_for(limits: Robot | None, file: str) -> str:
    name = "" if limits is None else limits.name
    if name not in sim.STAND_INS:
        raise click.UsageError(
            f"{file} does not say which robot it is for; choose one: --robot {'|'.join(sim.STAND_INS)}"
        )
    return sim.STAND_INS[name]


@contextmanager
def _bar(label: str, *, quiet: bool) -> Iterator[Callable[[float], None] | None]:
    """A progress bar on standard error while the block runs, if that is a terminal."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bars:
        task = bars.add_task(label, total=1.0)
        yield lambda share: bars.update(task, completed=share)
