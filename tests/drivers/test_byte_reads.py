"""An adapter that cannot read blocks: three byte reads that agree with the three before them, or words."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable

import numpy as np
import pytest
import smbus2
from hypothesis import given, settings
from hypothesis import strategies as st
from smbus2 import I2cFunc

from drivers.accelerometers.bma220 import REGISTER_STEP, Bma220, Bma220Chip, Bma220Config, mps2_per_count
from drivers.errors import BadReply, NotPresent
from drivers.hardware import open_i2c

from ..support.recorded_wires import RecordedBus

BYTES = I2cFunc.SMBUS_READ_BYTE_DATA | I2cFunc.SMBUS_WRITE_BYTE_DATA
Sample = tuple[int, int, int]


def opened(monkeypatch: pytest.MonkeyPatch, functions: int, chip: RecordedBus | None = None) -> Callable[[], object]:
    """Opens a bus whose adapter has these functions."""
    bus = chip or RecordedBus(Bma220Chip())

    def opens(self: smbus2.SMBus, number: int) -> None:
        self.funcs = I2cFunc(functions)

    monkeypatch.setattr(smbus2.SMBus, "open", opens)
    monkeypatch.setattr(smbus2.SMBus, "read_byte_data", lambda self, *a, **k: bus.read_byte_data(*a))
    monkeypatch.setattr(smbus2.SMBus, "write_byte_data", lambda self, *a, **k: bus.write_byte_data(*a))
    monkeypatch.setattr(smbus2.SMBus, "read_i2c_block_data", lambda self, *a, **k: bus.read_i2c_block_data(*a))
    return lambda: open_i2c(1, REGISTER_STEP)


class Renewing(RecordedBus):
    """A chip that has another sample after every so many byte reads of its data registers."""

    def __init__(self, samples: list[Sample], every: int, first: int) -> None:
        super().__init__(Bma220Chip())
        self._samples = samples
        self._every = every
        self._read = first
        self.data_reads = 0
        self.blocks = 0

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        if register not in (0x04, 0x06, 0x08):
            return super().read_byte_data(i2c_addr, register)
        self.data_reads += 1
        sample = self._samples[self._read // self._every % len(self._samples)]
        self._read += 1
        return sample[(register - 4) // 2]

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        self.blocks += 1
        raise OSError(errno.EOPNOTSUPP, os.strerror(errno.EOPNOTSUPP))


samples = st.lists(st.tuples(*[st.sampled_from([0, 4, 8, 252, 64, 68])] * 3), min_size=1, max_size=12)


@pytest.mark.slow
@settings(max_examples=400)
@given(samples, st.integers(3, 30), st.integers(0, 40))
def test_a_sample_that_was_renewed_while_it_was_read_is_never_taken(
    taken: list[Sample], every: int, first: int
) -> None:
    with pytest.MonkeyPatch.context() as patch:
        bus = Renewing(taken, every, first)
        chip = Bma220(opened(patch, BYTES, bus)(), Bma220Config(oversample=1), lambda seconds: None)  # type: ignore[arg-type]
        chip.start()
        got = []
        for _ in range(20):
            try:
                got.append(tuple(chip.read_raw()))
            except BadReply as error:
                assert "changed" in str(error)
        assert set(got) <= set(taken)
        assert bus.blocks == 0
        assert bus.data_reads <= 20 * 12
        if every >= 12:
            assert len(got) == 20


def rough_road(milliseconds: int, seed: int = 3) -> list[Sample]:
    """Counts at +-2 g on a rough road, each millisecond: 1, 1 and 3 m/s2 of 0.5 to 15 Hz, and noise of 0.1 m/s2."""
    rng = np.random.default_rng(seed)
    frequency_hz = np.fft.rfftfreq(milliseconds, 1e-3)

    def band(rms: float, low_hz: float, high_hz: float) -> np.ndarray:
        spectrum = rng.normal(size=(2, len(frequency_hz))).T @ (1, 1j)
        signal = np.fft.irfft(spectrum * ((frequency_hz > low_hz) & (frequency_hz < high_hz)), milliseconds)
        return np.asarray(signal / signal.std() * rms)

    axes = [mean + band(rms, 0.5, 15) + band(0.1, 0.1, 60) for mean, rms in ((0, 1), (0, 1), (9.81, 3))]
    counts = np.clip(np.round(np.array(axes) / mps2_per_count(2)), -32, 31).astype(int)
    return [(int(x) * 4 % 256, int(y) * 4 % 256, int(z) * 4 % 256) for x, y, z in counts.T]


@pytest.mark.parametrize(("byte_ms", "lost_share"), [(0.5, 0.005), (0.75, 0.01), (1.0, 0.04)])
def test_few_readings_are_lost_on_a_rough_road(
    monkeypatch: pytest.MonkeyPatch, byte_ms: float, lost_share: float
) -> None:
    """A chip that renews its registers 1000 times a second, read 100 times a second through a slow adapter."""
    taken = rough_road(30_000)
    chip = RecordedBus(Bma220Chip())
    now_ms = 0.0

    def read(i2c_addr: int, register: int) -> int:
        nonlocal now_ms
        if register not in (0x04, 0x06, 0x08):
            return RecordedBus.read_byte_data(chip, i2c_addr, register)
        now_ms += byte_ms
        return taken[int(now_ms)][(register - 4) // 2]

    monkeypatch.setattr(chip, "read_byte_data", read)
    sensor = Bma220(opened(monkeypatch, BYTES, chip)(), Bma220Config(oversample=1), lambda seconds: None)  # type: ignore[arg-type]
    sensor.start()
    lost = 0
    for number in range(2900):
        now_ms = max(now_ms, 10.0 * number)
        try:
            sensor.read_raw()
        except BadReply:
            lost += 1
    print(f"{100 * lost / 2900:.1f} % of the readings are lost at {byte_ms} ms a byte")
    assert lost < lost_share * 2900


def test_an_adapter_with_block_reads_is_used_as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = RecordedBus(Bma220Chip())
    chip = Bma220(opened(monkeypatch, BYTES | I2cFunc.SMBUS_READ_I2C_BLOCK, bus)(), Bma220Config(oversample=1),  # type: ignore[arg-type]
                  lambda seconds: None)
    chip.start()
    bus.load(b"\x04\x08\x40")
    assert chip.read_raw() == b"\x04\x08\x40"


@pytest.mark.parametrize("functions", [0, I2cFunc.SMBUS_READ_I2C_BLOCK, I2cFunc.SMBUS_READ_BYTE_DATA,
                                       I2cFunc.SMBUS_WRITE_BYTE_DATA])
def test_an_adapter_without_byte_transfers_is_refused_in_words(
    monkeypatch: pytest.MonkeyPatch, functions: int
) -> None:
    with pytest.raises(NotPresent, match=r"/dev/i2c-1: .*cannot read and write registers.*another adapter"):
        opened(monkeypatch, functions)()


def test_a_fault_of_the_wire_passes_through(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = Renewing([(0, 0, 64)], 100, 0)
    chip = Bma220(opened(monkeypatch, BYTES, bus)(), Bma220Config(oversample=1), lambda seconds: None)  # type: ignore[arg-type]
    chip.start()
    monkeypatch.setattr(bus, "read_byte_data", lambda *a: (_ for _ in ()).throw(OSError(errno.EREMOTEIO, "nack")))
    with pytest.raises(NotPresent, match="nothing answers"):
        chip.read_raw()
