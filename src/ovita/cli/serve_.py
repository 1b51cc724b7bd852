"""`ovita serve`: the tools for agents and other programs, over MCP and REST."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import click
from click import option

from ovita.cli.common import BASE_URL, ISOLATION, WRITER, shown, together, writer_from
from ovita.errors import RequestError
from ovita.io import is_address, load_robot
from ovita.paths.robot import PRESETS, Robot
from ovita.policy.sandbox import known_isolation
from ovita.serve import protocol
from ovita.serve.access import AccessRules, AuditLog, BearerTokens, HostNames, default_folder
from ovita.serve.application import Application

_FOLDER = click.Path(exists=True, file_okay=False, path_type=Path)
_DEFAULTS = AccessRules()
ruled = together(
    option("--folder", "folders", type=_FOLDER, multiple=True, help="Files below it may be read. [none]"),
    option("--save-to", "outputs", type=_FOLDER, multiple=True, help="New files may be saved below it. [none]"),
    option("--robot", "robots", metavar="NAME|FILE", multiple=True, help="A robot that may be chosen. [presets]"),
    option(
        "--allow-send",
        "places",
        metavar="PLACE",
        multiple=True,
        help="Exactly where results may be sent once a person agrees, such as ros2:/plan. [nowhere]",
    ),
    shown("--max-waypoints", "waypoints", type=click.IntRange(2), default=_DEFAULTS.waypoints),
    shown("--max-tasks", "tasks", type=click.IntRange(1), default=_DEFAULTS.tasks, help="Of an owner."),
    shown(
        "--idle-minutes",
        type=click.FloatRange(0.01),
        default=_DEFAULTS.idle / 60.0,
        help="Until an unused task is closed.",
    ),
    shown(
        "--max-request", "request_bytes", type=click.IntRange(1_000), default=_DEFAULTS.request_bytes, metavar="BYTES"
    ),
    shown("--rate", type=click.IntRange(1), default=_DEFAULTS.rate, help="Calls in a minute."),
    option("--sessions", type=click.Path(path_type=Path), help="Where tasks are kept. [the user's state folder]"),
    option("--audit", type=click.Path(path_type=Path), help="The audit log. [audit.jsonl beside the tasks]"),
    option("--sent-log", metavar="FILE", help="Where sendings are logged. [sent.jsonl in the state folder]"),
    WRITER,
    BASE_URL,
    ISOLATION,
)
"""The options that say what clients may reach."""


def _application(given: dict[str, Any]) -> Application:
    protocol.require()
    for place in given["places"]:
        if not is_address(place) and not Path(place).is_absolute():
            raise RequestError(f"--allow-send {place}: name an address such as ros2:/plan, or a whole path of a file")
    below: dict[str, Any] = {name: tuple(folder.resolve() for folder in given[name]) for name in ("folders", "outputs")}
    as_said = {name: given[name] for name in ("places", "waypoints", "tasks", "request_bytes", "rate")}
    rules = AccessRules(**below, **as_said, robots=_robots(given["robots"]), idle=given["idle_minutes"] * 60.0)
    folder = given["sessions"] or default_folder() / "tasks"
    audit = AuditLog(given["audit"] or folder.parent / "audit.jsonl")
    isolation = known_isolation(given["isolation"])
    return Application(rules, folder, audit, writer_from(given), isolation, given["sent_log"])


def _robots(names: tuple[str, ...]) -> dict[str, Robot]:
    """The robots that may be chosen, by the names that clients say."""
    if not names:
        return dict(PRESETS)
    return {(Path(name).stem if name.endswith((".toml", ".json")) else name): load_robot(name) for name in names}


@click.group()
def group() -> None:
    """Let agents and other programs adapt trajectories: MCP and REST, within rules that you set.

    Clients may open nothing but JSON that they bring until --folder names a folder, save nothing until --save-to does,
    and send nothing until --allow-send names a place; then a person is asked each time. See docs/agents.md.
    """


@group.command()
@ruled
def mcp(**given: Any) -> None:
    """Serve one MCP client over standard input and output; MCP clients start this themselves."""
    application = _application(given)
    if sys.stdin.isatty():
        click.echo(
            "This waits for an MCP client on standard input; docs/agents.md shows how clients start it.", err=True
        )
    import anyio

    anyio.run(protocol.ToolServer(application).stdio)


@group.command()
@shown("--host", default="127.0.0.1", help="Address to listen on.")
@shown("--port", type=click.IntRange(0, 65535), default=8766, help="0 takes any free one.")
@option(
    "--token",
    "tokens",
    multiple=True,
    envvar="OVITA_SERVE_TOKEN",
    metavar="[OWNER=]TEXT",
    help="What a client must bring; again for more owners. 'auto' makes one and prints it once. [auto]",
)
@option("--name", "names", multiple=True, metavar="HOST", help="A further host name that clients call it by.")
@ruled
def http(host: str, port: int, tokens: tuple[str, ...], names: tuple[str, ...], **given: Any) -> None:
    """Serve many clients over HTTP: MCP under /mcp, REST under /v1, and a page that describes it under /."""
    application = _application(given)
    from ovita.serve import web

    known, made = BearerTokens.parse(tokens)
    hosts = HostNames(frozenset({"127.0.0.1", "localhost", "[::1]", host.lower(), *(name.lower() for name in names)}))
    listener = web.listening(host, port)
    shown = f"[{host}]" if ":" in host else host
    click.echo(f"ovita serves MCP and REST at http://{shown}:{listener.getsockname()[1]} (MCP: /mcp, REST: /v1)")
    for owner, token in made.items():
        click.echo(f"Token of {owner}, shown only now: {token}")
    click.echo("Ctrl-C ends it; open tasks are kept and go on when it starts again.")
    web.serve(web.web_application(application, known, hosts), listener)
