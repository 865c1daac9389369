"""Vehicle files: what is read, and what is said about files that cannot be."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.errors import BadInput
from logger.files import SETTINGS_BYTES
from logger.printable import word
from logger.shipped import vehicle_file, vehicle_names
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import CarModel, ModelStep, read_model, read_on_board, read_vehicle, write_model
from logger.store.formats.yaml_nodes import parse_mapping
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.models import MODELS, structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.named_parameters import changed
from logger.vehicle.vehicle import Axle, SensorPlace, Vehicle

TEXT = vehicle_file("rav4-2009").read_text("utf-8")
QUARTER = """\
name: one-wheel
model: quarter_car
sprung_mass_kg: 300
front:
  unsprung_mass_kg: 40
  suspension_stiffness_n_per_m: 20000
  suspension_damping_n_s_per_m: 1500
  tire_stiffness_n_per_m: 1.8e5
contact_patch_m: 0.25
"""
FULL = (
    TEXT.replace("half_car", "full_car").replace("1100", "2200\nroll_inertia_kg_m2: 550\ntrack_width_m: 1.56")
    .replace("front:", "front:\n  anti_roll_stiffness_n_m_per_rad: 9000") + "sensor: {ahead_m: -0.4, left_m: 0.35}\n"
)


def line_of(text: str, start: str) -> int:
    return next(number for number, line in enumerate(text.splitlines(), 1) if line.startswith(start))


def complaint(tmp_path: Path, text: str) -> str:
    path = tmp_path / "car.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(BadInput) as caught:
        read_vehicle(path)
    message = str(caught.value)
    assert message.startswith(f"{path}:")
    return message.removeprefix(f"{path}:")


def test_the_rav4_is_that_of_table_4_2() -> None:
    axle = Axle(1.47, 55.0, 23088.0, 1776.0, 238180.0)
    assert read_vehicle(vehicle_file("rav4-2009")) == Vehicle("rav4-2009", "half_car", 875.0, 1100.0, axle, axle, 0.25)


def test_a_quarter_car_stands_on_its_front_axle(tmp_path: Path) -> None:
    (tmp_path / "q.yaml").write_text(QUARTER)
    car = read_vehicle(tmp_path / "q.yaml")
    assert car == Vehicle("one-wheel", "quarter_car", 300.0, None, Axle(0.0, 40.0, 20000.0, 1500.0, 1.8e5), None, 0.25)


def test_a_full_car_has_a_roll_inertia_a_track_width_and_perhaps_anti_roll_bars(tmp_path: Path) -> None:
    (tmp_path / "f.yaml").write_text(FULL)
    front, rear = (Axle(1.47, 55.0, 23088.0, 1776.0, 238180.0, bar) for bar in (9000.0, 0.0))
    assert read_vehicle(tmp_path / "f.yaml") == Vehicle(
        "rav4-2009", "full_car", 875.0, 2200.0, front, rear, 0.25, 550.0, 1.56, SensorPlace(-0.4, 0.35),
    )


def test_what_the_other_models_do_not_know_is_refused(tmp_path: Path) -> None:
    for key in ("roll_inertia_kg_m2", "track_width_m"):
        text = "".join(line for line in FULL.splitlines(True) if not line.startswith(key))
        assert complaint(tmp_path, text) == f"1: expected the key '{key}' here, it is missing"
    half = TEXT.replace("front:", "front:\n  anti_roll_stiffness_n_m_per_rad: 9000")
    assert "expected one of the keys" in complaint(tmp_path, half)
    bar = FULL.replace("9000", "-9000")
    assert complaint(tmp_path, bar) == (
        f"{line_of(bar, '  anti_roll')}: expected a number of at least 0, found '-9000' for "
        "'anti_roll_stiffness_n_m_per_rad'"
    )
    quarter = QUARTER + "sensor:\n  left_m: 0\n  ahead_m: 0.2\n"
    assert complaint(tmp_path, quarter) == (
        "12: expected 0, because a quarter_car does not pitch, found '0.2' for 'ahead_m'")


def test_a_sensor_at_the_centre_of_gravity_may_be_written_out(tmp_path: Path) -> None:
    (tmp_path / "q.yaml").write_text(QUARTER + "sensor: {ahead_m: 0, left_m: 0}\n")
    assert read_vehicle(tmp_path / "q.yaml").sensor == SensorPlace(0.0, 0.0)


per_kg = st.floats(0.01, 5)


@st.composite
def axles(draw: st.DrawFn, mass_kg: float) -> Axle:
    each = [draw(per_kg) * mass_kg * factor for factor in (0.1, 100, draw(st.sampled_from([0, 1])), 1000)]
    return Axle(0.0, *each)


names = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Zl", "Zp", "Mn")), min_size=1, max_size=80
                ).filter(lambda text: word(text) == text)
places = st.builds(SensorPlace, st.floats(-10, 10), st.floats(-10, 10))


@st.composite
def cars(draw: st.DrawFn) -> Vehicle:
    mass_kg = draw(st.floats(1, 1e5))
    pitch, roll = draw(per_kg) * mass_kg, draw(per_kg) * mass_kg
    return Vehicle(draw(names), draw(st.sampled_from(list(MODELS))), mass_kg, pitch, draw(axles(mass_kg)),
                   draw(axles(mass_kg)), draw(st.floats(0, 1)), roll, draw(st.floats(0.2, 5)), draw(places))


def as_its_model_knows_it(car: Vehicle) -> Vehicle:
    """Leave out what a quarter or a half car cannot have, and give the axles what only the others have."""
    if car.model in ("single_mass", "component"):
        front = replace(car.front, unsprung_mass_kg=0.0, tire_stiffness_n_per_m=0.0)
        return replace(car, front=front, pitch_inertia_kg_m2=None, rear=None, roll_inertia_kg_m2=None,
                       track_width_m=None, contact_patch_m=0.0, sensor=SensorPlace())
    if car.model == "quarter_car":
        return replace(car, pitch_inertia_kg_m2=None, rear=None, roll_inertia_kg_m2=None, track_width_m=None,
                       sensor=SensorPlace())
    assert car.rear is not None
    car = replace(car, front=replace(car.front, cg_distance_m=1.1), rear=replace(car.rear, cg_distance_m=1 / 3))
    if car.model == "half_car":
        return replace(car, roll_inertia_kg_m2=None, track_width_m=None, sensor=replace(car.sensor, left_m=0.0))
    return replace(car, front=replace(car.front, anti_roll_stiffness_n_m_per_rad=car.sprung_mass_kg / 7))


@given(cars())
@settings(max_examples=60)
def test_a_written_vehicle_is_read_back_to_the_last_bit(tmp_path_factory: pytest.TempPathFactory, car: Vehicle) -> None:
    path = tmp_path_factory.getbasetemp() / "written.yaml"
    car = as_its_model_knows_it(car)
    write_model(path, CarModel(car))
    assert read_vehicle(path) == car


def test_a_written_vehicle_looks_like_those_that_people_write(tmp_path: Path) -> None:
    path = tmp_path / "rav4.yaml"
    write_model(path, CarModel(read_vehicle(vehicle_file("rav4-2009"))))
    by_hand = [line.split("#")[0].rstrip() for line in TEXT.splitlines()]
    assert path.read_text("utf-8").splitlines() == [line for line in by_hand if line]
    fitted = replace(read_vehicle(path), sprung_mass_kg=np.float64(881.25))
    write_model(path, CarModel(fitted))
    assert "\nsprung_mass_kg: 881.25\n" in path.read_text("utf-8")


@pytest.mark.parametrize("name", vehicle_names())
def test_a_shipped_vehicle_names_itself_its_sources_and_its_frequencies(name: str) -> None:
    path = vehicle_file(name)
    car = read_vehicle(path)
    assert car.name == name
    lines = path.read_text("utf-8").splitlines()
    stated = next(line for line in lines if line.startswith("# Undamped frequencies [Hz]: "))
    computed = undamped_frequencies_hz(structure_of(car))
    assert stated.split(": ")[1].split() == [f"{frequency:.2f}" for frequency in computed]
    if "Source of every value not marked otherwise" not in path.read_text("utf-8"):
        bare = [line for line in lines if re.search(r": [0-9]", line) and not line.startswith("#") and "#" not in line]
        assert not bare


@pytest.mark.parametrize(("old", "new", "at", "words"), [
    ("sprung_mass_kg: 875", "sprung_mass_kg: heavy", "sprung_mass_kg", "a number from 1 to 100000, found 'heavy'"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: '875'", "sprung_mass_kg", "expected a number"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: -1", "sprung_mass_kg", "from 1 to 100000"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: .nan", "sprung_mass_kg", "expected a number"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: 1e999", "sprung_mass_kg", "expected a number"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: [875]", "sprung_mass_kg", "found a list"),
    ("sprung_mass_kg: 875", "sprung_mas_kg: 875", "sprung_mas_kg", "expected one of the keys"),
    ("sprung_mass_kg: 875", "name: again", "name: again", "each key once"),
    ("model: half_car", "model: tank", "model", "expected one of single_mass, component, quarter_car, half_car, full"),
    ("model: half_car", "model: {a: 1}", "model", "found a mapping"),
    ("contact_patch_m: 0.25", "contact_patch_m: 25", "contact_patch_m", "from 0 to 1"),
    ("effects: []", "track_width_m: 1.5", "track_width_m", "expected one of the keys"),
    ("effects: []", "sensor: {left_m: 0.1}", "sensor", "expected 0, because a half_car does not roll, found '0.1'"),
    ("effects: []", "sensor: {ahead_m: 300}", "sensor", "from -10 to 10"),
    ("effects: []", "sensor: {ahead_mm: 3}", "sensor", "expected one of the keys ahead_m, left_m"),
    ("effects: []", "sensor: 0.3", "sensor", "expected a mapping"),
    ("effects: []", "effects: [{name: roll}]", "effects", "expected no effects, as this takes only a car without them"),
    ("effects: []", "effects: ", "effects", "expected a list, found nothing"),
    ("name: rav4-2009", "name: !!python/name:os.system x", "name", "plain value"),
])
def test_complaints_name_the_line(tmp_path: Path, old: str, new: str, at: str, words: str) -> None:
    text = TEXT.replace(old, new)
    assert text != TEXT
    message = complaint(tmp_path, text)
    assert message.startswith(f"{line_of(text, at)}: expected")
    assert words in message


WRONG_UNITS = {
    "sprung_mass_kg": (1e3, 1e-3), "pitch_inertia_kg_m2": (1e3, 1e-3, 1e6), "roll_inertia_kg_m2": (1e3, 1e-3, 1e6),
    "track_width_m": (1e3, 1e2), "cg_distance_m": (1e3, 1e2), "unsprung_mass_kg": (1e3, 1e-3),
    "suspension_stiffness_n_per_m": (1e-3,), "suspension_damping_n_s_per_m": (1e-3,), "tire_stiffness_n_per_m": (1e-3,),
    "contact_patch_m": (1e3, 1e2),
}


@pytest.mark.parametrize("name", vehicle_names())
def test_other_units_are_distinguished_from_those_of_the_format(tmp_path: Path, name: str) -> None:
    """Every number of every car that comes with ridelog, in g, t, mm, cm, kN/m, kN s/m."""
    lines = vehicle_file(name).read_text("utf-8").splitlines()
    tried = 0
    for number, line in enumerate(lines[:lines.index("effects: []")], 1):  # its standard errors may be of any size
        key, _, value = line.split("#")[0].partition(":")
        for factor in WRONG_UNITS.get(key.strip(), ()):
            changed = [*lines[: number - 1], f"{key}: {float(value) * factor:.6g}", *lines[number:]]
            message = complaint(tmp_path, "\n".join(changed))
            if key == "sprung_mass_kg" and factor < 1:  # 1.75 t are 1.75 kg, with the springs of a car
                assert "kg on the springs" in message or message.startswith(f"{number}: ")
            else:
                assert message.startswith(f"{number}: expected a number from ")
            tried += 1
    assert tried >= 9


def test_the_golden_car_for_one_kilogram_is_a_car(tmp_path: Path) -> None:
    axle = Axle(0.0, 0.15, 63.3, 6.0, 653.0)
    write_model(tmp_path / "g.yaml", CarModel(Vehicle("golden", "quarter_car", 1.0, None, axle, None, 0.25)))
    assert read_vehicle(tmp_path / "g.yaml").front == axle


@pytest.mark.parametrize(("key", "values"), [
    ("sprung_mass_kg", ("1e308", "1e-300", "0")), ("cg_distance_m", ("1e6",)),
    ("suspension_stiffness_n_per_m", ("1e300", "0")), ("suspension_damping_n_s_per_m", ("-1", "1e-9")),
])
def test_numbers_that_no_car_has(tmp_path: Path, key: str, values: tuple[str, ...]) -> None:
    for value in values:
        text = re.sub(rf"{key}: [0-9.]+", f"{key}: {value}", TEXT, count=1)
        message = complaint(tmp_path, text)
        at = next(number for number, line in enumerate(text.splitlines(), 1) if key in line)
        assert message.startswith(f"{at}: expected a number ")
        assert message.endswith(f"found '{value}' for '{key}'")


def test_both_axles_at_the_centre_of_gravity_are_no_car(tmp_path: Path) -> None:
    text = TEXT.replace("cg_distance_m: 1.47", "cg_distance_m: 0")
    at = max(number for number, line in enumerate(text.splitlines(), 1) if "cg_distance_m" in line)
    assert complaint(tmp_path, text) == f"{at}: expected axles at least 0.01 m apart, found '0' for 'cg_distance_m'"


def test_missing_keys_are_named_with_the_place_they_belong(tmp_path: Path) -> None:
    assert complaint(tmp_path, "name: x\n") == "1: expected the key 'model' here, it is missing"
    without = "".join(line for line in TEXT.splitlines(True) if not line.startswith("pitch_inertia"))
    assert "expected the key 'pitch_inertia_kg_m2'" in complaint(tmp_path, without)
    head, rear = TEXT.split("rear:")
    without = head + "rear:" + "".join(line for line in rear.splitlines(True) if "tire_stiffness" not in line)
    assert complaint(tmp_path, without) == (
        f"{line_of(TEXT, 'rear:')}: expected the key 'tire_stiffness_n_per_m' here, it is missing"
    )
    assert "rear" in complaint(tmp_path, QUARTER + "rear: {}\n")


@pytest.mark.parametrize(("text", "words"), [
    ("", "1: expected a mapping (key: value lines), found nothing"),
    ("- 1\n", "1: expected a mapping (key: value lines), found a list"),
    ("a: &x 1\nb: *x\n", "2: expected values written out, found the alias *x"),
    ("a: [1\n", "2: expected YAML"),
    ("ok: 1\n\tbad: 2\n", "2: expected YAML"),
    ("a: 1\nb: \x07\n", "2: expected text without control characters"),
    ('a: 1\nb: "\\UFFFFFFFF"\n', "2: expected YAML"),
    ('a: 1\nb: "\\ud800"\n', "2: expected text that can be written"),
    ('a: "\\0"\n', "1: expected text that can be written"),
    ("a: !!int ''\n", "1: expected a plain value, found the tag 'tag:yaml.org,2002:int'"),
    ("a: 1\nb: !<x%0Ay> 1\n", r"2: expected a plain value, found the tag 'x\ny'"),
    ("a: " + "[" * 5000, "1: expected at most 12 levels"),
    ("? [1]\n: 2\n", "1: expected a word as key"),
    ("a: 1\n---\nb: 2\n", "2: expected YAML"),
])
def test_what_is_no_mapping_in_yaml(tmp_path: Path, text: str, words: str) -> None:
    assert complaint(tmp_path, text).startswith(words)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    path = tmp_path / "car.yaml"
    with pytest.raises(BadInput, match="expected a readable file"):
        read_vehicle(path)
    with pytest.raises(BadInput, match="expected a readable file"):
        read_vehicle(tmp_path)
    path.write_bytes(b"name: x\nmodel: \xff\n")
    with pytest.raises(BadInput, match=r"car\.yaml:2: expected UTF-8"):
        read_vehicle(path)
    path.write_bytes(b"#" * (SETTINGS_BYTES + 1))
    with pytest.raises(BadInput, match="expected at most"):
        read_vehicle(path)


@given(st.text(max_size=200))
@settings(max_examples=150)
def test_any_text_is_read_or_refused(text: str) -> None:
    try:
        parse_mapping(text, "f")
    except BadInput as error:
        assert str(error).startswith("f:")


def test_numbers_are_what_they_look_like() -> None:
    keys = parse_mapping("a: 010\nb: 1:30\nc: 0x0A\nd: 1e-3\ne: 7\nf: true\ng: 1_000\n", "f").mapping()
    assert keys["c"].integer() == 10
    assert keys["d"].number() == 0.001
    assert (keys["e"].integer(0, 7), keys["e"].number(), keys["f"].boolean()) == (7, 7.0, True)
    for key in "abg":
        with pytest.raises(BadInput):
            keys[key].number()
    with pytest.raises(BadInput, match="f:5: expected a whole number from 8 to 9"):
        keys["e"].integer(8, 9)


# --- effects and history ---

OWN = """\
from logger.vehicle.effect import ForceEffect, Parameter, Scale


