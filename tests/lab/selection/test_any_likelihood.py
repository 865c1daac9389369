"""The search on a likelihood that is made up, in which everything is known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

import pytest

from logger.lab.selection.evidence import IMITATION, probability_by_chance
from logger.lab.selection.holdout import HoldOut
from logger.lab.selection.stepwise import Search, SearchEffort
from logger.printable import Notify
from logger.vehicle.effect import STATIC_RATIO, Chosen, Effect, Misalignment, chosen

from ...support.lab.secret_runs import EFFECTS

WORTH = {"sensor_gain": 300.0, "tire_damping": 120.0, "sensor_offset": 60.0, "time_offset": 2.0}
"""Gain of each, whatever else is there; all of 480 is to be explained."""


@dataclass(frozen=True)
class Made:
    """A model with some effects."""

    effects: tuple[Chosen, ...] = ()
    explains: float = 480.0
    stuck: bool = False
    """Whether its own numbers were fitted to a wrong minimum."""

    @property
    def score(self) -> float:
        return 500.0 * self.stuck - sum(WORTH[one.effect.name] + 100.0 * (not one.is_plain) for one in self.effects)

    @property
    def explanation(self) -> float:
        return self.explains

    @property
    def hold_out(self) -> HoldOut:
        return HoldOut(1.0 / (1 + len(self.effects)), 0.0)


@dataclass(frozen=True)
class Tried:
    """An effect tried on a model."""

    model: Made
    gain: float

    @property
    def chosen(self) -> Chosen:
        return self.model.effects[-1]

    @property
    def effect(self) -> Effect:
        return self.chosen.effect


@dataclass(frozen=True)
class MadeUp:
    """The likelihood; some effects are doubtful, and refinements explain something where so many effects are found.
    ``fitted``: names of what was fitted, and how many effects there were. ``frees``: with which the car's own numbers
    get out of a wrong minimum."""

    doubtful: tuple[str, ...] = ()
    refined_from: int = 1
    frees: tuple[str, ...] = tuple(WORTH)
    fitted: list[tuple[str, int]] = field(default_factory=list)
    uncertainty: float = 0.0
    stops: Callable[[str, float], bool] = lambda what, share: False

    def stops_before(self, what: str, share: float = 1.0) -> bool:
        return self.stops(what, share)

    def screened(self, base: Made, effects: Sequence[Effect], seen: Misalignment, near: Chosen | None,
                 pool: ThreadPoolExecutor, progress: Notify) -> list[Tried]:
        tried = [Tried(replace(base, effects=(*base.effects, chosen(one, one.usual)),
                               stuck=base.stuck and one.name not in self.frees), WORTH[one.name]) for one in effects]
        return sorted(tried, key=lambda one: -one.gain)

    def laid_anew(self, base: Made) -> None: ...

    def stripped(self, now: Made, name: str) -> None: ...

    def without(self, now: Made, name: str) -> Made:
        return replace(now, effects=tuple(one for one in now.effects if one.effect.name != name))

    def fitted_roughly(self, score: float, base: Made, one: Tried, least: float) -> list[Tried]:
        self.fitted.append((one.effect.name, len(base.effects)))
        return [replace(one, gain=score - one.model.score)]

    def refined(self, base: Made, one: Tried, least: float) -> Tried:
        return one

    def with_effect(self, one: Tried) -> Made:
        return one.model

    def refined_beside(self, now: Made, name: str, least: float) -> Made:
        if len(now.effects) < self.refined_from:
            return now
        by_name = {one.effect.name: one for one in now.effects}
        refined = replace(by_name[name], values={**by_name[name].values, "static_to_sliding_ratio": 1.5})
        return replace(now, effects=tuple({**by_name, name: refined}.values()))

    def plain(self, now: Made, name: str) -> Made:
        return replace(now, effects=tuple(chosen(one.effect, one.effect.usual) if one.effect.name == name else one
                                          for one in now.effects))

    def chance(self, one: Chosen, gain: float, base: Made, candidates: int) -> float:
        return probability_by_chance(gain, candidates)

    def is_doubtful(self, base: Made, one: Tried) -> bool:
        return one.effect.name in self.doubtful

    def gain_uncertainty(self, one: Made | Tried, other: Tried) -> float:
        return self.uncertainty

    def leaves_noise(self, there: Made | Tried) -> bool:
        return False

    def is_at_floor(self, now: Made) -> bool:
        return False

    def explains_most(self, without: Made, there: Made | Tried) -> bool:
        model = there.model if isinstance(there, Tried) else there
        if without.score - model.score > without.explanation / 2:
            return True
        return len(model.effects) > len(without.effects) and any(not one.is_plain for one in model.effects)

    def is_within_calibration(self, without: Made) -> bool:
        return False

    def imitates_any(self, one: Effect) -> bool:
        return one.imitates_any


def search(*doubtful: str, effects: int = 4) -> Search[Made, Tried, Tried]:
    return Search([EFFECTS[name] for name in WORTH], 0, Misalignment(1.0, 0.0), workers=1,
                  effort=SearchEffort(effects=effects), likelihood=MadeUp(doubtful))


def test_all_that_is_evident_is_found_the_most_telling_first() -> None:
    found = search().run(Made())
    assert found.gains == {name: WORTH[name] for name in ("sensor_gain", "tire_damping", "sensor_offset")}
    assert [name for name, _ in found.steps] == ["sensor_gain", "tire_damping", "sensor_offset"]
    assert [one.effect.name for one in (*found.last.fits, *found.last.unfitted)] == ["time_offset"]


def test_a_gain_that_is_the_fit_of_the_cars_own_numbers_is_no_effects() -> None:
    found, plain = search().run(Made(stuck=True)), search().run(Made())
    assert found.before == Made() and found.now == plain.now


def test_where_one_effect_leads_out_of_a_wrong_minimum_others_are_tried_there_as_far_as_they_may_win() -> None:
    rounds = {}
    for frees in (("sensor_gain",), ("tire_damping",)):
        asked = replace(search(), likelihood=MadeUp(frees=frees))
        found, plain = asked.run(Made(stuck=True)), search().run(Made())
        assert found.before == Made() and found.now == plain.now
        assert isinstance(asked.likelihood, MadeUp)
        rounds[frees] = [name for name, effects in asked.likelihood.fitted if not effects].count("sensor_offset")
        assert {one.effect.name: one.gain for one in found.first.fits}["sensor_gain"] == WORTH["sensor_gain"]
    assert rounds == {("sensor_gain",): 1, ("tire_damping",): 2}
    assert (found.gains, found.rivals, found.steps) == (plain.gains, plain.rivals, plain.steps)


def test_no_more_are_found_than_were_sought_until_it_goes_on() -> None:
    one = search(effects=1)
    found = one.run(Made())
    assert list(found.gains) == ["sensor_gain"] and not found.last.fits
    one.effort = replace(one.effort, effects=2)
    assert list(one.go_on(found).gains) == ["sensor_gain", "tire_damping"]


def test_two_in_series_are_found_where_each_alone_explains_less_than_another(monkeypatch: pytest.MonkeyPatch) -> None:
    def score(self: Made) -> float:
        names = {one.effect.name for one in self.effects}
        both = {"tire_damping", "sensor_offset"} <= names
        return -450.0 if both else -max([WORTH[name] for name in names], default=0.0)

    monkeypatch.setitem(WORTH, "damper_asymmetry", 200.0)
    monkeypatch.setattr(Made, "score", property(score))
    sought = search()
    sought.effects = [EFFECTS[name] for name in ("damper_asymmetry", "tire_damping", "sensor_offset")]
    assert [*sought.run(Made()).gains] == ["damper_asymmetry"]
    sought.effort = replace(sought.effort, beginnings=2)
    assert {*sought.run(Made()).gains} == {"tire_damping", "sensor_offset"}


def test_what_is_doubtful_is_not_found() -> None:
    assert list(search("sensor_gain").run(Made()).gains) == ["tire_damping", "sensor_offset"]


@pytest.mark.parametrize(("doubtful", "fitted"), [((), False), (("tire_damping",), True)])
def test_what_promises_too_little_beside_a_fit_that_may_be_taken_is_not_fitted(doubtful: tuple[str, ...],
                                                                               fitted: bool) -> None:
    sought = search(*doubtful)
    sought.effort = replace(sought.effort, fit_share=0.6)
    found = sought.run(Made())
    first, *others = (name for name, before in sought.likelihood.fitted if not before)
    # The others promise less than 0.6 of 300; on a model without effects all that promise more than chance are fitted.
    assert first == "sensor_gain" and others == ["tire_damping", "sensor_offset", "time_offset"]
    second = [name for name, before in sought.likelihood.fitted if before == 1]
    assert second[0] == "tire_damping" and ("sensor_offset" in second) == fitted
    assert len(found.gains) == 3 - len(doubtful)


@pytest.mark.parametrize(("to_explain", "named"), [(590.0, True), (610.0, False)])
def test_what_gains_a_tenth_of_what_is_left_may_only_imitate(to_explain: float, named: bool,
                                                             monkeypatch: pytest.MonkeyPatch) -> None:
    assert IMITATION == 0.1
    monkeypatch.setitem(WORTH, "sensor_gain", 310.0)  # most of it, as a sensor's effect has to gain
    sought = search()
    found = sought.run(Made(explains=to_explain))
    assert ("sensor_offset" in found.gains) == named
    undecided = [one.effect.name for one in found.last.fits if sought.may_imitate(found.now, one)]
    assert undecided == ([] if named else ["sensor_offset"])


@pytest.mark.parametrize("friction", [True, False])
def test_what_seems_to_imitate_is_found_where_it_shows_refinements_of_what_was_found_before(
        friction: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    known = "dry_friction" if friction else "sensor_gain"
    monkeypatch.setitem(WORTH, known, 700.0)
    sought = search()
    sought.effects = [EFFECTS[known], EFFECTS["sensor_offset"]]
    sought.likelihood = MadeUp(refined_from=2)
    found = sought.run(Made(explains=610.0))
    assert list(found.gains) == [known, "sensor_offset"][: 1 + friction]
    assert [one.is_plain for one in found.now.effects] == [False, True][-1 - friction:]


def test_refinements_of_what_was_found_are_judged_beside_a_further_effect(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(WORTH, "dry_friction", 700.0)
    sought, bases = search(effects=2), list[Made]()
    sought.effects = [EFFECTS["dry_friction"], EFFECTS["sensor_gain"]]
    screened = MadeUp.screened
    monkeypatch.setattr(MadeUp, "screened", lambda self, base, *rest: bases.append(base) or screened(self, base, *rest))
    found = sought.run(Made())
    assert [[one.is_plain for one in base.effects] for base in bases[:2]] == [[], [True]]
    assert [one.is_plain for one in found.now.effects] == [False, True]


@pytest.mark.parametrize(("worth", "known"), [(430.0, "sensor_gain"), (370.0, "tire_damping")])
def test_what_changes_all_of_a_record_has_to_explain_most_of_what_is_left(
        worth: float, known: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(WORTH, "sensor_gain", worth)
    found = search().run(Made(explains=800.0))
    assert found.steps[0][0] == known and ("sensor_gain" in found.gains) == (known == "sensor_gain")


class Imitated(MadeUp):
    """Refinements of friction that beside another effect gain more, but not where they were fitted without it."""

    def screened(self, base: Made, *rest: Any) -> list[Tried]:
        refined = any(not one.is_plain for one in base.effects)
        return [replace(one, gain=one.gain * (not refined)) for one in super().screened(base, *rest)]

    def fitted_roughly(self, score: float, base: Made, one: Tried, least: float) -> list[Tried]:
        return [replace(each, gain=one.gain) for each in super().fitted_roughly(score, base, one, least)]


def test_what_refinements_imitate_is_found_beside_the_plain_form(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(WORTH, "dry_friction", 700.0)
    sought = search()
    sought.effects = [EFFECTS["dry_friction"], EFFECTS["tire_damping"]]
    sought.likelihood = Imitated()
    found = sought.run(Made())
    assert [*found.gains] == ["dry_friction", "tire_damping"]
    assert [one.is_plain for one in found.now.effects] == [False, True]


class TooFar(MadeUp):
    """Tire damping leads refinements of friction to an end of their range."""

    def is_at_floor(self, now: Made) -> bool:
        return True

    def with_effect(self, one: Tried) -> Made:
        if one.effect.name != "tire_damping":
            return one.model
        return replace(one.model, effects=tuple(
            replace(each, values={**each.values, STATIC_RATIO.name: STATIC_RATIO.high})
            if each.effect.name == "dry_friction" else each for each in one.model.effects))


@pytest.mark.parametrize(("worth", "named"), [(90.0, "sensor_offset"), (120.0, "tire_damping")])
def test_what_leads_refinements_too_far_is_taken_where_it_is_worth_more_than_they_are(
        worth: float, named: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(WORTH, "dry_friction", 700.0)
    monkeypatch.setitem(WORTH, "tire_damping", worth)
    sought = search(effects=2)
    sought.effects = [EFFECTS[name] for name in ("dry_friction", "tire_damping", "sensor_offset")]
    sought.likelihood = TooFar()
    assert [*sought.run(Made()).gains] == ["dry_friction", named]


class Alone(MadeUp):
    """Nothing gains anything beside friction."""

    def is_doubtful(self, base: Made, one: Tried) -> bool:
        return any(each.effect.name == "dry_friction" for each in base.effects)


@pytest.mark.parametrize(("other", "is_at_floor", "named"), [
    (200.0, False, ["tire_damping", "damper_asymmetry"]), (200.0, True, ["dry_friction"]),
    (50.0, False, ["dry_friction"])])
def test_what_refinements_imitate_together_is_found_without_their_effect_unless_noise_is_left(
        other: float, is_at_floor: bool, named: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Alone, "is_at_floor", lambda likelihood, now: is_at_floor)
    for name, worth in (("dry_friction", 310.0), ("tire_damping", 300.0), ("damper_asymmetry", other)):
        monkeypatch.setitem(WORTH, name, worth)
    sought = search()
    sought.effects = [EFFECTS[name] for name in ("dry_friction", "tire_damping", "damper_asymmetry")]
    sought.likelihood = Alone()
    assert [*sought.run(Made()).gains] == named


def test_a_search_that_stops_keeps_what_it_has_found() -> None:
    asked = list[str]()
    sought = replace(search(), likelihood=MadeUp(
        stops=lambda what, share: asked.append(what) or True))  # type: ignore[func-returns-value]
    assert [*sought.run(Made()).gains] == ["sensor_gain"] and asked == ["one more effect"]
    sought = replace(search(), likelihood=MadeUp(stops=lambda what, share: share < 1 and "place" in what))
    assert [*sought.run(Made()).gains] == [*search().run(Made()).gains]


class Slow(MadeUp):
    """Friction whose refinements gain most of all, and by a rough fit hardly more than its plain form: next to nothing.
    The others are doubtful."""

    def fitted_roughly(self, score: float, base: Made, one: Tried, least: float) -> list[Tried]:
        if one.effect.name != "dry_friction":
            return super().fitted_roughly(score, base, one, least)
        refined = self.refined_beside(one.model, one.effect.name, least)
        return [Tried(refined, 100.0), Tried(one.model, 5.0)]

    def refined(self, base: Made, one: Tried, least: float) -> Tried:
        return replace(one, gain=base.score - one.model.score)

    def explains_most(self, without: Made | Tried, there: Made | Tried) -> bool:
        if isinstance(without, Made) or isinstance(there, Made):
            return False
        return there.gain - without.gain > (without.model.explains - without.gain) / 2


def test_refinements_are_compared_with_the_plain_form_where_both_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(WORTH, "dry_friction", 300.0)
    sought = search()
    sought.likelihood = Slow(("sensor_gain", "tire_damping", "sensor_offset"))
    found = sought.run(Made())
    assert [(one.effect.name, one.is_plain) for one in found.now.effects] == [("dry_friction", False)]


def test_effects_whose_gains_differ_by_less_than_these_are_uncertain_are_told_to_be_indistinguishable() -> None:
    sure, unsure = search().run(Made()), replace(search(), likelihood=MadeUp(uncertainty=1e6)).run(Made())
    assert sure.gains == unsure.gains
    assert {name: rivals for name, rivals in sure.rivals.items() if rivals} == {}
    assert all(set(rivals) == set(WORTH) - set(sure.gains) for rivals in unsure.rivals.values())


@pytest.mark.parametrize("later", WORTH)
def test_a_search_that_goes_on_with_one_more_effect_finds_the_same_and_fits_nothing_twice(later: str) -> None:
    few = search()
    few.effects = [one for one in few.effects if one.name != later]
    begun = few.run(Made())
    known = len(few.likelihood.fitted)
    wider, found = few.with_more(begun, [EFFECTS[later]])
    whole = search().run(Made())
    assert (found.gains, found.rivals) == (whole.gains, whole.rivals)
    assert {one.effect.name for one in found.first.fits} == {one.effect.name for one in whole.first.fits}
    assert [name for name, before in wider.likelihood.fitted[known:] if not before] == [later]


def test_what_goes_on_with_one_more_effect_that_is_not_taken_is_as_it_was_and_tries_no_other() -> None:
    few = replace(search(), likelihood=MadeUp(stops=lambda what, share: share < 1))
    few.effects = [one for one in few.effects if one.name != "time_offset"]
    begun = few.run(Made())
    known = len(few.likelihood.fitted)
    _, found = few.with_more(begun, [EFFECTS["time_offset"]])
    assert (found.now, found.gains) == (begun.now, begun.gains) and len(found.now.effects) == 1
    assert not {name for name, _ in few.likelihood.fitted[known:]} & {"tire_damping", "sensor_offset"}
