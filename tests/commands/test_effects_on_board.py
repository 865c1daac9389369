"""Vehicles with effects where the road is judged: ``estimate``, ``replay``, ``calibrate`` and ``modes --vehicle``."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from logger.api.modal import vehicle_modes
from logger.commands.main import main
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import write_profile

from ..support.command import called

PLAIN = vehicle_file("rav4-2009").read_text("utf-8").replace("effects: []", "")
ROAD = Track(0.05, iso8608.generate(iso8608.gd_n0_from_iri(4.0), 600, 0.05, 12), 100.0)
EFFECTS = {
    "linear": "[{name: sensor_gain, gain: 1.2}, {name: payload, mass_kg: 100}, {name: tire_damping, "
              "tire_damping_n_s_per_m: 200}]",
    "bent": "[{name: dry_friction, friction_force_n: 100}]",
}


def file_of(folder: Path, effects: str, more: str = "") -> Path:
    path = folder / "car.yaml"
    path.write_text(f"{PLAIN}effects: {effects}\n{more}", "utf-8")
    return path


def reported(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    capsys.readouterr()
    assert main([*map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", EFFECTS)
def test_a_drive_is_judged_by_the_file_that_has_its_effects(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    car = file_of(tmp_path, EFFECTS[name])
    write_profile(tmp_path / "profile.csv", ROAD)
    assert main(["simulate", "--vehicle", str(car), "--profile", str(tmp_path / "profile.csv"), "--speed", "16",
                 "--noise", "0.05", "--out", str(tmp_path / "drive.csv")]) == 0
    plain, own = (reported(capsys, "estimate", tmp_path, "--vehicle", vehicle)["comparison"]
                  for vehicle in ("rav4-2009", car))
    assert abs(own["bias"]) < 0.05 < abs(plain["bias"])
    assert own["r2"] > max(plain["r2"], 0.85 * own["limit_r2"])


@pytest.mark.slow
def test_standard_errors_of_the_file_are_in_those_of_the_windows(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A gain that may be off by a tenth leaves every IRI as uncertain."""
    write_profile(tmp_path / "profile.csv", ROAD)
    assert main(["simulate", "--vehicle", "rav4-2009", "--profile", str(tmp_path / "profile.csv"), "--speed", "16",
                 "--noise", "0.05", "--out", str(tmp_path / "drive.csv")]) == 0
    gain = "[{name: sensor_gain, gain: 1, standard_errors: {gain: 0.1}}]"
    sure, unsure = (reported(capsys, "estimate", tmp_path, "--vehicle", file_of(tmp_path, effects))
                    for effects in ("[]", gain))
    added = np.sqrt(unsure["iri_std_m_per_km"] ** 2 - sure["iri_std_m_per_km"] ** 2)
    assert added == pytest.approx(0.1 * unsure["iri_m_per_km"], rel=0.25)


def rows_of(dump: Path, out: Path, car: Path) -> list[dict[str, str]]:
    done = called("replay", dump, "--out", out, "--vehicle", car, "--json")
    assert done.returncode == 0, done.stderr
    return [row for path in sorted(out.glob("*.csv")) for row in csv.DictReader(path.read_text("utf-8").splitlines())]


@pytest.mark.slow
def test_the_service_takes_them_too(short_dump: Path, tmp_path: Path) -> None:
    """A gain is taken off; a speed that is recorded too high makes the windows shorter, not others."""
    plain = rows_of(short_dump, tmp_path / "a", file_of(tmp_path, "[]"))
    louder = rows_of(short_dump, tmp_path / "b", file_of(tmp_path, "[{name: sensor_gain, gain: 2}]"))
    scaled = rows_of(short_dump, tmp_path / "c", file_of(tmp_path, "[{name: speed_scale, scale: 1.02}]"))
    friction = rows_of(short_dump, tmp_path / "d", file_of(tmp_path, EFFECTS["bent"]))
    assert len(plain) == len(louder) == len(scaled) == len(friction) > 5
    pairs = [[float(one["iri_m_per_km"]) for one in (a, b)] for a, b in zip(plain, louder, strict=True)
             if a["iri_m_per_km"] and b["iri_m_per_km"]]
    assert np.mean([b for _, b in pairs]) == pytest.approx(np.mean([a for a, _ in pairs]) / 2, rel=0.1)
    assert [row["distance_end_m"] for row in scaled] == [row["distance_end_m"] for row in plain]
    assert any(row["iri_m_per_km"] for row in scaled) and any(row["iri_m_per_km"] for row in friction)
    sidecar = json.loads(next((tmp_path / "d").glob("*.json")).read_text())
    assert sidecar["vehicle"]["effects"][0]["friction_force_n"] == 100


@pytest.mark.slow
def test_a_gain_is_in_the_calibration_and_friction_in_the_modes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    louder = file_of(tmp_path, "[{name: sensor_gain, gain: 2}]")
    ratios = [reported(capsys, "calibrate", "--vehicle", car)["speeds"][0]["iri_per_accel_rms"]
              for car in ("rav4-2009", louder)]
    assert ratios[1] == pytest.approx(ratios[0] / 2, rel=1e-6)
    car = file_of(tmp_path, EFFECTS["bent"], "standard_errors: {sprung_mass_kg: 30}\n")
    smooth, rough = (vehicle_modes(car, iri) for iri in (2.0, 9.0))
    assert smooth.damping_ratio[0] > 1.1 * rough.damping_ratio[0]
    assert 0 < rough.frequency_std_hz[0] < 0.05
    assert reported(capsys, "modes", "--vehicle", "rav4-2009")["modes"][0]["frequency_std_hz"] is None


