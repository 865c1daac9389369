"""Which physical effect a model lacks: from drives over measured roads, or over one road that nobody measured.

The answers, their words for a person and for a program, and the page: what is missing, how certain that is, and the
shape of what no effect explains.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.inputs import Model, Run, model_of
from logger.api.lab import words as lab_words
from logger.api.lab.bench import Bench, among, bench_with, known_effects, tolerance_of, with_candidates, word_of
from logger.api.lab.checks import check_distances, check_record, driven_parts, thinned_runs
from logger.api.lab.compare import forces_section, spectra
from logger.api.lab.question import DiagnoseQuestion, LabQuestion
from logger.api.shared_fields import each
from logger.chart_data import MOST_DOTS, Array, Bars, Curves, Line
from logger.errors import BadInput
from logger.extraction.along_track import MeasuredLine
from logger.lab.diagnosis import LabDiagnosis
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.residuals.fitted_laws import RATE, TRAVEL, BenchForces, ForceCurve
from logger.lab.residuals.unexplained import Shape
from logger.lab.selection.detectability import DETECTABLE_SIGMA, Undetectable
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION
from logger.lab.selection.holdout import JUDGED_ON, ErrorStep, most_of
from logger.lab.unknown_road import diagnosis
from logger.lab.unknown_road.diagnosis import UnknownRoadDiagnosis
from logger.lab.unknown_road.same_road import NotOneRoad, SameRoad, placed_by_road
from logger.left_out import left_out_json, left_out_lines
from logger.printable import percent
from logger.profiles.track import Track
from logger.question import function
from logger.report import document as doc
from logger.report.blocks import SHOWN_ROWS, Block, Blocks, Bullets, Detail, Hint, Section, Table, page
from logger.report.quantities import (
    chance,
    enumerated,
    finite,
    fixed,
    measured,
    numbers_of,
    signal_errors,
    some,
    unit_of,
    wrapped,
)
from logger.roads.road_matching import SEARCH_M
from logger.runs import BY_RECEIVER, UNKNOWN, runs_left_out
from logger.runs import Run as Record
from logger.store.formats import drive_file
from logger.vehicle.effect import Chosen
from logger.vehicle.effects.force_gain import EFFECT as FORCE_GAIN

_PLACES_EVERY_M = 10.0
_LEAST_SHARED_M = 50.0
"""Some seconds of a drive: less road says nothing (``lab.unknown_road.same_road``)."""


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
class Diagnosis(lab_words.ModelByModel):
    """Which physical effects a model lacks.

    found                all that the lab found
    baseline_error       of the model as it stands; without a profile an error is rms(measured - model) / rms(measured)
                         of each drive over the road estimated from the others
    candidates           best first
    verdict              names of the effects that are missing, the most certain first; empty: none
    unexplained          whether something is left that no candidate explains
    vehicle              its name
    """

    found: LabDiagnosis | UnknownRoadDiagnosis
    baseline_error: float
    candidates: tuple[Candidate, ...]
    verdict: tuple[str, ...]
    unexplained: bool
    vehicle: str
    next_command: str

    def as_page(self, of: str) -> doc.Html:
        """The diagnosis as one HTML document."""
        return page(f"{self.vehicle}: which effect is missing?", of, self.blocks())

    def next_words(self, question: Any, written: Mapping[str, Sequence[Path]]) -> str:
        """What to do now; a command in one piece, so that it can be copied."""
        return self.next_command


@function(DiagnoseQuestion)
def diagnose(question: DiagnoseQuestion) -> Diagnosis:
    if question.same_road:
        return _diagnosed_same_road(question)
    bench = bench_with(question, None if question.candidates is not None else "ridelog diagnose")
    bench = with_candidates(bench, question.candidates)
    found = bench.diagnosed(question.progress)
    return diagnosis_of(found, bench, None if question.list_all else SHOWN_ROWS, _next(question, bench, found))


def diagnosis_of(found: LabDiagnosis, bench: Bench, most: int | None = None, next_command: str = "") -> Diagnosis:
    """What the lab found on a bench, as it is shown; ``most`` so many candidates, None: all."""
    left_out = runs_left_out(bench.runs.runs)
    content = Blocks([*diagnosis_blocks(found, most), *map(Hint, [_compared(bench), *left_out_lines(left_out)])])
    return _shown(found, content, diagnosis_json(found) | left_out_json(left_out), bench.model.vehicle.name,
                  next_command)


def _shown(found: LabDiagnosis | UnknownRoadDiagnosis, content: Blocks, summary: dict[str, Any], vehicle: str,
           next_command: str = "") -> Diagnosis:
    errors = {one.effect.name: one.standard_errors for one in found.missing}
    candidates = tuple(Candidate(one.effect.name, dict(one.one.values), dict(errors.get(one.effect.name, {})),
                                 one.error, one.p_value, tuple(one.confused_with)) for one in found.candidates)
    return Diagnosis(content, summary, found.steps, found.noise_floor_error, found, found.baseline_error, candidates,
                     found.verdict, found.unexplained, vehicle, next_command)


def _compared(bench: Bench) -> str:
    runs, model = bench.runs.runs, bench.model
    seconds = sum((run.count - run.first) / run.rate_hz for run in runs)
    has = f", with {', '.join(one.effect.name for one in model.effects)}," if model.effects else ""
    return (f"{model.vehicle.name}{has} on {len(runs)} run{'s' * (len(runs) != 1)}, {seconds:.0f} s; "
            f"ridelog knows {len(bench.effects)} effects.")


def addition_words(question: LabQuestion, bench: Bench, found: LabDiagnosis) -> str:
    """The command that adds what is missing; nothing where nothing is, or all of it may only imitate."""
    if not found.missing or all(map(found.may_imitate, found.verdict)):
        return ""
    asked = "+".join(_asked(bench.files.get(one.effect.name, one.effect.name), one) for one in found.missing)
    names = "-".join(one.effect.name for one in found.missing)
    return "Next: " + question.command(f"add-effect {asked} {{}} --out with-{names}.yaml")


def _next(question: DiagnoseQuestion, bench: Bench, found: LabDiagnosis) -> str:
    if adding := addition_words(question, bench, found):
        return adding
    if found.beyond and not found.exceeds_noise:
        words = (f"Next: check {', '.join(found.beyond)} in the vehicle's file. This command fits them to the runs "
                 "alone:")
        return wrapped([words]) + "\n" + question.command(
            f"identify --free {','.join(found.beyond)} {{}}", in_lab=False)
    if found.unexplained:
        own = "".join(f" --effect-file {one}" for one in question.effect_files)
        return "Next: " + question.command(f"learn {{}}{own} --out law.py")
    return "Next: nothing. Runs that excite the effects listed as undetected would test the model further."


def _asked(name: str, one: Chosen) -> str:
    """An effect as add-effect takes it, which frees refinements only where their values are given."""
    values = ",".join(f"{each}={value:.3g}" for each, value in one.refined.items())
    return f"{name}:{values}" if values else name


# --- without a profile ---


def _diagnosed_same_road(question: DiagnoseQuestion) -> Diagnosis:
    """From two drives or more over one road that nobody measured: the road is random as ISO 8608 lets expect it, and
    its waves are found with the car (``logger.lab.unknown_road``)."""
    names = [str(one.path if isinstance(one, Run) else one) for one in each(question.runs)]
    if not 2 <= len(names) == len(set(names)):
        raise question.wrong("same_road", ": expected two runs or more, each once")
    model = model_of(question.vehicle)
    found = _diagnosed(model, records_of([_drive(one) for one in each(question.runs)]), question)
    most = None if question.list_all else SHOWN_ROWS
    return _shown(found, Blocks(same_road_blocks(found, names, most)), same_road_json(found), model.vehicle.name)


def _drive(given: Run | Path | str) -> tuple[drive_file.Drive, str]:
    """A drive and its name; a profile beside it is not read."""
    if isinstance(given, Run):
        return given, str(given.path)
    file = Path(given) / drive_file.DRIVE if Path(given).is_dir() else Path(given)
    return drive_file.read_drive(file), str(given)


def records_of(drives: Sequence[tuple[drive_file.Drive, str]]) -> list[Record]:
    """Drives and their names, checked together; on a flat road, for none is known. BadInput for fewer than two, or one
    that the others cannot be used with."""
    if len(drives) < 2:
        raise BadInput("expected two runs or more over one road, found one")
    flat = Track(1.0, np.zeros(2))
    for number, (drive, _) in enumerate(drives):
        check_record(drive, [one for one, _ in drives[:number]])
        check_distances(drive)
    by_receiver = any(one.facts.places_by == BY_RECEIVER for one, _ in drives)
    # Extracted without a profile, a drive's distance begins where it did.
    if all(_was_extracted(one) for one, _ in drives) and any(one.facts.places_by is None for one, _ in drives):
        drives, by_receiver = _on_one_distance(drives), True
    facts = replace(UNKNOWN, places_by=BY_RECEIVER) if by_receiver else UNKNOWN
    return thinned_runs([Record(name, one.rate_hz, one.accel_z_mps2, one.distance_m, one.speed_mps, flat, facts=facts)
                         for one, name in drives])


def _was_extracted(drive: drive_file.Drive) -> bool:
    """Whether a drive was extracted, and has positions."""
    return drive.facts.source is not None and drive.lat_deg is not None and bool(np.isfinite(drive.lat_deg).all())


def _on_one_distance(drives: Sequence[tuple[drive_file.Drive, str]]) -> list[tuple[drive_file.Drive, str]]:
    """The longest part of each drive in which the car moved, on the distance of the one that goes farthest, by the
    start that comes nearest to their positions: what these wander by, over a minute or so, is no motion, and ways by a
    receiver's speeds have no factor.

    BadInput for a drive that goes elsewhere.
    """
    driven = [(_longest_part(one), name) for one, name in drives]
    along, _ = max(driven, key=lambda pair: float(np.ptp(pair[0].distance_m)))
    metres = np.arange(along.distance_m[0], along.distance_m[-1], _PLACES_EVERY_M)
    line = MeasuredLine.of(metres, *(np.interp(metres, along.distance_m, one) for one in _places(along)))
    found = []
    for drive, name in driven:
        along_m, aside_m = line.passed(*_places(drive))
        near = (aside_m < SEARCH_M) & (along_m > metres[0]) & (along_m < metres[-1])
        if np.ptp(drive.distance_m[near]) < _LEAST_SHARED_M if near.any() else True:
            raise BadInput(f"{name}: expected a drive over the road of {along.path}, found that they share less than "
                           f"{_LEAST_SHARED_M:g} m")
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
    """Which effects the model lacks. BadInput for drives that are plainly over two roads."""
    off, given = tolerance_of(question.tolerance, model), model.given or model.vehicle
    word, notify = word_of(question.vehicle, model), question.progress
    for one in model.effects:
        if one.effect.obstacle(model.vehicle, two_tracks=False) is not None:
            raise BadInput(f"{word}: its effect {one.effect.name} needs a road that is known under the right wheels "
                           "too")
    effects, _ = known_effects(model, list(map(str, question.effect_files)))
    try:
        if by_receiver := any(one.facts.places_by == BY_RECEIVER for one in records):
            notify("aligning the drives by the road that they felt")
            records = placed_by_road(records, given, off, model.effects, model.vehicle)
        problem = SameRoad(records, given, off, model.vehicle, exact_places=not by_receiver)
        return diagnosis.diagnose_same_road(problem, among(effects, question.candidates), model.effects, notify)
    except NotOneRoad as error:
        raise BadInput(str(error)) from None
    except ValueError as error:
        raise BadInput(f"{word}: {error}") from None


P_VALUE = "p-value (probability that noise alone looks like any known effect):"
_SUSPECT = 0.1
"""An effect that noise looks like in fewer searches than this is worth a drive: a judgement."""


def diagnosis_summary(found: LabDiagnosis) -> list[str]:
    """What is missing, how certain that is, and what it could be instead: paragraphs. What was removed comes first
    where it is most of the residual, else after the errors."""
    removed = lab_words.removed_by_share(found.removed)
    lines = [*lab_words.force_words(None if FORCE_GAIN.name in found.verdict else found.force_gain),
             *lab_words.filter_words(found.removed, found.band), *(
        one.words for one in removed if one.share >= most_of(1.0))]
    if found.contradicted:
        lines.append(f"The runs contradict the vehicle's file in {enumerated(found.contradicted, 'and')}. The search "
                     "therefore treated its parameters as unknown, except those with a stated tolerance.")
    if found.not_searched:
        lines.append("The search was cut short, as it had simulated as much as it may. It did not try "
                     f"{enumerated(found.not_searched, 'or')}.")
    for one, group in zip(found.missing, groups(found), strict=True):
        lines += [_missing(found, one), *([_confusion(group, found)] if len(group) > 1 else [])]
    if not found.missing and not found.exceeds_noise:
        more = " else" * bool(found.removed.drifting_sensors or found.removed.distance_error_m > 0)
        moved = found.beyond or found.in_conflict
        what, how = ("No effect", "") if moved else (f"Nothing{more}", " within their tolerance")
        is_so = "needed" if found.in_conflict else "missing"
        most = "calibration errors of the sensors" if found.within_calibration else "the sensor's noise"
        lines.append(f"{what} is {is_so}: with the model's parameters refitted{how}, the residual is hardly more than "
                     f"{most}.")
    if found.coloured and not found.exceeds_noise:
        lines.append("The sensor's noise is coloured (louder at some frequencies). It is equally loud at small and at "
                     "large motion, so the motion does not cause it.")
    if found.exceeds_noise:
        lines.append(f"Something {'more ' * bool(found.missing)}is missing that no known effect explains: in the worst "
                     f"run the residual is {_left_over(found)}.")
        if found.contradicted_by:
            imitating = " and ".join(filter(found.may_imitate, found.verdict))
            though = f": if they are right, {imitating} may be an imitation" * bool(imitating)
            lines.append(f"It appears only in {enumerated(found.contradicted_by, 'and')}; the model explains the other "
                         f"signals down to their noise. Check that sensor's position, sign and filter{though}.")
        left = [one for one in found.candidates if one.p_value < FALSE_ALARM and one.effect.name not in found.verdict]
        lowering = [one.effect.name for one in left if one.error**2 < most_of(found.steps[-1].error**2)]
        if lowering:
            contradicted = "the other signals contradict it, or " * bool(found.signals)
            lines.append(f"ridelog does not name {lowering[0]}, though it lowers the NRMSE: {contradicted}its "
                         "parameters are beyond what the runs show.")
        elif left:
            lines.append(f"ridelog does not name an effect that gains less than {IMITATION:.0%} of what a full "
                         "explanation would gain: it may only imitate what is missing.")
    elif found.within_calibration:
        of_motion = "." if found.mostly_proportional else (
            ". But those grow in proportion to the motion, and most of this residual does not: something small may be "
            "missing.")
        lines.append(f"In the worst run the residual is {_left_over(found)}: calibration errors of the sensors may "
                     f"leave as much{of_motion}")
    lines += [f"{name} is {share:+.1%} off against all other signals, more than a calibration error: check its scale "
              "and its unit. The search for effects corrected it." if found.is_off(name) else
              f"{name} may be {share:+.1%} off against all other signals. What is missing may cause that as well: it "
              f"leaves {found.left_of(name):.1%} of the signal. The search for effects corrected it."
              for name, share in found.signals_off.items()]
    lines += _car(found)
    errors, *rises = lab_words.error_words(found.steps, found.noise_floor_error)
    lines += [f"{errors} {_explained_power(found)}", *rises, *(
        one.words for one in removed if one.share < most_of(1.0))]
    lines += signal_errors({name: (one.before, one.after, one.noise_floor) for name, one in found.signals.items()},
                           f"{{}} with {found.steps[0].words}, {{}} finally, noise floor about {{}}")
    lines += _faint(found)
    dropped = [name for name in (step.words.removeprefix("with ") for step in found.steps)
               if name in found.catalogue and name not in found.verdict]
    if dropped:
        why = ("the effects above explain the same" if found.verdict else
               "its parameter ended at a bound, or at the value where the effect vanishes")
        lines.append(f"Tried and dropped: {', '.join(dropped)} ({why}, or it explains little of what is left).")
    return lines


def _left_over(found: LabDiagnosis) -> str:
    worst = max(found.excess_of, key=found.excess_of.__getitem__, default="")
    of, power, floor = "the measured power", 1 - found.explained[1], found.noise_floor_error
    if found.exceeds_noise and worst in found.signals:
        of, power, floor = f"the power of {worst}", found.signals[worst].after**2, found.signals[worst].noise_floor
    return (f"{1 + max(found.excess, found.over_noise):.3g} times the sensor's noise. Beyond that noise it is "
            f"{percent(max(power - floor**2, 0.0))} of {of}")


def _explained_power(found: LabDiagnosis) -> str:
    refitted, last, most = (percent(one) if one < 0.995 else f"{one:.2%}"
                            for one in (*found.explained, found.best_linear or 0.0))
    ends = f", {last} finally" * (len(found.steps) > 2)
    linear = "" if found.best_linear is None else f" No linear model can explain more than {most}."
    return f"Share of the measured power explained: {refitted} with the parameters refitted{ends}.{linear}"


def looks_like(found: LabDiagnosis) -> list[str]:
    """What no candidate explains, described; nothing where no more than noise is left."""
    return [] if found.shape is None else lab_words.looks_like(found.shape)


def untested(found: LabDiagnosis) -> list[str]:
    """Effects that these runs cannot show, and which drive would."""
    lines = lab_words.not_tried(found.not_tried)
    lines += [f"{one.effect.name}: detectability {one.deviations:.1f} ({DETECTABLE_SIGMA:g} needed){_alike(one)}. "
              f"To see it: {one.effect.shown_by}."
              for one in found.undetectable[:SHOWN_ROWS]]
    if rest := [one.effect.name for one in found.undetectable[SHOWN_ROWS:]]:
        lines.append(f"Detectability too low as well: {', '.join(rest)}.")
    if found.undetectable:
        lines.append("Detectability: standard deviations by which an effect of usual strength would stand out.")
    return lines


def _car(found: LabDiagnosis) -> list[str]:
    """What the runs say of the car's own parameters: paragraphs."""
    lines = []
    if found.beyond:
        off = ", ".join(f"{name} by {share:+.0%} ({1 + share:.3g} times the file's)"
                        for name, share in found.beyond.items())
        either = (", or an unknown effect is missing" if found.exceeds_noise or found.is_doubtful else
                  "" if found.missing else ", or an effect is missing that acts as such a change does")
        lines.append(f"Parameters beyond their tolerance: {off}. Measure them: {'either ' * bool(either)}the vehicle's "
                     f"file is wrong there{either}.")
        lines += [f"Masses and forces are known only against each other: forces that count {one.one.p.gain:.3g} times "
                  "what they say would explain as much. Weigh what moves, or calibrate the force."
                  for one in found.candidates if one.effect.name == FORCE_GAIN.name and one.p_value < FALSE_ALARM
                  and one.effect.name not in found.verdict
                  and one.error < (1 + UNEXPLAINED) * found.steps[-1].error]
    if found.moved:
        lines.append(_moved(found))
    if found.as_moved is not None:
        one = found.as_moved
        lines.append(f"{one.effect.name} ({one.effect.title}; {numbers_of(one)}) would bias all of them in this way. "
                     f"To find out: {one.effect.shown_by}.")
    if found.left_open:
        fitted = enumerated([f"{name} {measured(value, error)} {unit_of(name)}".rstrip()
                             for name, (value, error) in found.left_open.items()], "and")
        farther = " What is missing may have moved them farther than these errors say." * found.exceeds_noise
        lines.append(f"Fitted parameters that the vehicle's file leaves open: {fitted}.{farther}")
    return lines


