"""Signed results: who approved one, by Ed25519 (RFC 8032).

A key pair, not a shared secret: the machine that drives the robot holds only the public half, so that whoever takes it
over can verify results and cannot sign any. An HMAC of the standard library would need no package, but the same secret
at both ends.

What is signed is the result's seal: trajectories, scene, robot, limits and verdict.
"""

from __future__ import annotations

import base64
import binascii
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from typing import Any

from ovita.errors import FormatError, RequestError, needs
from ovita.io.files import atomic_write, file_name, read_text, system_errors
from ovita.io.json_ import seal

SIGNATURE = "signature"
"""Key of a result that holds its signature."""

TRUSTED = "OVITA_TRUSTED_KEYS"
"""Environment variable with the files of public keys, separated as in PATH, one of which must have signed a result."""

_PREFIX = b"ovita.result/1\n"


@dataclass(frozen=True)
class SignatureCheck:
    """What looking at a signature found: the signer's fingerprint, and what is wrong; "" if it is right."""

    signer: str
    problem: str


def trusted_keys() -> tuple[str, ...]:
    """The files of public keys that the environment names."""
    return tuple(part for part in os.environ.get(TRUSTED, "").split(os.pathsep) if part)


def make_keys(name: str) -> tuple[str, str]:
    """Write a new key pair as NAME.key, for its owner's eyes only, and NAME.pub; the two files.

    Raises:
        FormatError: If a file is there already or cannot be written.
    """
    _, serialization, private_type, _ = _cryptography()
    files = f"{name}.key", f"{name}.pub"
    for file in files:
        if os.path.exists(file):
            raise FormatError(file_name(file), "is there already; choose another name")
    key = private_type.generate()
    pem, plain = serialization.Encoding.PEM, serialization.NoEncryption()
    secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, plain)
    public = key.public_key().public_bytes(pem, serialization.PublicFormat.SubjectPublicKeyInfo)
    with system_errors(files[0], "written"):
        handle = os.open(files[0], os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "wb") as stream:
            stream.write(secret)
    atomic_write(files[1], public)
    return files


def signed(document: Mapping[str, Any], key_file: str) -> dict[str, Any]:
    """A result's document with a signature by a private key."""
    _, serialization, private_type, _ = _cryptography()
    problem = "is no private Ed25519 key without a password; see ovita gate key"
    key = _read_key(key_file, lambda pem: serialization.load_pem_private_key(pem, None), private_type, problem)
    value = base64.b64encode(key.sign(_PREFIX + seal(document).encode())).decode()
    return {**document, SIGNATURE: {"signer": _fingerprint(key.public_key()), "ed25519": value}}


def checked(document: Mapping[str, Any], key_files: Sequence[str]) -> SignatureCheck:
    """Whether one of the keys signed a result's document.

    Raises:
        FormatError: If a key cannot be read; nothing is trusted then.
        MissingExtra: If the package is not installed.
    """
    if not key_files:
        raise RequestError("there is no key to verify a signature with")
    invalid, serialization, _, public_type = _cryptography()
    problem = "is no public Ed25519 key; nothing is trusted without it"
    keys = [_read_key(file, serialization.load_pem_public_key, public_type, problem) for file in key_files]
    given = document.get(SIGNATURE)
    if given is None:
        return SignatureCheck("", "It is not signed, and only signed results are trusted here; see ovita gate sign.")
    try:
        value = base64.b64decode(given["ed25519"], validate=True)
    except (KeyError, TypeError, ValueError, binascii.Error):
        return SignatureCheck("", "Its signature cannot be read.")
    for key in keys:
        try:
            key.verify(value, _PREFIX + seal(document).encode())
        except invalid:
            continue
        return SignatureCheck(_fingerprint(key), "")
    return SignatureCheck("", "None of the trusted keys signed it as it is now.")


def _read_key(file: str, load: Callable[[bytes], Any], kind: type[Any], problem: str) -> Any:
    """A key in a file, loaded as a kind of key; what is another or none is the problem."""
    try:
        key = load(read_text(file).encode())
    except (ValueError, TypeError):
        key = None
    if not isinstance(key, kind):
        raise FormatError(file_name(file), problem)
    return key


def _fingerprint(key: Any) -> str:
    return sha256(key.public_bytes_raw()).hexdigest()[:16]


def _cryptography() -> tuple[Any, Any, Any, Any]:
    with needs("cryptography", "sign"):
        from cryptography.exceptions import InvalidSignature
        from cryptography.hazmat.primitives import serialization
        from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
    return InvalidSignature, serialization, Ed25519PrivateKey, Ed25519PublicKey
