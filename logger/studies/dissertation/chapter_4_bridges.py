"""Chapter 4: a bridge's step, what it tells of the mass, and its discomfort. Names of one item end in its number.

Fig 4.30: input and output of a bridge's step (4.4.5).

Fig 4.31: the mass that comes out when a bridge's step is taken for one of another height (4.4.5).

Fig 4.32 and 4.33: a bridge's step on a smooth road, and what it does to the car (4.4.6).

Fig 4.34 and 4.35: discomfort of a bridge's step, per metre and per 10 m (4.4.6).

Fig 4.36: discomfort of a bridge's step by its height and the speed (4.4.6).
"""

from itertools import pairwise

import numpy as np
import numpy.typing as npt

from logger.chart_data import Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS, a_w, comfort_word
from logger.dsp.weightings.wk import WEIGHTING
from logger.identification.unknown_inputs import RoadInput, RoadStep
from logger.roads.elevation_spectrum import relative_spread
from logger.roads.iri import iri
from logger.roads.iso8608 import gd_n0_from_iri, generate
from logger.runs import Run
from logger.studies.drives import (
    BRIDGE_MPS,
    MASS,
    RATE_HZ,
    SPACING_M,
    STEP_M,
    TRUTH,
    Array,
    Conditions,
    bridge,
    fitted,
    rav4,
    record_of,
    without_profile,
)
from logger.studies.study import (
    Check,
    Column,
    Item,
    Picture,
    Result,
    Statement,
    Study,
    Table,
    Value,
    Word,
    Workload,
    about,
)
from logger.units import MPH_MPS
from logger.vehicle.models import structure_of


def _f4_30(effort: Workload) -> Result:
    step_at_m = 10.0
    still = 0.02  # of the peak: the body has swung out
    (record,) = (record_of(bridge(step_at_m), BRIDGE_MPS, 4.0, Conditions(noise_mps2=0.0))
                 for _ in effort.each(range(1)))
    wheelbase_m = float(np.max(structure_of(rav4()).behind_m))
    accel, time_s = record.measured_mps2, np.arange(len(record.measured_mps2)) / record.rate_hz
    front_s = step_at_m / BRIDGE_MPS
    front = (time_s >= front_s) & (time_s < front_s + wheelbase_m / BRIDGE_MPS)
    peaks = [float(np.abs(accel[part]).max()) for part in (front, time_s >= front_s + wheelbase_m / BRIDGE_MPS)]
    shaken_s = float(time_s[np.abs(accel) > still * max(peaks)].max()) - front_s
    table = Table("A step of 38.1 mm at 48.3 km/h (printed as a picture only)", (
        Column("rear axle behind the front [s]", ".3f"), Column("peak from the front axle [m/s2]", ".2f"),
        Column("from the rear axle [m/s2]", ".2f"), Column("duration of the response [s]", ".1f")),
        ((wheelbase_m / BRIDGE_MPS, *peaks, shaken_s),))
    verdict = (f"Two steps, {wheelbase_m / BRIDGE_MPS:.2f} s apart, and two impacts; the body's motion decays within "
               f"{shaken_s:.1f} s. The source does not give the height and speed of this figure; those of the analysis "
               "that follows are used.")
    pictures = (Picture(Curves("Input", "time [s]", "elevation under the tire [mm]", tuple(
        Line(name, time_s, 1000 * bridge(step_at_m, STEP_M)(record.distance_m - behind_m))
        for name, behind_m in (("front", 0.0), ("rear", wheelbase_m)))), "the step as the input of the model"),
        Picture(Curves("Output", "time [s]", "acceleration [m/s2]", (Line("body", time_s, accel),)),
                "the simulated response to it"))
    later_s = _blow_s(accel, time_s, ~front) - _blow_s(accel, time_s, front)
    values = (Statement("delay of the second impact, over wheelbase by speed", "a step as the input of both axles",
                        later_s * BRIDGE_MPS / wheelbase_m, 0.9, 1.1, Word.NOT_REPRODUCIBLE),
              Statement("share of the acceleration's energy within 1 s of the step", "easily located by the response",
                        float(np.sum(accel[(time_s >= front_s) & (time_s < front_s + 1)] ** 2) / np.sum(accel**2)), 0.9,
                        word=Word.NOT_REPRODUCIBLE))
    return Result((table,), verdict, pictures, values)


def _blow_s(accel: Array, time_s: Array, part: npt.NDArray[np.bool_]) -> float:
    """When the acceleration is largest within a part of the record [s]."""
    return float(time_s[part][np.abs(accel[part]).argmax()])


