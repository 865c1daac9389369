"""A late receiver on simulated drives: error of the learned delay, and how often the truth is within the errors.

Sensors at any angle about the vertical, tilted by up to 8 degrees, delays of 0.05 to 0.4 s, 20 minutes each. With a
number as argument: so many drives of each kind. "unknown delay": IRI of 25 ft windows whose places are late by what is
not known yet, and how often the exact value is within one and two of the standard errors that count it.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from logger.estimation.drive_alignment import angle_rad
from logger.estimation.receiver_delay import DelayEstimate
from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import RoadEstimator
from logger.service.learning import UNKNOWN
from logger.units import MPH_MPS, WINDOW_M
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.models import half_car
from logger.vehicle.structure import body_point

from ..support.drives.braking_drives import Instrument, Mounting, Receiver, drive, fed
from ..support.drives.measured import GRID_HZ, Accelerometer, Road, iso_road, measured_like_road, steady_drive
from .estimator import BMA220 as COARSE
from .estimator import LEAD_S, PASCO, rav4
from .figures import Figures

BMA220 = Instrument()
FINE = Instrument(step_mps2=0.0, noise_mps2=0.03)
DRIVES = 40
SECONDS = 1200.0


@dataclass(frozen=True)
class Case:
    """A kind of drive; goal_s: r.m.s. error of the delay [s], None: none is asked for."""

    name: str
    receiver: Receiver
    instrument: Instrument = BMA220
    slope_rms: float = 0.02
    kind: str = "town"
    goal_s: float | None = 0.02


CASES = (
    Case("town, BMA220, 0.1 m/s", Receiver()),
    Case("town, BMA220, 0.05 m/s", Receiver(noise_mps=0.05)),
    Case("town, BMA220, 0.2 m/s", Receiver(noise_mps=0.2), goal_s=None),
    Case("town, BMA220, hilly", Receiver(), slope_rms=0.05, goal_s=None),
    Case("town, fine sensor, 0.1 m/s", Receiver(), FINE),
    Case("town, BMA220, 10 Hz, lasting noise", Receiver(noise_mps=0.05, lasting_mps=0.1, rate_hz=10)),
    Case("town, BMA220, 5 Hz, tunnels", Receiver(rate_hz=5, gaps_s=((200, 260), (600, 680)))),
    Case("highway, BMA220, 0.1 m/s", Receiver(), kind="highway", goal_s=None),
)


def trial(case: Case, seed: int) -> tuple[DelayEstimate, float, float, int]:
    """Estimate, true delay [s], error of forward about the vertical [rad], number of complaints."""
    rng = np.random.default_rng([7, seed])
    delay_s = float(rng.uniform(0.05, 0.4))
    mounting = Mounting(float(rng.uniform(-180, 180)), *map(float, rng.uniform(-8, 8, 2)))
    receiver = replace(case.receiver, delay_s=delay_s)
    seen = drive(case.kind, SECONDS, mounting, receiver, case.instrument, seed, case.slope_rms)
    found = fed(seen)
    guess = found.estimate()
    off_rad = np.nan
    if guess.forward is not None:
        level = guess.forward - seen.upward * (guess.forward @ seen.upward)
        off_rad = angle_rad(level, seen.forward)
    return guess, delay_s, off_rad, len(found.complaints)


OFF = (-1.150, -0.319, 0.319, 1.150)  # standard errors: the middles of four equal parts of a normal distribution


def windows_off(accelerometer: Accelerometer, road: Road, mph: int, off_s: float, seed: int) -> np.ndarray:
    """By how many standard errors (w,) windows are off whose places are late by ``off_s``, not known better than
    UNKNOWN.std_s."""
    structure = half_car(rav4())
    driven = steady_drive(rav4(), road, mph * MPH_MPS, LEAD_S, GRID_HZ)
    readings, clipped = accelerometer.read(driven.accel_mps2, np.random.default_rng(seed))
    at_end = np.where(clipped, np.sign(readings - np.median(readings)), 0.0)
    way_m = driven.place_m - driven.place_m[0] + off_s * driven.speed_mps + WINDOW_M
    estimator = RoadEstimator(LinearCar(structure, body_point(structure)),
                              Sensor(accelerometer.noise_mps2, accelerometer.step_mps2), WINDOW_M,
                              late_std_s=UNKNOWN.std_s)
    found = estimator.push(readings, ~clipped | (at_end != 0), at_end, way_m) + estimator.finish()
    begin_m = driven.place_m[0] - WINDOW_M + WINDOW_M * np.array([one.number for one in found])
    exact = road.iri(begin_m, begin_m + WINDOW_M)
    score = (np.array([one.iri_m_per_km for one in found]) - exact) / [one.iri_std_m_per_km for one in found]
    return score[np.isfinite(score)]


def unknown_delay(figures: Figures) -> None:
    """Coverage of IRI before the delay is known."""
    for mph in (20, 40, 70):
        roads = [iso_road(3.0, 60 * WINDOW_M, 11), measured_like_road(4.0, 60 * WINDOW_M, 12)]
        score = np.concatenate([windows_off(chip, road, mph, off * UNKNOWN.std_s, number)
                                for number, (chip, road, off) in enumerate(product((PASCO, COARSE), roads, OFF))])
        for errors, share in ((1, 0.683), (2, 0.954)):
            within = float(np.mean(np.abs(score) <= errors))
            print(f"  unknown delay, {mph} mph: within {errors} {within:.3f}, right {share:.3f}", flush=True)
            figures.at_most(f"unknown delay, {mph} mph: within {errors} off", abs(within - share), 0.04, "")


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    drives = int(sys.argv[1]) if len(sys.argv) > 1 else DRIVES
    figures = Figures()
    unknown_delay(figures)
    off, complaints = [], 0
    for case in CASES:
        trials = [trial(case, seed) for seed in range(drives)]
        complaints += sum(each[3] for each in trials)
        reported = [(guess.delay_s - truth_s, guess.std_s) for guess, truth_s, _, _ in trials
                if guess.delay_s is not None and guess.std_s is not None]
        off_deg = [np.degrees(each[2]) for each in trials if np.isfinite(each[2])]
        print(f"  {case.name}: found in {len(reported)} of {drives} drives; "
              f"forward within {max(off_deg, default=0):.1f} degrees", flush=True)
        if not reported:
            continue
        error_s, std_s = np.array(reported).T
        off += list(error_s / std_s)
        print(f"    bias {error_s.mean():+.4f} s, mean standard error {std_s.mean():.4f} s, within two of them "
              f"{np.mean(np.abs(error_s) < 2 * std_s):.2f}", flush=True)
        if case.goal_s is None:
            print(f"    r.m.s. error {np.sqrt(np.mean(error_s**2)):.4f} s", flush=True)
        else:
            figures.at_most(f"{case.name}: r.m.s. error", float(np.sqrt(np.mean(error_s**2))), case.goal_s, "s")
    figures.at_least("truth within two standard errors", float(np.mean(np.abs(off) < 2)), 0.95, "")
    figures.at_least("truth within one standard error", float(np.mean(np.abs(off) < 1)), 0.64, "")
    figures.at_most("complaints without a cause, per drive", complaints / drives / len(CASES), 0.05, "")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
