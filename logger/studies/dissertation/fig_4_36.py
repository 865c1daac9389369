"""Fig 4.36: discomfort of a bridge's step by its height and the speed (4.4.6)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.studies.checks import Check, Statement, Value, Word
from logger.studies.dissertation.fig_4_34 import OF_ONE_SIZE, PRINTED_PEAK_MPS2, per_section
from logger.studies.drives import BRIDGE_MPS, STEP_M, Conditions, bridge, record_of
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

HEIGHTS_M = (0.0127, 0.0254, 0.0381, 0.0508, 0.0635)
SPEEDS_KMH = (16.1, 32.2, 48.3, 64.4, 80.5, 96.6)
_STEP_AT_M, _LENGTH_M, _SECTION_M = 20.0, 60.0, 1.0
_LIMITS = (COMFORT_WORDS[-2], COMFORT_WORDS[-4])


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    speeds = np.array(effort.some(SPEEDS_KMH, 3))
    # The car is linear: one height is enough for all.
    per_metre = np.array([_peak(STEP_M, kmh / 3.6) for kmh in effort.each(speeds.tolist())]) / STEP_M
    peaks = np.outer(HEIGHTS_M, per_metre)
    table = Table("Largest a_w of a metre (printed as a picture only)", (
        Column("step [mm]", ".1f"), *(Column(f"{kmh:.0f} km/h [m/s2]", ".2f") for kmh in speeds),
        Column(f"in words at {speeds[-1]:.0f} km/h")), tuple(
        (1000 * height, *row, comfort_word(row[-1]).replace("_", " "))
        for height, row in zip(HEIGHTS_M, peaks.tolist(), strict=True)))
    own = _peak(STEP_M, BRIDGE_MPS)
    values: tuple[Check, ...] = (Value("38.1 mm at 48.3 km/h, nearly, from Fig 4.34 [m/s2]", PRINTED_PEAK_MPS2, own,
                                       OF_ONE_SIZE,
                    Word.NOT_REPRODUCIBLE),
              Statement("least of the figure [m/s2]", "points below the green line, comfortable", float(peaks.min()),
                        0.0,
                        _LIMITS[0][0], Word.NOT_REPRODUCIBLE),
              Statement("largest of the figure [m/s2]", "points above the red line, a noticeable discomfort",
                        float(peaks.max()), _LIMITS[1][0], word=Word.NOT_REPRODUCIBLE))
    verdict = ("In proportion to the height, as the car is linear; with the speed it rises steeply up to 32 km/h and "
               "slowly beyond, as a metre gets shorter than the blow. Where a metre begins moves its a_w by a tenth "
               "either way. The lines for comfort are those of Table 2.5 here, a little uncomfortable from 0.315 and "
               "uncomfortable from 0.8 m/s2, for the text does not say which ones were drawn.")
    lines = tuple(Line(f"{1000 * height:.1f} mm", speeds, row) for height, row in zip(HEIGHTS_M, peaks, strict=True))
    limits = tuple(Line(word.replace("_", " "), speeds, np.full(len(speeds), limit))
                   for limit, word in _LIMITS)
    picture = Picture(Curves("Largest a_w of a metre over a step", "speed [km/h]", "a_w [m/s2]", (*lines, *limits)),
                      "dots for heights and speeds, and two lines across: comfortable below the green one, a "
                      "noticeable discomfort above the red one")
    return Result((table,), verdict, (picture,), values)


def _peak(height_m: float, speed_mps: float) -> float:
    seconds = (_LENGTH_M + 2) / speed_mps
    record = record_of(bridge(_STEP_AT_M, -height_m), speed_mps, seconds, Conditions(noise_mps2=0.0))
    return float(per_section(record, _SECTION_M, _LENGTH_M).max())


STUDY = Study("fig_4_36", "Discomfort of a bridge's step by its height and the speed", "Fig 4.36, section 4.4.6",
              "Simulated as in the source: a step down on a road without roughness; a_w by Wk, per metre.", run,
              items=(Item("Fig 4.36", Word.NOT_REPRODUCIBLE,
                          "Heights, speeds and limits of the figure are not printed; the one value that is, from Fig "
                          "4.34, is of the size of ours."),))
