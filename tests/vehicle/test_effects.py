"""Laws that every file in ``effects/`` keeps: a newcomer is tried by them at once."""

from __future__ import annotations

from contextlib import nullcontext
from copy import deepcopy
from dataclasses import fields, replace
from itertools import permutations, product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfreqz

from logger.errors import BadInput
from logger.profiles.track import Track
from logger.report.quantities import unit_of
from logger.roads import iso8608
from logger.shipped import vehicle_file
from logger.store.formats.effect_file import check_on, shipped_effects
from logger.store.formats.vehicle_file import read_vehicle
from logger.vehicle import effects
from logger.vehicle.compose import compose, recorded
from logger.vehicle.effect import AXLE, BodyEffect, Chosen, Effect, ForceEffect, Misalignment, Scale, chosen
from logger.vehicle.laws import CornerLaws, linear
from logger.vehicle.own_effect import look_through, try_out, watched
from logger.vehicle.simulate import Passage
from logger.vehicle.vehicle import Vehicle

EFFECTS = shipped_effects()
LONGEST_UNIT = 3
"""Letters of a unit's symbol: a name whose last word is as short has to end in a unit that people can be shown."""
HALF = read_vehicle(vehicle_file("rav4-2009"))
QUARTER = Vehicle("one", "quarter_car", 430.0, None, replace(HALF.front, cg_distance_m=0.0), None, 0.25)
CARS = {"quarter": QUARTER, "half": HALF, "full": read_vehicle(vehicle_file("rav4-2009-full"))}
LEFT, RIGHT = (iso8608.generate(256, 60, 0.05, seed) for seed in (3, 4))
ROAD = Track(0.05, np.stack([LEFT, RIGHT], axis=1))
DISTANCE_M = 2.0 + 15.0 * np.arange(250) / 100
HUGE = 1e13


def usual(effect: Effect, **values: float) -> Chosen:
    """With what is not given at its start, or at its default."""
    return Chosen(effect, effect.usual | values)


def record(car: Vehicle, *effects: Chosen) -> np.ndarray:
    made = compose(car, effects)
    return recorded(made, Passage(ROAD, 100.0, made.driven(DISTANCE_M)))


def obstacle(name: str, model: str) -> str | None:
    return EFFECTS[name].obstacle_on(CARS[model], two_tracks=True, timed=False, pushed=False)


WHERE = [(name, model) for name, model in product(EFFECTS, CARS) if obstacle(name, model) is None]


@pytest.mark.parametrize("name", EFFECTS)
def test_it_says_what_it_is(name: str) -> None:
    effect = look_through(EFFECTS[name])
    assert len(effect.signature.split()) >= 6
    assert len(effect.shown_by.split()) >= 5
    assert len(effect.source.split()) >= 4
    for one in effect.parameters:
        assert unit_of(one.name) or len(one.name.split("_")[-1]) > LONGEST_UNIT
        assert one.null is None or one.low <= one.null <= one.high or one.null == np.inf
        assert one.null != np.inf or one.scale is Scale.RECIPROCAL
        assert one.start != one.null
        assert one.null not in one.trials
    for values in effect.trials():
        assert effect.checked(values) == values
    # What has no null is a switch, a number of the car itself, or needs what not all roads have.
    of_the_car = {one.name for one in fields(Vehicle)}
    assert (not effect.parameters or any(one.null is not None for one in effect.parameters)
            or {one.name for one in effect.parameters} & of_the_car or effect.obstacle(HALF, two_tracks=False))


def test_those_of_the_format_are_there() -> None:
    files = [path.stem for path in Path(str(effects.__file__)).parent.glob("*.py")]
    assert list(EFFECTS) == sorted(name for name in files if not name.startswith("_"))
    parameters = {name: [one.name for one in effect.parameters] for name, effect in EFFECTS.items()}
    assert parameters["wheel_lift"] == []
    assert parameters["dry_friction"] == [
        "friction_force_n", "transition_velocity_m_per_s", "static_to_sliding_ratio", "stribeck_velocity_m_per_s",
        "axle"]
    assert parameters["body_bending"] == ["frequency_hz", "damping_ratio", "participation", "ends_move"]
    assert parameters["sensor_bandwidth"] == ["cutoff_hz", "order", "sampled_hz"]


