"""Parts on a bench that imposes their length, from integrators that share nothing with ridelog: a damper whose fluid
yields, a valve damper with play, rubber; and the laws that the field fits to such records, LuGre and Bouc-Wen."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from .course import Course, integrated

Array = npt.NDArray[np.float64]

RATE_HZ = 250.0
XC90_MPS = (-1.0, -0.5, -0.26, -0.13, -0.05, 0.0, 0.05, 0.13, 0.26, 0.5, 1.0)
XC90_N = (-1120.0, -740.0, -500.0, -330.0, -160.0, 0.0, 330.0, 800.0, 1150.0, 1500.0, 2200.0)
"""A digressive damper that is stronger in rebound, of the size that car makers' tables have."""


def moved(seed: int, seconds: float, reach_m: float, top_hz: float) -> Array:
    """Places (n,) of a bench that moves at random, with all frequencies up to an end, less where they are high."""
    rng, n = np.random.default_rng(seed), round(seconds * RATE_HZ)
    hz = np.fft.rfftfreq(n, 1 / RATE_HZ)
    shape = np.where((hz > 0.1) & (hz < top_hz), 1 / np.maximum(hz, 0.5), 0.0)
    found = np.fft.irfft(shape * np.fft.rfft(rng.standard_normal(n)), n)
    slowly = 0.55 + 0.45 * np.sin(2 * np.pi * np.arange(n) / n * 3)
    return np.asarray(reach_m * slowly * found / np.abs(found).max())


def force_of(rates: Callable[[float, float, float, list[float]], list[float]],
             force: Callable[[Array, Array, Array], Array], states: int, place_m: Array) -> Array:
    """Force (n,) of a part with states: ``rates`` (time, place, rate, states), ``force`` (places, rates, states)."""
    time_s = np.arange(len(place_m)) / RATE_HZ
    way = Course(RATE_HZ, place_m)
    found = integrated(lambda t, z: rates(t, way(t), way(t, 1), z), states, time_s, 1e-6, 1e-9, 4 / RATE_HZ)
    return force(way(time_s), way(time_s, 1), found)


def fluid_that_yields(place_m: Array) -> Array:
    """A magnetorheological damper: B. F. Spencer et al., J. Eng. Mech. 123 (1997) 230, their model with a spring and a
    damper in series with Bouc and Wen's, the numbers of a small one."""
    alpha, c0, c1, k0, k1, gamma, beta, big, n = 9e4, 2000.0, 2e4, 4500.0, 500.0, 3.6e6, 3.6e6, 300.0, 2

    def inner(x: Any, v: Any, z: Any, y: Any) -> Any:
        return (alpha * z + c0 * v + k0 * (x - y)) / (c0 + c1)

    def rates(_t: float, x: float, v: float, state: list[float]) -> list[float]:
        z, y = state
        dy = inner(x, v, z, y)
        w = v - dy
        return [-gamma * abs(w) * z * abs(z) ** (n - 1) - beta * w * abs(z) ** n + big * w, dy]

    return force_of(rates, lambda x, v, s: c1 * np.asarray(inner(x, v, s[0], s[1])) + k1 * x, 2, place_m)


def valve_with_play(place_m: Array) -> Array:
    """A damper by its table, behind a rubber of 1 MN/m with 0.4 mm of play either way."""
    k, play = 1e6, 4e-4

    def pull(stretch: Array) -> Array:
        return k * (stretch - np.clip(stretch, -play, play))

    def rates(_t: float, x: float, _v: float, state: list[float]) -> list[float]:
        return [float(np.interp(pull(x - state[0]), XC90_N, XC90_MPS, -9.0, 9.0))]

    return force_of(rates, lambda x, v, s: pull(x - s[0]), 1, place_m)


def rubber(place_m: Array) -> Array:
    """Rubber: a spring, two frictions that give before they slide, and a branch that creeps."""
    k, frictions, branch, creep = 2.2e5, ((60.0, 2e-4), (60.0, 8e-4)), 6e4, 0.05

    def rates(_t: float, x: float, v: float, state: list[float]) -> list[float]:
        slid = [v / y * (1 - 0.5 * abs(z) * (1 + np.sign(v * z))) for (_, y), z in zip(frictions, state, strict=False)]
        return [*slid, (x - state[2]) / creep]

    return force_of(rates, lambda x, v, s: k * x + 60.0 * (s[0] + s[1]) + branch * (x - s[2]) + 40.0 * v, 3, place_m)


PARTS: Mapping[str, tuple[Callable[[Array], Array], float, float, float]] = {
    "fluid that yields": (fluid_that_yields, 0.02, 8.0, 2.0),
    "valves with play": (valve_with_play, 0.02, 8.0, 5.0),
    "rubber": (rubber, 0.002, 20.0, 1.0),
}
"""The law, how far [m] and up to which frequency [Hz] its bench moves it, and the load cell's noise [N]."""
VEHICLES = {
    "fluid that yields": (3000, 2500), "valves with play": (300, 2500), "rubber": (150_000, 300),
}
"""Stiffness [N/m] and damping [N s/m] of their files: of the right size."""


