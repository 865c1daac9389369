"""The sprung mass out of one bump: a published way, what packages for identification make of it, and ridelog.

Zhao, Nagayama and Xue (2019) find the numbers of a half car from a phone's record over a hump of known size. Their
record is not published, so ours stands beside what packages made of a simulated one, which no paper prints either.
"""

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.checks import Statement, Word
from logger.studies.drives import BUMP_MPS, Conditions, bump, record_of
from logger.studies.fit_methods import MASS, error_percent, fitted, standard_error_percent
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PEERS = (("SciPy least_squares, own simulator", -0.07, 0.07), ("lmfit 1.3.4, the same simulator", -0.07, 0.07),
         ("jax-sysid 1.1, own state equation", -0.07, None), ("SIPPY, nfoursid, Octave, python-control", None, None))
"""Package, error of the mass [%], the standard error that it gives [%], in runs of our own on one simulated record; the
last ones give poles and no mass."""
SCATTER = 0.07
"""Standard error of the mass by the record alone [%]: what any unbiased fit scatters by at least."""
_RECORDS, _SECONDS, _BUMP_AT_M, _START_KG = 40, 6.0, 8.0, 800.0
_SURE = 3.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    fits = [fitted(record_of(bump(_BUMP_AT_M), BUMP_MPS, _SECONDS, Conditions(seed=seed)), {MASS: _START_KG}, ours=True)
            for seed in effort.each(range(effort.count(_RECORDS, 5)))]
    errors = np.array([error_percent(one, MASS) for one in fits])
    given = np.array([standard_error_percent(one, MASS) for one in fits])
    rms = float(np.sqrt(np.mean(errors**2)))
    # A scatter of n draws is itself off by its share 1 / sqrt(2 n).
    near = _SURE * SCATTER / np.sqrt(2 * len(errors))
    values = (Statement("error of the mass, r.m.s. [%]", "0.07 % off, in runs of our own of SciPy and lmfit", rms, 0.0,
                        SCATTER + float(near), Word.NOT_REPRODUCIBLE),
              Statement("standard error that is given over that of the record", "the same",
                        float(given.mean()) / SCATTER,
                        1 - float(near) / SCATTER, 1 + float(near) / SCATTER, Word.NOT_REPRODUCIBLE))
    inside = float(np.mean(np.abs(errors) < 2 * given))
    table = Table("The mass from one bump (nothing of it is printed)", (
        Column("package, run by us"), Column("error [%]", "+.2f"), Column("its standard error [%]", ".2f")),
        (*PEERS, (f"ridelog, r.m.s. of {len(errors)} records", rms, float(given.mean()))))
    verdict = (f"The mass comes out {rms:.2f} % off (r.m.s. over {len(errors)} records), as near as the record's "
               "noise lets anybody come, and its standard error says so: the truth lies within two of them in "
               f"{inside:.0%}. Packages that are given the car's equations do as well; those without find frequencies "
               "and no mass. The paper finds all of a car's numbers by a genetic algorithm.")
    picture = Picture(Curves("Error of the mass, record by record", "record", "error [%]", (
        Line("ours", np.arange(1.0, len(errors) + 1), errors, given, dots=True),)))
    return Result((table,), verdict, (picture,), values)


STUDY = Study(
    "mass_from_a_bump", "The mass from one bump", "Errors of the mass",
    "The half car of Table 4.2 of the dissertation over its bump of 0.15 m by 2.6 m at 16.1 km/h: 6 s at 100 Hz with "
    "white noise of 0.05 m/s2; the mass alone is sought, from 800 kg.", run,
    items=(Item("hidden mass from a bump", Word.NOT_REPRODUCIBLE,
                "The paper's record was not published; on a simulated one error and standard error are those that the "
                "noise leaves."),),
    source="B. Zhao, T. Nagayama, K. Xue, Journal of Sound and Vibration 457, 2019; packages run by ridelog's "
           "developers")
