"""The simulation against Newton's laws in SciPy's integrator, and against what must hold on any road."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from logger.profiles.track import Track
from logger.roads import iso8608
from logger.roads.obstacles import pothole, speed_bump, step
from logger.shipped import vehicle_file
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import Passage, recorder_taps
from logger.vehicle.structure import body_point, suspension_travel, tire_deflection, wheel
from logger.vehicle.vehicle import Vehicle

from ..support.drives.linear_drive import body_acceleration_response, drive
from ..support.drives.newton_car import Told, judge, road_under
from ..support.slow import slow

RMS_GOAL = 1e-4
RAV4 = read_vehicle(vehicle_file("rav4-2009"))
PLAIN_FULL = read_vehicle(vehicle_file("rav4-2009-full"))
FULL = replace(PLAIN_FULL, front=replace(PLAIN_FULL.front, anti_roll_stiffness_n_m_per_rad=15e3))
GOLDEN = read_vehicle(vehicle_file("golden-car"))
FINE = 0.05 * np.arange(1200)

Way = Callable[[np.ndarray], np.ndarray]


def steady(speed_mps: float) -> Way:
    return lambda t: speed_mps * t - 1.0


def uneven(t: np.ndarray) -> np.ndarray:
    """Between 6 and 14 m/s."""
    return 10 * t - 3.2 * np.sin(1.25 * t) - 1.0


def stop_and_go(t: np.ndarray) -> np.ndarray:
    """8 m/s, braked at 4 m/s2 to a stand, standing a second, and off again at 3 m/s2."""
    braked = np.minimum(t, 2.0)
    gone = np.maximum(t - 3.0, 0.0)
    return 8 * braked - 2 * braked**2 + 1.5 * gone**2 - 1.0


RANDOM = iso8608.generate(256, 60, 0.05, 3)
TWO = np.stack([RANDOM, iso8608.generate(256, 60, 0.05, 4)], axis=1)
TWO -= TWO[0]
CASES: dict[str, tuple[Vehicle, Track, Way, float]] = {
    "half car, random road": (RAV4, Track(0.05, RANDOM), steady(20.0), 1.5),
    "half car, uneven speed": (RAV4, Track(0.05, RANDOM), uneven, 2.0),
    "half car, stop and go": (RAV4, Track(0.05, RANDOM), stop_and_go, 4.2),
    "half car, bump": (RAV4, Track(0.05, speed_bump(FINE, 8, 0.08, 3.6)), steady(8.0), 2.2),
    "half car, step": (RAV4, Track(0.01, step(FINE / 5, 5, 0.05)), steady(25.0), 1.5),
    "half car, sharp pothole": (RAV4, Track(0.013, pothole(FINE / 5, 5, 0.06, 0.6)), steady(14.0), 1.5),
    "quarter car, random road": (GOLDEN, Track(0.05, RANDOM), steady(22.0), 1.2),
    "full car, two tracks": (FULL, Track(0.05, TWO), uneven, 1.5),
}


def outputs_of(vehicle: Vehicle) -> list:
    car = structure_of(vehicle)
    pitches, rolls = bool(car.body[:, 1].any()), bool(car.body[:, 2].any())
    return [body_point(car), body_point(car, 0.8 * pitches, 0.3 * rolls), wheel(car, -1), suspension_travel(car, 0),
            tire_deflection(car, -1)]


def as_outputs(reported: Told, vehicle: Vehicle) -> np.ndarray:
    ahead_m, left_m = 0.8 * (vehicle.rear is not None), 0.3 * (vehicle.track_width_m is not None)
    point = reported.body_mps2 + ahead_m * reported.pitch_radps2 + left_m * reported.roll_radps2
    return np.stack([reported.body_mps2, point, reported.wheel_mps2[:, -1], reported.travel_m[:, 0], reported.tire_m[:,
    -1]], axis=1)


@cache
def judged(case: str) -> tuple[np.ndarray, np.ndarray]:
    """Times at 4 kHz and what SciPy makes of the case, as ``outputs_of``."""
    vehicle, track, way, duration_s = CASES[case]
    columns = track.elevation_m.reshape(len(track.elevation_m), -1).T
    roads = [road_under(track.start_m, track.spacing_m, column, vehicle.contact_patch_m) for column in columns]
    time_s = np.arange(int(duration_s * 4000) + 1) / 4000
    return time_s, as_outputs(judge(vehicle, roads, way, time_s), vehicle)


def error(found: np.ndarray, expected: np.ndarray) -> float:
    """Root mean square over root mean square, of the worst output."""
    return float(np.sqrt(np.mean((found - expected) ** 2, axis=0) / np.mean(expected**2, axis=0)).max())


LONG = ("half car, random road", "half car, stop and go", "quarter car, random road")


@pytest.mark.parametrize("case", [*(one for one in CASES if one not in LONG), *slow(*LONG)])
def test_drive_agrees_with_newtons_laws_behind_the_recorders_filter(case: str) -> None:
    vehicle, track, way, _ = CASES[case]
    fine_s, expected = judged(case)
    kernel = recorder_taps(40)
    half = len(kernel) // 2
    padded = np.pad(expected, ((half, half), (0, 0)), "edge")
    expected = np.stack([np.convolve(column, kernel, "valid") for column in padded.T], axis=1)[::40]
    time_s = fine_s[::40]
    found = drive(structure_of(vehicle), outputs_of(vehicle), track, time_s, way(time_s))
    inside = slice(0, len(time_s) - half // 40 - 1)  # after the end the two drive on differently
    assert error(found[inside], expected[inside]) < RMS_GOAL


def test_filter_is_flat_to_38_hz_and_lets_nothing_fold_down() -> None:
    for steps in (1, 5, 10, 20):
        taps = recorder_taps(steps)
        f_hz = np.linspace(0, 50 * steps, 4001)
        tap = np.arange(len(taps)) - len(taps) // 2
        gain = np.cos(2 * np.pi * np.multiply.outer(f_hz / (100 * steps), tap)) @ taps
        assert taps == pytest.approx(taps[::-1], abs=1e-15)
        assert 20 * np.log10(gain[f_hz <= 38].min()) > -0.01
        assert 20 * np.log10(gain[f_hz <= 38].max()) < 0.01
        assert np.abs(gain[f_hz >= 50.5]).max(initial=0.0) < 2e-4


@pytest.mark.parametrize("f_hz", [1.0, 8.0, 30.0])
@pytest.mark.parametrize("vehicle", [GOLDEN, RAV4, FULL], ids=lambda vehicle: vehicle.name)
def test_a_wave_comes_through_as_the_frequency_response_says(vehicle: Vehicle, f_hz: float) -> None:
    """Amplitude and phase of a steady wave: nothing of the filter's delay is left."""
    speed_mps = 15.0
    x = 0.01 * np.arange(20_000)
    car = structure_of(vehicle)
    time_s = np.arange(1000) / 100
    track = Track(0.01, 0.01 * np.sin(2 * np.pi * f_hz / speed_mps * x))
    found = drive(car, [body_point(car)], track, time_s, 5 + speed_mps * time_s)[400:900, 0]
    waves = np.exp(2j * np.pi * f_hz * (time_s + 5 / speed_mps))[400:900]
    design = np.stack([waves.imag, waves.real], axis=1)
    (in_phase, across), *_ = np.linalg.lstsq(design, found, rcond=None)
    expected = 0.01 * body_acceleration_response(car, f_hz, speed_mps)
    assert complex(in_phase, across) == pytest.approx(complex(expected), rel=1e-3 if f_hz < 20 else 2e-3)


