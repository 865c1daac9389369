"""The five-storey model building of section 5.3 of Blum 2015, and the comparison of two sensors on it.

Floors of aluminium on two sheets of polycarbonate: five masses in a row (Tables 5.3, 5.4). The source's stiffness lies
half way between 12 EI / h^3, both ends of a storey clamped, and 3 EI / h^3, one end free (its labels are swapped). The
records were never published; what stands here is simulated under the conditions that the text gives.

Where we depart from the source:
- Table 5.4 gives 2.500 Hz for the second mode. No stiffness of these matrices does: whatever k, the ratio of the second
  to the first is 3.488, and with the printed 0.7453 Hz, which the third (4.534 Hz) fits, the second is 2.600 Hz.
- Table 5.2 has 0.074 Hz for the first measured mode; Table 5.4 has 0.7419 Hz, which is right.
- Eq 5.3 takes the peaks in g, the table above it names m/s2 and has 0.8545 for 0.0855. A sensor with steps of 0.01 g
  could not have shown peaks of 0.085 m/s2, so g is taken, and the r.m.s. of Table 5.1 to be in g too.

What sensors on a structure M u'' + C u' + K u = f record after a push and a release, or under random forces: both are
exact at the sampling instants: the free motion through the matrix exponential, the random one with forces that are
constant over each of several steps within a sample.
"""

from dataclasses import dataclass

import numpy as np

from logger.arrays import Array, Complex
from logger.modal.decay import Decrement, log_decrement
from logger.units import STANDARD_GRAVITY_MPS2
from logger.vehicle.structure import driven_outputs, matrix_exponential, recursion, straight_step


@dataclass(frozen=True)
class Masses:
    """A structure of n degrees of freedom: mass, damping, stiffness, each (n, n) [kg, N s/m, N/m]."""

    mass: Array
    damping: Array
    stiffness: Array

    def equations(self) -> tuple[Array, Array, Array, Array]:
        """A, B, C, D of the states (u, u'), the forces on each degree of freedom and the accelerations."""
        n = len(self.mass)
        below = np.linalg.solve(self.mass, np.hstack([-self.stiffness, -self.damping]))
        force = np.linalg.inv(self.mass)
        transition, drive = np.zeros((2 * n, 2 * n)), np.zeros((2 * n, n))
        transition[:n, n:], transition[n:], drive[n:] = np.eye(n), below, force
        return transition, drive, np.asarray(below, dtype=np.float64), np.asarray(force, dtype=np.float64)

    def poles(self) -> tuple[Complex, Complex]:
        """Vibrating poles s (m,) [rad/s], slowest first, and their shapes (n, m)."""
        roots, vectors = np.linalg.eig(self.equations()[0])
        keep = np.flatnonzero(roots.imag > 0)
        keep = keep[np.argsort(np.abs(roots[keep]))]
        return roots[keep].astype(np.complex128), vectors[:len(self.mass), keep].astype(np.complex128)


def with_damping_ratios(mass: Array, stiffness: Array, ratios: Array) -> Masses:
    """A structure whose undamped modes get the given damping ratios (n,), slowest first, and keep their shapes."""
    inverse = np.linalg.inv(np.linalg.cholesky(mass))
    squares, vectors = np.linalg.eigh(inverse @ stiffness @ inverse.T)
    shapes = np.linalg.solve(inverse, vectors)  # L q: M times the mass-normalised shapes
    return Masses(mass, shapes * (2 * ratios * np.sqrt(squares)) @ shapes.T, stiffness)


def chain(mass_kg: Array, stiffness_n_per_m: Array) -> tuple[Array, Array]:
    """M and K of masses in a row, the first tied to the ground: spring k lies before mass k."""
    after = np.append(stiffness_n_per_m[1:], 0.0)
    return np.diag(mass_kg), np.diag(stiffness_n_per_m + after) - np.diag(after[:-1], 1) - np.diag(after[:-1], -1)


def free_decay(masses: Masses, displacement_m: Array, rate_hz: float, samples: int) -> Array:
    """Accelerations (samples, n) [m/s2] after the structure is let go from the displacements (n,) at rest."""
    transition, _, observe, _ = masses.equations()
    start = np.concatenate([displacement_m, np.zeros_like(displacement_m)])
    step = matrix_exponential(transition / rate_hz)
    states = recursion(step, np.zeros((samples - 1, len(start))), start)
    return np.vstack([start, states]) @ observe.T


def random_response(masses: Masses, force_n: Array, rate_hz: float) -> Array:
    """Accelerations (samples, n) [m/s2] under forces (samples * 4, n) [N], each held for a quarter of a sample.

    White forces have an infinite acceleration at the mass they push; what is returned is the part of the springs and
    dampers, as a sensor sees that whose band ends far below that of the force.
    """
    steps_per_sample = 4
    transition, drive, observe, _ = masses.equations()
    step, begin, end = straight_step(transition, drive, 1 / (rate_hz * steps_per_sample))
    start = np.zeros(len(transition))
    return driven_outputs(step, begin + end, observe, force_n, start)[1::steps_per_sample]


