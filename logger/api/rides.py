"""How a ride feels: acceleration records, and their ISO 2631-1 values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

import numpy as np
import numpy.typing as npt

from logger.api.drive_questions import ComfortQuestion
from logger.api.question import function
from logger.api.shown import CommandResult, Shown, table
from logger.chart_data import line
from logger.errors import BadInput
from logger.runs import UNKNOWN, RecordFacts
from logger.store.formats import drive_file, record_file
from logger.store.formats.drive_file import facts_beside
from logger.store.formats.record_checks import EvenRecord, RecordRules, even_record, with_marks

if TYPE_CHECKING:
    from logger.chart_data import Chart

Array = npt.NDArray[np.float64]

Given = record_file.AccelerationRecord | drive_file.Drive | Path | str
_SPECTRUM_S = 5.12
"""A resolution of 0.2 Hz: a body's bounce, at 1 to 2 Hz and damped by a fifth and more, is wider."""


@dataclass(frozen=True, eq=False, repr=False)
class Record(record_file.AccelerationRecord, Shown):
    """An acceleration record, evenly sampled: arrays (n,) [m/s2], None where an axis was not recorded.

    start_s         time of the first sample [s]; ``rate_hz`` samples a second
    accel_z_mps2    vertical; ``accel_x_mps2`` along the vehicle, ``accel_y_mps2`` across it
    """

    accel_x_mps2: Array | None = None
    accel_y_mps2: Array | None = None

    def __repr__(self) -> str:
        return table("Record", [
            ("time", self.duration_s, "s"), ("rate", self.rate_hz, "Hz"), ("samples", len(self.accel_z_mps2), ""),
            *((f"{axis}, standard deviation", None if one is None else float(one.std()), "m/s2")
              for axis, one in self.by_axis.items())])

    def charts(self) -> Sequence[Chart]:
        """The axes over time."""
        from logger.chart_data import Curves

        time_s = self.start_s + np.arange(len(self.accel_z_mps2)) / self.rate_hz
        return [Curves("Record", "time [s]", "acceleration [m/s2]", tuple(
            line(axis, time_s, one) for axis, one in self.by_axis.items() if one is not None))]


def read_record(path: Path | str) -> Record:
    """Read a CSV record with ``t_s`` and ``accel_z_mps2``, perhaps ``accel_x_mps2`` and ``accel_y_mps2``.

    Raises BadInput (``file:line: expected ..., found ...``) for anything else.

    >>> read_record(folder / "drive.csv").rate_hz.__round__()
    100
    """
    return Record(**vars(record_file.read_record(path)))


@dataclass(frozen=True, eq=False, repr=False)
class Comfort(CommandResult):
    """Values of the vertical axis; those of the others and of health are in ``as_json``.

    weighting       that it was weighted by
    a_w_mps2        weighted r.m.s. acceleration [m/s2]
    mtvv_mps2       largest running r.m.s. over 1 s [m/s2]
    vdv_mps175      vibration dose [m/s1.75]
    crest_factor    largest value over a_w
    comfort         in a word; None for motion sickness
    doubts          what may be wrong with the record, a line each
    weighted_mps2   (n,) the weighted vertical acceleration, ``rate_hz`` samples a second
    """

    weighting: str
    a_w_mps2: float
    mtvv_mps2: float
    vdv_mps175: float
    crest_factor: float
    comfort: str | None
    weighted_mps2: Array
    rate_hz: float
    doubts: tuple[str, ...] = ()

    title: ClassVar[str] = "Ride comfort"

    def remarks(self, written: Mapping[str, Sequence[Path]]) -> Sequence[str]:
        """The doubts."""
        return self.doubts

    def charts(self) -> Sequence[Chart]:
        """The running r.m.s. over 1 s, beside a_w, and the spectrum of the weighted acceleration."""
        from scipy.signal import welch

        from logger.chart_data import Curves, Line
        from logger.comfort.iso2631 import RunningRms

        time_s = np.arange(len(self.weighted_mps2)) / self.rate_hz
        running = RunningRms(self.rate_hz).process(self.weighted_mps2)
        frequency_hz, psd = welch(self.weighted_mps2, self.rate_hz,
                                  nperseg=min(len(self.weighted_mps2), round(_SPECTRUM_S * self.rate_hz)))
        shown = slice(1, None)  # a mean is no vibration
        return [
            Curves("Running r.m.s. over 1 s", "time [s]", "weighted acceleration [m/s2]",
                   (line("running r.m.s.", time_s, running),), (self.a_w_mps2, "a_w")),
            Curves("Spectrum of the weighted acceleration", "frequency [Hz]", "PSD [(m/s2)2/Hz]",
                   (Line("weighted", frequency_hz[shown], np.maximum(psd[shown], np.finfo(float).tiny)),),
                   log_x=True)]


