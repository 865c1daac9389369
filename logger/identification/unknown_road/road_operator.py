"""Roads to readings and back: a drive as a linear map of a road that nobody measured, and the most probable road.

The road is elevations on an even grid. They are read where each axle stood at each instant, averaged over the contact
patch, and go through the car frequency by frequency, whatever the speed did. Before its first sample the car comes from
a road that is unknown too, at the speed it had; so nothing is said of how it moved when the record began. A sensor's
zero is not trusted: the mean of all readings is left out.

Drives y = B w + noise over a road of innovations w: (1 + B' B / variance) w = B' y / variance, which is solved by
conjugate gradients. B is never formed: a drive is applied to a road, and back, by transforms. Preconditioned as if the
drives were endless and their speeds even, or by a factor of the matrix itself, taken nearby.
"""

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, rfft

from logger.arrays import Array, Complex
from logger.dsp.whole_record import SEEN_OF_RATE
from logger.estimation.car_response import SPEEDS_PER_E
from logger.estimation.road_solver import MARGIN_M, patch_gain
from logger.runs import SLOWEST_MPS
from logger.vehicle.simulate import smooth_length

_SWELL_S, _APPROACH_S, _TAIL_S, _REST_S = 2.0, 3.0, 1.0, 2.0
_FAST_SHARE = 0.99


@dataclass(frozen=True, eq=False)
class RoadDrive:
    """One drive, evenly sampled: arrays (n,).

    rate_hz          samples a second
    measured_mps2    the sensor, up positive, gravity removed, band-limited by the recorder [m/s2]
    distance_m       where the front tires stand [m]
    """

    rate_hz: float
    measured_mps2: Array
    distance_m: Array


@dataclass(frozen=True)
class Grid:
    """Where the road is: ``count`` places from ``start_m`` on, ``spacing_m`` apart, taken for one period."""

    start_m: float
    spacing_m: float
    count: int

    @property
    def wave_number_cpm(self) -> Array:
        """Of the transform of ``count`` elevations [cycle/m]."""
        return np.asarray(np.fft.rfftfreq(self.count, self.spacing_m))


def grid_under(drives: list[RoadDrive], behind_m: Array, spacing_m: float, most_off_m: float,
               scale_off: float = 0.0) -> Grid:
    """A grid that holds the way of all drives, from where they came to where they went on, were their places so much
    off and their distances longer by such a share."""
    ways = [_way(drive)[0] for drive in drives]
    off_m = most_off_m + scale_off * max(float(np.ptp(way)) for way in ways) + MARGIN_M
    first_m = min(float(way.min()) for way in ways) - float(behind_m.max()) - off_m
    last_m = max(float(way.max()) for way in ways) + off_m
    return Grid(first_m, spacing_m, smooth_length(int((last_m - first_m) / spacing_m) + 2))


