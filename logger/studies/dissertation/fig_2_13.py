"""Fig 2.13: what the IRI hears of waves of each length (2.2.2.1)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.wavelength import slope_gain
from logger.studies.study import Column, Effort, Result, Study, Table, Value, Word

PRINTED_PEAKS_CPM = (0.065, 0.42)
_BETWEEN_CPM = 0.2
_NEAR = 0.05  # as near as the top of a broad hump is read off a figure


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    wave_number = np.geomspace(0.01, 2.0, effort.count(2000, 200))
    gain = slope_gain(wave_number, 0.0)
    slow = wave_number < _BETWEEN_CPM
    peaks = [int(np.flatnonzero(part)[gain[part].argmax()]) for part in (slow, ~slow)]
    rows = tuple((words, printed, float(wave_number[peak]), 1 / float(wave_number[peak]), float(gain[peak]))
                 for words, printed, peak in zip(("body bounces", "wheel hops"), PRINTED_PEAKS_CPM, peaks, strict=True))
    table = Table("Where the gain peaks", (
        Column("motion"), Column("printed [cycle/m]", ".3f"), Column("ours [cycle/m]", ".4f"),
        Column("wavelength [m]", ".1f"), Column("gain", ".2f")), rows)
    verdict = ("Both peaks lie within 4 % of where the text has them, as near as a broad hump is read off a figure. "
               "The text has their meaning the wrong way round: at 0.065 cycle/m the body bounces, at 0.42 the wheel "
               "hops; at 80 km/h these are its 1.44 and 9.33 Hz.")
    picture = Curves("Gain of the IRI's car at 80 km/h, slope of the suspension per slope of the road",
                     "logarithm to base 10 of the wave number [cycle/m]", "gain", (
                         Line("gain", np.log10(wave_number), gain),))
    values = tuple(Value(f"{words}, peak [cycle/m]", printed, float(wave_number[peak]), _NEAR * printed)
                   for words, printed, peak in zip(("body", "wheel"), PRINTED_PEAKS_CPM, peaks, strict=True))
    return Result((table,), verdict, (picture,), values)


STUDY = Study("fig_2_13", "What the IRI hears of each wavelength", "Fig 2.13, section 2.2.2.1",
              "Computed for the Golden Car as a continuous system, without the moving average, as in the figure.", run,
              covers=("Fig 2.13",), word=Word.MISPRINT,
              because="The text swaps the two wave numbers: at 0.065 cycle/m the body bounces, at 0.42 the wheel hops; "
                      "the curve itself agrees.")
