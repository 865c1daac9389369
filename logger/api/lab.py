"""The lab: where a model fails, which physical effect it lacks, and what adding one brings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.bench import Bench, bench_of, slow_words, tolerance_of
from logger.api.drives import Run, run_on_road
from logger.api.lab_questions import AddEffectQuestion, CompareQuestion, LabQuestion
from logger.api.question import function
from logger.api.run_checks import checked_runs
from logger.api.shown import CommandResult
from logger.api.terms import Runs, each, named_numbers
from logger.api.vehicles import Model, model_of
from logger.errors import BadInput
from logger.lab.selection.add_effect import Number as ShiftedNumber
from logger.store.formats import drive_file, vehicle_file

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.lab import compare as compare_results
    from logger.lab.selection import add_effect as add_results
    from logger.report.html import Html
    from logger.vehicle.effect import Effect

@dataclass(frozen=True, eq=False, repr=False)
class Comparison(CommandResult):
    """A model compared with its measurements. Errors are rms(measured - model) / rms(measured), the first 2 s of each
    run left out.

    found            all that the lab found
    error            as the model stands
    refitted_error   with its numbers and the distances refitted within their tolerance
    run_errors       by name of the run, as the model stands
    evidence         sentences
    """

    found: compare_results.Comparison
    error: float
    refitted_error: float
    run_errors: Mapping[str, float]
    evidence: tuple[str, ...]

    @property
    def missing(self) -> bool:
        """Whether the residual depends on the road and the car's motion."""
        return self.found.missing

    @property
    def moves(self) -> Mapping[str, float]:
        """By which share each number moved for the refit."""
        return self.found.moves

    @property
    def moved_far(self) -> tuple[str, ...]:
        """Numbers that moved farther than their tolerance."""
        return self.found.far

    def charts(self) -> Sequence[Chart]:
        """Spectra of measurement, model and residual after the refit."""
        from logger.report.lab_page import spectra

        return spectra(self.found.refitted.residuals)

    def as_page(self, of: str) -> Html:
        """The comparison as one HTML document."""
        from logger.report.lab_page import page

        return page(self.found)


def compared(question: CompareQuestion) -> Comparison:
    """The answer to ``CompareQuestion``, which says what is raised."""
    return comparison_of(bench_with(question, thin=False).compared())  # an error is that of all samples


compare = function("compare", CompareQuestion, compared)


def comparison_of(found: compare_results.Comparison) -> Comparison:
    """What the lab found, as it is shown."""
    from logger.report.comparison_text import as_json
    from logger.report.lab_text import comparison_lines

    summary = as_json(found)
    return Comparison("\n".join(comparison_lines(found)), summary, found, found.plain.error, found.steps[-1].error,
                      {one["run"]: one["error"] for one in summary["runs"]}, tuple(summary["evidence"]))


@dataclass(frozen=True, eq=False, repr=False)
class AddedEffect(CommandResult):
    """A model with one more effect, fitted with the car's numbers on all of the runs.

    found               all that the lab found
    effect              its name; ``parameters`` and ``standard_errors`` by name
    error_before        of the model as it was; ``error_refitted`` of it with its numbers and the distances refitted
    error_after         of the model with the effect, refitted likewise
    noise_floor_error   that the sensor's noise alone makes
    p_value             how often noise alone would improve the fit as much
    helps               whether that is improbable, and the error on what no fit saw does not rise
    numbers             of the car, those that the effect moved most first
    model               with the effect
    """

    found: add_results.AddedEffects
    effect: str
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    error_before: float
    error_refitted: float
    error_after: float
    noise_floor_error: float
    p_value: float
    helps: bool
    numbers: tuple[ShiftedNumber, ...]
    model: Model

    def figures(self) -> list[Html]:
        """How the error fell."""
        from logger.report.diagnosis_page import falling

        return [falling("How the error fell", [
            ("as it was given", self.error_before), ("numbers refitted", self.error_refitted),
            (f"with {self.effect}", self.error_after)], self.noise_floor_error)]


    def write(self, path: Path, option: str = "--out") -> None:
        """Write the new vehicle file."""
        vehicle_file.write_model(path, self.model)
        self._json["vehicle"] = str(path)


def added(question: AddEffectQuestion) -> AddedEffect:
    """The answer to ``AddEffectQuestion``, which says what is raised."""
    bench = bench_with(question)
    effect, file, values = asked_for(str(question.name), bench, question)
    values |= dict(question.start or {})
    bench = bench.with_effect(effect, file)
    is_given = set(values) >= {one.name for one in effect.parameters}
    found = bench.added(bench.search_values(effect, values, question.progress),
                        1 if is_given else len(effect.trials()), question.progress)
    return addition_of(found, model_of(bench.model_with(found)))


add_effect = function("add_effect", AddEffectQuestion, added)


def asked_for(text: str, bench: Bench, question: AddEffectQuestion | LabQuestion
              ) -> tuple[Effect, str | None, dict[str, float]]:
    """An effect as it was asked for, the file it is from, and what was said of its numbers. BadInput as
    ``Bench.asked_for``."""
    name, values = named_numbers(text, "add-effect")
    start = getattr(question, "start", None) or {}
    effect, file = bench.asked_for(name, values | start, text)
    if words := slow_words([effect]):
        question.warn(words)
    return effect, file, values


def addition_of(found: add_results.AddedEffects, model: Model) -> AddedEffect:
    """What the lab found, as it is shown; the model with it."""
    from logger.report.add_effect_text import as_json
    from logger.report.lab_text import addition_lines

    new = found.new[-1]
    return AddedEffect(
        "\n".join(addition_lines(found)), as_json(found), found, new.effect.name, dict(new.values),
        dict(new.standard_errors), found.error_before, found.error_refitted, found.error_after,
        found.noise_floor_error, found.p_value, found.helps, tuple(found.moved), model)


def bench_with(question: LabQuestion, searches: str | None = None, thin: bool = True) -> Bench:
    """Vehicle, runs and effects of a question, checked together."""
    given: Any = question
    off, model = tolerance_of(question.tolerance), model_of(given.vehicle)
    return bench_of(word_of(given.vehicle, model), model, checked_runs(lab_drives(given.runs), thin, model.vehicle),
                    list(map(str, getattr(question, "effect_files", ()))), off, searches, question.warn,
                    question.low_pass_hz, question.anyway)


def lab_drives(runs: Runs) -> list[drive_file.DriveOnRoad]:
    """One run or several, read, with their roads. BadInput for none, for two that are one, or of one name, and for one
    without a road."""
    given = each(runs)
    if not given:
        raise BadInput("expected a run, found none")
    places = [one.path if isinstance(one, Run) else Path(one).resolve() for one in given]
    if again := next((one for number, one in enumerate(given) if places[number] in places[:number]), None):
        raise BadInput(f"{again.path if isinstance(again, Run) else again}: expected each run once, and under a name "
                       "of its own")
    return [drive_file.DriveOnRoad(**{one.name: getattr(run, one.name) for one in fields(drive_file.Drive)},
                                   track=run.track) for run in map(run_on_road, given) if run.track is not None]


def word_of(vehicle: vehicle_file.Model | Path | str, model: Model) -> str:
    """By which the user knows a vehicle."""
    return str(vehicle) if isinstance(vehicle, Path | str) else model.vehicle.name