@pytest.mark.parametrize(("name", "model"), WHERE)
def test_at_its_null_it_is_absent(name: str, model: str) -> None:
    effect, plain = EFFECTS[name], record(CARS[model])
    for one in effect.parameters:
        if one.null is not None:
            null = HUGE if one.null == np.inf else one.null
            assert record(CARS[model], usual(effect, **{one.name: null})) == pytest.approx(plain, abs=1e-6)


def test_a_contact_patch_as_it_was_changes_nothing() -> None:
    same = usual(EFFECTS["tire_enveloping"], contact_patch_m=HALF.contact_patch_m)
    assert np.array_equal(record(HALF, same), record(HALF))


@pytest.mark.parametrize(("name", "model"), [
    one if one[1] == "half" else pytest.param(*one, marks=pytest.mark.slow) for one in WHERE])
def test_it_is_finite_over_its_bounds_and_there(name: str, model: str) -> None:
    effect, plain, most = EFFECTS[name], record(CARS[model]), 0.0
    ends = [one.choices or (one.low, one.start, one.high) for one in effect.parameters]
    # No spring softens in two ways at once.
    of_plain = [one.name not in effect.refinements for one in effect.parameters]
    corners = [values for side in (True, False) for values in product(*(
        some if plain is side else (effect.usual[one.name] if one.default is not None else one.start,)
        for one, some, plain in zip(effect.parameters, ends, of_plain, strict=True)))]
    for values in corners:
        found = record(CARS[model], chosen(effect, dict(zip([one.name for one in effect.parameters], values,
                                                            strict=True))))
        assert np.isfinite(found).all()
        assert np.abs(found).max() < 1e4
        most = max(most, float(np.abs(found - plain).max()))
    assert most > 1e-4 or not effect.parameters  # a switch shows on other roads only


def test_it_says_where_it_cannot_be() -> None:
    refused = {(name, model) for name, model in product(EFFECTS, CARS) if obstacle(name, model)}
    assert refused >= {("cg_shift", "quarter"), ("sensor_offset", "quarter"), ("roll", "quarter"), ("roll", "full")}
    assert all(len(str(obstacle(name, model)).split()) > 3 for name, model in refused)
    assert "elevation_right_m" in str(EFFECTS["roll"].obstacle(HALF, two_tracks=False))


FORCES = [name for name, effect in EFFECTS.items() if isinstance(effect, ForceEffect)]


def work_n_m(laws: CornerLaws, amplitude_m: float, omega: float) -> tuple[float, float]:
    """What suspension and tire take in over one closed round of each, beyond their linear springs [N m]."""
    phase = np.linspace(0, 2 * np.pi, 20_001)
    x, v = amplitude_m * np.sin(phase), amplitude_m * omega * np.cos(phase)
    force = laws.damper(v) + laws.dry_friction_n * np.sign(v)
    force = force + sum(law(x) for law in laws.springs) + sum(law(x, v) for law in laws.others)
    tire = laws.tire_damping_n_s_per_m * v + sum((law(x) for law in laws.tires), np.zeros_like(x))
    return float(np.trapezoid(force, x)), float(np.trapezoid(tire, x))


@pytest.mark.parametrize("name", FORCES)
@given(st.floats(1e-3, 0.1), st.floats(1.0, 100.0), st.randoms(use_true_random=False))
@settings(max_examples=25)
def test_no_force_gives_energy_over_a_closed_round(name: str, amplitude_m: float, omega: float, random) -> None:
    effect = EFFECTS[name]
    values = {one.name: one.value(random.uniform(*sorted(map(one.coordinate, (one.low, one.high)))))
              for one in effect.parameters if not one.choices}
    laws = effect.laws(chosen(effect, values).p, linear(1500.0))
    suspension, tire = work_n_m(laws, amplitude_m, omega)
    scale = amplitude_m * (1500.0 * amplitude_m * omega + sum(np.abs(law(np.array([amplitude_m, -amplitude_m]))).max()
                                                              for law in laws.springs))
    assert suspension >= -1e-6 * scale
    assert tire >= -1e-6 * scale


