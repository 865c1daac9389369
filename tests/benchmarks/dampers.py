"""Dampers with memory on their bench: the error of what ``learn`` finds on records kept back, beside what fits of the
laws of LuGre and of Bouc and Wen, and of polynomials of travel and rate, leave there.

    python -m tests.benchmarks.dampers --draws 2
    python -m tests.benchmarks.dampers --learn-from RUN --kept-back RUN

Without records dampers are drawn: oil through an orifice that blows off and is compressed, with friction that gives.
Neither law contains that. LuGre: C. Canudas de Wit et al., IEEE Trans. Automatic Control 40 (1995) 419; Bouc and Wen
with a damper and a spring beside: B. Spencer et al., J. Eng. Mech. 123 (1997) 230.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.interpolate import CubicSpline
from scipy.optimize import least_squares

from ..support.command import called
from .figures import Figures

Array = npt.NDArray[np.float64]
Law = Callable[[Array, Array, Array, float], Array]
"""Force (n,) [N] by numbers, travel (n,) [m] and its rate (n,) [m/s], at steps of so many seconds."""
FINE = 4
VEHICLE = ("name: damper\nmodel: component\nstiffness_n_per_m: 0 +- {}\ndamping_n_s_per_m: {} +- 100%\n"
           "preload_n: unknown\n")


@njit  # type: ignore[untyped-decorator]  # numba has no types
def lugre(p: Array, travel_m: Array, rate_mps: Array, step_s: float) -> Array:
    """Bristles by their logarithms: stiffness, damping, viscous, Coulomb, break-away over it, Stribeck rate; zero."""
    s0, s1, viscous, coulomb, more, stribeck = np.exp(p[:6])
    force, z = np.empty_like(travel_m), 0.0
    for k, v in enumerate(rate_mps):
        grip = s0 * abs(v) / (coulomb * (1 + more * np.exp(-(v / stribeck) ** 2)))
        z = (z + step_s * v) / (1 + step_s * grip)
        force[k] = s0 * z + s1 * (v - grip * z) + viscous * v
    return force + p[6]


@njit  # type: ignore[untyped-decorator]
def bouc_wen(p: Array, travel_m: Array, rate_mps: Array, step_s: float) -> Array:
    """By their logarithms: size, travel of the yield, sharpness, damper, spring; zero."""
    size, over, sharpness, damper, spring = np.exp(p[:5])
    force, z = np.empty_like(travel_m), 0.0
    for k, v in enumerate(rate_mps):
        z += step_s * v / over * (1 - 0.5 * abs(z) ** sharpness * (1 + np.sign(v * z)))
        z = min(max(z, -1.0), 1.0)
        force[k] = size * z + damper * v + spring * travel_m[k]
    return force + p[5]


def blow_off_with_oil(rng: np.random.Generator) -> Callable[[Array, Array, Array, float], Array]:
    """A damper drawn: its force works through the spring of its oil, and rubs behind that of its seals."""
    knee_n, slope, above = rng.uniform(150, 500), rng.uniform(5e3, 2e4), rng.uniform(400, 1500)
    oil, rub_n, seal = rng.uniform(3e5, 2e6), rng.uniform(10, 60), rng.uniform(1e5, 4e5)
    pull = rng.uniform(0.6, 1.0)

    def force(_p: Array, travel_m: Array, rate_mps: Array, step_s: float) -> Array:
        found, f, z = np.empty_like(travel_m), 0.0, 0.0
        for k, v in enumerate(rate_mps):
            size = f if f > 0 else f / pull
            flow = np.sign(size) * (min(abs(size), knee_n) / slope + max(abs(size) - knee_n, 0.0) / above)
            f += step_s * oil * (v - flow)
            z += step_s * v * (1 - np.sign(v) * z * seal / rub_n)
            found[k] = f + seal * z
        return found

    return force


def drawn(folder: Path, seed: int) -> tuple[Path, Path]:
    """Two records of a damper that was drawn, at other amplitudes and frequencies, with noise of 0.5 % of the force."""
    rng, rate_hz, lasts_s = np.random.default_rng(seed), 200.0, 6.0
    law = blow_off_with_oil(rng)
    runs = folder / f"run{seed}a", folder / f"run{seed}b"
    for run in runs:
        time_s, fine_s = (np.arange(int(lasts_s * one)) / one for one in (rate_hz, 20 * rate_hz))
        tones = [(rng.uniform(1e-3, 5e-3), rng.uniform(0.5, 4.0), rng.uniform(0, 2 * np.pi)) for _ in range(4)]

        def place(at: Array, tones: list[tuple[float, float, float]] = tones) -> Array:
            return np.asarray(sum(a * np.sin(2 * np.pi * f * at + phase) for a, f, phase in tones))

        force = law(np.empty(0), place(fine_s), np.gradient(place(fine_s), fine_s[1]), fine_s[1])[::20]
        force += 0.005 * force.std() * rng.standard_normal(len(force))
        write(run, time_s, place(time_s), force)
    return runs


def write(run: Path, time_s: Array, travel_m: Array, force_n: Array) -> None:
    run.mkdir(parents=True, exist_ok=True)
    for name, column, values in (("excitation.csv", "displacement_m", travel_m), ("drive.csv", "force_n", force_n)):
        np.savetxt(run / name, np.stack([time_s, values], axis=1), "%.8g", ",", header=f"t_s,{column}", comments="")


def read(run: Path) -> tuple[Array, Array, Array]:
    """Times, travel and force of a record (n,)."""
    (time_s, travel_m), (_, force_n) = (np.loadtxt(run / name, delimiter=",", skiprows=1).T
                                        for name in ("excitation.csv", "drive.csv"))
    return time_s, travel_m, force_n


def error_of_fit(law: Law, starts: list[Array], learn_from: Path, kept_back: Path) -> float:
    """NRMSE on the record kept back of a law fitted to the other one, from several starts; its zero is free there, as
    learn's is."""
    def residual(p: Array, run: tuple[Array, Array, Array]) -> Array:
        time_s, travel_m, force_n = run
        step_s = (time_s[1] - time_s[0]) / FINE
        curve = CubicSpline(time_s, travel_m)
        at = np.arange(len(time_s) * FINE) * step_s + time_s[0]
        with np.errstate(all="ignore"):
            return np.nan_to_num(law(p, curve(at), curve(at, 1), step_s)[::FINE] - force_n, nan=1e6)[20:]

    one, other = read(learn_from), read(kept_back)
    drawn = np.random.default_rng(1).normal(0.0, 0.7, (3, len(starts[0])))
    best = min((least_squares(residual, start + off, args=(one,), max_nfev=100,
                             x_scale=np.r_[np.full(len(start) - 1, 0.3), one[2].std()])
                for start in starts for off in (0 * drawn[0], *drawn)),
               key=lambda found: found.cost)
    left = residual(best.x, other)
    return float((left - left.mean()).std() / other[2][20:].std())


