"""A drive in a few figures: what the terminal and the page both say.

Lengths weigh, not rows: a window by time has no length and counts in the time only. The roughest places are single
windows, but of those within ``APART_M`` of each other, on the ground, only the worst is named, so that one pothole,
or a bad bridge driven both ways, does not fill the list.

At a terminal it is one screen of text, whether it can draw blocks or not.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from logger.comfort.iso2631 import COMFORT_WORDS
from logger.geodesy import apart_m
from logger.printable import counted, span_words
from logger.records import WindowRecord
from logger.roads.iso8608 import CLASS_GD_N0_CM3, iri_from_gd_n0
from logger.store.log.log_reader import along_m, end_utc_us, iso_utc, length_m, split_drives, utc

IRI_CLASSES: Mapping[str, str] = {"A": "very good", "B": "good", "C": "average", "D": "poor", "E": "very poor",
                                  "F": "extremely poor", "G": "extremely poor", "H": "extremely poor"}
"""ISO 8608 letters, best first, in words: of all roads, also of earth. A highway of class A may be poor by 23 CFR 490,
so the words stand beside no agency's condition."""

COMFORT_NAMES = tuple(word for _, word in sorted(COMFORT_WORDS))  # ISO 2631 words, best first
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
    nearest_m, most = 50.0, 5
    numbered = [(number, record) for number, drive in enumerate(split_drives(records), start=1) for record in drive]
    candidates = [RoughWindow(drive, along, record.utc_us, record.lat_deg, record.lon_deg, record.speed_mps,
                              record.iri_m_per_km, record.iri_std_m_per_km, record.a_w_mps2, record.comfort,
                              record.flags)
                  for (drive, record), along in zip(numbered, along_m(records), strict=True)
                  if record.iri_m_per_km is not None and not _DOUBTFUL.intersection(record.flags)]
    found: list[RoughWindow] = []
    for place in sorted(candidates, key=lambda place: -place.iri_m_per_km):
        if all((abs(place.along_m - other.along_m) if (ground_m := apart_m(place, other)) is None else ground_m)
               >= nearest_m for other in found):
            found.append(place)
            if len(found) == most:
                break
    return tuple(found)


_EIGHTHS = " ▏▎▍▌▋▊▉█"


def screen(summary: DriveSummary, encoding: str) -> str:
    """The lines a person reads after a drive; bars of plain signs where ``encoding`` has no finer ones."""
    drawn = _can_encode(_EIGHTHS, encoding)
    lines = [f"{counted(summary.drives, 'drive')}, {distance_words(summary.distance_m)} in "
             f"{span_words(summary.duration_s)} · {date_words(summary)}"]
    values = [
        "" if summary.mean_iri_m_per_km is None else f"mean IRI {summary.mean_iri_m_per_km:.1f} m/km",
        "" if summary.a_w_mps2 is None else f"comfort a_w {summary.a_w_mps2:.2f} m/s²",
        "" if summary.mean_speed_mps is None else f"mean speed {summary.mean_speed_mps * 3.6:.0f} km/h",
    ]
    lines += [" · ".join(value for value in values if value), ""]
    lines += ["Road roughness (IRI, by the classes of ISO 8608)", *_bars(summary.iri_classes, class_words, drawn), ""]
    lines += ["Comfort inside (ISO 2631)", *_bars(summary.comfort, comfort_words, drawn), ""]
    lines += ["Roughest places", *_places(summary.roughest)]
    return "\n".join(lines) + "\n"


def distance_words(distance_m: float) -> str:
    """A distance: ``12.4 km``, or ``840 m`` below one kilometre."""
    return f"{distance_m / 1000:.1f} km" if distance_m >= 1000 else f"{distance_m:.0f} m"


def percent_words(share: float) -> str:
    """A share: ``38%``, and ``<1%`` for one that would be rounded to nothing."""
    return "<1%" if 0 < share < 0.005 else f"{share:.0%}"


def date_words(summary: DriveSummary) -> str:
    """When it was: ``17 May 2025, 14:02 to 14:20 UTC``."""
    if summary.start_utc_us is None or summary.end_utc_us is None:
        return "date not known"
    start, end = utc(summary.start_utc_us), utc(summary.end_utc_us)
    if start.date() == end.date():
        return f"{start.day} {start:%B %Y, %H:%M} to {end:%H:%M} UTC"
    return f"{start.day} {start:%B %Y, %H:%M} to {end.day} {end:%B %Y, %H:%M} UTC"


def class_words(letter: str) -> str:
    """An IRI class: ``B  3.05-6.09 m/km``."""
    if not letter:
        return "no value"
    lower, upper = class_limits_m_per_km(letter)
    if lower is None:
        limits = f"below {upper:.2f}"
    else:
        limits = f"from {lower:.2f}" if upper is None else f"{lower:.2f}-{upper:.2f}"
    return f"{letter}  {limits} m/km"


def comfort_words(name: str) -> str:
    """A comfort word: ``a little uncomfortable``."""
    return name.replace("_", " ") or "no value"


def place_words(place: RoughWindow) -> str:
    """Coordinates as maps take them: ``46.51234, 6.61234``."""
    if place.lat_deg is None or place.lon_deg is None:
        return "position not known"
    return f"{place.lat_deg:.5f}, {place.lon_deg:.5f}"


def iri_words(place: RoughWindow) -> str:
    """The IRI of a place with its standard error: ``14.2 ± 2.1``."""
    error = "" if place.iri_std_m_per_km is None else f" ± {place.iri_std_m_per_km:.1f}"
    return f"{place.iri_m_per_km:.1f}{error}"


def _bars(shares: Sequence[Share], words_of: Callable[[str], str], drawn: bool) -> list[str]:
    if not shares:
        return ["  no distance was measured"]
    width = max(len(words_of(share.name)) for share in shares)
    return [f"  {words_of(share.name):{width}}  {_bar(share.share, drawn)} {percent_words(share.share):>5} "
            f"{distance_words(share.distance_m):>8}" for share in shares]


def _bar(share: float, drawn: bool) -> str:
    """A bar of fixed room; a share above zero always shows."""
    bar_cells = 30
    if not drawn:
        return ("#" * max(round(share * bar_cells), share > 0)).ljust(bar_cells, ".")
    eighths = max(round(share * bar_cells * 8), share > 0)
    full, rest = divmod(eighths, 8)
    return ("█" * full + (_EIGHTHS[rest] if rest else "")).ljust(bar_cells)


def _places(places: Sequence[RoughWindow]) -> list[str]:
    if not places:
        return ["  none with a value"]
    speeds = ["" if place.speed_mps is None else f", {place.speed_mps * 3.6:.0f} km/h" for place in places]
    return [f"  {number}. IRI {iri_words(place):>11} m/km  at {place_words(place):>20}  "
            f"({distance_words(place.along_m)} along{speed}) {comfort_words(place.comfort)}"
            for number, (place, speed) in enumerate(zip(places, speeds, strict=True), start=1)]


def _can_encode(text: str, encoding: str) -> bool:
    try:
        text.encode(encoding)
    except (UnicodeEncodeError, LookupError):
        return False
    return True
