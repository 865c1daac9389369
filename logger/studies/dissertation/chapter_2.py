"""Chapter 2: classes of roads, IRI, weightings and exposure. Names of one item end in its number (``PRINTED_T2_2``).

The factors of ISO 2631-1 are an outside measure of the principal weightings. Of the additional ones the right sides of
Eq 2.13 to 2.15, worked out here from the printed Table 2.8, stand beside ours.
"""

from dataclasses import replace
from itertools import pairwise
from math import inf, isfinite, sqrt

import numpy as np

from logger.chart_data import Curves, Line
from logger.comfort.iso2631 import S_PER_HOUR, caution_zone
from logger.dsp.weightings.wc import WEIGHTING as WC
from logger.dsp.weightings.wd import WEIGHTING as WD
from logger.dsp.weightings.we import WEIGHTING as WE
from logger.dsp.weightings.weighting import Weighting
from logger.dsp.weightings.wf import WEIGHTING as WF
from logger.dsp.weightings.wj import WEIGHTING as WJ
from logger.dsp.weightings.wk import WEIGHTING as WK
from logger.roads.elevation_spectrum import band_edges, classify, smooth, spectrum
from logger.roads.iri import STANDARD_SPEED_MPS, slope_gain
from logger.roads.iso8608 import CLASS_GD_N0_CM3, HIGHEST_CPM, LOWEST_CPM, displacement_psd, generate, road_class
from logger.roads.sections import federal_condition, ride_words, road_kinds
from logger.studies.study import (
    Cell,
    Item,
    Picture,
    Result,
    Statement,
    Table,
    Value,
    Word,
    Workload,
    about,
    alike,
    study,
)
from logger.vehicle.models import GOLDEN_CAR, quarter_car
from logger.vehicle.modes import undamped_frequencies_hz

_SPACING_M_T2_2 = 0.05


@study("The classes of ISO 8608, and roads of each", "Table 2.2, section 2.2.1",
       "The limits are those at which ridelog changes the class of a road; roads of 1 km are generated at each class's "
       "geometric mean and classified from their elevations alone.",
       Item("Table 2.2", Word.MISPRINT,
            "All limits agree; the published unit should be 1e-6 m2 per cycle/m, which is cm3."),
       Item("Fig 2.5", Word.AGREES, "The plotted limits are those of the table, at waviness 2."))
def table_2_2(effort: Workload) -> Result:
    # Class, lower limit, geometric mean, upper limit [cm3].
    printed = (("A", None, 16, 32), ("B", 32, 64, 128), ("C", 128, 256, 512), ("D", 512, 1_024, 2_048),
               ("E", 2_048, 4_096, 8_192), ("F", 8_192, 16_384, 32_768), ("G", 32_768, 65_536, 131_072),
               ("H", 131_072, 262_144, None))
    printed_power = 1.0  # of a metre, in m2 (cycle/m)
    limits = [_limit(*pair) for pair in pairwise(CLASS_GD_N0_CM3.items())]
    roads = effort.count(20, 2)
    rows: list[tuple[Cell, ...]] = []
    values: list[Value] = []
    for (name, _, mean, upper), ours in zip(effort.each(printed), [*limits, None], strict=True):
        found = [classify(generate(CLASS_GD_N0_CM3[name], 1000.0, _SPACING_M_T2_2, seed), _SPACING_M_T2_2)
                 for seed in range(roads)]
        gd, waviness = (float(np.mean([getattr(one, what) for one in found])) for what in ("gd_n0_cm3", "waviness"))
        right = sum(one.road_class == name for one in found)
        rows.append((name, gd, waviness, 100 * right / roads))
        values += about("Table 2.2", [Value(f"class {name}, geometric mean [cm3]", mean, CLASS_GD_N0_CM3[name], 0.0)])
        if upper is not None and ours is not None:
            values += about(("Table 2.2", "Fig 2.5"), [
                Value(f"class {name}, upper limit [cm3]", upper, ours, 1e-6 * upper)])
    values += about("Table 2.2", [Value("exponent of the metre in the unit of Gd", printed_power, _power_of_a_metre(),
                                        0.01, Word.MISPRINT)])
    table = Table(f"Classes, and {roads} generated roads of each geometric mean", (
        "class", "Gd(n0) found in the roads [cm3]", "waviness found .3f", "correctly classified [%] .0f"), tuple(rows))
    verdict = ("All limits and means agree. The published unit, 1e-6 m2 (cycle/m), is a misprint: a displacement "
               "spectrum is in m2 per cycle/m, or m3, and 1e-6 m3 is 1 cm3. For roads generated at each mean, ridelog "
               "finds the degree of roughness, a waviness near 2 and the class. The exponent of the metre is the "
               "power of 2 by which a road's spectrum grows when all its lengths are doubled.")
    n = np.array([LOWEST_CPM, HIGHEST_CPM])
    picture = Picture(Curves("Bounds of the classes, waviness 2", "wave number [cycle/m]", "displacement spectrum [m3]",
                             tuple(Line(f"upper limit of {name}", n, displacement_psd(n, limit))
                                   for name, limit in zip(CLASS_GD_N0_CM3, limits, strict=False)), log_x=True,
                             log_y=True),
                      "limits of the classes in a plot of the spectrum against wave number")
    return Result((table,), verdict, (picture,), tuple(values))


