"""The unexplained residual: what no candidate explains, described by tests and by lines along the way.

Problem: something is missing that is not on the list of effects. Solution: the residual of the best model is tested as
a comparison tests it (which force in the suspensions, at which frequencies, correlated with what), and its spectrum is
taken along the way instead of along the time: what a wheel does once in a turn repeats every so many metres, whatever
the speed.

Sensor drift: the slow part of a residual, below the band in which models are compared.

Problem: records are not compared below 0.4 Hz (``likelihood.whittle``), because a body on springs hardly accelerates
there: an acceleration is its travel times (2 pi f)2, so that even 5 cm at 0.1 Hz are 0.02 m/s2. A sensor that warms up,
or whose zero jumps, is strongest there, and an error counts that. Solution: the residual of a run is transformed to the
cosines below that frequency (discrete cosine transform, N. Ahmed, T. Natarajan and K. Rao, IEEE Transactions on
Computers C-23, 1974). Of several forms of drift the one with the least BIC (G. Schwarz, Annals of Statistics 6, 1978)
is chosen; the noise is white there, no less than between 0.4 and 0.6 Hz. The power of a random walk falls with the
square of a coefficient's number; it is estimated by N. Wiener's filter. A random walk may look like any of the others,
which therefore have to be clearly better (of faint ones over 20 s a third were called steps and ramps, now 3 %).

Sensor drift, distance error and filtering: what is removed from an error before it is judged, and its share of it.

Problem: three causes of error are no physics of the car: a sensor that drifts, a distance that is wrong, a record that
somebody filtered. The lab removes all three before it asks what is missing; an error that counts them, and a verdict
that does not name them, seem to contradict each other. Solution: each is reported with its share of the residual power
of the model as it stands, and the error without all of them.

Noise of a colour: whether a residual that is louder than white noise would be is the sensor's all the same.

Problem: the sensor's noise is read where no car moves the sensor, at the highest frequencies, and taken to be white.
Noise that falls or rises with frequency then looks like missing physics. Solution: what a car does grows with how much
it is shaken, and follows the road; what a sensor adds does neither. A residual is noise if hardly any of its power may
grow with the motion (``growing_power``), the uncertainty of that counted in, and none of the tests of a residual
relates it to the road, to the car, to a time or to a place, or finds a tone in it; and if it falls or rises with
frequency throughout.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from logger.arrays import Array
from logger.bounds import SURE_SIGMA, UNUSUAL_SIGMA
from logger.lab.likelihood.distance_error import unusual_distance_error_m
from logger.lab.likelihood.noise_floor import (
    NoiseLevel,
    floor_error,
    growing_power,
    sensor_noise_of,
    sensor_noise_with_rounding,
)
from logger.lab.likelihood.posterior import Posterior, State
from logger.lab.likelihood.signals import JointBands
from logger.lab.likelihood.whittle import LOWEST_HZ, UNEXPLAINED
from logger.lab.residual_tests import run_residual_tests
from logger.lab.residual_tests.tests import LEAST_SHARE, SIGNIFICANCE, ResidualEvidence, ResidualTestResults
from logger.lab.residuals.breakdown import Breakdown, ModelResiduals, breakdown
from logger.lab.residuals.statistics import NEIGHBOURS, periodogram, strongest_line
from logger.runs import Run, short_names

NONE, OFFSET, RAMP, STEP, EXPONENTIAL, WANDER = "none", "offset", "ramp", "step", "exponential", "wander"


@dataclass(frozen=True, eq=False)
class Drift:
    """The drift of the sensor of one run.

    run          its name
    form         offset, ramp, step, exponential or wander; none where no more than noise is seen
    size_mps2    of an offset or a step, over all of a ramp, of an exponential at the beginning of the run; r.m.s. of
                 what wanders [m/s2]
    time_s       of an exponential; where in the run a step is [s]; None: it has none
    curve_mps2   (n,) of the whole run [m/s2]
    rate_hz      samples a second
    """

    run: str
    form: str
    size_mps2: float
    time_s: float | None
    curve_mps2: Array
    rate_hz: float

    @property
    def found(self) -> bool:
        """Whether there is one."""
        return self.form != NONE

    def nothing_found(self) -> "Drift":
        """No drift, of the same run."""
        return replace(self, form=NONE, size_mps2=0.0, time_s=None, curve_mps2=np.zeros(len(self.curve_mps2)))


@dataclass(frozen=True, eq=False)
class _Curve:
    form: str
    bic: float
    size_mps2: float
    time_s: float | None
    curve: Callable[[Array], Array]


def drift_of(run: Run, residual: Array, noise_mps2: float) -> Drift:
    """The drift in a residual (n,) of a run whose sensor has white noise of this deviation [m/s2], or as much as the
    residual has just above ``LOWEST_HZ``. A run of fewer than eight coefficients cannot distinguish a form of three
    numbers from noise: no drift is found."""
    kept, rate = run.count - run.first, run.rate_hz
    time_s = run.time_s
    nothing = Drift(run.name, NONE, 0.0, None, np.zeros(run.count), rate)
    read = run.read[run.first:]
    count = int(2 * LOWEST_HZ * kept / rate)  # of frequencies below the lowest that is judged
    low_hz, _ = run.pass_band_hz
    judged_slowly = run.timed and not run.facts.main.may_drift
    if count < 8 or low_hz > 0 or judged_slowly or not read.any():
        return nothing
    basis = _Cosines(kept, count, int(1.5 * 2 * LOWEST_HZ * kept / rate))
    seen = basis.of(np.where(read, residual[run.first:], 0.0))
    level = max(noise_mps2**2, float(np.mean(seen[count:] ** 2)))
    fits = [_fit_white(form, basis, seen[:count], level, time_s[run.first:], shapes)
            for form, shapes in _shapes(time_s[run.first:], rate).items()]
    fits.append(_fit_random_walk(basis, seen[:count], level, run.first))
    nought = float(seen[:count] @ seen[:count]) / level
    best = min(fits, key=lambda one: one.bic)
    clear = 2 * float(np.log(SIGNIFICANCE))  # noise lowers the criterion by so much no more often than that
    if best.form != OFFSET and best.bic > fits[-1].bic + clear:  # an offset is a walk of no steps
        best = fits[-1]
    if best.bic > nought + clear:
        return nothing
    return Drift(run.name, best.form, best.size_mps2, best.time_s, best.curve(time_s), rate)


class _Cosines:
    """The first orthonormal cosines (k, n) of n samples: those that count, and some more for the noise."""

    def __init__(self, samples: int, count: int, more: int) -> None:
        from scipy.fft import dct, idct

        self._dct, self._idct = dct, idct
        self.samples, self.count, self.size = samples, count, max(more, count + 2)

    def of(self, samples: Array) -> Array:
        """Coefficients (k,) of samples (n,)."""
        return np.array(self._dct(samples, norm="ortho")[: self.size])  # a copy: a slice would keep them all

    def back(self, coefficients: Array) -> Array:
        """Samples (n,) of coefficients (k,)."""
        return np.asarray(self._idct(coefficients, n=self.samples, norm="ortho"))


Curve = Callable[[Array], Array]
_Form = tuple[float | None, Curve]


def _step(begins_s: float) -> Curve:
    return lambda at: np.where(at >= begins_s, 1.0, 0.0)


def _exponential(takes_s: float) -> Curve:
    return lambda at: np.asarray(np.exp(-at / takes_s))


def _shapes(time_s: Array, rate_hz: float) -> dict[str, list[_Form]]:
    """Curves by time that each form adds to a constant, each with its time (None: it has none). Sixty time constants
    are tried, from the shortest period to twice the run's length."""
    lasts_s = time_s[-1] + 1 / rate_hz
    steps = np.arange(time_s[0], time_s[-1], 0.1 / LOWEST_HZ)[1:]
    exponentials = np.geomspace(1 / LOWEST_HZ, 2 * lasts_s, 60)
    return {
        OFFSET: [],
        RAMP: [(None, lambda at: at / lasts_s)],
        STEP: [(float(one), _step(float(one))) for one in steps],
        EXPONENTIAL: [(float(one), _exponential(float(one))) for one in exponentials],
    }


