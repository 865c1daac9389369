"""Tests that ridelog brings: does the measurement lag the model, how is the residual distributed, does the car answer
the road otherwise than the model, which force in the suspensions would explain it, does it change with excitation,
speed or place?
"""

from math import ceil, log10

import numpy as np

from logger.dsp.resample import PASS_OF_RATE
from logger.dsp.whole_record import HALF_WIDTH_HZ
from logger.identification.noise_models import LAGS, autocorrelation, autocorrelations, rms
from logger.lab.likelihood.lag import constant_lag, lag_drift
from logger.lab.likelihood.whittle import BLOCK_S
from logger.lab.residual_tests.tests import (
    LEAST_GROWTH,
    LEAST_SHARE,
    SIGNIFICANCE,
    ResidualEvidence,
    ResidualTest,
    ResidualTestResult,
    ResidualTests,
    in_band,
)
from logger.lab.residuals import statistics
from logger.lab.residuals.breakdown import ModelResiduals
from logger.lab.residuals.force_state_map import Curve
from logger.lab.residuals.road_coherence import coherence_with_road
from logger.printable import percent
from logger.runs import are_on_rig, short_names


def _least_lag_s(tested: ResidualEvidence) -> float:
    """A third of a sample: clocks are no better."""
    return 1 / (3 * tested.residuals.rate_hz)


class DriftTest(ResidualTest):
    """A lag that grows along the way."""

    name, unit, road = "drift", "m/m", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The slope of the lag by the way."""
        trend = lag_drift(tested.alignment)
        if not np.isfinite(trend.value):
            return self.result()
        in_all_m = abs(trend.value) * float(tested.alignment.along_m.max())
        least_m = _least_lag_s(tested) * float(np.median(tested.alignment.speed_mps))
        return self.result(trend.value, trend.error, trend.p_value, in_all_m > least_m, in_all_m=in_all_m)

    def sentence(self, found: ResidualTestResult) -> str:
        """Which way, and how far in the longest run."""
        return (f"The model runs {'ahead' if found.value > 0 else 'behind'} by {abs(found.value) * 100:.2g} m in each "
                f"100 m of road, {found.figures['in_all_m']:.2g} m in the longest run: the recorded speed has a "
                "scale error. All other findings may come from that alone.")


class ShiftTest(ResidualTest):
    """A constant lag; not tested where it drifts. A lag by a constant length is a wrong place, no part of the car."""

    name, of_placement = "shift", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The lag in time, or in length where drives at several speeds say so."""
        time, length, is_time = constant_lag(tested.alignment)
        trend, unit = (length, "m") if is_time is False else (time, "s")
        large = abs(time.value) > _least_lag_s(tested) and not DRIFT.run(tested).found
        return self.result(trend.value, trend.error, trend.p_value, large, unit=unit, road=is_time is not False,
                           time_s=time.value, length_m=length.value, is_time=is_time)

    def sentence(self, found: ResidualTestResult) -> str:
        """By how much, and whether it is a time or a length."""
        time_s, length_m, is_time = (found.figures[name] for name in ("time_s", "length_m", "is_time"))
        as_time, as_length = f"{abs(time_s) * 1000:.0f} ms", f"{abs(length_m):.2f} m"
        if not np.isfinite(length_m):  # a rig has no speed
            words = f"{as_time} throughout"
        elif is_time is None:
            words = f"about {as_time} or {as_length}; drives at other speeds would show which"
        else:
            words = f"{as_time if is_time else f'{as_length} of road'}, at any speed"
        return f"The measurement {'lags' if time_s > 0 else 'leads'} the model by {words}."


DRIFT = DriftTest()


