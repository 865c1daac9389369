"""A damper whose damping depends on its travel: beside its formula, and learned on a bench beside polynomials."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

from logger.api.lab.bench import bench_with
from logger.api.lab.question import CompareQuestion
from logger.commands.main import main
from logger.lab.laws.draft import LawContext
from logger.lab.laws.families.damping_by_travel import FAMILY
from logger.lab.laws.learn import learn
from logger.vehicle.compose import compose
from logger.vehicle.effect import ForceEffect, Values, chosen
from logger.vehicle.laws import linear

from ...support.drives.part_bench import Array, fitted_error, force_of, moved, write_bench
from ...support.lab.secret_runs import hidden

STIFFNESS, DAMPING = 2000.0, 900.0
KNEE_MPS, SLOPE = 0.12, 0.4


def digressive(rate_mps: Array) -> Array:
    size = np.abs(rate_mps)
    return np.asarray(DAMPING * np.sign(rate_mps) * (np.minimum(size, KNEE_MPS) + SLOPE * np.maximum(size - KNEE_MPS,
                                                                                                     0)))


def write_damper(folder: Path) -> Path:
    vehicle = folder / "part.yaml"
    vehicle.write_text(f"name: part\nmodel: component\nstiffness_n_per_m: {STIFFNESS} +- 100%\n"
                       f"damping_n_s_per_m: {DAMPING} +- 100%\npreload_n: 0 +- 100\n", "utf-8")
    return vehicle


def test_a_curve_of_the_travel_multiplies_what_the_damper_does_by_its_rate(tmp_path: Path) -> None:
    """Of points on a line the curve is that line."""
    place_m, more_per_m = moved(1, 8.0, 0.02, 6.0), 30.0
    run = write_bench(tmp_path / "run", place_m, np.sin(np.arange(len(place_m)) / 9))
    bench = bench_with(CompareQuestion(write_damper(tmp_path), run, anyway=True), thin=False)
    posterior = bench.posterior()
    draft = FAMILY.drafts(LawContext(posterior, posterior.start([])))[-1]
    at_m = np.array([float(one.meaning.split()[2]) / 1000 for one in draft.parameters if one.is_free])
    law = chosen(draft.effect, draft.effect.usual | dict(zip(draft.strengths, more_per_m * at_m, strict=True)))
    knee = hidden("damper_blow_off", knee_velocity_m_per_s=KNEE_MPS, slope_ratio=SLOPE)
    found = bench.runs.predict(compose(bench.model.vehicle, [law, knee]))[0]
    plain = bench.runs.predict(compose(bench.model.vehicle, [knee]))[0]
    kept = slice(10, -10)
    rate_mps = np.gradient(place_m, 1 / 250.0)
    true_n = more_per_m * np.clip(place_m, at_m[0], at_m[-1]) * digressive(rate_mps)
    assert np.std((found - plain - true_n)[kept]) < 0.01 * np.std(true_n)


@pytest.mark.slow
def test_a_magnet_that_brakes_a_mass_where_its_field_is_is_learned(tmp_path: Path) -> None:
    """A mass of 2.8 kg on a spring, shaken; the field's edge lies at rest, and fades over 30 mm either way."""
    run, time_s = tmp_path / "run", np.arange(0, 10, 1 / 250.0)
    drawn = np.fft.rfft(np.random.default_rng(5).standard_normal(len(time_s)))
    drawn[np.fft.rfftfreq(len(time_s), 1 / 250.0) > 15.0] = 0.0
    push_n = np.fft.irfft(drawn, len(time_s)) * np.minimum(1.0, time_s) ** 2
    push_n *= 16.0 / push_n.std()
    push = CubicSpline(time_s, push_n)

    def rates(t: float, y: Array) -> list[float]:
        brake = 30.0 * min(max((y[0] + 0.03) / 0.06, 0.0), 1.0)
        return [y[1], (float(push(t)) - 2400.0 * y[0] - (4.0 + brake) * y[1]) / 2.8]

    went = solve_ivp(rates, (0.0, time_s[-1]), [0.0, 0.0], t_eval=time_s, max_step=2e-3, rtol=1e-8, atol=1e-10).y
    accel = np.array([rates(*one)[1] for one in zip(time_s, went.T, strict=True)])
    accel += np.random.default_rng(6).normal(0.0, 0.01, len(time_s))
    run.mkdir()
    for name, columns, values in (("excitation", "force_n", [push_n]),
                                  ("drive", "accel_z_mps2,displacement_m", [accel, went[0]])):
        np.savetxt(run / f"{name}.csv", np.stack([time_s, *values], axis=1), "%.9g", ",", header=f"t_s,{columns}",
                   comments="")
    (run / "run.yaml").write_text("forces: {force_n: {on: body}}\n", "utf-8")
    rig = tmp_path / "rig.yaml"
    rig.write_text("name: rig\nmodel: single_mass\nmass_kg: 2.8 +- 2%\nstiffness_n_per_m: 2400 +- 50%\n"
                   "damping_n_s_per_m: 19 +- 100%\n", "utf-8")
    posterior = bench_with(CompareQuestion(rig, run)).posterior(searches=True)
    found = learn(posterior, {}, {"damping_by_travel": FAMILY}, {})
    assert found.law is not None and isinstance(found.law.draft.effect, ForceEffect)
    at_m = np.linspace(-0.02, 0.02, 9)
    laws = found.law.draft.effect.laws(Values(**found.law.one.values), linear(1.0))
    assert sum(one(at_m, np.ones(9)) for one in laws.others) == pytest.approx(500.0 / 19.0 * at_m, abs=0.03)
    assert posterior.error(found.law.state) < 0.01


