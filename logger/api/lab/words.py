"""What the lab's answers share: errors on one scale, what is taken out of an error before anything is judged, which
frequencies were compared, and what a residual looks like; in sentences, as rows, in pictures and for a program."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from logger.api.shown import CommandResult
from logger.chart_data import Bars, Curves, Line
from logger.lab.likelihood.record_band import ComparedBand
from logger.lab.likelihood.whittle import LOWEST_HZ
from logger.lab.residuals.breakdown import Part
from logger.lab.residuals.unexplained import EXPONENTIAL, OFFSET, RAMP, STEP, WANDER, Drift, Removed, Shape, SpatialLine
from logger.lab.selection.holdout import AS_FILED, AS_GUESSED, JUDGED_ON, REFITTED, ErrorStep, fit_percent, rising
from logger.printable import percent
from logger.report.blocks import SHOWN_ROWS, Block, Detail, Hint, Table
from logger.report.charts import chart
from logger.report.document import Html
from logger.report.quantities import enumerated, some
from logger.runs import shortened

_WHEEL_RADII_M = (0.22, 0.5)


def not_tried(reasons: Mapping[str, str]) -> list[str]:
    """Effects that were not tried, and why, by name: a sentence for each reason."""
    return [f"{', '.join(name for name, one in reasons.items() if one == why)}: not tried; {why}."
            for why in dict.fromkeys(reasons.values())]


def looks_like(shape: Shape) -> list[str]:
    """What a residual that no candidate explains looks like."""
    turns = [line_sentence(shape.line)] if shape.line is not None and shape.line.found else []
    found = turns + [test.sentence for test in shape.tests.found]
    return found or ["No test finds more: the residual is spread over all frequencies, speeds and places."]


def line_sentence(line: SpatialLine) -> str:
    """What repeats along the way, and what may do so."""
    every_m = 1 / line.at_per_m
    if line.steady:
        return (f"It repeats every {every_m:.2f} m of road or {line.at_per_m * line.speed_mps:.1f} times a second; at "
                f"a steady speed these are the same (clearest in {line.run}). A drive at another speed shows which.")
    radius_m = 1 / (2 * np.pi * line.at_per_m)
    wheel = (f" A wheel of {radius_m:.2f} m radius turns at that rate: check its balance and roundness."
             if _WHEEL_RADII_M[0] < radius_m < _WHEEL_RADII_M[1] else "")
    return f"It repeats every {every_m:.2f} m of road at any speed (clearest in {line.run}).{wheel}"


def paired(before: Sequence[Part], after: Sequence[Part]) -> list[tuple[Part | None, Part]]:
    """Parts with those of another model of the same runs: bands by their names, as a car's own vibrations move with its
    numbers; others by their ends. None where there is no such part."""
    known = {one.name or (one.low, one.high): one for one in before}
    return [(known.get(one.name or (one.low, one.high)), one) for one in after]


_ALIKE = 0.15
"""Drifts whose numbers differ by less are said at once."""
_REMOVED_WORDS = {
    OFFSET: "a constant offset of {size:.2g} m/s2",
    RAMP: "a ramp of {size:.2g} m/s2 in total",
    STEP: "a step of {size:.2g} m/s2 at {time:.3g} s",
    EXPONENTIAL: "an exponential of {size:.2g} m/s2 with a time constant of {time:.2g} s",
    WANDER: "irregularly, {size:.2g} m/s2 r.m.s.",
}
HEADS = ("What", "Share of the residual's power", "")


def removed_words(found: Removed, band: ComparedBand | None) -> list[str]:
    """What was filtered, drifted and lay elsewhere, with its share of the residual of the model as it stands; nothing
    of what is no more than usual."""
    return [*filter_words(found, band), *(one.words for one in removed_by_share(found))]


def filter_words(found: Removed, band: ComparedBand | None) -> list[str]:
    """Which frequencies were compared, why, and what lies outside; nothing where all were."""
    lines = band_words(band)
    if found.filter_share > 0 and lines:
        lines[0] += f" {percent(found.filter_share)} of the residual's power lies outside that band."
    return lines


class RemovedCause(NamedTuple):
    """What drifted or lay elsewhere: its share of the residual of the model as it stands, its name, how much, and all
    of it in words."""

    share: float
    name: str
    size: str
    words: str


def removed_by_share(found: Removed) -> list[RemovedCause]:
    """What drifted and lay elsewhere, the largest share first."""
    causes, distance, corrected = [], found.distance_share, (
        f"This causes {percent(found.distance_share)} of the residual's power before any fit; the fits correct it.")
    if found.distance_error_m > 0:
        size = f"up to {found.distance_error_m:.2g} m"
        causes.append(RemovedCause(distance, "wrong distances", size, (
            f"The distances of these runs are off by {size}, more than usual. {corrected}")))
    late_ms, clock = 1e3 * found.lag_s, []
    if round(found.clock_ppm):
        clock.append((f"{found.clock_ppm:+.0f} ppm", f"runs {abs(found.clock_ppm):.0f} ppm "
                      f"{'faster' if found.clock_ppm > 0 else 'slower'} than"))
    if round(1e3 * late_ms):
        clock.append((f"{late_ms:+.2g} ms", f"is {abs(late_ms):.2g} ms {'behind' if late_ms > 0 else 'ahead of'}"))
    if clock:
        sizes, words = zip(*clock, strict=True)
        causes.append(RemovedCause(distance, "another clock", ", ".join(sizes), (
            f"The recorder's clock {' and '.join(words)} that of the excitation. {corrected}")))
    if found.drifting_sensors:
        size = drift_words(found)
        causes.append(RemovedCause(found.drift_share, "sensor drift", size, (
            f"The sensor drifts ({size}). The motion does not cause the drift, which makes up "
            f"{percent(found.drift_share)} of the residual's power before any fit. The lab ignores all below "
            f"{LOWEST_HZ:g} Hz; without the drift, the refitted model's NRMSE is {found.error:.3f}.")))
    return sorted(causes, reverse=True)


def drift_words(found: Removed) -> str:
    """How the sensors drift: at once where all runs are alike, else run by run."""
    drifts = found.drifting_sensors
    first = drifts[0]
    if len(drifts) == len(found.drifts) and all(_alike(one, first) for one in drifts):
        size = float(np.median([one.size_mps2 for one in drifts]))
        times = [one.time_s for one in drifts if one.time_s is not None]
        return _REMOVED_WORDS[first.form].format(size=size, time=float(np.median(times)) if times else np.nan)
    names = shortened([one.run for one in found.drifts])
    return some([f"{names[one.run]}: {_said(one)}" for one in drifts], "; ", "more runs")


def removed_json(found: Removed) -> dict[str, Any]:
    """The same for a program; shares are of the power of the residual of the model as it stands, at all frequencies."""
    return {
        "removed": {
            "drift": {"error_power_share": found.drift_share, "judged_from_hz": LOWEST_HZ, "runs": [
                {"run": one.run, "form": one.form, "size_mps2": one.size_mps2, "time_s": one.time_s}
                for one in found.drifts]},
            "distance": {"error_power_share": found.distance_share, "off_m": found.distance_error_m,
                         "clock_ppm": found.clock_ppm, "lag_s": found.lag_s},
            "filter": {"error_power_share": found.filter_share},
        },
        "error_without_drift": found.error,
    }


def removed_section(found: Removed, band: ComparedBand | None) -> Detail:
    """A page's part on it; nothing where nothing was removed that is more than usual."""
    rows = [(one.name, percent(one.share), one.size) for one in removed_by_share(found)]
    if band is not None:
        rows.append(("outside the pass band", percent(found.filter_share),
                     f"compared from {band.low_hz:.3g} to {band.high_hz:.3g} Hz"))
    return Detail("Removed before judging", [
        Table(HEADS, rows, (0, 2)), *_picture(found),
        Hint("Shares of the residual's power with the vehicle's file as it is.")])


