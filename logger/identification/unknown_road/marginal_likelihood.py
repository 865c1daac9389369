"""A car from drives over roads that nobody measured: one drive or several over each, their spectrum assumed.

Problem: the road is an unknown at every place, a thousand times as many as the car has numbers; fitted along with them
it would explain anything. Solution: a road of ISO 8608 is a Gaussian process, so readings are one as well,

    y = A(theta) z + noise,   z of the spectrum Gd(n0) (n / n0)^-w,   C = A S A' + sigma^2,

and the numbers are those of the largest likelihood of y with the road integrated out. Several drives over one road
share z: what one of them says of the road, another one has to agree with at its own speed, and that says far more of
the car than the spectrum alone.

C is never formed. A drive is applied to a road, and back, by transforms (``Crossing``), at any speed; the most probable
road follows by conjugate gradients, and with u = inv(C) y and z = S A' u the likelihood's slope by a number is

    u' dA z - E[the same of readings that the model itself makes]   (and alike for the road's numbers and the noise).

The expectation, else a trace of huge matrices, is a mean over ``probes`` simulated drives, always the same ones: the
estimate is then a root of a smooth function, unbiased however few they are, and its variance grows by one part in
``last_probes``; the way there takes fewer. Steps are Fisher's, whose matrix comes from the same probes.

Nothing here knows a vehicle: ``ResponseCar`` is all that is asked for. Numbers that no such drive can determine
(masses, rates and dampers all larger by one factor) are refused (``identifiability``).

The prior of a road is that of ISO 8608, Gd(n0) (n / n0)^-w, flat below the longest waves. Its level is counted at a
pivot where a car is shaken, so that level and waviness can be separated.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from logger.arrays import Array, Bools, Complex, Indices
from logger.dsp.filters import DecimatingLowPass
from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM, PIVOT_CPM
from logger.identification.noise_models import RoadNoise
from logger.identification.unknown_road.road_operator import (
    MOST_ROUNDS,
    Crossing,
    DrivesModel,
    Preconditioner,
    RoadDrive,
    best_placement,
    factored,
    grid_under,
    solve,
)
from logger.roads.iso8608 import CM3_M3, REFERENCE_N0_CPM, STANDARD_WAVINESS, displacement_psd
from logger.vehicle.named_parameters import Free

GD_N0, WAVINESS, NOISE, OFFSET, SCALE = "gd_n0_cm3", "waviness", "noise_mps2", "place_offset_m", "distance_scale"
HUNDREDTH = 0.01
"""A scale of distances moves by hundredths."""


class ResponseCar(Protocol):
    """A car as far as it is known here."""

    @property
    def parameters(self) -> Sequence[Free]: ...

    @property
    def behind_m(self) -> Array:
        """(x,) how far behind the front one each axle stands [m]."""

    @property
    def contact_patch_m(self) -> float: ...

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Readings per elevation under each axle (x, f) with these values (p,), and their derivatives (p, x, f)."""


_SOLVED, _FISHER_PROBES = 3e-4, 2
"""What is left of a set of equations when it counts as solved, of what it began with; and simulated drives that the
information is a mean over."""


@dataclass(frozen=True)
class Options:
    """How to fit.

    waviness         of every road, or where it starts
    free_waviness    find it, one for each road
    place_off_m      how far the places of two drives over one road may be off, more than 0
    scale_off        how far their distances may be off beyond that, as a share; 0: they are exact
    probes           simulated drives that slopes are compared with on the way
    last_probes      and at the end, where what they have in common is an error of the estimate
    seed             of them
    refuse           raise NotIdentifiable; otherwise ``RoadFit.verdict`` says it
    """

    waviness: float = STANDARD_WAVINESS
    free_waviness: bool = False
    place_off_m: float = 3.0
    probes: int = 10
    seed: int = 1
    refuse: bool = True
    scale_off: float = 0.0
    last_probes: int = 40


@dataclass(frozen=True, eq=False)
class RoadState:
    """Numbers of a car and a road in plain units; the level is the logarithm of Gd at the pivot, in units of 1 cm3 at
    n0, and the scales those of the drives' distances, 1 if none are given."""

    values: Array
    level: float
    waviness: float
    offsets_m: Array
    noise_mps2: float
    scales: Array | None = None


def displacement_psd_m3(level: float, waviness: float, wave_number_cpm: Array) -> Array:
    """Spectrum (k,) [m3] of a road whose level is given as in ``RoadState``; nothing at the first wave number, 0."""
    psd = np.exp(level) * CM3_M3 * (np.maximum(wave_number_cpm, FLATTENED_BELOW_CPM) / PIVOT_CPM) ** -waviness
    psd[0] = 0.0
    return np.asarray(psd)


