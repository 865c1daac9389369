"""Table 6.5: three places that were revisited, and how large what lies there must be to feel as it is said (6.5.3)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.estimation.rms_calibration import CalibrationSettings, calibrate
from logger.roads.obstacles import pothole, step
from logger.studies.checks import Statement, Word
from logger.studies.dissertation.fig_6_23 import LOW_PASS_HZ, PRINTED_MPH
from logger.studies.drives import Array, Conditions, Shape, rav4, record_of
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table
from logger.studies.windows import per_window
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle

PRINTED = ((1, 5, "a_little_uncomfortable", "intersection of new and old pavement"),
           (2, 6, "fairly_uncomfortable", "manhole"), (3, 23, "uncomfortable", "damaged pavement"))
TO_BE_FOUND = ((12.7, 50.8, "at most", 8), (5.0, 80.0, "at most", 8), (4.0, 20.0, "at least", 7))
"""Sizes that the source names: steps from where a bridge needs maintenance to where many have one (4.4.5) [mm],
depressions of Table 2.4 [mm], damaged pavements to the roughest of Table 2.3 [m/km]; and the end of our range, with its
column, that lies nearest to not being found."""
MANHOLE_M, EDGE_M = 0.60, 0.05
_UNIT_M, _SECONDS, _ROADS = 0.01, 8.0, 40
_STARTS_M = tuple(np.arange(50.0, 57.6, 1.0).tolist())
_NEXT_WORD = {word: limit for (_, word), (limit, _) in zip(COMFORT_WORDS[1:], COMFORT_WORDS, strict=False)}
_LIMIT = {word: limit for limit, word in COMFORT_WORDS}


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    starts = effort.some(_STARTS_M)
    per_mm = [np.mean([_a_w_per_unit(shape(start), PRINTED_MPH[segment]) for start in starts]) / (1000 * _UNIT_M)
              for shape, (_, segment, *_) in zip((_edge, _manhole), effort.each(PRINTED[:2]), strict=True)]
    speed = (PRINTED_MPH[PRINTED[2][1]] * MPH_MPS,)
    (line,) = calibrate(known_vehicle(rav4()), None, CalibrationSettings(speed, roads=effort.count(_ROADS, 5)))
    factors = (*map(float, per_mm), line.a_w_per_iri.slope)
    sizes = ("height of a step [mm]", "depth of a dip of 0.6 m [mm]", "IRI over the window [m/km]")
    rows = tuple(_row(printed, what, factor) for printed, what, factor in zip(PRINTED, sizes, factors, strict=True))
    table = Table("What has to lie there for the printed word", (
        Column("location", ".0f"), Column("segment", ".0f"), Column("printed perception"), Column("printed reason"),
        Column("speed [mph]", ".0f"), Column("size that is asked for"), Column("a_w per unit of it [m/s2]", ".4f"),
        Column("from", ".0f"), Column("to", ".0f"), Column("our word in the middle")), rows)
    verdict = ("Not reproducible, as the records were never published and no size of what lay there is given; computed "
               f"the other way round, the three words ask for a step of {rows[0][7]:.0f} to {rows[0][8]:.0f} mm "
               f"between two pavements, a manhole {rows[1][7]:.0f} to {rows[1][8]:.0f} mm deep and a stretch of IRI "
               f"{rows[2][7]:.0f} to {rows[2][8]:.0f} m/km. Such edges and manholes are to be found on any campus; "
               "damage of that IRI is worse than the 10.75 m/km to which Table 2.3 has damaged pavements, so it was a "
               "short piece, or the console rang along. The model is linear, so a_w goes with the size. The ranges of "
               "Table 2.5 overlap; the more severe word is taken.")
    depths = np.linspace(0.0, 60.0, 2)
    limits = tuple(Line(word.replace("_", " "), depths, np.full(2, limit))
                   for limit, word in COMFORT_WORDS if 0 < limit < 2.0)
    values = tuple(Statement(f"location {number}: {what}, {end}", f"{word.replace('_', ' ')}: {reason}",
                             float(str(row[place])), least, most, Word.NOT_REPRODUCIBLE)
                   for (number, _, word, reason), what, row, (least, most, end, place) in zip(
                       PRINTED, sizes, rows, TO_BE_FOUND, strict=True))
    picture = Picture(Curves("a_w of the worst window by size", "height of the step, depth of the manhole [mm]",
                             "a_w [m/s2]", (Line("step, 25 mph", depths, factors[0] * depths),
                                            Line("manhole, 20 mph", depths, factors[1] * depths), *limits)),
                      "Fig 6.25 to 6.27: photographs of the three places")
    return Result((table,), verdict, (picture,), values)


def _edge(start_m: float) -> Shape:
    return lambda place_m: step(place_m, start_m, _UNIT_M)


def _manhole(start_m: float) -> Shape:
    return lambda place_m: pothole(place_m, start_m, _UNIT_M, MANHOLE_M, EDGE_M)


def _a_w_per_unit(shape: Shape, mph: int) -> float:
    """Of the worst window over something of 10 mm [m/s2]."""
    quiet = Conditions(noise_mps2=1e-3)
    a_w: Array = per_window(record_of(shape, mph * MPH_MPS, _SECONDS, quiet), quiet, low_pass_hz=LOW_PASS_HZ).a_w_mps2
    return float(a_w.max())


def _row(printed: tuple[int, int, str, str], what: str, factor: float) -> tuple[Cell, ...]:
    number, segment, word, reason = printed
    low, high = _LIMIT[word] / factor, _NEXT_WORD[word] / factor
    ours = comfort_word(factor * (low + high) / 2)
    return (float(number), float(segment), word.replace("_", " "), reason, float(PRINTED_MPH[segment]), what, factor,
            low, high, ours.replace("_", " "))


STUDY = Study("table_6_5", "Three places that were revisited, and what must lie there", "Table 6.5, section 6.5.3",
              "The source measured. Simulated: the car of Table 4.2 at the speeds of Table D.1 over a step and a dip "
              "on a flat road, 15 Hz low-pass, weighted with Wk, the worst window of 25 ft, on the average of where "
              "in a window it lies; random roads for the damage.", run,
              items=(Item("Table 6.5", Word.NOT_REPRODUCIBLE,
                          "Neither the records nor the sizes of what lay there were published; the printed words ask "
                          "for a step, a manhole and damage of sizes that are to be found."),))
