"""The rows depend on the events alone: not on how bytes were cut, how often the loop woke, how fast it ran."""

from __future__ import annotations

import random
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.dump import Event
from logger.errors import BadInput
from logger.service.config import Config, GpsConfig, PipelineConfig
from logger.service.event_core import STEP_US
from logger.service.pipeline import Pipeline
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle

from ..support.drives.replay import Rows, core_for, rows_of
from ..support.drives.short_drive import SHORT_PLAN
from ..support.drives.simulated_drive import DemoDrive, simulate_drive
from ..support.faults.sensors import checked
from ..support.slow import slow


@pytest.fixture(scope="module")
def expected(short_rows: Rows) -> list[str]:
    return short_rows.rows


@pytest.fixture(scope="module")
def lines_drive() -> DemoDrive:
    plan = replace(SHORT_PLAN, sensor="lines", noise_mps2=0.03)
    return simulate_drive(plan, read_vehicle(vehicle_file("rav4-2009")))


@pytest.fixture(scope="module")
def lines_rows(lines_drive: DemoDrive) -> Rows:
    return rows_of(lines_drive.header, lines_drive.events)


def cut_anywhere(events: list[Event], seed: int) -> list[Event]:
    """The same bytes at the same times, the serial ones in smaller pieces."""
    rng = random.Random(seed)
    pieces = []
    for event in events:
        data = event.data
        while event.source != "bma220" and len(data) > 1 and rng.random() < 0.7:
            cut = rng.randrange(1, len(data))
            pieces.append(Event(event.t_us, event.source, data[:cut]))
            data = data[cut:]
        pieces.append(Event(event.t_us, event.source, data))
    return pieces


@pytest.mark.parametrize("date", ["31,12,9999", *slow("01,01,0001")])
def test_a_date_that_cannot_be_ends_nothing(short_drive: DemoDrive, expected: list[str], date: str) -> None:
    """At the end of time, at midnight: a second later there is no date any more."""
    nine = [(Event(event.t_us, "nmea", checked(f"GPZDA,235959.00,{date},00,00")
                   + checked("GPGGA,235959.00,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,")))
            for event in short_drive.events if event.source == "nmea"]
    events = [event for event in short_drive.events if event.source != "nmea"] + nine
    rows = rows_of(short_drive.header, sorted(events, key=lambda event: event.t_us)).records
    assert len(rows) > 10
    assert all(row.utc_us is None for row in rows)


def test_the_drive_makes_rows(expected: list[str]) -> None:
    assert len(expected) > 60
    assert expected[-1] == "close"


@pytest.mark.slow
@settings(max_examples=2)
@given(seed=st.integers(0, 1000))
def test_cutting_serial_chunks_anywhere_changes_nothing(short_drive: DemoDrive, expected: list[str], seed: int) -> None:
    assert rows_of(short_drive.header, cut_anywhere(short_drive.events, seed)).rows == expected


@pytest.mark.slow
@settings(max_examples=2)
@given(seed=st.integers(0, 1000))
def test_cutting_the_chunks_of_a_serial_sensor_changes_nothing(
    lines_drive: DemoDrive, lines_rows: Rows, seed: int
) -> None:
    assert rows_of(lines_drive.header, cut_anywhere(lines_drive.events, seed)).rows == lines_rows.rows


@pytest.mark.slow
@settings(max_examples=2)
@given(seed=st.integers(0, 1000))
def test_waking_at_any_time_changes_nothing(short_drive: DemoDrive, expected: list[str], seed: int) -> None:
    rng = random.Random(seed)
    core, rows = core_for(short_drive.header)
    last_us = short_drive.events[0].t_us
    for event in short_drive.events:
        if rng.random() < 0.05:
            core.advance(rng.randint(last_us, event.t_us))
        core.feed(event)
        last_us = event.t_us
    core.finish()
    assert rows.rows == expected


