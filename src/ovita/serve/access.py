"""What clients may reach: folders, robots, places and amounts, by the rules of whoever starts the server."""

from __future__ import annotations

import hmac
import secrets
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from ovita.errors import FormatError, OvitaError, RequestError
from ovita.io.files import Journal, is_address, is_bag, state_folder
from ovita.paths.robot import PRESETS, Robot, preset_name
from ovita.text import clean_text, shortened

SHORTEST_TOKEN = 16
"""Fewest characters of a token."""

MAX_ENTRIES = 1_000
"""Most files that a folder of pictures may hold."""

Transport = Literal["stdio", "http", "rest"]


class NotAllowed(OvitaError):
    """The operator's rules forbid what was asked."""


class TooManyRequests(OvitaError):
    """A client asks more often than the operator allows.

    Args:
        wait: How long to pause [s].
        first: Whether the last call was still allowed.
    """

    def __init__(self, wait: float, first: bool) -> None:
        self.wait, self.first = wait, first
        super().__init__(f"too many requests; wait {wait:.0f} s and ask again")


class Unanswered(Exception):
    """A person has to be asked before the call can go on; the client brings the answer with its next try."""

    def __init__(self, question: str, about: str) -> None:
        self.question, self.about = question, about
        super().__init__(question)


class ServeUnsafe(OvitaError):
    """The requested server settings would give strangers access."""


@dataclass(frozen=True)
class AccessRules:
    """What clients may reach, and how much; whatever is not named is refused.

    Args:
        folders: From which files are read, with those below them.
        outputs: Into which files are saved, with those below them.
        robots: Whose limits may be chosen, by name.
        places: Exactly where results may be sent.
        waypoints: Longest trajectory.
        tasks: Most open tasks of one owner.
        idle: After how long without a call a task is closed [s].
        file_bytes: Largest file that is read.
        request_bytes: Largest request.
        rate: Most calls of one owner in a minute.
        seconds: Longest trajectory that is simulated [s].
    """

    folders: tuple[Path, ...] = ()
    outputs: tuple[Path, ...] = ()
    robots: Mapping[str, Robot] = field(default_factory=lambda: dict(PRESETS))
    places: tuple[str, ...] = ()
    waypoints: int = 20_000
    tasks: int = 100
    idle: float = 86_400.0
    file_bytes: int = 64 * 1024 * 1024
    request_bytes: int = 4 * 1024 * 1024
    rate: int = 240
    seconds: float = 600.0

    def file(self, name: str) -> str:
        """The real path of a file that may be read.

        Raises:
            NotAllowed: If it is outside of the folders, links resolved, or too large.
        """
        path = self._inside(name, self.folders, "--folder")
        if not path.is_file():
            raise FormatError(name, "there is no such file in the allowed folders")
        if path.stat().st_size > self.file_bytes:
            raise NotAllowed(f"{name}: the file is larger than {self.file_bytes / 2**20:.3g} MB, the most allowed here")
        return str(path)

    def picture(self, name: str) -> str:
        """The real path of a picture, or of a folder with pictures whose every file is inside the allowed folders.

        Raises:
            NotAllowed: As `file` does; also for bags, whose files may name others.
        """
        path = self._inside(name, self.folders, "--folder")
        if not path.is_dir():
            return self.file(name)
        if is_bag(path):
            raise NotAllowed(f"{name}: folders of bags are not opened here; name a .mcap or .db3 file")
        for count, entry in enumerate(path.rglob("*")):
            if count >= MAX_ENTRIES:
                raise NotAllowed(f"{name}: a folder of pictures holds at most {MAX_ENTRIES} files")
            if not _within(entry.resolve(), self.folders):
                raise NotAllowed(f"{name}: {entry.name} leads out of the allowed folders")
        return str(path)

    def output(self, name: str) -> str:
        """The real path of a file that may be written; never one that exists.

        Raises:
            NotAllowed: If it is outside of the folders, links resolved, or it exists.
        """
        path = self._inside(name, self.outputs, "--save-to")
        if path.exists():
            raise NotAllowed(f"{name}: there is such a file already, and none is overwritten; choose another name")
        if not path.parent.is_dir():
            raise FormatError(name, "its folder does not exist; save to one that does")
        return str(path)

    def robot(self, name: str | None) -> Robot:
        """The robot of a name; without one, the only one that is allowed, else none.

        Raises:
            NotAllowed: If it is not among the allowed ones, or a choice has to be made.
        """
        if not name:
            only = next(iter(self.robots)) if len(self.robots) == 1 else "none"
            if only not in self.robots:
                raise NotAllowed(f"name the robot: {', '.join(self.robots)}")
            return self.robots[only]
        for key in (name, preset_name(name)):
            if key in self.robots:
                return self.robots[key]
        raise NotAllowed(f"the robot {shortened(name)} is not allowed here; allowed are {', '.join(self.robots)}")

    def place(self, name: str) -> str:
        """Where a result may be sent.

        Raises:
            NotAllowed: If nothing may be sent, or not there.
        """
        if not self.places:
            raise NotAllowed("nothing is sent from here: the server was started without --allow-send")
        if name not in self.places:
            raise NotAllowed(f"{shortened(name)} is not a place to send to; allowed are {', '.join(self.places)}")
        return name

    def _inside(self, name: str, folders: Sequence[Path], option: str) -> Path:
        if not folders:
            raise NotAllowed(f"files are out of reach: the server was started without {option}")
        try:
            nameless = is_address(name) or "\0" in name or not name.strip()
            real = [] if nameless else [(folder / name).resolve() for folder in folders]
        except (OSError, RuntimeError, ValueError):
            real = []
        if not real:
            raise NotAllowed(f"{shortened(name)} names no file")
        inside = [path for path in real if _within(path, folders)]
        if not inside:
            raise NotAllowed(f"{shortened(name)} is outside of the allowed folders")
        return next((path for path in inside if path.exists()), inside[0])


