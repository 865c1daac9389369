"""``ridelog calibrate`` as people and programs call it."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path

import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.estimation import rms_calibration
from logger.estimation.rms_calibration import SPEEDS_MPS
from logger.service.signal_chain import recorder_gain
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linearise import known_vehicle

CONTRACT = ["speed_mps", "iri_per_accel_rms", "spread"]
TEXT = vehicle_file("rav4-2009").read_text(encoding="utf-8")


@pytest.fixture
def car(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A vehicle file of a user's own; the user's cache is a folder of the test."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "cars" / "mine.yaml"
    path.parent.mkdir()
    path.write_text(TEXT.replace("name: rav4-2009", "name: my car"), encoding="utf-8")
    return path


@pytest.fixture
def few_roads(monkeypatch: pytest.MonkeyPatch) -> None:
    """A twentieth of the roads, where it is tested what is kept and not what is computed."""
    computed = rms_calibration.calibrate
    monkeypatch.setattr(rms_calibration, "calibrate", lambda car, gain, settings: computed(
        car, gain, replace(settings, roads=rms_calibration.ROADS // 20)))


class Call:
    """One command line: its exit status must be 0; both outputs."""

    def __init__(self, capsys: pytest.CaptureFixture[str], vehicle: Path | str, *arguments: str | Path) -> None:
        assert main(["calibrate", "--vehicle", str(vehicle), *map(str, arguments)]) == 0
        self.out, self.err = capsys.readouterr()

    def json(self) -> dict:
        assert len(self.out.splitlines()) == 1
        result: dict = json.loads(self.out)
        return result


def forbid_computing(monkeypatch: pytest.MonkeyPatch) -> None:
    def computed(*_: object) -> None:
        raise AssertionError("computed again")

    monkeypatch.setattr(rms_calibration, "calibrate", computed)


def test_json_is_the_contract_and_the_service_s_relation(car: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from logger.estimation.rms_calibration import rms_relation

    result = Call(capsys, car, "--json").json()
    assert list(result)[:2] == ["vehicle", "speeds"]
    assert result["vehicle"] == "my car"
    assert [speed["speed_mps"] for speed in result["speeds"]] == list(SPEEDS_MPS)
    on_board = rms_relation(known_vehicle(read_vehicle(car)), recorder_gain(None), SPEEDS_MPS).iri_per_accel_rms
    for speed, ratio in zip(result["speeds"], on_board, strict=True):
        assert list(speed)[:3] == CONTRACT
        assert speed["iri_per_accel_rms"] == pytest.approx(ratio, rel=0.02)
        assert 0.01 < speed["spread"] < 0.05
        assert 0.15 < speed["window_spread"] < 0.35
        assert speed["window_r2"] < speed["r2"] < 1
    assert (result["window_m"], result["roads"], result["seed"]) == (7.62, 120, 1)
    assert result["sprung_mass_kg"] == 875


@pytest.mark.usefixtures("few_roads")
def test_the_second_time_it_is_found(
    car: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    first = Call(capsys, car, "--json")
    stored = car.with_name("mine.calibration.json")
    assert f"my car: computed in {first.err.split()[4]} s, kept in {stored}" in first.err
    forbid_computing(monkeypatch)
    second = Call(capsys, car, "--json")
    assert second.out == first.out
    assert second.err == f"my car: found in {stored}\n"
    renamed = car.with_name("mine.yaml")
    renamed.write_text(car.read_text(encoding="utf-8").replace("name: my car", "name: her car"), encoding="utf-8")
    assert Call(capsys, renamed, "--json").json()["vehicle"] == "her car"


@pytest.mark.usefixtures("few_roads")
def test_a_changed_vehicle_and_a_damaged_file_are_computed_again(car: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = Call(capsys, car, "--json")
    stored = car.with_name("mine.calibration.json")
    slope = first.json()["speeds"][0]["iri_per_accel_rms"]
    stored.write_text(stored.read_text().replace(repr(slope), repr(slope + 1)))
    again = Call(capsys, car, "--json")
    assert "computed in" in again.err
    assert again.out == first.out
    car.write_text(car.read_text(encoding="utf-8").replace("sprung_mass_kg: 875", "sprung_mass_kg: 900"), "utf-8")
    heavier = Call(capsys, car, "--json")
    assert "computed in" in heavier.err
    assert heavier.json()["speeds"][0]["iri_per_accel_rms"] > slope


@pytest.mark.usefixtures("few_roads")
def test_a_folder_that_cannot_be_written_to(
    car: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The name is taken by a folder, which stops root as well."""
    car.with_name("mine.calibration.json").mkdir()
    in_cache = tmp_path / "cache" / "ridelog" / "mine.calibration.json"
    assert f"kept in {in_cache}" in Call(capsys, car).err
    assert f"found in {in_cache}" in Call(capsys, car).err
    monkeypatch.setenv("XDG_CACHE_HOME", str(car))  # a file
    nowhere = Call(capsys, car, "--json")
    assert "not kept: " in nowhere.err
    assert "cannot be written" in nowhere.err
    assert nowhere.json()["speeds"]


@pytest.mark.usefixtures("few_roads")
def test_a_vehicle_of_the_program_is_kept_in_the_cache(
    car: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "computed" in Call(capsys, "rav4-2009").err
    assert [path.name for path in (tmp_path / "cache" / "ridelog").iterdir()] == ["rav4-2009.calibration.json"]
    assert f"found in {tmp_path / 'cache'}" in Call(capsys, vehicle_file("rav4-2009")).err


@pytest.mark.slow
def test_the_screen(car: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = Call(capsys, car).out.splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[0] == "my car: 120 random roads of 998 m, IRI 1 to 10 m/km"
    rows = [line.split() for line in lines if line[:6].strip().replace(".", "").isdigit()]
    assert [row[:2] for row in rows[:7]][::6] == [["4.47", "10"], ["31.29", "70"]]
    assert len(rows) == 7


@pytest.mark.slow
def test_the_figures_as_json_and_csv(car: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "table.csv"
    found = Call(capsys, car, "--json", "--out", table).json()
    assert found["sprung_mass_kg"] == 875
    with table.open(encoding="ascii", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [list(row) for row in rows] == [list(speed) for speed in found["speeds"]]
    for row, speed in zip(rows, found["speeds"], strict=True):
        assert [float(value) for value in row.values()] == pytest.approx(list(speed.values()), rel=1e-6)


def test_files_that_are_not_there_or_in_the_way(car: Path) -> None:
    with pytest.raises(BadInput, match=r"no vehicle 'trabant'.*rav4-2009"):
        main(["calibrate", "--vehicle", "trabant"])
    with pytest.raises(BadInput, match=r"trabant\.yaml"):
        main(["calibrate", "--vehicle", "trabant.yaml"])
    with pytest.raises(BadInput, match="a file other than the input"):
        main(["calibrate", "--vehicle", str(car), "--out", str(car)])
