"""Reading a whole file that somebody else made, up to a size that fits the machine."""

from __future__ import annotations

import os
from pathlib import Path

from drivers.regular_file import open_regular
from logger.errors import BadInput


def read_bounded(path: Path | str, max_bytes: int) -> bytes:
    """All bytes of a file. Raises BadInput for one that cannot be read or is longer than ``max_bytes``."""
    try:
        with open_regular(path) as file:
            too_long = os.fstat(file.fileno()).st_size > max_bytes
            data = b"" if too_long else file.read(max_bytes + 1)
    except OSError as error:
        raise BadInput(f"{path}: expected a readable file ({error.strerror})") from None
    if too_long or len(data) > max_bytes:
        raise BadInput(f"{path}: expected at most {max_bytes} bytes")
    return data
