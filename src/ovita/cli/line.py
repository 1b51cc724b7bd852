"""The line that a person types in `ovita chat`, with arrows, history and completion, and where talks are kept."""

from __future__ import annotations

import hashlib
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from ovita.dialogue.session import Session
from ovita.errors import OvitaError
from ovita.io.files import make_folder, state_folder

MOST_LINES = 1000
"""Lines of history that are kept."""

MOST_TALKS = 20
"""Talks about one file that are kept."""

Candidates = Callable[[str], Sequence[str]]
"""What the end of a line may become: given the line, whole replacements for its last word."""


def at_a_terminal() -> bool:
    """Whether a person types: only then is there a history, and every talk kept."""
    return sys.stdin.isatty()


def lines(candidates: Candidates) -> Iterator[str]:
    """The lines that are typed or piped in, without blank ones."""
    with _edited(candidates):
        while True:
            try:
                line = input("> ").strip()
            except EOFError:
                click.echo()
                return
            except KeyboardInterrupt:
                click.echo("\n/save FILE keeps the result, /quit leaves.")
                continue
            if line:
                yield line


@contextmanager
def _edited(candidates: Candidates) -> Iterator[None]:
    """Arrows, history and completion while the block runs, where there is a terminal and readline."""
    history = _prepared(candidates) if at_a_terminal() else None
    try:
        yield
    finally:
        if history is not None:
            _written(history)


def _prepared(candidates: Candidates) -> Path | None:
    """Set readline up; the file that its history goes to, if there can be one."""
    try:
        import readline
    except ImportError:
        return None

    def offer(text: str, i: int) -> str | None:
        found = candidates(readline.get_line_buffer()[: readline.get_endidx()])
        return found[i] if i < len(found) else None

    readline.set_completer(offer)
    readline.set_completer_delims(" \t")
    editline = "libedit" in (readline.__doc__ or "")
    readline.parse_and_bind("bind ^I rl_complete" if editline else "tab: complete")
    readline.set_history_length(MOST_LINES)
    readline.clear_history()
    with suppress(OvitaError, OSError):
        history = make_folder(state_folder(), mode=0o700) / "chat_history"
        with suppress(FileNotFoundError):
            readline.read_history_file(history)
        return history
    return None


def _written(history: Path) -> None:
    import readline

    readline.set_completer(None)
    with suppress(OSError):
        history.touch(mode=0o600)  # so that it is never anybody else's to read
        readline.write_history_file(history)


def completed(line: str, commands: Sequence[str], names: Sequence[str], knobs: Sequence[str]) -> list[str]:
    """What the last word of a line may become: a command, a knob to set, a file, or the rest of an object's name.

    Args:
        line: Up to the cursor.
        commands: Without their slash.
        names: Of objects; one may have several words.
        knobs: That /set turns.
    """
    _, space, last = line.rpartition(" ")
    command = line[1:].partition(" ")[0] if line[:1] in ("/", ":") else ""
    if command and not space:
        return [f"{line[0]}{word} " for word in commands if word.startswith(command)]
    if line in ("/", ":"):
        return [f"{line}{word} " for word in commands]
    if command == "set":
        return [f"{name}=" for name in knobs if name.startswith(last)]
    if command in ("save", "plot"):
        return _files(last)
    return [found for name in names if (found := _rest(line, name, last))]


def _rest(line: str, name: str, last: str) -> str:
    """The last word of a line with what is missing of a name that the line ends with the beginning of; else ""."""
    for size in range(len(name) - 1, 0, -1):
        begun = line[-size:].lower() == name[:size].lower() and line[-size - 1 : -size] in ("", " ")
        if begun:
            return last + name[size:]
    return ""


def _files(text: str) -> list[str]:
    folder, name = os.path.split(text)
    with suppress(OSError):
        found = [entry for entry in os.scandir(folder or ".") if entry.name.startswith(name)]
        return sorted(os.path.join(folder, entry.name) + os.sep * entry.is_dir() for entry in found)
    return []


class Keeper:
    """Keeps the talk about a file in a journal of its own from its first turn on, and knows the talk before it.

    Args:
        file: That is talked about.
    """

    def __init__(self, file: str) -> None:
        place = os.path.realpath(file)
        stem = "".join(c if c.isalnum() else "-" for c in Path(file).stem)[:40]
        self.mark = f"{stem}-{hashlib.sha256(place.encode('utf-8', 'surrogateescape')).hexdigest()[:12]}"
        self.folder = make_folder(state_folder() / "chat", mode=0o700)
        self.path = self.folder / f"{self.mark}-{time.time_ns()}.jsonl"
        self.earlier = self._earlier()

    def _earlier(self) -> Path | None:
        """The last talk about the file; the oldest of many are deleted."""
        found = sorted(self.folder.glob(f"{self.mark}-*.jsonl"))
        for old in found[:-MOST_TALKS]:
            old.unlink(missing_ok=True)
        return found[-1] if found else None

    def keep(self, session: Session) -> None:
        """Begin the journal once something was said."""
        if session.steps and not session.kept:
            session.keep(str(self.path))
