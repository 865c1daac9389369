"""``ridelog compare``: sentences for a person, the contract's object for a program, a page, and one line else."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.store.formats.drive_file import write_drive, write_profile

from ..support.lab.runs_with_residual import RATE_HZ, beside_with, recorded_by


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Two runs of a car with friction that the model does not have."""
    top = tmp_path_factory.mktemp("drives")
    folders = []
    for run in beside_with(recorded_by([("dry_friction", {"friction_force_n": 80.0})], 0.02), lasts_s=14.0).runs[:2]:
        folder = top / Path(run.name).name
        folder.mkdir()
        write_drive(folder / "drive.csv", {"t_s": np.arange(run.count) / RATE_HZ, "accel_z_mps2": run.measured_mps2,
                                           "speed_mps": run.speed_mps, "distance_m": run.distance_m})
        write_profile(folder / "profile.csv", run.track)
        folders.append(str(folder))
    return folders


def compare(*arguments: str) -> int:
    return main(["compare", "--vehicle", "rav4-2009", *arguments])


def test_for_a_program_and_as_a_page(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "page.html"
    assert compare(*runs, "--json", "--out", str(page)) == 0
    reported = json.loads(capsys.readouterr().out)
    assert [run["run"] for run in reported["runs"]] == runs
    assert all(run["samples"] == 1200 for run in reported["runs"])
    assert reported["missing"] is True
    assert 0 < reported["refitted"]["error"] <= reported["error"] < 2
    assert page.read_text("utf-8").startswith("<!doctype html>")


def test_for_a_person(runs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert compare(*runs) == 0
    reported = capsys.readouterr().out
    lines = reported.splitlines()
    assert "rav4-2009 on 2 runs, 24 s." in lines
    assert lines[0].startswith("The model lacks something: ")
    assert re.search(r"NRMSE 0\.\d{3} \(residual [\d.]+ over measured [\d.]+ m/s2 r\.m\.s\.\)\.", " ".join(lines))
    assert "Next: ridelog diagnose" in " ".join(reported.split())
    assert "Noise floor: at most 0." in " ".join(reported.split())
    assert all(len(line) <= 100 for line in lines)
    assert "wheel hop" in reported and "\nrun1 " in reported
    tables = reported[reported.index("By band"):reported.index("rav4-2009 on")]
    assert all(len(line) <= 80 for line in tables.splitlines())


@pytest.mark.slow
def test_numbers_are_far_off_by_their_prior(runs: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    reported = []
    for tolerance in ("0.01", "0.4"):
        assert compare(*runs, "--json", "--tolerance", tolerance) == 0
        reported.append(json.loads(capsys.readouterr().out)["refitted"])
    firm, loose = reported
    assert firm["shifted_far"] and not loose["shifted_far"]
    assert max(map(abs, loose["shifts"].values())) > max(map(abs, firm["shifts"].values()))


def test_what_cannot_be_compared(runs: list[str], tmp_path: Path) -> None:
    profile = (Path(runs[0]) / "profile.csv").read_text("utf-8")
    drive = (Path(runs[0]) / "drive.csv").read_text("utf-8").splitlines(keepends=True)

    def wrong(lines: list[str], name: str) -> str:
        (tmp_path / name).mkdir()
        (tmp_path / name / "drive.csv").write_text("".join(lines), "utf-8")
        (tmp_path / name / "profile.csv").write_text(profile, "utf-8")
        return str(tmp_path / name)

    def changed(column: int, value: str) -> list[str]:
        rows = [line.rstrip("\n").split(",") for line in drive[1:]]
        return [drive[0], *(",".join([*row[:column], value, *row[column + 1:]]) + "\n" for row in rows)]

    slower = [drive[0], *(f"{i / 50:.2f}," + line.partition(",")[2] for i, line in enumerate(drive[1:]))]
    for arguments, words in (
        ((runs[0], runs[0]), "each run once"),
        ((wrong(drive[:400], "short"),), "5 s or longer"),
        ((runs[0], wrong(slower, "slower")), "100 samples a second"),
        ((wrong(changed(3, "99999"), "away"),), "on the profile"),
        ((wrong(changed(1, "0"), "silent"),), "zeros only"),
        ((str(tmp_path / "none"),), "expected a folder"),
        ((runs[0], "--tolerance", "nan"), "--tolerance nan: expected unknown, or 0.001 to 0.5"),
    ):
        with pytest.raises(BadInput, match=words):
            compare(*arguments)
