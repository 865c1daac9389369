"""Fig 4.31: the mass that comes out when a bridge's step is taken for one of another height (4.4.5)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.identification.obstacle_paths import RoadStep
from logger.identification.unknown_inputs import RoadInput
from logger.runs import Run
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.drives import BRIDGE_MPS, STEP_M, Conditions, bridge, record_of, without_profile
from logger.studies.fit_methods import MASS, TRUTH, fitted
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table
from logger.units import MPH_MPS

PRINTED_SPEED, PRINTED_MPH = 48.3, 30.0
HEIGHTS_M = tuple(np.linspace(0.0254, 0.0508, 9).round(6).tolist())
_STEP_AT_M, _SECONDS = 20.0, 6.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    record = without_profile(record_of(bridge(_STEP_AT_M), BRIDGE_MPS, _SECONDS, Conditions()))
    heights = effort.some(HEIGHTS_M, 3)
    white, masses = (np.array(ends) for ends in zip(*([_mass(record, height, ours) for ours in (False, True)]
                                                      for height in effort.each(heights)), strict=True))
    in_proportion = TRUTH[MASS] * np.array(heights) / STEP_M
    table = Table("Mass, by the height that the step is taken for", (
        Column("height taken [mm]", ".2f"), Column("printed: in proportion [kg]", ".1f"),
        Column("ours, what is left taken for white noise [kg]", ".1f"),
        Column("ours, innovations form [kg]", ".1f")),
        tuple(zip((1000 * np.array(heights)).tolist(), in_proportion.tolist(), white.tolist(), masses.tolist(),
                  strict=True)))
    taken = RoadInput(step=RoadStep(_STEP_AT_M, HEIGHTS_M[0]))
    place = {"step.height_m": HEIGHTS_M[0], "step.start_m": _STEP_AT_M}
    known, both = fitted(record, place, True, taken), fitted(record, {MASS: 700.0, **place}, True, taken)
    ours = Table("Ours: the step estimated", (
        Column("what is known"), Column("height [mm]", ".2f"), Column("its standard error [mm]", ".2f"),
        Column("mass [kg]", ".1f"), Column("its standard error [kg]", ".1f")), tuple(
        (words, 1000 * one.parameters["step.height_m"], 1000 * one.standard_errors["step.height_m"],
         one.parameters.get(MASS), one.standard_errors.get(MASS))
        for words, one in (("the mass, 875 kg", known), ("neither mass nor height", both))))
    powers = [float(np.polyfit(np.log(heights), np.log(ends), 1)[0]) for ends in (white, masses)]
    verdict = ("Exact at 38.1 mm and on a line, as printed, but not quite in proportion: the mass goes as the power "
               f"{powers[0]:.2f} of the height that is taken, {powers[1]:.2f} in the innovations form, for it also "
               "sets how fast the body swings back. That is what lets ours find both at once, "
               f"{both.parameters[MASS]:.0f} +- {both.standard_errors[MASS]:.0f} kg and "
               f"{1000 * both.parameters['step.height_m']:.1f} +- {1000 * both.standard_errors['step.height_m']:.1f} "
               "mm, on a road without roughness. With the mass known, the car measures the step, as the source "
               "proposes. Its 48.3 m/s are 48.3 km/h.")
    picture = Picture(Curves("Mass, by the height that a step of 38.1 mm is taken for", "height taken [mm]",
                             "mass [kg]", (Line("white noise", 1000 * np.array(heights), white),
                                           Line("innovations form", 1000 * np.array(heights), masses),
                                           Line("in proportion", 1000 * np.array(heights), in_proportion, dots=True)),
                             (TRUTH[MASS], "875 kg")),
                      "masses for heights of 25.4 to 50.8 mm, linear in the height")
    exact = float(white[int(np.abs(np.array(heights) - STEP_M).argmin())])
    values: tuple[Check, ...] = (*about("Fig 4.31", [Value("mass at the true height, 38.1 mm [kg]", TRUTH[MASS], exact,
                                        0.01 * TRUTH[MASS])]),
              *about("Fig 4.31", [
                  Statement("correlation of mass and height taken, their way", "linearly proportional",
                            float(np.corrcoef(heights, white)[0, 1]), 0.99),
                  Statement("error of the mass with the height estimated, over its standard error", "the mass cannot "
                                                                                                    "be predicted "
                                                                                                    "without the "
                                                                                                    "height",
                            (both.parameters[MASS] - TRUTH[MASS]) / both.standard_errors[MASS], -3.0, 3.0, Word.BETTER),
                  Statement("standard error of that mass [%]", "large amounts of error",
                            100 * both.standard_errors[MASS]
                            / TRUTH[MASS], 0.0, 2.0, Word.BETTER)]),
              *about("4.4.5 height from a known mass", [Value(
                  "height with the mass known, true 38.1 [mm]", 1000 * STEP_M, 1000 * known.parameters["step.height_m"],
                  3000 * known.standard_errors["step.height_m"])]),
              *about("4.4.5 speed", [Value("48.3 m/s [mph]", PRINTED_MPH, PRINTED_SPEED / MPH_MPS, 0.5, Word.MISPRINT,
                                           of_print=True)]))
    return Result((table, ours), verdict, (picture,), values)


def _mass(record: Run, height_m: float, ours: bool) -> float:
    return fitted(record, {MASS: TRUTH[MASS]}, ours, RoadInput(step=RoadStep(_STEP_AT_M, height_m))).parameters[MASS]


STUDY = Study("fig_4_31", "Mass by the height that a bridge's step is taken for", "Fig 4.31, section 4.4.5",
              "Simulated as in the source: a step of 38.1 mm at 48.3 km/h, no roughness; sensor noise 0.05 m/s2.", run,
              items=(Item("Fig 4.31", Word.BETTER,
                          "Exact at the true height and on a line as printed; ours finds mass and height together."),
                     Item("4.4.5 height from a known mass", Word.AGREES,
                          "With the mass known the step's height comes out, as the text proposes."),
                     Item("4.4.5 speed", Word.MISPRINT, "30 mph are 48.3 km/h, not m/s.")))
