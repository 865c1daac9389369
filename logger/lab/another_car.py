"""A test whether a record is of another car than the model's.

Problem: with another car's file every effect that reduces the difference seems to be missing. Solution: where a model
explains next to nothing of what was measured, cars with very different masses, springs, dampers and tires are tried. If
one of them explains the record, and several of its numbers differ by far more than they are uncertain, the record is of
another car: a missing effect changes few numbers. A large change by one effect can look like several numbers, as of a
sensor far behind the centre of gravity, so that the other car has to explain more than any known effect does in a car
with this one's numbers: one round of the search for effects, on the car as its file has it, says how much (numbers that
were refitted to such a record are no car's any more).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from logger.arrays import Array, Bools
from logger.bounds import CONFLICT_SIGMA, UNUSUAL_SIGMA
from logger.lab.diagnosis import obstacles_of
from logger.lab.likelihood.map_fit import align, fit
from logger.lab.likelihood.posterior import Posterior
from logger.lab.likelihood.priors import Tolerance
from logger.lab.selection.candidate_fit import CandidateFit
from logger.lab.selection.screening import Baseline, Screened, misalignment
from logger.lab.selection.stepwise import Search
from logger.runs import Run, normalised_rms_error
from logger.simulation.virtual_drive import SEARCH_HZ, SimulatedRuns
from logger.vehicle.effect import Chosen, Effect, ForceEffect
from logger.vehicle.effects.sensor_gain import EFFECT as SENSOR_GAIN
from logger.vehicle.vehicle import Vehicle

POOR_ERROR, _GOOD_ERROR = 0.8, 0.35
"""From the first error on a model explains next to nothing: a third of the power (1 - 0.8 squared), a judgement. Up to
the second a car explains a record, or moves like it: nine tenths of the power (0.35 squared is 0.12)."""

(_GAIN,) = SENSOR_GAIN.parameters


@dataclass(frozen=True)
class AnotherCar:
    """A car that explains a record far better than the model.

    runs                  that were compared
    error, found_error    of the model, and of that car
    shares                by which its numbers differ from the model's, the farthest first, by name; one size that all
                          masses, springs and dampers share cannot be seen in accelerations, and is taken out
    """

    runs: SimulatedRuns
    error: float
    found_error: float
    shares: dict[str, float]


def another_car(runs: Sequence[Run], vehicle: Vehicle, effects: Sequence[Chosen], predictions: Sequence[Array],
                numbers: float) -> AnotherCar | None:
    """The other car that a record is of; None: it may be this one.

    predictions    of the model (n,) per run
    numbers        standard deviation of the car's numbers, as a share
    """
    anything = Tolerance(numbers=0.5, lengths=0.1)  # cars from a small one to a van
    if numbers >= anything.numbers or normalised_rms_error(runs, predictions) < POOR_ERROR:
        return None
    some = SimulatedRuns([_first_part(one) for one in dict.fromkeys((runs[0], runs[-1]))], SEARCH_HZ)
    wide = Posterior(some, vehicle, anything, vehicle)
    error = wide.error(align(wide, wide.start(effects)).state)
    if error < POOR_ERROR:
        return None
    start = wide.start(effects)
    likeliest = _cross_entropy_search(wide, effects, partial(normalised_rms_error, some.runs))
    drawn = wide.state_at(effects, likeliest, start.record, start.size)
    found = fit(align(wide, drawn), rounds=10).state
    found_error = wide.error(found)
    lengths = wide.prior.deviations < anything.numbers
    logs = np.where(lengths, found.logs, found.logs - np.median(found.logs[~lengths]))
    far = [index for index in np.argsort(-np.abs(logs)) if not lengths[index]
           and abs(logs[index]) > UNUSUAL_SIGMA * numbers]
    if found_error > _GOOD_ERROR or len(far) < 4:  # a judgement: a missing effect changes few numbers so far
        return None
    return AnotherCar(some, error, found_error,
                      {wide.prior.names[index]: float(np.expm1(logs[index])) for index in far})


@dataclass(frozen=True)
class LikeliestRig:
    """How the readings of runs compare with the rig, of all that a tolerance allows, whose motion is likest to them.

    gains     how many times what that rig does each run reads (1 + s,), of its first signal and of all others
    errors    NRMSE of that rig, times these gains, on each run (1 + s,)
    least     from this factor on, either way, a gain is no sensor's, and not what the vehicle's masses and springs may
              be off by where a force was measured; infinite where these are not known
    as_read   errors of the rig that is likest to what the runs read as it stands; empty: nothing asks for it
    """

    gains: Sequence[Array]
    errors: Sequence[Array]
    least: float
    as_read: Sequence[Array] = ()

    @property
    def explains(self) -> Array:
        """Whether it moves as each run did (runs,)."""
        return self._goes_along(_GOOD_ERROR)

    @property
    def goes_along(self) -> Array:
        """Whether each run is as it moves, not turned, as far as it explains something of it (runs,)."""
        return self._goes_along(POOR_ERROR)

    def _goes_along(self, error: float) -> Array:
        return np.array([errors[0] < error and gains[0] > 0
                         for gains, errors in zip(self.gains, self.errors, strict=True)])

    @property
    def is_misread(self) -> Array:
        """Whether each run reads as no sensor does (runs,)."""
        gains = np.array([one[0] for one in self.gains])
        return np.abs(np.log(np.where(self.explains, gains, 1.0))) > np.log(self.least)

    def misread_signals(self, runs: Sequence[Run]) -> list[Bools]:
        """Whether each signal beside the first (s,), per run, reads as no sensor does, though it follows a rig that
        explains that one: turned over, or by a factor; and no rig explains both as they were read. What all masses and
        forces may be off by changes a force, and all that moves alike."""
        found = []
        for place, (run, gains, errors) in enumerate(zip(runs, self.gains, self.errors, strict=True)):
            force = np.array([one.measures == "force" for one in run.signals], bool)
            gain = gains[1:] / np.where(force, 1.0, gains[0])
            least = np.where(force, self.least, _GAIN.high)
            off = (gain < 0) | (np.abs(np.log(np.maximum(np.abs(gain), 1e-300))) > np.log(least))
            off &= bool(self.explains[place]) & (errors[1:] < _GOOD_ERROR)
            found.append(off & ~(self.as_read[place][1:] < _GOOD_ERROR) if self.as_read else off)
        return found


def likeliest_rig(runs: Sequence[Run], vehicle: Vehicle, effects: Sequence[Chosen], predictions: Sequence[Array],
                  tolerance: Tolerance) -> LikeliestRig | None:
    """The rig whose motion is likest to that of runs, whatever the size of their readings; None where the model
    explains each of them.

    predictions    of the model (n,) per run
    """
    if all(_as_read(run, one).max() < POOR_ERROR for run, one in zip(runs, predictions, strict=True)):
        return None
    wide = Posterior(SimulatedRuns(list(map(_first_part, runs)), SEARCH_HZ), vehicle, tolerance)
    some = wide.runs.runs

    def found_by(errors: Callable[[Run, Array], Array]) -> list[Array]:
        logs = _cross_entropy_search(wide, effects, lambda found: float(np.linalg.norm(np.concatenate(
            [errors(run, one) for run, one in zip(some, found, strict=True)]))))
        return wide.runs.predict(wide.car(effects, logs))

    scale_std = wide.prior.scale_deviation if wide.shows_forces else 0.0
    least = max(_GAIN.high, np.exp(CONFLICT_SIGMA * scale_std)) if scale_std < 1 else np.inf
    best = found_by(lambda run, one: gains_and_errors(run, one)[1])
    gains, errors = zip(*map(gains_and_errors, some, best), strict=True)
    rig = LikeliestRig(gains, errors, least)
    if not any(one.any() for one in rig.misread_signals(some)):
        return rig
    return replace(rig, as_read=list(map(_as_read, some, found_by(_as_read))))


def gains_and_errors(run: Run, prediction: Array) -> tuple[Array, Array]:
    """How many times what a model does the signals of a run read (1 + s,), and NRMSE of the model times that."""
    read, model = _motions(run, prediction)
    gains = (read * model).sum(axis=1) / np.maximum((model**2).sum(axis=1), 1e-300)
    return gains, _sizes(read - gains[:, None] * model) / np.maximum(_sizes(read), 1e-300)


def _as_read(run: Run, prediction: Array) -> Array:
    """NRMSE of the signals of a run (1 + s,)."""
    read, model = _motions(run, prediction)
    return np.asarray(_sizes(read - model) / np.maximum(_sizes(read), 1e-300))


def _motions(run: Run, prediction: Array) -> tuple[Array, Array]:
    """The signals of a run and of a model (1 + s, n), without their means."""
    both = np.stack([run.measured_mps2, *run.more]), prediction.reshape(-1, run.count)
    read, model = (one[:, run.first:] - one[:, run.first:].mean(axis=1, keepdims=True) for one in both)
    return read, model


def _sizes(samples: Array) -> Array:
    return np.asarray(np.linalg.norm(samples, axis=1))


def _first_part(run: Run) -> Run:
    """The first 25 s of a run: some thirty bounces of the body are enough to recognise a car by."""
    return run.part(slice(round((run.skip_s + 25.0) * run.rate_hz)))


def _cross_entropy_search(wide: Posterior, effects: Sequence[Chosen], error_of: Callable[[list[Array]], float]
                          ) -> Array:
    """Logarithms (p,) of the numbers of a car that roughly explains a record: the best of many drawn around the best so
    far (the cross-entropy method: R. Y. Rubinstein, Methodology and Computing in Applied Probability 1,
    1999). Each round draws sixty and goes on around the mean of the best eight; their spread is kept from collapsing to
    less than 3 % of the prior's."""
    rng, deviations = np.random.default_rng(1), wide.prior.deviations
    middle, spread = np.zeros_like(deviations), 0.8 * deviations
    best, least = middle, np.inf
    for _ in range(6):
        drawn = middle + spread * rng.standard_normal((60, len(deviations)))
        errors = np.array([error_of(wide.runs.predict(wide.car(effects, one), rough=True)) for one in drawn])
        ranks = np.argsort(np.where(np.isfinite(errors), errors, np.inf))
        if errors[ranks[0]] < least:
            best, least = drawn[ranks[0]], float(errors[ranks[0]])
        best_of = drawn[ranks[:8]]
        middle, spread = best_of.mean(axis=0), np.maximum(best_of.std(axis=0), 0.03 * deviations)
    return best


def error_with_best_effect(runs: SimulatedRuns, vehicle: Vehicle, present: Sequence[Chosen],
                           known: Mapping[str, Effect], numbers: float) -> float:
    """Error of this car with the one effect that explains most, its numbers refitted under their prior; infinite
    where none can be tried. Without the compiler forces are not, as each would take minutes."""
    from logger.vehicle.stepping_loop import COMPILED  # loads the compiler, if there is one

    posterior = Posterior(runs, vehicle, Tolerance(numbers=numbers))
    obstacles = obstacles_of(posterior, known, present)
    tried = [one for name, one in known.items()
             if name not in obstacles and (COMPILED or not isinstance(one, ForceEffect))]
    if not tried:
        return np.inf
    start = posterior.start(present)
    search: Search[Baseline, Screened, CandidateFit] = Search(tried, len(present), misalignment(posterior, start))
    nominal = align(posterior, start).with_number_slopes(posterior.number_slopes(start, posterior.prior.steps))
    fits = search.round(Baseline.of(nominal), tried).fits
    return min((posterior.error(one.state) for one in fits), default=np.inf)
