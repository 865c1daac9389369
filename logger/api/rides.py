"""How a ride feels: acceleration records, their ISO 2631-1 values of comfort and health, and frequency weightings."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from logger.api.drive_questions import ComfortQuestion
from logger.api.shown import CommandResult, Shown, checks_json, checks_lines, table
from logger.chart_data import Array, Chart, Curves, Line, line
from logger.comfort import iso2631
from logger.comfort.iso2631 import (
    COMFORT_FACTORS,
    HEALTH_FACTORS,
    LEAST_TAKEN_HZ,
    AxisFigures,
    CautionZone,
    RideComfort,
    RunningRms,
    comfort_word,
    motion_sickness_dose,
    ride_comfort,
    total,
)
from logger.dsp.weightings.weighting import LOWEST_RATE_HZ, Weighting
from logger.errors import BadInput
from logger.plugins import catalogue
from logger.question import function
from logger.report.blocks import Block, Blocks, Lines, Table
from logger.report.quantities import known
from logger.runs import UNKNOWN, RecordFacts
from logger.store.formats import drive_file, record_file
from logger.store.formats.drive_file import facts_beside
from logger.store.formats.record_checks import EvenRecord, RecordRules, even_record, with_marks


def weightings() -> Mapping[str, Weighting]:
    """All there are, by name."""
    return catalogue("logger.dsp.weightings", "WEIGHTING")


def weighting_named(name: str) -> Weighting:
    """A weighting by its name, in capitals or not: ``wk``, ``Wk``. Raises BadInput for one that there is not."""
    known = weightings()
    if name.lower() not in known:
        raise BadInput(f"weighting {name!r}: expected one of {', '.join(known)}")
    return known[name.lower()]


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
        time_s = self.start_s + np.arange(len(self.accel_z_mps2)) / self.rate_hz
        return [Curves("Record", "time [s]", "acceleration [m/s2]", tuple(
            line(axis, time_s, one) for axis, one in self.by_axis.items() if one is not None))]


def read_record(path: Path | str) -> Record:
    """Read a CSV record with ``t_s`` and ``accel_z_mps2``, optionally ``accel_x_mps2`` and ``accel_y_mps2``.

    Raises BadInput (``file:line: expected ..., found ...``) for anything else.

    >>> read_record(folder / "drive.csv").rate_hz.__round__()
    100
    """
    return Record(**vars(record_file.read_record(path)))


@dataclass(frozen=True, eq=False, repr=False)
class Comfort(CommandResult):
    """Comfort values of the vertical axis; ``as_json`` has those of the other axes and of health.

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
        from scipy.signal import welch  # takes a while to load

        time_s = np.arange(len(self.weighted_mps2)) / self.rate_hz
        running = RunningRms(self.rate_hz).process(self.weighted_mps2)
        frequency_hz, psd = welch(self.weighted_mps2, self.rate_hz,
                                  nperseg=min(len(self.weighted_mps2), round(_SPECTRUM_S * self.rate_hz)))
        shown = slice(1, None)  # a mean is no vibration
        return [
            Curves("Running r.m.s. over 1 s", "time [s]", "weighted acceleration [m/s2]",
                   (line("running r.m.s.", time_s, running),), (self.a_w_mps2, "a_w")),
            Curves("Spectrum of the weighted acceleration", "frequency [Hz]", "power spectral density [(m/s2)2/Hz]",
                   (Line("weighted", frequency_hz[shown], np.maximum(psd[shown], np.finfo(float).tiny)),),
                   log_x=True)]


@function(ComfortQuestion)
def comfort(question: ComfortQuestion) -> Comfort:
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
    content = Blocks([*blocks(found, Path(name).name), Lines(checks_lines(ride))])
    return Comfort(content, summary, used.name,
                   vertical.a_w_mps2, vertical.mtvv_mps2, vertical.vdv_mps175, vertical.crest_factor,
                   summary["comfort"], found.weighted_mps2, ride.rate_hz,
                   tuple(doubt.words for doubt in ride.doubts))


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
        file, t_s, accel, usable = record_file.read_columns(record)
        return with_marks(even_record(t_s, accel, {}, file, asked), usable)
    t_s = record.start_s + np.arange(len(record.accel_z_mps2)) / record.rate_hz
    accel = {f"accel_{axis}_mps2": one for axis, one in record.by_axis.items() if one is not None}
    return even_record(t_s, accel, {}, name, asked)


