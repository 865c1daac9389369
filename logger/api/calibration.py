"""How much a vehicle shakes on roads of known roughness.

A vehicle's relations between roughness and vibration, for a person and for a program.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.drive_questions import CalibrateQuestion
from logger.api.question import Notify, function
from logger.api.shown import CommandResult
from logger.api.vehicles import Model
from logger.chart_data import Array, Chart, Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS
from logger.errors import BadInput
from logger.estimation import rms_calibration
from logger.estimation.rms_calibration import LEVELS_IRI, CalibrationSettings, RmsLine, SpeedCalibration, loaded
from logger.files import write_text
from logger.service.signal_chain import recorder_gain
from logger.shipped import vehicle_path
from logger.store.formats import vehicle_file
from logger.store.formats.vehicle_file import find, fingerprint, keep, places
from logger.units import MPH_MPS
from logger.vehicle.effect import Chosen
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
        write_text(path, csv_lines(self.found.speeds), "ascii")

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """Where more is."""
        return "Next: --out FILE.csv or --json for all figures" + (
            "." if self.found.load else "; --passengers 2 for what a load changes.")

    def charts(self) -> Sequence[Chart]:
        """IRI per r.m.s. acceleration over the speed, of whole roads and of windows."""
        return [Curves("Calibration", "speed [m/s]", "IRI per r.m.s. [m/km per m/s2]", tuple(
            Line(name, self.speed_mps, one.slope, one.slope * one.spread)
            for name, one in (("roads", self.iri_per_accel_rms), ("windows", self.window_iri_per_accel_rms))))]


def calibration_of(question: CalibrateQuestion) -> Calibration:
    """The answer to ``CalibrateQuestion``, which says what is raised."""
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
    try:
        settings = CalibrationSettings(window_m=question.window_m)
    except ValueError as error:
        raise question.wrong("window_m", f": {error}") from None
    vehicle = model.vehicle
    vehicle_file.check_on_road(vehicle)
    if any(one.file is not None for one in model.effects):
        path = None  # what is in that file may change
    ask = _Ask(path, model.effects, settings, question.progress)
    plain = _answer(ask, vehicle, vehicle.name)
    people = question.passengers
    if not people:
        return Calibrated(vehicle, settings, plain, None)
    heavy = loaded(vehicle, people)
    with_load = _answer(ask, heavy, f"{vehicle.name} with its load")
    return Calibrated(vehicle, settings, plain,
                      Load(people, vehicle.sprung_mass_kg, heavy.sprung_mass_kg, with_load))


@dataclass(frozen=True)
class _Ask:
    """What is asked of a vehicle, where a stored answer may be, and what is called with its source."""

    path: Path | None
    effects: Sequence[Chosen]
    settings: CalibrationSettings
    notify: Notify


def _answer(ask: _Ask, vehicle: Vehicle, title: str) -> tuple[SpeedCalibration, ...]:
    """The stored calibration of this vehicle, or a new one, which is then stored."""
    kept_in = () if ask.path is None else places(ask.path)
    gain = recorder_gain(None)
    key = fingerprint(vehicle, gain, ask.settings, ask.effects)
    found = find(kept_in, key)
    if found is not None:
        ask.notify(f"{title}: found in {found.path}")
        return found.speeds
    started_s = time.perf_counter()
    try:
        speeds = rms_calibration.calibrate(known_vehicle(vehicle, ask.effects), gain, ask.settings)
    except ValueError as error:
        raise BadInput(f"{vehicle.name}: {error}") from None
    took_s = time.perf_counter() - started_s
    path = keep(kept_in, key, speeds)
    where = (f"kept in {path}" if path else "not kept" if not kept_in else
             f"not kept: {' or '.join(map(str, kept_in))} cannot be written")
    ask.notify(f"{title}: computed in {took_s:.1f} s, {where}")
    return speeds


_COMFORT_WORD = "uncomfortable"
# Lines by what their figures are called in JSON and CSV, after the slope under its own name.
_PREFIXES = {"iri_per_accel_rms": "", "window_iri_per_accel_rms": "window_", "accel_rms_per_root_gd": "accel_rms_",
             "a_w_per_iri": "a_w_"}


@dataclass(frozen=True)
class Load:
    """A car with a load, and its lines."""

    passengers: int
    empty_kg: float
    sprung_mass_kg: float
    speeds: tuple[SpeedCalibration, ...]


@dataclass(frozen=True)
class Calibrated:
    """A vehicle's lines: ``plain`` without a load, and those with it."""

    vehicle: Vehicle
    settings: CalibrationSettings
    plain: tuple[SpeedCalibration, ...]
    load: Load | None

    @property
    def speeds(self) -> tuple[SpeedCalibration, ...]:
        """The lines that were asked for: with the load, if there is one."""
        return self.load.speeds if self.load else self.plain


