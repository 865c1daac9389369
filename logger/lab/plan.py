"""A plan: which effects drives could detect and distinguish, and which next drive would add most.

Problem: a search that finds nothing may have had drives that show nothing, and one that names two effects that these
drives cannot distinguish has named none. Solution: the information of each drive on each effect is computed as a search
uses it; that of one more drive is added, and drives are ranked by how many more effects a search would name.

Planned drives: the record that a right model predicts, the noise that is expected, and which drives may come next.

Problem: a likelihood estimates its levels and the sizes of distance errors from residuals, and a planned drive has
none. Solution: its record is the prediction itself (an Asimov data set: G. Cowan et al., European Physical Journal C
71, 2011), its levels are those of the sensors' noise, and its distance error is a good recorder's.

Another speed over the known road, an obstacle on it or a second sensor may come next. All last equally long, so that
what they add can be compared. A drive in which people would lift off their seats is none. Obstacles are those that are
at hand: a speed bump, a plank.

Detectability and isolability of effects in some drives, by their information and by refits.

Problem: an effect with an expected significance of twenty standard deviations is not named if another one, at a
strength of its own, does the same; and what another one does depends on its shape (a frequency, a knee). Solution: each
effect is tried with its usual values and with some that a search begins at. All changes are whitened, and the car's
numbers and the records' errors are projected out (a Schur complement with their priors). What then remains of one
change after another one, at any strength, is fitted to it is the significance by which a search distinguishes the two.

Where effects are large, the gain over a refit of the car without one is computed. Problem: an effect of ten standard
deviations or more moves the car's numbers and the distances beyond first order: what first order leaves of a soft mount
or a slow sensor is half as much again as a fit leaves, and a likelihood whose levels are free gains less than the
square of the standard deviations where these lie in few bands. Solution: the record with the effect is taken for the
measurement (an Asimov data set: G. Cowan et al., European Physical Journal C 71, 2011), and the car without it is
fitted to that: Gauss-Newton steps with known derivatives (the chord method: J. M. Ortega and W. C. Rheinboldt,
Iterative Solution of Nonlinear Equations, 1970, section 7.1), each judged by a full prediction and by the likelihood of
a search; where it is not as linear as they say, derivatives are computed again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property, partial, reduce
from operator import add

import numpy as np

from logger.arrays import ROUNDING, Array, Indices
from logger.dsp.resample import GRID_RATE_HZ
from logger.lab.diagnosis import obstacles_of
from logger.lab.likelihood.distance_error import USUAL, ErrorSize
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import fit_model
from logger.lab.likelihood.noise_floor import sensor_noise_of
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.signals import JointBands, JointWhitener
from logger.lab.likelihood.whittle import Whitener
from logger.lab.selection.detectability import DETECTABLE_SIGMA, is_uninformative_at_usual
from logger.lab.selection.evidence import INDISTINGUISHABLE
from logger.printable import Notify, silent
from logger.profiles.excitation import Excitation
from logger.profiles.track import Track
from logger.runs import LEAST_S, SKIP_S, RecordFacts, Run, Signal
from logger.simulation.virtual_drive import (
    SEARCH_HZ,
    Obstacle,
    SimulatedRuns,
    at_one_speed,
    motion_along,
    with_obstacles,
)
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.effect import Chosen, Effect, chosen
from logger.vehicle.models import structure_of
from logger.vehicle.vehicle import Vehicle

RATE_HZ = float(GRID_RATE_HZ)
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
    empty = _empty(run.name, run.track, run.distance_m[:count], run.speed_mps[:count], signals, run.rate_hz, run.skip_s)
    return replace(empty, facts=replace(empty.facts, main=run.facts.main))


def _empty(name: str, track: Track | Excitation, distance_m: Array, speed_mps: Array, signals: Sequence[Signal],
           rate_hz: float = RATE_HZ, skip_s: float = SKIP_S) -> Run:
    return Run(name, rate_hz, np.zeros(len(distance_m)), distance_m, speed_mps, track, skip_s,
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
    if (road.end_m - road.start_m) / speed_mps < LEAST_S:
        return None
    drive = PlannedDrive(at_speed("next", road, there.nominal, speed_mps, signals, MOST_S), there, noise)
    return drive if np.abs(drive.run.measured_mps2).max() < STANDARD_GRAVITY_MPS2 else None


def _seconds(drive: PlannedDrive) -> float:
    return drive.run.count / drive.run.rate_hz


def _cut(road: Track, length_m: float) -> Track:
    """The beginning of a road: what is driven, and two samples more."""
    count = min(len(road.elevation_m), int(length_m / road.spacing_m) + 2)
    return Track(road.spacing_m, road.elevation_m[:count], road.start_m)


ISOLABLE_SIGMA = float(np.sqrt(INDISTINGUISHABLE))
"""Two effects are distinguishable where so many standard deviations of the one remain after the other is fitted: their
square is the difference of the two scores."""
_MOST_TRIALS = 4
"""Trials of an effect besides its usual values, spread over those that a search begins at: they distinguish another
shape of it from another effect; all of them would take three times as long."""


@dataclass(frozen=True, eq=False)
class EffectGrid:
    """Effects at the values that are tried: the columns of one effect in a row, its usual values first.

    first    index of each effect's first column (e,)
    """

    effects: tuple[Effect, ...]
    columns: tuple[Chosen, ...]
    first: Indices

    @staticmethod
    def of(effects: Sequence[Effect]) -> EffectGrid:
        """The grid of some effects."""
        each = [_values_of(one) for one in effects]
        columns = tuple(chosen(effect, values) for effect, some in zip(effects, each, strict=True) for values in some)
        return EffectGrid(tuple(effects), columns, np.cumsum([0, *map(len, each[:-1])]))

    def columns_of(self, index: int) -> range:
        """Columns of an effect."""
        ends = [*self.first[1:], len(self.columns)]
        return range(int(self.first[index]), int(ends[index]))


def _values_of(effect: Effect) -> list[dict[str, float]]:
    trials = [one for one in effect.trials() if one != effect.usual]
    places = np.unique(np.linspace(0, len(trials) - 1, min(len(trials), _MOST_TRIALS)).round().astype(int))
    return [effect.usual, *(trials[one] for one in places)]


@dataclass(frozen=True, eq=False)
class Outlook:
    """Detectability and isolability of effects in some drives, in standard deviations.

    detectability    expected significance of each effect (e,)
    pairwise         what remains of it after another one is fitted (e, e); its detectability on the diagonal
    """

    detectability: Array
    pairwise: Array

    def scaled_to(self, detectability: Array) -> Outlook:
        """The outlook with other detectabilities (e,); what remains of each is scaled in proportion."""
        share = detectability / np.maximum(self.detectability, ROUNDING)
        return Outlook(detectability, self.pairwise * share[:, None])

    @property
    def isolability(self) -> Array:
        """What remains of each effect after the one most like it is fitted (e,)."""
        return np.asarray(self.pairwise.min(axis=1))

    @property
    def nearest(self) -> Indices:
        """Index of the effect that is most like each (e,); its own, where none is."""
        return np.asarray(self.pairwise.argmin(axis=1))

    @property
    def chances(self) -> Array:
        """Probability that a search names each effect, were it the only one (e,): its significance is normal around the
        expected one with unit variance, and has to make it detectable and distinguishable from all others."""
        from scipy.special import ndtr

        return np.minimum(ndtr(self.detectability - DETECTABLE_SIGMA), ndtr(self.isolability - ISOLABLE_SIGMA))


def representatives(settings: EffectGrid, information: FisherInformation, precision: Array) -> Indices:
    """The column (e,) that represents each effect: its usual values or, where these say little, those of the largest
    expected significance.

    information    of some drives
    precision      (p,) of the prior of the car's numbers
    """
    marginal, costs = _marginal(information, precision)
    alone = np.sqrt(np.maximum((np.einsum("sii->si", marginal) + costs[:, None]).min(axis=0), 0.0))
    found = settings.first.copy()
    for index, effect in enumerate(settings.effects):
        if is_uninformative_at_usual(effect, float(alone[found[index]])):
            found[index] = max(settings.columns_of(index), key=lambda column: alone[column])
    return found


def outlook(settings: EffectGrid, information: FisherInformation, precision: Array, columns: Indices) -> Outlook:
    """Detectability and isolability by the information of drives; arguments as of ``representatives``, whose result is
    ``columns``."""
    marginal, costs = _marginal(information, precision)
    own = np.maximum(np.einsum("sii->si", marginal), 0.0)
    explained = marginal[:, columns] ** 2 / np.maximum(own, ROUNDING)[:, None]
    most = np.maximum.reduceat(explained, settings.first, axis=2)
    np.einsum("sii->si", most)[:] = 0.0
    pairwise = (own[:, columns, None] - most + costs[:, None, None]).min(axis=0)
    found = np.sqrt(np.maximum(pairwise, 0.0))
    return Outlook(np.diag(found).copy(), found)


def most_likely_sizes(information: FisherInformation, precision: Array, columns: Indices) -> tuple[Indices, Array]:
    """The most likely of ``SIZES`` of the distance errors with each effect (e,), and its cost (e,) [minus twice a
    log-likelihood]; arguments as of ``outlook``."""
    marginal, costs = _marginal(information, precision)
    which = (np.einsum("sii->si", marginal)[:, columns] + costs[:, None]).argmin(axis=0)
    return which, costs[which]


def _marginal(information: FisherInformation, precision: Array) -> tuple[Array, Array]:
    """Information on the effects' columns (s, m, m), the car's numbers integrated out, and the cost of distance errors
    of each size over that of the expected size (s,)."""
    count = len(precision)
    mixed = information.products[:, :count, count:]
    known = information.products[:, :count, :count] + np.diag(precision)
    found = information.products[:, count:, count:] - mixed.transpose(0, 2, 1) @ np.linalg.solve(known, mixed)
    costs = information.costs + [with_larger_errors(USUAL, size).cost for size in SIZES[: len(information.costs)]]
    return np.asarray(found), np.asarray(costs - costs[0])


_MOST_STEPS, _MOST_SLOPES = 6, 3
"""Steps with the same derivatives, and how often these are computed."""
_SMALL = 0.01
"""A step that gains a smaller share of the remaining objective is the last."""
_KEPT = 1.1
"""Derivatives hold where the objective is at most so many times what they predicted."""


@dataclass(frozen=True, eq=False)
class LinearisedDrives:
    """Linearised drives, of runs or planned ones.

    linear         with a normal prior of the car's numbers
    levels         of the noise, in each band (b,), per run
    predictions    by rough simulations of its state (n,), per run
    """

    linear: LinearModel
    levels: list[Array]
    predictions: list[Array]

    def relinearise(self, logs: Array, moved: Sequence[Array]) -> LinearisedDrives:
        """The drives linearised at other numbers of the car (p,) and record errors changed by these (k,), per run."""
        linear, posterior = self.linear, self.linear.posterior
        record = [k + more for k, more in zip(linear.state.record, moved, strict=True)]
        predictions = posterior.predict(linear.state.effects, logs, record, rough=True)
        state = replace(linear.state, logs=logs, record=record, predictions=predictions)
        fresh = LinearModel(posterior, state, posterior.number_slopes(state, posterior.prior.steps), linear.whiteners)
        return replace(self, linear=fresh)

    def with_size(self, factors: tuple[float, float, float]) -> LinearisedDrives:
        """The drives with distance errors so many times as large."""
        return replace(self, linear=self.linear.with_size(with_larger_errors(self.linear.size, factors)))


@dataclass(frozen=True, eq=False)
class _Refit:
    """The fitted car without the effect.

    logs         logarithms of its numbers (p,)
    moved        changes of the numbers of the records' errors (k,), per run of each of the drives
    residuals    (n,), likewise
    gain         of the effect over it
    """

    logs: Array
    moved: list[list[Array]]
    residuals: list[list[Array]]
    gain: float


def refitted_gain(there: Sequence[LinearisedDrives], changes: Sequence[Sequence[Array]], precision: Array) -> float:
    """Gain of an effect that changes the predictions by these (n,), per run of each of the drives, in minus twice the
    log-likelihood over the best fit of the car without it.

    precision    of the prior of the car's numbers (p,)
    """
    start, still = there[0].linear.state.logs, [[np.zeros_like(k) for k in one.linear.state.record] for one in there]
    unmoved = sum(_deviance(one, some, k) for one, some, k in zip(there, changes, still, strict=True))
    return min(unmoved, _moved_gain(there, changes, precision, _Refit(start, still, list(map(list, changes)), np.inf)))


def _moved_gain(there: Sequence[LinearisedDrives], changes: Sequence[Sequence[Array]], precision: Array,
                now: _Refit) -> float:
    """Gain over the best fit that Gauss-Newton steps come to: they minimise squares by the levels of the noise, and
    where a change is far above these a car that did not move may be more likely."""
    slopes = list(there)
    for _ in range(_MOST_SLOPES):
        found, hold = _fit_chord(there, slopes, changes, precision, now)
        if not found.gain < (1 - _SMALL) * now.gain:
            return min(found.gain, now.gain)
        now = found
        if hold:
            break
        slopes = [one.relinearise(now.logs, k) for one, k in zip(there, now.moved, strict=True)]
    return now.gain


def _fit_chord(there: Sequence[LinearisedDrives], slopes: Sequence[LinearisedDrives],
               changes: Sequence[Sequence[Array]], precision: Array, now: _Refit) -> tuple[_Refit, bool]:
    """The best of some steps with the same derivatives, and whether these hold."""
    models, start = [one.linear for one in slopes], there[0].linear.state.logs
    information = np.diag(precision) + sum(one.information() - np.diag(one.prior.precision) for one in models)
    best, predicted = now, np.inf
    for _ in range(_MOST_STEPS):
        squares, gradient = _squares(models, now, precision, start)
        step = np.asarray(np.linalg.solve(information, gradient), float)
        predicted = min(predicted, squares - float(gradient @ step))
        moved = [one.fit_record_errors_to(_after_step(some, one, step), k).record for one, some, k in zip(
            models, now.residuals, now.moved, strict=True)]
        logs = now.logs + step
        residuals = [_residuals(one, some, logs, k) for one, some, k in zip(there, changes, moved, strict=True)]
        now = _Refit(logs, moved, residuals, float(precision @ (logs - start) ** 2) + sum(
            _deviance(one, some, k) for one, some, k in zip(there, residuals, moved, strict=True)))
        if not now.gain < (1 - _SMALL) * best.gain:
            best = min(now, best, key=lambda one: one.gain)
            break
        best = now
    return best, _squares(models, best, precision, start)[0] < _KEPT * predicted


def _squares(models: Sequence[LinearModel], now: _Refit, precision: Array, start: Array) -> tuple[float, Array]:
    """Sum of squares of the residuals and of the prior, and half of its negative gradient (p,)."""
    squares, gradient = float(precision @ (now.logs - start) ** 2), -precision * (now.logs - start)
    for one, residuals, moved in zip(models, now.residuals, now.moved, strict=True):
        found = one.fit_record_errors_to(residuals, moved)
        squares += found.squares
        gradient = gradient + sum(white @ residual for white, residual in zip(one.white, found.residuals, strict=True))
    return squares, gradient


def _after_step(residuals: Sequence[Array], linear: LinearModel, step: Array) -> list[Array]:
    """Residuals after a step of the car's numbers, to first order."""
    assert linear.numbers is not None
    return [one - step @ numbers for one, numbers in zip(residuals, linear.numbers, strict=True)]


