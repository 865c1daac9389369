"""Stored calibrations: found again to the last bit, and never out of a file that is not whole."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logger.estimation.rms_calibration import CalibrationSettings, RmsLine, SpeedCalibration
from logger.files import STATE_BYTES
from logger.shipped import shipped, vehicle_file
from logger.store.formats import calibration_file as module
from logger.store.formats.calibration_file import KEPT, find, fingerprint, keep, places
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.vehicle import SensorPlace

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
SPEEDS = tuple(
    SpeedCalibration(speed, *(RmsLine(speed * number / 7, 0.1 / 3, 1e-300, -0.5) for number in range(1, 5)))
    for speed in (4.4704, 31.2928)
)


def half(f_hz: np.ndarray) -> np.ndarray:
    return np.full(f_hz.shape, 0.5)


def test_found_again_to_the_last_bit(tmp_path: Path) -> None:
    path = tmp_path / "car.calibration.json"
    assert find([path], "a") is None
    assert keep([path], "a", SPEEDS) == path
    found = find([tmp_path / "other.json", path], "a")
    assert found is not None
    assert (found.speeds, found.path) == (SPEEDS, path)
    assert find([path], "b") is None
    assert list(tmp_path.iterdir()) == [path]


def test_several_are_kept_but_not_without_end(tmp_path: Path) -> None:
    path = tmp_path / "car.calibration.json"
    for number in range(KEPT):
        keep([path], f"key {number}", SPEEDS[:1])
    keep([path], "key 0", SPEEDS)  # new again
    keep([path], "one more", SPEEDS)
    assert [number for number in range(KEPT) if find([path], f"key {number}") is None] == [1]
    found = find([path], "key 0")
    assert found is not None
    assert found.speeds == SPEEDS


def test_a_file_cut_or_changed_at_any_byte_is_as_good_as_none(tmp_path: Path) -> None:
    path = tmp_path / "car.calibration.json"
    keep([path], "a", SPEEDS[:1])
    whole = path.read_bytes()
    for place in range(len(whole) - 2):  # without its last brace it is not whole; the line's end does not matter
        path.write_bytes(whole[:place])
        assert find([path], "a") is None
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0x04]) + whole[place + 1:])
        assert find([path], "a") is None


def content(calibrations: object, **changes: object) -> str:
    digest = module.json_sha256(calibrations)
    return json.dumps({"format": 1, "sha256": digest, "calibrations": calibrations} | changes)


@pytest.mark.parametrize("text", [
    "", "null", "[]", "3", "[" * 100_000, "\x00", '{"format": 1}', " " * (STATE_BYTES + 1),
    content({"a": []}, format=2), content({"a": []}, sha256="0" * 64), content([]), content("a"), content({"a": [{}]}),
    content({"a": [3]}), content({"a": 3}), content({"a": [{"speed_mps": 1.0, "iri_per_accel_rms": {"slope": 1}}]}),
])
def test_files_that_are_something_else(tmp_path: Path, text: str) -> None:
    path = tmp_path / "car.calibration.json"
    path.write_text(text)
    assert find([path], "a") is None
    assert keep([path], "a", SPEEDS) == path  # and in its way no longer
    assert find([path], "a") is not None


def test_the_next_place_when_the_first_cannot_be_written(tmp_path: Path) -> None:
    taken = tmp_path / "car.calibration.json"
    taken.mkdir()
    cache = tmp_path / "new" / "folder" / "car.calibration.json"
    assert keep([taken, cache], "a", SPEEDS) == cache
    found = find([taken, cache], "a")
    assert found is not None
    assert found.path == cache
    assert keep([taken], "a", SPEEDS) is None
    assert sorted(tmp_path.iterdir()) == [taken, tmp_path / "new"]


def test_a_write_that_fails_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "car.calibration.json"
    keep([path], "a", SPEEDS)

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(module.os, "fsync", full)
    assert keep([path], "b", SPEEDS) is None
    assert list(tmp_path.iterdir()) == [path]
    assert find([path], "a") is not None


def test_a_fingerprint_of_every_number() -> None:
    assert RAV4.rear is not None
    keys = [
        fingerprint(RAV4, half, CalibrationSettings()),
        fingerprint(RAV4, None, CalibrationSettings()),
        fingerprint(RAV4, lambda f_hz: 0.5 + 1e-4 * (f_hz > 14), CalibrationSettings()),
        fingerprint(replace(RAV4, sprung_mass_kg=875.001), half, CalibrationSettings()),
        fingerprint(replace(RAV4, rear=replace(RAV4.rear, unsprung_mass_kg=56.0)), half, CalibrationSettings()),
        fingerprint(replace(RAV4, sensor=SensorPlace(0.1, 0.0)), half, CalibrationSettings()),
        fingerprint(RAV4, half, CalibrationSettings(window_m=7.63)),
        fingerprint(RAV4, half, CalibrationSettings(seed=2)),
        fingerprint(RAV4, half, CalibrationSettings(roads=121)),
        fingerprint(RAV4, half, CalibrationSettings((10.0,))),
    ]
    assert len(set(keys)) == len(keys)
    assert fingerprint(replace(RAV4, name="another name"), half, CalibrationSettings()) == keys[0]


def test_beside_the_vehicle_or_in_the_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = tmp_path / "my.car.yaml"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    in_cache = tmp_path / "cache" / "ridelog"
    assert places(mine) == (tmp_path / "my.car.calibration.json", in_cache / "my.car.calibration.json")
    assert places(shipped("config") / "vehicles" / "rav4-2009.yaml") == (in_cache / "rav4-2009.calibration.json",)
    monkeypatch.setenv("XDG_CACHE_HOME", "relative/is/ignored")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert places(mine)[1].parent == tmp_path / "home" / ".cache" / "ridelog"
    monkeypatch.setenv("HOME", "")
    assert places(mine)[1].parent == Path("/.cache/ridelog")
    monkeypatch.delenv("HOME")
    assert places(mine)[1].parent == Path("/.cache/ridelog")
