"""Roads for the examination: random ones after ISO 8608, with what else lies on real roads.

Problem: a product that makes its own roads knows their spectrum and their phases too well.

Solution: a road is white noise through a filter along the road, so that its displacement density is
Gd(n) = Gd(0.1 c/m) * (n / 0.1 c/m)^-w (ISO 8608:2016, eq. 7) down to waves of 90 m. Both tracks share long waves and
have short ones of their own. Bumps, potholes and slab joints are added to both.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.signal import bilinear_zpk, butter, lfilter, sosfilt, sosfreqz, zpk2sos

Array = NDArray[np.float64]

CLASS_GD_M3 = {"A": 16e-6, "B": 64e-6, "C": 256e-6, "D": 1024e-6}  # ISO 8608:2016, table C.2, geometric means
_LONGEST_M, _WARM_M = 90.0, 500.0
_OWN_FROM_PER_M = 0.25  # where the tracks begin to go their own ways, cycles per metre


@dataclass(frozen=True)
class Road:
    """A measured stretch: the two tracks and how they came about."""

    spacing_m: float
    left_m: Array
    right_m: Array
    grade: str
    waviness: float

    @property
    def distance_m(self) -> Array:
        return np.arange(self.left_m.size) * self.spacing_m

    def scaled(self, factor: float) -> Road:
        """The same road, so many times as high."""
        return Road(self.spacing_m, factor * self.left_m, factor * self.right_m, self.grade, self.waviness)

    def blurred(self, width_m: float) -> Road:
        """The road as a profiler with so wide a footprint reports it: a Gaussian of half that standard deviation."""
        left, right = (gaussian_filter1d(track, 0.5 * width_m / self.spacing_m, mode="nearest")
                       for track in (self.left_m, self.right_m))
        return Road(self.spacing_m, left, right, self.grade, self.waviness)

    def with_tracks_apart(self, share: float) -> Road:
        """The right track moved towards the left one, until only ``share`` of the difference remains."""
        right = self.left_m + share * (self.right_m - self.left_m)
        return Road(self.spacing_m, self.left_m, right, self.grade, self.waviness)


def _shaping(waviness: float, level_m3: float, spacing_m: float) -> Array:
    """Second-order sections that turn white noise of variance 1 into a road.

    A leaky sum gives n^-2; pole and zero pairs, eight a decade, bend that to the waviness (Oustaloup et al., IEEE
    Trans. Circuits Syst. I 47, 2000).
    """
    low, high = 0.5 / _LONGEST_M, 0.5 / spacing_m
    pairs = int(np.ceil(8 * np.log10(high / low)))
    corner = 2 * np.pi * np.geomspace(low, high, 2 * pairs + 1)
    bend = (corner[-1] / corner[0]) ** ((waviness - 2) / 4 / pairs)
    zeros, poles, _ = bilinear_zpk(-corner[1::2] * bend, -corner[1::2] / bend, 1.0, 1 / spacing_m)
    leak = np.exp(-2 * np.pi * spacing_m / _LONGEST_M)
    sections = zpk2sos(np.append(zeros, 0.0), np.append(poles, leak), 1.0)
    _, at_tenth = sosfreqz(sections, worN=[0.1], fs=1 / spacing_m)
    sections[0, :3] *= np.sqrt(level_m3 / (2 * spacing_m)) / abs(at_tenth[0])
    return sections


def random_road(
    rng: np.random.Generator, length_m: float, spacing_m: float, grade: str, features: bool,
) -> Road:
    """A road of a class (its level spread over most of the class), with bumps and the like if ``features``."""
    waviness = rng.uniform(1.85, 2.15)
    sections = _shaping(waviness, CLASS_GD_M3[grade] * 10 ** rng.uniform(-0.22, 0.22), spacing_m)
    before, count = round(_WARM_M / spacing_m), int(np.ceil(length_m / spacing_m)) + 1
    waves = sosfilt(sections, rng.standard_normal((3, before + count)))
    # What both tracks share and what each has alone; the powers of the two filters add to one.
    low = butter(1, _OWN_FROM_PER_M, fs=1 / spacing_m)
    high = butter(1, _OWN_FROM_PER_M, "high", fs=1 / spacing_m)
    shared, left, right = lfilter(*low, waves[0]), lfilter(*high, waves[1]), lfilter(*high, waves[2])
    left, right = (shared + left)[before:], (shared + right)[before:]
    if features:
        both = _features(rng, np.arange(count) * spacing_m)
        left, right = left + both, right + both
    return Road(spacing_m, left, right, grade, waviness)


def _features(rng: np.random.Generator, at_m: Array) -> Array:
    """Bumps, potholes or joints, 15 to 80 m apart."""
    height = np.zeros_like(at_m)
    kinds = rng.choice(["bump", "hump", "pothole", "joints"], size=rng.integers(1, 3), replace=False)
    gap_m = rng.uniform(15, 80)
    for kind in kinds:
        place = rng.uniform(10, 40)
        while place < at_m[-1] - 10:
            height += _feature(str(kind), rng, at_m - place)
            place += rng.uniform(5, 9) if kind == "joints" else gap_m * rng.uniform(0.5, 1.5)
    return height


def _feature(kind: str, rng: np.random.Generator, x: Array) -> Array:
    """One of them, beginning at x = 0."""
    if kind == "bump":  # raised cosine
        length = rng.uniform(0.4, 3.0)
        top = rng.uniform(0.015, 0.05) * min(1.0, length)
        return np.where((x > 0) & (x < length), 0.5 * top * (1 - np.cos(2 * np.pi * x / length)), 0.0)
    if kind == "hump":  # ramp, plateau, ramp
        ramp, flat, top = rng.uniform(0.6, 1.5), rng.uniform(1.0, 3.0), rng.uniform(0.03, 0.07)
        return top * np.interp(x, [0, ramp, ramp + flat, 2 * ramp + flat], [0, 1, 1, 0])
    if kind == "pothole":
        edge, flat, depth = rng.uniform(0.1, 0.3), rng.uniform(0.2, 0.8), rng.uniform(0.015, 0.05)
        return -depth * np.interp(x, [0, edge, edge + flat, 2 * edge + flat], [0, 1, 1, 0])
    step = rng.uniform(0.002, 0.006)  # a slab stands higher at its end and the next begins low
    return np.where((x > 0) & (x < 4.5), step * x / 4.5, 0.0)


@njit(cache=True, error_model="numpy")
def wheel_path(road, spacing_m, at_m, speed_mps, patch_m):
    """Elevation [m] and its rate [m/s] at places and speeds, under a tire that averages the road over its patch.

    The road is straight between samples and flat beyond both ends, so that its integral is exact by trapezoids and
    pieces of parabolas: no sampling of the average is involved.
    """
    area = np.zeros(road.size)
    for i in range(1, road.size):
        area[i] = area[i - 1] + 0.5 * spacing_m * (road[i] + road[i - 1])
    height, rate = np.empty(at_m.size), np.empty(at_m.size)
    for i in range(at_m.size):
        if patch_m > 0:
            front, front_area, _ = _look_up(road, area, spacing_m, at_m[i] + 0.5 * patch_m)
            back, back_area, _ = _look_up(road, area, spacing_m, at_m[i] - 0.5 * patch_m)
            height[i] = (front_area - back_area) / patch_m
            rate[i] = (front - back) / patch_m * speed_mps[i]
        else:
            height[i], _, slope = _look_up(road, area, spacing_m, at_m[i])
            rate[i] = slope * speed_mps[i]
    return height, rate


@njit(cache=True, error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
def _look_up(road, area, spacing_m, at_m):
    """Elevation, its integral from the first sample, and slope."""
    place, last = at_m / spacing_m, road.size - 1
    if place < 0:
        return road[0], at_m * road[0], 0.0
    if place >= last:
        return road[last], area[last] + (place - last) * spacing_m * road[last], 0.0
    piece = int(place)
    part, rise = place - piece, road[piece + 1] - road[piece]
    below = area[piece] + spacing_m * part * (road[piece] + 0.5 * part * rise)
    return road[piece] + part * rise, below, rise / spacing_m
