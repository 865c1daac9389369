"""What OpenStreetMap's key ``smoothness`` would say of a way, as far as its IRI can tell.

Problem: the key is defined by which vehicles a way is fit for, not by a number. Solution: both sides have a scale in
the speed at which a car is driven there. OpenStreetMap (wiki, ``Key:smoothness``, and the rules of thumb behind it): a
car's speed is not affected on ``excellent`` and ``good`` ways, somewhat reduced (to 50 to 90 %) on ``intermediate``
ones, to less than half on ``bad`` ones. World Bank Technical Paper 46 (Sayers, Gillespie & Paterson 1986; also in ASTM
E1926, appendix X2) describes paved roads at marks of the IRI: about 2 m/km is comfortable above 120 km/h, 4 up to 100
to 120 km/h, 6 up to 70 to 90 km/h, 8 up to 50 to 60 km/h. A way is given the word of the nearest mark.

``very_bad`` and worse ask for more clearance than a car has: that an IRI cannot show, so nothing worse than ``bad`` is
suggested.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from logger.roads.repeated_drives import Passes, Scatter, variances, way_and_cell
from logger.roads.window_errors import errors_of_means

Array = npt.NDArray[np.float64]

WORDS = ("excellent", "good", "intermediate", "bad")
MARKS_M_PER_KM = (2.0, 4.0, 6.0, 8.0)
LIMITS_M_PER_KM = tuple((one + other) / 2 for one, other in pairwise(MARKS_M_PER_KM))
LEAST_COVERED = 0.5
"""Share of a way that has to be known: with less, most of the way may be otherwise."""


@dataclass(frozen=True, eq=False)
class WayMeans:
    """Ways (w,) that drives passed.

    way             numbers of the ways
    covered_m       how much of each has an IRI [m]
    drives          how many drives gave it one
    iri_m_per_km    mean over what is covered, each piece of road counting by its length, with its standard error
    """

    way: npt.NDArray[np.intp]
    covered_m: Array
    drives: npt.NDArray[np.intp]
    iri_m_per_km: Array
    iri_std_m_per_km: Array


def way_means(passes: Passes, scatter: Scatter, cell_m: float) -> WayMeans:
    """Means over ways of passes over their cells.

    A cell is the mean of its passes, weighted by their variances; a way is the mean of its cells by length. What is
    common to a drive (``scatter``) does not fall with the cells that it passed.
    """
    if not len(passes.key):
        none = np.zeros(0, np.intp)
        return WayMeans(none, np.zeros(0), none, np.zeros(0), np.zeros(0))
    _, cell = np.unique(passes.key, return_inverse=True)
    weight = 1.0 / np.maximum(variances(passes, scatter), 1e-12)
    length_m = np.zeros(cell.max() + 1)
    np.maximum.at(length_m, cell, np.minimum(passes.known_m, cell_m))
    ways, number = way_and_cell(passes.key)
    way, of = np.unique(ways, return_inverse=True)
    covered_m = np.zeros(len(way))
    first = np.unique(cell, return_index=True)[1]
    np.add.at(covered_m, of[first], length_m)
    share = weight / np.bincount(cell, weight)[cell] * length_m[cell] / covered_m[of]
    mean: Array = np.asarray(np.bincount(of, share * passes.iri_m_per_km), dtype=np.float64)
    pair, which = np.unique(np.stack([of, passes.drive]), axis=1, return_inverse=True)
    by_drive = np.bincount(which.ravel(), share)
    order = np.lexsort((passes.key, which.ravel()))
    at_m = np.asarray(cell_m * number, dtype=np.float64)
    of_drives = errors_of_means(passes.iri_errors, passes.iri_m_per_km, at_m, share, order, share[order],
                                which.ravel()[order], len(by_drive))
    of_drive = np.sqrt(of_drives.std**2 - of_drives.common_std**2) * by_drive
    own = (1 - scatter.alike) * np.bincount(pair[0], of_drive**2) + scatter.alike * np.bincount(pair[0], of_drive) ** 2
    own += np.bincount(of, share**2 * (variances(passes, Scatter(0.0, scatter.passes)) - passes.own_variance))
    own += np.bincount(pair[0], by_drive**2) * (np.nan_to_num(scatter.drive) * mean)**2
    common = np.bincount(pair[0], of_drives.common_std * by_drive)
    return WayMeans(way, covered_m, np.bincount(pair[0]).astype(np.intp), mean, np.sqrt(own + common**2))


def suggestion(iri_m_per_km: float, iri_std_m_per_km: float) -> tuple[str, float]:
    """The word for a mean IRI, and how likely the true one asks for the same word, by a normal distribution."""
    from scipy.special import ndtr

    number = int(np.searchsorted(LIMITS_M_PER_KM, iri_m_per_km, side="right"))
    edges = np.array([-np.inf, *LIMITS_M_PER_KM, np.inf])[number: number + 2]
    low, high = ndtr((edges - iri_m_per_km) / max(iri_std_m_per_km, 1e-9))
    return WORDS[number], float(high - low)
