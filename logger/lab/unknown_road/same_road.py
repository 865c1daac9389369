"""The marginal likelihood of drives over one road that nobody measured.

Problem: without a profile there is no prediction to compare a drive with; the road would explain whatever the model
does not. Solution: drives at different speeds are over the same road, and have to agree on it. The road, a Gaussian
process of free level and waviness, is integrated out (``unknown_road``); models are compared by the likelihood of all
drives together. The way is cut into stretches of some seconds, each with a level and a waviness of its own and with
places that may be a little off, as roads change and distance signals drift.

The likelihood itself is never computed, only its score is. The gain of one model over another is the integral of the
score along a straight line from the one response to the other, by Gauss's quadrature with a few points.

Effects with which a car is not linear are tried by the linear cars that come nearest (``vehicle.linearise``), one for
each drive over each stretch, as each moves it by another amplitude: what friction does is then no damping, but one that
falls from stretch to stretch as the motion grows. What a free road absorbs (a gain; a longer contact patch) is known
from the information that remains of an effect once the road is integrated out.

Fits of a model to drives over an unknown road, by Fisher scoring, and score tests of effects on top of one.

Drives over one road: a test whether they are, and the distance that all are laid on.

Problem: drives over two roads disagree whatever the car, and a search for what a model lacks then finds effects that
imitate the disagreement. The size of the residual cannot decide: a car that lacks something has a large one as well.
Solution: the record that one drive predicts is correlated with another drive's. Over one road they correlate, through a
wrong car as well, if less; over two roads only by chance, which is measured at lags far apart. Both are divided by the
spectrum and by the envelope of what was read, so that neither a resonance of the car nor a bump dominates. A car that
lacks much may correlate with nothing: before drives are rejected, the car is tried with each of the effects that it may
lack. Where one road would not be significant either, the pair is reported as doubtful.

A receiver's speeds put a drive on the road to a tenth of a metre within some seconds and to metres within a minute,
each drive differently. At the frequency of the wheels' bounce that is a wave of the road, and effects that damp it or
delay the record imitate the blur. So the record of each drive is compared, window by window, with what the others make
a model of the car expect there (``lab.likelihood.lag``), and its distances are moved by the lags, again and again until
these are small. A delay of the record moves with them: of such drives it cannot be distinguished from the receiver's.
"""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise, permutations

import numpy as np

from logger.arrays import Array, Complex
from logger.bounds import DISCREPANCY
from logger.dsp.resample import PASS_OF_RATE
from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM
from logger.fitting.fisher_scoring import inverse, maximise
from logger.identification.unknown_road.marginal_likelihood import (
    OFFSET,
    SHORTEST_CPM,
    WAVINESS,
    Options,
    Roads,
    RoadsScore,
    RoadState,
    UnknownRoad,
    displacement_psd_m3,
)
from logger.identification.unknown_road.road_operator import RoadDrive
from logger.lab.likelihood.lag import lags
from logger.lab.likelihood.map_fit import ends_of
from logger.lab.likelihood.noise_floor import NoiseLevel, sensor_noise
from logger.lab.likelihood.priors import Tolerance, VehiclePrior
from logger.lab.likelihood.whittle import UNEXPLAINED, Bands
from logger.lab.selection.holdout import HoldOut
from logger.lab.selection.screening import scale_strength
from logger.roads.iso8608 import STANDARD_WAVINESS
from logger.runs import Run, normalised_rms
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen, Effect, Scale
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.linearise import is_linear, known_car, linearised
from logger.vehicle.named_parameters import (
    Free,
    FreeParameter,
    coordinates_of,
    free_parameters_of,
    steps_of,
    with_coordinates,
)
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.structure import Output
from logger.vehicle.vehicle import Vehicle

_STEP_HZ = 0.025
"""Step of the table: eight are as wide as a resonance at 1 Hz with a damping ratio of 0.1."""


def frequencies_of(rate_hz: float) -> Array:
    """Frequencies (f,) of the table [Hz]."""
    return np.arange(0.0, rate_hz / 2 + _STEP_HZ, _STEP_HZ)


def response_of(car: Car, rate_hz: float) -> Complex:
    """Reading per elevation under each axle (x, f) at ``frequencies_of``, the recorder's filter included [1/s2].

    Left and right wheels are on the same road. ValueError for a car whose laws are not linear.
    """
    if not is_linear(car):
        raise ValueError("expected a linear car")
    linear = known_car(car)
    assert isinstance(linear, LinearCar)
    return _by_axle(linear, rate_hz)


def _by_axle(linear: LinearCar, rate_hz: float) -> Complex:
    f_hz, axles = frequencies_of(rate_hz), np.unique(linear.structure.behind_m, return_inverse=True)[1]
    by_axle = linear.by_wheel(f_hz) @ np.eye(axles.max() + 1)[axles]
    return np.asarray(recorder_gain(f_hz / rate_hz) * by_axle.T)


