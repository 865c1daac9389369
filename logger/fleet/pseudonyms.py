"""Cars by a pseudonym: the keyed hash of a name (HMAC-SHA-256, RFC 2104), whose key lies beside the dataset.

Who has the dataset alone cannot tell which car is which, nor try names. Its owner reads names: beside the key lies a
table of them, by pseudonym. The number has 63 bits: among a million cars the chance of two alike is one in ten million.
"""

from __future__ import annotations

import csv
import hmac
import io
import secrets
from collections.abc import Iterable, Mapping
from pathlib import Path

from logger.errors import BadInput
from logger.files import read_bounded, replace_bytes
from logger.printable import cell, word

_KEY_BYTES = 32
_MOST_BYTES = 256 << 20


def key_path(dataset: Path) -> Path:
    """Where the key of a dataset lies: beside its folder, so that the folder can be given away without it."""
    return dataset.with_name(f"{dataset.name}.key")


def own_key(dataset: Path) -> bytes:
    """The key of a dataset; a new one where there is none. BadInput for one that is damaged."""
    path = key_path(dataset)
    if not path.exists():
        replace_bytes(path, f"{secrets.token_hex(_KEY_BYTES)}\n".encode("ascii"), 0o600)
    try:
        key = bytes.fromhex(read_bounded(path, 4096).decode("ascii").strip())
    except (ValueError, UnicodeDecodeError):
        key = b""
    if len(key) != _KEY_BYTES:
        raise BadInput(f"{path}: expected {2 * _KEY_BYTES} hexadecimal digits, the key of the cars' pseudonyms")
    return key


def pseudonym(name: str, key: bytes) -> int:
    """The number of a car, 63 bits."""
    return int.from_bytes(hmac.digest(key, name.encode("utf-8", "surrogateescape"), "sha256")[:8], "big") >> 1


def shown_car(number: int) -> str:
    """A pseudonym as it is printed."""
    return f"car-{number:016x}"


def names_path(dataset: Path) -> Path:
    """Where the names of a dataset's cars lie: beside its folder, as the key does."""
    return dataset.with_name(f"{dataset.name}.cars.csv")


def names_of(dataset: Path) -> Mapping[int, str]:
    """The cars' names by their numbers; none where the table is not there. BadInput for one that cannot be read."""
    path = names_path(dataset)
    if not path.exists():
        return {}
    try:
        rows = list(csv.reader(io.StringIO(read_bounded(path, _MOST_BYTES).decode("utf-8"), newline="")))
        return {int(car.removeprefix("car-"), 16): word(name) for car, name in rows[1:]}
    except (ValueError, csv.Error):
        raise BadInput(f"{path}: expected lines car,name as 'fleet ingest' writes them; remove the file and ingest the "
                       "logs again") from None


def keep_names(dataset: Path, names: Iterable[str], key: bytes) -> None:
    """Add the names of cars to the table. OSError if that fails."""
    known = names_of(dataset)
    found = dict(known) | {pseudonym(name, key): cell(word(name)) for name in names}
    if found != known:
        table = io.StringIO(newline="")
        rows = csv.writer(table, lineterminator="\n")
        rows.writerows([("car", "name"), *((shown_car(number), name) for number, name in sorted(found.items()))])
        replace_bytes(names_path(dataset), table.getvalue().encode())
