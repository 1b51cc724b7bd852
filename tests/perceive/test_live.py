"""Cameras on live ROS 2 topics, without ROS: another process publishes on loopback, as drivers do."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("cyclonedds", reason="needs cyclonedds (extra ros)")
pytest.importorskip("rosbags", reason="needs rosbags (extra ros)")

from depth_pictures import Thing, picture

from ovita.errors import LinkError
from ovita.perceive import perceive
from ovita.perceive.recordings import RecordingChoices, read_live

DOMAIN = 100 + os.getpid() % 100
CUP = Thing("box", (0.0, 0.1, 0.06), (0.08, 0.08, 0.12), colour="red")

PUBLISH = """
    import sys, time
    sys.path.insert(0, TESTS)
    import numpy as np
    from camera_bags import Camera, millimetres
    from depth_pictures import Thing, picture
    from ovita.io.bus import dds_bus
    from ovita.io.links import Address

    class Live(Camera):
        def new(self, name, /, **fields):
            plain = {k: v.ravel().tolist() if isinstance(v, np.ndarray) else v for k, v in fields.items()}
            return bus.maker.new(name, **plain)

    view = picture([Thing("box", (0.0, 0.1, 0.06), (0.08, 0.08, 0.12), colour="red")])
    depth, rgb = "/camera/depth/image_rect_raw", "/camera/color/image_raw"
    with dds_bus(Address.parse("ros2:/x?domain=DOMAIN&local=1")) as bus:
        cam = Live()
        said = {
            depth: ("sensor_msgs/msg/Image", cam.image(millimetres(view), "16UC1"), False),
            rgb: ("sensor_msgs/msg/Image", cam.image(view.rgb, "rgb8"), False),
            "/camera/depth/camera_info": ("sensor_msgs/msg/CameraInfo", cam.info(view.intrinsics, view.shape), False),
            "/tf_static": ("tf2_msgs/msg/TFMessage", cam.tf(("world", "cam_optical", view.pose)), True),
        }
        writers = {topic: bus.publisher(topic, name, latched=latched) for topic, (name, _, latched) in said.items()}
        writers["/tf_static"].write(said["/tf_static"][1])
        while True:
            for topic, (_, message, latched) in said.items():
                if not latched:
                    writers[topic].write(message)
            time.sleep(0.1)
"""


@pytest.fixture
def driver():
    code = textwrap.dedent(PUBLISH).replace("DOMAIN", str(DOMAIN)).replace("TESTS", repr(str(Path(__file__).parent)))
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL)
    yield process
    process.kill()
    process.wait()


def test_a_camera_driver_is_looked_through(driver):
    address = f"ros2:/camera/depth/image_rect_raw?domain={DOMAIN}&local=1&timeout=60"
    read = read_live(address, RecordingChoices(rgb="/camera/color/image_raw"))
    view = picture([CUP])
    assert len(read.views) == 1 and np.allclose(read.views[0].pose, view.pose)
    assert (read.views[0].rgb == view.rgb).all()
    assert np.linalg.norm(perceive(read.views).scene.objects[0].position - CUP.position) < 0.02


def test_nobody_publishes():
    with pytest.raises(LinkError, match="nobody publishes /depth"):
        read_live(f"ros2:/depth?domain={DOMAIN + 1}&local=1&timeout=0.3")
