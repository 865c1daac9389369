"""Options within a range: what lies outside is named with its option, and no number at all with its unit."""

from __future__ import annotations

from math import inf, nan
from pathlib import Path

import pytest

from logger.api.shared_fields import named_numbers
from logger.commands.main import main
from logger.errors import BadInput
from logger.question import Range


@pytest.mark.parametrize(("within", "value"), [(Range(10.0, 1000.0, "Hz"), 10.0), (Range(10.0, 1000.0, "Hz"), 1e3),
                                               (Range(0, inf), 12345678)])
def test_numbers_within_their_range_are_taken(within: Range, value: float) -> None:
    within.check("--rate", value)


@pytest.mark.parametrize(("within", "value", "complaint"), [
    (Range(10.0, 1000.0, "Hz"), 9.99, "^--rate 9.99: expected 10 to 1000 Hz$"),
    (Range(10.0, 1000.0, "Hz"), nan, "--rate nan: expected 10"),
    (Range(0, inf), -12345678, "^--rate -12345678: expected 0 or more$")])
def test_others_are_refused_by_name(within: Range, value: float, complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        within.check("--rate", value)


def test_extract_refuses_numbers_out_of_range(tmp_path: Path) -> None:
    for value in ("0.4", "nan"):
        with pytest.raises(BadInput, match=f"^--speed {value}: expected 0.5 to 100 m/s$"):
            main(["extract", "--csv", "ride.csv", "--out", str(tmp_path), "--speed", value])


def test_what_is_no_number_is_said_with_the_unit(tmp_path: Path) -> None:
    asked = ["simulate", "--vehicle", "rav4-2009", "--profile", "60", "--speed", "9", "--out", str(tmp_path / "d.csv")]
    with pytest.raises(BadInput, match=r"^--rate 30mph: expected a number in Hz, without its unit$"):
        main([*asked, "--rate", "30mph"])
    with pytest.raises(BadInput, match=r"^--seed 1\.5: expected a whole number$"):
        main([*asked, "--seed", "1.5"])


def test_an_equals_sign_in_place_of_the_colon_is_named() -> None:
    with pytest.raises(BadInput, match="--effect dry_friction=3: expected NAME:PARAM=VALUE"):
        named_numbers("dry_friction=3", "--effect")
