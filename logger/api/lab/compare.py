"""Model against measurement, and what an effect that is added changes: answers, words, JSON and pages.

``Comparison`` and ``AddedEffect`` are what Python gets. A page opens with no network and runs no script.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from logger.api.inputs import Model, model_of
from logger.api.lab import words as lab_words
from logger.api.lab.bench import Bench, bench_with, slow_words
from logger.api.lab.question import AddEffectQuestion, CompareQuestion, LabQuestion
from logger.api.shared_fields import named_numbers
from logger.api.shown import CommandResult
from logger.bounds import SURE_SIGMA
from logger.chart_data import Array, Chart, Curves, Line, line
from logger.errors import BadInput
from logger.identification.noise_models import rms
from logger.lab.another_car import POOR_ERROR
from logger.lab.compare import LabComparison, Standing
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.residuals.breakdown import ModelResiduals, Part, frequencies, segments
from logger.lab.residuals.force_state_map import Curve, ForceMap
from logger.lab.selection.add_effect import AddedEffects, ShiftedNumber
from logger.lab.selection.holdout import AS_GUESSED, JUDGED_ON, fit_percent
from logger.left_out import left_out_json, left_out_lines
from logger.printable import counted
from logger.question import function
from logger.report import document as doc
from logger.report.blocks import SHOWN_ROWS, Block, Blocks, Bullets, Detail, Hint, Linked, Section, Table, page
from logger.report.quantities import (
    FEW,
    chance,
    enumerated,
    finite,
    fixed,
    known,
    numbers_of,
    signal_errors,
    some,
    unit_of,
)
from logger.runs import Run, are_on_rig, normalised_rms_error, runs_left_out, short_names
from logger.store.formats import vehicle_file
from logger.vehicle.effect import Chosen, Effect


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(CommandResult):
    """A model compared with its measurements. Errors are rms(measured - model) / rms(measured), the first 2 s of each
    run left out.

    found            all that the lab found
    error            as the model stands
    refitted_error   with its numbers and the distances refitted within their tolerance
    run_errors       by name of the run, as the model stands
    evidence         sentences
    missing          whether the residual depends on the road and the car's motion
    shifts           by which share each number moved for the refit; ``shifted_far``: those that moved farther than
                     their tolerance
    """

    found: LabComparison
    error: float
    refitted_error: float
    run_errors: Mapping[str, float]
    evidence: tuple[str, ...]
    missing: bool
    shifts: Mapping[str, float]
    shifted_far: tuple[str, ...]

    def charts(self) -> Sequence[Chart]:
        """Spectra of measurement, model and residual after the refit."""
        return spectra(self.found.refitted.residuals)

    def as_page(self, of: str) -> doc.Html:
        """The comparison as one HTML document."""
        return page(f"{self.found.vehicle}: model and measurement", of, self.blocks())


@function(CompareQuestion)
def compare(question: CompareQuestion) -> Comparison:
    return comparison_of(bench_with(question, thin=False).compared())  # an error is that of all samples


def comparison_of(found: LabComparison) -> Comparison:
    """What the lab found, as it is shown."""
    summary = comparison_json(found)
    return Comparison(Blocks(comparison_blocks(found)), summary, found, found.plain.error, found.steps[-1].error,
                      {one["run"]: one["error"] for one in summary["runs"]}, tuple(summary["evidence"]), found.missing,
                      found.moves, found.far)


@dataclass(frozen=True, eq=False, repr=False)
class AddedEffect(lab_words.ModelByModel):
    """A model with one more effect, fitted to all runs together with the car's parameters.

    found               all that the lab found
    effect              its name, ``parameters`` and ``standard_errors`` by name; of several added together "A+B", with
                        numbers by "A.number"
    error_before        of the model as it was; ``error_refitted`` of it with its numbers and the distances refitted
    error_after         of the model with the effect, refitted likewise
    p_value             how often noise alone would improve the fit as much
    helps               whether that is improbable, and the error on what no fit saw does not rise
    numbers             of the car, those that the effect moved most first
    model               with the effect
    """

    found: AddedEffects
    effect: str
    parameters: Mapping[str, float]
    standard_errors: Mapping[str, float]
    error_before: float
    error_refitted: float
    error_after: float
    p_value: float
    helps: bool
    numbers: tuple[ShiftedNumber, ...]
    model: Model

    def write(self, path: Path, option: str = "--out") -> None:
        """Write the new vehicle file."""
        vehicle_file.write_model(path, self.model)
        self._json["vehicle"] = str(path)


@function(AddEffectQuestion)
def add_effect(question: AddEffectQuestion) -> AddedEffect:
    bench, starts, candidates, near = bench_with(question), list[Chosen](), 1, None
    for effect, file, values in _all_asked_for(bench, question):
        bench = bench.with_effect(effect, file)
        candidates *= 1 if set(values) >= {one.name for one in effect.parameters} else len(effect.trials())
        begin, near = bench.beside(starts).search_values(effect, values, question.progress)
        starts.append(begin)
    found = bench.added(starts, candidates, question.progress, near)
    return addition_of(found, model_of(bench.model_with(found)))


def _all_asked_for(bench: Bench, question: AddEffectQuestion) -> list[tuple[Effect, str | None, dict[str, float]]]:
    """As ``asked_for``, of each effect, with those of the numbers where the fit begins that are its own. BadInput, too,
    where an effect is there twice or a number is of none."""
    found, start = list[tuple[Effect, str | None, dict[str, float]]](), dict(question.start or {})
    for text in question.names:
        effect, file, values = asked_for(text, bench, question, start, others=len(question.names) > 1)
        if effect.name in [one.name for one, _, _ in found]:
            raise BadInput(f"add-effect {question.name}: expected each effect once, found {effect.name} again")
        found.append((effect, file, values))
    known = {parameter.name for effect, _, _ in found for parameter in effect.parameters}
    for name in start:
        if name not in known:
            raise BadInput(f"{question.name}: none of these effects has a parameter {name!r}; expected "
                           f"{', '.join(sorted(known)) or 'no parameters'}")
    return found


def asked_for(text: str, bench: Bench, question: AddEffectQuestion | LabQuestion,
              start: Mapping[str, float] | None = None, others: bool = False
              ) -> tuple[Effect, str | None, dict[str, float]]:
    """An effect as it was asked for, the file it is from, and what was said of its numbers. BadInput as
    ``Bench.asked_for``.

    start   numbers where its fit begins; where there are ``others``, those that it does not have are theirs
    """
    name, values = named_numbers(text, "add-effect")
    own = {one.name for one in bench.named(name)[0].parameters}
    values |= {key: value for key, value in (start or {}).items() if key in own or not others}
    effect, file = bench.asked_for(name, values, text)
    if words := slow_words([effect]):
        question.warn(words)
    return effect, file, values


def addition_of(found: AddedEffects, model: Model) -> AddedEffect:
    """What the lab found, as it is shown; the model with it."""
    return AddedEffect(
        Blocks(addition_blocks(found)), addition_json(found), found.steps, found.noise_floor_error, found,
        *_as_one(found.new), found.error_before, found.error_refitted, found.error_after, found.p_value, found.helps,
        tuple(found.moved), model)


_HELPS = 0.97


def headline(found: LabComparison) -> list[str]:
    """How well the model does, with its numbers as they stand and refitted."""
    plain, refitted = found.plain, found.refitted
    residual, measured = (rms(one) for one in (plain.residuals.residual, plain.residuals.measured))
    unit = plain.residuals.unit
    lines = [f"NRMSE {plain.error:.3f} (residual {residual:.3g} over measured {measured:.3g} {unit} r.m.s.)."]
    parts = ["masses", "springs", "dampers", *["distances"] * (not are_on_rig(plain.residuals.runs))]
    refit = f"A refit of {enumerated(parts, 'and')} within their tolerance"
    if any(one.effect.parameters for one in found.effects):
        refit += ", and of the effects' parameters,"
    before, after = (one.error for one in found.steps)
    if after < _HELPS * before:
        lines.append(f"{refit} lowers it to {after:.3f} and removes {1 - (after / before)**2:.0%} of the residual's "
                     "power.")
    else:
        cause = ": small errors in the parameters are not the cause" * (before > (1 + UNEXPLAINED) * found.floor)
        lines.append(f"{refit} {'raises it to' if after > before / _HELPS else 'leaves it at'} {after:.3f}{cause}.")
    # What a model lacks is in its residual, and so in the noise that is estimated from that.
    lines += lab_words.error_words(found.steps, found.floor, about="at most" if found.missing else "about")
    lines += signal_errors({name: (error, refitted.signals[name]) for name, error in plain.signals.items()},
                           "{}, refitted {}")
    lines += lab_words.removed_words(found.removed, found.band)
    lines += lab_words.force_words(found.force_gain)
    if found.repeats is not None:
        apart = found.repeats.deviation_mps2
        lines.append(f"{' and '.join(found.repeats.names)} are repeats and differ by {apart:.2g} {unit} r.m.s. from "
                     f"their mean: no model can reach an NRMSE below {apart / measured:.2g} on them.")
    if found.far:
        named = some([f"{name} by {found.moves[name]:+.0%}" for name in found.far])
        lines.append(f"The refit moved parameters beyond their tolerance: {named}. Measure them: either the vehicle's "
                     "file is wrong there, or an effect that the model lacks biases them.")
    return lines


def evidence(found: LabComparison) -> list[str]:
    """What speaks for a missing effect, or against one."""
    if not found.exceeds_discrepancy:
        return ["The residual is smaller than the difference between two correct simulations of one car, so it is no "
                "evidence."]
    if not found.tests_found:
        return ["No test finds more than noise in the residual."]
    return [test.sentence for test in found.tests_found]


def conclusion(found: LabComparison) -> str:
    """The answer: whether the model lacks something."""
    on_rig = are_on_rig(found.refitted.residuals.runs)
    if _explains_nothing(found):
        which, even = (("model", ", even with its parameters refitted") if found.plain.error > POOR_ERROR
                       else ("refitted model", ""))
        return (f"The {which} explains next to nothing of what was measured{even}. Do both files of the run belong "
                "together? Are signs and units right? If they are, something large is missing.")
    if found.missing and not any(test.road for test in found.tests_found):
        return ("The model fits, but only with parameters far from those of the vehicle's file. Either the file is "
                "wrong, or these parameters imitate a missing effect.")
    if found.missing:
        return ("The model lacks something: after a refit, the residual (measured - model) still depends on "
                + ("the excitation and on the rig's motion." if on_rig else "the road and the car's motion."))
    if _is_coloured(found):
        if on_rig:
            return ("No test finds that the residual (measured - model) depends on the rig's motion, but it is no "
                    "white noise: either the sensor's noise is coloured, or the model lacks what these tests do not "
                    "see.")
        return ("The model lacks no effect of the car. The residual (measured - model) does not depend on the road; it "
                "looks like coloured noise of the sensor or the engine.")
    if found.unexplained_signals:
        return ("The model lacks nothing that the first signal shows, but after a refit it leaves more than noise of "
                f"{enumerated(found.unexplained_signals, 'and')}. Check position, sign and filter there; if they are "
                "right, something is missing.")
    removed = found.removed.drifting_sensors or found.removed.distance_error_m > 0
    beside = " apart from what was removed (shown below)" * bool(removed)
    return f"The model lacks nothing{beside}: after a refit, the residual (measured - model) is no more than noise."


def _is_coloured(found: LabComparison) -> bool:
    """Whether the residual is no white noise, by a test that is not of where the runs lie."""
    return any(not test.test.of_placement for test in found.tests_found)


def _explains_nothing(found: LabComparison) -> bool:
    """Whether the refitted model explains less of what is no noise than ``POOR_ERROR`` has it."""
    noise = min(found.floor, 1.0) ** 2
    return found.refitted.error**2 - noise > POOR_ERROR**2 * (1 - noise)


def next_step(found: LabComparison) -> str:
    """What to do now."""
    if _explains_nothing(found):
        return "Next: check the run's columns, signs and units; then ridelog diagnose with the same arguments."
    if not found.missing:
        on_rig = are_on_rig(found.refitted.residuals.runs)
        if (on_rig and _is_coloured(found)) or found.unexplained_signals:
            return "Next: ridelog diagnose with the same arguments tries every known effect."
        harder = "Stronger motion or other frequencies" if on_rig else "Rougher roads or other speeds"
        return f"Next: nothing. {harder} would be a stronger test."
    if any(test.road for test in found.tests_found):
        return "Next: ridelog diagnose with the same arguments finds the physical effect that explains the residual."
    return (f"Next: ridelog diagnose with the same arguments. If it finds nothing, ridelog identify --free "
            f"{','.join(found.far)} with them fits these parameters to the runs alone.")


# --- for a program ---


def comparison_json(found: LabComparison) -> dict[str, Any]:
    """The comparison as one JSON object; error and where are of the model as it stands."""
    return {
        **_standing_json(found.plain), **left_out_json(runs_left_out(found.plain.residuals.runs)),
        "evidence": [conclusion(found), *headline(found), *evidence(found), next_step(found)],
        "missing": found.missing, **lab_words.band_json(found.band), **lab_words.removed_json(found.removed),
        **lab_words.errors_json(found.steps, found.floor),
        "refitted": {**_standing_json(found.refitted), "error": found.steps[-1].error,
                     "shifts": dict(found.moves), "shifted_far": list(found.far)},
        "force_gain": found.force_gain, "signals_unexplained": list(found.unexplained_signals),
        "repeats": None if found.repeats is None else {
            "runs": list(found.repeats.names), "deviation_mps2": found.repeats.deviation_mps2},
        "residual_tests": [
            {"name": test.name, "found": test in found.tests_found, "value": known(test.value), "unit": test.unit,
             "standard_error": known(test.standard_error), "p_value": known(test.p_value)}
            for test in found.tests.tests],
    }


def _standing_json(standing: Standing) -> dict[str, Any]:
    residuals, where = standing.residuals, standing.where
    return {
        "error": standing.error, "signals": dict(standing.signals),
        "runs": [{"run": run.name, "error": known(normalised_rms_error([run], [prediction])),
                  "samples": run.count - run.first}
                 for run, prediction in zip(residuals.runs, residuals.predictions, strict=True)],
        "where": {
            "frequency": [{**_part_json(part, "hz"), "name": part.name} for part in where.frequency],
            "speed": [_part_json(part, "mps") for part in where.speed],
            "amplitude": [_part_json(part, "mps2") for part in where.amplitude],
            "place": [{**_part_json(part, "m"), "run": part.name}
                      for part in sorted(where.place, key=lambda part: -part.share)],
        },
    }


def _part_json(part: Part, unit: str) -> dict[str, Any]:
    return {f"from_{unit}": part.low, f"to_{unit}": part.high, "error": known(part.error),
            "error_power_share": part.share}


_BODY_HZ = 5.0
_QUIET_DB = -80.0


def judged(found: LabComparison) -> list[Block]:
    """Whether the model lacks something, how well it does, and what speaks for that."""
    return [conclusion(found), *headline(found), Section("After the refit", [Bullets(evidence(found))])]


def comparison_blocks(found: LabComparison) -> Iterator[Block]:
    """What a person reads of a comparison."""
    residuals = found.refitted.residuals
    seconds = sum(map(len, residuals.residual)) / residuals.rate_hz
    yield _tiles(found)
    yield from judged(found)
    yield next_step(found)
    yield lab_words.removed_section(found.removed, found.band)
    yield _whole_drives(residuals)
    worst = worst_moment(found.refitted)
    yield Detail("The worst place", [moment_chart(worst.words, residuals, worst, {
        "measured": residuals.measured, "residual": residuals.residual, "model": residuals.model})])
    yield Detail("By frequency", spectra(residuals))
    yield from _by_part(found)
    yield _places(found.refitted)
    yield forces_section(found.tests.forces)
    if not are_on_rig(residuals.runs):
        yield _alignment(found)
    yield _tests(found)
    yield _numbers(found)
    yield Hint(f"{found.vehicle} on {counted(len(residuals.runs), 'run')}, {seconds:.0f} s.")
    yield from map(Hint, left_out_lines(runs_left_out(residuals.runs)))


def _tiles(found: LabComparison) -> doc.Html:
    residuals = found.plain.residuals
    return doc.tiles([("NRMSE before any fit", f"{found.plain.error:.3f}", ""),
                      ("NRMSE refitted", f"{found.steps[-1].error:.3f}", JUDGED_ON),
                      *lab_words.drift_tile(found.removed),
                      ("Residual tests that find something", f"{len(found.tests_found)}",
                       f"of {len(found.tests.tests)}"),
                      ("Runs",
                       f"{len(residuals.runs)}", f"{sum(map(len, residuals.residual)) / residuals.rate_hz:.0f} s")])


# --- pictures ---


def _axis(run: Run) -> str:
    """What a run measured, with its unit."""
    return f"{run.facts.main.measures} [{run.facts.main.unit}]"


def _whole_drives(residuals: ModelResiduals) -> Detail:
    """What was measured and what the model leaves of it, over the whole of each run."""
    names, drawn = short_names(residuals.runs), []
    for index, run in enumerate(residuals.runs[:SHOWN_ROWS]):
        time_s = (run.first + np.arange(len(residuals.residual[index]))) / residuals.rate_hz
        lines = tuple(line(word, time_s, values[index]) for word, values in (
            ("measured", residuals.measured), ("residual", residuals.residual)))
        drawn.append(Curves(names[run.name], "time [s]", _axis(run), lines))
    return Detail("Each run", drawn)


def moment_chart(title: str, residuals: ModelResiduals, at: "Moment", signals: Mapping[str, Sequence[Array]]) -> Curves:
    """Signals of the runs, by name and (n,) each, at a moment."""
    run = residuals.runs[at.run]
    time_s = (run.first + np.arange(len(residuals.residual[at.run])))[at.part] / residuals.rate_hz
    return Curves(title, "time [s]", _axis(run), tuple(
        Line(name, time_s, values[at.run][at.part]) for name, values in signals.items()))


def decibels(residuals: ModelResiduals, signals: Sequence[Array]) -> Array:
    """Power spectral density of a signal of the runs, (n,) each, at ``frequencies`` [dB re 1 unit2/Hz]."""
    density = np.mean(np.abs(segments(residuals, signals)) ** 2, axis=0) / frequencies(residuals)[1]
    return np.asarray(np.maximum(10 * np.log10(np.maximum(density, 1e-30)), _QUIET_DB))


def spectra(residuals: ModelResiduals) -> tuple[Curves, Curves]:
    """The charts of it: where a car's body moves, and where its wheels do and above."""
    f_hz, unit = frequencies(residuals), residuals.unit
    levels_db = [decibels(residuals, one) for one in (residuals.measured, residuals.residual, residuals.model)]

    def drawn(title: str, low_hz: float, high_hz: float) -> Curves:
        inside = (f_hz >= max(low_hz, f_hz[1])) & (f_hz <= high_hz)
        return Curves(title, "frequency [Hz]", f"power spectral density [dB re 1 ({unit})2/Hz]", tuple(
            Line(name, f_hz[inside], one[inside])
            for name, one in zip(("measured", "residual", "model"), levels_db, strict=True)))

    return drawn(f"Up to {_BODY_HZ:g} Hz", 0.0, _BODY_HZ), drawn(f"Above {_BODY_HZ:g} Hz", _BODY_HZ, f_hz[-1])