def test_standing_and_a_flat_road_are_still_at_any_height() -> None:
    car = structure_of(RAV4)
    time_s = np.arange(300) / 100
    outputs = outputs_of(RAV4)
    still = drive(car, outputs, Track(0.05, RANDOM + 583.0), time_s, np.full(300, 20.0))
    assert still[:, :3] == pytest.approx(0, abs=1e-9)
    assert still[:, 3:] == pytest.approx(np.broadcast_to(still[0, 3:], (300, 2)), abs=1e-9)
    flat = drive(car, [*outputs, body_point(car, order=0)], Track(1.0, np.full(3, 583.0)), time_s, 30 * time_s)
    assert flat[:, :5] == pytest.approx(0, abs=1e-9)
    assert flat[:, 5] == pytest.approx(0.0, abs=1e-9)  # heights count from where the first wheel begins


def test_the_height_of_the_country_changes_nothing() -> None:
    car, time_s = structure_of(RAV4), np.arange(500) / 100
    low, high = (drive(car, outputs_of(RAV4), Track(0.05, RANDOM + height_m), time_s, uneven(time_s))
                 for height_m in (0.0, 2000.0))
    assert high == pytest.approx(low, abs=1e-8)


def test_two_equal_tracks_neither_roll_the_full_car_nor_differ_from_one() -> None:
    car, time_s = structure_of(FULL), np.arange(300) / 100
    outputs = [body_point(car), body_point(car, 0.0, 0.7), wheel(car, 0), wheel(car, 1)]
    one = drive(car, outputs, Track(0.05, RANDOM), time_s, 15 * time_s)
    two = drive(car, outputs, Track(0.05, np.stack([RANDOM, RANDOM], axis=1)), time_s, 15 * time_s)
    assert two == pytest.approx(one, abs=1e-12)
    assert one[:, 1] == pytest.approx(one[:, 0], abs=1e-9)
    assert one[:, 3] == pytest.approx(one[:, 2], abs=1e-9)


