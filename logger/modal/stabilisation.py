"""Which poles of a model are modes: the choice that an analyst makes on a stabilisation diagram, made by rule.

Problem: a model of order 20 has ten poles, and a structure that shows five modes has five. Analysts plot the poles of
all orders and pick by eye the ones that stay.

Solution, in words that are printed with the result: the order is where a further state stops paying for itself
(Schwarz's criterion on the one-step errors). A pole of that order is a mode when it swings, when its place is known to
within its half bandwidth and what the record resolves, and when models of the next orders have it within that half
bandwidth. What is less certain has to show more, not less: its standard errors count how far it moves from order to
order. What is known to a sixth of its half bandwidth needs no such witness: larger models split what is heavily damped.
"""

from __future__ import annotations

import numpy as np

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


def judge(found: OrderPoles, covariance: Array, larger: list[OrderPoles], scale: Array, duration_s: float
          ) -> tuple[list[FoundMode], list[Rejected]]:
    """Modes and rejected poles of the chosen model.

    covariance    (n, 2, 2) of Re s, Im s of each pole [rad/s]
    larger        the models of the next orders
    scale         (channels,) what the channels were divided by
    duration_s    of the record: it resolves no less than 1 / duration
    """
    modes: list[FoundMode] = []
    rejected: list[Rejected] = []
    for k, pole in enumerate(found.poles):
        is_known_well = _KNOWN_WELL**2 * np.trace(covariance[k]) < pole.real**2
        near = [] if is_known_well else larger[:_NEIGHBOURS]
        moves = _moves(complex(pole), near)
        both = covariance[k] + (np.outer(middle := moves[len(moves) // 2], middle) if len(moves) else 0.0)
        frequency, ratio = float(frequency_hz(pole)), float(damping_ratio(pole))
        frequency_std, damping_std = errors_of(complex(pole), both)
        width = abs(pole.real) + 2 * np.pi / duration_s
        reason = _why_not(complex(pole), frequency_std, damping_std, moves, len(near))
        if reason or np.trace(both) > width**2:
            reason = reason or "its place is known less well than its resonance is wide"
            rejected.append(Rejected(frequency, ratio, reason))
        else:
            shape = normalised(found.shapes[:, k] * scale)
            modes.append(FoundMode(frequency, ratio, frequency_std, damping_std, shape))
    return modes, rejected


def _moves(pole: complex, larger: list[OrderPoles]) -> Array:
    """How far (m, 2) [rad/s] the pole is moved in those of the larger models that have it, the nearest first.

    A model has it when one of its poles lies within the half-power points of its resonance, -Re s to both sides.
    """
    nearest = [model.poles[np.abs(model.poles - pole).argmin()] - pole for model in larger if len(model.poles)]
    within = sorted((move for move in nearest if abs(move) <= abs(pole.real)), key=abs)
    return np.array([(move.real, move.imag) for move in within]).reshape(-1, 2)


def _why_not(
    pole: complex, frequency_std_hz: float, damping_std: float, moves: Array, models: int
) -> str:
    hz, ratio = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    reasons = {
        "parts of the record do not have it": not np.isfinite(frequency_std_hz),
        "it grows instead of decaying": ratio <= 0,
        "damped so heavily that it hardly swings": ratio > _MOST_DAMPING,
        "no damping to be seen: a hum, not a mode": ratio < max(_NO_DAMPING, min(_HUM_DAMPING, 2 * damping_std)),
        f"its frequency is uncertain by {frequency_std_hz / hz:.0%}": frequency_std_hz > LARGEST_FREQUENCY_ERROR * hz,
        f"its damping ratio is uncertain by {damping_std:.2f}": damping_std > LARGEST_DAMPING_ERROR,
        f"only {len(moves)} of the next {models} orders have it": len(moves) < min(_MUST_HAVE_IT, models),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")
