"""What a sensor on a linear car reads of a road, wave by wave, and how that depends on the car's numbers.

A car whose laws are linear answers each wave of the road with a factor, exactly: springs, dampers and tires are
impedances there, a mount in series with a damper too, and what lies between the body and the recorder is a factor of
its own. Laws that are not linear come with slopes that stand in for them (``linearise``). With D(s) = s2 M + s C + K,
what the laws add at the suspensions Z(s) and at the tires Y(s), the travel J and the wheels W:

    (D + J' Z J + W' Y W) q = (R + W' Y) z

A force by all that moves at a wheel is a row of factors on q and z instead, and acts along J, W or their sum.

A sensor on the body reads s2 r q.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import numpy.typing as npt

from logger.arrays import Array, Complex
from logger.vehicle.effect import Chosen, SensorEffect
from logger.vehicle.laws import Between
from logger.vehicle.models import structure_of
from logger.vehicle.named_parameters import Free, changed, read
from logger.vehicle.simulate import recorder_gain
from logger.vehicle.structure import Output, Structure, body_point
from logger.vehicle.vehicle import Vehicle

# Step of differences, as a share: a mode of quality Q bends over a step h by (Q h)^2 / 6, and rounding is 1e-16 / h.
STEP = 1e-5


def dynamic_stiffness(mass: Array, damping: Array, stiffness: Array, s: Complex) -> Complex:
    """s2 M + s C + K (..., n, n) of matrices (n, n) at s (...,) [1/s]."""
    at = s[..., None, None]
    return np.asarray((at * at) * mass + at * damping + stiffness)


def frequency_response(structure: Structure, outputs: Sequence[Output], f_hz: npt.ArrayLike) -> Complex:
    """Outputs per elevation under each wheel separately, and per force from outside (``pushed``), for waves
    exp(2 pi i f t); no delay, no contact patch.

    f_hz (...) [Hz]; returns (..., p, w).
    """
    s = np.asarray(2j * np.pi * np.asarray(f_hz, float))
    dynamic = dynamic_stiffness(structure.mass, structure.damping, structure.stiffness, s)
    coordinates = np.linalg.solve(dynamic, structure.road.astype(complex))
    rows = np.array([output.row for output in outputs])
    orders = np.array([[output.order] for output in outputs])
    by_road = np.array([output.road_row for output in outputs])  # no sensor feels a force from outside but by motion
    by_input = np.pad(by_road, ((0, 0), (0, structure.road.shape[1] - by_road.shape[1])))
    return s[..., None, None] ** orders * (rows @ coordinates) + by_input


def at_steady_speed(structure: Structure, by_wheel: Complex, wave_number_cpm: Array) -> Complex:
    """Out of a response per elevation under each wheel separately (..., w), that per elevation under the front wheel
    (...), for waves of the road (...) [cycle/m]: each wheel meets them later, over its contact patch."""
    delays = np.exp(-2j * np.pi * wave_number_cpm[..., None] * structure.behind_m)
    return np.asarray((by_wheel * delays).sum(axis=-1) * np.sinc(wave_number_cpm * structure.contact_patch_m))


MOTIONS = 5
"""What a ``LinearLaw`` sees: the first of ``laws.Seen``. How fast the body's end rises follows from them."""


@dataclass(frozen=True, eq=False)
class LinearLaw:
    """A linear force by all that moves at a wheel, with m states: what stands in for a ``MotionLaw``.

    by         (MOTIONS,) force per motion; through (m,) per state
    into       (m, MOTIONS) how fast the states grow per motion; own (m, m) per state
    """

    between: Between
    by: Array
    through: Array
    into: Array
    own: Array

    def states(self, s: Complex) -> Complex:
        """States per motion (f, m, MOTIONS) at s (f,), not 0 [1/s]."""
        return np.asarray(np.linalg.solve(s[:, None, None] * np.eye(len(self.own)) - self.own,
                                          np.broadcast_to(self.into, (len(s), *self.into.shape))))

    def forces(self, s: Complex) -> Complex:
        """Force per motion (..., MOTIONS) at s (...); at rest it is taken just next to 0."""
        flat = np.where(s == 0, _BESIDE_REST, s).ravel()
        return np.asarray(self.by + self.through @ self.states(flat)).reshape(*s.shape, MOTIONS)

    def along(self, travel: Array, wheel: Array) -> Array:
        """The row (n,) that the force acts along, at a wheel whose travel and height are these rows of q."""
        return {Between.BODY_AND_WHEEL: travel, Between.WHEEL_AND_GROUND: wheel,
                Between.BODY_AND_GROUND: travel + wheel}[self.between]


