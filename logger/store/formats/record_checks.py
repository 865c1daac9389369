"""Records of many columns: how their samples are judged, and how they are read.

Acceleration records that are not what they seem: recognised, mended where that was asked for, else reported or refused.

Problem: repeated samples, values in g, the end of a sensor's range and a recorder's uneven clock all give figures that
look like any others. Solution: what makes a result wrong is refused, with the option that mends it; what is doubtful
is reported with the result.

Records of many channels as CSV: ``t_s`` and any number of evenly sampled columns, named by the header.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.readings import STANDARD_GRAVITY_MPS2
from logger.arrays import Array, Bools
from logger.bounds import LONGEST_HOLE_S, MOVING_MPS, SIGNAL
from logger.dsp import repeated_samples
from logger.dsp.resample import GRID_RATE_HZ
from logger.errors import BadInput
from logger.files import file_in, read_bounded
from logger.left_out import LeftOut, counting
from logger.printable import counted
from logger.runs import CLIPPED, NO_READING
from logger.store.formats.csv_table import parse_columns, place, taken
from logger.store.formats.drive_file import DISTANCE, DRIVE, PLACE, SPEED, USABLE, header_of
from logger.store.formats.record_file import HOLE_STEPS, MAX_BYTES, TIME, VERTICAL, check_grows, even_rate_hz

UNITS = ("mps2", "g")
OWN_RATE = 0.0
MOST_RATE_HZ = 10_000.0
_HOLES = 0.02  # of the time


@dataclass(frozen=True)
class RecordRules:
    """What is said of a record. ``unit``: one of ``UNITS``, None: to be judged; ``resample_hz``: lay it on an even grid
    of this rate, ``OWN_RATE``: of its own (``GRID_RATE_HZ`` at least); None: it has to be even, without repeats."""

    unit: str | None = None
    resample_hz: float | None = None

    def __post_init__(self) -> None:
        if self.unit is not None and self.unit not in UNITS:
            raise BadInput(f"unit: expected one of {', '.join(UNITS)}, found {self.unit!r}")
        if self.resample_hz is not None and self.resample_hz != OWN_RATE and not (
                GRID_RATE_HZ * 0.8 <= self.resample_hz <= MOST_RATE_HZ):
            raise BadInput(f"resample: expected {GRID_RATE_HZ * 0.8:g} to {MOST_RATE_HZ:g} Hz, found "
                           f"{self.resample_hz:g}")


@dataclass(frozen=True)
class Doubt:
    """What may be wrong with a record: a word, one line, and its numbers."""

    what: str
    words: str
    numbers: Mapping[str, float | str] = field(default_factory=dict)

    def as_json(self) -> dict[str, Any]:
        """The same for a program."""
        return {"what": self.what, "words": self.words, **self.numbers}


@dataclass(frozen=True)
class Resampled:
    """How a record was laid on an even grid: its rate [Hz], its widest step [s], the share of repeats dropped."""

    from_hz: float
    to_hz: float
    widest_step_s: float
    repeats_dropped: float


@dataclass(frozen=True, eq=False)
class EvenRecord:
    """Samples at start_s + k / rate_hz: acceleration by name, (n,) each [m/s2], and what else was recorded beside it.

    start_s, rate_hz    [s], [Hz]
    doubts      what may be wrong with it
    resampled   None: it is as it was recorded
    left_out    of its samples
    """

    start_s: float
    rate_hz: float
    accel_mps2: dict[str, Array]
    others: dict[str, Array]
    doubts: tuple[Doubt, ...]
    resampled: Resampled | None
    left_out: tuple[LeftOut, ...] = ()


def even_record(t_s: Array, accel: Mapping[str, Array], others: Mapping[str, Array], file: str, asked: RecordRules,
                moving: Bools | None = None) -> EvenRecord:
    """A record with times (n,) [s], judged and, where that was asked for, mended.

    accel     (n,) by name, vertical first; in m/s2 or, where ``asked`` says so, in g
    others    (n,) by name; straight lines are laid between them
    moving    (n,) where the car was driving; None: not known

    Raises BadInput ("file: expected ..., found ...") for what would give a wrong result.
    """
    if len(t_s) < 2:
        raise BadInput(f"{file}: expected two samples or more, found {len(t_s)}")
    if not all(np.isfinite(one).all() for one in (t_s, *accel.values())):
        raise BadInput(f"{file}: expected numbers, found NaN or infinity among times or samples")
    scale = STANDARD_GRAVITY_MPS2 if asked.unit == "g" else 1.0
    samples = np.stack([scale * one for one in accel.values()], axis=1)
    doubts = [] if asked.unit is not None else unit_doubts(samples, file, moving)
    repeats = repeated_samples.find_repeats(samples)
    held = repeated_samples.find_holds(t_s, samples) if repeats is None else np.zeros(len(samples), dtype=np.bool_)
    doubts += hold_doubts(t_s, held, file)
    if moving is None or moving.any():
        driven = slice(None) if moving is None else moving
        if not samples[driven, 0].any():
            raise BadInput(f"{file}: expected accelerations that vary, found 0 m/s2 throughout: a sensor that works "
                           "shows some noise at least; check that it was read")
        doubts += still_doubts(accel, t_s[driven], samples[driven], held[driven])
    if repeats is not None and asked.resample_hz is None:
        even_rate_hz(t_s, file, _MEND)
        fresh_hz = 1 / np.median(np.diff(repeated_samples.fresh_times(repeats, t_s)))
        raise BadInput(f"{file}: {repeats.complaint} ({fresh_hz:.3g} Hz written at {_rate_hz(t_s):.4g}): "
                       "--resample drops the repeats")
    kept = ~held if repeats is None else repeats.fresh
    doubts += [doubt for name, axis in zip(accel, samples[kept].T, strict=True) for doubt in end_doubts(name, axis)]
    if asked.resample_hz is None:
        rate_hz = even_rate_hz(t_s, file, _MEND)
        columns = dict(zip(accel, samples.T.copy(), strict=True))
        return EvenRecord(float(t_s[0]), rate_hz, columns, dict(others), tuple(doubts), None)
    return _resampled(t_s, samples, accel, others, repeats, held, file, asked.resample_hz, doubts)


def hold_doubts(t_s: Array, held: Bools, file: str) -> list[Doubt]:
    """That the sensor stood still for a while; BadInput where that is too long to draw a line across."""
    mostly = 0.5  # of the samples: the recorder is slow, and did not stop for a while
    if not held.any():
        return []
    first, end = repeated_samples.stretches_of(held)
    begin_s, end_s = t_s[first - 1], t_s[np.minimum(end, len(t_s) - 1)]
    lasted_s, row = end_s - begin_s, int(np.argmax(end_s - begin_s))
    if (share := float(held.mean())) > mostly:
        raise BadInput(f"{file}: expected every sample to be a new measurement, found {share:.0%} that repeat the one "
                       f"before ({(~held).sum() / (t_s[-1] - t_s[0]):.3g} Hz written at {_rate_hz(t_s):.4g}): record "
                       "at a higher rate")
    if lasted_s[row] > LONGEST_HOLE_S:
        raise BadInput(f"{place(file, int(first[row]))}: expected no gap above {LONGEST_HOLE_S:g} s, found a sensor "
                       f"frozen on all axes from {begin_s[row]:.6g} to {end_s[row]:.6g} s: cut the record "
                       "there")
    total_s = float(lasted_s.sum())
    return [Doubt("held", f"the sensor is frozen on all axes for {total_s:.2g} s in {counted(len(first), 'place')}, "
                  f"the first at {begin_s[0]:.6g} s: the true values are higher",
                  {"seconds": total_s, "places": len(first)})]


def with_marks(record: EvenRecord, usable: Array | None) -> EvenRecord:
    """The same with the doubts that the marks (n,) of a drive raise (``logger.runs``); None: there are none."""
    if usable is None:
        return record
    share, clipped = float((usable == NO_READING).mean()), int(np.count_nonzero(usable == CLIPPED))
    doubts = [Doubt("holes", f"{share:.1%} of the samples are interpolated, as the column usable marks them as "
                    "missing: the true values are higher", {"share": share})]
    doubts = doubts if share > _HOLES else []
    doubts += [Doubt("range_end", f"{clipped} samples are at an end of the sensor's range, as the column usable "
                     "shows: the true values are higher; record with a larger range", {"samples": clipped})
               ] if clipped else []
    return replace(record, doubts=(*record.doubts, *doubts))


def even_columns(columns: Mapping[str, Array], file: str, asked: RecordRules) -> EvenRecord:
    """A drive's columns (n,) by name (``drive_file.COLUMNS``), as ``even_record``. Repeats are dropped; but what the
    samples do not hold cannot be estimated, so BadInput where fewer than 80 a second are left."""
    least_for_roads_hz = 79.9
    names = [name for name in columns if name not in (TIME, VERTICAL)]
    moving = np.abs(columns[SPEED]) > MOVING_MPS
    found = even_record(columns[TIME], {VERTICAL: columns[VERTICAL]}, {name: columns[name] for name in names}, file,
                        asked, moving)
    if found.resampled is not None and found.resampled.from_hz < least_for_roads_hz:
        raise BadInput(f"{file}: expected at least {least_for_roads_hz:g} measured samples a second, found "
                       f"{found.resampled.from_hz:.4g}")
    return found


_MEND = " (--resample makes the rate even)"


def _resampled(t_s: Array, samples: Array, names: Mapping[str, Array], others: Mapping[str, Array],
               repeats: repeated_samples.RepeatedSamples | None, held: Bools, file: str, rate_hz: float,
               doubts: list[Doubt]) -> EvenRecord:
    from logger.dsp.whole_record import mean_rate_hz, on_even_grid

    times_s = even_times_of(t_s, file)
    taken_s, taken = times_s, samples
    if repeats is not None:
        taken_s, taken = repeated_samples.fresh_times(repeats, times_s), samples[repeats.fresh]
    elif held.any():
        taken_s, taken = times_s[~held], samples[~held]
    steps = np.diff(taken_s)
    widest_s = float(steps.max()) if len(steps) else 0.0
    if widest_s > LONGEST_HOLE_S:
        row = int(np.searchsorted(times_s, taken_s[int(np.argmax(steps)) + 1]))
        raise BadInput(f"{place(file, row)}: expected no gap above {LONGEST_HOLE_S:g} s, found one of "
                       f"{widest_s:.4g} s: cut the record there")
    if len(steps) < 2:
        raise BadInput(f"{file}: expected three samples or more, found {len(taken_s)}")
    own_hz = mean_rate_hz(taken_s)
    holes = steps[steps > HOLE_STEPS / own_hz].sum() / (taken_s[-1] - taken_s[0])
    if holes > _HOLES:
        doubts = [*doubts, Doubt("holes", f"{holes:.1%} of the time is gaps, bridged by interpolation: the true "
                                 "values are higher", {"share": float(holes)})]
    wanted_hz = rate_hz if rate_hz != OWN_RATE else max(GRID_RATE_HZ, own_hz)
    laid = on_even_grid(taken_s, taken, own_hz, wanted_hz)
    grid_s = taken_s[0] + np.arange(len(laid)) / wanted_hz
    beside = {name: np.interp(grid_s, times_s, one) for name, one in others.items()}
    dropped = float(held.mean()) if repeats is None else repeats.share
    left = LeftOut(len(t_s) - len(taken_s), "sample", "that only repeated the one before")
    return EvenRecord(float(taken_s[0]), wanted_hz, dict(zip(names, laid.T.copy(), strict=True)), beside, tuple(doubts),
                      Resampled(own_hz, wanted_hz, widest_s, dropped), counting([left]))


def even_times_of(t_s: Array, file: str) -> Array:
    """Growing times of samples [s]: as they are, or, of such that came in bursts, evenly spread. BadInput where that
    cannot be, or a time is before the one before it."""
    if (back := np.diff(t_s) < 0).any():
        row = int(np.argmax(back)) + 1
        raise BadInput(f"{place(file, row)}: expected no time before {t_s[row - 1]:.10g} s, found {t_s[row]:.10g}")
    ends = repeated_samples.burst_ends(t_s)
    if ends is not None:
        try:
            return repeated_samples.spread(t_s, ends)
        except ValueError as error:
            raise BadInput(f"{file}: expected samples measured at an even rate, {error}") from None
    check_grows(t_s, file)
    return t_s


def _rate_hz(t_s: Array) -> float:
    return float((len(t_s) - 1) / (t_s[-1] - t_s[0]))


def unit_doubts(samples: Array, file: str, moving: Bools | None) -> list[Doubt]:
    """Doubts that samples (n, axes) are in m/s2. BadInput where they are in g, by the gravity in them, or all 0."""
    # A mean so near to 1 with so little about it is a record in g: 3 % is what sensors are off.
    gravity_g, gravity_near, gravity_calm = 1.0, 0.03, 0.35
    # R.m.s. about the mean: on a moving car it is more (0.15 on a new motorway, a tenth of it in g) and less.
    quiet_mps2, loud_mps2 = 0.1, 30.0
    counted = samples if moving is None or not moving.any() else samples[moving]
    mean, rms = counted.mean(axis=0), float(counted[:, 0].std())
    gravities = (abs(float(mean[0])), float(np.hypot.reduce(mean)))
    for gravity in gravities:
        if abs(gravity - gravity_g) < gravity_near and rms < gravity_calm:
            raise BadInput(f"{file}: expected accelerations in m/s2, found a mean of {gravity:.3f}, as of gravity "
                           "in g: --unit g takes them as g, --unit mps2 as they are")
    if np.ptp(counted[:, 0]) == 0.0 or (moving is not None and not moving.any()):
        return []
    numbers = {"rms_mps2": rms}
    if rms < quiet_mps2:
        has_gravity = any(abs(one / STANDARD_GRAVITY_MPS2 - 1) < gravity_near for one in gravities)
        asks = "did the car stand?" if has_gravity else "is it in g? (--unit g)"
        return [Doubt("quiet", f"{rms:.2g} m/s2 r.m.s. is less than a moving car has: {asks}", numbers)]
    if rms > loud_mps2:
        return [Doubt("loud", f"{rms:.3g} m/s2 r.m.s. is more than any car has: is it in m/s2?", numbers)]
    return []


def still_doubts(names: Iterable[str], t_s: Array, samples: Array, held: Bools) -> list[Doubt]:
    """Axes of samples (n, axes) that never move, or stand still for long where the others, which were ``held`` (n,) at
    times, do not; and a beginning in which none moves: a parked car or a sensor that was not read."""
    doubts = []
    begin_s = repeated_samples.still_until_s(t_s, samples) - t_s[0]
    if begin_s > LONGEST_HOLE_S and not held[1] and np.ptp(samples, axis=0).any():
        doubts.append(Doubt("held", f"the sensor is frozen on all axes for the first {begin_s:.3g} s, in a parked "
                            "car or because it was not read; this lowers the values: cut it off",
                            {"seconds": float(begin_s), "places": 1}))
    for name, values in zip(names, samples.T, strict=True):
        if np.ptp(values) == 0.0:
            doubts.append(Doubt("constant", f"every sample of {name} is {values[0]:.4g} m/s2: a sensor that works "
                                "shows some noise at least; check that it was read",
                                {"axis": name, "value_mps2": float(values[0])}))
            continue
        alone = (repeated_samples.find_holds(t_s, values[:, None]) & ~held if len(samples.T) > 1
                 else np.zeros(0, dtype=np.bool_))
        first, end = repeated_samples.stretches_of(alone)
        long = t_s[end - 1] - t_s[first - 1] > LONGEST_HOLE_S if len(first) else np.zeros(0, dtype=np.bool_)
        if long.any():
            lasts_s = float((t_s[end - 1] - t_s[first - 1])[long].sum())
            doubts.append(
                Doubt("held", f"{name} alone is frozen for {lasts_s:.3g} s, first at {t_s[first[long][0] - 1]:.6g} "
                      "s: its values are too low; check that it was read", {"axis": name, "seconds": lasts_s}))
    return doubts


def end_doubts(name: str, values: Array) -> list[Doubt]:
    """Where samples (n,) of an axis stand at an end of the sensor's range."""
    return [Doubt("range_end", f"{one.samples} samples of {name} are at {one.at:.4g} m/s2, the end of a range: the "
                  "ride is harder than the values say; record with a larger range",
                  {"at_mps2": one.at, "samples": one.samples}) for one in repeated_samples.range_ends(values)]


