"""The exact IRI against the World Bank's published check, analytic gains, other integrators, and known traps."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from logger.roads import iso8608
from logger.roads.iri import iri, rectified_slope, window_iri
from logger.vehicle.models import GOLDEN_CAR, quarter_car
from logger.vehicle.structure import straight_step

# World Bank Technical Paper 46 (Sayers, Gillespie, Paterson 1986), pages 41-42: the IRI from 0 to 0.25, 0.5, ... 30 m
# of a triangular pulse of 20 mm.
RUNNING_IRI = (
    0.00000, 0.00000, 0.00000, 0.00000, 0.44424, 1.46822, 2.70319, 3.77380, 4.47956, 4.80554, 4.85232, 4.75180, 4.50642,
    4.93081, 5.76800, 6.65620, 7.33478, 7.71431, 7.84294, 7.82931, 7.66730, 7.32857, 7.13737, 7.01181, 6.87758, 6.70672,
    6.50858, 6.30880, 6.13016, 5.98287, 5.86438, 5.76496, 5.67420, 5.58524, 5.49579, 5.40684, 5.32053, 5.23842, 5.16077,
    5.08670, 5.01486, 4.94401, 4.87342, 4.80283, 4.73234, 4.66210, 4.59221, 4.52266, 4.45334, 4.38411, 4.31490, 4.24570,
    4.17656, 4.10756, 4.03881, 3.97038, 3.90236, 3.83534, 3.77234, 3.71304, 3.65716, 3.60441, 3.55451, 3.50722, 3.46229,
    3.41949, 3.37863, 3.33949, 3.30192, 3.26572, 3.23075, 3.19687, 3.16394, 3.13184, 3.10047, 3.06972, 3.03952, 3.00978,
    2.98043, 2.95143, 2.92270, 2.89423, 2.86596, 2.83786, 2.80993, 2.78213, 2.75446, 2.72691, 2.69948, 2.67216, 2.64496,
    2.61790, 2.59097, 2.56419, 2.53757, 2.51114, 2.48561, 2.46093, 2.43705, 2.41392, 2.39149, 2.36972, 2.34856, 2.32798,
    2.30793, 2.28837, 2.26927, 2.25059, 2.23231, 2.21438, 2.19678, 2.17949, 2.16247, 2.14572, 2.12920, 2.11289, 2.09679,
    2.08087, 2.06513, 2.04955,
)
SPEED_MPS = 80 / 3.6


def pulse(spacing_m: float, length_m: float = 30.0) -> np.ndarray:
    distance = np.arange(round(length_m / spacing_m) + 1) * spacing_m
    return np.interp(distance, [0, 1, 3, 5, length_m], [0, 0, 0.02, 0, 0])


def drive(elevation: np.ndarray, spacing_m: float, base: int, start_m: float = 11.0) -> np.ndarray:
    """Rectified slopes by the textbook: the state-transition matrix, step after step."""
    slope = (elevation[base:] - elevation[:-base]) / (base * spacing_m)
    transition, *ends = straight_step(*quarter_car(GOLDEN_CAR).state_space(), spacing_m / SPEED_MPS)
    gain = ends[0] + ends[1]  # held over the step
    first = int(start_m / spacing_m + 0.5)
    state = np.array([1.0, 1.0, 0.0, 0.0]) * (elevation[first] - elevation[0]) / (first * spacing_m)
    rectified = np.empty(len(slope))
    for step, value in enumerate(slope):
        state = transition @ state + gain[:, 0] * value
        rectified[step] = abs(state[0] - state[1])
    return rectified


@pytest.fixture(scope="module")
def road() -> np.ndarray:
    """200 m of an ordinary road at 25 mm."""
    return iso8608.generate(40.0, 200.0, 0.025, 4) + 583.0


def test_all_values_of_the_world_bank_check_pulse() -> None:
    slope = rectified_slope(pulse(0.25), 0.25)
    running = 1000 * np.cumsum(slope) / np.arange(1, len(slope) + 1)
    assert len(running) == len(RUNNING_IRI) == 120
    assert running == pytest.approx(RUNNING_IRI, abs=7e-6)
    assert running.max() == pytest.approx(7.84294, abs=7e-6)
    assert iri(pulse(0.25), 0.25) == pytest.approx(2.04955, abs=7e-6)


def test_state_transition_has_the_printed_coefficients() -> None:
    """World Bank Technical Paper 46, table of coefficients at 0.25 m, for states (z_s', z_s'', z_u', z_u'')."""
    transition, *ends = straight_step(*quarter_car(GOLDEN_CAR).state_space(), 0.25 / SPEED_MPS)
    gain = ends[0] + ends[1]  # held over the step
    order = [0, 2, 1, 3]
    printed = np.array([
        [0.9966071, 0.01091514, -0.002083274, 0.0003190145],
        [-0.5563044, 0.9438768, -0.8324718, 0.05064701],
        [0.02153176, 0.002126763, 0.7508714, 0.008221888],
        [3.335013, 0.3376467, -39.12762, 0.4347564],
    ])
    assert transition[np.ix_(order, order)] == pytest.approx(printed, rel=2e-6)
    # The first is printed 5.476107e-3, which would give a straight slope an IRI.
    assert gain[order, 0] == pytest.approx([5.476206e-3, 1.388776, 0.2275968, 35.79262], rel=2e-6)


@pytest.mark.parametrize("spacing_m", [0.005, 0.025, 0.1, 0.25, 0.3])
def test_a_straight_grade_has_no_roughness(spacing_m: float) -> None:
    """The printed first coefficient would give a grade of 3 % an IRI of 0.00003 m/km at 0.25 m."""
    assert iri(7.0 + 0.03 * np.arange(0, 100, spacing_m), spacing_m) < 1e-8


def golden_response(wave_number_cpm: np.ndarray) -> np.ndarray:
    """z_s' - z_u' of the Golden Car per slope of a sinusoidal road, by its transfer function at 80 km/h."""
    s = 2j * np.pi * wave_number_cpm * SPEED_MPS
    wheel_per_body = (s**2 + 6.0 * s + 63.3) / (6.0 * s + 63.3)
    body = 653.0 / ((0.15 * s**2 + 6.0 * s + 63.3 + 653.0) * wheel_per_body - (6.0 * s + 63.3))
    return body - wheel_per_body * body


def sampled_gain(wave_number_cpm: float, spacing_m: float) -> float:
    """The same for a slope that is held over each step: the sinusoid and its images at n + k / dx, each through the
    hold and the car (the samples of the output are their sum)."""
    images = np.arange(-4000, 4001)
    n = wave_number_cpm + images / spacing_m
    hold = np.sinc(n * spacing_m) * np.exp(-1j * np.pi * n * spacing_m)
    return abs(np.sum(hold * golden_response(n)))


@pytest.mark.parametrize("wave_number_cpm", [0.02, 0.065, 0.1, 0.42, 1.0])
@pytest.mark.parametrize("spacing_m", [0.01, 0.05, 0.25])
def test_sinusoids_have_their_analytic_gain(wave_number_cpm: float, spacing_m: float) -> None:
    """Mean of a rectified sine: 2 / pi of its amplitude. A count of samples prime to the count of waves meets every
    phase once. The tire's average, or the chord of a coarse step, is a sinc."""
    amplitude_m, base_m = 0.001, 0.25
    count = 20_011  # a prime
    wave_number = round(wave_number_cpm * spacing_m * count) / count / spacing_m
    settling = round(400 / spacing_m)
    distance = spacing_m * np.arange(settling + count + round(base_m / spacing_m))
    slope = rectified_slope(amplitude_m * np.sin(2 * np.pi * wave_number * distance), spacing_m)[settling:]
    road_slope = amplitude_m * 2 * np.pi * wave_number * np.sinc(base_m * wave_number)
    assert len(slope) == count
    assert slope.mean() == pytest.approx(2 / np.pi * road_slope * sampled_gain(wave_number, spacing_m), rel=1e-4)