@pytest.mark.slow
@settings(max_examples=2)
@given(seed=st.integers(0, 1000))
def test_bursts_joined_as_a_slow_reader_gets_them_give_the_same_road(
    short_drive: DemoDrive, expected: list[str], seed: int
) -> None:
    """Chunks that are read late and together move the times of fixes a little, but make or lose nothing."""
    rng = random.Random(seed)
    events: list[Event] = []
    held = b""
    for event in short_drive.events:
        if event.source != "nmea":
            events.append(event)
            continue
        held += event.data
        if rng.random() < 0.6:
            events.append(event._replace(data=held))
            held = b""
    rows = rows_of(short_drive.header, events).rows
    assert abs(len(rows) - len(expected)) <= 8


def test_random_bytes_on_the_gps_line_make_no_place(short_drive: DemoDrive) -> None:
    rng = random.Random(9)
    events = [e if e.source != "nmea" else e._replace(data=rng.randbytes(len(e.data))) for e in short_drive.events]
    rows = rows_of(short_drive.header, events)
    assert rows.records
    assert all(record.lat_deg is None and record.distance_start_m is None for record in rows.records)
    assert all({"blind", "gps_lost", "time_unset"} <= set(record.flags) for record in rows.records)


def test_a_dead_accelerometer_leaves_places_without_figures(short_drive: DemoDrive) -> None:
    rows = rows_of(short_drive.header, [event for event in short_drive.events if event.source == "nmea"])
    placed = [record for record in rows.records if record.lat_deg is not None]
    assert len(placed) > 60
    assert all(record.a_w_mps2 is None and record.iri_m_per_km is None for record in placed)
    assert all("gap" in record.flags for record in placed)


@pytest.mark.slow
def test_bytes_of_another_accelerometer_are_passed_over(lines_drive: DemoDrive, lines_rows: Rows) -> None:
    """A recording that holds two of them: its header says which one its rows are made of."""
    serial = [event for event in lines_drive.events if event.source != "nmea"]
    foreign = [Event(event.t_us, "bma220", b"\x00\x00\x40") for event in serial]
    events = sorted([*lines_drive.events, *foreign], key=lambda event: event.t_us)
    core, rows = core_for(lines_drive.header)
    for event in events:
        core.feed(event)
    core.finish()
    assert rows.rows == lines_rows.rows
    assert core.bad_events == len(foreign)


def test_no_vehicle_of_that_name_is_refused(short_drive: DemoDrive) -> None:
    with pytest.raises(BadInput, match=r"expected --vehicle FILE\.yaml or one of"):
        core_for(replace(short_drive.header, vehicle="hovercraft"))


@pytest.mark.slow
def test_a_sensor_read_eight_times_as_fast_gives_the_same_road(expected: list[str]) -> None:
    """Oversampled and thinned: the windows are the same ones, the figures close, and jitter alone is no hole."""
    vehicle = read_vehicle(vehicle_file("rav4-2009"))
    slow = simulate_drive(replace(SHORT_PLAN, noise_mps2=0.05), vehicle)
    fast = simulate_drive(replace(SHORT_PLAN, noise_mps2=0.05, rate_hz=800), vehicle)
    header = replace(fast.header, accelerometer=fast.header.accelerometer | {"oversample": 8})
    records = {"slow": rows_of(slow.header, slow.events).records, "fast": rows_of(header, fast.events).records}
    a_w = {}
    for name, found in records.items():
        kept = [record for record in found if record.distance_start_m is not None and record.a_w_mps2 is not None]
        a_w[name] = {round(record.distance_start_m, 1): record.a_w_mps2 for record in kept}
        assert sum("gap" in record.flags for record in kept) <= 1
    common = sorted(a_w["slow"].keys() & a_w["fast"].keys())
    assert len(common) > 60
    ratio = [a_w["fast"][start] / a_w["slow"][start] for start in common]
    assert abs(np.median(ratio) - 1) < 0.05


