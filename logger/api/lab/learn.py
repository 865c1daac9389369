"""A law learned where no known effect explains what a model lacks: answer, words, JSON, its file, and the page.

The page has what the law is, its picture, what it brings, and what it may be instead.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.lab import words as lab_words
from logger.api.lab.bench import Bench, bench_with
from logger.api.lab.diagnose import addition_words, bench_sections, shape_sections
from logger.api.lab.question import LearnQuestion
from logger.chart_data import CURVE_POINTS, CURVE_REACH, Chart, Curves, Line
from logger.files import write_text
from logger.lab.laws.draft import Draft
from logger.lab.laws.learn import Law, Learning, Nearest
from logger.lab.laws.learn import learn as learn_law
from logger.lab.laws.picture import picture
from logger.lab.residuals.fitted_laws import BenchForces, bench_forces, force_by_rate
from logger.lab.selection.add_effect import AddedEffects, add
from logger.lab.selection.holdout import JUDGED_ON, ErrorStep
from logger.plugins import catalogue
from logger.printable import Notify, silent
from logger.question import function
from logger.report.blocks import Block, Blocks, Bullets, Detail, Hint, Section, Table, page
from logger.report.document import Html, tiles
from logger.report.quantities import enumerated, finite, measured, numbers_of, unit_of
from logger.store.formats import effect_file
from logger.vehicle.effect import Chosen
from logger.vehicle.uncertain import sized


@dataclass(frozen=True, eq=False)
class LearnedModel:
    """What was learned on a bench, and the model with it, fitted on all of the runs; None where no law is learned;
    ``part``: of a part alone, its forces."""

    learning: Learning
    addition: AddedEffects | None
    part: BenchForces | None = None


@dataclass(frozen=True, eq=False, repr=False)
class LearnedLaw(lab_words.ModelByModel):
    """A law learned from the data, or why there is none.

    found                all that was learned
    vehicle              name of the one that it is of
    family               that it is of; None: no law is learned
    words                what it is, in a sentence; or why there is none
    source               text of the Python file that holds it as an own effect; empty: none
    parameters           with ``standard_errors``, by name
    error_before         of the model as it was; ``error_after`` with the law, ``error_after_unseen`` on what no fit saw
    verdict              known effects that are missing, together with the law or instead of one
    next_command         that adds these instead of one; empty: none are, or a law is learned
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
    verdict: tuple[str, ...]
    curves: tuple[Chart, ...]
    next_command: str

    def charts(self) -> Sequence[Chart]:
        """The law over the motions that the runs had."""
        return self.curves

    def write(self, path: Path | str, option: str = "--out") -> None:
        """Write the law's file (.py), or the page (.html). Without a law there is no file: ``source`` is empty."""
        if Path(path).suffix == ".html":
            write_text(Path(path), self.as_page(""))
        elif self.source:
            write_text(Path(path), self.source)
            self._json["law"] = str(path)

    def as_page(self, of: str) -> Html:
        """What was learned as one HTML document."""
        runs = ", ".join(run.name for run in self.found.learning.context.runs)
        return page(f"{self.vehicle}: a law learned from runs", runs, self.blocks())

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """How to add the law, together with what it was fitted with, or what is missing instead."""
        law = next((one for one in written.get("--out", ()) if one.suffix == ".py"), None)
        if not self.source or law is None or self.found.addition is None:
            return self.next_command
        file = str(law) if law.is_absolute() else f"./{law}"
        names = [file, *(one.file or one.effect.name for one in self.found.addition.new
                         if one.effect.name in self.verdict)]
        return "Next: " + question.command(f"add-effect {'+'.join(names)} {{}} --out with-law.yaml")


@function(LearnQuestion)
def learn(question: LearnQuestion) -> LearnedLaw:
    bench = bench_with(question, "ridelog learn")
    found = learned(bench, question.progress)
    summary = as_json(found.learning, found.addition, None)
    drawn, known = picture_of(found), found.learning.diagnosis
    return LearnedLaw(
        Blocks(law_blocks(found)), summary, _steps(found.learning, found.addition), summary["noise_floor_error"], found,
        bench.model.vehicle.name,
        summary["family"], summary["words"], source_of(found.learning, found.addition), summary["parameters"],
        summary["standard_errors"], summary["error_before"], summary["error_after"], summary["error_after_unseen"],
        tuple(summary["verdict"]), () if drawn is None else (drawn,),
        "" if known is None else addition_words(question, bench, known))


