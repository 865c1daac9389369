"""The ADXL345 driver against a chip with its FIFO: no sample twice, none lost unseen, times as the chip took them."""

from __future__ import annotations

import errno
from dataclasses import make_dataclass
from pathlib import Path

import numpy as np
import pytest

from drivers.accelerometers.adxl345 import ACCELEROMETER, Adxl345, Adxl345Config, Adxl345Decoder
from drivers.catalogue import CatalogueError
from drivers.errors import BadReply, DeviceError, NotPresent, SettingsError, SettingsLost, WrongDevice
from drivers.readings import AccelerationBlock, Event
from drivers.sources import ChipSource, Deadlines, Source

from ..support.accelerometer_fakes.adxl345 import FakeAdxl345
from ..support.accelerometer_fakes.fake import Clock
from ..support.slow import slow

RAMP_MPS2_PER_S = 0.5
COUNT_US = 9.80665 / 256 / RAMP_MPS2_PER_S * 1e6


@pytest.fixture
def fake(tmp_path: Path) -> FakeAdxl345:
    """A chip that feels a little more along Z every second, so that a reading names its time."""
    made = FakeAdxl345(tmp_path, Clock())
    begin_us = made.clock.now_us
    made.accel = lambda t_us: np.array([0.0, 0.0, RAMP_MPS2_PER_S * (t_us - begin_us) / 1e6])
    return made


def looked(fake: FakeAdxl345, seconds: float, source: Source | None = None, rate_hz: int = 200) -> list[Event]:
    """What its source gives in that time."""
    source = source or ACCELEROMETER.source(Adxl345Config(rate_hz=rate_hz), fake.machine())
    until_us = fake.clock.now_us + round(seconds * 1e6)
    source.open()
    events = []
    while fake.clock.now_us < until_us:
        events += source.poll()
        source.rest()
    return events + source.flush()


def decoded(events: list[Event], rate_hz: int = 200) -> tuple[AccelerationBlock, Adxl345Decoder]:
    decoder = Adxl345Decoder(rate_hz)
    for event in events:
        decoder.feed(event.t_us, event.data)
    decoder.flush()
    return decoder.take(), decoder


def late_us(fake: FakeAdxl345, block: AccelerationBlock, begin_us: int) -> np.ndarray:
    """How much later than the chip took it each sample is dated, to within what a count says."""
    taken_us = begin_us + block.accel_mps2[:, 2] / RAMP_MPS2_PER_S * 1e6
    return block.t_us - taken_us


@pytest.mark.parametrize(("rate_hz", "clock_error"), [
    (200, 0.0), (200, -0.013), (400, 0.035),
    *slow((200, 0.0001), (200, 0.035), (400, 0.0), (400, 0.0001), (400, -0.013),
          (800, 0.0), (800, 0.0001), (800, -0.013), (800, 0.035))])
def test_every_sample_comes_once_at_the_time_when_it_was_taken(
    fake: FakeAdxl345, rate_hz: int, clock_error: float
) -> None:
    fake.chip.clock_error = clock_error
    begin_us = fake.clock.now_us
    block, decoder = decoded(looked(fake, 30, rate_hz=rate_hz), rate_hz)
    assert 0 <= fake.chip.samples - len(block) <= 0.06 * rate_hz  # what is in the buffer at the end
    assert np.all(np.diff(block.accel_mps2[:, 2]) >= 0)
    assert block.rate_hz == pytest.approx(rate_hz * (1 + clock_error), rel=0.02)
    assert decoder.counts | {"samples": 0} == {"samples": 0, "overruns": 1, "lost": 0, "resyncs": 0, "undated": 0}
    assert decoder.doubt == ""
    late = late_us(fake, block, begin_us)
    steps = np.flatnonzero(np.diff(block.accel_mps2[:, 2])) + 1  # where a count says most about the time
    rounded_us = COUNT_US / 2 - 0.5e6 / rate_hz
    assert np.abs(late[steps] + rounded_us).max() < 0.5e6 / rate_hz + 4_000
    assert abs(np.median(late[steps]) + rounded_us) < 1_000