def test_a_fine_sinusoid_has_the_gain_of_the_continuous_car() -> None:
    spacing_m, wave_number = 0.005, 1 / 12.5
    distance = spacing_m * np.arange(round(900 / spacing_m))
    slope = rectified_slope(0.01 * np.sin(2 * np.pi * wave_number * distance), spacing_m)[round(400 / spacing_m):]
    whole_waves = slope[: round(475 / spacing_m)]
    road_slope = 0.01 * 2 * np.pi * wave_number * np.sinc(0.25 * wave_number)
    expected = 2 / np.pi * road_slope * abs(golden_response(np.array(wave_number)))
    assert whole_waves.mean() == pytest.approx(expected, rel=1e-4)


def test_an_integrator_with_error_control_agrees() -> None:
    from scipy.integrate import solve_ivp

    spacing_m = 0.25
    elevation = iso8608.generate(40.0, 40.0, spacing_m, 6)
    slope = np.diff(elevation) / spacing_m
    start = (elevation[44] - elevation[0]) / 11.0

    def car(_t: float, x: np.ndarray, road: float) -> list[float]:
        spring = 63.3 * (x[0] - x[1]) + 6.0 * (x[2] - x[3])
        return [x[2], x[3], -spring, (spring - 653.0 * (x[1] - road)) / 0.15]

    state, total = [start, start, 0.0, 0.0], 0.0
    for road in slope:
        result = solve_ivp(car, (0, spacing_m / SPEED_MPS), state, args=(road,), rtol=1e-9, atol=1e-12)
        state = result.y[:, -1]
        total += abs(state[0] - state[1])
    assert iri(elevation, spacing_m) == pytest.approx(1000 * total / len(slope), rel=1e-6)


