"""What adding effects to a model brought, as it is told: the error, its numbers, and what they had been taken for.

Problem: a fit always gains a little when it gets one more number, and a car without an effect that it has gets wrong
numbers that look right. Solution: the gain is held against what noise would give, and the car's numbers stand side by
side without and with the effect, in per cent and in standard errors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from logger.lab import wandering
from logger.lab.addition import Added
from logger.lab.noise import floor_error, noise_of
from logger.lab.quantities import chance, finite, numbers_of
from logger.vehicle.effect import Chosen
from logger.vehicle.effect_parameters import moves_of

CHANCE = 0.001
"""What noise does more often than this is no evidence of an effect."""
_MOVED = 2.0
"""A number that an effect moves by so many standard errors had been pulled away by its absence."""
_AT_BOUND = 1e-6
_NAMED = 4


@dataclass(frozen=True)
class Moved:
    """A number of the car: as it was given, refitted without effects that were added later, and with them.

    shift      from the one to the other, in standard errors of the last
    written    what the vehicle has now, held near what was given
    """

    name: str
    nominal: float
    without: float
    without_standard_error: float
    found: float
    standard_error: float
    shift: float
    written: float

    @property
    def biased(self) -> bool:
        """Whether it had been pulled away by what was missing."""
        return abs(self.shift) > _MOVED

    @property
    def too_much(self) -> str:
        """By how much it came out wrong without the effects, in words."""
        return f"{abs(self.without / self.found - 1):.1%} too {'high' if self.without > self.found else 'low'}"


@dataclass(frozen=True, eq=False)
class Gained:
    """Effects added to a model.

    added        the fits
    names        of the effects that were added
    p_value      how often noise alone would gain as much
    floor        the error that the sensor's noise makes
    """

    added: Added
    names: tuple[str, ...]
    p_value: float
    floor: float

    @property
    def helps(self) -> bool:
        """Whether the effect gains more than noise would."""
        return self.p_value < CHANCE

    @property
    def new(self) -> tuple[Chosen, ...]:
        """The effects that were added."""
        return tuple(one for one in self.added.effects if one.effect.name in self.names)

    @property
    def moved(self) -> list[Moved]:
        """The car's numbers, those that the effects moved most first."""
        return moved_between(self.added, self.added)


def gained(added: Added, names: Sequence[str], starts: int = 1) -> Gained:
    """What adding the effects of these names brought (S. S. Wilks 1938). Where the fit begins had been chosen of so
    many ``starts``."""
    from scipy.special import gammaincc

    problem = added.problem
    gain = problem.deviance(added.before) - problem.deviance(added.after)
    which = [index for index, one in enumerate(added.effects) if one.effect.name in names]
    numbers = max(1, len(moves_of(added.effects, which)))
    return Gained(added, tuple(names), min(1.0, starts * float(gammaincc(numbers / 2, max(gain, 0.0) / 2))),
                  floor_error(problem, noise_of(problem, added.after)))


def moved_between(first: Added, last: Added) -> list[Moved]:
    """The car's numbers without the effects that ``first`` added, and with all that ``last`` has; those that moved most
    first."""
    found = [
        Moved(one.name, one.nominal, one.without, one.without_standard_error, now.found, now.found_standard_error,
              (now.found - one.without) / now.found_standard_error if now.found_standard_error > 0 else 0.0,
              now.written)
        for one, now in zip(first.numbers, last.numbers, strict=True)
    ]
    return sorted(found, key=lambda one: -abs(one.shift))


# --- in words ---


def errors(found: Gained) -> list[tuple[str, float, str]]:
    """The error before, after and of the noise: which of them, the error, and what it is of."""
    added = found.added
    return [
        ("before", added.error_before, "as the file says, distances as recorded: where ridelog compare begins"),
        ("", added.error_refitted, "the car's numbers and distances refitted within their tolerance"),
        ("after", added.error_after, f"with {' and '.join(found.names)}, all refitted in the same way"),
        ("", added.error_as_written, "as the new file says, distances as recorded: where compare begins with it"),
        ("of noise", found.floor, "about, from the sensor's noise alone"),
    ]


def judgement(found: Gained) -> list[str]:
    """The effect's numbers, and whether it is to be kept."""
    lines = [f"{one.effect.name}: {numbers_of(one) or one.effect.title}." for one in found.new]
    lines += wandering.told(found.added.moved_m)
    for one in found.new:
        at = [parameter.name for parameter in one.effect.parameters if parameter.moves
              and min(abs(one.values[parameter.name] - end) for end in (parameter.low, parameter.high)
                      if end != parameter.default) <= _AT_BOUND * abs(parameter.high)]
        if at:
            lines.append(f"At its bound: {', '.join(at)}. That is where the fit was stopped, not what was measured.")
    if found.helps:
        lines.append(f"It helps: the probability that noise alone improves the fit as much is {chance(found.p_value)}.")
    else:
        lines.append(f"WARNING: it does not help. The probability that noise alone improves the fit as much is "
                     f"{chance(found.p_value)}; these runs are no reason to keep it.")
    return lines


def bias(names: Sequence[str], moved: Sequence[Moved]) -> str:
    """What the car's numbers, most moved first, had been taken for without the effects."""
    together = " and ".join(names)
    biased = [one for one in moved if one.biased]
    if not biased:
        return f"No number of the car moved by more than {_MOVED:g} standard errors when {together} was added."
    listed = ", ".join(one.name for one in biased[:_NAMED])
    more = f" and {len(biased) - _NAMED} more" if len(biased) > _NAMED else ""
    worst = biased[0]
    return (f"Without {together} these were biased: {listed}{more}. {worst.name} came out {worst.too_much}, "
            f"{abs(worst.shift):.1f} standard errors away from what it is with {'it' if len(names) == 1 else 'them'}.")


MOVED_HEADS = ("Number", "Now", "Without", "With", "Shift", "")
MOVED_HINT = ("Without, With: refitted freely, without and with the effect, as a difference from the given value, ± "
              "standard error. Now: the value in the new file, held near the given one. Shift: from Without to With, "
              "in standard errors; above two the number was biased because the effect was missing.")


def moved_rows(moved: Sequence[Moved]) -> Iterator[tuple[str, str, str, str, str, str]]:
    """Under ``MOVED_HEADS``."""
    for one in moved:
        yield (one.name, f"{one.written:.5g}", f"{one.without / one.nominal - 1:+.1%}",
               f"{one.found / one.nominal - 1:+.1%} ± {one.standard_error / one.found:.1%}", f"{one.shift:+.1f}",
               "was biased" if one.biased else "")


# --- for a program ---


def as_json(found: Gained) -> dict[str, Any]:
    """The contract's object, of the effect that was added last."""
    added, new = found.added, found.new[-1]
    return {
        "effect": new.effect.name, "parameters": dict(new.values), "standard_errors": finite(new.standard_errors),
        "error_before": added.error_before, "error_after": added.error_after,
        "error_refitted": added.error_refitted, "error_as_written": added.error_as_written,
        "noise_floor_error": found.floor, "p_value": found.p_value, "helps": found.helps,
        "numbers": [{"name": one.name, "nominal": one.nominal, "without": one.without,
                     "without_standard_error": one.without_standard_error, "with": one.found,
                     "with_standard_error": one.standard_error, "shift_standard_errors": one.shift,
                     "written": one.written}
                    for one in found.moved],
        "biased": [one.name for one in found.moved if one.biased],
    }
