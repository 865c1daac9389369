"""A car's numbers out of drives over roads that nobody measured.

Problem: the road is not known, its level changes from block to block and its waviness from road to road; what the
sensor reads is their product with the car's gain. But the road's spectrum is a power of the wave number, the car's gain
is a function of the frequency, and the wheelbase writes its interference over both: at several speeds they come apart.

Solution: the power of each band of each block (``estimation.drive_spectra``) is exponential about what car, road and
noise let expect (P. Whittle, Journal of the Royal Statistical Society B 15, 1953). The car's coordinates have the prior
of published cars; each block has a level and a waviness of its own, about that of its drive, which has a prior too.
All are found together by Fisher scoring; blocks and drives are eliminated one by one (Schur complements), so that an
hour of driving is a hundred thousand numbers and a system of fourteen.

The response is the half car's (``vehicle.linear_car``); the speed's spread within a block and the receiver's error fade
the interference between the axles.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from math import exp, pi, sqrt
from statistics import NormalDist

import numpy as np

from logger.arrays import AT_ONCE, Array, Complex
from logger.estimation.car_response import HIGHEST_HZ, WAVE_NUMBER_STEPS_CPM, WAVE_NUMBERS_CPM, golden_car_slope
from logger.estimation.drive_spectra import INDEPENDENT, DriveSpectra, counts, expected, grid_hz, middles_hz
from logger.estimation.road_spectrum import PIVOT_CPM
from logger.vehicle.linear_car import LinearCar, dynamic_stiffness
from logger.vehicle.published_cars import NUMBERS, CarPrior, car_of, published_prior, share_of
from logger.vehicle.vehicle import SensorPlace, Vehicle

WAVINESS, WAVINESS_APART, WAVINESS_WITHIN = 2.0, 0.3, 0.2
"""Of roads: mean, deviation from drive to drive, and from block to block within one. ISO 8608 has 2 for all; the
deviations are a judgement (O. Kropac and P. Mucka, International Journal of Vehicle Design 46, 2008, have the waviness
of 25,800 American profiles). A drive is one draw, however long it is: counted anew every five minutes, the roads of
four simulated drives of 15 min said more of a car than they knew (8 cars: IRI 4.7 % off at 70 mph instead of 3.7 %, at
a stated 2.5 %)."""
# Of the logarithm of Gd(0.2 cycle/m) [m3]: as good as flat, for hundreds of blocks would make of it a car's gain.
_LEVEL, _LEVEL_APART = np.log(8e-7), 30.0
_NOISE_APART = 1.0  # of the logarithm of what the readings hold besides: half to four times the power that is known
_LEAST_NOISE = 2 * 0.02**2 / 100  # m2/s4 per Hz: of a sensor of which nothing is known, 0.02 m/s2 at 100 Hz
_RECEIVER_MPS = 0.05  # standard error of its mean speed over a block (0.1 m/s a fix, by the Doppler shift)
_SPEED_STEP = 0.02  # of speeds that count as one, as a share
_SPEEDS_APART = 0.2  # of the logarithm: between, what uneven dampers add is a straight line (to 4 % below 7 m/s)
_STEP = 1e-4  # of differences that derivatives are taken by
_MOST_ROUNDS, _MOST_HALVINGS, _MOST_INNER, _SMALL_GAIN, _SMALL_MOVE = 60, 8, 12, 1e-3, 1e-4
_NEIGHBOURS = 10  # blocks: 20 s
_HOPS_APART = 0.15  # of the logarithm
_ALIKE = 0.1  # of logarithms of evidence: a search stops where a round gains less than a hundredth of it
_LONGEST_STEP = 0.3  # of a coordinate in a round
_HOLE_M = 0.75
"""Length of a pothole: 0.15 to 1 m and more across (J. Miller and W. Bellinger, Distress Identification Manual,
FHWA-RD-03-031, 2003, counts those of 0.15 m and more)."""
_HOLE_SIGMA, _SIEVES = 1.5, 2
"""Standard errors: of blocks without any, one in 15 is left out by chance. In 16 simulated cars on roads with 2.5 holes
a kilometre the mean bias of an IRI fell from 2.7 to 2.0 % at 10 mph and from 1.4 to 0.7 % at 70 mph; 2.5 changed
nothing."""

EXTRA = ("wheelbase_m", "sensor.ahead_m", "dampers.unevenness", "noise")
"""Coordinates behind those of ``NUMBERS``: logarithm, length [m], logarithm of the difference of a damper's slopes in
rebound and compression over their sum, logarithm of the noise over what is known of it."""
_UNEVENNESS = np.log(0.1), 1.0
"""Mean and standard deviation of the logarithm; two of these apart are ratios of 1.03 and 7. Usual ones are 2 to 3
(J. C. Dixon, The Shock Absorber Handbook, 2007, chapter 1). What it adds to a spectrum grows with its square, which
vanishes where drives show none; without the logarithm so did the derivative, and searches stalled."""
COORDINATES = (*NUMBERS, *EXTRA)
_UNEVEN_AT = COORDINATES.index("dampers.unevenness")


@dataclass(frozen=True)
class CarKnowledge:
    """What is known of a car and its sensor, and how well.

    wheelbase_m, wheelbase_std    and its standard error, as a share
    ahead_m, ahead_std_m          of the sensor before the middle between the axles, which a person can find; None: it
                                  is near the centre of gravity
    waviness_within               of the roads: standard deviation from block to block of a drive
    prior                         of the rest
    """

    wheelbase_m: float
    wheelbase_std: float = 0.01
    ahead_m: float | None = None
    ahead_std_m: float = 0.2
    waviness_within: float = WAVINESS_WITHIN
    prior: CarPrior = field(default_factory=published_prior)

    @cached_property
    def mean(self) -> Array:
        """Of all coordinates (p,)."""
        share = share_of(self.prior.mean[NUMBERS.index("rear_share")])
        ahead_m = (0.5 - share) * self.wheelbase_m if self.ahead_m is None else self.ahead_m
        return np.concatenate([self.prior.mean, [np.log(self.wheelbase_m), ahead_m, _UNEVENNESS[0], 0.0]])

    @cached_property
    def precision(self) -> Array:
        """Of all coordinates (p, p)."""
        own, whole = len(NUMBERS), np.zeros((len(NUMBERS) + len(EXTRA),) * 2)
        whole[:own, :own] = np.linalg.inv(self.prior.covariance)
        whole[own:, own:] = np.diag([
            self.wheelbase_std**-2, self.ahead_std_m**-2, _UNEVENNESS[1]**-2, _NOISE_APART**-2])
        return whole

    @cached_property
    def covariance(self) -> Array:
        """Of all coordinates (p, p)."""
        return np.asarray(np.linalg.inv(self.precision))

    @property
    def std(self) -> Array:
        """Standard deviations of all coordinates (p,)."""
        return np.sqrt(np.diag(self.covariance))

    def car(self, x: Array, sprung_mass_kg: float, name: str) -> Vehicle:
        """The half car with these coordinates (p,), its sensor where it sits."""
        own, wheelbase_m = len(NUMBERS), float(np.exp(x[len(NUMBERS)]))
        share = share_of(x[NUMBERS.index("rear_share")])
        sensor = SensorPlace(float(x[own + 1] + (share - 0.5) * wheelbase_m))
        return car_of(x[:own], wheelbase_m, sprung_mass_kg, sensor, name)


def interference(n_cpm: Array, spread: Array, behind_m: float) -> tuple[Array, Array]:
    """What real and imaginary part of the product of both axles' gains count for at wave numbers (s, f): twice the
    cosine and the sine of the rear one's delay, fading as speeds have a standard deviation of a share ``spread``."""
    turn = 2 * np.pi * n_cpm * behind_m
    fading = 2 * np.exp(-0.5 * (turn * spread[:, None]) ** 2)
    return fading * np.cos(turn), fading * np.sin(turn)


