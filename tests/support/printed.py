"""What a document says that commands print: read out of it, beside what they do print, and rewritten.

In an indented block of a page a line ``ridelog ...`` is a command, ``\\`` at its end goes on in the next one; what
follows up to the next command is what it prints, in whole paragraphs, of which some may be left out.

    python -m tests.support.printed docs/field-lab.md    # run its commands in a new folder, write what they print now
"""

from __future__ import annotations

import re
import shlex
import sys
import tempfile
from contextlib import chdir
from dataclasses import dataclass, field
from difflib import SequenceMatcher
from pathlib import Path

from .command import called

INDENT = "    "
ELSEWHERE = ("sudo ", "cp ", "mkdir ")
"""Beginnings of lines that are neither commands to be run here nor what one prints."""


@dataclass
class Shown:
    """A command of a page, and the paragraphs below it: each the lines from ``first`` on, and where it stands."""

    command: str
    paragraphs: list[tuple[int, list[str]]] = field(default_factory=list)


def shown(page: str) -> list[Shown]:
    """The commands of a page, in order."""
    found: list[Shown] = []
    lines, number, inside = page.splitlines(), 0, False
    while number < len(lines):
        line = lines[number]
        text = line.removeprefix(INDENT)
        if line.startswith(INDENT) and text.startswith("ridelog "):
            while text.endswith("\\"):
                number += 1
                text = text[:-1] + lines[number].strip()
            found.append(Shown(re.sub(r"\s+# .*", "", text)))
            inside, fresh = True, True
        elif line.startswith(INDENT) and inside and not text.startswith(ELSEWHERE):
            if fresh:
                found[-1].paragraphs.append((number, []))
            found[-1].paragraphs[-1][1].append(text)
            fresh = False
        elif not line:
            fresh = True
        else:
            inside = False
        number += 1
    return found


def printed(command: str, folder: Path) -> list[list[str]]:
    """The paragraphs that a command prints, run in a folder."""
    with chdir(folder):
        done = called(*shlex.split(command)[1:])
    assert done.returncode == 0, f"{command}: {done.stderr}"
    return [part.splitlines() for part in re.split(r"\n\s*\n", done.stdout.strip("\n"))]


def words(lines: list[str]) -> str:
    """Lines without how they are broken."""
    return " ".join(" ".join(lines).split())


def most_like(old: list[str], now: list[list[str]]) -> list[str]:
    """The paragraph of those printed now that an old one has become."""
    def alike(one: list[str]) -> tuple[bool, float]:
        return (words(one).split()[:2] == words(old).split()[:2],
                SequenceMatcher(None, words(one), words(old)).ratio())

    return max(now, key=alike)


def main() -> None:
    """Rewrite the page: each paragraph becomes the printed one that begins with the same two words, or is most like
    it."""
    page = Path(sys.argv[1])
    lines = page.read_text("utf-8").splitlines()
    changes: list[tuple[int, int, list[str]]] = []
    with tempfile.TemporaryDirectory() as folder:
        for one in shown(page.read_text("utf-8")):
            now = printed(one.command, Path(folder))
            for first, old in one.paragraphs:
                changes.append((first, len(old), [INDENT + each for each in most_like(old, now)]))
    for first, count, new in reversed(changes):
        lines[first:first + count] = new
    page.write_text("\n".join(lines) + "\n", "utf-8")


if __name__ == "__main__":
    main()
