"""`ovita convert`, `ovita send`, `ovita gate`: trajectories to another format, results through the gate to a robot."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import click
from click import option

from ovita.cli import common
from ovita.cli.common import shown
from ovita.cli.joints_ import ArmChoice, arm_options, joints_of, still_there, tool_task
from ovita.errors import FormatError, RequestError
from ovita.gate import Review, against, default_log, refuse, release, review, simulated
from ovita.io import READ, Choices, Task, is_adaptation, is_address, is_mission, load_robot, rendered, save_task
from ovita.io.bags import save_joint_motion
from ovita.io.geodesy import MISSION
from ovita.io.json_ import load_document, save_document
from ovita.io.ledger import PREVIOUS, Ledger
from ovita.io.links import Address
from ovita.io.messages import TYPES, JointMotion
from ovita.io.mission_checks import flight_of
from ovita.io.signatures import SIGNATURE, TRUSTED, make_keys, signed
from ovita.paths.robot import PRESETS, Robot, preset_name
from ovita.paths.scene import Frame, Scene, transformed

_ENDINGS = f"Formats by ending: {', '.join(READ)} (ROS 1); NAME/ is the folder of a ROS 2 bag."


_TAKEOFF = option("--takeoff", is_flag=True, help="Begin a mission that has no takeoff with one.")


@click.command(epilog=_ENDINGS)
@click.argument("file", metavar="IN")
@click.argument("out", metavar="OUT")
@common.source
@option("--to-frame", type=common.FRAMES, help="Axes of OUT (.json, .csv, .tum). [those of IN]")
@option("--type", "kind", type=click.Choice([*TYPES, "joints"]), help="ROS message of OUT. [that of IN, else path]")
@option("--to-topic", metavar="NAME", help="Topic of OUT. [that of IN, else /path]")
@option("--frame-id", metavar="NAME", help="ROS frame of OUT. [that of IN, else map]")
@arm_options
@_TAKEOFF
def convert(file: str, out: str, to_frame: str | None, to_topic: str | None, kind: str | None, **options: Any) -> None:
    """Convert the trajectory in IN to the format of OUT's file extension; notes say what it cannot hold.

    IN may also be live: ros2:/topic?domain=0 or mavlink:udp:127.0.0.1:14550.
    """
    if is_address(out):
        raise RequestError(f"{out}: nothing is sent to a robot unverified; use ovita send RESULT.json --to {out}")
    only_for_ros(out, kind=kind, to_topic=to_topic, frame_id=options["frame_id"])
    arm = ArmChoice.taken(options)
    if to_frame is not None and not out.lower().endswith((".json", ".csv", ".tum", ".txt")):
        raise RequestError(f"--to-frame {to_frame}: {out} has axes of its own; only JSON, CSV and TUM can be turned")
    choices = common.choices_from(options | {"kind": kind})
    in_joints = kind == "joints"
    of_a_tip = arm.arm is not None and not in_joints
    task = (
        tool_task(file, arm, choices, options["frame"]) if of_a_tip else common.task_at(file, options | {"kind": kind})
    )
    if in_joints:
        motion, said = joints_of(task.trajectory, task.scene, arm)
        save_joint_motion(out, motion, replace(choices, topic=to_topic))
        common.show_notes((*task.notes, *said))
        common.say(f"wrote {out}: {len(motion.times)} points of the joints {', '.join(motion.names)}")
        return
    if to_frame is not None:
        target = Frame(to_frame)
        moved = transformed(task.trajectory, task.scene.frame, target)
        task = replace(task, trajectory=moved, scene=task.scene.in_frame(target))
    _only_for_drones(out, task.scene, choices)
    lost = save_task(out, task, replace(choices, topic=to_topic))
    common.show_notes((*task.notes, *lost, *_refusable(file, task, out, choices)))
    path, frame = task.trajectory, task.scene.frame
    flown = flight_of(path, task.scene, choices)[0] if is_mission(out, task.scene) else path
    # A bag or a mission has axes of its own, which a note has told.
    axes = f", frame {frame.name} ({frame.describe()})" if out.lower().endswith((".json", ".csv", ".tum")) else ""
    common.say(f"wrote {out}: {len(path)} waypoints, {path.length:.3f} m in {flown.duration:.3f} s{axes}")


def _only_for_drones(place: str, scene: Scene, choices: Choices) -> None:
    """Refuse a heading for a place that has no north."""
    has_north = place.startswith("mavlink:") or is_mission(place, scene) or MISSION in scene.extra
    if choices.heading is not None and not has_north:
        raise RequestError(f"--heading is about missions and setpoints, and {place} is neither")


def only_for_ros(place: str, **options: str | None) -> None:
    """Refuse options on ROS messages for a place that takes none."""
    if place.startswith("ros2:") or place.lower().endswith((".mcap", ".db3", ".bag", "/")):
        return
    for name, value in options.items():
        if value is not None:
            flag = "type" if name == "kind" else name.replace("_", "-")
            raise RequestError(f"--{flag} {value} is about ROS messages, and {place} is no ROS 2 topic or bag")


def _refusable(file: str, task: Task, out: str, choices: Choices) -> list[str]:
    """What the gate would say: of a result all, of another file as far as it names the robot to judge it by."""
    if file.lower().endswith(".json") and is_adaptation(file):
        try:
            found = list(review(file, place=out, choices=choices).refusals)
        except FormatError as error:
            found = [f"{error}."]
    else:
        known = task.robot is not None and preset_name(task.robot) in PRESETS
        robot = Robot.preset(task.robot) if known and task.robot else None
        found = against(task.trajectory, task.scene, robot, out, choices)
    return [f"ovita send would refuse it: {' '.join(found)}"] if found else []


@click.command()
@click.argument("file", metavar="RESULT.json")
@option("--to", "place", required=True, metavar="PLACE", help="ros2:/topic, mavlink:udp:HOST:PORT, or a file.")
@option("--robot", metavar="NAME|FILE", help="Whose limits to verify against. [the result's]")
@option("--home", metavar="LAT,LON,ALT", help="Home of a mission in degrees and metres. [the result's]")
@common.HEADING
@option("--type", "kind", type=click.Choice([*TYPES, "joints"]), help="ROS message. [that of the source, else path]")
@arm_options
@option("--topic", metavar="NAME", help="Topic of a bag. [that of the source, else /path]")
@option("--frame-id", metavar="NAME", help="ROS frame. [that of the source, else map]")
@_TAKEOFF
@option("--yes", is_flag=True, help="Send without asking; refusals stay refusals.")
@option("--dry-run", is_flag=True, help="Only show what the gate finds.")
@option("--trust", multiple=True, metavar="FILE", help="Public key that must have signed it, or one of several.")
@option("--simulate", is_flag=True, help="Let the robot follow it in simulation first; refuse what it cannot.")
@option("--log", metavar="FILE", help="Where sendings are logged. [sent.jsonl in the user's state folder]")
def send(
    file: str, place: str, robot: str | None, log: str | None, trust: tuple[str, ...], simulate: bool, **options: Any
) -> None:
    """Verify RESULT.json, a result of `ovita adapt --out`, once more; show it, ask, send it, and log that.

    A result that is infeasible, unverified, edited or in collision is refused (exit code 4), with --yes too.

    PLACE: ros2:/topic[?domain=N&type=path|poses|multidof&local=1&timeout=S], mavlink:udp:HOST:PORT (listen; also
    udpout, tcp; ?type=setpoints&rate=20&end=hold|land flies it point by point), or a file in any format that ovita
    convert writes. With --type joints, a topic takes a JointTrajectory, and an action
    ros2:/CONTROLLER/follow_joint_trajectory is followed to its end; Ctrl-C cancels it.
    """
    arm, choices = ArmChoice.taken(options), common.choices_from(options)
    if is_address(place):
        Address.parse(place)
    only_for_ros(place, kind=options["kind"], topic=options["topic"], frame_id=options["frame_id"])
    limits = load_robot(robot) if robot else None
    found = review(file, robot=limits, trusted=trust or None, place=place, choices=choices)
    if simulate and found.released:
        found = _simulated(found, arm.arm, arm.base)
    _only_for_drones(place, found.result.scene, choices)
    _show(found, place)
    journal = log or str(default_log())
    about = {"result": os.path.abspath(file)}
    if not found.released:
        refuse(found, place, journal, about)
        raise SystemExit(common.EXIT_REFUSED)
    motion = _as_joints(found, place, arm, journal, about) if options["kind"] == "joints" else None
    if motion is None and not is_address(place):
        result = found.result
        rendered(place, result.adapted, result.scene, result.instruction, choices=choices)
    if options["dry_run"]:
        click.echo("\nIt may be sent; nothing was (--dry-run).")
        return
    if not options["yes"]:
        _confirm(place)
    if motion is not None:
        still_there(motion, arm, place)

    def told(text: str) -> None:
        common.say(f"  {text}", err=True)

    with common.waiting(f"sending to {place}"):
        receipt = release(found, place, journal, about, choices=choices, motion=motion, told=told)
    common.show_notes(note for note in receipt.notes if note not in found.cautions)
    common.say(f"\nSent to {place}: {receipt.size} bytes, SHA-256 {receipt.sha256}; logged in {journal}")


def _confirm(place: str) -> None:
    if not sys.stdin.isatty():
        raise RequestError("there is no terminal to ask for confirmation; say --yes to send without asking")
    click.confirm(common.plain(f"\nSend it to {place}?"), abort=True)


def _as_joints(found: Review, place: str, arm: ArmChoice, journal: str, about: Mapping[str, Any]) -> JointMotion:
    """A result as a motion of an arm's joints, simulated; a refusal is logged and ends the command."""
    path, scene, contacts = found.result.adapted, found.result.scene, found.result.contacts
    try:
        motion, said = joints_of(path, scene, arm, place=place, limits=found.robot, contacts=contacts)
    except RequestError as error:
        if arm.arm is None or arm.base is None:
            raise
        refuse(found, place, journal, about, [str(error)])
        common.section(f"Refused, it does not go to {place}", [str(error)])
        raise SystemExit(common.EXIT_REFUSED) from None
    common.section(f"Simulated with {arm.arm}", said)
    return motion


