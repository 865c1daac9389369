"""Files for other programs that commands write, in the format that their ending asks for."""

from __future__ import annotations

from drivers.catalogue import names


def table_endings() -> str:
    """The endings of all formats, for help: ``.csv .geojson ...``."""
    return " ".join(f".{name}" for name in names("logger.exchange.formats", "FORMAT"))
