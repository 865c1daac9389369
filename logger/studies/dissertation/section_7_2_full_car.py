"""Section 7.2, second item: a full car, whose left and right tracks differ."""

from dataclasses import replace

import numpy as np

from logger.chart_data import Curves, Line
from logger.profiles.track import Track
from logger.runs import Run
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.studies.checks import Statement, Word
from logger.studies.drives import PS_2119, Array, Conditions, drive_over, random_road
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table
from logger.vehicle.vehicle import SensorPlace

SHARED = (1.0, 0.9, 0.5, 0.0)
"""Share of the right track's mean square that it has from the left one."""
LEFT_M = (0.0, 0.4)
_SPEED_MPS, _IRI, _LENGTH_M = 14.0, 4.0, 400.0
_SKIP = 200


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    cases = [(shared, left_m) for left_m in LEFT_M for shared in effort.some(SHARED)]
    rows = tuple(_row(*case) for case in effort.each(cases))
    table = Table("A full car's record, explained by two models", (
        Column("sensor left of the middle [m]", ".1f"), Column("tracks share [% of power]", ".0f"),
        Column("printed, tracks taken for equal (6.5)"),
        Column("r.m.s. over the half car's [%]", "+.1f"), Column("half car on the left track: error", ".3f"),
        Column("full car on both tracks: error", ".3f")), rows)
    apart, one_track = rows[len(rows) // 2 - 1], rows[0]
    verdict = ("Where both tracks are one, a full car with its sensor in the middle moves as the half car does: the "
               f"half car leaves {one_track[4]:.3f} of the record, which is the sensor's noise and steps. Where the "
               f"tracks share nothing the middle of the car feels their mean, {-float(str(apart[3])):.0f} % less than "
               f"the half car would, and a half car on the left track leaves {apart[4]:.2f} of the record, the full "
               f"car on both {apart[5]:.2f}. So the model counts as soon as the tracks differ, and the profile of "
               "both tracks has to be known for it. ridelog has the full car in every command (model: full_car), "
               "reads elevation_right_m, and the lab's effect roll makes a full car of a half one where the record "
               "asks for it.")
    road = _two_tracks(0.0)
    full, half = _drive(road, 0.0, PS_2119), _half(road)
    seen = slice(_SKIP, _SKIP + 300)
    picture = Picture(Curves("Tracks that share nothing: the record and two models", "distance [m]",
                             "acceleration [m/s2]", (
                                 Line("record of a full car", full.distance_m[seen], full.measured_mps2[seen]),
                                 Line("half car", half.distance_m[seen], half.measured_mps2[seen]),
                                 Line("full car", full.distance_m[seen], _drive(road, 0.0).measured_mps2[seen]))),
                      "nothing: future work")
    return Result((table,), verdict, (picture,), (
        Statement("error of the full car over that of the half car, tracks that share nothing", "a full car accounts "
                                                                                                "for "
                  "lateral effects of the road", float(str(apart[5])) / float(str(apart[4])), 0.0, 0.2, Word.BETTER),
        Statement("the same, where both tracks are one", "the half car is a worthwhile representation",
                  float(str(one_track[5])) / float(str(one_track[4])), 0.95, 1.05)))


def _row(shared: float, left_m: float) -> tuple[Cell, ...]:
    road = _two_tracks(shared)
    record, half, full = (one.measured_mps2[_SKIP:] for one in (
        _drive(road, left_m, PS_2119), _half(road), _drive(road, left_m)))
    return (left_m, 100 * shared, "half car", 100 * float(full.std() / half.std() - 1), _error(record, half),
            _error(record, full))


def _error(measured: Array, model: Array) -> float:
    """R.m.s. of what a model leaves over that of what was measured, as ``ridelog compare`` has it."""
    return float(np.sqrt(np.mean((measured - model) ** 2) / np.mean(measured**2)))


def _two_tracks(shared: float) -> Track:
    left, other = (random_road(_IRI, _LENGTH_M, seed) for seed in (11, 12))
    right = np.sqrt(shared) * left.elevation_m + np.sqrt(1 - shared) * other.elevation_m
    return replace(left, elevation_m=np.stack([left.elevation_m, right], axis=1))


def _drive(road: Track, left_m: float, conditions: Conditions | None = None) -> Run:
    full = replace(read_vehicle(vehicle_file("rav4-2009-full")), sensor=SensorPlace(left_m=left_m))
    return drive_over(road, _SPEED_MPS, conditions or Conditions(0.0), full)


def _half(road: Track) -> Run:
    """What the half car of Table 4.2 would record on the left track; it has no left and right of its own."""
    return drive_over(replace(road, elevation_m=road.elevation_m[:, 0]), _SPEED_MPS, Conditions(0.0))


STUDY = Study("section_7_2_full_car", "A full car, where left and right tracks differ", "Section 7.2, second item",
              "Nothing is printed: the source names it as future work. Simulated: two sides of the half car of Table "
              "4.2 as one full car (rav4-2009-full) with a PS-2119 at 14 m/s over 400 m of two random tracks of IRI 4 "
              "m/km, which share all, some or none of their waves alike.", run,
              items=(Item("7.2 full car", Word.BETTER,
                          "The full car is a model of every command, and explains what two different tracks do."),))
