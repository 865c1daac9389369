"""Table 4.5: error of the front stiffness, found together with mass and rear stiffness, from 25 starts (4.4.4)."""

from logger.studies.fit_methods import FRONT
from logger.studies.starts import HOW, from_25_starts
from logger.studies.study import Effort, Result, Study, Word

PRINTED_PERCENT = (
    (0.50, 1.29, 1.04, 0.78, 0.51),
    (1.29, 1.10, 0.82, 0.84, 0.50),
    (0.78, 0.83, 0.23, 0.24, 0.24),
    (0.86, 0.89, 0.54, 0.41, 0.65),
    (0.87, 0.38, 0.85, 0.15, 0.18),
)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    return from_25_starts(effort, FRONT, PRINTED_PERCENT)


STUDY = Study("table_4_5",
              "Front suspension stiffness from 25 starts, mass and both stiffnesses unknown",
              "Table 4.5, section 4.4.4", HOW, run,
              covers=("Table 4.5",), word=Word.BETTER,
              because="From every start ours ends at one estimate, where the printed errors differ among themselves.")