def _moved(found: LabDiagnosis) -> str:
    """What the runs say of the car's numbers, the farthest first."""
    shown = some([f"{name} by {share:+.1%} ± {error:.1%}" for name, (share, error) in found.moved.items()])
    relative = "" if found.shows_forces else (
        " (Masses, springs and dampers are known only relative to each other: no run shows their common scale.)")
    return (f"The refit moved parameters of the vehicle's file: {shown}.{relative} Measure one of "
            "them and enter it in the file: an effect with the same influence would then show.")


def _alike(one: Undetectable) -> str:
    """What of the car hides an effect."""
    return f"; {one.alike} does nearly the same within its tolerance" if one.alike else ""


def groups(found: LabDiagnosis) -> list[list[str]]:
    """Each effect of the verdict with those that explain as well in its place, the likeliest first."""
    return [[name, *found.candidate(name).confused_with] for name in found.verdict]


def _missing(found: LabDiagnosis, one: Chosen) -> str:
    name, numbers = one.effect.name, f": {numbers_of(one)}" if one.values else ""
    candidate = found.candidate(name)
    likely = f"{P_VALUE} {chance(candidate.p_value)}."
    alike = [other for other in found.verdict if found.ends.get(other) == found.ends.get(name)]
    if name in found.ends and name == alike[-1]:  # said once of effects with the same counts
        there, count = found.ends[name]
        likely += f" The model's parameters were unknown; {there} of {count} starting points led to this result."
    says = "explains part of the residual, or imitates something else" if found.may_imitate(name) else "is missing"
    if candidate.confused_with:
        names = [name, *candidate.confused_with]
        group = f"Either {enumerated(names, 'or')}" if len(names) == 2 else f"One of {enumerated(names, 'and')}"
        return (f"{group} {says}; these runs cannot distinguish them. If it is {name} ({one.effect.title})"
                f"{numbers}. {likely}")
    return f"{name} {says} ({one.effect.title}){numbers}. {likely}"


