"""Which records were low-passed, and where: none that a recorder left as they were, and Butterworth's by scipy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import numpy.typing as npt
import pytest
from scipy.signal import butter, firwin, sosfilt, sosfiltfilt

from logger.lab.likelihood.noise_floor import sensor_noise
from logger.lab.likelihood.record_band import (
    compared_band,
    detect_low_passes,
    is_steep,
    pass_band_end_hz,
    with_pass_bands,
)
from logger.lab.likelihood.whittle import Bands
from logger.runs import LowPass, RecordFacts, Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen

from ...support.lab.runs_with_residual import CAR, a_run, measuring
from ...support.lab.secret_runs import hidden
from ...support.slow import slow

Array = npt.NDArray[np.float64]
RATE_HZ, NOISE = 100.0, 0.03
NO_EFFECT: tuple[Chosen, ...] = ()


@cache
def driven(effects: tuple[str, ...] = (), lasts_s: float = 40.0) -> tuple[list[Run], list[Array]]:
    """Two drives of a car with effects at their usual strength, as a recorder leaves them; and the plain model's."""
    return driven_with([hidden(name) for name in effects], lasts_s)


def driven_with(effects: Sequence[Chosen], lasts_s: float = 40.0) -> tuple[list[Run], list[Array]]:
    """The same of effects with values."""
    runs = [a_run(f"run{number}", speed, lasts_s, number) for number, speed in enumerate((9.0, 17.0))]
    simulated = SimulatedRuns(runs, 500.0)
    there = compose(CAR, list(effects))
    rng = np.random.default_rng(len(effects))
    measured = [measuring(run, one + rng.normal(0, NOISE, run.count))
                for run, one in zip(runs, simulated.predict(there), strict=True)]
    return measured, simulated.predict(compose(CAR))


def through(run: Run, way: Callable[..., Array], order: int, cutoff_hz: float) -> Run:
    sections = butter(order, cutoff_hz, fs=RATE_HZ, output="sos")
    return replace(run, measured_mps2=np.asarray(way(sections, run.measured_mps2)))


def low_passed(way: Callable[..., Array], order: int, cutoff_hz: float) -> LowPass | None:
    runs, predictions = driven()
    return detect_low_passes([through(run, way, order, cutoff_hz) for run in runs], predictions)[0]


@pytest.mark.parametrize("level", [0.003, 0.03, 0.3])
@pytest.mark.parametrize("by_recorder", [False, True])
def test_noise_alone_was_not_filtered(level: float, by_recorder: bool) -> None:
    """White, and as the recorder's filter leaves it, which is flat to 38 Hz."""
    runs, predictions = driven()
    rng = np.random.default_rng(7)
    taps = firwin(201, 44.0, fs=RATE_HZ) if by_recorder else [1.0]
    noisy = [replace(run, measured_mps2=np.convolve(rng.normal(0, level, run.count), taps, "same")) for run in runs]
    assert detect_low_passes(noisy, [0.01 * one for one in predictions]) == [None, None]


@pytest.mark.slow
@pytest.mark.parametrize("effects", [
    (), ("dry_friction",), ("tire_enveloping",), ("top_mount_compliance",), ("sensor_mount_resonance",),
    ("damper_blow_off",), ("body_bending",), ("occupant",), ("sensor_offset",), ("sensor_bandwidth",),
    ("wheel_lift", "progressive_spring")])
def test_what_a_car_does_is_no_filter(effects: tuple[str, ...]) -> None:
    runs, predictions = driven(effects)
    assert not [one for one in detect_low_passes(runs, predictions) if one is not None and is_steep(one)]
    assert all(run.facts.pass_band_hz is None for run in with_pass_bands(runs, predictions))


@pytest.mark.parametrize("beside", [NO_EFFECT, (hidden("tire_enveloping", contact_patch_m=0.45),),
                                    (hidden("cg_shift", shift_m=-0.2),)])
@pytest.mark.parametrize("frequency_hz", [14.0, *slow(20.0, 27.0)])
def test_a_sensor_that_rings_is_no_filter_though_it_falls_as_steeply(frequency_hz: float,
                                                                     beside: Sequence[Chosen]) -> None:
    rings = hidden("sensor_mount_resonance", frequency_hz=frequency_hz, damping_ratio=0.11)
    runs, predictions = driven_with([*beside, rings])
    assert not [one for one in detect_low_passes(runs, predictions) if one is not None and is_steep(one)]


