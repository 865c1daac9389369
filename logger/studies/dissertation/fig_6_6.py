"""Fig 6.3 to 6.8: r.m.s. acceleration by roughness at each speed, with passengers and with twice the mass (6.3)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.estimation.rms_calibration import PASSENGER_KG, CalibrationSettings, calibrate, loaded
from logger.estimation.rms_relation import rms_relation
from logger.studies.drives import Array, rav4
from logger.studies.study import Column, Effort, Result, Study, Table, Word
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle

SPEEDS_MPH = tuple(range(10, 71, 10))
PRINTED_GD_CM3 = (2.0, 4096.0)
_LEVELS_MPS2 = np.array([0.0, 2.0])
_ROADS = 120


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    speeds = np.array(SPEEDS_MPH) * MPH_MPS
    cars = (rav4(), loaded(rav4(), passengers=2), loaded(rav4(), sprung_mass_factor=2.0))
    own, two, heavy = (rms_relation(known_vehicle(car), None, speeds).iri_per_accel_rms for car in cars)
    settings = CalibrationSettings(tuple(speeds.tolist()), roads=effort.count(_ROADS, 10))
    (drives,) = (calibrate(known_vehicle(rav4()), None, settings) for _ in effort.each(range(1)))
    rows = tuple((float(mph), slope, line.iri_per_accel_rms.slope, 100 * line.window_iri_per_accel_rms.spread,
                  *map(float, others)) for mph, slope, line, *others in
                 zip(SPEEDS_MPH, own.tolist(), drives, 100 * (two / own - 1), 100 * (heavy / own - 1), strict=True))
    table = Table("IRI per r.m.s. acceleration [m/km per m/s2] (printed as pictures only)", (
        Column("speed [mph]", ".0f"), Column("computed", ".3f"), Column("from drives", ".3f"),
        Column("spread of 25 ft windows [%]", ".0f"), Column(f"two people of {PASSENGER_KG:g} kg more [%]", "+.1f"),
        Column("twice the mass [%]", "+.1f")), rows)
    verdict = ("Fig 6.3, a scheme, goes from the response to the IRI by way of the vehicle; the rest agrees with the "
               "figures: r.m.s. acceleration grows with the root of Gd(n0), whatever the length of the road, so the "
               "trendlines are straight and parallel on logarithmic axes; with Eq 4.39 that makes one line through "
               "the origin for each speed, the flatter the faster; more mass lowers the acceleration at every speed, "
               "so a given reading stands for a rougher road. The printed pictures have no numbers in the text. The "
               "line is right for long roads of waviness 2; a window of 25 ft scatters about it, and a road of "
               "another waviness makes it drift with speed (6.3.1, Fig 6.11). The better relation that the source "
               "asks for is that of ridelog estimate.")
    factors = [one.accel_rms_per_root_gd.slope for one in drives]
    by_gd = Table("R.m.s. acceleration by degree of roughness: a factor times the root of Gd(n0) (Fig 6.4, 6.5)", (
        Column("speed [mph]", ".0f"), Column("printed"), Column("factor [m/s2 per cm^1.5]", ".4f"),
        Column("spread of 1 km roads [%]", ".1f"), *(Column(f"at {gd:g} cm3 [m/s2]", ".3f") for gd in PRINTED_GD_CM3)),
        tuple((float(mph), "a power trendline", factor, 100 * one.accel_rms_per_root_gd.spread,
               *(factor * gd**0.5 for gd in PRINTED_GD_CM3))
              for mph, factor, one in zip(SPEEDS_MPH, factors, drives, strict=True)))
    gd_cm3 = np.geomspace(*PRINTED_GD_CM3, 40)
    rms = tuple(Line(f"{mph} mph", gd_cm3, factor * np.sqrt(gd_cm3))
                for mph, factor in zip(SPEEDS_MPH, factors, strict=True))
    axes, gd_axes = ("r.m.s. acceleration [m/s2]", "IRI [m/km]"), ("Gd(n0) [cm3]", "r.m.s. acceleration [m/s2]")
    loads = tuple(
        Curves(f"{figure}: IRI by r.m.s., {what}. Printed: less response at every speed", *axes, _fan(slopes))
        for figure, what, slopes in (("Fig 6.7", "two people more", two), ("Fig 6.8", "twice the mass", heavy)))
    return Result((table, by_gd), verdict, (
        Curves("Fig 6.4: r.m.s. acceleration by degree of roughness. Printed: power trendlines, one a speed",
               *gd_axes, rms),
        Curves("Fig 6.5: the same, logarithmic. Printed: the same", *gd_axes, rms, log_x=True,
               log_y=True),
        Curves("Fig 6.6: IRI by r.m.s. acceleration. Printed: a linear relation for each speed",
               *axes, _fan(own)), *loads))


def _fan(slopes: Array) -> tuple[Line, ...]:
    return tuple(Line(f"{mph} mph", _LEVELS_MPS2, slope * _LEVELS_MPS2)
                 for mph, slope in zip(SPEEDS_MPH, slopes.tolist(), strict=True))


STUDY = Study("fig_6_6", "IRI per r.m.s. acceleration at each speed, and what load does to it",
              "Fig 6.6 (6.3 to 6.8), section 6.3",
              "Computed from the half car of Table 4.2 and the spectrum of ISO 8608, and from simulated drives over "
              "random roads of IRI 1 to 10 m/km as in the source.", run,
              covers=tuple(f"Fig 6.{number}" for number in range(3, 9)), word=Word.AGREES,
              because="One line through the origin for each speed, the flatter the faster, and more mass makes it "
                      "steeper, as drawn.")