def _places(standing: Standing) -> Section:
    lines, names, unit = [], short_names(standing.residuals.runs), standing.residuals.unit
    for run in standing.residuals.runs[:SHOWN_ROWS]:
        parts = [part for part in standing.where.place if part.name == run.name]
        if len(parts) > 1:
            lines.append(Line(names[run.name], np.array([(part.low + part.high) / 2 for part in parts]),
                              np.array([part.residual_mps2 for part in parts])))
    along = Curves("Residual along the road", "distance [m]", f"residual, r.m.s. [{unit}]", tuple(lines))
    worst = standing.where.worst_places(SHOWN_ROWS) if standing.where.place else []
    rows = [(names[part.name], f"{part.low:g} to {part.high:g}", f"{part.share:.1%}", f"{part.residual_mps2:.3g}",
             fixed(part.error, 3, "-")) for part in worst]
    return Section("By place", [*([along] if lines else []), Table(
        ("Run", "From, to [m]", "Share of the residual", f"Residual [{unit}]", "NRMSE"), rows)])


def forces_section(forces: ForceMap) -> Detail:
    """The force that is missing beside springs and dampers, by velocity and by travel."""
    return Detail("The missing force", [
        *(Curves(title, x_name, "force [N]", (Line("missing force", curve.at * factor, curve.force_n,
                                                   errors=curve.error_n),), (0.0, "nothing missing"))
          for title, x_name, curve, factor in (
              (_titled("By velocity", forces.by_rate), "velocity of extension [m/s]", forces.by_rate, 1.0),
              (_titled("By travel", forces.by_travel), "extension [mm]", forces.by_travel, 1000.0))),
        Hint("The force, in addition to a linear spring or damper, that would explain the residual, with its standard "
             "error. A positive force pulls both ends together; compression is left, extension right. Distrust a curve "
             "that explains little of the residual.")])


