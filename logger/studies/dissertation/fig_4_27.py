"""Fig 4.26 and 4.27: error of the mass when a bump is taken for one of another height and width (4.4.3)."""

import numpy as np

from logger.chart_data import Field
from logger.identification.obstacle_paths import Bump
from logger.identification.unknown_inputs import RoadInput
from logger.runs import Run
from logger.studies.checks import Statement, Value, Word, about
from logger.studies.drives import BUMP_HEIGHT_M, BUMP_MPS, BUMP_WIDTH_M, Conditions, bump, record_of, without_profile
from logger.studies.fit_methods import (
    MASS,
    TRUTH,
    error_percent,
    fitted,
    mass_and_bump,
    standard_error_percent,
)
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

HEIGHTS_M = tuple(round(0.0254 * inches, 4) for inches in np.arange(3, 9.01, 0.5).tolist())
WIDTHS_M = tuple(round(0.3048 * feet, 3) for feet in np.arange(6, 11.01, 0.5).tolist())
PRINTED_LIMIT_PERCENT, PRINTED_LEAST_MM = 50.0, 72.2
_BUMP_AT_M, _SECONDS = 8.0, 8.0
_SHOWN = 2  # every other grid point is in the table, all are in the picture
_NUMBERS = ((MASS, "mass [kg]", TRUTH[MASS]), ("bump.height_m", "height [m]", BUMP_HEIGHT_M),
            ("bump.width_m", "width [m]", BUMP_WIDTH_M), ("speed_scale", "recorded speed over true", 1.0))


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    drive = record_of(bump(_BUMP_AT_M), BUMP_MPS, _SECONDS, Conditions())
    record = without_profile(drive)
    heights, widths = effort.some(HEIGHTS_M, 3), effort.some(WIDTHS_M, 3)
    errors = np.array([[_error_percent(record, height, width) for width in widths] for height in effort.each(heights)])
    columns = (Column("height taken [mm]", ".1f"),
               *(Column(f"width taken {width:.2f} m [%]", "+.1f") for width in widths[::_SHOWN]))
    rows = tuple((1000 * height, *row[::_SHOWN].tolist())
                 for height, row in zip(heights[::_SHOWN], errors[::_SHOWN], strict=True))
    taken = Bump(_BUMP_AT_M, 0.1016, 3.05)
    found = mass_and_bump(record, taken)
    ours = Table("Ours: mass, bump and speed together, beginning with a bump taken for 101.6 mm by 3.05 m", (
        Column("number"), Column("truth", ".4g"), Column("estimate", ".5g"), Column("standard error", ".2g")), tuple(
        (words, truth, found.parameters[name], found.standard_errors[name]) for name, words, truth in _NUMBERS))
    best = [widths[int(np.abs(row).argmin())] for row in errors]
    verdict = ("The slanting valley of the printed picture is there: least error for a bump taken for "
               f"{1000 * heights[0]:.0f} mm by {best[0]:.2f} m up to {1000 * heights[-1]:.0f} mm by {best[-1]:.2f} m; "
               "taken for wider, it has to be taken for higher as well. The source cuts its errors at "
               f"{PRINTED_LIMIT_PERCENT:g} %, the picture here too; its 72.2 mm is a misprint for 76.2 (3 in). The "
               "valley is one of a fit of the mass alone. The wrong bumps in it leave far more behind than noise "
               "does, so the record does tell height and width: fitted together with the mass they come out to a "
               "fraction of a per cent.")
    picture = Picture(Field("Size of the error of the mass, by what the bump is taken for", "width taken [m]",
                            "height taken [mm]", np.array(widths), 1000 * np.array(heights), np.abs(errors),
                            "error [%]", PRINTED_LIMIT_PERCENT),
                      "errors up to 50 % over heights of 3 to 9 in and widths of 6 to 11 ft, from two sides: a dark "
                      "blue region of right masses that slants")
    right_m = [float(np.interp(0.0, -row, widths)) for row in errors]  # the wider, the lighter the car
    return Result((Table("Their way: error of the mass, fitted alone (printed as a picture only)",
                         columns, rows), ours),
                  verdict, (picture,), (
                      *about("4.4.3 least height", [Value("3 in [mm]", PRINTED_LEAST_MM, 1000 * HEIGHTS_M[0], 0.5,
                                                          Word.MISPRINT, of_print=True)]),
                      *about(("Fig 4.26", "Fig 4.27"), [
                          Statement("width of a right mass at the largest height, less that at the smallest [m]",
                                    "an angled region: a larger width needs a larger height", right_m[-1] - right_m[0],
                                    0.3)]),
                      *about("Fig 4.26", [Statement(
                          "error of the mass at the grid point nearest the true bump [%]", "a region where the "
                                                                                           "estimate "
                          "is accurate", float(np.abs(errors).min()), 0.0, 10.0)]),
                      *about("Fig 4.27", [Statement(
                          "error of the mass with height, width and speed estimated, over its standard error",
                          "right masses with heights and widths that are not",
                          error_percent(found, MASS) / standard_error_percent(found, MASS), -3.0, 3.0, Word.BETTER)])))


def _error_percent(record: Run, height_m: float, width_m: float) -> float:
    road = RoadInput(bump=Bump(_BUMP_AT_M, height_m, width_m))
    return error_percent(fitted(record, {MASS: TRUTH[MASS]}, False, road), MASS)


STUDY = Study("fig_4_27", "Error of the mass by the height and width that a bump is taken for",
              "Fig 4.27 (and 4.26), section 4.4.3",
              "Simulated as in the source: a bump of 150 mm by 2.60 m at 16.1 km/h, no roughness; sensor noise 0.05 "
              "m/s2.", run,
              items=(Item("Fig 4.26", Word.AGREES, "The printed valley is there for a fit of the mass alone."),
                     Item("Fig 4.27", Word.BETTER,
                          "Height, width and mass fitted together come out to a fraction of a per cent, where a fit "
                          "of the mass alone has many answers."),
                     Item("4.4.3 least height", Word.MISPRINT, "3 in are 76.2 mm, not 72.2.")))
