"""Staging hostile policies: what they are given to attack, and what is looked at afterwards."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import tempfile
import textwrap
import time
from pathlib import Path
from typing import Any

import numpy as np

from adversarial import bombs, escapes, files, network, numpy_doors, processes
from ovita.errors import OvitaError
from ovita.paths.scene import Scene, SceneObject
from ovita.paths.trajectory import Trajectory
from ovita.policy import Policy
from ovita.policy.processes import POOL
from ovita.policy.sandbox import Rollout, SandboxLimits, _run

VARIABLE = "OVITA_TEST_SECRET"
NAME = "REACHED-7f3a"
"""What a policy raises to say that it got where the kernel must not let it."""

INSIDE = "INSIDE-92c1"
"""What a policy raises to say that it got where the allowlist must not let it; harmless behind the kernel's locks."""

LIMITS = SandboxLimits(wall_s=0.3, memory_mb=256)

PROBE = Policy(
    "def adapt(traj, scene):\n"
    "    cup = scene['cup']\n"
    "    t = scale_speed(move(traj, left=0.1 * math.sin(0.5)), 0.5, where=near(traj, cup, within=0.3))\n"
    "    t[:, 2] += np.linspace(0.0, 0.1, len(t)) * np.pi + np.random.default_rng().normal() * 0.5\n"
    "    t[:, 1] += float(sum(o['x'] for o in detect_objects())) + len(get_trajectory()) + np.asarray([0.5]).sum()\n"
    "    print(len(scene.names), np.array([1 / 3]))\n"
    "    return t\n"
)


def policies() -> dict[str, str]:
    """All hostile policies: name to source with placeholders."""
    sources = {f"script/{name}": source for name, source in escapes.SOURCES.items()}
    for module in (files, network, processes, escapes, numpy_doors, bombs):
        topic = module.__name__.rpartition(".")[2]
        groups = (
            ("", module.BODIES),
            ("hang_", getattr(module, "HANGS", {})),
            ("poison_", getattr(module, "POISONS", {})),
        )
        for prefix, group in groups:
            for name, body in group.items():
                source = "def adapt(traj, scene):\n" + textwrap.indent(body, "    ") + "\n    return traj\n"
                sources[f"{topic}/{prefix}{name}"] = source
    return sources


