"""A car driven over a road, at any speed.

Problem: a model's response has to be right to a ten-thousandth before its difference from a measurement means anything,
and quick, because a fit asks for it hundreds of times. The car's equations are linear and can be stepped without error;
what is hard is the road, whose corners pass under a tire many times within a step, each wheel at a place of its own.

Solution: each wheel's elevation enters a step by its exact mean over the way driven in that step (``TirePath``), with
the slope that the means before and after it give. Corners within a step are neither missed nor folded down to low
frequencies, as they would be if the road were looked at once per step. The steps are then taken in blocks.

``drive`` gives what a recorder writes: the car simulated finely and then band-limited as the recorder does it before it
samples, by a linear-phase filter whose delay is taken out.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil

import numpy as np
import numpy.typing as npt

from logger.dsp import kaiser
from logger.profiles.track import Way, WheelTracks
from logger.vehicle.state_space import driven_outputs, straight_step
from logger.vehicle.structure import Output, Structure

Array = npt.NDArray[np.float64]

FINE_RATE_HZ = 1000.0
"""``drive`` takes at least so many steps a second."""
PASS_OF_RATE, STOP_OF_RATE = 0.38, 0.5
"""The recorder's filter is flat below the one and silent above the other share of its rate."""
STOP_DB = 80.0
_HALF_SAMPLES = ceil(kaiser.half_length(STOP_DB, 2 * np.pi * (STOP_OF_RATE - PASS_OF_RATE)))
# The recorder's gain is read off a transform of so many points of its filter at so many times its rate.
_GAIN_STEPS, _GAIN_GRID = 4, 16384
_EVEN = 1e-3


def simulate(
    structure: Structure, outputs: Sequence[Output], track: WheelTracks, time_s: npt.ArrayLike,
    distance_m: npt.ArrayLike,
) -> Array:
    """Outputs (N, p) of a car at the instants given, not filtered.

    time_s        (N,) evenly spaced [s]; accurate when there are some ten steps in the period of every motion
    distance_m    (N,) where the front tires stand on the track then [m]; between two instants the speed is constant

    The car starts at rest, in equilibrium on the road under each wheel. On a track of two, left wheels (and those of a
    car that has but one track) take the left one.

    ValueError unless there are two instants or more, evenly spaced, and as many finite distances.
    """
    time, distance = _checked(time_s, distance_m)
    response, elevations, _ = _respond(structure, outputs, track, (time[-1] - time[0]) / (len(time) - 1), distance)
    return response + elevations @ structure.output_matrices(outputs)[1].T


def drive(
    structure: Structure,
    outputs: Sequence[Output],
    track: WheelTracks,
    time_s: npt.ArrayLike,
    distance_m: npt.ArrayLike,
    oversample: int | None = None,
) -> Array:
    """Outputs (N, p) of a car as a recorder samples them at the instants given.

    time_s        (N,) evenly spaced, the recorder's instants [s]
    distance_m    (N,) where the front tires stand on the track then [m]; a smooth curve is laid through them
    oversample    steps simulated per sample; None: as many as make ``FINE_RATE_HZ``

    The recorder's filter passes what lies below 0.38 of its rate within 0.001 dB and lets nothing above half its rate
    through (80 dB down), without delay. So it looks a little ahead: after the last instant the car drives on as fast as
    it did, before the first one it was at rest as in ``simulate``.

    ValueError as ``simulate``, and for ``oversample`` below 1.
    """
    time, distance = _checked(time_s, distance_m)
    rate_hz = (len(time) - 1) / (time[-1] - time[0])
    steps = int(np.ceil(FINE_RATE_HZ / rate_hz - _EVEN)) if oversample is None else oversample
    if steps < 1:
        raise ValueError(f"expected at least one step per sample, found {steps}")
    beyond = distance[-1] + (distance[-1] - distance[-2]) * np.arange(1, _HALF_SAMPLES + 1)
    way = _fine(np.append(distance, beyond), steps)
    response, elevations, means = _respond(structure, outputs, track, 1 / (rate_hz * steps), way)
    fine = response + _smooth(elevations, means) @ structure.output_matrices(outputs)[1].T
    before = np.broadcast_to(fine[0], (_HALF_SAMPLES * steps, fine.shape[1]))
    return _thinned(np.concatenate([before, fine]), steps)[: len(time)]


def recorder_taps(steps: int) -> Array:
    """The recorder's filter at ``steps`` times its rate: (2 h + 1,), symmetric, its sum 1."""
    return kaiser.low_pass_taps(_HALF_SAMPLES * steps, steps, PASS_OF_RATE + STOP_OF_RATE, STOP_DB)


