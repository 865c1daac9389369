"""Register fields, against bit arithmetic done by hand."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.chip_bus import Register, RegisterField, ToggleRegister
from drivers.errors import BadReply, SettingsError

SOME = Register("some", 0x22, 0x00, {"middle": (5, 3), "top": (7, 7)})
MIDDLE = SOME.field("middle")


class Bytes:
    """A bus with one chip that is nothing but memory; ``forced`` bits read as they are, whatever was written."""

    def __init__(self, value: int = 0, forced: int = 0) -> None:
        self.value = value
        self.forced = forced
        self.writes: list[tuple[int, int, int]] = []

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        return self.value | self.forced

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        self.writes.append((i2c_addr, register, value))
        self.value = value

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        raise AssertionError("registers are read one at a time")

    def close(self) -> None: ...


def test_a_field_takes_its_bits_and_no_others() -> None:
    assert MIDDLE.mask == 0b0011_1000
    assert MIDDLE.largest == 7
    assert MIDDLE.extract(0b1010_1101) == 0b101
    assert MIDDLE.insert(0b1111_1111, 0b010) == 0b1101_0111


@settings(max_examples=100)
@given(byte=st.integers(0, 255), value=st.integers(-300, 300), low=st.integers(0, 7), more=st.integers(0, 7))
def test_any_field_of_any_byte(byte: int, value: int, low: int, more: int) -> None:
    field = RegisterField("any", min(7, low + more), low)
    if not 0 <= value < 2 ** (field.high_bit - low + 1):
        with pytest.raises(SettingsError, match="any takes 0 to"):
            field.insert(byte, value)
        return
    changed = field.insert(byte, value)
    bits = [byte >> place & 1 for place in range(8)]
    bits[low:field.high_bit + 1] = [value >> place & 1 for place in range(field.high_bit - low + 1)]
    assert changed == sum(bit << place for place, bit in enumerate(bits))
    assert field.extract(changed) == value


def test_a_field_lies_inside_a_byte() -> None:
    for high, low in ((8, 0), (3, 4), (2, -1)):
        with pytest.raises(ValueError, match="not inside a byte"):
            RegisterField("wrong", high, low)


def test_update_leaves_the_other_bits_as_they_were() -> None:
    bus = Bytes(0b0100_0110)
    SOME.update(bus, 0x0A, {"middle": 0b101, "top": 1})
    assert bus.writes == [(0x0A, 0x22, 0b1110_1110)]


def test_update_notices_a_bit_that_was_not_taken() -> None:
    with pytest.raises(BadReply, match=r"register 0x22 \(some\) of the chip at 0x0A: middle reads 7, expected 5"):
        SOME.update(Bytes(forced=0b0001_0000), 0x0A, {"middle": 0b101})


def test_a_value_that_does_not_fit_writes_nothing() -> None:
    bus = Bytes()
    with pytest.raises(SettingsError):
        SOME.update(bus, 0x0A, {"top": 1, "middle": 8})
    assert bus.writes == []


def test_a_toggle_tells_what_the_chip_does_now_and_cannot_be_read_plainly() -> None:
    toggle = ToggleRegister("suspend", 0x30)
    assert toggle.flip(Bytes(0xFF), 0x0A) is True
    assert toggle.flip(Bytes(0x00), 0x0A) is False
    with pytest.raises(BadReply, match="answered 0x7F, expected 0x00 or 0xFF"):
        toggle.flip(Bytes(0x7F), 0x0A)
    assert not hasattr(toggle, "read")
