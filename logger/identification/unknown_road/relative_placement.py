"""Relative placement of two drives over one road: by how much, and at what scale, the distances of one are off."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from logger.identification.unknown_road.drive_operator import Crossing

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

_STEP_M = 0.04
# A scale of distances is looked for by the shifts of parts of a drive, so many metres of stretching each.
_PART_SHIFTS_M, _MOST_SHIFT_M = 0.3, 12.0


def best_placement(
    crossing: Crossing, measured: Array, way_m: Array, response: Complex, wave_number_cpm: Array, waves: Complex,
    white: Array, place_off_m: float, scale_off: float,
) -> tuple[float, float]:
    """Where a drive's places best agree with a road [m], and at what scale of its distances.

    crossing, measured    the drive, its readings (n,) [m/s2] and recorded distances (n,) ``way_m``
    response              (x, k) of the car at its speeds
    waves, white          (k,) at the wave numbers and (1, count): the road, what makes it of innovations and those
    place_off_m           how far places may be off; ``scale_off`` distances beyond that, as a share

    The road is laid out at every shift once; a scale shifts each part of the drive by another one.
    """
    length_m = float(np.ptp(way_m))
    scale_off = min(scale_off, 2 * _MOST_SHIFT_M / length_m)
    most_m = place_off_m + scale_off * length_m / 2
    shifts = np.arange(-np.ceil(most_m / _STEP_M), np.ceil(most_m / _STEP_M) + 1) * _STEP_M
    parts = np.array_split(np.arange(len(way_m)), max(1, int(np.ceil(scale_off * length_m / _PART_SHIFTS_M))))
    like, power = np.empty((2, len(shifts), len(parts)))
    for index, shift in enumerate(shifts):
        shifted = waves * np.exp(2j * np.pi * wave_number_cpm * shift)
        predicted = crossing.readings(crossing.under_axles(white, shifted), response)[0]
        for place, part in enumerate(parts):
            like[index, place] = predicted[part] @ measured[part]
            power[index, place] = predicted[part] @ predicted[part]
    from_middle_m = np.array([way_m[part].mean() for part in parts]) - 0.5 * (way_m.min() + way_m.max())
    best, found_at = -np.inf, (0.0, 1.0)
    steps = int(scale_off * length_m / 2 / (2 * _STEP_M))
    for scale in np.linspace(-scale_off, scale_off, 2 * steps + 1):
        moved = np.rint(scale * from_middle_m / _STEP_M).astype(int)
        off = int(place_off_m / _STEP_M)
        at_shift = len(shifts) // 2 + np.arange(-off, off + 1)[:, None] + moved
        at_shift = np.clip(at_shift, 0, len(shifts) - 1)
        likeness = (np.take_along_axis(like, at_shift, 0).sum(axis=1)
                    / np.sqrt(np.take_along_axis(power, at_shift, 0).sum(axis=1) + 1e-300))
        index = int(likeness.argmax())
        if likeness[index] > best:
            best, found_at = float(likeness[index]), ((index - off) * _STEP_M, 1 + float(scale))
    return found_at
