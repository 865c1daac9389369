"""From an estimated road to its IRI, against many simulated roads and the Golden Car's own memory."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import sosfilt

from logger.estimation.car_response import WAVE_NUMBERS_CPM, CarResponse, golden_car_slope, steady_motion
from logger.estimation.iri_posterior import SlopeKnowledge, by_slope, resolved_share, slope_knowledge, window_iri
from logger.estimation.road_spectrum import RoadSpectrum
from logger.roads.iri import TIRE_BASE_M, golden_car_sections
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import structure_of
from logger.vehicle.structure import body_point

from ..support.drives.linear_drive import body_acceleration_response

SPACING_M, POINTS, COUNT = 0.1524, 50, 50 * 2560
WINDOW_M = SPACING_M * POINTS
RATE_HZ = 100.0
RAV4 = structure_of(read_vehicle(vehicle_file("rav4-2009")))
CAR = CarResponse(LinearCar(RAV4, body_point(RAV4)))
WAVES = np.fft.rfftfreq(COUNT, SPACING_M)


def simulated(speed_mps: float, spectrum: RoadSpectrum, variance: float) -> tuple[np.ndarray, ...]:
    """True and estimated slopes (COUNT,), true and estimated acceleration, of a long road that closes on itself.

    The estimate is the textbook Wiener filter, wave by wave.
    """
    rng = np.random.default_rng(3)
    road_psd = np.where(WAVES > 0, spectrum.psd(WAVES), 0.0)
    noise_psd = 2 * variance / RATE_HZ * speed_mps
    seen = (WAVES > 0) & (WAVES * speed_mps <= 42.0)
    gain = np.zeros(len(WAVES), dtype=complex)
    gain[seen] = body_acceleration_response(RAV4, WAVES[seen] * speed_mps, speed_mps)

    def drawn(psd: np.ndarray) -> np.ndarray:
        waves = rng.standard_normal(len(WAVES)) + 1j * rng.standard_normal(len(WAVES))
        return waves * np.sqrt(psd * COUNT / (4 * SPACING_M))

    road = drawn(road_psd)
    reading = gain * road + drawn(np.full(len(WAVES), noise_psd))
    wiener = np.conj(gain) * road_psd / (np.abs(gain) ** 2 * road_psd + noise_psd)
    golden = golden_car_slope(WAVES)
    rows = (golden * road, golden * wiener * reading, gain * road, gain * wiener * reading)
    return tuple(np.fft.irfft(row, COUNT) for row in rows)


def knowledge_at(speed_mps: float, spectrum: RoadSpectrum, deviation: float) -> SlopeKnowledge:
    """For readings of this deviation [m/s2], over the lags of a window."""
    return slope_knowledge(CAR, speed_mps, spectrum, deviation**2, RATE_HZ, SPACING_M, POINTS + 1)


@pytest.mark.slow
@pytest.mark.parametrize("speed_mps", [4.5, 13.4, 31.3])
@pytest.mark.parametrize(("iri", "waviness", "deviation"), [(1.0, 2.0, 0.06), (4.0, 1.7, 0.06), (3.0, 2.3, 0.25)])
def test_errors_are_as_large_as_predicted(speed_mps: float, iri: float, waviness: float, deviation: float) -> None:
    """Variance of the slope and of the acceleration, their correlation, bias and spread of 2560 windows' IRI."""
    spectrum = RoadSpectrum.of_iri(iri, waviness)
    true, found, accel, fitted = simulated(speed_mps, spectrum, deviation**2)
    knowledge = knowledge_at(speed_mps, spectrum, deviation)
    assert knowledge.variance == pytest.approx(true.var(), rel=0.03)
    # the cut at 42 Hz falls between two waves
    assert float(knowledge.left(np.zeros(1))[0]) == pytest.approx((true - found).var(), rel=0.06)
    assert knowledge.resolved == pytest.approx(1 - (true - found).var() / true.var(), abs=0.01)
    off = true - found
    by_lag = [off @ np.roll(off, lag) / (off @ off) for lag in range(0, POINTS + 1, 5)]
    assert knowledge.correlation[::5] == pytest.approx(by_lag, abs=0.03)

    left = steady_motion(CAR, speed_mps, spectrum, RATE_HZ, 8192).covariance_left(deviation**2)[0]
    assert left == pytest.approx((accel - fitted).var(), rel=0.05)

    numbers = range(COUNT // POINTS - 1)
    windows = [slice(number * POINTS, (number + 1) * POINTS + 1) for number in numbers]
    nothing = np.zeros(POINTS + 1)
    estimates = [window_iri(found[w], nothing, nothing, knowledge, 0.0, WINDOW_M, 0.0) for w in windows]
    exact = np.array([1000 * np.trapezoid(np.abs(true[w])) / POINTS for w in windows])
    estimate = np.array([one.iri_m_per_km for one in estimates])
    std = np.array([one.own_std_m_per_km for one in estimates])
    assert estimate.mean() == pytest.approx(exact.mean(), rel=0.015)
    score = (estimate - exact) / std
    assert np.sqrt(np.mean(score**2)) == pytest.approx(1.0, abs=0.06)
    assert np.mean(np.abs(score) < 1) == pytest.approx(0.683, abs=0.03)
    assert np.mean(np.abs(score) < 2) == pytest.approx(0.954, abs=0.02)


@pytest.mark.parametrize("rise", [0.0, -1.3])
def test_the_levels_error_moves_all_windows_alike(rise: float) -> None:
    """The mean over a normally distributed level, and the deviation over it, by sums over many levels."""
    spectrum, level_std = RoadSpectrum.of_iri(1.0), 0.4
    flat, unseen = np.zeros(POINTS + 1), np.zeros(POINTS + 1)
    found = window_iri(flat, unseen, flat + rise, knowledge_at(5.0, spectrum, 0.3), level_std, WINDOW_M, 0.0)
    off = np.linspace(-5, 5, 201)
    chance = np.exp(-0.5 * off**2) / np.exp(-0.5 * off**2).sum()
    left = [knowledge_at(5.0, rougher(spectrum, rise + level_std * one), 0.3).left(np.zeros(1))[0]
            for one in off.tolist()]
    each = 1000 * np.sqrt(2 / np.pi * np.array(left))
    assert found.iri_m_per_km == pytest.approx(chance @ each, rel=2e-3)
    assert found.level_std_m_per_km == pytest.approx(np.sqrt(chance @ (each - chance @ each) ** 2), rel=0.02)


def rougher(spectrum: RoadSpectrum, rise: float) -> RoadSpectrum:
    """By the logarithm of how much."""
    return replace(spectrum, log_level=spectrum.log_level + rise)


def test_a_road_not_read_has_the_prior_mean_of_its_level() -> None:
    spectrum = RoadSpectrum.of_iri(3.0)
    known = knowledge_at(20.0, spectrum, 0.05)
    blind = window_iri(np.zeros(POINTS + 1), np.ones(POINTS + 1), np.zeros(POINTS + 1), known, 0.0, WINDOW_M, 0.0)
    assert blind.iri_m_per_km == pytest.approx(1000 * np.sqrt(2 / np.pi * known.variance), rel=1e-6)
    assert blind.iri_m_per_km == pytest.approx(3.0, rel=0.05)  # Eq 4.40, over 0.011 to 2.83 cycles per metre


def test_reported_share_goes_from_nothing_to_all_with_the_noise() -> None:
    spectrum = RoadSpectrum.of_iri(2.0)
    seen = CAR.power(15.0) > 0
    shares = [resolved_share(CAR, 15.0, spectrum, noise_psd)[seen] for noise_psd in (1e12, 1e-3, 1e-30)]
    assert shares[0].max() < 1e-9 and shares[2].min() > 1 - 1e-9
    assert ((shares[0] <= shares[1]) & (shares[1] <= shares[2])).all()
    assert not resolved_share(CAR, 15.0, spectrum, 1e-3)[WAVE_NUMBERS_CPM * 15 > 45].any()


def remembered_power(spacing_m: float) -> np.ndarray:
    """Power of the exact filter's response to one unit of slope, 1 mm at a time, summed over steps of a grid."""
    fine_m = spacing_m / 100
    impulse = np.zeros(round(45.0 / fine_m))
    impulse[: round(TIRE_BASE_M / fine_m)] = 1.0  # the tire's average, which reaches ahead by half of it
    ahead = round(0.5 * TIRE_BASE_M / fine_m)
    power = sosfilt(golden_car_sections(fine_m), impulse)[ahead:] ** 2
    by_step = np.add.reduceat(power, np.arange(0, len(power), 100))
    return by_step / by_step.sum()


@pytest.mark.parametrize("seen", ["all", "none", "from the middle on", "hole"])
def test_unseen_share_by_direct_convolution(seen: str) -> None:
    row = np.ones(900)
    row[{"all": slice(0), "none": slice(None), "from the middle on": slice(450), "hole": slice(300, 340)}[seen]] = 0
    missing = np.concatenate([np.ones(1000), 1 - row])
    direct = np.convolve(missing, remembered_power(SPACING_M))[1000: 1000 + len(row)]
    found = 1 - by_slope(np.append(row, np.zeros(400)), SPACING_M)[:len(row)]  # as a block, which ends unseen
    assert found == pytest.approx(direct, abs=0.07)  # a grid's step is half the way in which most is forgotten
    assert (found >= -1e-12).all() and (found <= 1 + 1e-12).all()
