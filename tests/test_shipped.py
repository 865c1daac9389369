"""What comes along: words that people give for a vehicle, and the files of the report's page."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path

import pytest

from logger.errors import BadInput
from logger.report.document import STYLE_SHEETS
from logger.report.page import SCRIPTS
from logger.shipped import vehicle_file, vehicle_path
from logger.studies.field.measurements import COUNTS


def test_a_name_is_a_vehicle_that_comes_along_whatever_lies_around(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rav4-2009").write_text("not this")
    assert vehicle_path("rav4-2009") == vehicle_path("rav4-2009", tmp_path) == vehicle_file("rav4-2009")


def test_the_page_s_script_and_style_are_in_the_package() -> None:
    """What an editable install finds by its folder, a wheel has to name: the two lists are the same."""
    settings = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    folder = resources.files("logger.report")
    with resources.as_file(folder) as place:
        shipped = {path.name for pattern in settings["tool"]["setuptools"]["package-data"]["logger.report"]
                   for path in place.glob(pattern)}
        assert shipped == {path.name for path in (place / "assets").iterdir()}
    assert {*SCRIPTS, *STYLE_SHEETS, "page.css"} == shipped


def test_the_counts_of_the_examination_are_in_the_package() -> None:
    settings = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8"))
    assert [COUNTS.name] == settings["tool"]["setuptools"]["package-data"]["logger.studies.field"]
    assert COUNTS.is_file()


@pytest.mark.parametrize("word", ["mine.yaml", "./mine", "cars/mine.yaml", "/cars/mine"])
def test_a_path_is_seen_from_a_folder(word: str) -> None:
    assert vehicle_path(word) == Path(word)
    assert vehicle_path(word, Path("/etc/ridelog")) == Path("/etc/ridelog") / word


def test_another_word_is_refused_with_the_names() -> None:
    with pytest.raises(BadInput, match=r"no vehicle 'mine' comes with ridelog; expected a path to a .yaml file, or"):
        vehicle_path("mine")


def test_a_long_word_is_refused_in_a_short_line() -> None:
    with pytest.raises(BadInput, match="no vehicle '999") as refused:
        vehicle_path("9" * 5000)
    assert len(str(refused.value)) < 400
