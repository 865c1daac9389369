"""A filter that was run forth and back is no slow sensor, though noise behind it hides it from spectra; one that delays
is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import butter, sosfilt, sosfiltfilt

from logger.lab.diagnosis import diagnose, search_effects
from logger.lab.likelihood.posterior import Posterior
from logger.lab.selection.filter_without_delay import below_filter_without_delay
from logger.lab.selection.stepwise import Search, Selection
from logger.simulation.virtual_drive import SimulatedRuns

from ...support.lab.secret_runs import EFFECTS, posterior_of, secret_runs

Array = npt.NDArray[np.float64]
TRIED = {name: EFFECTS[name] for name in ("sensor_bandwidth", "time_offset", "sensor_gain")}


def filtered(way: Callable[..., Array], order: int, cutoff_hz: float) -> Posterior:
    """Drives filtered by scipy, with noise behind."""
    rng, sections = np.random.default_rng(3), butter(order, cutoff_hz, fs=100.0, output="sos")
    return posterior_of(SimulatedRuns([
        replace(run, measured_mps2=way(sections, run.measured_mps2) + rng.normal(0, 0.05, run.count))
        for run in secret_runs([], noise_mps2=0.01).runs], 500.0))


@pytest.mark.slow
@pytest.mark.parametrize(("order", "cutoff_hz"), [pytest.param(2, 16.0, marks=pytest.mark.release), (4, 20.0)])
def test_one_that_was_run_forth_and_back_is_named_by_nothing_and_ends_the_band(
        order: int, cutoff_hz: float, monkeypatch: pytest.MonkeyPatch) -> None:
    posterior, asked = filtered(sosfiltfilt, order, cutoff_hz), []

    def noted(search: Search, found: Selection) -> Posterior | None:
        asked.append(found)
        return below_filter_without_delay(search, found)

    monkeypatch.setattr("logger.lab.diagnosis.below_filter_without_delay", noted)
    found = diagnose(posterior, TRIED)
    (without,) = asked  # the search before the band was known
    assert "sensor_bandwidth" in without.gains  # what imitates it
    assert found.verdict == ()
    assert found.band is not None and found.band.high_hz < cutoff_hz
    assert found.band.cutoff_hz == pytest.approx(cutoff_hz, rel=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(("order", "cutoff_hz"), [pytest.param(2, 16.0, marks=pytest.mark.release), (4, 20.0)])
def test_one_that_delays_stays_what_it_is(order: int, cutoff_hz: float) -> None:
    posterior = filtered(sosfilt, order, cutoff_hz)
    search, found = search_effects(posterior, TRIED)
    assert list(found.gains) == ["sensor_bandwidth"]
    assert below_filter_without_delay(search, found) is None
