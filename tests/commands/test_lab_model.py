"""What the lab's commands have in common: what they refuse, and that they do so before anything takes long."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from logger.api.inputs import run_on_road as read_run
from logger.api.lab.bench import sought_effects
from logger.api.lab.checks import checked_runs
from logger.api.shown import check_out
from logger.commands.main import main
from logger.errors import BadInput
from logger.profiles.track import Track
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import write_drive, write_profile
from logger.vehicle.vehicle import Vehicle

from ..support.command import called
from ..support.lab.runs_with_effects import OWN, named, write_runs

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
    for name in ("compare.compare", "diagnosis.diagnose", "selection.screening.screen", "selection.add_effect.add"):
        monkeypatch.setattr(f"logger.lab.{name}", None)


@pytest.fixture
def fits(no_fits: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """All the same."""
    monkeypatch.undo()


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
    with pytest.raises(BadInput, match=r"car\.yaml: with shakes the model is unstable"):
        main([*COMMANDS[command](tmp_path), "--vehicle", car, *runs])
    if command not in ("compare", "add-effect"):
        with pytest.raises(BadInput, match=r"shakes\.py: with shakes the model is unstable"):
            main([*COMMANDS[command](tmp_path), "--vehicle", "rav4-2009", *runs, "--effect-file",
                  str(tmp_path / "shakes.py")])


def aimed(words: list[str], out: Path) -> list[str]:
    """The same with another file to write."""
    at = words.index("--out") + 1
    return [*words[:at], str(out), *words[at + 1 :]]


@pytest.mark.parametrize("command", COMMANDS)
def test_what_cannot_be_written_is_refused_first(command: str, runs: list[str], tmp_path: Path) -> None:
    given, out = ["--vehicle", "rav4-2009", *runs], tmp_path / "none"
    words = "in a folder that exists"
    if command == "lab":
        (out / "lab" / "vehicle-3.yaml").mkdir(parents=True)
    with pytest.raises(BadInput, match=words):
        main([*COMMANDS[command](out), *given])
    with pytest.raises(BadInput, match="belong to a run" if command != "lab" else "expected a folder"):
        main([*aimed(COMMANDS[command](tmp_path), Path(runs[0]) / "drive.csv"), *given])


def test_a_page_or_a_story_is_not_written_over_the_vehicle(runs: list[str], tmp_path: Path) -> None:
    car = Path(car_with(tmp_path, ""))
    for command in ("compare", "diagnose"):
        with pytest.raises(BadInput, match="expected a file other than the input"):
            main([command, "--vehicle", str(car), *runs, "--out", str(car)])
    car = car.rename(tmp_path / "vehicle-1.yaml")
    with pytest.raises(BadInput, match=r"vehicle-1\.yaml: expected a file other than the input"):
        main(["lab", "--yes", "--vehicle", str(car), *runs, "--out", str(tmp_path)])


@pytest.mark.parametrize("command", ["compare", "add-effect"])
def test_what_takes_long_without_a_compiler_is_said_before(
    command: str, runs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("logger.vehicle.stepping_loop.COMPILED", False)
    monkeypatch.setattr("logger.simulation.virtual_drive.SimulatedRuns.predict", None)
    car = car_with(tmp_path, "{name: wheel_lift}")
    with pytest.raises(TypeError):
        main([*COMMANDS[command](tmp_path), "--vehicle", car, *runs])
    reported = capsys.readouterr().err
    assert "Without the lab extra (pip install 'ridelog[lab]') simulations with wheel_lift take" in reported
    assert reported.count("\n") == 1


@pytest.mark.parametrize("command", ["diagnose", "lab", "demo"])
def test_a_search_that_could_not_try_every_effect_is_refused(
    command: str, runs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without a compiler some effects cannot be tried: "nothing is missing" would be no answer."""
    monkeypatch.setattr("logger.vehicle.stepping_loop.COMPILED", False)
    out = tmp_path / "out"
    given = ["demo", "--lab", "--out", str(out)] if command == "demo" else [
        *COMMANDS[command](tmp_path), "--vehicle", "rav4-2009", *runs]
    words = rf"the lab extra \(pip install 'ridelog\[lab\]'\).* [1-9]\d* of {len(sought_effects())} effects"
    with pytest.raises(BadInput, match=words) as refused:
        main(given)
    assert "\n" not in str(refused.value)
    assert capsys.readouterr().out == ""
    assert not out.exists()


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
    "held": ({"accel": lambda a: np.repeat(np.round(a[::3], 3), 3)[: len(a)]},
             "drive.csv: expected every sample to be a new measurement, found 6[0-9]% that repeat"),
    "constant": ({"accel": lambda a: 1.5}, "drive.csv: .* found 1.5 m/s2 throughout"),
    "tiny": ({"accel": lambda a: 4e-6 * a}, "drive.csv: expected accelerations in m/s2, found none above"),
    "NaN": ({"accel": lambda a: np.where(a == a[500], np.nan, a)}, "drive.csv:502: expected a number for accel_z_mps2"),
    "gravity": ({"accel": lambda a: a + 9.81}, "drive.csv: expected gravity to be removed"),
    "upside down": ({"accel": lambda a: -a}, "upside down: with the sign changed they follow the model"),
    "in g": ({"accel": lambda a: a / 9.80665}, "expected accelerations in m/s2 .* the record seems to be in g"),
    "in mg": ({"accel": lambda a: a / 0.00980665 - np.mean(a / 0.00980665)},
              "the record seems to be in thousandths of g"),
    "backwards": ({"distance": lambda d: d[::-1]}, r"drive.csv:\d+: expected distances that grow, as the car drives"),
    "a leap": ({"distance": lambda d: d + 20.0 * (np.arange(len(d)) > 300)}, "drive.csv:303: .* that grow steadily"),
    "km/h": ({"speed": lambda v: 3.6 * v}, "drive.csv: expected speed_mps .* to agree"),
    "no speed": ({"speed": lambda v: 0.0}, "drive.csv: expected speed_mps .* to agree"),
    "standing": ({"speed": lambda v: 0.0, "distance": lambda d: 20.0}, "5 s with readings at 0.5 m/s or faster"),
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
    with pytest.raises(BadInput, match="expected a drive over a rough profile; the profile is flat"):
        main(["compare", "--vehicle", "rav4-2009", wrong])


