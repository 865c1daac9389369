"""Batch estimation of a complete drive: its windows, their errors, and the errors that are the least possible; and the
road itself, from the pieces that the estimator gives: joined, and cut to the wavelengths that the readings resolve; all
of it beside the exact IRI where that is known.

Problem. Neighbouring pieces come from different solutions and may stand at different heights by a slow wave that no
reading tells; joined end to start, their heights would be steps. And an estimate holds waves that are mostly belief.

Solution. Pieces are joined by their increments, which the slow waves hardly touch. Then waves longer than the longest
and shorter than the shortest resolved wavelength are taken out. That range changes with the speed; one range is taken
for the whole drive, the one resolved over at least ``RESOLVED_SHARE`` of the distance at either end. Where a piece is
missing one part of the profile ends and another begins.

A piece says which wavelengths the readings resolve; beyond 100 m (``FLATTENED_BELOW_CPM``) the estimator expects no
more of a road than there (``RoadSpectrum``), as roads of ISO 8608 end there too.

A record may be in other units, its distance may jump or go back: ``estimable`` refuses what cannot be meant. And an
estimate alone does not say how good it is or could be: ``assess`` sets beside it what an estimator could reach that
knew the road's spectrum, the sensor's noise and the car exactly.
"""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from fractions import Fraction
from functools import cache
from math import ceil, exp, isfinite, log, sqrt
from typing import Any

import numpy as np

from logger.arrays import ROUNDING, Array, Bools
from logger.bounds import BACK_M, EVEN_SAMPLES, time_hint
from logger.dsp.weightings.weighting import LOWEST_RATE_HZ
from logger.estimation.car_response import SPEEDS_PER_E
from logger.estimation.error_bound import ErrorBound, pooled_r2
from logger.estimation.rms_calibration import LEVELS_IRI
from logger.estimation.road_spectrum import FLATTENED_BELOW_CPM, RoadSpectrum
from logger.estimation.sensor_noise import UNKNOWN_LOG_STD, NoiseBelief, Sensor
from logger.estimation.streaming import BALANCED_LAG_S, RoadEstimator, RoadPiece
from logger.estimation.time_grid import RATE_HZ
from logger.profiles.track import Track
from logger.roads.iri import COARSEST_SPACING_M, START_M, likely_unit, rectified_slope, window_iri
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, RoadEffect
from logger.vehicle.linearise import KnownCar, known_car
from logger.vehicle.uncertain import NumberErrors, cars_off
from logger.vehicle.vehicle import GENERIC, Vehicle

LEVEL_REACH_M = 50.0
"""A window's road is as rough as the mean of the windows so far to both sides."""
_SMOOTHEST_M_PER_KM = 0.1
_NOISE_ROUNDS, _NEAR_ENOUGH = 3, 0.3
_SMOOTHED_S = 2.0
_FINEST_RATIO = 2000
RESOLVED_SHARE = 0.75
_ORDER = 8
SPEED_CLASS_MPS = 5.0
_WAYS_DIFFER = 0.1
_LEAST_WAY_M = 10.0  # over less, a distance from GPS may well differ from the integral of the speed


@dataclass(frozen=True)
class Windows:
    """Windows one after the other, n of them, that begin at whole multiples of their length.

    edges_m            (n + 1,) [m]
    speed_mps          (n,) mean speed over each [m/s]
    iri_m_per_km       (n,) NaN where it is not known, ``flags`` say why
    iri_std_m_per_km   (n,) its standard error, NaN likewise
    resolved           (n,) share of the variance of the IRI's slope that the readings resolve
    flags              n sets of words
    """

    edges_m: Array
    speed_mps: Array
    iri_m_per_km: Array
    iri_std_m_per_km: Array
    resolved: Array
    flags: tuple[frozenset[str], ...]


def on_grid(sensor: Sensor, rate_hz: float, accel_mps2: Array, distance_m: Array) -> tuple[Sensor, Array, Array]:
    """Sensor, readings and distances, as recorded at some rate, on the grid of 100 Hz; arrays (n,) in, (t,) out.

    What a change of rate leaves of noise and steps is one noise with the same power per hertz. A recorder slower than
    100 Hz passes less of what is quick than the estimator expects: at 80 Hz its IRI is some 3 % high.
    """
    ratio = Fraction(RATE_HZ / rate_hz).limit_denominator(_FINEST_RATIO)
    if ratio == 1:
        return sensor, accel_mps2, distance_m
    from scipy.signal import resample_poly  # takes a while to load

    place = np.arange(ceil(len(accel_mps2) * ratio)) / float(ratio)
    place = place[place <= len(accel_mps2) - 1]
    readings = resample_poly(accel_mps2, ratio.numerator, ratio.denominator, padtype="line")[: len(place)]
    noise_mps2 = sqrt(sensor.variance_mps2_2 * RATE_HZ / rate_hz)
    return Sensor(noise_mps2, 0.0), readings, np.interp(place, np.arange(len(distance_m)), distance_m)


