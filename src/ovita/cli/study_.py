"""`ovita study`: a user study of adapted trajectories, from bench runs to answers on disk and what they amount to."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click import option

from ovita.cli.common import shown, waiting
from ovita.cli.main import GuessingGroup
from ovita.errors import RequestError

if TYPE_CHECKING:
    from ovita.study.ratings import Rating


@click.group(cls=GuessingGroup)
def group() -> None:
    """Let people judge adapted trajectories, blinded and in balanced order.

    Write a STUDY.toml and a consent text (docs/study.md has both), then
    `ovita study new STUDY.toml --runs BENCH-RUN --out DIR` and `ovita study serve DIR`. `ovita study plan` says
    how many people it takes, `ovita study report DIR` what their answers amount to.
    """


@group.command()
@click.argument("file", metavar="STUDY.toml")
@click.argument("more_runs", metavar="[RUN]...", nargs=-1)
@option("--runs", multiple=True, required=True, metavar="RUN", help="Folders that `ovita bench run` wrote.")
@option("--per-person", type=int, metavar="N", help="Ratings a person gives. [the file's, else 24]")
@option("--participants", type=int, metavar="N", help="How many links are made. [the file's, else 30]")
@option("--seed", type=int, metavar="N", help="Decides every order and letter. [the file's, else 0]")
@option("--pilot", is_flag=True, default=None, help="A trial, watermarked, whose data are not for analysis.")
@option("--out", "-o", required=True, metavar="DIR", help="The study's folder, which must not exist yet.")
def new(file: str, runs: tuple[str, ...], more_runs: tuple[str, ...], out: str, **options: Any) -> None:
    """Make a study of what conditions did in bench runs: who sees what, in which order, under which letters."""
    from ovita.study.folder import found_study

    changes = {name: value for name, value in options.items() if value is not None}
    study = found_study(file, (*runs, *more_runs), out, changes)
    design, names = study.design, study.founded.names
    shown = len(names) * len(study.items)
    times = design.per_person * len(study.participants)
    click.echo(
        f"{len(study.participants)} people, {len(study.items)} items, {len(names)} conditions: {', '.join(names)}."
    )
    low, high = times // shown, -(-times // shown)
    often = f"{low}" if low == high else f"{low} or {high}"
    click.echo(f"Each person rates {design.per_person} results; each result is rated {often} times.")
    if design.pilot:
        click.echo("This is a pilot: every page and every answer says so.")
    click.echo(f"The links are in {Path(out) / 'links.csv'}; keep them to yourself. Next: ovita study serve {out}")


@group.command()
@click.argument("folder", metavar="DIR")
@shown("--port", type=click.IntRange(0, 65535), default=8770, help="0 for any that is free.")
@shown("--host", default="127.0.0.1", help="0.0.0.0 lets other machines in.")
@option("--static", "files", metavar="FOLDER", help="Instead write one file a person, for use without a server.")
def serve(folder: str, port: int, host: str, files: str | None) -> None:
    """Serve the study in DIR, a page for each person's link, until ctrl-c; what was answered is on disk at once."""
    from ovita.study import pages
    from ovita.study.folder import address_of, open_study
    from ovita.study.offline import write_files
    from ovita.study.server import StudyServer

    study = open_study(folder)
    if files is not None:
        click.echo(
            f"wrote {len(write_files(study, files))} files to {files}; give each person one, and take in what they"
        )
        click.echo(f"hand over by: ovita study collect {folder} answers-*.jsonl")
        return
    pages.scripts()
    server = StudyServer(study, host, port)
    click.echo(f"Serving {study.design.title!r} at {server.url}")
    if host in ("0.0.0.0", "::"):
        click.echo(
            "  Others write this machine's name in place of that address; it is plain HTTP, for trusted networks."
        )
    for name, token in list(study.tokens.items())[:3]:
        click.echo(f"  {name}: {server.url}{address_of(token)}")
    click.echo(f"All links are in {Path(folder) / 'links.csv'}. Stop with ctrl-c; people can go on after a restart.")
    try:
        server.serve_forever()
    finally:
        server.server_close()


@group.command()
@click.argument("folder", metavar="DIR")
@click.argument("files", metavar="FILE...", nargs=-1, required=True)
def collect(folder: str, files: tuple[str, ...]) -> None:
    """Take in the FILEs that people's pages handed over; the first answer to a page counts."""
    from ovita.study import offline
    from ovita.study.folder import open_study

    study = open_study(folder)
    for file in files:
        done = offline.collect(study, file)
        told = "withdrew; all was deleted" if done.withdrawn else f"{done.new} new answers, {done.known} known"
        click.echo(f"{done.participant}: {told}")


@group.command()
@click.argument("folder", metavar="DIR")
@click.argument("participant", metavar="PARTICIPANT")
@option("--yes", is_flag=True, help="Do not ask.")
def withdraw(folder: str, participant: str, yes: bool) -> None:
    """Delete all that PARTICIPANT, such as p07, answered and said; it cannot be undone."""
    from ovita.study.answers import withdraw as delete
    from ovita.study.folder import open_study

    study = open_study(folder)
    person = study.participants.get(participant)
    if person is None:
        raise RequestError(f"the study has no participant {participant!r}; they are in {Path(folder) / 'links.csv'}")
    if not yes:
        click.confirm(f"Delete all that {participant} answered?", abort=True)
    delete(study, person)
    click.echo(f"{participant} has withdrawn; all was deleted. Make reports anew.")


