"""Effects on a rig whose numbers nobody knows, shaken by an integrator that shares nothing with ridelog."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import ridelog
from logger.lab.likelihood.by_squares import BySquares
from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.posterior import State
from logger.lab.likelihood.priors import Tolerance
from logger.lab.likelihood.whittle import UNEXPLAINED
from logger.lab.selection import starts
from logger.lab.selection.holdout import HoldOut
from logger.lab.selection.screening import Baseline
from logger.lab.selection.starts import Started, UnknownNumbers
from logger.vehicle.effect import Misalignment

from ...support.drives.bench_rig import Rig, shaken, swept_table, write_run
from ...support.lab.secret_runs import EFFECTS, car_off_by, hidden, posterior_of, secret_runs
from ...support.slow import release

CANDIDATES = ("progressive_spring", "frame_friction", "dry_friction", "sensor_gain")
FILE = ("name: bench\nmodel: quarter_car\nsprung_mass_kg: 2.5 +- 2%\nfront:\n  unsprung_mass_kg: {}\n"
        "  suspension_stiffness_n_per_m: {}\n  suspension_damping_n_s_per_m: {}\n  tire_stiffness_n_per_m: {}\n"
        "contact_patch_m: 0\neffects: []\n")


@pytest.mark.slow
@pytest.mark.parametrize(("rig", "effect", "number", "truth"), [
    *release((Rig(wheel_kg=1.0, damper=7.5, tire=6000.0, cubic=4e6), "progressive_spring", "cubic_stiffness_n_per_m3",
              4e6)),
    (Rig(wheel_kg=1.0, damper=7.5, tire=6000.0, body_guide_n=1.5), "frame_friction", "body_friction_force_n", 1.5),
    (Rig(wheel_kg=1.0, damper=7.5), "", "", 0.0)])
def test_an_effect_is_found_though_the_file_is_off_by_a_factor_of_two(
        rig: Rig, effect: str, number: str, truth: float, tmp_path: Path) -> None:
    write_run(tmp_path / "run", shaken(rig, swept_table(20.0, 1.0, 15.0, 0.006)), 0.02, 3)
    off = rig.wheel_kg * 2, rig.spring / 2, rig.damper * 2, rig.tire * 1.8
    vehicle = tmp_path / "rig.yaml"
    vehicle.write_text(FILE.format(*(f"{one} +- 100%" for one in off)), "utf-8")
    found = ridelog.diagnose(vehicle, tmp_path / "run", candidates=CANDIDATES)
    assert found.verdict == ((effect,) if effect else ())
    if effect:
        one = found.candidates[0]
        assert one.parameters[number] == pytest.approx(truth, abs=3 * one.standard_errors[number])
        assert one.standard_errors[number] < 0.1 * truth
        assert "starting points led to this result" in " ".join(str(found).split())
        assert found.steps[-1][1] < 0.2 * found.steps[1][1]
        assert np.isfinite([one.error for one in found.steps]).all()


@pytest.mark.slow
def test_cars_are_drawn_once_and_later_fits_begin_where_these_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    posterior = posterior_of(secret_runs(lasts_s=4.0), car_off_by(0.3, 2), Tolerance(numbers=0.5))
    search, ranked, rank = UnknownNumbers(), list[float](), BySquares.rank
    monkeypatch.setattr(BySquares, "rank", lambda *given: ranked.append(found := rank(*given)) or found)
    first = search.fitted(posterior, ())
    assert len(ranked) == search.draws
    again = search.fitted(posterior, ())
    assert len(ranked) < 1.2 * search.draws
    assert again.score < first.score + 1.0


def test_a_start_ends_early_where_it_cannot_reach_another_at_its_pace() -> None:
    posterior = posterior_of(secret_runs(lasts_s=4.0), car_off_by(0.3, 2), Tolerance(numbers=0.5))
    by_squares, start = BySquares.of(posterior), posterior.start()
    begun, once, end = by_squares.deviance(start), by_squares.improved(start, 1)[0], by_squares.improved(start, 12)[0]
    assert end < once < begun
    assert by_squares.improved(start, 12, end)[0] == end
    assert by_squares.improved(start, 12, once - 20 * (begun - once))[0] == once
    assert by_squares.improved(start, 2, once - 20 * (begun - once), later=1000)[0] < once


@pytest.mark.slow
def test_a_search_that_has_simulated_as_much_as_it_may_draws_no_more_cars_and_says_so() -> None:
    posterior = posterior_of(secret_runs([hidden("dry_friction", friction_force_n=200.0)], lasts_s=4.0),
                             tolerance=Tolerance(numbers=0.5))
    effects = [EFFECTS[name] for name in ("dry_friction", "tire_damping", "sensor_gain")]
    drawn = []
    for most in (1e5, 1e12):
        search = UnknownNumbers(draws=8, most=most)
        base = search.fitted(posterior, ())
        with ThreadPoolExecutor(1) as pool:
            found = search.screened(base, effects, Misalignment(1.0, 0.0), None, pool, lambda words: None)
        drawn.append({one.effect.name for one in found if isinstance(one, Started)})
        left_out = ", ".join(sorted({one.name for one in effects} - {"dry_friction"}))
        assert search.stops_before("one more effect") == (most == 1e5)
        assert search.not_tried == [f"other starting points of {left_out}", "one more effect"] * (most == 1e5)
    assert drawn[0] == {"dry_friction"} < drawn[1]


@pytest.mark.slow
def test_more_starts_are_improved_until_two_end_alike_and_what_ends_at_the_model_that_is_there_is_left_out(
        monkeypatch: pytest.MonkeyPatch) -> None:
    bracket, still = hidden("sensor_mount_resonance", frequency_hz=14.0, damping_ratio=0.1), Misalignment(1.0, 0.0)
    posterior = posterior_of(secret_runs([bracket], lasts_s=6.0, noise_mps2=0.01), tolerance=Tolerance(numbers=0.5))
    search = UnknownNumbers(draws=8)
    base, effects = search.fitted(posterior, ()), [EFFECTS["sensor_mount_resonance"]]
    with ThreadPoolExecutor(1) as pool:
        one, = search.screened(base, effects, still, None, pool, lambda words: None)
        assert isinstance(one, Started) and one.others
        improved, calls = BySquares.improved, list[float]()

        def spied(self: BySquares, start: State, rounds: int = 12, to_reach: float = np.inf, later: int = 0
                  ) -> tuple[float, State]:
            calls.append(to_reach)
            return improved(self, start, rounds, to_reach, later=later)

        monkeypatch.setattr(BySquares, "improved", spied)
        (least, there), *_ = one.ends
        search.fitted_roughly(base.score, base, replace(one, ends=[(least, there), (least + 5, there)]), 0.0)
        assert not calls and search.ends["sensor_mount_resonance"] == (2, 2)
        search.fitted_roughly(base.score, base, replace(one, ends=[(least, there), (least + 50, there)]), 0.0)
        assert calls and set(calls) == {least}
        now = Baseline.of(LinearModel(posterior, there, posterior.number_slopes(there, posterior.prior.steps)))
        without = search.without(now, "sensor_mount_resonance")
        assert not search.screened(without, effects, still, there.effects[0], pool, lambda words: None)
        assert search.screened(without, effects, still, None, pool, lambda words: None)


@pytest.mark.slow
def test_cars_are_drawn_where_any_signal_is_left_beyond_its_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a rig whose body follows its rail at 6 % while its wheel is a quarter off: fits lead nowhere from there."""
    posterior = posterior_of(secret_runs([hidden("dry_friction", friction_force_n=200.0)], lasts_s=4.0),
                             tolerance=Tolerance(numbers=0.5))
    search = UnknownNumbers(draws=4)
    base, left = search.fitted(posterior, ()), HoldOut(0.06, 0.0)
    monkeypatch.setattr(Baseline, "hold_out", property(lambda _: left))
    with ThreadPoolExecutor(1) as pool:
        for wheel, noise, draws in ((0.27, 0.003, True), (0.27, 0.26, False)):
            left = HoldOut(0.06, 0.0, {"": (0.06, 0.003), "wheel_m": (wheel, noise)})
            one, = search.screened(base, [EFFECTS["dry_friction"]], Misalignment(1.0, 0.0), None, pool, lambda _: None)
            assert isinstance(one, Started) is draws


