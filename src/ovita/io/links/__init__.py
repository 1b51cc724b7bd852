"""Live links to robots: ROS 2 topics over DDS, and MAVLink vehicles.

A place that a trajectory comes from or goes to is a file or an address such as `ros2:/plan?domain=3` or
`mavlink:udp:127.0.0.1:14550`. Nothing here decides whether a trajectory may be sent: that is `ovita.gate`.
"""

from __future__ import annotations

from ovita.io.links.address import Address, is_address
from ovita.io.links.transfer import Receipt, deliver, deliver_joints, open_task, receive, with_scene

__all__ = ["Address", "Receipt", "deliver", "deliver_joints", "is_address", "open_task", "receive", "with_scene"]
