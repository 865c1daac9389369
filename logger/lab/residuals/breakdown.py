"""The residuals of a model, and their power by frequency, speed, excitation and place.

Problem: one number says that a model fails, not where. Solution: ``ModelResiduals`` holds runs, a car's predictions and
its motions; ``breakdown`` divides the power of the residuals among the bands of the car's own vibrations, speeds, how
strongly the road excites the car, and the places of each road. Shares are of the
power of measured - model over all samples that count, so that each list of shares adds up to 1.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from logger.arrays import Array, Complex
from logger.dsp.resample import PASS_OF_RATE
from logger.lab.likelihood.lag import WINDOW_S
from logger.runs import Run, are_on_rig
from logger.vehicle.compose import Car, Response
from logger.vehicle.models import structure_of
from logger.vehicle.modes import body_and_wheels_hz

INDEPENDENT_S = 1.0
"""Residuals so far apart count as independent: a body that bounces at 1 Hz with a third of its critical damping keeps
an eighth of its motion after that time."""


@dataclass(frozen=True)
class Band:
    """Frequencies from ``from_hz`` up to ``to_hz``, with a name."""

    name: str
    from_hz: float
    to_hz: float


@dataclass(frozen=True)
class Part:
    """A part of the data: its share of the residual power, and its error (rms residual / rms measured, in it; NaN where
    nothing was measured).

    low, high        its ends, in the unit of the list it stands in
    residual_mps2    rms of the residual in it
    samples          in it; of a band all
    name             of a band, or of the run that a place is in; else empty
    """

    low: float
    high: float
    error: float
    share: float
    residual_mps2: float
    samples: int
    name: str = ""


@dataclass(frozen=True)
class Breakdown:
    """Residual power by frequency [Hz], speed [m/s], r.m.s. of the model's acceleration [m/s2] and place [m]."""

    frequency: tuple[Part, ...]
    speed: tuple[Part, ...]
    amplitude: tuple[Part, ...]
    place: tuple[Part, ...]

    def worst_places(self, count: int) -> list[Part]:
        """The places that hold most of the residual power."""
        return sorted(self.place, key=lambda part: -part.share)[:count]


@dataclass(frozen=True, eq=False)
class ModelResiduals:
    """Runs, a car's predictions of them, and its motions.

    predictions    (n,) per run, whole
    responses      motions of the car, per run
    """

    runs: Sequence[Run]
    car: Car
    predictions: Sequence[Array]
    responses: Sequence[Response]

    @property
    def unit(self) -> str:
        """Of what the runs measure first, the same in all."""
        return self.runs[0].facts.main.unit

    @property
    def rate_hz(self) -> float:
        """Samples a second, the same in all runs."""
        return self.runs[0].rate_hz

    @property
    def top_hz(self) -> float:
        """Highest frequency at which any of the runs is compared [Hz]."""
        return max(run.pass_band_hz[1] for run in self.runs)

    @property
    def whole(self) -> bool:
        """Whether the runs are compared at all frequencies."""
        return all(run.facts.pass_band_hz is None for run in self.runs)

    @cached_property
    def residual(self) -> list[Array]:
        """Measured minus predicted, the samples that count, per run [m/s2]."""
        return [run.residual(one)[run.first:] for run, one in zip(self.runs, self.predictions, strict=True)]

    @cached_property
    def measured(self) -> list[Array]:
        """Measured acceleration, the samples that count, per run; 0 where nothing was read [m/s2]."""
        return [run.kept_readings_mps2 for run in self.runs]

    @cached_property
    def model(self) -> list[Array]:
        """Predicted acceleration, the samples that count, per run [m/s2]."""
        return [one[run.first:] for run, one in zip(self.runs, self.predictions, strict=True)]

    def kept(self, of: Callable[[Run], Array]) -> list[Array]:
        """A signal of each run, the samples that count."""
        return [of(run)[run.first:] for run in self.runs]

    @cached_property
    def bands(self) -> tuple[Band, ...]:
        """Body and wheels of this car, or a mass alone, about as wide as their damping makes them, and what lies below,
        between and above, up to where the runs' pass bands end, half the sample rate if they do not."""
        body_hz, wheels_hz = body_and_wheels_hz(structure_of(self.car.vehicle))
        body = "body bounce" if len(wheels_hz) else "the natural frequency"
        top, own = self.top_hz, [] if len(body_hz) == 0 else [
            (f"below {body}", body_hz[0] / 1.35), (body, body_hz[-1] * 1.35)]
        if len(wheels_hz):
            between = np.sqrt(body_hz[-1] * wheels_hz[0])
            own = [own[0], (body, min(own[1][1], between)),
                   ("between bounce and hop", max(wheels_hz[0] / 1.3, between)), ("wheel hop", wheels_hz[-1] * 1.3)]
        last, above = own[-1] if own else ("any vibration", 0.0)
        kept = max(PASS_OF_RATE * self.rate_hz, above)
        bands = (*own, (f"above {last}", np.sqrt(above * kept)), (f"far above {last}" if own else "all", kept),
                 ("beyond the recorder's filter", top))
        ends = [0.0, *(round(float(min(end, top)), 2) for _, end in bands)]
        return tuple(Band(name, low, high) for (name, _), (low, high) in zip(bands, pairwise(ends), strict=True)
                     if high > low)


def breakdown(residuals: ModelResiduals) -> Breakdown:
    """The power of residuals by frequency, speed, excitation and place."""
    return Breakdown(_by_frequency(residuals), _by_speed(residuals), _by_amplitude(residuals), _by_place(residuals))


# --- tools that the residual tests share ---


