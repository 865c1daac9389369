"""The BMA220 driver against a register-level chip; register numbers here are copied by hand from the data sheet's
table (I2C column), not taken from the driver."""

import errno
import os
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.accelerometers.bma220 import Bma220, Bma220Chip, Bma220Config, Bma220Decoder, mps2_per_count
from drivers.errors import BadReply, DeviceError, NotPresent, SettingsError, Timeout, WrongDevice

from ..support.recorded_wires import RecordedBus

SUSPEND, SOFT_RESET = 0x30, 0x32
FILTER_BITS = {500: 1, 250: 2, 125: 3, 64: 4, 32: 5}
RANGE_BITS = {2: 0, 4: 1, 8: 2, 16: 3}


def no_sleep(seconds: float) -> None:
    """The simulated chip needs no time."""


def driver(bus: "RecordedBus | Wire", chosen: Bma220Config | None = None) -> Bma220:
    return Bma220(bus, chosen or Bma220Config(oversample=1), no_sleep)


class Wire:
    """A bus that writes down every transfer and lets the n-th of them fail, before or after the chip has seen it."""

    def __init__(self, bus: RecordedBus, failures: dict[int, tuple[int, bool]] | None = None) -> None:
        self.bus = bus
        self.failures = failures or {}
        self.log: list[tuple[str, int]] = []

    def _pass(self, kind: str, register: int, call: Callable[[], Any]) -> Any:
        number, seen_by_chip = self.failures.get(len(self.log), (0, True))
        self.log.append((kind, register))
        answer = call() if seen_by_chip else None
        if number:
            raise OSError(number, os.strerror(number))
        return answer

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        return self._pass("read", register, lambda: self.bus.read_byte_data(i2c_addr, register))

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        self._pass("write", register, lambda: self.bus.write_byte_data(i2c_addr, register, value))

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        return self._pass(
            "burst", register, lambda: self.bus.read_i2c_block_data(i2c_addr, register, length)
        )

    def close(self) -> None:
        self.bus.close()


def assert_runs_as_set(bus: RecordedBus, chosen: Bma220Config) -> None:
    chip = bus.chip
    assert not chip.suspended
    assert not chip.in_reset
    assert chip.registers[0x20] & 0x8F == FILTER_BITS[chosen.filter_hz]
    assert chip.registers[0x22] & 0x0F == RANGE_BITS[chosen.range_g]
    assert chip.registers[0x2E] & 0x06 == 0x06
    assert chip.registers[0x1E] & 0x47 == 0x07


# ---- settings

@pytest.mark.parametrize(("oversample", "bandwidth_hz"), [(1, 32), (2, 64), (4, 125), (7, 125), (8, 250)])
def test_the_filter_follows_the_sampling_rate(oversample: int, bandwidth_hz: int) -> None:
    assert Bma220Config(oversample=oversample).filter_hz == bandwidth_hz


@pytest.mark.parametrize("wrong", [
    {"range_g": 3}, {"range_g": "2"}, {"range_g": [2]}, {"bandwidth_hz": 100}, {"bandwidth_hz": 1000},
    {"bandwidth_hz": 1000, "oversample": 8}, {"bandwidth_hz": 125, "oversample": 1}, {"oversample": 0},
    {"oversample": 9},
    {"oversample": "x"},
])
def test_settings_that_the_chip_does_not_have_are_refused(wrong: dict) -> None:
    with pytest.raises(SettingsError):
        Bma220Config(**wrong)


# ---- start

