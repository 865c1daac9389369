"""Which force in the suspensions would explain the residual?"""

from math import ceil, log10

import numpy as np

from logger.lab.residual_tests.tests import (
    LEAST_SHARE,
    ResidualEvidence,
    ResidualTest,
    ResidualTestResult,
    ResidualTests,
)
from logger.lab.residuals.force_state_map import Curve
from logger.printable import percent


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
        ratio = f", by {percent(2 * abs(found.value) / damping)} of the model's damping" if damping > 0 else ""
        return (f"The residual depends on the direction: the force {found.figures['acts']} resists {more} more than "
                f"{less}{ratio}, which would explain {percent(found.figures['share'])} of it.")


def _acts(tested: ResidualEvidence) -> str:
    """Where the forces of springs and dampers act in the model."""
    model = tested.residuals.car.vehicle.model
    return {"single_mass": "between the mass and its base", "component": "in the part"}.get(model, "in the suspensions")


def _side(curve: Curve, both: str) -> str:
    """On which side a curve acts; ``both``: what to say where it acts on both in opposite directions."""
    low, high = abs(float(curve.force_n[0])), abs(float(curve.force_n[-1]))
    if min(low, high) < max(low, high) / 3:
        return f"mostly in {'compression' if low > high else 'extension'}"
    return both if curve.force_n[0] * curve.force_n[-1] < 0 else "in the same direction in compression and extension"


def _ends(curve: Curve, factor: float, unit: str) -> str:
    """The force of a curve at both its ends."""
    words = []
    for index, side in ((0, "compression"), (-1, "extension")):
        force, error = float(curve.force_n[index]), float(curve.error_n[index])
        digits = max(0, ceil(-log10(error))) if error > 0 else 0
        size = f"{force:+.{digits}f} ± {error:.{digits}f} N" if abs(force) > 2 * error else "about zero"
        words.append(f"{size} at {abs(curve.at[index]) * factor:.2g} {unit} of {side}")
    return f"{' and '.join(words)} (positive pulls both ends together)"


TESTS = ResidualTests("suspensions", (ForceByTest("rate"), DirectionTest(), ForceByTest("travel")))
