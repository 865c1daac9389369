"""Results of an examination: one line of JSON a case, so that one that was stopped goes on where it was."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TextIO

from .sitting import Question, Record


def read_results(path: Path) -> dict[Question, Record]:
    """What was recorded; a line that was torn by a stop is left out."""
    found = {}
    for line in path.read_text("utf-8").splitlines() if path.exists() else ():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        found[Question(record["kind"], record["seed"])] = record
    return found


def appended(path: Path) -> TextIO:
    """The results, to be written on; a line that was torn is ended."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torn = path.exists() and not path.read_bytes().endswith(b"\n")
    file = path.open("a", encoding="utf-8")
    if torn:
        file.write("\n")
    return file
