"""The box's own measure on roads whose roughness changes: beside a page of linear algebra, and the limit.

    python -m tests.benchmarks.changing_roads [--roads sections,constant] [--mph 10,40,city] [--range 2,8]
        [--noise 0.147] [--reads 1] [--waviness 2.0] [--learn] [--profile FILE.csv] [--draws 1] [--km 2.4] [--gps]
        [--comfort] [--best 1200] [--cells N]

A cell is one kind of road, one speed and one sensor. Places are exact; with ``--gps`` the whole service drives, with a
receiver of 1 Hz whose places wander by 0.8 m and that is 0.15 s late, as it is told. Without ``--cells`` all values
meet; with it so many cells are drawn, in which each value is equally frequent, each with another road. Each line holds,
over the windows of 25 ft: R2 of ridelog, of the plain method, and of an estimator that knows road, level and car
("limit"); the bias of all windows, of the smooth third and of the rough third of the road, by its mean IRI over 100 m;
the windows within one and two of their standard errors; the same for sections of 50 m, 0.1 mi and 1 km as ``ridelog
sections`` makes them;
with ``--comfort`` and ``--gps`` the bias of the mean a_w of the windows, and their share within its standard errors;
and the processor time per driven second, with comfort where that is asked for. Right of the bar stands the plain
method's bias. The city's drive stops, starts and turns between 0 and 16 m/s.

Of no estimator are thirds that the truth chooses without bias where the readings say little: the expected truth, given
the readings, lies nearer to the usual road, so the smooth third reads too rough, and of it only windows that seem rough
enough are answered. Without bias are thirds that the estimate chooses ("chosen by it"). ``--best`` draws, on constant
roads and sections, so many times from all roads that lead to these readings (``rounding_limit``): their mean is the
best estimate, of the same windows; no other has a smaller error. Both thirds of the road, and those that it chooses,
stand beside it, and how far two chains lie apart (r.m.s., as a share of the deviation of the exact IRI): above some 0.2
they have not settled. Laps of 2.4033 km at 20 mph take half the time of 2.4 km: their samples are quick to transform.

Roads: ``sections`` change their level at steps, 20 to 500 m apart, by factors of 2 to 16 in the spectrum; ``slow`` ones
swell over some 200 m; ``constant`` ones do not change; ``holes`` are constant with potholes, bumps, joints and patches.
``--profile`` is a measured one instead (columns distance_m, elevation_m), driven there and back.

The plain method: the spectrum's level is a hidden Markov chain over blocks of 20 m whose evidence is that of Whittle;
the waviness is the most probable one; for each level a Wiener filter, and the mean of the folded normal distribution,
weighted by the level's posterior probability. Rounding is white noise.

Goals: R2 not below the plain method's, bias within 2 %, thirds within 5 % or as the best's, coverage 0.64 to 0.72 and
0.93 to 0.97, a_w within 3 %.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from math import inf, nan, pi, sqrt
from pathlib import Path

import numpy as np

from logger.dsp.weightings.wk import WEIGHTING
from logger.estimation.batch import local_level
from logger.estimation.sensor_noise import NoiseBelief, Sensor
from logger.estimation.streaming import RoadEstimator, WindowEstimate
from logger.report.placed import column, iri_errors, placed
from logger.roads.sections import SectionWindows, WindowErrors, even_edges, sections
from logger.service.signal_chain import GRID_STEP_US
from logger.units import FOOT_M, MPH_MPS, STANDARD_GRAVITY_MPS2, WINDOW_M
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import half_car
from logger.vehicle.structure import body_point

from ..support.drives.measured import (
    GRID_HZ,
    SPACING_M,
    Accelerometer,
    Drive,
    Receiver,
    Road,
    iso_road,
    measured_like_road,
    place_of,
    recorder_response,
    road_response,
    steady_drive,
    thinned,
    varied_drive,
)
from .comfort_noise import weighted_by_scipy
from .estimator import LEAD_S, PUSH, START_US, TOWN, config_for, known_best, logged_records, on_grid, r2, rav4, reported
from .rounding_limit import CELL_M, NONE, Changes, Lap, best_values

Array = np.ndarray

FIRST_SEED = 960_000
SECTIONS_M, STEPS = (20.0, 500.0), (2.0, 16.0)
LATENCY_S = 0.15
GUESS_MPS2 = 0.1


# --- roads -----------------------------------------------------------------------------------------------------------


def sectioned_road(seed: int, waviness: float, length_m: float) -> Road:
    """Steps of the level, 20 to 500 m apart, by factors of 2 to 16."""
    rng = np.random.default_rng(seed)
    level, at_m = np.zeros(round(length_m / SPACING_M)), 0.0
    now = 0.0
    while at_m < length_m:
        until_m = at_m + np.exp(rng.uniform(*np.log(SECTIONS_M)))
        level[round(at_m / SPACING_M):round(until_m / SPACING_M)] = now
        change = rng.uniform(*np.log(STEPS))
        now, at_m = now + (-change if now > 0.5 else change if now < -0.5 else rng.choice((-1, 1)) * change), until_m
    return with_gain("sections", iso_road(2.5, length_m, seed, waviness), np.exp(0.5 * level))


def changes_of_sections() -> Changes:
    """The same as a Markov chain, of which the length of a section has the mean, and no least one."""
    values = np.linspace(-np.log(STEPS[1]), np.log(STEPS[1]), 57)
    change = np.abs(values - values[:, None])
    moves = ((change >= np.log(STEPS[0])) & (change <= np.log(STEPS[1]))
             & ((values[:, None] <= 0.5) | (values < values[:, None]))
             & ((values[:, None] >= -0.5) | (values > values[:, None]))).astype(float)
    share = CELL_M / (np.diff(SECTIONS_M) / np.diff(np.log(SECTIONS_M))).item()
    return Changes(values, share * moves / moves.sum(axis=1, keepdims=True) + (1 - share) * np.eye(len(values)))


def slow_road(seed: int, waviness: float, length_m: float) -> Road:
    """A level that swells: its logarithm has a deviation of 0.8 and no wave shorter than some 200 m."""
    rng = np.random.default_rng(seed)
    count = round(length_m / SPACING_M)
    waves = np.exp(-0.5 * (np.fft.rfftfreq(count, SPACING_M) * 200.0) ** 2) * (
        rng.standard_normal((2, count // 2 + 1)).T @ (1, 1j))
    waves[0] = 0.0
    level = np.fft.irfft(waves, count)
    return with_gain("slow", iso_road(2.5, length_m, seed, waviness), np.exp(0.4 * level / level.std()))


def constant_road(seed: int, waviness: float, length_m: float) -> Road:
    """One level: 1.2, 2.5 or 5 m/km by the seed."""
    return iso_road((1.2, 2.5, 5.0)[seed % 3], length_m, seed, waviness)


def road_with_holes(seed: int, waviness: float, length_m: float) -> Road:
    """As profilers find them; the waviness is drawn with the road."""
    return measured_like_road((1.5, 3.0, 5.0)[seed % 3], length_m, seed)


ROADS: dict[str, Callable[[int, float, float], Road]] = {
    "sections": sectioned_road, "slow": slow_road, "constant": constant_road, "holes": road_with_holes}
CHANGES: dict[str, Callable[[], Changes]] = {"iso": lambda: NONE, "sections": changes_of_sections}


def with_gain(kind: str, road: Road, gain: Array) -> Road:
    """The road with slopes that are so many times as steep at each place."""
    slope = np.diff(road.elevation_m, append=road.elevation_m[0]) * gain
    elevation_m = np.concatenate([[0.0], np.cumsum(slope - slope.mean())[:-1]])
    return replace(road, kind=kind, elevation_m=elevation_m, gain=gain)


def measured_profile(path: Path) -> Road:
    """A measured road there and back, without its slope from end to end; the limit is not known of it."""
    table = np.genfromtxt(path, delimiter=",", names=True)
    at_m, elevation_m = table["distance_m"] - table["distance_m"][0], table["elevation_m"]
    line_m = np.interp(at_m, at_m[[0, -1]], elevation_m[[0, -1]])
    one_way = np.interp(np.arange(0, at_m[-1], SPACING_M), at_m, elevation_m - line_m)
    both = np.concatenate([one_way, one_way[::-1]])
    both = both[:len(both) // 2 * 2]
    road = Road("measured", 1.0, both, np.zeros(len(both) // 2 + 1), np.ones(len(both)))
    return replace(road, level_m_per_km=float(road.iri(0.0, road.length_m)))


# --- estimates -------------------------------------------------------------------------------------------------------


def ours(sensor: Accelerometer, readings: Array, clipped: Array, travelled_m: Array, learns: bool, rides: bool
         ) -> tuple[list[WindowEstimate], float]:
    """Windows of ridelog, and its processor time per driven second."""
    structure, known = half_car(rav4()), reported(sensor)
    noise = NoiseBelief.guessed(GUESS_MPS2) if learns else None
    known = replace(known, noise_rms_mps2=GUESS_MPS2) if learns else known
    started_s = time.process_time()
    estimator = RoadEstimator(LinearCar(structure, body_point(structure)), known, WINDOW_M, noise=noise,
                              ride_response=WEIGHTING.response if rides else None,
                              reads=readings.size // len(readings))
    at_end = np.where(clipped, np.sign(readings - np.median(readings)), 0.0)
    usable, found = np.ones(readings.shape, dtype=np.bool_), []
    for low in range(0, len(readings), PUSH):
        part = slice(low, low + PUSH)
        found += estimator.push(readings[part], usable[part], at_end[part], travelled_m[part])
    found += estimator.finish()
    return found, (time.process_time() - started_s) / (len(readings) / GRID_HZ)


def plain(drive: Drive, sensor: Accelerometer, readings: Array) -> Array:
    """The plain method's IRI [m/km] at each reading (t,)."""
    from scipy.special import erf

    speed = float(drive.speed_mps[0])
    step_m, count, pad = speed / GRID_HZ, len(readings), 4096
    noise = 2 * step_m * (sensor.noise_mps2**2 + sensor.step_mps2**2 / 12) / sensor.oversample
    felt = readings - readings.mean()

    def power_of(n: Array) -> Array:
        return np.asarray(road_response(rav4(), np.maximum(n, 1e-6), speed) * recorder_response(n * speed))

    block_m, levels = 20.0, np.geomspace(3e-7, 2e-3, 45)
    length = round(2 * block_m / step_m)
    taper = np.hanning(length)
    taper /= sqrt(float(taper @ taper))
    n = np.fft.rfftfreq(length, step_m)
    used = (n * speed > 0.4) & (n * speed < 36)
    gain, n = np.abs(power_of(n[used])) ** 2, n[used]
    centres = np.arange(round(block_m / step_m) // 2, count, round(block_m / step_m))
    begins = np.clip(centres - length // 2, 0, count - length)
    seen = np.array([2 * step_m * np.abs(np.fft.rfft(felt[at:at + length] * taper))[used] ** 2 for at in begins])
    apart = np.log(levels)[:, None] - np.log(levels)
    move = np.exp(-0.5 * (apart / 0.25) ** 2)
    move = 0.97 * move / move.sum(axis=1, keepdims=True) + 0.03 / len(levels)
    best, chance, waviness = -inf, np.empty(0), 2.0
    for trial in np.arange(1.6, 2.81, 0.1):
        expected = levels[:, None] * gain * (n / 0.1) ** -trial + noise
        log_like = -0.5 * (np.log(expected).sum(axis=1) + seen @ (1 / expected).T)
        like = np.exp(log_like - log_like.max(axis=1, keepdims=True))
        ahead, behind = np.empty_like(like), np.ones_like(like)
        now, evidence = np.full(len(levels), 1 / len(levels)), float(log_like.max(axis=1).sum())
        for row, one in enumerate(like):
            now = (now @ move if row else now) * one
            evidence += np.log(now.sum())
            now = ahead[row] = now / now.sum()
        for row in range(len(like) - 2, -1, -1):
            behind[row] = move @ (behind[row + 1] * like[row + 1])
            behind[row] /= behind[row].sum()
        if evidence > best:
            best, waviness, chance = evidence, trial, ahead * behind
    chance /= chance.sum(axis=1, keepdims=True)
    n = np.fft.rfftfreq(count + pad, step_m)
    shape = np.where(n < 0.01, 0.0, (np.maximum(n, 0.01) / 0.1) ** -waviness)
    response, golden, waves = power_of(n), golden_slope(n), np.fft.rfft(np.concatenate([felt, np.zeros(pad)]))
    iri = np.zeros(count)
    for number, level in enumerate(levels):
        weight = np.interp(np.arange(count), centres, chance[:, number])
        if weight.max() > 1e-4:
            share = level * shape / (np.abs(response) ** 2 * level * shape + noise)
            mean = np.fft.irfft(golden * np.conj(response) * share * waves, count + pad)[:count]
            spread = sqrt(float(np.trapezoid(np.abs(golden) ** 2 * share * noise, n)))
            iri += weight * 1000 * (sqrt(2 / pi) * spread * np.exp(-0.5 * (mean / spread) ** 2)
                                    + mean * erf(mean / spread / sqrt(2)))
    return iri


def golden_slope(n: Array) -> Array:
    """Slope of the Golden Car per elevation, (n,) [1/m], by its equations written out."""
    s = 2j * pi * n * 80 / 3.6
    body = s * s + 6.0 * s + 63.3
    wheel = 0.15 * s * s + 6.0 * s + 63.3 + 653.0
    between = 6.0 * s + 63.3
    road_to_wheel = 653.0 * body / (body * wheel - between**2)
    return np.asarray(s * (between / body - 1) * road_to_wheel / (80 / 3.6) * np.sinc(0.25 * n))


# --- cells -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cell:
    """Windows (n,) of one drive [m/km], and where they are said to begin [m].

    best    (2, n) of two chains of ``rounding_limit``; NaN where they were not asked for
    ride    (n, 3) a_w, the one that is found and its standard error [m/s2]; (0, 3) where that was not asked for
    """

    road: Road
    begin_m: Array
    estimate: Array
    errors: WindowErrors
    plain: Array
    limit: Array
    best: Array
    ride: Array
    spent: float

    @cached_property
    def exact(self) -> Array:
        """(n,) at these places."""
        return self.road.iri(self.begin_m, self.begin_m + WINDOW_M)

    @cached_property
    def rough_m_per_km(self) -> Array:
        """(n,) over 100 m."""
        return self.road.iri(self.begin_m - 50.0 + WINDOW_M / 2, self.begin_m + 50.0 + WINDOW_M / 2)

    def sections(self, length_m: float) -> tuple[Array, Array]:
        """Errors of sections that are known from end to end, and their standard errors [m/km]."""
        count, end_m = len(self.begin_m), self.begin_m + WINDOW_M
        end_m[:-1] = np.minimum(end_m[:-1], self.begin_m[1:])  # by the receiver, windows lie a little over each other
        windows = SectionWindows(self.begin_m, end_m, np.ones(count), self.estimate, self.errors, np.ones(count))
        edges_m = self.begin_m[0] + even_edges(float(self.begin_m[-1] + WINDOW_M - self.begin_m[0]), length_m)
        found = sections(windows, edges_m)
        whole = found.known_m > 0.95 * length_m
        error = found.iri_m_per_km - self.road.iri(edges_m[:-1], edges_m[1:])
        return error[whole], found.iri_std_m_per_km[whole]


def driven(road: Road, mph: float, sensor: Accelerometer, asked: argparse.Namespace, seed: int) -> Cell:
    """One lap, or the city's drive, at places that are known exactly."""
    rng = np.random.default_rng([FIRST_SEED, seed, round(mph), round(1000 * sensor.noise_mps2)])
    drive = drive_of(road, mph, sensor)
    readings, each, clipped = on_grid(drive, sensor, rng)
    place_m = drive.place_m[::sensor.oversample][:len(readings)]
    found, spent = ours(sensor, each, clipped, place_m - place_m[0], asked.learn, asked.comfort)
    lap_m = min(road.length_m, float(place_m[-1])) if mph else float(place_m[-1])
    numbers = np.arange(np.ceil(-place_m[0] / WINDOW_M), np.floor((lap_m - place_m[0]) / WINDOW_M)).astype(int)
    begin_m = place_m[0] + numbers * WINDOW_M
    by_number = {one.number: one for one in found}
    rows = [by_number.get(number, NOTHING) for number in numbers.tolist()]
    by_plain, limit = np.full((2, len(numbers)), np.nan)
    if mph:
        sums = np.concatenate([[0.0], np.cumsum(plain(drive, sensor, readings)[:-1] * np.diff(place_m))])
        by_plain = np.diff(np.interp(np.append(begin_m, begin_m[-1] + WINDOW_M), place_m, sums)) / WINDOW_M
    if mph and not (asked.profile or asked.no_limit):
        limit = known_best(rav4(), drive, sensor, readings)(begin_m, begin_m + WINDOW_M)
    best = np.full((2, len(numbers)), np.nan)
    if asked.best and mph and sensor.oversample == 1 and road.kind in CHANGES:
        lap = Lap.of(drive, sensor, readings, clipped[:, 0], NoiseBelief.guessed(GUESS_MPS2) if asked.learn else None)
        best = np.array(best_values(rav4(), lap, begin_m, begin_m + WINDOW_M, asked.best, CHANGES[road.kind]()))
    ride = np.empty((0, 3))
    if asked.comfort:
        edges = np.searchsorted(place_m, np.stack([begin_m, begin_m + WINDOW_M]))
        squares = np.append(0.0, np.cumsum(weighted_by_scipy(drive.accel_mps2[::sensor.oversample]) ** 2))
        true = np.sqrt((squares[edges[1]] - squares[edges[0]]) / (edges[1] - edges[0]))
        ride = np.column_stack([true, [(one.ride.a_w.value, one.ride.a_w.std) for one in rows]])
    return Cell(road, begin_m, np.array([one.iri_m_per_km for one in rows]), WindowErrors(*np.array([
        (one.iri_std_m_per_km, one.iri_level_std_m_per_km, one.iri_common_std_m_per_km, one.iri_place_std_m_per_km)
        for one in rows]).T), by_plain, limit, best, ride, spent)


NOTHING = WindowEstimate(0, nan, nan, 0.0, frozenset())


def drive_of(road: Road, mph: float, sensor: Accelerometer) -> Drive:
    """At a steady speed, or through a city (0)."""
    rate_hz = GRID_HZ * sensor.oversample
    if mph:
        return steady_drive(rav4(), road, mph * MPH_MPS, LEAD_S, rate_hz)
    return varied_drive(rav4(), road, list(TOWN), rate_hz)


def logged(road: Road, mph: float, sensor: Accelerometer, asked: argparse.Namespace, seed: int) -> Cell:
    """The same through the whole service, with a receiver that is late and wanders: places are those of the log."""
    drive = drive_of(road, mph, sensor)
    noise = NoiseBelief.guessed(GUESS_MPS2) if asked.learn else None
    believed = Sensor(GUESS_MPS2, sensor.step_mps2) if asked.learn else reported(sensor)
    started_s = time.process_time()
    config = config_for(sensor, WINDOW_M, LATENCY_S)
    records, _ = logged_records(drive, sensor, Receiver(), config, seed, believed, noise)
    spent = (time.process_time() - started_s) / (len(drive.place_m) / drive.rate_hz)
    rows = [one for one in records if placed(one) and not {"partial", "unsettled"} & set(one.flags)]
    begin_m = column(rows, lambda one: place_of(one.lat_deg or 0.0)) - WINDOW_M / 2
    grid_mps2 = thinned(drive.accel_mps2, sensor.oversample)
    squares = np.append(0.0, np.cumsum(weighted_by_scipy(grid_mps2) ** 2))
    first = np.rint((column(rows, lambda one: one.t_us) - START_US) / GRID_STEP_US).astype(int)
    last = first + np.rint(column(rows, lambda one: one.duration_s) * GRID_HZ).astype(int)
    ride = np.column_stack([np.sqrt((squares[last] - squares[first]) / (last - first)),
                            column(rows, lambda one: one.a_w_mps2), column(rows, lambda one: one.a_w_std_mps2)])
    nothing = np.full(len(rows), np.nan)
    return Cell(road, begin_m, column(rows, lambda one: one.iri_m_per_km), iri_errors(rows), nothing, nothing,
                np.stack([nothing, nothing]), ride, spent)


SECTIONS = {"50 m": 50.0, "0.1 mi": 528 * FOOT_M, "1 km": 1000.0}
HEADING = (f"{'':42s}{'R2':>7s}{'plain':>7s}{'limit':>7s} |{'bias %':>7s}{'smooth':>7s}{'rough':>7s}"
           f"{'chosen by it':>14s} |{'in 1':>6s}{'in 2':>6s} |"
           + "".join(f"{name + ': in 1':>13s}{'in 2':>6s} |" for name in SECTIONS)
           + f"{'a_w bias %':>11s}{'in 1':>6s}{'in 2':>6s} |{'ms/s':>6s} |{'plain: bias':>12s}{'smooth':>7s}"
           f"{'rough':>7s} |{'best: R2':>9s}{'bias':>7s}{'smooth':>7s}{'rough':>7s}{'by it':>14s}{'apart':>7s} |")

GOALS = (f"{'goal':42s}{'>=':>7s}{'plain':>7s}{'':7s} |{'+-2':>7s}{'+-5':>7s}{'+-5':>7s}{'+-5':>7s}{'+-5':>7s} |"
         f"{'64-72':>6s}{'93-97':>6s} |"
         + f"{'64-72':>13s}{'93-97':>6s} |" * len(SECTIONS) + f"{'+-3':>11s}{'64-72':>6s}{'93-97':>6s} |")


def print_cells(name: str, cells: list[Cell]) -> None:
    """One line for the drives of a cell."""
    exact, estimate, by_plain, limit, rough = (
        np.concatenate([getattr(cell, field) for cell in cells])
        for field in ("exact", "estimate", "plain", "limit", "rough_m_per_km"))
    chains = np.concatenate([cell.best for cell in cells], axis=1)
    std = np.concatenate([cell.errors.std for cell in cells])
    known = np.isfinite(estimate)

    def thirds(level: Array) -> list[Array]:
        low, high = np.quantile(level[np.isfinite(level)], (1 / 3, 2 / 3)) if np.isfinite(level).any() else (nan, nan)
        return [known & (level <= low), known & (level >= high)]

    by_truth, chosen, chosen_by_best = thirds(rough), *(
        thirds(np.concatenate([local_level(row, WINDOW_M) for row in rows]))
        for rows in ([cell.estimate for cell in cells], [cell.best.mean(axis=0) for cell in cells]))

    def bias(row: Array, which: Array, true: Array = exact) -> float:
        return 100 * (float(row[which].mean() / true[which].mean()) - 1) if which.any() else np.nan

    def biases(row: Array, *parts: Array) -> str:
        return "".join(f"{bias(row, part):+7.1f}" for part in parts)

    def within(error: Array, error_std: Array) -> list[float]:
        return [float(np.mean(np.abs(error) <= times * error_std)) if len(error) else np.nan for times in (1, 2)]

    windows = within((estimate - exact)[known], std[known])
    of_sections = [within(*map(np.concatenate, zip(*(cell.sections(length_m) for cell in cells), strict=True)))
                   for length_m in SECTIONS.values()]
    true, a_w, a_w_std = np.concatenate([cell.ride for cell in cells]).T
    felt = np.isfinite(a_w)
    spent = 1000 * sum(cell.spent for cell in cells) / len(cells)
    limit_r2 = r2(limit, exact) if np.isfinite(limit).all() else np.nan
    best, apart = chains.mean(axis=0), float(np.std(np.diff(chains, axis=0)[0, known]) / np.std(exact[known]))
    print(f"{name:42s}{r2(estimate[known], exact[known]):7.3f}{r2(by_plain, exact):7.3f}{limit_r2:7.3f}"
          f" |{biases(estimate, known, *by_truth, *chosen)}"
          f" |{windows[0]:6.2f}{windows[1]:6.2f} |"
          + "".join(f"{one:13.2f}{two:6.2f} |" for one, two in of_sections)
          + "{:+11.1f}{:6.2f}{:6.2f} |".format(bias(a_w, felt, true), *within((a_w - true)[felt], a_w_std[felt]))
          + f"{spent:6.2f} |     {biases(by_plain, known, *by_truth)}"
          f" |{r2(best[known], exact[known]):9.3f}{biases(best, known, *by_truth, *chosen_by_best)}{apart:7.2f} |"
          + (f"  {known.mean():.0%} of windows" if not known.all() else ""), flush=True)


def sensor_of(range_g: float, noise_mps2: float, reads: int) -> Accelerometer:
    """A BMA220's steps at a range; 0: a fine sensor."""
    if range_g == 0:
        return Accelerometer("fine", noise_mps2, 1e-3, reads)
    return Accelerometer(f"{range_g:g} g", noise_mps2, range_g * STANDARD_GRAVITY_MPS2 / 32, reads, (-32, 31))


def main() -> None:
    """Print the cells that were asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks.changing_roads", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)

    def numbers(text: str) -> list[float]:
        return [float(one) for one in text.split(",")]

    parser.add_argument("--roads", default=",".join(ROADS))
    parser.add_argument("--profile", type=Path)
    parser.add_argument("--mph", type=lambda text: numbers(text.replace("city", "0")), default=[10, 40, 70])
    parser.add_argument("--range", type=numbers, default=[2, 0], help="g; 0: a fine sensor")
    parser.add_argument("--noise", type=numbers, default=[0.05, 0.147])
    parser.add_argument("--reads", type=numbers, default=[1])
    parser.add_argument("--waviness", type=numbers, default=[2.0])
    parser.add_argument("--learn", action="store_true", help="the noise is learned, from a guess of 0.1 m/s2")
    parser.add_argument("--draws", type=int, default=1, help="roads of each kind")
    parser.add_argument("--km", type=float, default=2.4, help="length of a road")
    parser.add_argument("--no-limit", action="store_true")
    parser.add_argument("--comfort", action="store_true")
    parser.add_argument("--best", type=int, default=0, metavar="SWEEPS", help="0: not asked for")
    parser.add_argument("--gps", action="store_true", help="through the service, with a receiver")
    parser.add_argument("--cells", type=int, default=0, metavar="N", help="a balanced draw of cells; 0: all")
    asked = parser.parse_args()
    print(HEADING)
    print(GOALS)
    kinds = ["measured"] if asked.profile else asked.roads.split(",")
    values = (kinds, asked.waviness, asked.range, asked.noise, asked.reads, asked.mph)
    rng = np.random.default_rng(0)
    drawn = zip(*([one[at % len(one)] for at in rng.permutation(asked.cells).tolist()] for one in values), strict=True)
    for number, (kind, waviness, range_g, noise, reads, mph) in enumerate(drawn if asked.cells else product(*values)):
        sensor, cells = sensor_of(range_g, noise, int(reads)), []
        first = number * asked.draws if asked.cells else 0
        for draw in range(first, first + asked.draws):
            road = measured_profile(asked.profile) if asked.profile else ROADS[kind](
                FIRST_SEED + draw, waviness, 1000 * asked.km)
            cells.append((logged if asked.gps else driven)(road, mph, sensor, asked, draw))
        speed = f"{mph:g} mph" if mph else "city"
        print_cells(f"{kind} w {waviness:g}, {sensor.name} noise {noise:g} x{reads:g}, {speed}", cells)


if __name__ == "__main__":
    main()
