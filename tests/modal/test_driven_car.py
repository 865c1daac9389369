"""Modes out of drives: against the eigenvalues of the car that was simulated, and none beside them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.modal.driven_car import UnlikeCar, car_modes, fitted_names, pieces_of
from logger.vehicle.models import structure_of
from logger.vehicle.modes import modes
from logger.vehicle.named_parameters import changed, read
from logger.vehicle.vehicle import Vehicle
from ridelog import Run, random_road, read_vehicle, simulate, write_run
from ridelog import modes as modes_in_python

SURE = 4.0


def off(vehicle: Vehicle, seed: int) -> Vehicle:
    """Another car near it: what shapes its modes is off by 20 per cent."""
    by = np.exp(0.2 * np.random.default_rng(seed).standard_normal(len(fitted_names(vehicle))))
    return changed(vehicle, {name: read(vehicle, name) * float(one)
                             for name, one in zip(fitted_names(vehicle), by, strict=True)})


def drive(name: str, seed: int, speed_mps: float, iso_class: str) -> tuple[Run, Vehicle]:
    """A minute in a car that is not quite what the file of this name says, and that car."""
    model = read_vehicle(name)
    true = off(model.vehicle, seed)
    road = random_road(iso_class=iso_class, length_m=60 * speed_mps, seed=seed)
    return simulate(replace(model, vehicle=true), road, speed_mps, noise_mps2=0.02, seed=seed), true


def found(name: str, run: Run):
    return car_modes(read_vehicle(name).vehicle, run.accel_z_mps2, run.speed_mps, np.ones(len(run.time_s), bool),
                     run.rate_hz)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seed", "speed_mps", "iso_class", "least"), [
    ("golden-car", 1, 20.0, "B", 2), ("rav4-2009", 2, 12.0, "C", 3), ("ford-escort", 3, 24.0, "B", 3)])
def test_each_mode_is_one_of_the_cars_own(name: str, seed: int, speed_mps: float, iso_class: str, least: int) -> None:
    run, true = drive(name, seed, speed_mps, iso_class)
    own = [(one.frequency_hz, one.damping_ratio) for one in modes(structure_of(true))]
    reported = found(name, run).modes
    assert len(reported) >= least
    for one in reported:
        assert one.damping_ratio > 0
        assert min(max(abs(hz - one.frequency_hz) / one.frequency_std_hz,
                       abs(ratio - one.damping_ratio) / one.damping_std) for hz, ratio in own) < SURE


@pytest.mark.slow
def test_the_pitch_of_a_sensor_amid_an_even_car_is_not_reported() -> None:
    model = read_vehicle("rav4-2009")
    run = simulate(model, random_road(iso_class="B", length_m=900.0, seed=4), 15.0, noise_mps2=0.02)
    result = found("rav4-2009", run)
    assert all(abs(one.frequency_hz / 1.478 - 1) > 0.1 for one in result.modes)
    assert ["hardly shows it" in one.reason for one in result.rejected] == [True]


def test_a_reading_of_another_kind_of_car_is_refused() -> None:
    run, _ = drive("ford-escort", 3, 20.0, "B")
    with pytest.raises(UnlikeCar, match="times the power"):
        found("golden-car", run)


def test_noise_is_as_it_is_counted() -> None:
    """Pieces of white noise scatter as much as their worth says."""
    generator = np.random.default_rng(1)
    means = []
    for _ in range(200):
        samples = generator.standard_normal(6000)
        pieces = pieces_of(samples, np.full(6000, 20.0), np.ones(6000, bool), 100.0)
        means.append(float(pieces.power.mean()))
    assert np.mean(means) == pytest.approx(2 / 100, rel=0.01)
    assert np.std(means) / np.mean(means) == pytest.approx(1 / np.sqrt(pieces.worth.sum()), rel=0.2)


def test_commands(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run, _ = drive("golden-car", 1, 20.0, "B")
    write_run(tmp_path / "run", run)
    file = str(tmp_path / "run" / "drive.csv")
    bare = tmp_path / "bare.csv"
    bare.write_text("\n".join(line.rsplit(",", 2)[0] for line in Path(file).read_text().splitlines()) + "\n")
    assert main(["modes", file, "--vehicle", "golden-car"]) == 0
    assert "and the distance between the axles. The fitted power is at most" in capsys.readouterr().out
    assert main(["modes", str(bare), "--vehicle", "golden-car", "--speed", "20"]) == 0
    assert len(modes_in_python(tmp_path / "run", vehicle="golden-car").frequency_hz) == 2
    for arguments, words in (
            ([file], "expected --vehicle with a drive"),
            ([file, "--columns", "accel_z_mps2"], "expected --vehicle with a drive"),
            ([file, "--columns", "speed_mps", "--method", "era"], "which describes how the car moved"),
            ([file, "--vehicle", "golden-car", "--method", "era"], "fitted to the spectrum"),
            ([str(bare), "--vehicle", "golden-car"], "expected a column speed_mps, or --speed")):
        with pytest.raises(BadInput, match=words):
            main(["modes", *arguments])
