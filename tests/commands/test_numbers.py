"""Options within a range: what lies outside is named with its option, and no number at all is argparse's complaint."""

from __future__ import annotations

import argparse
from math import inf

import pytest

from logger.api.question import named_numbers
from logger.commands.options import add_number
from logger.errors import BadInput


@pytest.fixture
def parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_number(parser, "--rate", 10.0, 1000.0, "Hz", default=100.0, help="samples a second")
    add_number(parser, "--tries", 0, inf, kind=int, default=0)
    return parser


def test_numbers_within_their_range_are_taken(parser: argparse.ArgumentParser) -> None:
    for text, rate_hz in (("10", 10.0), ("1e3", 1000.0)):
        assert parser.parse_args(["--rate", text, "--tries", "12345678"]) == argparse.Namespace(
            rate=rate_hz, tries=12345678)
    assert parser.parse_args([]).rate == 100.0


@pytest.mark.parametrize(("arguments", "complaint"), [
    (["--rate", "9.99"], "^--rate 9.99: expected 10 to 1000 Hz$"), (["--rate", "nan"], "--rate nan: expected 10"),
    (["--tries", "-12345678"], "^--tries -12345678: expected 0 or more$")])
def test_others_are_refused_by_name(parser: argparse.ArgumentParser, arguments: list[str], complaint: str) -> None:
    with pytest.raises(BadInput, match=complaint):
        parser.parse_args(arguments)


def test_what_is_no_number_is_said_with_the_unit(parser: argparse.ArgumentParser) -> None:
    with pytest.raises(BadInput, match=r"^--rate 30mph: expected a number in Hz, without its unit$"):
        parser.parse_args(["--rate", "30mph"])
    with pytest.raises(BadInput, match=r"^--tries 1\.5: expected a whole number$"):
        parser.parse_args(["--tries", "1.5"])


def test_an_equals_sign_in_place_of_the_colon_is_named() -> None:
    with pytest.raises(BadInput, match="--effect dry_friction=3: expected NAME:PARAM=VALUE"):
        named_numbers("dry_friction=3", "--effect")
