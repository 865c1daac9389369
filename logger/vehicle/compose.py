"""A car with its effects, put together, and what its sensor records.

Problem: effects sit at different places between road and record, alone or together, and a fit asks for the record
hundreds of times. Solution: ``compose`` applies the effects in the physical order of their kinds and gives a ``Car``:
matrices, laws of the corners, the sensor's row and what lies behind it. ``respond`` drives it through a ``Passage``. A
car whose laws are all linear is stepped in blocks; only one with other laws goes through the loop.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from logger.arrays import ROUNDING, Array, Complex
from logger.bounds import ACCELERATION
from logger.vehicle.effect import (
    ActuatorEffect,
    BodyEffect,
    Chosen,
    DriveEffect,
    ForceEffect,
    RecordEffect,
    Recording,
    RoadEffect,
    SensorEffect,
    VehicleEffect,
)
from logger.vehicle.laws import CornerLaws, linear
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import Passage
from logger.vehicle.stepping import Motion, Stepper, begun, force_input
from logger.vehicle.structure import (
    CARRIED,
    Forces,
    Output,
    Structure,
    body_point,
    driven_outputs,
    over_ground,
    pushed,
    straight_step,
)
from logger.vehicle.vehicle import Axle, Vehicle

MOST_MPS2 = ACCELERATION.largest
"""Records end here: those of a car whose motion grows without bound, which effects may make."""


@dataclass(frozen=True, eq=False)
class Car:
    """A vehicle with its effects.

    vehicle      as its effects made it
    structure    with what hangs on the body
    laws         one per wheel, front first, left before right
    row          (n,) of the sensor's acceleration
    sensors      effects between body and record, in order
    drives       effects on the position signal, in order
    records      effects on the record in time, in order
    body         equal for two cars whose bodies move alike where the sensor sits: their linear part, and laws
    shift_m      by how much its effects moved its centre of gravity ahead; what is bolted to the body stays
    """

    vehicle: Vehicle
    structure: Structure
    laws: tuple[CornerLaws, ...]
    row: Array
    sensors: tuple[Chosen, ...]
    drives: tuple[Chosen, ...]
    bends_laws: bool
    body: tuple[Hashable, Hashable]
    shift_m: float = 0.0
    records: tuple[Chosen, ...] = ()

    @property
    def rubs(self) -> bool:
        """Whether there is dry friction in it that decides how it moves: not in a part that its bench moves."""
        return not self.structure.held and any(one.rubs for one in self.laws)

    @property
    def is_dear(self) -> bool:
        """Whether a step takes as long as four of another car: a law is asked by its address, or what rubs is found by
        exponentials (measured: 260 to 360 ns, 70 to 100)."""
        return not self.structure.held and any(
            one.motions
            or (one.dry_friction_n > 0 and (one.friction_transition_mps > 0 or one.stribeck.ratio > 1))
            or (one.wheel_friction_n + one.body_friction_n > 0
                and (one.guide_transition_mps > 0 or one.guide_stribeck.ratio > 1))
            for one in self.laws)

    @property
    def memories(self) -> int:
        """How many states its laws have."""
        return sum(len(law.memory) for corner in self.laws for law in corner.motions)

    @property
    def record_key(self) -> Hashable:
        """Equal for two cars of which alike is recorded on one passage."""
        return self.body, *map(_key, self.sensors), *map(_key, self.records)

    @property
    def linear(self) -> "Car":
        """The car without its laws, which its numbers have as well."""
        return replace(self, laws=(), bends_laws=False, body=(self.body[0], ()))

    @property
    def output(self) -> Output:
        """The sensor's acceleration."""
        return Output(self.row, over_ground(self.structure, 2), 2)

    def factor(self, s: Complex) -> Complex:
        """What lies between the body and the recorder, at s (f,) [1/s]."""
        result = np.ones_like(s)
        for one in self.sensors:
            assert isinstance(one.effect, SensorEffect)
            result = result * one.effect.factor(one.p, s)
        return result

    def driven(self, distance_m: Array) -> Array:
        """Where the front tires truly were (n,) when these distances were recorded [m]."""
        for one in self.drives:
            assert isinstance(one.effect, DriveEffect)
            distance_m = one.effect.driven(one.p, distance_m)
        return distance_m

    def written(self, passage: Passage, accel_z_mps2: Array) -> Array:
        """What is recorded (N,) of an acceleration (N,) behind the recorder's filter [m/s2]."""
        for one in self.records:
            assert isinstance(one.effect, RecordEffect)
            accel_z_mps2 = one.effect.record(
                one.p, Recording(passage.time_s, passage.distance_m, passage.speed_mps, accel_z_mps2,
                                 passage.way.run))
        return accel_z_mps2


@dataclass(frozen=True)
class _OfInput:
    """What an effect does to a profile of this spacing, or to a force of this rate; equal for two of the same values.
    """

    effect: RoadEffect | ActuatorEffect
    values: tuple[tuple[str, float], ...]

    def __call__(self, sampling: float, samples: Array) -> Array:
        does = self.effect.road if isinstance(self.effect, RoadEffect) else self.effect.force
        return does(SimpleNamespace(**dict(self.values)), sampling, samples)


