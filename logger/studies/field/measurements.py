"""What fits and examinations print: modes, a mass, shares of effects named right.

Five modes under white noise with a tenth of noise: the example that pyOMA2 prints, and what ridelog finds.

The sprung mass out of one bump: a published way, what packages for identification make of it, and ridelog.

Zhao, Nagayama and Xue (2019) find the numbers of a half car from a phone's record over a hump of known size. Their
record is not published, so ours stands beside what packages made of a simulated one, which no paper prints either.

The lab's examination: what it said of cars with a hidden effect, and how sure those shares are.

The counts are those of the last examination that was published. ``python -m tests.validation.examine`` writes them to
``examination.json`` beside this file, when it writes docs/examination.md.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri

from logger.chart_data import Curves, Line
from logger.modal.analysis import find_modes
from logger.modal.five_storey import Masses, chain, random_response, with_damping_ratios
from logger.studies import drives
from logger.studies.study import Check, Item, Picture, Result, Statement, Table, Value, Word, Workload, study

PRINTED_TRUE_HZ = (0.890, 2.598, 4.095, 5.261, 6.000)
_RATE_HZ = 20.0
_HALF_DIGIT = 0.0005


@study("Five modes at 20 dB", "Example 1: getting started",
       "The example's building: five floors of 25.91 kg, storeys of 10,000 N/m, 2 % of damping, a white force on each "
       "floor, 10 % noise (20 dB); 300 s at 20 Hz, the rate to which the example decimates.",
       Item("five modes at 20 dB", Word.BETTER, "ridelog finds all five automatically, each with a standard error."),
       source="D. P. Pasca et al., pyOMA2, Examples/Example1.ipynb, January 2025")
def five_modes(effort: Workload) -> Result:
    floor_kg, storey_n_per_m, printed_true_damping = 25.91, 10_000.0, 0.02
    # What its SSI-dat gives at order 16, the true frequencies being named by hand.
    printed_hz = (0.889, 2.601, 4.096, 5.275, 6.031)
    printed_damping = (0.028, 0.018, 0.018, 0.024, 0.022)
    building = with_damping_ratios(*chain(np.full(5, floor_kg), np.full(5, storey_n_per_m)),
                                   np.full(5, printed_true_damping))
    true_hz = np.sort(np.abs(building.poles()[0])) / (2 * np.pi)
    missed, extra, records, count = 0, 0, [], effort.count(5, 2)
    for seed in effort.each(range(count)):
        found = find_modes(_record(building, seed), _RATE_HZ).modes
        near = [[mode for mode in found if abs(mode.frequency_hz / hz - 1) < 0.05] for hz in true_hz]
        missed += sum(not one for one in near)
        extra += len(found) - sum(map(bool, near))
        if all(near):
            records.append([(one[0].frequency_hz, one[0].damping_ratio, one[0].frequency_std_hz, one[0].damping_std)
                            for one in near])
    numbers = np.array(records or [[(np.nan,) * 4] * 5])
    hz, damping, hz_std, damping_std = numbers[0].T
    values: list[Check] = [Value(f"mode {mode} of the building [Hz]", printed, float(ours), _HALF_DIGIT)
                           for mode, (printed, ours) in enumerate(zip(PRINTED_TRUE_HZ, true_hz, strict=True), start=1)]
    values += _beside("frequency of mode {} found [Hz]", printed_hz, PRINTED_TRUE_HZ, hz, hz_std)
    values += _beside("damping ratio of mode {} found", printed_damping, (printed_true_damping,) * 5, damping,
                      damping_std)
    values += [Statement(f"modes missed in {count} records", "found where they are named by hand", float(missed), 0, 0,
                         Word.BETTER), Statement("false modes", "found where they are named by hand",
                                                 float(extra), 0, 0, Word.BETTER)]
    worst = 100 * float(max(abs(one / printed_true_damping - 1) for one in printed_damping))
    ours = 100 * float(np.median(np.abs(numbers[:, :, 1] / printed_true_damping - 1).max(axis=1)))
    verdict = (f"In {count} records {missed} of {5 * count} modes are missed and {extra} false ones found, "
               f"automatically; the example is given the frequencies. The worst damping ratio is {ours:.0f} % off "
               f"(median), {worst:.0f} % in the print, and here each has a standard error: 300 s of random shaking "
               "determine a damping ratio no better. Versions of the example differ in the record's length; that of "
               "the current one is used, 300 s.")
    table = Table("The first record", (
        "mode .0f", "true [Hz] .3f", "published [Hz] .3f", "ridelog [Hz] .3f", "its standard error [Hz] .3f",
        "published damping .3f", "ridelog .4f", "its standard error .4f"), tuple(
        (float(mode), *map(float, row)) for mode, row in enumerate(zip(
            PRINTED_TRUE_HZ, printed_hz, hz, hz_std, printed_damping, damping, damping_std, strict=True), start=1)))
    picture = Picture(Curves("Damping ratio of each mode, in each record", "frequency [Hz]", "damping ratio", (
        Line("ridelog", np.tile(true_hz, len(numbers)), numbers[:, :, 1].ravel(), dots=True),
        Line("published", np.array(printed_hz), np.array(printed_damping), dots=True)),
        level=(printed_true_damping, "true")), "one record's damping ratios, as numbers")
    return Result((table,), verdict, (picture,), tuple(values))


def _record(building: Masses, seed: int) -> drives.Array:
    """Accelerations (samples, 5) under a white force on each floor, with a tenth of noise."""
    length_s, noise_share = 300.0, 0.1
    rng = np.random.default_rng(seed)
    clean = random_response(building, rng.standard_normal((4 * round(length_s * _RATE_HZ), 5)), _RATE_HZ)
    return np.asarray(clean + noise_share * clean.std(axis=0) * rng.standard_normal(clean.shape))


def _beside(name: str, printed: tuple[float, ...], true: tuple[float, ...], ours: drives.Array,
            std: drives.Array) -> list[Value]:
    """Two estimates of one truth differ by what both are off: theirs by what the print shows, ours by chance."""
    return [Value(name.format(mode), theirs, float(mine), abs(theirs - truth) + 3.0 * float(error) + _HALF_DIGIT)
            for mode, (theirs, truth, mine, error) in enumerate(zip(printed, true, ours, std, strict=True), start=1)]


@study("The mass from one bump", "Errors of the mass",
       "The half car of Table 4.2 of the dissertation over its bump of 0.15 m by 2.6 m at 16.1 km/h: 6 s at 100 Hz "
       "with white noise of 0.05 m/s2; only the mass is fitted, from 800 kg.",
       Item("hidden mass from a bump", Word.NOT_REPRODUCIBLE,
            "The paper's record was not published; on simulated ones, error and standard error are those that the "
            "noise allows."),
       source="B. Zhao, T. Nagayama, K. Xue, Journal of Sound and Vibration 457, 2019; packages run by ridelog's "
              "developers")
def mass_from_a_bump(effort: Workload) -> Result:
    # Package, error of the mass [%], the standard error that it gives [%], in runs of our own on one simulated
    # record; the last ones give poles and no mass.
    peers = (("SciPy least_squares, own simulator", -0.07, 0.07), ("lmfit 1.3.4, the same simulator", -0.07, 0.07),
             ("jax-sysid 1.1, own state equation", -0.07, None),
             ("SIPPY, nfoursid, Octave, python-control", None, None))
    scatter = 0.07  # Standard error of the mass by the record alone [%]: what any unbiased fit scatters by at least.
    at_m, lasts_s, start_kg = 8.0, 6.0, 800.0
    fits = [drives.fitted(drives.record_of(drives.bump(at_m), drives.BUMP_MPS, lasts_s, drives.Conditions(seed=seed)),
                          {drives.MASS: start_kg}, ours=True)
            for seed in effort.each(range(effort.count(40, 5)))]
    errors = np.array([drives.error_percent(one, drives.MASS) for one in fits])
    given = np.array([drives.standard_error_percent(one, drives.MASS) for one in fits])
    rms = float(np.sqrt(np.mean(errors**2)))
    # A scatter of n draws is itself off by its share 1 / sqrt(2 n).
    near = 3.0 * scatter / np.sqrt(2 * len(errors))
    values = (Statement("error of the mass, r.m.s. [%]", "0.07 % off by SciPy and lmfit", rms, 0.0,
                        scatter + float(near), Word.NOT_REPRODUCIBLE),
              Statement("stated standard error over that of the record", "the same",
                        float(given.mean()) / scatter,
                        1 - float(near) / scatter, 1 + float(near) / scatter, Word.NOT_REPRODUCIBLE))
    inside = float(np.mean(np.abs(errors) < 2 * given))
    table = Table("The mass from one bump (nothing of it is published)", (
        "package, run by us", "error [%] +.2f", "its standard error [%] .2f"),
        (*peers, (f"ridelog, r.m.s. of {len(errors)} records", rms, float(given.mean()))))
    verdict = (f"The mass is {rms:.2f} % off (r.m.s. over {len(errors)} records), as close as the record's noise "
               f"allows, and the standard error says so: the truth lies within two standard errors in {inside:.0%}. "
               "Packages that are given the car's equations do equally well; the others find frequencies but no mass. "
               "The paper finds all parameters of a car by a genetic algorithm.")
    picture = Picture(Curves("Error of the mass, record by record", "record", "error [%]", (
        Line("ridelog", np.arange(1.0, len(errors) + 1), errors, given, dots=True),)))
    return Result((table,), verdict, (picture,), values)


COUNTS = Path(__file__).with_name("examination.json")


def examined() -> dict[str, Any]:
    """``{"first_seed", "last_seed", "cases", "asked", "release", "goals": [{"name", "goal", "at_least", "count",
    "of"}]}``; a goal is a share."""
    found: dict[str, Any] = json.loads(COUNTS.read_text("utf-8"))
    return found


def interval_percent(hits: int, cases: int) -> tuple[float, float]:
    """Wilson's interval of a share (Journal of the American Statistical Association 22, 1927) [%]."""
    z = float(ndtri(0.5 + 0.95 / 2))
    share = hits / cases
    middle, half = share + z**2 / (2 * cases), z * np.sqrt(share * (1 - share) / cases + z**2 / (4 * cases**2))
    low, high = ((middle + sign * half) / (1 + z**2 / cases) for sign in (-1, 1))
    return float(100 * max(0.0, low)), float(100 * min(1.0, high))


