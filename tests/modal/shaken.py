"""Records of shaken quarter cars and nine-floor frames, by scipy alone, with their inputs, straight between samples."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.signal import butter, cont2discrete, dlsim, sosfilt

RATE_HZ = 100.0


@dataclass(frozen=True)
class Shaken:
    """Name; true frequencies [Hz] and damping ratios (m, 2); accelerations (n, channels); the input (n, 1)."""

    name: str
    true: np.ndarray
    samples: np.ndarray
    inputs: np.ndarray


def quarter_car(sprung_kg: float, damping_n_s_per_m: float) -> tuple[np.ndarray, ...]:
    """A, B, C, D of body and wheel on a tyre that a road lifts; outputs are the accelerations of both."""
    unsprung_kg, spring, tyre = 40.0, 20e3, 180e3
    c = damping_n_s_per_m
    body = np.array([-spring, -c, spring, c]) / sprung_kg
    wheel = np.array([spring, c, -spring - tyre, -c]) / unsprung_kg
    a = np.array([[0, 1, 0, 0], body, [0, 0, 0, 1], wheel])
    b = np.array([[0.0], [0], [0], [tyre / unsprung_kg]])
    return a, b, a[[1, 3]], b[[1, 3]]


def frame(first_hz: float, ratio: float, pushed: int | None, floors: list[int]) -> tuple[np.ndarray, ...]:
    """The same of nine equal floors, pushed at one or, for None, shaken at the foot; every mode has this damping."""
    stiffness = (np.pi * first_hz / np.sin(np.pi / 38)) ** 2
    k = stiffness * (2 * np.eye(9) - np.eye(9, k=1) - np.eye(9, k=-1))
    k[8, 8] = stiffness
    squares, shapes = np.linalg.eigh(k)
    rows = np.hstack([-k, -shapes * (2 * ratio * np.sqrt(squares)) @ shapes.T])
    force = -np.ones(9) if pushed is None else np.eye(9)[pushed]
    a = np.vstack([np.hstack([np.zeros((9, 9)), np.eye(9)]), rows])
    through = np.zeros(9) if pushed is None else force  # of a shaken foot the whole acceleration is measured
    return a, np.append(np.zeros(9), force)[:, None], rows[floors], through[floors, None]


def record(name: str, system: tuple[np.ndarray, ...], share: float, seed: int, seconds: float) -> Shaken:
    """What is recorded with white noise of this share of each channel's r.m.s.; roads and pushes are random."""
    rng = np.random.default_rng(seed)
    pushes = rng.standard_normal(round(seconds * RATE_HZ))
    if len(system[0]) == 4:
        pushes = sosfilt(butter(2, 0.3, "high", fs=RATE_HZ, output="sos"), np.cumsum(1e-3 * pushes))
    clean = dlsim(cont2discrete(system, 1 / RATE_HZ, method="foh"), pushes)[1]
    poles = np.linalg.eigvals(system[0])
    poles = poles[poles.imag > 0][np.argsort(np.abs(poles[poles.imag > 0]))]
    true = np.stack([np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)], axis=1)
    noise = share * clean.std(axis=0) * rng.standard_normal(clean.shape)
    return Shaken(f"{name}, noise {share:g}, seed {seed}", true, clean + noise, pushes[:, None])


def records(seeds: range) -> Iterator[Shaken]:
    """Twelve for each seed: four structures, noise from none to as loud as the signal."""
    structures = (("car of 23 and 27 %", quarter_car(400.0, 1500.0), 60.0),
                  ("car of 12 and 14 %", quarter_car(300.0, 700.0), 60.0),
                  ("nine floors, 1 %, shaken", frame(1.2, 0.01, None, [0, 4, 8]), 120.0),
                  ("nine floors, 2 %, pushed", frame(1.0, 0.02, 8, [2, 5, 8]), 120.0))
    return (record(name, system, share, seed, seconds) for seed in seeds for name, system, seconds in structures
            for share in (0.0, 0.1, 1.0))


def matched(shaken: Shaken, modes: tuple) -> tuple[list, int]:
    """The mode found for each true one, or None, and how many were found beside them: as many pairs as can be, the
    nearest; near is within 4 % of the frequency (15 % where the damping is heavy)."""
    apart = np.array([[abs(mode.frequency_hz / hz - 1) / (0.04 if ratio < 0.1 else 0.15) for mode in modes]
                      for hz, ratio in shaken.true.tolist()]).reshape(len(shaken.true), len(modes))
    pairs: list = [None] * len(shaken.true)
    for row, column in zip(*linear_sum_assignment(np.where(apart < 1, apart, 1e3)), strict=True):
        pairs[row] = modes[column] if apart[row, column] < 1 else None
    return pairs, len(modes) - sum(mode is not None for mode in pairs)
