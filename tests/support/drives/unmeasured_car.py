"""Ordinary drives of a car over roads that nobody measured, by equations of their own.

What the sensor of a linear car reads is the inverse transform of its responses times what lies under its axles at each
instant, whatever its speed does; nothing of the program's models is used. The forces of dampers that work harder in
rebound, and of friction, are further inputs of the same car: they follow from the rates of its suspensions, which
follow from them. With the middle slope of such a force counted as a damper's, what remains of it has a slope of less
than that of all dampers together, and as no passive suspension moves faster under a force than its dampers alone let
it, putting the one into the other again and again ends at the motion (a contraction).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

Array = np.ndarray

RATE_HZ, FINE = 100, 4
SPACING_M = 0.0125  # means over a tire between points: at 0.05 m a patch of 0.22 m acts as one of 0.24 m
PAD = 4000
SLIDES_MPS = 0.01  # rate at which friction is three quarters of all: a bushing holds below it
MPH = 0.44704


@dataclass(frozen=True)
class UnmeasuredCar:
    """A half car by its ratios; ``ahead_m``: the sensor before the centre of gravity. Frequencies are those of each end
    alone, without tire (bounce) and on springs and tire (hop). Damping is the mean of both directions; ``rebound``:
    that in rebound over that in compression; ``friction_n``: of each suspension."""

    wheelbase_m: float = 2.66
    rear_share: float = 0.43
    front: tuple[float, float, float, float] = (1.25, 0.28, 11.6, 0.12)
    rear: tuple[float, float, float, float] = (1.42, 0.26, 11.1, 0.14)
    dynamic_index: float = 0.95
    patch_m: float = 0.22
    ahead_m: float = 0.0
    mass_kg: float = 640.0
    rebound: float = 1.0
    friction_n: float = 0.0

    def dampers(self) -> Array:
        """Of front and rear (2,) [N s/m]."""
        return np.array([4 * np.pi * damping * bounce * carried * self.mass_kg for carried, (bounce, damping, *_) in (
            (1 - self.rear_share, self.front), (self.rear_share, self.rear))])

    def further_force(self, rates_mps: Array) -> Array:
        """Of each suspension (2, t) [N] at its rates, beside those of springs and dampers."""
        uneven = (self.rebound - 1) / (self.rebound + 1) * self.dampers()[:, None] * np.abs(rates_mps)
        return np.asarray(uneven + self.friction_n * np.tanh(rates_mps / SLIDES_MPS))

    def response(self, f_hz: Array) -> Array:
        """Acceleration of the sensor per elevation under each axle (f, 2) [1/s2]."""
        return self.responses(f_hz, 0.0)[0][:, :2]

    def responses(self, f_hz: Array, more: float) -> tuple[Array, Array]:
        """Acceleration of the sensor (f, 4) and rates of both suspensions (f, 2, 4) per elevation under each axle and
        force of each suspension, with dampers that are stiffer by ``more`` [N s/m]."""
        a, b = self.wheelbase_m * self.rear_share, self.wheelbase_m * (1 - self.rear_share)
        springs, tires, wheels = [], [], []
        for carried, (bounce, _, hop, ratio) in ((1 - self.rear_share, self.front), (self.rear_share, self.rear)):
            mass = carried * self.mass_kg
            springs.append(mass * (2 * np.pi * bounce) ** 2)
            wheels.append(ratio * mass)
            tires.append(ratio * mass * (2 * np.pi * hop) ** 2 - springs[-1])
        inertia = self.dynamic_index * self.mass_kg * a * b
        mass_matrix = np.diag([self.mass_kg, inertia, *wheels])
        rows = np.array([[1, a, -1, 0], [1, -b, 0, -1]])
        stiffness = sum(k * np.outer(row, row) for k, row in zip(springs, rows, strict=True))
        damping_matrix = sum(c * np.outer(row, row) for c, row in zip(self.dampers() + more, rows, strict=True))
        stiffness = stiffness + np.diag([0, 0, *tires])
        s = 2j * np.pi * np.maximum(f_hz, 1e-9)[:, None, None]
        given = np.zeros((4, 4), complex)
        given[2, 0], given[3, 1] = tires
        given[:, 2:] = -rows.T
        moved = np.linalg.solve(s * s * mass_matrix + s * damping_matrix + stiffness, np.broadcast_to(
            given, (len(f_hz), 4, 4)))
        return np.asarray(s[:, :, 0] ** 2 * (moved[:, 0] + self.ahead_m * moved[:, 1])), s * (rows @ moved)

    def felt(self, heights_m: Array, rate_hz: float, passed: Array) -> Array:
        """Acceleration of the sensor (t,) over elevations (2, t) under the axles that go on from their end to their
        beginning; ``passed``: the recorder's gain at their frequencies."""
        count = heights_m.shape[1]
        f_hz = np.fft.rfftfreq(count, 1 / rate_hz)
        stiffest = self.friction_n / SLIDES_MPS / 2
        sensor, rates = self.responses(f_hz, stiffest)
        given = np.concatenate([np.fft.rfft(heights_m), np.zeros((2, len(f_hz)))])
        while self.friction_n or self.rebound != 1:
            rate = np.fft.irfft(np.einsum("fij,jf->if", rates, given), count)
            force = np.fft.rfft(self.further_force(rate) - stiffest * rate)
            moved, given[2:] = np.abs(force - given[2:]).max(), force
            if moved < 1e-3 * np.abs(force).max():
                break
        return np.fft.irfft((sensor * given.T).sum(axis=1) * passed, count)


