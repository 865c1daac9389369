"""A model compared with measurements: how large the error is, where it sits, and what kind of thing is missing.

Problem: the numbers of a car are never exact, and a small mistake in them leaves an error that says nothing about
physics. Solution: the error is told and located as the model stands; then the car's numbers and the distances of the
runs are refitted within what they are usually off, and the marks are read from what is left after that. When a number
has to move much farther than such numbers are off, that is told as well: a missing effect pulls at them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from logger.lab import wandering
from logger.lab.beside import Beside, Located, Part, located
from logger.lab.fitting import LEAST_SHARE, Problem
from logger.lab.marks import Mark, Marks, read_marks
from logger.lab.nuisance import Tolerance
from logger.lab.settling import settled
from logger.runs import normalised_rms_error
from logger.simulation.simulated_runs import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

Array = npt.NDArray[np.float64]

_FAR = 3.0
"""So many standard deviations of what a number is usually off are far."""
_HELPS = 0.97
_MOST_MOVES = 3


@dataclass(frozen=True, eq=False)
class Standing:
    """A model beside its measurements, its error (rms left / rms measured, all samples that count), and where it is."""

    beside: Beside
    error: float
    where: Located


@dataclass(frozen=True, eq=False)
class Comparison:
    """What a comparison found.

    plain       the model as it stands
    refitted    with its numbers and the distances refitted within what they are usually off
    moves       by which share each number of the car, and of its effects, moved for that
    far         those that moved farther than such numbers are usually off, the farthest first
    moved_m     by how much a run was laid elsewhere than it was recorded for that, at most
    marks       of what the refitted model leaves
    """

    vehicle: str
    effects: tuple[Chosen, ...]
    plain: Standing
    refitted: Standing
    moves: Mapping[str, float]
    far: tuple[str, ...]
    moved_m: float
    marks: Marks

    @property
    def tells(self) -> bool:
        """Whether more is left than two right simulations of a car differ by."""
        return self.refitted.error >= LEAST_SHARE

    @property
    def marks_found(self) -> tuple[Mark, ...]:
        """The marks of what is left that matter."""
        return self.marks.found if self.tells else ()

    @property
    def missing(self) -> bool:
        """Whether what is left is tied to the road or the car's motion, or numbers had to move far: an effect may
        explain it."""
        return bool(self.far) or any(mark.road for mark in self.marks_found)


def compare(runs: SimulatedRuns, vehicle: Vehicle, effects: Sequence[Chosen] = (), given: Vehicle | None = None,
            tolerance: Tolerance | None = None) -> Comparison:
    """Compare a vehicle and its effects, with the values they have, with runs of one sample rate.

    given        the vehicle before any fit, if it has been refitted: what its numbers are usually off from
    tolerance    what is usually off, and by how much; None: the usual

    ValueError when the vehicle lacks what an effect needs.
    """
    car = compose(vehicle, effects)
    plain = _standing(Beside(runs.runs, car, runs.predict(car), runs.respond(car)))
    recorded = Problem(runs, given or vehicle, tolerance or Tolerance(), whole=True, stands=vehicle)
    refitted, moves, far, farther_m = _refitted(recorded, effects, plain)
    return Comparison(vehicle.name, tuple(effects), plain, refitted, moves, far, farther_m,
                      read_marks(refitted.beside, refitted.where, plain.beside))


def _refitted(
    recorded: Problem, effects: Sequence[Chosen], plain: Standing,
) -> tuple[Standing, dict[str, float], tuple[str, ...], float]:
    """The model refitted, how its numbers moved, which of them far, and how far the runs. One that is no better than
    the plain model is the plain one: the fit weighs every frequency by its noise, and may buy a better top with a worse
    body bounce."""
    names, nominal = recorded.nuisance.names, recorded.start(effects)
    problem, start = wandering.lying(recorded, nominal)
    state, _ = settled(problem, start)
    laid = wandering.relaid(problem, state, recorded)
    if laid is not problem:
        problem = laid
        state, _ = settled(problem, wandering.aligned_anew(problem, nominal))
    runs = problem.runs
    if problem.error(state) > plain.error:
        return plain, dict.fromkeys(names, 0.0), (), 0.0
    car = problem.car(state.effects, state.logs)
    responses = runs.respond(car, problem.moved_m(state.wander))
    away = np.abs(state.logs / problem.nuisance.deviations)
    far = tuple(names[index] for index in np.argsort(-away) if away[index] > _FAR)
    moves = {name: float(np.expm1(log)) for name, log in zip(names, state.logs, strict=True)}
    for before, after in zip(effects, state.effects, strict=True):
        moves |= {f"{before.effect.name}.{name}": after.values[name] / value - 1
                  for name, value in before.values.items() if value}
    refitted = _standing(Beside(runs.runs, car, state.predictions, responses))
    return refitted, moves, far, wandering.moved_m(recorded, problem)


def _standing(beside: Beside) -> Standing:
    return Standing(beside, normalised_rms_error(beside.runs, beside.predictions), located(beside))


# --- in words ---


def headline(found: Comparison) -> list[str]:
    """How well the model does, with its numbers as they stand and refitted."""
    plain, refitted = found.plain, found.refitted
    left, measured = (_rms(one) for one in (plain.beside.left, plain.beside.measured))
    lines = [f"The residual (measured - model) is {left:.3g} m/s2 r.m.s., of {measured:.3g} m/s2 measured: error "
             f"{plain.error:.3f}."]
    refit = "with masses, springs, dampers and distances refitted within their tolerance"
    if any(one.effect.parameters for one in found.effects):
        refit += " (and the numbers of its effects)"
    if refitted.error < _HELPS * plain.error:
        share = 1 - (refitted.error / plain.error) ** 2
        lines.append(f"{refit.capitalize()}, the error is {refitted.error:.3f}: the refit removes {share:.0%} of the "
                     "residual's power.")
    else:
        lines.append(f"Small mistakes in its numbers are not the cause: {refit}, the error stays {refitted.error:.3f}.")
    lines += wandering.told(found.moved_m)
    if found.far:
        named = ", ".join(f"{name} by {found.moves[name]:+.0%}" for name in found.far[:_MOST_MOVES])
        lines.append(f"The refit moved {named}, more than {_FAR:g} standard deviations of their tolerance. An effect "
                     "that the model lacks biases them: do not trust these values.")
    return lines


def evidence(found: Comparison) -> list[str]:
    """What speaks for a missing effect, or against one."""
    if not found.tells:
        return ["The residual is smaller than the difference between two correct simulations of one car: it is no "
                "evidence."]
    if not found.marks_found:
        return ["No test finds more than noise in the residual."]
    return [mark.sentence for mark in found.marks_found]


def conclusion(found: Comparison) -> str:
    """What it comes to, and what to do next."""
    if found.missing and not any(mark.road for mark in found.marks_found):
        return ("The residual is hardly more than noise, but only with numbers far from those of the vehicle's file. "
                "Either the file is wrong, or such numbers imitate an effect that is missing. Next: ridelog diagnose "
                "with the same arguments.")
    if found.missing:
        return ("The residual depends on the road and the car's motion, so it is more than noise. Next: ridelog "
                "diagnose with the same arguments says which physical effect would explain it.")
    if found.marks_found:
        return ("The residual does not depend on the road: it looks like coloured noise of the sensor or the engine. "
                "Nothing here asks for another effect of the car.")
    return "Nothing here asks for another effect. Rougher roads or other speeds would test the model harder."


# --- for a program ---


def as_json(found: Comparison) -> dict[str, Any]:
    """The comparison as one JSON object; error and where are of the model as it stands."""
    return {
        **_standing_json(found.plain),
        "evidence": [*headline(found), *evidence(found), conclusion(found)],
        "missing": found.missing,
        "refitted": {**_standing_json(found.refitted), "moves": dict(found.moves), "moved_far": list(found.far)},
        "marks": [_mark_json(mark, mark in found.marks_found) for mark in found.marks.marks],
    }


def _standing_json(standing: Standing) -> dict[str, Any]:
    beside, where = standing.beside, standing.where
    return {
        "error": standing.error,
        "runs": [{"run": run.name, "error": _finite(normalised_rms_error([run], [prediction])),
                  "samples": run.count - run.first}
                 for run, prediction in zip(beside.runs, beside.predictions, strict=True)],
        "where": {
            "frequency": [{**_part_json(part, "hz"), "name": part.name} for part in where.frequency],
            "speed": [_part_json(part, "mps") for part in where.speed],
            "amplitude": [_part_json(part, "mps2") for part in where.amplitude],
            "place": [{**_part_json(part, "m"), "run": part.name}
                      for part in sorted(where.place, key=lambda part: -part.share)],
        },
    }


def _part_json(part: Part, unit: str) -> dict[str, Any]:
    return {f"from_{unit}": part.low, f"to_{unit}": part.high, "error": _finite(part.error),
            "error_power_share": part.share}


def _mark_json(mark: Mark, found: bool) -> dict[str, Any]:
    return {"name": mark.name, "found": found, "value": _finite(mark.value), "unit": mark.unit,
            "standard_error": _finite(mark.standard_error), "p_value": _finite(mark.p_value)}


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else value


def _rms(signals: Sequence[Array]) -> float:
    return float(np.sqrt(sum(float(one @ one) for one in signals) / sum(map(len, signals))))
