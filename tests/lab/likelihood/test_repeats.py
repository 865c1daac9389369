"""What runs that repeat each other differ by, against noise that is known."""

import re
from dataclasses import replace

import numpy as np
import pytest

from logger.api.lab.compare import comparison_json, headline
from logger.lab.compare import compare
from logger.lab.likelihood.noise_floor import find_repeats, sensor_noise_of
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.profiles.excitation import AppliedForce, Excitation
from logger.runs import Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose

from ...support.lab.runs_with_residual import CAR, a_run

RATE_HZ, COUNT, LEVEL = 100.0, 6000, 0.2


def rig_runs(seeds: tuple[int, ...], level: float = LEVEL) -> list[Run]:
    """Runs of a car on one table, with noise below 5 Hz of each run's own, which no high frequency shows."""
    rng = np.random.default_rng(1)
    table = Excitation(RATE_HZ, np.cumsum(rng.normal(0, 0.001, COUNT)))
    still = np.zeros(COUNT)
    run = Run("run", RATE_HZ, still, still, still, table)
    (made,) = SimulatedRuns([run]).predict(compose(CAR))
    f_hz = np.fft.rfftfreq(COUNT, 1 / RATE_HZ)
    found = []
    for seed in seeds:
        white = np.fft.rfft(np.random.default_rng(seed).normal(0, 1, COUNT)) * (f_hz < 5.0)
        slow = np.fft.irfft(white, COUNT)
        found.append(replace(run, name=f"run{seed}", measured_mps2=made + level * slow / slow.std()))
    return found


def test_what_does_not_repeat_is_found() -> None:
    found = find_repeats(rig_runs((2, 3, 4)))
    assert found is not None and found.names == ("run2", "run3", "run4")
    assert found.deviation_mps2 == pytest.approx(LEVEL, rel=0.1)
    assert found.freedom == 2 * (COUNT - 200)


def test_it_is_the_noise_where_the_highest_frequencies_tell_of_less() -> None:
    for seeds, expected in (((2, 3, 4), LEVEL), ((2,), None)):
        posterior = Posterior(SimulatedRuns(rig_runs(seeds)), CAR, Tolerance())
        noise = sensor_noise_of(posterior, posterior.start()).deviation_mps2
        assert noise == pytest.approx(LEVEL, rel=0.1) if expected else noise < 0.2 * LEVEL


@pytest.mark.slow
def test_a_comparison_says_so() -> None:
    found = compare(SimulatedRuns(rig_runs((2, 3))), CAR)
    (line,) = [one for one in headline(found) if "are repeats and differ by" in one]
    assert re.match(r"run2 and run3 are repeats and differ by 0\.(19|2|21|22) m/s2 r\.m\.s\. from", line)
    assert comparison_json(found)["repeats"]["deviation_mps2"] == pytest.approx(LEVEL, rel=0.1)


def test_drives_and_other_excitations_repeat_nothing() -> None:
    first, second = rig_runs((2, 3))
    table = second.track
    assert isinstance(table, Excitation)
    other = replace(second, track=replace(table, elevation_m=2 * table.elevation_m))
    assert find_repeats([first, other]) is None
    drive = a_run("drive", 10.0, 20.0, 1)
    assert find_repeats([drive, replace(drive, name="again")]) is None


def test_shakers_that_do_not_move_quite_alike_repeat_each_other_by_what_the_model_says() -> None:
    first, other = rig_runs((2, 3))
    track = first.track
    assert isinstance(track, Excitation)
    louder = replace(other, track=replace(track, elevation_m=1.08 * track.elevation_m))
    (made,) = SimulatedRuns([louder]).predict(compose(CAR))
    (before,) = SimulatedRuns([other]).predict(compose(CAR))
    louder = replace(louder, measured_mps2=louder.measured_mps2 + made - before)
    found = find_repeats([first, louder], [first.measured_mps2 - before, louder.measured_mps2 - made])
    assert found is not None and found.deviation_mps2 == pytest.approx(LEVEL, rel=0.1)
    assert find_repeats([first, replace(other, track=replace(track, elevation_m=-track.elevation_m))]) is None


def test_other_forces_are_no_repeat_though_no_table_moves() -> None:
    rng = np.random.default_rng(4)
    on_body = (AppliedForce("force_n", ("body",)),)
    runs = [replace(run, track=Excitation(RATE_HZ, np.zeros(COUNT), 0.0, rng.normal(0, 1, (COUNT, 1)), on_body))
            for run in rig_runs((2, 3))]
    assert find_repeats(runs) is None
    assert find_repeats([runs[0], replace(runs[1], track=runs[0].track)]) is not None