def _fit_white(form: str, basis: _Cosines, seen: Array, level: float, time_s: Array, shapes: Sequence[_Form]) -> _Curve:
    """The most likely curve of a form, with a constant, in white noise."""
    if not shapes:
        offset = float(seen[0]) / float(np.sqrt(basis.samples))
        bic = float(seen[1:] @ seen[1:]) / level + float(np.log(basis.count))
        return _Curve(form, bic, offset, None, lambda at: np.full(len(at), offset))
    columns = np.stack([basis.of(shape(time_s))[: basis.count] for _, shape in shapes])
    # The constant is the first coefficient alone.
    free = columns[:, 1:]
    sizes = free @ seen[1:] / np.maximum((free**2).sum(axis=1), 1e-300)
    bics = ((seen[1:] - sizes[:, None] * free) ** 2).sum(axis=1) / level
    best = int(bics.argmin())
    known_s, shape = shapes[best]
    size = float(sizes[best])
    offset = float(seen[0] - size * columns[best, 0]) / float(np.sqrt(basis.samples))
    numbers = 2 if known_s is None else 3
    return _Curve(form, float(bics[best]) + numbers * float(np.log(basis.count)), size, known_s,
                lambda at: offset + size * shape(at))


def _fit_random_walk(basis: _Cosines, seen: Array, level: float, first: int) -> _Curve:
    """The most likely random walk in white noise."""
    numbers = np.arange(1, basis.count)
    powers = seen[1:] ** 2
    walks = np.geomspace(1e-2, 1e8, 81) * level
    spectra = level + walks[:, None] / numbers**2
    bics = (np.log(spectra / level) + powers / spectra).sum(axis=1)
    best = int(bics.argmin())
    kept = np.zeros(basis.count)
    kept[0] = seen[0]
    kept[1:] = seen[1:] * (1 - level / spectra[best])
    curve = basis.back(kept)
    whole = np.concatenate([np.full(first, curve[0]), curve])
    return _Curve(WANDER, float(bics[best]) + 2 * float(np.log(basis.count)), float(np.sqrt(np.mean(curve**2))), None,
                lambda at: whole)


