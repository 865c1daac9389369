"""Standard errors of means over windows, from what the errors of windows have in common.

Problem: the IRI of a section is the mean of its windows', but their errors are not independent: added as if they were,
sections of 0.1 mi were out by 1.6 to 3.8 times their standard errors. Solution: each error is the sum of four parts,
and each part has its own rule.

own       what the readings leave open of the slope; its memory is a metre or two, so variances add
level     how rough the road is there is not known better; the error fades along the way as exp(-d / 30 m). Measured
          over simulated drives of 4.2 km (10 to 70 mph, 2 and 4 g, noise 0.147 m/s2) on roads that change in steps,
          slowly, not at all, and that have holes: of 8, 15, 30, 45, 60, 120 and 1000 m the likeliest is 30 m; at 2 g
          its log likelihood is 9 above that of 15 m and 22 above that of 45 m
common    numbers of the vehicle and of the sensor are wrong; all windows of a car share it
place     a window lies some way on: what one gains at its end its neighbour loses, so a row of windows is off as much
          as its two ends are

A window cut by a limit counts with the mean of all of it, and so with the error of all of it. The road of a part may be
rougher than the rest. The excess of a mean over small stretches is that of a random walk tied at both ends; how far it
walks shows in the differences of neighbouring windows. No part differs more than a point does: the magnitude of a
normal deviate has a variance of pi / 2 - 1 times its squared mean. The variance of a part is half the harmonic mean of
both limits: its root is within a tenth of that of roads of ISO 8608, for 0.05 to 4 m of windows of 7.6 m.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import log, pi

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Ints = npt.NDArray[np.intp]

ALONG_M = 30.0
_FADED = 1e-3
_POINT_SHARE = pi / 2 - 1
_ROUNDING = 0.0005 * (1 + 3**0.5)  # of a whole and three parts with three decimals


@dataclass(frozen=True, eq=False)
class WindowErrors:
    """Standard errors of windows (n,) [m/km], whole and by their parts; NaN: not known.

    Logs of older programs have the whole alone. Then all of it counts as that of the level: this is what was measured
    to make sections right. So it does where parts are negative, or larger together than the whole.
    """

    std: Array
    level_std: Array
    common_std: Array
    place_std: Array

    @classmethod
    def undivided(cls, std: Array) -> WindowErrors:
        """Of which the whole alone is known."""
        nothing = np.full(len(std), np.nan)
        return cls(std, nothing, nothing, nothing)

    @property
    def own_variance(self) -> Array:
        """What the windows do not share [(m/km)2]."""
        level_std, common_std, place_std = self.parts()
        return np.maximum(self.std**2 - level_std**2 - common_std**2 - place_std**2, 0.0)

    def parts(self) -> tuple[Array, Array, Array]:
        """Level, common and place, where they are possible; else all as level."""
        parts = np.stack([self.level_std, self.common_std, self.place_std])
        with np.errstate(over="ignore"):
            possible = (parts >= 0).all(axis=0) & (np.sqrt((parts**2).sum(axis=0)) <= self.std + _ROUNDING)
        return (np.where(possible, self.level_std, self.std), np.where(possible, self.common_std, 0.0),
                np.where(possible, self.place_std, 0.0))

    def of(self, rows: Ints) -> WindowErrors:
        """Those of some windows."""
        return WindowErrors(*(getattr(self, one.name)[rows] for one in fields(self)))


def errors_of_means(errors: WindowErrors, iri: Array, at_m: Array, length_m: Array, window: Ints, piece_m: Array,
                    group: Ints, count: int) -> WindowErrors:
    """Standard errors of means by length (count,), whole and by their parts.

    errors, iri, at_m, length_m    of windows (n,): IRI [m/km], middles and lengths [m]
    window, piece_m, group         of pieces (p,): the window that each is cut from, how long it is [m], and the mean
                                   that it counts in; those of one mean stand together, in the order driven, and are of
                                   different windows
    """
    of_windows, whole_m = errors.of(window), length_m[window]
    level_std, common_std, place_std = of_windows.parts()
    level_std = level_std * piece_m

    def total(values: Array, of: Ints = group) -> Array:
        return np.asarray(np.bincount(of, values, count), dtype=np.float64)

    walk, point = _scatter_share(iri) * np.maximum(whole_m - piece_m, 0.0), _POINT_SHARE * piece_m
    excess = np.divide(walk * point, walk + point, out=np.zeros(len(group)), where=walk + point > 0)
    own = total(piece_m**2 * of_windows.own_variance + piece_m * excess * np.nan_to_num(iri[window]) ** 2)
    level = total(level_std**2)
    for lag in range(1, len(group)):
        apart_m = np.abs(at_m[window[lag:]] - at_m[window[:-lag]])
        near = (group[lag:] == group[:-lag]) & (apart_m < -ALONG_M * log(_FADED))
        if not near.any():
            break
        pairs = 2 * level_std[lag:] * level_std[:-lag] * np.exp(-apart_m / ALONG_M)
        level += total(pairs[near], group[lag:][near])
    middle_m = at_m[window]
    apart = np.abs(np.diff(middle_m)) > 0.75 * (whole_m[1:] + whole_m[:-1])
    ends = (np.diff(group) != 0) | apart
    first, last = np.append(True, ends)[:len(group)], np.append(ends, True)[:len(group)]
    share = np.divide(piece_m, whole_m, out=np.ones(len(group)), where=whole_m > 0)
    moved = (place_std * whole_m) ** 2 / 2
    place = total(moved * share**2 * (first.astype(np.float64) + last))
    place += total(np.where(ends, 0.0, np.diff(share) ** 2 * (moved[1:] + moved[:-1]) / 2), group[1:])
    common, known_m = total(common_std * piece_m), total(piece_m)
    return WindowErrors(*(np.divide(one, known_m, out=np.full(count, np.nan), where=known_m > 0) for one in (
        np.sqrt(own + level + common**2 + place), np.sqrt(level), common, np.sqrt(place))))


def _scatter_share(iri: Array) -> float:
    """Variance of windows (n,) about the road around them, half the mean square of the steps to neighbours, as a share
    of the mean square."""
    steps, known = np.diff(iri), iri[np.isfinite(iri)]
    steps = steps[np.isfinite(steps)]
    return float(np.mean(steps**2) / 2 / np.mean(known**2)) if len(steps) and known.any() else 0.0
