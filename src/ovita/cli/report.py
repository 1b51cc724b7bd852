"""What the terminal shows: results as short reports, and progress on anything that takes longer than a second."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import click

from ovita.measure import sentences
from ovita.result import Adaptation, Status
from ovita.writers.explain import knob
from ovita.writers.progress import Progress

EXIT_OF: dict[Status, int] = {
    "done": 0,
    "limited": 5,
    "not_as_meant": 6,
    "infeasible": 4,
    "needs_clarification": 3,
    "not_understood": 3,
    "failed": 3,
}

LABELS: dict[Status, str] = {
    "done": "done",
    "limited": "done, but changed by the limits",
    "not_as_meant": "not as meant",
    "infeasible": "infeasible",
    "needs_clarification": "not done: a question",
    "not_understood": "not done: not understood",
    "failed": "not done: failed",
}
"""The verdict in words."""

_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def plain(text: str) -> str:
    """Text that is safe on a terminal: without control characters."""
    return _CONTROL.sub("", text)


def show(result: Adaptation, *, code: bool = False) -> None:
    """Print an adaptation as a short report."""
    total = sum(result.timings_ms.values())
    label = LABELS[result.status]
    if result.lost and result.status == "done":
        label = "done, but not all that was asked before"
    by = f"{result.writer.kind}{':' + result.writer.model if result.writer.model else ''}"
    click.echo(plain(f"{result.message}  [{label}; writer {by}; {total:.0f} ms]"))
    if len(result.writer.tried) > 1:
        _section("Writers", [*result.writer.tried, *([result.writer.reason] if result.writer.reason else [])])
    if not result.usable:
        return
    _section("Plan", [f"{i}. {step}" for i, step in enumerate(result.plan, start=1)])
    _section("Changes", sentences(result.changes) if result.changes else [])
    if result.constraints and result.constraints.status == "satisfied":
        _section("Limits", result.constraints.sentences())
    _section("Assumed", result.assumed)
    _section("Knobs", [knob(p) for p in result.parameters])
    _section("Warnings", result.cautions)
    if code:
        click.echo("\nPolicy")
        click.echo(plain(result.code))


def _section(title: str, lines: Sequence[str]) -> None:
    if lines:
        click.echo(f"\n{title}")
        for line in lines:
            click.echo(plain(f"  {line}"))


@contextmanager
def waiting(what: str, *, quiet: bool = False) -> Iterator[Progress]:
    """Show a spinner on standard error while the block runs, if that is a terminal.

    Yields:
        A function that puts another text next to the spinner; any thread may call it.
    """
    if quiet or not sys.stderr.isatty():
        yield lambda text: None
        return
    from rich.console import Console
    from rich.text import Text

    with Console(stderr=True).status(Text(what)) as status:
        yield lambda text: status.update(Text(text))