class WhitenessTest(ResidualTest):
    """The largest autocorrelation; one of 0.1 explains a hundredth of the power from a sample before. Filtered
    residuals are not tested: they are not white, whatever they were."""

    name = "whiteness"

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The autocorrelation with its lag."""
        residuals = tested.residuals
        if not residuals.whole:
            return self.result()
        rho = autocorrelations(residuals.residual, LAGS)
        largest = int(np.abs(rho).argmax())
        return self.result(float(rho[largest]), sum(map(len, residuals.residual)) ** -0.5,
                           autocorrelation(residuals.residual, 0).p_value, bool(abs(rho[largest]) > 0.1),
                           lag_s=(largest + 1) / residuals.rate_hz)

    def sentence(self, found: ResidualTestResult) -> str:
        """At which lag."""
        return (f"The residual is not white: samples {found.figures['lag_s'] * 1000:.3g} ms apart have a correlation "
                f"of {found.value:.2f}.")


class FrequencyTest(ResidualTest):
    """The band that holds most, compared with white noise: F tests, Bonferroni over the bands."""

    name = "frequency"

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The share of that band."""
        from scipy.special import fdtrc

        parts, residuals = tested.where.frequency, tested.residuals
        whole, span_s = parts[-1].high, sum(map(len, residuals.residual)) / residuals.rate_hz
        freedom = 1.6 * span_s  # per hertz, of spectra of segments that overlap
        chances = []
        for part in parts:
            width = part.high - part.low
            if width >= whole:  # all there is, which cannot hold more than another
                chances.append(1.0)
                continue
            ratio = part.share / width / max((1 - part.share) / (whole - width), 1e-300)
            chances.append(float(fdtrc(max(freedom * width, 1.0), freedom * (whole - width), ratio)) * len(parts))
        best = max((i for i in range(len(parts)) if chances[i] < SIGNIFICANCE), key=lambda i: parts[i].share,
                   default=int(np.argmin(chances)))
        part = parts[best]
        white = (part.high - part.low) / whole
        return self.result(part.share, None, min(chances[best], 1.0), part.share > 2 * white, part=part,
                           white_share=white)

    def sentence(self, found: ResidualTestResult) -> str:
        """Where the power lies."""
        part = found.figures["part"]
        error = f"; NRMSE there {part.error:.2f}" if np.isfinite(part.error) else ""
        return (f"{percent(found.value)} of the residual's power lies {in_band(part.name)} ({part.low:.2g} to "
                f"{part.high:.2g} Hz), against {percent(found.figures['white_share'])} for white noise{error}.")


class SkewnessTest(ResidualTest):
    """Skewness, with Student's test of the cubes of blocks; up to 1/2 either way a distribution counts as fairly
    symmetric (M. G. Bulmer, Principles of Statistics, 1979, chapter 4)."""

    name, road = "skewness", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The mean cube over the cube of the deviation."""
        scale = rms(tested.residuals.residual)
        if not scale > 0:
            return self.result()
        mean, error, p_value = statistics.mean_of_blocks([(one / scale) ** 3 for one in tested.residuals.residual],
                                                         tested.residuals)
        return self.result(mean, error, p_value, abs(mean) > 0.5)

    def sentence(self, found: ResidualTestResult) -> str:
        """Which way."""
        way = "up" if found.value > 0 else "down"
        return (f"The residual's sharp peaks point {way} (skewness {found.value:.1f}): something pushes the body {way} "
                "in short blows.")


class ToneTest(ResidualTest):
    """The strongest spectral line of all runs, compared with the frequencies that the spectra of the likelihood do not
    resolve from it."""

    name, unit, road = "tone", "Hz", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """Its frequency, and the run where it is clearest."""
        residuals, width_hz = tested.residuals, 1 / BLOCK_S
        names, tones = short_names(residuals.runs), []
        for run, residual in zip(residuals.runs, residuals.residual, strict=True):
            f_hz = np.fft.rfftfreq(len(residual), 1 / residuals.rate_hz)
            low_hz, high_hz = run.pass_band_hz
            inside = (f_hz >= low_hz) & (f_hz <= high_hz - (0.0 if residuals.whole else HALF_WIDTH_HZ + width_hz))
            line = statistics.strongest_line(statistics.periodogram(residual), inside,
                                             reach=round(width_hz * len(residual) / residuals.rate_hz))
            if line is not None:
                tones.append((line[1] * len(residuals.runs), float(f_hz[line[0]]), names[run.name]))
        if not tones:
            return self.result()
        p_value, at_hz, name = min(tones)
        return self.result(at_hz, None, min(p_value, 1.0), True, run=name)

    def sentence(self, found: ResidualTestResult) -> str:
        """Where it is."""
        return (f"A single frequency stands out in the residual: {found.value:.1f} Hz, in {found.figures['run']}. "
                "Likely causes: a machine's hum, a resonance, or a harmonic of the excitation.")


class CoherenceTest(ResidualTest):
    """Coherence with the road, at the frequencies that the recorder passes."""

    name, road = "coherence", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The coherent share, and the band that holds most of it."""
        residuals = tested.residuals
        coherence, top = coherence_with_road(residuals), min(PASS_OF_RATE * residuals.rate_hz, residuals.top_hz)
        share, p_value = coherence.explained(0.0, top)
        bands = [band for band in residuals.bands if band.from_hz < top]
        most = max(bands, key=lambda band: coherence.explained(band.from_hz, min(band.to_hz, top))[0]
                   * coherence.power_between(band.from_hz, band.to_hz))
        return self.result(share, None, p_value, share > LEAST_SHARE, band=most.name,
                           of="what drives the rig" if are_on_rig(residuals.runs) else "the road")

    def sentence(self, found: ResidualTestResult) -> str:
        """How much, and where."""
        return (f"At least {percent(found.value)} of the residual is coherent with {found.figures['of']}, mostly "
                f"{in_band(found.figures['band'])}: not noise, and a linear effect could cause it.")


