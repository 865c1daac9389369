"""Section 7.2, third item: a sensor away from the centre of gravity feels pitch."""

from dataclasses import replace

import numpy as np

from logger.chart_data import Curves, Line
from logger.estimation.rms_relation import rms_relation
from logger.studies.checks import Statement, Word
from logger.studies.drives import PS_2119, drive_over, random_road, rav4
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table
from logger.studies.windows import per_window
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.vehicle import SensorPlace, Vehicle

SPEEDS_MPH = (10, 20, 30, 40, 50, 60, 70)
PLACES_M = (-1.0, -0.5, 0.0, 0.5, 1.0)
_ESTIMATED_MPH, _IRI, _LENGTH_M = 30, 3.0, 230.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    speeds = np.array(SPEEDS_MPH) * MPH_MPS
    felt = np.array([1 / rms_relation(known_vehicle(_at(place)), None, speeds).iri_per_accel_rms
                     for place in PLACES_M])
    change = 100 * (felt / felt[PLACES_M.index(0.0)] - 1)
    table = Table("R.m.s. acceleration by where the sensor sits, over that at the centre of gravity (printed: nothing)",
                  (Column("speed [mph]", ".0f"), *(Column(f"{place:+g} m ahead [%]", "+.1f") for place in PLACES_M)),
                  tuple((float(mph), *map(float, row)) for mph, row in zip(SPEEDS_MPH, change.T, strict=True)))
    road = random_road(_IRI, _LENGTH_M, 5)
    rows = []
    for place in effort.each(effort.some(PLACES_M)):
        drive = drive_over(road, _ESTIMATED_MPH * MPH_MPS, PS_2119, _at(place))
        unaware, aware = (per_window(drive, PS_2119, vehicle=car) for car in (rav4(), _at(place)))
        exact = aware.exact_m_per_km.mean()
        rows.append((place, *(100 * float(one.mean() / exact - 1)
                              for one in (unaware.by_rms_m_per_km, unaware.iri_m_per_km, aware.iri_m_per_km))))
    biases = Table(f"What that does to the IRI of a road, at {_ESTIMATED_MPH} mph", (
        Column("sensor ahead by [m]", "+.1f"), Column("r.m.s. relation, place not known [%]", "+.1f"),
        Column("ridelog estimate, place not known [%]", "+.1f"),
        Column("ridelog estimate, place in the vehicle's file [%]", "+.1f")), tuple(rows))
    worst = max(abs(float(row[2])) for row in rows)
    verdict = (f"A metre ahead of the centre of gravity the sensor reads {change[-1].min():.0f} to "
               f"{change[-1].max():.0f} % more than there, by speed, because pitch is added; behind it similarly. An "
               "estimate that does not know the place explains pitch by waves which the middle of the car hardly "
               f"feels, and is off by up to {worst:.0f} %; one that has the place in the vehicle's file (sensor: "
               f"ahead_m) by {max(abs(float(row[3])) for row in rows):.0f} %. Where the place is not known, ridelog "
               "diagnose finds sensor_offset among the missing effects, and ridelog identify estimates sensor.ahead_m.")
    picture = Picture(Curves("What a sensor reads by its place", "speed [mph]", "change of the r.m.s. acceleration [%]",
                             tuple(Line(f"{place:+g} m ahead", np.array(SPEEDS_MPH, dtype=float), row)
                                   for place, row in zip(PLACES_M, change, strict=True) if place),
                             level=(0.0, "at the centre")), "nothing: future work")
    return Result((table, biases), verdict, (picture,), (
        Statement("least change of the r.m.s. a metre ahead or behind [%]", "a further look can demonstrate the effect "
                                                                            "of "
                  "pitch", float(change[[0, -1]].min()), 10.0, word=Word.BETTER),
        Statement("largest bias of the IRI with the place in the vehicle's file [%]", "the sensor is assumed at the "
                                                                                      "centre "
                  "of gravity", max(abs(float(row[3])) for row in rows), 0.0, 5.0, Word.BETTER)))


def _at(ahead_m: float) -> Vehicle:
    return replace(rav4(), sensor=SensorPlace(ahead_m=ahead_m))


STUDY = Study("section_7_2_sensor_position", "A sensor away from the centre of gravity", "Section 7.2, third item",
              "Nothing is printed: the source names it as future work. Computed for the half car of Table 4.2 on roads "
              "of ISO 8608, and simulated over 230 m of random road of IRI 3 m/km with a PS-2119.", run,
              items=(Item("7.2 sensor position", Word.BETTER,
                          "The place of the sensor is part of the vehicle, and with it the pitch that it feels."),))
