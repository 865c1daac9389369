"""Drives as a badly mounted accelerometer and a late receiver see them, with the truth beside: speeds, not roads.

Shares nothing with the program. What is modelled: phases of accelerating, driving and braking with finite jerk; hills;
curves; the body that pitches when the car brakes (a swing of 1.3 Hz, 4 degrees per g), with the sensor; vibration
that grows with speed on all axes and idling; a sensor that is turned, tilted, off its zero, noisy and rounded to steps;
a receiver that is late, whose speed has white noise, and noise that lasts some seconds, and steps, and whose fixes are
lost singly and for long, and are now and then wild.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import bilinear, lfilter

from logger.estimation.drive_alignment import DriveAlignment

Array = npt.NDArray[np.float64]

STEP_S = 0.01
GRAVITY_MPS2 = 9.80665
KNOT_MPS = 0.514444
HILL_M = 60.0  # slopes change within this, twice smoothed
BMA220_STEP_MPS2 = GRAVITY_MPS2 / 16


@dataclass(frozen=True)
class Mounting:
    """How the sensor sits: turned by ``yaw_deg`` (counterclockwise from above, of its x axis against forward), then
    tilted. ``loose_at_s``: from then on it is turned and tilted by ``loose_deg`` more [s]; None: it stays."""

    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    loose_at_s: float | None = None
    loose_deg: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Receiver:
    """delay_s      from the instant of a fix to the time that the program takes for it
    lasting_mps     r.m.s. of the part of the speed's noise that lasts (some 3 s)
    step_mps        the speed is rounded to this
    lost_share      single fixes that are missing
    wild_share      fixes whose speed is off by metres per second
    """

    delay_s: float = 0.15
    rate_hz: float = 1.0
    noise_mps: float = 0.1
    lasting_mps: float = 0.0
    step_mps: float = 0.1 * KNOT_MPS
    lost_share: float = 0.02
    wild_share: float = 0.003
    gaps_s: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class Instrument:
    """step_mps2: it rounds to this; unit: of its numbers [1 per m/s2]; noise on the 100 Hz grid."""

    step_mps2: float = BMA220_STEP_MPS2
    noise_mps2: float = 0.1
    offset_mps2: tuple[float, float, float] = (0.3, -0.2, 0.15)
    unit: float = 1.0


@dataclass(frozen=True)
class SeenDrive:
    """What arrives: times (n,) [s] and readings (n, 3); times (k,) [s] and speeds (k,) [m/s] of the fixes."""

    time_s: Array
    accel: Array
    fix_time_s: Array
    fix_speed_mps: Array
    forward: Array  # (3,) forward in the sensor's frame
    upward: Array  # (3,) up in the sensor's frame


def drive(kind: str, seconds: float, mounting: Mounting, receiver: Receiver, instrument: Instrument, seed: int,
          slope_rms: float = 0.02) -> SeenDrive:
    """``kind`` is town or highway."""
    rng = np.random.default_rng(seed)
    count = round(seconds / STEP_S)
    time_s = np.arange(count) * STEP_S
    speed = _town(count, rng) if kind == "town" else _highway(count, rng)
    accel = np.gradient(speed, STEP_S)
    lateral = speed * _yaw_rate(count, speed, rng, quick=kind == "town")
    way_m = np.cumsum(speed) * STEP_S
    metres = round(way_m[-1]) + 2
    slope = slope_rms * np.interp(way_m, np.arange(metres), _slow(metres, 2 * STEP_S * HILL_M, rng))
    pitch = _swing(np.radians(4.0) / GRAVITY_MPS2 * accel, 1.3, 0.3)
    roll = _swing(np.radians(4.0) / GRAVITY_MPS2 * lateral, 1.5, 0.3)
    shake = 0.03 + 0.02 * speed
    vibration = np.stack([_band(count, rng) * shake * share for share in (0.6, 0.6, 1.5)], axis=1)
    felt = np.stack([accel + GRAVITY_MPS2 * (slope + pitch), lateral + GRAVITY_MPS2 * roll,
                     np.full(count, GRAVITY_MPS2)], axis=1) + vibration
    frame = _frame(mounting.yaw_deg, mounting.pitch_deg, mounting.roll_deg)
    readings = felt @ frame.T
    if mounting.loose_at_s is not None:
        later = time_s >= mounting.loose_at_s
        turned = _frame(mounting.yaw_deg + mounting.loose_deg[0], mounting.pitch_deg + mounting.loose_deg[1],
                        mounting.roll_deg)
        readings[later] = felt[later] @ turned.T
    readings = readings + np.array(instrument.offset_mps2) + instrument.noise_mps2 * rng.standard_normal((count, 3))
    if instrument.step_mps2:
        readings = np.round(readings / instrument.step_mps2) * instrument.step_mps2
    fix_time_s, fix_speed = _fixes(time_s, speed, receiver, rng)
    return SeenDrive(time_s, readings * instrument.unit, fix_time_s, fix_speed, frame[:, 0], frame[:, 2])


def _fixes(time_s: Array, speed: Array, receiver: Receiver, rng: np.random.Generator) -> tuple[Array, Array]:
    instants = np.arange(0.3, time_s[-1] - 1.0, 1 / receiver.rate_hz)
    seen = np.interp(instants, time_s, speed) + receiver.noise_mps * rng.standard_normal(len(instants))
    if receiver.lasting_mps:
        kept = np.exp(-1 / (3.0 * receiver.rate_hz))
        error = np.zeros(len(instants))
        kicks = rng.standard_normal(len(instants)) * receiver.lasting_mps * np.sqrt(1 - kept**2)
        for k in range(1, len(instants)):
            error[k] = kept * error[k - 1] + kicks[k]
        seen = seen + error
    wild = rng.random(len(instants)) < receiver.wild_share
    seen = np.where(wild, seen + rng.uniform(-10, 10, len(instants)), seen)
    seen = np.abs(seen)
    if receiver.step_mps:
        seen = np.round(seen / receiver.step_mps) * receiver.step_mps
    there = rng.random(len(instants)) >= receiver.lost_share
    for begin_s, end_s in receiver.gaps_s:
        there &= (instants < begin_s) | (instants >= end_s)
    return instants[there] + receiver.delay_s, seen[there]


def _town(count: int, rng: np.random.Generator) -> Array:
    """Speeds wanted in phases, reached with the acceleration of drivers."""
    wanted: list[tuple[int, float, float]] = []
    total = 0
    while total < count:
        stop = rng.random() < 0.35
        target = 0.0 if stop else float(rng.uniform(5, 15))
        length = round((rng.uniform(3, 30) if stop else rng.uniform(8, 40)) / STEP_S)
        wanted.append((length, target, float(rng.uniform(0.8, 2.5))))
        total += length
    speed, now, accel = np.empty(total), 0.0, 0.0
    at = 0
    for length, target, hard in wanted:
        for _ in range(length):
            pull = min(max(0.8 * (target - now), -1.2 * hard), hard)
            accel += min(max(pull - accel, -2.5 * STEP_S), 2.5 * STEP_S)
            now = max(0.0, now + accel * STEP_S)
            if now == 0.0 and accel < 0:
                accel = 0.0
            speed[at] = now
            at += 1
    restless = np.cumsum(_slow(total, 2.0, rng)) * STEP_S * 0.1
    restless -= np.interp(np.arange(total), np.arange(0, total, 2000), restless[::2000])
    return np.maximum(speed + restless * np.clip((speed - 3) / 3, 0, 1), 0.0)[:count]


def _highway(count: int, rng: np.random.Generator) -> Array:
    """Even driving: the speed wanders by 1 m/s over a minute."""
    return 29.0 + 1.0 * _slow(count, 40.0, rng)


def _slow(count: int, lasting_s: float, rng: np.random.Generator) -> Array:
    """Smooth noise of r.m.s. 1: white noise through two low-passes of this time."""
    kept = 1 - STEP_S / lasting_s * 2
    values = rng.standard_normal(count + round(6 * lasting_s / STEP_S))
    values = lfilter([1.0], np.poly([kept, kept]), values)[-count:]
    return (values - values.mean()) / values.std()


def _swing(pushed: Array, f_hz: float, damping: float) -> Array:
    """The answer of a damped swing, at rest 1 times what pushes."""
    w = 2 * np.pi * f_hz
    return lfilter(*bilinear([w * w], [1.0, 2 * damping * w, w * w], 1 / STEP_S), pushed)


def _yaw_rate(count: int, speed: Array, rng: np.random.Generator, quick: bool) -> Array:
    """Turns [rad/s], with a lateral acceleration of 4 m/s2 at most."""
    rate = (0.15 if quick else 0.01) * _slow(count, 3.0, rng)
    return np.clip(rate, -4 / np.maximum(speed, 2), 4 / np.maximum(speed, 2))


def _band(count: int, rng: np.random.Generator) -> Array:
    """Vibration up to 50 Hz, r.m.s. 1, without what is slower than a second."""
    spectrum = np.fft.rfft(rng.standard_normal(count))
    f_hz = np.fft.rfftfreq(count, STEP_S)
    values = np.fft.irfft(spectrum * (f_hz > 1.0) / (1 + (f_hz / 15) ** 2), count)
    return values / values.std()


def _frame(yaw_deg: float, pitch_deg: float, roll_deg: float) -> Array:
    """Rows: the sensor's axes in the car's frame of forward, left, up."""
    yaw, pitch, roll = np.radians([yaw_deg, pitch_deg, roll_deg])
    about_z = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    about_y = np.array([[np.cos(pitch), 0, -np.sin(pitch)], [0, 1, 0], [np.sin(pitch), 0, np.cos(pitch)]])
    about_x = np.array([[1, 0, 0], [0, np.cos(roll), np.sin(roll)], [0, -np.sin(roll), np.cos(roll)]])
    return about_x @ about_y @ about_z


def fed(seen: SeenDrive, column: int = 2, sign: float = 1.0, chunk: int = 1000) -> DriveAlignment:
    """An alignment with this axis upwards that has heard all of a drive, as it comes, in pieces of so many readings."""
    alignment, fix = DriveAlignment(column, sign), 0
    for low in range(0, len(seen.time_s), chunk):
        time_s = seen.time_s[low : low + chunk]
        while fix < len(seen.fix_time_s) and seen.fix_time_s[fix] <= time_s[-1]:
            alignment.take_fix(float(seen.fix_time_s[fix]), float(seen.fix_speed_mps[fix]))
            fix += 1
        alignment.take_readings(time_s, seen.accel[low : low + chunk])
    return alignment