def _power_of_a_metre() -> float:
    """Of a spectrum: by how many doublings it grows when heights and distances of a road are twice as large."""
    short_m = 200.0  # one segment of a spectrum, also at twice the length
    road = generate(CLASS_GD_N0_CM3["B"], short_m, _SPACING_M_T2_2, 0)
    plain, doubled = spectrum(road, _SPACING_M_T2_2), spectrum(2 * road, 2 * _SPACING_M_T2_2)
    return float(np.median(np.log2(doubled.psd_m3 / plain.psd_m3)))


def _limit(smoother: tuple[str, float], rougher: tuple[str, float]) -> float:
    """The degree of roughness [cm3] at which the word for a road changes."""
    low, high = smoother[1], rougher[1]
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if road_class(middle) == rougher[0] else (middle, high)
    return high


PRINTED_RANGES = (("airport runways and superhighways", 0.25, 1.75), ("new pavements", 1.50, 3.25),
                  ("older pavements", 2.25, 5.75), ("maintained unpaved roads", 3.25, 10.00),
                  ("damaged pavements", 4.00, 10.75), ("rough unpaved roads", 8.00, 20.00))


@study("IRI of kinds of road, and how they ride", "Table 2.3, section 2.2.2.3",
       "ridelog describes each IRI from 0 to 25 m/km in steps of 0.001; the values at which the description changes "
       "are compared with the published ones.",
       *alike(("Table 2.3", "Fig 2.16"), Word.AGREES, "Each kind of road begins and ends at the published IRI."),
       Item("Table 2.4", Word.AGREES, "The description of the ride changes at the published marks."),
       Item("2.2.2.3 targets", Word.AGREES, "Good and fair roads end at the targets of 2006 and 2002."))
