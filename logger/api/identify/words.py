"""A fit in plain words: what was found, how sure it is, and whether to believe it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from logger.identification.drive_model import DriveModel
from logger.identification.noise_models import UNTESTED, Test, autocorrelation, cross_correlation
from logger.identification.prediction_error_fit import Fit, least_share
from logger.identification.shared_road_covariance import CommonRoughness, may_have_common
from logger.lab.readings_fit import ReadingsFit
from logger.runs import Run
from logger.vehicle.named_parameters import Coordinates

NORMAL_95 = 1.959964
_MENTIONED = 0.7
_DOUBTFUL = 0.1


def tests(model: DriveModel, fit: Fit) -> tuple[Test, Test]:
    """Whether the fit's residuals are white, and whether they are free of the road; untested where they are no more
    than the predictions' own inaccuracy."""
    if fit.error_after < least_share(model):
        return UNTESTED, UNTESTED
    inputs = [whitener(fit.low_pass.apply(one)) for whitener, one in
              zip(fit.noise.whiteners, model.inputs(np.array(list(fit.parameters.values()))), strict=True)]
    return (autocorrelation(fit.white, fit.noise.parameters - 1),
            cross_correlation(fit.white, inputs, fit.sensitivities))


def as_json(fit: Fit, white: Test, free_of_road: Test) -> dict[str, Any]:
    """All of it for a program; null where nothing is known."""
    names = list(fit.parameters)
    return {
        "parameters": fit.parameters, "standard_errors": fit.standard_errors,
        "error_before": fit.error_before, "error_after": fit.error_after, "converged": fit.converged,
        "start": {one.name: one.start for one in fit.free},
        "bounds": {one.name: [one.low, one.high] for one in fit.free},
        "interval_95": {name: list(interval(fit, name)) for name in names},
        "correlation": {name: dict(zip(names, row, strict=True))
                        for name, row in zip(names, fit.correlation.tolist(), strict=True)},
        "at_bound": fit.at_bound, "iterations": fit.iterations,
        "noise": {"model": fit.noise.name, **fit.noise.levels},
        "residuals_white_p_value": _p_value(white), "residuals_free_of_road_p_value": _p_value(free_of_road),
        "cannot_tell": list(doubts(fit, white, free_of_road)),
    }


def doubts(fit: Fit, white: Test, free_of_road: Test) -> Iterator[str]:
    """What stands between the estimates and their being believed, each in words; nothing when all is well."""
    yield from (finding.words for finding in fit.verdict)
    if not fit.converged:
        yield "the fit did not converge."
    if fit.at_bound:
        yield f"{', '.join(fit.at_bound)} ended at a bound, which is where it was stopped and not what was measured."
    if not white.passed:
        yield (f"residuals are not white (p = {white.p_value:.2g}): the noise model is incomplete, and the standard "
               "errors are a guide only.")
    if not free_of_road.passed:
        yield (f"residuals follow the road (p = {free_of_road.p_value:.2g}): the model lacks something of the car or "
               "of the road, and the estimates are biased by it.")


def _p_value(test: Test) -> float | None:
    return test.p_value if test.degrees else None


def interval(fit: Fit, name: str) -> tuple[float, float]:
    """The 95 % interval of an estimate; of a size in the logarithm, so that it stays above 0."""
    value, error = fit.parameters[name], fit.standard_errors[name]
    if next(one for one in fit.free if one.name == name).by_factors:
        factor = float(np.exp(NORMAL_95 * error / value))
        return value / factor, value * factor
    return value - NORMAL_95 * error, value + NORMAL_95 * error


def lines(fit: Fit, white: Test, free_of_road: Test) -> Iterator[str]:
    """What a person reads."""
    steps = f"{fit.iterations} steps"
    yield (f"Converged in {steps}." if fit.converged else
           f"NOT CONVERGED in {steps}: do not use these values; try other starts (--start, --tries) or fewer numbers.")
    if len(fit.ends) > 1:
        yield _ends(fit)
    yield (f"Error, rms of measured minus model over rms of measured: {fit.error_before:.4f} before, "
           f"{fit.error_after:.4f} after.")
    yield ""
    yield from _table(fit)
    yield ""
    yield f"The residual is modelled as {fit.noise.words}."
    yield from _correlations(fit)
    yield from _checks(white, free_of_road)
    yield from _limits(fit, sound=not any(doubts(fit, white, free_of_road)))


def common_words(model: DriveModel, common: CommonRoughness) -> Iterator[str]:
    """Whether drives over one obstacle, or one profile, were over one road, and what that means for the errors."""
    runs = len(model.records)
    if common.share:
        yield (f"These {runs} runs are over one road: they share {common.share:.0%} of the roughness that the profile "
               f"does not contain. The standard errors count that; they are up to {common.growth:.2f} times those of "
               "runs over roads of their own.")
    elif may_have_common(model) and common.fit.noise.name != "road":
        yield (f"If these {runs} runs are over one and the same place, the error of its profile is the same in all of "
               f"them: then standard errors are up to {np.sqrt(runs):.2f} times those above.")