@dataclass(frozen=True)
class DriveConditions:
    """What moves a car over a stretch: its speed [m/s], and the level and the waviness of the road (``RoadState``)."""

    speed_mps: float
    level: float
    waviness: float


def responses_of(car: Car, rate_hz: float, motions: Sequence[DriveConditions]) -> Complex:
    """Readings as ``response_of`` for each of some motions (d, x, f): of the linear car that comes nearest to one that
    is not linear, the same for all of one that is. A suspension is moved by waves of the road from those below which
    its spectrum is flat to those as short as a tire's contact.

    ValueError for effects on the record in time, and for laws that are others at another place or time.
    """
    if is_linear(car):
        return np.broadcast_to(response_of(car, rate_hz), (len(motions), *_shape(car, rate_hz)))
    if car.records:
        raise ValueError("expected a car without effects on its record")
    known_car(car)  # refuses laws that no linear ones stand in for
    output = Output(car.row, np.zeros(len(car.structure.wheels)), 2)
    moving_cpm = np.geomspace(FLATTENED_BELOW_CPM, SHORTEST_CPM, 80)
    found = []
    for motion in motions:
        psd_m3 = displacement_psd_m3(motion.level, motion.waviness, np.append(0.0, moving_cpm))[1:]
        found.append(_by_axle(linearised(car, output, motion.speed_mps, moving_cpm, psd_m3), rate_hz))
    return np.asarray(found)


def _shape(car: Car, rate_hz: float) -> tuple[int, int]:
    return len(np.unique(car.structure.behind_m)), len(frequencies_of(rate_hz))


