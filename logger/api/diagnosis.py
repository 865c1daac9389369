"""Which physical effect a model lacks: from drives over measured roads, or over one road that nobody measured."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from logger.api.bench import Bench, among, known_effects, tolerance_of
from logger.api.drives import Run
from logger.api.lab import bench_with, word_of
from logger.api.lab_questions import DiagnoseQuestion
from logger.api.question import Notify, function, silent
from logger.api.run_checks import check_distances, check_record, driven_parts, thinned_runs
from logger.api.shown import CommandResult
from logger.api.terms import Runs, each
from logger.api.vehicles import Model, model_of
from logger.errors import BadInput
from logger.left_out import left_out_json, left_out_paragraph
from logger.report.text_layout import paragraphs
from logger.runs import BY_RECEIVER, UNKNOWN, runs_left_out
from logger.runs import Run as Record
from logger.store.formats import drive_file

if TYPE_CHECKING:
    from logger.lab import diagnosis as diagnosis_results
    from logger.lab.unknown_road.diagnosis import UnknownRoadDiagnosis
    from logger.report.html import Html

Array = npt.NDArray[np.float64]

_SHOWN = 8
_PLACES_EVERY_M = 10.0
_LEAST_SHARED_M = 50.0
"""Some seconds of a drive: less road says nothing (``lab.unknown_road.likelihood``)."""


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

    found                all that the lab found
    baseline_error       of the model as it stands
    noise_floor_error    that the sensor's noise alone makes
    candidates           best first
    verdict              names of the effects that are missing, the most certain first; empty: none
    unexplained          whether something is left that no candidate explains
    steps                models on the way, each with its error on what no fit saw
    vehicle              its name
    """

    found: Any
    baseline_error: float
    noise_floor_error: float
    candidates: tuple[Candidate, ...]
    verdict: tuple[str, ...]
    unexplained: bool
    steps: tuple[tuple[str, float], ...]
    vehicle: str
    next_command: str

    def figures(self) -> list[Html]:
        """How the error fell."""
        from logger.report.diagnosis_page import falling

        return [falling("How the error fell", self.steps, self.noise_floor_error)]

    def as_page(self, of: str) -> Html:
        """The diagnosis as one HTML document."""
        from logger.report.diagnosis_page import page

        return page(self.found, self.vehicle)

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """What to do now; a command in one piece, so that it can be copied."""
        return self.next_command


def diagnosed(question: DiagnoseQuestion) -> Diagnosis:
    """The answer to ``DiagnoseQuestion``, which says what is raised."""
    if question.same_road:
        return _diagnosed_same_road(question)
    bench = bench_with(question, None if question.candidates is not None else "ridelog diagnose")
    bench = replace(bench, effects=among(bench.effects, question.candidates))
    found = bench.diagnosed(question.progress)
    return diagnosis_of(found, bench, None if question.list_all else _SHOWN, _next(question, bench, found))


diagnose = function("diagnose", DiagnoseQuestion, diagnosed)


def diagnosis_of(found: diagnosis_results.Diagnosis, bench: Bench, most: int | None = None, next_command: str = ""
                 ) -> Diagnosis:
    """What the lab found on a bench, as it is shown; ``most`` so many candidates, None: all."""
    from logger.report.diagnosis_text import as_json
    from logger.report.lab_text import diagnosis_lines

    left_out = runs_left_out(bench.runs.runs)
    text = [paragraphs([_compared(bench)]), "", *diagnosis_lines(found, most), *left_out_paragraph(left_out)]
    errors = {one.effect.name: one.standard_errors for one in found.missing}
    candidates = tuple(Candidate(one.effect.name, dict(one.values), dict(errors.get(one.effect.name, {})), one.error,
                                 one.p_value, tuple(one.confused_with)) for one in found.candidates)
    return Diagnosis("\n".join(text), as_json(found) | left_out_json(left_out), found, found.baseline_error,
                     found.noise_floor_error, candidates, found.verdict, found.unexplained,
                     tuple((one.words, one.error) for one in found.steps), bench.model.vehicle.name, next_command)


def _compared(bench: Bench) -> str:
    runs, model = bench.runs.runs, bench.model
    seconds = sum((run.count - run.first) / run.rate_hz for run in runs)
    has = f", with {', '.join(one.effect.name for one in model.effects)}," if model.effects else ""
    return (f"{model.vehicle.name}{has} on {len(runs)} run{'s' * (len(runs) != 1)}, {seconds:.0f} s. "
            f"{len(bench.effects)} effects are known.")


