"""A car with any effects as a linear one: exactly where its laws are linear, else as its motion makes them on average.

Problem: what is estimated or computed wave by wave needs a linear car, and dampers, friction, stops and tires are not.
Solution: statistical linearisation. On a random road at steady speed the motion of a corner is nearly Gaussian; the
linear law whose force differs least from the true one in the mean square has, for travel x and rate v of standard
deviations sx and sv about a mean travel,

    k = E[f x] / sx^2,    c = E[f v] / sv^2    (x and v of one instant are not correlated)

Coulomb friction F comes to c = sqrt(2 / pi) F / sv, a tire that lifts where its force u passes its load L to the share
P(u < L) of its force. The deviations follow from the road's spectrum through the car with these laws, so both are found
by turns. Where the mean of a force is not 0 (stops, uneven dampers) the suspension rests elsewhere: each carries its
load whatever it does, which gives the mean travel.

Source: J. B. Roberts, P. D. Spanos, Random Vibration and Statistical Linearization (1990), chapters 2 and 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from math import erf, exp, log, pi, sqrt
from typing import Protocol

import numpy as np
import numpy.typing as npt

from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.laws import CornerLaws
from logger.vehicle.linear_car import CornerSlopes, LinearCar
from logger.vehicle.stepping import static_tire_loads_n
from logger.vehicle.structure import Output
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

# Values of a normal variable at which laws are asked, and how likely each is; the one of two variables has fewer.
_REACH = 6.0
_POINTS, _POINTS_OF_TWO = 601, 61
_MOST_TURNS, _NEAR_ENOUGH = 60, 5e-3
# Slopes of a car that does not move are asked over motions as small as these: a car's engine moves it more.
_LEAST_TRAVEL_M, _LEAST_RATE_MPS = 1e-7, 1e-6
# Speeds and levels (as height) of roads within 20 %, and wavinesses within 0.2, share one linear car.
_STEPS_PER_E, _WAVINESS_STEPS = 5, 5
_KEPT = 64
_EVERY = 3  # of the wave numbers that others look at: sums over the road need fewer


class KnownCar(Protocol):
    """A car as its readings are judged by: linear, or linear for each speed and road."""

    @property
    def depends_on_motion(self) -> bool:
        """Whether it is another car where the road or the speed is another one."""
        ...

    def at(self, speed_mps: float, wave_number_cpm: Array, psd_m3: Array) -> LinearCar:
        """The linear car at a speed [m/s] on a road of a spectrum (f,) [m3] at wave numbers (f,) [cycle/m]."""
        ...


def known_vehicle(vehicle: Vehicle, effects: Sequence[Chosen] = ()) -> KnownCar:
    """A vehicle with its effects, likewise. ValueError as ``compose``."""
    return known_car(compose(vehicle, effects))


def known_car(car: Car) -> KnownCar:
    """A car with its effects as readings are judged by: exact if its laws are linear."""
    output = Output(car.row, np.zeros(len(car.structure.wheels)), 2)
    if not car.bends_laws:
        return LinearCar(car.structure, output, sensors=car.sensors)
    if all(map(_is_linear, car.laws)):
        slopes = tuple(_linear_slopes(one) for one in car.laws)
        return LinearCar(car.structure, output, slopes, car.sensors)
    return MovedCar(car, output)


def _is_linear(one: CornerLaws) -> bool:
    rates = np.array([-2.0, -1.0, -0.1, 0.1, 1.0, 2.0])
    plain = not one.springs and not one.others and not one.tires and not one.dry_friction_n and one.tire_pulls
    return plain and bool(np.allclose(one.damper(rates), one.damping_n_s_per_m * rates, rtol=1e-9, atol=1e-9))


def _linear_slopes(one: CornerLaws) -> CornerSlopes:
    return CornerSlopes(0.0, one.damping_n_s_per_m, one.mount_n_per_m, 0.0, 0.0, one.tire_damping_n_s_per_m)


@dataclass(frozen=True, eq=False)
class MovedCar:
    """A car whose laws are not linear: linear for each speed and road, by statistical linearisation. Speeds and heights
    of roads within 20 % share one."""

    car: Car
    output: Output
    _found: dict[tuple[int, int, int], LinearCar] = field(default_factory=dict)

    @property
    def depends_on_motion(self) -> bool:
        """Whether it is another car where the road or the speed is another one: it is."""
        return True

    def at(self, speed_mps: float, wave_number_cpm: Array, psd_m3: Array) -> LinearCar:
        """The linear car at a speed [m/s] on a road of a spectrum (f,) [m3] at wave numbers (f,) [cycle/m], which are
        spaced evenly on a logarithmic scale."""
        wave_number_cpm, psd_m3 = wave_number_cpm[::_EVERY], psd_m3[::_EVERY]
        log_n, log_psd = np.log(wave_number_cpm), np.log(psd_m3)
        middle = len(log_n) // 2
        slope = (log_psd[-1] - log_psd[middle]) / (log_n[-1] - log_n[middle])
        key = (round(log(speed_mps) * _STEPS_PER_E), round(0.5 * log_psd[middle] * _STEPS_PER_E),
               round(slope * _WAVINESS_STEPS))
        if key not in self._found:
            if len(self._found) >= _KEPT:
                self._found.clear()
            rounded = exp(2 * key[1] / _STEPS_PER_E) * psd_m3 / psd_m3[middle]
            self._found[key] = linearised(self.car, self.output, exp(key[0] / _STEPS_PER_E), wave_number_cpm, rounded)
        return self._found[key]


def linearised(car: Car, output: Output, speed_mps: float, wave_number_cpm: Array, psd_m3: Array) -> LinearCar:
    """The linear car that comes nearest to one on a random road at a steady speed.

    speed_mps                  [m/s]
    wave_number_cpm, psd_m3    (f,) of the road, evenly spaced on a logarithmic scale [cycle/m, m3]
    """
    structure = car.structure
    power = psd_m3 * wave_number_cpm * log(wave_number_cpm[1] / wave_number_cpm[0])
    loads_n = static_tire_loads_n(structure)
    slopes = tuple(_linear_slopes(one) for one in car.laws)
    for _ in range(_MOST_TURNS):
        tried = LinearCar(structure, output, slopes, car.sensors)
        moves = tried.waves(wave_number_cpm, speed_mps)
        found = [_Corner(*(_deviation(one[:, i], power) for one in
                           (moves.travel, moves.rate, moves.own_rate, moves.deflection, moves.force)))
                 .slopes(laws, float(structure.springs[i]), float(loads_n[i]), slopes[i].rest_m)
                 for i, laws in enumerate(car.laws)]
        after = tuple(_between(old, new) for old, new in zip(slopes, found, strict=True))
        change = max(_change(old, new) for old, new in zip(slopes, after, strict=True))
        slopes = after
        if change < _NEAR_ENOUGH:
            break
    return LinearCar(structure, output, slopes, car.sensors)


def _deviation(gain: npt.NDArray[np.complex128], power: Array) -> float:
    return sqrt(float(np.abs(gain) ** 2 @ power))


def _between(old: CornerSlopes, new: CornerSlopes) -> CornerSlopes:
    """Half the way, so that friction does not swing between stuck and free."""
    numbers = {}
    for one in fields(CornerSlopes):
        before, after = getattr(old, one.name), getattr(new, one.name)
        numbers[one.name] = before if before == after else 0.5 * (before + after)
    return CornerSlopes(**numbers)


def _change(old: CornerSlopes, new: CornerSlopes) -> float:
    pairs = [(getattr(old, one.name), getattr(new, one.name)) for one in fields(CornerSlopes) if one.name != "rest_m"]
    return max(abs(after - before) / max(abs(after), abs(before)) if after != before else 0.0
               for before, after in pairs)


@dataclass(frozen=True)
class _Corner:
    """Standard deviations of what a corner does [m, m/s, m/s, m, N]."""

    travel_m: float
    rate_mps: float
    own_rate_mps: float
    deflection_m: float
    force_n: float

    def slopes(self, laws: CornerLaws, spring_n_per_m: float, load_n: float, rest_m: float
               ) -> CornerSlopes:
        """Slopes that stand in for its laws, with the mean travel to be tried next."""
        travel, rate = max(self.travel_m, _LEAST_TRAVEL_M), max(self.rate_mps, _LEAST_RATE_MPS)
        own_rate = max(self.own_rate_mps, _LEAST_RATE_MPS)
        spring, pull = _sloped(sum((law(rest_m + travel * _NORMAL) for law in laws.springs), 0 * _NORMAL), travel)
        damper, drag = _sloped(laws.damper(own_rate * _NORMAL), own_rate)
        rubs = 0.0
        if laws.dry_friction_n:
            transition = laws.friction_transition_mps
            held = np.tanh(rate * _NORMAL / transition) if transition else np.sign(_NORMAL)
            rubs = _sloped(laws.dry_friction_n * held, rate)[0]
        if laws.others:
            x, v = np.meshgrid(_NORMAL_OF_TWO, _NORMAL_OF_TWO, indexing="ij")
            force = sum((law(rest_m + travel * x, rate * v) for law in laws.others), 0 * x)
            spring += float(_SHARE_OF_TWO @ (force * x) @ _SHARE_OF_TWO) / travel
            rubs += float(_SHARE_OF_TWO @ (force * v) @ _SHARE_OF_TWO) / rate
            pull += float(_SHARE_OF_TWO @ force @ _SHARE_OF_TWO)
        pressed = max(self.deflection_m, _LEAST_TRAVEL_M)
        tire, _ = _sloped(sum((law(pressed * _NORMAL) for law in laws.tires), 0 * _NORMAL), pressed)
        holds = 1.0 if laws.tire_pulls else 0.5 * (1 + erf(load_n / (sqrt(2.0) * self.force_n)))
        unbalanced = spring_n_per_m * rest_m + pull + drag
        return CornerSlopes(spring, damper, laws.mount_n_per_m, rubs, tire, laws.tire_damping_n_s_per_m, holds,
                            rest_m - unbalanced / (spring_n_per_m + max(spring, 0.0)))


def _normal(points: int) -> tuple[Array, Array]:
    at = np.linspace(-_REACH, _REACH, points)
    share = np.exp(-0.5 * at**2) * (at[1] - at[0]) / sqrt(2 * pi)
    return at, share / (share @ at**2)


_NORMAL, _SHARE = _normal(_POINTS)
_NORMAL_OF_TWO, _SHARE_OF_TWO = _normal(_POINTS_OF_TWO)


def _sloped(force: Array, deviation: float) -> tuple[float, float]:
    """Slope and mean of a force (p,) at the values of a normal variable of this deviation."""
    return float(_SHARE @ (force * _NORMAL)) / deviation, float(_SHARE @ force)
