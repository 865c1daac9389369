"""Table 4.6: error of the rear stiffness, found together with mass and front stiffness, from 25 starts (4.4.4)."""

from logger.studies.fit_methods import REAR
from logger.studies.starts import HOW, from_25_starts
from logger.studies.study import Effort, Result, Study, Word

PRINTED_PERCENT = (
    (1.66, 1.67, 1.44, 1.16, 0.90),
    (1.93, 1.83, 1.41, 1.15, 1.16),
    (1.68, 2.56, 1.74, 0.41, 0.38),
    (1.14, 1.15, 0.89, 0.93, 1.09),
    (0.80, 0.39, 0.69, 0.21, 0.33),
)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    return from_25_starts(effort, REAR, PRINTED_PERCENT)


STUDY = Study("table_4_6",
              "Rear suspension stiffness from 25 starts, mass and both stiffnesses unknown",
              "Table 4.6, section 4.4.4", HOW, run,
              covers=("Table 4.6",), word=Word.BETTER,
              because="From every start ours ends at one estimate, where the printed errors differ among themselves.")
