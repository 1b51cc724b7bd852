"""A simulated multicopter that speaks MAVLink, on a clock of its own: no socket, no waiting, the same every time.

What it is sent and what it says are packed and parsed by pymavlink, and may be lost, delayed and overtaken on the way.
"""

import heapq
import random
import time

import numpy as np
from pymavlink.dialects.v20 import common as d

from ovita.io.links import Address

PX4 = {6 << 16: "fly", 4 << 16 | 3 << 24: "hold", 4 << 16 | 6 << 24: "land"}
COPTER = {4: "fly", 17: "hold", 9: "land"}
STEP = 0.02


class Copter:
    """A vehicle in the air or on the ground, as `ovita.io.mavlink.Vehicle` is one."""

    def __init__(
        self, place=(0.0, 0.0, -1.0), *, px4=True, loss=0.0, delay=0.02, jitter=0.0, seed=0, armed=True, deaf=(), kind=2
    ):
        self.address = Address.parse("mavlink:udp:127.0.0.1:14550?type=setpoints")
        self.dialect, self.system, self.component = d, 1, 1
        self.autopilot, self.kind = (12 if px4 else 3), kind
        self.place, self.velocity, self.armed = np.array(place, dtype=float), np.zeros(3), armed
        self.px4, self.state, self.reports = px4, "hold", False
        self.loss, self.delay, self.jitter, self.chance = loss, delay, jitter, random.Random(seed)
        self.deaf, self.t, self.count = set(deaf), 0.0, 0
        self.ground = d.MAVLink(None, srcSystem=255, srcComponent=190)
        self.codec = d.MAVLink(None, srcSystem=1, srcComponent=1)
        self.ear, self.station_ear = d.MAVLink(None), d.MAVLink(None)
        self.up, self.down, self.waiting = [], [], []
        self.setpoint, self.setpoint_at, self.accepted = None, -9.0, []
        self.track, self.states, self.at, self.wire = [], ["hold"], [], None
        self.wind, self.beats = np.zeros(3), 1

    # What the station sees.
    def now(self):
        return self.t

    def send(self, message):
        self._post(self.up, message.pack(self.ground))

    def wait(self, names, timeout):
        end = self.t + timeout
        while True:
            while self.waiting:
                message = self.waiting.pop(0)
                if message.get_type() in names:
                    return message
            if self.t >= end:
                return None
            self.step(min(STEP, max(end - self.t, 1e-6)))

    def serve(self, link, stop):
        """Be there in real time, behind a UDP socket that is bound, until told to stop."""
        peer, link_time, self.wire = None, time.monotonic(), []
        link.settimeout(0.005)
        while not stop.is_set():
            try:
                data, peer = link.recvfrom(65536)
                self._post(self.up, data)
            except TimeoutError:
                pass
            while self.t < time.monotonic() - link_time:
                self.step(STEP)
            while self.wire and peer and self.wire[0][0] <= self.t:
                link.sendto(heapq.heappop(self.wire)[2], peer)

    # The world.
    def run(self, seconds):
        """Go on without the station, as after it was killed."""
        end = self.t + seconds
        while self.t < end:
            self.step(STEP)

    def step(self, dt):
        before = self.t
        self.t += dt
        for event in [e for e in self.at if e[0] <= self.t]:
            self.at.remove(event)
            event[1](self)
        for message in self._arrived(self.up, self.ear):
            self._take(message)
        if self.state == "fly" and self.t - self.setpoint_at > (1.0 if self.px4 else 3.0):
            self._become("hold")
        self._move(dt)
        if int(before * self.beats) != int(self.t * self.beats):
            self._say(d.MAVLink_heartbeat_message(self.kind, self.autopilot, 1 | 128 * self.armed, self._mode(), 4, 3))
        if self.reports and int(before * 20) != int(self.t * 20):
            self._say(d.MAVLink_local_position_ned_message(int(self.t * 1e3), *self.place, *self.velocity))
        self.waiting += self._arrived(self.down, self.station_ear)

    def _move(self, dt):
        if self.state == "fly" and self.setpoint is not None and self.armed:
            place, velocity = self.setpoint
            self.velocity = velocity + np.clip(2.0 * (place - self.place), -1.0, 1.0)
        elif self.state == "land" and self.place[2] < 0:
            self.velocity = np.array([0.0, 0.0, 0.5])
        else:
            self.velocity = np.zeros(3)
        self.place = self.place + (self.velocity + self.wind) * dt
        self.track.append((self.t, *self.place))

    def _take(self, m):
        name = m.get_type()
        if name in self.deaf:
            return
        if name == "SET_POSITION_TARGET_LOCAL_NED":
            self.setpoint = np.array([m.x, m.y, m.z]), np.array([m.vx, m.vy, m.vz])
            self.setpoint_at = self.t
            self.accepted.append((m.time_boot_ms, self.state))
        elif name == "COMMAND_LONG":
            result = self._command(m)
            self._say(d.MAVLink_command_ack_message(m.command, result, 0, 0, 255, 190))

    def _command(self, m):
        if m.command in self.deaf:
            return 2
        if m.command == 511:
            self.reports = True
        elif m.command == 400:
            self.armed = bool(m.param1)
        elif m.command == 176:
            modes = PX4 if self.px4 else COPTER
            mode = modes[int(m.param2) << 16 | int(m.param3) << 24 if self.px4 else int(m.param2)]
            if self.px4 and mode == "fly" and self.t - self.setpoint_at > 0.5:
                return 1
            self._become(mode)
        return 0

    def _become(self, state):
        self.state = state
        self.states.append(state)

    def _mode(self):
        return next(number for number, state in (PX4 if self.px4 else COPTER).items() if state == self.state)

    def say_text(self, severity, text):
        self._say(d.MAVLink_statustext_message(severity, text.encode()))

    def _say(self, message):
        self._post(self.down if self.wire is None else self.wire, bytes(message.pack(self.codec)))

    def _post(self, way, data):
        if self.chance.random() >= self.loss:
            self.count += 1
            heapq.heappush(way, (self.t + self.delay + self.chance.random() * self.jitter, self.count, bytes(data)))

    def _arrived(self, way, ear):
        found = []
        while way and way[0][0] <= self.t:
            found += ear.parse_buffer(heapq.heappop(way)[2]) or []
        return found