@dataclass(frozen=True, eq=False)
class Tabulated:
    """A table of a car's response, for any values of its parameters.

    behind_m, contact_patch_m    as its structure's, each axle once
    rate_hz                      of the recorder
    gains, slopes                responses (x, f) and derivatives (p, x, f) at ``frequencies_of``
    """

    behind_m: Array
    contact_patch_m: float
    rate_hz: float
    gains: Complex
    slopes: Complex

    @property
    def parameters(self) -> Sequence[Free]:
        """Parameters of the derivatives."""
        return [Free(f"number {index}", 0.0, -1.0, 1.0, place=True) for index in range(len(self.slopes))]

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Responses and derivatives interpolated at other frequencies."""
        place = np.minimum(f_hz / _STEP_HZ, self.gains.shape[-1] - 1.001)
        low = place.astype(np.intp)
        share = place - low
        gains, slopes = ((1 - share) * one[..., low] + share * one[..., low + 1] for one in (self.gains, self.slopes))
        return gains, slopes


PROBES = 8
"""Simulated drives by which the score's expectation is estimated; a gain is overestimated by one part in so many, and
is divided by that. A judgement: fits take a time in proportion."""


class NotOneRoad(ValueError):
    """The drives are not over one road."""


@dataclass(frozen=True, eq=False)
class RoadFitState:
    """A model with all its numbers.

    effects    with their values
    logs       logarithms of the car's numbers over the nominal ones (p,)
    roads      of every stretch its level, its waviness and the places of its drives but the first, in this order; the
               logarithm of the noise last (r,)
    gains      the car's response (d, x, f) in each drive over each stretch, in the order of ``SameRoad.motions``
    """

    effects: tuple[Chosen, ...]
    logs: Array
    roads: Array
    gains: Complex

    @property
    def noise_mps2(self) -> float:
        """Standard deviation of what no road explains."""
        return float(np.exp(self.roads[-1]))


class SameRoad:
    """Drives over one road, a nominal vehicle, and priors of its numbers and of the road.

    start_vehicle    the vehicle as it stands, where fits begin, if that is another than was given
    exact_places     whether distances are a recorder's; else they follow the road that was felt, and delays with them

    NotOneRoad unless each of the runs shares some seconds of the way with another.
    """

    def __init__(self, runs: Sequence[Run], vehicle: Vehicle, tolerance: Tolerance,
                 start_vehicle: Vehicle | None = None, exact_places: bool = True) -> None:
        start_vehicle = start_vehicle or vehicle
        self.tolerance, self.exact_places = tolerance, exact_places
        self.runs, self.rate_hz = list(runs), runs[0].rate_hz
        self.vehicle = replace(vehicle, contact_patch_m=start_vehicle.contact_patch_m)  # that is not free
        known = VehiclePrior.of(vehicle, tolerance)
        kept = [not name.endswith("contact_patch_m") for name in known.names]
        self.prior = VehiclePrior(tuple(np.array(known.names)[kept].tolist()), known.deviations[kept],
                                  known.steps[kept])
        self.start_vehicle = self.prior.logs(self.vehicle, start_vehicle)
        structure = compose(start_vehicle).structure
        self._behind_m = np.unique(structure.behind_m)
        self._patch_m = structure.contact_patch_m
        least_s = 3.0  # of a stretch, some periods of a body's bounce, to say anything of it
        self.stretches = _cut(self.runs, least_s)
        shared = {run for parts in self.stretches for run, _ in parts}
        if alone := [run.name for number, run in enumerate(self.runs) if number not in shared]:
            raise NotOneRoad(f"{' and '.join(alone)}: expected drives over the same road, found by the distances "
                             f"that no other drive shares {least_s:g} s with it")
        self.motions = [DriveConditions(float(np.median(np.gradient(one.distance_m)) * self.rate_hz), 0.0,
                                        STANDARD_WAVINESS)
                        for parts in self.stretches for _, one in parts]
        nominal = self.tables(self.response((), self.start_vehicle))
        self._roads = Roads(nominal[0], [[one for _, one in parts] for parts in self.stretches],
                            Options(free_waviness=True, probes=PROBES)).with_cars(nominal)
        self._first = self._start()
        self.motions = self._moved_by(self._first)

    def car(self, effects: Sequence[Chosen], logs: Array) -> Car:
        """The car with these numbers and effects."""
        return compose(self.prior.vehicle(self.vehicle, logs), effects)

    def response(self, effects: Sequence[Chosen], logs: Array) -> Complex:
        """The response (d, x, f) of the car with these numbers and effects, in each of the ``motions``. ValueError if
        no linear car stands in for it."""
        return responses_of(self.car(effects, logs), self.rate_hz, self.motions)

    def is_linear(self, effects: Sequence[Chosen], logs: Array) -> bool:
        """Whether the car with these numbers and effects answers in proportion to the road."""
        return is_linear(self.car(effects, logs))

    def tables(self, gains: Complex, slopes: Complex | None = None) -> list[Tabulated]:
        """Tables of a response (d, x, f) with derivatives (p, d, x, f), one for each drive over each stretch."""
        found = np.empty((0, *gains.shape), complex) if slopes is None else slopes
        return [Tabulated(self._behind_m, self._patch_m, self.rate_hz, gain, found[:, drive])
                for drive, gain in enumerate(gains)]

    def _moved_by(self, roads: Array) -> list[DriveConditions]:
        """What moves the car in each drive over each stretch, on roads of these numbers (r,)."""
        return [replace(self.motions[drive], level=at.level, waviness=at.waviness)
                for drive, at in enumerate(self._roads.state(road, np.zeros(0), roads)
                                           for road, parts in enumerate(self.stretches) for _ in parts)]

    def moved_as(self, state: RoadFitState) -> "SameRoad":
        """The problem, its car moved by the roads of a state, and not by those that spectra alone let expect."""
        other = copy(self)
        other.motions = self._moved_by(state.roads)
        return other

    def start(self, effects: Sequence[Chosen] = ()) -> RoadFitState:
        """The vehicle that fits begin at, with these effects, on roads of a likely level."""
        return RoadFitState(tuple(effects), self.start_vehicle, self._first, self.response(effects, self.start_vehicle))

    def score(self, tables: Sequence[Tabulated], roads: Array, information: bool,
              fisher_probes: int | None = None) -> RoadsScore:
        """Slopes of the log-likelihood (m,) by the parameters of tables' derivatives and by the numbers of the roads,
        and the information (m, m) or zeros, both without the priors.

        fisher_probes    simulated drives over each stretch that the information is a mean over
        """
        return self._roads.with_cars(tables).score(np.zeros(len(tables[0].slopes)), roads, information, fisher_probes)

    def preconditioned(self, state: RoadFitState) -> "SameRoad":
        """The problem with preconditioners for models near a state."""
        other = copy(self)
        other._roads = self._roads.with_cars(self.tables(state.gains)).prepared(np.zeros(0), state.roads)
        return other

    def _at(self, state: RoadFitState) -> Iterator[tuple[UnknownRoad, RoadState, list[int]]]:
        """Every stretch under the car of a state: its road, its numbers, and the runs of its drives."""
        return self._under(self._roads.with_cars(self.tables(state.gains)), state.roads)

    def _under(self, roads: Roads, numbers: Array) -> Iterator[tuple[UnknownRoad, RoadState, list[int]]]:
        for index, (road, parts) in enumerate(zip(roads.roads, self.stretches, strict=True)):
            yield road, roads.state(index, np.zeros(0), numbers), [run for run, _ in parts]

    def prior_terms(self, logs: Array, free_parameters: int, roads: Array) -> tuple[Array, Array]:
        """Deviations of a state's numbers from the means of their priors (m,), and the prior precisions (m,): of the
        car's, of so many free parameters of effects, which have none, and of the roads': of a stretch's waviness, and
        of its places from those of the whole way [m] (judgements)."""
        known = [(self._roads.are(what), off) for what, off in ((WAVINESS, 0.3), (OFFSET, 0.05))]
        off = sum(which * (roads - self._first) for which, _ in known)
        free = np.zeros(free_parameters)
        return np.concatenate([logs, free, off]), np.concatenate([
            self.prior.precision, free, sum(which * deviation**-2 for which, deviation in known)])

    def cost(self, state: RoadFitState) -> float:
        """Minus twice the log-density of the priors of a state's numbers, without its constant."""
        p = len(state.logs)
        off, precision = self.prior_terms(state.logs, 0, state.roads)
        return self.prior.cost(state.logs) + float(precision[p:] @ off[p:] ** 2)

    def gain(self, before: RoadFitState, after: RoadFitState, nodes: int = 3) -> float:
        """Decrease of minus twice the log-posterior from one state to another: the integral of the score between
        them, from so many points."""
        change, road_change = after.gains - before.gains, after.roads - before.roads
        total = 0.0
        places, weights = np.polynomial.legendre.leggauss(nodes)
        for node, weight in zip(0.5 * (places + 1), 0.5 * weights, strict=True):
            tables = self.tables(before.gains + node * change, change[None])
            slopes = self.score(tables, before.roads + node * road_change, information=False).slopes
            total += weight * float(slopes[0] + slopes[1:] @ road_change)
        return (2 * total + self.cost(before) - self.cost(after)) / (1 + 1 / PROBES)

    def predicted_by_others(self, state: RoadFitState) -> Iterator[tuple[int, Array, Array]]:
        """Every drive over every stretch: its run, what was read (n,), and its prediction by the other drives (n,)."""
        for road, at, runs in self._at(state):
            for number, run in enumerate(runs):
                yield run, road.measured[number], road.predicted(at, number)

    def predicted_by_each(self, state: RoadFitState) -> Iterator[tuple[int, int, Array, Array]]:
        """Every ordered pair of drives over a stretch: the run, the one that predicts it, what was read (n,), and its
        prediction by the latter alone (n,)."""
        for road, at, runs in self._at(state):
            for number, by in permutations(range(len(runs)), 2):
                yield runs[number], runs[by], road.measured[number], road.predicted(at, number, [by])

    def errors(self, state: RoadFitState) -> list[float]:
        """Leave-one-out error of every run, rms(read - predicted) / rms(read), the prediction being by the other
        drives; nan for one that no other shares a stretch with."""
        drives = list(self.predicted_by_others(state))
        return [_error([one for one in drives if one[0] == run]) for run in range(len(self.runs))]

    def error(self, state: RoadFitState) -> float:
        """Leave-one-out error of all runs together."""
        return _error(list(self.predicted_by_others(state)))

    @property
    def size_mps2(self) -> float:
        """R.m.s. of what was read, by which errors are divided [m/s2]."""
        squares = sum(float((one**2).sum()) for road in self._roads.roads for one in road.measured)
        return float(np.sqrt(squares / self.samples))

    @property
    def least_mps2(self) -> float:
        """The least residual of a model: the discrepancy of two right simulations of a car [m/s2]."""
        return DISCREPANCY * self.size_mps2

    @property
    def samples(self) -> int:
        """Number of samples of all drives."""
        return sum(len(drive.measured_mps2) for parts in self.stretches for _, drive in parts)

    def noise(self, state: RoadFitState) -> NoiseLevel:
        """The sensor's noise, from the leave-one-out residuals: these are more than noise where the road moves the car,
        so that bands of noise that the recorder filtered have to be equally loud."""
        residuals: dict[int, list[Array]] = {}
        for run, read, expected in self.predicted_by_others(state):
            residuals.setdefault(run, []).append(read - expected)
        runs = [_joined(self.runs[run], parts) for run, parts in residuals.items()]
        return sensor_noise([Bands(one) for one in runs], [one.measured_mps2 for one in runs],
                            self.least_mps2, fitted=False)

    def _start(self) -> Array:
        """First guess of the roads' numbers: levels and noise from spectra; places by ``_offsets``."""
        first = self._roads.first_guess(np.zeros(0), least_mps2=self.least_mps2)
        offsets = self._offsets(first)
        for road, parts in enumerate(self.stretches):
            own = [offsets[run] for run, _ in parts]
            first[self._roads.places(road)] = np.array(own[1:]) - own[0]
        return first

    def _offsets(self, first: Array) -> Array:
        """Offsets of each run's places [m] from those of the first run of the stretch that most runs share; of runs
        that are not over that one, by way of runs that share another stretch with both."""
        offsets: dict[int, float] = {}
        open_ones = list(self._under(self._roads, first))
        while open_ones := [one for one in open_ones if any(run not in offsets for run in one[-1])]:
            tied = [one for one in open_ones if any(run in offsets for run in one[-1])]
            road, at, runs = max(tied or open_ones, key=lambda one: len(one[-1]))
            offset = partial(road.offset, at)  # against the first run of the stretch
            if runs[0] not in offsets:
                known = next((number for number, run in enumerate(runs) if run in offsets), None)
                offsets[runs[0]] = 0.0 if known is None else offsets[runs[known]] - offset(known)
            for number, run in enumerate(runs):
                if run not in offsets:
                    offsets[run] = offsets[runs[0]] + offset(number)
        return np.array([offsets[run] for run in range(len(self.runs))])


