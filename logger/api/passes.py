"""Repeated drives of logs, combined by place and direction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.log_questions import PassesQuestion, length_of
from logger.api.question import function
from logger.api.shown import CommandResult
from logger.errors import BadInput
from logger.roads.sections import FAIR_TO_IN_PER_MI
from logger.units import INCH_PER_MILE_M_PER_KM, US_PER_S

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.exchange.layer import Layer
    from logger.report.combined_drives import CombinedDrives
    from logger.report.html import Html

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class RepeatedDrives(CommandResult):
    """Cells of road (k,), one for each place and direction, with the mean of all drives over them; NaN: not known.

    drives                            (k,) how many passed each
    iri_m_per_km, iri_std_m_per_km    (k,) mean weighted by the passes' errors, and its standard error, with what is
                                      common to a drive
    a_w_mps2                          (k,) weighted r.m.s. acceleration, mean of the passes (ISO 2631-1)
    lat_deg, lon_deg, heading_deg     (k,) where, and in which direction, clockwise from north
    """

    drives: npt.NDArray[np.intp]
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    a_w_mps2: Array
    lat_deg: Array
    lon_deg: Array
    heading_deg: Array
    _found: CombinedDrives

    title: ClassVar[str] = "Passes"

    def charts(self) -> Sequence[Chart]:
        """The IRI of the way that most cells lie on."""
        from logger.chart_data import Curves, Line
        from logger.report.combined_drives import chains

        longest = max(chains(self._found), key=len, default=None)
        if longest is None:
            return []
        at_m: Array = self._found.length_m * (np.arange(len(longest), dtype=np.float64) + 0.5)
        return [Curves("Mean of the drives over the longest way", "distance [m]", "IRI [m/km]", (
            Line("IRI", at_m, self.iri_m_per_km[longest], self.iri_std_m_per_km[longest]),))]

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the cells, or the places to visit, in the format of the file's ending."""
        from logger.exchange.format import write_layer

        write_layer(self.visits() if option == "--visit" else self.layer(), path)

    def layer(self) -> Layer:
        """Cells as lines, for the formats of ``convert``."""
        from logger.report.passes_layer import cells_layer

        return cells_layer(self._found)

    def visits(self) -> Layer:
        """Places to visit as points, the most urgent first, for the formats of ``convert``; waypoints in GPX."""
        from logger.report.passes_layer import visits_layer

        return visits_layer(self._found)

    def as_page(self, of: str) -> Html:
        """Map, curves and tables as one page."""
        from logger.report.passes_page import passes_page

        return passes_page(self._found)


def _day_s(day: str) -> float:
    """The beginning of a day such as 2026-04-30 in UTC [s since 1970]."""
    return datetime.fromisoformat(day).replace(tzinfo=UTC).timestamp()


def combined(question: PassesQuestion) -> RepeatedDrives:
    """The answer to ``PassesQuestion``, which says what is raised."""
    from logger.left_out import left_out_json, left_out_paragraph
    from logger.report.combined_drives import combined_drives
    from logger.report.left_rows import of_passes
    from logger.report.passes_text import as_json, lines
    from logger.store.log.log_reader import find_logs_in, read_found

    since, until, places = question.since, question.until, question.places
    first_s, end_s = -np.inf if since is None else _day_s(since), np.inf if until is None else _day_s(until)
    above_m_per_km = question.above_m_per_km or FAIR_TO_IN_PER_MI * INCH_PER_MILE_M_PER_KM
    split_s = None if question.split is None else _day_s(question.split)
    files = read_found(find_logs_in(places))
    records = [one for file in files for one in file.records]
    if since is not None or until is not None:
        records = [one for one in records if one.utc_us is not None and first_s <= one.utc_us / US_PER_S < end_s]
    if not records:
        raise BadInput(f"{', '.join(map(str, places))}: expected a log with at least one intact row"
                       + (" of these days" if since or until else ""))
    found = combined_drives(records, length_of(question.length), above_m_per_km, split_s)
    left = of_passes(files, records, found.placed)
    return RepeatedDrives(
        "\n".join([*lines(found), *left_out_paragraph(left)]), as_json(found) | left_out_json(left),
        found.iri.drives, found.iri.iri_m_per_km, found.iri.iri_std_m_per_km,
        found.a_w_mps2, found.lat_deg, found.lon_deg, found.heading_deg, found)


passes = function("passes", PassesQuestion, combined)
