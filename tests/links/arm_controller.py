"""A small FollowJointTrajectory server, and ovita's client, run by ROS 2's own Python: server|client WHAT."""

import sys
import threading
import time

DOMAIN = 77
TARGET = "ros2:/arm/follow_joint_trajectory?domain=77&timeout=20"


def server(what):
    """Publish joint states and serve one goal: succeed, reject, abort (path tolerance), or wait to be cancelled."""
    import rclpy
    from control_msgs.action import FollowJointTrajectory
    from rclpy.action import ActionServer, CancelResponse, GoalResponse
    from rclpy.callback_groups import ReentrantCallbackGroup
    from rclpy.executors import MultiThreadedExecutor
    from sensor_msgs.msg import JointState

    rclpy.init(domain_id=DOMAIN)
    node = rclpy.create_node("arm")
    states = node.create_publisher(JointState, "/joint_states", 10)
    node.create_timer(0.05, lambda: states.publish(JointState(name=["b", "a"], position=[0.5, 0.25])))

    def execute(goal):
        result, feedback = FollowJointTrajectory.Result(), FollowJointTrajectory.Feedback()
        points = goal.request.trajectory.points
        print(
            "points", len(points), list(goal.request.trajectory.joint_names), len(points[0].accelerations), flush=True
        )
        feedback.joint_names = goal.request.trajectory.joint_names
        feedback.desired.time_from_start = points[-1].time_from_start
        feedback.error.positions = [0.001, -0.002]
        goal.publish_feedback(feedback)
        time.sleep(0.3)
        if what == "abort":
            result.error_code, result.error_string = -4, "b lags"
            goal.abort()
        elif what == "wait":
            while not goal.is_cancel_requested:
                time.sleep(0.02)
            goal.canceled()
            print("cancelled", flush=True)
        else:
            goal.succeed()
        return result

    ActionServer(
        node,
        FollowJointTrajectory,
        "/arm/follow_joint_trajectory",
        execute,
        goal_callback=lambda _: GoalResponse.REJECT if what == "reject" else GoalResponse.ACCEPT,
        cancel_callback=lambda _: CancelResponse.ACCEPT,
        callback_group=ReentrantCallbackGroup(),
    )
    executor = MultiThreadedExecutor()
    executor.add_node(node)
    print("ready", flush=True)
    executor.spin()


def client(what):
    """Read the joint states, follow a motion, and say how it ended; "wait" is stopped by what Ctrl-C raises."""
    import _thread

    from ovita.errors import LinkError
    from ovita.io.controllers import follow, joint_state
    from ovita.io.links import Address
    from ovita.io.messages import JointMotion

    print("state", sorted(joint_state("ros2:/joint_states?domain=77&timeout=20").items()), flush=True)
    motion = JointMotion(("a", "b"), [[0.25, 0.5], [0.3, 0.6]], [0, 1], [[0, 0], [0, 0]], accelerations=[[1, 1]] * 2)
    if what == "wait":
        threading.Timer(4.0, _thread.interrupt_main).start()
    try:
        print("sent", len(follow(Address.parse(TARGET), motion, lambda text: print("told", text, flush=True))) > 100)
    except LinkError as error:
        print("error", error)


if __name__ == "__main__":
    {"server": server, "client": client}[sys.argv[1]](sys.argv[2])
