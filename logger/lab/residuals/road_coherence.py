"""Multiple coherence of residual and road: the share of the residual that the road caused.

Problem: noise is part of a residual as well as missing physics; only the latter is coherent with the road. Solution: in
segments of each run the spectrum of the residual is fitted by those of the road's slope under the front and the rear
wheels, frequency by frequency (J. S. Bendat and A. G. Piersol, Random Data, 2010, chapter 7). Without any connection
the share that q inputs explain of n segments is Beta(q, n - q) at every frequency, so that -ln(1 - share) has a mean
and a variance from polygamma functions; sums over frequencies are taken as gamma distributed with their mean and
variance. Neighbouring frequencies of tapered segments are correlated: every other one counts for the test.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from logger.arrays import Array
from logger.lab.likelihood.whittle import LOWEST_HZ
from logger.lab.residuals.breakdown import ModelResiduals, frequencies, segments
from logger.profiles.excitation import Excitation
from logger.profiles.track import Way
from logger.runs import Run
from logger.vehicle.simulate import resampled


@dataclass(frozen=True, eq=False)
class Coherence:
    """Coherence with the road at each frequency (f,), corrected for chance.

    share      of the residual's power, 0 on average without any connection
    raw        before that correction
    inputs     number of inputs q
    segments   effective number of independent segments n
    power      of the residual [m2/s4 in each frequency]
    """

    f_hz: Array
    share: Array
    raw: Array
    inputs: int
    segments: float
    power: Array

    def power_between(self, low_hz: float, high_hz: float) -> float:
        """Power of the residual between two frequencies [m2/s4]."""
        return float(self.power[(self.f_hz >= low_hz) & (self.f_hz < high_hz)].sum())

    def explained(self, low_hz: float, high_hz: float) -> tuple[float, float]:
        """Share of the residual power between two frequencies that is coherent with the road, and its p-value."""
        from scipy.special import digamma, gammaincc, polygamma

        inside = np.flatnonzero((self.f_hz >= low_hz) & (self.f_hz < high_hz) & (self.f_hz > 0))
        power = float(self.power[inside].sum())
        q, n = self.inputs, self.segments
        if not power > 0 or n <= q + 1:
            return 0.0, float("nan")
        share = float((self.share[inside] * self.power[inside]).sum() / power)
        tested = self.raw[inside[::2]]
        statistic = -float(np.log1p(-np.minimum(tested, 1 - 1e-12)).sum())
        mean = len(tested) * float(digamma(n) - digamma(n - q))
        variance = len(tested) * float(polygamma(1, n - q) - polygamma(1, n))
        return max(share, 0.0), float(gammaincc(mean**2 / variance, statistic * mean / variance))


def coherence_with_road(residuals: ModelResiduals) -> Coherence:
    """The coherence of residuals with the road under the wheels that the car has, or with what drives a rig."""
    return _coherence(residuals, _inputs(residuals))


def share_proportional(residuals: ModelResiduals) -> float:
    """Share of the residual's power that is proportional to the model's motion, at each frequency by a factor of its
    own, as what a sensor's gain leaves is. (A mode rings in both alike, however short the segments are.)"""
    return _coherence(residuals, [residuals.model]).explained(LOWEST_HZ, residuals.top_hz)[0]


def _coherence(residuals: ModelResiduals, inputs: Sequence[Sequence[Array]]) -> Coherence:
    residual = segments(residuals, residuals.residual)
    roads = np.stack([segments(residuals, one) for one in inputs], axis=2)
    count = len(residual)
    power = np.mean(np.abs(residual) ** 2, axis=0)
    own = np.einsum("sfi,sfj->fij", roads.conj(), roads) / count
    cross = np.einsum("sfi,sf->fi", roads.conj(), residual) / count
    gain = np.einsum("fij,fj->fi", np.linalg.pinv(own, rcond=1e-6, hermitian=True), cross)
    found = np.einsum("fi,fi->f", cross.conj(), gain).real
    raw = np.clip(np.divide(found, power, out=np.zeros_like(found), where=power > 0), 0.0, 1.0)
    # Segments that overlap by half, with a Hann taper, are worth 18 / 19 of their number (P. D. Welch 1967).
    q, n = len(inputs), 0.947 * count
    chance = q / n
    share = np.clip((raw - chance) / (1 - chance), 0.0, 1.0) if n > q else np.zeros_like(raw)
    return Coherence(frequencies(residuals), share, raw, q, n, power)


def chance_of_following(residuals: ModelResiduals, rate_hz: float) -> float:
    """Probability that by chance alone what drives a run, the only one of some residuals, predicts so much of these
    that their own past does not, of both resampled to about a rate: an F test (C. W. J. Granger, Econometrica 37, 1969,
    424-438). Unlike coherence it needs no segments that outlast the ringing of a mode, and the frequency of a mode may
    depend on its amplitude."""
    from scipy.special import betainc

    factor = max(1, round(residuals.rate_hz / rate_hz))
    residual, *inputs = (one / max(float(np.linalg.norm(one)), 1e-300) for one in (
        resampled(samples - samples.mean(), factor) for samples, in [residuals.residual, *_inputs(residuals)]))
    past = 4 * len(residuals.car.structure.mass)  # two steps for each mode, and as many for the recorder's filter
    if len(residual) < 2 * past * (2 + len(inputs)):
        return 1.0
    own, new = sliding_window_view(residual, past + 1)[:, :past], residual[past:]

    def unpredicted(before: Array) -> tuple[float, int]:
        """Power of what columns (n, c) do not predict, and their rank."""
        weights, _, rank, _ = np.linalg.lstsq(before, new)
        return float(np.sum((new - before @ weights) ** 2)), int(rank)

    alone, few = unpredicted(own)
    driven, many = unpredicted(np.hstack([own, *(sliding_window_view(one, past + 1) for one in inputs)]))
    return float(betainc((len(new) - many) / 2, (many - few) / 2, driven / alone)) if many > few else 1.0


def _inputs(residuals: ModelResiduals) -> list[list[Array]]:
    """What drives the runs: the road's slope under each axle, then the forces of a rig."""
    return [_slopes(residuals, one) for one in np.unique(residuals.car.structure.behind_m)] + _forces(residuals)


def _slopes(residuals: ModelResiduals, behind_m: float) -> list[Array]:
    """Rate of the road's elevation under an axle, tracks averaged, the samples that count, per run [m/s]."""
    def of(run: Run) -> Array:
        way = Way(run.distance_m, run.time_s)
        height = run.track.under_axle(way, behind_m, residuals.car.structure.contact_patch_m)
        return np.gradient(height, 1 / run.rate_hz)

    return residuals.kept(of)


def _forces(residuals: ModelResiduals) -> list[list[Array]]:
    """The forces that drive a rig, the samples that count, per run [N]; none where not all runs have the same."""
    counts = {len(run.track.forces) if isinstance(run.track, Excitation) else 0 for run in residuals.runs}

    def of(run: Run, index: int) -> Array:
        assert isinstance(run.track, Excitation)
        return run.track.forces_n(run.time_s)[:, index]

    return [residuals.kept(partial(of, index=index)) for index in range(counts.pop() if len(counts) == 1 else 0)]


def best_linear_share(residuals: ModelResiduals, error: float) -> float | None:
    """The share of the measured power that a linear car could explain at most: what the model explains, whose
    normalised r.m.s. error is ``error``, and of its residual what is coherent with the road or what drives the rig.
    None where runs are too short for that."""
    share, chance = coherence_with_road(residuals).explained(LOWEST_HZ, residuals.top_hz)
    return None if np.isnan(chance) else 1 - error**2 * (1 - share)
