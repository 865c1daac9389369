"""Does the car answer the road otherwise than the model, in a linear way or out of proportion?"""

import numpy as np

from logger.dsp.resample import PASS_OF_RATE
from logger.lab.residual_tests.tests import (
    LEAST_SHARE,
    ResidualEvidence,
    ResidualTest,
    ResidualTestResult,
    ResidualTests,
    in_band,
)
from logger.lab.residuals.breakdown import ModelResiduals
from logger.lab.residuals.road_coherence import coherence_with_road
from logger.lab.residuals.statistics import band_pass, block_means, mean_of_blocks
from logger.printable import percent
from logger.runs import are_on_rig


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
        excess, error, p_value = mean_of_blocks(
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
    model, residual = ([band_pass(one, low_hz, high_hz, residuals.rate_hz) for one in signals]
                       for signals in (residuals.model, residuals.residual))
    own = block_means(residuals, [one**2 for one in model], blocks=2)
    cross = block_means(residuals, [a * b for a, b in zip(residual, model, strict=True)], blocks=2)
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


TESTS = ResidualTests("response", (CoherenceTest(), GainTest(), ProportionTest()))
