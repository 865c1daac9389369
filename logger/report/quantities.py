"""Numbers with their errors, as a person reads them, in SI or in the units of road agencies in the US; paragraphs and
columns of plain text, as wide as a screen."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from math import floor, inf, isfinite, log10
from textwrap import fill
from typing import TYPE_CHECKING

from logger.units import FOOT_M, INCH_PER_MILE_M_PER_KM, KMH_MPS, MILE_M, MPH_MPS

if TYPE_CHECKING:
    from logger.roads.iri import Area
    from logger.vehicle.effect import Chosen

_SYMBOLS = {"n": "N", "kg": "kg", "w": "W", "j": "J", "pa": "Pa", "hz": "Hz", "m": "m", "mm": "mm", "km": "km",
            "s": "s", "ms": "ms", "rad": "rad", "deg": "deg", "mps": "m/s"}
_UNIT = rf"(?:{'|'.join(_SYMBOLS)})[2-9]?"
# The end of a name: N s2 of ``_n_s2``, kg m2, or one unit; then what that is per, if anything. Products begin with one
# of the first five, so that the ``m`` of ``_m_kg`` belongs to the name.
_ENDING = re.compile(rf"(?:_(?P<over>(?:n|kg|w|j|pa)(?:_(?:m|s|rad)[2-9]?)+|{_UNIT}))?"
                     rf"(?P<under>(?:(?:^|_)per_{_UNIT}(?:_{_UNIT})*)*)$")


def unit_of(name: str) -> str:
    """The unit a name ends in, ``N s/m`` of ``damping_n_s_per_m``, ``1/s`` of ``decay_per_s``; empty: a ratio."""
    ending = _ENDING.search(name)
    assert ending is not None  # the end alone is one
    over, under = _product(ending["over"] or ""), [_product(one) for one in ending["under"].split("per_")[1:]]
    return "/".join([over or "1" * bool(under), *(f"({one})" if {" ", "/"} & set(one) else one for one in under)])


def _product(words: str) -> str:
    """Symbols of units: ``N s2`` of ``n_s2``."""
    return " ".join(_SYMBOLS[word.rstrip("23456789")] + word.lstrip("abcdefghijklmnopqrstuvwxyz")
                    for word in words.split("_") if word)


def fixed(value: float | None, decimals: int, absent: str = "") -> str:
    """A value with so many decimals, or what stands for one that is not known."""
    return absent if value is None or not isfinite(value) else f"{value:.{decimals}f}"


def measured(value: float, error: float | None) -> str:
    """A value with its standard error, in no more digits than it deserves: ``85 ± 4``, ``1.61e6 ± 0.04e6``."""
    if not isfinite(value):
        return "not known"
    if error is None or not isfinite(error) or not error > 0:
        return f"{value:.3g}".replace("e+0", "e")
    decimals = 1 - floor(log10(error)) - (error / 10.0 ** floor(log10(error)) >= 2)
    size = round(max(abs(value), error), decimals)
    if 1e-3 <= size < 1e6:
        return " ± ".join(f"{round(one, decimals):.{max(decimals, 0)}f}" for one in (value, error))
    power = floor(log10(size))
    digits = (f"{one / 10.0**power:.{max(decimals + power, 0)}f}" for one in (value, error))
    return " ± ".join(f"{one}e{power}" if float(one) else "0" for one in digits)


def numbers_of(one: Chosen) -> str:
    """The numbers of an effect: ``friction_force_n 85 ± 4 N``; nothing for one that has none. Numbers that are given
    or say more than its plain form, and are as they are when nothing is said, are left out."""
    from logger.vehicle.effect import AXLE

    free = {parameter.name: parameter for parameter in one.freed}
    held = one.effect.refinements if one.is_plain else ()
    usual = {parameter.name: parameter.default for parameter in one.effect.parameters
             if parameter.given or parameter.name in held}
    ends = {name: end for name, parameter in free.items() for end in (parameter.low, parameter.high)
            if parameter.is_at(end, one.values[name])}
    said = [f"{name} {_with_unit(ends.get(name, value), one.standard_errors.get(name), name, name not in ends)}"
            for name, value in one.values.items() if usual.get(name) != value and name != AXLE.name]
    return ", ".join([one.where] * bool(one.where) + said)


def _with_unit(value: float, error: float | None, name: str, inside: bool) -> str:
    """A number with its unit; one ``inside`` its range of which nothing is known is said to be so, and one that was
    fitted and came to an end of it, which 0 is by nature: that has no standard error."""
    unseen = "" if error is None or (inside and error < inf) else (
        " (these runs do not show it)" if inside else " (the end of its range, no measured value)" if value else "")
    return f"{measured(value, error if inside else None)} {unit_of(name)}".rstrip() + unseen


def chance(p_value: float) -> str:
    """A probability, such as a p-value."""
    if p_value < 1e-9:
        return "below 1e-9"
    return f"{p_value:.2f}" if p_value >= 0.01 else f"{p_value:.2g}"


def finite(errors: Mapping[str, float]) -> dict[str, float]:
    """Those standard errors that are known."""
    return {name: error for name, error in errors.items() if isfinite(error)}


def signal_errors(errors: Mapping[str, Sequence[float]], words: str) -> list[str]:
    """A sentence on the errors of other signals, by name, as many of each as ``words`` has places; none for none."""
    each = "; ".join(f"{name} {words.format(*(f'{one:.3f}' for one in some))}" for name, some in errors.items())
    return [f"Errors of the other signals: {each}."] if each else []


def known(value: float | None) -> float | None:
    """A number for a program; None (null) where it is not known."""
    return None if value is None or not isfinite(value) else float(value)


@dataclass(frozen=True)
class DisplayUnits:
    """Name and SI value of each unit, and decimals that are printed.

    length    of sections and where they lie
    place     of what is shorter than a section
    way       of a whole drive
    """

    length: tuple[str, float]
    length_decimals: int
    place: tuple[str, float]
    place_decimals: int
    iri: tuple[str, float]
    iri_decimals: int
    speed: tuple[str, float]
    way: tuple[str, float]


UNITS = {"si": DisplayUnits(("m", 1.0), 1, ("m", 1.0), 2, ("m/km", 1.0), 2, ("km/h", KMH_MPS), ("km", 1000.0)),
         "us": DisplayUnits(("mi", MILE_M), 3, ("ft", FOOT_M), 1, ("in/mi", INCH_PER_MILE_M_PER_KM), 0,
                            ("mph", MPH_MPS), ("mi", MILE_M))}


WIDTH = 100


def wrapped(lines: Sequence[str], mark: str = "") -> str:
    """Lines of text as wide as a screen, each after a mark."""
    return "\n".join(fill(line, WIDTH, initial_indent=mark, subsequent_indent=" " * len(mark),
                          break_long_words=False, break_on_hyphens=False) for line in lines)


def columns(rows: Sequence[Sequence[str]], words: Container[int] | None = None) -> list[str]:
    """Rows of words as columns, the last one as wide as it is; those of the numbers ``words`` stand left (None: all),
    the others right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    left = range(len(widths)) if words is None else words
    return ["  ".join(f"{cell:{'<' if place in left else '>'}{width}}" for place, (cell, width) in
                      enumerate(zip(row, widths, strict=True))).rstrip() for row in rows]


def enumerated(names: Sequence[str], last: str) -> str:
    """Names in a row, with a word before the last: "a, b or c"."""
    return f" {last} ".join(filter(None, (", ".join(names[:-1]), names[-1])))


FEW = 4
"""Most of many that a sentence names: more are not read."""


def some(words: Sequence[str], between: str = ", ", more: str = "more") -> str:
    """The first few of many in a row, and how many are left out: "a, b, c, d and 3 more"."""
    left = len(words) - FEW
    return between.join(words[:FEW]) + f" and {left} {more}" * (left > 0)


def area_values(one: Area) -> dict[str, float | None]:
    """By the names of their columns; None where nothing is known."""
    return {"distance_start_m": one.start_m, "distance_end_m": one.end_m, "worst_m_per_km": one.worst_m_per_km,
            "worst_std_m_per_km": known(one.worst_std_m_per_km), "worst_at_m": one.worst_at_m}
