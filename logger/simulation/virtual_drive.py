"""The state in which a run begins that nobody recorded: of what was let go, of a rig that was driven before and rings
for longer than what is left out of its run, and of a part with a memory.

Problem: what is pulled and let go, or was struck or shaken before its record begins, is in a state that nobody wrote
down, and so is a part with a memory, which came to its first sample from above or from below; every number of the car
that is tried has its own best one. Solution: the state has a normal prior as wide as the record is large, and is
eliminated wherever the run is predicted (variable projection: G. Golub and V. Pereyra, SIAM J. Numer. Anal. 10, 1973).
The records of a linear car are linear in it, so that least squares find it; from there Gauss-Newton steps lead to that
of a car whose laws are bent. What each step shows corrects the derivatives for the next (C. G. Broyden, Math. Comp. 19,
1965), and those of a car that hardly differs serve as well: a simulation a step, and not one more for each number of
the state.

What a recorder would see: a car driven over a road, or stood on a rig, with its effects.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from logger.arrays import ROUNDING, Array
from logger.bounds import DISCREPANCY, EVEN_SAMPLES, QUIETEST_MPS2
from logger.profiles.excitation import Excitation
from logger.profiles.track import MOST_STEPS, Track, WheelTracks
from logger.roads.obstacles import OBSTACLES
from logger.runs import ACCELERATION, READING, SENSOR, Past, Run, Signal, zero_is_known
from logger.vehicle.compose import MOST_MPS2, Car, Response, bounded, fine_outputs, recorded, respond, stepper_of
from logger.vehicle.linear_slopes import STEP, Read, is_steady, recorded_slopes
from logger.vehicle.models import structure_of
from logger.vehicle.modes import modes, undamped_frequencies_hz, vibrating
from logger.vehicle.simulate import FINE_RATE_HZ, Passage
from logger.vehicle.structure import Output, body_point, corner_of, suspension_travel, wheel
from logger.vehicle.vehicle import Vehicle

Recorded = Callable[[Car, Passage, Run], Array]
"""What a run's signals, joined ((1 + s) n,), would read of a car on a passage."""

_STATE_STEP, _MOST_STATE_STEPS = 1e-4, 12
_SMALL_GAIN = 0.1  # of minus twice the log-likelihood: what promises less is the last step, a third of a standard error
_SMALL_STATE = 1e-6
_PRIOR_ROUNDS = 3
_WIDE = 10.0
"""The prior of a motion is as wide as what would make signals so many times as large as they ever are: those of two
numbers of the state may cancel for a while (a judgement)."""


@dataclass(frozen=True, eq=False)
class Beginning:
    """A state (2 n + k,) in which a run begins, as ``Passage.begins``, and how what its signals record in so many
    samples (``count``), by their sizes and joined (m,), changes with it (m, 2 n + k); the ``usual`` size of each number
    of the state, 0 of those that are known; and of a car whose laws are bent what they ``recorded`` (m,)."""

    state: Array
    columns: Array
    usual: Array
    count: int
    recorded: Array | None = None


def begins_unknown(car: Car, run: Run) -> bool:
    """Whether the initial state of a run matters: of what nothing drives, of a rig whose record begins in a motion with
    a longer time constant than what is left out of it (nothing is of one that is known to rest), or of a part with a
    memory."""
    if run.past is Past.DRIVEN:
        return run.skip_s > 0 and run.begins_in_motion and car.structure.slowest_decay_per_s * run.skip_s < 1
    return run.past is Past.FREE or car.memories > 0


def beginning(car: Car, passage: Passage, run: Run, recorded: Recorded, near: Beginning | None = None,
              is_bent: bool = True) -> Beginning:
    """The state with which the car's records come nearest to what the run measured; the search for it begins at that of
    a car that hardly differs (``near``), where there is one. Not ``is_bent``: that of the car without its laws.

    Each signal counts by its own size, and its zero is free. Each number of the state has a normal prior about rest:
    that of a motion by what the signals ever were (``_WIDE``), that of a memory is one unit of its law, which for
    friction is that it slides.
    """
    count = 2 * len(car.structure.mass) + car.memories
    lasts = _shown_in(car, passage, run, count) if near is None else near.count
    if lasts < run.count:
        run, passage = run.part(slice(lasts)), passage.cut(lasts)
    weighed = _WeighedRecord(run, recorded)
    passage.under_wheels(passage.driven(car.structure))  # asked for once, for all states
    # What hangs on a car has a state as soon as it weighs something.
    # One cycle is another number of samples of another road.
    alike = near is not None and near.columns.shape == (weighed.size, count)
    if near is not None and alike and car.bends_laws and len(weighed.measured):
        return _bent_beginning(car, passage, weighed, near, is_near=True)
    plain = _linear_beginning(car, passage, weighed, count)
    if not is_bent or not car.bends_laws or not len(weighed.measured):
        return plain
    return _bent_beginning(car, passage, weighed, plain, is_near=False)


