"""A whole search, on runs whose secret is known: what is granted is granted, and no more."""

from dataclasses import replace

import numpy as np
import pytest

from logger.lab import candidates, diagnosis
from logger.lab.addition import add
from logger.lab.candidates import Base, misalignment, screened
from logger.lab.diagnosis import Diagnosis, diagnose
from logger.lab.fitting import Problem
from logger.lab.gained import gained
from logger.lab.nuisance import Tolerance
from logger.lab.settling import aligned, settled
from logger.lab.verdict import as_json, told
from logger.runs import Run
from logger.simulation.simulated_runs import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.named_parameters import changed, read
from logger.vehicle.vehicle import Vehicle

from ..support.lab.runs_with_residual import CAR, a_run, measuring

EFFECTS = shipped_effects()
NOISE_MPS2 = 0.05


def runs_of(car: Vehicle, effects: list[Chosen], lasts_s: float = 40.0, rougher: float = 1.0) -> SimulatedRuns:
    """Three drives of a car with effects, and noise."""
    rng = np.random.default_rng(8)
    plain = [a_run(f"run{i}", speed, lasts_s, i) for i, speed in enumerate((7.0, 12.0, 18.0))]
    plain = [replace(one, track=replace(one.track, elevation_m=rougher * one.track.elevation_m)) for one in plain]
    return SimulatedRuns([measuring(run, one + rng.normal(0, NOISE_MPS2, run.count)) for run, one in zip(
        plain, SimulatedRuns(plain).predict(compose(car, effects)), strict=True)], 500.0)


def searched(runs: SimulatedRuns, car: Vehicle = CAR, names: tuple[str, ...] = ()) -> Diagnosis:
    effects = {name: EFFECTS[name] for name in names} if names else EFFECTS
    return diagnose(Problem(runs, car, Tolerance(), firm=True), effects)


@pytest.fixture(scope="module")
def flawless() -> SimulatedRuns:
    return runs_of(CAR, [])


def test_a_recorder_that_averages_and_is_a_little_weak_lacks_no_physics(flawless: SimulatedRuns) -> None:
    def weak(run: Run) -> np.ndarray:
        f_hz = np.fft.rfftfreq(run.count, 1 / run.rate_hz)
        return np.fft.irfft(np.fft.rfft(run.measured_mps2) * 0.992 * np.sinc(f_hz / run.rate_hz), run.count)

    found = searched(SimulatedRuns([measuring(run, weak(run)) for run in flawless.runs], 500.0))
    assert found.verdict == () and not found.unexplained


@pytest.fixture(scope="module")
def fast(flawless: SimulatedRuns) -> SimulatedRuns:
    """The same with a distance that is a little long."""
    return SimulatedRuns([replace(one, distance_m=1.0008 * one.distance_m) for one in flawless.runs], 500.0)


def test_a_clock_that_runs_a_little_fast_lacks_no_physics(fast: SimulatedRuns) -> None:
    found = searched(fast)
    assert set(found.verdict) <= {"speed_scale"} and not found.unexplained
    assert fast.runs and found.problem.error(found.after) < 0.3 * found.baseline_error


def test_aligning_moves_the_distance_and_leaves_the_car(fast: SimulatedRuns) -> None:
    problem = Problem(fast, CAR, Tolerance())
    nominal = problem.start()
    state = aligned(problem, nominal)
    assert not state.logs.any()
    assert problem.error(state) < 0.5 * problem.error(nominal)


def test_aligning_leaves_a_car_that_was_refitted_where_it_stands(flawless: SimulatedRuns) -> None:
    stands = changed(CAR, {"sprung_mass_kg": 1.2 * CAR.sprung_mass_kg})
    start = Problem(flawless, CAR, Tolerance(), stands=stands).start()
    assert start.logs.any()
    assert aligned(Problem(flawless, CAR, Tolerance(), stands=stands), start).logs.tolist() == start.logs.tolist()
    entire = Problem(flawless, CAR, Tolerance(), stands=stands, firm=True).entire()
    assert entire.start().logs.tolist() == start.logs.tolist() and not entire.nuisance.firm


def test_one_effect_is_enough_to_ask_for() -> None:
    strong = chosen(EFFECTS["sensor_gain"], {"gain": 1.2})
    found = searched(runs_of(CAR, [strong]), names=("sensor_gain",))
    assert found.verdict == ("sensor_gain",) and not found.unexplained


