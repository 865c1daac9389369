"""Standard errors of a vehicle's numbers in its file, and what the service reads of effects."""

from pathlib import Path

import pytest

from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import CarModel, read_model, read_on_board, write_model
from logger.vehicle.uncertain import NumberErrors

CAR = read_model(vehicle_file("rav4-2009")).vehicle
PLAIN = vehicle_file("rav4-2009").read_text("utf-8").replace("effects: []", "")
FRICTION = "effects: [{name: dry_friction, friction_force_n: 80}]\n"


def test_they_are_read_back_as_they_were_written(tmp_path: Path) -> None:
    errors = NumberErrors({"sprung_mass_kg": 12.5, "both.suspension_stiffness_n_per_m": 0.1 + 0.2,
                           "sensor.ahead_m": 0.02}, ((), (0.9,), (-1 / 3, 0.0)))
    write_model(tmp_path / "car.yaml", CarModel(CAR, errors=errors))
    assert read_model(tmp_path / "car.yaml").errors == errors
    write_model(tmp_path / "plain.yaml", CarModel(CAR))
    assert read_model(tmp_path / "plain.yaml").errors is None
    assert "standard_errors" not in (tmp_path / "plain.yaml").read_text()


def test_those_of_an_effect_go_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "car.yaml").write_text(f"{PLAIN}{FRICTION}standard_errors: {{dry_friction.friction_force_n: 8}}\n")
    errors = read_model(tmp_path / "car.yaml").errors
    assert errors is not None and errors.standard_errors == {"dry_friction.friction_force_n": 8.0}


@pytest.mark.parametrize(("added", "words"), [
    ("standard_errors: {wings: 1}\n", "expected one of the keys"),
    ("standard_errors: {sprung_mass_kg: 0}\n", "expected a number greater than 0"),
    ("standard_errors: {dry_friction.friction_force_n: 8}\n", "expected one of the keys"),
    ("standard_errors: {sprung_mass_kg: 9}\ncorrelations: [[], [0.5]]\n", "a row for each standard error (1)"),
    ("standard_errors: {sprung_mass_kg: 9, contact_patch_m: 0.1}\ncorrelations: [[], [1.5]]\n", "from -1 to 1"),
])
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, added: str, words: str) -> None:
    (tmp_path / "car.yaml").write_text(PLAIN + added)
    with pytest.raises(BadInput, match=r"car.yaml:\d+: expected") as caught:
        read_model(tmp_path / "car.yaml")
    assert words in str(caught.value)


def test_on_board_effects_are_read_and_the_python_of_others_is_not_run(tmp_path: Path) -> None:
    (tmp_path / "car.yaml").write_text(PLAIN + FRICTION)
    assert [one.effect.name for one in read_on_board(tmp_path / "car.yaml").effects] == ["dry_friction"]
    (tmp_path / "own.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')\n")
    (tmp_path / "car.yaml").write_text(f"{PLAIN}effects: [{{name: mine, file: own.py}}]\n")
    with pytest.raises(BadInput, match=r"car.yaml:\d+: expected an effect that comes with ridelog"):
        read_on_board(tmp_path / "car.yaml")
    assert not (tmp_path / "ran").exists()
