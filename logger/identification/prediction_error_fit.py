"""Numbers of a model from what was measured: the grey-box prediction-error method (3.2.4 of Blum 2015; Ljung 1999).

Problem: find the numbers for which the model's predictions leave the least, say how certain they are, and say so when
the data cannot identify. Solution, in this order:

1. ask whether the data could determine the numbers at all (``identifiability``), before any fit;
2. go downhill, in the logarithm of what can only be positive, within bounds, on residuals as they are (output error),
   from every start that was given; the best goes on;
3. fit a noise model to the residual, weigh by it (innovations form), and repeat 2 from there, until neither moves;
4. covariance of the estimates from the information matrix; ask once more whether what was found is an estimate, and
   whether the model at its best has anything to do with what was measured.

It knows models by ``Predictor`` only.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from logger.arrays import ROUNDING, Array
from logger.bounds import DISCREPANCY
from logger.dsp.filters import DecimatingLowPass
from logger.fitting.fisher_scoring import inverse_with_prior
from logger.fitting.levenberg_marquardt import Minimum, minimise
from logger.identification.identifiability import Finding, NotIdentifiable, beside, statistical, structural, unexplained
from logger.identification.noise_models import LEAST_SHARE, Autoregressive, NoiseModel, White, Whitening
from logger.runs import normalised_rms
from logger.vehicle.named_parameters import Coordinates, Free

_LONGEST_STEP = 1.0
# Converged: what is left of the way is this share of a standard error; of a model that is stepped through time, this.
_CLOSE, _CLOSE_SIMULATED, _CLOSE_NOISE = 1e-5, 1e-2, 1e-4
_MOST_STEPS, _MOST_NOISE_ROUNDS = 100, 20  # of one descent; of noise model and numbers in turn
_FAR = 3.0


class Predictor(Protocol):
    """What can be fitted: numbers in, one prediction per record out, as long as what was measured; and its derivatives,
    differences of predictions."""

    @property
    def parameters(self) -> Sequence[Free]: ...

    @property
    def exact(self) -> bool: ...

    def predict(self, values: Array) -> list[Array]:
        """Predictions [(n,), ...] with these values (p,) in the order of ``parameters``."""

    def slopes(self, values: Array) -> list[Array]:
        """Derivatives of the predictions by each value [(n, p), ...]."""


def least_share(model: Predictor) -> float:
    """The residual is taken for no less than this share of the measurement, as predictions are no better."""
    return LEAST_SHARE if model.exact else DISCREPANCY


@dataclass(frozen=True)
class FitOptions:
    """How to fit.

    rate_hz        of all records
    low_pass_hz    leave out what lies above [Hz]
    noise          candidates; the best by Schwarz's criterion is taken
    starts         further starts, values by name; what they do not name starts as in ``Free``
    """

    rate_hz: float = 100.0
    low_pass_hz: float | None = None
    noise: Sequence[NoiseModel] = (White(), Autoregressive())
    starts: Sequence[Mapping[str, float]] = ()


@dataclass(frozen=True, eq=False)
class Fit:
    """What a fit found.

    free               the numbers that were free, with their starts and bounds
    parameters         estimates by name
    covariance         (p, p) of the estimates, in their order
    error_before       rms(measured - model) / rms(measured) at the start
    error_after        the same at the estimates
    residuals          measured minus model, per record
    white              residuals behind low-pass and noise model, in deviations, per record
    sensitivities      derivatives of the predictions behind the same, by relative change, joined (N, p)
    low_pass           the filter they went through
    noise              the noise model that was taken
    converged          whether steps and noise model came to rest
    iterations         steps taken in all
    cost               half the sum of squares of ``white``
    at_bound           names that ended at a bound
    ends               where each start had come to before the noise model: (starts, p)
    prior              what was known before any run, by coordinates: its information (p,), and its pull from there (p,)
    """

    free: list[Free]
    parameters: dict[str, float]
    covariance: Array
    error_before: float
    error_after: float
    residuals: list[Array]
    white: list[Array]
    sensitivities: Array
    low_pass: DecimatingLowPass
    noise: Whitening
    converged: bool
    iterations: int
    cost: float
    at_bound: list[str]
    ends: Array
    prior: tuple[Array, Array]

    @property
    def names(self) -> list[str]:
        """Names of the rows of the covariance."""
        return list(self.parameters)

    @property
    def standard_errors(self) -> dict[str, float]:
        """By name."""
        return dict(zip(self.parameters, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def information(self) -> Array:
        """Of the coordinates (p, p): that of the records and what was known before."""
        return np.asarray(self.sensitivities.T @ self.sensitivities + np.diag(self.prior[0]))

    @property
    def near_0(self) -> list[str]:
        """Names of sizes that may be 0 and are within twice their error of it, or as small as their bound lets them."""
        return [one.name for one in self.free if one.may_be_0 and self.parameters[one.name] < (
            one.start if one.name in self.at_bound else 2 * self.standard_errors[one.name])]


def fit(model: Predictor, measured: Sequence[Array], options: FitOptions | None = None) -> Fit:
    """Fit a model's free numbers to records (n,), each as long as its prediction.

    Raises NotIdentifiable when the data cannot identify them, ValueError for measurements of other lengths than the
    predictions or nothing but zeros, no free number, or a start outside its bounds.
    """
    problem = _FitProblem(model, measured, options or FitOptions())
    starts = problem.starts()
    near = beside(starts[0], len(problem.free), problem.low, problem.high)
    if findings := problem.structural_findings(problem.at(near, problem.plain)):
        raise NotIdentifiable(findings)
    descents = [_descend(problem, start, problem.plain) for start in starts]
    best = descents[int(np.argmin([one.at.cost for one in descents]))]
    iterations = sum(one.rounds for one in descents)
    noise, point, rounds, settled = _innovations(problem, best.at)
    return _result(problem, point, noise, iterations + rounds, settled,
                   np.array([problem.coordinates.values(one.x) for one in descents]))


def spread_starts(free: Sequence[Free], count: int) -> list[dict[str, float]]:
    """So many starts, spread evenly between a third and three times each start, or as far as the bounds go.

    Additive recurrence with powers of the root of x^(p+1) = x + 1, which leaves no corner empty (M. Roberts 2018).
    """
    ratio = max(np.roots([1.0, *[0.0] * (len(free) - 1), -1.0, -1.0]).real)
    starts = []
    for number in range(1, count + 1):
        start = {}
        for index, one in enumerate(free):
            share = (0.5 + number / ratio ** (index + 1)) % 1.0
            if one.by_factors:
                near, far = sorted((one.start / _FAR, one.start * _FAR))
                low, high = max(one.low, near), min(one.high, far)
                start[one.name] = float(low * (high / low) ** share)
            else:
                reach = np.inf if one.usual is None else _FAR * one.usual
                low, high = max(one.low, one.start - reach), min(one.high, one.start + reach)
                start[one.name] = low + share * (high - low)
        starts.append(start)
    return starts


# --- the problem in the coordinates that steps are taken in ---


@dataclass(frozen=True, eq=False)
class _ResidualsAt:
    """A place, and what the residuals are there: white (N,), and as they are, per record."""

    x: Array
    cost: float
    white: Array
    plain: list[Array]


@dataclass(eq=False)
class _FitProblem:
    """A model and its measurements."""

    model: Predictor
    measured: Sequence[Array]
    options: FitOptions

    def __post_init__(self) -> None:
        self.free = list(self.model.parameters)
        if not self.free:
            raise ValueError("expected at least one free parameter")
        self.low_pass = DecimatingLowPass(self.options.rate_hz, self.options.low_pass_hz)
        self.coordinates = Coordinates(self.free)
        self.low, self.high = self.coordinates.low, self.coordinates.high
        self.exact = self.model.exact
        self.observed = [self.low_pass.apply(one) for one in self.measured]
        if not any(one.any() for one in self.measured):
            raise ValueError("expected measurements that vary, found nothing but 0")
        self.floor = least_share(self.model) * float(np.sqrt(np.mean(np.concatenate(self.observed) ** 2)))
        self.plain = White().fitted(self.observed, np.empty(0), self.low_pass, self.floor)
        self._slopes: tuple[Array, list[Array]] = np.full(len(self.free), np.nan), []
        known = [one.known or (one.start or 1.0, np.inf) for one in self.free]
        values, shares = (np.array(column) for column in zip(*known, strict=True))
        self.mean = self.coordinates.of(values)
        self.precision = (self.coordinates.slopes(values) / (values * shares))**2

    def pull(self, x: Array) -> Array:
        """Of what was known before (p,), at a place: minus the derivative of its cost."""
        return self.precision * (self.mean - x)

    def starts(self) -> list[Array]:
        first = {one.name: one.start for one in self.free}
        chosen = [first, *({**first, **more} for more in self.options.starts)]
        starts = [self.coordinates.of(np.array([start[one.name] for one in self.free])) for start in chosen]
        for start in starts:
            if not ((start >= self.low - ROUNDING) & (start <= self.high + ROUNDING)).all():
                raise ValueError("expected every start between its bounds")
        return starts

    def at(self, x: Array, noise: Whitening) -> _ResidualsAt:
        """The residuals at a place, weighed by a noise model."""
        predictions = self.model.predict(self.coordinates.values(x))
        if [len(one) for one in predictions] != [len(one) for one in self.measured]:
            raise ValueError("expected measurements as long as the predictions")
        plain = [seen - self.low_pass.apply(one) for seen, one in zip(self.observed, predictions, strict=True)]
        white = noise(plain)
        cost = 0.5 * float(white @ white + self.pull(x) @ (self.mean - x))
        return _ResidualsAt(x, cost, white, plain)

    def slopes(self, x: Array) -> list[Array]:
        """Derivatives (n, p) of the predictions by coordinates at a place, behind the low-pass, per record; those of
        the place that was asked for last are known."""
        if not np.array_equal(self._slopes[0], x):
            values = self.coordinates.values(x)
            scale = self.coordinates.slopes(values)
            self._slopes = x, [self.low_pass.apply(one) * scale for one in self.model.slopes(values)]
        return self._slopes[1]

    def structural_findings(self, point: _ResidualsAt) -> list[Finding]:
        """What no such data could determine at a place."""
        size = float(np.sqrt(sum(((seen - left)**2).sum() for seen, left in zip(
            self.observed, point.plain, strict=True))))
        known = size * np.diag(self.precision > 0)
        return structural([one.name for one in self.free], np.concatenate([*self.slopes(point.x), known]), size)


# --- descent ---


def _descend(problem: _FitProblem, start: Array, noise: Whitening) -> Minimum[_ResidualsAt]:
    """The nearest minimum of the sum of squares."""
    slopes = np.empty((0, 0))

    def normal_equations(x: Array, point: _ResidualsAt, fresh: bool) -> tuple[Array, Array]:
        nonlocal slopes
        if fresh:
            slopes = noise(problem.slopes(x))
        return slopes.T @ point.white + problem.pull(x), slopes.T @ slopes + np.diag(problem.precision)

    # A step of so small a share of a standard error gains half its square in units of the residuals' variance.
    close = _CLOSE if problem.exact else _CLOSE_SIMULATED
    return minimise(start, lambda x: problem.at(x, noise), normal_equations,
                    small_gain=lambda point: close**2 * point.cost / len(point.white),
                    most_rounds=_MOST_STEPS, low=problem.low, high=problem.high, longest_step=_LONGEST_STEP)


def _innovations(problem: _FitProblem, point: _ResidualsAt) -> tuple[Whitening, _ResidualsAt, int, bool]:
    """Noise model and numbers in turn, until neither moves: (noise, place, steps, whether they came to rest)."""
    kinds, steps = list(problem.options.noise), 0
    for _ in range(_MOST_NOISE_ROUNDS):
        values, residuals = problem.coordinates.values(point.x), point.plain
        fitted = [kind.fitted(residuals, values, problem.low_pass, problem.floor) for kind in kinds]
        best = int(np.argmin([one.criterion(len(point.white)) for one in fitted]))
        noise = fitted[best]
        kinds = [kinds[best]]
        if noise.name == "ar":
            kinds = [Autoregressive(int(noise.levels["order"]))]
        found = _descend(problem, point.x, noise)
        steps += found.rounds
        moved = found.x - point.x
        point = found.at
        if np.sqrt(moved @ found.information @ moved) < _CLOSE_NOISE:
            return noise, point, steps, found.converged
    return noise, point, steps, False


# --- the result ---


def _result(problem: _FitProblem, point: _ResidualsAt, noise: Whitening, iterations: int, settled: bool,
            ends: Array) -> Fit:
    names = [one.name for one in problem.free]
    slopes = noise(problem.slopes(point.x))
    relative = _covariance(problem, point, slopes)
    at_bound = [one.name for one, x, low, high in zip(problem.free, point.x, problem.low, problem.high, strict=True)
                if (x - low < ROUNDING and not (one.may_be_0 and one.low == 0)) or high - x < ROUNDING]
    values = problem.coordinates.values(point.x)
    weakest = [one.weakest_at(value) for one, value in zip(problem.free, values, strict=True)]
    if findings := (problem.structural_findings(point) or statistical(names, relative, np.array(weakest))
                    or unexplained(normalised_rms(point.plain, problem.observed))):
        raise NotIdentifiable(findings)
    scale = problem.coordinates.slopes(values)
    start = np.array([one.start for one in problem.free])
    before, after = (
        [seen - one for seen, one in zip(problem.measured, problem.model.predict(at), strict=True)]
        for at in (start, values)
    )
    return Fit(free=problem.free, parameters=dict(zip(names, values.tolist(), strict=True)),
               covariance=relative * np.outer(scale, scale),
               error_before=normalised_rms(before, problem.measured),
               error_after=normalised_rms(after, problem.measured), residuals=after,
               white=np.split(point.white, np.cumsum([len(one) for one in point.plain])[:-1]),
               sensitivities=slopes, low_pass=problem.low_pass, noise=noise, converged=settled,
               iterations=iterations, cost=point.cost, at_bound=at_bound, ends=ends,
               prior=(problem.precision, problem.pull(point.x)))


def _covariance(problem: _FitProblem, point: _ResidualsAt, slopes: Array) -> Array:
    """Covariance (p, p) of the coordinates, from the information matrix and the scatter of the white residuals."""
    count, p = slopes.shape
    variance = float(point.white @ point.white) / max(count - p, 1)
    return variance * inverse_with_prior(slopes.T @ slopes + variance * np.diag(problem.precision))
