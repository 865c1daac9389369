"""Tests of a model's residual: a fixed list, which knows no effect.

Problem: a residual has to be read by people who want to know whether physics is missing, and of which kind. Solution:
each test asks one question (is it coherent with the road, is the car's response proportional, does it depend on the
direction of motion ...), and gives a value, its standard error where it has one, and a p-value against a residual that
is noise. A test finds something when it is significant and large enough to matter. ``report.residual_text`` says it in
words.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from logger.dsp.pass_band import HALF_WIDTH_HZ
from logger.identification.residual_whiteness import LAGS, autocorrelation
from logger.lab.likelihood.lag import Lags, constant_lag, lag_drift, lags
from logger.lab.residuals.block_statistics import (
    autocorrelations,
    band_pass,
    block_means,
    mean_of_blocks,
    rank_correlation,
    rms,
)
from logger.lab.residuals.breakdown import Breakdown, ModelResiduals, Part
from logger.lab.residuals.force_state_map import Curve, ForceMap, force_map
from logger.lab.residuals.road_coherence import coherence_with_road
from logger.lab.residuals.spectral_lines import periodogram, strongest_line
from logger.runs import short_names
from logger.vehicle.simulate import PASS_OF_RATE

SIGNIFICANCE = 0.002
"""A test with a smaller p-value is significant: of fifteen tests of noise one is in some thirty comparisons."""
LEAST_SHARE = 0.02
"""A smaller share of the residual's power, or of a gain, does not matter. A judgement: an error of 0.1 would fall by
0.001."""
LEAST_GROWTH = 1.3
"""A residual that changes by a smaller factor is as large everywhere. A judgement."""


@dataclass(frozen=True)
class ResidualTest:
    """The result of one test.

    value, unit, standard_error    of what is tested; the last where there is one; NaN where the runs are not enough
    p_value                        against noise; NaN where the runs are not enough
    large                          whether the value is large enough to matter
    road                           whether it relates the residual to the road or to the car's motion
    figures                        what else its sentence says, by name
    """

    name: str
    value: float = np.nan
    unit: str = "1"
    standard_error: float | None = None
    p_value: float = np.nan
    large: bool = False
    road: bool = False
    figures: Mapping[str, Any] = field(default_factory=dict)

    @property
    def found(self) -> bool:
        """Whether the test is significant and its value large enough to matter."""
        return bool(self.p_value < SIGNIFICANCE and self.large)


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """All tests of a residual, with the force map and the lags that pictures show."""

    tests: tuple[ResidualTest, ...]
    forces: ForceMap
    alignment: Lags

    @property
    def found(self) -> tuple[ResidualTest, ...]:
        """The tests that find something."""
        return tuple(one for one in self.tests if one.found)


def run_residual_tests(residuals: ModelResiduals, where: Breakdown, unmoved: ModelResiduals) -> ResidualTests:
    """Test the residuals of a model.

    where      their power by frequency, speed, excitation and place
    unmoved    of the same car at the recorded distances, whose lags are tested
    """
    forces, alignment = force_map(residuals), lags(unmoved.runs, unmoved.predictions)
    drifting = _drift(alignment)
    tests = (
        drifting, _shift(alignment, drifting), _whiteness(residuals), _frequency(residuals, where),
        _coherence(residuals), _gain(residuals), _proportion(residuals),
        _force_by("rate", forces.by_rate, forces.progression.value), _direction(forces, residuals),
        _force_by("travel", forces.by_travel, forces.hardening.value), _skewness(residuals),
        _excitation(residuals, where), _speed(residuals), _place(residuals, where), _tone(residuals),
    )
    return ResidualTests(tests, forces, alignment)


# --- the residual by itself ---


def _whiteness(residuals: ModelResiduals) -> ResidualTest:
    """The largest autocorrelation; one of 0.1 explains a hundredth of the power from a sample before. Filtered
    residuals are not tested: they are not white, whatever they were."""
    if not residuals.whole:
        return ResidualTest("whiteness")
    rho = autocorrelations(residuals.residual, LAGS)
    largest = int(np.abs(rho).argmax())
    return ResidualTest("whiteness", float(rho[largest]), "1", sum(map(len, residuals.residual)) ** -0.5,
                        autocorrelation(residuals.residual, 0).p_value, bool(abs(rho[largest]) > 0.1),
                        figures={"lag_s": (largest + 1) / residuals.rate_hz})


def _frequency(residuals: ModelResiduals, where: Breakdown) -> ResidualTest:
    """The band that holds most, compared with white noise: F tests, Bonferroni over the bands."""
    from scipy.stats import f

    parts = where.frequency
    whole, span_s = parts[-1].high, sum(map(len, residuals.residual)) / residuals.rate_hz
    freedom = 1.6 * span_s  # per hertz, of spectra of segments that overlap
    chances = []
    for part in parts:
        width = part.high - part.low
        ratio = part.share / width / max((1 - part.share) / (whole - width), 1e-300)
        chances.append(float(f.sf(ratio, max(freedom * width, 1.0), freedom * (whole - width))) * len(parts))
    best = max((i for i in range(len(parts)) if chances[i] < SIGNIFICANCE), key=lambda i: parts[i].share,
               default=int(np.argmin(chances)))
    part = parts[best]
    white = (part.high - part.low) / whole
    return ResidualTest("frequency", part.share, p_value=min(chances[best], 1.0), large=part.share > 2 * white,
                        figures={"part": part, "white_share": white})


def _skewness(residuals: ModelResiduals) -> ResidualTest:
    """Skewness, with Student's test of the cubes of blocks; up to 1/2 either way a distribution counts as fairly
    symmetric (M. G. Bulmer, Principles of Statistics, 1979, chapter 4)."""
    scale = rms(residuals.residual)
    if not scale > 0:
        return ResidualTest("lean")
    mean, error, p_value = mean_of_blocks([(one / scale) ** 3 for one in residuals.residual], residuals)
    return ResidualTest("lean", mean, "1", error, p_value, abs(mean) > 0.5, True)


def _tone(residuals: ModelResiduals, width_hz: float = 0.4) -> ResidualTest:
    """The strongest spectral line of all runs, compared with the frequencies within a width on either side, about what
    a spectrum of segments resolves."""
    names, tones = short_names(residuals.runs), []
    for run, residual in zip(residuals.runs, residuals.residual, strict=True):
        f_hz = np.fft.rfftfreq(len(residual), 1 / residuals.rate_hz)
        low_hz, high_hz = run.pass_band_hz
        inside = (f_hz >= low_hz) & (f_hz <= high_hz - (0.0 if residuals.whole else HALF_WIDTH_HZ + width_hz))
        found = strongest_line(periodogram(residual), inside, round(width_hz * len(residual) / residuals.rate_hz))
        if found is not None:
            tones.append((found[1] * len(residuals.runs), float(f_hz[found[0]]), names[run.name]))
    if not tones:
        return ResidualTest("tone", unit="Hz")
    p_value, at_hz, name = min(tones)
    return ResidualTest("tone", at_hz, "Hz", None, min(p_value, 1.0), True, figures={"run": name})


# --- the residual and the road ---


def _coherence(residuals: ModelResiduals) -> ResidualTest:
    """Coherence with the road, at the frequencies that the recorder passes."""
    coherence, top = coherence_with_road(residuals), min(PASS_OF_RATE * residuals.rate_hz, residuals.top_hz)
    share, p_value = coherence.explained(0.0, top)
    bands = [band for band in residuals.bands if band.from_hz < top]
    most = max(bands, key=lambda band: coherence.explained(band.from_hz, min(band.to_hz, top))[0]
               * coherence.power_between(band.from_hz, band.to_hz))
    return ResidualTest("coherence", share, "1", None, p_value, share > LEAST_SHARE, True, {"band": most.name})


def _gain(residuals: ModelResiduals) -> ResidualTest:
    """Gain, measured / model; not large where it is off by half and more, as the shape is another one then."""
    size = sum(float(one @ one) for one in residuals.model) / sum(map(len, residuals.model))
    if not size > 0:
        return ResidualTest("gain")
    excess, error, p_value = mean_of_blocks(
        [residual * model / size for residual, model in zip(residuals.residual, residuals.model, strict=True)],
        residuals)
    return ResidualTest("gain", 1 + excess, "1", error, p_value, LEAST_SHARE < abs(excess) < 0.5, True)


def _shift(alignment: Lags, drifting: ResidualTest, least_s: float = 0.003) -> ResidualTest:
    """A constant lag; not tested where it drifts. ``least_s`` is a third of a sample at 100 samples a second: clocks
    are no better. A lag by a constant length is a wrong place, no part of the car."""
    time, length, is_time = constant_lag(alignment)
    trend, unit = (length, "m") if is_time is False else (time, "s")
    return ResidualTest("shift", trend.value, unit, trend.error, trend.p_value,
                        abs(time.value) > least_s and not drifting.found, is_time is not False,
                        {"time_s": time.value, "length_m": length.value, "is_time": is_time})


def _drift(alignment: Lags, least_m: float = 0.05) -> ResidualTest:
    """A lag that grows along the way, to ``least_m`` at least in the longest run (a judgement: a twentieth of the wave
    that makes wheels hop at 10 m/s)."""
    trend = lag_drift(alignment)
    in_all_m = abs(trend.value) * float(alignment.along_m.max(initial=0.0))
    return ResidualTest("drift", trend.value, "m/m", trend.error, trend.p_value, in_all_m > least_m, True,
                        {"in_all_m": in_all_m})


def _proportion(residuals: ModelResiduals) -> ResidualTest:
    """Proportionality: gains where a band is weak and where it is strong, with Welch's test of the difference."""
    found = []
    for band in residuals.bands[1:]:
        top_hz = min(PASS_OF_RATE * residuals.rate_hz, residuals.top_hz)
        gains = _two_gains(residuals, band.from_hz, min(band.to_hz, top_hz))
        if gains is not None:
            found.append((*gains, band.name))
    if not found:
        return ResidualTest("proportion")
    weak, strong, p_value, error, name = min(found, key=lambda one: one[2])
    return ResidualTest("proportion", strong - weak, "1", error, min(1.0, p_value * (len(residuals.bands) - 1)),
                        abs(strong - weak) > 2 * LEAST_SHARE, True, {"weak": weak, "strong": strong, "band": name})


