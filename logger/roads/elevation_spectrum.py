"""The spectrum of a measured profile, its degree of roughness, waviness and class (ISO 8608), and the IRI that it
means.

A road's spectrum falls so steeply that the plain method lies: a window leaks the long waves into the short ones, and a
hill outweighs everything. And the bare spectrum is so ragged that no line through it can be seen (Fig 2.7, 2.9).

- Here the spectrum of the *slope* is taken, which is nearly level, and divided by the exact response of the
  difference between samples. Segments half over each other that cover the road evenly, each freed of its mean slope
  (which is to detrend the elevation), under a Hann window, averaged.
- It is averaged in bands (Eq 2.4 to 2.6): octaves up to a centre of 0.0312 cycles per metre, third octaves up to 0.25,
  twelfth octaves above. Their edges are powers of 2^(1/12): 2^-6.5 = 0.011 and 2^1.5 = 2.83 are among them.
- A straight line through the logarithms between 0.011 and 2.83 gives the degree of roughness Gd(n0) at 0.1 cycle per
  metre and the waviness (Eq 2.1). Each octave weighs the same, however many bands it has; the logarithm of a chancy
  value is low on the average, which is allowed for. Standard errors say what the length of the road leaves to
  chance, and more where the spectrum strays from a line by more than chance.

What is left out: waves above a quarter of the sampling rate, where shorter ones pose as longer ones (from 1 cycle per
metre on at a spacing of 0.25 m), and waves longer than two thirds of a segment, which detrending touches.

From degree of roughness to IRI and back, with the spread that a road's length leaves (4.3.4 of Blum 2015).

The dissertation drives the IRI's car over 400 random roads and lays a line through the results: IRI = 0.5386 Gd^0.5
(Eq 4.37 to 4.40). That number is the average of long roads of waviness 2; a road of 100 m may be 10 % off it, a road of
another waviness twice as much. Here the relation is computed instead.

The suspension's slope s of the IRI's car on a random road is a Gaussian process with the spectrum

    S(n) = |H(n)|^2 (2 pi n)^2 Gd(n),   n from 0.011 to 2.83 cycle/m,

and the IRI is the mean of |s| over the road. Its expectation is sqrt(2 / pi) times the standard deviation of s. Two
values of |s| whose slopes have the correlation rho are correlated themselves: their covariance, in units of the mean
squared, is sqrt(1 - rho^2) + rho asin(rho) - 1. Its integral along the road is how much the IRI spreads.
"""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from logger.arrays import Array
from logger.roads.iri import check_spacing, iri, slope_gain
from logger.roads.iso8608 import (
    CLASS_GD_N0_CM3,
    CM3_M3,
    HIGHEST_CPM,
    LOWEST_CPM,
    REFERENCE_N0_CPM,
    STANDARD_WAVINESS,
    displacement_psd,
    road_class,
)


@dataclass(frozen=True)
class Spectrum:
    """One-sided displacement spectrum of a profile.

    psd_m3         (b,) at wave numbers step, 2 step ... [m3, that is m2 per cycle/m]
    step_cpm       resolution Be [cycle/m]
    chance_m       length of road that counts: a band of width B has a relative variance of 1 / (B chance_m)
    """

    psd_m3: Array
    step_cpm: float
    chance_m: float

    @property
    def wave_number_cpm(self) -> Array:
        """(b,) [cycle/m]."""
        return self.step_cpm * np.arange(1.0, len(self.psd_m3) + 1)


@dataclass(frozen=True)
class BandedSpectrum:
    """A spectrum averaged in bands: edges (b + 1,) [cycle/m], values (b,), degrees of freedom (b,) of each value."""

    edges_cpm: Array
    psd_m3: Array
    freedom: Array

    @property
    def centre_cpm(self) -> Array:
        """Geometric middle of each band [cycle/m]."""
        return np.sqrt(self.edges_cpm[1:] * self.edges_cpm[:-1])


