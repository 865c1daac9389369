"""Cases: reproducible, written as the contract says, every effect doing something, the answer true."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from logger.store.formats.effect_file import shipped_effects

from .cases import random_case as cases
from .cases.case_files import write_case
from .cases.random_case import Hidden, case, draw_car, mistaken, with_effects, without
from .simulator.effects import EFFECTS
from .simulator.newcomers import NEWCOMERS
from .simulator.outsiders import OUTSIDERS
from .simulator.roads import random_road
from .simulator.scene import Drive, Scene, clean_acceleration, measured

pytestmark = pytest.mark.slow  # the examination's own car is tried before an examination

RNG = np.random.default_rng
ALL = EFFECTS | OUTSIDERS | NEWCOMERS


@pytest.fixture(autouse=True)
def short_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two runs of 8 s instead of up to four of 60."""
    drawn = cases.draw_drives
    monkeypatch.setattr(cases, "draw_drives", lambda rng, rough: tuple(
        replace(drive, duration_s=8.0) for drive in drawn(rng, rough)[:2]))


def rough_scene(seed: int) -> Scene:
    rng = RNG(seed)
    road = random_road(rng, 210.0, 0.1, "D", features=False)
    return Scene(draw_car(rng, "half_car"), (Drive(road, 10.0, 20.0, -3.0),))


def test_the_list_is_the_contract_and_the_outsiders_are_not_on_it() -> None:
    assert len(EFFECTS) == 20
    assert len(ALL) == len(EFFECTS) + len(OUTSIDERS) + len(NEWCOMERS)
    assert not (OUTSIDERS | NEWCOMERS).keys() & shipped_effects().keys(), "what ridelog ships is no outsider any more"
    assert all(near in EFFECTS for outsider in (OUTSIDERS | NEWCOMERS).values() for near in outsider.akin)


# These begin where the errors of a speed signal itself end, and that is no longer faint.
BEYOND_A_SPEED_SIGNAL = ("speed_scale", "time_offset")


@pytest.mark.parametrize("name", ALL)
def test_every_effect_is_faint_at_one_end_and_plain_at_the_other(name: str) -> None:
    scene, effect = rough_scene(4), ALL[name]
    path = effect.path(RNG(8), scene.car)

    def change(u: float) -> float:
        staged, hidden = effect.stage(scene, u), (Hidden(effect, path(u), 1.0),)
        both = with_effects(staged, hidden), without(staged, hidden, 0)
        with_it, bare = (measured(one, 1 / 1000)[0] for one in both)
        return float(np.std((with_it - bare)[200:]) / np.std(bare))

    faint, plain = change(0.0), change(1.0)
    if name in BEYOND_A_SPEED_SIGNAL:
        assert plain > faint > 0.07
        return
    assert faint < 0.12
    assert plain > max(0.07, 4 * faint)


def test_the_recorded_way_of_a_wrong_speedometer_leads_back_to_the_true_one() -> None:
    scene = replace(rough_scene(6), speed_scale=1.03)
    drive = scene.drives[0]
    t = drive.times_s
    believed = drive.distance_m(t) / 1.03, drive.speed_at_mps(t) / 1.03
    plain = clean_acceleration(replace(scene, speed_scale=1.0), drive, recorded=believed)
    assert clean_acceleration(scene, drive)[:900] == pytest.approx(plain[:900], abs=1e-3)


@pytest.mark.parametrize("name", ["bump_stop", "dry_friction", "wheel_lift", "top_mount_compliance", "damper_blow_off"])
def test_steps_are_fine_enough_for_the_sharpest_laws(name: str) -> None:
    scene, effect = rough_scene(9), EFFECTS[name]
    full = with_effects(scene, [Hidden(effect, effect.path(RNG(3), scene.car)(0.7), 1.0)])
    coarse, fine = measured(full)[0], measured(full, 1 / 16_000)[0]
    assert np.std(coarse - fine) < 2e-3 * np.std(fine)


def test_cars_lie_where_they_should_and_data_sheets_are_off_a_little() -> None:
    rng = RNG(0)
    lengths = []
    for _ in range(300):
        car = draw_car(rng, "half_car")
        assert 400 <= car.sprung_mass_kg <= 1200
        for axle, other in ((car.front, car.rear), (car.rear, car.front)):
            k, c, tire = (axle.suspension_stiffness_n_per_m, axle.suspension_damping_n_s_per_m,
                          axle.tire_stiffness_n_per_m)
            mass = car.sprung_mass_kg * other.cg_distance_m / car.wheelbase_m
            assert 0.899 <= np.sqrt(k * tire / (k + tire) / mass) / 2 / np.pi <= 1.701
            assert 8.999 <= np.sqrt((k + tire) / axle.unsprung_mass_kg) / 2 / np.pi <= 14.001
            assert 0.149 <= c / 2 / np.sqrt(k * mass) <= 0.401
            assert tire > 4.4 * k
            assert 1.0 <= axle.cg_distance_m <= 1.8
        sheet = mistaken(rng, car)
        assert 0 < abs(sheet.sprung_mass_kg / car.sprung_mass_kg - 1) < 0.0401
        lengths.append(abs(sheet.wheelbase_m / car.wheelbase_m - 1))
    assert 0.02 < max(lengths) < 0.0401
    assert np.mean(np.array(lengths) < 0.0051) > 0.33