def test_two_tracks_are_asked_for_where_no_profile_is_known(runs: list[str], tmp_path: Path) -> None:
    car = car_with(tmp_path, "{name: roll, track_width_m: 1.5, roll_inertia_kg_m2: 500}")
    with pytest.raises(BadInput, match=r"car\.yaml: its effect roll needs a road that is known under the right wheels"):
        main(["diagnose", "--same-road", "--vehicle", car, *runs])


@pytest.mark.parametrize("share", ["0", "-1", "nan", "0.6"])
@pytest.mark.parametrize("more", [[], ["--same-road"]])
def test_a_tolerance_that_no_car_has(share: str, more: list[str], runs: list[str]) -> None:
    with pytest.raises(BadInput, match=rf"--tolerance {share}: expected unknown, or 0.001 to 0.5"):
        main(["diagnose", *more, "--vehicle", "rav4-2009", *runs, f"--tolerance={share}"])


@pytest.mark.parametrize("more", [[], ["--same-road"]])
def test_two_effects_of_one_name(more: list[str], runs: list[str], tmp_path: Path) -> None:
    (tmp_path / "one.py").write_text(SHAKES, "utf-8")
    (tmp_path / "two.py").write_text(SHAKES, "utf-8")
    files = [f"--effect-file={tmp_path / name}" for name in ("one.py", "two.py")]
    with pytest.raises(BadInput, match=r"--effect-file .*two\.py: expected each effect once, found shakes again"):
        main(["diagnose", *more, "--vehicle", "rav4-2009", *runs, *files])


@pytest.mark.slow
def test_drives_over_two_roads_are_refused_where_no_profile_is_known(tmp_path: Path) -> None:
    runs = write_runs(tmp_path, [], lasts_s=14.0)  # each has a road of its own
    with pytest.raises(BadInput, match=r"run1 and .*run2: expected drives over the same road, found that neither "):
        main(["diagnose", "--same-road", "--vehicle", "rav4-2009", *runs])


