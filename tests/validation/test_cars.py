"""The examiner's cars against closed forms: impedance, energy, statics, Coulomb's decay, free fall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from .simulator.cars import GRAVITY_MPS2, Axle, Car, Physics, assemble, integrate, ride
from .simulator.corner_laws import INNER, damper_force, damper_rate_of

pytestmark = pytest.mark.slow  # the examination's own car is tried before an examination

CAR = Car("half_car", 650.0, 1000.0, Axle(1.2, 45.0, 24_000.0, 1500.0, 210_000.0),
          Axle(1.5, 40.0, 21_000.0, 1350.0, 190_000.0), 0.2)
QUARTER = Car("quarter_car", 320.0, np.inf, replace(CAR.front, cg_distance_m=0.0), None, 0.2)
STEP_S = 1 / 4000
HEAVE, PITCH = 0, 1


def dynamic_stiffness(car: Car, extra: Physics, omega: float) -> tuple[np.ndarray, np.ndarray]:
    """Z(omega) and the road's columns, energy by energy: heave, pitch, seat, trailer, wheels."""
    s = 1j * omega
    axles = [car.front] + ([car.rear] if car.rear else [])
    ahead = [0.0]
    if car.rear:
        ahead = [car.front.cg_distance_m - extra.cg_shift_m, -car.rear.cg_distance_m - extra.cg_shift_m]
    count = len(axles)
    size = 4 + 2 * count
    mass = [car.sprung_mass_kg + extra.payload_kg, car.pitch_inertia_kg_m2 if car.rear else 1.0,
            extra.seat_mass_kg or 1.0, extra.tow_mass_kg or 1.0] + [axle.unsprung_mass_kg for axle in axles] + [
                extra.absorber_kg or 1.0] * count
    z = np.diag(np.array(mass) * s**2)
    roads = np.zeros((size, len(axles)), complex)

    def link(spring: complex, places: dict[int, float]) -> None:
        b = np.zeros(size)
        for place, value in places.items():
            b[place] = value
        z[:] += spring * np.outer(b, b)

    for i, (axle, x) in enumerate(zip(axles, ahead, strict=True)):
        damper = s * axle.suspension_damping_n_s_per_m
        if extra.mount:
            damper = damper * extra.mount / (damper + extra.mount)
        rubber = extra.rubber * s * extra.rubber_s / (1 + s * extra.rubber_s)
        inerter = extra.inertance_kg * s**2 + extra.inerter_damper * s
        if inerter:
            inerter = inerter * extra.inerter_spring / (inerter + extra.inerter_spring)
        link(axle.suspension_stiffness_n_per_m + damper + rubber + inerter, {0: -1.0, 1: -x, 4 + i: 1.0})
        own = 2 * np.pi * extra.absorber_hz
        link(extra.absorber_kg * (own**2 + 2 * extra.absorber_zeta * own * s), {4 + i: -1.0, 4 + count + i: 1.0})
        tire = axle.tire_stiffness_n_per_m + s * extra.tire_damping
        link(tire, {4 + i: 1.0})
        roads[4 + i, i] = tire
    behind = ahead[-1] - extra.tow_behind_axle_m
    for place, kg, hz, zeta, x in ((2, extra.seat_mass_kg, extra.seat_hz, extra.seat_zeta, 0.0),
                                   (3, extra.tow_mass_kg, extra.tow_hz, extra.tow_zeta, behind)):
        own = 2 * np.pi * hz
        link(kg * (own**2 + 2 * zeta * own * s), {0: -1.0, 1: -x, place: 1.0})
    return z, roads


EXTRAS = {
    "bare": Physics(),
    "tire_damping": Physics(tire_damping=300.0),
    "mount": Physics(mount=60_000.0),
    "rubber": Physics(rubber=9000.0, rubber_s=0.1),
    "seat": Physics(seat_mass_kg=70.0, seat_hz=4.0, seat_zeta=0.25),
    "payload, shift": Physics(payload_kg=90.0, cg_shift_m=0.2),
    "inerter": Physics(inertance_kg=20.0, inerter_spring=2e5, inerter_damper=250.0),
    "absorber": Physics(absorber_kg=8.0, absorber_hz=12.0, absorber_zeta=0.1),
    "trailer": Physics(tow_mass_kg=80.0, tow_hz=3.0, tow_zeta=0.15, tow_behind_axle_m=0.8),
}


