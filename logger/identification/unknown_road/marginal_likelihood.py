"""A car from drives over roads that nobody measured: one drive or several over each, their spectrum assumed.

Problem: the road is an unknown at every place, a thousand times as many as the car has numbers; fitted along with them
it would explain anything. Solution: a road of ISO 8608 is a Gaussian process, so readings are one as well,

    y = A(theta) z + noise,   z of the spectrum Gd(n0) (n / n0)^-w,   C = A S A' + sigma^2,

and the numbers are those of the largest likelihood of y with the road integrated out. Several drives over one road
share z: what one of them says of the road, another one has to agree with at its own speed, and that tells far more of
the car than the spectrum alone.

C is never formed. A drive is applied to a road, and back, by transforms (``Crossing``), at any speed; the most probable
road follows by conjugate gradients, and with u = inv(C) y and z = S A' u the likelihood's slope by a number is

    u' dA z - E[the same of readings that the model itself makes]   (and alike for the road's numbers and the noise).

The expectation, else a trace of huge matrices, is a mean over ``probes`` simulated drives, always the same ones: the
estimate is then a root of a smooth function, unbiased however few they are, and its variance grows by one part in
``last_probes``; the way there takes fewer. Steps are Fisher's, whose matrix comes from the same probes.

Nothing here knows a vehicle: ``LinearCar`` is all that is asked for. Numbers that no such drive can tell (masses, rates
and dampers all larger by one factor) are refused (``identifiability``).
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from logger.dsp.decimating_low_pass import LowPass
from logger.identification.identifiability import APART, NOT_ONE_ROAD, Finding, NotIdentifiable, statistical, structural
from logger.identification.noise_models import RoadNoise
from logger.identification.unknown_road.drive_operator import Crossing, Drive, Grid, grid_under
from logger.roads.iso8608 import CM3_M3, REFERENCE_N0_CPM, STANDARD_WAVINESS, displacement_psd
from logger.vehicle.named_parameters import WEAKEST, Free

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

GD_N0, WAVINESS, NOISE, OFFSET, SCALE = "gd_n0_cm3", "waviness", "noise_mps2", "place_offset_m", "distance_scale"
# Level and waviness can be told apart where a car is shaken; the flattest and the steepest road there is.
_PIVOT_CPM = 0.2
_FLATTENED_BELOW_CPM = 0.01
_WAVINESS = (1.0, 3.5)
_SHORTEST_CPM = 4.0
_PER_WAVE, _SPACING_M = 2.5, (0.08, 0.3)
_MOST_SOLVING, _AT_ONCE = 150, 256
# How long a step may be; how many standard errors from the end the information is near enough, and the end is reached.
_LONGEST_STEP = 0.3
_NEAR, _CLOSE = 1.0, 0.02
_NOTHING, _RANK = 1e-4, 1e-10
_OFFSET_WEAKEST_M, _OFFSET_STEP_M = 0.5, 0.04
# A scale of distances moves by hundredths. To begin with it is looked for by the shifts of parts of a drive.
_HUNDREDTH, _SCALE_WEAKEST = 0.01, 1.0
_PART_SHIFTS_M, _MOST_SHIFT_M = 0.3, 12.0
# Drives over one road leave no more together than each alone, but for so many times, and this share of the readings.
_MORE_TOGETHER, _LITTLE = 1.5, 0.05
_NUDGE = 0.03


class LinearCar(Protocol):
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


@dataclass(frozen=True)
class Options:
    """How to fit.

    waviness         of every road, or where it starts
    free_waviness    find it, one for each road
    place_off_m      how far the places of two drives over one road may be off; 0: they are exact
    scale_off        how far their distances may be off beyond that, as a share; 0: they are exact
    probes           simulated drives that slopes are compared with on the way
    last_probes      and at the end, where what they have in common is an error of the estimate
    seed             of them
    most_steps       of Fisher's
    solved           what is left of a set of equations when it counts as solved, of what it began with
    fisher_probes    simulated drives that the information is a mean over
    refuse           raise NotIdentifiable; otherwise ``RoadFit.verdict`` tells
    """

    waviness: float = STANDARD_WAVINESS
    free_waviness: bool = False
    place_off_m: float = 3.0
    probes: int = 10
    seed: int = 1
    most_steps: int = 30
    solved: float = 3e-4
    fisher_probes: int = 2
    refuse: bool = True
    scale_off: float = 0.0
    last_probes: int = 40


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
    verdict            what the drives cannot tell
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


def fit_roads(car: LinearCar, roads: Sequence[Sequence[Drive]], options: Options | None = None) -> RoadFit:
    """Fit a car's free numbers to drives, those over one road together.

    Raises NotIdentifiable when the drives cannot tell them, ValueError for no drive or no free number.
    """
    options = options or Options()
    problem = _Problem(car, roads, options)
    x = problem.start()
    first = problem.look(problem.beside(x), information=True)
    findings = problem.structural(first)
    if findings and options.refuse:
        raise NotIdentifiable(findings)
    here = problem.look(x, information=True)
    before = here.error
    here, settled, steps = problem.descend(here)
    if options.last_probes > options.probes:
        problem = _Problem(car, roads, replace(options, probes=options.last_probes))
        here, settled, more = problem.descend(problem.look(here.x, information=True))
        steps += more
    here = problem.look(here.x, information=True)
    return problem.result(here, before, findings, settled, steps)


@dataclass(frozen=True, eq=False)
class _Look:
    """A place, the likelihood's slopes there (m,), the information (m, m), how much is left unexplained, and what has
    been learnt of the slopes' change, in standard errors."""

    x: Array
    slopes: Array
    information: Array
    error: float
    turn: Array


