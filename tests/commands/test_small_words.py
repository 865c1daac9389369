"""Sentences that people meet by mistake, or once: each says what it does."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from logger.commands.main import main
from logger.errors import BadInput, did_you_mean
from logger.printable import counted


def test_a_command_that_is_nearly_right_is_guessed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["repot"])
    assert "found 'repot'; did you mean report?" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["repot", "logs/", "--out", "drive.html"])
    assert "found 'repot'; did you mean report?" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["vehicle"])
    assert "did you mean" not in capsys.readouterr().err
    assert did_you_mean("zzz", ["report"]) == ""
    assert did_you_mean("friction", ["dry_friction", "tire_damping"]) == "; did you mean dry_friction?"
    masses = ["sprung_mass_kg", "front.unsprung_mass_kg", "pitch_inertia_kg_m2"]
    assert did_you_mean("mass", masses) == "; did you mean sprung_mass_kg or front.unsprung_mass_kg?"


@pytest.mark.parametrize(("arguments", "said"), [
    (["iri", "p.csv", "--windows", "3"], "there is no option --windows; did you mean --window? (try"),
    (["iri", "--wnidow", "5", "p.csv"], "there is no option --wnidow; did you mean --window? (try"),
    (["identify", "run", "--fre=x"], "there is no option --fre; did you mean --free? (try"),
    (["road", "generate", "--clas", "B"], "there is no option --clas; did you mean --class? (try"),
    (["iri", "p.csv", "q.csv"], "expected no q.csv (try"),
    (["fleet", "frob"], "expected one of 'ingest', 'summarise', 'report', found 'frob' (try"),
    (["convert", "logs"], "expected --to (try"),
    (["demo", "--lab", "--field"], "--field: expected no --lab with it (try"),
])
def test_wrong_use_is_said_as_everything_else(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(arguments)
    assert f"ridelog {arguments[0]}: {said}" in capsys.readouterr().err


@pytest.mark.parametrize(("arguments", "said"), [
    (["modes", "p.csv", "--from", "3ft"], "--from 3ft: expected a number, without its unit"),
    (["comfort", "p.csv", "--unit", "ft"], "--unit ft: expected one of mps2, g"),
    (["export"], "export: expected --to DIR"), (["export", "--to", "a", "--removed"],
                                                        "export: expected --to DIR alone"),
])
def test_what_an_option_may_not_be_is_one_sentence(arguments: list[str], said: str) -> None:
    with pytest.raises(BadInput, match=f"^{said}$"):
        main(arguments)


@pytest.mark.parametrize(("command", "header", "said"), [
    ("iri", "t_s,accel_z_mps2,speed_mps,distance_m", "; this is a drive: ridelog estimate takes it"),
    ("iri", "t_s,accel_z_mps2", "; this is an acceleration record: ridelog comfort takes it"),
    ("comfort", "distance_m,elevation_m", "; this is a profile: ridelog iri takes it"),
    ("iri", "distance_m,elevation_m,roll_deg", "found 'distance_m,elevation_m,roll_deg'"),
    ("comfort", "time_s,accel_z_mps2", "found 'time_s,accel_z_mps2'"),
])
def test_a_file_of_another_command_is_recognised(command: str, header: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "one.csv").write_text(header + "\n" + ",".join("0" for _ in header.split(",")) + "\n")
    with pytest.raises(BadInput) as caught:
        main([command, str(tmp_path / "one.csv")])
    assert str(caught.value).endswith(said)


def test_settings_name_the_key_and_guess_it(tmp_path: Path) -> None:
    file = tmp_path / "settings.yaml"
    for text, words in (("log:\n  directry: x\n", "did you mean directory"),
                        ("gps:\n  baud: nine\n", "'nine' for 'baud'")):
        file.write_text(text)
        with pytest.raises(BadInput, match=words):
            main(["run", "--config", str(file)])


def test_millimetres_are_suspected(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for factor, doubts in ((1.0, 0), (1000.0, 1)):
        file = tmp_path / f"{factor:g}.csv"
        rows = [f"{i * 0.1:.1f},{factor * 0.01 * (i % 7):.4f}" for i in range(400)]
        file.write_text("distance_m,elevation_m\n" + "\n".join(rows) + "\n")
        assert main(["iri", str(file), "--json"]) == 0
        reported = json.loads(capsys.readouterr().out)
        assert (reported["iri_m_per_km"] > 100, len(reported.get("doubts", []))) == (bool(doubts), doubts)
        assert main(["iri", str(file)]) == 0
        assert ("Elevation in mm?" in capsys.readouterr().out) == bool(doubts)


def test_drives_over_one_road_may_be_files(tmp_path: Path) -> None:
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text("t_s,accel_z_mps2,speed_mps,distance_m\n0,0,1,0\n0.01,0.1,1,0.01\n")
    files = [str(tmp_path / name) for name in ("a.csv", "b.csv")]
    with pytest.raises(BadInput, match=r"a\.csv: (?!.*readable file)"):
        main(["diagnose", "--same-road", "--vehicle", "golden-car", *files])


def test_one_of_a_thing_is_not_several() -> None:
    assert [counted(number, "file") for number in (0, 1, 2000)] == ["0 files", "1 file", "2,000 files"]
