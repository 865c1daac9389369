"""What an effect costs the IRI when the car's file lacks it, and how much of that comes back when the file has it.

    python -m tests.benchmarks.effects_on_board [--full] [--only EFFECT]...

A half car with one effect is driven over ISO and measured-like roads of IRI 1.5 to 6 at 10 and 22 m/s (--full: at
four speeds over five levels), integrated here step by step from Newton's laws, sharing nothing with ridelog's models;
the estimator gets the readings with the file of the plain car, and with the file that has the true effect. Exit 1 when
a goal is missed.

R2 is 1 - mean((estimate - exact)^2) / var(exact) over all windows. The loss is what the plain file has less of it than
the plain car with its own file has; "back" is the share of it that the file with the effect wins again. An effect whose
loss is below 0.01 has nothing to win back. "in 1" and "in 2" are the shares of windows within one and two standard
errors; those of ``speed_scale`` are asked for where the car truly was.

Then the plain car with files whose numbers are all off, by new errors for each drive, without standard errors in
the file and with them: their windows must lie within the errors that are given as often as they should.

A damper's asymmetry costs little, and 78 % of that comes back.

Goals: 80 % of the loss back; over all effects, and over all files with standard errors, 64 to 72 % of windows within
one standard error and 92 to 97 % within two.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numba import njit
from scipy.signal import bilinear, lfilter

from logger.estimation.sensor_noise import Sensor
from logger.estimation.streaming import RoadEstimator
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.units import STANDARD_GRAVITY_MPS2, WINDOW_M
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.named_parameters import changed, read, sized
from logger.vehicle.uncertain import NumberErrors, cars_off
from logger.vehicle.vehicle import Vehicle

from ..support.drives.measured import Road, iso_road, measured_like_road, recorder_response
from ..validation.field_loop import Windows, pooled
from .figures import Figures

Array = np.ndarray

FIRST_SEED = 970_000
RATE_HZ, FINE_HZ = 100, 4000
LEAD_S = 16.0
NOISE_MPS2 = 0.02
WINDOWS = 60
LEAST_LOSS = 0.01
# A file's errors are shared by all windows of its drive: with 12 files chance moved the shares by some 7 %.
OFF, DRAWS = 0.1, 36


@dataclass(frozen=True)
class Extent:
    """How much is driven."""

    speeds_mps: Sequence[float]
    levels: Sequence[float]


QUICK, FULL = Extent((10.0, 22.0), (1.5, 3.0, 6.0)), Extent((6.0, 12.0, 20.0, 30.0), (1.0, 2.0, 4.0, 7.0, 10.0))

EFFECTS: dict[str, dict[str, float]] = {
    "payload": {"mass_kg": 150.0},
    "cg_shift": {"shift_m": 0.25},
    "tire_enveloping": {"contact_patch_m": 0.6},
    "occupant": {"mass_kg": 120.0, "frequency_hz": 3.0, "damping_ratio": 0.2},
    "sensor_offset": {"offset_m": 0.8},
    "sensor_gain": {"gain": 1.15},
    "sensor_bandwidth": {"cutoff_hz": 6.0},
    "sensor_mount_resonance": {"frequency_hz": 14.0, "damping_ratio": 0.1},
    "time_offset": {"delay_s": 0.3},
    "speed_scale": {"scale": 1.04},
    "tire_damping": {"tire_damping_n_s_per_m": 600.0},
    "top_mount_compliance": {"mount_stiffness_n_per_m": 4e4},
    "dry_friction": {"friction_force_n": 150.0},
    "damper_blow_off": {"knee_velocity_m_per_s": 0.05, "slope_ratio": 0.3},
    "damper_asymmetry": {"rebound_to_bump_ratio": 3.0},
    "progressive_spring": {"cubic_stiffness_n_per_m3": 3e7},
    "bump_stop": {"clearance_m": 0.01, "stop_stiffness_n_per_m": 5e4},
    "wheel_lift": {},
}


# --- the truth -------------------------------------------------------------------------------------------------------


@njit(cache=False)
def rates(x, z, zr, p, at, out):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Derivatives of the state, and the sensor's acceleration.

    x: heave, pitch, two wheels, their rates, two mounts' compressions, a rider's height and rate; z, zr (2,) elevations
    and their rates; p numbers of the effect, ``at`` those of the car, one row for each axle.
    """
    mass, inertia = p[0], p[1]
    rider, rider_k, rider_c = p[11], p[12], p[13]
    up, turn = -rider_k * (x[0] - x[10]) - rider_c * (x[4] - x[11]), 0.0
    for i in range(2):
        arm, unsprung, k, c, tire, load = at[i]
        travel = x[0] + arm * x[1] - x[2 + i]
        rate = x[4] + arm * x[5] - x[6 + i]
        own = rate
        if p[2] > 0:  # a mount in series with a linear damper: compression s, k s = c (rate - s')
            damping = p[2] * x[8 + i]
            out[8 + i] = rate - damping / c
        else:
            out[8 + i] = 0.0
            knee = min(max(own, -p[3]), p[3])
            damping = c * (knee + p[4] * (own - knee))
            rebound = 2 * p[5] / (1 + p[5])
            damping *= rebound if own > 0 else 2 - rebound
        force = k * travel + damping + p[6] * np.tanh(rate / 1e-3) + p[7] * travel**3
        if travel < -p[8]:
            force += p[9] * (travel + p[8])
        pressed = tire * (x[2 + i] - z[i]) + p[10] * (x[6 + i] - zr[i])
        if p[14] > 0:
            pressed = min(pressed, load)
        out[2 + i] = x[6 + i]
        out[6 + i] = (force - pressed) / unsprung
        up -= force
        turn -= arm * force
    out[0], out[1] = x[4], x[5]
    out[4], out[5] = up / mass, turn / inertia
    out[10] = x[11]
    out[11] = (rider_k * (x[0] - x[10]) + rider_c * (x[4] - x[11])) / rider if rider > 0 else 0.0
    return out[4] + p[15] * out[5]