def _alignment(found: LabComparison) -> Detail:
    windows, runs = found.tests.alignment, found.plain.residuals.runs
    names = short_names(runs)
    lines = [Line(names[run.name], windows.along_m[of], windows.lag_s[of] * 1000, dots=True)
             for index, run in enumerate(runs[:SHOWN_ROWS]) if (of := windows.run == index).any()]
    drawn = Curves("Lead of the model over the measurement", "distance into the run [m]", "lead [ms]", tuple(lines),
                   (0.0, "no lead"))
    return Detail("Alignment", [*([drawn] if lines else []), Hint(
        "A constant lead: a clock or a position is off. A growing lead: the speed is wrong. At recorded distances.")])


# --- tables ---


def _by_part(found: LabComparison) -> Iterator[Block]:
    plain, refitted = found.plain.where, found.refitted.where
    yield _table("By band", "Hz", plain.frequency, refitted.frequency)
    yield Hint("Share: of the residual's power. Unchanged: before any fit.")
    yield _table("By speed", "m/s", plain.speed, refitted.speed)
    yield _table("By amplitude of the motion", found.plain.residuals.unit, plain.amplitude, refitted.amplitude)


def _table(title: str, unit: str, plain: Sequence[Part], refitted: Sequence[Part]) -> Section:
    """Shares and errors of both standings; the bounds of the parts are those of the refitted one."""
    rows = [(part.name, f"{part.low:.3g} to {part.high:.3g}",
             Linked("", doc.html('<div class="bar"><span class="f0" style="width:{:.1%}"></span></div>', part.share)),
             f"{part.share:.1%}", f"{one.share:.1%}" if one else "", fixed(part.error, 3, "-"),
             fixed(one.error, 3, "-") if one else "") for one, part in lab_words.paired(plain, refitted)]
    heads = ("Band", f"From, to [{unit}]", "", "Share", "unchanged", "NRMSE", "unchanged")
    return Section(title, [Table(heads, rows, (0, 2))])


