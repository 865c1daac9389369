"""Table 2.2 and Fig 2.5: the classes of ISO 8608, and roads of each of them (2.2.1)."""

from itertools import pairwise

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.elevation_spectrum import classify, spectrum
from logger.roads.iso8608 import CLASS_GD_N0_CM3, HIGHEST_CPM, LOWEST_CPM, displacement_psd, generate, road_class
from logger.studies.checks import Value, Word, about
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table

PRINTED = (("A", None, 16, 32), ("B", 32, 64, 128), ("C", 128, 256, 512), ("D", 512, 1_024, 2_048),
           ("E", 2_048, 4_096, 8_192), ("F", 8_192, 16_384, 32_768), ("G", 32_768, 65_536, 131_072),
           ("H", 131_072, 262_144, None))
"""Class, lower limit, geometric mean, upper limit [cm3]."""
_ROADS, _LENGTH_M, _SPACING_M = 20, 1000.0, 0.05
_HALVINGS = 50
_SHORT_M = 200.0  # one segment of a spectrum, also at twice the length
_PRINTED_POWER = 1.0  # of a metre, in m2 (cycle/m)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    limits = [_limit(*pair) for pair in pairwise(CLASS_GD_N0_CM3.items())]
    roads = effort.count(_ROADS, 2)
    rows: list[tuple[Cell, ...]] = []
    values: list[Value] = []
    for (name, lower, mean, upper), ours in zip(effort.each(PRINTED), [*limits, None], strict=True):
        found = [classify(generate(CLASS_GD_N0_CM3[name], _LENGTH_M, _SPACING_M, seed), _SPACING_M)
                 for seed in range(roads)]
        gd, waviness = (float(np.mean([getattr(one, what) for one in found])) for what in ("gd_n0_cm3", "waviness"))
        right = sum(one.road_class == name for one in found)
        rows.append((name, lower, mean, upper, ours, gd, waviness, 100 * right / roads))
        values += about("Table 2.2", [Value(f"class {name}, geometric mean [cm3]", mean, CLASS_GD_N0_CM3[name], 0.0)])
        if upper is not None and ours is not None:
            values += about(("Table 2.2", "Fig 2.5"), [
                Value(f"class {name}, upper limit [cm3]", upper, ours, 1e-6 * upper)])
    values += about("Table 2.2", [Value("power of a metre in the unit of Gd", _PRINTED_POWER, _power_of_a_metre(), 0.01,
                                        Word.MISPRINT)])
    table = Table(f"Classes, and {roads} generated roads of each geometric mean", (
        Column("class"), Column("printed lower [cm3]", ".0f"), Column("printed mean [cm3]", ".0f"),
        Column("printed upper [cm3]", ".0f"), Column("our upper [cm3]", ".1f"),
        Column("Gd(n0) found in the roads [cm3]", ".4g"), Column("waviness found", ".3f"),
        Column("put into the right class [%]", ".0f")), tuple(rows))
    verdict = ("All limits and means agree. The printed unit, 1e-6 m2 (cycle/m), is a misprint: a displacement "
               "spectrum is in m2 per cycle/m, that is m3, and 1e-6 of it are cm3. Roads that were generated at each "
               "mean are found again with their degree of roughness, a waviness near 2 and their class. The power of "
               "a metre is that by which the spectrum of a road grows when all its lengths are doubled.")
    n = np.array([LOWEST_CPM, HIGHEST_CPM])
    picture = Picture(Curves("Bounds of the classes, waviness 2", "wave number [cycle/m]", "displacement spectrum [m3]",
                             tuple(Line(f"upper limit of {name}", n, displacement_psd(n, limit))
                                   for name, limit in zip(CLASS_GD_N0_CM3, limits, strict=False)), log_x=True,
                             log_y=True),
                      "the bounds of the classes over the spectrum, within the wave numbers of interest")
    return Result((table,), verdict, (picture,), tuple(values))


def _power_of_a_metre() -> float:
    """Of a spectrum: by how many doublings it grows when heights and distances of a road are twice as large."""
    road = generate(CLASS_GD_N0_CM3["B"], _SHORT_M, _SPACING_M, 0)
    plain, doubled = spectrum(road, _SPACING_M), spectrum(2 * road, 2 * _SPACING_M)
    return float(np.median(np.log2(doubled.psd_m3 / plain.psd_m3)))


def _limit(smoother: tuple[str, float], rougher: tuple[str, float]) -> float:
    """The degree of roughness [cm3] at which the word for a road changes."""
    low, high = smoother[1], rougher[1]
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if road_class(middle) == rougher[0] else (middle, high)
    return high


STUDY = Study("table_2_2", "The classes of ISO 8608, and roads of each", "Table 2.2, section 2.2.1",
              "The limits are those at which ridelog's word for a road changes; roads of 1 km are generated at each "
              "class's geometric mean and classified from their elevations alone.", run,
              items=(Item("Table 2.2", Word.MISPRINT,
                          "All limits agree; the printed unit should be 1e-6 m2 per cycle/m, which is cm3."),
                     Item("Fig 2.5", Word.AGREES, "Its bounds are the limits of the table, at waviness 2.")))