def _faint(found: LabDiagnosis) -> list[str]:
    """What comes nearest to being named, where it is likelier than not to be more than noise."""
    others = [one for one in found.candidates if one.effect.name not in found.verdict]
    nearest = min(others, key=lambda one: one.p_value, default=None)
    if found.unexplained or nearest is None or not FALSE_ALARM <= nearest.p_value < _SUSPECT:
        return []
    return [f"{nearest.effect.name} just misses the threshold: in {percent(nearest.p_value)} of such searches noise "
            f"alone looks like it; ridelog allows {percent(FALSE_ALARM)}. To find out: {nearest.effect.shown_by}."]


def _confusion(names: list[str], found: LabDiagnosis) -> str:
    """Which drive would separate effects that explain alike."""
    drives = [f"{name}: {found.catalogue[name].shown_by}" for name in names]
    alike = {found.catalogue[name].shown_by for name in names}
    would = "; ".join(drives if len(alike) > 1 else alike)
    return (f"{enumerated(names, 'and')} explain the residual about equally well. To distinguish them: {would}. "
            "ridelog plan predicts whether that would succeed.")


def table(found: LabDiagnosis | UnknownRoadDiagnosis) -> Iterator[tuple[str, str, str, str]]:
    """The candidates, best first: name, error, chance, numbers."""
    by_name = {one.effect.name: one for one in found.missing}
    for one in found.candidates:
        name = one.effect.name
        words = [numbers_of(by_name.get(name, one.one)), "" if one.fitted else "not fitted"]
        yield name, f"{one.error:.3f}", chance(one.p_value), ", ".join(filter(None, words))


