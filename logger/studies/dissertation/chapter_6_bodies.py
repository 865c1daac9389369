"""Chapter 6: mass from bumps and bridges, and places revisited. Names of one item end in its number.

Tables 6.1 and 6.2: mass from four speed bumps in two trials, and why it scatters (6.2.1).

Tables 6.3 and 6.4: mass from the steps at a bridge's ends, and what they can tell (6.2.2).

Table 6.5: three places that were revisited, and how large what lies there must be to feel as it is said (6.5.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from logger.chart_data import Curves, Line
from logger.comfort.iso2631 import COMFORT_WORDS, comfort_word
from logger.estimation.rms_calibration import CalibrationSettings, calibrate
from logger.identification.identifiability import NotIdentifiable
from logger.identification.prediction_error_fit import Fit
from logger.identification.unknown_inputs import Bump, RoadInput, RoadStep
from logger.roads.obstacles import pothole, step
from logger.runs import Run
from logger.studies.dissertation.chapter_6_roads import LOW_PASS_HZ, PRINTED_MPH
from logger.studies.drives import (
    BRIDGE_MPS,
    BUMP_HEIGHT_M,
    BUMP_MPS,
    BUMP_WIDTH_M,
    MASS,
    PS_2119,
    STEP_M,
    TRUTH,
    Array,
    Conditions,
    Shape,
    bridge,
    bump,
    error_percent,
    fitted,
    mass_and_bump,
    per_window,
    rav4,
    record_of,
    standard_error_percent,
    without_profile,
)
from logger.studies.study import (
    Cell,
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
    alike,
)
from logger.units import MPH_MPS
from logger.vehicle.linearise import known_vehicle

PRINTED_KG = ((870.658, 844.053), (927.464, 911.141), (519.555, 660.512), (672.677, 817.204))
PRINTED_PERCENT = ((0.50, 3.54), (6.00, 4.13), (40.62, 24.51), (23.12, 6.61))
CASES_T6_1 = (("all as assumed",
          1.0, 1.0, 1.0, 0.0), ("height 5 % more", 1.05, 1.0, 1.0, 0.0), ("height 5 % less", 0.95, 1.0, 1.0, 0.0),
         ("width 5 % more", 1.0, 1.05, 1.0, 0.0), ("width 5 % less", 1.0, 0.95, 1.0, 0.0),
         ("speed 5 % more", 1.0, 1.0, 1.05, 0.0), ("speed 5 % less", 1.0, 1.0, 0.95, 0.0),
         ("road of IRI 5 m/km", 1.0, 1.0, 1.0, 5.0), ("all at once", 0.95, 1.05, 0.95, 5.0))
"""What was true, against what was taken: factors of height, width and speed, and the road's IRI."""
_OFF = 0.05


