"""Fig 6.3 to 6.8: r.m.s. acceleration by roughness at each speed, with passengers and with twice the mass (6.3)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.estimation.rms_calibration import PASSENGER_KG, CalibrationSettings, calibrate, loaded
from logger.estimation.rms_relation import rms_relation
from logger.roads.iso8608 import IRI_PER_ROOT_GD
from logger.studies.checks import Statement, Word, about
from logger.studies.drives import Array, Conditions, drive_over, random_road, rav4
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table, alike
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle

SPEEDS_MPH = tuple(range(10, 71, 10))
PRINTED_GD_CM3 = (2.0, 4096.0)
_LEVELS_MPS2 = np.array([0.0, 2.0])
_ROADS, _DRIVEN_M = 120, 100.0


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
    less = "less response at every roughness and speed than in Fig 6.6"
    loads = tuple(Picture(Curves(f"{figure}: IRI by r.m.s., {what}", *axes, _fan(slopes)), less)
                  for figure, what, slopes in (("Fig 6.7", "two people more", two),
                                               ("Fig 6.8", "twice the mass", heavy)))
    pictures = (Picture(Curves("Fig 6.4: r.m.s. acceleration by degree of roughness", *gd_axes, rms),
                        "dots of simulated roads and a power trendline for each speed, the faster the higher"),
                Picture(Curves("Fig 6.5: the same, logarithmic", *gd_axes, rms, log_x=True, log_y=True),
                        "the same, on straight lines"),
                Picture(Curves("Fig 6.6: IRI by r.m.s. acceleration", *axes, _fan(own)),
                        "a straight line through the origin for each speed"), *loads)
    return Result((table, by_gd), verdict, pictures, (
        *about(("Fig 6.4", "Fig 6.5"), [
            Statement("power of the r.m.s. by Gd(n0), one road at both ends of it", "a nonlinear power trendline",
                      _power(), 0.49, 0.51),
            Statement("least ratio of the r.m.s. from one speed to the next", "larger response at higher speeds",
                      float(np.min(np.array(factors[1:]) / factors[:-1])), 1.0),
            Statement("r.m.s. of roads of 1 km over that of endless ones, farthest from 1", "independent of the length",
                      float(max(np.array(factors) * own / IRI_PER_ROOT_GD, key=lambda one: abs(one - 1))), 0.95,
                      1.05)]),
        *about("Fig 6.6", [
            Statement("R2 of the line through drives, the least of all speeds", "a direct linear relation",
                      min(one.iri_per_accel_rms.r2 for one in drives), 0.95),
            Statement("most ratio of the slope from one speed to the next", "the flatter the faster, as of Fig 6.4",
                      float(np.max(own[1:] / own[:-1])), most=1.0)]),
        *(one for item, slopes in (("Fig 6.7", two), ("Fig 6.8", heavy)) for one in about(item, [
            Statement("least change of IRI per r.m.s. [%]", "less acceleration regardless of roughness or speed",
                      100 * float(np.min(slopes / own - 1)), 1.0)])),
        *about("Fig 6.8", [Statement("least change over that of two people", "an exaggerated case",
                                     float(np.min((heavy / own - 1) / (two / own - 1))), 2.0)])))


def _power() -> float:
    """Of the r.m.s. acceleration by the degree of roughness, of one road twice as far up and down, stepped in time."""
    ends = [IRI_PER_ROOT_GD * gd**0.5 for gd in PRINTED_GD_CM3]
    rms = [drive_over(random_road(iri, _DRIVEN_M, 1), SPEEDS_MPH[3] * MPH_MPS, Conditions(0.0)).measured_mps2.std()
           for iri in ends]
    return float(np.log(rms[1] / rms[0]) / np.log(PRINTED_GD_CM3[1] / PRINTED_GD_CM3[0]))


def _fan(slopes: Array) -> tuple[Line, ...]:
    return tuple(Line(f"{mph} mph", _LEVELS_MPS2, slope * _LEVELS_MPS2)
                 for mph, slope in zip(SPEEDS_MPH, slopes.tolist(), strict=True))


STUDY = Study("fig_6_6", "IRI per r.m.s. acceleration at each speed, and what load does to it",
              "Fig 6.6 (6.3 to 6.8), section 6.3",
              "Computed from the half car of Table 4.2 and the spectrum of ISO 8608, and from simulated drives over "
              "random roads of 1 km; the source's roads have 100 m and 2 to 4096 cm3, which a linear car does not "
              "mind.", run,
              items=(Item("Fig 6.3", Word.NOT_REPRODUCIBLE,
                          "A scheme without a value: from the response to the IRI by way of the vehicle."),
                     *alike(("Fig 6.4", "Fig 6.5"), Word.AGREES,
                            "The r.m.s. goes with the root of the degree of roughness, and is larger at each higher "
                            "speed, as drawn."),
                     Item("Fig 6.6", Word.AGREES,
                          "One line through the origin for each speed, the flatter the faster."),
                     *alike(("Fig 6.7", "Fig 6.8"), Word.AGREES, "More mass makes each line steeper.")))