@pytest.mark.slow
def test_looks_in_step_with_the_chip_would_move_the_times(fake: FakeAdxl345) -> None:
    """Why looks are scattered: in step, the newest sample's age drifts, and jumps by an interval at its end."""
    fake.chip.clock_error = 0.0004
    begin_us = fake.clock.now_us
    in_step = ChipSource("adxl345", lambda: fake.bus, lambda bus: Adxl345(bus, 200, fake.clock.sleep), fake.clock,
                         Deadlines(50_000, fake.clock, fake.clock.sleep))
    spans_us = []
    for source in (in_step, None):
        block, _ = decoded(looked(fake, 120, source))
        late = late_us(fake, block, begin_us)[len(block) // 4:]
        spans_us.append(np.ptp(late[np.flatnonzero(np.diff(block.accel_mps2[len(block) // 4:, 2])) + 1]))
    assert spans_us[0] > spans_us[1] + 2_000


def test_an_overrun_is_a_gap_of_its_length(fake: FakeAdxl345) -> None:
    begin_us = fake.clock.now_us
    source = ACCELEROMETER.source(Adxl345Config(), fake.machine())
    source.open()
    events = []
    for look in range(600):
        events += source.poll()
        fake.clock.sleep(0.4 if look == 300 else 0.05)
    block, decoder = decoded(events + source.flush())
    assert fake.chip.lost > 40
    assert decoder.counts["overruns"] == 2  # and the start
    gaps_us = np.diff(block.t_us)
    assert np.flatnonzero(gaps_us > 20_000).size == 1
    assert gaps_us.max() == pytest.approx(5_000 * (fake.chip.lost + 1), abs=8_000)
    late = late_us(fake, block, begin_us)
    assert np.ptp(late) < 90_000 + 12_000  # a count, and the clock that settles


@pytest.mark.parametrize("number", [errno.EREMOTEIO, errno.ETIMEDOUT, errno.EIO])
@pytest.mark.parametrize("transfer", range(8))
def test_a_transfer_that_fails_loses_entries_but_not_unseen(fake: FakeAdxl345, number: int, transfer: int) -> None:
    chip = Adxl345(fake.bus, 200, fake.clock.sleep)
    chip.start()
    fake.clock.sleep(0.05)
    chip.read(fake.clock)
    fake.clock.sleep(0.05)
    fake.bus.failing = [0] * transfer + [number]
    with pytest.raises(DeviceError):
        chip.read(fake.clock)
    fake.clock.sleep(0.02)
    _, data = chip.read(fake.clock)
    assert bool(data[0] & 1) == (transfer >= 2)  # the first two only ask
    assert chip.read(fake.clock)[1][:1] in (b"", b"\x80")


def test_what_power_takes_away_is_noticed_and_nothing_from_after_it_is_given(fake: FakeAdxl345) -> None:
    source = ACCELEROMETER.source(Adxl345Config(), fake.machine())
    source.open()
    events = []
    for _ in range(40):
        events += source.poll()
        source.rest()
    lost_us = fake.clock.now_us
    fake.chip.lose_power(lost_us)
    with pytest.raises(SettingsLost, match=r"ADXL345 lost its settings.*register 0x"):
        for _ in range(40):
            events += source.poll()
            source.rest()
    assert fake.clock.now_us - lost_us < 1_000_000
    assert all(event.t_us <= lost_us for event in events)
    source.close()
    assert source.dropped > 0


def test_another_chip_or_none_is_refused(fake: FakeAdxl345) -> None:
    fake.replace_by_another()
    with pytest.raises(WrongDevice, match=fake.wrong):
        Adxl345(fake.bus, 200, fake.clock.sleep).start()
    fake.unplug()
    with pytest.raises(NotPresent, match="nothing answers at I2C address 0x53 or 0x1D"):
        Adxl345(fake.bus, 200, fake.clock.sleep).start()


def test_it_is_found_at_its_other_address_and_asks_for_a_bus_with_blocks(fake: FakeAdxl345) -> None:
    fake.address = 0x1D
    looked(fake, 0.1)
    assert fake.steps == [None]


def test_offsets_and_leftovers_from_before_do_not_stay(fake: FakeAdxl345) -> None:
    fake.chip.registers |= {0x1E: 5, 0x31: 0x8B, 0x2D: 0x28, 0x38: 0x9F}
    fake.chip.entries = [bytes(6)] * 20
    Adxl345(fake.bus, 200, fake.clock.sleep).start()
    assert fake.chip.registers[0x1E] == 0
    assert fake.chip.registers[0x31] & 0x8F == 0x0B
    assert len(fake.chip.entries) <= 2


@pytest.mark.parametrize("data", [b"", b"\x80", b"\x80\x01", b"\x80\x02" + bytes(6), b"\x80\x01" + bytes(7)])
def test_an_answer_that_cannot_be_is_refused(data: bytes) -> None:
    with pytest.raises(BadReply):
        Adxl345Decoder(200).feed(0, data)


def test_rates_that_the_chip_does_not_have_are_refused() -> None:
    with pytest.raises(SettingsError, match="rate_hz is one of 200, 400, 800, not 300"):
        Adxl345Config(rate_hz=300)


def test_a_setting_that_does_not_say_what_may_stand_there_is_refused() -> None:
    bare = make_dataclass("Bare", [("rate_hz", int, 200)], frozen=True)
    kind = type("Mine", (type(ACCELEROMETER),), {"name": "mine", "settings": bare})()
    with pytest.raises(CatalogueError, match=r"mine: expected .* made by setting, found rate_hz"):
        _ = kind.keys