def drift_tile(found: Removed) -> list[tuple[str, str, str]]:
    """The error without the drift, in large figures; nothing where nothing drifts."""
    return [("Without the sensor's drift", f"{found.error:.3f}", "refitted")] if found.drifting_sensors else []


def _picture(found: Removed) -> list[Curves]:
    if not found.drifting_sensors:
        return []
    names = shortened([one.run for one in found.drifts])
    lines = tuple(Line(names[one.run], np.arange(len(one.curve_mps2)) / one.rate_hz, one.curve_mps2)
                  for one in found.drifting_sensors[:SHOWN_ROWS])
    return [Curves("Sensor drift", "time [s]", "acceleration [m/s2]", lines)]


def _said(one: Drift) -> str:
    return _REMOVED_WORDS[one.form].format(size=one.size_mps2, time=one.time_s)


def _alike(one: Drift, other: Drift) -> bool:
    pairs = ((one.size_mps2, other.size_mps2), (one.time_s, other.time_s))
    return one.form == other.form and all(a is None or b is None or abs(a - b) <= _ALIKE * abs(b) for a, b in pairs)


_ERROR_WORDS = {one: f"with {one}" for one in (AS_FILED, AS_GUESSED, REFITTED)}


def error_words(steps: Sequence[ErrorStep], floor: float, of: str = f"on {JUDGED_ON}", about: str = "about"
                ) -> list[str]:
    """The errors of each step ``of`` what no fit saw, and of the noise alone, and why one rises."""
    each = ", ".join(f"{error_and_fit(one.error)} {_ERROR_WORDS.get(one.words, one.words)}" for one in steps)
    lines = [f"NRMSE {of}: {each}. Noise floor: {about} {error_and_fit(floor)}."]
    if rises := rising(steps):
        said = enumerated([_ERROR_WORDS.get(one, one) for one in rises], "and")
        lines.append(f"It rises {said}: what fits a part of the data need not fit the rest. A fit also "
                     "weights each frequency by its noise, while the NRMSE counts all equally.")
    return lines


