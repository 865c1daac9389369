"""Numbers of a model from what was measured: the grey-box prediction-error method (3.2.4 of Blum 2015; Ljung 1999).

Problem: find the numbers for which the model's predictions leave the least, say how certain they are, and say so when
the data cannot tell. Solution, in this order:

1. ask whether the data could tell at all (``identifiability``), before any fit;
2. Levenberg and Marquardt's steps, in the logarithm of what can only be positive, within bounds, on residuals as they
   are (output error), from every start that was given; the best goes on; by squares, as far from the end a robust
   loss has hills of its own;
3. fit a noise model to what is left, weigh by it (innovations form), and repeat 2 from there, until neither moves;
4. covariance of the estimates from the information matrix; ask once more whether what was found is an estimate, and
   whether the model at its best has anything to do with what was measured.

It knows models by ``Model`` only.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.dsp.decimating_low_pass import LowPass
from logger.identification.frequency_domain_model import Differentiable, Model
from logger.identification.identifiability import (
    NOTHING_BY_DIFFERENCES,
    NOTHING_EXACT,
    Finding,
    NotIdentifiable,
    statistical,
    structural,
    unexplained,
)
from logger.identification.noise_models import LEAST_SHARE, Autoregressive, Noise, White, Whitening
from logger.runs import normalised_rms
from logger.vehicle.named_parameters import Free

Array = npt.NDArray[np.float64]

HUBER = 1.345
"""Residuals beyond so many deviations count by their size and no longer by their square (P. J. Huber 1964)."""
_MAD_TO_DEVIATION = 1.4826
_TAME = 4.0
_LONGEST_STEP = 1.0
_FIRST_DAMPING = 1e-3
_LARGEST_DAMPING = 1e12
_FLAT = 1e-12  # of the steepest coordinate: what one without a slope is damped by
# Converged: what is left of the way is this share of a standard error, or this much of a relative change.
_CLOSE, _CLOSE_NOISE, _CLOSE_RELATIVE = 1e-5, 1e-4, 1e-11
_MOST_NOISE_ROUNDS = 20
_DIFFERENCE = 1e-4
_NUDGE = 0.03
_AT_BOUND = 1e-6
_FAR = 3.0
_ROOT_STEPS = 60


@dataclass(frozen=True)
class Options:
    """How to fit.

    rate_hz        of all records
    low_pass_hz    leave out what lies above [Hz]
    noise          candidates; the best by Schwarz's criterion is taken
    robust         Huber's loss: single wild residuals count less
    starts         further starts, values by name; what they do not name starts as in ``Free``
    most_steps     of one descent
    refuse         raise NotIdentifiable; otherwise ``Fit.verdict`` tells
    """

    rate_hz: float = 100.0
    low_pass_hz: float | None = None
    noise: Sequence[Noise] = (White(), Autoregressive())
    robust: bool = False
    starts: Sequence[Mapping[str, float]] = ()
    most_steps: int = 100
    refuse: bool = True


@dataclass(frozen=True, eq=False)
class Fit:
    """What a fit found.

    free               the numbers that were free, with their starts and bounds
    parameters         estimates by name
    standard_errors    by name
    covariance         (p, p) of the estimates, in their order
    correlation        (p, p)
    error_before       rms(measured - model) / rms(measured) at the start
    error_after        the same at the estimates
    residuals          measured minus model, per record
    white              residuals behind low-pass and noise model, in deviations, per record
    sensitivities      derivatives of the predictions behind the same, by relative change, joined (N, p)
    low_pass           the filter they went through
    noise              the noise model that was taken
    verdict            what the data cannot tell; empty when all is well
    converged          whether steps and noise model came to rest
    iterations         steps taken in all
    cost               half the sum of squares of ``white``, or Huber's
    at_bound           names that ended at a bound
    ends               where each start had come to before the noise model: (starts, p)
    """

    free: list[Free]
    parameters: dict[str, float]
    standard_errors: dict[str, float]
    covariance: Array
    correlation: Array
    error_before: float
    error_after: float
    residuals: list[Array]
    white: list[Array]
    sensitivities: Array
    low_pass: LowPass
    noise: Whitening
    verdict: list[Finding]
    converged: bool
    iterations: int
    cost: float
    at_bound: list[str]
    ends: Array


def fit(model: Model, measured: Sequence[Array], options: Options | None = None) -> Fit:
    """Fit a model's free numbers to records (n,), each as long as its prediction.

    Raises NotIdentifiable when the data cannot tell them, ValueError for measurements of other lengths than the
    predictions or nothing but zeros, no free number, or a start outside its bounds.
    """
    problem = _Problem(model, measured, options or Options())
    starts = problem.starts()
    findings = problem.structural_findings(problem.beside(starts[0]))
    if findings and problem.options.refuse:
        raise NotIdentifiable(findings)
    descents = [_descend(problem, start, problem.plain, robust=False) for start in starts]
    best = descents[int(np.argmin([one.cost for one in descents]))]
    iterations = sum(one.steps for one in descents)
    noise, best, rounds, settled = _innovations(problem, best)
    return _result(problem, best, noise, findings, iterations + rounds, settled,
                   np.array([problem.values(one.x) for one in descents]))


def spread_starts(free: Sequence[Free], count: int) -> list[dict[str, float]]:
    """So many starts, spread evenly between a third and three times each start, or as far as the bounds go.

    Additive recurrence with powers of the root of x^(p+1) = x + 1, which leaves no corner empty (M. Roberts 2018).
    """
    ratio = 1.0
    for _ in range(_ROOT_STEPS):
        ratio = (1 + ratio) ** (1 / (len(free) + 1))
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
                start[one.name] = one.low + share * (one.high - one.low)
        starts.append(start)
    return starts


# --- the problem in the coordinates that steps are taken in ---


@dataclass(frozen=True, eq=False)
class _Point:
    """A place, and what the residuals are there: white (N,), derivatives of the predictions (N, p), weights (N,)."""

    x: Array
    cost: float
    white: Array
    slopes: Array
    weights: Array
    plain: list[Array]
    steps: int = 0
    converged: bool = False


@dataclass(eq=False)
class _Problem:
    """A model and its measurements. A coordinate is the logarithm of the size of a number that keeps its sign; of any
    other, the number over half the width of its bounds."""

    model: Model
    measured: Sequence[Array]
    options: Options

    def __post_init__(self) -> None:
        self.free = list(self.model.parameters)
        if not self.free:
            raise ValueError("expected at least one free number")
        self.low_pass = LowPass(self.options.rate_hz, self.options.low_pass_hz)
        self.log = np.array([one.by_factors for one in self.free])
        self.unit = np.array([np.sign(one.start) if one.by_factors else (one.high - one.low) / 2 for one in self.free])
        low, high = (self.coordinates(np.array([getattr(one, end) for one in self.free])) for end in ("low", "high"))
        self.low, self.high = np.minimum(low, high), np.maximum(low, high)
        self.observed = [self.low_pass.apply(one) for one in self.measured]
        if not any(one.any() for one in self.measured):
            raise ValueError("expected measurements that move, found nothing but 0")
        self.floor = LEAST_SHARE * float(np.sqrt(np.mean(np.concatenate(self.observed) ** 2)))
        self.plain = White().fitted(self.observed, np.empty(0), self.low_pass, self.floor)

    def coordinates(self, values: Array) -> Array:
        return np.where(self.log, np.log(np.where(self.log, np.abs(values), 1.0)), values / self.unit)

    def values(self, x: Array) -> Array:
        return self.unit * np.where(self.log, np.exp(np.where(self.log, x, 0.0)), x)

    def per_coordinate(self, values: Array) -> Array:
        """Derivatives of the numbers by their coordinates (p,)."""
        return np.where(self.log, values, self.unit)

    def starts(self) -> list[Array]:
        first = {one.name: one.start for one in self.free}
        chosen = [first, *({**first, **more} for more in self.options.starts)]
        starts = [self.coordinates(np.array([start[one.name] for one in self.free])) for start in chosen]
        for start in starts:
            if not ((start >= self.low - _AT_BOUND) & (start <= self.high + _AT_BOUND)).all():
                raise ValueError("expected every start between its bounds")
        return starts

    def at(self, x: Array, noise: Whitening, deviation: float | None) -> _Point:
        """The residuals at a place, weighed by a noise model; by Huber's loss if they have a deviation."""
        values = self.values(x)
        predictions, slopes = self._linearised(values)
        if [len(one) for one in predictions] != [len(one) for one in self.measured]:
            raise ValueError("expected measurements as long as the predictions")
        scale = self.per_coordinate(values)
        plain = [seen - self.low_pass.apply(one) for seen, one in zip(self.observed, predictions, strict=True)]
        white = noise(plain)
        weighed = noise([self.low_pass.apply(slope) * scale for slope in slopes])
        if deviation is None:
            return _Point(x, 0.5 * float(white @ white), white, weighed, np.ones_like(white), plain)
        size = np.abs(white) / (HUBER * deviation)
        loss = np.where(size <= 1, 0.5 * white**2, (HUBER * deviation) ** 2 * (size - 0.5))
        return _Point(x, float(loss.sum()), white, weighed, 1 / np.maximum(size, 1.0), plain)

    def _linearised(self, values: Array) -> tuple[list[Array], list[Array]]:
        if isinstance(self.model, Differentiable):
            return self.model.linearised(values)
        predictions = self.model.predict(values)
        steps = _DIFFERENCE * self.per_coordinate(values)
        columns = []
        for index, step in enumerate(steps):
            ends = [self.model.predict(values + sign * step * (np.arange(len(values)) == index)) for sign in (-1, 1)]
            columns.append([(high - low) / (2 * step) for low, high in zip(*ends, strict=True)])
        return predictions, [np.stack(parts, axis=1) for parts in zip(*columns, strict=True)]

    def beside(self, start: Array) -> Array:
        """A place a little beside a start, where no symmetry of the start hides anything."""
        nudge = _NUDGE * np.cos(1.0 + 2.0 * np.arange(len(start))) * (len(start) > 1)
        return np.clip(start + nudge, self.low, self.high)

    def structural_findings(self, x: Array) -> list[Finding]:
        """What no such data could tell at a place."""
        nothing = NOTHING_EXACT if isinstance(self.model, Differentiable) else NOTHING_BY_DIFFERENCES
        values = self.values(x)
        predictions, slopes = self._linearised(values)
        predictions = [self.low_pass.apply(one) for one in predictions]
        derivatives = np.concatenate([self.low_pass.apply(slope) * self.per_coordinate(values) for slope in slopes])
        size = float(np.sqrt(sum((one**2).sum() for one in predictions)))
        return structural([one.name for one in self.free], derivatives, size, nothing)


