"""Fig 6.19 to 6.24 and Table D.1: 37 road segments at their speeds, as a map of roughness and one of comfort (6.5)."""

import numpy as np

from logger.chart_data import Curves, Field, Line
from logger.comfort.iso2631 import COMFORT_WORDS
from logger.roads.roughness_words import ROAD_RANGES
from logger.studies.drives import PS_2119, Array, drive_over, random_road
from logger.studies.study import Cell, Column, Effort, Result, Study, Table, Value, Word
from logger.studies.windows import Figures, comfort_shares, per_window, rms_error
from logger.units import KMH_MPS, MPH_MPS, WINDOW_M

PRINTED_MPH = {**dict.fromkeys(range(1, 38), 20), **dict.fromkeys(range(1, 5), 30), **dict.fromkeys((5, 8, 9), 25),
               22: 15}
"""Table D.1: the speed on each segment."""
PRINTED_KMH = {30: 48.28, 25: 40.23, 20: 32.19, 15: 24.14}
PRINTED_SLOW_KMH = 32.2
PRINTED_COMFORT = {"not_uncomfortable": "a majority", **dict.fromkeys(
    ("a_little_uncomfortable", "fairly_uncomfortable", "uncomfortable"), "a place (Table 6.5)")}
LOW_PASS_HZ = 15.0
_MEDIAN_IRI, _SPREAD, _WAVINESS = 2.5, 0.4, 1.7
_WINDOWS = 24
_SHOWN = 5


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    segments = effort.some(sorted(PRINTED_MPH))
    found = {one: _driven(one) for one in effort.each(segments)}
    speeds = [mph for mph in PRINTED_KMH if any(PRINTED_MPH[one] == mph for one in segments)]
    by_speed = Table("Roughness by speed: windows of 25 ft", (
        Column("printed speed [mph]", ".0f"), Column("segments", ".0f"), Column("exact mean IRI [m/km]", ".2f"),
        Column("printed, by r.m.s."),
        Column("by r.m.s. [%]", "+.1f"), Column("ridelog estimate [%]", "+.1f"),
        Column("r.m.s. error by r.m.s. [m/km]", ".2f"), Column("ridelog estimate [m/km]", ".2f")), tuple(
        _row(mph, [one for number, one in found.items() if PRINTED_MPH[number] == mph]) for mph in speeds))
    a_w = np.concatenate([one.a_w_mps2 for one in found.values()])
    shares = comfort_shares(a_w)
    comfort = Table("Comfort of all windows", (Column("word of Table 2.5"), Column("printed (6.5.2)"),
                                              Column("ours [% of windows]", ".1f")), tuple(
        (word.replace("_", " "), PRINTED_COMFORT.get(word, "not named"), share)
        for word, share in shares.items()))
    slow = [row for row in by_speed.rows if float(str(row[0])) <= 20]
    verdict = ("Table D.1 agrees with itself: its two columns are one speed each. The records were never published, "
               "so the maps cannot be made again; on simulated roads the same steps give maps of the same kind. The "
               f"text finds the IRI overestimated below {PRINTED_SLOW_KMH:g} km/h: on roads of waviness {_WAVINESS:g} "
               f"the relation reads {slow[0][4]:+.0f} % at 20 mph, for the reason that Fig 6.11 gives and less only "
               f"because the 15 Hz low-pass takes a part away, and ridelog estimate {slow[0][5]:+.0f} %. That a "
               f"majority of windows is comfortable agrees: {shares['not_uncomfortable']:.0f} % here, for roads of a "
               f"median IRI of {_MEDIAN_IRI:g} m/km. Better: each window's IRI has a standard error, and of drives "
               "with GPS ridelog report draws both maps on the ground.")
    example = found[min(segments, key=lambda number: abs(number - _SHOWN))]
    return Result((by_speed, comfort, _scales()), verdict, (
        Curves(f"Fig 6.21: IRI along segment {_SHOWN}. Printed: an example, every 25 ft in the colours of the scale",
               "distance [m]", "IRI [m/km]", (
                   Line("exact", example.middle_m, example.exact_m_per_km),
                   Line("ridelog estimate", example.middle_m, example.iri_m_per_km, example.iri_std_m_per_km),
                   Line("r.m.s. relation", example.middle_m, example.by_rms_m_per_km))),
        Curves(f"Fig 6.22: comfort along segment {_SHOWN}. Printed: the same example",
               "distance [m]", "a_w [m/s2]", (Line("a_w", example.middle_m, example.a_w_mps2),),
               level=(0.315, "a little uncomfortable")),
        _map("Fig 6.23: the roughness map as strips. Printed: 37 streets around College Park, coloured",
             {number: one.by_rms_m_per_km for number, one in found.items()}, "IRI [m/km]", 6.0),
        _map("Fig 6.24: the comfort map as strips. Printed: the same streets, coloured",
             {number: one.a_w_mps2 for number, one in found.items()}, "a_w [m/s2]", 0.5)), tuple(
        Value(f"Table D.1: {mph} mph [km/h]", kmh, mph * MPH_MPS / KMH_MPS, 0.005) for mph, kmh in PRINTED_KMH.items()))


