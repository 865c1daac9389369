"""Sections of logs in words, and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import Any

import numpy as np

from logger.chart_data import Chart, Curves, Line
from logger.comfort.iso2631 import comfort_word
from logger.printable import counted
from logger.report.display_units import UNITS, DisplayUnits
from logger.report.drive_sections import DriveSections, localized
from logger.report.localized_text import area_lines, area_values
from logger.report.quantities import known
from logger.roads.sections import FEDERAL_WORDS, Sections
from logger.units import FOOT_M, MILE_M


def lines(drives: Sequence[DriveSections], length_m: float, system: str, localized_m_per_km: float | None = None
          ) -> list[str]:
    """For a person; with a limit the areas of localized roughness under each drive."""
    if not drives:
        return ["No row has a distance, or lies on the route: there are no sections."]
    units = UNITS[system]
    said = list(_summary(drives, length_m, units))
    head = (f"{'from ' + units.length[0]:>10} {'to ' + units.length[0]:>10} {'known':>6} {'IRI ' + units.iri[0]:>10} "
            f"{'std. error':>10}  {'condition':9}  {'a_w m/s2':>8} {units.speed[0]:>6}")
    for one in drives:
        said += ["", _title(one), head, *_rows(one, units)]
        if localized_m_per_km is not None:
            said += ["", *area_lines(localized(one, localized_m_per_km), localized_m_per_km, units)]
    return [*said, "",
            "Condition: good below 95 in/mi (1.50 m/km), poor above 170 (2.68), 23 CFR 490.313.",
            "One sensor in the middle of the car: the IRI is that of a half car on both wheel tracks (HRI)."]


def _title(one: DriveSections) -> str:
    return f"{one.log}, drive {one.number}" + (f", {one.direction} the route" if one.direction else "")


def _summary(drives: Sequence[DriveSections], length_m: float, units: DisplayUnits) -> Iterator[str]:
    count = sum(len(one.condition) for one in drives)
    known_m = np.concatenate([one.figures.known_m for one in drives])
    driven_m = sum(float(one.figures.driven_m.sum()) for one in drives)
    name, unit_m = units.way
    yield (f"{counted(len(drives), 'drive')}, {driven_m / unit_m:.2f} {name} in {counted(count, 'section')} of "
           f"{_length_words(length_m)}")
    total_m = float(known_m.sum())
    if total_m <= 0:
        yield "The IRI is known nowhere."
        return
    mean, error = _mean([one.whole for one in drives if one.whole.known_m[0] > 0])
    label, scale = units.iri
    sure = f"{error / scale:.{units.iri_decimals + 1}f}" if isfinite(error) else "not known"
    yield (f"Mean IRI {mean / scale:.{units.iri_decimals}f} {label}, standard error {sure}, over "
           f"{total_m / unit_m:.2f} {name}")
    words = [word for one in drives for word in one.condition]
    shares = {word: float(known_m[[here == word for here in words]].sum()) / total_m for word in FEDERAL_WORDS}
    yield "Of that: " + ", ".join(f"{word} {share:.0%}" for word, share in shares.items())


def _mean(wholes: Sequence[Sections]) -> tuple[float, float]:
    """Mean IRI of drives by length, and its standard error [m/km]: the numbers of the car are wrong in all alike."""
    known_m, iri, std, common = np.array([
        (one.known_m[0], one.iri_m_per_km[0], one.iri_errors.std[0], one.iri_errors.common_std[0]) for one in wholes]).T
    weight = known_m / known_m.sum()
    variance = weight**2 @ (std**2 - common**2) + (weight @ common) ** 2
    return float(weight @ iri), float(np.sqrt(variance))


def _rows(one: DriveSections, units: DisplayUnits) -> Iterator[str]:
    figures = one.figures
    columns = (figures.edges_m[:-1], one.ends_m, figures.known_m, figures.iri_m_per_km, figures.iri_std_m_per_km,
               figures.a_w_mps2, figures.speed_mps)
    for word, (start_m, end_m, known_m, iri, std, a_w, speed) in zip(
            one.condition, zip(*(column.tolist() for column in columns), strict=True), strict=True):
        (_, unit_m), (_, iri_scale), (_, speed_scale) = units.length, units.iri, units.speed
        yield (f"{start_m / unit_m:10.{units.length_decimals}f} {end_m / unit_m:10.{units.length_decimals}f} "
               f"{known_m / (end_m - start_m):6.0%} {_number(iri / iri_scale, units.iri_decimals):>10} "
               f"{_number(std / iri_scale, units.iri_decimals + 1):>10}  {word:9}  {_number(a_w, 2):>8} "
               f"{_number(speed / speed_scale, 0):>6}")


def _number(value: float, decimals: int) -> str:
    return f"{value:.{decimals}f}" if isfinite(value) else "-"


def _length_words(length_m: float) -> str:
    for name, unit_m in (("mi", MILE_M), ("km", 1000.0), ("ft", FOOT_M)):
        units = length_m / unit_m
        if abs(units - round(units, 1)) < 1e-6 * units and (name != "km" or units >= 1):
            return f"{units:g} {name}" if name != "ft" or length_m % 1 else f"{length_m:g} m"
    return f"{length_m:g} m"


# --- for programs ---


def as_json(drives: Sequence[DriveSections], length_m: float, localized_m_per_km: float | None = None
            ) -> dict[str, Any]:
    """Drives with their sections, and areas of localized roughness above a limit; null where nothing is known."""
    return {"length_m": length_m, "drives": [
        {"log": one.log, "drive": one.number, "direction": one.direction or None,
         "sections": list(section_values(one)),
         **({} if localized_m_per_km is None else {
             "localized": [area_values(area) for area in localized(one, localized_m_per_km)]})} for one in drives]}


def section_values(one: DriveSections) -> Iterator[dict[str, Any]]:
    """The sections of a drive by the names of their columns; None where nothing is known."""
    figures = one.figures
    for index, word in enumerate(one.condition):
        numbers = {name: known(getattr(figures, name)[index]) for name in (
            "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "speed_mps", "worst_m_per_km", "worst_at_m")}
        a_w = numbers["a_w_mps2"]
        yield {"distance_start_m": float(figures.edges_m[index]), "distance_end_m": float(one.ends_m[index]),
               "known_m": float(figures.known_m[index]), **numbers, "condition": word or None,
               "comfort": None if a_w is None else comfort_word(a_w)}


def charts(drives: Sequence[DriveSections]) -> list[Chart]:
    """The IRI of the sections along each drive."""
    found: list[Chart] = []
    for one in drives:
        known = np.isfinite(one.figures.iri_m_per_km)
        if known.any():
            middle_m = (one.figures.edges_m[:-1] + one.ends_m)[known] / 2
            found.append(Curves(_title(one), "distance [m]", "IRI [m/km]", (
                Line("IRI", middle_m, one.figures.iri_m_per_km[known], one.figures.iri_std_m_per_km[known]),)))
    return found
