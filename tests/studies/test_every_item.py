"""No table or figure that was asked for is missing, and none is covered twice."""

from __future__ import annotations

import pytest

from logger.studies.study import studies


def _numbered(kind: str, chapter: str, first: int, last: int) -> list[str]:
    return [f"{kind} {chapter}.{number}" for number in range(first, last + 1)]


ITEMS = {
    "2": [*_numbered("Table", "2", 2, 4), *_numbered("Table", "2", 7, 8), *_numbered("Fig", "2", 5, 9), "Fig 2.13",
          "Fig 2.16", *_numbered("Fig", "2", 18, 20)],
    "4": [*_numbered("Table", "4", 1, 6), *_numbered("Fig", "4", 3, 5), *_numbered("Fig", "4", 16, 22),
          *_numbered("Fig", "4", 25, 27), *_numbered("Fig", "4", 30, 36)],
    "5": [*_numbered("Table", "5", 1, 5), *_numbered("Fig", "5", 8, 10), *_numbered("Fig", "5", 12, 19), "Fig 5.22",
          "Fig 5.25", "Fig 5.28", "Fig 5.29"],
    "6": [*_numbered("Table", "6", 1, 5), *_numbered("Fig", "6", 3, 17), *_numbered("Fig", "6", 19, 24), "Table D.1"],
    "7": [f"7.2 {item}" for item in ("input from response", "full car", "sensor position", "other vehicles", "speed")],
}


@pytest.mark.parametrize("chapter", ITEMS)
def test_no_item_of_a_chapter_is_missing(chapter: str) -> None:
    covered = [item for study in studies("dissertation").values() for item in study.covers]
    assert [item for item in ITEMS[chapter] if item not in covered] == []


def test_no_item_is_covered_twice() -> None:
    covered = [item for study in studies().values() for item in study.covers]
    assert len(covered) == len(set(covered))
