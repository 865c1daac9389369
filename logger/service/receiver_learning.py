"""What a drive told of the receiver's delay and of the sensor's mounting, in words and as fields."""

from __future__ import annotations

from math import degrees
from typing import Any

from logger.estimation.drive_alignment import DriveAlignment
from logger.estimation.mounting import heading_deg
from logger.service.config import AccelerometerConfig
from logger.service.signal_chain import Axis


def drive_fields(alignment: DriveAlignment, config: AccelerometerConfig) -> dict[str, Any]:
    """For a program: SI units in the names; None where it is not known."""
    found = alignment.estimate()
    axis = Axis.from_word(config.vertical_axis)
    turned_deg = heading_deg(found.forward, axis.column, axis.sign) if found.forward is not None else None
    return {
        "delay_s": found.delay_s,
        "delay_std_s": found.std_s,
        "unknown_because": found.reason,
        "sensor_turned_deg": turned_deg,
        "sensor_turned_std_deg": degrees(found.forward_std_rad) if found.forward_std_rad is not None else None,
        "mounting": list(alignment.complaints),
    }


def drive_words(fields: dict[str, Any], latency_s: float) -> list[str]:
    """For a person: lines."""
    if fields["delay_s"] is None:
        lines = [f"Receiver's delay: not known, {fields['unknown_because']}; the settings say {latency_s:.2f} s"]
    else:
        lines = [f"Receiver's delay: {fields['delay_s']:.2f} +- {fields['delay_std_s']:.2f} s by this drive; "
                 f"the settings say {latency_s:.2f} s"]
    return lines + [f"Accelerometer: {words}" for words in fields["mounting"]]
