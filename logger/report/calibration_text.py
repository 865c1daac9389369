"""A vehicle's relations between roughness and vibration, for a person and for a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from logger.comfort.iso2631 import COMFORT_WORDS
from logger.estimation.rms_calibration import LEVELS_IRI, CalibrationSettings, RmsLine, SpeedCalibration
from logger.units import MPH_MPS
from logger.vehicle.vehicle import Vehicle

_COMFORT_WORD = "uncomfortable"
# Lines by what their figures are called in JSON and CSV, after the slope under its own name.
_PREFIXES = {"iri_per_accel_rms": "", "window_iri_per_accel_rms": "window_", "accel_rms_per_root_gd": "accel_rms_",
             "a_w_per_iri": "a_w_"}


@dataclass(frozen=True)
class Load:
    """A car with a load, and its lines."""

    passengers: int
    sprung_mass_factor: float
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
        result |= {"passengers": load.passengers, "sprung_mass_factor": load.sprung_mass_factor,
                   "speeds_without_load": [row(speed) for speed in found.plain]}
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
