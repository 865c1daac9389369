"""The rows of a simulated drive against its truth: where, when, how fast, how rough, how it felt."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from drivers.accelerometers.bma220 import Bma220Decoder
from logger.dsp.resample import GridResampler
from logger.dsp.weightings.wk import WEIGHTING
from logger.geodesy import EARTH_RADIUS_M
from logger.records import WindowRecord
from logger.service.config import Config, GpsConfig
from logger.shipped import vehicle_file

from ..support.drives.replay import rows_of
from ..support.drives.simulated_drive import DemoDrive

CONFIG = Config(gps=GpsConfig(latency_s=0.15), vehicle=vehicle_file("rav4-2009"))


@pytest.fixture(scope="module")
def records(short_drive: DemoDrive) -> list[WindowRecord]:
    return rows_of(short_drive.header, short_drive.events, CONFIG).records


@pytest.fixture(scope="module")
def placed(records: list[WindowRecord]) -> list[WindowRecord]:
    return [record for record in records if record.distance_start_m is not None]


def at(drive: DemoDrive, record: WindowRecord, offset_s: float) -> int:
    """Index of the motion's grid at an instant of a record's window."""
    return int(np.searchsorted(drive.motion.time_s, (record.t_us - drive.start_us) / 1e6 + offset_s))


def test_windows_follow_one_another_without_hole(placed: list[WindowRecord]) -> None:
    for before, after in pairwise(placed):
        assert before.distance_end_m == after.distance_start_m
        assert before.t_us < after.t_us


def test_distance_is_that_of_the_car(short_drive: DemoDrive, placed: list[WindowRecord]) -> None:
    first, last = placed[0], placed[-1]
    motion = short_drive.motion
    true_m = motion.distance_m[at(short_drive, last, 0)] - motion.distance_m[at(short_drive, first, 0)]
    assert last.distance_start_m is not None
    assert first.distance_start_m is not None
    assert abs(last.distance_start_m - first.distance_start_m - true_m) < 0.01 * true_m


def test_places_are_within_the_receivers_error(short_drive: DemoDrive, placed: list[WindowRecord]) -> None:
    errors_m = []
    for record in placed:
        assert record.lat_deg is not None
        assert record.lon_deg is not None
        if set(record.flags) & {"stationary", "gps_lost"}:
            continue
        i = at(short_drive, record, record.duration_s / 2)
        north = np.radians(record.lat_deg - short_drive.motion.lat_deg[i]) * EARTH_RADIUS_M
        east = np.radians(record.lon_deg - short_drive.motion.lon_deg[i]) * EARTH_RADIUS_M * np.cos(np.radians(39))
        errors_m.append((north, east))
    error_m = np.array(errors_m)
    # The receiver is off by a metre or two for minutes; what the logger adds to that is seen from window to window.
    assert np.hypot(*error_m.mean(axis=0)) < 3.0
    assert np.hypot(*error_m.std(axis=0)) < 0.7


def test_utc_is_that_of_the_receiver(short_drive: DemoDrive, records: list[WindowRecord]) -> None:
    for record in records:
        if record.utc_us is not None:
            assert abs(record.utc_us - record.t_us - short_drive.utc_offset_us) < 30_000


def test_standing_makes_no_window_and_lost_fixes_are_said(short_drive: DemoDrive, placed: list[WindowRecord]) -> None:
    standing_s = (37.0, 40.5)
    for record in placed:
        begin_s = (record.t_us - short_drive.start_us) / 1e6
        assert not standing_s[0] < begin_s < standing_s[1]
    lost = [record for record in placed if 20.2 < (record.t_us - short_drive.start_us) / 1e6 < 22.8]
    assert lost
    assert all("gps_lost" in record.flags for record in lost)


def test_iri_is_within_its_own_error(short_drive: DemoDrive, placed: list[WindowRecord]) -> None:
    inside = []
    for record in placed:
        if record.iri_m_per_km is None or record.flags or record.iri_std_m_per_km is None:
            continue
        begin, end = at(short_drive, record, 0), at(short_drive, record, record.duration_s)
        edges_m = short_drive.motion.distance_m[[begin, end]]
        exact = float(short_drive.road.iri(edges_m)[0])
        inside.append(abs(record.iri_m_per_km - exact) < 2.0 * record.iri_std_m_per_km)
    assert len(inside) > 30
    assert np.mean(inside) > 0.85


def test_comfort_is_that_of_the_exact_weighting_of_the_same_samples(
    short_drive: DemoDrive, placed: list[WindowRecord]
) -> None:
    """Raw a_w, VDV and MTVV within 2 %, against the analog formula applied to the whole record by FFT."""
    events = [event for event in short_drive.events if event.source == "bma220"]
    decoder = Bma220Decoder(2)
    for event in events:
        decoder.feed(event.t_us, event.data)
    block = decoder.take()
    resampler = GridResampler(100)
    runs = resampler.push(block.t_us, block.accel_mps2[:, 2], block.clipped) + resampler.flush()
    values = np.concatenate([run.values for run in runs])
    values -= values.mean()
    grid_us = runs[0].t0_us + 10_000 * np.arange(len(values))
    count = 1 << int(np.ceil(np.log2(2 * len(values))))
    f_hz = np.fft.rfftfreq(count, 0.01)
    response = np.zeros(len(f_hz), dtype=complex)
    response[1:] = WEIGHTING.response(f_hz[1:])
    exact = np.fft.irfft(np.fft.rfft(values, count) * response, count)[: len(values)]
    squares = np.concatenate([np.zeros(100), exact**2])
    running = np.sqrt(np.convolve(squares, np.ones(100) / 100, mode="valid")[1:])
    worst = {"a_w": 0.0, "vdv": 0.0, "mtvv": 0.0}
    compared = 0
    for record in placed:
        if "stationary" in record.flags or record.a_w_raw_mps2 is None:
            continue
        assert record.vdv_raw_mps175 is not None
        assert record.mtvv_raw_mps2 is not None
        low = int(np.searchsorted(grid_us, record.t_us - 5000))
        high = low + round(record.duration_s * 100)
        if high > len(exact) - 50 or low < 1000:
            continue
        part = exact[low:high]
        pairs = {
            "a_w": (record.a_w_raw_mps2, np.sqrt(np.mean(part**2))),
            "vdv": (record.vdv_raw_mps175, (np.sum(part**4) * 0.01) ** 0.25),
            "mtvv": (record.mtvv_raw_mps2, running[low:high].max()),
        }
        for name, (ours, theirs) in pairs.items():
            worst[name] = max(worst[name], abs(ours / theirs - 1))
        compared += 1
    print("worst deviations from the exact weighting:", {name: f"{100 * value:.2f} %" for name, value in worst.items()})
    assert compared > 40
    assert max(worst.values()) < 0.02, worst


@pytest.mark.slow
def test_the_15_hz_low_pass_is_a_setting(short_drive: DemoDrive, records: list[WindowRecord]) -> None:
    config = replace(CONFIG, pipeline=replace(CONFIG.pipeline, low_pass_hz=15.0))
    passed = rows_of(short_drive.header, short_drive.events, config).records
    assert len(passed) == len(records)
    before = [record.accel_rms_mps2 for record in records if record.accel_rms_mps2 is not None]
    after = [record.accel_rms_mps2 for record in passed if record.accel_rms_mps2 is not None]
    assert np.mean(after) < 0.97 * np.mean(before)
    # The relation knows of the filter, so the IRI stays where it was.
    iri_before = np.array([record.iri_m_per_km for record in records if record.iri_m_per_km is not None])
    iri_after = np.array([record.iri_m_per_km for record in passed if record.iri_m_per_km is not None])
    assert abs(np.mean(iri_after) / np.mean(iri_before) - 1) < 0.1
