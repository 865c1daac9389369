"""Which of the laws that were sought is chosen, and in what order they are tried, on a likelihood that is made up."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from logger.lab.laws import learn
from logger.lab.laws.draft import LEARNED
from logger.lab.laws.learn import DECISIVE, FamilySearch, Refusal
from logger.lab.selection.stepwise import Search, SearchEffort
from logger.vehicle.effect import ForceEffect, Misalignment, chosen
from logger.vehicle.laws import CornerLaws

from ..selection.test_any_likelihood import Made, MadeUp

Worth = Mapping[str, Mapping[str, float]]
"""What each law and known effect explains of each cause; of two that explain one the better one counts."""


class NamedEffect(ForceEffect):
    """An effect that is a name."""

    def __init__(self, name: str) -> None:
        self.name = name

    def laws(self, p: SimpleNamespace, laws: CornerLaws) -> CornerLaws:
        return laws


class World:
    """The models of some laws and known effects, by what each explains of which cause.

    nothing    laws that say nothing
    related    known effects that no search tries unasked, which all laws may nearly be
    noise      what a model may leave and is no louder than the noise
    of         what kind of vehicle
    explains   what a full explanation of what is left would gain
    tried      laws that were fitted to the end
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, worth: Worth, known: Sequence[str] = (), nothing: str = "",
                 related: Sequence[str] = (), noise: float = 0.0, of: str = "half_car", explains: float = 0.0
                 ) -> None:
        all_of_it = sum(max(some.get(cause, 0.0) for some in worth.values())
                        for cause in {cause for some in worth.values() for cause in some})
        self.tried: list[str] = []
        laws = [name for name in worth if name not in {*known, *related}]

        @dataclass(frozen=True)
        class Model(Made):
            posterior: Any = field(default_factory=lambda: SimpleNamespace(
                vehicle=SimpleNamespace(is_part=of == "component")))

            @property
            def score(self) -> float:
                there = [worth[one.effect.name.removeprefix(LEARNED)] for one in self.effects]
                return -sum(max(some.get(cause, 0.0) for some in there)
                            for cause in {cause for some in there for cause in some})

            @property
            def state(self) -> Any:
                return SimpleNamespace(effects=self.effects, names=[one.effect.name for one in self.effects])

        class Likelihood(MadeUp):
            def screened(self, base: Any, effects: Any, *how: Any) -> list[Any]:
                return sorted((Tried(one, base) for one in effects), key=lambda each: -each.gain)

            def explains_most(self, without: Any, there: Any) -> bool:
                return False

            def fitted_roughly(self, score: float, base: Any, one: Any, least: float) -> list[Any]:
                return [one]

        class Tried:
            def __init__(self, effect: Any, base: Any) -> None:
                self.model = Model((*base.effects, chosen(effect, {})), explains)
                self.effect, self.chosen = effect, self.model.effects[-1]
                self.gain = base.score - self.model.score

        def refused(draft: Any, _model: Any, _without: Any) -> Refusal | None:
            self.tried.append(draft.title)
            return Refusal(draft.title, "says nothing") if draft.title in nothing else None

        def family(name: str) -> Any:
            found = SimpleNamespace(name=name, title=name, stands_out=False, related_effects=tuple(related), holds=())
            found.drafts = lambda _context: [SimpleNamespace(
                effect=NamedEffect(LEARNED + name), name=LEARNED + name, key=(name, ""), title=name, family=found)]
            return found

        monkeypatch.setattr(learn, "refusal", refused)
        monkeypatch.setattr(learn, "exceeds_noise", lambda model: model.score > noise - all_of_it)
        effects = {name: NamedEffect(name) for name in (*known, *related)}
        search: Any = Search([effects[name] for name in known], 0, Misalignment(1.0, 0.0), workers=1,
                             effort=SearchEffort(effects=4), likelihood=Likelihood())
        self.laws = FamilySearch(search, search.run(Model(explains=explains)), {name: family(name) for name in laws},
                                 effects)

    def best(self) -> tuple[str, list[str], list[str]] | None:
        """The law that is chosen, the known effects beside it, and its rivals."""
        found = self.laws.best()
        return found and (found.draft.title, [one.effect.name for one in found.effects],
                          [one.name for one in found.rivals])


def test_a_refused_law_is_tried_on_no_other_model_and_is_no_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World(monkeypatch, {"A": {"x": 600.0}, "B": {"x": 595.0}, "known": {"y": 300.0}}, ["known"], nothing="A")
    assert world.best() == ("B", ["known"], [])
    assert world.tried.count("A") == 1


def test_laws_are_tried_until_one_says_something(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World(monkeypatch, {name: {"x": 600.0 - 20 * n} for n, name in enumerate("ABCD")}, nothing="ABC")
    assert world.best() == ("D", [], [])
    assert world.tried == ["A", "B", "C", "D"]


def test_a_law_that_is_not_needed_in_the_end_makes_room_for_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    needed, world = Search.eliminate_backward, World(monkeypatch, {"A": {"x": 600.0}, "B": {"x": 595.0}})

    def without_a(search: Search, before: Any, now: Any) -> Any:
        return (before, {}) if now.state.names == ["learned_A"] and not search.effects else needed(search, before, now)

    monkeypatch.setattr(Search, "eliminate_backward", without_a)
    assert world.best() == ("B", [], []) and world.tried == ["B"]


def test_laws_that_explain_as_well_are_rivals(monkeypatch: pytest.MonkeyPatch) -> None:
    assert World(monkeypatch, {"A": {"x": 600.0}, "B": {"x": 595.0}}).best() == ("A", [], ["B"])


def test_known_effects_on_top_of_a_law_count_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone it explains less than another law, beside which the known effect explains nothing more."""
    worth = {"A": {"x": 400.0}, "B": {"y": 450.0}, "known": {"y": 300.0, "x": 10.0}}
    assert World(monkeypatch, worth, ["known"]).best() == ("A", ["known"], [])


@pytest.mark.parametrize(("of", "beside"), [("half_car", []), ("component", ["known"])])
def test_of_a_part_no_calibration_leaves_what_a_known_effect_beside_a_law_explains(
        of: str, beside: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    worth = {"A": {"x": 600.0}, "known": {"y": 40.0}}
    assert World(monkeypatch, worth, ["known"], noise=50.0, of=of, explains=40.0).best() == ("A", beside, [])


def test_where_known_effects_explain_all_a_law_is_decisively_better_or_none(monkeypatch: pytest.MonkeyPatch) -> None:
    for more, named in ((-1.0, False), (1.0, True)):
        worth = {"A": {"x": 600.0 + DECISIVE + more}, "known": {"x": 600.0}}
        assert bool(World(monkeypatch, worth, ["known"], noise=DECISIVE + 2).best()) == named


def test_a_known_effect_that_explains_more_is_reported_before_what_says_nothing(monkeypatch: pytest.MonkeyPatch
                                                                               ) -> None:
    worth = {"A": {"x": 600.0}, "B": {"x": 580.0}, "unasked": {"x": 590.0}}
    world = World(monkeypatch, worth, nothing="A", related=["unasked"])
    assert world.best() is None
    refusal = world.laws.refusal_to_report()
    assert refusal is not None and refusal.title == "B" and refusal.known is not None
    assert refusal.known.one.effect.name == "unasked"
    assert next(iter(world.laws.refused.values())).title == "A"
