"""What adding an effect to a model brought, in sentences for a person and as one object for a program."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from logger.lab.selection.add_effect import BIAS_SIGMA, AddedEffects, Number
from logger.lab.selection.error_scale import JUDGED_ON
from logger.report.band_text import band_json
from logger.report.error_scale_text import error_words, errors_json
from logger.report.quantities import chance, finite, numbers_of, signal_errors
from logger.report.removed_text import removed_json, removed_words

_AT_BOUND = 1e-6
_NAMED = 4


def errors(found: AddedEffects) -> list[tuple[str, float, str]]:
    """The error before, after and of the noise: which of them, the error, and what it is of."""
    return [
        ("before", found.error_before, "as the file says, distances as recorded: where ridelog compare begins"),
        ("", found.error_refitted, f"its numbers and the distances refitted within their tolerance, on {JUDGED_ON}"),
        ("after", found.error_after, f"with {' and '.join(found.names)}, all refitted and judged in the same way"),
        ("", found.error_as_written, "as the new file says, distances as recorded: where compare begins with it"),
        ("of noise", found.noise_floor_error, "about, from the sensor's noise alone"),
    ]


def judgement(found: AddedEffects) -> list[str]:
    """The effect's numbers, and whether it is to be kept."""
    lines = [*removed_words(found.removed, found.band)]
    lines += [f"{one.effect.name}: {numbers_of(one) or one.effect.title}." for one in found.new]
    lines += signal_errors({name: (one.before, one.after, one.noise_floor) for name, one in found.signals.items()},
                           "{} refitted without it, {} with it, its noise alone about {}")
    for one in found.new:
        at = [parameter.name for parameter in one.effect.parameters if parameter.is_free
              and min(abs(one.values[parameter.name] - end) for end in (parameter.low, parameter.high)
                      if end != parameter.default) <= _AT_BOUND * abs(parameter.high)]
        if at:
            lines.append(f"At its bound: {', '.join(at)}. That is where the fit was stopped, not what was measured.")
    if found.helps:
        lines.append(f"It helps: the probability that noise alone improves the fit as much is {chance(found.p_value)}.")
        lines += error_words(found.steps, found.noise_floor_error)[1:]
    elif found.gains:
        lines.append("WARNING: it does not help. The fit improves by more than noise alone would, but on stretches "
                     f"that no fit saw the error rises from {found.error_refitted:.4f} to {found.error_after:.4f}, and "
                     "so does what is weighed by its noise: it imitates something else.")
    else:
        lines.append(f"WARNING: it does not help. The probability that noise alone improves the fit as much is "
                     f"{chance(found.p_value)}; these runs are no reason to keep it.")
    return lines


def bias(names: Sequence[str], moved: Sequence[Number]) -> str:
    """What the car's numbers, most moved first, had been taken for without the effects."""
    together = " and ".join(names)
    biased = [one for one in moved if one.biased]
    if not biased:
        return f"No number of the car moved by more than {BIAS_SIGMA:g} standard errors when {together} was added."
    listed = ", ".join(one.name for one in biased[:_NAMED])
    more = f" and {len(biased) - _NAMED} more" if len(biased) > _NAMED else ""
    worst = biased[0]
    return (f"Without {together} these were biased: {listed}{more}. {worst.name} came out {_too_much(worst)}, "
            f"{abs(worst.shift):.1f} standard errors away from what it is with {'it' if len(names) == 1 else 'them'}.")


def _too_much(one: Number) -> str:
    """By how much a number came out wrong without the effects."""
    return f"{abs(one.without / one.found - 1):.1%} too {'high' if one.without > one.found else 'low'}"


MOVED_HEADS = ("Number", "Now", "Without", "With", "Shift", "")
MOVED_HINT = ("Without, With: refitted without and with the effect, as a difference from the given value, ± "
              "standard error. Now: the value in the new file. Shift: from Without to With, "
              "in standard errors; above two the number was biased because the effect was missing.")


def moved_rows(moved: Sequence[Number]) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Under ``MOVED_HEADS``."""
    for one in moved:
        yield (one.name, f"{one.found:.5g}", f"{one.without / one.nominal - 1:+.1%}",
               f"{one.found / one.nominal - 1:+.1%} ± {one.standard_error / one.found:.1%}", f"{one.shift:+.1f}",
               "was biased" if one.biased else "")


# --- for a program ---


def as_json(found: AddedEffects) -> dict[str, Any]:
    """The contract's object, of the effect that was added last."""
    new = found.new[-1]
    return {
        "effect": new.effect.name, "parameters": dict(new.values), "standard_errors": finite(new.standard_errors),
        "error_before": found.error_before, "error_after": found.error_after,
        "error_refitted": found.error_refitted, "error_as_written": found.error_as_written,
        "error_unseen_before": found.error_refitted, "error_unseen_after": found.error_after,
        **errors_json(found.steps, found.noise_floor_error),
        **band_json(found.band), **removed_json(found.removed), "tolerance": found.tolerance,
        "noise_floor_error": found.noise_floor_error, "p_value": found.p_value, "helps": found.helps,
        "numbers": [{"name": one.name, "nominal": one.nominal, "without": one.without,
                     "without_standard_error": one.without_standard_error, "with": one.found,
                     "with_standard_error": one.standard_error, "shift_standard_errors": one.shift,
                     "written": one.found}
                    for one in found.moved],
        "signals": {name: {"error_refitted": one.before, "error_after": one.after,
                           "noise_floor_error": one.noise_floor} for name, one in found.signals.items()},
        "biased": [one.name for one in found.moved if one.biased],
    }
