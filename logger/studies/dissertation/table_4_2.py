"""Table 4.2: the half car, and its natural frequencies (4.3.3)."""

from logger.studies.checks import Value, Word
from logger.studies.dissertation.table_4_1 import COLUMNS, quoted, quoted_values
from logger.studies.drives import rav4
from logger.studies.study import Effort, Item, Result, Study, Table
from logger.vehicle.models import structure_of

PRINTED_HZ, PRINTED_DAMPING = (1.1, 11.0), 0.30
CURB_KG, PERSON_KG, PRINTED_MASS_KG = 1524.07, 72.57, 875.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    names, (bounce_hz, hop_hz) = ("body bounces", "body pitches", "wheels", "wheels"), PRINTED_HZ
    (rows,) = (quoted(structure_of(rav4()), names, (bounce_hz, None, hop_hz, None), (PRINTED_DAMPING, None, None, None))
               for _ in effort.each(range(1)))
    by_eq = (CURB_KG / 1.15 + 2 * PERSON_KG) / 2
    verdict = ("1.1 and 11 Hz are the undamped frequencies of bounce and wheels; the pitch, 1.45 Hz, is not named. "
               "The damping ratio of 0.30 is 0.29 with springs and tires in series, 0.28 on the springs alone, "
               "rounded. The mass does not follow from the text: by Eq 4.36 half a car with two people has "
               f"{by_eq:.0f} kg, not {PRINTED_MASS_KG:.0f}; 875 is taken as the published car. The inertia is in kg "
               "m2, not kg/m2; and the pitch rows of Eq 4.23 to 4.25 have wrong signs, those of Appendix A.2 are "
               "right.")
    values = (*quoted_values(rows, damping_within=0.015),
              Value("half of the car with two people, Eq 4.36 [kg]", PRINTED_MASS_KG, by_eq, 1.0, Word.MISPRINT,
                    of_print=True))
    return Result((Table("Vibrations of the half car", COLUMNS, rows),), verdict, (), values)


STUDY = Study("table_4_2", "Natural frequencies of the half car (RAV4)", "Table 4.2, section 4.3.3",
              "The eigenvalues of Table 4.2's car.", run,
              items=(Item("Table 4.2", Word.MISPRINT,
                          "Frequencies and damping agree; the mass does not follow from Eq 4.36, and the inertia's "
                          "unit is kg m2."),))
