"""``ridelog simulate``: the drive it writes is a run that can be read, and what it cannot do is one line."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

from logger.api.inputs import Run
from logger.api.inputs import run_on_road as read_run
from logger.commands.main import main
from logger.errors import BadInput
from logger.profiles.track import Track
from logger.roads import iso8608
from logger.roads.obstacles import speed_bump
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import write_profile
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded, respond
from logger.vehicle.effect import chosen
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import FINE_RATE_HZ, Passage
from logger.vehicle.structure import body_point

from ..support.command import called
from ..support.drives.linear_drive import drive

BUMP = "bump:start_m=20,height_m=0.08,width_m=3.6"
ROAD = Track(0.05, iso8608.generate(256, 100, 0.05, 3), 30.0)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_profile(tmp_path / "profile.csv", ROAD)
    return tmp_path


def simulated(folder: Path, *arguments: str, vehicle: str = "rav4-2009") -> Run:
    assert main(["simulate", "--vehicle", vehicle, "--profile", str(folder / "profile.csv"),
                 "--out", str(folder / "drive.csv"), *arguments]) == 0
    return read_run(folder)


def test_a_drive_at_one_speed_is_that_of_the_model(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulated(folder, "--speed", "20", "--json")
    made = json.loads(capsys.readouterr().out)
    assert run.time_s == pytest.approx(np.arange(len(run.time_s)) / 100)
    assert run.speed_mps == pytest.approx(20.0)
    assert run.distance_m == pytest.approx(30 + 20 * run.time_s)
    assert run.distance_m[-1] > 130 + 2.94 + 19
    car = structure_of(read_vehicle(vehicle_file("rav4-2009")))
    before_s = np.arange(-20, len(run.time_s)) / 100
    expected = drive(car, [body_point(car)], run.track, before_s, 30 + 20 * before_s)[20:, 0]
    assert run.accel_z_mps2 == pytest.approx(expected, abs=1e-8)
    assert made["samples"] == len(run.time_s)
    assert made["accel_rms_mps2"] == pytest.approx(np.sqrt(np.mean(run.accel_z_mps2**2)))
    assert (made["vehicle"], made["duration_s"]) == ("rav4-2009", pytest.approx(len(run.time_s) / 100))


def test_the_installed_command(folder: Path, ridelog: Path) -> None:
    done = subprocess.run(
        [ridelog, "simulate", "--vehicle", vehicle_file("rav4-2009"), "--profile", folder / "profile.csv", "--speed",
         "12", "--out", folder / "drive.csv"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, f"Wrote {folder / 'drive.csv'}\n")
    assert "rav4-2009 (half car)" in done.stdout
    failed = called("simulate", "--vehicle", "rav5", "--profile", "9", "--speed", "1", "--out", folder / "x.csv")
    assert failed.returncode == 2
    assert failed.stderr.startswith("ridelog: no vehicle 'rav5'")
    assert failed.stderr.count("\n") == 1
    assert not (folder / "x.csv").exists()


def test_a_speed_file_starts_stands_and_stops(folder: Path) -> None:
    speeds = folder / "speeds.csv"
    speeds.write_text("t_s,speed_mps\n0,0\n1,0\n5,12\n8,12\n10,0\n12,0\n")
    run = simulated(folder, "--speed", str(speeds))
    assert len(run.time_s) == 1201
    assert run.speed_mps[[0, 100, 300, 700, 900, 1200]] == pytest.approx([0, 0, 6, 12, 6, 0])
    assert run.distance_m[[100, 300, 500, 800, 1000, 1200]] == pytest.approx(30 + np.array([0, 6, 24, 60, 72, 72]))
    assert run.accel_z_mps2[:90] == pytest.approx(0, abs=1e-3)
    assert np.abs(run.accel_z_mps2[1150:]).max() < 0.1 * np.abs(run.accel_z_mps2).max()


def test_noise_and_steps_of_the_sensor(folder: Path) -> None:
    clean = simulated(folder, "--speed", "20").accel_z_mps2
    noisy = simulated(folder, "--speed", "20", "--noise", "0.1").accel_z_mps2
    other = simulated(folder, "--speed", "20", "--noise", "0.1", "--seed", "2").accel_z_mps2
    stepped = simulated(folder, "--speed", "20", "--step", "0.25").accel_z_mps2
    assert np.std(noisy - clean) == pytest.approx(0.1, rel=0.1)
    assert np.corrcoef(noisy - clean, other - clean)[0, 1] == pytest.approx(0, abs=0.2)
    assert np.array_equal(noisy, simulated(folder, "--speed", "20", "--noise", "0.1").accel_z_mps2)
    assert stepped / 0.25 == pytest.approx(np.round(stepped / 0.25))
    assert np.abs(stepped - clean).max() <= 0.125 + 1e-6


def test_an_obstacle_on_a_flat_road_and_the_road_as_driven(tmp_path: Path) -> None:
    arguments = ["simulate", "--vehicle", "rav4-2009", "--profile", "60", "--obstacle", BUMP, "--obstacle",
                 "pothole:start_m=40,depth_m=0.05,length_m=0.6,edge_m=0.1", "--speed", "5"]
    assert main([*arguments, "--out", str(tmp_path / "drive.csv"), "--out", str(tmp_path / "profile.csv")]) == 0
    run = read_run(tmp_path)
    x = 0.01 * np.arange(6001)
    assert run.track.spacing_m == pytest.approx(0.01)
    assert run.track.elevation_m[:3900] == pytest.approx(speed_bump(x, 20, 0.08, 3.6)[:3900], abs=1e-7)
    assert run.track.elevation_m.min() == pytest.approx(-0.05)
    assert run.accel_z_mps2[:395] == pytest.approx(0, abs=1e-3)
    assert np.abs(run.accel_z_mps2[400:700]).max() > 1


def test_an_obstacle_leaves_the_road_around_it_as_it_was(folder: Path) -> None:
    path = folder / "with" / "profile.csv"
    path.parent.mkdir()
    simulated(folder, "--speed", "9", "--obstacle", "step:start_m=100,height_m=1", "--out", str(path))
    distance, elevation = np.loadtxt(path, delimiter=",", skiprows=1).T
    x = 30 + 0.05 * np.arange(len(ROAD.elevation_m))
    assert elevation - (distance >= 100 - 1e-9) == pytest.approx(np.interp(distance, x, ROAD.elevation_m), abs=2e-7)


def test_other_points_as_further_columns(folder: Path) -> None:
    simulated(folder, "--speed", "20", "--output", "wheels", "--output", "travel", "--output", "tires", "--output",
              "body:ahead_m=1.47", "--output", "body:ahead_m=-0.5")
    names = (folder / "drive.csv").read_text().split("\n", 1)[0].split(",")
    assert names == ["t_s", "accel_z_mps2", "speed_mps", "distance_m", "wheel_front_mps2", "wheel_rear_mps2",
                     "travel_front_m", "travel_rear_m", "tire_front_m", "tire_rear_m", "body_1.47_0_mps2",
                     "body_-0.5_0_mps2"]
    table = dict(zip(names, np.loadtxt(folder / "drive.csv", delimiter=",", skiprows=1).T, strict=True))
    pitch = (table["body_1.47_0_mps2"] - table["accel_z_mps2"]) / 1.47
    assert table["body_-0.5_0_mps2"] == pytest.approx(table["accel_z_mps2"] - 0.5 * pitch, abs=1e-7)
    second_difference = np.diff(table["travel_front_m"], 2) * 1e4
    expected = (table["body_1.47_0_mps2"] - table["wheel_front_mps2"])[1:-1]
    assert np.corrcoef(second_difference, expected)[0, 1] > 0.9
    simulated(folder, "--speed", "20", "--output", "wheels", vehicle="rav4-2009-full")
    assert "wheel_front_left_mps2,wheel_front_right_mps2" in (folder / "drive.csv").read_text()


def test_a_slower_and_a_faster_recorder(folder: Path) -> None:
    slow = simulated(folder, "--speed", "10", "--rate", "50")
    fast = simulated(folder, "--speed", "10", "--rate", "2000")
    assert len(fast.time_s) == pytest.approx(40 * len(slow.time_s), abs=40)
    assert np.std(fast.accel_z_mps2) == pytest.approx(np.std(slow.accel_z_mps2), rel=0.05)


def refusal(folder: Path, *arguments: str, vehicle: str = "rav4-2009") -> str:
    with pytest.raises(BadInput) as refused:
        simulated(folder, *arguments, vehicle=vehicle)
    assert not (folder / "drive.csv").exists()
    return str(refused.value)


@pytest.mark.parametrize(("arguments", "complaint"), [
    (("--speed", "0"), "--speed 0: expected 0.1 to 100 m/s"),
    (("--speed", "nan"), "--speed nan: expected 0.1 to 100 m/s"),
    (("--speed", "20", "--rate", "1"), "--rate 1: expected 10 to 10000 Hz"),
    (("--speed", "20", "--noise", "-1"), "--noise -1: expected 0 to 100 m/s2"),
    (("--speed", "20", "--step", "inf"), "--step inf: expected 0 to 100 m/s2"),
    (("--speed", "20", "--seed", "-1"), "--seed -1: expected 0 or more"),
    (("--speed", "20", "--output", "wheel"), "--output wheel: expected one of wheels, travel, tires, displacement"),
    (("--speed", "20", "--output", "body:up_m=1"), "--output body:up_m=1: expected one of"),
    (("--speed", "20", "--output", "body:left_m=1"), "--output body:left_m=1: this body does not roll"),
    (("--speed", "20", "--output", "body:ahead_m=x"), "--output body:ahead_m=x: expected PARAM=NUMBER, found 'ahead"),
    (("--speed", "20", "--obstacle", "wall"), "--obstacle wall: expected one of bump, plate, pothole, ramp, step"),
    (("--speed", "20", "--obstacle", "step:start_m=1"), "--obstacle step:start_m=1: expected step:start_m=M,height_m"),
    (("--speed", "20", "--obstacle", "bump:start_m=40,height_m=1,width_m=0"), "--obstacle bump:start_m=40,height_m=1,"),
    (("--speed", "20", "--obstacle", "ramp:start_m=1,height_m=1,length_m=0"), "--obstacle ramp:start_m=1,height_m=1,"),
])
def test_wrong_use_is_one_line(folder: Path, arguments: tuple[str, ...], complaint: str) -> None:
    assert refusal(folder, *arguments).startswith(complaint)


@pytest.mark.parametrize(("obstacle", "complaint"), [
    ("bump:start_m=29,height_m=0.08,width_m=3.6", "expected it on the road, 30 to 130 m, found 29 to 32.6 m"),
    ("bump:start_m=128,height_m=0.08,width_m=3.6", "expected it on the road, 30 to 130 m, found 128 to 131.6 m"),
    ("step:start_m=1e300,height_m=0.1", "expected it on the road, 30 to 130 m, found 1e+300 to 1e+300 m"),
    ("step:start_m=30,height_m=0.1", "expected some road before it, from 30 m on"),
    ("step:start_m=60,height_m=1e300", "expected height_m within 10000 m, found 1e+300"),
    ("pothole:start_m=60,depth_m=-20000,length_m=1", "expected depth_m within 10000 m, found -20000"),
    ("bump:start_m=60,height_m=0.1,width_m=0.001", "expected it to be 0.02 m long or more, found 0.001 m"),
    ("plate:start_m=60,height_m=0.1,length_m=0.005", "expected it to be 0.02 m long or more, found 0.005 m"),
])
def test_an_obstacle_that_would_not_be_met_is_refused(folder: Path, obstacle: str, complaint: str) -> None:
    assert refusal(folder, "--speed", "20", "--obstacle", obstacle) == f"--obstacle {obstacle}: {complaint}"


def test_an_obstacle_may_reach_to_the_ends_of_the_road(tmp_path: Path) -> None:
    assert main(["simulate", "--vehicle", "golden-car", "--profile", "60", "--speed", "20",
                 "--obstacle", "bump:start_m=0,height_m=0.08,width_m=3.6",
                 "--obstacle", "bump:start_m=59.98,height_m=0.08,width_m=0.02",
                 "--out", str(tmp_path / "d.csv"), "--out", str(tmp_path / "profile.csv")]) == 0
    elevation = np.loadtxt(tmp_path / "profile.csv", delimiter=",", skiprows=1)[:, 1]
    assert elevation[[180, 5999]] == pytest.approx(0.08)


def test_files_that_will_not_do(folder: Path) -> None:
    speeds = folder / "speeds.csv"
    speeds.write_text("t_s,speed_mps\n0,1\n0,1\n")
    assert refusal(folder, "--speed", str(speeds)).startswith(f"{speeds}:3: expected a time after 0 s")
    speeds.write_text("t_s,speed_mps\n0,1\n9e4,1\n")
    assert refusal(folder, "--speed", str(speeds)).startswith("expected a drive of 0.01 to 5000 s, found 90000 s")
    for first, then, line in (("1e17", "1.0000000000000001e17", 2), ("0", "1e9", 3)):
        speeds.write_text(f"t_s,speed_mps\n{first},1\n{then},1\n")
        assert refusal(folder, "--speed", str(speeds)).startswith(f"{speeds}:{line}: expected t_s within 100000 s")
    speeds.write_text("t_s,speed_mps\n0,1\n0.001,1\n")
    assert refusal(folder, "--speed", str(speeds)).startswith("expected a drive of 0.01 to 5000 s, found 0.001 s")
    assert "expected a file other than the input" in refusal(
        folder, "--speed", "20", "--out", str(folder / "profile.csv"))
    (folder / "mine.yaml").write_bytes(vehicle_file("rav4-2009").read_bytes())
    assert "expected a file other than the input" in refusal(
        folder, "--speed", "20", "--out", str(folder / "mine.yaml"), vehicle=str(folder / "mine.yaml"))
    (folder / "profile.csv").write_text("distance_m,elevation_m\n0,0\n1,x\n")
    assert "profile.csv:3: expected a number" in refusal(folder, "--speed", "20")


# --- effects ---


def car_with(**effects: dict[str, float]):
    some = [chosen(shipped_effects()[name], values) for name, values in effects.items()]
    return compose(read_vehicle(vehicle_file("rav4-2009")), some)


def test_a_drive_of_a_car_with_effects(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = simulated(folder, "--speed", "20", "--effect", "dry_friction:friction_force_n=90", "--effect", "wheel_lift",
                    "--effect", "body_bending:participation=-0.3", "--json")
    made = json.loads(capsys.readouterr().out)
    assert made["effects"] == [
        {"effect": "dry_friction",
         "parameters": {"friction_force_n": 90.0, "transition_velocity_m_per_s": 0.0,
                        "static_to_sliding_ratio": 1.0, "stribeck_velocity_m_per_s": 0.05, "axle": 0.0}},
        {"effect": "wheel_lift", "parameters": {}},
        {"effect": "body_bending",
         "parameters": {"frequency_hz": 22.0, "damping_ratio": 0.04, "participation": -0.3, "ends_move": 0.0}},
    ]
    car = car_with(**{one["effect"]: one["parameters"] for one in made["effects"]})
    passage = Passage(run.track, 100.0, run.distance_m, 2 * FINE_RATE_HZ)  # dry friction needs it
    assert run.accel_z_mps2 == pytest.approx(recorded(car, passage), abs=1e-6)
    simulated(folder, "--speed", "20", "--effect", "wheel_lift")
    assert capsys.readouterr().out.endswith("\n  with wheel_lift\n")


def test_effects_of_the_vehicles_file_and_those_asked_for(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    yaml = vehicle_file("rav4-2009").read_text().replace(
        "effects: []", "effects: [{name: payload, mass_kg: 50}, {name: tire_damping, tire_damping_n_s_per_m: 99}]")
    (folder / "car.yaml").write_text(yaml)
    run = simulated(folder, "--speed", "20", "--json", "--effect", "payload:mass_kg=70",
                    vehicle=str(folder / "car.yaml"))
    made = json.loads(capsys.readouterr().out)
    assert {one["effect"]: one["parameters"] for one in made["effects"]} == {
        "payload": {"mass_kg": 70.0}, "tire_damping": {"tire_damping_n_s_per_m": 99.0}}
    car = car_with(payload={"mass_kg": 70.0}, tire_damping={"tire_damping_n_s_per_m": 99.0})
    assert run.accel_z_mps2 == pytest.approx(recorded(car, Passage(run.track, 100.0, run.distance_m)), abs=1e-6)


def test_a_wrong_speed_signal_is_written_and_the_true_speed_driven(folder: Path) -> None:
    true = simulated(folder, "--speed", "20", "--effect", "sensor_gain:gain=1")
    wrong = simulated(folder, "--speed", "20", "--effect", "speed_scale:scale=1.03")
    assert wrong.accel_z_mps2 == pytest.approx(true.accel_z_mps2, abs=1e-9)
    assert wrong.speed_mps == pytest.approx(20.6)
    assert wrong.distance_m == pytest.approx(1.03 * true.distance_m)
    assert true.speed_mps == pytest.approx(20)


def test_an_effect_that_does_nothing_leaves_the_drive_as_it_was(folder: Path) -> None:
    plain = simulated(folder, "--speed", "20")
    same = simulated(folder, "--speed", "20", "--effect", "dry_friction:friction_force_n=0")
    assert same.accel_z_mps2 == pytest.approx(plain.accel_z_mps2, abs=2e-3 * np.std(plain.accel_z_mps2))
    assert np.array_equal(same.distance_m, plain.distance_m)


def columns(folder: Path) -> dict[str, np.ndarray]:
    names = (folder / "drive.csv").read_text().split("\n", 1)[0].split(",")
    return dict(zip(names, np.loadtxt(folder / "drive.csv", delimiter=",", skiprows=1).T, strict=True))


def test_further_columns_of_a_car_with_effects(folder: Path) -> None:
    outputs = ("--output", "wheels", "--output", "travel", "--output", "tires", "--output", "body:ahead_m=1.47")
    simulated(folder, "--speed", "20", *outputs)
    plain = columns(folder)
    simulated(folder, "--speed", "20", *outputs, "--effect", "bump_stop:clearance_m=0.3")
    for name, column in columns(folder).items():
        assert column == pytest.approx(plain[name], abs=3e-3 * np.abs(plain[name]).max()), name
    run = simulated(folder, "--speed", "20", *outputs, "--effect", "progressive_spring:cubic_stiffness_n_per_m3=3e7",
                    "--effect", "sensor_gain:gain=1.1")
    found = columns(folder)
    did = respond(car_with(progressive_spring={"cubic_stiffness_n_per_m3": 3e7}),
                  Passage(run.track, 100.0, run.distance_m))
    assert found["accel_z_mps2"] == pytest.approx(1.1 * did.accel_z_mps2, abs=1e-6)
    assert found["travel_rear_m"] == pytest.approx(did.travel_m[:, 1], abs=0.01 * np.abs(did.travel_m).max())
    assert np.corrcoef(found["tire_front_m"], did.deflection_m[:, 0])[0, 1] > 0.98


def test_a_half_car_that_rolls_has_four_wheels(folder: Path) -> None:
    left, right = (iso8608.generate(256, 60, 0.05, seed) for seed in (3, 4))
    write_profile(folder / "profile.csv", Track(0.05, np.stack([left, right], axis=1)))
    simulated(folder, "--speed", "20", "--effect", "roll", "--output", "tires")
    found = columns(folder)
    assert np.std(found["tire_front_left_m"] - found["tire_front_right_m"]) > 1e-4


def test_an_effect_of_ones_own(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As docs/own-effect.md has it, on the command line and in the vehicle's file."""
    page = (Path(__file__).parents[2] / "docs" / "own-effect.md").read_text("utf-8")
    (folder / "my_orifice.py").write_text(page.split("```python\n")[1].split("```")[0])
    monkeypatch.chdir(folder)
    command = page.split("    ridelog simulate ")[1].split("drive.csv")[0].replace("\\\n", " ").split()
    assert main(["simulate", *command, "asked.csv"]) == 0
    yaml = vehicle_file("rav4-2009").read_text().replace("effects: []", page.split("```yaml\n")[1].split("```")[0])
    (folder / "car.yaml").write_text(yaml)
    own = command.index("--effect")
    in_file = ["--vehicle", "./car.yaml", *command[2:own], *command[own + 2 :]]
    assert main(["simulate", *in_file, "of_file.csv"]) == 0
    assert (folder / "asked.csv").read_bytes() == (folder / "of_file.csv").read_bytes()
    without = [*command[:own], *command[own + 2 :]]
    assert main(["simulate", *without, "without.csv"]) == 0
    assert (folder / "asked.csv").read_bytes() != (folder / "without.csv").read_bytes()


