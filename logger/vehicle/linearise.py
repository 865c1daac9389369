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

A force by all that moves at a wheel, with states of its own, is replaced in the same way by one that is linear in these
motions and states, and so is how fast its states grow. The factors are the mean slopes over motions and states that are
drawn from their joint normal distribution, which are the same as above (for Bouc-Wen: Y.-K. Wen, J. Appl. Mech. 47,
1980, 150).

Source: J. B. Roberts, P. D. Spanos, Random Vibration and Statistical Linearization (1990), chapters 2 and 5.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from functools import cache
from math import erf, exp, log, pi, sqrt
from typing import Any, Protocol

import numpy as np

from logger.arrays import Array, Complex
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.laws import Between, CornerLaws, MotionLaw, Seen, Stribeck
from logger.vehicle.linear_car import MOTIONS, CornerSlopes, LinearCar, LinearLaw, Waves
from logger.vehicle.stepping import static_tire_loads_n
from logger.vehicle.structure import Output
from logger.vehicle.vehicle import Vehicle

# Values of a normal variable at which laws are asked, and how likely each is; the one of two variables has fewer.
_REACH = 6.0
_POINTS, _POINTS_OF_TWO = 601, 61
_MOST_TURNS, _NEAR_ENOUGH = 60, 5e-3
_WAY = 0.5  # of each turn, so that friction does not swing between stuck and free
# From slopes that are nearly right the first turns go all the way. Of what a tenth more friction changes in the
# response two of them leave out 7 % on a road of class A and 3 % or less on rougher ones.
_WHOLE_TURNS = 2
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

    def at(self, speed_mps: float, wave_number_cpm: Array, psd_m3: Array, like: LinearCar | None = None) -> LinearCar:
        """The linear car at a speed [m/s] on a road of a spectrum (f,) [m3] at wave numbers (f,) [cycle/m], near one
        that is ``like`` it but for small changes."""
        ...


def known_vehicle(vehicle: Vehicle, effects: Sequence[Chosen] = ()) -> KnownCar:
    """A vehicle with its effects, likewise. ValueError as ``compose``."""
    return known_car(compose(vehicle, effects))


def known_car(car: Car) -> KnownCar:
    """A car with its effects as readings are judged by: exact if its laws are linear.

    ValueError for a law that is another one at another place or time, and for effects on the record in time.
    """
    if car.records:
        raise ValueError(f"{car.records[0].effect.name} acts on the record over time, so it cannot be linearised: "
                         "leave it out here")
    output = Output(car.row, np.zeros(len(car.structure.wheels)), 2)
    if not car.bends_laws:
        return LinearCar(car.structure, output, sensors=car.sensors)
    for law in (law for one in car.laws for law in one.motions):
        _check_steady(law)
    if is_linear(car):
        slopes = tuple(_linear_slopes(one) for one in car.laws)
        return LinearCar(car.structure, output, slopes, car.sensors)
    return MovedCar(car, output)


def is_linear(car: Car) -> bool:
    """Whether a car answers in proportion to the road; a damper is tested at some rates in both directions."""
    return not car.records and all(map(_is_linear, car.laws))


def _is_linear(one: CornerLaws) -> bool:
    rates = np.array([-2.0, -1.0, -0.1, 0.1, 1.0, 2.0])
    plain = not (one.springs or one.others or one.motions or one.tires or one.rubs) and one.tire_pulls
    return plain and bool(np.allclose(one.damper(rates), one.damping_n_s_per_m * rates, rtol=1e-9, atol=1e-9))