@dataclass(frozen=True, eq=False)
class Removed:
    """Sensor drift, distance error and filtering that were removed.

    drifts                                       of the runs' sensors, one each
    drift_share, distance_share, filter_share    of the residual power of the model as it stands, at all frequencies
    distance_error_m                             the largest distance error, if it is unusual; else 0
    clock_ppm, lag_s                             how much faster the recorders of rigs run than the clock of what drives
                                                 these, and how late they are in the middle of a record: the largest; 0
                                                 where all else that is left may look like it
    error                                        normalised r.m.s. error of the fitted model without the drifts, and the
                                                 noise floor where the curves took some of the noise away
    """

    drifts: tuple[Drift, ...]
    drift_share: float
    distance_share: float
    filter_share: float
    distance_error_m: float
    clock_ppm: float
    lag_s: float
    error: float

    @cached_property
    def drifting_sensors(self) -> tuple[Drift, ...]:
        """The drifts that were found."""
        return tuple(one for one in self.drifts if one.found)

    def with_drifts(self, predictions: Sequence[Array]) -> list[Array]:
        """Predictions (n,) per run plus the sensors' drifts; other signals that are joined are unchanged."""
        return [_with_drift(one, drift) for one, drift in zip(predictions, self.drifts, strict=True)]


def removed_from(posterior: Posterior, plain: Sequence[Array], state: State) -> Removed:
    """Sensor drift, distance error and filtering of a fitted state.

    plain    predictions (n,) per run of the model as it stands
    """
    runs = posterior.runs.runs
    outside = sum(run.outside_mps2**2 * (run.count - run.first) for run in runs)
    fitted, whole = _power(runs, state.predictions), _power(runs, plain) + outside
    record = [error.without_distance_error(k) for error, k in zip(posterior.record_errors, state.record, strict=True)]
    at_recorded_distances = _power(runs, posterior.predict(state.effects, state.logs, record))
    noise = sensor_noise_of(posterior, state)
    drifts = tuple(drift_of(run, run.main(one), noise.deviation_mps2)
                   for run, one in zip(runs, posterior.without_rounding().residuals(state), strict=True))
    without_drift = _power(runs, [_with_drift(one, drift)
                                  for one, drift in zip(state.predictions, drifts, strict=True)])
    if not fitted - without_drift > LEAST_SHARE * fitted:
        drifts, without_drift = tuple(one.nothing_found() for one in drifts), fitted

    clocks = [np.append(-k[: one.places], 0.0)[:2] for one, k in zip(
        posterior.record_errors, state.record, strict=True) if one.run.timed and at_recorded_distances > 2 * fitted]
    faster, late_s = (float(max(some, key=abs, default=0.0)) for some in np.reshape(clocks, (-1, 2)).T)

    def share(power: float) -> float:
        return float(min(max(power / whole, 0.0), 1.0)) if whole > 0 else 0.0

    measured = sum(float(run.kept_readings_mps2 @ run.kept_readings_mps2) for run in runs)
    floor = floor_error(posterior, sensor_noise_with_rounding(posterior, state))
    return Removed(drifts, share(fitted - without_drift), share(at_recorded_distances - fitted), share(outside),
                   unusual_distance_error_m(posterior.record_errors, state.record), 1e6 * faster, late_s,
                   min(max(float(np.sqrt(without_drift / measured)), floor), float(np.sqrt(fitted / measured)))
                   if measured > 0 else float("nan"))


