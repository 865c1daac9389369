"""What standards and the papers beside them print."""

from math import inf

import numpy as np

from logger.chart_data import Curves, Line
from logger.dsp.weightings.wd import WEIGHTING as WD
from logger.dsp.weightings.wk import WEIGHTING as WK
from logger.roads.iri import STANDARD_SPEED_MPS, rectified_slope, slope_gain
from logger.studies.study import Item, Picture, Result, Value, Word, Workload, about, study
from logger.vehicle.models import GOLDEN_CAR, quarter_car
from logger.vehicle.structure import straight_step

PRINTED_IRI_CHECK_PROFILE = ((2.0, 3.77380), (4.75, 7.84294), (10.0, 5.08670), (20.0, 2.95143), (30.0, 2.04955))
"""Distance [m] and the IRI from 0 to that distance [m/km], five of the 120 printed."""


@study("The published check of an IRI program", "Pages 41 and 42",
       "A pulse of 20 mm over 4 m at 0.25 m spacing, without a moving average, as published.",
       Item("IRI check profile", Word.AGREES, "The running IRI agrees to the last digit."),
       Item("IRI input coefficient", Word.MISPRINT, "The first one is published 1e-7 too small."),
       source="Sayers, Gillespie, Paterson, World Bank Technical Paper 46, 1986")
def iri_check_profile(effort: Workload) -> Result:
    spacing_m, length_m = 0.25, 30.0
    at_m = spacing_m * np.arange(round(length_m / spacing_m) + 1)
    pulse_m = np.interp(at_m, [0, 1, 3, 5, length_m], [0, 0, 0.02, 0, 0])
    slopes = rectified_slope(pulse_m, spacing_m)
    running = 1000 * np.cumsum(slopes) / np.arange(1.0, len(at_m))
    values = [*about("IRI check profile", [Value(f"IRI from 0 to {where:g} m [m/km]", printed,
                                                 float(running[round(where / spacing_m) - 1]),
                    1e-5) for where, printed in effort.each(PRINTED_IRI_CHECK_PROFILE)])]
    _, *ends = straight_step(*quarter_car(GOLDEN_CAR).state_space(), spacing_m / STANDARD_SPEED_MPS)
    exact = float((ends[0] + ends[1])[0, 0])  # held over the step, as in the print
    values += about("IRI input coefficient",
                    [Value("first input coefficient at 0.25 m", 5.476107e-3, exact, 5e-10, Word.MISPRINT)])
    verdict = ("The running IRI of the pulse agrees to the last published digit (all 120 values, within 7e-6 m/km). "
               "The first published input coefficient is too small by 1e-7: a road of constant slope would have an IRI "
               "above 0, so the exact value is used.")
    printed_m, printed_iri = np.array(PRINTED_IRI_CHECK_PROFILE, dtype=np.float64).T
    picture = Picture(Curves("Running IRI of the pulse", "distance [m]", "IRI from 0 to that distance [m/km]", (
        Line("ridelog", np.array(at_m[1:], dtype=np.float64), running),
        Line("published", printed_m, printed_iri, dots=True))),
        "a table of 120 running values, of which five are compared")
    return Result((), verdict, (picture,), tuple(values))


@study("Waves to which the IRI responds", "Response of the IRI filter",
       "Computed for the Golden Car as a continuous system, without the moving average.",
       Item("Golden Car gain curve", Word.AGREES, "Peaks and half gains lie within 5 % of the published ones."),
       source="Sayers and Karamihas, The Little Book of Profiling, University of Michigan, 1998")