class Crossing:
    """A drive as a linear map of innovations (b, count) of the road to readings (b, n).

    A response is (x, f) at ``f_hz``; ``waves`` (k,) makes elevations of innovations, by wave number. With ``lever``
    what is under the axles counts times the distance from the drive's middle, about which distances can be scaled.
    """

    def __init__(self, drive: RoadDrive, grid: Grid, behind_m: Array, contact_patch_m: float) -> None:
        self.measured_mps2, self._grid, self._axles = drive.measured_mps2, grid, len(behind_m)
        way, lead = _way(drive)
        self._middle_m = 0.5 * float(drive.distance_m.min() + drive.distance_m.max())
        self._lever_m, self._behind_m = way - self._middle_m, behind_m
        self.kept = slice(lead, lead + len(drive.distance_m))
        self._length = len(way)
        self._count = smooth_length(len(way) + int(_REST_S * drive.rate_hz))
        self.f_hz = np.arange(self._count // 2 + 1) * drive.rate_hz / self._count
        self._window = _window(len(way), int(_SWELL_S * drive.rate_hz), int(_TAIL_S * drive.rate_hz))
        self.speed_mps = np.maximum(np.abs(np.gradient(drive.distance_m)) * drive.rate_hz, SLOWEST_MPS)
        n = grid.wave_number_cpm
        self.seen_cpm = SEEN_OF_RATE * drive.rate_hz / float(np.quantile(self.speed_mps, _FAST_SHARE))
        self._averaged = np.where(n <= self.seen_cpm, patch_gain(n, contact_patch_m, grid.spacing_m), 0.0)
        self._lay(1.0)

    def laid(self, scale: float) -> "Crossing":
        """The same drive, its distances from its middle so many times what was recorded."""
        if scale == self._scale:
            return self
        other = copy(self)
        other._lay(scale)
        return other

    def _lay(self, scale: float) -> None:
        from scipy.sparse import csr_array

        self._scale = scale
        way = self._middle_m + scale * self._lever_m
        place = ((way - self._behind_m[:, None] - self._grid.start_m) / self._grid.spacing_m).ravel()
        place = np.clip(place, 0, self._grid.count - 1.001)
        low = np.floor(place).astype(np.int64)
        rows = np.arange(len(place))
        share = place - low
        self._read = csr_array((np.concatenate([1 - share, share]), (np.concatenate([rows, rows]),
                                                                     np.concatenate([low, low + 1]))),
                               shape=(len(place), self._grid.count))
        self._spread = self._read.T.tocsr()

    def under_axles(self, innovations: Array, waves: Complex, lever: bool = False) -> Complex:
        """Transforms (b, x, f) in time of the elevations under the axles."""
        elevation = irfft(rfft(innovations) * (waves * self._averaged), self._grid.count)
        under = (self._read @ elevation.T).T.reshape(-1, self._axles, self._length) * self._weight(lever)
        return np.asarray(rfft(under, self._count))

    def unit_readings(self, waves: Complex, response: Complex, first: int, last: int) -> npt.NDArray[np.float32]:
        """Readings (b, n), less the mean of each, over roads of one innovation: those of the grid from ``first`` up to
        ``last``. In single precision, to a thousandth, as a preconditioner needs them."""
        kernel = irfft(waves * self._averaged, self._grid.count).astype(np.float32)
        shifted = np.lib.stride_tricks.sliding_window_view(np.concatenate([kernel, kernel]), len(kernel))
        elevation = shifted[len(kernel) - np.arange(first, last)]
        under = (self._read.astype(np.float32) @ elevation.T).T.reshape(-1, self._axles, self._length)
        transform = rfft(under * self._window.astype(np.float32), self._count)
        found = irfft((response.astype(np.complex64) * transform).sum(axis=1), self._count)[:, self.kept]
        return np.asarray(found - found.mean(axis=1, keepdims=True))

    def readings(self, under: Complex, response: Complex) -> Array:
        """Readings (b, n), less the mean of each."""
        return _level(irfft((response * under).sum(axis=1), self._count)[:, self.kept])

    def back(self, readings: Array, waves: Complex, response: Complex, lever: bool = False) -> Array:
        """The transposed map: of readings (b, n), to innovations (b, count)."""
        time = np.zeros((len(readings), self._count))
        time[:, self.kept] = _level(readings)
        transform = rfft(time)[:, None, :] * np.conj(response)
        under = irfft(transform, self._count)[..., : self._length] * self._weight(lever)
        elevation = (self._spread @ under.reshape(len(readings), -1).T).T
        return np.asarray(irfft(rfft(elevation) * np.conj(waves * self._averaged), self._grid.count))

    def _weight(self, lever: bool) -> Array:
        return self._window * self._lever_m if lever else self._window

    def transform(self, readings: Array) -> Complex:
        """Transforms (b, f) of readings (b, n) in the frame of ``under_axles``, so that ``products`` can be taken."""
        time = np.zeros((len(readings), self._count))
        time[:, self.kept] = _level(readings)
        return np.asarray(rfft(time))

    def products(self, readings: Complex, responses: Complex, under: Complex) -> Array:
        """Sums (b, p) of the products of readings, by their transforms (b, f), with what responses (p, x, f) make of
        the road under the axles."""
        weight = np.full(len(self.f_hz), 2.0 / self._count)
        weight[0] = weight[0] / 2
        weight[-1] = weight[-1] / (2 if self._count % 2 == 0 else 1)
        weighed = weight * np.conj(readings)
        return np.einsum("bxf,pxf->bp", weighed[:, None, :] * under, responses, optimize=True).real

    def gain(self, response: Complex, behind_m: Array) -> Array:
        """Sum over the samples (k,) of the squared gain from road to reading for waves of the grid."""
        n = self._grid.wave_number_cpm
        axle = np.exp(-2j * np.pi * n * behind_m[:, None])
        steps = np.round(np.log(self.speed_mps) * SPEEDS_PER_E)
        total = np.zeros(len(n))
        for step, samples in zip(*np.unique(steps, return_counts=True), strict=True):
            at_hz = n * np.exp(step / SPEEDS_PER_E)
            gain = sum(np.interp(at_hz, self.f_hz, one) * delay for one, delay in zip(response, axle, strict=True))
            total += samples * np.abs(gain) ** 2
        return np.asarray(total * self._averaged**2 * np.sinc(n * self._grid.spacing_m) ** 4)


def _level(readings: Array) -> Array:
    return np.asarray(readings - readings.mean(axis=1, keepdims=True))


def _way(drive: RoadDrive) -> tuple[Array, int]:
    """Distances of the drive with what came before and after it, and how many samples came before."""
    lead, tail = (int(seconds * drive.rate_hz) for seconds in (_SWELL_S + _APPROACH_S, _TAIL_S))
    way = drive.distance_m
    before = way[0] + (way[1] - way[0]) * np.arange(-lead, 0)
    after = way[-1] + (way[-1] - way[-2]) * np.arange(1, tail + 1)
    return np.concatenate([before, way, after]), lead


def _window(count: int, swell: int, tail: int) -> Array:
    """1, but for both ends, where it comes and goes."""
    window = np.ones(count)
    window[:swell] = 0.5 * (1 - np.cos(np.pi * np.arange(swell) / swell))
    window[count - tail:] = 0.5 * (1 + np.cos(np.pi * np.arange(1, tail + 1) / tail))
    return window


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


Preconditioner = Callable[[Array], Array]

MOST_ROUNDS, _AT_ONCE = 150, 256


@dataclass(frozen=True, eq=False)
class DrivesModel:
    """Drives over one road at one place of all numbers.

    crossings      the drives
    waves          (k,) for each: what makes a road as it lies under the drive out of innovations
    responses      (x, k) for each, and their derivatives (p, x, k)
    spectral       (k,) of the preconditioner for endless drives
    variance       of the noise [(m/s2)2]
    """

    crossings: list[Crossing]
    waves: list[Complex]
    responses: list[Complex]
    derivatives: list[Complex]
    spectral: Array
    variance: float

    def of(self, drives: Sequence[int]) -> "DrivesModel":
        """Some of the drives."""
        return DrivesModel([self.crossings[one] for one in drives], [self.waves[one] for one in drives],
                           [self.responses[one] for one in drives], [self.derivatives[one] for one in drives],
                           self.spectral, self.variance)

    def readings(self, white: Array) -> list[Array]:
        """Readings (b, n) of each drive over roads of innovations (b, count)."""
        return [one.readings(one.under_axles(white, waves), response) for one, waves, response in
                zip(self.crossings, self.waves, self.responses, strict=True)]

    def back(self, readings: Sequence[Array], count: int) -> Array:
        """The transpose of ``readings`` (b, count), over the variance."""
        total = np.zeros((len(readings[0]), count))
        for one, part, waves, response in zip(self.crossings, readings, self.waves, self.responses, strict=True):
            total += one.back(part, waves, response)
        return total / self.variance

    def filtered(self, residual: Array) -> Array:
        """About what solves the equations for a residual (b, count), were the drives endless and their speeds even."""
        return np.asarray(np.fft.irfft(np.fft.rfft(residual) * self.spectral, residual.shape[1]))


def factored(model: DrivesModel, count: int) -> Preconditioner:
    """What solves the equations of a model, for those of a place nearby."""
    from scipy.linalg import cho_factor, cho_solve
    from scipy.linalg.blas import ssyrk

    normal = np.eye(count, dtype=np.float32, order="F")
    for one, waves, response in zip(model.crossings, model.waves, model.responses, strict=True):
        rows = np.concatenate([one.unit_readings(waves, response, first, min(first + _AT_ONCE, count))
                               for first in range(0, count, _AT_ONCE)])
        normal = ssyrk(1 / model.variance, rows.T, beta=1.0, c=normal, trans=1, lower=1, overwrite_c=1)
    factor = cho_factor(normal, lower=True, overwrite_a=True, check_finite=False)

    def condition(residual: Array) -> Array:
        # By a power of two, which rounds nothing: of single precision 1e39 is infinite, and 1e-46 is 0.
        scale = np.exp2(np.ceil(np.log2(np.abs(residual).max(axis=1, initial=np.finfo(float).tiny))))[:, None]
        solved = cho_solve(factor, (residual / scale).T.astype(np.float32), check_finite=False).T
        return np.asarray(solved, float) * scale

    return condition


def solve(model: DrivesModel, readings: Sequence[Array], count: int, solved: float, rounds: int | None = None,
          preconditioner: Preconditioner | None = None) -> tuple[Array, list[Array], int]:
    """Innovations (b, count) of the most probable roads, inv(C) times the readings (b, n) of each drive, and how many
    rounds that took.

    For all b at once, until what is left is ``solved`` of what it began with, or so many ``rounds``: slopes at
    neighbouring places can be compared only if they come from as many.
    """
    condition = model.filtered if preconditioner is None else preconditioner
    residual = model.back(readings, count)
    white = np.zeros_like(residual)
    unexplained = [one.copy() for one in readings]
    direction, before = np.zeros_like(residual), np.zeros(len(residual))
    first, done = None, 0
    while done < (MOST_ROUNDS if rounds is None else rounds):
        conditioned = condition(residual)
        size = (residual * conditioned).sum(axis=1)
        # A preconditioner of another place, or of few digits, may point uphill: then it goes down from there anew.
        uphill = size <= 0
        conditioned[uphill] = residual[uphill]
        size[uphill] = (residual[uphill] ** 2).sum(axis=1)
        first = size if first is None else first
        if rounds is None and (size <= solved**2 * first).all():
            break
        done += 1
        kept = np.divide(size, before, out=np.zeros_like(size), where=(before > 0) & ~uphill)
        direction = conditioned + kept[:, None] * direction
        image = model.readings(direction)
        curve = (direction**2).sum(axis=1) + sum((one**2).sum(axis=1) for one in image) / model.variance
        step = np.divide(size, curve, out=np.zeros_like(size), where=curve > 0)[:, None]
        white += step * direction
        for one, part in zip(unexplained, image, strict=True):
            one -= step * part
        residual -= step * (direction + model.back(image, count))
        before = np.where(size > np.finfo(float).tiny, size, 0.0)
    return white, [one / model.variance for one in unexplained], done
