"""`ovita ros`: what is on ROS 2's bus, with or without a ROS installation."""

from __future__ import annotations

import json
from typing import Any

import click
from click import option

from ovita.cli.common import BASE_URL, ISOLATION, WRITER, say, shown, together, writer_from
from ovita.io import load_robot, load_scene
from ovita.io.links import Address

on_bus = together(
    option("--domain", type=click.IntRange(0, 232), help="The DDS domain. [ROS_DOMAIN_ID, else 0]"),
    option("--local", is_flag=True, help="Stay on this machine."),
)
"""The options that say which bus is meant."""


def address_of(topic: str, domain: int | None, local: bool, **more: float) -> Address:
    """The address of a topic on the bus that is meant."""
    options = {key: f"{value:g}" for key, value in more.items()}
    options |= {} if domain is None else {"domain": str(domain)}
    options |= {"local": "1"} if local else {}
    return Address("ros2", topic if topic.startswith("/") else f"/{topic}", options)


@click.group()
def group() -> None:
    """Look at ROS 2's topics, and serve them: through rclpy where ROS 2 is set up, else without ROS ([ros])."""


@group.command("list")
@shown("--wait", type=click.FloatRange(0.1, 60), default=2.0, help="How long to look [s].")
@option("--json", "as_json", is_flag=True, help="As JSON.")
@on_bus
def list_(wait: float, as_json: bool, domain: int | None, local: bool) -> None:
    """List the topics that others publish or hear, with types, numbers and quality of service."""
    from ovita.io.ros2 import topics

    rows = topics(address_of("/all", domain, local, timeout=wait))
    if as_json:
        click.echo(json.dumps([vars(row) for row in rows]))
        return
    if not rows:
        click.echo(f"no topics within {wait:g} s; is it the right domain (--domain, ROS_DOMAIN_ID)?")
    for row in rows:
        offered = f", {row.offered}" if row.publishers else ""
        counts = f"{row.publishers} publish{offered}; {row.subscribers} subscribe"
        say(f"{row.topic}  {', '.join(row.types)}  ({counts})")


@group.command()
@click.argument("topic")
@shown("--count", type=click.IntRange(1), default=1, help="How many messages.")
@shown("--timeout", type=click.FloatRange(0.1), default=10.0, help="For each of them [s].")
@on_bus
def echo(topic: str, count: int, timeout: float, domain: int | None, local: bool) -> None:
    """Print messages on TOPIC as JSON, one a line, whatever quality of service it is published with."""
    from ovita.io.ros2 import echoed

    for message in echoed(address_of(topic, domain, local, timeout=timeout), count):
        say(json.dumps(message))


@group.command()
@shown("--name", default="ovita", help="Of the node; its topics are below it.")
@option("--scene", "scene_file", metavar="FILE", help="Scene file with the objects. [none]")
@shown("--robot", default="none", metavar="NAME|FILE", help="Whose limits hold.")
@WRITER
@BASE_URL
@ISOLATION
@on_bus
def serve(
    name: str, scene_file: str | None, robot: str, isolation: Any, domain: int | None, local: bool, **options: Any
) -> None:
    """Adapt paths as a node: /NAME/path and /NAME/instruction in, /NAME/adapted and /NAME/status out.

    With --robot only what the gate releases is published as adapted. A reading that needs confirmation is offered in
    the status, and taken when the next instruction says yes. docs/howto.md shows a node that asks.
    """
    from ovita.serve.ros import PathNode, serve

    scene = load_scene(scene_file) if scene_file else None
    node = PathNode(scene, load_robot(robot), writer_from(options), isolation)
    serve(address_of(name, domain, local), node, lambda text: click.echo(f"{text}; Ctrl-C ends it"))
