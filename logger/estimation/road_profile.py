"""The road itself, from the pieces that the estimator gives: joined, and cut to the wavelengths that the readings
resolve.

Problem. Neighbouring pieces come from different solutions and may stand at different heights by a slow wave that no
reading tells; joined end to start, their heights would be steps. And an estimate holds waves that are mostly belief.

Solution. Pieces are joined by their increments, which the slow waves hardly touch. Then waves longer than the longest
and shorter than the shortest resolved wavelength are taken out. That range changes with the speed; one range is taken
for the whole drive, the one resolved over at least ``RESOLVED_SHARE`` of the distance at either end. Where a piece is
missing one part of the profile ends and another begins.

A piece says what the sensor's noise leaves of each wavelength, but two more things bound the longest: a wave that
passes more slowly than ``SLOWEST_HZ`` is taken for drift of the sensor (``road_solver``), and beyond ``LONGEST_M`` the
estimator expects no more of a road than at it (``RoadSpectrum``), as roads of ISO 8608 end there too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
import numpy.typing as npt

from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM
from logger.estimation.streaming import RoadPiece

Array = npt.NDArray[np.float64]

RESOLVED_SHARE = 0.75
SLOWEST_HZ = 0.125
LONGEST_M = 1 / FLATTENED_BELOW_CPM
_ORDER = 8
_NEARLY_SPACINGS = 1e-3


@dataclass(frozen=True)
class ProfilePart:
    """Elevations (n,) [m] at ``start_m + k spacing_m``; their mean and all waves out of the range are missing."""

    start_m: float
    spacing_m: float
    elevation_m: Array

    @property
    def length_m(self) -> float:
        """From the first sample to the last [m]."""
        return (len(self.elevation_m) - 1) * self.spacing_m


@dataclass(frozen=True)
class RoadProfile:
    """An estimated road.

    shortest_m, longest_m    the wavelengths that it holds
    parts                    in the order they were driven
    left_out_m               what was driven in parts shorter than the longest wavelength, which are left out
    """

    shortest_m: float
    longest_m: float
    parts: tuple[ProfilePart, ...]
    left_out_m: float


def road_profile(pieces: Sequence[RoadPiece], speed_mps: Array) -> RoadProfile | None:
    """The profile that pieces make, in the order they came; None when the readings resolve no wavelength over enough of
    them.

    speed_mps    (p,) mean speed over each piece [m/s]
    """
    resolved = np.array([isfinite(piece.shortest_m) for piece in pieces], dtype=np.bool_)
    if not resolved.any() or np.mean(resolved) < RESOLVED_SHARE:
        return None
    shortest = np.array([piece.shortest_m for piece in pieces])[resolved]
    longest = np.array([piece.longest_m for piece in pieces])[resolved]
    longest = np.minimum(longest, np.minimum(speed_mps[resolved] / SLOWEST_HZ, LONGEST_M))
    shortest_m = float(np.quantile(shortest, RESOLVED_SHARE))
    longest_m = float(np.quantile(longest, 1 - RESOLVED_SHARE))
    if shortest_m >= longest_m:
        return None
    joined = [_joined(run) for run in _runs([piece for piece in pieces if isfinite(piece.shortest_m)])]
    parts = tuple(
        ProfilePart(part.start_m, part.spacing_m, band_passed(part.elevation_m, part.spacing_m, shortest_m, longest_m))
        for part in joined if part.length_m >= longest_m
    )
    left_out_m = sum(part.length_m for part in joined if part.length_m < longest_m)
    return RoadProfile(shortest_m, longest_m, parts, left_out_m)


def band_passed(elevation_m: Array, spacing_m: float, shortest_m: float, longest_m: float) -> Array:
    """Elevations (n,) with only the waves between two lengths [m], without shift.

    At either length half of a wave's amplitude is left, a factor of 1.5 beyond it 4 %. At both ends the road is gone
    on with as its own image through the end point; within half of the longest wavelength of an end that is felt.
    """
    count = len(elevation_m)
    line = np.linspace(elevation_m[0], elevation_m[-1], count)
    level = elevation_m - line
    waves = np.fft.rfft(np.concatenate([level, -level[-2:0:-1]]))
    n = np.asarray(np.fft.rfftfreq(2 * count - 2, spacing_m), dtype=np.float64)
    high_pass = 1 / (1 + (1 / (longest_m * np.maximum(n, n[1]))) ** _ORDER)
    passed = np.fft.irfft(waves * high_pass / (1 + (n * shortest_m) ** _ORDER), 2 * count - 2)
    return np.asarray(passed[:count])


def _runs(pieces: Sequence[RoadPiece]) -> list[list[RoadPiece]]:
    """Pieces that follow each other without a gap."""
    runs: list[list[RoadPiece]] = []
    end_m = float("nan")
    for piece in pieces:
        if not abs(piece.start_m - end_m) < _NEARLY_SPACINGS * piece.spacing_m:
            runs.append([])
        runs[-1].append(piece)
        end_m = piece.start_m + (len(piece.elevation_m) - 1) * piece.spacing_m
    return runs


def _joined(pieces: Sequence[RoadPiece]) -> ProfilePart:
    rises = np.concatenate([np.diff(piece.elevation_m) for piece in pieces])
    return ProfilePart(pieces[0].start_m, pieces[0].spacing_m, np.concatenate([[0.0], np.cumsum(rises)]))
