"""Table 5.1: r.m.s. of two sensors on one structure (5.3)."""

from logger.modal.five_storey import PRINTED_RMS, compare_sensors
from logger.studies.study import Column, Effort, Result, Study, Table, Word

PRINTED_DIFFERENCE_PERCENT = 2.85  # Eq 5.1
HOW = ("Simulated: the five-storey building of 5.3 with 1.34 % of damping, pulled aside and let go, 75 s at 100 Hz; "
       "a PS-2119 with steps of 0.01 g and a BMA220 with steps of 0.0625 g and 2 % less gain on its top floor. The "
       "source measured; its records were never published. Gains and noise of the sensors are assumed.")


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    compared = [compare_sensors(seed) for seed in effort.each(range(1, 1 + effort.count(20)))]
    first, second = compared[0]
    differences = [100 * abs(phone.rms_g - ps2119.rms_g) / ps2119.rms_g for ps2119, phone in compared]
    rows = tuple((one.sensor.name, printed, one.rms_g)
                 for one, printed in zip((first, second), PRINTED_RMS, strict=True))
    table = Table("R.m.s. of the whole record", (Column("sensor"), Column("printed [m/s2, which must be g]", ".4f"),
                                                 Column("ours [g]", ".4f")), rows)
    apart = Table("Difference of the two", (Column("printed, Eq 5.1 [%]", ".2f"), Column("ours, least [%]", ".2f"),
                                            Column("ours, most [%]", ".2f")),
                  ((PRINTED_DIFFERENCE_PERCENT, min(differences), max(differences)),))
    verdict = (f"Of one size: {first.rms_g:.4f} and {second.rms_g:.4f} g beside 0.0458 and 0.0445. How long the "
               "source recorded, and how its push set off the higher modes, is not told, and both move the figure. "
               f"That two sensors differ by some per cent agrees ({min(differences):.1f} to {max(differences):.1f} % "
               f"over {len(compared)} draws of their noise). The unit of the print cannot be m/s2: peaks of 0.198 and "
               "0.0855 g (Eq 5.3) and 1.34 % of damping make some 0.05 g, ten times as much as 0.05 m/s2.")
    return Result((table, apart), verdict)


STUDY = Study("table_5_1", "R.m.s. of two sensors on the five-storey building", "Table 5.1, section 5.3", HOW, run,
              covers=("Table 5.1",), word=Word.MISPRINT,
              because="The r.m.s. agrees in size if its unit is g, as the peaks of Eq 5.3 demand, not m/s2.")
