"""The r.m.s. relation against drives in the time domain, and its standard error against the exact IRI of windows."""


import numpy as np
import pytest
from scipy import signal

from logger.estimation.rms_calibration import RmsRelation, rms_relation
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.models import GOLDEN_CAR, half_car

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
A, B = half_car(RAV4).state_space()
SPACING_M = 0.05
WHEELBASE_M = 2.94


def under_wheels(elevation_m: np.ndarray) -> np.ndarray:
    """Elevation under the front and the rear wheel, each averaged over 250 mm, the front at each sample in turn."""
    front = np.convolve(elevation_m - elevation_m[0], np.full(5, 0.2), mode="same")
    behind = round(WHEELBASE_M / SPACING_M)
    return np.stack([front, np.concatenate([np.zeros(behind), front[:-behind]])], axis=1)


def butterworth_15_hz(f_hz: np.ndarray) -> np.ndarray:
    return 1 / np.sqrt(1 + (f_hz / 15.0) ** 4)


@pytest.mark.slow
@pytest.mark.parametrize("speed_mps", [4.5, 17.9, 31.3])
def test_relation_agrees_with_drives_in_the_time_domain(speed_mps: float) -> None:
    """Monte Carlo as in 6.3 of the dissertation: a long ISO road, scipy's simulation of the half car, the r.m.s."""
    gd_n0_cm3 = 100.0
    road = under_wheels(iso8608.generate(gd_n0_cm3, 8000, SPACING_M, 21))
    step_s = SPACING_M / speed_mps
    system = signal.StateSpace(A, B, A[4:5], B[4:5])
    _, accel, _ = signal.lsim(system, road, step_s * np.arange(len(road)), interp=True)
    settled = accel[len(accel) // 20:]
    spectrum = np.fft.rfft(settled)
    filtered = np.fft.irfft(spectrum * butterworth_15_hz(np.fft.rfftfreq(len(settled), step_s)), len(settled))
    speeds = [speed_mps, speed_mps + 1]
    for signal_mps2, relation in (
        (settled, rms_relation(known_vehicle(RAV4), None, speeds)),
        (filtered, rms_relation(known_vehicle(RAV4), butterworth_15_hz, speeds)),
    ):
        rms = float(np.sqrt(np.mean(signal_mps2**2)))
        assert relation.iri(rms, speed_mps) == pytest.approx(iso8608.iri_from_gd_n0(gd_n0_cm3), rel=0.03)


def test_relation_between_and_outside_its_speeds() -> None:
    relation = RmsRelation(np.array([5.0, 10.0]), np.array([20.0, 16.0]))
    assert relation.iri(0.5, 7.5) == pytest.approx(9.0)
    assert relation.iri(np.array([1.0, 2.0]), np.array([5.0, 10.0])) == pytest.approx([20.0, 32.0])
    assert np.isnan(relation.iri(np.array([1.0, 1.0, 1.0]), np.array([4.99, 10.01, np.nan]))).all()


def test_relation_covers_3_to_45_mps() -> None:
    relation = rms_relation(known_vehicle(RAV4))
    assert (relation.speeds_mps[0], relation.speeds_mps[-1]) == (3.0, 45.0)
    assert (np.diff(relation.iri_per_accel_rms) < 0).all()
    fine = rms_relation(known_vehicle(RAV4), None, np.arange(3, 45, 0.1))
    coarse = relation.iri(np.ones(len(fine.speeds_mps)), fine.speeds_mps)
    assert coarse == pytest.approx(fine.iri_per_accel_rms, rel=0.012)
    assert rms_relation(known_vehicle(GOLDEN_CAR)).iri(1.0, 20.0) > 0