@pytest.mark.slow
def test_refinements_are_followed_where_they_may_explain_most_of_what_the_plain_form_leaves(
        monkeypatch: pytest.MonkeyPatch) -> None:
    posterior = posterior_of(secret_runs([hidden("dry_friction", friction_force_n=60.0)], lasts_s=6.0,
                                         noise_mps2=0.01), tolerance=Tolerance(numbers=0.5))
    search, still, effects = UnknownNumbers(draws=8), Misalignment(1.0, 0.0), [EFFECTS["dry_friction"]]
    base = search.fitted(posterior, ())
    begun, calls = BySquares.of(posterior).deviance(base.state), list[tuple[bool, float]]()
    most = begun - 100 + BySquares.of(posterior).posterior.freedom * np.log(0.5)

    def ends_at(plain: float, refined: float) -> list[bool]:
        """The forms of which cars are improved, if they end so, and then those of which one is fitted."""
        def improved(self: BySquares, start: State, rounds: int = 12, to_reach: float = np.inf, later: int = 0
                     ) -> tuple[float, State]:
            is_plain = not start.effects or start.effects[-1].is_plain
            calls.append((is_plain, to_reach))
            return (plain if is_plain else refined) if start.effects else begun, start

        monkeypatch.setattr(BySquares, "improved", improved)
        calls.clear()
        with ThreadPoolExecutor(1) as pool:
            one, = search.screened(base, effects, still, None, pool, lambda words: None)
        screened = {is_plain for is_plain, _ in calls[1:]}
        fitted = list[bool]()
        monkeypatch.setattr(search, "_likeliest", lambda start, *_: fitted.append(start.effects[-1].is_plain))
        fit = SimpleNamespace(gain=0.0, chosen=one.trials[0].one)
        monkeypatch.setattr(starts.CandidateFit, "of", lambda *given: fit)
        monkeypatch.setattr(starts, "fit_roughly", lambda *given: [])
        search.fitted_roughly(base.score, base, one, 0.0)
        return [False in screened, (True, begun - 100) in calls, False in fitted, True in fitted]

    assert ends_at(begun + 100, begun + 100) == [False, False, False, True]
    assert ends_at(begun - 100, begun - 90) == [True, False, False, True]
    assert ends_at(begun - 100, begun - 120) == [True, True, False, True]  # the plain form begins where it ended
    assert all(to_reach == pytest.approx(most) for is_plain, to_reach in calls if not is_plain)
    assert ends_at(begun - 100, most - 1) == [True, True, True, True]