@pytest.mark.parametrize("hz", [1.3, 4.0, 11.0])
@pytest.mark.parametrize("name", EXTRAS)
@pytest.mark.parametrize("car", [CAR, QUARTER], ids=["half", "quarter"])
def test_steady_sine_is_what_the_impedances_say(car: Car, name: str, hz: float) -> None:
    extra, omega = EXTRAS[name], 2 * np.pi * hz
    if name == "trailer" and car is QUARTER:
        extra = replace(extra, tow_behind_axle_m=0.0)
    ready = assemble(car, extra)
    height = np.array([0.004, 0.004 * np.exp(-0.9j)])[: ready.corners.size]
    at = np.arange(round(8 / STEP_S) * 2 + 1) * 0.5 * STEP_S
    wave = np.exp(1j * omega * at)[:, None] * height
    rates, _ = ride(ready, wave.imag, (1j * omega * wave).imag, STEP_S)
    z, roads = dynamic_stiffness(car, extra, omega)
    expected = 1j * omega * np.linalg.solve(z, roads @ height)
    t = np.arange(rates.shape[0]) * STEP_S
    tail = slice(round(7 / STEP_S), None)
    for column, place in ((0, 0), (1, 1)):
        steady = (expected[place] * np.exp(1j * omega * t[tail])).imag
        assert np.abs(rates[tail, column] - steady).max() < 2e-4 * abs(expected[0]) + 1e-9


def test_bending_answers_the_sum_of_the_suspension_forces() -> None:
    extra = Physics(bend_hz=22.0, bend_zeta=0.05, bend_gain=-0.3)
    ready, omega = assemble(CAR, extra), 2 * np.pi * 9.0
    at = np.arange(16 / STEP_S * 2 + 1) * 0.5 * STEP_S
    wave = 0.003 * np.exp(1j * omega * at)[:, None] * np.ones(2)
    rates, _ = ride(ready, wave.imag, (1j * omega * wave).imag, STEP_S)
    z, roads = dynamic_stiffness(CAR, extra, omega)
    heave = np.linalg.solve(z, roads @ np.full(2, 0.003))[0]
    own = 2 * np.pi * 22.0
    # No other force acts on the body: their sum is mass times acceleration.
    bent = -0.3 * -(omega**2) * heave / (own**2 - omega**2 + 2j * 0.05 * own * omega)
    t = np.arange(rates.shape[0]) * STEP_S
    steady = (1j * omega * bent * np.exp(1j * omega * t)).imag
    assert np.abs(rates[-8000:, 2] - steady[-8000:]).max() < 1e-3 * omega * abs(bent)


def test_full_car_on_two_tracks_heaves_as_a_half_car_on_their_mean() -> None:
    rng = np.random.default_rng(1)
    at = np.arange(2 * 12_000 + 1) * 0.5 * STEP_S
    waves = rng.uniform(0.5, 15, (2, 6))
    left, right = (sum(0.002 * np.sin(2 * np.pi * hz * at) for hz in track) for track in waves)
    left_rate, right_rate = (sum(0.004 * np.pi * hz * np.cos(2 * np.pi * hz * at) for hz in track) for track in waves)
    extra = Physics(payload_kg=40.0, seat_mass_kg=60.0, seat_hz=4.0, seat_zeta=0.3)
    full = assemble(CAR, replace(extra, track_m=1.5, roll_inertia_kg_m2=600.0))
    assert list(full.on_right) == [False, True, False, True]
    assert list(full.behind_front_m) == [0, 0, 2.7, 2.7]
    both, both_rate = np.column_stack([left, right] * 2), np.column_stack([left_rate, right_rate] * 2)
    four, _ = ride(full, both, both_rate, STEP_S)
    mean, mean_rate = 0.5 * (left + right), 0.5 * (left_rate + right_rate)
    two, _ = ride(assemble(CAR, extra), np.column_stack([mean] * 2), np.column_stack([mean_rate] * 2), STEP_S)
    assert np.abs(four - two).max() < 1e-9 * np.abs(two).max() + 1e-12


def released(car: Car, extra: Physics, lift_m: float, turn: float, seconds: float, step_s: float = STEP_S):
    """States after the body is let go from above its rest; the road is flat."""
    ready = assemble(car, extra)
    n = ready.corners.size
    first = np.zeros(2 * (6 + n) + INNER * n)
    first[HEAVE], first[PITCH] = lift_m, turn
    first[2 * (6 + n):2 * (6 + n) + n] = -lift_m - turn * ready.corners["ahead"]  # the mounts are at ease
    steps = round(seconds / step_s)
    flat = np.zeros((2 * steps + 1, n))
    return ready, integrate(ready.body, ready.corners, flat, flat, step_s, ready.sticks, first, True, np.ones(steps))[1]