def test_the_left_wheels_drive_on_the_left_track() -> None:
    car, time_s = structure_of(FULL), np.arange(200) / 100
    left_only = Track(0.05, np.stack([RANDOM, 0 * RANDOM], axis=1))
    found = drive(car, [wheel(car, index) for index in range(4)], left_only, time_s, 15 * time_s)
    left, right = (np.sqrt(np.mean(found[:, columns] ** 2)) for columns in ([0, 2], [1, 3]))
    assert left > 5 * right
    half = structure_of(RAV4)
    alone = drive(half, [body_point(half)], Track(0.05, RANDOM), time_s, 15 * time_s)
    assert drive(half, [body_point(half)], left_only, time_s, 15 * time_s) == pytest.approx(alone, abs=1e-12)


def test_a_linear_car_adds_up() -> None:
    car, time_s = structure_of(RAV4), np.arange(400) / 100
    other = speed_bump(FINE, 12, 0.1, 2.0)

    def on(elevation: np.ndarray) -> np.ndarray:
        return drive(car, outputs_of(RAV4), Track(0.05, elevation), time_s, uneven(time_s))

    both = on(2 * RANDOM[:1200] + other)
    assert both == pytest.approx(2 * on(RANDOM[:1200]) + on(other), abs=1e-9)


@pytest.mark.parametrize("rate_hz", [20.0, 50.0, 200.0, 1000.0, 2000.0])
def test_every_rate_shows_the_same_slow_motion(rate_hz: float) -> None:
    """A slow bump has nothing that any of the filters would take away."""
    car, bump = structure_of(RAV4), Track(0.05, speed_bump(FINE, 10, 0.1, 10.0))
    times = np.arange(int(6 * rate_hz)) / rate_hz
    found = drive(car, [suspension_travel(car, 0)], bump, times, 3 * times)
    often = np.arange(0, 6000) / 1000
    expected = drive(car, [suspension_travel(car, 0)], bump, often, 3 * often)[:: int(1000 / min(rate_hz, 1000))]
    assert found.shape == (len(times), 1)
    assert found[:: max(1, int(rate_hz / 1000))] == pytest.approx(expected, abs=2e-5)


@pytest.mark.parametrize("distance_m", [np.zeros(1), np.zeros((2, 10)), np.full(10, np.nan)])
def test_what_is_no_drive_is_refused(distance_m: np.ndarray) -> None:
    with pytest.raises(ValueError, match="two or more finite distances"):
        Passage(Track(0.1, np.zeros(3)), 100.0, distance_m)
