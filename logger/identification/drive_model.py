"""What a vehicle's accelerometer would have recorded on the runs that were driven, and how that depends on each number.

Problem: a fit asks for the prediction, and for its derivative by every free number, tens of times, of cars with dry
friction, a bump stop or a sensor on a loose bracket as well, and with an obstacle on the road of which only the kind is
known. Solution: the car with its effects is driven through the runs as the lab drives it (``SimulatedRuns``), whatever
its laws are; derivatives are differences of such drives, over steps on the scales that the numbers move on. An obstacle
lies on the road in closed form.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex
from logger.identification.unknown_inputs import (
    SPEED_SCALE,
    Obstacle,
    RoadInput,
    changed_input,
    check_names,
    is_input,
    read_input,
)
from logger.profiles.track import Alterations, Stance, Track, Way, WheelTracks
from logger.roads.iso8608 import displacement_psd
from logger.runs import SLOWEST_MPS, Run
from logger.simulation.virtual_drive import SimulatedRuns, steps_hz
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.named_parameters import AXLES, BOTH, Free, changed, free_parameter_named, read, slope_of, steps_of
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.vehicle import Vehicle

# Steps of differences, either way: shares of what moves by factors, and metres of places; shares of effects' numbers;
# and of a factor of all distances, which moves what lies far away. What sticks and slips makes a response that is
# jagged on a fine scale: smaller steps show its teeth, and not where it leads. A car of straight laws has no teeth, but
# a mode of quality Q bends over a step h by (Q h)^2 / 6.
_STEP, _SMOOTH_STEP, _SHARE_STEP, _SPEED_STEP = 5e-3, 1e-4, 1e-2, 1e-6
_KEPT_TRACKS = 4
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
    exact       whether predictions are as accurate as their numbers: no law is bent, and nothing is stepped
    """

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
                raise ValueError(f"expected every parameter once, found {name} twice")
        self.measured = [record.kept_mps2 for record in records]
        car = compose(vehicle, self.effects)
        self.exact = not (car.bends_laws or car.structure.held)
        self._runs = SimulatedRuns(records, steps_hz(vehicle))
        self._track_with_obstacles = lru_cache(_KEPT_TRACKS * max(len(records), 1))(_TrackWithObstacles)

    def predict(self, values: Array) -> list[Array]:
        """As ``Predictor``: accelerations without the beginnings of the records [m/s2]; as it was measured where
        nothing was read, and where a clipped reading is reached."""
        farther_m, tracks = self._driven(values)
        predictions = self._runs.predict(self.car_with(values), farther_m, tracks=tracks)
        return [(one if record.usable is None else record.measured_mps2 - record.residual(one))[record.first:]
                for record, one in zip(self.records, predictions, strict=True)]

    def slopes(self, values: Array) -> list[Array]:
        """As ``Predictor``: differences, to both sides of a number unless it is at a bound."""
        columns = []
        for index, one in enumerate(self.parameters):
            step = self._step(index, values)
            ends = np.clip(values[index] + step * np.array([-1.0, 1.0]), one.low, one.high)
            low, high = (self.predict(np.where(np.arange(len(values)) == index, end, values)) for end in ends)
            columns.append([(there - here) / (ends[1] - ends[0]) for here, there in zip(low, high, strict=True)])
        return [np.stack(parts, axis=1) for parts in zip(*columns, strict=True)]

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
        """What drives the car (n, u) per record with these values, as ``SimulatedRuns.inputs``, for tests."""
        return [one[record.first:] for one, record in zip(
            self._runs.inputs(self.car_with(values), *self._driven(values)), self.records, strict=True)]

    def _driven(self, values: Array) -> tuple[list[Array], list[WheelTracks]]:
        """What was driven beyond the recorded distances (n,) [m], and the roads, with these values."""
        roads = [self.road_with(values, run) for run in range(len(self.records))]
        return [record.distance_m * (1 / road.speed_scale - 1) for record, road in zip(
            self.records, roads, strict=True)], [self._track(run, road) for run, road in enumerate(roads)]

    def _step(self, index: int, values: Array) -> float:
        """Of a number where it is."""
        one, value = self.parameters[index], float(values[index])
        share = _SMOOTH_STEP if self.exact else _STEP
        if (free := self._free_parameters.get(one.name)) is not None:
            effects = self.effects_with(values)
            step = float(steps_of(effects, [free], _STEP, _SHARE_STEP)[0])
            return step / slope_of(effects[free.effect].effect.parameters[free.parameter], value)
        if one.by_factors:
            return value * (_SPEED_STEP if one.name.endswith(SPEED_SCALE) else share)
        return share * (one.usual or 1.0)

    def _track(self, run: int, road: RoadInput) -> WheelTracks:
        """The road of a run with what lies on it; the same object as long as nothing changes."""
        track, obstacles = self.records[run].track, tuple(road.obstacles.values())
        if not obstacles or not isinstance(track, Track):
            return track
        return self._track_with_obstacles(track, obstacles)


@dataclass(frozen=True, eq=False)
class _TrackWithObstacles:
    """A track on which obstacles lie, alike under left and right wheels."""

    track: Track
    obstacles: tuple[Obstacle, ...]
    timed = False
    acts_on = ()

    def as_it_is(self, surface: Alterations, actuators: Alterations) -> "_TrackWithObstacles":
        """The road itself under the obstacles, which stay what they are."""
        return replace(self, track=self.track.as_it_is(surface, actuators))

    def under_wheels(self, way: Way, stance: Stance) -> tuple[Array, Array]:
        """As ``WheelTracks``; obstacles that no wheel meets are left out, as their roundings would pass for effects."""
        patch_m, at_m = stance.contact_patch_m, way.distance_m
        met = [one.track for one in self.obstacles if at_m.max() > one.track.start_m - patch_m
               and at_m.min() - stance.behind_m.max() < one.track.end_m + patch_m]
        parts = [one.under_wheels(way, stance) for one in (self.track, *met)]
        elevations, means = (np.sum(some, axis=0) for some in zip(*parts, strict=True))
        return elevations, means