def learned(bench: Bench, notify: Notify = silent) -> LearnedModel:
    """What is learned on a bench."""
    families = catalogue("logger.lab.laws.families", "FAMILY")
    known = {name: sized(one, bench.model.vehicle) for name, one in effect_file.shipped_effects().items()}
    with bench.blamed():
        found = learn_law(bench.posterior(searches=True), bench.effects, families, {**known, **bench.effects},
                          bench.model.effects, notify)
        if found.law is None:
            return LearnedModel(found, None)
        notify("fitting the model without and with the law")
        added = [bench.filed(one) for one in found.law.effects]
        posterior, state = found.context.posterior, found.law.state
        return LearnedModel(found, add(bench.posterior(), bench.model.effects, [*added, found.law.one],
                                       len(found.law.draft.effect.trials()), state),
                            bench_forces(posterior, posterior.start(bench.model.effects), state))


def with_law(given: Bench, addition: AddedEffects, law: Path) -> tuple[Bench, AddedEffects]:
    """A bench that knows the law of a file, and what was added with the effect of that file in it."""
    effect, file = given.asked_for(str(law), {}, str(law))
    effects = tuple(replace(one, effect=effect, file=file) if one.effect.name == effect.name else one
                    for one in addition.effects)
    return given.with_effect(effect, file), replace(addition, effects=effects)


def picture_of(found: LearnedModel) -> Curves | None:
    """The law over the motions that the runs had; None where there is none, or it is no force."""
    law, addition = found.learning.law, found.addition
    if law is None or addition is None:
        return None
    draft: Draft = law.draft
    one = next(one for one in addition.new if one.effect.name == draft.name)
    return picture(draft, one, addition.errors, found.learning.context)


NOTHING = "nothing is missing, so there is no law to learn"


def words(law: Law, addition: AddedEffects) -> str:
    """What it is: "friction with memory, 161 ± 4 N over 4.0 ± 0.2 mm, front axle only"."""
    one = law_learned(law, addition)
    return ", ".join(filter(None, (law.draft.family.words(law.draft, one, partial(_number, one)), one.where)))


def _number(one: Chosen, name: str, factor: float = 1.0, unit: str | None = None) -> str:
    error = one.standard_errors.get(name)
    said = measured(one.values[name] * factor, None if error is None else error * factor)
    return f"{said} {unit_of(name) if unit is None else unit}".rstrip()


def law_learned(law: Law, addition: AddedEffects) -> Chosen:
    """The law with its numbers and their errors."""
    return next(one for one in addition.new if one.effect.name == law.draft.name)


def why_none(found: Learning) -> str:
    """Why no law is learned."""
    if (one := found.refused) is not None:
        add = "" if one.known is None else f": ridelog add-effect {one.known.one.effect.name}"
        return f"no law learned: {one.title} would explain the residual best, but {one.why}{add}"
    if not found.verdict and not found.unexplained:
        return NOTHING
    if not found.verdict:
        return "no law learned: something is missing, but no known effect and no law of these families explains it"
    names = enumerated(found.verdict, "and")
    many = len(found.verdict) > 1
    if found.unexplained or (found.diagnosis is not None and not found.diagnosis.reaches_floor):
        return (f"no law learned: {names} explain{'s' * (not many)} part of what is missing, and no law of these "
                "families explains it better")
    return f"no law learned: {names} explain{'s' * (not many)} the residual"


def law_blocks(learned: LearnedModel) -> Iterator[Block]:
    """What a person reads."""
    found, addition = learned.learning, learned.addition
    yield _tiles(as_json(found, addition, None))
    if found.law is None or addition is None:
        assert found.diagnosis is not None
        said = why_none(found)
        yield from lab_words.removed_words(found.diagnosis.removed, found.diagnosis.band)
        yield f"{said[0].upper()}{said[1:]}."
        yield Bullets([f"{one.effect.name}: {numbers_of(one)}" for one in found.diagnosis.missing if one.values])
        yield from shape_sections(found.diagnosis)
        yield " ".join(lab_words.error_words(found.diagnosis.steps, found.diagnosis.noise_floor_error))
        return
    yield from sentences(found.law, addition)
    if learned.part is not None:
        yield from bench_sections(learned.part, addition.steps[0])
        if found.law.draft.at != "loop":  # what a law remembers is in no curve of the velocity
            yield _by_velocity(addition, learned.part)
    yield from law_sections(found.law, addition, picture_of(learned))
    yield Detail(lab_words.MODEL_BY_MODEL, [
        lab_words.falling(f"NRMSE on {JUDGED_ON}", _steps(found, addition), addition.noise_floor_error)])
    yield Detail("The law's file", [
        "It is an effect of your own: compare, simulate, add-effect and diagnose --effect-file read it.",
        found.law.draft.source])


