"""Eigensystem realisation: poles of every order from responses that decay.

A free decay y[k] = C A^k x0 laid in a block Hankel matrix has rank n, and the same matrix one sample later is the first
with A in its middle (Juang and Pappa, 1985; 3.2.1 of Blum 2015). Correlations of a random response decay as the free
response does, which makes the method fit for those too (NExT, James, Carne and Lauffer, 1993).

With noise the rank is full and the order has to be chosen. The realisations of all orders are nested: that of order n
is the upper left corner of the largest, so a whole stabilisation diagram costs one singular value decomposition.
"""

from __future__ import annotations

import numpy as np

from logger.modal.mode import Array, OrderPoles, order_poles

_MOST_ROWS, _MOST_COLUMNS = 300, 400
_PROPOSED_STATES = 40
_RANK = 1e-7  # relative size of what is left of a noise-free record, decomposed by its squares, which is quick


def realise(responses: Array, most: int, block_rows: int | None = None) -> tuple[Array, Array]:
    """A (n, n) and C (channels, n) of the largest order n <= ``most``, whose corners are those of smaller orders.

    responses    (samples, channels, cases): free decays from one or more starts, or correlations with references
    """
    samples, channels, cases = responses.shape
    rows = block_rows or max(2, min(_MOST_ROWS // channels, samples // 2))
    columns = max(1, min(_MOST_COLUMNS // cases, samples - rows))
    blocks = responses[np.arange(rows)[:, None] + np.arange(columns + 1)]  # (rows, columns + 1, channels, cases)
    whole = blocks.transpose(0, 2, 1, 3).reshape(rows * channels, (columns + 1) * cases)
    early, late = whole[:, :-cases], whole[:, cases:]
    squares, left = np.linalg.eigh(early @ early.T)
    sizes, left = np.sqrt(np.maximum(squares[::-1], 0.0)), left[:, ::-1]
    n = max(1, min(most, int((sizes > _RANK * sizes[0]).sum())))
    left, root = left[:, :n], np.sqrt(np.maximum(sizes[:n], 1e-300))
    right = (left.T @ early) / sizes[:n, None]
    return left.T @ late @ right.T / np.outer(root, root), left[:channels] * root


def corners(transition: Array, observe: Array, rate_hz: float) -> tuple[OrderPoles, ...]:
    """Poles of the nested models of order 2, 4, ... up to the largest."""
    return tuple(order_poles(transition[:n, :n], observe[:, :n], rate_hz) for n in range(2, len(transition) + 1, 2))


def proposals(samples: Array, rate_hz: float, most: int = _PROPOSED_STATES) -> tuple[OrderPoles, ...]:
    """Poles of the orders 2, 4, ... of one free decay (samples, channels)."""
    return corners(*realise(samples[:, :, None], most), rate_hz)
