"""Every study runs, shows the print beside its own, and says in words how they agree."""

from __future__ import annotations

import math

import pytest

from logger.errors import BadInput
from logger.report.study_page import page
from logger.studies.study import Effort, studies, study_of

STUDIES = studies()


def stands_alone(text: str, pictures: int) -> None:
    assert text.startswith("<!doctype html>")
    assert not any(word in text for word in ("<script", "<img", "http://", "https://", "url(", ">nan<", ">inf<"))
    assert text.count("<svg") == pictures


@pytest.mark.parametrize("name", STUDIES)
def test_a_study_runs_and_is_whole(name: str) -> None:
    study = STUDIES[name]
    result = study.run(Effort(0.01))
    assert study.where.split()[1].rstrip(",") == ".".join(name.split("-")[1:])
    assert result.tables
    for table in result.tables:
        assert table.rows, table.title
        for row in table.rows:
            assert len(row) == len(table.columns)
            for column, cell in zip(table.columns, row, strict=True):
                assert column.text(cell)
                assert not isinstance(cell, float) or math.isfinite(cell)
    headings = [column.name for table in result.tables for column in table.columns]
    titles = [table.title for table in result.tables]
    assert any("printed" in words.lower() for words in headings + titles), "a study without the print beside it"
    assert len(result.verdict) > 80
    assert result.verdict.endswith(".")
    assert study.how.endswith(".")
    stands_alone(page(study, result), pictures=len(result.pictures))


def test_names_with_either_dash() -> None:
    assert study_of("table_4_4", STUDIES) is study_of("Table-4-4", STUDIES) is STUDIES["table-4-4"]
    with pytest.raises(BadInput, match="study 'table-9-9': expected one of fig-2-13"):
        study_of("table-9-9", STUDIES)


def test_they_stand_in_the_order_of_the_dissertation() -> None:
    numbers = [tuple(map(int, name.split("-")[1:])) for name in STUDIES]
    assert numbers == sorted(numbers)


def test_effort() -> None:
    told: list[tuple[int, int]] = []
    effort = Effort(0.5, lambda done, of: told.append((done, of)))
    assert effort.some(range(5), 2) == [0, 4]
    assert effort.some(range(9)) == [0, 3, 5, 8]
    assert (effort.count(200), effort.count(3, 2), Effort(0.001).count(200, 6), Effort().count(7)) == (100, 2, 6, 7)
    assert list(effort.each("ab")) == ["a", "b"]
    assert told == [(0, 2), (1, 2), (2, 2)]
