"""Motion of the car that no road makes: an engine that runs unevenly, a wheel out of balance.

Problem. What the road does not explain of coarse readings was taken for their noise, and was missing in the ride.
Solution. Such motion has lines; noise and rounding have none. Residuals of a road that has been found are white where
nothing else moves the car, or less where the road took some of them. Where, over 20 s and more, a narrow band of
their periodogram (Welch 1967) is more than chance makes of white ones, the car has a motion m of its own, whose
spectrum M is what is above the noise N. Road and m are then found by turns: m is the most probable one for what the
road leaves, (1 / M + W) m = W e in the waves of m, with W the weights of the readings, and is taken off the readings
of which the road is found. A rough road that hides a line has it in itself already: what is felt stays right.
"""

import numpy as np

from logger.arrays import Array, Complex
from logger.estimation.car_response import HIGHEST_HZ, SteadyMotion
from logger.estimation.scored_variances import BLOCK_SHARE

_BAND_HZ = 0.25
_LOWEST_HZ = 2.0  # below, drift and braking are no road's either
_FIRST_TAKEN_OVER = 0.25  # of a new periodogram
# Smoothed so, white readings have periodograms of some 27 degrees of freedom: more than this comes by chance in one
# band of 3e7 (chi-squared), in some hundred hours of driving, and is then next to nothing.
_ABOVE = 3.2
_STEPS = 4


class OtherMotion:
    """In blocks of readings, one after another and all of one length, one or more for each sample.

    motion_mps2    (count,) most probable one in this block; 0 where there is none
    psd            (f,) its spectrum, one-sided, at the block's frequencies [(m/s2)2/Hz]; None: there is none
    variance_left  what the readings leave open of it [(m/s2)2]
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Another drive begins."""
        self.motion_mps2: Array | float = 0.0
        self.psd: Array | None = None
        self.variance_left = 0.0
        self._rate_hz = 0.0
        self._power: Array | None = None
        self._heard = 0

    def move_on(self, readings: int) -> None:
        """The next block is without so many of the oldest."""
        if not isinstance(self.motion_mps2, float):
            self.motion_mps2 = np.concatenate([self.motion_mps2[readings:], np.zeros(readings)])

    def beside(self, road: SteadyMotion) -> SteadyMotion:
        """All that moves the car, as of one steady motion."""
        return road if self.psd is None else SteadyMotion(road.psd + self.psd, road.rate_hz)

    def find(self, residual_mps2: Array, weight: Array) -> None:
        """In what the road leaves of the readings (count,) [m/s2], by one over the variance of each (count,), by
        conjugate gradients from a start that is right where all weigh the same."""
        if self.psd is None:
            return
        gain = np.sqrt(self.psd * self._rate_hz / 2)
        count, mean_weight = len(weight), float(weight.mean())

        def weighed(row: Array) -> Complex:
            return gain * np.fft.rfft(weight * row)[:len(gain)]

        waves = np.zeros(len(gain), dtype=np.complex128)
        residual = weighed(residual_mps2)
        direction, before = np.zeros_like(waves), np.inf
        for _ in range(_STEPS):
            preconditioned = residual / (1 + gain**2 * mean_weight)
            size = float(np.vdot(residual, preconditioned).real)
            if size <= 0.0:
                break
            direction = preconditioned + size / before * direction
            image = direction + weighed(np.fft.irfft(gain * direction, count))
            step = size / float(np.vdot(direction, image).real)
            waves = waves + step * direction
            residual = residual - step * image
            before = size
        self.motion_mps2 = np.fft.irfft(gain * waves, count)

    def learn(self, residual_mps2: Array, weight: Array, road: SteadyMotion) -> None:
        """What a block says of its spectrum.

        residual_mps2    (count,) what the road leaves of the readings, this motion in it [m/s2]
        weight           (count,) one over their variance [(m/s2)-2], 0 where there are none
        road             the motion that the road makes, at the frequencies of the samples
        """
        count, span, road_psd = len(weight), np.flatnonzero(weight), road.psd
        self._rate_hz = road.rate_hz * (count // (2 * len(road_psd) - 2))
        if len(span) < count // 2:
            return
        f_hz = np.linspace(0.0, road.rate_hz / 2, len(road_psd))
        looked_at = (f_hz >= _LOWEST_HZ) & (f_hz <= HIGHEST_HZ)
        taper = np.zeros(count)
        taper[span[0]:span[-1] + 1] = np.hanning(int(span[-1] - span[0]) + 1)
        fresh = np.abs(np.fft.rfft(weight * residual_mps2 * taper)[:len(road_psd)]) ** 2 / float(weight @ taper**2)
        before = np.ones(len(fresh)) if self._power is None else self._power
        share = max(1 / (1 / _FIRST_TAKEN_OVER + self._heard), BLOCK_SHARE)
        self._power, self._heard = (1 - share) * before + share * fresh, self._heard + 1
        width = 2 * round(_BAND_HZ * count / self._rate_hz / 2) + 1
        smooth = np.convolve(self._power, np.full(width, 1 / width), mode="same")
        noise = 2 / self._rate_hz * float((taper**2).sum()) / float(weight @ taper**2)
        plain = looked_at & (road_psd < noise)
        usual = max(1.0, float(np.median(smooth[plain]))) if plain.any() else 1.0
        above = looked_at & (smooth > _ABOVE * usual)
        if not above.any():
            self.psd, self.variance_left = None, 0.0
            self.motion_mps2 = 0.0
            return
        bands = np.convolve(above, np.ones(width), mode="same") > 0
        # The road took its share of what is left: of M + N it leaves P = (M + N)^2 / (S + M + N).
        left = smooth * noise
        total = 0.5 * (left + np.sqrt(left**2 + 4 * left * road_psd))
        self.psd = np.where(bands, np.maximum(total - usual * noise, 0.0), 0.0)
        both = self.psd * noise / (self.psd + noise)
        self.variance_left = float(both.mean()) * road.rate_hz / 2
