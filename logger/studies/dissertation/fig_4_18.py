"""Fig 4.18: roads generated for an IRI, and the IRI that they have (4.3.4)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.gd_iri import relative_spread
from logger.roads.iri import iri
from logger.roads.iso8608 import gd_n0_from_iri, generate
from logger.studies.checks import Check, Statement, Value, Word
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

WANTED_M_PER_KM = tuple(float(one) for one in range(1, 21))
_SETS, _LENGTH_M, _SPACING_M = 2, 500.0, 0.1


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    wanted = np.array(effort.some(WANTED_M_PER_KM, 10))
    found = np.array([[iri(generate(gd_n0_from_iri(one), _LENGTH_M, _SPACING_M, 1000 * number + place), _SPACING_M)
                       for place, one in enumerate(wanted.tolist())] for number in effort.each(range(_SETS))])
    slopes = [float(one @ wanted / (wanted @ wanted)) for one in found]
    alike_sets = [float(np.corrcoef(wanted, one)[0, 1]) for one in found]
    # A slope is a mean of the roads' relative errors with weights that grow as the square of the IRI.
    chance = relative_spread(_LENGTH_M) * float(np.sqrt((wanted**4).sum()) / (wanted**2).sum())
    values: tuple[Check, ...] = (*(Value(f"set {number + 1}, IRI found per IRI wanted", 1.0, slope, 0.01 + 3 * chance)
                for number, slope in enumerate(slopes)),
              Statement("correlation, the smaller of both sets", "highly linear", min(alike_sets), least=0.95))
    table = Table("IRI of generated roads", (Column("printed: wanted [m/km]", ".0f"), Column("set 1 [m/km]", ".2f"),
                                             Column("set 2 [m/km]", ".2f")),
                  tuple((one, *pair) for one, pair in zip(wanted.tolist(), found.T.tolist(), strict=True)))
    spread = relative_spread(_LENGTH_M)
    verdict = (f"As printed, highly linear: correlation {min(alike_sets):.3f} and {max(alike_sets):.3f}, slopes "
               f"{slopes[0]:.3f} and {slopes[1]:.3f}. A road of 500 m made for an IRI has it within "
               f"{100 * spread:.0f} % r.m.s., which is why the source shows two sets; the tolerance is three standard "
               "errors of the slope, and 1 % for Eq 4.40. In place of ProVAL's IRI stands the exact one of ASTM "
               "E1926, which agrees with the published check profile.")
    picture = Picture(Curves("IRI of roads generated for an IRI", "IRI wanted [m/km]", "IRI [m/km]", (
        Line("as wanted", wanted, wanted), *(Line(f"set {number + 1}", wanted, one, dots=True)
                                             for number, one in enumerate(found)))),
        "two sets of roads, their IRI by ProVAL against the one wanted, highly linear")
    return Result((table,), verdict, (picture,), values)


STUDY = Study("fig_4_18", "Roads generated for an IRI, and the IRI that they have", "Fig 4.18, section 4.3.4",
              "Two sets of random roads of 500 m for an IRI of 1 to 20 m/km by Eq 4.40; exact IRI in place of ProVAL.",
              run,
              items=(Item("Fig 4.18", Word.AGREES,
                          "Roads made for an IRI have it, within the chance of roads of that length."),))
