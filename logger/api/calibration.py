"""How much a vehicle shakes on roads of known roughness."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.drive_questions import CalibrateQuestion
from logger.api.inputs import Model
from logger.api.shown import CommandResult
from logger.chart_data import Array, Chart, Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS
from logger.errors import as_bad_input
from logger.estimation import rms_calibration
from logger.estimation.rms_calibration import LEVELS_IRI, CalibrationSettings, RmsLine, SpeedCalibration
from logger.files import write_text
from logger.question import function
from logger.report.blocks import Block, Blocks, Lines, Table
from logger.service.signal_chain import recorder_gain
from logger.shipped import vehicle_path
from logger.store.formats import vehicle_file
from logger.store.formats.calibration_file import find, fingerprint, keep, places
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.vehicle import Vehicle


@dataclass(frozen=True, eq=False)
class Slopes:
    """Lines through the origin, one for each of s speeds.

    slope             (s,)
    standard_error    (s,) of the slope, from how the roads differ among themselves
    spread            (s,) 68 of 100 points lie within this share of the line
    r2                (s,) share of the variance that the line explains
    """

    slope: Array
    standard_error: Array
    spread: Array
    r2: Array


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(CommandResult):
    """A vehicle's relations between roughness and vibration at s speeds.

    found                       all of it
    speed_mps                   (s,) 10, 20 ... 70 mph [m/s]
    iri_per_accel_rms           whole roads: IRI per r.m.s. acceleration [m/km per m/s2]
    window_iri_per_accel_rms    the same for windows: their own IRI and their own r.m.s.
    accel_rms_per_root_gd       whole roads: r.m.s. per root of Gd(n0) [m/s2 per cm^1.5]
    a_w_per_iri                 whole roads: Wk-weighted r.m.s. per IRI [m/s2 per m/km]
    """

    found: Calibrated
    speed_mps: Array
    iri_per_accel_rms: Slopes
    window_iri_per_accel_rms: Slopes
    accel_rms_per_root_gd: Slopes
    a_w_per_iri: Slopes

    @property
    def sprung_mass_kg(self) -> float:
        """Of the car [kg]."""
        return self.found.vehicle.sprung_mass_kg

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the figures of each speed as CSV."""
        write_text(path, csv_lines(self.found.speeds), "ascii")

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """Where more is."""
        return "Next: --out FILE.csv or --json for all figures."

    def charts(self) -> Sequence[Chart]:
        """IRI per r.m.s. acceleration over the speed, of whole roads and of windows."""
        return [Curves("Calibration", "speed [m/s]", "IRI per r.m.s. [m/km per m/s2]", tuple(
            Line(name, self.speed_mps, one.slope, one.slope * one.spread)
            for name, one in (("roads", self.iri_per_accel_rms), ("windows", self.window_iri_per_accel_rms))))]


@function(CalibrateQuestion)
def calibrate(question: CalibrateQuestion) -> Calibration:
    vehicle = question.vehicle
    path = None if isinstance(vehicle, Model) else vehicle_path(str(vehicle))
    found = calibrated(vehicle if isinstance(vehicle, Model) else vehicle_file.read_model(str(path)), path, question)
    speeds = found.speeds
    return Calibration(
        Blocks(blocks(found)), as_json(found), found, np.array([one.speed_mps for one in speeds]),
        *(_slopes(speeds, name) for name in (
            "iri_per_accel_rms", "window_iri_per_accel_rms", "accel_rms_per_root_gd", "a_w_per_iri")))


def _slopes(speeds: Sequence[SpeedCalibration], name: str) -> Slopes:
    lines = [getattr(one, name) for one in speeds]
    return Slopes(*(np.array([getattr(line, one.name) for line in lines]) for one in fields(Slopes)))