class AirDrag(ForceEffect):
    name = "air_drag"
    title = "a damper that grows with the square of the rate"
    parameters = (
        Parameter("drag_n_s2_per_m2", 100.0, 0.0, 5000.0, 0.0, Scale.LINEAR, (100.0,), "force per square of the rate"),
    )
    source = "mine"
    signature = "strong shakes are damped more"
    shown_by = "drive a bump"

    def laws(self, p, laws):
        return laws.with_force(lambda travel_m, rate_mps: p.drag_n_s2_per_m2 * rate_mps * abs(rate_mps))


EFFECT = AirDrag()
"""


@st.composite
def chosen_effects(draw: st.DrawFn) -> Chosen:
    without = ("roll", "constant_force")  # which a half car on one track cannot have
    effect = draw(st.sampled_from([one for one in shipped_effects().values() if one.name not in without]))
    values = {
        one.name: draw(st.sampled_from(one.choices) if one.choices else st.floats(one.low, one.high))
        for one in effect.parameters
    }
    errors = {name: draw(st.floats(0, 1e6)) for name in values if draw(st.booleans())}
    return chosen(effect, values, standard_errors=errors)


steps_taken = st.builds(ModelStep, names, st.floats(0, 10), st.none() | st.floats(0, 1))


@given(st.lists(chosen_effects(), max_size=5, unique_by=lambda one: one.effect.name), st.lists(steps_taken, max_size=4))
@settings(max_examples=40)
def test_a_written_model_is_read_back_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, effects: list[Chosen], history: list[ModelStep]
) -> None:
    path = tmp_path_factory.getbasetemp() / "model.yaml"
    model = CarModel(read_vehicle(vehicle_file("rav4-2009")), tuple(effects), tuple(history))
    write_model(path, model)
    assert read_model(path) == model


def test_effects_are_written_as_people_write_them(tmp_path: Path) -> None:
    path = tmp_path / "car.yaml"
    tire = chosen(shipped_effects()["tire_damping"], {"tire_damping_n_s_per_m": 150},
                  standard_errors={"tire_damping_n_s_per_m": np.float64(8.5)})
    lift = chosen(shipped_effects()["wheel_lift"], {}, standard_errors={})
    write_model(path, CarModel(read_vehicle(vehicle_file("rav4-2009")), (tire, lift),
                               (ModelStep("plain car", 0.25, None),)))
    assert path.read_text().split("contact_patch_m: 0.25\n")[1] == (
        "effects:\n"
        "- {name: tire_damping, tire_damping_n_s_per_m: 150.0, standard_errors: {tire_damping_n_s_per_m: 8.5}}\n"
        "- {name: wheel_lift}\n"
        "history:\n"
        "- {step: plain car, error: 0.25, noise_floor_error: null}\n"
    )
    unknown = replace(tire, standard_errors={"tire_damping_n_s_per_m": float("inf")})
    write_model(path, CarModel(read_vehicle(vehicle_file("rav4-2009")), (unknown,)))
    assert read_model(path).effects[0].standard_errors == {}


def test_a_number_at_its_limit_is_within_it(tmp_path: Path) -> None:
    """A thousandth of this mass, as numbers are rounded, is a little more than a thousandth of it."""
    mass_kg = 12803.837890625
    assert 0.001 * mass_kg > 12.803837890625
    text = QUARTER.replace("sprung_mass_kg: 300", f"sprung_mass_kg: {mass_kg}")
    text = text.replace("unsprung_mass_kg: 40", "unsprung_mass_kg: 12.803837890625")
    (tmp_path / "q.yaml").write_text(text.replace("damping_n_s_per_m: 1500", "damping_n_s_per_m: 0"))
    assert read_vehicle(tmp_path / "q.yaml").front.unsprung_mass_kg == 12.803837890625


def test_a_car_without_effects_is_a_model_too(tmp_path: Path) -> None:
    (tmp_path / "q.yaml").write_text(QUARTER)
    assert read_model(tmp_path / "q.yaml") == CarModel(read_vehicle(tmp_path / "q.yaml"))


def test_what_is_not_said_is_the_default(tmp_path: Path) -> None:
    path = tmp_path / "car.yaml"
    path.write_text(TEXT.replace("effects: []", "effects: [{name: sensor_bandwidth, cutoff_hz: 20}]"))
    assert read_model(path).effects[0].values == {"cutoff_hz": 20.0, "order": 1.0, "sampled_hz": 0.0}


def test_an_effect_of_ones_own_is_found_beside_the_vehicles_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, moved = tmp_path / "cars" / "car.yaml", tmp_path / "moved" / "deeper" / "car.yaml"
    for folder in (path.parent, moved.parent):
        folder.mkdir(parents=True)
    (path.parent / "air_drag.py").write_text(OWN)
    path.write_text(TEXT.replace("effects: []", "effects: [{name: air_drag, file: air_drag.py, drag_n_s2_per_m2: 7}]"))
    model = read_model(path)
    assert model.effects[0].values == {"drag_n_s2_per_m2": 7.0}
    write_model(moved, model)
    assert "file: ../../cars/air_drag.py" in moved.read_text()
    again = read_model(moved)
    assert (again.effects[0].effect.name, again.effects[0].values) == ("air_drag", {"drag_n_s2_per_m2": 7.0})
    monkeypatch.chdir(moved.parent)
    assert read_model("car.yaml").effects[0].file == "../../cars/air_drag.py"


EFFECT_COMPLAINTS = [
    ("{cutoff_hz: 2}", "expected the key 'name' here, it is missing"),
    ("tire_damping", "expected a mapping (key: value lines), found 'tire_damping'"),
    ("{name: tyre_damping}", "expected one of air_spring, body_bending, bump_stop, cg_shift"),
    ("{name: tire_damping}", "expected the key 'tire_damping_n_s_per_m' here, it is missing"),
    ("{name: tire_damping, tire_damping_n_s_per_m: -1}", "expected a number from 0 to 3000, found '-1'"),
    ("{name: tire_damping, tire_damping_n_s_per_m: .inf}", "expected a number from 0 to 3000, found '.inf'"),
    ("{name: top_mount_compliance, mount_stiffness_n_per_m: 1e9}", "expected a number from 5000 to 1e8, found '1e9'"),
    ("{name: payload, mass_kg: 3, kg: 3}", "expected one of the keys name, mass_kg, file, standard_errors, found 'kg'"),
    ("{name: sensor_bandwidth, cutoff_hz: 20, order: 1.5}", "expected one of 1, 2, 3, 4, 5, 6, 7, 8, found '1.5'"),
    ("{name: dry_friction, friction_force_n: 20, axle: 3}", "expected a number from 0 to 2, found '3'"),
    ("{name: payload, mass_kg: 3, standard_errors: {kg: 3}}", "expected one of the parameters mass_kg, found 'kg'"),
    ("{name: payload, mass_kg: 3, standard_errors: {mass_kg: -3}}", "expected a number of at least 0, found '-3'"),
    ("{name: wheel_lift}\n- {name: wheel_lift}", "expected each effect once, found 'wheel_lift'"),
    ("{name: drag, file: nowhere.py}", "nowhere.py: expected a readable file"),
]


@pytest.mark.parametrize(("effect", "words"), EFFECT_COMPLAINTS)
def test_complaints_about_effects_name_the_line(tmp_path: Path, effect: str, words: str) -> None:
    path = tmp_path / "car.yaml"
    text = TEXT.replace("effects: []", f"effects:\n- {effect}")
    path.write_text(text)
    with pytest.raises(BadInput) as caught:
        read_model(path)
    last = text.count("\n") - text.split("effects:")[1].split(effect.split("\n")[-1])[1].count("\n") + 1
    assert words in str(caught.value)
    assert str(caught.value).startswith(f"{path}:{last}: ")


def test_an_effect_that_this_car_cannot_have(tmp_path: Path) -> None:
    path = tmp_path / "q.yaml"
    path.write_text(QUARTER + "effects:\n- {name: sensor_offset, offset_m: 0.2}\n")
    with pytest.raises(BadInput, match=r"q\.yaml:11: sensor_offset: a quarter car does not pitch$"):
        read_model(path)


@pytest.mark.parametrize(("step", "words"), [
    ("{step: plain}", "expected the key 'error' here"), ("{error: 1}", "expected the key 'step' here"),
    ("{step: plain, error: .nan}", "expected a number"), ("{step: plain, error: 0.2, floor: 1}", "expected one of the"),
    ("{step: plain, error: 0.2, noise_floor_error: -1}", "expected a number of at least 0"),
])
def test_complaints_about_the_history_name_the_line(tmp_path: Path, step: str, words: str) -> None:
    path = tmp_path / "car.yaml"
    path.write_text(QUARTER + f"history:\n- {step}\n")
    with pytest.raises(BadInput) as caught:
        read_model(path)
    assert str(caught.value).startswith(f"{path}:11: {words}")


@pytest.mark.parametrize(("old", "new", "words"), [
    ("EFFECT = AirDrag()", "EFFECTS = [AirDrag()]", ": expected it to offer EFFECT, as in EFFECT = ..."),
    ("EFFECT = AirDrag()", "EFFECT = AirDrag", ": expected EFFECT to be an object of a class made from one of"),
    ("EFFECT = AirDrag()", "EFFECT = 1 / 0", ":18: ZeroDivisionError: division by zero"),
    ("EFFECT = AirDrag()", "raise SystemExit(3)", ":18: SystemExit: 3"),
    ("EFFECT = AirDrag()", "EFFECT = )", ":18: expected Python, found unmatched ')'"),
    ('"air_drag"', '"tire_damping"', ": expected a name that no effect of ridelog has, found 'tire_damping'; rename"),
    ('"air_drag"', '"drag"', "car.yaml:22: expected 'drag', as EFFECT in"),
    ('"air_drag"', '"air-drag"', ": expected a name of letters, digits and _, found 'air-drag'"),
    ('source = "mine"', "", ": expected EFFECT to have a text 'source'"),
    ("100.0, 0.0, 5000.0", "-1.0, 0.0, 5000.0", ": drag_n_s2_per_m2: expected finite low <= start <= high, found 0.0"),
    ("5000.0, 0.0", 'float("inf"), 0.0', ": drag_n_s2_per_m2: expected finite low <= start <= high, found 0.0"),
    ("Scale.LINEAR", "Scale.LOG", ": drag_n_s2_per_m2: expected low above 0 for a scale that is log, found 0.0"),
    ("Scale.LINEAR", "'linear'", ": drag_n_s2_per_m2: expected one of Scale.LINEAR, Scale.LOG, Scale.RECIPROCAL as"),
    ("100.0, 0.0, 5000.0", "'a', 0.0, 5000.0", ": drag_n_s2_per_m2: expected numbers as low, start and high, found 0"),
    ("5000.0, 0.0", "5000.0, 'vehicle'", ": drag_n_s2_per_m2: expected null to be None, infinite, or within 0.0 to"),
    ("5000.0, 0.0", "5000.0, -7.0", ": drag_n_s2_per_m2: expected null to be None, infinite, or within 0.0 to 5000.0"),
    ("(100.0,)", "100.0", ": drag_n_s2_per_m2: expected trials, the values that a search begins at"),
    ("(100.0,)", "()", ": drag_n_s2_per_m2: expected trials, the values that a search begins at"),
    ("(100.0,)", "(0.0,)", ": drag_n_s2_per_m2: expected trials away from 0.0, where the effect does nothing"),
    ('source = "mine"', 'source = "mine"; refinements = ("drag_n_s2_per_m2",)',
     ": drag_n_s2_per_m2: expected trials away from its usual value"),
    ("(100.0,)", "(-100.0,)", ": drag_n_s2_per_m2: expected trials, choices and default within 0.0 to 5000.0"),
    ('Parameter("drag_n_s2_per_m2"', 'Parameter("file"', ": expected a parameter's name of letters"),
    ("parameters = (", "parameters = [] or (1,", ": expected parameters to be a tuple of Parameter"),
    ("return laws.with", "laws.with", "expected laws to return a CornerLaws, found NoneType"),
    ("p.drag_n_s2_per_m2 * rate_mps * abs(rate_mps)", "3.0", "expected a force to return an array of shape"),
    ("rate_mps * abs(rate_mps)", "rate_mps / travel_m.min() * float('nan')", "a force to return finite numbers"),
    ("p.drag_n_s2_per_m2 * rate_mps", "p.drag * rate_mps", ":15: AttributeError: 'types.SimpleNamespace' object has"),
])
def test_complaints_about_an_effect_of_ones_own_name_its_file(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    path = tmp_path / "car.yaml"
    path.write_text(TEXT.replace("effects: []", "effects: [{name: air_drag, file: mine.py, drag_n_s2_per_m2: 7}]"))
    assert old in OWN
    (tmp_path / "mine.py").write_text(OWN.replace(old, new))
    with pytest.raises(BadInput) as caught:
        read_model(path)
    assert words in str(caught.value)
    assert f"{tmp_path / 'mine.py'}" in str(caught.value)
    assert "\n" not in str(caught.value)


# --- what was given ---

def test_the_numbers_that_were_given_first_come_back_with_the_refitted_ones(tmp_path: Path) -> None:
    first = read_vehicle(vehicle_file("rav4-2009"))
    refitted = changed(first, {"sprung_mass_kg": 700.0, "front.suspension_damping_n_s_per_m": 1000.0})
    path = tmp_path / "refitted.yaml"
    write_model(path, CarModel(refitted, given=first))
    assert read_model(path) == CarModel(refitted, given=first)
    text = path.read_text()
    assert "given:" in text and text.count("suspension_damping_n_s_per_m") == 3  # two axles, and the one that moved
    write_model(path, CarModel(first))
    assert "given" not in path.read_text()


@pytest.mark.parametrize(("line", "words"), [
    ("sprung_mass_kg: nonsense", "number"), ("sprung_mass_kg: 1e300", "expected a number from 1 to"),
    ("front.suspension_damping_n_s_per_m: 0", "above 0"), ("contact_patch_m: 5000", "expected a number from 0 to 1"),
    ("rear.unsprung_mass_kg: 30", "expected one of the keys sprung_mass_kg"),
    ("both.unsprung_mass_kg: 30", "expected one of the keys sprung_mass_kg"),
])
def test_complaints_about_what_was_given_name_the_line(tmp_path: Path, line: str, words: str) -> None:
    path = tmp_path / "car.yaml"
    path.write_text(QUARTER + f"given:\n  {line}\n")
    with pytest.raises(BadInput) as caught:
        read_model(path)
    assert str(caught.value).startswith(f"{path}:{len((QUARTER + 'given:').splitlines()) + 1}: ")
    assert words in str(caught.value)


@pytest.mark.parametrize(("said", "value", "deviation"), [
    ("38 +- 10%", 38.0, 0.1), ("38 ± 10 %", 38.0, 0.1), ("38+/-3.8", 38.0, 0.1),
    ("[20, 80]", 40.0, np.log(4) / np.sqrt(12)),  # uniform by factors: its variance is a twelfth of its width's square
    ("unknown", 45.0, np.log(400) / np.sqrt(12)),  # the Golden Car's 0.15 of 300 kg; fits stay within a factor of 20
])
def test_a_number_says_how_well_it_is_known(tmp_path: Path, said: str, value: float, deviation: float) -> None:
    path = tmp_path / "car.yaml"
    path.write_text(QUARTER.replace("unsprung_mass_kg: 40", f"unsprung_mass_kg: {said}"), "utf-8")
    model = read_model(path)
    assert model.vehicle.front.unsprung_mass_kg == pytest.approx(value)
    assert {name: one.deviation for name, one in model.known.items()} == {
        "front.unsprung_mass_kg": pytest.approx(deviation)}
    write_model(path, model)
    assert read_model(path) == model

    found = replace(model, given=model.vehicle, vehicle=changed(model.vehicle, {"front.unsprung_mass_kg": 44.0}))
    write_model(path, found)
    again = read_model(path)
    assert again.vehicle.front.unsprung_mass_kg == 44
    assert again.known["front.unsprung_mass_kg"].words == model.known["front.unsprung_mass_kg"].words
    assert again.known["front.unsprung_mass_kg"].deviation == pytest.approx(deviation)


@pytest.mark.parametrize(("said", "expected"), [
    ("[80, 20]", "a range, [low, high], found a list"), ("[20]", "a range, [low, high], found a list"),
    ("40 +- 300%", "a standard deviation up to the number itself, or unknown"),
    ("40 +- 0", "greater than 0, found '0'"),
    ("40 kg +- 2", "a number of at least 0, found '40 kg'"),
    ("0 +- 2", "a number above 0 before +-, found '0 +- 2'"),
    ("unknwon", "a number of at least 0, found 'unknwon'")])
def test_what_says_nothing_of_a_number_is_refused_with_its_line(tmp_path: Path, said: str, expected: str) -> None:
    text = QUARTER.replace("unsprung_mass_kg: 40", f"unsprung_mass_kg: {said}")
    message = complaint(tmp_path, text)
    assert message.startswith(f"{line_of(text, '  unsprung_mass_kg')}: ") and expected in message


@pytest.mark.parametrize(("stiffness", "preload", "stiffness_n_per_m", "preload_n"), [
    ("0 +- 2000", "-60 +- 20", 2000 * np.exp(-0.63518), -60.0),  # the mean of ln |z| is -(Euler's gamma + ln 2) / 2
    ("unknown", "unknown", 350 * 63.3, 0.0), ("30 +- 10%", "[-100, 40]", 30.0, -30.0), ("0", "5", 0.0, 5.0)])
def test_a_part_may_have_no_spring_and_any_preload(
        tmp_path: Path, stiffness: str, preload: str, stiffness_n_per_m: float, preload_n: float) -> None:
    path = tmp_path / "damper.yaml"
    path.write_text(f"name: damper\nmodel: component\nstiffness_n_per_m: {stiffness}\n"
                    f"damping_n_s_per_m: 1500\npreload_n: {preload}\n", "utf-8")
    model = read_model(path)
    assert model.vehicle.front.suspension_stiffness_n_per_m == pytest.approx(stiffness_n_per_m, rel=1e-5)
    assert model.vehicle.preload_n == preload_n
    assert preload == "5" or model.known["preload_n"].words == preload.replace("[-100, 40]", "[-100.0, 40.0]")
    write_model(tmp_path / "again.yaml", model)
    assert read_model(tmp_path / "again.yaml") == model
    path.write_text(path.read_text("utf-8").replace(stiffness, "0 +- 20%", 1), "utf-8")
    with pytest.raises(BadInput, match=f"{path}:3: expected .* as a share of 0 is 0, found '0 .- 20%'"):
        read_model(path)


def test_no_number_is_unknown_on_board(tmp_path: Path) -> None:
    path = tmp_path / "car.yaml"
    path.write_text(QUARTER.replace("1.8e5", "unknown"), "utf-8")
    with pytest.raises(BadInput, match=r"expected a number for front\.tire_stiffness_n_per_m, found unknown"):
        read_on_board(path)


def test_no_road_moves_a_part_on_its_bench(tmp_path: Path) -> None:
    path = tmp_path / "box.yaml"
    path.write_text("name: box\nmodel: single_mass\nmass_kg: 0.3\nstiffness_n_per_m: 30\ndamping_n_s_per_m: 1\n",
                    "utf-8")
    with pytest.raises(BadInput, match="box: expected a car, found model: single_mass, which stands on a test bench"):
        read_on_board(path)