def _linear_beginning(car: Car, passage: Passage, weighed: _WeighedRecord, count: int) -> Beginning:
    """The beginning (``count``) of the car without its laws, whose record is linear in it."""
    wanted, plain, moves = weighed.measured, car.linear, 2 * len(car.structure.mass)
    columns, state, usual = np.zeros((weighed.size, count)), np.zeros(count), np.ones(count)
    samples = weighed.run.count
    if car.structure.held or not len(wanted):
        usual[:moves] = 0.0  # the bench moves it
        return Beginning(state, columns, usual, samples)
    still = weighed.whole(plain, passage)
    # Small, as records are clipped at what no sensor reads: 1 m is that of what is let go at 160 Hz.
    small = [weighed.whole(plain, passage.begun_with(one)) - still for one in _SMALL_STATE * np.eye(moves)]
    columns[:, :moves] = np.stack(small, axis=1) / _SMALL_STATE
    seen = np.abs(columns[:, :moves]).max(axis=0)
    usual[:moves] = np.divide(_WIDE * weighed.largest, seen, out=np.zeros_like(seen), where=seen > 0)
    left, counted = wanted - weighed.counted(still), weighed.counted(columns)
    for _ in range(_PRIOR_ROUNDS):  # the prior weighs as much as the noise that is left allows
        state = state + _towards(counted, left - counted @ state, usual, state)
    return Beginning(state, columns, usual, samples)


def _bent_beginning(car: Car, passage: Passage, weighed: _WeighedRecord, start: Beginning, is_near: bool) -> Beginning:
    """The beginning with a car whose laws are bent, by steps whose first derivatives are those of one that ``is_near``.
    The last step is not simulated: what is small of it to second order is less than it may gain."""
    state, columns, usual, own = start.state, start.columns.copy(), start.usual, is_near
    per_usual = np.divide(1.0, usual, out=np.zeros_like(usual), where=usual > 0)
    here = weighed.whole(car, passage.begun_with(state))
    for _ in range(_MOST_STATE_STEPS):
        if fresh := not own:
            for index, one in enumerate(_STATE_STEP * usual):
                if one > 0:
                    beside = passage.begun_with(state + one * (np.arange(len(usual)) == index))
                    columns[:, index] = (weighed.whole(car, beside) - here) / one
            own = True
        way = _towards(weighed.counted(columns), weighed.measured - weighed.counted(here), usual, state)
        least, gained, ahead = weighed.misfit(here, state * per_usual), 0.0, here + columns @ way
        if weighed.misfit(ahead, (state + way) * per_usual) > least - _SMALL_GAIN:
            return replace(start, state=state + way, columns=columns, recorded=weighed.in_units(ahead))
        for share in (1.0, 0.5, 0.25, 0.1, 0.02) if fresh else (1.0,):
            step = share * way
            there = weighed.whole(car, passage.begun_with(state + step))
            gained = least - weighed.misfit(there, (state + step) * per_usual)
            if gained > 0:
                break
        if gained > 0:
            usually = step * per_usual**2
            columns += np.outer(there - here - columns @ step, usually / (usually @ step))
            state, here = state + step, there
        if (fresh or is_near) and gained < _SMALL_GAIN:
            break
        own = gained > 0
    return replace(start, state=state, columns=columns, recorded=weighed.in_units(here))


def _shown_in(car: Car, passage: Passage, run: Run, numbers: int) -> int:
    """How many samples of a run tell how it began, by so many numbers of a state. A part has forgotten that when it has
    moved through its stroke and back. The squares of what a car that was driven still shows of it fade with twice its
    slowest decay: the rest, of one cut in halves, would gain less than what the last step may."""
    if car.structure.held:
        places = passage.under_wheels(car.structure)[0][: run.count * passage.steps, 0]
        gone = np.searchsorted(np.cumsum(np.abs(np.diff(places))), 2 * np.ptp(places)) // passage.steps
        return min(run.count, max(int(gone), 2 * run.first) + 2)
    if run.past is not Past.DRIVEN or run.facts.pass_band_hz is not None:
        return run.count
    lasts_s = run.skip_s + np.log(numbers / _SMALL_GAIN) / (2 * max(car.structure.slowest_decay_per_s, ROUNDING))
    halves = int(max(np.log2(run.count / (lasts_s * run.rate_hz)), 0.0))
    return int(np.ceil(run.count / 2**halves))


def _towards(columns: Array, left: Array, usual: Array, state: Array) -> Array:
    """The change of a state (c,) of these ``usual`` sizes that makes up for what is ``left`` (m,), by its ``columns``
    (m, c), under its prior."""
    spread = np.sqrt(np.mean(left**2)) or 1.0
    here = np.divide(state, usual, out=np.zeros_like(state), where=usual > 0)
    rows = np.vstack([columns * usual, spread * np.eye(len(state))])
    return np.asarray(usual * np.linalg.lstsq(rows, np.concatenate([left, -spread * here]))[0])


