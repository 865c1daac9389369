"""What is taken out of an error before anything is judged: in sentences, as rows, in pictures and for a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from logger.chart_data import Curves, Line
from logger.lab.likelihood.record_band import ComparedBand
from logger.lab.likelihood.whittle import LOWEST_HZ
from logger.lab.residuals.removed import Removed
from logger.lab.residuals.sensor_drift import EXPONENTIAL, OFFSET, RAMP, STEP, WANDER, Drift
from logger.printable import percent
from logger.report.band_text import band_words
from logger.report.charts import chart
from logger.report.document import grid, hint, section
from logger.report.html import EMPTY, Html
from logger.runs import shortened

_ALIKE = 0.15
"""Drifts whose numbers differ by less are said at once."""
_MOST = 4
_WORDS = {
    OFFSET: "a constant offset of {size:.2g} m/s2",
    RAMP: "a ramp of {size:.2g} m/s2 in all",
    STEP: "a step of {size:.2g} m/s2 at {time:.3g} s",
    EXPONENTIAL: "exponential, {time:.2g} s, {size:.2g} m/s2",
    WANDER: "a random walk, {size:.2g} m/s2 r.m.s.",
}
HEADS = ("What", "Share of the residual's power", "")


def removed_words(found: Removed, band: ComparedBand | None) -> list[str]:
    """What was filtered, drifted and lay elsewhere, with its share of the residual of the model as it stands; nothing
    of what is no more than usual."""
    lines = band_words(band)
    if found.filter_share > 0 and lines:
        lines[0] += (f" Outside of that lies {percent(found.filter_share)} of the power of their difference.")
    if found.distance_error_m > 0:
        lines.append(f"The distances of these runs are off by more than usual: up to {found.distance_error_m:.2g} m. "
                     f"That makes {percent(found.distance_share)} of the residual's power before any fit; the fits "
                     "take it into account.")
    if found.drifting_sensors:
        lines.append(f"The sensor drifts ({drift_words(found)}). That has nothing to do with the car, and makes "
                     f"{percent(found.drift_share)} of the residual's power before any fit. Below {LOWEST_HZ:g} Hz "
                     f"nothing is judged; without the drift the error of the refitted model is {found.error:.3f}.")
    return lines


def drift_words(found: Removed) -> str:
    """How the sensors drift: at once where all runs are alike, else run by run."""
    drifts = found.drifting_sensors
    first = drifts[0]
    if len(drifts) == len(found.drifts) and all(_alike(one, first) for one in drifts):
        size = float(np.median([one.size_mps2 for one in drifts]))
        times = [one.time_s for one in drifts if one.time_s is not None]
        return _WORDS[first.form].format(size=size, time=float(np.median(times)) if times else np.nan)
    names = shortened([one.run for one in found.drifts])
    each = [f"{names[one.run]}: {_said(one)}" for one in drifts[:_MOST]]
    more = len(drifts) - len(each)
    return "; ".join([*each, f"and {more} more runs"] if more else each)


def removed_json(found: Removed) -> dict[str, Any]:
    """The same for a program; shares are of the power of the residual of the model as it stands, at all frequencies."""
    return {
        "removed": {
            "drift": {"error_power_share": found.drift_share, "judged_from_hz": LOWEST_HZ, "runs": [
                {"run": one.run, "form": one.form, "size_mps2": one.size_mps2, "time_s": one.time_s}
                for one in found.drifts]},
            "distance": {"error_power_share": found.distance_share, "off_m": found.distance_error_m},
            "filter": {"error_power_share": found.filter_share},
        },
        "error_without_drift": found.error,
    }


def removed_section(found: Removed, band: ComparedBand | None) -> Html:
    """A page's part on it; nothing where nothing was removed that is more than usual."""
    if not removed_words(found, band):
        return EMPTY
    rows = []
    if found.drifting_sensors:
        rows.append(("drift of the sensor", percent(found.drift_share), drift_words(found)))
    if found.distance_error_m > 0:
        rows.append(("wrong distances", percent(found.distance_share), f"up to {found.distance_error_m:.2g} m"))
    if band is not None:
        rows.append(("outside of the pass band", percent(found.filter_share),
                     f"compared from {band.low_hz:.3g} to {band.high_hz:.3g} Hz"))
    return section("What is removed before anything is judged", grid(HEADS, rows, words=(0, 2)) + _picture(found)
                   + hint("Shares are of the power by which the model as it stands and the record differ."))


def drift_tile(found: Removed) -> list[tuple[str, str, str]]:
    """The error without the drift, in large figures; nothing where nothing drifts."""
    return [("Without the sensor's drift", f"{found.error:.3f}", "refitted")] if found.drifting_sensors else []


def _picture(found: Removed) -> Html:
    if not found.drifting_sensors:
        return EMPTY
    names = shortened([one.run for one in found.drifts])
    lines = tuple(Line(names[one.run], np.arange(len(one.curve_mps2)) / one.rate_hz, one.curve_mps2)
                  for one in found.drifting_sensors[:2 * _MOST])
    return chart(Curves("The drift of the sensor", "time in the run [s]", "acceleration [m/s2]", lines))


def _said(one: Drift) -> str:
    return _WORDS[one.form].format(size=one.size_mps2, time=one.time_s)


def _alike(one: Drift, other: Drift) -> bool:
    pairs = ((one.size_mps2, other.size_mps2), (one.time_s, other.time_s))
    return one.form == other.form and all(
        a is None or b is None or abs(a - b) <= _ALIKE * abs(b) for a, b in pairs)

