"""What the lab's commands have in common: what they refuse, and that they do so before anything takes long."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from logger.commands.main import main
from logger.errors import BadInput
from logger.roads.track import Track
from logger.shipped import vehicle_file
from logger.store.drive_file import read_run, write_drive, write_profile

from lacking import named, write_runs

SHAKES = """\
from dataclasses import replace
from logger.vehicle.effect import BodyEffect, Parameter, Scale


class Shakes(BodyEffect):
    name = title = source = signature = shown_by = "shakes"
    parameters = (Parameter("much", 2.0, 0.0, 9.0, 0.0, Scale.LINEAR, (2.0,), "how much"),)

    def structure(self, p, structure):
        return replace(structure, damping=(1 - p.much) * structure.damping)


EFFECT = Shakes()
"""
COMMANDS: dict[str, Callable[[Path], list[str]]] = {
    "compare": lambda out: ["compare", "--out", str(out / "page.html")],
    "diagnose": lambda out: ["diagnose", "--out", str(out / "page.html")],
    "add-effect": lambda out: ["add-effect", "sensor_gain", "--out", str(out / "new.yaml")],
    "lab": lambda out: ["lab", "--yes", "--out", str(out / "lab")],
}


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return write_runs(tmp_path_factory.mktemp("plain"), named("sensor_gain", gain=1.1), lasts_s=8.0)


@pytest.fixture(autouse=True)
def no_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("compare.compare", "diagnosis.diagnose", "candidates.screened", "addition.add"):
        monkeypatch.setattr(f"logger.lab.{name}", None)


def car_with(folder: Path, effect: str) -> str:
    path = folder / "car.yaml"
    text = vehicle_file("rav4-2009").read_text("utf-8")
    path.write_text(text.replace("effects: []", f"effects: [{effect}]"), "utf-8")
    return str(path)


@pytest.mark.parametrize("command", COMMANDS)
def test_an_effect_that_these_runs_cannot_carry(command: str, runs: list[str], tmp_path: Path) -> None:
    car = car_with(tmp_path, "{name: roll, track_width_m: 1.5, roll_inertia_kg_m2: 500}")
    with pytest.raises(BadInput) as caught:
        main([*COMMANDS[command](tmp_path), "--vehicle", car, *runs])
    assert str(caught.value) == (f"{car}: its effect roll cannot be on {runs[0]}: the profile has one track; it needs "
                                 "elevation_right_m")


@pytest.mark.parametrize("command", COMMANDS)
def test_a_car_that_shakes_itself_to_pieces(command: str, runs: list[str], tmp_path: Path) -> None:
    (tmp_path / "shakes.py").write_text(SHAKES, "utf-8")
    car = car_with(tmp_path, "{name: shakes, file: shakes.py, much: 9}")
    with pytest.raises(BadInput, match=r"car\.yaml: with shakes the car's motion grows without bound"):
        main([*COMMANDS[command](tmp_path), "--vehicle", car, *runs])
    if command != "compare":
        with pytest.raises(BadInput, match=r"shakes\.py: with shakes the car's motion grows without bound"):
            main([*COMMANDS[command](tmp_path), "--vehicle", "rav4-2009", *runs, "--effect-file",
                  str(tmp_path / "shakes.py")])


@pytest.mark.parametrize("command", COMMANDS)
def test_what_cannot_be_written_is_refused_first(command: str, runs: list[str], tmp_path: Path) -> None:
    given, out = ["--vehicle", "rav4-2009", *runs], tmp_path / "none"
    words = "in a folder that there is"
    if command == "lab":
        (out / "lab" / "vehicle-3.yaml").mkdir(parents=True)
    with pytest.raises(BadInput, match=words):
        main([*COMMANDS[command](out), *given])
    with pytest.raises(BadInput, match="a run's" if command != "lab" else "expected a folder"):
        main([*COMMANDS[command](tmp_path), *given, "--out", str(Path(runs[0]) / "drive.csv")])


def test_a_page_or_a_story_is_not_written_over_the_vehicle(runs: list[str], tmp_path: Path) -> None:
    car = Path(car_with(tmp_path, ""))
    for command in ("compare", "diagnose"):
        with pytest.raises(BadInput, match="expected another file than those that are read"):
            main([command, "--vehicle", str(car), *runs, "--out", str(car)])
    car = car.rename(tmp_path / "vehicle-1.yaml")
    with pytest.raises(BadInput, match=r"vehicle-1\.yaml: expected another file than those that are read"):
        main(["lab", "--yes", "--vehicle", str(car), *runs, "--out", str(tmp_path)])


@pytest.mark.parametrize("command", COMMANDS)
def test_what_takes_long_without_a_compiler_is_said_before(
    command: str, runs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("logger.vehicle.stepping_loop.COMPILED", False)
    monkeypatch.setattr("logger.lab.prediction.Runs.predict", None)
    car = car_with(tmp_path, "{name: wheel_lift}")
    with pytest.raises(TypeError):
        main([*COMMANDS[command](tmp_path), "--vehicle", car, *runs])
    told = capsys.readouterr().err
    assert "Without the lab extra (pip install '.[lab]') simulations with wheel_lift take" in told
    assert told.count("\n") == 1


def changed(run: str, folder: Path, **columns: Callable[[npt.NDArray[np.float64]], object]) -> str:
    """The run with other columns."""
    given = read_run(run)
    names = {"accel": "accel_z_mps2", "speed": "speed_mps", "distance": "distance_m"}
    kept = {name: getattr(given, name) for name in names.values()}
    new = {names[name]: np.broadcast_to(np.asarray(make(kept[names[name]])), len(given.time_s))
           for name, make in columns.items()}
    write_drive(folder / "drive.csv", {"t_s": given.time_s, **kept, **new})
    write_profile(folder / "profile.csv", given.track)
    return str(folder)


CHANGES = {
    "zeros": ({"accel": lambda a: 0.0}, "drive.csv: expected accelerations after the first 2 s, found zeros only"),
    "constant": ({"accel": lambda a: 1.5}, "drive.csv: .* found 1.5 m/s2 all along"),
    "tiny": ({"accel": lambda a: 1e-9 * a}, "drive.csv: expected accelerations in m/s2, found none above"),
    "NaN": ({"accel": lambda a: np.where(a == a[500], np.nan, a)}, "drive.csv:502: expected a number for accel_z_mps2"),
    "gravity": ({"accel": lambda a: a + 9.81}, "drive.csv: expected gravity to be removed"),
    "upside down": ({"accel": lambda a: -a}, "upside down: turned over, they go with the model"),
    "in g": ({"accel": lambda a: a / 9.80665}, "expected accelerations in m/s2, .* they seem to be in g"),
    "in mg": ({"accel": lambda a: a / 0.00980665 - np.mean(a / 0.00980665)}, "they seem to be in thousandths of g"),
    "backwards": ({"distance": lambda d: d[::-1]}, r"drive.csv:\d+: expected distances that grow, as the car drives"),
    "a leap": ({"distance": lambda d: d + 20.0 * (np.arange(len(d)) > 300)}, "drive.csv:303: .* that grow steadily"),
    "km/h": ({"speed": lambda v: 3.6 * v}, "drive.csv: expected speed_mps .* to agree"),
    "no speed": ({"speed": lambda v: 0.0}, "drive.csv: expected speed_mps .* to agree"),
    "standing": ({"speed": lambda v: 0.0, "distance": lambda d: 20.0}, "a drive over a road that moves the car"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_record_of_nothing(name: str, runs: list[str], tmp_path: Path) -> None:
    change, words = CHANGES[name]
    wrong = changed(runs[0], tmp_path, **change)
    for command in ("compare", "add-effect"):
        with pytest.raises(BadInput, match=words) as caught:
            main([*COMMANDS[command](tmp_path), "--vehicle", "rav4-2009", wrong])
        assert str(caught.value).startswith(wrong)
    if "drive.csv" in words:
        with pytest.raises(BadInput, match=words):
            main(["diagnose", "--same-road", "--vehicle", "rav4-2009", wrong, runs[1]])


def test_a_road_that_is_flat(runs: list[str], tmp_path: Path) -> None:
    wrong = changed(runs[0], tmp_path)
    write_profile(tmp_path / "profile.csv", Track(0.5, np.full(300, 2.0)))
    with pytest.raises(BadInput, match="expected a drive over a road that moves the car; where it was the profile is"):
        main(["compare", "--vehicle", "rav4-2009", wrong])


def test_two_tracks_are_asked_for_where_no_profile_is_known(runs: list[str], tmp_path: Path) -> None:
    car = car_with(tmp_path, "{name: roll, track_width_m: 1.5, roll_inertia_kg_m2: 500}")
    with pytest.raises(BadInput, match=r"car\.yaml: its effect roll needs a road that is known under the right wheels"):
        main(["diagnose", "--same-road", "--vehicle", car, *runs])
