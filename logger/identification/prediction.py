"""What a vehicle's accelerometer would have recorded on the runs that were driven, and how that depends on each number.

Problem: a fit asks for the model's response, and for its derivative by every free number, tens of times; stepping the
car finely through each run for each of them takes seconds. Solution: a linear car answers each frequency by itself,
whatever the speed did, because the speed only shapes what passes under the wheels, and that does not depend on masses,
springs and dampers. So the road under each wheel is laid out in time once, finely, by its exact mean over each step,
band-limited as the recorder does it, and transformed; every prediction then is a small linear system per frequency. The
same solution, with one for the sensor's row beside it (the matrices are symmetric), gives all derivatives exactly.

A transform takes a record for one period of an endless one. Behind the record the road therefore comes back to where it
began and the car comes to rest; and the transform is taken along s = damping + i omega, which makes what comes round
from the end a ten-thousandth of what is left of it there.

Everything that fits knows only ``Model``, or ``Differentiable`` where a model has derivatives of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from logger.identification.parameters import AXLES, BOTH, Free, changed, read
from logger.roads.iso8608 import displacement_psd
from logger.roads.track import Track
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import FINE_RATE_HZ, recorder_taps
from logger.vehicle.structure import Structure, body_acceleration_response, body_point
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

SKIP_S = 2.0
"""What the beginning of a run is left out, as its past is not known [s]."""
# The car has come to the first sample as fast as it goes there for so long [s].
_APPROACH_S = 3.0
# How long the road behind a record takes to come back to where it began [s].
_RETURN_S = 6.0
_ROUND_THE_END = 1e-4
# Steps of the differences that derivatives of matrices (exact: they are quadratic at most) and of roads are taken by.
_RELATIVE_STEP = 1e-3
_EVEN = 1e-3
# Classes of speed that a record is described by, the slowest there is, and the longest period of a random road.
_SPEEDS = 12
_SLOWEST_MPS = 0.5
_LONGEST_S = 100.0
# The recorder's gain is read off a transform of so many points of its filter at so many times its rate.
_GAIN_STEPS, _GAIN_GRID = 4, 16384


class Model(Protocol):
    """What can be fitted: numbers in, one prediction per record out, as long as what was measured."""

    @property
    def parameters(self) -> Sequence[Free]: ...

    def predict(self, values: Array) -> list[Array]:
        """Predictions [(n,), ...] with these values (p,) in the order of ``parameters``."""


@runtime_checkable
class Differentiable(Model, Protocol):
    """A model that knows its derivatives."""

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """Predictions [(n,), ...] and their derivatives by each value [(n, p), ...]."""


@dataclass(frozen=True, eq=False)
class Record:
    """One run, evenly sampled: arrays (n,).

    time_s           [s]
    measured_mps2    the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]
    distance_m       where the front tires stand on the track [m]
    speed_mps        [m/s]
    skip_s           how much of the beginning is left out of fits and errors [s]

    ValueError for arrays of different lengths, or nothing left after the beginning.
    """

    time_s: Array
    measured_mps2: Array
    distance_m: Array
    speed_mps: Array
    track: Track
    skip_s: float = SKIP_S

    def __post_init__(self) -> None:
        lengths = {len(one) for one in (self.time_s, self.measured_mps2, self.distance_m, self.speed_mps)}
        if len(lengths) != 1 or len(self.time_s) - self.first < 2:
            raise ValueError(f"record: expected columns of one length, longer than {self.skip_s:g} s")

    @property
    def rate_hz(self) -> float:
        """Samples a second."""
        return float((len(self.time_s) - 1) / (self.time_s[-1] - self.time_s[0]))

    @property
    def first(self) -> int:
        """The first sample that is not left out."""
        return int(np.ceil(self.skip_s * self.rate_hz - _EVEN))

    @property
    def kept_mps2(self) -> Array:
        """What was measured, without the beginning."""
        return self.measured_mps2[self.first:]


class VehicleModel:
    """A linear car on the runs of ``records``: free numbers ``parameters``, all others as in ``vehicle``.

    The car comes to the first sample of a record at the speed it has there, over the road that the track has there.
    ValueError for a name that the vehicle has no number of, or that sets what another one sets.
    """

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], records: Sequence[Record]) -> None:
        self.vehicle, self.parameters, self.records = vehicle, list(parameters), list(records)
        wanted = [one.name for one in parameters]
        for name in wanted:
            read(vehicle, name)
            part, _, leaf = name.rpartition(".")
            if wanted.count(name) > 1 or (part in AXLES and f"{BOTH}.{leaf}" in wanted):
                raise ValueError(f"expected every number once, found {name} twice")
        self._roads = [_RoadInTime(record) for record in records]
        self.measured = [record.kept_mps2 for record in records]

    def vehicle_with(self, values: Array) -> Vehicle:
        """The vehicle with these values of its free numbers."""
        names = [one.name for one in self.parameters]
        return changed(self.vehicle, dict(zip(names, map(float, values), strict=True)))

    def predict(self, values: Array) -> list[Array]:
        """As ``Model``: accelerations without the beginnings of the records [m/s2]."""
        car = _car(self.vehicle_with(values))
        return [road.samples(_responses(car, road)[0]) for road in self._roads]

    def linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        """As ``Differentiable``; derivatives are exact but for those by places and lengths, which shift the road."""
        vehicle = self.vehicle_with(values)
        changes = [_change(vehicle, one) for one in self.parameters]
        car = _car(vehicle)
        predictions, slopes = [], []
        for road in self._roads:
            acceleration, derivatives = _responses(car, road, changes)
            predictions.append(road.samples(acceleration))
            slopes.append(road.samples(derivatives).T)
        return predictions, slopes

    def road_spectra(self, values: Array, f_hz: Array) -> list[Array]:
        """What the sensor makes of a random road of Gd(n0) = 1 cm3 under the whole of each record: one-sided spectra
        (f,) behind the recorder's filter [m2/s4/Hz per cm3], the mean over the speeds that were driven."""
        vehicle = self.vehicle_with(values)
        structure = structure_of(vehicle)
        spectra = []
        for record in self.records:
            speed = np.quantile(record.speed_mps[record.first:], (np.arange(_SPEEDS) + 0.5) / _SPEEDS)[:, None]
            speed = np.unique(np.maximum(speed, _SLOWEST_MPS), axis=0)
            f = np.maximum(f_hz, 1 / _LONGEST_S)
            response = np.abs(body_acceleration_response(structure, f, speed, vehicle.sensor)) ** 2
            recorder = _recorder_gain(f_hz / record.rate_hz) ** 2
            spectra.append((response * displacement_psd(f / speed, 1.0) / speed).mean(axis=0) * recorder)
        return spectra

    def inputs(self) -> list[Array]:
        """Vertical acceleration of the road under the wheels (n, w) per record [m/s2], band-limited, for tests."""
        structure = structure_of(self.vehicle)
        return [road.samples(road.s**2 * road.under_wheels(structure).T).T for road in self._roads]