def robust_deviation(white: Array) -> float:
    """Deviation of the bulk of samples (N,), by the median of their sizes."""
    return float(_MAD_TO_DEVIATION * np.median(np.abs(white)))


# --- descent ---


def _descend(problem: _Problem, start: Array, noise: Whitening, robust: bool) -> _Point:
    """Levenberg and Marquardt's steps with Nielsen's rule for the damping; a number at a bound that it presses against
    stays there."""
    deviation = None
    point = problem.at(np.clip(start, problem.low, problem.high), noise, deviation)
    if robust:
        deviation = robust_deviation(point.white)
        point = problem.at(point.x, noise, deviation)
    damping, growth = _FIRST_DAMPING, 2.0
    for count in range(1, problem.options.most_steps + 1):
        gradient, hessian, moving = _normal(problem, point)
        if not moving.any() or _left_of_the_way(point, gradient, hessian) < _CLOSE:
            return _arrived(point, count)
        size = np.diag(hessian)
        damped = hessian + damping * np.diag(size + _FLAT * size.max())
        step = np.zeros_like(point.x)
        step[moving] = np.linalg.solve(damped, gradient)
        step *= min(1.0, _LONGEST_STEP / np.abs(step).max())
        x = np.clip(point.x + step, problem.low, problem.high)
        if np.abs(x - point.x).max() < _CLOSE_RELATIVE:
            return _arrived(point, count)
        new = problem.at(x, noise, deviation)
        taken = (x - point.x)[moving]
        promised = float(taken @ gradient - 0.5 * taken @ hessian @ taken)
        gained = point.cost - new.cost
        if gained > 0:
            share = min(gained / max(promised, 1e-300), 1.0)
            damping *= max(1 / 3, 1 - (2 * share - 1) ** 3)
            point, growth = new, 2.0
        else:
            damping, growth = damping * growth, growth * 2
            if damping > _LARGEST_DAMPING:
                return _arrived(point, count)
    return _Point(**{**vars(point), "steps": problem.options.most_steps})


