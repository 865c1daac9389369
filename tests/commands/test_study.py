"""``ridelog study`` as people and programs call it."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from logger.commands.main import main
from logger.commands.options import progress
from logger.errors import BadInput
from logger.studies.study import studies

STUDIES = studies()


def test_the_list(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "--list"]) == 0
    text = capsys.readouterr().out
    assert "table-4-4  " in text
    assert "Table 4.4, section 4.4.4" in text
    assert main(["study", "--list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)["studies"]
    assert len(listed) == len(text.splitlines())
    assert set(listed[0]) == {"name", "where", "title", "covers", "words", "items"}
    assert set(listed[0]["items"][0]) == {"item", "word", "because"}
    assert [one["item"] for one in listed[0]["items"]] == listed[0]["covers"]
    assert main(["study", "field", "--list"]) == 0
    assert "table-4-4" not in capsys.readouterr().out


def test_one_for_a_person_and_its_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "study.html"
    assert main(["study", "fig-4-25", "--quick", "--out", str(out)]) == 0
    text, said = capsys.readouterr()
    assert text.startswith("Fig 4.25, section 4.4.2: Peak acceleration")
    assert "0.8703" in text
    assert said.endswith(f"Wrote {out}\n")
    assert max(map(len, text.splitlines())) <= 118
    assert out.read_text().count("<svg") == 1


def test_one_for_a_program(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["study", "fig-4-25", "--quick", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert list(printed) == ["study", "where", "title", "covers", "words", "items", "how", "source", "failure",
                             "tables", "verdict", "figures"]
    assert printed["failure"] is None
    table = printed["tables"][1]
    assert all(len(row) == len(table["columns"]) for row in table["rows"])
    assert printed["figures"][0]["lines"][0]["name"] == "102 mm"
    assert printed["figures"][0]["printed"].startswith("peaks for heights of 101.6 to 203.2 mm")


@pytest.mark.slow
def test_all_with_one_that_fails(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    good, away = STUDIES["table-4-1"], replace(STUDIES["table-4-2"], data="a folder of roads")
    # The processes look studies up by themselves, and find none of this name.
    bad = replace(good, name="table_9_9", title="Nothing")
    monkeypatch.setattr("logger.studies.study.studies", lambda _shelf: {one.called: one for one in (bad, good, away)})
    out = tmp_path / "pages"
    assert main(["study", "all", "--quick", "--out", str(out), "--json"]) == 1
    shown = capsys.readouterr()
    reported = json.loads(shown.out)
    assert [(one["name"], one["failure"]) for one in reported["studies"]] == [
        ("table-9-9", "KeyError: 'table-9-9'"), ("table-4-1", None)]
    assert shown.err.count("of 2] table-") == 2
    page = (out / "index.html").read_text()
    assert sorted(path.name for path in out.iterdir()) == ["index.html", "table-4-1.html"]
    assert '<a href="table-4-1.html">' in page
    assert "KeyError: &#x27;table-9-9&#x27;" in page
    assert "Needs a folder of roads: ridelog study table-4-2 DIR." in page
    assert not any(word in page for word in ("http:", "https:", "<script"))


def test_a_study_that_needs_a_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    away = replace(STUDIES["table-4-2"], data="a folder of roads")
    monkeypatch.setattr("logger.studies.study.studies", lambda _shelf: {away.called: away})
    with pytest.raises(BadInput, match="study table-4-2: expected DIR, a folder of roads"):
        main(["study", "table-4-2"])


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [(["table-9-9"], "study 'table-9-9': expected one of "), ([], "expected the NAME of a study, all, or --list"),
     (["--list", "fig-4-25"], "expected no NAME with it, found fig-4-25"),
     (["--list", "--quick"], "--quick: expected a NAME with it"), (["all"], "expected --out DIR"),
     (["fig-4-25", "roads"], "study fig-4-25: expected no DIR, found roads")],
)
def test_wrong_use(arguments: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        main(["study", *arguments])


def test_progress_wipes_itself(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with progress() as tell:
        tell("0 of 2")
        tell("1 of 2")
    shown = capsys.readouterr().err.split("\r")
    assert [one.strip() for one in shown] == ["", "0 of 2", "1 of 2", "", ""]