class _WeighedRecord:
    """What a run's signals read, joined (m,): each without its mean, by its own size."""

    def __init__(self, run: Run, recorded: Recorded) -> None:
        self.run, self._recorded = run, recorded
        read = run.read if run.usable is None else run.usable == READING
        self._counted = read & (np.arange(run.count) >= run.first)
        measured = np.stack([run.measured_mps2, *run.more])
        counted = measured[:, self._counted]
        self._sizes = counted.std(axis=1, keepdims=True) if self._counted.any() else np.ones((len(measured), 1))
        self._sizes[self._sizes == 0] = 1.0
        whole = measured[:, read] / self._sizes
        self.largest = float(np.abs(whole - whole.mean(axis=1, keepdims=True)).max(initial=0.0))
        self.size = measured.size
        self.measured = self.counted((measured / self._sizes).ravel())

    def whole(self, car: Car, begun: Passage) -> Array:
        """What a car would have read in their place: all samples, with their means."""
        joined = self.run.in_band(self._recorded(car, begun, self.run))
        return np.asarray(joined.reshape(-1, self.run.count) / self._sizes).ravel()

    def in_units(self, whole: Array) -> Array:
        """Whole signals in the units of the record."""
        return np.asarray(whole.reshape(-1, self.run.count) * self._sizes).ravel()

    def counted(self, whole: Array) -> Array:
        """What counts of whole signals (m,), or of columns of these (m, c), without their means."""
        samples = whole.reshape(-1, self.run.count, *whole.shape[1:])[:, self._counted]
        samples = samples - samples.mean(axis=1, keepdims=True) if samples.size else samples
        return np.asarray(samples.reshape(-1, *whole.shape[1:]))

    def misfit(self, whole: Array, numbers: Array) -> float:
        """Minus twice the log-likelihood of whole signals (m,) that were predicted, with noise of any level, and of the
        numbers (c,) of a state over their usual sizes."""
        squares = np.sum((self.measured - self.counted(whole)) ** 2) + np.finfo(float).tiny
        return len(self.measured) * float(np.log(squares)) + float(numbers @ numbers)


_MOST_TRIES = 200
_RATES = {"pitch_rate": 1, "roll_rate": 2}
"""Columns of ``Structure.body``."""
_ORDERS = {"force": 0, "displacement": 0, "travel": 0, "velocity": 1, "acceleration": 2}


def observed(car: Car, passage: Passage, outputs: Sequence[Output]) -> Array:
    """Outputs (N, p) of a car on a passage, behind the recorder's filter and nothing else: the sensor's effects are not
    in them. Heights count from where the front left wheel begins."""
    return np.stack([passage.recorded(column, np.ones_like) for column in fine_outputs(car, passage, outputs)], axis=1)


def recorded_signals(car: Car, passage: Passage, signals: tuple[Signal, ...], main: Signal = ACCELERATION,
                     has_zero: bool = True) -> Array:
    """What the recorder keeps of the sensor's acceleration, or what else is its main signal, and of other signals,
    these and what has no known zero (``has_zero``) without their means, one after the other ((1 + s) N,).

    Problem: a wheel's accelerometer, a travel sensor, a gyroscope each show something else of the same motion, and a
    fit asks for all of them hundreds of times. Solution: a car is moved once, all signals are read off that motion, and
    the transforms of them are kept as those of the sensor alone are: sensors are tried on them without moving the car
    again.

    ValueError for a signal that this car does not have.
    """
    if not signals and main.name == SENSOR and has_zero:
        return recorded(car, passage)
    outputs = _outputs_of(car, main, signals)
    found = passage.recorded_of((car.body, main, signals), lambda: fine_outputs(car, passage, outputs), car.factor)
    found[0] = car.written(passage, found[0])
    begins = int(has_zero)
    found[begins:] -= found[begins:].mean(axis=1, keepdims=True)
    return found.ravel()


def _outputs_of(car: Car, main: Signal, signals: tuple[Signal, ...]) -> list[Output]:
    first = output_of(car, main) if main.name != SENSOR or car.structure.held else car.output
    return [first, *(output_of(car, one) for one in signals)]


