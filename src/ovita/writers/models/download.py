"""Fetching a large file: goes on where it was cut off, and counts only with the right checksum."""

from __future__ import annotations

import hashlib
import http.client
import os
import re
import shutil
import time
import urllib.request
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit

from ovita.errors import DownloadError

TRIES = 5
"""How often a connection that breaks is taken up again."""

PAUSE = 1.0
"""Before the first such try; it doubles with each one [s]."""

TIMEOUT = 30.0
"""Longest silence of the server [s]."""

SPARE = 64 * 2**20
"""Free space that must be left on the disk [bytes]."""

_CHUNK = 2**20
_SHA256 = re.compile(r"[0-9a-f]{64}")

Tell = Callable[[int, int], None]
"""Called with the bytes that are here and the bytes that there will be (0 if that is not known)."""


@dataclass
class _Offer:
    """What a server says of a file before it sends it."""

    size: int = 0
    sha256: str = ""


def fetch(url: str, target: Path, *, sha256: str = "", size: int = 0, tell: Tell | None = None) -> str:
    """Fetch a file, atomically; what a broken download has left is taken up again.

    Args:
        url: Where it is.
        target: Where it is to lie; its folder is made when needed. Until it is complete it lies next to it as .part.
        sha256: What its checksum must be; "" takes what the server says, if it says it.
        size: How large it is, if that is known [bytes].
        tell: Told how far it is.

    Returns:
        The checksum (sha256) of the file.

    Raises:
        DownloadError: If it cannot be had; says whether trying again helps.
    """
    part = target.with_name(target.name + ".part")
    host = urlsplit(url).hostname or url
    tries = 0
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        while True:
            before = _length(part)
            try:
                offer = _receive(url, part, sha256, size, tell)
                break
            except (URLError, http.client.HTTPException, TimeoutError, ConnectionError) as error:
                _refuse(error, url, host, _length(part))
                tries = tries + 1 if _length(part) == before else 1
                if tries >= TRIES:
                    failing = f"{host} fails ({error.code}); try again later" if isinstance(error, HTTPError) else ""
                    raise DownloadError(failing or _unreachable(host, _length(part))) from None
                time.sleep(PAUSE * 2 ** (tries - 1))
        found = _checksum(part)
        wanted = sha256 or offer.sha256
        if wanted and found != wanted:
            part.unlink()
            raise DownloadError(
                f"what {host} sent for {target.name} has the wrong checksum ({found[:12]}..., not {wanted[:12]}...)"
                " and was thrown away; try again"
            )
        os.replace(part, target)
    except OSError as error:
        raise DownloadError(f"{target} cannot be written: {error.strerror or error}") from None
    return found


def _receive(url: str, part: Path, sha256: str, size: int, tell: Tell | None) -> _Offer:
    """Receive what is missing of a file, or as much as comes."""
    offer = _Offer(size)
    start = _length(part)
    headers = {"User-Agent": "ovita", "Accept-Encoding": "identity"}
    if start:
        headers["Range"] = f"bytes={start}-"
    opener = urllib.request.build_opener(_Redirects(offer))
    try:
        answer = opener.open(urllib.request.Request(url, headers=headers), timeout=TIMEOUT)
    except HTTPError as error:
        if error.code == 416 and start and start == (_total(error.headers.get("Content-Range", "")) or size):
            return offer
        if error.code == 416 and start:
            part.unlink()
            return _receive(url, part, sha256, size, tell)
        raise
    with answer:
        offer.sha256 = offer.sha256 or _etag(answer.headers)
        if sha256 and offer.sha256 and offer.sha256 != sha256:
            raise DownloadError(
                f"{urlsplit(url).hostname} now has another file there than the one that is known to be good"
                f" ({offer.sha256[:12]}..., not {sha256[:12]}...); nothing was downloaded"
            )
        resumed = answer.status == 206 and answer.headers.get("Content-Range", "").startswith(f"bytes {start}-")
        start = start if resumed else 0
        total = (
            _total(answer.headers.get("Content-Range", ""))
            if resumed
            else int(answer.headers.get("Content-Length") or 0)
        )
        offer.size = total or offer.size
        _check_space(part, offer.size - start)
        with part.open("ab" if resumed else "wb") as file:
            here = _copy(answer, file, start, offer.size, tell)
    if offer.size and here < offer.size:
        raise ConnectionError("cut off")
    return offer


def _copy(answer: IO[bytes], file: IO[bytes], here: int, size: int, tell: Tell | None) -> int:
    while chunk := answer.read(_CHUNK):
        file.write(chunk)
        here += len(chunk)
        if tell is not None:
            tell(here, size)
    return here


def _refuse(error: Exception, url: str, host: str, here: int) -> None:
    """Raise at once where trying again does not help."""
    if isinstance(error, HTTPError) and error.code not in (408, 425, 429) and error.code < 500:
        what = "has no such file" if error.code in (404, 410) else "does not hand the file out"
        raise DownloadError(f"{host} {what} ({error.code}): {url}") from None
    if isinstance(error, URLError) and not isinstance(error, HTTPError) and not here:
        raise DownloadError(_unreachable(host, here)) from None


def _unreachable(host: str, here: int) -> str:
    if here:
        return f"the connection to {host} broke after {here / 1e6:.0f} MB; run the command again to go on from there"
    return (
        f"{host} cannot be reached; without it, use --writer builtin, which needs no model, or bring a .gguf file here"
        " by other means and name it: ovita models add NAME FILE"
    )


def _check_space(part: Path, missing: int) -> None:
    free = shutil.disk_usage(part.parent).free
    if missing + SPARE > free:
        raise DownloadError(
            f"{part.parent} has {free / 1e9:.1f} GB free, and {missing / 1e9:.1f} GB are missing; make room, or set"
            " OVITA_MODELS to another folder"
        )


def _length(part: Path) -> int:
    return part.stat().st_size if part.exists() else 0


def _checksum(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _total(content_range: str) -> int:
    total = content_range.rpartition("/")[2]
    return int(total) if total.isdigit() else 0


def _etag(headers: http.client.HTTPMessage) -> str:
    """The checksum that the hub gives for a large file, or ""."""
    tag = (headers.get("X-Linked-ETag") or "").strip('W/" ').lower()
    return tag if _SHA256.fullmatch(tag) else ""


class _Redirects(urllib.request.HTTPRedirectHandler):
    """Follows redirects, and keeps what the hub says of the file before it hands over to its storage."""

    def __init__(self, offer: _Offer) -> None:
        self._offer = offer

    def redirect_request(
        self,
        req: urllib.request.Request,
        fp: IO[bytes],
        code: int,
        msg: str,
        headers: http.client.HTTPMessage,
        newurl: str,
    ) -> urllib.request.Request | None:
        self._offer.sha256 = self._offer.sha256 or _etag(headers)
        linked = headers.get("X-Linked-Size") or ""
        self._offer.size = int(linked) if linked.isdigit() else self._offer.size
        return super().redirect_request(req, fp, code, msg, headers, newurl)
