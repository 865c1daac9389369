"""A folder read as a catalogue, and what it says of a file that does not keep to it."""

from __future__ import annotations

from pathlib import Path

import pytest

from logger.errors import BadInput
from logger.plugins import catalogue


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
    assert list(catalogue("logger.dsp.weightings", "WEIGHTING")) == ["wb", "wc", "wd", "we", "wf", "wj", "wk"]
