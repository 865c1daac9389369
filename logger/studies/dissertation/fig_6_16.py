"""Fig 6.16, 6.17: comfort by roughness and speed (6.4)."""

import numpy as np

from logger.chart_data import Curves, Field, Line
from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.estimation.rms_calibration import LEVELS_IRI, SPEEDS_MPS, CalibrationSettings, calibrate
from logger.studies.checks import Statement, Word, about
from logger.studies.drives import PS_2119, drive_over, random_road, rav4
from logger.studies.study import Column, Effort, Picture, Result, Study, Table, alike
from logger.studies.windows import per_window
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle

_ROADS = 60
_DRIVEN_IRI, _LENGTH_M = 5.0, 305.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    settings = CalibrationSettings(roads=effort.count(_ROADS, 10))
    (lines,) = (calibrate(known_vehicle(rav4()), None, settings) for _ in effort.each(range(1)))
    mph = np.round(np.array(SPEEDS_MPS) / MPH_MPS)
    per_iri = np.array([one.a_w_per_iri.slope for one in lines])
    levels = np.array(LEVELS_IRI)
    a_w = np.outer(per_iri, levels)
    road = random_road(_DRIVEN_IRI, _LENGTH_M, 3)
    stepped = {number: per_window(drive_over(road, SPEEDS_MPS[number], PS_2119), PS_2119) for number in (1, 3)}
    checks = {number: float(np.sqrt(np.mean(one.a_w_mps2**2)) / one.exact_m_per_km.mean())
              for number, one in stepped.items()}
    table = Table("Weighted acceleration by speed (printed as pictures only)", (
        Column("speed [mph]", ".0f"), Column("a_w per IRI [m/s2 per m/km]", ".4f"),
        Column("spread of 1 km roads [%]", ".0f"), Column("one road stepped in time", ".4f"),
        *(Column(f"IRI {level:g}") for level in (1, 2, 4, 8)),
        Column("little uncomfortable from IRI [m/km]", ".1f")), tuple(
        (float(mph[number]), one.a_w_per_iri.slope, 100 * one.a_w_per_iri.spread, checks.get(number),
         *(_word(one.a_w_per_iri.slope * level) for level in (1, 2, 4, 8)),
         COMFORT_WORDS[-2][0] / one.a_w_per_iri.slope) for number, one in enumerate(lines)))
    verdict = ("Comfort falls in proportion to roughness, and with speed, as the text says. The "
               "printed pictures have no numbers in the text. For this car a straight line through the origin holds "
               f"for each speed, because it is linear; from 10 to 70 mph it becomes {per_iri[-1] / per_iri[0]:.1f} "
               "times as steep, not seven times: a road of waviness 2 shakes a car with the root of its speed, 2.6 "
               "times, and most of the rest is the tire, whose patch of 250 mm swallows the short waves that a slow "
               "car's wheels would answer.")
    pictures = (
        Picture(Curves("Fig 6.16: comfort by IRI at each speed", "IRI [m/km]", "a_w [m/s2]",
                       tuple(Line(f"{one:.0f} mph", levels, row) for one, row in zip(mph, a_w, strict=True)),
                       level=(COMFORT_WORDS[-2][0], "a little uncomfortable")),
                "a_w by IRI from 1 to 10 m/km at 10 to 70 mph"),
        Picture(Field("Fig 6.17: the same over both", "IRI [m/km]", "speed [mph]", levels, mph, a_w, "a_w [m/s2]", 1.2),
                "the same as a surface in three dimensions"))
    return Result((table,), verdict, pictures, about(("Fig 6.16", "Fig 6.17"), [
        Statement("least change of a_w per IRI from one speed to the next [m/s2 per m/km]", "the faster, the less "
                  "comfortable", float(np.diff(per_iri).min()), 1e-3),
        Statement("R2 of a_w by IRI through the origin, the least of all speeds", "the rougher, the less comfortable",
                  min(one.a_w_per_iri.r2 for one in lines), 0.95),
        Statement("a road stepped in time over the line, farthest from 1", "a half car is simulated on generated "
                                                                           "profiles",
                  max((check / float(per_iri[number]) for number, check in checks.items()),
                      key=lambda one: abs(one - 1)), 0.85, 1.15)]))


def _word(a_w_mps2: float) -> str:
    return comfort_word(a_w_mps2).replace("_", " ").replace(" uncomfortable", "")


STUDY = Study("fig_6_16", "Comfort by roughness and speed", "Fig 6.16 (and 6.17), section 6.4",
              "As in the source: the half car of Table 4.2 over random roads of IRI 1 to 10 m/km at 10 to 70 mph, "
              "weighted with Wk; here 60 roads of 1 km. Beside it one road of IRI 5 m/km, driven in steps of "
              "time.", run,
              items=alike(("Fig 6.16", "Fig 6.17"), Word.AGREES,
                          "Comfort falls in proportion to roughness, and with speed; the pictures have no numbers in "
                          "the text."))
