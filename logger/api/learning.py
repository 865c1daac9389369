"""A law out of the data, where no known effect explains it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from logger.api.bench import Bench, Notify, silent
from logger.api.lab import Runs, bench_with
from logger.api.shown import CommandResult
from logger.api.vehicles import Model
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

    family               that it is of; None: no law is learned
    words                what it is, in a sentence; or why there is none
    source               text of the Python file that holds it as an own effect; empty: none
    parameters           with ``standard_errors``, by name
    error_before         of the model as it was; ``error_after`` with the law, ``error_after_unseen`` on what no fit saw
    noise_floor_error    that the sensor's noise alone makes
    verdict              known effects that are missing, together with the law or instead of one
    """

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

    def write(self, path: Path | str) -> None:
        """Write the law's file. ValueError where no law was learned."""
        if not self.source:
            raise ValueError(self.words)
        write_text(Path(path), self.source)


def learn(vehicle: Model | Path | str, runs: Runs, *, effect_files: Sequence[Path | str] = (),
          tolerance: float | None = None, low_pass_hz: float | None = None, progress: Notify = silent,
          anyway: bool = False) -> LearnedLaw:
    """Learn a law where no known effect explains what a model lacks. It takes minutes, and the compiler of the ``lab``
    extra.

    vehicle, runs, tolerance, low_pass_hz, anyway    as in ``compare``
    effect_files    Python files, each with an effect of your own that is known as well
    progress        called with what is under way, such as ``print``

    Raises BadInput as ``diagnose``.

    >>> learn(car, runs).family is None    # a known effect explains it: the sensor's gain
    True
    """
    from logger.report.law_text import as_json, law_lines, source_of

    bench = bench_with(vehicle, runs, effect_files, tolerance, "learn", low_pass_hz=low_pass_hz, anyway=anyway)
    found = learned(bench, progress)
    summary = as_json(found.learning, found.addition, None)
    drawn = picture_of(found)
    steps = tuple((one["step"], one["error"]) for one in summary["steps"])
    return LearnedLaw(
        "\n".join(law_lines(found.learning, found.addition)), summary, summary["family"], summary["words"],
        source_of(found.learning, found.addition), summary["parameters"], summary["standard_errors"],
        summary["error_before"], summary["error_after"], summary["error_after_unseen"], summary["noise_floor_error"],
        tuple(summary["verdict"]), () if drawn is None else (drawn,), steps)


def learned(bench: Bench, notify: Notify = silent) -> LearnedModel:
    """What is learned on a bench."""
    from logger.lab.laws.learn import learn as learn_law
    from logger.lab.selection.add_effect import add
    from logger.plugins import catalogue
    from logger.store.formats.effect_file import shipped_effects
    from logger.vehicle.effect_sizes import sized

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
