"""Fig 4.25: peak acceleration over bumps of different height and width (4.4.2)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.checks import Statement, Word
from logger.studies.drives import BUMP_HEIGHT_M, BUMP_MPS, BUMP_WIDTH_M, Conditions, bump, record_of
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table
from logger.units import STANDARD_GRAVITY_MPS2

HEIGHTS_M = (0.1016, 0.1270, 0.1524, 0.1778, 0.2032)
WIDTHS_M = (1.83, 2.13, 2.44, 2.74, 3.05, 3.35)
PRINTED_PEAK_G = 0.8703  # Table 5.5, measured on speed bumps


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    heights, widths = effort.some(HEIGHTS_M), effort.some(WIDTHS_M)
    peaks = np.array([[_peak(height, width) for width in widths] for height in effort.each(heights)])
    columns = (Column("height [mm]", ".1f"), *(Column(f"width {width:.2f} m [m/s2]", ".2f") for width in widths))
    rows = tuple((1000 * height, *map(float, row)) for height, row in zip(heights, peaks, strict=True))
    own = _peak(BUMP_HEIGHT_M, BUMP_WIDTH_M)
    one = Table("The bump of 5.5.2, 150 mm by 2.60 m",
                (Column("printed, Table 5.5 [g]", ".4f"), Column("ours [g]", ".4f")),
                ((PRINTED_PEAK_G, own / STANDARD_GRAVITY_MPS2),))
    verdict = ("As the source says, a higher bump gives a larger peak and a wider one a smaller. The car is linear, "
               "so the peak is exactly proportional to the height; no number of the figure is in the text. Over the "
               f"bump of 5.5.2 the model peaks at {own / STANDARD_GRAVITY_MPS2:.2f} g, the record on a row of speed "
               "bumps at 0.87 g: the real bumps, tires or bump stops are harder than the model's, and the text "
               "cannot tell which.")
    picture = Picture(Curves("Largest acceleration over a bump", "width of the bump [m]", "peak [m/s2]", tuple(
        Line(f"{1000 * height:.0f} mm", np.array(widths), row) for height, row in zip(heights, peaks, strict=True))),
        "peaks for heights of 101.6 to 203.2 mm and widths of 1.83 to 3.35 m: the higher the larger, the wider the "
        "smaller")
    values = (Statement("least change of the peak from one height to the next higher [m/s2]", "the larger the height, "
                        "the larger the peak", float(np.diff(peaks, axis=0).min()), least=1e-3),
              Statement("most change of the peak from one width to the next larger [m/s2]", "the larger the width, the "
                        "smaller the peak", float(np.diff(peaks, axis=1).max()), most=-1e-3))
    return Result((Table("Largest acceleration, either way (printed as a picture only)", columns, rows), one), verdict,
                  (picture,), values)


def _peak(height_m: float, width_m: float) -> float:
    record = record_of(bump(2.0, height_m, width_m), BUMP_MPS, 4.0, Conditions(noise_mps2=0.0))
    return float(np.abs(record.measured_mps2).max())


STUDY = Study("fig_4_25", "Peak acceleration by height and width of a bump", "Fig 4.25, section 4.4.2",
              "Simulated as in the source: half car of Table 4.2, 16.1 km/h, no roughness, no noise.", run,
              items=(Item("Fig 4.25", Word.AGREES,
                          "A higher bump gives a larger peak, a wider one a smaller, as printed; the figure has no "
                          "numbers in the text."),))