def _two_gains(residuals: ModelResiduals, low_hz: float, high_hz: float) -> tuple[float, float, float, float] | None:
    """Gains on weak and on strong blocks, the p-value of their difference and its standard error; None for too few."""
    from scipy.stats import t

    if high_hz <= low_hz:
        return None
    model, residual = ([band_pass(one, low_hz, high_hz, residuals.rate_hz) for one in signals]
                       for signals in (residuals.model, residuals.residual))
    own = block_means(residuals, [one**2 for one in model], 2)
    cross = block_means(residuals, [a * b for a, b in zip(residual, model, strict=True)], 2)
    third = len(own) // 3
    if third < 4 or not own.any():
        return None
    order = np.argsort(own)
    gains, errors = [], []
    for chosen in (order[:third], order[-third:]):
        total = float(own[chosen].sum())
        gain = float(cross[chosen].sum()) / total if total > 0 else 0.0
        spread = cross[chosen] - gain * own[chosen]
        gains.append(1 + gain)
        errors.append(float(np.sqrt((spread**2).sum() * third / (third - 1))) / total if total > 0 else np.inf)
    error = float(np.hypot(errors[0], errors[1]))
    if not 0 < error < np.inf:
        return None
    freedom = error**4 / sum(one**4 for one in errors) * (third - 1)
    return gains[0], gains[1], float(2 * t.sf(abs(gains[1] - gains[0]) / error, freedom)), error


