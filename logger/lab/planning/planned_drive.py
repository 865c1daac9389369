"""Planned drives: the record that a right model predicts, the noise that is expected, and which drives may come next.

Problem: a likelihood estimates its levels and the sizes of distance errors from residuals, and a planned drive has
none. Solution: its record is the prediction itself (an Asimov data set: G. Cowan et al., European Physical Journal C
71, 2011), its levels are those of the sensors' noise, and its distance error is a good recorder's.

Another speed over the known road, an obstacle on it or a second sensor may come next. All last equally long, so that
what they add can be compared. A drive in which people would lift off their seats is none. Obstacles are those that are
at hand: a speed bump, a plank.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.distance_error import USUAL, ErrorSize
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.signals import JointBands, JointWhitener
from logger.lab.likelihood.whittle import Whitener
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.runs import RecordFacts, Run, Signal
from logger.simulation.virtual_drive import (
    SEARCH_HZ,
    Obstacle,
    SimulatedRuns,
    at_one_speed,
    motion_along,
    with_obstacles,
)
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.effect import Chosen
from logger.vehicle.models import structure_of
from logger.vehicle.vehicle import Vehicle

RATE_HZ = 100.0
SIGNAL_NOISE = {"travel": 0.0005, "pitch_rate": 0.001, "roll_rate": 0.001}
"""R.m.s. noise of a second sensor that is no accelerometer: a string or rotary potentiometer of 0.25 m with a linearity
of 0.2 %; a MEMS gyroscope's 0.05 deg/s (InvenSense, MPU-6000 product specification, 6.1) [m, rad/s]."""

SIZES = ((1.0, 1.0, 1.0), (4.0, 1.0, 1.0), (16.0, 1.0, 1.0), (64.0, 1.0, 1.0), (1.0, 4.0, 1.0), (1.0, 16.0, 1.0),
         (1.0, 1.0, 6.0), (1.0, 1.0, 36.0))
"""Factors of the expected distance errors (start, walk, scale) that a fit may find most likely instead, up to those
that a delay of some hundredths of a second or a wheel radius that is wrong by a per cent is taken for."""


@dataclass(frozen=True)
class SensorNoise:
    """Noise of the accelerometers: r.m.s., and the step that they round to [m/s2]; 0: none. Where the first sensor is
    no accelerometer it is in its unit, and ``further_mps2`` is that of accelerometers that may be added."""

    noise_mps2: float
    step_mps2: float = 0.0
    further_mps2: float | None = None

    @property
    def variance(self) -> float:
        """Variance of a reading, rounding taken as noise [m2/s4]."""
        return self.noise_mps2**2 + self.step_mps2**2 / 12

    def variance_of(self, signal: Signal | None) -> float:
        """Variance of a reading of a signal, or of the sensor (None), in the square of its unit."""
        known = SIGNAL_NOISE.get(signal.measures, self.further_mps2) if signal is not None else None
        return self.variance if known is None else known**2


@dataclass(frozen=True)
class PlannedCar:
    """The car of planned drives.

    nominal, start_vehicle    as of ``Posterior``
    effects, logs             those it has, and (p,) logarithms of its numbers over the nominal ones
    """

    nominal: Vehicle
    start_vehicle: Vehicle
    tolerance: Tolerance
    effects: tuple[Chosen, ...]
    logs: Array


def at_speed(name: str, track: Track, vehicle: Vehicle, speed_mps: float, signals: Sequence[Signal] = (),
             most_s: float = np.inf) -> Run:
    """A drive along a track from its start, at one speed, with an empty record. ValueError where it is too short to be
    a run, or too long to be simulated."""
    behind_m = float(structure_of(vehicle).behind_m.max())
    times, speeds = at_one_speed(track, behind_m, speed_mps)
    motion = motion_along(np.minimum(times, most_s), speeds, track.start_m, RATE_HZ)
    return _empty(name, track, motion.distance_m, motion.speed_mps, signals)


def repeat_run(run: Run, signals: Sequence[Signal], most_s: float) -> Run:
    """The beginning of a run repeated, with other signals and an empty record."""
    count = min(run.count, int(most_s * run.rate_hz))
    empty = _empty(run.name, run.track, run.distance_m[:count], run.speed_mps[:count], signals)
    return replace(empty, rate_hz=run.rate_hz, facts=replace(empty.facts, main=run.facts.main))


