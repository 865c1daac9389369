"""Rows that were promised before a power cut against rows that are there after it.

A row is promised when it was seen in the log more than a second before the last sign of life of the guest (which is
before the cut, so nothing is promised too early). After the next boot it has to stand, to the byte, in one of the
repaired files; and every row with a good check value there has to be one that was seen, or newer than all of them.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from logger.store.log.row_format import HEADER as HEADER_LINE

PROMISED_AFTER_S = 1.0  # sync_s as shipped
HEADER = HEADER_LINE.split(",")


@dataclass(frozen=True)
class Looks:
    """What was seen before a cut. ``ages_s`` maps (file, line) to its age at the last look [s]."""

    ages_s: Mapping[tuple[str, str], float]
    rows_written: int

    @property
    def promised(self) -> set[tuple[str, str]]:
        """Lines older than a second."""
        return {line for line, age_s in self.ages_s.items() if age_s > PROMISED_AFTER_S}


@dataclass(frozen=True)
class Outcome:
    """One cut.

    promised, found    promised rows, and those of them that are there after the repair
    lost               promised rows that are not
    newer_lost         rows that were seen, not older than a second, and are not there: the price of a cut
    strange            rows with a good check value that differ from the row that was seen with the same number
    damaged            lines with a bad check value in a finished file
    """

    promised: int
    found: int
    lost: int
    newer_lost: int
    strange: int
    damaged: int


def read_looks(text: str) -> Looks:
    """The looks that ``in_guest/watch.py`` wrote down; a last one that was cut short does not count."""
    looks = []
    for line in text.splitlines():
        try:
            looks.append(json.loads(line))
        except ValueError:
            break
    if not looks:
        return Looks({}, 0)
    last_s = looks[-1]["t_s"]
    ages_s: dict[tuple[str, str], float] = {}
    for look in looks:
        for name, lines in look["lines"].items():
            for line in lines.splitlines():
                if is_row(line):
                    ages_s.setdefault((stem(name), line), last_s - look["t_s"])
    return Looks(ages_s, max(look["rows_written"] for look in looks))


def stem(name: str) -> str:
    """``00012-003`` for an open file, a finished one, and one that a repair is about to put in place."""
    return name.split(".", 1)[0]


def is_row(line: str) -> bool:
    """Whether the line is a row (not the header) whose check value is right."""
    text, _, crc = line.rpartition(",")
    return bool(text) and crc == f"{zlib.crc32(text.encode()):08x}"


def compare(looks: Looks, files: Mapping[str, str]) -> Outcome:
    """``files`` maps names to contents after the repair, of the sessions that were looked at."""
    found = {content(stem(name), line) for name, text in files.items() for line in text.splitlines() if is_row(line)}
    seen = {content(*line) for line in looks.ages_s}
    promised = {content(*line) for line in looks.promised}
    numbers = {row[:2]: row for row in seen}
    strange = sum(1 for row in found if numbers.get(row[:2], row) != row)
    damaged = sum(_damaged(text.splitlines()) for name, text in files.items() if name.endswith(".csv"))
    return Outcome(len(promised), len(promised & found), len(promised - found), len(seen - promised - found), strange,
                   damaged)


def content(name: str, line: str) -> tuple[str, ...]:
    """File, number and everything else in a row but what the repair may still learn: its UTC, and that it is set."""
    cells = line.split(",")
    cells[1] = ""
    flags = HEADER.index("flags")
    cells[flags] = "|".join(flag for flag in cells[flags].split("|") if flag != "time_unset")
    return (name, *cells[:-1])


def _damaged(lines: Iterable[str]) -> int:
    return sum(1 for line in list(lines)[1:] if not is_row(line))
