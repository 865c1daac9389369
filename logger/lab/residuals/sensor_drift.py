"""Sensor drift: the slow part of a residual, below the band in which models are compared.

Problem: records are not compared below 0.4 Hz (``likelihood.whittle``), because a body on springs hardly accelerates
there: an acceleration is its travel times (2 pi f)2, so that even 5 cm at 0.1 Hz are 0.02 m/s2. A sensor that warms up,
or whose zero jumps, is strongest there, and an error counts that. Solution: the residual of a run is transformed to the
cosines below that frequency (discrete cosine transform, N. Ahmed, T. Natarajan and K. Rao, IEEE Transactions on
Computers C-23, 1974). Of several forms of drift the one with the least BIC (G. Schwarz, Annals of Statistics 6, 1978)
is chosen; the noise is white there, no less than between 0.4 and 0.6 Hz. The power of a random walk falls with the
square of a coefficient's number; it is estimated by N. Wiener's filter.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array
from logger.lab.likelihood.whittle import LOWEST_HZ
from logger.lab.residual_tests.tests import SIGNIFICANCE
from logger.runs import Run

NONE, OFFSET, RAMP, STEP, EXPONENTIAL, WANDER = "none", "offset", "ramp", "step", "exponential", "wander"


@dataclass(frozen=True, eq=False)
class Drift:
    """The drift of the sensor of one run.

    run          its name
    form         offset, ramp, step, exponential or wander; none where no more than noise is seen
    size_mps2    of an offset or a step, over all of a ramp, of an exponential at the beginning of the run; r.m.s. of
                 what wanders [m/s2]
    time_s       of an exponential; where in the run a step is [s]; None: it has none
    curve_mps2   (n,) of the whole run [m/s2]
    rate_hz      samples a second
    """

    run: str
    form: str
    size_mps2: float
    time_s: float | None
    curve_mps2: Array
    rate_hz: float

    @property
    def found(self) -> bool:
        """Whether there is one."""
        return self.form != NONE

    def nothing_found(self) -> Drift:
        """No drift, of the same run."""
        return replace(self, form=NONE, size_mps2=0.0, time_s=None, curve_mps2=np.zeros(len(self.curve_mps2)))


@dataclass(frozen=True, eq=False)
class _Fit:
    form: str
    bic: float
    size_mps2: float
    time_s: float | None
    curve: Callable[[Array], Array]


def drift_of(run: Run, residual: Array, noise_mps2: float) -> Drift:
    """The drift in a residual (n,) of a run whose sensor has white noise of this deviation [m/s2], or as much as the
    residual has just above ``LOWEST_HZ``. A run of fewer than eight coefficients cannot distinguish a form of three
    numbers from noise: no drift is found."""
    kept, rate = run.count - run.first, run.rate_hz
    time_s = run.time_s
    nothing = Drift(run.name, NONE, 0.0, None, np.zeros(run.count), rate)
    read = run.read[run.first:]
    count = int(2 * LOWEST_HZ * kept / rate)  # of frequencies below the lowest that is judged
    low_hz, _ = run.pass_band_hz
    judged_slowly = run.timed and not run.facts.main.may_drift
    if count < 8 or low_hz > 0 or judged_slowly or not read.any():
        return nothing
    basis = _Cosines(kept, count, int(1.5 * 2 * LOWEST_HZ * kept / rate))
    seen = basis.of(np.where(read, residual[run.first:], 0.0))
    level = max(noise_mps2**2, float(np.mean(seen[count:] ** 2)))
    fits = [_fit_white(form, basis, seen[:count], level, time_s[run.first:], shapes)
            for form, shapes in _shapes(time_s[run.first:], rate).items()]
    fits.append(_fit_random_walk(basis, seen[:count], level, run.first))
    nought = float(seen[:count] @ seen[:count]) / level
    best = min(fits, key=lambda one: one.bic)
    if best.bic > nought + 2 * np.log(SIGNIFICANCE):  # noise lowers the criterion by so much no more often than that
        return nothing
    return Drift(run.name, best.form, best.size_mps2, best.time_s, best.curve(time_s), rate)


class _Cosines:
    """The first orthonormal cosines (k, n) of n samples: those that count, and some more for the noise."""

    def __init__(self, samples: int, count: int, more: int) -> None:
        from scipy.fft import dct, idct

        self._dct, self._idct = dct, idct
        self.samples, self.count, self.size = samples, count, max(more, count + 2)

    def of(self, samples: Array) -> Array:
        """Coefficients (..., k) of samples (..., n)."""
        return np.asarray(self._dct(samples, norm="ortho", axis=-1)[..., : self.size])

    def back(self, coefficients: Array) -> Array:
        """Samples (n,) of coefficients (k,)."""
        return np.asarray(self._idct(coefficients, n=self.samples, norm="ortho"))


Curve = Callable[[Array], Array]
Shape = tuple[float | None, Curve]


def _step(begins_s: float) -> Curve:
    return lambda at: np.where(at >= begins_s, 1.0, 0.0)


def _exponential(takes_s: float) -> Curve:
    return lambda at: np.asarray(np.exp(-at / takes_s))


def _shapes(time_s: Array, rate_hz: float) -> dict[str, list[Shape]]:
    """Curves by time that each form adds to a constant, each with its time (None: it has none). Sixty time constants
    are tried, from the shortest period to twice the run's length."""
    lasts_s = time_s[-1] + 1 / rate_hz
    steps = np.arange(time_s[0], time_s[-1], 0.1 / LOWEST_HZ)[1:]
    exponentials = np.geomspace(1 / LOWEST_HZ, 2 * lasts_s, 60)
    return {
        OFFSET: [],
        RAMP: [(None, lambda at: at / lasts_s)],
        STEP: [(float(one), _step(float(one))) for one in steps],
        EXPONENTIAL: [(float(one), _exponential(float(one))) for one in exponentials],
    }


