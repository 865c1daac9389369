"""A drive over another road is refused before anything is concluded from it, by every command that needs the road."""

from pathlib import Path

import numpy as np
import pytest
import yaml

from logger.api.inputs import run_on_road as read_run
from logger.commands.main import main
from logger.errors import BadInput
from logger.profiles.track import Track
from logger.shipped import vehicle_path
from logger.store.formats.drive_file import write_profile
from logger.store.formats.effect_file import shipped_effects

from ..support.lab.runs_with_effects import FEW, write_runs


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    """Runs of half a minute, of a car whose model has all, each on a road of its own."""
    return list(write_runs(tmp_path_factory.mktemp("runs"), [], lasts_s=30.0))


COMMANDS = {
    "compare": ["compare"], "diagnose": ["diagnose"], "lab": ["lab", "--out", "lab"],
    "add-effect": ["add-effect", "sensor_gain", "--out", "new.yaml"],
    "identify": ["identify", "--free", "sprung_mass_kg"], "estimate": ["estimate"],
    "learn": ["learn", "--out", "law.py"],
}


@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_another_road(command: str, runs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    wrong = with_track(runs[0], tmp_path, read_run(runs[1]).track)
    with pytest.raises(BadInput, match=r"found one that does not .* fits nowhere on the profile"):
        main([*COMMANDS[command], "--vehicle", "rav4-2009", wrong])
    assert not (tmp_path / "new.yaml").exists() and not (tmp_path / "lab").exists()


def test_the_other_direction_and_another_beginning(runs: list[str], tmp_path: Path) -> None:
    own = read_run(runs[0]).track
    for track, words in (
        (Track(own.spacing_m, own.elevation_m[::-1].copy(), own.start_m), "read backwards"),
        (Track(own.spacing_m, own.elevation_m, own.start_m - 60.0), r"-\d+ m farther along"),
        (Track(own.spacing_m, 1000 * own.elevation_m, own.start_m), "the profile seems to be in mm"),
    ):
        with pytest.raises(BadInput, match=words):
            main(["compare", "--vehicle", "rav4-2009", with_track(runs[0], tmp_path, track)])


@pytest.mark.slow
def test_who_wants_to_go_on_is_warned(runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    own = read_run(runs[0]).track
    wrong = with_track(runs[0], tmp_path, Track(own.spacing_m, np.roll(own.elevation_m, 900), own.start_m))
    assert main(["compare", "--vehicle", "rav4-2009", wrong, "--anyway"]) == 0
    said = capsys.readouterr()
    assert "found one that does not" in said.err and "NRMSE" in said.out


@pytest.mark.slow
def test_an_estimate_beside_another_road_goes_on_only_where_it_is_asked_to(
    runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str],
) -> None:
    wrong = with_track(runs[0], tmp_path, read_run(runs[1]).track)
    assert main(["estimate", "--vehicle", "rav4-2009", wrong, "--anyway"]) == 0
    assert "found one that does not" in capsys.readouterr().err
    assert main(["estimate", "--vehicle", "rav4-2009", runs[0]]) == 0


@pytest.mark.slow
def test_another_cars_file_is_refused_but_by_identify(
    runs: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The record is of a car that the file says is half as stiff, twice as heavy and has heavy wheels. Where the file
    is far off in fewer numbers, they are named."""
    other = file_that_is_off(tmp_path, 0.5, (2.0, 1.4), 0.6)
    assert main(["compare", "--vehicle", str(other), runs[1]]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "parameters beyond their tolerance" in words and "front.suspension_stiffness_n_per_m by -" in words
    other = file_that_is_off(tmp_path, 2.0, (0.5, 0.5), 2.2)
    with pytest.raises(BadInput, match=r"found one of another car: .* ridelog identify fits .*\(--anyway goes on\)"):
        main(["compare", "--vehicle", str(other), runs[1]])
    free = ("both.suspension_stiffness_n_per_m,both.unsprung_mass_kg,both.suspension_damping_n_s_per_m,"
            "both.tire_stiffness_n_per_m")
    assert main(["identify", "--vehicle", str(other), "--free", free, runs[0]]) == 0
    capsys.readouterr()
    few = {name: shipped_effects()[name] for name in FEW}  # no effect explains it: all were tried above
    monkeypatch.setattr("logger.store.formats.effect_file.shipped_effects", lambda: few)
    assert main(["compare", "--vehicle", str(other), runs[1], "--anyway"]) == 0
    assert "found one of another car" in capsys.readouterr().err


def file_that_is_off(folder: Path, mass: float, springs: tuple[float, float], unsprung: float) -> Path:
    """A file of the RAV4 whose numbers are off by these factors."""
    own = yaml.safe_load(vehicle_path("rav4-2009").read_text("utf-8"))
    own["sprung_mass_kg"] *= mass
    for axle, factor in zip(("front", "rear"), springs, strict=True):
        own[axle]["suspension_stiffness_n_per_m"] *= factor
        own[axle]["suspension_damping_n_s_per_m"] *= 0.8
        own[axle]["unsprung_mass_kg"] *= unsprung
    other = folder / "other.yaml"
    other.write_text(yaml.safe_dump(own), "utf-8")
    return other


def with_track(run: str, folder: Path, track: Track) -> str:
    """A copy of a run on another track."""
    (folder / "drive.csv").write_bytes((Path(run) / "drive.csv").read_bytes())
    write_profile(folder / "profile.csv", track)
    return str(folder)