F4_30 = Study("fig_4_30", "Input and output of a bridge's step", "Fig 4.30, section 4.4.5",
              "Simulated: the car of Table 4.2 over a step of 38.1 mm at 48.3 km/h, no roughness, no noise.", _f4_30,
              items=(Item("Fig 4.30", Word.NOT_REPRODUCIBLE,
                          "Height and speed of the figure are not printed; it is simulated under those of Fig 4.31."),))


_STEP_AT_M_F4_31 = 20.0


def _f4_31(effort: Workload) -> Result:
    heights_m = tuple(np.linspace(0.0254, 0.0508, 9).round(6).tolist())
    record = without_profile(record_of(bridge(_STEP_AT_M_F4_31), BRIDGE_MPS, 6.0, Conditions()))
    heights = effort.some(heights_m, 3)
    white, masses = (np.array(ends) for ends in zip(*([_mass(record, height, ours) for ours in (False, True)]
                                                      for height in effort.each(heights)), strict=True))
    in_proportion = TRUTH[MASS] * np.array(heights) / STEP_M
    table = Table("Mass found for each assumed height of the step", (
        Column("assumed height [mm]", ".2f"), Column("printed: in proportion [kg]", ".1f"),
        Column("ours, residual as white noise [kg]", ".1f"),
        Column("ours, innovations form [kg]", ".1f")),
        tuple(zip((1000 * np.array(heights)).tolist(), in_proportion.tolist(), white.tolist(), masses.tolist(),
                  strict=True)))
    taken = RoadInput(step=RoadStep(_STEP_AT_M_F4_31, heights_m[0]))
    place = {"step.height_m": heights_m[0], "step.start_m": _STEP_AT_M_F4_31}
    known, both = fitted(record, place, True, taken), fitted(record, {MASS: 700.0, **place}, True, taken)
    ours = Table("Ours: the step estimated", (
        Column("what is known"), Column("height [mm]", ".2f"), Column("its standard error [mm]", ".2f"),
        Column("mass [kg]", ".1f"), Column("its standard error [kg]", ".1f")), tuple(
        (words, 1000 * one.parameters["step.height_m"], 1000 * one.standard_errors["step.height_m"],
         one.parameters.get(MASS), one.standard_errors.get(MASS))
        for words, one in (("the mass, 875 kg", known), ("neither mass nor height", both))))
    powers = [float(np.polyfit(np.log(heights), np.log(ends), 1)[0]) for ends in (white, masses)]
    verdict = ("As printed, the mass is exact at 38.1 mm and rises along a line, but not quite in proportion: it "
               f"varies as the power {powers[0]:.2f} of the assumed height, {powers[1]:.2f} in the innovations form, "
               "because the mass also sets how fast the body swings back. That is why ours can find both at once, "
               f"{both.parameters[MASS]:.0f} ± {both.standard_errors[MASS]:.0f} kg and "
               f"{1000 * both.parameters['step.height_m']:.1f} ± {1000 * both.standard_errors['step.height_m']:.1f} "
               "mm, on a road without roughness. With a known mass, the car measures the step, as the source "
               "proposes. The printed 48.3 m/s should be km/h.")
    picture = Picture(Curves("Mass found for each assumed height of a step of 38.1 mm", "assumed height [mm]",
                             "mass [kg]", (Line("white noise", 1000 * np.array(heights), white),
                                           Line("innovations form", 1000 * np.array(heights), masses),
                                           Line("in proportion", 1000 * np.array(heights), in_proportion, dots=True)),
                             (TRUTH[MASS], "875 kg")),
                      "masses for heights of 25.4 to 50.8 mm, linear in the height")
    exact = float(white[int(np.abs(np.array(heights) - STEP_M).argmin())])
    values: tuple[Check, ...] = (*about("Fig 4.31", [Value("mass at the true height, 38.1 mm [kg]", TRUTH[MASS], exact,
                                        0.01 * TRUTH[MASS])]),
              *about("Fig 4.31", [
                  Statement("correlation of mass and assumed height, the source's way", "linearly proportional",
                            float(np.corrcoef(heights, white)[0, 1]), 0.99),
                  Statement("error of the mass with the height estimated, over its standard error",
                            "the mass cannot be predicted without the "
                                                                                                    "height",
                            (both.parameters[MASS] - TRUTH[MASS]) / both.standard_errors[MASS], -3.0, 3.0, Word.BETTER),
                  Statement("standard error of that mass [%]", "large amounts of error",
                            100 * both.standard_errors[MASS]
                            / TRUTH[MASS], 0.0, 2.0, Word.BETTER)]),
              *about("4.4.5 height from a known mass", [Value(
                  "height with the mass known, true 38.1 [mm]", 1000 * STEP_M, 1000 * known.parameters["step.height_m"],
                  3000 * known.standard_errors["step.height_m"])]),
              *about("4.4.5 speed", [Value("48.3 m/s [mph]", 30.0, 48.3 / MPH_MPS, 0.5, Word.MISPRINT,
                                           of_print=True)]))
    return Result((table, ours), verdict, (picture,), values)


