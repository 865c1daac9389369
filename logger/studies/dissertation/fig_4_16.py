"""Fig 4.16 and 4.17: IRI of 400 random roads by their degree of roughness, and Eq 4.39 (4.3.4)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.gd_iri import iri_of_road
from logger.roads.iri import iri
from logger.roads.iso8608 import IRI_PER_ROOT_GD, generate
from logger.studies.checks import Value, Word, about
from logger.studies.study import Column, Effort, Picture, Result, Study, Table, alike

PRINTED_POWER = 0.5
RANGE_CM3 = (2.0, 4096.0)
_SETS, _ROADS, _LENGTH_M, _SPACING_M = 4, 100, 500.0, 0.1


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    roads = effort.count(_ROADS, 12)
    gd = np.geomspace(*RANGE_CM3, roads)
    found = np.array([[iri(generate(one, _LENGTH_M, _SPACING_M, number * roads + place), _SPACING_M)
                       for place, one in enumerate(gd.tolist())] for number in effort.each(range(_SETS))])
    fits = [_power_law(gd, one) for one in found]
    power, factor = _power_law(np.tile(gd, _SETS), found.ravel())
    # From road to road the IRI of so short a road has this spread, so the regression has these standard errors.
    spread = iri_of_road(1.0, _LENGTH_M).std / iri_of_road(1.0, _LENGTH_M).value
    terms = np.column_stack([np.ones(_SETS * roads), np.log(np.tile(gd, _SETS))])
    factor_std, power_std = (spread * np.sqrt(np.diag(np.linalg.inv(terms.T @ terms)))).tolist()
    values = about(("Fig 4.16", "Fig 4.17"), [
        Value("c of IRI = c Gd^b", IRI_PER_ROOT_GD, factor, 0.01 + 3 * factor * factor_std),
        Value("b of IRI = c Gd^b", PRINTED_POWER, power, 3 * power_std)])
    table = Table(f"Power laws through {roads} roads each", (
        Column("set"), Column("c", ".4f"), Column("b", ".4f")),
        (*((f"ours, {number + 1}", one[1], one[0]) for number, one in enumerate(fits)),
         ("ours, all", factor, power), ("printed, Eq 4.39", IRI_PER_ROOT_GD, PRINTED_POWER),
         ("ours, computed", iri_of_road(1.0, _LENGTH_M).value, 0.5)))
    verdict = (f"Four sets of {roads} roads lie about a power law, {factor:.3f} Gd^{power:.3f} here beside 0.5386 "
               "Gd^0.5, which is a straight line on logarithmic axes as printed. The tolerance is three standard "
               "errors of the regression (the length of the printed roads is not given; ours have 500 m and differ by "
               f"{100 * spread:.0f} % from road to road), and 0.01 for the choice of waves: computed over 0.011 to "
               "2.83 cycle/m the factor is 0.543.")
    dots = tuple(Line(f"set {number + 1}", gd, one, dots=True) for number, one in enumerate(found))
    law = Line("Eq 4.39", gd, IRI_PER_ROOT_GD * gd**PRINTED_POWER)
    pictures = tuple(Picture(Curves(title, "Gd(n0) [cm3]", "IRI [m/km]", (*dots, law), log_x=logarithmic,
                                    log_y=logarithmic), printed)
                     for title, logarithmic, printed in (
                         ("IRI by degree of roughness (Fig 4.16)", False, "four sets of 100 dots and their trendline"),
                         ("The same on logarithmic axes (Fig 4.17)", True, "the same, on a straight line")))
    return Result((table,), verdict, pictures, values)


def _power_law(gd: np.ndarray, iri_m_per_km: np.ndarray) -> tuple[float, float]:
    """Power and factor of Eq 4.37."""
    power, level = np.polyfit(np.log(gd), np.log(iri_m_per_km), 1)
    return float(power), float(np.exp(level))


STUDY = Study("fig_4_16", "IRI of 400 random roads by their degree of roughness", "Fig 4.16, section 4.3.4",
              "Four sets of 100 random roads of 2 to 4096 cm3 as in the source, each with phases of its own; exact IRI "
              "of ASTM E1926.", run,
              items=alike(("Fig 4.16", "Fig 4.17"), Word.AGREES,
                          "The power law through the roads is Eq 4.39 within the chance of the roads."))