@pytest.mark.parametrize("spacing_m", [0.025, 0.1, 0.25, 0.3])
def test_scipy_agrees_on_a_long_road(spacing_m: float) -> None:
    from scipy.signal import cont2discrete, dlsim

    elevation = iso8608.generate(40.0, 300.0, spacing_m, 6)
    base = max(1, int(0.25 / spacing_m + 0.5))
    slope = (elevation[base:] - elevation[:-base]) / (base * spacing_m)
    matrices = quarter_car(GOLDEN_CAR).state_space()
    car = cont2discrete((*matrices, np.array([[1.0, -1, 0, 0]]), np.zeros((1, 1))), spacing_m / SPEED_MPS)
    first = int(11 / spacing_m + 0.5)
    start = (elevation[first] - elevation[0]) / (first * spacing_m) * np.array([1.0, 1, 0, 0])
    _, output, _ = dlsim(car, np.append(slope, 0.0)[:, None], x0=start)
    expected = 1000 * np.abs(output[1:, 0]).mean()
    assert iri(elevation, spacing_m) == pytest.approx(expected, rel=1e-9)


def test_the_tire_average_is_used_below_167_mm_only() -> None:
    rough = np.cumsum(np.random.default_rng(1).standard_normal(4001)) * 1e-4
    assert len(rectified_slope(rough, 0.1)) == 4001 - 3
    assert len(rectified_slope(rough, 0.166)) == 4001 - 2
    assert len(rectified_slope(rough, 0.168)) == 4001 - 1
    assert len(rectified_slope(rough, 0.025)) == 4001 - 10


def test_trap_an_average_over_quarter_metre_samples_would_take_percents_off() -> None:
    """Some 3 % on measured roads, 5 % on a random one, which has more of the shortest waves."""
    coarse = iso8608.generate(40.0, 2000.0, 0.25, 4)
    averaged = (coarse[1:] + coarse[:-1]) / 2
    assert iri(coarse, 0.25) == pytest.approx(1000 * drive(coarse, 0.25, 1).mean(), rel=1e-9)
    assert 0.93 < iri(averaged, 0.25) / iri(coarse, 0.25) < 0.985


def test_trap_without_the_average_a_fine_profile_reads_rougher(road: np.ndarray) -> None:
    """By 1.1 to 1.5 % on measured roads, a little more on a random one."""
    assert iri(road, 0.025) == pytest.approx(1000 * drive(road, 0.025, 10).mean(), rel=1e-9)
    assert 1.01 < 1000 * drive(road, 0.025, 1).mean() / iri(road, 0.025) < 1.03


