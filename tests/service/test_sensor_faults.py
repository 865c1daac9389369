"""What goes wrong with sensors and their wires: every fault of the table."""

from __future__ import annotations

from pathlib import Path

import pytest

from ..support.faults.sensors import HAZARDS
from ..support.faults.trials import Hazard, cases_for_tests, label

LONG = ("an hour without a fix", "GPS date jumps for good", "system clock set back", "frozen accelerometer",
        "GPS date jumps for seconds", "parked car", "storm of refused transfers", "I2C bus held low",
        "GPS unplugged for 2 to 30 s", "peaks beyond the range",
        "accelerometer unplugged for 0.3 to 40 s", "accelerometer loses its settings")


@pytest.mark.parametrize(("hazard", "case"), cases_for_tests(HAZARDS, 1, LONG), ids=label)
def test_what_is_promised_is_held(tmp_path: Path, hazard: Hazard, case: object) -> None:
    assert hazard.trial(tmp_path, case).wrong == ()