# --- for a program ---


def diagnosis_json(found: LabDiagnosis) -> dict[str, Any]:
    """The diagnosis as one JSON object."""
    return {
        **_common_json(found), "residual_over_noise": 1 + max(found.excess, found.over_noise),
        "judged_on": JUDGED_ON, "groups": groups(found),
        "starts": {name: {"ended_there": there, "of": count} for name, (there, count) in found.ends.items()},
        "contradicted": list(found.contradicted), "not_searched": list(found.not_searched),
        "beyond_tolerance": dict(found.beyond),
        "parameter_shifts": {name: {"share": share, "standard_error": error}
                          for name, (share, error) in found.moved.items()},
        "fitted_parameters": {name: {"value": value, "standard_error": error}
                              for name, (value, error) in found.left_open.items()},
        "shift_explained_by": None if found.as_moved is None else {
            "effect": found.as_moved.effect.name, "parameters": dict(found.as_moved.values)},
        "signals": {name: {"baseline_error": one.before, "final_error": one.after, "noise_floor_error": one.noise_floor}
                    for name, one in found.signals.items()},
        **{key: {name: share for name, share in found.signals_off.items() if found.is_off(name) is sure}
           for key, sure in (("signals_in_conflict", True), ("signals_perhaps_in_conflict", False))},
        "contradicted_by": list(found.contradicted_by),
        "force_gain": found.force_gain,
        "explained_power": {"refitted": found.explained[0], "final": found.explained[1],
                            "best_linear": found.best_linear},
        "tolerance": found.tolerance, "coloured_noise": found.coloured,
        "not_tried": found.not_tried,
        "undetectable": {one.effect.name: one.deviations for one in found.undetectable},
        "unexplained_shape": None if found.shape is None else _shape_json(found.shape),
        **lab_words.band_json(found.band), **lab_words.removed_json(found.removed),
        "sentences": [*diagnosis_summary(found), *looks_like(found)],
    }


