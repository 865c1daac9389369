"""When a law that was fitted says nothing, and why.

Problem: what no known effect explains, some law always explains a little better than others. The evidence counts its
numbers; it does not ask whether they mean anything. Solution: a law that was fitted in full is refused where its
strengths are within two standard errors of doing nothing (A. Wald's test, of all of them together: of two that cannot
be distinguished the sum may be well known), where its frequency is outside of the band that is compared or a number at
an end of its range, where it is the straight line that is a number of the car already, and where a known effect
explains more in its place.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from logger.lab.laws.draft import Draft
from logger.lab.likelihood.noise_floor import SURE_SIGMA
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.standard_errors import deviations_from_null, standard_errors
from logger.lab.selection.evidence import INDISTINGUISHABLE
from logger.lab.selection.screening import Baseline
from logger.lab.selection.stepwise import is_outside_data
from logger.vehicle.effect import Chosen
from logger.vehicle.uncertain import NumberErrors


@dataclass(frozen=True, eq=False)
class Nearest:
    """The known effect that gains most in the place of a law: its numbers, its gain and the law's, in minus twice the
    log of the evidence."""

    one: Chosen
    gain: float
    law_gain: float

    @property
    def share(self) -> float:
        """Share of the law's gain."""
        return max(self.gain, 0.0) / self.law_gain

    @property
    def better(self) -> bool:
        """Whether it explains more than the law does."""
        return self.gain > self.law_gain

    @property
    def as_good(self) -> bool:
        """Whether the two cannot be distinguished."""
        return self.gain > self.law_gain - INDISTINGUISHABLE


@dataclass(frozen=True, eq=False)
class Refusal:
    """A law that was fitted and is not learned.

    title    the law in a few words
    why      in words
    known    the known effect that explains more in its place; None: the law says nothing
    """

    title: str
    why: str
    known: Nearest | None = None


def refusal(draft: Draft, model: Baseline, without: Baseline) -> Refusal | None:
    """Why a law in a model that was fitted with it, and without it, says nothing; None where it says something."""
    errors = standard_errors(model.linear)
    one = next(each for each in errors.effects if each.effect.name == draft.name)
    if does_nothing(one, errors.numbers):
        return Refusal(draft.title, f"its strength is within {SURE_SIGMA:g} standard errors of zero")
    if why := _beyond(model.posterior, one):
        return Refusal(draft.title, why)
    if draft.family.is_straight(draft, one, SURE_SIGMA):
        return Refusal(draft.title, f"it is a straight line within {SURE_SIGMA:g} standard errors, which a parameter "
                                    "of the model already describes")
    if model.hold_out.is_worse_than(without.hold_out):
        return Refusal(draft.title, "it raises the error on held-out stretches")
    return None


def known_instead(draft: Draft, nearest: Nearest | None) -> Refusal | None:
    """The refusal of a law in whose place a known effect explains more; None where none does."""
    if nearest is None or not nearest.better:
        return None
    return Refusal(draft.title, f"the known effect {nearest.one.effect.name} explains more in its place (2 ln of the "
                                f"evidence {nearest.gain - nearest.law_gain:.0f} more)", nearest)


def does_nothing(one: Chosen, errors: NumberErrors) -> bool:
    """Whether the strengths of a fitted law are together no farther from doing nothing than chance takes one number by
    ``SURE_SIGMA`` standard errors; or none of them is known. A law without a strength (its number is a length, on a
    scale that has no zero) always does something."""
    from scipy.special import gammaincc

    strengths = [each for each in one.effect.parameters if each.is_free and each.null is not None]
    if not strengths:
        return False
    strengths = [each for each in strengths if np.isfinite(one.standard_errors.get(each.name, np.inf))]
    if not strengths:
        return True
    if len(strengths) == 1:
        return deviations_from_null(one) < SURE_SIGMA
    names = list(errors.standard_errors)
    places = [names.index(f"{one.effect.name}.{each.name}") for each in strengths]
    off = np.array([(one.values[each.name] - float(each.null or 0.0)) / one.standard_errors[each.name]
                    for each in strengths])
    squares = float(off @ np.linalg.pinv(errors.matrix()[np.ix_(places, places)], hermitian=True) @ off)
    return bool(gammaincc(len(off) / 2, squares / 2) > gammaincc(0.5, SURE_SIGMA**2 / 2))


def _beyond(posterior: Posterior, one: Chosen) -> str:
    """Why the numbers of a law are none that the records show; empty where they are."""
    frequency_hz = one.values.get("frequency_hz")
    bands = [each for run in posterior.bands for each in run.each]
    low_hz, high_hz = min(each.edges_hz[0] for each in bands), max(each.edges_hz[-1] for each in bands)
    if frequency_hz is not None and not low_hz < frequency_hz < high_hz:
        return (f"its frequency, {frequency_hz:.3g} Hz, is outside of {low_hz:.2g} to {high_hz:.3g} Hz, in which the "
                "runs are compared")
    return "one of its parameters ended at a bound" if is_outside_data(posterior, one) else ""
