"""Modal analysis of one record by a named method, from samples to modes with errors.

A record is one of three things, and each has its own measure of error:

- a free decay: every method proposes poles, least squares decides and gives the errors (``logger.modal.decay``);
- a response to unmeasured random forces (NExT, SSI, AR, ARMA): poles of the best order, errors by leaving out one
  segment of the record after the other, choice by rule (``logger.modal.stabilisation``);
- the same with a measured input (N4SID, ARX, ARMAX).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.modal import autoregressive, subspace
from logger.modal.autoregressive import Regressors
from logger.modal.decay import decay_modes
from logger.modal.era import proposals, realise
from logger.modal.mode import Array, ModalResult, OrderPoles, order_poles
from logger.modal.moments import Moments, jackknife, segment_products
from logger.modal.stabilisation import best_size, generous_size, judge

METHODS = {
    "era": "eigensystem realisation of a free decay, or of correlations (NExT)",
    "ssi": "data-driven stochastic subspace, canonical weighting",
    "ssi-cov": "covariance-driven stochastic subspace",
    "n4sid": "deterministic-stochastic subspace, canonical weighting",
    "ar": "autoregressive (noise of the sensors makes its damping too high, which its errors do not show)",
    "arx": "autoregressive with input (noise of the sensors makes its damping too high, which its errors do not show)",
    "armax": "autoregressive moving average in two regressions (weak modes in noise come out too damped)",
}
NEED_INPUT = ("arx",)
TAKE_INPUT = ("n4sid", "arx", "armax")
SHORTEST = 100  # samples

_SEGMENTS = 30
_MOST_LAGGED = 200  # lagged samples in one regression
_LEAST_PAST, _MOST_PAST = 20, 300  # lags of the past that a state is made of, at most so many samples in all
_MOST_STATES = 40
_BEYOND = 8  # states beyond the chosen order, for the stabilisation diagram
_DECAY_RATIO = 3.0
_PROPOSED_ORDERS = 12
_DIAGRAM_ORDERS, _DIAGRAM_BEYOND = 24, 8


@dataclass(frozen=True)
class _Plan:
    """One method on one record: the data it regresses, all orders' models at once, and one order's model."""

    data: Array
    lags: int
    orders: list[int]
    best: Callable[[Moments], int]
    models: Callable[[Moments, list[int]], list[OrderPoles]]
    peaks: Callable[[Moments, OrderPoles], npt.NDArray[np.bool_]] = lambda _, found: np.ones(len(found.poles), bool)


def decays(samples: Array) -> bool:
    """Whether a record (samples, channels) looks like a free decay: its first third much louder than the second."""
    thirds = np.array_split(samples - samples[-len(samples) // 3:].mean(axis=0), 3)
    power = [float((third**2 / np.maximum(samples.var(axis=0), 1e-300)).mean()) for third in thirds]
    return power[0] > _DECAY_RATIO * power[1] and power[1] > 0.8 * power[2]


def find_modes(
    samples: Array, rate_hz: float, method: str, inputs: Array | None = None, order: int | None = None,
    decay: bool | None = None,
) -> ModalResult:
    """Modes of a record (samples, channels) by one of ``METHODS``; inputs (samples, m) where they were measured.

    order    states (lags for ar, arx, armax) to use instead of the chosen ones
    decay    whether it is a free decay; None to see for oneself

    ValueError for a record that is too short or a channel that never moves, or an order that it cannot carry.
    """
    if len(samples) < SHORTEST:
        raise ValueError(f"expected at least {SHORTEST} samples, found {len(samples)}")
    if inputs is None and (decays(samples) if decay is None else decay):
        how = f"free decay: poles proposed by {METHODS[method]}, judged and refined by least squares"
        return decay_modes(samples, rate_hz, _proposer(method, order), how)
    scale = samples.std(axis=0)
    whole = samples if inputs is None else np.hstack([samples, inputs])
    spread = whole.std(axis=0)
    plan = _plan(method, (whole - whole.mean(axis=0)) / spread, samples.shape[1], rate_hz, order or 0)
    segments = segment_products(plan.data, plan.lags, min(_SEGMENTS, len(samples) // (2 * plan.lags)))
    moments = segments.whole()
    if order is not None and order not in plan.orders:
        raise ValueError(f"expected an order out of {plan.orders[0]} to {plan.orders[-1]} in steps of "
                         f"{plan.orders[1] - plan.orders[0]}, found {order}")
    chosen = plan.best(moments) if order is None else order
    what = "response to unmeasured random forces" if inputs is None else "response beside its measured input"
    how = f"{what}: {METHODS[method]}"
    if chosen == 0:
        return ModalResult((), (), 0, f"{how}; no model explains more than its parameters cost")
    place = plan.orders.index(chosen)
    thinned = plan.orders[place::-(place // _DIAGRAM_ORDERS + 1)][::-1]
    diagram = plan.models(moments, thinned + plan.orders[place + 1:place + 1 + _DIAGRAM_BEYOND])
    place = len(thinned) - 1
    found = diagram[place] if inputs is not None else _without_bias(diagram[place], len(samples) / rate_hz)
    covariance = jackknife(segments, lambda part: plan.models(part, [chosen])[0], found.poles)
    modes, rejected = judge(found, covariance, diagram[place + 1:], scale, plan.peaks(moments, found))
    return ModalResult(tuple(modes), tuple(rejected), chosen, how, tuple(diagram))


def _without_bias(found: OrderPoles, duration_s: float) -> OrderPoles:
    """Poles moved by 1 / duration [1/s] towards less damping, at most half way to none.

    A random response of finite length lets the damping come out that much too high, whatever the mode: the bias of a
    complex first-order regression (Marriott and Pope, 1954, for real ones), seen in simulations of single modes too.
    """
    poles = found.poles + np.minimum(1.0 / duration_s, np.maximum(-found.poles.real, 0.0) / 2)
    return OrderPoles(found.order, poles, found.shapes)


def _proposer(method: str, order: int | None) -> Callable[[Array, float], tuple[OrderPoles, ...]]:
    def propose(samples: Array, rate_hz: float) -> tuple[OrderPoles, ...]:
        if method == "era":
            return proposals(samples, rate_hz) if order is None else proposals(samples, rate_hz, order)
        plan = _plan(method, samples - samples.mean(axis=0), samples.shape[1], rate_hz, order or 0)
        moments = segment_products(plan.data, plan.lags, 1).whole()
        tried = [n for n in plan.orders if order is None or n <= order]
        return tuple(plan.models(moments, tried[len(tried) - 1::-(len(tried) // _PROPOSED_ORDERS + 1)][::-1]))

    return propose


def _plan(method: str, data: Array, outputs: int, rate_hz: float, least: int) -> _Plan:
    """``least`` is an order that has to be possible, as far as the record is long enough for it."""
    if method in ("ar", "arx", "armax"):
        return _regression(method, data, outputs, rate_hz)
    channels = data.shape[1]
    longest = len(data) // (12 * channels)
    if longest < 2:
        raise ValueError(f"expected at least {24 * channels} samples for {channels} channels, found {len(data)}")
    horizon = min(max(_MOST_LAGGED // channels, 30), longest)
    if method in ("ssi", "n4sid"):
        needed = max(_memory(data, outputs, longest), _LEAST_PAST, least // outputs + 2)
        horizon = min(needed, longest, max(_MOST_PAST // channels, 30))
    most = min(_MOST_STATES + _BEYOND, (horizon - 1) * outputs) // 2 * 2
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
        if method in ("ssi", "n4sid"):
            model = subspace.data_driven(moments, horizon, max(wanted))
            return [order_poles(model.transition[:n, :n], model.observe[:, :n], rate_hz) for n in wanted]
        row = moments.products[:channels].reshape(channels, -1, channels)
        correlations = row.transpose(1, 2, 0)[1:]  # (lags from 1, channels, references)
        if method == "era":
            transition, observe = realise(correlations, max(wanted), horizon)
            return [order_poles(transition[:n, :n], observe[:, :n], rate_hz) for n in wanted]
        return [order_poles(model.transition, model.observe, rate_hz)
                for model in subspace.covariance_driven(correlations, wanted)]

    return _Plan(data, 2 * horizon, orders, best, models)


def _memory(data: Array, outputs: int, longest: int) -> int:
    """How many lags of the past predict something of the present: twice those that a regression takes (Bauer, 2005).

    Fewer would leave the slowest vibrations too damped; with more, chance enters the state.
    """
    most = min(longest, max(_MOST_PAST // data.shape[1], 30))
    moments = segment_products(data, most + 1, 1).whole()
    misfit = autoregressive.misfits(moments, Regressors(outputs, data.shape[1] - outputs), most)
    return 2 * generous_size(misfit, moments.count, outputs * data.shape[1])


def _regression(method: str, data: Array, outputs: int, rate_hz: float) -> _Plan:
    inputs = data.shape[1] - outputs
    which = Regressors(outputs, inputs)
    longest = max(2, min(_MOST_LAGGED // data.shape[1], len(data) // (12 * data.shape[1])))
    if method == "armax":
        segments = segment_products(data, longest + 1, 1).whole()
        misfit = autoregressive.misfits(segments, which, longest)
        lags = max(1, generous_size(misfit, segments.count, outputs * data.shape[1]))
        errors = autoregressive.errors(data, segments, which, lags)
        data, which = np.hstack([data[lags:], errors]), Regressors(outputs, inputs, outputs)
        longest = max(2, min(_MOST_STATES // outputs, len(data) // (12 * data.shape[1])))
    orders = list(range(1, longest + 1))

    def best(moments: Moments) -> int:
        misfit = autoregressive.misfits(moments, which, longest)
        return generous_size(misfit, moments.count, outputs * moments.channels)

    def models(moments: Moments, wanted: list[int]) -> list[OrderPoles]:
        return [autoregressive.poles(moments, which, n, rate_hz) for n in wanted]

    def peaks(moments: Moments, found: OrderPoles) -> npt.NDArray[np.bool_]:
        seen = autoregressive.stands_out(moments, which, found.order, rate_hz, found)
        return seen if inputs else seen & autoregressive.louder_than_beside(data[:, :outputs], rate_hz, found)

    return _Plan(data, longest + 1, orders, best, models, peaks)