_VELOCITIES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
"""Shares of the highest at which a table gives a damper's force."""


def _by_velocity(addition: AddedEffects, part: BenchForces) -> Section:
    """A part's force by velocity in both directions, as dampers are specified."""
    top_mps = np.quantile(np.abs(part.rate_mps), CURVE_REACH)
    at_mps = np.array([float(f"{share * top_mps:.2g}") for share in _VELOCITIES])
    by_rate = partial(force_by_rate, addition.vehicle, addition.effects, addition.errors)
    both_n = [by_rate(way * at_mps) for way in (-1, 1)]
    drawn_mps = np.linspace(-top_mps, top_mps, CURVE_POINTS)
    drawn = Line("with the law", drawn_mps, *by_rate(drawn_mps))
    return Section("Force at rest by velocity", [
        Curves("Force at rest by velocity", "velocity [m/s], positive in extension", "force [N]", (drawn,)),
        Table(("Velocity [m/s]", "Compression [N]", "Extension [N]"), [
            (f"{at:g}", *(measured(float(force_n[i]), float(error_n[i])) for force_n, error_n in both_n))
            for i, at in enumerate(at_mps)]),
        Hint("At the travel of rest, without friction that has a memory. Band: one standard error either way.")])


def sentences(law: Law, addition: AddedEffects) -> list[str]:
    """The law, what it brings, and what it may be instead: paragraphs."""
    said = words(law, addition)
    lines = [*lab_words.removed_words(addition.removed, addition.band), f"Learned: {said}.", _errors(addition)]
    if law.effects:
        beside = [one for one in addition.new if one.effect.name != law.draft.name]
        lines.append("Also missing: " + "; ".join(f"{one.effect.name} ({numbers_of(one)})" for one in beside)
                     + ". The law was fitted together with these; add them to the vehicle as well.")
    share = max(law.listed, 0.0) / law.with_law
    lines.append(f"Known effects alone reach {share:.0%} of the evidence of the model with the law (2 ln of the "
                 f"evidence: {law.listed:.0f} of {law.with_law:.0f}).")
    lines += _nearest(law.nearest)
    if law.rivals:
        others = [f"{one.title}: {one.shown_by}" for one in law.rivals]
        lines.append(f"These runs cannot distinguish it from {' or '.join(one.title for one in law.rivals)}: "
                     "each explains the residual about equally well. Drives that would distinguish them: "
                     + "; ".join([f"{law.draft.title}: {law.draft.family.shown_by}", *others]) + ".")
    return lines


def _nearest(nearest: Nearest | None) -> list[str]:
    if nearest is None:
        return ["No known effect of its kind explains any of it."]
    name, gap = nearest.one.effect.name, nearest.law_gain - nearest.gain
    numbers = f" ({numbers_of(nearest.one)})" if nearest.one.values else ""
    if nearest.as_good:
        return [f"It is nearly a known effect: {name}{numbers} explains {nearest.share:.1%} of what the law does, and "
                f"these runs cannot distinguish the two (2 ln of the evidence differs by {gap:+.0f}). Prefer the known "
                f"one: ridelog add-effect {name}."]
    return [f"The nearest known effect, {name}{numbers}, explains {nearest.share:.0%} of what the law does (2 ln of "
            f"the evidence {gap:.0f} less)."]


def _errors(addition: AddedEffects) -> str:
    steps = (*addition.steps[:-1], ErrorStep("with the law", addition.error_after))
    return " ".join(lab_words.error_words(steps, addition.noise_floor_error))


