"""The IRI of a whole profile of one or two wheel tracks, and of its windows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from logger.roads.iri import PER_KM, IriWindow, IriWindows, rectified_slope

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ProfileIri:
    """IRI [m/km] by name, each (1 + w,): of the whole profile, then of its windows.

    Of one track ``iri_m_per_km``; of two that of the left one, ``iri_right_m_per_km``, and of both together
    ``mri_m_per_km`` and ``hri_m_per_km``. The windows' distances are from the first sample on.
    """

    windows: tuple[IriWindow, ...]
    columns: dict[str, Array]

    def row(self, number: int) -> dict[str, float]:
        """One value of each name: 0 is the whole, 1 the first window."""
        return {name: float(column[number]) for name, column in self.columns.items()}


def profile_iri(elevation_m: Array, elevation_right_m: Array | None, spacing_m: float, window_m: float) -> ProfileIri:
    """IRI of each track (n,), and MRI and HRI of two. ValueError as in ``logger.roads.iri``."""
    left, windows = _track(elevation_m, spacing_m, window_m)
    columns = {"iri_m_per_km": left}
    if elevation_right_m is not None:
        right, _ = _track(elevation_right_m, spacing_m, window_m)
        half_car, _ = _track((elevation_m + elevation_right_m) / 2, spacing_m, window_m)
        columns |= {"iri_right_m_per_km": right, "mri_m_per_km": (left + right) / 2, "hri_m_per_km": half_car}
    return ProfileIri(tuple(windows), columns)


def continuous_iri(elevation_m: Array, elevation_right_m: Array | None, spacing_m: float, base_m: float
                   ) -> tuple[Array, Array]:
    """The moving IRI over a base length, of two tracks their mean (AASHTO R 54: 25 ft): middles of the bases (k,) from
    the first sample on [m], and values (k,) [m/km]. A profile that is shorter has one base, all of it."""
    slopes = [rectified_slope(track, spacing_m) for track in (elevation_m, elevation_right_m) if track is not None]
    slope: Array = np.asarray(np.mean(slopes, axis=0))
    length = min(max(round(base_m / spacing_m), 1), len(slope))
    sums = np.concatenate([[0.0], np.cumsum(slope)])
    values: Array = PER_KM * (sums[length:] - sums[:-length]) / length
    return np.asarray(spacing_m * (np.arange(len(values)) + length / 2)), values


def _track(elevation_m: Array, spacing_m: float, window_m: float) -> tuple[Array, list[IriWindow]]:
    cutter = IriWindows(spacing_m, window_m)
    slope = rectified_slope(elevation_m, spacing_m)
    windows = cutter.push(slope) + cutter.finish()
    return np.array([PER_KM * slope.mean(), *(window.iri_m_per_km for window in windows)]), windows
