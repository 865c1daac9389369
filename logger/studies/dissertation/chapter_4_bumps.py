"""Chapter 4: numbers of the car from a drive over a bump. Names of one item end in its number.

Tables 4.4 to 4.6: errors of the mass and of both stiffnesses, found together, from 25 starts (4.4.4).

The speed and the bump of 4.4 are not given; those of 4.4.2 and 5.5.2 are taken. Nor is the sensor: white noise of 0.05
m/s2. The road around the bump has IRI 5 m/km (4.4.1), which the profile of the fit does not contain.

Fig 4.19 and 4.20: a bump's input and output, in a window of 15 m and of 100 m (4.4.1.1).

Fig 4.21: the mass from windows of 5 to 100 m around a bump (4.4.1.1).

Fig 4.22: where a fit of the mass ends, from 20 starts (4.4.1.2).

Fig 4.25: peak acceleration over bumps of different height and width (4.4.2).

Fig 4.26 and 4.27: error of the mass when a bump is taken for one of another height and width (4.4.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain

import numpy as np

from logger.chart_data import Curves, Field, Line
from logger.identification.prediction_error_fit import Fit
from logger.identification.unknown_inputs import Bump, RoadInput
from logger.runs import Run
from logger.studies.drives import (
    BUMP_HEIGHT_M,
    BUMP_MPS,
    BUMP_WIDTH_M,
    FRONT,
    MASS,
    REAR,
    TRUTH,
    Array,
    Conditions,
    bump,
    error_percent,
    fitted,
    mass_and_bump,
    rav4,
    record_of,
    standard_error_percent,
    until,
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
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.models import structure_of

PRINTED_PERCENT = {
    MASS: ((0.96, 2.04, 1.96, 1.95, 1.91), (1.43, 1.20, 1.12, 1.45, 0.94), (1.05, 0.68, 0.18, 0.54, 0.67),
           (1.11, 1.14, 1.05, 1.07, 0.84), (1.93, 1.92, 2.19, 1.98, 2.40)),
    FRONT: ((0.50, 1.29, 1.04, 0.78, 0.51), (1.29, 1.10, 0.82, 0.84, 0.50), (0.78, 0.83, 0.23, 0.24, 0.24),
            (0.86, 0.89, 0.54, 0.41, 0.65), (0.87, 0.38, 0.85, 0.15, 0.18)),
    REAR: ((1.66, 1.67, 1.44, 1.16, 0.90), (1.93, 1.83, 1.41, 1.15, 1.16), (1.68, 2.56, 1.74, 0.41, 0.38),
           (1.14, 1.15, 0.89, 0.93, 1.09), (0.80, 0.39, 0.69, 0.21, 0.33)),
}
"""A row per start mass, a column per start stiffness."""
NAMES = {MASS: "sprung mass (Table 4.4)", FRONT: "front stiffness (Table 4.5)", REAR: "rear stiffness (Table 4.6)"}
_TYPICAL = {MASS: 800.0, FRONT: 22_000.0, REAR: 22_000.0}


def _t4_4(effort: Workload) -> Result:
    start_masses_kg = (700.0, 800.0, 900.0, 1000.0, 1100.0)
    start_rates_n_per_m = (20_000.0, 21_250.0, 22_500.0, 23_750.0, 25_000.0)
    masses = effort.some(list(enumerate(start_masses_kg)))
    rates = effort.some(list(enumerate(start_rates_n_per_m)))
    record = _drive(0)
    ends = [[fitted(record, {MASS: mass, FRONT: rate, REAR: rate}, ours=True) for _, rate in rates]
            for _, mass in masses]
    drives = [_drive(seed) for seed in range(effort.count(200, 6))]
    draws = [tuple(fitted(one, _TYPICAL, ours) for ours in (False, True)) for one in effort.each(drives)]
    tables: list[Table] = []
    values: list[Check] = []
    for name, words in NAMES.items():
        errors = np.array([[error_percent(end, name) for end in row] for row in ends])
        printed = np.array(PRINTED_PERCENT[name])
        tables.append(_by_start(words, masses, rates, errors, printed))
        item = words.partition("(")[2].rstrip(")")
        values += about(item, [Value(f"{words}, spread between starts [%]", float(np.ptp(printed)),
                                     float(np.ptp(errors)), 1.0, Word.BETTER)])
        values += about(item, [Statement(f"{words}, largest error on this road [%]",
                                         "each within 3 % of the exact value",
                                         float(np.abs(errors).max()), 0.0, 3.0)])
    many = Table(f"The same on {len(drives)} other roads of IRI 5 m/km, one fit each", (
        Column("number"), Column("noise model of the residual"), Column("r.m.s. error [%]", ".2f"),
        Column("stated standard error [%]", ".2f"), Column("truth within two standard errors [%]", ".0f")),
        tuple(chain.from_iterable(_scatter(words, name, draws) for name, words in NAMES.items())))
    verdict = (
        "From every start ours ends at the same estimate. The printed errors for one record differ by up to 2.4 %: "
        "the source's search stopped early. The error that remains in ours comes from the road of IRI 5 m/km, which "
        "the fit does not know, and its standard error says so. The last table repeats this on other roads: the "
        "source's noise model treats the samples as independent, so its standard errors are too small; ours models "
        "how a road shakes a car. The source does not give the speed, bump or road of these tables, so only the size "
        "of the errors can be compared; the spread between starts depends on the search alone. The printed "
        "stiffnesses of 20,000 to 25,000 kg should be in N/m.")
    return Result((*tables, many), verdict, (), tuple(values))


def _drive(seed: int) -> Run:
    return record_of(bump(8.0), BUMP_MPS, 12.0, Conditions(iri_m_per_km=5.0, seed=seed))


def _by_start(words: str, masses: list[tuple[int, float]], rates: list[tuple[int, float]], errors: Array,
              printed: Array) -> Table:
    columns = [Column("start mass [kg]", ".0f")]
    for _, rate in rates:
        columns += [Column(f"from {rate:.0f} N/m: printed [%]", ".2f"), Column("ours [%]", "+.4f")]
    rows = tuple((mass, *chain.from_iterable((float(printed[row, column]), error) for (column, _), error in zip(
        rates, found, strict=True))) for (row, mass), found in zip(masses, errors.tolist(), strict=True))
    return Table(f"Error of the {words}, by the start of the fit", tuple(columns), rows)


def _scatter(words: str, name: str, draws: Sequence[tuple[Fit, ...]]) -> list[tuple[Cell, ...]]:
    rows: list[tuple[Cell, ...]] = []
    for way, found in zip(("white noise (the source's way)", "most likely noise model (ours)"), zip(*draws,
                                                                                                    strict=True),
                          strict=True):
        errors = np.array([error_percent(one, name) for one in found])
        expected = np.array([standard_error_percent(one, name) for one in found])
        rows.append((words, way, float(np.sqrt((errors**2).mean())), float(np.sqrt((expected**2).mean())),
                     float(100 * (np.abs(errors) < 2 * expected).mean())))
    return rows


T4_4 = Study("table_4_4", "Mass and both stiffnesses together, from 25 starts", "Table 4.4, section 4.4.4",
             "Simulated as in the source: the half car of Table 4.2 over the bump of 5.5.2 at 16.1 km/h, on a road of "
             "IRI 5 m/km that the fit does not know; sensor noise 0.05 m/s2 (the source names none).", _t4_4,
             items=alike(("Table 4.4", "Table 4.5", "Table 4.6"), Word.BETTER, "From every start ours ends at one "
                         "estimate; the printed errors differ."))


def _f4_19(effort: Workload) -> Result:
    windows_m = (15.0, 100.0)
    bump_at_m = 5.0
    bump_ends_m = 15.0  # both axles are over it and the body has swung out
    (whole,) = (record_of(bump(bump_at_m), BUMP_MPS, (windows_m[-1] + 1) / BUMP_MPS,
                          Conditions(iri_m_per_km=5.0)) for _ in effort.each(range(1)))
    wheelbase_m = float(np.max(structure_of(rav4()).behind_m))
    rows, pictures = [], []
    values: list[Statement] = []
    road = float(np.std(whole.measured_mps2[whole.distance_m >= bump_ends_m]))
    for figure, window in zip(("4.19", "4.20"), windows_m, strict=True):
        record = until(whole, window)
        time_s = np.arange(len(record.distance_m)) / record.rate_hz
        over = record.distance_m < bump_ends_m
        rms = [float(np.sqrt(np.mean(record.measured_mps2[part] ** 2))) if part.any() else None
               for part in (over, ~over)]
        share = float(np.sum(record.measured_mps2[over] ** 2) / np.sum(record.measured_mps2**2))
        rows.append((window, float(time_s[-1]), float(np.abs(record.measured_mps2).max()), *rms, 100 * share))
        inputs = {name: 1000 * bump(bump_at_m)(record.distance_m - behind_m)
                  for name, behind_m in (("front", 0.0), ("rear", wheelbase_m))}
        pictures += [
            Picture(Curves(f"Input in a window of {window:g} m (Fig {figure})", "time [s]",
                           "elevation under the tire [mm]",
                           tuple(Line(name, time_s, one) for name, one in inputs.items())),
                    "the bump under the front and under the rear tires, as functions of time"),
            Picture(Curves(f"Output in a window of {window:g} m (Fig {figure})", "time [s]", "acceleration [m/s2]",
                           (Line("body", time_s, record.measured_mps2),)),
                    "the acceleration on a road that is rough around the bump")]
        behind_s = float(time_s[inputs["rear"].argmax()] - time_s[inputs["front"].argmax()])
        values += about(f"Fig {figure}", [
            Statement("length of the record [m]", f"a range of {window:g} m", float(record.distance_m[-1]),
                      window - 0.1,
                      window, Word.NOT_REPRODUCIBLE),
            Statement("delay of the rear tires' bump, over wheelbase by speed", "one input for each axle",
                      behind_s * BUMP_MPS / wheelbase_m, 0.97, 1.03, Word.NOT_REPRODUCIBLE),
            Statement("peak over the bump, over the r.m.s. on the road behind it", "the road's roughness is noise that "
                      "is added", float(np.abs(record.measured_mps2).max()) / road, 3.0, word=Word.NOT_REPRODUCIBLE)])
    table = Table("Response in the two windows (printed as pictures only)", (
        Column("window [m]", ".0f"), Column("lasts [s]", ".1f"), Column("peak [m/s2]", ".2f"),
        Column("r.m.s. over the bump [m/s2]", ".2f"), Column("r.m.s. behind it [m/s2]", ".2f"),
        Column("share of the power from the bump [%]", ".0f")), tuple(rows))
    verdict = (f"As the text describes: bumps of {1000 * BUMP_HEIGHT_M:.0f} mm, the rear axle's "
               f"{wheelbase_m / BUMP_MPS:.2f} s behind the front's, and a response far above that to the road; in 100 "
               f"m, {rows[1][-1]:.0f} % of its power still comes from the bump. The source does not give the bump and "
               "the road of these figures, so no number can be compared.")
    return Result((table,), verdict, tuple(pictures), tuple(values))


F4_19 = Study("fig_4_19", "A bump's input and output in windows of 15 and 100 m", "Fig 4.19, section 4.4.1.1",
              "Simulated as in the source: the bump of 5.5.2 (the text gives no size) at 16.1 km/h on a road of IRI 5 "
              "m/km that the input leaves out; sensor noise 0.05 m/s2.", _f4_19,
              items=alike(("Fig 4.19", "Fig 4.20"), Word.NOT_REPRODUCIBLE, "The bump, speed and road of the figures "
                          "are not printed; the simulated response is as described."))


def _f4_21(effort: Workload) -> Result:
    windows_m = tuple(float(end) for end in range(5, 101, 5))
    very_close = 0.02  # two standard errors of ours on such a road are twice that
    whole = record_of(bump(1.0), BUMP_MPS, (windows_m[-1] + 1) / BUMP_MPS, Conditions(iri_m_per_km=5.0))
    windows = effort.some(windows_m, 4)
    white, ours = zip(*([fitted(until(whole, window), {MASS: 800.0}, ours=way) for way in (False, True)]
                        for window in effort.each(windows)), strict=True)
    mass, expected = (np.array([getattr(one, what)[MASS] for one in ours]) for what in ("parameters",
                                                                                        "standard_errors"))
    their_mass = np.array([one.parameters[MASS] for one in white])
    numbers = np.stack([their_mass, mass, expected, 100 * (mass / TRUTH[MASS] - 1)], axis=1).tolist()
    rows = tuple((window, "very close to 875", *found) for window, found in zip(windows, numbers, strict=True))
    table = Table("Mass, by the length of the window", (
        Column("window [m]", ".0f"), Column("printed [kg]"), Column("white noise, the source's way [kg]", ".1f"),
        Column("ours [kg]", ".1f"), Column("standard error [kg]", ".1f"), Column("error of ours [%]", "+.2f")), rows)
    inside = int((np.abs(mass - TRUTH[MASS]) < 2 * expected).sum())
    verdict = ("As the source finds, the window hardly matters once both axles are over the bump (some 8 m): the bump "
               f"shows the mass, the road behind it almost nothing. In {inside} of {len(windows)} windows the truth "
               "lies within two standard errors; all share one road, so their errors are alike. In 5 m, where only "
               "the front axle crosses the bump, the source's way is a little less accurate.")
    picture = Picture(Curves("Mass and its standard error", "window [m]", "mass [kg]", (
        Line("ours", np.array(windows), mass, expected),
        Line("white noise, the source's way", np.array(windows), their_mass, dots=True)), (TRUTH[MASS], "875 kg")),
        "the mass from windows of 5 to 100 m, very close to 875 kg for each")
    values = tuple(Value(f"mass, the worst window from {least:g} m, {way} [kg]", TRUTH[MASS], _worst(
        found, np.array(windows) >= least), very_close * TRUTH[MASS], Word.NOT_REPRODUCIBLE)
                   for way, found, least in (("the source's way", their_mass, 10.0), ("ours", mass, 0.0)))
    return Result((table,), verdict, (picture,), values)


def _worst(mass_kg: np.ndarray, chosen: np.ndarray) -> float:
    return float(max(mass_kg[chosen].tolist(), key=lambda one: abs(one - TRUTH[MASS])))


F4_21 = Study("fig_4_21", "Mass from windows of 5 to 100 m", "Fig 4.21, section 4.4.1.1",
              "Simulated as in the source: one bump (of 5.5.2; the text gives no size) at the start of the window, "
              "16.1 km/h, on a road of IRI 5 m/km that the fit does not know.", _f4_21,
              items=(Item("Fig 4.21", Word.NOT_REPRODUCIBLE,
                          "The size of the bump and the road are not printed; in the simulation the window hardly "
                          "matters once both axles are over the bump, as the text says."),))


def _f4_22(effort: Workload) -> Result:
    printed_starts_kg = tuple(np.linspace(700, 1100, 20).tolist())
    printed_within_percent = 6.0
    wider_kg = (300.0, 400.0, 550.0, 1500.0, 2000.0, 3000.0)
    record = record_of(bump(8.0), BUMP_MPS, 12.0, Conditions(iri_m_per_km=5.0))
    kg = sorted([*effort.some(printed_starts_kg), *effort.some(wider_kg)])
    found = [fitted(record, {MASS: start}, ours=True) for start in effort.each(kg)]
    starts = np.array(kg)
    ends = np.array([one.parameters[MASS] for one in found])
    standard_error = found[0].standard_errors[MASS]
    said = f"within {printed_within_percent:g} % of 875"
    rows = tuple((float(start), said if 699 < start < 1101 else None, float(end), 100 * float(end / TRUTH[MASS] - 1))
                 for start, end in zip(starts, ends, strict=True))
    table = Table("Mass, by the start of the fit", (Column("start [kg]", ".1f"), Column("printed end [kg]"),
                  Column("our end [kg]", ".4f"), Column("error [%]", "+.3f")), rows)
    verdict = (f"All {len(starts)} starts, from {starts[0]:.0f} to {starts[-1]:.0f} kg, end within {np.ptp(ends):.1g} "
               "kg of each other; the source's 20 lie within 6 % of 875 kg. The error of the estimate, "
               f"{ends.mean():.1f} +- {standard_error:.1f} kg, comes from the road of IRI 5 m/km, which the fit does "
               "not know.")
    picture = Picture(Curves("Mass found, by the start of the fit", "start [kg]", "end [kg]",
                             (Line("start", starts, starts), Line("end", starts, ends, dots=True)),
                             (TRUTH[MASS], "875 kg")), "the masses from 20 starts, all within 6 % of 875 kg")
    values = (Statement("largest error of any start [%]", "all within 6 % of 875 kg",
                        100 * float(np.abs(ends / TRUTH[MASS] - 1).max()), 0.0, printed_within_percent,
                        Word.NOT_REPRODUCIBLE), Statement("the ends differ by up to [kg]", "effective from every start",
                                                          float(np.ptp(ends)), 0.0, 0.01, Word.NOT_REPRODUCIBLE))
    return Result((table,), verdict, (picture,), values)


F4_22 = Study("fig_4_22", "Mass from 20 starts, and from 300 to 3000 kg", "Fig 4.22, section 4.4.1.2",
              "Simulated as in the source: one bump (of 5.5.2; the text gives no size) at 16.1 km/h on a road of IRI 5 "
              "m/km that the fit does not know.", _f4_22,
              items=(Item("Fig 4.22", Word.NOT_REPRODUCIBLE,
                          "The size of the bump and the road are not printed; in the simulation all starts end at one "
                          "mass, within the printed 6 %."),))


def _f4_25(effort: Workload) -> Result:
    heights_m = (0.1016, 0.1270, 0.1524, 0.1778, 0.2032)
    widths_m = (1.83, 2.13, 2.44, 2.74, 3.05, 3.35)
    printed_peak_g = 0.8703  # Table 5.5, measured on speed bumps
    heights, widths = effort.some(heights_m), effort.some(widths_m)
    peaks = np.array([[_peak(height, width) for width in widths] for height in effort.each(heights)])
    columns = (Column("height [mm]", ".1f"), *(Column(f"width {width:.2f} m [m/s2]", ".2f") for width in widths))
    rows = tuple((1000 * height, *map(float, row)) for height, row in zip(heights, peaks, strict=True))
    own = _peak(BUMP_HEIGHT_M, BUMP_WIDTH_M)
    one = Table("The bump of 5.5.2, 150 mm by 2.60 m",
                (Column("printed, Table 5.5 [g]", ".4f"), Column("ours [g]", ".4f")),
                ((printed_peak_g, own / STANDARD_GRAVITY_MPS2),))
    verdict = ("As the source says, a higher bump gives a larger peak and a wider one a smaller. The car is linear, "
               "so the peak is exactly proportional to the height; the text gives no number of the figure. Over the "
               f"bump of 5.5.2 the model peaks at {own / STANDARD_GRAVITY_MPS2:.2f} g, the record on a row of speed "
               "bumps at 0.87 g: the real bumps, tires or bump stops are harsher than the model's, and the text does "
               "not show which.")
    picture = Picture(Curves("Largest acceleration over a bump", "width of the bump [m]", "peak [m/s2]", tuple(
        Line(f"{1000 * height:.0f} mm", np.array(widths), row) for height, row in zip(heights, peaks, strict=True))),
        "peaks for heights of 101.6 to 203.2 mm and widths of 1.83 to 3.35 m: the higher the larger, the wider the "
        "smaller")
    values = (Statement("smallest rise of the peak from one height to the next [m/s2]", "the larger the height, "
                        "the larger the peak", float(np.diff(peaks, axis=0).min()), least=1e-3),
              Statement("largest change of the peak from one width to the next [m/s2]", "the larger the width, the "
                        "smaller the peak", float(np.diff(peaks, axis=1).max()), most=-1e-3))
    return Result((Table("Largest acceleration, up or down (printed as a picture only)", columns, rows), one), verdict,
                  (picture,), values)


def _peak(height_m: float, width_m: float) -> float:
    record = record_of(bump(2.0, height_m, width_m), BUMP_MPS, 4.0, Conditions(noise_mps2=0.0))
    return float(np.abs(record.measured_mps2).max())


F4_25 = Study("fig_4_25", "Peak acceleration by height and width of a bump", "Fig 4.25, section 4.4.2",
              "Simulated as in the source: half car of Table 4.2, 16.1 km/h, no roughness, no noise.", _f4_25,
              items=(Item("Fig 4.25", Word.AGREES,
                          "A higher bump gives a larger peak, a wider one a smaller, as printed; the figure has no "
                          "numbers in the text."),))


_BUMP_AT_M_F4_27 = 8.0


def _f4_27(effort: Workload) -> Result:
    heights_m = tuple(round(0.0254 * inches, 4) for inches in np.arange(3, 9.01, 0.5).tolist())
    widths_m = tuple(round(0.3048 * feet, 3) for feet in np.arange(6, 11.01, 0.5).tolist())
    printed_limit_percent = 50.0
    shown = 2  # every other grid point is in the table, all are in the picture
    numbers = ((MASS, "mass [kg]", TRUTH[MASS]), ("bump.height_m", "height [m]", BUMP_HEIGHT_M),
               ("bump.width_m", "width [m]", BUMP_WIDTH_M), ("speed_scale", "recorded speed over true", 1.0))
    drive = record_of(bump(_BUMP_AT_M_F4_27), BUMP_MPS, 8.0, Conditions())
    record = without_profile(drive)
    heights, widths = effort.some(heights_m, 3), effort.some(widths_m, 3)
    errors = np.array([[_error_percent(record, height, width) for width in widths] for height in effort.each(heights)])
    columns = (Column("assumed height [mm]", ".1f"),
               *(Column(f"assumed width {width:.2f} m [%]", "+.1f") for width in widths[::shown]))
    rows = tuple((1000 * height, *row[::shown].tolist())
                 for height, row in zip(heights[::shown], errors[::shown], strict=True))
    taken = Bump(_BUMP_AT_M_F4_27, 0.1016, 3.05)
    found = mass_and_bump(record, taken)
    ours = Table("Ours: mass, bump and speed together, starting from a bump of 101.6 mm by 3.05 m", (
        Column("number"), Column("truth", ".4g"), Column("estimate", ".5g"), Column("standard error", ".2g")), tuple(
        (words, truth, found.parameters[name], found.standard_errors[name]) for name, words, truth in numbers))
    best = [widths[int(np.abs(row).argmin())] for row in errors]
    verdict = ("The slanting valley of the printed picture appears: the error is smallest for assumed bumps from "
               f"{1000 * heights[0]:.0f} mm by {best[0]:.2f} m up to {1000 * heights[-1]:.0f} mm by {best[-1]:.2f} m; "
               f"a wider assumed bump needs a higher one. The source cuts its errors at {printed_limit_percent:g} %, "
               "as the picture here does; its 72.2 mm is a misprint for 76.2 (3 in). The valley belongs to a fit of "
               "the mass alone. The wrong bumps in it leave residuals far above the noise, so the record does show "
               "height and width: a fit of all three finds them within a fraction of a per cent.")
    picture = Picture(Field("Absolute error of the mass, by the assumed bump", "assumed width [m]",
                            "assumed height [mm]", np.array(widths), 1000 * np.array(heights), np.abs(errors),
                            "error [%]", printed_limit_percent), "errors up to 50 % over heights of 3 to 9 in and "
                      "widths of 6 to 11 ft, from two viewpoints: a slanting dark blue region of correct masses")
    right_m = [float(np.interp(0.0, -row, widths)) for row in errors]  # the wider, the lighter the car
    return Result((Table("The source's way: error of the mass, fitted alone (printed as a picture only)",
                         columns, rows), ours),
                  verdict, (picture,), (
                      *about("4.4.3 smallest height", [Value("3 in [mm]", 72.2, 1000 * heights_m[0], 0.5,
                                                          Word.MISPRINT, of_print=True)]),
                      *about(("Fig 4.26", "Fig 4.27"), [
                          Statement("width that gives the correct mass at the largest height, minus that at the "
                                    "smallest [m]",
                                    "an angled region: a larger width needs a larger height", right_m[-1] - right_m[0],
                                    0.3)]),
                      *about("Fig 4.26", [Statement(
                          "error of the mass at the grid point nearest the true bump [%]",
                          "a region where the estimate is accurate", float(np.abs(errors).min()), 0.0, 10.0)]),
                      *about("Fig 4.27", [Statement(
                          "error of the mass with height, width and speed estimated, over its standard error",
                          "correct masses with wrong heights and widths",
                          error_percent(found, MASS) / standard_error_percent(found, MASS), -3.0, 3.0, Word.BETTER)])))


def _error_percent(record: Run, height_m: float, width_m: float) -> float:
    road = RoadInput(bump=Bump(_BUMP_AT_M_F4_27, height_m, width_m))
    return error_percent(fitted(record, {MASS: TRUTH[MASS]}, False, road), MASS)


F4_27 = Study("fig_4_27", "Error of the mass by the assumed height and width of a bump",
              "Fig 4.27 (and 4.26), section 4.4.3",
              "Simulated as in the source: a bump of 150 mm by 2.60 m at 16.1 km/h, no roughness; sensor noise 0.05 "
              "m/s2.", _f4_27,
              items=(Item("Fig 4.26", Word.AGREES, "A fit of the mass alone shows the printed valley."),
                     Item("Fig 4.27", Word.BETTER,
                          "A fit of height, width and mass together finds them within a fraction of a per cent; a fit "
                          "of the mass alone has many answers."),
                     Item("4.4.3 smallest height", Word.MISPRINT, "3 in are 76.2 mm, not 72.2.")))

STUDIES = (T4_4, F4_19, F4_21, F4_22, F4_25, F4_27)