_BESIDE_REST = 1e-6j  # 1/s


@dataclass(frozen=True)
class CornerSlopes:
    """The laws of one corner as numbers, each beside what the car's matrices hold of it, but for the damper's.

    spring_n_per_m            of the suspension, beyond its linear spring
    damper_n_s_per_m          of the whole damper by its own rate
    mount_n_per_m             in series with the damper; infinite: none
    beside_n_s_per_m          by the suspension's rate, beside damper and mount
    tire_n_per_m              beyond the linear tire
    tire_damping_n_s_per_m    of the tire
    contact                   share of its force that the tire gives, 1 while it never lifts
    rest_m                    mean travel of the suspension, where its laws push it one way
    wheel_n_s_per_m           by how fast the wheel rises against the ground; body_n_s_per_m the body's end
    motions                   forces by all that moves
    """

    spring_n_per_m: float
    damper_n_s_per_m: float
    mount_n_per_m: float
    beside_n_s_per_m: float
    tire_n_per_m: float
    tire_damping_n_s_per_m: float
    contact: float = 1.0
    rest_m: float = 0.0
    wheel_n_s_per_m: float = 0.0
    body_n_s_per_m: float = 0.0
    motions: tuple[LinearLaw, ...] = field(default=(), compare=False)

    def passed(self, s: Complex) -> Complex:
        """Share (f,) of the suspension's rate that reaches the damper, at s (f,) [1/s]."""
        return 1 / (1 + self.damper_n_s_per_m * s / self.mount_n_per_m)

    def tire(self, s: Complex, tire_n_per_m: float) -> Complex:
        """Force per deflection (f,) [N/m] beyond a linear tire that is in the matrices."""
        whole = tire_n_per_m + self.tire_n_per_m + s * self.tire_damping_n_s_per_m
        return np.asarray(self.contact * whole - tire_n_per_m)


@dataclass(frozen=True)
class Waves:
    """What the corners do per elevation of the road under the front wheel, at steady speed: (f, w) each.

    travel        of the suspensions
    rate          of that [1/s], ``own_rate`` what the dampers feel of it
    deflection    of the tires; ``force`` what they answer as long as they hold [N/m]
    height        of the wheels
    """

    travel: Complex
    rate: Complex
    own_rate: Complex
    deflection: Complex
    force: Complex
    height: Complex


