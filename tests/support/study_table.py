"""The table of printed items, out of what the studies themselves declare."""

from __future__ import annotations

from logger.studies.study import SHELVES, studies

_KINDS = ("Table", "Fig", "Eq")
_LAST = 99
TITLES = {"dissertation": "The dissertation, item by item", "field": "Other papers",
          "roads": "Public records of roads"}


def page() -> str:
    """A table for each shelf: a row for each printed item with its word and its study."""
    parts = ["# Published items and what came of them", "",
             "Made by `python -m tests.support.reference` from the studies themselves. [Studies](../studies.md) says "
             "what the four words mean."]
    for shelf in SHELVES:
        rows = sorted(((_place(item.name, place), item, study) for place, study in enumerate(studies(shelf).values())
                       for item in study.items), key=lambda row: row[0])
        if rows:
            parts += ["", f"## {TITLES[shelf]}", "",
                      "| published | study | verdict | because |", "| --- | --- | --- | --- |",
                      *(f"| {item.name} | `{study.called}` | {item.word} | {item.because} |"
                        for _, item, study in rows)]
    return "\n".join(parts) + "\n"


def _place(item: str, study: int) -> tuple[int, int, list[int]]:
    """Chapter by chapter, in each first tables, then figures, equations and statements of sections, by their numbers;
    items without a number as their studies."""
    numbered = next((word for word in item.split() if word[0].isdigit()), "")
    numbers = [int(part) for part in numbered.split(".") if part.isdigit()]
    kind = item.split()[0]
    if len(numbers) < 2:
        return _LAST, 0, [study]
    return numbers[0], _KINDS.index(kind) if kind in _KINDS else len(_KINDS), [*numbers, study]
