"""Cars with laws of their own, stepped: against Newton's laws written out force by force and integrated by SciPy."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from logger.profiles.track import Track
from logger.roads.obstacles import speed_bump
from logger.shipped import vehicle_file
from logger.simulation.virtual_drive import observed
from logger.store.formats.effect_file import own_effect, shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle import stepping_loop
from logger.vehicle.compose import compose, recorded, respond
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.models import structure_of
from logger.vehicle.simulate import Passage, recorder_taps
from logger.vehicle.stepping import static_tire_loads_n
from logger.vehicle.structure import suspension_travel, wheel
from logger.vehicle.vehicle import Axle, Vehicle

from ..support.drives.linear_drive import march
from ..support.drives.newton_car import road_under

RAV4 = read_vehicle(vehicle_file("rav4-2009"))
G = 9.80665
SPEED_MPS, DURATION_S = 9.0, 1.7
BUMP = Track(0.02, speed_bump(0.02 * np.arange(1000), 4.0, 0.09, 1.2))


def effect(name: str, **values: float) -> Chosen:
    return chosen(shipped_effects()[name], values)


class Newton:
    """A half car, force by force. Each law is a function of an axle's number and of what it feels."""

    def __init__(self, vehicle: Vehicle) -> None:
        assert vehicle.rear is not None
        self.m, self.inertia = vehicle.sprung_mass_kg, vehicle.pitch_inertia_kg_m2
        self.axles = (vehicle.front, vehicle.rear)
        self.arms = (vehicle.front.cg_distance_m, -vehicle.rear.cg_distance_m)
        a, b = vehicle.front.cg_distance_m, vehicle.rear.cg_distance_m
        self.static = [self.m * G * other / (a + b) + axle.unsprung_mass_kg * G
                       for axle, other in zip(self.axles, (b, a), strict=True)]
        self.spring: Callable = lambda i, x: self.axles[i].suspension_stiffness_n_per_m * x
        self.damper: Callable = lambda i, v: self.axles[i].suspension_damping_n_s_per_m * v
        self.tire: Callable = lambda i, d, v: self.axles[i].tire_stiffness_n_per_m * d
        self.mount_n_per_m: float | None = None

    def acceleration(self, track: Track, patch_m: float, fine_hz: int) -> np.ndarray:
        """Of the body, at so many instants a second."""
        road = road_under(track.start_m, track.spacing_m, track.elevation_m, patch_m)
        bare = road_under(track.start_m, track.spacing_m, track.elevation_m, 0.0)
        assert patch_m > 0
        arms, axles = self.arms, self.axles

        def forces(t: float, y: np.ndarray) -> tuple[list[float], list[float], list[float]]:
            heave, pitch, up, uprate = y[0], y[1], y[2:4], y[6:8]
            pull, press, slip = [], [], []
            for i, arm in enumerate(arms):
                place = SPEED_MPS * t - (arms[0] - arm)
                height = road(place)
                climb = SPEED_MPS * (bare(place + patch_m / 2) - bare(place - patch_m / 2)) / patch_m
                x, v = heave + arm * pitch - up[i], y[4] + arm * y[5] - uprate[i]
                if self.mount_n_per_m is None:
                    damped = self.damper(i, v)
                else:  # mount and linear damper carry the same force
                    damped = self.mount_n_per_m * y[8 + i]
                    slip.append(v - damped / axles[i].suspension_damping_n_s_per_m)
                pull.append(self.spring(i, x) + damped)
                press.append(self.tire(i, up[i] - height, uprate[i] - climb))
            return pull, press, slip

        def derivative(t: float, y: np.ndarray) -> list[float]:
            pull, press, slip = forces(t, y)
            wheels = [(pull[i] - press[i]) / axles[i].unsprung_mass_kg for i in range(2)]
            return [y[4], y[5], y[6], y[7], -sum(pull) / self.m,
                    -(arms[0] * pull[0] + arms[1] * pull[1]) / self.inertia, *wheels, *slip]

        time_s = np.arange(round(DURATION_S * fine_hz) + 1) / fine_hz
        rest = np.zeros(8 if self.mount_n_per_m is None else 10)
        # Of what a test allows this is itself off by 1.4% or less, against 1e-8, 1e-10 and 2 ms.
        found = solve_ivp(derivative, (0, DURATION_S), rest, "DOP853", time_s, rtol=1e-6, atol=1e-8, max_step=4e-3)
        return np.array([derivative(t, y)[4] for t, y in zip(time_s, found.y.T, strict=True)])