def _empty(name: str, track: Track | Excitation, distance_m: Array, speed_mps: Array, signals: Sequence[Signal]) -> Run:
    return Run(name, RATE_HZ, np.zeros(len(distance_m)), distance_m, speed_mps, track,
               facts=RecordFacts(signals=tuple(signals)), more=np.zeros((len(signals), len(distance_m))))


class PlannedDrive:
    """A car on a planned drive.

    run    with the prediction as its record, with all its signals
    """

    def __init__(self, run: Run, there: PlannedCar, noise: SensorNoise) -> None:
        self._there, self._noise = there, noise
        empty = self._posterior_of(run)
        self._here = empty.predict(there.effects, there.logs, self._no_errors(empty), rough=True)[0]
        record = self._here.reshape(-1, run.count)
        self.run = replace(run, measured_mps2=record[0], more=record[1:])
        self.posterior = self._posterior_of(self.run)

    def _posterior_of(self, run: Run) -> Posterior:
        there = self._there
        return Posterior(SimulatedRuns([run], fine_hz=SEARCH_HZ), there.nominal, there.tolerance, there.start_vehicle)

    @staticmethod
    def _no_errors(posterior: Posterior) -> list[Array]:
        return [np.zeros(one.count) for one in posterior.record_errors]

    def _state_of(self, posterior: Posterior, prediction: Array) -> State:
        there = self._there
        return State(there.effects, there.logs, self._no_errors(posterior), USUAL, [prediction])

    @cached_property
    def numbers(self) -> Array:
        """Derivatives of the record by the car's numbers (p, (1 + s) n), as ``Posterior.number_slopes``."""
        state = self._state_of(self.posterior, self._here)
        return self.posterior.number_slopes(state, self.posterior.prior.steps)[0]

    def change(self, one: Chosen) -> Array:
        """Change of the record by an effect at its values ((1 + s) n,)."""
        there = self._there
        after = self.posterior.predict((*there.effects, one), there.logs, self._no_errors(self.posterior), rough=True)
        return after[0] - self._here

    def information(self, changes: Array, signals: Sequence[int]) -> FisherInformation:
        """Information on effects' changes (m, (1 + s) n) by the sensor and some of the signals alone."""
        return information(self.model(signals), [self._of_kept(changes, signals)])

    def model(self, signals: Sequence[int] = ()) -> LinearModel:
        """The posterior linearised at the prediction, with the sensor and some of the signals."""
        run = self.run
        chosen_signals = tuple(run.signals[one] for one in signals)
        fewer = replace(run, facts=replace(run.facts, signals=chosen_signals), more=run.more[list(signals)])
        posterior = self._posterior_of(fewer)
        expected = [JointWhitener([Whitener(one, levels) for one, levels in zip(
            bands.each, self.levels(fewer, bands), strict=True)]) for bands in posterior.bands]
        state = self._state_of(posterior, self._of_kept(self._here, signals))
        return LinearModel(posterior, state, [self._of_kept(self.numbers, signals)], expected)

    def levels(self, run: Run, bands: JointBands) -> list[Array]:
        """Expected noise levels in each band (b,), of the sensor and of each signal of a run."""
        return [np.maximum(self._noise.variance_of(signal), one.floor)
                for one, signal in zip(bands.each, (None, *run.signals), strict=True)]

    def _of_kept(self, columns: Array, signals: Sequence[int]) -> Array:
        kept = [0, *(1 + one for one in signals)]
        parts = columns.reshape(*columns.shape[:-1], -1, self.run.count)[..., kept, :]
        return np.asarray(parts.reshape(*columns.shape[:-1], -1))


@dataclass(frozen=True, eq=False)
class FisherInformation:
    """Information of drives, which is additive: products of whitened derivatives by the car's numbers and of effects'
    changes, the records' errors projected out, without the prior of the numbers, for each of ``SIZES`` of these errors:
    an effect that shifts runs is taken for larger errors, if these are likely enough.

    products    (s, p + m, p + m)
    costs       of errors of each size, in minus twice the log of the evidence, without the prior of the size (s,)
    """

    products: Array
    costs: Array

    def __add__(self, other: FisherInformation) -> FisherInformation:
        return FisherInformation(self.products + other.products, self.costs + other.costs)


