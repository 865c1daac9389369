"""A car that nobody has measured: what the settings say of it, what it does to the IRI's standard error, and the words.
"""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.dump import DumpWriter
from logger.service import wiring
from logger.service.config import Config, load_config
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model
from logger.vehicle.named_parameters import read, sized
from logger.vehicle.published_cars import generic_car

from ..support.command import called
from ..support.drives.replay import Rows, rows_of
from ..support.drives.simulated_drive import DemoDrive

WHEELBASE_M = 2.94  # of the car that the drive was made with


def wheelbase_m(config: Config) -> float:
    car = wiring.car_of(config).vehicle
    assert car.rear is not None
    return car.front.cg_distance_m + car.rear.cg_distance_m


def off(config: Config) -> float:
    return wiring.iri_share_std(wiring.car_of(config), wiring.instrument(config.accelerometer))


def test_the_shipped_file_is_the_mean_and_the_spread_of_published_cars() -> None:
    written, (car, errors) = read_model(vehicle_file("generic")), generic_car()
    assert written.errors is not None
    for name in sized(car):
        assert read(written.vehicle, name) == pytest.approx(read(car, name), rel=1e-4)
    assert written.errors.standard_errors == pytest.approx(dict(errors.standard_errors), rel=1e-4)
    np.testing.assert_allclose(written.errors.matrix(), errors.matrix(), atol=1e-4)


def test_wheelbase_and_mass_are_those_of_the_settings(tmp_path: Path) -> None:
    path = tmp_path / "ridelog.yaml"
    path.write_text("wheelbase_m: 2.5\nmass_kg: 1100\n")
    config = load_config(path)
    assert config.vehicle == vehicle_file("generic")
    car = wiring.car_of(config).vehicle
    assert car.rear is not None
    assert wheelbase_m(config) == pytest.approx(2.5)
    assert 2 * (car.sprung_mass_kg + car.front.unsprung_mass_kg + car.rear.unsprung_mass_kg) == pytest.approx(1100)
    assert off(config) == pytest.approx(off(replace(config, mass_kg=None)), rel=0.15)  # no IRI depends on it
    assert wheelbase_m(replace(config, vehicle=vehicle_file("bmw-320i"))) == pytest.approx(2.5789)


@pytest.mark.parametrize("wrong", ["wheelbase_m: 260", "wheelbase_m: long", "mass_kg: 1.4", "mass_kg: -1"])
def test_what_no_car_has_is_refused_with_its_line(wrong: str, tmp_path: Path) -> None:
    (tmp_path / "ridelog.yaml").write_text(f"vehicle: generic\n{wrong}\n")
    with pytest.raises(Exception, match=r"ridelog.yaml:2: expected null or a number from "):
        load_config(tmp_path / "ridelog.yaml")


def test_the_words_say_how_far_off_the_iri_can_be_and_what_to_do() -> None:
    config = Config()
    sensor, car = wiring.instrument(config.accelerometer), wiring.car_of(config)
    said, = wiring.notices(config, car, sensor)
    assert f"the IRI can be {off(config):.0%} off" in said
    assert "ridelog learn-car" in said
    assert "wheelbase_m" in said
    assert 0.15 < off(config) < 0.35  # shipped files named for other cars are 10 to 31 % off
    assert car.errors is not None
    surer = replace(car.errors, standard_errors={name: 0.1 * one for name, one in car.errors.standard_errors.items()})
    assert wiring.iri_share_std(replace(car, errors=surer), sensor) == pytest.approx(0.1 * off(config), rel=0.2)
    named = replace(config, vehicle=vehicle_file("rav4-2009"), wheelbase_m=2.94)
    assert not wiring.notices(named, wiring.car_of(named), sensor)
    other = replace(named, wheelbase_m=2.6)
    assert "its wheelbase is 2.94 m" in wiring.notices(other, wiring.car_of(other), sensor)[0]


def test_a_drive_counts_what_is_not_known_and_its_comfort_stays(short_drive: DemoDrive, short_rows: Rows) -> None:
    known = short_rows.records
    header = replace(short_drive.header, vehicle="generic", wheelbase_m=WHEELBASE_M)
    unknown = rows_of(header, short_drive.events).records
    assert unknown == rows_of(header, short_drive.events).records
    pairs = [(one, other) for one, other in zip(known, unknown, strict=True)
             if one.iri_m_per_km is not None and other.iri_m_per_km is not None]
    assert len(pairs) > 50
    share = [one.iri_common_std_m_per_km / one.iri_m_per_km for _, one in pairs]  # type: ignore[operator]
    assert 0.1 < np.median(share) < 0.35
    apart = [abs(one.iri_m_per_km - other.iri_m_per_km) / other.iri_std_m_per_km  # type: ignore[operator]
             for one, other in pairs]
    assert np.mean(np.array(apart) < 2) > 0.9
    assert np.median([abs(other.a_w_mps2 / one.a_w_mps2 - 1) for one, other in pairs
                      if one.a_w_mps2 and other.a_w_mps2]) < 0.02


def test_replay_and_report_say_that_the_car_is_not_known(short_drive: DemoDrive, tmp_path: Path) -> None:
    dump = tmp_path / "drive.dump"
    writer = DumpWriter(dump, replace(short_drive.header, vehicle="generic", wheelbase_m=WHEELBASE_M))
    for event in short_drive.events:
        writer.write(event)
    writer.close()
    replayed = called("replay", dump, "--out", tmp_path / "logs")
    sentence = r"the car is not known: the IRI can be (\d+)% off\. Drive at different speeds, run ridelog learn-car"
    found = re.search(sentence, replayed.stdout)
    assert found
    sidecar = json.loads(next((tmp_path / "logs").glob("*.json")).read_text())
    assert round(100 * sidecar["iri_vehicle_share_std"]) == int(found[1])
    assert sidecar["vehicle"]["name"] == "generic"
    assert sidecar["settings"]["wheelbase_m"] == WHEELBASE_M
    reported = called("report", tmp_path / "logs", "--out", tmp_path / "page.html")
    assert re.search(sentence, reported.stdout)
    assert re.search(sentence, (tmp_path / "page.html").read_text())
