"""Whether the data can distinguish the numbers at all, in words.

Problem: a fit always ends somewhere. Where the data say nothing of a number, or only of a combination of several, the
place it ends at is an accident that looks like a result. Solution: the predictions' derivatives, by the relative change
of each number and in units of the noise, are looked at before anything is believed:

- a number whose derivative is nothing is silent;
- numbers whose derivatives cancel in some combination can be estimated only together (a vanishing singular value of the
  scaled derivatives), whatever the noise;
- a direction whose standard error exceeds half a number's size, or half the width of its bounds, is too weak; of some
  numbers, such as a speed that was recorded, a rougher estimate than they came with is worth nothing.

And a model that at its best leaves as much as there was has not been fitted to this record, whatever its numbers.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array
from logger.errors import CheckFailed
from logger.vehicle.named_parameters import WEAKEST

SILENT, TOGETHER, WEAK, UNEXPLAINED = "silent", "together", "weak", "unexplained"
TURNED, APART = "turned", "apart"
NOTHING = 1e-4
"""What counts as nothing, relative, of derivatives that are differences."""
NOT_ONE_ROAD = ("It is not the same road, not the same line on it, or their distances disagree by more than ridelog "
                "can correct")
# Of a direction is named what has this share of its largest change, or of the largest trace that one alone would leave.
_PART_OF, _TRACE_OF = 0.1, 0.9
_EQUAL, _NEARLY_EQUAL = 0.05, 0.2
# Rms of the residual over that of the measurement; and how much less of it is clearly less.
_EXPLAINS_NOTHING, _CLEARLY_LESS = 0.98, 0.8


@dataclass(frozen=True)
class Finding:
    """Something that the data cannot identify.

    kind         silent, together, weak, unexplained, turned or apart
    direction    relative changes by name that the predictions do not feel, the largest 1; empty where it is no number
                 that cannot be estimated
    words        a sentence
    """

    kind: str
    direction: dict[str, float]
    words: str


class NotIdentifiable(CheckFailed):
    """The data do not determine what was asked. ``findings`` say what, and the text says it in words;
    ``error_before`` is the model's error at the start values, None: not known."""

    def __init__(self, findings: Sequence[Finding], error_before: float | None = None) -> None:
        super().__init__("the data cannot tell: " + " ".join(finding.words for finding in findings))
        self.findings, self.error_before = list(findings), error_before


def beside(start: Array, count: int, low: Array, high: Array) -> Array:
    """A point (m,) near a start, its first ``count`` numbers a little off, where no symmetry hides a dependence."""
    moved = start.copy()
    moved[:count] += 0.03 * np.cos(1.0 + 2.0 * np.arange(count)) * (count > 1)
    return np.clip(moved, low, high)


def structural(names: Sequence[str], derivatives: Array, size: float, nothing: float = NOTHING) -> list[Finding]:
    """What no amount of such data could determine.

    derivatives    (N, p) of the predictions by the relative change of each number
    size           root of the sum of squares of the predictions
    nothing        what counts as nothing, relative
    """
    lengths = np.sqrt((derivatives**2).sum(axis=0))
    heard = lengths > nothing * size
    findings = [
        Finding(SILENT, {name: 1.0}, f"the record does not depend on {name}: this drive, with the sensor where it "
                                     "sits, cannot show it. Hold it fixed.")
        for name, one in zip(names, heard, strict=True) if not one
    ]
    kept = [name for name, one in zip(names, heard, strict=True) if one]
    if not kept:
        return findings
    _, values, directions = np.linalg.svd(derivatives[:, heard] / lengths[heard], full_matrices=False)
    for value, direction in zip(values, directions, strict=True):
        if value < nothing * len(kept):
            findings.append(_together(kept, direction / lengths[heard], direction))
    return findings


