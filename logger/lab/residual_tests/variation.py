"""Does the residual change with excitation, speed or place?"""

import numpy as np

from logger.identification.noise_models import LAGS, autocorrelations
from logger.lab.residual_tests.tests import (
    LEAST_GROWTH,
    ResidualEvidence,
    ResidualTest,
    ResidualTestResult,
    ResidualTests,
)
from logger.lab.residuals.statistics import block_means, rank_correlation
from logger.runs import short_names


class ExcitationTest(ResidualTest):
    """Rank correlation of the power of the residual with that of the model, in blocks."""

    name, road = "excitation", True

    def run(self, tested: ResidualEvidence) -> ResidualTestResult:
        """The correlation, with the residual where the model moves least and most."""
        residuals, parts = tested.residuals, tested.where.amplitude
        rho, p_value = rank_correlation(*(block_means(residuals, [one**2 for one in signals])
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
        speed = block_means(residuals, residuals.kept(lambda run: run.speed_mps))
        if (freedom := len(speed) - 5) < 6:
            return self.result()
        slow, fast = (float(np.quantile(speed, one)) for one in (0.05, 0.95))
        if fast < LEAST_GROWTH * max(slow, 0.1):
            return self.result()
        residual, model = (np.log(np.maximum(block_means(residuals, [one**2 for one in signals]), 1e-300))
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


TESTS = ResidualTests("variation", (ExcitationTest(), SpeedTest(), PlaceTest()))
