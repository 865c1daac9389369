"""A low-pass that somebody ran forth and back over the records: no effect has its shape, and some imitate it.

Problem: where noise arose behind such a filter, or a missing effect bends the spectra, these do not show it
(``likelihood.record_band``), and a search ends with ``sensor_bandwidth``, the nearest effect. Solution: in its place a
filter without delay is fitted, of each order. If that explains clearly more, it is what happened to the records: they
are cut where it begins, and searched again.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from logger.dsp.butterworth import butterworth
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.record_band import cut_to_pass_band, is_steep, is_wide_enough
from logger.lab.selection.candidate_fit import CandidateFit, fit_roughly, refine
from logger.lab.selection.evidence import INDISTINGUISHABLE
from logger.lab.selection.screening import screen
from logger.lab.selection.stepwise import Search, Selection
from logger.runs import LowPass
from logger.simulation.simulated_runs import SimulatedRuns
from logger.vehicle.effect import Misalignment, Parameter, Scale, SensorEffect

Complex = npt.NDArray[np.complex128]

_IMITATED_BY = "sensor_bandwidth"
_HIGHEST_ORDER = 8
# As ``sensor_bandwidth`` tries them.
_LOWEST_HZ, _HIGHEST_OF_RATE, _CUTOFF_RATIO = 6.0, 0.45, 1.12


class _ForthAndBack(SensorEffect):
    """Butterworth's low-pass, run forth and back on the samples: no effect of a car, and in no catalogue."""

    name = "filter_without_delay"
    title = "a low-pass that was run forth and back"
    parameters = (
        Parameter("cutoff_hz", 25.0, 0.5, 2000.0, float("inf"), Scale.RECIPROCAL, (25.0,), "of each way"),
        Parameter("order", 4.0, 1.0, 8.0, None, Scale.LINEAR, (4.0,), "of each way",
                  choices=tuple(map(float, range(1, _HIGHEST_ORDER + 1)))),
        Parameter("sampled_hz", 100.0, 1e-3, 1e6, None, Scale.LINEAR, (100.0,), "samples a second", given=True),
    )
    source = "S. Butterworth, On the Theory of Filter Amplifiers (1930)"
    signature = "the measurement falls behind the model more and more as the frequency rises, and comes no later"
    shown_by = "look at the records as they were recorded"
    stage = 3

    def delaying_trials(self, seen: Misalignment) -> list[list[dict[str, float]]]:
        highest_hz = _HIGHEST_OF_RATE * seen.rate_hz
        count = round(np.log(highest_hz / _LOWEST_HZ) / np.log(_CUTOFF_RATIO))
        return [[{"cutoff_hz": float(cutoff_hz), "order": float(order), "sampled_hz": seen.rate_hz}
                 for cutoff_hz in np.geomspace(highest_hz, _LOWEST_HZ, count + 1)]
                for order in range(1, _HIGHEST_ORDER + 1)]

    def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
        one_way = butterworth(int(p.order), s, p.cutoff_hz, p.sampled_hz)
        return np.asarray(one_way * one_way.conj())


_FILTER = _ForthAndBack()


def below_filter_without_delay(search: Search, found: Selection) -> Posterior | None:
    """What to search again: the posterior of the runs below a filter without delay that explains them clearly better
    than the slow sensor that a search found; None: none does, or next to nothing is left below it."""
    if _IMITATED_BY not in found.gains:
        return None
    search.progress(f"is it {_IMITATED_BY}, or were the records filtered forth and back?")
    best = _fitted(search, found)
    if best is None or best.gain < found.gains[_IMITATED_BY] + INDISTINGUISHABLE:
        return None
    posterior, values = found.before.posterior, best.chosen.values
    # Run forth and back it has the order of both ways.
    seen = LowPass(values["cutoff_hz"], 2 * values["order"], causal=False)
    runs = posterior.runs.runs
    if not is_steep(seen) or not all(is_wide_enough(run, seen) for run in runs):
        return None
    predictions = [run.main(one) for run, one in zip(runs, posterior.start(found.before.state.effects).predictions,
                                                     strict=True)]
    cut = [cut_to_pass_band(run, prediction, seen) for run, prediction in zip(runs, predictions, strict=True)]
    return Posterior(SimulatedRuns(cut, posterior.runs.fine_hz), posterior.vehicle, posterior.tolerance,
                     posterior.start_vehicle)


def _fitted(search: Search, found: Selection) -> CandidateFit | None:
    """The filter fitted in the place of the slow sensor; None: it explains nothing."""
    base = search.without(found.now, _IMITATED_BY)
    rate_hz = base.posterior.runs.runs[0].rate_hz
    screened = screen(base, _FILTER, [replace(search.misalignment, rate_hz=rate_hz)])
    tries = [one for one in fit_roughly(base.score, base, screened) if one.gain > 0]
    return max((refine(base.score, one) for one in tries[:2]), key=lambda one: one.gain, default=None)
