"""`ovita simulate`: a robot follows the trajectories of a result or a scene; of all in a folder, with a table."""

from __future__ import annotations

import csv
import io
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import click
from click import option

from ovita import sim
from ovita.cli.common import ENGINE, EXIT_OF, pick, plain, say, show_notes, shown, source, task_at, together, waiting
from ovita.cli.joints_ import IGNORED, TIP
from ovita.errors import FormatError, OvitaError, RequestError
from ovita.io import READ, atomic_write, is_adaptation
from ovita.io.files import suffix
from ovita.paths.robot import Robot, preset_name
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.result import Adaptation
from ovita.workers import Engine, shared

disturbed = together(
    option("--noise", type=float, default=0.0, metavar="M|RAD", help="Of measured places, standard deviation."),
    option("--rate-noise", type=float, default=0.0, metavar="M/S", help="Of measured speeds; rad/s of joints."),
    option("--delay", type=float, default=0.0, metavar="S", help="From the sensors to the actuators."),
    option("--lag", type=float, default=0.0, metavar="S", help="Time constant of rotors and motors."),
    option("--payload", type=float, default=0.0, metavar="KG", help="At the tip, unknown to the controller."),
    option("--wind", metavar="X,Y,Z", help="Velocity of the air in the scene's coordinates, in m/s."),
    option("--gust", type=float, default=0.0, metavar="M/S", help="Standard deviation of the wind's changes."),
    option("--seed", type=int, default=0, metavar="N", help="Of noise and gusts."),
)
"""The options on what disturbs a simulated robot."""


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
@option(
    "--robot",
    metavar="NAME|FILE",
    help="arm (iiwa), drone (crazyflie), ground (jackal, rover), or a .toml, model or folder. [FILE's]",
)
@pick("--which", "both original adapted", "Of a result.")
@option("--video", metavar="FILE", help="Also render a video: .mp4 or .gif.")
@option(
    "--base", metavar="X,Y,Z,YAW", help="Where the robot stands, in metres and radians. [an arm: where it reaches most]"
)
@pick(
    "--orientation",
    "auto free keep",
    help="Of an arm's tip: as the trajectory says if it does, free, or kept as at the start.",
)
@TIP
@IGNORED
@option("--solid", is_flag=True, help="Objects push back; otherwise contact is only reported.")
@disturbed
@option("--json", "as_json", is_flag=True, help="Print the reports as JSON.")
@option("--report", metavar="FILE", help="FILE is a folder: a table of all in it, as .csv, .md or .json.")
@shown("--jobs", type=click.IntRange(1), default=1, help="Workers, with --report.")
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
        if video is not None or as_json:
            raise click.UsageError("--report simulates a whole folder; leave --video and --json out")
        sys.exit(simulate_all(file, report, jobs, engine, options))
    if video is not None:
        sim.check_video(video)
    panes, scene, title, model = simulated(file, options, quiet=as_json)
    reports = {pane.label: pane.simulation.report for pane in panes}
    if as_json:
        click.echo(json.dumps({label: told.to_dict() for label, told in reports.items()}, indent=2))
    for label, told in () if as_json else reports.items():
        click.echo(f"\n{label}: {told.status}")
        say(*(f"  {sentence}" for sentence in told.sentences()))
    if video is not None:
        axes = sim.WorldTransform(scene.frame)
        with _bar("rendering", quiet=as_json) as progress:
            sim.save_video(video, panes, axes, title=plain(title), robot=model.title, progress=progress)
        if not as_json:
            click.echo(f"\nwrote {video}")
    if any(told.status in sim.FAILED for told in reports.values()):
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
    given: dict[str, Any] = {"base": stood, "limits": limits, "contacts": contacts, "disturbances": disturbances}
    given |= {name: options[name] for name in ("orientation", "solid")}
    panes = []
    for label, path in paths:
        with _bar(f"simulating {label}", quiet=quiet) as progress:
            panes.append(sim.Pane(label, path, sim.simulate(path, scene, model, progress=progress, **given)))
    return panes, scene, title, model


def _read(
    file: str, which: str, options: dict[str, Any]
) -> tuple[list[tuple[str, Trajectory]], Scene, Robot | None, str, tuple[str, ...]]:
    """The labelled trajectories, the scene, the limits, a title, and the objects that are meant to be touched."""
    if is_adaptation(file):
        known = ("scene_file", "frame", "topic", "message", "home", "heading")
        for name in (name for name in known if options[name] is not None):
            flag = name.removesuffix("_file")
            raise FormatError(file, f"is a result, which has its own scene; leave --{flag} out")
        result = Adaptation.load(file)
        both = [("original", result.original), ("adapted", result.adapted)]
        chosen = [item for item in both if which in ("both", item[0])]
        return chosen, result.scene, result.robot, result.instruction, result.contacts
    if which == "adapted":
        raise FormatError(file, "is no result, so it has no adapted trajectory; adapt it first: ovita adapt ... --out")
    task = task_at(file, options)
    show_notes(task.notes)
    limits = Robot.preset(task.robot) if task.robot and preset_name(task.robot) in sim.STAND_INS else None
    return [("original", task.trajectory)], task.scene, limits, task.instruction, ()


