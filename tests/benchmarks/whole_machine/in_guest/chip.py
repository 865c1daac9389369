"""Runs in the guest: the BMA220 behind a bus of the kernel's i2c-stub, which holds registers and nothing else.

Writes the samples of a recorded drive (made at +-2 g) into the data registers, 100 a second, at the scale that the
range register says, as the chip would. When the file BROWNOUT appears beside the recording the chip loses what it was
set to, once: filter and bus watchdog are those after a reset, and its range is 16 g, so that figures show it.
Started as ``chip.py DUMP BUS``; prints how many samples it wrote and how late the latest was, now and then.
"""

import sys
import time
from pathlib import Path

from smbus2 import SMBus

from drivers.dump import open_dump

ADDRESS = 0x0A
CHIP_ID, REVISION, DATA, AXES, FILTER, RANGE, WATCHDOG = 0x00, 0x02, 0x04, 0x1E, 0x20, 0x22, 0x2E
SUSPEND, SOFT_RESET = 0x30, 0x32
RESET_VALUES = {CHIP_ID: 0xDD, REVISION: 0x00, AXES: 0x07, FILTER: 0, RANGE: 0, WATCHDOG: 0, SUSPEND: 0xFF,
                SOFT_RESET: 0xFF}
RANGE_16G = 3


def main(dump: Path, number: int) -> None:
    """Play the drive once, from now."""
    bus = SMBus(number)
    for register, value in RESET_VALUES.items():
        bus.write_byte_data(ADDRESS, register, value)
    brownout = dump.with_name("BROWNOUT")
    began_s, first_us, worst_s, written = time.monotonic(), None, 0.0, 0
    with open_dump(dump) as reader:
        for event in reader:
            if event.source != "bma220":
                continue
            first_us = event.t_us if first_us is None else first_us
            wait_s = began_s + (event.t_us - first_us) / 1e6 - time.monotonic()
            if wait_s > 0:
                time.sleep(wait_s)
            worst_s = max(worst_s, -wait_s)
            shift = bus.read_byte_data(ADDRESS, RANGE) & 3
            bus.write_i2c_block_data(ADDRESS, DATA, [scaled(byte, shift) for byte in event.data])
            written += 1
            if written % 100 == 0 and brownout.exists():
                for register, value in ((FILTER, 0), (WATCHDOG, 0), (RANGE, RANGE_16G)):
                    bus.write_byte_data(ADDRESS, register, value)
                brownout.rename(brownout.with_name("BROWNOUT.done"))
                print(f"brown-out at {time.monotonic():.3f}", flush=True)
            if written % 6000 == 0:
                print(f"{written} samples, the latest {1e3 * worst_s:.0f} ms late", flush=True)


def scaled(byte: int, shift: int) -> int:
    """A left-justified six-bit count of +-2 g at the range of this code."""
    count = (byte >> 2) - (64 if byte & 0x80 else 0)
    return (round(count / (1 << shift)) & 0x3F) << 2


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
