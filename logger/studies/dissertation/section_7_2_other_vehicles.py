"""Section 7.2, fourth item: vehicles of other sizes, larger inputs, and bridges and tubes at higher speeds."""

from dataclasses import dataclass

import numpy as np

from logger.chart_data import Curves, Line
from logger.estimation.rms_relation import rms_relation
from logger.identification.identifiability import NotIdentifiable
from logger.shipped import vehicle_file, vehicle_names
from logger.store.formats.vehicle_file import read_vehicle
from logger.studies.checks import Statement, Word
from logger.studies.dissertation.fig_5_22 import TUBE_M, TUBE_SPACING_M, tube
from logger.studies.drives import (
    BUMP_HEIGHT_M,
    BUMP_MPS,
    BUMP_WIDTH_M,
    PS_2119,
    SPACING_M,
    STEP_M,
    Conditions,
    Shape,
    bridge,
    bump,
    rav4,
    record_of,
)
from logger.studies.fit_methods import MASS, fitted
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table
from logger.units import MPH_MPS, STANDARD_GRAVITY_MPS2
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz
from logger.vehicle.named_parameters import WEAKEST
from logger.vehicle.vehicle import Vehicle

PRINTED = {("bump, 150 mm", 10): "used", ("bridge, step of 38.1 mm", 30): "used", ("tube, 6.35 mm", 10): "too weak"}
RELATION_MPH = 30
_AT_M, _SECONDS, _IRI = 20.0, 8.0, 2.0


@dataclass(frozen=True)
class _Input:
    """An obstacle at a speed, and how finely the road has to be sampled."""

    what: str
    shape: Shape
    mph: int
    spacing_m: float = SPACING_M


INPUTS = (
    *(_Input(f"bump, {1000 * height:.0f} mm", bump(_AT_M, height), 10)
      for height in (BUMP_HEIGHT_M / 2, BUMP_HEIGHT_M)),
    *(_Input(f"bridge, step of {1000 * height:.1f} mm", bridge(_AT_M, height), mph)
      for height in (STEP_M / 3, STEP_M) for mph in (30, 60)),
    *(_Input(f"tube, {1000 * diameter:.2f} mm", tube(_AT_M, diameter), mph, TUBE_SPACING_M)
      for diameter in (TUBE_M, 3 * TUBE_M) for mph in (10, 40)),
)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    cars = [read_vehicle(vehicle_file(name)) for name in effort.some(vehicle_names())]
    inputs = effort.some(INPUTS)
    jobs: list[Vehicle | _Input] = [*cars, *inputs]
    rows = [_of_car(one) if isinstance(one, Vehicle) else _of_input(one) for one in effort.each(jobs)]
    vehicles = Table("The vehicles of config/vehicles (printed: one car)", (
        Column("vehicle"), Column("model"), Column("body from [Hz]", ".2f"), Column("wheels to [Hz]", ".1f"),
        Column(f"IRI per r.m.s. at {RELATION_MPH} mph [m/km per m/s2]", ".2f"),
        Column("peak on the bump of 5.5.2 [g]", ".2f"), Column("standard error of its mass, one pass [%]")),
        tuple(rows[:len(cars)]))
    sizes = Table(f"Inputs of other sizes and speeds, the car of Table 4.2, road of IRI {_IRI:g} m/km", (
        Column("input"), Column("speed [mph]", ".0f"), Column("printed"), Column("peak [m/s2]", ".2f"),
        Column("standard error of the mass, one pass [%]")), tuple(rows[len(cars):]))
    relation = [float(str(row[4])) for row in vehicles.rows]
    verdict = (f"One reading stands for roads that differ by a factor of {max(relation) / min(relation):.1f} from car "
               "to car, so the car has to be known; ridelog takes any as a short file, of one, two or four wheels, "
               "and seven come with it. The bump of 5.5.2 tells the mass of each. A larger input tells more, in "
               "proportion; a bridge's step of 38 mm tells it to some 3 %, one of 13 mm to 8 to 9, as well at 60 mph "
               "as at 30. A tube tells nothing at any of these speeds, not even one of 19 mm: the road grows with "
               "speed and the tube does not. ridelog plan says of any car what a drive would show.")
    mph = np.arange(10.0, 71.0, 5.0)
    lines = tuple(Line(car.name, mph, rms_relation(known_vehicle(car), None, mph * MPH_MPS).iri_per_accel_rms)
                  for car in cars)
    picture = Picture(Curves("IRI per r.m.s. acceleration of each vehicle", "speed [mph]",
                             "IRI per r.m.s. [m/km per m/s2]", lines), "one car (Fig 6.6); others are future work")
    tubes, others = ([str(row[4]) for row in sizes.rows if str(row[0]).startswith("tube") is is_tube]
                     for is_tube in (True, False))
    return Result((vehicles, sizes), verdict, (picture,), (
        Statement("vehicles whose bump tells their mass to 5 % in one pass", "vehicles of different sizes, as future "
                                                                             "work",
                  float(sum(_percent(str(row[6])) < 5 for row in vehicles.rows)), float(len(cars)), word=Word.BETTER),
        Statement("standard error of the mass, the worst of bumps and bridges [%]", "user-created inputs of other "
                                                                                    "sizes, "
                  "bridges at higher speeds, as future work", max(map(_percent, others)), 0.0, 10.0, Word.BETTER),
        Statement("tubes that tell the mass", "tubes at higher speeds, as future work",
                  float(sum(_percent(one) < 100 * WEAKEST for one in tubes)), 0.0, 0.0, Word.BETTER)))


