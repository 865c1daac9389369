"""A learned law as a curve with its band over the motions that the runs had, or as the loop that a memory makes."""

from collections.abc import Callable, Sequence
from types import SimpleNamespace

import numpy as np

from logger.arrays import Array
from logger.chart_data import CURVE_POINTS, CURVE_REACH, Curves, Line
from logger.lab.laws.draft import Draft, LawContext
from logger.vehicle.effect import Chosen, ForceEffect
from logger.vehicle.laws import MotionLaw, Seen, linear
from logger.vehicle.uncertain import NumberErrors

_AXES = {"rate": ("rate_mps", "rate [m/s], positive in extension"),
         "travel": ("travel_m", "travel [m], positive in extension"),
         "deflection": ("deflection_m", "tire deflection from rest [m], positive in extension")}
_STEP = 1e-4  # of a standard error, over which derivatives are taken
_LOOP_SHARES, _LOOP_HZ, _LOOP_TURNS, _LOOP_STEPS = (0.5, 0.9, 0.99), 1.4, 3, 200


def picture(draft: Draft, found: Chosen, errors: NumberErrors, context: LawContext) -> Curves | None:
    """The force of a law over the motions of the runs; None where it is no force that a picture shows."""
    if draft.at == "loop":
        return _loops(draft, found, context)
    if draft.at not in _AXES:
        return None
    motion, name = _AXES[draft.at]
    reach = context.reach(motion, CURVE_REACH)
    at = np.linspace(-reach, reach, CURVE_POINTS)
    damping = context.vehicle.front.suspension_damping_n_s_per_m
    line = Line("learned", at, draft.force_n(found.values, at, damping), _band(draft, found, errors, at, damping))
    return Curves(draft.title, name, "force [N]", (line,))


def _band(draft: Draft, found: Chosen, errors: NumberErrors, at: Array, damping: float) -> Array:
    """Standard errors of the curve (n,), to first order in those of its numbers."""
    kept = [(index, name.partition(".")[2]) for index, name in enumerate(errors.standard_errors)
            if name.startswith(f"{draft.name}.")]
    if not kept:
        return np.zeros_like(at)
    matrix = errors.matrix()[np.ix_([index for index, _ in kept], [index for index, _ in kept])]
    columns = []
    for _, name in kept:
        deviation = errors.standard_errors[f"{draft.name}.{name}"]
        high, low = (draft.force_n({**found.values, name: found.values[name] + way * _STEP * deviation}, at, damping)
                     for way in (1, -1))
        columns.append((high - low) / (2 * _STEP))
    return np.asarray(np.sqrt(np.maximum(np.einsum("in,ij,jn->n", columns, matrix, columns), 0.0)))


def _loops(draft: Draft, found: Chosen, context: LawContext) -> Curves | None:
    """Force of a law in sinusoidal travel of small and large amplitude, at the frequency of a car's bounce."""
    assert isinstance(draft.effect, ForceEffect)
    before, still = linear(context.vehicle.front.suspension_damping_n_s_per_m), np.zeros(len(Seen._fields) - 3)
    laws = draft.effect.laws(SimpleNamespace(**found.values), before)
    lines, time_s = [], np.linspace(0, _LOOP_TURNS / _LOOP_HZ, _LOOP_TURNS * _LOOP_STEPS + 1)
    for way_m in sorted({context.reach("travel_m", share) for share in _LOOP_SHARES}):

        def seen(t: float, memory: Sequence[float], way_m: float = way_m) -> Seen:
            turn = 2 * np.pi * _LOOP_HZ
            return Seen._make([way_m * np.sin(turn * t), way_m * turn * np.cos(turn * t), *still, tuple(memory)])

        travel, rate = np.array([seen(t, ())[:2] for t in time_s]).T
        force = sum((one(travel) for one in laws.springs), laws.friction_n(rate))
        force = sum((one(travel, rate) for one in laws.others), force)
        for law in laws.motions:
            force += [law.force(law.p, seen(t, states))
                      for t, states in zip(time_s, _remembered(law, seen, time_s), strict=True)]
        last = slice(-_LOOP_STEPS - 1, None)
        lines.append(Line(f"{1000 * way_m:.3g} mm", travel[last], force[last]))
    return Curves(draft.title, "travel [m], back and forth", "force [N]", tuple(lines))


def _remembered(law: MotionLaw, seen: Callable[[float, Sequence[float]], Seen], time_s: Array) -> Array:
    """States (n, k) of a law at times, which may be stiff: it gives over micrometres before it slides."""
    from scipy.integrate import odeint

    rates = law.rates
    if rates is None:
        return np.empty((len(time_s), 0))
    return np.asarray(odeint(lambda memory, t: rates(law.p, seen(t, memory)), law.memory, time_s))
