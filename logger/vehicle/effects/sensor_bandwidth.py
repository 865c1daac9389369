"""A sensor follows slow motions and not quick ones.

Its low-pass of first order is 1 / (1 + s / w); of second order, Butterworth's 1 / (1 + sqrt(2) s / w + (s / w)^2);
higher orders are those of a filter that a program runs on the samples (``dsp.filters``). Such a one of low order
too is another filter than a sensor's where its cut-off lies above a fifth or so of the sample rate: it takes all away
at half of that, and nearly nothing where a sensor's takes some decibels. As a sensor's it would leave the difference,
which looks like a resonance there. Of a record that was thinned, that lies above what is compared.
"""

from collections.abc import Mapping

import numpy as np

from logger.arrays import Complex
from logger.dsp.filters import butterworth
from logger.vehicle.effect import Misalignment, Parameter, Scale, SensorEffect, Values

_HIGHEST = 8
# Of the sample rate, where a filter that was run on the samples is tried: below about a fifth a sensor's does as well.
_ON_SAMPLES = 0.33
# The cut-offs that are tried with their delay: from the lowest that leaves a car's bounce to where the recorder's own
# filter begins. The ratio is measured: half of it off its best, an order of 6 at 28 Hz still gains nine tenths.
_LOWEST_HZ, _HIGHEST_OF_RATE, _CUTOFF_RATIO = 6.0, 0.45, 1.12
# A cut-off that a spectrum shows and one that a delay shows differ by no larger factor: of a filter run on 100 samples
# a second with 30 Hz, by tan(0.3 pi) / (0.3 pi) = 1.46.
_NEAR = 1.5


def _rates_hz(seen: Misalignment) -> list[float]:
    """Of filters that are tried: 0 of a sensor's, and the sample rate."""
    return [0.0, *[seen.rate_hz] * (not seen.thinned)]


class SensorBandwidth(SensorEffect):
    title = "the sensor's own low-pass"
    parameters = (
        Parameter("cutoff_hz", 25.0, 0.5, 2000.0, float("inf"), Scale.RECIPROCAL, (15.0, 50.0, 1000.0),
                  "where its gain has fallen by 3 dB"),
        Parameter("order", 1.0, 1.0, 8.0, None, Scale.LINEAR, (1.0, 2.0),
                  "1, or 2 to 8 for a Butterworth filter of that order",
                  choices=tuple(map(float, range(1, _HIGHEST + 1))), default=1.0),
        Parameter("sampled_hz", 0.0, 0.0, 1e6, None, Scale.LINEAR, (0.0,),
                  "sample rate of a digital filter (bilinear transform); 0: an analogue one",
                  default=0.0, given=True),
    )
    source = "S. Butterworth, On the Theory of Filter Amplifiers (1930)"
    signature = "the measurement gets smaller and later than the model, more so at higher frequencies"
    shown_by = "drive a road with sharp edges, which excites high frequencies"
    realigns = True
    not_of = ("encoder", "potentiometer")
    stage = 3

    def trials(self, seen: Misalignment | None = None) -> list[dict[str, float]]:
        """Also those of filters of low order that were run on the record's samples, and those of the filter that the
        record seems to have gone through, and of the orders beside it."""
        found = super().trials(seen)
        if seen is None or not seen.rate_hz:
            return found
        rates_hz = _rates_hz(seen)
        ways = [(_ON_SAMPLES * sampled_hz, order, sampled_hz) for sampled_hz in rates_hz[1:] for order in (1, 2)]
        if seen.low_pass is not None:
            cutoff_hz, order = seen.low_pass
            ways += [(cutoff_hz, one, sampled_hz) for sampled_hz in rates_hz
                     for one in range(max(order - 1, 1), min(order + 1, _HIGHEST) + 1)]
        return found + [{"cutoff_hz": float(one_hz), "order": float(one), "sampled_hz": float(sampled_hz)}
                        for one_hz, one, sampled_hz in ways]

    def delaying_trials(self, seen: Misalignment) -> list[list[dict[str, float]]]:
        """Filters of each order, from high cut-offs to low ones: what order and cut-off do differs by little more than
        the delay that goes with them, so that no fit leads from one order to another."""
        highest_hz = _HIGHEST_OF_RATE * seen.rate_hz
        if highest_hz < _LOWEST_HZ:  # or no rate is known
            return []
        count = round(np.log(highest_hz / _LOWEST_HZ) / np.log(_CUTOFF_RATIO))
        cutoffs_hz = sorted([*np.geomspace(_LOWEST_HZ, highest_hz, count + 1), *(seen.low_pass or ())[:1]])[::-1]
        return [[{"cutoff_hz": float(cutoff_hz), "order": float(order), "sampled_hz": sampled_hz}
                 for cutoff_hz in cutoffs_hz] for sampled_hz in _rates_hz(seen) for order in range(1, _HIGHEST + 1)]

    def is_seen(self, values: Mapping[str, float], seen: Misalignment) -> bool:
        """Where the record has lost what lies above."""
        return seen.low_pass is not None and abs(np.log(values["cutoff_hz"] / seen.low_pass[0])) < np.log(_NEAR)

    def factor(self, p: Values, s: Complex) -> Complex:
        return butterworth(int(p.order), s, p.cutoff_hz, sampled_hz=p.sampled_hz)


EFFECT = SensorBandwidth()