def table_2_3(effort: Workload) -> Result:
    # Marks of Table 2.4's scale at which the second to fifth descriptions begin [m/km].
    printed_marks = (4.0, 6.0, 8.0, 10.0)
    # Upper ends [m/km]: the targets of 2006 and of 2002, 95 and 170 in/mi.
    printed_federal = (("good", 1.50), ("fair", 2.68))
    step = 0.001  # of the IRI that is asked for; half the last printed figure is 0.005
    iri = np.round(np.arange(0, 25.0, step), 3)
    kinds = [road_kinds(one) for one in iri.tolist()]
    lines = []
    values: list[Value] = []
    for place, (name, low, high) in enumerate(PRINTED_RANGES):
        held = iri[[name in kind for kind in kinds]]
        ours = float(held.min()), float(held.max())
        values += about(("Table 2.3", "Fig 2.16"), [
            Value(f"{name}, {end} [m/km]", printed, mine, 0.005)
            for end, printed, mine in zip(("from", "to"), (low, high), ours, strict=True)])
        lines.append(Line(name, np.array(ours), np.full(2, float(len(PRINTED_RANGES) - place))))
    words = [ride_words(one) for one in iri.tolist()]
    changes = [float(iri[place]) for place in range(1, len(iri)) if words[place] != words[place - 1]]
    values += about("Table 2.4", [Value(f"ride, mark {mark:.0f} [m/km]", mark, change, 0.005)
                                  for mark, change in zip(printed_marks, changes, strict=True)])
    rides = Table("How a paved road rides", ("from [m/km] .2f", "in short"),
                  tuple((change, ride_words(change)) for change in (0.0, *changes)))
    federal = [federal_condition(one) for one in iri.tolist()]
    values += about("2.2.2.3 targets", [
        Value(f"{word} up to [m/km]", printed, float(iri[[one == word for one in federal]].max()), 0.005)
        for word, printed in printed_federal])
    verdict = ("All limits agree. Table 2.4 prints its descriptions along a scale; here each applies from its mark up "
               "to the next one, and the first from 0. The targets in the text, 1.50 and 2.68 m/km, are 95 and 170 "
               "in/mi, the limits between which US federal practice calls a road fair.")
    picture = Picture(Curves("Which roads have it", "IRI [m/km]", "kind of road, as in the table", tuple(lines)),
                      "the ranges of six kinds of road as Sayers and Karamihas (1998) draw them, those of Table 2.3")
    return Result((rides,), verdict, (picture,), tuple(values))


CLASSES = ("B", "D")
PROFILES, SPECTRA = {"B": "Fig 2.6", "D": "Fig 2.8"}, {"B": "Fig 2.7", "D": "Fig 2.9"}


@study("Spectra of a smooth and a rough road, raw and smoothed", "Fig 2.7, section 2.2.1",
       "Random roads of 1 km at the geometric means of classes B and D, as the captions have them.",
       *alike(PROFILES.values(), Word.AGREES, "A road generated for the caption's class is classified as that class."),
       *alike(SPECTRA.values(), Word.AGREES, "The spectra fall, differ and become smooth as the text describes."))
