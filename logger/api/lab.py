"""The lab: where a model fails, which physical effect it lacks, and what adding one brings."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from logger.api.bench import Bench, Notify, among, bench_of, silent, tolerance_of
from logger.api.drives import Run, read_run
from logger.api.run_checks import checked_runs
from logger.api.shown import CommandResult
from logger.api.vehicles import Model, model_of
from logger.errors import BadInput
from logger.left_out import LeftOut, left_out_json, left_out_paragraph
from logger.runs import runs_left_out
from logger.store.formats import drive_file

if TYPE_CHECKING:
    from logger.chart_data import Chart
    from logger.lab import compare as compare_results
    from logger.lab import diagnosis as diagnosis_results
    from logger.lab.selection import add_effect as add_results
    from logger.report.html import Html

Runs = Run | Path | str | Sequence[Run | Path | str]
"""One run or several: records, or their folders."""


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(CommandResult):
    """A model compared with its measurements. Errors are rms(measured - model) / rms(measured), the first 2 s of each
    run left out.

    error            as the model stands
    refitted_error   with its numbers and the distances refitted within their tolerance
    run_errors       by name of the run, as the model stands
    missing          whether the residual depends on the road and the car's motion
    evidence         sentences
    moves            by which share each number moved for the refit; ``moved_far``: farther than their tolerance
    """

    error: float
    refitted_error: float
    run_errors: Mapping[str, float]
    missing: bool
    evidence: tuple[str, ...]
    moves: Mapping[str, float]
    moved_far: tuple[str, ...]
    spectra: tuple[Chart, ...]

    def charts(self) -> Sequence[Chart]:
        """Spectra of measurement, model and residual after the refit."""
        return self.spectra


def compare(vehicle: Model | Path | str, runs: Runs, *, tolerance: float | None = None,
            low_pass_hz: float | None = None, anyway: bool = False) -> Comparison:
    """Compare a model with measurements: the error, where it sits, and what kind of thing is missing.

    vehicle      a model, or a name or file as in ``read_vehicle``
    runs         5 s or longer, of one sample rate of 50 Hz or more, each with a profile and a name of its own
    tolerance    how far off the car's masses, springs and dampers may well be, as a share, 0.001 to 0.5; None: 0.04,
                 and in searches and fits of an effect 0.1 where the runs say that the vehicle's file is a rough one
    low_pass_hz  what lies above is not compared [Hz]; None: all is that the records hold. Errors are then of the
                 measurement and the model without it
    anyway       go on where a run does not seem to be of this road or this car, or in these units

    Raises BadInput where these do not fit together, and as ``read_vehicle`` and ``read_run``.

    >>> found = compare(car, runs)
    >>> found.refitted_error < found.error, found.missing
    (True, True)
    """
    return comparison_of(
        bench_with(vehicle, runs, (), tolerance, thin=False, low_pass_hz=low_pass_hz, anyway=anyway).compared())


def comparison_of(found: compare_results.Comparison) -> Comparison:
    """What the lab found, as it is shown."""
    from logger.report.comparison_text import as_json
    from logger.report.lab_page import spectra
    from logger.report.lab_text import comparison_lines

    summary = as_json(found)
    return Comparison(
        "\n".join(comparison_lines(found)), summary, summary["error"], summary["refitted"]["error"],
        {one["run"]: one["error"] for one in summary["runs"]}, summary["missing"], tuple(summary["evidence"]),
        summary["refitted"]["moves"], tuple(summary["refitted"]["moved_far"]), spectra(found.refitted.residuals))


@dataclass(frozen=True)
class Candidate:
    """An effect that was tried.

    parameters       fitted, by name; ``standard_errors`` of those that are known
    error            on stretches that no fit saw
    p_value          how often noise alone would look like it, all candidates together
    confused_with    effects that explain as much
    """

    effect: str
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    error: float
    p_value: float
    confused_with: tuple[str, ...]


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(CommandResult):
    """Which physical effects a model lacks.

    baseline_error       of the model as it stands
    noise_floor_error    that the sensor's noise alone makes
    candidates           best first
    verdict              names of the effects that are missing, the most certain first; empty: none
    unexplained          whether something is left that no candidate explains
    steps                models on the way, each with its error on what no fit saw
    """

    baseline_error: float
    noise_floor_error: float
    candidates: tuple[Candidate, ...]
    verdict: tuple[str, ...]
    unexplained: bool
    steps: tuple[tuple[str, float], ...]

    def figures(self) -> list[Html]:
        """How the error fell."""
        from logger.report.diagnosis_page import falling

        return [falling("How the error fell", self.steps, self.noise_floor_error)]


def diagnose(
    vehicle: Model | Path | str, runs: Runs, *, candidates: Collection[str] | None = None,
    effect_files: Sequence[Path | str] = (), tolerance: float | None = None, low_pass_hz: float | None = None,
    progress: Notify = silent, anyway: bool = False,
) -> Diagnosis:
    """Which physical effect a model lacks: each that is known is tried, and judged on what no fit saw. It takes from
    seconds to minutes, and the compiler of the ``lab`` extra.

    vehicle, runs, tolerance, low_pass_hz, anyway    as in ``compare``
    candidates      names of the effects to be tried; None: all
    effect_files    Python files, each with an effect of your own to be tried as well
    progress        called with what is under way, such as ``print``

    Raises BadInput as ``compare``, for effects that there are not, and where the compiler is missing.

    >>> found = diagnose(car, runs, candidates=["sensor_gain", "sensor_offset", "time_offset"])
    >>> found.verdict, found.unexplained
    (('sensor_gain',), False)
    >>> found.candidates[0].effect, round(found.candidates[0].parameters["gain"], 1)
    ('sensor_gain', 1.1)
    """
    bench = bench_with(vehicle, runs, effect_files, tolerance, None if candidates is not None else "diagnose",
                       low_pass_hz=low_pass_hz, anyway=anyway)
    return diagnosis_of(replace(bench, effects=among(bench.effects, candidates)).diagnosed(progress),
                        runs_left_out(bench.runs.runs))


def diagnosis_of(found: diagnosis_results.Diagnosis, left_out: Sequence[LeftOut] = ()) -> Diagnosis:
    """What the lab found, as it is shown, and what it left out."""
    from logger.report.diagnosis_text import as_json
    from logger.report.lab_text import diagnosis_lines

    summary = as_json(found) | left_out_json(left_out)
    words = "\n".join([*diagnosis_lines(found, None), *left_out_paragraph(left_out)])
    return Diagnosis(words, summary, **diagnosis_fields(summary))


def diagnosis_fields(summary: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a ``Diagnosis`` beside its text, out of the object that the command prints."""
    return {
        **{name: summary[name] for name in ("baseline_error", "noise_floor_error", "unexplained")},
        "candidates": tuple(
            Candidate(one["effect"], one["parameters"], one["standard_errors"], one["error"], one["p_value"],
                      tuple(one["confused_with"])) for one in summary["candidates"]),
        "verdict": tuple(summary["verdict"]), "steps": tuple((one["step"], one["error"]) for one in summary["steps"]),
    }


