"""Drives, a car and a road with numbers that are free: what the models that predict these drives have in common.

Problem: one model answers in frequency, exactly and at once, and knows linear cars only; another one steps any car
through time. What is free, how names become a car, effects and a road, and what a random road would do to the sensor
are the same for both. Solution: that is here, and a model adds its predictions and their derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.identification.road_transform import RoadInTime
from logger.identification.unknown_inputs import RoadInput, changed_input, check_names, is_input, read_input
from logger.roads.iso8608 import displacement_psd
from logger.runs import READING, Run
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import free_parameter_named
from logger.vehicle.frequency_response import body_acceleration_response
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import AXLES, BOTH, Free, changed, read
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

# Classes of speed that a record is described by, the slowest there is, and the longest period of a random road.
_SPEEDS = 12
_SLOWEST_MPS = 0.5
_LONGEST_S = 100.0


class DriveModel:
    """A car on the runs of ``records``: free numbers ``parameters``, all others as in ``vehicle``, ``effects`` and
    ``road``.

    A free number is the car's (``named_parameters.names``), an effect's
    (``effect_parameters.free_parameter_named``) or the road's (``unknown_inputs``). The car comes to the first sample
    of a record at the speed it has there, over the road that the track has there. ValueError for a name that none of
    them has a number of, or that sets what another one sets.

    measured    (n,) per record, without its beginning [m/s2]
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
                raise ValueError(f"expected every number once, found {name} twice")
        self.measured = [record.kept_mps2 for record in records]

    def predict(self, values: Array) -> list[Array]:
        """Accelerations (n,) per record without its beginning, with these values (p,) [m/s2]."""
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
        gain = body_acceleration_response(car.structure, f_hz, speed_mps, car.vehicle.sensor)
        return np.asarray(gain * car.factor(np.asarray(2j * np.pi * f_hz)))

    def road_spectra(self, values: Array, f_hz: Array) -> list[Array]:
        """What the sensor makes of a random road of Gd(n0) = 1 cm3 under the whole of each record: one-sided spectra
        (f,) behind the recorder's filter [m2/s4/Hz per cm3], the mean over the speeds that were driven."""
        spectra = []
        for run, record in enumerate(self.records):
            true_mps = record.speed_mps[record.first:] / self.road_with(values, run).speed_scale
            speed = np.quantile(true_mps, (np.arange(_SPEEDS) + 0.5) / _SPEEDS)[:, None]
            speed = np.unique(np.maximum(speed, _SLOWEST_MPS), axis=0)
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
