"""The IRI's gain: to which waves it listens most, and where it hears half of them."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.wavelength import slope_gain
from logger.studies.checks import Value, Word
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED_PEAKS_CPM = (0.065, 0.42)
PRINTED_HALVES_CPM = (0.033, 0.8)
"""Peaks, and where the response is down to 0.5; wavelengths of about 15, 2.4, 30 and 1.25 m."""
_BETWEEN_CPM = 0.2
_SHARE = 0.05
"""Of the printed value, as broad humps are read off a figure."""


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    wave_number = np.geomspace(0.01, 3.0, effort.count(4000, 1000))
    gain = slope_gain(wave_number, 0.0)
    slow = wave_number < _BETWEEN_CPM
    peaks = [float(wave_number[np.flatnonzero(part)[gain[part].argmax()]]) for part in (slow, ~slow)]
    rising = float(np.interp(0.5, gain[wave_number < peaks[0]], wave_number[wave_number < peaks[0]]))
    after = wave_number > peaks[1]
    falling = float(np.interp(-0.5, -gain[after], wave_number[after]))
    names = ("body's peak", "wheel's peak", "half, long waves", "half, short waves")
    printed = (*PRINTED_PEAKS_CPM, *PRINTED_HALVES_CPM)
    ours = (*peaks, rising, falling)
    values = tuple(Value(f"{name} [cycle/m]", theirs, mine, _SHARE * theirs)
                   for name, theirs, mine in zip(names, printed, ours, strict=True))
    table = Table("The same as wavelengths", (
        Column("where"), Column("printed [m]", ".2f"), Column("ours [m]", ".2f"), Column("gain", ".2f")),
        tuple((name, 1 / theirs, 1 / mine, float(slope_gain(np.array([mine]), 0.0)[0]))
              for name, theirs, mine in zip(names, printed, ours, strict=True)))
    verdict = ("Peaks and halves lie within 5 % of where they are printed, as near as they are read off a figure. "
               f"At its peaks the gain is {gain[slow].max():.2f} and {gain[~slow].max():.2f}; waves shorter than "
               f"{1 / falling:.2f} m or longer than {1 / rising:.0f} m count for less than half.")
    picture = Picture(Curves("Gain of the IRI's car at 80 km/h, for slopes", "wave number [cycle/m]", "gain", (
        Line("ours", wave_number, gain),
        Line("printed, half", np.array(PRINTED_HALVES_CPM), np.full(2, 0.5), dots=True)), log_x=True),
        "the gain for slopes by wave number, two humps at 0.065 and 0.42 cycle/m, down to 0.5 at 0.033 and 0.8")
    return Result((table,), verdict, (picture,), values)


STUDY = Study(
    "golden_car_gain", "To which waves the IRI listens", "Response of the IRI filter",
    "Computed for the Golden Car as a continuous system, without the moving average.", run,
    items=(Item("Golden Car gain curve", Word.AGREES, "Peaks and half gains lie where they are printed, within 5 %."),),
    source="Sayers and Karamihas, The Little Book of Profiling, University of Michigan, 1998")
