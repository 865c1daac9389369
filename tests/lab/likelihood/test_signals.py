"""Several signals of one run: predicted from one motion, weighed each by its own noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from logger.lab.likelihood.distance_error import derivative, signals_off
from logger.lab.likelihood.map_fit import fit_model
from logger.lab.likelihood.noise_floor import signals_with_noise
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.signals import JointBands, Readings, by_signal
from logger.lab.likelihood.whittle import Bands
from logger.runs import RecordFacts, Run, Signal
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose

from ...support.lab.noisy_runs import still_runs
from ...support.lab.runs_with_residual import CAR
from ...support.lab.secret_runs import FINE_HZ, hidden

SIGNALS = (Signal("here_mps2", "acceleration"), Signal("ahead_mps2", "acceleration", ahead_m=1.0),
           Signal("axle_mps2", "acceleration", ahead_m=CAR.front.cg_distance_m),
           Signal("pitch_rad_per_s", "pitch_rate"), Signal("wheel_mps2", "acceleration", "front_wheel"),
           Signal("travel_m", "travel", "front_suspension"))
RUBS = hidden("dry_friction", friction_force_n=60.0, transition_velocity_m_per_s=0.02)


def with_signals(run: Run, signals: tuple[Signal, ...] = SIGNALS) -> Run:
    return replace(run, facts=RecordFacts(signals=signals), more=np.ones((len(signals), run.count)))


@pytest.fixture(scope="module")
def run() -> Run:
    return with_signals(still_runs(12.0)[1])


def predicted(run: Run, *effects: object) -> dict[str, np.ndarray]:
    (joined,) = SimulatedRuns([run], FINE_HZ).predict(compose(CAR, effects))
    return dict(zip(["", *(one.name for one in run.signals)], joined.reshape(-1, run.count), strict=True))


@pytest.mark.parametrize("effects", [(), (RUBS,)])
def test_signals_hang_together_as_the_motions_do(run: Run, effects: tuple[object, ...]) -> None:
    """Kinematics of a rigid body: places differ by the pitch, and a travel is what lies between its two ends."""
    found = predicted(run, *effects)
    kept = slice(100, -100)

    def same(one: np.ndarray, other: np.ndarray) -> None:
        one, other = (part[kept] - part[kept].mean() for part in (one, other))
        assert one == pytest.approx(other, abs=1e-2 * float(np.abs(other).max()))

    pitch = derivative(found["pitch_rad_per_s"], run.rate_hz)
    same(pitch, found["ahead_mps2"] - found["here_mps2"])
    twice = derivative(derivative(found["travel_m"], run.rate_hz), run.rate_hz)
    same(twice, found["axle_mps2"] - found["wheel_mps2"])
    assert found["here_mps2"] == pytest.approx(found[""] - found[""].mean(), abs=1e-9)


def test_the_sensor_alone_is_predicted_as_ever(run: Run) -> None:
    alone = replace(run, facts=RecordFacts(), more=np.empty((0, 0)))
    (expected,) = SimulatedRuns([alone], FINE_HZ).predict(compose(CAR, [RUBS]))
    assert predicted(run, RUBS)[""] == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_effects_of_the_sensor_are_the_sensors_alone(run: Run) -> None:
    plain, gained = predicted(run), predicted(run, hidden("sensor_gain", gain=1.5))
    assert gained[""] == pytest.approx(1.5 * plain[""])
    assert all(np.array_equal(gained[one.name], plain[one.name]) for one in SIGNALS)


def test_what_is_bolted_to_the_body_stays_when_its_centre_of_gravity_moves(run: Run) -> None:
    moved = predicted(run, hidden("cg_shift", shift_m=0.2))
    assert CAR.rear is not None
    other = replace(CAR, front=replace(CAR.front, cg_distance_m=CAR.front.cg_distance_m - 0.2),
                    rear=replace(CAR.rear, cg_distance_m=CAR.rear.cg_distance_m + 0.2))
    there = with_signals(run, (Signal("ahead_mps2", "acceleration", ahead_m=0.8),))
    (joined,) = SimulatedRuns([there], FINE_HZ).predict(compose(other))
    assert moved["ahead_mps2"] == pytest.approx(joined.reshape(2, -1)[1], abs=1e-9)


@pytest.mark.parametrize(("signal", "words"), [
    (Signal("w_mps2", "acceleration", "rear_left_wheel"), "signal w_mps2: this vehicle has no rear left wheel"),
    (Signal("r_rad_per_s", "roll_rate"), "signal r_rad_per_s: this body has no roll rate"),
    (Signal("b_mps2", "acceleration", left_m=0.4), "signal b_mps2: this body does not roll"),
])
def test_what_a_car_does_not_have_is_refused(run: Run, signal: Signal, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        SimulatedRuns([with_signals(run, (signal,))], FINE_HZ).predict(compose(CAR))


def test_joint_bands_are_those_of_each_signal(run: Run) -> None:
    rng = np.random.default_rng(3)
    noise = rng.normal(0, 1, (2, run.count)) * np.array([[0.05], [2e-4]])
    two = replace(with_signals(run, SIGNALS[-1:]), measured_mps2=10 * noise[0], more=10 * noise[1:])
    posterior = Posterior(SimulatedRuns([two], FINE_HZ), CAR, Tolerance())
    joint = posterior.bands[0]
    assert isinstance(joint, JointBands)
    each = [Bands(two), Bands(two, 0)]
    assert joint.deviance(noise.ravel()) == pytest.approx(sum(one.deviance(part) for one, part in
                                                              zip(each, noise, strict=True)))
    white = joint.whitener(noise.ravel())(noise.ravel())
    assert float(white @ white) == pytest.approx(float(joint.freedom.sum()), rel=0.05)
    assert joint.whitener(noise.ravel()).in_time(noise.ravel()).shape == (2 * (two.count - two.first),)
    errors = signals_with_noise(posterior, [noise.ravel()])
    assert {*errors} == {"", SIGNALS[-1].name}
    assert [*errors.values()] == [pytest.approx((0.1, 0.1), rel=0.05)] * 2


def test_residuals_by_signal_and_their_errors(run: Run) -> None:
    one = with_signals(run, SIGNALS[-2:])
    other = with_signals(run, SIGNALS[-1:])
    runs = [replace(one, more=np.stack([np.full(run.count, 2.0), np.full(run.count, 4.0)])),
            replace(other, more=np.full((1, run.count), 3.0))]
    joined = [np.concatenate([each.measured_mps2, *each.more]) for each in runs]
    bands = [JointBands([Bands(each), *(Bands(each, i) for i in range(len(each.more)))]) for each in runs]
    found = {signal.name: signal for signal in by_signal(list(map(Readings.of, runs)), bands, joined)}
    assert {name: len(signal.bands) for name, signal in found.items()} == {"": 2, "wheel_mps2": 1, "travel_m": 2}
    assert found["travel_m"].size == pytest.approx(np.sqrt((16 + 9) / 2))
    posterior = Posterior(SimulatedRuns(runs, FINE_HZ), CAR, Tolerance())
    short = [np.repeat([1.0, 0.9, 0.8], run.count), np.repeat([1.0, 0.8], run.count)]
    errors = signals_with_noise(posterior, posterior.residuals_of(
        [share * each for share, each in zip(short, joined, strict=True)]))
    assert {name: error for name, (error, _) in errors.items()} == pytest.approx(
        {"": 0.0, "wheel_mps2": 0.1, "travel_m": 0.2})


def test_where_the_car_was_is_the_same_for_all_signals(run: Run) -> None:
    """A start that is off moves every signal: slopes against differences of predictions that are laid out again."""
    posterior = Posterior(SimulatedRuns([run], FINE_HZ), CAR, Tolerance())
    state = posterior.start()
    error = posterior.record_errors[0]
    curve = slice(error.spline_count)
    record = np.zeros(error.count)
    record[curve] = 1e-3
    there = posterior.state_at((), state.logs, [record]).predictions[0]
    expected = (there - state.predictions[0]).reshape(-1, run.count) / 1e-3
    slopes = error.slopes(state.predictions[0]).toarray()[curve].sum(axis=0).reshape(-1, run.count)
    for one, other in zip(slopes, expected, strict=True):
        assert np.corrcoef(one, other)[0, 1] > 0.98
    last = error.places + 1 + len(SIGNALS)
    gains = error.slopes(state.predictions[0]).toarray()[[error.places, last]].reshape(2, -1, run.count)
    assert not gains[0, 1:].any() and not gains[1, :-1].any()
    assert gains[1, -1] == pytest.approx(state.predictions[0][-run.count:])


@pytest.mark.parametrize(("share", "named"), [(0.015, {}), (0.1, {"travel_m": pytest.approx(0.1, abs=0.005)})])
def test_a_signal_whose_scale_is_off_moves_no_number(run: Run, share: float, named: dict[str, float]) -> None:
    """A travel sensor that reads too much: its gain is found, and named where no sensor is off so far."""
    travel = SIGNALS[-1:]
    (true,) = SimulatedRuns([with_signals(run, travel)], FINE_HZ).predict(compose(CAR))
    noise = np.random.default_rng(5).normal(0, 1, (2, run.count)) * np.array([[0.02], [2e-5]])
    body, moved = true.reshape(2, -1)
    seen = replace(with_signals(run, travel), measured_mps2=body + noise[0], more=(1 + share) * moved[None] + noise[1:])
    posterior = Posterior(SimulatedRuns([seen], FINE_HZ), CAR, Tolerance())
    found = fit_model(posterior, posterior.start()).state
    assert np.abs(found.logs).max() < 0.01
    assert posterior.record_errors[0].signal_gains(found.record[0]) == pytest.approx([share], abs=0.005)
    assert signals_off(posterior.record_errors, found.record) == named


@pytest.mark.parametrize("late_s", [0.0, 2e-3])
def test_a_signal_that_is_read_a_little_later_moves_no_number(run: Run, late_s: float) -> None:
    """Channels that are read in turn: a fifth of a sample would move a number by 2 %, if it had none."""
    travel = SIGNALS[-1:]
    fine = with_signals(run, travel)
    (true,) = SimulatedRuns([fine], FINE_HZ).predict(compose(CAR))
    noise = np.random.default_rng(5).normal(0, 1, (2, run.count)) * np.array([[0.02], [2e-5]])
    body, moved = true.reshape(2, -1)
    f_hz = np.fft.rfftfreq(run.count, 1 / run.rate_hz)
    later = np.fft.irfft(np.fft.rfft(moved) * np.exp(-2j * np.pi * f_hz * late_s), run.count)
    seen = replace(fine, measured_mps2=body + noise[0], more=later[None] + noise[1:])
    posterior = Posterior(SimulatedRuns([seen], FINE_HZ), CAR, Tolerance())
    found = fit_model(posterior, posterior.start()).state
    assert np.abs(found.logs).max() < 0.01
    assert found.record[0][-1] == pytest.approx(late_s, abs=1e-4)


def test_a_counting_sensor_has_no_gain_to_speak_of() -> None:
    known = Tolerance()
    assert known.gain_of(replace(SIGNALS[-1], kind="encoder")) == pytest.approx(known.gain_of(SIGNALS[-1]) / 10)


def test_a_run_holds_as_many_samples_of_each() -> None:
    with pytest.raises(ValueError, match="expected samples of each of 2 signals"):
        replace(with_signals(still_runs(6.0)[0], SIGNALS[:2]), more=np.zeros((1, 600)))