@pytest.mark.parametrize(("effect", "complaint"), [
    ("friction", "no effect 'friction': expected one of air_spring, body_bending, bump_stop"),
    ("dry_friction:force=3", "--effect dry_friction:force=3: dry_friction has no parameter 'force'; expected friction"),
    ("dry_friction:friction_force_n=-3", "--effect dry_friction:friction_force_n=-3: dry_friction: expected friction_"),
    ("dry_friction:friction_force_n", "--effect dry_friction:friction_force_n: expected PARAM=NUMBER, found 'friction"),
    ("roll", "--effect roll: roll: the profile has one track; it needs elevation_right_m"),
    ("mine.py:x=3", "mine.py: expected a readable file (No such file or directory)"),
])
def test_effects_that_will_not_do(folder: Path, effect: str, complaint: str) -> None:
    assert refusal(folder, "--speed", "20", "--effect", effect).startswith(complaint)


@pytest.mark.parametrize(("effect", "words"), [
    ("{name: roll, track_width_m: 1.5, roll_inertia_kg_m2: 500}", "car.yaml: roll: the profile has one track"),
    ("{name: shakes, file: shakes.py}", "rav4-2009: with its effects the model is unstable"),
])
def test_effects_of_the_vehicles_file_that_will_not_do(folder: Path, effect: str, words: str) -> None:
    (folder / "shakes.py").write_text(
        "from dataclasses import replace\nfrom logger.vehicle.effect import BodyEffect\n\nclass Shakes(BodyEffect):\n"
        "    name = title = source = signature = shown_by = 'shakes'\n    def structure(self, p, structure):\n"
        "        return replace(structure, damping=-9 * structure.damping)\nEFFECT = Shakes()\n")
    car = folder / "car.yaml"
    car.write_text(vehicle_file("rav4-2009").read_text().replace("effects: []", f"effects: [{effect}]"))
    with pytest.raises(BadInput, match=words):
        simulated(folder, "--speed", "20", vehicle=str(car))
    assert not (folder / "drive.csv").exists()