def _residuals(there: LinearisedDrives, changes: Sequence[Array], logs: Array, moved: Sequence[Array]) -> list[Array]:
    """Residuals (n,) of the car without the effect, with these numbers and changes of the record errors."""
    posterior, state = there.linear.posterior, there.linear.state
    record = [k + more for k, more in zip(state.record, moved, strict=True)]
    now = posterior.predict(state.effects, logs, record, rough=True)
    return [change + before - after for change, before, after in zip(changes, there.predictions, now, strict=True)]


def _deviance(there: LinearisedDrives, residuals: Sequence[Array], moved: Sequence[Array]) -> float:
    """Minus twice the log-likelihood over that of the noise alone, with free levels in each band, and the cost of the
    record errors' changes."""
    linear, found = there.linear, 0.0
    for bands, levels, residual, error, k in zip(linear.posterior.bands, there.levels, residuals,
                                                 linear.posterior.record_errors, moved, strict=True):
        found += float(bands.freedom @ np.log1p(bands.power(residual) / levels)) + float(
            k @ error.precision(linear.size) @ k)
    return found


_LINEAR_SIGMA = 3.0
"""Below this detectability a refit without the effect is linear."""
_LEAST_GAIN_SIGMA = 1.0
"""A smaller gain of isolability is within the noise of a search, which has unit variance."""


