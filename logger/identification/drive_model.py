"""What a vehicle's accelerometer would have recorded on the runs that were driven, and how that depends on each number.

Problem: one model answers in frequency, exactly and at once, and knows linear cars only; another one steps any car
through time. What is free, how names become a car, effects and a road, and what a random road would do to the sensor
are the same for both. Solution: ``DriveModel`` has that, and a model adds its predictions and their derivatives.

``VehicleModel``: a fit asks for the model's response, and for its derivative by every free number, tens of
times; stepping the car finely through each run for each of them takes seconds. Solution: a linear car answers each
frequency by itself, whatever the speed did, because the speed only shapes what passes under the wheels, and that does
not depend on masses, springs and dampers. So the road under each wheel is laid out in time once, finely, by its exact
mean over each step, band-limited as the recorder does it, and transformed; every prediction then is a small linear
system per frequency. The same solution, with one more for the sensor's row (the matrices are symmetric), gives all
derivatives exactly.

A transform takes a record for one period of an endless one. Behind the record the road therefore comes back to where it
began and the car comes to rest; and the transform is taken along s = damping + i omega, which makes what comes round
from the end a ten-thousandth of what is left of it there.

``SimulatedModel``: dry friction, a bump stop or a sensor on a loose bracket are no numbers of a linear car, and the
laws of some of them have no transform. Solution: the car with its effects is driven through the runs as the lab drives
it (``SimulatedRuns``), whatever its laws are; derivatives are differences of such drives, over steps on the scales that
the numbers move on. An obstacle of which only the kind is known lies on the road in closed form, as it does in
frequency.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex
from logger.identification.unknown_inputs import (
    SPEED_SCALE,
    Obstacle,
    ObstaclePath,
    RoadInput,
    changed_input,
    check_names,
    is_input,
    read_input,
)
from logger.profiles.track import Alterations, Stance, Track, Way, WheelTracks, along_paths
from logger.roads.iso8608 import displacement_psd
from logger.runs import EVEN_SAMPLES, READING, SLOWEST_MPS, Run
from logger.simulation.virtual_drive import SimulatedRuns, steps_hz
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.linear_car import LinearCar, Sensitivity, reading_slope, sensitivity, solved
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import AXLES, BOTH, Free, changed, free_parameter_named, read, slope_of, steps_of
from logger.vehicle.simulate import FINE_RATE_HZ, finer, recorder_gain, recorder_taps, smooth_length
from logger.vehicle.structure import Structure
from logger.vehicle.vehicle import Vehicle

# The car has come to the first sample as fast as it goes there for so long [s].
_APPROACH_S = 3.0
# How long the road behind a record takes to come back to where it began [s].
_RETURN_S = 6.0
_ROUND_THE_END = 1e-4
_KEPT_PLACES = 3  # of wheels: of differences by a scale of the speed, and where they are taken


class RoadInTime:
    """The road under the wheels of one record, transformed.

    s    (f,) where the transform is taken [1/s]
    """

    def __init__(self, record: Run) -> None:
        rate_hz = record.rate_hz
        self._track = record.track
        self._steps = int(np.ceil(FINE_RATE_HZ / rate_hz - EVEN_SAMPLES))
        fine_hz = rate_hz * self._steps
        lead, half = int(np.ceil(_APPROACH_S * rate_hz)), (len(recorder_taps(1)) - 1) // 2
        distance = record.distance_m
        pace_m = distance[1] - distance[0]
        ahead_m = distance[-1] - distance[-2]
        way = np.concatenate([distance[0] + pace_m * np.arange(-lead, 0), distance,
                              distance[-1] + ahead_m * np.arange(1, 2 * half)])
        self._way_m = finer(way, self._steps)
        self._time_s = (np.arange(len(self._way_m)) / self._steps - lead) / rate_hz
        self._count = smooth_length(len(way) + int(np.ceil(_RETURN_S * rate_hz)))
        self._kept = slice(lead + record.first, lead + len(distance))
        damping = -np.log(_ROUND_THE_END) * rate_hz / self._count
        f_hz = np.arange(self._count // 2) * rate_hz / self._count
        self.s = damping + 2j * np.pi * f_hz
        self._fading = np.exp(-damping * np.arange(self._count * self._steps) / fine_hz)
        self._growth = np.exp(damping * np.arange(self._count) / rate_hz)[self._kept]
        # The mean over a step is the road times this, and the recorder's filter follows.
        over = self.s / fine_hz
        taps = recorder_taps(self._steps)
        place = np.arange(len(taps)) - (len(taps) - 1) / 2
        fading_taps = np.zeros(self._count * self._steps)
        fading_taps[: len(taps)] = taps * np.exp(-damping * place / fine_hz)
        filtered = np.fft.rfft(fading_taps)[: len(f_hz)] * np.exp(2j * np.pi * f_hz * (len(taps) - 1) / 2 / fine_hz)
        self._filter = filtered * over / np.expm1(over) / self._steps
        self._known: dict[tuple[float, ...], Complex] = {}

    def under_wheels(self, structure: Structure, road: RoadInput) -> Complex:
        """Transforms (f, w) of the elevations under the wheels, counted from where they began [m s]."""
        way = Way(self._way_m / road.speed_scale, self._time_s)
        place = (road.speed_scale, structure.contact_patch_m, *structure.behind_m, *structure.left_m,
                 structure.actuators)
        if place not in self._known:
            if len(self._known) > _KEPT_PLACES:
                self._known.clear()
            track = self._track.as_it_is((), structure.actuators)
            self._known[place] = self._transforms(track.under_wheels(way, structure)[1])
        under = self._known[place]
        for obstacle in road.obstacles.values():
            path = ObstaclePath(obstacle, structure.contact_patch_m)
            under = under + self._transforms(along_paths([path], way, structure)[1])
        return under

    def samples(self, transform: Complex) -> Array:
        """The samples (..., n) of transforms (..., f), without the beginning."""
        return np.fft.irfft(transform, self._count)[..., self._kept] * self._growth

    def _transforms(self, means: Array) -> Complex:
        """Of means over steps (M - 1, w)."""
        rise = (means - means[0]).T
        rest = len(self._fading) - rise.shape[1]
        back = np.hstack([rise, rise[:, -1:] * (0.5 * (1 + np.cos(np.pi * np.arange(rest) / rest)))])
        return (np.fft.rfft(back * self._fading)[:, : len(self.s)] * self._filter).T


# Classes of speed that a record is described by, and the longest period of a random road.
_SPEEDS = 12
_LONGEST_S = 100.0


class DriveModel:
    """A car on the runs of ``records``: free numbers ``parameters``, all others as in ``vehicle``, ``effects`` and
    ``road``.

    A free number is the car's (``named_parameters.names``), an effect's
    (``named_parameters.free_parameter_named``) or the road's (``unknown_inputs``). The car comes to the first sample
    of a record at the speed it has there, over the road that the track has there. ValueError for a name that none of
    them has a number of, or that sets what another one sets.

    measured    (n,) per record, without its beginning [m/s2]
    """

    exact: bool

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], records: Sequence[Run],
                 road: RoadInput | None = None, effects: Sequence[Chosen] = ()) -> None:
        self.vehicle, self.parameters, self.records = vehicle, list(parameters), list(records)
        self.road, self.effects = road or RoadInput(), tuple(effects)
        wanted = [one.name for one in parameters]
        check_names(wanted, len(records))
        self._free_parameters = {name: free for name in wanted
                                 if (free := free_parameter_named(self.effects, name)) is not None}
        for name in wanted:
            if is_input(name):
                read_input(self.road, name)
            elif name not in self._free_parameters:
                read(vehicle, name)
            part, _, leaf = name.rpartition(".")
            if wanted.count(name) > 1 or (part in AXLES and f"{BOTH}.{leaf}" in wanted):
                raise ValueError(f"expected every number once, found {name} twice")
        self.measured = [record.kept_mps2 for record in records]

    def predict(self, values: Array) -> list[Array]:
        """Accelerations (n,) per record without its beginning, with these values (p,) [m/s2]."""
        raise NotImplementedError

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``Predictor``."""
        raise NotImplementedError

    def observed(self, run: int, prediction: Array) -> Array:
        """A prediction (n,) of a record, counted from 0, where it has readings: as it was measured where nothing
        was read, and where a clipped reading is reached."""
        record = self.records[run]
        if record.usable is None:
            return prediction
        whole = np.concatenate([np.zeros(record.first), prediction])
        return record.kept_mps2 - record.residual(whole)[record.first:]

    def observed_slopes(self, run: int, prediction: Array, slopes: Array) -> Array:
        """Slopes (n, p) of that: none where it does not change with the prediction (n,)."""
        usable = self.records[run].usable
        if usable is None:
            return slopes
        fixed = (usable[self.records[run].first:] != READING) & (self.observed(run, prediction) == self.measured[run])
        return np.where(fixed[:, None], 0.0, slopes)

    def vehicle_with(self, values: Array) -> Vehicle:
        """The vehicle with these values of its free numbers."""
        return changed(self.vehicle, {name: value for name, value in self._named(values)
                                      if not is_input(name) and name not in self._free_parameters})

    def effects_with(self, values: Array) -> tuple[Chosen, ...]:
        """The effects with these values of their free numbers."""
        effects = list(self.effects)
        for name, value in self._named(values):
            if (free := self._free_parameters.get(name)) is not None:
                one = effects[free.effect]
                parameter = one.effect.parameters[free.parameter]
                kept = min(max(value, parameter.low), parameter.high)
                effects[free.effect] = replace(one, values={**one.values, parameter.name: kept})
        return tuple(effects)

    def car_with(self, values: Array) -> Car:
        """The vehicle with its effects. ValueError where it then lacks what its model or an effect needs."""
        return compose(self.vehicle_with(values), self.effects_with(values))

    def trials(self) -> list[dict[str, float]]:
        """Values of single free numbers of effects, by name, that a search begins at as well: where things stick and
        slip, downhill from one start may end in another place than from the next."""
        numbers = {one.name: one for one in self.parameters}
        return [{name: value} for name, free in self._free_parameters.items()
                for value in self.effects[free.effect].effect.parameters[free.parameter].trials
                if numbers[name].low <= value <= numbers[name].high]

    def road_with(self, values: Array, run: int) -> RoadInput:
        """The road's input in a run, counted from 0, with these values of the free numbers."""
        return changed_input(self.road, {name: value for name, value in self._named(values) if is_input(name)}, run)

    def _named(self, values: Array) -> list[tuple[str, float]]:
        return list(zip([one.name for one in self.parameters], map(float, values), strict=True))

    def response(self, values: Array, f_hz: Array, speed_mps: npt.ArrayLike) -> Complex:
        """What the sensor makes of a road's waves [1/s2], as ``body_acceleration_response``; of a car whose laws are
        bent, what its linear part does."""
        car = self.car_with(values)
        return LinearCar(car.structure, car.output, sensors=car.sensors).response(f_hz, speed_mps)

    def road_spectra(self, values: Array, f_hz: Array) -> list[Array]:
        """What the sensor makes of a random road of Gd(n0) = 1 cm3 under the whole of each record: one-sided spectra
        (f,) behind the recorder's filter [m2/s4/Hz per cm3], the mean over the speeds that were driven."""
        spectra = []
        for run, record in enumerate(self.records):
            true_mps = record.speed_mps[record.first:] / self.road_with(values, run).speed_scale
            speed = np.quantile(true_mps, (np.arange(_SPEEDS) + 0.5) / _SPEEDS)[:, None]
            speed = np.unique(np.maximum(speed, SLOWEST_MPS), axis=0)
            f = np.maximum(f_hz, 1 / _LONGEST_S)
            power = np.abs(self.response(values, f, speed)) ** 2
            recorder = recorder_gain(f_hz / record.rate_hz) ** 2
            spectra.append((power * displacement_psd(f / speed, 1.0) / speed).mean(axis=0) * recorder)
        return spectra

    def inputs(self, values: Array) -> list[Array]:
        """Vertical acceleration of the road under the wheels (n, w) per record with these values [m/s2], band-limited,
        for tests."""
        structure = structure_of(self.vehicle)
        return [road.samples(road.s**2 * road.under_wheels(structure, self.road_with(values, run)).T).T
                for run, road in enumerate(self._roads)]

    @cached_property
    def _roads(self) -> list[RoadInTime]:
        """The road under the wheels of each record."""
        return [RoadInTime(record) for record in self.records]