@pytest.mark.parametrize("name", [name for name in FORCES if AXLE in EFFECTS[name].parameters])
def test_an_effect_of_suspensions_may_sit_in_those_of_one_axle_alone(name: str) -> None:
    both, front, rear, none = (compose(HALF, effects).laws for effects in (
        *([usual(EFFECTS[name], axle=axle)] for axle in AXLE.choices), []))

    def works_n_m(laws: CornerLaws) -> list[float]:
        return [work_n_m(laws, 0.03, 8.0)[0], float(laws.damper(np.array([1.0]))[0]), laws.mount_n_per_m,
                sum(float(law(np.array([-0.06]))[0]) for law in laws.springs), float(len(laws.motions))]

    assert works_n_m(front[0]) == works_n_m(both[0]) != works_n_m(none[0]) == works_n_m(rear[0])
    assert works_n_m(rear[1]) == works_n_m(both[1]) != works_n_m(none[1]) == works_n_m(front[1])


def test_a_car_of_one_axle_has_no_other() -> None:
    with pytest.raises(BadInput, match="dry_friction: expected axle 0, as a quarter car has only one"):
        check_on(QUARTER, usual(EFFECTS["dry_friction"], axle=2.0), two_tracks=False)


@pytest.mark.parametrize("name", FORCES)
def test_a_car_that_is_let_be_never_shakes_more(name: str) -> None:
    """After the last wave the motion dies away, or, where friction locks a suspension, goes on upon the tires."""
    bump = Track(0.05, np.concatenate([0.05 * np.sin(np.linspace(0, np.pi, 40)), np.zeros(2000)]))
    for model, car in CARS.items():
        for value in {one.high for one in EFFECTS[name].parameters[:1]} or {0.0}:
            values = {EFFECTS[name].parameters[0].name: value} if EFFECTS[name].parameters else {}
            made = compose(car, [usual(EFFECTS[name], **values)])
            found = recorded(made, Passage(bump, 100.0, 10.0 * np.arange(1000) / 100))
            share = np.abs(found[-100:]).max() / np.abs(found[150:350]).max()
            assert share < (1.001 if name in ("dry_friction", "hysteresis") else 0.1), (model, value)


@pytest.mark.parametrize("name", EFFECTS)
def test_it_answers_in_the_shape_it_is_asked(name: str) -> None:
    for model, car in CARS.items():
        if obstacle(name, model) is None:
            try_out(watched(EFFECTS[name], nullcontext), usual(EFFECTS[name]).p, car)


def test_the_order_in_which_effects_are_named_does_not_matter() -> None:
    everything = [usual(effect) for effect in EFFECTS.values()]
    expected = record(HALF, *everything)
    for seed in range(3):
        shuffled = np.random.default_rng(seed).permutation(len(everything))
        assert np.array_equal(record(HALF, *(everything[i] for i in shuffled)), expected)
    dampers = [usual(EFFECTS[name]) for name in ("damper_asymmetry", "damper_blow_off", "top_mount_compliance")]
    first, *others = [record(HALF, *some) for some in permutations(dampers)]
    assert all(np.array_equal(other, first) for other in others)


def test_nothing_is_changed_in_place() -> None:
    before = record(HALF)
    for effect in EFFECTS.values():
        record(HALF, usual(effect))
        structure = compose(HALF).structure
        if isinstance(effect, BodyEffect):
            was = deepcopy(structure)
            effect.structure(usual(effect).p, structure)
            changed = [one.name for one in fields(structure)
                       if not np.array_equal(getattr(structure, one.name), getattr(was, one.name))]
            assert not changed, f"{effect.name} changed {', '.join(changed)} in place"
    assert np.array_equal(record(HALF), before)


# --- what single effects do, from the words of the format ---


