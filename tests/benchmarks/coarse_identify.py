"""Whether the standard errors of ``identify`` are honest where readings are coarse and places are a receiver's.

A car whose mass and dampers are wrong by some per cent drives over its road; its sensor has noise and rounds to a
BMA220's step, its places are off by what wanders with a receiver's correlation in time (a first-order Gauss-Markov
process made here). ``identify`` finds both numbers, once with the step and the places (``run.yaml``) and once without.
Printed are how many of the estimates lie within two of their standard errors of the truth, and their r.m.s. error.

    python -m tests.benchmarks.coarse_identify [DRIVES]
"""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np

import ridelog
from logger.errors import BadInput
from logger.identification.identifiability import NotIdentifiable
from logger.runs import UNKNOWN, RecordFacts

from .figures import Figures

STEP_MPS2, PLACE_STD_M, LASTS_S = 0.613, 0.15, 60.0
TRUE = {"sprung_mass_kg": 910.0, "front.suspension_damping_n_s_per_m": 1650.0}
CASES = {  # step, noise, deviation of places
    "steps of 0.613 m/s2, noise 0.08": (STEP_MPS2, 0.08, 0.0),
    "places off by 0.15 m, noise 0.1": (0.0, 0.1, PLACE_STD_M),
    "both": (STEP_MPS2, 0.08, PLACE_STD_M),
}
LEAST_SHARE = 0.95


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    drives = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    figures = Figures()
    for words, case in CASES.items():
        exact, plain = (np.array([off(seed, *case, known) for seed in range(1, drives + 1)]) for known in (True, False))
        exact, refused = exact[np.isfinite(exact).all(axis=(1, 2))], int(np.isnan(exact).any(axis=(1, 2)).sum())
        plain = plain[np.isfinite(plain).all(axis=(1, 2))]
        inside = float((np.abs(exact[..., 1]) < 2).mean())
        # Of so many numbers two deviations less may be inside by chance.
        least = LEAST_SHARE - 2 * np.sqrt(LEAST_SHARE * (1 - LEAST_SHARE) / exact[..., 1].size)
        figures.at_least(f"{words}: within 2 errors", 100 * inside, 100 * least, "%")
        print(f"  error {100 * np.sqrt((exact[..., 0] ** 2).mean()):.2f} %; without run.yaml "
              f"{100 * np.sqrt((plain[..., 0] ** 2).mean()):.2f} %, and {(np.abs(plain[..., 1]) < 2).mean():.0%} "
              f"within 2 standard errors in {len(plain)} drives that are not refused; {refused} refused with it",
              flush=True)
    return int(figures.missed > 0)


def off(seed: int, step_mps2: float, noise_mps2: float, place_std_m: float, known: bool) -> list[tuple[float, float]]:
    """By which share each number is off, and by how many of its standard errors; NaN where the runs are refused."""
    car = ridelog.read_vehicle("rav4-2009")
    road = ridelog.random_road(iso_class="B", length_m=320.0, seed=seed)
    drive = ridelog.simulate(car.with_numbers(TRUE), road, 10.0 + 0.3 * (seed % 7), noise_mps2=noise_mps2,
                             step_mps2=step_mps2, seed=seed)
    facts = RecordFacts(step_mps2=step_mps2 or None, place_std_m=place_std_m or None) if known else UNKNOWN
    wandering_m = place_std_m * wandering(len(drive.distance_m), drive.rate_hz, np.random.default_rng(seed))
    run = replace(drive, distance_m=drive.distance_m + wandering_m, facts=facts)
    try:
        found = ridelog.identify(car, run, list(TRUE))
    except (NotIdentifiable, BadInput):
        return [(np.nan, np.nan)] * len(TRUE)
    return [(found.parameters[name] / value - 1, (found.parameters[name] - value) / found.standard_errors[name])
            for name, value in TRUE.items()]


def wandering(count: int, rate_hz: float, rng: np.random.Generator) -> np.ndarray:
    """Samples (n,) of deviation one, correlated over a receiver's minute, smooth over a second."""
    kept = float(np.exp(-1 / (LASTS_S * rate_hz)))
    found = np.empty(count)
    found[0] = rng.normal()
    for k, new in enumerate(rng.normal(0, np.sqrt(1 - kept**2), count - 1), 1):
        found[k] = kept * found[k - 1] + new
    hat = np.hanning(round(rate_hz) + 2)[1:-1]
    padded = np.pad(found, len(hat) // 2, mode="edge")
    return np.convolve(padded, hat / hat.sum(), "valid")[:count]


if __name__ == "__main__":
    raise SystemExit(main())