@njit(cache=False)
def integrated(z, p, at, step_s, start):  # type: ignore[no-untyped-def]  # pragma: no cover
    """Acceleration (n,) of the sensor for elevations (n, 2) under the tires, by Runge and Kutta's rule of order 4."""
    n = len(z)
    found = np.zeros(n)
    x = start.copy()
    one, two, three, four = np.zeros(12), np.zeros(12), np.zeros(12), np.zeros(12)
    for i in range(n - 1):
        zr = (z[i + 1] - z[i]) / step_s
        middle = 0.5 * (z[i] + z[i + 1])
        found[i] = rates(x, z[i], zr, p, at, one)
        rates(x + 0.5 * step_s * one, middle, zr, p, at, two)
        rates(x + 0.5 * step_s * two, middle, zr, p, at, three)
        rates(x + step_s * three, z[i + 1], zr, p, at, four)
        x += step_s / 6 * (one + 2 * two + 2 * three + four)
    found[n - 1] = found[n - 2]
    return found


@cache
def rav4() -> Vehicle:
    """The car of the plain file."""
    return read_vehicle(vehicle_file("rav4-2009"))


def driven(vehicle: Vehicle, name: str, said: dict[str, float], road: Road, speed_mps: float) -> tuple[Array, Array]:
    """What the sensor feels at 100 Hz behind the recorder's filter, and where the front tire is: ``LEAD_S`` before
    place 0, a lap, half of that after it."""
    front, rear = vehicle.front, vehicle.rear
    assert rear is not None and vehicle.pitch_inertia_kg_m2 is not None
    shift = said.get("shift_m", 0.0)
    ahead_m, behind_m = front.cg_distance_m - shift, rear.cg_distance_m + shift
    mass = vehicle.sprung_mass_kg + (said["mass_kg"] if name == "payload" else 0.0)
    weight = STANDARD_GRAVITY_MPS2 * (mass + (said["mass_kg"] if name == "occupant" else 0.0))
    at = np.array([
        [arm, axle.unsprung_mass_kg, axle.suspension_stiffness_n_per_m, axle.suspension_damping_n_s_per_m,
         axle.tire_stiffness_n_per_m, weight * other / (ahead_m + behind_m) + STANDARD_GRAVITY_MPS2 *
         axle.unsprung_mass_kg]
        for arm, other, axle in ((ahead_m, behind_m, front), (-behind_m, ahead_m, rear))])
    rider = said["mass_kg"] if name == "occupant" else 0.0
    omega = 2 * np.pi * said.get("frequency_hz", 0.0)
    p = np.array([
        mass, vehicle.pitch_inertia_kg_m2, said.get("mount_stiffness_n_per_m", 0.0),
        said.get("knee_velocity_m_per_s", 1e9), said.get("slope_ratio", 1.0), said.get("rebound_to_bump_ratio", 1.0),
        said.get("friction_force_n", 0.0), said.get("cubic_stiffness_n_per_m3", 0.0), said.get("clearance_m", 1e9),
        said.get("stop_stiffness_n_per_m", 0.0), said.get("tire_damping_n_s_per_m", 0.0), rider, rider * omega**2,
        2 * said.get("damping_ratio", 0.0) * omega * rider, float(name == "wheel_lift"),
        said.get("offset_m", vehicle.sensor.ahead_m - shift)])
    patch_m = said.get("contact_patch_m", vehicle.contact_patch_m)
    count = round((1.5 * LEAD_S + road.length_m / speed_mps) * FINE_HZ)
    place_m = speed_mps * (np.arange(count) / FINE_HZ - LEAD_S)
    under = np.stack([road.under(place_m - back, patch_m) for back in (0.0, ahead_m + behind_m)], axis=1)
    start = np.zeros(12)
    start[[0, 2, 3, 10]] = under[0].mean()
    felt = integrated(under, p, at, 1 / FINE_HZ, start)
    felt = sensed(felt, name, said)
    waves = np.fft.rfft(felt) * recorder_response(np.fft.rfftfreq(count, 1 / FINE_HZ))
    thin = FINE_HZ // RATE_HZ
    return np.fft.irfft(waves, count)[::thin], place_m[::thin]