class VehicleModel(DriveModel):
    """A linear car without effects."""

    exact = True

    def predict(self, values: Array) -> list[Array]:
        """As ``Predictor``: accelerations without the beginnings of the records [m/s2]."""
        car = LinearCar.of(self.vehicle_with(values))
        return [self.observed(run, self._reading(road, *solved(car, road.s, under[:, None])[:1], car))
                for run, (road, under) in enumerate(zip(self._roads, self._under(car, values), strict=True))]

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``Predictor``; derivatives are exact but for those by places, lengths and what lies on the
        road, which change what comes under the wheels."""
        vehicle = self.vehicle_with(values)
        car = LinearCar.of(vehicle)
        numbers = [None if is_input(one.name) else sensitivity(vehicle, one) for one in self.parameters]
        predictions, slopes = [], []
        for run, (road, under) in enumerate(zip(self._roads, self._under(car, values), strict=True)):
            q, w = solved(car, road.s, under[:, None])
            derivatives = np.zeros((len(self.parameters), len(road.s)), dtype=complex)
            for index, change in enumerate(numbers):
                if change is not None:
                    derivatives[index] = reading_slope(change, road.s, under[:, None], q, w)[:, 0]
                if (moved := self._moved(road, run, values, index, change)) is not None:
                    derivatives[index] += (w * (moved @ car.structure.road.T)).sum(axis=1)
            prediction = self._reading(road, q, car)
            predictions.append(self.observed(run, prediction))
            slopes.append(self.observed_slopes(run, prediction, road.samples(derivatives).T))
        return predictions, slopes

    def _under(self, car: LinearCar, values: Array) -> list[Complex]:
        """Transforms (f, w) of the road under the wheels of each record."""
        return [road.under_wheels(car.structure, self.road_with(values, run)) for run, road in enumerate(self._roads)]

    @staticmethod
    def _reading(road: RoadInTime, q: Complex, car: LinearCar) -> Array:
        return road.samples(road.s**2 * (q[:, 0] @ car.output.row))

    def _moved(self, road: RoadInTime, run: int, values: Array, index: int, change: Sensitivity | None
               ) -> Complex | None:
        """Derivative (f, w) of the road under the wheels in a run by a free number, what lies on it by differences to
        both sides unless it is at a bound; None where it moves nothing."""
        if change is not None:
            if not change.shifts_road:
                return None
            at = self.road_with(values, run)
            before, after = (road.under_wheels(one.structure, at) for one in (change.before, change.after))
            return np.asarray((after - before) / change.apart)
        one, structure = self.parameters[index], structure_of(self.vehicle_with(values))
        step = _INPUT_STEP * (1.0 if one.place else values[index]) * (_OF_SPEED if SPEED_SCALE in one.name else 1.0)
        ends = np.clip(values[index] + step * np.array([-1.0, 1.0]), one.low, one.high)
        inputs = [self.road_with(np.where(np.arange(len(values)) == index, end, values), run) for end in ends]
        if inputs[0] == inputs[1]:
            return None
        before, after = (road.under_wheels(structure, one) for one in inputs)
        return np.asarray((after - before) / (ends[1] - ends[0]))


# Steps of differences by what lies on the road: over places [m], as shares of sizes, of the latter's for a factor of
# all distances, which moves what lies far away. A bump of a metre is smooth over a ten-thousandth of it.
_INPUT_STEP, _OF_SPEED = 1e-4, 1e-2
# Steps of differences, either way: of what moves by factors, and of effects' numbers as shares; of a factor of all
# distances, which moves what lies far away; of places [m]. What sticks and slips makes a response that is jagged on a
# fine scale: smaller steps show its teeth, and not where it leads.
_STEP, _SHARE_STEP, _SPEED_STEP, _PLACE_STEP_M = 5e-3, 1e-2, 1e-6, 5e-3
_SMOOTH_STEP = 1e-4  # of a car of straight laws: a mode of quality Q bends over a step h by (Q h)^2 / 6
_KEPT_TRACKS = 4


class SimulatedModel(DriveModel):
    """A car with effects, of any laws."""

    exact = False

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], records: Sequence[Run],
                 road: RoadInput | None = None, effects: Sequence[Chosen] = ()) -> None:
        super().__init__(vehicle, parameters, records, road, effects)
        self._runs = SimulatedRuns(records, steps_hz(vehicle))
        self._share = _STEP if compose(vehicle, self.effects).bends_laws else _SMOOTH_STEP
        self._tracks: dict[tuple[int, tuple[Obstacle, ...]], WheelTracks] = {}

    def predict(self, values: Array) -> list[Array]:
        """As ``Predictor``: accelerations without the beginnings of the records [m/s2]."""
        roads = [self.road_with(values, run) for run in range(len(self.records))]
        farther_m = [record.distance_m * (1 / road.speed_scale - 1)
                     for record, road in zip(self.records, roads, strict=True)]
        tracks = [self._track(run, road) for run, road in enumerate(roads)]
        predictions = self._runs.predict(self.car_with(values), farther_m, tracks=tracks)
        return [self.observed(run, one[self.records[run].first:]) for run, one in enumerate(predictions)]

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``Predictor``: differences, to both sides of a number unless it is at a bound."""
        columns = []
        for index, one in enumerate(self.parameters):
            step = self._step(one, float(values[index]))
            ends = np.clip(values[index] + step * np.array([-1.0, 1.0]), one.low, one.high)
            low, high = (self.predict(np.where(np.arange(len(values)) == index, end, values)) for end in ends)
            columns.append([(there - here) / (ends[1] - ends[0]) for here, there in zip(low, high, strict=True)])
        return self.predict(values), [np.stack(parts, axis=1) for parts in zip(*columns, strict=True)]

    def _step(self, one: Free, value: float) -> float:
        """Of a number where it is."""
        if (free := self._free_parameters.get(one.name)) is not None:
            chosen = self.effects[free.effect]
            parameter = chosen.effect.parameters[free.parameter]
            here = Chosen(chosen.effect, {**chosen.values, parameter.name: value})
            step = float(steps_of([*self.effects[: free.effect], here], [free], _STEP, _SHARE_STEP)[0])
            return step / slope_of(parameter, value)
        if one.by_factors:
            return value * (_SPEED_STEP if one.name.endswith(SPEED_SCALE) else self._share)
        return _PLACE_STEP_M if one.usual is None else self._share * one.usual

    def _track(self, run: int, road: RoadInput) -> WheelTracks:
        """The road of a run with what lies on it; the same object as long as nothing changes."""
        track, obstacles = self.records[run].track, tuple(road.obstacles.values())
        if not obstacles or not isinstance(track, Track):
            return track
        if (run, obstacles) not in self._tracks:
            for old in [*self._tracks][: -_KEPT_TRACKS * len(self.records)]:
                del self._tracks[old]
            self._tracks[run, obstacles] = _TrackWithObstacles(track, obstacles)
        return self._tracks[run, obstacles]


@dataclass(frozen=True, eq=False)
class _TrackWithObstacles:
    """A track on which obstacles lie, alike under left and right wheels."""

    track: Track
    obstacles: tuple[Obstacle, ...]
    acts_on = ()

    def as_it_is(self, surface: Alterations, actuators: Alterations) -> _TrackWithObstacles:
        """The road itself under the obstacles, which stay what they are."""
        return replace(self, track=self.track.as_it_is(surface, actuators))

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """As ``WheelTracks``."""
        parts = [self.track.under_wheels(way, stance),
                 *(along_paths([ObstaclePath(one, stance.contact_patch_m)], way, stance) for one in self.obstacles)]
        elevations, means = (np.sum(some, axis=0) for some in zip(*parts, strict=True))
        return elevations, means
