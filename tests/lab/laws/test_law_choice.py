"""Which of the laws that were fitted is chosen, and in what order they are tried; fits and refusals are made up."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

import pytest

from logger.lab.laws import learn
from logger.lab.laws.learn import LawFit, _LawChoice
from logger.lab.laws.refusals import Nearest, Refusal

BEFORE, NOW = (SimpleNamespace(score=score, above=True, state=SimpleNamespace(names=names, effects=names))
               for score, names in ((1000.0, ()), (700.0, ("known",))))


@dataclass
class World:
    """What comes of laws that are fitted to the end, by name.

    score       of the model with the law alone, and with known effects on top of it
    above       laws that leave more than noise
    dropped     laws that are not needed in the end
    nothing     laws that say nothing
    instead     laws in whose place a known effect explains more
    """

    score: Mapping[str, float] = field(default_factory=dict)
    on_top: Mapping[str, float] = field(default_factory=dict)
    above: frozenset[str] = frozenset()
    dropped: frozenset[str] = frozenset()
    nothing: frozenset[str] = frozenset()
    instead: frozenset[str] = frozenset()
    tried: list[str] = field(default_factory=list)


def law(name: str, score: float, base: Any = BEFORE) -> LawFit:
    """A law that was fitted."""
    family: Any = SimpleNamespace(name=name, title=name)
    draft = SimpleNamespace(name=name, variant="", parameters=(), title=name, family=family)
    fit: Any = SimpleNamespace(found=SimpleNamespace(score=score), gain=base.score - score)
    return LawFit(draft, base, fit)  # type: ignore[arg-type]


def choice(world: World, monkeypatch: pytest.MonkeyPatch, *fits: LawFit) -> _LawChoice:
    """The choice among laws that were fitted on the car alone and beside a known effect."""
    def fit_in_full(_choice: _LawChoice, one: LawFit) -> tuple[Any, dict[str, float]]:
        world.tried.append(one.draft.name)
        name = one.draft.name
        score = world.score.get(name, one.score)
        return SimpleNamespace(score=score, above=name in world.above, law=name), (
            {} if name in world.dropped else {name: 1000.0 - score})

    def known_on_top(_choice: _LawChoice, one: LawFit) -> None:
        model, gains = _choice.ended[one]
        score = world.on_top.get(one.draft.name, one.score)
        _choice.ended[one] = SimpleNamespace(**vars(model) | {"score": score}), gains

    def refused(draft: Any, _model: Any) -> Refusal | None:
        return Refusal(draft.name, "says nothing") if draft.name in world.nothing else None

    def nearest(_choice: _LawChoice, model: Any, _best: LawFit, gain: float) -> Nearest | None:
        one: Any = SimpleNamespace(effect=SimpleNamespace(name="known"))
        return Nearest(one, gain + 1, gain) if model.law in world.instead else None

    def chosen(_choice: _LawChoice, best: LawFit, model: Any, _gain: float, _near: Nearest | None, others: Any) -> Any:
        return best.draft.name, model.score, [one.draft.name for one in others if one is not best]

    for name, stub in {"_fit_in_full": fit_in_full, "_add_known": known_on_top, "_nearest": nearest, "_law": chosen,
                       "_is_accepted": lambda _choice, _one: True}.items():
        monkeypatch.setattr(_LawChoice, name, stub)
    monkeypatch.setattr(learn, "refusal", refused)
    monkeypatch.setattr(learn, "is_above_noise", lambda model: model.above)
    monkeypatch.setattr(learn, "exceeds_noise", lambda model: model.above)
    selection: Any = SimpleNamespace(before=BEFORE, now=NOW)
    search: Any = SimpleNamespace(present=0)
    by_base: Any = [(base, [one for one in fits if one.base is base]) for base in (BEFORE, NOW)]
    return _LawChoice(search, selection, {}, {}, by_base)


def test_a_refused_law_is_tried_on_no_other_model_and_is_no_rival(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World(nothing=frozenset("A"))
    found = choice(world, monkeypatch, law("A", 400.0), law("A", 401.0, NOW), law("B", 500.0, NOW))
    assert found.with_effects() == ("B", 500.0, [])
    assert world.tried == ["A", "B"]


def test_laws_that_were_refused_alone_are_not_tried_again(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World(nothing=frozenset("ABC"))
    found = choice(world, monkeypatch, *(law(name, 400.0 + 10 * n) for n, name in enumerate("ABCD")))
    assert found.explaining_all() is None and world.tried == ["A", "B", "C"]
    assert found.with_effects() == ("D", 430.0, [])


def test_a_law_that_is_not_needed_in_the_end_makes_room_for_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World(dropped=frozenset("A"))
    found = choice(world, monkeypatch, law("A", 400.0), law("B", 415.0))
    assert found.explaining_all() == ("B", 415.0, ["A"])


def test_alone_a_law_has_to_leave_no_more_than_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    world = World(above=frozenset("A"))
    found = choice(world, monkeypatch, law("A", 400.0))
    assert found.explaining_all() is None
    assert found.with_effects() == ("A", 400.0, [])


def test_known_effects_on_top_of_a_law_count_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Alone it explains less than the known effect, and than another law beside that."""
    world = World(on_top={"A": 300.0}, above=frozenset("AB"))
    found = choice(world, monkeypatch, law("A", 800.0), law("B", 350.0, NOW))
    assert found.with_effects() == ("A", 300.0, ["B"])


def test_a_known_effect_that_explains_more_is_reported_before_what_says_nothing(monkeypatch: pytest.MonkeyPatch
                                                                               ) -> None:
    world = World(nothing=frozenset("A"), instead=frozenset("B"))
    found = choice(world, monkeypatch, law("A", 400.0), law("B", 420.0))
    assert found.explaining_all() is None
    refusal = found.refusal_to_report()
    assert refusal is not None and refusal.title == "B" and refusal.known is not None
    assert next(iter(found.refused.values())).title == "A"
