"""A sensor that reads every acceleration too large, or too small, by the same factor."""

import numpy as np

from logger.arrays import Complex
from logger.vehicle.effect import Parameter, Scale, SensorEffect, Values


class SensorGain(SensorEffect):
    title = "scale error of the sensor"
    parameters = (Parameter("gain", 1.05, 0.2, 5.0, 1.0, Scale.LOG, (0.93, 1.07), "reading over true acceleration"),)
    source = "data sheets of accelerometers give scale errors of some per cent"
    signature = "the measurement is the model times one factor, at every frequency, speed and strength"
    shown_by = "turn the sensor over at rest: the readings must differ by 2 g"
    not_of = ("encoder",)
    found_of = ("velocity", "displacement", "force", "travel")
    stage = 2

    def factor(self, p: Values, s: Complex) -> Complex:
        return np.full_like(s, p.gain)


EFFECT = SensorGain()