def fig_2_7(effort: Workload) -> Result:
    spacing_m = 0.05
    bands_cpm = (0.011, 2.0)
    rows: list[tuple[Cell, ...]] = []
    lines, roads, scatters, levels = [], [], [], []
    values: list[Value | Statement] = []
    for name in effort.each(CLASSES):
        gd = CLASS_GD_N0_CM3[name]
        road = generate(gd, 1000.0, spacing_m, 0)
        raw, found = spectrum(road, spacing_m), classify(road, spacing_m)
        bands = smooth(raw, band_edges(max(bands_cpm[0], 1.5 * raw.step_cpm), bands_cpm[1]))
        n = raw.wave_number_cpm
        inside = (n > bands.edges_cpm[0]) & (n < bands.edges_cpm[-1])
        scatter = [float(np.std(10 * np.log10(level / displacement_psd(at, gd))))
                   for level, at in ((raw.psd_m3[inside], n[inside]), (bands.psd_m3, bands.centre_cpm))]
        rows.append((name, found.road_class, gd, found.gd_n0_cm3, found.waviness, *scatter))
        scatters.append(scatter)
        values += about((PROFILES[name], SPECTRA[name]), [
            Value(f"class {name} road, Gd(n0) [cm3]", gd, found.gd_n0_cm3, gd / 2)])
        values += about(SPECTRA[name], [Value(f"class {name} road, waviness", 2.0, found.waviness, 0.15)])
        values += about(SPECTRA[name], [
            Statement(f"class {name}: scatter of the smoothed spectrum over scatter of the raw one",
                      "smoothed, it is easier "
                      "to put into a class", scatter[1] / scatter[0], most=0.5)])
        levels.append(bands.psd_m3)
        thin = slice(None, None, 4)
        lines += [Line(f"{name}, raw", n[inside][thin], raw.psd_m3[inside][thin]),
                  Line(f"{name}, smoothed", bands.centre_cpm, bands.psd_m3)]
        shown = np.arange(0, 100.0, 0.25)
        roads.append(Line(f"class {name}", shown, 1000 * np.interp(shown, spacing_m * np.arange(len(road)), road)))
    values += about(tuple(SPECTRA.values()), [Statement(
        "smallest ratio of the spectra in any band, class D over class B", "shifted upward at all wave numbers",
        float((levels[1] / levels[0]).min()), least=1.0)])
    table = Table("Two roads, classified from their elevations", (
        "published class", "class found", "its mean Gd(n0) [cm3] .0f", "Gd(n0) found [cm3] .1f", "waviness found .3f",
        "scatter of the raw spectrum [dB] .1f", "of the smoothed [dB] .2f"), tuple(rows))
    verdict = ("As the text describes: the rough road's spectrum lies above the smooth one's at all wave numbers, and "
               "both fall towards short waves. The raw spectra are ragged; smoothing over the bands of Eq 2.4 to 2.6 "
               f"reduces their scatter from {scatters[0][0]:.1f} to {scatters[0][1]:.1f} dB. The text says that the "
               "bands are listed in ISO 2631-1; they are in ISO 8608. The published phases are not known, so only the "
               "statistics of the roads can agree.")
    pictures = (Picture(Curves("The first 100 m of a smooth and a rough road (Fig 2.6, 2.8)", "distance [m]",
                               "elevation [mm]", tuple(roads)),
                        "two figures: a simulated smooth profile and a rough one"),
                Picture(Curves("Their spectra (Fig 2.7, 2.9)", "wave number [cycle/m]", "displacement spectrum [m3]",
                               tuple(lines), log_x=True, log_y=True),
                        "two figures, raw and smoothed: both spectra fall towards short waves, and the rough road's "
                        "lies above the other at all wave numbers"))
    return Result((table,), verdict, pictures, tuple(values))


NAMES = ("f1", "f2", "f3", "f4", "Q4", "f5", "Q5", "f6", "Q6")
PRINTED_T2_7: tuple[tuple[Weighting, tuple[float | None, ...]], ...] = (
    (WK, (0.4, 100, 12.5, 12.5, 0.63, 2.37, 0.91, 3.35, 0.91)),
    (WD, (0.4, 100, 2.0, 2.0, 0.63, inf, None, inf, None)),
    (WF, (0.08, 0.63, inf, 0.25, 0.86, 0.0625, 0.80, 0.1, 0.80)),
    (WC, (0.4, 100, 8.0, 8.0, 0.63, inf, None, inf, None)),
    (WE, (0.4, 100, 1.0, 1.0, 0.63, inf, None, inf, None)),
    (WJ, (0.4, 100, inf, inf, None, 3.75, 0.91, 5.32, 0.91)),
)


@study("Parameters of the six frequency weightings", "Table 2.7, section 2.3.4.1",
       "The parameters in ridelog's weighting files, one by one.",
       Item("Table 2.7", Word.AGREES, "Every parameter of Wk, Wd and Wf agrees."),
       Item("Table 2.8", Word.AGREES, "Every parameter of Wc, We and Wj agrees."))
def table_2_7(effort: Workload) -> Result:
    rows: list[tuple[Cell, ...]] = []
    values: list[Value] = []
    for weighting, printed in effort.each(PRINTED_T2_7):
        ours = (weighting.f1_hz, weighting.f2_hz, weighting.f3_hz, weighting.f4_hz, weighting.q4, weighting.f5_hz,
                weighting.q5, weighting.f6_hz, weighting.q6)
        for name, said, mine in zip(NAMES, printed, ours, strict=True):
            unit = "" if name.startswith("Q") else " [Hz]"
            if said is not None and isfinite(said):
                table = "Table 2.7" if weighting in (WK, WD, WF) else "Table 2.8"
                values += about(table, [Value(f"{weighting.name}, {name}{unit}", said, mine, 0.0)])
            else:
                rows.append((weighting.name, name, "infinite" if said else "none",
                             "without effect" if said is None else "infinite" if mine == inf else f"{mine:g}"))
    absent = Table("Sections that a weighting lacks", ("weighting", "parameter", "published", "ridelog"), tuple(rows))
    verdict = (f"All {len(values)} finite parameters agree. Sections that the tables omit, by an infinite frequency, "
               "are omitted here too. Study fig-2-18 evaluates the formula with them.")
    return Result((absent,), verdict, (), tuple(values))