def by_waviness(wave_number_cpm: Array) -> Array:
    """Derivative (k,) of the logarithm of the spectrum by the waviness."""
    return np.asarray(-np.log(np.maximum(wave_number_cpm, FLATTENED_BELOW_CPM) / PIVOT_CPM))


def at_n0(waviness: float) -> float:
    """Gd at n0 over Gd at the pivot."""
    return float((REFERENCE_N0_CPM / PIVOT_CPM) ** -waviness)


SHORTEST_CPM = 4.0
"""The shortest waves that count, as long as a tire's contact."""
_PER_WAVE, _SPACING_M = 2.5, (0.08, 0.3)


class UnknownRoad:
    """One road and the drives over it: what they say of a car's numbers, the road's, their places and the noise."""

    def __init__(self, car: ResponseCar, drives: list[RoadDrive], options: Options, generator: np.random.Generator
                 ) -> None:
        self._car, self._options = car, options
        self._cars = [car] * len(drives)
        highest = max(_highest_cpm(drive) for drive in drives)
        spacing_m = float(np.clip(1 / (_PER_WAVE * min(highest, SHORTEST_CPM)), *_SPACING_M))
        scale_off = options.scale_off * (len(drives) > 1)
        self.grid = grid_under(drives, car.behind_m, spacing_m, options.place_off_m, scale_off)
        self.drives = drives
        self.crossings = [Crossing(drive, self.grid, car.behind_m, car.contact_patch_m) for drive in drives]
        self.measured = [one.measured_mps2 - one.measured_mps2.mean() for one in self.crossings]
        self._rounds = MOST_ROUNDS
        self._nearby: Preconditioner | None = None
        self._white = generator.standard_normal((options.probes, self.grid.count))
        self._noise = [generator.standard_normal((options.probes, len(one))) for one in self.measured]

    @property
    def size_mps2(self) -> float:
        """R.m.s. of all readings."""
        return float(np.sqrt(np.mean(np.concatenate(self.measured) ** 2)))

    def first_guess(self, values: Array) -> tuple[float, float]:
        """Logarithm of the level, and the noise, from the readings' spectra alone."""
        level, noise_mps2 = self._spectral_levels(values, self._options.waviness, range(len(self.crossings)))
        return float(np.log(level / at_n0(self._options.waviness))), noise_mps2

    def noise_alone(self, values: Array, waviness: float) -> float:
        """The same noise [m/s2], r.m.s. over the drives, each of which may have had a road of its own."""
        noises = [self._spectral_levels(values, waviness, [one])[1] for one in range(len(self.crossings))]
        return float(np.sqrt(np.mean(np.square(noises))))

    def _spectral_levels(self, values: Array, waviness: float, which: Sequence[int]) -> tuple[float, float]:
        """Gd(n0) [cm3] and the noise [m/s2] from the spectra of these drives."""
        def spectra(_: Array, f_hz: Array) -> list[Array]:
            f = np.maximum(f_hz, 0.05)
            found = []
            for one in (self.crossings[number] for number in which):
                speed = float(np.median(one.speed_mps))
                delay = np.exp(-2j * np.pi * f / speed * self._car.behind_m[:, None])
                gain = np.abs((self._car.responses(values, f)[0] * delay).sum(axis=0)) ** 2
                gain = gain * np.sinc(f / speed * self._car.contact_patch_m) ** 2
                found.append(gain * displacement_psd(f / speed, 1.0, waviness) / speed)
            return found

        low_pass = DecimatingLowPass(self.drives[0].rate_hz, None)
        measured = [self.measured[number] for number in which]
        levels = RoadNoise(spectra).fitted(measured, values, low_pass, 1e-3 * self.size_mps2).levels
        return levels[GD_N0], levels["deviation_mps2"]

    def offset(self, at: RoadState, number: int) -> float:
        """Where a drive's places best agree with those of the first one [m]."""
        return self.place(at, number)[0]

    def place(self, at: RoadState, number: int) -> tuple[float, float]:
        """Where a drive's places best agree with those of the first one [m], and at what scale of its distances."""
        model = self.model(at)
        white = self._solve(model.of([0]), [self.measured[0][None]])[0]
        return best_placement(self.crossings[number], self.measured[number], self.drives[number].distance_m,
                              model.responses[number], self.grid.wave_number_cpm, model.waves[0], white,
                              self._options.place_off_m, self._options.scale_off)

    def with_cars(self, cars: Sequence[ResponseCar]) -> "UnknownRoad":
        """The same road and drives with another car, whose axles stand where they stood; one for each drive, of the
        same numbers, as a car that is not linear answers each drive in its own way."""
        other = copy(self)
        other._car, other._cars = cars[0], list(cars)
        return other

    @property
    def rounds(self) -> int:
        """How many it took to solve the equations last."""
        return self._rounds

    def prepare(self, at: RoadState) -> None:
        """Factor the equations as they are here, so that those of a place nearby are solved in few rounds."""
        self._nearby = factored(self.model(at), self.grid.count)

    def predicted(self, at: RoadState, number: int, by: Sequence[int] | None = None) -> Array:
        """What the other drives, or some, make one expect in the drive of this number (n,), less its mean [m/s2]."""
        model, crossings = self.model(at), self.crossings
        others = [index for index in range(len(crossings)) if index != number] if by is None else list(by)
        white = self._solve(model.of(others), [self.measured[one][None] for one in others])[0]
        own = crossings[number]
        return np.asarray(own.readings(own.under_axles(white, model.waves[number]), model.responses[number])[0])

    def elevation(self, at: RoadState) -> Array:
        """The most probable elevations (count,) [m]."""
        model = self.model(at)
        found = self._solve(model, [one[None] for one in self.measured], self._nearby)[0]
        return np.asarray(np.fft.irfft(np.fft.rfft(found[0]) * np.abs(model.waves[0]), self.grid.count))

    def score(self, at: RoadState, information: bool, fisher_probes: int | None = None,
              ) -> tuple[Array, Array, tuple[float, float]]:
        """Slopes of the likelihood (m,), the information (m, m) or zeros, and squares unexplained and measured.

        fisher_probes    simulated drives that the information is a mean over; None: two
        """
        model = self.model(at)
        readings = []
        for number, one in enumerate(self.crossings):
            made = one.readings(one.under_axles(self._white, model.waves[number]), model.responses[number])
            made = made + at.noise_mps2 * self._noise[number]
            readings.append(np.concatenate([self.measured[number][None], made - made.mean(axis=1, keepdims=True)]))
        rounds = None if information or self._nearby is not None else self._rounds
        white, rest, self._rounds = self._solve(model, readings, self._nearby, rounds)
        slopes = self._quadratics(model, white, rest)
        left = sum(float((model.variance * one[0]) @ (model.variance * one[0])) for one in rest)
        whole = sum(float(one @ one) for one in self.measured)
        count = slopes.shape[1]
        known = np.zeros((count, count))
        if information:
            probes = slice(1, 1 + (fisher_probes or _FISHER_PROBES))
            known = self._information(model, white[probes], [one[probes] for one in rest])
        return slopes[0] - slopes[1:].mean(axis=0), known, (left, whole)

    def _quadratics(self, model: DrivesModel, white: Array, rest: list[Array]) -> Array:
        """Half of u' dC u (b, m), of whitened readings u = ``rest`` with their roads ``white``."""
        p = len(self._car.parameters)
        by_car = np.zeros((len(white), p))
        by_place, by_scale = [], []
        by_noise = np.zeros(len(white))
        slope = 2j * np.pi * self.grid.wave_number_cpm
        for one, waves, response, derivative, u in zip(
            self.crossings, model.waves, model.responses, model.derivatives, rest, strict=True
        ):
            transform = one.transform(u)
            under = one.under_axles(white, waves)
            by_car += one.products(transform, derivative, under)
            moved = one.under_axles(white, waves * slope)
            by_place.append(one.products(transform, response[None], moved)[:, 0])
            if self._options.scale_off:
                moved = HUNDREDTH * one.under_axles(white, waves * slope, lever=True)
                by_scale.append(one.products(transform, response[None], moved)[:, 0])
            by_noise += model.variance * (u**2).sum(axis=1)
        columns = [*by_car.T, 0.5 * (white**2).sum(axis=1)]
        if self._options.free_waviness:
            columns.append(0.5 * (white * self._tilted(white)).sum(axis=1))
        return np.stack([*columns, *by_place[1:], *by_scale[1:], by_noise], axis=1)

    def _information(self, model: DrivesModel, white: Array, rest: list[Array]) -> Array:
        """Half of E[(dC u)' inv(C) (dC u)] (m, m), over whitened readings of probes.

        y' inv(C) y is the least of |y - B w|^2 / variance + |w|^2 over roads w: taken so, it is off only by the square
        of what the equations were not solved to, and never negative."""
        total = np.zeros((0, 0))
        for probe in range(len(white)):
            changed = self._changes(model, white[probe : probe + 1], [one[probe : probe + 1] for one in rest])
            roads, solved, _ = self._solve(model, changed, self._nearby)
            part = roads @ roads.T + model.variance * np.sum([one @ one.T for one in solved], axis=0)
            total = part if probe == 0 else total + part
        return np.asarray(total / (2 * len(white)))

    def _changes(self, model: DrivesModel, white: Array, rest: list[Array]) -> list[Array]:
        """dC u for every number: readings (m, n) of each drive."""
        p, drives = len(self._car.parameters), len(self.crossings)
        under = [one.under_axles(white, waves) for one, waves in zip(self.crossings, model.waves, strict=True)]
        slope = 2j * np.pi * self.grid.wave_number_cpm
        roads = [sum(one.back(u, waves, derivative[index]) for one, u, waves, derivative in
                     zip(self.crossings, rest, model.waves, model.derivatives, strict=True)) for index in range(p)]
        roads.append(white)
        if self._options.free_waviness:
            roads.append(self._tilted(white))
        moves = [(number, size, lever) for size, lever, free in
                 ((1.0, False, True), (HUNDREDTH, True, self._options.scale_off)) if free
                 for number in range(1, drives)]
        roads += [size * self.crossings[number].back(rest[number], model.waves[number] * slope,
                                                     model.responses[number], lever) for number, size, lever in moves]
        innovations = np.concatenate([np.asarray(one) for one in roads])
        changed = []
        for number, one in enumerate(self.crossings):
            readings = one.readings(one.under_axles(innovations, model.waves[number]), model.responses[number])
            for index in range(p):
                readings[index] += one.readings(under[number], model.derivatives[number][index])[0]
            for index, (moving, size, lever) in enumerate(moves, len(roads) - len(moves)):
                if moving == number:
                    moved = size * one.under_axles(white, model.waves[number] * slope, lever)
                    readings[index] += one.readings(moved, model.responses[number])[0]
            changed.append(np.concatenate([readings, 2 * model.variance * rest[number]]))
        return changed

    def _tilted(self, white: Array) -> Array:
        """Innovations times the derivative of the logarithm of the spectrum by the waviness."""
        return np.asarray(np.fft.irfft(by_waviness(self.grid.wave_number_cpm) * np.fft.rfft(white), self.grid.count))

    def model(self, at: RoadState) -> DrivesModel:
        """The drives with these numbers."""
        n = self.grid.wave_number_cpm
        factor = np.sqrt(displacement_psd_m3(at.level, at.waviness, n) / (2 * self.grid.spacing_m))
        if at.scales is not None:
            self.crossings = [one.laid(float(scale)) for one, scale in zip(self.crossings, at.scales, strict=True)]
        pairs = [car.responses(at.values, one.f_hz) for car, one in zip(self._cars, self.crossings, strict=True)]
        gain = np.zeros(len(n))
        for one, (response, _) in zip(self.crossings, pairs, strict=True):
            seen = float(one.speed_mps.mean()) * len(one.speed_mps) / self._rate_hz / self.grid.spacing_m
            gain += one.gain(response, self._car.behind_m) / seen
        spectral = 1 / (1 + factor**2 * gain / at.noise_mps2**2)
        waves = [factor * np.exp(2j * np.pi * n * off) for off in at.offsets_m]
        return DrivesModel(list(self.crossings), waves, [one for one, _ in pairs], [one for _, one in pairs], spectral,
                           at.noise_mps2**2)

    @property
    def _rate_hz(self) -> float:
        return self.drives[0].rate_hz

    def _solve(self, model: DrivesModel, readings: Sequence[Array], nearby: Preconditioner | None = None,
               rounds: int | None = None) -> tuple[Array, list[Array], int]:
        return solve(model, readings, self.grid.count, _SOLVED, rounds, nearby)


