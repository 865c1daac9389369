"""Table 5.5: resonances of the car on four surfaces, from summed Fourier transforms (5.5.1)."""

import numpy as np

from logger.modal.spectral_peaks import summed_spectrum
from logger.studies.drives import PS_2119, RATE_HZ, bump, record_of
from logger.studies.study import Cell, Column, Effort, Result, Study, Table, Word
from logger.units import STANDARD_GRAVITY_MPS2

PRINTED = (("newly paved road", 40.2, 0.2017, 2.51, 13.57), ("rough road", 40.2, 0.8899, 1.01, 12.82),
           ("damaged pavement", 32.2, 0.8437, 2.01, 12.06), ("speed bumps", 16.1, 0.8703, 1.51, 12.56))
ASSUMED_IRI = (1.5, 8.0, 8.0, 2.0)
PRINTED_MODEL_HZ = (1.1, 11.0)
_SECONDS, _SEGMENT_S = 60.0, 2.0
_BANDS_HZ = ((0.5, 5.0), (7.0, 18.0))
_BUMPS_AT_M = (20.0, 70.0, 120.0, 170.0)


def run(effort: Effort) -> Result:
    """As ``Study.run``."""
    rows = tuple(_row(printed, iri, seed) for seed, (printed, iri) in
                 enumerate(effort.each(list(zip(PRINTED, ASSUMED_IRI, strict=True)))))
    table = Table("Response on four surfaces", (
        Column("surface"), Column("speed [km/h]", ".1f"), Column("IRI assumed [m/km]", ".1f"),
        Column("printed, largest [g]", ".4f"), Column("ours [g]", ".4f"), Column("printed f1 [Hz]", ".2f"),
        Column("ours [Hz]", ".2f"), Column("printed f2 [Hz]", ".2f"), Column("ours [Hz]", ".2f")), rows)
    verdict = ("Of one kind only: the body swings at 1 to 2.5 Hz, and there is a second, broad hump. Segments of 2 s "
               "have bins 0.5 Hz apart and the printed values are multiples of nearly that, so no figure tells more. "
               "The measured peaks are two to five times the model's and f2 lies above its 11 Hz on every surface; "
               "the sensor sat on the console, whose own vibration the source later cuts off with a low-pass (6.5), "
               "and which Table 4.2 does not have. The roads' roughness is not told and was chosen.")
    return Result((table,), verdict)


def _row(printed: tuple[str, float, float, float, float], iri: float, seed: int) -> tuple[Cell, ...]:
    surface, kmh, largest_g, f1_hz, f2_hz = printed
    conditions = PS_2119.on(iri, seed)
    accel = record_of(_bumps if surface == "speed bumps" else _flat, kmh / 3.6, _SECONDS, conditions).measured_mps2
    segments = int(len(accel) / RATE_HZ / _SEGMENT_S)
    spectrum = summed_spectrum(accel[:, None], RATE_HZ, segments)
    power = spectrum.power.mean(axis=0)
    f_hz = spectrum.step_hz * np.arange(len(power))
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
              covers=("Table 5.5",), word=Word.NOT_REPRODUCIBLE,
              because="The records were never published; a simulated car shows peaks of the same kind.")
