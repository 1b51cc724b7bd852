"""An arm's controller in ROS 2: goals of FollowJointTrajectory, through rclpy."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

from ovita.errors import LinkError
from ovita.io.bus import message_class, ros_node, wait
from ovita.io.links import Address
from ovita.io.messages import JointMotion, Maker, build_joints

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

    Args:
        address: Of the action, such as ros2:/joint_trajectory_controller/follow_joint_trajectory.
        motion: In the controller's names.
        told: Told of the progress, twice a second.
        frame_id: Of the message.

    Raises:
        LinkError: If there is no such action or no rclpy, the goal is rejected, cancelled or fails; says why.
    """
    try:
        from rclpy.action import ActionClient
        from rclpy.serialization import serialize_message
    except ImportError:
        raise LinkError(
            f"{address}: actions need ROS 2's own rclpy; set up ROS in this shell (source /opt/ros/DISTRO/setup.bash), "
            "or send a JointTrajectory to the controller's topic: ros2:/CONTROLLER/joint_trajectory"
        ) from None
    kind = message_class(ACTION)
    maker = Maker(lambda name, /, **fields: message_class(name)(**fields))
    message = build_joints(motion, maker, frame_id=frame_id)
    with ros_node(address) as (node, spin):
        client = ActionClient(node, kind, address.target)
        if not wait(client.server_is_ready, address.timeout, spin):
            what = f"no controller offers {ACTION} as {address.target} in domain {address.domain}"
            raise LinkError(f"{address}: {what} within {address.timeout:g} s; nothing was sent")
        progress = _Progress(motion, told)
        sent = client.send_goal_async(kind.Goal(trajectory=message), feedback_callback=progress)
        if not wait(sent.done, address.timeout, spin):
            raise LinkError(f"{address}: the controller did not answer the goal within {address.timeout:g} s")
        goal = sent.result()
        if not goal.accepted:
            raise LinkError(
                f"{address}: the controller rejected the goal; its joints or its state may not fit: see its log"
            )
        _await(address, goal, motion.duration + address.timeout, spin)
    return bytes(serialize_message(message))


class _Progress:
    """Tells of feedback, at most every `TOLD_EVERY`."""

    def __init__(self, motion: JointMotion, told: Told | None) -> None:
        self._motion, self._told, self._next = motion, told, 0.0

    def __call__(self, message: Any) -> None:
        if self._told is None or time.monotonic() < self._next:
            return
        self._next = time.monotonic() + TOLD_EVERY
        seen = message.feedback
        self._told(
            progress_line(self._motion, _seconds(seen.desired.time_from_start), seen.joint_names, seen.error.positions)
        )


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
    confirmed = False
    with suppress(KeyboardInterrupt):  # a second Ctrl-C ends the wait, not the cancelling
        confirmed = wait(stopped.done, address.timeout, spin) and wait(ended.done, address.timeout, spin)
    if confirmed:
        if ended.result().status == SUCCEEDED:
            raise LinkError(f"{address}: {why}, but the controller had ended before: the arm is at the last point")
        raise LinkError(f"{address}: {why}; the controller confirmed it and holds the arm where it is")
    raise LinkError(f"{address}: {why}, but THE CONTROLLER DID NOT CONFIRM: the arm may still move; stop it by hand")


def _check(address: Address, response: Any) -> None:
    """Raise what a result says against the motion."""
    code, text = int(response.result.error_code), str(response.result.error_string).strip()
    if response.status == SUCCEEDED and code == 0:
        return
    how = {SUCCEEDED: "ended", CANCELED: "was cancelled by the controller", ABORTED: "was aborted"}.get(response.status)
    meaning = RESULTS.get(code, f"error code {code}, which the action does not define")
    also = f" ({text})" if text else ""
    raise LinkError(f"{address}: the motion {how or f'ended with status {response.status}'}: {meaning}{also}")


def _seconds(duration: Any) -> float:
    return int(duration.sec) + int(duration.nanosec) / 1e9