def error_of_polynomial(degree: int, learn_from: Path, kept_back: Path) -> float:
    """The same of a polynomial of travel and rate."""
    one, other = read(learn_from), read(kept_back)

    def powers(time_s: Array, travel_m: Array) -> Array:
        place = travel_m / np.ptp(one[1])
        rate = CubicSpline(time_s, place)(time_s, 1) * one[1].std() / np.gradient(one[1], one[0]).std()
        return np.stack([place**i * rate**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)

    left = (powers(*other[:2]) @ np.linalg.lstsq(powers(*one[:2]), one[2], rcond=None)[0] - other[2])[20:]
    return float((left - left.mean()).std() / other[2][20:].std())


def error_of_learn(folder: Path, learn_from: Path, kept_back: Path) -> float:
    """NRMSE on the record kept back of what ``learn`` found; of the known effects that explain the record where it
    learned no law."""
    _, travel_m, force_n = read(learn_from)
    rate = np.gradient(travel_m) / np.median(np.diff(read(learn_from)[0]))
    vehicle, law, with_law = (folder / name for name in ("damper.yaml", "law.py", "with-law.yaml"))
    vehicle.write_text(VEHICLE.format(round(force_n.std() / travel_m.std(), -1), round(force_n.std() / rate.std())))
    law.unlink(missing_ok=True)
    found = json.loads(called("learn", "--json", "--vehicle", vehicle, "--out", law, learn_from).stdout)
    if names := "+".join([*([str(law)] if law.is_file() else []), *found["verdict"]]):
        called("add-effect", names, "--vehicle", vehicle, "--out", with_law, learn_from)
    vehicle = with_law if names else vehicle
    return float(json.loads(called("compare", "--json", "--vehicle", vehicle, kept_back).stdout)["error"])


def starts_of(run: Path) -> tuple[list[Array], list[Array]]:
    """Where fits of LuGre and of Bouc and Wen begin, by the sizes of a record."""
    time_s, travel_m, force_n = read(run)
    size, way, rate = force_n.std(), travel_m.std(), (np.gradient(travel_m) / np.median(np.diff(time_s))).std()
    return ([np.array([*np.log([size / (share * way), 0.1 * size / rate, 0.3 * size / rate, size, 0.1, 0.1 * rate]), 0])
             for share in (0.05, 0.3)],
            [np.array([*np.log([size, share * way, 1.0, 0.3 * size / rate, 0.1 * size / way]), 0])
             for share in (0.05, 0.3)])


def main() -> int:
    """Print the figures; exit 1 where what was learned is not better than all of these."""
    parser, figures = argparse.ArgumentParser(description=__doc__), Figures()
    parser.add_argument("--draws", type=int, default=2)
    parser.add_argument("--learn-from", type=Path)
    parser.add_argument("--kept-back", type=Path)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        pairs = [(asked.learn_from, asked.kept_back)] if asked.learn_from else [
            drawn(folder, seed) for seed in range(asked.draws)]
        for learn_from, kept_back in pairs:
            first, second = starts_of(learn_from)
            errors = [error_of_fit(law, starts, learn_from, kept_back)
                      for law, starts in ((lugre, first), (bouc_wen, second))]
            errors += [error_of_polynomial(degree, learn_from, kept_back) for degree in (1, 3, 5)]
            print(f"{learn_from.name}: LuGre {errors[0]:.3f}, Bouc and Wen {errors[1]:.3f}, polynomials "
                  f"{errors[2]:.3f}, {errors[3]:.3f}, {errors[4]:.3f}", flush=True)
            figures.at_most(f"{learn_from.name}, NRMSE kept back", error_of_learn(folder, learn_from, kept_back),
                            min(errors), "")
    return 1 if figures.missed else 0


if __name__ == "__main__":
    sys.exit(main())
