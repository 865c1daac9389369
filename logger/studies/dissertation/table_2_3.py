"""Tables 2.3 and 2.4 and Fig 2.16: which roads have which IRI, and how they ride (2.2.2.3)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.roughness_words import federal_condition, ride_words, road_kinds
from logger.studies.checks import Value, Word, about
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table, alike

PRINTED_RANGES = (("airport runways and superhighways", 0.25, 1.75), ("new pavements", 1.50, 3.25),
                  ("older pavements", 2.25, 5.75), ("maintained unpaved roads", 3.25, 10.00),
                  ("damaged pavements", 4.00, 10.75), ("rough unpaved roads", 8.00, 20.00))
PRINTED_MARKS = (4.0, 6.0, 8.0, 10.0)
"""Marks of Table 2.4's scale at which the second to fifth descriptions begin [m/km]."""
PRINTED_FEDERAL = (("good", 1.50), ("fair", 2.68))
"""Upper ends [m/km]: the targets of 2006 and of 2002, 95 and 170 in/mi."""
_STEP = 0.001  # of the IRI that is asked for; half the last printed figure is 0.005
_MOST = 25.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    iri = np.round(np.arange(0, _MOST, _STEP), 3)
    (kinds,) = ([road_kinds(one) for one in iri.tolist()] for _ in effort.each(range(1)))
    rows, lines = [], []
    values: list[Value] = []
    for place, (name, low, high) in enumerate(PRINTED_RANGES):
        held = iri[[name in kind for kind in kinds]]
        ours = float(held.min()), float(held.max())
        rows.append((name, low, ours[0], high, ours[1]))
        values += about(("Table 2.3", "Fig 2.16"), [
            Value(f"{name}, {end} [m/km]", printed, mine, 0.005)
            for end, printed, mine in zip(("from", "to"), (low, high), ours, strict=True)])
        lines.append(Line(name, np.array(ours), np.full(2, float(len(PRINTED_RANGES) - place))))
    ranges = Table("Which roads have it", (Column("road"), Column("printed from [m/km]", ".2f"), Column(
        "ours", ".2f"), Column("printed to [m/km]", ".2f"), Column("ours", ".2f")), tuple(rows))
    words = [ride_words(one) for one in iri.tolist()]
    changes = [float(iri[place]) for place in range(1, len(iri)) if words[place] != words[place - 1]]
    values += about("Table 2.4", [Value(f"ride, mark {mark:.0f} [m/km]", mark, change, 0.005)
                                  for mark, change in zip(PRINTED_MARKS, changes, strict=True)])
    rides = Table("How a paved road rides", (Column("printed from [m/km]", ".0f"), Column("ours", ".2f"), Column(
        "in short")), tuple((mark, change, ride_words(change))
                            for mark, change in zip((None, *PRINTED_MARKS), (0.0, *changes), strict=True)))
    federal = [federal_condition(one) for one in iri.tolist()]
    values += about("2.2.2.3 targets", [
        Value(f"{word} up to [m/km]", printed, float(iri[[one == word for one in federal]].max()), 0.005)
        for word, printed in PRINTED_FEDERAL])
    verdict = ("All bounds agree. Table 2.4 writes its descriptions along a scale; each is taken to hold from the "
               "mark at which it stands up to the next, the first from 0. The targets of the text, 1.50 and 2.68 m/km, "
               "are 95 and 170 in/mi, between which a road of the federal system is called fair today.")
    picture = Picture(Curves("Which roads have it", "IRI [m/km]", "kind of road, as in the table", tuple(lines)),
                      "the ranges of six kinds of road as Sayers and Karamihas (1998) draw them, those of Table 2.3")
    return Result((ranges, rides), verdict, (picture,), tuple(values))


STUDY = Study("table_2_3", "Which roads have which IRI, and how they ride", "Table 2.3, section 2.2.2.3",
              "Ridelog is asked for its words from 0 to 25 m/km in steps of 0.001; the values at which they change "
              "stand beside the printed ones.", run,
              items=(*alike(("Table 2.3", "Fig 2.16"), Word.AGREES,
                            "Each kind of road begins and ends at the printed IRI."),
                     Item("Table 2.4", Word.AGREES, "The description of the ride changes at the printed marks."),
                     Item("2.2.2.3 targets", Word.AGREES, "Good and fair roads end at the targets of 2006 and 2002.")))