class Theatre:
    """Everything that a policy could hurt, and a look at it after each policy."""

    def __init__(self) -> None:
        self.token = "SECRET-" + os.urandom(8).hex()
        os.environ[VARIABLE] = self.token
        self.folder = Path(tempfile.mkdtemp(prefix="ovita-theatre-"))
        self.folder.chmod(0o777)
        self.secret, self.trace = self.folder / "secret", self.folder / "trace"
        self.secret.write_text(self.token)
        self.secret.chmod(0o666)
        (self.folder / "script.py").write_text(f"open({str(self.trace)!r}, 'w')")
        (self.folder / "evil_module.py").write_text(f"open({str(self.trace)!r}, 'w')")
        np.save(self.folder / "numbers.npy", np.arange(3))
        os.symlink("/" + self.token, self.folder / "link")
        self.abstract = f"ovita-theatre-{os.getpid()}"
        self.sockets = self._listen()
        self.victim = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        self.signals: list[int] = []
        self._handler = signal.signal(signal.SIGUSR1, lambda number, frame: self.signals.append(number))
        self.trajectory = Trajectory(np.linspace([0.0, 0, 0], [1.0, 0.5, 0.2], 50), np.linspace(0.1, 0.4, 50))
        self.scene = Scene((SceneObject("Cup", np.array([0.5, 0.25, 0.1])), SceneObject("box", np.array([0.9, 0, 0]))))
        self.before = self._state()
        self.probe = self._probe()

    def _listen(self) -> dict[str, socket.socket]:
        tcp = socket.create_server(("127.0.0.1", 0))
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        udp.bind(("127.0.0.1", 0))
        path, abstract = socket.socket(socket.AF_UNIX), socket.socket(socket.AF_UNIX)
        path.bind(str(self.folder / "socket"))
        (self.folder / "socket").chmod(0o777)
        abstract.bind("\0" + self.abstract)
        for server in (path, abstract):
            server.listen()
        sockets = {"tcp": tcp, "udp": udp, "unix": path, "abstract": abstract}
        for server in sockets.values():
            server.setblocking(False)
        return sockets

    def stage(self, source: str) -> str:
        """Fill in the placeholders of a policy as assignments in front of it."""
        values: dict[str, Any] = {
            "TRACE": str(self.trace), "SECRET": str(self.secret), "FOLDER": str(self.folder), "NAME": NAME,
            "INSIDE": INSIDE,
            "NPY": str(self.folder / "numbers.npy"),
            "LINK": str(self.folder / "link"), "SCRIPT": str(self.folder / "script.py"), "VARIABLE": VARIABLE,
            "PORT": self.sockets["tcp"].getsockname()[1], "UDP": self.sockets["udp"].getsockname()[1],
            "UNIX": str(self.folder / "socket"), "ABSTRACT": self.abstract, "PARENT": os.getpid(),
            "VICTIM": self.victim.pid, "WORKERS": POOL.pids(),
        }  # fmt: skip
        used = {name: value for name, value in values.items() if name in source}
        return "".join(f"{name} = {value!r}\n" for name, value in used.items()) + source

    def play(self, source: str, *, checked: bool, **options: Any) -> tuple[Rollout | OvitaError, list[str]]:
        """Run a hostile policy; what came of it, and every escape that was seen."""
        started = time.monotonic()
        outcome: Rollout | OvitaError
        try:
            options = {"limits": LIMITS, **options}
            outcome = _run(Policy(self.stage(source)), self.trajectory, self.scene, checked=checked, **options)
        except OvitaError as error:
            outcome = error
        seen = self._inspect(outcome, (self.token, NAME, INSIDE) if checked else (self.token, NAME))
        if time.monotonic() - started > LIMITS.wall_s + 4.0:
            seen.append("hung")
        return outcome, seen

    def _inspect(self, outcome: Rollout | OvitaError, forbidden: tuple[str, ...]) -> list[str]:
        seen = []
        state = self._state()
        if state != self.before:
            seen.append(f"files changed: {state ^ self.before}")
            self._restore()
        for name, server in self.sockets.items():
            if _was_hit(server):
                seen.append(f"{name} was reached")
        if self.victim.poll() is not None:
            seen.append("the victim died")
            self.victim = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
        if self.signals:
            seen.append("this process was signalled")
            self.signals.clear()
        text = _text_of(outcome)
        seen += [f"{what!r} came back" for what in forbidden if what in text]
        if any((ord(c) < 32 and c not in "\n\t") or c in "\x7f\x9b\u202e" for c in text):
            seen.append("control characters came back")
        if len(text) > 40_000:
            seen.append("a flood came back")
        if isinstance(outcome, Rollout) and not np.isfinite(outcome.trajectory.to_array()).all():
            seen.append("numbers that are not finite came back")
        return seen

    def aftermath(self) -> list[str]:
        """What is left of earlier policies: changed results of a later one, and processes."""
        seen = []
        if self._probe() != self.probe:
            seen.append("a later policy was poisoned")
        workers = set(POOL.pids())
        for _ in range(400):
            strangers = [pid for pid in _descendants(workers) if pid not in workers]
            if len(strangers) <= len(workers):  # each worker keeps one child ready
                break
            time.sleep(0.005)
        else:
            seen.append(f"processes are left over: {strangers}")
        return seen

    def _probe(self) -> tuple[bytes, str]:
        rollout = _run(PROBE, self.trajectory, self.scene)
        return rollout.trajectory.to_array().tobytes(), rollout.prints

    def _state(self) -> frozenset[tuple[str, ...]]:
        entries = sorted(self.folder.iterdir())
        facts = [(e.name, oct(e.lstat().st_mode), str(e.lstat().st_size), str(e.lstat().st_mtime_ns)) for e in entries]
        evil = [p for p in ("/dev/shm/ovita_evil",) if os.path.exists(p)]
        return frozenset([*facts, *((e,) for e in evil)])

    def _restore(self) -> None:
        for entry in self.folder.iterdir():
            if entry.name.startswith("trace") or entry.name.startswith("tmp"):
                entry.rmdir() if entry.is_dir() and not entry.is_symlink() else entry.unlink()
        self.secret.unlink(missing_ok=True)
        self.secret.write_text(self.token)
        self.secret.chmod(0o666)
        self.before = self._state()

    def close(self) -> None:
        """Take everything down."""
        signal.signal(signal.SIGUSR1, self._handler)
        self.victim.kill()
        self.victim.wait()
        for server in self.sockets.values():
            server.close()
        for entry in self.folder.iterdir():
            entry.unlink()
        self.folder.rmdir()
        os.environ.pop(VARIABLE, None)


def _was_hit(server: socket.socket) -> bool:
    try:
        if server.type == socket.SOCK_DGRAM:
            server.recv(10)
        else:
            server.accept()[0].close()
    except BlockingIOError:
        return False
    return True


def _text_of(outcome: Rollout | OvitaError) -> str:
    if isinstance(outcome, OvitaError):
        return str(outcome)
    rows = outcome.trajectory.to_array()
    digits = "".join(chr(int(v)) for v in rows.ravel() if 32 <= v < 127)
    return "".join(
        [outcome.prints, digits, *outcome.contacts, *(e.text + str(e.arguments) for e in outcome.expectations)]
    )


def _descendants(roots: set[int]) -> list[int]:
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(entry.name)] = int(fields[1])
    found = set(roots)
    while more := {pid for pid, parent in parents.items() if parent in found} - found:
        found |= more
    return sorted(found)
