"""A sensor follows slow motions and not quick ones.

Its low-pass of first order is 1 / (1 + s / w); of second order, Butterworth's 1 / (1 + sqrt(2) s / w + (s / w)^2).
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from logger.vehicle.effect import Parameter, Scale, SensorEffect

Complex = npt.NDArray[np.complex128]


class SensorBandwidth(SensorEffect):
    name = "sensor_bandwidth"
    title = "the sensor's own low-pass"
    parameters = (
        Parameter("cutoff_hz", 25.0, 0.5, 2000.0, float("inf"), Scale.RECIPROCAL, (15.0, 50.0, 1000.0),
                  "where its gain has fallen by 3 dB"),
        Parameter("order", 1.0, 1.0, 2.0, None, Scale.LINEAR, (1.0, 2.0), "1, or 2 for Butterworth's of second order",
                  choices=(1.0, 2.0), default=1.0),
    )
    source = "S. Butterworth, On the Theory of Filter Amplifiers (1930)"
    signature = "the measurement falls behind the model more and more as the frequency rises, and comes later"
    shown_by = "drive a road with sharp edges, which excites high frequencies"
    realigns = True
    stage = 3

    def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
        x = s / (2 * np.pi * p.cutoff_hz)
        return np.asarray(1 / (1 + x) if p.order == 1 else 1 / (1 + np.sqrt(2) * x + x * x))


EFFECT = SensorBandwidth()
