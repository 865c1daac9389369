"""Modes: five in a noisy decay, four structures against other packages on the same data, coverage of the errors.

The others (pyOMA-2, python-control) are used when they are installed. They are given the truth: the better of several
orders, and the pole nearest to each mode. Ours chooses for itself.
"""

from __future__ import annotations

import importlib.util
import logging
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from logger.modal import five_storey
from logger.modal.analysis import find_modes
from logger.modal.five_storey import Masses, chain, free_decay, random_response, with_damping_ratios

from ..support.shapes import mac
from .figures import Figures

RATE_HZ = 100.0
DECAY_S, RANDOM_S = 20.0, 200.0
TRIALS_OF_FIVE, TRIALS_OF_ONE, TRIALS = 200, 100, 40
ONE_HZ = 2.0
NEAR = 0.05
BY_CHANCE = 1.05  # a ratio of errors over so many records may exceed 1 by this much and mean nothing

Poles = np.ndarray
Peer = Callable[[np.ndarray, int], list[Poles]]


@dataclass(frozen=True)
class Case:
    """A structure, the displacement from which it is let go (first masses; the others 0), and its name."""

    name: str
    masses: Masses
    pulled: tuple[float, ...]


def five_masses(ratios: list[float]) -> Masses:
    """Equal masses and springs, 2.48 to 16.73 Hz."""
    stiffness = (2 * np.pi * 2.48 / (2 * np.sin(np.pi / 22))) ** 2
    return with_damping_ratios(*chain(np.ones(5), np.full(5, stiffness)), np.array(ratios))


def close_pair() -> Masses:
    """Two equal towers of two floors, weakly tied: modes in pairs 1.5 % apart."""
    k = (2 * np.pi * 5.0) ** 2
    tower, tie = np.array([[2.0, -1.0], [-1.0, 1.0]]) * k, 0.006 * k
    both = np.kron(np.eye(2), tower)
    both[1, 1] += tie
    both[3, 3] += tie
    both[1, 3] = both[3, 1] = -tie
    return with_damping_ratios(np.eye(4), both, np.array([0.01, 0.012, 0.008, 0.01]))