ALONE = tuple(name for name, one in EFFECTS.items() if one.obstacle(CAR, two_tracks=False) is None)
STRONGER = {"progressive_spring": {"cubic_stiffness_n_per_m3": 1e7}, "payload": {"mass_kg": 250.0},
            "tire_enveloping": {"contact_patch_m": 0.5 * CAR.contact_patch_m}, "bump_stop": {"clearance_m": 0.02}}
ROUGHER = {"bump_stop": 2.0, "wheel_lift": 6.0}


@pytest.mark.slow
@pytest.mark.parametrize("name", ALONE)
def test_every_effect_is_accepted_where_it_is_what_is_missing(name: str) -> None:
    there = chosen(EFFECTS[name], EFFECTS[name].usual | STRONGER.get(name, {}))
    found = searched(runs_of(CAR, [there], rougher=ROUGHER.get(name, 1.0)), names=(name,))
    assert found.verdict == (name,) and not found.unexplained


def test_what_only_another_car_would_explain_is_unexplained() -> None:
    stiff = changed(CAR, {name: 1.35 * read(CAR, name) for name in (
        "front.suspension_stiffness_n_per_m", "rear.suspension_stiffness_n_per_m")})
    found = searched(runs_of(stiff, []), names=("sensor_gain", "sensor_mount_resonance"))
    assert found.unexplained
    assert "front.suspension_stiffness_n_per_m" in found.strained
    told_of = as_json(told(found, EFFECTS))
    assert any("front.suspension_stiffness_n_per_m by +" in one for one in told_of["sentences"])
    assert not found.left_over and told_of["unexplained_shape"] is None
    assert told_of["numbers_off_too_far"] == found.strained


def test_a_patch_of_another_length_is_found_though_the_car_has_such_a_number_too() -> None:
    patch = chosen(EFFECTS["tire_enveloping"], {"contact_patch_m": 0.75 * CAR.contact_patch_m})
    problem = Problem(runs_of(CAR, [patch]), CAR, Tolerance(), firm=True)
    base = Base.of(problem, *settled(problem, problem.start()))
    away = base.without(problem, ("contact_patch_m",))
    place = problem.nuisance.names.index("contact_patch_m")
    assert base.state.logs[place] < 0 and away.state.logs[place] == 0
    promise = screened(problem, base, EFFECTS["tire_enveloping"], misalignment(problem, base.state))
    (tried,) = candidates.fitted(problem, base, promise)
    assert tried.whole_gain > 30
    assert tried.state.effects[-1].values["contact_patch_m"] == pytest.approx(0.75 * CAR.contact_patch_m, rel=0.1)


@pytest.mark.slow
def test_two_effects_added_one_after_the_other_keep_to_the_car_that_was_given() -> None:
    friction = chosen(EFFECTS["dry_friction"], {"friction_force_n": 90.0})
    offset = chosen(EFFECTS["sensor_offset"], {"offset_m": 0.4})
    runs = runs_of(CAR, [friction, offset])
    firm, loose = (Problem(runs, CAR, Tolerance(), whole=True, firm=firm) for firm in (True, False))
    first = add(firm, loose, [], [friction])
    bent = max(abs(one.written / one.nominal - 1) for one in first.numbers)
    assert 0.04 < bent < 0.1  # the missing offset pulls at the car, which holds on to what was granted
    assert max(abs(one.without / one.nominal - 1) for one in first.numbers) > 0.12  # one that does not, shows it
    firm, loose = (Problem(runs, CAR, Tolerance(), whole=True, stands=first.vehicle, firm=one) for one in (True, False))
    second = add(firm, loose, first.effects, [offset])
    assert second.error_before == pytest.approx(first.error_as_written, rel=1e-6)
    found = {one.effect.name: one for one in second.effects}
    assert found["sensor_offset"].values["offset_m"] == pytest.approx(0.4, rel=0.06)
    assert found["dry_friction"].values["friction_force_n"] == pytest.approx(90.0, rel=0.06)
    assert max(abs(one.written / one.nominal - 1) for one in second.numbers) < 0.5 * bent