class GainTest(ResidualTest):
    """Gain, measured / model; not large where it is off by half and more, as the shape is another one then."""

    name, road = "gain", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The regression of the measurement on the model."""
        residuals = tested.residuals
        size = sum(float(one @ one) for one in residuals.model) / sum(map(len, residuals.model))
        if not size > 0:
            return self.result()
        excess, error, p_value = statistics.mean_of_blocks(
            [residual * model / size for residual, model in zip(residuals.residual, residuals.model, strict=True)],
            residuals)
        return self.result(1 + excess, error, p_value, LEAST_SHARE < abs(excess) < 0.5)

    def sentence(self, found: ResidualTestResult) -> str:
        """The gain with its standard error."""
        return (f"The part of the measurement that follows the model is {found.value:.3g} ± {found.standard_error:.1g} "
                "times as large as the model.")


class ProportionTest(ResidualTest):
    """Proportionality: gains where a band is weak and where it is strong, with Welch's test of the difference."""

    name, road = "proportion", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The difference of the gains in the band where it is most certain."""
        residuals, compared = tested.residuals, []
        for band in residuals.bands[1:]:
            top_hz = min(PASS_OF_RATE * residuals.rate_hz, residuals.top_hz)
            gains = _two_gains(residuals, band.from_hz, min(band.to_hz, top_hz))
            if gains is not None:
                compared.append((*gains, band.name))
        if not compared:
            return self.result()
        weak, strong, p_value, error, name = min(compared, key=lambda one: one[2])
        return self.result(strong - weak, error, min(1.0, p_value * (len(residuals.bands) - 1)),
                           abs(strong - weak) > 2 * LEAST_SHARE, weak=weak, strong=strong, band=name)

    def sentence(self, found: ResidualTestResult) -> str:
        """Both gains."""
        weak, strong = found.figures["weak"], found.figures["strong"]
        return (f"The response is nonlinear: {in_band(found.figures['band'])}, the measurement is {weak:.2f} times "
                f"the model at small motion and {strong:.2f} times at large motion.")


def _two_gains(residuals: ModelResiduals, low_hz: float, high_hz: float) -> tuple[float, float, float, float] | None:
    """Gains on weak and on strong blocks, the p-value of their difference and its standard error; None for too few."""
    from scipy.special import stdtr

    if high_hz <= low_hz:
        return None
    model, residual = ([statistics.band_pass(one, low_hz, high_hz, residuals.rate_hz) for one in signals]
                       for signals in (residuals.model, residuals.residual))
    own = statistics.block_means(residuals, [one**2 for one in model], blocks=2)
    cross = statistics.block_means(residuals, [a * b for a, b in zip(residual, model, strict=True)], blocks=2)
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
    return gains[0], gains[1], float(2 * stdtr(freedom, -abs(gains[1] - gains[0]) / error)), error


class ForceByTest(ResidualTest):
    """The largest missing force by the rate or the travel of the suspensions that is known to a third of itself, else
    0."""

    unit, road = "N", True

    def __init__(self, by: str) -> None:
        self._by_rate = by == "rate"
        self.name = f"force by {by}"

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """With the curve, and how the law bends."""
        forces = tested.forces
        curve, bend = ((forces.by_rate, forces.progression) if self._by_rate else (forces.by_travel, forces.hardening))
        known = np.abs(curve.force_n) > 3 * curve.error_n
        return self.result(float(np.abs(curve.force_n[known]).max(initial=0.0)), None, curve.p_value,
                           curve.share > LEAST_SHARE, curve=curve, bend=bend.value, acts=_acts(tested))

    def sentence(self, found: ResidualTestResult) -> str:
        """On which side, how much, and what it does at both ends."""
        curve, less = found.figures["curve"], found.figures["bend"] < 0
        if self._by_rate:
            of, part, ends = "velocity", "damper", _ends(curve, 1, "m/s")
            both = f"like a {'digressive' if less else 'progressive'} damper"
        else:
            of, part, ends = "travel", "spring", _ends(curve, 1000, "mm")
            both = f"like a spring that {'softens' if less else 'hardens'} far from its rest"
        return (f"A force {found.figures['acts']} that depends on {of}, {_side(curve, both)}, would explain "
                f"{percent(curve.share)} of the residual. Beside a linear {part}: {ends}.")


class DirectionTest(ResidualTest):
    """Asymmetry of the missing damper force."""

    name, unit, road = "direction", "N s/m", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """Half the difference of rebound and bump."""
        term = tested.forces.asymmetry
        return self.result(term.value, term.error, term.p_value, term.share > LEAST_SHARE, share=term.share,
                           acts=_acts(tested), damping=float(np.mean(tested.residuals.car.structure.dampers)))

    def sentence(self, found: ResidualTestResult) -> str:
        """Which one resists more."""
        damping = found.figures["damping"]
        more, less = ("rebound", "bump") if found.value > 0 else ("bump", "rebound")
        by = 2 * abs(found.value)
        ratio = f", by {by:.2g} N s/m" + (f" ({percent(by / damping)} of the model's damping)" if by < damping else "")
        return (f"The residual depends on the direction: the force {found.figures['acts']} resists {more} more than "
                f"{less}{ratio}, which would explain {percent(found.figures['share'])} of it.")


def _acts(tested: ResidualEvidence) -> str:
    """Where the forces of springs and dampers act in the model."""
    model = tested.residuals.car.vehicle.model
    return {"single_mass": "between the mass and its base", "component": "in the part"}.get(model, "in the suspensions")


def _side(curve: Curve, both: str) -> str:
    """On which side a curve acts; ``both``: what to say where it acts on both in opposite directions."""
    low, high = abs(float(curve.force_n[0])), abs(float(curve.force_n[-1]))
    if not _known_ends(curve):
        return "mostly between its ends"
    if min(low, high) < max(low, high) / 3:
        return f"mostly in {'compression' if low > high else 'extension'}"
    return both if curve.force_n[0] * curve.force_n[-1] < 0 else "in the same direction in compression and extension"


def _known_ends(curve: Curve) -> bool:
    """Whether the force at one end is more than its error may be."""
    return bool((np.abs(curve.force_n) > 2 * curve.error_n)[[0, -1]].any())


def _ends(curve: Curve, factor: float, unit: str) -> str:
    """The force of a curve at both its ends, or where it is known best if at neither."""
    words = []
    known = np.abs(curve.force_n) / np.where(curve.error_n > 0, curve.error_n, np.inf)
    for index in (0, -1) if _known_ends(curve) else (int(np.argmax(known)),):
        force, error, at = (float(values[index]) for values in (curve.force_n, curve.error_n, curve.at))
        digits = max(0, ceil(-log10(error))) if error > 0 else 0
        size = f"{force:+.{digits}f} ± {error:.{digits}f} N" if abs(force) > 2 * error else "about zero"
        words.append(f"{size} at {abs(at) * factor:.2g} {unit} of {'compression' if at < 0 else 'extension'}")
    return f"{' and '.join(words)} (positive pulls both ends together)"


class ExcitationTest(ResidualTest):
    """Rank correlation of the power of the residual with that of the model, in blocks."""

    name, road = "excitation", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The correlation, with the residual where the model moves least and most."""
        residuals, parts = tested.residuals, tested.where.amplitude
        rho, p_value = statistics.rank_correlation(*(statistics.block_means(residuals, [one**2 for one in signals])
                                                     for signals in (residuals.residual, residuals.model)))
        low, high = parts[0], parts[-1]
        grown = max(high.residual_mps2, 1e-300) / max(low.residual_mps2, 1e-300)
        large = len(parts) > 1 and (grown > LEAST_GROWTH if rho > 0 else grown < 1 / LEAST_GROWTH)
        return self.result(rho, None, p_value, large, low=low, high=high, motion_unit=residuals.unit)

    def sentence(self, found: ResidualTestResult) -> str:
        """The residual at small and at large motion."""
        low, high, unit = (found.figures[key] for key in ("low", "high", "motion_unit"))
        return (f"The residual {'grows' if found.value > 0 else 'shrinks'} with the motion: "
                f"{low.residual_mps2:.2g} {unit} where the model moves by up to {low.high:.2g} {unit}, "
                f"{high.residual_mps2:.2g} {unit} beyond {high.low:.2g} {unit}.")


