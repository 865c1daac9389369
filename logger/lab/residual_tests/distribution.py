"""How is the residual distributed, in time, over frequency and in size?"""

import numpy as np

from logger.dsp.whole_record import HALF_WIDTH_HZ
from logger.identification.noise_models import LAGS, autocorrelation, autocorrelations, rms
from logger.lab.likelihood.whittle import BLOCK_S
from logger.lab.residual_tests.tests import (
    SIGNIFICANCE,
    ResidualEvidence,
    ResidualTest,
    ResidualTestResult,
    ResidualTests,
    in_band,
)
from logger.lab.residuals.statistics import mean_of_blocks, periodogram, strongest_line
from logger.printable import percent
from logger.runs import short_names


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
        mean, error, p_value = mean_of_blocks([(one / scale) ** 3 for one in tested.residuals.residual],
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
            line = strongest_line(periodogram(residual), inside,
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


TESTS = ResidualTests("distribution", (WhitenessTest(), FrequencyTest(), SkewnessTest(), ToneTest()))
