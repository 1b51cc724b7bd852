"""ovita against real ROS 2: every message type, distribution and direction, and a soak of the node.

make ros-judges; python benchmarks/ros.py [--soak 1000] [--kills 20]; OVITA_ROS_JUDGES names another folder
"""

import argparse
import json
import os
import random
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

from ovita.errors import OvitaError
from ovita.io import open_task
from ovita.io.bags import JOINT_PLANS
from ovita.io.bus import joined, wait
from ovita.io.links import Address, deliver, deliver_joints
from ovita.io.messages import JOINTS, TYPES, JointMotion, build
from ovita.io.ros2 import receive_joints
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory

ROOT = Path(__file__).parents[1]
JUDGE = ROOT / "tests" / "links" / "judge.py"
JUDGES = Path(os.environ.get("OVITA_ROS_JUDGES", ROOT / ".ros-judges"))
KINDS = {name: kind for kind, name in TYPES.items()}
STATES = "sensor_msgs/msg/JointState"
BOTH = [*TYPES.values(), JOINTS]
JOINT_KINDS = (*JOINT_PLANS, STATES)
HEARD = [
    *JOINT_PLANS[1:],
    "nav_msgs/msg/Odometry",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/PointStamped",
    "geometry_msgs/msg/TransformStamped",
    STATES,
]
PATH = Trajectory([[0, 0, 0], [1, 0, 0], [2, 1, 0]], [0.5, 0.5, 0.5])
MOTION = JointMotion(("a", "b"), [[0, 0], [0.1, 0.2]], [0, 1])
STRING = "std_msgs/msg/String"
TURNS = 20
"""Instructions about one path, then comes the next."""


