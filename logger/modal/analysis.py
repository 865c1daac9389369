"""Modal analysis of one record, from samples to modes with errors; and which poles of a model are modes.

A pole exp(s t) of a structure is quoted as a natural frequency |s| / 2 pi and a damping ratio -Re s / |s|. Sampled
every dt seconds the same pole is z = exp(s dt). A record is one of three things; each has one method, the best known
for it, and its own measure of error:

- a free decay (era): poles are proposed, least squares decides and gives the errors (``logger.modal.decay``);
- a response to unmeasured random forces (ssi): poles of the best order, errors by leaving out one segment of the record
  after the other, choice by rule (``judge``);
- the same beside a measured input (n4sid).

AR, ARX and ARMAX are not offered: the noise of the sensors makes their damping too high without their errors showing
it. Nor are SSI of covariances and NExT, which find what ssi finds, less surely, and peaks of a Fourier spectrum, which
show no heavily damped mode (``tests/benchmarks/modes_in_noise.py``).

``judge`` makes the choice by rule that an analyst makes on a stabilisation diagram. Problem: a model of order 20
has ten poles, and a structure that shows five modes has five. Analysts plot the poles of all orders and pick by eye the
ones that stay.

Solution, in words that are printed with the result: the order is where a further state stops paying for itself
(Schwarz's criterion on the one-step errors). A pole of that order is a mode when it swings, when its place is known to
within its half bandwidth and what the record resolves, and when models of the next orders have it within that half
bandwidth. What is less certain has to show more, not less: its standard errors count how far it moves from order to
order. What is known to a sixth of its half bandwidth needs no such witness: larger models split what is heavily damped.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from logger.modal import subspace
from logger.modal.decay import decay_modes, proposals
from logger.modal.subspace import Moments, jackknife, segment_products

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]


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
    diagram: tuple[OrderPoles, ...] = ()


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


METHODS = {
    "era": "eigensystem realisation of a free decay",
    "ssi": "data-driven stochastic subspace, canonical weighting",
    "n4sid": "deterministic-stochastic subspace, canonical weighting",
}
SHORTEST = 100  # samples

_SEGMENTS = 30
_LEAST_PAST, _MOST_PAST = 60, 300
"""Lags of the past that a state is made of, at most so many samples in all. Measured: with 20 ssi misses 25 of 234
modes and reports one that is not there, with 60 it misses 21 and with all that there are 29."""
_MOST_STATES = 40
_BEYOND = 8  # states beyond the chosen order, for the stabilisation diagram
_DECAY_RATIO = 3.0
_DIAGRAM_ORDERS = 24
_ONE_MODE = 5  # order of excitation: 2 n + 1 for its two states
_ROUNDED = 10.0  # times the power of rounding: more is of the input
_FEW_LEVELS = 1e-3  # of an input's power: were rounding more than this, its levels are the input's own, as of a switch


@dataclass(frozen=True)
class _Plan:
    """One record: the data that are regressed, their lags, the orders, the best of them, and models of some orders."""

    data: Array
    lags: int
    orders: list[int]
    best: Callable[[Moments], int]
    models: Callable[[Moments, list[int]], list[OrderPoles]]


def decays(samples: Array) -> bool:
    """Whether a record (samples, channels) looks like a free decay: its first third much louder than the second."""
    thirds = np.array_split(samples - samples[-len(samples) // 3:].mean(axis=0), 3)
    power = [float((third**2 / np.maximum(samples.var(axis=0), 1e-300)).mean()) for third in thirds]
    return power[0] > _DECAY_RATIO * power[1] and power[1] > 0.8 * power[2]


def find_modes(
    samples: Array, rate_hz: float, inputs: Array | None = None, decay: bool | None = None,
) -> ModalResult:
    """Modes of a record (samples, channels); inputs (samples, m) where they were measured.

    decay    whether it is a free decay; None to see for oneself

    ValueError for a record that is too short or a channel that never moves, or an input that shows no mode.
    """
    if len(samples) < SHORTEST:
        raise ValueError(f"expected at least {SHORTEST} samples, found {len(samples)}")
    if inputs is None and (decays(samples) if decay is None else decay):
        how = f"free decay: poles proposed by {METHODS['era']}, judged and refined by least squares"
        return decay_modes(samples, rate_hz, proposals, how)
    scale = samples.std(axis=0)
    if np.linalg.eigvalsh(np.corrcoef(samples.T).reshape(2 * (samples.shape[1],))).min() < subspace.RIDGE:
        raise ValueError("expected channels that differ, found one that is a sum of others: leave it out")
    whole = samples if inputs is None else np.hstack([samples, inputs])
    plan = _plan((whole - whole.mean(axis=0)) / whole.std(axis=0), samples.shape[1], rate_hz)
    segments = segment_products(plan.data, plan.lags, min(_SEGMENTS, len(samples) // (2 * plan.lags)))
    moments = segments.whole()
    chosen = plan.best(moments)
    how = (f"response to unmeasured random forces: {METHODS['ssi']}" if inputs is None else
           f"response beside its measured input: {METHODS['n4sid']}")
    if chosen == 0:
        return ModalResult((), (), 0, f"{how}; no model explains more than its parameters cost")
    place = plan.orders.index(chosen)
    thinned = plan.orders[place::-(place // _DIAGRAM_ORDERS + 1)][::-1]
    diagram = plan.models(moments, thinned + plan.orders[place + 1:place + 1 + _BEYOND])
    place = len(thinned) - 1
    found = diagram[place] if inputs is not None else _without_bias(diagram[place], len(samples) / rate_hz)
    covariance = jackknife(segments, lambda part: plan.models(part, [chosen])[0], found.poles)
    if inputs is None:
        covariance = _no_surer_than_the_record(covariance, found.poles, len(samples) / rate_hz)
    modes, rejected = judge(found, covariance, diagram[place + 1:], scale, len(samples) / rate_hz)
    return ModalResult(tuple(modes), tuple(rejected), chosen, how, tuple(diagram))


def _no_surer_than_the_record(covariance: Array, poles: npt.NDArray[np.complex128], duration_s: float) -> Array:
    """Covariance (n, 2, 2) whose variances are at least what random shaking of this length can show of a pole.

    The envelope of a mode that is shaken by white noise is a complex Ornstein-Uhlenbeck process; over a time T its
    decay rate a and its frequency are known to a variance of a / T at best each (S.-K. Au, Mechanical Systems and
    Signal Processing 48, 2014, "Uncertainty law in ambient modal identification": zeta / (2 pi N) for N cycles, the
    same).
    """
    least = np.abs(poles.real)[:, None] / duration_s
    wanting = np.maximum(least - np.diagonal(covariance, axis1=1, axis2=2), 0.0)
    return np.asarray(covariance + wanting[:, :, None] * np.eye(2))


def _without_bias(found: OrderPoles, duration_s: float) -> OrderPoles:
    """Poles moved by 1 / duration [1/s] towards less damping, at most half way to none.

    A random response of finite length lets the damping come out that much too high, whatever the mode: the bias of a
    complex first-order regression (Marriott and Pope, 1954, for real ones), seen in simulations of single modes too.
    """
    poles = found.poles + np.minimum(1.0 / duration_s, np.maximum(-found.poles.real, 0.0) / 2)
    return OrderPoles(found.order, poles, found.shapes)


def _plan(data: Array, outputs: int, rate_hz: float) -> _Plan:
    channels = data.shape[1]
    longest = len(data) // (12 * channels)
    if longest < 2:
        raise ValueError(f"expected at least {24 * channels} samples for {channels} channels, found {len(data)}")
    needed = max(_memory(data, outputs, longest), _LEAST_PAST)
    horizon = min(needed, longest, max(_MOST_PAST // channels, 30))
    most = min(_MOST_STATES + _BEYOND, (horizon - 1) * outputs) // 2 * 2
    if channels > outputs:
        most = min(most, (_excitation(data[:, outputs:], rate_hz, 2 * most + 1) - 1) // 4 * 2)
    orders = list(range(2, most + 1, 2))

    def best(moments: Moments) -> int:
        if channels > outputs:
            misfit = np.array([model.misfit[0] for model in subspace.combined(moments, outputs, horizon, orders)])
            return orders[best_size(misfit, moments.count, 2 * (outputs + channels))]
        misfit = subspace.data_driven(moments, horizon, most).misfit[::2]
        return 2 * best_size(misfit, moments.count, 4 * outputs)

    def models(moments: Moments, wanted: list[int]) -> list[OrderPoles]:
        if channels > outputs:
            return [order_poles(model.transition, model.observe, rate_hz)
                    for model in subspace.combined(moments, outputs, horizon, wanted)]
        model = subspace.data_driven(moments, horizon, max(wanted))
        return [order_poles(model.transition[:n, :n], model.observe[:, :n], rate_hz) for n in wanted]

    return _Plan(data, 2 * horizon, orders, best, models)


def _excitation(inputs: Array, rate_hz: float, lags: int) -> int:
    """Order of persistent excitation of inputs (samples, m): how many of their lagged samples are no sum of the others.

    A sine has 2, as have its multiples and delays; n states of one input take 2 n + 1 (Ljung, System Identification,
    2nd ed., 13.2). An offset does not count, nor what is no more than the rounding of the inputs' digits.

    ValueError where it is too low for one mode.
    """
    moments = segment_products(np.hstack([inputs, np.ones((len(inputs), 1))]), lags, 1).whole()
    steps = np.diff(np.sort(inputs, axis=0), axis=0)
    rounding = max(float(step[step > 0].min()) ** 2 / 12 for step in steps.T)
    rounding = rounding if rounding < _FEW_LEVELS else 0.0
    count = int((np.linalg.eigvalsh(moments.products) > _ROUNDED * max(rounding, subspace.RIDGE)).sum()) - 1
    if count < _ONE_MODE:
        power = (np.abs(np.fft.rfft(inputs, axis=0)) ** 2).sum(axis=1)
        strongest_hz = float(power.argmax()) * rate_hz / len(inputs)
        raise ValueError(
            f"expected an input with many frequencies, found {(count + 1) // 2} (the strongest {strongest_hz:.3g} Hz): "
            f"its order of excitation is {count}, and one mode takes persistent excitation of order {_ONE_MODE}; drive "
            "the structure with a sweep or noise, or leave the input out")
    return count


def _memory(data: Array, outputs: int, longest: int) -> int:
    """How many lags of the past predict something of the present: twice those that a regression takes (Bauer, 2005).

    Fewer would leave the slowest vibrations too damped; with more, chance enters the state.
    """
    most = min(longest, max(_MOST_PAST // data.shape[1], 30))
    moments = segment_products(data, most + 1, 1).whole()
    misfit = subspace.regressive(moments, outputs, most)
    return 2 * generous_size(misfit, moments.count, outputs * data.shape[1])
