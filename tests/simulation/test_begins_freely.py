"""Runs that nothing drives, or that ring as their record begins: the state that they begin in is found, against closed
solutions, an integrator of scipy's, and the whole motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from scipy.integrate import solve_ivp

from logger.profiles.excitation import Excitation
from logger.runs import RecordFacts, Run, Signal
from logger.simulation.virtual_drive import SimulatedRuns, steps_hz
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import Car, compose
from logger.vehicle.effect import Chosen
from logger.vehicle.vehicle import Axle, Vehicle

Array = npt.NDArray[np.float64]
M, K, C, RATE_HZ = 0.8, 260.0, 1.2, 100.0
MASS = Vehicle("mass", "single_mass", M, None, Axle(0.0, 0.0, K, C, 0.0), None, 0.0)
TIME_S = np.arange(300) / RATE_HZ
SIGNALS = {"displacement": Signal("displacement_m", "displacement"), "velocity": Signal("velocity_mps", "velocity"),
           "acceleration": Signal("accel_z_mps2", "acceleration")}


def let_go(place_m: float, speed_mps: float, more: Callable[[float, float], float]) -> dict[str, Array]:
    """The motion of the mass with a further force, by what is measured of it."""
    def rates(_t: float, state: Array) -> list[float]:
        return [state[1], -(K * state[0] + C * state[1] + more(*state)) / M]

    found = solve_ivp(rates, (0, TIME_S[-1]), [place_m, speed_mps], t_eval=TIME_S, rtol=1e-9, atol=1e-11,
                      max_step=2e-3).y
    return {"displacement": found[0] - found[0].mean(), "velocity": found[1],
            "acceleration": np.array([rates(0, one)[1] for one in found.T])}


def run_of(measures: str, samples: Array) -> Run:
    still = Excitation(RATE_HZ, np.zeros(len(samples)))
    return Run(measures, RATE_HZ, samples, *np.zeros((2, len(samples))), still, 0.0,
               RecordFacts(main=SIGNALS[measures]))


CUBIC = Chosen(shipped_effects()["progressive_spring"], {"cubic_stiffness_n_per_m3": -8000.0})
FRICTION = Chosen(shipped_effects()["dry_friction"], {"friction_force_n": 0.3, "transition_velocity_m_per_s": 0.01})


@pytest.mark.parametrize(("effects", "more", "nearly"), [
    ((), lambda _x, _v: 0.0, 2e-3),
    ((CUBIC,), lambda x, _v: -8000 * x**3, 2e-3),
    ((FRICTION,), lambda _x, v: 0.3 * np.tanh(v / 0.01), 6e-3),
], ids=["linear", "cubic", "friction"])
def test_the_right_car_does_what_was_measured_from_its_first_sample_on(
        effects: tuple[Chosen, ...], more: Callable[[float, float], float], nearly: float) -> None:
    for measures, samples in let_go(-0.07, 0.3, more).items():
        (found,) = SimulatedRuns([run_of(measures, samples)], steps_hz(MASS)).predict(compose(MASS, effects))
        assert found == pytest.approx(samples, abs=nearly * samples.std() * (10 if measures == "acceleration" else 1))


def test_a_wrong_car_begins_where_squares_are_least() -> None:
    """A car with another spring: by the normal equations of its own two free vibrations and a constant."""
    samples = let_go(0.05, -0.2, lambda _x, _v: 0.0)["displacement"] + 0.001 * np.cos(70 * TIME_S)
    wrong = Vehicle("wrong", "single_mass", M, None, Axle(0.0, 0.0, 1.3 * K, C, 0.0), None, 0.0)
    (found,) = SimulatedRuns([run_of("displacement", samples)], steps_hz(wrong)).predict(compose(wrong))
    decay = C / 2 / M
    turns = np.sqrt(1.3 * K / M - decay**2) * TIME_S
    columns = np.stack([np.exp(-decay * TIME_S) * np.cos(turns), np.exp(-decay * TIME_S) * np.sin(turns),
                        np.ones(len(TIME_S))], axis=1)
    expected = columns @ np.linalg.lstsq(columns, samples)[0]
    assert found == pytest.approx(expected - expected.mean(), abs=2e-3 * samples.std())


@pytest.mark.parametrize("first", [0, 37, 63, 110])
def test_a_part_with_a_memory_is_cut_out_of_its_motion_anywhere(first: int) -> None:
    """Bouc and Wen's law on a bench that has been running for a while, or that has just begun to."""
    rate_hz, time_s = 250.0, np.arange(700) / 250.0
    place_m, rate_mps = 0.004 * np.sin(8 * time_s), 0.032 * np.cos(8 * time_s)

    def grows(t: float, z: Array) -> Array:
        v = 0.032 * np.cos(8 * t)
        return np.asarray(v / 8e-4 * (1 - 0.5 * np.abs(z) ** 0.8 * (1 + np.sign(v * z))))

    z = solve_ivp(grows, (0, time_s[-1]), [0.0], t_eval=time_s, rtol=1e-9, atol=1e-11, max_step=1e-3).y[0]
    force_n = (1500 * place_m + 900 * rate_mps + 600 * z)[first:]
    nothing = np.zeros((2, len(force_n)))
    run = Run("part", rate_hz, force_n, *nothing, Excitation(rate_hz, place_m[first:], moves_part=True), 0.0,
              RecordFacts(main=Signal("force_n", "force", "front_suspension")))
    part = Vehicle("part", "component", 0.0, None, Axle(0.0, 0.0, 1500.0, 900.0, 0.0), None, 0.0)
    memory = Chosen(shipped_effects()["hysteresis"], {
        "yield_force_n": 600.0, "yield_travel_m": 8e-4, "sharpness_ratio": 0.8, "axle": 0.0})
    (found,) = SimulatedRuns([run]).predict(compose(part, (memory,)))
    assert np.abs(found - force_n)[5:-5].max() < 0.01 * np.abs(force_n).max()


