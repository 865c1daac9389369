"""Which poles of a model are modes: the choice that an analyst makes on a stabilisation diagram, made by rule.

Problem: a model of order 20 has ten poles, and a structure that shows five modes has five. Analysts plot the poles of
all orders and pick by eye the ones that stay.

Solution, in words that are printed with the result: the order is where a further state stops paying for itself
(Schwarz's criterion on the one-step errors). A pole of that order is a mode when it swings, when its frequency and
damping come with errors small enough to mean something, and when models of the next orders have it too, within those
errors or a third of half its width. Where the damping is known to a sixth of itself it needs no such witness: larger
models split what is heavily damped, and a pole that chance made has no damping that is known so well.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.modal.mode import (
    Array,
    FoundMode,
    OrderPoles,
    Rejected,
    damping_ratio,
    errors_of,
    frequency_hz,
    normalised,
)

_NEIGHBOURS, _MUST_HAVE_IT = 4, 3
_SAME_SD, _SAME_SHARE, _SAME_WIDTH = 3.0, 0.01, 0.3  # standard deviations; of its frequency; of half its width
_KNOWN_WELL = 6.0
_MOST_DAMPING = 0.9
LARGEST_FREQUENCY_ERROR = 0.1  # of the frequency
LARGEST_DAMPING_ERROR = 0.15
_HUM_DAMPING, _NO_DAMPING = 5e-4, 1e-6


def best_size(misfit: Array, count: int, parameters_per_step: int) -> int:
    """Index of the misfit (log det of the errors' covariance, larger and larger models) best by Schwarz's criterion."""
    return int((count * misfit + np.log(count) * parameters_per_step * np.arange(len(misfit))).argmin())


def generous_size(misfit: Array, count: int, parameters_per_step: int) -> int:
    """The same by Akaike's criterion, which takes more, as a regression needs that must imitate noise; 0 stays 0."""
    if best_size(misfit, count, parameters_per_step) == 0:
        return 0
    return int((count * misfit + 2 * parameters_per_step * np.arange(len(misfit))).argmin())


def judge(
    found: OrderPoles, covariance: Array, larger: list[OrderPoles], scale: Array, peaks: npt.NDArray[np.bool_],
) -> tuple[list[FoundMode], list[Rejected]]:
    """Modes and rejected poles of the chosen model.

    covariance    (n, 2, 2) of Re s, Im s of each pole [rad/s]
    larger        the models of the next orders
    scale         (channels,) what the channels were divided by
    peaks         (n,) whether each pole has a peak to show, where the method has poles that do not
    """
    modes: list[FoundMode] = []
    rejected: list[Rejected] = []
    for k, pole in enumerate(found.poles):
        frequency, ratio = float(frequency_hz(pole)), float(damping_ratio(pole))
        frequency_std, damping_std = errors_of(complex(pole), covariance[k])
        reason = "" if peaks[k] else "no peak of its own: it shapes the floor between the peaks"
        reason = reason or _why_not(frequency, ratio, frequency_std, damping_std)
        if ratio < _KNOWN_WELL * damping_std:
            reason = reason or _comes_and_goes(found, k, covariance, larger)
        if reason:
            rejected.append(Rejected(frequency, ratio, reason))
        else:
            shape = normalised(found.shapes[:, k] * scale)
            modes.append(FoundMode(frequency, ratio, frequency_std, damping_std, shape))
    return modes, rejected


def _why_not(frequency_hz: float, ratio: float, frequency_std_hz: float, damping_std: float) -> str:
    if not np.isfinite(frequency_std_hz):
        return "parts of the record do not have it"
    if ratio <= 0:
        return "it grows instead of decaying"
    if ratio > _MOST_DAMPING:
        return "damped so heavily that it hardly swings"
    if ratio < _NO_DAMPING or ratio < min(_HUM_DAMPING, 2 * damping_std):
        return "no damping to be seen: a hum, not a mode"
    if frequency_std_hz > LARGEST_FREQUENCY_ERROR * frequency_hz:
        return f"its frequency is uncertain by {frequency_std_hz / frequency_hz:.0%}"
    if damping_std > LARGEST_DAMPING_ERROR:
        return f"its damping ratio is uncertain by {damping_std:.2f}"
    return ""


def _comes_and_goes(found: OrderPoles, k: int, covariance: Array, larger: list[OrderPoles]) -> str:
    near = larger[:_NEIGHBOURS]
    pole = found.poles[k]
    reach = max(_SAME_SD * float(np.sqrt(np.trace(covariance[k]))), _SAME_SHARE * abs(pole), _SAME_WIDTH * -pole.real)
    having = sum(bool(len(model.poles)) and bool(np.abs(model.poles - pole).min() <= reach) for model in near)
    if having >= min(_MUST_HAVE_IT, len(near)):
        return ""
    return f"only {having} of the next {len(near)} orders have it"
