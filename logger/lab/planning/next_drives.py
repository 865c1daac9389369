"""Drives that may come next: another speed over the known road, an obstacle on it, a second sensor.

All last equally long, so that what they add can be compared. A drive in which people would lift off their seats is
none. Obstacles are those that are at hand: a speed bump, a plank.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from logger.lab.planning.planned_drive import PlannedCar, PlannedDrive, SensorNoise, at_speed, repeat_run
from logger.profiles.track import Track
from logger.runs import Run, Signal
from logger.simulation.virtual_drive import Obstacle, with_obstacles
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.models import structure_of
from logger.vehicle.vehicle import Vehicle

MOST_S = 30.0
"""How long such a drive is at most."""
_LEAST_S = 5.0
_SPEEDS_MPS = (5.0, 8.0, 12.0, 18.0, 27.0)  # 18 to 97 km/h, each half as fast again
_OVER_OBSTACLES_MPS = (4.0, 8.0)
_BUMP = {"height_m": 0.08, "width_m": 3.6}
"""Watts's round hump is 3.7 m by 0.1 m (G. R. Watts, TRRL Laboratory Report 597, 1973)."""
_PLANK = {"height_m": 0.03, "length_m": 0.3}


@dataclass(frozen=True)
class Option:
    """A drive that may come next; ``speed_mps`` None: the same excitation repeated."""

    seconds: float
    speed_mps: float | None
    obstacle: Obstacle | None = None
    signal: Signal | None = None


@dataclass(frozen=True, eq=False)
class OptionDrive:
    """A drive with several options, each with the indices of its signals."""

    drive: PlannedDrive
    options: tuple[tuple[Option, tuple[int, ...]], ...]


def option_drives(there: PlannedCar, noise: SensorNoise, road: Track | None, known: Sequence[Run]
                  ) -> Iterator[OptionDrive]:
    """All next drives. Where no ``road`` is known only second sensors are tried, on a rig as it was driven.

    known    existing drives; sensors are tried on one like that of median speed
    """
    there_already = {(signal.measures, signal.of) for run in known for signal in run.signals}
    signals = [one for one in second_sensors(there.nominal) if (one.measures, one.of) not in there_already]
    usual = sorted(known, key=lambda run: float(run.speed_mps.mean()))[len(known) // 2]
    if road is None:
        drive = PlannedDrive(repeat_run(usual, signals, MOST_S), there, noise)
        yield _with_signals(drive, None, signals, drive.run.count / drive.run.rate_hz)
        return
    usual_mps = float(usual.speed_mps.mean())
    for speed in sorted({usual_mps, *(one for one in _SPEEDS_MPS if abs(one / usual_mps - 1) > 0.1)}):
        more = signals if speed == usual_mps else []
        if (drive_there := _possible(there, noise, road, speed, more)) is not None:
            yield _with_signals(drive_there, speed, more, _seconds(drive_there))
    for speed in _OVER_OBSTACLES_MPS:
        for kind, size in (("bump", _BUMP), ("plate", _PLANK)):
            middle_m = road.start_m + 0.5 * min(speed * MOST_S, road.end_m - road.start_m)
            obstacle = Obstacle(kind, {"start_m": middle_m, **size}, kind)
            cut = _cut(road, speed * MOST_S)
            if (over := _possible(there, noise, with_obstacles(cut, [obstacle]), speed, ())) is not None:
                yield OptionDrive(over, ((Option(_seconds(over), speed, obstacle), ()),))


def second_sensors(vehicle: Vehicle) -> list[Signal]:
    """Second sensors that a vehicle of this model may have."""
    sides = {1: ("front",), 2: ("front", "rear"), 4: ("front_left", "rear_left")}[len(structure_of(vehicle).wheels)]
    found = [Signal(f"wheel_{side}_mps2", "acceleration", f"{side}_wheel") for side in sides]
    found += [Signal(f"travel_{side}_m", "travel", f"{side}_suspension") for side in sides]
    if len(sides) > 1:
        found += [Signal("pitch_rate_rad_per_s", "pitch_rate"),
                  Signal("over_front_axle_mps2", "acceleration", ahead_m=vehicle.front.cg_distance_m)]
    return found


def _with_signals(drive: PlannedDrive, speed: float | None, signals: Sequence[Signal], seconds: float) -> OptionDrive:
    alone = (Option(seconds, speed), ())
    return OptionDrive(drive, (alone, *((Option(seconds, speed, signal=one), (index,))
                                        for index, one in enumerate(signals))))


def _possible(there: PlannedCar, noise: SensorNoise, road: Track, speed_mps: float,
              signals: Sequence[Signal]) -> PlannedDrive | None:
    """The drive, if the road is long enough and the body stays below one g; else None."""
    if (road.end_m - road.start_m) / speed_mps < _LEAST_S:
        return None
    drive = PlannedDrive(at_speed("next", road, there.nominal, speed_mps, signals, MOST_S), there, noise)
    return drive if drive.most_mps2 < STANDARD_GRAVITY_MPS2 else None


def _seconds(drive: PlannedDrive) -> float:
    return drive.run.count / drive.run.rate_hz


def _cut(road: Track, length_m: float) -> Track:
    """The beginning of a road: what is driven, and two samples more."""
    count = min(len(road.elevation_m), int(length_m / road.spacing_m) + 2)
    return Track(road.spacing_m, road.elevation_m[:count], road.start_m)