NOT_SENSORS = (SPEED, DISTANCE, *PLACE, USABLE)  # Columns of a drive that say where and how the car went


@dataclass(frozen=True)
class ChannelRecord:
    """Samples (n, channels) of the named channels at start_s, start_s + 1 / rate_hz, ... [s]."""

    names: tuple[str, ...]
    start_s: float
    rate_hz: float
    samples: Array


def read_channels(path: Path | str, only: Sequence[str] = ()) -> ChannelRecord:
    """Read a CSV record: the named columns in that order, or all but ``t_s`` and what is no sensor of a drive.

    Raises BadInput ("file:line: expected ..., found ...") for anything else.
    """
    max_channels = 64
    path = file_in(path, DRIVE)
    file = str(path)
    wished = ",".join(only) if only else "CHANNEL[,CHANNEL...]"
    if no_sensors := [name for name in only if name in NOT_SENSORS]:
        raise BadInput(f"{file}:1: expected columns of sensors, found {no_sensors[0]}, which describes how the car "
                        "moved")

    def choose(names: tuple[str, ...]) -> tuple[str, ...] | None:
        wanted = tuple(only) or tuple(name for name in names if name not in (TIME, *NOT_SENSORS))
        good = names.count(TIME) == 1 and wanted and all(_is_name(name) and names.count(name) == 1 for name in wanted)
        return (TIME, *wanted) if good and len(wanted) <= max_channels else None

    header = f"a header with {TIME},{wished}, each once, at most {max_channels}"
    wanted, table, file = parse_columns(read_bounded(path, MAX_BYTES), file, choose, header, of_samples=True)
    samples = np.stack([taken(SIGNAL, name, column, file)
                        for name, column in zip(wanted[1:], table.T[1:], strict=True)], axis=1)
    for column, name in enumerate(wanted[1:]):
        if not samples[:, column].std() > 1e-12 * np.abs(samples[:, column]).max():
            raise BadInput(f"{place(file, 0)}: expected {name} to move, found {samples[0, column]:g} throughout; "
                           "leave its column out")
    if repeats := repeated_samples.find_repeats(samples):
        raise BadInput(f"{file}: {repeats.complaint}: write a record only as often as the sensor is read")
    hold_doubts(table[:, 0], repeated_samples.find_holds(table[:, 0], samples), file)
    return ChannelRecord(wanted[1:], float(table[0, 0]), even_rate_hz(table[:, 0], file), samples)


def is_drive(path: Path | str) -> bool:
    """Whether a CSV record is of a car that went somewhere: its speed or its distance says so. BadInput as above."""
    standing_m = 1.0  # a receiver that stands wanders by more, a wheel's counter by less
    how = tuple(name for name in header_of(Path(path)) if name in (SPEED, DISTANCE))
    if not how:
        return False
    path = file_in(path, DRIVE)
    table = parse_columns(read_bounded(path, MAX_BYTES), str(path),
                          lambda there: how if set(how) <= set(there) else None, ",".join(how))[1]
    return any(float(np.ptp(one) if name == DISTANCE else one.max()) > standing_m
               for name, one in zip(how, table.T, strict=True))


def _is_name(name: str) -> bool:
    """Something that can be shown and typed, of bytes that are text."""
    longest = 100
    return 0 < len(name) <= longest and name.isprintable() and "\ufffd" not in name