# --- the residual and the suspensions ---


def _force_by(coordinate: str, curve: Curve, bend: float) -> ResidualTest:
    """The largest missing force of a curve that is known to a third of itself, else 0; ``bend``: curvature of the
    law."""
    known = np.abs(curve.force_n) > 3 * curve.error_n
    return ResidualTest(f"force by {coordinate}", float(np.abs(curve.force_n[known]).max(initial=0.0)), "N", None,
                        curve.p_value, curve.share > LEAST_SHARE, True, {"curve": curve, "bend": bend})


def _direction(forces: ForceMap, residuals: ModelResiduals) -> ResidualTest:
    """Asymmetry of the missing damper force."""
    term = forces.asymmetry
    return ResidualTest("direction", term.value, "N s/m", term.error, term.p_value, term.share > LEAST_SHARE, True,
                        {"share": term.share, "damping": float(np.mean(residuals.car.structure.dampers))})


# --- the residual and the drive ---


def _excitation(residuals: ModelResiduals, where: Breakdown) -> ResidualTest:
    """Rank correlation of the power of the residual with that of the model, in blocks."""
    rho, p_value = rank_correlation(*(block_means(residuals, [one**2 for one in signals])
                                      for signals in (residuals.residual, residuals.model)))
    low, high = where.amplitude[0], where.amplitude[-1]
    grown = max(high.residual_mps2, 1e-300) / max(low.residual_mps2, 1e-300)
    large = len(where.amplitude) > 1 and (grown > LEAST_GROWTH if rho > 0 else grown < 1 / LEAST_GROWTH)
    return ResidualTest("excitation", rho, "1", None, p_value, large, True, {"low": low, "high": high})


