"""Which other setting of the sensor would suit a drive better, by what the drive shows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.accelerometers import accelerometers
from drivers.accelerometers.bma220 import Bma220Config
from drivers.readings import AccelerationBlock, Fix
from logger.commands.status import advice
from logger.service.drive_readings import FEWEST_WINDOWS, RangeUse
from logger.units import STANDARD_GRAVITY_MPS2

from ..support.drives.logged_rows import ROW
from ..support.faults.sensors import Car

WINDOWS = 1000
FAINT = replace(ROW, iri_m_per_km=None, flags=("faint",))
CLIPPED = replace(ROW, clipped_samples=1)
LOST = replace(ROW, iri_m_per_km=None, flags=("gps_lost",))


def moving(mps: float) -> Fix:
    return Fix(0, True, None, None, 46.0, 6.0, mps, None, None, None, None)


def used(range_g: int, reads: int, clipped: float = 0.0, hidden: float = 0.0, beyond: float = 0.0,
         windows: int = WINDOWS) -> str:
    """Advice after a drive of which these shares were clipped, hidden, and beyond the next smaller range; all of it was
    beyond the one below that."""
    use = RangeUse(accelerometers()["bma220"].others(Bma220Config(range_g=range_g, oversample=reads)))
    peak = np.where(np.arange(windows) < beyond * windows, 0.49, 0.4) * range_g * STANDARD_GRAVITY_MPS2
    for one in peak:
        block = AccelerationBlock(np.zeros(1, dtype=np.int64), np.array([[0.0, 0.0, one]]), np.zeros(1, dtype=np.bool_))
        use.take(block, [moving(20.0)])
    rest = round(windows * (1 - clipped - hidden))
    use.count([CLIPPED] * round(clipped * windows) + [FAINT] * round(hidden * windows) + [ROW] * rest)
    return use.advice


@pytest.mark.parametrize(("range_g", "reads", "clipped", "hidden", "beyond", "said"), [
    (2, 4, 0.08, 0.0, 1.0, ""),  # as measured: 2 g was still better
    (2, 4, 0.30, 0.0, 1.0, "it clipped in 30% of this drive's windows: set range_g: 4"),
    (4, 4, 0.30, 0.0, 1.0, "set range_g: 8"),
    (8, 4, 0.9, 0.0, 1.0, ""),  # steps at 16 g say nothing
    (4, 4, 0.0, 0.0, 0.0, "nothing of this drive would have exceeded a smaller range, which has finer steps: set "
                          "range_g: 2"),
    (8, 1, 0.0, 0.5, 0.01, "only 1.0% of this drive would have exceeded a smaller range, which has finer steps: "
                           "set range_g: 4"),
    (4, 4, 0.0, 0.02, 0.4, ""),
    (4, 4, 0.0, 0.10, 0.4,
     "10% of this drive's windows move by less than one of its steps: set oversample: 8 (and the bus"),
    (2, 1, 0.0, 0.05, 0.0, "set oversample: 4"),
    (2, 8, 0.0, 0.5, 0.0, ""),
])
def test_what_would_be_better(range_g: int, reads: int, clipped: float, hidden: float, beyond: float, said: str
                              ) -> None:
    found = used(range_g, reads, clipped, hidden, beyond)
    assert said in found and bool(said) == bool(found)


def test_little_driven_says_nothing() -> None:
    assert used(4, 4, windows=FEWEST_WINDOWS - 1) == ""
    assert used(4, 4, windows=FEWEST_WINDOWS) != ""


def test_what_has_no_iri_for_another_reason_and_a_parked_car_do_not_count() -> None:
    use = RangeUse(accelerometers()["bma220"].others(Bma220Config(range_g=4, oversample=4)))
    block = AccelerationBlock(np.zeros(1, dtype=np.int64), np.array([[0.0, 0.0, 30.0]]), np.zeros(1, dtype=np.bool_))
    use.take(block, [moving(0.0)])
    use.count([LOST] * WINDOWS)
    assert use.advice == ""


@pytest.mark.parametrize("name", [name for name in accelerometers() if name != "bma220"])
def test_a_sensor_without_such_settings_gets_no_advice(name: str) -> None:
    kind = accelerometers()[name]
    use = RangeUse(kind.others(kind.settings()))
    use.count([CLIPPED] * WINDOWS)
    assert use.advice == ""


@pytest.mark.slow
def test_status_says_it_of_a_drive_at_8_g_that_needs_2(tmp_path: Path) -> None:
    car = Car(tmp_path, settings=Bma220Config(range_g=8, oversample=1))
    car.sample = lambda second: bytes((0, 0, 4 * (4 + car.rng.randrange(-1, 2))))
    car.speed_mps = 20.0
    status = car.drive(3 + 1.2 * FEWEST_WINDOWS * 7.62 / 20.0)
    assert any("would have exceeded a smaller range" in line and "set range_g: 2" in line for line in advice(status))
