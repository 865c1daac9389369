"""What a model leaves unexplained, as a process whose neighbours are alike, and how to take that likeness out.

Problem: residuals of a car are seldom white. A road that the profile does not contain comes through the car and is
coloured by it; weighed as white noise it costs accuracy, and the standard errors come out wrong. Solution: the
innovations form. A noise model is fitted to the residuals, and what each sample adds to those before it (Eq 3.10 and
3.11 of Blum 2015; Ljung 1999, 3.2) is what a fit makes small. From the first sample on this is exact: sample k is
predicted from all of the k before it, up to the model's memory.

- ``White``: nothing to predict.
- ``Autoregressive``: Burg's recursion over all records, its order the best by Schwarz's criterion.
- ``RoadNoise``: the car's response to a road of ISO 8608 (its shape known, its level free) over white noise of the
  sensor: two numbers for the whole spectrum.

Whether a better model would have explained what is left in the residuals is two questions and two tests (Ljung 1999,
16.6). Residuals that are like their neighbours mean that the noise model misses something, and that standard errors
cannot be trusted. Residuals that follow the road mean that the car's model misses something, and that the estimates
themselves are biased.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from logger.arrays import ROUNDING, Array
from logger.dsp.filters import DecimatingLowPass
from logger.dsp.linear_prediction import PredictionWhitener, burg, ladder, levinson

LEAST_SHARE = 1e-5
"""Noise is never taken for less than this share of the measurement: predictions are not more accurate themselves, and
what they leave of a record without noise is no process at all."""
ROAD_LEVEL = "gd_n0_cm3"
_MOST_ORDER = 60
_SAMPLES_PER_ORDER = 20
_MEMORY_S, _FILTER_MEMORY_S = 4.0, 1.0
_GRID = 8192
# The level of the road against that of the sensor is searched over so many powers of e.
_RATIO_LOGS = 40.0


@dataclass(frozen=True, eq=False)
class Whitening:
    """A noise model fitted to residuals.

    name          as users call it
    whiteners     one per record
    parameters    how many numbers were fitted
    deviance      minus twice the log-likelihood of the residuals, without its constant
    words         what was found
    levels        numbers of the model by name
    """

    name: str
    whiteners: list[PredictionWhitener]
    parameters: int
    deviance: float
    words: str
    levels: dict[str, float]

    def __call__(self, parts: Sequence[Array]) -> Array:
        """Whitened and joined: [(n, ...), ...] to (N, ...)."""
        return np.concatenate([whitener(part) for whitener, part in zip(self.whiteners, parts, strict=True)])

    def criterion(self, count: int) -> float:
        """Schwarz's: the smaller the better."""
        return self.deviance + self.parameters * float(np.log(count))


class NoiseModel(Protocol):
    """A kind of noise."""

    def fitted(self, residuals: Sequence[Array], values: Array, low_pass: DecimatingLowPass, floor: float) -> Whitening:
        """The noise that these residuals (behind the low-pass) of a model with these values are most likely from.

        Its deviation is never below ``floor``.
        """


class White:
    """Every sample by itself."""

    def fitted(self, residuals: Sequence[Array], values: Array, low_pass: DecimatingLowPass, floor: float) -> Whitening:
        """As ``NoiseModel``."""
        shape = PredictionWhitener(np.zeros((0, 0)), np.ones(1))
        if low_pass.cutoff_hz is not None:
            memory = min(int(_FILTER_MEMORY_S * low_pass.kept_hz), min(map(len, residuals)) - 1)
            shape = levinson(_covariance(_sensor_shape(low_pass), low_pass.kept_hz)[: memory + 1])
        deviation = max(rms([shape(one) for one in residuals]), floor)
        whitener = PredictionWhitener(shape.start / deviation, shape.taps / deviation)
        return _whitening("white", [whitener] * len(residuals), residuals, 1,
                          f"white noise of {deviation:.3g} m/s2", {"deviation_mps2": deviation})


