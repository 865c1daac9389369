"""The windows of drives as the page's script takes them: columns of whole numbers, packed small.

Problem: 100,000 windows of some fifteen numbers are 15 MB as text, and a page has to hold them. Solution: a number is
kept in the steps that can be read off the page (a millimetre, a hundredth of a m/km), differences from row to row are
kept where neighbours are alike, and what is left is deflated byte by byte of equal weight, so that the bytes that are
all zero cost nothing.
"""

from __future__ import annotations

import zlib
from base64 import b64encode
from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.chart_data import Array
from logger.comfort.iso2631 import COMFORT_WORDS
from logger.records import WindowRecord
from logger.report.maps import Way
from logger.report.places_passed import PlacesPassed
from logger.report.summary import COMFORT_NAMES, IRI_CLASSES, class_limits_m_per_km, counts, expected_square
from logger.store.log.log_reader import joined, length_m

UNKNOWN = -(2**31)
"""Stands for a value that is not known."""
_MOST = 2**31 - 1
_DEG = 1e6
"""Steps in a degree: 0.11 m, the six decimals that RFC 7946 (section 11.2) calls enough."""

Ints = npt.NDArray[np.uint32]
Column = tuple[str, float, int, Array]
"""Name, steps per unit, how many times differences are taken, values (n,) with NaN for unknown."""

_PLAIN: Sequence[tuple[str, float, int, Callable[[WindowRecord], float | None]]] = (
    ("row", 1, 1, lambda record: record.segment),
    ("length_m", 1e3, 1, length_m),
    ("duration_s", 1e3, 1, lambda record: record.duration_s),
    ("lat_deg", _DEG, 2, lambda record: record.lat_deg),
    ("speed_mps", 1e2, 1, lambda record: record.speed_mps),
    ("iri_m_per_km", 1e2, 0, lambda record: record.iri_m_per_km),
    ("iri_std_m_per_km", 1e2, 0, lambda record: record.iri_std_m_per_km),
    ("a_w_mps2", 1e3, 0, lambda record: record.a_w_mps2),
    ("mtvv_mps2", 1e2, 0, lambda record: record.mtvv_mps2),
    ("vdv_mps175", 1e2, 0, lambda record: record.vdv_mps175),
    ("crest_factor", 1e1, 0, lambda record: record.crest_factor),
    ("iri_rank", 1, 0, lambda record: _rank(record.iri_class, tuple(IRI_CLASSES))),
    ("comfort_rank", 1, 0, lambda record: _rank(record.comfort, COMFORT_NAMES)),
    ("counts", 1, 0, counts),
)


def track_data(drives: Sequence[Sequence[WindowRecord]], base: Sequence[Way] = (), passed: PlacesPassed | None = None
               ) -> dict[str, Any]:
    """All that the script draws, as JSON can hold it.

    base      roads that are drawn beneath
    passed    places that several drives passed
    """
    records = list(chain.from_iterable(drives))
    origin_deg = next((record.lon_deg for record in records if record.lon_deg is not None), 0.0)
    flags = list(dict.fromkeys(record.flags for record in records))
    numbers = {combination: number for number, combination in enumerate(flags)}
    columns = [(name, steps, order, _floats(map(value_of, records))) for name, steps, order, value_of in _PLAIN]
    columns += [
        ("lon_deg", _DEG, 2, _unwrapped(_floats(record.lon_deg for record in records), origin_deg)),
        # Most windows begin when the one before ends: beside their durations their instants cost nothing.
        ("beyond_s", 1e3, 1, np.concatenate([_since_s(drive) for drive in drives] or [np.zeros(0)])
         - _elapsed_s(records)),
        # Most windows are expected to be what they are: as a difference the column is all but empty.
        ("expected_above_mps2", 1e3, 0, _floats(map(_expected_above, records))),
        ("flags", 1, 0, _floats(numbers[record.flags] for record in records)),
        ("begins", 1, 0, _begins(drives)),
    ]
    if passed is not None:
        columns.append(("place", 1, 2, passed.place))
    return {
        "windows": packed(columns),
        "drives": [{"windows": len(drive), "start_s": _start_s(drive)} for drive in drives],
        "passed": None if passed is None else packed([
            ("drives", 1, 0, passed.drives.astype(np.float64)), ("iri_m_per_km", 1e2, 0, passed.iri_m_per_km),
            ("iri_std_m_per_km", 1e2, 0, passed.iri_std_m_per_km)]),
        "flags": flags,
        "base": packed(_base_columns(base, origin_deg, _floats(record.lat_deg for record in records),
                                     columns[len(_PLAIN)][3])),
        "limits": {"iri": [class_limits_m_per_km(letter)[0] for letter in tuple(IRI_CLASSES)[1:]],
                   "comfort": sorted(limit for limit, _ in COMFORT_WORDS)[1:]},
        "letters": tuple(IRI_CLASSES),
    }