def monotonic_distance(distance_m: Array, speed_mps: Array, rate_hz: float) -> Array:
    """Distances (n,) [m] by the speed (n,) [m/s], not decreasing, that keep to those given: the integral of the speed
    plus the moving mean over 2 s of what they differ from it."""
    driven = np.concatenate([[0.0], np.cumsum(0.5 * (speed_mps[1:] + speed_mps[:-1]))]) / rate_hz
    half = round(_SMOOTHED_S * rate_hz / 2)
    about = np.full(2 * half + 1, 1 / (2 * half + 1))
    mean = np.convolve(np.pad(distance_m - driven, half, mode="edge"), about, mode="valid")
    return np.asarray(np.maximum.accumulate(driven + mean))


def estimated(
    car: KnownCar, sensor: Sensor, window_m: float, reading_mps2: Array, distance_m: Array,
    off: Sequence[KnownCar] = (), is_measured: bool = True, noise_log_std: float = 0.0,
) -> "tuple[Windows, RoadProfile | None]":
    """Windows and road of a drive on the grid of 100 Hz, arrays (t,) as ``RoadEstimator.push`` takes them; ``off``,
    ``is_measured`` the cars that it may be instead, and ``noise_log_std`` how well the noise is known, as
    ``RoadEstimator`` has them."""
    pieces: list[RoadPiece] = []
    estimator = RoadEstimator(car, sensor, window_m, on_road=pieces.append, off=off, is_measured=is_measured,
                              noise_log_std=noise_log_std, lag_s=BALANCED_LAG_S)
    count = len(reading_mps2)
    found = estimator.push(reading_mps2, np.ones(count, dtype=np.bool_), np.zeros(count), distance_m)
    found += estimator.finish()
    first = found[0].number if found else 0
    edges_m: Array = window_m * np.arange(first, first + len(found) + 1, dtype=np.float64)
    passed_s = np.interp(edges_m, distance_m, np.arange(count) / RATE_HZ)
    return Windows(edges_m, np.diff(edges_m) / np.diff(passed_s), np.array([one.iri_m_per_km for one in found]),
                   np.array([one.iri_std_m_per_km for one in found]), np.array([one.resolved for one in found]),
                   tuple(one.flags for one in found)), road_profile(pieces)


def learned_noise(
    car: KnownCar, sensor: Sensor, window_m: float, reading_mps2: Array, distance_m: Array
) -> NoiseBelief | None:
    """The noise of a sensor, of which ``sensor`` holds a guess, by a drive as ``estimated`` takes it; None where the
    drive shows nothing of it.

    What was found on the way may come from far off, so the drive is gone through again from there.
    """
    count = len(reading_mps2)
    belief = NoiseBelief.guessed(sensor.noise_rms_mps2)
    for _ in range(_NOISE_ROUNDS):
        before = NoiseBelief(belief.log_mean, UNKNOWN_LOG_STD)
        tried = Sensor(before.noise_rms_mps2, sensor.step_mps2)
        estimator = RoadEstimator(car, tried, window_m, noise=before)
        estimator.push(reading_mps2, np.ones(count, dtype=np.bool_), np.zeros(count), distance_m)
        found = estimator.road.noise
        if found is None or not estimator.road.noise_stretches:
            return None
        belief = found
        if abs(belief.log_mean - before.log_mean) < _NEAR_ENOUGH * belief.log_std:
            break
    return belief


