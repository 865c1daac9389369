"""What a driver has to make of a device that behaves as its data sheet says. AssertionError where it does not.

The devices (``accelerometer_fakes``) share no code with the drivers, and recordings are read by their header alone.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from drivers.accelerometers import accelerometers
from drivers.dump import DumpWriter, open_dump
from drivers.readings import AccelerationBlock
from logger.service import wiring
from logger.service.config import Config
from logger.service.main_loop import Player

from .accelerometer_fakes import fakes
from .accelerometer_fakes.fake import Vector
from .accelerometer_ride import Ride, core_of
from .drives.replay import Rows

OUTSIDE = ("bandwidth_hz", "device")
"""Facts that a recording need not carry: its bytes are what they are."""
LATE_S = 2.0
"""Times of a buffered sensor are certain after 1.2 s, and the kernel is asked for its settings once a second."""
WORST_MPS2 = 0.15
"""R.m.s. difference that times which are off by 1 or 2 ms make of the signal below."""


def tilted(t_us: int) -> Vector:
    """Another signal along each axis, with gravity spread over all of them."""
    t_s = t_us / 1e6
    return np.array([2.0 + 3.0 * np.sin(4.4 * t_s), -4.0 + 3.0 * np.cos(7.0 * t_s),
                     8.0 + 3.0 * np.sin(11.0 * t_s) + 3.0 * np.sin(23.0 * t_s)])


def differences_mps2(ride: Ride, block: AccelerationBlock) -> Vector:
    """(n, 3) decoded less felt."""
    return np.asarray(block.accel_mps2 - np.array([ride.fake.accel(int(t_us)) for t_us in block.t_us]).reshape(-1, 3))


def worst_rms_mps2(step_mps2: float) -> float:
    """R.m.s. difference of right readings, rounding and timing together."""
    return 1.3 * step_mps2 / np.sqrt(12) + WORST_MPS2


def config_by_header(ride: Ride) -> Config:
    """Settings of a replay that has nothing but the recording."""
    return wiring.config_for_dump(wiring.dump_header(ride.config), None, None)


def data_sheet_examples_decode(name: str) -> None:
    """Bytes out of the data sheet have the accelerations that it says."""
    for example in fakes()[name].examples:
        decoder = accelerometers()[name].decoder(example.settings, 2)
        if example.first:
            decoder.feed(0, example.first)
        for number in range(1, 400):
            decoder.feed(number * example.interval_us, example.event)
        decoder.flush()
        block = decoder.take()
        assert len(block) > 300
        np.testing.assert_allclose(block.accel_mps2, np.tile(example.accel_mps2, (len(block), 1)), rtol=1e-9, atol=1e-9)
        assert (block.clipped == example.clipped).all()


def samples_are_what_it_felt(name: str, settings: Any, folder: Path) -> None:
    """Each sample is what the device felt at its time, at the rate that is said, flagged at the range's ends."""
    ride = Ride(name, folder, settings)
    sheet, begin_us = ride.fake.sheet, ride.begin_us

    def felt(t_us: int) -> Vector:
        jolt = 4_000_000 <= t_us - begin_us < 5_000_000
        return np.array([0.0, 1.2 * sheet.saturates_mps2, 0.0]) if jolt else tilted(t_us)

    ride.fake.accel = felt
    ride.drive(10)
    state = ride.fake.state
    config = config_by_header(ride)
    block = ride.samples(config)
    assert len(block) > 0
    since_s = (block.t_us - begin_us) / 1e6
    jolted, calm = (since_s > 4.1) & (since_s < 4.9), (since_s < 3.9) | (since_s > 5.1)
    assert block.clipped[jolted].all()
    assert not block.clipped[calm].any()
    assert (np.sqrt((differences_mps2(ride, block)[calm] ** 2).mean(axis=0)) < worst_rms_mps2(sheet.step_mps2)).all()
    readings = accelerometers()[name].readings(config.accelerometer.settings)
    rate_hz = 1e6 / np.median(np.diff(block.t_us))
    assert abs(rate_hz / sheet.rate_hz - 1) < 0.02
    assert abs((block.rate_hz or 100 * readings.oversample) / sheet.rate_hz - 1) < 0.02
    assert sheet.noise_mps2[0] <= readings.noise_mps2 <= sheet.noise_mps2[1]
    np.testing.assert_allclose(readings.step_mps2, sheet.step_mps2)
    facts = accelerometers()[name].facts(ride.fake.settings)
    if sheet.bandwidth_hz is not None:
        assert state["filter_hz"] == facts["bandwidth_hz"] == sheet.bandwidth_hz
    if sheet.step_mps2:
        np.testing.assert_allclose(facts["mps2_per_count"], sheet.step_mps2)


def recording_alone_gives_the_same_rows(name: str, settings: Any, folder: Path, seconds: float = 20) -> Rows:
    """A dump, replayed with nothing but what its first line says, gives the live service's rows."""
    driven = Ride(name, folder, settings).drive(seconds)
    live = driven.rows()
    path = folder / "drive.dump.gz"
    header = wiring.dump_header(driven.config)
    writer = DumpWriter(path, header)
    for event in driven.parked():
        writer.write(event)
    writer.close()
    with open_dump(path) as reader:
        assert reader.header == header
        config = wiring.config_for_dump(reader.header, None, None)
        core, rows = core_of(config)
        Player(core, 0.0, lambda _: None).play(reader)
    kind, before, after = driven.kind, driven.fake.settings, config.accelerometer.settings
    assert kind.readings(after) == kind.readings(before)
    stated = [{key: fact for key, fact in kind.facts(one).items() if key not in OUTSIDE} for one in (before, after)]
    assert stated[0] == stated[1]
    assert len(live.rows) > seconds
    assert rows.rows == live.rows
    return live


def lost_settings_are_noticed(name: str, settings: Any, folder: Path) -> None:
    """After a dip of its supply the device is set up again, and no sample is of another scale or rate."""
    ride = Ride(name, folder, settings)
    ride.fake.accel = tilted
    before = ride.drive(8).fake.state
    ride.fake.lose_settings()
    lost_us = ride.clock.now_us
    ride.drive(10)
    assert ride.fake.state == before
    block = ride.samples(config_by_header(ride))
    good = (block.t_us < lost_us - 1_000_000) | (block.t_us > lost_us + LATE_S * 1e6)
    assert np.count_nonzero(block.t_us > lost_us + 6_000_000) > 200
    assert np.abs(differences_mps2(ride, block)[good]).max() < 4 * worst_rms_mps2(ride.fake.sheet.step_mps2)
