"""Drives cut into runs: short gaps stay in, long ones and standing are cut out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logger.api.drives import profile_of
from logger.api.inputs import Run
from logger.api.lab.checks import driven_stretches, thinned_runs, unexplained_up_to_hz
from logger.errors import BadInput
from logger.profiles.excitation import AppliedForce, Excitation
from logger.runs import CLIPPED, NO_READING, READING, SKIP_S
from logger.simulation.virtual_drive import begins_unknown
from logger.vehicle.compose import compose
from logger.vehicle.vehicle import Axle, Vehicle

from ..support.lab.runs_with_residual import a_run


def drive(marks: dict[tuple[float, float], float], lasts_s: float = 30.0, stands_s: tuple[float, float] = (0, 0)
          ) -> Run:
    """A drive with marks from a second to another."""
    run = a_run("run", 10.0, lasts_s, 1)
    usable = np.full(run.count, READING)
    for (first_s, last_s), mark in marks.items():
        usable[round(100 * first_s) : round(100 * last_s)] = mark
    speed = run.speed_mps.copy()
    speed[round(100 * stands_s[0]) : round(100 * stands_s[1])] = 0.0
    accel = np.random.default_rng(1).normal(0, 1, run.count)
    return Run(Path("run"), 100.0, run.time_s, accel, speed, run.distance_m, None, None, usable=usable,
               profile=profile_of(run.track))


def test_a_loose_wire_leaves_one_run() -> None:
    gaps = {(5 + 0.9 * n, 5.02 + 0.9 * n + 0.18 * (n % 2)): NO_READING for n in range(20)}
    (run,) = driven_stretches(drive(gaps))
    assert run.count == 3000 and run.name == "run"
    assert run.usable is not None and (~run.read).sum() == 10 * 2 + 10 * 20


@pytest.mark.parametrize(("gap_s", "runs"), [(SKIP_S, 1), (SKIP_S + 0.01, 2)])
def test_a_gap_is_cut_out_once_a_cut_costs_less(gap_s: float, runs: int) -> None:
    found = driven_stretches(drive({(12.0, 12.0 + gap_s): NO_READING}))
    assert len(found) == runs
    assert sum(one.read.sum() for one in found) == 3000 - round(100 * gap_s)


def test_gaps_at_the_ends_of_a_part_are_cut_off() -> None:
    first, last = driven_stretches(drive({(0, 1): NO_READING, (9.5, 10): NO_READING}, stands_s=(10, 15)))
    assert (first.count, last.count) == (850, 1500)
    assert first.usable is None and last.usable is None


def test_clipped_readings_are_reported() -> None:
    (run,) = driven_stretches(drive({(7, 7.05): CLIPPED}))
    assert run.usable is not None and (run.usable == CLIPPED).sum() == 5


def test_too_few_readings_are_refused() -> None:
    with pytest.raises(BadInput, match=r"expected 5 s with readings .* without a break of more than 2 s"):
        driven_stretches(drive({(3.0 * n, 3.0 * n + 2.5): NO_READING for n in range(10)}))


def test_a_thinned_sample_is_as_usable_as_those_beside_it() -> None:
    (run,) = driven_stretches(drive({(7, 7.01): NO_READING, (8, 8.01): CLIPPED}))
    (thin,) = thinned_runs([replace(run, rate_hz=200.0)])
    assert thin.usable is not None and len(thin.usable) == thin.count
    assert np.flatnonzero(thin.usable == NO_READING).tolist() == [349, 350, 351]
    assert np.flatnonzero(thin.usable == CLIPPED).tolist() == [399, 400, 401]


@pytest.mark.parametrize(("model_has_it", "up_to_hz"), [(False, 46.0), (True, 7.0)])
def test_a_rig_keeps_the_band_in_which_its_model_lacks_something(model_has_it: bool, up_to_hz: float) -> None:
    """White noise, however wide, is none of it."""
    run, time_s = a_run("run", 10.0, 30.0, 1), np.arange(3000) / 400
    low, high = (10 * np.sin(2 * np.pi * hz * time_s) for hz in (7.0, 46.0))
    readings = low + high + np.random.default_rng(1).normal(0, 1, 3000)
    run = replace(run, rate_hz=400.0, measured_mps2=readings)
    assert unexplained_up_to_hz(run, model_has_it * high) == pytest.approx(up_to_hz, abs=0.7)  # two lines of a block


@pytest.mark.parametrize("rang_mps2", [0.0, 0.1, 0.02])
def test_a_rig_that_rests_until_it_is_struck_loses_no_beginning(rang_mps2: float) -> None:
    """A mass at 6 Hz, struck by a hammer after 0.4 s, is the closed form of an impulse; noise and hum of 0.01 m/s2. One
    that rang before by more than these begins in a state that nobody knows."""
    time_s, rng = np.arange(2000) / 500, np.random.default_rng(3)
    since_s = time_s - 0.4
    rings = 8 * np.exp(-2 * since_s) * np.cos(37.7 * since_s) * (since_s >= 0) + rang_mps2 * np.cos(37.7 * time_s)
    noise = rng.normal(0, 0.01, 2000) + 0.01 * np.sin(314 * time_s)
    force_n = np.exp(-((since_s / 0.003) ** 2)) * 300 + rng.normal(0, 0.1, 2000)
    struck = Excitation(500.0, np.zeros(2000), force_n=force_n[:, None], forces=(AppliedForce("force_n", ("body",)),))
    still = np.zeros(2000)
    (run,) = driven_stretches(Run(Path("run"), 500.0, time_s, rings + noise, still, still, None, None,
                                  excitation=struck), shortest_s=3.0)
    assert run.first == (1000 if rang_mps2 else 0)
    if not rang_mps2:
        coarse = 0.1 + 0.02 * np.round(np.cumsum(np.cumsum(rings)) * 2e-4)  # an encoder reads the same throughout
        (read,) = driven_stretches(Run(Path("run"), 500.0, time_s, coarse, still, still, None, None, excitation=struck),
                                   shortest_s=3.0)
        assert read.first == 0
        noisy = replace(run, measured_mps2=run.measured_mps2 + rng.normal(0, 0.5, 2000))
        car = compose(Vehicle("rig", "single_mass", 1.0, None, Axle(0.0, 0.0, 1421.0, 4.0, 0.0), None, 0.0))
        assert noisy.begins_in_motion and not begins_unknown(car, noisy)