def _simulated(found: Review, arm: str | None, base: str | None) -> Review:
    """The review after the robot followed the path in simulation."""
    from ovita import sim

    result, limits = found.result, found.robot
    name, stood = arm or sim.STAND_INS.get(limits.name), None if base is None else sim.Base.parse(base)
    if name is None:
        known = ", ".join(sim.STAND_INS)
        raise RequestError(f"--simulate needs a model of {limits.name!r}: --arm NAME|FILE, one of {known}")
    with common.waiting("simulating"):
        done = sim.simulate(result.adapted, result.scene, name, base=stood, limits=limits, contacts=result.contacts)
    # The first sentence says where the robot stood.
    status, said = done.report.status, done.report.sentences()[1:]
    return simulated(found, said, failed=status in sim.FAILED, slowed=status == "slowed")


def _show(found: Review, place: str) -> None:
    """Print limits, verdict, changes and what speaks against it."""
    common.say(found.result.instruction)
    sections = found.sections()
    click.echo("\n".join(sections.pop("Path")))
    for title, lines in sections.items():
        common.section(title, lines)
    common.section(f"Refused, it does not go to {place}", found.refusals)


@click.group()
def gate() -> None:
    """What the gate of `ovita send` keeps."""


@gate.command()
@option("--log", metavar="FILE", help="The log. [sent.jsonl in the user's state folder]")
@shown("--last", type=click.IntRange(min=1), default=10, help="How many events are shown.")
@option("--verify", is_flag=True, help="Look for lines that were changed, removed or inserted.")
@option("--json", "as_json", is_flag=True, help="Print the events as JSON, one a line.")
def log(log: str | None, last: int, verify: bool, as_json: bool) -> None:
    """Show what was sent and refused; with --verify, whether the log is whole (exit code 4 if not)."""
    if verify and as_json:
        raise RequestError("--json shows events and --verify looks for faults: choose one")
    ledger = Ledger(log or default_log())
    if verify:
        _verify(ledger)
        return
    for event in ledger.events()[-last:]:
        shown = {key: value for key, value in event.items() if key != PREVIOUS}
        common.say(json.dumps(shown, ensure_ascii=False) if as_json else _in_words(shown))