@study("Response of the IRI to each wavelength", "Fig 2.13, section 2.2.2.1",
       "Computed for the Golden Car as a continuous system, without the moving average, as in the figure.",
       Item("Fig 2.13", Word.MISPRINT, "The text swaps the two wave numbers: at 0.065 cycle/m the body bounces, at "
                                       "0.42 the wheel hops; the curve itself agrees."))
def fig_2_13(effort: Workload) -> Result:
    printed_peaks_cpm = (0.065, 0.42)
    printed_peaks_hz = (1.44, 9.33)
    near_share = 0.05  # as near as the top of a broad hump is read off a figure
    wave_number = np.geomspace(0.01, 2.0, effort.count(2000, 200))
    gain = slope_gain(wave_number, 0.0)
    slow = wave_number < 0.2
    peaks = [int(np.flatnonzero(part)[gain[part].argmax()]) for part in (slow, ~slow)]
    body_cpm, wheel_cpm = undamped_frequencies_hz(quarter_car(GOLDEN_CAR)) / STANDARD_SPEED_MPS
    nearest = [float(wave_number[min(peaks, key=lambda peak: abs(np.log(wave_number[peak] / of)))])
               for of in (wheel_cpm, body_cpm)]
    verdict = ("Both peaks lie within 4 % of the published wave numbers, which is as closely as a broad peak can be "
               "read off a figure. The text swaps their meaning: at 0.065 cycle/m the body bounces, at 0.42 the wheel "
               "hops. At 80 km/h these are 1.44 and 9.33 Hz.")
    picture = Picture(Curves("Gain of the IRI's car at 80 km/h, slope of the suspension per slope of the road",
                             "wave number [cycle/m]", "gain", (Line("gain", wave_number, gain),), log_x=True),
                      "the IRI of sine waves of 0.1 to 100 m, with peaks at 0.065 and 0.42 cycle/m")
    values = (*(Value(f"{words} peak [cycle/m]", printed, float(wave_number[peak]), near_share * printed)
                for words, printed, peak in zip(("first", "second"), printed_peaks_cpm, peaks, strict=True)),
              *(Value(f"where the {words} [cycle/m]", printed, near, near_share * printed, Word.MISPRINT)
                for words, printed, near in zip(("wheel hops", "body bounces"), printed_peaks_cpm, nearest,
                                                strict=True)),
              *(Value(f"{printed:g} cycle/m at 80 km/h [Hz]", hz, printed * STANDARD_SPEED_MPS, 0.005, of_print=True)
                for printed, hz in zip(printed_peaks_cpm, printed_peaks_hz, strict=True)))
    return Result((), verdict, (picture,), values)


PRINCIPAL, ADDITIONAL = ("wk", "wd", "wf"), ("wc", "we", "wj")


@study("Curves of the six frequency weightings", "Fig 2.18, section 2.3.4.1",
       "The magnitude of the formulas of ISO 2631-1 Annex A, which ridelog applies to whole records.",
       Item("Fig 2.18", Word.AGREES,
            "The principal weightings agree with the standard's factors to the published digit."),
       Item("Fig 2.19", Word.AGREES,
            "The additional weightings are those of Eq 2.13 to 2.15 with the parameters of Table 2.8."),
       Item("Eq 2.16", Word.MISPRINT,
            "Its denominator has f5 and Q5 where it needs f6 and Q6, so it is 1 at all frequencies."))
