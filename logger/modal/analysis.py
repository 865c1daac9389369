"""Modal analysis of one record, from samples to modes with errors.

A record is one of three things; each has one method, the best known for it, and its own measure of error:

- a free decay (era): poles are proposed, least squares decides and gives the errors (``logger.modal.decay``);
- a response to unmeasured random forces (ssi): poles of the best order, errors by leaving out one segment of the record
  after the other, choice by rule (``logger.modal.mode``);
- the same beside a measured input (n4sid).

Methods that were offered once and are not: AR, ARX and ARMAX, whose damping the noise of the sensors makes too high
without their errors showing it; SSI of covariances and NExT, which find what ssi finds, less surely; peaks of a Fourier
spectrum, which show no heavily damped mode. On the records of ``tests/benchmarks/modes_in_noise.py`` each of them
missed modes that n4sid or ssi found, or reported some that are not there.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Complex
from logger.modal import subspace
from logger.modal.decay import decay_modes, proposals
from logger.modal.mode import ModalResult, OrderPoles, best_size, generous_size, judge, order_poles
from logger.modal.subspace import Moments, jackknife, segment_products

METHODS = {
    "era": "eigensystem realisation of a free decay",
    "ssi": "data-driven stochastic subspace, canonical weighting",
    "n4sid": "deterministic-stochastic subspace, canonical weighting",
}

_LEAST_PAST, _MOST_PAST = 60, 300
"""Lags of the past that a state is made of, at most so many samples in all. Measured: with 20 ssi misses 25 of 234
modes and reports one that is not there, with 60 it misses 21 and with all that there are 29."""
_BEYOND = 8  # states beyond the chosen order, for the stabilisation diagram


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
    decay_ratio = 3.0
    thirds = np.array_split(samples - samples[-len(samples) // 3:].mean(axis=0), 3)
    power = [float((third**2 / np.maximum(samples.var(axis=0), 1e-300)).mean()) for third in thirds]
    return power[0] > decay_ratio * power[1] and power[1] > 0.8 * power[2]


def find_modes(samples: Array, rate_hz: float, inputs: Array | None = None, decay: bool | None = None) -> ModalResult:
    """Modes of a record (samples, channels); inputs (samples, m) where they were measured.

    decay    whether it is a free decay; None to see for oneself

    ValueError for a record that is too short or a channel that never moves, or an input that shows no mode.
    """
    shortest, most_segments, diagram_orders = 100, 30, 24
    if len(samples) < shortest:
        raise ValueError(f"expected at least {shortest} samples, found {len(samples)}")
    if inputs is None and (decays(samples) if decay is None else decay):
        how = f"free decay: poles proposed by {METHODS['era']}, judged and refined by least squares"
        return decay_modes(samples, rate_hz, proposals, how)
    scale = samples.std(axis=0)
    if np.linalg.eigvalsh(np.corrcoef(samples.T).reshape(2 * (samples.shape[1],))).min() < subspace.RIDGE:
        raise ValueError("expected channels that differ, found one that is a combination of others: leave it out")
    whole = samples if inputs is None else np.hstack([samples, inputs])
    plan = _plan((whole - whole.mean(axis=0)) / whole.std(axis=0), samples.shape[1], rate_hz)
    segments = segment_products(plan.data, plan.lags, min(most_segments, len(samples) // (2 * plan.lags)))
    moments = segments.whole()
    chosen = plan.best(moments)
    how = (f"response to unmeasured random forces: {METHODS['ssi']}" if inputs is None else
           f"response beside its measured input: {METHODS['n4sid']}")
    if chosen == 0:
        return ModalResult((), (), 0, f"{how}; no model gains more evidence than its parameters cost")
    place = plan.orders.index(chosen)
    thinned = plan.orders[place::-(place // diagram_orders + 1)][::-1]
    diagram = plan.models(moments, thinned + plan.orders[place + 1:place + 1 + _BEYOND])
    place = len(thinned) - 1
    found = diagram[place] if inputs is not None else _without_bias(diagram[place], len(samples) / rate_hz)
    covariance = jackknife(segments, lambda part: plan.models(part, [chosen])[0], found.poles)
    if inputs is None:
        covariance = _no_surer_than_the_record(covariance, found.poles, len(samples) / rate_hz)
    modes, rejected = judge(found, covariance, diagram[place + 1:], scale, len(samples) / rate_hz)
    return ModalResult(tuple(modes), tuple(rejected), chosen, how, tuple(diagram))


def _no_surer_than_the_record(covariance: Array, poles: Complex, duration_s: float) -> Array:
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
    most_states = 40
    most = min(most_states + _BEYOND, (horizon - 1) * outputs) // 2 * 2
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
    one_mode = 5  # order of excitation: 2 n + 1 for its two states
    rounded = 10.0  # times the power of rounding: more is of the input
    # of an input's power: were rounding more than this, its levels are the input's own, as of a switch
    few_levels = 1e-3
    moments = segment_products(np.hstack([inputs, np.ones((len(inputs), 1))]), lags, 1).whole()
    steps = np.diff(np.sort(inputs, axis=0), axis=0)
    rounding = max(float(step[step > 0].min()) ** 2 / 12 for step in steps.T)
    rounding = rounding if rounding < few_levels else 0.0
    count = int((np.linalg.eigvalsh(moments.products) > rounded * max(rounding, subspace.RIDGE)).sum()) - 1
    if count < one_mode:
        power = (np.abs(np.fft.rfft(inputs, axis=0)) ** 2).sum(axis=1)
        strongest_hz = float(power.argmax()) * rate_hz / len(inputs)
        raise ValueError(
            f"expected an input with many frequencies, found {(count + 1) // 2} (the strongest {strongest_hz:.3g} Hz): "
            f"its order of excitation is {count}, and one mode needs persistent excitation of order {one_mode}. Drive "
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
