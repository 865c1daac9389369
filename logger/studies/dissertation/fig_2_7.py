"""Fig 2.6 to 2.9: a smooth and a rough road, their spectra, and the spectra smoothed (2.2.1)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.roads.elevation_spectrum import band_edges, classify, smooth, spectrum
from logger.roads.iso8608 import CLASS_GD_N0_CM3, displacement_psd, generate
from logger.studies.checks import Statement, Value, Word, about
from logger.studies.study import Cell, Column, Effort, Picture, Result, Study, Table, alike

CLASSES = ("B", "D")
PROFILES, SPECTRA = {"B": "Fig 2.6", "D": "Fig 2.8"}, {"B": "Fig 2.7", "D": "Fig 2.9"}
_LENGTH_M, _SPACING_M, _SEED = 1000.0, 0.05, 0
_SHOWN_M = 100.0
_BANDS_CPM = (0.011, 2.0)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    rows: list[tuple[Cell, ...]] = []
    lines, roads, scatters, levels = [], [], [], []
    values: list[Value | Statement] = []
    for name in effort.each(CLASSES):
        gd = CLASS_GD_N0_CM3[name]
        road = generate(gd, _LENGTH_M, _SPACING_M, _SEED)
        raw, found = spectrum(road, _SPACING_M), classify(road, _SPACING_M)
        bands = smooth(raw, band_edges(max(_BANDS_CPM[0], 1.5 * raw.step_cpm), _BANDS_CPM[1]))
        n = raw.wave_number_cpm
        inside = (n > bands.edges_cpm[0]) & (n < bands.edges_cpm[-1])
        scatter = [float(np.std(10 * np.log10(level / displacement_psd(at, gd))))
                   for level, at in ((raw.psd_m3[inside], n[inside]), (bands.psd_m3, bands.centre_cpm))]
        rows.append((name, found.road_class, gd, found.gd_n0_cm3, found.waviness, *scatter))
        scatters.append(scatter)
        values += about((PROFILES[name], SPECTRA[name]), [
            Value(f"class {name} road, Gd(n0) [cm3]", gd, found.gd_n0_cm3, gd / 2)])
        values += about(SPECTRA[name], [
            Value(f"class {name} road, waviness", 2.0, found.waviness, 0.15)])
        values += about(SPECTRA[name], [
            Statement(f"class {name}: scatter of the smoothed over that of the raw spectrum", "smoothed, it is easier "
                      "to put into a class", scatter[1] / scatter[0], most=0.5)])
        levels.append(bands.psd_m3)
        thin = slice(None, None, 4)
        lines += [Line(f"{name}, raw", n[inside][thin], raw.psd_m3[inside][thin]),
                  Line(f"{name}, smoothed", bands.centre_cpm, bands.psd_m3)]
        shown = np.arange(0, _SHOWN_M, 0.25)
        roads.append(Line(f"class {name}", shown, 1000 * np.interp(shown, _SPACING_M * np.arange(len(road)), road)))
    values += about(tuple(SPECTRA.values()), [Statement(
        "least of all bands' ratios of the spectra, class D over class B", "shifted upward at all wave numbers",
        float((levels[1] / levels[0]).min()), least=1.0)])
    table = Table("Two roads, classified from their elevations", (
        Column("printed class"), Column("our class"), Column("its mean Gd(n0) [cm3]", ".0f"),
        Column("Gd(n0) found [cm3]", ".1f"), Column("waviness found", ".3f"),
        Column("scatter of the raw spectrum [dB]", ".1f"), Column("of the smoothed [dB]", ".2f")), tuple(rows))
    verdict = ("As the text says of the printed pictures, the rough road's spectrum is that of the smooth one shifted "
               "upward at all wave numbers, both fall towards short waves, the raw spectra are ragged, and smoothed "
               f"over the bands of Eq 2.4 to 2.6 they scatter by {scatters[0][1]:.1f} dB in place of "
               f"{scatters[0][0]:.1f}. The text says that the bands are listed in ISO 2631-1; they are in ISO 8608. "
               "The printed phases are not known, so the roads are alike in their statistics only.")
    pictures = (Picture(Curves("The first 100 m of a smooth and a rough road (Fig 2.6, 2.8)", "distance [m]",
                               "elevation [mm]", tuple(roads)),
                        "a picture each: a simulated smooth profile, and a rough one"),
                Picture(Curves("Their spectra (Fig 2.7, 2.9)", "wave number [cycle/m]", "displacement spectrum [m3]",
                               tuple(lines), log_x=True, log_y=True),
                        "a picture each, raw and smoothed: falling towards short waves, the rough road's shifted "
                        "upward at all wave numbers"))
    return Result((table,), verdict, pictures, tuple(values))


STUDY = Study("fig_2_7", "Spectra of a smooth and a rough road, raw and smoothed", "Fig 2.7, section 2.2.1",
              "Random roads of 1 km at the geometric means of classes B and D, as the captions have them.", run,
              items=(*alike(PROFILES.values(), Word.AGREES,
                            "A road made for the caption's class is found to be of it."),
                     *alike(SPECTRA.values(), Word.AGREES,
                            "The spectra fall, shift and smooth as the text describes.")))
