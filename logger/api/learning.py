"""A law out of the data, where no known effect explains it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.bench import Bench
from logger.api.lab import bench_with
from logger.api.lab_questions import LearnQuestion
from logger.api.question import Notify, function, silent
from logger.api.shown import CommandResult
from logger.files import write_text

if TYPE_CHECKING:
    from logger.chart_data import Chart, Curves
    from logger.lab.laws.draft import Draft
    from logger.lab.laws.learn import Learning
    from logger.lab.selection.add_effect import AddedEffects
    from logger.report.html import Html


@dataclass(frozen=True, eq=False)
class LearnedModel:
    """What was learned on a bench, and the model with it, fitted on all of the runs; None where no law is learned."""

    learning: Learning
    addition: AddedEffects | None


@dataclass(frozen=True, eq=False, repr=False)
class LearnedLaw(CommandResult):
    """A law out of the data, or why there is none.

    found                all that was learned
    vehicle              name of the one that it is of
    family               that it is of; None: no law is learned
    words                what it is, in a sentence; or why there is none
    source               text of the Python file that holds it as an own effect; empty: none
    parameters           with ``standard_errors``, by name
    error_before         of the model as it was; ``error_after`` with the law, ``error_after_unseen`` on what no fit saw
    noise_floor_error    that the sensor's noise alone makes
    verdict              known effects that are missing, together with the law or instead of one
    """

    found: LearnedModel
    vehicle: str
    family: str | None
    words: str
    source: str
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    error_before: float
    error_after: float
    error_after_unseen: float
    noise_floor_error: float
    verdict: tuple[str, ...]
    curves: tuple[Chart, ...]
    steps: tuple[tuple[str, float], ...]

    def charts(self) -> Sequence[Chart]:
        """The law over the motions that the runs had."""
        return self.curves

    def figures(self) -> list[Html]:
        """How the error fell, and the law."""
        from logger.report.diagnosis_page import falling

        return [falling("How the error fell", self.steps, self.noise_floor_error),
                *super().figures()]

    def write(self, path: Path | str, option: str = "--out") -> None:
        """Write the law's file (.py), or the page (.html). Without a law there is no file: ``source`` is empty."""
        if Path(path).suffix == ".html":
            write_text(Path(path), self.as_page(""))
        elif self.source:
            write_text(Path(path), self.source)
            self._json["law"] = str(path)

    def as_page(self, of: str) -> Html:
        """What was learned as one HTML document."""
        from logger.report.law_page import page

        return page(self.found.learning, self.found.addition, self.curves[0] if self.curves else None, self.vehicle,
                    str(self._json["law"] or "law.py"))

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """How to add the law."""
        law = next(iter(written.get("--out", ())), None)
        if not self.source or law is None:
            return ""
        return "Next: " + question.command(
            f"add-effect {law if law.is_absolute() else f'./{law}'} {{}} --out with-law.yaml")


def law_of(question: LearnQuestion) -> LearnedLaw:
    """The answer to ``LearnQuestion``, which says what is raised."""
    from logger.report.law_text import as_json, law_lines, source_of

    bench = bench_with(question, "ridelog learn")
    found = learned(bench, question.progress)
    summary = as_json(found.learning, found.addition, None)
    drawn = picture_of(found)
    steps = tuple((one["step"], one["error"]) for one in summary["steps"])
    return LearnedLaw(
        "\n".join(law_lines(found.learning, found.addition)), summary, found, bench.model.vehicle.name,
        summary["family"], summary["words"], source_of(found.learning, found.addition), summary["parameters"],
        summary["standard_errors"], summary["error_before"], summary["error_after"], summary["error_after_unseen"],
        summary["noise_floor_error"], tuple(summary["verdict"]), () if drawn is None else (drawn,), steps)


learn = function("learn", LearnQuestion, law_of)


def learned(bench: Bench, notify: Notify = silent) -> LearnedModel:
    """What is learned on a bench."""
    from logger.lab.laws.learn import learn as learn_law
    from logger.lab.selection.add_effect import add
    from logger.plugins import catalogue
    from logger.store.formats.effect_file import shipped_effects
    from logger.vehicle.uncertain import sized

    families = catalogue("logger.lab.laws.families", "FAMILY")
    known = {name: sized(one, bench.model.vehicle) for name, one in shipped_effects().items()}
    with bench.blamed():
        found = learn_law(bench.posterior(searches=True), bench.effects, families, {**known, **bench.effects},
                          bench.model.effects, notify)
        if found.law is None:
            return LearnedModel(found, None)
        notify("fitting the car without and with the law")
        added = [bench.filed(one) for one in found.law.effects]
        return LearnedModel(found, add(bench.posterior(), bench.model.effects, [*added, found.law.one],
                                       len(found.law.draft.effect.trials()), found.law.state))


def with_law(given: Bench, addition: AddedEffects, law: Path) -> tuple[Bench, AddedEffects]:
    """A bench that knows the law of a file, and what was added with the effect of that file in it."""
    effect, file = given.asked_for(str(law), {}, str(law))
    effects = tuple(replace(one, effect=effect, file=file) if one.effect.name == effect.name else one
                    for one in addition.effects)
    return given.with_effect(effect, file), replace(addition, effects=effects)


def picture_of(found: LearnedModel) -> Curves | None:
    """The law over the motions that the runs had; None where there is none, or it is no force."""
    from logger.lab.laws.picture import picture

    law, addition = found.learning.law, found.addition
    if law is None or addition is None:
        return None
    draft: Draft = law.draft
    one = next(one for one in addition.new if one.effect.name == draft.name)
    return picture(draft, one, addition.errors, found.learning.context)
