"""Random roads of ISO 8608: a displacement spectrum Gd(n) = Gd(n0) (n / n0)^-w, and elevations that have it.

A sum of cosines at equal steps of wave number (Eq 4.1 and 4.2 of Blum 2015) repeats after one over the step, so a
long road made of a fixed number of them is one short road over and over. Here the step is chosen for the road: its
period is longer than the road by at least the longest wave, and the sum is taken by a Fourier transform. The period
of a short road is ten and a half of the longest waves all the same, so that ten steps make an octave there and the
first begins at 0.011 cycles per metre; with a few wide steps the longest waves would be a tenth too high or too low.
In Eq 4.1 the wave number is in cycles per metre, so its argument needs 2 pi; phases are uniform.

The amplitudes are those of Eq 4.2 to the last bit, so a generated road has the roughness it was made for with less
chance in it than as long a stretch of a real road has: over a whole period there is none. To see how much stretches
differ, cut them out of a road many times longer.
"""

import numpy as np
import numpy.typing as npt

from logger.arrays import Array

REFERENCE_N0_CPM = 0.1
LOWEST_CPM = 0.011
HIGHEST_CPM = 2.83
CM3_M3 = 1e-6
STANDARD_WAVINESS = 2.0

# Geometric mean degree of roughness of each class [cm3] (ISO 8608; Table 2.2 of Blum 2015).
CLASS_GD_N0_CM3 = dict(zip("ABCDEFGH", (16.0 * 4.0**index for index in range(8)), strict=True))


IRI_PER_ROOT_GD = 0.5386


def gd_n0_from_iri(iri_m_per_km: float) -> float:
    """Degree of roughness Gd(n0) [cm3] of a random road with this IRI [m/km] (Eq 4.40)."""
    return (iri_m_per_km / IRI_PER_ROOT_GD) ** 2


def iri_from_gd_n0(gd_n0_cm3: float) -> float:
    """IRI [m/km] of a random road with this degree of roughness [cm3] (Eq 4.39)."""
    return IRI_PER_ROOT_GD * gd_n0_cm3**0.5


def road_class(gd_n0_cm3: float) -> str:
    """Class A to H of a degree of roughness [cm3] (Table 2.2); a limit belongs to the rougher class."""
    letter = "A"
    for rougher, geometric_mean in CLASS_GD_N0_CM3.items():
        if gd_n0_cm3 >= geometric_mean / 2:
            letter = rougher
    return letter


def iri_class(iri_m_per_km: float) -> str:
    """ISO 8608 letter of a road with this IRI [m/km], after Table 4.3; a limit belongs to the rougher class."""
    # Lower limits of IRI [m/km] of classes B to E (Table 4.3), then doubling as the degree of roughness quadruples.
    class_limits_iri = ((3.05, "B"), (6.09, "C"), (12.19, "D"), (24.37, "E"), (48.74, "F"), (97.48, "G"), (194.96, "H"))
    letter = "A"
    for limit, rougher in class_limits_iri:
        if iri_m_per_km >= limit:
            letter = rougher
    return letter


def displacement_psd(wave_number_cpm: npt.ArrayLike, gd_n0_cm3: float, waviness: float = STANDARD_WAVINESS) -> Array:
    """Displacement spectrum Gd(n) [m3] at wave numbers in cycles per metre (Eq 2.1)."""
    return gd_n0_cm3 * CM3_M3 * (np.asarray(wave_number_cpm, dtype=float) / REFERENCE_N0_CPM) ** -waviness


def generate(gd_n0_cm3: float, length_m: float, spacing_m: float, seed: int,
             waviness: float = STANDARD_WAVINESS) -> Array:
    """Elevations [m] of a random road at 0, spacing, 2 spacing ... up to its length; one seed is one road.

    Eq 4.1 and 4.2 over 0.011 to 2.83 cycles per metre. Gd(n0) in cm3: one of ``CLASS_GD_N0_CM3``, or by
    ``gd_n0_from_iri``. The samples are exact for any spacing: waves shorter than two samples are in them, aliased, as
    in any profile that is read off a real road at points. One seed gives the same phases whatever the roughness and
    the waviness.
    """
    least_period_m = 10.5 / LOWEST_CPM
    count = int(np.floor(length_m / spacing_m + 1e-9)) + 1
    finer = int(np.ceil(2 * HIGHEST_CPM * spacing_m * 1.001))
    period = int(np.ceil(max(count * spacing_m + 1 / LOWEST_CPM, least_period_m) / spacing_m)) * finer
    step_cpm = finer / (period * spacing_m)
    harmonic = np.arange(int(np.ceil(LOWEST_CPM / step_cpm)), int(HIGHEST_CPM / step_cpm) + 1)
    amplitude = np.sqrt(2 * step_cpm * displacement_psd(harmonic * step_cpm, gd_n0_cm3, waviness))
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(harmonic))
    spectrum = np.zeros(period // 2 + 1, dtype=complex)
    spectrum[harmonic] = 0.5 * period * amplitude * np.exp(-1j * phase)
    return np.fft.irfft(spectrum, period)[: count * finer: finer]