def test_start_takes_the_documented_steps_and_touches_nothing_else(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO")
    wire = Wire(RecordedBus(Bma220Chip()))
    assert driver(wire).start() == 0x0A
    assert "BMA220 revision 0 runs at 0x0A, filter 32 Hz" in caplog.text
    assert_runs_as_set(wire.bus, Bma220Config(oversample=1))
    setting = [[("read", at), ("write", at), ("read", at)] for at in (0x2E, 0x22, 0x20, 0x1E)]
    toggles = [("read", SUSPEND)] * 2 + [("read", SOFT_RESET)] * 2
    assert wire.log == [("read", 0x00), ("read", 0x02), *toggles, *(step for steps in setting for step in steps)]


def test_start_waits_for_the_filter_to_settle() -> None:
    waits: list[float] = []
    Bma220(RecordedBus(Bma220Chip()), Bma220Config(oversample=1), waits.append).start()
    assert waits[-1] >= 1 / (2 * 32)
    assert waits[:-1] == [0.002] * 4


def test_the_second_address_is_found() -> None:
    bus = RecordedBus(Bma220Chip(), address=0x0B)
    bma220 = driver(bus)
    assert bma220.start() == 0x0B
    bus.load(bytes((4, 8, 252)))
    assert bma220.read_raw() == bytes((4, 8, 252))


@settings(max_examples=150)
@given(
    suspended=st.booleans(),
    in_reset=st.booleans(),
    registers=st.fixed_dictionaries({address: st.integers(0, 255) for address in (0x1E, 0x20, 0x22, 0x2E)}),
    range_g=st.sampled_from([2, 4, 8, 16]),
    oversample=st.integers(1, 8),
)
def test_any_state_of_the_chip_ends_in_one_that_runs_as_set(
    suspended: bool, in_reset: bool, registers: dict[int, int], range_g: int, oversample: int
) -> None:
    chosen = Bma220Config(range_g=range_g, oversample=oversample)
    bus = RecordedBus(Bma220Chip())
    bus.chip.suspended, bus.chip.in_reset = suspended, in_reset
    bus.chip.registers |= registers
    bma220 = driver(bus, chosen)
    bma220.start()
    assert_runs_as_set(bus, chosen)
    bma220.check_settings()


@pytest.mark.slow
@settings(max_examples=150)
@given(stuck=st.dictionaries(
    st.sampled_from([0x00, 0x02, 0x1E, 0x20, 0x22, 0x2E, SUSPEND, SOFT_RESET]), st.integers(0, 255), min_size=1
))
def test_a_broken_chip_is_a_documented_error_or_runs_as_set(stuck: dict[int, int]) -> None:
    bus = RecordedBus(Bma220Chip())
    bus.chip.stuck = stuck
    bma220 = driver(bus)
    try:
        bma220.start()
    except BadReply as error:
        assert "0x0A" in str(error)
        assert "\n" not in str(error)
        with pytest.raises(NotPresent):
            bma220.read_raw()
        return
    bma220.check_settings()


ERRNOS = st.sampled_from([errno.EREMOTEIO, errno.ENXIO, errno.ETIMEDOUT, errno.EBUSY, errno.EIO, errno.EAGAIN])


@settings(max_examples=200)
@given(
    failures=st.dictionaries(st.integers(0, 40), st.tuples(ERRNOS, st.booleans()), min_size=1, max_size=5),
    suspended=st.booleans(),
    in_reset=st.booleans(),
)
def test_failing_transfers_raise_device_errors_and_a_later_start_succeeds(
    failures: dict[int, tuple[int, bool]], suspended: bool, in_reset: bool
) -> None:
    wire = Wire(RecordedBus(Bma220Chip()), failures)
    wire.bus.chip.suspended, wire.bus.chip.in_reset = suspended, in_reset
    bma220 = driver(wire)
    for _ in range(len(failures) + 1):
        try:
            bma220.start()
        except DeviceError:
            continue
        break
    assert_runs_as_set(wire.bus, Bma220Config(oversample=1))
    wire.bus.load(b"\x04\x08\x40")
    wire.failures = {}
    assert bma220.read_raw() == b"\x04\x08\x40"


def test_a_failed_toggle_is_not_read_again() -> None:
    wire = Wire(RecordedBus(Bma220Chip()), {2: (errno.EIO, True)})
    with pytest.raises(BadReply):
        driver(wire).start()
    assert wire.log[-1] == ("read", SUSPEND)
    assert len(wire.log) == 3


# ---- errors distinguished

def failing(number: int) -> Wire:
    return Wire(RecordedBus(Bma220Chip()), dict.fromkeys(range(100), (number, False)))


@pytest.mark.parametrize(("number", "kind", "words"), [
    (errno.EREMOTEIO, NotPresent, r"nothing answers at I2C address 0x0A or 0x0B: .*power"),
    (errno.ENXIO, NotPresent, r"nothing answers at I2C address 0x0A or 0x0B: .*power"),
    (errno.ETIMEDOUT, Timeout, r"held low; check SDA"),
    (errno.EBUSY, NotPresent, r"a kernel driver owns I2C address 0x0A"),
    (errno.EIO, BadReply, r"transfer with 0x0A failed: .*Input/output error"),
])
def test_each_fault_of_the_bus_has_its_own_line(number: int, kind: type[DeviceError], words: str) -> None:
    with pytest.raises(kind, match=words) as caught:
        driver(failing(number)).start()
    assert type(caught.value) is kind
    assert "\n" not in str(caught.value)


def test_a_wrong_chip_is_named_with_its_id_and_place() -> None:
    bus = RecordedBus(Bma220Chip())
    bus.chip.stuck = {0x00: 0x55}
    with pytest.raises(WrongDevice, match=r"0x0A has id 0x55, a BMA220 has 0xDD"):
        driver(bus).start()


def test_a_held_bus_is_reported_at_once() -> None:
    wire = failing(errno.ETIMEDOUT)
    with pytest.raises(Timeout):
        driver(wire).start()
    assert len(wire.log) == 1


def test_reading_before_start_or_after_stop_is_refused() -> None:
    bus = RecordedBus(Bma220Chip())
    bma220 = driver(bus)
    for call in (bma220.read_raw, bma220.check_settings):
        with pytest.raises(NotPresent, match="not been started"):
            call()
    bma220.start()
    bma220.stop()
    assert bus.chip.suspended
    with pytest.raises(NotPresent):
        bma220.read_raw()
    bma220.stop()
    assert bus.chip.suspended


def test_stop_suspends_a_chip_that_was_already_suspended_and_never_raises() -> None:
    bus = RecordedBus(Bma220Chip())
    bma220 = driver(bus)
    bma220.start()
    bus.chip.suspended = True
    bma220.stop()
    assert bus.chip.suspended
    wire = Wire(RecordedBus(Bma220Chip()))
    other = driver(wire)
    other.start()
    wire.failures = dict.fromkeys(range(100), (errno.ETIMEDOUT, False))
    other.stop()


def test_a_dip_of_the_supply_shows_in_the_settings_and_a_start_mends_it() -> None:
    bus = RecordedBus(Bma220Chip())
    bma220 = driver(bus, Bma220Config(range_g=4, oversample=1))
    bma220.start()
    bma220.check_settings()
    bus.chip.lose_power()
    with pytest.raises(BadReply, match="lost its settings"):
        bma220.check_settings()
    bma220.start()
    bma220.check_settings()


def test_a_short_burst_is_a_bad_reply() -> None:
    bus = RecordedBus(Bma220Chip())
    bma220 = driver(bus)
    bma220.start()
    bus.chip.sample = lambda: b"\x04\x08"
    with pytest.raises(BadReply, match="3 bytes gave 2"):
        bma220.read_raw()


# ---- decoding

def by_hand(byte: int) -> int:
    """Six bits from the top: 32 to 63 stand for -32 to -1."""
    six_bits = byte // 4
    return six_bits - 64 if six_bits >= 32 else six_bits


@pytest.mark.parametrize(("range_g", "counts_per_g"), [(2, 16), (4, 8), (8, 4), (16, 2)])
def test_all_256_bytes_on_every_axis(range_g: int, counts_per_g: int) -> None:
    decoder = Bma220Decoder(range_g)
    for byte in range(256):
        decoder.feed(byte * 10_000, bytes((byte, (byte + 85) % 256, (byte + 170) % 256)))
    block = decoder.take()
    counts = [[by_hand((byte + 85 * axis) % 256) for axis in range(3)] for byte in range(256)]
    assert block.accel_mps2.dtype == np.float64
    np.testing.assert_allclose(block.accel_mps2, np.array(counts) / counts_per_g * 9.80665, rtol=1e-15)
    np.testing.assert_array_equal(block.t_us, np.arange(256) * 10_000)
    np.testing.assert_array_equal(block.clipped, [-32 in sample or 31 in sample for sample in counts])
    assert decoder.anomalies == sum(any((byte + 85 * axis) % 4 for axis in range(3)) for byte in range(256))


@settings(max_examples=100)
@given(data=st.lists(st.binary(min_size=3, max_size=3), max_size=40), cuts=st.sets(st.integers(0, 40)))
def test_blocks_of_any_size_give_the_same_samples_and_counts(data: list[bytes], cuts: set[int]) -> None:
    whole, parts = Bma220Decoder(2), Bma220Decoder(2)
    blocks = []
    for number, sample in enumerate(data):
        whole.feed(number, sample)
        parts.feed(number, sample)
        if number in cuts:
            blocks.append(parts.take())
    blocks.append(parts.take())
    once = whole.take()
    np.testing.assert_array_equal(np.concatenate([block.accel_mps2 for block in blocks]), once.accel_mps2)
    np.testing.assert_array_equal(np.concatenate([block.t_us for block in blocks]), once.t_us)
    np.testing.assert_array_equal(np.concatenate([block.clipped for block in blocks]), once.clipped)
    assert parts.anomalies == whole.anomalies == sum(any(byte & 3 for byte in sample) for sample in data)
    assert parts.repeats == whole.repeats == sum(a == b for a, b in pairwise(data))


def test_an_empty_block_has_the_right_shapes() -> None:
    block = Bma220Decoder(2).take()
    assert (block.t_us.shape, block.accel_mps2.shape, block.clipped.shape) == ((0,), (0, 3), (0,))
    assert (block.t_us.dtype, block.clipped.dtype) == (np.int64, np.bool_)


@settings(max_examples=30)
@given(data=st.binary(max_size=8).filter(lambda data: len(data) != 3))
def test_a_sample_of_another_length_is_refused_and_leaves_nothing(data: bytes) -> None:
    decoder = Bma220Decoder(2)
    with pytest.raises(BadReply, match="3 bytes"):
        decoder.feed(0, data)
    assert len(decoder.take()) == 0


def test_a_decoder_of_an_unknown_range_is_refused() -> None:
    with pytest.raises(SettingsError):
        Bma220Decoder(6)
    assert mps2_per_count(2) == pytest.approx(0.6129, abs=5e-5)  # the data sheet's table, rounded there