@dataclass(frozen=True, eq=False)
class _Car:
    """A car's matrices and the row of its sensor (n,)."""

    structure: Structure
    row: Array


@dataclass(frozen=True, eq=False)
class _Change:
    """Derivatives of a car's matrices by one number; and, for one that moves the wheels or their patches, the cars a
    little before and after, ``apart`` apart in it."""

    mass: Array
    damping: Array
    stiffness: Array
    road: Array
    row: Array
    before: _Car
    after: _Car
    apart: float

    @property
    def shifts_road(self) -> bool:
        before, after = self.before.structure, self.after.structure
        return before.contact_patch_m != after.contact_patch_m or bool((before.behind_m != after.behind_m).any())


def _car(vehicle: Vehicle) -> _Car:
    structure = structure_of(vehicle)
    return _Car(structure, body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m).row)


def _change(vehicle: Vehicle, one: Free) -> _Change:
    value = read(vehicle, one.name)
    step = _RELATIVE_STEP * (abs(value) if one.positive else 1.0)
    before, after = (_car(changed(vehicle, {one.name: value + sign * step})) for sign in (-1, 1))
    low, high, apart = before.structure, after.structure, 2 * step
    return _Change((high.mass - low.mass) / apart, (high.damping - low.damping) / apart,
                   (high.stiffness - low.stiffness) / apart, (high.road - low.road) / apart,
                   (after.row - before.row) / apart, before, after, apart)


