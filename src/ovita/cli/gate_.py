"""`ovita gate`: the log of what was sent, and signed results."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

import click

from ovita.cli.common import plain, section
from ovita.errors import RequestError
from ovita.gate import default_log, review
from ovita.io.json_ import load_document, save_document
from ovita.io.ledger import PREVIOUS, Ledger
from ovita.io.signatures import SIGNATURE, TRUSTED, make_keys, signed

EXIT_BROKEN = 4


@click.group()
def group() -> None:
    """What the gate of `ovita send` keeps."""


@group.command()
@click.option("--log", metavar="FILE", help="The log. [sent.jsonl in the user's state folder]")
@click.option("--last", type=click.IntRange(min=1), default=10, show_default=True, help="How many events are shown.")
@click.option("--verify", is_flag=True, help="Look for lines that were changed, removed or inserted.")
@click.option("--json", "as_json", is_flag=True, help="Print the events as JSON, one a line.")
def log(log: str | None, last: int, verify: bool, as_json: bool) -> None:
    """Show what was sent and refused; with --verify, whether the log is whole (exit code 4 if not)."""
    if verify and as_json:
        raise RequestError("--json shows events and --verify looks for faults: choose one")
    ledger = Ledger(log or default_log())
    if not verify:
        for event in ledger.events()[-last:]:
            shown = {key: value for key, value in event.items() if key != PREVIOUS}
            click.echo(plain(json.dumps(shown, ensure_ascii=False) if as_json else _in_words(shown)))
        return
    found = ledger.check()
    earlier = found.lines - found.chained
    for fault in found.faults:
        click.echo(plain(f"{ledger.path}: {fault}"))
    if earlier:
        click.echo(f"{earlier} lines at the beginning are from an earlier version and bear no hashes")
    if found.faults:
        raise SystemExit(EXIT_BROKEN)
    click.echo(plain(f"{ledger.path}: {found.chained} lines, whole; the last one's SHA-256 is {found.head}"))


def _in_words(event: Mapping[str, Any]) -> str:
    """An event of the log as a line for a person."""
    moment, _, rest = str(event.get("time", "")).partition("T")
    what = os.path.basename(str(event.get("result") or event.get("task") or "?"))
    place = str(event.get("to", "?"))
    size = [f"robot {event['robot']}"] if "robot" in event else []
    size += [f"{event['waypoints']} waypoints", f"{event['duration_s']} s"] if "waypoints" in event else []
    size += [f"{event['bytes']} bytes", f"SHA-256 {str(event.get('sha256'))[:12]}..."] if "bytes" in event else []
    why = event.get("why", ())
    said = " ".join(map(str, why)) if isinstance(why, list | tuple) else str(why)
    about = f" ({', '.join(size)})" if size else ""
    line = f"{moment} {rest[:8]}  {event.get('event', '?')!s:8} {what} -> {place}{about}"
    return " ".join((f"{line}: {said}" if said else line).split("\n"))


@group.command()
@click.argument("name", metavar="NAME")
def key(name: str) -> None:
    """Make a key pair: NAME.key, which signs and stays with you, and NAME.pub, which the gate verifies with."""
    secret, public = make_keys(name)
    click.echo(plain(f"wrote {secret} (keep it to yourself) and {public} (for --trust, or {TRUSTED})"))


@group.command()
@click.argument("file", metavar="RESULT.json")
@click.option("--key", "key_file", required=True, metavar="FILE", help="The private key: NAME.key of ovita gate key.")
def sign(file: str, key_file: str) -> None:
    """Sign RESULT.json, a result that the gate lets through (exit code 4 if it does not)."""
    found = review(file, trusted=())
    if not found.released:
        section("Refused, it is not signed", found.refusals)
        raise SystemExit(EXIT_BROKEN)
    document = signed(load_document(file), key_file)
    save_document(file, document)
    click.echo(plain(f"signed {file} with the key {document[SIGNATURE]['signer']}"))
