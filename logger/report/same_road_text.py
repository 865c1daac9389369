"""A diagnosis without a profile in sentences for a person, and as one object for a program."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from logger.lab.unknown_road.diagnosis import UnknownRoadDiagnosis
from logger.report.quantities import chance, finite, numbers_of
from logger.report.text_layout import columns, enumerated, paragraphs


def summary(found: UnknownRoadDiagnosis) -> list[str]:
    """What is missing, how certain that is, and what it could be instead: paragraphs."""
    lines = []
    for one in found.missing:
        candidate = next(other for other in found.candidates if other.name == one.effect.name)
        numbers = f": {numbers_of(one)}" if one.values else ""
        lines.append(f"{one.effect.name} is missing ({one.effect.title}){numbers}. The probability that noise alone "
                     f"looks like this, all candidates together: {chance(candidate.p_value)}.")
        if candidate.confused_with:
            names = enumerated([one.effect.name, *candidate.confused_with], "and")
            lines.append(f"{names} explain about as much as each other: these drives cannot distinguish them.")
        if candidate.stands_in:
            lines.append(f"{one.effect.name} bends the laws of the car: in each drive over each stretch of road the "
                         "linear car that comes nearest stood in for it, which its numbers are as right as.")
    if found.undecided:
        names, them = enumerated([one.name for one in found.undecided], "or"), len(found.undecided) > 1
        lines.append(f"Not decided: {names} would explain a little, more than noise would, but less than a tenth of "
                     f"what no road explains. {'They' if them else 'It'} may only imitate something else that is "
                     "missing.")
    elif not lines:
        lines.append("None of the effects that can be tried without a profile is missing.")
    by_step = [f"{error:.3f} {'with' if index else 'as'} {words.removeprefix('with ')}"
               for index, (words, error) in enumerate(_steps(found))]
    lines.append(f"Error of each drive over the road as estimated from the others: {', '.join(by_step)}. The sensor's "
                 f"noise alone makes {found.floor_error:.3f}.")
    if found.unexplained:
        cause = ("something else is missing, maybe" if found.exact_places else
                 "the distances of these drives, by a receiver, are off within seconds, or something is missing, maybe")
        lines.append(f"What no road explains is {1 + found.excess:.2f} times the sensor's noise: {cause} one of the "
                     "effects that only a measured road can show.")
    return lines


def _steps(found: UnknownRoadDiagnosis) -> list[tuple[str, float]]:
    """Models on the way, each with its error."""
    words = ["the vehicle as its file says", "its numbers refitted within their tolerance",
             *(f"with {one.effect.name}" for one in found.missing)]
    return list(zip(words, found.errors, strict=True))


def cannot_tell(found: UnknownRoadDiagnosis) -> list[str]:
    """What these drives cannot show or identify, in sentences."""
    lines = [f"Whether {one} and {other} are over one road: too little of what they recorded there stands out of the "
             "noise." for one, other in found.doubtful]
    if found.absorbed_by_road:
        lines.append(f"{', '.join(found.absorbed_by_road)}: a road of another shape, which nobody measured, would look "
                     "the same.")
    lines += [f"{', '.join(name for name, one in found.untried.items() if one == why)}: could not be tried; {why}."
              for why in dict.fromkeys(found.untried.values())]
    lines += [f"{name}: these drives could miss it; at its usual strength it stands out by {deviations:.1f} standard "
              "deviations."
              for name, deviations in found.hidden.items()]
    return [*lines, *(f"The car's numbers: {one.words}" for one in found.confounded)]


def same_road_lines(found: UnknownRoadDiagnosis, runs: Sequence[str], most: int | None) -> list[str]:
    """What a person reads; ``most`` so many candidates, None: all."""
    rows = [("Effect", "Error", "p-value", "Numbers")]
    rows += [(one.name, f"{one.error:.3f}{'' if one.fitted else ', not fitted'}", chance(one.p_value),
              numbers_of(one.one)) for one in found.candidates[:most]]
    by_run = [("Run", "Error before", "after"),
              *((name, f"{before:.3f}", f"{after:.3f}") for name, (before, after) in
                zip(runs, found.by_run, strict=True))]
    return [paragraphs(summary(found)), "",
            "One effect at a time, those that are missing first; p-values are for all candidates together:",
            *columns(rows), "", *columns(by_run), "",
            "What these drives cannot tell:", paragraphs(cannot_tell(found), "- ")]


def as_json(found: UnknownRoadDiagnosis) -> dict[str, Any]:
    """The diagnosis as one JSON object."""
    errors = {one.effect.name: finite(one.standard_errors) for one in found.missing}
    values = {one.effect.name: dict(one.values) for one in found.missing}
    return {
        "baseline_error": found.errors[0], "noise_floor_error": found.floor_error,
        "candidates": [
            {"effect": one.name, "parameters": values.get(one.name, dict(one.one.values)),
             "error": one.error, "p_value": one.p_value,
             "confused_with": list(one.confused_with), "fitted": one.fitted,
             "standard_errors": errors.get(one.name, {}), "log_likelihood_gain": one.gain / 2}
            for one in found.candidates],
        "verdict": [one.effect.name for one in found.missing], "unexplained": found.unexplained,
        "left_over_noise": 1 + found.excess,
        "steps": [{"step": words, "error": error} for words, error in _steps(found)],
        "runs": [{"error_before": before, "error_after": after} for before, after in found.by_run],
        "undecided": [one.name for one in found.undecided],
        "maybe_over_two_roads": [list(pair) for pair in found.doubtful],
        "not_tried": dict(found.untried), "taken_by_road": dict(found.absorbed_by_road), "hidden": dict(found.hidden),
        "sentences": [*summary(found), *cannot_tell(found)],
    }
