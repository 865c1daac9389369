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

from logger.arrays import Complex
from logger.dsp.filters import butterworth
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.record_band import cut_to_pass_band, is_steep, is_wide_enough
from logger.lab.selection.candidate_fit import CandidateFit, fit_roughly, refine
from logger.lab.selection.evidence import INDISTINGUISHABLE
from logger.lab.selection.screening import screen
from logger.lab.selection.stepwise import Search, Selection
from logger.runs import LowPass
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Misalignment
from logger.vehicle.effects.sensor_bandwidth import SensorBandwidth

_IMITATED_BY = "sensor_bandwidth"


class _ForthAndBack(SensorBandwidth):
    """Butterworth's low-pass, run forth and back on the samples: no effect of a car, and in no catalogue. Its cut-off
    and order are those of each way."""

    name = "filter_without_delay"
    title = "a low-pass that was run forwards and backwards"
    signature = "the higher the frequency, the smaller the measurement is beside the model, but without delay"
    shown_by = "look at the records as they were recorded"
    realigns = False

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        return super().trials()[:1]

    def delaying_trials(self, seen: Misalignment) -> list[list[dict[str, float]]]:
        return [kind for kind in super().delaying_trials(seen) if kind[0]["sampled_hz"]]

    def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
        one_way = butterworth(int(p.order), s, p.cutoff_hz, p.sampled_hz)
        return np.asarray(one_way * one_way.conj())


_FILTER = _ForthAndBack()


def below_filter_without_delay(search: Search, found: Selection) -> Posterior | None:
    """What to search again: the posterior of the runs below a filter without delay that explains them clearly better
    than the slow sensor that a search found; None: none does, or next to nothing is left below it."""
    if _IMITATED_BY not in found.gains:
        return None
    search.progress(f"is it {_IMITATED_BY}, or were the records filtered forwards and backwards?")
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
    screened = screen(base, _FILTER, [replace(search.misalignment, rate_hz=rate_hz, thinned=False)])
    tries = [one for one in fit_roughly(base.score, base, screened) if one.gain > 0]
    return max((refine(base.score, one) for one in tries[:2]), key=lambda one: one.gain, default=None)
