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
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
import numpy.typing as npt

from logger.dsp.decimating_low_pass import DecimatingLowPass
from logger.identification.noise_models import RoadNoise
from logger.identification.unknown_road.drive_operator import Crossing, Drive, grid_under
from logger.identification.unknown_road.relative_placement import best_placement
from logger.identification.unknown_road.road_equations import MOST_ROUNDS, DrivesModel, Preconditioner, factored, solve
from logger.identification.unknown_road.road_state import (
    GD_N0,
    HUNDREDTH,
    Options,
    ResponseCar,
    RoadState,
    at_n0,
    by_waviness,
    displacement_psd_m3,
)
from logger.roads.iso8608 import displacement_psd

Array = npt.NDArray[np.float64]

_SHORTEST_CPM = 4.0
_PER_WAVE, _SPACING_M = 2.5, (0.08, 0.3)


class UnknownRoad:
    """One road and the drives over it: what they say of a car's numbers, the road's, their places and the noise."""

    def __init__(self, car: ResponseCar, drives: list[Drive], options: Options, generator: np.random.Generator) -> None:
        self._car, self._options = car, options
        self._cars = [car] * len(drives)
        highest = max(_highest_cpm(drive) for drive in drives)
        spacing_m = float(np.clip(1 / (_PER_WAVE * min(highest, _SHORTEST_CPM)), *_SPACING_M))
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

    def with_cars(self, cars: Sequence[ResponseCar]) -> UnknownRoad:
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

        fisher_probes    in place of that of the options
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
            probes = slice(1, 1 + (fisher_probes or self._options.fisher_probes))
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
        if self._options.place_off_m:
            columns += by_place[1:]
        columns += by_scale[1:]
        return np.stack([*columns, by_noise], axis=1)

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
                 ((1.0, False, self._options.place_off_m), (HUNDREDTH, True, self._options.scale_off)) if free
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
        return solve(model, readings, self.grid.count, self._options.solved, rounds, nearby)


def _highest_cpm(drive: Drive) -> float:
    pace_m = float(np.median(np.abs(np.diff(drive.distance_m))))
    return 0.45 / max(pace_m, 1e-3)
