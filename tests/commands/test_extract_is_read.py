"""Whatever ``extract`` writes the lab reads: recordings with holes, stands, late reads, lost fixes and a clock that is
set, as simulated bytes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from drivers.readings import GPS, Event
from logger.shipped import vehicle_file
from logger.store.formats.drive_file import read_drive
from logger.store.formats.vehicle_file import read_vehicle

from ..support.command import called
from ..support.drives.simulated_drive import DemoDrive, DrivePlan, Reception, RoadStretch, record, simulate_drive

LASTS_S = 75.0
PLAN = DrivePlan(
    speed_knots=((0, 0), (3, 0), (10, 12), (24, 12), (30, 0), (38, 0), (44, 13), (66, 13), (71, 0), (75, 0)),
    stretches=(RoadStretch(800, 90),), reception=Reception(first_fix_s=1.0), seed=5)


@cache
def drive(start_utc: str = PLAN.start_utc, sensor: str = PLAN.sensor, rate_hz: int = 100) -> DemoDrive:
    plan = replace(PLAN, start_utc=start_utc, sensor=sensor, rate_hz=rate_hz)
    return simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009")))


def damaged(seen: DemoDrive, set_to: DemoDrive, holes: list[tuple[float, float]], late_us: list[int],
            lost: list[tuple[float, float]], set_s: float | None) -> list[Event]:
    """The events without the readings in ``holes`` (begin, length) and the sentences while ``lost``; after each hole
    the readings are so much later; from ``set_s`` on the receiver's clock is that of another drive."""
    source = next(event.source for event in seen.events if event.source != GPS)
    kept = []
    for event in [one for one in seen.events if one.source == source]:
        at_s = (event.t_us - seen.start_us) / 1e6
        if not any(begin <= at_s < begin + length for begin, length in holes):
            after = [late for (begin, _), late in zip(holes, late_us, strict=True) if at_s >= begin]
            kept.append(event._replace(t_us=event.t_us + after[-1]) if after else event)
    for one, begin_s, end_s in ((seen, -1.0, set_s if set_s is not None else 1e9), (set_to, set_s or 1e9, 1e9)):
        kept += [event for event in one.events if event.source == GPS
                 and begin_s <= (event.t_us - one.start_us) / 1e6 < end_s
                 and not any(begin <= (event.t_us - one.start_us) / 1e6 < begin + length for begin, length in lost)]
    return sorted(kept, key=lambda event: event.t_us)


def check(folder: Path) -> None:
    """The run is read by what reads runs, on a grid, at the car's own places."""
    found = read_drive(folder / "drive.csv")
    table = np.genfromtxt(folder / "drive.csv", delimiter=",", names=True)
    grid_s = table["t_s"][0] + np.arange(len(table)) / 100.0
    length_s = table["t_s"][-1] - table["t_s"][0]
    assert found.rate_hz == pytest.approx(100.0, rel=1e-6 / min(length_s, 1.0))  # both ends are written to 1 us
    assert np.abs(table["t_s"] - grid_s).max() < 1e-5
    assert (np.diff(table["distance_m"]) >= 0).all()
    assert np.isin(table["usable"], (0, 1, 2)).all()


SPANS = st.lists(st.tuples(st.floats(2.0, 70.0), st.floats(0.015, 1.2)), max_size=6)


@pytest.mark.slow
@settings(max_examples=12, deadline=None, suppress_health_check=list(HealthCheck))
@given(holes=SPANS, lates=st.lists(st.integers(0, 9_900), min_size=6, max_size=6),
       lost=st.lists(st.tuples(st.floats(5.0, 65.0), st.floats(0.5, 6.0)), max_size=2),
       set_s=st.none() | st.floats(10.0, 60.0), start_us=st.sampled_from([0, 41_300_000, 11_000_000_905_000]),
       sensor=st.sampled_from([(PLAN.sensor, 100), ("lines", 100), ("lines", 208)]))
@example(holes=[(33.0, 0.2)], lates=[2700, 0, 0, 0, 0, 0], lost=[], set_s=None, start_us=0, sensor=(PLAN.sensor, 100))
@example(holes=[(33.0, 0.2), (50.0, 0.495)], lates=[5000, 3400, 0, 0, 0, 0], lost=[], set_s=40.0,
         start_us=11_000_000_905_000, sensor=(PLAN.sensor, 100))
def test_whatever_is_extracted_is_read(
        tmp_path_factory: pytest.TempPathFactory, holes: list[tuple[float, float]], lates: list[int],
        lost: list[tuple[float, float]], set_s: float | None, start_us: int, sensor: tuple[str, int]) -> None:
    place = tmp_path_factory.mktemp("run")
    seen, set_to = drive(PLAN.start_utc, *sensor), drive("2026-06-09T15:00:00+00:00", *sensor)
    events = damaged(seen, set_to, sorted(holes), lates[: len(holes)], lost, set_s)
    record(replace(seen, events=[one._replace(t_us=one.t_us - seen.start_us + start_us) for one in events]),
           place / "town.dump.gz")
    done = called("extract", place / "town.dump.gz", "--out", place / "runs")
    assert done.returncode == 0, done.stderr
    runs = sorted((place / "runs").iterdir())
    assert runs
    for run in runs:
        check(run)


def test_a_hole_in_a_stand_after_which_the_reads_are_late(tmp_path: Path) -> None:
    """The lab refused such a run: "expected samples evenly 0.01 s apart, found a step of 0.0127 s"."""
    events = damaged(drive(), drive(), [(33.0, 0.2)], [2700], [], None)
    record(replace(drive(), events=events), tmp_path / "town.dump")
    done = called("extract", tmp_path / "town.dump", "--out", tmp_path / "runs")
    assert done.returncode == 0, done.stderr
    check(tmp_path / "runs" / "town")
    table = np.genfromtxt(tmp_path / "runs" / "town" / "drive.csv", delimiter=",", names=True)
    assert 15 <= np.count_nonzero(table["usable"] == 0) <= 25
    motion = drive().motion
    late_s = np.where(table["t_s"] > drive().start_us / 1e6 + 33.1, 0.0027, 0.0)
    true_m = np.interp(table["t_s"] - drive().start_us / 1e6 + late_s, motion.time_s, motion.distance_m)
    off_m = (table["distance_m"] - true_m)[table["speed_mps"] > 2]
    assert np.ptp(off_m) < 1.5  # of a receiver's drive, as without the hole
