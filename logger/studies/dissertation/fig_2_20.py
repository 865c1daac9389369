"""Fig 2.20: the health guidance caution zone (2.3.5)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.comfort.exposure import S_PER_HOUR, caution_zone
from logger.studies.checks import Value, Word
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED_UPPER_VDV, PRINTED_LOWER_VDV = 8.5, 17.0
PRINTED_SHADED_HOURS = (4.0, 8.0)
HOURS = (1 / 60, 1 / 6, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 24.0)
_DOSE_PER_RMS = 1.4  # the estimated dose of ISO 2631-1, Eq B.3


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    zones = [(hours, caution_zone(hours, 2), caution_zone(hours, 4)) for hours in effort.each(HOURS)]
    table = Table("The zone, weighted r.m.s.", (
        Column("hours a day", ".3g"), Column("n = 2, from [m/s2]", ".3f"), Column("to [m/s2]", ".3f"),
        Column("n = 4, from [m/s2]", ".3f"), Column("to [m/s2]", ".3f"), Column("printed")), tuple(
        (hours, two.lower, two.upper, four.lower, four.upper,
         "shaded" if PRINTED_SHADED_HOURS[0] <= hours <= PRINTED_SHADED_HOURS[1] else "not shaded")
        for hours, two, four in zones))
    eight = caution_zone(8.0, 4)
    upper, lower = (_DOSE_PER_RMS * bound * (8.0 * S_PER_HOUR) ** 0.25 for bound in (eight.upper, eight.lower))
    fine = np.geomspace(1 / 60, 24, 2000)
    apart = np.array([caution_zone(hour, 2).lower / caution_zone(hour, 4).lower for hour in fine.tolist()])
    crossing = float(fine[np.abs(np.log(apart)).argmin()])
    values = (Value("dose of the upper line, n = 4 [m/s^1.75]", PRINTED_UPPER_VDV, upper, 0.01, Word.MISPRINT),
              Value("dose of the lower line, n = 4 [m/s^1.75]", PRINTED_LOWER_VDV, lower, 0.01, Word.MISPRINT),
              Value("where the lines cross: middle of the shaded hours", 6.0, crossing, 2.0))
    verdict = ("The text has 8.5 for the upper line and 17 for the lower; it is the other way round. The lines of the "
               f"two schools, a^2 t and a^4 t constant, cross at {crossing:.1f} hours and lie within "
               f"{100 * np.abs(np.log(apart[(fine >= 4) & (fine <= 8)])).max():.0f} % of each other from 4 to 8 hours, "
               "which is where the printed figure is shaded; at 10 minutes those of n = 2 are "
               f"{apart[np.searchsorted(fine, 1 / 6)]:.1f} times as high.")
    hours = np.geomspace(1 / 60, 24, 60)
    lines = tuple(Line(f"n = {exponent}, {bound}", hours, np.array([
        getattr(caution_zone(hour, exponent), bound) for hour in hours.tolist()]))
                  for exponent in (2, 4) for bound in ("lower", "upper"))
    picture = Picture(Curves("The caution zone", "hours a day", "weighted r.m.s. [m/s2]", lines, log_x=True,
                             log_y=True),
                      "two dashed lines for n = 2 and two dotted ones for n = 4, shaded between 4 and 8 hours")
    return Result((table,), verdict, (picture,), values)


STUDY = Study("fig_2_20", "The health guidance caution zone", "Fig 2.20, section 2.3.5",
              "The zone's bounds as ridelog has them for an exposure of a minute to a day; the doses of its lines are "
              "those of ISO 2631-1 Eq B.3.", run,
              items=(Item("Fig 2.20", Word.MISPRINT,
                          "The text has the doses of the two lines the wrong way round: 17 is the upper, 8.5 the "
                          "lower."),))
