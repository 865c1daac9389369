"""Sums of products of a record's lagged samples, by segment: all that a linear identification needs of the data.

Problem: subspace and autoregressive methods are regressions on some hundred lagged samples. Building those columns for
an hour of data takes gigabytes, and a standard error by repetition would build them again and again.

Solution: sum v[t + a] v[t + b]' over a segment differs from that of the lags before only by products at the segment's
ends, so all lags cost as much as one row of them. Sums of segments add up: the record without one segment (for a
jackknife) is a subtraction.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.modal.mode import Array, Complex, OrderPoles

Estimate = Callable[["Moments"], OrderPoles]


@dataclass(frozen=True)
class Moments:
    """Mean of v[t + a] v[t + b]' over ``count`` instants: (lags * channels, lags * channels), block [a, b]."""

    products: Array
    count: int
    channels: int

    def take(self, lags: range, channels: slice) -> npt.NDArray[np.intp]:
        """Places of these lags and channels."""
        places = np.array(lags)[:, None] * self.channels + np.arange(self.channels)[channels]
        return places.ravel().astype(np.intp)


@dataclass(frozen=True)
class Segments:
    """Sums (segments, lags * channels, lags * channels) of the products of each of several equal segments."""

    sums: Array
    length: int
    channels: int

    def whole(self) -> Moments:
        """Of the whole record."""
        count = len(self.sums) * self.length
        return Moments(self.sums.sum(axis=0) / count, count, self.channels)

    def without_one(self) -> Iterator[Moments]:
        """Of the record without its first segment, without its second, ..."""
        total = self.sums.sum(axis=0)
        count = (len(self.sums) - 1) * self.length
        return (Moments((total - own) / count, count, self.channels) for own in self.sums)


def segment_products(samples: Array, lags: int, segments: int) -> Segments:
    """Products of ``lags`` successive samples of a record (samples, channels), in ``segments`` equal segments."""
    count, q = samples.shape
    length = (count - lags + 1) // segments
    starts = np.arange(segments) * length
    ends = starts + length
    first = np.empty((segments, q, lags, q))
    for lag in range(lags):
        ahead = samples[lag:lag + segments * length].reshape(segments, length, q)
        first[:, :, lag] = samples[:segments * length].reshape(segments, length, q).swapaxes(1, 2) @ ahead
    sums = np.empty((segments, lags, q, lags, q))
    row = first
    span = np.arange(lags)
    for a in range(lags):
        sums[:, a, :, a:] = row
        sums[:, a:, :, a] = row.transpose(0, 2, 3, 1)
        if a == lags - 1:
            break
        leaving, coming = samples[starts + a], samples[ends + a]  # (segments, q)
        later = span[:lags - 1 - a]
        row = (row[:, :, :-1]
               - leaving[:, :, None, None] * samples[(starts + a)[:, None] + later][:, None]
               + coming[:, :, None, None] * samples[(ends + a)[:, None] + later][:, None])
    return Segments(sums.reshape(segments, lags * q, lags * q), length, q)


def jackknife(segments: Segments, estimate: Estimate, reference: Complex) -> Array:
    """Covariance (n, 2, 2) of Re s, Im s [rad/s] of each reference pole, from leaving out one segment after the other.

    Each is followed to the nearest pole of each repetition. The delete-one jackknife (Efron and Stein, 1981) gives the
    variance of any smooth estimate without a formula for it, and sees what a formula that assumes white noise does not.
    """
    followed = []
    for moments in segments.without_one():
        poles = estimate(moments).poles
        if not len(poles):
            return np.full((len(reference), 2, 2), np.inf)
        followed.append(poles[np.abs(poles[:, None] - reference).argmin(axis=0)])
    apart = np.array(followed) - np.mean(followed, axis=0)
    both = np.stack([apart.real, apart.imag], axis=2)  # (segments, n, 2)
    n = len(both)
    return np.asarray(np.einsum("sni,snj->nij", both, both) * (n - 1) / n)
