"""Fig 5.22, 5.25, 5.26, 5.28, 5.29: a bump, a bridge's step and a road tube, and why the tube is too weak (5.5)."""

from dataclasses import dataclass

import numpy as np

from logger.chart_data import Curves, Line
from logger.identification.identifiability import NotIdentifiable
from logger.runs import Run
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.drives import (
    BRIDGE_MPS,
    BUMP_MPS,
    PS_2119,
    RATE_HZ,
    Conditions,
    Shape,
    bridge,
    bump,
    rav4,
    record_of,
)
from logger.studies.fit_methods import MASS, TRUTH, fitted, standard_error_percent
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table, alike
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import WEAKEST

PRINTED_LARGEST_G = 0.8703  # of the row of speed bumps, Table 5.5
TUBE_M = 0.00635
WANTED_PERCENT = 5.0
_AT_M, _SECONDS = 20.0, 10.0
_IRI = 2.0  # of the road around; the source does not tell it
TUBE_SPACING_M = TUBE_M / 4


@dataclass(frozen=True)
class _Case:
    """An obstacle at a speed, what the source says and draws of it, and how finely the road has to be sampled."""

    what: str
    figure: str
    printed: str
    drawn: str
    shape: Shape
    speed_mps: float
    spacing_m: float = 0.02


def tube(start_m: float, diameter_m: float = TUBE_M) -> Shape:
    """A cable across the road, as high as it is wide."""
    return bump(start_m, diameter_m, diameter_m)


CASES = (
    _Case("bump, 150 mm by 2.60 m", "Fig 5.22", "strong signal", "the recorded and the simulated response, one over "
                                                                 "the other, alike", bump(_AT_M),
          BUMP_MPS),
    _Case("bridge, step of 38.1 mm", "Fig 5.25", "two large spikes", "the recorded and the simulated response with two "
                                                                     "spikes; Fig 5.26: the same, closer",
          bridge(_AT_M), BRIDGE_MPS),
    _Case("tube, 6.35 mm", "Fig 5.28", "not much above the road", "the record, with an arrow for each axle",
          tube(_AT_M),
          BUMP_MPS, TUBE_SPACING_M),
    _Case("tube, 6.35 mm", "Fig 5.29", "cannot be located", "the record alone", tube(_AT_M), 2 * BUMP_MPS,
          TUBE_SPACING_M),
)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    drives = [(_drive(case, Conditions(0.0)), _drive(case, PS_2119.on(_IRI, seed)))
              for seed, case in enumerate(effort.each(CASES), start=1)]
    table = Table("What an obstacle does to the car, and what it tells of its mass", (
        Column("obstacle"), Column("figure"), Column("speed [km/h]", ".1f"), Column("printed"),
        Column("peak alone [m/s2]", ".3f"), Column("r.m.s. of the road [m/s2]", ".3f"),
        Column("peak over road", ".2f"), Column("standard error of the mass, one pass [%]"),
        Column(f"passes for {WANTED_PERCENT:g} %")),
        tuple(_row(case, *pair) for case, pair in zip(CASES, drives, strict=True)))
    peak_g = float(np.abs(drives[0][0].measured_mps2).max()) / STANDARD_GRAVITY_MPS2
    delay_s = float(structure_of(rav4()).behind_m[-1]) / BRIDGE_MPS
    values: tuple[Check, ...] = (*about("Fig 5.22", [Value("largest response to speed bumps, Table 5.5 [g]",
                                                           PRINTED_LARGEST_G, peak_g,
                                        PRINTED_LARGEST_G / 2, Word.NOT_REPRODUCIBLE)]),
              *(one for case, row in zip(CASES, table.rows, strict=True) for one in _stands_out(case, row)),
              *about(("Fig 5.25", "Fig 5.26"), [Statement(
                  "second spike behind the first, over wheelbase by speed", "the front and the rear tires interact "
                                                                            "with "
                  "the step in two large spikes", _spikes_apart_s(drives[1][0], delay_s) / delay_s, 0.9, 1.1,
                  Word.NOT_REPRODUCIBLE)]))
    lifted_mm = 1000 * TUBE_M * TUBE_M / 2 / rav4().contact_patch_m
    verdict = (f"The model's bump peaks at {peak_g:.2f} g, the measured row of bumps at 0.87 (Table 5.5): of one "
               "shape, as the source sees in Fig 5.22, but not of one size; the sensor sat on a console that rings "
               "(6.5), and a bump that is shorter or driven faster hits harder (Fig 4.25). On the bridge the two "
               f"spikes lie {delay_s:.2f} s apart, wheelbase over speed. Both tell the mass. The tube is too weak for "
               "a reason that can be computed: a tire averages the road over its patch of 250 mm, and a cable of 6.35 "
               f"mm lifts that average by {lifted_mm:.2f} mm, from which the car feels a tenth of a step of the "
               "sensor. The source just sees it at 16 km/h, so a real tire, which bridges a cable, feels more than "
               "this mean; yet no more than the road does by itself. Of a tube's mass ridelog refuses to say "
               "anything, and the source left it out.")
    pictures = tuple(_picture(case, *pair) for case, pair in zip(CASES, drives, strict=True))
    return Result((table,), verdict, pictures, values)