@dataclass(frozen=True, eq=False)
class LinearCar:
    """A linear car and what is read of it.

    output     the motion of it that the sensor feels
    corners    one per wheel; empty where the matrices hold all
    sensors    effects between that motion and the record, in order
    """

    structure: Structure
    output: Output
    corners: tuple[CornerSlopes, ...] = ()
    sensors: tuple[Chosen, ...] = ()

    @staticmethod
    def of(vehicle: Vehicle) -> LinearCar:
        """A vehicle without effects, read by its sensor. ValueError if it lacks what its model needs."""
        structure = structure_of(vehicle)
        return LinearCar(structure, body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m))

    @property
    def depends_on_motion(self) -> bool:
        """Whether it is another car where the road or the speed is another one: never."""
        return False

    def at(self, speed_mps: float, wave_number_cpm: Array, psd_m3: Array, like: LinearCar | None = None) -> LinearCar:
        """This car at a speed on a road of some spectrum: itself."""
        return self

    def by_wheel(self, f_hz: Array) -> Complex:
        """The reading per elevation under each wheel separately (..., w) [1/s2] for waves exp(2 pi i f t), f (...)
        [Hz]; no delay between the wheels, no contact patch."""
        s, output = np.asarray(2j * np.pi * np.asarray(f_hz, float)), self.output
        read = s[..., None] ** output.order * (output.row @ self._coordinates(s)) + output.road_row
        return self._through_sensors(s, read)

    def response(self, f_hz: npt.ArrayLike, speed_mps: npt.ArrayLike) -> Complex:
        """The reading per elevation under the front wheel [1/s2], at constant speed.

        ``f_hz`` [Hz] and ``speed_mps`` [m/s], greater than 0, are broadcast against each other. Left and right wheels
        see the same road.
        """
        f, speed = np.broadcast_arrays(np.asarray(f_hz, float), np.asarray(speed_mps, float))
        return at_steady_speed(self.structure, self.by_wheel(f), f / speed)

    def waves(self, wave_number_cpm: Array, speed_mps: float) -> Waves:
        """What the corners do on waves (f,) [cycle/m] of the road at a steady speed [m/s]."""
        structure = self.structure
        s = np.asarray(2j * np.pi * wave_number_cpm * speed_mps)
        averaged = np.sinc(wave_number_cpm * structure.contact_patch_m)[:, None]
        road = np.exp(-2j * np.pi * wave_number_cpm[:, None] * structure.behind_m) * averaged
        q = (self._coordinates(s) @ road[..., None])[..., 0]
        travel, height = q @ structure.travel.T, q @ structure.wheels.T
        deflection = height - road
        passed = np.stack([one.passed(s) for one in self.corners], axis=1)
        whole = np.stack([tire + one.tire_n_per_m + s * one.tire_damping_n_s_per_m
                          for one, tire in zip(self.corners, structure.tires, strict=True)], axis=1)
        rate = s[:, None] * travel
        return Waves(travel, rate, passed * rate, deflection, whole * deflection, height)

    def travel_by_wheel(self, f_hz: Array) -> Complex:
        """Travel of each suspension per elevation under each wheel separately (f, w, w); waves and delays as
        ``by_wheel``."""
        return np.asarray(self.structure.travel @ self._coordinates(np.asarray(2j * np.pi * f_hz)))

    def by_force(self, f_hz: Array) -> Complex:
        """The reading per force in each suspension (f, w) [1/kg]; a force pulls body and wheel together."""
        s, structure = np.asarray(2j * np.pi * f_hz), self.structure
        moved = np.linalg.solve(self._dynamic(s)[0], -structure.travel.T.astype(complex))
        return self._through_sensors(s, s[..., None] ** self.output.order * (self.output.row @ moved))

    def _through_sensors(self, s: Complex, read: Complex) -> Complex:
        for one in self.sensors:
            assert isinstance(one.effect, SensorEffect)
            read = read * one.effect.factor(one.p, s)[..., None]
        return np.asarray(read)

    def _coordinates(self, s: Complex) -> Complex:
        """Per elevation under each wheel (..., n, w), at s (...) [1/s]."""
        dynamic, pressed = self._dynamic(s)
        return np.asarray(np.linalg.solve(dynamic, self.structure.road + pressed))

    @cached_property
    def matrices(self) -> tuple[Array, Array]:
        """Damping and stiffness (n, n) with the laws of the corners, as far as these are springs and dampers; of a
        damper behind a mount as if that were rigid."""
        structure, corners = self.structure, self.corners
        if not corners:
            return structure.damping, structure.stiffness
        travel, wheel = structure.travel, structure.wheels
        body = travel + wheel
        damped = np.array([one.damper_n_s_per_m + one.beside_n_s_per_m for one in corners]) - structure.dampers
        at_wheel = np.array([one.contact * one.tire_damping_n_s_per_m + one.wheel_n_s_per_m for one in corners])
        at_body = np.array([one.body_n_s_per_m for one in corners])
        springs = np.array([one.spring_n_per_m for one in corners])
        resting = np.array([one.contact * (tire + one.tire_n_per_m) - tire
                            for one, tire in zip(corners, structure.tires, strict=True)])
        damping = (structure.damping + travel.T @ (damped[:, None] * travel) + wheel.T @ (at_wheel[:, None] * wheel)
                   + body.T @ (at_body[:, None] * body))
        stiffness = (structure.stiffness + travel.T @ (springs[:, None] * travel)
                     + wheel.T @ (resting[:, None] * wheel))
        return damping, stiffness

    def _dynamic(self, s: Complex) -> tuple[Complex, Complex]:
        """What q is multiplied by (..., n, n), and what the laws of the tires add to the road's force (..., n, w)."""
        structure = self.structure
        dynamic = dynamic_stiffness(structure.mass, *self.matrices, s)
        if not self.corners:
            return dynamic, np.zeros(1, np.complex128)
        tire = np.stack([one.tire(s, own) for one, own in zip(self.corners, structure.tires, strict=True)], axis=-1)
        pressed = structure.wheels.T * tire[..., None, :]
        for i, one in enumerate(self.corners):
            travel, wheel = structure.travel[i], structure.wheels[i]
            if np.isfinite(one.mount_n_per_m):
                kept_back = s * one.damper_n_s_per_m * (one.passed(s) - 1)
                dynamic = dynamic + kept_back[..., None, None] * np.outer(travel, travel)
            for law in one.motions:
                by_q, by_road = moved_by(law.forces(s), s, travel, wheel)
                along = law.along(travel, wheel)
                dynamic = dynamic + along[:, None] * by_q[..., None, :]
                pressed[..., i] += along * by_road[..., None]
        return np.asarray(dynamic), np.asarray(pressed)


