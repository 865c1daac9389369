"""A sensor on a bracket or a console rides on a small spring of its own.

Between body and sensor lies the transmissibility (2 z w s + w^2) / (s^2 + 2 z w s + w^2).
"""

import numpy as np

from logger.arrays import Complex
from logger.vehicle.effect import Misalignment, Parameter, Scale, SensorEffect, Values, resonances_hz


class SensorMountResonance(SensorEffect):
    title = "the bracket or console under the sensor resonates"
    parameters = (
        Parameter("frequency_hz", 25.0, 2.0, 400.0, float("inf"), Scale.RECIPROCAL,
                  (11.0, 60.0), "natural frequency of the sensor on its bracket"),
        Parameter("damping_ratio", 0.08, 0.002, 1.5, None, Scale.LOG, (0.05, 0.25), "of the bracket"),
    )
    source = "C. M. Harris, A. G. Piersol, Shock and Vibration Handbook (2002), chapter 2: transmissibility"
    signature = "a peak at a frequency that is no mode of the car, at every speed and on every road"
    shown_by = "drive a rough road at two speeds, and knock on the console while the car stands"
    not_of = ("encoder", "potentiometer", "force")
    stage = 1

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        """Of each damping, frequencies as near to each other as such a resonance is wide."""
        frequency, damping = self.parameters
        return [{"frequency_hz": frequency_hz, "damping_ratio": ratio} for ratio in damping.trials
                for frequency_hz in resonances_hz(frequency.trials[0], frequency.trials[-1], ratio)]

    def factor(self, p: Values, s: Complex) -> Complex:
        omega = 2 * np.pi * p.frequency_hz
        through = 2 * p.damping_ratio * omega * s + omega**2
        return np.asarray(through / (s * s + through))


EFFECT = SensorMountResonance()
