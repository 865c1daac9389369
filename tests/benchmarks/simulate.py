"""The simulation: how far from Newton's laws in another integrator, and how much faster than the road is driven, with
each effect too."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from logger.profiles.track import Track
from logger.roads import iso8608
from logger.roads.obstacles import pothole, speed_bump, step
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import chosen
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import Passage, recorder_taps
from logger.vehicle.structure import Output, Structure, body_point, suspension_travel, tire_deflection, wheel
from logger.vehicle.vehicle import Vehicle

from ..support.drives.linear_drive import drive
from .figures import Figures

Array = npt.NDArray[np.float64]

GOAL_PERCENT = 0.01
MINUTE_S, SPEED_MPS = 60, 20.0
MODELS = {"quarter": "golden-car", "half": "rav4-2009", "full": "rav4-2009-full"}
MEASURED = ("sensor", "wheel", "travel", "tire")


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    accuracy(figures)
    recorder(figures)
    speed(figures)
    effects(figures)
    return 1 if figures.missed else 0


def vehicle_of(model: str) -> Vehicle:
    return read_vehicle(vehicle_file(MODELS[model]))


def outputs_of(car: Structure) -> list[Output]:
    """As ``MEASURED``."""
    return [body_point(car), wheel(car, 0), suspension_travel(car, 0), tire_deflection(car, 0)]


def uneven(t: Array) -> Array:
    """Between 6 and 14 m/s."""
    return np.asarray(10 * t - 3.2 * np.sin(1.25 * t) - 1.0)


def accuracy(figures: Figures) -> None:
    """R.m.s. of the error over r.m.s. of the motion, of the worst of four outputs, against DOP853 at rtol 1e-7."""
    x, fine_x = 0.05 * np.arange(1600), 0.01 * np.arange(4000)
    rough = np.random.default_rng(2).standard_normal(4000) * 0.005  # every centimetre of it another height
    random, other = (Track(0.05, iso8608.generate(256, 80, 0.05, seed)) for seed in (3, 4))
    both = np.stack([random.elevation_m - random.elevation_m[0], other.elevation_m - other.elevation_m[0]], axis=1)
    cases: list[tuple[str, str, Track, Callable[[Array], Array], float]] = [
        ("class C, 20 m/s", "half", random, lambda t: 20 * t - 1, 3.0),
        ("class C, uneven speed", "half", random, uneven, 4.0),
        ("bump of Eq 4.41, 8 m/s", "half", Track(0.05, speed_bump(x, 8, 0.08, 3.6)), lambda t: 8 * t - 1, 3.0),
        ("kerb of 50 mm, 25 m/s", "half", Track(0.01, step(fine_x, 5, 0.05)), lambda t: 25 * t, 1.5),
        ("pothole, 14 m/s", "half", Track(0.01, pothole(fine_x, 5, 0.06, 0.6)), lambda t: 14 * t, 1.5),
        ("white noise each cm, 12 m/s", "half", Track(0.01, rough), lambda t: 12 * t - 1, 1.5),
        ("class C, 22 m/s", "quarter", random, lambda t: 22 * t - 1, 2.0),
        ("class C, two tracks, uneven", "full", Track(0.05, both), uneven, 2.5),
    ]
    for name, model, track, way, duration_s in cases:
        vehicle, fine_s = vehicle_of(model), np.arange(int(duration_s * 8000) + 1) / 8000
        car = structure_of(vehicle)
        expected = judged(vehicle, track, way, fine_s)
        time_s, kernel = fine_s[::80], recorder_taps(80)
        half = len(kernel) // 2
        filtered = np.pad(expected, ((half, half), (0, 0)), "edge")
        filtered = np.stack([np.convolve(column, kernel, "valid") for column in filtered.T], axis=1)[::80]
        inside = slice(0, len(time_s) - half // 80 - 1)
        found = drive(car, outputs_of(car), track, time_s, way(time_s))
        report(figures, f"{model}: {name}, recorded", found[inside], filtered[inside])


def judged(vehicle: Vehicle, track: Track, way: Callable[[Array], Array], time_s: Array) -> Array:
    """The same outputs by Newton's laws in SciPy."""
    from ..support.drives.newton_car import judge, road_under

    columns = track.elevation_m.reshape(len(track.elevation_m), -1).T
    roads = [road_under(0.0, track.spacing_m, column, vehicle.contact_patch_m) for column in columns]
    reported = judge(vehicle, roads, way, time_s)
    return np.stack([reported.body_mps2, reported.wheel_mps2[:, 0], reported.travel_m[:, 0], reported.tire_m[:, 0]],
    axis=1)