def changing_road(rng: np.random.Generator, length_m: float, iri: float, waviness: float, holes_per_km: float) -> Array:
    """Elevations every ``SPACING_M``: ISO 8608 of a level that steps by 2 to 16 after 20 to 500 m, with potholes."""
    count = 2 * (int(length_m / SPACING_M) // 2)
    n = np.fft.rfftfreq(count, SPACING_M)
    level = (iri / 0.5386) ** 2 * 1e-6
    psd = np.where((n > 0.008) & (n < 6), level * (np.maximum(n, 1e-3) / 0.1) ** -waviness, 0.0)
    waves = np.sqrt(psd * count / SPACING_M) / 2 * (rng.standard_normal((2, len(n))).T @ (1, 1j))
    steps, at_m, now = np.zeros(count), 0.0, 0.0
    while at_m < length_m:
        until_m = at_m + np.exp(rng.uniform(np.log(20), np.log(500)))
        steps[int(at_m / SPACING_M):int(until_m / SPACING_M)] = now
        change = rng.uniform(np.log(2), np.log(16))
        now += -change if now > 0.5 else change if now < -0.5 else rng.choice((-1, 1)) * change
        at_m = until_m
    elevation = np.fft.irfft(waves, count)
    slope = np.diff(elevation, append=elevation[0]) * np.exp(0.5 * steps)
    elevation = np.concatenate([[0.0], np.cumsum(slope - slope.mean())[:-1]])
    for _ in range(int(length_m / 1000 * holes_per_km)):
        begin, width = rng.integers(100, count - 100), int(rng.uniform(0.3, 1.2) / SPACING_M)
        elevation[begin:begin + width] -= rng.uniform(0.01, 0.04) * np.hanning(width + 2)[1:-1]
    return elevation


def speeds_of(rng: np.random.Generator, seconds: float, mps: float) -> Array:
    """Fine speeds about one speed; 0: of a town, with stops."""
    time_s = np.arange(int(seconds * RATE_HZ * FINE)) / (RATE_HZ * FINE)
    if mps:
        knots = np.arange(0.0, seconds + 20, 8.0)
        walk = 0.3 * np.cumsum(rng.standard_normal(len(knots))) + 0.5 * rng.standard_normal(len(knots))
        values = list(np.clip(mps * (1 + 0.04 * walk), 0.75 * mps, 1.25 * mps))
    else:
        knots_s, values, at = [], [], 0.0
        while at < seconds + 30:
            knots_s.append(at)
            values.append(rng.uniform(3, 15))
            at += rng.uniform(6, 20)
            if rng.random() < 0.3:
                knots_s += [at, at + rng.uniform(5, 20)]
                values += [0.0, 0.0]
                at = knots_s[-1] + 5
        knots = np.array(knots_s)
    smooth = np.hanning(201) / np.hanning(201).sum()
    return np.convolve(np.pad(np.interp(time_s, knots, values), 100, mode="edge"), smooth, "valid")


@dataclass(frozen=True)
class Recorder:
    """What a sensor adds: r.m.s. noise and steps [m/s2], and a receiver's error of 1 Hz speeds [m/s]."""

    noise_mps2: float = 0.147
    step_mps2: float = 0.153
    speed_mps: float = 0.1


FINE_SENSOR, BMA220 = Recorder(0.05, 0.0613), Recorder()


def driven(car: UnmeasuredCar, rng: np.random.Generator, seconds: float, mps: float, waviness: float, iri: float,
           recorder: Recorder = BMA220, holes_per_km: float = 2.5) -> tuple[Array, Array]:
    """Accelerations and speeds of a drive, at ``RATE_HZ``."""
    speed = speeds_of(rng, seconds, mps)
    place_m = 20 + np.cumsum(speed) / (RATE_HZ * FINE)
    road = changing_road(rng, place_m[-1] + 60, iri, waviness, holes_per_km)
    sums = np.concatenate([[0.0], np.cumsum((road[1:] + road[:-1]) / 2)]) * SPACING_M
    at_m = np.arange(len(road)) * SPACING_M

    def under(place: Array) -> Array:
        ends = [np.interp(place + side * car.patch_m / 2, at_m, sums) for side in (1, -1)]
        return np.asarray((ends[0] - ends[1]) / car.patch_m)

    count = len(place_m)
    heights = np.array([under(place_m - behind_m) for behind_m in (0.0, car.wheelbase_m)])
    ended = np.concatenate([heights, np.linspace(heights[:, -1], heights[:, 0], PAD, axis=1)], axis=1)
    fade = np.clip((np.fft.rfftfreq(count + PAD, 1 / FINE) - 0.38) / 0.12, 0, 1)
    accel = car.felt(ended, RATE_HZ * FINE, np.cos(fade * np.pi / 2) ** 2)[:count:FINE]
    accel = accel + recorder.noise_mps2 * rng.standard_normal(len(accel))
    if recorder.step_mps2:
        accel = np.round((accel + rng.uniform(0, recorder.step_mps2)) / recorder.step_mps2) * recorder.step_mps2
    taken = speed[::FINE]
    fixes = np.arange(0, len(taken), RATE_HZ)
    said = np.interp(np.arange(len(taken)), fixes, np.maximum(
        taken[fixes] + recorder.speed_mps * rng.standard_normal(len(fixes)), 0.0))
    return accel[200:-50] - accel[200:-50].mean(), said[200:-50]


def mixed(car: UnmeasuredCar, seed: int, seconds: float = 300.0, recorder: Recorder = BMA220,
          speeds_mps: Sequence[float] = (20 * MPH, 35 * MPH, 60 * MPH, 0.0), holes_per_km: float = 2.5
          ) -> list[tuple[Array, Array]]:
    """Drives at several speeds, each over a road of its own."""
    rng = np.random.default_rng(seed)
    return [driven(car, rng, seconds, mps, rng.uniform(1.7, 2.5), rng.choice([1.5, 2.5, 4.0]), recorder, holes_per_km)
            for mps in speeds_mps]


def some_car(seed: int) -> UnmeasuredCar:
    """One of the cars that there are: small ones to vans, soft to stiff, front and rear unlike."""
    rng = np.random.default_rng(1000 + seed)
    bounce, damping, hop, ratio = (rng.uniform(*ends) for ends in ((1.0, 1.6), (0.17, 0.42), (10, 13.5), (0.09, 0.17)))
    rear = (bounce * rng.uniform(1.0, 1.2), min(0.45, damping * rng.uniform(0.75, 1.3)), hop * rng.uniform(0.92, 1.08),
            ratio * rng.uniform(0.8, 1.35))
    return UnmeasuredCar(rng.uniform(2.4, 3.1), rng.uniform(0.38, 0.5), (bounce, damping, hop, ratio), rear,
                         rng.uniform(0.85, 1.05), rng.uniform(0.2, 0.25))


def written(folder: Path, drives: Sequence[tuple[Array, Array]], recorder: Recorder = BMA220) -> list[Path]:
    """The drives as folders of runs, without distance."""
    found = []
    for number, (accel, speed) in enumerate(drives):
        run = folder / f"drive{number}"
        run.mkdir(parents=True)
        table = np.column_stack([np.arange(len(accel)) / RATE_HZ, accel, speed])
        np.savetxt(run / "drive.csv", table, "%.5f", ",", header="t_s,accel_z_mps2,speed_mps", comments="")
        (run / "run.yaml").write_text(
            f"sensor: {{step_mps2: {recorder.step_mps2}, noise_mps2: {recorder.noise_mps2}}}\n")
        found.append(run)
    return found
