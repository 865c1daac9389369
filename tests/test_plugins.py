"""A folder read as a catalogue, and what it says of a file that does not keep to it."""

from __future__ import annotations

import sys
from pathlib import Path
from threading import Barrier, Thread

import pytest

from drivers.catalogue import names
from logger.dsp import weightings
from logger.errors import BadInput
from logger.plugins import blamed_on, catalogue, offered_by


def folder(root: Path, files: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> str:
    package = root / f"offers_of_{root.name.replace('-', '_')}"
    package.mkdir()
    for name, text in {"__init__": "", **files}.items():
        (package / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(root)
    return package.name


OFFER = "from types import SimpleNamespace\nSPRING = SimpleNamespace(name={name!r})\n"


def test_offers_by_name_without_the_file_that_defines_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    files = {"spring": "", "leaf": OFFER.format(name="leaf"), "coil": OFFER.format(name="coil")}
    assert list(catalogue(folder(tmp_path, files, monkeypatch), "SPRING")) == ["coil", "leaf"]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [("", r"leaf\.py: expected it to offer SPRING"),
     (OFFER.format(name="coil"), r"leaf\.py: expected SPRING to be named 'leaf', as the file is, found 'coil'")],
)
def test_a_file_without_its_offer_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, complaint: str
) -> None:
    with pytest.raises(BadInput, match=complaint):
        catalogue(folder(tmp_path, {"leaf": text}, monkeypatch), "SPRING")


def test_the_weightings_are_a_catalogue() -> None:
    files = {path.stem for path in Path(str(weightings.__file__)).parent.glob("*.py")}
    expected = sorted(files - {"__init__", "weighting"})
    assert {"wb", "wd", "wf", "wk"} <= set(expected)
    assert names("logger.dsp.weightings", "WEIGHTING") == expected
    assert list(catalogue("logger.dsp.weightings", "WEIGHTING")) == expected


def test_what_a_users_own_file_prints_is_no_answer_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mine.py"
    path.write_text("print('loaded')\nEFFECT = lambda: print('asked')\n")
    offer = offered_by(path, "EFFECT")
    with blamed_on(path):
        offer()
        with blamed_on(path):
            offer()
        offer()
    print("answer")
    reported = capsys.readouterr()
    assert (reported.out, reported.err.split()) == ("answer\n", ["loaded", *3 * ["asked"]])


def test_threads_that_leave_a_users_own_file_in_another_order_leave_stdout_as_it_was(tmp_path: Path) -> None:
    first_in, both_in, first_out = Barrier(2), Barrier(2), Barrier(2)

    def first() -> None:
        with blamed_on(tmp_path):
            first_in.wait(10)
            both_in.wait(10)
        first_out.wait(10)

    before, thread = sys.stdout, Thread(target=first)
    meanwhile = []
    thread.start()
    first_in.wait(10)
    with pytest.raises(BadInput), blamed_on(tmp_path):
        both_in.wait(10)
        first_out.wait(10)
        meanwhile.append(sys.stdout)
        raise ValueError("wrong")
    thread.join()
    assert meanwhile == [sys.stderr] and sys.stdout is before