def _mass(record: Run, height_m: float, ours: bool) -> float:
    return fitted(record, {MASS: TRUTH[MASS]}, ours,
                  RoadInput(step=RoadStep(_STEP_AT_M_F4_31, height_m))).parameters[MASS]


F4_31 = Study("fig_4_31", "Mass against the assumed height of a bridge's step", "Fig 4.31, section 4.4.5",
              "Simulated as in the source: a step of 38.1 mm at 48.3 km/h, no roughness; sensor noise 0.05 m/s2.",
              _f4_31,
              items=(Item("Fig 4.31", Word.BETTER,
                          "Exact at the true height and linear, as printed; ours finds mass and height together."),
                     Item("4.4.5 height from a known mass", Word.AGREES,
                          "With a known mass the fit gives the step's height, as the text proposes."),
                     Item("4.4.5 speed", Word.MISPRINT, "30 mph are 48.3 km/h, not m/s.")))


def _f4_32(effort: Workload) -> Result:
    printed_iri = 2.0
    step_at_m, length_m, seed = 50.0, 100.0, 0
    behind_m = 15.0  # both axles are over the step and the body has swung out
    conditions = Conditions(noise_mps2=0.0, iri_m_per_km=printed_iri, seed=seed)
    (record,) = (record_of(bridge(step_at_m, -STEP_M), BRIDGE_MPS, length_m / BRIDGE_MPS, conditions)
                 for _ in effort.each(range(1)))
    accel, distance_m = record.measured_mps2, record.distance_m
    hit = (distance_m >= step_at_m) & (distance_m < step_at_m + behind_m)
    peaks = [float(np.abs(accel[part]).max()) for part in (hit, ~hit)]
    place_m = np.arange(0, length_m, SPACING_M)
    road = generate(gd_n0_from_iri(printed_iri), length_m, SPACING_M, seed)[: len(place_m)]
    stepped = road + bridge(step_at_m, -STEP_M)(place_m)
    table = Table("The step and the road (printed as pictures only)", (
        Column("what"), Column("IRI of the 100 m [m/km]", ".2f"), Column("largest acceleration [m/s2]", ".2f")),
        (("the road without the step, printed IRI 2", iri(road, SPACING_M), peaks[1]),
         ("with the step", iri(stepped, SPACING_M), peaks[0])))
    verdict = (f"As printed, the step stands out: {peaks[0]:.1f} m/s2 against {peaks[1]:.1f} on the rest of the road. "
               f"The step alone raises the IRI of these 100 m from {table.rows[0][1]:.1f} to {table.rows[1][1]:.1f} "
               "m/km; by the text's limit of 4 m/km it would still be a good bridge end, so an average over 100 m "
               "hides it. The printed road is another random draw.")
    pictures = (Picture(Curves("A step on a road of IRI 2 m/km (Fig 4.32)", "distance [m]", "elevation [mm]",
                               (Line("road", place_m[::5], 1000 * stepped[::5]),)),
                        "a smooth road that steps down by 38.1 mm"),
                Picture(Curves("Response of the car (Fig 4.33)", "distance [m]", "acceleration [m/s2]",
                               (Line("body", distance_m, accel),)),
                        "the response, in which the step stands out from the rest of the road"))
    spread = relative_spread(length_m)
    values: tuple[Check, ...] = (*about("Fig 4.32", [Value("IRI of the road without the step [m/km]", printed_iri,
                                                           iri(road, SPACING_M),
                                        printed_iri * (0.01 + 3 * spread), Word.NOT_REPRODUCIBLE)]),
              *about("Fig 4.33", [Statement("peak at the step over the peak elsewhere",
                                            "clearly shows the effect of the "
                                            "bump", peaks[0] / peaks[1], 2.0, word=Word.NOT_REPRODUCIBLE)]))
    return Result((table,), verdict, pictures, values)