HUNG = Chosen(shipped_effects()["occupant"], {"mass_kg": 0.05, "frequency_hz": 6.0, "damping_ratio": 0.25})


@pytest.mark.parametrize("effects", [(), (CUBIC,), (CUBIC, HUNG)], ids=["linear", "cubic", "hung"])
def test_a_car_that_hardly_differs_begins_a_step_away(effects: tuple[Chosen, ...]) -> None:
    """One with a spring 0.1 % stiffer; and one on which something hangs, which has a state of its own. What the step
    leaves out is what another state does, and so changes no squares: their slope is the whole one's."""
    samples = let_go(-0.07, 0.3, lambda x, _v: -8000 * x**3)["displacement"]
    runs = SimulatedRuns([run_of("displacement", samples)], steps_hz(MASS))
    stiffer = compose(Vehicle("stiffer", "single_mass", M, None, Axle(0.0, 0.0, 1.001 * K, C, 0.0), None, 0.0), effects)
    (before,), (alone,) = runs.predict(compose(MASS, effects)), runs.predict(stiffer)
    (near,) = runs.predict(stiffer, near=runs.beginnings(compose(MASS, effects)))
    left = samples - samples.mean() - before
    assert left @ (near - before) == pytest.approx(left @ (alone - before), rel=0.05)
    if HUNG in effects:
        assert runs.predict(stiffer, near=runs.beginnings(compose(MASS, (CUBIC,))))[0] == pytest.approx(alone)


def test_a_memory_of_which_its_record_shows_nothing_stays_at_rest() -> None:
    """What a part at 15 Hz remembered is gone before the first sample that counts: no noise is taken for it."""
    rate_hz, time_s = 500.0, np.arange(1000) / 500.0
    place_m = 0.01 * np.sin(2 * np.pi * 15 * time_s)
    rate_mps = 0.3 * np.pi * np.cos(2 * np.pi * 15 * time_s)
    force_n = 1800 * rate_mps + 500 * np.sign(rate_mps) + np.random.default_rng(1).normal(0, 20, len(time_s))
    nothing = np.zeros((2, len(force_n)))
    run = Run("part", rate_hz, force_n, *nothing, Excitation(rate_hz, place_m, moves_part=True), 0.1,
              RecordFacts(main=Signal("force_n", "force", "front_suspension")))
    part = Vehicle("part", "component", 0.0, None, Axle(0.0, 0.0, 0.0, 1500.0, 0.0), None, 0.0)
    memory = Chosen(shipped_effects()["hysteresis"], {
        "yield_force_n": 300.0, "yield_travel_m": 5e-4, "sharpness_ratio": 1.0, "axle": 0.0})
    runs, car = SimulatedRuns([run]), compose(part, (memory,))
    (begins,) = runs.beginnings(car)
    assert begins is not None and np.abs(begins.state).max() < 1e-2
    stiffer = compose(Vehicle("other", "component", 0.0, None, Axle(0.0, 0.0, 0.0, 1530.0, 0.0), None, 0.0), (memory,))
    (before,), (alone,), (near,) = runs.predict(car), runs.predict(stiffer), runs.predict(stiffer, near=[begins])
    assert (near - before)[50:] == pytest.approx((alone - before)[50:], abs=1e-3 * np.ptp(alone - before))


