"""What is said of a sensor that sits as it should not."""

from dataclasses import replace

import numpy as np
import pytest

from logger.estimation.drive_alignment import heading_deg

from ..support.drives.braking_drives import Instrument, Mounting, Receiver, drive, fed
from .test_receiver_delay import town

FINE = Instrument(step_mps2=0.0, noise_mps2=0.05)


def test_nothing_is_said_of_a_sensor_that_is_well() -> None:
    assert fed(town()).complaints == ()


def test_a_tilt_is_reported() -> None:
    seen = drive("town", 600.0, Mounting(30.0, 14.0, 9.0), Receiver(), FINE, seed=2)
    (words,) = fed(seen).complaints
    assert "tilted by 1" in words


def test_an_axis_that_was_named_wrongly_is_reported() -> None:
    (words,) = fed(town(), 0, -1.0).complaints
    assert words.startswith("gravity is felt along +z, not along -x")


@pytest.mark.slow
@pytest.mark.parametrize(("loose_deg", "words"), [((0.0, 12.0), "tilted by 1"), ((50.0, 0.0), "turned by")])
def test_a_sensor_that_came_loose_is_reported(loose_deg: tuple[float, float], words: str) -> None:
    seen = drive("town", 1800.0, Mounting(30.0, loose_at_s=700.0, loose_deg=loose_deg), Receiver(), FINE, seed=3)
    alignment = fed(seen)
    assert words in alignment.moved
    assert "fasten it" in alignment.moved


@pytest.mark.parametrize("reading", [0.0, np.nan])
def test_nothing_is_said_by_a_sensor_that_is_dead(reading: float) -> None:
    seen = town()
    alignment = fed(replace(seen, accel=np.full_like(seen.accel, reading)))
    assert alignment.complaints == () and alignment.estimate().delay_s is None


@pytest.mark.parametrize("yaw_deg", [0.0, 30.0, -120.0])
def test_the_mounting_angle_is_that_of_the_sensor(yaw_deg: float) -> None:
    forward = np.array([np.cos(np.radians(yaw_deg)), -np.sin(np.radians(yaw_deg)), 0.0])
    assert heading_deg(forward, 2, 1.0) == pytest.approx(-yaw_deg)
