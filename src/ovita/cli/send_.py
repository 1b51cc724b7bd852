"""`ovita send`: the only way from a result to a robot."""

from __future__ import annotations

import os
import sys
from typing import Any

import click

from ovita.cli.convert_ import joints_of, only_for_ros
from ovita.cli.options import choices_from
from ovita.cli.report import plain, waiting
from ovita.errors import RequestError
from ovita.gate import Review, default_log, record, review
from ovita.io import is_address, load_robot, rendered
from ovita.io.links import Address, deliver, deliver_joints
from ovita.io.messages import TYPES, JointMotion
from ovita.measure import sentences
from ovita.paths.robot import Robot

EXIT_REFUSED = 4


@click.command()
@click.argument("file", metavar="RESULT.json")
@click.option("--to", "place", required=True, metavar="PLACE", help="ros2:/topic, mavlink:udp:HOST:PORT, or a file.")
@click.option("--robot", metavar="NAME|FILE", help="Whose limits to verify against. [the result's]")
@click.option("--home", metavar="LAT,LON,ALT", help="Home of a mission in degrees and metres. [the result's]")
@click.option(
    "--type", "kind", type=click.Choice([*TYPES, "joints"]), help="ROS message. [that of the source, else path]"
)
@click.option("--arm", metavar="NAME|FILE", help="Whose joints, with --type joints: iiwa, or a .toml file.")
@click.option("--base", metavar="X,Y,Z,YAW", help="Where that arm stands, in the scene's coordinates [m, rad].")
@click.option("--topic", metavar="NAME", help="Topic of a bag. [that of the source, else /path]")
@click.option("--frame-id", metavar="NAME", help="ROS frame. [that of the source, else map]")
@click.option("--yes", is_flag=True, help="Send without asking; refusals stay refusals.")
@click.option("--dry-run", is_flag=True, help="Only show what the gate finds.")
@click.option("--log", metavar="FILE", help="Where sendings are logged. [sent.jsonl in the user's state folder]")
def command(file: str, place: str, robot: str | None, log: str | None, **options: Any) -> None:
    """Verify RESULT.json, a result of `ovita adapt --out`, once more; show it, ask, send it, and log that.

    A result that is infeasible, unverified, edited or in collision is refused (exit code 4), with --yes too.

    PLACE: ros2:/topic[?domain=N&type=path|poses|multidof&local=1&timeout=S], mavlink:udp:HOST:PORT (listen; also
    udpout, tcp), or a file in any format that ovita convert writes.
    """
    in_joints = options["kind"] == "joints"
    choices = choices_from(options | {"kind": None if in_joints else options["kind"]})
    if is_address(place):
        Address.parse(place)
    only_for_ros(place, kind=options["kind"], topic=options["topic"], frame_id=options["frame_id"])
    found = review(file, robot=load_robot(robot) if robot else None)
    _show(found, place)
    journal = log or str(default_log())
    target = place if is_address(place) else os.path.abspath(place)
    event: dict[str, Any] = {"result": os.path.abspath(file), "result_sha256": found.sha256, "to": target}
    event["robot"] = found.robot.name
    if not found.released:
        record(journal, {"event": "refused", **event, "why": list(found.refusals)})
        raise SystemExit(EXIT_REFUSED)
    result = found.result
    motion: JointMotion | None = None
    if in_joints:
        arm, base = options["arm"], options["base"]
        try:
            motion, said = joints_of(result.adapted, result.scene, arm, base, found.robot, result.contacts)
        except RequestError as error:
            if arm is None or base is None:
                raise
            record(journal, {"event": "refused", **event, "why": [str(error)]})
            _section(f"Refused, it does not go to {place}", [str(error)])
            raise SystemExit(EXIT_REFUSED) from None
        _section(f"Simulated with {arm}", said)
    elif not is_address(place):
        rendered(place, result.adapted, result.scene, result.instruction, choices=choices)
    if options["dry_run"]:
        click.echo("\nIt may be sent; nothing was (--dry-run).")
        return
    if not options["yes"]:
        _confirm(place)
    event |= {"waypoints": len(result.adapted), "duration_s": round(result.adapted.duration, 3)}
    record(journal, {"event": "sending", **event})
    try:
        with waiting(f"sending to {place}"):
            if motion is not None:
                receipt = deliver_joints(place, motion, choices)
            else:
                receipt = deliver(
                    place,
                    result.adapted,
                    result.scene,
                    instruction=result.instruction,
                    choices=choices,
                    verdict=result.verdict,
                )
    except BaseException as error:
        record(journal, {"event": "failed", **event, "why": str(error) or type(error).__name__})
        raise
    record(journal, {"event": "sent", **event, "sha256": receipt.sha256, "bytes": receipt.size})
    for note in receipt.notes:
        click.echo(f"note: {plain(note)}", err=True)
    click.echo(plain(f"\nSent to {place}: {receipt.size} bytes, SHA-256 {receipt.sha256}; logged in {journal}"))


def _confirm(place: str) -> None:
    """Ask a person at a terminal.

    Raises:
        RequestError: If there is no terminal to ask on.
        Abort: If the answer is no.
    """
    if not sys.stdin.isatty():
        raise RequestError("there is no terminal to ask for confirmation; say --yes to send without asking")
    click.confirm(plain(f"\nSend it to {place}?"), abort=True)


def _show(found: Review, place: str) -> None:
    """Print limits, verdict, changes and what speaks against it."""
    result, path = found.result, found.result.adapted
    click.echo(plain(f"{result.instruction}"))
    click.echo(
        f"{len(path)} waypoints, {path.length:.3f} m in {path.duration:.2f} s, at most {path.speeds.max():.3g} m/s"
    )
    _section("Limits", _limits(found.robot))
    held = sum(check.held for check in found.checks)
    _section("Verdict", [f"Measured again just now: {held} of {len(found.checks)} limits hold."])
    _section("Changes, measured again", sentences(found.changes))
    _section("Mind", found.cautions)
    _section(f"Refused, it does not go to {place}", found.refusals)


def _limits(robot: Robot) -> list[str]:
    said = [f"robot {robot.name}"]
    if robot.workspace is not None:
        said.append(f"workspace: {robot.workspace.describe()}, {robot.margin:g} m from its border")
    said.append(f"body: {robot.radius:g} m radius" if robot.radius else "body: a point")
    said.append(f"objects: {robot.obstacle_margin:g} m from each, {robot.person_margin:g} m from people")
    said.append("speed: " + ("no limit" if robot.max_speed is None else f"at most {robot.max_speed:g} m/s"))
    for name, limit in (("along", robot.max_acceleration), ("across", robot.max_lateral_acceleration)):
        said.append(f"acceleration {name} the path: " + ("no limit" if limit is None else f"at most {limit:g} m/s^2"))
    return said


def _section(title: str, lines: Any) -> None:
    if lines:
        click.echo(f"\n{plain(title)}")
        for line in lines:
            click.echo(plain(f"  {line}"))
