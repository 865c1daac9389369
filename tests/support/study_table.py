"""The table of docs/studies.md, out of what the studies themselves declare: ``python -m tests.support.study_table``."""

from __future__ import annotations

from pathlib import Path

from logger.studies.study import SHELVES, studies

DOCUMENT = Path(__file__).parents[2] / "docs" / "studies.md"
TITLES = {"dissertation": "The dissertation, item by item", "field": "Other papers",
          "roads": "Public records of roads"}


def tables() -> str:
    """A table for each shelf: a row for each printed item, linked to the file of its study."""
    parts = []
    for shelf, package in SHELVES.items():
        rows = sorted((_place(item, place), item, study) for place, study in enumerate(studies(shelf).values())
                      for item in study.covers)
        if rows:
            folder = package.replace(".", "/")
            parts += ["", f"## {TITLES[shelf]}", "",
                      "| printed | study | word | because |", "| --- | --- | --- | --- |",
                      *(f"| {item} | [`{study.called}`](../{folder}/{study.name}.py) | {study.word} | {study.because} |"
                        for _, item, study in rows)]
    return "\n".join(parts) + "\n"


def _place(item: str, study: int) -> tuple[list[int], str, int]:
    """Items with a number stand in its order, in a chapter first tables and then figures; others as their studies."""
    chapter, _, number = next((word for word in item.split() if word[0].isdigit()), "").partition(".")
    kind = item.split()[0]
    if not number or not kind.isalpha():
        return [int(chapter or 99), study], "", study
    return [int(chapter), -1, int(number)], {"Table": "1", "Fig": "2"}.get(kind, "3"), study


def written() -> str:
    """The whole document as it has to be: its own words down to the first table, then the tables."""
    return DOCUMENT.read_text("utf-8").partition("\n## ")[0].rstrip("\n") + "\n" + tables()


if __name__ == "__main__":
    DOCUMENT.write_text(written(), "utf-8")