def test_trap_a_box_of_elevations_is_the_slope_average_only_when_it_is_as_long(road: np.ndarray) -> None:
    """Ten samples of 25 mm are the same; the eleven that reach from 0 to 250 mm inclusive read some 0.4 % less."""
    exact = iri(road, 0.025)
    ten, eleven = (np.convolve(road - 583.0, np.ones(n) / n, "valid") for n in (10, 11))
    assert 1000 * drive(ten, 0.025, 1).mean() == pytest.approx(exact, rel=1e-3)
    assert -0.006 < 1000 * drive(eleven, 0.025, 1).mean() / exact - 1 < -0.0005


def test_trap_an_average_written_over_its_own_input_reads_low(road: np.ndarray) -> None:
    """A program that overwrites the array while it averages smooths twice; ours leaves its input alone."""
    before = road.copy()
    exact = iri(road, 0.025)
    assert (road == before).all()
    overwritten = road - 583.0
    for sample in range(5, len(overwritten) - 5):
        overwritten[sample] = overwritten[sample - 5: sample + 6].mean()
    assert 1000 * drive(overwritten, 0.025, 1).mean() / exact < 0.992


def test_trap_the_car_starts_over_11_m_not_half_a_second(road: np.ndarray) -> None:
    """0.5 s are 11.1 m: a difference of some 0.0002 m/km in the first 20 m, seen and on the right side."""
    graded = road + 0.02 * 0.025 * np.arange(len(road))
    first_20_m = [1000 * drive(graded, 0.025, 10, start_m)[:800].mean() for start_m in (11.0, 0.5 * SPEED_MPS)]
    assert window_iri(rectified_slope(graded, 0.025), 0.025, [0, 20])[0] == pytest.approx(first_20_m[0], abs=1e-8)
    assert 1e-7 < abs(first_20_m[1] - first_20_m[0]) < 0.01


def test_windows_weigh_up_to_the_whole_and_share_steps() -> None:
    profile = np.cumsum(np.random.default_rng(2).standard_normal(2001)) * 1e-3
    slope = rectified_slope(profile, 0.25)
    edges = np.append(np.arange(0, 490, 7.62), 500.0)
    windows = window_iri(slope, 0.25, edges)
    assert windows @ np.diff(edges) / 500.0 == pytest.approx(iri(profile, 0.25), rel=1e-12)
    inside = window_iri(slope, 0.25, [10.0, 10.1, 10.25])
    assert inside == pytest.approx([1000 * slope[40]] * 2)
    for edges in ([0, 10, 10], [-1, 5], [0, 501.0]):
        with pytest.raises(ValueError, match="edges"):
            window_iri(slope, 0.25, edges)


@given(st.integers(30, 2000), st.floats(0.006, 0.3), st.floats(0.1, 50), st.integers(0, 99))
@settings(max_examples=40)
def test_iri_scales_with_height_and_forgets_slope(count: int, spacing_m: float, scale: float, seed: int) -> None:
    if (count - 1) * spacing_m < 11.0:
        count = int(11.0 / spacing_m) + 2
    profile = np.cumsum(np.random.default_rng(seed).standard_normal(count)) * 1e-3
    value = iri(profile, spacing_m)
    moved = scale * profile + 3.0 - 0.02 * spacing_m * np.arange(count)
    assert iri(moved, spacing_m) == pytest.approx(scale * value, rel=1e-6)


def test_what_is_no_profile_is_refused() -> None:
    with pytest.raises(ValueError, match=r"at least 11 m, found 10\.75 m"):
        iri(np.zeros(44), 0.25)
    for spacing_m in (0.0, -0.1, float("nan"), 0.301, 0.3048):
        with pytest.raises(ValueError, match=r"at most 0\.3 m apart"):
            iri(np.zeros(4400), spacing_m)
    with pytest.raises(ValueError, match="finite"):
        iri([0.0, np.nan] * 100, 0.25)
    with pytest.raises(ValueError, match="row"):
        iri(np.zeros((100, 2)), 0.25)
    assert iri(np.zeros(45), 0.25) == 0.0