def _within(path: Path, folders: Sequence[Path]) -> bool:
    return any(path.is_relative_to(folder.resolve()) for folder in folders)


class RateLimiter:
    """A bucket of calls for each owner that fills up evenly.

    Args:
        rate: Calls in a minute; as many may come at once.
        clock: Seconds that only grow.
    """

    def __init__(self, rate: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._rate, self._clock = rate, clock
        self._lock = threading.Lock()
        self._buckets: dict[str, tuple[float, float]] = {}
        self._empty: set[str] = set()

    def take(self, owner: str) -> None:
        """Take one call.

        Raises:
            TooManyRequests: If none is left.
        """
        with self._lock:
            now = self._clock()
            left, then = self._buckets.get(owner, (float(self._rate), now))
            left = min(left + (now - then) * self._rate / 60.0, float(self._rate))
            if left < 1.0:
                self._buckets[owner] = left, now
                first = owner not in self._empty
                self._empty.add(owner)
                raise TooManyRequests(max((1.0 - left) * 60.0 / self._rate, 1.0), first)
            self._empty.discard(owner)
            self._buckets[owner] = left - 1.0, now


@dataclass(frozen=True)
class BearerTokens:
    """The tokens that let clients in, by the name of their owner.

    Raises:
        ServeUnsafe: If there is none, or one is too short.
    """

    owners: Mapping[str, str]

    def __post_init__(self) -> None:
        if not self.owners:
            raise ServeUnsafe("a server needs a token: --token auto makes one")
        for owner, token in self.owners.items():
            if len(token) < SHORTEST_TOKEN or not token.isascii() or not token.isprintable() or " " in token:
                raise ServeUnsafe(f"the token of {owner} needs {SHORTEST_TOKEN} or more characters without spaces")
            if not owner.replace("-", "").isalnum() or not owner.isascii() or len(owner) > 40:
                raise ServeUnsafe(f"{shortened(owner)} is no name of a token's owner; use up to 40 letters and digits")

    @classmethod
    def parse(cls, given: Sequence[str]) -> tuple[BearerTokens, dict[str, str]]:
        """The tokens as they are given, `TOKEN` or `OWNER=TOKEN`, and those made for "auto"."""
        owners: dict[str, str] = {}
        made: dict[str, str] = {}
        for text in given or ("auto",):
            owner, equals, token = text.partition("=")
            owner, token = (owner, token) if equals else ("default", owner)
            if token == "auto":
                token = made[owner] = secrets.token_urlsafe(24)
            if owner in owners:
                raise ServeUnsafe(f"two tokens belong to {owner}; name each: --token OWNER=TOKEN")
            owners[owner] = token
        return cls(owners), made

    def owner(self, header: str) -> str | None:
        """Whose token an Authorization header bears, or None; how long it takes tells nothing about the tokens."""
        scheme, _, given = header.partition(" ")
        brought = given.strip().encode("utf-8", "surrogateescape")
        matches = [name for name, token in self.owners.items() if hmac.compare_digest(brought, token.encode())]
        return matches[0] if matches and scheme.lower() == "bearer" else None


@dataclass(frozen=True)
class HostNames:
    """The names that a server answers to, so that no web page can lead a browser to it.

    Args:
        names: In lower case, without ports.
    """

    names: frozenset[str]

    def refusal(self, host: str, origin: str | None) -> str:
        """Why a request with these headers is refused, or ""."""
        if _name_of(host) not in self.names:
            return "this server does not answer to this name; allow it with --name"
        if origin is not None and origin.lower().partition("://")[2] != host.lower():
            return "this request comes from another page"
        return ""


def _name_of(host: str) -> str:
    name = host.lower()
    return name.partition("]")[0] + "]" if name.startswith("[") else name.partition(":")[0]


def one_line(text: str, limit: int) -> str:
    """Text that cannot pose as a line of its own, cut to a length."""
    return " ".join(clean_text(text, limit).split())


class AuditLog:
    """What every client did, one JSON object a line; no tokens, no instructions, no scenes.

    Args:
        path: Of the file; its folder is made if need be.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()

    def add(self, event: Mapping[str, Any]) -> None:
        """Write one event with its time (UTC); it is on disk when this returns.

        Raises:
            FormatError: If it cannot be written; nothing is done for a client then.
        """
        time = datetime.now(UTC).isoformat(timespec="milliseconds")
        lines = {key: one_line(value, 200) if isinstance(value, str) else value for key, value in event.items()}
        with self._lock:
            self.path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
            Journal(self.path).add({"time": time, **lines})

    def __iter__(self) -> Iterator[dict[str, Any]]:
        return iter(Journal(self.path).read())


@dataclass(frozen=True)
class Caller:
    """Who asks, and over what.

    Args:
        owner: Whose token it bears; "local" over stdio.
        client: What the client calls itself; nobody checks that.
        transport: Over what.
        request: Number of the request, new for each.
        ask: Shows a person a question and returns what they answered ("accept", "decline" or "cancel"); None where the
            client cannot ask.
    """

    owner: str
    client: str
    transport: Transport
    request: str = field(default_factory=lambda: secrets.token_hex(8))
    ask: Callable[[str, str], str] | None = None

    def answer(self, question: str, about: str) -> str:
        """What a person answers.

        `about` is what exactly they agree to, as a digest, so that no answer counts for anything else.

        Raises:
            RequestError: If the client cannot ask.
        """
        if self.ask is None:
            raise RequestError(
                "this client cannot ask a person, and nothing is sent without one; use a client with MCP elicitation, "
                "or save the result and let a person run ovita send"
            )
        return self.ask(question, about)


def default_folder() -> Path:
    """Where tasks and the audit log are kept: serve in the user's state folder."""
    return state_folder() / "serve"
