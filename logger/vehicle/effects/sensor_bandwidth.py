"""A sensor follows slow motions and not quick ones.

Its low-pass of first order is 1 / (1 + s / w); of second order, Butterworth's 1 / (1 + sqrt(2) s / w + (s / w)^2);
higher orders are those of a filter that a program runs on the samples (``dsp.butterworth``).
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import numpy.typing as npt

from logger.dsp.butterworth import butterworth
from logger.vehicle.effect import Misalignment, Parameter, Scale, SensorEffect

Complex = npt.NDArray[np.complex128]

_HIGHEST = 8
# A cut-off that a spectrum tells and one that a delay tells differ by no larger factor: of a filter run on 100 samples
# a second with 30 Hz, by tan(0.3 pi) / (0.3 pi) = 1.46.
_NEAR = 1.5


class SensorBandwidth(SensorEffect):
    name = "sensor_bandwidth"
    title = "the sensor's own low-pass"
    parameters = (
        Parameter("cutoff_hz", 25.0, 0.5, 2000.0, float("inf"), Scale.RECIPROCAL, (15.0, 50.0, 1000.0),
                  "where its gain has fallen by 3 dB"),
        Parameter("order", 1.0, 1.0, 8.0, None, Scale.LINEAR, (1.0, 2.0),
                  "1, or 2 to 8 for Butterworth's of that order",
                  choices=tuple(map(float, range(1, _HIGHEST + 1))), default=1.0),
    )
    source = "S. Butterworth, On the Theory of Filter Amplifiers (1930)"
    signature = "the measurement falls behind the model more and more as the frequency rises, and comes later"
    shown_by = "drive a road with sharp edges, which excites high frequencies"
    realigns = True
    stage = 3

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        """Also those of the filter that the record seems to have gone through, and of the orders beside it. One that
        was run on samples, with 3 dB at the cut-off, delays as a sensor's with a higher one does (bilinear transform).
        """
        found = super().trials(seen)
        if seen is not None and seen.low_pass is not None:
            cutoff_hz, order = seen.low_pass
            delays_as_hz = seen.rate_hz / np.pi * np.tan(np.pi * cutoff_hz / seen.rate_hz)
            found += [{"cutoff_hz": float(one_hz), "order": float(one)} for one_hz in (cutoff_hz, delays_as_hz)
                      for one in range(max(order - 1, 1), min(order + 1, _HIGHEST) + 1)]
        return found

    def is_seen(self, values: Mapping[str, float], seen: Misalignment) -> bool:
        """Where the record has lost what lies above."""
        return seen.low_pass is not None and abs(np.log(values["cutoff_hz"] / seen.low_pass[0])) < np.log(_NEAR)

    def factor(self, p: SimpleNamespace, s: Complex) -> Complex:
        return butterworth(int(p.order), s, p.cutoff_hz)


EFFECT = SensorBandwidth()
