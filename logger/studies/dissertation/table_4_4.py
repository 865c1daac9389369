"""Table 4.4: error of the mass, found together with both stiffnesses, from 25 starts (4.4.4)."""

from logger.studies.fit_methods import MASS
from logger.studies.starts import HOW, from_25_starts
from logger.studies.study import Effort, Result, Study, Word

PRINTED_PERCENT = (
    (0.96, 2.04, 1.96, 1.95, 1.91),
    (1.43, 1.20, 1.12, 1.45, 0.94),
    (1.05, 0.68, 0.18, 0.54, 0.67),
    (1.11, 1.14, 1.05, 1.07, 0.84),
    (1.93, 1.92, 2.19, 1.98, 2.40),
)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    return from_25_starts(effort, MASS, PRINTED_PERCENT)


STUDY = Study("table_4_4",
              "Sprung mass from 25 starts, mass and both stiffnesses unknown", "Table 4.4, section 4.4.4", HOW, run,
              covers=("Table 4.4",), word=Word.BETTER,
              because="From every start ours ends at one estimate, where the printed errors differ among themselves.")