@dataclass(frozen=True)
class ShiftedNumber:
    """A number of the car, refitted without an effect and with it, each with its standard error.

    nominal    as it was given
    biased     whether the missing effect had pulled it away
    """

    name: str
    nominal: float
    without: float
    without_standard_error: float
    found: float
    standard_error: float
    biased: bool


@dataclass(frozen=True, eq=False, repr=False)
class AddedEffect(CommandResult):
    """A model with one more effect, fitted with the car's numbers on all of the runs.

    effect              its name; ``parameters`` and ``standard_errors`` by name
    error_before        of the model as it was; ``error_refitted`` of it with its numbers and the distances refitted
    error_after         of the model with the effect, refitted likewise
    noise_floor_error   that the sensor's noise alone makes
    p_value             how often noise alone would improve the fit as much
    helps               whether that is improbable, and the error on what no fit saw does not rise
    numbers             of the car, those that the effect moved most first
    model               with the effect
    """

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


def add_effect(
    name: Path | str, vehicle: Model | Path | str, runs: Runs, *, start: Mapping[str, float] | None = None,
    tolerance: float | None = None, low_pass_hz: float | None = None, progress: Notify = silent,
    anyway: bool = False,
) -> AddedEffect:
    """Add a physical effect to a model: fitted with the car's numbers on all of the runs.

    name         of an effect that comes with ridelog, or the path of a Python file with one of your own
    vehicle, runs, tolerance, low_pass_hz, anyway    as in ``compare``
    start        where the fit of its parameters begins, by name; the rest is searched for
    progress     called with what is under way, such as ``print``

    Raises BadInput as ``compare``, and for an effect that there is not, that the model has, or that cannot be there.

    >>> found = add_effect("sensor_gain", car, runs, start={"gain": 1.1})
    >>> found.helps, found.error_after < 0.5 * found.error_before
    (True, True)
    >>> [one.effect.name for one in found.model.effects]
    ['sensor_gain']
    """
    values = dict(start or {})
    bench = bench_with(vehicle, runs, (), tolerance, low_pass_hz=low_pass_hz, anyway=anyway)
    effect, file = bench.asked_for(str(name), values, str(name))
    bench = bench.with_effect(effect, file)
    is_given = set(values) >= {one.name for one in effect.parameters}
    found = bench.added(bench.search_values(effect, values, progress), 1 if is_given else len(effect.trials()),
                        progress)
    return addition_of(found, model_of(bench.model_with(found)))


