"""ROS: messages that hold a path, and the bags that they are kept in (extra `ros`)."""
