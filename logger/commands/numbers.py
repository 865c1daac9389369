"""Options that are numbers within a range, checked where they are declared."""

from __future__ import annotations

import argparse
from typing import Any

from logger.api.ranges import Range, check_limit
from logger.errors import BadInput
from logger.units import INCH_PER_MILE_M_PER_KM


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


def add_limit(parser: argparse.ArgumentParser, option: str, **rest: Any) -> None:
    """Add an option whose number is an IRI from which on a road is rough, in m/km, or with in/mi written behind it."""
    def number(text: str) -> float:
        value, is_us = text.strip().removesuffix("in/mi").removesuffix("m/km"), text.strip().endswith("in/mi")
        try:
            m_per_km = float(value) * (INCH_PER_MILE_M_PER_KM if is_us else 1.0)
        except ValueError:
            raise BadInput(f"{option} {text}: expected a number, as 2.5 (m/km) or 160in/mi") from None
        try:
            check_limit(option, m_per_km)
        except BadInput as error:
            how = f" (write {option} {value}in/mi)" if ";" in str(error) and not is_us else ""
            raise BadInput(f"{error}{how}") from None
        return m_per_km

    parser.add_argument(option, type=number, **rest)