def _tests(found: LabComparison) -> Detail:
    rows = [(test.name, _measured(test.value, test.unit), _measured(test.standard_error),
             chance(test.p_value) if np.isfinite(test.p_value) else "cannot tell",
             "found" if test in found.tests_found else "") for test in found.tests.tests]
    return Detail("All residual tests", [
        Table(("Test", "Value", "Standard error", "p-value", ""), rows, (0, 4)),
        Hint("Found: unlikely to be noise, and large enough to matter.")])


def _numbers(found: LabComparison) -> Detail:
    rows = [(name, f"{move:+.1%}", "beyond its tolerance" if name in found.far else "")
            for name, move in found.moves.items()]
    return Detail("Parameters moved by the refit", [Table(("Parameter", "Shift", ""), rows, (0, 2))])


def _titled(title: str, curve: Curve) -> str:
    return f"{title}: explains {curve.share:.0%} of the residual"


def _measured(value: float | None, unit: str = "1") -> str:
    """A number with its unit; nothing where it is not known."""
    if value is None or not np.isfinite(value):
        return ""
    return f"{value:.3g} {unit}" if unit != "1" else f"{value:.3g}"


_AROUND_S = 1.5


@dataclass(frozen=True)
class Moment:
    """The samples ``part`` of those that count in a run, by its number, and where that is in words."""

    run: int
    part: slice
    words: str


