"""State-space models from data, by projection of the future on the past.

Problem: poles of x[k+1] = A x[k] + B u[k] + w[k], y[k] = C x[k] + D u[k] + v[k] (Eq 3.5, 3.6, and without u Eq 3.16,
3.17), with nothing known of the noise.

Solution (``data_driven``): the state is whatever of the past predicts the future. With the future weighted by its own
covariance (canonical correlations, CVA, Larimore 1983) and A, C taken by regression on that state, the estimate of a
record without input is asymptotically as good as maximum likelihood (Bauer, 2005), which a plain SSI or N4SID is not.
States come in order of what they predict, and without an input the models of all orders are nested.

With an input (``combined``, N4SID, Van Overschee and De Moor 1994, same weighting) what the future input does is
projected out first. A strong input makes the bias of a past of finite length larger than the scatter, so A is read off
the shift of the observability there, which has no such bias.

``regressive`` is the simplest of them, the regression on lagged samples alone, which shows how long the past matters.

All that they need of the data is sums of products of a record's lagged samples, by segment. Problem: subspace and
autoregressive methods are regressions on some hundred lagged samples. Building those columns for an hour of data takes
gigabytes, and a standard error by repetition would build them again and again.

Solution: sum v[t + a] v[t + b]' over a segment differs from that of the lags before only by products at the segment's
ends, so all lags cost as much as one row of them. Sums of segments add up: the record without one segment (for a
jackknife) is a subtraction.

Power spectra are summed over even segments (5.5.1 of Blum 2015): the transform of one long record is as rough as its
noise. Summing those of equal segments smooths it, at the price of resolution. The sum here is of powers, with a Hann
window.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Complex, Indices
from logger.modal.mode import OrderPoles

Estimate = Callable[["Moments"], OrderPoles]


@dataclass(frozen=True)
class Moments:
    """Mean of v[t + a] v[t + b]' over ``count`` instants: (lags * channels, lags * channels), block [a, b]."""

    products: Array
    count: int
    channels: int

    def take(self, lags: range, channels: slice) -> Indices:
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
        row = (row[:, :, :-1] - leaving[:, :, None, None] * samples[(starts + a)[:, None] + later][:, None]
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


RIDGE = 1e-12
"""Of the mean power of the samples: less is rounding of the computation, and is added to give its matrices roots."""


@dataclass(frozen=True)
class StateSpace:
    """A (n, n), C (channels, n); log det of the one-step errors' covariance, of order 0 to n or of n alone."""

    transition: Array
    observe: Array
    misfit: Array


def data_driven(moments: Moments, horizon: int, most: int) -> StateSpace:
    """Stochastic subspace with CVA weighting; ``moments`` has 2 horizon lags of the output channels.

    The model of order n is the upper left corner of A, the first n columns of C.
    """
    p = moments.channels
    past = slice(0, horizon * p)
    future = slice(horizon * p, 2 * horizon * p)
    g = moments.products
    root_past, root_future = _root(g[past, past]), _root(g[future, future])
    across = np.linalg.solve(root_future, np.linalg.solve(root_past, g[past, future]).T)
    state = np.linalg.solve(root_past.T, _right_vectors(across, most).T).T  # (n, horizon p): x = state @ past
    after = slice(p, (horizon + 1) * p)  # the past of one sample later
    transition = state @ g[after, past] @ state.T
    now = slice(horizon * p, (horizon + 1) * p)
    observe = g[now, past] @ state.T
    return StateSpace(transition, observe, _misfit(g[now, now], observe))


def combined(moments: Moments, outputs: int, horizon: int, orders: Sequence[int]) -> list[StateSpace]:
    """Deterministic-stochastic subspace, increasing orders; channels of ``moments`` are outputs, then inputs."""
    g, ours, every, inputs = moments.products, slice(0, outputs), slice(None), slice(outputs, None)
    past = moments.take(range(horizon), every)
    future_u = moments.take(range(horizon, 2 * horizon), inputs)
    future_y = moments.take(range(horizon, 2 * horizon), ours)
    given = np.linalg.solve(_ridged(g[np.ix_(future_u, future_u)]), g[np.ix_(future_u, np.append(past, future_y))])
    of_past, of_future = given[:, :len(past)], given[:, len(past):]
    root_past = _root(g[np.ix_(past, past)] - g[np.ix_(past, future_u)] @ of_past)
    root_future = _root(g[np.ix_(future_y, future_y)] - g[np.ix_(future_y, future_u)] @ of_future)
    clear = g[np.ix_(past, future_y)] - g[np.ix_(past, future_u)] @ of_future
    across = np.asarray(np.linalg.solve(root_future, np.linalg.solve(root_past, clear).T), dtype=np.float64)
    right = _right_vectors(across, max(orders))
    state = np.linalg.solve(root_past.T, right.T).T
    seen = root_future @ (across @ right.T)
    now_u, now_y = moments.take(range(horizon, horizon + 1), inputs), moments.take(range(horizon, horizon + 1), ours)
    found = []
    for n in orders:
        x = state[:n]
        crossed = x @ g[np.ix_(past, now_u)]
        known = np.block([[x @ g[np.ix_(past, past)] @ x.T, crossed], [crossed.T, g[np.ix_(now_u, now_u)]]])
        wanted = np.hstack([g[np.ix_(now_y, past)] @ x.T, g[np.ix_(now_y, now_u)]])
        errors = g[np.ix_(now_y, now_y)] - np.linalg.solve(_ridged(known), wanted.T).T @ wanted.T
        shift = np.asarray(np.linalg.lstsq(seen[:-outputs, :n], seen[outputs:, :n], rcond=None)[0], dtype=np.float64)
        found.append(StateSpace(shift, np.asarray(seen[:outputs, :n]), _log_det(errors)[None]))
    return found


def regressive(moments: Moments, outputs: int, most: int) -> Array:
    """log det of the covariance of one-step errors of the regression of the outputs on the inputs now and all channels
    0, 1, ... most samples ago, by one decomposition; ``moments`` has most + 1 lags."""
    g = moments.products
    inputs = moments.channels - outputs
    now = moments.take(range(most, most + 1), slice(outputs))
    places = np.concatenate([moments.take(range(most, most + 1), slice(outputs, None)),
                             moments.take(range(most - 1, -1, -1), slice(None))])
    seen = np.linalg.solve(_root(g[np.ix_(places, places)]), g[np.ix_(places, now)])
    return _misfit(g[np.ix_(now, now)], seen.T)[inputs::moments.channels]


def _right_vectors(matrix: Array, most: int) -> Array:
    """The first right singular vectors, as rows."""
    _, vectors = np.linalg.eigh(matrix.T @ matrix)
    return vectors[:, ::-1][:, :most].T


def _ridged(matrix: Array) -> Array:
    return np.asarray(matrix + RIDGE * np.trace(matrix) / len(matrix) * np.eye(len(matrix)), dtype=np.float64)


def _root(matrix: Array) -> Array:
    """Lower; of a matrix that rounding made indefinite, with as much on its diagonal as it takes."""
    more = 0.0
    while True:
        try:
            return np.asarray(np.linalg.cholesky(_ridged(matrix) + more * np.eye(len(matrix))), dtype=np.float64)
        except np.linalg.LinAlgError:
            more = 10 * more + RIDGE * float(np.trace(matrix)) / len(matrix)


def _misfit(power: Array, observe: Array) -> Array:
    """log det of the outputs' covariance less what the first 0, 1, ... n states explain."""
    explained = np.cumsum(observe.T[:, :, None] * observe.T[:, None, :], axis=0)
    return _log_det(power - np.concatenate([np.zeros((1, *power.shape)), explained]))


def _log_det(errors: Array) -> Array:
    """Of covariances (..., n, n), of which no direction has less than what a computation resolves."""
    # Times that power are errors that a ridge alone makes. Without it, records without noise have states without
    # end.
    resolved = 30.0
    return np.asarray(np.log(np.maximum(np.linalg.eigvalsh(errors), resolved * RIDGE)).sum(axis=-1))


def summed_spectrum(samples: Array, rate_hz: float, segments: int) -> tuple[Array, float]:
    """Power (segments, bins) of a record (samples, channels), summed over channels, and the bins' spacing [Hz]."""
    fewest_segments = 4
    shortest_segment = 64
    length = len(samples) // max(segments, 1)
    if segments < fewest_segments or length < shortest_segment:
        raise ValueError(f"expected {fewest_segments} segments or more of {shortest_segment} samples or more, found "
                         f"{segments} of {length}")
    cut = samples[:segments * length].reshape(segments, length, -1)
    window = 0.5 - 0.5 * np.cos(2 * np.pi * (np.arange(length) + 0.5) / length)
    seen = np.fft.rfft((cut - cut.mean(axis=1, keepdims=True)) * window[:, None], axis=1)
    return (np.abs(seen) ** 2).sum(axis=2), rate_hz / length
