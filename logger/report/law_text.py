"""A learned law in sentences for a person, as one object for a program, and as its file."""

from __future__ import annotations

from functools import partial
from typing import Any

from logger.lab.diagnosis import Diagnosis
from logger.lab.laws.learn import Law, Learning
from logger.lab.laws.refusals import Nearest, Refusal
from logger.lab.selection.add_effect import AddedEffects
from logger.lab.selection.error_scale import Step
from logger.report.diagnosis_text import looks_like
from logger.report.error_scale_text import error_words, errors_json
from logger.report.quantities import finite, measured, numbers_of, unit_of
from logger.report.removed_text import removed_json, removed_words
from logger.report.text_layout import paragraphs
from logger.vehicle.effect import Chosen

NOTHING = "nothing is missing; no law is learned"


def words(law: Law, addition: AddedEffects) -> str:
    """What it is: "friction with memory, 161 ± 4 N over 4.0 ± 0.2 mm, front axle only"."""
    one = learned(law, addition)
    said = law.family.words(law.draft, one, partial(_number, one))
    return said + (f", {law.draft.axle} axle only" if law.draft.axle else "")


def _number(one: Chosen, name: str, factor: float = 1.0, unit: str | None = None) -> str:
    error = one.standard_errors.get(name)
    said = measured(one.values[name] * factor, None if error is None else error * factor)
    return f"{said} {unit_of(name) if unit is None else unit}".rstrip()


def learned(law: Law, addition: AddedEffects) -> Chosen:
    """The law with its numbers and their errors."""
    return next(one for one in addition.new if one.effect.name == law.draft.name)


def why_none(found: Learning) -> str:
    """Why no law is learned."""
    if found.refused is not None:
        return _refused(found.refused)
    if not found.verdict and not found.unexplained:
        return NOTHING
    if not found.verdict:
        return "something is missing that no known effect and no law of these families explains; no law is learned"
    names = " and ".join(found.verdict)
    many = len(found.verdict) > 1
    if found.unexplained:
        return (f"{names} explain{'s' * (not many)} part of what is missing, and no law of these families explains it "
                "better; no law is learned")
    return f"{names} explain{'s' * (not many)} it; no law is learned"


def _refused(one: Refusal) -> str:
    add = "" if one.known is None else f": ridelog add-effect {one.known.one.effect.name}"
    return f"{one.title} would explain it best, but {one.why}{add}; no law is learned"


def law_lines(found: Learning, addition: AddedEffects | None) -> list[str]:
    """What a person reads."""
    if found.law is None or addition is None:
        assert found.diagnosis is not None
        said = why_none(found)
        removed = removed_words(found.diagnosis.removed, found.diagnosis.band)
        lines = [paragraphs([*removed, f"{said[0].upper()}{said[1:]}."])]
        lines += [f"  {one.effect.name}: {numbers_of(one)}" for one in found.diagnosis.missing if one.values]
        if shape := looks_like(found.diagnosis):
            lines += ["", paragraphs(shape, "- ")]
        return [*lines, "", paragraphs([_without(found.diagnosis)])]
    return [paragraphs(sentences(found.law, addition))]


def sentences(law: Law, addition: AddedEffects) -> list[str]:
    """The law, what it brings, and what it may be instead: paragraphs."""
    said = words(law, addition)
    lines = [*removed_words(addition.removed, addition.band), f"Learned: {said}.",
             _errors(addition)]
    if law.effects:
        beside = [one for one in addition.new if one.effect.name != law.draft.name]
        lines.append("Also missing: " + "; ".join(f"{one.effect.name} ({numbers_of(one)})" for one in beside)
                     + ". The law was fitted with these: they belong in the vehicle as well.")
    share = max(law.listed, 0.0) / law.with_law
    lines.append(f"The known effects alone explain {share:.0%} of what the model with the law does (2 ln of the "
                 f"evidence {law.listed:.0f} of {law.with_law:.0f}).")
    lines += _nearest(law.nearest, law)
    if law.rivals:
        others = [f"{one.draft.title}: {one.family.shown_by}" for one in law.rivals]
        lines.append(f"These runs cannot distinguish it from {' or '.join(one.draft.title for one in law.rivals)}: "
                     "each explains about as much of the residual. Drives that would: "
                     + "; ".join([f"{law.draft.title}: {law.family.shown_by}", *others]) + ".")
    return lines


def _nearest(nearest: Nearest | None, law: Law) -> list[str]:
    if nearest is None:
        return ["No known effect of its kind explains any part of it."]
    name, gap = nearest.one.effect.name, nearest.law_gain - nearest.gain
    numbers = f" ({numbers_of(nearest.one)})" if nearest.one.values else ""
    if nearest.as_good:
        return [f"It is nearly a known law: {name}{numbers} explains {nearest.share:.1%} of what it does, and these "
                f"runs cannot distinguish the two (2 ln of the evidence differs by {gap:+.0f}). Prefer the known one: "
                f"ridelog add-effect {name}."]
    return [f"The known effect that comes nearest is {name}{numbers}: in its place it explains {nearest.share:.0%} of "
            f"what it does (2 ln of the evidence {gap:.0f} less)."]


def _errors(addition: AddedEffects) -> str:
    steps = (*addition.steps[:-1], Step("with the law", addition.error_after))
    return " ".join(error_words(steps, addition.noise_floor_error))


def _without(diagnosis: Diagnosis) -> str:
    return " ".join(error_words(diagnosis.steps, diagnosis.noise_floor_error))


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
            "Its numbers begin where that fit ended: ridelog add-effect with this file fits them again, with the car."]
    return law.draft.text(learned(law, addition).values, head)


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
            "steps": [{"step": one.words, "error": one.error} for one in diagnosis.steps],
            **removed_json(diagnosis.removed),
        }
    one = learned(law, addition)
    return {
        "law": path, "family": law.family.name, "words": words(law, addition), "effect": law.draft.name,
        "axle": law.draft.axle or None, "parameters": dict(one.values),
        "standard_errors": finite(one.standard_errors), "error_before": addition.error_before,
        "error_refitted": addition.error_refitted, "error_after": addition.error_after,
        "error_after_unseen": addition.error_after, "error_before_unseen": addition.error_refitted,
        **errors_json(addition.steps, addition.noise_floor_error),
        "noise_floor_error": addition.noise_floor_error,
        "verdict": [other.effect.name for other in law.effects], "unexplained": found.unexplained,
        "log_likelihood_gain": law.gain / 2,
        "listed": {"verdict": list(found.verdict), "error_unseen": found.listed_error,
                   "gain": law.listed / 2, "gain_with_law": law.with_law / 2},
        "nearest": _nearest_json(law.nearest),
        "confused_with": [other.family.name for other in law.rivals],
        "steps": [{"step": name, "error": error} for name, error in steps_of(law, addition)],
        **removed_json(addition.removed),
        "sentences": sentences(law, addition),
    }


def _nearest_json(one: Nearest | None) -> dict[str, Any] | None:
    return None if one is None else {
        "effect": one.one.effect.name, "parameters": dict(one.one.values), "share": one.share, "as_good": one.as_good,
        "log_likelihood_less": (one.law_gain - one.gain) / 2}


def steps_of(law: Law, addition: AddedEffects) -> list[tuple[str, float]]:
    """How the error fell."""
    return [("as it was given", addition.error_before), ("numbers refitted", addition.error_refitted),
            (f"with {' and '.join([*(one.effect.name for one in law.effects), law.draft.title])}",
             addition.error_after)]