def _verify(ledger: Ledger) -> None:
    """Print what is wrong with a log; a fault ends the command."""
    found = ledger.check()
    earlier = found.lines - found.chained
    common.say(*(f"{ledger.path}: {fault}" for fault in found.faults))
    if earlier:
        click.echo(f"{earlier} lines at the beginning are from an earlier version and bear no hashes")
    if found.faults:
        raise SystemExit(common.EXIT_REFUSED)
    common.say(f"{ledger.path}: {found.chained} lines, whole; the last one's SHA-256 is {found.head}")


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


@gate.command()
@click.argument("name", metavar="NAME")
def key(name: str) -> None:
    """Make a key pair: NAME.key, which signs and stays with you, and NAME.pub, which the gate verifies with."""
    secret, public = make_keys(name)
    common.say(f"wrote {secret} (keep it to yourself) and {public} (for --trust, or {TRUSTED})")


@gate.command()
@click.argument("file", metavar="RESULT.json")
@option("--key", "key_file", required=True, metavar="FILE", help="The private key: NAME.key of ovita gate key.")
def sign(file: str, key_file: str) -> None:
    """Sign RESULT.json, a result that the gate lets through (exit code 4 if it does not)."""
    found = review(file, trusted=())
    if not found.released:
        common.section("Refused, it is not signed", found.refusals)
        raise SystemExit(common.EXIT_REFUSED)
    document = signed(load_document(file), key_file)
    save_document(file, document)
    common.say(f"signed {file} with the key {document[SIGNATURE]['signer']}")
