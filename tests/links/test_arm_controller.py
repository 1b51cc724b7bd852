"""ovita follows, is refused, aborted and cancelled by an action server of the real rclpy, as Ctrl-C would.

`make ros-judges` brings ROS 2 Kilted's and Jazzy's rclpy with control_msgs, which is on no package index and which
`judge_messages.py` builds; OVITA_ROS_JUDGES names another folder.
"""

import os
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).parent
JUDGES = Path(os.environ.get("OVITA_ROS_JUDGES", HERE.parents[1] / ".ros-judges"))


def python_of(name):
    """The Python of a distribution that has the action."""
    python = JUDGES / name / "bin" / "python"
    if not list((JUDGES / name).glob("lib/python3*/site-packages/control_msgs")):
        pytest.skip(f"there is no rclpy of {name} with control_msgs in {JUDGES}; make ros-judges")
    return python


def run(python, part, what):
    command = [str(python), str(HERE / "arm_controller.py"), part, what]
    env = {**os.environ, "PYTHONPATH": str(HERE.parents[1] / "src"), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    return subprocess.Popen(command, env=env, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True)


@pytest.mark.parametrize("name", ["kilted", "jazzy"])
@pytest.mark.parametrize(
    ("what", "said"),
    [
        ("succeed", "sent True"),
        ("reject", "the controller rejected the goal"),
        ("abort", "was aborted: path tolerance violated: the arm strayed from the trajectory and was stopped (b lags)"),
        ("wait", "cancelled by Ctrl-C; the controller confirmed it and holds the arm where it is"),
    ],
)
def test_a_controller_of_the_real_rclpy(name, what, said):
    python = python_of(name)
    with run(python, "server", what) as server:
        try:
            assert "ready" in server.stdout.readline()
            with run(python, "client", what) as client:
                heard, _ = client.communicate(timeout=90)
            assert "state [('a', 0.25), ('b', 0.5)]" in heard and said in heard
            assert what == "reject" or "told 1.0 of 1.0 s, off by at most 0.0020 rad (b)" in heard
            assert what == "reject" or "points 2 ['a', 'b'] 2" in server.stdout.readline()
        finally:
            server.kill()