def output_of(car: Car, signal: Signal) -> Output:
    """The motion that a signal measures. ValueError for one that this car does not have."""
    structure, part = car.structure, signal.of.rpartition("_")[2]
    if structure.held != (signal.measures == "force"):
        raise ValueError(f"signal {signal.name}: expected {'its force' if structure.held else 'a motion'} to be "
                         f"measured of a {car.vehicle.model.replace('_', ' ')}")
    try:
        if part in ("wheel", "suspension"):
            of = suspension_travel if part == "suspension" else wheel
            return of(structure, corner_of(structure, signal.of), _ORDERS[signal.measures])
        if signal.measures in _RATES:
            column = structure.body[:, _RATES[signal.measures]]
            if not column.any():
                raise ValueError(f"this body has no {signal.measures.replace('_', ' ')}")
            return Output(column, np.zeros(len(structure.wheels)), 1)
        ahead_m = signal.ahead_m - car.shift_m if signal.ahead_m or car.shift_m else 0.0
        return body_point(structure, ahead_m, signal.left_m, _ORDERS[signal.measures])
    except KeyError:
        raise ValueError(f"signal {signal.name}: this vehicle has no {signal.of.replace('_', ' ')}") from None
    except ValueError as error:
        raise ValueError(f"signal {signal.name}: {error}") from None


def recorded_distance(car: Car, distance_m: Array) -> Array:
    """What a car that truly was at these distances (n,) records: the inverse of ``car.driven``.

    ValueError if there is none: an effect on the position signal may stretch it by less than two, not turn it round.
    """
    recorded_m = distance_m
    for _ in range(_MOST_TRIES):
        missing_m = distance_m - car.driven(recorded_m)
        recorded_m = recorded_m + missing_m
        if not np.abs(missing_m).max() > ROUNDING:
            return recorded_m
    raise ValueError("the recorded distance would not say where the car was")


_KEPT_PASSAGES, _KEPT_STEPS = 6, 400_000
"""Of each run so many passages are kept, of so many steps in all. Places under wheels take some 80 bytes a step, and a
quarter of the time that stepping takes."""
_STEPPERS, _WORTH_HANDING_OVER = 2, 40_000
"""Threads that step runs, where each has so many steps: to hand one over takes 0.2 ms of a processor (measured), a
twentieth of what these take."""
_HOP_HZ = 13.0  # of a car's wheels
_MOST_FINER = 16
_LEAST_DAMPING = 1e-3
SEARCH_HZ = 500.0
"""Steps a second that are enough for a search, and for the change by an effect; what is reported is computed with the
usual ones."""
# Dry friction jumps: it needs so many times the steps of other laws.
_FINER_WITH_FRICTION = 2
# Of a record at 100 Hz, in 300 steps a second, what an effect without dry friction changes is right within 1.3 %, with
# it in 500 within 5 % (measured, all effects of the catalogue, a minute on a road of class C): near enough for
# differences. On a rig, which hits a stop at every turn, steps of another length change all that comes after a blow.
_ROUGHER = 2


def steps_hz(vehicle: Vehicle) -> float:
    """Steps a second in which a vehicle is simulated: as usual for one whose wheels hop as those of cars do, twice as
    many for one an octave quicker, and so on up to four octaves; more for a mass on a base that little damps. A force
    that is a straight line over a step of h moves a resonance at f by (2 pi f h)^2 / 12 at most, which at a damping
    ratio z is a share (2 pi f h)^2 / 24 z of its amplitude."""
    structure = structure_of(vehicle)
    needed_hz = float(undamped_frequencies_hz(structure)[-1]) / _HOP_HZ * FINE_RATE_HZ
    for one in vibrating(modes(structure)) if structure.on_base and not structure.held else []:
        needed_hz = max(needed_hz, 2 * np.pi * one.frequency_hz / np.sqrt(24 * max(one.damping_ratio, _LEAST_DAMPING)
                                                                          * DISCREPANCY))
    octaves = float(np.round(np.log2(max(needed_hz / FINE_RATE_HZ, 1.0))))
    return FINE_RATE_HZ * min(2**octaves, _MOST_FINER)


