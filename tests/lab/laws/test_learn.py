"""What no effect of the list is, is learned as a law; what one of them is, or nothing, is not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from logger.lab.laws.draft import LEARNED, Draft, Family, FormatNumber, LawContext
from logger.lab.laws.learn import Learning, learn
from logger.plugins import catalogue
from logger.store.formats.effect_file import own_effect, shipped_effects
from logger.vehicle.effect import AXLE, Chosen, Effect, ForceEffect, RecordEffect, Recording, chosen
from logger.vehicle.laws import CornerLaws, linear

from ...support.lab.secret_runs import EFFECTS, NOISE_MPS2, hidden, posterior_of, secret_runs

FAMILIES = catalogue("logger.lab.laws.families", "FAMILY")
FEW = ("sensor_gain", "sensor_offset", "tire_damping", "damper_asymmetry")
SQUARE_N_S2_PER_M2 = 2500.0
HUM_HZ = 21.3


class QuadraticDamping(ForceEffect):
    """As in ``docs/own-effect.md``; no family has this formula."""

    name = "quadratic_damping"

    def laws(self, p: SimpleNamespace, laws: CornerLaws) -> CornerLaws:
        return laws.with_force(lambda travel_m, rate_mps: SQUARE_N_S2_PER_M2 * rate_mps * np.abs(rate_mps))


UNKNOWN_SQUARE = {name: one for name, one in EFFECTS.items() if name != "orifice_damping"}


def learned(effects: Sequence[Chosen], known: Mapping[str, Effect] = EFFECTS, **how: Any) -> Learning:
    posterior = posterior_of(secret_runs(effects, **how))
    return learn(posterior, {name: EFFECTS[name] for name in FEW}, FAMILIES, known)


@cache
def drafts() -> list[Draft]:
    posterior = posterior_of(secret_runs())
    context = LawContext(posterior, posterior.start())
    return [draft for family in FAMILIES.values() for draft in family.drafts(context)]


def test_the_file_of_a_law_is_an_effect_of_ones_own(tmp_path: Path) -> None:
    """Whatever a family drafts stands in a file that is read as any user's, with the numbers that it was given."""
    assert len(drafts()) > 25
    for number, draft in enumerate(drafts()):
        what = f"{draft.name} {draft.variant}"
        values = {one.name: one.value(one.coordinate(one.start)) for one in draft.parameters}
        path = tmp_path / f"law{number}.py"
        path.write_text(draft.text(values, ["A sentence with numbers."]), "utf-8")
        effect = own_effect(path)
        assert effect.name == draft.name not in shipped_effects(), what
        assert effect.usual == pytest.approx(values) and effect.trials() == [pytest.approx(values)], what
        assert "A sentence with numbers." in path.read_text("utf-8"), what
        assert max(map(len, path.read_text("utf-8").splitlines())) <= 120, what


def test_each_law_has_a_name_of_its_own() -> None:
    names = [f"{draft.name} {draft.variant}" for draft in drafts()]
    assert len(set(names)) == len(names)


def test_a_law_of_one_axle_leaves_the_other_alone() -> None:
    one = next(one for one in drafts() if AXLE in one.parameters)
    assert isinstance(one.effect, ForceEffect)
    p = SimpleNamespace(**{parameter.name: parameter.start for parameter in one.parameters} | {AXLE.name: 2.0})
    front, rear = linear(1000.0), linear(1000.0, rear=True)
    assert one.effect.laws_at_its_axle(p, front) is front and one.effect.laws_at_its_axle(p, rear) is not rear


@pytest.mark.slow
def test_a_damping_by_the_square_of_the_rate_is_learned_where_no_effect_is_one() -> None:
    assert learned([chosen(QuadraticDamping(), {})], rougher=2.0, lasts_s=10.0).verdict == ("orifice_damping",)
    law = learned([chosen(QuadraticDamping(), {})], UNKNOWN_SQUARE, rougher=2.0, lasts_s=10.0).law
    assert law is not None
    assert law.draft.family.name == "force_by_rate" and not law.effects and not law.one.where
    assert law.one.values["power_ratio"] == pytest.approx(2.0, abs=0.05)
    true_n = SQUARE_N_S2_PER_M2 * law.draft.reference**2
    assert law.one.values["force_n"] == pytest.approx(true_n, rel=0.1)


class Straight(Family):
    """A family whose laws are another's under its own name, and are refused."""

    name, title = "straight", "a straight line"

    def __init__(self, family: Family) -> None:
        self.family, self.shown_by = family, family.shown_by

    def drafts(self, context: LawContext) -> list[Draft]:
        return [replace(draft, family=self) for draft in self.family.drafts(context)]

    def is_straight(self, draft: Draft, found: Chosen, sigma: float) -> bool:
        return True

    def words(self, draft: Draft, found: Chosen, say: FormatNumber) -> str:
        return self.title


@pytest.mark.slow
def test_the_law_after_one_that_is_refused_is_learned() -> None:
    right, progress = FAMILIES["force_by_rate"], list[str]()
    posterior = posterior_of(secret_runs([chosen(QuadraticDamping(), {})], rougher=2.0, lasts_s=10.0))
    few = {name: EFFECTS[name] for name in FEW[:2]}
    families = {one.name: one for one in (Straight(right), right)}
    law = learn(posterior, few, families, UNKNOWN_SQUARE, (), progress.append).law
    assert f"{LEARNED}{Straight.name} is missing; fitting the model with it" in progress
    assert law is not None and law.draft.family is right


class Hum(RecordEffect):
    """A tone of a fifth of the noise's r.m.s., which raises that by 2 %."""

    name = "hum_of_a_fan"

    def record(self, p: SimpleNamespace, recording: Recording) -> np.ndarray:
        return recording.accel_z_mps2 + 0.2 * NOISE_MPS2 * np.sqrt(2) * np.sin(2 * np.pi * HUM_HZ * recording.time_s)


@pytest.mark.slow
def test_a_tone_is_learned_that_is_quieter_than_the_noise() -> None:
    law = learned([chosen(Hum(), {})], rougher=2.0).law
    assert law is not None and law.draft.family.name == "hum"
    assert law.one.values["frequency_hz"] == pytest.approx(HUM_HZ, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("effects", [
    pytest.param([], id="nothing"),
    pytest.param([hidden("damper_asymmetry", rebound_to_bump_ratio=2.0)], id="listed", marks=pytest.mark.release)])
def test_nothing_is_learned_where_nothing_is_missing_or_a_known_effect_is(effects: list[Chosen]) -> None:
    found = learned(effects, rougher=2.0)
    assert found.law is None and list(found.verdict) == [one.effect.name for one in effects]