def started(python, *words):
    process = subprocess.Popen(
        [str(python), str(JUDGE), *map(str, words)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    process.stdout.readline()
    return process


def ovita(own, what, kind, domain):
    """What ovita says to "hear" or "tell" in a process of its own, over DDS or on a distribution's rclpy."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "OPENBLAS_NUM_THREADS": "1"}
    command = [str(own), __file__, "--one", what, kind, str(domain)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=90, env=environment)
    return done.stdout.strip() or f"no: {done.stderr.strip()[-200:]}"


def one(what, kind, domain):
    """Hear or tell one message, here; "yes", or why not."""
    try:
        if what == "hear":
            address = f"ros2:/x?domain={domain}&local=1&timeout=15&for=1"
            receive_joints(Address.parse(address)) if kind in JOINT_KINDS else open_task(address)
        elif kind == JOINTS:
            deliver_joints(f"ros2:/y?domain={domain}&local=1&timeout=15", MOTION)
        else:
            deliver(f"ros2:/y?domain={domain}&local=1&timeout=15&type={KINDS[kind]}", PATH, Scene())
        return "yes"
    except OvitaError as error:
        return f"no: {error}"


def heard(python, own, kind, quality, domain):
    """Whether ovita hears what a node says."""
    process = started(python, "say", kind, "/x", domain, quality)
    try:
        return ovita(own, "hear", kind, domain)
    finally:
        process.kill()
        process.communicate()


def told(python, own, kind, domain):
    """Whether a node hears what ovita says."""
    process = started(python, "hear", kind, "/y", domain)
    try:
        said = ovita(own, "tell", kind, domain)
        (message,) = json.loads(process.communicate(timeout=15)[0])
        return said if message.get("poses") or message.get("points") else "no: empty"
    except subprocess.TimeoutExpired:
        return f"{said}, but nothing was heard"
    finally:
        process.kill()
        process.communicate()


def serving(python, domain):
    """`ovita ros serve` in a process of its own, once it serves."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT / "src"), "OPENBLAS_NUM_THREADS": "1"}
    options = ["--domain", str(domain), "--local", "--writer", "builtin"]
    node = subprocess.Popen(
        [str(python), "-m", "ovita", "ros", "serve", *options],
        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment,
    )  # fmt: skip
    assert "serving" in node.stdout.readline()
    return node


def topics(bus):
    """The node's topics: what it is given, a path and words, and what it says, statuses and adapted paths."""
    return (
        bus.publisher("/ovita/path", TYPES["path"]),
        bus.publisher("/ovita/instruction", STRING, latched=False),
        bus.subscribe("/ovita/status", STRING, [(True, False)]),
        bus.subscribe("/ovita/adapted", TYPES["path"], [(True, False)]),
    )


def killed(count, kills, domain, python=sys.executable, seed=0):
    """Instructions to a node that is killed at random moments and started anew; what was lost, and what came twice.

    What had no answer when the node died is asked again; nothing else is.
    """
    rng = random.Random(seed)
    fatal = set(rng.sample(range(count), kills))
    node, came, paths, again = serving(python, domain), Counter(), [], 0
    try:
        with joined(Address.parse(f"ros2:/ovita?domain={domain}&local=1")) as bus:
            path, words, statuses, adapted = topics(bus)

            def answered(what, seconds):
                """Wait for a status; keep every answer and path that comes."""
                seen = []

                def look():
                    paths.extend(len(message.poses) for message in adapted())
                    news = [json.loads(message.data) for message in statuses()]
                    came.update(status["id"] for status in news if "id" in status)
                    seen.extend(status.get("id", status["status"]) for status in news)
                    return what in seen

                return wait(look, seconds, bus.rest)

            def begun():
                line = Trajectory([[0.1 * i, 0, 0] for i in range(20)], [0.5] * 20)
                for _ in range(30):
                    path.write(build("path", line, bus.maker, start=time.time_ns())[0])
                    if answered("ready", 2.0) and words.matched():
                        return

            begun()
            for i in range(count):
                said = {"id": str(i), "instruction": "go left by 0.1", "on": "original"}
                message = bus.maker.new(STRING, data=json.dumps(said))
                words.write(message)
                if i in fatal:
                    answered(None, rng.uniform(0.0, 0.3))
                    node.kill()
                    node.communicate()
                    answered(None, 0.5)
                    node = serving(python, domain)
                    begun()
                    if str(i) not in came:
                        again += 1
                        words.write(message)
                if str(i) not in came:
                    answered(str(i), 20.0)
            answered(None, 2.0)
    finally:
        node.kill()
        node.communicate()
    lost, doubled = sum(str(i) not in came for i in range(count)), sum(n - 1 for n in came.values())
    told = f"{count} instructions, killed {kills} times, {again} asked again, {sum(came.values())} answers"
    return f"{told}, {len(paths)} adapted paths, all of 20 poses: {set(paths) == {20}}, {lost} lost, {doubled} doubled"


def soak(count, domain, python=sys.executable):
    """Instructions to the node, each with a number; how many answers and paths came back, lost and doubled."""
    node = serving(python, domain)
    try:
        with joined(Address.parse(f"ros2:/ovita?domain={domain}&local=1")) as bus:
            path, words, statuses, adapted = topics(bus)
            end = time.monotonic() + 60
            while not (path.matched() and words.matched()) and time.monotonic() < end:
                bus.rest()
            time.sleep(2.0)
            line = Trajectory([[0.1 * i, 0, 0] for i in range(20)], [0.5] * 20)
            came, paths, sent, begun = Counter(), 0, 0, time.monotonic()
            ready = asked = 0
            quiet = 0.0
            while quiet < 2.0 and time.monotonic() < begun + 60 + count:
                news = [json.loads(message.data) for message in statuses()]
                ready += sum(status["status"] == "ready" for status in news)
                came.update(status["id"] for status in news if "id" in status)
                paths += len(adapted())
                behind = sent - sum(came.values())
                if sent < count and asked * TURNS <= sent and behind == 0:
                    path.write(build("path", line, bus.maker, start=time.time_ns())[0])
                    asked += 1
                elif ready == asked and sent < min(count, asked * TURNS) and behind < 10:
                    said = {
                        "id": str(sent),
                        "instruction": f"go {'left' if sent % 2 else 'right'} by 0.1",
                        "on": "current",
                    }
                    words.write(bus.maker.new(STRING, data=json.dumps(said)))
                    words.acknowledged(1.0)
                    sent += 1
                else:
                    bus.rest()
                quiet = quiet + 0.02 if sum(came.values()) >= count else 0.0
            seconds = time.monotonic() - begun
        alive = node.poll() is None
    finally:
        node.terminate()
        node.communicate()
    lost = sum(str(i) not in came for i in range(count))
    doubled = sum(n - 1 for n in came.values()) + ready - asked
    told = f"{sent} instructions about {asked} paths, {sum(came.values())} answers, {paths} adapted paths"
    return f"{told}, {lost} lost, {doubled} doubled, {seconds:.0f} s{'' if alive else ', the node died'}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--no-table", action="store_true", help="only the soak")
    parser.add_argument("--soak", type=int, default=1000, help="instructions to send to the node; 0 for none")
    parser.add_argument("--kills", type=int, default=20, help="how often the node is killed, over 100 instructions")
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        print(one(*given.one))
        return
    distributions = [d for d in ("kilted", "jazzy") if (JUDGES / d / "bin" / "python").exists()]
    if not distributions:
        print(f"no ROS 2 in {JUDGES}; make ros-judges")
        return
    if given.soak:
        print("node over DDS:", soak(given.soak, 205), flush=True)
        for i, name in enumerate(distributions):
            print(f"node on rclpy, {name}:", soak(given.soak, 206 + i, JUDGES / name / "bin" / "python"), flush=True)
    nodes = [("DDS", sys.executable), *((f"rclpy, {d}", JUDGES / d / "bin" / "python") for d in distributions)]
    for i, (name, python) in enumerate(nodes if given.kills else ()):
        print(f"node over {name}:", killed(100, given.kills, 212 + i, python), flush=True)
    if given.no_table:
        return
    print("| message | distribution | ovita | ROS to ovita: reliable, best effort, latched | ovita to ROS |")
    print("|---|---|---|---|---|")
    domain = 100
    for kind in [*BOTH, *HEARD]:
        for name in distributions:
            python = JUDGES / name / "bin" / "python"
            for backend, own in (("DDS", sys.executable), ("rclpy", python)):
                domain += 1
                qualities = ("default", "best_effort", "latched") if kind in BOTH else ("default", "best_effort")
                ways = [heard(python, own, kind, quality, domain) for quality in qualities]
                back = told(python, own, kind, domain) if kind in BOTH else "not sent"
                print(f"| {kind} | {name} | {backend} | {', '.join(ways)} | {back} |", flush=True)


if __name__ == "__main__":
    main()
