"""Covariance of drives over one road besides a known obstacle, and its effect on the standard errors.

Problem: three drives over one bump meet the same roughness around it three times. Each residual looks like that of a
road of its own, and a fit that takes the three for independent believes its average too much: at one speed its standard
errors are too small by the root of three.

Solution: the noise model says what a road leaves in each drive, so it also says what one and the same road leaves in
two of them, at whatever speeds: between drives i and j, a way dx apart on the road,

    C_ij(dx) = Re int Gd(n) H_i(n v_i) H_j(n v_j)* exp(2 pi j n dx) dn.

How much of that the whitened residuals really have in common is asked of them (a share from 0 to 1), and the
covariance of the estimates is the one that correlated residuals give: A (sum S_i' R_ij S_j) A, with R_ij the share of
whitened C_ij and A the covariance of independent ones. The estimates themselves stay what they are.
"""

from dataclasses import dataclass, replace

import numpy as np

from logger.arrays import Array, Complex
from logger.bounds import CONFLICT_SIGMA
from logger.fitting.fisher_scoring import inverse_with_prior
from logger.identification.drive_model import DriveModel
from logger.identification.noise_models import ROAD_LEVEL, PredictionWhitener
from logger.identification.prediction_error_fit import Fit
from logger.profiles.track import Track
from logger.roads.iso8608 import displacement_psd
from logger.runs import SLOWEST_MPS
from logger.vehicle.named_parameters import Coordinates
from logger.vehicle.simulate import recorder_gain

_MOST_SAMPLES, _BEFORE_SAMPLES = 1500, 300
_GRID_STEP_M, _GRID_SAMPLES = 0.02, 32_768


@dataclass(frozen=True, eq=False)
class CommonRoughness:
    """What drives have in common.

    fit       the fit, its covariance and standard errors those of drives that have this in common
    share     of the roughness that one road would give them in common: 0 for roads of their own
    growth    the largest ratio of a standard error to that of roads of their own
    """

    fit: Fit
    share: float
    growth: float


def with_common_roughness(model: DriveModel, fit: Fit) -> CommonRoughness:
    """A fit whose standard errors count what its drives have in common, where they are several over one obstacle, or
    one profile, and what is left is a road's."""
    alone = CommonRoughness(fit, 0.0, 1.0)
    level = fit.noise.levels.get(ROAD_LEVEL, 0.0)
    if level <= 0 or not may_have_common(model):
        return alone
    values = np.array(list(fit.parameters.values()))
    slopes = np.split(fit.sensitivities, np.cumsum([len(one) for one in fit.white])[:-1])
    drives = [_drive(model, fit, values, run, slopes[run]) for run in range(len(model.records))]
    likeness = size = 0.0
    crossed = np.zeros((len(values), len(values)))
    for second, other in enumerate(drives):
        for one in drives[:second]:
            common = level * _common(one, other)
            likeness += float(one.white @ common @ other.white)
            size += float((common**2).sum())
            part = one.slopes.T @ common @ other.slopes
            crossed += part + part.T
    if likeness < CONFLICT_SIGMA * np.sqrt(size):
        return alone
    share = min(likeness / size, 1.0)
    scale = Coordinates(fit.free).slopes(values)
    independent = inverse_with_prior(fit.sensitivities.T @ fit.sensitivities)
    wider = fit.covariance + share * np.outer(scale, scale) * (independent @ crossed @ independent)
    alone_variances = np.diag(fit.covariance)
    variances = np.maximum(np.diag(wider), alone_variances)
    np.fill_diagonal(wider, variances)
    return CommonRoughness(replace(fit, covariance=wider), share, float(np.sqrt(variances / alone_variances).max()))


@dataclass(frozen=True, eq=False)
class _Stretch:
    """The stretch of a drive that is looked at: true way from the obstacle [m], whitened residuals (n,), whitened
    derivatives (n, p), what whitens, and the sensor's response (k,) to waves of the road."""

    way_m: Array
    white: Array
    slopes: Array
    whitener: PredictionWhitener
    response: Complex


def may_have_common(model: DriveModel) -> bool:
    """Whether there are several drives that are given the same road."""
    roads = [one.track for one in model.records if isinstance(one.track, Track)]
    alike = [one.start_m == roads[0].start_m and np.array_equal(one.elevation_m, roads[0].elevation_m) for one in roads]
    return 1 < len(alike) == len(model.records) and all(alike)


def _drive(model: DriveModel, fit: Fit, values: Array, run: int, slopes: Array) -> _Stretch:
    record, road = model.records[run], model.road_with(values, run)
    start_m = min((one.start_m for one in road.obstacles.values()), default=0.0)
    way_m = fit.low_pass.apply(record.distance_m[record.first:]) / road.speed_scale - start_m
    first = max(0, int(np.argmax(way_m >= 0)) - _BEFORE_SAMPLES) if road.obstacles else 0
    stretch = slice(first, first + _MOST_SAMPLES)
    speed_mps = max(float(np.median(record.speed_mps[record.first:])) / road.speed_scale, SLOWEST_MPS)
    f_hz = np.maximum(_waves_cpm() * speed_mps, 1e-3)
    response = model.response(values, f_hz, speed_mps)
    gain = recorder_gain(f_hz / record.rate_hz) * fit.low_pass.gain(np.minimum(f_hz, record.rate_hz / 2))
    return _Stretch(way_m[stretch], fit.white[run][stretch], slopes[stretch], fit.noise.whiteners[run], response * gain)


def _common(one: _Stretch, other: _Stretch) -> Array:
    """What a road of Gd(n0) = 1 cm3 gives the whitened residuals of two drives in common: covariances (n, m)."""
    n = _waves_cpm()
    psd = np.append(0.0, displacement_psd(n[1:], 1.0))
    by_distance = np.fft.irfft(psd * one.response * other.response.conj()) / (2 * _GRID_STEP_M)
    apart = (one.way_m[:, None] - other.way_m) / _GRID_STEP_M
    cell = np.floor(apart)
    part = apart - cell
    index = cell.astype(int) % len(by_distance)
    following = (index + 1) % len(by_distance)
    plain = (1 - part) * by_distance[index] + part * by_distance[following]
    return other.whitener(one.whitener(plain).T).T


def _waves_cpm() -> Array:
    """Wave numbers up to what the grid holds [1/m]."""
    return np.asarray(np.fft.rfftfreq(_GRID_SAMPLES, _GRID_STEP_M), dtype=np.float64)