def _percent(error: str) -> float:
    """A standard error as the tables have it; infinite where the tables only have a bound."""
    return float("inf") if error.startswith("above") else float(error)


def _of_car(car: Vehicle) -> tuple[Cell, ...]:
    frequencies = undamped_frequencies_hz(structure_of(car))
    relation = rms_relation(known_vehicle(car), None, [RELATION_MPH * MPH_MPS]).iri_per_accel_rms[0]
    taken = bump(_AT_M, BUMP_HEIGHT_M, BUMP_WIDTH_M)
    peak = np.abs(record_of(taken, BUMP_MPS, _SECONDS, Conditions(0.0), car).measured_mps2).max()
    return (car.name, car.model.replace("_", " "), float(frequencies[0]), float(frequencies[-1]), float(relation),
            float(peak) / STANDARD_GRAVITY_MPS2, _mass_error(car, taken, BUMP_MPS, SPACING_M))


def _of_input(one: _Input) -> tuple[Cell, ...]:
    alone = record_of(one.shape, one.mph * MPH_MPS, _SECONDS, Conditions(0.0), spacing_m=one.spacing_m)
    printed = PRINTED.get((one.what, one.mph), "future work")
    return (one.what, float(one.mph), printed, float(np.abs(alone.measured_mps2).max()),
            _mass_error(rav4(), one.shape, one.mph * MPH_MPS, one.spacing_m))


def _mass_error(car: Vehicle, shape: Shape, speed_mps: float, spacing_m: float) -> str:
    """Standard error of a car's mass from one pass, the obstacle known, the road not [%]."""
    record = record_of(shape, speed_mps, _SECONDS, PS_2119.on(_IRI, 4), car, spacing_m)
    try:
        found = fitted(record, {MASS: car.sprung_mass_kg}, ours=True, vehicle=car)
    except NotIdentifiable:
        return f"above {100 * WEAKEST:.0f}"
    return f"{100 * found.standard_errors[MASS] / car.sprung_mass_kg:.1f}"


STUDY = Study("section_7_2_other_vehicles", "Other vehicles, other inputs, other speeds", "Section 7.2, fourth item",
              "Nothing is printed: the source names it as future work. Simulated: every vehicle that comes with "
              "ridelog over the bump of 5.5.2, and the car of Table 4.2 over other inputs, with a PS-2119 on a road of "
              "IRI 2 m/km; the obstacle is known, the road is not.", run,
              items=(Item("7.2 other vehicles", Word.BETTER,
                          "Seven vehicles come with ridelog, and what each input tells of a mass is computed before "
                          "any drive."),))
