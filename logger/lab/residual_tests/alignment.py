"""Does the measurement lag the model, by a constant or by more and more?"""

import numpy as np

from logger.lab.likelihood.lag import constant_lag, lag_drift
from logger.lab.residual_tests.tests import ResidualEvidence, ResidualTest, ResidualTestResult, ResidualTests


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
TESTS = ResidualTests("alignment", (DRIFT, ShiftTest()))