METHOD = "formula of the standard, magnitude and phase, by Fourier transform of the whole record"


def as_json(result: RideComfort) -> dict[str, Any]:
    """The agreed fields of the vertical axis first, then what else there is; null where there is no such value."""
    vertical = _axis_json(result.vertical)
    first = ("a_w_mps2", "mtvv_mps2", "vdv_mps175", "crest_factor")
    agreed = {"weighting": result.weighting.name, **{name: vertical.pop(name) for name in first},
              "comfort": _word(result, result.vertical.a_w_mps2)}
    more = {"rate_hz": result.rate_hz, "duration_s": result.vertical.duration_s, **vertical,
            "method": METHOD, "unseen_from_hz": result.unseen_from_hz}
    if result.weighting.is_sickness:
        more["msdv_mps15"] = _sickness_dose(result.vertical)
        more["report_beside_a_w"] = ["msdv"]
    if len(result.axes) > 1:
        more |= {"axes": {axis: _axis_json(result.axes[axis]) for axis in "xyz"}, **_totals(result)}
    return agreed | more | {"health": _health(result)}


def _axis_json(figures: AxisFigures) -> dict[str, Any]:
    names = ("a_w_mps2", "mtvv_mps2", "mtvv_exponential_mps2", "vdv_mps175", "crest_factor", "mtvv_ratio", "vdv_ratio")
    return {**{name: known(getattr(figures, name)) for name in names}, "report_beside_a_w": list(figures.beside_a_w())}


def _word(result: RideComfort, a_w_mps2: float) -> str | None:
    """None where the words for comfort are not of such a value."""
    return comfort_word(a_w_mps2) if result.weighting.comfort_words else None


def _sickness_dose(figures: AxisFigures) -> float:
    return motion_sickness_dose(figures.a_w_mps2, figures.duration_s)


def _totals(result: RideComfort) -> dict[str, Any]:
    """All three axes in one: for comfort with its word, and for health."""
    a_w_mps2 = [result.axes[axis].a_w_mps2 for axis in "xyz"]
    comfort_mps2 = total(a_w_mps2, COMFORT_FACTORS)
    return {"total_a_w_mps2": comfort_mps2, "total_comfort": _word(result, comfort_mps2),
            "health_total_a_w_mps2": total(a_w_mps2, HEALTH_FACTORS)}


def _health(result: RideComfort) -> dict[str, Any] | None:
    """Daily exposure by the worst axis, and where it stands; None where the weighting is none of health."""
    factors = result.health_factors
    if not factors:
        return None
    hours, seconds = result.daily_hours, result.vertical.duration_s
    a_w_mps2, a_w_axis = max((k * result.axes[axis].a_w_mps2, axis) for axis, k in factors.items())
    vdv, vdv_axis = max((k * result.axes[axis].vdv_mps175, axis) for axis, k in factors.items())
    a8_mps2, dose = iso2631.a8(a_w_mps2, hours), iso2631.daily_vdv(vdv, seconds, hours)
    a8_at, vdv_at = iso2631.A8_MPS2, iso2631.VDV_MPS175
    return {
        "daily_hours": hours,
        "a8_mps2": a8_mps2, "a8_axis": a_w_axis, "a8_verdict": a8_at.verdict(a8_mps2),
        "hours_to_a8_action": known(iso2631.hours_to_a8(a_w_mps2, a8_at.action)),
        "hours_to_a8_limit": known(iso2631.hours_to_a8(a_w_mps2, a8_at.limit)),
        "daily_vdv_mps175": dose, "vdv_axis": vdv_axis, "vdv_verdict": vdv_at.verdict(dose),
        "hours_to_vdv_action": known(iso2631.hours_to_vdv(vdv, seconds, vdv_at.action)),
        "hours_to_vdv_limit": known(iso2631.hours_to_vdv(vdv, seconds, vdv_at.limit)),
        "caution_zone": {
            "n2": _zone(iso2631.caution_zone(hours, 2), a_w_mps2, "mps2"),
            "n4": _zone(iso2631.caution_zone(hours, 4), a_w_mps2, "mps2"),
            "vdv": _zone(iso2631.CAUTION_ZONE_VDV_MPS175, dose, "mps175"),
        },
    }


def _zone(zone: CautionZone, value: float, unit: str) -> dict[str, Any]:
    return {f"lower_{unit}": zone.lower, f"upper_{unit}": zone.upper, "verdict": zone.verdict(value)}


