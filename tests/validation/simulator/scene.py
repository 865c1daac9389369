"""One set of drives: a car with what it has beyond its file, its sensor, the roads and how it is driven over them.

Problem: an effect may sit in the car, in its sensor, in the clock or the odometer, or need a road that shows it.

Solution: a frozen scene that holds all of that, so that an effect is a change of the scene, and one function that
turns a scene into what a perfect recorder would have written.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .cars import STEP_S, Car, Physics, assemble, finer, ride
from .recorder import RATE_HZ, REACH_S, Sensor, record
from .roads import Road, wheel_path

Array = NDArray[np.float64]

AFTER_S = REACH_S + 0.01
_NOTHING, _PERFECT = Physics(), Sensor()


@dataclass(frozen=True)
class Drive:
    """How a stretch is driven: a mean speed with up to two slow swings, as shares of it."""

    road: Road
    duration_s: float
    speed_mps: float
    start_m: float
    swings: tuple[tuple[float, float, float], ...] = ()  # share, period [s], phase

    @property
    def times_s(self) -> Array:
        return np.arange(round(self.duration_s * RATE_HZ)) / RATE_HZ

    def distance_m(self, t_s: Array) -> Array:
        """Where the front tire stands on the profile."""
        way = t_s.copy()
        for share, period, phase in self.swings:
            omega = 2 * np.pi / period
            way += share / omega * (np.cos(phase) - np.cos(omega * t_s + phase))
        return self.start_m + self.speed_mps * way

    def speed_at_mps(self, t_s: Array) -> Array:
        share = np.ones_like(t_s)
        for size, period, phase in self.swings:
            share += size * np.sin(2 * np.pi / period * t_s + phase)
        return self.speed_mps * share


@dataclass(frozen=True)
class Scene:
    """Everything that the measured acceleration depends on, but for noise."""

    car: Car
    drives: tuple[Drive, ...]
    physics: Physics = _NOTHING
    sensor: Sensor = _PERFECT
    speed_scale: float = 1.0
    road_scale: float = 1.0
    tracks_apart: float = 1.0
    profile_blur_m: float = 0.0

    def with_physics(self, **changes: object) -> Scene:
        return replace(self, physics=replace(self.physics, **changes))

    def with_sensor(self, **changes: object) -> Scene:
        return replace(self, sensor=replace(self.sensor, **changes))

    def road(self, drive: Drive) -> Road:
        """The road that this drive really meets."""
        road = drive.road.scaled(self.road_scale).with_tracks_apart(self.tracks_apart)
        return Road(road.spacing_m, np.round(road.left_m, 6), np.round(road.right_m, 6), road.grade, road.waviness)

    def written_road(self, drive: Drive) -> Road:
        """The road as the profile file has it."""
        road = self.road(drive)
        return road.blurred(self.profile_blur_m) if self.profile_blur_m else road


def wheel_paths(
    scene: Scene, drive: Drive, at_s: Array, way: tuple[Array, Array] | None = None,
) -> tuple[Array, Array]:
    """Elevations and their rates (instants, corners) under the tires; ``way`` replaces the drive's own way."""
    distance, speed = way or (drive.distance_m(at_s), drive.speed_at_mps(at_s))
    distance, speed = distance / scene.speed_scale, speed / scene.speed_scale
    patch = scene.car.contact_patch_m if scene.physics.patch_m is None else scene.physics.patch_m
    ready = assemble(scene.car, scene.physics)
    road = scene.road(drive)
    height, rate = np.empty((2, at_s.size, ready.corners.size))
    for i, (behind, right) in enumerate(zip(ready.behind_front_m, ready.on_right, strict=True)):
        track = road.right_m if right else road.left_m
        height[:, i], rate[:, i] = wheel_path(track, road.spacing_m, distance - behind, speed, patch)
    unround = scene.physics.unround_m
    if unround:
        wheel_turns = distance / scene.physics.tire_radius_m
        for i in range(ready.corners.size):
            # A heavy spot pulls with the square of the speed; the tire feels it as if the road were uneven.
            size = unround * speed**2 / scene.physics.tire_radius_m**2
            height[:, i] += size * np.sin(wheel_turns + 2.4 * i)
            rate[:, i] += size * np.cos(wheel_turns + 2.4 * i) * speed / scene.physics.tire_radius_m
    if scene.physics.flat_m:
        dent, slope = _flat_spot(scene.physics, distance)
        height[:, 0] += dent
        rate[:, 0] += slope * speed
    return height, rate


def _flat_spot(physics: Physics, distance_m: Array) -> tuple[Array, Array]:
    """By how much the front tire is lower for its flat spot [m], and the slope of that: a raised cosine each turn."""
    turn = 2 * np.pi * physics.tire_radius_m
    angle = 2 * np.pi * ((distance_m + 0.5 * turn) % turn - 0.5 * turn) / physics.flat_length_m
    on = np.abs(angle) < np.pi
    return (np.where(on, -0.5 * physics.flat_m * (1 + np.cos(angle)), 0.0),
            np.where(on, np.pi * physics.flat_m / physics.flat_length_m * np.sin(angle), 0.0))


def _firmness(physics: Physics, drive: Drive, at_s: Array) -> Array:
    """How firm adaptive dampers are, of one: soft in town, firm on a motorway."""
    return 1 + physics.firmer * np.tanh((drive.speed_at_mps(at_s) - physics.firmer_at_mps) / 8.0)


def _driveline(physics: Physics, distance_m: Array, speed_mps: Array) -> Array:
    """The rate [m/s] of a body that a shaft shakes, so many times a metre."""
    wave = 2 * np.pi * physics.driveline_per_m
    return -np.sqrt(2) * physics.driveline_mps2 * np.cos(wave * distance_m) / (wave * np.maximum(speed_mps, 1.0))


def clean_acceleration(
    scene: Scene, drive: Drive, step_s: float = STEP_S, recorded: tuple[Array, Array] | None = None,
) -> Array:
    """What a recorder without noise writes [m/s2], at ``drive.times_s``.

    ``recorded`` (distance [m], speed [m/s] at those times) replaces the true way by the recorded one.
    """
    ready = assemble(scene.car, scene.physics)
    step_s /= finer(ready, step_s)
    steps = int(np.ceil((drive.duration_s + AFTER_S) / step_s))
    half_steps = np.arange(2 * steps + 1) * 0.5 * step_s
    way = None
    if recorded is not None:
        way = tuple(np.interp(half_steps, drive.times_s, column) for column in recorded)
    height, rate = wheel_paths(scene, drive, half_steps, way)
    motion, _ = ride(ready, height, rate, step_s, firmness=_firmness(scene.physics, drive, half_steps[:-1:2]))
    sensor_rate = motion[:, 0] + scene.physics.sensor_m * motion[:, 1] + motion[:, 2]
    if scene.physics.driveline_mps2:
        shaft_m, shaft_mps = way or (drive.distance_m(half_steps), drive.speed_at_mps(half_steps))
        sensor_rate = sensor_rate + _driveline(scene.physics, shaft_m[::2], shaft_mps[::2])
    return record(sensor_rate, step_s, 0.0, scene.sensor, drive.times_s)


def measured(scene: Scene, step_s: float = STEP_S) -> tuple[Array, ...]:
    """The noise-free accelerations of all drives."""
    return tuple(clean_acceleration(scene, drive, step_s) for drive in scene.drives)