def _highest_cpm(drive: RoadDrive) -> float:
    pace_m = float(np.median(np.abs(np.diff(drive.distance_m))))
    return 0.45 / max(pace_m, 1e-3)


@dataclass(frozen=True, eq=False)
class RoadsScore:
    """What a likelihood makes of all numbers: its slopes (m,), the information (m, m) or zeros, rms of what is
    unexplained over that of what was measured, and the rounds that it took to solve the equations."""

    slopes: Array
    information: Array
    error: float
    rounds: int


class Roads:
    """Roads, the drives over each, and one noise. Their numbers are one vector (r,): of each road its level, its
    waviness if that is free, the places of its drives but the first, and the scales of their distances; the noise last.

    names    (r,)
    parts    indices of each road's numbers, the noise's in them

    ValueError unless there is a drive over every road.
    """

    def __init__(self, car: ResponseCar, roads: Sequence[Sequence[RoadDrive]], options: Options) -> None:
        if not roads or not all(roads):
            raise ValueError("expected a drive over every road")
        generator = np.random.default_rng(options.seed)
        self.options = options
        self.roads = [UnknownRoad(car, list(drives), options, generator) for drives in roads]
        self.names: list[str] = []
        ends = [0]
        for number, drives in enumerate(roads, 1):
            own = [GD_N0, *[WAVINESS] * options.free_waviness]
            own += [f"drive{drive}.{what}" for what in (OFFSET, *[SCALE] * (options.scale_off > 0))
                    for drive in range(2, len(drives) + 1)]
            self.names += [f"road{number}.{one}" for one in own]
            ends.append(len(self.names))
        self.names.append(NOISE)
        self.parts = [np.append(np.arange(*pair), ends[-1]) for pair in pairwise(ends)]

    def are(self, what: str) -> Bools:
        """Which of the numbers (r,) are of this kind: ``GD_N0``, ``WAVINESS``, ``OFFSET``, ``SCALE``, ``NOISE``."""
        return np.array([name.rpartition(".")[2] == what for name in self.names])

    def places(self, road: int) -> Indices:
        """Indices of the places of a road's drives but the first."""
        return self.parts[road][self.are(OFFSET)[self.parts[road]]]

    def with_cars(self, cars: Sequence[ResponseCar]) -> "Roads":
        """The same with another car, whose axles stand where they stood, in each drive over each road."""
        other, cars = copy(self), list(cars)
        other.roads = []
        for road in self.roads:
            count = len(road.drives)
            other.roads.append(road.with_cars(cars[:count]))
            cars = cars[count:]
        return other

    def prepared(self, values: Array, numbers: Array) -> "Roads":
        """The same, whose equations are solved in few rounds near these values of the car's and the roads' numbers."""
        other = copy(self)
        other.roads = [copy(road) for road in self.roads]
        for index, road in enumerate(other.roads):
            road.prepare(self.state(index, values, numbers))
        return other

    def state(self, road: int, values: Array, numbers: Array) -> RoadState:
        """A road's numbers, and the car's (p,), among those of all roads (r,)."""
        part, drives = self.parts[road], len(self.roads[road].drives)
        waviness = float(numbers[part[1]]) if self.options.free_waviness else self.options.waviness
        offsets_m, scales = np.zeros(drives), np.ones(drives)
        offsets_m[1:] = numbers[self.places(road)]
        if self.options.scale_off:
            scales[1:] += HUNDREDTH * numbers[part[self.are(SCALE)[part]]]
        return RoadState(values, float(numbers[part[0]]), waviness, offsets_m, float(np.exp(numbers[-1])), scales)

    def first_guess(self, values: Array, least_mps2: float = 0.0) -> Array:
        """Numbers (r,) with levels and a noise, no less than this, from spectra; drives where they were recorded."""
        numbers, noises = np.zeros(len(self.names)), []
        for road, part in zip(self.roads, self.parts, strict=True):
            numbers[part[0]], noise_mps2 = road.first_guess(values)
            noises.append(noise_mps2)
        numbers[self.are(WAVINESS)] = self.options.waviness
        numbers[-1] = np.log(max(float(np.median(noises)), least_mps2))
        return numbers

    def score(self, values: Array, numbers: Array, information: bool, fisher_probes: int | None = None) -> RoadsScore:
        """Slopes by the car's numbers (p,) and the roads' (r,); arguments as of ``UnknownRoad.score``."""
        p = len(values)
        slopes = np.zeros(p + len(numbers))
        matrix = np.zeros((len(slopes), len(slopes)))
        left = whole = 0.0
        for index, (road, part) in enumerate(zip(self.roads, self.parts, strict=True)):
            own, known, squares = road.score(self.state(index, values, numbers), information, fisher_probes)
            at = np.append(np.arange(p), p + part)
            slopes[at] += own
            matrix[np.ix_(at, at)] += known
            left, whole = left + squares[0], whole + squares[1]
        error = float(np.sqrt(left / whole)) if whole > 0 else float("nan")
        return RoadsScore(slopes, matrix, error, max(road.rounds for road in self.roads))
