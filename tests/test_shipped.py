"""Words that people give for a vehicle."""

from __future__ import annotations

from pathlib import Path

import pytest

from logger.errors import BadInput
from logger.shipped import vehicle_file, vehicle_path


def test_a_name_is_a_vehicle_that_comes_along_whatever_lies_around(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rav4-2009").write_text("not this")
    assert vehicle_path("rav4-2009") == vehicle_path("rav4-2009", tmp_path) == vehicle_file("rav4-2009")


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