@dataclass(frozen=True)
class Autoregressive:
    """Each sample from those before it; ``order`` None: as many as pay by Schwarz's criterion."""

    order: int | None = None

    def fitted(self, residuals: Sequence[Array], values: Array, low_pass: DecimatingLowPass, floor: float) -> Whitening:
        """As ``NoiseModel``. The order is at most 60, and a twentieth of the samples."""
        count = sum(map(len, residuals))
        most = min(_MOST_ORDER, count // _SAMPLES_PER_ORDER) if self.order is None else self.order
        reflections = burg(residuals, min(most, min(map(len, residuals)) - 1), floor)
        power = rms(residuals) ** 2 + floor**2
        powers = power * np.cumprod(np.concatenate([[1.0], 1 - reflections**2]))
        order = len(reflections)
        if self.order is None:
            order = int(np.argmin(count * np.log(powers) + np.arange(len(powers)) * np.log(count)))
        whitener = ladder(reflections[:order], power)
        deviation = 1 / float(whitener.taps[0])
        return _whitening("ar", [whitener] * len(residuals), residuals, order + 1,
                          f"autoregressive noise of order {order}, innovations of {deviation:.3g} m/s2",
                          {"order": order, "deviation_mps2": deviation})


@dataclass(frozen=True)
class RoadNoise:
    """A random road through the car, and the sensor's own noise.

    spectra    what the sensor makes of a road of Gd(n0) = 1 cm3 with these values, at frequencies (f,), for each
               record: one-sided [m2/s4/Hz per cm3]
    """

    spectra: Callable[[Array, Array], list[Array]]

    def fitted(self, residuals: Sequence[Array], values: Array, low_pass: DecimatingLowPass, floor: float) -> Whitening:
        """As ``NoiseModel``. The two levels are those of Whittle's likelihood of the residuals' tapered transforms."""
        rate_hz = low_pass.kept_hz
        f_hz = _grid(rate_hz)
        roads = _behind(low_pass, lambda f: self.spectra(values, f))
        sensor = _sensor_shape(low_pass)
        road_power, sensor_power = _levels(residuals, roads, sensor, f_hz, floor)
        memory = int(_MEMORY_S * rate_hz)
        whiteners = []
        for road, residual in zip(roads, residuals, strict=True):
            covariance = _covariance(road_power * road + sensor_power * sensor, rate_hz)
            whiteners.append(levinson(covariance[: min(memory, len(residual) - 1) + 1]))
        deviation = float(np.sqrt(sensor_power))
        return _whitening("road", whiteners, residuals, 2,
                          f"a road of Gd(n0) {road_power:.3g} cm3 that the profile does not contain, and white noise "
                          f"of {deviation:.3g} m/s2", {ROAD_LEVEL: road_power, "deviation_mps2": deviation})


def _grid(rate_hz: float) -> Array:
    """The frequencies that spectra are held at [Hz]."""
    return np.arange(_GRID // 2 + 1) * rate_hz / _GRID


def _behind(low_pass: DecimatingLowPass, spectra: Callable[[Array], list[Array]]) -> list[Array]:
    """Spectra behind the low-pass, with what folds down as fewer samples are kept."""
    f_hz = _grid(low_pass.kept_hz)
    if low_pass.kept_hz == low_pass.rate_hz:
        return [low_pass.gain(f_hz) ** 2 * one for one in spectra(f_hz)]
    above_hz = np.minimum(low_pass.kept_hz - f_hz, low_pass.rate_hz / 2)
    gain, gain_above = low_pass.gain(f_hz) ** 2, low_pass.gain(above_hz) ** 2
    return [gain * one + gain_above * other for one, other in zip(spectra(f_hz), spectra(above_hz), strict=True)]


def _sensor_shape(low_pass: DecimatingLowPass) -> Array:
    """One-sided spectrum (f,) of white noise of power 1 before the low-pass, behind it [1/Hz]."""
    return _behind(low_pass, lambda f_hz: [np.full_like(f_hz, 2 / low_pass.rate_hz)])[0]


def _covariance(spectrum: Array, rate_hz: float) -> Array:
    """Covariances at lags 0, 1, 2 ... of a process with this one-sided spectrum up to half its rate."""
    return np.asarray(np.fft.irfft(spectrum, _GRID) * rate_hz / 2)


def _whitening(name: str, whiteners: list[PredictionWhitener], residuals: Sequence[Array], parameters: int, words: str,
               levels: dict[str, float]) -> Whitening:
    pairs = list(zip(whiteners, residuals, strict=True))
    squares = sum(float((whitener(one) ** 2).sum()) for whitener, one in pairs)
    deviance = squares + 2 * sum(whitener.log_deviations(len(one)) for whitener, one in pairs)
    return Whitening(name, whiteners, parameters, deviance, words, levels)


def rms(parts: Sequence[Array]) -> float:
    """Root-mean-square of all samples of signals [(n,), ...]."""
    return float(np.sqrt(sum((part**2).sum() for part in parts) / sum(map(len, parts))))


# --- the road's level ---


def _levels(residuals: Sequence[Array], roads: Sequence[Array], sensor: Array, f_hz: Array,
            floor: float) -> tuple[float, float]:
    """Powers of the road and of the sensor whose sum of spectra is the likeliest (P. Whittle 1953), with a deviation of
    the sensor of at least ``floor``.

    For each ratio of the two the common level has a formula; the ratio is searched.
    """
    from scipy.optimize import minimize_scalar

    rate_hz = 2 * float(f_hz[-1])
    periodograms, road_parts, sensor_parts = [], [], []
    for residual, road in zip(residuals, roads, strict=True):
        taper = np.hanning(len(residual) + 2)[1:-1]
        transform = np.fft.rfft((residual - residual.mean()) * taper)[1:]
        at_hz = np.arange(1, len(transform) + 1) * rate_hz / len(residual)
        periodograms.append(np.abs(transform) ** 2 * 2 / (rate_hz * (taper @ taper)))
        road_parts.append(np.interp(at_hz, f_hz, road))
        sensor_parts.append(np.interp(at_hz, f_hz, sensor))
    periodogram, road_all, sensor_all = map(np.concatenate, (periodograms, road_parts, sensor_parts))
    periodogram = periodogram + floor**2 * sensor_all
    unit = float(road_all.mean() / sensor_all.mean())

    def level_of(log_ratio: float) -> tuple[Array, float]:
        shape = np.exp(log_ratio) / unit * road_all + sensor_all
        return shape, float((periodogram / shape).mean())

    def deviance(log_ratio: float) -> float:
        shape, level = level_of(log_ratio)
        return float(np.log(shape * level).mean())

    ratio = float(minimize_scalar(deviance, bounds=(-_RATIO_LOGS / 2, _RATIO_LOGS / 2), method="bounded",
                                  options={"xatol": ROUNDING}).x)
    level = level_of(ratio)[1]
    return float(np.exp(ratio)) / unit * level, max(level, floor**2)


LAGS = 25
DOUBT = 0.01
"""A probability below this is taken as a no."""
_RANK = 1e-6


@dataclass(frozen=True)
class Test:
    """A sum of squares that has so many degrees of freedom when all is well, and how probable one so large then is.

    ``p_value`` is NaN where nothing could be tested.
    """

    statistic: float
    degrees: int
    p_value: float

    @property
    def passed(self) -> bool:
        """Whether nothing speaks against it."""
        return not self.p_value < DOUBT


UNTESTED = Test(0.0, 0, float("nan"))


def autocorrelations(signals: Sequence[Array], lags: int) -> Array:
    """Correlations of the samples of signals [(n,), ...] that lie 1 ... lags apart (lags,)."""
    power = sum(float(one @ one) for one in signals) or 1.0
    return np.array([sum(float(one[lag:] @ one[:-lag]) for one in signals) for lag in range(1, lags + 1)]) / power


def autocorrelation(white: Sequence[Array], fitted: int) -> Test:
    """Whether residuals [(n,), ...] are uncorrelated over 1 to ``LAGS`` samples (G. M. Ljung and G. E. P. Box 1978).

    fitted    numbers of the noise model beyond its power, which take so many degrees of freedom; lags grow by them
    """
    count, reach = sum(map(len, white)), min(LAGS + fitted, min(map(len, white)) - 1)
    if not any(one.any() for one in white) or reach <= fitted:
        return UNTESTED
    squares = autocorrelations(white, reach)**2 / (count - np.arange(1, reach + 1))
    return _test(count * (count + 2) * float(squares.sum()), reach - fitted)


def cross_correlation(white: Sequence[Array], inputs: Sequence[Array], sensitivities: Array) -> Test:
    """Whether residuals [(n,), ...] owe anything to the inputs [(n, w), ...] of 0 to ``LAGS`` samples before.

    inputs           behind the same low-pass and noise model as the residuals
    sensitivities    (N, p): what the fit could explain by its numbers has been explained and is left out
    """
    columns = np.concatenate([_lagged(one) for one in inputs])
    columns = columns - sensitivities @ np.linalg.lstsq(sensitivities, columns, rcond=None)[0]
    joined = np.concatenate(white)
    lengths = np.sqrt((columns**2).sum(axis=0))
    if not (joined.any() and lengths.any()):
        return UNTESTED
    basis, values, _ = np.linalg.svd(columns[:, lengths > 0] / lengths[lengths > 0], full_matrices=False)
    basis = basis[:, values > _RANK * values[0]]
    variance = float(joined @ joined) / len(joined)
    return _test(float(((basis.T @ joined) ** 2).sum()) / variance, basis.shape[1])


def _lagged(inputs: Array) -> Array:
    """Inputs (n, w) of 0 to ``LAGS`` samples before (n, w (LAGS + 1)); 0 before the first one."""
    padded = np.concatenate([np.zeros((LAGS, inputs.shape[1])), inputs])
    return np.concatenate([padded[LAGS - lag : LAGS - lag + len(inputs)] for lag in range(LAGS + 1)], axis=1)


def _test(statistic: float, degrees: int) -> Test:
    from scipy.special import chdtrc

    return Test(statistic, degrees, float(chdtrc(degrees, statistic)))