@dataclass(frozen=True)
class Roughness:
    """A straight line through a spectrum (Eq 2.1), and the class it means.

    classes                    every class that lies within two standard errors of the degree of roughness
    lowest_cpm, highest_cpm    between which wave numbers the line was laid [cycle/m]
    bands                      through which it was laid
    """

    gd_n0_cm3: float
    gd_n0_std_cm3: float
    waviness: float
    waviness_std: float
    road_class: str
    classes: tuple[str, ...]
    lowest_cpm: float
    highest_cpm: float
    bands: BandedSpectrum = field(repr=False, compare=False)


def spectrum(elevation_m: npt.ArrayLike, spacing_m: float) -> Spectrum:
    """The displacement spectrum of a profile.

    elevation_m    (n,) at uniform spacing [m]

    Segments are at least 364 m and there are at most 15 of them; a road of less than 546 m is one segment.
    ValueError unless there are at least 16 elevations, all of them on Earth.
    """
    highest_m = 1e4
    segment_m = 4 / LOWEST_CPM  # four steps of wave number in the longest octave
    most_halves = 16  # a longer road gets longer segments instead of more: its longest waves show more sharply
    elevation = np.asarray(elevation_m, dtype=float)
    if elevation.ndim != 1 or len(elevation) < 16 or not (np.abs(elevation) < highest_m).all():
        raise ValueError(f"expected a row of at least 16 finite elevations below {highest_m:g} m")
    slope = np.diff(elevation) / spacing_m
    halves = min(max(2, int(len(slope) * spacing_m / segment_m * 2)), most_halves)
    hop = len(slope) // halves
    size = 2 * hop
    window = 0.5 - 0.5 * np.cos(2 * np.pi * np.arange(size) / size)

    power = np.zeros(hop + 1)
    weight = np.zeros(halves * hop)
    for start in range(0, (halves - 1) * hop, hop):
        piece = slope[start:start + size]
        power += np.abs(np.fft.rfft((piece - piece.mean()) * window)) ** 2
        weight[start:start + size] += window**2
    slope_psd = 2 * spacing_m * power[1:] / weight.sum()

    step_cpm = 1 / (size * spacing_m)
    difference = 2 * np.sin(np.pi * step_cpm * spacing_m * np.arange(1, hop + 1)) / spacing_m
    chance_m = spacing_m * weight.sum() ** 2 / (weight @ weight)
    return Spectrum(slope_psd / difference**2, step_cpm, float(chance_m))


def band_edges(lowest_cpm: float, highest_cpm: float) -> Array:
    """Edges of the smoothing bands of ISO 8608 that lie whole between two wave numbers [cycle/m]; (b + 1,)."""
    last_octave_edge = -4.5  # exponents of 2: the octave centred at 2^-5 ends here, and
    last_third_edge = -4.5 + 8 / 3  # the third octave centred at 2^-2 here
    exponents = np.concatenate([
        np.arange(last_octave_edge - 8, last_octave_edge),
        last_octave_edge + np.arange(8) / 3,
        last_third_edge + np.arange(12 * 12) / 12,
    ])
    edges = 2.0**exponents
    return edges[(edges >= lowest_cpm) & (edges <= highest_cpm)]


def smooth(of: Spectrum, edges_cpm: Array) -> BandedSpectrum:
    """Averages between neighbouring edges (Eq 2.4 to 2.6).

    Each value of the spectrum stands for the step of wave number around it, and a band takes the part of a step that
    lies in it: Eq 2.4 for a band that reaches over several steps, and as it should be for one inside a single step,
    where the printed sum goes wrong. ValueError if an edge lies outside the spectrum.
    """
    steps_per_window = 0.9  # how much wider a Hann window makes a band look, in steps of wave number
    borders = of.step_cpm * (np.arange(len(of.psd_m3) + 1) + 0.5)
    if edges_cpm[0] < borders[0] or edges_cpm[-1] > borders[-1]:
        raise ValueError(f"expected band edges within {borders[0]:.4g} ... {borders[-1]:.4g} cycle/m")
    below = np.concatenate([[0.0], np.cumsum(of.psd_m3) * of.step_cpm])
    width_cpm = np.diff(edges_cpm)
    psd_m3 = np.diff(np.interp(edges_cpm, borders, below)) / width_cpm
    return BandedSpectrum(edges_cpm, psd_m3, 2 * of.chance_m * (width_cpm + steps_per_window * of.step_cpm))


