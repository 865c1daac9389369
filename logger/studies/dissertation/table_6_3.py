"""Tables 6.3 and 6.4: mass from the steps at a bridge's ends, and what they can tell (6.2.2)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.chart_data import Curves, Line
from logger.identification.identifiability import NotIdentifiable
from logger.identification.obstacle_paths import RoadStep
from logger.identification.prediction_error_fit import Fit
from logger.identification.unknown_inputs import RoadInput
from logger.runs import Run
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.drives import BRIDGE_MPS, PS_2119, STEP_M, bridge, record_of, without_profile
from logger.studies.fit_methods import MASS, TRUTH, error_percent, fitted, standard_error_percent
from logger.studies.study import Cell, Column, Effort, Picture, Result, Study, Table, alike

PRINTED = (("1-1", 700.528, 19.94, 1398.92, 59.88), ("1-2", 596.911, 31.78, 983.834, 12.44),
           ("2-1", 576.042, 34.17, 460.687, 47.35), ("2-2", 416.843, 52.36, 496.564, 43.25))
CASES = tuple((step_m, iri) for step_m in (STEP_M, 0.0127) for iri in (0.0, 2.0, 5.0))
"""True step [m] and the road's IRI [m/km]."""
CHANCE = 0.58  # twice the standard error of an r.m.s. of six, as a share of it
REFUSED = "cannot tell"
_TAKEN_FACTOR = 4 / 3  # the ends of Fig 4.31 are a third off
_ROADS = 6
_STEP_AT_M, _SECONDS = 20.0, 6.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    cases, roads = effort.some(CASES), effort.count(_ROADS)
    jobs = [(step_m, iri, seed) for step_m, iri in cases for seed in range(roads)]
    drives = [_drive(*job) for job in effort.each(jobs)]
    rows = tuple(_row(*case, drives[number * roads:(number + 1) * roads]) for number, case in enumerate(cases))
    printed = Table("Printed, the input taken for a flat road", (
        Column("bump"), Column("trial 1, mass [kg]", ".3f"), Column("error [%]", ".2f"),
        Column("trial 2, mass [kg]", ".3f"), Column("error [%]", ".2f")), PRINTED)
    table = Table(f"Simulated, 48.3 km/h; figures are r.m.s. over {roads} roads", (
        Column("true step [mm]", ".1f"), Column("IRI [m/km]", ".0f"), Column("flat road taken: ours says"),
        Column("step a third too high, their way: error of mass [%]", ".1f"),
        Column("ours, height estimated: error of mass [%]", ".1f"), Column("its standard error [%]", ".1f"),
        Column("mass known: error of height [mm]", ".1f"), Column("its standard error [mm]", ".1f")), rows)
    verdict = ("The source took the road for flat. Such an input moves nothing, whatever the mass: ours refuses to "
               "answer, and the printed masses, 12 to 60 % off, tell of the noise model and of the road, not of the "
               "car. A step that is taken for a third too high puts the mass off by some 15 % on a smooth road (Fig "
               "4.31). With the height estimated beside the mass, a step of 38.1 mm gives both; the error grows with "
               "the road's roughness, and the standard error says how much. A step of half an inch on a rough road "
               "hardly tells the mass, and that is said, too. With a known mass the height is the better thing to "
               "ask for.")
    items = ("Table 6.3", "Table 6.4")
    refused = sum(one.flat == REFUSED for one in drives) / len(drives)
    (rough_m, _), rough = cases[-1], drives[-roads:]
    theirs = _rms([(one.theirs,) for one in rough])[0]
    least, most = (end([percent for _, _, one, _, other in PRINTED for percent in (one, other)]) for end in (min, max))
    values: tuple[Check, ...] = (*about(items, [
        Statement("drives in which a flat input says nothing of the mass [%]", "an input taken for flat gives "
                  "inconsistent masses", 100 * refused, 100.0, word=Word.NOT_REPRODUCIBLE),
        Statement(f"their way, a step of {1000 * rough_m:.1f} mm on IRI 5 taken a third too high: r.m.s. error [%]",
                  f"a weak signal; errors of {least:.0f} to {most:.0f} %", theirs, least, most + CHANCE * theirs,
                  Word.NOT_REPRODUCIBLE),
        Statement("error of the height for a known mass over its standard error, largest of all", "it can be used to "
                  "determine the step's height", max(abs(error / std) for error, std in (one.height for one in drives)),
                  0.0, 4.0, Word.NOT_REPRODUCIBLE)]),
        *(one for trial, item in enumerate(items) for one in about(item, [
            Value(f"error of the printed mass, bump {bump} [%]", found[2 * trial + 1],
                  100 * abs(found[2 * trial] / TRUTH[MASS] - 1), 0.01, of_print=True) for bump, *found in PRINTED])))
    grown = Picture(Curves("Error of the height that is found for a known mass, by the road", "IRI of the road [m/km]",
                           "error of the height [mm]", tuple(_by_iri(step_m, rows) for step_m in dict(cases))),
                    "Fig 6.2: the response to the bridge, which hardly stands out of that to the road")
    return Result((printed, table), verdict, (grown,), values)


