"""Fig 6.19 to 6.24 and Table D.1: 37 road segments at their speeds, as a map of roughness and one of comfort (6.5)."""

from collections.abc import Sequence

import numpy as np

from logger.chart_data import Curves, Field, Line
from logger.comfort.iso2631 import COMFORT_WORDS
from logger.profiles.track import Track
from logger.roads.iri import iri
from logger.roads.roughness_words import ROAD_RANGES
from logger.runs import Run
from logger.studies.checks import Statement, Value, Word, about
from logger.studies.dissertation.table_2_3 import PRINTED_RANGES
from logger.studies.drives import PS_2119, Array, Conditions, drive_over, random_road
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table, alike
from logger.studies.windows import Figures, comfort_shares, mean_window_by_rms, per_window, rms_error
from logger.units import KMH_MPS, MPH_MPS, WINDOW_M

PRINTED_MPH = {**dict.fromkeys(range(1, 38), 20), **dict.fromkeys(range(1, 5), 30), **dict.fromkeys((5, 8, 9), 25),
               22: 15}
"""Table D.1: the speed on each segment."""
PRINTED_KMH = {30: 48.28, 25: 40.23, 20: 32.19, 15: 24.14}
PRINTED_SLOW_KMH = 32.2
PRINTED_WINDOW_M = 7.62
PRINTED_LIMITS = (0.0, 0.315, 0.5, 0.8, 1.25, 2.0)
"""Where each word of Table 2.5 begins [m/s2], the second colour scale; the first has the ranges of Table 2.3."""
PRINTED_COMFORT = {"not_uncomfortable": "a majority", **dict.fromkeys(
    ("a_little_uncomfortable", "fairly_uncomfortable", "uncomfortable"), "a place (Table 6.5)")}