@dataclass(frozen=True, eq=False)
class Response:
    """What a car did on a passage of N samples.

    accel_z_mps2                   (N,) as the recorder keeps it
    travel_m, rate_mps             (N, w) extension of the suspensions and its rate
    deflection_m, deflection_mps   (N, w) height of the wheels over the road from rest, and its rate
    """

    accel_z_mps2: Array
    travel_m: Array
    rate_mps: Array
    deflection_m: Array
    deflection_mps: Array


def compose(vehicle: Vehicle, effects: Sequence[Chosen] = ()) -> Car:
    """A vehicle with its effects. ValueError when it lacks what its model or an effect needs."""
    given, front_m = vehicle.model, vehicle.front.cg_distance_m
    ordered = sorted(effects, key=lambda one: (one.effect.stage, one.effect.name))

    def of(kind: type[Any]) -> tuple[tuple[Any, SimpleNamespace], ...]:
        return tuple((one.effect, one.p) for one in ordered if isinstance(one.effect, kind))

    for effect, p in of(VehicleEffect):
        vehicle = effect.vehicle(p, vehicle)
    structure = structure_of(vehicle)
    if (given, vehicle.model) == ("half_car", "full_car"):
        structure = replace(structure, sides=2)
    surface, actuators = (tuple(_OfInput(effect, tuple(sorted(vars(p).items()))) for effect, p in of(kind))
                          for kind in (RoadEffect, ActuatorEffect))
    if surface or actuators:
        structure = replace(structure, surface=surface, actuators=actuators)
    for effect, p in of(BodyEffect):
        structure = effect.structure(p, structure)
    forces, laws = of(ForceEffect), []
    for axle in _axles(vehicle):
        corner = linear(axle.suspension_damping_n_s_per_m, axle is vehicle.rear,
                        stiffness_n_per_m=axle.suspension_stiffness_n_per_m)
        if vehicle.preload_n:
            corner = corner.with_spring(partial(_preload, vehicle.preload_n))
        for effect, p in forces:
            corner = effect.laws_at_its_axle(p, corner)
        laws.append(corner)
    row = body_point(structure, vehicle.sensor.ahead_m, vehicle.sensor.left_m).row
    around = (SensorEffect, DriveEffect, RecordEffect)
    plain, bent = ([one for one in ordered if isinstance(one.effect, ForceEffect) is is_bent
                    and not isinstance(one.effect, around)] for is_bent in (False, True))
    body = ((vehicle, structure.sides, *map(_key, plain)), tuple(map(_key, bent)))
    sensors, drives, records = (tuple(one for one in ordered if isinstance(one.effect, kind)) for kind in around)
    return Car(vehicle, structure, tuple(laws), row, sensors, drives, bool(forces), body,
               front_m - vehicle.front.cg_distance_m, records)


def _key(one: Chosen) -> Hashable:
    return (one.effect, *sorted(one.values.items()))


def recorded(car: Car, passage: Passage) -> Array:
    """What the recorder keeps of the sensor's acceleration (N,) [m/s2].

    The passage is over where the car truly was: ``car.driven`` of what was recorded.
    """
    return car.written(passage, passage.recorded_of(
        car.body, lambda: fine_outputs(car, passage, [car.output])[0], car.factor))


def respond(car: Car, passage: Passage) -> Response:
    """The record with the motions behind it."""
    structure = car.structure
    motion = moved(car, passage)
    inputs, _ = passage.under_wheels(structure)
    accel = (fine_outputs(car, passage, [car.output]) if structure.held else
             _of_motion(passage.driven(structure), motion, inputs, [car.output]))[0]
    n, elevation = len(structure.mass), inputs[:, :len(structure.wheels)]
    states, elevation = passage.sampled(motion.states), passage.sampled(elevation)
    coordinates, velocities = states[:, :n], states[:, n:]
    road_mps = np.gradient(elevation, 1 / passage.rate_hz, axis=0)
    return Response(car.written(passage, passage.recorded(accel, car.factor)),
                    coordinates @ structure.travel.T, velocities @ structure.travel.T,
                    coordinates @ structure.wheels.T - elevation, velocities @ structure.wheels.T - road_mps)


def bounded(records: Sequence[Array]) -> bool:
    """Whether the car that they are of moves as cars do, and does not shake itself to pieces."""
    return all(float(np.abs(one).max()) < MOST_MPS2 for one in records)


def moved(car: Car, passage: Passage) -> Motion:
    """How the car moved at the fine instants, the front left wheel's first place its level."""
    if car.bends_laws or car.structure.held:
        return stepper_of(car, passage.step_s, passage.forces).march(
            *passage.under_wheels(car.structure), passage.way, begins=passage.begins)
    states = in_blocks(passage.driven(car.structure), passage, np.eye(2 * len(car.structure.mass)))
    return Motion(states, np.zeros((len(states), 2 * len(car.laws))))