def _error(drives: Sequence[tuple[int, Array, Array]]) -> float:
    return normalised_rms([read - expected for _, read, expected in drives], [read for _, read, _ in drives])


def _cut(runs: Sequence[Run], least_s: float) -> list[list[tuple[int, RoadDrive]]]:
    """Stretches of the way, of about 10 s, that at least two runs share, each for ``least_s`` or longer: the
    numbers of the runs of each, and their drives."""
    ways = [np.maximum.accumulate(run.distance_m) for run in runs]
    begins, ends = (sorted(way[place] for way, place in zip(ways, places, strict=True))
                    for places in ([run.first for run in runs], [-1] * len(runs)))
    low, high = begins[min(1, len(begins) - 1)], ends[max(0, len(ends) - 2)]
    if len(runs) < 2 or not high > low:
        return []
    pace = float(np.median([np.median(run.speed_mps) for run in runs]))
    edges = np.linspace(low, high, max(1, round((high - low) / max(pace, 1e-3) / 10.0)) + 1)
    found = []
    for start, end in pairwise(edges):
        parts = []
        for number, (run, way) in enumerate(zip(runs, ways, strict=True)):
            first, last = np.searchsorted(way, (start, end))
            first = max(int(first), run.first)
            if last - first >= least_s * run.rate_hz:
                part = slice(first, int(last))
                parts.append((number, RoadDrive(run.rate_hz, run.measured_mps2[part], run.distance_m[part])))
        if len(parts) > 1:
            found.append(parts)
    return found