@group.command()
@click.argument("source", metavar="DIR|RATINGS.csv")
@option("--out", "-o", metavar="FOLDER", help="Where the report goes. [DIR/report]")
@shown(
    "--attention",
    type=click.FloatRange(0, 1, max_open=True),
    default=0.5,
    metavar="SHARE",
    help="Leave out whoever passed this share of the attention checks, or less.",
)
@option("--title", metavar="TEXT", help="Title of the report. [the study's]")
@option("--no-figures", is_flag=True, help="Draw no figures.")
def report(source: str, out: str | None, attention: float, title: str | None, no_figures: bool) -> None:
    """Analyse the ratings of a study: tests with people as the unit, agreement, preferences, figures, an R script.

    DIR is a study's folder; a long CSV file of ratings from elsewhere will do, too (docs/study-analysis.md).
    """
    from ovita.study.analysis import analyse
    from ovita.study.report import ANALYSIS, PILOT, write_study_report

    place = Path(source)
    with waiting("analyses"):
        ratings, name = _ratings_of(place)
        found = analyse(ratings, attention=attention)
        folder = out or (place if place.is_dir() else place.parent) / "report"
        written = write_study_report(folder, title or name, found, figures=not no_figures)
    screened = found.screened
    people = len({r.participant for r in screened.kept})
    out_of_it = len(screened.ratings) - len(screened.kept)
    click.echo(f"{len(screened.kept)} answers of {people} people count, {out_of_it} are left out; why: {ANALYSIS}.")
    if found.pilot:
        click.echo(f"{PILOT}; every table and figure says so.")
    for s in found.summaries:
        if (s.question, s.phase, s.group) == ("correctness", "rate", "all"):
            span = f"{s.success.low:.0%} to {s.success.high:.0%}" if s.success.bounded else "one person"
            click.echo(f"  {s.condition}: {s.success.value:.0%} success ({span}), mean {s.mean.value:.2f}")
    click.echo("wrote " + ", ".join(str(path) for path in written))


@group.command()
@option(
    "--effect", type=click.FloatRange(0, min_open=True), metavar="DZ", help="Mean difference over its deviation. [0.5]"
)
@option("--difference", type=click.FloatRange(0, min_open=True), metavar="X", help="... or the mean difference,")
@option("--deviation", type=click.FloatRange(0, min_open=True), metavar="X", help="and its standard deviation.")
@shown("--power", type=click.FloatRange(0.05, 0.999), default=0.8, help="Chance to find it.")
@shown("--alpha", type=click.FloatRange(0.0001, 0.5), default=0.05, help="Level of the test.")
@shown("--comparisons", type=click.IntRange(1, 1000), default=1, help="Pairs tested (Holm).")
@shown("--dropout", type=click.FloatRange(0, 0.9), default=0.0, help="Share that is lost.")
@option("--people", type=click.IntRange(2, 2000), metavar="N", help="Also the power with so many people.")
def plan(power: float, alpha: float, comparisons: int, dropout: float, people: int | None, **sizes: Any) -> None:
    """Say how many people a comparison of two conditions takes, each person rating both."""
    from ovita.study.statistics import people_needed, signed_rank_power

    dz = _effect(**sizes)
    level = alpha / comparisons
    with waiting("simulates studies"):
        try:
            needed = people_needed(dz, power=power, alpha=level)
        except ValueError as error:
            raise RequestError(f"{error}; look for a larger effect") from None
        groups = {*range(max(2, needed - 10), needed + 11, 5), *([people] if people else [])}
        powers = [(n, signed_rank_power(n, dz, alpha=level)) for n in sorted(groups)]
    holm = f", {alpha:g} / {comparisons} for the strictest of {comparisons} by Holm" if comparisons > 1 else ""
    click.echo(f"Wilcoxon's signed-rank test on people's means, two-sided, level {level:.3g}{holm}; effect dz {dz:.3g}")
    click.echo(f"people needed for a power of {power:.0%}: {needed}")
    if dropout:
        click.echo(f"people to invite if {dropout:.0%} are lost: {math.ceil(needed / (1 - dropout))}")
    click.echo("people   power")
    for n, chance in powers:
        click.echo(f"{n:6d}   {chance:5.1%}" + ("   (yours)" if n == people else ""))
    click.echo("20,000 simulated studies each (standard error at most 0.4 %), normal differences, exact test.")


def _effect(effect: float | None, difference: float | None, deviation: float | None) -> float:
    if (difference is None) != (deviation is None):
        raise RequestError("--difference and --deviation belong together; give both, or --effect")
    if difference is None or deviation is None:
        return 0.5 if effect is None else effect
    if effect is not None:
        raise RequestError("--effect is --difference over --deviation; give either")
    return difference / deviation


def _ratings_of(source: Path) -> tuple[tuple[Rating, ...], str]:
    if not source.is_dir():
        from ovita.study.ratings import read_answers

        return read_answers(source), source.stem
    from ovita.study.answers import ratings
    from ovita.study.folder import open_study

    return ratings(source), open_study(source).design.title
