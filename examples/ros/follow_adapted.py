"""A node that has Nav2 follow what ovita adapted: python follow_adapted.py (beside: ovita ros serve --robot jackal)."""

import rclpy
from nav2_msgs.action import FollowPath
from nav_msgs.msg import Path
from rclpy.action import ActionClient
from rclpy.node import Node


class Follower(Node):
    """Gives each path on /ovita/adapted to Nav2's controller server; a new one takes the place of the last."""

    def __init__(self):
        super().__init__("follow_adapted")
        self.nav2 = ActionClient(self, FollowPath, "follow_path")
        self.create_subscription(Path, "/ovita/adapted", self.on_adapted, 10)

    def on_adapted(self, path):
        """Send the goal; Nav2 chooses the speed itself, so the stamps of the poses do not count."""
        self.nav2.wait_for_server()
        goal = FollowPath.Goal(path=path, controller_id="FollowPath", goal_checker_id="general_goal_checker")
        self.nav2.send_goal_async(goal).add_done_callback(self.on_answer)

    def on_answer(self, answered):
        """Say whether the goal was taken, and how it ended."""
        goal = answered.result()
        self.get_logger().info("accepted" if goal.accepted else "rejected")
        if goal.accepted:
            goal.get_result_async().add_done_callback(
                lambda ended: self.get_logger().info(f"ended with error code {ended.result().result.error_code}")
            )


def main():
    rclpy.init()
    rclpy.spin(Follower())


if __name__ == "__main__":
    main()
