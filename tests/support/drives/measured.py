"""Drives of known truth, made on a path of their own: nothing here comes from the models that they are to judge.

Problem: an estimator that is tried on what it was built with shows its best side. These roads are drawn with random
amplitudes and not only of ISO 8608; the car's equations are written out and solved (in the frequency domain for
a steady speed, mode by mode in time for any other); the readings are rounded with gravity at a random place within a
step, and clipped; the receiver is late and wanders.

Only the exact IRI is the product's own, which has tests of its own.

What is not modelled: braking and cornering in the vertical axis, rolling of the body, pitch at the sensor, nonlinear
springs and dampers, engine and console vibration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from drivers.readings import AccelerationBlock, Fix
from logger.geodesy import EARTH_RADIUS_M
from logger.roads.iri import PER_KM, rectified_slope
from logger.units import STANDARD_GRAVITY_MPS2, US_PER_S
from logger.vehicle.vehicle import Axle, Vehicle

Array = npt.NDArray[np.float64]
Complex = npt.NDArray[np.complex128]

SPACING_M = 0.05
GRID_HZ = 100
FINE_HZ = 2000
FLAT_HZ, SHUT_HZ = 38.0, 50.0
_RUN_IN_M = 150.0
_START_LAT_DEG, _LON_DEG = 50.0, 14.4


@dataclass(frozen=True, eq=False)
class Road:
    """A road that repeats after its length; place 0 is its first sample.

    level_m_per_km     IRI it was made for
    elevation_m        (n,) at SPACING_M
    spectrum_m3        (n // 2 + 1,) expected one-sided displacement spectrum where ``gain`` is 1, at ``wave_number``
    gain               (n,) how much steeper than that the road is expected to be at each place
    """

    kind: str
    level_m_per_km: float
    elevation_m: Array
    spectrum_m3: Array
    gain: Array

    @property
    def length_m(self) -> float:
        """Length of one lap [m]."""
        return len(self.elevation_m) * SPACING_M

    @property
    def wave_number_cpm(self) -> Array:
        """(n // 2 + 1,) [cycle/m]."""
        return np.asarray(np.fft.rfftfreq(len(self.elevation_m), SPACING_M), dtype=np.float64)

    @cached_property
    def _slope_up_to(self) -> Array:
        """Sum of the rectified slope of steps before sample i, (n + 1,)."""
        lead = round(_RUN_IN_M / SPACING_M)
        count = len(self.elevation_m)
        around = np.take(self.elevation_m, np.arange(-lead, count + lead), mode="wrap")
        slope = rectified_slope(around, SPACING_M)[lead : lead + count]
        return np.concatenate([[0.0], np.cumsum(slope)])

    def iri(self, begin_m: npt.ArrayLike, end_m: npt.ArrayLike) -> Array:
        """Exact IRI [m/km] between places, on any lap; a window's length is below that of the road."""
        begin, end = np.asarray(begin_m, dtype=float), np.asarray(end_m, dtype=float)

        def up_to(place: Array) -> Array:
            laps, rest = np.divmod(place / SPACING_M, len(self.elevation_m))
            sums = self._slope_up_to
            return laps * sums[-1] + np.interp(rest, np.arange(len(sums)), sums)

        return PER_KM * SPACING_M * (up_to(end) - up_to(begin)) / (end - begin)

    def under(self, place_m: Array, patch_m: float) -> Array:
        """Elevation averaged over a contact patch [m] around places on any lap: exact for straight lines between."""
        heights = np.append(self.elevation_m, self.elevation_m[0])
        area = np.concatenate([[0.0], np.cumsum(0.5 * (heights[1:] + heights[:-1]))])
        bend = np.diff(heights)

        def up_to(place: Array) -> Array:
            laps, rest = np.divmod(place / SPACING_M, len(self.elevation_m))
            cell = np.minimum(rest.astype(np.intp), len(self.elevation_m) - 1)
            part = rest - cell
            return laps * area[-1] + area[cell] + part * (heights[cell] + 0.5 * part * bend[cell])

        return (up_to(place_m + 0.5 * patch_m) - up_to(place_m - 0.5 * patch_m)) * SPACING_M / patch_m


def iso_road(level_m_per_km: float, length_m: float, seed: int, waviness: float = 2.0) -> Road:
    """A road of one spectrum over 0.011 to 2.83 cycles per metre with random amplitudes, scaled to the level."""
    wave_number = np.fft.rfftfreq(round(length_m / SPACING_M), SPACING_M)
    inside = (wave_number >= 0.011) & (wave_number <= 2.83)
    shape = np.where(inside, np.maximum(wave_number, 0.011) ** -waviness, 0.0)
    return _scaled(Road("iso", level_m_per_km, *_drawn(shape, np.random.default_rng(seed))))


def measured_like_road(level_m_per_km: float, length_m: float, seed: int) -> Road:
    """A road as profilers find them: two slopes in its spectrum, roughness that changes along it, slabs on every third
    road, patches, and a pothole or a bump every 300 m."""
    rng = np.random.default_rng(seed)
    count = round(length_m / SPACING_M)
    wave_number = np.fft.rfftfreq(count, SPACING_M)
    corner = rng.uniform(0.08, 0.3)
    relative = np.maximum(wave_number, 0.004) / corner
    shape = np.where(relative < 1, relative ** -rng.uniform(1.8, 3.0), relative ** -rng.uniform(1.5, 2.5))
    shape = np.where((wave_number >= 0.004) & (wave_number <= 4.0), shape, 0.0)
    elevation, shape, _ = _drawn(shape, rng)
    gain = _swell(count, rng)
    slope = np.diff(elevation, append=elevation[0]) * gain
    elevation = np.concatenate([[0.0], np.cumsum(slope - slope.mean())[:-1]])
    base = _scaled(Road("measured", level_m_per_km, elevation, shape, gain))
    events = np.sqrt(level_m_per_km / 4.0) * _events(length_m, slabs=seed % 3 == 0, rng=rng)
    return replace(base, elevation_m=base.elevation_m + events, gain=_with_events(base, events))


def _drawn(shape: Array, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Elevations of a Gaussian road with this one-sided spectrum, the spectrum, and a gain of 1."""
    count = 2 * (len(shape) - 1)
    step_cpm = 1.0 / (count * SPACING_M)
    waves = rng.standard_normal(len(shape)) + 1j * rng.standard_normal(len(shape))
    return np.fft.irfft(0.5 * count * np.sqrt(shape * step_cpm) * waves, count), shape, np.ones(count)


def _scaled(road: Road) -> Road:
    """The road made as rough as its level."""
    factor = road.level_m_per_km / float(road.iri(0.0, road.length_m))
    return replace(road, elevation_m=road.elevation_m * factor, spectrum_m3=road.spectrum_m3 * factor**2)


def _swell(count: int, rng: np.random.Generator) -> Array:
    """Roughness along a road: a factor of 1.4 up or down, over some 60 m, and now and then an abrupt change."""
    wave_number = np.fft.rfftfreq(count, SPACING_M)
    waves = np.exp(-0.5 * (wave_number * 60.0) ** 2) * (
        rng.standard_normal(len(wave_number)) + 1j * rng.standard_normal(len(wave_number))
    )
    waves[0] = 0.0
    slow = np.fft.irfft(waves, count)
    places = np.sort(rng.uniform(0.0, count, 2 * max(1, round(count * SPACING_M / 800.0))))
    abrupt = np.searchsorted(places, np.arange(count)) % 2
    return np.exp(0.35 * slow / slow.std() + 0.5 * abrupt)


def _events(length_m: float, slabs: bool, rng: np.random.Generator) -> Array:
    """Patches, potholes, bumps and the joints of slabs [m], as on a road of IRI 4."""
    place = SPACING_M * np.arange(round(length_m / SPACING_M))
    total = np.zeros(len(place))

    def plateau(begin_m: float, long_m: float, ramp_m: float, height_m: float) -> Array:
        return height_m * np.clip(np.minimum(place - begin_m, begin_m + long_m - place) / ramp_m, 0.0, 1.0)

    for _ in range(round(length_m / 150.0)):
        total += plateau(rng.uniform(5, length_m - 20), rng.uniform(1.5, 10), 0.15, rng.uniform(-0.010, 0.012))
    for number in range(round(length_m / 300.0)):
        at_m = rng.uniform(5, length_m - 20)
        if number % 2:
            width_m = rng.uniform(1.0, 3.0)
            along = np.clip((place - at_m) / width_m, 0.0, 1.0)
            total += 0.5 * rng.uniform(0.02, 0.05) * (1 - np.cos(2 * np.pi * along))
        else:
            total += plateau(at_m, rng.uniform(0.4, 1.0), 0.1, -rng.uniform(0.015, 0.04))
    if slabs:
        slab_m = length_m / round(length_m / rng.uniform(4.5, 6.5))
        along = place % slab_m
        fault_m = np.repeat(rng.normal(0.0015, 0.001, round(length_m / slab_m) + 1), round(slab_m / SPACING_M) + 1)
        fault_m = fault_m[: len(place)]
        total += fault_m * (1 - np.clip(along / 0.1, 0, 1) - (1 - along / slab_m))
    return total


def _with_events(road: Road, events: Array) -> Array:
    """The gain, raised where single obstacles make the road steeper, over a metre to each side."""
    steep = np.diff(events, append=events[0]) ** 2
    plain = np.mean((np.diff(road.elevation_m, append=road.elevation_m[0]) / road.gain) ** 2)
    reach = round(1.0 / SPACING_M)
    near = np.convolve(np.take(steep, np.arange(-reach, len(steep) + reach), mode="wrap"),
                       np.ones(2 * reach + 1) / (2 * reach + 1), mode="valid")
    return np.sqrt(road.gain**2 + near / plain)


# --- the car ---------------------------------------------------------------------------------------------------------


def wheel_responses(vehicle: Vehicle, f_hz: Array) -> Complex:
    """Acceleration of the centre of gravity per elevation under front and rear tire, (2, n) [1/s2].

    Each corner pulls the body with Z ((kt - w2 mu) e - kt r) / (kt + Z - w2 mu), Z = k + i w c, e the height of the
    body over it and r the road; two equations for bounce and pitch are left.
    """
    w = 2 * np.pi * np.asarray(f_hz, dtype=float)
    front, rear = _axles(vehicle)
    held, driven = [], []
    for axle in (front, rear):
        strut = axle.suspension_stiffness_n_per_m + 1j * w * axle.suspension_damping_n_s_per_m
        tire = axle.tire_stiffness_n_per_m - w**2 * axle.unsprung_mass_kg
        held.append(strut * tire / (tire + strut))
        driven.append(strut * axle.tire_stiffness_n_per_m / (tire + strut))
    a, b = front.cg_distance_m, rear.cg_distance_m
    bounce = held[0] + held[1] - w**2 * vehicle.sprung_mass_kg
    both = a * held[0] - b * held[1]
    pitch = a * a * held[0] + b * b * held[1] - w**2 * _inertia(vehicle)
    det = bounce * pitch - both**2
    return np.stack([-(w**2) * driven[0] * (pitch - a * both) / det, -(w**2) * driven[1] * (pitch + b * both) / det])


def road_response(vehicle: Vehicle, wave_number_cpm: Array, speed_mps: float) -> Complex:
    """Acceleration per elevation of the road under the front tire at a steady speed, contact patch and all [1/s2]."""
    front, rear = wheel_responses(vehicle, wave_number_cpm * speed_mps)
    later = np.exp(-2j * np.pi * wave_number_cpm * _wheelbase_m(vehicle))
    return (front + rear * later) * np.sinc(wave_number_cpm * vehicle.contact_patch_m)


def recorder_response(f_hz: npt.ArrayLike) -> Array:
    """The recorder's filter: 1 up to 38 Hz, half a cosine down to nothing at 50 Hz."""
    part = np.clip((np.asarray(f_hz) - FLAT_HZ) / (SHUT_HZ - FLAT_HZ), 0.0, 1.0)
    return 0.5 * (1 + np.cos(np.pi * part))


def _axles(vehicle: Vehicle) -> tuple[Axle, Axle]:
    if vehicle.rear is None:
        raise ValueError("expected a half car")
    return vehicle.front, vehicle.rear


def _inertia(vehicle: Vehicle) -> float:
    if vehicle.pitch_inertia_kg_m2 is None:
        raise ValueError("expected a half car")
    return vehicle.pitch_inertia_kg_m2


def _wheelbase_m(vehicle: Vehicle) -> float:
    front, rear = _axles(vehicle)
    return front.cg_distance_m + rear.cg_distance_m


def _equations(vehicle: Vehicle) -> tuple[Array, Array, Array, Array]:
    """x' = A x + B r, acceleration = C x + D r, x = bounce, pitch, front and rear wheel, then their rates."""
    front, rear = _axles(vehicle)
    a, b = np.zeros((8, 8)), np.zeros((8, 2))
    a[:4, 4:] = np.eye(4)
    arms = (front.cg_distance_m, -rear.cg_distance_m)
    for wheel, (axle, arm) in enumerate(zip((front, rear), arms, strict=True)):
        pull = np.zeros(8)  # force of the strut on the body, downwards
        for rate, factor in ((0, axle.suspension_stiffness_n_per_m), (4, axle.suspension_damping_n_s_per_m)):
            pull[[rate, rate + 1, rate + 2 + wheel]] = factor, factor * arm, -factor
        a[4] -= pull / vehicle.sprung_mass_kg
        a[5] -= pull * arm / _inertia(vehicle)
        a[6 + wheel] += pull / axle.unsprung_mass_kg
        a[6 + wheel, 2 + wheel] -= axle.tire_stiffness_n_per_m / axle.unsprung_mass_kg
        b[6 + wheel, wheel] = axle.tire_stiffness_n_per_m / axle.unsprung_mass_kg
    return a, b, a[4], b[4]


# --- drives ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Drive:
    """What the sensor's place did, before any sensor, at ``rate_hz``: arrays (n,).

    place_m    of the front tire on the road; it only grows, lap after lap
    """

    road: Road
    rate_hz: int
    accel_mps2: Array
    place_m: Array
    speed_mps: Array


def steady_drive(vehicle: Vehicle, road: Road, speed_mps: float, lead_s: float, rate_hz: int = GRID_HZ) -> Drive:
    """``lead_s`` before the lap and half as long after it, in the steady state.

    The speed is rounded so that a lap takes a whole number of samples of the 100 Hz grid (by less than one in a
    thousand): then the response at the sampling instants is one Fourier sum. ``rate_hz`` is a multiple of 100 Hz.
    """
    count = round(road.length_m / speed_mps * GRID_HZ) * (rate_hz // GRID_HZ)
    speed = road.length_m * rate_hz / count
    wave_number = road.wave_number_cpm
    response = road_response(vehicle, wave_number, speed) * recorder_response(wave_number * speed)
    waves = np.fft.rfft(road.elevation_m) * response
    kept = np.zeros(count // 2 + 1, dtype=complex)
    both = min(len(kept), len(waves))
    kept[:both] = waves[:both]
    lap = np.fft.irfft(kept, count) * count / len(road.elevation_m)
    index = np.arange(-round(lead_s * rate_hz), count + round(0.5 * lead_s * rate_hz))
    return Drive(road, rate_hz, np.take(lap, index, mode="wrap"), index * speed / rate_hz, np.full(len(index), speed))


def varied_drive(vehicle: Vehicle, road: Road, speed_knots: list[tuple[float, float]], rate_hz: int = GRID_HZ) -> Drive:
    """A drive by (time [s], speed [m/s]) knots with straight lines between, corners rounded over a second; it starts at
    place 0. Solved mode by mode, the road a straight line within steps of 0.5 ms."""
    knots = np.array(speed_knots, dtype=float)
    half = FINE_HZ // 2
    time_s = np.arange(-half, round(knots[-1, 0] * FINE_HZ) + half) / FINE_HZ
    rough = np.concatenate([[0.0], np.cumsum(np.interp(time_s, knots[:, 0], knots[:, 1]))])
    speed = (rough[2 * half:] - rough[: -2 * half]) / (2 * half)
    place = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))]) / FINE_HZ
    under = np.stack([road.under(place - behind, vehicle.contact_patch_m) for behind in (0.0, _wheelbase_m(vehicle))])
    fine = _stepped(vehicle, under)
    waves = np.fft.rfft(np.concatenate([fine, np.linspace(fine[-1], fine[0], FINE_HZ)]))
    waves *= recorder_response(np.fft.rfftfreq(len(fine) + FINE_HZ, 1 / FINE_HZ))
    thin = FINE_HZ // rate_hz
    smooth = np.fft.irfft(waves, len(fine) + FINE_HZ)[: len(fine): thin]
    return Drive(road, rate_hz, smooth, place[::thin], speed[::thin])


def _stepped(vehicle: Vehicle, under: Array) -> Array:
    """Acceleration (n,) of the body for elevations (2, n) under the tires at FINE_HZ, from rest."""
    from scipy.signal import lfilter

    a, b, c, d = _equations(vehicle)
    poles, modes = np.linalg.eig(a)
    under = under - under[:, :1].mean()
    force = np.linalg.solve(modes, b.astype(complex)) @ under
    seen = c @ modes
    rest = np.linalg.solve(modes, -np.linalg.solve(a, b @ under[:, 0]).astype(complex))
    total = d @ under
    for pole, one, weight, start in zip(poles, force, seen, rest, strict=True):
        if pole.imag < 0:
            continue
        z = pole / FINE_HZ
        whole = np.exp(z)
        at_end = (whole - 1 - z) / z**2 / FINE_HZ
        at_start = (whole - 1) / z / FINE_HZ - at_end
        drive = at_start * one[:-1] + at_end * one[1:]
        state = np.concatenate([[start], lfilter([1.0], [1.0, -whole], drive, zi=np.array([whole * start]))[0]])
        total = total + (2.0 if pole.imag > 0 else 1.0) * (weight * state).real
    return total


# --- instruments -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Accelerometer:
    """noise of one reading [m/s2], steps [m/s2], readings per sample of the 100 Hz grid, counts at the ends."""

    name: str
    noise_mps2: float
    step_mps2: float
    oversample: int = 1
    counts: tuple[int, int] = (-(10**6), 10**6)

    def read(self, accel_mps2: Array, rng: np.random.Generator) -> tuple[Array, npt.NDArray[np.bool_]]:
        """Readings and which of them stand at an end of the range; gravity lies anywhere within a step."""
        level = STANDARD_GRAVITY_MPS2 + self.step_mps2 * rng.uniform(-0.5, 0.5)
        felt = accel_mps2 + level + self.noise_mps2 * rng.standard_normal(len(accel_mps2))
        counts = np.rint(felt / self.step_mps2)
        clipped = (counts <= self.counts[0]) | (counts >= self.counts[1])
        return self.step_mps2 * np.clip(counts, *self.counts), clipped


def thinned(readings: Array, oversample: int) -> Array:
    """Readings of a fast sensor on the 100 Hz grid, through the recorder's filter."""
    if oversample == 1:
        return readings
    count = len(readings) // oversample * oversample
    waves = np.fft.rfft(readings[:count] - readings[0])
    waves *= recorder_response(np.fft.rfftfreq(count, 1 / (GRID_HZ * oversample)))
    return np.asarray(np.fft.irfft(waves, count)[::oversample] + readings[0])


@dataclass(frozen=True)
class Receiver:
    """A GPS receiver at 1 Hz over the front axle of a car on a straight road to the north.

    slow_error_m, memory_s     Gauss-Markov error of the position on each axis
    """

    latency_s: float = 0.15
    latency_jitter_s: float = 0.01
    speed_noise_mps: float = 0.05
    slow_error_m: float = 0.8
    memory_s: float = 40.0

    def fixes(self, drive: Drive, start_us: int, rng: np.random.Generator) -> list[Fix]:
        """One fix a second, the first 0.37 s after ``start_us``, the time of the drive's first sample."""
        time_s = np.arange(0.37, (len(drive.place_m) - 1) / drive.rate_hz, 1.0)
        index = time_s * drive.rate_hz
        at = np.arange(len(drive.place_m))
        kept = np.exp(-1.0 / self.memory_s)
        kicks = self.slow_error_m * np.sqrt(1 - kept**2) * rng.standard_normal((len(time_s), 2))
        error = np.empty_like(kicks)
        error[0] = self.slow_error_m * rng.standard_normal(2)
        for number in range(1, len(error)):
            error[number] = kept * error[number - 1] + kicks[number]
        north_m = np.interp(index, at, drive.place_m) + error[:, 0]
        speed = np.abs(np.interp(index, at, drive.speed_mps) + self.speed_noise_mps * rng.standard_normal(len(index)))
        arrival_s = time_s + self.latency_s + self.latency_jitter_s * np.abs(rng.standard_normal(len(time_s)))
        begin_utc_us = 1_780_000_000 * US_PER_S
        degree_m = np.radians(EARTH_RADIUS_M)
        east_degree_m = degree_m * np.cos(np.radians(_START_LAT_DEG))
        return [
            Fix(
                t_us=start_us + round(arrival_s[i] * US_PER_S), valid=True,
                utc_us=begin_utc_us + round(time_s[i] * US_PER_S),
                time_of_day_us=(begin_utc_us + round(time_s[i] * US_PER_S)) % (86_400 * US_PER_S),
                lat_deg=_START_LAT_DEG + float(north_m[i] / degree_m),
                lon_deg=_LON_DEG + float(error[i, 1] / east_degree_m),
                speed_mps=float(speed[i]), course_deg=0.0, altitude_m=200.0, satellites=11, hdop=0.8,
            )
            for i in range(len(time_s))
        ]


def place_of(lat_deg: float) -> float:
    """Place on the road [m] of a latitude that a record tells."""
    return float(np.radians(lat_deg - _START_LAT_DEG) * EARTH_RADIUS_M)


def block_of(t_us: npt.NDArray[np.int64], readings: Array, clipped: npt.NDArray[np.bool_]) -> AccelerationBlock:
    """Readings of a sensor that lies level, Z up."""
    level = np.zeros_like(readings)
    return AccelerationBlock(t_us, np.stack([level, level, readings], axis=1), clipped)