def _t6_1(effort: Workload) -> Result:
    # Share by which a speedometer may be off at 16.1 km/h: a tenth and 4 km/h (UNECE Regulation 39, 5.4).
    speedometer = (0.1 * 16.1 + 4) / 16.1
    road_iri = 3.0
    drives = effort.count(40)
    factors = np.random.default_rng(1).normal(1.0, _OFF, (drives, 3)).tolist()
    jobs = [*(case[1:] for case in CASES_T6_1), *((height, width, speed, road_iri) for height, width, speed in factors)]
    found = [_both_ways(*job, seed=seed) for seed, job in enumerate(effort.each(jobs))]
    cases, draws = found[:len(CASES_T6_1)], np.array(found[len(CASES_T6_1):])
    printed = Table("Printed", (Column("bump", ".0f"), *(Column(f"trial {trial}, {what}", form) for trial in (1, 2)
                                for what, form in (("mass [kg]", ".3f"), ("error [%]", ".2f")))), tuple(
        (float(number), masses[0], errors[0], masses[1], errors[1])
        for number, (masses, errors) in enumerate(zip(PRINTED_KG, PRINTED_PERCENT, strict=True), start=1)))
    one_by_one = Table("Simulated: assumed bump 150 mm by 2.60 m at 16.1 km/h; the true one differs by row", (
        Column("truth relative to the assumption"), Column("the source's way: error of the mass [%]", "+.2f"),
        Column("ours, bump and speed estimated [%]", "+.2f"), Column("its standard error [%]", ".2f")), tuple(
        (case[0], *errors) for case, errors in zip(CASES_T6_1, cases, strict=True)))
    theirs, ours, expected = draws.T
    rows: tuple[tuple[Cell, ...], ...] = (
        ("printed, 8 drives", _rms_t6_1(np.array(PRINTED_PERCENT)), float(np.max(PRINTED_PERCENT)), None),
        (f"the source's way, {drives} simulated drives", _rms_t6_1(theirs), float(np.abs(theirs).max()), None),
        ("ours, the same drives",
         _rms_t6_1(ours), float(np.abs(ours).max()),
         float(100 * (np.abs(ours) < 2 * expected).mean())))
    many = Table(f"Random errors of 5 % r.m.s. in height, width and speed, on roads of IRI {road_iri:g} m/km", (
        Column("way"), Column("r.m.s. error [%]", ".1f"), Column("largest [%]", ".1f"),
        Column("truth within two standard errors [%]", ".0f")), rows)
    by_trial = {f"Table 6.{trial}": _rms_t6_1(np.array(PRINTED_PERCENT)[:, trial - 1]) for trial in (1, 2)}
    per_percent = _per_percent_of_speed(cases)
    verdict = ("With a width or a speed 5 % off, the source's mass is about 5 or 11 % off; the height matters little. "
               f"With all three off by 5 % r.m.s., its errors are {_rms_t6_1(theirs):.0f} % r.m.s. Of the printed "
               f"trials the second ({by_trial['Table 6.2']:.0f} %) is explained by that; the first "
               f"({by_trial['Table 6.1']:.0f} %) would take twice as much, or a speed that is "
               f"{by_trial['Table 6.1'] / per_percent:.0f} % off, while a speedometer may be {100 * speedometer:.0f} % "
               "off at 16 km/h (UNECE R39). Bumps 3 and 4 are too light in both trials, so they differ from the first "
               f"two. With bump and speed estimated together with the mass, the errors are {_rms_t6_1(ours):.1f} %, "
               "which come from the road's roughness, and the standard error says so.")
    values: tuple[Check, ...] = (*(one for item, rms in by_trial.items() for one in about(item, [
        Statement("error of the speed that would explain the printed r.m.s. error [%]",
                  "changes in speed are a possible "
                  "source of error", rms / per_percent, 0.0, 100 * speedometer, Word.NOT_REPRODUCIBLE)])),
        *about(tuple(by_trial), [
            Statement("error with width or speed 5 % off, ours over the source's way",
                      "discrepancies of width and speed are "
                      "possible sources of error", _largest(cases, 1) / _largest(cases, 0), 0.0, 0.2,
                      Word.NOT_REPRODUCIBLE)]),
        *(one for trial, item in enumerate(by_trial) for one in about(item, [
            Value(f"error of the printed mass, bump {bump} [%]", pair[trial],
                  100 * abs(PRINTED_KG[bump - 1][trial] / TRUTH[MASS] - 1), 0.01, of_print=True)
            for bump, pair in enumerate(PRINTED_PERCENT, start=1)])))
    errors = {"printed": np.ravel(PRINTED_PERCENT), "the source's way": theirs, "ours": ours}
    scatter = Picture(Curves("Errors of the mass, sorted by size", "share of the drives [%]", "error of the mass [%]",
                             tuple(Line(name, 100 * (np.arange(len(found)) + 0.5) / len(found), np.sort(np.abs(found)))
                                   for name, found in errors.items())),
                      "Fig 6.1: the estimated bump and the recorded response to it")
    return Result((printed, one_by_one, many), verdict, (scatter,), values)


def _per_percent_of_speed(cases: Sequence[tuple[float, float, float]]) -> float:
    """By how much the mass of their way goes wrong for a per cent of speed [%]; ``cases`` as in CASES."""
    more, less = (cases[place][0] for place, case in enumerate(CASES_T6_1) if case[0].startswith("speed"))
    return abs(less - more) / (2 * 100 * _OFF)


def _largest(cases: Sequence[tuple[float, float, float]], way: int) -> float:
    """Error of their way (0) or ours (1) with a width or a speed that is off [%]."""
    return max(abs(found[way]) for case, found in zip(CASES_T6_1, cases, strict=True)
               if case[0][:5] in ("width", "speed"))


def _both_ways(height: float, width: float, speed: float, iri: float, seed: int) -> tuple[float, float, float]:
    """Error of the mass their way and ours, and ours' standard error [%], for true factors of what is taken."""
    bump_at_m = 8.0
    conditions = PS_2119.on(iri, seed)
    true = bump(bump_at_m, height * BUMP_HEIGHT_M, width * BUMP_WIDTH_M)
    record = without_profile(record_of(true, speed * BUMP_MPS, 8.0, conditions), 1 / speed)
    taken = Bump(bump_at_m / speed, BUMP_HEIGHT_M, BUMP_WIDTH_M)
    theirs = fitted(record, {MASS: TRUTH[MASS]}, False, RoadInput(bump=taken), 20.0)
    ours = mass_and_bump(record, taken)
    return error_percent(theirs, MASS), error_percent(ours, MASS), standard_error_percent(ours, MASS)


