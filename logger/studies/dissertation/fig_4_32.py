"""Fig 4.32 and 4.33: a bridge's step on a smooth road, and what it does to the car (4.4.6)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.gd_iri import relative_spread
from logger.roads.iri import iri
from logger.roads.iso8608 import gd_n0_from_iri, generate
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.drives import BRIDGE_MPS, SPACING_M, STEP_M, Conditions, bridge, record_of
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED_IRI = 2.0
_STEP_AT_M, _LENGTH_M, _SEED = 50.0, 100.0, 0
_BEHIND_M = 15.0  # both axles are over the step and the body has swung out


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    conditions = Conditions(noise_mps2=0.0, iri_m_per_km=PRINTED_IRI, seed=_SEED)
    (record,) = (record_of(bridge(_STEP_AT_M, -STEP_M), BRIDGE_MPS, _LENGTH_M / BRIDGE_MPS, conditions)
                 for _ in effort.each(range(1)))
    accel, distance_m = record.measured_mps2, record.distance_m
    hit = (distance_m >= _STEP_AT_M) & (distance_m < _STEP_AT_M + _BEHIND_M)
    peaks = [float(np.abs(accel[part]).max()) for part in (hit, ~hit)]
    place_m = np.arange(0, _LENGTH_M, SPACING_M)
    road = generate(gd_n0_from_iri(PRINTED_IRI), _LENGTH_M, SPACING_M, _SEED)[: len(place_m)]
    stepped = road + bridge(_STEP_AT_M, -STEP_M)(place_m)
    table = Table("The step and the road (printed as pictures only)", (
        Column("what"), Column("IRI of the 100 m [m/km]", ".2f"), Column("largest acceleration [m/s2]", ".2f")),
        (("the road without the step, printed IRI 2", iri(road, SPACING_M), peaks[1]),
         ("with the step", iri(stepped, SPACING_M), peaks[0])))
    verdict = (f"As printed, the step stands out: {peaks[0]:.1f} m/s2 against {peaks[1]:.1f} on the rest of the road. "
               f"It alone takes the IRI of these 100 m from {table.rows[0][1]:.1f} to {table.rows[1][1]:.1f} m/km; by "
               "the 4 m/km of the text it would still be a good bridge's end, so an average over 100 m hides it. The "
               "roughness of the printed road is another draw.")
    pictures = (Picture(Curves("A step on a road of IRI 2 m/km (Fig 4.32)", "distance [m]", "elevation [mm]",
                               (Line("road", place_m[::5], 1000 * stepped[::5]),)),
                        "a smooth road that steps down by 38.1 mm"),
                Picture(Curves("The car's answer (Fig 4.33)", "distance [m]", "acceleration [m/s2]",
                               (Line("body", distance_m, accel),)),
                        "the response, in which the step is clear beside the rest of the road"))
    spread = relative_spread(_LENGTH_M)
    values: tuple[Check, ...] = (*about("Fig 4.32", [Value("IRI of the road without the step [m/km]", PRINTED_IRI,
                                                           iri(road, SPACING_M),
                                        PRINTED_IRI * (0.01 + 3 * spread), Word.NOT_REPRODUCIBLE)]),
              *about("Fig 4.33", [Statement("peak at the step over the peak elsewhere", "clearly shows the effect of "
                                                                                        "the "
                                            "bump", peaks[0] / peaks[1], 2.0, word=Word.NOT_REPRODUCIBLE)]))
    return Result((table,), verdict, pictures, values)


STUDY = Study("fig_4_32", "A bridge's step on a smooth road, and the car's answer", "Fig 4.32, section 4.4.6",
              "Simulated as in the source: a step of 38.1 mm down at 48.3 km/h on a road of IRI 2 m/km.", run,
              items=(Item("Fig 4.32", Word.NOT_REPRODUCIBLE,
                          "The road of the figure is another draw of chance; this one has the printed IRI within that "
                          "chance."),
                     Item("Fig 4.33", Word.NOT_REPRODUCIBLE,
                          "It is the response to that road; simulated, the step stands out as described.")))