def classify(elevation_m: npt.ArrayLike, spacing_m: float, widest_step_m: float | None = None) -> Roughness:
    """Degree of roughness, waviness and class of a profile.

    elevation_m      (n,) at uniform spacing [m]
    widest_step_m    for a profile that was resampled: the widest distance it had between samples [m]; waves shorter
                     than four of those are left out

    ValueError for a profile below 100 m, which is too short; with samples more than 300 mm apart; not finite;
    or without any roughness.
    """
    shortest_m = 100.0
    clear_of_trend = 1.5  # in steps of wave number: the mean slope takes a part of the first one only
    clear_of_aliases = 0.25
    elevation = np.asarray(elevation_m, dtype=float)
    length_m = (elevation.size - 1) * spacing_m
    if length_m < shortest_m * (1 - 1e-9):
        raise ValueError(f"too short to classify: expected at least {shortest_m:g} m, found {length_m:.4g} m")
    check_spacing(spacing_m)
    measured_m = max(spacing_m, widest_step_m or 0.0)
    of = spectrum(elevation, spacing_m)
    edges = band_edges(max(LOWEST_CPM, clear_of_trend * of.step_cpm), min(HIGHEST_CPM, clear_of_aliases / measured_m))
    if not len(edges) or edges[-1] < 4 * REFERENCE_N0_CPM:
        raise ValueError(f"expected samples at most {clear_of_aliases / REFERENCE_N0_CPM / 4:g} m apart, "
                         f"found a step of {measured_m:.4g} m")
    return straight_line(of, edges)


def straight_line(of: Spectrum, edges_cpm: Array) -> Roughness:
    """Lay the line of Eq 2.1 through the bands of a spectrum, at least three.

    ValueError if there is a band without any roughness in it.
    """
    two_sigma = 2.0
    bands = smooth(of, edges_cpm)
    if not (bands.psd_m3 > 0).all():
        raise ValueError("expected a road with some roughness at every wavelength; this one is perfectly smooth")

    # A mean of nu squares has, in logarithms, the mean -1/nu - 1/(3 nu^2) and the variance 2/nu + 2/nu^2.
    nu = bands.freedom
    level = np.log(bands.psd_m3 / CM3_M3) + 1 / nu + 1 / (3 * nu**2)
    terms = np.column_stack([np.ones(len(nu)), -np.log(bands.centre_cpm / REFERENCE_N0_CPM)])
    octaves = np.diff(np.log2(bands.edges_cpm))
    solve = np.linalg.solve(terms.T @ (octaves[:, None] * terms), terms.T * octaves)
    log_gd, waviness = solve @ level

    # Neighbouring bands share a window's width, so over all of them each brings only its own width of chance.
    variance = (solve**2) @ (1 / (of.chance_m * np.diff(bands.edges_cpm)))
    stray = np.sum((level - terms @ [log_gd, waviness]) ** 2 / (2 / nu + 2 / nu**2)) / (len(nu) - 2)
    log_std, waviness_std = np.sqrt(variance * max(1.0, stray))

    ends = [road_class(float(np.exp(log_gd + sigma * log_std))) for sigma in (-two_sigma, two_sigma)]
    letters = "".join(CLASS_GD_N0_CM3)
    gd_n0_cm3 = float(np.exp(log_gd))
    return Roughness(gd_n0_cm3=gd_n0_cm3, gd_n0_std_cm3=gd_n0_cm3 * float(log_std), waviness=float(waviness),
                     waviness_std=float(waviness_std), road_class=road_class(gd_n0_cm3),
                     classes=tuple(letters[letters.index(ends[0]):letters.index(ends[1]) + 1]),
                     lowest_cpm=float(bands.edges_cpm[0]), highest_cpm=float(bands.edges_cpm[-1]), bands=bands)