def source_of(found: Learning, addition: AddedEffects | None) -> str:
    """The law's file; empty where there is none."""
    law = found.law
    if law is None or addition is None:
        return ""
    said = words(law, addition)
    seconds = sum((run.count - run.first) / run.rate_hz for run in found.context.runs)
    count = len(found.context.runs)
    head = [f"{said[0].upper()}{said[1:]}.",
            f"Learned by ridelog from {count} run{'s' * (count != 1)}, {seconds:.0f} s. {_errors(addition)}",
            "Its parameters start at that fit's values; ridelog add-effect with this file refits them together with "
            "the car."]
    return law.draft.text(law_learned(law, addition).values, head)


# --- for a program ---


def as_json(found: Learning, addition: AddedEffects | None, path: str | None) -> dict[str, Any]:
    """What was learned as one JSON object; ``path``: of the law's file."""
    law, diagnosis = found.law, found.diagnosis
    if law is None or addition is None:
        assert diagnosis is not None
        return {
            "law": None, "family": None, "words": why_none(found), "parameters": {}, "standard_errors": {},
            "error_before": diagnosis.baseline_error, "error_after": diagnosis.final_error,
            "error_after_unseen": diagnosis.steps[-1].error, "noise_floor_error": diagnosis.noise_floor_error,
            "verdict": list(found.verdict), "unexplained": diagnosis.unexplained,
            "refused": found.refused and {"law": found.refused.title, "why": found.refused.why},
            "nearest": _nearest_json(found.refused.known if found.refused else None),
            **lab_words.errors_json(diagnosis.steps, diagnosis.noise_floor_error),
            **lab_words.removed_json(diagnosis.removed),
        }
    one = law_learned(law, addition)
    return {
        "law": path, "family": law.draft.family.name, "words": words(law, addition), "effect": law.draft.name,
        "axle": one.where.partition(" ")[0] or None, "parameters": dict(one.values),
        "standard_errors": finite(one.standard_errors), "error_before": addition.error_before,
        "error_refitted": addition.error_refitted, "error_after": addition.error_after,
        "error_after_unseen": addition.error_after, "error_before_unseen": addition.error_refitted,
        **lab_words.errors_json(_steps(found, addition), addition.noise_floor_error),
        "noise_floor_error": addition.noise_floor_error,
        "verdict": [other.effect.name for other in law.effects], "unexplained": found.unexplained,
        "log_likelihood_gain": law.gain / 2,
        "listed": {"verdict": list(found.verdict), "error_unseen": found.listed_error,
                   "gain": law.listed / 2, "gain_with_law": law.with_law / 2},
        "nearest": _nearest_json(law.nearest),
        "confused_with": [other.name for other in law.rivals],
        **lab_words.removed_json(addition.removed),
        "sentences": sentences(law, addition),
    }


def _nearest_json(one: Nearest | None) -> dict[str, Any] | None:
    return None if one is None else {
        "effect": one.one.effect.name, "parameters": dict(one.one.values), "share": one.share, "as_good": one.as_good,
        "log_likelihood_less": (one.law_gain - one.gain) / 2}


def _steps(found: Learning, addition: AddedEffects | None) -> tuple[ErrorStep, ...]:
    """How the error fell."""
    if found.law is None or addition is None:
        return found.diagnosis.steps if found.diagnosis else ()
    names = [*(one.effect.name for one in found.law.effects), found.law.draft.title]
    return (*addition.steps[:-1], ErrorStep(f"with {' and '.join(names)}", addition.error_after))


_BAND = "Band: one standard error either way. The curve covers the motions of the runs."


def law_sections(law: Law, addition: AddedEffects, drawn: Chart | None) -> list[Section]:
    """A law's picture, if it has one, and its numbers."""
    one = law_learned(law, addition)
    numbers = [(name, measured(value, one.standard_errors.get(name)), unit_of(name), parameter.meaning)
               for (name, value), parameter in zip(one.values.items(), law.draft.parameters, strict=True)]
    hint = [Hint(_BAND)] if law.draft.at != "loop" else []
    return [Detail("The law", [*([drawn] if drawn else []), *hint]),
            Detail("Its parameters", [Table(("Parameter", "Value", "Unit", "What it is"), numbers, (0, 2, 3))])]


def _tiles(summary: dict[str, object]) -> Html:
    def error(key: str) -> str:
        value = summary[key]
        return f"{value:.3f}" if isinstance(value, float) else "not known"

    return tiles([("NRMSE before any fit", error("error_before"), ""),
                  ("Final NRMSE", error("error_after_unseen"), JUDGED_ON),
                  ("Noise floor", error("noise_floor_error"), "NRMSE")])
