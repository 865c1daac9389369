"""Arrays as annotations name them, by what they hold."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]
Bools = npt.NDArray[np.bool_]
AT_ONCE = 4096
"""Rows that are worked on together where all would take too much memory: some MB a column of a thousand."""
ROUNDING = 1e-9
"""Of a size: more than sums of a million numbers lose in rounding (2e-10)."""