def resampled(samples: Array, factor: int) -> Array:
    """Every ``factor``-th of samples (n,) behind the recorder's filter at the lower rate; both ends are continued by
    their mirror image about the last sample."""
    taps = recorder_taps(factor)
    half = min(len(taps) // 2, len(samples) - 1)
    around = np.pad(samples, half, mode="reflect", reflect_type="odd")
    return np.asarray(np.convolve(np.pad(around, len(taps) // 2 - half, mode="edge"), taps, "valid")[::factor])


def recorder_gain(f_of_rate: Array) -> Array:
    """The size of the recorder's gain at shares of its rate (f,)."""
    gains = np.abs(np.fft.rfft(recorder_taps(_GAIN_STEPS), _GAIN_GRID))
    return np.interp(f_of_rate * _GAIN_GRID / _GAIN_STEPS, np.arange(len(gains)), gains)


def _checked(time_s: npt.ArrayLike, distance_m: npt.ArrayLike) -> tuple[Array, Array]:
    time, distance = np.asarray(time_s, dtype=float), np.asarray(distance_m, dtype=float)
    if time.ndim != 1 or time.shape != distance.shape or len(time) < 2:
        raise ValueError(f"expected times and distances, two or more of each, found {time.shape} and {distance.shape}")
    step_s = (time[-1] - time[0]) / (len(time) - 1)
    if not (step_s > 0 and (np.abs(time - time[0] - step_s * np.arange(len(time))) <= _EVEN * step_s).all()):
        raise ValueError("expected evenly spaced, growing times")
    if not np.isfinite(distance).all():
        raise ValueError("expected finite distances")
    return time, distance


def _respond(
    structure: Structure, outputs: Sequence[Output], track: WheelTracks, step_s: float, distance: Array
) -> tuple[Array, Array, Array]:
    """What the car's own motion gives to the outputs (N, p); elevations (N, w) and their means in each step (N - 1, w).

    What is missing in the outputs is what they contain of the road directly.
    """
    way = Way(distance, np.asarray(step_s * np.arange(len(distance)), float))
    elevations, means = track.under_wheels(way, structure)
    # Elevations count from a level near the first ones, so that no digits go into the height of the country.
    level = elevations[0].mean()
    around = np.concatenate([2 * elevations[:1] - means[:1], means, 2 * elevations[-1:] - means[-1:]])
    rise = (around[2:] - around[:-2]) / 4  # from the middle of a step to its end
    transition, at_start, at_end = straight_step(*structure.state_space(), step_s)
    gain = np.hstack([at_start + at_end, at_end - at_start])
    observe, _ = structure.output_matrices(outputs)
    still = np.linalg.solve(structure.stiffness, structure.road)
    rest = np.concatenate([still @ (elevations[0] - level), np.zeros(len(still))])
    response = driven_outputs(transition, gain, observe, np.hstack([means - level, rise]), rest)
    return response + level * (observe[:, :len(still)] @ still.sum(axis=1)), elevations, means


def _smooth(elevations: Array, means: Array) -> Array:
    """The elevations again (N, w), from the means of two steps before and two after: what is quicker than them is gone.

    Right to fourth order. Read at the instants alone, an edge that passes between two of them would come out of the
    recorder's filter at a frequency that it does not have.
    """
    smooth = elevations.copy()
    smooth[2:-2] = (7 * (means[1:-2] + means[2:-1]) - means[:-3] - means[3:]) / 12
    return smooth


def _fine(distance: Array, steps: int) -> Array:
    """Distances ``steps`` times as dense, on the cubic through the four samples around each of them."""
    ends = np.concatenate([[2 * distance[0] - distance[1]], distance, [2 * distance[-1] - distance[-2]]])
    along = np.arange(steps) / steps
    nodes = np.arange(-1, 3)
    weights = np.stack([
        np.prod([(along - other) / (node - other) for other in nodes if other != node], axis=0) for node in nodes
    ])
    four = np.lib.stride_tricks.sliding_window_view(ends, 4)
    return np.append(four @ weights, distance[-1])


def _thinned(fine: Array, steps: int) -> Array:
    """The recorder's filter and one row in ``steps``: row k belongs to row k * steps + half the filter of ``fine``.

    The filter is cut into stretches of one sample, each product of a stretch and a sample is taken once, and the
    products that belong to one output lie on a diagonal.
    """
    taps = recorder_taps(steps)
    stretches = -(-len(taps) // steps)
    padded_taps = np.zeros(stretches * steps)
    padded_taps[: len(taps)] = taps
    count = (len(fine) - len(taps)) // steps + 1
    padded = np.zeros(((count + stretches) * steps, fine.shape[1]))
    padded[: len(fine)] = fine[: len(padded)]
    products = padded_taps.reshape(stretches, steps) @ padded.T.reshape(fine.shape[1], -1, steps).swapaxes(1, 2)
    result = np.zeros((fine.shape[1], count))
    for stretch in range(stretches):
        result += products[:, stretch, stretch : stretch + count]
    return result.T
