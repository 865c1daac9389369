"""A comparison in sentences for a person, and as one object for a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from logger.lab.compare import Comparison, Standing
from logger.lab.residual_tests.tests import ResidualTestResult
from logger.lab.residuals.block_statistics import rms
from logger.lab.residuals.breakdown import Part
from logger.left_out import left_out_json
from logger.report.band_text import band_json
from logger.report.error_scale_text import error_words, errors_json
from logger.report.quantities import signal_errors
from logger.report.removed_text import removed_json, removed_words
from logger.runs import normalised_rms_error, runs_left_out

_HELPS = 0.97
_MOST_MOVES = 3


def headline(found: Comparison) -> list[str]:
    """How well the model does, with its numbers as they stand and refitted."""
    plain, refitted = found.plain, found.refitted
    residual, measured = (rms(one) for one in (plain.residuals.residual, plain.residuals.measured))
    lines = [f"The residual (measured - model) is {residual:.3g} m/s2 r.m.s., of {measured:.3g} m/s2 measured: "
             f"error {plain.error:.3f}, their ratio."]
    refit = "with masses, springs, dampers and distances refitted within their tolerance"
    if any(one.effect.parameters for one in found.effects):
        refit += " (and the numbers of its effects)"
    before, after = (one.error for one in found.steps)
    if after < _HELPS * before:
        lines.append(f"{refit.capitalize()}, the error is {after:.3f}: the refit removes {1 - (after / before)**2:.0%} "
                     "of the residual's power.")
    else:
        lines.append(f"Small mistakes in its numbers are not the cause: {refit}, the error stays {after:.3f}.")
    lines += error_words(found.steps, found.floor)
    lines += signal_errors({name: (error, refitted.signals[name]) for name, error in plain.signals.items()},
                           "{}, refitted {}")
    lines += removed_words(found.removed, found.band)
    if found.repeats is not None:
        apart = found.repeats.deviation_mps2
        lines.append(f"{' and '.join(found.repeats.names)} repeat each other and differ by {apart:.2g} m/s2 r.m.s. "
                     f"from their mean: no model can have an error below {apart / measured:.2g} on them.")
    if found.far:
        named = ", ".join(f"{name} by {found.moves[name]:+.0%}" for name in found.far[:_MOST_MOVES])
        lines.append(f"The refit moved {named}, which is beyond their tolerance. Measure them: the vehicle's file is "
                     "wrong there, or an effect that the model lacks biases them.")
    return lines


def evidence(found: Comparison) -> list[str]:
    """What speaks for a missing effect, or against one."""
    if not found.exceeds_discrepancy:
        return ["The residual is smaller than the difference between two correct simulations of one car: it is no "
                "evidence."]
    if not found.tests_found:
        return ["No test finds more than noise in the residual."]
    return [test.sentence for test in found.tests_found]


def conclusion(found: Comparison) -> str:
    """What it comes to, and what to do next."""
    if found.missing and not any(test.road for test in found.tests_found):
        return ("The residual is hardly more than noise, but only with numbers far from those of the vehicle's file. "
                "Either the file is wrong, or such numbers imitate an effect that is missing. Next: ridelog diagnose "
                f"with the same arguments; where it finds none, ridelog identify --free {','.join(found.far)} with "
                "them finds the numbers from the runs alone.")
    if found.missing:
        return ("The residual depends on the road and the car's motion, so it is more than noise. Next: ridelog "
                "diagnose with the same arguments says which physical effect would explain it.")
    if found.tests_found and not all(test.test.of_placement for test in found.tests_found):
        return ("The residual does not depend on the road: it looks like coloured noise of the sensor or the engine. "
                "Nothing here asks for another effect of the car.")
    if found.removed.drifting_sensors or found.removed.distance_error_m > 0:
        return ("Nothing else is missing: apart from what is removed above, the residual asks for no effect of the "
                "car. Rougher roads or other speeds would test the model harder.")
    return "Nothing here asks for another effect. Rougher roads or other speeds would test the model harder."


# --- for a program ---


def as_json(found: Comparison) -> dict[str, Any]:
    """The comparison as one JSON object; error and where are of the model as it stands."""
    return {
        **_standing_json(found.plain), **left_out_json(runs_left_out(found.plain.residuals.runs)),
        "evidence": [*headline(found), *evidence(found), conclusion(found)],
        "missing": found.missing, **band_json(found.band), **removed_json(found.removed),
        **errors_json(found.steps, found.floor),
        "refitted": {**_standing_json(found.refitted), "error": found.steps[-1].error,
                     "moves": dict(found.moves), "moved_far": list(found.far)},
        "repeats": None if found.repeats is None else {
            "runs": list(found.repeats.names), "deviation_mps2": found.repeats.deviation_mps2},
        "marks": [_test_json(test, test in found.tests_found) for test in found.tests.tests],
    }


def _standing_json(standing: Standing) -> dict[str, Any]:
    residuals, where = standing.residuals, standing.where
    return {
        "error": standing.error, "signals": dict(standing.signals),
        "runs": [{"run": run.name, "error": _finite(normalised_rms_error([run], [prediction])),
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
    return {f"from_{unit}": part.low, f"to_{unit}": part.high, "error": _finite(part.error),
            "error_power_share": part.share}


def _test_json(test: ResidualTestResult, found: bool) -> dict[str, Any]:
    return {"name": test.name, "found": found, "value": _finite(test.value), "unit": test.unit,
            "standard_error": _finite(test.standard_error), "p_value": _finite(test.p_value)}


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else value
