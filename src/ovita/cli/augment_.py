"""`ovita augment`: verified pairs of language and motion at any scale."""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import click

from ovita.cli.common import ENGINE, show_notes
from ovita.cli.inspect_ import inspect
from ovita.cli.main import GuessingGroup

if TYPE_CHECKING:
    from ovita.augment.engine import AugmentedDataset, Job, Progressed

EVERY = 5.0
"""Pause between two lines of progress where standard error is no terminal [s]."""


class _MakingGroup(GuessingGroup):
    """A group whose command `make` is meant where no command is named."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put `make` in front of sources and options."""
        if args and args[0] not in (*self.commands, "--help", "-h"):
            args = ["make", *args]
        return super().parse_args(ctx, args)


@click.group(cls=_MakingGroup)
def group() -> None:
    """Make pairs of language and motion, each verified by its own check.

    `ovita augment random --n 1000 --out data` makes 1000 of random scenes, as without
    SOURCES; these may also be files with
    trajectories, folders, LeRobot data sets, skills, and scenes without a trajectory. `make` is understood where no
    command is named.
    """


group.add_command(inspect)


@group.command()
@click.argument("sources", nargs=-1, metavar="[SOURCES]...")
@click.option("--n", type=click.IntRange(1), default=1000, show_default=True, help="Samples.")
@click.option("--out", "-o", metavar="FOLDER", help="Where the dataset goes. [ovita-augmented]")
@click.option("--families", default="", metavar="LIST", help="Kinds of requests, such as shift,distance,speed. [all]")
@click.option("--paraphrases", type=click.IntRange(0, 50), default=4, show_default=True, help="Further sentences each.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@click.option(
    "--format",
    "formats",
    default="jsonl",
    show_default=True,
    metavar="LIST",
    help="jsonl, parquet, lerobot, lerobot-language, scenes, mcap, or several: jsonl,lerobot.",
)
@click.option(
    "--licence",
    "licences",
    multiple=True,
    metavar="[SOURCE=]TEXT",
    help="Licence of the sources, or of one, for the dataset's card; may be repeated.",
)
@click.option("--robot", metavar="NAME|FILE", help="Whose limits hold. [what each file names, else none]")
@click.option("--waypoints", type=click.IntRange(8, 2000), metavar="N", help="Of random scenes. [as the scale has it]")
@click.option(
    "--repairs",
    type=click.FloatRange(0, 1),
    default=0.05,
    show_default=True,
    help="Share of the draws that break a limit with their path which the solver repairs; the others are drawn anew.",
)
@click.option(
    "--voices", metavar="FOLDER", help="What people wrote, whose wordings are used, too; as training/corpus/voices."
)
@click.option("--plan", type=click.FloatRange(1), metavar="N", help="Make nothing: say what N samples would take.")
@click.option(
    "--machine", "machines", multiple=True, metavar="NAME=CORES,PRICE", help="For --plan; may be given again."
)
@click.option("--jobs", type=click.IntRange(1, 1024), default=1, show_default=True, help="Workers.")
@ENGINE
@click.option("--shard", type=click.IntRange(1, 1_000_000), default=1000, show_default=True, help="Samples a shard.")
def make(sources: tuple[str, ...], out: str | None, families: str, formats: str, **options: Any) -> None:
    """Make a dataset of SOURCES. Run it again to go on after an interruption."""
    from ovita.augment.card import licences_from
    from ovita.augment.engine import Job, run
    from ovita.augment.formats import sinks_named
    from ovita.augment.sources import open_pool
    from ovita.augment.verified import Manner
    from ovita.augment.voices import with_voices
    from ovita.augment.wording import families_from

    chosen = families_from(_listed(families))
    manner = Manner(options["seed"], chosen, options["paraphrases"], options["repairs"])
    pool, notes = open_pool(sources, robot=options["robot"], waypoints=options["waypoints"])
    licences = licences_from(options["licences"], [source["name"] for source in pool.describe()])
    sinks = sinks_named(_listed(formats), licences)
    show_notes(notes)
    wordings = None if options["voices"] is None else with_voices(options["voices"])
    job = Job(options["n"], manner, pool, sinks, options["shard"], wordings=wordings)
    if options["plan"] is not None:
        _plan(job, options["plan"], options["machines"])
        return
    _show(run(job, out or "ovita-augmented", jobs=options["jobs"], engine=options["engine"], progress=_progress()))


def _plan(job: Job, n: float, machines: tuple[str, ...]) -> None:
    from ovita.augment.planning import Machine, lines, measure

    chosen = [Machine.parse(text) for text in machines]
    for line in lines(n, measure(job), chosen, job.shard):
        click.echo(line)


def _listed(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _progress() -> Any:
    """A function that shows how far a dataset is: on one line of a terminal, else a line now and then."""
    live, shown = sys.stderr.isatty(), time.monotonic()

    def show(at: Progressed) -> None:
        nonlocal shown
        now = time.monotonic()
        if live or now - shown >= EVERY:
            shown = now
            line = f"{at.done} of {at.shards} shards, {at.kept} samples"
            click.echo(f"\r{line}" if live else line, err=True, nl=not live)
        if live and at.done == at.shards:
            click.echo(err=True)

    return show


def _show(done: AugmentedDataset) -> None:
    from ovita.augment.verified import REASONS

    manifest = done.manifest
    click.echo(f"{done.kept} verified samples are in {done.folder} ({done.seconds:.1f} s for {done.made} shards)")
    parts = [*manifest["shards"], manifest]
    size = sum(file["bytes"] for part in parts for file in part["files"])
    click.echo(f"{size / 1e3:.0f} kB; every sample passed its own check after the limits")
    missing = int(manifest["n"]) - done.kept
    if missing:
        click.echo(f"{missing} of {manifest['n']} are missing: no draw for them passed, or they said what another says")
    rejected: Mapping[str, int] = manifest["rejected"]
    if rejected:
        click.echo("\nDraws that were rejected")
        for reason, count in sorted(rejected.items(), key=lambda pair: -pair[1]):
            click.echo(f"  {count:7d}  {reason}: {REASONS[reason]}")
    click.echo("\nHow they spread")
    for name in ("family", "split", "robot", "verdict", "region", "direction"):
        counts = manifest["counts"].get(name, {})
        click.echo(f"  {name}: " + ", ".join(f"{key} {count}" for key, count in counts.items()))
