"""A user's own effect that fails, or gives no answer, long after it was read and tried: a line names its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import own_effect
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.simulate import Passage

from ...support.lab.runs_with_residual import rough_track

CAR = read_vehicle(vehicle_file("rav4-2009"))
HEAD = """\
from dataclasses import replace
import numpy as np
from logger.vehicle.effect import *
from logger.vehicle.structure import hung


class Mine({kind}):
    name = "mine"
    title = "mine"
    parameters = (Parameter("size", 1.0, 0.0, 10.0, 0.0, Scale.LINEAR, (1.0,), "how much"),)
    source = "mine"
    signature = "mine"
    shown_by = "drive"

    def {asked}:
        {does}


EFFECT = Mine()
"""
ASKED = {"RoadEffect": "road(self, p, spacing_m, elevation_m)",
         "DriveEffect": "driven(self, p, distance_m)", "VehicleEffect": "vehicle(self, p, vehicle)",
         "BodyEffect": "structure(self, p, structure)", "ForceEffect": "laws(self, p, laws)",
         "SensorEffect": "factor(self, p, s)", "RecordEffect": "record(self, p, recording)"}
BAD = "(np.nan if p.size == 3 else 1.0)"
# What each kind does; at size 3 it fails or gives no answer, in these words.
CASES = [
    ("RoadEffect", "return elevation_m / (p.size - 3)", "expected road to return finite numbers"),
    ("RoadEffect", "return elevation_m[:-1] if p.size == 3 else elevation_m", "expected road to return an array"),
    ("DriveEffect", "return distance_m / (p.size - 3)", "expected driven to return finite numbers"),
    ("DriveEffect", "return distance_m[:-1] if p.size == 3 else distance_m", "expected driven to return an array"),
    ("DriveEffect", "return [{}[1] if p.size == 3 else one for one in distance_m]", ":16: KeyError: 1"),
    ("VehicleEffect", f"return replace(vehicle, contact_patch_m={BAD})", "expected vehicle to return finite"),
    ("VehicleEffect", "return replace(vehicle, sprung_mass_kg=800 - 300 * p.size)", "whose masses are all above 0"),
    ("VehicleEffect", "return replace(vehicle, model='full_car' if p.size == 3 else vehicle.model)", "a full car"),
    ("VehicleEffect", "return replace(vehicle, front=replace(vehicle.front, cg_distance_m=1 / (3 - p.size)))",
     ":16: ZeroDivisionError"),
    ("BodyEffect", f"return replace(structure, road=structure.road * {BAD})", "structure, in road, to return fin"),
    ("BodyEffect", "return hung(structure, 9, 4e3 * (3 - p.size), 0, structure.body[:, 0])", "whose springs are all"),
    ("BodyEffect", "return None if p.size == 3 else structure", "expected structure to return a Structure"),
    ("ForceEffect", f"return laws.with_force(lambda x, v: {BAD} * v)", "expected a force to return finite"),
    ("ForceEffect", "return laws.with_spring(lambda x: 0.0 if p.size == 3 else x)", "a spring to return an arr"),
    ("ForceEffect", "return laws.with_tire(lambda d: 1e4j * d if p.size == 3 else d)", "expected a tire to return"),
    ("ForceEffect", "return replace(laws, damper=lambda v: v.none if p.size == 3 else v)", ":16: AttributeError"),
    ("ForceEffect", f"return replace(laws, dry_friction_n={BAD})", "dry_friction_n of 0 or more, found nan"),
    ("ForceEffect", "return replace(laws, mount_n_per_m=2000.0 - 1000 * p.size)", "mount_n_per_m of 0 or more"),
    ("ForceEffect", "return replace(laws, damping_n_s_per_m=1.0 + p.size)", "leave damping_n_s_per_m as it was"),
    ("ForceEffect", "return replace(laws, stiffness_n_per_m=1.0 + p.size)", "leave stiffness_n_per_m as it was"),
    ("ForceEffect", "return replace(laws, springs=(3.0,))", "a tuple of functions as springs"),
    ("SensorEffect", "return np.full_like(s, 1 / (p.size - 3) if p.size != 3 else np.inf)", "expected factor to retu"),
    ("SensorEffect", "return np.ones(3) if p.size == 3 else np.ones(s.shape)", "expected factor to return"),
    ("RecordEffect", "return recording.accel_z_mps2 / (p.size - 3)", "expected record to return finite numbers"),
    ("RecordEffect", "return 1.0 if p.size == 3 else recording.time_s", "expected record to return an array of"),
]


def written(folder: Path, kind: str, does: str, more: str = "") -> Path:
    path = folder / "mine.py"
    path.write_text(HEAD.format(kind=kind, asked=ASKED[kind], does=does).replace("\n\n\nEFFECT", more + "\n\n\nEFFECT"))
    return path


def record(one: Chosen) -> np.ndarray:
    car = compose(CAR, [one])
    return recorded(car, Passage(rough_track(20.0, 1), 100.0, car.driven(0.1 * np.arange(20.0))))


@pytest.mark.parametrize(("kind", "does", "words"), CASES)
def test_one_that_fails_at_some_value(tmp_path: Path, kind: str, does: str, words: str) -> None:
    path = written(tmp_path, kind, does)
    effect = own_effect(path)
    if "as it was" not in words and "springs" not in does[:35]:
        assert np.isfinite(record(chosen(effect, {"size": 2.0}))).all()
    with pytest.raises(BadInput) as caught:
        record(chosen(effect, {"size": 3.0}))
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_a_sum_of_own_and_other_laws_is_their_sum(tmp_path: Path) -> None:
    path = written(tmp_path, "ForceEffect", "return laws.with_force(lambda x, v: 100 * p.size * v)")
    assert record(chosen(own_effect(path), {"size": 0.0})) == pytest.approx(
        recorded(compose(CAR), Passage(rough_track(20.0, 1), 100.0, 0.1 * np.arange(20.0))), abs=1e-9)


@pytest.mark.parametrize(("more", "words"), [
    ("def obstacle(self, vehicle, two_tracks):\n        return vehicle.wings", ":19: AttributeError: 'Vehicle'"),
    ("def obstacle(self, vehicle, two_tracks):\n        return True", "return words or None, found True"),
])
def test_an_obstacle_that_is_none(tmp_path: Path, more: str, words: str) -> None:
    effect = own_effect(written(tmp_path, "SensorEffect", "return np.ones_like(s)", f"\n\n    {more}"))
    with pytest.raises(BadInput) as caught:
        effect.obstacle(CAR, two_tracks=True)
    assert f"{tmp_path / 'mine.py'}" in str(caught.value) and words in str(caught.value)


@pytest.mark.parametrize(("does", "words"), [
    ("return [{}['size']]", ":19: KeyError: 'size'"), ("return None", "expected trials to return a list"),
    ("return []", "expected trials to return a list"), ("return [{}]", "mine: expected a value of size"),
    ("return [{'size': 99.0}]", "mine: expected size of 0 to 10, found 99"),
    ("return [{'size': '2'}]", "expected trials to return a number as size, found '2'"),
])
def test_trials_that_are_none(tmp_path: Path, does: str, words: str) -> None:
    more = f"\n\n    def trials(self, seen=None):\n        {does}"
    effect = own_effect(written(tmp_path, "SensorEffect", "return np.ones_like(s)", more))
    with pytest.raises(BadInput) as caught:
        effect.trials()
    assert f"{tmp_path / 'mine.py'}" in str(caught.value) and words in str(caught.value)


@pytest.mark.parametrize(("old", "new", "words"), [
    ("class Mine(SensorEffect)", "class Mine(SensorEffect, DriveEffect)", "of a class made from one of"),
    ('source = "mine"', 'source = "mine"\n    stage = "first"', "a whole number as stage"),
    ('source = "mine"', 'source = "mine"\n    realigns = None', "True or False as realigns"),
    ('source = "mine"', 'source = "mine"\n    replaces = ("colour",)', "tuple of names of parameters"),
    ('source = "mine"', 'source = "mine"\n    reshapes = 0', "True or False as reshapes"),
])
def test_what_is_seen_when_it_is_read(tmp_path: Path, old: str, new: str, words: str) -> None:
    more = "\n\n    def driven(self, p, distance_m):\n        return distance_m"
    path = written(tmp_path, "SensorEffect", "return np.ones_like(s)", more)
    path.write_text(path.read_text().replace(old, new))
    with pytest.raises(BadInput, match=words):
        own_effect(path)