def road_under(n_cpm: Array, speed_mps: Array, contact_patch_m: float) -> Array:
    """Spectrum over time (s, f) of what the patch makes of a road of waviness 2 and level 1 [1/Hz per m3]."""
    return np.asarray(np.sinc(n_cpm * contact_patch_m) ** 2 * (n_cpm / PIVOT_CPM) ** -WAVINESS / speed_mps[:, None])


def _products(of_axles: Complex) -> Complex:
    """Squares of two signals (2, ...) and the first times the conjugate of the second (3, ...)."""
    return np.asarray(of_axles[[0, 1, 0]] * of_axles[[0, 1, 1]].conj())


def sizes(spectra: Complex) -> Complex:
    """Spectra and cross-spectrum (3, ..., f) of |v| of two Gaussian signals v that have these, at frequencies that are
    multiples of the first.

    A damper with slopes c (1 + u) in rebound and c (1 - u) in compression is an even one and a force u c |v|. Where v
    have deviations s and t and a correlation r the covariance of |v| is s t (2 / pi) (sqrt(1 - r2) + r asin r - 1)
    (A. Papoulis, Probability, Random Variables, and Stochastic Processes, 3rd ed., 1991, 10.3), of which r2 / 2 and
    r4 / 24, the first terms of the series in brackets, are 95 % and more. Wheels hop in a narrow band, so that it lies
    at twice their hop and near zero.
    """
    # Three times the frequencies that there are, so that squares do not fold back on them; of factors 2 and 3, which
    # transforms are quick with.
    fine = -(-3 * spectra.shape[-1] // 288) * 288
    covariance = np.fft.irfft(np.insert(spectra, 0, 0.0, axis=-1), fine)
    one, other = covariance[:2, ..., :1]
    scale = np.stack([one * one, other * other, one * other])
    square = covariance**2 / scale
    of_sizes = np.sqrt(scale) / np.pi * square * (1 + square / 12)
    return np.asarray(np.fft.rfft(of_sizes)[..., 1:spectra.shape[-1] + 1])


@dataclass(eq=False)
class BlockRoads:
    """What the drives' roads are: logarithm of the level and the waviness's difference of each block (b,), and of each
    drive (t,)."""

    level: Array
    own: Array
    drive: Array


@dataclass(frozen=True, eq=False)
class LearnedCar:
    """Coordinates (p,) with their covariance (p, p); the roads; and the logarithm of the drives' evidence, with car and
    roads integrated out (Laplace), up to a constant of the drives."""

    knowledge: CarKnowledge
    x: Array
    covariance: Array
    roads: BlockRoads
    log_evidence: float
    is_converged: bool

    @property
    def std(self) -> Array:
        """Standard errors (p,)."""
        return np.sqrt(np.diag(self.covariance))


class UnknownCar:
    """The problem: blocks of drives, and what is known before."""

    def __init__(self, spectra: DriveSpectra, knowledge: CarKnowledge) -> None:
        self.spectra, self.knowledge = spectra, knowledge
        key = np.round(np.log(spectra.speed_mps) / _SPEED_STEP).astype(int)
        _, self.speed = np.unique(key, return_inverse=True)
        each = np.bincount(self.speed)
        self.speed_mps = np.bincount(self.speed, spectra.speed_mps) / each
        within = np.bincount(self.speed, (spectra.speed_mps / self.speed_mps[self.speed] - 1) ** 2) / each
        self.spread = np.sqrt(np.bincount(self.speed, spectra.spread**2) / each + within
                              + (_RECEIVER_MPS / self.speed_mps) ** 2)
        self.slope = -np.log(middles_hz() / spectra.speed_mps[:, None] / PIVOT_CPM)
        seen = np.isfinite(spectra.power)
        self.weight = np.where(seen, INDEPENDENT * counts(), 0.0)
        self.power = np.where(seen, spectra.power, 1.0)
        self.noise = np.where(np.isfinite(spectra.noise), np.maximum(spectra.noise, _LEAST_NOISE), _LEAST_NOISE)
        self.drives = int(spectra.drive.max(initial=-1)) + 1
        self.road_precision = np.array([_LEVEL_APART**-2, knowledge.waviness_within**-2])  # of blocks
        n_cpm = grid_hz() / self.speed_mps[:, None]
        # All but one of the derivatives are at the same wheelbase, and at the same patch.
        self._interference = lru_cache(2)(partial(interference, n_cpm, self.spread))
        self._road_under = lru_cache(2)(partial(road_under, n_cpm, self.speed_mps))
        low, high = self.speed_mps.min(initial=np.inf), self.speed_mps.max(initial=0.0)
        few_mps = np.geomspace(low, high, 2 + int(np.log(high / low) / _SPEEDS_APART)) if high > low else self.speed_mps
        self._between = np.array([np.interp(self.speed_mps, few_mps, one) for one in np.eye(len(few_mps))]).T
        self._road_of_few = lru_cache(2)(partial(road_under, grid_hz() / few_mps[:, None], few_mps))
        self._gains = lru_cache(1)(self._gains_of)  # roads, blocks and a step ask in turn for those of one car

    def gains(self, x: Array) -> Array:
        """Expected power of each band (s, k) per level Gd(0.2 cycle/m) of a road of waviness 2, at the drives' speeds.
        """
        return self._gains(tuple(x))

    def _gains_of(self, coordinates: tuple[float, ...]) -> Array:
        x = np.array(coordinates)
        car = LinearCar.of(self.knowledge.car(x, 1.0, ""))
        at: Complex = np.asarray(2j * np.pi * grid_hz())
        structure, output = car.structure, car.output
        wheels = len(structure.dampers)
        pushed = np.hstack([structure.road, -np.exp(x[_UNEVEN_AT]) * structure.dampers * structure.travel.T])
        moved = np.linalg.solve(  # by elevations under the wheels, and by |rates| of the suspensions
            dynamic_stiffness(structure.mass, structure.damping, structure.stiffness, at), pushed.astype(complex))
        read = at**output.order * (output.row @ moved).T[:, None]
        rates = at * np.einsum("wn,fnw->wf", structure.travel, moved[..., :wheels])[:, None]
        of_sizes = sizes(_products(rates) * self._road_of_few(structure.contact_patch_m))
        even, odd = self._interference(float(structure.behind_m.max()))

        def parts(front: Complex, rear: Complex, across: Complex) -> Array:
            return np.stack([front.real + rear.real, across.real, across.imag])

        own, real, imaginary = (self._road_under(structure.contact_patch_m) * parts(*_products(read[:wheels]))
                                + self._between @ parts(*_products(read[wheels:]) * of_sizes))
        return np.asarray((own + even * real - odd * imaginary) @ expected().T)

    def expected_power(self, x: Array, roads: BlockRoads) -> tuple[Array, Array]:
        """Of the road and of the noise, (b, k) and (b, 1)."""
        waviness = roads.own + roads.drive[self.spectra.drive]
        road = self.gains(x)[self.speed] * np.exp(roads.level[:, None] + waviness[:, None] * self.slope)
        return road, self.noise[:, None] * np.exp(x[-1])

    def with_blocks(self, x: Array, roads: BlockRoads) -> tuple[BlockRoads, float]:
        """The same drives with the most probable level and waviness of each block; and the logarithm of the
        posterior density there, its score made right in the mean, up to a constant.

        Problem: level and waviness follow from the few values of a block, which moves the score of the car. Integrated
        out (Laplace) it is right without noise only: simulated drives with a BMA220 showed a contact patch that was 8 %
        too long, and 2.6 % too much noise. Solution: to second order the score's mean is -1/2 of the sum of w v s d (w:
        weight of a value, s: the road's share of what is expected, v: variance of the logarithm of the road's power as
        found, d: derivative of the logarithm of what is expected). What has that derivative is taken off (P. McCullagh
        and R. Tibshirani, Journal of the Royal Statistical Society B 52, 1990): of three determinants that are alike in
        the mean.
        """
        gains = self.gains(x)[self.speed]
        noise = self.noise[:, None] * np.exp(x[-1])
        level, own, own_slope = roads.level, roads.own, self.slope

        def road_power() -> Array:
            return gains * np.exp(level[:, None] + (own + roads.drive[self.spectra.drive])[:, None] * own_slope)

        for _ in range(_MOST_INNER):
            road = road_power()
            whole = road + noise
            share, ratio = road / whole, self.power / whole
            residual = self.weight * (ratio - 1) * share
            bent = self.weight * share**2
            move = _solved(_moments(bent, own_slope, self.road_precision), np.stack([
                residual.sum(axis=1) - (level - _LEVEL) * self.road_precision[0],
                (residual * own_slope).sum(axis=1) - own * self.road_precision[1]], axis=1))
            move = np.clip(move, -1.5, 1.5)
            level, own = level + move[:, 0], own + move[:, 1]
            if np.abs(move).max(initial=0.0) < _SMALL_MOVE:
                break
        found, road = BlockRoads(level, own, roads.drive), road_power()
        whole = road + noise
        share, ratio = road / whole, self.power / whole
        bent, first, second = (_determinant(_moments(self.weight * share * one, own_slope, self.road_precision))
                               for one in (share, share * ratio, 1 - share - ratio * (1 - 2 * share)))
        volume = np.log(first**2 / (bent * np.maximum(second, 0.1 * bent))).sum()
        off = x - self.knowledge.mean
        value = (-(self.weight * (np.log(whole) + ratio)).sum() - 0.5 * volume - 0.5 * (
            off @ self.knowledge.precision @ off + self.road_precision[0] * ((level - _LEVEL) ** 2).sum()
            + self.road_precision[1] * (own**2).sum() + (roads.drive**2).sum() / WAVINESS_APART**2))
        return found, float(value)

    def start(self, x: Array) -> BlockRoads:
        """Roads that are about right for a car: their levels by the mean power."""
        gains = self.gains(x)[self.speed]
        ratio = (self.weight * self.power / gains).sum(axis=1) / self.weight.sum(axis=1)
        return BlockRoads(np.log(np.maximum(ratio, 1e-12)), np.zeros(len(self.spectra)), np.zeros(self.drives))

    def fit(self) -> LearnedCar:
        """The most probable car and drives, blocks integrated out: the best of searches that begin with front or
        rear wheels that hop faster, and with equal ones."""
        turned = np.zeros(len(self.knowledge.mean))
        turned[[NUMBERS.index(f"{end}.hop_hz") for end in ("front", "rear")]] = 0.5 * _HOPS_APART, -0.5 * _HOPS_APART
        return self.fit_of([self.knowledge.mean + sign * turned for sign in (1, -1, 0)])

    def fit_of(self, starts: Sequence[Array]) -> LearnedCar:
        """The same, the best of searches from these starts; where the first two end alike, of those."""
        first, *others = starts
        best = self.fit_from(first)
        for start in others:
            found = self.fit_from(start)
            if abs(found.log_evidence - best.log_evidence) < _ALIKE:
                break
            best = max(best, found, key=lambda one: one.log_evidence)
        return best

    def fit_from(self, start: Array) -> LearnedCar:
        """The same from one start."""
        x = start.copy()
        roads, value = self.with_blocks(x, self.start(x))
        damping, converged = 1e-3, False
        step = _Step(self, x, roads)
        for _ in range(_MOST_ROUNDS):
            for _ in range(_MOST_HALVINGS):
                tried, moved = step.taken(damping)
                tried_roads, new = self.with_blocks(tried, moved)
                if new >= value:
                    break
                damping = max(6 * damping, 1e-3)
            else:
                converged = True
                break
            gain, value, x, roads, damping = new - value, new, tried, tried_roads, damping / 6
            step = _Step(self, x, roads)
            if gain < _SMALL_GAIN:
                converged = True
                break
        known = 0.5 * float(np.linalg.slogdet(self.knowledge.precision)[1]) - self.drives * np.log(WAVINESS_APART)
        return LearnedCar(self.knowledge, x, step.covariance, roads, value + known + step.log_volume, converged)

    def sieved(self, x: Array) -> DriveSpectra:
        """The blocks in whose spectrum a car with these coordinates shows no pothole, joint or kerb.

        Problem: a road of random waves has a spectrum that is a power of the wave number; a short hole adds one that is
        flat up to its own length, which reads as a car of another damping. Solution: the score test for such a part
        beside the block's level and waviness (C. R. Rao, Mathematical Proceedings of the Cambridge Philosophical
        Society 44, 1948). What passes has less power than the road, as chance alone takes one block in 15: the mean of
        what a normal variable loses above ``_HOLE_SIGMA`` is given back.
        """
        roads, _ = self.with_blocks(x, self.start(x))
        road, noise = self.expected_power(x, roads)
        whole = road + noise
        waves = middles_hz() / self.spectra.speed_mps[:, None]
        hole = self.gains(x)[self.speed] * (waves / PIVOT_CPM) ** WAVINESS * _hole_power(waves * _HOLE_M) / whole
        share = road / whole
        coupling = np.stack([(self.weight * share * hole).sum(axis=1),
                             (self.weight * share * hole * self.slope).sum(axis=1)], axis=1)
        taken = _solved(_moments(self.weight * share**2, self.slope, self.road_precision), coupling)
        rest = hole - share * (taken[:, :1] + taken[:, 1:] * self.slope)
        score = (self.weight * (self.power / whole - 1) * rest).sum(axis=1)
        deviation = np.sqrt((self.weight * rest * hole).sum(axis=1))
        lost = exp(-_HOLE_SIGMA**2 / 2) / sqrt(2 * pi) / NormalDist().cdf(_HOLE_SIGMA) / deviation
        power = self.spectra.power + whole * rest * lost[:, None]
        return replace(self.spectra, power=power).part(score <= _HOLE_SIGMA * deviation)

    def by_motion(self, car: LearnedCar, over: Array) -> tuple[tuple[LearnedCar, LearnedCar], float]:
        """The car of the blocks in which its suspensions move faster (``motion``) than ``over`` (b,), that of the
        others, and the logarithm of how many times likelier one car is than these two (a linear one is)."""
        fast = self.motion(car) > over
        one, other = (UnknownCar(self.spectra.part(half), self.knowledge).fit_from(car.x) for half in (fast, ~fast))
        return (one, other), car.log_evidence - one.log_evidence - other.log_evidence

    def motion(self, car: LearnedCar) -> Array:
        """How fast the suspensions move in each block (b,), up to a factor of the car: root of level times speed."""
        return np.asarray(np.sqrt(np.exp(car.roads.level) * self.spectra.speed_mps))

    def learn(self) -> "tuple[UnknownCar, LearnedCar]":
        """The car, and the problem without the blocks that are impulsive with it: which those are follows from the car,
        so that it is found again."""
        problem, car = self, self.fit()
        for _ in range(_SIEVES):
            knowledge = replace(self.knowledge, waviness_within=problem.waviness_within(car))
            problem = UnknownCar(UnknownCar(self.spectra, knowledge).sieved(car.x), knowledge)
            car = problem.fit_from(car.x)
        return problem, car

    def waviness_within(self, car: LearnedCar) -> float:
        """Standard deviation of the waviness from block to block of a drive, by the method of moments (R. DerSimonian
        and N. Laird, Controlled Clinical Trials 7, 1986), and no less than its own error. One that is too large expects
        more power of long and of short waves than there is: the mean of exponentials is above that of the mean. No more
        than is known before: readings of another axis would pass for roads that change."""
        road, noise = self.expected_power(car.x, car.roads)
        moments = _moments(self.weight * (road / (road + noise)) ** 2, self.slope, np.zeros(2))
        known = moments[2] - moments[1] ** 2 / moments[0]
        squares = ((car.roads.own * (known + self.road_precision[1])) ** 2 / known).sum()
        found = np.sqrt(max(squares - len(known), np.sqrt(2 * len(known))) / known.sum())
        return min(float(found), WAVINESS_WITHIN) if len(known) else WAVINESS_WITHIN


def _hole_power(lengths: Array) -> Array:
    """Spectrum of a hole of the shape of a raised cosine, 1 for long waves; ``lengths``: its length in waves."""
    return np.asarray((np.sinc(lengths) + 0.5 * np.sinc(lengths - 1) + 0.5 * np.sinc(lengths + 1)) ** 2)


def _moments(weight: Array, slope: Array, precision: Array) -> Array:
    """Sums of 1, slope and its square under weights (b, k), with what is known before: (3, b)."""
    first = weight * slope
    return np.stack([weight.sum(axis=1) + precision[0], first.sum(axis=1), (first * slope).sum(axis=1) + precision[1]])


def _determinant(moments: Array) -> Array:
    return np.asarray(moments[0] * moments[2] - moments[1] ** 2)


def _solved(moments: Array, right: Array) -> Array:
    """Solutions (b, 2, ...) of symmetric systems of two, right sides (b, 2, ...)."""
    shape = (-1, *[1] * (right.ndim - 2))
    one, both, two = (moment.reshape(shape) for moment in moments)
    determinant = one * two - both**2
    return np.stack([(two * right[:, 0] - both * right[:, 1]) / determinant,
                     (one * right[:, 1] - both * right[:, 0]) / determinant], axis=1)


class _Step:
    """Score and information of car and drives where the blocks are at their most probable."""

    def __init__(self, problem: UnknownCar, x: Array, roads: BlockRoads) -> None:
        self._x, self._roads, self._problem = x, roads, problem
        gains = problem.gains(x)
        slopes = np.zeros((*gains.shape, len(x)))
        for one, step in enumerate(_STEP * np.eye(len(x))[:-1]):
            slopes[..., one] = np.log(problem.gains(x + step) / gains) / _STEP
        count, drives = len(problem.spectra), problem.drives
        self._outer = np.zeros((drives, len(x) + 1, len(x) + 1))
        self._score = np.zeros((drives, len(x) + 1))
        self._eliminated = np.empty((count, 2, len(x) + 1))
        self.block_scores = np.empty((count, len(x) + 1))
        for low in range(0, count, AT_ONCE):
            self._take(slice(low, low + AT_ONCE), gains, slopes)

    def _take(self, part: slice, gains: Array, slopes: Array) -> None:
        """Blocks are eliminated: of each the score and the information of its drive's waviness and the car."""
        problem, roads, x = self._problem, self._roads, self._x
        speed, drive = problem.speed[part], problem.spectra.drive[part]
        weight, slope = problem.weight[part], problem.slope[part]
        waviness = (roads.own + roads.drive[problem.spectra.drive])[part]
        road = gains[speed] * np.exp(roads.level[part, None] + waviness[:, None] * slope)
        noise = problem.noise[part, None] * np.exp(x[-1])
        share, ratio = road / (road + noise), problem.power[part] / (road + noise)
        outer = np.empty((*share.shape, len(x) + 1))       # derivatives of the logarithm of what is expected
        outer[..., 0] = share * slope
        outer[..., 1:-1] = share[..., None] * slopes[speed][..., :-1]
        outer[..., -1] = 1 - share
        weighted = outer * (weight * share)[..., None]
        moments = _moments(weight * share**2, slope, problem.road_precision)
        coupling = np.stack([weighted.sum(axis=1), np.einsum("bkj,bk->bj", weighted, slope)], axis=1)
        eliminated = _solved(moments, coupling)
        first = _solved(moments, np.stack([np.ones_like(slope), slope], axis=1))  # what ``with_blocks`` puts right
        lost = 0.5 * weight * share * (first[:, 0] + slope * first[:, 1])
        by_road, by_noise = lost * share, lost * (1 - share)
        residual = weight * (ratio - 1)
        gradient = np.einsum("bkj,bk->bj", outer, residual)
        own = by_road.sum(axis=1), (by_road * slope).sum(axis=1)
        gradient[:, 0] += own[1]
        gradient[:, 1:-1] += np.einsum("bk,bkj->bj", by_road, slopes[speed][..., :-1])
        gradient[:, -1] += by_noise.sum(axis=1)
        gradient -= eliminated[:, 0] * own[0][:, None] + eliminated[:, 1] * own[1][:, None]
        # the blocks' own scores are zero but for what is known before of them
        known = np.stack([(roads.level[part] - _LEVEL), roads.own[part]], axis=1) * problem.road_precision
        at_mode = np.stack([(residual * share).sum(axis=1), (residual * share * slope).sum(axis=1)], axis=1) - known
        gradient -= np.einsum("bij,bi->bj", eliminated, at_mode)
        self.block_scores[part], self._eliminated[part] = gradient, eliminated
        unshared = outer * np.sqrt(weight)[..., None]
        for one in np.unique(drive):
            rows = drive == one
            columns = unshared[rows].reshape(-1, outer.shape[-1])
            self._outer[one] += columns.T @ columns - np.einsum("bij,bik->jk", coupling[rows], eliminated[rows])
            self._score[one] += gradient[rows].sum(axis=0)

    @cached_property
    def _of_drives(self) -> tuple[Array, Array]:
        """Information and score of the waviness of each drive (t,)."""
        return (self._outer[:, 0, 0] + WAVINESS_APART**-2, self._score[:, 0] - self._roads.drive * WAVINESS_APART**-2)

    @cached_property
    def system(self) -> tuple[Array, Array]:
        """Information (p, p) and score (p,) of the car, its prior in them."""
        own, own_score = self._of_drives
        across = self._outer[:, 0, 1:]
        known = self._problem.knowledge
        information = self._outer[:, 1:, 1:].sum(axis=0) - across.T @ (across / own[:, None]) + known.precision
        score = self._score[:, 1:].sum(axis=0) - across.T @ (own_score / own) - known.precision @ (self._x - known.mean)
        return information, score

    @property
    def covariance(self) -> Array:
        """Of the car's coordinates (p, p).

        Potholes and levels that change within a block make scores vary more than the model lets them: their own spread
        counts where it is larger (P. Huber, Fifth Berkeley Symposium 1, 1967), by groups of neighbouring blocks.
        """
        inverse = np.linalg.inv(self.system[0])
        own, _ = self._of_drives
        share = self._outer[:, 0, 1:] / own[:, None]
        scores = self.block_scores[:, 1:] - self.block_scores[:, :1] * share[self._problem.spectra.drive]
        groups = np.add.reduceat(scores, np.arange(0, len(scores), _NEIGHBOURS), axis=0)
        groups = groups - groups.mean(axis=0)
        spread = inverse @ (groups.T @ groups + self._problem.knowledge.precision) @ inverse
        wider = np.sqrt(np.maximum(np.diag(spread) / np.diag(inverse), 1.0))
        return np.asarray(inverse * np.outer(wider, wider))

    @property
    def log_volume(self) -> float:
        """Half the logarithm of the determinant of the covariance of drives and car."""
        return float(-0.5 * (np.log(self._of_drives[0]).sum() + np.linalg.slogdet(self.system[0])[1]))

    def taken(self, damping: float) -> tuple[Array, BlockRoads]:
        """Car and roads after a step."""
        information, score = self.system
        move = np.linalg.solve(information + damping * np.diag(np.diag(information)), score)
        move *= min(1.0, _LONGEST_STEP / max(float(np.abs(move).max()), 1e-12))
        own, own_score = self._of_drives
        drive = (own_score - self._outer[:, 0, 1:] @ move) / own
        drive *= min(1.0, 1.0 / max(float(np.abs(drive).max(initial=0.0)), 1e-12))
        roads = self._roads
        both = np.concatenate([drive[self._problem.spectra.drive][:, None],
                               np.broadcast_to(move, (len(roads.level), len(move)))], axis=1)
        blocks = -np.einsum("bij,bj->bi", self._eliminated, both)
        return self._x + move, BlockRoads(roads.level + blocks[:, 0], roads.own + blocks[:, 1], roads.drive + drive)


def misfit(problem: UnknownCar, x: Array) -> float:
    """How far a car with coordinates (p,) is from the spectra, each block at its most probable level and waviness: the
    deviation of the mean power of each band and third of the speeds from what is expected, in standard deviations of
    chance (root mean square). A car that is right has 1."""
    apart = float(np.hypot(WAVINESS_APART, problem.knowledge.waviness_within))  # no drive's own is known here
    problem = UnknownCar(problem.spectra, replace(problem.knowledge, waviness_within=apart))
    roads, _ = problem.with_blocks(x, problem.start(x))
    road, noise = problem.expected_power(x, roads)
    speeds = problem.spectra.speed_mps
    group = np.searchsorted(np.quantile(speeds, (1 / 3, 2 / 3)), speeds)
    off, weight = (np.array([one[group == each].sum(axis=0) for each in range(3)]) for one in (
        problem.weight * (problem.power / (road + noise) - 1), problem.weight))
    return float(np.sqrt(np.mean(off[weight > 0] ** 2 / weight[weight > 0])))


def iri_errors(knowledge: CarKnowledge, x: Array, covariance: Array, speeds_mps: Sequence[float], noise: float,
               level: float) -> Array:
    """Standard error of an IRI, as a share of it, at speeds (v,) where a car is estimated with coordinates (p,) that
    have this covariance (p, p); of forty that are drawn, so that it is known to a ninth."""
    cars = np.random.default_rng(0).multivariate_normal(x, covariance, 40, method="eigh")
    found = []
    for speed in speeds_mps:
        own = reading_power(knowledge, x, speed)
        others = np.array([reading_power(knowledge, one, speed) for one in cars])
        ratios = iri_ratio(own, others, speed, noise, level)
        found.append(np.sqrt(np.mean(np.log(ratios) ** 2)))
    return np.array(found)


def iri_ratio(estimating: Array, actual: Array, speed_mps: float, noise: float, level: float) -> Array:
    """IRI (...) that an estimator with one car's gains finds on a road, over what is right, where the readings come
    from another.

    Problem: what a wrong gain does to an IRI is not its mean error, as waves that a car does not feel are filled in by
    the road's spectrum, whose level is learned with the same wrong gain. Solution: the estimator's filter (N. Wiener's,
    with the level that fits the readings' power best) is applied to the spectrum that the other car reads; the IRI is
    proportional to the root of the power of the slope that comes out, the posterior variance included.

    estimating, actual    squared gains (n,) and (..., n) from road to reading at ``WAVE_NUMBERS_CPM`` [1/s4]; of waves
                          that pass
    noise                 spectrum of the readings' noise [m2/s4 per Hz]
    level                 of the road, Gd(0.2 cycle/m) [m3]
    """
    n, steps = WAVE_NUMBERS_CPM, WAVE_NUMBER_STEPS_CPM
    slope = np.abs(golden_car_slope(n)) ** 2 * n**-WAVINESS * steps
    road = level * (n / PIVOT_CPM) ** -WAVINESS
    within = n * speed_mps < HIGHEST_HZ
    noise = noise * speed_mps
    read = np.where(within, actual, 0.0) * road + noise
    factor = np.ones((*actual.shape[:-1], 1))
    for _ in range(30):
        known = np.where(within, estimating, 0.0) * road * factor
        weight = (known / (known + noise)) ** 2 * steps
        factor *= (weight * read / (known + noise)).sum(axis=-1, keepdims=True) / weight.sum(axis=-1, keepdims=True)
    known = np.where(within, estimating, 0.0) * road * factor
    share = known / (known + noise)
    found = factor * (share * read / (known + noise) + 1 - share)
    return np.asarray(np.sqrt((slope * found).sum(axis=-1) / slope.sum()))


def reading_power(knowledge: CarKnowledge, x: Array, speed_mps: float) -> Array:
    """Squared gain (n,) from road to reading at ``WAVE_NUMBERS_CPM`` [1/s4], where recorders pass it."""
    car = LinearCar.of(knowledge.car(x, 1.0, ""))
    return np.abs(car.response(WAVE_NUMBERS_CPM * speed_mps, speed_mps)) ** 2
