"""Tables 6.1 and 6.2: mass from four speed bumps in two trials, and why it scatters (6.2.1)."""

from collections.abc import Sequence

import numpy as np

from logger.chart_data import Curves, Line
from logger.identification.obstacle_paths import Bump
from logger.identification.unknown_inputs import RoadInput
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.drives import BUMP_HEIGHT_M, BUMP_MPS, BUMP_WIDTH_M, PS_2119, bump, record_of, without_profile
from logger.studies.fit_methods import MASS, TRUTH, error_percent, fitted, mass_and_bump, standard_error_percent
from logger.studies.study import Cell, Column, Effort, Picture, Result, Study, Table, alike

PRINTED_KG = ((870.658, 844.053), (927.464, 911.141), (519.555, 660.512), (672.677, 817.204))
PRINTED_PERCENT = ((0.50, 3.54), (6.00, 4.13), (40.62, 24.51), (23.12, 6.61))
LOW_PASS_HZ = 20.0
SPEEDOMETER = (0.1 * 16.1 + 4) / 16.1
"""Share by which a speedometer may be off at 16.1 km/h: a tenth and 4 km/h (UNECE Regulation 39, 5.4)."""
CASES = (("all as taken",
          1.0, 1.0, 1.0, 0.0), ("height 5 % more", 1.05, 1.0, 1.0, 0.0), ("height 5 % less", 0.95, 1.0, 1.0, 0.0),
         ("width 5 % more", 1.0, 1.05, 1.0, 0.0), ("width 5 % less", 1.0, 0.95, 1.0, 0.0),
         ("speed 5 % more", 1.0, 1.0, 1.05, 0.0), ("speed 5 % less", 1.0, 1.0, 0.95, 0.0),
         ("road of IRI 5 m/km", 1.0, 1.0, 1.0, 5.0), ("all at once", 0.95, 1.05, 0.95, 5.0))
"""What was true, against what was taken: factors of height, width and speed, and the road's IRI."""
_OFF, _IRI, _DRIVES = 0.05, 3.0, 40
_BUMP_AT_M, _SECONDS = 8.0, 8.0


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    drives = effort.count(_DRIVES)
    factors = np.random.default_rng(1).normal(1.0, _OFF, (drives, 3)).tolist()
    jobs = [*(case[1:] for case in CASES), *((height, width, speed, _IRI) for height, width, speed in factors)]
    found = [_both_ways(*job, seed=seed) for seed, job in enumerate(effort.each(jobs))]
    cases, draws = found[:len(CASES)], np.array(found[len(CASES):])
    printed = Table("Printed", (Column("bump", ".0f"), *(Column(f"trial {trial}, {what}", form) for trial in (1, 2)
                                for what, form in (("mass [kg]", ".3f"), ("error [%]", ".2f")))), tuple(
        (float(number), masses[0], errors[0], masses[1], errors[1])
        for number, (masses, errors) in enumerate(zip(PRINTED_KG, PRINTED_PERCENT, strict=True), start=1)))
    one_by_one = Table("Simulated: bump taken for 150 mm by 2.60 m at 16.1 km/h, what was true beside it", (
        Column("truth against what was taken"), Column("their way: error of the mass [%]", "+.2f"),
        Column("ours, bump and speed estimated [%]", "+.2f"), Column("its standard error [%]", ".2f")), tuple(
        (case[0], *errors) for case, errors in zip(CASES, cases, strict=True)))
    theirs, ours, expected = draws.T
    rows: tuple[tuple[Cell, ...], ...] = (
        ("printed, 8 drives", _rms(np.array(PRINTED_PERCENT)), float(np.max(PRINTED_PERCENT)), None),
        (f"their way, {drives} simulated drives", _rms(theirs), float(np.abs(theirs).max()), None),
        ("ours, the same drives",
         _rms(ours), float(np.abs(ours).max()),
         float(100 * (np.abs(ours) < 2 * expected).mean())))
    many = Table(f"Height, width and speed each off by chance, 5 % r.m.s., on roads of IRI {_IRI:g} m/km", (
        Column("way"), Column("r.m.s. error [%]", ".1f"), Column("largest [%]", ".1f"),
        Column("truth within two standard errors [%]", ".0f")), rows)
    by_trial = {f"Table 6.{trial}": _rms(np.array(PRINTED_PERCENT)[:, trial - 1]) for trial in (1, 2)}
    per_percent = _per_percent_of_speed(cases)
    verdict = ("A width or a speed that is 5 % off moves the source's mass by some 5 and 11 %, a height by little; "
               f"with all three off by 5 % r.m.s. its errors are {_rms(theirs):.0f} % r.m.s. Of the printed trials "
               f"the second ({by_trial['Table 6.2']:.0f} %) needs no more than that; the first "
               f"({by_trial['Table 6.1']:.0f} %) asks for twice as much, or for a speed that is "
               f"{by_trial['Table 6.1'] / per_percent:.0f} % off, while a speedometer may be {100 * SPEEDOMETER:.0f} "
               "% off at 16 km/h (UNECE R39). Bumps 3 and 4 are too light in both trials, so they differ from the "
               f"first two. Estimating bump and speed together with the mass leaves {_rms(ours):.1f} %, which is the "
               "road's roughness, and its standard error says so.")
    values: tuple[Check, ...] = (*(one for item, rms in by_trial.items() for one in about(item, [
        Statement("speed that would have to be off for the printed r.m.s. error [%]", "changes in speed are a possible "
                  "source of error", rms / per_percent, 0.0, 100 * SPEEDOMETER, Word.NOT_REPRODUCIBLE)])),
        *about(tuple(by_trial), [
            Statement("error with width or speed 5 % off, ours over their way", "discrepancies of width and speed are "
                      "possible sources of error", _largest(cases, 1) / _largest(cases, 0), 0.0, 0.2,
                      Word.NOT_REPRODUCIBLE)]),
        *(one for trial, item in enumerate(by_trial) for one in about(item, [
            Value(f"error of the printed mass, bump {bump} [%]", pair[trial],
                  100 * abs(PRINTED_KG[bump - 1][trial] / TRUTH[MASS] - 1), 0.01, of_print=True)
            for bump, pair in enumerate(PRINTED_PERCENT, start=1)])))
    errors = {"printed": np.ravel(PRINTED_PERCENT), "their way": theirs, "ours": ours}
    scatter = Picture(Curves("Errors of the mass, sorted by size", "share of the drives [%]", "error of the mass [%]",
                             tuple(_sorted(name, found) for name, found in errors.items())),
                      "Fig 6.1: the estimated bump and the recorded response to it")
    return Result((printed, one_by_one, many), verdict, (scatter,), values)


