"""The public dataset: where it comes from, and how it is known to have arrived whole.

The instructions and trajectories belong to the repository MarkusKnauer/OVITA, which states no licence for them; so they
are downloaded by who uses them, and only their fingerprints are shipped.
"""

from __future__ import annotations

import hashlib
import os
import urllib.error
import urllib.request
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote

from ovita.errors import FormatError, OvitaError
from ovita.io import atomic_write

REPOSITORY = "MarkusKnauer/OVITA"
COMMIT = "8a67e79b617a5d215a356f5204c7a8a3e6a10436"
FOLDER = "dataset"
BASE_URL = f"https://raw.githubusercontent.com/{REPOSITORY}/{COMMIT}/{FOLDER}"
"""Where the files lie: BASE_URL/latte_subset/latte_0.json, ..."""

MAX_BYTES = 4 * 1024 * 1024
"""No file of the dataset is nearly as large [bytes]."""


class FetchError(OvitaError):
    """A dataset could not be downloaded; the message says what to put where instead."""


@dataclass(frozen=True)
class Fetched:
    """What a download came to: files that are there and whole, and how many of them were new."""

    folder: Path
    whole: int
    downloaded: int


@cache
def checksums() -> Mapping[str, str]:
    """SHA-256 of each file of the dataset for which there are checks, by sample id."""
    text = (files("ovita.bench") / "public.sha256").read_text(encoding="ascii")
    pairs = (line.split() for line in text.splitlines() if line and not line.startswith("#"))
    return {name: digest for digest, name in pairs}


def fetch(
    folder: str | os.PathLike[str],
    *,
    base_url: str = BASE_URL,
    timeout: float = 30.0,
    progress: Callable[[int, int], None] | None = None,
) -> Fetched:
    """Download what is missing in a folder, and verify every file.

    Args:
        folder: Where to; files that are there and whole are kept.
        base_url: Where from.
        timeout: For each file [s].
        progress: Called with how many files are done, and how many there are.

    Raises:
        FetchError: If a file cannot be had, or differs from what was published.
        FormatError: If a file cannot be written.
    """
    root, wanted = Path(folder), checksums()
    new = 0
    for done, (name, digest) in enumerate(wanted.items(), start=1):
        file = root / f"{name}.json"
        if not (file.is_file() and _digest(file.read_bytes()) == digest):
            data = _download(f"{base_url.rstrip('/')}/{quote(name)}.json", timeout, root)
            if _digest(data) != digest:
                raise FetchError(
                    f"{name}.json arrived, but differs from the published file (SHA-256 {_digest(data)[:12]}...,"
                    f" expected {digest[:12]}...); it was not saved. Is {base_url} the commit {COMMIT[:7]}?"
                )
            try:
                file.parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise FormatError(str(file.parent), f"cannot be made: {error.strerror}") from None
            atomic_write(file, data)
            new += 1
        if progress is not None:
            progress(done, len(wanted))
    return Fetched(root, len(wanted), new)


def verify(folder: str | os.PathLike[str]) -> tuple[list[str], list[str]]:
    """The ids of the dataset's files that are missing in a folder, and of those that differ."""
    missing: list[str] = []
    differing: list[str] = []
    for name, digest in checksums().items():
        file = Path(folder) / f"{name}.json"
        if not file.is_file():
            missing.append(name)
        elif _digest(file.read_bytes()) != digest:
            differing.append(name)
    return missing, differing


def by_hand(folder: str | os.PathLike[str]) -> str:
    """What to do on a machine without internet, as one sentence."""
    return (
        f"without internet, take the folder '{FOLDER}' of https://github.com/{REPOSITORY} (commit {COMMIT[:7]}) from a"
        f" machine that has it and put its latte_subset, extended_subset and robot_subset into {folder}; then"
        f" 'ovita bench fetch --out {folder}' checks them"
    )


def _download(url: str, timeout: float, root: Path) -> bytes:
    if not url.startswith(("https://", "http://")):
        raise FetchError(f"{url} is no web address; give one that begins with https://")
    try:
        with urllib.request.urlopen(url, timeout=timeout) as answer:
            data: bytes = answer.read(MAX_BYTES + 1)
    except urllib.error.HTTPError as error:
        error.close()
        raise FetchError(f"{url} answers {error.code}; {by_hand(root)}.") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "reason", error)
        raise FetchError(f"{url} cannot be reached ({reason}); {by_hand(root)}.") from None
    if len(data) > MAX_BYTES:
        raise FetchError(f"{url} is larger than any file of the dataset; is the address right?")
    return data


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