def sensed(felt: Array, name: str, said: dict[str, float]) -> Array:
    """What an effect of the sensor makes of an acceleration at ``FINE_HZ``."""
    if name == "sensor_gain":
        return felt * said["gain"]
    if name == "time_offset":
        return np.roll(felt, round(said["delay_s"] * FINE_HZ))
    if name == "sensor_bandwidth":
        omega = 2 * np.pi * said["cutoff_hz"]
        return lfilter(*bilinear([omega], [1, omega], FINE_HZ), felt)
    if name == "sensor_mount_resonance":
        omega, z = 2 * np.pi * said["frequency_hz"], said["damping_ratio"]
        return lfilter(*bilinear([2 * z * omega, omega**2], [1, 2 * z * omega, omega**2], FINE_HZ), felt)
    return felt


# --- and what is made of it ------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Drive:
    """A road, readings (n,) [m/s2], where the front tire was and what distance was recorded [m]."""

    road: Road
    readings: Array
    place_m: Array
    recorded_m: Array


@cache
def roads(levels: tuple[float, ...]) -> tuple[Road, ...]:
    """An ISO road or a measured-like one of each level, by turns."""
    make = (iso_road, measured_like_road)
    return tuple(make[i % 2](level, WINDOWS * WINDOW_M, FIRST_SEED + i) for i, level in enumerate(levels))


@cache
def records(name: str, extent_index: int) -> tuple[Drive, ...]:
    """The drives of a car with an effect."""
    extent = (QUICK, FULL)[extent_index]
    found = []
    for i, road in enumerate(roads(tuple(extent.levels))):
        for j, speed_mps in enumerate(extent.speeds_mps):
            felt, place_m = driven(rav4(), name, EFFECTS.get(name, {}), road, speed_mps)
            noise = np.random.default_rng([FIRST_SEED, i, j]).standard_normal(len(felt))
            recorded_m = (place_m - place_m[0]) * EFFECTS.get(name, {}).get("scale", 1.0)
            found.append(Drive(road, felt + NOISE_MPS2 * noise, place_m, recorded_m))
    return tuple(found)


