"""Drives that were extracted without a profile: each counts from its own start, and all are laid on one distance."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from logger.api.lab.diagnose import records_of
from logger.errors import BadInput
from logger.runs import BY_RECEIVER, BY_ROAD, RecordFacts
from logger.store.formats.drive_file import Drive

METRES_PER_DEG = 111_195.0
STOOD_S = 6.0


def drive(name: str, speed_mps: float, begins_m: float, lasts_s: float, facts: RecordFacts) -> tuple[Drive, str]:
    """A drive along a bend that stands at first; its distance begins at 0, its places wander by a metre."""
    rng = np.random.default_rng(len(name))
    time_s = np.arange(round(100 * lasts_s)) / 100
    speed = np.where(time_s < STOOD_S, 0.0, speed_mps)
    way = np.cumsum(speed) / 100
    place = begins_m + way + np.sin(2 * np.pi * time_s / 40)
    heading = place / 800.0
    east, north = 800.0 * np.sin(heading), 800.0 * (1 - np.cos(heading))
    return Drive(Path(name), 100.0, time_s, rng.normal(0, 1, len(time_s)), speed, way, 48.0 + north / METRES_PER_DEG,
                 11.0 + east / METRES_PER_DEG / np.cos(np.radians(48.0)), facts=facts), name


EXTRACTED = RecordFacts(source="town.dump")


def test_extracted_drives_are_laid_on_one_distance_by_their_positions() -> None:
    starts_m = {"a": 0.0, "bb": 40.0, "ccc": 85.0}
    drives = [drive(name, 8.0 + 3 * number, starts_m[name], 60.0, EXTRACTED) for number, name in enumerate(starts_m)]
    found = records_of(drives)
    assert [one.name for one in found] == list(starts_m)
    for one, (given, name) in zip(found, drives, strict=True):
        assert one.count == (given.speed_mps > 0).sum()  # standing says nothing
        true_m = starts_m[name] - starts_m["ccc"] + given.distance_m[given.speed_mps > 0]
        assert one.distance_m == pytest.approx(true_m, abs=2.5)


def test_other_drives_keep_their_distances() -> None:
    drives = [drive(name, 8.0, 40.0, 30.0, facts) for name, facts in (("a", RecordFacts()), ("bb", EXTRACTED))]
    for one, (given, _) in zip(records_of(drives), drives, strict=True):
        assert one.distance_m is given.distance_m or (one.distance_m == given.distance_m).all()


def test_drives_by_the_road_and_by_the_receiver_are_laid_on_one_distance() -> None:
    """One was matched to a measured line, which counts from elsewhere; the other counts from its own start."""
    (by_road, name), other = (drive(name, speed, starts, 60.0, EXTRACTED) for name, speed, starts in
                              (("a", 11.0, 0.0), ("bb", 8.0, 40.0)))
    by_road = replace(by_road, distance_m=by_road.distance_m + 300.0, facts=replace(EXTRACTED, places_by=BY_ROAD))
    found = records_of([(by_road, name), other])
    assert {one.facts.places_by for one in found} == {BY_RECEIVER}
    moved = other[0].speed_mps > 0
    assert found[0].distance_m[0] == pytest.approx(300.0, abs=0.5)
    assert found[1].distance_m == pytest.approx(340.0 + other[0].distance_m[moved], abs=2.5)


def test_a_drive_that_goes_elsewhere_is_refused() -> None:
    (here, _), (there, _) = (drive(name, 8.0, 0.0, 30.0, EXTRACTED) for name in ("a", "bb"))
    assert there.lat_deg is not None
    with pytest.raises(BadInput, match="expected a drive over the road of"):
        records_of([(here, "a"), (replace(there, lat_deg=there.lat_deg + 0.1), "bb")])
