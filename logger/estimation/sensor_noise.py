"""What an accelerometer's reading is: the acceleration, noise, and rounding to a step."""

from __future__ import annotations

from dataclasses import dataclass

NOISE_MPS2 = 0.05
"""Of a reading, where nobody says another [m/s2]; where it is to be learnt, a guess to begin with."""


@dataclass(frozen=True)
class Sensor:
    """noise_rms_mps2    white noise of one reading on the time grid, before rounding [m/s2], above 0
    step_mps2            step that readings are rounded to [m/s2]; 0: none
    """

    noise_rms_mps2: float
    step_mps2: float

    @property
    def is_coarse(self) -> bool:
        """The noise does not blur the steps: rounding is no noise that one could add, but a bound on either side."""
        return self.step_mps2 > 2 * self.noise_rms_mps2

    @property
    def variance_mps2_2(self) -> float:
        """Variance of noise and rounding, taken as one noise [(m/s2)2]."""
        return self.noise_rms_mps2**2 + self.step_mps2**2 / 12