_STEP_CPM = 1 / 2048


@dataclass(frozen=True)
class Expected:
    """A value and its standard deviation from one stretch of road to the next."""

    value: float
    std: float


def iri_per_root_gd(waviness: float = STANDARD_WAVINESS) -> float:
    """Expected IRI of a road with Gd(n0) = 1 cm3 [m/km]; IRI grows with the root of Gd. For a waviness of 2: 0.543."""
    return float(1000 * np.sqrt(2 / np.pi * np.sum(_slope_spectrum(waviness)) * _STEP_CPM))


def relative_spread(length_m: float, waviness: float = STANDARD_WAVINESS) -> float:
    """Standard deviation over mean of the IRI of stretches of this length [m] of one and the same random road."""
    lag_m = 1 / 8
    lags = 4096  # to 512 m, when the car remembers nothing
    likeness = np.fft.irfft(_slope_spectrum(waviness), round(1 / (_STEP_CPM * lag_m)))[:lags]
    rho = np.clip(likeness / likeness[0], -1, 1)
    covariance = np.sqrt(1 - rho**2) + rho * np.arcsin(rho) - 1
    covariance[0] /= 2
    within = np.maximum(1 - lag_m * np.arange(lags) / length_m, 0)
    return float(np.sqrt(2 / length_m * lag_m * (covariance @ within)))


def iri_of_road(gd_n0_cm3: float, length_m: float, waviness: float = STANDARD_WAVINESS) -> Expected:
    """IRI [m/km] to expect of a stretch of this length [m] of a road with this degree of roughness [cm3]."""
    iri_m_per_km = iri_per_root_gd(waviness) * gd_n0_cm3**0.5
    return Expected(iri_m_per_km, iri_m_per_km * relative_spread(length_m, waviness))


def gd_of_road(iri_m_per_km: float, length_m: float, waviness: float = STANDARD_WAVINESS) -> Expected:
    """Degree of roughness [cm3] of the road that a stretch of this length [m] and IRI [m/km] was cut from.

    Gd goes with the square of the IRI, so it spreads twice as much.
    """
    gd_n0_cm3 = (iri_m_per_km / iri_per_root_gd(waviness)) ** 2
    return Expected(gd_n0_cm3, gd_n0_cm3 * 2 * relative_spread(length_m, waviness))


def _slope_spectrum(waviness: float) -> Array:
    """S(n) for Gd(n0) = 1 cm3 at 0, step, 2 step ... [1 per cycle/m]."""
    wave_number = _STEP_CPM * np.arange(int(HIGHEST_CPM / _STEP_CPM) + 1)
    heard = np.zeros(len(wave_number))
    on_road = wave_number >= LOWEST_CPM
    n = wave_number[on_road]
    heard[on_road] = (slope_gain(n) * 2 * np.pi * n) ** 2 * displacement_psd(n, 1.0, waviness)
    return heard


@dataclass(frozen=True)
class TrackClass:
    """One wheel track: its spectrum's line, its IRI [m/km], and the IRI that roads with such a line have."""

    roughness: Roughness
    iri_m_per_km: float
    expected: Expected


def track_class(elevation_m: Array, spacing_m: float, widest_step_m: float | None = None) -> TrackClass:
    """Classify a track (n,). Arguments and ValueError as in ``logger.roads.elevation_spectrum.classify``."""
    roughness = classify(elevation_m, spacing_m, widest_step_m)
    expected = iri_of_road(roughness.gd_n0_cm3, (len(elevation_m) - 1) * spacing_m, roughness.waviness)
    return TrackClass(roughness, iri(elevation_m, spacing_m), expected)