def test_a_car_that_was_refitted_is_judged_by_what_was_given(
    runs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[float] = []

    def same_road(_runs: object, vehicle: Vehicle, _tolerance: object, stands: Vehicle,
                  **_places: object) -> None:
        asked.extend((vehicle.sprung_mass_kg, stands.sprung_mass_kg))
        raise ValueError("enough")

    monkeypatch.setattr("logger.api.lab.diagnose.SameRoad", same_road)
    car = Path(car_with(tmp_path, ""))
    car.write_text(car.read_text("utf-8") + "given: {sprung_mass_kg: 800}\n", "utf-8")
    with pytest.raises(BadInput, match="enough"):
        main(["diagnose", "--same-road", "--vehicle", str(car), *runs])
    assert asked == [800.0, 875.0]


@pytest.mark.parametrize("rate_hz", [1.0, 2.0, 4.0, 25.0, 48.0])
def test_a_record_too_slow_to_show_the_wheels(rate_hz: float, runs: list[str], tmp_path: Path) -> None:
    given = read_run(runs[0])
    place_s = np.arange(round(40 * rate_hz)) / rate_hz
    write_drive(tmp_path / "drive.csv", {
        "t_s": place_s, "accel_z_mps2": np.sin(40 * place_s), "speed_mps": np.full(len(place_s), 1.0),
        "distance_m": place_s})
    write_profile(tmp_path / "profile.csv", given.track)
    for command in COMMANDS:
        with pytest.raises(BadInput) as caught:
            main([*COMMANDS[command](tmp_path), "--vehicle", "rav4-2009", str(tmp_path)])
        assert str(caught.value).startswith(f"{tmp_path / 'drive.csv'}: expected 50 samples a second or more")
        assert f"found {rate_hz:g}" in str(caught.value)
    with pytest.raises(BadInput, match="expected 50 samples a second or more"):
        main(["diagnose", "--same-road", "--vehicle", "rav4-2009", str(tmp_path), runs[1]])


@pytest.mark.slow
@pytest.mark.parametrize("rate_hz", [49.8, 50.0])
def test_a_record_just_fast_enough(rate_hz: float, fits: None, runs: list[str], tmp_path: Path,
                                   capsys: pytest.CaptureFixture[str]) -> None:
    given = read_run(runs[0])
    thinned = {"accel_z_mps2": given.accel_z_mps2[::2], "speed_mps": given.speed_mps[::2],
               "distance_m": given.distance_m[::2]}
    write_drive(tmp_path / "drive.csv", {"t_s": np.arange(len(given.time_s[::2])) / rate_hz, **thinned})
    write_profile(tmp_path / "profile.csv", given.track)
    for more in ([], ["--out", str(tmp_path / "page.html")]):
        assert main(["compare", "--vehicle", "rav4-2009", str(tmp_path), "--json", *more]) == 0
        reported = capsys.readouterr()
        assert reported.err == "".join(f"Wrote {path}\n" for path in more[1:])
    assert json.loads(reported.out)["error"] < 1


@pytest.mark.slow
@pytest.mark.parametrize("command", ["compare", "diagnose", "add-effect"])
def test_a_disk_that_is_full_is_named(command: str, fits: None, runs: list[str], tmp_path: Path) -> None:
    done = called(*aimed(COMMANDS[command](tmp_path), Path("/dev/full")), "--vehicle", "rav4-2009", runs[0])
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "ridelog: /dev/full: No space left on device\n"


@pytest.mark.parametrize("command", ["compare", "diagnose", "add-effect"])
def test_where_nothing_can_be_written_it_is_said_first(command: str, runs: list[str]) -> None:
    arguments = [*COMMANDS[command](Path("/proc")), "--vehicle", "rav4-2009", *runs]
    with pytest.raises(BadInput, match=r"^--out /proc/.*: expected a file that may be written"):
        main(arguments)


def test_looking_whether_a_file_may_be_written_leaves_what_there_was(tmp_path: Path) -> None:
    there, new = tmp_path / "there.yaml", tmp_path / "new.yaml"
    there.write_text("mine", "utf-8")
    before = there.stat()
    check_out(there, [])
    check_out(new, [])
    assert there.read_text("utf-8") == "mine" and there.stat().st_mtime_ns == before.st_mtime_ns
    assert not new.exists()


PRINTS = OWN.replace("class Bracket", "print('HELLO from the file')\n\n\nclass Bracket").replace("EFFECT =", """\
    def vehicle(self, p, vehicle):
        print("HELLO while it runs")
        return super().vehicle(p, vehicle)


EFFECT =""")


@pytest.mark.slow
def test_what_an_own_effect_prints_is_no_json(fits: None, runs: list[str], tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(PRINTS, "utf-8")
    new = tmp_path / "new.yaml"
    car = car_with(tmp_path, "{name: long_bracket, file: own.py, offset_m: 0.1}")
    for arguments in (
        ["compare", "--vehicle", car, runs[0]],
        ["add-effect", str(tmp_path / "own.py"), "--vehicle", "rav4-2009", runs[0], "--out", str(new)],
        ["simulate", "--vehicle", car, "--profile", "30", "--speed", "10", "--out", str(tmp_path / "drive.csv")],
    ):
        done = called(*arguments, "--json")
        assert done.returncode == 0
        assert isinstance(json.loads(done.stdout), dict)
        assert "HELLO from the file" in done.stderr and "HELLO while it runs" in done.stderr


def test_an_own_effects_file_that_is_not_there(fits: None, runs: list[str], tmp_path: Path) -> None:
    car = car_with(tmp_path, "{name: long_bracket, file: own.py, offset_m: 0.1}")
    line = Path(car).read_text("utf-8").splitlines().index(
        "effects: [{name: long_bracket, file: own.py, offset_m: 0.1}]") + 1
    done = called("compare", "--vehicle", car, runs[0])
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (f"ridelog: {car}:{line}: {tmp_path / 'own.py'}: expected a readable file (No such file or "
                           "directory)\n")


@pytest.mark.slow
def test_a_centre_of_gravity_beyond_an_axle(fits: None, runs: list[str], tmp_path: Path) -> None:
    done = called("add-effect", "cg_shift:shift_m=0.9", "--vehicle", "ford-escort", runs[0], "--out",
                  tmp_path / "new.yaml")
    assert done.returncode == 2
    assert done.stderr == ("ridelog: cg_shift: expected the centre of gravity between the axles, found it 0.0161 m "
                           "beyond the front axle\n")


def rated(source: str, folder: Path, rate_hz: float, digits: int) -> str:
    """A run again, at another rate and with times of so many digits."""
    given = read_run(source)
    time_s = np.arange(int(given.time_s[-1] * rate_hz)) / rate_hz
    columns = {name: np.interp(time_s, given.time_s, getattr(given, name))
               for name in ("accel_z_mps2", "speed_mps", "distance_m")}
    folder.mkdir()
    write_drive(folder / "drive.csv", {"t_s": np.round(time_s, digits), **columns})
    write_profile(folder / "profile.csv", given.track)
    return str(folder)


def test_times_that_are_rounded_differently_are_of_one_rate(fits: None, runs: list[str], tmp_path: Path,
                                                            capsys: pytest.CaptureFixture[str]) -> None:
    folders = [rated(runs[0], tmp_path / "60", 60.0, 3), rated(runs[1], tmp_path / "again", 60.0, 3)]
    cut = (tmp_path / "again" / "drive.csv").read_text().splitlines()[:-61]
    (tmp_path / "again" / "drive.csv").write_text("\n".join(cut) + "\n")
    assert main(["compare", "--vehicle", "rav4-2009", *folders, "--json"]) == 0
    assert capsys.readouterr().err == ""


def test_fast_records_are_thinned_where_an_effect_is_sought(runs: list[str], tmp_path: Path) -> None:
    folders = [Path(rated(runs[0], tmp_path / f"{rate_hz:g}", rate_hz, 6)) for rate_hz in (100.0, 200.0, 400.0, 1000.0)]
    (usual,) = checked_runs([read_run(folders[0])]).runs
    for folder in folders:
        (thinned,) = checked_runs([read_run(folder)]).runs
        assert thinned.rate_hz == pytest.approx(100.0)
        count = min(len(thinned.measured_mps2), len(usual.measured_mps2)) - 50
        assert thinned.distance_m[:count] == pytest.approx(usual.distance_m[:count])
        off = (thinned.measured_mps2 - usual.measured_mps2[: len(thinned.measured_mps2)])[50:count]
        assert off.std() < 0.05 * usual.measured_mps2.std()
    with pytest.raises(BadInput, match=r"200/drive.csv: expected 100 samples a second, as in .*100, found 200"):
        checked_runs(list(map(read_run, folders)))
    (whole,) = checked_runs([read_run(folders[2])], thin=False).runs
    assert whole.count == len(read_run(folders[2]).time_s)
