"""What of logs stands in no figure, and why."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from logger.left_out import LeftOut, counting
from logger.records import WindowRecord
from logger.report.placed_rows import placed
from logger.report.summary import counts
from logger.store.log.log_reader import LoggedFile

_VERIFY = "('ridelog verify' lists them)"


def damaged(lines: int) -> LeftOut:
    """Lines of logs that cannot be read."""
    return LeftOut(lines, "damaged line", _VERIFY)


def of_files(files: Sequence[LoggedFile]) -> tuple[LeftOut, ...]:
    """What of logs cannot be read."""
    return counting([damaged(sum(one.damaged_lines for one in files))])


def of_passes(files: Sequence[LoggedFile], rows: Sequence[WindowRecord], figures_of: int) -> tuple[LeftOut, ...]:
    """Of rows by place: of the days that count are ``rows``, and on the ground of several in a drive are
    ``figures_of``."""
    every = sum(len(one.records) for one in files)
    known = sum(placed(one) and not _has_iri(one) for one in rows)
    return counting((*of_files(files), LeftOut(every - len(rows), "row", "of other days, or without a date"),
                     LeftOut(len(rows) - figures_of, "row", "without a place"),
                     LeftOut(known, "row", "without an IRI that counts")))


def of_sections(files: Sequence[LoggedFile], used: Collection[WindowRecord], on_route: bool) -> tuple[LeftOut, ...]:
    """Of rows by their way, or by a route."""
    every = sum(len(one.records) for one in files)
    why = "off the route, or without a place" if on_route else "without a way"
    return counting((*of_files(files), LeftOut(every - len(used), "row", why),
                     LeftOut(sum(not _has_iri(one) for one in used), "row", "without an IRI that counts")))


def _has_iri(one: WindowRecord) -> bool:
    return one.iri_m_per_km is not None and counts(one)