def worst_moment(standing: Standing) -> Moment:
    """Around the largest residual in the worst place; on rigs, which stand where they are, of all."""
    residuals, worst = standing.residuals, standing.where.worst_places(1)
    names = short_names(residuals.runs)
    if worst:
        index = next(i for i, run in enumerate(residuals.runs) if run.name == worst[0].name)
        run = residuals.runs[index]
        at_m = run.distance_m[run.first:]
        inside = np.flatnonzero((at_m >= worst[0].low) & (at_m < worst[0].high))
    else:
        index = int(np.argmax([np.abs(one).max() for one in residuals.residual]))
        run = residuals.runs[index]
        inside = np.arange(len(residuals.residual[index]))
    middle = int(inside[np.abs(residuals.residual[index][inside]).argmax()])
    where = f"{at_m[middle]:.0f} m" if worst else f"{(run.first + middle) / residuals.rate_hz:.1f} s"
    reach = round(_AROUND_S * residuals.rate_hz)
    return Moment(index, slice(max(0, middle - reach), middle + reach), f"{names[run.name]}, around {where}")


def errors(found: AddedEffects) -> Table:
    """The error before, after and of the noise: which of them, the error, its fit, and what it is of."""
    those, they_are = ("", "as it is") if found.on_rig else (" and distances", "and distances as they are")
    return Table(("", "NRMSE", "Fit", ""), [(which, f"{error:.4f}", f"{fit_percent(error):.1f} %", what)
                                            for which, error, what in (
        ("Before", found.error_before, AS_GUESSED if found.filed == AS_GUESSED else
         f"vehicle's file {they_are}"),
        ("", found.error_refitted, f"parameters{those} refitted, on {JUDGED_ON}"),
        ("After", found.error_after, f"refitted with {' and '.join(found.names)}, on {JUDGED_ON}"),
        ("", found.error_as_written, f"new file {they_are}"),
        ("Noise floor", found.noise_floor_error, "about; the sensor's noise alone"),
    )], (0, 3))


