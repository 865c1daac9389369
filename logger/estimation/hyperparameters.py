"""Empirical Bayes: the road's spectrum and the sensor's noise, learnt from the solution of a stretch.

The evidence (marginal likelihood) of a Gaussian model is largest where each wave's estimated power equals the share
of its prior variance that the readings resolve: sum |u|^2 = sum g / (1 + g) (MacKay 1992). Its slope and curvature in
the level and the waviness are such sums, so one scoring step per stretch follows both. The noise follows from the
residuals over the degrees of freedom that the road left them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp

import numpy as np
import numpy.typing as npt

from logger.estimation.road_spectrum import RoadSpectrum

Array = npt.NDArray[np.float64]

# What roads are like: half of them between 1.1 and 5.7 m/km; wavinesses of 1.8 to 2.5 are common (ISO 8608, annex C).
COMMON_ROAD = RoadSpectrum.of_iri(2.5)
_LEVEL_DEVIATION = 1.8
_WAVINESS_DEVIATION = 0.3
_WAVINESS_RANGE = (1.2, 3.2)
# How far both may have wandered since the last stretch.
_LEVEL_STEP = 0.3
_WAVINESS_STEP = 0.1
_NOISE_DEVIATION = 0.5
_LEAST_LOG_NOISE = -2.0  # a sensor that hangs must not be taken for one without noise
_LARGEST_STEP = 0.7
_BAND_SHARE = 0.76  # recorders are flat to 38 of 50 Hz
_SECOND = 100


@dataclass(frozen=True)
class Belief:
    """The spectrum, and log of the noise variance over the sensor's."""

    spectrum: RoadSpectrum
    log_noise: float = 0.0


def learnt(
    belief: Belief, power: Array, resolved: Array, log_waves: Array, seen_share: float,
    before: RoadSpectrum | None,
) -> Belief:
    """One scoring step for level and waviness.

    power         (k,) of each wave of the white innovations, where 1 is expected of a wave that is fully resolved
    resolved      (k,) share of each wave that the readings resolve where the road was read
    log_waves     (k,) of each, as ``road_spectrum.log_waves``
    seen_share    of the distance grid, where the car was read
    before        the spectrum of the stretch before; None: there was none
    """
    used = resolved > 0
    power, resolved = power[used], resolved[used]
    slopes = np.stack([np.ones(len(power)), -log_waves[used]])
    gradient = slopes @ (power - seen_share * resolved)
    curvature = (slopes * (seen_share * resolved**2)) @ slopes.T
    now = np.array([belief.spectrum.log_level, belief.spectrum.waviness])
    for centre, deviations in _priors(before):
        precision = np.array(deviations) ** -2.0
        gradient -= precision * (now - [centre.log_level, centre.waviness])
        curvature += np.diag(precision)
    step = np.clip(np.linalg.solve(curvature, gradient), -_LARGEST_STEP, _LARGEST_STEP)
    level, waviness = now + step
    return Belief(RoadSpectrum(float(level), float(np.clip(waviness, *_WAVINESS_RANGE))), belief.log_noise)


def _priors(before: RoadSpectrum | None) -> list[tuple[RoadSpectrum, tuple[float, float]]]:
    common = (COMMON_ROAD, (_LEVEL_DEVIATION, _WAVINESS_DEVIATION))
    return [common] if before is None else [common, (before, (_LEVEL_STEP, _WAVINESS_STEP))]


def with_noise(belief: Belief, residual_mps2: Array, weight: Array, resolved_waves: float) -> Belief:
    """One scoring step for the noise, by ``noise_slope``."""
    slope, free = noise_slope(residual_mps2, weight, resolved_waves)
    if not free:
        return belief
    gradient = slope - belief.log_noise / _NOISE_DEVIATION**2
    step = gradient / (0.5 * free + _NOISE_DEVIATION**-2.0)
    log_noise = belief.log_noise + float(np.clip(step, -_LARGEST_STEP, _LARGEST_STEP))
    return replace(belief, log_noise=max(log_noise, _LEAST_LOG_NOISE))


def noise_slope(residual_mps2: Array, weight: Array, resolved_waves: float) -> tuple[float, float]:
    """Slope of the log evidence in the log noise variance, and the readings that were free to show it (half of them
    are its curvature), 0 where there were too few; from the typical second: a pothole that is not explained yet is no
    noise.

    residual_mps2    (t,) readings less what the solution explains, 100 a second
    weight           (t,) that they had, with the noise of which the slope is asked
    resolved_waves   degrees of freedom that the road took: twice the sum of resolved shares over seen waves

    Only what recorders pass is looked at: noise that was thinned out to 100 Hz has nothing above.
    """
    waves = np.fft.rfft(residual_mps2 * (weight > 0))
    waves[int(len(waves) * _BAND_SHARE):] = 0.0
    in_band = weight * np.fft.irfft(waves, len(weight)) ** 2
    seconds = len(weight) // _SECOND
    sums = in_band[-seconds * _SECOND:].reshape(seconds, _SECOND).sum(axis=1)
    counts = (weight[-seconds * _SECOND:] > 0).reshape(seconds, _SECOND).sum(axis=1)
    if not (counts > _SECOND // 2).any():
        return 0.0, 0.0
    typical = float(np.median((sums / np.maximum(counts, 1))[counts > _SECOND // 2]))
    in_band_count = _BAND_SHARE * float(np.count_nonzero(weight))
    free = max(in_band_count - resolved_waves, 1.0)
    excess = typical * in_band_count / (_BAND_SHARE * free) - 1
    return 0.5 * free * excess, free


def noise_factor(belief: Belief) -> float:
    """Noise variance over the sensor's."""
    return exp(belief.log_noise)
