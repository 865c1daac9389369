"""How alike shapes of modes are."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


def mac(first: npt.ArrayLike, second: npt.ArrayLike) -> Array:
    """Modal assurance criterion of two sets of shapes in columns, (channels, n) and (channels, m): (n, m), 0 to 1.

    |a^H b|^2 / (a^H a)(b^H b) (Allemang and Brown, 1982): 1 for shapes that differ by a factor only.
    """
    a, b = (np.asarray(shape).reshape(len(np.asarray(shape)), -1) for shape in (first, second))
    products = np.abs(a.conj().T @ b) ** 2
    return np.asarray(products / np.outer((np.abs(a) ** 2).sum(axis=0), (np.abs(b) ** 2).sum(axis=0)))
