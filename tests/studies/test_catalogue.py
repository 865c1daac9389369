"""Every study runs, shows the print beside its own, and says in words how they agree."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from logger.errors import BadInput
from logger.report.study_page import page
from logger.studies.study import (
    DISSERTATION,
    Item,
    Result,
    Statement,
    Value,
    Word,
    Workload,
    about,
    alike,
    studies,
    study_of,
    word_of,
)

from ..support.study_results import STUDIES, study_result

SLOW = ("section-7-2-input", "table-6-3", "iso-8041-bursts", "table-6-1", "fig-4-27", "five-modes", "table-4-4",
        "section-7-2-speed", "fig-5-22", "fig-6-9", "section-7-2-other-vehicles", "section-7-2-sensor-position",
        "fig-6-23", "fig-6-16", "table-6-5", "fig-4-22", "fig-4-21", "fig-4-31", "table-5-4")
"""Studies that take more than a third of a second with the least effort."""
LONG = ("section-7-2-input", "table-6-3", "fig-6-9")
"""Those that take 10 to 40 s."""


def stands_alone(text: str, pictures: int) -> None:
    assert text.startswith("<!doctype html>")
    assert not any(word in text for word in ("<script", "<img", "http://", "https://", "url(", ">nan<", ">inf<"))
    assert text.count("<svg") == pictures


@pytest.mark.parametrize("name", [
    pytest.param(name, marks=pytest.mark.release if name in LONG else pytest.mark.slow if name in SLOW else ())
    for name, study in STUDIES.items()
    if not study.data])
def test_a_study_runs_and_is_whole(name: str) -> None:
    study = STUDIES[name]
    result = study_result(name)
    if name.split("-")[0] in ("fig", "table"):
        assert study.where.split()[1].rstrip(",") == ".".join(name.split("-")[1:])
    assert not study.differs(result)
    assert result.all_tables
    for table in result.all_tables:
        assert table.rows, table.title
        assert all(text for row in table.texts for text in row)
        for row in table.rows:
            assert len(row) == len(table.columns)
            for cell in row:
                assert not isinstance(cell, float) or math.isfinite(cell)
    headings = [head for table in result.all_tables for head in table.heads]
    titles = [table.title for table in result.all_tables]
    assert any("published" in words.lower() for words in headings + titles), "a study without the print beside it"
    assert len(result.verdict) > 80
    assert result.verdict.endswith(".")
    assert study.how.endswith(".")
    assert study.items
    for item in study.items:
        assert item.because.endswith(".")
        assert item.word is Word.NOT_REPRODUCIBLE or study.checks_of(item.name, result), item
    for check in result.values:
        assert set(check.of) <= set(study.covers), check
        assert check.of or len(study.items) == 1, check
    if study.source == DISSERTATION:
        assert result.values, "a study without a check"
        assert all(picture.printed for picture in result.pictures), "a picture without what is printed beside it"
    stands_alone(page(study, result), pictures=len(result.pictures))


@pytest.mark.release
@pytest.mark.parametrize("name", [name for name, study in STUDIES.items() if not study.data])
def test_a_study_is_as_it_states_with_a_fifth_of_its_effort_too(name: str) -> None:
    study = STUDIES[name]
    assert not study.differs(study.run(Workload(0.2)))


def test_names_with_either_dash() -> None:
    assert study_of("table_4_4", STUDIES) is study_of("Table-4-4", STUDIES) is STUDIES["table-4-4"]
    with pytest.raises(BadInput, match="study 'table-9-9': expected one of table-2-2"):
        study_of("table-9-9", STUDIES)


def test_a_study_is_found_by_what_it_covers() -> None:
    assert study_of("fig-4-26", STUDIES) is study_of("Fig_4_26", STUDIES) is STUDIES["fig-4-27"]


def test_they_stand_in_the_order_of_the_dissertation() -> None:
    numbers = [tuple(int(part) for part in name.split("-") if part.isdigit()) for name in studies("dissertation")]
    assert numbers == sorted(numbers)


def test_a_value_stands_as_its_word_says() -> None:
    def holds(printed: float, ours: float, word: Word) -> bool:
        return Value("mass [kg]", printed, ours, 0.5, word).holds

    assert [holds(875, ours, Word.AGREES) for ours in (874.6, 875.5, 875.6)] == [True, True, False]
    assert [holds(875, ours, Word.NOT_REPRODUCIBLE) for ours in (874.6, 880)] == [True, False]
    assert [holds(875, ours, Word.MISPRINT) for ours in (875.2, 735)] == [False, True]
    assert [holds(-6, ours, Word.BETTER) for ours in (-5.4, 5.6, -5.6, 7)] == [True, False, False, False]


def test_a_statement_stands_as_its_word_says() -> None:
    def holds(ours: float, word: Word) -> bool:
        return Statement("change [%]", "it grows", ours, 1.0, 5.0, word).holds

    assert [holds(ours, Word.AGREES) for ours in (0.9, 1.0, 5.0, 5.1, math.nan)] == [False, True, True, False, False]
    assert [holds(ours, Word.NOT_REPRODUCIBLE) for ours in (0.9, 3.0)] == [False, True]
    assert [holds(ours, Word.BETTER) for ours in (0.9, 3.0)] == [False, True]
    assert [holds(ours, Word.MISPRINT) for ours in (0.9, 3.0)] == [True, False]
    assert [Statement("", "", 0.0, least, most).bounds for least, most in (
        (1.0, 5.0), (1.0, math.inf), (-math.inf, 5.0))] == ["1 to 5", "1 or more", "5 or less"]


def test_the_word_of_an_item_is_that_of_its_checks() -> None:
    def of(*words: Word, of_print: bool = False) -> Word:
        return word_of(Value("", 1.0, 1.0, 0.1, word, of_print=of_print) for word in words)

    assert of(Word.AGREES, Word.BETTER) is Word.BETTER
    assert of(Word.BETTER, Word.NOT_REPRODUCIBLE) is Word.NOT_REPRODUCIBLE
    assert of(Word.NOT_REPRODUCIBLE, Word.MISPRINT, Word.AGREES) is Word.MISPRINT
    assert of() is Word.NOT_REPRODUCIBLE
    assert of(Word.AGREES, of_print=True) is Word.NOT_REPRODUCIBLE  # the print beside itself shows nothing of ours
    assert of(Word.MISPRINT, of_print=True) is Word.MISPRINT


def test_a_study_that_is_not_as_it_states_says_so() -> None:
    study = STUDIES["table-4-1"]
    good, bad = (Value(name, 1.2, ours, 0.05) for name, ours in (("body [Hz]", 1.21), ("wheel [Hz]", 1.3)))
    assert not study.differs(Result((), "", values=(good,)))
    reported = study.differs(Result((), "", values=(good, bad)))
    assert "wheel [Hz] (1.3, published 1.2" in reported
    assert "body" not in reported


def test_an_item_whose_checks_come_to_another_word_says_so() -> None:
    study = replace(STUDIES["table-4-1"], items=(*alike(("Fig 1", "Fig 2"), Word.AGREES, "So."),
                                                 Item("Fig 3", Word.NOT_REPRODUCIBLE, "No.")))
    check = Value("mass [kg]", 875.0, 875.0, 1.0)
    assert study.words == "agrees, not reproducible"
    assert [names for names, _ in study.groups] == [("Fig 1", "Fig 2"), ("Fig 3",)]
    assert not study.differs(Result((), "", values=about(("Fig 1", "Fig 2"), [check])))
    message = study.differs(Result((), "", values=about(("Fig 1", "Fig 3"), [check])))
    assert "Fig 2 (by its checks: not reproducible, expected: agrees)" in message
    assert "Fig 3 (by its checks: agrees, expected: not reproducible)" in message
    assert "Fig 1" not in message


def test_effort() -> None:
    reported: list[tuple[int, int]] = []
    effort = Workload(0.5, lambda done, of: reported.append((done, of)))
    assert effort.some(range(5), 2) == [0, 4]
    assert effort.some(range(9)) == [0, 3, 5, 8]
    assert (effort.count(200), effort.count(3, 2), Workload(0.001).count(200, 6), Workload().count(7)) == (100, 2, 6, 7)
    assert list(effort.each("ab")) == ["a", "b"]
    assert reported == [(0, 2), (1, 2), (2, 2)]