def _common_json(found: LabDiagnosis | UnknownRoadDiagnosis) -> dict[str, Any]:
    """What both kinds of roads have in common."""
    errors = {one.effect.name: finite(one.standard_errors) for one in found.missing}
    return {
        "baseline_error": found.baseline_error, "noise_floor_error": found.noise_floor_error,
        "candidates": [
            {"effect": one.effect.name, "parameters": dict(one.one.values), "error": one.error, "p_value": one.p_value,
             "confused_with": list(one.confused_with), "fitted": one.fitted,
             "standard_errors": errors.get(one.effect.name, {}), "log_likelihood_gain": one.gain / 2,
             "held_out_log_likelihood_gain": None if one.held_out_gain is None else one.held_out_gain / 2}
            for one in found.candidates],
        "verdict": list(found.verdict), "unexplained": found.unexplained, "residual_over_noise": 1 + found.excess,
        "no_better_than_refitted": list(found.no_better),
        **lab_words.errors_json(found.steps, found.noise_floor_error),
    }


def _shape_json(shape: Shape) -> dict[str, Any]:
    forces, line = shape.tests.forces, shape.line
    return {
        "sentences": lab_words.looks_like(shape),
        "force_by_rate": {"rate_mps": forces.by_rate.at.tolist(), "force_n": forces.by_rate.force_n.tolist(),
                          "standard_error_n": forces.by_rate.error_n.tolist(), "share": forces.by_rate.share},
        "force_by_travel": {"travel_m": forces.by_travel.at.tolist(), "force_n": forces.by_travel.force_n.tolist(),
                            "standard_error_n": forces.by_travel.error_n.tolist(), "share": forces.by_travel.share},
        "frequency": [{"from_hz": part.low, "to_hz": part.high, "error_power_share": part.share, "name": part.name}
                      for part in shape.where.frequency],
        "repeats_every_m": 1 / line.at_per_m if line is not None and line.found and not line.steady else None,
    }