def segments(residuals: ModelResiduals, signals: Sequence[Array]) -> Complex:
    """Spectra of all segments of some signals [(n,), ...]: (segments, frequencies), scaled to mean powers.

    Segments overlap by half and are tapered (Hann). They are as long as the longest run at most; a run shorter than one
    gives none.
    """
    size = _segment_size(residuals)
    taper = np.hanning(size + 1)[:-1]
    taper = taper / np.sqrt((taper**2).sum() * size)
    blocks = [np.lib.stride_tricks.sliding_window_view(one, size)[:: max(1, size // 2)]
              for one in signals if len(one) >= size]
    spectra = np.fft.rfft(np.concatenate(blocks) * taper, axis=1)
    spectra[:, 1:] *= np.sqrt(2.0)
    return np.asarray(spectra)


def _segment_size(residuals: ModelResiduals) -> int:
    """Samples in a segment, an even number."""
    longest = max(map(len, residuals.residual))
    return min(round(WINDOW_S * residuals.rate_hz), longest) // 2 * 2


def frequencies(residuals: ModelResiduals) -> Array:
    """Frequencies (f,) of the spectra of ``segments`` [Hz]."""
    return np.asarray(np.fft.rfftfreq(_segment_size(residuals), 1 / residuals.rate_hz))


# --- the four lists ---


def _by_frequency(residuals: ModelResiduals) -> tuple[Part, ...]:
    residual, measured = (np.mean(np.abs(segments(residuals, one)) ** 2, axis=0)
                      for one in (residuals.residual, residuals.measured))
    f_hz, whole = frequencies(residuals), float(residual.sum())
    found = []
    for band in residuals.bands:
        inside = (f_hz >= band.from_hz) & ((f_hz < band.to_hz) | (band is residuals.bands[-1]))
        power = float(residual[inside].sum())
        found.append(_part(band.from_hz, band.to_hz, power, float(measured[inside].sum()), whole, power,
                           sum(map(len, residuals.residual)), band.name))
    return tuple(found)


def _by_speed(residuals: ModelResiduals) -> tuple[Part, ...]:
    """Parts by speed, in six round steps at most, or seven; none on rigs."""
    if are_on_rig(residuals.runs):
        return ()
    speed = np.concatenate(residuals.kept(lambda run: run.speed_mps))
    low, high = float(speed.min()), float(speed.max())
    step = next((one for one in (0.5, 1.0, 2.0, 5.0, 10.0, 20.0) if (high - low) / one <= 6), 50.0)
    return _binned(residuals, speed, np.arange(np.floor(low / step), np.floor(high / step) + 2) * step)


def _by_amplitude(residuals: ModelResiduals) -> tuple[Part, ...]:
    """Parts by amplitude: quarters by the r.m.s. of the model in a block around each sample."""
    size = round(INDEPENDENT_S * residuals.rate_hz)
    level = np.concatenate([_running_rms(one, size) for one in residuals.model])
    edges = np.unique(np.quantile(level, np.linspace(0, 1, 5)))
    if len(edges) == 1:  # a model that does not move
        edges = np.array([edges[0], edges[0] + 1e-9])
    edges[-1] = np.nextafter(edges[-1], np.inf)
    return _binned(residuals, level, edges)


def _running_rms(signal: Array, samples: int) -> Array:
    width = min(samples, len(signal))
    mean: Array = np.convolve(signal**2, np.full(width, 1 / width), mode="same").astype(np.float64)
    return np.asarray(np.sqrt(np.maximum(mean, 0.0)))


def _by_place(residuals: ModelResiduals) -> tuple[Part, ...]:
    """Parts by place: stretches of a round length, of about 0.6 s or somewhat more; none on rigs."""
    usual_mps = float(np.median(np.concatenate(residuals.kept(lambda run: run.speed_mps))))
    length = next((step for step in (1.0, 2.0, 5.0, 10.0, 20.0) if step >= 0.6 * usual_mps), 50.0)
    whole = sum(float(one @ one) for one in residuals.residual)
    found: list[Part] = []
    for run, residual, measured in zip(residuals.runs, residuals.residual, residuals.measured, strict=True):
        if run.timed:
            continue
        at = run.distance_m[run.first:]
        edges = np.arange(np.floor(at.min() / length), np.floor(at.max() / length) + 2) * length
        found += _parts(at, edges, residual, measured, whole, run.name)
    return tuple(found)


def _binned(residuals: ModelResiduals, values: Array, edges: Array) -> tuple[Part, ...]:
    residual, measured = np.concatenate(residuals.residual), np.concatenate(residuals.measured)
    return tuple(_parts(values, edges, residual, measured, float(residual @ residual)))


def _parts(values: Array, edges: Array, residual: Array, measured: Array, whole: float, name: str = "") -> list[Part]:
    """Bins [edge, next edge) that hold samples."""
    index, bins = np.searchsorted(edges, values, side="right") - 1, len(edges) - 1
    count = np.bincount(index, minlength=bins)
    power, of = (np.bincount(index, one**2, minlength=bins) for one in (residual, measured))
    return [_part(float(edges[i]), float(edges[i + 1]), power[i], of[i], whole, power[i] / count[i], int(count[i]),
                  name) for i in np.flatnonzero(count)]


def _part(low: float, high: float, power: float, of: float, whole: float, mean: float, samples: int, name: str) -> Part:
    """A part by its powers: of its residual, of its measurement, of all residuals, and the mean of the first."""
    return Part(low, high, float(np.sqrt(power / of)) if of > 0 else float("nan"),
                float(power / whole) if whole > 0 else 0.0, float(np.sqrt(mean)), samples, name)