def _responses(car: _Car, road: _RoadInTime, changes: Sequence[_Change] = ()) -> tuple[Complex, Complex]:
    """Transforms of the sensor's acceleration (f,) and of its derivatives (p, f).

    With D = s2 M + s C + K, D q = R z and y = s2 r q: dy = s2 dr q + w (dR z + R dz - dD q), where D w = s2 r.
    """
    s, z, structure = road.s, road.under_wheels(car.structure), car.structure
    s2 = s * s
    dynamic = s2[:, None, None] * structure.mass + s[:, None, None] * structure.damping + structure.stiffness
    forces = np.stack([z @ structure.road.T, s2[:, None] * car.row], axis=-1)
    q, w = np.moveaxis(np.linalg.solve(dynamic, forces), -1, 0)
    derivatives = np.empty((len(changes), len(s)), dtype=complex)
    for index, change in enumerate(changes):
        force = z @ change.road.T - s2[:, None] * (q @ change.mass.T) - s[:, None] * (q @ change.damping.T)
        force -= q @ change.stiffness.T
        if change.shifts_road:
            moved = road.under_wheels(change.after.structure) - road.under_wheels(change.before.structure)
            force += moved @ structure.road.T / change.apart
        derivatives[index] = (w * force).sum(axis=1) + s2 * (q @ change.row)
    return s2 * (q @ car.row), derivatives


def _recorder_gain(f_of_rate: Array) -> Array:
    """The size of the recorder's gain at shares of its rate (f,)."""
    gains = np.abs(np.fft.rfft(recorder_taps(_GAIN_STEPS), _GAIN_GRID))
    return np.interp(f_of_rate * _GAIN_GRID / _GAIN_STEPS, np.arange(len(gains)), gains)


class _RoadInTime:
    """The road under the wheels of one record, transformed.

    s    (f,) where the transform is taken [1/s]
    """

    def __init__(self, record: Record) -> None:
        rate_hz = record.rate_hz
        self._track = record.track
        self._steps = int(np.ceil(FINE_RATE_HZ / rate_hz - _EVEN))
        fine_hz = rate_hz * self._steps
        lead, half = int(np.ceil(_APPROACH_S * rate_hz)), (len(recorder_taps(1)) - 1) // 2
        distance = record.distance_m
        pace_m = distance[1] - distance[0]
        ahead_m = distance[-1] - distance[-2]
        way = np.concatenate([distance[0] + pace_m * np.arange(-lead, 0), distance,
                              distance[-1] + ahead_m * np.arange(1, 2 * half)])
        self._way_m = _finer(way, self._steps)
        self._count = _smooth_length(len(way) + int(np.ceil(_RETURN_S * rate_hz)))
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

    def under_wheels(self, structure: Structure) -> Complex:
        """Transforms (f, w) of the elevations under the wheels, counted from where they began [m s]."""
        place = (structure.contact_patch_m, *structure.behind_m, *structure.left_m)
        if place not in self._known:
            if len(self._known) > 2:
                self._known.clear()
            paths = self._track.tire_paths(structure.contact_patch_m)
            wheels = [
                self._transform((paths[-1] if left_m < 0 else paths[0]).step_means(self._way_m - behind_m)[1])
                for behind_m, left_m in zip(structure.behind_m, structure.left_m, strict=True)
            ]
            self._known[place] = np.stack(wheels, axis=1)
        return self._known[place]

    def samples(self, transform: Complex) -> Array:
        """The samples (..., n) of transforms (..., f), without the beginning."""
        return np.fft.irfft(transform, self._count)[..., self._kept] * self._growth

    def _transform(self, means: Array) -> Complex:
        rise = means - means[0]
        back = np.zeros(len(self._fading))
        back[: len(rise)] = rise
        rest = len(back) - len(rise)
        back[len(rise):] = rise[-1] * 0.5 * (1 + np.cos(np.pi * np.arange(rest) / rest))
        return np.fft.rfft(back * self._fading)[: len(self.s)] * self._filter


def _finer(distance: Array, steps: int) -> Array:
    """Distances ``steps`` times as dense: cubics with the slopes that the neighbours give."""
    slope = np.gradient(distance)
    along = np.arange(steps) / steps
    rise = np.diff(distance)[:, None]
    first, last = slope[:-1, None], slope[1:, None]
    curve = distance[:-1, None] + along * (first + along * (3 * rise - 2 * first - last
                                                            + along * (first + last - 2 * rise)))
    return np.append(curve.ravel(), distance[-1])


def _smooth_length(least: int) -> int:
    """An even number from ``least`` on that has no prime factor above 5, so that transforms are quick."""
    best = 2 ** int(np.ceil(np.log2(least)))
    for fives in range(4):
        for threes in range(6):
            odd = 5**fives * 3**threes
            best = min(best, odd * 2 ** max(1, int(np.ceil(np.log2(least / odd)))))
    return best
