"""Table 5.5 and Fig 5.12 to 5.19: resonances of the car on four surfaces, from summed Fourier transforms (5.5.1)."""

import numpy as np

from logger.chart_data import Curves, Line
from logger.modal.spectral_peaks import summed_spectrum
from logger.studies.checks import Check, Statement, Value, Word, about
from logger.studies.drives import PS_2119, RATE_HZ, Array, bump, rav4, record_of
from logger.studies.study import Cell, Column, Effort, Item, Picture, Result, Study, Table, alike
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.models import structure_of
from logger.vehicle.modes import undamped_frequencies_hz

PRINTED = (("newly paved road", 40.2, 0.2017, 2.51, 13.57), ("rough road", 40.2, 0.8899, 1.01, 12.82),
           ("damaged pavement", 32.2, 0.8437, 2.01, 12.06), ("speed bumps", 16.1, 0.8703, 1.51, 12.56))
ASSUMED_IRI = (1.5, 8.0, 8.0, 2.0)
PRINTED_MODEL_HZ = (1.1, 11.0)
RESPONSES = tuple(f"Fig 5.{number}" for number in (13, 15, 17, 19))
"""Of the same surfaces; the figures between them are photographs."""
F1_TOLERANCE_HZ, F2_TOLERANCE_HZ = 1.6, 3.5
"""The humps are that broad, and the car that was measured is not the one of Table 4.2."""
_SECONDS, _SEGMENT_S, _SHOWN = 60.0, 2.0, 2000
_BANDS_HZ = ((0.5, 5.0), (7.0, 18.0))
_BUMPS_AT_M = (20.0, 70.0, 120.0, 170.0)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    cases = list(zip(PRINTED, ASSUMED_IRI, strict=True))
    records = [_record(*printed[:2], iri, seed) for seed, (printed, iri) in enumerate(effort.each(cases))]
    rows = tuple(_row(printed, iri, accel) for (printed, iri), accel in zip(cases, records, strict=True))
    body_hz, *_, wheels_hz = undamped_frequencies_hz(structure_of(rav4())).tolist()
    values: tuple[Check, ...] = (
        *(one for figure, printed, row in zip(RESPONSES, PRINTED, rows, strict=True)
          for one in about(("Table 5.5", figure), [
              Value(f"{printed[0]}: f1 [Hz]", printed[3], float(str(row[6])), F1_TOLERANCE_HZ, Word.NOT_REPRODUCIBLE),
              *([Value(f"{printed[0]}: f2 [Hz]", printed[4], float(str(row[8])), F2_TOLERANCE_HZ,
                       Word.NOT_REPRODUCIBLE)] if printed[0] != "speed bumps" else [])])),
        *about("5.5.1 model", [Value("the model's body [Hz]", PRINTED_MODEL_HZ[0], body_hz, 0.05),
                               Value("the model's wheels [Hz]", PRINTED_MODEL_HZ[1], wheels_hz, 0.05)]),
        *(one for figure, row in list(zip(RESPONSES, rows, strict=True))[1:3] for one in about(figure, [Statement(
            f"{row[0]}: largest response over that of the newly paved road", "small bumps on the new road have little "
            "effect; an uneven one sets the suspension swinging", float(str(row[4])) / float(str(rows[0][4])), 2.0,
            word=Word.NOT_REPRODUCIBLE)])))
    table = Table("Response on four surfaces", (
        Column("surface"), Column("speed [km/h]", ".1f"), Column("IRI assumed [m/km]", ".1f"),
        Column("printed, largest [g]", ".4f"), Column("ours [g]", ".4f"), Column("printed f1 [Hz]", ".2f"),
        Column("ours [Hz]", ".2f"), Column("printed f2 [Hz]", ".2f"), Column("ours [Hz]", ".2f")), rows)
    comb_hz = PRINTED[0][1] / 3.6 / float(structure_of(rav4()).behind_m[-1])
    verdict = ("Of one kind only: the body swings at 1 to 2.5 Hz, and there is a second, broad hump. Segments of 2 s "
               "have bins 0.5 Hz apart and the printed values are multiples of nearly that, so no figure tells more. "
               "The measured peaks are two to five times the model's and f2 lies above its 11 Hz on every surface; "
               "the sensor sat on the console, whose own vibration the source later cuts off with a low-pass (6.5), "
               "and which Table 4.2 does not have. After slow bumps the model's wheels hardly hop, and its second "
               f"hump is the flank of the first. Front and rear wheels cancel each other {comb_hz:.1f} Hz apart at 40 "
               "km/h, so the model's second hump is a comb, of which the highest tooth counts. The roads' roughness "
               "is not given and was chosen.")
    spectra = Picture(Curves("Table 5.5: summed spectra", "frequency [Hz]", "mean power [(m/s2)2]",
                             tuple(Line(printed[0], *_spectrum(accel))
                                   for printed, accel in zip(PRINTED, records, strict=True)), log_y=True),
                      "peaks at 1 to 2.5 Hz and at 12 to 14 Hz, as numbers")
    time_s = np.arange(_SHOWN) / RATE_HZ
    responses = tuple(
        Picture(Curves(f"{figure}: response to {printed[0]}, {printed[1]:g} km/h", "time [s]", "acceleration [g]",
                       (Line("simulated", time_s, accel[:_SHOWN] / STANDARD_GRAVITY_MPS2),)),
                f"the measured one, up to {printed[2]:g} g; the figure before it is a photograph of the road")
        for figure, printed, accel in zip(RESPONSES, PRINTED, records, strict=True))
    return Result((table,), verdict, (spectra, *responses), values)