class SpeedTest(ResidualTest):
    """Factor by which the residual changes from the slowest to the fastest driving at equal excitation: a regression of
    the logarithms of blocks on speed and a cubic of excitation. Not tested where speeds differ by less than would
    matter of the residual."""

    name = "speed"

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The factor, between the 5 and 95 % quantiles of the speed."""
        from scipy.special import stdtr

        residuals = tested.residuals
        speed = statistics.block_means(residuals, residuals.kept(lambda run: run.speed_mps))
        if (freedom := len(speed) - 5) < 6:
            return self.result()
        slow, fast = (float(np.quantile(speed, one)) for one in (0.05, 0.95))
        if fast < LEAST_GROWTH * max(slow, 0.1):
            return self.result()
        residual, model = (np.log(np.maximum(statistics.block_means(residuals, [one**2 for one in signals]), 1e-300))
                           for signals in (residuals.residual, residuals.model))
        level = (model - model.mean()) / (float(model.std()) or 1.0)
        columns = np.column_stack([np.ones(len(level)), (speed - slow) / (fast - slow), level, level**2, level**3])
        coefficients, *_ = np.linalg.lstsq(columns, residual, rcond=None)
        rest = residual - columns @ coefficients
        error = float(np.sqrt(rest @ rest / freedom * np.linalg.pinv(columns.T @ columns)[1, 1]))
        factor = float(np.exp(coefficients[1] / 2))
        p_value = float(2 * stdtr(freedom, -abs(coefficients[1]) / error)) if error > 0 else np.nan
        return self.result(factor, factor * error / 2, p_value, max(factor, 1 / factor) > LEAST_GROWTH,
                           slow_mps=slow, fast_mps=fast)

    def sentence(self, found: ResidualTestResult) -> str:
        """The factor between both speeds."""
        slow_mps, fast_mps = found.figures["slow_mps"], found.figures["fast_mps"]
        return (f"Where the motion is the same, the residual is {found.value:.1f} times as large at "
                f"{fast_mps:.0f} m/s as at {slow_mps:.0f} m/s.")


class PlaceTest(ResidualTest):
    """The place with most power for its length; its autocorrelation gives the number of independent samples."""

    name = "place"

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The residual there over the usual one."""
        from scipy.special import chdtrc

        parts, names = tested.where.place, short_names(tested.residuals.runs)
        usual = float(np.median([part.residual_mps2 for part in parts])) if parts else 0.0
        if not usual > 0:
            return self.result()
        worth = 1 / (1 + 2 * float((autocorrelations(tested.residuals.residual, 2 * LAGS) ** 2).sum()))
        mean = sum(part.residual_mps2**2 * part.samples for part in parts) / sum(part.samples for part in parts)
        chances = [float(chdtrc(worth * part.samples, worth * part.samples * part.residual_mps2**2 / mean))
                   for part in parts]
        worst = tested.where.worst_places(3)
        ratio = max(part.residual_mps2 for part in worst) / usual
        return self.result(ratio, None, min(1.0, min(chances) * len(chances)), ratio > 2, worst=worst, usual_mps2=usual,
                           names=names)

    def sentence(self, found: ResidualTestResult) -> str:
        """The worst places."""
        usual_mps2, names = found.figures["usual_mps2"], found.figures["names"]
        named = "; ".join(f"{names[part.name]}, {part.low:g} to {part.high:g} m ({part.residual_mps2 / usual_mps2:.1f} "
                          "times)" for part in found.figures["worst"])
        return f"At some places the residual is much larger than usual: {named}."


TESTS = ResidualTests("residual", (
    DRIFT, ShiftTest(), WhitenessTest(), FrequencyTest(), SkewnessTest(), ToneTest(), CoherenceTest(), GainTest(),
    ProportionTest(), ForceByTest("rate"), DirectionTest(), ForceByTest("travel"), ExcitationTest(), SpeedTest(),
    PlaceTest()))
