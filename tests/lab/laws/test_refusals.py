"""A law that says nothing is refused: by its standard errors, its frequency, or because it is a straight line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from logger.lab.laws.draft import Draft, Family, LawContext
from logger.lab.laws.families.damping_by_travel import FAMILY as BY_BOTH
from logger.lab.laws.families.force_by_rate import FAMILY as BY_RATE
from logger.lab.laws.families.record_factor import FAMILY as FACTOR
from logger.lab.laws.learn import Nearest, _beyond, does_nothing, known_instead, refusal
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import fit
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.lab.selection.screening import Baseline
from logger.plugins import catalogue
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.uncertain import NumberErrors

from ...support.lab.noisy_runs import still_runs
from ...support.lab.runs_with_residual import CAR
from ...support.lab.secret_runs import EFFECTS, FINE_HZ, hidden, posterior_of, secret_runs
from ..likelihood.test_signals import with_signals

TWO = "pair_5"
FAMILIES = catalogue("logger.lab.laws.families", "FAMILY")
DRAFTED = sorted(FAMILIES.keys() - {"damper_as_a_whole", "flat_spot", "hum", "loose_sensor", "mount_as_a_whole",
                                    "sliding_behind_spring", "wheel_turns"})
"""Families that draft laws whatever the runs are; the others do where a residual shows their marks, or of parts alone
on a bench."""


def drafts(family: Family) -> dict[str, Draft]:
    posterior = posterior_of(secret_runs())
    return {draft.variant: draft for draft in family.drafts(LawContext(posterior, posterior.start()))}


def found(draft: Draft, values: Sequence[float], errors: Sequence[float]) -> Chosen:
    names = [one.name for one in draft.parameters][: len(values)]
    return replace(chosen(draft.effect, dict(zip(names, values, strict=True))),
                   standard_errors=dict(zip(names, errors, strict=True)))


def errors_of(one: Chosen, correlation: float) -> NumberErrors:
    """Errors of a law whose first two numbers hang together."""
    names = {f"{one.effect.name}.{name}": error for name, error in one.standard_errors.items()}
    return NumberErrors(names, tuple((correlation, *(0.0,) * (row - 1)) if row == 1 else (0.0,) * row
                                     for row in range(len(names))))


@pytest.mark.parametrize(("deviations", "nothing"), [(1.9, True), (2.1, False), (np.inf, True)])
def test_a_strength_is_distinguished_from_nothing_by_two_standard_errors(deviations: float, nothing: bool) -> None:
    draft = drafts(FACTOR)["pole"]
    error = np.inf if np.isinf(deviations) else 0.1
    one = found(draft, [0.1 * min(deviations, 9.0), 5.0], [error, 1.0])
    assert does_nothing(one, errors_of(one, 0.0)) is nothing


@pytest.mark.parametrize("family", DRAFTED)
def test_a_law_whose_numbers_are_well_known_does_something(family: str) -> None:
    laws = drafts(FAMILIES[family])
    assert laws
    for draft in laws.values():
        values = draft.effect.trials()[0].values()
        one = found(draft, list(values), [1e-3 * abs(value) for value in values])
        assert not does_nothing(one, errors_of(one, 0.0))


@pytest.mark.parametrize("correlation", [-0.999, 0.0, 0.9])
def test_two_strengths_are_distinguished_from_nothing_together(correlation: float) -> None:
    """By the distribution that their squares have, in the coordinates in which they do not hang together."""
    draft, off = drafts(FACTOR)[TWO], np.array([1.2, 1.4])
    one = found(draft, [*(0.1 * off), 5.0, 0.2], [0.1, 0.1, 1.0, 0.1])
    squares = ((off.sum() ** 2 / (1 + correlation)) + (off[0] - off[1]) ** 2 / (1 - correlation)) / 2
    expected = chi2(2).sf(squares) > chi2(1).sf(4.0)
    assert does_nothing(one, errors_of(one, correlation)) == expected
    assert expected == (correlation > -0.5)


@pytest.mark.parametrize(("family", "variant", "power", "straight"), [
    (BY_RATE, "power", 1.15, True), (BY_RATE, "power", 1.25, False), (BY_RATE, "power", 0.7, False),
    (BY_BOTH, "", 0.15, True), (BY_BOTH, "", 1.0, False)])
def test_a_power_is_straight_within_two_standard_errors(family: Family, variant: str, power: float, straight: bool
                                                       ) -> None:
    draft = drafts(family)[variant]
    one = found(draft, [100.0, max(power, 0.3)], [1.0, 0.1])
    assert family.is_straight(draft, replace(one, values={**one.values, "power_ratio": power}), 2.0) is straight


@pytest.mark.parametrize(("bend", "straight"), [(0.0, True), (0.1, True), (0.9, False)])
def test_a_curve_is_straight_where_a_line_goes_through_all_its_bars(bend: float, straight: bool) -> None:
    draft = drafts(BY_RATE)["curve"]
    places = np.array(draft.places)
    size = np.abs(places) / places.max()
    force_n = 20.0 * places / places.max() * (1 + bend * size)
    one = found(draft, force_n, np.full(len(places), 1.0))
    assert BY_RATE.is_straight(draft, one, 2.0) is straight


def test_a_known_effect_that_explains_more_is_offered() -> None:
    draft, known = drafts(FACTOR)["pole"], hidden("sensor_gain")
    assert known_instead(draft, None) is None
    assert known_instead(draft, Nearest(known, 99.0, 100.0)) is None
    refused = known_instead(draft, Nearest(known, 130.0, 100.0))
    assert refused is not None and refused.known is not None
    assert refused.known.one.effect is EFFECTS["sensor_gain"] and "30 more" in refused.why


@pytest.mark.parametrize(("added", "hz", "why"), [(0.4, 8.0, ""), (0.0, 8.0, "strength"), (0.4, 45.0, "frequency")])
def test_a_fitted_law_is_refused_for_its_own_numbers(added: float, hz: float, why: str) -> None:
    """A ringing of the record: one that is there, one that is not, and one above the records."""
    draft = drafts(FACTOR)[TWO]
    names = [one.name for one in draft.parameters]
    values = dict(zip(names, (added, 0.0, hz, 0.2 if hz < 37 else 0.05), strict=True))
    posterior = posterior_of(secret_runs([chosen(draft.effect, values)], lasts_s=8.0))
    start = chosen(draft.effect, values | {"added_ratio": max(added, 0.01)})
    begun = posterior.state_at((start,), posterior.start().logs)
    plain, with_law = (Baseline.of(fit(LinearModel(posterior, one))) for one in (posterior.start(), begun))
    refused = refusal(draft, with_law, plain)
    assert (refused.why if refused else "").find(why) >= 0 and bool(refused) == bool(why)


def test_the_band_of_runs_with_several_signals_is_that_of_all_of_them() -> None:
    run = with_signals(still_runs(12.0)[1])
    posterior = Posterior(SimulatedRuns([run], FINE_HZ), CAR, Tolerance())
    draft = drafts(FACTOR)["pole"]
    assert "frequency" in _beyond(posterior, found(draft, [0.4, 45.0], [0.1, 1.0]))
    assert not _beyond(posterior, found(draft, [0.4, 8.0], [0.1, 1.0]))