@study("The lab's examination", "The table of goals",
       "Counts of cases from the last published examination; the intervals are computed from them.",
       Item("the lab's examination", Word.NOT_REPRODUCIBLE,
            "It takes hours and was not repeated here; its counts are shown with their intervals."),
       source="ridelog's own examination, docs/examination.md")
def lab_examination(effort: Workload) -> Result:
    counts = examined()
    rows, met, surely = [], 0, 0
    for goal in effort.each([one for one in counts["goals"] if one["of"]]):
        hits, cases, wanted, at_least = goal["count"], goal["of"], 100 * goal["goal"], goal["at_least"]
        low, high = interval_percent(hits, cases)
        share = 100 * hits / cases
        met += share >= wanted if at_least else share <= wanted
        surely += low >= wanted if at_least else high <= wanted
        rows.append((goal["name"], f"{'>=' if at_least else '<='} {wanted:.0f} %", f"{hits} of {cases}", share, low,
                     high))
    seeds = f"{'release' if counts['release'] else 'development'} seeds {counts['first_seed']} to {counts['last_seed']}"
    table = Table(f"Counts of the examination (published in docs/examination.md), {seeds}", (
        "asked", "goal", "true of", "share [%] .1f", "at least [%] .1f", "at most [%] .1f"), tuple(rows))
    verdict = (f"{counts['cases']} of {counts['asked']} cases were given to the lab, {seeds}, made by a simulator that "
               f"shares no code with it. By the measured shares, {met} of {len(rows)} goals are met; by the far end of "
               f"the 95 % interval, {surely} are. This examination is ridelog's own: nobody else has published one. As "
               "it takes hours, it was not repeated here, and nothing is compared with a print.")
    at = np.arange(1.0, len(rows) + 1)
    shares, lows, highs = (np.array([row[place] for row in rows], dtype=np.float64) for place in (3, 4, 5))
    picture = Picture(Curves("Shares with their 95 % intervals", "row of the table", "cases [%]", (
        Line("share", at, shares, dots=True), Line("at least", at, lows, dots=True), Line("at most", at, highs,
                                                                                          dots=True))))
    return Result((table,), verdict, (picture,))

STUDIES = (five_modes, mass_from_a_bump, lab_examination)
