"""How much a vehicle shakes on roads of known roughness."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from logger.api.drive_questions import CalibrateQuestion
from logger.api.question import Notify, function
from logger.api.shown import CommandResult
from logger.api.vehicles import Model
from logger.errors import BadInput
from logger.files import write_text
from logger.shipped import vehicle_path
from logger.store.formats import vehicle_file

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.estimation.rms_calibration import CalibrationSettings, SpeedCalibration
    from logger.report.calibration_text import Calibrated
    from logger.vehicle.effect import Chosen
    from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]


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

    found                       all of it, with and without a load
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
        """Of the car as it was driven, with its load [kg]."""
        return float(self._json["sprung_mass_kg"])

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the figures of each speed as CSV."""
        from logger.report.calibration_text import csv_lines

        write_text(path, csv_lines(self.found.speeds), "ascii")

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """Where more is."""
        return "Next: --out FILE.csv or --json for all figures" + (
            "." if self.found.load else "; --passengers 2 for what a load changes.")

    def charts(self) -> Sequence[Chart]:
        """IRI per r.m.s. acceleration over the speed, of whole roads and of windows."""
        from logger.chart_data import Curves, Line

        return [Curves("Calibration", "speed [m/s]", "IRI per r.m.s. [m/km per m/s2]", tuple(
            Line(name, self.speed_mps, one.slope, one.slope * one.spread)
            for name, one in (("roads", self.iri_per_accel_rms), ("windows", self.window_iri_per_accel_rms))))]


def calibration_of(question: CalibrateQuestion) -> Calibration:
    """The answer to ``CalibrateQuestion``, which says what is raised."""
    from logger.report.calibration_text import as_json, lines

    vehicle = question.vehicle
    path = None if isinstance(vehicle, Model) else vehicle_path(str(vehicle))
    found = calibrated(vehicle if isinstance(vehicle, Model) else vehicle_file.read_model(str(path)), path, question)
    speeds = found.speeds
    return Calibration(
        "\n".join(lines(found)), as_json(found), found, np.array([one.speed_mps for one in speeds]),
        *(_slopes(speeds, name) for name in (
            "iri_per_accel_rms", "window_iri_per_accel_rms", "accel_rms_per_root_gd", "a_w_per_iri")))


calibrate = function("calibrate", CalibrateQuestion, calibration_of)


def _slopes(speeds: Sequence[SpeedCalibration], name: str) -> Slopes:
    lines = [getattr(one, name) for one in speeds]
    return Slopes(*(np.array([getattr(line, one.name) for line in lines]) for one in fields(Slopes)))


def calibrated(model: vehicle_file.Model, path: Path | None, question: CalibrateQuestion) -> Calibrated:
    """The lines of a vehicle, and with a load if there is to be one. BadInput for a window that no road has, and for a
    vehicle that lacks what its model or an effect needs.

    path    of the vehicle's file, beside which they are kept; None: nowhere
    """
    from logger.estimation.rms_calibration import CalibrationSettings, loaded
    from logger.report.calibration_text import Calibrated, Load
    from logger.service.signal_chain import recorder_gain

    try:
        settings = CalibrationSettings(window_m=question.window_m, seed=question.seed)
    except ValueError as error:
        raise question.wrong("window_m", f": {error}") from None
    vehicle = model.vehicle
    if any(one.file is not None for one in model.effects):
        path = None  # what is in that file may change
    ask = _Ask(path, model.effects, recorder_gain(question.low_pass_hz), settings, question.recompute,
               question.progress)
    plain = _answer(ask, vehicle, vehicle.name)
    people, factor = question.passengers, question.sprung_mass_factor
    if not people and factor == 1.0:
        return Calibrated(vehicle, settings, plain, None)
    heavy = loaded(vehicle, people, factor)
    with_load = _answer(ask, heavy, f"{vehicle.name} with its load")
    return Calibrated(vehicle, settings, plain,
                      Load(people, factor, vehicle.sprung_mass_kg, heavy.sprung_mass_kg, with_load))


@dataclass(frozen=True)
class _Ask:
    """What is asked of a vehicle, where a stored answer may be, and what is called with its source."""

    path: Path | None
    effects: Sequence[Chosen]
    gain: Callable[[Array], Array]
    settings: CalibrationSettings
    recompute: bool
    notify: Notify


def _answer(ask: _Ask, vehicle: Vehicle, title: str) -> tuple[SpeedCalibration, ...]:
    """The stored calibration of this vehicle, or a new one, which is then stored."""
    from logger.estimation import rms_calibration
    from logger.store.formats.vehicle_file import find, fingerprint, keep, places
    from logger.vehicle.linearise import known_vehicle

    kept_in = () if ask.path is None else places(ask.path)
    key = fingerprint(vehicle, ask.gain, ask.settings, ask.effects)
    found = None if ask.recompute else find(kept_in, key)
    if found is not None:
        ask.notify(f"{title}: found in {found.path}")
        return found.speeds
    started_s = time.perf_counter()
    try:
        speeds = rms_calibration.calibrate(known_vehicle(vehicle, ask.effects), ask.gain, ask.settings)
    except ValueError as error:
        raise BadInput(f"{vehicle.name}: {error}") from None
    took_s = time.perf_counter() - started_s
    path = keep(kept_in, key, speeds)
    where = (f"kept in {path}" if path else "not kept" if not kept_in else
             f"not kept: {' or '.join(map(str, kept_in))} cannot be written")
    ask.notify(f"{title}: computed in {took_s:.1f} s, {where}")
    return speeds