def _fit_white(form: str, basis: _Cosines, seen: Array, level: float, time_s: Array, shapes: Sequence[Shape]) -> _Fit:
    """The most likely curve of a form, with a constant, in white noise."""
    if not shapes:
        offset = float(seen[0]) / float(np.sqrt(basis.samples))
        bic = float(seen[1:] @ seen[1:]) / level + float(np.log(basis.count))
        return _Fit(form, bic, offset, None, lambda at: np.full(len(at), offset))
    columns = basis.of(np.stack([shape(time_s) for _, shape in shapes]))[:, : basis.count]
    # The constant is the first coefficient alone.
    free = columns[:, 1:]
    sizes = free @ seen[1:] / np.maximum((free**2).sum(axis=1), 1e-300)
    bics = ((seen[1:] - sizes[:, None] * free) ** 2).sum(axis=1) / level
    best = int(bics.argmin())
    known_s, shape = shapes[best]
    size = float(sizes[best])
    offset = float(seen[0] - size * columns[best, 0]) / float(np.sqrt(basis.samples))
    numbers = 2 if known_s is None else 3
    return _Fit(form, float(bics[best]) + numbers * float(np.log(basis.count)), size, known_s,
                lambda at: offset + size * shape(at))


def _fit_random_walk(basis: _Cosines, seen: Array, level: float, first: int) -> _Fit:
    """The most likely random walk in white noise."""
    numbers = np.arange(1, basis.count)
    powers = seen[1:] ** 2
    walks = np.geomspace(1e-2, 1e8, 81) * level
    spectra = level + walks[:, None] / numbers**2
    bics = (np.log(spectra / level) + powers / spectra).sum(axis=1)
    best = int(bics.argmin())
    kept = np.zeros(basis.count)
    kept[0] = seen[0]
    kept[1:] = seen[1:] * (1 - level / spectra[best])
    curve = basis.back(kept)
    whole = np.concatenate([np.full(first, curve[0]), curve])
    return _Fit(WANDER, float(bics[best]) + 2 * float(np.log(basis.count)), float(np.sqrt(np.mean(curve**2))), None,
                lambda at: whole)
