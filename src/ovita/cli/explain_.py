"""`ovita explain`: a result in plain words."""

from __future__ import annotations

import click

from ovita.cli.report import plain
from ovita.result import Adaptation


@click.command()
@click.argument("file", metavar="RESULT.json")
@click.option("--code", is_flag=True, help="Also print the policy.")
def command(file: str, code: bool) -> None:
    """Explain RESULT.json, a result of `ovita adapt --out`, in plain words."""
    result = Adaptation.load(file)
    click.echo(plain(result.explanation or result.message))
    if code and result.code:
        click.echo("\n" + plain(result.code))