def addition_of(found: add_results.AddedEffects, model: Model) -> AddedEffect:
    """What the lab found, as it is shown; the model with it."""
    from logger.report.add_effect_text import as_json
    from logger.report.lab_text import addition_lines

    summary = as_json(found)
    numbers = tuple(
        ShiftedNumber(one["name"], one["nominal"], one["without"], one["without_standard_error"], one["with"],
               one["with_standard_error"], one["name"] in summary["biased"]) for one in summary["numbers"])
    return AddedEffect(
        "\n".join(addition_lines(found)), summary, summary["effect"], summary["parameters"], summary["standard_errors"],
        summary["error_before"], summary["error_refitted"], summary["error_after"], summary["noise_floor_error"],
        summary["p_value"], summary["helps"], numbers, model)


def bench_with(
    vehicle: Model | Path | str, runs: Runs, effect_files: Sequence[Path | str], tolerance: float | None,
    searches: str | None = None, thin: bool = True, low_pass_hz: float | None = None, anyway: bool = False,
) -> Bench:
    """All that a question needs, checked together."""
    off, model = tolerance_of(tolerance), model_of(vehicle)
    return bench_of(word_of(vehicle, model), model, checked_runs(lab_drives(runs), thin, model.vehicle),
                    list(map(str, effect_files)), off, searches, low_pass_hz=low_pass_hz, anyway=anyway)


def lab_drives(runs: Runs) -> list[drive_file.DriveOnRoad]:
    """One run or several, read, with their roads. BadInput as ``given_runs``, and for one without a road."""
    return [_on_a_road(one) for one in given_runs(runs)]


def word_of(vehicle: Model | Path | str, model: Model) -> str:
    """By which the user knows a vehicle."""
    return str(vehicle) if isinstance(vehicle, Path | str) else model.vehicle.name


def given_runs(runs: Runs) -> list[Run]:
    """One run or several, read. BadInput for none, and for two of one name."""
    given = [runs] if isinstance(runs, Run | Path | str) else list(runs)
    drives = [one if isinstance(one, Run) else read_run(one) for one in given]
    names = [str(one.path) for one in drives]
    if not drives:
        raise BadInput("expected a run, found none")
    if again := next((name for number, name in enumerate(names) if name in names[:number]), None):
        raise BadInput(f"{again}: expected each run once, and under a name of its own")
    return drives


def _on_a_road(run: Run) -> drive_file.DriveOnRoad:
    track = run.track
    if track is None:
        raise BadInput(f"{run.path}: expected a run with the profile that it was driven on, or its excitation")
    return drive_file.DriveOnRoad(**{one.name: getattr(run, one.name) for one in fields(drive_file.Drive)}, track=track)
