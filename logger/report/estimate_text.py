"""What was estimated of a drive's road, for a person and for a program."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from math import isfinite
from typing import Any

import numpy as np

from logger.estimation.assessment import MIX_IRI, SPEED_CLASS_MPS, Assessment, figures, speed_classes
from logger.estimation.road_profile import RESOLVED_SHARE
from logger.estimation.sensor_noise import NOISE_MPS2

_FAR_ABOVE = 1.5
_MOVING_MPS = 1.0
_UNCERTAIN = 0.5
_G_NEAR, _G_CALM_MPS2 = 0.1, 0.5


# --- for programs ---


def as_json(run: str, found: Assessment) -> dict[str, Any]:
    """Settings, the run as a whole, per class of speed, per window; null for what is not known.

    run    as the user knows it
    """
    drive, windows, road = found.drive, found.windows, found.road
    return {
        "run": run, "vehicle": found.vehicle.name, "rate_hz": drive.rate_hz,
        "noise_mps2": found.sensor.noise_rms_mps2,
        "noise_std_mps2": None if found.noise is None else found.noise.std_mps2,
        "noise_learnt": (found.noise is not None) if found.learns_noise else None,
        "step_mps2": found.sensor.step_mps2, "window_m": found.window_m,
        "distance_start_m": float(drive.distance_m[0]), "distance_end_m": float(drive.distance_m[-1]),
        "distance_moved_m": drive.moved_m, "compared": found.compared,
        **({"road_effects": list(found.road_effects)} if found.road_effects else {}),
        **figures(found, windows.speed_mps > 0),
        "unanswered": dict(Counter("|".join(sorted(flags)) for flags in windows.flags if flags)),
        "shortest_wavelength_m": road.shortest_m if road else None,
        "longest_wavelength_m": road.longest_m if road else None,
        "profile_files": [],
        "speeds": [{"from_mps": low, "to_mps": low + SPEED_CLASS_MPS, **figures(found, which)}
                   for low, which in speed_classes(windows)],
        "windows": list(_rows(found)),
    }


def _rows(found: Assessment) -> Iterator[dict[str, Any]]:
    windows = found.windows
    columns = {
        "distance_start_m": windows.edges_m[:-1], "distance_end_m": windows.edges_m[1:],
        "speed_mps": windows.speed_mps, "iri_m_per_km": windows.iri_m_per_km,
        "iri_std_m_per_km": windows.iri_std_m_per_km, "resolved_share": windows.resolved,
        "limit_std_m_per_km": found.least_error_m_per_km,
    } | ({"iri_exact_m_per_km": found.exact_m_per_km} if found.compared else {})
    for *values, flags in zip(*(column.tolist() for column in columns.values()), windows.flags, strict=True):
        row = {name: value if isfinite(value) else None for name, value in zip(columns, values, strict=True)}
        yield row | {"flags": sorted(flags)}


def window_lines(found: Assessment) -> Iterator[str]:
    """The windows as CSV."""
    for number, row in enumerate(_rows(found)):
        if number == 0:
            yield ",".join(row) + "\n"
        *values, flags = row.values()
        yield ",".join("" if value is None else f"{value:.7g}" for value in values) + f",{'|'.join(flags)}\n"


# --- for a person ---


def lines(found: Assessment, summary: dict[str, Any]) -> list[str]:
    """The lines a person sees; ``summary``: the same as JSON."""
    way_m = summary["distance_end_m"] - summary["distance_start_m"]
    shown = [
        f"{summary['run']}: {way_m:.0f} m in a {summary['vehicle']}, "
        f"{len(found.drive.distance_m) / summary['rate_hz']:.0f} s at {summary['rate_hz']:.5g} Hz; windows of "
        f"{summary['window_m']:.4g} m",
        *_sensor_lines(summary),
    ]
    if summary["distance_moved_m"]:
        shown.append("The distance went back here and there: computed again from the speed, "
                     f"{summary['distance_moved_m']:.2f} m off at most.")
    if found.road_effects:
        shown.append(f"Compared with the road that {' and '.join(found.road_effects)} of the vehicle's file makes of "
                     "the profile.")
    if hint := _unit_hint(found):
        shown.append(hint)
    if not summary["answered_count"]:
        return [*shown, f"No IRI: {_unanswered(summary) or 'not one whole window was driven'}"]
    limit = summary["limit"]
    shown += [
        "", f"IRI {summary['iri_m_per_km']:.2f} m/km on the mean, {summary['iri_min_m_per_km']:.2f} to "
        f"{summary['iri_max_m_per_km']:.2f}; {summary['answered_count']} of {summary['window_count']} windows"
        + (f" ({_unanswered(summary)})" if summary["unanswered"] else "") + ".",
        f"An estimator that knew everything would reach R2 {limit['r2_iri_1_to_10']:.3f} over roads of IRI "
        f"{MIX_IRI[0]} to {MIX_IRI[-1]}, {limit['r2_this_road']:.3f} on a road like this one; standard error "
        f"{limit['std_m_per_km']:.2f} m/km at {summary['speed_mps']:.0f} m/s.",
        "Wavelengths resolved: " + _range_words(found),
    ]
    if (factor := summary["iri_std_m_per_km"] / limit["std_m_per_km"]) > _FAR_ABOVE:
        shown.append(f"The standard errors are {factor:.1f} times as large: no vehicle file is trusted beyond a few "
                     "percent, and there may be more in the readings than vehicle and noise explain.")
    shown += ["", *_table(summary)]
    return shown


def _sensor_lines(summary: dict[str, Any]) -> list[str]:
    """What a reading is, and whether that was learnt or given."""
    noise, std = summary["noise_mps2"], summary["noise_std_mps2"]
    rounded = f"rounded to {summary['step_mps2']:g} m/s2 (--step)" if summary["step_mps2"] else "not rounded (--step)"
    if summary["noise_learnt"] is False:
        return [f"This drive shows nothing of the noise. Assumed: {noise:g} m/s2 in a reading, {rounded}"]
    if std is None:
        return [f"Assumed: noise of {noise:g} m/s2 in a reading (--noise), {rounded}"]
    shown = (f"noise of {noise:.3g} +- {std:.1g} m/s2 in a reading" if std < _UNCERTAIN * noise else
             f"noise of about {noise:.2g} m/s2 or less in a reading; this drive cannot resolve it")
    return [f"Learnt from the drive: {shown}", f"Assumed: {rounded}"]


def _unit_hint(found: Assessment) -> str:
    """What makes one doubt that the readings on the way are in m/s2; empty if nothing does."""
    drive = found.drive
    moving = np.diff(drive.distance_m, prepend=drive.distance_m[0]) * drive.rate_hz > _MOVING_MPS
    if not moving.any():
        return ""
    mean, rms = float(drive.accel_z_mps2[moving].mean()), float(drive.accel_z_mps2[moving].std())
    if abs(abs(mean) - 1) < _G_NEAR and rms < _G_CALM_MPS2:
        return f"Acceleration in g? On the way it is {mean:.2f} on the mean and {rms:.3g} r.m.s. about it."
    noise_mps2 = NOISE_MPS2 if found.learns_noise else found.sensor.noise_rms_mps2
    if rms < noise_mps2:
        return (f"Acceleration in g? On the way it is {rms:.3g} r.m.s., less than the noise of "
                f"{noise_mps2:g} {'that sensors have' if found.learns_noise else '(--noise)'}.")
    return ""


def _unanswered(summary: dict[str, Any]) -> str:
    return ", ".join(f"{count} {flags.replace('|', ' and ')}" for flags, count in summary["unanswered"].items())


def _range_words(found: Assessment) -> str:
    road = found.road
    if road is None:
        return f"none over {RESOLVED_SHARE:.0%} of the way."
    left_out = f"; {road.left_out_m:.0f} m in short stretches are left out" if road.left_out_m else ""
    return (f"{road.shortest_m:.2g} to {road.longest_m:.3g} m (each end over {RESOLVED_SHARE:.0%} of the way); "
            f"a profile holds these{left_out}.")


def _table(summary: dict[str, Any]) -> Iterator[str]:
    """Per class of speed: the estimates, then the comparison where there is one."""
    compared = "comparison" in summary
    yield (f"{'m/s':>10}{'windows':>9}{'answered':>10}{'IRI':>8}{'std. error':>12}{'limit':>8}"
           + (f"   {'R2':>7}{'limit':>7}{'bias':>8}{'in 1':>7}{'in 2':>6}" if compared else ""))
    total = [{"from_mps": None, **summary}] if len(summary["speeds"]) > 1 else []
    for row in [*summary["speeds"], *total]:
        name = "all" if row["from_mps"] is None else f"{row['from_mps']:.0f} to {row['to_mps']:.0f}"
        line = f"{name:>10}{row['window_count']:9d}{row['answered_count']:10d}"
        if row["answered_count"]:
            line += f"{row['iri_m_per_km']:8.2f}{row['iri_std_m_per_km']:12.3f}{row['limit']['std_m_per_km']:8.3f}"
        if found := row.get("comparison"):
            line += (f"   {found['r2']:7.3f}{found['limit_r2']:7.3f}{found['bias']:+8.1%}{found['within_one']:7.2f}"
                     f"{found['within_two']:6.2f}")
        yield line
    if compared:
        yield "R2 against the profile; in 1, in 2: windows within one and two standard errors (right: 0.68, 0.95)."
