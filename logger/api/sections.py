"""Logs in sections of road, as agencies file them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from logger.api.ranges import check_limit
from logger.api.shown import CommandResult
from logger.errors import BadInput
from logger.units import FOOT_M, MILE_M

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.exchange.layer import Layer
    from logger.report.drive_sections import DriveSections
    from logger.store.log.log_reader import LoggedFile

Array = npt.NDArray[np.float64]
USUAL_M = 100.0
LEAST_M, MOST_M = 25 * FOOT_M, 100_000.0
_UNITS_M = {"m": 1.0, "km": 1000.0, "mi": MILE_M, "ft": FOOT_M}
SYSTEMS = ("si", "us")


@dataclass(frozen=True, eq=False, repr=False)
class Sections(CommandResult):
    """Sections of the drives of some logs, k of all of them, in the order driven; NaN: not known.

    length_m                      of a section; the last one of a drive is cut short [m]
    drive                         (k,) number of the drive, in the order read, from 0
    start_m, end_m                (k,) along the drive, or measures of the route [m]
    known_m                       (k,) how much of each has an IRI [m]
    iri_m_per_km, iri_std_m_per_km    (k,) mean over that, and its standard error
    a_w_mps2                      (k,) weighted r.m.s. acceleration (ISO 2631-1)
    speed_mps                     (k,) mean
    condition                     (k,) good, fair or poor (23 CFR 490.313); empty: not known
    """

    length_m: float
    drive: npt.NDArray[np.intp]
    start_m: Array
    end_m: Array
    known_m: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    a_w_mps2: Array
    speed_mps: Array
    condition: npt.NDArray[np.str_]
    _drives: tuple[DriveSections, ...]

    def charts(self) -> Sequence[Chart]:
        """The IRI of the sections along each drive."""
        from logger.report.sections_text import charts

        return charts(self._drives)

    def layer(self) -> Layer:
        """Rows with places, for the formats of ``convert``."""
        from logger.report.sections_layer import sections_layer

        return sections_layer(self._drives)


def length_of(text: str) -> float:
    """A length with its unit, such as 100m, 0.1mi, 500ft, 1km [m]. BadInput for anything else."""
    found = re.fullmatch(r"([0-9.]+)\s*(m|km|mi|ft)", text.strip())
    try:
        length_m = float(found[1]) * _UNITS_M[found[2]] if found else 0.0
    except ValueError:
        length_m = 0.0
    if not LEAST_M <= length_m <= MOST_M:
        raise BadInput(f"length {text}: expected a length with its unit, such as 100m, 0.1mi or 500ft, from "
                       f"{LEAST_M:g} m to {MOST_M / 1000:g} km")
    return length_m


def sections(logs: Path | str | Sequence[Path | str], length: str | float = USUAL_M, units: str = "si",
             route: Path | str | None = None, localized_m_per_km: float | None = None) -> Sections:
    """The drives of segment logs in sections of one length, each from its own beginning.

    logs      folders at any depth, or files, of segment logs; open ones too
    length    of a section, with its unit (``0.1mi``: 23 CFR 490), or in metres
    units     of the text: si or us
    route     GeoJSON of one LineString, with ``begin_km`` and ``end_km`` or points with ``km`` beside it: sections then
              are of its measures, for each pass over it, along or against it

    localized_m_per_km    list where the IRI over 25 ft, which slides along, is above this (AASHTO R 54)

    The standard error of a section counts what its windows' errors share; where the logs of an older version do not say
    what that is, neighbours count as sharing all. Rows flagged ``unsettled`` stand in no mean.

    Raises BadInput for no log, none with an intact row, lengths from under 25 ft or beyond 100 km, and a file that is
    no route.

    >>> found = sections(folder / "logs", "0.1mi")
    >>> bool((found.known_m <= found.length_m + 1e-6).all())
    True
    """
    from logger.left_out import left_out_json, left_out_paragraph
    from logger.report.drive_sections import drive_sections
    from logger.report.left_rows import of_sections
    from logger.report.sections_text import as_json, lines
    from logger.store.log.log_reader import find_logs_in, read_found

    length_m = length_of(length if isinstance(length, str) else f"{length:f}m")
    if localized_m_per_km is not None:
        check_limit("localized_m_per_km", localized_m_per_km)
    if units not in SYSTEMS:
        raise BadInput(f"units {units}: expected one of {', '.join(SYSTEMS)}")
    places = [Path(logs)] if isinstance(logs, str | Path) else [Path(one) for one in logs]
    files = read_found(find_logs_in(places))
    if not any(one.records for one in files):
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row")
    drives = tuple(drive_sections(files, length_m) if route is None else _on_route(files, route, length_m))
    left = of_sections(files, [row for one in drives for row in one.records], route is not None)
    figures = [one.figures for one in drives]
    known_m, iri, std, a_w, speed_mps = (_joined([getattr(one, name) for one in figures]) for name in (
        "known_m", "iri_m_per_km", "iri_std_m_per_km", "a_w_mps2", "speed_mps"))
    return Sections(
        "\n".join([*lines(drives, length_m, units, localized_m_per_km), *left_out_paragraph(left)]),
        as_json(drives, length_m, localized_m_per_km) | left_out_json(left), length_m,
        np.repeat(np.arange(len(drives)), [len(one.condition) for one in drives]),
        _joined([one.edges_m[:-1] for one in figures]), _joined([one.ends_m for one in drives]), known_m, iri, std, a_w,
        speed_mps, np.array([word for one in drives for word in one.condition], dtype=np.str_), drives)


def _on_route(files: Sequence[LoggedFile], path: Path | str, length_m: float) -> Iterator[DriveSections]:
    from logger.report.drive_sections import route_sections
    from logger.roads.linear_reference import measures, route_network
    from logger.store.formats.route_file import read_route

    route = read_route(path)
    try:
        measure_m = measures(route.lat_deg, route.lon_deg, route.begin_m, route.end_m,
                             np.column_stack([route.post_lat_deg, route.post_lon_deg]), route.post_m)
        network = route_network(route.lat_deg, route.lon_deg, measure_m)
    except ValueError as error:
        raise BadInput(f"{path}: {error}") from None
    return route_sections(files, network, float(measure_m[0]), length_m)


def _joined(arrays: Sequence[Array]) -> Array:
    return np.concatenate(arrays) if arrays else np.zeros(0)
