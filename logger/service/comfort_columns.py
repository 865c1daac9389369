"""The comfort columns of a row: what is known of the ride itself, with standard errors, beside the raw values.

Where the estimated road under a window says what the car did, the figures are those of that ride: the model of the car
is in the prior, the readings are bounds. Where there is none (no speed, the ends of a drive, a sensor whose noise blurs
its steps), the power of the noise is taken off the readings, which needs no model. Where neither is possible, the only
figure is the word that a bound allows.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from logger.comfort.iso2631 import comfort_word
from logger.comfort.noise_floor import NoiseFloor, RawFigures
from logger.comfort.uncertain_ride import NO_FIGURES, RideFigures, Uncertain
from logger.dsp.windows import Window
from logger.estimation.noise_belief import NoiseBelief
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import WindowEstimate

LEAST_WORD = "not_uncomfortable"
REPORTED_FROM_STDS = 2.0
"""A ride of fewer standard errors hides in the noise."""


@dataclass(frozen=True)
class ComfortFigures:
    """``ride`` without the noise, the word for it, and whether it hides in noise and rounding."""

    ride: RideFigures
    word: str
    is_hidden: bool


NO_COMFORT = ComfortFigures(NO_FIGURES, "", False)


class ComfortColumns:
    """For one sensor, whose weighted white noise ``floor`` knows."""

    def __init__(self, floor: NoiseFloor, sensor: Sensor) -> None:
        self._floor = floor
        self._noise_mps2 = sensor.noise_rms_mps2
        self._is_coarse = sensor.is_coarse

    def of(self, window: Window, estimate: WindowEstimate | None, noise: NoiseBelief | None) -> ComfortFigures:
        """What can be said of a window. ``noise`` is what is believed of the sensor's; None: what the settings say."""
        if not isfinite(window.a_w_mps2):
            return NO_COMFORT
        noise_mps2, log_std = (noise.noise_rms_mps2, noise.log_std) if noise else (self._noise_mps2, 0.0)
        if not self._is_coarse:
            # What a drive shows of a fine sensor's noise holds what the car's model is wrong by: that is ride.
            noise_mps2 = min(noise_mps2, self._noise_mps2)
        ride = estimate.ride if estimate is not None else NO_FIGURES
        if not isfinite(ride.a_w.value):
            raw = RawFigures(window.samples, window.accel_rms_mps2, window.a_w_mps2, window.mtvv_mps2,
                             window.vdv_mps175)
            ride = self._floor.without(raw, noise_mps2, log_std)
        return ComfortFigures(ride, *word_of(ride.a_w, self._floor.most_hidden_mps2(noise_mps2)))


def word_of(a_w: Uncertain, most_hidden_mps2: float) -> tuple[str, bool]:
    """The comfort word of a weighted r.m.s. [m/s2], and whether the ride hides in the noise. A ride that does has the
    mildest word if its upper bound allows that, else none; ``most_hidden_mps2`` can hide between two steps."""
    is_known = isfinite(a_w.value)
    if is_known and a_w.value >= REPORTED_FROM_STDS * a_w.std:
        return comfort_word(a_w.value), False
    bound_mps2 = max(a_w.value + REPORTED_FROM_STDS * a_w.std if is_known else 0.0, most_hidden_mps2)
    return LEAST_WORD if comfort_word(bound_mps2) == LEAST_WORD else "", True
