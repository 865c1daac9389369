"""How the evidence for a road's level bends where the bounds of coarse readings move with it.

Problem. As Gaussian readings (``quantisation``) bounds say how rough a road is with a curvature that assumes that they
would stay as they are, were the level another. They do not: of a road that toggles between two steps a third or less
of it is true, for twice the road about a place twice as far from the edge toggles alike; of one that seldom leaves a
step ten times as much, for the probability of leaving it falls as that of a tail does. Newton's steps with the wrong
curvature run in circles, and standard errors by it are wrong as much.

Solution. Beside every other block it is solved once more with the level raised by ``RISE``, from the bounds of the
block as far as they moved in the blocks before. The difference of both slopes is the curvature; by the difference of
both solutions bounds and road go along with a level that changes, so that they need not be found anew. And what both
say of the sensor's noise differs: where readings toggle, more noise and a smoother road look alike, so the evidence for
a noise is asked at the level that is most probable with it (profile likelihood), not at one level for all.
"""

from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Bools, Complex
from logger.estimation.quantisation import GaussianReadings
from logger.estimation.road_solver import Block
from logger.estimation.roughness import ResolvedShares
from logger.estimation.scored_variances import BLOCK_SHARE

RISE = 0.4  # of the log level, by 22 % of an IRI: about a standard error of it where steps hide a road
_FOLLOWED_SAMPLES = 600  # the newest, whose bounds have gone through fewer than four blocks
RAISED_EVERY = 2  # blocks: how bounds answer a level changes slowly, and a block is a round dearer for it
_LEAST_CURVATURE = 0.15  # of the expected one: a third of it where readings toggle about one edge
_MOST_RISE = 1.0  # of a level that goes with another noise: farther off, one step of RISE tells nothing
_MOST_CHANGE = 0.5  # of a precision at once, so that one is left


@dataclass(frozen=True)
class Answer:
    """What a level led to: ``readings`` after it, which of them were read while the car moved, and ``expected`` and
    ``others`` of ``without_own`` before; ``waves`` of the road's innovations, and of the points of the block what
    ``RoadLevels.learn`` was told."""

    readings: GaussianReadings
    moving: Bools
    expected: Array
    others: Array
    waves: Complex
    innovations: Array
    log_variance: Array
    shares: ResolvedShares
    seen: Array

    def slope(self, counted: Array) -> tuple[float, float]:
        """Of the log evidence, in a level that all points ``counted`` (n,) share, and its expected curvature."""
        return (0.5 * float(counted @ (self.innovations**2 * np.exp(-self.log_variance) - self.shares.points)),
                0.5 * float(counted @ self.shares.freedom))


class LevelResponse:
    """Of blocks of readings, one after another.

    curvature    of the evidence with the level, over that where the bounds would stay
    """

    def __init__(self) -> None:
        self._precision = self._pull = np.zeros(0)
        self._road: tuple[Block, Complex] | None = None
        self._curvatures = np.zeros(2)
        self.curvature = 1.0
        self._noise_slope, self._per_reading = np.zeros(1), 0.0

    def move_on(self, readings: int) -> None:
        """The next block is without so many of the oldest."""
        if self._road is not None:
            self._precision, self._pull = (
                np.append(row[readings:], np.zeros(readings)) for row in (self._precision, self._pull))

    def readings_at(self, readings: GaussianReadings, rise: Array | float) -> GaussianReadings:
        """Readings (y,) where the log level is higher by ``rise``, (y,) or one for all."""
        if self._road is None:
            return readings
        before = 1 / readings.variance
        share = np.asarray(rise) / RISE
        share = share * np.minimum(1.0, _MOST_CHANGE * before / np.maximum(np.abs(share * self._precision),
                                                                            _MOST_CHANGE * before))
        precision = before + share * self._precision
        return GaussianReadings((readings.value_mps2 * before + share * self._pull) / precision, 1 / precision)

    def waves_at(self, block: Block, waves: Complex, rise: Array) -> Complex:
        """The road's innovations likewise, for points (n,) of the block."""
        if self._road is None:
            return waves
        change = np.fft.irfft(block.carried_over(*self._road), block.count)
        return waves + np.fft.rfft(rise / RISE * change)

    def learn(self, block: Block, answer: Answer, raised: Answer, noise_slope: Array | None) -> None:
        """From a block's answer, and that to a level raised by ``RISE``; ``noise_slope`` (g,) is by how much that makes
        a reading's log evidence for noises rise, per log level."""
        one, other = answer.readings, raised.readings
        self._precision = 1 / other.variance - 1 / one.variance
        self._pull = other.value_mps2 / other.variance - one.value_mps2 / one.variance
        self._road = block, raised.waves - answer.waves
        counted = answer.seen * (np.arange(block.count) < block.point_at(-_FOLLOWED_SAMPLES))
        slope, expected = answer.slope(counted)
        fresh = np.array([(slope - raised.slope(counted)[0]) / RISE, expected])
        share = RAISED_EVERY * BLOCK_SHARE
        self._curvatures = (1 - share) * self._curvatures + share * fresh
        if self._curvatures[1] > 0:
            self.curvature = max(float(self._curvatures[0] / self._curvatures[1]), _LEAST_CURVATURE)
        if noise_slope is not None:
            share = share if self._per_reading else 1.0
            followed = answer.moving[:-_FOLLOWED_SAMPLES * len(answer.moving) // len(block.moving)]
            per_reading = self.curvature * expected / max(int(np.count_nonzero(followed)), 1)
            self._noise_slope = (1 - share) * self._noise_slope + share * noise_slope
            self._per_reading += share * (per_reading - self._per_reading)

    def with_level(self, log_evidence: Array, readings: int, number: int) -> Array:
        """Log evidence (g,) of so many readings for noises, each with the level that goes with it, where it was that
        with the level that goes with the noise of this ``number``."""
        if not self._per_reading:
            return log_evidence
        slope = self._noise_slope - self._noise_slope[number]
        rise = np.clip(slope / self._per_reading, -_MOST_RISE, _MOST_RISE)
        return log_evidence + readings * rise * (slope - 0.5 * self._per_reading * rise)
