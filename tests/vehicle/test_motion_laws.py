"""Forces by all that moves at a wheel, and with states: against Newton's laws in SciPy, and closed forms."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import replace
from itertools import count, pairwise
from math import pi, sqrt
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from logger.api.lab.bench import among, known_effects, sought_effects
from logger.errors import BadInput
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import own_effect, shipped_effects
from logger.store.formats.vehicle_file import CarModel, read_vehicle
from logger.vehicle import stepping_loop
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.effects.hysteresis import force, rates
from logger.vehicle.laws import Between, MotionLaw, Seen, linear
from logger.vehicle.linear_car import LinearCar
from logger.vehicle.linearise import known_vehicle
from logger.vehicle.modes import modes_of_car
from logger.vehicle.stepping import Way
from logger.vehicle.vehicle import Axle, Vehicle

from ..support.drives.course import integrated
from ..support.drives.linear_drive import march

RIG = Vehicle("rig", "quarter_car", 300.0, None, Axle(0.0, 40.0, 20000.0, 600.0, 2e5), None, 0.25)
STEP_S, LASTS_S = 5e-4, 2.0
N_CPM = np.geomspace(0.004, 3.3, 300)


def effect(name: str, **values: float) -> Chosen:
    one = shipped_effects()[name]
    return chosen(one, one.usual | values)


def shaken_m(t: np.ndarray | float) -> np.ndarray | float:
    """A road, from rest, with its rate 0 at first."""
    return 0.006 * (1 - np.cos(2 * pi * 1.3 * t)) + 0.0015 * (1 - np.cos(2 * pi * 9.0 * t))


def shaken_mps(t: float) -> float:
    return 0.006 * 2 * pi * 1.3 * np.sin(2 * pi * 1.3 * t) + 0.0015 * 2 * pi * 9.0 * np.sin(2 * pi * 9.0 * t)


def stepped(*effects: Chosen, way: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """States of the rig, and its forces, in steps of half a millisecond."""
    car = compose(RIG, effects)
    time_s = STEP_S * np.arange(round(LASTS_S / STEP_S) + 1)
    fine = shaken_m(STEP_S / 8 * np.arange(8 * (len(time_s) - 1) + 1)).reshape(-1)
    mean = np.stack([(fine[:-1] + fine[1:])[i::8] / 2 for i in range(8)]).mean(axis=0)
    went = Way(15.0 * time_s, time_s) if way else None
    did = march(car.structure, car.laws, shaken_m(time_s)[:, None], mean[:, None], STEP_S, went)
    return did.states, did.forces


def by_newton(added, memory: int = 0) -> np.ndarray:
    """States of the rig by Newton's laws.

    added    (t, travel, rate, deflection, deflection rate, wheel's speed, states) -> forces on the body and on the
             wheel, both down, and how fast the states grow
    """
    axle, m = RIG.front, RIG.sprung_mass_kg

    def derivative(t: float, y: list[float]) -> list[float]:
        body, wheel, body_mps, wheel_mps = y[:4]
        travel, rate = body - wheel, body_mps - wheel_mps
        press, press_mps = wheel - shaken_m(t), wheel_mps - shaken_mps(t)
        strut = axle.suspension_stiffness_n_per_m * travel + axle.suspension_damping_n_s_per_m * rate
        on_body, on_wheel, grow = added(t, travel, rate, press, press_mps, wheel_mps, y[4:])
        return [body_mps, wheel_mps, (-strut - on_body) / m,
                (strut - axle.tire_stiffness_n_per_m * press - on_wheel) / axle.unsprung_mass_kg, *grow]

    time_s = STEP_S * np.arange(round(LASTS_S / STEP_S) + 1)
    return integrated(derivative, 4 + memory, time_s, 1e-8, 1e-10, 1e-3).T


def off(found: np.ndarray, expected: np.ndarray, plain: np.ndarray) -> float:
    """The error of the body's and the wheel's speeds, as a share of what the law does to them."""
    return float(np.sqrt(np.mean((found - expected)[:, 2:4] ** 2) / np.mean((expected - plain)[:, 2:4] ** 2)))


@pytest.fixture(scope="module")
def plain() -> np.ndarray:
    return by_newton(lambda *_: (0.0, 0.0, []))[:, :4]


@pytest.mark.parametrize(("wheel_n", "body_n", "ratio"), [
    (30.0, 0.0, 1.0), (0.0, 25.0, 1.0), (30.0, 25.0, 1.0), (30.0, 25.0, 1.8)])
def test_guides_rub_as_newton_says(wheel_n: float, body_n: float, ratio: float, plain: np.ndarray) -> None:
    """Friction that grows within 0.5 mm/s nearly at once, in an integrator that takes all the steps it needs; and with
    more of it at rest, of which 1 / e is left at 50 mm/s."""
    def rubs(mps):
        return np.tanh(mps / 5e-4) * (1.0 + (ratio - 1.0) * np.exp(-(mps / 0.05)**2))

    def added(t, x, v, d, d_mps, u_mps, z):
        return body_n * rubs(v + u_mps), wheel_n * rubs(u_mps), []

    expected = by_newton(added)[:, :4]
    for transition, allowed in ((5e-4, 0.01), (0.0, 0.03)):
        states, _ = stepped(effect("frame_friction", friction_force_n=wheel_n, body_friction_force_n=body_n,
                                   transition_velocity_m_per_s=transition, static_to_sliding_ratio=ratio))
        assert off(states, expected, plain) < allowed


def test_guides_and_suspension_rub_together(plain: np.ndarray) -> None:
    def added(t, x, v, d, d_mps, u_mps, z):
        strut = 40 * np.tanh(v / 5e-4)
        return strut + 15 * np.tanh((v + u_mps) / 5e-4), -strut + 30 * np.tanh(u_mps / 5e-4), []

    expected = by_newton(added)[:, :4]
    states, _ = stepped(effect("frame_friction", friction_force_n=30.0, body_friction_force_n=15.0),
                        effect("dry_friction", friction_force_n=40.0))
    assert off(states, expected, plain) < 0.03


def test_a_rig_comes_to_rest_and_stays() -> None:
    """After the shaking, within force over stiffness of where it began."""
    car = compose(RIG, [effect("frame_friction", friction_force_n=100.0, body_friction_force_n=100.0)])
    road = 0.01 * np.sin(np.pi * np.clip(np.arange(8000) / 500, 0, 2))[:, None]
    states = march(car.structure, car.laws, road, (road[1:] + road[:-1]) / 2, 1e-3).states
    assert np.abs(states).max() > 0.005
    assert states[-1000:] == pytest.approx(np.broadcast_to(states[-1], (1000, 4)), abs=1e-7)
    assert abs(states[-1, 0] - states[-1, 1]) * 20000.0 < 100.0 + 1.0


@pytest.mark.parametrize(("travel_m", "sharpness", "reversal", "static"), [
    (3e-5, 1.0, 1.0, 1.0), (0.0003, 1.0, 1.0, 1.0), (0.002, 1.0, 1.0, 1.0), (0.004, 2.0, 1.0, 1.0),
    (0.001, 0.7, 1.0, 1.0), (0.002, 1.0, 2.0, 1.0), (0.01, 1.0, -5.0, 1.0), (0.0003, 1.0, 2.0, 1.8)])
def test_hysteresis_moves_as_newton_says(travel_m: float, sharpness: float, reversal: float, static: float,
                                         plain: np.ndarray) -> None:
    def added(t, x, v, d, d_mps, u_mps, z):
        loading, unloading = (1.0, 1.0 - reversal) if reversal > 0 else (1 / reversal, 1 / reversal - 1)
        slides_at = 1 + (static - 1) * np.exp(-(v / 0.05)**2)
        grow = v / travel_m * (1 - abs(z[0] / slides_at) ** sharpness * (loading if v * z[0] > 0 else unloading))
        return 120 * z[0], -120 * z[0], [grow]

    expected = by_newton(added, 1)[:, :4]
    states, _ = stepped(effect("hysteresis", yield_force_n=120.0, yield_travel_m=travel_m, sharpness_ratio=sharpness,
                               reversal_ratio=reversal, static_to_sliding_ratio=static))
    assert off(states, expected, plain) < 0.01


def test_a_sail_on_the_body_drags_by_the_square_of_its_speed(plain: np.ndarray) -> None:
    def added(t, x, v, d, d_mps, u_mps, z):
        return 400 * (v + u_mps) * abs(v + u_mps), 0.0, []

    states, _ = stepped(effect("orifice_damping", quadratic_damping_n_s2_per_m2=0.0, body_drag_n_s2_per_m2=400.0))
    assert off(states, by_newton(added)[:, :4], plain) < 0.01


@pytest.mark.parametrize("damper_plays", [0.0, 1.0])
def test_a_joint_with_play_moves_freely_within_its_gap(damper_plays: float, plain: np.ndarray) -> None:
    """A bolt that holds spring and damper is pressed against one end of its hole or the other, and neither pulls it
    back; of a spring alone the damper goes on."""
    k, c, gap_m = (RIG.front.suspension_stiffness_n_per_m, RIG.front.suspension_damping_n_s_per_m, 0.002)

    def added(t, x, v, d, d_mps, u_mps, z):
        damped = c * v
        held = damped * damper_plays
        pressed = max(k * (x - gap_m) + held, 0.0) + min(k * (x + gap_m) + held, 0.0) + damped - held
        return pressed - k * x - damped, k * x + damped - pressed, []

    states, _ = stepped(effect("play", half_gap_m=gap_m, damper_plays=damper_plays))
    assert off(states, by_newton(added)[:, :4], plain) < 0.01


def test_a_gas_is_squeezed_by_its_own_law(plain: np.ndarray) -> None:
    """By Poisson: p V^n is one number, whatever the column's area."""
    stiffness, length_m, area_m2 = RIG.front.suspension_stiffness_n_per_m, 0.02, 0.003
    rest_pa = stiffness * length_m / (1.4 * area_m2)

    def added(t, x, v, d, d_mps, u_mps, z):
        volume_m3 = area_m2 * (length_m + x)
        more = area_m2 * rest_pa * (1 - (area_m2 * length_m / volume_m3) ** 1.4) - stiffness * x
        return more, -more, []

    states, _ = stepped(effect("air_spring", column_length_m=length_m, polytropic_exponent=1.4))
    assert off(states, by_newton(added)[:, :4], plain) < 0.01


def test_a_spring_that_is_slack_neither_pulls_nor_damps(plain: np.ndarray) -> None:
    """What spring and damper carry at rest is all that they can give up: it is that of 3 mm."""
    k, c = RIG.front.suspension_stiffness_n_per_m, RIG.front.suspension_damping_n_s_per_m

    def added(t, x, v, d, d_mps, u_mps, z):
        less = min(k * 0.003 - k * x - c * v, 0.0)
        return less, -less, []

    states, _ = stepped(effect("slack_spring", slack_extension_m=0.003))
    assert off(states, by_newton(added)[:, :4], plain) < 0.01


@pytest.mark.parametrize("travel_m", [0.002, 0.01])
def test_cars_that_hardly_differ_move_alike(travel_m: float, plain: np.ndarray) -> None:
    """At no force a root of it rises without end: where a memory came near 0, one in a hundred cars was thrown away."""
    cars = [stepped(effect("hysteresis", yield_force_n=120.0, yield_travel_m=travel_m, sharpness_ratio=0.3,
                           reversal_ratio=reversal))[0] for reversal in np.linspace(-1.8, -1.7, 101)]
    assert max(np.abs((one - other) / plain.std(axis=0)).max() for one, other in pairwise(cars)) < 0.01


@pytest.mark.parametrize("creep_s", [0.01, 0.1])
def test_rubber_that_creeps_moves_as_newton_says(creep_s: float, plain: np.ndarray) -> None:
    """A spring and a damper in series: each carries the force, and both together go as far as the suspension."""
    stiffness = 8e3

    def added(t, x, v, d, d_mps, u_mps, z):
        force = stiffness * (x - z[0])  # z: how far its damper has gone
        return force, -force, [force / (stiffness * creep_s)]

    states, _ = stepped(effect("maxwell_element", maxwell_stiffness_n_per_m=stiffness, relaxation_time_s=creep_s))
    assert off(states, by_newton(added, 1)[:, :4], plain) < 0.01


def test_hysteresis_without_a_yield_travel_is_coulomb_friction() -> None:
    rubs, _ = stepped(effect("dry_friction", friction_force_n=120.0))
    nearly, _ = stepped(effect("hysteresis", yield_force_n=120.0, yield_travel_m=1e-4))
    further, _ = stepped(effect("hysteresis", yield_force_n=120.0, yield_travel_m=1e-3))
    size = np.sqrt(np.mean(rubs[:, 2] ** 2))
    assert np.sqrt(np.mean((nearly - rubs)[:, 2] ** 2)) < 0.06 * size
    assert np.sqrt(np.mean((further - rubs)[:, 2] ** 2)) > 3 * np.sqrt(np.mean((nearly - rubs)[:, 2] ** 2))


# --- hysteresis alone: its loop ---


def loop_area_n_m(amplitude_m: float, values: SimpleNamespace) -> float:
    """Of a settled loop of the law, by SciPy along the way."""
    def slope(t: float, z: list[float]) -> list[float]:
        v = 2 * pi * amplitude_m * np.cos(2 * pi * t)
        return [float(rates(values, Seen(0.0, v, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (z[0],)))[0])]

    settled = 12
    t = np.linspace(0, settled + 1, 4000 * (settled + 1) + 1)
    t, z = (one[4000 * settled:] for one in (t, integrated(slope, 1, t, 1e-9, 1e-12, 5e-3)[0]))
    f = force(values, Seen(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, (z,)))
    return float(np.trapezoid(f, amplitude_m * np.sin(2 * pi * t)))


def test_the_loop_is_as_large_as_it_has_to_be() -> None:
    """n = 1. Far beyond the yield: Coulomb's 4 F a, less what the corners take: from -1 z comes back straight to 0 and
    then as 1 - exp(-x / y), so half a turn of 2 a takes (2 a - (1/2 + 1 + 1) y) F. Within it each half way begins at
    -z1, and comes straight to 0, then curved to z1: the area is known from z1 alone."""
    force_n, y = 120.0, 0.002
    values = effect("hysteresis", yield_force_n=force_n, yield_travel_m=y).p
    large = 2 * force_n * (2 * 0.05 - 2.5 * y)
    assert loop_area_n_m(0.05, values) == pytest.approx(large, rel=1e-3)
    for small in (0.001, 0.003):
        low, high = 0.0, 1.0
        for _ in range(60):  # z1 + ln(1 / (1 - z1)) = 2 a / y
            z1 = (low + high) / 2
            low, high = (z1, high) if z1 - np.log(1 - z1) < 2 * small / y else (low, z1)
        curved, _ = quad(lambda x: 1 - np.exp(-x / y), 0, 2 * small - z1 * y)
        assert loop_area_n_m(small, values) == pytest.approx(2 * force_n * (curved - z1**2 * y / 2), rel=1e-3)


@pytest.mark.parametrize("reversal", [-0.5, -4.0])
def test_the_loop_of_what_hardens_is_as_large_as_it_has_to_be(reversal: float) -> None:
    """n = 1. Each half way begins at -z1: back to 0 with 1 + (1 + h) |z|, h = -1 / r, then on to z1 with 1 + h z."""
    force_n, y, h, a = 120.0, 0.002, -1 / reversal, 0.0015
    values = effect("hysteresis", yield_force_n=force_n, yield_travel_m=y, reversal_ratio=reversal).p
    c = 1 + h
    z1 = brentq(lambda z: np.log1p(h * z) / h + np.log1p(c * z) / c - 2 * a / y, 0.0, 10.0)
    area = 2 * force_n * y * ((z1 / h - np.log1p(h * z1) / h**2) - (z1 / c - np.log1p(c * z1) / c**2))
    assert loop_area_n_m(a, values) == pytest.approx(area, rel=1e-3)


def test_no_friction_gives_energy() -> None:
    """Over any closed way the work of the force, less what is stored in its first stiffness, is a loss."""
    values = SimpleNamespace(**shipped_effects()["hysteresis"].usual | {"yield_force_n": 1.0, "yield_travel_m": 1.0})
    x = np.cumsum(np.random.default_rng(3).standard_normal(20000)) * 0.03
    for values.sharpness_ratio, values.reversal_ratio in ((0.5, 1.0), (1.0, 1.0), (4.0, 1.0), (1.0, 2.0)):
        z, lost = 0.0, [0.0]
        for step in np.diff(x):
            parts = max(1, int(abs(step) / 0.01))
            for _ in range(parts):
                way = step / parts
                dz = float(rates(values, Seen(0, way, 0, 0, 0, 0, 0, 0, 0, 0, (z,)))[0])
                lost.append(lost[-1] + (z + dz / 2) * (way - dz))
                z += dz
        assert abs(z) <= 1.01
        assert (np.diff(lost) >= -1e-4).all() and lost[-1] > 1.0


# --- laws of ones own ---

HEAD = """\
import numpy as np
from logger.vehicle.effect import ForceEffect, Parameter, Scale
from logger.vehicle.laws import Between


"""
CLASS = """


class Mine(ForceEffect):
    name = "mine"
    title = "mine"
    parameters = (Parameter("size", 1.0, 0.0, 1e6, 0.0, Scale.LINEAR, (1.0,), "how much"),)
    source = "mine"
    signature = "mine"
    shown_by = "drive"

    def laws(self, p, laws):
        return laws.with_law({arguments})


EFFECT = Mine()
"""


def own(folder: Path, functions: str, arguments: str, size: float = 2.0) -> Chosen:
    (folder / "mine.py").write_text(HEAD + functions + CLASS.format(arguments=arguments))
    return chosen(own_effect(folder / "mine.py"), {"size": size})


def test_a_law_sees_all_that_moves_and_where_and_when(tmp_path: Path, plain: np.ndarray) -> None:
    """All that it sees at once, between each pair of ends."""
    text = ("def pull(p, seen):\n    return (p.size * (2000 * seen.travel_m + 30 * seen.rate_mps * abs(seen.rate_mps)\n"
            "        + 1e3 * seen.deflection_m + 20 * seen.deflection_mps + 40 * seen.wheel_mps + 50 * seen.body_mps)\n"
            "        + 30 * np.sin(9 * seen.time_s) + 20 * np.sin(seen.distance_m) + seen.speed_mps)\n")

    def pull(t, x, v, d, d_mps, u_mps, z):
        return (2 * (2000 * x + 30 * v * abs(v) + 1e3 * d + 20 * d_mps + 40 * u_mps + 50 * (u_mps + v))
                + 30 * np.sin(9 * t) + 20 * np.sin(15.0 * t) + 15.0)

    for ends, on_body, on_wheel in (("BODY_AND_WHEEL", 1, -1), ("WHEEL_AND_GROUND", 0, 1), ("BODY_AND_GROUND", 1, 0)):
        def added(*seen, on_body=on_body, on_wheel=on_wheel):
            force_n = pull(*seen)
            return on_body * force_n, on_wheel * force_n, []

        states, _ = stepped(own(tmp_path, text, f"Between.{ends}, pull, p"), way=True)
        assert off(states, by_newton(added)[:, :4], plain) < 0.005, ends


def test_two_states_are_stepped_with_the_car(tmp_path: Path, plain: np.ndarray) -> None:
    """A mass in the suspension's oil: u' = w, w' = (v - w) a - b u, stiff enough to be seen."""
    text = ("def pull(p, seen):\n    return p.size * 100 * seen.memory[1]\n\n\n"
            "def grow(p, seen):\n    u, w = seen.memory\n    return w, 200 * (seen.rate_mps - w) - 3000 * u\n")

    def added(t, x, v, d, d_mps, u_mps, z):
        pull = 200 * z[1]
        return pull, -pull, [z[1], 200 * (v - z[1]) - 3000 * z[0]]

    states, _ = stepped(own(tmp_path, text, "Between.BODY_AND_WHEEL, pull, p, grow, memory=(0.0, 0.0)"))
    assert off(states, by_newton(added, 2)[:, :4], plain) < 0.005


def test_a_compiled_law_answers_as_it_is_written() -> None:
    values = effect("hysteresis", yield_force_n=7.0, yield_travel_m=0.02, sharpness_ratio=1.5).p
    law = MotionLaw(Between.BODY_AND_WHEEL, force, values, rates, (0.0,))
    felt = np.linspace(-0.4, 0.6, stepping_loop.FELT)
    seen = Seen(*felt[: stepping_loop.MEMORY_AT], (felt[stepping_loop.MEMORY_AT],))
    given = np.array([9.0, *stepping_loop.numbers_in_order(law)])
    numbers = namedtuple("numbers", sorted(vars(values)))
    addresses = stepping_loop.addresses_of(law)
    for address, function, expected in zip(addresses, (force, rates), (force(values, seen), *rates(values, seen)),
                                           strict=True):
        answers, written = np.zeros(stepping_loop.ANSWERS), np.zeros(stepping_loop.ANSWERS)
        stepping_loop.ask(address, given, 1, felt, answers)
        assert answers[0] == pytest.approx(expected, rel=1e-12)
        as_it_is = stepping_loop._plain(function, numbers, 1, function is rates)  # as it is asked without a compiler
        as_it_is(given[1:], felt, written)
        assert written == pytest.approx(answers, rel=1e-12)


SHARE, ARRAY = 1.5, np.array([1.0, 2.0])


def shared(p, seen):
    return SHARE * p.a * seen.rate_mps


def doubled(p, seen):
    return 2.0 * p.a * seen.rate_mps


def a(p, seen):  # what it asks of p is called as it is
    return 5.0 * p.a * seen.rate_mps


def thrice(p, seen):
    return 3.0 * p.a * seen.rate_mps


def of_array(p, seen):
    return ARRAY[1] * p.a * seen.rate_mps


def test_machine_code_is_kept_of_the_law_that_was_meant(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numba = pytest.importorskip("numba")
    from numba.core.bytecode import FunctionIdentity
    from numba.core.environment import Environment

    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    names, written = set(), {"__name__": "in_no_file"}
    exec("def law(p, seen):\n    return 4.0 * p.a * seen.rate_mps", written)

    def answer(law, number: str = "a") -> tuple[float, int]:
        """Of a process that asks this law first, and whether its code was there."""
        monkeypatch.setattr(FunctionIdentity, "_unique_ids", count(10**6))
        monkeypatch.setattr(Environment, "_memo", {})
        made = stepping_loop._machine_code(law, namedtuple("numbers", number), 0)
        names.add(made.native_name)
        answers = np.zeros(stepping_loop.ANSWERS)
        stepping_loop.ask(made.address, np.array([10.0]), 0, np.linspace(0, 1, stepping_loop.FELT), answers)
        return round(answers[0] * (stepping_loop.FELT - 1), 9), made.cache_hits

    assert [answer(law) for law in (doubled, thrice, shared, written["law"]) * 2] == [
        (20.0, 0), (30.0, 0), (15.0, 0), (40.0, 0), (20.0, 1), (30.0, 1), (15.0, 1), (40.0, 1)]
    assert len(names) == 4
    for kind in ("nbc", "nbi"):  # files that a loss of power has cut short
        for path in tmp_path.rglob(f"*.{kind}"):
            path.write_bytes(path.read_bytes()[:20])
        assert [answer(doubled) for _ in range(2)] == [(20.0, 0), (20.0, 1)]
    monkeypatch.setitem(globals(), "SHARE", 2.5)
    assert answer(shared) == (25.0, 0)
    assert [answer(a) for _ in range(2)] == [(50.0, 0), (50.0, 1)]
    assert [answer(of_array) for _ in range(2)] == [(20.0, 0)] * 2  # what it holds is not said by its text


def test_laws_that_differ_in_a_constant_alone_are_two(tmp_path: Path, plain: np.ndarray) -> None:
    def largest_n(slip_mps: float) -> float:
        functions = (f"SLIP_MPS = {slip_mps}\n"
                     "def rubs(p, seen):\n    return p.size * np.tanh(seen.rate_mps / SLIP_MPS)\n")
        return float(np.abs(stepped(own(tmp_path, functions, "Between.BODY_AND_WHEEL, rubs, p", 20.0))[1]).max())

    assert largest_n(0.001) == pytest.approx(20.0, rel=1e-3)
    assert largest_n(10.0) < 2.0


# --- in place of them, linear ones ---


def road(height: float) -> np.ndarray:
    return height**2 * 1e-6 * (N_CPM / 0.1) ** -2.0


def deviation(gain: np.ndarray, height: float) -> float:
    return sqrt(float(np.abs(gain) ** 2 @ (road(height) * N_CPM * np.log(N_CPM[1] / N_CPM[0]))))


def at(height: float, *effects: Chosen) -> LinearCar:
    return known_vehicle(RIG, effects).at(20.0, N_CPM, road(height))


def test_guides_have_the_slope_of_coulomb_friction() -> None:
    linear_car = at(2.0, effect("frame_friction", friction_force_n=30.0, body_friction_force_n=10.0))
    moves, s = linear_car.waves(N_CPM, 20.0), 2j * pi * N_CPM * 20.0
    corner = linear_car.corners[0]
    wheel_mps, body_mps = (deviation(s * one, 2.0) for one in (moves.height[:, 0], (moves.height + moves.travel)[:, 0]))
    assert corner.wheel_n_s_per_m == pytest.approx(sqrt(2 / pi) * 30.0 / wheel_mps, rel=0.25)
    assert corner.body_n_s_per_m == pytest.approx(sqrt(2 / pi) * 10.0 / body_mps, rel=0.25)


@pytest.mark.parametrize("height", [0.2, 1.0, 5.0])
def test_hysteresis_is_linearised_as_wen_has_it(height: float) -> None:
    """n = 1, A = 1 / y, both shapes 1 / (2 y): z' = c v - k z with c = A - sqrt(2 / pi) (E[v z] / sv + sz) / (2 y),
    k = sqrt(2 / pi) (sv + E[v z] / sz) / (2 y)."""
    y = 0.002
    linear_car = at(height, effect("hysteresis", yield_force_n=120.0, yield_travel_m=y))
    law = linear_car.corners[0].motions[0]
    moves, s = linear_car.waves(N_CPM, 20.0), 2j * pi * N_CPM * 20.0
    rate = moves.rate[:, 0]
    into, own_rate = float(law.into[0, 1]), float(-law.own[0, 0])
    z = rate * into / (s + own_rate)
    power = road(height) * N_CPM * np.log(N_CPM[1] / N_CPM[0])
    sv, sz, vz = deviation(rate, height), deviation(z, height), float((rate.conj() * z).real @ power)
    assert law.by == pytest.approx(0.0, abs=1e-6) and law.through == pytest.approx([120.0], rel=0.01)
    assert own_rate == pytest.approx(sqrt(2 / pi) * (sv + vz / sz) / (2 * y), rel=0.25)
    assert into == pytest.approx(1 / y - sqrt(2 / pi) * (vz / sv + sz) / (2 * y), rel=0.25, abs=20.0)


@pytest.mark.parametrize("one", [effect("hysteresis", yield_force_n=60.0, yield_travel_m=0.002),
                                 effect("maxwell_element", maxwell_stiffness_n_per_m=8e3, relaxation_time_s=0.1),
                                 effect("frame_friction", friction_force_n=20.0, body_friction_force_n=20.0)])
def test_a_linear_one_moves_as_the_simulation_does(one: Chosen) -> None:
    """On a random road of the spectrum: the body's r.m.s. speed, beside that of a car without it."""
    height, speed_mps, step_s, count = 4.0, 20.0, 1e-3, 2**16
    f_hz = np.fft.rfftfreq(count, step_s)[1:]
    n_cpm = f_hz / speed_mps
    inside = (n_cpm > N_CPM[0]) & (n_cpm < N_CPM[-1])
    psd = np.where(inside, height**2 * 1e-6 * (n_cpm / 0.1) ** -2.0, 0.0)
    turns = np.exp(2j * pi * np.random.default_rng(5).random(len(f_hz)))
    waves = np.sqrt(psd * (n_cpm[1] - n_cpm[0]) / 2) * turns * np.sinc(n_cpm * RIG.contact_patch_m)
    elevation = np.fft.irfft(np.concatenate([[0.0], waves]) * count, count)[:, None]
    found = []
    for effects in ([], [one]):
        car = compose(RIG, effects)
        did = march(car.structure, car.laws, elevation, (elevation[1:] + elevation[:-1]) / 2, step_s).states
        known = at(height, *effects, effect("tire_damping", tire_damping_n_s_per_m=1e-6))
        moves, s = known.waves(N_CPM, speed_mps), 2j * pi * N_CPM * speed_mps
        reported = deviation(s * (moves.height + moves.travel)[:, 0], height)
        found.append((float(did[5000:, 2].std()), reported))
    (plain, plain_reported), (with_it, reported) = found
    assert plain_reported == pytest.approx(plain, rel=0.05)
    assert abs(with_it / plain - 1) > 0.03
    assert reported == pytest.approx(with_it, rel=0.08)


def test_modes_ring_as_the_waves_do() -> None:
    """A root of the modes is one of the car's own equations."""
    car = at(1.0, effect("hysteresis", yield_force_n=200.0, yield_travel_m=0.002), effect("frame_friction"))
    for mode in modes_of_car(car):
        if mode.damping_ratio < 1:
            w, d = 2 * pi * mode.frequency_hz, mode.damping_ratio
            dynamic = car._dynamic(np.array([w * complex(-d, sqrt(1 - d * d))]))[0][0]
            assert abs(np.linalg.det(dynamic)) < 1e-6 * np.prod(np.abs(np.diag(dynamic)))


def test_a_law_of_place_or_time_has_no_stand_in(tmp_path: Path) -> None:
    text = "def push(p, seen):\n    return p.size * np.sin(seen.time_s) + 0.0 * seen.travel_m\n"
    with pytest.raises(ValueError, match="cannot be linearised"):
        known_vehicle(RIG, [own(tmp_path, text, "Between.BODY_AND_GROUND, push, p")])


def test_the_corners_of_a_half_car_take_them() -> None:
    car = read_vehicle(vehicle_file("rav4-2009"))
    known = known_vehicle(car, [effect("hysteresis"), effect("frame_friction")]).at(20.0, N_CPM, road(2.0))
    assert np.isfinite(known.by_wheel(np.array([0.0, 1.0, 11.0]))).all()
    assert replace(linear(1.0), wheel_friction_n=1.0).rubs


@pytest.mark.parametrize(("functions", "arguments", "words"), [
    ("def pull(p, seen):\n    return 3.0 / (p.size - 2)\n", "Between.BODY_AND_WHEEL, pull, p", ":7: ZeroDivisionError"),
    ("def pull(p, seen):\n    return seen.weel_mps\n", "Between.BODY_AND_WHEEL, pull, p", ":7: AttributeError: 'Seen'"),
    ("def pull(p, seen):\n    return np.log(-p.size)\n", "Between.BODY_AND_WHEEL, pull, p",
     "expected force to return finite numbers"),
    ("def pull(p, seen):\n    return eval('1.0')\n", "Between.BODY_AND_WHEEL, pull, p", "can be compiled: Untyped"),
    ("", "Between.BODY_AND_WHEEL, lambda p, seen: self.size, p", "that gets its parameters by p alone"),
    ("", "Between.BODY_AND_WHEEL, lambda p: 1.0, p", "expected force to be a function of (p, seen)"),
    ("def pull(p, seen):\n    return 1.0\n", "'wheel', pull, p", "expected with_law to get one of Between.BODY_AND_WH"),
    ("def pull(p, seen):\n    return 1.0\n", "Between.BODY_AND_WHEEL, pull, p, memory=(0.0,)",
     "expected rates and memory both, or neither"),
    ("def pull(p, seen):\n    return 1.0\n", "Between.BODY_AND_WHEEL, pull, p, pull, (0.0,) * 5",
     "a tuple of at most 4 finite numbers"),
    ("def pull(p, seen):\n    return 1.0\n", "Between.BODY_AND_WHEEL, pull, p, pull, (0.0,)",
     "rates to return a tuple of 1, one number for each state, as in (rate,), found 1.0"),
])
def test_a_law_that_will_not_do_is_refused_with_its_file(tmp_path: Path, functions: str, arguments: str, words: str,
                                                         ) -> None:
    one = own(tmp_path, functions, arguments)
    with pytest.raises(BadInput) as caught:
        compose(RIG, [one])
    assert words in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "mine.py"))