def _with_drift(prediction: Array, drift: Drift) -> Array:
    """A prediction (n,), or more signals joined to it, plus the drift of its sensor."""
    found = prediction.copy()
    found[: len(drift.curve_mps2)] += drift.curve_mps2
    return found


def _power(runs: Sequence[Run], predictions: Sequence[Array]) -> float:
    """Sum of squares of the residuals of predictions (n,) per run [m2/s4]."""
    return sum(float((run.residual(run.main(one))[run.first:] ** 2).sum())
               for run, one in zip(runs, predictions, strict=True))


@dataclass(frozen=True)
class SpatialLine:
    """A line at a wave number, in the run where it is most significant: the wave number [1/m], the run's usual speed,
    the p-value (1 where runs at other speeds do not have it), and the powers (n,) at all wave numbers (n,) [1/m] over
    their mean.

    steady    the speed hardly changed, so that it may as well be a line in time
    """

    run: str
    at_per_m: float
    speed_mps: float
    p_value: float
    per_m: Array
    power: Array
    steady: bool

    @property
    def found(self) -> bool:
        """Whether the line is significant."""
        return self.p_value < SIGNIFICANCE


@dataclass(frozen=True, eq=False)
class Shape:
    """Residuals of a model: their power by frequency, speed, excitation and place, their tests, and the strongest line
    along the way (None: there is none)."""

    residuals: ModelResiduals
    where: Breakdown
    tests: ResidualTestResults
    line: SpatialLine | None


def shape_of(posterior: Posterior, state: State, removed: Removed) -> Shape:
    """The shape of the residuals of a fitted model, without the drift of its sensors."""
    runs, car = posterior.runs, posterior.car(state.effects, state.logs)
    responses = runs.respond(car, posterior.distance_error_m(state.record))
    residuals, as_recorded = (
        ModelResiduals(runs.runs, car, [run.main(one) for run, one in zip(runs.runs, some, strict=True)], responses)
        for some in map(removed.with_drifts, (state.predictions, runs.predict(car))))
    where = breakdown(residuals)
    return Shape(residuals, where, run_residual_tests(ResidualEvidence(residuals, where, as_recorded)),
                 spatial_line_of(residuals))


def spatial_line_of(residuals: ModelResiduals) -> SpatialLine | None:
    """The strongest line along the way, at the wave numbers of one to three in a turn of a wheel of 0.22 to 0.5 m
    radius. A tone in time is distinguished from it where the speed changes, or where another run has another speed.
    Runs that are slower than 1 m/s somewhere are not tested."""
    found, names = [], short_names(residuals.runs)
    for run, residual in zip(residuals.runs, residuals.residual, strict=True):
        speed = run.speed_mps[run.first:]
        if speed.min() < 1.0 or run.distance_m[-1] <= run.distance_m[run.first]:
            continue
        way, usual_mps = np.maximum.accumulate(run.distance_m[run.first:]), float(np.median(speed))
        step_m = usual_mps / run.rate_hz
        along = np.interp(np.arange(way[0], way[-1], step_m), way, residual)
        waves_per_m = np.fft.rfftfreq(len(along), step_m)
        asked = (waves_per_m > 0.3) & (waves_per_m < 2.2)
        power = periodogram(along)
        line = strongest_line(power, asked)
        if line is None or asked.sum() < NEIGHBOURS:
            continue
        at_per_m = float(waves_per_m[line[0]])
        # A tone in time whose phase along the way varies by a cycle or more is no line there.
        steady = _schedule_range_s(way, run.rate_hz) * at_per_m * usual_mps < 1
        found.append(SpatialLine(names[run.name], at_per_m, usual_mps, line[1],
                                 np.asarray(waves_per_m[asked], float), power[asked] / float(power[asked].mean()),
                                 steady))
    best = min(found, key=lambda one: one.p_value, default=None)
    if best is None:
        return None
    best = replace(best, p_value=min(1.0, best.p_value * len(found)))
    others = [one for one in found if abs(one.speed_mps / best.speed_mps - 1) > 0.05]
    if not best.steady or not others:
        return best
    # A tapered line is two ordinates wide.
    recurs = any(one.found and abs(one.at_per_m - best.at_per_m) < 2 * max(
        np.diff(line.per_m[:2])[0] for line in (one, best)) for one in others)
    return replace(best, steady=False) if recurs else replace(best, p_value=1.0)