def judgement(found: AddedEffects) -> list[str]:
    """The effect's numbers, and whether it is to be kept."""
    lines = [*lab_words.removed_words(found.removed, found.band)]
    lines += [f"{one.effect.name}: {numbers_of(one) or one.effect.title}." for one in found.new]
    lines += signal_errors({name: (one.before, one.after, one.noise_floor) for name, one in found.signals.items()},
                           "{} refitted without it, {} with it, noise floor about {}")
    if found.excess > UNEXPLAINED:
        lines.append(f"Something more is missing: in the worst run the residual is {1 + found.excess:.3g} times the "
                     "sensor's noise. This biases the parameters, possibly by more than their standard errors; add "
                     "all that ridelog diagnose finds together.")
    for one in found.new:
        at = [parameter.name for parameter in one.effect.parameters if parameter.is_free
              and one.values[parameter.name] != parameter.default and parameter.at_bound(one.values[parameter.name])]
        if at:
            lines.append(f"At its bound: {', '.join(at)}. The bound stopped the fit there; it is not a measured value.")
    if found.helps:
        lines.append(f"It helps: the probability that noise alone improves the fit as much is {chance(found.p_value)}.")
        lines += lab_words.error_words(found.steps, found.noise_floor_error)[1:]
    elif found.gains:
        lines.append("WARNING: it does not help. The fit improves by more than noise alone would, but the NRMSE on "
                     f"{JUDGED_ON} rises from {found.error_refitted:.4f} to {found.error_after:.4f}, and so does the "
                      "residual weighted by its noise: the effect imitates something else.")
    else:
        lines.append(f"WARNING: it does not help. The probability that noise alone improves the fit as much is "
                     f"{chance(found.p_value)}; these runs are no reason to keep it.")
    return lines