DAMPING_RATIO = 0.0134  # Eq 5.3
RATE_HZ = 100.0
DURATION_S = 75.0  # at which a decay from Eq 5.3's first peak has the r.m.s. of Table 5.1

PRINTED_MEASURED_HZ = (0.7419, 2.548, 4.226)
PRINTED_MODEL_HZ = (0.7453, 2.500, 4.534)
PRINTED_RMS = (0.0458, 0.0445)


@dataclass(frozen=True)
class FloorSensor:
    """A recorder of acceleration: its gain, its own noise and its step [g]."""

    name: str
    gain: float
    noise_g: float
    step_g: float


# Steps of PASCO's data sheet and of 6 bits over +-2 g; the noise is assumed, 2 mg per root Hz for the chip.
SENSORS = (FloorSensor("PS-2119", 1.0, 0.003, 0.010), FloorSensor("BMA220 at 2 g", 0.98, 0.014, 0.0625))


@dataclass(frozen=True)
class SensorRecord:
    """One sensor's record: r.m.s. [g], peaks of its spectrum [Hz], damping by decrement."""

    sensor: FloorSensor
    rms_g: float
    peaks_hz: tuple[float, ...]
    decrement: Decrement


def structure(stiffness_n_per_m: float | None = None) -> Masses:
    """Mass, damping and stiffness of the building, damping ratio 1.34 % in every mode."""
    floor_kg, clamp_kg, phone_kg, sensor_kg, airlink_kg = 0.346, 0.35834, 0.112, 0.048, 0.078
    elasticity_pa, second_moment_m4, clear_height_m = 2.2e9, 33.873e-12, 0.142875
    middle = 7.5 * elasticity_pa * second_moment_m4 / clear_height_m**3
    top_kg = floor_kg + 2 * clamp_kg + phone_kg + sensor_kg + airlink_kg
    mass, stiffness = chain(np.array([floor_kg] * 4 + [top_kg]), np.full(5, stiffness_n_per_m or middle))
    return with_damping_ratios(mass, stiffness, np.full(5, DAMPING_RATIO))


def frequencies_hz(building: Masses) -> Array:
    """Undamped natural frequencies (5,) by Eq 5.4."""
    squares = np.linalg.eigvals(np.linalg.solve(building.mass, building.stiffness)).real
    return np.sqrt(np.sort(squares)) / (2 * np.pi)


def released(building: Masses) -> Array:
    """Acceleration (samples, 5) [m/s2] of the floors after the top was pulled aside and let go.

    As strong as to give the first peak of Eq 5.3 at the top.
    """
    first_peak_g, first_peak_s = 0.1978, 1.19
    pulled = np.linalg.solve(building.stiffness, np.eye(5)[4])
    accel = free_decay(building, pulled / pulled[4], RATE_HZ, round(DURATION_S * RATE_HZ))
    around = slice(int((first_peak_s - 0.4) * RATE_HZ), int((first_peak_s + 0.4) * RATE_HZ))
    return accel * first_peak_g * STANDARD_GRAVITY_MPS2 / np.abs(accel[around, 4]).max()


def recorded(accel_mps2: Array, sensor: FloorSensor, seed: int) -> Array:
    """What a sensor makes of an acceleration (n,): [m/s2], noisy and in steps."""
    rng = np.random.default_rng(seed)
    in_g = sensor.gain * accel_mps2 / STANDARD_GRAVITY_MPS2 + sensor.noise_g * rng.standard_normal(len(accel_mps2))
    return np.asarray(np.round(in_g / sensor.step_g) * sensor.step_g * STANDARD_GRAVITY_MPS2)


def compare_sensors(seed: int = 1) -> tuple[SensorRecord, ...]:
    """Both sensors clamped to the top floor of the same simulated decay, as Tables 5.1, 5.2 and Eq 5.3 compare them."""
    top = released(structure())[:, 4]
    return tuple(_figures(recorded(top, sensor, seed + number), sensor) for number, sensor in enumerate(SENSORS))


def _figures(accel_mps2: Array, sensor: FloorSensor) -> SensorRecord:
    in_g = accel_mps2 / STANDARD_GRAVITY_MPS2
    return SensorRecord(sensor, float(np.sqrt((in_g**2).mean())), _peaks_hz(in_g), log_decrement(in_g, RATE_HZ))


def _peaks_hz(accel: Array) -> tuple[float, ...]:
    """The highest bin of the whole record's transform within 10 % of each of the first three modes of the structure."""
    power = np.abs(np.fft.rfft(accel - accel.mean()))
    bins_hz = np.fft.rfftfreq(len(accel), 1 / RATE_HZ)
    near = [np.flatnonzero(np.abs(bins_hz / mode - 1) < 0.1) for mode in frequencies_hz(structure())[:3]]
    return tuple(float(bins_hz[bins[power[bins].argmax()]]) for bins in near)