def _stands_out(case: _Case, row: tuple[Cell, ...]) -> tuple[Statement, ...]:
    """The peak over the r.m.s. of the road is above five where a response is strong, and below one where it is lost."""
    weak = case.what.startswith("tube")
    items = ("Fig 5.25", "Fig 5.26") if case.figure == "Fig 5.25" else (case.figure,)
    return about(items, [Statement(f"{case.what} at {3.6 * case.speed_mps:.0f} km/h: peak over the r.m.s. of the road",
                                   case.printed, float(str(row[6])), 0.0 if weak else 5.0, 1.0 if weak else np.inf,
                                   Word.NOT_REPRODUCIBLE)])


def _spikes_apart_s(alone: Run, delay_s: float) -> float:
    """Time between the largest accelerations before and from half a delay behind the front axle's blow on [s]."""
    size, time_s = np.abs(alone.measured_mps2), np.arange(len(alone.measured_mps2)) / RATE_HZ
    front_s = float(time_s[np.searchsorted(alone.distance_m, _AT_M)])
    first, second = (np.flatnonzero((time_s >= begin) & (time_s < begin + delay_s / 2))
                     for begin in (front_s, front_s + 0.95 * delay_s))
    return float(time_s[second[size[second].argmax()]] - time_s[first[size[first].argmax()]])


def _drive(case: _Case, conditions: Conditions) -> Run:
    return record_of(case.shape, case.speed_mps, _SECONDS, conditions, spacing_m=case.spacing_m)


def _row(case: _Case, alone: Run, sensed: Run) -> tuple[Cell, ...]:
    peak = float(np.abs(alone.measured_mps2).max())
    road = float((sensed.measured_mps2 - alone.measured_mps2).std())
    return (case.what, case.figure, 3.6 * case.speed_mps, case.printed, peak, road, peak / road, *_mass(sensed))


def _mass(record: Run) -> tuple[str, str]:
    """Standard error of the mass from one pass, and how many passes make it as small as wanted."""
    try:
        error = standard_error_percent(fitted(record, {MASS: TRUTH[MASS]}, ours=True), MASS)
    except NotIdentifiable:
        return f"above {100 * WEAKEST:.0f}", f"above {(100 * WEAKEST / WANTED_PERCENT) ** 2:.0f}"
    return f"{error:.1f}", f"{np.ceil((error / WANTED_PERCENT) ** 2):.0f}"


def _picture(case: _Case, alone: Run, sensed: Run) -> Picture:
    seen = np.abs(alone.distance_m - _AT_M - 5) < 20
    lines = [(f"on a road of IRI {_IRI:g}", sensed), ("obstacle alone", alone)]
    return Picture(Curves(
        f"{case.figure}: {case.what} at {3.6 * case.speed_mps:.0f} km/h", "time [s]", "acceleration [m/s2]",
        tuple(Line(name, np.asarray(np.flatnonzero(seen) / RATE_HZ, float), one.measured_mps2[seen])
              for name, one in lines)), case.drawn)


STUDY = Study("fig_5_22", "Bump, bridge and road tube: what the car feels, and why a tube is too weak",
              "Fig 5.22 (and 5.25, 5.26, 5.28, 5.29), sections 5.5.2 to 5.5.4",
              "The source measured, and its records were never published. Simulated: the car of Table 4.2 with a "
              "PS-2119 over each obstacle at its speed, alone and on a road of IRI 2 m/km (the source does not tell "
              "its roads' roughness); the mass is fitted with the obstacle known.", run,
              items=(Item("Fig 5.22", Word.NOT_REPRODUCIBLE,
                          "The record was never published; simulated, the bump stands far out of the road, at half of "
                          "the measured size."),
                     *alike(("Fig 5.25", "Fig 5.26"), Word.NOT_REPRODUCIBLE,
                            "The record was never published; simulated, there are two spikes, the wheelbase apart."),
                     *alike(("Fig 5.28", "Fig 5.29"), Word.NOT_REPRODUCIBLE,
                            "The record was never published; simulated, the road hides the tube, as the text says.")))
