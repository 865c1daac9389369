"""Logs in sections of road, as agencies file them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.log_questions import SectionsQuestion, length_of
from logger.api.question import function
from logger.api.shown import CommandResult
from logger.errors import BadInput

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.exchange.layer import Layer
    from logger.report.drive_sections import DriveSections
    from logger.store.log.log_reader import LoggedFile

Array = npt.NDArray[np.float64]


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

    title: ClassVar[str] = "Sections"

    def charts(self) -> Sequence[Chart]:
        """The IRI of the sections along each drive."""
        from logger.report.sections_text import charts

        return charts(self._drives)

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the rows in the format of the file's ending."""
        from logger.exchange.format import write_layer

        write_layer(self.layer(), path)

    def layer(self) -> Layer:
        """Rows with places, for the formats of ``convert``."""
        from logger.report.sections_layer import sections_layer

        return sections_layer(self._drives)


def sections_of(question: SectionsQuestion) -> Sections:
    """The answer to ``SectionsQuestion``, which says what is raised."""
    from logger.left_out import left_out_json, left_out_paragraph
    from logger.report.drive_sections import drive_sections
    from logger.report.left_rows import of_sections
    from logger.report.sections_text import as_json, lines
    from logger.store.log.log_reader import find_logs_in, read_found

    length_m, route, places = length_of(question.length), question.route, question.places
    units, localized_m_per_km = question.units, question.localized_m_per_km
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


sections = function("sections", SectionsQuestion, sections_of)


def _on_route(files: Sequence[LoggedFile], path: Path | str, length_m: float) -> Iterator[DriveSections]:
    from logger.report.drive_sections import route_sections
    from logger.roads.road_matching import measures, route_network
    from logger.store.formats.road_lines import read_route

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