LOW_PASS_HZ = 15.0
_MEDIAN_IRI, _SPREAD, _WAVINESS = 2.5, 0.4, 1.7
_WINDOWS = 24
_SHOWN = 5
_ROADS, _FEWEST = 4, 24  # further roads of each segment, and of all slow ones together; then the r.m.s. relation alone
_LENGTH_M = _WINDOWS * WINDOW_M + 1.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    segments = effort.some(sorted(PRINTED_MPH))
    found = {one: _driven(one) for one in effort.each(segments)}
    speeds = [mph for mph in PRINTED_KMH if any(PRINTED_MPH[one] == mph for one in segments)]
    again = {mph: _biases_percent(mph, [one for one in PRINTED_MPH if PRINTED_MPH[one] == mph], effort)
             for mph in PRINTED_KMH}
    by_speed = Table("Roughness by speed: windows of 25 ft", (
        Column("printed speed [mph]", ".0f"), Column("segments", ".0f"), Column("exact mean IRI [m/km]", ".2f"),
        Column("printed, by r.m.s."),
        Column("by r.m.s. [%]", "+.1f"), Column("ridelog estimate [%]", "+.1f"),
        Column("by r.m.s. on further roads [%]", "+.1f"), Column("its standard error [%]", ".1f"),
        Column("further roads", ".0f"),
        Column("r.m.s. error by r.m.s. [m/km]", ".2f"), Column("ridelog estimate [m/km]", ".2f")), tuple(
        _row(mph, [one for number, one in found.items() if PRINTED_MPH[number] == mph], again[mph]) for mph in speeds))
    a_w = np.concatenate([one.a_w_mps2 for one in found.values()])
    shares = comfort_shares(a_w)
    comfort = Table("Comfort of all windows", (Column("word of Table 2.5"), Column("printed (6.5.2)"),
                                              Column("ours [% of windows]", ".1f")), tuple(
        (word.replace("_", " "), PRINTED_COMFORT.get(word, "not named"), share)
        for word, share in shares.items()))
    slow, fast = (np.concatenate([again[mph] for mph, kmh in PRINTED_KMH.items()
                                  if (kmh < PRINTED_SLOW_KMH) is is_slow])
                  for is_slow in (True, False))
    slow_mean, slow_std = float(slow.mean()), _standard_error(slow)
    few = [mph for mph, kmh in PRINTED_KMH.items() if kmh < PRINTED_SLOW_KMH]
    counts = {mph: list(PRINTED_MPH.values()).count(mph) for mph in PRINTED_KMH}
    verdict = ("Table D.1 agrees with itself: its two columns are one speed each. The records were never published, "
               "so the maps cannot be made again; on simulated roads the same steps give maps of the same kind. The "
               f"text finds the IRI overestimated below {PRINTED_SLOW_KMH:g} km/h. By Table D.1 that is "
               f"{sum(counts[mph] for mph in few)} segments, {counts[20]} at 20 mph and one alone at 15; {counts[25]} "
               f"are driven at 25 and {counts[30]} at 30 mph. That is few to be sure of a mean: over "
               f"{len(slow)} further roads of waviness {_WAVINESS:g} at the slow speeds the relation reads "
               f"{slow_mean:+.1f} +- {slow_std:.1f} %, at the fast ones {fast.mean():+.1f} +- "
               f"{_standard_error(fast):.1f} %. The cause is that of Fig 6.11, and the 15 Hz low-pass takes a part of "
               "it away. The waviness was chosen: on roads of 2 there would be no such error (Fig 6.9). That a "
               f"majority of windows is comfortable agrees: {shares['not_uncomfortable']:.0f} % here, for roads of a "
               f"median IRI of {_MEDIAN_IRI:g} m/km. Better: each window's IRI has a standard error, and of drives "
               "with GPS ridelog report draws both maps on the ground.")
    example = found[min(segments, key=lambda number: abs(number - _SHOWN))]
    colours = "the colours of the scale every 25 ft along an example"
    pictures = (
        Picture(Curves(f"Fig 6.21: IRI along segment {_SHOWN}", "distance [m]", "IRI [m/km]", (
            Line("exact", example.middle_m, example.exact_m_per_km),
            Line("ridelog estimate", example.middle_m, example.iri_m_per_km, example.iri_std_m_per_km),
            Line("r.m.s. relation", example.middle_m, example.by_rms_m_per_km))), f"the IRI in {colours}"),
        Picture(Curves(f"Fig 6.22: comfort along segment {_SHOWN}", "distance [m]", "a_w [m/s2]",
                       (Line("a_w", example.middle_m, example.a_w_mps2),), level=(0.315, "a little uncomfortable")),
                f"the comfort in {colours}"),
        Picture(_map("Fig 6.23: the roughness map as strips", {
            number: one.by_rms_m_per_km for number, one in found.items()}, "IRI [m/km]", 6.0),
                "37 streets in and around College Park (Fig 6.19), coloured by roughness"),
        Picture(_map("Fig 6.24: the comfort map as strips", {
            number: one.a_w_mps2 for number, one in found.items()}, "a_w [m/s2]", 0.5),
                "the same streets, coloured by comfort"))
    return Result((by_speed, comfort, _scales()), verdict, pictures, (
        *about("Fig 6.20", [
            *(Value(f"{kind}, {end} [m/km]", printed, ours, 0.0)
              for (low, high, kind), (_, *ends) in zip(ROAD_RANGES, PRINTED_RANGES, strict=True)
              for end, printed, ours in zip(("from", "to"), ends, (low, high), strict=True)),
            *(Value(f"{word.replace('_', ' ')}, from [m/s2]", printed, limit, 0.0)
              for (limit, word), printed in zip(reversed(COMFORT_WORDS), PRINTED_LIMITS, strict=True))]),
        *about(("Fig 6.21", "Fig 6.22"), [Value("length of a window [m]", PRINTED_WINDOW_M, float(np.diff(
            example.edges_m).mean()), 1e-6, Word.NOT_REPRODUCIBLE)]),
        *about("Fig 6.23", [
            Statement(f"bias by r.m.s. below {PRINTED_SLOW_KMH:g} km/h less two standard errors, {len(slow)} roads [%]",
                      "overestimated when driving slower than 32.2 km/h", slow_mean - 2 * slow_std, 0.0,
                      word=Word.NOT_REPRODUCIBLE),
            Statement("bias by r.m.s. at 25 and 30 mph [%]", "reasonable at high speeds", float(fast.mean()), -10.0,
                      10.0,
                      Word.NOT_REPRODUCIBLE)]),
        *about("Fig 6.24", [Statement("windows that are not uncomfortable [%]", "a majority of the roads is "
                                                                                "comfortable",
                                      shares["not_uncomfortable"], 50.0, word=Word.NOT_REPRODUCIBLE)]),
        *about("Table D.1", [Value(f"{mph} mph [km/h]", kmh, mph * MPH_MPS / KMH_MPS, 0.005)
                             for mph, kmh in PRINTED_KMH.items()])))


