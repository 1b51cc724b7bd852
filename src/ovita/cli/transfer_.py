"""`ovita convert` and `ovita send`: trajectories to another format, results through the gate to a robot."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import click

from ovita.cli.common import HEADING, choices_from, plain, section, show_notes, source, waiting
from ovita.cli.joints_ import ArmChoice, arm_options, joints_of, still_there, tool_task
from ovita.errors import FormatError, RequestError
from ovita.gate import Review, against, default_log, refuse, release, review, simulated
from ovita.io import READ, Choices, Task, is_address, is_mission, load_robot, open_task, rendered, save_task
from ovita.io.bags import save_joint_motion
from ovita.io.geodesy import MISSION
from ovita.io.json_ import is_adaptation_file
from ovita.io.links import Address
from ovita.io.messages import TYPES, JointMotion
from ovita.io.mission_checks import flight_of
from ovita.paths.frame import Frame, transformed
from ovita.paths.robot import PRESETS, Robot, preset_name
from ovita.paths.scene import Scene

_FRAMES = click.Choice(["rfu", "flu", "ned"])


_ENDINGS = f"Formats by ending: {', '.join(READ)} (ROS 1); NAME/ is the folder of a ROS 2 bag."


_TAKEOFF = click.option("--takeoff", is_flag=True, help="Begin a mission that has no takeoff with one.")


@click.command(epilog=_ENDINGS)
@click.argument("file", metavar="IN")
@click.argument("out", metavar="OUT")
@source
@click.option("--to-frame", type=_FRAMES, help="Axes of OUT (.json, .csv, .tum). [those of IN]")
@click.option(
    "--type", "kind", type=click.Choice([*TYPES, "joints"]), help="ROS message of OUT. [that of IN, else path]"
)
@click.option("--to-topic", metavar="NAME", help="Topic of OUT. [that of IN, else /path]")
@click.option("--frame-id", metavar="NAME", help="ROS frame of OUT. [that of IN, else map]")
@arm_options
@_TAKEOFF
def convert(
    file: str,
    out: str,
    to_frame: str | None,
    to_topic: str | None,
    kind: str | None,
    **options: Any,
) -> None:
    """Convert the trajectory in IN to the format of OUT's file extension; notes say what it cannot hold.

    IN may also be live: ros2:/topic?domain=0 or mavlink:udp:127.0.0.1:14550.
    """
    if is_address(out):
        raise RequestError(f"{out}: nothing is sent to a robot unverified; use ovita send RESULT.json --to {out}")
    only_for_ros(out, kind=kind, to_topic=to_topic, frame_id=options["frame_id"])
    arm = ArmChoice.taken(options)
    if to_frame is not None and not out.lower().endswith((".json", ".csv", ".tum", ".txt")):
        raise RequestError(f"--to-frame {to_frame}: {out} has axes of its own; only JSON, CSV and TUM can be turned")
    choices = choices_from(options | {"kind": None if kind == "joints" else kind})
    if arm.arm is not None and kind != "joints":
        task = tool_task(file, arm, choices, options["frame"])
    else:
        task = open_task(file, scene_file=options["scene_file"], frame=options["frame"], choices=choices)
    if kind == "joints":
        motion, said = joints_of(task.trajectory, task.scene, arm)
        save_joint_motion(out, motion, replace(choices, topic=to_topic))
        show_notes((*task.notes, *said))
        click.echo(plain(f"wrote {out}: {len(motion.times)} points of the joints {', '.join(motion.names)}"))
        return
    if to_frame is not None:
        target = Frame(to_frame)
        moved = transformed(task.trajectory, task.scene.frame, target)
        task = replace(task, trajectory=moved, scene=task.scene.in_frame(target))
    _only_for_drones(out, task.scene, choices)
    lost = save_task(out, task, replace(choices, topic=to_topic))
    show_notes((*task.notes, *lost, *_refusable(file, task, out, choices)))
    path, frame = task.trajectory, task.scene.frame
    in_mission = is_mission(out, task.scene)
    duration = flight_of(path, task.scene, choices)[0].duration if in_mission else path.duration
    # A bag or a mission has axes of its own, which a note has told.
    axes = f", frame {frame.name} ({frame.describe()})" if out.lower().endswith((".json", ".csv", ".tum")) else ""
    click.echo(plain(f"wrote {out}: {len(path)} waypoints, {path.length:.3f} m in {duration:.3f} s{axes}"))


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
            flag = "--type" if name == "kind" else f"--{name.replace('_', '-')}"
            raise RequestError(f"{flag} {value} is about ROS messages, and {place} is no ROS 2 topic or bag")


def _refusable(file: str, task: Task, out: str, choices: Choices) -> list[str]:
    """What the gate would say: of a result all, of another file as far as it names the robot to judge it by."""
    if not is_address(file) and file.lower().endswith(".json") and is_adaptation_file(file):
        try:
            found = list(review(file, place=out, choices=choices).refusals)
        except FormatError as error:
            found = [f"{error}."]
    else:
        known = task.robot is not None and preset_name(task.robot) in PRESETS
        robot = Robot.preset(task.robot) if known and task.robot else None
        found = against(task.trajectory, task.scene, robot, out, choices)
    return [f"ovita send would refuse it: {' '.join(found)}"] if found else []


EXIT_REFUSED = 4


@click.command()
@click.argument("file", metavar="RESULT.json")
@click.option("--to", "place", required=True, metavar="PLACE", help="ros2:/topic, mavlink:udp:HOST:PORT, or a file.")
@click.option("--robot", metavar="NAME|FILE", help="Whose limits to verify against. [the result's]")
@click.option("--home", metavar="LAT,LON,ALT", help="Home of a mission in degrees and metres. [the result's]")
@HEADING
@click.option(
    "--type", "kind", type=click.Choice([*TYPES, "joints"]), help="ROS message. [that of the source, else path]"
)
@arm_options
@click.option("--topic", metavar="NAME", help="Topic of a bag. [that of the source, else /path]")
@click.option("--frame-id", metavar="NAME", help="ROS frame. [that of the source, else map]")
@_TAKEOFF
@click.option("--yes", is_flag=True, help="Send without asking; refusals stay refusals.")
@click.option("--dry-run", is_flag=True, help="Only show what the gate finds.")
@click.option("--trust", multiple=True, metavar="FILE", help="Public key that must have signed it, or one of several.")
@click.option("--simulate", is_flag=True, help="Let the robot follow it in simulation first; refuse what it cannot.")
@click.option("--log", metavar="FILE", help="Where sendings are logged. [sent.jsonl in the user's state folder]")
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
    in_joints, arm = options["kind"] == "joints", ArmChoice.taken(options)
    choices = choices_from(options | {"kind": None if in_joints else options["kind"]})
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
        raise SystemExit(EXIT_REFUSED)
    result, motion = found.result, None
    if in_joints:
        motion = _as_joints(found, place, arm, journal, about)
    elif not is_address(place):
        rendered(place, result.adapted, result.scene, result.instruction, choices=choices)
    if options["dry_run"]:
        click.echo("\nIt may be sent; nothing was (--dry-run).")
        return
    if not options["yes"]:
        _confirm(place)
    if motion is not None:
        still_there(motion, arm, place)
    with waiting(f"sending to {place}"):
        receipt = release(found, place, journal, about, choices=choices, motion=motion, told=_progress)
    show_notes(note for note in receipt.notes if note not in found.cautions)
    click.echo(plain(f"\nSent to {place}: {receipt.size} bytes, SHA-256 {receipt.sha256}; logged in {journal}"))


def _as_joints(found: Review, place: str, arm: ArmChoice, journal: str, about: Mapping[str, Any]) -> JointMotion:
    """A result as a motion of an arm's joints, simulated; a refusal is logged and ends the command."""
    result = found.result
    try:
        motion, said = joints_of(
            result.adapted, result.scene, arm, place=place, limits=found.robot, contacts=result.contacts
        )
    except RequestError as error:
        if arm.arm is None or arm.base is None:
            raise
        refuse(found, place, journal, about, [str(error)])
        section(f"Refused, it does not go to {place}", [str(error)])
        raise SystemExit(EXIT_REFUSED) from None
    section(f"Simulated with {arm.arm}", said)
    return motion