def _arrived(point: _Point, steps: int) -> _Point:
    return _Point(**{**vars(point), "steps": steps, "converged": True})


def _normal(problem: _Problem, point: _Point) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Downhill direction and Gauss and Newton's matrix of the coordinates that may move, and which these are."""
    downhill = point.slopes.T @ (point.weights * point.white)
    moving = ~(((point.x <= problem.low) & (downhill < 0)) | ((point.x >= problem.high) & (downhill > 0)))
    slopes = point.slopes[:, moving]
    return downhill[moving], slopes.T @ (point.weights[:, None] * slopes), moving


def _left_of_the_way(point: _Point, gradient: Array, hessian: Array) -> float:
    """Length of Gauss and Newton's step in standard errors."""
    scale = 1 / np.sqrt(np.diag(hessian) + 1e-300)
    step = np.linalg.lstsq(hessian * np.outer(scale, scale), gradient * scale, rcond=1e-12)[0]
    variance = 2 * point.cost / len(point.white)
    decrement = float(step @ (gradient * scale))
    return float(np.sqrt(max(0.0, decrement) / max(variance, 1e-300)))


def _innovations(problem: _Problem, point: _Point) -> tuple[Whitening, _Point, int, bool]:
    """Noise model and numbers in turn, until neither moves: (noise, place, steps, whether they came to rest)."""
    kinds, steps = list(problem.options.noise), 0
    for _ in range(_MOST_NOISE_ROUNDS):
        values, residuals = problem.values(point.x), point.plain
        if problem.options.robust:
            most = _TAME * robust_deviation(np.concatenate(residuals))
            residuals = [np.clip(one, -most, most) for one in residuals]
        fitted = [kind.fitted(residuals, values, problem.low_pass, problem.floor) for kind in kinds]
        best = int(np.argmin([one.criterion(len(point.white)) for one in fitted]))
        noise = fitted[best]
        kinds = [kinds[best]]
        if noise.name == "ar":
            kinds = [Autoregressive(int(noise.levels["order"]))]
        before = point.x
        point = _descend(problem, before, noise, problem.options.robust)
        steps += point.steps
        moved = point.x - before
        _, hessian, moving = _normal(problem, point)
        if np.sqrt(moved[moving] @ hessian @ moved[moving]) < _CLOSE_NOISE:
            return noise, point, steps, point.converged
    return noise, point, steps, False