def energy(states: np.ndarray, extra: Physics) -> np.ndarray:
    """Kinetic and elastic energy of CAR [J]."""
    q, v = states[:, :8], states[:, 8:16]
    total = 0.5 * CAR.sprung_mass_kg * v[:, 0] ** 2 + 0.5 * CAR.pitch_inertia_kg_m2 * v[:, 1] ** 2
    for i, (axle, x) in enumerate(((CAR.front, 1.2), (CAR.rear, -1.5))):
        travel = q[:, 6 + i] - q[:, 0] - x * q[:, 1]
        total += 0.5 * axle.unsprung_mass_kg * v[:, 6 + i] ** 2
        total += 0.5 * axle.suspension_stiffness_n_per_m * travel**2 + 0.25 * extra.cubic * travel**4
        total += 0.5 * extra.stop * np.maximum(travel - extra.clearance_m, 0) ** 2
        total += 0.5 * axle.tire_stiffness_n_per_m * q[:, 6 + i] ** 2 + 0.25 * extra.tire_cubic * q[:, 6 + i] ** 4
    return total


def undamped() -> Car:
    return replace(CAR, front=replace(CAR.front, suspension_damping_n_s_per_m=0.0),
                   rear=replace(CAR.rear, suspension_damping_n_s_per_m=0.0))


def test_springs_of_every_shape_keep_the_energy() -> None:
    extra = Physics(cubic=6e6, clearance_m=0.02, stop=1e5, tire_cubic=1e9)
    _, states = released(undamped(), extra, -0.05, 0.01, 5.0)
    total = energy(states, extra)
    assert np.abs(total / total[0] - 1).max() < 1e-4


@pytest.mark.parametrize(("extra", "force"), [
    (Physics(), lambda v, c: c * v),
    (Physics(rebound_to_bump=3.0), lambda v, c: np.where(v > 0, 0.5, 1.5) * c * v),
    (Physics(knee_mps=0.1, slope_ratio=0.3),
     lambda v, c: c * np.sign(v) * np.where(abs(v) < 0.1, abs(v), 0.1 + 0.3 * (abs(v) - 0.1))),
    (Physics(damper_square=2000.0), lambda v, c: c * v + 2000 * v * abs(v)),
    (Physics(friction_front_n=90.0, friction_rear_n=90.0, friction_law="tanh"),
     lambda v, c: c * v + 90 * np.tanh(v / 0.002)),
    (Physics(friction_front_n=90.0, friction_rear_n=90.0), lambda v, c: c * v + 90 * np.sign(v)),
], ids=["linear", "asymmetry", "blow-off", "square", "tanh", "stick"])
def test_dampers_take_what_the_body_loses(extra: Physics, force) -> None:
    _, states = released(CAR, extra, 0.06, -0.01, 1.0)
    lost = np.zeros(states.shape[0])
    for i, (axle, x) in enumerate(((CAR.front, 1.2), (CAR.rear, -1.5))):
        v = states[:, 14 + i] - states[:, 8] - x * states[:, 9]
        lost += force(v, axle.suspension_damping_n_s_per_m) * v
    spent = np.concatenate([[0], np.cumsum(0.5 * (lost[1:] + lost[:-1])) * STEP_S])
    total = energy(states, extra)
    assert np.abs(total + spent - total[0]).max() < 2e-3 * total[0]


def test_every_damper_knows_its_inverse() -> None:
    for v in (-0.7, -0.05, 0.0, 0.03, 0.9):
        force = damper_force(v, 1000.0, 2200.0, 0.1, 0.4)
        assert damper_rate_of(force, 1000.0, 2200.0, 0.1, 0.4) == pytest.approx(v)
    assert damper_force(0.2, 1000.0, 2200.0, 0.1, 0.4) == pytest.approx(1000 * 0.14)
    assert damper_force(-0.05, 1000.0, 2200.0, 0.1, 0.4) == pytest.approx(-110)


def test_a_stiff_mount_is_none_and_a_soft_one_frees_the_damper() -> None:
    _, bare = released(CAR, Physics(), 0.05, 0.0, 1.0)
    _, stiff = released(CAR, Physics(mount=3e6), 0.05, 0.0, 1.0)
    _, soft = released(CAR, Physics(mount=1.0), 0.05, 0.0, 1.0)
    _, free = released(undamped(), Physics(), 0.05, 0.0, 1.0)
    assert np.abs(stiff[:, 0] - bare[:, 0]).max() < 5e-4
    assert np.abs(soft[:, 0] - free[:, 0]).max() < 5e-4