@pytest.mark.release
def test_a_bypass_is_learned_better_than_by_lugre_bouc_wen_and_polynomials(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Fluid goes round the piston within 12 mm of the middle, and valves open; its seal rubs and gives."""
    def force(x: Array, v: Array, z: Array) -> Array:
        return digressive(v) * (1 + 1.4 / (1 + np.exp((0.012 - np.abs(x)) / 0.002))) + 20.0 * z[0]

    records = []
    for seed, share in ((1, 1.0), (2, 0.6), (3, 0.8)):
        place_m = moved(seed, 12.0, 0.03 * share, 8.0)
        force_n = force_of(lambda t, x, v, z: [v / 2e-4 * (1 - z[0] * np.sign(v))], force, 1, place_m)
        records.append((place_m, force_n + np.random.default_rng(seed).normal(0, 1.5, len(place_m))))
    *learned, kept = records
    runs = [write_bench(tmp_path / f"run{number}", *one) for number, one in enumerate(learned)]
    law, better = tmp_path / "law.py", tmp_path / "better.yaml"
    assert main(["learn", "--vehicle", str(write_damper(tmp_path)), "--out", str(law), *map(str, runs)]) == 0
    advice = capsys.readouterr().out.partition("Next: ridelog ")[2].splitlines()[0]
    assert main(shlex.split(advice.replace("with-law.yaml", str(better)))) == 0
    capsys.readouterr()
    main(["compare", "--vehicle", str(better), str(write_bench(tmp_path / "kept", *kept)), "--json"])
    ours = json.loads(capsys.readouterr().out)["error"]

    def powers(x: Array) -> Array:
        x, v = x / 0.03, np.gradient(x, 1 / 250.0) / 0.3
        return np.stack([x**i * v**j for i in range(6) for j in range(6 - i)], axis=1)

    numbers = np.linalg.lstsq(*(np.concatenate(some) for some in zip(*((powers(x), f) for x, f in learned),
                                                                   strict=True)), rcond=None)[0]
    polynomial = np.std(powers(kept[0]) @ numbers - kept[1]) / np.std(kept[1])
    assert ours < 0.5 * min(polynomial, *(fitted_error(name, learned, kept) for name in ("lugre", "bouc_wen")))
