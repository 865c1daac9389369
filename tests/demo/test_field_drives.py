"""The drives of ``demo --field``: what ships against its plan; what a car with effects feels, by another model."""

from __future__ import annotations

import gzip
import sys
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

import logger.demo
from drivers.dump import open_dump
from logger.commands.demo import unpacked
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.profile_file import read_places, read_profile
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose
from logger.vehicle.effect import chosen

from ..support.drives import field_drives
from ..support.drives.simulated_drive import (
    RoadStretch,
    body_acceleration,
    build_road,
    drive_along,
    sensed_acceleration,
)

SHIPPED = Path(logger.demo.__file__).parent / "field.zip"


def test_the_archive_is_small_and_has_both_sensors(tmp_path: Path) -> None:
    assert SHIPPED.stat().st_size < 1_500_000
    kinds = []
    for path in unpacked("field.zip", tmp_path):
        if path.name.endswith(".dump.gz"):
            with open_dump(path) as dump:
                kinds.append(dump.header.accelerometer["driver"])
                assert dump.header.vehicle == logger.demo.FIELD.vehicle
                assert sum(1 for _ in dump) > 4000 and not dump.torn_tail
    assert kinds == ["pasco", "bma220", "pasco", "bma220"]
    assert {path.name for path in tmp_path.iterdir()} == {
        *(f"{name}.dump.gz" for name in field_drives.PLANS), *field_drives.LINES_M}


@pytest.mark.parametrize("name", field_drives.LINES_M)
def test_a_line_is_as_long_as_it_says_and_lies_where_its_places_are(name: str, tmp_path: Path) -> None:
    unpacked("field.zip", tmp_path)
    profile, (at_m, lat_deg, lon_deg) = read_profile(tmp_path / name), read_places(tmp_path / name)
    from_m, to_m = field_drives.LINES_M[name]
    length_m = profile.spacing_m * (len(profile.elevation_m) - 1)
    assert length_m == pytest.approx(to_m - from_m, abs=0.051)
    assert (at_m[0], at_m[-1]) == pytest.approx((0.0, length_m))
    # Chords of a bent street, a degree of latitude being 60 nautical miles but for half a per cent.
    north_m, east_m = np.diff(lat_deg) * 60 * 1852, np.diff(lon_deg) * 60 * 1852 * np.cos(np.radians(lat_deg[0]))
    assert np.hypot(north_m, east_m) == pytest.approx(np.diff(at_m), rel=0.01, abs=0.05)


@pytest.mark.slow
def test_what_ships_is_what_the_plans_make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "argv", ["field_drives", str(tmp_path / "field.zip")])
    field_drives.main()
    with ZipFile(tmp_path / "field.zip") as made, ZipFile(SHIPPED) as shipped:
        assert made.namelist() == shipped.namelist()
        for name in made.namelist():
            here, there = made.read(name), shipped.read(name)
            assert here == there or gzip.decompress(here) == gzip.decompress(there), name


def test_what_a_car_with_effects_feels_is_what_an_exact_model_says_times_the_gain() -> None:
    """A gain alone leaves the car linear, which ``body_acceleration`` steps exactly."""
    car = read_vehicle(vehicle_file("rav4-2009"))
    motion = drive_along(((0, 10), (10, 14), (20, 9)))
    road = build_road([RoadStretch(1, 100)], (), 260.0, 3)
    felt = sensed_acceleration(compose(car, [chosen(shipped_effects()["sensor_gain"], {"gain": 1.25})]), road, motion)
    exact = 1.25 * body_acceleration(car, road, motion)
    settled = slice(3000, -1000)
    assert felt.shape == exact.shape
    assert np.std((felt - exact)[settled]) < 0.02 * np.std(exact[settled])