class SimulatedRuns:
    """Runs, and predictions of them in at least so many steps a second. Threads may ask at the same time; cars with
    laws of their own are stepped in two threads besides, where their runs are long.

    Problem: a fit needs hundreds of predictions of the same runs, by cars that differ in a number or an effect.
    Solution: ``SimulatedRuns`` caches the road under the wheels of each run (``Passage``), also for the few other
    distance signals (with a scale error, with a distance error) that were used last.
    """

    def __init__(self, runs: Sequence[Run], fine_hz: float = FINE_RATE_HZ) -> None:
        self.runs, self.fine_hz = list(runs), fine_hz
        self._steppers = ThreadPoolExecutor(_STEPPERS)
        self._work = list[int]()
        self._passages: list[dict[tuple[float, bytes, WheelTracks, bool], Passage]] = [{} for _ in self.runs]

    def in_steps(self, fine_hz: float) -> SimulatedRuns:
        """The runs simulated in at least so many steps a second, with the same caches."""
        found = copy(self)
        found.fine_hz = fine_hz
        return found

    def some(self, kept: Sequence[int]) -> SimulatedRuns:
        """Those of these numbers, whose simulations are counted with those of all."""
        found = copy(self)
        found.runs, found._passages = [self.runs[one] for one in kept], [{} for _ in kept]
        return found

    @property
    def work(self) -> int:
        """Steps of a car with one wheel that would have taken the time of all that was simulated so far: half of one
        more for each wheel more, four times as many of a car that ``is_dear``, a third of the samples of all signals,
        and 35,000 for each prediction, not for what finds its beginnings (measured: 80 to 100 ns a step of one wheel,
        125 of two, 260 to 290 of four, 3 ms a prediction)."""
        return sum(self._work)

    def predict(self, car: Car, distance_error_m: Sequence[Array] | None = None, rough: bool = False,
                tracks: Sequence[WheelTracks] | None = None, near: Sequence[Beginning | None] | None = None
                ) -> list[Array]:
        """Predicted record of each run, whole, in its pass band (n,) [m/s2]; of one with more signals all ((1 + s) n,).

        distance_error_m    distance driven minus distance recorded (n,), per run; None: 0
        rough               half as many steps where that is near enough for differences
        tracks              roads in place of the runs' own; each such object is cached by itself
        near                how they begin with a car that hardly differs (``beginnings``); empty: what was driven, with
                            the car without its laws, near enough to rank cars
        """
        with np.errstate(over="ignore", invalid="ignore"):
            passages, known = self._passages_of(car, distance_error_m, rough, tracks, near)
            in_threads = car.bends_laws and len(passages) > 1 and all(
                len(one.way.distance_m) > _WORTH_HANDING_OVER for one in passages)
            for step_s, forces in {(one.step_s, one.forces) for one in passages if in_threads}:
                stepper_of(car, step_s, forces)  # made once, before both threads ask for it
        self._work.append(35_000)

        def record(passage: Passage, run: Run, recorded: Array | None) -> Array:
            return run.in_band(self._recorded(car, passage, run)) if recorded is None else recorded

        return [*(self._steppers.map if in_threads else map)(record, passages, self.runs, known)]

    def linear_slopes(self, car_with: Callable[[Array], Car], here: Array,
                      distance_error_m: Sequence[Array] | None = None) -> tuple[list[int], list[Array]]:
        """Derivatives (q, n) per run of rough predictions by logarithms of a car's numbers (p,), as far as only its
        matrices depend on them, and which of them these are: of a car with laws of its own, on a bench, or whose
        initial state nobody knows none, and not where its wheels stand on a road."""
        car = car_with(here)
        if car.bends_laws or car.structure.held or not is_steady(car.structure) or any(
                begins_unknown(car, run) for run in self.runs):
            return [], []
        passages = self._unbegun(car, distance_error_m, rough=True)
        around = {index: (car_with(here + way), car_with(here - way))
                  for index, way in enumerate(STEP * np.eye(len(here)))}
        which = [index for index, cars in around.items() if all(
            passage.place_of(one.structure) == passage.place_of(car.structure) for one in cars for passage in passages)]
        return which, [_slopes(car, passage, run, [around[one] for one in which])
                       for run, passage in zip(self.runs, passages, strict=True)]

    def respond(self, car: Car, distance_error_m: Sequence[Array] | None = None) -> list[Response]:
        """The response of the car in each run: its record, and the motions of suspensions and tires."""
        with np.errstate(over="ignore", invalid="ignore"):
            return [respond(car, passage) for passage in self._passages_of(car, distance_error_m)[0]]

    def inputs(self, car: Car, distance_error_m: Sequence[Array], tracks: Sequence[WheelTracks]) -> list[Array]:
        """What drives the car in each run (n, u), as the recorder would keep it: vertical accelerations of the road
        under the wheels [m/s2], then forces [N]; arguments as of ``predict``."""
        def recorded_inputs(passage: Passage) -> Array:
            elevation, rest = np.split(passage.under_wheels(car.structure)[0].T, [len(car.structure.wheels)])
            accelerations = np.gradient(np.gradient(elevation, passage.step_s, axis=1), passage.step_s, axis=1)
            return passage.recorded(np.vstack([accelerations, rest]), np.ones_like).T

        return list(map(recorded_inputs, self._unbegun(car, distance_error_m, False, tracks)))

    def beginnings(self, car: Car, distance_error_m: Sequence[Array] | None = None) -> list[Beginning | None]:
        """How the runs begin with this car whose initial state nobody knows, simulated roughly; None of the others."""
        with np.errstate(over="ignore", invalid="ignore"):
            return [passage.beginning_of(car.record_key, partial(beginning, car, passage, run, self._recorded))
                    if begins_unknown(car, run) else None
                    for run, passage in zip(self.runs, self._unbegun(car, distance_error_m, rough=True), strict=True)]

    def _passages_of(self, car: Car, distance_error_m: Sequence[Array] | None, rough: bool = False,
                     tracks: Sequence[WheelTracks] | None = None, near: Sequence[Beginning | None] | None = None
                     ) -> tuple[list[Passage], list[Array | None]]:
        """The passages, begun, and the records of those that were simulated, or as good as, to find how they begin."""
        passages = self._unbegun(car, distance_error_m, rough, tracks)
        unknown = [begins_unknown(car, run) for run in self.runs]
        if not any(unknown):
            return passages, [None] * len(passages)
        linear = near is not None and not near and all(run.past is Past.DRIVEN for run in self.runs)
        known = [None] * len(passages) if linear else near or self.beginnings(car, distance_error_m)
        alike = [near is None and one is passage for one, passage in zip(
            self._unbegun(car, distance_error_m, rough=True), passages, strict=True)]
        found = [None if not of_run else one if one is not None and same else
                 beginning(car, passage, run, self._recorded, one, is_bent=not linear)
                 for run, passage, of_run, one, same in zip(self.runs, passages, unknown, known, alike, strict=True)]
        return ([passage if one is None else passage.begun_with(one.state)
                 for passage, one in zip(passages, found, strict=True)],
                [None if one is None or one.count < run.count else one.recorded
                 for run, one in zip(self.runs, found, strict=True)])

    def _unbegun(self, car: Car, distance_error_m: Sequence[Array] | None, rough: bool,
                 tracks: Sequence[WheelTracks] | None = None) -> list[Passage]:
        found = []
        for index, run in enumerate(self.runs):
            finer = _FINER_WITH_FRICTION if car.rubs else 1
            fine_hz = self.fine_hz * finer / (_ROUGHER if rough and (car.rubs or not run.timed) else 1)
            distance = run.distance_m if distance_error_m is None else run.distance_m + distance_error_m[index]
            distance = car.driven(distance)
            track: WheelTracks = run.track if tracks is None else tracks[index]
            is_free = begins_unknown(car, run)
            key = fine_hz, distance.tobytes(), track, is_free
            passage = self._passages[index].get(key)  # another thread may put others in its place at any time
            if passage is None:
                passage = Passage(track, run.rate_hz, distance, fine_hz, index, is_free, run.of_bench)
                kept = [*({key: passage} | self._passages[index]).items()][:_KEPT_PASSAGES]
                steps = np.cumsum([len(one.way.distance_m) for _, one in kept])
                self._passages[index] = dict(kept[: int(np.searchsorted(steps, _KEPT_STEPS, "right"))])
            found.append(passage)
        return found

    def _recorded(self, car: Car, passage: Passage, run: Run) -> Array:
        main = run.facts.main
        steps = len(passage.way.distance_m) * (4 if car.is_dear else 1)
        self._work.append(steps * (1 + len(car.structure.wheels)) // 2 + run.count * (1 + len(run.signals)) // 3)
        with np.errstate(over="ignore", invalid="ignore"):
            found = recorded_signals(car, passage, run.signals, main, zero_is_known(main, run.track))
        return np.maximum(np.fmin(found, MOST_MPS2), -MOST_MPS2)  # also where it is no number


def _slopes(car: Car, passage: Passage, run: Run, around: Sequence[tuple[Car, Car]]) -> Array:
    """Derivatives (p, n) of what a run's signals, joined, read of a linear car, by ``around`` of ``recorded_slopes``.
    """
    main = run.facts.main

    def read(one: Car) -> Read:
        return one, _outputs_of(one, main, run.signals)

    *slopes, recorded = recorded_slopes(passage, read(car), [(read(high), read(low)) for high, low in around])
    begins, joined, plain = int(zero_is_known(main, run.track)), [], car.written(passage, recorded[0])
    for one in slopes:
        if car.records:
            one[0] = (car.written(passage, recorded[0] + STEP * one[0]) - plain) / STEP
        one[begins:] -= one[begins:].mean(axis=1, keepdims=True)
        joined.append(run.in_band(one.ravel()))
    return np.array(joined).reshape(len(around), -1)


AFTER_S = 1.0
"""How long a drive at one speed goes on after the last wheel has left the profile."""
OBSTACLE_SPACING_M = 0.01
_LARGEST_M = 10_000.0  # of an obstacle
_FEWEST_STEPS = 2  # of the road, that an obstacle spans
_STEPS_MATTER = 0.05  # of a simulation's r.m.s., when its steps are halved
_SHORT_M = 0.5  # of a way on which a distorted distance is as good as straight


@dataclass(frozen=True)
class Obstacle:
    """One of ``OBSTACLES`` with its parameters; ``asked``: as it was asked for, which begins a complaint about it."""

    name: str
    parameters: Mapping[str, float]
    asked: str


@dataclass(frozen=True, eq=False)
class FrontAxleMotion:
    """Where the front tires are, at the recorder's instants: arrays (n,) [s, m/s, m]."""

    time_s: Array
    speed_mps: Array
    distance_m: Array


@dataclass(frozen=True)
class SensorErrors:
    """What a sensor adds: r.m.s. noise [m/s2], which ``seed`` it is made of, and the step that it rounds to [m/s2]; 0:
    none."""

    noise_mps2: float = 0.0
    step_mps2: float = 0.0
    seed: int = 1


# --- the road ---


def with_obstacles(track: Track, obstacles: Sequence[Obstacle]) -> Track:
    """The road with its obstacles; sampled more densely, with straight lines, where they would fall between samples.

    ValueError for an obstacle that is none, is too large, or does not lie on the road, and for a road that is too long.
    """
    if not obstacles:
        return track
    parts = int(np.ceil(track.spacing_m / OBSTACLE_SPACING_M - 1e-9))
    count = (len(track.elevation_m) - 1) * parts + 1
    if count > MOST_STEPS:
        longest_km = MOST_STEPS * OBSTACLE_SPACING_M / 1000
        raise ValueError(f"{obstacles[0].asked}: expected a road of at most {longest_km:g} km")
    number = np.arange(count) / parts
    columns = track.elevation_m.reshape(len(track.elevation_m), -1).T
    dense = np.stack([np.interp(number, np.arange(len(column)), column) for column in columns], axis=1)
    distance = track.start_m + track.spacing_m * number
    for one in obstacles:
        try:
            _check_parameters(one)
            _check_extent(one.parameters, distance)
            added = OBSTACLES[one.name](distance, **one.parameters)
        except ValueError as error:
            raise ValueError(f"{one.asked}: {error}") from None
        if added.all():
            raise ValueError(f"{one.asked}: expected some road before it, from {track.start_m:g} m on")
        dense += added[:, None]
    return Track(track.spacing_m / parts, dense.reshape(count, *track.elevation_m.shape[1:]), track.start_m)


def _check_parameters(one: Obstacle) -> None:
    """ValueError, which says what there is, for a name or parameters that there are not."""
    if one.name not in OBSTACLES:
        raise ValueError(f"expected one of {', '.join(OBSTACLES)}")
    known = list(inspect.signature(OBSTACLES[one.name]).parameters.values())[1:]
    needed = {parameter.name for parameter in known if parameter.default is inspect.Parameter.empty}
    if not needed <= set(one.parameters) <= {parameter.name for parameter in known}:
        raise ValueError(f"expected {one.name}:{','.join(f'{parameter.name}=M' for parameter in known)}")


def _check_extent(parameters: Mapping[str, float], distance_m: Array) -> None:
    """ValueError for an obstacle that is too large, not all on the road, or lost between the samples of the road."""
    for name, value in parameters.items():
        if name != "start_m" and abs(value) > _LARGEST_M:
            raise ValueError(f"expected {name} within {_LARGEST_M:g} m, found {value:g}")
    first_m, last_m = float(distance_m[0]), float(distance_m[-1])
    step_m = (last_m - first_m) / (len(distance_m) - 1)
    start_m = parameters["start_m"]
    extent_m = parameters.get("width_m", parameters.get("length_m"))
    end_m = start_m + (extent_m or 0.0)
    if start_m < first_m - EVEN_SAMPLES * step_m or end_m > last_m + EVEN_SAMPLES * step_m:
        raise ValueError(f"expected it on the road, {first_m:g} to {last_m:g} m, found {start_m:g} to {end_m:g} m")
    if extent_m is not None and 0 < extent_m < (_FEWEST_STEPS - EVEN_SAMPLES) * step_m:
        raise ValueError(f"expected it to be {_FEWEST_STEPS * step_m:g} m long or more, found {extent_m:g} m")


# --- the way ---


def at_one_speed(track: Track, wheelbase_m: float, speed_mps: float) -> tuple[Array, Array]:
    """Knots (2,), (2,) [s, m/s] of a drive at one speed from the front tires' start on the track until the last wheel
    has left it, and ``AFTER_S`` more."""
    length_m = track.end_m - track.start_m + wheelbase_m
    return np.array([0.0, length_m / speed_mps + AFTER_S]), np.full(2, speed_mps)


def motion_along(knots_s: Array, knots_mps: Array, start_m: float, rate_hz: float) -> FrontAxleMotion:
    """The motion at a recorder's instants when the speed is a straight line between knots (k,), (k,).

    ValueError for a drive of less than two samples, or one that is too long to be simulated.
    """
    duration_s = float(knots_s[-1] - knots_s[0])
    count = int(duration_s * rate_hz + 1e-6) + 1
    longest_s = MOST_STEPS / max(rate_hz, FINE_RATE_HZ)
    if count < 2 or duration_s > longest_s:
        raise ValueError(f"expected a drive of {1 / rate_hz:g} to {longest_s:g} s, found {duration_s:g} s")
    time_s = knots_s[0] + np.arange(count) / rate_hz
    at_knots = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(knots_s) * (knots_mps[:-1] + knots_mps[1:]))])
    last = np.clip(np.searchsorted(knots_s, time_s, side="right") - 1, 0, len(knots_s) - 2)
    speed_mps = np.interp(time_s, knots_s, knots_mps)
    driven = at_knots[last] + 0.5 * (time_s - knots_s[last]) * (knots_mps[last] + speed_mps)
    return FrontAxleMotion(time_s, speed_mps, start_m + driven)


