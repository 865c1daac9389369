"""Cars by a pseudonym: the keyed hash of a name (HMAC-SHA-256, RFC 2104), whose key lies beside the dataset.

Who has the dataset alone cannot tell which car is which, nor try names; who has the key as well can. The number has 63
bits: among a million cars the chance of two alike is one in ten million.
"""

from __future__ import annotations

import hmac
import os
import secrets
from pathlib import Path

from logger.errors import BadInput
from logger.files import read_bounded

_KEY_BYTES = 32


def key_path(dataset: Path) -> Path:
    """Where the key of a dataset lies: beside its folder, so that the folder can be given away without it."""
    return dataset.with_name(f"{dataset.name}.key")


def own_key(dataset: Path) -> bytes:
    """The key of a dataset; a new one where there is none. BadInput for one that is damaged."""
    path = key_path(dataset)
    if not path.exists():
        new = path.with_name(f".{path.name}.{os.getpid()}")
        descriptor = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        with os.fdopen(descriptor, "w", encoding="ascii") as file:
            file.write(secrets.token_hex(_KEY_BYTES) + "\n")
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)
    try:
        key = bytes.fromhex(read_bounded(path, 4096).decode("ascii").strip())
    except (ValueError, UnicodeDecodeError):
        key = b""
    if len(key) != _KEY_BYTES:
        raise BadInput(f"{path}: expected {2 * _KEY_BYTES} hexadecimal digits, the key of the cars' pseudonyms")
    return key


def pseudonym(name: str, key: bytes) -> int:
    """The number of a car, 63 bits."""
    return int.from_bytes(hmac.digest(key, name.encode(), "sha256")[:8], "big") >> 1


def shown_car(number: int) -> str:
    """A pseudonym as it is printed."""
    return f"car-{number:016x}"