@dataclass(frozen=True, eq=False)
class LabNextDrive:
    """A next drive and its gains.

    gains         of isolability, by effect: first those that it makes likelier to be named, then the relatively largest
    more_named    how many more effects a search would name, were each the only one
    """

    option: DriveOption
    gains: Mapping[str, float]
    more_named: float


@dataclass(frozen=True, eq=False)
class LabPlan:
    """The effects that some drives could show, and next drives.

    drives       names and seconds of the runs and the planned drives
    noise        of the accelerometers, or of what else the runs measure first, in its ``unit``; ``measured``: whether
                 it is that of the runs
    names        of the effects (e,)
    effects      with the values that each is tried with (e,)
    now          what the drives could show of them
    obstacles    effects that cannot be present, and why
    next         drives that may come next, the largest gain first
    """

    drives: tuple[tuple[str, float], ...]
    noise: SensorNoise
    unit: str
    measured: bool
    names: tuple[str, ...]
    effects: tuple[Chosen, ...]
    now: Outlook
    obstacles: Mapping[str, str]
    next: tuple[LabNextDrive, ...]

    @property
    def groups(self) -> list[tuple[str, ...]]:
        """Effects that are detectable, and cannot be distinguished from each other."""
        detectable = self.now.detectability >= DETECTABLE_SIGMA
        confused = np.minimum(self.now.pairwise, self.now.pairwise.T) < ISOLABLE_SIGMA
        confused &= detectable & detectable[:, None]
        found: list[set[int]] = []
        for index in np.flatnonzero(detectable):
            near = {int(index), *map(int, np.flatnonzero(confused[index]))}
            joined = [one for one in found if one & near]
            found = [one for one in found if not one & near] + [near.union(*joined)]
        return [tuple(self.names[one] for one in sorted(some)) for some in found if len(some) > 1]


