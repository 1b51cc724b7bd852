"""An arm's joints in ROS 2: where they are now, and goals for its controller (FollowJointTrajectory) by rclpy."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from typing import Any

from ovita.errors import FormatError, LinkError, needs
from ovita.io import bags
from ovita.io.bus import message_class, ros_node, wait
from ovita.io.documents import number_problem
from ovita.io.files import file_name, is_address, is_bag, read_text, suffix
from ovita.io.links import Address
from ovita.io.messages import JointMotion, Maker, build_joints, stamp_ns
from ovita.io.recorded import JOINT_STATE

ACTION = "control_msgs/action/FollowJointTrajectory"

RESULTS = {
    0: "the controller reports success",
    -1: "invalid goal: the controller cannot use this trajectory",
    -2: "invalid joints: the controller has joints of other names; give them with --joint-names",
    -3: "old header timestamp: the trajectory was to start in the past; check that the clocks agree",
    -4: "path tolerance violated: the arm strayed from the trajectory and was stopped",
    -5: "goal tolerance violated: the arm did not come to rest at the last point in time",
}
"""What each error code of a result means; control_msgs/action/FollowJointTrajectory."""

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Of action_msgs/msg/GoalStatus."""

TOLD_EVERY = 0.5
"""Time between two lines on the progress [s]."""

Told = Callable[[str], None]


def follow(address: Address, motion: JointMotion, told: Told | None = None, frame_id: str = "") -> bytes:
    """Have a controller follow a motion of joints, and wait until it has; the bytes of its trajectory.

    Ctrl-C cancels the goal, after which the controller holds the arm where it is. So does a controller that does not
    end in time.

    The address is that of the action, such as ros2:/joint_trajectory_controller/follow_joint_trajectory, the motion in
    the controller's names; `told` hears of the progress, twice a second.

    Raises:
        LinkError: If there is no such action or no rclpy, the goal is rejected, cancelled or fails; says why.
    """
    try:
        from rclpy.action import ActionClient
        from rclpy.serialization import serialize_message
    except ImportError:
        set_up = "set up ROS in this shell (source /opt/ros/DISTRO/setup.bash)"
        instead = "send a JointTrajectory to the controller's topic: ros2:/CONTROLLER/joint_trajectory"
        raise LinkError(f"{address}: actions need ROS 2's own rclpy; {set_up}, or {instead}") from None
    kind = message_class(ACTION)
    maker = Maker(lambda name, /, **fields: message_class(name)(**fields))
    message = build_joints(motion, maker, frame_id=frame_id)
    with ros_node(address) as (node, spin):
        client = ActionClient(node, kind, address.target)
        if not wait(client.server_is_ready, address.timeout, spin):
            what = f"no controller offers {ACTION} as {address.target} in domain {address.domain}"
            raise LinkError(f"{address}: {what} within {address.timeout:g} s; nothing was sent")
        sent = client.send_goal_async(kind.Goal(trajectory=message), feedback_callback=_progress(motion, told))
        if not wait(sent.done, address.timeout, spin):
            raise LinkError(f"{address}: the controller did not answer the goal within {address.timeout:g} s")
        goal = sent.result()
        if not goal.accepted:
            why = "its joints or its state may not fit: see its log"
            raise LinkError(f"{address}: the controller rejected the goal; {why}")
        _await(address, goal, motion.duration + address.timeout, spin)
    return bytes(serialize_message(message))


def _progress(motion: JointMotion, told: Told | None) -> Callable[[Any], None]:
    """Tells of feedback, at most every `TOLD_EVERY`."""
    due = 0.0

    def tell(message: Any) -> None:
        nonlocal due
        if told is not None and time.monotonic() >= due:
            due = time.monotonic() + TOLD_EVERY
            seen = message.feedback
            at = stamp_ns(seen.desired.time_from_start) / 1e9
            told(progress_line(motion, at, seen.joint_names, seen.error.positions))

    return tell


def progress_line(motion: JointMotion, at: float, names: Sequence[str], errors: Sequence[float]) -> str:
    """How far a controller is: time [s], share, and the joint that is farthest off [rad]."""
    done = f"{at:.1f} of {motion.duration:.1f} s"
    if not len(errors) or len(errors) != len(names):
        return done
    worst = max(range(len(errors)), key=lambda i: abs(errors[i]))
    return f"{done}, off by at most {abs(errors[worst]):.4f} rad ({names[worst]})"


