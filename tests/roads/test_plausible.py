"""What a road can be: no measured or standard road is refused, however rough; another unit is, with its name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.bounds import time_hint
from logger.commands.main import main
from logger.errors import BadInput
from logger.roads.iri import likely_unit, limit_hint, unit_complaint, unit_doubt
from logger.roads.iso8608 import CLASS_GD_N0_CM3, generate
from logger.roads.obstacles import OBSTACLES
from logger.store.formats.profile_file import read_profile
from logger.units import FOOT_M

DISTANCE_M = 0.05 * np.arange(4001)


def smooth(seed: int = 1) -> np.ndarray:
    return generate(CLASS_GD_N0_CM3["A"], 200.0, 0.05, seed)


@pytest.mark.parametrize("letter", CLASS_GD_N0_CM3)
def test_every_class_of_iso_8608_is_a_road(letter: str) -> None:
    for seed in range(4):
        for length_m in (20.0, 200.0):
            assert unit_complaint(generate(CLASS_GD_N0_CM3[letter], length_m, 0.05, seed), 0.05) == ""


@pytest.mark.parametrize("road", [
    OBSTACLES["step"](DISTANCE_M[:400], 10.0, 0.15), OBSTACLES["pothole"](DISTANCE_M[:400], 10.0, 0.2, 1.0),
    OBSTACLES["bump"](DISTANCE_M[:400], 10.0, 0.1, 0.5), 0.3 * DISTANCE_M, 0.3 * np.abs(DISTANCE_M - 100),
    0.02 * np.sin(2 * np.pi * DISTANCE_M / 0.75), 1500 + np.zeros(400)],
    ids=["kerb", "pothole", "bump", "hill", "top of a hill", "corrugations", "plateau"])
def test_what_is_rough_or_steep_is_a_road(road: np.ndarray) -> None:
    assert unit_complaint(road, 0.05) == ""


def written(path: Path, header: str, distance: np.ndarray, elevation: np.ndarray) -> str:
    np.savetxt(path, np.stack([distance, elevation], axis=1), "%.7g", ",", header=header, comments="")
    return str(path)


@pytest.mark.parametrize(("factor", "unit"), [(1000.0, "mm"), (1e3 / 25.4, "in"), (100.0, "cm"), (1 / FOOT_M, "ft")])
def test_a_column_says_its_unit(factor: float, unit: str, tmp_path: Path) -> None:
    in_metres = read_profile(written(tmp_path / "m.csv", "distance_m,elevation_m", DISTANCE_M, smooth()))
    file = written(tmp_path / "u.csv", f"distance_ft,elevation_{unit}", DISTANCE_M / FOOT_M, factor * smooth())
    found = read_profile(file)
    assert found.spacing_m == pytest.approx(0.05)
    np.testing.assert_allclose(found.elevation_m, in_metres.elevation_m, atol=1e-6)


COMMANDS = (["road", "classify", "FILE"], ["plan", "--vehicle", "golden-car", "--profile", "FILE", "--speed", "15"],
            ["simulate", "--vehicle", "golden-car", "--speed", "15", "--profile", "FILE", "--out", "OUT"])


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command[0])
def test_each_command_refuses_a_profile_in_another_unit(command: list[str], tmp_path: Path) -> None:
    for header, distance, elevation, words in (
            ("distance_m,elevation_m", DISTANCE_M, 1000 * smooth(), "Elevation in mm.*as elevation_mm"),
            ("distance_m,elevation_m", DISTANCE_M, 583e3 + 1000 * smooth(), r"within 10000 m.*in mm\?.*elevation_mm"),
            ("distance_m,elevation_m", DISTANCE_M / 1e3, smooth(), "0.05 m in km or .* in mi.*as distance_km")):
        file = written(tmp_path / "profile.csv", header, distance, elevation)
        with pytest.raises(BadInput, match=words) as refused:
            main([{"FILE": file, "OUT": str(tmp_path / "out.csv")}.get(word, word) for word in command])
        assert "\n" not in str(refused.value)


def test_the_iri_of_distances_in_another_unit_names_it(tmp_path: Path) -> None:
    for factor, unit in ((1e3, "mm"), (1 / FOOT_M, "feet"), (1e-3, "km")):
        file = written(tmp_path / "profile.csv", "distance_m,elevation_m", factor * 0.1 * np.arange(2000),
                       smooth()[:2000])
        with pytest.raises(BadInput, match=rf"{unit}.*as distance_"):
            main(["iri", file])


def test_inches_are_doubted_and_no_more(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path / "road.csv", "distance_m,elevation_m", DISTANCE_M, smooth() * 1e3 / 25.4 * 2)
    for command in (["iri", file], ["road", "classify", file]):
        assert main(command) == 0
        assert "is more than any road has" in capsys.readouterr().out
    assert "in cm? An IRI of 160 m/km is more than any road has (1.6 in cm, 4.06 in inches)" in unit_doubt(160.0)
    assert unit_doubt(24.0) == ""


@pytest.mark.parametrize("command", [["iri", "FILE", "--localized"], ["sections", "FILE", "--localized"],
                                     ["passes", "FILE", "--above"]], ids=lambda command: command[0])
def test_a_limit_in_inches_per_mile_is_asked_for(command: list[str], tmp_path: Path) -> None:
    file = written(tmp_path / "road.csv", "distance_m,elevation_m", DISTANCE_M, smooth())
    with pytest.raises(BadInput, match=r"160 in/mi are 2\.525 m/km \(at a terminal write 160in/mi\)"):
        main([*(file if word == "FILE" else word for word in command), "160"])
    assert limit_hint(2.5) == ""


def test_a_limit_may_be_written_in_inches_per_mile(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = written(tmp_path / "road.csv", "distance_m,elevation_m", DISTANCE_M, 2 * smooth())
    printed = []
    for limit in ("160in/mi", "2.52525", "2.52525m/km"):
        assert main(["iri", file, "--localized", limit]) == 0
        printed.append(capsys.readouterr().out)
    assert printed[0].count("m/km") > 3
    assert printed[1] == printed[2]
    assert [line.split()[:2] for line in printed[0].splitlines()[-3:]] == [
        line.split()[:2] for line in printed[1].splitlines()[-3:]]


@pytest.mark.parametrize(("off", "words"), [
    (3.62, "km/h would give 3.6"), (2.2, "mph would give 2.24"), (1.93, "knots would give 1.94"),
    (1000.0, "distances in km would give 1e+03"), (0.305, "distances in ft would give 0.305"),
    (0.85, "km/h would give 3.6")])
def test_a_way_that_is_off_by_a_unit_names_it(off: float, words: str) -> None:
    assert likely_unit(off * 900.0, 900.0) == words


def test_a_clock_in_milliseconds_is_named() -> None:
    assert time_hint(0.1) == " (t_s in ms? Write seconds)"
    assert time_hint(1e-4) == " (t_s in us? Write seconds)"
    assert time_hint(20.0) == ""
