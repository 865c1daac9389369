"""The search finds what is hidden, with its numbers, and takes nothing for it that noise or imitation would gain."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from logger.lab.diagnosis import diagnose, refit
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.map_fit import align, fit
from logger.lab.selection.candidate_fit import CandidateFit, fit_roughly, refine
from logger.lab.selection.evidence import FALSE_ALARM, IMITATION
from logger.lab.selection.screening import Baseline, misalignment, screen
from logger.lab.selection.stepwise import MeasuredRoad, Search, SearchRound, Selection
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.effect import Chosen, Misalignment, chosen

from ...support.lab.runs_with_residual import CAR
from ...support.lab.secret_runs import EFFECTS, hidden, posterior_of, secret_runs
from ...support.slow import release, slow

STILL = Misalignment(1.0, 0.0)
FEW = ("sensor_gain", "sensor_offset", "time_offset", "tire_damping")
"""Candidates that are linear, and so quick."""


def search(names: Sequence[str], present: int = 0, workers: int = 2) -> Search:
    return Search([EFFECTS[name] for name in names], present, STILL, workers=workers)


def base_of(runs: SimulatedRuns, present: Sequence[Chosen] = ()) -> Baseline:
    posterior = posterior_of(runs)
    return refit(posterior, posterior.start(present))


@pytest.fixture(scope="module")
def offset_base() -> Baseline:
    return base_of(secret_runs([hidden("sensor_offset", offset_m=0.4)]))


@pytest.fixture(scope="module")
def found(offset_base: Baseline) -> Selection:
    return search(FEW).run(offset_base)


@pytest.mark.parametrize("seed", [1, *slow(2, 3)])
def test_nothing_is_found_where_nothing_is_missing(seed: int) -> None:
    base = base_of(secret_runs(seed=seed, lasts_s=12.0))
    selection = search(FEW).run(base)
    assert selection.now is selection.before is base
    assert not selection.gains and not selection.rivals and not selection.steps
    tried = [one.effect.name for one in (*selection.first.fits, *selection.first.unfitted)]
    assert sorted(tried) == sorted(FEW)


def test_what_is_missing_is_found_and_nothing_else(offset_base: Baseline, found: Selection) -> None:
    assert [*found.gains] == ["sensor_offset"]
    assert found.gains["sensor_offset"] == pytest.approx(offset_base.score - found.now.score)
    assert found.now.state.effects[0].values["offset_m"] == pytest.approx(0.4, abs=0.03)
    assert [name for name, _ in found.steps] == ["sensor_offset"] and found.steps[0][1] is found.now.hold_out
    assert found.first.fits[0].effect.name == "sensor_offset"
    assert [one.gain for one in found.first.fits] == sorted((one.gain for one in found.first.fits), reverse=True)


@pytest.mark.parametrize("axle", [0.0, *slow(1.0, 2.0)])
def test_what_sits_in_one_axle_alone_is_found_there(axle: float) -> None:
    base = base_of(secret_runs([hidden("damper_asymmetry", rebound_to_bump_ratio=2.0, axle=axle)]))
    (one,) = search(("damper_asymmetry", "tire_damping")).run(base).now.effects
    assert one.values["axle"] == axle
    assert one.values["rebound_to_bump_ratio"] == pytest.approx(2.0, rel=0.1)


def test_how_many_threads_search_makes_no_difference(offset_base: Baseline, found: Selection) -> None:
    alone = search(FEW, workers=1).run(offset_base)
    assert alone.gains == found.gains
    assert alone.now.state.effects[0].values == found.now.state.effects[0].values


def test_what_the_model_has_is_neither_sought_nor_dropped() -> None:
    present = [hidden("sensor_gain", gain=1.0)]  # which does nothing
    base = base_of(secret_runs([hidden("sensor_offset", offset_m=0.4)], lasts_s=12.0), present)
    selection = search(("sensor_offset", "time_offset"), present=1).run(base)
    assert selection.now.state.names == ("sensor_gain", "sensor_offset") and [*selection.gains] == ["sensor_offset"]


@pytest.mark.slow
def test_two_that_are_missing_are_both_found_and_each_gains_beside_the_other() -> None:
    both = [hidden("sensor_offset", offset_m=0.4), hidden("sensor_bandwidth", cutoff_hz=20.0)]
    sought = search(("sensor_gain", "sensor_offset", "sensor_bandwidth"))
    selection = sought.run(base_of(secret_runs(both)))
    values = {one.effect.name: one.values for one in selection.now.state.effects}
    assert values.keys() == selection.gains.keys() == {"sensor_offset", "sensor_bandwidth"}
    assert values["sensor_offset"]["offset_m"] == pytest.approx(0.4, abs=0.03)
    assert values["sensor_bandwidth"]["cutoff_hz"] == pytest.approx(20.0, rel=0.1)
    assert [*selection.gains.values()] == sorted(selection.gains.values(), reverse=True)
    for name, gain in selection.gains.items():
        assert gain == pytest.approx(sought.without(selection.now, name).score - selection.now.score)


@pytest.mark.slow
def test_a_search_goes_on_where_it_had_found_as_many_as_it_might() -> None:
    base = base_of(secret_runs([hidden("sensor_offset", offset_m=0.4), hidden("sensor_gain", gain=1.1)], lasts_s=12.0))
    two = search(FEW).run(base)
    sought = search(FEW)
    sought.effort = replace(sought.effort, effects=1)
    one = sought.run(base)
    assert len(one.gains) == 1 and two.gains.keys() == {"sensor_offset", "sensor_gain"}
    sought.effort = replace(sought.effort, effects=4)
    found = sought.go_on(one)
    assert found.gains == pytest.approx(two.gains) and found.before is base and found.first is one.first
    assert [name for name, _ in found.steps] == [name for name, _ in two.steps]


@pytest.mark.slow
def test_what_explains_as_well_is_named() -> None:
    base = base_of(secret_runs([hidden("sensor_offset", offset_m=0.1)], noise_mps2=0.3))
    selection = search(("sensor_offset", "cg_shift", "sensor_gain")).run(base)
    ((name, rivals),) = selection.rivals.items()
    assert {name, *rivals} == {"sensor_offset", "cg_shift"}


@pytest.mark.slow
def test_of_two_that_explain_alike_the_one_with_fewer_numbers_is_taken() -> None:
    base = base_of(secret_runs([hidden("sensor_mount_resonance", frequency_hz=29.6, damping_ratio=0.05)]))
    selection = search(("body_bending", "sensor_mount_resonance")).run(base)
    assert [*selection.gains] == ["sensor_mount_resonance"]
    assert selection.now.state.effects[0].values["frequency_hz"] == pytest.approx(29.6, rel=0.01)


# --- what is taken ---


def test_only_what_gains_more_than_noise_and_imitations_is_taken(offset_base: Baseline,
                                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    sought = search(FEW)
    one = fit_roughly(offset_base.score, offset_base, screen(offset_base, EFFECTS["sensor_offset"], [STILL]))[0]
    freedom = offset_base.posterior.freedom
    enough = float(chi2.isf(FALSE_ALARM / len(FEW), 1) - np.log(freedom))  # one number, whose strength is linear
    nearly_all = replace(offset_base, explanation=enough)
    assert sought.is_accepted(nearly_all, replace(one, gain=enough + 0.1))
    assert not sought.is_accepted(nearly_all, replace(one, gain=enough - 0.1))
    more_is_left = replace(offset_base, explanation=2 * enough / IMITATION)
    assert sought.is_accepted(more_is_left, replace(one, gain=enough + 0.1))  # what is left is noise
    monkeypatch.setattr("logger.lab.selection.stepwise.is_coloured_noise", lambda posterior, state: False)
    assert sought.is_accepted(more_is_left, replace(one, gain=enough + 0.1))  # most of the power is explained
    monkeypatch.setattr(MeasuredRoad, "explains_most", lambda road, without, there: False)
    assert not sought.is_accepted(more_is_left, replace(one, gain=enough + 0.1))
    assert sought.is_accepted(more_is_left, replace(one, gain=2 * enough + 0.1))
    monkeypatch.setattr(MeasuredRoad, "is_within_calibration", lambda road, without: True)
    assert not sought.is_accepted(more_is_left, replace(one, gain=2 * enough + 0.1))


def test_a_shape_at_the_end_of_its_range_is_not_taken(offset_base: Baseline) -> None:
    posterior = offset_base.posterior
    ended_occupant = hidden("occupant", frequency_hz=EFFECTS["occupant"].parameters[1].high)
    state = posterior.state_at([ended_occupant], offset_base.state.logs)
    one = fit_roughly(offset_base.score, offset_base, screen(offset_base, EFFECTS["sensor_offset"], [STILL]))[0]
    model = refine(offset_base.score, one, rounds=1)
    ended = replace(CandidateFit.of(0.0, fit(LinearModel(posterior, state), model.numbers, rounds=0)), gain=1e9)
    assert ended_occupant.at_bound and ended.effect.name == "occupant"
    assert not search(FEW).is_accepted(offset_base, ended)


def test_without_an_effect_the_model_is_what_it_was_before(offset_base: Baseline, found: Selection) -> None:
    away = search(FEW).without(found.now, "sensor_offset")
    assert away.state.names == ()
    assert away.score == pytest.approx(offset_base.score, abs=5.0)


@pytest.mark.slow
def test_what_is_not_needed_beside_the_others_is_dropped(offset_base: Baseline) -> None:
    posterior = offset_base.posterior
    effects = [hidden("sensor_offset", offset_m=0.4), hidden("sensor_gain", gain=1.0), hidden("tire_damping")]
    now = Baseline.of(fit(align(posterior, posterior.start(effects))))
    chosen_too_many = Selection(offset_base, now, {}, {}, SearchRound((), ()), ())
    rest = search(FEW).without_effect(chosen_too_many, "tire_damping")
    assert rest.now.state.names == ("sensor_offset",) and [*rest.gains] == ["sensor_offset"]
    assert rest.before is offset_base


# --- whole searches ---


# A wheel that its guide damps is, but for the road's own speed, one that its tire damps, which is simpler.
ALONE = tuple(name for name, one in EFFECTS.items()
              if one.obstacle_on(CAR, two_tracks=False, timed=False, pushed=False) is None and name != "frame_damping")
STRONGER = {"progressive_spring": {"cubic_stiffness_n_per_m3": 1e7}, "payload": {"mass_kg": 250.0},
            "tire_damping": {"tire_damping_n_s_per_m": 500.0},
            "tire_enveloping": {"contact_patch_m": 0.5 * CAR.contact_patch_m}, "bump_stop": {"clearance_m": 0.02}}
ROUGHER = {"progressive_spring": 2.0, "bump_stop": 2.0, "wheel_lift": 6.0}


OF_EACH_KIND = ("tire_damping", "dry_friction", "bump_stop", "payload", "sensor_mount_resonance", "body_bending",
                "time_offset", "tire_enveloping", "top_mount_compliance")
"""A linear force, one that is not, one that acts seldom, a number of the car, a filter, a mode, a clock, the road under
a tire, and one with states of its own: of each kind one at every change, the others before a release."""


@pytest.mark.slow
@pytest.mark.parametrize("name", [*OF_EACH_KIND, *release(*(one for one in ALONE if one not in OF_EACH_KIND))])
def test_every_effect_is_found_where_it_is_what_is_missing(name: str) -> None:
    there = chosen(EFFECTS[name], EFFECTS[name].usual | STRONGER.get(name, {}))
    runs = secret_runs([there], rougher=ROUGHER.get(name, 1.0), lasts_s=15.0)
    found = diagnose(posterior_of(runs), {one: EFFECTS[one] for one in {name, *FEW}})
    assert found.verdict == (name,) and not found.unexplained


@pytest.mark.slow
def test_people_are_found_beside_tires_that_damp() -> None:
    tires = hidden("tire_damping", tire_damping_n_s_per_m=400.0)
    people = hidden("occupant", mass_kg=50.0, frequency_hz=5.6, damping_ratio=0.2)
    selection = search(("tire_damping", "occupant", "sensor_gain")).run(base_of(secret_runs([tires, people])))
    values = {one.effect.name: one.values for one in selection.now.state.effects}
    assert values.keys() == {"tire_damping", "occupant"}
    assert values["occupant"]["frequency_hz"] == pytest.approx(5.6, rel=0.05)
    assert values["tire_damping"]["tire_damping_n_s_per_m"] == pytest.approx(400.0, rel=0.2)


@pytest.mark.slow
def test_a_bracket_and_a_bending_body_are_distinguished_though_one_can_take_the_others_place() -> None:
    bracket = hidden("sensor_mount_resonance", frequency_hz=29.6, damping_ratio=0.05)
    bending = hidden("body_bending", frequency_hz=14.7, damping_ratio=0.057, participation=-0.15)
    selection = search(("sensor_mount_resonance", "body_bending", "sensor_gain")).run(
        base_of(secret_runs([bracket, bending], lasts_s=14.0)))
    values = {one.effect.name: one.values["frequency_hz"] for one in selection.now.state.effects}
    assert values == pytest.approx({"sensor_mount_resonance": 29.6, "body_bending": 14.7}, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("scale", "delay_s"), release((1.01, 0.05), (1.02, 0.08)))
def test_a_wrong_speed_and_a_late_clock_are_both_found_though_either_alone_gains_little(
        scale: float, delay_s: float) -> None:
    both = [hidden("speed_scale", scale=scale), hidden("time_offset", delay_s=delay_s)]
    base = base_of(secret_runs(both, lasts_s=14.0))
    seen = misalignment(base.posterior, base.posterior.start())
    names = ("speed_scale", "time_offset", "sensor_gain")
    selection = Search([EFFECTS[name] for name in names], 0, seen).run(base)
    values = {one.effect.name: one.p for one in selection.now.state.effects}
    assert values.keys() == {"speed_scale", "time_offset"}
    assert values["speed_scale"].scale == pytest.approx(scale, abs=1e-3)
    assert values["time_offset"].delay_s == pytest.approx(delay_s, abs=2e-3)
