"""A node that has ovita adapt a path: python ask_ovita.py "go left by 0.2" (beside: ovita ros serve)."""

import json
import sys

import rclpy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


class Asker(Node):
    """Publishes a path, then the instruction once the path is taken, and keeps what comes back."""

    def __init__(self, instruction):
        super().__init__("ask_ovita")
        self.instruction, self.status, self.adapted = instruction, {}, None
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.paths = self.create_publisher(Path, "/ovita/path", latched)
        self.words = self.create_publisher(String, "/ovita/instruction", 10)
        self.create_subscription(String, "/ovita/status", self.on_status, 10)
        self.create_subscription(Path, "/ovita/adapted", self.on_adapted, 10)

    def send_path(self):
        """Publish a path: straight ahead at 0.5 m/s."""
        path = Path()
        path.header.frame_id = "map"
        for i in range(40):
            pose = PoseStamped()
            pose.header.frame_id = "map"
            pose.pose.position.x, pose.pose.position.z = 0.05 * i, 0.5
            pose.header.stamp.sec, pose.header.stamp.nanosec = divmod(100_000_000 * i, 1_000_000_000)
            path.poses.append(pose)
        self.paths.publish(path)

    def on_status(self, message):
        """Give the instruction once the path is taken; keep the answer to it."""
        status = json.loads(message.data)
        if status["about"] == "path":
            self.words.publish(String(data=self.instruction))
        else:
            self.status = status

    def on_adapted(self, path):
        """Keep the adapted path."""
        self.adapted = path


def main():
    rclpy.init()
    asker = Asker(" ".join(sys.argv[1:]) or "go left by 0.2")
    while asker.paths.get_subscription_count() == 0 or asker.count_publishers("/ovita/status") == 0:
        rclpy.spin_once(asker, timeout_sec=0.1)
    asker.send_path()
    while not asker.status or (asker.status.get("published") and asker.adapted is None):
        rclpy.spin_once(asker, timeout_sec=0.1)
    print(asker.status["status"], "-", asker.status["message"])
    if asker.adapted is not None:
        end = asker.adapted.poses[-1].pose.position
        print(f"adapted: {len(asker.adapted.poses)} poses, to {end.x:.2f} {end.y:.2f} {end.z:.2f}")
    rclpy.shutdown()


if __name__ == "__main__":
    main()
