"""Two short runs of a car whose secret is known, and the lab's posterior of them; and dense algebra to check it by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from logger.lab.likelihood.linear_model import LinearModel
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.simulation.virtual_drive import SimulatedRuns
from logger.store.formats.effect_file import shipped_effects
from logger.vehicle.compose import compose
from logger.vehicle.effect import Chosen, chosen
from logger.vehicle.named_parameters import changed, read
from logger.vehicle.vehicle import Vehicle

from .runs_with_residual import CAR, a_run, measuring

Array = npt.NDArray[np.float64]

EFFECTS = shipped_effects()
NOISE_MPS2 = 0.05
FINE_HZ = 500.0
SPEEDS_MPS = (7.0, 14.0)


def hidden(name: str, **values: float) -> Chosen:
    """An effect of ridelog's, its other values the usual ones."""
    return chosen(EFFECTS[name], EFFECTS[name].usual | values)


def secret_runs(effects: Sequence[Chosen] = (), car: Vehicle = CAR, lasts_s: float = 16.0, rougher: float = 1.0,
                noise_mps2: float = NOISE_MPS2, seed: int = 8) -> SimulatedRuns:
    """Two drives of a car with effects, and noise; to be simulated roughly, as the lab does."""
    rng = np.random.default_rng(seed)
    plain = [a_run(f"run{i}", speed, lasts_s, i) for i, speed in enumerate(SPEEDS_MPS)]
    plain = [replace(one, track=replace(one.track, elevation_m=rougher * one.track.elevation_m)) for one in plain]
    return SimulatedRuns([measuring(run, one + rng.normal(0, noise_mps2, run.count)) for run, one in zip(
        plain, SimulatedRuns(plain).predict(compose(car, effects)), strict=True)], FINE_HZ)


def posterior_of(runs: SimulatedRuns, start_vehicle: Vehicle | None = None, tolerance: Tolerance | None = None
                 ) -> Posterior:
    """Of the plain car, given runs; its file is right to 4 % unless it is said how well it is known."""
    return Posterior(runs, CAR, tolerance or Tolerance(numbers=0.025), start_vehicle)


def car_off_by(share: float, seed: int) -> Vehicle:
    """A car all of whose masses, springs and dampers are off, up or down."""
    rng = np.random.default_rng(seed)
    axles = [f"{axle}.{name}" for name in ("unsprung_mass_kg", "suspension_stiffness_n_per_m",
                                           "suspension_damping_n_s_per_m", "tire_stiffness_n_per_m")
             for axle in ("front", "rear")]
    return changed(CAR, {name: read(CAR, name) * float(np.exp(share * rng.choice([-1, 1])))
                         for name in ("sprung_mass_kg", "pitch_inertia_kg_m2", *axles)})


class Dense:
    """Least squares over the car's numbers and all of the record's errors at once, beside a state: what a LinearModel
    eliminates run by run, written out."""

    def __init__(self, linear: LinearModel) -> None:
        state, posterior = linear.state, linear.posterior
        errors = posterior.record_errors
        assert linear.numbers is not None
        self._linear = linear
        numbers = linear.whitened(linear.numbers)
        records = linear.whitened([one.slopes(y).toarray() for one, y in zip(errors, state.predictions, strict=True)])
        p, counts = len(numbers[0]), [one.count for one in errors]
        ends = p + np.cumsum([0, *counts])
        self.count, self.prior = p, np.zeros((ends[-1], ends[-1]))
        self.prior[:p, :p] = np.diag(posterior.prior.deviations**-2.0)
        blocks = []
        for index, (number, record, error) in enumerate(zip(numbers, records, errors, strict=True)):
            part = slice(ends[index], ends[index + 1])
            self.prior[part, part] = error.precision(linear.size)
            block = np.zeros((ends[-1], number.shape[1]))
            block[:p], block[part] = number, record
            blocks.append(block)
        self.columns = np.concatenate(blocks, axis=1)
        self.here = np.concatenate([state.logs, *state.record])
        self.residual = np.concatenate(linear.whitened(posterior.residuals(state)))

    def white(self, change: Sequence[Array]) -> Array:
        """A change of the predictions (n,) per run, in one piece."""
        return np.concatenate(self._linear.whitened(change))

    def least(self, residual: Array, here: Array, own: Array | None = None) -> tuple[float, Array]:
        """The least squares with their priors, and where they are; ``own``: one more column, of any size."""
        columns, prior = self.columns, self.prior
        if own is not None:
            columns, here = np.vstack([columns, own]), np.append(here, 0.0)
            prior = np.pad(prior, (0, 1))
        step = np.linalg.solve(columns @ columns.T + prior, columns @ residual - prior @ here)
        residual = residual - step @ columns
        return float(residual @ residual + (here + step) @ prior @ (here + step)), here + step
