"""`ovita send` as a process of its own, before a simulated vehicle, while things go wrong."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from flown import Copter

from ovita.chain import adapt
from ovita.paths.robot import Box, Robot
from ovita.paths.scene import Scene
from ovita.paths.trajectory import Trajectory
from ovita.request import Request

ROOM = Robot("room", Box((-3, -3, 0), (3, 3, 3)), max_speed=2.0, max_acceleration=4.0)
PATH = Trajectory([[0, 0, 1], [0, 0.3, 1], [0, 0.6, 1], [0, 0.9, 1]], [0.0, 0.6, 0.6, 0.0])


def _fails_safe(text):
    def happen(copter, process):
        copter.say_text(2, text)
        copter._become("land" if "battery" in text else "hold")

    return happen


def _signals(*numbers):
    def happen(copter, process):
        for number in numbers:
            process.send_signal(number)
            time.sleep(0.2)

    return happen


def _cut_off(copter, process):
    copter.loss = 1.0


CASES = {
    "nothing goes wrong": ({}, None),
    "20 % lost, some overtake others": ({"loss": 0.2, "jitter": 0.15}, None),
    "the sender is killed (SIGKILL)": ({}, _signals(signal.SIGKILL)),
    "Ctrl-C": ({}, _signals(signal.SIGINT)),
    "Ctrl-C twice, link cut": ({}, lambda c, p: (_cut_off(c, p), _signals(signal.SIGINT, signal.SIGINT)(c, p))),
    "the link is cut": ({}, _cut_off),
    "the mode is refused": ({"deaf": {176}}, None),
    "arming is refused": ({"deaf": {400}}, None),
    "low battery, it lands": ({}, _fails_safe("Low battery")),
    "beyond its own fence, it holds": ({}, _fails_safe("Geofence breached")),
}


@dataclass
class Walk:
    """How one case went."""

    case: str
    code: int
    said: str
    copter: Copter

    @property
    def sentence(self):
        """What a person reads at the end."""
        return self.said.strip().splitlines()[-1] if self.said.strip() else ""

    @property
    def state(self):
        """The vehicle's mode, and whether it moves."""
        return f"{self.copter.state}, {'moving' if np.linalg.norm(self.copter.velocity) > 0 else 'still'}"


def made(folder):
    """The file of a result that is short to fly."""
    file = f"{folder}/r.json"
    adapt(Request("go slower", PATH, Scene(), ROOM), writer="builtin").save(file)
    return file


@contextmanager
def served(copter):
    """A vehicle that answers over UDP; where setpoints for it go."""
    stop, copter.beats = threading.Event(), 10
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        thread = threading.Thread(target=copter.serve, args=(link, stop), daemon=True)
        thread.start()
        try:
            yield f"mavlink:udpout:127.0.0.1:{link.getsockname()[1]}?type=setpoints"
        finally:
            stop.set()
            thread.join(5)


def walk(case, file, *, px4=True, seed=0):
    """Send a result as a process, let the case happen 0.5 s after the vehicle flies, and look where it ends."""
    about, happens = CASES[case]
    copter = Copter(armed=False, px4=px4, seed=seed, **about)
    with served(copter) as place:
        command = [sys.executable, "-m", "ovita", "send", file, "--to", place, "--yes", "--log", f"{file}.{seed}.log"]
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=environment
        )
        try:
            while happens and process.poll() is None and not (copter.state == "fly" and copter.armed):
                time.sleep(0.02)
            if happens:
                time.sleep(0.5)
                happens(copter, process)
            said = process.communicate(timeout=60)[0]
            copter.loss = 0.0
            time.sleep(1.5 if px4 else 3.5)
        finally:
            process.kill()
    return Walk(case, process.returncode, said, copter)