def report(figures: Figures, name: str, found: Array, expected: Array) -> None:
    error = 100 * np.sqrt(np.mean((found - expected) ** 2, axis=0) / np.mean(expected**2, axis=0))
    worst = int(np.argmax(error))
    figures.at_most(f"{name} ({MEASURED[worst]})"[:48], float(error[worst]), GOAL_PERCENT, "%")


def recorder(figures: Figures) -> None:
    """The recorder's filter at 10 steps per sample."""
    taps = recorder_taps(10)
    f_hz = np.linspace(0, 500, 20_001)
    turn = 2 * np.pi * np.multiply.outer(f_hz / 1000, np.arange(len(taps)) - len(taps) // 2)
    gain_db = 20 * np.log10(np.abs(np.cos(turn) @ taps) + 1e-12)
    figures.at_most("recorder: ripple up to 38 Hz", float(np.abs(gain_db[f_hz <= 38]).max()), 0.01, "dB")
    figures.at_most("recorder: what is above 50 Hz", float(gain_db[f_hz >= 50].max()), -75, "dB")


def speed(figures: Figures) -> None:
    """A minute of driving, beside scipy.signal.lsim on the same 60,000 steps with the elevations ready made."""
    track = Track(0.05, iso8608.generate(256, 1300, 0.05, 3))
    time_s = np.arange(MINUTE_S * 100 + 1) / 100
    fine_s = np.arange(MINUTE_S * 1000 + 1) / 1000
    for model in MODELS:
        car = structure_of(vehicle_of(model))
        sensor = [body_point(car)]
        taken_s = best_s(lambda car=car, sensor=sensor: drive(car, sensor, track, time_s, SPEED_MPS * time_s))
        if model == "half":
            figures.at_most("half car: a minute at 100 Hz, band-limited", 1e3 * taken_s, 15, "ms")
        figures.at_least(f"{model} car: times real time", MINUTE_S / taken_s, 2000, "x")
        faster = lsim_s(car, track, fine_s) / taken_s
        figures.at_least("  scipy.signal.lsim of 60,000 steps over it", faster, 5, "x")


STRONG = {"progressive_spring": {"cubic_stiffness_n_per_m3": 1e7}, "bump_stop": {"clearance_m": 0.01}}


def effects(figures: Figures) -> None:
    """A minute of a half car with each effect that bends its laws, and with all of them, processor time alone."""
    track = Track(0.05, iso8608.generate(256, 1300, 0.05, 3))
    passage = Passage(track, 100.0, SPEED_MPS * np.arange(MINUTE_S * 100 + 1) / 100)
    vehicle, bending = vehicle_of("half"), []
    for name, effect in shipped_effects().items():
        one = chosen(effect, effect.usual | STRONG.get(name, {}))
        if effect.obstacle(vehicle, two_tracks=False) is None and compose(vehicle, [one]).bends_laws:
            bending.append(one)
    for name, some in {**{one.effect.name: [one] for one in bending}, "all of them": bending}.items():
        car = compose(vehicle, some)
        taken_s = best_s(lambda car=car: recorded(car, passage), 5, time.process_time)
        figures.at_most(f"half car with {name}: a minute", 1e3 * taken_s, 100, "ms")


def lsim_s(car: Structure, track: Track, fine_s: Array) -> float:
    """How long lsim takes [s]."""
    from scipy.signal import lsim

    observe, direct = car.output_matrices([body_point(car)])
    system = (*car.state_space(), observe, direct)
    under = np.stack([track.averaged(SPEED_MPS * fine_s - behind_m, car.contact_patch_m) for behind_m in car.behind_m])
    return best_s(lambda: lsim(system, under.T, fine_s), 3)


def best_s(work: Callable[[], object], times: int = 9, clock: Callable[[], float] = time.perf_counter) -> float:
    """How long it takes when nothing else runs [s]."""
    taken = []
    for _ in range(times):
        started_s = clock()
        work()
        taken.append(clock() - started_s)
    return min(taken)


if __name__ == "__main__":
    sys.exit(main())