def blocks(result: RideComfort, name: str) -> Iterator[Block]:
    """What a person sees; ``name`` is that of the file."""
    answer, *conclusions = _conclusions(result)
    yield Lines([answer])
    yield Lines([f"{name}: {result.vertical.duration_s:.1f} s at {result.rate_hz:.6g} Hz, weighting "
                 f"{result.weighting.name.capitalize()}"])
    by_axis = sorted(result.axes.items())
    yield Table(("axis", "a_w m/s2", "MTVV m/s2", "VDV m/s1.75", "crest", "MTVV/a_w", "VDV/a_wT^1/4"), [
        (axis, *(f"{value:.3f}" if isfinite(value) else "-" for value in (
            one.a_w_mps2, one.mtvv_mps2, one.vdv_mps175, one.crest_factor, one.mtvv_ratio, one.vdv_ratio)))
        for axis, one in by_axis])
    exponential = ", ".join(f"{one.mtvv_exponential_mps2:.3f}" for _, one in by_axis)
    yield Lines([f"MTVV with exponential averaging: {exponential} m/s2"])
    yield Lines(conclusions)
    yield Lines([f"Method: {METHOD}; the mean is removed."])
    if result.unseen_from_hz is not None:
        yield Lines([f"The record cannot show what lies above {result.unseen_from_hz:.4g} Hz. The standard counts "
                     f"frequencies up to {result.weighting.counts_up_to_hz:g} Hz; the values cover only what was "
                     "recorded."])
    if result.left_out:
        yield Lines(["Other axes are combined only with Wk, x and y together; left out."])


def _conclusions(result: RideComfort) -> list[str]:
    """What the figures come to: how it feels, which of them to use, what it does to health."""
    lines = []
    if result.weighting.is_sickness:
        lines.append(f"Motion sickness dose: {_sickness_dose(result.vertical):.3f} m/s1.5.")
    elif not result.weighting.comfort_words:
        lines.append(f"Comfort: ISO 2631-1 has no comfort scale for {result.weighting.name.capitalize()}.")
    elif len(result.axes) > 1:
        totals = _totals(result)
        lines.append(f"Feels {_spoken(totals['total_comfort'])}: a_w {totals['total_a_w_mps2']:.3f} m/s2 over three "
                     "axes.")
    else:
        lines.append(f"Feels {_spoken(_word(result, result.vertical.a_w_mps2))}: a_w "
                     f"{result.vertical.a_w_mps2:.3f} m/s2.")
    if not result.weighting.is_sickness:
        lines.append(_which_to_use(result))
    health = _health(result)
    if health is None:
        return [*lines, f"Health: {result.weighting.name.capitalize()} has no health guidance in ISO 2631-1."]
    n2, n4, dose = (health["caution_zone"][name] for name in ("n2", "n4", "vdv"))
    return [
        *lines,
        f"Health, for {health['daily_hours']:.3g} h a day of this ride:",
        f"  A(8) {health['a8_mps2']:.3f} m/s2 ({health['a8_axis']}), {_spoken(health['a8_verdict'])}"
        f"{_from_hours(health['hours_to_a8_action'])}",
        f"  VDV {health['daily_vdv_mps175']:.2f} m/s1.75 ({health['vdv_axis']}), {_spoken(health['vdv_verdict'])}"
        f"{_from_hours(health['hours_to_vdv_action'])}",
        f"  Caution zone: {_spoken(n2['verdict'])} ({n2['lower_mps2']:.2f} to {n2['upper_mps2']:.2f} m/s2) for "
        f"n = 2, {_spoken(n4['verdict'])} ({n4['lower_mps2']:.2f} to {n4['upper_mps2']:.2f}) for n = 4, "
        f"{_spoken(dose['verdict'])} by VDV",
    ]


def _which_to_use(result: RideComfort) -> str:
    wanted = {axis: figures.beside_a_w() for axis, figures in sorted(result.axes.items()) if figures.beside_a_w()}
    if not wanted:
        return "a_w is enough: no crest factor above 9, no ratio above 1.5 or 1.75."
    which = "; ".join(f"{axis}: {' and '.join(name.upper() for name in names)}" for axis, names in wanted.items())
    return f"a_w alone understates the ride, as there are shocks. Report {which} as well."


def _spoken(word: str | None) -> str:
    return (word or "").replace("_", " ")


def _from_hours(hours: float | None) -> str:
    if hours is None or hours > 24.0:
        return "; not reached in a day"
    return f"; action value reached after {hours:.3g} h"