def as_recorded(fine: np.ndarray, steps: int) -> np.ndarray:
    taps = recorder_taps(steps)
    padded = np.pad(fine, len(taps) // 2, "edge")
    return np.convolve(padded, taps, "valid")[::steps]


@cache
def plain() -> np.ndarray:
    return as_recorded(Newton(RAV4).acceleration(BUMP, RAV4.contact_patch_m, 2000), 20)


def judged(change: Callable[[Newton], None]) -> np.ndarray:
    car = Newton(RAV4)
    change(car)
    return as_recorded(car.acceleration(BUMP, RAV4.contact_patch_m, 2000), 20)


def found(*effects: Chosen) -> np.ndarray:
    time_s = np.arange(round(DURATION_S * 100) + 1) / 100
    return recorded(compose(RAV4, effects), Passage(BUMP, 100.0, SPEED_MPS * time_s))


def tires_damped(car: Newton) -> None:
    car.tire = lambda i, d, v: car.axles[i].tire_stiffness_n_per_m * d + 400 * v


def rebound_is_harder(car: Newton) -> None:
    car.damper = lambda i, v: car.axles[i].suspension_damping_n_s_per_m * v * (1.5 if v > 0 else 0.5)


def dampers_blow_off(car: Newton) -> None:
    def force(i: int, v: float) -> float:
        beyond = max(abs(v) - 0.15, 0.0)
        return car.axles[i].suspension_damping_n_s_per_m * (v - np.sign(v) * 0.6 * beyond)

    car.damper = force


def springs_harden(car: Newton) -> None:
    car.spring = lambda i, x: car.axles[i].suspension_stiffness_n_per_m * x + 1e7 * x**3


def stops_are_met(car: Newton) -> None:
    car.spring = lambda i, x: car.axles[i].suspension_stiffness_n_per_m * x - 1e5 * max(-x - 0.02, 0.0)


def wheels_lift(car: Newton) -> None:
    car.tire = lambda i, d, v: min(car.axles[i].tire_stiffness_n_per_m * d, car.static[i])


def mounts_give(car: Newton) -> None:
    car.mount_n_per_m = 8e4


def things_rub(car: Newton) -> None:
    car.damper = lambda i, v: car.axles[i].suspension_damping_n_s_per_m * v + 150 * np.tanh(v / 5e-4)


def rubber_rubs(car: Newton) -> None:
    car.damper = lambda i, v: car.axles[i].suspension_damping_n_s_per_m * v + 150 * np.tanh(v / 5e-3)


def all_but_friction(car: Newton) -> None:
    springs_harden(car)
    hard = car.spring
    car.spring = lambda i, x: hard(i, x) - 1e5 * max(-x - 0.02, 0.0)

    def damper(i: int, v: float) -> float:
        digressive = v - np.sign(v) * 0.6 * max(abs(v) - 0.15, 0.0)
        return car.axles[i].suspension_damping_n_s_per_m * digressive * (1.5 if v > 0 else 0.5)

    car.damper = damper
    car.tire = lambda i, d, v: min(car.axles[i].tire_stiffness_n_per_m * d + 100 * v, car.static[i])


ASYMMETRY = effect("damper_asymmetry", rebound_to_bump_ratio=3.0)
BLOW_OFF = effect("damper_blow_off", knee_velocity_m_per_s=0.15, slope_ratio=0.4)
SPRING = effect("progressive_spring", cubic_stiffness_n_per_m3=1e7)
STOP = effect("bump_stop", clearance_m=0.02, stop_stiffness_n_per_m=1e5)
CASES = {
    "tire damping": ((effect("tire_damping", tire_damping_n_s_per_m=400),), tires_damped, 0.005),
    "asymmetry": ((ASYMMETRY,), rebound_is_harder, 0.005),
    "blow-off": ((BLOW_OFF,), dampers_blow_off, 0.005),
    "spring": ((SPRING,), springs_harden, 0.005),
    "stop": ((STOP,), stops_are_met, 0.005),
    "lift": ((effect("wheel_lift"),), wheels_lift, 0.005),
    "mount": ((effect("top_mount_compliance", mount_stiffness_n_per_m=8e4),), mounts_give, 0.005),
    "friction": ((effect("dry_friction", friction_force_n=150),), things_rub, 0.03),
    "friction of rubber": ((effect("dry_friction", friction_force_n=150, transition_velocity_m_per_s=5e-3),),
                           rubber_rubs, 0.01),
    "friction at nearly once": ((effect("dry_friction", friction_force_n=150, transition_velocity_m_per_s=5e-4),),
                                things_rub, 0.01),
    "all but friction": ((STOP, BLOW_OFF, effect("wheel_lift"), SPRING, ASYMMETRY,
                          effect("tire_damping", tire_damping_n_s_per_m=100)), all_but_friction, 0.005),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_each_law_leaves_what_newton_says(case: str) -> None:
    effects, change, allowed = CASES[case]
    expected = judged(change)
    inside = slice(0, len(expected) - 25)  # after the end the two drive on differently
    own = np.sqrt(np.mean((expected - plain())[inside] ** 2))
    assert own > 0.02 * np.sqrt(np.mean(plain() ** 2))
    assert np.sqrt(np.mean((found(*effects) - expected)[inside] ** 2)) < allowed * own


@pytest.mark.slow
def test_an_effect_of_ones_own_is_simulated_as_newton_says(tmp_path: Path) -> None:
    """The example of docs/own-effect.md."""
    page = (Path(__file__).parents[2] / "docs" / "own-effect.md").read_text("utf-8")
    (tmp_path / "mine.py").write_text(page.split("```python\n")[1].split("```")[0])
    mine = chosen(own_effect(tmp_path / "mine.py"), {"damping_n_s2_per_m2": 2000})

    def change(car: Newton) -> None:
        car.damper = lambda i, v: car.axles[i].suspension_damping_n_s_per_m * v + 2000 * v * abs(v)

    expected = judged(change)
    inside = slice(0, len(expected) - 25)
    own = np.sqrt(np.mean((expected - plain())[inside] ** 2))
    assert np.sqrt(np.mean((found(mine) - expected)[inside] ** 2)) < 0.005 * own


# --- what can be said without an integrator ---

EVERYTHING = (STOP, BLOW_OFF, SPRING, ASYMMETRY, effect("wheel_lift"), effect("dry_friction", friction_force_n=100),
              effect("top_mount_compliance", mount_stiffness_n_per_m=1e5),
              effect("tire_damping", tire_damping_n_s_per_m=100))


@pytest.mark.parametrize("name", ["rav4-2009", "rav4-2009-full", "sedan-2015"])
def test_a_car_on_a_flat_road_stays_where_it_is(name: str) -> None:
    flat = Track(1.0, np.full(100, 312.0))
    did = respond(compose(read_vehicle(vehicle_file(name)), EVERYTHING), Passage(flat, 100.0, 0.2 * np.arange(200)))
    for motion in (did.accel_z_mps2, did.travel_m, did.rate_mps, did.deflection_m):
        assert motion == pytest.approx(0, abs=1e-9)


def test_tires_carry_the_weight() -> None:
    """Moments about the axles; the occupant's weight is carried at the centre of gravity."""
    car = replace(RAV4, front=replace(RAV4.front, cg_distance_m=1.0), rear=replace(RAV4.rear, cg_distance_m=1.6))
    front, rear = static_tire_loads_n(compose(car).structure)
    assert front == pytest.approx(G * (875 * 1.6 / 2.6 + 55))
    assert rear == pytest.approx(G * (875 * 1.0 / 2.6 + 55))
    people = effect("occupant", mass_kg=150, frequency_hz=4, damping_ratio=0.3)
    bending = effect("body_bending", frequency_hz=20, damping_ratio=0.05, participation=0.5)
    assert static_tire_loads_n(compose(car, [people, bending]).structure) == pytest.approx(
        [G * (1025 * 1.6 / 2.6 + 55), G * (1025 * 1.0 / 2.6 + 55)])
    full = static_tire_loads_n(structure_of(read_vehicle(vehicle_file("rav4-2009-full"))))
    assert full == pytest.approx(full[0])


ONE_WHEEL = Vehicle("one", "quarter_car", 300.0, None, Axle(0.0, 40.0, 20000.0, 1500.0, 2e5), None, 0.25)


def marched(vehicle: Vehicle, elevation: np.ndarray, *effects: Chosen) -> tuple[np.ndarray, np.ndarray]:
    """States of a car of one wheel, and forces, in steps of 1 ms."""
    car = compose(vehicle, effects)
    mean = (elevation[1:] + elevation[:-1]) / 2
    motion = march(car.structure, car.laws, elevation[:, None], mean[:, None], 1e-3)
    return motion.states, motion.forces


def test_a_wheel_in_the_air_falls_freely() -> None:
    """Over an edge of 2 m: no force but weight on body and wheel together."""
    edge = np.where(np.arange(600) < 50, 0.0, -2.0)
    states, _ = marched(ONE_WHEEL, edge, effect("wheel_lift"))
    centre = (300 * states[:, 0] + 40 * states[:, 1]) / 340
    air = np.flatnonzero(states[:, 1] - edge > 340 * G / 2e5 + 1e-9)
    assert len(air) > 500
    t = 1e-3 * (air - air[0])
    assert np.polyfit(t, centre[air], 2) == pytest.approx([-G / 2, 0, 0], abs=1e-3 * G)
    assert np.diff(centre[air], 2)[1:] == pytest.approx(-G * 1e-6, rel=1e-3)
    assert (np.diff(air) == 1).all()
    held, _ = marched(ONE_WHEEL, edge)
    assert held[:, 1].min() < -2.0


def test_coulomb_friction_takes_the_same_from_each_swing_and_holds_at_last() -> None:
    """A mass on a spring alone: each half swing is shorter by 2 F / k; within F / k it stays (any textbook)."""
    friction_n, k = 150.0, 20000.0
    mass = Vehicle("one", "quarter_car", 300.0, None, Axle(0.0, 1.0, k, 0.0, 1e9), None, 0.25)
    car = compose(mass, [effect("dry_friction", friction_force_n=friction_n)])
    on_rails = replace(car.structure, damping=np.diag([0.0, 6e4]))  # a wheel that goes as the road goes
    rise = 0.05 * (1 - np.cos(np.pi * np.clip(np.arange(6000) / 100, 0, 1)))[:, None]
    states = march(on_rails, car.laws, rise, (rise[1:] + rise[:-1]) / 2, 1e-3).states[150:]
    travel, rate = states[:, 0] - states[:, 1], states[:, 2] - states[:, 3]
    swings = np.abs(travel[1:][rate[1:] * rate[:-1] < 0])
    swings = swings[swings > friction_n / k]
    assert len(swings) >= 3
    assert -np.diff(swings) == pytest.approx(2 * friction_n / k, rel=0.01)
    assert travel[-500:] == pytest.approx(travel[-1], abs=1e-9)
    assert abs(travel[-1]) <= friction_n / k


@pytest.mark.slow
def test_compiled_and_plain_python_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    assert stepping_loop.COMPILED, "the tests need the lab extra"
    rough = 0.02 * np.random.default_rng(1).standard_normal((2, 10)).repeat(4, axis=1).T
    laws = [*compose(RAV4, EVERYTHING).laws]
    laws = [one.with_force(lambda x, v: 500 * v * np.abs(v) + 3000 * x).with_tire(lambda d: 1e6 * d**3) for one in laws]
    more = compose(RAV4, [effect("hysteresis", yield_force_n=50, yield_travel_m=0.002),
                          effect("frame_friction", friction_force_n=20, body_friction_force_n=10)]).laws
    laws = [replace(one, motions=other.motions, wheel_friction_n=other.wheel_friction_n,
                    body_friction_n=other.body_friction_n) for one, other in zip(laws, more, strict=True)]
    structure = structure_of(RAV4)
    compiled = march(structure, laws, rough, (rough[1:] + rough[:-1]) / 2, 1e-3)
    with monkeypatch.context() as without:
        without.setitem(sys.modules, "numba", None)
        spec = importlib.util.spec_from_file_location("plain_stepping_loop", stepping_loop.__file__)
        plainly = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(plainly)
    assert not plainly.COMPILED
    monkeypatch.setitem(sys.modules, stepping_loop.__name__, plainly)
    slow = march(structure, laws, rough, (rough[1:] + rough[:-1]) / 2, 1e-3)
    assert np.abs(compiled.states).max() > 0.01
    assert slow.states == pytest.approx(compiled.states, abs=1e-11)
    assert slow.forces == pytest.approx(compiled.forces, abs=1e-6)


def test_a_linear_car_is_stepped_as_in_blocks() -> None:
    """With no law of its own the loop gives what the exact blocks give."""
    for name in ("rav4-2009", "rav4-2009-full", "golden-car"):
        car = compose(read_vehicle(vehicle_file(name)))
        passage = Passage(BUMP, 100.0, SPEED_MPS * np.arange(200) / 100)
        assert recorded(replace(car, bends_laws=True), passage) == pytest.approx(recorded(car, passage), abs=1e-9)


def test_motions_of_a_linear_car_are_stepped_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    passage = Passage(BUMP, 100.0, SPEED_MPS * np.arange(200) / 100)
    for name in ("rav4-2009", "rav4-2009-full", "golden-car"):
        car = compose(read_vehicle(vehicle_file(name)), [effect("sensor_gain", gain=1.1)])
        outputs = [suspension_travel(car.structure, 0), wheel(car.structure, 0)]
        expected = respond(replace(car, bends_laws=True), passage)
        also = observed(replace(car, bends_laws=True), passage, outputs)
        with monkeypatch.context() as without:
            without.setattr("logger.vehicle.compose.Stepper", None)
            found = respond(car, passage)
            assert observed(car, passage, outputs) == pytest.approx(also, abs=1e-9)
        for motion in ("accel_z_mps2", "travel_m", "rate_mps", "deflection_m", "deflection_mps"):
            assert np.abs(getattr(expected, motion)).max() > 1e-4
            assert getattr(found, motion) == pytest.approx(getattr(expected, motion), abs=1e-9)


@pytest.mark.parametrize(("name", "values", "dear"), [
    ("damper_blow_off", {}, False), ("dry_friction", {}, False),
    ("dry_friction", {"transition_velocity_m_per_s": 0.02}, True),
    ("frame_friction", {"body_friction_force_n": 60.0, "static_to_sliding_ratio": 1.5}, True),
    ("hysteresis", {}, True)])
def test_what_asks_functions_or_exponentials_at_each_step_is_dear(
        name: str, values: dict[str, float], dear: bool) -> None:
    usual = shipped_effects()[name].usual
    assert compose(RAV4, [effect(name, **(usual | values))]).is_dear is dear
