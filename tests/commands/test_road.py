"""``ridelog road``: what it writes can be read, what it reads is described, and what it cannot use is one line."""

import json
from pathlib import Path

import numpy as np
import pytest

import ridelog
from logger.commands.main import main
from logger.errors import BadInput
from logger.roads import iso8608
from logger.roads.iri import iri
from logger.store.formats.profile_file import read_profile


def generate(path: Path, *arguments: str) -> None:
    assert main(["road", "generate", "--out", str(path), *arguments]) == 0


def classify(path: Path, capsys: pytest.CaptureFixture[str], *arguments: str) -> dict:
    capsys.readouterr()
    assert main(["road", "classify", str(path), "--json", *arguments]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1
    reported: dict = json.loads(lines[0])
    return reported


def test_a_road_is_written_as_a_profile(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "road.csv"
    generate(path, "--class", "b", "--length", "120", "--seed", "7")
    profile = read_profile(path)
    assert profile.spacing_m == pytest.approx(0.05)
    assert profile.elevation_m == pytest.approx(iso8608.generate(64, 120, 0.05, 7), abs=0.51e-7)
    output = capsys.readouterr()
    assert output.out == ""
    assert "120 m in 2401 samples, class B, Gd(n0) 64 cm3, waviness 2, seed 7" in output.err


def test_without_a_file_it_goes_to_stdout(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    generate(tmp_path / "road.csv", "--class", "C", "--length", "20")
    capsys.readouterr()
    assert main(["road", "generate", "--class", "C", "--length", "20"]) == 0
    output = capsys.readouterr()
    assert output.out == (tmp_path / "road.csv").read_text()
    assert output.err.startswith("stdout: 20 m in 401 samples")


def test_an_iri_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    generate(tmp_path / "road.csv", "--iri", "5", "--length", "5000", "--json")
    made = json.loads(capsys.readouterr().out)
    assert (made["iri_m_per_km"], made["class"], made["samples"]) == (pytest.approx(5, rel=0.02), "B", 100_001)
    rough_in_waves = ridelog.random_road(iri_m_per_km=5.0, length_m=5000.0, waviness=2.5)
    assert ridelog.iri(rough_in_waves).iri_m_per_km == pytest.approx(5, rel=0.02)


def test_classify_prints_the_fields_of_the_contract(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    generate(tmp_path / "road.csv", "--class", "C", "--length", "600")
    reported = classify(tmp_path / "road.csv", capsys)
    assert list(reported)[:4] == ["class", "gd_n0_cm3", "waviness", "iri_m_per_km"]
    assert reported["class"] == "C"
    assert reported["gd_n0_cm3"] == pytest.approx(256, abs=3 * reported["gd_n0_std_cm3"])
    assert reported["waviness"] == pytest.approx(2, abs=3 * reported["waviness_std"])
    assert reported["iri_m_per_km"] == pytest.approx(iri(iso8608.generate(256, 600, 0.05, 1), 0.05), rel=1e-5)
    assert reported["iri_m_per_km"] == pytest.approx(reported["iri_expected_m_per_km"],
                                                 abs=3 * reported["iri_expected_std_m_per_km"])


def test_two_tracks_are_distinguished(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    left, right = (iso8608.generate(gd, 300, 0.1, 1) for gd in (64, 1024))
    rows = "".join(f"{0.1 * number:.1f},{a},{b}\n" for number, (a, b) in enumerate(zip(left, right, strict=True)))
    path = tmp_path / "tracks.csv"
    path.write_text("distance_m,elevation_m,elevation_right_m\n" + rows)
    reported = classify(path, capsys)
    assert (reported["class"], reported["right"]["class"]) == ("B", "D")
    assert main(["road", "classify", str(path)]) == 0
    screen = capsys.readouterr().out
    assert "left track" in screen
    assert "class      D: poor" in screen


def test_a_person_sees_errors_and_doubt(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ridelog.write_profile(tmp_path / "road.csv", ridelog.random_road(gd_n0_cm3=128.0, length_m=150.0))
    assert main(["road", "classify", str(tmp_path / "road.csv")]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "road.csv: 150.00 m (492.1 ft), one sample every 50 mm (1.969 in)"
    assert lines[0].endswith("it may be B or C")
    assert [line.split()[0] for line in lines[:-2]] == ["class", "Gd(n0)", "waviness", "IRI"]
    assert "±" in lines[1]
    assert "Eq 4.39" in lines[3]


def test_the_smoothed_spectrum() -> None:
    found = ridelog.classify(ridelog.random_road(iso_class="B", length_m=3000.0, spacing_m=0.1)).spectrum
    assert np.mean(found.psd_m3 / (64e-6 * (found.centre_cpm / 0.1) ** -2)) == pytest.approx(1, abs=0.05)
    assert (found.freedom > 10).all()


@pytest.mark.parametrize(("options", "message"), [
    ({"spacing_m": 0.0}, "spacing_m 0: expected 0.001 to 0.3 m"), ({"gd_n0_cm3": -1.0}, "gd_n0_cm3 -1: expected 0.001"),
    ({"iri_m_per_km": 1.0, "length_m": 1e6, "spacing_m": 0.01}, "at most 20000000 samples")])
def test_a_road_that_python_cannot_make(options: dict[str, float], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        ridelog.random_road(**options)


def test_an_uneven_profile_can_be_resampled(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    road = iso8608.generate(256, 1000, 0.05, 3)
    kept = np.flatnonzero(np.arange(len(road)) % 9 % 5 % 2 == 0)  # steps of 0.05 to 0.15 m
    path = tmp_path / "uneven.csv"
    path.write_text("distance_m,elevation_m\n" + "".join(f"{0.05 * i:.2f},{road[i]:.6f}\n" for i in kept))
    with pytest.raises(BadInput, match=r"uneven\.csv:\d+: expected even steps"):
        main(["road", "classify", str(path)])
    reported = classify(path, capsys, "--resample", "0.1")
    assert reported["class"] == "C"
    assert reported["highest_cpm"] < 0.25 / 0.0999


@pytest.mark.parametrize(("arguments", "message"), [
    (["--class", "A", "--length", "5"], "--length 5: expected 11 to 1000000 m"),
    (["--class", "A", "--length", "nan"], "--length nan"),
    (["--iri", "inf"], "--iri inf: expected 0.01 to 1000 m/km"),
    (["--iri", "1", "--seed", "-1"], "--seed -1: expected 0 or more"),
    (["--iri", "1", "--json"], "--json: expected --out FILE"), ([], "expected one of --class and --iri"),
    (["--class", "A", "--iri", "2"], "expected one of --class and --iri"),
    (["--class", "J"], "--class J: expected one of A, B"),
])
def test_a_road_that_cannot_be_made(arguments: list[str], message: str) -> None:
    with pytest.raises(BadInput, match=message):
        main(["road", "generate", *arguments])


@pytest.mark.parametrize("arguments", [[], ["generate", "--klass", "A"], ["classify"]])
def test_wrong_use_is_one_line(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as left:
        main(["road", *arguments])
    assert left.value.code == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_a_profile_that_is_too_short(tmp_path: Path) -> None:
    generate(tmp_path / "road.csv", "--class", "A", "--length", "60")
    with pytest.raises(BadInput, match=r"road\.csv: too short to classify: expected at least 100 m, found 60 m"):
        main(["road", "classify", str(tmp_path / "road.csv")])
