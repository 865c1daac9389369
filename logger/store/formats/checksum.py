"""One checksum for content that is kept as JSON, whatever its layout."""

from __future__ import annotations

import hashlib
import json


def json_sha256(content: object) -> str:
    """SHA-256 of the canonical text of plain JSON values: keys in order, no spaces, ASCII; 64 hex digits."""
    return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode("ascii")).hexdigest()