def estimates(drive: Drive, vehicle: Vehicle, effects: Sequence[Chosen] = (), errors: NumberErrors | None = None
              ) -> Windows:
    """Windows of one drive, by a file."""
    scale = next((one.values["scale"] for one in effects if one.effect.name == "speed_scale"), 1.0)
    estimator = RoadEstimator(known_vehicle(vehicle, effects), Sensor(NOISE_MPS2, 0.0), WINDOW_M,
                              off=cars_off(vehicle, effects, errors), driven_share=1 / scale)
    count = len(drive.readings)
    found = estimator.push(drive.readings, np.ones(count, dtype=np.bool_), np.zeros(count), drive.recorded_m)
    found += estimator.finish()
    numbers = np.array([one.number for one in found])
    begin_m, end_m = (np.interp((numbers + more) * WINDOW_M, drive.recorded_m, drive.place_m) for more in (0, 1))
    estimate, std = np.array([[one.iri_m_per_km, one.iri_std_m_per_km] for one in found]).T
    inside = (begin_m >= 0) & (end_m <= drive.road.length_m) & np.isfinite(estimate)
    return Windows(drive.road.iri(begin_m, end_m)[inside], estimate[inside], std[inside])


def reported(name: str) -> tuple[Chosen, ...]:
    """The effect as a file has it."""
    effect = shipped_effects()[name]
    return (chosen(effect, EFFECTS[name]),)


def wrong_files(drives: Sequence[Drive], figures: Figures) -> None:
    """The plain car by files that are off by their standard errors."""
    names = sized(rav4())
    errors = NumberErrors({name: OFF * read(rav4(), name) for name in names})
    rng = np.random.default_rng(FIRST_SEED)
    files = [changed(rav4(), {name: read(rav4(), name) * float(np.exp(OFF * rng.standard_normal())) for name in names})
             for _ in range(DRAWS)]
    for said in (None, errors):
        found = pooled([estimates(drives[i % len(drives)], one, (), said) for i, one in enumerate(files)])
        print(f"files {OFF:.0%} off, {'without' if said is None else 'with'} standard errors: R2 {found.r2:.4f}, in 1 "
              f"{found.within(1):.3f}, in 2 {found.within(2):.3f}", flush=True)
    covered("files with standard errors", found, figures)


def covered(name: str, windows: Windows, figures: Figures) -> None:
    """The goals of the standard errors."""
    figures.at_most(f"{name}: in 1 off 0.68", abs(windows.within(1) - 0.68), 0.04, "")
    figures.at_most(f"{name}: in 2 off 0.945", abs(windows.within(2) - 0.945), 0.025, "")


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--full", action="store_true", help="four speeds, five levels")
    parser.add_argument("--only", action="append", choices=EFFECTS, metavar="EFFECT", help=f"of {', '.join(EFFECTS)}")
    args = parser.parse_args()
    figures, which = Figures(), int(args.full)
    own = pooled([estimates(one, rav4()) for one in records("none", which)])
    print(f"the plain car: R2 {own.r2:.4f}, bias {own.bias:+.1%}, in 1 {own.within(1):.3f}, in 2 {own.within(2):.3f}, "
          f"{len(own.exact)} windows")
    print(f"{'':24s}{'plain file':>20s}{'true file':>20s}\n{'':24s}{'R2':>10s}{'bias':>10s}{'R2':>10s}{'bias':>10s}"
          f"{'back':>8s}{'in 1':>8s}{'in 2':>8s}")
    back, kept = {}, []
    for name in args.only or EFFECTS:
        drives = records(name, which)
        plain = pooled([estimates(one, rav4()) for one in drives])
        true = pooled([estimates(one, rav4(), reported(name)) for one in drives])
        loss = own.r2 - plain.r2
        back[name] = (true.r2 - plain.r2) / loss if loss > LEAST_LOSS else float("nan")
        kept.append(true)
        print(f"{name:24s}{plain.r2:10.4f}{plain.bias:+10.1%}{true.r2:10.4f}{true.bias:+10.1%}{back[name]:8.0%}"
              f"{true.within(1):8.3f}{true.within(2):8.3f}", flush=True)
    for name, share in back.items():
        if np.isfinite(share):
            figures.at_least(f"{name}: back", 100 * share, 80, "%")
    covered("true files", pooled(kept), figures)
    if args.only is None:
        wrong_files(records("none", which), figures)
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