def shaken_before(measures: str, car: Car, count: int = 1200) -> Run:
    """The end of a longer record of what is shaken."""
    shaken = Excitation(RATE_HZ, 0.002 * np.random.default_rng(3).standard_normal(count))
    whole = Run("whole", RATE_HZ, *np.zeros((3, count)), shaken, facts=RecordFacts(main=SIGNALS[measures]))
    (motion,) = SimulatedRuns([whole]).predict(car)
    later = replace(whole.part(slice(400, None)), track=shaken.begun(4.0))
    return replace(later, measured_mps2=motion[400:] - motion[400:].mean())


def ringing(damping: float) -> Vehicle:
    return Vehicle("ringing", "single_mass", M, None, Axle(0.0, 0.0, K, damping, 0.0), None, 0.0)


@pytest.mark.parametrize("measures", SIGNALS)
def test_a_driven_record_begins_in_the_ringing_of_before(measures: str) -> None:
    """Cut from a longer one of a mass that rings for 5 s: both are the same motion; of one that does not ring, too,
    and of one that creeps back, damped far beyond critical."""
    for damping in (0.3, 10 * C, 6.0 * K):
        car = compose(ringing(damping))
        later = shaken_before(measures, car)
        (found,) = SimulatedRuns([later]).predict(car)
        off = later.residual(found)[later.first:]
        assert off.std() < 2e-3 * later.measured_mps2.std()


def test_the_part_of_a_record_that_shows_it_says_how_it_began() -> None:
    """By what the least squares of its free vibrations over the whole would gain more. What finds it counts as work."""
    car = compose(ringing(0.7))
    later = shaken_before("displacement", car, 3000)
    noise = 0.2 * later.measured_mps2.std() * np.random.default_rng(5).standard_normal(later.count)
    runs = SimulatedRuns([replace(later, measured_mps2=later.measured_mps2 + noise)])
    (found,) = runs.predict(car)
    (begins,) = runs.beginnings(car)
    rests = SimulatedRuns([replace(runs.runs[0], skip_s=0.0)])
    rests.predict(car)
    assert begins is not None and begins.count < later.count / 3 and rests.work < runs.work
    decay, time_s = 0.7 / 2 / M, np.arange(later.first, later.count) / RATE_HZ
    turns = np.sqrt(K / M - decay**2) * time_s
    columns = np.stack([np.exp(-decay * time_s) * np.cos(turns), np.exp(-decay * time_s) * np.sin(turns),
                        np.ones(len(time_s))], axis=1)
    left = runs.runs[0].residual(found)[later.first:]
    left -= left.mean()  # its zero is not known
    more = left - columns @ np.linalg.lstsq(columns, left)[0]
    assert 0 <= len(left) * np.log((left @ left) / (more @ more)) < 0.1


def test_to_rank_cars_a_driven_record_begins_as_without_their_laws(monkeypatch: pytest.MonkeyPatch) -> None:
    """No state is sought by simulations with the law, and the right car is near what was measured."""
    car = compose(ringing(0.3), (CUBIC,))
    later = shaken_before("displacement", car)
    monkeypatch.setattr("logger.simulation.virtual_drive._bent_beginning", None)
    (found,) = SimulatedRuns([later]).predict(car, near=())
    assert later.residual(found)[later.first:].std() < 0.05 * later.measured_mps2.std()


def test_what_hardly_moves_at_its_first_samples_begins_at_rest() -> None:
    rising = TIME_S * np.sin(20 * TIME_S)
    shaken = replace(run_of("displacement", rising), track=Excitation(RATE_HZ, rising), skip_s=1.0)
    assert not shaken.begins_in_motion and replace(shaken, measured_mps2=rising[::-1]).begins_in_motion