def write_part(folder: Path, name: str) -> tuple[Path, list[Path], tuple[Array, Array]]:
    """A vehicle's file, two runs, and places and forces of a third that is kept back."""
    law, reach_m, top_hz, noise_n = PARTS[name]
    stiffness, damping = VEHICLES[name]
    vehicle, runs, kept = folder / "part.yaml", [], (np.empty(0), np.empty(0))
    vehicle.write_text(f"name: part\nmodel: component\nstiffness_n_per_m: {stiffness} +- 100%\n"
                       f"damping_n_s_per_m: {damping} +- 100%\npreload_n: 0 +- 100\n", "utf-8")
    for seed, share in ((1, 1.0), (2, 0.6), (3, 0.8)):
        place_m = moved(seed, 16.0, share * reach_m, top_hz)
        force_n = law(place_m) + np.random.default_rng(10 + seed).normal(0, noise_n, len(place_m))
        if seed == 3:
            kept = place_m, force_n
            continue
        runs.append(write_bench(folder / f"run{seed}", place_m, force_n))
    return vehicle, runs, kept


def write_bench(run: Path, place_m: Array, force_n: Array) -> Path:
    """A run's folder."""
    run.mkdir()
    time_s = np.arange(len(place_m)) / RATE_HZ
    for file, column, values in (("excitation", "displacement_m", place_m), ("drive", "force_n", force_n)):
        np.savetxt(run / f"{file}.csv", np.column_stack([time_s, values]), "%.9g", ",", header=f"t_s,{column}",
                   comments="")
    return run


def fitted_error(law: str, runs: list[tuple[Array, Array]], kept: tuple[Array, Array]) -> float:
    """Error on a run that was kept back, rms(residual) / rms(measured), of ``lugre`` or ``bouc_wen`` fitted to others
    by least squares, the best of four starts; each with a spring, a damper and a constant beside it."""
    import numba

    def simulated(place_m: Array, p: Array) -> Array:
        rate = np.gradient(place_m, 1 / RATE_HZ)
        return np.asarray(stepped(place_m, rate, np.exp(p[:6]), 1 / RATE_HZ, law == "lugre") + p[6])

    @numba.njit
    def stepped(x: Array, v: Array, q: Array, h: float, lugre: bool) -> Array:  # pragma: no cover
        found, z, steps = np.empty(len(x)), 0.0, 20
        for i in range(len(x)):
            dz = 0.0
            for _ in range(steps):
                if lugre:  # q: stiffness of bristles, Coulomb's force, spring, damper, Stribeck's share and rate
                    g = q[1] * (1.0 + q[4] * np.exp(-((v[i] / q[5]) ** 2)))
                    decay = q[0] * abs(v[i]) / g
                    end = v[i] / decay if decay > 1e-12 else z
                    new = end + (z - end) * np.exp(-decay * h / steps) if decay > 1e-12 else z + v[i] * h / steps
                else:  # q: force, yield travel, spring, damper, exponent, unused
                    dz = v[i] / q[1] * (1.0 - 0.5 * abs(z) ** q[4] * (1.0 + np.sign(v[i] * z)))
                    new = min(max(z + dz * h / steps, -1.0), 1.0)
                z = new
            found[i] = q[2] * x[i] + q[3] * v[i] + q[0] * z
        return found

    def left(p: Array) -> Array:
        with np.errstate(all="ignore"):
            return np.nan_to_num(np.concatenate([(f - simulated(x, p))[500:] for x, f in runs]), nan=1e9)

    x, f = runs[0]
    v, size, starts = np.gradient(x, 1 / RATE_HZ), float(np.std(f)), []
    k, c = np.maximum(np.linalg.lstsq(np.column_stack([x, v]), f, rcond=None)[0], (1.0, 1.0))
    for share, over in ((0.3, 0.02), (0.8, 0.02), (0.3, 0.2), (0.8, 0.2)):
        y = over * float(np.std(x))
        first = [share * size / y, share * size] if law == "lugre" else [share * size, y]
        tail = [0.3, 0.1 * float(np.std(v))] if law == "lugre" else [1.0, 1.0]
        start = np.append(np.log([*first, max(k, 1.0), max(c, 1.0), *tail]), float(np.mean(f)))
        starts.append(least_squares(left, start, x_scale=np.append(np.ones(6), size), max_nfev=60))
    best = min(starts, key=lambda one: float(one.cost))
    place_m, force_n = kept
    return float(np.std((force_n - simulated(place_m, best.x))[500:]) / np.std(force_n[500:]))
