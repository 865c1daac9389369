"""Two clocks, or a slow bus: the acceleration that is written down is late against the position beside it."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from logger.arrays import Complex
from logger.vehicle.effect import Misalignment, Parameter, Scale, SensorEffect, Values
from logger.vehicle.vehicle import OWN_NAMES

# So little moves all waves alike: a search can see from it how much it takes. Runs lie wrong from the second on.
_LITTLE_S, _WRONG_S = 2e-4, 0.002
_THIRD = 1 / 3
_ONE_RECORDER_S = 0.01
"""What moves a part or a mass on a bench and what it does are channels of one recorder, which are a sample apart at the
most; such recorders take 100 samples a second or more. A longer delay is physics: a spring in series, a damping."""


class TimeOffset(SensorEffect):
    title = "the acceleration lags the position"
    parameters = (
        Parameter("delay_s", 0.02, -2.0, 2.0, 0.0, Scale.LINEAR, (-0.02, 0.02), "late positive, early negative",
                  step=1e-6),
    )
    source = "the shift theorem of the Laplace transform"
    signature = "model and measurement have the same shape, shifted by the same time at every speed"
    shown_by = "drive one bump at two speeds: its apparent shift in distance grows with speed"
    realigns, reshapes = True, False
    stage = 4

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        if seen is None:
            return [{"delay_s": -_WRONG_S}, {"delay_s": _WRONG_S}]
        wrong_s = [seen.delay_s] if _WRONG_S < abs(seen.delay_s) <= self.parameters[0].high else []
        return [{"delay_s": delay_s} for delay_s in (_LITTLE_S, *wrong_s)]

    def is_trifle(self, values: Mapping[str, float], seen: Misalignment) -> bool:
        """Less than a third of the delay of the filter that the record went through, 1 / (sin(pi / 2 n) 2 pi cutoff) of
        Butterworth's order n: as a sensor's it delays by another third or so than as one run on samples."""
        if seen.low_pass is None:
            return False
        cutoff_hz, order = seen.low_pass
        return abs(values["delay_s"]) < _THIRD / (np.sin(np.pi / (2 * order)) * 2 * np.pi * cutoff_hz)

    def factor(self, p: Values, s: Complex) -> Complex:
        return np.exp(-s * p.delay_s)


class _OfOneRecorder(TimeOffset):
    title = "the measurement lags the excitation"
    parameters = (replace(TimeOffset.parameters[0], start=0.002, low=-_ONE_RECORDER_S, high=_ONE_RECORDER_S,
                          trials=(-0.002, 0.002)),)


EFFECT = TimeOffset()
EFFECT.variants = dict.fromkeys(OWN_NAMES, _OfOneRecorder())
