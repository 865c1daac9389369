"""Five modes under white noise with a tenth of noise: the example that pyOMA2 prints, and what ridelog finds."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.modal.analysis import find_modes
from logger.modal.structure_response import Masses, chain, random_response, with_damping_ratios
from logger.studies.checks import Check, Statement, Value, Word
from logger.studies.drives import Array
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED_TRUE_HZ, PRINTED_TRUE_DAMPING = (0.890, 2.598, 4.095, 5.261, 6.000), 0.02
PRINTED_HZ = (0.889, 2.601, 4.096, 5.275, 6.031)
PRINTED_DAMPING = (0.028, 0.018, 0.018, 0.024, 0.022)
"""What its SSI-dat gives at order 16, the true frequencies being named by hand."""
_FLOOR_KG, _STOREY_N_PER_M = 25.91, 10_000.0
_RECORDS, _RATE_HZ, _LENGTH_S, _DECIBEL, _NEAR = 5, 20.0, 300.0, 20.0, 0.05
_HALF_DIGIT, _SURE = 0.0005, 3.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    building = with_damping_ratios(*chain(np.full(5, _FLOOR_KG), np.full(5, _STOREY_N_PER_M)),
                                   np.full(5, PRINTED_TRUE_DAMPING))
    true_hz = np.sort(np.abs(building.poles()[0])) / (2 * np.pi)
    missed, extra, records, count = 0, 0, [], effort.count(_RECORDS, 2)
    for seed in effort.each(range(count)):
        found = find_modes(_record(building, seed), _RATE_HZ).modes
        near = [[mode for mode in found if abs(mode.frequency_hz / hz - 1) < _NEAR] for hz in true_hz]
        missed += sum(not one for one in near)
        extra += len(found) - sum(map(bool, near))
        if all(near):
            records.append([(one[0].frequency_hz, one[0].damping_ratio, one[0].frequency_std_hz, one[0].damping_std)
                            for one in near])
    numbers = np.array(records or [[(np.nan,) * 4] * 5])
    hz, damping, hz_std, damping_std = numbers[0].T
    values: list[Check] = [Value(f"mode {mode} of the building [Hz]", printed, float(ours), _HALF_DIGIT)
                           for mode, (printed, ours) in enumerate(zip(PRINTED_TRUE_HZ, true_hz, strict=True), start=1)]
    values += _beside("frequency of mode {} found [Hz]", PRINTED_HZ, PRINTED_TRUE_HZ, hz, hz_std)
    values += _beside("damping ratio of mode {} found", PRINTED_DAMPING, (PRINTED_TRUE_DAMPING,) * 5, damping,
                      damping_std)
    values += [Statement(f"modes missed in {count} records", "found where they are named by hand", float(missed),
                         0,
                         0, Word.BETTER),
               Statement("modes that are not there", "found where they are named by hand", float(extra), 0, 0,
                         Word.BETTER)]
    worst = 100 * float(max(abs(one / PRINTED_TRUE_DAMPING - 1) for one in PRINTED_DAMPING))
    ours = 100 * float(np.median(np.abs(numbers[:, :, 1] / PRINTED_TRUE_DAMPING - 1).max(axis=1)))
    verdict = (f"In {count} records {missed} of {5 * count} modes are missed and {extra} found that are not there, "
               "without a person who names them; the example is given their frequencies. The worst damping is "
               f"{ours:.0f} % off on the median, {worst:.0f} % in the print, and here each has a standard error: 300 s "
               "of random shaking show a damping no better. Versions of the example differ in the record's length; "
               "the current one's is taken, 300 s.")
    table = Table("The first record", (
        Column("mode", ".0f"), Column("true [Hz]", ".3f"), Column("printed [Hz]", ".3f"), Column("ours [Hz]", ".3f"),
        Column("its standard error [Hz]", ".3f"), Column("printed damping", ".3f"), Column("ours", ".4f"),
        Column("its standard error", ".4f")), tuple(
        (float(mode), *map(float, row)) for mode, row in enumerate(zip(
            PRINTED_TRUE_HZ, PRINTED_HZ, hz, hz_std, PRINTED_DAMPING, damping, damping_std, strict=True), start=1)))
    picture = Picture(Curves("Damping ratio of each mode, in each record", "frequency [Hz]", "damping ratio", (
        Line("ours", np.tile(true_hz, len(numbers)), numbers[:, :, 1].ravel(), dots=True),
        Line("printed", np.array(PRINTED_HZ), np.array(PRINTED_DAMPING), dots=True)),
        level=(PRINTED_TRUE_DAMPING, "true")), "one record's damping ratios, as numbers")
    return Result((table,), verdict, (picture,), tuple(values))


def _record(building: Masses, seed: int) -> Array:
    """Accelerations (samples, 5) under a white force on each floor, with a tenth of noise."""
    rng = np.random.default_rng(seed)
    clean = random_response(building, rng.standard_normal((4 * round(_LENGTH_S * _RATE_HZ), 5)), _RATE_HZ)
    return np.asarray(clean + 10 ** (-_DECIBEL / 20) * clean.std(axis=0) * rng.standard_normal(clean.shape))


def _beside(name: str, printed: tuple[float, ...], true: tuple[float, ...], ours: Array, std: Array) -> list[Value]:
    """Two estimates of one truth differ by what both are off: theirs by what the print shows, ours by chance."""
    return [Value(name.format(mode), theirs, float(mine), abs(theirs - truth) + _SURE * float(error) + _HALF_DIGIT)
            for mode, (theirs, truth, mine, error) in enumerate(zip(printed, true, ours, std, strict=True), start=1)]


STUDY = Study(
    "five_modes", "Five modes at 20 dB", "Example 1: getting started",
    "The example's building: five floors of 25.91 kg, storeys of 10,000 N/m, 2 % of damping, a white force on each "
    "floor, a tenth of noise (20 dB); 300 s at 20 Hz, to which the example decimates.", run,
    items=(Item("five modes at 20 dB", Word.BETTER,
                "All five come out without being named, each with a standard error."),),
    source="D. P. Pasca et al., pyOMA2, Examples/Example1.ipynb, printed January 2025")