@pytest.mark.slow
def test_a_serial_sensor_gives_the_same_road(short_rows: Rows, lines_rows: Rows) -> None:
    """Lines over a port, in bursts: as many windows, and the comfort of the noiseless record within a few per cent."""
    found = lines_rows.records
    kept = [record for record in found if record.distance_start_m is not None and record.a_w_mps2 is not None]
    chip = [record for record in short_rows.records if record.distance_start_m is not None]
    assert abs(len(kept) - len(chip)) <= 4
    assert sum("gap" in record.flags for record in kept) <= 1
    ours = np.sqrt(np.mean([record.a_w_mps2**2 for record in kept]))
    theirs = np.sqrt(np.mean([record.a_w_mps2**2 for record in chip if record.a_w_mps2 is not None]))
    assert abs(ours / theirs - 1) < 0.1


@pytest.mark.slow
def test_a_day_without_any_event_makes_no_rows_and_takes_no_time(short_drive: DemoDrive, short_rows: Rows) -> None:
    day_us = 86_400_000_000
    half = len(short_drive.events) // 2
    late = [event._replace(t_us=event.t_us + 300 * day_us) for event in short_drive.events[half:]]
    rows = rows_of(short_drive.header, [*short_drive.events[:half], *late])
    assert len(rows.records) <= len(short_rows.records) + 4
    assert "rotate" in rows.rows
    assert any(record.t_us > 300 * day_us and record.distance_start_m is not None for record in rows.records)


def with_outages(events: list[Event], seed: int) -> list[Event]:
    """The same drive with some outages of everything, of 1 to 119 s, some of which reach into others."""
    rng = random.Random(seed)
    kept, shift_us = [], 0
    outages_us = sorted(rng.randint(events[0].t_us, events[-1].t_us) for _ in range(rng.randint(1, 4)))
    for event in events:
        while outages_us and event.t_us >= outages_us[0]:
            outages_us.pop(0)
            shift_us += rng.choice((1_000_000, 4_000_000, 12_000_000, 14_000_000, 30_000_000, 119_000_000))
        kept.append(event._replace(t_us=event.t_us + shift_us))
    return kept


@pytest.mark.slow
@settings(max_examples=3)
@given(st.integers(0, 1000), st.sampled_from(["all", "nmea", "bma220"]), st.sampled_from([0, 10, 60]))
def test_time_in_which_nothing_is_heard_may_pass_in_one_step_or_in_many(
    short_drive: DemoDrive, seed: int, only: str, bridge_s: int
) -> None:
    events = [event for event in with_outages(short_drive.events, seed) if only in ("all", event.source)]
    config = replace(Config(), gps=replace(GpsConfig(), bridge_s=bridge_s), pipeline=PipelineConfig(drive_end_s=20))
    core, rows = core_for(short_drive.header, config)
    t_us = events[0].t_us
    for event in events:
        while t_us < event.t_us:
            core.advance(t_us)
            t_us += STEP_US // 2
        core.feed(event)
    core.finish()
    assert rows_of(short_drive.header, events, config).rows == rows.rows


@pytest.mark.parametrize("source", ["bma220", "nmea"])
def test_an_event_now_and_then_costs_little_time(
    source: str, short_drive: DemoDrive, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One each 119 s kept the pipeline stepping through all the time between, 238 times for each."""
    said = next(event.data for event in short_drive.events if event.source == source)
    core, _ = core_for(short_drive.header)
    steps = 0
    step = Pipeline.step

    def counted(*arguments: Any) -> Any:
        nonlocal steps
        steps += 1
        return step(*arguments)

    monkeypatch.setattr(Pipeline, "step", counted)
    for number in range(60):
        core.feed(Event(number * 119_000_000, source, said))
    core.finish()
    assert steps <= 40 * 60


@pytest.mark.parametrize(
    ("says", "word"),
    [
        ({"vertical_axis": "up"}, "vertical_axis"),
        ({"vertical_axis": 5}, "vertical_axis"),
        ({"oversample": 2.0}, "oversample"),
        ({"range_g": "2"}, "range_g"),
        ({"range_g": 3}, "range"),
    ],
)
def test_a_header_that_cannot_be_is_refused(short_drive: DemoDrive, says: dict[str, object], word: str) -> None:
    header = replace(short_drive.header, accelerometer=short_drive.header.accelerometer | says)
    with pytest.raises(BadInput, match=word):
        core_for(header)