def _simulated(found: Review, arm: str | None, base: str | None) -> Review:
    """The review after the robot followed the path in simulation."""
    from ovita import sim

    name = arm or sim.STAND_INS.get(found.robot.name)
    if name is None:
        raise RequestError(
            f"--simulate needs a model of {found.robot.name!r}: --arm NAME|FILE, one of {', '.join(sim.STAND_INS)}"
        )
    result, stood = found.result, None if base is None else sim.Base.parse(base)
    with waiting("simulating"):
        path, limits = result.adapted, found.robot
        done = sim.simulate(path, result.scene, name, base=stood, limits=limits, contacts=result.contacts)
    # The first sentence says where the robot stood.
    status, said = done.report.status, done.report.sentences()[1:]
    return simulated(found, said, failed=status in sim.FAILED, slowed=status == "slowed")


def _progress(text: str) -> None:
    """Tell of a motion that is under way."""
    click.echo(plain(f"  {text}"), err=True)


def _confirm(place: str) -> None:
    """Ask a person at a terminal."""
    if not sys.stdin.isatty():
        raise RequestError("there is no terminal to ask for confirmation; say --yes to send without asking")
    click.confirm(plain(f"\nSend it to {place}?"), abort=True)


def _show(found: Review, place: str) -> None:
    """Print limits, verdict, changes and what speaks against it."""
    click.echo(plain(f"{found.result.instruction}"))
    sections = found.sections()
    click.echo("\n".join(sections.pop("Path")))
    for title, lines in sections.items():
        section(title, lines)
    section(f"Refused, it does not go to {place}", found.refusals)
