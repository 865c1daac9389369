"""Eigensystem realisation: poles of every order from a free decay.

A free decay y[k] = C A^k x0 laid in a block Hankel matrix has rank n, and the same matrix one sample later is the first
with A in its middle (Juang and Pappa, 1985; 3.2.1 of Blum 2015).

With noise the rank is full and the order has to be chosen. The realisations of all orders are nested: that of order n
is the upper left corner of the largest, so a whole stabilisation diagram costs one singular value decomposition.
"""

from __future__ import annotations

import numpy as np

from logger.modal.mode import Array, OrderPoles, order_poles

_MOST_ROWS, _MOST_COLUMNS = 300, 400
_PROPOSED_STATES = 40
_RANK = 1e-7  # relative size of what is left of a noise-free record, decomposed by its squares, which is quick


def proposals(samples: Array, rate_hz: float, most: int | None = None) -> tuple[OrderPoles, ...]:
    """Poles of the orders 2, 4, ... ``most`` (None: 40) of a free decay (samples, channels)."""
    count, channels = samples.shape
    rows = max(2, min(_MOST_ROWS // channels, count // 2))
    columns = max(1, min(_MOST_COLUMNS, count - rows))
    blocks = samples[np.arange(rows)[:, None] + np.arange(columns + 1)]  # (rows, columns + 1, channels)
    whole = blocks.transpose(0, 2, 1).reshape(rows * channels, columns + 1)
    early, late = whole[:, :-1], whole[:, 1:]
    squares, left = np.linalg.eigh(early @ early.T)
    sizes, left = np.sqrt(np.maximum(squares[::-1], 0.0)), left[:, ::-1]
    n = max(1, min(most or _PROPOSED_STATES, int((sizes > _RANK * sizes[0]).sum())))
    left, root = left[:, :n], np.sqrt(np.maximum(sizes[:n], 1e-300))
    transition = left.T @ late @ ((left.T @ early) / sizes[:n, None]).T / np.outer(root, root)
    observe = left[:channels] * root
    return tuple(order_poles(transition[:k, :k], observe[:, :k], rate_hz) for k in range(2, n + 1, 2))