def _rms_t6_1(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


T6_1 = Study("table_6_1", "Mass from speed bumps whose size and speed differ a little from the assumed ones",
             "Table 6.1 (and 6.2), section 6.2.1",
             "The source measured, and its records were never published. Simulated: the car of Table 4.2, a PS-2119 "
             "with steps of 0.01 g, 20 Hz low-pass and a start at 875 kg for the source's way, as in 6.2.1.", _t6_1,
             items=alike(("Table 6.1", "Table 6.2"), Word.NOT_REPRODUCIBLE, "The records were never published; errors "
                         "of that kind follow from a bump and a speed that are a few per cent off."))


PRINTED_T6_3 = (("1-1", 700.528, 19.94, 1398.92, 59.88), ("1-2", 596.911, 31.78, 983.834, 12.44),
           ("2-1", 576.042, 34.17, 460.687, 47.35), ("2-2", 416.843, 52.36, 496.564, 43.25))
REFUSED = "cannot tell"


def _t6_3(effort: Workload) -> Result:
    # True step [m] and the road's IRI [m/km].
    all_cases = tuple((step_m, iri) for step_m in (STEP_M, 0.0127) for iri in (0.0, 2.0, 5.0))
    chance = 0.58  # twice the standard error of an r.m.s. of six, as a share of it
    cases, roads = effort.some(all_cases), effort.count(6)
    jobs = [(step_m, iri, seed) for step_m, iri in cases for seed in range(roads)]
    drives = [_drive(*job) for job in effort.each(jobs)]
    rows = tuple(_row_t6_3(*case, drives[number * roads:(number + 1) * roads]) for number, case in enumerate(cases))
    printed = Table("Printed: the road assumed flat", (
        Column("bump"), Column("trial 1, mass [kg]", ".3f"), Column("error [%]", ".2f"),
        Column("trial 2, mass [kg]", ".3f"), Column("error [%]", ".2f")), PRINTED_T6_3)
    table = Table(f"Simulated, 48.3 km/h; figures are r.m.s. over {roads} roads", (
        Column("true step [mm]", ".1f"), Column("IRI [m/km]", ".0f"), Column("road assumed flat: our answer"),
        Column("step assumed a third too high, the source's way: error of mass [%]", ".1f"),
        Column("ours, height estimated: error of mass [%]", ".1f"), Column("its standard error [%]", ".1f"),
        Column("mass known: error of height [mm]", ".1f"), Column("its standard error [mm]", ".1f")), rows)
    verdict = ("The source assumed a flat road. A flat input moves no car, whatever its mass: ours refuses to answer, "
               "and the printed masses, 12 to 60 % off, reflect the noise model and the road, not the car. A step "
               "assumed a third too high makes the mass about 15 % wrong on a smooth road (Fig 4.31). With the height "
               "estimated together with the mass, a step of 38.1 mm gives both; the error grows with the road's "
               "roughness, and the standard error says how much. A step of half an inch on a rough road hardly shows "
               "the mass, and its standard error says so. With a known mass, the height is the better quantity to "
               "estimate.")
    items = ("Table 6.3", "Table 6.4")
    refused = sum(one.flat == REFUSED for one in drives) / len(drives)
    (rough_m, _), rough = cases[-1], drives[-roads:]
    theirs = _rms_t6_3([(one.theirs,) for one in rough])[0]
    least, most = (end([percent for _, _, one, _, other in PRINTED_T6_3 for percent in (one, other)])
                   for end in (min, max))
    values: tuple[Check, ...] = (*about(items, [
        Statement("drives in which a flat input shows nothing of the mass [%]", "an input assumed flat gives "
                  "inconsistent masses", 100 * refused, 100.0, word=Word.NOT_REPRODUCIBLE),
        Statement(f"the source's way, a step of {1000 * rough_m:.1f} mm on IRI 5 assumed a third too high: r.m.s. "
                  "error [%]",
                  f"a weak signal; errors of {least:.0f} to {most:.0f} %", theirs, least, most + chance * theirs,
                  Word.NOT_REPRODUCIBLE),
        Statement("largest error of the height for a known mass, over its standard error", "it can be used to "
                  "determine the step's height", max(abs(error / std) for error, std in (one.height for one in drives)),
                  0.0, 4.0, Word.NOT_REPRODUCIBLE)]),
        *(one for trial, item in enumerate(items) for one in about(item, [
            Value(f"error of the printed mass, bump {bump} [%]", found[2 * trial + 1],
                  100 * abs(found[2 * trial] / TRUTH[MASS] - 1), 0.01, of_print=True)
             for bump, *found in PRINTED_T6_3])))
    grown = Picture(Curves("Error of the height found with a known mass, by the road's IRI", "IRI of the road [m/km]",
                           "error of the height [mm]", tuple(_by_iri(step_m, rows) for step_m in dict(cases))),
                    "Fig 6.2: the response to the bridge, which hardly stands out from that to the road")
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
    taken_factor = 4 / 3  # the ends of Fig 4.31 are a third off
    step_at_m = 20.0
    record = without_profile(record_of(bridge(step_at_m, step_m), BRIDGE_MPS, 6.0, PS_2119.on(iri, seed)))
    taken = RoadInput(step=RoadStep(step_at_m, step_m * taken_factor))
    place = {"step.height_m": step_m * taken_factor, "step.start_m": step_at_m}
    theirs = fitted(record, {MASS: TRUTH[MASS]}, False, taken)
    known = fitted(record, place, True, taken)
    both = _identified(record, {MASS: TRUTH[MASS], **place}, taken)
    return _Found(REFUSED if _identified(record, {MASS: TRUTH[MASS]}, RoadInput()) is None else "answers",
                  error_percent(theirs, MASS),
                  None if both is None else (error_percent(both, MASS), standard_error_percent(both, MASS)),
                  (1000 * (known.parameters["step.height_m"] - step_m), 1000 * known.standard_errors["step.height_m"]))


def _identified(record: Run, start: dict[str, float], road: RoadInput) -> Fit | None:
    try:
        return fitted(record, start, True, road)
    except NotIdentifiable:
        return None


def _row_t6_3(step_m: float, iri: float, drives: Sequence[_Found]) -> tuple[Cell, ...]:
    known = [one.mass for one in drives if one.mass is not None]
    mass: tuple[Cell, ...] = (*_rms_t6_3(known),) if len(known) == len(drives) else (f"known in {len(known)}", None)
    return (1000 * step_m, iri, drives[0].flat, *_rms_t6_3([(one.theirs,) for one in drives]), *mass,
            *_rms_t6_3([one.height for one in drives]))


def _rms_t6_3(values: Sequence[tuple[float, ...]]) -> list[float]:
    return [float(value) for value in np.sqrt((np.array(values) ** 2).mean(axis=0))]


T6_3 = Study("table_6_3", "Mass from a bridge's steps", "Table 6.3 (and 6.4), section 6.2.2", "The source measured, "
             "and its records were never published. Simulated: the car of Table 4.2, a PS-2119 with steps of 0.01 g, "
             "steps of 38.1 and 12.7 mm on roads of IRI 0, 2 and 5 m/km; the place of a step is also "
             "estimated.", _t6_3,
             items=alike(("Table 6.3", "Table 6.4"), Word.NOT_REPRODUCIBLE, "The records were never published; a flat "
                         "input shows nothing of the mass, and ours refuses it."))


_UNIT_M = 0.01
_LIMIT = {word: limit for limit, word in COMFORT_WORDS}


def _t6_5(effort: Workload) -> Result:
    printed_rows = ((1, 5, "a_little_uncomfortable", "intersection of new and old pavement"),
                    (2, 6, "fairly_uncomfortable", "manhole"), (3, 23, "uncomfortable", "damaged pavement"))
    # Sizes that the source names: steps from where a bridge needs maintenance to where many have one (4.4.5) [mm],
    # depressions of Table 2.4 [mm], damaged pavements to the roughest of Table 2.3 [m/km]; and the end of our range,
    # with its column, that lies nearest to not being found.
    to_be_found = ((12.7, 50.8, "at most", 8), (5.0, 80.0, "at most", 8), (4.0, 20.0, "at least", 7))
    starts_m = tuple(np.arange(50.0, 57.6, 1.0).tolist())
    starts = effort.some(starts_m)
    per_mm = [np.mean([_a_w_per_unit(shape(start), PRINTED_MPH[segment]) for start in starts]) / (1000 * _UNIT_M)
              for shape, (_, segment, *_) in zip((_edge, _manhole), effort.each(printed_rows[:2]), strict=True)]
    speed = (PRINTED_MPH[printed_rows[2][1]] * MPH_MPS,)
    (line,) = calibrate(known_vehicle(rav4()), None, CalibrationSettings(speed, roads=effort.count(40, 5)))
    factors = (*map(float, per_mm), line.a_w_per_iri.slope)
    sizes = ("height of a step [mm]", "depth of a dip of 0.6 m [mm]", "IRI over the window [m/km]")
    rows = tuple(_row_t6_5(printed, what, factor)
                 for printed, what, factor in zip(printed_rows, sizes, factors, strict=True))
    table = Table("Size that would explain the printed word", (
        Column("location", ".0f"), Column("segment", ".0f"), Column("printed perception"), Column("printed reason"),
        Column("speed [mph]", ".0f"), Column("quantity"), Column("a_w per unit of it [m/s2]", ".4f"),
        Column("from", ".0f"), Column("to", ".0f"), Column("our word for the middle of the range")), rows)
    verdict = ("Not reproducible: the records were never published, and no sizes are given. Computed backwards, the "
               f"three words require a step of {rows[0][7]:.0f} to {rows[0][8]:.0f} mm between two pavements, a "
               f"manhole {rows[1][7]:.0f} to {rows[1][8]:.0f} mm deep and a stretch of IRI {rows[2][7]:.0f} to "
               f"{rows[2][8]:.0f} m/km. Such edges and manholes exist on any campus; damage of that IRI exceeds the "
               "10.75 m/km at which Table 2.3 ends damaged pavements, so the stretch was short, or the console "
               "resonated. The model is linear, so a_w goes with the size. The ranges of Table 2.5 overlap; the more "
               "severe word is taken.")
    depths = np.linspace(0.0, 60.0, 2)
    limits = tuple(Line(word.replace("_", " "), depths, np.full(2, limit))
                   for limit, word in COMFORT_WORDS if 0 < limit < 2.0)
    values = tuple(Statement(f"location {number}: {what}, {end}", f"{word.replace('_', ' ')}: {reason}",
                             float(str(row[place])), least, most, Word.NOT_REPRODUCIBLE)
                   for (number, _, word, reason), what, row, (least, most, end, place) in zip(
                       printed_rows, sizes, rows, to_be_found, strict=True))
    picture = Picture(Curves("a_w of the worst window by size", "height of the step, depth of the manhole [mm]",
                             "a_w [m/s2]", (Line("step, 25 mph", depths, factors[0] * depths),
                                            Line("manhole, 20 mph", depths, factors[1] * depths), *limits)),
                      "Fig 6.25 to 6.27: photographs of the three places")
    return Result((table,), verdict, (picture,), values)


def _edge(start_m: float) -> Shape:
    return lambda place_m: step(place_m, start_m, _UNIT_M)


def _manhole(start_m: float) -> Shape:
    return lambda place_m: pothole(place_m, start_m, _UNIT_M, length_m=0.60, edge_m=0.05)


def _a_w_per_unit(shape: Shape, mph: int) -> float:
    """Of the worst window over something of 10 mm [m/s2]."""
    quiet = Conditions(noise_mps2=1e-3)
    a_w: Array = per_window(record_of(shape, mph * MPH_MPS, 8.0, quiet), quiet, low_pass_hz=LOW_PASS_HZ).a_w_mps2
    return float(a_w.max())


def _row_t6_5(printed: tuple[int, int, str, str], what: str, factor: float) -> tuple[Cell, ...]:
    next_word = {word: limit for (_, word), (limit, _) in zip(COMFORT_WORDS[1:], COMFORT_WORDS, strict=False)}
    number, segment, word, reason = printed
    low, high = _LIMIT[word] / factor, next_word[word] / factor
    ours = comfort_word(factor * (low + high) / 2)
    return (float(number), float(segment), word.replace("_", " "), reason, float(PRINTED_MPH[segment]), what, factor,
            low, high, ours.replace("_", " "))


T6_5 = Study("table_6_5", "Three revisited places, and the obstacles that would explain them",
             "Table 6.5, section 6.5.3",
              "The source measured. Simulated: the car of Table 4.2 at the speeds of Table D.1 over a step and a dip "
              "on a flat road, 15 Hz low-pass, weighted with Wk; the worst window of 25 ft, averaged over the "
              "position of the obstacle in its window; random roads for the damage.", _t6_5,
              items=(Item("Table 6.5", Word.NOT_REPRODUCIBLE,
                          "Neither the records nor the sizes were published; a step, a manhole and damage of "
                          "realistic sizes would explain the printed words."),))

STUDIES = (T6_1, T6_3, T6_5)
