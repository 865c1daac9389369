"""Fig 4.21: the mass from windows of 5 to 100 m around a bump (4.4.1.1)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.studies.checks import Value, Word
from logger.studies.drives import BUMP_MPS, Conditions, bump, record_of, until
from logger.studies.fit_methods import MASS, TRUTH, fitted
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

WINDOWS_M = tuple(float(end) for end in range(5, 101, 5))
_BUMP_AT_M = 1.0
BOTH_AXLES_M = 10.0
VERY_CLOSE = 0.02  # two standard errors of ours on such a road are twice that


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    whole = record_of(bump(_BUMP_AT_M), BUMP_MPS, (WINDOWS_M[-1] + 1) / BUMP_MPS, Conditions(iri_m_per_km=5.0))
    windows = effort.some(WINDOWS_M, 4)
    white, ours = zip(*([fitted(until(whole, window), {MASS: 800.0}, ours=way) for way in (False, True)]
                        for window in effort.each(windows)), strict=True)
    mass, expected = (np.array([getattr(one, what)[MASS] for one in ours]) for what in ("parameters",
                                                                                        "standard_errors"))
    their_mass = np.array([one.parameters[MASS] for one in white])
    numbers = np.stack([their_mass, mass, expected, 100 * (mass / TRUTH[MASS] - 1)], axis=1).tolist()
    rows = tuple((window, "very close to 875", *found) for window, found in zip(windows, numbers, strict=True))
    table = Table("Mass, by the length of the window", (
        Column("window [m]", ".0f"), Column("printed [kg]"), Column("white noise, their way [kg]", ".1f"),
        Column("ours [kg]", ".1f"), Column("standard error [kg]", ".1f"), Column("ours off by [%]", "+.2f")), rows)
    inside = int((np.abs(mass - TRUTH[MASS]) < 2 * expected).sum())
    verdict = ("As the source finds, the window hardly matters once both axles are over the bump (some 8 m): the "
               f"bump tells of the mass, the road behind it next to nothing. {inside} of {len(windows)} windows have "
               "the truth within two standard errors; all share one road, so they err together. In 5 m, where only the "
               "front axle is over the bump, their way is a little farther off.")
    picture = Picture(Curves("Mass and its standard error", "window [m]", "mass [kg]", (
        Line("ours", np.array(windows), mass, expected),
        Line("white noise, their way", np.array(windows), their_mass, dots=True)), (TRUTH[MASS], "875 kg")),
        "the mass from windows of 5 to 100 m, very close to 875 kg for each")
    values = tuple(Value(f"mass, the worst window from {least:g} m, {way} [kg]", TRUTH[MASS], _worst(
        found, np.array(windows) >= least), VERY_CLOSE * TRUTH[MASS], Word.NOT_REPRODUCIBLE)
                   for way, found, least in (("their way", their_mass, BOTH_AXLES_M), ("ours", mass, 0.0)))
    return Result((table,), verdict, (picture,), values)


def _worst(mass_kg: np.ndarray, chosen: np.ndarray) -> float:
    """The one farthest from the truth."""
    return float(max(mass_kg[chosen].tolist(), key=lambda one: abs(one - TRUTH[MASS])))


STUDY = Study("fig_4_21", "Mass from windows of 5 to 100 m", "Fig 4.21, section 4.4.1.1",
              "Simulated as in the source: one bump (of 5.5.2; the text gives no size) at the start of the window, "
              "16.1 km/h, on a road of IRI 5 m/km that the fit does not know.", run,
              items=(Item("Fig 4.21", Word.NOT_REPRODUCIBLE,
                          "Size of the bump and road are not printed; simulated, the window hardly matters once both "
                          "axles are over the bump, as the text says."),))
