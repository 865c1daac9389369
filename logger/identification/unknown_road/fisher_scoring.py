"""Fisher scoring: the numbers of a car, its roads and drives that make the likelihood of all drives the largest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from logger.identification.identifiability import APART, NOT_ONE_ROAD, Finding, NotIdentifiable, statistical, structural
from logger.identification.unknown_road.drive_operator import Drive, Grid
from logger.identification.unknown_road.marginal_likelihood import UnknownRoad
from logger.identification.unknown_road.road_state import (
    GD_N0,
    HUNDREDTH,
    NOISE,
    OFFSET,
    SCALE,
    WAVINESS,
    Options,
    ResponseCar,
    RoadState,
    at_n0,
)
from logger.vehicle.named_parameters import WEAKEST, Coordinates

Array = npt.NDArray[np.float64]

_WAVINESS = (1.0, 3.5)  # of the flattest and the steepest road there is
# How long a step may be; how many standard errors from the end the information is near enough, and the end is reached.
_LONGEST_STEP = 0.3
_NEAR, _CLOSE = 1.0, 0.02
_NOTHING, _RANK = 1e-4, 1e-10
_OFFSET_WEAKEST_M, _SCALE_WEAKEST = 0.5, 1.0
# Drives over one road leave no more together than each alone, but for so many times, and this share of the readings.
_MORE_TOGETHER, _LITTLE = 1.5, 0.05
_NUDGE = 0.03


@dataclass(frozen=True, eq=False)
class RoadFit:
    """What was found.

    parameters         the car's, by name
    standard_errors    by name, what is not known of roads, places and noise counted in
    roads              their numbers, by name, and the noise's; ``road_errors`` alike. ``place_offset_m`` is to be added
                       to a drive's distances for the first one's, and ``distance_scale`` times its distances from its
                       middle are the first one's
    covariance         (m, m) of all of them, relative for sizes
    names              (m,)
    elevations         the most probable elevations of each road on its grid [m]
    grids              of the roads
    error_before       rms(measured - explained) / rms(measured), the road being as probable as can be, at the start
    error_after        the same at the estimates
    verdict            what the drives cannot identify
    converged          whether the steps came to rest
    iterations         steps taken
    at_bound           names that ended at a bound
    """

    parameters: dict[str, float]
    standard_errors: dict[str, float]
    roads: dict[str, float]
    road_errors: dict[str, float]
    covariance: Array
    names: list[str]
    elevations: list[Array]
    grids: list[Grid]
    error_before: float
    error_after: float
    verdict: list[Finding]
    converged: bool
    iterations: int
    at_bound: list[str]


@dataclass(frozen=True, eq=False)
class LikelihoodScore:
    """A place, the likelihood's slopes there (m,), the information (m, m), how much is left unexplained, and what has
    been learnt of the slopes' change, in standard errors."""

    x: Array
    slopes: Array
    information: Array
    error: float
    correction: Array


