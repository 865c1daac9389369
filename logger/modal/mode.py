"""Modes with their uncertainty, and which poles of a model are modes.

A pole exp(s t) of a structure is quoted as a natural frequency |s| / 2 pi and a damping ratio -Re s / |s|. Sampled
every dt seconds the same pole is z = exp(s dt).

``judge`` makes the choice by rule that an analyst makes on a stabilisation diagram. Problem: a model of order 20
has ten poles, and a structure that shows five modes has five. Analysts plot the poles of all orders and pick by eye the
ones that stay.

Solution, in words that are printed with the result: the order is where a further state stops paying for itself
(Schwarz's criterion on the one-step errors). A pole of that order is a mode when it swings, when its place is known to
within its half bandwidth and what the record resolves, and when models of the next orders have it within that half
bandwidth. What is less certain has to show more, not less: its standard errors count how far it moves from order to
order. What is known to a sixth of its half bandwidth needs no such witness: larger models split what is heavily damped.
"""

from dataclasses import dataclass, field

import numpy as np

from logger.arrays import Array, Complex


@dataclass(frozen=True)
class FoundMode:
    """A mode that the data support, each figure with its standard deviation.

    frequency_hz, frequency_std_hz   natural frequency without regard to damping [Hz]
    damping_ratio, damping_std       share of critical damping; NaN where the method does not estimate it
    shape                            (channels,) motion of the channels, the largest 1; complex where not in step
    """

    frequency_hz: float
    damping_ratio: float
    frequency_std_hz: float
    damping_std: float
    shape: Complex = field(compare=False)


@dataclass(frozen=True)
class Rejected:
    """A pole or a peak that was found and not believed, and why, in plain words."""

    frequency_hz: float
    damping_ratio: float
    reason: str


@dataclass(frozen=True)
class ModalResult:
    """Modes, slowest first; what was rejected; the order of the model (0 where there is none); how it was done.

    diagram   poles of every order that was tried, for a stabilisation diagram
    """

    modes: tuple[FoundMode, ...]
    rejected: tuple[Rejected, ...]
    order: int
    how: str
    diagram: "tuple[OrderPoles, ...]" = ()


@dataclass(frozen=True)
class OrderPoles:
    """Vibrating poles s (n,) [rad/s, Im s > 0] of the model of one order, and the shapes (channels, n)."""

    order: int
    poles: Complex
    shapes: Complex


def order_poles(transition: Array, observe: Array, rate_hz: float) -> OrderPoles:
    """Vibrating poles of x[k+1] = A x[k], y[k] = C x[k]; A (n, n), C (channels, n). Real poles are left out."""
    roots, vectors = np.linalg.eig(transition)
    keep = np.flatnonzero((roots.imag > 1e-9) & (np.abs(roots) > 1e-6))
    poles = np.asarray(np.log(roots[keep].astype(np.complex128)) * rate_hz, dtype=np.complex128)
    slowest_first = np.argsort(np.abs(poles))
    shapes = observe @ vectors[:, keep[slowest_first]]
    return OrderPoles(len(transition), poles[slowest_first], shapes.astype(np.complex128))


def frequency_hz(poles: Complex) -> Array:
    """Natural frequency of poles s [rad/s]."""
    return np.abs(poles) / (2 * np.pi)


def damping_ratio(poles: Complex) -> Array:
    """Damping ratio of poles s [rad/s]."""
    return -poles.real / np.abs(poles)


def pole_rows(result: ModalResult) -> Array:
    """Order, frequency [Hz] and damping ratio of every pole of the diagram, (k, 3)."""
    rows = [np.stack([np.full(len(one.poles), float(one.order)), frequency_hz(one.poles), damping_ratio(one.poles)], 1)
            for one in result.diagram]
    return np.concatenate([np.empty((0, 3)), *rows])


def errors_of(pole: complex, covariance: Array) -> tuple[float, float]:
    """Standard deviations of frequency [Hz] and damping ratio from the covariance (2, 2) of Re s and Im s [rad/s]."""
    size = abs(pole)
    by_frequency = np.array([pole.real, pole.imag]) / (2 * np.pi * size)
    by_damping = np.array([-(pole.imag**2), pole.real * pole.imag]) / size**3
    if not np.isfinite(covariance).all():
        return float("inf"), float("inf")
    variances = [way @ covariance @ way for way in (by_frequency, by_damping)]
    return float(np.sqrt(variances[0])), float(np.sqrt(variances[1]))


def normalised(shape: Complex) -> Complex:
    """A shape turned and scaled so that its largest part is 1."""
    return np.asarray(shape / shape[np.abs(shape).argmax()], dtype=np.complex128)


MOST_DAMPING = 0.9
LARGEST_FREQUENCY_ERROR = 0.1  # of the frequency
LARGEST_DAMPING_ERROR = 0.15


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
    known_well_stds, neighbours = 6.0, 4
    modes: list[FoundMode] = []
    rejected: list[Rejected] = []
    for k, pole in enumerate(found.poles):
        is_known_well = known_well_stds**2 * np.trace(covariance[k]) < pole.real**2
        near = [] if is_known_well else larger[:neighbours]
        moves = _moves(complex(pole), near)
        both = covariance[k] + (np.outer(middle := moves[len(moves) // 2], middle) if len(moves) else 0.0)
        frequency, ratio = float(frequency_hz(pole)), float(damping_ratio(pole))
        frequency_std, damping_std = errors_of(complex(pole), both)
        width = abs(pole.real) + 2 * np.pi / duration_s
        reason = _why_not(complex(pole), frequency_std, damping_std, moves, len(near))
        if reason or np.trace(both) > width**2:
            reason = reason or "its frequency is less certain than the width of its resonance"
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


def _why_not(pole: complex, frequency_std_hz: float, damping_std: float, moves: Array, models: int) -> str:
    hum_damping, no_damping, must_have_it = 5e-4, 1e-6, 3
    hz, ratio = abs(pole) / (2 * np.pi), -pole.real / abs(pole)
    reasons = {
        "it is absent from parts of the record": not np.isfinite(frequency_std_hz),
        "it grows instead of decaying": ratio <= 0,
        "damped so heavily that it hardly oscillates": ratio > MOST_DAMPING,
        "no measurable damping: a hum, not a mode": ratio < max(no_damping, min(hum_damping, 2 * damping_std)),
        f"its frequency is uncertain by {frequency_std_hz / hz:.0%}": frequency_std_hz > LARGEST_FREQUENCY_ERROR * hz,
        f"its damping ratio is uncertain by {damping_std:.2f}": damping_std > LARGEST_DAMPING_ERROR,
        f"only {len(moves)} of the next {models} orders have it": len(moves) < min(must_have_it, models),
    }
    return next((reason for reason, holds in reasons.items() if holds), "")