def _joined(run: Run, parts: Sequence[Array]) -> Run:
    """Residuals of parts of a run, as a run."""
    residual = np.concatenate([np.zeros(run.first), *parts])
    return replace(run.part(slice(len(residual))), measured_mps2=residual)


@dataclass(frozen=True, eq=False)
class RoadModel:
    """A fitted model of drives over an unknown road, with the information on its numbers.

    free_parameters    of its effects
    data               information of the drives on the logs, the free parameters (on their scales) and the roads'
                       numbers (m, m), at the last step for which it was computed
    information        of drives and priors (m, m)
    problem            with a preconditioner for states near this one
    score              minus twice the log of its evidence over that of the first model of a search, as only differences
                       are known
    gain               by how much this is below the score of a model without the last effect
    """

    state: RoadFitState
    free_parameters: tuple[FreeParameter, ...]
    data: Array
    information: Array
    problem: SameRoad
    score: float = 0.0
    gain: float = 0.0

    @property
    def effects(self) -> tuple[Chosen, ...]:
        """With their values."""
        return self.state.effects

    @property
    def chosen(self) -> Chosen:
        """The last effect, with its values."""
        return self.effects[-1]

    @property
    def effect(self) -> Effect:
        """The last effect."""
        return self.chosen.effect

    @cached_property
    def hold_out(self) -> HoldOut:
        """Each drive as predicted by the others; of the likelihood only differences are known."""
        return HoldOut(self.problem.error(self.state), float("nan"))

    @cached_property
    def noise(self) -> NoiseLevel:
        """The sensor's noise by what this model leaves."""
        return self.problem.noise(self.state)

    @cached_property
    def explanation(self) -> float:
        """Decrease of minus twice the log-likelihood if what no road explains were just small enough to count as
        explained; at least 0."""
        over = self.state.noise_mps2 / ((1 + UNEXPLAINED) * self.noise.deviation_mps2)
        return max(0.0, 2 * PASS_OF_RATE * self.problem.samples * 2 * float(np.log(over)))