def standing(excitation: Excitation, rate_hz: float) -> FrontAxleMotion:
    """The motion, none, at a recorder's instants on a rig as long as it is driven.

    ValueError as ``motion_along``.
    """
    last_s = excitation.end_s - excitation.start_s
    still = motion_along(np.array([0.0, last_s]), np.zeros(2), 0.0, rate_hz)
    return replace(still, time_s=excitation.start_s + still.time_s)


# --- what is felt ---


def response(
    car: Car, outputs: Mapping[str, Output], track: Track | Excitation, motion: FrontAxleMotion, rate_hz: float
) -> tuple[dict[str, Array], FrontAxleMotion]:
    """The outputs (n,) of a car with its effects, that of ``SENSOR`` behind the sensor's own, and the motion as it is
    recorded. The car came to the start as fast as it goes there.

    ValueError for effects under which no such car, or no such motion, is possible.
    """
    passage = Passage(track, rate_hz, motion.distance_m, steps_hz(car.vehicle) if track.timed else FINE_RATE_HZ,
                      of_bench=int(car.structure.held))
    columns = {SENSOR: _accelerations(car, passage)}
    if more := {name: output for name, output in outputs.items() if name != SENSOR}:
        columns |= dict(zip(more, observed(car, passage, list(more.values())).T, strict=True))
    distance_m = recorded_distance(car, motion.distance_m)
    stretch = (car.driven(distance_m + _SHORT_M) - car.driven(distance_m - _SHORT_M)) / (2 * _SHORT_M)
    return columns, FrontAxleMotion(motion.time_s, motion.speed_mps / stretch, distance_m)