def test_coulomb_takes_four_times_force_over_stiffness_a_cycle_and_then_sticks() -> None:
    anvil = replace(QUARTER, front=Axle(0.0, 1e9, 20_000.0, 0.0, 1e3))
    _, states = released(anvil, Physics(friction_front_n=100.0), 0.05, 0.0, 8.0)
    z = states[:, 0]
    peaks = z[1:-1][(z[1:-1] > z[:-2]) & (z[1:-1] >= z[2:]) & (z[1:-1] > 0.006)]
    expected = 0.05 - 0.02 * np.arange(1, peaks.size + 1)
    assert peaks.size == 2
    assert np.abs(peaks - expected).max() < 2e-5
    assert abs(z[-1]) <= 0.005 + 1e-6
    assert np.abs(np.diff(z[-8000:])).max() < 1e-9


def test_both_frictions_agree_where_slip_is_fast() -> None:
    stick = Physics(friction_front_n=120.0, friction_rear_n=120.0)
    _, one = released(CAR, stick, 0.06, 0.0, 0.6)
    _, other = released(CAR, replace(stick, friction_law="tanh"), 0.06, 0.0, 0.6)
    assert np.abs(one[:, 0] - other[:, 0]).max() < 4e-4


def test_the_hysteresis_of_a_bushing_saturates() -> None:
    _, states = released(CAR, Physics(bushing=20_000.0, bushing_yield_m=0.003), 0.08, 0.0, 1.0)
    bent = states[:, 16 + 4:16 + 6]
    assert 0.0028 < np.abs(bent).max() <= 0.003 + 1e-9


@pytest.mark.parametrize("extra", [
    Physics(wheel_lift=True), Physics(wheel_lift=True, payload_kg=100.0, cg_shift_m=0.3),
    Physics(wheel_lift=True, track_m=1.4, roll_inertia_kg_m2=500.0, tow_mass_kg=50.0, tow_behind_axle_m=0.7),
])
def test_static_loads_carry_the_weight_without_a_moment(extra: Physics) -> None:
    ready = assemble(CAR, extra)
    body, corners = ready.body, ready.corners
    weight = body["mass"] + body["tow_mass"] + corners["mass"].sum()
    assert corners["load"].sum() == pytest.approx(weight * GRAVITY_MPS2)
    sprung = corners["load"] - corners["mass"] * GRAVITY_MPS2
    moment = GRAVITY_MPS2 * body["tow_mass"] * body["tow_ahead"]
    assert (sprung * corners["ahead"]).sum() == pytest.approx(moment, abs=1e-6)


def test_a_car_over_a_cliff_falls_freely() -> None:
    ready = assemble(CAR, Physics(wheel_lift=True))
    road = np.full((2 * 1200 + 1, 2), -3.0)
    first = np.zeros(2 * 8 + INNER * 2)
    _, states = integrate(ready.body, ready.corners, road, np.zeros_like(road), STEP_S, False, first, True,
                          np.ones(1200))
    masses = np.array([CAR.sprung_mass_kg, CAR.front.unsprung_mass_kg, CAR.rear.unsprung_mass_kg])
    centre = states[:, [0, 6, 7]] @ masses / masses.sum()
    t = np.arange(centre.size) * STEP_S
    assert np.abs(centre + 0.5 * GRAVITY_MPS2 * t**2).max() < 1e-9


def test_a_standing_car_stays_where_it_starts_on_a_slope() -> None:
    ready = assemble(CAR, EXTRAS["trailer"])
    road = np.tile([0.3, 0.57], (2001, 1))
    rates, states = ride(ready, road, np.zeros_like(road), STEP_S, keep=True)
    assert np.abs(rates).max() < 1e-9
    assert states[-1, 0] == pytest.approx(0.3 + 0.27 * 1.2 / 2.7)


@pytest.mark.parametrize("extra", [
    Physics(), Physics(cubic=5e6, mount=2e5, tire_damping=200.0, bend_hz=25.0, bend_gain=0.2)])
def test_errors_fall_sixteenfold_with_half_the_step(extra: Physics) -> None:
    def end(step_s: float) -> np.ndarray:
        return released(CAR, extra, 0.04, 0.01, 0.4, step_s)[1][-1, :8]

    exact = end(1 / 16_000)
    coarse, fine = (np.abs(end(1 / hz) - exact).max() for hz in (500, 1000))
    assert 12 < coarse / fine < 32
    assert np.abs(end(STEP_S) - exact).max() < 1e-8