def fig_2_18(effort: Workload) -> Result:
    # Factors of ISO 2631-1 Table 3 at frequencies [Hz]; the dissertation prints the curves only.
    standard = ((WK, ((1.0, 0.482), (4.0, 0.967), (8.0, 1.036), (31.5, 0.405))),
                (WD, ((1.0, 1.011), (4.0, 0.512), (31.5, 0.0632))),
                (WF, ((0.1, 0.695), (0.16, 1.006), (0.4, 0.384))))
    at_hz = 1.0
    additional_hz = (0.5, 4.0, 20.0)
    same = 1e-6  # of the factor: the formulas are the same but for how they are written
    last_digit = 0.001
    principal = about("Fig 2.18", [
        Value(f"{weighting.name} at {f_hz:g} Hz (ISO 2631-1)", factor, float(abs(weighting.response(f_hz))),
              0.75 * last_digit) for weighting, factors in standard for f_hz, factor in factors])
    additional = about("Fig 2.19", [
        Value(f"{weighting.name} at {f_hz:g} Hz (Eq 2.13 to 2.15)", by_eq, ours, same * by_eq)
        for weighting, parameters in PRINTED_T2_7 if weighting.name in ADDITIONAL for f_hz in additional_hz
        for by_eq, ours in [(_by_printed_equations(f_hz, parameters), float(abs(weighting.response(f_hz))))]])
    # The right side of Eq 2.16 has f5 and Q5 above and below the line, so it is Q6 / Q5 at all frequencies.
    as_printed = replace(WK, f5_hz=inf, q5=1.0, f6_hz=inf, q6=1.0, gain=WK.q6 / WK.q5)
    misprint = about("Eq 2.16", [Value(f"wk at {at_hz:g} Hz, by Eq 2.16 as published", float(abs(as_printed.response(
        at_hz))), float(abs(WK.response(at_hz))), 0.1, Word.MISPRINT)])
    f_hz = np.geomspace(0.02, 400.0, effort.count(400, 60))
    levels = {weighting.name: 20 * np.log10(np.abs(weighting.response(f_hz)))
              for weighting, _ in effort.each(PRINTED_T2_7)}
    rows = tuple((name, float(f_hz[level.argmax()]), float(level.max()), float(f_hz[level > level.max() - 3].min()),
                  float(f_hz[level > level.max() - 3].max())) for name, level in levels.items())
    table = Table("The curves (published as pictures only)", (
        "weighting", "largest at [Hz] .3g", "there [dB] +.2f", "within 3 dB of it from [Hz] .3g", "to [Hz] .3g"), rows)
    verdict = ("The curves agree with the standard's factors to the published digit. Eq 2.16 as published does not: "
               "its denominator has f5 and Q5, like its numerator, so it is 1 at all frequencies, and Wk at 1 Hz would "
               "be twice as large. The denominator needs f6 and Q6. Of the figures the text says only that they plot "
               "amplitude against frequency. Here Wk has a plateau of half its maximum near 1 Hz and its maximum at 6 "
               "Hz; Wd has its maximum at 1 Hz, Wf at 0.17 Hz.")
    pictures = tuple(Picture(Curves(title, "frequency [Hz]", "factor [dB]", tuple(
        Line(name, f_hz[levels[name] > -60], levels[name][levels[name] > -60]) for name in names), log_x=True),
        f"amplitude by frequency of the {printed}") for title, names, printed in (
            ("Principal weightings (Fig 2.18)", PRINCIPAL, "three principal weightings Wk, Wd and Wf"),
            ("Additional weightings (Fig 2.19)", ADDITIONAL, "three additional weightings Wc, We and Wj")))
    return Result((table,), verdict, pictures, (*principal, *additional, *misprint))


