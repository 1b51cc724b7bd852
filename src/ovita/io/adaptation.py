"""The document of an adaptation: a plain dict on disk, with its schema checked.

What the keys mean is the business of `ovita.chain`; here they are only written and read without loss.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from hashlib import sha256
from typing import Any

from ovita.errors import FormatError
from ovita.io import json_
from ovita.io.documents import plain
from ovita.io.files import atomic_write, examine, file_name, read_text, suffix

SCHEMA = json_.ADAPTATION_SCHEMA
"""Value of the key `schema`."""


_SEALED = (
    "schema",
    "instruction",
    "status",
    "original",
    "adapted",
    "timestep",
    "scene",
    "robot",
    "contacts",
    "constraints",
    "options",
)


def seal(document: Mapping[str, Any]) -> str:
    """SHA-256 of what a robot would be sent and why: trajectories, scene, limits and verdict.

    It tells whether a saved adaptation was edited; it is no signature, since anyone can compute it.

    Raises:
        TypeError: If something in it has no place in JSON.
    """
    content = {key: plain(document.get(key)) for key in _SEALED}
    return sha256(json.dumps(content, sort_keys=True, allow_nan=False).encode()).hexdigest()


def save_document(path: str | os.PathLike[str], document: Mapping[str, Any]) -> None:
    """Write an adaptation atomically as JSON, with its schema as the first key.

    Raises:
        FormatError: If it cannot be written there, holds NaN or what JSON does not know, or has another schema.
    """
    file = file_name(path)
    complete = {"schema": SCHEMA, **document}
    json_.check_schema(complete, file)
    atomic_write(path, json_.dumps(complete, file))


def load_document(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read an adaptation that `save_document` wrote.

    Raises:
        FormatError: If the file cannot be read, is not JSON, has another schema, or holds a number that is not finite.
    """
    file = file_name(path)
    document = json_.parse_object(read_text(path), file)
    if "schema" not in document and "trajectory" in document:
        raise FormatError(file, "this is a task, not a saved adaptation; run `ovita adapt` on it first")
    json_.check_schema(document, file)
    json_.check_values(document, file)
    return document


def is_adaptation(path: str | os.PathLike[str]) -> bool:
    """Whether a file says that it holds an adaptation; any other JSON object or format does not.

    Raises:
        FormatError: If the file cannot be read, or ends in .json but holds no JSON object.
    """
    if suffix(path) != ".json" and os.path.exists(path):
        return False
    examine(path)
    return json_.is_adaptation(json_.parse_object(read_text(path), file_name(path)))
