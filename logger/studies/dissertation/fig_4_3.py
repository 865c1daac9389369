"""Fig 4.3 to 4.5: roads of two qualities, and how high roads are by their degree of roughness (4.2.2)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.elevation_spectrum import classify
from logger.roads.iso8608 import CM3_M3, HIGHEST_CPM, LOWEST_CPM, REFERENCE_N0_CPM, generate, road_class
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED = ((16.0, "very good"), (256.0, "poor"))
PRINTED_POOR_CM3 = (512.0, 2048.0)
"""Class D, a poor road by 4.3.4."""
GD_CM3 = (1.0, 4.0, 16.0, 64.0, 256.0, 1024.0)
_FIGURES = {16.0: ("Fig 4.3", "Fig 4.5"), 256.0: ("Fig 4.4", "Fig 4.5")}
_ROADS, _LENGTH_M, _SPACING_M = 60, 1000.0, 0.1
_TOLERANCE = 0.05  # of the mean over roads; at Gd of one road's length the longest waves are not averaged out


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    roads = effort.count(_ROADS, 12)
    rows = []
    values: list[Check] = []
    for gd in effort.each(GD_CM3):
        rms_mm = np.array([1000 * float(np.std(generate(gd, _LENGTH_M, _SPACING_M, seed))) for seed in range(roads)])
        expected = 1000 * _rms_m(gd)
        quality = dict(PRINTED).get(gd)
        rows.append((gd, road_class(gd), quality, expected, float(rms_mm.mean()), float(rms_mm.std())))
        values += about(_FIGURES.get(gd, ("Fig 4.5",)), [
            Value(f"r.m.s. elevation at {gd:.0f} cm3, of Eq 4.2 and ours [mm]", expected, float(rms_mm.mean()),
                  _TOLERANCE * expected)])
    values += about("Fig 4.4", [Statement("Gd of the road [cm3]", "poor, as a road of class D in 4.3.4", PRINTED[1][0],
                                          *PRINTED_POOR_CM3, Word.MISPRINT)])
    # Without 2 pi every wave is 2 pi times as long, and there are 2 pi times as many in a step of wave number.
    asked = PRINTED[1][0]
    values += about("Eq 4.1", [Value(
        f"Gd(n0) of a road made for {asked:.0f} cm3, by Eq 4.1 as printed [cm3]", asked / (2 * np.pi),
        classify(generate(asked, _LENGTH_M, _SPACING_M, 0), _SPACING_M).gd_n0_cm3, asked / 4, Word.MISPRINT)])
    table = Table(f"R.m.s. elevation of {roads} roads of 1 km", (
        Column("Gd(n0) [cm3]", ".0f"), Column("class"), Column("printed quality"),
        Column("sum of Eq 4.2's amplitudes [mm]", ".2f"), Column("ours, mean [mm]", ".2f"),
        Column("from road to road [mm]", ".2f")), tuple(rows))
    verdict = ("Generated roads are as high as the sum of the amplitudes of Eq 4.2 makes them, in proportion to the "
               "root of the degree of roughness. The text says of the printed Fig 4.5 that its means are those of "
               "earlier work and that its scatter is large; roads of 1 km with all waves of Eq 4.2 in them scatter by "
               "2 % here. A road of 256 cm3 is of class C, which the text calls poor here; in 4.3.4 it calls class D "
               "poor. Its ISO 8606 is ISO 8608. The argument of Eq 4.1 lacks 2 pi (Appendix A has it), its phases are "
               "uniform, not normal, and N waves at equal steps repeat after one over the step. Ours chooses the step "
               "for the road's length, so that nothing repeats.")
    place = np.arange(0, 200.0, 0.5)
    shown = tuple(Line(f"{gd:.0f} cm3, {quality}", place, 1000 * generate(gd, 200.0, 0.5, 0)[: len(place)])
                  for gd, quality in PRINTED)
    gds = np.array(GD_CM3)
    means, stds = (np.array([row[at] for row in rows], dtype=float) for at in (4, 5))
    pictures = (Picture(Curves("Two roads (Fig 4.3, 4.4)", "distance [m]", "elevation [mm]", shown),
                        "a picture each of a generated profile, 16 cm3 and 256 cm3"),
                Picture(Curves("R.m.s. elevation and its scatter (Fig 4.5)", "Gd(n0) [cm3]", "r.m.s. elevation [mm]", (
                    Line("ours", gds, means, stds), Line("Eq 4.2", gds, np.array([1000 * _rms_m(gd) for gd in GD_CM3]),
                                                         dots=True)), log_x=True, log_y=True),
                    "r.m.s. elevations of generated profiles from 1 to 1024 cm3, their means near those of Da Silva "
                    "(2004), with a large scatter"))
    return Result((table,), verdict, pictures, tuple(values))


def _rms_m(gd_n0_cm3: float) -> float:
    """Root of the integral of Eq 2.1 with a waviness of 2 over the waves of 4.2.1: what Eq 4.2 adds up to."""
    return float(np.sqrt(gd_n0_cm3 * CM3_M3 * REFERENCE_N0_CPM**2 * (1 / LOWEST_CPM - 1 / HIGHEST_CPM)))


STUDY = Study("fig_4_3", "Generated roads, and how high they are", "Fig 4.3, section 4.2.2",
              "Random roads of 1 km; the printed comparison with a figure of Da Silva (2004) has no numbers, so the "
              "sum of the amplitudes of Eq 4.2, worked out by hand, stands beside them.", run,
              items=(Item("Fig 4.3", Word.AGREES,
                          "A generated road of 16 cm3 is as high as Eq 4.2 makes it, and of class A."),
                     Item("Fig 4.4", Word.MISPRINT, "A road of 256 cm3 is of class C; 4.3.4 calls class D poor."),
                     Item("Fig 4.5", Word.AGREES,
                          "The mean elevations are those of Eq 4.2, in proportion to the root of the degree of "
                          "roughness."),
                     Item("Eq 4.1", Word.MISPRINT, "Its argument lacks 2 pi, which Appendix A has: n is in cycle/m.")))
