"""`ovita convert`: a trajectory from one format into another."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import click

from ovita.cli.options import choices_from, source
from ovita.cli.report import plain
from ovita.errors import RequestError
from ovita.gate import against
from ovita.io import READ, Choices, Task, is_address, open_task, save_task
from ovita.io.bags import load_joint_motion, save_joint_motion
from ovita.io.messages import TYPES, JointMotion
from ovita.paths.frame import Frame, transformed
from ovita.paths.robot import PRESETS, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

_FRAMES = click.Choice(["rfu", "flu", "ned"])


_ENDINGS = f"Formats by ending: {', '.join(READ)} (ROS 1, only read); NAME/ is the folder of a ROS 2 bag."


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
@click.option("--arm", metavar="NAME|FILE", help="Kinematic model, for the joints of IN or of OUT: iiwa, or a .toml.")
@click.option("--base", metavar="X,Y,Z,YAW", help="Where that arm stands, in metres and radians.")
def command(
    file: str,
    out: str,
    to_frame: str | None,
    to_topic: str | None,
    kind: str | None,
    arm: str | None,
    base: str | None,
    **options: Any,
) -> None:
    """Convert the trajectory in IN to the format of OUT's file extension; notes say what it cannot hold.

    IN may also be live: ros2:/topic?domain=0 or mavlink:udp:127.0.0.1:14550.
    """
    if is_address(out):
        raise RequestError(f"{out}: nothing is sent to a robot unverified; use ovita send RESULT.json --to {out}")
    only_for_ros(out, kind=kind, to_topic=to_topic, frame_id=options["frame_id"])
    if base is not None and arm is None:
        raise RequestError(f"--base {base} says where an arm stands; name the arm as well: --arm iiwa")
    if to_frame is not None and not out.lower().endswith((".json", ".csv", ".tum", ".txt")):
        raise RequestError(f"--to-frame {to_frame}: {out} has axes of its own; only JSON, CSV and TUM can be turned")
    choices = choices_from(options | {"kind": None if kind == "joints" else kind})
    if arm is not None and kind != "joints":
        task = _tool_path(file, arm, base, choices, options["frame"])
    else:
        task = open_task(file, scene_file=options["scene_file"], frame=options["frame"], choices=choices)
    if kind == "joints":
        motion, said = joints_of(task.trajectory, task.scene, arm, base)
        save_joint_motion(out, motion, replace(choices, topic=to_topic))
        for note in (*task.notes, *said):
            click.echo(f"note: {plain(note)}", err=True)
        click.echo(plain(f"wrote {out}: {len(motion.times)} points of the joints {', '.join(motion.names)}"))
        return
    if to_frame is not None:
        target = Frame(to_frame)
        moved = transformed(task.trajectory, task.scene.frame, target)
        task = replace(task, trajectory=moved, scene=task.scene.in_frame(target))
    lost = save_task(out, task, replace(choices, topic=to_topic))
    for note in (*task.notes, *lost, *_refusable(task)):
        click.echo(f"note: {plain(note)}", err=True)
    path, frame = task.trajectory, task.scene.frame
    # A bag or a mission has axes of its own, which a note has told.
    axes = f", frame {frame.name} ({frame.describe()})" if out.lower().endswith((".json", ".csv", ".tum")) else ""
    click.echo(plain(f"wrote {out}: {len(path)} waypoints, {path.length:.3f} m in {path.duration:.3f} s{axes}"))


def only_for_ros(place: str, **options: str | None) -> None:
    """Refuse options on ROS messages for a place that takes none.

    Raises:
        RequestError: If one was given; names it.
    """
    if place.startswith("ros2:") or place.lower().endswith((".mcap", ".db3", ".bag", "/")):
        return
    for name, value in options.items():
        if value is not None:
            flag = "--type" if name == "kind" else f"--{name.replace('_', '-')}"
            raise RequestError(f"{flag} {value} is about ROS messages, and {place} is no ROS 2 topic or bag")


def joints_of(
    path: Trajectory,
    scene: Scene,
    arm: str | None,
    base: str | None,
    limits: Robot | None = None,
    contacts: Sequence[str] = (),
) -> tuple[JointMotion, tuple[str, ...]]:
    """The joints' motion of an arm along a path, and how well it follows, in sentences.

    Raises:
        RequestError: If the arm or its place is not given, or it cannot follow the path.
    """
    if arm is None or base is None:
        raise RequestError("joints need an arm and its place: --arm iiwa --base x,y,z,yaw, in the scene's coordinates")
    from ovita.sim import Base
    from ovita.sim.joints import joint_motion

    return joint_motion(path, scene, arm, base=Base.parse(base), limits=limits, contacts=contacts)


def _refusable(task: Task) -> list[str]:
    """What the gate would say against the trajectory, as far as the file names the robot to judge it by."""
    robot = None if task.robot is None else Robot.preset(task.robot) if task.robot in PRESETS else None
    found = against(task.trajectory, task.scene, robot)
    return [f"ovita send would refuse it: {text}" for text in found]


def _tool_path(file: str, arm: str, base: str | None, choices: Choices, frame: str | None) -> Task:
    from ovita.sim import Base
    from ovita.sim.joints import tool_path

    motion = load_joint_motion(file, choices)
    path = tool_path(motion, arm, base=None if base is None else Base.parse(base))
    axes = motion.frame if frame is None else Frame(frame)
    said = f"the path of the tip of {arm} through {len(motion.times)} points, in {axes.name} ({axes.describe()})"
    return Task(path, Scene(frame=axes), path=file, notes=(said,), fixed_frame=True)