def force_words(gain: float | None) -> list[str]:
    """That the forces that drive a rig are not what they say."""
    if gain is None:
        return []
    which = ("of the opposite sign" if gain < 0 else "several times as large" if gain < 10 else
             f"about {float(f'{gain:.1g}'):.0f} times as large")
    return [f"Forces {which} would explain most of the residual of the refitted model: are sign and unit of "
            "excitation.csv right, and what run.yaml says they act on?"]


def error_and_fit(error: float) -> str:
    """An error with its fit per cent: "0.153 (fit 84.7 %)"."""
    return f"{error:.3f} (fit {fit_percent(error):.1f} %)"


def errors_json(steps: Sequence[ErrorStep], floor: float) -> dict[str, Any]:
    """The same for a program."""
    return {"errors": [{"model": one.words, "error": one.error, "fit_percent": fit_percent(one.error)}
                       for one in (*steps, ErrorStep("noise alone", floor))]}


def band_words(band: ComparedBand | None) -> list[str]:
    """Which frequencies were compared, and why; nothing where all were."""
    if band is None:
        return []
    inside = (f"from {band.low_hz:.3g} " if band.low_hz > 0 else "up ") + f"to {band.high_hz:.3g} Hz"
    if band.cutoff_hz is None:
        return [f"You asked, or run.yaml says, to compare {inside}."]
    which = "Some recorders" if band.some else "The recorder"
    return [f"{which} low-passed at about {band.cutoff_hz:.2g} Hz, so measurement and model are compared {inside}."]


def band_json(band: ComparedBand | None) -> dict[str, Any]:
    """The same for a program; nothing where all were."""
    if band is None:
        return {}
    return {"pass_band_hz": [band.low_hz, band.high_hz], "low_passed_at_hz": band.cutoff_hz}


MODEL_BY_MODEL = "NRMSE, model by model"


@dataclass(frozen=True, eq=False, repr=False)
class ModelByModel(CommandResult):
    """An answer with the models on the way to it.

    steps                each model with its error on what no fit saw
    noise_floor_error    that the sensor's noise alone makes
    """

    steps: tuple[ErrorStep, ...]
    noise_floor_error: float

    def figures(self) -> list[Html]:
        """How the error fell, and the charts."""
        return [chart(falling(MODEL_BY_MODEL, self.steps, self.noise_floor_error)), *super().figures()]


def steps_section(steps: Sequence[ErrorStep], floor: float, *more: Block) -> Detail:
    """The error of each step on what no fit saw, as bars and as a table."""
    rows = [(f"{number}", one.words, f"{one.error:.4f}") for number, one in enumerate(steps)]
    return Detail(MODEL_BY_MODEL, [falling(f"NRMSE on {JUDGED_ON}", steps, floor),
                                   Table(("Step", "Model", "NRMSE"), rows, (0, 1)), *more])


def falling(title: str, steps: Sequence[ErrorStep], floor: float) -> Bars:
    """The error of each step, beside the noise."""
    return Bars(title, "NRMSE", tuple((one.words, one.error) for one in steps), (floor, "noise floor"))