def _linear_slopes(one: CornerLaws) -> CornerSlopes:
    none = [LinearLaw(law.between, np.zeros(MOTIONS), np.zeros(len(law.memory)), np.zeros((len(law.memory), MOTIONS)),
                      np.zeros((len(law.memory), len(law.memory)))) for law in one.motions]
    return CornerSlopes(0.0, one.damping_n_s_per_m, one.mount_n_per_m, 0.0, 0.0, one.tire_damping_n_s_per_m,
                        motions=tuple(none))


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

    def at(self, speed_mps: float, wave_number_cpm: Array, psd_m3: Array, like: LinearCar | None = None) -> LinearCar:
        """The linear car at a speed [m/s] on a road of a spectrum (f,) [m3] at wave numbers (f,) [cycle/m], which are
        spaced evenly on a logarithmic scale. Of a car that is ``like`` another but for small changes two turns from
        that one's slopes are enough; else the search begins at those for the most similar road and speed."""
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
            is_like = like is not None and bool(like.corners)
            if not is_like and self._found:
                like = self._found[min(self._found, key=lambda one: int(np.abs(np.subtract(one, key)).sum()))]
            self._found[key] = linearised(self.car, self.output, exp(key[0] / _STEPS_PER_E), wave_number_cpm, rounded,
                                          () if like is None else like.corners,
                                          _WHOLE_TURNS if is_like else _MOST_TURNS)
        return self._found[key]


def linearised(car: Car, output: Output, speed_mps: float, wave_number_cpm: Array, psd_m3: Array,
               begin: Sequence[CornerSlopes] = (), most_turns: int = _MOST_TURNS) -> LinearCar:
    """The linear car that comes nearest to one on a random road at a steady speed.

    speed_mps                  [m/s]
    wave_number_cpm, psd_m3    (f,) of the road, evenly spaced on a logarithmic scale [cycle/m, m3]
    begin                      slopes to begin with, one per wheel; empty: those of the laws without what bends them
    most_turns                 after which it is left as it is
    """
    structure = car.structure
    power = psd_m3 * wave_number_cpm * log(wave_number_cpm[1] / wave_number_cpm[0])
    loads_n = static_tire_loads_n(structure)
    slopes = tuple(begin) or tuple(_linear_slopes(one) for one in car.laws)
    for turn in range(most_turns):
        way = 1.0 if begin and turn < _WHOLE_TURNS else _WAY
        tried = LinearCar(structure, output, slopes, car.sensors)
        moves = tried.waves(wave_number_cpm, speed_mps)
        s = np.asarray(2j * np.pi * wave_number_cpm * speed_mps)
        motions = np.stack([moves.travel, moves.rate, moves.own_rate, moves.deflection, moves.force,
                            s[:, None] * moves.height, s[:, None] * (moves.height + moves.travel)])
        deviations = np.sqrt(power @ np.abs(motions) ** 2)
        found = [_Corner(*deviations[:, i].tolist())
                 .slopes(laws, float(structure.springs[i]), float(loads_n[i]), slopes[i].rest_m,
                         [_linear_law(law, old, _motions(moves, s, i), s, power, slopes[i].rest_m)
                          for law, old in zip(laws.motions, slopes[i].motions, strict=True)])
                 for i, laws in enumerate(car.laws)]
        after = tuple(_between(old, new, way) for old, new in zip(slopes, found, strict=True))
        change = max(_change(old, new) for old, new in zip(slopes, after, strict=True))
        slopes = after
        if change < _NEAR_ENOUGH:
            break
    return LinearCar(structure, output, slopes, car.sensors)


def _between(old: CornerSlopes, new: CornerSlopes, way: float) -> CornerSlopes:
    """A share of the way from the one to the other."""
    numbers: dict[str, Any] = {}
    for one in _NUMBERS:
        before, after = getattr(old, one), getattr(new, one)
        numbers[one] = before if before == after else before + way * (after - before)
    motions = tuple(LinearLaw(before.between, *(a + way * (b - a) for a, b in zip(_arrays(before), _arrays(after),
                                                                            strict=True)))
                    for before, after in zip(old.motions, new.motions, strict=True))
    return CornerSlopes(**numbers, motions=motions)


def _change(old: CornerSlopes, new: CornerSlopes) -> float:
    pairs = [(getattr(old, one), getattr(new, one)) for one in _NUMBERS if one != "rest_m"]
    arrays = [(float(np.abs(b - a).max(initial=0.0)), float(np.abs(b).max(initial=0.0)))
              for before, after in zip(old.motions, new.motions, strict=True)
              for a, b in zip(_arrays(before), _arrays(after), strict=True)]
    return max(*(abs(after - before) / max(abs(after), abs(before)) if after != before else 0.0
                 for before, after in pairs), *(off / size for off, size in arrays if size > 0))