def statistical(names: Sequence[str], covariance: Array, weakest: Array | None = None) -> list[Finding]:
    """What the noise leaves too uncertain: covariance (p, p) of the relative changes.

    weakest    (p,) the largest deviation of each that is still an estimate, infinite where any is; None: ``WEAKEST``
    """
    limits = np.full(len(names), WEAKEST) if weakest is None else weakest
    asked = np.isfinite(limits)
    names, limits, covariance = np.array(names)[asked].tolist(), limits[asked], covariance[np.ix_(asked, asked)]
    deviations = np.sqrt(np.diag(covariance))
    weak = deviations > limits
    if not weak.any():
        return []
    findings = []
    powers, directions = np.linalg.eigh(covariance / np.outer(limits, limits))
    traces = np.sqrt(np.maximum(np.diag(np.linalg.pinv(covariance, hermitian=True)), 0.0))
    for power, direction in zip(powers[::-1], directions.T[::-1], strict=True):
        if power <= 1 or not weak.any():
            break
        shares = _shares(names, direction * limits, direction * limits * traces)
        errors = {name: f"{deviations[names.index(name)]:.0%}" for name in shares}
        if len(shares) == 1:
            (name, error), = errors.items()
            words = (f"this drive does not determine {name}: its standard error would be {error} of its value. Hold it "
                     "fixed, or add runs that excite it.")
        else:
            why = "they nearly share one scale" if _one_scale(shares, _NEARLY_EQUAL) else (
                f"the noise hides {_moves(shares)}")
            words = (f"this drive does not separate {_listed(list(shares))}: {why} (standard errors "
                     f"{', '.join(errors.values())}). Hold one of them fixed, or add runs that differ.")
        findings.append(Finding(WEAK, shares, words))
        weak &= ~np.isin(names, list(shares))
    return findings


def unexplained(error: float) -> list[Finding]:
    """Whether a model explains anything: ``error`` is the rms of what it leaves over that of what was measured."""
    if error < _EXPLAINS_NOTHING:
        return []
    return [Finding(UNEXPLAINED, {}, f"the model explains nothing of what was measured, even at its best (NRMSE "
                    f"{error:.2f}): check that the road, the position on it, the excitation and the vehicle are the "
                    "right ones.")]


def upside_down(error: float, turned_error: float, what: str, pushed: bool) -> list[Finding]:
    """Whether a record is explained far better when its sign is changed: errors as measured and with the sign changed,
    as ``unexplained``; ``what`` was measured, and whether forces ``pushed`` it."""
    if turned_error > _CLEARLY_LESS * error:
        return []
    other = "The force may have the other sign." if pushed else "Or a step has the wrong sign or position."
    return [Finding(TURNED, {}, f"the {what} seems upside down (up is positive): the NRMSE is {error:.2f}, and "
                                f"{turned_error:.2f} with the sign changed. {other}")]


def _together(names: Sequence[str], direction: Array, trace: Array) -> Finding:
    shares = _shares(names, direction, trace)
    if len(shares) > 1 and _one_scale(shares, _EQUAL):
        words = (f"{_listed(list(shares))} share one scale: all of them larger by one factor give the same record. "
                 "Hold one of them fixed at a value that is known.")
    else:
        words = (f"{_listed(list(shares))} can be estimated only together: {_moves(shares)} gives the same record. "
                 "Hold one of them fixed.")
    return Finding(TOGETHER, shares, words)


def _shares(names: Sequence[str], direction: Array, trace: Array) -> dict[str, float]:
    """The parts of a direction that count, the largest 1; ``trace`` (p,) is what each alone would leave."""
    scaled = direction / direction[np.argmax(np.abs(direction))]
    felt = np.abs(trace) / np.abs(trace).max()
    return {name: float(share) for name, share, one in zip(names, scaled, felt, strict=True)
            if abs(share) > _PART_OF or one > _TRACE_OF}


def _one_scale(shares: dict[str, float], apart: float) -> bool:
    return all(abs(share - 1) < apart for share in shares.values())


def _moves(shares: dict[str, float]) -> str:
    """The direction in words."""
    return "a change of " + _listed([f"{name} by {share / 100:+.1%}" for name, share in shares.items()])


def _listed(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
