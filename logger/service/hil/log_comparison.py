"""Does the log of a drive that came through real wires say what a replay of the same bytes says?

Problem. The rows cannot be the same to the byte: bytes that pass an adapter, a kernel and a waiting thread get their
time a little later than in the recording, by an amount that wobbles. A sample may so fall into the window beside its
own, and the position of the car at a sample moves by the speed times that wobble. Nor does the log begin where the
recording does, or know when it has ended.

Solution. The session and the shift between the two monotonic clocks are found by the rows' UTC, which comes from the
receiver's own sentences. Then each expected row is paired with the row that begins at the same travelled distance (one
without a distance: at the same time), and each pair may differ by the ``TOLERANCES``, which are what a wobble of a few
times 10 ms, the step of the sample grid, can do. One row in fifty, or one, may lie outside, for neither computer is a
real-time one. No row may be missing or stand twice, and none may be there that was not expected. Every column of the
log is compared: the words with the figure of their own row, numbers that count on from the start less what they differ
by in the middle.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import takewhile
from math import inf, nan
from pathlib import Path
from typing import Any

import numpy as np

from logger.comfort.iso2631 import comfort_word
from logger.geodesy import apart_m
from logger.records import WindowRecord
from logger.roads.iso8608 import iri_class
from logger.service.pipeline import longest_wait_us
from logger.service.signal_chain import LEAST_WORD
from logger.store.log.log_name import log_name
from logger.store.log.row_format import read_log
from logger.store.log.sidecar import sidecar_or_nothing
from logger.units import US_PER_S

_LATE_FLAGS = frozenset({"time_unset"})  # goes from the rows when their file is finished


@dataclass(frozen=True)
class LoggedSession:
    """The rows of one start of the service, in order; ``is_open``: it may still be writing; ``repeated``: so many rows
    stand twice in one file, or in two finished ones."""

    number: int
    rows: tuple[WindowRecord, ...]
    is_open: bool
    repeated: int = 0


Pair = tuple[WindowRecord, WindowRecord]
Measure = Callable[[WindowRecord, WindowRecord], float | None]


def _of(attribute: str, per: float = 1.0) -> Measure:
    """The difference of a column, ``per`` so much of its own unit."""
    def measure(wanted: WindowRecord, found: WindowRecord) -> float | None:
        apart = _apart(getattr(wanted, attribute), getattr(found, attribute))
        return None if apart is None else apart / per
    return measure


def _apart(wanted: float | None, found: float | None) -> float | None:
    """None: neither side knows; infinite: one side does."""
    if wanted is None and found is None:
        return None
    return inf if wanted is None or found is None else abs(found - wanted)


def _length_m(row: WindowRecord) -> float | None:
    return None if row.distance_end_m is None or row.distance_start_m is None \
        else row.distance_end_m - row.distance_start_m


def _comfort_contradicts(_wanted: WindowRecord, found: WindowRecord) -> float:
    word = comfort_word(found.a_w_mps2) if found.a_w_mps2 is not None else ""
    return 0.0 if found.comfort in ((LEAST_WORD, "") if "hidden" in found.flags else (word,)) else inf


def _class_contradicts(_wanted: WindowRecord, found: WindowRecord) -> float:
    word = iri_class(found.iri_m_per_km) if found.iri_m_per_km is not None else ""
    return 0.0 if found.iri_class == word else inf


def _place_apart_m(wanted: WindowRecord, found: WindowRecord) -> float | None:
    """On the ground. None: neither side knows; infinite: one side does."""
    if {wanted.lat_deg, wanted.lon_deg, found.lat_deg, found.lon_deg} == {None}:
        return None
    ground_m = apart_m(wanted, found)
    return inf if ground_m is None else ground_m


@dataclass(frozen=True)
class RowTolerance:
    """How far a quantity may differ: by ``least``, or by a share of ``of`` the expected row where that is more.

    measure    how far two rows are apart in it; None: neither side knows it; infinite: one side does
    """

    quantity: str
    unit: str
    least: float
    why: str
    measure: Measure
    share: float = 0.0
    of: str = ""

    def limit(self, expected: WindowRecord) -> float:
        """The most that may differ in this row."""
        scale = getattr(expected, self.of) if self.of else None
        return max(self.least, self.share * scale) if scale is not None else self.least


def _scaled(quantity: str, unit: str, why: str, share: float, column: str, least: float = 0.03) -> RowTolerance:
    """Of a column by a share of itself."""
    return RowTolerance(quantity, unit, least, why, _of(column), share, column)


_COMFORT = (("a_w", "a_w", "m/s2", "mps2"), ("MTVV", "mtvv", "m/s2", "mps2"), ("VDV", "vdv", "m/s1.75", "mps175"))

TOLERANCES = (
    RowTolerance("start", "s", 0.03, "three steps of the sample grid", _of("t_us", per=US_PER_S)),
    RowTolerance("UTC", "s", 0.1, "adapters may delay the first bytes of a fix by this much",
                 _of("utc_us", per=US_PER_S)),
    RowTolerance("duration", "s", 0.05, "a start and an end", _of("duration_s")),
    RowTolerance("distance", "m", 0.75, "where a drive is cut by time, 0.03 s at 25 m/s", _of("distance_start_m")),
    RowTolerance("length", "m", 0.75, "as the distance",
                 lambda wanted, found: _apart(_length_m(wanted), _length_m(found))),
    RowTolerance("place", "m", 1.0, "as the distance, and the digits of the log", _place_apart_m),
    RowTolerance("speed", "m/s", 0.1, "0.03 s of braking at 3 m/s2", _of("speed_mps")),
    _scaled("a_w", "m/s2", "one sample in thirty belongs to the next window", 0.1, "a_w_mps2"),
    _scaled("accel rms", "m/s2", "as a_w", 0.1, "accel_rms_mps2"),
    _scaled("MTVV", "m/s2", "as a_w; its greatest second may end in the next window", 0.15, "mtvv_mps2"),
    _scaled("VDV", "m/s1.75", "as a_w", 0.15, "vdv_mps175"),
    *(_scaled(f"{name} {kind}", unit, f"as {name}", share, f"{column}_{kind}_{suffix}")
      for kind, share in (("std", 0.25), ("raw", 0.15)) for name, column, unit, suffix in _COMFORT),
    _scaled("crest", "", "a peak at the edge belongs to the next window", 0.2, "crest_factor", 0.3),
    RowTolerance("comfort", "", 0, "the words for the row's own a_w", _comfort_contradicts),
    RowTolerance("IRI", "m/km", 0.1, "far below what the estimate claims to know", _of("iri_m_per_km"), 0.25,
                 "iri_std_m_per_km"),
    *(_scaled(f"IRI {part}std", "m/km", "as the IRI", 0.25, f"iri_{part.replace(' ', '_')}std_m_per_km", 0.1)
      for part in ("", "level ", "common ", "place ")),
    _scaled("IRI rms", "m/km", "in proportion to the r.m.s. acceleration", 0.1, "iri_rms_m_per_km", 0.1),
    RowTolerance("class", "", 0, "that of the row's own IRI", _class_contradicts),
    RowTolerance("samples", "", 4, "as the duration, at 100 Hz", _of("samples")),
    RowTolerance("clipped", "", 3, "a start and an end", _of("clipped_samples")),
    RowTolerance("segment", "", 0, "counted on", _of("segment")),
    RowTolerance("drive", "", 0, "counted on", _of("drive")),
)


@dataclass(frozen=True)
class Difference:
    """One quantity over all pairs of rows: 95 of 100 and all differ at most by ``p95`` and ``largest`` (nan: it is in
    none). ``outside`` counts rows beyond the tolerance, and those where only one side knows it."""

    tolerance: RowTolerance
    compared: int
    p95: float
    largest: float
    outside: int

    @property
    def ok(self) -> bool:
        """At most one row in fifty, or one, lies outside."""
        return self.outside <= _may_be_outside(self.compared)


@dataclass(frozen=True)
class LogAgreement:
    """What the comparison found.

    session          number of the session that was compared; None: none holds rows of this drive
    clock_shift_s    the service's monotonic clock minus that of the recording [s]
    moved_before_m   distance that the service had counted before: expected rows then begin elsewhere [m]
    missing          segments that are expected and not there, by their number in the replay
    pending          expected rows at the end that an open log does not hold yet
    surplus          rows between the first and the last pair that were not expected, by their segment
    repeated         rows that stand twice
    flags_differ     pairs with other flags
    """

    session: int | None
    expected: int
    matched: int
    clock_shift_s: float
    moved_before_m: float
    missing: tuple[int, ...]
    pending: int
    surplus: tuple[int, ...]
    repeated: int
    flags_differ: int
    differences: tuple[Difference, ...]

    @property
    def ok(self) -> bool:
        """Every row that must be there is, none else, and all agree."""
        return (self.matched > 0 and not self.missing and not self.surplus and not self.repeated
                and self.flags_differ <= _may_be_outside(self.matched)
                and all(difference.ok for difference in self.differences))


def read_sessions(directory: Path) -> list[LoggedSession]:
    """The sessions whose logs lie in a folder, oldest first. Raises ``OSError``."""
    files: dict[int, list[tuple[int, bool, Path]]] = defaultdict(list)
    for path in directory.iterdir():
        if name := log_name(path):
            files[name.session].append((name.part, not name.is_open, path))
    sessions = []
    for number, parts in sorted(files.items()):
        # A row that stands in two parts was written again after the disk had failed: the later one counts.
        rows: dict[int, WindowRecord] = {}
        finished_segments: set[int] = set()
        repeated = 0
        for _, is_finished, path in sorted(parts):
            records = read_log(path).records
            own = {row.segment for row in records}
            repeated += len(records) - len(own)
            if is_finished:
                repeated += len(own & finished_segments)
                finished_segments |= own
            rows |= {row.segment: row for row in records}
        is_open = not all(finished for _, finished, _ in parts)
        sessions.append(LoggedSession(number, tuple(rows[segment] for segment in sorted(rows)), is_open, repeated))
    return sessions


def newest_sidecar(directory: Path) -> dict[str, Any]:
    """What lies beside the newest log in a folder; nothing where there is none. Raises ``OSError``."""
    logs = [(name.session, name.part, path) for path in directory.iterdir() if (name := log_name(path))]
    return sidecar_or_nothing(max(logs)[2]) if logs else {}


def compare(expected: Sequence[WindowRecord], sessions: Sequence[LoggedSession], bridge_s: float) -> LogAgreement:
    """Hold the expected rows against those of the session that holds most of them, the latest of several. In an open
    log the last may still be waited for, by a service that bridges losses of fix of ``bridge_s`` [s]."""
    anchors = [(_anchors(expected, rows), session, rows) for session in sessions for rows in [_last_pass(session.rows)]]
    pairs, session, rows = max(anchors, key=lambda found: (len(found[0]), found[1].number), default=([], None, ()))
    if session is None or not pairs:
        return LogAgreement(None, len(expected), 0, nan, nan, tuple(row.segment for row in expected), 0, (), 0, 0, ())
    shift_us = round(float(np.median([found.t_us - wanted.t_us for wanted, found in pairs])))
    moved_m = _median([found.distance_start_m - wanted.distance_start_m for wanted, found in pairs
                       if found.distance_start_m is not None and wanted.distance_start_m is not None])
    matched = _pairs(expected, rows, shift_us)
    if session.is_open:
        matched = _before_utc(matched)
    aligned = _aligned(matched, shift_us)
    differences = tuple(_difference(tolerance, aligned) for tolerance in TOLERANCES)
    held = {wanted.segment for wanted, _ in matched}
    absent = [row for row in expected if row.segment not in held]
    pending = _pending(expected, absent, longest_wait_us(bridge_s)) if session.is_open else 0
    return LogAgreement(
        session=session.number,
        expected=len(expected),
        matched=len(matched),
        clock_shift_s=shift_us / US_PER_S,
        moved_before_m=moved_m,
        missing=tuple(row.segment for row in absent[:len(absent) - pending]),
        pending=pending,
        surplus=_surplus(rows, {found.segment for _, found in matched}),
        repeated=session.repeated,
        flags_differ=sum(not set(wanted.flags) ^ set(found.flags) <= _LATE_FLAGS for wanted, found in matched),
        differences=differences,
    )


def _last_pass(rows: Sequence[WindowRecord]) -> Sequence[WindowRecord]:
    """The rows since UTC last went back: of a recording that was sent twice, the second time."""
    begin = 0
    before_us: int | None = None
    for index, row in enumerate(rows):
        if row.utc_us is not None:
            if before_us is not None and row.utc_us < before_us - US_PER_S:
                begin = index
            before_us = row.utc_us
    return rows[begin:]


def _anchors(expected: Sequence[WindowRecord], rows: Sequence[WindowRecord]) -> list[Pair]:
    """Rows that begin at about the same UTC."""
    same_utc_us = 500_000
    dated = sorted(((row.utc_us, row) for row in rows if row.utc_us is not None), key=lambda entry: entry[0])
    times = [utc_us for utc_us, _ in dated]
    pairs = []
    for wanted in expected:
        near = _nearest(times, wanted.utc_us) if wanted.utc_us is not None else None
        if near is not None and abs(times[near] - (wanted.utc_us or 0)) <= same_utc_us:
            pairs.append((wanted, dated[near][1]))
    return pairs


def _pairs(expected: Sequence[WindowRecord], rows: Sequence[WindowRecord], shift_us: int) -> list[Pair]:
    """Each expected row with the one that is the same window; none is taken twice."""
    same_start_m, same_start_us = 1.0, 1_000_000
    by_distance = [row for row in rows if row.distance_start_m is not None]
    by_time = [row for row in rows if row.distance_start_m is None]
    starts_m = [row.distance_start_m or 0.0 for row in by_distance]
    starts_us = [row.t_us for row in by_time]
    taken: set[int] = set()
    pairs = []
    for wanted in expected:
        if wanted.distance_start_m is None:
            near = _nearest(starts_us, wanted.t_us + shift_us)
            found = by_time[near] if near is not None else None
            same = found is not None and abs(found.t_us - wanted.t_us - shift_us) <= same_start_us
        else:
            near = _nearest(starts_m, wanted.distance_start_m)
            found = by_distance[near] if near is not None else None
            same = found is not None and abs((found.distance_start_m or 0.0) - wanted.distance_start_m) <= same_start_m
        if found is not None and same and found.segment not in taken:
            taken.add(found.segment)
            pairs.append((wanted, found))
    return pairs


def _before_utc(pairs: Sequence[Pair]) -> list[Pair]:
    """The pairs of an open log; the expected rows that come before the service had learned UTC are without it too.
    Such rows get it when their file is finished. How many they are is chance: a fix may come as a row is written."""
    undated = list(takewhile(lambda pair: pair[1].utc_us is None, pairs))
    return [(replace(wanted, utc_us=None), found) for wanted, found in undated] + list(pairs[len(undated):])


def _aligned(pairs: Sequence[Pair], shift_us: int) -> list[Pair]:
    """The pairs with clock, segments and drives as in the replay; without rows before, no drive was before either."""
    segments = round(_median([found.segment - wanted.segment for wanted, found in pairs]))
    drives = round(_median([found.drive - wanted.drive for wanted, found in pairs])) if segments else 0
    return [(wanted, replace(found, t_us=found.t_us - shift_us, segment=found.segment - segments,
                             drive=found.drive - drives)) for wanted, found in pairs]


def _nearest(values: Sequence[float], wanted: float) -> int | None:
    """Index of the value nearest to ``wanted``; the values rise."""
    if not values:
        return None
    right = bisect_left(values, wanted)
    return min((index for index in (right - 1, right) if 0 <= index < len(values)),
               key=lambda index: abs(values[index] - wanted))


def _pending(expected: Sequence[WindowRecord], absent: Sequence[WindowRecord], wait_us: int) -> int:
    """How many of the absent rows are the last ones, and ended so late that they may still be waited for."""
    count = 0
    since_us = _end_us(expected[-1]) - wait_us
    for wanted, last in zip(reversed(expected), reversed(absent), strict=False):
        if wanted is not last or _end_us(wanted) < since_us:
            break
        count += 1
    return count


def _end_us(row: WindowRecord) -> int:
    return row.t_us + round(row.duration_s * US_PER_S)


def _surplus(rows: Sequence[WindowRecord], held: set[int]) -> tuple[int, ...]:
    first, last = min(held, default=0), max(held, default=0)
    return tuple(row.segment for row in rows if first < row.segment < last and row.segment not in held)


def _difference(tolerance: RowTolerance, pairs: Sequence[Pair]) -> Difference:
    found = [(tolerance.measure(wanted, row), tolerance.limit(wanted)) for wanted, row in pairs]
    known = [(value, limit) for value, limit in found if value is not None]
    finite = [value for value, _ in known if value != inf]
    return Difference(tolerance=tolerance, compared=len(known), p95=float(np.percentile(finite, 95)) if finite else nan,
                      largest=float(max(finite, default=nan)),
                      outside=sum(bool(value > limit) for value, limit in known))


def _may_be_outside(count: int) -> int:
    outside_share = 0.02
    return max(1, int(outside_share * count))


def _median(values: Sequence[float]) -> float:
    return float(np.median(values)) if values else nan
