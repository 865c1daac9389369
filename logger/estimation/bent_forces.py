"""What a car's own laws answer beyond the linear ones that stand in for them, along the motion that was found.

Problem: a linear car is right on the average of a road (``vehicle.linearise``), but a damper that resists rebound more
than bump has no linear stand-in at all, and friction pushes the more evenly the harder a stretch shakes. Solution: once
a block's road is known, so is how the suspensions moved; what the laws answer to that, less what the linear ones do, is
a force, and what a force does to the reading is linear again. Its share is taken off the readings, and the road is
solved again. The motion is not known exactly: a law is asked for its mean over what may have been, which also rounds
off the corners that would keep the two from coming to rest.
"""

from math import sqrt

import numpy as np

from logger.arrays import ROUNDING, Array, Complex
from logger.estimation.car_response import HIGHEST_HZ, WAVE_NUMBER_STEPS_CPM, WAVE_NUMBERS_CPM
from logger.estimation.time_grid import frequencies_hz
from logger.vehicle.laws import CornerLaws
from logger.vehicle.linear_car import CornerSlopes, LinearCar
from logger.vehicle.linearise import MovedCar

_AT, _SHARE = np.polynomial.hermite_e.hermegauss(9)
_SHARE = _SHARE / _SHARE.sum()
# Laws are rounded off over at least so much of how far a corner moves: the slope of friction at rest stays within three
# times that of its stand-in, so that half a step towards what is found leads there.
_LEAST_ROUNDING = 1 / 3
_EVERY = 4  # of the samples that the variance is asked at: it is a mean over the block


class BentForces:
    """For blocks of ``count`` samples at ``rate_hz``.

    moved     the car
    linear    what stands in for it on this road, at ``speed_mps``
    """

    def __init__(self, moved: MovedCar, linear: LinearCar, speed_mps: float, count: int, rate_hz: float) -> None:
        self._laws, self._slopes = moved.car.laws, linear.corners
        f_hz = frequencies_hz(count, rate_hz)
        seen = (f_hz > 0) & (f_hz <= HIGHEST_HZ)
        axle = np.unique(linear.structure.behind_m, return_inverse=True)[1]
        by_wheel = linear.travel_by_wheel(f_hz[seen])
        corners = by_wheel.shape[1]
        self._travel = np.zeros((axle.max() + 1, corners, len(f_hz)), np.complex128)
        for one, rows in enumerate(self._travel):
            rows[:, seen] = by_wheel[..., axle == one].sum(axis=-1).T
        self._by_force = np.zeros((corners, len(f_hz)), np.complex128)
        self._by_force[:, seen] = linear.by_force(f_hz[seen]).T
        s = np.asarray(2j * np.pi * f_hz, dtype=np.complex128)
        self._rate = s * self._travel
        self._own_rate = np.stack([one.passed(s) for one in self._slopes]) * self._rate
        waves = linear.waves(WAVE_NUMBERS_CPM, speed_mps)
        self._powers = [np.abs(one) ** 2 * WAVE_NUMBER_STEPS_CPM[:, None]
                        for one in (waves.travel, waves.rate, waves.own_rate)]
        self._count = count

    def reading(self, under: Complex, psd_m3: Array, resolved: Array) -> tuple[Array, float]:
        """What the forces beyond the linear ones do to the reading (count,) [m/s2], and the variance of what they may
        do besides, because the motion is not known exactly [(m/s2)2].

        under       (axles, f) rfft of the elevations under the axles [m]
        psd_m3      (n,) of the road at ``WAVE_NUMBERS_CPM``; ``resolved`` (n,) the share that the readings resolve of
                    it
        """
        motions = np.array([np.fft.irfft((under[:, None] * gain).sum(axis=0), self._count)
                            for gain in (self._travel, self._rate, self._own_rate)])
        left = np.sqrt(np.array([(psd_m3 * (1 - resolved)) @ power for power in self._powers]))
        rounded = np.maximum(left, _LEAST_ROUNDING * np.sqrt(np.array([psd_m3 @ power for power in self._powers])))
        found = [(_beyond(laws, slopes, motions[:, i], rounded[:, i]),
                  _variance(laws, slopes, motions[:, i, ::_EVERY], left[:, i]))
                 for i, (laws, slopes) in enumerate(zip(self._laws, self._slopes, strict=True))]
        forces, variances = np.array([force for force, _ in found]), np.array([variance for _, variance in found])
        return (np.fft.irfft((np.fft.rfft(forces) * self._by_force).sum(axis=0), self._count),
                float(variances @ (np.abs(self._by_force) ** 2).mean(axis=1)))


def _beyond(laws: CornerLaws, slopes: CornerSlopes, motion: Array, std: Array) -> Array:
    """The mean force (t,) [N] of a corner's laws, less that of their stand-ins, over what its motion may have been:
    travel, rate and the damper's own rate (3, t) within standard errors (3,)."""
    force = sum(_SHARE @ one for one in _parts(laws, slopes, motion, std)) - slopes.beside_n_s_per_m * motion[1]
    if laws.dry_friction_n:
        share = motion[1] / max(sqrt(std[1]**2 + laws.friction_transition_mps**2), ROUNDING)
        # nearly its mean over a normal distribution, which is an erf
        force += laws.dry_friction_n * laws.stribeck.times(motion[1]) * np.tanh(
            sqrt(2 / np.pi) * (share * (1 + 0.044715 * share * share)))
    return force


def _variance(laws: CornerLaws, slopes: CornerSlopes, motion: Array, std: Array) -> float:
    """The variance [N2] of that force, over what its motion may have been, on the average."""
    parts = _parts(laws, slopes, motion, std)
    scattered = std[1] * _AT[:, None]
    beside = (parts.pop() if laws.others else 0.0) - slopes.beside_n_s_per_m * scattered
    if laws.dry_friction_n:
        beside = beside + laws.dry_friction_n * np.sign(motion[1] + scattered)
    return sum(float((_SHARE @ one**2 - (_SHARE @ one) ** 2).mean()) for one in [*parts, beside])


def _parts(laws: CornerLaws, slopes: CornerSlopes, motion: Array, std: Array) -> list[Array]:
    """Forces (p, t) of dampers, of springs if any push by more than the travel, less those of their stand-ins, and last
    of laws beside them, if there are any, whole, without dry friction, at the points of a normal distribution."""
    own_rate = motion[2] + std[2] * _AT[:, None]
    parts = [laws.damper(own_rate) - slopes.damper_n_s_per_m * own_rate]
    if laws.springs or slopes.spring_n_per_m:
        travel = motion[0] + std[0] * _AT[:, None]
        at = slopes.rest_m + travel
        parts.append(np.asarray(sum((law(at) for law in laws.springs), -slopes.spring_n_per_m * travel)))
    if laws.others:
        # travel and rate of one instant are not correlated: what asks for both is asked at the mean travel
        rate = motion[1] + std[1] * _AT[:, None]
        middle = np.broadcast_to(slopes.rest_m + motion[0], rate.shape)
        parts.append(np.asarray(sum(law(middle, rate) for law in laws.others)))
    return parts
