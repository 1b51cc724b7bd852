"""`ovita study report` and `ovita study plan`: what a study's answers amount to, and how many people it takes."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ovita.cli.common import waiting
from ovita.errors import RequestError

if TYPE_CHECKING:
    from ovita.study.ratings import Rating


@click.command()
@click.argument("source", metavar="DIR|RATINGS.csv")
@click.option("--out", "-o", metavar="FOLDER", help="Where the report goes. [DIR/report]")
@click.option(
    "--attention",
    type=click.FloatRange(0, 1, max_open=True),
    default=0.5,
    show_default=True,
    metavar="SHARE",
    help="Leave out whoever passed this share of the attention checks, or less.",
)
@click.option("--title", metavar="TEXT", help="Title of the report. [the study's]")
@click.option("--no-figures", is_flag=True, help="Draw no figures.")
def report(source: str, out: str | None, attention: float, title: str | None, no_figures: bool) -> None:
    """Analyse the ratings of a study: tests with people as the unit, agreement, preferences, figures, an R script.

    DIR is a study's folder; a long CSV file of ratings from elsewhere will do, too (docs/study-analysis.md).
    """
    from ovita.study.analysis import analyse
    from ovita.study.report import ANALYSIS, PILOT, write_study_report

    place = Path(source)
    with waiting("analyses"):
        ratings, name = _study(place)
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
            span = f"{s.success.low:.0%} to {s.success.high:.0%}" if math.isfinite(s.success.low) else "one person"
            click.echo(f"  {s.condition}: {s.success.value:.0%} success ({span}), mean {s.mean.value:.2f}")
    click.echo("wrote " + ", ".join(str(path) for path in written))


@click.command()
@click.option(
    "--effect", type=click.FloatRange(0, min_open=True), metavar="DZ", help="Mean difference over its deviation. [0.5]"
)
@click.option("--difference", type=click.FloatRange(0, min_open=True), metavar="X", help="... or the mean difference,")
@click.option("--deviation", type=click.FloatRange(0, min_open=True), metavar="X", help="and its standard deviation.")
@click.option("--power", type=click.FloatRange(0.05, 0.999), default=0.8, show_default=True, help="Chance to find it.")
@click.option("--alpha", type=click.FloatRange(0.0001, 0.5), default=0.05, show_default=True, help="Level of the test.")
@click.option("--comparisons", type=click.IntRange(1, 1000), default=1, show_default=True, help="Pairs tested (Holm).")
@click.option("--dropout", type=click.FloatRange(0, 0.9), default=0.0, show_default=True, help="Share that is lost.")
@click.option("--people", type=click.IntRange(2, 2000), metavar="N", help="Also the power with so many people.")
def plan(
    effect: float | None,
    difference: float | None,
    deviation: float | None,
    power: float,
    alpha: float,
    comparisons: int,
    dropout: float,
    people: int | None,
) -> None:
    """Say how many people a comparison of two conditions takes, each person rating both."""
    from ovita.study.statistics import people_needed, signed_rank_power

    dz = _effect(effect, difference, deviation)
    level = alpha / comparisons
    with waiting("simulates studies"):
        try:
            needed = people_needed(dz, power=power, alpha=level)
        except ValueError as error:
            raise RequestError(f"{error}; look for a larger effect") from None
        sizes = sorted({*range(max(2, needed - 10), needed + 11, 5), *([people] if people else [])})
        powers = [signed_rank_power(n, dz, alpha=level) for n in sizes]
    holm = f", {alpha:g} / {comparisons} for the strictest of {comparisons} by Holm" if comparisons > 1 else ""
    click.echo(f"Wilcoxon's signed-rank test on people's means, two-sided, level {level:.3g}{holm}; effect dz {dz:.3g}")
    click.echo(f"people needed for a power of {power:.0%}: {needed}")
    if dropout:
        click.echo(f"people to invite if {dropout:.0%} are lost: {math.ceil(needed / (1 - dropout))}")
    click.echo("people   power")
    for n, chance in zip(sizes, powers, strict=True):
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


def _study(source: Path) -> tuple[tuple[Rating, ...], str]:
    """The ratings of a study's folder or a file, and a title."""
    if not source.is_dir():
        from ovita.study.ratings import read_answers

        return read_answers(source), source.stem
    from ovita.study.answers import ratings
    from ovita.study.folder import open_study

    return ratings(source), open_study(source).design.title
