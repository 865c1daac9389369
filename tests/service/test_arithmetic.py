"""A drive through integer filters is the drive through floating ones."""

from __future__ import annotations

from dataclasses import fields, replace

import pytest

from logger.records import WindowRecord
from logger.service.config import Config, PipelineConfig

from ..support.drives.replay import rows_of
from ..support.drives.simulated_drive import DemoDrive


def numbers(record: WindowRecord) -> dict[str, float]:
    values = {field.name: getattr(record, field.name) for field in fields(record)}
    return {name: value for name, value in values.items() if isinstance(value, float)}


@pytest.mark.slow
@pytest.mark.parametrize("low_pass_hz", [None, 15.0])
def test_fixed_and_float_agree_to_six_digits(short_drive: DemoDrive, low_pass_hz: float | None) -> None:
    pipeline = PipelineConfig(low_pass_hz=low_pass_hz)
    in_float = rows_of(short_drive.header, short_drive.events, Config(pipeline=pipeline)).records
    in_fixed = rows_of(short_drive.header, short_drive.events,
                       Config(pipeline=replace(pipeline, arithmetic="fixed"))).records
    assert len(in_float) == len(in_fixed) > 50
    assert in_float != in_fixed
    for one, other in zip(in_float, in_fixed, strict=True):
        assert numbers(other) == pytest.approx(numbers(one), rel=1e-6, abs=1e-6)
        assert (one.flags, one.t_us) == (other.flags, other.t_us)
