"""Local models by name: the catalogue, installed files and downloads."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import tomllib
from dataclasses import dataclass
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from ovita.errors import DownloadError, RequestError, needs
from ovita.io.files import atomic_write, make_folder

DIR_VARIABLE = "OVITA_MODELS"
"""Environment variable that names the folder of models; else it is ovita/models in the user's cache."""

HUB = "https://huggingface.co"
HUB_VARIABLE = "HF_ENDPOINT"
"""Environment variable that names a mirror of the hub."""

SPARE = 64 * 2**20
"""Free space that must be left on the disk [bytes]."""

_SHA256 = re.compile(r"[0-9a-f]{64}")
_NAME = re.compile(r"[a-z0-9][a-z0-9._-]{0,63}")
_REGISTER = "models.json"


@dataclass(frozen=True)
class Known:
    """A model that `ovita models pull` can fetch: a file [bytes, sha256] of a repository on the hub.

    Its licence is an SPDX identifier; all are free to use, change and pass on, also commercially.
    """

    name: str
    repository: str
    file: str
    size: int
    sha256: str
    licence: str
    about: str

    @property
    def url(self) -> str:
        """Where the file is fetched from."""
        return f"{_hub()}/{self.repository}/resolve/main/{self.file}"


KNOWN = tuple(
    Known(**row)
    for row in tomllib.loads((files("ovita.writers.models") / "known.toml").read_text(encoding="utf-8"))["model"]
)
"""In the order in which `auto` prefers them."""


def models_dir() -> Path:
    """Return the folder of models, which may not exist yet."""
    named = os.environ.get(DIR_VARIABLE, "").strip()
    if named:
        return Path(named).expanduser()
    cache = os.environ.get("XDG_CACHE_HOME", "").strip()
    return (Path(cache) if cache else Path.home() / ".cache") / "ovita" / "models"


def known_named(name: str) -> Known:
    """Return the known model of that name.

    Raises:
        RequestError: If none is known by that name.
    """
    found = next((known for known in KNOWN if known.name == name), None)
    if found is None:
        raise RequestError(f"no model {name!r} is known; known are {', '.join(known.name for known in KNOWN)}")
    return found


def present() -> dict[str, Path]:
    """Return the models that are here by name: those that were added, then the known ones."""
    here = {name: Path(path) for name, path in _register()["added"].items() if Path(path).is_file()}
    for known in KNOWN:
        path = models_dir() / known.file
        if path.is_file():
            here.setdefault(known.name, path)
    return here


def default_model() -> str:
    """Return the writer's name of the local model that `auto` falls back on, or "" if none can be run here."""
    if find_spec("xllamacpp") is None:
        return ""
    return next((f"llamacpp:{name}" for name in present()), "")


def model_file(model: str) -> Path:
    """Return a model's file, given the file, its name, or a unique prefix of an installed name.

    Raises:
        RequestError: If there is no such model.
    """
    if model.lower().endswith(".gguf") or os.sep in model:
        return Path(model).expanduser()
    here = present()
    fits = [model] if model in here else [name for name in here if name.startswith(model)]
    match fits:
        case [name]:
            return here[name]
        case [_, *_]:
            raise RequestError(f"{model!r} may be {' or '.join(fits)}; name one of them")
    if model in [known.name for known in KNOWN]:
        raise RequestError(f"the model {model} is not here yet; get it with: ovita models pull {model}")
    known = ", ".join(here) or "none; see 'ovita models list'"
    raise RequestError(f"there is no local model {model!r}; here are {known}")


def add(name: str, file: str) -> Path:
    """Register a model file under a name; the file stays where it is.

    Raises:
        RequestError: If the name cannot be used, or the file is no GGUF model.
    """
    if not _NAME.fullmatch(name) or name.endswith(".gguf"):
        raise RequestError(f"{name!r} cannot be a model's name; use small letters, digits, '.', '-' and '_'")
    if name in [known.name for known in KNOWN]:
        raise RequestError(f"{name!r} is the name of a known model; choose another")
    path = Path(file).expanduser().absolute()
    check_file(path)
    register = _register()
    register["added"] = {**register["added"], name: str(path)}
    _write(register)
    return path


def check_file(path: Path) -> None:
    """Check that a file is a GGUF model.

    Raises:
        RequestError: If there is no such file, or it is none.
    """
    try:
        with path.open("rb") as file:
            magic = file.read(4)
    except OSError:
        raise RequestError(f"there is no model file {path}; 'ovita models list' shows which models are here") from None
    if magic != b"GGUF":
        raise RequestError(f"{path} is no GGUF model file")