def _schedule_range_s(way_m: Array, rate_hz: float) -> float:
    """Range of the deviation from a steady speed's schedule along the way [s]."""
    time_s = np.arange(len(way_m)) / rate_hz
    return float(np.ptp(time_s - np.polyval(np.polyfit(way_m, time_s, 1), way_m)))


COLOUR = frozenset({"whiteness", "frequency"})
"""Tests of a residual that only say that it has a colour."""


def is_coloured_noise(posterior: Posterior, state: State) -> bool:
    """Whether what a fitted state leaves is noise of a colour, as ``coloured_noise`` finds it."""
    # That hardly any of it may grow with the motion is computed at once; tests of it take longer.
    bands = posterior.bands
    if _steady_noise(bands, posterior.residuals(state), state.predictions) is None:
        return False
    shape = shape_of(posterior, state, removed_from(posterior, state.predictions, state))
    return coloured_noise(bands, shape) is not None


def coloured_noise(every: Sequence[JointBands], shape: Shape) -> NoiseLevel | None:
    """The noise of a residual that has a colour, by the bands of each run; None where it may be more than that, or the
    runs do not show it."""
    if _is_related(shape):
        return None
    residuals = shape.residuals
    return _steady_noise(every, _whole(residuals.residual, every), _whole(residuals.model, every))


def _steady_noise(every: Sequence[JointBands], residual: Sequence[Array], model: Sequence[Array]) -> NoiseLevel | None:
    """The noise of residuals (n,) per run that fall or rise with frequency and surely do not grow with a model's motion
    (n,); None as well where there are several signals, or runs are compared in several bands."""
    bands = [one for run in every for one in run.each]
    if len(bands) > len(every) or len({one.edges_hz.tobytes() for one in bands}) > 1:
        return None
    power, motion = (np.concatenate([one.block_powers(samples) for one, samples in zip(bands, some, strict=True)])
                     for some in (residual, model))
    grows, error = growing_power(power, motion)
    freedom = np.sum([one.freedom for one in bands], axis=0)
    if not is_monotonic(power.mean(axis=0), freedom):
        return None
    mean = float(freedom @ power.mean(axis=0)) / float(freedom.sum())
    may_grow = (max(float(freedom @ grows), 0.0) + SURE_SIGMA * float(np.linalg.norm(freedom * error))) / float(
        freedom.sum())
    if not mean - may_grow > mean / (1 + UNEXPLAINED) ** 2:
        return None
    level = mean - max(float(freedom @ grows) / float(freedom.sum()), 0.0)
    return NoiseLevel(float(np.sqrt(level)), float(np.sqrt(level / (2 * freedom.sum()))))


def is_monotonic(levels: Array, freedom: Array) -> bool:
    """Whether levels (b,) with these degrees of freedom fall or rise with frequency throughout, as a sensor's noise
    does; a hum makes a hill. None may lie above the nearest levels that do (isotonic regression) by more than what
    counts as explained and ``UNUSUAL_SIGMA`` standard errors."""
    most = (1 + UNEXPLAINED) ** 2 * (1 + UNUSUAL_SIGMA * np.sqrt(2 / freedom))
    falling = rising_levels(levels[::-1], freedom[::-1])[::-1]
    return any(bool((levels <= most * nearest).all()) for nearest in (falling, rising_levels(levels, freedom)))


def rising_levels(levels: Array, weights: Array) -> Array:
    """The nearest levels (b,) that never fall: the largest of the least weighted means of what begins at or before each
    and ends at or after it (R. E. Barlow et al., Statistical Inference under Order Restrictions, 1972)."""
    weight, total = (np.concatenate([[0.0], np.cumsum(one)]) for one in (weights, weights * levels))
    count = len(levels)
    return np.array([max(min((total[end] - total[first]) / (weight[end] - weight[first])
                             for end in range(place + 1, count + 1)) for first in range(place + 1))
                     for place in range(count)])


def _is_related(shape: Shape) -> bool:
    """Whether a test relates a residual to anything but its own colour."""
    line = shape.line is not None and shape.line.found
    return line or any(one.name not in COLOUR for one in shape.tests.found)


def _whole(parts: Sequence[Array], bands: Sequence[JointBands]) -> list[Array]:
    """Samples that count of each run, as of all of it."""
    return [np.concatenate([np.zeros(one.each[0].first), part]) for part, one in zip(parts, bands, strict=True)]