def _record(surface: str, kmh: float, iri: float, seed: int) -> Array:
    shape = _bumps if surface == "speed bumps" else _flat
    return record_of(shape, kmh / 3.6, _SECONDS, PS_2119.on(iri, seed)).measured_mps2


def _spectrum(accel: Array) -> tuple[Array, Array]:
    """Frequencies [Hz] and power of the even segments of a record, summed; without the mean."""
    powers, step_hz = summed_spectrum(accel[:, None], RATE_HZ, int(len(accel) / RATE_HZ / _SEGMENT_S))
    power = powers.mean(axis=0)
    return np.asarray(step_hz * np.arange(1, len(power)), float), power[1:]


def _row(printed: tuple[str, float, float, float, float], iri: float, accel: Array) -> tuple[Cell, ...]:
    surface, kmh, largest_g, f1_hz, f2_hz = printed
    f_hz, power = _spectrum(accel)
    peaks = [float(f_hz[inside][power[inside].argmax()]) for inside in ((f_hz >= low) & (f_hz <= high)
                                                                       for low, high in _BANDS_HZ)]
    return (surface, kmh, iri, largest_g, float(np.abs(accel).max()) / STANDARD_GRAVITY_MPS2, f1_hz, peaks[0], f2_hz,
            peaks[1])


def _flat(place_m: np.ndarray) -> np.ndarray:
    return np.zeros_like(place_m)


def _bumps(place_m: np.ndarray) -> np.ndarray:
    return np.sum([bump(start_m)(place_m) for start_m in _BUMPS_AT_M], axis=0)


STUDY = Study("table_5_5", "Resonances of the car on four surfaces", "Table 5.5, section 5.5.1",
              "The source measured. Simulated: the car of Table 4.2 for a minute on random roads of a roughness that "
              "was chosen, four bumps of 5.5.2 on the last; a PS-2119; f1 and f2 the highest bins of the summed "
              "spectra of even segments of 2 s within 0.5 to 5 and 7 to 18 Hz.", run,
              items=(Item("Table 5.5", Word.NOT_REPRODUCIBLE,
                          "The records were never published; a simulated car shows peaks of the same kind."),
                     *alike(RESPONSES, Word.NOT_REPRODUCIBLE,
                            "The record was never published; that of a simulated car has its first peak at 1 to 2.5 "
                            "Hz, too."),
                     *alike(("Fig 5.12", "Fig 5.14", "Fig 5.16", "Fig 5.18"), Word.NOT_REPRODUCIBLE,
                            "A photograph of the surface."),
                     Item("5.5.1 model", Word.AGREES, "The half car's natural frequencies are the printed ones.")))
