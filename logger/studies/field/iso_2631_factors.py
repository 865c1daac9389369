"""ISO 2631-1's table of weighting factors at one-third-octave frequencies, and one factor that is misprinted."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.dsp.weightings.wd import WEIGHTING as WD
from logger.dsp.weightings.wk import WEIGHTING as WK
from logger.studies.checks import Value, Word, about
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

HZ = ("0.5", "0.63", "0.8", "1", "1.25", "1.6", "2", "2.5", "3.15", "4", "5", "6.3", "8", "10", "12.5", "16", "20",
      "25",
      "31.5", "40", "50", "63", "80")
PRINTED = {
    "wk": ("418", "459", "477", "482", "484", "494", "531", "631", "804", "967", "1039", "1054", "1036", "988", "902",
           "768", "636", "513", "405", "314", "246", "186", "132"),
    "wd": ("853", "944", "992", "1011", "1008", "968", "890", "776", "642", "512", "409", "323", "253", "212", "161",
           "125", "100", "80.0", "63.2", "49.4", "38.8", "29.5", "21.1"),
}
"""Factors times 1000, as printed, at the nominal frequencies."""
MISPRINTED = ("wd", "10")
_ROUNDING = 0.75  # of the last printed digit: two of the standard's factors are a little more than half of one low
_ITEMS = {"wk": "ISO 2631-1 Table 3, Wk", "wd": "ISO 2631-1 Table 3, Wd"}


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    values: list[Value] = []
    for name, weighting in effort.each((("wk", WK), ("wd", WD))):
        for hz, printed in zip(HZ, PRINTED[name], strict=True):
            digit = 10.0 ** -len(printed.partition(".")[2])
            word = Word.MISPRINT if (name, hz) == MISPRINTED else Word.AGREES
            values += about(_ITEMS[name], [Value(f"{name} at {hz} Hz, times 1000", float(printed), 1000 * float(
                abs(weighting.response(float(hz)))), _ROUNDING * digit, word)])
    wrong = next(one for one in values if one.word is Word.MISPRINT)
    off = [abs(one.difference) for one in values if one is not wrong]
    table = Table("The misprint", (Column("frequency [Hz]"), Column("printed", ".0f"), Column("ours", ".1f"),
                                   Column("neighbours, printed")), (("10", wrong.printed, wrong.ours, "253 and 161"),))
    verdict = (f"Of {len(values)} factors all but one agree to the printed digit, {np.mean(off):.2f} off on the mean; "
               "they are those of the formula at the nominal frequencies. Wd at 10 Hz is printed 212; the formula "
               "has 202, and so has a smooth curve through its neighbours.")
    at_hz = np.array(HZ, dtype=float)
    picture = Picture(Curves("Factors of Wk and Wd", "frequency [Hz]", "factor times 1000", tuple(
        line for name, weighting in (("wk", WK), ("wd", WD)) for line in (
            Line(f"{name}, ours", at_hz, 1000 * np.abs(weighting.response(at_hz))),
            Line(f"{name}, printed", at_hz, np.array(PRINTED[name], dtype=float), dots=True))), log_x=True, log_y=True),
        "a table of factors from 0.02 to 400 Hz, of which those of 0.5 to 80 Hz are taken")
    return Result((table,), verdict, (picture,), tuple(values))


STUDY = Study(
    "iso_2631_factors", "Factors of Wk and Wd at one-third-octave frequencies", "Table 3",
    "The magnitude of the weightings' formulas at the nominal frequencies from 0.5 to 80 Hz.", run,
    items=(Item(_ITEMS["wk"], Word.AGREES, "Every factor agrees to the printed digit."),
           Item(_ITEMS["wd"], Word.MISPRINT, "All factors agree but that at 10 Hz, which is printed 212 for 202.")),
    source="ISO 2631-1:1997, Mechanical vibration and shock: evaluation of human exposure to whole-body vibration")