def _accelerations(car: Car, passage: Passage) -> Array:
    """What the sensor records (n,) [m/s2], its steps halved where that may matter. ValueError where it does."""
    with np.errstate(over="ignore", invalid="ignore"):  # what grows without bound is refused below
        accel = recorded(car, passage)
        if car.bends_laws:
            finer = recorded(car, Passage(passage.track, passage.rate_hz, passage.distance_m, 2 / passage.step_s,
                                          of_bench=int(car.structure.held)))
            allowed = max(QUIETEST_MPS2, _STEPS_MATTER * float(np.sqrt(np.mean(finer**2))))
            if not np.sqrt(np.mean((accel - finer) ** 2)) <= allowed:
                raise ValueError("its effects are too strong for its masses: they would need steps shorter than "
                                 f"{1000 * passage.step_s:.3g} ms")
            accel = finer if car.rubs else accel
    if not bounded([accel]):
        raise ValueError("with its effects the model is unstable: its motion grows without bound")
    return accel


def recorded_drive(
    car: Car, outputs: Mapping[str, Output], track: Track | Excitation, motion: FrontAxleMotion, rate_hz: float,
    errors: SensorErrors,
) -> dict[str, Array]:
    """The columns (n,) of a drive's file, by name: those of the outputs last, but for that of ``SENSOR``.

    Problem: what a person asks for (a speed, obstacles, effects, a sensor) has to become what a model needs, and what
    no car can do (a jump of a kilometre, effects that a car's masses cannot follow) is to be refused in words.
    Solution: each step is a function of arrays. ``with_obstacles`` makes the road, ``motion_along`` the way driven over
    it, ``response`` what is felt on the way, ``as_sensed`` what a sensor makes of it.

    ValueError as ``response``.
    """
    columns, motion = response(car, outputs, track, motion, rate_hz)
    accel_mps2 = as_sensed(columns.pop(SENSOR), errors)
    return {"t_s": motion.time_s, SENSOR: accel_mps2, "speed_mps": motion.speed_mps, "distance_m": motion.distance_m,
            **columns}


def as_sensed(accel_mps2: Array, errors: SensorErrors) -> Array:
    """An acceleration (n,) with a sensor's noise, then rounded to its steps [m/s2]."""
    if errors.noise_mps2:
        noise = np.random.default_rng(errors.seed).standard_normal(len(accel_mps2))
        accel_mps2 = accel_mps2 + errors.noise_mps2 * noise
    return errors.step_mps2 * np.round(accel_mps2 / errors.step_mps2) if errors.step_mps2 else accel_mps2