def test_an_asymmetric_damper_keeps_its_mean_and_a_digressive_one_its_slope_before_the_knee() -> None:
    asymmetry = EFFECTS["damper_asymmetry"].laws(usual(EFFECTS["damper_asymmetry"], rebound_to_bump_ratio=3.0).p,
                                                 linear(1000.0))
    up, down = asymmetry.damper(np.array([0.2, -0.2]))
    assert (up, down) == pytest.approx((300.0, -100.0))
    values = {"knee_velocity_m_per_s": 0.1, "slope_ratio": 0.25}
    digressive = EFFECTS["damper_blow_off"].laws(usual(EFFECTS["damper_blow_off"], **values).p, linear(1000.0))
    assert digressive.damper(np.array([0.05, -0.1, 0.3, -0.3])) == pytest.approx([50, -100, 150, -150])
    rates = np.array([0.0, 0.05, -0.1, 0.3, -0.3])
    for roundness, inner in ((1.0, rates / (1 + np.abs(rates) / 0.1)), (0.5, rates / np.hypot(1, rates / 0.1))):
        of_part = EFFECTS["damper_blow_off"].variants["component"]
        hyperbolic = of_part.laws(usual(of_part, **values, knee_roundness_ratio=roundness).p, linear(1000.0))
        assert hyperbolic.damper(rates) == pytest.approx(1000 * (0.25 * rates + 0.75 * inner))
    values |= {"rebound_to_bump_knee_ratio": 0.25, "rebound_to_bump_slope_ratio": 4.0}
    by_direction = EFFECTS["damper_blow_off"].laws(usual(EFFECTS["damper_blow_off"], **values).p, linear(1000.0))
    assert by_direction.damper(np.array([0.05, -0.2, 0.25, -0.3])) == pytest.approx([50, -200, 150, -212.5])


def test_a_stop_of_two_stages_is_a_line_with_two_bends() -> None:
    stop = usual(EFFECTS["bump_stop"], clearance_m=0.02, stop_stiffness_n_per_m=1e4, second_clearance_ratio=1.5,
                 second_stiffness_ratio=5.0)
    travel_m = np.linspace(-0.06, 0.06, 121)
    expected_n = np.interp(travel_m, [-0.06, -0.03, -0.02, 0.0], [-100.0 - 1500.0, -100.0, 0.0, 0.0])
    assert stop.effect.laws(stop.p, linear(1000.0)).by_travel_n(travel_m) == pytest.approx(expected_n, abs=1e-9)


def test_a_shift_of_the_centre_of_gravity_leaves_axles_and_sensor_where_they_are() -> None:
    away = replace(HALF, sensor=replace(HALF.sensor, ahead_m=0.2))
    made = compose(away, [usual(EFFECTS["cg_shift"], shift_m=0.1)]).vehicle
    assert made.rear is not None
    assert (made.front.cg_distance_m, made.rear.cg_distance_m) == pytest.approx((1.37, 1.57))
    assert made.sensor.ahead_m == pytest.approx(0.1)
    both = compose(away, [usual(EFFECTS["cg_shift"], shift_m=0.1), usual(EFFECTS["sensor_offset"], offset_m=0.4)])
    assert both.vehicle.sensor.ahead_m == 0.4


@pytest.mark.parametrize("shift_m", [-1.0, -0.3, 0.3, 1.0])
def test_a_shift_is_applied_as_it_was_asked_for(shift_m: float) -> None:
    short = replace(HALF, front=replace(HALF.front, cg_distance_m=0.9))
    made = compose(short, [usual(EFFECTS["cg_shift"], shift_m=shift_m)]).vehicle
    assert made.rear is not None
    assert (made.front.cg_distance_m, made.rear.cg_distance_m) == pytest.approx((0.9 - shift_m, 1.47 + shift_m))


@pytest.mark.parametrize(("shift_m", "axle"), [(0.95, "front"), (-0.85, "rear")])
def test_a_car_whose_centre_of_gravity_lies_beyond_an_axle_is_refused(shift_m: float, axle: str) -> None:
    assert HALF.rear is not None
    short = replace(HALF, front=replace(HALF.front, cg_distance_m=0.9), rear=replace(HALF.rear, cg_distance_m=0.8))
    check_on(short, usual(EFFECTS["cg_shift"], shift_m=0.98 * (0.9 if axle == "front" else -0.8)), two_tracks=False)
    with pytest.raises(BadInput, match=rf"^cg_shift: expected .* axles, found it 0\.05 m beyond the {axle} axle$"):
        check_on(short, usual(EFFECTS["cg_shift"], shift_m=shift_m), two_tracks=False)