@pytest.mark.slow
def test_the_examples_of_the_page_do_as_they_say(tmp_path: Path) -> None:
    """Friction of a wheel on rails; and rubber that creeps, which at last lets everything go."""
    page = (Path(__file__).parents[2] / "docs" / "own-effect.md").read_text("utf-8")
    rails, creep = (text.split("```")[0] for text in page.split("```python\n")[3:5])
    functions = rails.split("\n\nclass")[0] + creep.split("\n\n\n    def")[0] + "\n"
    functions = functions.replace("p.friction_force_n", "p.size").replace("p.stiffness_n_per_m", "p.size")
    functions = functions.replace("p.creep_s", "0.1")
    rubbing, _ = stepped(own(tmp_path, functions, "Between.WHEEL_AND_GROUND, rubs, p", 30.0))
    like, _ = stepped(effect("frame_friction", friction_force_n=30.0, transition_velocity_m_per_s=0.02))
    assert np.sqrt(np.mean((rubbing - like)[:, 3] ** 2)) < 0.002 * np.sqrt(np.mean(like[:, 3] ** 2))
    one = own(tmp_path, functions, "Between.BODY_AND_WHEEL, pulls, p, creeps, memory=(0.0,)", 5e4)
    car = compose(RIG, [one])
    raised = np.where(np.arange(8000) < 10, 0.0, 0.01)[:, None]
    did = march(car.structure, car.laws, raised, (raised[1:] + raised[:-1]) / 2, 1e-3)
    assert np.abs(did.forces[:1000]).max() > 50.0
    assert did.forces[-1] == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("sharpness", [0.5, 4.0, 100.0, 1000.0])
