"""Fig 4.22: where a fit of the mass ends, from 20 starts (4.4.1.2)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.checks import Statement, Word
from logger.studies.drives import BUMP_MPS, Conditions, bump, record_of
from logger.studies.fit_methods import MASS, TRUTH, fitted
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED_STARTS_KG = tuple(np.linspace(700, 1100, 20).tolist())
PRINTED_WITHIN_PERCENT = 6.0
_WIDER_KG = (300.0, 400.0, 550.0, 1500.0, 2000.0, 3000.0)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    record = record_of(bump(8.0), BUMP_MPS, 12.0, Conditions(iri_m_per_km=5.0))
    kg = sorted([*effort.some(PRINTED_STARTS_KG), *effort.some(_WIDER_KG)])
    found = [fitted(record, {MASS: start}, ours=True) for start in effort.each(kg)]
    starts = np.array(kg)
    ends = np.array([one.parameters[MASS] for one in found])
    standard_error = found[0].standard_errors[MASS]
    said = f"within {PRINTED_WITHIN_PERCENT:g} % of 875"
    rows = tuple((float(start), said if 699 < start < 1101 else None, float(end), 100 * float(end / TRUTH[MASS] - 1))
                 for start, end in zip(starts, ends, strict=True))
    table = Table("Mass, by where the fit starts", (Column("start [kg]", ".1f"), Column("printed end [kg]"),
                  Column("our end [kg]", ".4f"), Column("error [%]", "+.3f")), rows)
    verdict = (f"All {len(starts)} starts, from {starts[0]:.0f} to {starts[-1]:.0f} kg, end within {np.ptp(ends):.1g} "
               f"kg of each other; the source's 20 lie within 6 % of 875 kg. The estimate itself, {ends.mean():.1f} "
               f"+- {standard_error:.1f} kg, is off by what a road of IRI 5 m/km that the fit does not know makes of "
               "it.")
    picture = Picture(Curves("Where a fit of the mass ends", "start [kg]", "end [kg]",
                             (Line("start", starts, starts), Line("end", starts, ends, dots=True)),
                             (TRUTH[MASS], "875 kg")), "the masses from 20 starts, all within 6 % of 875 kg")
    values = (Statement("largest error of any start [%]", "all within 6 % of 875 kg",
                        100 * float(np.abs(ends / TRUTH[MASS] - 1).max()), 0.0, PRINTED_WITHIN_PERCENT,
                        Word.NOT_REPRODUCIBLE),
              Statement("the ends differ by up to [kg]", "effective from every start", float(np.ptp(ends)), 0.0, 0.01,
                        Word.NOT_REPRODUCIBLE))
    return Result((table,), verdict, (picture,), values)


STUDY = Study("fig_4_22", "Mass from 20 starts, and from 300 to 3000 kg", "Fig 4.22, section 4.4.1.2",
              "Simulated as in the source: one bump (of 5.5.2; the text gives no size) at 16.1 km/h on a road of IRI 5 "
              "m/km that the fit does not know.", run,
              items=(Item("Fig 4.22", Word.NOT_REPRODUCIBLE,
                          "Size of the bump and road are not printed; simulated, all starts end at one mass, within "
                          "the printed 6 %."),))