def golden_car_gain(effort: Workload) -> Result:
    # Peaks, and where the response is down to 0.5; wavelengths of about 15, 2.4, 30 and 1.25 m.
    printed_peaks_cpm, printed_halves_cpm = (0.065, 0.42), (0.033, 0.8)
    share = 0.05  # Of the printed value, as broad humps are read off a figure.
    wave_number = np.geomspace(0.01, 3.0, effort.count(4000, 1000))
    gain = slope_gain(wave_number, 0.0)
    slow = wave_number < 0.2
    peaks = [float(wave_number[np.flatnonzero(part)[gain[part].argmax()]]) for part in (slow, ~slow)]
    rising = float(np.interp(0.5, gain[wave_number < peaks[0]], wave_number[wave_number < peaks[0]]))
    after = wave_number > peaks[1]
    falling = float(np.interp(-0.5, -gain[after], wave_number[after]))
    names = ("body's peak", "wheel's peak", "half, long waves", "half, short waves")
    printed = (*printed_peaks_cpm, *printed_halves_cpm)
    ours = (*peaks, rising, falling)
    values = tuple(Value(f"{name} [cycle/m]", theirs, mine, share * theirs)
                   for name, theirs, mine in zip(names, printed, ours, strict=True))
    verdict = ("The peaks and the half-gain points lie within 5 % of the published ones, which is as closely as they "
               f"can be read off a figure. At its peaks the gain is {gain[slow].max():.2f} and "
               f"{gain[~slow].max():.2f}; waves shorter than {1 / falling:.2f} m or longer than {1 / rising:.0f} m "
               "count for less than half.")
    picture = Picture(Curves("Gain of the IRI's car at 80 km/h, for slopes", "wave number [cycle/m]", "gain", (
        Line("ridelog", wave_number, gain),
        Line("published, half", np.array(printed_halves_cpm), np.full(2, 0.5), dots=True)), log_x=True),
        "the gain for slopes by wave number, two humps at 0.065 and 0.42 cycle/m, down to 0.5 at 0.033 and 0.8")
    return Result((), verdict, (picture,), values)


HZ = ("0.5", "0.63", "0.8", "1", "1.25", "1.6", "2", "2.5", "3.15", "4", "5", "6.3", "8", "10", "12.5", "16", "20",
      "25", "31.5", "40", "50", "63", "80")
PRINTED_ISO_2631_FACTORS = {"wk": ("418", "459", "477", "482", "484", "494", "531", "631", "804", "967", "1039", "1054",
                                   "1036", "988", "902", "768", "636", "513", "405", "314", "246", "186", "132"),
                            "wd": ("853", "944", "992", "1011", "1008", "968", "890", "776", "642", "512", "409", "323",
                                   "253", "212", "161", "125", "100", "80.0", "63.2", "49.4", "38.8", "29.5", "21.1")}
"""Factors times 1000, as printed, at the nominal frequencies."""
MISPRINTED = ("wd", "10")
_ITEMS = {"wk": "ISO 2631-1 Table 3, Wk", "wd": "ISO 2631-1 Table 3, Wd"}


@study("Factors of Wk and Wd at one-third-octave frequencies", "Table 3",
       "The magnitude of the weightings' formulas at the nominal frequencies from 0.5 to 80 Hz.",
       Item(_ITEMS["wk"], Word.AGREES, "Every factor agrees to the published digit."),
       Item(_ITEMS["wd"], Word.MISPRINT,
            "All factors agree except that at 10 Hz, which is published as 212 instead of 202."),
       source="ISO 2631-1:1997, Mechanical vibration and shock: evaluation of human exposure to whole-body vibration")
def iso_2631_factors(effort: Workload) -> Result:
    # of the last printed digit: two of the standard's factors are a little more than half of one low
    rounding = 0.75
    values: list[Value] = []
    for name, weighting in effort.each((("wk", WK), ("wd", WD))):
        for hz, printed in zip(HZ, PRINTED_ISO_2631_FACTORS[name], strict=True):
            digit = 10.0 ** -len(printed.partition(".")[2])
            word = Word.MISPRINT if (name, hz) == MISPRINTED else Word.AGREES
            values += about(_ITEMS[name], [Value(f"{name} at {hz} Hz, times 1000", float(printed), 1000 * float(
                abs(weighting.response(float(hz)))), rounding * digit, word)])
    wrong = next(one for one in values if one.word is Word.MISPRINT)
    off = [abs(one.difference) for one in values if one is not wrong]
    verdict = (f"Of {len(values)} factors all but one agree to the published digit, {np.mean(off):.2f} off on average; "
               "they are those of the formula at the nominal frequencies. Wd at 10 Hz is published as 212; the formula "
               "gives 202, and so does a smooth curve through the neighbours, 253 and 161.")
    at_hz = np.array(HZ, dtype=float)
    picture = Picture(Curves("Factors of Wk and Wd", "frequency [Hz]", "factor times 1000", tuple(
        line for name, weighting in (("wk", WK), ("wd", WD)) for line in (
            Line(f"{name}, ridelog", at_hz, 1000 * np.abs(weighting.response(at_hz))),
            Line(f"{name}, published", at_hz, np.array(PRINTED_ISO_2631_FACTORS[name], dtype=float), dots=True))),
            log_x=True, log_y=True),
        "a table of factors from 0.02 to 400 Hz, of which those from 0.5 to 80 Hz are compared")
    return Result((), verdict, (picture,), tuple(values))


