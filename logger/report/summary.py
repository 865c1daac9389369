"""A drive in a few figures: what the terminal and the page both say.

Lengths weigh, not rows: a window by time has no length and counts in the time only. The roughest places are single
windows, but of those within ``APART_M`` of each other, on the ground, only the worst is named, so that one pothole,
or a bad bridge driven both ways, does not fill the list.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from logger.comfort.iso2631 import COMFORT_WORDS
from logger.records import WindowRecord
from logger.roads.iso8608 import CLASS_GD_N0_CM3, iri_from_gd_n0
from logger.store.log.log_reader import along_m, apart_m, end_utc_us, iso_utc, length_m, split_drives

APART_M = 50.0
PLACES = 5

IRI_CLASSES: Mapping[str, str] = {
    "A": "very good", "B": "good", "C": "average", "D": "poor", "E": "very poor", "F": "extremely poor",
    "G": "extremely poor", "H": "extremely poor",
}
"""ISO 8608 letters, best first, in words: of all roads, also of earth. A highway of class A may be poor by 23 CFR 490,
so the words stand beside no agency's condition."""

COMFORT_NAMES = tuple(word for _, word in sorted(COMFORT_WORDS))
"""ISO 2631 words, best first."""

_DOUBTFUL = frozenset({"unsettled", "gap", "partial", "stationary"})
_HIDDEN = "hidden"
NOT_COUNTED = frozenset({"unsettled"})
"""Windows whose figures stand in no mean and no share: the filters still knew nothing of the ride."""


@dataclass(frozen=True)
class Share:
    """How much of the distance has one name. ``name`` is empty for the distance without a value."""

    name: str
    distance_m: float
    share: float


@dataclass(frozen=True)
class RoughWindow:
    """A rough window. ``along_m`` is where its middle lies on the way through all rows [m], ``drive`` counts the drives
    of these rows from 1 on."""

    drive: int
    along_m: float
    utc_us: int | None
    lat_deg: float | None
    lon_deg: float | None
    speed_mps: float | None
    iri_m_per_km: float
    iri_std_m_per_km: float | None
    a_w_mps2: float | None
    comfort: str
    flags: tuple[str, ...]


@dataclass(frozen=True)
class DriveSummary:
    """Some rows in figures. None: not known.

    start_utc_us, end_utc_us    the earliest and the latest UTC of the rows, whatever their order
    duration_s                  time inside windows; blind_s of it without speed, so without distance
    mean_iri_m_per_km           mean over the distance that has an IRI, but for windows flagged ``unsettled``
    a_w_mps2                    weighted r.m.s. acceleration over the time inside windows, but for those
    iri_classes, comfort        shares of the distance, best first; what has no value that counts comes last
    roughest                    worst first
    flags                       word to number of rows, the most frequent first
    """

    windows: int
    drives: int
    start_utc_us: int | None
    end_utc_us: int | None
    distance_m: float
    duration_s: float
    blind_s: float
    mean_speed_mps: float | None
    mean_iri_m_per_km: float | None
    a_w_mps2: float | None
    iri_classes: tuple[Share, ...]
    comfort: tuple[Share, ...]
    roughest: tuple[RoughWindow, ...]
    flags: Mapping[str, int]


def summarise(records: Sequence[WindowRecord]) -> DriveSummary:
    """Sum up rows in the order of their making, also of several drives."""
    lengths_m = [length_m(record) for record in records]
    distance_m = sum(lengths_m)
    blind_s = sum(record.duration_s for record in records if record.distance_end_m is None)
    duration_s = sum(record.duration_s for record in records)
    starts_us = [record.utc_us for record in records if record.utc_us is not None]
    ends_us = [end_us for record in records if (end_us := end_utc_us(record)) is not None]
    mean_iri = _mean((record.iri_m_per_km, length) for record, length in zip(records, lengths_m, strict=True)
                     if counts(record))
    mean_square = _mean((expected_square(record), record.duration_s) for record in records if counts(record))
    return DriveSummary(
        windows=len(records),
        drives=len(split_drives(records)),
        start_utc_us=min(starts_us, default=None),
        end_utc_us=max(ends_us, default=None),
        distance_m=distance_m,
        duration_s=duration_s,
        blind_s=blind_s,
        mean_speed_mps=distance_m / (duration_s - blind_s) if distance_m > 0 and duration_s > blind_s else None,
        mean_iri_m_per_km=mean_iri,
        a_w_mps2=None if mean_square is None else mean_square**0.5,
        iri_classes=_shares(records, lengths_m, tuple(IRI_CLASSES), lambda record: record.iri_class),
        comfort=_shares(records, lengths_m, COMFORT_NAMES, lambda record: record.comfort),
        roughest=_roughest(records),
        flags=dict(Counter(flag for record in records for flag in record.flags).most_common()),
    )


