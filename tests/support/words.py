"""Counts of the documents: words by page, the longest sentence: ``python -m tests.support.words``.

Pages that programs wrote, those below ``docs/reference`` and the reports of examinations, are not counted in the sum.
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
REFERENCE = ROOT / "docs" / "reference"
MOST_WORDS, MOST_OF_A_PAGE, LONGEST_SENTENCE = 24_000, 2_000, 35


def pages() -> list[Path]:
    """The documents outside of the reference."""
    return [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def is_made(page: str) -> bool:
    """Whether a program wrote it."""
    return "Made by `python -m" in page


def words(text: str) -> int:
    """How many there are: whatever stands between blanks and holds a letter or a digit."""
    return sum(any(letter.isalnum() for letter in one) for one in text.split())


def sentences(page: str) -> list[str]:
    """Those of a page's paragraphs and lists; code, tables, headings and pictures are none."""
    page = re.sub(r"^```.*?^```", "", page, flags=re.MULTILINE | re.DOTALL)
    kept = [re.sub(r"^\s*(?:[-*]|\d+\.) ", "\n\n", line) for line in page.splitlines()
            if not line.startswith(("    ", "#", "![")) and not line.lstrip().startswith("|")]
    prose = re.sub(r"\]\([^)]*\)", "]", "\n".join(kept))
    ends = re.compile(r"(?<=[.?!])[*)\"]*\s+(?=[\"`*\[(]*[A-Z0-9`*])")
    return [" ".join(one.split()) for paragraph in re.split(r"\n\s*\n", prose) for one in ends.split(paragraph.strip())]


def main() -> None:
    """Print the counts, the longest page last."""
    rows, counted = [], 0
    for page in pages():
        text = page.read_text("utf-8")
        counted += 0 if is_made(text) else words(text)
        longest = max(sentences(text), key=words)
        rows.append((words(text), words(longest), page.relative_to(ROOT), longest))
    for count, length, path, longest in sorted(rows):
        print(f"{count:6} words, longest sentence {length:3}: {path}" +
              f"\n         {longest}" * (length > LONGEST_SENTENCE))
    reference = sum(words(page.read_text("utf-8")) for page in REFERENCE.glob("*.md"))
    print(f"{counted:6} words that people wrote in {len(rows)} pages; {reference} more in the reference")


if __name__ == "__main__":
    main()
