"""Recorded wires: they give what was recorded, when it was, and fail as real ones do, on cue."""

import errno
from collections.abc import Callable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.accelerometers.bma220 import Bma220, Bma220Chip, Bma220Config
from drivers.dump import Event
from drivers.errors import BadReply, DumpError, NotPresent, Timeout

from ..support.recorded_wires import Cue, Fault, RecordedBus, RecordedPort, WithoutWatchdog


class Clock:
    """Time that passes only when stepped, or slept."""

    def __init__(self, now_us: int = 0) -> None:
        self.now = now_us

    def now_us(self) -> int:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += round(seconds * 1e6)


def started(bus: RecordedBus) -> Bma220:
    bma220 = Bma220(bus, Bma220Config(oversample=1), lambda seconds: None)
    bma220.start()
    return bma220


def sample(number: int) -> bytes:
    return bytes((number % 64 * 4, 0, 64))


def events(source: str, *at: tuple[int, bytes]) -> list[Event]:
    return [Event(t_us, source, data) for t_us, data in at]


# ---- the bus, loaded

def test_a_loaded_sample_is_read_once_and_never_invented() -> None:
    bus = RecordedBus(Bma220Chip())
    bma220 = started(bus)
    for number in range(5):
        bus.load(sample(number))
        assert bma220.read_raw() == sample(number)
    with pytest.raises(NotPresent):
        bma220.read_raw()
    bus.load(sample(1))
    bus.load(sample(2))
    assert bma220.read_raw() == sample(2)


@pytest.mark.parametrize("data", [b"", b"\x04", b"\x04\x08", b"\x04\x08\x40\x00"])
def test_a_recorded_read_of_another_length_is_an_error_of_the_dump(data: bytes) -> None:
    with pytest.raises(DumpError, match="expected 3"):
        RecordedBus(Bma220Chip()).load(data)
    playing = RecordedBus.playing(Bma220Chip(), events("bma220", (0, data)), lambda: 0)
    bma220 = started(playing)
    with pytest.raises(DumpError, match="expected 3"):
        bma220.read_raw()


def test_no_one_answers_at_another_address() -> None:
    with pytest.raises(OSError) as caught:
        RecordedBus(Bma220Chip()).read_byte_data(0x0B, 0x00)
    assert caught.value.errno == errno.EREMOTEIO


def outcomes(bus: RecordedBus, bma220: Bma220, reads: int) -> list[str]:
    seen = []
    for number in range(reads):
        bus.load(sample(number))
        try:
            assert bma220.read_raw() == sample(number)
            seen.append("ok")
        except (NotPresent, Timeout, BadReply) as error:
            seen.append(type(error).__name__)
    return seen


@pytest.mark.parametrize(("fault", "name"), [
    (Fault.NACK, "NotPresent"), (Fault.TIMEOUT, "Timeout"), (Fault.BUSY, "NotPresent"),
])
def test_transfers_fail_on_cue_and_cost_their_own_samples_only(fault: Fault, name: str) -> None:
    bus = RecordedBus(Bma220Chip(), [Cue(fault, at_read=2, count=2)])
    assert outcomes(bus, started(bus), 6) == ["ok", "ok", name, name, "ok", "ok"]


def test_the_sample_of_a_failed_burst_is_lost() -> None:
    bus = RecordedBus(Bma220Chip(), [Cue(Fault.TIMEOUT, at_read=0)])
    bma220 = started(bus)
    bus.load(sample(1))
    with pytest.raises(Timeout):
        bma220.read_raw()
    with pytest.raises(NotPresent):
        bma220.read_raw()


def test_a_bus_held_low_is_freed_by_the_chips_watchdog() -> None:
    bus = RecordedBus(Bma220Chip(), [Cue(Fault.STUCK_LOW, at_read=1)])
    assert outcomes(bus, started(bus), 4) == ["ok", "Timeout", "ok", "ok"]


