"""Models that express a sample by the samples before it: AR, ARX, ARMAX (Eq 3.8, 3.9; 3.2.3 of Blum 2015).

The misprint of the source is mended here: its Eq 3.9, called ARMAX, has no input; Eq 3.8 has it.

All are one regression on lagged samples, of vectors where there are several channels. In ARMAX the errors of the past
are regressors too. They are not known, and are taken from a long ARX model fitted before (Hannan and Rissanen, 1982).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.modal.mode import Array, OrderPoles, order_poles
from logger.modal.moments import Moments

_RIDGE = 1e-11
_FALSE_ALARM = 1e-3  # chance that a record without modes yields a pole that is louder than what is beside it
_LEAST_BINS = 3


@dataclass(frozen=True)
class Regressors:
    """Which channels of the moments are what: outputs first, then inputs, then errors of the past."""

    outputs: int
    inputs: int = 0
    errors: int = 0

    def places(self, moments: Moments, order: int) -> npt.NDArray[np.intp]:
        """Of the inputs now, then of all channels one sample ago, two samples ago, ... ``order`` samples ago."""
        last = len(moments.products) // moments.channels - 1
        now = moments.take(range(last, last + 1), slice(self.outputs, self.outputs + self.inputs))
        before = moments.take(range(last - 1, last - 1 - order, -1), slice(None))
        return np.concatenate([now, before])


def coefficients(moments: Moments, which: Regressors, order: int) -> Array:
    """Of the regression of the outputs on ``which.places``: (outputs, regressors)."""
    g, places = moments.products, which.places(moments, order)
    now = _now(moments, which)
    known = g[np.ix_(places, places)]
    ridge = _RIDGE * np.trace(known) / len(known) * np.eye(len(known))
    return np.linalg.solve(known + ridge, g[np.ix_(places, now)]).T


def misfits(moments: Moments, which: Regressors, most: int) -> Array:
    """log det of the covariance of one-step errors for orders 0, 1, ... most, by one decomposition."""
    g, places = moments.products, which.places(moments, most)
    now = _now(moments, which)
    known = g[np.ix_(places, places)]
    root = np.linalg.cholesky(known + _RIDGE * np.trace(known) / len(known) * np.eye(len(known)))
    seen = np.linalg.solve(root, g[np.ix_(places, now)])
    p = which.outputs
    explained = np.concatenate([np.zeros((1, p, p)), np.cumsum(seen[:, :, None] * seen[:, None, :], axis=0)])
    ends = slice(which.inputs, None, moments.channels)
    return np.asarray(np.linalg.slogdet(g[np.ix_(now, now)] - explained[ends])[1])


def poles(moments: Moments, which: Regressors, order: int, rate_hz: float) -> OrderPoles:
    """Vibrating poles of the model of ``order`` lags."""
    p, step = which.outputs, moments.channels
    found = coefficients(moments, which, order)[:, which.inputs:].reshape(p, order, step)[:, :, :p].reshape(p, -1)
    transition = np.vstack([found, np.eye((order - 1) * p, order * p)])
    result = order_poles(transition, found, rate_hz)
    return OrderPoles(order, result.poles, result.shapes)


def stands_out(
    moments: Moments, which: Regressors, order: int, rate_hz: float, found: OrderPoles
) -> npt.NDArray[np.bool_]:
    """Which poles (n,) have a peak of their own in the model's spectrum, A(z)^-1 of white noise.

    Most poles of a long autoregression only shape the floor between the peaks, and do so in every order. A pole has a
    peak when the spectrum, summed over the channels, falls to half on the way to three half-power widths on both sides
    (their geometric mean), and no pole of less damping lies within one.
    """
    p = which.outputs
    lagged = coefficients(moments, which, order)[:, which.inputs:].reshape(p, order, -1)[:, :, :p].transpose(1, 0, 2)
    frequency, width = found.poles.imag, np.abs(found.poles.real)
    sides = np.clip(frequency + 3 * np.array([[-1], [1]]) * width, 0.0, np.pi * rate_hz)
    at = np.concatenate([frequency, *sides])
    turns = np.exp(-1j * np.outer(at / rate_hz, np.arange(1, order + 1)))
    power = (np.abs(np.linalg.inv(np.eye(p) - np.tensordot(turns, lagged, 1))) ** 2).sum(axis=(1, 2)).reshape(3, -1)
    near = np.abs(frequency[:, None] - frequency) < width[:, None]
    taken = (near & (width < width[:, None])).any(axis=1)
    return np.asarray((power[0] ** 2 > 4 * power[1] * power[2]) & ~taken)


def louder_than_beside(samples: Array, rate_hz: float, found: OrderPoles) -> npt.NDArray[np.bool_]:
    """Which poles (n,) the record (samples, channels) itself has: its power within a half-power width is more than
    on both sides of it (three to six widths away, their geometric mean), and by more than chance makes it.

    A long autoregression draws peaks into white noise, and keeps them from order to order.
    """
    from scipy.special import chdtri

    taper = np.hanning(len(samples) + 2)[1:-1, None]
    power = (np.abs(np.fft.rfft((samples - samples.mean(axis=0)) * taper, axis=0)) ** 2).sum(axis=1)
    sums = np.concatenate([[0.0], np.cumsum(power)])
    step = 2 * np.pi * rate_hz / len(samples)
    middle = found.poles.imag / step
    width = np.maximum(np.abs(found.poles.real) / step, _LEAST_BINS / 2)

    def mean(low: Array, high: Array) -> Array:
        first = np.clip(np.rint(low), 1, len(power) - 1).astype(int)
        last = np.clip(np.rint(high), first + 1, len(power)).astype(int)
        return np.asarray((sums[last] - sums[first]) / (last - first))

    beside = np.sqrt(mean(middle - 6 * width, middle - 3 * width) * mean(middle + 3 * width, middle + 6 * width))
    freedom = 2 * width  # two for each of as many bins, which the taper makes alike by twos
    limit = chdtri(freedom, _FALSE_ALARM / max(len(width), 1)) / freedom
    return np.asarray(mean(middle - width, middle + width) > limit * beside)


def errors(samples: Array, moments: Moments, which: Regressors, order: int) -> Array:
    """One-step errors (samples - order, outputs) of the ARX model of a record (samples, channels)."""
    found = coefficients(moments, which, order)
    count = len(samples) - order
    left = samples[order:, :which.outputs] - samples[order:, which.outputs:] @ found[:, :which.inputs].T
    for lag in range(1, order + 1):
        own = slice(which.inputs + (lag - 1) * samples.shape[1], which.inputs + lag * samples.shape[1])
        left -= samples[order - lag:order - lag + count] @ found[:, own].T
    return left


def _now(moments: Moments, which: Regressors) -> npt.NDArray[np.intp]:
    last = len(moments.products) // moments.channels - 1
    return moments.take(range(last, last + 1), slice(0, which.outputs))
