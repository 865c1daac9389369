"""The solution of a block against time-domain simulation, dense linear algebra and the textbook Wiener filter."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.signal import lsim

from logger.estimation.car_response import CarResponse, golden_car_slope
from logger.estimation.road_solver import ENTRY_S, Block, TimeGrid, quick_fft_length
from logger.estimation.road_spectrum import RoadSpectrum
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import Structure, body_point

from ..support.drives.linear_drive import body_acceleration_response
from ..support.slow import slow

RATE_HZ, SPACING_M, ALIGN_M = 100.0, 0.1524, 7.62
ROAD = RoadSpectrum.of_iri(3.0)
DRIFT = 0.05**2


def car(name: str) -> Structure:
    return structure_of(read_vehicle(vehicle_file(name)))


@cache
def time_grid(name: str, count: int, ahead_m: float = 0.0, reads: int = 1) -> TimeGrid:
    structure = car(name)
    return TimeGrid(CarResponse(LinearCar(structure, body_point(structure, ahead_m))), count, RATE_HZ, reads)


def way(count: int, speeds_mps: list[float], rate_hz: float = RATE_HZ) -> np.ndarray:
    """Distances of a drive whose speed is a smooth curve through values spread evenly over it, from 1234.5 m on."""
    time_s = np.arange(count) / rate_hz
    speed = np.polyval(np.polyfit(np.linspace(0, time_s[-1], len(speeds_mps)), speeds_mps, len(speeds_mps) - 1), time_s)
    return 1234.5 + np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) / rate_hz)])


def a_block(name: str = "rav4-2009", count: int = 1024, speeds_mps: list[float] | None = None) -> Block:
    return Block(time_grid(name, count), way(count, speeds_mps or [20.0, 20.0]), SPACING_M, ALIGN_M)


def a_road(block: Block, rng: np.random.Generator, spectrum: RoadSpectrum = ROAD) -> np.ndarray:
    """rfft of a random road of the spectrum on the block's grid."""
    white = np.fft.rfft(rng.standard_normal(block.count))
    return white * block.wave_factors(spectrum)


def even(block: Block) -> np.ndarray:
    """As rough everywhere."""
    return np.ones(block.count)


def uneven(block: Block) -> np.ndarray:
    """Relative variances of a road with smooth and rough stretches and a pothole."""
    place = SPACING_M * np.arange(block.count)
    variance = 4.0 ** np.sin(place / 9.0)
    variance[(place > 60) & (place < 61)] = 300.0
    return variance


def weights(count: int, deviation: float = 0.06) -> np.ndarray:
    weight = np.full(count, deviation**-2.0)
    weight[:round(ENTRY_S * RATE_HZ)] = 0.0
    return weight