def _speed(residuals: ModelResiduals, least_spread: float = 1.15) -> ResidualTest:
    """Factor by which the residual changes from the slowest to the fastest driving at equal excitation: a regression of
    the logarithms of blocks on speed and a cubic of excitation. Not tested where speeds hardly differ."""
    from scipy.stats import t

    speed = block_means(residuals, residuals.kept(lambda run: run.speed_mps))
    slow, fast = (float(np.quantile(speed, one)) for one in (0.05, 0.95))
    freedom = len(speed) - 5
    if fast < least_spread * max(slow, 0.1) or freedom < 6:
        return ResidualTest("speed")
    residual, model = (np.log(np.maximum(block_means(residuals, [one**2 for one in signals]), 1e-300))
                       for signals in (residuals.residual, residuals.model))
    level = (model - model.mean()) / (float(model.std()) or 1.0)
    columns = np.column_stack([np.ones(len(level)), (speed - slow) / (fast - slow), level, level**2, level**3])
    coefficients, *_ = np.linalg.lstsq(columns, residual, rcond=None)
    rest = residual - columns @ coefficients
    error = float(np.sqrt(rest @ rest / freedom * np.linalg.pinv(columns.T @ columns)[1, 1]))
    factor = float(np.exp(coefficients[1] / 2))
    p_value = float(2 * t.sf(abs(coefficients[1]) / error, freedom)) if error > 0 else np.nan
    return ResidualTest("speed", factor, "1", factor * error / 2, p_value, max(factor, 1 / factor) > LEAST_GROWTH,
                        figures={"slow_mps": slow, "fast_mps": fast})


def _place(residuals: ModelResiduals, where: Breakdown) -> ResidualTest:
    """The place with most power for its length; its autocorrelation gives the number of independent samples."""
    from scipy.stats import chi2

    usual = float(np.median([part.residual_mps2 for part in where.place])) if where.place else 0.0
    if not usual > 0:
        return ResidualTest("place")
    worth = 1 / (1 + 2 * float((autocorrelations(residuals.residual, 2 * LAGS) ** 2).sum()))
    mean = sum(part.residual_mps2**2 * part.samples for part in where.place) / sum(part.samples for part in where.place)
    chances = [float(chi2.sf(worth * part.samples * part.residual_mps2**2 / mean, worth * part.samples))
               for part in where.place]
    worst = worst_places(where, 3)
    ratio = max(part.residual_mps2 for part in worst) / usual
    return ResidualTest("place", ratio, "1", None, min(1.0, min(chances) * len(chances)), ratio > 2, figures={
        "worst": worst, "usual_mps2": usual, "names": short_names(residuals.runs)})


def worst_places(where: Breakdown, count: int) -> list[Part]:
    """The places that hold most of the residual power."""
    return sorted(where.place, key=lambda part: -part.share)[:count]
