"""Table 5.1 and Fig 5.8: two sensors on one structure, and their r.m.s. (5.3)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.modal.five_storey import PRINTED_RMS, RATE_HZ, SENSORS, compare_sensors, recorded, released, structure
from logger.studies.drives import Array
from logger.studies.study import Column, Effort, Result, Study, Table, Value, Word
from logger.units import STANDARD_GRAVITY_MPS2

PRINTED_DIFFERENCE_PERCENT = 2.85  # Eq 5.1
_SHOWN = 1500
HOW = ("Simulated: the five-storey building of 5.3 with 1.34 % of damping, pulled aside and let go, 75 s at 100 Hz; "
       "a PS-2119 with steps of 0.01 g and a BMA220 with steps of 0.0625 g and 2 % less gain on its top floor. The "
       "source measured; its records were never published. Gains and noise of the sensors are assumed.")


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    compared = [compare_sensors(seed) for seed in effort.each(range(1, 1 + effort.count(20)))]
    first, second = compared[0]
    differences = [100 * abs(phone.rms_g - ps2119.rms_g) / ps2119.rms_g for ps2119, phone in compared]
    values = (*(Value(f"r.m.s. of the {name} [g]", printed, one.rms_g, 0.015, Word.NOT_REPRODUCIBLE)
                for name, printed, one in zip(("PS-2119", "iPhone"), PRINTED_RMS, compared[0], strict=True)),
              Value("difference of the two, Eq 5.1 [%]", PRINTED_DIFFERENCE_PERCENT, float(np.mean(differences)), 2.0,
                    Word.NOT_REPRODUCIBLE),
              Value("r.m.s. of the PS-2119, in the printed unit [m/s2]", PRINTED_RMS[0],
                    first.rms_g * STANDARD_GRAVITY_MPS2, 0.01, Word.MISPRINT))
    apart = Table("Difference of the two", (Column("printed, Eq 5.1 [%]", ".2f"), Column("ours, least [%]", ".2f"),
                                            Column("ours, most [%]", ".2f")),
                  ((PRINTED_DIFFERENCE_PERCENT, min(differences), max(differences)),))
    verdict = (f"Of one size: {first.rms_g:.4f} and {second.rms_g:.4f} g beside 0.0458 and 0.0445. How long the "
               "source recorded, and how its push set off the higher modes, is not told, and both move the figure. "
               f"That two sensors differ by some per cent agrees ({min(differences):.1f} to {max(differences):.1f} % "
               f"over {len(compared)} draws of their noise). The unit of the print cannot be m/s2: peaks of 0.198 and "
               "0.085 g (Eq 5.3) and 1.34 % of damping make some 0.05 g, ten times as much as 0.05 m/s2.")
    records = tuple(Line(sensor.name, *_shown(number)) for number, sensor in reversed(list(enumerate(SENSORS))))
    return Result((apart,), verdict, (
        Curves("Fig 5.8: the first 15 s. Printed: both records, peaks and phases alike", "time [s]",
               "acceleration [g]", records),), values)


def _shown(number: int) -> tuple[Array, Array]:
    """Times [s] and readings [g] of a sensor on the top floor."""
    reading = recorded(released(structure())[:, 4], SENSORS[number], 1 + number)[:_SHOWN]
    return np.arange(_SHOWN) / RATE_HZ, reading / STANDARD_GRAVITY_MPS2


STUDY = Study("table_5_1", "R.m.s. of two sensors on the five-storey building", "Table 5.1, section 5.3", HOW, run,
              covers=("Table 5.1", "Fig 5.8"), word=Word.MISPRINT,
              because="The r.m.s. agrees in size if its unit is g, as the peaks of Eq 5.3 demand, not m/s2.")
