"""The joints of an arm in `ovita convert` and `ovita send`: options, the motion, and the check of its start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import click
from click import option

from ovita.cli.common import together
from ovita.errors import RequestError
from ovita.io import Choices, Task, is_address
from ovita.io.bags import load_joint_motion
from ovita.io.controllers import STATE_TOPIC, joint_state
from ovita.io.links import Address
from ovita.io.messages import JointMotion
from ovita.paths.robot import Robot
from ovita.paths.scene import Frame, Scene
from ovita.paths.trajectory import Trajectory

TIP = option("--tip", metavar="NAME", help="Site or link of the arm that follows the path. [the robot file's]")
IGNORED = option(
    "--ignore-contact",
    "ignored",
    multiple=True,
    metavar="LINK,LINK",
    help="Two links of the arm that may touch each other; may be repeated. Neighbours may anyway.",
)
arm_options = together(
    option("--arm", metavar="NAME|FILE", help="Kinematic model for joints: iiwa, or a .toml, .urdf or .xml."),
    option(
        "--base",
        metavar="X,Y,Z,YAW",
        help="Where that arm stands, in the scene's coordinates: metres, and radians (1.5708 is 90 degrees).",
    ),
    TIP,
    IGNORED,
    option(
        "--joint-names",
        metavar="PATTERN|NAMES",
        help="What the controller calls the joints: lbr_iiwa_joint_N (N: number), left_* (*: name), or all names.",
    ),
    option(
        "--joint-state",
        metavar="PLACE",
        help="Where the arm is now: .json, .yaml, a bag, or ros2:/joint_states. [live for a live arm]",
    ),
    option(
        "--start-tolerance",
        type=click.FloatRange(0, min_open=True),
        metavar="RAD",
        help="Largest gap of a joint to the start. [0.01]",
    ),
    option("--approach", is_flag=True, help="Plan a slow way from where the arm is to the start, and put it first."),
)
"""The options on an arm and its joints."""


@dataclass(frozen=True)
class ArmChoice:
    """What was chosen of an arm: its model, its place, its joints' names, and how its start is checked."""

    arm: str | None = None
    base: str | None = None
    tip: str | None = None
    ignored: tuple[str, ...] = ()
    joint_names: str | None = None
    joint_state: str | None = None
    start_tolerance: float | None = None
    approach: bool = False

    @classmethod
    def taken(cls, options: dict[str, Any]) -> ArmChoice:
        """The choice in a command's options, which are taken out of them.

        Raises:
            RequestError: If one of them says something of an arm that is not named.
        """
        given = {item.name: options.pop(item.name) for item in fields(cls)}
        name, value = next(((name, value) for name, value in given.items() if value), ("arm", None))
        if name != "arm":
            flag = "ignore-contact" if name == "ignored" else name.replace("_", "-")
            what = "says where an arm stands" if name == "base" else "is about an arm"
            said = "" if value is True else f" {value}"
            raise RequestError(f"--{flag}{said} {what}; name the arm as well: --arm iiwa")
        return cls(**given)

    def model(self) -> Any:
        """The arm's model, with the tip and the links that were named."""
        from ovita.sim import load_model

        assert self.arm is not None
        return load_model(self.arm, tip=self.tip, ignore_contacts=self.ignored)

    def state(self, place: str = "") -> dict[str, float] | None:
        """Where the joints are now: as was said, else of a live arm at the place that is sent to, else unknown."""
        if self.joint_state:
            return joint_state(self.joint_state)
        return joint_state(str(beside(Address.parse(place)))) if place.startswith("ros2:") else None


def beside(address: Address) -> Address:
    """Where a robot that takes motions at an address publishes its joint states."""
    kept = {key: value for key, value in address.options.items() if key in ("domain", "local", "timeout")}
    return Address("ros2", STATE_TOPIC, kept)


def joints_of(
    path: Trajectory,
    scene: Scene,
    chosen: ArmChoice,
    *,
    place: str = "",
    limits: Robot | None = None,
    contacts: Sequence[str] = (),
) -> tuple[JointMotion, tuple[str, ...]]:
    """The joints' motion of an arm along a path from where it is, and how well it follows, in sentences.

    Raises:
        RequestError: If the arm cannot follow, or would jump at the start.
    """
    if chosen.arm is None or chosen.base is None:
        raise RequestError("joints need an arm and its place: --arm iiwa --base x,y,z,yaw, in the scene's coordinates")
    from ovita.sim import Base
    from ovita.sim.joints import START_TOLERANCE, arm_joints, gaps, joint_motion, start_problem

    base, model, state, names = Base.parse(chosen.base), chosen.model(), chosen.state(place), chosen.joint_names
    motion, said = joint_motion(
        path, scene, model, base=base, limits=limits, contacts=contacts, names=names, state=state
    )
    if state is None:
        unknown = "Start not checked: nobody said where the arm is (--joint-state FILE or ros2:/joint_states)."
        return motion, (*said, unknown)
    now = arm_joints(model, names).state(state)
    tolerance = chosen.start_tolerance or START_TOLERANCE
    problem, worst = start_problem(motion, now, tolerance), max(gaps(motion, now).values())
    if problem is None:
        checked = f"Start checked: every joint is within {worst:.4f} rad of it (tolerance {tolerance:g})."
        return motion, (*said, checked)
    if not chosen.approach:
        raise RequestError(f"start: {problem}")
    from ovita.sources.approach import approach

    whole = approach(motion, now, model, scene, base, limits)
    way = f"{whole.duration - motion.duration:.2f} s from where the arm is, {worst:.3f} rad away"
    return whole, (*said, f"Approach: {way}, clear of all that is known.")


def still_there(motion: JointMotion, chosen: ArmChoice, place: str) -> None:
    """Check a live arm's start once more, since a person may have taken time to confirm.

    Raises:
        RequestError: If it has moved away.
    """
    source = chosen.joint_state or place
    if not is_address(source):
        return
    from ovita.sim.joints import START_TOLERANCE, arm_joints, start_problem

    now = arm_joints(chosen.model(), chosen.joint_names).state(chosen.state(place) or {})
    problem = start_problem(motion, now, chosen.start_tolerance or START_TOLERANCE)
    if problem is not None:
        raise RequestError(f"the arm has moved since it was asked: {problem}")


def tool_task(file: str, chosen: ArmChoice, choices: Choices, frame: str | None) -> Task:
    """The path of an arm's tip through the motion of joints in a bag."""
    from ovita.sim import Base
    from ovita.sim.joints import tool_path

    if is_address(file):
        from ovita.io.ros2 import receive_joints

        motion, notes = receive_joints(Address.parse(file), choices)
    else:
        motion, notes = load_joint_motion(file, choices), ()
    base = None if chosen.base is None else Base.parse(chosen.base)
    path = tool_path(motion, chosen.model(), base=base, names=chosen.joint_names)
    axes = motion.frame if frame is None else Frame(frame)
    said = f"the path of the tip of {chosen.arm} through {len(motion.times)} points, in {axes.name} ({axes.describe()})"
    if base is None:
        said += "; they begin at the arm's own base, since --base does not say where it stands"
    return Task(path, Scene(frame=axes), path=file, notes=(*notes, said), fixed_frame=True)