F4_32 = Study("fig_4_32", "A bridge's step on a smooth road, and the response of the car", "Fig 4.32, section 4.4.6",
              "Simulated as in the source: a step of 38.1 mm down at 48.3 km/h on a road of IRI 2 m/km.", _f4_32,
              items=(Item("Fig 4.32", Word.NOT_REPRODUCIBLE,
                          "The printed road is another random draw; this one has the printed IRI within the scatter "
                          "of such draws."),
                     Item("Fig 4.33", Word.NOT_REPRODUCIBLE,
                          "The response to that road cannot be repeated; in a simulated one, the step stands out as "
                          "described.")))


PRINTED_PEAK_MPS2 = 1.5
SECTIONS_M = (1.0, 10.0)
OF_ONE_SIZE = 0.4  # a metre is a thirteenth of a second: where it begins moves its a_w by 0.2; as much for "close to"
_LENGTH_M_F4_34 = 100.0


def _f4_34(effort: Workload) -> Result:
    # From the lower end of uncomfortable to the upper end of very uncomfortable, Table 2.5 [m/s2].
    uncomfortable = (0.8, 2.5)
    roads = effort.count(20)
    found = [_sections(seed) for seed in effort.each(range(roads))]
    rows = tuple((section, PRINTED_PEAK_MPS2 if section == 1 else None, float(found[0][index].max()),
                  min(float(one[index].max()) for one in found), max(float(one[index].max()) for one in found),
                  comfort_word(float(found[0][index].max())).replace("_",
                                                                     " ")) for index, section in enumerate(SECTIONS_M))
    table = Table("Largest weighted r.m.s. acceleration", (
        Column("section [m]", ".0f"), Column("printed, nearly [m/s2]", ".1f"), Column("ours [m/s2]", ".2f"),
        Column(f"least of {roads} roads", ".2f"), Column("largest", ".2f"), Column("in words")), rows)
    verdict = (f"Of the same size: up to {found[0][0].max():.2f} m/s2 in 1 m windows beside a printed value of nearly "
               "1.5. The source does not give its road, the initial state of its filter or how it weights 1 m, which "
               "this car passes in 1/13 s. In 10 m windows the weighted acceleration is already half of that.")
    lines = tuple(Line(f"{section:g} m sections", np.arange(section / 2, _LENGTH_M_F4_34, section), one)
                  for section, one in zip(SECTIONS_M, found[0], strict=True))
    picture = Picture(Curves("Weighted r.m.s. acceleration along the road; the step lies at 50 m", "distance [m]",
                             "a_w [m/s2]", lines), "a_w of each metre, up to nearly 1.5 m/s2 (Fig 4.34), and of each "
                      "10 m, in which the step is still clear (Fig 4.35)")
    each, tens = (float(one.max()) for one in found[0])
    quiet = float(np.delete(found[0][1], int(found[0][1].argmax())).max())
    return Result((table,), verdict, (picture,), (
        *about("Fig 4.34", [Value("largest a_w of a metre, nearly [m/s2]", PRINTED_PEAK_MPS2, each, OF_ONE_SIZE,
                                  Word.NOT_REPRODUCIBLE)]),
        *about("Fig 4.34", [Statement("largest a_w of a metre [m/s2]", "uncomfortable to very uncomfortable", each,
                                      uncomfortable[0], uncomfortable[1], Word.NOT_REPRODUCIBLE)]),
        *about("Fig 4.35", [
            Statement("largest a_w of 10 m [m/s2]", "still clear that the bump causes a discomfort", tens,
                      COMFORT_WORDS[-2][0], word=Word.NOT_REPRODUCIBLE),
            Statement("that over the largest a_w of the other sections", "still clear", tens / quiet, 2.0,
                      word=Word.NOT_REPRODUCIBLE)])))


def _sections(seed: int) -> list[Array]:
    """a_w [m/s2] of each section of the way, for both lengths of a section."""
    record = record_of(bridge(50.0, -STEP_M), BRIDGE_MPS, 8.0, Conditions(0.0, 0.0, 2.0, seed))
    return [per_section(record, section_m, _LENGTH_M_F4_34) for section_m in SECTIONS_M]


def per_section(record: Run, section_m: float, length_m: float) -> Array:
    """a_w [m/s2] by Wk of each section of the way's first ``length_m``, the record weighted as a whole."""
    weighted = WEIGHTING.weigh(record.measured_mps2, RATE_HZ)
    edges = np.searchsorted(record.distance_m, np.arange(0, length_m + section_m / 2, section_m))
    return np.array([a_w(weighted[start:end]) for start, end in pairwise(edges.tolist())])


