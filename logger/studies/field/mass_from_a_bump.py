"""The sprung mass out of one bump: what the packages for identification make of it, and ridelog."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.drives import BUMP_MPS, Conditions, bump, record_of
from logger.studies.fit_methods import MASS, error_percent, fitted, standard_error_percent
from logger.studies.study import Column, Effort, Result, Study, Table, Value, Word

PEERS = (("SciPy least_squares, own simulator", -0.07, 0.07), ("lmfit 1.3.4, the same simulator", -0.07, 0.07),
         ("jax-sysid 1.1, own state equation", -0.07, None), ("SIPPY, nfoursid, Octave, python-control", None, None))
"""Package, error of the mass [%], the standard error that it gives [%]; the last ones give poles and no mass."""
SCATTER = 0.07
"""Standard error of the mass by the record alone [%]: what any unbiased fit scatters by at least."""
_RECORDS, _SECONDS, _BUMP_AT_M, _START_KG = 40, 6.0, 8.0, 800.0
_SURE = 3.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    fits = [fitted(record_of(bump(_BUMP_AT_M), BUMP_MPS, _SECONDS, Conditions(seed=seed)), {MASS: _START_KG}, ours=True)
            for seed in effort.each(range(effort.count(_RECORDS, 5)))]
    errors = np.array([error_percent(one, MASS) for one in fits])
    told = np.array([standard_error_percent(one, MASS) for one in fits])
    rms = float(np.sqrt(np.mean(errors**2)))
    # A scatter of n draws is itself off by its share 1 / sqrt(2 n).
    near = _SURE * SCATTER / np.sqrt(2 * len(errors))
    values = (Value("error of the mass, r.m.s. [%]", SCATTER, rms, float(near)),
              Value("standard error that is given [%]", SCATTER, float(told.mean()), float(near)))
    inside = float(np.mean(np.abs(errors) < 2 * told))
    table = Table("The mass from one bump", (
        Column("package"), Column("error [%]", "+.2f"), Column("its standard error [%]", ".2f")),
        (*PEERS, (f"ridelog, mean of {len(errors)} records", float(errors.mean()), float(told.mean()))))
    verdict = (f"The mass comes out {rms:.2f} % off (r.m.s. over {len(errors)} records), as near as the record's noise "
               f"lets anybody come, and its standard error says so: the truth lies within two of them in {inside:.0%}. "
               "Those that know the car's equations agree; packages without them find frequencies and no mass.")
    picture = Curves("Error of the mass, record by record", "record", "error [%]", (
        Line("ours", np.arange(1.0, len(errors) + 1), errors, told, dots=True),))
    return Result((table,), verdict, (picture,), values)


STUDY = Study(
    "mass_from_a_bump", "The mass from one bump", "Errors of the mass",
    "The half car of Table 4.2 of the dissertation over its bump of 0.15 m by 2.6 m at 16.1 km/h: 6 s at 100 Hz with "
    "white noise of 0.05 m/s2; the mass alone is sought, from 800 kg.", run,
    covers=("hidden mass from a bump",), word=Word.AGREES,
    because="Error and standard error are those that the noise of the record leaves, as with the best packages.",
    source="SciPy, lmfit, jax-sysid and SIPPY, run side by side in 2026")