def exact_iri(edges_m: Array, elevation_m: Array, spacing_m: float, start_m: float) -> Array:
    """IRI (n,) [m/km] between edges (n + 1,) on a profile that begins at ``start_m``; NaN for what is not all on it.

    The Golden Car comes from where the car came from: a flat road before the profile. So the first windows differ from
    the IRI of the profile alone, for which it starts with the profile's mean slope. A profile too coarse for the IRI
    is the straight lines between its samples.
    """
    if spacing_m > COARSEST_SPACING_M:
        parts = ceil(spacing_m / COARSEST_SPACING_M)
        place = np.arange((len(elevation_m) - 1) * parts + 1) / parts
        elevation_m, spacing_m = np.interp(place, np.arange(len(elevation_m)), elevation_m), spacing_m / parts
    lead = ceil(START_M / spacing_m)
    slope = rectified_slope(np.concatenate([np.full(lead, elevation_m[0]), elevation_m]), spacing_m)
    begin_m, end_m = start_m - lead * spacing_m, start_m + (len(slope) - lead) * spacing_m
    exact = np.full(len(edges_m) - 1, np.nan)
    inside = np.flatnonzero((edges_m >= start_m) & (edges_m <= end_m))
    if len(inside) > 1:
        exact[inside[:-1]] = window_iri(slope, spacing_m, edges_m[inside] - begin_m)
    return exact


@dataclass(frozen=True)
class Score:
    """How estimates compare with exact values. r2 is 1 - mean(error^2) / var(exact); bias, relative, is of the mean;
    then the shares of windows within one and two of their standard errors, 0.68 and 0.95 where those are right."""

    windows: int
    r2: float
    bias: float
    within_one: float
    within_two: float


def score(windows: Windows, exact: Array, which: Bools) -> Score | None:
    """For windows that are marked (n,), answered and have an exact IRI (n,); None when these do not differ."""
    known = which & np.isfinite(windows.iri_m_per_km) & np.isfinite(exact)
    error, truth = (windows.iri_m_per_km - exact)[known], exact[known]
    if len(truth) == 0 or np.ptp(truth) == 0:
        return None
    in_errors = np.abs(error) / windows.iri_std_m_per_km[known]
    return Score(len(error), float(1 - np.mean(error**2) / np.var(truth)), float(np.mean(error) / np.mean(truth)),
                 float(np.mean(in_errors <= 1)), float(np.mean(in_errors <= 2)))


def local_level(iri_m_per_km: Array, window_m: float) -> Array:
    """Mean IRI (n,) of the known ones within ``LEVEL_REACH_M`` of each window; NaN where there is none."""
    reach = round(LEVEL_REACH_M / window_m)
    known = np.isfinite(iri_m_per_km)
    around = np.ones(2 * reach + 1)
    sums, counts = (np.convolve(row, around)[reach: reach + len(row)] if len(row) else row
                    for row in (np.where(known, iri_m_per_km, 0.0), known))
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def least_errors(limits: ErrorBound, speed_mps: Array, level_m_per_km: Array) -> Array:
    """R.m.s. error (n,) of the best possible IRI at these speeds on roads of these levels, both (n,), waviness 2.

    NaN where the level is not known; no road is smoother than ``_SMOOTHEST_M_PER_KM``.
    """

    @cache
    def least(speed_step: int, level_step: int) -> float:
        spectrum = RoadSpectrum.of_iri(exp(level_step / SPEEDS_PER_E))
        return limits.at(exp(speed_step / SPEEDS_PER_E), spectrum).std_m_per_km

    known = np.isfinite(level_m_per_km)
    level = np.maximum(level_m_per_km, _SMOOTHEST_M_PER_KM)
    result = np.full(len(speed_mps), np.nan)
    steps = (np.round(np.log(row[known]) * SPEEDS_PER_E).astype(int).tolist() for row in (speed_mps, level))
    result[known] = [least(speed, level) for speed, level in zip(*steps, strict=True)]
    return result


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


def road_profile(pieces: Sequence[RoadPiece]) -> RoadProfile | None:
    """The profile that pieces make, in the order they came; None when the readings resolve no wavelength over enough of
    them."""
    resolved = [piece for piece in pieces if isfinite(piece.shortest_m)]
    if not resolved or len(resolved) < RESOLVED_SHARE * len(pieces):
        return None
    shortest_m = float(np.quantile([piece.shortest_m for piece in resolved], RESOLVED_SHARE))
    longest_m = min(float(np.quantile([piece.longest_m for piece in resolved], 1 - RESOLVED_SHARE)),
                    1 / FLATTENED_BELOW_CPM)
    if shortest_m >= longest_m:
        return None
    joined = [_joined(run) for run in _runs(resolved)]
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
        if not abs(piece.start_m - end_m) < EVEN_SAMPLES * piece.spacing_m:
            runs.append([])
        runs[-1].append(piece)
        end_m = piece.start_m + (len(piece.elevation_m) - 1) * piece.spacing_m
    return runs


def _joined(pieces: Sequence[RoadPiece]) -> ProfilePart:
    rises = np.concatenate([np.diff(piece.elevation_m) for piece in pieces])
    return ProfilePart(pieces[0].start_m, pieces[0].spacing_m, np.concatenate([[0.0], np.cumsum(rises)]))


