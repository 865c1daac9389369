"""``ridelog add-effect``: the effect with its errors, what it changed, a vehicle file, and one line else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from logger.commands.demo import unpack
from logger.commands.main import main
from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_model

from ..support.lab.runs_with_effects import OWN, named, write_runs
from ..support.slow import release


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return write_runs(tmp_path_factory.mktemp("friction"), named("dry_friction", friction_force_n=70.0), lasts_s=12.0)


def add(effect: str, vehicle: Path | str, out: Path, *arguments: str) -> int:
    return main(["add-effect", effect, "--vehicle", str(vehicle), "--out", str(out), *arguments])


@pytest.mark.slow
def test_for_a_program_and_once_more(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first, second = tmp_path / "with-friction.yaml", tmp_path / "with-both.yaml"
    assert add("dry_friction", "rav4-2009", first, *runs, "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["effect"] == "dry_friction"
    error = reported["standard_errors"]["friction_force_n"]
    assert 0.01 < error < 7.0
    assert reported["parameters"]["friction_force_n"] == pytest.approx(70.0, abs=max(7.0, 3 * error))
    assert reported["noise_floor_error"] == pytest.approx(reported["error_after"], rel=0.1)
    assert reported["error_after"] < reported["error_refitted"] <= reported["error_before"]
    assert reported["helps"] is True
    assert main(["compare", "--vehicle", str(first), "--json", *runs]) == 0
    compared = json.loads(capsys.readouterr().out)
    assert compared["error"] == pytest.approx(reported["error_as_written"], rel=1e-6)
    assert compared["refitted"]["error"] == pytest.approx(reported["error_after"], rel=0.02)
    shifted = {one["name"] for one in reported["vehicle_parameters"]}
    assert shifted >= {"sprung_mass_kg", "rear.suspension_stiffness_n_per_m"}

    model = read_model(first)
    assert [one.effect.name for one in model.effects] == ["dry_friction"]
    assert model.effects[0].values == reported["parameters"]
    assert model.effects[0].standard_errors == reported["standard_errors"]
    assert [step.step for step in model.history] == ["as it was given", "parameters refitted", "added dry_friction"]
    assert model.history[-1].error == reported["error_after"]
    mass = next(one for one in reported["vehicle_parameters"] if one["name"] == "sprung_mass_kg")
    assert mass["nominal"] == 875 and model.vehicle.sprung_mass_kg == mass["with"]

    # Rebound and bump are alike in this car: one more number gains nothing.
    assert add("damper_asymmetry:rebound_to_bump_ratio=1.1", first, second, *runs) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "WARNING: it does not help" in words
    assert [one.effect.name for one in read_model(second).effects] == ["dry_friction", "damper_asymmetry"]
    assert [step.step for step in read_model(second).history][3:] == ["added damper_asymmetry"]
    assert len(read_model(first).effects) == 1  # what was read stays as it is


@pytest.mark.slow
def test_for_a_person_with_an_effect_of_their_own(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    runs = write_runs(tmp_path / "runs", named("sensor_offset", offset_m=0.4), lasts_s=10.0)
    own, out = tmp_path / "bracket.py", tmp_path / "mine.yaml"
    own.write_text(OWN, "utf-8")
    out.write_text(vehicle_file("rav4-2009").read_text("utf-8"), "utf-8")
    assert add(str(own), out, out, *runs) == 0  # over the old file, as it was asked for
    reported = capsys.readouterr().out
    assert reported.startswith("long_bracket: offset_m 0.")
    for words in ("It helps", "Before ", "After ", "Noise floor ", "new file and distances as they are",
                  "sprung_mass_kg", "Shift"):
        assert words in reported
    model = read_model(out)
    assert model.effects[0].file == str(own)
    assert 0.36 < model.effects[0].values["offset_m"] < 0.44


def test_what_cannot_be_added(runs: list[str], tmp_path: Path) -> None:
    has = tmp_path / "has.yaml"
    has.write_text(vehicle_file("rav4-2009").read_text("utf-8").replace(
        "effects: []", "effects: [{name: wheel_lift}]"), "utf-8")
    out = tmp_path / "out.yaml"
    for effect, vehicle, to, words in (
        ("wheel_lift", has, out, "without wheel_lift"),
        ("rust", "rav4-2009", out, "no effect 'rust'"),
        ("roll", "rav4-2009", out, "elevation_right_m"),
        ("sensor_gain:gain=9000", "rav4-2009", out, "sensor_gain: expected gain of"),
        ("sensor_gain:gain=much", "rav4-2009", out, "PARAM=NUMBER"),
        ("sensor_gain+sensor_gain:gain=1.1", "rav4-2009", out, "each effect once, found sensor_gain again"),
        ("sensor_gain", "rav4-2009", Path(runs[0]) / "drive.csv", "does not belong to a run"),
        ("sensor_gain", "rav4-2009", tmp_path / "none" / "out.yaml", "a folder that exists"),
    ):
        with pytest.raises(BadInput, match=words):
            add(effect, vehicle, to, *runs)
    assert not out.exists()


@pytest.mark.slow
@pytest.mark.parametrize("absent", ["wheel_lift", *release("dry_friction")])
def test_what_the_cars_own_numbers_have_left_to_gain_is_no_merit_of_an_effect(
    absent: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """On the demo's drives, whose car lacks another effect, both fits go to their ends."""
    folders = [str(one) for one in unpack(tmp_path / "lab")]
    assert add(absent, "rav4-2009", tmp_path / "car.yaml", *folders, "--json") == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["helps"] is False and reported["p_value"] > 0.01