def test_an_occupant_takes_the_frequency_it_is_given() -> None:
    made = compose(QUARTER, [usual(EFFECTS["occupant"], mass_kg=70, frequency_hz=5.0, damping_ratio=0.2)]).structure
    k, c = made.stiffness[-1, -1], made.damping[-1, -1]
    assert np.sqrt(k / 70) / (2 * np.pi) == pytest.approx(5.0)
    assert c / (2 * np.sqrt(k * 70)) == pytest.approx(0.2)
    assert made.mass.diagonal() == pytest.approx([430, 55, 70])


@pytest.mark.parametrize("place_m", [-2.1, 0.0, 0.4])
def test_an_occupant_pushes_where_it_stands(place_m: float) -> None:
    """Force balance and moments of a shaken half car: m q'' = -F, heave adds F and pitch ahead times F."""
    added = {"ahead_m": place_m} if place_m else {}
    chosen_one = usual(EFFECTS["occupant"], mass_kg=70, frequency_hz=3.5, damping_ratio=0.2, **added)
    made, plain = compose(HALF, [chosen_one]).structure, compose(HALF).structure
    s = 2j * np.pi * 3.1
    q = np.linalg.solve(made.mass * s * s + made.damping * s + made.stiffness, made.road.sum(axis=1))
    omega = 2 * np.pi * 3.5
    force = 70 * (omega**2 + 0.4 * omega * s) * (q[-1] - q[0] - place_m * q[1])
    assert 70 * s * s * q[-1] == pytest.approx(-force, rel=1e-9)
    onto = (plain.mass * s * s + plain.damping * s + plain.stiffness) @ q[:-1] - plain.road.sum(axis=1)
    assert onto == pytest.approx(np.array([force, place_m * force, 0, 0]), rel=1e-9, abs=1e-6)


@pytest.mark.parametrize("ends_move", [0.0, 1.0])
def test_a_body_that_bends_does_as_its_equation_says(ends_move: float) -> None:
    """e'' + 2 z w e' + w^2 e = p F / m, the sensor reading the body's acceleration plus e''."""
    p = {"frequency_hz": 20.0, "damping_ratio": 0.05, "participation": 0.6, "ends_move": ends_move}
    structure = compose(QUARTER, [usual(EFFECTS["body_bending"], **p)]).structure
    s = 2j * np.pi * 15.0
    z, u, newcomer = np.linalg.solve(structure.mass * s * s + structure.damping * s + structure.stiffness,
                                     structure.road[:, 0])
    e = structure.body[2, 0] * newcomer
    axle = QUARTER.front
    force = -(axle.suspension_stiffness_n_per_m + axle.suspension_damping_n_s_per_m * s) * (z + 0.6 * ends_move * e - u)
    omega = 2 * np.pi * 20.0
    assert 430 * s * s * z == pytest.approx(force, rel=1e-5)
    assert (s * s + 2 * 0.05 * omega * s + omega**2) * e == pytest.approx(0.6 * force / 430, rel=1e-5)
    assert structure.body[:2, 0] == pytest.approx([1, 0])


@pytest.mark.parametrize("ends_move", [0.0, 1.0])
def test_a_person_of_a_gram_does_nothing_to_a_body_that_bends(ends_move: float) -> None:
    bends = usual(EFFECTS["body_bending"], ends_move=ends_move)
    light = usual(EFFECTS["occupant"], mass_kg=0.001)
    assert record(HALF, bends, light) == pytest.approx(record(HALF, bends), abs=1e-4)


def test_a_late_clock_and_a_gain_shift_and_stretch_the_record() -> None:
    plain = record(HALF)
    late = record(HALF, usual(EFFECTS["time_offset"], delay_s=0.03))
    assert late[20:] == pytest.approx(plain[17:-3], abs=1e-9)
    assert record(HALF, usual(EFFECTS["sensor_gain"], gain=1.07)) == pytest.approx(1.07 * plain, abs=1e-12)