class _Problem:
    """All roads, in coordinates: logarithms of sizes, places in metres, other numbers over half their bounds' width.

    In this order: the car's numbers; of each road its level, its waviness if free, and the places of its drives but
    the first; the noise.
    """

    def __init__(self, car: LinearCar, roads: Sequence[Sequence[Drive]], options: Options) -> None:
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
        self.log = np.array([one.by_factors for one in self.free])
        self.unit = np.array([np.sign(one.start) if one.by_factors else (one.high - one.low) / 2 for one in self.free])
        low, high = (self._coordinates(np.array([getattr(one, end) for one in self.free])) for end in ("low", "high"))
        more = np.full(len(self.names) - len(self.free), np.inf)
        self.low = np.append(np.minimum(low, high), -more)
        self.high = np.append(np.maximum(low, high), more)
        self.low[self._where(WAVINESS)], self.high[self._where(WAVINESS)] = _WAVINESS

    def start(self) -> Array:
        """Where to begin: the car as it is said to be; levels and noise from the spectra; places by trying them."""
        values = np.array([one.start for one in self.free])
        x = np.zeros(len(self.names))
        x[: len(self.free)] = self._coordinates(values)
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
                at = self._at(x, part)
                later = len(road.crossings) - 1
                for number in range(later):
                    x[part[first + number]], scale = road.place(at, number + 1)
                    if self.options.scale_off:
                        x[part[first + later + number]] = (scale - 1) / _HUNDREDTH
        return x

    def beside(self, x: Array) -> Array:
        """A place a little beside a start, where no symmetry of the start hides anything."""
        nudge = np.zeros_like(x)
        p = len(self.free)
        nudge[:p] = _NUDGE * np.cos(1.0 + 2.0 * np.arange(p)) * (p > 1)
        return np.clip(x + nudge, self.low, self.high)

    def look(self, x: Array, information: bool) -> _Look:
        """Slopes at a place and, if asked for, the information."""
        m = len(x)
        slopes, matrix = np.zeros(m), np.zeros((m, m))
        left = whole = 0.0
        scale = self._scale(x)
        for road, part in zip(self.roads, self.places, strict=True):
            own, known, squares = road.score(self._at(x, part), information)
            slopes[part] += own * scale[part]
            matrix[np.ix_(part, part)] += known * np.outer(scale[part], scale[part])
            left, whole = left + squares[0], whole + squares[1]
        error = float(np.sqrt(left / whole)) if whole > 0 else float("nan")
        return _Look(x, slopes, matrix, error, np.empty((0, 0)))

    def descend(self, here: _Look) -> tuple[_Look, bool, int]:
        """Steps until they come to rest: the last place, whether they did, and how many."""
        settled, steps = False, 0
        while not settled and steps < self.options.most_steps:
            here, settled = self.step(here)
            steps += 1
        return here, settled, steps

    def step(self, here: _Look) -> tuple[_Look, bool]:
        """Fisher's step, within bounds and not too long; and whether what was left was nothing to the errors.

        Near the end the information is kept, and ``turn`` learns from each step how the slopes really change (C. G.
        Broyden 1965): few probes give a few numbers' slopes another steepness than their mean has.
        """
        moving = ~(((here.x <= self.low) & (here.slopes < 0)) | ((here.x >= self.high) & (here.slopes > 0)))
        whiten = _whitening(here.information[np.ix_(moving, moving)])
        slopes = whiten @ here.slopes[moving]
        left = float(np.sqrt(slopes @ slopes))
        if left < _CLOSE:
            return here, True
        turn = here.turn if here.turn.shape == (len(slopes), len(slopes)) else np.eye(len(slopes))
        along = np.linalg.solve(turn, slopes)
        step = np.zeros_like(here.x)
        step[moving] = whiten.T @ along
        part = min(1.0, _LONGEST_STEP / np.abs(step).max())
        new = self.look(np.clip(here.x + part * step, self.low, self.high), information=left > _NEAR)
        if left > _NEAR:
            return new, False
        missed = slopes - whiten @ new.slopes[moving] - turn @ (part * along)
        turn = turn + np.outer(missed, along) / (part * float(along @ along))
        return replace(new, information=here.information, turn=turn), False

    def structural(self, here: _Look) -> list[Finding]:
        """What no such drives could tell, of the car and of all else that is not known."""
        powers, directions = np.linalg.eigh(here.information)
        derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
        return structural(self.names, derivatives, 1.0, _NOTHING)

    def result(self, here: _Look, before: float, findings: list[Finding], settled: bool, steps: int) -> RoadFit:
        """All of it."""
        p = len(self.free)
        whiten = _whitening(here.information)
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
                value *= _at_n0(self._at(here.x, part).waviness)
            roads[name], road_errors[name] = value, float(deviations[index] * (value if logarithm else 1.0))
            if name.endswith(SCALE):
                roads[name], road_errors[name] = 1 + _HUNDREDTH * value, _HUNDREDTH * road_errors[name]
        parts = zip(self.roads, self.places, strict=True)
        elevations = [road.elevation(self._at(here.x, part)) for road, part in parts]
        at_bound = [name for name, x, low, high in zip(self.names[:p], here.x, self.low, self.high, strict=False)
                    if min(x - low, high - x) < 1e-6]
        return RoadFit(numbers, errors, roads, road_errors, relative, self.names, elevations,
                       [road.grid for road in self.roads], before, here.error, findings, settled, steps, at_bound)

    def _apart(self, here: _Look) -> list[Finding]:
        """Whether drives that are said to be over one road disagree on it."""
        together = float(np.exp(here.x[-1]))
        for number, (road, part) in enumerate(zip(self.roads, self.places, strict=True), 1):
            at = self._at(here.x, part)
            alone, size = road.noise_alone(at.values, at.waviness), road.size_mps2
            if len(road.drives) > 1 and together > max(_MORE_TOGETHER * alone, _LITTLE * size):
                where = f"road {number}" if len(self.roads) > 1 else "one road"
                words = (f"the drives do not agree on {where}: together they leave {together:.2g} m/s2, each by itself "
                         f"{alone:.2g}. {NOT_ONE_ROAD}; take them for roads of their own.")
                return [Finding(APART, {}, words)]
        return []

    def _where(self, what: str) -> npt.NDArray[np.bool_]:
        return np.array([name.endswith(f".{what}") for name in self.names])

    def _coordinates(self, values: Array) -> Array:
        return np.where(self.log, np.log(np.where(self.log, np.abs(values), 1.0)), values / self.unit)

    def _values(self, x: Array) -> Array:
        own = x[: len(self.free)]
        return self.unit * np.where(self.log, np.exp(np.where(self.log, own, 0.0)), own)

    def _scale(self, x: Array) -> Array:
        """Derivatives of the numbers by the coordinates; a road's slopes are by logarithms and metres already."""
        scale = np.ones(len(x))
        scale[: len(self.free)] = np.where(self.log, self._values(x), self.unit)
        return scale

    def _at(self, x: Array, part: list[int]) -> RoadState:
        own = x[part]
        p, road = len(self.free), self.roads[self.places.index(part)]
        first = p + 1 + self.options.free_waviness
        drives = len(road.crossings)
        offsets, scales = np.zeros(drives), np.ones(drives)
        if self.options.place_off_m:
            offsets[1:] = own[first : first + drives - 1]
        if self.options.scale_off:
            scales[1:] += _HUNDREDTH * own[len(own) - drives : -1]
        waviness = float(own[p + 1]) if self.options.free_waviness else self.options.waviness
        return RoadState(self._values(x), float(own[p]), waviness, offsets, float(np.exp(own[-1])), scales)


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


