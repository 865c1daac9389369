"""Arrays as annotations name them, by what they hold."""

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Bools = npt.NDArray[np.bool_]
Indices = npt.NDArray[np.intp]
Whole = npt.NDArray[np.int64]
AT_ONCE = 4096
"""Rows that are worked on together where all would take too much memory: some MB a column of a thousand."""
ROUNDING = 1e-9
"""Of a size: more than sums of a million numbers lose in rounding (2e-10)."""


class Rows:
    """Dataclasses whose fields are arrays (n, ...), or such dataclasses: a row for each of n things."""

    def __len__(self) -> int:
        return len(next(iter(vars(self).values())))

    def of(self, which: Any) -> Self:
        """Those that a slice, numbers or marks (n,) choose."""
        return type(self)(*(one.of(which) if isinstance(one, Rows) else one[which] for one in vars(self).values()))

    @classmethod
    def joined(cls, parts: Sequence[Self]) -> Self:
        """Of arrays alone: one part after the other, at least one."""
        columns = zip(*(vars(one).values() for one in parts), strict=True)
        return parts[0] if len(parts) == 1 else cls(*map(np.concatenate, columns))
