"""How long a row waits before it is written, which is what a power cut costs: with fixes, and around a loss of them."""

from __future__ import annotations

from math import inf
from pathlib import Path

import pytest

from logger.service.config import Config, GpsConfig
from logger.service.pipeline import FIX_DELAY_US, LONGEST_LAG_US, longest_wait_us
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import US_PER_S

from ..support.drives.replay import core_for
from ..support.drives.simulated_drive import DrivePlan, Reception, RoadStretch, simulate_drive

ROOT = Path(__file__).resolve().parents[2]


def latest_s(lost: tuple[float, float], first_fix_s: float = 0.0, bridge_s: float = 10.0) -> float:
    """The longest time from the end of a window to its row [s], in a drive of a minute and a half at 12 m/s."""
    reception = Reception(first_fix_s=first_fix_s, lost=(lost,))
    plan = DrivePlan(speed_knots=((0, 0), (5, 0), (12, 12), (90, 12)), stretches=(RoadStretch(1200, 60),), seed=7,
                     reception=reception)
    drive = simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009")))
    core, rows = core_for(drive.header, Config(gps=GpsConfig(bridge_s=bridge_s)))
    seen, latest = 0, -inf
    for event in drive.events:
        core.feed(event)
        for record in rows.records[seen:]:
            latest = max(latest, (event.t_us - record.t_us) / US_PER_S - record.duration_s)
        seen = len(rows.records)
    assert seen > 40
    return latest


@pytest.mark.slow
def test_with_fixes_a_row_waits_for_the_estimator_alone() -> None:
    assert 4 < latest_s((0, 0)) <= LONGEST_LAG_US / US_PER_S


@pytest.mark.slow
@pytest.mark.parametrize(("lost", "first_fix_s", "bridge_s"), [
    ((40, 49), 0.0, 10.0), ((40, 70), 0.0, 10.0), ((0, 0), 30.0, 10.0), ((20, 78), 0.0, 60.0)],
    ids=["loss of 9 s", "tunnel", "late first fix", "loss of 58 s, bridged"])
def test_around_a_loss_of_fix_it_waits_as_long_as_is_promised(
        lost: tuple[float, float], first_fix_s: float, bridge_s: float) -> None:
    latest = latest_s(lost, first_fix_s, bridge_s)
    assert 11 < latest <= longest_wait_us(bridge_s) / US_PER_S


def test_the_documents_say_so() -> None:
    added_s = (FIX_DELAY_US + LONGEST_LAG_US) // US_PER_S
    sync_s = round(Config().log.sync_s)
    words = f"`bridge_s` + {added_s + sync_s} s ({GpsConfig().bridge_s + added_s + sync_s:.0f} s"
    assert words in " ".join((ROOT / "docs" / "faults.md").read_text().split())
