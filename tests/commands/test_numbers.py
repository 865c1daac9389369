"""Options within a range: what lies outside is named with its option, and no number at all is argparse's complaint."""

from __future__ import annotations

import argparse
from math import inf

import pytest

from logger.commands.numbers import add_number
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


def test_what_is_no_number_is_said_as_argparse_says_it(parser: argparse.ArgumentParser) -> None:
    with pytest.raises(argparse.ArgumentError, match="argument --rate: invalid float value: 'fast'"):
        parser.parse_args(["--rate", "fast"])
    with pytest.raises(argparse.ArgumentError, match=r"argument --tries: invalid int value: '1\.5'"):
        parser.parse_args(["--tries", "1.5"])