def information(linear: LinearModel, changes: Sequence[Array]) -> FisherInformation:
    """Information of the runs of a linear model on effects' changes (m, n) per run."""
    white = linear.whitened(changes)
    each, costs = [], []
    for size in SIZES:
        there = linear.with_size(with_larger_errors(linear.size, size))
        found = there.information(white)
        found[: linear.count, : linear.count] -= np.diag(linear.prior.precision)
        each.append(found)
        costs.append(there.occam_factor)
    return FisherInformation(np.array(each), np.array(costs))


def with_larger_errors(size: ErrorSize, factors: tuple[float, float, float]) -> ErrorSize:
    """A size with start, walk and scale error times these factors."""
    return ErrorSize(size.start_m * factors[0], size.walk_m * factors[1], size.scale * factors[2])


MOST_S = 30.0
"""How long such a drive is at most."""
_LEAST_S = 5.0
_SPEEDS_MPS = (5.0, 8.0, 12.0, 18.0, 27.0)  # 18 to 97 km/h, each half as fast again
_OVER_OBSTACLES_MPS = (4.0, 8.0)
_BUMP = {"height_m": 0.08, "width_m": 3.6}
"""Watts's round hump is 3.7 m by 0.1 m (G. R. Watts, TRRL Laboratory Report 597, 1973)."""
_PLANK = {"height_m": 0.03, "length_m": 0.3}


@dataclass(frozen=True)
class DriveOption:
    """A drive that may come next; ``speed_mps`` None: the same excitation repeated."""

    seconds: float
    speed_mps: float | None
    obstacle: Obstacle | None = None
    signal: Signal | None = None


@dataclass(frozen=True, eq=False)
class OptionDrive:
    """A drive with several options, each with the indices of its signals."""

    drive: PlannedDrive
    options: tuple[tuple[DriveOption, tuple[int, ...]], ...]


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
                yield OptionDrive(over, ((DriveOption(_seconds(over), speed, obstacle), ()),))


def second_sensors(vehicle: Vehicle) -> list[Signal]:
    """Second sensors that a vehicle of this model may have."""
    structure = structure_of(vehicle)
    if structure.held:
        return []  # its bench moves it: the force is all that there is to measure
    sides = {1: ("front",), 2: ("front", "rear"), 4: ("front_left", "rear_left")}[len(structure.wheels)]
    found = [Signal(f"wheel_{side}_mps2", "acceleration", f"{side}_wheel") for side in sides if not structure.on_base]
    found += [Signal(f"travel_{side}_m", "travel", f"{side}_suspension") for side in sides]
    if len(sides) > 1:
        found += [Signal("pitch_rate_rad_per_s", "pitch_rate"),
                  Signal("over_front_axle_mps2", "acceleration", ahead_m=vehicle.front.cg_distance_m)]
    return found


def _with_signals(drive: PlannedDrive, speed: float | None, signals: Sequence[Signal], seconds: float) -> OptionDrive:
    alone = (DriveOption(seconds, speed), ())
    return OptionDrive(drive, (alone, *((DriveOption(seconds, speed, signal=one), (index,))
                                        for index, one in enumerate(signals))))


def _possible(there: PlannedCar, noise: SensorNoise, road: Track, speed_mps: float,
              signals: Sequence[Signal]) -> PlannedDrive | None:
    """The drive, if the road is long enough and the body stays below one g; else None."""
    if (road.end_m - road.start_m) / speed_mps < _LEAST_S:
        return None
    drive = PlannedDrive(at_speed("next", road, there.nominal, speed_mps, signals, MOST_S), there, noise)
    return drive if np.abs(drive.run.measured_mps2).max() < STANDARD_GRAVITY_MPS2 else None


def _seconds(drive: PlannedDrive) -> float:
    return drive.run.count / drive.run.rate_hz


def _cut(road: Track, length_m: float) -> Track:
    """The beginning of a road: what is driven, and two samples more."""
    count = min(len(road.elevation_m), int(length_m / road.spacing_m) + 2)
    return Track(road.spacing_m, road.elevation_m[:count], road.start_m)