def _scales() -> Table:
    """Fig 6.20, as numbers."""
    comfort = list(reversed(COMFORT_WORDS))
    return Table("Fig 6.20: the two scales, six colours each (printed as a picture of colours)", (
        Column("road of Table 2.3"), Column("printed IRI from [m/km]", ".2f"), Column("to", ".2f"),
        Column("comfort of Table 2.5"), Column("a_w from [m/s2]", ".3f")), tuple(
        (kind, low, high, word.replace("_", " "), limit)
        for (low, high, kind), (limit, word) in zip(ROAD_RANGES, comfort, strict=True)))


def _driven(segment: int) -> Figures:
    rng = np.random.default_rng(segment)
    iri = _MEDIAN_IRI * float(np.exp(_SPREAD * rng.standard_normal()))
    road = random_road(iri, _WINDOWS * WINDOW_M + 1.0, 100 + segment, _WAVINESS)
    conditions = PS_2119.on(iri, segment)
    return per_window(drive_over(road, PRINTED_MPH[segment] * MPH_MPS, conditions), conditions,
                      low_pass_hz=LOW_PASS_HZ)


def _row(mph: int, found: list[Figures]) -> tuple[Cell, ...]:
    exact, by_rms, ours = (np.concatenate([getattr(one, name) for one in found])
                           for name in ("exact_m_per_km", "by_rms_m_per_km", "iri_m_per_km"))
    slow = PRINTED_KMH[mph] < PRINTED_SLOW_KMH
    return (float(mph), float(len(found)), float(exact.mean()), "too high" if slow else "reasonable",
            *(100 * float(one.mean() / exact.mean() - 1) for one in (by_rms, ours)),
            *(rms_error(one, exact) for one in (by_rms, ours)))


def _map(title: str, values: dict[int, Array], name: str, top: float) -> Field:
    grid = np.array([one[:_WINDOWS] for one in values.values()])
    return Field(title, "distance along the segment [m]", "segment of Table D.1",
                 WINDOW_M * np.arange(0.5, grid.shape[1]), np.array(list(values), dtype=float), grid, name, top)


STUDY = Study("fig_6_23", "37 road segments at their speeds: a map of roughness and one of comfort",
              "Fig 6.23 (6.19 to 6.24, and Table D.1), section 6.5",
              "The source measured, and its records were never published; nor are the segments' lengths told. "
              "Simulated: 37 random roads of 183 m, median IRI 2.5 m/km, waviness 1.7, each at its speed of Table D.1; "
              "the car of Table 4.2 with a PS-2119, 15 Hz low-pass, windows of 25 ft.", run,
              covers=(*(f"Fig 6.{number}" for number in range(19, 25)), "Table D.1"), word=Word.NOT_REPRODUCIBLE,
              because="Places and records of the segments were never published; on simulated roads at the printed "
                      "speeds the r.m.s. relation reads too high where the car is slow, as the text says.")