def comfort_of(question: ComfortQuestion) -> Comfort:
    """The answer to ``ComfortQuestion``, which says what is raised."""
    from logger.api.weightings import weighting_named, weightings
    from logger.comfort.iso2631 import LEAST_TAKEN_HZ, LOWEST_RATE_HZ, ride_comfort
    from logger.report.comfort_text import as_json, lines
    from logger.report.record_checks_text import checks_json, checks_lines

    used, record = weighting_named(question.weighting), question.record
    name = "record" if isinstance(record, record_file.AccelerationRecord) else str(
        record.path if isinstance(record, drive_file.Drive) else record)
    ride = _even(record, name, RecordRules(question.unit, question.resample_hz))
    axes = {axis: ride.accel_mps2.get(f"accel_{axis}_mps2") for axis in "zxy"}
    taken_hz = None if ride.resampled is None else ride.resampled.from_hz
    try:
        found = ride_comfort(axes, ride.rate_hz, used, weightings().get(used.horizontal),
                             question.daily_hours, taken_hz,
                             _facts_of(record).seen_to_hz)
    except ValueError as error:
        is_file = not isinstance(record, (record_file.AccelerationRecord, drive_file.Drive))
        can_be_laid = is_file and taken_hz is None and LEAST_TAKEN_HZ <= ride.rate_hz < LOWEST_RATE_HZ
        hint = f" (--resample takes {LEAST_TAKEN_HZ:g} or more)" if can_be_laid else ""
        raise BadInput(f"{name}: {error}{hint}") from None
    summary, vertical = as_json(found) | checks_json(ride), found.vertical
    return Comfort("\n".join(lines(found, Path(name).name) + checks_lines(ride)), summary, used.name,
                   vertical.a_w_mps2, vertical.mtvv_mps2, vertical.vdv_mps175, vertical.crest_factor,
                   summary["comfort"], found.weighted_mps2, ride.rate_hz,
                   tuple(doubt.words for doubt in ride.doubts))


comfort = function("comfort", ComfortQuestion, comfort_of)


def _facts_of(record: Given) -> RecordFacts:
    """What a run says of itself, also where its ``drive.csv`` alone was given."""
    if isinstance(record, record_file.AccelerationRecord):
        return UNKNOWN
    return record.facts if isinstance(record, drive_file.Drive) else facts_beside(record)


def _even(record: Given, name: str, asked: RecordRules) -> EvenRecord:
    """The accelerations to weigh, checked."""
    if isinstance(record, drive_file.Drive):
        found = even_record(record.time_s, {record_file.VERTICAL: record.accel_z_mps2}, {}, name, asked)
        return with_marks(found, record.usable)
    if not isinstance(record, record_file.AccelerationRecord):
        file, t_s, accel, usable = record_file.read_marked_columns(record)
        return with_marks(even_record(t_s, accel, {}, file, asked), usable)
    t_s = record.start_s + np.arange(len(record.accel_z_mps2)) / record.rate_hz
    accel = {f"accel_{axis}_mps2": one for axis, one in record.by_axis.items() if one is not None}
    return even_record(t_s, accel, {}, name, asked)
