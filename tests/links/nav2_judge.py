"""A controller server as Nav2 has one, with nothing of ovita: it takes one path, says what came, and ends well."""

import rclpy
from nav2_msgs.action import FollowPath
from rclpy.action import ActionServer

rclpy.init()
node = rclpy.create_node("controller_server")


def follow(goal):
    poses = goal.request.path.poses
    end = poses[-1].pose.position
    print(goal.request.path.header.frame_id, len(poses), round(end.x, 3), round(end.y, 3), flush=True)
    goal.succeed()
    return FollowPath.Result()


ActionServer(node, FollowPath, "follow_path", follow)
print("ready", flush=True)
rclpy.spin(node)