def pull(name: str) -> tuple[Path, str]:
    """Download a known model from its hub, resuming an interrupted download.

    Until it is complete and its checksum is right, it lies next to its place as .part.

    Returns:
        The file and its checksum (sha256), which is the known one.

    Raises:
        RequestError: If no model is known by that name.
        MissingExtra: If huggingface_hub is not installed.
        DownloadError: If it cannot be had; says whether trying again helps.
    """
    known = known_named(name)
    with needs("huggingface-hub", "local"):
        from huggingface_hub import get_session
        from huggingface_hub.file_download import http_get
    target = models_dir() / known.file
    part = target.with_name(target.name + ".part")
    host = urlsplit(known.url).hostname or known.url
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        if _length(part) > known.size:
            part.unlink()
        offered = get_session().head(known.url, follow_redirects=False).headers.get("X-Linked-ETag", "").strip('W/" ')
        if _SHA256.fullmatch(offered) and offered != known.sha256:
            raise DownloadError(
                f"{host} now has another file there than the one that is known to be good ({offered[:12]}..., not"
                f" {known.sha256[:12]}...); nothing was downloaded"
            )
        _check_space(target.parent, known.size - _length(part))
        with part.open("ab") as file:
            http_get(
                known.url, file, resume_size=_length(part), expected_size=known.size, displayed_filename=known.file
            )
        with part.open("rb") as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
        if found != known.sha256:
            part.unlink()
            raise DownloadError(
                f"what {host} sent for {known.file} has the wrong checksum ({found[:12]}..., not"
                f" {known.sha256[:12]}...) and was thrown away; try again"
            )
        os.replace(part, target)
    except DownloadError:
        raise
    except Exception as error:  # whatever an HTTP client raises, a person gets a sentence
        raise DownloadError(_why_not(error, host, known.url, part)) from None
    register = _register()
    register["sha256"] = {**register["sha256"], known.file: found}
    _write(register)
    return target, found


def _why_not(error: Exception, host: str, url: str, part: Path) -> str:
    status = getattr(getattr(error, "response", None), "status_code", 0)
    if status in (408, 425, 429) or status >= 500:
        return f"{host} fails ({status}); try again later"
    if status:
        return (
            f"{host} {'has no such file' if status in (404, 410) else 'does not hand the file out'} ({status}): {url}"
        )
    if isinstance(error, OSError) and error.filename:
        return f"{part.with_suffix('')} cannot be written: {error.strerror}"
    if _length(part):
        here = _length(part) / 1e6
        return f"the connection to {host} broke after {here:.0f} MB; run the command again to go on from there"
    return (
        f"{host} cannot be reached; without it, use --writer builtin, which needs no model, or bring a .gguf file here"
        " by other means and name it: ovita models add NAME FILE"
    )


def _check_space(folder: Path, missing: int) -> None:
    free = shutil.disk_usage(folder).free
    if missing + SPARE > free:
        raise DownloadError(
            f"{folder} has {free / 1e9:.1f} GB free, and {missing / 1e9:.1f} GB are missing; make room, or set"
            f" {DIR_VARIABLE} to another folder"
        )


def _length(part: Path) -> int:
    return part.stat().st_size if part.is_file() else 0


def _hub() -> str:
    return os.environ.get(HUB_VARIABLE, "").strip().rstrip("/") or HUB


def checksum(file: str) -> str:
    """Return the sha256 that was recorded when a file was pulled, or ""."""
    return str(_register()["sha256"].get(file, ""))


def _register() -> dict[str, dict[str, str]]:
    empty: dict[str, dict[str, str]] = {"added": {}, "sha256": {}}
    path = models_dir() / _REGISTER
    try:
        read: Any = json.loads(path.read_text(encoding="utf-8"))
        return {key: {str(k): str(v) for k, v in read.get(key, {}).items()} for key in empty}
    except FileNotFoundError:
        return empty
    except (OSError, ValueError, AttributeError):
        raise RequestError(f"{path} cannot be read; remove it, and add your models again") from None


def _write(register: dict[str, dict[str, str]]) -> None:
    folder = make_folder(models_dir(), f"; set {DIR_VARIABLE} to another")
    atomic_write(folder / _REGISTER, json.dumps(register, indent=1))