def test_an_effect_that_does_nothing_moves_no_number_of_a_car_that_bends() -> None:
    runs = runs_of(CAR, [chosen(EFFECTS["sensor_offset"], {"offset_m": 0.4})])
    firm, loose = (Problem(runs, CAR, Tolerance(), whole=True, firm=firm) for firm in (True, False))
    added = add(firm, loose, [], [chosen(EFFECTS["wheel_lift"], {})])
    assert any(abs(one.written - one.found) > 2 * one.found_standard_error for one in added.numbers)  # it was held
    found = gained(added, ["wheel_lift"])
    assert not found.helps and not any(one.biased for one in found.moved)


def test_a_shape_at_the_end_of_its_range_is_no_effect() -> None:
    bending, roll = EFFECTS["body_bending"], EFFECTS["roll"]
    usual = {"frequency_hz": 21.0, "damping_ratio": 0.05, "participation": 0.5}
    assert not chosen(bending, usual).at_an_end
    assert chosen(bending, usual | {"frequency_hz": 60.0}).at_an_end
    assert chosen(bending, usual | {"damping_ratio": 0.003}).at_an_end
    assert not chosen(bending, usual | {"participation": 10.0}).at_an_end  # a strength, which may be large
    shapes = {one.name: one.high for one in roll.parameters}
    bandwidth = EFFECTS["sensor_bandwidth"]
    assert chosen(bandwidth, {"cutoff_hz": 2000.0, "order": 2.0}).at_an_end  # where it does nothing
    assert not chosen(bandwidth, {"cutoff_hz": 0.5, "order": 2.0}).at_an_end
    assert not chosen(roll, shapes).at_an_end  # it has no strength that could make up for a shape


STRENGTHS = [(name, one.name) for name, effect in EFFECTS.items() for one in effect.parameters
             if one.null is not None and not one.low < one.null < one.high]


@pytest.mark.parametrize(("name", "strength"), STRENGTHS)
def test_a_strength_is_at_its_weakest_at_one_end_and_not_where_it_is_usual(name: str, strength: str) -> None:
    one = next(one for one in EFFECTS[name].parameters if one.name == strength)
    ends = [one.at_its_weakest(value) for value in (one.low, one.high)]
    assert sorted(ends) == [False, True] and ends[0] == (one.null == one.low)
    assert not any(one.at_its_weakest(value) for value in (one.start, *one.trials))
    weakest = one.coordinate(one.low if ends[0] else one.high)
    tenth = one.value(weakest + 0.1 * (one.coordinate(one.start) - weakest))
    assert not one.at_its_weakest(tenth)  # whatever its unit


def test_of_choices_the_usual_one_wins_unless_another_explains_clearly_more() -> None:
    first = candidates.Tried(EFFECTS["body_bending"], None, 50.0, 20.0, 0.1, 3, 1, 0.0, None)  # type: ignore[arg-type]
    assert candidates.best_choice([first, replace(first, gain=58.0)]) is first
    better = replace(first, gain=62.0)
    assert candidates.best_choice([first, better]) is better


def test_an_effect_that_was_taken_for_what_it_is_not_is_sought_again() -> None:
    tires = chosen(EFFECTS["tire_damping"], {"tire_damping_n_s_per_m": 400.0})
    people = chosen(EFFECTS["occupant"], {"mass_kg": 50.0, "frequency_hz": 5.6, "damping_ratio": 0.2})
    problem = Problem(runs_of(CAR, [tires, people]), CAR, Tolerance(), firm=True)
    seen = misalignment(problem, problem.start())
    wrong = chosen(EFFECTS["occupant"], {"mass_kg": 90.0, "frequency_hz": 11.6, "damping_ratio": 0.3})
    stuck = Base.of(problem, *settled(problem, problem.start([wrong, tires]), 2))
    once = candidates.Tried(EFFECTS["occupant"], stuck.state, 0.0, 0.0, 0.0, 3, 1, 0.0, stuck.slopes)
    again = diagnosis._sought_again(problem, stuck, once, seen, lambda words: None)
    found = {one.effect.name: one for one in again.state.effects}
    assert stuck.left_by(again) >= 0
    assert found["occupant"].values["frequency_hz"] == pytest.approx(5.6, rel=0.05)
    assert found["tire_damping"].values["tire_damping_n_s_per_m"] == pytest.approx(400.0, rel=0.2)