@pytest.mark.parametrize("delay_s", [-2.0, -1.5, 2.0])
def test_a_clock_as_wrong_as_may_be_shifts_the_record_too(delay_s: float) -> None:
    """The record of a car that drove on as it did at the end, and came as it did at the beginning."""
    shift, steps = round(100 * delay_s), np.arange(-400, 650)
    longer = recorded(compose(HALF), Passage(ROAD, 100.0, 20.0 + 8.0 * steps / 100))
    late = recorded(compose(HALF, [usual(EFFECTS["time_offset"], delay_s=delay_s)]),
                    Passage(ROAD, 100.0, 20.0 + 8.0 * np.arange(250) / 100))
    first = 400 - shift
    counted = slice(max(0, shift), 250)  # before, the car comes to the road
    assert np.abs(late[-50:]).max() > 0.01
    assert late[counted] == pytest.approx(longer[first : first + 250][counted], abs=0.02)


def test_a_recorded_distance_is_longer_than_the_way_by_the_scale() -> None:
    car = compose(HALF, [usual(EFFECTS["speed_scale"], scale=1.02)])
    assert car.driven(np.array([102.0])) == pytest.approx([100.0])


def test_a_half_car_that_rolls_is_two_halves_with_equal_tracks() -> None:
    """With what it carries: masses are those of one side."""
    made, carried = usual(EFFECTS["roll"]), [usual(EFFECTS["payload"]), usual(EFFECTS["occupant"])]
    level = Track(0.05, np.stack([LEFT, LEFT], axis=1))
    full, half = compose(HALF, [made, *carried]), compose(HALF, carried)
    assert [full.structure.mass[i, i] for i in (0, 1, -1)] == [2 * half.structure.mass[i, i] for i in (0, 1, -1)]
    passage = Passage(level, 100.0, DISTANCE_M)
    assert recorded(full, passage) == pytest.approx(recorded(half, passage), abs=1e-9)


def test_what_a_full_car_carries_is_carried_by_the_whole_car() -> None:
    full = CARS["full"]
    made = compose(full, [usual(EFFECTS["payload"], mass_kg=100.0), usual(EFFECTS["occupant"], mass_kg=70.0)]).structure
    assert (made.mass[0, 0], made.mass[-1, -1]) == (full.sprung_mass_kg + 100.0, 70.0)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_a_filter_that_is_run_on_samples_does_what_scipys_does(order: int) -> None:
    """At 34 Hz of 100 samples a second a sensor's own takes another third of the amplitude at 45 Hz, and turns less."""
    f_hz = np.array([1.0, 10.0, 25.0, 34.0, 45.0])
    effect = EFFECTS["sensor_bandwidth"]
    s = np.asarray(2j * np.pi * f_hz)
    made = effect.factor(usual(effect, cutoff_hz=34.0, order=order, sampled_hz=100.0).p, s)
    assert made == pytest.approx(sosfreqz(butter(order, 34.0, fs=100.0, output="sos"), f_hz, fs=100.0)[1], abs=1e-9)
    own = effect.factor(usual(effect, cutoff_hz=34.0, order=order).p, s)
    assert abs(abs(own[-1]) - abs(made[-1])) > 0.1


def test_a_seen_filter_is_tried_and_its_delay_is_no_clocks() -> None:
    """Butterworth's fourth order at 10 Hz is late by 2.613 / (2 pi 10) = 41.6 ms."""
    seen = Misalignment(1.0, 0.04, (10.0, 4), 100.0)
    bandwidth, offset = EFFECTS["sensor_bandwidth"], EFFECTS["time_offset"]
    tried = [one for one in bandwidth.trials(seen) if one not in bandwidth.trials()]
    there = [one for one in tried if one["cutoff_hz"] == 10.0]
    assert {(one["order"], one["sampled_hz"]) for one in there} == set(product((3.0, 4.0, 5.0), (0.0, 100.0)))
    assert bandwidth.is_seen({"cutoff_hz": 11.0}, seen) and not bandwidth.is_seen({"cutoff_hz": 40.0}, seen)
    assert offset.is_trifle({"delay_s": -0.013}, seen) and not offset.is_trifle({"delay_s": 0.015}, seen)
    still = Misalignment(1.0, 0.04)
    assert not bandwidth.is_seen({"cutoff_hz": 10.0}, still) and not offset.is_trifle({"delay_s": 1e-4}, still)
    assert bandwidth.trials(still) == bandwidth.trials()