def fit(problem: SameRoad, state: RoadFitState, steps: int = 10, close: float = 0.3) -> RoadModel:
    """Fit the most probable state, by so many scoring steps from a state at most.

    close    standard errors from the end that are near enough
    """
    free_parameters = free_parameters_of(state.effects)
    p, q = len(state.logs), len(free_parameters)
    start = np.concatenate([state.logs, coordinates_of(state.effects, free_parameters), state.roads])
    low, high, longest = _limits(state.effects, free_parameters, len(start), p)
    low[-1] = np.log(problem.least_mps2)
    probes = 1 if len(problem.stretches) > 2 else None  # where there are many stretches, these are a mean as well
    rounds = 0

    def at(x: Array) -> tuple[Array, tuple[Chosen, ...], Array]:
        return x[:p], with_coordinates(state.effects, free_parameters, x[p : p + q]), x[p + q :]

    def score(x: Array, information: bool) -> RoadsScore:
        nonlocal problem, rounds
        logs, effects, roads = at(x)
        gains, slopes = response_and_slopes(problem, effects, free_parameters, logs)
        if rounds > 8:  # a new preconditioner takes about as long
            problem = problem.preconditioned(RoadFitState(effects, logs, roads, gains))
        found = problem.score(problem.tables(gains, slopes), roads, information, probes)
        rounds = found.rounds
        off, precision = problem.prior_terms(logs, q, roads)
        return replace(found, slopes=found.slopes - precision * off, information=found.information + np.diag(precision))

    found = maximise(score, start, low, high, longest, close=close, most_steps=steps)
    logs, effects, roads = at(found.x)
    fitted = RoadFitState(effects, logs, roads, problem.response(effects, logs))
    _, precision = problem.prior_terms(logs, q, roads)
    return RoadModel(fitted, tuple(free_parameters), found.information - np.diag(precision), found.information, problem)


def response_and_slopes(problem: SameRoad, effects: tuple[Chosen, ...], free_parameters: Sequence[FreeParameter],
                        logs: Array, step: float = 1e-3) -> tuple[Complex, Complex]:
    """A response (d, x, f) and its derivatives (p + q, d, x, f) by the logs and the free parameters, over steps of this
    share."""
    gains, p = problem.response(effects, logs), len(logs)
    here = np.concatenate([logs, coordinates_of(effects, free_parameters)])
    steps = np.concatenate([np.full(p, step), steps_of(effects, free_parameters, step, step)])
    slopes = [(problem.response(with_coordinates(effects, free_parameters, there[p:]), there[:p]) - gains) / one
              for there, one in zip(here + np.diag(steps), steps, strict=True)]
    return gains, np.array(slopes).reshape(len(slopes), *gains.shape)


def _limits(effects: Sequence[Chosen], free_parameters: Sequence[FreeParameter], count: int, first: int
            ) -> tuple[Array, Array, Array]:
    """Bounds and longest step of each number (count,); those of the free parameters begin at ``first``."""
    low, high, longest = np.full(count, -np.inf), np.full(count, np.inf), np.full(count, 0.5)
    for index, free in enumerate(free_parameters, first):
        parameter = effects[free.effect].effect.parameters[free.parameter]
        low[index], high[index] = ends_of(parameter)
        if parameter.scale is not Scale.LOG:
            longest[index] = max(parameter.usual_range(), 0.5 * abs(coordinates_of(effects, [free])[0]))
    return low, high, longest


@dataclass(frozen=True, eq=False)
class TrialOnRoad:
    """An effect at some values on top of a model.

    gain                 expected, in minus twice the log-likelihood
    best                 the effect at its best strength, which has this gain
    deviations           expected significance at its values, all free numbers fitted, in standard deviations
    share_beyond_road    share of its information (0 to 1) that roads and places do not absorb
    others               the same effect at other values, where fits may begin as well, the largest gain first
    """

    chosen: Chosen
    gain: float
    best: Chosen
    deviations: float
    share_beyond_road: float
    others: "tuple[TrialOnRoad, ...]" = ()

    @property
    def effect(self) -> Effect:
        """The effect."""
        return self.chosen.effect


def screen(base: RoadModel, ones: Sequence[Chosen]) -> list[TrialOnRoad]:
    """Score tests of effects on top of a fitted model, along the change that each makes in the response; the car's
    numbers and the roads' are projected out."""
    problem, state = base.problem, base.state
    gains, own = response_and_slopes(problem, state.effects, base.free_parameters, state.logs)
    changes = [problem.response((*state.effects, one), state.logs) - gains for one in ones]
    k, p = len(ones), len(own)
    tables = problem.tables(gains, np.array([*own, *changes]))
    scored = problem.score(tables, state.roads, information=True)
    slopes, information = scored.slopes, scored.information
    rest, road = np.r_[0:p, p + k : len(slopes)], np.arange(p + k, len(slopes))
    off, precision = problem.prior_terms(state.logs, len(base.free_parameters), state.roads)
    known = inverse(information[np.ix_(rest, rest)] + np.diag(precision))
    by_road = inverse(information[np.ix_(road, road)] + np.diag(precision[p:]))
    score = slopes[rest] - precision * off
    found = []
    for index, one in enumerate(ones, p):
        alone, mixed = information[index, index], information[index, rest]
        remaining = max(float(alone - mixed @ known @ mixed), 0.0)
        with_road = information[index, road]
        share = float(1 - with_road @ by_road @ with_road / alone) if alone > 0 else 0.0
        slope = float(slopes[index] - mixed @ known @ score)
        found.append(_trial(one, slope, remaining, alone, max(share, 0.0)))
    return found