def bias(names: Sequence[str], moved: Sequence[ShiftedNumber]) -> str:
    """What the car's numbers, most moved first, had been taken for without the effects."""
    together = " and ".join(names)
    biased = [one for one in moved if one.biased]
    if not biased:
        return f"{together} moved no parameter of the model by more than {SURE_SIGMA:g} standard errors."
    own = [one.name for one in biased]
    listed = some(own) if len(own) > FEW else enumerated(own, "and")
    worst = biased[0]
    too_much = (f"{_change(worst.name, worst.found, worst.without)[1:]} too "
                f"{'high' if worst.without > worst.found else 'low'}")
    return (f"Without {together} the refit biased {listed}. {worst.name} came out {too_much}, "
            f"{abs(worst.shift):.1f} standard errors from its value with {'it' if len(names) == 1 else 'them'}.")


def _change(name: str, before: float, after: float) -> str:
    """From one value to another, in per cent; in its unit where it is ten times as large as the first, or more: of
    what is next to 0 a share says nothing."""
    if abs(after - before) < 10 * abs(before):
        return f"{(after - before) / abs(before):+.1%}"
    return f"{after - before:+.4g} {unit_of(name)}"


def moved_blocks(moved: Sequence[ShiftedNumber]) -> list[Block]:
    """A table of the car's numbers, and what its columns are; nothing where none moved."""
    rows = []
    for one in moved:
        error = _change(one.name, one.found, one.found + one.standard_error)[1:]
        given = one.found if one.left_open else one.nominal
        rows.append((one.name, f"{one.found:.5g}", _change(one.name, given, one.without),
                     ("" if one.left_open else f"{_change(one.name, given, one.found)} ") + f"± {error}",
                     f"{one.shift:+.1f}", "was biased" if one.biased else ""))
    of = "given value" + ", or to Now where that is a guess" * any(one.left_open for one in moved)
    hint = Hint("Now: the value in the new file. Without, With: refitted without and with the effect, relative to the "
                f"{of}, ± standard error. Shift: from Without to With in standard errors; beyond two, the "
                "missing effect had biased the parameter.")
    return [Table(("Parameter", "Now", "Without", "With", "Shift", ""), rows, (0, 5)), hint] if rows else []