def calibrated(model: vehicle_file.CarModel, path: Path | None, question: CalibrateQuestion) -> Calibrated:
    """The lines of a vehicle. BadInput for a window that no road has, and for a vehicle that lacks what its model or an
    effect needs.

    path    of the vehicle's file, beside which they are kept; None: nowhere
    """
    try:
        settings = CalibrationSettings(window_m=question.window_m)
    except ValueError as error:
        raise question.wrong("window_m", f": {error}") from None
    vehicle = model.vehicle
    vehicle_file.check_on_road(vehicle)
    if any(one.file is not None for one in model.effects):
        path = None  # what is in that file may change
    kept_in = () if path is None else places(path)
    gain = recorder_gain(None)
    key = fingerprint(vehicle, gain, settings, model.effects)
    found = find(kept_in, key)
    if found is not None:
        question.progress(f"{vehicle.name}: found in {found.path}")
        return Calibrated(vehicle, settings, found.speeds)
    started_s = time.perf_counter()
    with as_bad_input(vehicle.name):
        speeds = rms_calibration.calibrate(known_vehicle(vehicle, model.effects), gain, settings)
    took_s = time.perf_counter() - started_s
    path = keep(kept_in, key, speeds)
    where = (f"kept in {path}" if path else "not kept" if not kept_in else
             f"not kept: {' or '.join(map(str, kept_in))} cannot be written")
    question.progress(f"{vehicle.name}: computed in {took_s:.1f} s, {where}")
    return Calibrated(vehicle, settings, speeds)


_COMFORT_WORD = "uncomfortable"
# Lines by what their figures are called in JSON and CSV, after the slope under its own name.
_PREFIXES = {"iri_per_accel_rms": "", "window_iri_per_accel_rms": "window_", "accel_rms_per_root_gd": "accel_rms_",
             "a_w_per_iri": "a_w_"}


@dataclass(frozen=True)
class Calibrated:
    """A vehicle's lines at each speed, and on what roads they were found."""

    vehicle: Vehicle
    settings: CalibrationSettings
    speeds: tuple[SpeedCalibration, ...]


def as_json(found: Calibrated) -> dict[str, Any]:
    """``vehicle`` and ``speeds``; then what the roads were."""
    settings = found.settings
    return {
        "vehicle": found.vehicle.name, "speeds": [row(speed) for speed in found.speeds],
        "window_m": settings.window_m, "road_m": settings.road_m, "roads": settings.roads, "seed": settings.seed,
        "sprung_mass_kg": found.vehicle.sprung_mass_kg}


def row(speed: SpeedCalibration) -> dict[str, float]:
    """The figures of a speed by name."""
    found = {"speed_mps": speed.speed_mps}
    for name, prefix in _PREFIXES.items():
        line: RmsLine = getattr(speed, name)
        found |= {name: line.slope, f"{prefix}spread": line.spread, f"{prefix}standard_error": line.standard_error,
                  f"{prefix}r2": line.r2}
    return found


def csv_lines(speeds: Sequence[SpeedCalibration]) -> Iterator[str]:
    """The same of all speeds as the lines of a CSV file."""
    yield ",".join(row(speeds[0])) + "\n"
    for speed in speeds:
        yield ",".join(f"{value:.7g}" for value in row(speed).values()) + "\n"


def blocks(found: Calibrated) -> list[Block]:
    """What a person reads."""
    settings = found.settings
    limit_mps2 = next(lowest for lowest, word in COMFORT_WORDS if word == _COMFORT_WORD)
    rows = []
    for speed in found.speeds:
        road, window = speed.iri_per_accel_rms, speed.window_iri_per_accel_rms
        rows.append((
            f"{speed.speed_mps:.2f}", f"{speed.speed_mps / MPH_MPS:.0f}",
            f"{road.slope:.3f} ± {road.standard_error:.3f}", f"{road.spread:.1%}", f"{road.r2:.4f}",
            f"{window.slope:.3f}", f"{window.spread:.1%}", f"{window.r2:.2f}",
            f"{speed.accel_rms_per_root_gd.slope:.5f}", f"{speed.a_w_per_iri.slope:.5f}",
            f"{limit_mps2 / speed.a_w_per_iri.slope:.1f}"))
    return [
        Lines([f"{found.vehicle.name}: {settings.roads} random roads of {settings.road_m:.0f} m, IRI "
               f"{LEVELS_IRI[0]:g} to {LEVELS_IRI[-1]:g} m/km"]),
        Table(("m/s", "mph", "IRI/rms", "spread", "R2", "IRI/rms*", "spread", "R2", "rms/root Gd", "a_w/IRI",
               "from IRI"), rows, ()),
        Lines([f"* for windows of {settings.window_m:.4g} m; the other columns are for whole roads.",
               "IRI [m/km] = IRI/rms x r.m.s. vertical acceleration [m/s2]; 68 % lie within the spread.",
               f"Above the IRI in the last column, ISO 2631-1 calls the ride {_COMFORT_WORD}."])]
