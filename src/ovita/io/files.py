"""Reading text from disk with every check made first, and writing it so that no half-written file is ever left."""

from __future__ import annotations

import contextlib
import json
import mmap
import os
import secrets
import stat
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from ovita.errors import FormatError, RequestError, RobotError, SceneError, TrajectoryError

MAX_BYTES = 256 * 1024 * 1024
"""Largest file that is read [bytes]."""

BUSES = ("ros2", "mavlink")
"""What the addresses of live links begin with."""

BAGS = (".mcap", ".db3", ".bag")
"""Endings of bag files; the last is ROS 1."""

DATA_SET_INFO = ("meta", "info.json")
"""What every LeRobot data set has, below its folder."""


def is_bag(path: str | os.PathLike[str]) -> bool:
    """Whether a path has a bag's file extension or is a bag folder."""
    return suffix(path) in BAGS or os.path.isfile(os.path.join(path, "metadata.yaml"))


def is_data_set(path: str | os.PathLike[str]) -> bool:
    """Whether a path is the folder of a LeRobot data set."""
    return os.path.isfile(os.path.join(path, *DATA_SET_INFO))


def is_address(text: str) -> bool:
    """Whether a text is a link address rather than a file name."""
    return text.partition(":")[0] in BUSES


def file_name(path: str | os.PathLike[str]) -> str:
    """The path as text that can always be printed: bytes that are not UTF-8 are replaced."""
    return os.fspath(path).encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def state_folder() -> Path:
    """Where ovita keeps what a person did: ~/.local/state/ovita on Linux, or as XDG_STATE_HOME says."""
    state = os.environ.get("XDG_STATE_HOME", "").strip()
    return (Path(state) if state else Path.home() / ".local" / "state") / "ovita"


def make_folder(path: str | os.PathLike[str], remedy: str = "", mode: int = 0o777) -> Path:
    """Make a folder, and those above it, where they are missing."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True, mode=mode)
    except OSError as error:
        raise FormatError(file_name(path), f"cannot be made a folder: {reason(error)}{remedy}") from None
    return Path(path)


def examine(path: str | os.PathLike[str]) -> None:
    """Check that a path is a regular file of at most `MAX_BYTES`, without reading it."""
    file = file_name(path)
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise FormatError(file, "there is no such file") from None
    except (OSError, ValueError) as error:
        raise FormatError(file, f"cannot be opened: {reason(error)}") from None
    if stat.S_ISDIR(status.st_mode):
        raise FormatError(file, "this is a folder; name a file in it")
    if not stat.S_ISREG(status.st_mode):
        raise FormatError(file, "this is a device or a pipe; copy its content to a regular file first")
    _check_size(file, status.st_size)


def read_text(path: str | os.PathLike[str]) -> str:
    """Read a UTF-8 text file of at most `MAX_BYTES`, with or without a byte order mark."""
    examine(path)
    file = file_name(path)
    try:
        with open(path, "rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except PermissionError:
        raise FormatError(file, "no permission to read this file; change its access rights") from None
    except (OSError, MemoryError) as error:
        raise FormatError(file, f"cannot be read: {reason(error)}") from None
    _check_size(file, len(data))
    return decode(data, file)


def decode(data: bytes, file: str) -> str:
    """Decode the content of a file as UTF-8 text."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        where = f"byte 0x{data[error.start]:02x} at offset {error.start}"
        raise FormatError(file, f"this is not UTF-8 text ({where}); save it as UTF-8") from None
    if not text.strip():
        raise FormatError(file, "the file is empty")
    return text


def atomic_write(path: str | os.PathLike[str], data: str | bytes) -> None:
    """Replace a file's content in one step, so that a reader sees the old content or the new, never a part.

    The data go to a temporary file in the same folder that then takes the place of `path`. An existing file keeps
    its access rights, a symbolic link stays a link; a device such as /dev/stdout is written to directly.

    Raises:
        FormatError: If the folder is missing or not writable, the path is a folder or write-protected, or the disk
            refuses the data; the old content is then unchanged.
    """
    file = file_name(path)
    try:
        content = data.encode("utf-8") if isinstance(data, str) else data
    except UnicodeEncodeError as error:
        raise FormatError(file, f"the text to write is not valid Unicode ({error.reason})") from None
    try:
        mode = _target_mode(path, file)
        if mode is not None and not stat.S_ISREG(mode):
            with open(path, "wb") as stream:
                stream.write(content)
            return
        _replace(os.path.realpath(path), content, None if mode is None else stat.S_IMODE(mode))
    except (FileNotFoundError, NotADirectoryError):
        folder = file_name(os.path.dirname(os.path.abspath(path)))
        if os.path.isdir(folder):
            raise FormatError(file, "no file can be made here; choose another folder") from None
        raise FormatError(file, f"the folder {folder} does not exist; create it first") from None
    except PermissionError:
        raise FormatError(file, "no permission to write here; choose another folder") from None
    except (OSError, ValueError) as error:
        raise FormatError(file, f"cannot be written: {reason(error)}") from None