def _by_printed_equations(f_hz: float, parameters: tuple[float | None, ...]) -> float:
    """The right sides of Eq 2.13 to 2.15 multiplied, and of an upward step that of Eq 2.16 with f6 and Q6 below the
    line; parameters as in Tables 2.7 and 2.8."""
    f1, f2, f3, f4, q4, f5, q5, f6, q6 = (inf if one is None else one for one in parameters)
    found = sqrt(f_hz**4 / (f_hz**4 + f1**4)) * sqrt(f2**4 / (f_hz**4 + f2**4))
    if f4 < inf:
        found *= (1.0 if f3 == inf else sqrt((f_hz**2 + f3**2) / f3**2)) / _second_order(f_hz, f4, q4)
    if f5 < inf:
        found *= (f5 / f6) ** 2 * _second_order(f_hz, f5, q5) / _second_order(f_hz, f6, q6)
    return float(found)


def _second_order(f_hz: float, corner_hz: float, q: float) -> float:
    ratio = (f_hz / corner_hz) ** 2
    return sqrt(ratio**2 + ratio * (1 / q**2 - 2) + 1)


@study("The health guidance caution zone", "Fig 2.20, section 2.3.5",
       "The limits of the zone in ridelog, for exposures from a minute to a day; the doses follow from ISO 2631-1 Eq "
       "B.3.",
       Item("Fig 2.20", Word.MISPRINT,
            "The text swaps the doses of the two lines: 17 is the upper one, 8.5 the lower."))
def fig_2_20(effort: Workload) -> Result:
    printed_shaded_hours = (4.0, 8.0)
    hours_shown = (1 / 60, 1 / 6, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0, 24.0)
    dose_per_rms = 1.4  # the estimated dose of ISO 2631-1, Eq B.3
    zones = [(hours, caution_zone(hours, 2), caution_zone(hours, 4)) for hours in effort.each(hours_shown)]
    table = Table("The zone, weighted r.m.s.", (
        "hours a day .3g", "n = 2, from [m/s2] .3f", "to [m/s2] .3f", "n = 4, from [m/s2] .3f", "to [m/s2] .3f",
        "published"), tuple(
        (hours, two.lower, two.upper, four.lower, four.upper,
         "shaded" if printed_shaded_hours[0] <= hours <= printed_shaded_hours[1] else "not shaded")
        for hours, two, four in zones))
    eight = caution_zone(8.0, 4)
    upper, lower = (dose_per_rms * bound * (8.0 * S_PER_HOUR) ** 0.25 for bound in (eight.upper, eight.lower))
    fine = np.geomspace(1 / 60, 24, 2000)
    apart = np.array([caution_zone(hour, 2).lower / caution_zone(hour, 4).lower for hour in fine.tolist()])
    crossing = float(fine[np.abs(np.log(apart)).argmin()])
    values = (Value("dose of the upper line, n = 4 [m/s^1.75]", 8.5, upper, 0.01, Word.MISPRINT),
              Value("dose of the lower line, n = 4 [m/s^1.75]", 17.0, lower, 0.01, Word.MISPRINT),
              Value("where the lines cross: middle of the shaded hours", 6.0, crossing, 2.0))
    verdict = ("The text swaps the doses: 17 belongs to the upper line, 8.5 to the lower. The lines of constant a^2 t "
               f"and constant a^4 t cross at {crossing:.1f} hours and lie within "
               f"{100 * np.abs(np.log(apart[(fine >= 4) & (fine <= 8)])).max():.0f} % of each other from 4 to 8 hours, "
               "which is where the published figure is shaded; at 10 minutes those of n = 2 are "
               f"{apart[np.searchsorted(fine, 1 / 6)]:.1f} times as high.")
    hours = np.geomspace(1 / 60, 24, 60)
    lines = tuple(Line(f"n = {exponent}, {bound}", hours, np.array([
        getattr(caution_zone(hour, exponent), bound) for hour in hours.tolist()]))
                  for exponent in (2, 4) for bound in ("lower", "upper"))
    picture = Picture(Curves("The caution zone", "hours a day", "weighted r.m.s. [m/s2]", lines, log_x=True,
                             log_y=True),
                      "two dashed lines for n = 2 and two dotted ones for n = 4, shaded between 4 and 8 hours")
    return Result((table,), verdict, (picture,), values)

STUDIES = (table_2_2, table_2_3, fig_2_7, table_2_7, fig_2_13, fig_2_18, fig_2_20)