def as_json(found: Calibrated) -> dict[str, Any]:
    """``vehicle`` and ``speeds``, of the car with its load if there is one; then what the roads were."""
    vehicle, settings, load = found.vehicle, found.settings, found.load
    result = {
        "vehicle": vehicle.name, "speeds": [row(speed) for speed in found.speeds],
        "window_m": settings.window_m, "road_m": settings.road_m, "roads": settings.roads, "seed": settings.seed,
        "sprung_mass_kg": load.sprung_mass_kg if load else vehicle.sprung_mass_kg,
    }
    if load is not None:
        result |= {"passengers": load.passengers, "speeds_without_load": [row(speed) for speed in found.plain]}
    return result


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


def lines(found: Calibrated) -> list[str]:
    """What a person reads."""
    settings, load = found.settings, found.load
    limit_mps2 = next(lowest for lowest, word in COMFORT_WORDS if word == _COMFORT_WORD)
    shown = [
        f"{found.vehicle.name}{', with its load' if load else ''}: {settings.roads} random roads of "
        f"{settings.road_m:.0f} m, IRI {LEVELS_IRI[0]:g} to {LEVELS_IRI[-1]:g} m/km", "",
        f"{'':12}{f'roads of {settings.road_m:.0f} m':^33}{f'windows of {settings.window_m:.4g} m':^26}"
        f"{'rms per':>9}{'comfort':>10}{_COMFORT_WORD[:6]:>9}",
        f"{'m/s':>6}{'mph':>5} {'IRI per rms':>16}{'spread':>9}{'R2':>8} {'IRI per rms':>12}{'spread':>8}{'R2':>6}"
        f"{'root Gd':>9}{'a_w/IRI':>10}{'from IRI':>9}",
    ]
    for speed in found.speeds:
        road, window = speed.iri_per_accel_rms, speed.window_iri_per_accel_rms
        slope = f"{road.slope:.3f} +- {road.standard_error:.3f}"
        shown.append(
            f"{speed.speed_mps:6.2f}{speed.speed_mps / MPH_MPS:5.0f} {slope:>16}{road.spread:9.1%}{road.r2:8.4f} "
            f"{window.slope:12.3f}{window.spread:8.1%}{window.r2:6.2f}{speed.accel_rms_per_root_gd.slope:9.5f}"
            f"{speed.a_w_per_iri.slope:10.5f}{limit_mps2 / speed.a_w_per_iri.slope:9.1f}")
    shown += ["", "IRI [m/km] = 'IRI per rms' x r.m.s. vertical acceleration [m/s2]; 68 of 100 lie within the spread.",
              f"ISO 2631-1 calls the ride '{_COMFORT_WORD}' from the last column's IRI on."]
    if load is not None:
        shown += ["", *_comparison(found.plain, load)]
    return shown


def _comparison(plain: Sequence[SpeedCalibration], load: Load) -> Iterator[str]:
    """What the load changes on the same roads (Fig 6.7, 6.8)."""
    yield (f"The same roads without the load ({load.empty_kg:.4g} kg on the springs) and with it "
           f"({load.sprung_mass_kg:.4g} kg):")
    yield f"{'m/s':>6} {'IRI per rms without':>20}{'with':>9}{'r.m.s. with the load':>23}{'a_w with the load':>20}"
    for empty, full in zip(plain, load.speeds, strict=True):
        rms = full.accel_rms_per_root_gd.slope / empty.accel_rms_per_root_gd.slope - 1
        a_w = full.a_w_per_iri.slope / empty.a_w_per_iri.slope - 1
        yield (f"{empty.speed_mps:6.2f} {empty.iri_per_accel_rms.slope:20.3f}{full.iri_per_accel_rms.slope:9.3f}"
               f"{rms:+23.1%}{a_w:+20.1%}")