_NUMBERS = [one.name for one in fields(CornerSlopes) if one.name != "motions"]


def _arrays(law: LinearLaw) -> tuple[Array, Array, Array, Array]:
    return law.by, law.through, law.into, law.own


@dataclass(frozen=True)
class _Corner:
    """Standard deviations of what a corner does [m, m/s, m/s, m, N, m/s, m/s]."""

    travel_m: float
    rate_mps: float
    own_rate_mps: float
    deflection_m: float
    force_n: float
    wheel_mps: float
    body_mps: float

    def slopes(self, laws: CornerLaws, spring_n_per_m: float, load_n: float, rest_m: float,
               motions: Sequence[tuple[LinearLaw, float]]) -> CornerSlopes:
        """Slopes that stand in for its laws, with the mean travel to be tried next.

        motions    those for laws by all that moves, and what these pull on the average
        """
        travel, rate = max(self.travel_m, _LEAST_TRAVEL_M), max(self.rate_mps, _LEAST_RATE_MPS)
        own_rate = max(self.own_rate_mps, _LEAST_RATE_MPS)
        spring, pull = _sloped(sum((law(rest_m + travel * _NORMAL) for law in laws.springs), 0 * _NORMAL), travel)
        damper, drag = _sloped(laws.damper(own_rate * _NORMAL), own_rate)
        rubs = _rubs(laws.dry_friction_n, laws.friction_transition_mps, laws.stribeck, rate)
        if laws.others:
            x, v = np.meshgrid(_NORMAL_OF_TWO, _NORMAL_OF_TWO, indexing="ij")
            force = sum((law(rest_m + travel * x, rate * v) for law in laws.others), 0 * x)
            spring += float(_SHARE_OF_TWO @ (force * x) @ _SHARE_OF_TWO) / travel
            rubs += float(_SHARE_OF_TWO @ (force * v) @ _SHARE_OF_TWO) / rate
            pull += float(_SHARE_OF_TWO @ force @ _SHARE_OF_TWO)
        pressed = max(self.deflection_m, _LEAST_TRAVEL_M)
        tire, _ = _sloped(sum((law(pressed * _NORMAL) for law in laws.tires), 0 * _NORMAL), pressed)
        holds = 1.0 if laws.tire_pulls else 0.5 * (1 + erf(load_n / (sqrt(2.0) * self.force_n)))
        guide = laws.guide_transition_mps, laws.guide_stribeck
        unbalanced = spring_n_per_m * rest_m + pull + drag + sum(mean for _, mean in motions)
        return CornerSlopes(spring, damper, laws.mount_n_per_m, rubs, tire, laws.tire_damping_n_s_per_m, holds,
                            rest_m - unbalanced / (spring_n_per_m + max(spring, 0.0)),
                            _rubs(laws.wheel_friction_n, *guide, self.wheel_mps),
                            _rubs(laws.body_friction_n, *guide, self.body_mps),
                            tuple(law for law, _ in motions))


def _rubs(friction_n: float, transition_mps: float, stribeck: Stribeck, rate_mps: float) -> float:
    """Slope of a friction by a rate of this deviation."""
    if not friction_n:
        return 0.0
    rate = max(rate_mps, _LEAST_RATE_MPS)
    held = np.tanh(rate * _NORMAL / transition_mps) if transition_mps else np.sign(_NORMAL)
    return _sloped(friction_n * held * stribeck.times(rate * _NORMAL), rate)[0]


def _normal(points: int) -> tuple[Array, Array]:
    at = np.linspace(-_REACH, _REACH, points)
    share = np.exp(-0.5 * at**2) * (at[1] - at[0]) / sqrt(2 * pi)
    return at, share / (share @ at**2)


_NORMAL, _SHARE = _normal(_POINTS)
_NORMAL_OF_TWO, _SHARE_OF_TWO = _normal(_POINTS_OF_TWO)


def _sloped(force: Array, deviation: float) -> tuple[float, float]:
    """Slope and mean of a force (p,) at the values of a normal variable of this deviation."""
    return float(_SHARE @ (force * _NORMAL)) / deviation, float(_SHARE @ force)


# --- laws by all that moves ---

