"""Vehicle files: what is read, and what is said about files that cannot be."""

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.store.vehicle_file import read_vehicle
from logger.store.yaml_lines import MAX_BYTES, parse_mapping
from logger.vehicle.vehicle import Axle, Vehicle

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


@pytest.mark.parametrize(("old", "new", "at", "words"), [
    ("sprung_mass_kg: 875", "sprung_mass_kg: heavy", "sprung_mass_kg", "a number greater than 0, found 'heavy'"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: '875'", "sprung_mass_kg", "expected a number"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: -1", "sprung_mass_kg", "greater than 0"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: .nan", "sprung_mass_kg", "expected a number"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: 1e999", "sprung_mass_kg", "expected a number"),
    ("sprung_mass_kg: 875", "sprung_mass_kg: [875]", "sprung_mass_kg", "found a list"),
    ("sprung_mass_kg: 875", "sprung_mas_kg: 875", "sprung_mas_kg", "expected one of the keys"),
    ("sprung_mass_kg: 875", "name: again", "name: again", "each key once"),
    ("model: half_car", "model: full_car", "model", "expected one of half_car, quarter_car, found 'full_car'"),
    ("model: half_car", "model: {a: 1}", "model", "found a mapping"),
    ("contact_patch_m: 0.25", "contact_patch_m: 25", "contact_patch_m", "from 0 to 1"),
    ("effects: []", "effects: [{name: roll}]", "effects", "not supported yet"),
    ("effects: []", "effects: ", "effects", "expected a list, found nothing"),
    ("name: rav4-2009", "name: !!python/name:os.system x", "name", "plain value"),
])
def test_complaints_name_the_line(tmp_path: Path, old: str, new: str, at: str, words: str) -> None:
    text = TEXT.replace(old, new)
    assert text != TEXT
    message = complaint(tmp_path, text)
    assert message.startswith(f"{line_of(text, at)}: expected")
    assert words in message


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
    ('a: "\\UFFFFFFFF"\n', " expected YAML"),
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
    path.write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(BadInput, match="expected at most"):
        read_vehicle(path)


@given(st.text(max_size=200))
@settings(deadline=None, max_examples=150)
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
