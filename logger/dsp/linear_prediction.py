"""Linear prediction: each sample from those before it, and filters that leave only what cannot be predicted.

A stationary process is predicted from its covariances (Levinson and Durbin) or from a record of it (J. P. Burg 1975);
from the first sample on: sample k is predicted from all of the k before it, up to the order.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array


@dataclass(frozen=True, eq=False)
class PredictionWhitener:
    """Takes out of each sample what those before it predict of it, and gives the rest in units of its deviation.

    start    (m, m) lower triangle: the first samples, which have fewer before them
    taps     (m + 1,) all others, the newest sample first
    """

    start: Array
    taps: Array

    def __call__(self, samples: Array) -> Array:
        """(n, ...) to (n, ...)."""
        m = min(len(self.start), len(samples))
        if len(self.taps) == 1:
            return samples * self.taps[0]
        length = len(samples) + len(self.taps)
        shape = (-1,) + (1,) * (samples.ndim - 1)
        product = np.fft.rfft(samples, length, axis=0) * np.fft.rfft(self.taps, length).reshape(shape)
        white = np.fft.irfft(product, length, axis=0)[: len(samples)]
        white[:m] = np.tensordot(self.start[:m, :m], samples[:m], axes=1)
        return np.asarray(white)

    def log_deviations(self, count: int) -> float:
        """Sum of the logarithms of the deviations of ``count`` samples."""
        m = min(len(self.start), count)
        return float(-np.log(np.diag(self.start)[:m]).sum() - (count - m) * np.log(self.taps[0]))


def burg(parts: Sequence[Array], order: int, floor: float) -> Array:
    """Reflection coefficients (order,) that make forward and backward errors of all parts least (J. P. Burg 1975), with
    white noise of the deviation ``floor`` added to the parts."""
    forward, backward = [part[1:] for part in parts], [part[:-1] for part in parts]
    reflections = np.zeros(order)
    for k in range(order):
        energy = sum(float(f @ f + b @ b) + 2 * len(f) * floor**2 for f, b in zip(forward, backward, strict=True))
        if energy <= 0:
            break
        r = -2 * sum(float(f @ b) for f, b in zip(forward, backward, strict=True)) / energy
        reflections[k] = r
        forward, backward = ([(f + r * b)[1:] for f, b in zip(forward, backward, strict=True)],
                             [(b + r * f)[:-1] for f, b in zip(forward, backward, strict=True)])
    return reflections


def ladder(reflections: Array, power: float) -> PredictionWhitener:
    """The predictors of every order up to the last one, from reflection coefficients (m,) and the process's power."""
    m = len(reflections)
    start = np.zeros((m, m))
    taps = np.ones(1)
    for k, r in enumerate(reflections):
        start[k, : k + 1] = taps[::-1] / np.sqrt(power)
        taps = np.append(taps, 0.0) + r * np.append(0.0, taps[::-1])
        power *= 1 - r * r
    return PredictionWhitener(start, taps / np.sqrt(power))


def levinson(covariance: Array) -> PredictionWhitener:
    """The predictors of a process with these covariances (m + 1,) at lags 0, 1, 2 ... (Levinson and Durbin)."""
    m = len(covariance) - 1
    start, taps, power = np.zeros((m, m)), np.zeros(m + 1), float(covariance[0])
    taps[0] = 1.0
    for k in range(m):
        newest_last = taps[k::-1] if k else taps[:1]
        start[k, : k + 1] = newest_last / np.sqrt(power)
        r = -float(newest_last @ covariance[1 : k + 2]) / power
        taps[1 : k + 2] += r * start[k, : k + 1] * np.sqrt(power)
        power *= 1 - r * r
    return PredictionWhitener(start, taps / np.sqrt(power))