def _axles(vehicle: Vehicle) -> list[Axle]:
    """The axle of each wheel, in the order of the structure's wheels."""
    axles = [vehicle.front] if vehicle.rear is None else [vehicle.front, vehicle.rear]
    return [axle for axle in axles for _ in range(2)] if vehicle.model == "full_car" else axles


def fine_outputs(car: Car, passage: Passage, outputs: Sequence[Output]) -> Array:
    """Outputs at the fine instants (p, M)."""
    structure = passage.driven(car.structure)
    if structure.held:
        inputs = passage.smooth_inputs(structure)
        matrices = np.stack([structure.stiffness, structure.damping, structure.mass])[:, 0, 0]
        force_n = inputs @ matrices + moved(car, passage).forces[:, 0]
        if car.laws[0].dry_friction_n > 0:
            force_n += _friction_of_held(car.laws[0], inputs[:, 1], inputs[:, 2], passage.step_s)
        return np.tile(force_n, (len(outputs), 1))  # the one thing that is measured of it
    if car.bends_laws:
        return _of_motion(structure, moved(car, passage), passage.smooth_inputs(structure), outputs)
    return linear_outputs(structure, passage, outputs)


def linear_outputs(structure: Structure, passage: Passage, outputs: Sequence[Output]) -> Array:
    """Outputs at the fine instants (p, M), of a linear car."""
    observe, direct = structure.output_matrices(outputs)
    found = in_blocks(structure, passage, observe)
    if direct.any():  # what is felt on the body comes through springs and dampers alone
        found += passage.smooth_inputs(structure) @ direct.T
    return found.T


def _friction_of_held(laws: CornerLaws, rate_mps: Array, rise_mps2: Array, step_s: float) -> Array:
    """Dry friction (M,) of a part that its bench moves at these rates, which grow so fast (M,): its mean over a step
    around each instant, so that it turns round when the motion does and not when the next step begins."""
    way, transition = 0.5 * step_s * rise_mps2, laws.friction_transition_mps

    def integral(rate: Array) -> Array:
        size = np.abs(rate)
        return size + transition * np.log1p(np.exp(-2 * size / transition)) if transition > 0 else size

    over = np.abs(way) > ROUNDING
    mean = (integral(rate_mps + way) - integral(rate_mps - way)) / np.where(over, 2 * way, 1.0)
    return np.where(over, laws.dry_friction_n * mean * laws.stribeck.times(rate_mps), laws.friction_n(rate_mps))


def _preload(force_n: float, travel_m: Array) -> Array:
    return np.full_like(travel_m, force_n)


def _of_motion(structure: Structure, motion: Motion, inputs: Array, outputs: Sequence[Output]) -> Array:
    """Outputs (p, M) of a motion, under the inputs of the structure (M, u)."""
    observe, direct = structure.output_matrices(outputs)
    onto = force_input(structure)[len(structure.mass):]
    by_laws = np.array([one.row @ onto if one.order == 2 else np.zeros(onto.shape[1]) for one in outputs])
    return np.asarray((motion.states @ observe.T + inputs @ direct.T + motion.forces @ by_laws.T).T)


def in_blocks(structure: Structure, passage: Passage, observe: Array) -> Array:
    """Outputs (M, p) ``observe`` (p, 2 n) of the state at the fine instants, of a linear car."""
    driving, moves = passage.driving(structure)
    transition, gain = linear_step(structure, passage.step_s)
    if structure.on_base:  # that of a rig which a force drives is at rest
        moves = moves & gain.any(axis=0)
        driving, gain = driving[:, moves], gain[:, moves]
    start = begun(structure.at_rest(passage.under_wheels(structure)[0][0]), passage.begins)
    return driven_outputs(transition, gain, observe, driving, start)


@lru_cache(maxsize=64)  # two for each number of a car (``linear_slopes``)
def linear_step(structure: Structure, step_s: float) -> tuple[Array, Array]:
    """The transition of the state over a step, and what the inputs' means and rises do to it."""
    transition, at_start, at_end = straight_step(*structure.state_space(), step_s)
    return transition, np.hstack([at_start + at_end, at_end - at_start])


@lru_cache(maxsize=4)
def stepper_of(car: Car, step_s: float, forces: Forces = ()) -> Stepper:
    """What steps a car, which passes all of its runs one after the other or at once, under forces on these parts."""
    if car.structure.held:
        return Stepper.of(CARRIED, [replace(one, dry_friction_n=0.0) for one in car.laws], step_s)
    return Stepper.of(pushed(car.structure, forces), car.laws, step_s)


def with_effect(effects: Sequence[Chosen], one: Chosen) -> tuple[Chosen, ...]:
    """The effects with one more, or with another value of one that is there."""
    others = [other for other in effects if other.effect.name != one.effect.name]
    return (*others, one)