def _await(address: Address, goal: Any, patience: float, spin: Callable[[], None]) -> None:
    """Wait for the end of a goal; cancel it on Ctrl-C, or where it takes too long."""
    ended = goal.get_result_async()
    why = f"it had not ended after {patience:.0f} s, so it was cancelled"
    try:
        if wait(ended.done, patience, spin):
            _check(address, ended.result())
            return
    except KeyboardInterrupt:
        why = "cancelled by Ctrl-C"
    stopped = goal.cancel_goal_async()
    then = ", but THE CONTROLLER DID NOT CONFIRM: the arm may still move; stop it by hand"
    with suppress(KeyboardInterrupt):  # a second Ctrl-C ends the wait, not the cancelling
        if wait(stopped.done, address.timeout, spin) and wait(ended.done, address.timeout, spin):
            in_time = ended.result().status != SUCCEEDED
            then = ", but the controller had ended before: the arm is at the last point"
            then = "; the controller confirmed it and holds the arm where it is" if in_time else then
    raise LinkError(f"{address}: {why}{then}")


def _check(address: Address, response: Any) -> None:
    code, text = int(response.result.error_code), str(response.result.error_string).strip()
    if response.status == SUCCEEDED and code == 0:
        return
    how = {SUCCEEDED: "ended", CANCELED: "was cancelled by the controller", ABORTED: "was aborted"}.get(response.status)
    meaning = RESULTS.get(code, f"error code {code}, which the action does not define")
    also = f" ({text})" if text else ""
    raise LinkError(f"{address}: the motion {how or f'ended with status {response.status}'}: {meaning}{also}")


STATE_TOPIC = "/joint_states"


def joint_state(place: str) -> dict[str, float]:
    """The last position of every joint [rad or m] in a file, a bag, or on a live topic such as ros2:/joint_states.

    A file is JSON or YAML: names with their positions, or `name` and `position` as `ros2 topic echo --once` prints
    them.

    Raises:
        FormatError: If the file holds no joint state.
        LinkError: If none comes.
        MissingExtra: If a package is missing.
    """
    if is_address(place):
        return _live(Address.parse(place))
    if is_bag(place):
        return _recorded(place)
    document = _document(place)
    if not isinstance(document, Mapping):
        raise FormatError(file_name(place), "holds no joint state; write a table of joint names and positions [rad]")
    if {"name", "position"} & set(document):
        return _paired(document.get("name"), document.get("position"), file_name(place))
    return _paired(list(document), list(document.values()), file_name(place))


def _paired(names: Any, values: Any, where: str) -> dict[str, float]:
    names, values = _items(names), _items(values)
    if not names or len(names) != len(values):
        raise FormatError(where, f"holds {len(names)} joint names and {len(values)} positions; give one for each")
    if len(set(names)) != len(names):
        raise FormatError(where, "names a joint twice")
    found = dict(zip(map(str, names), values, strict=True))
    for name, problem in ((name, number_problem(value)) for name, value in found.items()):
        if problem:
            raise FormatError(where, problem, key=name)
    return {name: float(value) for name, value in found.items()}


def _items(values: Any) -> Sequence[Any]:
    if hasattr(values, "tolist"):
        values = values.tolist()
    return list(values) if isinstance(values, list | tuple) else []


def _document(place: str) -> Any:
    text = read_text(place)
    if suffix(place) not in (".yaml", ".yml"):
        try:
            return json.loads(text)
        except ValueError as error:
            raise FormatError(file_name(place), f"this is not JSON ({error}); YAML ends in .yaml") from None
    with needs("ruamel.yaml", "ros"):
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    try:
        return next(iter(YAML(typ="safe").load_all(text)), None)
    except YAMLError as error:
        raise FormatError(file_name(place), f"this is not YAML ({' '.join(str(error).split())[:120]})") from None


def _recorded(place: str | os.PathLike[str]) -> dict[str, float]:
    """The last state of every joint in a bag; several publishers may each know some of them."""
    file, found = file_name(place), dict[str, float]()
    with bags.opened(place) as bag:
        wanted = [c for c in bag.connections if c.msgtype == JOINT_STATE]
        for connection, _, data in bag.messages(connections=wanted) if wanted else ():
            message = bag.deserialize(data, connection.msgtype)
            found |= _paired(message.name, message.position, f"{file} {connection.topic}")
    if not found:
        raise FormatError(file, f"holds no {JOINT_STATE}; record one: ros2 bag record {STATE_TOPIC}")
    return found


def _live(address: Address) -> dict[str, float]:
    if address.bus != "ros2":
        raise LinkError(f"{address}: joint states come from ROS 2 topics, such as ros2:{STATE_TOPIC}")
    from ovita.io import ros2

    came = ros2.capture(address, lambda there: [address.target], bool)
    fitting = [one.message for one in came if one.type == JOINT_STATE]
    if not fitting:
        where = f"on {address.target} in domain {address.domain} within {address.timeout:g} s"
        raise LinkError(f"{address}: no {JOINT_STATE} came {where}; so nobody knows where the arm is")
    return _paired(fitting[-1].name, fitting[-1].position, str(address))