@pytest.mark.parametrize(
    ("name", "ahead_m"), [("golden-car", 0.0), ("rav4-2009", 0.0), ("rav4-2009", 1.1), ("rav4-2009-full", -0.6)]
)
@pytest.mark.parametrize("speeds_mps", [[8.0, 14.0, 25.0], *slow([20.0, 20.0], [22.0, 12.0, 16.0])])
def test_driving_against_a_simulation_in_time(name: str, ahead_m: float, speeds_mps: list[float]) -> None:
    """The car's state equations integrated by scipy at 2 kHz, on a road of some sines that is known between samples."""
    count, finer = 1024, 20
    structure = car(name)
    grid = time_grid(name, count, ahead_m)
    block = Block(grid, way(count, speeds_mps), SPACING_M, ALIGN_M)
    harmonics = np.round(block.count * SPACING_M / np.array([31.0, 11.0, 4.3, 2.1, 1.3])).astype(int)
    amplitudes, phases = np.array([20e-3, 8e-3, 3e-3, 1e-3, 0.3e-3]), np.array([0.3, 1.1, 2.7, 4.0, 5.5])
    road = np.zeros(block.count // 2 + 1, dtype=complex)
    road[harmonics] = 0.5 * block.count * amplitudes * np.exp(1j * phases)

    fine = np.interp(np.arange((count - 1) * finer + 1) / finer, np.arange(count), way(count, speeds_mps))
    n = harmonics / (block.count * SPACING_M)
    patch = amplitudes * np.sinc(n * structure.contact_patch_m)
    under = np.stack([
        (patch * np.cos(2 * np.pi * n * (fine[:, None] - behind - block.start_m) + phases)).sum(axis=1)
        for behind in structure.behind_m
    ], axis=1)
    a, b = structure.state_space()
    c, d = structure.output_matrices([body_point(structure, ahead_m)])
    exact = lsim((a, b, c, d), under, np.arange(len(fine)) / (RATE_HZ * finer))[1].reshape(len(fine))[::finer]
    found = block.driven(road)
    settled = slice(450, count - 50)  # both start in a way of their own, and a block's end meets its beginning
    assert np.abs(found - exact)[settled].max() < 0.015 * np.abs(exact[settled]).max()
    assert (found - exact)[settled].std() < 0.005 * exact[settled].std()


@pytest.mark.parametrize("name", ["golden-car", "rav4-2009", "rav4-2009-full"])
def test_the_transpose_is_one(name: str) -> None:
    """<A r, v> = <r, A' v> for random r and v, with a halt in between."""
    rng = np.random.default_rng(0)
    distance_m = way(1024, [25.0, 4.0, 12.0])
    distance_m[500:700] = distance_m[500]
    distance_m[700:] = distance_m[500] + distance_m[700:] - distance_m[700]
    block = Block(time_grid(name, 1024), distance_m, SPACING_M, ALIGN_M)
    road, row = rng.standard_normal(block.count), rng.standard_normal(1024)
    back = np.fft.irfft(block.transposed(row), block.count)
    assert block.driven(np.fft.rfft(road)) @ row == pytest.approx(road @ back, rel=1e-10)


def test_readings_between_samples_are_those_of_the_same_motion() -> None:
    """Eight readings per sample: each eighth is that of one per sample, the others lie where a sine would put them, and
    the transpose is one. A weight stands for as much information as it has, however it is spread over a sample."""
    rng = np.random.default_rng(3)
    count, reads = 1024, 8
    distance_m = way(count, [20.0, 20.0])
    single, several = (Block(time_grid("rav4-2009", count, reads=many), distance_m, SPACING_M, ALIGN_M)
                       for many in (1, reads))
    wave = np.zeros(single.count // 2 + 1, dtype=complex)
    wave[30] = single.count * 1e-3
    found = several.driven(wave)
    assert found[::reads] == pytest.approx(single.driven(wave), abs=1e-12)
    middle = slice(400 * reads, 900 * reads)
    f_hz = 30 / (single.count * SPACING_M) * 20.0
    angle = 2 * np.pi * f_hz * np.arange(count * reads)[middle] / (RATE_HZ * reads)
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    fitted, *_ = np.linalg.lstsq(basis, found[middle], rcond=None)
    assert (basis @ fitted - found[middle]).std() < 0.01 * found[middle].std()
    road, row = rng.standard_normal(several.count), rng.standard_normal(count * reads)
    back = np.fft.irfft(several.transposed(row), several.count)
    assert several.driven(np.fft.rfft(road)) @ row == pytest.approx(road @ back, rel=1e-10)
    weight = weights(count)
    weight[-200:] = 0.0  # the end of a block meets its beginning
    one = single.solve(found[::reads] + 9.8, weight, ROAD, even(single), DRIFT, 300)
    many = several.solve(found + 9.8, np.repeat(weight, reads) / reads, ROAD, even(several), DRIFT, 300)
    assert many.gain == pytest.approx(one.gain)
    assert np.abs(many.road - one.road).max() < 0.02 * np.abs(one.road).max()


def dense(block: Block, spectrum: RoadSpectrum) -> np.ndarray:
    """B (t, count) by driving over every unit of white road."""
    factor = block.wave_factors(spectrum)
    unit = np.fft.rfft(np.eye(block.count), axis=1)
    return np.array([block.driven(row * factor) for row in unit]).T


@cache
def small_problem() -> tuple[Block, np.ndarray, np.ndarray, np.ndarray]:
    """A block of 6.4 s at changing speed, its dense matrix, readings with gravity and tilt, weights with a hole."""
    rng = np.random.default_rng(5)
    block = a_block(count=640, speeds_mps=[9.0, 14.0, 12.0])
    matrix = dense(block, ROAD)
    reading = matrix @ rng.standard_normal(block.count) + 9.81 + 0.05 * np.linspace(-1, 1, 640)
    weight = weights(640) * rng.uniform(0.5, 2.0, 640)
    weight[400:430] = 0.0
    return block, matrix, reading + rng.normal(0, 0.06, 640), weight


@pytest.mark.parametrize(("variance_of", "steps"), [(even, 200), (uneven, 700)])
def test_the_solution_is_that_of_dense_algebra_with_drift(
    variance_of: Callable[[Block], np.ndarray], steps: int
) -> None:
    block, matrix, reading, weight = small_problem()
    variance = variance_of(block)
    grid = time_grid("rav4-2009", 640)
    both = np.hstack([matrix, grid.drift.T])
    precision = np.concatenate([1 / variance, grid.drift_precision(DRIFT)])
    exact = np.linalg.solve(both.T @ (weight[:, None] * both) + np.diag(precision), both.T @ (weight * reading))
    found = block.solve(reading, weight, ROAD, variance, DRIFT, steps)
    assert np.fft.irfft(found.waves, block.count) == pytest.approx(exact[:block.count], abs=1e-6)
    assert found.drift_mps2 == pytest.approx(exact[block.count:] @ grid.drift, abs=1e-6)
    assert found.fitted_mps2 == pytest.approx(both @ exact, abs=1e-6)
    assert found.road == pytest.approx(found.waves * block.wave_factors(ROAD))


def test_drift_is_judged_by_the_evidence() -> None:
    """Slope in the log variance of its cosines, by dense algebra; the road hardly answers as slowly as they swing."""
    block, matrix, reading, weight = small_problem()
    reading = reading + 0.2 * block.grid.drift[1]
    used = weight > 0

    def log_evidence(variance: float) -> float:
        drift = block.grid.drift.T / np.sqrt(block.grid.drift_precision(variance))
        covariance = (matrix @ matrix.T + drift @ drift.T)[np.ix_(used, used)] + np.diag(1 / weight[used])
        y = reading[used]
        return float(-0.5 * np.linalg.slogdet(covariance)[1] - 0.5 * y @ np.linalg.solve(covariance, y))

    for variance in (0.01**2, DRIFT, 0.3**2):
        found = block.solve(reading, weight, ROAD, even(block), variance, 200)
        left, slope, curvature = block.grid.drift_evidence(found, variance, 1.0)
        exact = (log_evidence(variance * np.exp(0.05)) - log_evidence(variance * np.exp(-0.05))) / 0.1
        assert slope == pytest.approx(exact, rel=0.1, abs=0.02)
        assert 0 < curvature <= 0.5 and (left > 0).all()


def test_more_steps_get_nearer_and_going_on_is_no_restart() -> None:
    """In the Golden Car's slope on the whole block, against the settled solution."""
    block, _, reading, weight = small_problem()
    exact = block.solve(reading, weight, ROAD, even(block), DRIFT, 200)

    def off(waves: np.ndarray) -> float:
        slopes = (waves - exact.waves) * block.wave_factors(ROAD) * golden_car_slope(block.wave_number_cpm)
        return float(np.linalg.norm(slopes))

    few, more, most = (block.solve(reading, weight, ROAD, even(block), DRIFT, steps).waves for steps in (8, 16, 40))
    further = block.solve(reading, weight, ROAD, even(block), DRIFT, 8, few).waves
    none = off(np.zeros_like(few))
    assert 0.25 * none > off(few) > off(more) > off(most) and off(most) < 0.02 * none
    assert off(further) < 0.7 * off(few)


def test_a_change_of_spectrum_keeps_the_road() -> None:
    block = a_block()
    waves = np.fft.rfft(np.random.default_rng(1).standard_normal(block.count))
    other = RoadSpectrum.of_iri(9.0, 1.7)
    there = block.same_road(waves, ROAD, other)
    assert there * block.wave_factors(other) == pytest.approx(waves * block.wave_factors(ROAD), rel=1e-12)


def test_an_innovation_is_a_step_where_it_stands() -> None:
    """Where the waviness is 2, slopes are white: a spectrum G n^-2 is that of steps of sqrt(G (2 pi)^2 spacing / 2)."""
    block = a_block(speeds_mps=[8.0, 8.0])  # slow enough for all waves of the grid
    white = np.zeros(block.count)
    white[500] = 1.0
    elevation = np.fft.irfft(np.fft.rfft(white) * block.wave_factors(ROAD), block.count)
    step_m = np.sqrt(ROAD.psd(np.ones(1))[0] * (2 * np.pi) ** 2 * SPACING_M / 2)
    assert elevation[503:508].mean() - elevation[493:498].mean() == pytest.approx(step_m, rel=0.05)
    assert np.argmax(np.abs(np.gradient(elevation))) == 500


@pytest.mark.parametrize("hop", [100, 200])
def test_what_an_earlier_block_found_is_a_head_start(hop: int) -> None:
    rng = np.random.default_rng(8)
    count, distance_m = 2048, way(2048 + hop, [6.0, 15.0, 10.0, 14.0])
    parts = [slice(0, count), slice(hop, hop + count)]
    earlier, later = (Block(time_grid("rav4-2009", count), distance_m[part], SPACING_M, ALIGN_M) for part in parts)
    whole = Block(time_grid("rav4-2009", count + hop), distance_m, SPACING_M, ALIGN_M)
    reading = whole.driven(a_road(whole, rng)) + rng.normal(0, 0.06, count + hop)
    found = [block.solve(reading[part], weights(count), ROAD, even(block), DRIFT, 60).waves
             for block, part in zip((earlier, later), parts, strict=True)]
    start = later.carried_over(earlier, found[0])
    assert start.shape == found[1].shape
    inside = slice(*((distance_m[[hop + 500, hop + count - 300]] - later.start_m) / SPACING_M).astype(int))

    def slope(waves: np.ndarray) -> np.ndarray:
        golden = golden_car_slope(later.wave_number_cpm) * later.wave_factors(ROAD)
        return np.fft.irfft(waves * golden, later.count)[inside]

    cold, warm = (
        later.solve(reading[parts[1]], weights(count), ROAD, even(later), DRIFT, 4, one).waves for one in (None, start)
    )
    assert np.std(slope(warm) - slope(found[1])) < 0.5 * np.std(slope(cold) - slope(found[1]))


def test_blocks_that_do_not_overlap_hand_nothing_over() -> None:
    near = a_block()
    far = Block(time_grid("rav4-2009", 1024), way(1024, [20.0, 20.0]) + 5000.0, SPACING_M, ALIGN_M)
    waves = np.fft.rfft(np.ones(near.count))
    assert not far.carried_over(near, waves).any()
    assert not near.carried_over(far, np.fft.rfft(np.ones(far.count))).any()


@pytest.mark.parametrize("garbage", [0.0, 1e3, -1e6])
def test_readings_without_weight_change_no_bit(garbage: float) -> None:
    block, _, reading, weight = small_problem()
    other = np.where(weight > 0, reading, garbage)
    one, two = (block.solve(row, weight, ROAD, uneven(block), DRIFT, 6) for row in (reading, other))
    assert (one.waves == two.waves).all() and (one.fitted_mps2 == two.fitted_mps2).all()


def test_no_readings_give_the_flat_road() -> None:
    block, _, reading, _ = small_problem()
    found = block.solve(reading, np.zeros(640), ROAD, uneven(block), DRIFT, 6)
    assert not found.waves.any() and not found.fitted_mps2.any() and not found.gain.any()


@pytest.mark.parametrize("speed_mps", [6.0, 14.0, 31.0, 45.0])
def test_at_a_steady_speed_it_is_the_wiener_filter(speed_mps: float) -> None:
    """Where both ends are far, the slope of the Golden Car on the road as estimated wave by wave."""
    rng = np.random.default_rng(2)
    count = 2048 if speed_mps > 10 else 8192  # the wheelbase's notches are filled from far along the road
    block = Block(time_grid("rav4-2009", count), way(count, [speed_mps] * 2), SPACING_M, ALIGN_M)
    reading = block.driven(a_road(block, rng)) + rng.normal(0, 0.06, count)
    found = block.solve(reading, np.full(count, 0.06**-2), ROAD, even(block), DRIFT, 40)

    f_hz = np.fft.rfftfreq(count, 1 / RATE_HZ)
    seen = (f_hz > 0) & (f_hz <= 42.0)
    gain = np.zeros(len(f_hz), dtype=complex)
    gain[seen] = body_acceleration_response(car("rav4-2009"), f_hz[seen], speed_mps)
    psd = ROAD.psd(f_hz / speed_mps)
    noise_psd = 2 * 0.06**2 / RATE_HZ * speed_mps
    wiener = np.conj(gain) * psd / (np.abs(gain) ** 2 * psd + noise_psd)
    golden = golden_car_slope(f_hz / speed_mps)
    expected = np.fft.irfft(np.fft.rfft(reading) * wiener * golden, count)
    slope = np.fft.irfft(found.road * golden_car_slope(block.wave_number_cpm), block.count)
    place = (way(count, [speed_mps] * 2) - block.start_m) / SPACING_M
    middle = slice(count // 3, 2 * count // 3)
    there = np.interp(place[middle], np.arange(block.count), slope)
    assert (there - expected[middle]).std() < 0.03 * expected[middle].std()


def test_gain_is_the_information_of_a_steady_speed() -> None:
    """Signal over noise of each wave, |H|^2 S / N."""
    block = a_block(speeds_mps=[20.0, 20.0])
    gain = block.solve(np.zeros(1024), np.full(1024, 0.06**-2), ROAD, even(block), DRIFT, 1).gain
    middle = (block.wave_number_cpm > 0.01) & (block.wave_number_cpm < 1.5)
    n = block.wave_number_cpm[middle]
    power = np.abs(body_acceleration_response(car("rav4-2009"), n * 20.0, 20.0)) ** 2
    exact = power * ROAD.psd(n) / (2 * 0.06**2 / RATE_HZ * 20.0)
    assert np.sum(gain[middle] / (1 + gain[middle])) == pytest.approx(np.sum(exact / (1 + exact)), rel=0.02)


def test_seen_points_and_seen_places() -> None:
    distance_m = way(640, [10.0, 10.0])
    block = Block(time_grid("rav4-2009", 640), distance_m, SPACING_M, ALIGN_M)
    read = np.zeros(640, dtype=bool)
    read[250:600] = True
    read[400:500] = False
    seen = block.seen(read)
    places = block.start_m + SPACING_M * np.arange(block.count)
    inside = ((places > distance_m[250]) & (places < distance_m[399])) | (
        (places > distance_m[500]) & (places < distance_m[599])
    )
    assert np.abs(seen - inside).sum() <= 6
    passed_m = distance_m[599] - distance_m[500] + distance_m[399] - distance_m[250]
    assert block.seen_points(read) == pytest.approx(passed_m / SPACING_M, abs=2)
    assert block.seen_points(np.zeros(640, dtype=bool)) == 0 and not block.seen(np.zeros(640, dtype=bool)).any()


def test_a_car_that_stands_all_the_time() -> None:
    block = Block(time_grid("rav4-2009", 640), np.full(640, 50.0), SPACING_M, ALIGN_M)
    assert not block.moving.any()
    found = block.solve(np.full(640, 9.81), weights(640), ROAD, even(block), DRIFT, 6)
    assert np.isfinite(found.road).all() and found.fitted_mps2 == pytest.approx(np.full(640, 9.81), abs=1e-3)


def test_a_place_that_jumps_costs_no_short_waves() -> None:
    """A single step of 4 m in the distance, as after a correction, leaves the rest of the road as it was."""
    rng = np.random.default_rng(4)
    distance_m = way(2048, [15.0, 15.0])
    block = Block(time_grid("rav4-2009", 2048), distance_m, SPACING_M, ALIGN_M)
    reading = block.driven(a_road(block, rng)) + rng.normal(0, 0.06, 2048)
    jumped = Block(time_grid("rav4-2009", 2048), distance_m + 4.0 * (np.arange(2048) > 1200), SPACING_M, ALIGN_M)
    roads = [one.solve(reading, weights(2048), ROAD, even(one), DRIFT, 30).road for one in (block, jumped)]
    slopes = [
        np.fft.irfft(road * golden_car_slope(one.wave_number_cpm), one.count)
        for one, road in zip((block, jumped), roads, strict=True)
    ]
    before = slice(*((distance_m[[500, 1000]] - block.start_m) / SPACING_M).astype(int))
    assert np.std(slopes[0][before] - slopes[1][before]) < 0.05 * np.std(slopes[0][before])


@pytest.mark.parametrize("least", [9.0, 100.2, 1024.0, 1025.0, 4700.0, 6000.5, 123_456.7])
def test_lengths_are_even_long_enough_and_quick(least: float) -> None:
    length = quick_fft_length(least)
    assert least <= length <= 1.26 * least and length % 2 == 0
    for prime in (2, 3, 5, 7):
        while length % prime == 0:
            length //= prime
    assert length == 1


def test_another_car_on_the_same_stretch_is_as_if_it_had_been_its_own() -> None:
    """But for its laws: axles and contact patch are the same."""
    rng = np.random.default_rng(8)
    own, other = (time_grid("rav4-2009", 1024, ahead_m) for ahead_m in (0.0, 0.9))
    there = Block(other, way(1024, [12.0, 20.0]), SPACING_M, ALIGN_M)
    moved = Block(own, way(1024, [12.0, 20.0]), SPACING_M, ALIGN_M).on(other)
    reading, weight = rng.standard_normal(1024), weights(1024)
    assert moved.car is other.car
    one, two = (block.solve(reading, weight, ROAD, uneven(block), DRIFT, 4) for block in (there, moved))
    assert np.array_equal(one.road, two.road) and np.array_equal(one.fitted_mps2, two.fitted_mps2)


@pytest.mark.parametrize("speeds_mps", [[20.0, 20.0], [3.0, 25.0, 9.0]])
def test_waves_that_the_time_grid_cannot_hold_have_no_factor(speeds_mps: list[float]) -> None:
    block = a_block(speeds_mps=speeds_mps)
    speed_mps = np.gradient(way(1024, speeds_mps)) * RATE_HZ
    held = block.wave_number_cpm[block.wave_factors(ROAD) != 0]
    highest_cpm = 42.0 / np.quantile(speed_mps, 0.98)
    assert held.max() == block.wave_number_cpm[:-1][block.wave_number_cpm[:-1] <= highest_cpm].max()


def test_innovations_are_the_waves_of_a_solution() -> None:
    block = a_block()
    rng = np.random.default_rng(9)
    first = block.solve(rng.standard_normal(1024), weights(1024), ROAD, uneven(block), DRIFT, 5)
    later = block.solve(rng.standard_normal(1024), weights(1024), ROAD, uneven(block), DRIFT, 3, first.waves)
    for found in (first, later):
        assert found.innovations == pytest.approx(np.fft.irfft(found.waves, block.count), abs=1e-9)


def test_readings_that_weigh_next_to_nothing_leave_a_flat_road() -> None:
    """With noise of 10^6 m/s2, products of the smallest numbers end in 0."""
    block = a_block()
    reading = np.random.default_rng(3).normal(0, 0.3, 1024)
    for noise_mps2 in np.geomspace(1e3, 1e12, 10):
        solved = block.solve(reading, weights(1024, noise_mps2), ROAD, np.full(block.count, 1e-3), DRIFT, 40)
        assert np.isfinite(solved.innovations).all() and np.abs(solved.innovations).max() < 1e-3