def expected_square(record: WindowRecord) -> float | None:
    """Of the weighted acceleration of a window, as it is expected: what is open of it counts too [(m/s2)2]. Of a ride
    that hides, of which no value is known, the middle between nothing and all that was read: without these rows, which
    are smooth ones, the mean of a drive would be too high."""
    if record.a_w_mps2 is not None:
        return record.a_w_mps2**2 + (record.a_w_std_mps2 or 0.0)**2
    return record.a_w_raw_mps2**2 / 2 if record.a_w_raw_mps2 is not None and _HIDDEN in record.flags else None


def counts(record: WindowRecord) -> bool:
    """Tell whether a row's figures may stand in a mean."""
    return not NOT_COUNTED.intersection(record.flags)


def summary_json(summary: DriveSummary) -> dict[str, Any]:
    """The summary as JSON can hold it; instants as ISO 8601."""
    fields = asdict(summary)
    for entry in (fields, *fields["roughest"]):
        for key in [key for key in entry if key.endswith("utc_us")]:
            entry[key.removesuffix("_us")] = iso_utc(entry.pop(key))
    return fields


def class_limits_m_per_km(letter: str) -> tuple[float | None, float | None]:
    """IRI at the lower and the upper end of a class [m/km]; None where it is open.

    A class reaches from half to twice its geometric mean degree of roughness (ISO 8608, Table 2.2 of Blum 2015).
    """
    mean_gd_cm3 = CLASS_GD_N0_CM3[letter]
    letters = tuple(CLASS_GD_N0_CM3)
    lower = None if letter == letters[0] else iri_from_gd_n0(mean_gd_cm3 / 2)
    upper = None if letter == letters[-1] else iri_from_gd_n0(mean_gd_cm3 * 2)
    return lower, upper


def _mean(weighted: Iterable[tuple[float | None, float]]) -> float | None:
    known = [(value, weight) for value, weight in weighted if value is not None]
    total = sum(weight for _, weight in known)
    return sum(value * weight for value, weight in known) / total if total > 0 else None


def _shares(records: Sequence[WindowRecord], lengths_m: Sequence[float], names: tuple[str, ...],
            name_of: Callable[[WindowRecord], str]) -> tuple[Share, ...]:
    """Distance per name, all names that lie between the best and the worst that occur, then the rest."""
    sums: dict[str, float] = dict.fromkeys(names, 0.0)
    rest = 0.0
    for record, length in zip(records, lengths_m, strict=True):
        if counts(record) and name_of(record) in sums:
            sums[name_of(record)] += length
        else:
            rest += length
    total = sum(lengths_m)
    if total <= 0:
        return ()
    worst = max((index for index, name in enumerate(names) if sums[name] > 0), default=-1)
    shares = [Share(name, sums[name], sums[name] / total) for name in names[:worst + 1]]
    return tuple([*shares, Share("", rest, rest / total)] if rest > 0 else shares)


def _roughest(records: Sequence[WindowRecord]) -> tuple[RoughWindow, ...]:
    numbered = [(number, record) for number, drive in enumerate(split_drives(records), start=1) for record in drive]
    candidates = [
        RoughWindow(drive, along, record.utc_us, record.lat_deg, record.lon_deg, record.speed_mps, record.iri_m_per_km,
              record.iri_std_m_per_km, record.a_w_mps2, record.comfort, record.flags)
        for (drive, record), along in zip(numbered, along_m(records), strict=True)
        if record.iri_m_per_km is not None and not _DOUBTFUL.intersection(record.flags)
    ]
    found: list[RoughWindow] = []
    for place in sorted(candidates, key=lambda place: -place.iri_m_per_km):
        if all(_apart_m(place, other) >= APART_M for other in found):
            found.append(place)
            if len(found) == PLACES:
                break
    return tuple(found)


def _apart_m(one: RoughWindow, other: RoughWindow) -> float:
    ground_m = apart_m(one, other)
    return abs(one.along_m - other.along_m) if ground_m is None else ground_m
