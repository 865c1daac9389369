"""A car's free numbers from drives over roads that nobody measured: the fit, from start to verdict."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import ROUNDING, Array
from logger.fitting.fisher_scoring import Maximum, correlation_of, inverse, maximise
from logger.identification.identifiability import (
    APART,
    NOT_ONE_ROAD,
    Finding,
    NotIdentifiable,
    beside,
    statistical,
    structural,
)
from logger.identification.unknown_road.marginal_likelihood import (
    GD_N0,
    HUNDREDTH,
    NOISE,
    OFFSET,
    SCALE,
    WAVINESS,
    Options,
    ResponseCar,
    Roads,
    RoadsScore,
    at_n0,
)
from logger.identification.unknown_road.road_operator import Grid, RoadDrive
from logger.vehicle.named_parameters import WEAKEST, Coordinates

_WAVINESS = (1.0, 3.5)  # of the flattest and the steepest road there is
# How long a step may be; how many standard errors from the end the end is reached.
_LONGEST_STEP, _CLOSE, _MOST_STEPS = 0.3, 0.02, 30
_OFFSET_WEAKEST_M, _SCALE_WEAKEST = 0.5, 1.0
# Drives over one road leave no more together than each alone, but for so many times, and this share of the readings.
_MORE_TOGETHER, _LITTLE = 1.5, 0.05


@dataclass(frozen=True, eq=False)
class RoadFit:
    """What was found.

    parameters         the car's, by name
    standard_errors    by name, what is not known of roads, places and noise counted in
    roads              their numbers, by name, and the noise's; ``road_errors`` alike. ``place_offset_m`` is to be added
                       to a drive's distances for the first one's, and ``distance_scale`` times its distances from its
                       middle are the first one's
    covariance         (m, m) of all of them
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


