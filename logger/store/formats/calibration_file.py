"""Calibrations that are kept beside vehicle files.

A calibration takes a moment and never changes while vehicle, recorder and settings stay as they are; but a number that
belongs to another car, or to a file that lost half its bytes, must never be used. ``NAME.calibration.json`` beside
``NAME.yaml`` holds calibrations by a fingerprint of every number they come from, and a checksum over all of them. A
file that is damaged, of another format or without the fingerprint is as good as none. Where the vehicle's folder cannot
be written to, and for the vehicles that come with the program, the file lies in the user's cache. It is replaced in one
step, so that a reader sees the old one or the new one.
"""

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from logger.arrays import Array
from logger.errors import BadInput
from logger.estimation.rms_calibration import CalibrationSettings, RmsLine, SpeedCalibration
from logger.files import STATE_BYTES, json_sha256, make_folder, read_bounded, replace_bytes
from logger.shipped import shipped
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Vehicle

FORMAT = 1  # another number whenever the same settings give other results
KEPT = 16  # the oldest goes first

_GAIN_PROBES_HZ = np.geomspace(0.01, 100.0, 200)


@dataclass(frozen=True)
class StoredCalibration:
    """A stored calibration and the file it was in."""

    speeds: tuple[SpeedCalibration, ...]
    path: Path


def fingerprint(vehicle: Vehicle, recorder_gain: Callable[[Array], Array] | None, settings: CalibrationSettings,
                effects: Sequence[Chosen] = ()) -> str:
    """64 hex digits that change with any number of the vehicle, its effects, the recorder's response or the settings.

    Not with the vehicle's name. The recorder's gain is given by its values at 0.01 to 100 Hz.
    """
    digits = 6
    numbers = asdict(vehicle)
    del numbers["name"], numbers["preload_n"]  # a car has none
    gain = recorder_gain(_GAIN_PROBES_HZ).round(digits).tolist() if recorder_gain else None
    with_effects = {"effects": {one.effect.name: dict(one.values) for one in effects}} if effects else {}
    return json_sha256({"vehicle": numbers, "settings": asdict(settings), "recorder_gain": gain, **with_effects})


def places(vehicle_path: Path) -> tuple[Path, ...]:
    """Where calibrations of this vehicle's file are kept, the best place first."""
    name = f"{vehicle_path.stem}.calibration.json"
    in_cache = _cache_folder() / name
    if vehicle_path.resolve().is_relative_to(shipped("config").resolve()):
        return (in_cache,)
    return (vehicle_path.with_name(name), in_cache)


def find(paths: Sequence[Path], key: str) -> StoredCalibration | None:
    """The calibration with this fingerprint; None where there is none, or none that can be trusted."""
    for path in paths:
        if key in (stored := _read_file(path)):
            return StoredCalibration(stored[key], path)
    return None


def keep(paths: Sequence[Path], key: str, speeds: tuple[SpeedCalibration, ...]) -> Path | None:
    """Store a calibration in the first of these places that can be written to; None if there is none."""
    for path in paths:
        stored = {name: kept for name, kept in _read_file(path).items() if name != key} | {key: speeds}
        try:
            make_folder(path.parent)
            _replace(path, dict(list(stored.items())[-KEPT:]))
        except OSError:
            continue
        return path
    return None


def _cache_folder() -> Path:
    """XDG Base Directory Specification: a relative path in the variable is to be ignored, an empty one is none."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (given if given.is_absolute() else Path(os.environ.get("HOME") or "/") / ".cache") / "ridelog"


def _read_file(path: Path) -> dict[str, tuple[SpeedCalibration, ...]]:
    """All calibrations of a file; empty for a file that is not whole, of this format, and what it says it is."""
    try:
        content = json.loads(read_bounded(path, STATE_BYTES))
        if content["format"] != FORMAT or content["sha256"] != json_sha256(content["calibrations"]):
            return {}
        return {key: tuple(map(_speed, speeds)) for key, speeds in content["calibrations"].items()}
    except (BadInput, ValueError, TypeError, KeyError, AttributeError, RecursionError):
        return {}


def _speed(stored: dict[str, Any]) -> SpeedCalibration:
    lines = [RmsLine(**stored[field.name]) for field in fields(SpeedCalibration) if field.name != "speed_mps"]
    return SpeedCalibration(stored["speed_mps"], *lines)


def _replace(path: Path, stored: dict[str, tuple[SpeedCalibration, ...]]) -> None:
    calibrations = {key: [asdict(speed) for speed in speeds] for key, speeds in stored.items()}
    content = {"format": FORMAT, "sha256": json_sha256(calibrations), "calibrations": calibrations}
    replace_bytes(path, (json.dumps(content, indent=1, allow_nan=False) + "\n").encode("ascii"))
