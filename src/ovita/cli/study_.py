"""`ovita study`: a user study of adapted trajectories, from bench runs to answers on disk."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ovita.cli.main import GuessingGroup
from ovita.cli.study_analysis_ import plan, report


@click.group(cls=GuessingGroup)
def group() -> None:
    """Let people judge adapted trajectories, blinded and in balanced order.

    Write a STUDY.toml and a consent text (docs/study.md has both), then
    `ovita study new STUDY.toml --runs BENCH-RUN --out DIR` and `ovita study serve DIR`. `ovita study plan` says
    how many people it takes, `ovita study report DIR` what their answers amount to.
    """


group.add_command(plan)
group.add_command(report)


@group.command()
@click.argument("file", metavar="STUDY.toml")
@click.argument("more_runs", metavar="[RUN]...", nargs=-1)
@click.option("--runs", multiple=True, required=True, metavar="RUN", help="Folders that `ovita bench run` wrote.")
@click.option("--per-person", type=int, metavar="N", help="Ratings a person gives. [the file's, else 24]")
@click.option("--participants", type=int, metavar="N", help="How many links are made. [the file's, else 30]")
@click.option("--seed", type=int, metavar="N", help="Decides every order and letter. [the file's, else 0]")
@click.option("--pilot", is_flag=True, default=None, help="A trial, watermarked, whose data are not for analysis.")
@click.option("--out", "-o", required=True, metavar="DIR", help="The study's folder, which must not exist yet.")
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
@click.option("--port", type=click.IntRange(0, 65535), default=8770, show_default=True, help="0 for any that is free.")
@click.option("--host", default="127.0.0.1", show_default=True, help="0.0.0.0 lets other machines in.")
@click.option("--static", "files", metavar="FOLDER", help="Instead write one file a person, for use without a server.")
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
@click.option("--yes", is_flag=True, help="Do not ask.")
def withdraw(folder: str, participant: str, yes: bool) -> None:
    """Delete all that PARTICIPANT, such as p07, answered and said; it cannot be undone."""
    from ovita.errors import RequestError
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