def _trial(one: Chosen, slope: float, remaining: float, alone: float, share: float) -> TrialOnRoad:
    """The trial at its best strength by its score and its information, as far as a quadratic is to be believed.

    remaining, alone    its information with all free numbers projected out, and before; a share below 1e-4 is mostly
                        rounding
    """
    if not remaining > 1e-4 * alone:
        return TrialOnRoad(one, 0.0, one, 0.0, share)
    strength = float(np.clip(slope / remaining, 0.03, 3.0))
    scaled = scale_strength(one, strength)
    if scaled is None:
        strength, scaled = 1.0, one
    gain = (2 * strength * slope - strength**2 * remaining) / (1 + 1 / PROBES)
    return TrialOnRoad(one, gain, scaled, float(np.sqrt(remaining)), share)


AGREEMENT_SIGMA = 5.0
"""Standard deviations of chance from which on two drives are over one road: a p-value of 3e-7, and some hundred lags
and tens of cars are tried."""


@dataclass(frozen=True)
class RoadAgreement:
    """Correlation of one run with its prediction by another one, in standard deviations of chance.

    run, by    numbers of the runs: the one that is predicted, and the one that predicts it
    found      the correlation
    expected   with a right model
    """

    run: int
    by: int
    found: float
    expected: float

    @property
    def is_significant(self) -> bool:
        """Whether the correlation is more than chance."""
        return self.found > AGREEMENT_SIGMA


def road_agreements(problem: SameRoad, state: RoadFitState, lacking: Sequence[Chosen] = ()) -> list[RoadAgreement]:
    """Agreements of all pairs of runs that share some of the way, in either direction: by the car of a state and, where
    that would mean two roads, with each of the effects that it may lack; the largest of these."""
    found = _road_agreements(problem, state)
    for one in lacking:
        if certain_two_roads(found) is None:
            break
        effects = (*state.effects, one)
        other = _road_agreements(problem, replace(state, effects=effects, gains=problem.response(effects, state.logs)))
        found = [replace(old, found=max(old.found, new.found)) for old, new in zip(found, other, strict=True)]
    return found


def certain_two_roads(found: Sequence[RoadAgreement]) -> tuple[int, int] | None:
    """The two runs that are most certainly over two roads; None if no two are."""
    certain = {pair: most for pair, most in _disagreeing_pairs(found).items() if _is_certain(most)}
    return max(certain, key=lambda pair: certain[pair]) if certain else None


def possible_two_roads(found: Sequence[RoadAgreement]) -> list[tuple[int, int]]:
    """Pairs of runs that may be over one road or two."""
    return [pair for pair, most in _disagreeing_pairs(found).items() if not _is_certain(most)]


def _is_certain(expected: float) -> bool:
    """Whether one road would have shown: with twice what is significant, as drives that disagree show less than
    half."""
    return expected > 2 * AGREEMENT_SIGMA


def _disagreeing_pairs(found: Sequence[RoadAgreement]) -> dict[tuple[int, int], float]:
    """Pairs of runs of which neither predicts the other, with the agreement expected over one road."""
    ways: defaultdict[tuple[int, int], list[RoadAgreement]] = defaultdict(list)
    for one in found:
        ways[min(one.run, one.by), max(one.run, one.by)].append(one)
    return {pair: max(one.expected for one in both) for pair, both in ways.items()
            if not any(one.is_significant for one in both)}


def _road_agreements(problem: SameRoad, state: RoadFitState) -> list[RoadAgreement]:
    """Agreements by the car of a state."""
    parts: defaultdict[tuple[int, int], list[tuple[Array, Array]]] = defaultdict(list)
    for run, by, read, predicted in problem.predicted_by_each(state):
        parts[run, by].append((read, predicted))
    return [_road_agreement(run, by, pairs, problem.rate_hz) for (run, by), pairs in parts.items()]


