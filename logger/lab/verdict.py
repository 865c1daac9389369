"""A diagnosis as it is told: in sentences for a person, as one object for a program.

Problem: a name is no verdict. Whoever reads it wants to know how much it explains, how certain that is, what else it
could be, what would tell them apart, and what these runs could not have shown anyway. Solution: ``told`` asks the
fitted model for the rest (errors of its numbers, effects that would hide, the shape of what no candidate explains), and
all of it is put in words once, here, for the terminal, the pages and the JSON.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from logger.lab import wandering
from logger.lab.blind import SEEN, Blind, blind
from logger.lab.diagnosis import CHANCE, LEAST_OF_LEFT, Candidate, Diagnosis
from logger.lab.quantities import chance, finite, numbers_of
from logger.lab.spread import with_spread
from logger.lab.stretches import Stretches, unseen_in
from logger.lab.unexplained import Shape, sentences, shape_of
from logger.vehicle.effect import Chosen, Effect

HAS_IT = "the model has it"
_MOST_BLIND = 6


@dataclass(frozen=True, eq=False)
class Verdict:
    """A diagnosis, and what it takes to tell it.

    effects      of the model that it ends with, with standard errors
    catalogue    all effects that were asked for, by name
    blind        those that these runs could not show at their usual strength
    shape        of what no candidate explains; None where no more than noise is left
    """

    diagnosis: Diagnosis
    effects: tuple[Chosen, ...]
    catalogue: Mapping[str, Effect]
    blind: tuple[Blind, ...]
    shape: Shape | None

    @property
    def missing(self) -> tuple[Chosen, ...]:
        """The effects that the model lacks, the most certain first."""
        by_name = {one.effect.name: one for one in self.effects}
        return tuple(by_name[name] for name in self.diagnosis.verdict)

    @property
    def not_tried(self) -> dict[str, str]:
        """Effects that could not be tried, and why."""
        return {name: why for name, why in self.diagnosis.obstacles.items() if why != HAS_IT}

    def candidate(self, name: str) -> Candidate:
        """What was found of one that was tried."""
        return next(one for one in self.diagnosis.candidates if one.effect.name == name)


def told(diagnosis: Diagnosis, catalogue: Mapping[str, Effect],
         progress: Callable[[str], None] = lambda words: None) -> Verdict:
    """What it takes to tell a diagnosis."""
    problem, after = diagnosis.problem, diagnosis.after
    progress("how certain the numbers are")
    effects, _ = with_spread(problem, after, diagnosis.slopes)
    progress("what these runs could not show")
    taken = {one.effect.name for one in after.effects}
    others = [effect for name, effect in catalogue.items() if name not in diagnosis.obstacles and name not in taken]
    hidden = blind(problem, after, diagnosis.slopes, others)
    if diagnosis.left_over:
        progress("the shape of what is left")
    return Verdict(diagnosis, effects, catalogue, hidden, shape_of(problem, after) if diagnosis.left_over else None)


# --- in words ---


def summary(found: Verdict) -> list[str]:
    """What is missing, how certain that is, and what it could be instead: paragraphs."""
    diagnosis = found.diagnosis
    lines = [_missing(found, one) for one in found.missing]
    if not lines and not diagnosis.unexplained:
        lines.append("Nothing is missing: with the car's numbers refitted within their tolerance, the residual is "
                     "hardly more than the sensor's noise.")
    if diagnosis.left_over:
        lines.append(f"Something {'more ' * bool(lines)}is missing that no candidate explains: in the worst run "
                     f"the residual is {1 + diagnosis.excess:.3g} times the sensor's noise.")
        if any(one.p_value < CHANCE and one.effect.name not in diagnosis.verdict for one in diagnosis.candidates):
            lines.append(f"Candidates that improve the fit by less than {LEAST_OF_LEFT:.0%} of what a full explanation "
                         "would are not named: they may only imitate what is missing.")
    if diagnosis.strained:
        off = ", ".join(f"{name} by {share:+.0%}" for name, share in diagnosis.strained.items())
        lines.append(f"The fit needs numbers outside their tolerance: {off}. Either the vehicle's file is wrong "
                     "there, or an effect is missing that no candidate explains.")
    lines += wandering.told(diagnosis.moved_m) + wandering.too_long(diagnosis.problem)
    lines.append(_errors(found))
    lines += [_confusion(found, one) for one in found.missing if found.candidate(one.effect.name).confused_with]
    dropped = [name for name in _on_the_way(diagnosis) if name not in diagnosis.verdict]
    if dropped:
        lines.append(f"Added during the search and dropped again, because the others explain it: {', '.join(dropped)}.")
    return lines


def looks_like(found: Verdict) -> list[str]:
    """What no candidate explains, described; nothing where no more than noise is left."""
    return [] if found.shape is None else sentences(found.shape)


def untested(found: Verdict) -> list[str]:
    """What these runs cannot tell of, and which drive would."""
    lines = [f"{name}: could not be tried, {why}." for name, why in found.not_tried.items()]
    lines += [f"{one.effect.name}: these runs could miss it. At its usual strength it stands out by "
              f"{one.deviations:.1f} standard deviations, and {SEEN:g} are needed. To see it: {one.effect.shown_by}."
              for one in found.blind[:_MOST_BLIND]]
    if rest := [one.effect.name for one in found.blind[_MOST_BLIND:]]:
        lines.append(f"These runs could also miss: {', '.join(rest)}.")
    return lines


def _missing(found: Verdict, one: Chosen) -> str:
    numbers = f": {numbers_of(one)}" if one.values else ""
    candidate = found.candidate(one.effect.name)
    says = "is missing"
    if found.diagnosis.unexplained:
        says = "would explain part of what is missing, or imitates something else"
    return (f"{one.effect.name} {says} ({one.effect.title}){numbers}. "
            f"The probability that noise alone looks like this, all candidates together: {chance(candidate.p_value)}.")


def floor_where_judged(diagnosis: Diagnosis) -> float | None:
    """The error that the sensor's noise alone makes of the samples that the errors of steps and candidates are of; None
    where it is not known."""
    if diagnosis.noise is None or not diagnosis.judged:
        return diagnosis.noise_floor_error
    runs = diagnosis.problem.runs.runs
    measured = np.concatenate([run.measured_mps2[run.first:][unseen] for run, unseen in zip(
        runs, unseen_in([Stretches(run) for run in runs]), strict=True)])
    return float(diagnosis.noise.deviation_mps2 / np.sqrt((measured**2).mean()))


def _errors(found: Verdict) -> str:
    diagnosis = found.diagnosis
    by_step = [f"{step.error:.3f} {_STEP_WORDS.get(step.words, step.words)}" for step in diagnosis.steps]
    there, floor = floor_where_judged(diagnosis), diagnosis.noise_floor_error
    noise = f" The sensor's noise alone makes about {there:.3f}" if there is not None else ""
    if noise and diagnosis.judged:
        noise += f" there, and {floor:.3f} of all samples"
    return f"Error on {diagnosis.judged_on}: {', '.join(by_step)}.{noise}{'.' * bool(noise)}"


_STEP_WORDS = {
    "the vehicle as its file says": "as the vehicle's file says",
    "its numbers refitted within what is granted": "with its numbers refitted",
}


def _confusion(found: Verdict, one: Chosen) -> str:
    """What explains as well, and which drive would tell."""
    others = found.candidate(one.effect.name).confused_with
    drives = [f"{name}: {found.catalogue[name].shown_by}" for name in (one.effect.name, *others)]
    return (f"These runs cannot tell {one.effect.name} from {' or '.join(others)}: each explains about as much. What "
            f"shows each best, and so would separate them: {'; '.join(drives)}.")


def _on_the_way(diagnosis: Diagnosis) -> list[str]:
    return [step.words.removeprefix("with ") for step in diagnosis.steps if step.words.startswith("with ")]


def table(found: Verdict, most: int | None = None) -> Iterator[tuple[str, str, str, str]]:
    """The candidates, best first: name, error, chance, numbers."""
    by_name = {one.effect.name: one for one in found.missing}
    for one in found.diagnosis.candidates[:most]:
        name = one.effect.name
        numbers = numbers_of(by_name.get(name, Chosen(one.effect, one.values)))
        yield name, f"{one.error:.3f}", chance(one.p_value), numbers


# --- for a program ---


def as_json(found: Verdict) -> dict[str, Any]:
    """The diagnosis as one JSON object."""
    diagnosis = found.diagnosis
    errors = {one.effect.name: finite(one.standard_errors) for one in found.missing}
    return {
        "baseline_error": diagnosis.baseline_error, "noise_floor_error": diagnosis.noise_floor_error,
        "unseen_noise_floor_error": floor_where_judged(diagnosis) if diagnosis.judged else None,
        "judged_on": diagnosis.judged_on,
        "candidates": [
            {"effect": one.effect.name, "parameters": dict(one.values), "error": one.error, "p_value": one.p_value,
             "confused_with": list(one.confused_with), "standard_errors": errors.get(one.effect.name, {}),
             "log_likelihood_gain": one.gain / 2, "unseen_log_likelihood_gain": one.judged_gain / 2}
            for one in diagnosis.candidates],
        "verdict": list(diagnosis.verdict), "unexplained": diagnosis.unexplained,
        "left_over_noise": 1 + diagnosis.excess, "numbers_off_too_far": dict(diagnosis.strained),
        "steps": [{"step": step.words, "error": step.error} for step in diagnosis.steps],
        "not_tried": found.not_tried,
        "hidden": {one.effect.name: one.deviations for one in found.blind},
        "unexplained_shape": None if found.shape is None else _shape_json(found.shape),
        "sentences": [*summary(found), *looks_like(found)],
    }


def _shape_json(shape: Shape) -> dict[str, Any]:
    forces, turns = shape.marks.forces, shape.turns
    return {
        "sentences": sentences(shape),
        "force_by_rate": {"rate_mps": forces.by_rate.at.tolist(), "force_n": forces.by_rate.force_n.tolist(),
                          "standard_error_n": forces.by_rate.error_n.tolist(), "share": forces.by_rate.share},
        "force_by_travel": {"travel_m": forces.by_travel.at.tolist(), "force_n": forces.by_travel.force_n.tolist(),
                            "standard_error_n": forces.by_travel.error_n.tolist(), "share": forces.by_travel.share},
        "frequency": [{"from_hz": part.low, "to_hz": part.high, "error_power_share": part.share, "name": part.name}
                      for part in shape.where.frequency],
        "repeats_every_m": 1 / turns.at_per_m if turns is not None and turns.found and not turns.steady else None,
    }
