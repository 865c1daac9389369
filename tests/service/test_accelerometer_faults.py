"""Faults of a driver, planted one by one: what every accelerometer promises finds each of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.accelerometers import accelerometers, adxl345, bma220, iio
from drivers.chip_bus import ConfiguredChip
from drivers.readings import AccelerationBlock

from ..support.accelerometer_fakes import fakes
from ..support.accelerometer_promises import (
    data_sheet_examples_decode,
    lost_settings_are_noticed,
    recording_alone_gives_the_same_rows,
    samples_are_what_it_felt,
)

Patch = Callable[[pytest.MonkeyPatch, str], None]


def decoder_of(name: str) -> Any:
    """The class of an accelerometer's decoder."""
    kind = accelerometers()[name]
    return type(kind.decoder(kind.settings(), 2))


@dataclass(frozen=True)
class Fault:
    """What is planted, in whose driver, and what finds it; ``variant`` of the settings that it shows with."""

    name: str
    what: str
    plant: Patch
    found_by: Callable[..., Any]
    variant: int = 0


def decoded(change: Callable[[AccelerationBlock], AccelerationBlock]) -> Patch:
    """Samples come out changed."""
    def plant(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        take = decoder_of(name).take
        monkeypatch.setattr(decoder_of(name), "take", lambda self: change(take(self)))
    return plant


def fed(change: Callable[[bytes], bytes]) -> Patch:
    """Bytes are read in another way."""
    def plant(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        feed = decoder_of(name).feed
        monkeypatch.setattr(decoder_of(name), "feed", lambda self, t_us, data: feed(self, t_us, change(data)))
    return plant


def method(called: str, make: Callable[[Any], Any]) -> Patch:
    """A method of the offer is another one, made of the right one."""
    def plant(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
        kind = type(accelerometers()[name])
        monkeypatch.setattr(kind, called, make(getattr(kind, called)))
    return plant


def value(module: Any, called: str, wrong: Any) -> Patch:
    """A constant of the driver is another one."""
    return lambda monkeypatch, name: monkeypatch.setattr(module, called, wrong)


def nothing_checked(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """``check_next`` and ``check_settings`` look at nothing."""
    monkeypatch.setattr(ConfiguredChip, "check_next", lambda self: None)


def kernel_not_asked_again(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """The kernel's settings are looked at when it is opened, and never again."""
    monkeypatch.setattr(iio, "CHECK_US", 10**12)


REVERSED = decoded(lambda block: replace(block, accel_mps2=block.accel_mps2[:, ::-1]))
UPSIDE_DOWN = decoded(lambda block: replace(block, accel_mps2=-block.accel_mps2))
NEVER_CLIPPED = decoded(lambda block: replace(block, clipped=np.zeros(len(block), dtype=np.bool_)))
LATE = decoded(lambda block: replace(block, t_us=block.t_us + 50_000))
NOISE = method("readings", lambda right: lambda self, settings: replace(
    right(self, settings), noise_mps2=100 * right(self, settings).noise_mps2))
STEP = method("readings", lambda right: lambda self, settings: replace(right(self, settings), step_mps2=0.05))
NO_HEADER = method("header", lambda right: lambda self, settings: {})
HEADER_NOT_READ = method("recorded", lambda right: lambda self, header, settings, is_given: settings)
ONE_READING = method("readings", lambda right: lambda self, settings: replace(right(self, settings), oversample=1))

EVERYWHERE = [
    Fault(name, what, plant, found_by, variant)
    for name in accelerometers()
    for what, plant, found_by, variant in (
        ("axes in another order", REVERSED, samples_are_what_it_felt, 0),
        ("signs turned", UPSIDE_DOWN, data_sheet_examples_decode, 0),
        ("range ends not flagged", NEVER_CLIPPED, samples_are_what_it_felt, 0),
        ("times off by 50 ms", LATE, samples_are_what_it_felt, 0),
        ("noise 100 times too large", NOISE, samples_are_what_it_felt, 0),
        ("a step that is none", STEP, samples_are_what_it_felt, 0),
        ("header forgotten", NO_HEADER, recording_alone_gives_the_same_rows, 1),
        ("header not read back", HEADER_NOT_READ, recording_alone_gives_the_same_rows, 1),
    )
]
OWN = [
    Fault("bma220", "count in the lower six bits", fed(lambda data: bytes(byte >> 2 for byte in data)),
          data_sheet_examples_decode),
    Fault("bma220", "codes of two ranges exchanged", value(bma220, "RANGE_CODES", {2: 0, 4: 1, 8: 3, 16: 2}),
          samples_are_what_it_felt, 1),
    Fault("bma220", "codes of two filters exchanged", value(bma220, "FILTER_CODES", {
        1000: 0, 500: 1, 250: 2, 125: 4, 64: 3, 32: 5}), samples_are_what_it_felt),
    Fault("bma220", "oversample forgotten", ONE_READING, samples_are_what_it_felt, 1),
    Fault("bma220", "settings never checked", nothing_checked, lost_settings_are_noticed, 1),
    Fault("bma220", "settings never checked, as after power-on", nothing_checked, lost_settings_are_noticed),
    Fault("adxl345", "high byte first", fed(lambda data: data[:2] + bytes(
        data[2 + (k ^ 1)] for k in range(len(data) - 2))), data_sheet_examples_decode),
    Fault("adxl345", "twice the scale", value(adxl345, "COUNTS_PER_G", 128), samples_are_what_it_felt),
    Fault("adxl345", "ten bits in place of full resolution", value(adxl345, "FORMAT", replace(
        adxl345.FORMAT, fields={**adxl345.FORMAT.fields, "range": (5, 4)})), samples_are_what_it_felt),
    Fault("adxl345", "code of another rate", value(adxl345, "RATE_CODES", {200: 0x0C, 400: 0x0C, 800: 0x0D}),
          samples_are_what_it_felt),
    Fault("adxl345", "settings never checked", nothing_checked, lost_settings_are_noticed),
    Fault("iio", "settings never checked", kernel_not_asked_again, lost_settings_are_noticed, 1),
    Fault("pasco", "g and m/s2 exchanged", decoded(lambda block: replace(
        block, accel_mps2=block.accel_mps2 / 9.80665)), data_sheet_examples_decode),
]


@pytest.mark.slow
@pytest.mark.parametrize("fault", [*EVERYWHERE, *OWN], ids=lambda fault: f"{fault.name}: {fault.what}")
def test_a_planted_fault_is_found(fault: Fault, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = fakes()[fault.name].variants[fault.variant]
    asked = (fault.name,) if fault.found_by is data_sheet_examples_decode else (fault.name, settings, tmp_path)
    fault.plant(monkeypatch, fault.name)
    with pytest.raises(AssertionError):
        fault.found_by(*asked)
