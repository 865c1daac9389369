"""What may be a little off: slopes, costs and a recorder that is not quite flat, against plain calculus."""

import numpy as np
import pytest
from scipy.optimize import approx_fprime

from logger.lab.nuisance import Tolerance, nuisance_of, rate_of_change, wander_of

from ..support.lab.runs_with_residual import CAR, a_run

RATE_HZ = 100.0
INNER = slice(50, -50)


@pytest.mark.parametrize(("at_hz", "within"), [(1.0, 1e-9), (10.0, 1e-9), (25.0, 1e-6), (33.0, 3e-4)])
def test_the_rate_of_change_of_a_wave_is_its_derivative(at_hz: float, within: float) -> None:
    time_s = np.arange(1000) / RATE_HZ
    turn = 2 * np.pi * at_hz
    found = rate_of_change(np.sin(turn * time_s + 0.4), RATE_HZ)
    assert np.abs(found - turn * np.cos(turn * time_s + 0.4))[INNER].max() < within * turn


def test_a_recorder_that_averages_over_its_samples_is_granted_its_droop() -> None:
    run = a_run("run", 10.0, 20.0, 1)
    wander = wander_of(run, Tolerance())
    time_s = np.arange(run.count) / run.rate_hz
    wave = np.sin(2 * np.pi * 20.0 * time_s)
    k = np.zeros(wander.count)
    k[-2:] = 0.01, np.pi**2 / 6  # sin(x) / x is 1 - x^2 / 6 with x = pi f / rate
    found = wander.recorded(wave, k, run)
    expected = (1.01 - (np.pi * 20.0 / run.rate_hz) ** 2 / 6) * wave
    assert found[INNER] == pytest.approx(expected[INNER], abs=1e-3)
    assert wander.moved_m(k) == pytest.approx(0.0)


def test_a_record_that_is_off_by_little_is_off_by_its_columns() -> None:
    run = a_run("run", 10.0, 20.0, 1)
    wander = wander_of(run, Tolerance())
    k = np.linspace(-1e-3, 1e-3, wander.count)
    wave = run.measured_mps2
    alone = np.zeros_like(k)
    alone[-2:] = k[-2:]
    assert wander.recorded(wave, alone, run) - wave == pytest.approx(k[-2:] @ wander.slopes(wave, run).columns()[-2:])


def test_firm_numbers_cost_more_and_more_beyond_what_is_granted() -> None:
    soft, firm = (nuisance_of(CAR, Tolerance(), firm) for firm in (False, True))
    logs = np.linspace(-3.5, 3.5, len(firm.names)) * firm.deviations
    near = np.clip(logs, -1.9 * firm.deviations, 1.9 * firm.deviations)
    assert firm.cost(near) == soft.cost(near)
    assert firm.cost(logs) > soft.cost(logs) + 100
    first, second = firm.firmness(logs)
    extra = approx_fprime(logs, lambda x: firm.cost(x) - soft.cost(x), 1e-9)
    assert first == pytest.approx(extra / 2, rel=1e-3, abs=1.0)
    rise = (firm.firmness(logs + 1e-7)[0] - first) / 1e-7
    assert second == pytest.approx(rise, rel=1e-3, abs=1.0)
    assert not np.any(soft.firmness(logs)[0]) and not np.any(soft.firmness(logs)[1])


def test_logarithms_bring_one_car_to_another_and_back() -> None:
    nuisance = nuisance_of(CAR, Tolerance())
    logs = np.linspace(-0.1, 0.1, len(nuisance.names))
    assert nuisance.logs(CAR, nuisance.vehicle(CAR, logs)) == pytest.approx(logs)