def _next(question: DiagnoseQuestion, bench: Bench, found: diagnosis_results.Diagnosis) -> str:
    if found.missing:
        one = found.missing[0].effect.name
        return "Next: " + question.command(f"add-effect {bench.files.get(one, one)} {{}} --out with-{one}.yaml")
    if found.conflicts and not found.exceeds_noise:
        words = (f"Next: see whether {', '.join(found.conflicts)} of the vehicle's file can be right. From the runs "
                 "alone they are found by")
        return paragraphs([words]) + "\n" + question.command(f"identify --free {','.join(found.conflicts)} {{}}")
    if found.unexplained:
        return paragraphs(["Next: look at the shape above. An effect of your own is one Python file (--effect-file); "
                           "ridelog compare shows where the residual is."])
    return "Next: nothing. A drive that shows what these runs cannot tell would test the model further."


# --- without a profile ---


@dataclass(frozen=True, eq=False, repr=False)
class SameRoadDiagnosis(Diagnosis):
    """Which physical effects a model lacks, as far as drives over an unmeasured road show it.

    An error is rms(measured - model) / rms(measured) of each drive over the road estimated from the other drives.

    run_errors       by name of the run: error before, and with the effects that were found
    taken_by_road    effects that another road would imitate, and the share of their information that remains with it
    not_tried        effects that could not be tried, and why
    undecided        effects that explain a little, but may only imitate something else that is missing
    cannot_tell      sentences: what these drives do not show
    """

    run_errors: Mapping[str, tuple[float, float]]
    taken_by_road: Mapping[str, float]
    not_tried: Mapping[str, str]
    undecided: tuple[str, ...]
    cannot_tell: tuple[str, ...]


def diagnose_same_road(
    vehicle: Model | Path | str, runs: Runs, *, candidates: Collection[str] | None = None,
    effect_files: Sequence[Path | str] = (), tolerance: float | None = None, progress: Notify = silent,
) -> SameRoadDiagnosis:
    """As ``diagnose`` with ``same_road``: from two drives or more over one road that nobody measured.

    Raises BadInput for fewer than two runs, drives that are plainly over two roads, and as ``diagnose``. Source: the
    road is random as ISO 8608 lets expect it, and its waves are found with the car (``logger.lab.unknown_road``).

    >>> found = diagnose_same_road(car, runs, candidates=["sensor_offset", "sensor_gain"])
    >>> found.verdict, list(found.taken_by_road)
    ((), ['sensor_gain'])
    """
    return _diagnosed_same_road(DiagnoseQuestion(
        vehicle, runs, candidates=candidates, effect_files=effect_files, tolerance=tolerance, progress=progress,
        same_road=True, list_all=True))


def _diagnosed_same_road(question: DiagnoseQuestion) -> SameRoadDiagnosis:
    """The answer to ``DiagnoseQuestion`` with ``same_road``."""
    from logger.report.same_road_text import as_json, cannot_tell, same_road_lines

    names = [str(one.path if isinstance(one, Run) else one) for one in each(question.runs)]
    if not 2 <= len(names) == len(set(names)):
        raise question.wrong("same_road", ": expected two runs or more, each once")
    model = model_of(question.vehicle)
    records = records_of([_drive(one) for one in each(question.runs)])
    found = _diagnosed(model, records, question)
    summary = as_json(found)
    most = None if question.list_all else _SHOWN
    return SameRoadDiagnosis(
        "\n".join(same_road_lines(found, names, most)), summary, found, summary["baseline_error"],
        summary["noise_floor_error"], tuple(
            Candidate(one["effect"], one["parameters"], one["standard_errors"], one["error"], one["p_value"],
                      tuple(one["confused_with"])) for one in summary["candidates"]),
        tuple(summary["verdict"]), found.unexplained, tuple((one["step"], one["error"]) for one in summary["steps"]),
        model.vehicle.name, "", run_errors=dict(zip(names, found.by_run, strict=True)),
        taken_by_road=summary["taken_by_road"], not_tried=summary["not_tried"],
        undecided=tuple(summary["undecided"]), cannot_tell=tuple(cannot_tell(found)))


def _drive(given: Run | Path | str) -> tuple[drive_file.Drive, str]:
    """A drive and its name; a profile beside it is not read."""
    if isinstance(given, Run):
        return given, str(given.path)
    file = Path(given) / drive_file.DRIVE if Path(given).is_dir() else Path(given)
    return drive_file.read_drive(file), str(given)