def test_on_a_road_a_car_is_compared_where_it_was_not_where_another_would_have_been() -> None:
    posterior = posterior_of(secret_runs(lasts_s=8.0))
    by_squares, exact = BySquares.of(posterior), posterior.start()
    record = [one.coefficients_of(np.full(one.run.count, 0.09)) for one in posterior.record_errors]
    off = posterior.state_at((), exact.logs, record)
    found = by_squares.at((), exact.logs, off)
    assert found is not None
    assert by_squares.deviance(off) > by_squares.deviance(exact) + 1000
    assert found[0] < by_squares.deviance(exact) + 50
    assert by_squares.rank((), exact.logs, off) < by_squares.rank((), exact.logs, exact) + 50


@pytest.mark.slow
@pytest.mark.parametrize("noise_mps2", [0.02, 0.5])
def test_where_an_effect_leaves_next_to_nothing_but_noise_others_are_tried_in_its_car(
        noise_mps2: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rig, ranked, rank = Rig(wheel_kg=1.0, damper=7.5, tire=6000.0, cubic=4e6), list[str](), BySquares.rank
    monkeypatch.setattr(BySquares, "rank", lambda *given: ranked.append(
        given[1][-1].effect.name if given[1] else "") or rank(*given))
    write_run(tmp_path / "run", shaken(rig, swept_table(12.0, 1.0, 15.0, 0.006)), noise_mps2, 3)
    vehicle = tmp_path / "rig.yaml"
    vehicle.write_text(FILE.format(*(f"{one} +- 100%" for one in (
        rig.wheel_kg, rig.spring, rig.damper, rig.tire))), "utf-8")
    found = ridelog.diagnose(vehicle, tmp_path / "run", candidates=CANDIDATES)
    assert found.verdict == ("progressive_spring",)
    assert (found.noise_floor_error > UNEXPLAINED) == (noise_mps2 > 0.1)
    draws = UnknownNumbers().draws
    assert ranked.count("progressive_spring") >= draws
    assert sum(ranked.count(name) for name in CANDIDATES[1:]) < draws
