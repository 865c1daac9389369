"""Table 5.2: modal frequencies from the Fourier transforms of two sensors, and the damping of Eq 5.3 (5.3)."""

from logger.modal.decrement import damping_of_two_peaks
from logger.modal.five_storey import DAMPING_RATIO, compare_sensors
from logger.studies.dissertation.table_5_1 import HOW
from logger.studies.study import Column, Effort, Result, Study, Table, Word

PRINTED_HZ = (0.074, 2.548, 4.226)  # both sensors
PRINTED_PEAKS_G, PRINTED_CYCLES = (0.198, 0.085), 10


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    (ps2119, phone), = (compare_sensors() for _ in effort.each(range(1)))
    rows = tuple((float(mode), printed, *ours) for mode, (printed, *ours) in enumerate(
        zip(PRINTED_HZ, ps2119.peaks_hz, phone.peaks_hz, strict=True), start=1))
    table = Table("Peaks of the spectrum", (Column("mode", ".0f"), Column("printed, both sensors [Hz]", ".3f"),
                                            Column("our PS-2119 [Hz]", ".3f"), Column("our BMA220 [Hz]", ".3f")), rows)
    printed = 100 * damping_of_two_peaks(*PRINTED_PEAKS_G, PRINTED_CYCLES)
    damping = Table("Damping ratio by the decrement, Eq 5.2", (
        Column("sensor"), Column("printed, Eq 5.3 [%]", ".2f"), Column("ours [%]", ".3f"),
        Column("standard deviation [%]", ".3f")), tuple(
        (one.sensor.name, printed, 100 * one.decrement.damping_ratio, 100 * one.decrement.damping_std)
        for one in (ps2119, phone)))
    verdict = ("The printed 0.074 Hz is a misprint for the 0.7419 Hz of Table 5.4. Both sensors show the same first "
               "two peaks here, as there; the third is some bins off where steps of 0.0625 g bury it. Ours lie at "
               "the frequencies of the model that was simulated, 0.744, 2.594 and 4.523 Hz, in bins of 1/75 Hz; the "
               "real building's second and third are 2 and 7 % lower. The decrement over all peaks gives back the "
               f"{100 * DAMPING_RATIO:.2f} % that were put in, with an error beside it; Eq 5.3 takes two of them (its "
               "rounded peaks give 1.35). The table above Eq 5.3 has 0.8545 where it needs 0.0855 g.")
    return Result((table, damping), verdict)


STUDY = Study("table_5_2",
              "Modal frequencies from two sensors, and damping", "Table 5.2, section 5.3, with Eq 5.3", HOW, run,
              covers=("Table 5.2",), word=Word.MISPRINT,
              because="The printed 0.074 Hz is 0.7419 Hz, as in Table 5.4.")
