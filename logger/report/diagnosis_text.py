"""A diagnosis in sentences for a person, and as one object for a program."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from logger.lab.diagnosis import Diagnosis
from logger.lab.residuals.unexplained import Shape
from logger.lab.selection.detectability import DETECTABLE_SIGMA, Undetectable
from logger.lab.selection.error_scale import JUDGED_ON
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION
from logger.printable import percent
from logger.report import residual_text
from logger.report.band_text import band_json
from logger.report.error_scale_text import error_words, errors_json
from logger.report.quantities import chance, finite, numbers_of, signal_errors
from logger.report.removed_text import removed_json, removed_words
from logger.report.text_layout import enumerated
from logger.vehicle.effect import Chosen

_MOST_HIDDEN, _MOST_MOVED = 6, 3
_SUSPECT = 0.1
"""An effect that noise looks like in fewer searches than this is worth a drive: a judgement."""


def summary(found: Diagnosis) -> list[str]:
    """What is missing, how certain that is, and what it could be instead: paragraphs."""
    lines = [*removed_words(found.removed, found.band)]
    for one, group in zip(found.missing, groups(found), strict=True):
        lines += [_missing(found, one), *([_confusion(group, found)] if len(group) > 1 else [])]
    if not found.missing and not found.unexplained:
        more = " else" * bool(found.removed.drifting_sensors or found.removed.distance_error_m > 0)
        what, how = ("No effect", "") if found.beyond else (f"Nothing{more}", " within their tolerance")
        lines.append(f"{what} is missing: with the car's numbers refitted{how}, the residual is hardly more than the "
                     "sensor's noise.")
    if found.coloured and not found.exceeds_noise:
        lines.append("The sensor's noise is louder at some frequencies than at others: it is as loud where the car is "
                     "shaken little as where it is shaken much, and has nothing to do with the road.")
    if found.exceeds_noise:
        lines.append(f"Something {'more ' * bool(found.missing)}is missing that no candidate explains: in the worst "
                     f"run the residual is {1 + found.excess:.3g} times the sensor's noise.")
        if any(one.p_value < FALSE_ALARM and one.effect.name not in found.verdict for one in found.candidates):
            lines.append(f"Candidates that improve the fit by less than {IMITATION:.0%} of what a full explanation "
                         "would are not named: they may only imitate what is missing.")
    if found.beyond:
        off = ", ".join(f"{name} by {share:+.0%}" for name, share in found.beyond.items())
        lines.append(f"These numbers of the vehicle's file are beyond their tolerance: {off}. Measure them: the file "
                     "is wrong there, or an effect is missing that no candidate explains.")
    if found.moved:
        lines.append(_moved(found))
    if found.as_moved is not None:
        one = found.as_moved
        lines.append(f"All of this move together is what {one.effect.name} does ({one.effect.title}): "
                     f"{numbers_of(one)}. To know: {one.effect.shown_by}.")
    lines += error_words(found.steps, found.noise_floor_error)
    lines += signal_errors({name: (one.before, one.after, one.noise_floor) for name, one in found.signals.items()},
                           "{} as the vehicle's file says, {} as it ends, its noise alone about {}")
    lines += _faint(found)
    dropped = [name for name in _on_the_way(found) if name not in found.verdict]
    if dropped:
        why = "because the others explain it" if found.verdict else "at an end of its range, or where it does nothing"
        lines.append(f"Added during the search and dropped again, {why}: {', '.join(dropped)}.")
    return lines


def looks_like(found: Diagnosis) -> list[str]:
    """What no candidate explains, described; nothing where no more than noise is left."""
    return [] if found.shape is None else residual_text.looks_like(found.shape)


def untested(found: Diagnosis) -> list[str]:
    """Effects that these runs cannot show, and which drive would."""
    lines = [f"{name}: could not be tried, {why}." for name, why in found.not_tried.items()]
    lines += [f"{one.effect.name}: these runs could miss it. At its usual strength it stands out by "
              f"{one.deviations:.1f} standard deviations, and {DETECTABLE_SIGMA:g} are needed{_alike(one)}. To see it: "
              f"{one.effect.shown_by}."
              for one in found.undetectable[:_MOST_HIDDEN]]
    if rest := [one.effect.name for one in found.undetectable[_MOST_HIDDEN:]]:
        lines.append(f"These runs could also miss: {', '.join(rest)}.")
    return lines


def _moved(found: Diagnosis) -> str:
    """What the runs say of the car's numbers, the farthest first."""
    shown = [f"{name} by {share:+.1%} ± {error:.1%}"
             for name, (share, error) in [*found.moved.items()][:_MOST_MOVED]]
    rest = len(found.moved) - len(shown)
    return (f"Within their tolerance the runs move numbers of the vehicle's file: {', '.join(shown)}"
            f"{f', and {rest} more' * bool(rest)}. Measure them: with a number that is right in the file, and a "
            "smaller --tolerance, an effect that it hides would be named.")


def _alike(one: Undetectable) -> str:
    """What of the car hides an effect."""
    return f": {one.alike}, within its tolerance, does nearly the same" if one.alike else ""


def groups(found: Diagnosis) -> list[list[str]]:
    """Each effect of the verdict with those that explain as well in its place, the likeliest first."""
    return [[name, *found.candidate(name).confused_with] for name in found.verdict]


