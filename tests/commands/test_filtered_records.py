"""Records that somebody low-passed, through the lab's commands: what is said of them, and what is not."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, sosfiltfilt

from logger.commands.main import main
from logger.errors import BadInput


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[str]]:
    """A car on a rough road at 10 and 18 m/s: as recorded, and low-passed at 25 Hz by an engineer, forth and back."""
    top = tmp_path_factory.mktemp("drives")
    road = top / "road.csv"
    assert main(["road", "generate", "--class", "C", "--length", "450", "--seed", "3", "--out", str(road)]) == 0
    found: dict[str, list[str]] = {"plain": [], "filtered": []}
    for number, speed in enumerate(("10", "18"), 1):
        plain = top / f"plain{number}"
        plain.mkdir()
        assert main(["simulate", "--vehicle", "rav4-2009", "--profile", str(road), "--speed", speed, "--noise", "0.05",
                     "--seed", str(number), "--out", str(plain / "drive.csv")]) == 0
        (plain / "profile.csv").write_bytes(road.read_bytes())
        found["plain"].append(str(plain))
        found["filtered"].append(_filtered(plain, top / f"filtered{number}"))
    return found


def _filtered(plain: Path, folder: Path) -> str:
    folder.mkdir()
    (folder / "profile.csv").write_bytes((plain / "profile.csv").read_bytes())
    with (plain / "drive.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    column = head.index("accel_z_mps2")
    through = sosfiltfilt(butter(8, 25.0, fs=100.0, output="sos"), np.array([float(row[column]) for row in rows]))
    with (folder / "drive.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([head, *([*row[:column], f"{value:.6f}", *row[column + 1:]]
                                            for row, value in zip(rows, through, strict=True))])
    return str(folder)


def answer(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, object]:
    capsys.readouterr()
    assert main([*arguments, "--vehicle", "rav4-2009", "--json"]) == 0
    return dict(json.loads(capsys.readouterr().out))


def words(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    capsys.readouterr()
    assert main([*arguments, "--vehicle", "rav4-2009"]) == 0
    return " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_a_comparison_says_where_the_record_ends_and_finds_nothing(
        drives: dict[str, list[str]], capsys: pytest.CaptureFixture[str]) -> None:
    found = answer(capsys, "compare", *drives["filtered"])
    assert found["missing"] is False
    assert found["low_passed_at_hz"] == pytest.approx(25.0, rel=0.05)
    low_hz, high_hz = found["pass_band_hz"]  # type: ignore[misc]
    assert low_hz == 0 and 18 < high_hz < 25
    said = words(capsys, "compare", *drives["filtered"])
    assert "The recorder low-passed at about 25 Hz, so measurement and model are compared" in said


@pytest.mark.slow
def test_a_record_as_it_was_recorded_is_compared_whole(
        drives: dict[str, list[str]], capsys: pytest.CaptureFixture[str]) -> None:
    found = answer(capsys, "compare", *drives["plain"])
    assert "pass_band_hz" not in found and "low_passed_at_hz" not in found


@pytest.mark.slow
def test_what_is_asked_is_left_out_of_the_record_and_of_the_model(
        drives: dict[str, list[str]], capsys: pytest.CaptureFixture[str]) -> None:
    """Of white noise of 0.05 m/s2 two fifths lie below 20 Hz of 50."""
    run = drives["plain"][0]
    whole, found = answer(capsys, "compare", run), answer(capsys, "compare", run, "--low-pass", "20")
    assert found["pass_band_hz"] == [0, 20] and found["low_passed_at_hz"] is None
    assert found["error"] == pytest.approx(float(str(whole["error"])) * np.sqrt(0.4), rel=0.05)
    (Path(run) / "run.yaml").write_text("pass_band_hz: [0, 20]\n", "utf-8")
    try:
        assert answer(capsys, "compare", run)["error"] == pytest.approx(found["error"])
    finally:
        (Path(run) / "run.yaml").unlink()
    with pytest.raises(BadInput, match="low-pass 70: expected above 0 and below 50 Hz"):
        main(["compare", "--vehicle", "rav4-2009", run, "--low-pass", "70"])


@pytest.mark.release
def test_nothing_is_missing_in_a_record_that_was_filtered(
        drives: dict[str, list[str]], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    found = answer(capsys, "diagnose", *drives["filtered"])
    assert found["verdict"] == [] and found["unexplained"] is False
    assert found["noise_floor_error"] == pytest.approx(found["baseline_error"], rel=0.03)
    added = words(capsys, "add-effect", "body_bending", *drives["filtered"], "--out", str(tmp_path / "bent.yaml"))
    assert "WARNING: it does not help" in added and "It helps" not in added