def _biases_percent(mph: int, segments: Sequence[int], effort: Effort) -> Array:
    """Errors of the windows' mean by the r.m.s. relation on further roads of the segments of a speed (n,) [%]."""
    edges_m: Array = WINDOW_M * np.arange(_WINDOWS + 1.0)
    slow = PRINTED_KMH[mph] < PRINTED_SLOW_KMH
    roads = max(2, effort.count(_ROADS * len(segments)), _FEWEST * slow * (len(segments) > 1))
    found = []
    for number in range(roads):
        segment, draw = segments[number % len(segments)], 1 + number // len(segments)
        road, drive, _ = _drive(segment, draw)
        inside = road.elevation_m[round(-road.start_m / road.spacing_m):][: round(_LENGTH_M / road.spacing_m) + 1]
        found.append(mean_window_by_rms(drive, edges_m, LOW_PASS_HZ) / iri(inside, road.spacing_m))
    return 100 * (np.array(found) - 1)


def _standard_error(values: Array) -> float:
    """Of their mean."""
    return float(values.std(ddof=1) / len(values) ** 0.5)


def _scales() -> Table:
    """Fig 6.20, as numbers."""
    comfort = list(reversed(COMFORT_WORDS))
    return Table("Fig 6.20: the two scales, six colours each (printed as a picture of colours)", (
        Column("road of Table 2.3"), Column("printed IRI from [m/km]", ".2f"), Column("to", ".2f"),
        Column("comfort of Table 2.5"), Column("a_w from [m/s2]", ".3f")), tuple(
        (kind, low, high, word.replace("_", " "), limit)
        for (low, high, kind), (limit, word) in zip(ROAD_RANGES, comfort, strict=True)))


def _drive(segment: int, draw: int = 0) -> tuple[Track, Run, Conditions]:
    """A road for a segment, the drive over it at the segment's speed, and the sensor's conditions."""
    rng = np.random.default_rng([segment, draw] if draw else segment)
    iri_m_per_km = _MEDIAN_IRI * float(np.exp(_SPREAD * rng.standard_normal()))
    road = random_road(iri_m_per_km, _LENGTH_M, 100 + segment + 1000 * draw, _WAVINESS)
    conditions = PS_2119.on(iri_m_per_km, segment + 1000 * draw)
    return road, drive_over(road, PRINTED_MPH[segment] * MPH_MPS, conditions), conditions


def _driven(segment: int) -> Figures:
    _, drive, conditions = _drive(segment)
    return per_window(drive, conditions, low_pass_hz=LOW_PASS_HZ)


def _row(mph: int, found: list[Figures], again: Array) -> tuple[Cell, ...]:
    exact, by_rms, ours = (np.concatenate([getattr(one, name) for one in found])
                           for name in ("exact_m_per_km", "by_rms_m_per_km", "iri_m_per_km"))
    slow = PRINTED_KMH[mph] < PRINTED_SLOW_KMH
    return (float(mph), float(len(found)), float(exact.mean()), "too high" if slow else "reasonable",
            *(100 * float(one.mean() / exact.mean() - 1) for one in (by_rms, ours)),
            float(again.mean()), _standard_error(again), float(len(again)),
            *(rms_error(one, exact) for one in (by_rms, ours)))


def _map(title: str, values: dict[int, Array], name: str, top: float) -> Field:
    grid = np.array([one[:_WINDOWS] for one in values.values()])
    return Field(title, "distance along the segment [m]", "segment of Table D.1",
                 WINDOW_M * np.arange(0.5, grid.shape[1]), np.array(list(values), dtype=float), grid, name, top)


STUDY = Study("fig_6_23", "37 road segments at their speeds: a map of roughness and one of comfort",
              "Fig 6.23 (6.19 to 6.24, and Table D.1), section 6.5",
              "The source measured, and its records were never published; nor are the segments' lengths given. "
              "Simulated: 37 random roads of 183 m, median IRI 2.5 m/km, waviness 1.7, each at its speed of Table D.1; "
              "the car of Table 4.2 with a PS-2119, 15 Hz low-pass, windows of 25 ft.", run,
              items=(Item("Fig 6.19", Word.NOT_REPRODUCIBLE,
                          "A map of the places, which were not published otherwise."),
                     Item("Fig 6.20", Word.AGREES,
                          "Our words change at the ends of Tables 2.3 and 2.5, on which the scales rest; the colours "
                          "are not given."),
                     *alike(("Fig 6.21", "Fig 6.22"), Word.NOT_REPRODUCIBLE,
                            "The record was never published; a simulated one is cut into the same windows."),
                     Item("Fig 6.23", Word.NOT_REPRODUCIBLE,
                          "Places and records were never published; on simulated roads of waviness 1.7 the r.m.s. "
                          "relation reads too high at the slow speeds."),
                     Item("Fig 6.24", Word.NOT_REPRODUCIBLE,
                          "Places and records were never published; on simulated roads a majority of windows is "
                          "comfortable."),
                     Item("Table D.1", Word.AGREES, "Its two columns are one speed each.")))