@dataclass(frozen=True, eq=False)
class _Model:
    """A road's drives at one place: waves of innovations (k,) for each drive, responses and their derivatives."""

    waves: list[Complex]
    responses: list[Complex]
    derivatives: list[Complex]
    precondition: Array
    variance: float


class UnknownRoad:
    """One road and the drives over it: what they say of a car's numbers, the road's, their places and the noise."""

    def __init__(self, car: LinearCar, drives: list[Drive], options: Options, generator: np.random.Generator) -> None:
        self._car, self._options = car, options
        highest = max(_highest_cpm(drive) for drive in drives)
        spacing_m = float(np.clip(1 / (_PER_WAVE * min(highest, _SHORTEST_CPM)), *_SPACING_M))
        scale_off = options.scale_off * (len(drives) > 1)
        self.grid = grid_under(drives, car.behind_m, spacing_m, options.place_off_m, scale_off)
        self.drives = drives
        self.crossings = [Crossing(drive, self.grid, car.behind_m, car.contact_patch_m) for drive in drives]
        self.measured = [one.measured_mps2 - one.measured_mps2.mean() for one in self.crossings]
        self._rounds = _MOST_SOLVING
        self._factor: tuple[npt.NDArray[np.float32], bool] | None = None
        self._white = generator.standard_normal((options.probes, self.grid.count))
        self._noise = [generator.standard_normal((options.probes, len(one))) for one in self.measured]

    @property
    def size_mps2(self) -> float:
        """R.m.s. of all readings."""
        return float(np.sqrt(np.mean(np.concatenate(self.measured) ** 2)))

    def first_guess(self, values: Array) -> tuple[float, float]:
        """Logarithm of the level, and the noise, from the readings' spectra alone."""
        level, noise_mps2 = self._spectral_levels(values, self._options.waviness, range(len(self.crossings)))
        return float(np.log(level / _at_n0(self._options.waviness))), noise_mps2

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

        low_pass = LowPass(self.drives[0].rate_hz, None)
        measured = [self.measured[number] for number in which]
        levels = RoadNoise(spectra).fitted(measured, values, low_pass, 1e-3 * self.size_mps2).levels
        return levels[GD_N0], levels["deviation_mps2"]

    def offset(self, at: RoadState, number: int) -> float:
        """Where a drive's places best agree with those of the first one [m]."""
        return self.place(at, number)[0]

    def place(self, at: RoadState, number: int) -> tuple[float, float]:
        """Where a drive's places best agree with those of the first one [m], and at what scale of its distances.

        What the first one tells is laid out at every shift once; a scale shifts each part of the drive by another one.
        """
        model = self._model(at)
        alone = _Model(model.waves[:1], model.responses[:1], model.derivatives[:1], model.precondition, model.variance)
        found = self._solve(alone, [self.measured[0][None]])[0]
        crossing, n, options = self.crossings[number], self.grid.wave_number_cpm, self._options
        way_m = self.drives[number].distance_m
        length_m = float(np.ptp(way_m))
        scale_off = min(options.scale_off, 2 * _MOST_SHIFT_M / length_m)
        most_m = options.place_off_m + scale_off * length_m / 2
        shifts = np.arange(-np.ceil(most_m / _OFFSET_STEP_M), np.ceil(most_m / _OFFSET_STEP_M) + 1) * _OFFSET_STEP_M
        parts = np.array_split(np.arange(len(way_m)), max(1, int(np.ceil(scale_off * length_m / _PART_SHIFTS_M))))
        like, power = np.empty((2, len(shifts), len(parts)))
        for index, shift in enumerate(shifts):
            waves = model.waves[0] * np.exp(2j * np.pi * n * shift)
            told = crossing.readings(crossing.under_axles(found, waves), model.responses[number])[0]
            for place, part in enumerate(parts):
                like[index, place] = told[part] @ self.measured[number][part]
                power[index, place] = told[part] @ told[part]
        from_middle_m = np.array([way_m[part].mean() for part in parts]) - 0.5 * (way_m.min() + way_m.max())
        best, found_at = -np.inf, (0.0, 1.0)
        steps = int(scale_off * length_m / 2 / (2 * _OFFSET_STEP_M))
        for scale in np.linspace(-scale_off, scale_off, 2 * steps + 1):
            moved = np.rint(scale * from_middle_m / _OFFSET_STEP_M).astype(int)
            off = int(options.place_off_m / _OFFSET_STEP_M)
            at_shift = len(shifts) // 2 + np.arange(-off, off + 1)[:, None] + moved
            at_shift = np.clip(at_shift, 0, len(shifts) - 1)
            likeness = (np.take_along_axis(like, at_shift, 0).sum(axis=1)
                        / np.sqrt(np.take_along_axis(power, at_shift, 0).sum(axis=1) + 1e-300))
            index = int(likeness.argmax())
            if likeness[index] > best:
                best, found_at = float(likeness[index]), ((index - off) * _OFFSET_STEP_M, 1 + float(scale))
        return found_at

    def with_car(self, car: LinearCar) -> UnknownRoad:
        """The same road and drives with another car, whose axles stand where they stood."""
        other = copy(self)
        other._car = car
        return other

    @property
    def rounds(self) -> int:
        """How many it took to solve the equations last."""
        return self._rounds

    def prepare(self, at: RoadState) -> None:
        """Factor the equations as they are here, so that those of a place nearby are solved in few rounds."""
        from scipy.linalg import cho_factor

        model, count = self._model(at), self.grid.count
        normal = np.eye(count, dtype=np.float32)
        for one, waves, response in zip(self.crossings, model.waves, model.responses, strict=True):
            unit = np.eye(count)
            rows = np.concatenate([one.readings(one.under_axles(unit[first : first + _AT_ONCE], waves), response)
                                   for first in range(0, count, _AT_ONCE)]).astype(np.float32)
            rows /= np.float32(at.noise_mps2)
            normal += rows @ rows.T
        self._factor = cho_factor(normal, lower=True, overwrite_a=True, check_finite=False)

    def told(self, at: RoadState, number: int, by: Sequence[int] | None = None) -> Array:
        """What the other drives, or some, make one expect in the drive of this number (n,), less its mean [m/s2]."""
        model, crossings = self._model(at), self.crossings
        others = [index for index in range(len(crossings)) if index != number] if by is None else list(by)
        rest = _Model([model.waves[one] for one in others], [model.responses[one] for one in others], [],
                      model.precondition, model.variance)
        white = self._solve(rest, [self.measured[one][None] for one in others], which=others)[0]
        own = crossings[number]
        return np.asarray(own.readings(own.under_axles(white, model.waves[number]), model.responses[number])[0])

    def elevation(self, at: RoadState) -> Array:
        """The most probable elevations (count,) [m]."""
        model = self._model(at)
        found = self._solve(model, [one[None] for one in self.measured])[0]
        return np.asarray(np.fft.irfft(np.fft.rfft(found[0]) * np.abs(model.waves[0]), self.grid.count))

    def score(self, at: RoadState, information: bool) -> tuple[Array, Array, tuple[float, float]]:
        """Slopes of the likelihood (m,), the information (m, m) or zeros, and squares unexplained and measured."""
        model = self._model(at)
        readings = []
        for number, one in enumerate(self.crossings):
            made = one.readings(one.under_axles(self._white, model.waves[number]), model.responses[number])
            made = made + at.noise_mps2 * self._noise[number]
            readings.append(np.concatenate([self.measured[number][None], made - made.mean(axis=1, keepdims=True)]))
        known_rounds = None if information or self._factor is not None else self._rounds
        white, rest, self._rounds = self._solve(model, readings, known_rounds)
        slopes = self._quadratics(model, white, rest)
        left = sum(float((model.variance * one[0]) @ (model.variance * one[0])) for one in rest)
        whole = sum(float(one @ one) for one in self.measured)
        count = slopes.shape[1]
        known = np.zeros((count, count))
        if information:
            probes = slice(1, 1 + self._options.fisher_probes)
            known = self._information(model, white[probes], [one[probes] for one in rest])
        return slopes[0] - slopes[1:].mean(axis=0), known, (left, whole)

    def _quadratics(self, model: _Model, white: Array, rest: list[Array]) -> Array:
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
                moved = _HUNDREDTH * one.under_axles(white, waves * slope, lever=True)
                by_scale.append(one.products(transform, response[None], moved)[:, 0])
            by_noise += model.variance * (u**2).sum(axis=1)
        columns = [*by_car.T, 0.5 * (white**2).sum(axis=1)]
        if self._options.free_waviness:
            columns.append(0.5 * (white * self._tilted(white)).sum(axis=1))
        if self._options.place_off_m:
            columns += by_place[1:]
        columns += by_scale[1:]
        return np.stack([*columns, by_noise], axis=1)

    def _information(self, model: _Model, white: Array, rest: list[Array]) -> Array:
        """Half of E[(dC u)' inv(C) (dC u)] (m, m), over whitened readings of probes."""
        total = np.zeros((0, 0))
        for probe in range(len(white)):
            changed = self._changes(model, white[probe : probe + 1], [one[probe : probe + 1] for one in rest])
            solved = self._solve(model, changed)[1]
            part = np.sum([one @ other.T for one, other in zip(changed, solved, strict=True)], axis=0)
            total = part if probe == 0 else total + part
        return np.asarray((total + total.T) / (4 * len(white)))

    def _changes(self, model: _Model, white: Array, rest: list[Array]) -> list[Array]:
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
                 ((1.0, False, self._options.place_off_m), (_HUNDREDTH, True, self._options.scale_off)) if free
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

    def _conditioned(self, residual: Array, model: _Model) -> Array:
        """About what solves the equations for a residual (b, count)."""
        if self._factor is None:
            return self._filtered(residual, model)
        from scipy.linalg import cho_solve

        return np.asarray(cho_solve(self._factor, residual.T.astype(np.float32), check_finite=False).T, float)

    def _filtered(self, residual: Array, model: _Model) -> Array:
        """The same were the drives endless and their speeds even."""
        return np.asarray(np.fft.irfft(np.fft.rfft(residual) * model.precondition, self.grid.count))

    def _tilted(self, white: Array) -> Array:
        """Innovations times the derivative of the logarithm of the spectrum by the waviness."""
        n = np.maximum(self.grid.wave_number_cpm, _FLATTENED_BELOW_CPM)
        return np.asarray(np.fft.irfft(-np.log(n / _PIVOT_CPM) * np.fft.rfft(white), self.grid.count))

    def _model(self, at: RoadState) -> _Model:
        n = self.grid.wave_number_cpm
        psd = np.exp(at.level) * CM3_M3 * (np.maximum(n, _FLATTENED_BELOW_CPM) / _PIVOT_CPM) ** -at.waviness
        psd[0] = 0.0
        factor = np.sqrt(psd / (2 * self.grid.spacing_m))
        if at.scales is not None:
            self.crossings = [one.laid(float(scale)) for one, scale in zip(self.crossings, at.scales, strict=True)]
        pairs = [self._car.responses(at.values, one.f_hz) for one in self.crossings]
        gain = np.zeros(len(n))
        for one, (response, _) in zip(self.crossings, pairs, strict=True):
            seen = float(one.speed_mps.mean()) * len(one.speed_mps) / self._rate_hz / self.grid.spacing_m
            gain += one.gain(response, self._car.behind_m) / seen
        precondition = 1 / (1 + factor**2 * gain / at.noise_mps2**2)
        waves = [factor * np.exp(2j * np.pi * n * off) for off in at.offsets_m]
        return _Model(waves, [one for one, _ in pairs], [one for _, one in pairs], precondition, at.noise_mps2**2)

    @property
    def _rate_hz(self) -> float:
        return self.drives[0].rate_hz

    def _solve(self, model: _Model, readings: list[Array], rounds: int | None = None,
               which: Sequence[int] | None = None) -> tuple[Array, list[Array], int]:
        """Innovations (b, count) of the most probable roads, inv(C) times the readings (b, n) of each drive (of all,
        or of those in ``which``), and how many rounds that took.

        Conjugate gradients on (1 + B' B / variance) w = B' y / variance, for all b at once, until they are right, or
        so many ``rounds``: slopes at neighbouring places can be compared only if they come from as many.
        """
        crossings = [self.crossings[one] for one in (range(len(readings)) if which is None else which)]

        def forth(white: Array) -> list[Array]:
            return [one.readings(one.under_axles(white, waves), response) for one, waves, response in
                    zip(crossings, model.waves, model.responses, strict=True)]

        def back(parts: list[Array]) -> Array:
            total = np.zeros((len(parts[0]), self.grid.count))
            for one, part, waves, response in zip(crossings, parts, model.waves, model.responses, strict=True):
                total += one.back(part, waves, response)
            return total / model.variance

        residual = back(readings)
        white = np.zeros_like(residual)
        unexplained = [one.copy() for one in readings]
        direction, before = np.zeros_like(residual), np.full(len(residual), np.inf)
        first, count = None, 0
        while count < (_MOST_SOLVING if rounds is None else rounds):
            conditioned = self._conditioned(residual, model) if which is None else self._filtered(residual, model)
            size = (residual * conditioned).sum(axis=1)
            first = size if first is None else first
            if rounds is None and (size <= self._options.solved**2 * first).all():
                break
            count += 1
            direction = conditioned + (size / before)[:, None] * direction
            image = forth(direction)
            curve = (direction**2).sum(axis=1) + sum((one**2).sum(axis=1) for one in image) / model.variance
            step = (size / np.maximum(curve, 1e-300))[:, None]
            white += step * direction
            for one, part in zip(unexplained, image, strict=True):
                one -= step * part
            residual -= step * (direction + back(image))
            before = np.maximum(size, 1e-300)
        return white, [one / model.variance for one in unexplained], count


def _highest_cpm(drive: Drive) -> float:
    pace_m = float(np.median(np.abs(np.diff(drive.distance_m))))
    return 0.45 / max(pace_m, 1e-3)


def _at_n0(waviness: float) -> float:
    """Gd at n0 over Gd at the pivot."""
    return float((REFERENCE_N0_CPM / _PIVOT_CPM) ** -waviness)


def _whitening(information: Array) -> Array:
    """W (r, m) with W' W the inverse of the information, as far as it has one; its rows may differ by powers of ten."""
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    powers, directions = np.linalg.eigh(information * np.outer(scale, scale))
    known = powers > _RANK * powers[-1]
    return np.asarray(directions[:, known].T / np.sqrt(powers[known])[:, None] * scale)
