"""What the lab finds wrong with a sensor is put right where the road is judged: ``estimate`` and ``replay``, on records
of a simulator that shares nothing with ridelog."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from logger.commands.main import main
from tests.validation.cases import random_case as cases
from tests.validation.cases.case_files import write_case
from tests.validation.cases.field_case import noise_of, write_field
from tests.validation.cases.random_case import Case, case
from tests.validation.field_loop import true_file
from tests.validation.simulator.scene import Scene, measured

SEED = 2003
FAULTS: dict[str, dict[str, float]] = {
    "sensor_gain": {"gain": 1.3},
    "sensor_bandwidth": {"cutoff_hz": 6.0},
    "sensor_mount_resonance": {"frequency_hz": 14.0, "damping_ratio": 0.1},
    "sensor_offset": {"offset_m": 0.8},
    "time_offset": {"delay_s": 0.4},
}


def with_fault(scene: Scene, name: str) -> Scene:
    """The scene with a sensor that has one of them."""
    said = FAULTS[name]
    if name == "sensor_offset":
        return scene.with_physics(sensor_ahead_m=said["offset_m"])
    return scene.with_sensor(**{
        "sensor_gain": lambda: {"gain": said["gain"]},
        "sensor_bandwidth": lambda: {"cutoff_hz": said["cutoff_hz"]},
        "sensor_mount_resonance": lambda: {"mount_hz": said["frequency_hz"], "mount_zeta": said["damping_ratio"]},
        "time_offset": lambda: {"delay_s": said["delay_s"]},
    }[name]())


@cache
def sound(sensor: str) -> Case:
    """The first drive of a case without anything missing."""
    drawn = cases.draw_drives
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(cases, "draw_drives", lambda rng, rough: drawn(rng, rough)[:1])
        return case("none", SEED, None, noise_of(sensor))


def made(name: str, sensor: str) -> Case:
    """The case, its record with the fault."""
    whole = sound(sensor)
    scene = with_fault(whole.scene, name)
    clean = measured(scene)[0]
    rng = np.random.default_rng(SEED)
    run = replace(whole.recordings[0], clean_mps2=clean, accel_z_mps2=whole.noise.add(clean, rng))
    return replace(whole, scene=scene, recordings=(run,))


def printed_json(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    """What a command prints as JSON."""
    capsys.readouterr()
    assert main([*map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def replayed(capsys: pytest.CaptureFixture[str], dump: Path, vehicle: Path, out: Path) -> list[float]:
    """The IRI of all windows of a replay [m/km]."""
    printed_json(capsys, "replay", dump, "--out", out, "--vehicle", vehicle)
    rows = [row for path in sorted(out.glob("*.csv")) for row in csv.DictReader(path.read_text("utf-8").splitlines())]
    return [float(row["iri_m_per_km"]) for row in rows if row["iri_m_per_km"]]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "sensor"), [
    pytest.param(name, sensor, marks=[pytest.mark.release] if number % 2 else [])
    for number, (sensor, name) in enumerate(product(("serial", "bma220"), FAULTS))])
def test_a_fault_in_the_file_is_put_right(
    name: str, sensor: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    faulty = made(name, sensor)
    write_case(faulty, tmp_path)
    plain, own = tmp_path / "plain.yaml", tmp_path / "own.yaml"
    true = true_file(yaml.safe_load((tmp_path / "vehicle.yaml").read_text("utf-8")), faulty)
    plain.write_text(yaml.safe_dump(true), "utf-8")
    own.write_text(yaml.safe_dump({**true, "effects": [{"name": name, **FAULTS[name]}]}), "utf-8")
    noise = ["--noise", faulty.noise.white_mps2, "--step", faulty.noise.step_mps2]
    before, after = (printed_json(capsys, "estimate", tmp_path / "run1", "--vehicle", one, *noise)["comparison"]
                     for one in (plain, own))
    (dump, line), = write_field(faulty, sensor, plain, tmp_path)
    exact = printed_json(capsys, "iri", line)["iri_m_per_km"]
    logged = [float(np.mean(replayed(capsys, dump, one, tmp_path / one.stem))) / exact - 1 for one in (plain, own)]
    with capsys.disabled():
        print(f"\n{name}, {sensor}: estimate R2 {before['r2']:.3f} -> {after['r2']:.3f}, bias {before['bias']:+.1%} -> "
              f"{after['bias']:+.1%}; replay's mean IRI off {logged[0]:+.1%} -> {logged[1]:+.1%}")
    assert after["r2"] > before["r2"] and abs(after["bias"]) < 0.06
    assert abs(logged[1]) < 0.12
    if name != "time_offset":  # which moves windows, and leaves their mean
        assert abs(after["bias"]) < abs(before["bias"]) and abs(logged[1]) < abs(logged[0])
