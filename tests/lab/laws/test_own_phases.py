"""Something turns, and stands elsewhere as each run begins: plain sinusoids beside laws with a pair for each run."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from logger.lab.diagnosis import refit
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.hum import FAMILY as HUM
from logger.lab.laws.families.wheel_turns import FAMILY as WHEEL_TURNS
from logger.lab.laws.repeating import EACH
from logger.lab.selection.candidate_fit import fit_roughly, refine
from logger.lab.selection.screening import misalignment, screen
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen

from ...support.lab.secret_runs import CAR, posterior_of, secret_runs

HZ, SIZE_MPS2 = 17.3, 0.25
PHASES = (0.4, 2.9)


def humming() -> SimulatedRuns:
    """Runs into which a tone hums that begins elsewhere in each."""
    runs = secret_runs().runs
    return SimulatedRuns([_with_tone(run, phase) for run, phase in zip(runs, PHASES, strict=True)])


def _with_tone(run, phase):  # type: ignore[no-untyped-def]
    from dataclasses import replace

    time_s = np.arange(run.count) / run.rate_hz
    return replace(run, measured_mps2=run.measured_mps2 + SIZE_MPS2 * np.cos(2 * np.pi * HZ * time_s + phase))


@pytest.mark.slow
def test_a_hum_that_begins_elsewhere_in_each_run_is_found_with_a_pair_for_each() -> None:
    posterior = posterior_of(humming())
    start = posterior.start()
    base = refit(posterior, start)
    drafts = [one for one in HUM.drafts(LawContext(posterior, base.state)) if one.variant.startswith("steady")]
    alike, each = (fit_roughly(base.score, base, screen(base, one.effect, [misalignment(posterior, start)]))[0]
                   for one in drafts)
    assert [one.variant for one in drafts] == ["steady", f"steady{EACH}"]
    assert each.gain > alike.gain + 100
    found = refine(base.score, each).chosen.values
    for number, phase in enumerate(PHASES, 1):
        pair = [found[f"{part}_run_{number}_mps2"] for part in ("cos", "sin")]
        assert pair == pytest.approx([SIZE_MPS2 * np.cos(phase), -SIZE_MPS2 * np.sin(phase)], abs=0.03)


@pytest.mark.slow
def test_a_wheel_of_each_run_is_as_if_that_run_were_alone() -> None:
    one, other = secret_runs().runs
    each = WHEEL_TURNS._draft(("front", "rear"), ("run_1", "run_2"), 0.31, "each")
    alike = WHEEL_TURNS._draft(("front", "rear"), ("",), 0.31, "alike")
    sizes = {("front", "cos"): (0.3, -0.1), ("front", "sin"): (0.0, 0.4), ("rear", "cos"): (-0.2, 0.1),
             ("rear", "sin"): (0.1, 0.2)}
    radius = {"turn_radius_m": 0.31}
    both = chosen(each.effect, radius | {f"{axle}_{part}_run_{run}_kg_m": size
                                         for (axle, part), some in sizes.items() for run, size in enumerate(some, 1)})

    def alone(place: int) -> Chosen:
        return chosen(alike.effect, radius | {f"{axle}_{part}_kg_m": some[place]
                                              for (axle, part), some in sizes.items()})

    together = SimulatedRuns([one, other, other]).predict(compose(CAR, [both]))
    expected = [*SimulatedRuns([one]).predict(compose(CAR, [alone(0)])),
                *SimulatedRuns([other]).predict(compose(CAR, [alone(1)]))]
    for got, wanted in zip(together, [*expected, expected[1]], strict=True):  # a third run is taken for the last
        np.testing.assert_allclose(got, wanted, atol=1e-9)
    assert float(np.abs(together[0] - SimulatedRuns([one]).predict(compose(CAR, []))[0]).max()) > 0.01


def test_sentences_say_that_each_run_begins_elsewhere() -> None:
    draft = WHEEL_TURNS._draft(("",), ("run_1", "run_2"), 0.31, f"imbalance{EACH}")
    found = SimpleNamespace(values={"turn_radius_m": 0.31, "cos_run_1_kg_m": 0.3, "sin_run_1_kg_m": 0.4,
                                    "cos_run_2_kg_m": -0.5, "sin_run_2_kg_m": 0.0})
    said = WHEEL_TURNS.words(draft, found, lambda name, *unit: name)  # type: ignore[arg-type]
    assert said.endswith("out of balance (mean of the runs) by 0.5 kg m, with its own phase in each run")