_DRAWN = 2048  # motions that such a law is asked at, half of them the others turned over
# Means are moved by so much of a deviation to see their slope: far enough for a law that jumps. A law is smoothed by
# it as by a motion whose variance is 1 / 50 larger.
_SLOPE_OVER, _LEAST_STEP = 0.25, 1e-9
_ELSEWHERE = (123.4, 56.7, 8.9, 1.0)  # m, s, m/s, run


def _check_steady(law: MotionLaw) -> None:
    """ValueError for a law that is another one at another place or time."""
    motions, memory = 0.1 * _normals(MOTIONS + 1).T, tuple(np.full(_DRAWN, one) for one in law.memory)
    for asked in (one for one in (law.force, law.rates) if one is not None):
        here, there = (asked(law.p, Seen._make([*motions, *at, memory])) for at in ((0.0,) * 4, _ELSEWHERE))
        if not np.array_equal(here, there):
            raise ValueError("a force that depends on the place or the time cannot be linearised: leave its effect out "
                             "here")


def _motions(moves: Waves, s: Complex, i: int) -> Complex:
    """What a ``LinearLaw`` at wheel i sees, per elevation of the road (f, MOTIONS)."""
    travel, deflection, height = moves.travel[:, i], moves.deflection[:, i], moves.height[:, i]
    return np.stack([travel, s * travel, deflection, s * deflection, s * height], axis=1)


def _linear_law(law: MotionLaw, old: LinearLaw, motions: Complex, s: Complex,
                power: Array, rest_m: float) -> tuple[LinearLaw, float]:
    """What stands in for a law where its corner moves like this and its states as the old stand-in has them; and what
    it pulls at the suspension on the average [N]."""
    states = (old.states(s) @ motions[..., None])[..., 0]
    seen = np.concatenate([motions, states], axis=1) * np.sqrt(power)[:, None]
    sizes, ways = np.linalg.eigh((seen.conj().T @ seen).real)
    drawn = _normals(seen.shape[1]) * np.sqrt(np.maximum(sizes, 0.0)) @ ways.T
    at = drawn + np.array([rest_m, *[0.0] * (MOTIONS - 1), *law.memory])
    steps = np.diag(np.maximum(_SLOPE_OVER * drawn.std(axis=0), _LEAST_STEP))
    slopes = np.stack([(_means(law, at + step) - _means(law, at - step)) / (2 * step.sum()) for step in steps], axis=1)
    pulls = law.between is not Between.WHEEL_AND_GROUND
    return (LinearLaw(law.between, slopes[0, :MOTIONS], slopes[0, MOTIONS:], slopes[1:, :MOTIONS],
                      slopes[1:, MOTIONS:]), float(_means(law, at)[0]) if pulls else 0.0)


def _means(law: MotionLaw, at: Array) -> Array:
    """The mean force, and how fast the states grow on the average (1 + m,), at motions and states (_DRAWN, ...)."""
    felt = Seen._make([*at[:, :MOTIONS].T, at[:, 1] + at[:, MOTIONS - 1], *[0.0] * 4, tuple(at[:, MOTIONS:].T)])
    growing = () if law.rates is None else law.rates(law.p, felt)
    return np.array([np.mean(one) for one in (law.force(law.p, felt), *growing)])


@cache
def _normals(count: int) -> Array:
    """Evenly scattered values (_DRAWN, count) of independent normal variables: points of the additive recurrence of R.
    Kronecker through the transform of Box and Muller, each with its opposite, made uncorrelated."""
    pairs = -(-count // 2)
    root = 2.0
    for _ in range(60):
        root = (1.0 + root) ** (1.0 / (2 * pairs + 1))
    even = (0.5 + np.arange(1, _DRAWN // 2 + 1)[:, None] * root ** -np.arange(1.0, 2 * pairs + 1)) % 1.0
    radius, turn = np.sqrt(-2.0 * np.log(1.0 - even[:, :pairs])), 2.0 * pi * even[:, pairs:]
    half = np.concatenate([radius * np.cos(turn), radius * np.sin(turn)], axis=1)[:, :count]
    drawn = np.concatenate([half, -half])
    return np.asarray(np.linalg.solve(np.linalg.cholesky(np.cov(drawn.T, bias=True)), drawn.T).T)
