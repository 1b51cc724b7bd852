"""Where a run's figures come from: the commit of the code, whether it was changed, and the day."""

from __future__ import annotations

import datetime
import subprocess
from functools import cache
from pathlib import Path

CHANGED = "+changed"
"""Follows a commit whose files were changed since."""


@cache
def commit() -> str:
    """The commit that this code was checked out from, or "" if it is installed otherwise."""
    here = Path(__file__).parent
    if not _git(here, "ls-files", "--error-unmatch", Path(__file__).name):
        return ""
    found = _git(here, "rev-parse", "--short=12", "HEAD")
    return found + (CHANGED if _git(here.parent, "status", "--porcelain", "--", ".") else "")


def today() -> str:
    """The date in UTC, ISO 8601."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()


def _git(folder: Path, *arguments: str) -> str:
    command = ["git", "-C", str(folder), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=20, check=True)
    except (OSError, subprocess.SubprocessError):
        return ""
    return done.stdout.strip()