def car() -> Masses:
    """Body and two wheels of a half car on its springs, damped 35 and 40 % (body), 30 % (wheels)."""
    mass = np.diag([875.0, 1100.0 / 1.47**2, 45.0, 70.0])
    ks, kt = 23088.0, 238180.0
    rows = np.array([[1.0, 1.0, -1.0, 0.0], [1.0, -1.0, 0.0, -1.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    stiffness = rows.T @ np.diag([ks, ks, kt, kt]) @ rows
    return with_damping_ratios(mass, stiffness, np.array([0.35, 0.4, 0.3, 0.3]))


CASES = (
    Case("chain of five, 1 %", five_masses([0.01] * 5), (1,)),
    Case("five storeys of 5.3", five_storey.structure(), (0.2, 0.4, 0.6, 0.8, 1)),
    Case("two towers, pairs 1.5 % apart", close_pair(), (0, 1)),
    Case("chain, 35 10 5 30 3 %", five_masses([0.35, 0.10, 0.05, 0.30, 0.03]), (0, 0, 0, 0, 1)),
    Case("half car, 30-40 %", car(), (1, 0.6)),
)


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    for decibel in (40, 20):
        five_modes(figures, decibel)
    noise_alone(figures)
    one_mode(figures)
    print("\nr.m.s. error over modes and records: frequency %, damping % of itself; processor time of one record")
    for case in CASES:
        compare(figures, case, "decay", "era", 20)
        compare(figures, case, "random", "ssi", 20)
    return 1 if figures.missed else 0


def noisy(clean: np.ndarray, decibel: float, rng: np.random.Generator) -> np.ndarray:
    """White noise on each channel, so far below the channel's r.m.s."""
    return clean + rng.standard_normal(clean.shape) * clean.std(axis=0) * 10 ** (-decibel / 20)


def five_modes(figures: Figures, decibel: float) -> None:
    """A lightly damped chain in free decay; the goals are the best figures of packages that found all five.

    Medians over the records of each record's worst mode; the truth within two standard deviations 95 % of the time.
    """
    masses = five_masses([0.01] * 5)
    true, shapes = masses.poles()
    clean = free_decay(masses, np.eye(5)[0], RATE_HZ, round(DECAY_S * RATE_HZ))
    errors, inside, likeness, extra, taken = [], [], [], 0, []  # errors: of the worst mode of each record
    missed = 0
    for seed in range(TRIALS_OF_FIVE):
        samples = noisy(clean, decibel, np.random.default_rng(seed))
        started_s = time.process_time()
        found = find_modes(samples, RATE_HZ).modes
        taken.append(time.process_time() - started_s)
        near = [[mode for mode in found if abs(mode.frequency_hz / hz(pole) - 1) < NEAR] for pole in true]
        extra += len(found) - sum(map(bool, near))
        missed += 5 - sum(map(bool, near))
        here, alike = [], []
        for number, (pole, modes) in enumerate(zip(true, near, strict=True)):
            if modes:
                mode = modes[0]
                df, dz = mode.frequency_hz - hz(pole), mode.damping_ratio - ratio(pole)
                here.append((abs(df) / hz(pole), abs(dz) / ratio(pole)))
                inside.append((abs(df) < 2 * mode.frequency_std_hz, abs(dz) < 2 * mode.damping_std))
                alike.append(float(mac(shapes[:, number], mode.shape)[0, 0]))
        errors.append(np.max(here, axis=0))
        likeness.append(min(alike))
    name = f"five modes, {decibel} dB, {TRIALS_OF_FIVE} records:"
    worst, covered = 100 * np.median(errors, axis=0), 100 * np.mean(inside, axis=0)
    figures.at_most(f"{name} missed", missed, 0, "")
    figures.at_most(f"{name} that are not there", extra, 0, "")
    figures.at_most(f"{name} frequency, worst mode", worst[0], 0.018 if decibel == 40 else 0.09, "%")
    figures.at_most(f"{name} damping, worst mode", worst[1], 2.2 if decibel == 40 else 25, "%")
    figures.at_least(f"{name} MAC, worst mode", float(np.median(likeness)), 0.95, "")
    for what, share in zip(("frequency", "damping"), covered, strict=True):
        figures.at_least(f"{name} {what} in 2 sd", share, 93, "%")
    figures.at_most(f"{name} time", float(np.median(taken)), 0.3, "s")


def noise_alone(figures: Figures) -> None:
    """White noise has no modes."""
    found = 0
    for seed in range(40):
        samples = np.random.default_rng(seed).standard_normal((4000, 3))
        found += len(find_modes(samples, RATE_HZ).modes)
        found += len(find_modes(samples, RATE_HZ, decay=True).modes)
    figures.at_most("modes found in 80 records of noise", found, 1, "")


def one_mode(figures: Figures) -> None:
    """A single mode under random forces for a minute, lightly to heavily damped: found, with errors that are right."""
    missed, inside = 0, []
    for true_ratio in (0.01, 0.05, 0.2, 0.4):
        masses = with_damping_ratios(np.eye(1), np.eye(1) * (2 * np.pi * ONE_HZ) ** 2, np.array([true_ratio]))
        here = []
        for seed in range(TRIALS_OF_ONE):
            rng = np.random.default_rng(seed)
            samples = noisy(random_response(masses, rng.standard_normal((240 * round(RATE_HZ), 1)), RATE_HZ), 20, rng)
            mode = match(masses.poles()[0], find_modes(samples, RATE_HZ, decay=False).modes)[0]
            missed += mode is None
            if mode is not None:
                here.append((abs(mode.frequency_hz - ONE_HZ) < 2 * mode.frequency_std_hz,
                             abs(mode.damping_ratio - true_ratio) < 2 * mode.damping_std))
        print(f"   one mode of {ONE_HZ:g} Hz and {true_ratio:.0%}: frequency and damping within 2 sd "
              f"{(100 * np.mean(here, axis=0)).round(1)} %", flush=True)
        inside += here
    name = f"one mode under random forces, {4 * TRIALS_OF_ONE} records of 60 s:"
    figures.at_most(f"{name} missed", missed, 0, "")
    for what, share in zip(("frequency", "damping"), 100 * np.mean(inside, axis=0), strict=True):
        figures.at_least(f"{name} {what} in 2 sd", float(share), 93, "%")


def compare(figures: Figures, case: Case, kind: str, method: str, decibel: float) -> None:
    """Ours and theirs on the same records of one structure."""
    true = case.masses.poles()[0]
    ours, inside, taken, missed, extra = [], [], [], 0, 0
    peers = peers_for(kind)
    theirs: dict[str, list[list[Poles]]] = {name: [] for name in peers}
    spent: dict[str, list[float]] = {name: [] for name in peers}
    for seed in range(TRIALS):
        samples = record(case, kind, decibel, seed)
        started_s = time.process_time()
        found = find_modes(samples, RATE_HZ, decay=kind == "decay").modes
        taken.append(time.process_time() - started_s)
        matched = match(true, found)
        missed += sum(mode is None for mode in matched)
        extra += len(found) - sum(mode is not None for mode in matched)
        ours.append([np.nan if mode is None else pole_of(mode.frequency_hz, mode.damping_ratio) for mode in matched])
        inside += [(abs(mode.frequency_hz - hz(pole)) < 2 * mode.frequency_std_hz,
                    abs(mode.damping_ratio - ratio(pole)) < 2 * mode.damping_std)
                   for mode, pole in zip(matched, true, strict=True) if mode is not None]
        for name, peer in peers.items():
            started_s = time.process_time()
            theirs[name].append(peer(samples, 2 * len(true)))
            spent[name].append(time.process_time() - started_s)
    here = ~np.isnan(np.array(ours))
    f, z = error(np.array(ours), true, here)
    label = f"{case.name}, {kind}"
    covered = 100 * np.mean(inside, axis=0)
    print(f"{label:40s} ours {method:10s} {f:9.4f} {z:9.3f}  missed {missed}/{here.size}, extra {extra}, "
          f"in 2 sd {covered[0]:.0f} % {covered[1]:.0f} %, {np.median(taken):.3f} s", flush=True)
    for name, trials in theirs.items():
        tries = [np.array([nearest(true, orders[number]) for orders in trials]) for number in range(len(trials[0]))]
        best = min((error(one, true, here) for one in tries), key=lambda pair: pair[0] + pair[1])
        print(f"{label:40s} {name:15s} {best[0]:9.4f} {best[1]:9.3f}  {np.median(spent[name]):.3f} s", flush=True)
        for what, over in (("f", f / best[0]), ("zeta", z / best[1])):
            figures.at_most(f"{label}: {what}, ours/{name} (goal: at least as good; to {BY_CHANCE:g} is chance)", over,
                            BY_CHANCE, "")
            print(f"   {what}: ours/{name} is {over:.3f}: {'at least as good' if over <= 1 else 'not as good'}")


def record(case: Case, kind: str, decibel: float, seed: int) -> np.ndarray:
    """One noisy record (samples, n)."""
    rng = np.random.default_rng(seed)
    n = len(case.masses.mass)
    if kind == "decay":
        pulled = np.array([*case.pulled, *[0.0] * n])[:n]
        return noisy(free_decay(case.masses, pulled, RATE_HZ, round(DECAY_S * RATE_HZ)), decibel, rng)
    force = rng.standard_normal((4 * round(RANDOM_S * RATE_HZ), n))
    return noisy(random_response(case.masses, force, RATE_HZ), decibel, rng)


def match(true: Poles, found: tuple) -> list:
    """For each true pole the nearest found mode, or None; no mode twice."""
    free = list(found)
    matched = []
    for pole in true:
        apart = [abs(pole_of(mode.frequency_hz, mode.damping_ratio) - pole) / abs(pole) for mode in free]
        best = int(np.argmin(apart)) if apart else -1
        matched.append(free.pop(best) if apart and apart[best] < 0.5 else None)
    return matched


def nearest(true: Poles, found: Poles) -> Poles:
    """The nearest of the found poles to each true one; NaN when there is none."""
    if not len(found):
        return np.full(len(true), np.nan + 0j)
    return found[np.abs(found[:, None] - true).argmin(axis=0)]


def error(found: np.ndarray, true: Poles, where: np.ndarray) -> tuple[float, float]:
    """R.m.s. relative error of frequency and damping [%] over the trials and modes that ours reports."""
    f, z = np.abs(found) / np.abs(true) - 1, found.real / np.abs(found) * np.abs(true) / true.real - 1
    return tuple(100 * float(np.sqrt((one[where] ** 2).mean())) for one in (f, z))


def hz(pole: complex) -> float:
    """Natural frequency."""
    return abs(pole) / (2 * np.pi)


def ratio(pole: complex) -> float:
    """Damping ratio."""
    return -pole.real / abs(pole)


def pole_of(frequency_hz: float, damping_ratio: float) -> complex:
    """The pole that has them [rad/s]."""
    return 2 * np.pi * frequency_hz * complex(-damping_ratio, np.sqrt(max(0.0, 1 - damping_ratio**2)))


def upper(roots: np.ndarray) -> Poles:
    """Vibrating poles s of discrete ones."""
    roots = roots[(roots.imag > 1e-9) & (np.abs(roots) > 1e-6)]
    return np.log(roots) * RATE_HZ


def peers_for(kind: str) -> dict[str, Peer]:
    """Those that are installed and fit."""
    peers: dict[str, Peer] = {}
    if importlib.util.find_spec("pyoma2"):
        peers["pyOMA-2 SSI-cov"] = lambda samples, order: pyoma(samples, order, "cov")
        peers["pyOMA-2 SSI-dat"] = lambda samples, order: pyoma(samples, order, "dat")
    else:
        print("pyOMA-2 is not installed")
    if kind == "decay":
        if importlib.util.find_spec("control"):
            peers["control ERA"] = control_era
        else:
            print("python-control is not installed")
    return peers


def pyoma(samples: np.ndarray, order: int, method: str) -> list[Poles]:
    """SSI of pyOMA-2 with 20 and 40 block rows, orders that are right and twice that and 40."""
    from pyoma2.functions import ssi

    logging.disable(logging.INFO)
    ssi.trange = range

    found = []
    for rows in (20, 40):
        hankel, _ = ssi.build_hank(samples.T, samples.T, rows, method)
        _, transitions, *_ = ssi.SSI_fast(hankel, rows, 40, step=2)
        found += [upper(np.linalg.eigvals(transitions[states // 2])) for states in (order, 2 * order, 40)]
    return found


def control_era(samples: np.ndarray, order: int) -> list[Poles]:
    """ERA of python-control, 60 x 400 blocks, the same orders."""
    import control

    found = []
    for states in (order, 2 * order, 40):
        model, _ = control.eigensys_realization(samples.T[:, None, :], states, m=60, n=400)
        found.append(upper(np.linalg.eigvals(model.A)))
    return found


if __name__ == "__main__":
    sys.exit(main())
