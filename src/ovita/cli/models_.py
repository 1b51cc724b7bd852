"""`ovita models` and `ovita plugins`: what can be added, language models that run here and other packages."""

from __future__ import annotations

import time

import click
from click import option

import ovita.plugins as plugin
from ovita.cli.common import plain, say, shown
from ovita.cli.main import EXIT_INPUT, GuessingGroup
from ovita.errors import OvitaError
from ovita.writers.base import MODEL_VARIABLE
from ovita.writers.models import catalogue as models

TEST_INSTRUCTION = "Go left by 0.15 and move at half the speed near the cup"
"""What `ovita models test` asks of a model, on the shipped table-top scene."""


@click.group(cls=GuessingGroup)
def group() -> None:
    """Small language models that run on this machine, as writers: --writer llamacpp:NAME."""


@group.command("list")
def list_() -> None:
    """List the models that are known and those that are here."""
    here, default = models.present(), models.default_model()
    for known in models.KNOWN:
        state = "-" if known.name not in here else "checked" if models.checksum(known.file) else "here"
        click.echo(f"{known.name:20} {known.size / 1e9:4.1f} GB  {known.licence:10}  {state:7}  {known.about}")
    for name, path in here.items():
        if all(known.name != name for known in models.KNOWN):
            click.echo(f"{name:20} {path.stat().st_size / 1e9:4.1f} GB  {'':10}  here     {path}")
    click.echo(f"\nFolder: {models.models_dir()} (set {models.DIR_VARIABLE} for another)")
    if default:
        click.echo(f"--writer auto falls back on {default}, unless {MODEL_VARIABLE} names another.")
    elif here:
        click.echo("To run them: pip install 'ovita[local]'")
    else:
        click.echo(f"None is here; fetch one with: ovita models pull {models.KNOWN[0].name}")


@group.command()
@click.argument("name")
def pull(name: str) -> None:
    """Fetch the model NAME from its hub.

    A broken download goes on where it stopped.
    """
    known = models.known_named(name)
    target = models.models_dir() / known.file
    if target.is_file():
        click.echo(f"{name} is here already: {target}")
        return
    click.echo(f"{name}: {known.size / 1e9:.1f} GB, {known.licence}, from {known.url}", err=True)
    target, found = models.pull(name)
    click.echo(f"{target}\nsha256 {found}, as expected. Try it: ovita models test {name}")


@group.command()
@click.argument("name")
@click.argument("file")
def add(name: str, file: str) -> None:
    """Give the GGUF file FILE, which stays where it is, the name NAME."""
    path = models.add(name, file)
    click.echo(f"{name} is {path}. Try it: ovita models test {name}")


@group.command()
@click.argument("name")
@shown("--time-limit", type=float, default=300.0, metavar="SECONDS", help="For writing.")
@option("--threads", type=click.IntRange(1), help="Processor cores to use. [llama.cpp's choice]")
def test(name: str, time_limit: float, threads: int | None) -> None:
    """Try the model NAME on a shipped scene.

    NAME may also be a file that ends in .gguf. Says what the model wrote and how long it took.
    """
    from ovita.chain import adapt
    from ovita.cli.common import EXIT_OF, shipped_task, waiting
    from ovita.request import Request
    from ovita.writers.models.local import LocalWriter

    writer = LocalWriter(name, temperature=0.0, threads=threads)
    task = shipped_task()
    started = time.monotonic()
    with waiting(f"{name} is loading") as tell:
        request = Request(TEST_INSTRUCTION, task.trajectory, task.scene)
        result = adapt(request, writer=writer, time_limit=time_limit, progress=tell)
    click.echo(f"{TEST_INSTRUCTION}\n")
    if result.code:
        click.echo(plain(result.code.rstrip()) + "\n")
    click.echo(f"policy    {'ran' if result.usable else 'did not run'}: {plain(result.message)}")
    click.echo(f"answers   {result.attempts}")
    spent = time.monotonic() - started
    click.echo(f"time      {spent:.1f} s in all, {writer.ready_seconds:.1f} s of it to get ready")
    last = writer.last
    if last is not None:
        tokens = f"{last.input_tokens} tokens, {last.cached_tokens} of them known"
        click.echo(f"reading   {tokens}, {last.read_seconds:.1f} s")
        rate = last.output_tokens / last.write_seconds if last.write_seconds else 0.0
        click.echo(f"writing   {last.output_tokens} tokens, {last.write_seconds:.1f} s, {rate:.1f} tokens/s")
    raise SystemExit(EXIT_OF[result.status])


@click.command()
def plugins() -> None:
    """List what other packages add to ovita, and import each of it; exit code 2 if one fails.

    A plug-in is a package with entry points such as ovita.writers; docs/plugins.md has a whole one.
    """
    found = [(kind, name) for kind in plugin.KINDS for name in plugin.entries(kind)]
    if not found:
        click.echo(f"No installed package adds {', '.join(plugin.KINDS[:-1])} or {plugin.KINDS[-1]}.")
    failed = [_state(kind, name) for kind, name in found]
    if any(failed):
        raise SystemExit(EXIT_INPUT)


def _state(kind: str, name: str) -> bool:
    """Print one line about an entry point; whether it fails."""
    entry, problem = plugin.entries(kind)[name], ""
    try:
        plugin.load(kind, name)
    except OvitaError as error:
        problem = str(error)
    said = problem or f"from {plugin.origin(entry)} ({entry.value})"
    say(f"{kind:11} {entry.name:14} {said}")
    return bool(problem)