@contextlib.contextmanager
def errors_of(path: str | os.PathLike[str]) -> Iterator[None]:
    """Turn an error about a trajectory, scene or robot inside the block into one that names the file as well."""
    try:
        yield
    except (TrajectoryError, SceneError) as error:
        raise FormatError(file_name(path), error.problem, key=error.key, index=error.index) from None
    except (RequestError, RobotError) as error:
        raise FormatError(file_name(path), str(error)) from None


@contextlib.contextmanager
def system_errors(path: str | os.PathLike[str], done: str) -> Iterator[None]:
    """Turn an error of the operating system inside the block into one that says what cannot be done to the file."""
    try:
        yield
    except OSError as error:
        raise FormatError(file_name(path), f"cannot be {done}: {reason(error)}") from None


def suffix(path: str | os.PathLike[str]) -> str:
    """The ending of a file name in lower case, such as ".json"."""
    return Path(path).suffix.lower()


def _check_size(file: str, size: int) -> None:
    if size > MAX_BYTES:
        most = f"ovita reads up to {MAX_BYTES // 2**20} MB"
        raise FormatError(file, f"the file is too large ({size / 2**20:.0f} MB); {most}")


def _target_mode(path: str | os.PathLike[str], file: str) -> int | None:
    """Mode bits of what `path` names now, or None if there is nothing yet."""
    try:
        mode = os.stat(path).st_mode
    except FileNotFoundError:
        return None
    if stat.S_ISDIR(mode):
        raise FormatError(file, "this is a folder; name a file in it")
    if not os.access(path, os.W_OK):
        raise FormatError(file, "this file is write-protected; choose another name or change its access rights")
    return mode


UNFINISHED = ".ovita-"
"""How the name of a file begins that is not written to its end yet."""


def _replace(target: str, content: bytes, mode: int | None) -> None:
    folder = os.path.dirname(target)
    temporary = os.path.join(folder, f"{UNFINISHED}{secrets.token_hex(8)}.tmp")
    # os.open with 0o666 obeys the umask, as a plain open() does; tempfile would leave 0o600.
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        if mode is not None:
            os.chmod(temporary, mode)
        os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
    # Makes the new name survive a power cut; some systems cannot open a folder, and then there is nothing to do.
    with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
        handle = os.open(folder, os.O_RDONLY)
        stack.callback(os.close, handle)
        os.fsync(handle)


def remove_unfinished(folder: Path) -> None:
    """Remove what killed writers left in a folder where nobody writes any more."""
    for path in folder.rglob(f"{UNFINISHED}*.tmp"):
        path.unlink(missing_ok=True)


def reason(error: BaseException) -> str:
    """What the operating system says, as a part of a sentence."""
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return text[:1].lower() + text[1:] if text else type(error).__name__


class Journal:
    """An append-only file of events, made when the first one is added; its folder must exist."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)

    def add(self, event: Mapping[str, Any]) -> None:
        """Write one event; it is on disk when this returns."""
        line = self._line(event)
        with system_errors(self.path, "written"), os.fdopen(self._open(), "rb+") as stream:
            stream.seek(_whole(stream))
            stream.truncate()
            stream.write(line.encode("ascii"))
            stream.flush()
            os.fsync(stream.fileno())

    def rewrite(self, events: Iterable[Mapping[str, Any]]) -> None:
        """Put these events in the place of all there are, in one step."""
        content = "".join(map(self._line, events))
        os.close(self._open())  # so that a new file, too, is for its owner's eyes only
        atomic_write(self.path, content)

    def read(self) -> list[dict[str, Any]]:
        """All events, oldest first; an incomplete last line is skipped."""
        examine(self.path)
        with system_errors(self.path, "read"):
            lines = self.path.read_bytes().split(b"\n")
        events = []
        for number, line in enumerate(lines[:-1]):
            try:
                event = json.loads(line)
            except (ValueError, RecursionError):
                event = None
            if not isinstance(event, dict):
                raise FormatError(file_name(self.path), f"line {number + 1} is not an event; the journal is damaged")
            events.append(event)
        return events

    def _open(self) -> int:
        with system_errors(self.path, "written"):
            return os.open(self.path, os.O_RDWR | os.O_CREAT, 0o600)

    def _line(self, event: Mapping[str, Any]) -> str:
        try:
            return json.dumps(event, ensure_ascii=True, allow_nan=False, separators=(",", ":")) + "\n"
        except (TypeError, ValueError) as error:
            raise FormatError(file_name(self.path), f"cannot be written as JSON: {error}") from None


def _whole(stream: Any) -> int:
    """Length of the part that consists of finished lines [bytes]."""
    if not stream.seek(0, os.SEEK_END):
        return 0
    with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as content:
        return content.rfind(b"\n") + 1