class RoadProblem:
    """All roads, in coordinates: logarithms of sizes, places in metres, other numbers over half their bounds' width.

    In this order: the car's numbers; of each road its level, its waviness if free, and the places of its drives but
    the first; the noise.
    """

    def __init__(self, car: ResponseCar, roads: Sequence[Sequence[Drive]], options: Options) -> None:
        self.car, self.options, self.free = car, options, list(car.parameters)
        if not self.free or not roads or not all(roads):
            raise ValueError("expected at least one free number, and a drive over every road")
        generator = np.random.default_rng(options.seed)
        self.roads = [UnknownRoad(car, list(drives), options, generator) for drives in roads]
        self.names = [one.name for one in self.free]
        self.places: list[list[int]] = []
        for number, road in enumerate(self.roads, 1):
            part = [GD_N0] + [WAVINESS] * options.free_waviness
            later = range(2, len(road.crossings) + 1)
            part += [f"drive{drive}.{OFFSET}" for drive in later if options.place_off_m]
            part += [f"drive{drive}.{SCALE}" for drive in later if options.scale_off]
            first = len(self.names)
            self.names += [f"road{number}.{one}" for one in part]
            self.places.append([*range(len(self.free)), *range(first, len(self.names))])
        self.names.append(NOISE)
        for part_of in self.places:
            part_of.append(len(self.names) - 1)
        self.coordinates = Coordinates(self.free)
        more = np.full(len(self.names) - len(self.free), np.inf)
        self.low, self.high = np.append(self.coordinates.low, -more), np.append(self.coordinates.high, more)
        self.low[self._where(WAVINESS)], self.high[self._where(WAVINESS)] = _WAVINESS

    def start(self) -> Array:
        """Where to begin: the car as it is said to be; levels and noise from the spectra; places by trying them."""
        values = np.array([one.start for one in self.free])
        x = np.zeros(len(self.names))
        x[: len(self.free)] = self.coordinates.of(values)
        x[self._where(WAVINESS)] = self.options.waviness
        noises = []
        for road, part in zip(self.roads, self.places, strict=True):
            level, deviation = road.first_guess(values)
            x[part[len(self.free)]] = level
            noises.append(deviation)
        x[-1] = np.log(np.median(noises))
        if self.options.place_off_m:
            for road, part in zip(self.roads, self.places, strict=True):
                first = len(self.free) + 1 + self.options.free_waviness
                at = self.state(x, part)
                later = len(road.crossings) - 1
                for number in range(later):
                    x[part[first + number]], scale = road.place(at, number + 1)
                    if self.options.scale_off:
                        x[part[first + later + number]] = (scale - 1) / HUNDREDTH
        return x

    def shifted(self, x: Array) -> Array:
        """A place a little shifted a start, where no symmetry of the start hides anything."""
        nudge = np.zeros_like(x)
        p = len(self.free)
        nudge[:p] = _NUDGE * np.cos(1.0 + 2.0 * np.arange(p)) * (p > 1)
        return np.clip(x + nudge, self.low, self.high)

    def look(self, x: Array, information: bool) -> LikelihoodScore:
        """Slopes at a place and, if asked for, the information."""
        m = len(x)
        slopes, matrix = np.zeros(m), np.zeros((m, m))
        left = whole = 0.0
        scale = self._scale(x)
        for road, part in zip(self.roads, self.places, strict=True):
            own, known, squares = road.score(self.state(x, part), information)
            slopes[part] += own * scale[part]
            matrix[np.ix_(part, part)] += known * np.outer(scale[part], scale[part])
            left, whole = left + squares[0], whole + squares[1]
        error = float(np.sqrt(left / whole)) if whole > 0 else float("nan")
        return LikelihoodScore(x, slopes, matrix, error, np.empty((0, 0)))

    def descend(self, here: LikelihoodScore) -> tuple[LikelihoodScore, bool, int]:
        """Steps until they come to rest: the last place, whether they did, and how many."""
        settled, steps = False, 0
        while not settled and steps < self.options.most_steps:
            here, settled = self.step(here)
            steps += 1
        return here, settled, steps

    def step(self, here: LikelihoodScore) -> tuple[LikelihoodScore, bool]:
        """Fisher's step, within bounds and not too long; and whether what was left was nothing to the errors.

        Near the end the information is kept, and ``correction`` learns from each step how the slopes really change (C.
        G. Broyden 1965): few probes give a few numbers' slopes another steepness than their mean has.
        """
        moving = ~(((here.x <= self.low) & (here.slopes < 0)) | ((here.x >= self.high) & (here.slopes > 0)))
        whiten = whitening(here.information[np.ix_(moving, moving)])
        slopes = whiten @ here.slopes[moving]
        left = float(np.sqrt(slopes @ slopes))
        if left < _CLOSE:
            return here, True
        correction = here.correction if here.correction.shape == (len(slopes), len(slopes)) else np.eye(len(slopes))
        along = np.linalg.solve(correction, slopes)
        step = np.zeros_like(here.x)
        step[moving] = whiten.T @ along
        part = min(1.0, _LONGEST_STEP / np.abs(step).max())
        new = self.look(np.clip(here.x + part * step, self.low, self.high), information=left > _NEAR)
        if left > _NEAR:
            return new, False
        missed = slopes - whiten @ new.slopes[moving] - correction @ (part * along)
        correction = correction + np.outer(missed, along) / (part * float(along @ along))
        return replace(new, information=here.information, correction=correction), False

    def structural(self, here: LikelihoodScore) -> list[Finding]:
        """What no such drives could determine, of the car and of all else that is not known."""
        powers, directions = np.linalg.eigh(here.information)
        derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
        return structural(self.names, derivatives, 1.0, _NOTHING)

    def result(self, here: LikelihoodScore, before: float, findings: list[Finding],
               settled: bool, steps: int) -> RoadFit:
        """All of it."""
        p = len(self.free)
        whiten = whitening(here.information)
        relative = whiten.T @ whiten * (1 + 1 / self.options.probes)
        if not findings:
            offsets = np.array([name.endswith(OFFSET) for name in self.names])
            weakest = np.where(offsets, _OFFSET_WEAKEST_M, WEAKEST)
            weakest[self._where(SCALE)] = _SCALE_WEAKEST
            weakest[:p] = [one.weakest for one in self.free]
            findings = self.structural(here) or self._apart(here) or statistical(self.names, relative, weakest)
            if findings and self.options.refuse:
                raise NotIdentifiable(findings)
        deviations = np.sqrt(np.diag(relative))
        values, scale = self._values(here.x), self._scale(here.x)
        numbers = dict(zip(self.names[:p], values.tolist(), strict=True))
        errors = dict(zip(self.names[:p], (np.abs(scale) * deviations)[:p].tolist(), strict=True))
        roads, road_errors = {}, {}
        for index, name in enumerate(self.names[p:], p):
            logarithm = name.endswith((GD_N0, NOISE))
            value = float(np.exp(here.x[index]) if logarithm else here.x[index])
            if name.endswith(GD_N0):
                part = next(one for one in self.places if index in one)
                value *= at_n0(self.state(here.x, part).waviness)
            roads[name], road_errors[name] = value, float(deviations[index] * (value if logarithm else 1.0))
            if name.endswith(SCALE):
                roads[name], road_errors[name] = 1 + HUNDREDTH * value, HUNDREDTH * road_errors[name]
        parts = zip(self.roads, self.places, strict=True)
        elevations = [road.elevation(self.state(here.x, part)) for road, part in parts]
        at_bound = [name for name, x, low, high in zip(self.names[:p], here.x, self.low, self.high, strict=False)
                    if min(x - low, high - x) < 1e-6]
        return RoadFit(numbers, errors, roads, road_errors, relative, self.names, elevations,
                       [road.grid for road in self.roads], before, here.error, findings, settled, steps, at_bound)

    def _apart(self, here: LikelihoodScore) -> list[Finding]:
        """Whether drives that are said to be over one road disagree on it."""
        together = float(np.exp(here.x[-1]))
        for number, (road, part) in enumerate(zip(self.roads, self.places, strict=True), 1):
            at = self.state(here.x, part)
            alone, size = road.noise_alone(at.values, at.waviness), road.size_mps2
            if len(road.drives) > 1 and together > max(_MORE_TOGETHER * alone, _LITTLE * size):
                where = f"road {number}" if len(self.roads) > 1 else "one road"
                words = (f"the drives do not agree on {where}: together they leave {together:.2g} m/s2, each by itself "
                         f"{alone:.2g}. {NOT_ONE_ROAD}; take them for roads of their own.")
                return [Finding(APART, {}, words)]
        return []

    def _where(self, what: str) -> npt.NDArray[np.bool_]:
        return np.array([name.endswith(f".{what}") for name in self.names])

    def _values(self, x: Array) -> Array:
        return self.coordinates.values(x[: len(self.free)])

    def _scale(self, x: Array) -> Array:
        """Derivatives of the numbers by the coordinates; a road's slopes are by logarithms and metres already."""
        scale = np.ones(len(x))
        scale[: len(self.free)] = self.coordinates.slopes(self._values(x))
        return scale

    def state(self, x: Array, part: list[int]) -> RoadState:
        """A road's numbers at a place of all numbers, of which ``part`` are the road's."""
        own = x[part]
        p, road = len(self.free), self.roads[self.places.index(part)]
        first = p + 1 + self.options.free_waviness
        drives = len(road.crossings)
        offsets, scales = np.zeros(drives), np.ones(drives)
        if self.options.place_off_m:
            offsets[1:] = own[first : first + drives - 1]
        if self.options.scale_off:
            scales[1:] += HUNDREDTH * own[len(own) - drives : -1]
        waviness = float(own[p + 1]) if self.options.free_waviness else self.options.waviness
        return RoadState(self._values(x), float(own[p]), waviness, offsets, float(np.exp(own[-1])), scales)


def whitening(information: Array) -> Array:
    """W (r, m) with W' W the inverse of the information, as far as it has one; its rows may differ by powers of ten."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    powers, directions = np.linalg.eigh(information * np.outer(scale, scale))
    known = powers > _RANK * powers[-1]
    return np.asarray(directions[:, known].T / np.sqrt(powers[known])[:, None] * scale)
