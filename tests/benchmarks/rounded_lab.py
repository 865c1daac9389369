"""What rounding costs the lab: standard errors from coarse readings beside the least that their bounds allow.

A car with tire damping drives over roads of three classes; its record has noise and is rounded to a BMA220's step, from
some place within the step on. A number of the car and one of the effect are fitted, once with rounding as noise and
once with the readings as ``logger.lab.likelihood.signals`` takes them, many times over. Beside the errors that these
fits truly have stands the limit of Cramer and Rao, of readings of which each is known to be between its two bounds:
per sample, the sum over steps of (difference of the normal densities at the bounds)^2 / probability. The distances are
exact here, and everything else is known.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.stats import norm

from logger.lab.likelihood.signals import Readings
from logger.lab.likelihood.whittle import Bands
from logger.profiles.track import Track
from logger.runs import RecordFacts, Run
from logger.simulation.virtual_drive import SimulatedRuns
from logger.vehicle.compose import compose
from logger.vehicle.named_parameters import changed, read

from ..support.lab.noisy_runs import tire_damping
from ..support.lab.runs_with_residual import CAR, a_run, measuring
from .figures import Figures

Array = npt.NDArray[np.float64]

STEP_MPS2 = 0.613
NOISES_MPS2 = (0.02, 0.05, 0.1, 0.2, 0.3)
LASTS_S, SPEED_MPS = 30.0, 14.0
NUMBER, DAMPING = "sprung_mass_kg", 300.0
ROADS = (0.3, 1.0, 3.0)
"""Factors of a road: on the smoothest the car is shaken by a sixth of a step."""
GOAL, SMOOTHEST_GOAL = 1.10, 1.5
"""On the smoothest road readings cross so few edges that what is to first order does not hold any more."""
DRAWS, ROUNDS = 150, 3


def main() -> int:
    """Print the figures; exit 1 when a goal is missed."""
    figures = Figures()
    print(f"r.m.s. errors over the limit of Cramer and Rao, readings rounded to {STEP_MPS2} m/s2, {DRAWS} records of "
          f"{LASTS_S:g} s each.\nNumber, r.m.s. acceleration, noise [m/s2]: rounding as noise; then by bounds")
    for size in ROADS:
        for noise_mps2 in NOISES_MPS2:
            compared(figures, size, noise_mps2)
    return 1 if figures.missed else 0


def compared(figures: Figures, size: float, noise_mps2: float) -> None:
    """One road at one noise."""
    rng = np.random.default_rng(7)
    run, clean, columns = driven(size)
    found: list[tuple[Array, Array]] = []
    for _ in range(DRAWS):
        offset = rng.uniform(-0.5, 0.5) * STEP_MPS2
        noisy = clean + noise_mps2 * rng.standard_normal(len(clean)) + offset
        rounded = STEP_MPS2 * np.round(noisy / STEP_MPS2)
        one = replace(measuring(run, rounded - rounded.mean()), facts=RecordFacts(step_mps2=STEP_MPS2))
        least = np.sqrt(np.diag(np.linalg.inv(limit(clean + offset, columns, noise_mps2, run.first))))
        found.append((fitted(one, clean, columns, False) / least, fitted(one, clean, columns, True) / least))
    loud = float(clean[run.first:].std())
    for index, name in enumerate((NUMBER, "tire_damping")):
        as_noise, by_bounds = (float(np.sqrt(np.mean([pair[way][index] ** 2 for pair in found]))) for way in (0, 1))
        goal = SMOOTHEST_GOAL if size == min(ROADS) else GOAL
        figures.at_most(f"{name}, {loud:.2f}, {noise_mps2}: {as_noise:.2f}", by_bounds, goal, "")


def driven(size: float) -> tuple[Run, Array, Array]:
    """A drive over a road of this size, what its sensor should record (n,), and slopes (2, n) by the logarithms of a
    number of the car and of the damping."""
    run = a_run("run", SPEED_MPS, LASTS_S, 3)
    run = replace(run, track=Track(run.track.spacing_m, size * run.track.elevation_m))
    runs = SimulatedRuns([run])

    def predicted(number: float, damping: float) -> Array:
        car = changed(CAR, {NUMBER: read(CAR, NUMBER) * number})
        return runs.predict(compose(car, [tire_damping(DAMPING * damping)]))[0]

    share = 0.01
    clean = predicted(1.0, 1.0)
    return run, clean, np.stack([predicted(1 + share, 1.0) - clean, predicted(1.0, 1 + share) - clean]) / share


def fitted(run: Run, clean: Array, columns: Array, by_bounds: bool) -> Array:
    """How far the two numbers (2,) are off, fitted with free levels of the noise."""
    off, readings, bands = np.zeros(2), Readings.of(run), Bands(run)
    for _ in range(ROUNDS):
        prediction = clean + off @ columns
        readings = readings.given(prediction) if by_bounds else readings
        left = readings.residual(prediction)
        whitener = bands.whitener(left)
        white = whitener(columns)
        off = off + np.linalg.solve(white @ white.T, white @ whitener(left))
    return off


def limit(acceleration: Array, columns: Array, noise_mps2: float, first: int) -> Array:
    """Fisher's information (2, 2) of readings that are known to lie between their bounds."""
    place = acceleration[first:, None]
    steps = STEP_MPS2 * (np.arange(np.floor(place.min() / STEP_MPS2) - 2, np.ceil(place.max() / STEP_MPS2) + 3) + 0.5)
    reported = np.zeros(len(place))
    for low, high in pairwise(steps.tolist()):
        near, far = (np.abs((bound - place[:, 0]) / noise_mps2) for bound in (low, high))
        inside = np.abs(norm.sf(near) - np.where((low < place[:, 0]) & (place[:, 0] < high), 1 - norm.sf(far),
                                                 norm.sf(far)))
        reported += np.where(inside > 1e-12, (norm.pdf(near) - norm.pdf(far)) ** 2 / np.maximum(inside, 1e-300), 0.0)
    slopes = columns[:, first:]
    return np.asarray((slopes * reported) @ slopes.T / noise_mps2**2)


if __name__ == "__main__":
    sys.exit(main())