def _road_agreement(run: int, by: int, pairs: Sequence[tuple[Array, Array]], rate_hz: float) -> RoadAgreement:
    """The agreement of what was read and predicted (n,) over each stretch: the largest correlation within 0.05 s, as
    places may be a little off, over the r.m.s. correlation beyond a second."""
    near = round(0.05 * rate_hz)
    correlation, chance, expected = np.zeros(2 * near + 1), 0.0, 0.0
    for read, predicted in pairs:
        ours, theirs = _spectrally_flat(read, predicted, rate_hz)
        size = float(np.linalg.norm(ours))
        share = min(1.0, float(np.linalg.norm(theirs)) / size) if size > 0 else 0.0
        ours, theirs = (_envelope_flat(one, rate_hz) for one in (ours, theirs))
        both = np.fft.irfft(np.fft.rfft(ours) * np.conj(np.fft.rfft(theirs)), len(ours))  # one for each shift
        far = min(round(rate_hz), len(both) // 4)
        chance += float((both[far:-far] ** 2).mean())
        correlation += both[np.arange(-near, near + 1)]
        expected += share * float(np.linalg.norm(ours) * np.linalg.norm(theirs))
    deviation = float(np.sqrt(chance))
    if not deviation > 0:  # nothing is predicted
        return RoadAgreement(run, by, 0.0, 0.0)
    return RoadAgreement(run, by, float(correlation.max()) / deviation, expected / deviation)


def _spectrally_flat(read: Array, predicted: Array, rate_hz: float) -> tuple[Array, Array]:
    """What was read and what was predicted (n,), tapered by a tenth at each end, both divided by the smoothed spectrum
    of what was read, at the frequencies that the recorder passes."""
    n = len(read)
    ends = np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.1 * n)
    taper = np.sin(0.5 * np.pi * np.minimum(ends, 1.0)) ** 2
    ours, theirs = (np.fft.rfft(taper * (one - one.mean())) for one in (read, predicted))
    f_hz = np.fft.rfftfreq(n, 1 / rate_hz)
    power = _smooth(np.abs(ours) ** 2, round(1.5 * n / rate_hz))
    used = (f_hz >= 0.5) & (f_hz <= PASS_OF_RATE * rate_hz) & (power > 0)
    gain = np.where(used, 1 / np.sqrt(np.where(used, power, 1.0)), 0.0)
    return np.fft.irfft(gain * ours, n), np.fft.irfft(gain * theirs, n)


def _envelope_flat(samples: Array, rate_hz: float) -> Array:
    """Samples (n,) over their envelope, the r.m.s. of half a second: two roads with a bump at about one place are
    two roads all the same."""
    envelope = np.sqrt(_smooth(samples**2, round(0.5 * rate_hz)))
    return np.asarray(samples / np.maximum(envelope, 1e-300))


def _smooth(power: Array, width: int) -> Array:
    """Moving average (n,) over so many samples."""
    width = max(1, width)
    around = np.pad(power, width, mode="reflect")
    return np.asarray(np.convolve(around, np.ones(width) / width, "same")[width:-width])


def placed_by_road(runs: Sequence[Run], vehicle: Vehicle, tolerance: Tolerance, present: Sequence[Chosen] = (),
                   start_vehicle: Vehicle | None = None, rounds: int = 8) -> list[Run]:
    """Runs with the distances at which the others agree with them, but for a constant of some metres, which is a number
    of the road (``RoadFitState.roads``). The first stays where it is; where windows do not correlate, so does the run.

    rounds    so many at most

    NotOneRoad, ValueError as ``SameRoad`` and its ``start``.
    """
    found = list(runs)
    for _ in range(rounds):
        problem = SameRoad(found, vehicle, tolerance, start_vehicle)
        offsets_m = _offsets(problem, present)
        found = [replace(run, distance_m=run.distance_m + off_m) for run, off_m in zip(found, offsets_m, strict=True)]
        # A fiftieth of the shortest wave that a car feels: no larger than the errors of lags.
        if np.sqrt(np.mean(np.concatenate(offsets_m[1:]) ** 2)) < 0.01:
            break
    return found


def _offsets(problem: SameRoad, present: Sequence[Chosen]) -> list[Array]:
    """By how much each run's distances (n,) are short [m], of the first nothing."""
    predictions = [np.zeros(run.count) for run in problem.runs]
    ways = [np.maximum.accumulate(run.distance_m) for run in problem.runs]
    drives = [drive for parts in problem.stretches for _, drive in parts]
    for drive, (number, _, expected) in zip(drives, problem.predicted_by_others(problem.start(present)), strict=True):
        first = int(np.searchsorted(ways[number], drive.distance_m[0]))
        predictions[number][first : first + len(expected)] = expected
    found = [np.zeros(problem.runs[0].count)]
    for run, prediction in list(zip(problem.runs, predictions, strict=True))[1:]:
        windows = lags([run], [prediction])
        found.append(np.interp(np.arange(run.count), windows.middle, -windows.lag_m) if len(windows.run)
                     else np.zeros(run.count))
    return found
