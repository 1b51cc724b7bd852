"""`ovita plugins`: what other packages add, and whether it can be used."""

from __future__ import annotations

import click

import ovita.plugins as plugins
from ovita.cli.common import plain
from ovita.errors import OvitaError

EXIT_INPUT = 2


@click.command()
def command() -> None:
    """List what other packages add to ovita, and import each of it; exit code 2 if one fails.

    A plug-in is a package with entry points such as ovita.writers; docs/plugins.md has a whole one.
    """
    found = [(kind, name) for kind in plugins.KINDS for name in plugins.entries(kind)]
    if not found:
        click.echo(f"No installed package adds {', '.join(plugins.KINDS[:-1])} or {plugins.KINDS[-1]}.")
    failed = [_state(kind, name) for kind, name in found]
    if any(failed):
        raise SystemExit(EXIT_INPUT)


def _state(kind: str, name: str) -> bool:
    """Print one line about an entry point; whether it fails."""
    entry, problem = plugins.entries(kind)[name], ""
    try:
        plugins.load(kind, name)
    except OvitaError as error:
        problem = str(error)
    said = problem or f"from {plugins.origin(entry)} ({entry.value})"
    click.echo(plain(f"{kind:11} {entry.name:14} {said}"))
    return bool(problem)
