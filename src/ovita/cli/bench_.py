"""`ovita bench`: success by computation, over datasets and writers."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click import option

from ovita.cli.common import ENGINE, ISOLATION, counting, pick, plain, show_notes, shown, waiting
from ovita.cli.main import GuessingGroup
from ovita.errors import RequestError

if TYPE_CHECKING:
    from ovita.bench.runner import Progress, RunPlan, Standing


@click.group(cls=GuessingGroup)
def group() -> None:
    """Measure how often writers follow instructions, on a dataset with checks.

    Start with `ovita bench generate --out scenes --n 60`, then `ovita bench run scenes`.
    """


@group.command()
@click.argument("dataset", metavar="DATASET")
@option(
    "--writer",
    "writers",
    multiple=True,
    metavar="NAME",
    help="builtin, PROVIDER:MODEL, python:MODULE:CLASS, baseline:NAME (copy, random, extract, extract-ovita,"
    " latte-style), exec:COMMAND, or all: builtin, the configured model and every baseline; may be repeated. [builtin]",
)
@option("--base-url", metavar="URL", help="An OpenAI-compatible server for the writers that are models.")
@shown("--temperature", type=click.FloatRange(0, 2), default=0.1, help="Of models.")
@option(
    "--ablate",
    default="",
    metavar="LIST",
    help="Also run without examples, toolkit, grounding, repair or constraints, or at temperature=0,0.2,0.5,0.7.",
)
@shown("--feedback", type=click.IntRange(0, 20), default=0, help="Turns of feedback.")
@pick("--feedback-on", "original current")
@option("--robot", metavar="NAME|FILE|by-subset", help="Whose limits are enforced. [each sample's own, else none]")
@ISOLATION
@option("--limit", type=click.IntRange(1), metavar="N", help="At most N samples, spread over all.")
@option("--jobs", type=click.IntRange(1, 64), metavar="N", help="Samples at a time. [one a core, at most 4]")
@ENGINE
@option("--rate", type=click.FloatRange(0, min_open=True), metavar="N", help="Requests a minute to each model.")
@shown("--retries", type=click.IntRange(0, 20), default=2, help="Of failed requests.")
@shown(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    default=300,
    metavar="S",
    help="Longest time for an answer of exec:COMMAND [s].",
)
@option("--budget-tokens", type=click.IntRange(1), metavar="N", help="Begin no sample after so many tokens.")
@option("--budget-cost", type=click.FloatRange(0, min_open=True), metavar="X", help="... or so much money.")
@option(
    "--price", "prices", multiple=True, metavar="WRITER=IN,OUT", help="Money for a million tokens read and written."
)
@option("--out", "-o", metavar="FOLDER", help="Where records and report go. [bench-DATASET]")
@option("--replay", metavar="FOLDER", help="Take replies and times from an earlier run; no writer is asked.")
@option("--parquet", is_flag=True, help="Also write records.parquet.")
@option("--no-figures", is_flag=True, help="Draw no figures.")
def run(dataset: str, out: str | None, replay: str | None, parquet: bool, no_figures: bool, **options: Any) -> None:
    """Run the samples of DATASET, and report. Run it again to go on after an interruption."""
    from ovita.bench import runner
    from ovita.bench.dataset import load_dataset

    options["writers"] = _writers(options["writers"])
    plan = _plan(options, replay)
    samples = load_dataset(dataset, limit=options["limit"])
    folder = out or f"bench-{samples.name}{'-replay' if replay else ''}"
    if replay and Path(replay).resolve() == Path(folder).resolve():
        raise RequestError(f"a replay of {replay} cannot be written there itself; choose another --out")
    if samples.skipped:
        click.echo(f"note: {len(samples.skipped)} files have no check and are left out", err=True)
    done = runner.run(samples, folder, plan, replay=replay, progress=_progress())
    _report(
        folder, done.records, done.manifest, done.notes, prices=plan.prices, parquet=parquet, figures=not no_figures
    )


@group.command()
@click.argument("folder", metavar="FOLDER")
@option("--ratings", metavar="FILE", help="People's ratings: columns sample, writer, rating. [FOLDER/ratings.csv]")
@option("--price", "prices", multiple=True, metavar="WRITER=IN,OUT", help="Money for a million tokens.")
@option("--parquet", is_flag=True, help="Also write records.parquet.")
@option("--no-figures", is_flag=True, help="Draw no figures.")
def report(folder: str, ratings: str | None, prices: tuple[str, ...], parquet: bool, no_figures: bool) -> None:
    """Write the report of the run in FOLDER again."""
    from ovita.bench.records import read_manifest, read_records

    given = {"prices": _prices(prices), "parquet": parquet, "figures": not no_figures}
    _report(folder, read_records(folder), read_manifest(folder), (), ratings_from=ratings, **given)


@group.command()
@option("--add", "runs", multiple=True, metavar="RUN", help="Enter the run in this folder first; may be repeated.")
@option("--note", default="", metavar="TEXT", help="What else must be known of these runs.")
@shown("--folder", default="leaderboard", metavar="FOLDER", help="Where the entries lie.")
@option("--out", "-o", metavar="FILE", help="Where the page goes. [FOLDER/index.html]")
def leaderboard(runs: tuple[str, ...], note: str, folder: str, out: str | None) -> None:
    """Show all runs that were entered, and write them as one page; --add enters a run."""
    from ovita.bench import leaderboard as board
    from ovita.io import atomic_write

    for run in runs:
        click.echo(f"entered {run} as {board.add(run, folder, note)}")
    entries = board.read_leaderboard(folder)
    page = Path(out or Path(folder) / board.PAGE)
    atomic_write(page, board.page(entries))
    _print(board.text(entries))
    click.echo(f"wrote {page}")


@group.command()
@option("--out", "-o", required=True, metavar="FOLDER", help="Where the samples go.")
@shown("--n", type=click.IntRange(1, 1_000_000), default=500, help="Samples.")
@shown("--seed", type=click.IntRange(0), default=0)
@pick("--split", "train heldout", "Held-out instructions use words that no train instruction has.")
@option("--family", "families", multiple=True, metavar="NAME", help="latte, numeric or multi. [all]")
@option("--robot", "robots", multiple=True, metavar="NAME", help="tabletop, drone, ground or arm. [all]")
def generate(out: str, n: int, seed: int, split: str, families: tuple[str, ...], robots: tuple[str, ...]) -> None:
    """Make a dataset of scenes and instructions with known checks."""
    from ovita.bench.generate import generate, write_dataset

    with waiting("draws samples"):
        samples = generate(n, seed=seed, split=split, families=families, robots=robots)  # type: ignore[arg-type]
        count = write_dataset(out, samples)
    click.echo(f"wrote {count} samples to {out}")


@group.command()
@shown("--out", "-o", default="ovita-dataset", metavar="FOLDER", help="Where it goes.")
@option("--base-url", metavar="URL", help="Where from. [the public repository]")
def fetch(out: str, base_url: str | None) -> None:
    """Download the public OVITA dataset, and verify it; offline it says what to put where."""
    from ovita.bench import dataset as source

    with waiting("downloads"):
        fetched = source.fetch(out, base_url=base_url or source.BASE_URL)
    click.echo(f"{fetched.whole} files are in {out} and are as published ({fetched.downloaded} of them new)")
    click.echo(f"next: ovita bench run {out}")


def _writers(given: tuple[str, ...]) -> tuple[str, ...]:
    """The writers as given, "all" being what can run here; what cannot is said."""
    from ovita.bench.systems import EVERYTHING, systems_here

    if EVERYTHING not in given:
        return given
    here = systems_here()
    for name, reason in here.missing.items():
        click.echo(f"note: {name} is left out: {reason}", err=True)
    return (*here.names, *(name for name in given if name != EVERYTHING))


_LIMITS = ("retries", "budget_tokens", "budget_cost", "timeout")


def _plan(options: dict[str, Any], replay: str | None) -> RunPlan:
    from ovita.bench.evaluate import BY_SUBSET, Protocol, conditions_from
    from ovita.bench.records import read_manifest
    from ovita.bench.runner import RunPlan, default_jobs
    from ovita.io import load_robot

    robot = options["robot"]
    if robot is not None and robot != BY_SUBSET:
        load_robot(robot)
    if replay is not None:
        manifest = {"feedback": 0, "feedback_on": "original", "robot": None, **read_manifest(replay)}
        options |= {"feedback": int(manifest["feedback"]), "feedback_on": manifest["feedback_on"]}
        options["temperature"] = float(manifest.get("temperature", options["temperature"]))
        robot = None if manifest["robot"] in (None, "each sample's own") else str(manifest["robot"])
    return RunPlan(
        writers=tuple(dict.fromkeys(options["writers"])) or ("builtin",),
        conditions=conditions_from(options["ablate"]),
        protocol=Protocol(options["feedback"], options["feedback_on"], robot, options["isolation"]),
        jobs=options["jobs"] or default_jobs(),
        per_minute=options["rate"],
        prices=_prices(options["prices"]),
        **{name: options[name] for name in ("base_url", "temperature", "engine", *_LIMITS)},
    )


def _prices(given: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    found: dict[str, tuple[float, float]] = {}
    for text in given:
        writer, _, money = text.rpartition("=")
        read, _, written = money.partition(",")
        try:
            found[writer] = (float(read), float(written))
        except ValueError:
            writer = ""
        if not writer or min(found[writer]) < 0:
            raise RequestError(f"the price {text!r} cannot be read; write --price openai:gpt-5=1.25,10")
    return found


def _progress() -> Progress:
    tell = counting()

    def show(now: Standing) -> None:
        left = "" if now.left_s is None else f", {_clock(now.left_s)} left"
        tokens = f", {now.tokens} tokens" if now.tokens else ""
        tell(f"{now.done}/{now.total} done, {now.passed} pass{tokens}{left}", now.done == now.total)

    return show


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min {rest:02d} s" if minutes else f"{rest} s"


def _report(
    folder: str, records: Any, manifest: Any, notes: Any, *, ratings_from: str | None = None, **given: Any
) -> None:
    from ovita.bench.records import read_ratings
    from ovita.bench.report import outcome_table, success_table, write_report

    written = write_report(
        folder, records, manifest, ratings=read_ratings(ratings_from or folder), notes=notes, **given
    )
    for rows in (success_table(records, given["prices"]), outcome_table(records)):
        _print(rows)
    show_notes(notes)
    click.echo("wrote " + ", ".join(str(path) for path in written))


def _print(rows: list[list[str]]) -> None:
    """Print a table whose first row names the columns."""
    from rich.console import Console
    from rich.table import Column, Table

    first, *others = rows[0]
    table = Table(first, *(Column(name, justify="right") for name in others), box=None, pad_edge=False)
    for row in rows[1:]:
        table.add_row(*(plain(cell).replace("[", "\\[") for cell in row))
    Console(width=None if sys.stdout.isatty() else 160).print(table)