def _missing(found: Diagnosis, one: Chosen) -> str:
    name, numbers = one.effect.name, f": {numbers_of(one)}" if one.values else ""
    candidate = found.candidate(name)
    likely = f"The probability that noise alone looks like this, all candidates together: {chance(candidate.p_value)}."
    says = "would explain part of what is missing, or imitates something else" if found.unexplained else "is missing"
    if candidate.confused_with:
        group = enumerated([name, *candidate.confused_with], "or")
        return (f"One of {group} {says}; these runs cannot distinguish them. The numbers are for {name} "
                f"({one.effect.title}){numbers}. {likely}")
    return f"{name} {says} ({one.effect.title}){numbers}. {likely}"


def _faint(found: Diagnosis) -> list[str]:
    """What comes nearest to being named, where it is likelier than not to be more than noise."""
    others = [one for one in found.candidates if one.effect.name not in found.verdict]
    nearest = min(others, key=lambda one: one.p_value, default=None)
    if found.unexplained or nearest is None or not FALSE_ALARM <= nearest.p_value < _SUSPECT:
        return []
    return [f"{nearest.effect.name} comes near to being named: noise alone would look like it in "
            f"{percent(nearest.p_value)} of such searches, and {percent(FALSE_ALARM)} is the most that is allowed. To "
            f"know: {nearest.effect.shown_by}."]


def _confusion(names: list[str], found: Diagnosis) -> str:
    """Which drive would separate effects that explain alike."""
    drives = [f"{name}: {found.catalogue[name].shown_by}" for name in names]
    return (f"{enumerated(names, 'and')} explain about as much of the residual as each other. Drives that would "
            f"separate them: {'; '.join(drives)}. ridelog plan says beforehand whether a drive would.")


def _on_the_way(found: Diagnosis) -> list[str]:
    return [step.words.removeprefix("with ") for step in found.steps if step.words.startswith("with ")]


def table(found: Diagnosis, most: int | None = None) -> Iterator[tuple[str, str, str, str]]:
    """The candidates, best first: name, error, chance, numbers."""
    by_name = {one.effect.name: one for one in found.missing}
    for one in found.candidates[:most]:
        name = one.effect.name
        numbers = numbers_of(by_name.get(name, Chosen(one.effect, one.values)))
        yield name, f"{one.error:.3f}", chance(one.p_value), numbers


# --- for a program ---


def as_json(found: Diagnosis) -> dict[str, Any]:
    """The diagnosis as one JSON object."""
    errors = {one.effect.name: finite(one.standard_errors) for one in found.missing}
    return {
        "baseline_error": found.baseline_error, "noise_floor_error": found.noise_floor_error,
        "unseen_noise_floor_error": found.noise_floor_error, "judged_on": JUDGED_ON,
        "candidates": [
            {"effect": one.effect.name, "parameters": dict(one.values), "error": one.error, "p_value": one.p_value,
             "confused_with": list(one.confused_with), "standard_errors": errors.get(one.effect.name, {}),
             "log_likelihood_gain": one.gain / 2, "unseen_log_likelihood_gain": one.held_out_gain / 2}
            for one in found.candidates],
        "verdict": list(found.verdict), "groups": groups(found), "unexplained": found.unexplained,
        "left_over_noise": 1 + found.excess, "numbers_off_too_far": dict(found.beyond),
        "numbers_moved": {name: {"share": share, "standard_error": error}
                          for name, (share, error) in found.moved.items()},
        "moved_as_by": None if found.as_moved is None else {
            "effect": found.as_moved.effect.name, "parameters": dict(found.as_moved.values)},
        "signals": {name: {"baseline_error": one.before, "final_error": one.after, "noise_floor_error": one.noise_floor}
                    for name, one in found.signals.items()},
        "tolerance": found.tolerance, "coloured_noise": found.coloured,
        "steps": [{"step": step.words, "error": step.error} for step in found.steps],
        **errors_json(found.steps, found.noise_floor_error), "no_better_than_refitted": list(found.no_better),
        "not_tried": found.not_tried,
        "hidden": {one.effect.name: one.deviations for one in found.undetectable},
        "unexplained_shape": None if found.shape is None else _shape_json(found.shape),
        **band_json(found.band), **removed_json(found.removed),
        "sentences": [*summary(found), *looks_like(found)],
    }


def _shape_json(shape: Shape) -> dict[str, Any]:
    forces, line = shape.tests.forces, shape.line
    return {
        "sentences": residual_text.looks_like(shape),
        "force_by_rate": {"rate_mps": forces.by_rate.at.tolist(), "force_n": forces.by_rate.force_n.tolist(),
                          "standard_error_n": forces.by_rate.error_n.tolist(), "share": forces.by_rate.share},
        "force_by_travel": {"travel_m": forces.by_travel.at.tolist(), "force_n": forces.by_travel.force_n.tolist(),
                            "standard_error_n": forces.by_travel.error_n.tolist(), "share": forces.by_travel.share},
        "frequency": [{"from_hz": part.low, "to_hz": part.high, "error_power_share": part.share, "name": part.name}
                      for part in shape.where.frequency],
        "repeats_every_m": 1 / line.at_per_m if line is not None and line.found and not line.steady else None,
    }