def diagnosis_blocks(found: LabDiagnosis, most: int | None) -> Iterator[Block]:
    """What a person reads of a diagnosis; at a terminal ``most`` so many candidates, None: all."""
    yield _tiles(found)
    yield from diagnosis_summary(found)
    yield from bench_sections(None if found.car is None else found.car.on_bench, found.steps[0])
    yield lab_words.removed_section(found.removed, found.band)
    yield from shape_sections(found)
    yield lab_words.steps_section(found.steps, found.noise_floor_error)
    yield from car_sections(found)
    yield Section(_ONE_BY_ONE, [
        Bars("NRMSE with each effect", "NRMSE", tuple(
            (one.effect.name, one.error) for one in found.candidates[:_MOST_BARS]),
            (found.baseline_error, "before any fit")),
        *_table(found, most)])
    yield Section("What these runs cannot tell", [Bullets(untested(found))])
    yield Detail("Sources", [Bullets([f"{one.effect.name}: {one.effect.source}" for one in found.missing])])


_ONE_BY_ONE = "One effect at a time on the refitted model; p-values account for all of them"
_LEAST_SHARE, _MOST_BARS = 0.01, 12
_MOTION_UNITS = {RATE: "m/s", TRAVEL: "m"}


def _table(found: LabDiagnosis | UnknownRoadDiagnosis, most: int | None) -> Iterator[Block]:
    yield Table(("Effect", "NRMSE", "p-value", "Parameters"), list(table(found)), (0, 3), most, " (--json lists all)")
    if found.no_better:
        yield f"No better than the refit alone: {', '.join(found.no_better)}."