def test_without_the_watchdog_it_stays_low_until_the_power_goes() -> None:
    clock = Clock()
    bus = RecordedBus(WithoutWatchdog(), [Cue(Fault.STUCK_LOW, at_read=1), Cue(Fault.REPLUG, at_us=50)], clock.now_us)
    bma220 = started(bus)
    assert outcomes(bus, bma220, 4) == ["ok", "Timeout", "Timeout", "Timeout"]
    with pytest.raises(Timeout, match="held low"):
        bma220.start()
    clock.now = 50
    bma220.start()
    assert outcomes(bus, bma220, 2) == ["ok", "ok"]


def test_unplugged_and_back_the_chip_has_its_defaults() -> None:
    clock = Clock()
    cues = [Cue(Fault.UNPLUG, at_us=1_000), Cue(Fault.REPLUG, at_us=2_000)]
    bus = RecordedBus(Bma220Chip(), cues, clock.now_us)
    bma220 = started(bus)
    clock.now = 1_000
    assert outcomes(bus, bma220, 2) == ["NotPresent"] * 2
    with pytest.raises(NotPresent, match="0x0A or 0x0B"):
        bma220.start()
    clock.now = 2_000
    with pytest.raises(NotPresent):
        bma220.check_settings()  # the failed start has left it not started
    assert bus.read_byte_data(0x0A, 0x20) == 0
    bma220.start()
    bma220.check_settings()


def test_a_brown_out_is_silent_until_somebody_checks() -> None:
    bus = RecordedBus(Bma220Chip(), [Cue(Fault.BROWN_OUT, at_read=1)])
    bma220 = started(bus)
    assert outcomes(bus, bma220, 3) == ["ok"] * 3
    with pytest.raises(BadReply, match="lost its settings"):
        bma220.check_settings()


def test_the_chip_stands_in_for_unknown_registers_too() -> None:
    bus = RecordedBus(Bma220Chip())
    assert bus.read_i2c_block_data(0x0A, 0x00, 2) == [0xDD, 0x00]
    bus.write_byte_data(0x0A, 0x00, 0x11)
    assert bus.read_byte_data(0x0A, 0x00) == 0xDD
    assert bus.read_byte_data(0x0A, 0x30) == 0x00
    bus.load(sample(3))
    assert bus.read_i2c_block_data(0x0A, 0x04, 3) == [0, 0, 0]
    bus.write_byte_data(0x0A, 0x22, 1)
    assert bus.read_byte_data(0x0A, 0x22) == 0
    assert bus.read_byte_data(0x0A, 0x30) == 0xFF
    assert bus.read_i2c_block_data(0x0A, 0x04, 3) == list(sample(3))


# ---- the bus, playing