F4_34 = Study("fig_4_34", "Discomfort of a bridge's step, per metre and per 10 m", "Fig 4.34 (and 4.35), section 4.4.6",
              "Simulated as in the source: a step of 38.1 mm down at 48.3 km/h on a road of IRI 2 m/km; weighting Wk.",
              _f4_34,
              items=(Item("Fig 4.34", Word.NOT_REPRODUCIBLE,
                          "The road and the filter of the figure are not printed; in the simulation the discomfort "
                          "per metre has the printed size."),
                     Item("Fig 4.35", Word.NOT_REPRODUCIBLE,
                          "The road and the filter of the figure are not printed; in the simulation the step is still "
                          "clear over 10 m.")))


def _f4_36(effort: Workload) -> Result:
    heights_m = (0.0127, 0.0254, 0.0381, 0.0508, 0.0635)
    speeds_kmh = (16.1, 32.2, 48.3, 64.4, 80.5, 96.6)
    comfort_limits = (COMFORT_WORDS[-2], COMFORT_WORDS[-4])
    speeds = np.array(effort.some(speeds_kmh, 3))
    # The car is linear: one height is enough for all.
    per_metre = np.array([_peak(STEP_M, kmh / 3.6) for kmh in effort.each(speeds.tolist())]) / STEP_M
    peaks = np.outer(heights_m, per_metre)
    table = Table("Largest a_w of a metre (printed as a picture only)", (
        Column("step [mm]", ".1f"), *(Column(f"{kmh:.0f} km/h [m/s2]", ".2f") for kmh in speeds),
        Column(f"in words at {speeds[-1]:.0f} km/h")), tuple(
        (1000 * height, *row, comfort_word(row[-1]).replace("_", " "))
        for height, row in zip(heights_m, peaks.tolist(), strict=True)))
    own = _peak(STEP_M, BRIDGE_MPS)
    values: tuple[Check, ...] = (Value("38.1 mm at 48.3 km/h, nearly, from Fig 4.34 [m/s2]", PRINTED_PEAK_MPS2, own,
                                       OF_ONE_SIZE,
                    Word.NOT_REPRODUCIBLE),
              Statement("smallest of the figure [m/s2]", "points below the green line, comfortable", float(peaks.min()),
                        0.0,
                        comfort_limits[0][0], Word.NOT_REPRODUCIBLE),
              Statement("largest of the figure [m/s2]", "points above the red line, a noticeable discomfort",
                        float(peaks.max()), comfort_limits[1][0], word=Word.NOT_REPRODUCIBLE))
    verdict = ("a_w is proportional to the height, as the car is linear. With speed it rises steeply up to 32 km/h "
               "and slowly beyond, where the car passes a metre in less time than the impact lasts. The place where a "
               "metre begins changes its a_w by 10 % either way. The text does not say which limits of comfort it "
               "draws; those of Table 2.5 are used here: a little uncomfortable from 0.315 m/s2, uncomfortable from "
               "0.8.")
    lines = tuple(Line(f"{1000 * height:.1f} mm", speeds, row) for height, row in zip(heights_m, peaks, strict=True))
    limits = tuple(Line(word.replace("_", " "), speeds, np.full(len(speeds), limit)) for limit, word in comfort_limits)
    picture = Picture(Curves("Largest a_w of a metre over a step", "speed [km/h]", "a_w [m/s2]", (*lines, *limits)),
                      "dots for heights and speeds, and two lines across: comfortable below the green one, a "
                      "noticeable discomfort above the red one")
    return Result((table,), verdict, (picture,), values)


def _peak(height_m: float, speed_mps: float) -> float:
    length_m = 60.0
    seconds = (length_m + 2) / speed_mps
    record = record_of(bridge(20.0, -height_m), speed_mps, seconds, Conditions(noise_mps2=0.0))
    return float(per_section(record, 1.0, length_m).max())


F4_36 = Study("fig_4_36", "Discomfort of a bridge's step by height and speed", "Fig 4.36, section 4.4.6",
              "Simulated as in the source: a step down on a road without roughness; a_w by Wk, per metre.", _f4_36,
              items=(Item("Fig 4.36", Word.NOT_REPRODUCIBLE,
                          "The heights, speeds and limits of the figure are not printed; the one printed value, from "
                          "Fig 4.34, has the size of ours."),))

STUDIES = (F4_30, F4_31, F4_32, F4_34, F4_36)
