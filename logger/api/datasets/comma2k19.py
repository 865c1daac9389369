"""comma2k19: a minute on a highway in a Toyota RAV4, device on the windscreen (Schafer et al., arXiv:1812.05752, MIT).

Layout of a segment (README of github.com/commaai/comma2k19): NumPy arrays ``t`` [s] and ``value`` in
``processed_log/IMU/accelerometer`` (forward, right, down [m/s2], gravity in it),
``processed_log/GNSS/live_gnss_ublox`` (latitude, longitude [degrees], speed [m/s], ...) and ``processed_log/CAN/speed``
[m/s]. There is no profiler: what comes out is rows and a map, and the speeds beside each other.
"""

from pathlib import Path

import numpy as np

from logger.api.data_sets import DrivenWindows, RoadRecording, driven_windows, expected_files, study_of
from logger.chart_data import Array, Curves, Line
from logger.errors import BadInput
from logger.geodesy import east_and_north_m
from logger.roads.iso8608 import iri_class
from logger.studies.study import Item, Picture, Result, Table, Word, Workload

_CAR = "rav4-2009"
_WINDOW_M = 25.0
_LAGS_S = np.arange(-0.5, 0.51, 0.01)


@study_of(
    "comma2k19",
    "clone github.com/commaai/comma2k19 (MIT), which holds a segment in Example_1, or download the whole set",
    "A minute of highway in a RAV4: from raw files to rows and a map", "Example_1",
    "The segment is processed like any recording: extract --csv with the receiver's positions and speed, then estimate "
    "with the noise learned. The device sat on the windscreen, where it feels pitch as well; the model's sensor sits "
    "in the middle, unless --vehicle names another car. This was run on the real minute.",
    Item("comma2k19", Word.NOT_REPRODUCIBLE, "No IRI of this minute was published; the receiver's speed lags the car's "
                                             "and exceeds it, by the figures above."),
    source="Schafer et al., arXiv:1812.05752, 2018")
def comma2k19(folder: Path, effort: Workload) -> Result:
    log = expected_files(folder, "processed_log/IMU/accelerometer/value", "a segment's IMU")[0].parents[2]
    recording = segment(log)
    drives = driven_windows(recording, effort.vehicle or _CAR, (_WINDOW_M,))
    rows = tuple(row for one in drives for row in _rows(one))
    known = np.array([row[6] for row in rows if row[6] is not None], dtype=np.float64)
    if not len(known):
        raise BadInput(f"{log}: expected a drive of 100 m or more at a steady speed, found no window with an IRI")
    tables = [Table(f"Rows of {_WINDOW_M:g} m", (
        "from [m] .0f", "to [m] .0f", "latitude [deg] .6f", "longitude [deg] .6f", "speed [m/s] .1f", "class",
        "IRI [m/km] .2f", "std. error [m/km] .2f"), rows)]
    words = (f"{len(known)} of {len(rows)} rows of {_WINDOW_M:g} m have an IRI, {known.mean():.2f} m/km on average, "
             f"{known.min():.2f} to {known.max():.2f}. No profiler measured this road, so nothing shows whether that "
             "is right.")
    speed = _speeds(log, recording)
    if speed is not None:
        tables.append(Table("The receiver's speed against the car's",
                            ("figure", "read before .3g", "ridelog .3g"), speed))
    return Result(tuple(tables), words, (Picture(_map(drives)),))


def segment(log: Path) -> RoadRecording:
    """The record of a ``processed_log``. Raises BadInput."""
    time_s, accel = _signal(log / "IMU" / "accelerometer", 3)
    fix_s, fixes = _signal(log / "GNSS" / "live_gnss_ublox", 3)
    return RoadRecording(log.parent.name, time_s, accel[:, :3], "m/s2", fix_s, fixes[:, 2], fixes[:, 0], fixes[:, 1])


def _signal(folder: Path, columns: int) -> tuple[Array, Array]:
    """Times (n,) from the first sample of the device's clock on, and values (n, c), c at least ``columns``."""
    time_s, value = (_array(folder / name) for name in ("t", "value"))
    value = value.reshape(len(value), -1)
    if time_s.ndim != 1 or len(value) != len(time_s) or value.shape[1] < columns:
        raise BadInput(f"{folder}: expected t (n,) and value (n, {columns} or more), found {time_s.shape} and "
                       f"{value.shape}")
    return time_s, value


def _array(path: Path) -> Array:
    try:
        return np.asarray(np.load(path, allow_pickle=False), dtype=np.float64)
    except FileNotFoundError:
        raise FileNotFoundError(f"{path}: expected an array of the segment, found nothing there") from None
    except (ValueError, OSError, EOFError) as error:
        raise BadInput(f"{path}: expected an array of NumPy, found {str(error)[:80]}") from None


def _rows(one: DrivenWindows) -> list[tuple[str | float | None, ...]]:
    middle = (one.begin_deg + one.end_deg) / 2
    rows: list[tuple[str | float | None, ...]] = []
    for begin_m, end_m, place, speed_mps, iri, std in zip(one.begin_m, one.end_m, middle, one.speed_mps,
                                                           one.iri_m_per_km, one.iri_std_m_per_km, strict=True):
        known = bool(np.isfinite(iri))
        rows.append((float(begin_m), float(end_m), *map(float, place), float(speed_mps),
                     iri_class(float(iri)) if known else "-", float(iri) if known else None,
                     float(std) if known else None))
    return rows


def _speeds(log: Path, recording: RoadRecording) -> tuple[tuple[str, float, float], ...] | None:
    """How much faster and later the receiver's speed is; None where the car's was not recorded."""
    if not (log / "CAN" / "speed" / "value").exists():
        return None
    car_s, car = _signal(log / "CAN" / "speed", 1)
    inside = (recording.fix_s > car_s[0] + 0.6) & (recording.fix_s < car_s[-1] - 0.6)
    fix_s, theirs = recording.fix_s[inside], recording.speed_mps[inside]
    off = [theirs - np.interp(fix_s - lag_s, car_s, car[:, 0]) for lag_s in _LAGS_S]
    best = int(np.argmin([one.std() for one in off]))
    # Read before: a hand-made comparison of the same minute, not printed in the paper.
    return (("later by [s]", 0.20, float(_LAGS_S[best])), ("faster by [m/s]", 0.15, float(off[best].mean())),
            ("spread [m/s]", 0.08, float(off[best].std())))


def _map(drives: list[DrivenWindows]) -> Curves:
    """Each row a dot of its class, east and north of the first."""
    places = np.concatenate([(one.begin_deg + one.end_deg) / 2 for one in drives])
    iri = np.concatenate([one.iri_m_per_km for one in drives])
    east_m, north_m = east_and_north_m(*places.T, *places[0].tolist())
    classes = np.array([iri_class(one) if np.isfinite(one) else "unknown" for one in iri])
    there = sorted(set(classes.tolist()))
    # The first two lines of a chart are blue and red: what is smoothest and what is roughest.
    lines = tuple(Line(name, east_m[classes == name], north_m[classes == name], dots=True)
                  for name in dict.fromkeys((there[0], there[-1], *there)))
    return Curves("Map of the rows, by class of their IRI", "east [m]", "north [m]", lines, equal=True)

STUDIES = (comma2k19,)
