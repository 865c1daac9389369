"""A learned law as a curve with its band over the motions that the runs had, or as the loop that a memory makes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from logger.arrays import Array
from logger.chart_data import CURVE_POINTS, CURVE_REACH, Curves, Line
from logger.lab.laws.draft import Draft, LawContext
from logger.vehicle.effect import Chosen, ForceEffect
from logger.vehicle.laws import Seen, linear
from logger.vehicle.uncertain import NumberErrors

_AXES = {"rate": ("rate_mps", "suspension rate [m/s], positive in extension"),
         "travel": ("travel_m", "suspension travel [m], positive in extension"),
         "deflection": ("deflection_m", "tire deflection from rest [m], positive in extension")}
_STEP = 1e-4  # of a standard error, over which derivatives are taken
_LOOP_SHARES, _LOOP_HZ, _LOOP_TURNS, _LOOP_STEPS = (0.5, 0.9, 0.99), 1.4, 3, 4000


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
    line = Line("learnt", at, draft.force_n(found.values, at, damping), _band(draft, found, errors, at, damping))
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
    before = linear(context.vehicle.front.suspension_damping_n_s_per_m)
    laws = draft.effect.laws(SimpleNamespace(**found.values), before)
    lines = []
    for way_m in sorted({context.reach("travel_m", share) for share in _LOOP_SHARES}):
        phase = 2 * np.pi * np.linspace(0, _LOOP_TURNS, _LOOP_TURNS * _LOOP_STEPS + 1)
        travel, rate = way_m * np.sin(phase), way_m * 2 * np.pi * _LOOP_HZ * np.cos(phase)
        force = sum((one(travel, rate) for one in laws.others), laws.friction_n(rate))
        for law in laws.motions:
            memory, step_s = np.array(law.memory, dtype=float), 1 / _LOOP_HZ / _LOOP_STEPS
            still = np.zeros(len(Seen._fields) - 3)
            for index, (x, v) in enumerate(zip(travel, rate, strict=True)):
                seen = Seen._make([x, v, *still, tuple(memory)])
                force[index] += law.force(law.p, seen)
                if law.rates is not None:
                    memory = memory + step_s * np.array(law.rates(law.p, seen))
        last = slice(-_LOOP_STEPS - 1, None, 20)
        lines.append(Line(f"{1000 * way_m:.3g} mm", travel[last], force[last]))
    return Curves(draft.title, "suspension travel [m], back and forth at body bounce", "force [N]", tuple(lines))