def test_a_sharp_force_limit_leaves_small_forces_as_they_are(sharpness: float) -> None:
    one = effect("force_limit", limit_n=20.0, sharpness_ratio=sharpness)
    pushes = np.array([[-1e-6, 0.0, 2.0], [-1e5, 1e6, 1e9]])
    small, large = one.effect.force(SimpleNamespace(**one.values), 100.0, pushes)
    assert large == pytest.approx([-20.0, 20.0, 20.0])
    if sharpness > 1:
        assert small == pytest.approx(pushes[0], rel=1e-4)
    assert np.abs(small / 20) ** sharpness == pytest.approx(np.tanh(np.array([5e-8, 0.0, 0.1]) ** sharpness))


def test_which_a_search_tries_unasked() -> None:
    model = CarModel(RIG, ())
    assert {"hysteresis", "frame_friction"}.isdisjoint(known_effects(model, [])[0])
    assert known_effects(model, [], on_rig=True)[0].keys() - known_effects(model, [])[0] == {
        "constant_force", "force_gain", "force_limit", "frame_damping", "frame_friction", "frame_spring",
        "air_spring", "orifice_damping", "play", "slack_spring", "maxwell_element"}
    assert known_effects(model, ["hysteresis"])[0].keys() - known_effects(model, [])[0] == {"hysteresis"}
    assert sought_effects(True, of_part=True).keys() - sought_effects(True) == {"hysteresis"}
    with pytest.raises(BadInput, match="each effect once, found dry_friction again"):
        known_effects(model, ["dry_friction"])
    assert among(known_effects(model, [])[0], ["hysteresis", "dry_friction"]).keys() == {"dry_friction", "hysteresis"}
    with pytest.raises(BadInput, match="no effect 'stiction'"):
        among({}, ["stiction"])


def test_the_loop_says_how_long_its_arrays_are() -> None:
    """Machine code is kept by the loop's text alone: with other lengths the text has to be another, too."""
    assert f"feel: {stepping_loop.FELT}." in Path(stepping_loop.__file__).read_text("utf-8")