def test_of_two_that_explain_alike_the_simpler_is_taken() -> None:
    first = candidates.Tried(EFFECTS["occupant"], None, 6000.0, 2000.0, 0.1, 3, 1, 0.0, None)  # type: ignore[arg-type]
    simpler = replace(first, effect=EFFECTS["tire_damping"], numbers=1, gain=5950.0)
    assert diagnosis._simplest_of_the_best([first, simpler], 0.0) is simpler
    assert diagnosis._simplest_of_the_best([first, replace(simpler, gain=5800.0)], 5000.0) is first
    part = replace(simpler, effect=EFFECTS["payload"], gain=5800.0)
    assert diagnosis._simplest_of_the_best([first, part], 0.0) is first
    assert diagnosis._simplest_of_the_best([first, part], 5000.0) is part  # has a number of the first, and no other


@pytest.mark.slow
def test_what_explains_little_of_what_is_left_only_stands_in_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    friction = chosen(EFFECTS["dry_friction"], {"friction_force_n": 200.0})
    problem = Problem(runs_of(CAR, [friction]), CAR, Tolerance(), firm=True)
    few = {name: EFFECTS[name] for name in ("tire_damping", "sensor_gain")}
    found = diagnose(problem, few)
    assert found.verdict == () and found.left_over
    said = as_json(told(found, few))["sentences"]
    assert any("less than 10% of what a full explanation would" in one for one in said)
    monkeypatch.setattr(diagnosis, "LEAST_OF_LEFT", 0.0)
    assert diagnose(problem, few).verdict != ()


@pytest.mark.slow
def test_a_bracket_and_a_bending_body_are_told_apart_though_one_can_take_the_others_place() -> None:
    bracket = chosen(EFFECTS["sensor_mount_resonance"], {"frequency_hz": 29.6, "damping_ratio": 0.05})
    bending = chosen(EFFECTS["body_bending"], {"frequency_hz": 14.7, "damping_ratio": 0.057, "participation": -0.15})
    found = searched(runs_of(CAR, [bracket, bending]), names=("sensor_mount_resonance", "body_bending", "sensor_gain"))
    assert set(found.verdict) == {"sensor_mount_resonance", "body_bending"} and not found.unexplained
    values = {one.effect.name: one.values["frequency_hz"] for one in found.after.effects}
    assert values == pytest.approx({"sensor_mount_resonance": 29.6, "body_bending": 14.7}, rel=0.01)


def test_a_simpler_effect_begins_where_one_with_its_numbers_stands() -> None:
    bracket = chosen(EFFECTS["sensor_mount_resonance"], {"frequency_hz": 29.6, "damping_ratio": 0.05})
    problem = Problem(runs_of(CAR, [bracket]), CAR, Tolerance(), firm=True)
    base = Base.of(problem, *settled(problem, problem.start()))
    bending = chosen(EFFECTS["body_bending"], {"frequency_hz": 29.0, "damping_ratio": 0.06, "participation": 0.7})
    there = problem.start([bending])
    as_bending = candidates.Tried(EFFECTS["body_bending"], there, 0.0, 0.0, 0.0, 3, 1, 0.0, base.slopes)
    assert [one.name for one in candidates.simpler(as_bending, [*EFFECTS.values()])] == ["sensor_mount_resonance"]
    found = candidates.in_place_of(problem, base, as_bending, {"sensor_mount_resonance": 14}, 0.0,
                                   EFFECTS["sensor_mount_resonance"])
    assert found.state.effects[-1].values["frequency_hz"] == pytest.approx(29.6, rel=0.01)
    assert found.whole_gain > 100 and found.starts == 15


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "delay_s"), [(1.01, 0.05), (1.02, 0.08)])
def test_a_wrong_speed_and_a_late_clock_are_both_found_though_either_alone_gains_little(
        scale: float, delay_s: float) -> None:
    both = [chosen(EFFECTS["speed_scale"], {"scale": scale}), chosen(EFFECTS["time_offset"], {"delay_s": delay_s})]
    found = searched(runs_of(CAR, both), names=("speed_scale", "time_offset", "sensor_gain"))
    assert set(found.verdict) == {"speed_scale", "time_offset"} and not found.unexplained
    values = {one.effect.name: one.p for one in found.after.effects}
    assert values["speed_scale"].scale == pytest.approx(scale, abs=1e-3)
    assert values["time_offset"].delay_s == pytest.approx(delay_s, abs=2e-3)