def shape_sections(found: LabDiagnosis) -> list[Section]:
    """What no candidate explains: sentences and pictures; nothing where nothing is unexplained."""
    if found.shape is None:
        return []
    forces = found.shape.tests.forces
    elsewhere = Detail("The missing force", [
        "No force of a spring or damper, by travel or velocity, would explain it: it comes from elsewhere."])
    return [Section("What no effect explains", [Bullets(looks_like(found))]), _where(found.shape),
            Detail("By frequency", spectra(found.shape.residuals)),
            elsewhere if max(forces.by_rate.share, forces.by_travel.share) < _LEAST_SHARE else forces_section(forces)]


def _tiles(found: LabDiagnosis) -> doc.Html:
    missing = len(found.verdict)
    count = "nothing" if not missing else f"{missing} effect{'s' * (missing != 1)}"
    unknown = "something unknown" if not missing else f"{count}, and more"
    return doc.tiles([
        ("Missing", unknown if found.exceeds_noise or (found.unexplained and not missing) else count, ""),
        ("NRMSE before any fit", f"{found.baseline_error:.3f}", ""),
        ("NRMSE with the missing effects" if missing else "NRMSE refitted", f"{found.steps[-1].error:.3f}", JUDGED_ON),
        *lab_words.drift_tile(found.removed),
        ("Noise floor", f"{found.noise_floor_error:.3f}", "NRMSE"),
    ])


def car_sections(found: LabDiagnosis) -> list[Section]:
    """How far the car's numbers moved, as bars, and the forces of its springs and dampers as fitted, as curves."""
    if found.car is None:
        return []
    bars = Bars("Shift of each parameter by the refit", "% of the file's value", tuple(
        (name, 100 * share) for name, (share, _) in found.car.moved.items()))
    rows = [(name, f"{share:+.1%}", f"± {deviation:.1%}" if deviation <= 1 else "unknown",
             "beyond its tolerance" if name in found.beyond else "")
            for name, (share, deviation) in found.car.moved.items()]
    return [
        Detail("The model's parameters", [bars, Table(
            ("Parameter", "Shift", "Known to (standard deviation)", ""), rows, (0, 3)), Hint(
            "A parameter that moves far may stand in for an effect that ridelog does not know.")] if rows else []),
        *([Detail("Springs and dampers", [*(_force(one, found.steps[0].words) for one in found.car.curves), Hint(
            "Over the range that the model's suspensions reach in 99.9 % of these runs, without forces that have a "
            "memory.")])] if found.car.on_bench is None else [])]