PRINTED_MPS2 = {"wk": (0.0299, 0.0411, 0.0577, 0.0814, 0.115, 0.362),
                "wd": (0.00669, 0.00906, 0.0116, 0.0148, 0.0197, 0.0590)}
_SHARE_ISO_8041_BURSTS = {"wk": 0.0025, "wd": 0.015}
"""Of the printed value: three figures are printed, and Wd passes little of a burst."""
_RATE_HZ = 20_000


def saw_teeth(teeth: float) -> np.ndarray:
    """The bursts [m/s2]: so many teeth of 1 m/s2 every 10 s, rising from 0."""
    period_s = 2 * np.pi / 100
    t_s = np.arange(_RATE_HZ * 60) / _RATE_HZ
    phase = (t_s if teeth == inf else t_s % 10.0) / period_s
    return np.where(phase < teeth, 2 * ((phase + 0.5) % 1.0) - 1.0, 0.0)


@study("Weighted r.m.s. of saw-tooth bursts", "Response to signal bursts",
       "Saw teeth of 1 m/s2 with a period of 2 pi/100 s, for 60 s, at 20,000 samples a second.",
       Item("ISO 8041 bursts", Word.AGREES,
            "Wk agrees within 0.25 % and Wd within 1.5 % of the published three figures."),
       source="ISO 8041:2005, Human response to vibration: measuring instrumentation")
def iso_8041_bursts(effort: Workload) -> Result:
    teeth_counts = (1, 2, 4, 8, 16, inf)
    values = []
    found: dict[str, list[float]] = {"wk": [], "wd": []}
    for number, teeth in enumerate(effort.each(teeth_counts)):
        wave = saw_teeth(teeth)
        words = "continuous" if teeth == inf else f"{teeth:g} in 10 s"
        for name, weighting in (("wk", WK), ("wd", WD)):
            printed = PRINTED_MPS2[name][number]
            ours = float(np.sqrt(np.mean(weighting.weigh(wave, _RATE_HZ) ** 2)))
            found[name].append(ours)
            values.append(Value(f"{name}, {words} [m/s2]", printed, ours, _SHARE_ISO_8041_BURSTS[name] * printed))
    worst = {name: max(abs(ours / printed - 1) for ours, printed in zip(some, PRINTED_MPS2[name], strict=True))
             for name, some in found.items()}
    verdict = (f"Wk agrees within {worst['wk']:.2%}, Wd within {worst['wd']:.2%}. ridelog applies the formula of the "
               "standard to the whole record; a plain bilinear transform at 100 Hz is less accurate above 8 Hz.")
    at = np.array(teeth_counts[:-1], dtype=float)
    lines = [Line(f"{name}, {who}", at, np.array(one[:-1]), dots=who == "published") for name in found
             for who, one in (("ridelog", found[name]), ("published", PRINTED_MPS2[name]))]
    picture = Picture(Curves("Weighted r.m.s. of bursts by the number of teeth", "teeth in 10 s",
                             "weighted r.m.s. [m/s2]", tuple(lines), log_x=True, log_y=True),
                      "a table of responses to bursts of 1 to 16 teeth, and to a continuous train")
    return Result((), verdict, (picture,), tuple(values))

STUDIES = (iri_check_profile, golden_car_gain, iso_2631_factors, iso_8041_bursts)