def plan(there: PlannedCar, runs: Posterior | None, planned: Sequence[Run], effects: Mapping[str, Effect],
         noise: SensorNoise | None, usual_noise: SensorNoise, road: Track | None,
         progress: Notify = silent) -> LabPlan:
    """Analyse what runs and planned drives could show of ``effects``.

    there          the car; its numbers are fitted to the runs first
    planned        drives to be, their records empty
    noise          of the sensor to be; None: that of the runs, or as ``usual_noise``
    road           over which the next drive may go; None: none is known

    ValueError where the vehicle lacks what an effect needs.
    """
    fitted, measured = None, noise is None and runs is not None
    if runs is not None:
        progress("refitting the model's parameters")
        fitted = fit_model(runs, runs.start(there.effects))
        there = replace(there, logs=fitted.state.logs)
        main = runs.runs.runs[0].facts.main
        further_mps2 = None if main.measures == "acceleration" else usual_noise.noise_mps2
        noise = noise or SensorNoise(sensor_noise_of(fitted.posterior, fitted.state).deviation_mps2, 0.0, further_mps2)
    noise = noise or usual_noise
    drives = [PlannedDrive(one, there, noise) for one in planned]
    posteriors = [*([fitted.posterior] if fitted is not None else []), *(one.posterior for one in drives)]
    obstacles = {name: why for one in posteriors for name, why in obstacles_of(one, effects, there.effects).items()}
    settings = EffectGrid.of([one for name, one in effects.items() if name not in obstacles])
    base = [run for one in posteriors for run in one.runs.runs]
    with ThreadPoolExecutor(2) as pool:  # as a search has
        analysis = _Analysis(settings, posteriors[0].prior.precision, pool)
        parts: list[_DriveSet] = []
        if fitted is not None:
            progress("what the runs show")
            parts.append(analysis.of_runs(fitted))
        for number, drive in enumerate(drives, 1):
            progress(f"what planned drive {number} of {len(drives)} would show")
            parts.append(analysis.of_drive(drive))
        total = reduce(add, (one.information for one in parts))
        columns = representatives(settings, total, analysis.precision)
        now = outlook(settings, total, analysis.precision, columns)
        progress("what a refit would leave of each effect")
        refitted = analysis.by_refit(parts, total, columns, now)
        following: list[LabNextDrive] = []
        for number, one in enumerate(option_drives(there, noise, road, base), 1):
            progress(f"what a next drive would add: {number} tried")
            changes = analysis.changes(one.drive)
            for option, signals in one.options:
                after = total + one.drive.information(changes, signals)
                following.append(_next(option, settings, now, outlook(settings, after, analysis.precision, columns)))
    return LabPlan(
        tuple((run.name, (run.count - run.first) / run.rate_hz) for run in base), noise,
        base[0].facts.main.unit, measured,
        tuple(one.name for one in settings.effects), tuple(settings.columns[one] for one in columns), refitted,
        obstacles,
        tuple(sorted(following, key=lambda one: (-round(one.more_named, 1), -len(one.gains)))))


