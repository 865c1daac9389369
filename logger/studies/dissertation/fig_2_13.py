"""Fig 2.13: what the IRI hears of waves of each length (2.2.2.1)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.golden_car import STANDARD_SPEED_MPS
from logger.roads.wavelength import slope_gain
from logger.studies.checks import Value, Word
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.quarter_car import GOLDEN_CAR, structure

PRINTED_PEAKS_CPM = (0.065, 0.42)
PRINTED_PEAKS_HZ = (1.44, 9.33)
_BETWEEN_CPM = 0.2
_NEAR = 0.05  # as near as the top of a broad hump is read off a figure


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    wave_number = np.geomspace(0.01, 2.0, effort.count(2000, 200))
    gain = slope_gain(wave_number, 0.0)
    slow = wave_number < _BETWEEN_CPM
    peaks = [int(np.flatnonzero(part)[gain[part].argmax()]) for part in (slow, ~slow)]
    body_cpm, wheel_cpm = undamped_frequencies_hz(structure(GOLDEN_CAR)) / STANDARD_SPEED_MPS
    nearest = [float(wave_number[min(peaks, key=lambda peak: abs(np.log(wave_number[peak] / of)))])
               for of in (wheel_cpm, body_cpm)]
    rows = tuple((words, printed, float(wave_number[peak]), 1 / float(wave_number[peak]), float(gain[peak]))
                 for words, printed, peak in zip(("body bounces", "wheel hops"), PRINTED_PEAKS_CPM, peaks, strict=True))
    table = Table("Where the gain peaks", (
        Column("motion"), Column("printed [cycle/m]", ".3f"), Column("ours [cycle/m]", ".4f"),
        Column("wavelength [m]", ".1f"), Column("gain", ".2f")), rows)
    verdict = ("Both peaks lie within 4 % of where the text has them, as near as a broad hump is read off a figure. "
               "The text has their meaning the wrong way round: at 0.065 cycle/m the body bounces, at 0.42 the wheel "
               "hops; at 80 km/h these are its 1.44 and 9.33 Hz.")
    picture = Picture(Curves("Gain of the IRI's car at 80 km/h, slope of the suspension per slope of the road",
                             "wave number [cycle/m]", "gain", (Line("gain", wave_number, gain),), log_x=True),
                      "the IRI of sine waves of 0.1 to 100 m, largest at two wave numbers, 0.065 and 0.42 cycle/m")
    values = (*(Value(f"{words} peak [cycle/m]", printed, float(wave_number[peak]), _NEAR * printed)
                for words, printed, peak in zip(("first", "second"), PRINTED_PEAKS_CPM, peaks, strict=True)),
              *(Value(f"where the {words} [cycle/m]", printed, near, _NEAR * printed, Word.MISPRINT)
                for words, printed, near in zip(("wheel hops", "body bounces"), PRINTED_PEAKS_CPM, nearest,
                                                strict=True)),
              *(Value(f"{printed:g} cycle/m at 80 km/h [Hz]", hz, printed * STANDARD_SPEED_MPS, 0.005, of_print=True)
                for printed, hz in zip(PRINTED_PEAKS_CPM, PRINTED_PEAKS_HZ, strict=True)))
    return Result((table,), verdict, (picture,), values)


STUDY = Study("fig_2_13", "What the IRI hears of each wavelength", "Fig 2.13, section 2.2.2.1",
              "Computed for the Golden Car as a continuous system, without the moving average, as in the figure.", run,
              items=(Item("Fig 2.13", Word.MISPRINT,
                          "The text swaps the two wave numbers: at 0.065 cycle/m the body bounces, at 0.42 the wheel "
                          "hops; the curve itself agrees."),))