@pytest.mark.parametrize("cutoff_hz", [9.0, 15.0, 22.0, 30.0])
@pytest.mark.parametrize("order", [4, 8])
def test_a_filter_that_delays_is_found_with_its_cut_off(order: int, cutoff_hz: float) -> None:
    seen = low_passed(sosfilt, order, cutoff_hz)
    assert seen is not None and is_steep(seen) and seen.causal
    assert seen.cutoff_hz == pytest.approx(cutoff_hz, rel=0.06)
    assert seen.order == pytest.approx(order, rel=0.3)


@pytest.mark.parametrize("cutoff_hz", [9.0, 30.0, *slow(15.0, 22.0)])
@pytest.mark.parametrize("order", [3, 8, *slow(4)])
def test_a_filter_that_was_run_forth_and_back_is_found_without_delay(order: int, cutoff_hz: float) -> None:
    """Below where the pass band ends it takes a tenth of the amplitude at most."""
    seen = low_passed(sosfiltfilt, order, cutoff_hz)
    assert seen is not None and is_steep(seen) and not seen.causal
    assert seen.cutoff_hz == pytest.approx(cutoff_hz, rel=0.12)
    x = np.tan(np.pi * pass_band_end_hz(seen, RATE_HZ) / RATE_HZ) / np.tan(np.pi * cutoff_hz / RATE_HZ)
    assert 1 / (1 + x ** (2 * order)) > 0.9


@pytest.mark.parametrize("cutoff_hz", [10.0, 20.0])
def test_a_gentle_filter_is_left_to_the_effects(cutoff_hz: float) -> None:
    seen = low_passed(sosfilt, 2, cutoff_hz)
    assert seen is None or not is_steep(seen)


def test_noise_behind_a_filter_hides_no_filter_of_a_car_that_shakes() -> None:
    runs, predictions = driven()
    rng = np.random.default_rng(3)
    behind = [through(run, sosfilt, 8, 12.0) for run in runs]
    behind = [replace(run, measured_mps2=run.measured_mps2 + rng.normal(0, NOISE, run.count)) for run in behind]
    seen = detect_low_passes(behind, predictions)[0]
    assert seen is not None and seen.cutoff_hz == pytest.approx(12.0, rel=0.08)


def test_a_run_that_was_not_filtered_is_compared_whole_beside_one_that_was() -> None:
    (one, other), predictions = driven()
    found = with_pass_bands([through(one, sosfiltfilt, 8, 20.0), other], predictions)
    assert found[0].pass_band_hz[1] < 20.0 and found[1].facts.pass_band_hz is None
    band = compared_band(found)
    assert band is not None and band.some and band.cutoff_hz == pytest.approx(20.0, rel=0.06)


def test_the_band_is_what_the_record_says() -> None:
    runs, predictions = driven()
    found = with_pass_bands([replace(run, facts=RecordFacts(pass_band_hz=(1.0, 12.0))) for run in runs], predictions)
    assert [run.pass_band_hz for run in found] == [(1.0, 12.0)] * 2
    band = compared_band(found)
    assert band is not None and (band.low_hz, band.high_hz, band.cutoff_hz) == (1.0, 12.0, None)
    edges = Bands(found[0]).edges_hz
    assert edges[0] > 1.0 and edges[-1] < 12.0
    with pytest.raises(ValueError, match="expected a pass band of 3 Hz or wider"):
        with_pass_bands([replace(run, facts=RecordFacts(pass_band_hz=(1.0, 3.5))) for run in runs], predictions)


def test_noise_of_a_filtered_record_is_found_below_the_filter() -> None:
    run = a_run("run", 12.0, 80.0, 3)
    noise = through(measuring(run, np.random.default_rng(2).normal(0, 0.05, run.count)), sosfiltfilt, 8, 20.0)
    cut = replace(noise, facts=RecordFacts(pass_band_hz=(0.0, 17.0)))
    cut = replace(cut, measured_mps2=cut.in_band(noise.measured_mps2))
    assert sensor_noise([Bands(noise)], [noise.measured_mps2], 0.0).deviation_mps2 < 0.01
    assert sensor_noise([Bands(cut)], [cut.measured_mps2], 0.0).deviation_mps2 == pytest.approx(0.05, rel=0.1)