def _robot_for(limits: Robot | None, file: str) -> str:
    name = "" if limits is None else limits.name
    if name not in sim.STAND_INS:
        known = "|".join(sim.STAND_INS)
        raise click.UsageError(f"{file} does not say which robot it is for; choose one: --robot {known}")
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


FORMATS = (".csv", ".md", ".json")


@dataclass(frozen=True)
class Simulated:
    """A row of the table: how one trajectory of one file went; lengths in metres, times in seconds."""

    file: str
    which: str
    robot: str
    status: str
    rms: float | None = None
    peak: float | None = None
    asked: float | None = None
    achieved: float | None = None
    unreachable: int = 0
    contacts: str = ""
    problem: str = ""

    @property
    def failed(self) -> bool:
        """Whether nobody should run it on a robot."""
        return self.status in (*sim.FAILED, "not simulated")


def simulate_all(folder: str, report: str, jobs: int, engine: Engine, options: dict[str, Any]) -> int:
    """Simulate what a folder holds, print a line for each, write the table; the exit code.

    Raises:
        RequestError: If the folder holds nothing to simulate, or the table has no known ending.
    """
    if suffix(report) not in FORMATS:
        raise RequestError(f"--report {report}: tables are written as {', '.join(FORMATS)}")
    files = _files(Path(folder), besides=Path(report))
    rows: list[Simulated] = []
    work = partial(rows_of, options=options)
    for several in shared(work, map(str, files), jobs=min(jobs, len(files)), engine=engine):
        rows += several
        for row in several:
            say(_line(row))
    rows.sort(key=lambda row: row.file)
    atomic_write(report, table(rows, suffix(report)))
    failed = sum(row.failed for row in rows)
    say(f"\n{len(rows)} simulations of {len(files)} files, {failed} failed; wrote {report}")
    return EXIT_OF["infeasible"] if failed else 0


def _files(folder: Path, besides: Path) -> list[Path]:
    if not folder.is_dir():
        raise RequestError(f"--report wants a folder of trajectories and results; {folder} is none")
    known = [path for path in sorted(folder.iterdir()) if path.is_file() and suffix(path) in READ]
    files = [path for path in known if path.resolve() != besides.resolve()]
    if not files:
        raise RequestError(f"{folder} holds no file of a known format ({', '.join(READ)})")
    return files


def rows_of(file: str, options: dict[str, Any]) -> list[Simulated]:
    """How the trajectories of one file went; one row that says why where there is none."""
    name = Path(file).name
    try:
        panes, *_, model = simulated(file, options)
    except (OvitaError, click.UsageError) as error:
        said = error.message if isinstance(error, click.UsageError) else str(error)
        return [Simulated(name, options["which"], options["robot"] or "", "not simulated", problem=said)]
    return [_row(name, pane.label, model.name, pane.simulation.report) for pane in panes]


def _row(file: str, which: str, robot: str, report: sim.Report) -> Simulated:
    t = report.tracking
    struck = "; ".join(contact.told for contact in report.contacts if not contact.meant)
    errors, lasts = (round(t.rms, 6), round(t.max, 6)), (round(report.asked, 3), round(report.achieved, 3))
    return Simulated(file, which, robot, report.status, *errors, *lasts, len(report.unreachable), struck)


def _line(row: Simulated) -> str:
    if row.rms is None or row.peak is None:
        return f"{row.file} {row.which}: {row.status}: {row.problem}"
    more = f", touches {row.contacts}" if row.contacts else ""
    return f"{row.file} {row.which}: {row.status}, {1e3 * row.rms:.1f} mm rms, at most {1e3 * row.peak:.1f} mm{more}"


def table(rows: Sequence[Simulated], ending: str) -> str:
    """The rows as a document of that ending."""
    cells = [asdict(row) for row in rows]
    names = list(cells[0])
    if ending == ".json":
        return json.dumps(cells, indent=1) + "\n"
    if ending == ".md":
        shown = [["" if value is None else str(value).replace("|", "\\|") for value in cell.values()] for cell in cells]
        return "".join(f"| {' | '.join(line)} |\n" for line in (names, ["---"] * len(names), *shown))
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows([names, *(cell.values() for cell in cells)])
    return out.getvalue()