class Unusable(ValueError):
    """A record that nothing can be estimated from; ``sample``: the number of the first that is wrong, None: all."""

    def __init__(self, message: str, sample: int | None = None) -> None:
        super().__init__(message)
        self.sample = sample


@dataclass(frozen=True)
class Estimable:
    """A drive ready for the estimator, arrays (n,): samples at ``rate_hz``, distances that do not decrease.

    moved_m    the farthest that a distance was moved to make them so [m]; 0 where they are the file's
    """

    rate_hz: float
    accel_z_mps2: Array
    distance_m: Array
    moved_m: float


def estimable(
    rate_hz: float, accel_z_mps2: Array, speed_mps: Array, distance_m: Array, fastest_mps: float
) -> Estimable:
    """A drive of samples (n,) at an even rate, made ready. ``Unusable`` for one too slow, for a distance that jumps
    (faster than ``fastest_mps``) or goes back farther than a correction, and for a speed that does not go with it."""
    if rate_hz < LOWEST_RATE_HZ * (1 - 1e-3):
        raise Unusable(f"expected at least {LOWEST_RATE_HZ:g} samples a second, found {rate_hz:.4g}"
                       f"{time_hint(rate_hz)}")
    _check_way(distance_m, fastest_mps / rate_hz)
    _check_speed(rate_hz, speed_mps, distance_m)
    if (np.diff(distance_m) >= 0).all():
        return Estimable(rate_hz, accel_z_mps2, distance_m, 0.0)
    monotonic_m = monotonic_distance(distance_m, speed_mps, rate_hz)
    return Estimable(rate_hz, accel_z_mps2, monotonic_m, float(np.abs(monotonic_m - distance_m).max()))


def _check_way(distance_m: Array, longest_m: float) -> None:
    """Refuse a distance that jumps, or goes back farther than a correction would take it."""
    back = distance_m < np.maximum.accumulate(distance_m) - BACK_M
    jump = np.diff(distance_m, prepend=distance_m[0]) > longest_m + BACK_M
    if (wrong := back | jump).any():
        row = int(np.argmax(wrong))
        limit = (f"no more than {BACK_M:g} m below the largest so far, {distance_m[:row].max():.10g} m" if back[row]
                 else f"at most {longest_m + BACK_M:.4g} m after {distance_m[row - 1]:.10g} m")
        raise Unusable(f"expected a distance {limit}, found {distance_m[row]:.10g}", row)


def _check_speed(rate_hz: float, speed_mps: Array, distance_m: Array) -> None:
    """Refuse a speed that does not go with the distance, such as one in km/h."""
    speed = np.abs(speed_mps)
    way_m = float(distance_m[-1] - distance_m[0])
    integral_m = float(np.sum(speed[1:] + speed[:-1])) / 2 / rate_hz
    larger_m = max(way_m, integral_m)
    if larger_m > _LEAST_WAY_M and abs(way_m - integral_m) > _WAYS_DIFFER * larger_m:
        factor = f"{integral_m / way_m:.3g}" if way_m > 0 else "infinitely many"
        raise Unusable(f"expected speed_mps and distance_m to agree within {_WAYS_DIFFER:.0%}, found "
                       f"{integral_m:.4g} m by speed_mps, {factor} times the {way_m:.4g} m of distance_m "
                       f"({likely_unit(integral_m, way_m)})")


@dataclass(frozen=True)
class Assessment:
    """All results on a drive's road.

    exact_m_per_km          (w,) IRI of the profile in each window, NaN where it has none
    compared                whether there is a profile to compare with
    least_error_m_per_km    (w,) r.m.s. error of the best possible values
    noise                   of a reading before rounding, where it was learned from the drive; ``sensor`` has it
    learns_noise            whether that was to be learned
    road_effects            names of the effects that make the road that is compared with out of its profile
    """

    vehicle: Vehicle
    drive: Estimable
    sensor: Sensor
    window_m: float
    windows: Windows
    exact_m_per_km: Array
    compared: bool
    least_error_m_per_km: Array
    limits: ErrorBound
    road: RoadProfile | None
    noise: NoiseBelief | None
    learns_noise: bool = False
    road_effects: tuple[str, ...] = ()


