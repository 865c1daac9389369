"""Fig 4.34 and 4.35: discomfort of a bridge's step, per metre and per 10 m (4.4.6)."""

from itertools import pairwise

import numpy as np

from logger.chart_data import Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS, a_w, comfort_word
from logger.dsp.weightings.wk import WEIGHTING
from logger.runs import Run
from logger.studies.checks import Statement, Value, Word, about
from logger.studies.drives import BRIDGE_MPS, RATE_HZ, STEP_M, Array, Conditions, bridge, record_of
from logger.studies.study import Column, Effort, Item, Picture, Result, Study, Table

PRINTED_PEAK_MPS2 = 1.5
UNCOMFORTABLE = (0.8, 2.5)
"""From the lower end of uncomfortable to the upper end of very uncomfortable, Table 2.5 [m/s2]."""
SECTIONS_M = (1.0, 10.0)
OF_ONE_SIZE = 0.4  # a metre is a thirteenth of a second: where it begins moves its a_w by 0.2; as much for "close to"
_STEP_AT_M, _SECONDS, _LENGTH_M = 50.0, 8.0, 100.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    roads = effort.count(20)
    found = [_sections(seed) for seed in effort.each(range(roads))]
    rows = tuple((section, PRINTED_PEAK_MPS2 if section == 1 else None, float(found[0][index].max()),
                  min(float(one[index].max()) for one in found), max(float(one[index].max()) for one in found),
                  comfort_word(float(found[0][index].max())).replace("_",
                                                                     " ")) for index, section in enumerate(SECTIONS_M))
    table = Table("Largest weighted r.m.s. acceleration", (
        Column("section [m]", ".0f"), Column("printed, nearly [m/s2]", ".1f"), Column("ours [m/s2]", ".2f"),
        Column(f"least of {roads} roads", ".2f"), Column("largest", ".2f"), Column("in words")), rows)
    verdict = (f"Of one size: up to {found[0][0].max():.2f} m/s2 per metre beside nearly 1.5. The source does not "
               "give its road, its filter's start or how it weighs a metre, in which this car has a thirteenth of a "
               "second; over 10 m what a person feels is already half of that.")
    lines = tuple(Line(f"{section:g} m sections", np.arange(section / 2, _LENGTH_M, section), one)
                  for section, one in zip(SECTIONS_M, found[0], strict=True))
    picture = Picture(Curves("Weighted r.m.s. acceleration along the road; the step lies at 50 m", "distance [m]",
                             "a_w [m/s2]", lines),
                      "a_w of each metre, up to nearly 1.5 m/s2 (Fig 4.34), and of each 10 m, in which the step is "
                      "still clear (Fig 4.35)")
    each, tens = (float(one.max()) for one in found[0])
    quiet = float(np.delete(found[0][1], int(found[0][1].argmax())).max())
    return Result((table,), verdict, (picture,), (
        *about("Fig 4.34", [Value("largest a_w of a metre, nearly [m/s2]", PRINTED_PEAK_MPS2, each, OF_ONE_SIZE,
                                  Word.NOT_REPRODUCIBLE)]),
        *about("Fig 4.34", [Statement("largest a_w of a metre [m/s2]", "uncomfortable to very uncomfortable", each,
                                      UNCOMFORTABLE[0], UNCOMFORTABLE[1], Word.NOT_REPRODUCIBLE)]),
        *about("Fig 4.35", [
            Statement("largest a_w of 10 m [m/s2]", "still clear that the bump causes a discomfort", tens,
                      COMFORT_WORDS[-2][0], word=Word.NOT_REPRODUCIBLE),
            Statement("that over the largest of the other sections", "still clear", tens / quiet, 2.0,
                      word=Word.NOT_REPRODUCIBLE)])))


def _sections(seed: int) -> list[Array]:
    """a_w [m/s2] of each section of the way, for both lengths of a section."""
    record = record_of(bridge(_STEP_AT_M, -STEP_M), BRIDGE_MPS, _SECONDS, Conditions(0.0, 0.0, 2.0, seed))
    return [per_section(record, section_m, _LENGTH_M) for section_m in SECTIONS_M]


def per_section(record: Run, section_m: float, length_m: float) -> Array:
    """a_w [m/s2] by Wk of each section of the way's first ``length_m``, the record weighted as a whole."""
    weighted = WEIGHTING.weigh(record.measured_mps2, RATE_HZ)
    edges = np.searchsorted(record.distance_m, np.arange(0, length_m + section_m / 2, section_m))
    return np.array([a_w(weighted[start:end]) for start, end in pairwise(edges.tolist())])


STUDY = Study("fig_4_34", "Discomfort of a bridge's step, per metre and per 10 m", "Fig 4.34 (and 4.35), section 4.4.6",
              "Simulated as in the source: a step of 38.1 mm down at 48.3 km/h on a road of IRI 2 m/km; weighting Wk.",
              run,
              items=(Item("Fig 4.34", Word.NOT_REPRODUCIBLE,
                          "Road and filter of the figure are not printed; simulated, the discomfort per metre is of "
                          "the printed size."),
                     Item("Fig 4.35", Word.NOT_REPRODUCIBLE,
                          "Road and filter of the figure are not printed; simulated, the step is still clear over 10 "
                          "m.")))