@dataclass(frozen=True, eq=False)
class _DriveSet:
    """Some drives: their linear models, the changes by the effects (m, n) per run, and the information."""

    there: LinearisedDrives
    changes: list[Array]
    information: FisherInformation


@dataclass(frozen=True, eq=False)
class _Analysis:
    """The analysis of drives: effects at some values; ``precision`` (p,) of the prior of the car's numbers."""

    settings: EffectGrid
    precision: Array
    pool: ThreadPoolExecutor

    def changes(self, drive: PlannedDrive) -> Array:
        """Changes of a planned record by the effects (m, (1 + s) n)."""
        return np.array(list(self.pool.map(drive.change, self.settings.columns)))

    def of_drive(self, drive: PlannedDrive) -> _DriveSet:
        """A planned drive, recorded by its sensor alone."""
        linear, changes = drive.model(), self.changes(drive)
        levels = [np.concatenate(drive.levels(run, bands)) for run, bands in zip(
            linear.posterior.runs.runs, linear.posterior.bands, strict=True)]
        return _DriveSet(LinearisedDrives(linear, levels, linear.state.predictions), [changes],
                         information(linear, [changes]))

    def of_runs(self, fitted: LinearModel) -> _DriveSet:
        """Runs of a fitted model."""
        posterior, state = fitted.posterior, fitted.state
        predict = partial(posterior.predict, logs=state.logs, record=state.record, rough=True)
        here = predict(state.effects)
        there = self.pool.map(lambda one: predict((*state.effects, one)), self.settings.columns)
        changes = [np.array(some) for some in zip(*(
            [new - old for new, old in zip(one, here, strict=True)] for one in there), strict=True)]
        levels = [bands.levels(residual) for bands, residual in zip(
            posterior.bands, posterior.residuals(state), strict=True)]
        drives = LinearisedDrives(fitted, levels, here)
        return _DriveSet(drives, changes, information(fitted, changes))

    def by_refit(self, parts: Sequence[_DriveSet], total: FisherInformation, columns: Indices, now: Outlook) -> Outlook:
        """The outlook with detectabilities by a refit of the car without each effect."""
        which, costs = most_likely_sizes(total, self.precision, columns)
        with_size = {size: [one.there.with_size(SIZES[size]) for one in parts] for size in set(which.tolist())}

        def deviations(index: int) -> float:
            first_order = float(now.detectability[index])
            if first_order < _LINEAR_SIGMA:
                return first_order
            changes = [[one[columns[index]] for one in part.changes] for part in parts]
            gain = refitted_gain(with_size[int(which[index])], changes, self.precision) + costs[index]
            return float(np.sqrt(max(gain, 0.0)))

        return now.scaled_to(np.array(list(self.pool.map(deviations, range(len(columns))))))


def _next(option: DriveOption, settings: EffectGrid, now: Outlook, then: Outlook) -> LabNextDrive:
    """The gains of an option, by the outlooks without and with it."""
    gained, likelier = then.isolability - now.isolability, then.chances - now.chances
    order = np.lexsort((now.isolability / np.maximum(then.isolability, 1.0), -likelier.round(2)))
    gains = {settings.effects[one].name: float(gained[one]) for one in order if gained[one] > _LEAST_GAIN_SIGMA}
    return LabNextDrive(option, gains, float(likelier.sum()))