def records_of(drives: Sequence[tuple[drive_file.Drive, str]]) -> list[Record]:
    """Drives and their names, checked together; on a flat road, for none is known. BadInput for fewer than two, or one
    that the others cannot be used with."""
    from logger.profiles.track import Track

    if len(drives) < 2:
        raise BadInput("expected two runs or more over one road, found one")
    flat = Track(1.0, np.zeros(2))
    for number, (drive, _) in enumerate(drives):
        file = drive.path / drive_file.DRIVE if drive.path.is_dir() else drive.path
        check_record(drive, file, [one for one, _ in drives[:number]])
        check_distances(drive, file)
    by_receiver = any(one.facts.places_by == BY_RECEIVER for one, _ in drives)
    if any(_counts_for_itself(one) for one, _ in drives) and all(_was_extracted(one) for one, _ in drives):
        drives, by_receiver = _on_one_distance(drives), True
    facts = replace(UNKNOWN, places_by=BY_RECEIVER) if by_receiver else UNKNOWN
    return thinned_runs([Record(name, one.rate_hz, one.accel_z_mps2, one.distance_m, one.speed_mps, flat, facts=facts)
                         for one, name in drives])


def _was_extracted(drive: drive_file.Drive) -> bool:
    """Whether a drive was extracted, and has positions."""
    return drive.facts.source is not None and drive.lat_deg is not None and bool(np.isfinite(drive.lat_deg).all())


def _counts_for_itself(drive: drive_file.Drive) -> bool:
    """Whether that was without a profile, so that its distance begins where it did."""
    return _was_extracted(drive) and drive.facts.places_by is None


def _on_one_distance(drives: Sequence[tuple[drive_file.Drive, str]]) -> list[tuple[drive_file.Drive, str]]:
    """The longest part of each drive in which the car moved, on the distance of the one that goes farthest, by the
    start that comes nearest to their positions: what these wander by, over a minute or so, is no motion, and ways by a
    receiver's speeds have no factor.

    BadInput for a drive that goes elsewhere.
    """
    from logger.extraction.measured_line import ASIDE_M, MeasuredLine

    driven = [(_longest_part(one), name) for one, name in drives]
    along, _ = max(driven, key=lambda pair: float(np.ptp(pair[0].distance_m)))
    metres = np.arange(along.distance_m[0], along.distance_m[-1], _PLACES_EVERY_M)
    line = MeasuredLine.of(metres, *(np.interp(metres, along.distance_m, one) for one in _places(along)))
    found = []
    for drive, name in driven:
        along_m, aside_m = line.passed(*_places(drive))
        near = (aside_m < ASIDE_M) & (along_m > metres[0]) & (along_m < metres[-1])
        if np.ptp(drive.distance_m[near]) < _LEAST_SHARED_M if near.any() else True:
            raise BadInput(f"{name}: expected a drive over the road of {along.path}, found none of its positions there "
                           f"for {_LEAST_SHARED_M:g} m")
        farther_m = float(np.median((along_m - drive.distance_m)[near]))
        found.append((replace(drive, distance_m=drive.distance_m + farther_m), name))
    return found


def _places(drive: drive_file.Drive) -> tuple[Array, Array]:
    assert drive.lat_deg is not None and drive.lon_deg is not None
    return drive.lat_deg, drive.lon_deg


def _longest_part(drive: drive_file.Drive) -> drive_file.Drive:
    """BadInput where the car hardly moved."""
    part = max(driven_parts(drive), key=lambda one: one.stop - one.start)
    rows = ("time_s", "accel_z_mps2", "speed_mps", "distance_m", "lat_deg", "lon_deg")
    return replace(drive, usable=None if drive.usable is None else drive.usable[part],
                   **{name: getattr(drive, name)[part] for name in rows})


def _diagnosed(model: Model, records: Sequence[Record], question: DiagnoseQuestion) -> UnknownRoadDiagnosis:
    """Which effects the model lacks. BadInput as ``diagnose_same_road``."""
    from logger.lab.unknown_road import diagnosis
    from logger.lab.unknown_road.likelihood import NotOneRoad, SameRoad
    from logger.lab.unknown_road.one_road import placed_by_road

    off, given = tolerance_of(question.tolerance), model.given or model.vehicle
    word, notify = word_of(question.vehicle, model), question.progress
    for one in model.effects:
        if one.effect.obstacle(model.vehicle, two_tracks=False) is not None:
            raise BadInput(f"{word}: its effect {one.effect.name} needs a road that is known under the right wheels "
                           "too")
    effects, _ = known_effects(model, list(map(str, question.effect_files)))
    try:
        if by_receiver := any(one.facts.places_by == BY_RECEIVER for one in records):
            notify("laying the drives on one distance by the road that they felt")
            records = placed_by_road(records, given, off, model.effects, model.vehicle)
        problem = SameRoad(records, given, off, model.vehicle, exact_places=not by_receiver)
        return diagnosis.diagnose_same_road(problem, among(effects, question.candidates), model.effects, notify)
    except NotOneRoad as error:
        raise BadInput(str(error)) from None
    except ValueError as error:
        raise BadInput(f"{word}: {error}") from None