# --- for a program ---


def _as_one(new: Sequence[Chosen]) -> tuple[str, dict[str, float], dict[str, float]]:
    """Name, numbers and standard errors of what was added; of several effects, whose numbers may have the same names,
    these begin with their effect's and a dot."""
    if len(new) == 1:
        return new[0].effect.name, dict(new[0].values), dict(new[0].standard_errors)
    return ("+".join(one.effect.name for one in new),
            {f"{one.effect.name}.{name}": value for one in new for name, value in one.values.items()},
            {f"{one.effect.name}.{name}": error for one in new for name, error in one.standard_errors.items()})


def addition_json(found: AddedEffects) -> dict[str, Any]:
    """The contract's object; of several effects, each by itself under "added"."""
    name, values, standard_errors = _as_one(found.new)
    each = [{"name": one.effect.name, "parameters": dict(one.values), "standard_errors": finite(one.standard_errors)}
            for one in found.new]
    return {
        "effect": name, "parameters": values, "standard_errors": finite(standard_errors),
        "added": each if len(each) > 1 else list(found.names), "excess": found.excess,
        "error_before": found.error_before, "error_after": found.error_after,
        "error_refitted": found.error_refitted, "error_as_written": found.error_as_written,
        **lab_words.errors_json(found.steps, found.noise_floor_error),
        **lab_words.band_json(found.band), **lab_words.removed_json(found.removed), "tolerance": found.tolerance,
        "noise_floor_error": found.noise_floor_error, "p_value": found.p_value, "helps": found.helps,
        "vehicle_parameters": [
            {"name": one.name, "nominal": one.nominal, "without": one.without,
             "without_standard_error": one.without_standard_error, "with": one.found,
             "with_standard_error": one.standard_error, "shift_standard_errors": one.shift}
            for one in found.moved],
        "signals": {name: {"error_refitted": one.before, "error_after": one.after,
                           "noise_floor_error": one.noise_floor} for name, one in found.signals.items()},
        "biased": [one.name for one in found.moved if one.biased],
    }


def addition_blocks(found: AddedEffects) -> list[Block]:
    """What a person reads of an effect that was added."""
    return [*judgement(found), errors(found), bias(found.names, found.moved), *moved_blocks(found.moved)]