def _per_percent_of_speed(cases: Sequence[tuple[float, float, float]]) -> float:
    """By how much the mass of their way goes wrong for a per cent of speed [%]; ``cases`` as in CASES."""
    more, less = (cases[place][0] for place, case in enumerate(CASES) if case[0].startswith("speed"))
    return abs(less - more) / (2 * 100 * _OFF)


def _largest(cases: Sequence[tuple[float, float, float]], way: int) -> float:
    """Error of their way (0) or ours (1) with a width or a speed that is off [%]."""
    return max(abs(found[way]) for case, found in zip(CASES, cases, strict=True) if case[0][:5] in ("width", "speed"))


def _sorted(name: str, errors: np.ndarray) -> Line:
    return Line(name, 100 * (np.arange(len(errors)) + 0.5) / len(errors), np.sort(np.abs(errors)))


def _both_ways(height: float, width: float, speed: float, iri: float, seed: int) -> tuple[float, float, float]:
    """Error of the mass their way and ours, and ours' standard error [%], for true factors of what is taken."""
    conditions = PS_2119.on(iri, seed)
    true = bump(_BUMP_AT_M, height * BUMP_HEIGHT_M, width * BUMP_WIDTH_M)
    record = without_profile(record_of(true, speed * BUMP_MPS, _SECONDS, conditions), 1 / speed)
    taken = Bump(_BUMP_AT_M / speed, BUMP_HEIGHT_M, BUMP_WIDTH_M)
    theirs = fitted(record, {MASS: TRUTH[MASS]}, False, RoadInput(bump=taken), LOW_PASS_HZ)
    ours = mass_and_bump(record, taken)
    return error_percent(theirs, MASS), error_percent(ours, MASS), standard_error_percent(ours, MASS)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt((values**2).mean()))


STUDY = Study("table_6_1", "Mass from speed bumps whose size and speed are not quite what was taken",
              "Table 6.1 (and 6.2), section 6.2.1",
              "The source measured, and its records were never published. Simulated: the car of Table 4.2, a PS-2119 "
              "with steps of 0.01 g, 20 Hz low-pass and a start at 875 kg for their way, as in 6.2.1.", run,
              items=alike(("Table 6.1", "Table 6.2"), Word.NOT_REPRODUCIBLE,
                          "The records were never published; errors of that kind follow from a bump and a speed that "
                          "are some per cent off."))