# --- the result ---


def _result(problem: _Problem, point: _Point, noise: Whitening, findings: list[Finding], iterations: int,
            settled: bool, ends: Array) -> Fit:
    names = [one.name for one in problem.free]
    relative = _covariance(problem, point)
    at_bound = [name for name, x, low, high in zip(names, point.x, problem.low, problem.high, strict=True)
                if x - low < _AT_BOUND or high - x < _AT_BOUND]
    if not findings:
        findings = (problem.structural_findings(point.x)
                    or statistical(names, relative, np.array([one.weakest for one in problem.free]))
                    or unexplained(normalised_rms(point.plain, problem.observed)))
        if findings and problem.options.refuse:
            raise NotIdentifiable(findings)
    values = problem.values(point.x)
    scale = problem.per_coordinate(values)
    covariance = relative * np.outer(scale, scale)
    errors = np.sqrt(np.diag(covariance))
    start = np.array([one.start for one in problem.free])
    before, after = (
        [seen - one for seen, one in zip(problem.measured, problem.model.predict(at), strict=True)]
        for at in (start, values)
    )
    return Fit(
        free=problem.free, parameters=dict(zip(names, values.tolist(), strict=True)),
        standard_errors=dict(zip(names, errors.tolist(), strict=True)), covariance=covariance,
        correlation=covariance / np.maximum(np.outer(errors, errors), 1e-300),
        error_before=normalised_rms(before, problem.measured),
        error_after=normalised_rms(after, problem.measured), residuals=after,
        white=np.split(point.white, np.cumsum([len(one) for one in point.plain])[:-1]),
        sensitivities=point.slopes, low_pass=problem.low_pass, noise=noise, verdict=findings, converged=settled,
        iterations=iterations, cost=point.cost, at_bound=at_bound, ends=ends,
    )


def _covariance(problem: _Problem, point: _Point) -> Array:
    """Covariance (p, p) of the coordinates, from the information matrix and the scatter of the white residuals."""
    count, p = point.slopes.shape
    information = point.slopes.T @ point.slopes
    scale = 1 / np.sqrt(np.maximum(np.diag(information), 1e-300))
    inverse = np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-15, hermitian=True) * np.outer(scale, scale)
    variance = float(point.white @ point.white) / max(count - p, 1)
    if problem.options.robust:
        deviation = robust_deviation(point.white)
        pull = point.white * point.weights
        steady = float((np.abs(point.white) <= HUBER * deviation).mean())
        variance = float(pull @ pull) / max(count - p, 1) / steady**2
    return np.asarray(inverse * variance)
