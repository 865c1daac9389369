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

``covariance_driven`` (SSI-cov, Peeters and De Roeck 1999) decomposes the correlations instead, where the noise of the
sensors is in lag zero only, which is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.modal.mode import Array
from logger.modal.moments import Moments

_RIDGE = 1e-11


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
        found.append(StateSpace(shift, np.asarray(seen[:outputs, :n]), np.array([np.linalg.slogdet(errors)[1]])))
    return found


def covariance_driven(correlations: Array, orders: Sequence[int]) -> list[StateSpace]:
    """SSI-cov, from correlations (lags from 1, channels, references), by the observability's shift."""
    lags, p, _ = correlations.shape
    rows = (lags + 1) // 2
    blocks = correlations[np.arange(rows)[:, None] + np.arange(lags + 1 - rows)]
    whole = blocks.transpose(0, 2, 1, 3).reshape(rows * p, -1)
    left, sizes, _ = np.linalg.svd(whole, full_matrices=False)
    seen = np.asarray(left[:, :max(orders)] * np.sqrt(sizes[:max(orders)]), dtype=np.float64)
    shifts = [np.asarray(np.linalg.lstsq(seen[:-p, :n], seen[p:, :n], rcond=None)[0]) for n in orders]
    return [StateSpace(shift, seen[:p, :len(shift)], np.empty(0)) for shift in shifts]


def _right_vectors(matrix: Array, most: int) -> Array:
    """The first right singular vectors, as rows."""
    _, vectors = np.linalg.eigh(matrix.T @ matrix)
    return vectors[:, ::-1][:, :most].T


def _ridged(matrix: Array) -> Array:
    return np.asarray(matrix + _RIDGE * np.trace(matrix) / len(matrix) * np.eye(len(matrix)), dtype=np.float64)


def _root(matrix: Array) -> Array:
    return np.asarray(np.linalg.cholesky(_ridged(matrix)), dtype=np.float64)


def _misfit(power: Array, observe: Array) -> Array:
    """log det of the outputs' covariance less what the first 0, 1, ... n states explain."""
    explained = np.cumsum(observe.T[:, :, None] * observe.T[:, None, :], axis=0)
    errors = power - np.concatenate([np.zeros((1, *power.shape)), explained])
    return np.asarray(np.linalg.slogdet(errors)[1])