def packed(columns: Sequence[Column]) -> dict[str, Any]:
    """Columns of equal length as base64 text of one deflated block, and what is needed to read it."""
    planes = b"".join(_planes(values, steps, order) for _, steps, order, values in columns)
    return {"count": len(columns[0][3]), "columns": [[name, steps, order] for name, steps, order, _ in columns],
            "packed": b64encode(zlib.compress(planes, 9)).decode("ascii")}


def _planes(values: Array, steps: float, order: int) -> bytes:
    """The lowest bytes of all numbers, then the next ones, four in all. Differences wrap around 32 bits, as the
    script's sums do, so that any number comes back as it was."""
    known = np.isfinite(values)
    whole = np.where(known, np.clip(np.where(known, values, 0.0), -_MOST / steps, _MOST / steps) * steps, UNKNOWN)
    differences = np.rint(whole).astype(np.int64).astype(np.uint32)
    for _ in range(order):
        differences = np.diff(differences, prepend=np.uint32(0))
    signed = differences.view(np.int32)
    # Small numbers of either sign become small numbers without one (zigzag, as in Protocol Buffers).
    zigzag = (differences << np.uint32(1)) ^ (signed >> 31).view(np.uint32)
    return zigzag.astype("<u4").view(np.uint8).reshape(-1, 4).T.tobytes()


def _floats(values: Any) -> Array:
    return np.array([np.nan if value is None else value for value in values], dtype=np.float64)


def _unwrapped(lon_deg: Array, origin_deg: float) -> Array:
    """Longitudes that do not jump at the date line: within 180 degrees of the origin."""
    return (lon_deg - origin_deg + 180.0) % 360.0 - 180.0 + origin_deg


def _rank(name: str, names: tuple[str, ...]) -> int | None:
    return names.index(name) if name in names else None


def _start_s(drive: Sequence[WindowRecord]) -> float | None:
    """Seconds since 1970 of the first row that knows them."""
    return next((record.utc_us / 1e6 for record in drive if record.utc_us is not None), None)


def _since_s(drive: Sequence[WindowRecord]) -> Array:
    """Time of each row since the drive's first date."""
    return _floats(record.utc_us and record.utc_us / 1e6 for record in drive) - (_start_s(drive) or 0.0)


def _elapsed_s(records: Sequence[WindowRecord]) -> Array:
    """Time in all windows before each, in the milliseconds that the script sums up."""
    lasted_s = np.round(_floats(record.duration_s for record in records), 3)
    return np.cumsum(lasted_s) - lasted_s


def _expected_above(record: WindowRecord) -> float | None:
    """How far the acceleration that stands in a mean lies above the one that is shown (NaN: it stands in none)."""
    square = expected_square(record)
    return None if square is None else square**0.5 - (record.a_w_mps2 or 0.0)


def _begins(drives: Sequence[Sequence[WindowRecord]]) -> Array:
    """2 where a drive begins, 1 where a row is not joined to the one before, 0 elsewhere."""
    begins = []
    for drive in drives:
        firsts = {id(piece[0]) for piece in joined(drive) if piece}
        placed = [record.lat_deg is not None and record.lon_deg is not None for record in drive]
        begins += [2] + [int(id(record) in firsts or here != before)
                         for record, here, before in zip(drive[1:], placed[1:], placed, strict=False)]
    return _floats(begins)


def _base_columns(base: Sequence[Way], origin_deg: float, lat_deg: Array, lon_deg: Array) -> list[Column]:
    """The roads beneath, those that come near to the way: as far around it as it is wide, 1 km at least."""
    near = _near(lat_deg, lon_deg)
    kept = [(way.lat_deg, lon) for way in base
            if near(way.lat_deg, lon := _unwrapped(way.lon_deg, origin_deg))]
    begins = [np.arange(len(lat)) == 0 for lat, _ in kept]
    return [("lat_deg", _DEG / 10, 1, np.concatenate([lat for lat, _ in kept] or [np.zeros(0)])),
            ("lon_deg", _DEG / 10, 1, np.concatenate([lon for _, lon in kept] or [np.zeros(0)])),
            ("begins", 1, 0, np.concatenate([one.astype(np.float64) for one in begins] or [np.zeros(0)]))]


def _near(lat_deg: Array, lon_deg: Array) -> Callable[[Array, Array], bool]:
    if not np.isfinite(lat_deg).any():
        return lambda lat, lon: False
    south, north = np.nanmin(lat_deg), np.nanmax(lat_deg)
    west, east = np.nanmin(lon_deg), np.nanmax(lon_deg)
    around = max(north - south, (east - west) * np.cos(np.radians(south)), 0.01)
    aside = around / max(np.cos(np.radians(south)), 0.01)
    return lambda lat, lon: bool(
        lat.size and lat.max() > south - around and lat.min() < north + around
        and lon.max() > west - aside and lon.min() < east + aside)

