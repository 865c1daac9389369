"""Force-state map: the force missing in the suspensions, by their rate and travel, from the residual of a model.

Problem: one accelerometer on the body, and a force that is missing somewhere below it changes the motion that makes it.
Solution: a small force that the model lacks passes through the model's own transfer from a suspension to the sensor. So
the forces of hat functions, of rate and of travel as the model has them, are sent through that transfer, and the
residual is regressed on the responses; the coefficients are the missing force at the knots (the force-state map of
S. F. Masri and T. K. Caughey 1979, by output error). What another linear spring or damper, another gain or a small
delay would do is projected out, as a few per cent of those are never physics. Both sides pass the residual's own
autoregressive whitening first, so that coloured noise is not taken for evidence.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.dsp.linear_prediction import levinson
from logger.dsp.resample import PASS_OF_RATE
from logger.identification.noise_models import autocorrelation, autocorrelations
from logger.lab.residuals.breakdown import ModelResiduals
from logger.runs import SENSOR
from logger.simulation.virtual_drive import output_of
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.simulate import smooth_length

Shape = Callable[[Array, Array], Array]

_KNOTS = np.array([-2.8, -1.8, -1.1, -0.6, -0.25, 0.0, 0.25, 0.6, 1.1, 1.8, 2.8])
"""Knots of a curve, in units of the r.m.s. of its coordinate: closer together where more samples are, the outermost
ones where half a per cent of a normal distribution is beyond (its quantile there is 2.81), or where the largest is."""


@dataclass(frozen=True, eq=False)
class Curve:
    """A missing force by one coordinate: knots (k,), force and its standard error [N] in each suspension.

    A linear law is projected out. p_value: of no missing force; share: of the residual power that it explains
    """

    at: Array
    force_n: Array
    error_n: Array
    p_value: float
    share: float


@dataclass(frozen=True)
class Term:
    """The coefficient of one term with its standard error, its p-value, and the share of the residual power that it
    explains."""

    value: float
    error: float
    p_value: float
    share: float


@dataclass(frozen=True, eq=False)
class ForceMap:
    """The missing force.

    by_rate [m/s], by_travel [m]
    asymmetry     coefficient of |rate|: what extension has more than compression [N s/m]
    progression   coefficient of rate |rate| [N s2/m2]: above 0 the damper stiffens with speed, below it yields
    hardening     coefficient of travel^3 [N/m3]
    """

    by_rate: Curve
    by_travel: Curve
    asymmetry: Term
    progression: Term
    hardening: Term


def force_map(residuals: ModelResiduals) -> ForceMap:
    """The force that is missing in the suspensions of a model, by its residuals; the same law in each suspension."""
    regression = _Regression.of(residuals)

    def term(shape: Shape) -> Term:
        coefficients, covariance, p_value, share = regression.fit(_responses_at_sensor(residuals, [shape]))
        return Term(float(coefficients[0]), float(np.sqrt(covariance[0, 0])), p_value, share)

    return ForceMap(_curve(regression, residuals, of_rate=True), _curve(regression, residuals, of_rate=False),
                    term(lambda _, rate: np.abs(rate)), term(lambda _, rate: rate * np.abs(rate)),
                    term(lambda travel, _: travel**3))


def _whitening(residual: Sequence[Array]) -> Array:
    """Filter (13,) that makes residuals [(n,), ...] white, by Yule and Walker; [1] for residuals that are white."""
    if autocorrelation(residual, 0).passed:
        return np.ones(1)
    taps = levinson(np.concatenate([[1 + 1e-6], autocorrelations(residual, 12)])).taps
    return taps / taps[0]


@dataclass(frozen=True, eq=False)
class _Regression:
    """Residuals (n,) and nuisance columns (n, m), per run, and the filter that whitens them."""

    residual: Sequence[Array]
    nuisance: Sequence[Array]
    whitening: Array

    @staticmethod
    def of(residuals: ModelResiduals) -> "_Regression":
        """The regression with each linear damper and spring, the gain and a small delay as nuisance columns."""
        wheels = range(residuals.responses[0].rate_mps.shape[1])
        dampers, springs = (_responses_at_sensor(residuals, [_linear_law(wheel, of_rate) for wheel in wheels])
                            for of_rate in (True, False))
        rates = [np.gradient(one, 1 / residuals.rate_hz) for one in residuals.model]
        nuisance = [np.column_stack(one) for one in zip(dampers, springs, residuals.model, rates, strict=True)]
        return _Regression(residuals.residual, nuisance, _whitening(residuals.residual))

    def fit(self, columns: Sequence[Array]) -> tuple[Array, Array, float, float]:
        """Regression on columns (n, k) per run: coefficients (k,), their covariance (k, k), the p-value of all together
        (these by whitened residuals), and the share of the residual that they explain."""
        from scipy.special import fdtrc

        coefficients, covariance, rank, freedom, power, rest = _fit(
            *(self._whitened(one) for one in (self.residual, self.nuisance, columns)))
        if rank == 0 or freedom < 1 or not rest > 0:
            return coefficients, covariance, float("nan"), 0.0
        variance = rest / freedom
        p_value = float(fdtrc(rank, freedom, max(power - rest, 0.0) / rank / variance))
        _, _, rank, freedom, power, rest = _fit(self.residual, self.nuisance, columns)
        share = 1 - rest / power * (freedom + rank) / freedom if power > 0 else 0.0
        return coefficients, covariance * variance, p_value, max(share, 0.0)

    def _whitened(self, signals: Sequence[Array]) -> list[Array]:
        order = len(self.whitening) - 1
        return [sum((weight * one[order - lag : len(one) - lag] for lag, weight in enumerate(self.whitening)),
                    np.zeros_like(one[order:])) for one in signals]


def _fit(target: Sequence[Array], others: Sequence[Array], columns: Sequence[Array],
         ) -> tuple[Array, Array, int, int, float, float]:
    """Least squares of a target y (n,) by columns X (n, k), nuisance columns Z (n, m) projected out, given per run:
    coefficients (k,), inv(X'X), the rank, the degrees of freedom, and the squares of y before and after."""
    y, z, x = (np.concatenate(one) for one in (target, others, columns))
    vectors, sizes, _ = np.linalg.svd(z / np.maximum(np.sqrt((z**2).sum(axis=0)), 1e-300), full_matrices=False)
    basis = vectors[:, sizes > 1e-9 * sizes[0]]
    scale = np.sqrt((x**2).sum(axis=0))
    scale = np.where(scale > np.finfo(float).tiny, scale, 1.0)
    y, x = (one - basis @ (basis.T @ one) for one in (y, x / scale))
    product = x.T @ x
    values, directions = np.linalg.eigh(product)
    kept = values > 1e-7
    inverse = (directions[:, kept] / values[kept]) @ directions[:, kept].T
    coefficients = inverse @ (x.T @ y)
    rank, before = int(kept.sum()), float(y @ y)
    after = before - float(coefficients @ product @ coefficients)
    return (coefficients / scale, inverse / np.outer(scale, scale), rank, len(y) - basis.shape[1] - rank, before, after)


def _curve(regression: _Regression, residuals: ModelResiduals, of_rate: bool) -> Curve:
    """The curve of the missing force by rate or by travel."""
    driven = np.concatenate([(one.rate_mps if of_rate else one.travel_m).ravel() for one in residuals.responses])
    knots = _KNOTS * (min(float(np.sqrt(np.mean(driven**2))), float(np.abs(driven).max()) / _KNOTS[-1]) or 1.0)
    used = np.flatnonzero(_KNOTS)
    coefficients, covariance, p_value, share = regression.fit(
        _responses_at_sensor(residuals, [_hat(knots, int(index), of_rate) for index in used]))
    # A straight line through 0 cannot be distinguished from a spring or damper a little off: it is projected out, each
    # knot weighted by how often it is reached.
    weight = np.exp(-0.5 * (knots[used] / knots[-1] * _KNOTS[-1]) ** 2)
    line = knots[used]
    straight = np.eye(len(used)) - np.outer(line, weight * line) / float(weight @ line**2)
    force, errors = np.zeros_like(knots), np.zeros_like(knots)
    force[used] = straight @ coefficients
    errors[used] = np.sqrt(np.maximum(np.diag(straight @ covariance @ straight.T), 0.0))
    return Curve(knots, force, errors, p_value, share)


def _responses_at_sensor(residuals: ModelResiduals, shapes: Sequence[Shape]) -> list[Array]:
    """Responses of the sensor to forces of these shapes in the suspensions, up to where the recorder's filter begins:
    (n, k) per run, the samples that count."""
    car, structure, found = residuals.car, residuals.car.structure, []
    for run, response in zip(residuals.runs, residuals.responses, strict=True):
        length = smooth_length(run.count + round(4 * run.rate_hz))
        f_hz = np.asarray(np.fft.rfftfreq(length, 1 / run.rate_hz), float)
        # Where there is no spring a steady force has no end.
        kept = np.flatnonzero((f_hz < PASS_OF_RATE * run.rate_hz) & ((f_hz > 0) | bool(structure.stiffness.any())))
        if structure.held:
            transfer = np.asarray(car.factor(np.asarray(2j * np.pi * f_hz[kept])))[:, None]
        else:
            output = car.output if run.facts.main.name == SENSOR else output_of(car, run.facts.main)
            transfer = LinearCar(structure, output, sensors=car.sensors).by_force(f_hz[kept])
        columns = []
        for shape in shapes:
            force = np.fft.rfft(shape(response.travel_m, response.rate_mps), length, axis=0)
            arriving = np.zeros(len(f_hz), dtype=np.complex128)
            arriving[kept] = (force[kept] * transfer).sum(axis=1)
            columns.append(np.fft.irfft(arriving, length)[run.first : run.count])
        found.append(np.stack(columns, axis=1))
    return found


def _linear_law(wheel: int, of_rate: bool) -> Shape:
    """The force of a linear damper or spring of one wheel alone."""
    def shape(travel: Array, rate: Array) -> Array:
        return (rate if of_rate else travel) * np.eye(rate.shape[1])[wheel]

    return shape


def _hat(knots: Array, index: int, of_rate: bool) -> Shape:
    """A hat function: 1 at one knot, 0 at its neighbours, linear between; constant beyond the outermost knots."""
    def shape(travel: Array, rate: Array) -> Array:
        return np.interp(rate if of_rate else travel, knots, np.eye(len(knots))[index])

    return shape