def moved_by(per_motion: Complex, s: Complex, travel: Array, wheel: Array) -> tuple[Complex, Complex]:
    """A force per motion (..., MOTIONS) as one per coordinate (..., n), and, the other way, per elevation (...)."""
    by_travel, by_rate, by_deflection, by_deflection_rate, by_wheel = np.moveaxis(per_motion, -1, 0)
    by_road = by_deflection + s * by_deflection_rate
    by_q = (by_travel + s * by_rate)[..., None] * travel + (by_road + s * by_wheel)[..., None] * wheel
    return np.asarray(by_q), np.asarray(by_road)


class AxleResponse:
    """What the sensor reads per elevation under each axle, at a recorder's rate; left and right see the same road.

    behind_m           (x,) how far behind the front one each axle stands [m]
    contact_patch_m    [m]

    ValueError for a number that the vehicle does not have, or one that moves axles or the contact patch.
    """

    def __init__(self, vehicle: Vehicle, parameters: Sequence[Free], rate_hz: float) -> None:
        self.vehicle, self.parameters, self._rate_hz = vehicle, list(parameters), rate_hz
        for one in parameters:
            read(vehicle, one.name)
            if one.name.endswith("cg_distance_m") or one.name == "contact_patch_m":
                raise ValueError(f"{one.name} cannot be found where the road is not known: expected a measured road")
        structure = structure_of(vehicle)
        self.contact_patch_m = structure.contact_patch_m
        self.behind_m, self._axle = np.unique(structure.behind_m, return_inverse=True)

    def vehicle_with(self, values: Array) -> Vehicle:
        """The vehicle with these values of its free numbers."""
        return changed(self.vehicle, dict(zip([one.name for one in self.parameters], map(float, values), strict=True)))

    def responses(self, values: Array, f_hz: Array) -> tuple[Complex, Complex]:
        """Gains (x, f) [1/s2] behind the recorder's filter with these values (p,), and their derivatives (p, x, f)."""
        vehicle, filtered = self.vehicle_with(values), recorder_gain(f_hz / self._rate_hz)
        of_axles = np.eye(len(self.behind_m))[self._axle]

        def gains(of: Vehicle) -> Complex:
            return np.asarray(filtered * (LinearCar.of(of).by_wheel(f_hz) @ of_axles).T)

        slopes = []
        for one, value in zip(self.parameters, values, strict=True):
            step = STEP * (abs(value) if one.by_factors else one.usual or 1.0)
            low, high = (gains(changed(vehicle, {one.name: value + way * step})) for way in (-1, 1))
            slopes.append((high - low) / (2 * step))
        here = gains(vehicle)
        return here, np.array(slopes).reshape(-1, *here.shape)