class RoadProblem:
    """All roads and a car, in coordinates (m,): logarithms of sizes, places in metres, other numbers over half their
    bounds' width; the car's numbers first, then those of ``Roads``."""

    def __init__(self, car: ResponseCar, roads: Sequence[Sequence[RoadDrive]], options: Options) -> None:
        self.car, self.options, self.free = car, options, list(car.parameters)
        if not self.free:
            raise ValueError("expected at least one free parameter")
        self.roads = Roads(car, roads, options)
        self.names = [*(one.name for one in self.free), *self.roads.names]
        self.coordinates = Coordinates(self.free)
        flattest, steepest = (np.where(self.roads.are(WAVINESS), end, sign * np.inf)
                              for end, sign in zip(_WAVINESS, (-1, 1), strict=True))
        self.low, self.high = np.append(self.coordinates.low, flattest), np.append(self.coordinates.high, steepest)

    def start(self) -> Array:
        """Where to begin: the car as it is said to be; levels and noise from the spectra; places by trying them."""
        values, roads = np.array([one.start for one in self.free]), self.roads
        numbers = roads.first_guess(values)
        for index, (road, part) in enumerate(zip(roads.roads, roads.parts, strict=True)):
            at, scaled = roads.state(index, values, numbers), part[roads.are(SCALE)[part]]
            for number, place in enumerate(roads.places(index)):
                numbers[place], scale = road.place(at, number + 1)
                if self.options.scale_off:
                    numbers[scaled[number]] = (scale - 1) / HUNDREDTH
        return np.append(self.coordinates.of(values), numbers)

    def score(self, x: Array, information: bool) -> RoadsScore:
        """Slopes by the coordinates and, if asked for, the information."""
        found, scale = self.roads.score(*self.apart(x), information), self._scale(x)
        return replace(found, slopes=found.slopes * scale, information=found.information * np.outer(scale, scale))

    def climb(self, x: Array) -> Maximum[RoadsScore]:
        """The largest likelihood uphill from a place."""
        return maximise(self.score, x, self.low, self.high, np.full(len(x), _LONGEST_STEP), close=_CLOSE,
                        most_steps=_MOST_STEPS)

    def structural(self, information: Array) -> list[Finding]:
        """What no such drives could determine, of the car and of all else that is not known."""
        powers, directions = np.linalg.eigh(information)
        derivatives = np.sqrt(np.maximum(powers, 0.0))[:, None] * directions.T
        return structural(self.names, derivatives, 1.0)

    def result(self, climbed: Maximum[RoadsScore], before: float, findings: list[Finding]) -> RoadFit:
        """The fit that ended there, in plain units. NotIdentifiable where the drives cannot identify the numbers."""
        x, p = climbed.x, len(self.free)
        here = self.score(x, information=True)
        relative = inverse(here.information) * (1 + 1 / self.options.probes)
        if not findings:
            kinds = [name.rpartition(".")[2] for name in self.roads.names]
            weakest = np.array([*(one.weakest for one in self.free),
                                *({OFFSET: _OFFSET_WEAKEST_M, SCALE: _SCALE_WEAKEST}.get(one, WEAKEST)
                                  for one in kinds)])
            findings = self.structural(here.information) or self._apart(x) or statistical(self.names, relative, weakest)
            if findings and self.options.refuse:
                raise NotIdentifiable(findings)
        deviations = np.sqrt(np.diag(relative))
        values, numbers = self.apart(x)
        roads, road_errors = {}, {}
        for index, name in enumerate(self.roads.names):
            kind, value, error = name.rpartition(".")[2], float(numbers[index]), float(deviations[p + index])
            if kind in (GD_N0, NOISE):
                value = float(np.exp(value))
                error *= value
            if kind == GD_N0:
                road = next(number for number, part in enumerate(self.roads.parts) if index in part)
                to_n0 = at_n0(self.roads.state(road, values, numbers).waviness)
                value, error = value * to_n0, error * to_n0
            if kind == SCALE:
                value, error = 1 + HUNDREDTH * value, HUNDREDTH * error
            roads[name], road_errors[name] = value, error
        elevations = [road.elevation(self.roads.state(index, values, numbers))
                      for index, road in enumerate(self.roads.roads)]
        own = self.names[:p]
        at_bound = [name for name, one, low, high in zip(own, x, self.low, self.high, strict=False)
                    if min(one - low, high - one) < ROUNDING]
        errors = np.append(np.abs(self._scale(x)[:p]) * deviations[:p], list(road_errors.values()))
        return RoadFit(dict(zip(own, values.tolist(), strict=True)), dict(zip(own, errors[:p].tolist(), strict=True)),
                       roads, road_errors, correlation_of(relative) * np.outer(errors, errors), self.names, elevations,
                       [road.grid for road in self.roads.roads], before, here.error, findings, climbed.converged,
                       climbed.steps, at_bound)

    def _apart(self, x: Array) -> list[Finding]:
        """Whether drives that are said to be over one road disagree on it."""
        values, numbers = self.apart(x)
        for number, road in enumerate(self.roads.roads, 1):
            at = self.roads.state(number - 1, values, numbers)
            alone, together = road.noise_alone(at.values, at.waviness), at.noise_mps2
            if len(road.drives) > 1 and together > max(_MORE_TOGETHER * alone, _LITTLE * road.size_mps2):
                where = f"road {number}" if len(self.roads.roads) > 1 else "one road"
                words = (f"the drives do not agree on {where}: together they leave {together:.2g} m/s2, each by itself "
                         f"{alone:.2g}. {NOT_ONE_ROAD}; treat them as different roads.")
                return [Finding(APART, {}, words)]
        return []

    def apart(self, x: Array) -> tuple[Array, Array]:
        """Values of the car's numbers (p,), and the roads' (r,), at coordinates."""
        p = len(self.free)
        return self.coordinates.values(x[:p]), x[p:]

    def _scale(self, x: Array) -> Array:
        """Derivatives of the numbers by the coordinates; a road's slopes are by logarithms and metres already."""
        values, numbers = self.apart(x)
        return np.append(self.coordinates.slopes(values), np.ones(len(numbers)))


def fit_roads(car: ResponseCar, roads: Sequence[Sequence[RoadDrive]], options: Options | None = None) -> RoadFit:
    """Fit a car's free numbers to drives, those over one road together.

    Raises NotIdentifiable when the drives cannot identify them, ValueError for no drive or no free number.
    """
    options = options or Options()
    problem = RoadProblem(car, roads, options)
    x = problem.start()
    near = beside(x, len(problem.free), problem.low, problem.high)
    findings = problem.structural(problem.score(near, information=True).information)
    if findings and options.refuse:
        raise NotIdentifiable(findings)
    before = problem.score(x, information=False).error
    climbed = problem.climb(x)
    if options.last_probes > options.probes:
        problem, steps = RoadProblem(car, roads, replace(options, probes=options.last_probes)), climbed.steps
        climbed = problem.climb(climbed.x)
        climbed = replace(climbed, steps=steps + climbed.steps)
    return problem.result(climbed, before, findings)