def _by_iri(step_m: float, rows: Sequence[tuple[Cell, ...]]) -> Line:
    of_step = [row for row in rows if row[0] == 1000 * step_m]
    iri, error = (np.array([float(str(row[place])) for row in of_step]) for place in (1, 6))
    return Line(f"step of {1000 * step_m:.1f} mm", iri, error)


@dataclass(frozen=True)
class _Found:
    """Of one drive: what was said of a flat road, the error of the mass their way [%], errors and standard errors of
    the mass ours [%] and of the height [mm]; None where ours could not tell."""

    flat: str
    theirs: float
    mass: tuple[float, float] | None
    height: tuple[float, float]


def _drive(step_m: float, iri: float, seed: int) -> _Found:
    record = without_profile(record_of(bridge(_STEP_AT_M, step_m), BRIDGE_MPS, _SECONDS, PS_2119.on(iri, seed)))
    taken = RoadInput(step=RoadStep(_STEP_AT_M, step_m * _TAKEN_FACTOR))
    place = {"step.height_m": step_m * _TAKEN_FACTOR, "step.start_m": _STEP_AT_M}
    theirs = fitted(record, {MASS: TRUTH[MASS]}, False, taken)
    known = fitted(record, place, True, taken)
    both = _identified(record, {MASS: TRUTH[MASS], **place}, taken)
    return _Found(
        REFUSED if _identified(record, {MASS: TRUTH[MASS]}, RoadInput()) is None else "answers",
        error_percent(theirs, MASS),
        None if both is None else (error_percent(both, MASS), standard_error_percent(both, MASS)),
        (1000 * (known.parameters["step.height_m"] - step_m), 1000 * known.standard_errors["step.height_m"]))


def _identified(record: Run, start: dict[str, float], road: RoadInput) -> Fit | None:
    try:
        return fitted(record, start, True, road)
    except NotIdentifiable:
        return None


def _row(step_m: float, iri: float, drives: Sequence[_Found]) -> tuple[Cell, ...]:
    known = [one.mass for one in drives if one.mass is not None]
    mass: tuple[Cell, ...] = (*_rms(known),) if len(known) == len(drives) else (f"known in {len(known)}", None)
    return (1000 * step_m, iri, drives[0].flat, *_rms([(one.theirs,) for one in drives]), *mass,
            *_rms([one.height for one in drives]))


def _rms(values: Sequence[tuple[float, ...]]) -> list[float]:
    return [float(value) for value in np.sqrt((np.array(values) ** 2).mean(axis=0))]


STUDY = Study("table_6_3", "Mass from a bridge's steps", "Table 6.3 (and 6.4), section 6.2.2",
              "The source measured, and its records were never published. Simulated: the car of Table 4.2, a PS-2119 "
              "with steps of 0.01 g, steps of 38.1 and 12.7 mm on roads of IRI 0, 2 and 5 m/km; the place of a step "
              "is estimated, too.", run,
              items=alike(("Table 6.3", "Table 6.4"), Word.NOT_REPRODUCIBLE,
                          "The records were never published; a flat input tells nothing of the mass, and ours refuses "
                          "it."))
