"""Options that are numbers within a range, checked where they are declared."""

from __future__ import annotations

import argparse
from typing import Any

from logger.api.ranges import Range
from logger.errors import BadInput


def add_number(
    parser: argparse.ArgumentParser | argparse._ArgumentGroup, option: str, low: float, high: float, unit: str = "",
    *, kind: type[float] | type[int] = float, **rest: Any,
) -> None:
    """Add an option whose number lies from ``low`` to ``high`` (infinity: no end). BadInput, which names the option,
    for another one; ``rest`` as ``add_argument`` takes it."""
    def number(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            what = ("a whole number" if kind is int else "a number") + (f" in {unit}" if unit else "")
            without = ", without its unit" if text[:1].isdigit() and text[-1:].isalpha() else ""
            raise BadInput(f"{option} {text}: expected {what}{without}") from None
        Range(low, high, unit).check(option, value)
        return value

    parser.add_argument(option, type=number, **rest)