def test_a_playing_bus_gives_the_latest_sample_by_now() -> None:
    clock = Clock(7_000_000)
    recorded = events("bma220", *((500_000 + 10_000 * number, sample(number)) for number in range(5)))
    bus = RecordedBus.playing(Bma220Chip(), iter(recorded), clock.now_us)
    bma220 = started(bus)
    seen = []
    for wait_us in (0, 9_999, 1, 15_000, 5_000, 1_000_000):
        clock.now += wait_us
        seen.append(bma220.read_raw()[0] // 4)
    assert seen == [0, 0, 1, 2, 3, 4]
    assert bma220.read_raw()[0] // 4 == 4


def test_an_earlier_start_has_nothing_until_the_first_sample() -> None:
    clock = Clock(100)
    bus = RecordedBus.playing(Bma220Chip(), events("bma220", (50, sample(9))), clock.now_us, first_us=0)
    bma220 = started(bus)
    with pytest.raises(NotPresent):
        bma220.read_raw()
    clock.now += 50
    assert bma220.read_raw() == sample(9)


def test_cues_of_a_playing_bus_are_on_the_recordings_time() -> None:
    clock = Clock(9_000)
    recorded = events("bma220", (1_000, sample(1)), (2_000, sample(2)))
    bus = RecordedBus.playing(Bma220Chip(), recorded, clock.now_us, [Cue(Fault.NACK, at_us=2_000)])
    bma220 = started(bus)
    assert bma220.read_raw() == sample(1)
    clock.now += 1_000
    with pytest.raises(NotPresent):
        bma220.read_raw()
    assert bma220.read_raw() == sample(2)


# ---- the port

@settings(max_examples=60)
@given(chunks=st.lists(st.binary(max_size=20), max_size=20), sizes=st.lists(st.integers(1, 30), min_size=1, max_size=9))
def test_a_loaded_port_gives_every_byte_once_in_order(chunks: list[bytes], sizes: list[int]) -> None:
    port = RecordedPort()
    got = b""
    for number, chunk in enumerate(chunks):
        port.load(chunk)
        size = sizes[number % len(sizes)]
        data = port.read(size, 1.0)
        assert len(data) <= size
        got += data
    while data := port.read(7, 1.0):
        got += data
    assert got == b"".join(chunks)


def test_a_port_is_silent_or_short_on_cue_and_loses_nothing() -> None:
    port = RecordedPort([Cue(Fault.TIMEOUT, at_read=0, count=2), Cue(Fault.SHORT_READ, at_read=2, count=2)])
    port.load(b"abcdef")
    assert [port.read(10, 0.1) for _ in range(6)] == [b"", b"", b"a", b"b", b"cdef", b""]


def test_an_unplugged_port_has_gone_until_it_is_back_and_opened_again() -> None:
    clock = Clock()
    port = RecordedPort([Cue(Fault.UNPLUG, at_us=10), Cue(Fault.REPLUG, at_us=20)], clock.now_us)
    port.load(b"before")
    clock.now = 10
    for _ in range(2):
        with pytest.raises(OSError) as caught:
            port.read(10, 0.0)
        assert caught.value.errno == errno.EIO
        with pytest.raises(OSError):
            port.write(b"x")
        port.close()
    port.load(b"lost")
    clock.now = 20
    with pytest.raises(OSError):
        port.read(10, 0.0)
    port.close()
    assert port.read(10, 0.0) == b""
    port.load(b"after")
    assert port.read(10, 0.0) == b"after"
    assert port.write(b"hello") == 5
    assert bytes(port.written) == b"hello"


def test_a_playing_port_waits_for_the_first_byte_as_a_real_one_does() -> None:
    clock = Clock(123)
    recorded = events("nmea", (5_000, b"$GP"), (5_010, b"RMC"), (1_005_000, b"late"))
    port = RecordedPort.playing(recorded, clock.now_us, clock.sleep)
    assert port.read(100, 0.5) == b"$GP"
    assert clock.now == 123
    assert port.read(100, 0.5) == b"RMC"
    assert clock.now == 133
    assert port.read(100, 0.5) == b""
    assert clock.now == 500_133
    assert port.read(2, 0.5) == b"la"
    assert clock.now == 1_000_123
    assert port.read(2, 0.5) == b"te"
    assert port.read(2, 0.25) == b""
    assert clock.now == 1_250_123


def test_a_playing_port_can_start_before_its_first_bytes_and_be_unplugged_while_it_waits() -> None:
    clock = Clock()
    recorded = events("nmea", (100, b"a"), (300, b"b"), (500, b"c"))
    cues = [Cue(Fault.UNPLUG, at_us=300), Cue(Fault.REPLUG, at_us=400)]
    port = RecordedPort.playing(recorded, clock.now_us, clock.sleep, cues, first_us=0)
    assert port.read(10, 1.0) == b"a"
    assert clock.now == 100
    with pytest.raises(OSError):
        port.read(10, 1.0)
    clock.now = 450
    port.close()
    with pytest.raises(OSError):
        port.read(10, 1.0)
    port.close()
    assert port.read(10, 1.0) == b"c"


# ---- cues that cannot be

@pytest.mark.parametrize("make", [
    lambda: Cue(Fault.NACK),
    lambda: Cue(Fault.NACK, at_us=1, at_read=1),
    lambda: Cue(Fault.NACK, at_read=1, count=0),
    lambda: RecordedBus(Bma220Chip(), [Cue(Fault.SHORT_READ, at_read=0)]),
    lambda: RecordedPort([Cue(Fault.NACK, at_read=0)]),
    lambda: RecordedBus(Bma220Chip(), [Cue(Fault.NACK, at_us=0)]),
])
def test_a_cue_that_cannot_happen_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(ValueError):
        make()
