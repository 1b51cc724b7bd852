"""A vehicle for tests: a MAVLink mission server on loopback that loses, repeats, delays and refuses as told."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from collections.abc import Callable

from pymavlink.dialects.v20 import common as d

Fault = Callable[[str, int], int]
"""From a message's name and how often it came before, to how many copies pass: 0 loses it, 2 repeats it."""


class Responder:
    """A vehicle that speaks the mission protocol until it is closed."""

    def __init__(
        self,
        *,
        tcp=False,
        ardupilot=False,
        home=None,
        incoming: Fault = lambda name, n: 1,
        outgoing: Fault = lambda name, n: 1,
        swap=(),
        refuse=None,
        old_requests=False,
        silent=False,
        spoil=None,
        garbage=b"",
        port=0,
    ):
        self.items, self.home, self.ardupilot = [], home, ardupilot
        self.incoming, self.outgoing, self.swap = incoming, outgoing, set(swap)
        self.refuse, self.old_requests, self.silent = refuse, old_requests, silent
        self.spoil, self.garbage = spoil, garbage
        self.seen, self.sent, self.counted = {}, {}, 0
        self.tcp, self._peer, self._held, self._stop = tcp, None, None, threading.Event()
        self.codec = d.MAVLink(None, srcSystem=1, srcComponent=1)
        self.codec.robust_parsing = True
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM if tcp else socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        if tcp:
            self.socket.listen(1)
        self.port = self.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self._stop.set()
        self._thread.join(5)
        self.socket.close()

    def call(self, port):
        """Speak to a listening ground station first, as simulators do."""
        self._peer = ("127.0.0.1", port)
        return self

    def _run(self):
        link, last, receiving = self.socket, 0.0, []
        if self.tcp:
            link.settimeout(5)
            with contextlib.suppress(TimeoutError):
                link, _ = self.socket.accept()
        link.settimeout(0.01)
        self._link = link
        while not self._stop.is_set():
            if time.monotonic() - last > 0.2 and not self.silent and (self.tcp or self._peer):
                last = time.monotonic()
                autopilot = 3 if self.ardupilot else 12
                self._send(d.MAVLink_heartbeat_message(2, autopilot, 0, 0, 4, 3))
                if self.garbage:
                    self._raw(self.garbage)
            try:
                data, peer = link.recvfrom(65536)
            except (TimeoutError, OSError):
                self._release()
                continue
            if not self.tcp:
                self._peer = peer
            elif not data:
                break
            for message in self.codec.parse_buffer(data) or []:
                for _ in range(self._count(self.incoming, self.seen, message)):
                    self._answer(message, receiving)
            self._release()
        if self.tcp:
            link.close()

    def _answer(self, m, receiving):
        name = m.get_type()
        if self.silent or name == "BAD_DATA":
            return
        gcs = self._asker = m.get_srcSystem(), m.get_srcComponent()
        if name == "MISSION_COUNT":
            receiving[:] = [None] * m.count
            self.counted += 1
            self._ask(0)
        elif name == "MISSION_ITEM_INT" and m.seq < len(receiving):
            if self.refuse is not None and m.seq == self.refuse[0]:
                self._send(d.MAVLink_mission_ack_message(*gcs, self.refuse[1], 0))
                return
            receiving[m.seq] = m
            missing = next((i for i, item in enumerate(receiving) if item is None), None)
            if missing is not None:
                self._ask(missing)
                return
            self.items = list(receiving)
            if self.spoil:
                self.spoil(self.items)
            self._send(d.MAVLink_mission_ack_message(*gcs, 0, 0))
        elif name == "MISSION_REQUEST_LIST":
            self._send(d.MAVLink_mission_count_message(*gcs, len(self.items), 0))
        elif name == "MISSION_REQUEST_INT" and m.seq < len(self.items):
            i = self.items[m.seq]
            place = (i.param1, i.param2, i.param3, i.param4, i.x, i.y, i.z)
            self._send(
                d.MAVLink_mission_item_int_message(
                    *gcs, m.seq, i.frame, i.command, i.current, i.autocontinue, *place, 0
                )
            )
        elif name == "COMMAND_LONG" and m.command == 512 and self.home:
            lat, lon, alt = self.home
            where = (round(lat * 1e7), round(lon * 1e7), round(alt * 1e3))
            self._send(d.MAVLink_home_position_message(*where, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))

    def _ask(self, seq):
        kind = d.MAVLink_mission_request_message if self.old_requests else d.MAVLink_mission_request_int_message
        self._send(kind(*self._asker, seq, 0))

    def _send(self, message):
        name = message.get_type()
        key = (name, self.sent.get(name, 0))
        for _ in range(self._count(self.outgoing, self.sent, message)):
            data = message.pack(self.codec)
            if key in self.swap and self._held is None:
                self._held = data
            else:
                self._raw(data)
                self._release()

    def _release(self):
        if self._held is not None:
            held, self._held = self._held, None
            self._raw(held)

    def _raw(self, data):
        with contextlib.suppress(OSError):
            if self.tcp:
                self._link.sendall(data)
            elif self._peer:
                self.socket.sendto(data, self._peer)

    @staticmethod
    def _count(fault, tally, message):
        name = message.get_type()
        n = tally.get(name, 0)
        tally[name] = n + 1
        return 1 if name == "HEARTBEAT" else fault(name, n)