def bench_sections(part: BenchForces | None, filed: ErrorStep) -> list[Section]:
    """What every bench draws of a part: its force over the velocity and over the travel, sample by sample; ``filed``:
    the part before any fit."""
    if part is None:
        return []
    few = -(-len(part.travel_m) // MOST_DOTS)
    forces = {"measured": part.measured_n, filed.words: part.before_n, "refitted": part.after_n}
    if not filed.error < 1:  # a file of unknown numbers is farther off than no force at all
        del forces[filed.words]
    return [Section("Force by velocity and by travel", [
        Curves(f"Force by {name}", f"{name} [{unit}], positive in extension", "force [N]", tuple(
            # Fewer of the model, so that both are seen.
            Line(words, at[:: (step := few if words == "measured" else 3 * few)], force_n[::step], dots=True)
            for words, force_n in forces.items()))
        for name, unit, at in (("velocity", "m/s", part.rate_mps), ("travel", "mm", 1000 * part.travel_m))])]


def _force(one: ForceCurve, filed: str) -> Curves:
    return Curves(
        f"{one.axle.capitalize()} suspension: force by {one.motion}",
        f"{one.motion} [{_MOTION_UNITS[one.motion]}], positive in extension", "force [N]",
        (Line("refitted", one.at, one.after_n), Line(filed, one.at, one.before_n)))


def _where(shape: Shape) -> Detail:
    """By frequency, and along the way."""
    rows = [(part.name, f"{part.low:.3g} to {part.high:.3g}", f"{part.share:.1%}", fixed(part.error, 2, "-"))
            for part in shape.where.frequency]
    drawn: list[Block] = [Table(("Band", "From, to [Hz]", "Share of the residual", "NRMSE"), rows)]
    if shape.line is not None and shape.line.found:
        drawn.append(Curves(f"What repeats along the road, in {shape.line.run}", "spatial frequency [1/m]",
                            "power over its mean [1]", (Line("residual", shape.line.per_m, shape.line.power),)))
    return Detail("By band" + " and distance" * (len(drawn) > 1), drawn)


def same_road_summary(found: UnknownRoadDiagnosis) -> list[str]:
    """What is missing, how certain that is, and what it could be instead: paragraphs."""
    lines = []
    for one in found.missing:
        candidate = next(other for other in found.candidates if other.effect == one.effect)
        numbers = f": {numbers_of(one)}" if one.values else ""
        lines.append(f"{one.effect.name} is missing ({one.effect.title}){numbers}. {P_VALUE} "
                     f"{chance(candidate.p_value)}.")
        if candidate.confused_with:
            names = enumerated([one.effect.name, *candidate.confused_with], "and")
            lines.append(f"{names} explain the residual about equally well; these drives cannot distinguish them.")
        if candidate.stands_in:
            lines.append(f"{one.effect.name} is nonlinear. The search linearised it for each drive and stretch of "
                         "road; its parameters are only as accurate as that.")
    if found.undecided:
        names, them = enumerated([one.effect.name for one in found.undecided], "or"), len(found.undecided) > 1
        lines.append(f"Undecided: {names}. {'They explain' if them else 'It explains'} more than noise would, but less "
                     "than a tenth of the residual that no road explains, and may only imitate something else that is "
                     "missing.")
    elif not lines:
        lines.append("None of the effects that can be tried without a profile is missing.")
    lines += lab_words.error_words(found.steps, found.noise_floor_error,
                                   "of each drive over the road estimated from the others")
    if found.unexplained:
        cause = ("Something else is missing, perhaps" if found.exact_places else
                 "Either the GPS distances of these drives drift within seconds, or something else is missing, perhaps")
        lines.append(f"The residual that no road explains is {1 + found.excess:.2f} times the sensor's noise. {cause} "
                     "one of the effects that only a measured road can show.")
    return lines


def cannot_tell(found: UnknownRoadDiagnosis) -> list[str]:
    """What these drives cannot show or identify, in sentences."""
    lines = [f"Whether {one} and {other} are over one road: where they overlap, their records hardly exceed "
             "the noise." for one, other in found.doubtful]
    if found.absorbed_by_road:
        lines.append(f"{', '.join(found.absorbed_by_road)}: not tried; without a profile, another road would look "
                     "the same.")
    lines += lab_words.not_tried(found.untried)
    lines += [f"{name}: detectability {deviations:.1f} ({DETECTABLE_SIGMA:g} needed)."
              for name, deviations in found.hidden.items()]
    return [*lines, *(f"The model's parameters: {one.words}" for one in found.confounded)]


def same_road_blocks(found: UnknownRoadDiagnosis, runs: Sequence[str], most: int | None) -> Iterator[Block]:
    """What a person reads; at a terminal ``most`` so many candidates, None: all."""
    yield from same_road_summary(found)
    yield lab_words.steps_section(found.steps, found.noise_floor_error)
    yield Section(_ONE_BY_ONE, list(_table(found, most)))
    yield Table(("Run", "NRMSE before", "after"), [
        (name, f"{before:.3f}", f"{after:.3f}") for name, (before, after) in zip(runs, found.by_run, strict=True)])
    yield Section("What these drives cannot tell", [Bullets(cannot_tell(found))])


def same_road_json(found: UnknownRoadDiagnosis) -> dict[str, Any]:
    """The diagnosis as one JSON object."""
    return {
        **_common_json(found),
        "runs": [{"error_before": before, "error_after": after} for before, after in found.by_run],
        "undecided": [one.effect.name for one in found.undecided],
        "maybe_over_two_roads": [list(pair) for pair in found.doubtful],
        "not_tried": dict(found.untried), "taken_by_road": dict(found.absorbed_by_road),
        "undetectable": dict(found.hidden),
        "sentences": [*same_road_summary(found), *cannot_tell(found)],
    }