def record_words(found: ReadingsFit) -> Iterator[str]:
    """What of the records was used in addition to their samples."""
    if found.rounded:
        yield "Readings are rounded: each says in which step it was, and no more (step_mps2 in run.yaml)."
    if found.moved_m:
        yield (f"Places are uncertain (place_std_m in run.yaml): they were corrected by up to {found.moved_m:.2g} m, "
               "and the standard errors include that uncertainty.")


def record_json(found: ReadingsFit, common: CommonRoughness, records: Sequence[Run]) -> dict[str, Any]:
    """The same as an object."""
    return {"common_roughness": common.share, "rounding_by_bounds": found.rounded, "moved_m": found.moved_m,
            "runs": [record.name for record in records]}


def _ends(fit: Fit) -> str:
    scale = np.array([fit.standard_errors[one.name] for one in fit.free])
    best = fit.ends[np.argmin(np.abs((fit.ends - np.array(list(fit.parameters.values()))) / scale).max(axis=1))]
    same = int((np.abs((fit.ends - best) / scale).max(axis=1) < 1.0).sum())
    return f"{same} of {len(fit.ends)} starts end at the same place; the best of all is taken."


def _table(fit: Fit) -> Iterator[str]:
    width = max(len("parameter"), *map(len, fit.parameters))
    yield (f"{'parameter':{width}} {'start':>10} {'estimate':>10} {'std. error':>11} {'relative':>9}   "
           f"{'95 % interval':^21}  moved")
    for one in fit.free:
        value, error = fit.parameters[one.name], fit.standard_errors[one.name]
        low, high = interval(fit, one.name)
        relative = f"{error / abs(value):.2%}" if one.by_factors else "-"
        moved = f"{value / one.start - 1:+.1%}" if one.by_factors else f"{value - one.start:+.3g}"
        mark = "  AT ITS BOUND" if one.name in fit.at_bound else ""
        yield (f"{one.name:{width}} {one.start:10.5g} {value:10.6g} {error:11.3g} {relative:>9}   "
               f"{low:9.5g} to {high:9.5g}  {moved}{mark}")


def _correlations(fit: Fit) -> Iterator[str]:
    names = list(fit.parameters)
    pairs = [(abs(fit.correlation[i, j]), fit.correlation[i, j], names[i], names[j])
             for j in range(len(names)) for i in range(j)]
    large = sorted((pair for pair in pairs if pair[0] > _MENTIONED), reverse=True)
    if large:
        yield f"Estimates that err together (correlation beyond {_MENTIONED:g}): " + "; ".join(
            f"{first} and {second} {value:+.2f}" for _, value, first, second in large) + "."


def _checks(white: Test, free_of_road: Test) -> Iterator[str]:
    if white.degrees:
        yield (f"Are residuals white (Ljung-Box)? p = {white.p_value:.2g} over {white.degrees} degrees of freedom: "
               + ("yes, standard errors can be trusted." if white.passed else
                  "no, the noise model is incomplete; the standard errors are a guide only."))
    if not white.degrees and not free_of_road.degrees:
        yield "There is no residual to test."
    if free_of_road.degrees:
        yield (f"Do residuals follow the road? p = {free_of_road.p_value:.2g} over {free_of_road.degrees} degrees of "
               "freedom: " + ("no." if free_of_road.passed else
                              "yes, the model lacks something of the car, and the estimates are biased by that."))


def _limits(fit: Fit, sound: bool) -> Iterator[str]:
    if fit.at_bound:
        yield (f"At a bound: {', '.join(fit.at_bound)}. That is where it was stopped, not what was measured; its "
               "standard error means nothing. Widen --bounds, or ask what the model lacks.")
        if fit.noise.name != "white":
            yield ("Coloured noise can absorb what the model lacks, most of all in a sweep, which has one frequency "
                   "at a time: try --noise white.")
    for finding in fit.verdict:
        yield f"Cannot tell: {finding.words}"
    sizes = [one.name for one in fit.free if one.by_factors]
    vague = {name: error / abs(fit.parameters[name]) for name, error in fit.standard_errors.items()
             if name in sizes and error > _DOUBTFUL * abs(fit.parameters[name])}
    if vague:
        listed = ", ".join(f"{name} ({share:.0%})" for name, share in vague.items())
        yield f"Poorly determined by these runs: {listed}."
    elif sound:
        yield "These runs determine all that was asked."
    if len(fit.parameters) > 1:
        yield _least_known(fit)


def _least_known(fit: Fit) -> str:
    """The combination that is known worst: the longest axis of the error ellipsoid in relative changes."""
    names = list(fit.parameters)
    scale = np.abs(Coordinates(fit.free).slopes(np.array(list(fit.parameters.values()))))
    powers, directions = np.linalg.eigh(fit.covariance / np.outer(scale, scale))
    ends = [directions[:, 0], directions[:, -1]]
    said = []
    for direction, power in zip(ends, (powers[0], powers[-1]), strict=True):
        shares = direction / direction[np.argmax(np.abs(direction))]
        large = sorted(zip(-np.abs(shares), names, shares, strict=True))[:4]
        along = ", ".join(f"{name} {share:+.2f}" for size, name, share in large if -size > 0.1)
        said.append(f"{along} ({np.sqrt(max(power, 0.0)):.2%})")
    return f"Known best in the combination {said[0]}, worst in {said[1]}."