def assess(
    drive: Estimable, vehicle: Vehicle, sensor: Sensor, window_m: float, track: Track | None,
    learns_noise: bool = False, effects: Sequence[Chosen] = (), errors: NumberErrors | None = None,
) -> Assessment:
    """Estimate a drive's road in windows [m] and compare it with the track it was driven on, if that is known.

    effects, errors    of the vehicle, and how far its numbers may be off; where an effect is of the road, the track is
                       a profile that differs from the road, and this is what is compared with

    Where the noise is to be learned, the sensor's is a guess. ValueError if the vehicle lacks what its model or an
    effect needs.
    """
    composed = compose(vehicle, effects)
    car = known_car(composed)
    gridded, readings, distance_m = on_grid(sensor, drive.rate_hz, drive.accel_z_mps2,
                                            composed.driven(drive.distance_m))
    noise = None
    noise_log_std = 0.0
    if learns_noise:
        noise = learned_noise(car, gridded, window_m, readings, distance_m)
    if noise is not None:
        gridded, noise_log_std = Sensor(noise.noise_rms_mps2, gridded.step_mps2), noise.log_std
        noise = NoiseBelief(noise.log_mean + 0.5 * log(drive.rate_hz / RATE_HZ), noise.log_std)
        if gridded.step_mps2 != sensor.step_mps2:  # another rate has made one noise of both
            noise = noise.without_rounding(sensor.step_mps2)
        sensor = Sensor(noise.noise_rms_mps2, sensor.step_mps2)
    windows, road = estimated(car, gridded, window_m, readings, distance_m, cars_off(vehicle, effects, errors),
                              vehicle.name != GENERIC, noise_log_std)
    exact = np.full(len(windows.iri_m_per_km), np.nan)
    road_effects = tuple(one.effect.name for one in effects if isinstance(one.effect, RoadEffect))
    if track is not None:
        track = track.as_it_is(composed.structure.surface, ())
        # Of two tracks their mean for a full car, else the left one.
        tracks_m = track.elevation_m.reshape(len(track.elevation_m), -1)[:, :2 if vehicle.model == "full_car" else 1]
        exact = exact_iri(windows.edges_m, tracks_m.mean(axis=1), track.spacing_m, track.start_m)
    limits = ErrorBound(car, gridded, window_m)
    level = local_level(np.where(np.isfinite(exact), exact, windows.iri_m_per_km), window_m)
    return Assessment(vehicle, drive, sensor, window_m, windows, exact, track is not None,
                      least_errors(limits, windows.speed_mps, level), limits, road, noise, learns_noise,
                      road_effects if track is not None else ())


def speed_classes(windows: Windows) -> Iterator[tuple[float, Bools]]:
    """The lower end of each class of speed that was driven [m/s], and which windows (w,) are in it."""
    number = np.floor(windows.speed_mps / SPEED_CLASS_MPS + ROUNDING).astype(int)
    for one in np.unique(number).tolist():
        yield one * SPEED_CLASS_MPS, number == one


def figures(found: Assessment, which: Bools) -> dict[str, Any]:
    """Figures of the windows that are marked (w,): named, SI units in the names; those that are not known are left
    out."""
    windows = found.windows
    answered = which & np.isfinite(windows.iri_m_per_km)
    result: dict[str, Any] = {"window_count": int(which.sum()), "answered_count": int(answered.sum())}
    if not answered.any():
        return result
    iri, least = windows.iri_m_per_km[answered], found.least_error_m_per_km[answered]
    speed_mps, mean = float(windows.speed_mps[answered].mean()), float(iri.mean())
    result |= {
        "speed_mps": speed_mps, "iri_m_per_km": mean, "iri_min_m_per_km": float(iri.min()),
        "iri_max_m_per_km": float(iri.max()), "iri_std_m_per_km": _rms(windows.iri_std_m_per_km[answered]),
        "limit": {
            "std_m_per_km": _rms(least),
            "r2_this_road": found.limits.at(speed_mps, RoadSpectrum.of_iri(mean)).r2,
            "r2_iri_1_to_10": pooled_r2([found.limits.at(speed_mps, RoadSpectrum.of_iri(iri)) for iri in LEVELS_IRI]),
        },
    }
    compared = score(windows, found.exact_m_per_km, which)
    if compared is not None:
        known = answered & np.isfinite(found.exact_m_per_km)
        squares = np.mean(found.least_error_m_per_km[known] ** 2)
        limit_r2 = float(1 - squares / np.var(found.exact_m_per_km[known]))
        result["comparison"] = {**asdict(compared), "limit_r2": limit_r2}
    return result


def _rms(values: Array) -> float:
    return float((values**2).mean()) ** 0.5