def test_where_nothing_can_be_written(folder: Path) -> None:
    for place in (folder / "none" / "drive.csv", folder):
        assert re.match("--out .*in a folder that exists", refusal(folder, "--speed", "20", "--out", str(place)))


def test_an_effect_twice_is_refused(folder: Path) -> None:
    assert refusal(folder, "--speed", "20", "--effect", "wheel_lift", "--effect", "wheel_lift") == (
        "--effect wheel_lift: expected each effect once")


def test_what_a_step_of_a_thousandth_cannot_follow_is_refused(folder: Path) -> None:
    (folder / "car.yaml").write_text(
        "name: feather\nmodel: quarter_car\nsprung_mass_kg: 5\ncontact_patch_m: 0.25\nfront: {unsprung_mass_kg: 0.02, "
        "suspension_stiffness_n_per_m: 300, suspension_damping_n_s_per_m: 30, tire_stiffness_n_per_m: 3000}\n")
    with pytest.raises(BadInput, match="feather: its effects are too strong for its masses"):
        simulated(folder, "--speed", "20", "--effect", "tire_damping:tire_damping_n_s_per_m=3000",
                  vehicle=str(folder / "car.yaml"))


def test_what_a_drive_needs_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(BadInput, match=r"simulate: expected --profile, --speed$"):
        main(["simulate", "--vehicle", "rav4-2009", "--out", str(tmp_path / "drive.csv")])
    with pytest.raises(BadInput, match=r"--profile 0.5: expected 1 to 10000 m"):
        main(["simulate", "--vehicle", "rav4-2009", "--profile", "0.5", "--speed", "3", "--out", str(tmp_path / "a")])


def test_a_road_that_seems_to_be_in_another_unit_is_doubted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    road, at_m = tmp_path / "road.csv", 0.25 * np.arange(1200)
    for scale, words in ((1.0, ""), (100.0, "Elevation in cm?")):
        write_profile(road, Track(0.25, scale * 0.0005 * np.sin(at_m / 0.4)))
        main(["simulate", "--vehicle", "rav4-2009", "--profile", str(road), "--speed", "10", "--json",
              "--out", str(tmp_path / "drive.csv")])
        said = capsys.readouterr()
        assert json.loads(said.out)["samples"] > 0
        assert (f"{road}: {words}" in said.err) == bool(words), said.err