def test_the_same_seed_makes_the_same_case_and_another_another() -> None:
    one, same, other = case("one", 5, "occupant"), case("one", 5, "occupant"), case("one", 25, "occupant")
    assert np.array_equal(one.recordings[0].accel_z_mps2, same.recordings[0].accel_z_mps2)
    assert one.hidden[0].parameters == same.hidden[0].parameters
    assert one.scene.car != other.scene.car


def test_strengths_are_those_that_were_asked_for() -> None:
    for seed, name in ((1, "payload"), (4, "sensor_gain"), (3, "dry_friction")):
        found = case("one", seed, name).hidden[0]
        assert found.strength == pytest.approx(found.wanted, rel=0.15)
    assert all(each.strength > 1.7 for each in case("two", 3).hidden)


@pytest.mark.parametrize(("kind", "effect"), [("one", "roll"), ("none", None), ("two_outsider", "payload")])
def test_files_are_the_contract_and_hide_the_answer(kind: str, effect: str | None, tmp_path: Path) -> None:
    made = case(kind, 2, effect)
    truth = json.loads(json.dumps(write_case(made, tmp_path)))
    sheet = yaml.safe_load((tmp_path / "vehicle.yaml").read_text("utf-8"))
    assert sheet["effects"] == []
    assert sheet["model"] in {"half_car", "quarter_car"}
    assert ("rear" in sheet) == (sheet["model"] == "half_car")
    files = {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()}
    runs = [f"run{i + 1}" for i in range(len(made.recordings))]
    assert files == {"vehicle.yaml"} | {f"{run}/{name}" for run in runs for name in ("drive.csv", "profile.csv")}
    assert len(truth["effects"]) + len(truth["outsiders"]) == {"one": 1, "none": 0, "two_outsider": 2}[kind]
    for run, recording in zip(runs, made.recordings, strict=True):
        drive = (tmp_path / run / "drive.csv").read_text("utf-8")
        assert drive.startswith("t_s,accel_z_mps2,speed_mps,distance_m\n")
        rows = np.loadtxt(drive.splitlines(), delimiter=",", skiprows=1)
        assert np.diff(rows[:, 0]) == pytest.approx(0.01)
        assert rows[:, 1] == pytest.approx(recording.accel_z_mps2, abs=6e-5)
        # The distance is the integral of the recorded speed, and wrong by little.
        assert np.diff(rows[:, 3]) == pytest.approx(0.01 * rows[:-1, 2], abs=3e-3)
        header = (tmp_path / run / "profile.csv").read_text("utf-8").split("\n", 1)[0]
        assert header.startswith("distance_m,elevation_m")
        assert effect != "roll" or header.endswith("elevation_right_m")


def test_a_distance_wanders_as_far_as_its_wrong_speed_takes_it() -> None:
    far_m, near_m = [], []
    for seed in range(12):
        made = case("wandering", 19 * seed)
        assert not made.hidden
        for drive, run in zip(made.scene.drives, made.recordings, strict=True):
            off_mps = run.speed_mps - drive.speed_at_mps(run.t_s)
            assert np.diff(run.distance_m) == pytest.approx(0.01 * run.speed_mps[:-1], abs=1e-4)
            assert np.std(off_mps) < 1.8 * cases.WRONG_MPS[1]
            far_m.append(np.std(run.distance_m - drive.distance_m(run.t_s)))
        plain = case("none", seed)
        near_m += [np.std(run.distance_m - drive.distance_m(run.t_s))
                   for drive, run in zip(plain.scene.drives, plain.recordings, strict=True)]
    assert max(near_m) < 0.01 < 0.03 < np.median(far_m)
    names = {each.effect.name for seed in range(1, 19) for each in case("wandering", seed).hidden}
    assert names == set(EFFECTS) - set(cases.OF_THE_DISTANCE)


def test_with_nothing_hidden_only_noise_is_left() -> None:
    made = case("none", 11)
    left = np.concatenate([(run.accel_z_mps2 - run.clean_mps2)[200:] for run in made.recordings])
    size = np.concatenate([run.accel_z_mps2[200:] for run in made.recordings])
    floor = np.sqrt(np.mean(left**2) / np.mean(size**2))
    assert made.error["noise_floor_error"] == pytest.approx(floor)
    assert made.error["error_without_effects"] == pytest.approx(floor, rel=0.02)
    assert 0.97 * floor < made.error["attainable_error"] < 3 * floor
    assert np.std(left) == pytest.approx(np.hypot(made.noise.white_mps2, made.noise.step_mps2 / np.sqrt(12)), rel=0.1)
